#include "asperity/field/mesostructure_generators.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace asperity {
namespace {

constexpr double amplitude = 1e-3;
constexpr MesostructureKind all_kinds[] = {MesostructureKind::flat,  MesostructureKind::serrated,
                                           MesostructureKind::beams, MesostructureKind::rings,
                                           MesostructureKind::warts, MesostructureKind::groove};

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
    const std::vector<float> heights = serrated_heights(100, ridges, amplitude);
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
  const std::vector<float> heights = beam_heights(size, 4, amplitude);
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
  const std::vector<float> heights = ring_heights(size, amplitude);
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
  const std::vector<float> heights = wart_heights(size, amplitude, 1);
  EXPECT_EQ(heights, wart_heights(size, amplitude, 1));
  EXPECT_NE(heights, wart_heights(size, amplitude, 2));
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
  const std::vector<float> heights = groove_heights(size, amplitude);
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

TEST(GeneratedHeights, TileWithoutASeam) {
  for (const MesostructureKind kind : {MesostructureKind::rings, MesostructureKind::warts, MesostructureKind::groove}) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      const auto heights = generate_heights({.kind = kind, .size = 128, .amplitude = amplitude, .seed = seed});
      ASSERT_TRUE(heights.ok());
      EXPECT_LE(largest_step(*heights, 128, true), largest_step(*heights, 128, false)) << paper_name(kind);
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
}

}  // namespace
}  // namespace asperity
