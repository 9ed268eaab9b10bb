#pragma once
// What can be touched: the SurfaceView concept, what its queries answer, and what they may remember.

#include <concepts>

#include "asperity/core/place.h"
#include "asperity/core/work.h"
#include "asperity/field/volume/cell_polynomial.h"
#include "asperity/field/volume/sparse_grid.h"
#include "asperity/geometry/contact.h"
#include "asperity/geometry/triangle_patch.h"
#include "asperity/surface/mesh/flat_frame.h"
#include "asperity/surface/relief/frame.h"
#include "asperity/surface/walk_step.h"

namespace asperity {

class KeptCells;
class ReliefBlocks;

/// The last two cells of a field that were read, and those around balls.
struct CellCache {
  CellPolynomial cell;
  CellPolynomial other;
  bool other_last = false;    ///< `other` was used after `cell`
  KeptCells* kept = nullptr;  ///< of what balls look at, in the caller's hands; none: nothing is kept
  /// The one of the two that holds a cell, or else the one that was not used last. [servo]
  CellPolynomial& slot(std::uint64_t owner, int level, const CellIndex& index) noexcept {
    const auto holds = [&](const CellPolynomial& c) { return c.owner == owner && c.level == level && c.cell == index; };
    if (holds(cell)) {
      other_last = false;
    } else {
      other_last = holds(other) || !other_last;
    }
    return other_last ? other : cell;
  }
  /// The one of the two in whose cell a place lies, clear of its faces; none: that is not known of either. [servo]
  const CellPolynomial* around(std::uint64_t owner, int level, const Vec3& p) noexcept {
    const auto has = [&](const CellPolynomial& c) {
      return c.owner == owner && c.level == level && c.known && c.has_well_inside(p);
    };
    if (has(other_last ? other : cell)) return other_last ? &other : &cell;
    if (!has(other_last ? cell : other)) return nullptr;
    other_last = !other_last;
    return other_last ? &other : &cell;
  }
};

/// What queries of one surface remember, in the caller's hands. Each reader checks that it is of what it asks about:
/// with another surface's, or an empty one, every answer is the same to the last bit, and only slower. [servo]
struct SurfaceCache {
  TrianglePatch patch;
  ReliefCache relief;
  ReliefBlocks* blocks = nullptr;  ///< of what balls look at, in the caller's hands; none: nothing is kept
  FacePlace<FlatFrame> flat;       ///< the face of a bare mesh that was asked about last
  FlatAhead ahead;                 ///< and the one that comes next
  CellCache cells;
  SparseHint sparse;
  WorkMeter* work = nullptr;  ///< what queries tell what they took, in the caller's hands; none: nothing
};

/// The implicit function of a surface at a point: negative inside, zero on it, positive outside.
struct FieldSample {
  double value = infinity;           ///< m
  Vec3 gradient = Vec3::Zero();      ///< m/m; of length 1 where `value` is a true distance
  double height = 0.0;               ///< relief height of the coat under the point (m); 0 without a coat
  std::uint32_t element = no_index;  ///< face under the point; no_index beyond the provider's reach
};

/// How a descent ended.
enum class DescentEnd {
  rest,     ///< no move along the surface comes nearer: a local minimum of the distance
  left,     ///< the goal lies outside the tangent plane: the surface no longer holds the point
  rim,      ///< at the rim of an open surface, and the goal lies beyond it
  limited,  ///< out of moves; the point is on the surface and nearer than before
  blocked,  ///< another part of the surface is in the way
};

/// Where a point on a surface is led.
struct Goal {
  Vec3 point = Vec3::Zero();  ///< m, object frame
  double friction = 0.0;      ///< Coulomb's coefficient: the point comes to rest where its pull lies on that cone
  bool may_leave = true;      ///< false: stays on the surface whatever the goal (closest points)
  Sides sides = Sides::both;  ///< that can be in the way
  bool exactly = false;       ///< goes on until rounding alone is left, of reliefs
  bool any_sheet = false;     ///< may pass from one sheet to another, of isosurfaces: a place is all that is asked for
  int moves = 1024;           ///< places that it may look at
  double flattest = usually_flattest;  ///< from which share of its metric's curvature on Newton's step is trusted
  /// The same of evaluations, where a place may take several of them.
  std::uint32_t work = no_limit;
  static constexpr std::uint32_t no_limit = ~0U;
};

/// What one surface is during one tick, in its own object frame: a few pointers and what is felt of it now (a level, a
/// threshold, a moment of its coat). All queries const, noexcept, without allocation.
///   Spot         the surface at a place: its point and its front normal, and what else a walk along it needs
///   first_touch  first touch of a point moving along a segment, from either side or the front alone
///   nearest      the surface's nearest point within a bound; `start`: a place that may be near it, or none
///   at           the surface at a place; `normal`: the front normal that was answered with it last
///   descend      leads a place along the surface towards a goal, and answers how that ended
///   launch       from where a point that leaves a place flies on; false where there is no room to fly
///   skin         distance that separates a flying point from the surface
///   grain        smallest length over which the surface changes (m)
///   has_folds    whether two of its tangent planes may meet in an edge
template <class V>
concept SurfaceView = requires(const V& v, const Segment& motion, const Vec3& p, Sides sides, Place& place,
                               typename V::Spot& spot, const Goal& goal) {
  { v.first_touch(motion, sides) }
  noexcept->std::same_as<SweptHit>;
  { v.nearest(p, 0.0, place) }
  noexcept->std::same_as<Foot>;
  { v.at(place, p) }
  noexcept->std::convertible_to<typename V::Spot>;
  { v.descend(place, spot, goal) }
  noexcept->std::same_as<DescentEnd>;
  { v.launch(place, spot, spot.point) }
  noexcept->std::same_as<bool>;
  { v.skin() }
  noexcept->std::same_as<double>;
  { v.grain() }
  noexcept->std::same_as<double>;
  { v.has_folds() }
  noexcept->std::same_as<bool>;
};

/// Whether all of what draws a point on a surface to a goal lies within the friction cone. `normal` unit, away from the
/// surface. [servo]
inline bool within_cone(const Vec3& point, const Vec3& normal, const Vec3& goal, double coefficient) noexcept {
  const Vec3 spring = point - goal;
  const double push = spring.dot(normal);
  if (!(push > 0.0) || coefficient <= 0.0) return point == goal;
  return (spring - push * normal).norm() <= coefficient * push;
}

/// Where a point without friction would be led to so that it rests where friction stops it: the goal moved back along
/// the pull's tangential part by what the cone holds, or the point itself while all of the pull lies within the cone.
/// `normal` unit, away from the surface. [servo]
inline Vec3 friction_goal(const Vec3& point, const Vec3& normal, const Vec3& goal, double coefficient) noexcept {
  const Vec3 spring = point - goal;
  const double push = spring.dot(normal);
  if (!(push > 0.0) || coefficient <= 0.0) return goal;
  const Vec3 along = spring - push * normal;
  const double length = along.norm();
  const double held = coefficient * push;
  if (length <= held) return point;
  return goal + (held / length) * along;
}

}  // namespace asperity
