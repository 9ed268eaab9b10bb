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

// Four floats side by side: the three corners of a face, the last of them twice.
using Corners = float __attribute__((vector_size(16)));

/// A slab in single precision about a centre: for the direction that separates nearly all that boxes let through.
struct RoundedSlab {
  Corners base[3];
  Corners direction[3];
  float lowest;
  float highest;
  float centre[3];
  float size;  ///< more than the coordinates of anything in it
};

inline RoundedSlab rounded_slab(const Slab& slab, const Vec3& about) {
  RoundedSlab rounded;
  const ShellPrism& prism = slab.prism;
  const Vec3 base = prism.corner - about;
  const Vec3 centre = base + (prism.edge_u + prism.edge_v) / 3.0;
  double size = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto all = [](double first, double by_u, double by_v) {
      const auto second = static_cast<float>(first + by_u);
      const auto third = static_cast<float>(first + by_v);
      return Corners{static_cast<float>(first), second, third, third};
    };
    rounded.base[axis] = all(base[axis], prism.edge_u[axis], prism.edge_v[axis]);
    rounded.direction[axis] = all(prism.direction[axis], prism.turn_u[axis], prism.turn_v[axis]);
    rounded.centre[axis] = static_cast<float>(centre[axis]);
    size += std::abs(base[axis]) + std::abs(prism.edge_u[axis]) + std::abs(prism.edge_v[axis]);
    size += std::max(std::abs(slab.heights.lowest), std::abs(slab.heights.highest)) *
            (std::abs(prism.direction[axis]) + std::abs(prism.turn_u[axis]) + std::abs(prism.turn_v[axis]));
  }
  rounded.lowest = static_cast<float>(slab.heights.lowest);
  rounded.highest = static_cast<float>(slab.heights.highest);
  rounded.size = static_cast<float>(size);
  return rounded;
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

/// Whether a plane across the line from one to the other surely separates them.
inline bool surely_apart(const RoundedSlab& one, const RoundedSlab& other) {
  const float axis[3] = {other.centre[0] - one.centre[0], other.centre[1] - one.centre[1],
                         other.centre[2] - one.centre[2]};
  const float back[3] = {-axis[0], -axis[1], -axis[2]};
  // A sum of six products, of numbers that are rounded themselves.
  constexpr float rounding = 2e-6F;
  const float length = std::abs(axis[0]) + std::abs(axis[1]) + std::abs(axis[2]);
  return highest_along(one, axis) + highest_along(other, back) + rounding * length * (one.size + other.size) < 0.0F;
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
