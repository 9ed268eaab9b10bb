#include "asperity/field/mesostructure/generators.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <string_view>
#include <utility>

namespace asperity::mesostructure_generators_test {
namespace {

constexpr double amplitude = 1e-3;
constexpr MesostructureKind all_kinds[] = {
    MesostructureKind::flat,  MesostructureKind::serrated, MesostructureKind::beams,  MesostructureKind::rings,
    MesostructureKind::warts, MesostructureKind::coins,    MesostructureKind::groove, MesostructureKind::fractal};

/// Heights of a spec that is expected to be good.
std::vector<float> made(const MesostructureSpec& spec) {
  auto heights = generate_heights(spec);
  EXPECT_TRUE(heights.ok()) << (heights.ok() ? "" : heights.error().message());
  return heights.ok() ? std::move(*heights) : std::vector<float>();
}

/// Groups of neighbouring texels, on a tile that repeats, for which `belongs` holds.
template <class Belongs>
int groups(const std::vector<float>& heights, int size, Belongs&& belongs) {
  std::vector<bool> seen(heights.size());
  int found = 0;
  for (int start = 0; start < size * size; ++start) {
    std::vector<int> open{start};
    bool counted = false;
    while (!open.empty()) {
      const int texel = open.back();
      open.pop_back();
      const auto index = static_cast<std::size_t>(texel);
      if (seen[index] || !belongs(heights[index])) continue;
      seen[index] = true;
      found += counted ? 0 : 1;
      counted = true;
      const int x = texel % size;
      const int y = texel / size;
      open.insert(open.end(), {y * size + (x + 1) % size, y * size + (x + size - 1) % size, (y + 1) % size * size + x,
                               (y + size - 1) % size * size + x});
    }
  }
  return found;
}

double highest(const std::vector<float>& heights) {
  return *std::max_element(heights.begin(), heights.end());
}
double lowest(const std::vector<float>& heights) {
  return *std::min_element(heights.begin(), heights.end());
}

float at(const std::vector<float>& heights, int size, int x, int y) {
  return heights[static_cast<std::size_t>(y) * static_cast<std::size_t>(size) + static_cast<std::size_t>(x)];
}

/// Largest step between neighbours, `seam` only across the tile's edges or only within it.
double largest_step(const std::vector<float>& heights, int size, bool seam) {
  double largest = 0.0;
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j < size; ++j) {
      if ((j == size - 1) != seam) continue;
      const int next = (j + 1) % size;
      largest = std::max<double>(largest, std::abs(at(heights, size, j, i) - at(heights, size, next, i)));
      largest = std::max<double>(largest, std::abs(at(heights, size, i, j) - at(heights, size, i, next)));
    }
  }
  return largest;
}

// ---- H_1,k: checklist A1, row H-III'
// ----------------------------------------------------------------------------------

class Serrated : public testing::TestWithParam<int> {};

TEST_P(Serrated, H_III_PeakToPeakAndAsymmetryFollowTheSamplingLaw) {
  const int size = 64;
  const int texels = GetParam();  // a ridge
  const auto map = generate_height_map(
      {.kind = MesostructureKind::serrated, .size = size, .amplitude = amplitude, .count = size / texels}, Wrap::repeat,
      Reconstruction::bilinear);
  ASSERT_TRUE(map.ok());
  double low = infinity;
  double high = -infinity;
  int rising = 0;
  int falling = 0;
  const int steps = size * 32;
  for (int i = 0; i < steps; ++i) {
    // Between the texel centres, and including every centre.
    low = std::min(low, map->height_at({static_cast<double>(i) / steps, 0.4}));
    high = std::max(high, map->height_at({static_cast<double>(i) / steps, 0.4}));
    const double slope = map->sample({(i + 0.5) / steps, 0.4}).gradient.x();
    rising += slope > 0.0 ? 1 : 0;
    falling += slope < 0.0 ? 1 : 0;
  }
  const double p = texels;
  EXPECT_NEAR((high - low) / amplitude, (p - 1.0) / p, 1e-6);
  EXPECT_DOUBLE_EQ(static_cast<double>(falling - rising) / (falling + rising), (p - 2.0) / p);
}
INSTANTIATE_TEST_SUITE_P(TexelsARidge, Serrated, testing::Values(2, 4, 8, 16, 32));

