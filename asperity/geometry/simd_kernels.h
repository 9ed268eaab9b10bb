#pragma once
// The inner loops of every search: what of eight boxes, or of eight triangles, is near.
// Each exists twice: plain C++, the oracle and the fallback, and AVX2, chosen once by what the processor has.
// Results are single precision and only ever used to discard; what remains is decided in double precision.

#include <algorithm>
#include <cstddef>

namespace asperity {

/// A box in single precision; empty until it includes something.
struct FloatBox {
  float lower[3] = {1e30F, 1e30F, 1e30F};
  float upper[3] = {-1e30F, -1e30F, -1e30F};

  void include(const float low[3], const float high[3]) noexcept {
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis] = std::min(lower[axis], low[axis]);
      upper[axis] = std::max(upper[axis], high[axis]);
    }
  }
  void include(const FloatBox& other) noexcept { include(other.lower, other.upper); }
  /// Half of its surface; 0 where it is empty.
  [[nodiscard]] float area() const noexcept {
    const float x = upper[0] - lower[0];
    const float y = upper[1] - lower[1];
    const float z = upper[2] - lower[2];
    return x < 0.0F ? 0.0F : x * y + y * z + z * x;
  }
};

/// Eight boxes side by side. An empty slot has lower = +inf, upper = -inf.
struct alignas(32) BoxesOf8 {
  float lower[3][8];
  float upper[3][8];

  void set(std::size_t slot, const FloatBox& box) noexcept {
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis][slot] = box.lower[axis];
      upper[axis][slot] = box.upper[axis];
    }
  }
};

/// Eight flat cylinders side by side: the set of points within `radius` of an axis and `half_height` of its middle.
/// They fit the leaf of a smooth surface far tighter than a box: what a ball resting on it nearly touches is few
/// cylinders.
struct alignas(32) CylindersOf8 {
  float centre[3][8];
  float axis[3][8];  ///< unit
  float radius[8];
  float half_height[8];
};

/// Eight triangles side by side: a corner and the two edges from it. An unused slot lies far away.
struct alignas(32) TrianglesOf8 {
  float corner[3][8];
  float edge1[3][8];
  float edge2[3][8];
};

/// What leaves out most of what does not come near a triangle: the planes a little above and below it, and a little
/// beyond its edges. A point lies beyond one of them where normal . point > limit.
struct PlanesAround {
  static constexpr int count = 5;
  float normal[count][3];  ///< of any length
  float limit[count];
};

/// Vectors from the closest points of eight triangles to a point, and their lengths.
struct alignas(32) DistancesOf8 {
  float offset[3][8];
  float distance[8];
};

/// One implementation of the inner loops. All functions are pure. [servo]
struct SearchKernels {
  /// Squared distances (m²) from `point` to eight boxes; answers a bit mask of those <= `bound`.
  unsigned (*boxes)(const BoxesOf8& boxes, const float point[3], float bound, float squared[8]) noexcept;
  /// Bit mask of the cylinders that come within `bound` (m) of `point`.
  unsigned (*cylinders)(const CylindersOf8& cylinders, const float point[3], float bound) noexcept;
  /// Entry parameters of the line origin + t * direction (t in 0 … `t_end`) into eight boxes grown by `margin`;
  /// answers a bit mask of the boxes met.
  unsigned (*ray)(const BoxesOf8& boxes, const float origin[3], const float inverse_direction[3], float t_end,
                  float margin, float entry[8]) noexcept;
  /// Bit mask of the boxes that meet `box`.
  unsigned (*meeting)(const BoxesOf8& boxes, const FloatBox& box) noexcept;
  /// Bit mask of the triangles that do not lie wholly beyond any one of the planes.
  unsigned (*within)(const TrianglesOf8& triangles, const PlanesAround& planes) noexcept;
  /// Closest points of eight triangles to `point`.
  void (*triangles)(const TrianglesOf8& triangles, const float point[3], DistancesOf8& out) noexcept;
};

/// Plain C++. [any]
const SearchKernels& plain_kernels() noexcept;
/// The fastest kernels this processor can run. [any]
const SearchKernels& best_kernels() noexcept;

}  // namespace asperity
