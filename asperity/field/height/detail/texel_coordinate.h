#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "asperity/field/height/map.h"

namespace asperity {

/// Brings a texture coordinate into 0 to 1 by repeating or clamping it. Right at any magnitude; a coordinate that is
/// not finite reads as 0. A repeated coordinate a rounding error below a whole number may answer 1 itself. [servo]
inline double unit_coordinate(double s, Wrap wrap) noexcept {
  if (!(std::abs(s) < 0x1p31)) [[unlikely]] {
    if (!std::isfinite(s)) return 0.0;
    return wrap == Wrap::clamp ? (s < 0.0 ? 0.0 : 1.0) : s - std::floor(s);
  }
  if (wrap == Wrap::clamp) return std::clamp(s, 0.0, 1.0);
  const double fraction = s - static_cast<double>(static_cast<std::int64_t>(s));
  return fraction < 0.0 ? fraction + 1.0 : fraction;
}

/// The texel under a coordinate and the place within it.
struct TexelPlace {
  int index = 0;        ///< 0 ... count - 1
  double offset = 0.0;  ///< texels from its centre, -0.5 to 0.5
};

/// `unit` is a coordinate from 0 to 1 over `count` texels. [servo]
inline TexelPlace texel_under(double unit, int count) noexcept {
  const double position = unit * count;
  const int index = std::min(static_cast<int>(position), count - 1);
  return {index, position - index - 0.5};
}

/// The pair of texels whose centres enclose a coordinate. `lower` runs from -1 to count - 1, its partner is lower + 1.
struct TexelPair {
  int lower = 0;
  double fraction = 0.0;  ///< way from the lower centre to the upper one, 0 to 1
};

/// `unit` is a coordinate from 0 to 1 over `count` texels. [servo]
inline TexelPair texels_around(double unit, int count) noexcept {
  const double position = unit * count;
  const int lower = static_cast<int>(position + 0.5) - 1;
  return {lower, position - lower - 0.5};
}

/// Fills the apron of one texel around a map stored bottom row first with `stride` = width + 2, as the wrap mode
/// answers there. [build]
template <class T>
void fill_texel_apron(T* values, int width, int height, Wrap wrap) {
  const std::ptrdiff_t stride = width + 2;
  const bool repeat = wrap == Wrap::repeat;
  for (std::ptrdiff_t y = 1; y <= height; ++y) {
    T* row = values + y * stride;
    row[0] = row[repeat ? width : 1];
    row[width + 1] = row[repeat ? 1 : width];
  }
  const T* below = values + (repeat ? height : 1) * stride;
  const T* above = values + (repeat ? 1 : height) * stride;
  std::copy(below, below + stride, values);
  std::copy(above, above + stride, values + (height + 1) * stride);
}

}  // namespace asperity
