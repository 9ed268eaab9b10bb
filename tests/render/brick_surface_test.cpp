// Isosurfaces of volumes that are not in memory as a whole.

#include "tests/field/brick_fixture.h"

#include <chrono>
#include <thread>
#include <vector>

#include "asperity/render/step.h"
#include "tests/field/volumes.h"

namespace asperity::brick_surface_test {
namespace {

using BrickSurface = BrickFiles;

ScalarGrid wavy_sphere(std::uint32_t count) {
  return test::sampled(test::cube_axes(0.05, count),
                       [](const Vec3& p) { return p.norm() + 0.0003 * std::sin(p.x() / 0.002); });
}

Scene scene_on(std::shared_ptr<const ScalarField> field, double probe_radius = 0.0) {
  Instance instance;
  instance.name = "sphere";
  instance.surface = std::make_shared<const IsoSurface>(IsoSurface::build(std::move(field), 0.03, Inside::low).value());
  return Scene::build({instance}, probe_radius).value();
}

Vec3 over_sphere(double arc, double depth) {
  const double angle = arc / 0.03;
  return (0.03 - depth) * Vec3(std::sin(angle), 0.2 * std::sin(3.0 * angle), std::cos(angle)).normalized();
}

ProbeSample at(const Vec3& position) {
  ProbeSample probe;
  probe.pose.position = position;
  return probe;
}

TEST_F(BrickSurface, FetchedIsFeltBitForBitAsInMemory) {
  const ScalarGrid grid = wavy_sphere(100);
  ASSERT_TRUE(write_brick_file(path(), grid, {}));
  for (const CellReconstruction reconstruction : {CellReconstruction::trilinear, CellReconstruction::smooth}) {
    auto store = BrickStore::open(path(), {std::size_t{16} << 20, false});
    ASSERT_TRUE(store) << store.error().message();
    const auto bricked = std::make_shared<const ScalarField>(std::move(*store), reconstruction);
    const Scene held = scene_on(std::make_shared<const ScalarField>(grid, reconstruction));
    const Scene streamed = scene_on(bricked);
    ProxyState a;
    ProxyState b;
    for (int i = 0; i < 1500; ++i) {
      const ProbeSample probe = at(over_sphere(6e-5 * i, i == 0 ? -0.002 : 0.0008));
      ASSERT_TRUE(fetch_volumes(streamed, b, probe));
      const ForceSample in_memory = step(held, a, probe, Seconds(1e-3));
      const ForceSample from_bricks = step(streamed, b, probe, Seconds(1e-3));
      ASSERT_EQ(in_memory.wrench.force, from_bricks.wrench.force) << i;
      ASSERT_EQ(from_bricks.level, 0);
      ASSERT_FALSE(from_bricks.flags.has(TickFlag::coarse_data));
      if (i > 0) {
        ASSERT_TRUE(from_bricks.flags.has(TickFlag::contact)) << i;
      }
    }
  }
}

TEST_F(BrickSurface, ABallAsksForAllThatItTouches) {
  // Six cells of radius, in bricks of 32: what it rests on is often in another brick than its centre. The oracle has
  // all of the file in memory.
  ASSERT_TRUE(write_brick_file(path(), wavy_sphere(100), {}));
  constexpr double radius = 0.006;
  auto whole_store = BrickStore::open(path(), {std::size_t{16} << 20, false});
  auto store = BrickStore::open(path(), {std::size_t{16} << 20, false});
  ASSERT_TRUE(whole_store && store);
  ASSERT_TRUE((*whole_store)->fetch(whole((*whole_store)->axes(0)), 0));
  const Scene held = scene_on(std::make_shared<const ScalarField>(std::move(*whole_store)), radius);
  const Scene streamed = scene_on(std::make_shared<const ScalarField>(std::move(*store)), radius);
  ProxyState a;
  ProxyState b;
  for (int i = 0; i < 80; ++i) {
    const ProbeSample probe = at(over_sphere(3e-4 * i, i == 0 ? -0.009 : 0.0008 - radius));
    ASSERT_TRUE(fetch_volumes(streamed, b, probe));
    const ForceSample in_memory = step(held, a, probe, Seconds(1e-3));
    const ForceSample from_bricks = step(streamed, b, probe, Seconds(1e-3));
    ASSERT_EQ(from_bricks.level, 0) << i;
    ASSERT_EQ(in_memory.wrench.force, from_bricks.wrench.force) << i;
    if (i > 0) {
      ASSERT_TRUE(from_bricks.flags.has(TickFlag::contact)) << i;
    }
  }
}

/// What is missing is felt from a coarser level, said so, and recorded so that a replay answers the same bits.
TEST_F(BrickSurface, MissingBricksAreFeltCoarselyAndReplayEqual) {
  ASSERT_TRUE(write_brick_file(path(), wavy_sphere(150), {}));
  auto live_store = BrickStore::open(path(), {std::size_t{24} << 20, false});
  auto replay_store = BrickStore::open(path(), {std::size_t{24} << 20, false});
  ASSERT_TRUE(live_store && replay_store);
  ASSERT_GT((*live_store)->levels(), 1);
  const Scene live = scene_on(std::make_shared<const ScalarField>(std::move(*live_store)));
  const Scene again = scene_on(std::make_shared<const ScalarField>(std::move(*replay_store)));
  ProxyState state;
  ProxyState replayed;
  int coarse = 0;
  int fine = 0;
  Vec3 last = Vec3::Zero();
  double jump = 0.0;
  for (int i = 0; i < 3000; ++i) {
    const ProbeSample probe = at(over_sphere(2e-5 * i, i < 3 ? -0.002 : 0.0008));
    // Bricks come late, as from a slow disk.
    if (i % 700 == 350) {
      ASSERT_TRUE(fetch_volumes(live, state, probe));
    }
    const ForceSample out = step(live, state, probe, Seconds(1e-3));
    EXPECT_EQ(out.flags.has(TickFlag::coarse_data), out.level > 0);
    (out.level > 0 ? coarse : fine) += 1;
    replayed.wanted_level = out.level;
    ASSERT_TRUE(fetch_volumes(again, replayed, probe));
    const ForceSample same = step(again, replayed, probe, Seconds(1e-3));
    ASSERT_EQ(same.wrench.force, out.wrench.force) << i;
    ASSERT_EQ(same.level, out.level);
    if (i > 4) {
      ASSERT_TRUE(out.flags.has(TickFlag::contact)) << i;
      jump = std::max(jump, (out.wrench.force - last).norm());
    }
    last = out.wrench.force;
  }
  EXPECT_GT(coarse, 500);
  EXPECT_GT(fine, 200);
  // Levels differ by up to 0.3 mm here, 0.3 N: the surface goes there at 20 mm/s, 0.02 N a tick, and turns by its
  // slopes.
  EXPECT_LT(jump, 0.06);
}

TEST_F(BrickSurface, EffectsAskTheSameBricks) {
  ASSERT_TRUE(write_brick_file(path(), wavy_sphere(80), {}));
  auto store = BrickStore::open(path(), {std::size_t{16} << 20, false});
  ASSERT_TRUE(store);
  FieldEffect effect;
  effect.name = "pull";
  effect.field = std::make_shared<const ScalarField>(std::move(*store));
  effect.kind = FieldEffectKind::gradient;
  effect.transfer = TransferFunction::build({{0.0, 1.0}}).value();
  const Scene scene = Scene::build({}, 0.0, {effect}).value();
  ProxyState state;
  const ProbeSample probe = at(Vec3(0.0, 0.0, 0.04));
  const ForceSample coarse = step(scene, state, probe, Seconds(1e-3));
  EXPECT_TRUE(coarse.flags.has(TickFlag::coarse_data));
  EXPECT_NEAR(coarse.wrench.force.z(), 1.0, 0.2);
  ASSERT_TRUE(fetch_volumes(scene, state, probe));
  const ForceSample fine = step(scene, state, probe, Seconds(1e-3));
  EXPECT_FALSE(fine.flags.has(TickFlag::coarse_data));
  EXPECT_NEAR(fine.wrench.force.z(), 1.0, 0.01);
  EXPECT_TRUE(fine.flags.has(TickFlag::field_force));
  EXPECT_FALSE(fine.flags.has(TickFlag::contact));
}

/// The background thread keeps up with a probe in real time; what it has not read yet is only coarser.
TEST_F(BrickSurface, TheStreamingThreadBringsTheFinestLevel) {
  ASSERT_TRUE(write_brick_file(path(), wavy_sphere(150), {}));
  auto store = BrickStore::open(path(), {std::size_t{24} << 20, true});
  ASSERT_TRUE(store);
  const Scene scene = scene_on(std::make_shared<const ScalarField>(std::move(*store)));
  ProxyState state;
  ForceSample out;
  for (int i = 0; i < 4000; ++i) {
    out = step(scene, state, at(Vec3(0.0, 0.0, i < 2 ? 0.032 : 0.0293)), Seconds(1e-3));
    if (i > 2 && out.level == 0) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(out.level, 0);
  EXPECT_TRUE(out.flags.has(TickFlag::contact));
}

}  // namespace
}  // namespace asperity::brick_surface_test
