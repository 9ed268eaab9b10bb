#pragma once
// The parts of the shell that hold the relief over each face, and which of them keep apart. Private to surface.

#include <algorithm>
#include <cmath>

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

// Four floats side by side: the three corners of a face, the last of them twice; or a vector and a place unused.
using Corners = float __attribute__((vector_size(16)));

/// A vertex in single precision: where it is from a centre, and the shell's direction there.
struct RoundedVertex {
  Corners place;
  Corners direction;
};

/// A slab in single precision: for the direction that separates nearly all that boxes let through.
struct RoundedSlab {
  Corners base[3];
  Corners direction[3];
  float lowest;
  float highest;
  float centre[3];
};

inline RoundedSlab rounded_slab(const RoundedVertex* vertices, const TriangleMesh::Triangle& t, float lowest,
                                float highest) {
  RoundedSlab slab;
  const auto turned = [](const Corners& a, const Corners& b, const Corners& c, Corners(&out)[3]) {
    using Places = std::int32_t __attribute__((vector_size(16)));
    const Corners xy = __builtin_shuffle(a, b, Places{0, 4, 1, 5});
    out[0] = __builtin_shuffle(xy, c, Places{0, 1, 4, 4});
    out[1] = __builtin_shuffle(xy, c, Places{2, 3, 5, 5});
    out[2] = __builtin_shuffle(__builtin_shuffle(a, b, Places{2, 6, 2, 6}), c, Places{0, 1, 6, 6});
  };
  const RoundedVertex& a = vertices[t[0]];
  const RoundedVertex& b = vertices[t[1]];
  const RoundedVertex& c = vertices[t[2]];
  turned(a.place, b.place, c.place, slab.base);
  turned(a.direction, b.direction, c.direction, slab.direction);
  const Corners centre = (a.place + b.place + c.place) / 3.0F;
  for (int axis = 0; axis < 3; ++axis) slab.centre[axis] = centre[axis];
  slab.lowest = lowest;
  slab.highest = highest;
  return slab;
}

/// How far a slab reaches along an axis at most.
inline float highest_along(const RoundedSlab& slab, const float (&axis)[3]) {
  const Corners base = axis[0] * slab.base[0] + axis[1] * slab.base[1] + axis[2] * slab.base[2];
  const Corners lean = axis[0] * slab.direction[0] + axis[1] * slab.direction[1] + axis[2] * slab.direction[2];
  const Corners low = base + slab.lowest * lean;
  const Corners high = base + slab.highest * lean;
  const Corners most = low > high ? low : high;
  return std::max({most[0], most[1], most[2]});
}

/// Whether a plane across the line from one to the other surely separates them. `size`: more than the sum of the
/// coordinates of anything in either.
inline bool surely_apart(const RoundedSlab& one, const RoundedSlab& other, float size) {
  const float axis[3] = {other.centre[0] - one.centre[0], other.centre[1] - one.centre[1],
                         other.centre[2] - one.centre[2]};
  const float back[3] = {-axis[0], -axis[1], -axis[2]};
  // A sum of six products, of numbers that are rounded themselves.
  constexpr float rounding = 4e-6F;
  const float length = std::abs(axis[0]) + std::abs(axis[1]) + std::abs(axis[2]);
  return highest_along(one, axis) + highest_along(other, back) + rounding * length * size < 0.0F;
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