TEST(SerratedHeights, RiseAtTheLeftOfEachRidgeAndCountAsAsked) {
  for (const int ridges : {1, 3, 7, 16, 50}) {  // 100 is no multiple of most of them
    const std::vector<float> heights =
        made({.kind = MesostructureKind::serrated, .size = 100, .amplitude = amplitude, .count = ridges});
    int rises = 0;
    for (int x = 0; x < 100; ++x) rises += at(heights, 100, x, 5) > at(heights, 100, (x + 99) % 100, 5) ? 1 : 0;
    EXPECT_EQ(rises, ridges);
    EXPECT_FLOAT_EQ(*std::max_element(heights.begin(), heights.end()), static_cast<float>(amplitude));
    EXPECT_GT(*std::min_element(heights.begin(), heights.end()), 0.0F);
    for (int y = 1; y < 100; ++y) ASSERT_EQ(at(heights, 100, 31, y), at(heights, 100, 31, 0));
  }
}

// ---- the others
// -------------------------------------------------------------------------------------------------------

TEST(FlatHeights, H_0_IsExactlyItsHeight) {
  for (const double height : {0.0, 1e-3, -2.3456789e-4}) {
    const auto map = generate_height_map({.kind = MesostructureKind::flat, .size = 8, .amplitude = height},
                                         Wrap::repeat, Reconstruction::quadratic_bspline);
    ASSERT_TRUE(map.ok());
    EXPECT_EQ(map->height_at({0.123, 7.9}), height);
    EXPECT_EQ(map->sample({0.123, 7.9}).gradient, Vec2::Zero());
  }
}

TEST(BeamHeights, H_2_AreFlatTopsFlatGroundAndWallsAtRightAngles) {
  const int size = 96;
  const std::vector<float> heights =
      made({.kind = MesostructureKind::beams, .size = size, .amplitude = amplitude, .count = 4});
  const std::set<float> levels(heights.begin(), heights.end());
  EXPECT_EQ(levels, (std::set<float>{0.0F, static_cast<float>(amplitude)}));
  const auto raised = std::count_if(heights.begin(), heights.end(), [](float h) { return h > 0.0F; });
  EXPECT_EQ(raised * 9, 5 * size * size);  // all but (2/3)^2
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      ASSERT_EQ(at(heights, size, x, y), at(heights, size, (x + 24) % size, y));
      ASSERT_EQ(at(heights, size, x, y), at(heights, size, x, (y + 24) % size));
      ASSERT_EQ(at(heights, size, x, y), at(heights, size, y, x));
    }
  }
}

TEST(RingHeights, H_3_HavePeaksHolesAndGentleSlopes) {
  const int size = 256;
  const std::vector<float> heights = made({.kind = MesostructureKind::rings, .size = size, .amplitude = amplitude});
  const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
  EXPECT_NEAR(*high, amplitude, 0.01 * amplitude);
  EXPECT_LE(*high, static_cast<float>(amplitude));
  EXPECT_NEAR(*low, 0.0, 0.01 * amplitude);
  EXPECT_GE(*low, 0.0F);
  EXPECT_NEAR(at(heights, size, 0, 0), 0.5 * amplitude, 1e-9);  // ground
  // The steepest flank is a raised cosine of width 0.06 and height amplitude / 2: pi/4 amplitude / 0.06 per tile.
  EXPECT_LE(largest_step(heights, size, false), 3.15 / 4.0 * amplitude / 0.06 / size);
}

