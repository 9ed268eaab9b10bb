#include "asperity/field/height/surface_features.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "asperity/core/rng.h"

namespace asperity::surface_features_test {
namespace {

using std::numbers::pi;

static_assert(noexcept(std::declval<const SurfaceFeature&>().sample(std::declval<const Vec2&>())));
static_assert(noexcept(std::declval<const SurfaceFeature&>().across(std::declval<const Vec2&>())));

constexpr FeatureKind all_kinds[] = {FeatureKind::grating,    FeatureKind::circular_grating, FeatureKind::grid,
                                     FeatureKind::triangular, FeatureKind::serrated,         FeatureKind::noise,
                                     FeatureKind::map};

std::shared_ptr<const HeightMap> random_map(std::uint64_t seed, Wrap wrap = Wrap::repeat) {
  Rng rng(seed);
  std::vector<float> heights;
  for (int i = 0; i < 12 * 9; ++i) heights.push_back(static_cast<float>(rng.uniform(-2e-4, 3e-4)));
  auto map = HeightMap::build(std::move(heights), 12, 9, wrap, Reconstruction::quadratic_bspline);
  return std::make_shared<const HeightMap>(std::move(map).value());
}

/// A spec of a kind that is good, with members away from their defaults.
FeatureSpec good(FeatureKind kind) {
  FeatureSpec spec;
  spec.kind = kind;
  spec.amplitude = 2e-4;
  spec.wavelength = Vec2(1.5e-3, 2.5e-3);
  spec.direction = 0.4;
  spec.phase = 0.7;
  spec.centre = Vec2(1e-3, -2e-3);
  spec.wall = 0.2;
  spec.roughness = 5e-5;
  spec.correlation_length = 4e-4;
  spec.seed = 7;
  spec.heights = random_map(3);
  return spec;
}

FeatureSpec random_spec(FeatureKind kind, Rng& rng) {
  FeatureSpec spec = good(kind);
  spec.amplitude = std::pow(10.0, rng.uniform(-6.0, -3.0));
  spec.wavelength = Vec2(std::pow(10.0, rng.uniform(-5.0, -2.0)), std::pow(10.0, rng.uniform(-5.0, -2.0)));
  spec.direction = rng.uniform(-pi, pi);
  spec.phase = rng.uniform(-pi, pi);
  spec.wall = rng.uniform(0.01, 0.5);
  spec.roughness = spec.amplitude;
  spec.correlation_length = 0.3 * spec.wavelength.x();
  spec.seed = rng.next();
  return spec;
}

SurfaceFeature feature_of(const FeatureSpec& spec) {
  auto feature = SurfaceFeature::build(spec);
  EXPECT_TRUE(feature.ok()) << (feature.ok() ? "" : feature.error().message());
  return std::move(feature).value();
}

FeatureSpec grating(double amplitude, double wavelength) {
  FeatureSpec spec;
  spec.amplitude = amplitude;
  spec.wavelength = Vec2(wavelength, 0.0);
  return spec;
}

// ---- the paper's equations -----------------------------------------------------------------------------------------

TEST(SurfaceFeature, GratingIsEquationThree) {
  const SurfaceFeature feature = feature_of(grating(0.01, 2.0 * pi / 20.0));
  for (double u = -1.0; u <= 1.0; u += 0.0625) {
    const FeatureSample sample = feature.sample(Vec2(u, 0.3));
    EXPECT_NEAR(sample.height, 0.01 * std::cos(20.0 * u), 1e-14);
    EXPECT_NEAR(sample.gradient.x(), -0.2 * std::sin(20.0 * u), 1e-13);
    EXPECT_EQ(sample.gradient.y(), 0.0);
  }
}

TEST(SurfaceFeature, CircularGratingIsEquationFourAndFlatInItsCentre) {
  FeatureSpec spec = grating(1e-3, 5e-3);
  spec.kind = FeatureKind::circular_grating;
  spec.centre = Vec2(2e-3, 1e-3);
  const SurfaceFeature feature = feature_of(spec);
  const double w = 2.0 * pi / 5e-3;
  for (double angle = 0.0; angle < 6.0; angle += 0.5) {
    const double distance = 1e-3 + angle * 1e-3;
    const Vec2 radial(std::cos(angle), std::sin(angle));
    const FeatureSample sample = feature.sample(spec.centre + distance * radial);
    EXPECT_NEAR(sample.height, 1e-3 * std::cos(w * distance), 1e-15);
    EXPECT_LT((sample.gradient + 1e-3 * w * std::sin(w * distance) * radial).norm(), 1e-12);
    EXPECT_LT((feature.across(spec.centre + distance * radial) - radial).norm(), 1e-12);
  }
  EXPECT_EQ(feature.sample(spec.centre).gradient, Vec2(0.0, 0.0));
  EXPECT_EQ(feature.sample(spec.centre).height, 1e-3);
  EXPECT_EQ(feature.across(spec.centre), Vec2(0.0, 0.0));
}

TEST(SurfaceFeature, GridIsEquationFiveWithItsMissingFactors) {
  FeatureSpec spec;
  spec.kind = FeatureKind::grid;
  spec.amplitude = 1e-3;
  spec.wavelength = Vec2(4e-3, 6e-3);
  const SurfaceFeature feature = feature_of(spec);
  const double wu = 2.0 * pi / 4e-3;
  const double wv = 2.0 * pi / 6e-3;
  for (double u = -3e-3; u < 3e-3; u += 7e-4) {
    for (double v = -3e-3; v < 3e-3; v += 7e-4) {
      const FeatureSample sample = feature.sample(Vec2(u, v));
      EXPECT_NEAR(sample.height, 1e-3 * std::cos(wu * u) * std::cos(wv * v), 1e-15);
      EXPECT_NEAR(sample.gradient.x(), -1e-3 * wu * std::sin(wu * u) * std::cos(wv * v), 1e-12);
      EXPECT_NEAR(sample.gradient.y(), -1e-3 * wv * std::cos(wu * u) * std::sin(wv * v), 1e-12);
    }
  }
}

TEST(SurfaceFeature, RidgesHaveTwoSlopesAndTheirHeights) {
  FeatureSpec spec = grating(1e-3, 8e-3);
  spec.kind = FeatureKind::serrated;
  spec.wall = 0.25;
  const SurfaceFeature serrated = feature_of(spec);
  spec.kind = FeatureKind::triangular;
  const SurfaceFeature triangular = feature_of(spec);
  // From a crest at 0 the saw falls by 2 c over 6 mm and rises over 2 mm.
  const auto at = [](const SurfaceFeature& feature, double u) { return feature.sample(Vec2(u, 0.0)); };
  EXPECT_NEAR(at(serrated, 0.0).height, 1e-3, 1e-15);
  EXPECT_NEAR(at(serrated, 3e-3).height, 0.0, 1e-15);
  EXPECT_NEAR(at(serrated, 6e-3).height, -1e-3, 1e-15);
  EXPECT_NEAR(at(serrated, 7e-3).height, 0.0, 1e-15);
  EXPECT_NEAR(at(serrated, 1e-3).gradient.x(), -1.0 / 3.0, 1e-12);
  EXPECT_NEAR(at(serrated, -1e-3).gradient.x(), 1.0, 1e-12);
  EXPECT_NEAR(at(triangular, 2e-3).height, 0.0, 1e-15);
  EXPECT_NEAR(at(triangular, 4e-3).height, -1e-3, 1e-15);
  EXPECT_NEAR(at(triangular, 1e-3).gradient.x(), -0.5, 1e-12);
  EXPECT_NEAR(at(triangular, 5e-3).gradient.x(), 0.5, 1e-12);
}

TEST(SurfaceFeature, DirectionTurnsThePattern) {
  for (const FeatureKind kind :
       {FeatureKind::grating, FeatureKind::grid, FeatureKind::triangular, FeatureKind::serrated, FeatureKind::map}) {
    FeatureSpec spec = good(kind);
    spec.direction = 0.0;
    const SurfaceFeature straight = feature_of(spec);
    spec.direction = 1.1;
    const SurfaceFeature turned = feature_of(spec);
    const Eigen::Rotation2Dd rotation(1.1);
    for (double u = -2e-3; u < 2e-3; u += 3.7e-4) {
      const Vec2 place(u, 0.7 * u + 1e-4);
      const FeatureSample one = straight.sample(place);
      const FeatureSample other = turned.sample(rotation * place);
      EXPECT_NEAR(one.height, other.height, 1e-12);
      EXPECT_LT((rotation * one.gradient - other.gradient).norm(), 1e-7) << feature_name(kind);
    }
  }
}

// ---- of every kind -------------------------------------------------------------------------------------------------

RC_GTEST_PROP(SurfaceFeatureProperty, GradientIsTheDerivativeOfTheHeight, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const FeatureKind kind = all_kinds[rng.below(7)];
  const SurfaceFeature feature = feature_of(random_spec(kind, rng));
  const double step = 1e-7 * feature.wavelength();
  const double steepest = (feature.highest() - feature.lowest()) / feature.wavelength();
  for (int i = 0; i < 20; ++i) {
    const Vec2 place = feature.wavelength() * Vec2(rng.uniform(-8.0, 8.0), rng.uniform(-8.0, 8.0));
    const FeatureSample here = feature.sample(place);
    Vec2 difference;
    bool ridge = false;
    for (int k = 0; k < 2; ++k) {
      const Vec2 aside = step * (k == 0 ? Vec2(1.0, 0.0) : Vec2(0.0, 1.0));
      const FeatureSample before = feature.sample(place - aside);
      const FeatureSample after = feature.sample(place + aside);
      difference[k] = (after.height - before.height) / (2.0 * step);
      const bool straight = kind == FeatureKind::triangular || kind == FeatureKind::serrated;
      ridge = ridge || (straight && before.gradient != after.gradient);
    }
    if (!ridge) RC_ASSERT((difference - here.gradient).norm() <= 2e-6 * steepest + 1e-6 * here.gradient.norm());
  }
}

RC_GTEST_PROP(SurfaceFeatureProperty, HeightsStayWithinTheBounds, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const SurfaceFeature feature = feature_of(random_spec(all_kinds[rng.below(7)], rng));
  RC_ASSERT(feature.lowest() < feature.highest());
  for (int i = 0; i < 200; ++i) {
    const double height = feature.sample(Vec2(rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1))).height;
    RC_ASSERT(height >= feature.lowest());
    RC_ASSERT(height <= feature.highest());
  }
}

RC_GTEST_PROP(SurfaceFeatureProperty, HeightsChangeAcrossTheLayAlone, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const SurfaceFeature feature = feature_of(random_spec(all_kinds[rng.below(7)], rng));
  const Vec2 place = feature.wavelength() * Vec2(rng.uniform(-8.0, 8.0), rng.uniform(-8.0, 8.0));
  const Vec2 across = feature.across(place);
  if (across.norm() == 0.0) return;  // no lay
  RC_ASSERT(std::abs(across.norm() - 1.0) < 1e-12);
  const Vec2 gradient = feature.sample(place).gradient;
  RC_ASSERT((gradient - gradient.dot(across) * across).norm() <= 1e-12 * (1.0 + gradient.norm()));
}

TEST(SurfaceFeature, OnlyStraightAndRoundRidgesHaveALay) {
  for (const FeatureKind kind : all_kinds) {
    const bool lay = kind != FeatureKind::grid && kind != FeatureKind::noise && kind != FeatureKind::map;
    EXPECT_EQ(feature_of(good(kind)).across(Vec2(0.01, 0.02)).norm() > 0.5, lay) << feature_name(kind);
  }
}

TEST(SurfaceFeature, TakesTheMembersItNamesAndNoOthers) {
  const std::vector<std::pair<std::string, std::function<void(FeatureSpec&)>>> changes{
      {"amplitude", [](FeatureSpec& spec) { spec.amplitude *= 1.5; }},
      {"wavelength", [](FeatureSpec& spec) { spec.wavelength *= 1.3; }},
      {"direction", [](FeatureSpec& spec) { spec.direction += 0.3; }},
      {"phase", [](FeatureSpec& spec) { spec.phase += 0.3; }},
      {"centre", [](FeatureSpec& spec) { spec.centre.x() += 3e-4; }},
      {"wall", [](FeatureSpec& spec) { spec.wall = 0.4; }},
      {"roughness", [](FeatureSpec& spec) { spec.roughness *= 1.5; }},
      {"correlation_length", [](FeatureSpec& spec) { spec.correlation_length *= 1.3; }},
      {"seed", [](FeatureSpec& spec) { spec.seed += 1; }},
      {"period", [](FeatureSpec& spec) { spec.period = Vec2(8e-3, 9e-3); }},
      {"heights", [](FeatureSpec& spec) { spec.heights = random_map(4); }},
  };
  for (const FeatureKind kind : all_kinds) {
    const SurfaceFeature before = feature_of(good(kind));
    const auto& named = feature_parameters(kind);
    for (const auto& [member, change] : changes) {
      FeatureSpec spec = good(kind);
      change(spec);
      const SurfaceFeature after = feature_of(spec);
      double apart = 0.0;
      for (int i = 0; i < 30; ++i) {
        const Vec2 place(1.1e-4 * i, 1.7e-4 * i - 1e-3);
        apart = std::max(apart, std::abs(before.sample(place).height - after.sample(place).height));
      }
      const bool taken = std::find(named.begin(), named.end(), member) != named.end();
      EXPECT_EQ(apart > 0.0, taken) << feature_name(kind) << " " << member;
    }
  }
}

TEST(SurfaceFeature, WavelengthIsWhatHasToBeRendered) {
  FeatureSpec spec = good(FeatureKind::grid);
  EXPECT_DOUBLE_EQ(feature_of(spec).wavelength(), 1.5e-3);
  spec = good(FeatureKind::noise);
  EXPECT_NEAR(feature_of(spec).wavelength(), 4.0 * spec.correlation_length, 1e-12);
  spec = good(FeatureKind::map);
  EXPECT_NEAR(feature_of(spec).wavelength(), 4.0 * 1.5e-3 / 12, 1e-12);
}

TEST(SurfaceFeature, NamesAreReadBack) {
  for (const FeatureKind kind : all_kinds) {
    EXPECT_EQ(value_named<FeatureKind>(feature_name(kind)), kind);
  }
  EXPECT_EQ(feature_names().size(), 7U);
  EXPECT_FALSE(value_named<FeatureKind>("gratin").has_value());
  EXPECT_NE(name_list<FeatureKind>().find("circular-grating, grid, triangular"), std::string::npos);
}

// ---- rows ----------------------------------------------------------------------------------------------------------

TEST(Rows, Y1ClassesOfScale) {
  const FeatureScales desktop = feature_scales(0.02e-3);
  EXPECT_EQ(scale_of(3e-6, desktop), FeatureScale::friction);
  EXPECT_EQ(scale_of(1e-3, desktop), FeatureScale::texture);
  EXPECT_EQ(scale_of(6e-3, desktop), FeatureScale::shape);
  EXPECT_STREQ(scale_name(scale_of(3e-6, desktop)), "friction");
  EXPECT_STREQ(scale_name(scale_of(1e-3, desktop)), "texture");
  EXPECT_STREQ(scale_name(scale_of(6e-3, desktop)), "geometry");
  // 5 mm "or larger" are shapes; five steps of 0.02 mm still make a texture.
  EXPECT_EQ(scale_of(5e-3, desktop), FeatureScale::shape);
  EXPECT_EQ(scale_of(4.999e-3, desktop), FeatureScale::texture);
  EXPECT_EQ(scale_of(1e-4, desktop), FeatureScale::texture);
  EXPECT_EQ(scale_of(0.99e-4, desktop), FeatureScale::friction);
  EXPECT_NEAR(feature_scales(0.03e-3).friction_below, 0.15e-3, 1e-12);
  // A coarser device feels coarser things as friction, and a hopeless one everything that is no shape.
  EXPECT_EQ(scale_of(0.3e-3, feature_scales(0.1e-3)), FeatureScale::friction);
  EXPECT_EQ(scale_of(4.9e-3, feature_scales(0.1)), FeatureScale::friction);
  EXPECT_EQ(scale_of(5e-3, feature_scales(0.1)), FeatureScale::shape);
  EXPECT_EQ(feature_scales(0.0).friction_below, 1e-4);
}

TEST(Rows, Y4PeakSlopes) {
  const auto steepest = [](double amplitude, double wavelength) {
    const SurfaceFeature feature = feature_of(grating(amplitude, wavelength));
    double most = 0.0;
    for (int i = 0; i < 4000; ++i)
      most = std::max(most, std::abs(feature.sample(Vec2(wavelength * i / 4000, 0.0)).gradient.x()));
    return most;
  };
  EXPECT_NEAR(steepest(0.5e-3, 5e-3), 0.628, 5e-4);
  EXPECT_NEAR(steepest(0.5e-3, 2.5e-3), 1.257, 5e-4);
  EXPECT_NEAR(steepest(0.5e-3, 2.5e-3) / steepest(0.5e-3, 5e-3), 2.0, 1e-12);
  EXPECT_NEAR(steepest(0.25e-3, 5e-3), 0.314, 5e-4);  // if 0.5 mm is from crest to valley
}

// ---- noise ---------------------------------------------------------------------------------------------------------

FeatureSpec noise(std::uint64_t seed, int cells) {
  FeatureSpec spec;
  spec.kind = FeatureKind::noise;
  spec.roughness = 3e-6;
  spec.correlation_length = 2e-4;
  spec.seed = seed;
  spec.period = Vec2::Constant(cells * spec.correlation_length / 1.184695871196793);
  return spec;
}

TEST(Noise, HasExactlyTheRoughnessAskedFor) {
  // In a cell the square of the height is of degree 6 along each axis: four points of Gauss integrate it exactly.
  const double points[4] = {-0.8611363115940526, -0.3399810435848563, 0.3399810435848563, 0.8611363115940526};
  const double weights[4] = {0.3478548451374538, 0.6521451548625461, 0.6521451548625461, 0.3478548451374538};
  for (const int cells : {8, 33}) {
    const SurfaceFeature feature = feature_of(noise(5, cells));
    const double cell = feature.spec().period.x() / cells;
    double mean = 0.0;
    double square = 0.0;
    for (int row = 0; row < cells; ++row) {
      for (int column = 0; column < cells; ++column) {
        for (int i = 0; i < 4; ++i) {
          for (int j = 0; j < 4; ++j) {
            const Vec2 place = cell * Vec2(column + 0.5 + 0.5 * points[i], row + 0.5 + 0.5 * points[j]);
            const double height = feature.sample(place).height;
            mean += 0.25 * weights[i] * weights[j] * height;
            square += 0.25 * weights[i] * weights[j] * height * height;
          }
        }
      }
    }
    EXPECT_NEAR(mean / (cells * cells), 0.0, 1e-6 * 3e-6);
    EXPECT_NEAR(std::sqrt(square / (cells * cells)), 3e-6, 1e-6 * 3e-6);
  }
}

TEST(Noise, IsGaussianAndForgetsItselfOverItsCorrelationLength) {
  double average = 0.0;
  double fourth = 0.0;
  double correlation[3] = {};
  constexpr int seeds = 4;
  constexpr int points = 250;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const SurfaceFeature feature = feature_of(noise(seed, 96));
    const double length = feature.spec().correlation_length;
    const Vec2 lags[3] = {Vec2(length, 0.0), Vec2(0.0, length), length * Vec2(std::sqrt(0.5), std::sqrt(0.5))};
    for (int i = 0; i < points; ++i) {
      for (int j = 0; j < points; ++j) {
        const Vec2 place = feature.spec().period.cwiseProduct(Vec2(i + 0.5, j + 0.5)) / points;
        const double height = feature.sample(place).height / 3e-6;
        average += std::abs(height);
        fourth += std::pow(height, 4);
        for (int k = 0; k < 3; ++k) correlation[k] += height * feature.sample(place + lags[k]).height / 3e-6;
      }
    }
  }
  constexpr double count = static_cast<double>(seeds) * points * points;
  EXPECT_NEAR(average / count, std::sqrt(2.0 / pi), 0.02);
  EXPECT_NEAR(fourth / count, 3.0, 0.15);
  EXPECT_NEAR(correlation[0] / count, std::exp(-1.0), 0.03);
  EXPECT_NEAR(correlation[1] / count, std::exp(-1.0), 0.03);
  EXPECT_NEAR(correlation[2] / count, std::exp(-1.0), 0.03);
}

