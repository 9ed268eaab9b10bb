#include "asperity/field/height/detail_pyramid.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "asperity/core/rng.h"

namespace asperity::detail_pyramid_test {
namespace {

using std::numbers::pi;

constexpr Reconstruction all_reconstructions[] = {Reconstruction::nearest, Reconstruction::bilinear,
                                                  Reconstruction::quadratic_bspline, Reconstruction::bicubic};

HeightMap map_of(std::vector<float> heights, int width, int height, Wrap wrap, Reconstruction reconstruction) {
  auto map = HeightMap::build(std::move(heights), width, height, wrap, reconstruction);
  EXPECT_TRUE(map.ok());
  return *map;
}

/// The cosine relief of the formulation: c = 0.5 mm, lambda = 5 mm, crests at s = 0.
HeightMap cosine(int width, int height, Reconstruction reconstruction) {
  std::vector<float> heights;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) heights.push_back(static_cast<float>(5e-4 * std::cos(2.0 * pi * x / width)));
  }
  return map_of(std::move(heights), width, height, Wrap::repeat, reconstruction);
}

double peak_to_peak(const HeightMap& map) {
  double low = infinity;
  double high = -infinity;
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      low = std::min(low, map.texel(x, y));
      high = std::max(high, map.texel(x, y));
    }
  }
  return high - low;
}

/// Any small map: noise, steps or a slope with noise.
HeightMap random_map(Rng& rng, int most = 24) {
  const int width = 1 + static_cast<int>(rng.below(static_cast<std::uint32_t>(most)));
  const int height = 1 + static_cast<int>(rng.below(static_cast<std::uint32_t>(most)));
  const std::uint32_t kind = rng.below(3);
  std::vector<float> heights;
  for (int i = 0; i < width * height; ++i) {
    double value = rng.uniform();
    if (kind == 1) value = value < 0.8 ? 0.0 : 1.0;
    if (kind == 2) value = 0.2 * value + std::sin(0.5 * (i % width)) * std::cos(0.3 * (i / width));
    heights.push_back(static_cast<float>(1e-3 * value));
  }
  return map_of(std::move(heights), width, height, rng.below(2) == 0 ? Wrap::repeat : Wrap::clamp,
                all_reconstructions[rng.below(3)]);
}

Rng random_numbers() {
  return Rng(static_cast<std::uint64_t>(*rc::gen::inRange(0, 1 << 30)));
}

/// Every texel of the ball's disc in turn, each as often as the disc meets it: beyond the border too.
double brute_force(const HeightMap& map, const Vec2& tile, double radius, int x, int y) {
  const Vec2 texel(tile.x() / map.width(), tile.y() / map.height());
  const int reach_x = std::min(static_cast<int>(radius / texel.x()) + 1, 2 * map.width());
  const int reach_y = std::min(static_cast<int>(radius / texel.y()) + 1, 2 * map.height());
  const auto place = [&](int at, int count) {
    return map.wrap() == Wrap::repeat ? ((at % count) + count) % count : std::clamp(at, 0, count - 1);
  };
  double best = -infinity;
  for (int j = -reach_y; j <= reach_y; ++j) {
    for (int i = -reach_x; i <= reach_x; ++i) {
      const double apart = std::hypot(i * texel.x(), j * texel.y());
      if (apart > radius) continue;
      best = std::max(best, map.texel(place(x + i, map.width()), place(y + j, map.height())) +
                                std::sqrt(radius * radius - apart * apart) - radius);
    }
  }
  return best;
}

// ---- dilation