TEST(WartHeights, H_4_AreSeededAndReachTheAmplitude) {
  const int size = 256;
  const std::vector<float> heights = made({.kind = MesostructureKind::warts, .size = size, .amplitude = amplitude});
  const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
  EXPECT_EQ(*low, 0.0F);
  EXPECT_NEAR(*high, amplitude, 0.02 * amplitude);
  EXPECT_LE(*high, static_cast<float>(amplitude));
  // Sizes vary: local maxima (over 5 x 5 texels) of clearly different heights, and many of them.
  std::set<int> tenths;
  int tops = 0;
  for (int y = 2; y < size - 2; ++y) {
    for (int x = 2; x < size - 2; ++x) {
      const float here = at(heights, size, x, y);
      bool top = here > 0.0F;
      for (int j = -2; j <= 2; ++j) {
        for (int i = -2; i <= 2; ++i) top = top && ((i == 0 && j == 0) || at(heights, size, x + i, y + j) < here);
      }
      if (!top) continue;
      ++tops;
      tenths.insert(static_cast<int>(10.0 * here / amplitude));
    }
  }
  EXPECT_GE(tops, 30);
  EXPECT_GE(tenths.size(), 4U);
}

TEST(GrooveHeights, H_6_IsAnEngravedLetterS) {
  const int size = 200;
  const std::vector<float> heights = made({.kind = MesostructureKind::groove, .size = size, .amplitude = amplitude});
  const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
  EXPECT_FLOAT_EQ(*low, static_cast<float>(-amplitude));
  EXPECT_EQ(*high, 0.0F);
  for (int i = 0; i < size; ++i) {  // clear of the borders
    ASSERT_EQ(at(heights, size, i, 0), 0.0F);
    ASSERT_EQ(at(heights, size, 0, i), 0.0F);
  }
  for (int y = 0; y < size; ++y) {  // an S looks the same upside down
    for (int x = 0; x < size; ++x) {
      ASSERT_NEAR(at(heights, size, x, y), at(heights, size, size - 1 - x, size - 1 - y), 1e-6 * amplitude);
    }
  }
  // Upper bow open to the right, lower one to the left (a Z or a mirrored S would be the other way round).
  const int upper = 200 * 34 / 100;
  const int lower = 200 * 66 / 100;
  EXPECT_FLOAT_EQ(at(heights, size, 200 * 34 / 100, upper), static_cast<float>(-amplitude));
  EXPECT_EQ(at(heights, size, 200 * 66 / 100, upper + 4), 0.0F);
  EXPECT_FLOAT_EQ(at(heights, size, 200 * 66 / 100, lower), static_cast<float>(-amplitude));
  EXPECT_EQ(at(heights, size, 200 * 34 / 100, lower - 4), 0.0F);
}

// ---- H_5
// -------------------------------------------------------------------------------------------------------

/// One coin in a known place: found by its rim.
struct CoinOutline {
  Vec2 centre = Vec2::Zero();  // tiles
  double radius = 0.0;
};
CoinOutline outline_of(const std::vector<float>& heights, int size) {
  // Texels of the coin have a centre of mass; sines and cosines know that the tile repeats.
  Vec2 s = Vec2::Zero();
  Vec2 t = Vec2::Zero();
  double area = 0.0;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      if (at(heights, size, x, y) <= 0.0F) continue;
      const Vec2 angle = 2.0 * std::numbers::pi * Vec2((x + 0.5) / size, (size - y - 0.5) / size);
      s += Vec2(std::cos(angle.x()), std::sin(angle.x()));
      t += Vec2(std::cos(angle.y()), std::sin(angle.y()));
      area += 1.0 / (size * size);
    }
  }
  const double turn = 2.0 * std::numbers::pi;
  return {{std::atan2(s.y(), s.x()) / turn, std::atan2(t.y(), t.x()) / turn}, std::sqrt(area / std::numbers::pi)};
}

double tiled_distance(const Vec2& a, const Vec2& b) {
  const Vec2 apart = a - b;
  return (apart - Vec2(std::round(apart.x()), std::round(apart.y()))).norm();
}

