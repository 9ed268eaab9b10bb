#pragma once

#include <cstddef>
#include <vector>

#include "asperity/core/lanes.h"
#include "asperity/core/math.h"
#include "asperity/core/result.h"
#include "asperity/field/height/image.h"
#include "asperity/field/height/plane.h"
#include "asperity/field/height/range.h"

namespace asperity {

/// How the surface runs between texel centres.
///   nearest            steps: each texel is flat; its gradient is 0
///   bilinear           continuous, with creases on the lines between texel centres
///   quadratic_bspline  C1 (height and gradient continuous); prefiltered, so it passes through every texel's height.
///                      It overshoots steps by up to 10 % (formulation amendment 11): see `lowest`, `highest`
///   bicubic            C2 (curvature continuous too): the cubic B-spline, prefiltered likewise, of 4 x 4 texels. It
///                      overshoots steps by up to 11 %
enum class Reconstruction { nearest, bilinear, quadratic_bspline, bicubic };
/// Whether heights are weighted means of coefficients that are not the texels themselves. [any]
constexpr bool is_spline(Reconstruction reconstruction) noexcept {
  return reconstruction == Reconstruction::quadratic_bspline || reconstruction == Reconstruction::bicubic;
}
/// As in scene files.
template <>
struct Names<Reconstruction> {
  static constexpr auto table = std::to_array<Named<Reconstruction>>({{Reconstruction::nearest, "nearest"},
                                                                      {Reconstruction::bilinear, "bilinear"},
                                                                      {Reconstruction::quadratic_bspline, "bspline"},
                                                                      {Reconstruction::bicubic, "bicubic"}});
};

/// What lies outside texture coordinates 0 to 1: the same map again, or its border continued.
enum class Wrap { repeat, clamp };
/// As in scene files.
template <>
struct Names<Wrap> {
  static constexpr auto table = std::to_array<Named<Wrap>>({{Wrap::repeat, "repeat"}, {Wrap::clamp, "clamp"}});
};

/// Heights from a formula of texture coordinates, at the texel centres of a map, row 0 on top. [build]
template <class Number = float, class Formula>
std::vector<Number> tabulated(int width, int height, const Formula& formula) {
  std::vector<Number> heights;
  heights.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x)
      heights.push_back(static_cast<Number>(formula(Vec2((x + 0.5) / width, (height - y - 0.5) / height))));
  }
  return heights;
}

/// Errors: bad_value where this is no size of one repeat of a map (m). [any]
Status check_tile(const Vec2& tile);

/// One reading of a relief.
struct HeightSample {
  double height = 0.0;           ///< m, positive outside the base surface
  Vec2 gradient = Vec2::Zero();  ///< (dH/ds, dH/dt), m per unit of texture coordinate
};

/// One reading of a relief with its second derivatives.
struct HeightCurvature {
  double height = 0.0;           ///< m, positive outside the base surface
  Vec2 gradient = Vec2::Zero();  ///< (dH/ds, dH/dt), m per unit of texture coordinate
  double ss = 0.0;               ///< d2H/ds2, m per unit of texture coordinate squared
  double st = 0.0;               ///< d2H/ds dt, likewise
  double tt = 0.0;               ///< d2H/dt2, likewise
};

/// How grey values become metres.
struct HeightMapSettings {
  double amplitude = 1e-3;     ///< m: distance between the heights of full white and full black, >= 0
  double offset = 0.0;         ///< m: height of value 0 (black); negative heights are allowed
  bool white_is_deep = false;  ///< false: H = offset + amplitude v; true (depth maps): H = offset - amplitude v
  Wrap wrap = Wrap::repeat;
  Reconstruction reconstruction = Reconstruction::quadratic_bspline;
};

/// A relief H(s, t) sampled on a regular grid. Immutable; any number of threads may read it.
///
/// Texture coordinates: s to the right, 0 to 1 over the width; t UP, 0 on the image's bottom edge and 1 on its top edge
/// (the convention of OBJ files; row 0 of an image is its top row). Texel (i, j) has its centre at
/// ((i + 0.5) / width, 1 - (j + 0.5) / height). Coordinates outside 0 to 1 repeat or clamp, at any magnitude; a
/// coordinate that is not finite reads as 0. With `clamp` the height is constant outside along the clamped axis and its
/// gradient 0; the B-spline is mirrored about the border (half a texel outside the outermost centre), so it stays C1
/// there.
///
/// Heights are stored as floats relative to their middle: relative to the range, not to the offset, the error is below
/// 1e-6, and a constant image is exact.
class HeightMap {
 public:
  /// Reads `channel` of an image. Errors: bad_value (no pixels, channel absent, amplitude or offset not finite,
  /// amplitude negative), too_large. [build]
  static Result<HeightMap> build(const Image& image, Channel channel, const HeightMapSettings& settings);
  /// From heights in metres, row 0 on top. Errors: bad_value (size and count disagree, a height is not finite),
  /// too_large. [build]
  static Result<HeightMap> build(std::vector<float> heights_m, int width, int height, Wrap wrap,
                                 Reconstruction reconstruction);

  /// Height and gradient at texture coordinates `st`. [servo]
  [[nodiscard]] HeightSample sample(const Vec2& st) const noexcept;
  /// Height alone (m), equal to `sample`'s to the bit, in a third of the time. [servo]
  [[nodiscard]] double height_at(const Vec2& st) const noexcept;
  /// The same at several places at once, equal to the bit, by AVX2 where the processor has it. [servo]
  void heights_at(const Lanes& s, const Lanes& t, Lanes& heights) const noexcept;

