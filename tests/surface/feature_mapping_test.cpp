#include "asperity/surface/feature_mapping.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <numbers>
#include <string>

#include "asperity/core/rng.h"
#include "asperity/geometry/generators.h"

namespace asperity::feature_mapping_test {
namespace {

using std::numbers::pi;

static_assert(noexcept(std::declval<const FeatureMapping&>().map(std::declval<const Vec3&>(),
                                                                 std::declval<MappedPlaces&>())));

constexpr IntermediateSurface surfaces[] = {IntermediateSurface::plane, IntermediateSurface::cylinder,
                                            IntermediateSurface::sphere, IntermediateSurface::box};

Vec3 random_vector(Rng& rng, double size) {
  return {rng.uniform(-size, size), rng.uniform(-size, size), rng.uniform(-size, size)};
}

FeatureMappingSettings random_settings(IntermediateSurface surface, Rng& rng) {
  FeatureMappingSettings settings;
  settings.surface = surface;
  settings.origin = random_vector(rng, 0.1);
  settings.axis = (random_vector(rng, 1.0) + Vec3(0.0, 0.0, 2.0)).normalized();
  settings.reference = settings.axis.cross(random_vector(rng, 1.0) + Vec3(0.0, 2.0, 0.0)).normalized();
  settings.radius = rng.uniform(0.01, 0.2);
  settings.half_extent = Vec3(rng.uniform(0.01, 0.1), rng.uniform(0.01, 0.1), rng.uniform(0.01, 0.1));
  return settings;
}

FeatureMapping mapping_of(const FeatureMappingSettings& settings) {
  auto mapping = FeatureMapping::build(settings);
  EXPECT_TRUE(mapping.ok()) << (mapping.ok() ? "" : mapping.error().message());
  return std::move(mapping).value();
}

FeatureMapping round_mapping(IntermediateSurface surface, double radius) {
  FeatureMappingSettings settings;
  settings.surface = surface;
  settings.radius = radius;
  return mapping_of(settings);
}

MappedPlaces places(const FeatureMapping& mapping, const Vec3& point) {
  MappedPlaces out;
  mapping.map(point, out);
  return out;
}

SurfaceFeature feature_of(const FeatureSpec& spec) {
  auto feature = SurfaceFeature::build(spec);
  EXPECT_TRUE(feature.ok()) << (feature.ok() ? "" : feature.error().message());
  return std::move(feature).value();
}

SurfaceFeature grating(double amplitude, double wavelength, double direction = 0.0) {
  FeatureSpec spec;
  spec.amplitude = amplitude;
  spec.wavelength = Vec2(wavelength, 0.0);
  spec.direction = direction;
  return feature_of(spec);
}

/// Height of a feature at a point of the object, and its gradient in space (eq. 6 to 9).
struct SpaceSample {
  double height = 0.0;
  Vec3 gradient = Vec3::Zero();
};

SpaceSample laid(const FeatureMapping& mapping, const SurfaceFeature& feature, const Vec3& point) {
  SpaceSample sum;
  for (const MappedPlace& place : places(mapping, point)) {
    const FeatureSample sample = feature.sample(place.uv);
    sum.height += place.weight * sample.height;
    sum.gradient += place.weight * (sample.gradient.x() * place.du + sample.gradient.y() * place.dv) +
                    sample.height * place.dweight;
  }
  return sum;
}

// ---- the paper's example -------------------------------------------------------------------------------------------

/// S = (r cos t, r sin t, r^3 + 3 t) of section 3.1.3.
struct Ramp {
  Vec3 point, along_r, along_t, normal;
  Ramp(double r, double t)
      : point(r * std::cos(t), r * std::sin(t), r * r * r + 3.0 * t),
        along_r(std::cos(t), std::sin(t), 3.0 * r * r),
        along_t(-r * std::sin(t), r * std::cos(t), 3.0),
        normal(along_r.cross(along_t).normalized()) {}
};

/// Eq. 6 over theta in [from, to]: u is 1 after that, round the axis of the example.
FeatureMapping example_mapping(double from, double to) {
  FeatureMappingSettings settings;
  settings.surface = IntermediateSurface::cylinder;
  settings.radius = 1.0 / (to - from);
  settings.range = Vec2(from, to);
  return mapping_of(settings);
}

TEST(Rows, Y2HeightAndGradientOnTheRamp) {
  // h = 0.01 cos 20 u over theta in [0, pi]: 6.37 waves a turn, which close around no cylinder.
  const FeatureMapping mapping = example_mapping(0.0, pi);
  const SurfaceFeature feature = grating(0.01, 2.0 * pi / 20.0);
  EXPECT_TRUE(mapping.check(feature).ok());
  const Status around = round_mapping(IntermediateSurface::cylinder, 1.0 / pi).check(feature);
  ASSERT_FALSE(around.ok());
  EXPECT_NE(around.error().message().find("6.3662 wavelengths go once around"), std::string::npos)
      << around.error().message();
  EXPECT_NE(around.error().accepted.find("with a range, at whose seam it may step"), std::string::npos)
      << around.error().message();
  for (double r = 1.0; r <= 3.0; r += 0.25) {
    for (double t = 0.05; t < pi - 0.04; t += 0.1) {
      const Ramp ramp(r, t);
      const SpaceSample sample = laid(mapping, feature, ramp.point);
      EXPECT_NEAR(sample.height, 0.01 * std::cos(20.0 * t / pi), 1e-13);
      const Vec3 gradient = surface_gradient(sample.gradient, ramp.normal);
      EXPECT_LT(std::abs(ramp.normal.dot(gradient)), 1e-12);
      // Along the surface: what the height changes by when the parameters do.
      constexpr double step = 1e-6;
      const auto height = [&](double at_r, double at_t) {
        return laid(mapping, feature, Ramp(at_r, at_t).point).height;
      };
      EXPECT_NEAR((height(r, t + step) - height(r, t - step)) / (2.0 * step), gradient.dot(ramp.along_t),
                  1e-6 * 0.0637);
      EXPECT_NEAR((height(r + step, t) - height(r - step, t)) / (2.0 * step), gradient.dot(ramp.along_r),
                  1e-6 * 0.0637);
      // The closed form, by the metric E = r^2 + 9, F = 9 r^2, G = 1 + 9 r^4.
      const double along_t = -0.01 * 20.0 / pi * std::sin(20.0 * t / pi);
      const double e = r * r + 9.0;
      const double f = 9.0 * r * r;
      const double g = 1.0 + 9.0 * r * r * r * r;
      const Vec3 closed = along_t * (g * ramp.along_t - f * ramp.along_r) / (e * g - f * f);
      EXPECT_LT((gradient - closed).norm(), 1e-13);
      // Erratum c: the printed example counts theta twice, and is off by the factor 1 + 1/r along it.
      const double x = ramp.point.x();
      const double y = ramp.point.y();
      const Vec3 printed = along_t * Vec3(-y / (x * x + y * y), x / (x * x + y * y), 1.0 / (3.0 * r));
      EXPECT_NEAR(printed.dot(ramp.along_t), (1.0 + 1.0 / r) * gradient.dot(ramp.along_t), 1e-13);
      MappedPlace twice = places(mapping, ramp.point)[0];
      mapping.count_angle_twice(ramp.point, ramp.normal, twice);
      EXPECT_LT((feature.sample(twice.uv).gradient.x() * twice.du - printed).norm(), 1e-13);
    }
  }
}

TEST(Rows, Y2AWrapThatNeedNotCloseStepsAtItsSeamAlone) {
  const FeatureMapping mapping = example_mapping(0.0, pi);
  const SurfaceFeature feature = grating(0.01, 2.0 * pi / 20.0);
  // Once around. Elsewhere heights change by no more than the slope by theta, 0.01 x 20 / pi, times the step.
  constexpr int steps = 20'000;
  const auto height = [&](int i) { return laid(mapping, feature, Ramp(2.0, 2.0 * pi * i / steps).point).height; };
  int jumps = 0;
  for (int i = 1; i <= steps; ++i) {
    const double change = height(i) - height(i - 1);
    if (std::abs(change) <= 0.2 / pi * (2.0 * pi / steps)) continue;
    ++jumps;
    // Opposite the middle of the range, from u = 1.5 to u = -0.5.
    EXPECT_NEAR(2.0 * pi * (i - 0.5) / steps, 1.5 * pi, 2.0 * pi / steps);
    EXPECT_NEAR(change, 0.01 * (std::cos(20.0 * 0.5) - std::cos(20.0 * 1.5)), 1e-4);
  }
  EXPECT_EQ(jumps, 1);
  EXPECT_NEAR(mapping.seam().angle, 1.5 * pi, 1e-12);
  EXPECT_NEAR(mapping.seam().last, 1.5, 1e-12);
  EXPECT_NEAR(mapping.seam().first, -0.5, 1e-12);
  EXPECT_EQ(mapping.circumference(), 0.0);
}

TEST(Rows, Y2TheRangeBeginsAtItsFirstAngle) {
  // Erratum b: (theta - theta_1) / (theta_2 - theta_1), over whatever angles.
  for (const auto& [from, to] : {std::pair{-2.0, -0.5}, {0.4, 1.1}, {2.5, 5.0}, {-0.5, 2.0 * pi - 0.5}}) {
    const FeatureMapping mapping = example_mapping(from, to);
    for (const double share : {0.001, 0.3, 0.999}) {
      const double theta = from + share * (to - from);
      EXPECT_NEAR(places(mapping, Vec3(std::cos(theta), std::sin(theta), 0.2))[0].uv.x(), share, 1e-12);
    }
  }
}

TEST(Rows, Y2ErratumCHoldsForAnySurfaceThatClimbsAroundTheAxis) {
  // A plane z = a x is z = a r cos theta: at a given r theta changes by -1 / (a y) per height. The unit is a whole
  // turn.
  const FeatureMapping mapping = round_mapping(IntermediateSurface::cylinder, 0.02);
  constexpr double slope = 0.7;
  for (const auto& [x, y] : {std::pair{0.03, 0.02}, {-0.01, 0.015}, {0.02, -0.04}}) {
    const Vec3 point(x, y, slope * x);
    const MappedPlace once = places(mapping, point)[0];
    MappedPlace twice = once;
    mapping.count_angle_twice(point, Vec3(-slope, 0.0, 1.0).normalized(), twice);
    const double unit = 2.0 * pi * 0.02;
    EXPECT_LT((twice.du - once.du - Vec3(0.0, 0.0, -0.02 / (slope * y) * unit / std::hypot(x, y))).norm(), 1e-12);
  }
  // What turns about the axis, and a plane across it, climb nowhere.
  for (const Vec3& normal : {Vec3(0.6, 0.0, 0.8), Vec3(1.0, 0.0, 0.0), Vec3(0.0, 0.0, 1.0)}) {
    const Vec3 point(0.03, 0.0, 0.01);
    MappedPlace place = places(mapping, point)[0];
    const Vec3 before = place.du;
    mapping.count_angle_twice(point, normal, place);
    EXPECT_EQ(place.du, before);
  }
}

TEST(Rows, Y6TheVaseSpacesItsGratingByItsRadius) {
  // Ribs around the axis of a vase: as many at the neck as at the bottom, so their distance follows the radius.
  const FeatureMapping mapping = round_mapping(IntermediateSurface::cylinder, 0.03);
  const SurfaceFeature ribs = grating(0.25e-3, 2.0 * pi * 0.03 / 42.0);
  const auto local_wavelength = [&](double radius) {
    const MappedPlaces there = places(mapping, Vec3(radius, 0.0, 0.02));
    return ribs.wavelength() / (ribs.across(there[0].uv).x() * there[0].du).norm();
  };
  EXPECT_NEAR(local_wavelength(0.03) / local_wavelength(0.01), 3.0, 1e-12);
  EXPECT_NEAR(local_wavelength(0.03), 4.5e-3, 0.02e-3);
  EXPECT_NEAR(local_wavelength(0.01), 1.5e-3, 0.01e-3);
}

// ---- gradients -----------------------------------------------------------------------------------------------------

RC_GTEST_PROP(FeatureMappingProperty, GradientsAreDerivatives, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const FeatureMappingSettings settings = random_settings(surfaces[rng.below(4)], rng);
  const FeatureMapping mapping = mapping_of(settings);
  const Vec3 point = settings.origin + random_vector(rng, 0.1);
  const Vec3 from_axis = (point - settings.origin).cross(settings.axis);
  RC_PRE(from_axis.norm() > 1e-3);
  const MappedPlaces here = places(mapping, point);
  const double size = mapping.circumference() > 0.0 ? settings.radius / from_axis.norm() : 1.0;
  constexpr double step = 1e-8;
  for (int k = 0; k < 3; ++k) {
    const Vec3 aside = step * Vec3::Unit(k);
    const MappedPlaces before = places(mapping, point - aside);
    const MappedPlaces after = places(mapping, point + aside);
    // Elsewhere a plane of the box comes into play, or u comes back to where it started.
    RC_PRE(before.size() == here.size() && after.size() == here.size());
    for (std::size_t i = 0; i < here.size(); ++i) {
      const Vec2 difference = (after[i].uv - before[i].uv) / (2.0 * step);
      RC_PRE(difference.norm() < 1e6);
      RC_ASSERT(std::abs(difference.x() - here[i].du[k]) < 1e-6 * (1.0 + size));
      RC_ASSERT(std::abs(difference.y() - here[i].dv[k]) < 1e-6 * (1.0 + size));
      const double weight = (after[i].weight - before[i].weight) / (2.0 * step);
      // Weights change over the box, or over the distance to its middle: per metre by up to hundreds.
      const double scale = 1.0 / (point - settings.origin).norm() + 1.0 / settings.half_extent.minCoeff();
      RC_ASSERT(std::abs(weight - here[i].dweight[k]) < 1e-6 * scale);
    }
  }
}

RC_GTEST_PROP(FeatureMappingProperty, WeightsSumToOneAndTheirGradientsToNothing, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const FeatureMappingSettings settings = random_settings(surfaces[rng.below(4)], rng);
  const MappedPlaces here = places(mapping_of(settings), settings.origin + random_vector(rng, 0.1));
  RC_ASSERT(here.size() >= 1U);
  double sum = 0.0;
  Vec3 gradient = Vec3::Zero();
  for (const MappedPlace& place : here) {
    RC_ASSERT(place.weight > 0.0);
    sum += place.weight;
    gradient += place.dweight;
  }
  RC_ASSERT(std::abs(sum - 1.0) < 1e-12);
  RC_ASSERT(gradient.norm() < 1e-9);
}

TEST(FeatureMapping, NothingJumpsAroundABox) {
  FeatureMappingSettings settings;
  settings.surface = IntermediateSurface::box;
  settings.half_extent = Vec3(0.03, 0.02, 0.01);
  const FeatureMapping mapping = mapping_of(settings);
  FeatureSpec spec;
  spec.kind = FeatureKind::grid;
  spec.amplitude = 1e-3;
  spec.wavelength = Vec2(5e-3, 7e-3);
  const SurfaceFeature feature = feature_of(spec);
  // Around the box along three circles, over all its edges.
  for (int axis = 0; axis < 3; ++axis) {
    constexpr int steps = 60'000;
    const auto point = [&](int i) {
      Vec3 on_circle = Vec3::Constant(0.004);
      on_circle[(axis + 1) % 3] = 0.02 * std::cos(2.0 * pi * i / steps);
      on_circle[(axis + 2) % 3] = 0.02 * std::sin(2.0 * pi * i / steps);
      return on_circle;
    };
    SpaceSample last = laid(mapping, feature, point(0));
    for (int i = 1; i <= steps; ++i) {
      const SpaceSample here = laid(mapping, feature, point(i));
      const Vec3 way = point(i) - point(i - 1);
      // The trapezoidal rule on the gradient: heights change by what it says and by nothing else.
      ASSERT_NEAR(here.height - last.height, 0.5 * (here.gradient + last.gradient).dot(way), 2e-9);
      ASSERT_LT((here.gradient - last.gradient).norm(), 0.02);
      last = here;
    }
  }
}

// ---- places --------------------------------------------------------------------------------------------------------

TEST(FeatureMapping, UnrollsACylinderInItsOwnFrame) {
  FeatureMappingSettings settings;
  settings.surface = IntermediateSurface::cylinder;
  settings.origin = Vec3(0.1, 0.2, 0.3);
  settings.axis = Vec3::UnitX();
  settings.reference = Vec3::UnitY();
  settings.radius = 0.05;
  const FeatureMapping mapping = mapping_of(settings);
  // A quarter around from y towards z, twice as far out as the cylinder: half the gradient.
  const MappedPlaces quarter = places(mapping, settings.origin + Vec3(0.04, 0.0, 0.1));
  ASSERT_EQ(quarter.size(), 1U);
  EXPECT_NEAR(quarter[0].uv.x(), 0.05 * pi / 2.0, 1e-15);
  EXPECT_NEAR(quarter[0].uv.y(), 0.04, 1e-15);
  EXPECT_LT((quarter[0].du - Vec3(0.0, -0.5, 0.0)).norm(), 1e-12);
  EXPECT_EQ(quarter[0].dv, Vec3::UnitX());
  EXPECT_NEAR(mapping.circumference(), 0.1 * pi, 1e-15);
}

TEST(FeatureMapping, HasNoGradientOnTheAxis) {
  for (const auto surface : {IntermediateSurface::cylinder, IntermediateSurface::sphere}) {
    const MappedPlaces here = places(round_mapping(surface, 0.05), Vec3(0.0, 0.0, 0.02));
    ASSERT_EQ(here.size(), 1U);
    EXPECT_EQ(here[0].du, Vec3(0.0, 0.0, 0.0));
    EXPECT_TRUE(here[0].uv.allFinite() && here[0].dv.allFinite());
  }
  EXPECT_EQ(places(round_mapping(IntermediateSurface::sphere, 0.05), Vec3(0.0, 0.0, 0.02))[0].dv, Vec3(0.0, 0.0, 0.0));
  FeatureMappingSettings settings;
  settings.surface = IntermediateSurface::box;
  settings.half_extent = Vec3::Constant(0.01);
  const MappedPlaces middle = places(mapping_of(settings), Vec3::Zero());
  ASSERT_EQ(middle.size(), 1U);
  EXPECT_EQ(middle[0].weight, 1.0);
}

TEST(FeatureMapping, OnASphereLengthsAreTheSpheresOwn) {
  const FeatureMapping mapping = round_mapping(IntermediateSurface::sphere, 0.05);
  const double latitude = 0.6;
  const Vec3 point = 0.05 * Vec3(std::cos(latitude), 0.0, std::sin(latitude));
  const MappedPlaces here = places(mapping, point);
  EXPECT_NEAR(here[0].uv.y(), 0.05 * latitude, 1e-15);
  EXPECT_NEAR(here[0].du.norm(), 1.0 / std::cos(latitude), 1e-12);
  EXPECT_NEAR(here[0].dv.norm(), 1.0, 1e-12);
  EXPECT_NEAR(here[0].du.dot(here[0].dv), 0.0, 1e-12);
  EXPECT_NEAR(here[0].dv.dot(point), 0.0, 1e-12);
}

TEST(FeatureMapping, FacesOfABoxKeepTheirOwnEdges) {
  FeatureMappingSettings settings;
  settings.surface = IntermediateSurface::box;
  settings.half_extent = Vec3(0.03, 0.02, 0.01);
  const FeatureMapping mapping = mapping_of(settings);
  for (int axis = 0; axis < 3; ++axis) {
    Vec3 point = 0.2 * settings.half_extent;
    point[axis] = settings.half_extent[axis];
    const MappedPlaces here = places(mapping, point);
    ASSERT_EQ(here.size(), 1U);
    EXPECT_EQ(here[0].uv, Vec2(point[(axis + 1) % 3], point[(axis + 2) % 3]));
    EXPECT_EQ(here[0].du, Vec3(Vec3::Unit((axis + 1) % 3)));
    EXPECT_EQ(here[0].dv, Vec3(Vec3::Unit((axis + 2) % 3)));
    EXPECT_EQ(here[0].dweight, Vec3(0.0, 0.0, 0.0));
  }
}

TEST(FeatureMapping, OnAMeshGoesByItsTextureCoordinates) {
  MeshSource source;
  source.positions = {Vec3(0.0, 0.0, 0.0), Vec3(0.1, 0.0, 0.02), Vec3(0.0, 0.1, 0.05)};
  source.triangles = {{0, 1, 2}};
  source.corner_uvs = {{Vec2f(0.25F, 0.0F), Vec2f(1.0F, 0.5F), Vec2f(0.0F, 2.0F)}};
  auto mesh = TriangleMesh::build(std::move(source));
  ASSERT_TRUE(mesh.ok());
  FeatureMappingSettings settings;
  settings.surface = IntermediateSurface::uv;
  settings.tile = Vec2(0.02, 0.03);
  const FeatureMapping mapping = mapping_of(settings);
  const auto [a, b, c] = mesh->corners(0);
  for (const Vec3& weights : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(0.2, 0.3, 0.5)}) {
    const Vec3 point = weights[0] * a + weights[1] * b + weights[2] * c;
    const Vec3 normal = (b - a).cross(c - a).normalized();
    // Where the point lies over the plane does not count.
    const MappedPlace place = mapping.on_mesh(*mesh, 0, point + 0.01 * normal);
    EXPECT_NEAR(place.uv.x(), 0.02 * (0.25 * weights[0] + weights[1]), 1e-12);
    EXPECT_NEAR(place.uv.y(), 0.03 * (0.5 * weights[1] + 2.0 * weights[2]), 1e-12);
    EXPECT_NEAR(place.du.dot(b - a), 0.02 * 0.75, 1e-12);
    EXPECT_NEAR(place.du.dot(c - a), -0.02 * 0.25, 1e-12);
    EXPECT_NEAR(place.dv.dot(b - a), 0.03 * 0.5, 1e-12);
    EXPECT_NEAR(place.dv.dot(c - a), 0.03 * 2.0, 1e-12);
    EXPECT_NEAR(place.du.dot(normal), 0.0, 1e-12);
  }
  MeshSource bare = icosphere(0, 0.05);
  bare.corner_uvs.clear();
  const auto without = TriangleMesh::build(std::move(bare));
  ASSERT_TRUE(without.ok());
  EXPECT_EQ(mapping.on_mesh(*without, 0, Vec3::Zero()).du, Vec3(0.0, 0.0, 0.0));
}

// ---- what fits around ----------------------------------------------------------------------------------------------

/// By how much a feature misses itself after one way around.
double seam_miss(const FeatureMapping& mapping, const SurfaceFeature& feature) {
  double most = 0.0;
  for (int i = 0; i < 200; ++i) {
    const Vec2 place(0.41e-3 * i, 0.37e-3 * i - 0.03);
    const Vec2 again = place + Vec2(mapping.circumference(), 0.0);
    most = std::max(most, std::abs(feature.sample(again).height - feature.sample(place).height));
  }
  return most;
}

FeatureSpec random_spec(Rng& rng) {
  static const FeatureKind kinds[] = {FeatureKind::grating,  FeatureKind::grid,  FeatureKind::triangular,
                                      FeatureKind::serrated, FeatureKind::noise, FeatureKind::map};
  FeatureSpec spec;
  spec.kind = kinds[rng.below(6)];
  spec.amplitude = 1e-4;
  spec.wavelength = Vec2(rng.uniform(1e-3, 5e-3), rng.uniform(1e-3, 5e-3));
  spec.direction = rng.below(2) == 0 ? 0.0 : rng.uniform(0.1, 1.4);
  spec.roughness = 1e-4;
  spec.correlation_length = 1e-3;
  spec.period = Vec2(rng.uniform(0.01, 0.05), 0.02);
  std::vector<float> heights;
  for (int i = 0; i < 35; ++i) heights.push_back(static_cast<float>(rng.uniform(-1e-4, 1e-4)));
  spec.heights = std::make_shared<const HeightMap>(
      HeightMap::build(std::move(heights), 7, 5, Wrap::repeat, Reconstruction::quadratic_bspline).value());
  return spec;
}

RC_GTEST_PROP(FeatureMappingProperty, WhatIsRefusedDoesNotCloseAndWhatIsProposedDoes, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const auto surface = rng.below(2) == 0 ? IntermediateSurface::cylinder : IntermediateSurface::sphere;
  const FeatureMapping mapping = round_mapping(surface, rng.uniform(0.02, 0.06));
  FeatureSpec spec = random_spec(rng);
  // Follows the messages until there is none: one for each member.
  for (int i = 0; i < 4; ++i) {
    const SurfaceFeature feature = feature_of(spec);
    const Status checked = mapping.check(feature);
    if (checked) {
      RC_ASSERT(seam_miss(mapping, feature) < 1e-2 * 1e-4);
      return;
    }
    RC_ASSERT(checked.error().code == ErrorCode::mismatch);
    RC_ASSERT(seam_miss(mapping, feature) > 1e-6 * 1e-4);
    const double proposed = std::strtod(checked.error().accepted.c_str(), nullptr);
    RC_ASSERT(proposed > 0.0);
    const bool second = checked.error().accepted.find("second") != std::string::npos;
    if (spec.kind == FeatureKind::noise) {
      spec.period.x() = proposed;
    } else {
      spec.wavelength[second ? 1 : 0] = proposed;
    }
  }
  RC_FAIL("the messages lead nowhere");
}

TEST(FeatureMapping, ChecksWholeWavelengthsAround) {
  const FeatureMapping cylinder = round_mapping(IntermediateSurface::cylinder, 0.01);
  const Status refused = cylinder.check(grating(1e-4, 1e-3));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().place, "wavelength");
  // 62.83 wavelengths: 62 or 63 would do.
  EXPECT_NE(refused.error().accepted.find("0.00101341699 m or 0.000997331001 m"), std::string::npos)
      << refused.error().accepted;
  EXPECT_TRUE(cylinder.check(grating(1e-4, 0.02 * pi / 63.0)).ok());
  // Rings around the cylinder meet themselves whatever their wavelength, to rounding.
  EXPECT_TRUE(cylinder.check(grating(1e-4, 1e-3, pi / 2.0)).ok());
  EXPECT_TRUE(cylinder.check(grating(1e-4, 1e-3, -pi / 2.0)).ok());
  // A thread: so many starts.
  EXPECT_TRUE(cylinder.check(grating(1e-4, 0.02 * pi * std::cos(1.2) / 3.0, 1.2)).ok());
  EXPECT_FALSE(cylinder.check(grating(1e-4, 0.02 * pi * std::cos(1.2) / 3.5, 1.2)).ok());
  // Longer than once around.
  EXPECT_FALSE(cylinder.check(grating(1e-4, 1.0)).ok());
}

