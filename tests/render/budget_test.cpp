// A tick's budget: what it looks at is bounded and counted, what is left is gone on with, and nothing is passed or felt
// twice.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "asperity/geometry/generators.h"
#include "tests/field/volumes.h"
#include "tests/render/fixtures.h"
#include "tests/surface/custom_fields.h"
#include "tests/surface/reliefs.h"

namespace asperity::budget_test {
namespace {

using namespace test;

constexpr double size = 0.02;  // m, of every body

Instance instance_of(Surface surface) {
  Instance instance;
  instance.name = "test";
  instance.surface = std::move(surface);
  instance.material.stiffness = stiffness;
  return instance;
}

std::shared_ptr<const ReliefSurface> rough_ball() {
  static const auto relief =
      relief_on(mesh_of(icosphere(2, size)), {tiled(wavy_map(4e-4, 64), 0.01)}, CoatSettings{Mapping::triplanar});
  return relief;
}

Surface rough_formula() {
  FeatureSpec waves;
  waves.kind = FeatureKind::grating;
  waves.amplitude = 2e-4;
  waves.wavelength = Vec2(2.0 * std::numbers::pi * 0.7 * size / 40.0, 0.0);
  ParametricSettings settings;
  settings.shape = ParametricShape::torus;
  settings.radius = 0.7 * size;
  settings.tube = 0.35 * size;
  settings.tile = Vec2(settings.radius, settings.tube);
  settings.features = {must(SurfaceFeature::build(waves))};
  return std::make_shared<const ParametricSurface>(must(ParametricSurface::build(settings)));
}

/// One body, or several together, and what touches them.
struct Kind {
  static constexpr std::size_t rough_bodies = 3;  ///< these come first
  static constexpr std::size_t smooth_body = 5;
  static constexpr std::size_t triangles = 6;

  std::size_t bodies = 0;
  double radius = 0.0;  ///< m, of the probe

