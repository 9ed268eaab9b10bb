// Surfaces that move, deform, change their coat, their level of detail or their size while they are touched.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "asperity/geometry/generators.h"
#include "asperity/geometry/mesh_refitter.h"
#include "tests/render/sheets.h"

namespace asperity::test::change_test {
namespace {

// A coat that is swapped under a resting hand: the place goes along, what it would give is paid for, the force does not
// jump.
TEST(Change, A_lower_coat_lets_go_smoothly_and_gives_nothing) {
  const MeshSurface base = sheet();
  const Scene high = scene_with(flat_relief(base, 0.5e-3));
  const Scene low = scene_with(flat_relief(base, 0.1e-3));
  ProxyState state;
  const Vec3 place(0.003, 0.0, 0.002);
  const Vec3 before = press(high, state, place, 0.5e-3).wrench.force;
  ASSERT_NEAR(before.y(), stiffness * depth, 1e-6);
  const Vec3 probe = place + Vec3(0.0, 0.5e-3 - depth, 0.0);
  std::vector<Vec3> forces{before};
  for (int i = 0; i < 200; ++i) forces.push_back(touch(low, state, probe).wrench.force);
  EXPECT_NEAR(forces.back().y(), stiffness * (depth - 0.4e-3), 1e-6);
  // Without a hand-over it would jump by 0.4 N at once.
  EXPECT_LT(largest_jump(forces), 0.06);
}

TEST(Change, A_higher_coat_is_paid_for_or_felt_softer) {
  const MeshSurface base = sheet();
  for (const bool full : {false, true}) {
    const Scene low = scene_with(flat_relief(base, 0.1e-3));
    const Scene high = scene_with(flat_relief(base, 0.5e-3));
    ProxyState state;
    const Vec3 place(0.003, 0.0, 0.002);
    const Vec3 before = press(low, state, place, 0.1e-3).wrench.force;
    state.account = {};
    if (full) state.account.fill(1.0);
    const Vec3 probe = place + Vec3(0.0, 0.1e-3 - depth, 0.0);
    std::vector<Vec3> forces{before};
    double stored = 0.0;
    for (int i = 0; i < 200; ++i) {
      const ForceSample sample = touch(high, state, probe);
      forces.push_back(sample.wrench.force);
      stored = 0.5 * state.spring.stiffness * (state.proxy - probe).squaredNorm();
    }
    // The spring is longer by 0.4 mm and holds no more than it did.
    if (full) {
      EXPECT_LT(largest_jump(forces), 0.06);
      EXPECT_NEAR(forces.back().y(), stiffness * (depth + 0.4e-3), 5e-3);
    } else {
      // Nothing pays for a force as large as before: half the square of the spring, over its length.
      EXPECT_LE(stored, 0.5 * stiffness * depth * depth * (1.0 + 1e-6));
      EXPECT_NEAR(forces.back().y(), 1.0 / 1.4, 1e-6);
    }
    EXPECT_NEAR((state.proxy - probe).norm(), depth + 0.4e-3, 1e-6);
  }
}

// Moved vertices: the proxy goes along with its place.
TEST(Change, A_refitted_mesh_takes_the_proxy_along) {
  const MeshSurface base = sheet();
  const TriangleMesh& mesh = base.mesh();
  MeshRefitter refitter(base.index());
  for (const bool coated : {false, true}) {
    SCOPED_TRACE(coated);
    const auto surface_of = [&](const MeshSurface& moved) -> Surface {
      if (coated) return flat_relief(moved, 0.2e-3);
      return std::make_shared<const MeshSurface>(moved);
    };
    ProxyState state;
    const Scene first = scene_with(surface_of(base));
    const double height = coated ? 0.2e-3 : 0.0;
    const Vec3 place(0.003, 0.0, 0.002);
    press(first, state, place, height);
    const Vec3 probe = place + Vec3(0.0, height - depth, 0.0);
    // It sinks by 10 um a frame, 1 mm/s at 100 frames a second.
    std::vector<Vec3> positions(mesh.positions().begin(), mesh.positions().end());
    double sunk = 0.0;
    std::vector<Vec3> forces;
    for (int frame = 0; frame < 30; ++frame) {
      sunk += 1e-5;
      for (std::size_t i = 0; i < positions.size(); ++i) positions[i] = mesh.positions()[i] - Vec3(0.0, sunk, 0.0);
      const Scene scene = scene_with(surface_of(MeshSurface(must(refitter.moved(positions)))));
      for (int i = 0; i < 10; ++i) forces.push_back(touch(scene, state, probe).wrench.force);
    }
    EXPECT_LT(largest_jump(forces), 2.0 * stiffness * 1e-5);
    for (int i = 0; i < 100; ++i) {
      const Scene scene = scene_with(surface_of(MeshSurface(must(refitter.moved(positions)))));
      forces.push_back(touch(scene, state, probe).wrench.force);
    }
    EXPECT_NEAR(forces.back().y(), stiffness * (depth - sunk), 1e-3);
  }
}

// A surface that rises under a resting hand whose account is empty may not do work on it; with power it may.
TEST(Change, A_rising_instance_pushes_with_what_it_is_given) {
  const MeshSurface base = sheet();
  Motion rising;
  rising.velocity.linear = Vec3(0.0, 5e-3, 0.0);
  rising.horizon = Seconds(10.0);
  for (const double power : {0.0, 1.0}) {
    SceneSettings settings;
    settings.change_power = power;
    for (const bool coated : {false, true}) {
      const Scene scene =
          scene_with(coated ? flat_relief(base, 0.0) : Surface(std::make_shared<const MeshSurface>(base)), settings,
                     ProxyLaw{}, rising);
      ProxyState state;
      const Vec3 hand(0.003, 2e-3, 0.002);
      ForceSample sample;
      double stored = 0.0;
      for (int i = 0; i < 800; ++i) {
        sample = at_time(scene, state, hand, 1e-3 * i);
        stored = 0.5 * state.spring.stiffness * (state.proxy - hand).squaredNorm();
        if (power == 0.0) {
          ASSERT_LE(stored, 1e-12);
        }
      }
      // 4 mm up: 2 mm beyond the hand.
      EXPECT_NEAR(sample.proxy.y(), 3.995e-3, 2e-5) << coated;
      if (power > 0.0) {
        EXPECT_NEAR(sample.wrench.force.y(), stiffness * 1.995e-3, 0.03) << coated;
      }
    }
  }
}

TEST(Change, A_moving_instance_is_the_same_as_a_hand_that_moves_the_other_way) {
  // A sphere that flies past under a still hand, and a hand that flies over a still sphere.
  const MeshSurface sphere(TriangleIndex::build(mesh_of(icosphere(3, 0.02))));
  const Vec3 velocity(0.03, 0.0, 0.0);
  Motion motion;
  motion.velocity.linear = velocity;
  motion.horizon = Seconds(10.0);
  SceneSettings settings;
  settings.change_power = 10.0;
  settings.handover = Seconds(0.0);
  const Scene moving = scene_with(std::make_shared<const MeshSurface>(sphere), settings, ProxyLaw{}, motion);
  const Scene still = scene_with(std::make_shared<const MeshSurface>(sphere), settings);
  ProxyState one;
  ProxyState other;
  double worst = 0.0;
  for (int i = 0; i < 1000; ++i) {
    const double time = 1e-3 * i;
    const Vec3 hand(0.015, 0.019, 0.001);
    const ForceSample a = at_time(moving, one, hand, time);
    const ForceSample b = at_time(still, other, hand - time * velocity, time);
    one.account.fill(1.0);
    other.account.fill(1.0);
    worst = std::max(worst, (a.wrench.force - b.wrench.force).norm());
  }
  EXPECT_LT(worst, 1e-3);
}

// Passivity through every kind of change at once: whatever the scenes do, the hand gets out what it put in.
TEST(Change, The_hand_never_gains_through_changes) {
  const MeshSurface base = sheet();
  const TriangleMesh& mesh = base.mesh();
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (const char* law : {"proxy", "height-field", "mesostructure", "god-object"}) {
    SCOPED_TRACE(law);
    MeshRefitter refitter(base.index());
    ProxyState state;
    double work = 0.0;  // done on the hand
    double most_work = 0.0;
    Vec3 hand(0.0, 2e-3, 0.0);
    Vec3 force = Vec3::Zero();
    double phase = 0.0;
    Scene scene = scene_with(flat_relief(base, 0.0), {}, named(law));
    std::vector<Vec3> positions(mesh.positions().begin(), mesh.positions().end());
    for (int i = 0; i < 20000; ++i) {
      if (i % 40 == 0) {
        phase += unit(random);
        SceneSettings settings;
        settings.view.zoom = std::exp(0.3 * std::sin(0.01 * i));
        Motion motion;
        motion.velocity.linear = Vec3(0.01 * unit(random), 0.01 * unit(random), 0.0);
        motion.since = Seconds(1e-3 * i);
        motion.horizon = Seconds(0.02);
        for (std::size_t k = 0; k < positions.size(); ++k)
          positions[k] = mesh.positions()[k] + Vec3(0.0, 3e-4 * std::sin(phase + 200.0 * mesh.positions()[k].x()), 0.0);
        const MeshSurface moved(must(refitter.moved(positions)));
        scene = scene_with(relief(moved, coat_of(moved, tiled(wavy_map(1e-4 * (1.5 + unit(random)), 16), 0.01))),
                           settings, named(law), motion);
      }
      const Vec3 next(0.004 * std::sin(0.003 * i), 1e-3 * std::sin(0.011 * i), 0.003 * std::cos(0.002 * i));
      work += force.dot(next - hand);
      most_work = std::max(most_work, work);
      hand = next;
      force = at_time(scene, state, hand, 1e-3 * i).wrench.force;
    }
    // Zero-order hold gives the spring's second-order share: 1/2 k v^2 T^2 a tick while it is let out.
    const double held = 20000.0 * 0.5 * stiffness * 1.5e-5 * 1.5e-5 * 0.25;
    EXPECT_LT(most_work, held) << most_work;
    EXPECT_LT(work, held);
  }
}

// What carries a proxy does not carry it through what else is there.
TEST(Change, A_floor_that_moves_presses_the_proxy_against_a_wall_and_not_through_it) {
  const MeshSurface floor = sheet(0.2);
  MeshSource upright = plane_grid(0.2, 0.2, 2, 2);
  for (Vec3& p : upright.positions) p = Vec3(-p.z() + 0.01, p.y(), p.x());
  const auto wall = std::make_shared<const MeshSurface>(TriangleIndex::build(mesh_of(std::move(upright))));
  for (const double friction : {0.0, 0.5}) {
    Instance moving;
    moving.name = "floor";
    moving.surface = std::make_shared<const MeshSurface>(floor);
    moving.material.stiffness = stiffness;
    moving.material.static_friction = moving.material.dynamic_friction = friction;
    moving.motion.velocity.linear = Vec3(0.1, 0.0, 0.0);
    moving.motion.horizon = Seconds(1.0);
    Instance still;
    still.name = "wall";
    still.surface = wall;
    still.material.stiffness = stiffness;
    SceneSettings settings;
    settings.change_power = 1.0;
    const Scene scene = must(Scene::build({moving, still}, settings));
    ProxyState state;
    for (int i = 0; i < 200; ++i) {
      // Pressed down, and by and by against the wall at x = 10 mm.
      const Vec3 hand(9e-3 + 1.5e-3 * std::min(1.0, i / 100.0), 1e-3 - 2e-3 * std::min(1.0, i / 50.0), 0.0);
      const ForceSample sample = at_time(scene, state, hand, 1e-3 * i);
      ASSERT_LE(sample.proxy.x(), 0.01 + 1e-6) << i << " " << friction;
      ASSERT_GE(sample.proxy.y(), -1e-6) << i << " " << friction;
    }
  }
}

TEST(Change, A_deforming_sheet_that_passes_a_free_probe_is_felt) {
  const MeshSurface base = sheet();
  const TriangleMesh& mesh = base.mesh();
  for (const bool coated : {false, true}) {
    MeshRefitter refitter(base.index());
    SceneSettings settings;
    settings.change_power = 1.0;
    ProxyState state;
    const Vec3 hand(0.003, 1e-3, 0.002);
    double most = 0.0;
    std::vector<Vec3> positions(mesh.positions().begin(), mesh.positions().end());
    for (int i = 0; i < 40; ++i) {
      for (std::size_t k = 0; k < positions.size(); ++k) positions[k] = mesh.positions()[k] + Vec3(0.0, 5e-5 * i, 0.0);
      const MeshSurface moved(must(refitter.moved(positions)));
      const Scene scene =
          scene_with(coated ? flat_relief(moved, 0.0) : Surface(std::make_shared<const MeshSurface>(moved)), settings);
      for (int k = 0; k < 5; ++k) most = std::max(most, touch(scene, state, hand).wrench.force.y());
    }
    EXPECT_GT(most, 0.5) << coated;
  }
}

TEST(Change, A_coat_put_on_and_taken_off_under_a_pressed_probe_keeps_it_outside) {
  const MeshSurface base = sheet();
  const Scene bare = scene_with(std::make_shared<const MeshSurface>(base));
  for (const double height : {0.5e-3, -0.5e-3}) {
    const Scene coated = scene_with(flat_relief(base, height));
    const Vec3 place(0.003, 0.0, 0.002);
    ProxyState on;
    press(bare, on, place, 0.0);
    on.account.fill(1.0);
    const Vec3 deep = place - Vec3(0.0, depth, 0.0);
    Vec3 force;
    for (int i = 0; i < 100; ++i) force = touch(coated, on, deep).wrench.force;
    EXPECT_NEAR(force.y(), stiffness * (depth + height), 5e-3) << height;
    ProxyState off;
    press(coated, off, place, height);
    off.account.fill(1.0);
    const Vec3 pressed = place + Vec3(0.0, height - depth, 0.0);
    for (int i = 0; i < 100; ++i) force = touch(bare, off, pressed).wrench.force;
    EXPECT_NEAR(force.y(), std::max(0.0, stiffness * (depth - height)), 5e-3) << height;
  }
}

TEST(Change, Zooming_while_touched_changes_no_force) {
  const MeshSurface base = sheet();
  for (const char* law : {"proxy", "mesostructure", "height-field"}) {
    for (const double zoom : {0.25, 4.0}) {
      Instance instance;
      instance.name = "test";
      instance.surface = flat_relief(base, 0.0);
      instance.law = named(law);
      instance.material.stiffness = stiffness;
      instance.material.static_friction = instance.material.dynamic_friction = 0.3;
      instance.material.friction.kind = FrictionKind::dahl;
      instance.material.friction_named = true;
      SceneSettings settings;
      const Scene plain = must(Scene::build({instance}, settings));
      settings.view.zoom = zoom;
      settings.handover = Seconds(0.0);
      const Scene zoomed = must(Scene::build({instance}, settings));
      ProxyState state;
      press(plain, state, Vec3::Zero(), 0.0);
      Vec3 hand(0.0, -depth, 0.0);
      for (int i = 0; i < 50; ++i) {
        hand.x() += 2e-5;
        touch(plain, state, hand);
      }
      const Vec3 before = touch(plain, state, hand).wrench.force;
      ASSERT_LT(before.x(), -0.1) << law;
      const double account = state.account.level();
      const Vec3 after = touch(zoomed, state, hand).wrench.force;
      EXPECT_NEAR((after - before).norm(), 0.0, 2e-3) << law << " " << zoom;
      EXPECT_NEAR(state.account.level(), account, 1e-6) << law << " " << zoom;
    }
  }
}

/// A sheet with friction that draws back like a spring, in a view of its own.
Scene rubbed_in(double zoom, const char* law) {
  Instance instance;
  instance.name = "test";
  instance.surface = flat_relief(sheet(), 0.0);
  instance.law = named(law);
  instance.material.stiffness = stiffness;
  instance.material.static_friction = instance.material.dynamic_friction = 0.3;
  instance.material.friction.kind = FrictionKind::dahl;
  instance.material.friction_named = true;
  SceneSettings settings;
  settings.view.zoom = zoom;
  settings.handover = Seconds(0.0);
  return must(Scene::build({instance}, settings));
}

TEST(Change, Scenes_that_follow_in_a_zoomed_view_are_zoomed_once) {
  for (const char* law : {"proxy", "mesostructure", "height-field"}) {
    ProxyState state;
    press(rubbed_in(1.0, law), state, Vec3::Zero(), 0.0);
    Vec3 hand(0.0, -depth, 0.0);
    const Scene plain = rubbed_in(1.0, law);
    for (int i = 0; i < 50; ++i) {
      hand.x() += 2e-5;
      touch(plain, state, hand);
    }
    const Vec3 before = touch(plain, state, hand).wrench.force;
    ASSERT_LT(before.x(), -0.1) << law;
    const double account = state.account.level();
    for (const double zoom : {4.0, 4.0, 4.0, 1.0, 1.0}) {
      const Vec3 after = touch(rubbed_in(zoom, law), state, hand).wrench.force;
      EXPECT_NEAR((after - before).norm(), 0.0, 2e-3) << law << " " << zoom;
      EXPECT_NEAR(state.account.level(), account, 1e-6) << law << " " << zoom;
    }
  }
}

// A plane is the same in every view: what the hand has put into its springs, friction's among them, it gets back in
// another one as if nothing had been changed.
TEST(Change, Zooming_under_a_moving_hand_changes_nothing_of_a_plane) {
  for (const char* law : {"mesostructure", "height-field"}) {
    for (const double zoom : {0.25, 4.0}) {
      ProxyState kept;
      ProxyState zoomed;
      const Scene plain = rubbed_in(1.0, law);
      const Scene other = rubbed_in(zoom, law);
      press(plain, kept, Vec3::Zero(), 0.0);
      press(plain, zoomed, Vec3::Zero(), 0.0);
      for (int i = 1; i <= 60; ++i) {
        const Vec3 hand(2e-5 * std::min(i, 60 - i), -depth, 0.0);
        const Vec3 expected = touch(plain, kept, hand).wrench.force;
        const Vec3 felt = touch(i < 30 ? plain : other, zoomed, hand).wrench.force;
        ASSERT_NEAR((felt - expected).norm(), 0.0, 1e-9) << law << " " << zoom << " " << i;
        ASSERT_NEAR(zoomed.account.level(), kept.account.level(), 1e-12) << law << " " << zoom << " " << i;
      }
    }
  }
}

// Conveyors under a still hand with an empty account: friction, damping and viscosity give nothing.
TEST(Change, A_moving_surface_drags_no_more_than_is_paid_for) {
  const MeshSurface base = sheet(0.2);
  for (const char* law : {"proxy", "mesostructure", "god-object"}) {
    Instance instance;
    instance.name = "belt";
    instance.surface = flat_relief(base, 0.0);
    instance.law = named(law);
    instance.material.stiffness = stiffness;
    instance.material.damping = 5.0;
    instance.material.viscosity = 4.0;
    instance.motion.velocity.linear = Vec3(0.05, 0.02, 0.0);
    instance.motion.horizon = Seconds(10.0);
    const Scene scene = must(Scene::build({instance}, SceneSettings{}));
    ProxyState state;
    double work = 0.0;
    double most = 0.0;
    Vec3 hand(0.0, 2e-3, 0.0);
    Vec3 force = Vec3::Zero();
    for (int i = 0; i < 400; ++i) {
      // Down, then along with the belt but slower.
      const double time = 1e-3 * i;
      const Vec3 next(0.03 * time, i < 100 ? 2e-3 - 3e-5 * i : -1e-3 + 0.01 * (time - 0.1), 0.0);
      work += force.dot(next - hand);
      most = std::max(most, work);
      ProbeSample probe = probe_at(next);
      probe.twist.linear = (next - hand) / 1e-3;
      probe.time = Seconds(time);
      force = step(scene, state, probe, tick).wrench.force;
      hand = next;
    }
    EXPECT_LT(most, 5e-5) << law;
  }
}

TEST(Change, A_belt_whose_drag_is_cut_says_so) {
  // Friction would push a hand on that is led along with a belt but slower, and no one pays for that; it holds one back
  // that is led faster.
  Instance instance;
  instance.name = "belt";
  instance.surface = flat_relief(sheet(0.2), 0.0);
  instance.law = named("mesostructure");
  instance.material.stiffness = stiffness;
  instance.material.static_friction = instance.material.dynamic_friction = 0.5;
  instance.material.friction.kind = FrictionKind::dahl;
  instance.material.friction_named = true;
  instance.motion.velocity.linear = Vec3(0.05, 0.0, 0.0);
  instance.motion.horizon = Seconds(10.0);
  const Scene scene = must(Scene::build({instance}, SceneSettings{}));
  for (const double speed : {0.03, 0.08}) {
    ProxyState state;
    for (int i = 0; i < 400; ++i) {
      const double time = 1e-3 * i;
      const ForceSample felt = at_time(scene, state, Vec3(speed * time, i < 100 ? 2e-3 - 3e-5 * i : -1e-3, 0.0), time);
      if (i < 200) continue;
      const double friction = 0.5 * felt.wrench.force.y();
      ASSERT_NEAR(friction, 0.5 * stiffness * 1e-3, 1e-6);
      if (speed < 0.05) {
        ASSERT_LT(felt.wrench.force.x(), 0.5 * friction) << i;
      } else {
        ASSERT_NEAR(felt.wrench.force.x(), -friction, 1e-3 * friction) << i;
      }
      ASSERT_EQ(felt.flags.has(TickFlag::energy_limited), speed < 0.05) << i;
    }
  }
}

TEST(Change, A_time_that_is_no_number_is_refused) {
  const Scene scene = scene_with(flat_relief(sheet(), 0.0));
  ProxyState state;
  ProbeSample probe = probe_at(Vec3::Zero());
  probe.time = Seconds(std::nan(""));
  EXPECT_TRUE(step(scene, state, probe, tick).flags.has(TickFlag::input_not_finite));
}

// Waves that run through a coat: felt where they are, followed by a resting hand, forces continuous.
TEST(Change, A_travelling_wave_lifts_the_proxy) {
  const MeshSurface base = sheet();
  SolidSpec wave;
  wave.kind = SolidKind::waves;
  wave.amplitude = 0.2e-3;
  wave.wavelength = 8e-3;
  wave.direction = Vec3::UnitX();
  wave.frequency = 3.0;
  CoatLayer layer;
  layer.solid = std::make_shared<const SolidMesostructure>(must(SolidMesostructure::build(wave)));
  SceneSettings settings;
  settings.change_power = 1.0;
  const Scene scene = scene_with(relief(base, coat_of(base, tiled(flat_map(0.0), 0.01), {layer})), settings);
  ProxyState state;
  std::vector<Vec3> forces;
  double worst = 0.0;
  for (int i = 0; i < 1500; ++i) {
    const double time = 1e-3 * i;
    const Vec3 hand(0.0, i < 100 ? 2e-3 - 3e-5 * i : -1e-3, 0.0);
    const ForceSample sample = at_time(scene, state, hand, time);
    if (i < 400) continue;
    forces.push_back(sample.wrench.force);
    // The proxy is on the wave as it is now.
    const double height = layer.solid->jet(Vec3(sample.proxy.x(), 0.0, sample.proxy.z()), time).height;
    worst = std::max(worst, std::abs(sample.proxy.y() - height));
  }
  EXPECT_LT(worst, 1e-7);
  // Crests rise by 2 pi f c: 3.8 um a tick.
  EXPECT_LT(largest_jump(forces), 0.03);
}

TEST(Change, A_wave_that_rises_over_a_resting_hand_is_felt) {
  const MeshSurface base = sheet();
  SolidSpec beat;
  beat.kind = SolidKind::pulse;
  beat.amplitude = 1e-3;
  beat.wavelength = 8e-3;
  beat.frequency = 0.5;
  CoatLayer layer;
  layer.solid = std::make_shared<const SolidMesostructure>(must(SolidMesostructure::build(beat)));
  SceneSettings settings;
  settings.change_power = 10.0;
  const Scene scene = scene_with(relief(base, coat_of(base, tiled(flat_map(0.0), 0.01), {layer})), settings);
  ProxyState state;
  double most = 0.0;
  for (int i = 0; i < 1000; ++i)
    most = std::max(most, at_time(scene, state, Vec3(0.0, 0.4e-3, 0.0), 1e-3 * i).wrench.force.y());
  EXPECT_GT(most, 0.3);
}

}  // namespace
}  // namespace asperity::test::change_test
