#include "asperity/field/mesostructure/mesostructure.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "asperity/core/rng.h"
#include "asperity/field/mesostructure/generators.h"

namespace asperity::mesostructure_test {
namespace {

constexpr double amplitude = 1e-3;
const Vec2 tile(40e-3, 50e-3);

static_assert(noexcept(std::declval<const Mesostructure&>().sample(std::declval<const Vec2&>())));

HeightMap relief(MesostructureKind kind, Reconstruction reconstruction = Reconstruction::quadratic_bspline,
                 Wrap wrap = Wrap::repeat) {
  auto map = generate_height_map({.kind = kind, .size = 128, .amplitude = amplitude}, wrap, reconstruction);
  EXPECT_TRUE(map.ok());
  return std::move(map).value();
}

/// The normals of a relief as an 8-bit picture: slopes times `exaggeration`, green as `green` says.
NormalMap pictured_normals(const HeightMap& heights, double exaggeration, bool turned_over, GreenConvention read_as) {
  const auto exact = NormalMap::build(heights, tile);
  EXPECT_TRUE(exact.ok());
  Image image{heights.width(), heights.height(), 3, 8, {}};
  const double sign = turned_over ? -exaggeration : exaggeration;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      Vec3 normal = exact->texel(x, y);
      normal = Vec3(sign * normal.x(), sign * normal.y(), normal.z()).normalized();
      for (int c = 0; c < 3; ++c) {
        image.samples.push_back(static_cast<std::uint16_t>(std::lround(128.0 + 127.0 * normal[c])));
      }
    }
  }
  auto map = NormalMap::build(image, {.green = read_as});
  EXPECT_TRUE(map.ok());
  return std::move(map).value();
}

NormalMap flat_normals() {
  auto map = NormalMap::build(Image{1, 1, 3, 8, {128, 128, 255}}, {});
  EXPECT_TRUE(map.ok());
  return std::move(map).value();
}

RC_GTEST_PROP(MesostructureSampling, PairsTheHeightWithTheNormalOfTheReconstructedSurface, ()) {
  static const HeightMap heights = relief(MesostructureKind::warts);
  static const auto coat = Mesostructure::build(heights, tile);
  RC_ASSERT(coat.ok());
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const Vec2 st(rng.uniform(-4.0, 4.0), rng.uniform(-4.0, 4.0));
  const MesostructureSample sample = coat->sample(st);
  RC_ASSERT(sample.height == heights.height_at(st));
  RC_ASSERT(sample.gradient == heights.sample(st).gradient);
  RC_ASSERT(std::abs(sample.normal.norm() - 1.0) < 1e-12);
  // The normal is at right angles to both tangents of the surface (tile.x s, tile.y t, H).
  RC_ASSERT(std::abs(sample.normal.dot(Vec3(tile.x(), 0.0, sample.gradient.x()))) < 1e-12);
  RC_ASSERT(std::abs(sample.normal.dot(Vec3(0.0, tile.y(), sample.gradient.y()))) < 1e-12);
  RC_ASSERT(sample.normal.z() > 0.0);
}

TEST(MesostructureSampling, UsesTheGivenNormalMap) {
  const HeightMap heights = relief(MesostructureKind::rings);
  const NormalMap normals = pictured_normals(heights, 3.0, false, GreenConvention::up);
  const auto coat = Mesostructure::build(heights, normals, tile);
  ASSERT_TRUE(coat.ok());
  EXPECT_TRUE(coat->has_normal_map());
  EXPECT_EQ(coat->sample({0.3, 0.6}).normal, normals.sample({0.3, 0.6}));
  EXPECT_EQ(coat->sample({0.3, 0.6}).height, heights.height_at({0.3, 0.6}));
  EXPECT_GT(coat->memory_bytes(), heights.memory_bytes());
  const auto plain = Mesostructure::build(heights, tile);
  ASSERT_TRUE(plain.ok());
  EXPECT_FALSE(plain->has_normal_map());
  EXPECT_EQ(plain->normals(), nullptr);
}

