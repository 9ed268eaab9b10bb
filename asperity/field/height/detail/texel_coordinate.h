#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
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

/// The texel that one beyond the border shows: the map again, or mirrored half a texel outside. [any]
inline std::ptrdiff_t texel_shown_at(std::ptrdiff_t index, std::ptrdiff_t count, Wrap wrap) noexcept {
  const std::ptrdiff_t period = wrap == Wrap::repeat ? count : 2 * count;
  const std::ptrdiff_t within = (index % period + period) % period;
  return within < count ? within : period - 1 - within;
}

/// Fills the apron around a map stored bottom row first with `stride` = width + 2 `apron`, as the wrap mode answers
/// there. [build]
template <class T>
void fill_texel_apron(T* values, int width, int height, Wrap wrap, int apron = 1) {
  const std::ptrdiff_t stride = width + 2 * apron;
  for (std::ptrdiff_t y = 0; y < height; ++y) {
    T* row = values + (y + apron) * stride + apron;
    for (std::ptrdiff_t x = 1; x <= apron; ++x) {
      row[-x] = row[texel_shown_at(-x, width, wrap)];
      row[width - 1 + x] = row[texel_shown_at(width - 1 + x, width, wrap)];
    }
  }
  for (std::ptrdiff_t y = 1; y <= apron; ++y) {
    for (const std::ptrdiff_t to : {-y, height - 1 + y}) {
      const T* from = values + (texel_shown_at(to, height, wrap) + apron) * stride;
      std::copy(from, from + stride, values + (to + apron) * stride);
    }
  }
}

}  // namespace asperity
