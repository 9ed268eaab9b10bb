// Where surfaces meet: cases in which a proxy was once lost, stuck, or pushed by the wrong one.

#include <gtest/gtest.h>

#include <iostream>

#include "tests/strokes/bodies.h"

namespace asperity::strokes {

namespace {

Instance mesh_at(const MeshSource& source, const Vec3& position, double k = test::stiffness) {
  Instance instance = instance_of(test::bare(source));
  instance.world_from_object.position = position;
  instance.material.stiffness = k;
  return instance;
}

Scene scene_from(std::vector<Instance> instances, double radius = 0.0) {
  return test::must(Scene::build(std::move(instances), radius));
}

/// One probe along a path, 0.1 mm a tick.
ForceSample follow(const Scene& scene, ProxyState& state, const Vec3& from, const Vec3& to) {
  const int ticks = std::max(1, static_cast<int>((to - from).norm() / 1e-4));
  ForceSample sample;
  for (const Vec3& p : test::line(from, to, ticks)) sample = test::touch(scene, state, p);
  return sample;
}

// A ball-shaped mesh sunk 2 mm into a floor, a point led into the wedge under it and on below the floor: the floor and
// the ball hold it, however far the solve carries the proxy.
TEST(Junctions, AWedgeUnderASunkBallHoldsAPoint) {
  const double radius = 0.01;
  const Vec3 centre(0.0, 0.0, radius - 2e-3);
  for (const int subdivisions : {2, 4}) {
    const Scene scene = scene_from(
        {mesh_at(box_mesh({0.08, 0.08, 0.02}), {0.0, 0.0, -0.01}), mesh_at(icosphere(subdivisions, radius), centre)});
    ProxyState state;
    follow(scene, state, {0.012, 0.0, 0.004}, {0.0085, 0.0, 0.002});
    // In the wedge, under the ball and under the floor: 45 degrees to both.
    ForceSample sample = follow(scene, state, {0.0085, 0.0, 0.002}, {0.0045, 0.0, -1.0e-3});
    for (int i = 0; i < 400; ++i) {
      // On along the floor, 1.5 mm deep, out from under the ball and back.
      const double x = 0.0045 + 0.006 * std::sin(0.01 * i);
      const Vec3 probe(x, 1e-4 * std::cos(0.02 * i), -1.5e-3);
      sample = test::touch(scene, state, probe);
      EXPECT_GT(sample.wrench.force.z(), 1.4) << subdivisions << ", tick " << i;
      EXPECT_GT(sample.proxy.z(), -1e-6) << subdivisions << ", tick " << i;
      EXPECT_GT((sample.proxy - centre).norm(), 0.95 * radius) << subdivisions << ", tick " << i;
      EXPECT_LT(sample.wrench.force.norm(), 8.0) << subdivisions << ", tick " << i;
    }
  }
}

// Exactly on a vertex where a floor and a wall meet, each pushes by its own stiffness.
TEST(Junctions, EachPushesByItsOwnStiffnessWhereCornersMeet) {
  // The floor's edge lies on the wall, with a vertex of either at the origin.
  MeshSource floor;
  floor.positions = {{0.0, -0.02, 0.0}, {0.02, -0.02, 0.0}, {0.02, 0.0, 0.0},
                     {0.0, 0.0, 0.0},   {0.02, 0.02, 0.0},  {0.0, 0.02, 0.0}};
  floor.triangles = {{0, 1, 2}, {0, 2, 3}, {3, 2, 4}, {3, 4, 5}};
  MeshSource wall;
  for (const Vec3& p : floor.positions) wall.positions.emplace_back(p.z(), p.y(), p.x());
  for (const auto& t : floor.triangles) wall.triangles.push_back({t[0], t[2], t[1]});
  const Scene scene = scene_from({mesh_at(floor, Vec3::Zero(), 1000.0), mesh_at(wall, Vec3::Zero(), 200.0)});
  for (const double y : {0.0, 1e-3, -3.7e-3, 1e-9}) {
    ProxyState state;
    test::touch(scene, state, {2e-3, y, 2e-3});
    const ForceSample sample = test::touch(scene, state, {-1e-3, y, -1e-3});
    EXPECT_NEAR(sample.wrench.force.x(), 0.2, 1e-3) << y;
    EXPECT_NEAR(sample.wrench.force.y(), 0.0, 1e-3) << y;
    EXPECT_NEAR(sample.wrench.force.z(), 1.0, 1e-3) << y;
  }
}

/// How often the forces of two scenes along one path differ by more than `bound` (N). `all`: what is in reach fits.
int differing(const Scene& one, const Scene& other, std::span<const Vec3> path, double bound, bool all) {
  ProxyState a;
  ProxyState b;
  ProxyCache cache_a(one);
  ProxyCache cache_b(other);
  int count = 0;
  int dropped = 0;
  for (const Vec3& p : path) {
    const ForceSample in_one = step(one, a, cache_a, test::probe_at(p), test::tick);
    const ForceSample in_other = step(other, b, cache_b, test::probe_at(p), test::tick);
    dropped += in_one.flags.has(TickFlag::contacts_dropped) ? 1 : 0;
    if ((in_one.wrench.force - in_other.wrench.force).norm() <= bound) continue;
    if (++count < 5)
      std::cout << "at " << p.transpose() << ": " << in_one.wrench.force.transpose() << " and "
                << in_other.wrench.force.transpose() << "\n";
  }
  if (all) {
    EXPECT_EQ(dropped, 0);
  }
  return count;
}

/// A walk 1 mm deep over a floor of 20 mm and along the walls beside it, up to 0.4 mm a tick.
std::vector<Vec3> walk_over_floor(int ticks, double radius) {
  std::vector<Vec3> path;
  for (int i = 0; i < ticks; ++i) {
    // Into the walls at -10 mm, not over the rim at 10 mm.
    const double x = -0.75e-3 + 0.01 * std::sin(0.037 * i);
    const double y = -0.75e-3 + 0.01 * std::sin(0.0231 * i);
    path.emplace_back(x, y, radius + (i == 0 ? 2e-3 : -1e-3 + 1.2e-3 * std::sin(0.011 * i)));
  }
  return path;
}

/// A floor of `side` x `side` tiles (20 mm in all) with two walls.
std::vector<Instance> tiled_floor(int side, bool as_one) {
  std::vector<Instance> instances;
  const double size = 0.02 / side;
  MeshSource all;
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      MeshSource tile = plane_grid(size, size, 1, 1);
      const Vec3 middle((i + 0.5) * size - 0.01, (j + 0.5) * size - 0.01, 0.0);
      if (!as_one) {
        instances.push_back(mesh_at(tile, middle));
        continue;
      }
      const auto first = static_cast<std::uint32_t>(all.positions.size());
      for (const Vec3& p : tile.positions) all.positions.emplace_back(p + middle);
      for (const auto& t : tile.triangles) all.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
  }
  if (as_one) instances.push_back(mesh_at(all, Vec3::Zero()));
  instances.push_back(mesh_at(box_mesh({0.01, 0.06, 0.02}), {-0.015, 0.0, 0.0}));
  instances.push_back(mesh_at(box_mesh({0.06, 0.01, 0.02}), {0.0, -0.015, 0.0}));
  return instances;
}

// 16 tiles and 2 walls, a ball of 2 mm: what it touches is felt, however many are in reach.
TEST(Junctions, MoreInstancesInReachThanSlots) {
  const double radius = 2e-3;
  const std::vector<Vec3> path = walk_over_floor(4000, radius);
  const Scene tiles = scene_from(tiled_floor(4, false), radius);
  const Scene one = scene_from(tiled_floor(4, true), radius);
  EXPECT_EQ(differing(tiles, one, path, 1e-6, true), 0);
}

// The same where a thousand small ones lie around: 32 x 32 tiles of 0.6 mm, touched by a point.
TEST(Junctions, AThousandInstances) {
  const std::vector<Vec3> path = walk_over_floor(2000, 0.0);
  const Scene tiles = scene_from(tiled_floor(32, false));
  const Scene one = scene_from(tiled_floor(32, true));
  EXPECT_EQ(differing(tiles, one, path, 1e-6, false), 0);
}

// Nobody says which sides: a closed mesh is a solid, whose probe is let out; an open one is a sheet.
TEST(Junctions, AClosedMeshIsTouchedFromItsFrontUnlessToldOtherwise) {
  for (const bool closed : {true, false}) {
    Instance instance;
    instance.name = "ball";
    MeshSource source = icosphere(2, 0.02);
    source.corner_uvs.clear();
    if (!closed) source.triangles.pop_back();
    instance.surface = test::bare(source);
    const Scene scene = scene_from({instance});
    ProxyState state;
    test::touch(scene, state, {0.0, 0.0, 0.0155});
    const ForceSample out = test::touch(scene, state, {0.0, 0.0, 0.021});
    EXPECT_EQ(out.wrench.force.norm() > 0.0, !closed);
    EXPECT_EQ(natural_sides(instance.surface), closed ? Sides::front : Sides::both);
  }
}

/// A relief in z = 0 of waves 2 mm long, 0.2 mm high.
std::shared_ptr<const ReliefSurface> waves() {
  const double turn = 2.0 * std::numbers::pi * 20.0;
  return test::coated(
      plane_grid(0.04, 0.04, 2, 2),
      test::map_of(512, [&](double s, double t) { return 0.1e-3 * (std::sin(turn * s) + std::cos(turn * t)); }),
      Mapping::uv, 0.04);
}

// A ball on a relief, pressed against a wall and led along it.
TEST(Junctions, ABallBesideAWallStaysOnTheRelief) {
  const auto relief = waves();
  for (const double radius : {0.5e-3, 1e-3, 3e-3}) {
    const Scene scene =
        scene_from({instance_of(relief), mesh_at(box_mesh({0.02, 0.06, 0.02}), {-0.01, 0.0, 0.0})}, radius);
    ProxyState state;
    ProxyCache cache(scene);
    int off_floor = 0;
    double lowest = infinity;
    for (int i = 0; i < 4000; ++i) {
      // 25 mm/s along the wall, 0.5 mm into the wall and the floor.
      const double y = 0.01 * std::sin(0.0025 * i);
      const double in = std::min(1.0, i / 200.0);
      const Vec3 probe((1.0 - in) * 2e-3 + radius - in * 0.5e-3, y, radius + 0.5e-3 - in * 1e-3);
      const ForceSample sample = step(scene, state, cache, test::probe_at(probe), test::tick);
      if (in < 1.0) continue;
      if (!(sample.wrench.force.z() > 0.05)) ++off_floor;
      lowest = std::min(lowest, sample.proxy.z() - radius);
    }
    EXPECT_EQ(off_floor, 0) << radius;
    EXPECT_GT(lowest, -0.21e-3) << radius;
  }
}

// A ball of 0.2 mm that falls by 2 mm in a tick is stopped in that tick, and is where a slow one comes to.
TEST(Junctions, AFastSmallBallIsStoppedInTheTick) {
  const double radius = 0.2e-3;
  const auto relief = waves();
  const Scene beside =
      scene_from({instance_of(relief), mesh_at(box_mesh({0.02, 0.06, 0.02}), {-0.012, 0.0, 0.0})}, radius);
  const Scene alone = scene_from({instance_of(relief)}, radius);
  Rng rng(2026);
  for (const Scene* scene : {&alone, &beside}) {
    for (int i = 0; i < 200; ++i) {
      const Vec3 above(rng.uniform(0.0, 0.01), rng.uniform(-0.01, 0.01), rng.uniform(0.6e-3, 1.4e-3));
      const Vec3 way = 2e-3 * Vec3(rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3), -1.0).normalized();
      ProxyState state;
      test::touch(*scene, state, above);
      const ForceSample fast = test::touch(*scene, state, above + way);
      EXPECT_GT(fast.wrench.force.norm(), 0.0) << i;
      EXPECT_GT(fast.proxy.z(), -0.2e-3) << i;
      EXPECT_FALSE(unfinished(fast.flags)) << i;
    }
  }
}

