#pragma once
// What can be touched: the SurfaceQuery concept and the closed set of providers.

#include <concepts>
#include <string_view>
#include <type_traits>
#include <variant>

#include "asperity/core/math.h"
#include "asperity/field/cell_polynomial.h"
#include "asperity/field/sparse_grid.h"
#include "asperity/geometry/contact.h"
#include "asperity/geometry/triangle_patch.h"
#include "asperity/surface/relief_frame.h"

namespace asperity {

/// What a query of an isosurface remembers: the last two cells, and the nearest point found last.
struct IsoHint {
  CellPolynomial cell;
  CellPolynomial other;
  bool other_last = false;  ///< `other` was used after `cell`
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
  Vec3 foot = Vec3::Zero();
  bool has_foot = false;
};

/// What a query of a parametric surface remembers: the last foot, and where a proxy on it rests.
struct ParametricHint {
  std::uint64_t owner = 0;  ///< identity of the surface; 0: nothing
  Vec2 uv = Vec2::Zero();
};

/// What a query remembers of the last one. A cache in the caller's hands: re-validated by the provider that reads it,
/// never trusted, free to be thrown away. One per probe and instance. [servo]
struct Hint {
  TrianglePatch patch;
  CoatMoment moment;  ///< no cache: the state of a coat that the caller asks about
  ReliefPlace relief;
  IsoHint iso;
  SparseHint sparse;
  ParametricHint parametric;
};

/// The implicit function of a surface at a point: negative inside, zero on it, positive outside.
struct FieldSample {
  double value = infinity;           ///< m
  Vec3 gradient = Vec3::Zero();      ///< m/m; of length 1 where `value` is a true distance
  double height = 0.0;               ///< relief height of the coat under the point (m); 0 without a coat
  std::uint32_t element = no_index;  ///< face under the point; no_index beyond the provider's reach
};

/// A provider answers these queries, all const, noexcept and without allocation, in its own object frame.
///   segment   first touch of a ball of radius r moving along a segment, from either side or the front alone
///   contacts  every plane that such a ball touches where it rests: what a constraint solve needs at once. (A solve
///   that
///             only knew the last hit could not rest in a corner without finding the other walls again by moving.)
///   closest   the surface's nearest point within a bound
///   eval      signed value and gradient of the implicit function
///   skin      distance that separates a resting probe from the surface; contacts and segment use it, forces do not
template <class S>
concept SurfaceQuery = requires(const S& s, const Segment& g, const Vec3& p, double r, Sides sides, Hint& h,
                                ContactSet& out) {
  { s.segment(g, r, sides, h) }
  noexcept->std::same_as<SweptHit>;
  { s.contacts(p, r, sides, h, out) }
  noexcept->std::same_as<void>;
  { s.closest(p, r, h) }
  noexcept->std::same_as<Foot>;
  { s.eval(p, h) }
  noexcept->std::same_as<FieldSample>;
  { s.skin() }
  noexcept->std::same_as<double>;
  { s.bounds() }
  noexcept->std::same_as<Box>;
};

/// A base mesh with a coat over it, each triangle owning a prism: what Algorithms 1 and 2 need.
template <class S>
concept HasPrisms = requires(const S& s) {
  s.base();
  s.coat();
  s.prisms();
};

}  // namespace asperity
