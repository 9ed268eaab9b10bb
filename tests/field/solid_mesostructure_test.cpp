#include "asperity/field/mesostructure/solid.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "asperity/core/rng.h"

namespace asperity::solid_mesostructure_test {
namespace {

constexpr SolidKind all_kinds[] = {SolidKind::waves, SolidKind::lattice, SolidKind::rings, SolidKind::noise,
                                   SolidKind::pulse};

SolidMesostructure built(const SolidSpec& spec) {
  auto solid = SolidMesostructure::build(spec);
  EXPECT_TRUE(solid.ok()) << (solid.ok() ? "" : solid.error().message());
  return *solid;
}

Vec3 random_point(Rng& rng, double reach) {
  return {rng.uniform(-reach, reach), rng.uniform(-reach, reach), rng.uniform(-reach, reach)};
}

/// Any good spec.
SolidSpec random_spec(Rng& rng) {
  SolidSpec spec;
  spec.kind = all_kinds[rng.below(5)];
  spec.amplitude = std::exp(rng.uniform(std::log(1e-6), std::log(1e-2)));
  spec.wavelength = std::exp(rng.uniform(std::log(1e-4), std::log(1e-1)));
  spec.direction = random_point(rng, 1.0) + Vec3(0.0, 0.0, 1e-3);
  spec.centre = random_point(rng, 2.0 * spec.wavelength);
  spec.phase = rng.uniform(-4.0, 4.0);
  spec.frequency = rng.uniform(0.1, 50.0);
  spec.drift = random_point(rng, 0.1);
  spec.octaves = 1 + static_cast<int>(rng.below(4));
  spec.persistence = rng.uniform();
  spec.seed = rng.next();
  return spec;
}

Rng random_numbers() {
  return Rng(static_cast<std::uint64_t>(*rc::gen::inRange(0, 1 << 30)));
}

/// Near the centre, so that a pulse is met as well.
Vec3 place_near(const SolidSpec& spec, Rng& rng) {
  return spec.centre + random_point(rng, (rng.uniform() < 0.5 ? 0.6 : 5.0) * spec.wavelength);
}

RC_GTEST_PROP(SolidMesostructure, DerivativesAreThoseOfTheHeight, ()) {
  Rng rng = random_numbers();
  const SolidSpec spec = random_spec(rng);
  const SolidMesostructure solid = built(spec);
  const double time = rng.uniform(0.0, 10.0);
  for (int i = 0; i < 10; ++i) {
    const Vec3 p = place_near(spec, rng);
    const double h = 1e-4 * solid.grain();
    const SolidJet jet = solid.jet(p, time);
    const double slope = spec.amplitude / solid.grain();
    RC_ASSERT(jet.second.isApprox(jet.second.transpose(), 1e-12) || jet.second.isZero());
    for (int a = 0; a < 3; ++a) {
      const SolidJet before = solid.jet(p - h * Vec3::Unit(a), time);
      const SolidJet after = solid.jet(p + h * Vec3::Unit(a), time);
      RC_ASSERT(std::abs((after.height - before.height) / (2.0 * h) - jet.gradient[a]) < 1e-4 * slope);
      const Vec3 second = (after.gradient - before.gradient) / (2.0 * h);
      RC_ASSERT((second - jet.second.col(a)).norm() < 2e-2 * slope / solid.grain());
    }
  }
}

RC_GTEST_PROP(SolidMesostructure, NeverExceedsItsAmplitude, ()) {
  Rng rng = random_numbers();
  const SolidSpec spec = random_spec(rng);
  const SolidMesostructure solid = built(spec);
  for (int i = 0; i < 200; ++i) {
    const double height = solid.jet(place_near(spec, rng), rng.uniform(0.0, 10.0)).height;
    RC_ASSERT(std::abs(height) <= spec.amplitude * (1.0 + 1e-12));
  }
}

RC_GTEST_PROP(SolidMesostructure, RangeHoldsEveryHeightInTheBox, ()) {
  Rng rng = random_numbers();
  const SolidSpec spec = random_spec(rng);
  const SolidMesostructure solid = built(spec);
  const double time = rng.uniform(0.0, 10.0);
  for (int i = 0; i < 10; ++i) {
    const Vec3 centre = place_near(spec, rng);
    const double size = spec.wavelength * std::exp(rng.uniform(std::log(1e-4), std::log(2.0)));
    const Vec3 half = random_point(rng, size).cwiseAbs();
    const HeightRange range = solid.range(centre, half, time);
    for (int n = 0; n < 60; ++n) {
      Vec3 way = random_point(rng, 1.0);
      if (n % 3 == 0) way = way.array().sign();  // corners
      const double height = solid.jet(centre + half.cwiseProduct(way), time).height;
      RC_ASSERT(height >= range.lowest - 1e-14 * spec.amplitude);
      RC_ASSERT(height <= range.highest + 1e-14 * spec.amplitude);
    }
  }
}

RC_GTEST_PROP(SolidMesostructure, RangeOfASmallBoxIsNarrow, ()) {
  Rng rng = random_numbers();
  const SolidSpec spec = random_spec(rng);
  const SolidMesostructure solid = built(spec);
  const double half = 1e-3 * solid.grain();
  const Vec3 p = place_near(spec, rng);
  const HeightRange range = solid.range(p, Vec3::Constant(half), 0.3);
  // No slope exceeds eight amplitudes a grain in an octave; the box is twice `half` wide along three axes.
  const double octaves = spec.kind == SolidKind::noise ? spec.octaves : 1.0;
  const double most_slope = 8.0 * octaves * spec.amplitude / solid.grain();
  RC_ASSERT(range.highest - range.lowest <= 2.0 * half * 3.0 * most_slope);
}

RC_GTEST_PROP(SolidMesostructure, TimeIsContinuousAndItsSpeedBounded, ()) {
  Rng rng = random_numbers();
  const SolidSpec spec = random_spec(rng);
  const SolidMesostructure solid = built(spec);
  RC_ASSERT(solid.moves());
  for (int i = 0; i < 50; ++i) {
    const Vec3 p = place_near(spec, rng);
    const double time = rng.uniform(0.0, 100.0);
    const double step = 1e-5;
    const double change = solid.jet(p, time + step).height - solid.jet(p, time).height;
    RC_ASSERT(std::abs(change) <= step * solid.most_speed() * (1.0 + 1e-6) + 1e-9 * spec.amplitude);
  }
}

RC_GTEST_PROP(SolidMesostructure, SecondDerivativesAreContinuousAcrossCellsOfNoise, ()) {
  Rng rng = random_numbers();
  SolidSpec spec;
  spec.seed = rng.next();
  spec.wavelength = 1.0;
  spec.amplitude = 1.0;
  const SolidMesostructure solid = built(spec);
  // A line longer than two cells crosses borders; no step may change the bend by more than its slope allows.
  const Vec3 from = random_point(rng, 5.0);
  const Vec3 along = random_point(rng, 1.0).normalized();
  constexpr double step = 1e-3;
  Mat3 before = solid.jet(from, 0.0).second;
  for (int i = 1; i < 2500; ++i) {
    const Mat3 now = solid.jet(from + i * step * along, 0.0).second;
    RC_ASSERT((now - before).norm() < 600.0 * step);
    before = now;
  }
}

TEST(SolidMesostructure, WavesAreTheirFormula) {
  SolidSpec spec;
  spec.kind = SolidKind::waves;
  spec.amplitude = 2e-4;
  spec.wavelength = 3e-3;
  spec.direction = Vec3(0.0, 3.0, 4.0);
  spec.frequency = 2.0;
  spec.phase = 0.4;
  const SolidMesostructure solid = built(spec);
  const Vec3 p(1e-3, 2e-3, -5e-3);
  const double along = 0.6 * 2e-3 - 0.8 * 5e-3;
  const double angle = 2.0 * std::numbers::pi * (along / 3e-3 - 2.0 * 0.7) + 0.4;
  EXPECT_NEAR(solid.jet(p, 0.7).height, 2e-4 * std::cos(angle), 1e-15);
  EXPECT_NEAR(solid.spec().direction.norm(), 1.0, 1e-15);
  EXPECT_DOUBLE_EQ(solid.grain(), 3e-3);
  // A crest travels along the direction at wavelength times frequency.
  const Vec3 carried = p + 3e-3 * 2.0 * 0.05 * solid.spec().direction;
  EXPECT_NEAR(solid.jet(carried, 0.75).height, solid.jet(p, 0.7).height, 1e-15);
}

TEST(SolidMesostructure, LatticeReachesItsAmplitudeAtItsPoints) {
  SolidSpec spec;
  spec.kind = SolidKind::lattice;
  spec.wavelength = 1e-3;
  spec.amplitude = 5e-5;
  const SolidMesostructure solid = built(spec);
  EXPECT_NEAR(solid.jet(Vec3::Zero(), 0.0).height, 5e-5, 1e-18);
  EXPECT_NEAR(solid.jet(Vec3(1e-3, -2e-3, 3e-3), 0.0).height, 5e-5, 1e-16);
  EXPECT_NEAR(solid.jet(Vec3(5e-4, 5e-4, 5e-4), 0.0).height, -5e-5, 1e-16);
}

TEST(SolidMesostructure, RingsAreSpheresAndSmoothAtTheirCentre) {
  SolidSpec spec;
  spec.kind = SolidKind::rings;
  spec.wavelength = 1e-2;
  spec.amplitude = 1e-3;
  spec.phase = 0.5;
  spec.centre = Vec3(0.01, 0.02, 0.03);
  const SolidMesostructure solid = built(spec);
  EXPECT_TRUE(solid.jet(spec.centre, 0.0).gradient.isZero(1e-12));
  const double far = solid.jet(spec.centre + Vec3(0.05, 0.0, 0.0), 0.0).height;
  EXPECT_NEAR(solid.jet(spec.centre + Vec3(0.0, 0.03, 0.04), 0.0).height, far, 1e-15);
  // The rounding is below its quarter wavelength and dies out: crests are a wavelength apart in the end.
  EXPECT_NEAR(solid.jet(spec.centre + Vec3(5.0, 0.0, 0.0), 0.0).height,
              solid.jet(spec.centre + Vec3(5.01, 0.0, 0.0), 0.0).height, 1e-7);
}

TEST(SolidMesostructure, PulseBeats) {
  SolidSpec spec;
  spec.kind = SolidKind::pulse;
  spec.frequency = 1.25;
  spec.wavelength = 4e-3;
  spec.amplitude = 1e-3;
  spec.centre = Vec3(0.0, 0.0, 0.1);
  const SolidMesostructure solid = built(spec);
  EXPECT_EQ(solid.jet(spec.centre, 0.0).height, 0.0);
  EXPECT_NEAR(solid.jet(spec.centre, 0.4).height, 1e-3, 1e-15);
  EXPECT_NEAR(solid.jet(spec.centre, 0.8).height, 0.0, 1e-15);
  EXPECT_EQ(solid.jet(spec.centre + Vec3(4e-3, 0.0, 0.0), 0.4).height, 0.0);
}

TEST(SolidMesostructure, NoiseIsItsSeedsAndDriftsAsAWhole) {
  SolidSpec spec;
  spec.octaves = 3;
  spec.drift = Vec3(1e-3, 0.0, -2e-3);
  const SolidMesostructure one = built(spec);
  const SolidMesostructure same = built(spec);
  spec.seed = 2;
  const SolidMesostructure other = built(spec);
  Rng rng(7);
  double squares = 0.0;
  double difference = 0.0;
  double largest = 0.0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3 p = random_point(rng, 0.05);
    const double height = one.jet(p, 0.0).height;
    EXPECT_EQ(height, same.jet(p, 0.0).height);
    EXPECT_NEAR(one.jet(p + 2.0 * spec.drift, 2.0).height, height, 1e-15);
    squares += height * height;
    difference += std::abs(height - other.jet(p, 0.0).height);
    largest = std::max(largest, std::abs(height));
  }
  const double rms = std::sqrt(squares / 4000.0);
  EXPECT_GT(rms, 0.15 * spec.amplitude);
  EXPECT_LT(rms, 0.35 * spec.amplitude);
  EXPECT_GT(largest, 0.5 * spec.amplitude);
  EXPECT_GT(difference / 4000.0, 0.5 * rms);
  EXPECT_DOUBLE_EQ(one.grain(), 5e-4);
}

TEST(SolidMesostructure, AnswersAnywhere) {
  Rng rng(3);
  for (const SolidKind kind : all_kinds) {
    SolidSpec spec;
    spec.kind = kind;
    spec.frequency = 1.0;
    const SolidMesostructure solid = built(spec);
    for (const double far : {1e3, 1e9, 1e17, 1e250, infinity, std::numeric_limits<double>::quiet_NaN()}) {
      for (const Vec3& p : {Vec3(far, 0.0, 0.0), Vec3(0.0, -far, far)}) {
        const SolidJet jet = solid.jet(p, 0.5);
        EXPECT_TRUE(std::abs(jet.height) <= spec.amplitude) << to_string(kind) << far;
        const HeightRange range = solid.range(p, Vec3::Constant(1e-3), 0.5);
        EXPECT_TRUE(range.lowest <= range.highest) << to_string(kind) << far;
      }
    }
    EXPECT_EQ(solid.jet(Vec3::Ones(), infinity).height, 0.0);
    const HeightRange all = solid.range(Vec3::Zero(), Vec3::Constant(infinity), 0.0);
    EXPECT_EQ(all.highest, spec.amplitude);
  }
}

TEST(SolidMesostructure, StandsStillWithoutFrequencyOrDrift) {
  for (const SolidKind kind : {SolidKind::waves, SolidKind::lattice, SolidKind::rings, SolidKind::noise}) {
    SolidSpec spec;
    spec.kind = kind;
    const SolidMesostructure solid = built(spec);
    EXPECT_FALSE(solid.moves());
    EXPECT_EQ(solid.most_speed(), 0.0);
    const Vec3 p(1e-3, 2e-4, -7e-3);
    EXPECT_EQ(solid.jet(p, 0.0).height, solid.jet(p, 12.34).height);
  }
}

TEST(SolidMesostructure, RefusesWhatCannotBe) {
  const auto place = [](auto&& change) {
    SolidSpec spec;
    spec.kind = SolidKind::waves;
    change(spec);
    const auto solid = SolidMesostructure::build(spec);
    EXPECT_FALSE(solid.ok());
    if (solid.ok()) return std::string("built");
    EXPECT_EQ(solid.error().code, ErrorCode::bad_value);
    EXPECT_FALSE(solid.error().accepted.empty());
    return solid.error().place;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(place([](SolidSpec& s) { s.amplitude = 0.0; }), "amplitude");
  EXPECT_EQ(place([](SolidSpec& s) { s.amplitude = infinity; }), "amplitude");
  EXPECT_EQ(place([](SolidSpec& s) { s.wavelength = -1.0; }), "wavelength");
  EXPECT_EQ(place([&](SolidSpec& s) { s.wavelength = nan; }), "wavelength");
  EXPECT_EQ(place([](SolidSpec& s) { s.direction = Vec3::Zero(); }), "direction");
  EXPECT_EQ(place([&](SolidSpec& s) { s.direction.x() = nan; }), "direction");
  EXPECT_EQ(place([&](SolidSpec& s) { s.phase = nan; }), "phase");
  EXPECT_EQ(place([&](SolidSpec& s) { s.frequency = nan; }), "frequency");
  EXPECT_EQ(place([&](SolidSpec& s) { s.centre.y() = nan; }), "centre");
  EXPECT_EQ(place([](SolidSpec& s) { s.kind = SolidKind::pulse; }), "frequency");
  const auto noise = [&](auto&& change) {
    return place([&](SolidSpec& s) {
      s.kind = SolidKind::noise;
      change(s);
    });
  };
  EXPECT_EQ(noise([](SolidSpec& s) { s.octaves = 0; }), "octaves");
  EXPECT_EQ(noise([](SolidSpec& s) { s.octaves = 9; }), "octaves");
  EXPECT_EQ(noise([](SolidSpec& s) { s.persistence = 1.5; }), "persistence");
  EXPECT_EQ(noise([](SolidSpec& s) { s.drift.z() = infinity; }), "drift");
}

TEST(SolidMesostructure, KindsHaveNames) {
  for (const SolidKind kind : all_kinds) {
    EXPECT_EQ(value_named<SolidKind>(to_string(kind)), kind);
  }
  EXPECT_EQ(all_names<SolidKind>().size(), std::size(all_kinds));
  EXPECT_FALSE(value_named<SolidKind>("nois").has_value());
}

}  // namespace
}  // namespace asperity::solid_mesostructure_test