// A fine mesh touched by a fast point: no vertex keeps it.
TEST(Junctions, AFastPointIsNotKeptByAVertex) {
  const double radius = 0.03;
  const TriangleMesh base = test::mesh_of(icosphere(4, radius));
  const auto bumps = [](double x, double y, double z) {
    return 0.2e-3 * (std::sin(900.0 * x) + std::sin(1100.0 * y) + std::sin(1000.0 * z)) / 3.0;
  };
  const MeshSource source = displaced_mesh(base, 2, [&](std::uint32_t face, const Vec3& at) {
    const auto& t = base.triangles()[face];
    const Vec3 p = at[0] * base.positions()[t[0]] + at[1] * base.positions()[t[1]] + at[2] * base.positions()[t[2]];
    return bumps(p.x(), p.y(), p.z());
  });
  for (const double friction : {0.0, 0.3}) {
    Instance instance = mesh_at(source, Vec3::Zero());
    instance.material.static_friction = friction;
    instance.material.dynamic_friction = friction;
    const Scene scene = scene_from({instance});
    ProxyState state;
    ProxyCache cache;
    Rng rng(7);
    Vec3 direction = test::random_direction(rng);
    test::touch(scene, state, 1.1 * radius * direction);
    double largest = 0.0;
    for (int i = 0; i < 100000; ++i) {
      // Up to 5 m/s over the ball, 1 mm deep.
      const Vec3 turn = test::random_point(rng, 1.0);
      direction = (direction + rng.uniform(0.0, 5e-3) / radius * turn.normalized()).normalized();
      const Vec3 probe = (radius - 1e-3) * direction;
      const ForceSample sample = step(scene, state, cache, test::probe_at(probe), test::tick);
      const double force = sample.wrench.force.norm();
      largest = std::max(largest, force);
      ASSERT_GT(force, 0.75) << "tick " << i << ", friction " << friction;
      // 1.2 mm to the highest of it; friction drags behind by its angle, and as far as it went in the tick.
      ASSERT_LT(force, friction == 0.0 ? 1.5 * 1.25 : 1.5 * 1.7) << "tick " << i << ", friction " << friction;
    }
    RecordProperty("largest", std::to_string(largest));
  }
}