  /// Which a fast probe spends.
  [[nodiscard]] std::uint32_t small_budget() const noexcept {
    return (radius == 0.0 || bodies == smooth_body ? 1 : 10) * SceneSettings::least_budget;
  }
  [[nodiscard]] std::size_t fewer(std::size_t ticks) const noexcept { return radius > 0.0 ? ticks / 10 : ticks; }
};
constexpr const char* bodies[] = {"relief", "relief_beside_a_wall", "two_reliefs", "volume", "formula", "custom",
                                  "mesh"};
constexpr double tip = 1e-3;  // m

Scene scene_of_kind(const Kind& kind, std::uint32_t budget, double still = 0.0, double sliding = 0.0) {
  std::vector<Instance> instances;
  const auto wall = [] {
    return instance_of(std::make_shared<const MeshSurface>(
        TriangleIndex::build(must(TriangleMesh::build(plane_grid(0.2, 0.2, 4, 4))))));
  };
  switch (kind.bodies) {
    case 0: instances = {instance_of(rough_ball())}; break;
    case 1: instances = {instance_of(rough_ball()), wall()}; break;
    case 2:
      instances = {instance_of(rough_ball()), instance_of(rough_ball())};
      instances[1].world_from_object.position = Vec3(0.7 * size, 0.2 * size, 0.0);
      break;
    case 3:
      instances = {instance_of(std::make_shared<const IsoSurface>(
          must(IsoSurface::build(sphere_field(64, CellReconstruction::smooth), size, Inside::low))))};
      break;
    case 4: instances = {instance_of(rough_formula())}; break;
    case 5:
      instances = {instance_of(std::make_shared<const CustomSurface>(must(CustomSurface::build(SmoothBall{}))))};
      break;
    default:
      instances = {instance_of(
          std::make_shared<const MeshSurface>(TriangleIndex::build(must(TriangleMesh::build(icosphere(5, size))))))};
  }
  for (Instance& instance : instances) {
    // What comes out from behind one side alone is pushed away from there.
    if (kind.radius > 0.0) instance.sides = Sides::both;
    instance.material.static_friction = still;
    instance.material.dynamic_friction = sliding;
  }
  SceneSettings settings;
  settings.budget = budget;
  settings.probe_radius = kind.radius;
  return must(Scene::build(std::move(instances), settings));
}

/// Fast around and through a body, now and then held still.
std::vector<Vec3> fast_path(Rng& rng, std::size_t ticks) {
  std::vector<Vec3> path;
  Vec3 p(0.0, 0.0, 2.0 * size);
  while (path.size() < ticks) {
    const Vec3 goal = 1.1 * size * Vec3(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0));
    const auto count = 2 + rng.below(6);
    const Vec3 stride = (goal - p) / static_cast<double>(count);
    for (std::uint64_t i = 0; i < count; ++i) path.push_back(p += stride);
    for (std::uint64_t i = rng.below(3) * 10; i > 0; --i) path.push_back(p);
  }
  path.resize(ticks);
  return path;
}

std::vector<Kind> all_kinds() {
  std::vector<Kind> kinds;
  for (std::size_t of = 0; of < std::size(bodies); ++of) {
    kinds.push_back({of, 0.0});
    if (of != Kind::triangles) kinds.push_back({of, tip});
  }
  return kinds;
}

class Budget : public ::testing::TestWithParam<Kind> {};
std::string name_of(const ::testing::TestParamInfo<Kind>& kind) {
  return (kind.param.radius > 0.0 ? "ball_on_" : "") + std::string(bodies[kind.param.bodies]);
}
INSTANTIATE_TEST_SUITE_P(Kinds, Budget, ::testing::ValuesIn(all_kinds()), name_of);

TEST_P(Budget, WhatDoesNotFitIsToldAndGoneOnWith) {
  const std::uint32_t small_budget = GetParam().small_budget();
  Rng rng(11);
  std::size_t open = 0;
  for (const double still : {0.0, 0.4}) {
    const Scene scene = scene_of_kind(GetParam(), small_budget, still, 0.7 * still);
    const Scene unlimited = scene_of_kind(GetParam(), 0, still, 0.7 * still);
    ProxyState state;
    ProxyCache cache;
    const auto path = fast_path(rng, GetParam().fewer(1500));
    for (std::size_t i = 0; i < path.size(); ++i) {
      const ForceSample felt = step(scene, state, cache, probe_at(path[i]), tick);
      ASSERT_EQ(felt.flags.has(TickFlag::work_left), state.open_ticks > 0);
      if (!felt.flags.has(TickFlag::work_left)) continue;
      ++open;
      // As much as it had; what was left of it went into the last query.
      EXPECT_GE(cache.work().done().sum(), small_budget) << i;
      // Held still it comes to rest, in about as many ticks as the work takes, and where nothing draws it on.
      ProxyState rest = state;
      ProxyState all = state;
      ProxyCache whole;
      step(unlimited, all, whole, probe_at(path[i]), tick);
      const std::uint32_t ticks = 4 + 3 * whole.work().done().sum() / small_budget;
      std::uint32_t taken = 0;
      ForceSample later = felt;
      for (; taken < ticks && later.flags.has(TickFlag::work_left); ++taken)
        later = step(scene, rest, cache, probe_at(path[i]), tick);
      ASSERT_FALSE(later.flags.has(TickFlag::work_left)) << i << " after " << taken;
      // Nothing is left to do; under friction a long slip's cone goes by where it began, and is found anew.
      if (still > 0.0) continue;
      const double before = (rest.proxy - path[i]).norm();
      step(scene, rest, cache, probe_at(path[i]), tick);
      EXPECT_NEAR((rest.proxy - path[i]).norm(), before, 1e-3 * before + 1e-6) << i;
    }
  }
  EXPECT_GT(open, 0U);
}

TEST_P(Budget, ATickGoesOverByOneQueryOrTwo) {
  Rng rng(12);
  const std::uint32_t small_budget = GetParam().small_budget();
  const auto path = fast_path(rng, GetParam().fewer(3000));
  const auto dearest = [&](std::uint32_t budget) {
    const Scene scene = scene_of_kind(GetParam(), budget);
    ProxyState state;
    ProxyCache cache;
    std::uint32_t most = 0;
    for (const Vec3& p : path) {
      step(scene, state, cache, probe_at(p), tick);
      most = std::max(most, cache.work().done().sum());
    }
    return most;
  };
  const std::uint32_t all = dearest(0);
  const std::uint32_t kept = dearest(small_budget);
  // Less than it would be without one, and by single queries at most over it; a ball by those of one move.
  EXPECT_LT(kept, all);
  EXPECT_LE(kept, (GetParam().radius == 0.0 ? 6 : 50) * small_budget);
}

TEST_P(Budget, ReplaysAreEqualWhateverCachesHold) {
  Rng rng(13);
  const Scene scene = scene_of_kind(GetParam(), GetParam().small_budget(), 0.3, 0.2);
  ProxyState warm;
  ProxyState cold;
  ProxyCache remembered;
  for (const Vec3& p : fast_path(rng, GetParam().fewer(1500))) {
    ProxyCache empty;
    const ForceSample one = step(scene, warm, remembered, probe_at(p), tick);
    const ForceSample other = step(scene, cold, empty, probe_at(p), tick);
    ASSERT_EQ(std::memcmp(&one.wrench, &other.wrench, sizeof(one.wrench)), 0);
    ASSERT_EQ(one.proxy, other.proxy);
    ASSERT_EQ(one.flags.bits(), other.flags.bits());
    ASSERT_EQ(remembered.work().done().sum(), empty.work().done().sum());
  }
}

/// Slowly through a body, so that what jumps is the proxy, off ridges and round edges.
std::vector<Vec3> slow_path(Rng& rng, std::size_t ticks, double stride) {
  std::vector<Vec3> path;
  Vec3 p(0.0, 0.0, 2.0 * size);
  while (path.size() < ticks) {
    const Vec3 goal = 0.95 * size * Vec3(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0));
    for (; (goal - p).norm() > stride && path.size() < ticks; path.push_back(p)) p += stride * (goal - p).normalized();
  }
  return path;
}

