// Friction laws as they are felt through `step`: rows Y-7, Y-8, and what every law owes under every contact law.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "tests/render/implicit_touch.h"
#include "tests/render/textures.h"
#include "tests/render/volumes.h"

namespace asperity::test::contact_friction_test {
namespace {

constexpr double push = 0.6;  // N
constexpr double depth = push / stiffness;

/// Onto z = -depth, then `length` (m) along a direction at an even speed.
std::vector<Vec3> drag(const Vec3& direction, double length, double speed) {
  const int count = static_cast<int>(std::lround(length / (speed * tick.count())));
  std::vector<Vec3> path = line({0.0, 0.0, 0.001}, {0.0, 0.0, -depth}, 10);
  const std::vector<Vec3> rest = line({0.0, 0.0, -depth}, Vec3(0.0, 0.0, -depth) + length * direction, count);
  path.insert(path.end(), rest.begin() + 1, rest.end());
  return path;
}

Instance rough(FrictionKind kind, Formulation formulation = Formulation::consistent) {
  Instance instance = instance_of(flat_square());
  instance.material.static_friction = 0.5;
  instance.material.dynamic_friction = 0.3;
  instance.material.friction.kind = kind;
  instance.material.friction.formulation = formulation;
  instance.material.friction_named = true;
  if (kind == FrictionKind::viscous) instance.material.friction.viscosity = 2.0;
  return instance;
}

std::vector<FrictionKind> all_kinds() {
  std::vector<FrictionKind> kinds;
  for (const std::string& name : friction_names()) kinds.push_back(must(friction_by_name(name)));
  return kinds;
}

TEST(ContactFriction, Y_7_sticks_to_the_break_away_force_and_drops_to_the_sliding_one) {
  for (const auto& [k_s, k_d, f_s] : {std::tuple{250.0, 0.4, 0.4}, {300.0, 0.6, 0.6}}) {
    Instance instance = rough(FrictionKind::karnopp, Formulation::literal);
    instance.material.static_friction = instance.material.dynamic_friction = k_d;
    instance.material.friction.stiffness = k_s;
    instance.material.friction.break_away = f_s;
    instance.material.friction.stick_speed = 5e-3;
    const Scene scene = scene_with(instance);
    // 2 mm/s: below the speed that sticks.
    const std::vector<Vec3> path = drag(Vec3::UnitX(), 4e-3, 2e-3);
    const std::vector<ForceSample> samples = stroke(scene, path);
    std::size_t top = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (samples[i].parts.friction.norm() > samples[top].parts.friction.norm() + 1e-12) top = i;
    }
    EXPECT_NEAR(samples[top].parts.friction.norm(), f_s, 1e-2 * f_s);
    EXPECT_NEAR(path[top].x(), f_s / k_s, 2e-5);
    // The break is sharp: the very next tick slides, at 0.6 of what held.
    ASSERT_LT(top + 1, samples.size());
    EXPECT_NEAR(samples[top + 1].parts.friction.norm(), k_d * push, 1e-9);
    EXPECT_NEAR(samples[top + 1].parts.friction.norm() / samples[top].parts.friction.norm(), 0.6, 0.01);
  }
}

TEST(ContactFriction, Y_8_coefficient_by_direction) {
  // Tab. 3: smooth along x, rough along y; the gradient of the features is along y.
  for (const bool literal : {true, false}) {
    Instance instance = rough(FrictionKind::karnopp, literal ? Formulation::literal : Formulation::consistent);
    instance.material.static_friction = instance.material.dynamic_friction = 0.4;
    instance.material.friction.stiffness = 250.0;
    instance.material.friction.break_away = 0.4;
    FineSettings settings = fine_settings({});
    settings.lay.sliding_ratio = 0.0;
    settings.lay.direction = 0.5 * std::numbers::pi;
    settings.lay.formulation = literal ? Formulation::literal : Formulation::consistent;
    instance.fine = fine(settings);
    const Scene scene = scene_with(instance);
    for (const double degrees : {0.0, 30.0, 60.0, 90.0}) {
      const double a = degrees * std::numbers::pi / 180.0;
      const Vec3 way(std::sin(a), std::cos(a), 0.0);
      // 50 mm/s: it slides.
      const ForceSample last = stroke(scene, drag(way, 0.02, 0.05)).back();
      // Eq. 15; and the ellipse N D v / sqrt(v D v), which for D = diag(0, mu^2) is mu N along y at every angle but 90.
      const Vec3 expected = literal ? Vec3(-push * 0.4 * (1.0 - degrees / 90.0) * way)
                                    : Vec3(0.0, degrees < 90.0 ? -push * 0.4 : 0.0, 0.0);
      EXPECT_NEAR((last.parts.friction - expected).norm(), 0.0, 1e-6)
          << degrees << " " << last.parts.friction.transpose();
    }
  }
}

TEST(Rows, Eq15_k_s_is_felt_by_direction) {
  // 250 N/m along y, the gradient of the features, 100 N/m along x; limits and k_d alike in every direction.
  for (const bool literal : {true, false}) {
    Instance instance = rough(FrictionKind::karnopp, literal ? Formulation::literal : Formulation::consistent);
    instance.material.static_friction = instance.material.dynamic_friction = 0.4;
    instance.material.friction.stiffness = 250.0;
    instance.material.friction.break_away = 0.4;
    FineSettings settings = fine_settings({});
    settings.lay.stiffness_ratio = 0.4;
    settings.lay.direction = 0.5 * std::numbers::pi;
    settings.lay.formulation = literal ? Formulation::literal : Formulation::consistent;
    instance.fine = fine(settings);
    const Scene scene = scene_with(instance);
    for (const double degrees : {0.0, 30.0, 60.0, 90.0}) {
      const double a = degrees * std::numbers::pi / 180.0;
      const Vec3 way(std::sin(a), std::cos(a), 0.0);
      // 2 mm/s over 1 mm: it sticks.
      const ForceSample last = stroke(scene, drag(way, 1e-3, 2e-3)).back();
      const Vec3 expected = literal ? Vec3(-1e-3 * (250.0 - 150.0 * degrees / 90.0) * way)
                                    : Vec3(-1e-3 * Vec3(100.0 * way.x(), 250.0 * way.y(), 0.0));
      EXPECT_NEAR((last.parts.friction - expected).norm(), 0.0, 1e-6)
          << degrees << " " << last.parts.friction.transpose();
    }
  }
}

TEST(ContactFriction, Steady_sliding_holds_the_dynamic_coefficient_under_every_law) {
  for (const FrictionKind kind : all_kinds()) {
    if (kind == FrictionKind::viscous) continue;
    const Scene scene = scene_with(rough(kind));
    const ForceSample last = stroke(scene, drag(Vec3::UnitX(), 0.03, 0.1)).back();
    EXPECT_NEAR(last.parts.friction.x(), -0.3 * push, 0.01 * push) << friction_name(kind);
    EXPECT_NEAR(last.wrench.force.z(), push, 1e-3 * push);
  }
}

TEST(ContactFriction, The_default_is_the_proxys_own_and_equals_the_law_on_top) {
  // The implicit step with a spring of its own, as stiff as the contact, answers what the proxy answers.
  Instance held = rough(FrictionKind::implicit_coulomb);
  Instance on_top = held;
  on_top.material.friction.stiffness = stiffness;
  const Scene a = scene_with(held);
  const Scene b = scene_with(on_top);
  Rng rng(5);
  std::vector<Vec3> path = line({0.0, 0.0, 0.001}, {0.0, 0.0, -depth}, 10);
  Vec3 at = path.back();
  Vec3 way = Vec3::UnitX();
  for (int i = 0; i < 3000; ++i) {
    if (i % 100 == 0) way = random_direction(rng);
    at += 2e-6 * Vec3(way.x(), way.y(), 0.0);
    path.push_back(at);
  }
  const std::vector<ForceSample> first = stroke(a, path);
  const std::vector<ForceSample> second = stroke(b, path);
  double worst = 0.0;
  for (std::size_t i = 0; i < path.size(); ++i)
    worst = std::max(worst, (first[i].wrench.force - second[i].wrench.force).norm());
  EXPECT_LT(worst, 1e-3 * push);
}

TEST(ContactFriction, A_corner_of_faces_holds_whichever_of_them_the_probe_goes_over) {
  // The square is a grid: six faces meet where the probe comes down.
  const Scene scene = scene_with(rough(FrictionKind::implicit_coulomb));
  for (int direction = 0; direction < 90; ++direction) {
    const double a = 4.0 * direction * std::numbers::pi / 180.0;
    std::vector<Vec3> path = line({0.0, 0.0, 0.001}, {0.0, 0.0, -depth}, 10);
    // As far as friction holds it and a little less.
    for (int i = 1; i <= 120; ++i) path.push_back({i * 2e-6 * std::cos(a), i * 2e-6 * std::sin(a), -depth});
    const ForceSample last = stroke(scene, path).back();
    EXPECT_NEAR(last.proxy.head<2>().norm(), 0.0, 1e-9) << direction;
    EXPECT_NEAR(last.wrench.force.head<2>().norm(), stiffness * 240e-6, 1e-6) << direction;
  }
}

TEST(ContactFriction, Felt_under_every_contact_law) {
  ImplicitParts parts;
  parts.grid = test::sparse_grid([](const Vec3& p) { return p.z(); }, Box{Vec3::Constant(-0.02), Vec3::Constant(0.02)},
                                 1e-3, 6e-3, 6e-3);
  const auto potential = std::make_shared<const ImplicitSurface>(must(ImplicitSurface::build(parts)));
  const auto volume =
      volumes::surface_of(volumes::sampled(volumes::cube(0.03, 31), [](const Vec3& p) { return p.z(); }), 0.0);
  const auto relief = coated(plane_grid(0.1, 0.1, 8, 8), flat_map(0.0), Mapping::uv, 0.1);
  const std::vector<std::pair<Surface, std::string>> all{{flat_square(), "proxy"},
                                                         {flat_square(), "god-object"},
                                                         {flat_square(), "force-shading"},
                                                         {relief, "proxy"},
                                                         {relief, "mesostructure"},
                                                         {relief, "height-field"},
                                                         {volume, "proxy"},
                                                         {volume, "cross-uncross"},
                                                         {potential, "proxy"},
                                                         {potential, "virtual-contact-point"},
                                                         {potential, "magnetic"}};
  for (const auto& [surface, law] : all) {
    SCOPED_TRACE(std::string(surface_kind(surface)) + "/" + law);
    Instance instance = rough(FrictionKind::dahl);
    instance.surface = surface;
    instance.law = named(law);
    const ForceSample last = stroke(scene_with(instance), drag(Vec3::UnitX(), 0.01, 0.05)).back();
    EXPECT_NEAR(last.parts.friction.x(), -0.3 * push, 0.02 * push);
    EXPECT_NEAR(last.wrench.force.x(), last.parts.friction.x(), 1e-6);
  }
}

RC_GTEST_PROP(ContactFriction, Amendment_7_consistent_friction_never_gives_energy, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const std::vector<FrictionKind> kinds = all_kinds();
  Instance instance =
      rough(kinds[static_cast<std::size_t>(rng.uniform(0.0, 0.999) * static_cast<double>(kinds.size()))]);
  FineSettings settings = fine_settings({});
  settings.lay.still_ratio = rng.uniform(0.0, 1.0);
  settings.lay.sliding_ratio = rng.uniform(0.0, settings.lay.still_ratio);
  settings.lay.stiffness_ratio = rng.uniform(0.01, 1.0);
  settings.lay.direction = rng.uniform(0.0, 3.0);
  if (rng.uniform(0.0, 1.0) < 0.5) instance.fine = fine(settings);
  // Slow enough in the random walk that a spring held over a tick gains nothing worth telling.
  const Scene scene = scene_with(instance);
  ProxyState state;
  ProbeSample probe = probe_at({0.0, 0.0, 0.001});
  step(scene, state, probe, tick);
  double given = 0.0;
  for (int i = 0; i < 400; ++i) {
    const Vec3 before = probe.pose.position;
    const double z = -0.0006 - 0.0004 * std::sin(0.02 * i);
    probe.pose.position = {before.x() + rng.uniform(-1e-4, 1.1e-4), before.y() + rng.uniform(-1e-4, 1e-4), z};
    const Vec3 moved = probe.pose.position - before;
    probe.twist.linear = moved / tick.count();
    const ForceSample sample = step(scene, state, probe, tick);
    if (i > 0) given += sample.parts.friction.dot(moved);
    const double n = sample.wrench.force.z();
    RC_ASSERT(sample.parts.friction.norm() <= 0.5 * n * (1.0 + 1e-9) + 2.0 * moved.norm() / tick.count() + 1e-12);
    RC_ASSERT(std::abs(sample.parts.friction.z()) < 1e-12);
    // What has been given so far is no more than nothing, less what the spring still holds.
    RC_ASSERT(given + sample.parts.held <= 1e-12);
  }
}

TEST(ContactFriction, A_map_of_coefficients_is_felt_where_it_is) {
  Instance instance = rough(FrictionKind::implicit_coulomb);
  FineSettings settings = fine_settings({});
  // Twice as rough on the right half.
  std::vector<float> factors(64 * 64);
  for (int row = 0; row < 64; ++row) {
    for (int column = 0; column < 64; ++column)
      factors[static_cast<std::size_t>(64 * row + column)] = column < 32 ? 0.5F : 1.0F;
  }
  settings.friction_map.factors = std::make_shared<const HeightMap>(
      must(HeightMap::build(factors, 64, 64, Wrap::repeat, Reconstruction::bilinear)));
  settings.friction_map.tile = {0.04, 0.04};
  instance.fine = fine(settings);
  const Scene scene = scene_with(instance);
  const auto friction_at = [&](double x) {
    std::vector<Vec3> path = line({x, 0.0, 0.001}, {x, 0.0, -depth}, 10);
    const std::vector<Vec3> rest = line({x, 0.0, -depth}, {x, 5e-3, -depth}, 100);
    path.insert(path.end(), rest.begin() + 1, rest.end());
    return stroke(scene, path).back().parts.friction.norm();
  };
  EXPECT_NEAR(friction_at(0.01), 0.5 * 0.3 * push, 1e-6);
  EXPECT_NEAR(friction_at(0.03), 0.3 * push, 1e-6);
  EXPECT_NEAR(friction_at(-0.01), 0.3 * push, 1e-6);
}

TEST(ContactFriction, Micro_features_add_their_mean_slope_across_the_lay) {
  // A cosine of 1 um over 100 um has a mean slope of 4 c / lambda.
  Instance instance = rough(FrictionKind::implicit_coulomb);
  FineSettings settings = fine_settings({});
  settings.micro.push_back(grating(1e-6, 100e-6));
  instance.fine = fine(settings);
  const Scene scene = scene_with(instance);
  const ForceSample across = stroke(scene, drag(Vec3::UnitX(), 0.01, 0.05)).back();
  EXPECT_NEAR(across.parts.friction.norm(), (0.3 + 0.04) * push, 1e-6);
  const ForceSample along = stroke(scene, drag(Vec3::UnitY(), 0.01, 0.05)).back();
  EXPECT_NEAR(along.parts.friction.norm(), 0.3 * push, 1e-6);
}

/// Force of steady sliding along x and along y with these micro features, over that without any (0.3 N pushes).
Vec2 added_by(std::vector<SurfaceFeature> micro) {
  Instance instance = rough(FrictionKind::implicit_coulomb);
  FineSettings settings = fine_settings({});
  settings.micro = std::move(micro);
  instance.fine = fine(settings);
  const Scene scene = scene_with(instance);
  return {stroke(scene, drag(Vec3::UnitX(), 0.01, 0.05)).back().parts.friction.norm() / push - 0.3,
          stroke(scene, drag(Vec3::UnitY(), 0.01, 0.05)).back().parts.friction.norm() / push - 0.3};
}

TEST(ContactFriction, Micro_features_are_added_whatever_way_they_lie) {
  constexpr double quarter = 0.5 * std::numbers::pi;
  const Vec2 along_v = added_by({grating(1e-6, 100e-6, quarter)});
  EXPECT_NEAR(along_v.x(), 0.0, 1e-6);
  EXPECT_NEAR(along_v.y(), 0.04, 1e-6);
  const Vec2 crossed = added_by({grating(1e-6, 100e-6), grating(1e-6, 100e-6, quarter)});
  EXPECT_NEAR(crossed.x(), 0.04, 1e-6);
  EXPECT_NEAR(crossed.y(), 0.04, 1e-6);
  // A measured topography: stripes across u, as a map.
  std::vector<float> heights(64 * 64);
  for (std::size_t i = 0; i < heights.size(); ++i)
    heights[i] = static_cast<float>(1e-6 * std::cos(2.0 * std::numbers::pi * static_cast<double>(i % 64) / 16.0));
  FeatureSpec map;
  map.kind = FeatureKind::map;
  map.wavelength = {400e-6, 400e-6};
  map.heights = std::make_shared<const HeightMap>(
      must(HeightMap::build(heights, 64, 64, Wrap::repeat, Reconstruction::quadratic_bspline)));
  const Vec2 striped = added_by({must(SurfaceFeature::build(map))});
  EXPECT_NEAR(striped.x(), 0.04, 0.004);
  EXPECT_NEAR(striped.y(), 0.0, 0.002);
}

TEST(ContactFriction, An_explicit_lay_stands_beside_textures_and_micro_features) {
  Instance instance = rough(FrictionKind::implicit_coulomb);
  FineSettings settings = fine_settings({});
  settings.lay.still_ratio = settings.lay.sliding_ratio = 0.0;
  settings.lay.direction = 0.0;
  FeatureSpec noise;
  noise.kind = FeatureKind::noise;
  noise.roughness = 1e-8;
  noise.correlation_length = 50e-6;
  settings.micro.push_back(must(SurfaceFeature::build(noise)));
  settings.texture.push_back(grating(1e-6, 2e-3, 0.5 * std::numbers::pi));
  instance.fine = fine(settings);
  const Scene scene = scene_with(instance);
  EXPECT_NEAR(stroke(scene, drag(Vec3::UnitX(), 0.01, 0.05)).back().parts.friction.norm(), 0.3 * push, 0.01 * push);
  EXPECT_LT(stroke(scene, drag(Vec3::UnitY(), 0.01, 0.05)).back().parts.friction.norm(), 0.01 * push);
}

TEST(ContactFriction, A_new_scene_does_not_let_go) {
  for (const FrictionKind kind : all_kinds()) {
    if (kind == FrictionKind::viscous || kind == FrictionKind::coulomb) continue;
    Instance instance = rough(kind);
    instance.material.friction.stiffness = 500.0;
    const Scene scene = scene_with(instance);
    const Scene again = scene_with(instance);
    ProxyState state;
    touch(scene, state, {0.0, 0.0, 0.001});
    touch(scene, state, {0.0, 0.0, -depth});
    const Vec3 held = touch(scene, state, {3e-4, 0.0, -depth}).parts.friction;
    const Vec3 after = touch(again, state, {3e-4, 0.0, -depth}).parts.friction;
    EXPECT_GT(held.norm(), 0.05) << friction_name(kind);
    EXPECT_NEAR((after - held).norm(), 0.0, 1e-9) << friction_name(kind);
  }
}

TEST(ContactFriction, A_law_changed_while_it_holds_gives_no_energy) {
  for (const FrictionKind kind : all_kinds()) {
    Instance soft = rough(FrictionKind::karnopp);
    soft.material.friction.stiffness = 200.0;
    Instance stiff = rough(kind);
    if (kind != FrictionKind::viscous && kind != FrictionKind::coulomb) stiff.material.friction.stiffness = 4000.0;
    const Scene scenes[] = {scene_with(soft), scene_with(stiff)};
    ProxyState state;
    touch(scenes[0], state, {0.0, 0.0, 0.001});
    double given = 0.0;
    Vec3 before(0.0, 0.0, -depth);
    touch(scenes[0], state, before);
    double held = 0.0;
    for (int i = 0; i < 4000; ++i) {
      const double a = 0.02 * i;
      const Vec3 at(5e-4 * std::sin(a), 0.0, -depth);
      ProbeSample probe = probe_at(at);
      probe.twist.linear = (at - before) / tick.count();
      const ForceSample sample = step(scenes[(i / 37) % 2], state, probe, tick);
      given += sample.parts.friction.dot(at - before);
      held = sample.parts.held;
      before = at;
      ASSERT_LE(given + held, 1e-12) << friction_name(kind) << " " << i;
    }
  }
}

TEST(ContactFriction, A_replay_is_bit_equal) {
  for (const FrictionKind kind : all_kinds()) {
    Instance instance = rough(kind);
    instance.fine = fine(fine_settings({grating(0.05e-3, 2e-3)}));
    const Scene scene = scene_with(instance);
    std::vector<Vec3> path = drag(Vec3(0.8, 0.6, 0.0), 0.01, 0.02);
    const std::vector<ForceSample> first = stroke(scene, path);
    const std::vector<ForceSample> second = stroke(scene, path);
    for (std::size_t i = 0; i < path.size(); ++i) {
      ASSERT_EQ(std::memcmp(first[i].wrench.force.data(), second[i].wrench.force.data(), 3 * sizeof(double)), 0)
          << friction_name(kind);
    }
  }
}

TEST(ContactFriction, Lifting_off_forgets_the_stretch) {
  const Scene scene = scene_with(rough(FrictionKind::karnopp));
  ProxyState state;
  touch(scene, state, {0.0, 0.0, 0.001});
  touch(scene, state, {0.0, 0.0, -depth});
  EXPECT_GT(touch(scene, state, {1e-4, 0.0, -depth}).parts.friction.norm(), 0.05);
  touch(scene, state, {1e-4, 0.0, 0.001});
  EXPECT_TRUE(touch(scene, state, {1e-4, 0.0, -depth}).parts.friction.isZero());
}

}  // namespace
}  // namespace asperity::test::contact_friction_test