TEST(DetailPyramid, BallInTheValleysOfACosineHasTheFormulationsFigures) {
  // T10: lambda^2 / (4 pi^2 c) = 1.2665 mm is the radius of the valleys; a smaller ball reaches their bottom.
  const Vec2 tile(5e-3, 5e-3 / 256.0);
  const HeightMap relief = cosine(1024, 4, Reconstruction::quadratic_bspline);
  const auto share = [&](double radius) {
    auto followed = dilated(relief, tile, radius);
    EXPECT_TRUE(followed.ok());
    return peak_to_peak(*followed) / peak_to_peak(relief);
  };
  EXPECT_NEAR(share(1.25e-3), 1.0, 1e-6);
  EXPECT_NEAR(share(1.30e-3), 0.9998, 5e-5);
  EXPECT_NEAR(share(3.0e-3), 0.747, 5e-4);
  EXPECT_NEAR(5e-3 * 5e-3 / (4.0 * pi * pi * 5e-4), 1.2665e-3, 1e-7);
}

RC_GTEST_PROP(DetailPyramid, DilationIsTheGreatestOverTheDisc, ()) {
  Rng rng = random_numbers();
  const HeightMap map = random_map(rng);
  const Vec2 tile(rng.uniform(1e-3, 2e-2), rng.uniform(1e-3, 2e-2));
  const double radius = std::exp(rng.uniform(std::log(2e-5), std::log(5e-2)));
  auto followed = dilated(map, tile, radius);
  RC_ASSERT(followed.ok());
  RC_ASSERT(followed->wrap() == map.wrap());
  RC_ASSERT(followed->reconstruction() == map.reconstruction());
  for (int n = 0; n < 12; ++n) {
    const int x = static_cast<int>(rng.below(static_cast<std::uint32_t>(map.width())));
    const int y = static_cast<int>(rng.below(static_cast<std::uint32_t>(map.height())));
    RC_ASSERT(std::abs(followed->texel(x, y) - brute_force(map, tile, radius, x, y)) < 2e-9);
  }
}

RC_GTEST_PROP(DetailPyramid, DilationRisesWithTheRadiusToTheHighestTexel, ()) {
  Rng rng = random_numbers();
  const HeightMap map = random_map(rng);
  const Vec2 tile(1e-2, 8e-3);
  const HeightMap* below = &map;
  std::vector<HeightMap> maps;
  maps.reserve(8);
  double highest = -infinity;
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) highest = std::max(highest, map.texel(x, y));
  }
  for (const double radius : {1e-4, 4e-4, 1.5e-3, 6e-3, 0.1, 1e3}) {
    auto followed = dilated(map, tile, radius);
    RC_ASSERT(followed.ok());
    maps.push_back(std::move(*followed));
    for (int y = 0; y < map.height(); ++y) {
      for (int x = 0; x < map.width(); ++x) {
        RC_ASSERT(maps.back().texel(x, y) >= below->texel(x, y) - 1e-9);
        RC_ASSERT(maps.back().texel(x, y) <= highest + 1e-9);
      }
    }
    below = &maps.back();
  }
  // A ball of a kilometre lies on the highest texel alone: nothing else is left over a centimetre.
  RC_ASSERT(peak_to_peak(maps.back()) < 1e-7);
}

TEST(DetailPyramid, ABallRollsOverTheBorderOfARepeatingMapAlone) {
  std::vector<float> heights(64 * 8, 0.0F);
  for (int y = 0; y < 8; ++y) heights[static_cast<std::size_t>(64 * y)] = 1e-3F;
  const Vec2 tile(6.4e-3, 8e-4);
  for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
    const HeightMap map = map_of(heights, 64, 8, wrap, Reconstruction::bilinear);
    auto followed = dilated(map, tile, 2e-3);
    ASSERT_TRUE(followed.ok());
    const double one_step = 1e-3 - (2e-3 - std::sqrt(4e-6 - 1e-8));
    EXPECT_NEAR(followed->texel(1, 3), one_step, 1e-9);
    EXPECT_NEAR(followed->texel(63, 3), wrap == Wrap::repeat ? one_step : 0.0, 1e-9);
    EXPECT_NEAR(followed->texel(32, 3), 0.0, 1e-12);
  }
}

