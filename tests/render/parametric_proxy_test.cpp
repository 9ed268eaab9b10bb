// The proxy law on parametric surfaces.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "asperity/core/rng.h"
#include "asperity/render/step.h"

namespace asperity::test::parametric_proxy_test {
namespace {

constexpr double pi = std::numbers::pi;

SurfaceFeature grating(double amplitude, double wavelength, double direction, FeatureKind kind = FeatureKind::grating) {
  FeatureSpec spec;
  spec.kind = kind;
  spec.amplitude = amplitude;
  spec.wavelength = Vec2(wavelength, 0.0);
  spec.direction = direction;
  return SurfaceFeature::build(spec).value();
}

std::shared_ptr<const ParametricSurface> shared(const ParametricSettings& settings) {
  return std::make_shared<const ParametricSurface>(ParametricSurface::build(settings).value());
}

ParametricSettings of_shape(ParametricShape shape) {
  ParametricSettings settings;
  settings.shape = shape;
  return settings;
}

/// A torus with 40 waves around the axis and 8 around the tube.
ParametricSettings wavy_torus() {
  ParametricSettings settings = of_shape(ParametricShape::torus);
  settings.tile = Vec2(0.03, 0.01);
  settings.features = {grating(0.0001, 2.0 * pi * 0.03 / 40.0, 0.0), grating(0.0002, 2.0 * pi * 0.01 / 8.0, 0.5 * pi)};
  return settings;
}

Instance instance_of(const ParametricSettings& settings, Sides sides = Sides::both, double still = 0.0,
                     double sliding = 0.0) {
  Instance instance;
  instance.name = "formula";
  instance.surface = shared(settings);
  instance.sides = sides;
  instance.material.static_friction = still;
  instance.material.dynamic_friction = sliding;
  return instance;
}

Scene scene_of(Instance instance, double radius = 0.0) {
  return Scene::build({std::move(instance)}, radius).value();
}

ForceSample touch(const Scene& scene, ProxyState& state, const Vec3& position, double dt = 1e-3) {
  ProbeSample probe;
  probe.pose.position = position;
  return step(scene, state, probe, Seconds(dt));
}

Vec3 random_direction(Rng& rng) {
  for (;;) {
    const Vec3 v(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0));
    if (v.norm() < 1.0 && v.norm() > 1e-3) return v.normalized();
  }
}

TEST(ParametricProxy, SphereForceIsThatOfASpringAlongTheRadius) {
  const Scene scene = scene_of(instance_of(of_shape(ParametricShape::sphere), Sides::front));
  ProxyState state;
  touch(scene, state, Vec3(0.01, 0.0, 0.04));
  const double stiffness = scene.instances()[0].material.stiffness;
  for (int i = 0; i < 4000; ++i) {
    const double a = 0.002 * i;
    const Vec3 p = 0.029 * Vec3(std::sin(a) * std::cos(0.3 * a), std::sin(a) * std::sin(0.3 * a), std::cos(a));
    const ForceSample out = touch(scene, state, p);
    ASSERT_TRUE(out.flags.has(TickFlag::contact));
    ASSERT_FALSE(unfinished(out.flags));
    ASSERT_LT((out.wrench.force - stiffness * 0.001 * p.normalized()).norm(), 1e-8 * stiffness) << i;
    ASSERT_NE(out.contact.element, no_index);
  }
}

/// Force along a path at steps s and s / 10: changes fall alike.
double largest_change(const Scene& scene, const Vec3& outside, const auto& at, double length, double stride) {
  ProxyState state;
  touch(scene, state, outside);
  double worst = 0.0;
  Vec3 last = touch(scene, state, at(0.0)).wrench.force;
  for (double arc = stride; arc < length; arc += stride) {
    const ForceSample out = touch(scene, state, at(arc));
    EXPECT_TRUE(out.flags.has(TickFlag::contact));
    worst = std::max(worst, (out.wrench.force - last).norm());
    last = out.wrench.force;
  }
  return worst;
}

TEST(ParametricProxy, T2_seamsAndPolesAreNotFelt) {
  const Scene sphere = scene_of(instance_of(of_shape(ParametricShape::sphere), Sides::front));
  // Right over the pole, past it by a hair, and over the seam at u = 0.
  for (const double past : {0.0, 1e-9, 1e-5}) {
    const auto over_pole = [&](double arc) {
      const double a = (arc - 0.002) / 0.03;
      return Vec3(0.029 * std::sin(a), past, 0.029 * std::cos(a));
    };
    const double coarse = largest_change(sphere, Vec3(over_pole(0.0) * 1.2), over_pole, 0.004, 1e-5);
    const double fine = largest_change(sphere, Vec3(over_pole(0.0) * 1.2), over_pole, 0.004, 1e-6);
    EXPECT_NEAR(coarse / fine, 10.0, 1.0) << past;
  }
  const Scene torus = scene_of(instance_of(wavy_torus(), Sides::front));
  const auto around = [](double arc) {
    const double a = (arc - 0.003) / 0.04;
    const double b = (arc - 0.003) / 0.01;
    const double rho = 0.03 + 0.0094 * std::cos(b);
    return Vec3(rho * std::cos(a), rho * std::sin(a), 0.0094 * std::sin(b));
  };
  const double coarse = largest_change(torus, Vec3(around(0.0) * 1.2), around, 0.006, 1e-5);
  const double fine = largest_change(torus, Vec3(around(0.0) * 1.2), around, 0.006, 1e-6);
  EXPECT_NEAR(coarse / fine, 10.0, 1.5);
}

TEST(ParametricProxy, T1_frictionless_loops_do_no_work) {
  const ParametricSettings vase = of_shape(ParametricShape::vase);
  for (const ParametricSettings& settings : {wavy_torus(), vase}) {
    const bool torus = settings.shape == ParametricShape::torus;
    const Scene scene = scene_of(instance_of(settings));
    const double stiffness = scene.instances()[0].material.stiffness;
    for (int loop = 0; loop < 3; ++loop) {
      // Around on the outside, across the seams.
      const auto at = [&](double t) -> Vec3 {
        const double a = 2.0 * pi * t;
        const double u = 0.7 * std::sin(a);
        const double depth = 0.0006 + 0.0003 * std::cos(2.0 * a + loop);
        if (torus) {
          const double v = 0.9 * std::sin(a + 1.0 + loop);
          const double rho = 0.03 + (0.01 - depth) * std::cos(v);
          return {rho * std::cos(u), rho * std::sin(u), (0.01 - depth) * std::sin(v)};
        }
        const double z = 0.03 + 0.01 * std::sin(a + 1.0 + loop);
        return {(0.0295 - depth) * std::cos(u), (0.0295 - depth) * std::sin(u), z};
      };
      ProxyState state;
      touch(scene, state, Vec3(at(0.0) * 1.5));
      Vec3 place = at(0.0);
      Vec3 force = touch(scene, state, place).wrench.force;
      const int ticks = 40000;
      double work = 0.0;
      double way = 0.0;
      double touched = 0.0;
      for (int i = 1; i <= ticks; ++i) {
        const Vec3 next = at(static_cast<double>(i) / ticks);
        const ForceSample out = touch(scene, state, next);
        touched += out.flags.has(TickFlag::contact) ? 1.0 : 0.0;
        work += 0.5 * (force + out.wrench.force).dot(next - place);
        way += (next - place).norm();
        place = next;
        force = out.wrench.force;
      }
      EXPECT_GT(touched, 0.7 * ticks);
      // 1e-6 k A with A what a path of this length can enclose.
      EXPECT_LT(std::abs(work), 1e-6 * stiffness * way * way / (4.0 * pi)) << torus << " " << loop;
    }
  }
}

TEST(ParametricProxy, SpringNeverGainsAtAHeldProbe) {
  Rng rng(3);
  for (const double friction : {0.0, 0.4}) {
    const Scene scene = scene_of(instance_of(wavy_torus(), Sides::both, friction, 0.7 * friction));
    ProxyState state;
    Vec3 p(0.03, 0.0, 0.02);
    int contacts = 0;
    for (int i = 0; i < 6000; ++i) {
      p += 0.0006 * rng.uniform() * random_direction(rng);
      if (i % 50 == 0) {
        const double u = rng.uniform(-pi, pi);
        p = Vec3(0.034 * std::cos(u), 0.034 * std::sin(u), rng.uniform(-0.009, 0.009));
      }
      const Vec3 before = state.proxy;
      const ForceSample out = touch(scene, state, p);
      contacts += out.flags.has(TickFlag::contact) ? 1 : 0;
      ASSERT_FALSE(out.flags.has(TickFlag::energy_limited)) << i;
      if (i > 0) {
        ASSERT_LE((state.proxy - p).norm(), (before - p).norm() * (1.0 + 1e-9) + 1e-15) << i;
      }
    }
    EXPECT_GT(contacts, 400);
  }
}

/// Whether a point is inside of a torus with features.
bool inside(const ParametricSurface& surface, const Vec3& p) {
  return surface.view().eval(p).value < 0.0;
}

TEST(ParametricProxy, T5_no_speed_passes_a_closed_surface) {
  Rng rng(5);
  const ParametricSettings settings = wavy_torus();
  const Scene scene = scene_of(instance_of(settings, Sides::both, 0.2, 0.15));
  const ParametricSurface& surface = *parametric_of(scene.instances()[0].surface);
  int pressed = 0;
  for (int run = 0; run < 24; ++run) {
    ProxyState state;
    Vec3 p = run % 2 == 0 ? Vec3(0.03, 0.0, 0.001) : Vec3(0.0, 0.0, 0.0);
    touch(scene, state, p);
    const bool start = inside(surface, p);
    const double speed = std::pow(10.0, -2.0 + 3.3 * run / 23.0);  // 0.01 to 20 m/s
    for (int i = 0; i < 300; ++i) {
      p += speed * 1e-3 * random_direction(rng);
      p = p.cwiseMax(-0.045).cwiseMin(0.045);
      const ForceSample out = touch(scene, state, p);
      if (out.flags.has(TickFlag::contact)) {
        ++pressed;
        ASSERT_EQ(state.contacts[0].first().back, start) << run << " " << i;
      } else if (i % 5 == 0) {
        ASSERT_EQ(inside(surface, state.proxy), start) << run << " " << i << " speed " << speed;
      }
    }
  }
  EXPECT_GT(pressed, 1000);
}

TEST(ParametricProxy, RidgesWithEdgesHoldAndLetSlideAlong) {
  ParametricSettings settings;
  settings.features = {grating(0.001, 0.008, 0.0, FeatureKind::triangular)};
  const Scene scene = scene_of(instance_of(settings));
  Rng rng(7);
  ProxyState state;
  Vec3 p(0.0, 0.0, 0.005);
  touch(scene, state, p);
  for (int i = 0; i < 3000; ++i) {
    p += 0.0005 * random_direction(rng);
    p = p.cwiseMax(Vec3(-0.03, -0.03, -0.004)).cwiseMin(Vec3(0.03, 0.03, 0.003));
    const ForceSample out = touch(scene, state, p);
    const Vec2 uv(state.proxy.x() + 0.05, state.proxy.y() + 0.05);
    ASSERT_GE(state.proxy.z(), settings.features[0].sample(uv).height - 1e-8) << i;
    if (out.flags.has(TickFlag::contact)) {
      // Along the ridges nothing holds it.
      ASSERT_NEAR(out.wrench.force.y(), 0.0, 2e-3 * out.wrench.force.norm() + 1e-3) << i;
    }
  }
}

TEST(ParametricProxy, T5_no_speed_passes_steep_ridges) {
  // Flanks of 79 degrees: valleys narrower than a right angle.
  ParametricSettings settings;
  FeatureSpec spec;
  spec.kind = FeatureKind::serrated;
  spec.amplitude = 0.001;
  spec.wavelength = Vec2(0.004, 0.0);
  spec.wall = 0.1;
  spec.direction = 0.3;
  settings.features = {SurfaceFeature::build(spec).value()};
  Rng rng(11);
  int pressed = 0;
  for (int run = 0; run < 12; ++run) {
    const double friction = run % 2 == 0 ? 0.0 : 0.3;
    const Scene scene = scene_of(instance_of(settings, Sides::both, friction, 0.8 * friction));
    const double speed = std::pow(10.0, -2.0 + 3.3 * run / 11.0);
    ProxyState state;
    Vec3 p(0.0, 0.0, 0.005);
    touch(scene, state, p);
    for (int i = 0; i < 400; ++i) {
      p += speed * 1e-3 * random_direction(rng);
      p = p.cwiseMax(Vec3(-0.03, -0.03, -0.004)).cwiseMin(Vec3(0.03, 0.03, 0.003));
      pressed += touch(scene, state, p).flags.has(TickFlag::contact) ? 1 : 0;
      const Vec2 uv(state.proxy.x() + 0.05, state.proxy.y() + 0.05);
      ASSERT_GE(state.proxy.z(), settings.features[0].sample(uv).height - 1e-8) << run << " " << i;
    }
  }
  EXPECT_GT(pressed, 1000);
}

TEST(ParametricProxy, FrictionHoldsWithinTheConeAndSlidesOnIt) {
  const Scene flat = scene_of(instance_of(of_shape(ParametricShape::plane), Sides::both, 0.5, 0.3));
  ProxyState state;
  touch(flat, state, Vec3(0.0, 0.0, 0.001));
  touch(flat, state, Vec3(0.0, 0.0, -0.001));
  EXPECT_NEAR(touch(flat, state, Vec3(0.00049, 0.0, -0.001)).wrench.force.x(), -0.49, 1e-6);
  const ForceSample slid = touch(flat, state, Vec3(0.00055, 0.0, -0.001));
  EXPECT_NEAR(slid.wrench.force.x(), -0.3, 1e-6);
  EXPECT_NEAR(slid.wrench.force.z(), 1.0, 1e-6);
  // Anywhere on a bent surface the force stays within the cone.
  const Scene bent = scene_of(instance_of(wavy_torus(), Sides::front, 0.5, 0.3));
  Rng rng(9);
  ProxyState other;
  Vec3 p(0.045, 0.0, 0.0);
  touch(bent, other, p);
  int sliding = 0;
  p = Vec3(0.0395, 0.0, 0.0);
  for (int i = 0; i < 4000; ++i) {
    const double u = 0.5 * std::sin(0.003 * i);
    const double v = 0.7 * std::sin(0.0047 * i);
    const double rho = 0.03 + 0.0093 * std::cos(v);
    p = Vec3(rho * std::cos(u), rho * std::sin(u), 0.0093 * std::sin(v)) + 2e-5 * random_direction(rng);
    const ForceSample out = touch(bent, other, p);
    ASSERT_TRUE(out.flags.has(TickFlag::contact));
    const double push = out.wrench.force.dot(out.contact.normal);
    const double along = (out.wrench.force - push * out.contact.normal).norm();
    ASSERT_LE(along, (other.contacts[0].surface.sliding ? 0.3 : 0.5) * push * (1.0 + 1e-9) + 1e-12) << i;
    sliding += other.contacts[0].surface.sliding ? 1 : 0;
  }
  EXPECT_GT(sliding, 1000);
}

TEST(ParametricProxy, T3_a_scan_follows_the_grating_within_one_percent) {
  ParametricSettings settings;
  settings.features = {grating(0.0005, 0.005, 0.0)};
  const Scene scene = scene_of(instance_of(settings));
  ProxyState state;
  touch(scene, state, Vec3(-0.02, 0.0, 0.003));
  double square = 0.0;
  int count = 0;
  for (int i = 0; i < 8000; ++i) {
    const double x = -0.02 + 5e-6 * i;
    const double true_height = 0.0005 * std::cos(2.0 * pi * (x + 0.05) / 0.005);
    // The hand presses with about 1 N: it goes up and down with the surface.
    const ForceSample out = touch(scene, state, Vec3(x, 0.0, true_height - 0.0004));
    ASSERT_TRUE(out.flags.has(TickFlag::contact));
    const double there = 0.0005 * std::cos(2.0 * pi * (state.proxy.x() + 0.05) / 0.005);
    square += std::pow(state.proxy.z() - there, 2);
    EXPECT_NEAR(out.contact.height, there, 1e-9);
    ++count;
  }
  EXPECT_LT(std::sqrt(square / count), 0.01 * 0.0005);
}

TEST(ParametricProxy, AtAnOpenRimItEnds) {
  const Scene scene = scene_of(instance_of(of_shape(ParametricShape::plane)));
  ProxyState state;
  touch(scene, state, Vec3(0.0, 0.0, 0.001));
  ForceSample out;
  for (double x = 0.0; x < 0.0499; x += 1e-4) out = touch(scene, state, Vec3(x, 0.0, -0.001));
  EXPECT_NEAR(out.wrench.force.z(), 1.0, 1e-6);
  for (double x = 0.0499; x < 0.051; x += 1e-4) out = touch(scene, state, Vec3(x, 0.0, -0.001));
  EXPECT_FALSE(out.flags.has(TickFlag::contact));
}

TEST(ParametricProxy, BothSidesOrTheFrontAlone) {
  const Scene both = scene_of(instance_of(of_shape(ParametricShape::sphere)));
  ProxyState in;
  touch(both, in, Vec3(0.0, 0.0, 0.02));
  EXPECT_NEAR(touch(both, in, Vec3(0.0, 0.0, 0.031)).wrench.force.z(), -1.0, 1e-6);
  const Scene front = scene_of(instance_of(of_shape(ParametricShape::sphere), Sides::front));
  ProxyState leaving;
  touch(front, leaving, Vec3(0.0, 0.0, 0.02));
  EXPECT_TRUE(touch(front, leaving, Vec3(0.0, 0.0, 0.031)).wrench.force.isZero());
  EXPECT_NEAR(touch(front, leaving, Vec3(0.0, 0.0, 0.029)).wrench.force.z(), 1.0, 1e-6);
}

TEST(ParametricProxy, APoseMovesTheForceAlong) {
  Instance placed = instance_of(wavy_torus(), Sides::front, 0.3, 0.2);
  Instance plain = placed;
  placed.world_from_object.position = Vec3(0.2, -0.1, 0.3);
  placed.world_from_object.orientation = Quat(Eigen::AngleAxisd(0.8, Vec3(1.0, 2.0, -0.5).normalized()));
  const Pose pose = placed.world_from_object;
  const Scene here = scene_of(std::move(plain));
  const Scene there = scene_of(std::move(placed));
  ProxyState a;
  ProxyState b;
  touch(here, a, Vec3(0.05, 0.0, 0.0));
  touch(there, b, pose.apply(Vec3(0.05, 0.0, 0.0)));
  for (int i = 0; i < 500; ++i) {
    const double u = 0.002 * i;
    const Vec3 p(0.0392 * std::cos(u), 0.0392 * std::sin(u), 0.003 * std::sin(3.0 * u));
    const Vec3 first = touch(here, a, p).wrench.force;
    ASSERT_GT(first.norm(), 0.01);
    ASSERT_LT((pose.rotate(first) - touch(there, b, pose.apply(p)).wrench.force).norm(), 1e-6);
  }
}

TEST(ParametricProxy, ABallRestsAtItsRadiusAndIsNotPassed) {
  const double radius = 0.002;
  const Scene scene = scene_of(instance_of(of_shape(ParametricShape::vase)), radius);
  const ParametricSurface& surface = *parametric_of(scene.instances()[0].surface);
  ProxyState state;
  for (double x = 0.04; x > 0.026; x -= 0.001) touch(scene, state, Vec3(x, 0.0, 0.05));
  for (int i = 0; i < 300; ++i) {
    const double u = 0.004 * i;
    const double rho = surface.jet(Vec2(0.0, 0.05)).point.x() + radius - 0.001;
    const ForceSample out = touch(scene, state, Vec3(rho * std::cos(u), rho * std::sin(u), 0.05));
    ASSERT_TRUE(out.flags.has(TickFlag::contact)) << i;
    ASSERT_NEAR(surface.view().nearest(state.proxy, infinity).distance, radius, 5e-6) << i;
    ASSERT_GT(out.wrench.force.dot(Vec3(std::cos(u), std::sin(u), 0.0)), 0.5) << i;
  }
}

TEST(ParametricProxy, ABallLiesOnBothCrestsBesideAGroove) {
  ParametricSettings waves = of_shape(ParametricShape::plane);
  constexpr double wave = 1e-3;
  constexpr double height = 1e-4;
  waves.features = {grating(height, wave, 0.0)};
  const Instance ground = instance_of(waves, Sides::front);
  const ParametricSurface& surface = *parametric_of(ground.surface);
  // Its profile across the waves, finely: what a ball is off it, and where it lies between two crests.
  std::vector<Vec2> profile;
  for (double u = 0.4; u < 0.6; u += 1e-6 / surface.settings().width) {
    const Vec3 point = surface.jet(Vec2(u * surface.settings().width, 0.5 * surface.settings().depth)).point;
    profile.emplace_back(point.x(), point.z());
  }
  int held_by_several = 0;
  for (const double radius : {4e-4, 3e-3}) {
    const Scene scene = scene_of(ground, radius);
    ProxyState state;
    touch(scene, state, Vec3(0.0, 0.0, radius + 1e-3));
    for (int i = 0; i < 400; ++i) {
      const ForceSample felt = touch(scene, state, Vec3(5e-6 * i, 0.0, radius - 5e-4));
      ASSERT_FALSE(unfinished(felt.flags)) << radius << " " << i;
      ASSERT_TRUE(felt.flags.has(TickFlag::contact));
      double nearest = infinity;
      for (const Vec2& at : profile) nearest = std::min(nearest, (at - Vec2(state.proxy.x(), state.proxy.z())).norm());
      ASSERT_GT(nearest, radius - 1e-9) << radius << " " << i;
      ASSERT_LT(nearest, radius + 1e-8 + 10.0 * surface.skin() + 2e-4 * surface.grain()) << radius << " " << i;
      held_by_several += felt.contact.places.size() > 1 ? 1 : 0;
      ASSERT_LT((felt.proxy - Vec3(5e-6 * i, 0.0, radius)).norm(), wave) << radius << " " << i;
    }
  }
  EXPECT_GT(held_by_several, 200);
}

TEST(ParametricProxy, LawsWithoutAParametricFormAreRefused) {
  for (const Law& law : {Law(GodObjectLaw{}), Law(ForceShadingLaw{}), Law(MesostructureLaw{}), Law(AvilaLaw{}),
                         Law(MagneticLaw{}), Law(DenseMeshLaw{})}) {
    Instance instance = instance_of(of_shape(ParametricShape::plane));
    instance.law = law;
    const auto scene = Scene::build({std::move(instance)}, 0.0);
    ASSERT_FALSE(scene);
    EXPECT_EQ(scene.error().code, ErrorCode::unsupported_pair);
    EXPECT_NE(scene.error().message().find("a parametric surface"), std::string::npos) << scene.error().message();
  }
}

TEST(ParametricProxy, AChangedSceneTakesTheProbeOutOfTheFront) {
  const Scene small = scene_of(instance_of(of_shape(ParametricShape::sphere), Sides::front));
  ParametricSettings larger = of_shape(ParametricShape::sphere);
  larger.radius = 0.0305;
  const Scene large = scene_of(instance_of(larger, Sides::front));
  ProxyState state;
  touch(small, state, Vec3(0.0, 0.0, 0.04));
  touch(small, state, Vec3(0.0, 0.0, 0.029));
  const ForceSample out = touch(large, state, Vec3(0.0, 0.0, 0.029));
  EXPECT_TRUE(out.flags.has(TickFlag::contact));
  EXPECT_NEAR(state.proxy.z(), 0.0305, 1e-6);
}

}  // namespace
}  // namespace asperity::test::parametric_proxy_test
