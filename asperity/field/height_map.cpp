#include "asperity/field/height_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "asperity/field/spline_prefilter.h"
#include "asperity/field/texel_coordinate.h"

namespace asperity {
namespace {

/// Greatest step (in codes) that all levels of the channel are multiples of, counted from the first; 0 when it is
/// constant.
int level_step(const Image& image, Channel channel) {
  const auto channels = static_cast<std::size_t>(image.channels);
  const bool mixed = channel == Channel::luminance && image.has_colour();
  std::size_t index = 0;
  if (channel == Channel::green) index = 1;
  if (channel == Channel::blue) index = 2;
  if (channel == Channel::alpha) index = channels - 1;
  const int first = image.samples[index];
  int step = 0;
  for (std::size_t i = 0; i < image.samples.size() && step != 1; i += channels) {
    const std::uint16_t* pixel = &image.samples[i];
    // Luminance of a coloured pixel falls between the codes: the step of one code is still the right order.
    if (mixed && (pixel[0] != pixel[1] || pixel[1] != pixel[2])) return 1;
    step = std::gcd(step, std::abs(pixel[index] - first));
  }
  return step;
}

Error bad_value(std::string what, std::string place, std::string accepted) {
  return Error{ErrorCode::bad_value, std::move(what), "", std::move(place), std::move(accepted)};
}

Status check(const HeightMapSettings& settings) {
  if (!std::isfinite(settings.amplitude) || settings.amplitude < 0.0) {
    return bad_value(fmt::format("the amplitude is {} m", settings.amplitude), "amplitude",
                     "a finite length of 0 or more (white_is_deep turns a map over)");
  }
  if (!std::isfinite(settings.offset)) {
    return bad_value(fmt::format("the offset is {} m", settings.offset), "offset",
                     "a finite length; negative ones are allowed");
  }
  return success();
}

Status check(const std::vector<float>& heights, int width, int height) {
  if (width <= 0 || height <= 0) {
    return bad_value(fmt::format("the height map has no texels ({} x {})", width, height), "", "at least 1 x 1 texel");
  }
  const std::size_t texels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (texels > max_pixels) {
    return Error{ErrorCode::too_large, fmt::format("the height map has {} x {} texels", width, height), "", "",
                 fmt::format("at most {} texels", max_pixels)};
  }
  if (heights.size() != texels) {
    return bad_value(fmt::format("the height map has {} heights", heights.size()), "",
                     fmt::format("width x height = {} heights", texels));
  }
  const auto bad = std::find_if(heights.begin(), heights.end(), [](float value) { return !std::isfinite(value); });
  if (bad != heights.end()) {
    const auto index = static_cast<std::size_t>(bad - heights.begin());
    return bad_value("a height is not finite",
                     fmt::format("column {}, row {}", index % static_cast<std::size_t>(width),
                                 index / static_cast<std::size_t>(width)),
                     "finite heights in metres");
  }
  return success();
}

struct Bounds {
  double low = infinity;
  double high = -infinity;
  void include(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

Bounds bounds_of(const std::vector<float>& values) {
  Bounds bounds;
  for (const float value : values) bounds.include(value);
  return bounds;
}

/// Bounds of the spline by the coefficients of the same spline on a grid twice as fine (Chaikin's rule, weights 3/4 and
/// 1/4 along each axis): a spline lies within its coefficients, and finer ones lie closer to it.
Bounds spline_bounds(const std::vector<float>& coefficients, std::size_t stride) {
  Bounds bounds;
  for (std::size_t row = stride; row < coefficients.size(); row += stride) {
    for (std::size_t i = row + 1; i < row + stride; ++i) {
      const double a = coefficients[i - stride - 1];
      const double b = coefficients[i - stride];
      const double c = coefficients[i - 1];
      const double d = coefficients[i];
      bounds.include((9.0 * a + 3.0 * b + 3.0 * c + d) / 16.0);
      bounds.include((3.0 * a + 9.0 * b + c + 3.0 * d) / 16.0);
      bounds.include((3.0 * a + b + 9.0 * c + 3.0 * d) / 16.0);
      bounds.include((a + 3.0 * b + 3.0 * c + 9.0 * d) / 16.0);
    }
  }
  return bounds;
}

/// The three weights of a quadratic B-spline at `offset` texels (-0.5 to 0.5) from the middle knot, as multiples of the
/// differences to that knot, so that a flat neighbourhood answers exactly its height and slope 0.
struct SplineWeights {
  double before = 0.0;
  double after = 0.0;
  double slope_before = 0.0;
  double slope_after = 0.0;
  explicit SplineWeights(double offset) noexcept
      : before(0.5 * (0.5 - offset) * (0.5 - offset)),
        after(0.5 * (0.5 + offset) * (0.5 + offset)),
        slope_before(0.5 - offset),
        slope_after(0.5 + offset) {}
  [[nodiscard]] double value(double a, double b, double c) const noexcept {
    return b + before * (a - b) + after * (c - b);
  }
  [[nodiscard]] double slope(double a, double b, double c) const noexcept {
    return slope_before * (b - a) + slope_after * (c - b);
  }
};

}  // namespace

const char* to_string(Reconstruction reconstruction) {
  switch (reconstruction) {
    case Reconstruction::nearest: return "nearest";
    case Reconstruction::bilinear: return "bilinear";
    case Reconstruction::quadratic_bspline: return "quadratic_bspline";
  }
  return "unknown";
}

const char* to_string(Wrap wrap) {
  return wrap == Wrap::repeat ? "repeat" : "clamp";
}

Result<HeightMap> HeightMap::build(const Image& image, Channel channel, const HeightMapSettings& settings) {
  ASPERITY_CHECK(check(settings));
  ASPERITY_TRY(ChannelChoice choice, choose_channel(image, channel));
  HeightMap map;
  map.width_ = image.width;
  map.height_ = image.height;
  map.wrap_ = settings.wrap;
  map.reconstruction_ = settings.reconstruction;
  map.quantisation_step_ = settings.amplitude * level_step(image, choice.channel) / image.maximum();
  const double scale = settings.white_is_deep ? -settings.amplitude : settings.amplitude;
  map.store(extract_channel(image, choice.channel), settings.offset, scale);
  map.channel_ = std::move(choice);
  return map;
}

Result<HeightMap> HeightMap::build(std::vector<float> heights_m, int width, int height, Wrap wrap,
                                   Reconstruction reconstruction) {
  ASPERITY_CHECK(check(heights_m, width, height));
  HeightMap map;
  map.width_ = width;
  map.height_ = height;
  map.wrap_ = wrap;
  map.reconstruction_ = reconstruction;
  map.store(heights_m, 0.0, 1.0);
  return map;
}

void HeightMap::store(const std::vector<float>& source, double offset, double scale) {
  const auto [low, high] = std::minmax_element(source.begin(), source.end());
  const double middle = 0.5 * (static_cast<double>(*low) + static_cast<double>(*high));
  base_ = offset + scale * middle;
  const auto width = static_cast<std::size_t>(width_);
  const auto height = static_cast<std::size_t>(height_);
  std::vector<double> relative(source.size());
  for (std::size_t y = 0; y < height; ++y) {
    const float* from = &source[(height - 1 - y) * width];
    double* to = &relative[y * width];
    for (std::size_t x = 0; x < width; ++x) to[x] = scale * (static_cast<double>(from[x]) - middle);
  }
  if (reconstruction_ == Reconstruction::quadratic_bspline) {
    const SplinePrefilter along_rows(width_, wrap_);
    for (std::size_t y = 0; y < height; ++y) along_rows.solve(&relative[y * width], 1, 1);
    SplinePrefilter(height_, wrap_).solve(relative.data(), width, width);
  }
  stride_ = width + 2;
  values_.resize(stride_ * (height + 2));
  for (std::size_t y = 0; y < height; ++y) {
    const double* from = &relative[y * width];
    float* to = &values_[(y + 1) * stride_ + 1];
    for (std::size_t x = 0; x < width; ++x) to[x] = static_cast<float>(from[x]);
  }
  fill_texel_apron(values_.data(), width_, height_, wrap_);
  const Bounds bounds =
      reconstruction_ == Reconstruction::quadratic_bspline ? spline_bounds(values_, stride_) : bounds_of(values_);
  // A weighted mean in floating point may leave the interval of its terms by rounding.
  const double rounding = 1e-15 * (std::abs(base_) + std::abs(bounds.low) + std::abs(bounds.high));
  const double margin = bounds.low < bounds.high ? rounding : 0.0;
  lowest_ = base_ + bounds.low - margin;
  highest_ = base_ + bounds.high + margin;
}

std::size_t HeightMap::memory_bytes() const noexcept {
  return sizeof(*this) + values_.capacity() * sizeof(float);
}

HeightSample HeightMap::sample(const Vec2& st) const noexcept {
  switch (reconstruction_) {
    case Reconstruction::quadratic_bspline: return sample_bspline(st);
    case Reconstruction::bilinear: return sample_bilinear(st);
    case Reconstruction::nearest: break;
  }
  return sample_nearest(st);
}

double HeightMap::height_at(const Vec2& st) const noexcept {
  return sample(st).height;
}

HeightSample HeightMap::sample_nearest(const Vec2& st) const noexcept {
  const TexelPlace s = texel_under(unit_coordinate(st.x(), wrap_), width_);
  const TexelPlace t = texel_under(unit_coordinate(st.y(), wrap_), height_);
  const std::size_t row = static_cast<std::size_t>(t.index + 1) * stride_;
  return {base_ + values_[row + static_cast<std::size_t>(s.index + 1)], Vec2::Zero()};
}

HeightSample HeightMap::sample_bilinear(const Vec2& st) const noexcept {
  const TexelPair s = texels_around(unit_coordinate(st.x(), wrap_), width_);
  const TexelPair t = texels_around(unit_coordinate(st.y(), wrap_), height_);
  const float* below =
      &values_[static_cast<std::size_t>(t.lower + 1) * stride_ + static_cast<std::size_t>(s.lower + 1)];
  const float* above = below + stride_;
  const double slope_below = static_cast<double>(below[1]) - below[0];
  const double slope_above = static_cast<double>(above[1]) - above[0];
  const double height_below = below[0] + s.fraction * slope_below;
  const double height_above = above[0] + s.fraction * slope_above;
  return {base_ + height_below + t.fraction * (height_above - height_below),
          {(slope_below + t.fraction * (slope_above - slope_below)) * width_, (height_above - height_below) * height_}};
}

HeightSample HeightMap::sample_bspline(const Vec2& st) const noexcept {
  const TexelPlace s = texel_under(unit_coordinate(st.x(), wrap_), width_);
  const TexelPlace t = texel_under(unit_coordinate(st.y(), wrap_), height_);
  const SplineWeights in_s(s.offset);
  const SplineWeights in_t(t.offset);
  const float* below = &values_[static_cast<std::size_t>(t.index) * stride_ + static_cast<std::size_t>(s.index)];
  const float* middle = below + stride_;
  const float* above = middle + stride_;
  const double h0 = in_s.value(below[0], below[1], below[2]);
  const double h1 = in_s.value(middle[0], middle[1], middle[2]);
  const double h2 = in_s.value(above[0], above[1], above[2]);
  const double g0 = in_s.slope(below[0], below[1], below[2]);
  const double g1 = in_s.slope(middle[0], middle[1], middle[2]);
  const double g2 = in_s.slope(above[0], above[1], above[2]);
  return {base_ + in_t.value(h0, h1, h2), {in_t.value(g0, g1, g2) * width_, in_t.slope(h0, h1, h2) * height_}};
}

}  // namespace asperity
