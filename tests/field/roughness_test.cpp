#include "asperity/field/height/roughness.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <vector>

#include "asperity/core/rng.h"

namespace asperity::roughness_test {
namespace {

using std::numbers::pi;

/// c cos over one wavelength.
std::vector<double> cosine(double amplitude, int points) {
  std::vector<double> heights;
  for (int i = 0; i < points; ++i) heights.push_back(amplitude * std::cos(2.0 * pi * i / points));
  return heights;
}

// ---- profiles and maps ---------------------------------------------------------------------------------------------

TEST(ProfileRoughness, OfACosineOnASlope) {
  std::vector<double> heights;
  constexpr int waves = 200;
  for (int i = 0; i < waves * 100; ++i)
    heights.push_back(3e-6 * std::cos(2.0 * pi * i / 100.0) + 0.01 * 1e-6 * i + 1.0);
  const Roughness roughness = profile_roughness(heights, 1e-6);
  EXPECT_NEAR(roughness.average, 2.0 / pi * 3e-6, 2e-9);
  EXPECT_NEAR(roughness.rms, 3e-6 / std::sqrt(2.0), 2e-9);
  EXPECT_NEAR(roughness.mean_slope, 4.0 * 3e-6 / 100e-6, 1e-4);
}

RC_GTEST_PROP(ProfileRoughnessProperty, IsBlindToLinesAndScalesWithHeight, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  std::vector<double> plain(3 + rng.below(50));
  for (double& height : plain) height = rng.uniform(-1.0, 1.0);
  std::vector<double> changed = plain;
  const double tilt = rng.uniform(-5.0, 5.0);
  const double offset = rng.uniform(-5.0, 5.0);
  for (std::size_t i = 0; i < changed.size(); ++i)
    changed[i] = 3.0 * changed[i] + offset + tilt * static_cast<double>(i);
  const Roughness one = profile_roughness(plain, 0.5);
  const Roughness other = profile_roughness(changed, 0.5);
  RC_ASSERT(std::abs(other.average - 3.0 * one.average) < 1e-11);
  RC_ASSERT(std::abs(other.rms - 3.0 * one.rms) < 1e-11);
  RC_ASSERT(std::abs(other.mean_slope - 3.0 * one.mean_slope) < 1e-11);
  RC_ASSERT(one.average <= one.rms + 1e-15);
}

TEST(ProfileRoughness, OfTooLittleIsNothing) {
  for (const std::vector<double>& heights : {std::vector<double>{}, {1.0}, {1.0, 5.0}}) {
    const Roughness roughness = profile_roughness(heights, 1.0);
    EXPECT_EQ(roughness.average, 0.0);
    EXPECT_EQ(roughness.rms, 0.0);
    EXPECT_EQ(roughness.mean_slope, 0.0);
  }
  EXPECT_EQ(profile_roughness(std::vector<double>{1.0, 2.0, 5.0}, 0.0).rms, 0.0);
}

HeightMap baked(double amplitude, double wavelength, double direction, const Vec2& tile, int columns, int rows) {
  FeatureSpec spec;
  spec.amplitude = amplitude;
  spec.wavelength = Vec2(wavelength, 0.0);
  spec.direction = direction;
  auto map = bake({SurfaceFeature::build(spec).value()}, Vec2::Zero(), tile, columns, rows, Wrap::repeat);
  EXPECT_TRUE(map.ok());
  return std::move(map).value();
}

TEST(SurfaceRoughness, TellsAlongFromAcross) {
  // Row Y-9: R_a of 3.81 um across the grooves of a milled block, none along them.
  const double amplitude = pi / 2.0 * 3.81e-6;
  const Vec2 tile(4e-3, 2e-3);
  const SurfaceRoughness across = surface_roughness(baked(amplitude, 1e-4, 0.0, tile, 2000, 40), tile);
  EXPECT_NEAR(across.along_s.average, 3.81e-6, 0.02e-6);
  EXPECT_NEAR(across.along_s.mean_slope, 4.0 * amplitude / 1e-4, 2e-3);
  EXPECT_LT(across.along_t.average, 1e-11);
  EXPECT_LT(across.along_t.mean_slope, 1e-6);
  const SurfaceRoughness along = surface_roughness(baked(amplitude, 1e-4, pi / 2.0, tile, 30, 1000), tile);
  EXPECT_NEAR(along.along_t.average, 3.81e-6, 0.02e-6);
  EXPECT_LT(along.along_s.average, 1e-11);
}

TEST(SurfaceRoughness, ReadsWholeProfilesOfLargeMaps) {
  // More rows and columns than are read: the tall ones at the end count as well as the first.
  constexpr int columns = 5;
  constexpr int rows = 6000;
  std::vector<float> heights;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column)
      heights.push_back(row < rows / 2 ? 0.0F : (column % 2 == 0 ? 1.0F : -1.0F));
  }
  const auto map = HeightMap::build(std::move(heights), columns, rows, Wrap::clamp, Reconstruction::nearest);
  ASSERT_TRUE(map.ok());
  const SurfaceRoughness roughness = surface_roughness(*map, Vec2(5.0, 6000.0));
  // Five heights 1, -1, 1, -1, 1 about their mean 0.2: R_a 0.96, in half of the rows.
  EXPECT_NEAR(roughness.along_s.average, 0.5 * 0.96, 1e-3);
  EXPECT_NEAR(roughness.along_s.mean_slope, 0.5 * 2.0, 2e-3);
}

