// Torque about where the hand holds the tool.

#include <gtest/gtest.h>

#include "tests/geometry/random_meshes.h"
#include "tests/render/fixtures.h"
#include "tests/render/sheets.h"

namespace asperity::test {
namespace {

constexpr double radius = 5e-4;  // m

Scene scene_with_tool(double length, const Vec3& axis, double friction, const View& view = {}) {
  Instance instance;
  instance.name = "sheet";
  instance.surface = std::make_shared<const MeshSurface>(sheet());
  instance.material.stiffness = stiffness;
  instance.material.static_friction = instance.material.dynamic_friction = friction;
  SceneSettings settings;
  settings.probe_radius = radius * view.zoom;
  settings.tool_length = length;
  settings.tool_axis = axis;
  settings.view = view;
  return must(Scene::build({instance}, settings));
}

/// A ball that comes down beside the middle and is then dragged along, in the scene's own places.
ForceSample dragged(const Scene& scene, const Quat& orientation, const Vec3& end) {
  const View& view = scene.settings().view;
  ProxyState state;
  ForceSample felt;
  const Vec3 start = end + Vec3(1e-3, 0.0, 2e-3);
  const Vec3 above(start.x(), 2e-3, start.z());
  const auto go = [&](const Vec3& from, const Vec3& to) {
    for (int i = 0; i <= 20; ++i) {
      ProbeSample probe = probe_at(view.to_workspace(from + i / 20.0 * (to - from)));
      probe.pose.orientation = orientation;
      felt = step(scene, state, probe, tick);
    }
  };
  go(above, start);
  go(start, end);
  return felt;
}

TEST(Torque, without_a_tool_there_is_none) {
  const ForceSample felt = dragged(scene_with_tool(0.0, Vec3::UnitY(), 0.5), Quat::Identity(), Vec3(0.0, 0.0, 0.0));
  EXPECT_GT(felt.wrench.force.norm(), 0.3);
  EXPECT_EQ(felt.wrench.torque, Vec3::Zero());
}

TEST(Torque, a_force_turns_by_its_arm_from_the_grip_to_where_it_touches) {
  Rng rng(20);
  for (int i = 0; i < 60; ++i) {
    const Quat orientation = Quat(Eigen::AngleAxisd(rng.uniform(0.0, 3.0), random_direction(rng)));
    const Vec3 axis = random_direction(rng);
    const double length = rng.uniform(0.01, 0.2);
    const Scene scene = scene_with_tool(length, axis, i % 2 == 0 ? 0.0 : 0.6);
    const ForceSample felt = dragged(scene, orientation, Vec3(1e-3, rng.uniform(-1e-3, 2e-4), 0.0));
    const Vec3 force = felt.wrench.force;
    ASSERT_GT(force.norm(), 0.2);
    // Of a flat sheet: straight below the ball.
    const Vec3 touched = felt.proxy - radius * Vec3::UnitY();
    const Vec3 grip = felt.proxy + length * (orientation * axis);
    ASSERT_LT((felt.wrench.torque - (touched - grip).cross(force)).norm(), 1e-9) << i;
    ASSERT_EQ(std::abs(force.x()) > 0.05, i % 2 != 0) << i;
  }
}

TEST(Torque, is_what_the_stored_energy_changes_by_as_the_tool_turns_about_its_grip) {
  Rng rng(21);
  for (int i = 0; i < 30; ++i) {
    const Vec3 axis = random_direction(rng);
    const double length = rng.uniform(0.01, 0.2);
    const Scene scene = scene_with_tool(length, axis, 0.0);
    const Vec3 tip(0.0, rng.uniform(-1e-3, 2e-4), 0.0);
    const Vec3 grip = tip + length * axis;
    const auto energy = [&](const Vec3& turn) {
      const Vec3 there = grip + Quat(Eigen::AngleAxisd(turn.norm(), turn.normalized())) * (tip - grip);
      const ForceSample felt = poke(scene, Vec3(there.x(), 2e-3, there.z()), there);
      return 0.5 * stiffness * felt.contact.penetration * felt.contact.penetration;
    };
    const Vec3 torque = poke(scene, Vec3(0.0, 2e-3, 0.0), tip).wrench.torque;
    for (int k = 0; k < 3; ++k) {
      constexpr double turn = 1e-5;
      const double slope = (energy(turn * Vec3::Unit(k)) - energy(-turn * Vec3::Unit(k))) / (2.0 * turn);
      ASSERT_NEAR(torque[k], -slope, 1e-6 * stiffness * 1e-3 * length + 1e-8) << "case " << i << ", axis " << k;
    }
  }
}

TEST(Torque, of_what_is_shown_larger_is_the_workspaces_own) {
  View view;
  view.zoom = 8.0;
  view.home = Vec3(0.1, -0.05, 0.02);
  view.orientation = Quat(Eigen::AngleAxisd(0.7, Vec3(0.3, 0.9, -0.2).normalized()));
  const Vec3 axis = Vec3(0.2, 0.9, 0.3).normalized();
  const double length = 0.12;
  const Scene scene = scene_with_tool(length, axis, 0.5, view);
  const Quat orientation(Eigen::AngleAxisd(0.4, Vec3::UnitX()));
  const ForceSample felt = dragged(scene, orientation, Vec3(0.0, 0.0, 0.0));
  ASSERT_GT(felt.wrench.force.norm(), 0.02);
  const Vec3 touched = view.to_workspace(felt.proxy - radius * Vec3::UnitY());
  const Vec3 grip = view.to_workspace(felt.proxy) + length * (orientation * axis);
  EXPECT_LT((felt.wrench.torque - (touched - grip).cross(felt.wrench.force)).norm(), 1e-9);
}

TEST(Torque, each_tool_that_is_none_is_named) {
  for (const double length : {-1e-3, std::nan(""), infinity}) {
    SceneSettings settings;
    settings.tool_length = length;
    const auto scene = Scene::build({}, settings);
    ASSERT_FALSE(scene.ok());
    EXPECT_EQ(scene.error().place, "probe.tool_length");
  }
  for (const Vec3& axis : {Vec3(Vec3::Zero()), Vec3(0.0, 2.0, 0.0), Vec3(0.0, std::nan(""), 1.0)}) {
    SceneSettings settings;
    settings.tool_axis = axis;
    const auto scene = Scene::build({}, settings);
    ASSERT_FALSE(scene.ok());
    EXPECT_EQ(scene.error().place, "probe.tool_axis");
  }
}

}  // namespace
}  // namespace asperity::test