// A ball led along a box's edge and around it, now and then lifted off, is each time where the edge's round offset is
// nearest to the probe, however far it was pressed in one tick.
TEST(Junctions, ABallRollsAroundAnEdgeAndAlongIt) {
  const double radius = 1.5e-3;
  const double half = 0.02;
  const Scene scene = scene_from({mesh_at(box_mesh(Vec3::Constant(2.0 * half)), Vec3::Zero())}, radius);
  // Around the edge along y, at x = z = half.
  const auto around = [&](double y, double angle, double distance) -> Vec3 {
    return Vec3(half, y, half) + distance * Vec3(std::sin(angle), 0.0, std::cos(angle));
  };
  Rng rng(5);
  for (int stroke = 0; stroke < 200; ++stroke) {
    ProxyState state;
    double y = rng.uniform(-0.01, 0.01);
    double angle = rng.uniform(0.2, 1.3);
    test::touch(scene, state, around(y, angle, 1.1 * radius));
    for (int tick = 0; tick < 40; ++tick) {
      y += rng.uniform(-1.0, 1.0) * std::pow(10.0, rng.uniform(-6.0, -3.3));
      angle = std::clamp(angle + rng.uniform(-0.1, 0.1), 0.2, 1.3);
      const double distance = (rng.below(3) == 0 ? rng.uniform(1.01, 1.3) : rng.uniform(0.2, 0.95)) * radius;
      const ForceSample sample = test::touch(scene, state, around(y, angle, distance));
      EXPECT_FALSE(unfinished(sample.flags)) << "stroke " << stroke << ", tick " << tick;
      EXPECT_LT((sample.proxy - around(y, angle, std::max(radius, distance))).norm(), 2e-6)
          << "stroke " << stroke << ", tick " << tick << ", distance " << distance;
    }
  }
}

