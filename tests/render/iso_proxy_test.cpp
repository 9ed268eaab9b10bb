// The proxy law on isosurfaces.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "asperity/render/law_registry.h"
#include "asperity/render/step.h"
#include "tests/field/volumes.h"

namespace asperity::test::iso_proxy_test {
namespace {

constexpr double degrees = 57.29577951308232;

Instance iso_instance(std::shared_ptr<const ScalarField> field, double threshold, Inside inside = Inside::low,
                      Sides sides = Sides::both) {
  Instance instance;
  instance.name = "iso";
  instance.surface = std::make_shared<const IsoSurface>(IsoSurface::build(std::move(field), threshold, inside).value());
  instance.sides = sides;
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

/// A path over the sphere at `depth` below radius 0.03, `arc` (m) along it.
Vec3 over_sphere(double arc, double depth) {
  const double angle = arc / 0.03;
  const double turn = 0.37 * angle;
  return (0.03 - depth) * Vec3(std::sin(angle) * std::cos(turn), std::sin(angle) * std::sin(turn), std::cos(angle));
}

class IsoProxyEach : public ::testing::TestWithParam<CellReconstruction> {};
INSTANTIATE_TEST_SUITE_P(Both, IsoProxyEach,
                         ::testing::Values(CellReconstruction::trilinear, CellReconstruction::smooth));

TEST_P(IsoProxyEach, ForceOfASphereOf128CubedPointsWithinHalfADegree) {
  const Scene scene = scene_of(iso_instance(sphere_field(128, GetParam()), 0.03));
  ProxyState state;
  touch(scene, state, over_sphere(0.0, -0.002));
  double sum = 0.0;
  double worst = 0.0;
  double jump = 0.0;
  double off = 0.0;
  Vec3 last = Vec3::Zero();
  const int ticks = 40000;
  for (int i = 0; i < ticks; ++i) {
    const Vec3 p = over_sphere(5e-5 * i, 0.001);
    const ForceSample out = touch(scene, state, p);
    ASSERT_TRUE(out.flags.has(TickFlag::contact));
    ASSERT_FALSE(unfinished(out.flags));
    const double angle = std::acos(std::min(1.0, out.wrench.force.normalized().dot(p.normalized()))) * degrees;
    sum += angle;
    worst = std::max(worst, angle);
    off += std::pow(out.proxy.norm() - 0.03, 2);
    if (i > 0) jump = std::max(jump, (out.wrench.force - last).norm());
    last = out.wrench.force;
  }
  const bool smooth = GetParam() == CellReconstruction::smooth;
  RecordProperty("mean_degrees", std::to_string(sum / ticks));
  EXPECT_LT(sum / ticks, smooth ? 0.005 : 0.5);
  EXPECT_LT(worst, smooth ? 0.02 : 1.2);
  EXPECT_LT(std::sqrt(off / ticks), smooth ? 0.1e-6 : 4.5e-6);
  // Exact: 1 N turned by 50 um over 29 mm. Facets of a trilinear field turn it by their fold.
  EXPECT_LT(jump, smooth ? 1.1 * 1.0 * 5e-5 / 0.029 : 0.045);
}

TEST(IsoProxy, T2_force_is_continuous_over_cell_faces) {
  const auto f = [](const Vec3& p) { return std::sin(90.0 * p.x()) + std::cos(70.0 * p.y()) + 60.0 * p.z(); };
  const auto field = std::make_shared<const ScalarField>(sampled(cube_axes(0.05, 41, 0.4), f));
  const Scene scene = scene_of(iso_instance(field, 0.0));
  const auto largest_change = [&](double stride) {
    ProxyState state;
    const auto at = [&](double arc) { return Vec3(-0.03 + arc, 0.6 * arc - 0.01, -0.028 + 0.0 * arc); };
    touch(scene, state, Vec3(at(0.0).x(), at(0.0).y(), 0.049));
    double worst = 0.0;
    Vec3 last = touch(scene, state, at(0.0)).wrench.force;
    for (double arc = stride; arc < 0.004; arc += stride) {
      const ForceSample out = touch(scene, state, at(arc));
      worst = std::max(worst, (out.wrench.force - last).norm());
      last = out.wrench.force;
    }
    EXPECT_GT(last.norm(), 0.1);
    return worst;
  };
  const double coarse = largest_change(1e-5);
  const double fine = largest_change(1e-6);
  EXPECT_NEAR(coarse / fine, 10.0, 2.0) << coarse << " " << fine;
}

TEST_P(IsoProxyEach, T1_frictionless_loops_give_no_energy) {
  const auto f = [](const Vec3& p) { return p.z() + 0.001 * std::sin(p.x() / 0.003) * std::cos(p.y() / 0.004); };
  const auto field = std::make_shared<const ScalarField>(sampled(cube_axes(0.03, 61, 0.3), f), GetParam());
  const Scene scene = scene_of(iso_instance(field, 0.0));
  for (int loop = 0; loop < 4; ++loop) {
    ProxyState state;
    const auto at = [&](double t) {
      const double a = 2.0 * 3.14159265358979 * t;
      return Vec3(0.008 * std::cos(a), 0.006 * std::sin(a + loop), -0.0008 + 0.0006 * std::sin(2.0 * a + loop));
    };
    const int ticks = 20000;
    touch(scene, state, Vec3(at(0.0).x(), at(0.0).y(), 0.01));
    Vec3 place = at(0.0);
    Vec3 force = touch(scene, state, place).wrench.force;
    double work = 0.0;
    double way = 0.0;
    for (int i = 1; i <= ticks; ++i) {
      const Vec3 next = at(static_cast<double>(i) / ticks);
      const Vec3 now = touch(scene, state, next).wrench.force;
      work += 0.5 * (force + now).dot(next - place);
      way += (next - place).norm();
      place = next;
      force = now;
    }
    // Never given; where nothing folds, nothing is taken either.
    EXPECT_LT(work, 1e-9 + 2e-6 * way) << loop;
    if (GetParam() == CellReconstruction::smooth) {
      EXPECT_GT(work, -1e-6 - 1e-4 * way) << loop;
    }
  }
}

TEST_P(IsoProxyEach, T1_spring_never_gains_at_a_held_probe) {
  std::mt19937_64 generator(3);
  for (const double friction : {0.0, 0.4}) {
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
      Instance instance = iso_instance(random_field(14, GetParam(), seed), 0.0);
      instance.material.static_friction = friction;
      instance.material.dynamic_friction = 0.7 * friction;
      const double instance_stiffness = instance.material.stiffness;
      const Scene scene = scene_of(std::move(instance));
      ProxyState state;
      Vec3 p = random_point(generator, 0.04);
      int contacts = 0;
      bool cut = false;
      for (int i = 0; i < 4000; ++i) {
        p += random_point(generator, i % 50 == 0 ? 0.02 : 0.0006);
        p = p.cwiseMax(-0.049).cwiseMin(0.049);
        const Vec3 before = state.proxy;
        const ForceSample out = touch(scene, state, p);
        contacts += out.flags.has(TickFlag::contact) ? 1 : 0;
        // Unless friction's cone has cut the last force off: then the hand has put less in than the spring holds.
        ASSERT_FALSE(!cut && out.flags.has(TickFlag::energy_limited)) << i;
        const double whole = instance_stiffness * (state.proxy - p).norm();
        cut = out.flags.has(TickFlag::contact) && out.wrench.force.norm() < 0.99 * whole;
        if (i > 0) {
          ASSERT_LE((state.proxy - p).norm(), (before - p).norm() * (1.0 + 1e-9) + 1e-15) << i;
        }
      }
      EXPECT_GT(contacts, 1500);
    }
  }
}

/// Touched from both sides, an isosurface of a rough field parts space in two: a proxy never comes to the other part.
TEST_P(IsoProxyEach, T5_a_proxy_never_changes_sides_of_a_rough_field) {
  std::mt19937_64 generator(23);
  std::uint64_t ticks = 0;
  std::uint64_t pressed = 0;
  std::uint64_t unconverged = 0;
  std::uint64_t open = 0;
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const auto field = random_field(16, GetParam(), seed, 0.6);
    Instance instance = iso_instance(field, 0.05);
    instance.material.static_friction = 0.1 * static_cast<double>(seed);
    instance.material.dynamic_friction = 0.08 * static_cast<double>(seed);
    const Scene scene = scene_of(std::move(instance));
    CellPolynomial cell;
    const auto outside = [&](const Vec3& p) {
      FieldJet jet;
      return field->sample(0, p, cell, jet) && jet.value >= 0.05;
    };
    for (int run = 0; run < 20; ++run) {
      ProxyState state;
      Vec3 p = random_point(generator, 0.045);
      const bool start = outside(p);
      touch(scene, state, p);
      const double speed = std::pow(10.0, -2.0 + 3.3 * run / 19.0);  // 0.01 to 20 m/s
      for (int i = 0; i < 1000; ++i, ++ticks) {
        p += random_point(generator, 1.0).normalized() * speed * 1e-3;
        p = p.cwiseMax(-0.049).cwiseMin(0.049);
        const ForceSample out = touch(scene, state, p);
        unconverged += out.flags.has(TickFlag::not_converged) ? 1U : 0U;
        open += out.flags.has(TickFlag::work_left) ? 1U : 0U;
        if (!out.flags.has(TickFlag::contact)) {
          ASSERT_EQ(outside(state.proxy), start) << seed << " " << run << " " << i << " speed " << speed;
          continue;
        }
        ++pressed;
        ASSERT_EQ(!state.contacts[0].first().back, start) << seed << " " << run << " " << i << " speed " << speed;
      }
    }
  }
  EXPECT_GT(pressed, ticks / 4);
  EXPECT_EQ(unconverged, 0U);
  EXPECT_LT(open, ticks / 1000) << "at up to 20 m/s";
}

/// Shells one within the other: the proxy stays between those it started between.
TEST_P(IsoProxyEach, T5_no_speed_passes_nested_shells) {
  const auto field = std::make_shared<const ScalarField>(
      sampled(cube_axes(0.05, 161), [](const Vec3& p) { return std::sin(p.norm() / 0.0008); }), GetParam());
  const Scene scene = scene_of(iso_instance(field, 0.0));
  std::mt19937_64 generator(17);
  const double spacing = 0.0008 * 3.14159265358979;
  int pressed = 0;
  for (int run = 0; run < 20; ++run) {
    ProxyState state;
    Vec3 p = random_point(generator, 1.0).normalized() * spacing * (5.5 + run % 10);
    touch(scene, state, p);
    const double speed = std::pow(10.0, -2.0 + 3.3 * run / 19.0);  // 0.01 to 20 m/s
    for (int i = 0; i < 600; ++i) {
      p += random_point(generator, 1.0).normalized() * speed * 1e-3;
      p = p.cwiseMax(-0.048).cwiseMin(0.048);
      const ForceSample out = touch(scene, state, p);
      pressed += out.flags.has(TickFlag::contact) ? 1 : 0;
      const double shell = state.proxy.norm() / spacing - (5.5 + run % 10);
      ASSERT_LT(std::abs(shell), 0.56) << run << " " << i << " speed " << speed;
    }
  }
  EXPECT_GT(pressed, 3000);
}

TEST_P(IsoProxyEach, T5_wall_thinner_than_a_cell_holds_on_both_sides) {
  const auto field = thin_wall(GetParam());
  const Scene scene = scene_of(iso_instance(field, 0.0));
  for (const double side : {1.0, -1.0}) {
    ProxyState state;
    touch(scene, state, Vec3(0.0, 0.0, 0.004 * side));
    for (int i = 0; i < 2000; ++i) {
      const Vec3 p(0.006 * std::sin(0.01 * i), 0.005 * std::cos(0.013 * i), -0.003 * side * std::sin(0.004 * i));
      const ForceSample out = touch(scene, state, p);
      ASSERT_GT(side * state.proxy.z(), 0.0) << i;
      if (out.flags.has(TickFlag::contact)) {
        ASSERT_GT(side * out.wrench.force.z(), 0.0);
      }
      if (side * p.z() < -1e-4) {
        ASSERT_TRUE(out.flags.has(TickFlag::contact)) << i;
      }
    }
  }
}

TEST(IsoProxy, BothSidesOrTheFrontAlone) {
  const auto field = sphere_field(65);
  const Scene both = scene_of(iso_instance(field, 0.03));
  ProxyState inside;
  touch(both, inside, Vec3(0.0, 0.0, 0.02));
  const ForceSample pushed = touch(both, inside, Vec3(0.0, 0.0, 0.031));
  EXPECT_NEAR(pushed.wrench.force.z(), -1.0, 1e-3);
  EXPECT_NEAR(pushed.contact.normal.z(), -1.0, 1e-6);
  const Scene front = scene_of(iso_instance(field, 0.03, Inside::low, Sides::front));
  ProxyState leaving;
  touch(front, leaving, Vec3(0.0, 0.0, 0.02));
  EXPECT_TRUE(touch(front, leaving, Vec3(0.0, 0.0, 0.031)).wrench.force.isZero());
  EXPECT_NEAR(touch(front, leaving, Vec3(0.0, 0.0, 0.029)).wrench.force.z(), 1.0, 1e-3);
  const Scene hollow = scene_of(iso_instance(field, 0.03, Inside::high, Sides::front));
  ProxyState within;
  touch(hollow, within, Vec3(0.0, 0.0, 0.02));
  EXPECT_NEAR(touch(hollow, within, Vec3(0.0, 0.0, 0.031)).wrench.force.z(), -1.0, 1e-3);
}

TEST(IsoProxy, FrictionHoldsWithinTheConeAndSlidesOnIt) {
  const auto field =
      std::make_shared<const ScalarField>(sampled(cube_axes(0.05, 41), [](const Vec3& p) { return p.z(); }));
  Instance instance = iso_instance(field, 0.0);
  instance.material.static_friction = 0.5;
  instance.material.dynamic_friction = 0.3;
  const Scene scene = scene_of(std::move(instance));
  ProxyState state;
  touch(scene, state, Vec3(0.0, 0.0, 0.001));
  touch(scene, state, Vec3(0.0, 0.0, -0.001));
  const ForceSample stuck = touch(scene, state, Vec3(0.00049, 0.0, -0.001));
  EXPECT_NEAR(stuck.wrench.force.x(), -0.49, 1e-6);
  const ForceSample slid = touch(scene, state, Vec3(0.00055, 0.0, -0.001));
  EXPECT_NEAR(slid.wrench.force.x(), -0.3, 1e-6);
  EXPECT_NEAR(slid.wrench.force.z(), 1.0, 1e-6);
}

TEST(IsoProxy, APoseMovesTheForceAlong) {
  const auto field = sphere_field(65);
  Instance placed = iso_instance(field, 0.03);
  placed.world_from_object.position = Vec3(0.2, -0.1, 0.3);
  placed.world_from_object.orientation = Quat(Eigen::AngleAxisd(0.8, Vec3(1.0, 2.0, -0.5).normalized()));
  const Pose pose = placed.world_from_object;
  const Scene here = scene_of(iso_instance(field, 0.03));
  const Scene there = scene_of(std::move(placed));
  ProxyState a;
  ProxyState b;
  for (int i = 0; i < 300; ++i) {
    const Vec3 p = over_sphere(1e-4 * i, 0.001 - 0.004 * (i == 0 ? 1.0 : 0.0));
    const ForceSample plain = touch(here, a, p);
    const ForceSample moved = touch(there, b, pose.apply(p));
    ASSERT_LT((pose.rotate(plain.wrench.force) - moved.wrench.force).norm(), 1e-6);
  }
}

TEST(IsoProxy, AThresholdChangedUnderTheProbeMovesTheSurfaceAtItsSpeed) {
  const auto field = sphere_field(65);
  const IsoSurface first = IsoSurface::build(field, 0.03, Inside::low, 0.02).value();
  for (const double target : {0.034, 0.026, 0.0305}) {
    Instance instance = iso_instance(field, 0.03);
    instance.surface = std::make_shared<const IsoSurface>(first);
    const Scene before = scene_of(instance);
    instance.surface = std::make_shared<const IsoSurface>(first.with_threshold(target).value());
    const Scene after = scene_of(instance);
    for (const double dt : {1e-3, 2.5e-4}) {
      ProxyState state;
      touch(before, state, Vec3(0.0, 0.0, 0.032), dt);
      const Vec3 p(0.0003, 0.0, 0.0292);
      Vec3 last = touch(before, state, p, dt).wrench.force;
      EXPECT_NEAR(last.norm(), 0.8, 0.01);
      double jump = 0.0;
      double most = 0.0;
      ForceSample out;
      for (double t = 0.0; t < 0.5; t += dt) {
        out = touch(after, state, p, dt);
        jump = std::max(jump, (out.wrench.force - last).norm());
        most = std::max(most, out.wrench.force.norm());
        last = out.wrench.force;
      }
      // 20 mm/s on 1 N/mm, and the first of its ticks handed over within the next ten milliseconds.
      EXPECT_LT(jump, 1.12 * 1000.0 * 0.02 * dt) << target;
      if (target < 0.0292) {
        EXPECT_FALSE(out.flags.has(TickFlag::contact));
      } else {
        EXPECT_NEAR(state.proxy.norm(), target, 1e-6) << target;
        // Outwards, the spring would gain: what nobody paid for is not rendered.
        EXPECT_LE(out.wrench.force.norm(), 1000.0 * (target - p.norm()) * 1.001);
        EXPECT_GT(out.wrench.force.norm(), 0.1);
      }
      EXPECT_LT(most, 1000.0 * (std::max(target, 0.03) - p.norm()) * 1.001);
    }
  }
}

TEST(IsoProxy, ASurfaceThatComesOverAFreeProbeTakesItUp) {
  const auto field = sphere_field(65);
  const IsoSurface first = IsoSurface::build(field, 0.02, Inside::low).value();
  Instance instance = iso_instance(field, 0.02, Inside::low, Sides::front);
  instance.surface = std::make_shared<const IsoSurface>(first);
  const Scene before = scene_of(instance);
  instance.surface = std::make_shared<const IsoSurface>(first.with_threshold(0.0215).value());
  const Scene after = scene_of(instance);
  ProxyState state;
  const Vec3 p(0.0, 0.0, 0.021);
  EXPECT_FALSE(touch(before, state, p).flags.has(TickFlag::contact));
  Vec3 last = Vec3::Zero();
  ForceSample out;
  for (int i = 0; i < 200; ++i) {
    out = touch(after, state, p);
    ASSERT_LT((out.wrench.force - last).norm(), 0.0211);
    last = out.wrench.force;
  }
  EXPECT_TRUE(out.flags.has(TickFlag::contact));
  EXPECT_NEAR(state.proxy.norm(), 0.0215, 1e-6);
}

/// That of the ball of the next test at a time.
double scheduled_radius(double t) {
  if (t < 0.5) return 0.03 + 0.004 * t;
  if (t < 1.0) return 0.032 - 0.004 * (t - 0.5);
  return std::max(0.026, 0.03 - 0.02 * (t - 1.0));
}

TEST(IsoProxy, AScheduleMovesTheSurfaceByTheProbesClock) {
  // Distance from the centre: the surface is a ball whose radius is the threshold, and grows by 4 mm a second.
  const IsoSurface first = IsoSurface::build(sphere_field(65), 0.03, Inside::low).value();
  Instance instance = iso_instance(first.shared_field(), 0.03);
  instance.surface = std::make_shared<const IsoSurface>(
      first.with_schedule({{Seconds(0.5), 0.032}, {Seconds(1.0), 0.03}, {Seconds(1.2), 0.026}}).value());
  for (const double power : {1.0, 0.0}) {
    SceneSettings settings;
    settings.change_power = power;
    const Scene scene = Scene::build({instance}, settings).value();
    for (const double dt : {1e-3, 2.5e-4}) {
      ProxyState state;
      double given = 0.0;
      Vec3 last = Vec3::Zero();
      Vec3 from = Vec3(0.0, 0.0, 0.032);
      for (double t = 0.0; t < 1.4; t += dt) {
        // Pressed to 1 mm below the first surface, and held there.
        ProbeSample probe;
        probe.pose.position = Vec3(0.0, 0.0, std::max(0.029, 0.032 - 0.1 * t));
        probe.time = Seconds(t);
        const ForceSample out = step(scene, state, probe, Seconds(dt));
        given += last.dot(probe.pose.position - from) - 0.5 * 1000.0 * (probe.pose.position - from).squaredNorm();
        last = out.wrench.force;
        from = probe.pose.position;
        if (t < 0.05 || std::abs(t - 1.15) < 0.02) continue;
        const double radius = scheduled_radius(t);
        const double force = 1000.0 * std::max(0.0, radius - 0.029);
        if (power > 0.0) {
          // A tick of 4 or 20 mm/s behind the clock at most.
          ASSERT_NEAR(out.wrench.force.z(), force, 0.02 + 1000.0 * 0.02 * dt) << t;
        } else {
          // Nobody pays for a surface that grows under a hand that holds still.
          ASSERT_LE(out.wrench.force.z(), std::min(force, 1.0) + 0.03) << t;
        }
        ASSERT_FALSE(t > 1.2 && out.flags.has(TickFlag::contact)) << t;
      }
      EXPECT_TRUE(power > 0.0 || given <= 1e-9) << given;
    }
  }
}

TEST(IsoProxy, ABallRestsItsRadiusAwayFromTheSurface) {
  for (const double radius : {0.0005, 0.003}) {
    const Scene scene = scene_of(iso_instance(sphere_field(65), 0.03), radius);
    ProxyState state;
    touch(scene, state, over_sphere(0.0, -0.0015 - radius));
    for (int i = 0; i < 60; ++i) {
      const Vec3 p = over_sphere(5e-5 * i, 0.0005 - radius);
      const ForceSample out = touch(scene, state, p);
      ASSERT_TRUE(out.flags.has(TickFlag::contact));
      EXPECT_NEAR(state.proxy.norm(), 0.03 + radius, 2e-6) << radius << " " << i;
      EXPECT_NEAR(out.wrench.force.norm(), 0.5, 0.01);
      EXPECT_GT(out.wrench.force.normalized().dot(p.normalized()), std::cos(0.5 / degrees));
    }
  }
}

/// Amendment 13: phi / |grad phi| is no distance. In a groove narrower than the ball it rests on both walls.
TEST(IsoProxy, ABallRestsOnBothWallsOfANarrowGroove) {
  const auto f = [](const Vec3& p) { return p.z() + 0.004 * std::cos(p.x() / 0.001); };
  const auto field = std::make_shared<const ScalarField>(sampled(cube_axes(0.012, 97), f));
  const double radius = 0.0015;
  const Scene scene = scene_of(iso_instance(field, 0.0), radius);
  ProxyState state;
  touch(scene, state, Vec3(0.0001, 0.0, 0.009));
  ForceSample out;
  for (int i = 0; i < 40; ++i) out = touch(scene, state, Vec3(0.0001, 0.0, 0.008 - 0.0003 * i));
  // Rests where the distance to the walls is its radius: found by fine sampling of the exact curve.
  double rest = -0.004;
  for (double z = 0.006; z > -0.004; z -= 1e-5) {
    double nearest = infinity;
    for (double x = -0.004; x < 0.004; x += 1e-5) {
      nearest = std::min(nearest, std::hypot(x, z + 0.004 * std::cos(x / 0.001)));
    }
    if (nearest < radius) {
      rest = z;
      break;
    }
  }
  EXPECT_NEAR(state.proxy.z(), rest, 1e-4);
  EXPECT_NEAR(state.proxy.x(), 0.0, 1e-4);
  EXPECT_GT(out.wrench.force.z(), 0.0);
}

/// Ground that is rough down to three cells, over a cube of +-10 mm: the surface is where z is 0 or so.
std::shared_ptr<const ScalarField> rough_ground(CellReconstruction reconstruction) {
  return std::make_shared<const ScalarField>(sampled(cube_axes(0.01, 61),
                                                     [](const Vec3& p) {
                                                       double height = 0.0;
                                                       for (int k = 0; k < 12; ++k) {
                                                         const double wave = 1.1e-3 * std::pow(1.3, k % 6);
                                                         const double turn = 2.4 * k;
                                                         const double along =
                                                             std::cos(turn) * p.x() + std::sin(turn) * p.y();
                                                         height += 0.09 * wave * std::sin(6.28 * along / wave + k);
                                                       }
                                                       return p.z() - height;
                                                     }),
                                             reconstruction);
}

/// Places of that ground: the field's roots up columns 50 um apart over +-5 mm, found without its surface queries.
std::vector<Vec3> places_of(const ScalarField& field) {
  std::vector<Vec3> places;
  const auto value = [&](const Vec3& p) {
    CellPolynomial cell;
    return field.load(0, field.cell_of(0, p), cell) ? cell.value(p) : 0.0;
  };
  for (double x = -5e-3; x < 5e-3; x += 5e-5) {
    for (double y = -5e-3; y < 5e-3; y += 5e-5) {
      double low = -4e-3;
      double high = 4e-3;
      for (int i = 0; i < 30; ++i) {
        const double middle = 0.5 * (low + high);
        (value(Vec3(x, y, middle)) < 0.0 ? low : high) = middle;
      }
      places.emplace_back(x, y, low);
    }
  }
  return places;
}

TEST_P(IsoProxyEach, ABallComesToRestAmongAllThatItTouches) {
  const auto field = rough_ground(GetParam());
  const std::vector<Vec3> places = places_of(*field);
  const auto nearest = [&](const Vec3& p) {
    double square = infinity;
    for (const Vec3& place : places) square = std::min(square, (place - p).squaredNorm());
    return std::sqrt(square);
  };
  std::mt19937_64 generator(91);
  std::uniform_real_distribution<double> within(-1.0, 1.0);
  const auto any = [&] { return Vec3(within(generator), within(generator), within(generator)); };
  int held_by_several = 0;
  int unfinished_ticks = 0;
  const Instance ground = iso_instance(field, 0.0, Inside::low, Sides::front);
  SurfaceCache cache;
  const IsoView view = iso_of(ground.surface)->view(cache);
  for (const double radius : {3e-4, 2e-3}) {
    const Scene scene = scene_of(ground, radius);
    ProxyState state;
    Vec3 place(0.0, 0.0, 3e-3 + radius);
    Vec3 heading(0.0, 0.0, -1e-4);
    for (int i = 0; i < 500; ++i) {
      if (i % 50 == 49) heading = 6e-5 * any();
      place += heading;
      if (place.head<2>().cwiseAbs().maxCoeff() > 2e-3) heading.head<2>() *= -1.0;
      if ((place.z() < radius - 1e-3 && heading.z() < 0.0) || (place.z() > radius + 1e-3 && heading.z() > 0.0))
        heading.z() *= -1.0;
      const ForceSample felt = touch(scene, state, place);
      unfinished_ticks += unfinished(felt.flags) ? 1 : 0;
      held_by_several += felt.contact.places.size() > 1 ? 1 : 0;
      for (const Place& at : felt.contact.places) ASSERT_EQ(at.element, view.element_at(at.at)) << "tick " << i;
      // No place of the surface lies within the ball.
      ASSERT_GT(nearest(state.proxy), radius - 1e-9) << "radius " << radius << ", tick " << i;
      if (!felt.flags.has(TickFlag::contact)) continue;
      const double kept = view.nearest(state.proxy, infinity).distance;
      // What is left to go is not worth a move.
      ASSERT_NEAR(kept, radius, 2e-4 * view.grain() + 10.0 * view.skin()) << "tick " << i;
      // Nowhere around is there room nearer to the probe.
      const double here = (state.proxy - place).norm();
      for (int k = 0; k < 24; ++k) {
        const double length = 1e-5 * std::pow(10.0, within(generator));
        const Vec3 there = state.proxy + length * any().normalized();
        if (here - (there - place).norm() < 0.02 * length) continue;
        ASSERT_LT(view.nearest(there, infinity).distance, kept + 0.01 * length)
            << "radius " << radius << ", tick " << i << ", " << length << " m off";
      }
    }
  }
  ASSERT_GT(held_by_several, 200);
  ASSERT_EQ(unfinished_ticks, 0);
}

TEST(IsoProxy, NothingIsFeltBeyondTheBorderOrInHoles) {
  const auto field = std::make_shared<const ScalarField>(sampled(cube_axes(0.02, 21), [](const Vec3& p) {
    return p.norm() < 0.005 ? std::numeric_limits<double>::quiet_NaN() : p.z();
  }));
  const Scene scene = scene_of(iso_instance(field, 0.0));
  ProxyState state;
  touch(scene, state, Vec3(-0.012, 0.001, 0.002));
  EXPECT_TRUE(touch(scene, state, Vec3(-0.012, 0.001, -0.001)).flags.has(TickFlag::contact));
  // Along the surface into the hole: let go.
  bool held = true;
  for (int i = 0; i < 100 && held; ++i) {
    const Vec3 p(-0.012 + 1.1e-4 * i, 0.001, -0.001);
    held = touch(scene, state, p).flags.has(TickFlag::contact);
    if (held) {
      EXPECT_LT(p.x(), -0.002);
    }
  }
  EXPECT_FALSE(held);
  ProxyState other;
  touch(scene, other, Vec3(0.01, 0.01, 0.002));
  for (int i = 0; i < 150; ++i) {
    const Vec3 p(0.01 + 1e-4 * i, 0.01, -0.001);
    const bool contact = touch(scene, other, p).flags.has(TickFlag::contact);
    EXPECT_EQ(contact, p.x() <= 0.02 + 1e-9) << i;
  }
}

/// Along the border of a volume that is two samples thick, as a two-dimensional simulation is.
TEST(IsoProxy, SlidesAlongTheBorderOfAFlatVolume) {
  const GridAxis wide = *GridAxis::uniform(-0.05, 0.005, 21);
  const GridAxis thin = *GridAxis::uniform(-0.005, 0.01, 2);
  const auto field = std::make_shared<const ScalarField>(
      sampled({wide, wide, thin}, [](const Vec3& p) { return std::hypot(p.x(), p.y()); }));
  const Scene scene = scene_of(iso_instance(field, 0.03));
  for (const double z : {0.005, 0.005 - 2e-10, 0.005 - 1e-18, 0.0}) {
    ProxyState state;
    touch(scene, state, Vec3(0.032, 0.0, z));
    for (int i = 0; i < 2000; ++i) {
      const double angle = 1e-3 * i;
      const Vec3 p(0.0295 * std::cos(angle), 0.0295 * std::sin(angle), z + (i % 3 - 1) * 1e-18);
      const ForceSample out = touch(scene, state, p);
      ASSERT_TRUE(out.flags.has(TickFlag::contact)) << z << " " << i;
      ASSERT_FALSE(unfinished(out.flags)) << z << " " << i;
      ASSERT_NEAR(out.wrench.force.norm(), 0.5, 0.03);
    }
  }
}

/// Where a flight off the border meets the surface again at once, the border holds the point.
TEST(IsoProxy, comes_to_rest_in_every_tick_wherever_waves_meet_the_border) {
  std::mt19937_64 generator(29);
  const auto field = std::make_shared<const ScalarField>(sampled(cube_axes(0.05, 25), [](const Vec3& p) {
    return std::sin(250.0 * p.x()) * std::cos(210.0 * p.y()) + std::sin(230.0 * p.z() + 90.0 * p.x());
  }));
  const Scene scene = scene_of(iso_instance(field, 0.1));
  int pressed = 0;
  int held_from_beyond = 0;
  for (int run = 0; run < 400; ++run) {
    ProxyState state;
    Vec3 p = random_point(generator, 0.045);
    touch(scene, state, p);
    const Vec3 way = random_point(generator, 1.0).normalized() * std::pow(10.0, -4.5 + 2.0 * (run % 20) / 19.0);
    for (int i = 0; i < 1000 && p.cwiseAbs().maxCoeff() < 0.08; ++i) {
      p += way + 0.3 * way.norm() * random_point(generator, 1.0);
      const ForceSample out = touch(scene, state, p);
      ASSERT_FALSE(out.flags.has(TickFlag::not_converged)) << run << " " << i;
      if (!out.flags.has(TickFlag::contact)) continue;
      ++pressed;
      held_from_beyond += p.cwiseAbs().maxCoeff() > 0.05 ? 1 : 0;
    }
  }
  EXPECT_GT(pressed, 20000);
  EXPECT_GT(held_from_beyond, 20);
}

TEST(IsoProxy, TwoSurfacesHoldTogether) {
  const auto floor =
      std::make_shared<const ScalarField>(sampled(cube_axes(0.02, 31), [](const Vec3& p) { return p.z(); }));
  const auto wall = std::make_shared<const ScalarField>(
      sampled(cube_axes(0.02, 31), [](const Vec3& p) { return p.x() + 0.2 * p.z(); }));
  const Scene scene = Scene::build({iso_instance(floor, 0.0), iso_instance(wall, 0.0)}, 0.0).value();
  ProxyState state;
  touch(scene, state, Vec3(0.003, 0.0, 0.003));
  ForceSample out;
  for (int i = 0; i < 30; ++i) out = touch(scene, state, Vec3(0.003 - 1.5e-4 * i, 1e-4 * i, 0.003 - 1.5e-4 * i));
  EXPECT_EQ(out.contact.count, 2U);
  EXPECT_NEAR(state.proxy.x(), 0.0, 2e-5);
  EXPECT_NEAR(state.proxy.z(), 0.0, 2e-5);
  EXPECT_NEAR(state.proxy.y(), 2.9e-3, 2e-5);
}

TEST(IsoProxy, RunsTwiceBitForBit) {
  std::vector<Vec3> first;
  for (int run = 0; run < 2; ++run) {
    Instance instance = iso_instance(random_field(20, CellReconstruction::smooth, 5), 0.0);
    instance.material.static_friction = 0.3;
    instance.material.dynamic_friction = 0.2;
    const Scene scene = scene_of(std::move(instance));
    std::mt19937_64 generator(5);
    ProxyState state;
    Vec3 p = Vec3::Zero();
    for (std::size_t i = 0; i < 2000; ++i) {
      p = (p + random_point(generator, 0.001)).cwiseMax(-0.04).cwiseMin(0.04);
      const Vec3 force = touch(scene, state, p).wrench.force;
      if (run == 0) {
        first.push_back(force);
      } else {
        ASSERT_EQ(force, first[i]);
      }
    }
  }
}

TEST(IsoProxy, LawsThatNeedTrianglesAreRefused) {
  for (const char* name : {"god-object", "force-shading", "height-field", "mesostructure", "dense-mesh"}) {
    Instance instance = iso_instance(sphere_field(17), 0.03);
    instance.law = law_by_name(name).value();
    const Error error = Scene::build({instance}, 0.0).error();
    EXPECT_EQ(error.code, ErrorCode::unsupported_pair);
    EXPECT_EQ(error.place, "surfaces[0].law");
    EXPECT_EQ(error.accepted, "proxy, avila, cross-uncross");
  }
  Instance instance = iso_instance(sphere_field(17), 0.03);
  instance.law = law_by_name("avila").value();
  EXPECT_TRUE(Scene::build({instance}, 0.0));
  EXPECT_FALSE(Scene::build({instance}, 0.001));
  EXPECT_FALSE(Scene::build({}, 0.0));
}

}  // namespace
}  // namespace asperity::test::iso_proxy_test