TEST(DetailPyramid, NoRadiusChangesNothing) {
  const HeightMap map = cosine(32, 4, Reconstruction::quadratic_bspline);
  auto followed = dilated(map, Vec2(5e-3, 1e-3), 0.0);
  ASSERT_TRUE(followed.ok());
  for (int x = 0; x < 32; ++x) EXPECT_NEAR(followed->texel(x, 1), map.texel(x, 1), 1e-10);
}

// ---- low pass

TEST(DetailPyramid, LowPassTakesWavelengthsByTheFiltersLaw) {
  // Three boxes as wide as the scale: sinc^3 of scale over wavelength.
  const Vec2 tile(5e-3, 5e-3);
  const HeightMap map = cosine(128, 8, Reconstruction::quadratic_bspline);
  DetailSettings settings;
  settings.kind = DetailKind::low_pass;
  settings.finest = 5e-3 / 8.0;
  settings.levels = 5;
  auto pyramid = DetailPyramid::build(map, tile, settings);
  ASSERT_TRUE(pyramid.ok());
  for (int level = 1; level < 5; ++level) {
    const double q = pi * pyramid->scale(level) / 5e-3;
    const double share = std::pow(std::sin(q) / q, 3.0);
    double low = infinity;
    double high = -infinity;
    for (int i = 0; i < 1000; ++i) {
      const double height = pyramid->map(level).height_at(Vec2(i / 1000.0, 0.3));
      low = std::min(low, height);
      high = std::max(high, height);
    }
    EXPECT_NEAR(high - low, 1e-3 * share, 2e-5 * (share + 0.02)) << level;
    EXPECT_NEAR(pyramid->removed(level), 5e-4 * (1.0 - share), 8e-6) << level;
  }
  EXPECT_EQ(peak_to_peak(pyramid->map(5)), 0.0);
  EXPECT_EQ(pyramid->scale(5), infinity);
  EXPECT_LT(pyramid->map(2).width(), 128) << "a spline needs fewer texels for less detail";
}

RC_GTEST_PROP(DetailPyramid, LowPassKeepsTheMeanAndTheRange, ()) {
  Rng rng = random_numbers();
  const HeightMap map = random_map(rng);
  DetailSettings settings;
  settings.kind = DetailKind::low_pass;
  const Vec2 tile(rng.uniform(1e-3, 2e-2), rng.uniform(1e-3, 2e-2));
  auto pyramid = DetailPyramid::build(map, tile, settings);
  RC_ASSERT(pyramid.ok());
  double mean = 0.0;
  double low = infinity;
  double high = -infinity;
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      mean += map.texel(x, y) / (map.width() * map.height());
      low = std::min(low, map.texel(x, y));
      high = std::max(high, map.texel(x, y));
    }
  }
  RC_ASSERT(std::abs(pyramid->map(pyramid->levels()).texel(0, 0) - mean) < 1e-9);
  for (int level = 1; level <= pyramid->levels(); ++level) {
    const HeightMap& filtered = pyramid->map(level);
    RC_ASSERT(filtered.wrap() == map.wrap());
    RC_ASSERT(filtered.reconstruction() == map.reconstruction());
    if (filtered.width() != map.width() || filtered.height() != map.height()) continue;
    double sum = 0.0;
    for (int y = 0; y < map.height(); ++y) {
      for (int x = 0; x < map.width(); ++x) {
        sum += filtered.texel(x, y) / (map.width() * map.height());
        RC_ASSERT(filtered.texel(x, y) > low - 1e-9);
        RC_ASSERT(filtered.texel(x, y) < high + 1e-9);
      }
    }
    RC_ASSERT(std::abs(sum - mean) < 1e-9);
  }
}

// ---- both