TEST(MesostructureBadInput, IsRefused) {
  const HeightMap heights = relief(MesostructureKind::rings);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Vec2& bad : {Vec2(1e-323, 1e-3), Vec2(0.0, 1.0), Vec2(1.0, -2.0), Vec2(1.0, nan), Vec2(infinity, 1.0)}) {
    EXPECT_EQ(Mesostructure::build(heights, bad).error().place, "tile");
    EXPECT_EQ(Mesostructure::build(heights, flat_normals(), bad).error().place, "tile");
  }
  const HeightMap clamped = relief(MesostructureKind::rings, Reconstruction::bilinear, Wrap::clamp);
  EXPECT_EQ(Mesostructure::build(clamped, flat_normals(), tile).error().code, ErrorCode::mismatch);
}

// ---- do the normals belong to the heights?
// ----------------------------------------------------------------------------

class Agreement : public testing::TestWithParam<MesostructureKind> {
 protected:
  HeightMap heights_ = relief(GetParam());
  NormalAgreement compare(double exaggeration, bool turned_over, GreenConvention read_as) {
    return compare_normals(heights_, pictured_normals(heights_, exaggeration, turned_over, read_as), tile);
  }
};

TEST_P(Agreement, AConsistentPairGivesNoWarningAndItsScale) {
  const NormalAgreement agreement = compare(1.0, false, GreenConvention::up);
  EXPECT_FALSE(disagreement_warning(agreement).has_value()) << *disagreement_warning(agreement);
  EXPECT_GT(agreement.correlation, 0.98);
  EXPECT_NEAR(agreement.scale, 1.0, 0.05);
  EXPECT_LT(agreement.rms_angle, 0.02);
}

TEST_P(Agreement, AnotherHeightScaleIsNoDisagreementButIsReported) {
  const NormalAgreement agreement = compare(2.5, false, GreenConvention::up);
  EXPECT_FALSE(disagreement_warning(agreement).has_value());
  EXPECT_GE(agreement.correlation, 0.5);
  EXPECT_NEAR(agreement.scale, 2.5, 0.15);
}

TEST_P(Agreement, TheWrongGreenConventionIsNamed) {
  const NormalAgreement agreement = compare(1.0, false, GreenConvention::down);
  EXPECT_TRUE(agreement.green_flipped_fits_better);
  const auto warning = disagreement_warning(agreement);
  ASSERT_TRUE(warning.has_value());
  EXPECT_NE(warning->find("green convention"), std::string::npos) << *warning;
  EXPECT_EQ(warning->find("white_is"), std::string::npos) << *warning;
}

TEST_P(Agreement, InvertedHeightsAreNamed) {
  const NormalAgreement agreement = compare(1.0, true, GreenConvention::up);
  EXPECT_FALSE(agreement.green_flipped_fits_better);
  EXPECT_LT(agreement.correlation, 0.5);
  const auto warning = disagreement_warning(agreement);
  ASSERT_TRUE(warning.has_value());
  EXPECT_NE(warning->find("white_is"), std::string::npos) << *warning;
  EXPECT_EQ(warning->find("green"), std::string::npos) << *warning;
}

TEST_P(Agreement, BothAtOnceAreNamed) {
  const auto warning = disagreement_warning(compare(1.0, true, GreenConvention::down));
  ASSERT_TRUE(warning.has_value());
  EXPECT_NE(warning->find("white_is"), std::string::npos) << *warning;
  EXPECT_NE(warning->find("green convention"), std::string::npos) << *warning;
}

TEST_P(Agreement, AnotherPictureIsNamed) {
  const HeightMap other =
      relief(GetParam() == MesostructureKind::warts ? MesostructureKind::rings : MesostructureKind::warts);
  const auto warning =
      disagreement_warning(compare_normals(heights_, pictured_normals(other, 1.0, false, GreenConvention::up), tile));
  ASSERT_TRUE(warning.has_value());
  EXPECT_NE(warning->find("same picture"), std::string::npos) << *warning;
}

TEST_P(Agreement, ANormalMapWithoutReliefIsNamed) {
  const NormalAgreement agreement = compare_normals(heights_, flat_normals(), tile);
  EXPECT_TRUE(agreement.normals_flat);
  EXPECT_TRUE(disagreement_warning(agreement).has_value());
}