TEST(Noise, RepeatsAfterItsPeriodAndIsTheSameForTheSameSeed) {
  FeatureSpec spec = noise(9, 20);
  spec.period = Vec2(4.1e-3, 3.3e-3);
  const SurfaceFeature feature = feature_of(spec);
  const SurfaceFeature again = feature_of(spec);
  spec.seed = 10;
  const SurfaceFeature other = feature_of(spec);
  double apart = 0.0;
  for (int i = 0; i < 200; ++i) {
    const Vec2 place(1.23e-4 * i - 5e-3, 0.77e-4 * i);
    EXPECT_EQ(feature.sample(place).height, again.sample(place).height);
    EXPECT_NEAR(feature.sample(place).height, feature.sample(place + Vec2(4.1e-3, -3.3e-3)).height, 1e-15);
    apart = std::max(apart, std::abs(feature.sample(place).height - other.sample(place).height));
  }
  EXPECT_GT(apart, 3e-6);
  // A period that is not given is 64 cells, and told.
  spec.period = Vec2::Zero();
  EXPECT_NEAR(feature_of(spec).spec().period.x(), 64 * 2e-4 / 1.184695871196793, 1e-12);
}

TEST(Noise, IsSmoothWhereItsRepeatsMeet) {
  const SurfaceFeature feature = feature_of(noise(2, 8));
  const Vec2 period = feature.spec().period;
  for (const double share : {0.13, 0.5, 0.99}) {
    for (const Vec2& seam : {Vec2(0.0, share * period.y()), Vec2(share * period.x(), period.y())}) {
      const Vec2 aside = 1e-9 * period;
      const FeatureSample before = feature.sample(seam - aside);
      const FeatureSample after = feature.sample(seam + aside);
      EXPECT_NEAR(before.height, after.height, 1e-7 * 3e-6);
      EXPECT_LT((before.gradient - after.gradient).norm(), 1e-6 * 3e-6 / 2e-4);
    }
  }
}

