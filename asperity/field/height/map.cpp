#include "asperity/field/height/map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "asperity/field/height/detail/spline_lanes.h"
#include "asperity/field/height/detail/spline_prefilter.h"
#include "asperity/field/height/detail/texel_coordinate.h"

namespace asperity {
namespace {

/// Greatest step (in codes) that all levels of the channel are multiples of, counted from the first; 0 when it is
/// constant.
int level_step(const Image& image, Channel channel) {
  const auto channels = static_cast<std::size_t>(image.channels);
  const bool mixed = channel == Channel::luminance && image.has_colour();
  const auto index = static_cast<std::size_t>(channel_index(image, channel));
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
    return refused(ErrorCode::too_large, fmt::format("the height map has {} x {} texels", width, height), {},
                   fmt::format("at most {} texels", max_pixels));
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

using Three = std::array<double, 3>;

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
  [[nodiscard]] double value(const Three& at) const noexcept {
    return at[1] + before * (at[0] - at[1]) + after * (at[2] - at[1]);
  }
  [[nodiscard]] double slope(const Three& at) const noexcept {
    return slope_before * (at[1] - at[0]) + slope_after * (at[2] - at[1]);
  }
  [[nodiscard]] double bend(const Three& at) const noexcept { return (at[2] - at[1]) - (at[1] - at[0]); }
};

/// The spline's piece in one texel: its 3 x 3 coefficients and the place between them. Each function answers, for the
/// three rows, what becomes of them along s.
struct SplinePiece {
  SplineWeights in_s;
  SplineWeights in_t;
  Three rows[3];
  SplinePiece(const StoredTexels& texels, Wrap wrap, const Vec2& st) noexcept
      : SplinePiece(texels, texel_under(unit_coordinate(st.x(), wrap), texels.width),
                    texel_under(unit_coordinate(st.y(), wrap), texels.height)) {}
  SplinePiece(const StoredTexels& texels, const TexelPlace& s, const TexelPlace& t) noexcept
      : in_s(s.offset), in_t(t.offset) {
    const std::size_t stride = static_cast<std::size_t>(texels.width) + 2;
    const float* from = texels.values + static_cast<std::size_t>(t.index) * stride + static_cast<std::size_t>(s.index);
    for (Three& row : rows) {
      row = {from[0], from[1], from[2]};
      from += stride;
    }
  }
  [[nodiscard]] Three heights() const noexcept {
    return {in_s.value(rows[0]), in_s.value(rows[1]), in_s.value(rows[2])};
  }
  [[nodiscard]] Three slopes() const noexcept {
    return {in_s.slope(rows[0]), in_s.slope(rows[1]), in_s.slope(rows[2])};
  }
  [[nodiscard]] Three bends() const noexcept { return {in_s.bend(rows[0]), in_s.bend(rows[1]), in_s.bend(rows[2])}; }
};

using Four = std::array<double, 4>;

/// The four weights of a cubic B-spline at `fraction` of the way from the second knot to the third, as multiples of
/// differences, so that a flat neighbourhood answers exactly its height and slope 0.
struct CubicWeights {
  double before = 0.0;
  double after = 0.0;
  double beyond = 0.0;
  double slope_before = 0.0;
  double slope_between = 0.0;
  double slope_after = 0.0;
  double fraction = 0.0;
  explicit CubicWeights(double fraction) noexcept : fraction(fraction) {
    const double rest = 1.0 - fraction;
    before = rest * rest * rest / 6.0;
    after = (1.0 + 3.0 * fraction * (1.0 + fraction * rest)) / 6.0;
    beyond = fraction * fraction * fraction / 6.0;
    slope_before = 0.5 * rest * rest;
    slope_between = 0.5 + fraction * rest;
    slope_after = 0.5 * fraction * fraction;
  }
  [[nodiscard]] double value(const Four& at) const noexcept {
    return at[1] + before * (at[0] - at[1]) + after * (at[2] - at[1]) + beyond * (at[3] - at[1]);
  }
  [[nodiscard]] double slope(const Four& at) const noexcept {
    return slope_before * (at[1] - at[0]) + slope_between * (at[2] - at[1]) + slope_after * (at[3] - at[2]);
  }
  [[nodiscard]] double bend(const Four& at) const noexcept {
    return (1.0 - fraction) * ((at[2] - at[1]) - (at[1] - at[0])) + fraction * ((at[3] - at[2]) - (at[2] - at[1]));
  }
};

/// The bicubic piece between four texel centres: its 4 x 4 coefficients and the place between them. Each function
/// answers, for the four rows, what becomes of them along s.
struct CubicPiece {
  CubicWeights in_s;
  CubicWeights in_t;
  Four rows[4];
  CubicPiece(const StoredTexels& texels, Wrap wrap, const Vec2& st) noexcept
      : CubicPiece(texels, texels_around(unit_coordinate(st.x(), wrap), texels.width),
                   texels_around(unit_coordinate(st.y(), wrap), texels.height)) {}
  CubicPiece(const StoredTexels& texels, const TexelPair& s, const TexelPair& t) noexcept
      : in_s(s.fraction), in_t(t.fraction) {
    // The first of the four is the one before `lower`: in an apron of two, at lower + 1.
    const float* from =
        texels.values + static_cast<std::size_t>(t.lower + 1) * texels.stride() + static_cast<std::size_t>(s.lower + 1);
    for (Four& row : rows) {
      row = {from[0], from[1], from[2], from[3]};
      from += texels.stride();
    }
  }
  [[nodiscard]] Four heights() const noexcept {
    return {in_s.value(rows[0]), in_s.value(rows[1]), in_s.value(rows[2]), in_s.value(rows[3])};
  }
  [[nodiscard]] Four slopes() const noexcept {
    return {in_s.slope(rows[0]), in_s.slope(rows[1]), in_s.slope(rows[2]), in_s.slope(rows[3])};
  }
  [[nodiscard]] Four bends() const noexcept {
    return {in_s.bend(rows[0]), in_s.bend(rows[1]), in_s.bend(rows[2]), in_s.bend(rows[3])};
  }
};

/// The piece of bilinear reconstruction between four texel centres, read along s at the lower pair and at the upper.
struct BilinearPiece {
  double fraction = 0.0;  // of the way from the lower pair to the upper
  double height_below = 0.0;
  double height_above = 0.0;
  double slope_below = 0.0;
  double slope_above = 0.0;
  BilinearPiece(const StoredTexels& texels, Wrap wrap, const Vec2& st) noexcept {
    const TexelPair s = texels_around(unit_coordinate(st.x(), wrap), texels.width);
    const TexelPair t = texels_around(unit_coordinate(st.y(), wrap), texels.height);
    const std::size_t stride = static_cast<std::size_t>(texels.width) + 2;
    const float* below =
        texels.values + static_cast<std::size_t>(t.lower + 1) * stride + static_cast<std::size_t>(s.lower + 1);
    const float* above = below + stride;
    fraction = t.fraction;
    slope_below = static_cast<double>(below[1]) - below[0];
    slope_above = static_cast<double>(above[1]) - above[0];
    height_below = below[0] + s.fraction * slope_below;
    height_above = above[0] + s.fraction * slope_above;
  }
};

/// Whether the map is clamped at this coordinate, so that nothing changes along it.
bool lies_outside(double coordinate, Wrap wrap) noexcept {
  return wrap == Wrap::clamp && (coordinate < 0.0 || coordinate > 1.0) && std::isfinite(coordinate);
}

}  // namespace

Status check_tile(const Vec2& tile) {
  constexpr double least = 1e-12;
  if (tile.allFinite() && tile.minCoeff() >= least) return success();
  return bad_value(fmt::format("is {} m x {} m", tile.x(), tile.y()), "tile", "two finite lengths of 1e-12 m or more");
}

Result<HeightMap> HeightMap::build(const Image& image, Channel channel, const HeightMapSettings& settings) {
  ASPERITY_CHECK(check(settings));
  ASPERITY_TRY(ChannelChoice choice, choose_channel(image, channel));
  HeightMap map(image.width, image.height, settings.wrap, settings.reconstruction);
  map.quantisation_step_ = settings.amplitude * level_step(image, choice.channel) / image.maximum();
  const double scale = settings.white_is_deep ? -settings.amplitude : settings.amplitude;
  map.store(extract_channel(image, choice.channel), settings.offset, scale);
  map.channel_ = std::move(choice);
  return map;
}

Result<HeightMap> HeightMap::build(std::vector<float> heights_m, int width, int height, Wrap wrap,
                                   Reconstruction reconstruction) {
  ASPERITY_CHECK(check(heights_m, width, height));
  HeightMap map(width, height, wrap, reconstruction);
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
  if (is_spline(reconstruction_)) {
    const SplinePrefilter along_rows(width_, wrap_, reconstruction_);
    for (std::size_t y = 0; y < height; ++y) along_rows.solve(&relative[y * width], 1, 1);
    SplinePrefilter(height_, wrap_, reconstruction_).solve(relative.data(), width, width);
  }
  const auto apron = static_cast<std::size_t>(stored().apron());
  const std::size_t stride = stored().stride();
  values_.resize(stride * (height + 2 * apron) + 1);
  for (std::size_t y = 0; y < height; ++y) {
    const double* from = &relative[y * width];
    float* to = &values_[(y + apron) * stride + apron];
    for (std::size_t x = 0; x < width; ++x) to[x] = static_cast<float>(from[x]);
  }
  fill_texel_apron(values_.data(), width_, height_, wrap_, stored().apron());
  ranges_ = RangePyramid(stored());
  planes_ = PlanePyramid(stored());
  const HeightRange bounds = ranges_.whole();
  // A weighted mean in floating point may leave the interval of its terms by rounding.
  const double size = std::abs(base_) + std::abs(bounds.lowest) + std::abs(bounds.highest);
  const double margin = bounds.lowest < bounds.highest ? 1e-15 * size : 0.0;
  lowest_ = base_ + bounds.lowest - margin;
  highest_ = base_ + bounds.highest + margin;
  // A spline's coefficients reach four times its heights, nine times the cubic's, where those alternate from texel to
  // texel.
  rounding_ = (reconstruction_ == Reconstruction::bicubic ? 9.0 : 4.0) * margin;
}

std::size_t HeightMap::memory_bytes() const noexcept {
  return sizeof(*this) + values_.capacity() * sizeof(float) + ranges_.memory_bytes() + planes_.memory_bytes();
}

HeightSample HeightMap::sample(const Vec2& st) const noexcept {
  if (reconstruction_ == Reconstruction::quadratic_bspline) {
    const SplinePiece piece(stored(), wrap_, st);
    const Three heights = piece.heights();
    return {base_ + piece.in_t.value(heights),
            {piece.in_t.value(piece.slopes()) * width_, piece.in_t.slope(heights) * height_}};
  }
  if (reconstruction_ == Reconstruction::bilinear) {
    const BilinearPiece piece(stored(), wrap_, st);
    return {base_ + piece.height_below + piece.fraction * (piece.height_above - piece.height_below),
            {(piece.slope_below + piece.fraction * (piece.slope_above - piece.slope_below)) * width_,
             (piece.height_above - piece.height_below) * height_}};
  }
  if (reconstruction_ == Reconstruction::bicubic) {
    const CubicPiece piece(stored(), wrap_, st);
    const Four heights = piece.heights();
    return {base_ + piece.in_t.value(heights),
            {piece.in_t.value(piece.slopes()) * width_, piece.in_t.slope(heights) * height_}};
  }
  const TexelPlace s = texel_under(unit_coordinate(st.x(), wrap_), width_);
  const TexelPlace t = texel_under(unit_coordinate(st.y(), wrap_), height_);
  const std::size_t row = static_cast<std::size_t>(t.index + 1) * stored().stride();
  return {base_ + values_[row + static_cast<std::size_t>(s.index + 1)], Vec2::Zero()};
}

double HeightMap::height_at(const Vec2& st) const noexcept {
  if (reconstruction_ != Reconstruction::quadratic_bspline) return sample(st).height;
  const SplinePiece piece(stored(), wrap_, st);
  return base_ + piece.in_t.value(piece.heights());
}

void HeightMap::heights_at(const Lanes& s, const Lanes& t, Lanes& heights) const noexcept {
  if (reconstruction_ == Reconstruction::quadratic_bspline &&
      wide_spline_heights({values_.data(), width_, height_, wrap_, base_}, s, t, heights))
    return;
  for (std::size_t i = 0; i < lanes; ++i) heights[i] = height_at(Vec2(s[i], t[i]));
}

Vec2 HeightMap::central_slope(const Vec2& st) const noexcept {
  const Vec2 ds(1.0 / width_, 0.0);
  const Vec2 dt(0.0, 1.0 / height_);
  return {(height_at(st + ds) - height_at(st - ds)) * 0.5 * width_,
          (height_at(st + dt) - height_at(st - dt)) * 0.5 * height_};
}

namespace {

/// What a spline's piece has, by whichever weights. `base`: of the heights (m).
template <class Piece>
HeightCurvature curvature_of(const Piece& piece, double base, double width, double height) noexcept {
  const auto heights = piece.heights();
  const auto slopes = piece.slopes();
  return {base + piece.in_t.value(heights),
          {piece.in_t.value(slopes) * width, piece.in_t.slope(heights) * height},
          piece.in_t.value(piece.bends()) * (width * width),
          piece.in_t.slope(slopes) * (width * height),
          piece.in_t.bend(heights) * (height * height)};
}

/// The mixed derivative is 0 outside by the mirrored border, as the gradient is.
void flatten_outside(HeightCurvature& curvature, const Vec2& st, Wrap wrap) noexcept {
  if (lies_outside(st.x(), wrap)) curvature.ss = 0.0;
  if (lies_outside(st.y(), wrap)) curvature.tt = 0.0;
}

}  // namespace

HeightCurvature HeightMap::curvature_otherwise(const Vec2& st) const noexcept {
  if (reconstruction_ == Reconstruction::bicubic) {
    HeightCurvature curvature = curvature_of(CubicPiece(stored(), wrap_, st), base_, width_, height_);
    flatten_outside(curvature, st, wrap_);
    return curvature;
  }
  const HeightSample sample = this->sample(st);
  HeightCurvature curvature{sample.height, sample.gradient, 0.0, 0.0, 0.0};
  if (reconstruction_ == Reconstruction::bilinear) {
    const BilinearPiece piece(stored(), wrap_, st);
    curvature.st = (piece.slope_above - piece.slope_below) * width_ * height_;
  }
  return curvature;
}

HeightCurvature HeightMap::curvature_bspline(const Vec2& st) const noexcept {
  HeightCurvature curvature;
  if (!wide_spline_curvature({values_.data(), width_, height_, wrap_, base_}, st, curvature))
    curvature = curvature_of(SplinePiece(stored(), wrap_, st), base_, width_, height_);
  flatten_outside(curvature, st, wrap_);
  return curvature;
}

HeightRange HeightMap::range_over(const Vec2& lower, const Vec2& upper) const noexcept {
  if (!lower.allFinite() || !upper.allFinite()) [[unlikely]]
    return {lowest_, highest_};
  const TexelSpan s = texels_under(std::min(lower.x(), upper.x()), std::max(lower.x(), upper.x()), width_, wrap_);
  const TexelSpan t = texels_under(std::min(lower.y(), upper.y()), std::max(lower.y(), upper.y()), height_, wrap_);
  const HeightRange range = ranges_.over(stored(), s, t);
  return {std::max(base_ + range.lowest - rounding_, lowest_), std::min(base_ + range.highest + rounding_, highest_)};
}

HeightPlane HeightMap::plane_over(const Vec2& lower, const Vec2& upper) const noexcept {
  const Vec2 low = lower.cwiseMin(upper);
  const Vec2 high = lower.cwiseMax(upper);
  if (!low.allFinite() || !high.allFinite()) [[unlikely]]
    return {0.5 * (low + high), 0.5 * (lowest_ + highest_), Vec2::Zero(), 0.5 * (highest_ - lowest_)};
  const TexelSpan s = texels_under(low.x(), high.x(), width_, wrap_);
  const TexelSpan t = texels_under(low.y(), high.y(), height_, wrap_);
  // By how much the texels spanned are not those between the corners: no more than rounding, or one coordinate in the
  // map stands for several of the rectangle.
  constexpr double rounding = 1e-6;
  const auto missing = [](const TexelSpan& span, double length) {
    return std::abs(length - (span.count - 1 + span.to - span.from));
  };
  const Vec2 texels(width_, height_);
  const Vec2 length = (high - low).cwiseProduct(texels);
  const Vec2 off(missing(s, length.x()), missing(t, length.y()));
  TexelPlane plane = planes_.over(stored(), s, t, off.x() > rounding, off.y() > rounding);
  // Of noise the blocks' planes say less than their ranges.
  constexpr double much = 0.25;
  if (plane.error > much * (highest_ - lowest_)) {
    const HeightRange range = ranges_.over(stored(), s, t);
    if (range.highest - range.lowest < 2.0 * plane.error)
      plane = {0.5 * (range.lowest + range.highest), Vec2::Zero(), 0.5 * (range.highest - range.lowest)};
  }
  HeightPlane answer{0.5 * (low + high), base_ + plane.height, plane.slope.cwiseProduct(texels), 0.0};
  // Coordinates far from 0 are themselves rounded.
  const Vec2 unsure = off.cwiseMin(rounding) + 4e-16 * (low.cwiseAbs() + high.cwiseAbs()).cwiseProduct(texels);
  answer.error = plane.error + plane.slope.cwiseAbs().dot(unsure) + rounding_ +
                 4e-16 * (std::abs(plane.height) + plane.slope.cwiseAbs().dot(length));
  return answer;
}

}  // namespace asperity