TEST(CoinHeights, H_5_IsARaisedFlatCylinder) {
  const int size = 512;
  const double texel = 1.0 / size;
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    const std::vector<float> heights = made({.kind = MesostructureKind::coins,
                                             .size = size,
                                             .amplitude = amplitude,
                                             .seed = seed,
                                             .number = 1,
                                             .radius = ShareRange{0.2, 0.2}});
    const CoinOutline coin = outline_of(heights, size);
    EXPECT_NEAR(coin.radius, 0.2, texel);
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const double d = tiled_distance({(x + 0.5) / size, (size - y - 0.5) / size}, coin.centre);
        if (std::abs(d - 0.2) <= texel) continue;
        ASSERT_EQ(at(heights, size, x, y), d < 0.2 ? static_cast<float>(amplitude) : 0.0F) << x << " " << y;
      }
    }
  }
}

TEST(CoinHeights, H_5_WithALowerFieldIsARaisedRimAroundItWithACross) {
  const int size = 512;
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    const MesostructureSpec spec{.kind = MesostructureKind::coins,
                                 .size = size,
                                 .amplitude = amplitude,
                                 .seed = seed,
                                 .number = 1,
                                 .radius = ShareRange{0.2, 0.2},
                                 .rim = 0.15,
                                 .field = 0.5};
    const std::vector<float> heights = made(spec);
    const CoinOutline coin = outline_of(heights, size);
    EXPECT_NEAR(coin.radius, 0.2, 1.0 / size);
    const double texel = 1.0 / size;
    double cross = 0.0;
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const double d = tiled_distance({(x + 0.5) / size, (size - y - 0.5) / size}, coin.centre);
        const float here = at(heights, size, x, y);
        if (d > 0.2 + texel) {
          ASSERT_EQ(here, 0.0F);
        }
        if (d < 0.2 - texel && d > 0.17 + texel) {
          ASSERT_EQ(here, static_cast<float>(amplitude));
        }
        if (d < 0.17 - texel && d > 0.6 * 0.17) {
          ASSERT_EQ(here, static_cast<float>(0.5 * amplitude));
        }
        if (d < 0.6 * 0.17) cross += here > static_cast<float>(0.6 * amplitude) ? texel * texel : 0.0;
        if (d < 0.16 * 0.17 - texel) {
          ASSERT_FLOAT_EQ(here, static_cast<float>(0.75 * amplitude));
        }
      }
    }
    // Two bars of 1.1 by 0.32 within the rim, their middle counted once.
    EXPECT_NEAR(cross, (2.0 * 1.1 * 0.32 - 0.32 * 0.32) * 0.17 * 0.17, 0.03 * cross);
  }
}

TEST(CoinHeights, H_5_CountRadiiOverlapAndFlankActAsStated) {
  const int size = 512;
  const auto coins = [&](MesostructureSpec spec) {
    spec.kind = MesostructureKind::coins;
    spec.size = size;
    spec.amplitude = amplitude;
    return made(spec);
  };
  const auto raised = [](float h) { return h > 0.0F; };
  for (const int number : {1, 4, 9, 20}) {
    const std::vector<float> heights =
        coins({.seed = 5, .number = number, .radius = ShareRange{0.04, 0.08}, .overlap = 0.0});
    EXPECT_EQ(groups(heights, size, raised), number);
    EXPECT_EQ(highest(heights), static_cast<float>(amplitude));
    EXPECT_EQ(lowest(heights), 0.0);
  }
  // Radii: one coin has the area between those of the smallest and the largest.
  const double radius = outline_of(coins({.number = 1, .radius = ShareRange{0.05, 0.1}}), size).radius;
  EXPECT_GE(radius, 0.05 - 1.0 / size);
  EXPECT_LE(radius, 0.1 + 1.0 / size);
  // Where they may overlap, some of many do.
  const MesostructureSpec crowd{.seed = 2, .number = 30, .radius = ShareRange{0.08, 0.08}, .overlap = 0.6};
  EXPECT_LT(groups(coins(crowd), size, raised), 30);
  // A flank of 6 texels rises in steps: no neighbours differ by more than pi / 2 of a sixth.
  const MesostructureSpec gentle{.number = 3, .flank = 6.0 / size, .radius = ShareRange{0.12, 0.12}};
  EXPECT_EQ(largest_step(coins({.number = 3}), size, false), static_cast<float>(amplitude));
  EXPECT_LT(largest_step(coins(gentle), size, false), 1.6 / 6.0 * amplitude);
  EXPECT_NEAR(highest(coins(gentle)), amplitude, 1e-9);
}