TEST(Noise, BoundsAreNear) {
  const SurfaceFeature feature = feature_of(noise(4, 40));
  double highest = 0.0;
  for (int i = 0; i < 160'000; ++i)
    highest = std::max(
        highest, feature.sample(feature.spec().period.cwiseProduct(Vec2(i % 400 / 400.0, i / 400 / 400.0))).height);
  EXPECT_LE(highest, feature.highest());
  EXPECT_GT(highest, 0.85 * feature.highest());
}

// ---- roughness by direction ----------------------------------------------------------------------------------------

/// By going along a long line.
Roughness measured(const SurfaceFeature& feature, double direction, double length, const Vec2& from) {
  constexpr int points = 200'000;
  const Vec2 along(std::cos(direction), std::sin(direction));
  Roughness roughness;
  for (int i = 0; i < points; ++i) {
    const FeatureSample sample = feature.sample(from + length * (i + 0.5) / points * along);
    roughness.average += std::abs(sample.height) / points;
    roughness.rms += sample.height * sample.height / points;
    roughness.mean_slope += std::abs(sample.gradient.dot(along)) / points;
  }
  roughness.rms = std::sqrt(roughness.rms);
  return roughness;
}

TEST(RoughnessAlong, FormulasAgreeWithALongLine) {
  for (const FeatureKind kind : {FeatureKind::grating, FeatureKind::circular_grating, FeatureKind::grid,
                                 FeatureKind::triangular, FeatureKind::serrated}) {
    for (const double direction : {0.4, 1.0, -0.9, 2.2}) {
      const SurfaceFeature feature = feature_of(good(kind));
      const Vec2 along(std::cos(direction), std::sin(direction));
      const Roughness expected = measured(feature, direction, 6.0, Vec2(1e-4, 0.0) - 3.0 * along);
      const Roughness roughness = feature.roughness_along(direction);
      if (kind == FeatureKind::grid && direction == 0.4) {
        // Along an axis one line is not all lines; their mean is.
        EXPECT_NEAR(roughness.mean_slope, 4.0 / (pi * pi) * 2e-4 * 2.0 * pi / 1.5e-3, 1e-5);
        EXPECT_NEAR(roughness.rms, 1e-4, 1e-12);
        continue;
      }
      EXPECT_NEAR(roughness.average / expected.average, 1.0, 0.01) << feature_name(kind) << " " << direction;
      EXPECT_NEAR(roughness.rms / expected.rms, 1.0, 0.01) << feature_name(kind) << " " << direction;
      EXPECT_NEAR(roughness.mean_slope / expected.mean_slope, 1.0, 0.01) << feature_name(kind) << " " << direction;
    }
  }
}

TEST(RoughnessAlong, OfNoiseIsTheSameInAllDirections) {
  const SurfaceFeature feature = feature_of(noise(6, 100));
  // A Gaussian surface of correlation exp(-x^2 / l^2) about its middle has slopes of sqrt(2) R_q / l; the spline's
  // curve is a little rounder there.
  for (const double direction : {0.0, 0.6, pi / 2.0}) {
    const Roughness roughness = feature.roughness_along(direction);
    EXPECT_EQ(roughness.rms, 3e-6);
    EXPECT_NEAR(roughness.average, std::sqrt(2.0 / pi) * 3e-6, 0.03 * 3e-6);
    EXPECT_NEAR(roughness.mean_slope, std::sqrt(2.0 / pi) * std::sqrt(2.0) * 3e-6 / 2e-4, 0.1 * 3e-6 / 2e-4);
  }
}

TEST(RoughnessAlong, OfAMapOfRidgesKnowsTheirLay) {
  FeatureSpec ridges = grating(1e-5, 1e-3);
  auto baked = bake({feature_of(ridges)}, Vec2::Zero(), Vec2(4e-3, 4e-3), 256, 256, Wrap::repeat);
  ASSERT_TRUE(baked.ok());
  FeatureSpec spec;
  spec.kind = FeatureKind::map;
  spec.wavelength = Vec2(4e-3, 4e-3);
  spec.heights = std::make_shared<const HeightMap>(std::move(baked).value());
  const SurfaceFeature map = feature_of(spec);
  const SurfaceFeature exact = feature_of(ridges);
  for (const double direction : {0.0, 0.5, 1.2}) {
    EXPECT_NEAR(map.roughness_along(direction).average, exact.roughness_along(direction).average, 2e-7);
    EXPECT_NEAR(map.roughness_along(direction).mean_slope, exact.roughness_along(direction).mean_slope, 1e-3);
  }
  EXPECT_LT(map.roughness_along(pi / 2.0).average, 1e-10);
}

// ---- baking --------------------------------------------------------------------------------------------------------

TEST(Bake, HoldsTheSum) {
  FeatureSpec tilted = grating(2e-4, 2e-3);
  tilted.direction = pi / 2.0;
  tilted.phase = 0.7;
  const std::vector<SurfaceFeature> features{feature_of(grating(1e-4, 1e-3)), feature_of(tilted)};
  const Vec2 lower(-3e-3, 1e-3);
  const Vec2 extent(4e-3, 2e-3);
  const auto map = bake(features, lower, lower + extent, 160, 80, Wrap::repeat);
  ASSERT_TRUE(map.ok());
  EXPECT_EQ(map->width(), 160);
  EXPECT_EQ(map->height(), 80);
  Rng rng(1);
  for (int i = 0; i < 500; ++i) {
    const Vec2 st(rng.uniform(), rng.uniform());
    const Vec2 place = lower + extent.cwiseProduct(st);
    EXPECT_NEAR(map->sample(st).height, features[0].sample(place).height + features[1].sample(place).height, 1e-7);
  }
}

TEST(Bake, RefusesWhatHasNoSizeOrTooMuch) {
  const std::vector<SurfaceFeature> features{feature_of(grating(1e-4, 1e-3))};
  const auto refused = [&](const Vec2& lower, const Vec2& upper, int columns, int rows) {
    const auto map = bake(features, lower, upper, columns, rows, Wrap::clamp);
    EXPECT_FALSE(map.ok());
    return map.ok() ? ErrorCode::mismatch : map.error().code;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refused(Vec2(0, 0), Vec2(1, 0), 8, 8), ErrorCode::bad_value);
  EXPECT_EQ(refused(Vec2(0, 0), Vec2(nan, 1), 8, 8), ErrorCode::bad_value);
  EXPECT_EQ(refused(Vec2(0, 0), Vec2(1, 1), 0, 8), ErrorCode::bad_value);
  EXPECT_EQ(refused(Vec2(0, 0), Vec2(1, 1), 8, -1), ErrorCode::bad_value);
  EXPECT_EQ(refused(Vec2(0, 0), Vec2(1, 1), 16384, 16384), ErrorCode::too_large);
  EXPECT_EQ(refused(Vec2(0, 0), Vec2(1, 1), 2'000'000'000, 2'000'000'000), ErrorCode::too_large);
}

// ---- bad input -----------------------------------------------------------------------------------------------------

TEST(SurfaceFeature, RefusesEachMemberByName) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  struct Case {
    FeatureKind kind;
    std::function<void(FeatureSpec&)> spoil;
    const char* place;
    ErrorCode code = ErrorCode::bad_value;
  };
  const Case cases[] = {
      {FeatureKind::grating, [](auto& s) { s.kind = static_cast<FeatureKind>(99); }, "kind"},
      {FeatureKind::grating, [](auto& s) { s.amplitude = 0.0; }, "amplitude"},
      {FeatureKind::grid, [](auto& s) { s.amplitude = -1e-3; }, "amplitude"},
      {FeatureKind::serrated, [=](auto& s) { s.amplitude = nan; }, "amplitude"},
      {FeatureKind::circular_grating, [](auto& s) { s.amplitude = infinity; }, "amplitude"},
      {FeatureKind::grating, [](auto& s) { s.wavelength.x() = 0.0; }, "wavelength"},
      {FeatureKind::grid, [](auto& s) { s.wavelength.y() = -1.0; }, "wavelength"},
      {FeatureKind::map, [=](auto& s) { s.wavelength.y() = nan; }, "wavelength"},
      {FeatureKind::triangular, [](auto& s) { s.wavelength.x() = 1e9; }, "wavelength"},
      {FeatureKind::grating, [=](auto& s) { s.direction = nan; }, "direction"},
      {FeatureKind::serrated, [](auto& s) { s.phase = infinity; }, "phase"},
      {FeatureKind::circular_grating, [=](auto& s) { s.centre.y() = nan; }, "centre"},
      {FeatureKind::serrated, [](auto& s) { s.wall = 0.6; }, "wall"},
      {FeatureKind::serrated, [](auto& s) { s.wall = 0.0; }, "wall"},
      {FeatureKind::map, [](auto& s) { s.heights = nullptr; }, "heights"},
      {FeatureKind::noise, [](auto& s) { s.roughness = 0.0; }, "roughness"},
      {FeatureKind::noise, [=](auto& s) { s.correlation_length = nan; }, "correlation_length"},
      {FeatureKind::noise, [](auto& s) { s.period.x() = 1e-4; }, "period"},
      {FeatureKind::noise, [](auto& s) { s.period.y() = -1.0; }, "period"},
      {FeatureKind::noise, [=](auto& s) { s.period.y() = nan; }, "period"},
      {FeatureKind::noise, [](auto& s) { s.period.x() = 1e300; }, "period"},
      {FeatureKind::noise, [](auto& s) { s.period = Vec2(2.0, 2.0); }, "period", ErrorCode::too_large},
  };
  for (const Case& bad : cases) {
    FeatureSpec spec = good(bad.kind);
    bad.spoil(spec);
    const auto feature = SurfaceFeature::build(spec);
    ASSERT_FALSE(feature.ok()) << feature_name(bad.kind) << " " << bad.place;
    EXPECT_EQ(feature.error().place, bad.place);
    EXPECT_EQ(feature.error().code, bad.code) << feature.error().message();
    EXPECT_FALSE(feature.error().accepted.empty());
  }
}

}  // namespace
}  // namespace asperity::surface_features_test