TEST(FeatureMapping, ChecksEveryKindOfFeature) {
  const FeatureMapping cylinder = round_mapping(IntermediateSurface::cylinder, 0.01);
  const double around = 0.02 * pi;
  FeatureSpec spec;
  spec.amplitude = 1e-4;
  spec.kind = FeatureKind::circular_grating;
  spec.wavelength = Vec2(around / 20.0, 0.0);
  const Status circles = cylinder.check(feature_of(spec));
  ASSERT_FALSE(circles.ok());
  EXPECT_EQ(circles.error().place, "kind");
  // A grid turned by 45 degrees may be half a cell off along both of its axes.
  spec.kind = FeatureKind::grid;
  spec.direction = pi / 4.0;
  spec.wavelength = Vec2::Constant(around * std::sqrt(0.5) / 10.5);
  EXPECT_TRUE(cylinder.check(feature_of(spec)).ok());
  EXPECT_LT(seam_miss(cylinder, feature_of(spec)), 1e-12);
  spec.wavelength.y() = around * std::sqrt(0.5) / 10.0;
  EXPECT_FALSE(cylinder.check(feature_of(spec)).ok());
  // Whole sums do not make whole differences.
  spec.wavelength = around * std::sqrt(0.5) * Vec2(1.0 / 10.3, 1.0 / 10.7);
  EXPECT_FALSE(cylinder.check(feature_of(spec)).ok());
  EXPECT_GT(seam_miss(cylinder, feature_of(spec)), 1e-5);
  spec.kind = FeatureKind::map;
  spec.direction = 0.0;
  spec.wavelength = Vec2(around, around);
  spec.heights = std::make_shared<const HeightMap>(
      HeightMap::build(std::vector<float>(16, 1e-4F), 4, 4, Wrap::clamp, Reconstruction::bilinear).value());
  const Status clamped = cylinder.check(feature_of(spec));
  ASSERT_FALSE(clamped.ok());
  EXPECT_EQ(clamped.error().place, "heights");
  // Where nothing comes back everything goes.
  FeatureMappingSettings box;
  box.surface = IntermediateSurface::box;
  box.half_extent = Vec3::Constant(0.1);
  EXPECT_TRUE(mapping_of(box).check(feature_of(spec)).ok());
  EXPECT_EQ(mapping_of(box).circumference(), 0.0);
}