// A ball that comes to a smooth surface in long strides is stopped by friction where it touches it, not where the
// tangent plane ahead of it is known already.
TEST(Junctions, FrictionHoldsOnlyByWhatIsTouched) {
  const double radius = 1e-3;
  const double ball = 0.02;
  Instance instance = instance_of(
      std::make_shared<const CustomSurface>(test::must(CustomSurface::build(test::SmoothBall{test::Ball{ball}}))));
  instance.material.static_friction = 0.5;
  instance.material.dynamic_friction = 0.4;
  const Scene scene = scene_from({instance}, radius);
  Rng rng(6);
  for (int approach = 0; approach < 200; ++approach) {
    ProxyState state;
    const Vec3 up = test::random_direction(rng);
    Vec3 probe = (ball + radius + rng.uniform(0.01e-3, 0.5e-3)) * up;
    test::touch(scene, state, probe);
    const Vec3 stride = -rng.uniform(0.05e-3, 0.4e-3) * (up + 0.5 * test::random_direction(rng)).normalized();
    for (int tick = 0; tick < 8; ++tick) {
      probe += stride;
      const ForceSample sample = test::touch(scene, state, probe);
      if (sample.wrench.force.isZero()) continue;
      // A move of 2e-4 of its finest grain, here its radius, is not worth making.
      EXPECT_NEAR(sample.proxy.norm(), ball + radius, 1.5 * 2e-4 * ball)
          << "approach " << approach << ", tick " << tick;
    }
  }
}

}  // namespace

}  // namespace asperity::strokes
