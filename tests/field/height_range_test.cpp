#include "asperity/field/height/range.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "asperity/core/rng.h"
#include "asperity/field/height/map.h"

namespace asperity::height_range_test {
namespace {

using std::numbers::pi;

constexpr Reconstruction all_reconstructions[] = {Reconstruction::nearest, Reconstruction::bilinear,
                                                  Reconstruction::quadratic_bspline, Reconstruction::bicubic};
constexpr Wrap both_wraps[] = {Wrap::repeat, Wrap::clamp};

static_assert(noexcept(std::declval<const HeightMap&>().range_over(std::declval<const Vec2&>(),
                                                                   std::declval<const Vec2&>())));

HeightMap map_of(std::vector<float> heights, int width, int height, Wrap wrap, Reconstruction reconstruction) {
  auto map = HeightMap::build(std::move(heights), width, height, wrap, reconstruction);
  EXPECT_TRUE(map.ok());
  return std::move(map).value();
}

HeightMap random_map(int width, int height, Wrap wrap, Reconstruction reconstruction, std::uint64_t seed) {
  Rng rng(seed);
  std::vector<float> heights(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (float& value : heights) value = static_cast<float>(rng.uniform(-1e-3, 1e-3));
  return map_of(std::move(heights), width, height, wrap, reconstruction);
}

struct Rectangle {
  Vec2 lower;
  Vec2 upper;
};

/// From a ten-thousandth of a texel to three times the map, of any proportions; some with corners a rounding error from
/// a texel's border.
Rectangle random_rectangle(Rng& rng, int width, int height) {
  Rectangle rectangle;
  for (int axis = 0; axis < 2; ++axis) {
    const int texels = axis == 0 ? width : height;
    double from = rng.uniform(-2.0, 2.0);
    double to = from + std::pow(10.0, rng.uniform(-4.0, 0.5 + std::log10(texels))) / texels;
    for (double* end : {&from, &to}) {
      if (rng.below(4) != 0) continue;
      *end = std::round(*end * texels) / texels;
      const std::uint32_t side = rng.below(3);
      if (side != 0) *end = std::nextafter(*end, side == 1 ? -infinity : infinity);
    }
    rectangle.lower[axis] = std::min(from, to);
    rectangle.upper[axis] = std::max(from, to);
  }
  return rectangle;
}

/// What samples on a grid over a rectangle, its corners and edges included, answer.
HeightRange sampled_range(const HeightMap& map, const Rectangle& rectangle, int steps) {
  HeightRange range{infinity, -infinity};
  for (int j = 0; j <= steps; ++j) {
    for (int i = 0; i <= steps; ++i) {
      Vec2 st = rectangle.lower + (rectangle.upper - rectangle.lower).cwiseProduct(Vec2(i, j) / steps);
      st = st.cwiseMax(rectangle.lower).cwiseMin(rectangle.upper);
      const double height = map.height_at(st);
      range.lowest = std::min(range.lowest, height);
      range.highest = std::max(range.highest, height);
    }
  }
  return range;
}

double width_of(const HeightRange& range) {
  return range.highest - range.lowest;
}

/// 4 x 3 waves of amplitude 1.
HeightMap cosine_map(int size, Reconstruction reconstruction) {
  std::vector<float> heights;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      heights.push_back(
          static_cast<float>(std::cos(8.0 * pi * (x + 0.5) / size) * std::cos(6.0 * pi * (y + 0.5) / size)));
    }
  }
  return map_of(std::move(heights), size, size, Wrap::repeat, reconstruction);
}

/// How far a quadratic spline's coefficients lie from it, h^2 / 8 times the second derivative along each axis, and from
/// those on a grid twice as fine a quarter of that; for the cosine map, above and below together.
double polygon_distance(int size) {
  return 2.0 / 8.0 * (std::pow(8.0 * pi / size, 2) + std::pow(6.0 * pi / size, 2));
}

// ---- every sample lies within

RC_GTEST_PROP(HeightRange, HoldsEverySampleOfTheRectangle, ()) {
  const int width = *rc::gen::inRange(1, 50);
  const int height = *rc::gen::inRange(1, 50);
  const Wrap wrap = *rc::gen::element(Wrap::repeat, Wrap::clamp);
  const Reconstruction reconstruction =
      *rc::gen::elementOf(std::vector<Reconstruction>(std::begin(all_reconstructions), std::end(all_reconstructions)));
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const HeightMap map = random_map(width, height, wrap, reconstruction, rng.next());
  for (int i = 0; i < 40; ++i) {
    const Rectangle rectangle = random_rectangle(rng, width, height);
    const HeightRange range = map.range_over(rectangle.lower, rectangle.upper);
    const HeightRange sampled = sampled_range(map, rectangle, 24);
    RC_ASSERT(range.lowest <= sampled.lowest);
    RC_ASSERT(range.highest >= sampled.highest);
    RC_ASSERT(range.lowest >= map.lowest());
    RC_ASSERT(range.highest <= map.highest());
    for (int k = 0; k < 100; ++k) {
      const Vec2 st(rng.uniform(rectangle.lower.x(), rectangle.upper.x()),
                    rng.uniform(rectangle.lower.y(), rectangle.upper.y()));
      const double at = map.height_at(st.cwiseMax(rectangle.lower).cwiseMin(rectangle.upper));
      RC_ASSERT(range.lowest <= at && at <= range.highest);
    }
  }
}

TEST(HeightRange, SeesOneTexelThatStandsOutAndOnlyFromNear) {
  const int width = 301;
  const int height = 190;
  std::vector<float> heights(static_cast<std::size_t>(width * height), 0.0F);
  heights[static_cast<std::size_t>(77 * width + 123)] = 1.0F;
  for (const Wrap wrap : both_wraps) {
    for (const Reconstruction reconstruction : all_reconstructions) {
      const HeightMap map = map_of(heights, width, height, wrap, reconstruction);
      const Vec2 peak = map.texel_centre(123, 77);
      Rng rng(6);
      int near = 0;
      int far = 0;
      for (int i = 0; i < 20000; ++i) {
        const Vec2 size(std::pow(rng.uniform(), 2.0) * 0.6, std::pow(rng.uniform(), 2.0) * 0.6);
        const Vec2 lower(rng.uniform(-size.x(), 1.0), rng.uniform(-size.y(), 1.0));
        const Vec2 upper = lower + size;
        const double highest = map.range_over(lower, upper).highest;
        Vec2 gap = Vec2::Constant(infinity);  // between the rectangle and the peak, along each axis; < 0: none
        for (const double shift : {-1.0, 0.0, 1.0}) {
          if (wrap == Wrap::clamp && shift != 0.0) continue;
          const Vec2 at = peak + Vec2::Constant(shift);
          gap = gap.cwiseMin((lower - at).cwiseMax(at - upper));
        }
        if (gap.maxCoeff() <= 0.0) {
          ++near;
          ASSERT_GE(highest, 0.999);
        }
        const Vec2 texels(width, height);
        // The spline's ripple around the peak falls by 5.8 a texel.
        const double reach = size.cwiseProduct(texels).maxCoeff() / 3.0 + 2.5 + 8.0;
        if (gap.cwiseProduct(texels).maxCoeff() > reach) {
          ++far;
          ASSERT_LT(highest, 1e-5);
        }
      }
      EXPECT_GT(near, 200);
      EXPECT_GT(far, 2000);
    }
  }
}

TEST(HeightRange, OfAPointIsItsSample) {
  for (const Wrap wrap : both_wraps) {
    for (const Reconstruction reconstruction : all_reconstructions) {
      const HeightMap map = random_map(13, 6, wrap, reconstruction, 8);
      Rng rng(9);
      for (int i = 0; i < 1000; ++i) {
        const Vec2 st(rng.uniform(-2.0, 2.0), rng.uniform(-2.0, 2.0));
        const HeightRange range = map.range_over(st, st);
        const double height = map.height_at(st);
        ASSERT_LE(range.lowest, height);
        ASSERT_GE(range.highest, height);
        ASSERT_LT(width_of(range), 1e-13 * 1e-3);
      }
    }
  }
}

// ---- and the range is no wider than stated

TEST(HeightRange, OnFewTexelsIsExactForNearestAndBilinear) {
  const int width = 23;
  const int height = 31;
  for (const Wrap wrap : both_wraps) {
    for (const Reconstruction reconstruction : {Reconstruction::nearest, Reconstruction::bilinear}) {
      const HeightMap map = random_map(width, height, wrap, reconstruction, 10);
      Rng rng(11);
      for (int i = 0; i < 2000; ++i) {
        const Vec2 lower(rng.uniform(-1.5, 1.5), rng.uniform(-1.5, 1.5));
        const Vec2 upper = lower + Vec2(rng.uniform(0.0, 5.0) / width, rng.uniform(0.0, 5.0) / height);
        // Both take their extremes on the rectangle's edges or on lines through texel centres.
        std::vector<double> lines[2];
        for (int axis = 0; axis < 2; ++axis) {
          const int texels = axis == 0 ? width : height;
          lines[axis] = {lower[axis], upper[axis]};
          for (double k = std::floor(lower[axis] * texels); k <= upper[axis] * texels; ++k) {
            const double centre = (k + 0.5) / texels;
            if (lower[axis] < centre && centre < upper[axis]) lines[axis].push_back(centre);
          }
        }
        HeightRange exact{infinity, -infinity};
        for (const double s : lines[0]) {
          for (const double t : lines[1]) {
            exact.lowest = std::min(exact.lowest, map.height_at({s, t}));
            exact.highest = std::max(exact.highest, map.height_at({s, t}));
          }
        }
        const HeightRange range = map.range_over(lower, upper);
        ASSERT_NEAR(range.lowest, exact.lowest, 1e-12 * 1e-3);
        ASSERT_NEAR(range.highest, exact.highest, 1e-12 * 1e-3);
      }
    }
  }
}

TEST(HeightRange, OnFewTexelsExceedsTheSplineBySecondOrder) {
  const int size = 256;
  const HeightMap map = cosine_map(size, Reconstruction::quadratic_bspline);
  Rng rng(12);
  for (int i = 0; i < 1000; ++i) {
    const Vec2 lower(rng.uniform(-2.0, 2.0), rng.uniform(-2.0, 2.0));
    const Rectangle rectangle{lower, lower + Vec2(rng.uniform(0.0, 5.0), rng.uniform(0.0, 5.0)) / size};
    const double excess =
        width_of(map.range_over(rectangle.lower, rectangle.upper)) - width_of(sampled_range(map, rectangle, 40));
    ASSERT_LE(excess, polygon_distance(size));
  }
}

TEST(HeightRange, WithinATexelTightensWithTheSquareOfItsSize) {
  const HeightMap map = random_map(32, 32, Wrap::repeat, Reconstruction::quadratic_bspline, 13);
  const auto mean_excess = [&](double texels) {
    Rng rng(14);
    double sum = 0.0;
    for (int i = 0; i < 2000; ++i) {
      const Vec2 lower(rng.uniform(), rng.uniform());
      const Rectangle rectangle{lower, lower + Vec2::Constant(texels / 32)};
      sum += width_of(map.range_over(rectangle.lower, rectangle.upper)) - width_of(sampled_range(map, rectangle, 20));
    }
    return sum / 2000;
  };
  EXPECT_GT(mean_excess(0.4) / mean_excess(0.1), 12.0);
}

TEST(HeightRange, OverManyTexelsLooksNoFurtherThanAThirdOfTheLongerSide) {
  const int size = 256;
  for (const Reconstruction reconstruction : all_reconstructions) {
    const HeightMap map = cosine_map(size, reconstruction);
    Rng rng(15);
    double share = 0.0;
    const int count = 400;
    for (int i = 0; i < count; ++i) {
      const double longer = rng.uniform(4.0, 100.0);
      const Vec2 texels = longer * Vec2(rng.uniform(0.3, 1.0), 1.0);
      const Vec2 lower(rng.uniform(-2.0, 2.0), rng.uniform(-2.0, 2.0));
      const Rectangle rectangle{lower, lower + texels / size};
      const Vec2 reach = Vec2::Constant((longer / 3.0 + 2.5) / size);
      const Rectangle grown{rectangle.lower - reach, rectangle.upper + reach};
      const HeightRange range = map.range_over(rectangle.lower, rectangle.upper);
      const HeightRange truth = sampled_range(map, rectangle, 80);
      const HeightRange limit = sampled_range(map, grown, 160);
      ASSERT_GE(range.lowest, limit.lowest - polygon_distance(size));
      ASSERT_LE(range.highest, limit.highest + polygon_distance(size));
      share += (width_of(range) - width_of(truth)) / width_of(truth) / count;
    }
    EXPECT_LT(share, 0.2) << to_string(reconstruction);
  }
}

TEST(HeightRange, OfEverythingIsTheMapsOwn) {
  const int sizes[][2] = {{7, 7}, {8, 64}, {33, 9}, {100, 1}, {1, 47}, {65, 65}};
  for (const auto& [width, height] : sizes) {
    for (const Wrap wrap : both_wraps) {
      for (const Reconstruction reconstruction : all_reconstructions) {
        const HeightMap map = random_map(width, height, wrap, reconstruction, 16);
        for (const Rectangle& all : {Rectangle{{-0.2, -0.1}, {1.1, 1.0}}, Rectangle{{-7.0, -1e12}, {9.0, 1e300}}}) {
          const HeightRange range = map.range_over(all.lower, all.upper);
          EXPECT_EQ(range.lowest, map.lowest()) << width << " x " << height << " " << to_string(reconstruction);
          EXPECT_EQ(range.highest, map.highest());
        }
      }
    }
  }
}

// ---- coordinates

TEST(HeightRange, OfAWholePeriodIsThatOfTheAxis) {
  for (const Reconstruction reconstruction : all_reconstructions) {
    const HeightMap map = random_map(37, 20, Wrap::repeat, reconstruction, 17);
    const HeightRange axis = map.range_over({0.0, 0.31}, {1.0, 0.42});
    for (const auto& [from, to] : {std::pair{0.3, 1.3}, std::pair{-0.9, 0.2}, std::pair{-5.0, 7.0},
                                   std::pair{0.99, 2.01}, std::pair{-1e300, 0.1}}) {
      const HeightRange range = map.range_over({from, 0.31}, {to, 0.42});
      EXPECT_EQ(range.lowest, axis.lowest) << from;
      EXPECT_EQ(range.highest, axis.highest) << from;
    }
  }
}

TEST(HeightRange, RepeatsWithTheMap) {
  for (const Reconstruction reconstruction : all_reconstructions) {
    const HeightMap map = random_map(40, 24, Wrap::repeat, reconstruction, 18);
    Rng rng(19);
    for (int i = 0; i < 500; ++i) {
      // Multiples of 1/1024 stay exact under these shifts.
      const Vec2 lower(static_cast<double>(rng.below(1024)) / 1024.0, static_cast<double>(rng.below(1024)) / 1024.0);
      const Vec2 upper =
          lower + Vec2(static_cast<double>(rng.below(800)), static_cast<double>(rng.below(100))) / 1024.0;
      const HeightRange here = map.range_over(lower, upper);
      for (const double shift : {-1.0, 4.0, -1000.0, 0x1p31, -0x1p40}) {
        const Vec2 by(shift, -2.0 * shift);
        const HeightRange there = map.range_over(lower + by, upper + by);
        ASSERT_EQ(there.lowest, here.lowest) << shift;
        ASSERT_EQ(there.highest, here.highest) << shift;
      }
    }
  }
}

TEST(HeightRange, AnyTwoOppositeCornersMakeTheRectangle) {
  const HeightMap map = random_map(12, 40, Wrap::repeat, Reconstruction::quadratic_bspline, 20);
  const HeightRange range = map.range_over({0.2, 0.3}, {0.5, 0.9});
  for (const auto& [a, b] : {std::pair{Vec2(0.5, 0.9), Vec2(0.2, 0.3)}, std::pair{Vec2(0.2, 0.9), Vec2(0.5, 0.3)}}) {
    EXPECT_EQ(map.range_over(a, b).lowest, range.lowest);
    EXPECT_EQ(map.range_over(a, b).highest, range.highest);
  }
}

TEST(HeightRange, WithACoordinateThatIsNotFiniteIsTheMapsOwn) {
  for (const Wrap wrap : both_wraps) {
    const HeightMap map = random_map(12, 9, wrap, Reconstruction::quadratic_bspline, 21);
    for (const double bad : {infinity, -infinity, std::numeric_limits<double>::quiet_NaN()}) {
      for (int place = 0; place < 4; ++place) {
        Vec2 corners[2] = {Vec2(0.3, 0.4), Vec2(0.31, 0.41)};
        corners[place / 2][place % 2] = bad;
        const HeightRange range = map.range_over(corners[0], corners[1]);
        EXPECT_EQ(range.lowest, map.lowest());
        EXPECT_EQ(range.highest, map.highest());
      }
    }
  }
}

TEST(HeightRange, OfAConstantMapIsItsHeight) {
  const float height = 1.2345e-3F;
  for (const Wrap wrap : both_wraps) {
    for (const Reconstruction reconstruction : all_reconstructions) {
      const HeightMap map = map_of(std::vector<float>(20 * 30, height), 20, 30, wrap, reconstruction);
      for (const double size : {0.0, 0.01, 0.1, 0.5, 3.0}) {
        const HeightRange range = map.range_over({0.37, 0.8}, {0.37 + size, 0.8 + size});
        EXPECT_EQ(range.lowest, static_cast<double>(height));
        EXPECT_EQ(range.highest, static_cast<double>(height));
      }
    }
  }
}

TEST(HeightRange, TakesAtMostThreeQuartersOfTheMemoryOfTheValues) {
  const int sizes[][2] = {{1, 1},  {2, 1},   {2, 2},   {2, 3},     {3, 3},   {5, 1},
                          {17, 1}, {17, 17}, {1, 513}, {257, 129}, {1000, 3}};
  for (const auto& [width, height] : sizes) {
    const std::vector<float> values((static_cast<std::size_t>(width) + 2) * (static_cast<std::size_t>(height) + 2));
    const StoredTexels texels{values.data(), width, height, Reconstruction::quadratic_bspline};
    const std::size_t blocks = (static_cast<std::size_t>(width) * static_cast<std::size_t>(height) + 3) / 4;
    const std::size_t held = RangePyramid(texels).memory_bytes();
    EXPECT_LE(held, values.size() * sizeof(float) * 3 / 4) << width << " x " << height;
    EXPECT_GE(held, blocks * 2 * sizeof(float)) << width << " x " << height;
  }
}

}  // namespace
}  // namespace asperity::height_range_test