INSTANTIATE_TEST_SUITE_P(Kinds, Agreement,
                         testing::Values(MesostructureKind::beams, MesostructureKind::rings, MesostructureKind::warts,
                                         MesostructureKind::groove));

TEST(AgreementFlat, TwoFlatMapsAgreeAndAFlatHeightMapIsNamed) {
  const HeightMap flat = relief(MesostructureKind::flat);
  EXPECT_FALSE(disagreement_warning(compare_normals(flat, flat_normals(), tile)).has_value());
  const HeightMap rings = relief(MesostructureKind::rings);
  const NormalAgreement agreement =
      compare_normals(flat, pictured_normals(rings, 1.0, false, GreenConvention::up), tile);
  EXPECT_TRUE(agreement.heights_flat);
  EXPECT_TRUE(disagreement_warning(agreement).has_value());
}

TEST(AgreementFlat, EveryColumnAndEveryRowCounts) {
  // Maps that end at their borders and lean in one column or one row alone: they are not flat, wherever that is.
  constexpr int side = 20;
  const auto heights = HeightMap::build({0.0F, 1e-3F, 2e-3F, 0.0F}, 2, 2, Wrap::clamp, Reconstruction::bilinear);
  ASSERT_TRUE(heights.ok());
  for (const bool column : {true, false}) {
    for (int leaning = 0; leaning < side; ++leaning) {
      Image image{side, side, 3, 8, {}};
      for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x) {
          const bool leans = (column ? x : y) == leaning;
          image.samples.insert(image.samples.end(), {static_cast<std::uint16_t>(leans ? 200 : 128), 128, 255});
        }
      }
      const auto normals = NormalMap::build(image, {.wrap = Wrap::clamp});
      ASSERT_TRUE(normals.ok()) << normals.error().message();
      EXPECT_FALSE(compare_normals(*heights, *normals, tile).normals_flat) << column << " " << leaning;
    }
  }
}

TEST(AgreementScale, APlaneUnderneathIsNoDisagreement) {
  // A normal map made after the lie of the land was taken out of the heights: the same but for their mean.
  constexpr int side = 64;
  const auto picture = [&](double tilt) {
    std::vector<float> heights;
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const double s = (x + 0.5) / side;
        const double t = 1.0 - (y + 0.5) / side;
        heights.push_back(static_cast<float>(1e-3 * (std::sin(30.0 * s) * std::cos(25.0 * t) + tilt * (s + 2.0 * t))));
      }
    }
    auto map = HeightMap::build(std::move(heights), side, side, Wrap::clamp, Reconstruction::bilinear);
    EXPECT_TRUE(map.ok());
    return std::move(map).value();
  };
  const auto normals = NormalMap::build(picture(0.0), tile);
  ASSERT_TRUE(normals.ok());
  const NormalAgreement level = compare_normals(picture(0.0), *normals, tile);
  const NormalAgreement tilted = compare_normals(picture(10.0), *normals, tile);
  EXPECT_GT(level.correlation, 0.99);
  EXPECT_NEAR(tilted.correlation, level.correlation, 0.02);
  EXPECT_NEAR(tilted.scale, level.scale, 0.02);
}

TEST(AgreementScale, DoesNotDependOnTheUnitOfTheScene) {
  const HeightMap heights = relief(MesostructureKind::warts);
  const NormalMap normals = pictured_normals(heights, 1.0, false, GreenConvention::up);
  const double tiny = 1e-6;
  auto small = generate_height_map({.kind = MesostructureKind::warts, .size = 128, .amplitude = amplitude * tiny},
                                   Wrap::repeat, Reconstruction::quadratic_bspline);
  ASSERT_TRUE(small.ok());
  const NormalAgreement here = compare_normals(heights, normals, tile);
  const NormalAgreement there = compare_normals(*small, normals, tile * tiny);
  EXPECT_NEAR(here.correlation, there.correlation, 1e-5);
  EXPECT_NEAR(here.scale, there.scale, 1e-5);
}

}  // namespace
}  // namespace asperity::mesostructure_test
