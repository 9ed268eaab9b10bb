// The relief test: how true the proxy is on a displaced sphere, against the exact god-object on the formula.

#include <algorithm>
#include <iostream>

#include <fmt/format.h>

#include "tests/geometry/random_meshes.h"
#include "tests/render/analytic_relief.h"
#include "tests/surface/reliefs.h"

namespace asperity::test::relief_test {
namespace {

struct Truth {
  double mean = 0.0;  // degrees between the forces' directions
  double p99 = 0.0;
  double largest = 0.0;
  double jump = 0.0;  // N, largest change of force in one tick
  double exact_jump = 0.0;
  std::size_t lost = 0;  // ticks without contact
  std::size_t flagged = 0;
};

Truth compare(const WavySphere& sphere, const std::shared_ptr<const ReliefSurface>& relief, double depth,
              std::size_t ticks, double ball = 0.0) {
  Instance instance;
  instance.surface = relief;
  instance.sides = Sides::front;
  instance.material.stiffness = stiffness;
  const Scene scene = must(Scene::build({instance}, ball));
  const double advance = 0.05 * tick.count() / sphere.radius;
  const std::vector<Vec3> path = winding(advance, ticks);
  ExactGodObject exact(sphere, path.front(), ball);
  ProxyState state;
  ProxyCache cache(scene);
  step(scene, state, cache, probe_at(1.2 * sphere.radius * path.front()), tick);
  std::vector<double> errors;
  Truth truth;
  Vec3 last = Vec3::Zero();
  Vec3 last_exact = Vec3::Zero();
  for (std::size_t i = 0; i < ticks; ++i) {
    const Vec3 probe = (sphere.radius + ball - depth) * path[i];
    const ForceSample felt = step(scene, state, cache, probe_at(probe), tick);
    const Vec3 force = felt.wrench.force;
    const Vec3 right = stiffness * (exact.follow(probe) - probe);
    if (!felt.flags.has(TickFlag::contact)) ++truth.lost;
    if (unfinished(felt.flags) || felt.flags.has(TickFlag::energy_limited)) ++truth.flagged;
    errors.push_back(std::atan2(force.cross(right).norm(), force.dot(right)) * 180.0 / std::numbers::pi);
    if (i > 0) {
      truth.jump = std::max(truth.jump, (force - last).norm());
      truth.exact_jump = std::max(truth.exact_jump, (right - last_exact).norm());
    }
    last = force;
    last_exact = right;
  }
  for (const double error : errors) truth.mean += error / static_cast<double>(errors.size());
  std::sort(errors.begin(), errors.end());
  truth.p99 = errors[errors.size() * 99 / 100];
  truth.largest = errors.back();
  return truth;
}

Truth report(const WavySphere& sphere, int subdivisions, int texels) {
  const Truth truth = compare(sphere, baked(sphere, subdivisions, texels), 1.2e-3, 100000);
  std::cout << fmt::format(
      "{} triangles, {:.2f} mm: direction error mean {:.4f}, p99 {:.4f}, max {:.4f} degrees; jump {:.5f} N, exact "
      "{:.5f} "
      "N\n",
      20 * (1 << (2 * subdivisions)), 2e3 * sphere.amplitude, truth.mean, truth.p99, truth.largest, truth.jump,
      truth.exact_jump);
  EXPECT_EQ(truth.lost, 0U);
  EXPECT_EQ(truth.flagged, 0U);
  return truth;
}

TEST(ReliefTruth, displaced_sphere_on_a_coarse_base) {
  const WavySphere sphere;
  for (const auto& [subdivisions, texels] : {std::pair(3, 40), std::pair(4, 20)}) {
    const Truth truth = report(sphere, subdivisions, texels);
    EXPECT_LE(truth.mean, 0.3);
    EXPECT_LE(truth.p99, 1.0);
    EXPECT_LE(truth.largest, 3.0);
    EXPECT_LE(truth.jump, 1.3 * truth.exact_jump);
  }
}

// Bent by at most 1 / 4 mm, so that a ball of 3 mm still has one contact everywhere: its middle is led over the
// parallel surface.
TEST(ReliefTruth, balls_on_a_displaced_sphere_are_led_over_its_offset) {
  const WavySphere sphere;
  const auto relief = baked(sphere, 3, 40);
  for (const double ball : {0.5e-3, 1e-3, 3e-3}) {
    const Truth truth = compare(sphere, relief, 1.2e-3, 20000, ball);
    std::cout << fmt::format(
        "ball of {} mm: direction error mean {:.4f}, p99 {:.4f}, max {:.4f} degrees; jump {:.5f} N, exact {:.5f} N\n",
        1e3 * ball, truth.mean, truth.p99, truth.largest, truth.jump, truth.exact_jump);
    EXPECT_EQ(truth.lost, 0U);
    EXPECT_EQ(truth.flagged, 0U);
    EXPECT_LE(truth.mean, 0.15);
    EXPECT_LE(truth.p99, 0.7);
    EXPECT_LE(truth.jump, 1.3 * truth.exact_jump);
  }
}

// A tree is a way to find faces: no force hangs on how it was cut. Without a budget, of which looking takes some more
// or less.
TEST(ReliefTruth, forces_do_not_depend_on_how_the_tree_is_cut) {
  Rng rng(31);
  int touching = 0;
  for (int m = 0; m < 6; ++m) {
    const TriangleMesh mesh = mesh_of(overlapping_blobs(rng, 0.05));
    const auto first = relief_on(mesh, {tiled(wavy_map(3e-3, 16), 0.01)}, {Mapping::triplanar});
    const auto other = std::make_shared<const ReliefSurface>(MeshSurface(otherwise_cut(mesh)), first->coat());
    std::vector<Scene> scenes;
    for (const auto& relief : {first, other}) {
      Instance instance;
      instance.surface = relief;
      instance.sides = Sides::front;
      instance.material.stiffness = stiffness;
      scenes.push_back(must(Scene::build({instance}, {.budget = 0})));
    }
    ProxyState states[2];
    Vec3 probe = 0.1 * random_direction(rng);
    Vec3 heading = -probe.normalized();
    for (int i = 0; i < 4000; ++i) {
      wander(rng, 0.05, probe, heading);
      const Vec3 force = touch(scenes[0], states[0], probe).wrench.force;
      touching += force.isZero(0.0) ? 0 : 1;
      ASSERT_EQ(touch(scenes[1], states[1], probe).wrench.force, force) << "mesh " << m << ", tick " << i;
    }
  }
  EXPECT_GT(touching, 5000);
}

}  // namespace
}  // namespace asperity::test::relief_test
