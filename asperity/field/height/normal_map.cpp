#include "asperity/field/height/normal_map.h"

#include <fmt/format.h>

#include <algorithm>

#include "asperity/field/height/detail/texel_coordinate.h"

namespace asperity {
namespace {

/// Shorter than this, or pointing inward by more than this, a decoded colour is no direction. Wide enough for the
/// rounding of 8 bits on vertical walls (1/127).
constexpr double no_direction = 0.1;

double decode(std::uint16_t code, int bits) {
  return bits == 16 ? std::max((code - 32768) / 32767.0, -1.0) : std::max((code - 128) / 127.0, -1.0);
}

}  // namespace

NormalMap::NormalMap(int width, int height, Wrap wrap, NormalFilter filter)
    : stride_(static_cast<std::size_t>(width) + 2), width_(width), height_(height), wrap_(wrap), filter_(filter) {
  values_.assign(stride_ * (static_cast<std::size_t>(height) + 2), Vec3f::UnitZ());
}

std::size_t NormalMap::index(int x, int y) const noexcept {
  return static_cast<std::size_t>(height_ - y) * stride_ + static_cast<std::size_t>(x + 1);
}

Result<NormalMap> NormalMap::build(const Image& image, const NormalMapSettings& settings) {
  ASPERITY_CHECK(validate(image));
  if (!image.has_colour()) {
    return bad_value(fmt::format("the normal map has {} channel(s)", image.channels), {},
                     "red, green and blue: x, y and z of the normal");
  }
  NormalMap map(image.width, image.height, settings.wrap, settings.filter);
  const double up = settings.green == GreenConvention::up ? 1.0 : -1.0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      Vec3 normal(decode(image.sample(x, y, 0), image.bits), up * decode(image.sample(x, y, 1), image.bits),
                  decode(image.sample(x, y, 2), image.bits));
      if (normal.norm() < no_direction || normal.z() < -no_direction) {
        normal = Vec3::UnitZ();
        ++map.degenerate_;
      }
      normal.z() = std::max(normal.z(), 0.0);
      map.values_[map.index(x, y)] = normal.normalized().cast<float>();
    }
  }
  fill_texel_apron(map.values_.data(), map.width_, map.height_, map.wrap_);
  return map;
}

Result<NormalMap> NormalMap::build(const HeightMap& heights, const Vec2& tile, NormalFilter filter) {
  ASPERITY_CHECK(check_tile(tile));
  NormalMap map(heights.width(), heights.height(), heights.wrap(), filter);
  for (int y = 0; y < map.height_; ++y) {
    for (int x = 0; x < map.width_; ++x) {
      const Vec2 slope = heights.central_slope(heights.texel_centre(x, y));
      const Vec3 normal(-slope.x() / tile.x(), -slope.y() / tile.y(), 1.0);
      map.values_[map.index(x, y)] = normal.normalized().cast<float>();
    }
  }
  fill_texel_apron(map.values_.data(), map.width_, map.height_, map.wrap_);
  return map;
}

Vec3 NormalMap::texel(int x, int y) const noexcept {
  return values_[index(x, y)].cast<double>().normalized();
}

Vec3 NormalMap::sample(const Vec2& st) const noexcept {
  const double u = unit_coordinate(st.x(), wrap_);
  const double v = unit_coordinate(st.y(), wrap_);
  if (filter_ == NormalFilter::nearest) {
    const auto column = static_cast<std::size_t>(texel_under(u, width_).index + 1);
    const auto row = static_cast<std::size_t>(texel_under(v, height_).index + 1);
    return values_[row * stride_ + column].cast<double>().normalized();
  }
  const TexelPair s = texels_around(u, width_);
  const TexelPair t = texels_around(v, height_);
  const Vec3f* below =
      &values_[static_cast<std::size_t>(t.lower + 1) * stride_ + static_cast<std::size_t>(s.lower + 1)];
  const Vec3f* above = below + stride_;
  const Vec3 low = (1.0 - s.fraction) * below[0].cast<double>() + s.fraction * below[1].cast<double>();
  const Vec3 high = (1.0 - s.fraction) * above[0].cast<double>() + s.fraction * above[1].cast<double>();
  const Vec3 blend = (1.0 - t.fraction) * low + t.fraction * high;
  // Opposite horizontal normals cancel half way; outward is the only direction left.
  const double length = blend.norm();
  return length > 1e-6 ? Vec3(blend / length) : Vec3(Vec3::UnitZ());
}

}  // namespace asperity
