#include "asperity/field/volume/scalar_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace asperity {

std::size_t sample_bytes(SampleType type) {
  return with_samples_of(type, []<class Sample>() { return sizeof(Sample); });
}

Status SampleSurvey::take(const SampleArray& samples, const GridAxes& axes, std::size_t first_layer,
                          const std::string& name) {
  const auto take_all = [&](const auto& values) -> Status {
    for (std::size_t n = 0; n < values.size(); ++n) {
      const auto value = static_cast<double>(values[n]);
      if (std::isnan(value)) {
        ++unknown;
        continue;
      }
      if (std::isinf(value)) {
        const std::size_t width = axes[0].size();
        const std::size_t layer = width * axes[1].size();
        return bad_value("is infinite",
                         fmt::format("{}{}sample ({}, {}, {})", name, name.empty() ? "" : ", ", n % width,
                                     n % layer / width, first_layer + n / layer),
                         "finite values, or not-a-number where nothing is known");
      }
      lowest = std::min(lowest, value);
      highest = std::max(highest, value);
    }
    return success();
  };
  return std::visit(take_all, samples);
}

Result<ScalarGrid> ScalarGrid::build(GridAxes axes, SampleArray samples, std::string name) {
  std::size_t expected = 1;
  for (const GridAxis& axis : axes) {
    if (axis.size() < 2) return bad_value("has an axis without cells", name, "two nodes or more along each axis");
    expected *= axis.size();
  }
  ScalarGrid grid;
  grid.axes_ = std::move(axes);
  grid.samples_ = std::move(samples);
  grid.name_ = std::move(name);
  if (grid.size() != expected) {
    return refused(ErrorCode::mismatch,
                   fmt::format("has {} samples for {} x {} x {} places", grid.size(), grid.axis(0).size(),
                               grid.axis(1).size(), grid.axis(2).size()),
                   grid.name_, fmt::format("{} samples", expected));
  }
  ASPERITY_CHECK(grid.survey_.take(grid.samples_, grid.axes_, 0, grid.name_));
  if (grid.unknown() == expected)
    return bad_value("holds no sample that is a number", grid.name_, "samples that are numbers");
  return grid;
}

ScalarGrid ScalarGrid::placed(double scale, const Vec3& offset) && {
  for (std::size_t a = 0; a < 3; ++a) axes_[a] = axes_[a].placed(scale, offset[static_cast<int>(a)]);
  return std::move(*this);
}

std::size_t ScalarGrid::memory_bytes() const noexcept {
  std::size_t bytes = sizeof(*this) + size() * sample_bytes(type());
  for (const GridAxis& axis : axes_) bytes += axis.memory_bytes();
  return bytes;
}

double otsu_threshold(const ScalarGrid& grid) {
  constexpr std::size_t bins = 256;
  const double low = grid.lowest();
  const double range = grid.highest() - low;
  if (!(range > 0.0)) return low;
  std::vector<double> count(bins, 0.0);
  std::visit(
      [&](const auto& values) {
        for (const auto value : values) {
          const auto v = static_cast<double>(value);
          if (std::isnan(v)) continue;
          count[std::min(bins - 1, static_cast<std::size_t>((v - low) / range * bins))] += 1.0;
        }
      },
      grid.samples());
  double total = 0.0;
  double total_sum = 0.0;
  for (std::size_t i = 0; i < bins; ++i) {
    total += count[i];
    total_sum += count[i] * (static_cast<double>(i) + 0.5);
  }
  double below = 0.0;
  double below_sum = 0.0;
  double best = -1.0;
  double first = 0.0;
  double last = 0.0;
  for (std::size_t i = 0; i + 1 < bins; ++i) {
    below += count[i];
    below_sum += count[i] * (static_cast<double>(i) + 0.5);
    const double above = total - below;
    if (below == 0.0 || above == 0.0) continue;
    const double difference = below_sum / below - (total_sum - below_sum) / above;
    const double between = below * above * difference * difference;
    if (between > best * (1.0 + 1e-12)) {
      best = between;
      first = static_cast<double>(i + 1);
      last = first;
    } else if (between >= best * (1.0 - 1e-12)) {
      // Classes with nothing between them: any threshold in the gap splits alike, its middle is farthest from both.
      last = static_cast<double>(i + 1);
    }
  }
  return low + range * 0.5 * (first + last) / bins;
}

}  // namespace asperity
