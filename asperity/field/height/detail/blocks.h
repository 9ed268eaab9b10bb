#pragma once
// Pyramids of square blocks over a map's texels: which of them cover a span, and bounds rounded outwards. Private to
// field.

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "asperity/field/height/range.h"

namespace asperity {

/// The greatest float, or one or two below it, that is not above a value. [any]
inline float rounded_down(double value) noexcept {
  const float near = static_cast<float>(value);
  // The relative part is one to two units in the last place; the other one steps where that underflows.
  return static_cast<double>(near) > value ? near - (std::abs(near) * 0x1p-23F + 0x1p-149F) : near;
}

/// The same from above. [any]
inline float rounded_up(double value) noexcept {
  return -rounded_down(-value);
}

/// The blocks of a level along an axis of `texels`. [any]
inline std::size_t blocks_along(int texels, unsigned level) noexcept {
  return (static_cast<std::size_t>(texels - 1) >> level) + 1;
}

/// The blocks of a level along one axis that cover a span: one run, or two where the span goes over the border.
struct BlockRuns {
  std::size_t begin[2] = {0, 0};
  std::size_t end[2] = {0, 0};
  BlockRuns(const TexelSpan& span, int texels, unsigned level) noexcept {
    const auto block = [level](int texel) { return static_cast<std::size_t>(texel) >> level; };
    const int last = span.first + span.count - 1;
    begin[0] = block(span.first);
    end[0] = block(std::min(last, texels - 1)) + 1;
    if (last >= texels) end[1] = block(last - texels) + 1;
  }
  [[nodiscard]] std::size_t count() const noexcept { return end[0] - begin[0] + end[1]; }
};

}  // namespace asperity
