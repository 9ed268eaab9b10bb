#pragma once

#include <cstddef>
#include <vector>

#include "asperity/core/math.h"
#include "asperity/core/result.h"
#include "asperity/field/height/image.h"
#include "asperity/field/height/map.h"

namespace asperity {

/// Which way the green channel of a normal map points: up the image (+t, OpenGL) or down it (-t, DirectX).
enum class GreenConvention { up, down };
/// As in scene files.
template <>
struct Names<GreenConvention> {
  static constexpr auto table =
      std::to_array<Named<GreenConvention>>({{GreenConvention::up, "up"}, {GreenConvention::down, "down"}});
};
/// How a normal is found between texel centres; `bilinear` is renormalised.
enum class NormalFilter { nearest, bilinear };

/// How colours become normals.
struct NormalMapSettings {
  GreenConvention green = GreenConvention::up;
  Wrap wrap = Wrap::repeat;
  NormalFilter filter = NormalFilter::bilinear;
};

/// Unit normals in the surface's tangent frame: x along +s, y along +t, z outward. Texture coordinates and wrapping as
/// in HeightMap. Immutable; any number of threads may read it.
class NormalMap {
 public:
  /// Decodes red, green, blue as (code - 128) / 127, for 16 bits (code - 32768) / 32767, so that the usual flat colour
  /// (128, 128, 255) is exactly (0, 0, 1), then normalises. A texel that is no outward direction (shorter than 0.1, or
  /// pointing inward by more than 0.1, such as black) becomes (0, 0, 1) and is counted.
  /// Errors: bad_value (no pixels, fewer than three channels), too_large. [build]
  static Result<NormalMap> build(const Image& image, const NormalMapSettings& settings);
  /// Normals of a relief at its own texel centres, n ~ (-dH/ds / tile.x, -dH/dt / tile.y, 1), slopes by central
  /// differences over two texels (hrm-2010, section 4: precomputed normals). `tile` is the size of one repeat (m), both
  /// above 0. Errors: bad_value. [build]
  static Result<NormalMap> build(const HeightMap& heights, const Vec2& tile,
                                 NormalFilter filter = NormalFilter::bilinear);

  /// Unit normal at texture coordinates `st`. [servo]
  [[nodiscard]] Vec3 sample(const Vec2& st) const noexcept;
  /// Unit normal of the texel in column `x`, row `y` (row 0 on top); both in range. [servo]
  [[nodiscard]] Vec3 texel(int x, int y) const noexcept;

  [[nodiscard]] int width() const noexcept { return width_; }    ///< texels
  [[nodiscard]] int height() const noexcept { return height_; }  ///< texels
  [[nodiscard]] Wrap wrap() const noexcept { return wrap_; }
  [[nodiscard]] NormalFilter filter() const noexcept { return filter_; }
  /// Texels that were no direction and became (0, 0, 1). [any]
  [[nodiscard]] std::size_t degenerate_texels() const noexcept { return degenerate_; }
  /// Bytes held. [any]
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return sizeof(*this) + values_.capacity() * sizeof(Vec3f); }

 private:
  NormalMap(int width, int height, Wrap wrap, NormalFilter filter);
  [[nodiscard]] std::size_t index(int x, int y) const noexcept;  // of a texel in values_; row 0 on top

  std::vector<Vec3f> values_;  // as in HeightMap: bottom row first, inside an apron of one texel
  std::size_t stride_ = 0;
  std::size_t degenerate_ = 0;
  int width_ = 0;
  int height_ = 0;
  Wrap wrap_ = Wrap::repeat;
  NormalFilter filter_ = NormalFilter::bilinear;
};

}  // namespace asperity
