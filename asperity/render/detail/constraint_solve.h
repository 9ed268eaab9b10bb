#pragma once
// The joint constraint solve: where the proxy goes within one tick. Used by every law that moves the proxy.

#include <algorithm>
#include <cstdint>
#include <utility>

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
using PlaneSet = FixedVector<ConstraintPlane, 24>;

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

/// Where the proxy rests, and what holds it there.
struct ConstraintSolution {
  Vec3 proxy = Vec3::Zero();   ///< m, one skin above what it touches
  PlaneSet planes;             ///< touched at `proxy`
  PlaneProjection projection;  ///< of the probe onto `planes`, without skin
  bool converged = false;
};

/// Where a ball that rests on one edge or corner is led: onto the ray from there to the goal. The edge's offset is
/// round; the nearest point of its tangent plane would be approached in many small rolls, this one is reached in two.
/// With the goal near the edge itself every direction is nearly as good, and the ray is no guide. [servo]
inline Vec3 rolling_target(const ConstraintPlane& plane, const Vec3& foot, const Vec3& goal,
                           const Vec3& otherwise) noexcept {
  constexpr double least_cosine = 0.7;
  constexpr double least_distance = 0.2;  // of the ball's radius
  const Vec3 towards = goal - foot;
  const double radius = plane.offset + plane.skin - plane.normal.dot(foot);
  const double distance = towards.norm();
  const double along = towards.dot(plane.normal);
  if (distance < least_distance * radius || along < least_cosine * distance) return otherwise;
  return foot + towards * (radius / along);
}

/// Moves the proxy from `from` to the constrained local minimiser of its distance to `goal` (Zilles and Salisbury
/// 1995).
///
/// Repeats: planes touched here; the point nearest to the goal within them; motion there, stopped by the first touch.
/// Each motion is swept, so nothing is passed through; each ends nearer to the goal. `Constraints` answers, in the
/// world frame,
///   void contacts(const Vec3& position, PlaneSet& out)   and   double sweep(const Segment& motion)   (fraction of the
///   motion)
/// rolls(plane), whether the ball rests on an edge or corner there, with its foot(plane), and tolerance(), the distance
/// (m) below which a further move is not worth making. [servo]
template <class Constraints>
ConstraintSolution solve_constraints(Constraints& constraints, const Vec3& from, const Vec3& goal) noexcept {
  constexpr int move_limit = 64;
  // Rarely needed, from this move on: planes of the last place are kept for one move in four, for valleys so flat that
  // either side is left before the other is felt; and a ball right above the edge it rolls over may stop, or roll in
  // larger steps.
  constexpr int patience = 8;
  constexpr double least_gain = 1e-6;
  ConstraintSolution solution;
  solution.proxy = from;
  PlaneSet earlier;
  double distance = infinity;
  double stride = 1.0;
  for (int move = 0; move < move_limit; ++move) {
    const bool patient = move >= patience;
    if (patient) earlier = solution.planes;
    solution.planes.clear();
    constraints.contacts(solution.proxy, solution.planes);
    const bool single = solution.planes.size() == 1;
    const bool rolls = move > 0 && single && constraints.rolls(solution.planes[0]);
    Vec3 target =
        single ? onto_plane(goal, solution.planes[0]) : project_onto_planes(goal, solution.planes, true).point;
    const Vec3 foot = rolls ? constraints.foot(solution.planes[0]) : goal;
    if (rolls) target = rolling_target(solution.planes[0], foot, goal, target);
    Vec3 step = target - solution.proxy;
    if (step.norm() <= constraints.tolerance()) {
      // Without contact nothing may remain between proxy and probe: free space gives no force at all.
      if (solution.planes.empty()) solution.proxy = target;
      solution.converged = true;
      break;
    }
    if (rolls && patient) {
      if ((goal - foot).dot(solution.planes[0].normal) < 0.0) {
        // The edge is between ball and goal: the ball rolls off it, slowly at first.
        stride *= 2.0;
        step *= std::min(stride, 0.2 * (solution.proxy - foot).norm() / step.norm());
      } else {
        const double now = (solution.proxy - goal).norm();
        solution.converged = std::exchange(distance, now) - now < least_gain * now;
        if (solution.converged) break;
      }
    } else if (patient && move % 4 == 0) {
      PlaneSet both = solution.planes;
      for (const ConstraintPlane& plane : earlier) both.push_back(plane);
      step = project_onto_planes(goal, both, true).point - solution.proxy;
    }
    const double t = constraints.sweep(Segment{solution.proxy, solution.proxy + step});
    solution.proxy = t < 1.0 ? Vec3(solution.proxy + t * step) : Vec3(solution.proxy + step);
  }
  solution.projection = project_onto_planes(goal, solution.planes, false);
  return solution;
}

}  // namespace asperity