RC_GTEST_PROP(DetailPyramid, RemovedBoundsEveryDifferenceAndRises, ()) {
  Rng rng = random_numbers();
  const HeightMap map = random_map(rng);
  DetailSettings settings;
  settings.kind = rng.below(2) == 0 ? DetailKind::dilation : DetailKind::low_pass;
  auto pyramid = DetailPyramid::build(map, Vec2(7e-3, 9e-3), settings);
  RC_ASSERT(pyramid.ok());
  RC_ASSERT(pyramid->removed(0) == 0.0);
  for (int level = 1; level <= pyramid->levels(); ++level) {
    RC_ASSERT(pyramid->removed(level) >= pyramid->removed(level - 1));
    RC_ASSERT(pyramid->scale(level) > pyramid->scale(level - 1));
    for (int n = 0; n < 40; ++n) {
      const Vec2 st(rng.uniform(-0.2, 1.2), rng.uniform(-0.2, 1.2));
      const double apart = std::abs(map.height_at(st) - pyramid->map(level).height_at(st));
      RC_ASSERT(apart <= pyramid->removed(level) + 2e-9);
    }
  }
}

RC_GTEST_PROP(DetailPyramid, LevelsOfScaleAndOfRemovedRiseContinuously, ()) {
  Rng rng = random_numbers();
  const HeightMap map = random_map(rng);
  DetailSettings settings;
  settings.kind = rng.below(2) == 0 ? DetailKind::dilation : DetailKind::low_pass;
  auto pyramid = DetailPyramid::build(map, Vec2(7e-3, 9e-3), settings);
  RC_ASSERT(pyramid.ok());
  const double finest = pyramid->levels() > 1 || settings.kind == DetailKind::dilation ? pyramid->scale(1) : 1e-3;
  RC_ASSERT(pyramid->level_of_scale(0.0) == 0.0);
  RC_ASSERT(pyramid->level_of_removed(0.0) == 0.0);
  RC_ASSERT(pyramid->level_of_scale(infinity) == pyramid->levels());
  RC_ASSERT(pyramid->level_of_removed(infinity) == pyramid->levels());
  for (int level = 1; level < pyramid->levels(); ++level)
    RC_ASSERT(std::abs(pyramid->level_of_scale(pyramid->scale(level)) - level) < 1e-9);
  const double most = pyramid->removed(pyramid->levels());
  double by_scale = 0.0;
  double by_height = 0.0;
  for (int i = 1; i <= 4000; ++i) {
    const double scale = i * finest / 400.0;
    const double level = pyramid->level_of_scale(scale);
    RC_ASSERT(level >= by_scale);
    RC_ASSERT(level - by_scale < 0.01);
    by_scale = level;
    const double height = i * 1.2 * most / 4000.0 + 1e-12 * i;
    const double removed = pyramid->level_of_removed(height);
    RC_ASSERT(removed >= by_height);
    by_height = removed;
    // What mixing leaves out at that level is no more than asked.
    const int lower = std::min(static_cast<int>(removed), pyramid->levels() - 1);
    const double share = removed - lower;
    RC_ASSERT((1.0 - share) * pyramid->removed(lower) + share * pyramid->removed(lower + 1) <= height + 1e-12);
  }
}

TEST(DetailPyramid, LevelOfRemovedIsContinuousWhereNothingIsRemoved) {
  // A flat map leaves out nothing at any level: the level still rises without a jump.
  const HeightMap flat = map_of(std::vector<float>(64, 1e-3F), 8, 8, Wrap::repeat, Reconstruction::quadratic_bspline);
  auto pyramid = DetailPyramid::build(flat, Vec2(8e-3, 8e-3), {});
  ASSERT_TRUE(pyramid.ok());
  EXPECT_EQ(pyramid->removed(pyramid->levels()), 0.0);
  double before = 0.0;
  for (int i = 1; i <= 10000; ++i) {
    const double level = pyramid->level_of_removed(i * 1e-12);
    EXPECT_LT(level - before, 2e-3);
    EXPECT_GE(level, before);
    before = level;
  }
  EXPECT_EQ(before, pyramid->levels());
}