// ---- bad input -----------------------------------------------------------------------------------------------------

TEST(FeatureMapping, RefusesEachMemberByName) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  struct Case {
    IntermediateSurface surface;
    std::function<void(FeatureMappingSettings&)> spoil;
    const char* place;
  };
  const Case cases[] = {
      {IntermediateSurface::plane, [=](auto& s) { s.origin.y() = nan; }, "origin"},
      {IntermediateSurface::plane, [](auto& s) { s.origin.y() = 1e9; }, "origin"},
      {IntermediateSurface::plane, [](auto& s) { s.axis *= 2.0; }, "axis"},
      {IntermediateSurface::box, [=](auto& s) { s.axis.x() = nan; }, "axis"},
      {IntermediateSurface::sphere, [](auto& s) { s.reference = Vec3::Zero(); }, "reference"},
      {IntermediateSurface::cylinder, [](auto& s) { s.reference = Vec3(0.6, 0.0, 0.8); }, "reference"},
      {IntermediateSurface::cylinder, [](auto& s) { s.radius = 0.0; }, "radius"},
      {IntermediateSurface::sphere, [=](auto& s) { s.radius = nan; }, "radius"},
      {IntermediateSurface::sphere, [](auto& s) { s.radius = infinity; }, "radius"},
      {IntermediateSurface::cylinder, [](auto& s) { s.range = Vec2(0.5, 0.5); }, "range"},
      {IntermediateSurface::cylinder, [](auto& s) { s.range = Vec2(0.0, 6.3); }, "range"},
      {IntermediateSurface::sphere, [](auto& s) { s.range = Vec2(6.3, 7.0); }, "range"},
      {IntermediateSurface::sphere, [=](auto& s) { s.range = Vec2(0.0, nan); }, "range"},
      {IntermediateSurface::box, [](auto& s) { s.half_extent.z() = -1.0; }, "half_extent"},
      {IntermediateSurface::uv, [](auto& s) { s.tile.y() = 0.0; }, "tile"},
      {IntermediateSurface::uv, [=](auto& s) { s.tile.x() = nan; }, "tile"},
  };
  for (const Case& bad : cases) {
    FeatureMappingSettings settings;
    settings.surface = bad.surface;
    settings.radius = 0.05;
    settings.half_extent = Vec3::Constant(0.05);
    ASSERT_TRUE(FeatureMapping::build(settings).ok());
    bad.spoil(settings);
    const auto mapping = FeatureMapping::build(settings);
    ASSERT_FALSE(mapping.ok()) << bad.place;
    EXPECT_EQ(mapping.error().place, bad.place);
    EXPECT_EQ(mapping.error().code, ErrorCode::bad_value);
    EXPECT_FALSE(mapping.error().accepted.empty());
  }
}

}  // namespace
}  // namespace asperity::feature_mapping_test