  /// Slopes by central differences over two texels, m per unit of texture coordinate, whatever the reconstruction.
  /// [any]
  [[nodiscard]] Vec2 central_slope(const Vec2& st) const noexcept;

  /// Height, gradient (both equal to `sample`'s to the bit) and second derivatives of the reconstruction, which jump on
  /// the lines where its pieces meet, but those of `bicubic`. In a piece of the quadratic spline, a texel, `ss` is
  /// constant along s, `tt` along t and `st` linear along both; bilinear has `st` alone, nearest none. Outside, along a
  /// clamped axis, its own are 0.
  /// [servo]
  [[nodiscard]] HeightCurvature curvature(const Vec2& st) const noexcept {
    return reconstruction_ == Reconstruction::quadratic_bspline ? curvature_bspline(st) : curvature_otherwise(st);
  }
  /// Bounds of the height (m) over the closed rectangle between two opposite corners, which may lie outside 0 to 1; no
  /// sample in it leaves them, by rounding either. On up to 6 x 6 texels they exceed the true range by a term of second
  /// order in a texel (spline) or by rounding alone. On more they lie within the range over the rectangle grown on
  /// every side by a third of its longer side and 2.5 texels (spline: that of its coefficients on a grid twice as
  /// fine). The time does not depend on the size. With a coordinate that is not finite: the bounds of the whole map.
  /// [servo]
  [[nodiscard]] HeightRange range_over(const Vec2& lower, const Vec2& upper) const noexcept;

  /// A plane that the height keeps to over the same rectangle, by rounding too. Where the relief is smooth its error is
  /// of second order in the rectangle; at worst it is what range_over answers, nearly. Along an axis on which the
  /// rectangle leaves a clamped map or spans all of a repeated one it is level. The time does not depend on the size.
  /// With a coordinate that is not finite: level, as far off as the whole map. [servo]
  [[nodiscard]] HeightPlane plane_over(const Vec2& lower, const Vec2& upper) const noexcept;

  /// No sample is below this (m): the least texel, or the least coefficient of the B-spline on a grid twice as fine,
  /// which holds its overshoot (amendment 11): 4 % wide at a step, up to 40 % of the range for noise between texels.
  /// [any]
  [[nodiscard]] double lowest() const noexcept { return lowest_; }
  /// No sample is above this (m). [any]
  [[nodiscard]] double highest() const noexcept { return highest_; }

  [[nodiscard]] int width() const noexcept { return width_; }    ///< texels
  [[nodiscard]] int height() const noexcept { return height_; }  ///< texels
  [[nodiscard]] Wrap wrap() const noexcept { return wrap_; }
  [[nodiscard]] Reconstruction reconstruction() const noexcept { return reconstruction_; }
  /// The channel the heights came from (never `automatic`) and why; `luminance` with an empty reason for maps made from
  /// heights.
  [[nodiscard]] const ChannelChoice& channel() const noexcept { return channel_; }
  /// Step between neighbouring levels of the source (m): the greatest one that all its levels are multiples of; 0 for a
  /// constant map and for maps made from heights. Heights are not known better than half of it. [any]
  [[nodiscard]] double quantisation_step() const noexcept { return quantisation_step_; }
  /// Bytes held. [any]
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

  /// Height (m) of the texel in column `x`, row `y` (row 0 on top, as in the image); both in range. [servo]
  [[nodiscard]] double texel(int x, int y) const noexcept { return height_at(texel_centre(x, y)); }
  /// Texture coordinates of a texel's centre. [any]
  [[nodiscard]] Vec2 texel_centre(int x, int y) const noexcept {
    return {(x + 0.5) / width_, (height_ - y - 0.5) / height_};
  }

 private:
  HeightMap(int width, int height, Wrap wrap, Reconstruction reconstruction)
      : width_(width), height_(height), wrap_(wrap), reconstruction_(reconstruction) {}
  /// Stores offset + scale * source as the reconstruction needs it.
  void store(const std::vector<float>& source, double offset, double scale);
  [[nodiscard]] HeightCurvature curvature_bspline(const Vec2& st) const noexcept;
  [[nodiscard]] HeightCurvature curvature_otherwise(const Vec2& st) const noexcept;
  [[nodiscard]] StoredTexels stored() const noexcept { return {values_.data(), width_, height_, reconstruction_}; }

  // Rows run with t (bottom row first) inside an apron, which holds what repeat or clamp would answer: no tap ever
  // needs an index wrapped. One float to spare behind: rows are read four floats at a time.
  std::vector<float> values_;  // texel heights or B-spline coefficients, m, relative to base_
  double base_ = 0.0;          // m
  RangePyramid ranges_;        // relative to base_
  PlanePyramid planes_;        // likewise
  double rounding_ = 0.0;      // m: a sample may differ from the exact reconstruction by so much
  double lowest_ = 0.0;
  double highest_ = 0.0;
  double quantisation_step_ = 0.0;
  int width_ = 0;
  int height_ = 0;
  Wrap wrap_ = Wrap::repeat;
  Reconstruction reconstruction_ = Reconstruction::quadratic_bspline;
  ChannelChoice channel_;
};

}  // namespace asperity