TEST(DetailPyramid, MixedLevelsNeverRemoveMoreThanAsked) {
  const HeightMap map = cosine(64, 4, Reconstruction::quadratic_bspline);
  auto pyramid = DetailPyramid::build(map, Vec2(5e-3, 3e-4), {DetailKind::low_pass, 0.0, 0, std::size_t{1} << 26U});
  ASSERT_TRUE(pyramid.ok());
  for (const double height : {1e-6, 1e-5, 1e-4, 3e-4}) {
    const double level = pyramid->level_of_removed(height);
    const int lower = static_cast<int>(level);
    for (int i = 0; i < 50; ++i) {
      const Vec2 st(i / 50.0, 0.4);
      const double fine = lower == 0 ? map.height_at(st) : pyramid->map(lower).height_at(st);
      const double coarse = pyramid->map(lower + 1).height_at(st);
      EXPECT_LE(std::abs(std::lerp(fine, coarse, level - lower) - map.height_at(st)), height * (1.0 + 1e-6));
    }
  }
}

TEST(DetailPyramid, HasAsManyLevelsAsTheMapOctaves) {
  const HeightMap map = cosine(64, 64, Reconstruction::bilinear);
  auto balls = DetailPyramid::build(map, Vec2(6.4e-3, 6.4e-3), {});
  ASSERT_TRUE(balls.ok());
  EXPECT_EQ(balls->levels(), 6);
  EXPECT_NEAR(balls->scale(1), 1e-4, 1e-12);
  EXPECT_NEAR(balls->scale(6), 3.2e-3, 1e-12) << "half of the tile";
  DetailSettings settings;
  settings.kind = DetailKind::low_pass;
  auto waves = DetailPyramid::build(map, Vec2(6.4e-3, 6.4e-3), settings);
  ASSERT_TRUE(waves.ok());
  EXPECT_EQ(waves->levels(), 6);
  EXPECT_NEAR(waves->scale(1), 2e-4, 1e-12);
  EXPECT_EQ(waves->map(6).width(), 1);
  EXPECT_GT(balls->memory_bytes(), 6U * 64U * 64U * sizeof(float));
}

TEST(DetailPyramid, RefusesWhatCannotBe) {
  const HeightMap map = cosine(16, 16, Reconstruction::bilinear);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refusal = [&](const Vec2& tile, const DetailSettings& settings) {
    auto pyramid = DetailPyramid::build(map, tile, settings);
    EXPECT_FALSE(pyramid.ok());
    return pyramid.ok() ? Error{} : pyramid.error();
  };
  DetailSettings settings;
  EXPECT_EQ(refusal(Vec2(0.0, 1e-3), settings).place, "tile");
  EXPECT_EQ(refusal(Vec2(nan, 1e-3), settings).place, "tile");
  settings.finest = -1.0;
  EXPECT_EQ(refusal(Vec2(1e-3, 1e-3), settings).place, "finest");
  settings.finest = infinity;
  EXPECT_EQ(refusal(Vec2(1e-3, 1e-3), settings).place, "finest");
  settings = {};
  settings.levels = 17;
  EXPECT_EQ(refusal(Vec2(1e-3, 1e-3), settings).place, "levels");
  settings.levels = -1;
  EXPECT_EQ(refusal(Vec2(1e-3, 1e-3), settings).place, "levels");
  settings = {};
  settings.most_bytes = 1000;
  EXPECT_EQ(refusal(Vec2(1e-3, 1e-3), settings).code, ErrorCode::too_large);
  auto negative = dilated(map, Vec2(1e-3, 1e-3), -1e-3);
  ASSERT_FALSE(negative.ok());
  EXPECT_EQ(negative.error().place, "radius");
  EXPECT_FALSE(dilated(map, Vec2(1e-3, -1e-3), 1e-3).ok());
}

TEST(DetailPyramid, KindsHaveNames) {
  EXPECT_EQ(std::string(to_string(DetailKind::dilation)), "dilation");
  EXPECT_EQ(std::string(to_string(DetailKind::low_pass)), "low_pass");
}

}  // namespace
}  // namespace asperity::detail_pyramid_test
