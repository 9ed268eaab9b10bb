#include "asperity/surface/parametric/patches.h"

#include <limits>

namespace asperity {

namespace {

/// The largest float that is not above `x`, and one step further: stored boxes hold what they bound.
float rounded_down(double x) {
  return std::nextafter(static_cast<float>(x), -std::numeric_limits<float>::infinity());
}
float rounded_up(double x) {
  return std::nextafter(static_cast<float>(x), std::numeric_limits<float>::infinity());
}

}  // namespace

ParametricPatches::ParametricPatches(int levels, const std::vector<Box>& leaves) : levels_(levels) {
  const auto deepest = static_cast<unsigned>(levels);
  boxes_.resize(index(deepest + 1, 0, 0));
  const std::uint32_t side = count();
  for (std::uint32_t row = 0; row < side; ++row) {
    for (std::uint32_t column = 0; column < side; ++column) {
      const Box& leaf = leaves[static_cast<std::size_t>(row) * side + column];
      FloatBox& out = boxes_[index(deepest, column, row)];
      for (int a = 0; a < 3; ++a) {
        out.lower[a] = rounded_down(leaf.lower[a]);
        out.upper[a] = rounded_up(leaf.upper[a]);
      }
    }
  }
  for (unsigned level = deepest; level-- > 0;) {
    for (std::uint32_t row = 0; row < (1U << level); ++row) {
      for (std::uint32_t column = 0; column < (1U << level); ++column) {
        FloatBox& all = boxes_[index(level, column, row)];
        for (std::uint32_t k = 0; k < 4; ++k)
          all.include(boxes_[index(level + 1, 2 * column + (k & 1U), 2 * row + (k >> 1U))]);
      }
    }
  }
}

}  // namespace asperity