// ---- H_7
// -------------------------------------------------------------------------------------------------------

class Fractal : public testing::TestWithParam<double> {};

TEST_P(Fractal, H_7_IncrementsGrowWithTheHurstExponent) {
  // Fractional Brownian motion: the mean square of h(x + d) - h(x) grows with d^(2 H).
  const int size = 512;
  const double hurst = GetParam();
  double ratio = 0.0;
  const int seeds = 12;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const std::vector<float> heights =
        made({.kind = MesostructureKind::fractal, .size = size, .amplitude = amplitude, .seed = seed, .hurst = hurst});
    const auto square = [&](int lag) {
      double sum = 0.0;
      for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
          const double along_s = at(heights, size, (x + lag) % size, y) - at(heights, size, x, y);
          const double along_t = at(heights, size, x, (y + lag) % size) - at(heights, size, x, y);
          sum += along_s * along_s + along_t * along_t;
        }
      }
      return sum;
    };
    ratio += 0.5 * std::log2(square(32) / square(8)) / 2.0 / seeds;
  }
  // Between the finest cells (4 texels) and the coarsest (256) the exponent is approached, not reached.
  EXPECT_NEAR(ratio, hurst, 0.12);
}
INSTANTIATE_TEST_SUITE_P(HurstExponents, Fractal, testing::Values(0.3, 0.5, 0.7));

TEST(FractalHeights, H_7_ReachesBothEndsAndOctavesAddDetail) {
  const int size = 256;
  double last = 0.0;
  for (int octaves = 1; octaves <= 7; ++octaves) {
    const std::vector<float> heights =
        made({.kind = MesostructureKind::fractal, .size = size, .amplitude = amplitude, .octaves = octaves});
    EXPECT_EQ(highest(heights), static_cast<float>(amplitude));
    EXPECT_EQ(lowest(heights), 0.0);
    const double step = largest_step(heights, size, false);
    EXPECT_GT(step, last) << octaves;
    last = step;
  }
}

// ---- parameters
// -------------------------------------------------------------------------------------------------------

TEST(SerratedHeights, WallIsTheShareThatRises) {
  const int size = 1000;
  for (const double wall : {0.1, 0.25, 0.5}) {
    const std::vector<float> heights =
        made({.kind = MesostructureKind::serrated, .size = size, .amplitude = amplitude, .count = 5, .wall = wall});
    int rising = 0;
    for (int x = 0; x < size; ++x) rising += at(heights, size, (x + 1) % size, 0) > at(heights, size, x, 0) ? 1 : 0;
    EXPECT_EQ(rising, static_cast<int>(std::lround(wall * size)));
    EXPECT_EQ(highest(heights), static_cast<float>(amplitude));
    EXPECT_NEAR(lowest(heights), 0.0, 1e-3 * amplitude);
    EXPECT_NEAR(largest_step(heights, size, false), amplitude * 5.0 / (wall * size), 1e-3 * amplitude);
  }
}

TEST(BeamHeights, WidthIsTheShareCovered) {
  const int size = 120;
  for (const double width : {0.1, 0.3, 1.0 / 3.0, 0.5, 0.9}) {
    const std::vector<float> heights =
        made({.kind = MesostructureKind::beams, .size = size, .amplitude = amplitude, .count = 2, .width = width});
    const auto raised = std::count_if(heights.begin(), heights.end(), [](float h) { return h > 0.0F; });
    EXPECT_NEAR(static_cast<double>(raised) / (size * size), 1.0 - (1.0 - width) * (1.0 - width), 1e-9) << width;
  }
}