TEST(SurfaceRoughness, AProposalAddsTheMeanSlope) {
  const Vec2 tile(2e-3, 2e-3);
  const SurfaceRoughness roughness = surface_roughness(baked(1e-5, 1e-4, pi / 2.0, tile, 50, 1000), tile);
  const FrictionProposal proposal = propose_friction(roughness, 0.2);
  EXPECT_NEAR(proposal.across, 0.2 + 0.4, 2e-3);
  EXPECT_NEAR(proposal.along, 0.2, 1e-6);
  EXPECT_FALSE(proposal.rough_along_s);
  SurfaceRoughness cliffs;
  cliffs.along_s.mean_slope = 10.0;
  cliffs.along_t.mean_slope = 1.0;
  const FrictionProposal steep = propose_friction(cliffs, 0.2);
  EXPECT_EQ(steep.across, 2.0);
  EXPECT_EQ(steep.along, 1.2);
  EXPECT_TRUE(steep.rough_along_s);
}

// ---- what a tip feels ----------------------------------------------------------------------------------------------

TEST(FeltRoughness, ATipThatReachesEverywhereFeelsTheProfileItself) {
  // While the valleys are rounder than the tip, what its path gains over valleys it loses over crests.
  for (const double wavelength : {4.5e-3, 6e-3, 20e-3}) {
    const double curvature = 0.25e-3 * std::pow(2.0 * pi / wavelength, 2);
    ASSERT_LT(curvature * 2e-3, 1.0);
    EXPECT_NEAR(felt_roughness(0.25e-3, wavelength, 2e-3), std::numbers::sqrt2 * pi * 0.25e-3 / wavelength, 1e-9);
  }
}

TEST(FeltRoughness, ATipOverNarrowGapsFeelsItsOwnShape) {
  // From crest to crest the centre goes along arcs x^2 / 2 r: rms slope lambda / (2 sqrt(3) r).
  EXPECT_NEAR(felt_roughness(1e-3, 0.1e-3, 2e-3) / (0.1 / (2.0 * std::sqrt(3.0) * 2.0)), 1.0, 0.01);
}

RC_GTEST_PROP(FeltRoughnessProperty, FormulaAndDilationAgree, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const double wavelength = std::pow(10.0, rng.uniform(-3.5, -2.0));
  const double amplitude = wavelength * std::pow(10.0, rng.uniform(-2.5, -0.5));
  const double radius = wavelength * std::pow(10.0, rng.uniform(-1.0, 1.0));
  const double formula = felt_roughness(amplitude, wavelength, radius);
  const std::vector<double> profile = cosine(amplitude, 700);
  const double dilated = felt_roughness(profile, wavelength / 700, radius);
  RC_ASSERT(std::abs(dilated / formula - 1.0) < 0.02);
  // It is a slope: the size of everything together does not count.
  RC_ASSERT(std::abs(felt_roughness(3.0 * amplitude, 3.0 * wavelength, 3.0 * radius) / formula - 1.0) < 1e-9);
  // A larger tip never feels more.
  RC_ASSERT(felt_roughness(amplitude, wavelength, 1.2 * radius) <= formula * (1.0 + 1e-9));
}