TEST_P(Budget, ItMakesNoJumpLarger) {
  Rng rng(14);
  const double stride = 1e-4;  // m
  const auto path = slow_path(rng, GetParam().fewer(6000), stride);
  const double without = largest_jump(slide(scene_of_kind(GetParam(), 0), path));
  const double with = largest_jump(slide(scene_of_kind(GetParam(), GetParam().small_budget()), path));
  if (GetParam().radius == 0.0 || GetParam().bodies < Kind::rough_bodies) {
    EXPECT_GT(without, 2.0 * stiffness * stride);
  }
  EXPECT_LE(with, without + stiffness * stride);
}

TEST(BudgetOfATick, a_probe_drawn_back_onto_the_surface_is_not_flown_to_and_fro) {
  // To within rounding of it: the walk says that it has left, the flight that it has not.
  Rng rng(5);
  const Scene scene = scene_of_kind({}, 0);
  const auto pressed = [&](const Vec3& out, ProxyState& state) {
    touch(scene, state, 1.2 * size * out);
    const ForceSample felt = touch(scene, state, rng.uniform(0.8, 0.93) * size * out);
    EXPECT_TRUE(felt.flags.has(TickFlag::contact));
    return felt;
  };
  std::uint32_t most = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 out = random_direction(rng);
    ProxyState aside;
    const ForceSample there = pressed((out + 0.02 * random_point(rng, 1.0)).normalized(), aside);
    ProxyState state;
    ProxyCache cache;
    pressed(out, state);
    const double off = std::exp(rng.uniform(std::log(1e-18), std::log(1e-12))) * (rng.below(2) == 0 ? 1.0 : -1.0);
    const ForceSample felt = step(scene, state, cache, probe_at(there.proxy + off * there.contact.normal), tick);
    EXPECT_FALSE(unfinished(felt.flags)) << i;
    most = std::max(most, cache.work().done().sum());
  }
  EXPECT_LE(most, 250U);
}

RC_GTEST_PROP(BudgetInvariants, the_proxy_never_moves_away_from_the_probe, (std::uint64_t seed)) {
  Rng rng(seed);
  const Kind kind{rng.below(std::size(bodies)), rng.below(2) == 0 ? 0.0 : tip};
  const double still = rng.below(2) == 0 ? 0.0 : rng.uniform(0.0, 1.0);
  const Scene scene = scene_of_kind(kind, kind.small_budget() + static_cast<std::uint32_t>(rng.below(400)), still,
                                    still * rng.uniform());
  ProxyState state;
  for (const Vec3& p : fast_path(rng, kind.fewer(200))) {
    const Vec3 before = state.proxy;
    const bool first = state.epoch == 0;
    touch(scene, state, p);
    RC_ASSERT(first || (state.proxy - p).norm() <= (before - p).norm() + 1e-6);
  }
}

