#include "asperity/field/height/plane.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "asperity/core/rng.h"
#include "asperity/field/height/map.h"

namespace asperity::height_plane_test {
namespace {

using std::numbers::pi;

constexpr Reconstruction all_reconstructions[] = {Reconstruction::nearest, Reconstruction::bilinear,
                                                  Reconstruction::quadratic_bspline, Reconstruction::bicubic};
constexpr Wrap both_wraps[] = {Wrap::repeat, Wrap::clamp};

HeightMap map_of(std::vector<float> heights, int width, int height, Wrap wrap, Reconstruction reconstruction) {
  auto map = HeightMap::build(std::move(heights), width, height, wrap, reconstruction);
  EXPECT_TRUE(map.ok());
  return std::move(map).value();
}

template <class Formula>
HeightMap map_by(int width, int height, Wrap wrap, Reconstruction reconstruction, const Formula& formula) {
  return map_of(tabulated<float>(width, height, formula), width, height, wrap, reconstruction);
}

HeightMap random_map(int width, int height, Wrap wrap, Reconstruction reconstruction, std::uint64_t seed) {
  Rng rng(seed);
  std::vector<float> heights(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (float& h : heights) h = static_cast<float>(rng.uniform(-1e-3, 1e-3));
  return map_of(std::move(heights), width, height, wrap, reconstruction);
}

double off(const HeightMap& map, const HeightPlane& plane, const Vec2& st) {
  return std::abs(map.height_at(st) - plane.height - plane.slope.dot(st - plane.centre));
}

/// Largest distance from the plane on a grid over the rectangle, corners and edges included.
double largest_off(const HeightMap& map, const HeightPlane& plane, const Vec2& lower, const Vec2& upper, int steps) {
  double largest = 0.0;
  for (int j = 0; j <= steps; ++j) {
    for (int i = 0; i <= steps; ++i) {
      const Vec2 st = lower + (upper - lower).cwiseProduct(Vec2(i, j) / steps);
      largest = std::max(largest, off(map, plane, st.cwiseMax(lower).cwiseMin(upper)));
    }
  }
  return largest;
}

RC_GTEST_PROP(HeightPlane, HoldsEverySampleOfTheRectangle, ()) {
  const int width = *rc::gen::inRange(1, 70);
  const int height = *rc::gen::inRange(1, 70);
  const Wrap wrap = *rc::gen::element(Wrap::repeat, Wrap::clamp);
  const Reconstruction reconstruction =
      *rc::gen::elementOf(std::vector<Reconstruction>(std::begin(all_reconstructions), std::end(all_reconstructions)));
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const HeightMap map = random_map(width, height, wrap, reconstruction, rng.next());
  for (int i = 0; i < 40; ++i) {
    Vec2 lower;
    Vec2 upper;
    for (int axis = 0; axis < 2; ++axis) {
      const int texels = axis == 0 ? width : height;
      double from = rng.uniform(-2.0, 2.0);
      double to = from + std::pow(10.0, rng.uniform(-4.0, 0.5 + std::log10(texels))) / texels;
      for (double* end : {&from, &to})
        if (rng.below(4) == 0) *end = std::round(*end * texels) / texels;
      lower[axis] = std::min(from, to);
      upper[axis] = std::max(from, to);
    }
    const HeightPlane plane = map.plane_over(lower, upper);
    RC_ASSERT(largest_off(map, plane, lower, upper, 24) <= plane.error);
    for (int k = 0; k < 100; ++k) {
      const Vec2 st(rng.uniform(lower.x(), upper.x()), rng.uniform(lower.y(), upper.y()));
      RC_ASSERT(off(map, plane, st) <= plane.error);
    }
  }
}

TEST(HeightPlane, IsExactOfASlope) {
  for (const Reconstruction reconstruction :
       {Reconstruction::bilinear, Reconstruction::quadratic_bspline, Reconstruction::bicubic}) {
    const HeightMap map = map_by(200, 120, Wrap::clamp, reconstruction,
                                 [](const Vec2& st) { return 1e-3 * (0.3 + 2.0 * st.x() - 0.7 * st.y()); });
    Rng rng(3);
    for (int i = 0; i < 500; ++i) {
      // Far enough from the border, where the spline is mirrored.
      const Vec2 lower(rng.uniform(0.2, 0.5), rng.uniform(0.2, 0.5));
      const Vec2 upper = lower + std::pow(10.0, rng.uniform(-4.0, -0.6)) * Vec2(rng.uniform(), rng.uniform());
      const HeightPlane plane = map.plane_over(lower, upper);
      EXPECT_LT(plane.error, 1e-9) << to_string(reconstruction) << " " << (upper - lower).transpose();
      EXPECT_NEAR(plane.height, 1e-3 * (0.3 + 2.0 * plane.centre.x() - 0.7 * plane.centre.y()), 1e-9);
    }
  }
}

/// Mean error of planes over squares this large (texels).
double mean_error(const HeightMap& map, double texels, std::uint64_t seed) {
  Rng rng(seed);
  double sum = 0.0;
  for (int i = 0; i < 500; ++i) {
    const Vec2 lower(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0));
    sum += map.plane_over(lower, lower + texels * Vec2(1.0 / map.width(), 1.0 / map.height())).error / 500.0;
  }
  return sum;
}

TEST(HeightPlane, ErrorFallsWithTheSquareOfTheSizeWhereTheReliefIsSmooth) {
  const int size = 1024;
  for (const Reconstruction reconstruction : {Reconstruction::quadratic_bspline, Reconstruction::bicubic}) {
    const HeightMap map = map_by(size, size, Wrap::repeat, reconstruction, [](const Vec2& st) {
      return 1e-3 * std::cos(8.0 * pi * st.x()) * std::cos(6.0 * pi * st.y());
    });
    // From a fraction of a texel to many blocks: in all by the square, with a step where blocks begin.
    double before = mean_error(map, 0.25, 5);
    const double least = before;
    for (double texels = 0.5; texels < 100.0; texels *= 2.0) {
      const double now = mean_error(map, texels, 5);
      EXPECT_GT(now, 2.0 * before) << to_string(reconstruction) << " " << texels;
      before = now;
    }
    EXPECT_NEAR(std::log(before / least) / std::log(64.0 / 0.25), 2.0, 0.15) << to_string(reconstruction);
  }
}

TEST(HeightPlane, IsFarThinnerThanTheRangeAndNearWhatThereIs) {
  const int size = 512;
  const auto rough = [](const Vec2& st) {
    double height = 0.0;
    for (int octave = 1; octave <= 64; octave *= 2)
      height += std::sin(2.0 * pi * octave * (st.x() + 0.3 * octave)) * std::cos(2.0 * pi * octave * st.y()) / octave;
    return 1e-3 * height;
  };
  for (const Reconstruction reconstruction : {Reconstruction::bilinear, Reconstruction::quadratic_bspline}) {
    const HeightMap map = map_by(size, size, Wrap::repeat, reconstruction, rough);
    for (const double texels : {0.5, 2.0, 5.0, 12.0, 40.0}) {
      Rng rng(7);
      double error = 0.0;
      double there_is = 0.0;
      double range = 0.0;
      for (int i = 0; i < 200; ++i) {
        const Vec2 lower(rng.uniform(), rng.uniform());
        const Vec2 upper = lower + Vec2::Constant(texels / size);
        const HeightPlane plane = map.plane_over(lower, upper);
        const HeightRange all = map.range_over(lower, upper);
        error += plane.error;
        there_is += largest_off(map, plane, lower, upper, 20);
        range += 0.5 * (all.highest - all.lowest);
      }
      std::cout << to_string(reconstruction) << ", " << texels << " texels: error " << error / there_is
                << " of what there is, the range " << range / there_is << "\n";
      EXPECT_LT(error / there_is, 2.5) << texels;
      if (texels <= 5.0) {
        EXPECT_LT(error, 0.5 * range) << texels;
      }
    }
  }
}

TEST(HeightPlane, IsAtMostTwiceAsThickAsTheRange) {
  for (const Wrap wrap : both_wraps) {
    for (const Reconstruction reconstruction : all_reconstructions) {
      const HeightMap map = random_map(97, 60, wrap, reconstruction, 11);
      Rng rng(12);
      for (int i = 0; i < 2000; ++i) {
        const Vec2 lower(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0));
        const Vec2 upper = lower + Vec2(rng.uniform(), rng.uniform()) * std::pow(10.0, rng.uniform(-3.0, 0.5));
        const HeightRange all = map.range_over(lower, upper);
        const HeightPlane plane = map.plane_over(lower, upper);
        ASSERT_LT(plane.error, (all.highest - all.lowest) + 1e-9)
            << to_string(reconstruction) << " " << (upper - lower).transpose();
      }
    }
  }
}

TEST(HeightPlane, IsLevelWhereOneCoordinateOfTheMapStandsForSeveral) {
  const auto wave = [](const Vec2& st) {
    return 1e-3 * std::sin(2.0 * pi * (st.x() + 0.1)) * std::cos(2.0 * pi * st.y());
  };
  const HeightMap clamped = map_by(30, 20, Wrap::clamp, Reconstruction::quadratic_bspline, wave);
  EXPECT_EQ(clamped.plane_over({-0.1, 0.2}, {0.3, 0.25}).slope.x(), 0.0);
  EXPECT_NE(clamped.plane_over({-0.1, 0.2}, {0.3, 0.25}).slope.y(), 0.0);
  EXPECT_EQ(clamped.plane_over({1.5, 0.2}, {1.6, 0.25}).slope.x(), 0.0);
  const HeightMap repeated = map_by(30, 20, Wrap::repeat, Reconstruction::quadratic_bspline, wave);
  EXPECT_EQ(repeated.plane_over({0.1, 0.2}, {2.3, 0.25}).slope.x(), 0.0);
  EXPECT_NE(repeated.plane_over({-0.1, 0.2}, {0.3, 0.25}).slope.x(), 0.0);
  for (const double bad : {infinity, -infinity, std::numeric_limits<double>::quiet_NaN()}) {
    const HeightPlane plane = repeated.plane_over({0.1, bad}, {0.2, 0.3});
    EXPECT_EQ(plane.slope, Vec2::Zero().eval());
    EXPECT_GE(plane.height + plane.error, repeated.highest());
    EXPECT_LE(plane.height - plane.error, repeated.lowest());
  }
}

TEST(HeightPlane, OfAConstantMapIsItsHeight) {
  const float height = 1.2345e-3F;
  for (const Wrap wrap : both_wraps) {
    for (const Reconstruction reconstruction : all_reconstructions) {
      const HeightMap map = map_of(std::vector<float>(20 * 30, height), 20, 30, wrap, reconstruction);
      for (const double size : {0.0, 0.01, 0.1, 0.5, 3.0}) {
        const HeightPlane plane = map.plane_over({0.37, 0.8}, {0.37 + size, 0.8 + size});
        EXPECT_NEAR(plane.height, static_cast<double>(height), 1e-18);
        EXPECT_LT(plane.error, 1e-18);
      }
    }
  }
}

TEST(HeightPlane, TakesAThirdOfTheMemoryOfTheValues) {
  const std::vector<float> values(std::size_t{1026} * 1026, 0.0F);
  const StoredTexels texels{values.data(), 1024, 1024, Reconstruction::quadratic_bspline};
  const auto held = static_cast<double>(PlanePyramid(texels).memory_bytes());
  EXPECT_LE(held, 0.34 * static_cast<double>(values.size() * sizeof(float)));
  // With the ranges' two thirds: the map's own.
  EXPECT_LE(held + static_cast<double>(RangePyramid(texels).memory_bytes()),
            1.01 * static_cast<double>(values.size() * sizeof(float)));
}

}  // namespace
}  // namespace asperity::height_plane_test