TEST(RingHeights, ANumberScattersThemWithoutOverlap) {
  const int size = 512;
  for (const int number : {1, 2, 5, 12, 40}) {
    const std::vector<float> heights =
        made({.kind = MesostructureKind::rings, .size = size, .amplitude = amplitude, .seed = 3, .number = number});
    EXPECT_NEAR(highest(heights), amplitude, 0.05 * amplitude) << number;
    EXPECT_NEAR(lowest(heights), 0.0, 0.05 * amplitude) << number;
    // In turn: ring around a hole, ring around a peak, peak, hole.
    const int above = (number + 3) / 4 + 2 * ((number + 2) / 4) + (number + 1) / 4;
    const int below = (number + 3) / 4 + number / 4;
    EXPECT_EQ(groups(heights, size, [](float h) { return h > static_cast<float>(0.7 * amplitude); }), above) << number;
    EXPECT_EQ(groups(heights, size, [](float h) { return h < static_cast<float>(0.3 * amplitude); }), below) << number;
  }
}

TEST(WartHeights, NumberAndRadiiActAsStated) {
  const int size = 512;
  const auto raised = [](float h) { return h > 0.0F; };
  const auto warts = [&](MesostructureSpec spec) {
    spec.kind = MesostructureKind::warts;
    spec.size = size;
    spec.amplitude = amplitude;
    return made(spec);
  };
  for (const int number : {1, 3, 30}) {
    const std::vector<float> heights = warts({.seed = 4, .number = number});
    EXPECT_EQ(groups(heights, size, raised), number);
    EXPECT_NEAR(highest(heights), amplitude, 0.02 * amplitude);
  }
  // The first warts are those of the unlimited map, which no later one touches.
  const std::vector<float> few = warts({.seed = 4, .number = 5});
  const std::vector<float> many = warts({.seed = 4});
  for (std::size_t i = 0; i < few.size(); ++i) ASSERT_TRUE(few[i] == 0.0F || few[i] == many[i]);
  const auto area = [&](const std::vector<float>& heights) {
    return static_cast<double>(std::count_if(heights.begin(), heights.end(), raised)) / (size * size);
  };
  const double radius = 0.1;
  EXPECT_NEAR(area(warts({.number = 6, .radius = ShareRange{radius, radius}})),
              6.0 * std::numbers::pi * radius * radius, 0.01);
}

TEST(GrooveHeights, WidthFlankAndRadiusActAsStated) {
  const int size = 500;
  const auto groove = [&](MesostructureSpec spec) {
    spec.kind = MesostructureKind::groove;
    spec.size = size;
    spec.amplitude = amplitude;
    return made(spec);
  };
  const auto cut = [&](const std::vector<float>& heights, double depth) {
    return static_cast<double>(
               std::count_if(heights.begin(), heights.end(), [&](float h) { return h < -depth * amplitude; })) /
           (size * size);
  };
  // The letter is two arcs of 250 degrees on which a stroke of this width lies, its ends round.
  const auto letter = [](double radius, double width) {
    return 2.0 * 250.0 / 180.0 * std::numbers::pi * radius * width + 0.25 * std::numbers::pi * width * width;
  };
  for (const double radius : {0.1, 0.16, 0.2}) {
    for (const double width : {0.02, 0.06, 0.12}) {
      const MesostructureSpec spec{.width = width, .flank = 0.0, .radius = ShareRange{radius, radius}};
      const double area = letter(radius, width);
      EXPECT_NEAR(cut(groove(spec), 0.5), area, 0.06 * area) << radius << " " << width;
      EXPECT_EQ(lowest(groove(spec)), -static_cast<float>(amplitude));
    }
  }
  // Without walls there are two heights; with walls of half the stroke the bottom is a line.
  const std::vector<float> steep = groove({.flank = 0.0});
  EXPECT_EQ(std::set<float>(steep.begin(), steep.end()).size(), 2U);
  EXPECT_NEAR(cut(groove({.flank = 0.0}), 0.99) / letter(0.16, 0.08), 1.0, 0.06);
  EXPECT_LT(cut(groove({.flank = 0.04}), 0.99) / letter(0.16, 0.08), 0.1);
}