/// Two rough sheets that cross at 90 degrees along the y axis, as one surface: a groove with creases between folds that
/// do not belong together.
Scene crossing_sheets() {
  MeshSource sheets;
  for (const double turn : {0.25, -0.25}) {
    const MeshSource one = plane_grid(0.04, 0.04, 13, 13);
    const Eigen::AngleAxisd turned(turn * std::numbers::pi, Vec3::UnitY());
    const auto first = static_cast<std::uint32_t>(sheets.positions.size());
    for (const Vec3& p : one.positions) sheets.positions.push_back(turned * p);
    for (const auto& corners : one.triangles)
      sheets.triangles.push_back({corners[0] + first, corners[1] + first, corners[2] + first});
  }
  Rng rng(3);
  constexpr int texels = 64;
  const auto noise = tabulated(texels, texels, [&](const Vec2&) { return rng.uniform(-4e-4, 4e-4); });
  const auto relief = relief_on(
      mesh_of(std::move(sheets)),
      {tiled(must(HeightMap::build(noise, texels, texels, Wrap::repeat, Reconstruction::quadratic_bspline)), 0.01)},
      CoatSettings{Mapping::triplanar});
  EXPECT_TRUE(relief->overlaps());
  return must(Scene::build({instance_of(relief)}, 0.0));
}

TEST(BetweenFolds, what_holds_it_is_not_searched_again_and_holds_it_where_a_search_does) {
  const Scene scene = crossing_sheets();
  ProxyState state;
  ProxyCache cache;
  std::size_t in_crease = 0;
  std::size_t held = 0;
  std::uint64_t work_held = 0;
  std::uint64_t work_searched = 0;
  double most_apart = 0.0;
  double most_farther = 0.0;
  for (int i = 0; i < 6000; ++i) {
    const double along = std::max(0, i - 600) * 1e-6;
    const Vec3 p(2e-4 * std::sin(1e-2 * i), along - 0.004, std::max(-8e-3, 6e-3 - 3e-5 * i));
    ProxyState searching = state;
    bool knows = false;
    for (Contact& contact : searching.contacts) {
      knows = knows || contact.surface.held.within > 0.0;
      contact.surface.held = {};
    }
    const Vec3 before = state.proxy;
    step(scene, state, cache, probe_at(p), tick);
    const std::uint32_t work = cache.work().done().sum();
    ProxyCache own;
    step(scene, searching, own, probe_at(p), tick);
    in_crease += !state.contacts.empty() && state.contacts[0].surface.places.size() > 1 ? 1U : 0U;
    if (!knows || state.proxy != before || work > 8) {
      EXPECT_EQ(state.proxy, searching.proxy) << i;
      continue;
    }
    ++held;
    work_held += work;
    work_searched += own.work().done().sum();
    most_apart = std::max(most_apart, (state.proxy - searching.proxy).norm());
    most_farther = std::max(most_farther, (state.proxy - p).norm() - (searching.proxy - p).norm());
  }
  EXPECT_GE(in_crease, 5000U);
  EXPECT_GE(held, 4000U);
  EXPECT_LE(work_held, work_searched / 100);
  // Of texels of 156 um.
  EXPECT_LE(most_apart, 1e-5);
  EXPECT_LE(most_farther, 1e-7);
}

TEST(BudgetSettings, ABallOnTrianglesEndsByItself) {
  Rng rng(15);
  const Kind kind{Kind::triangles, tip};
  const Scene scene = scene_of_kind(kind, SceneSettings::least_budget);
  const Scene unlimited = scene_of_kind(kind, 0);
  ProxyState state;
  ProxyState whole;
  std::uint32_t most = 0;
  for (const Vec3& p : fast_path(rng, 1500)) {
    ProxyCache cache;
    const ForceSample felt = step(scene, state, cache, probe_at(p), tick);
    most = std::max(most, cache.work().done().sum());
    ASSERT_EQ(felt.proxy, touch(unlimited, whole, p).proxy);
    ASSERT_FALSE(felt.flags.has(TickFlag::work_left));
  }
  EXPECT_GT(most, SceneSettings::least_budget);
}

TEST(BudgetSettings, ABallAndAPointHaveTheirOwn) {
  EXPECT_EQ(must(Scene::build({instance_of(rough_ball())}, 0.0)).budget(), SceneSettings::budget_for(0.0));
  EXPECT_EQ(must(Scene::build({instance_of(rough_ball())}, 1e-3)).budget(), SceneSettings::budget_for(1e-3));
  SceneSettings settings;
  settings.budget = 7;
  const auto refused = Scene::build({instance_of(rough_ball())}, settings);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().place, "budget");
  EXPECT_NE(refused.error().message().find("100 evaluations or more, or 0"), std::string::npos);
}

}  // namespace
}  // namespace asperity::budget_test
