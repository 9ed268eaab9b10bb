#include "asperity/field/height/normal_map.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "asperity/core/rng.h"

namespace asperity::normal_map_test {
namespace {

using std::numbers::pi;

static_assert(noexcept(std::declval<const NormalMap&>().sample(std::declval<const Vec2&>())));

NormalMap map_of(const Image& image, const NormalMapSettings& settings = {}) {
  auto map = NormalMap::build(image, settings);
  EXPECT_TRUE(map.ok());
  return std::move(map).value();
}

HeightMap cosine_relief(int size, double amplitude) {
  std::vector<float> heights;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      heights.push_back(static_cast<float>(amplitude * std::cos(2.0 * pi * (x + 0.5) / size) *
                                           std::cos(2.0 * pi * (1.0 - (y + 0.5) / size))));
    }
  }
  auto map = HeightMap::build(std::move(heights), size, size, Wrap::repeat, Reconstruction::quadratic_bspline);
  EXPECT_TRUE(map.ok());
  return std::move(map).value();
}

TEST(NormalMapImage, TheUsualFlatColourIsExactlyOutward) {
  EXPECT_EQ(map_of({1, 1, 3, 8, {128, 128, 255}}).sample({0.3, 0.4}), Vec3::UnitZ());
  EXPECT_EQ(map_of({1, 1, 4, 16, {32768, 32768, 65535, 7}}).sample({0.3, 0.4}), Vec3::UnitZ());
}

TEST(NormalMapImage, RedPointsAlongSAndGreenByItsConvention) {
  const Image image{1, 1, 3, 8, {255, 192, 255}};
  const Vec3 expected = Vec3(1.0, 64.0 / 127.0, 1.0).normalized();
  EXPECT_NEAR((map_of(image).texel(0, 0) - expected).norm(), 0.0, 1e-6);
  const Vec3 flipped(expected.x(), -expected.y(), expected.z());
  EXPECT_NEAR((map_of(image, {.green = GreenConvention::down}).texel(0, 0) - flipped).norm(), 0.0, 1e-6);
}

TEST(NormalMapImage, RowZeroIsTheTop) {
  const Image image{1, 2, 3, 8, {255, 128, 255, 1, 128, 255}};
  const NormalMap map = map_of(image, {.wrap = Wrap::clamp});
  EXPECT_GT(map.sample({0.5, 0.99}).x(), 0.5);
  EXPECT_LT(map.sample({0.5, 0.01}).x(), -0.5);
  EXPECT_NEAR(map.sample({0.5, 0.5}).x(), 0.0, 1e-6);
}

TEST(NormalMapImage, TexelsThatAreNoDirectionBecomeOutwardAndAreCounted) {
  // Black, mid grey (the zero vector), inward, and two good ones: flat, and a vertical wall as 8 bits round it.
  const Image image{5, 1, 3, 8, {0, 0, 0, 128, 128, 128, 128, 128, 1, 128, 128, 255, 255, 128, 127}};
  const NormalMap map = map_of(image, {.filter = NormalFilter::nearest});
  EXPECT_EQ(map.degenerate_texels(), 3U);
  for (int x = 0; x < 4; ++x) EXPECT_EQ(map.texel(x, 0), Vec3::UnitZ());
  EXPECT_EQ(map.texel(4, 0), Vec3::UnitX());
}

TEST(NormalMapImage, RefusesWhatCannotBeANormalMap) {
  EXPECT_EQ(NormalMap::build(Image{1, 1, 1, 8, {9}}, {}).error().code, ErrorCode::bad_value);
  EXPECT_EQ(NormalMap::build(Image{}, {}).error().code, ErrorCode::bad_value);
}

TEST(NormalMapHeights, MatchTheAnalyticNormalsOfACosine) {
  const double amplitude = 1e-3;
  const Vec2 tile(10e-3, 20e-3);
  const auto error_at = [&](int size) {
    const auto map = NormalMap::build(cosine_relief(size, amplitude), tile);
    EXPECT_TRUE(map.ok());
    double worst = 0.0;
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const double s = 2.0 * pi * (x + 0.5) / size;
        const double t = 2.0 * pi * (1.0 - (y + 0.5) / size);
        const Vec3 normal(2.0 * pi * amplitude * std::sin(s) * std::cos(t) / tile.x(),
                          2.0 * pi * amplitude * std::cos(s) * std::sin(t) / tile.y(), 1.0);
        worst = std::max(worst, (map->texel(x, y) - normal.normalized()).norm());
      }
    }
    return worst;
  };
  const double coarse = error_at(32);
  const double fine = error_at(64);
  EXPECT_LT(fine, 2e-3);
  EXPECT_NEAR(coarse / fine, 4.0, 0.8);  // central differences are of second order
}

TEST(NormalMapHeights, RefusesATileThatIsNoSize) {
  const HeightMap heights = cosine_relief(4, 1e-3);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Vec2& tile : {Vec2(0.0, 1.0), Vec2(1.0, -1.0), Vec2(nan, 1.0), Vec2(infinity, 1.0)}) {
    const auto map = NormalMap::build(heights, tile);
    ASSERT_FALSE(map.ok());
    EXPECT_EQ(map.error().place, "tile");
  }
}

RC_GTEST_PROP(NormalMapSample, IsAlwaysAUnitOutwardNormalAndRepeats, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const auto filter = *rc::gen::element(NormalFilter::nearest, NormalFilter::bilinear);
  Image image{static_cast<int>(1 + rng.below(9)), static_cast<int>(1 + rng.below(9)), 3, 8, {}};
  for (std::size_t i = 0; i < image.pixels() * 3; ++i)
    image.samples.push_back(static_cast<std::uint16_t>(rng.below(256)));
  const NormalMap map = map_of(image, {.filter = filter});
  for (int i = 0; i < 50; ++i) {
    const Vec2 st(rng.below(4096) / 4096.0, rng.below(4096) / 4096.0);
    const Vec3 normal = map.sample(st);
    RC_ASSERT(std::abs(normal.norm() - 1.0) < 1e-12);
    RC_ASSERT(normal.z() >= 0.0);
    RC_ASSERT(map.sample(st + Vec2(3.0, -5.0)) == normal);
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  RC_ASSERT(map.sample({nan, infinity}) == map.sample({0.0, 0.0}));
}

TEST(NormalMapSample, OppositeWallsMeetOutward) {
  const Image image{2, 1, 3, 8, {255, 128, 128, 1, 128, 128}};
  const NormalMap map = map_of(image, {.wrap = Wrap::clamp});
  EXPECT_EQ(map.sample({0.5, 0.5}), Vec3::UnitZ());
}

}  // namespace
}  // namespace asperity::normal_map_test