TEST(GeneratedHeights, SeedsChangeAndRepeat) {
  using enum MesostructureKind;
  for (MesostructureSpec spec :
       {MesostructureSpec{.kind = warts}, {.kind = coins}, {.kind = fractal}, {.kind = rings, .number = 4}}) {
    spec.size = 128;
    const std::vector<float> first = made(spec);
    EXPECT_EQ(made(spec), first) << paper_name(spec.kind);
    spec.seed = 2;
    EXPECT_NE(made(spec), first) << paper_name(spec.kind);
  }
  // Kinds without randomness do not read it.
  for (const MesostructureKind kind : {flat, serrated, beams, rings, groove}) {
    EXPECT_EQ(made({.kind = kind, .size = 64, .count = 4, .seed = 1}),
              made({.kind = kind, .size = 64, .count = 4, .seed = 2}));
  }
}

TEST(GeneratedHeights, ParametersOfAKindAreThoseThatChangeIt) {
  using enum MesostructureKind;
  // Every member besides kind, size and amplitude, away from every kind's own value.
  const std::vector<std::pair<std::string_view, MesostructureSpec>> changes{
      {"count", {.count = 3}},    {"seed", {.seed = 9}},
      {"number", {.number = 3}},  {"wall", {.wall = 0.4}},
      {"width", {.width = 0.18}}, {"flank", {.flank = 0.004}},
      {"rim", {.rim = 0.3}},      {"radius", {.radius = ShareRange{0.12, 0.12}}},
      {"field", {.field = 0.2}},  {"overlap", {.overlap = 0.0}},
      {"hurst", {.hurst = 0.4}},  {"octaves", {.octaves = 2}},
  };
  for (const MesostructureKind kind : all_kinds) {
    const auto taken = parameters_of(kind);
    for (auto [name, spec] : changes) {
      spec.kind = kind;
      spec.size = 128;
      MesostructureSpec plain{.kind = kind, .size = 128};
      if (kind == rings && name == "seed") plain.number = spec.number = 4;
      if (kind == coins && name == "overlap") plain.number = spec.number = 12;
      if (kind == coins && name == "rim") plain.field = spec.field = 0.5;
      const bool takes = std::find(taken.begin(), taken.end(), name) != taken.end();
      EXPECT_EQ(made(spec) != made(plain), takes) << paper_name(kind) << " " << name;
    }
  }
}

TEST(GeneratedHeights, CompletedSpecsMakeTheSame) {
  for (const MesostructureKind kind : all_kinds) {
    const MesostructureSpec spec{.kind = kind, .size = 100};
    EXPECT_EQ(made(completed(spec)), made(spec)) << paper_name(kind);
  }
}

TEST(GeneratedHeights, TileWithoutASeam) {
  using enum MesostructureKind;
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    for (const MesostructureSpec& spec : {MesostructureSpec{.kind = rings},
                                          {.kind = rings, .number = 7},
                                          {.kind = warts},
                                          {.kind = coins},
                                          {.kind = coins, .flank = 0.005},
                                          {.kind = groove},
                                          {.kind = fractal},
                                          {.kind = fractal, .octaves = 2}}) {
      MesostructureSpec used = spec;
      used.size = 128;
      used.amplitude = amplitude;
      used.seed = seed;
      const std::vector<float> heights = made(used);
      EXPECT_LE(largest_step(heights, 128, true), 1.2 * largest_step(heights, 128, false)) << paper_name(spec.kind);
    }
  }
}

TEST(GeneratedHeights, ScaleWithTheAmplitude) {
  for (const MesostructureKind kind : all_kinds) {
    const auto one = generate_heights({.kind = kind, .size = 64, .amplitude = amplitude, .count = 4});
    const auto two = generate_heights({.kind = kind, .size = 64, .amplitude = 2.0 * amplitude, .count = 4});
    ASSERT_TRUE(one.ok() && two.ok());
    ASSERT_EQ(one->size(), 64U * 64U);
    for (std::size_t i = 0; i < one->size(); ++i) ASSERT_FLOAT_EQ(2.0F * (*one)[i], (*two)[i]);
  }
}