TEST(Rows, Y6TheVase) {
  const double amplitude = 0.25e-3;
  const double tip = 2e-3;
  const auto felt = [&](double millimetres) { return felt_roughness(amplitude, millimetres * 1e-3, tip); };
  const auto force = [&](double millimetres) { return 2.0 * pi * amplitude / (millimetres * 1e-3); };
  const double neck = 1.5;
  const double bottom = 4.5;
  // The force varies three times as much at the neck as at the bottom ...
  EXPECT_NEAR(force(neck) / force(bottom), 3.0, 1e-12);
  // ... and yet the neck feels smoothest, some place of the abdomen between roughest.
  double roughest = neck;
  for (double wavelength = neck; wavelength <= bottom; wavelength += 0.01) {
    EXPECT_GE(felt(wavelength), felt(neck));
    if (felt(wavelength) > felt(roughest)) roughest = wavelength;
  }
  EXPECT_GT(felt(bottom), 1.2 * felt(neck));
  for (const double abdomen : {3.0, 3.5, 4.0}) EXPECT_GT(felt(abdomen), 1.1 * felt(bottom));
  EXPECT_NEAR(roughest, 3.1, 0.1);
  // The table in docs/methods/surface-features.md.
  const double table[][3] = {{1.0, 0.140, 0.094}, {1.5, 0.200, 0.136}, {2.0, 0.249, 0.173},
                             {2.5, 0.283, 0.203}, {3.0, 0.297, 0.225}, {3.5, 0.293, 0.238},
                             {4.0, 0.274, 0.240}, {4.5, 0.247, 0.234}, {6.0, 0.185, 0.185}};
  for (const auto& [wavelength, at_two, at_three] : table) {
    EXPECT_NEAR(felt(wavelength), at_two, 6e-4);
    EXPECT_NEAR(felt_roughness(amplitude, wavelength * 1e-3, 3e-3), at_three, 6e-4);
  }
  // Where the maximum lies by the rule in the documentation.
  for (const double radius : {1e-3, 2e-3, 3e-3}) {
    double best = 0.0;
    double at = 0.0;
    for (double wavelength = 1e-3; wavelength < 6e-3; wavelength += 1e-5) {
      const double value = felt_roughness(amplitude, wavelength, radius);
      if (value > best) {
        best = value;
        at = wavelength;
      }
    }
    EXPECT_NEAR(at / std::sqrt(amplitude * radius), 4.4, 0.25);
  }
}

TEST(FeltRoughness, OfNothingIsNothing) {
  EXPECT_EQ(felt_roughness(std::vector<double>{}, 1e-3, 1e-3), 0.0);
  EXPECT_EQ(felt_roughness(std::vector<double>(50, 2.0), 1e-3, 1e-3), 0.0);
  EXPECT_EQ(felt_roughness(cosine(1e-3, 50), 0.0, 1e-3), 0.0);
  EXPECT_EQ(felt_roughness(cosine(1e-3, 50), 1e-3, 0.0), 0.0);
}

TEST(FeltRoughness, OfLongProfilesTakesBoundedTime) {
  // 200,000 points are thinned out to less than 4,096 of them, which a wave of 2,000 points survives.
  std::vector<double> heights;
  for (int i = 0; i < 200'000; ++i) heights.push_back(1e-4 * std::cos(2.0 * pi * i / 50'000.0));
  EXPECT_NEAR(felt_roughness(heights, 1e-7, 1e-3), felt_roughness(1e-4, 5e-3, 1e-3), 1e-3);
}

}  // namespace
}  // namespace asperity::roughness_test
