#pragma once
// Half-spaces that a proxy must stay in, and its place nearest to a goal within them.

#include <algorithm>
#include <cstdint>

#include "asperity/core/fixed_vector.h"
#include "asperity/core/math.h"
#include "asperity/geometry/contact.h"

namespace asperity {

/// A half-space the proxy must stay in: normal . x >= offset. World frame.
struct ConstraintPlane {
  Vec3 normal = Vec3::Zero();  ///< unit
  double offset = 0.0;         ///< m, without skin
  double skin = 0.0;           ///< m, added while the proxy moves, left out of forces
  std::uint32_t owner = 0;     ///< which constraint of the solve it belongs to
  Foot contact;                ///< object frame
};
/// Through a place, of no owner. [servo]
inline ConstraintPlane plane_through(const Vec3& point, const Vec3& normal) noexcept {
  return {normal, normal.dot(point), 0.0, 0, {}};
}
using PlaneSet = FixedVector<ConstraintPlane, 24>;
/// Whether one of the same surface with the same direction is there already. [servo]
inline bool stands_among(const ConstraintPlane& plane, const PlaneSet& planes) noexcept {
  return std::any_of(planes.begin(), planes.end(), [&](const ConstraintPlane& other) {
    return other.owner == plane.owner && other.normal == plane.normal;
  });
}

/// The point nearest to a goal within a set of half-spaces.
struct PlaneProjection {
  struct Active {
    std::size_t plane = 0;    ///< index into the set
    double multiplier = 0.0;  ///< m, above 0
  };
  Vec3 point = Vec3::Zero();      ///< goal + sum of multiplier * normal
  FixedVector<Active, 3> active;  ///< the planes that hold it
  bool feasible = false;          ///< false when no choice of up to three planes satisfies them all
};

/// Exact active-set projection: every choice of none, one, two and three planes, first that satisfies all. A point has
/// three degrees of freedom, so more are never needed. `with_skin` adds each plane's skin to its offset. [servo]
PlaneProjection project_onto_planes(const Vec3& goal, const PlaneSet& planes, bool with_skin) noexcept;

/// The same for one plane with its skin. [servo]
inline Vec3 onto_plane(const Vec3& goal, const ConstraintPlane& plane) noexcept {
  return goal + std::max(0.0, plane.offset + plane.skin - plane.normal.dot(goal)) * plane.normal;
}

/// Moves `p` to the point nearest to it that lies on all of up to three planes, each with its skin. False, and `p`
/// anywhere, where they all but agree in direction. [servo]
bool onto_all(const PlaneSet& planes, Vec3& p) noexcept;

/// Of a step along what bends: the share of it after which a parabola is nearest, by what the step would gain to first
/// order (m, above 0) and what it has lost instead (m; below 0: gained). At most a half. [servo]
inline double nearest_share(double gain, double lost) noexcept {
  return 0.5 * gain / (gain + std::max(0.0, lost));
}

/// Where the proxy rests, and what holds it there.
struct ConstraintSolution {
  Vec3 proxy = Vec3::Zero();   ///< m, one skin above what it touches
  PlaneSet planes;             ///< touched at `proxy`
  PlaneProjection projection;  ///< of the probe onto `planes`, without skin
  bool converged = false;
  /// Whether the planes explain all of where the proxy is.
  [[nodiscard]] bool settled() const noexcept { return converged && projection.feasible; }
};

/// Where a ball that rests on one edge or corner is led: onto the ray from there to the goal, and along the edge
/// (`edge`: unit, zero on a corner) as far as the goal. The edge's offset is round; the nearest point of its tangent
/// plane would be approached in many small rolls, this one is reached in two. With the goal near the edge itself every
/// direction is nearly as good, and the ray is no guide: nearer than `least_distance` (of the ball's radius). [servo]
inline Vec3 rolling_target(const ConstraintPlane& plane, const Vec3& foot, const Vec3& edge, const Vec3& goal,
                           const Vec3& otherwise, double least_distance) noexcept {
  constexpr double least_cosine = 0.7;
  const Vec3 slide = edge.dot(goal - foot) * edge;
  const Vec3 towards = goal - foot - slide;
  const double radius = plane.offset + plane.skin - plane.normal.dot(foot);
  const double distance = towards.norm();
  const double along = towards.dot(plane.normal);
  if (distance < least_distance * radius || along < least_cosine * distance) return otherwise;
  return foot + slide + towards * (radius / along);
}

}  // namespace asperity
