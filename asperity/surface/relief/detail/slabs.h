#pragma once
// The parts of the shell that hold the relief over each face, and which of them keep apart. Private to surface.

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "asperity/field/height/range.h"
#include "asperity/surface/shell.h"

namespace asperity {

/// What a plane through a prism's relief along `axis` has on either side: the extent of its hull along it.
struct Extent {
  double lowest = infinity;
  double highest = -infinity;
};

inline Extent extent_along(const ShellPrism& prism, const HeightRange& heights, const Vec3& axis) {
  const double base[3] = {axis.dot(prism.corner), axis.dot(prism.edge_u), axis.dot(prism.edge_v)};
  const double lean[3] = {axis.dot(prism.direction), axis.dot(prism.turn_u), axis.dot(prism.turn_v)};
  Extent extent;
  for (int k = 0; k < 3; ++k) {
    const double at = k == 0 ? base[0] : base[0] + base[k];
    const double along = k == 0 ? lean[0] : lean[0] + lean[k];
    const double low = heights.lowest * along;
    const double high = heights.highest * along;
    extent.lowest = std::min(extent.lowest, at + std::min(low, high));
    extent.highest = std::max(extent.highest, at + std::max(low, high));
  }
  return extent;
}

/// One face's part of the shell, as high as the relief over it.
struct Slab {
  ShellPrism prism;
  HeightRange heights;
};

/// Whether a plane across this direction separates what two slabs hold. Cheap, and right for most pairs that boxes let
/// through.
inline bool separated(const Slab& a, const Slab& b, const Vec3& axis) {
  const Extent one = extent_along(a.prism, a.heights, axis);
  const Extent other = extent_along(b.prism, b.heights, axis);
  return one.highest < other.lowest || other.highest < one.lowest;
}

/// Tries the directions that separate most pairs: from one to the other, across either triangle, across their edges.
inline bool slabs_apart(const Slab& one, const Slab& other) {
  const ShellPrism& a = one.prism;
  const ShellPrism& b = other.prism;
  if (separated(one, other, b.base_at(1.0 / 3.0, 1.0 / 3.0) - a.base_at(1.0 / 3.0, 1.0 / 3.0))) return true;
  const Vec3 normal = a.edge_u.cross(a.edge_v);
  const Vec3 other_normal = b.edge_u.cross(b.edge_v);
  if (separated(one, other, normal) || separated(one, other, other_normal)) return true;
  const Vec3 edges[3] = {a.edge_u, a.edge_v, a.edge_v - a.edge_u};
  const Vec3 other_edges[3] = {b.edge_u, b.edge_v, b.edge_v - b.edge_u};
  for (int k = 0; k < 3; ++k) {
    if (separated(one, other, normal.cross(edges[k])) || separated(one, other, other_normal.cross(other_edges[k])))
      return true;
  }
  return false;
}

using EightFloats = float __attribute__((vector_size(32)));
using EightPlaces = std::int32_t __attribute__((vector_size(32)));

/// A vertex in single precision.
// Told how to lie: where a compiler may not use AVX it takes half of that to be enough.
struct alignas(32) RoundedVertex {
  EightFloats place_and_direction;  ///< of the shell there, the fourth and eighth unused
};

/// A slab in single precision: for the direction that separates nearly all that boxes let through.
struct alignas(32) RoundedSlab {
  EightFloats corner[3];
  EightFloats lowest;  ///< of its heights, eight times
  EightFloats highest;
};

[[gnu::always_inline]] inline void round_slab(const RoundedVertex* vertices, const TriangleMesh::Triangle& t,
                                              float lowest, float highest, RoundedSlab& slab) {
  for (std::size_t k = 0; k < 3; ++k) slab.corner[k] = vertices[t[k]].place_and_direction;
  slab.lowest = EightFloats{} + lowest;
  slab.highest = EightFloats{} + highest;
}

/// Sums over each half of three, as (a, b, c, c).
[[gnu::always_inline]] inline void sum_halves(const EightFloats& a, const EightFloats& b, const EightFloats& c,
                                              EightFloats& sums) {
  constexpr EightPlaces lower{0, 8, 1, 9, 4, 12, 5, 13};
  constexpr EightPlaces upper{2, 10, 3, 11, 6, 14, 7, 15};
  const EightFloats ab = __builtin_shuffle(a, b, lower) + __builtin_shuffle(a, b, upper);
  const EightFloats cc = __builtin_shuffle(c, c, lower) + __builtin_shuffle(c, c, upper);
  sums = __builtin_shuffle(ab, cc, EightPlaces{0, 1, 8, 9, 4, 5, 12, 13}) +
         __builtin_shuffle(ab, cc, EightPlaces{2, 3, 10, 11, 6, 7, 14, 15});
}

/// How far a slab reaches along an axis at most, in each place of the first half. `axis`: twice.
[[gnu::always_inline]] inline void highest_along(const RoundedSlab& slab, const EightFloats& axis, EightFloats& most) {
  EightFloats base;
  sum_halves(slab.corner[0] * axis, slab.corner[1] * axis, slab.corner[2] * axis, base);
  const EightFloats lean = __builtin_shuffle(base, EightPlaces{4, 5, 6, 7, 4, 5, 6, 7});
  const EightFloats low = base + slab.lowest * lean;
  const EightFloats high = base + slab.highest * lean;
  most = low > high ? low : high;
}

/// Whether a plane across the line from one to the other surely separates them. `size`: more than the sum of the
/// coordinates of anything in either.
[[gnu::always_inline]] inline bool surely_apart(const RoundedSlab& one, const RoundedSlab& other, float size) {
  const EightFloats between =
      ((other.corner[0] - one.corner[0]) + (other.corner[1] - one.corner[1])) + (other.corner[2] - one.corner[2]);
  const EightFloats axis = __builtin_shuffle(between, EightPlaces{0, 1, 2, 3, 0, 1, 2, 3});
  // A sum of six products, of numbers that are rounded themselves.
  constexpr float rounding = 4e-6F;
  const EightFloats length = axis < 0.0F ? -axis : axis;
  EightFloats ahead;
  EightFloats behind;
  highest_along(one, axis, ahead);
  highest_along(other, -axis, behind);
  return std::max({ahead[0], ahead[1], ahead[2]}) + std::max({behind[0], behind[1], behind[2]}) +
             rounding * (length[0] + length[1] + length[2]) * size <
         0.0F;
}

/// Around the hull of a slab.
inline Box box_around(const Slab& slab) {
  Box box;
  for (int k = 0; k < 3; ++k) {
    const Vec3 base = slab.prism.base_at(k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0);
    const Vec3 direction = slab.prism.direction_at(k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0);
    box.include(base + slab.heights.lowest * direction);
    box.include(base + slab.heights.highest * direction);
  }
  return box;
}

}  // namespace asperity