TEST(GeneratedHeights, NamesAreReadBack) {
  for (const MesostructureKind kind : all_kinds) {
    const auto parsed = parse_mesostructure_kind(paper_name(kind));
    ASSERT_TRUE(parsed.ok());
    EXPECT_EQ(*parsed, kind);
  }
  EXPECT_EQ(parse_mesostructure_kind("serrated").value(), MesostructureKind::serrated);
  EXPECT_EQ(parse_mesostructure_kind("h6").value(), MesostructureKind::groove);
  const auto unknown = parse_mesostructure_kind("H_9");
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().accepted.find("groove (H_6)"), std::string::npos);
}

TEST(GeneratedHeights, BadSpecificationsAreRefusedByName) {
  const auto refused = [](MesostructureSpec spec) {
    const auto heights = generate_heights(spec);
    EXPECT_FALSE(generate_height_map(spec, Wrap::repeat, Reconstruction::nearest).ok());
    return heights.ok() ? std::string("accepted") : heights.error().place;
  };
  using enum MesostructureKind;
  EXPECT_EQ(refused({.kind = rings, .size = 1}), "size");
  EXPECT_EQ(refused({.kind = flat, .size = 9000}), "size");
  EXPECT_EQ(refused({.kind = rings, .amplitude = -1.0}), "amplitude");
  EXPECT_EQ(refused({.kind = flat, .amplitude = std::numeric_limits<double>::quiet_NaN()}), "amplitude");
  EXPECT_EQ(refused({.kind = serrated, .size = 64, .count = 0}), "count");
  EXPECT_EQ(refused({.kind = serrated, .size = 64, .count = 33}), "count");
  EXPECT_EQ(refused({.kind = beams, .size = 64, .count = 17}), "count");
  EXPECT_EQ(refused({.kind = serrated, .size = 64, .wall = 0.6}), "wall");
  EXPECT_EQ(refused({.kind = beams, .size = 64, .count = 8, .width = 0.1}), "width");  // less than a texel
  EXPECT_EQ(refused({.kind = beams, .size = 64, .count = 8, .width = 0.9}), "width");
  EXPECT_EQ(refused({.kind = rings, .size = 64, .number = 0}), "number");
  EXPECT_EQ(refused({.kind = rings, .size = 64, .number = 65}), "number");
  EXPECT_EQ(refused({.kind = warts, .size = 64, .number = 2000}), "number");  // no room
  EXPECT_EQ(refused({.kind = warts, .size = 64, .radius = ShareRange{0.0, 0.1}}), "radius");
  EXPECT_EQ(refused({.kind = warts, .size = 64, .radius = ShareRange{0.1, 0.05}}), "radius");
  EXPECT_EQ(refused({.kind = coins, .size = 64, .number = 100, .overlap = 0.0}), "number");  // no room
  EXPECT_EQ(refused({.kind = coins, .size = 64, .rim = 0.6, .field = 0.5}), "rim");
  EXPECT_EQ(refused({.kind = coins, .size = 64, .rim = 0.2}), "rim");
  EXPECT_EQ(refused({.kind = coins, .size = 64, .field = 1.5}), "field");
  EXPECT_EQ(refused({.kind = coins, .size = 64, .overlap = 1.0}), "overlap");
  EXPECT_EQ(refused({.kind = coins, .size = 64, .flank = 0.1}), "flank");  // wider than half the rim
  EXPECT_EQ(refused({.kind = groove, .size = 64, .width = 0.3}), "width");
  EXPECT_EQ(refused({.kind = groove, .size = 64, .flank = 0.05}), "flank");
  EXPECT_EQ(refused({.kind = groove, .size = 64, .radius = ShareRange{0.23, 0.23}}), "radius");  // over the border
  EXPECT_EQ(refused({.kind = groove, .size = 64, .radius = ShareRange{0.1, 0.2}}), "radius");
  EXPECT_EQ(refused({.kind = fractal, .size = 64, .hurst = 0.0}), "hurst");
  EXPECT_EQ(refused({.kind = fractal, .size = 64, .octaves = 6}), "octaves");
  EXPECT_EQ(refused({.kind = fractal, .size = 64, .octaves = 0}), "octaves");
}

}  // namespace
}  // namespace asperity::mesostructure_generators_test
