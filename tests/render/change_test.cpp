// Surfaces that move, deform, change their coat, their level of detail or their size while they are touched.
#include "asperity/render/change.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "asperity/field/detail_pyramid.h"
#include "asperity/geometry/generators.h"
#include "asperity/geometry/mesh_refitter.h"
#include "tests/render/fixtures.h"
#include "tests/surface/reliefs.h"

namespace asperity::test {
namespace {

constexpr double depth = 1e-3;  // m

/// A mesh of the plane z = 0, laid flat: its front is up, +y.
TriangleMesh laid_flat(MeshSource source) {
  for (Vec3& p : source.positions) p = Vec3(p.x(), p.z(), -p.y());
  return mesh_of(std::move(source));
}

MeshSurface sheet(double side = 0.04) {
  return MeshSurface(TriangleIndex::build(laid_flat(plane_grid(side, side, 8, 8))));
}

Coat coat_of(const MeshSurface& base, std::shared_ptr<const Mesostructure> maps, std::vector<CoatLayer> layers = {},
             std::shared_ptr<const MaterialMaps> materials = nullptr) {
  CoatParts parts;
  parts.maps.push_back(std::move(maps));
  parts.layers = std::move(layers);
  parts.materials = std::move(materials);
  CoatSettings settings;
  settings.mapping = Mapping::triplanar;
  return must(Coat::build(base.mesh(), std::move(parts), settings));
}

Surface relief(const MeshSurface& base, Coat coat) {
  return std::make_shared<const ReliefSurface>(base, std::move(coat));
}

Surface flat_relief(const MeshSurface& base, double height) {
  return relief(base, coat_of(base, tiled(flat_map(height), 0.01)));
}

Scene scene_with(Surface surface, const SceneSettings& settings = {}, Law law = ProxyLaw{}, Motion motion = {}) {
  Instance instance;
  instance.name = "test";
  instance.surface = std::move(surface);
  instance.law = std::move(law);
  instance.material.stiffness = stiffness;
  instance.motion = motion;
  return must(Scene::build({instance}, settings));
}

ForceSample at_time(const Scene& scene, ProxyState& state, const Vec3& position, double time) {
  ProbeSample probe = probe_at(position);
  probe.time = Seconds(time);
  return step(scene, state, probe, tick);
}

/// Brings a probe from above to `place`, `depth` below the height there.
ForceSample press(const Scene& scene, ProxyState& state, const Vec3& place, double height) {
  ForceSample sample;
  for (int i = 0; i <= 20; ++i) sample = touch(scene, state, place + Vec3(0.0, height + depth - 0.1 * i * depth, 0.0));
  return sample;
}

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
    state.tank = {};
    if (full) state.tank.fill(1.0);
    const Vec3 probe = place + Vec3(0.0, 0.1e-3 - depth, 0.0);
    std::vector<Vec3> forces{before};
    double stored = 0.0;
    for (int i = 0; i < 50; ++i) {
      const ForceSample sample = touch(high, state, probe);
      forces.push_back(sample.wrench.force);
      stored = 0.5 * state.stiffness * (state.proxy - probe).squaredNorm();
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

// A surface that rises under a resting hand whose tank is empty may not do work on it; with power it may.
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
        stored = 0.5 * state.stiffness * (state.proxy - hand).squaredNorm();
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
    one.tank.fill(1.0);
    other.tank.fill(1.0);
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
    on.tank.fill(1.0);
    const Vec3 deep = place - Vec3(0.0, depth, 0.0);
    Vec3 force;
    for (int i = 0; i < 100; ++i) force = touch(coated, on, deep).wrench.force;
    EXPECT_NEAR(force.y(), stiffness * (depth + height), 5e-3) << height;
    ProxyState off;
    press(coated, off, place, height);
    off.tank.fill(1.0);
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
      const double tank = state.tank.level();
      const Vec3 after = touch(zoomed, state, hand).wrench.force;
      EXPECT_NEAR((after - before).norm(), 0.0, 2e-3) << law << " " << zoom;
      EXPECT_NEAR(state.tank.level(), tank, 1e-6) << law << " " << zoom;
    }
  }
}

// Conveyors under a still hand with an empty tank: friction, damping and viscosity give nothing.
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

std::shared_ptr<const MaterialMaps> map_for(MaterialChannel channel, double low, double high) {
  MaterialMaps::Parts parts;
  parts.channels[static_cast<std::size_t>(channel)] = std::make_shared<const HeightMap>(
      must(HeightMap::build(std::vector<float>{static_cast<float>(low), static_cast<float>(high)}, 2, 1, Wrap::repeat,
                            Reconstruction::bilinear)));
  return std::make_shared<const MaterialMaps>(must(MaterialMaps::build(std::move(parts))));
}

TEST(CoatMaps, Stiffness_and_friction_are_those_of_the_place) {
  const MeshSurface base = sheet();
  const Scene soft = scene_with(
      relief(base, coat_of(base, tiled(flat_map(0.0), 0.02), {}, map_for(MaterialChannel::stiffness, 400.0, 1200.0))));
  // Texels' centres are at a quarter and three quarters of 20 mm; triplanar: t along x, s along z for +y.
  for (const auto& [z, k] : {std::pair(0.005, 400.0), std::pair(0.015, 1200.0), std::pair(0.010, 800.0)}) {
    ProxyState state;
    const ForceSample sample = press(soft, state, Vec3(0.001, 0.0, z), 0.0);
    EXPECT_NEAR(sample.wrench.force.y(), k * depth, 1e-6 * k) << z;
  }
}

TEST(CoatMaps, A_stiffness_map_gives_no_energy) {
  const MeshSurface base = sheet();
  for (const char* law : {"proxy", "height-field", "mesostructure"}) {
    const Scene scene = scene_with(
        relief(base, coat_of(base, tiled(flat_map(0.0), 0.02), {}, map_for(MaterialChannel::stiffness, 200.0, 2000.0))),
        {}, named(law));
    ProxyState state;
    double work = 0.0;
    Vec3 hand(0.001, 2e-3, 0.005);
    Vec3 force = Vec3::Zero();
    // Press where it is soft, lift where it is stiff: 0.5 mJ a round if nobody minded.
    for (int i = 0; i < 12000; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / 2000.0;
      const Vec3 next(0.001, -1e-3 * std::sin(angle) + 0.0, 0.010 - 0.005 * std::cos(angle));
      work += force.dot(next - hand);
      hand = next;
      force = touch(scene, state, hand).wrench.force;
    }
    // What holding a force for a tick gives, 1/2 k (v T)^2 each: 0.13 mJ.
    EXPECT_LT(work, 12000.0 * 0.5 * 2000.0 * 3.3e-6 * 3.3e-6) << law;
  }
}

TEST(CoatMaps, Magnetism_draws_from_outside_and_gives_nothing_in_a_loop) {
  const MeshSurface base = sheet();
  for (const bool mapped : {false, true}) {
    Instance instance;
    instance.name = "magnet";
    instance.surface = relief(base, coat_of(base, tiled(wavy_map(1e-4, 16), 0.01), {},
                                            mapped ? map_for(MaterialChannel::magnetism, 0.0, 800.0) : nullptr));
    instance.material.stiffness = stiffness;
    instance.material.magnetism = mapped ? 0.0 : 500.0;
    instance.material.magnetic_band = 2e-3;
    const Scene scene = must(Scene::build({instance}, 0.0));
    ProxyState state;
    double work = 0.0;
    double strongest = 0.0;
    Vec3 hand(0.0, 3e-3, 0.0);
    Vec3 force = Vec3::Zero();
    constexpr int ticks = 20000;
    for (int i = 0; i <= ticks; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / ticks;
      const Vec3 next(0.004 * std::sin(angle), 1.7e-3 + 1.3e-3 * std::cos(2.0 * angle),
                      0.003 * std::cos(angle) - 0.003);
      // Trapezoidal: the loop's own work, without what a hold adds.
      const Vec3 now = touch(scene, state, next).wrench.force;
      work += 0.5 * (force + now).dot(next - hand);
      strongest = std::min(strongest, now.y());
      hand = next;
      force = now;
    }
    EXPECT_LT(strongest, -0.1) << mapped;
    EXPECT_NEAR(work, 0.0, 1e-8) << mapped;
  }
}

// Magnetism is a force beside the proxy: it moves no proxy.
TEST(CoatMaps, Magnetism_leaves_the_proxy_where_it_rests) {
  const MeshSurface base(TriangleIndex::build(mesh_of(icosphere(2, 0.02))));
  const auto run = [&](double magnetism) {
    Instance instance;
    instance.name = "magnet";
    instance.surface = relief(base, coat_of(base, tiled(wavy_map(2e-4, 16), 0.01)));
    instance.material.stiffness = stiffness;
    instance.material.static_friction = instance.material.dynamic_friction = 0.6;
    instance.material.magnetism = magnetism;
    const Scene scene = must(Scene::build({instance}, 0.0));
    ProxyState state;
    std::vector<Vec3> proxies;
    for (int i = 0; i < 1500; ++i) {
      const double angle = 1e-3 * i;
      const double radius = i < 100 ? 0.024 - 5e-5 * i : 0.019;
      proxies.push_back(touch(scene, state, radius * Vec3(std::sin(angle), std::cos(angle), 0.1)).proxy);
    }
    return proxies;
  };
  const std::vector<Vec3> plain = run(0.0);
  const std::vector<Vec3> drawn = run(300.0);
  for (std::size_t i = 0; i < plain.size(); ++i) ASSERT_EQ(plain[i], drawn[i]) << i;
}

TEST(CoatMaps, A_sticky_surface_holds_until_its_force_is_reached) {
  const MeshSurface base = sheet();
  Instance instance;
  instance.name = "glue";
  instance.surface = flat_relief(base, 0.0);
  instance.material.stiffness = stiffness;
  instance.material.stickiness = 0.5;
  const Scene scene = must(Scene::build({instance}, 0.0));
  ProxyState state;
  press(scene, state, Vec3(0.001, 0.0, 0.001), 0.0);
  double strongest = 0.0;
  double last = 0.0;
  for (int i = 0; i <= 2000; ++i) {
    const double up = -depth + 1e-6 * i;
    const double force = touch(scene, state, Vec3(0.001, up, 0.001)).wrench.force.y();
    if (force != 0.0) {
      EXPECT_NEAR(force, -stiffness * up, 1e-6);
    }
    strongest = std::min(strongest, force);
    last = force;
  }
  EXPECT_NEAR(strongest, -0.5, 2e-3);
  EXPECT_EQ(last, 0.0);
  // It does not stick before it is touched.
  ProxyState fresh;
  for (int i = 0; i < 100; ++i) EXPECT_EQ(touch(scene, fresh, Vec3(0.0, 1e-4, 0.0)).wrench.force.norm(), 0.0);
}

TEST(CoatMaps, Viscosity_resists_all_motion_in_touch) {
  const MeshSurface base = sheet();
  for (const char* law : {"proxy", "mesostructure"}) {
    Instance instance;
    instance.name = "honey";
    instance.surface = flat_relief(base, 0.0);
    instance.law = named(law);
    instance.material.stiffness = stiffness;
    instance.material.viscosity = 4.0;
    const Scene scene = must(Scene::build({instance}, 0.0));
    ProxyState state;
    press(scene, state, Vec3::Zero(), 0.0);
    ProbeSample probe = probe_at(Vec3(0.0, -depth, 0.0));
    probe.twist.linear = Vec3(0.05, 0.0, 0.0);
    const ForceSample sample = step(scene, state, probe, tick);
    EXPECT_NEAR(sample.wrench.force.x(), -0.2, 1e-6) << law;
    EXPECT_NEAR(sample.parts.friction.x(), -0.2, 1e-6) << law;
    probe.pose.position.y() = 1e-3;
    EXPECT_EQ(step(scene, state, probe, tick).wrench.force.norm(), 0.0) << law;
  }
}

TEST(CoatMaps, Friction_is_least_along_the_lay) {
  const MeshSurface base = sheet();
  MaterialMaps::Parts parts;
  // Along t, which is x here: triplanar, the plane of +y has s along z and t along x.
  parts.lay_s = std::make_shared<const HeightMap>(flat_map(0.0));
  parts.lay_t = std::make_shared<const HeightMap>(flat_map(0.75));
  Instance instance;
  instance.name = "brushed";
  instance.surface =
      relief(base, coat_of(base, tiled(flat_map(0.0), 0.01), {},
                           std::make_shared<const MaterialMaps>(must(MaterialMaps::build(std::move(parts))))));
  instance.material.stiffness = stiffness;
  instance.material.static_friction = instance.material.dynamic_friction = 0.4;
  const Scene scene = must(Scene::build({instance}, 0.0));
  const auto pull = [&](const Vec3& way) {
    ProxyState state;
    press(scene, state, Vec3::Zero(), 0.0);
    Vec3 force;
    for (int i = 0; i < 200; ++i) {
      ProbeSample probe = probe_at(Vec3(0.0, -depth, 0.0) + 5e-5 * i * way);
      probe.twist.linear = 0.05 * way;
      force = step(scene, state, probe, tick).wrench.force;
    }
    return force.dot(way);
  };
  EXPECT_NEAR(pull(Vec3::UnitX()), -0.1, 2e-3);
  EXPECT_NEAR(pull(Vec3::UnitZ()), -0.4, 2e-3);
}

// Zooming in: the same hand motion covers less of the object, forces stay those of the hand.
TEST(View, A_zoomed_scene_is_the_same_as_a_larger_object) {
  const double zoom = 4.0;
  const MeshSurface base = sheet(0.04);
  const MeshSurface large = sheet(0.16);
  SceneSettings settings;
  settings.view.zoom = zoom;
  const Scene zoomed = scene_with(relief(base, coat_of(base, tiled(wavy_map(1e-4, 16), 0.01))), settings);
  const Scene grown = scene_with(relief(large, coat_of(large, tiled(wavy_map(4e-4, 16), 0.04))));
  ProxyState one;
  ProxyState other;
  for (int i = 0; i < 3000; ++i) {
    const Vec3 hand(0.02 * std::sin(0.002 * i), 2e-3 * std::cos(0.005 * i), 0.015 * std::cos(0.0013 * i));
    const ForceSample a = touch(zoomed, one, hand);
    const ForceSample b = touch(grown, other, hand);
    ASSERT_NEAR((a.wrench.force - b.wrench.force).norm(), 0.0, 2e-6) << i;
    ASSERT_NEAR((settings.view.to_workspace(a.proxy) - b.proxy).norm(), 0.0, 2e-9) << i;
  }
}

TEST(View, Turning_the_view_turns_the_force_back) {
  const MeshSurface base = sheet();
  SceneSettings settings;
  settings.view.orientation = Quat(Eigen::AngleAxisd(0.5 * std::numbers::pi, Vec3::UnitZ()));
  const Scene scene = scene_with(flat_relief(base, 0.0), settings);
  ProxyState state;
  // The scene's up is the hand's +x: R takes the hand's x to the scene's y.
  touch(scene, state, Vec3(2e-3, 0.0, 0.0));
  const ForceSample sample = touch(scene, state, Vec3(-1e-3, 0.0, 0.0));
  EXPECT_NEAR((sample.wrench.force - Vec3(1.0, 0.0, 0.0)).norm(), 0.0, 1e-6);
}

// H-V: what is lower than a pixel is not felt; zooming brings it back; monotone (T10).
TEST(View, H_V_a_feature_vanishes_below_one_pixel_and_returns_on_zoom) {
  const MeshSurface base(TriangleIndex::build(laid_flat(trial_mesh_f(8, 0.02))));
  DetailSettings detail;
  detail.kind = DetailKind::low_pass;
  const auto map = tiled(wavy_map(5e-5, 32), 0.01);
  const auto pyramid =
      std::make_shared<const DetailPyramid>(must(DetailPyramid::build(map->heights(), map->tile(), detail)));
  const auto layered = std::make_shared<const Mesostructure>(map->with_detail(pyramid));
  double last = -1.0;
  std::vector<double> felt;
  for (const double zoom : {0.25, 1.0, 4.0, 16.0, 64.0}) {
    SceneSettings settings;
    settings.view.zoom = zoom;
    settings.view.focus = base.mesh().bounds().lower + 0.3 * base.mesh().bounds().extent();
    settings.view.home = settings.view.focus;
    settings.view.camera.eye = settings.view.focus + Vec3(0.0, 0.3, 0.0);
    settings.view.camera.target = settings.view.focus;
    settings.view.camera.pixels = 1000;
    settings.view.camera.field_of_view = 0.7;
    settings.level_rate = 1e9;
    Coat coat = coat_of(base, layered);
    const Scene scene = scene_with(relief(base, std::move(coat)), settings);
    ProxyState state;
    const double pixel = settings.view.pixel_at(settings.view.focus);
    EXPECT_NEAR(pixel, 2.0 * std::tan(0.35) * 0.3 / zoom / 1000.0, 1e-12);
    // Over two waves at rest depth, slowly: the height that the proxy goes through, in the scene.
    double low = infinity;
    double high = -infinity;
    const Vec3 at = settings.view.focus;
    touch(scene, state, settings.view.to_workspace(at + Vec3(0.0, 1e-3, 0.0)));
    for (int i = 0; i < 2000; ++i) {
      const Vec3 place = at + Vec3(0.0, -3e-4, 0.0) + Vec3(1e-5 * i, 0.0, 0.0);
      const ForceSample sample = touch(scene, state, settings.view.to_workspace(place));
      if (i < 10) continue;
      low = std::min(low, sample.proxy.y());
      high = std::max(high, sample.proxy.y());
    }
    const double height = high - low;
    EXPECT_GE(height, last - 1e-9) << zoom;
    last = height;
    felt.push_back(height);
  }
  EXPECT_LT(felt.front(), 2e-6);          // a pixel is 0.9 mm
  EXPECT_GT(felt.back(), 0.8 * felt[3]);  // 3 um
  EXPECT_GT(felt.back(), 3e-5);
}

// T10: a level change moves the surface under the hand; what that would give comes from the tank.
TEST(View, T10_level_changes_pay_from_the_tank) {
  const MeshSurface base = sheet();
  DetailSettings detail;
  detail.kind = DetailKind::low_pass;
  const auto map = tiled(wavy_map(3e-4, 32), 0.01);
  const auto layered = std::make_shared<const Mesostructure>(map->with_detail(
      std::make_shared<const DetailPyramid>(must(DetailPyramid::build(map->heights(), map->tile(), detail)))));
  const Surface surface = relief(base, coat_of(base, layered));
  ProxyState state;
  double work = 0.0;
  double most = 0.0;
  Vec3 hand(0.0, 2e-3, 0.0);
  Vec3 force = Vec3::Zero();
  double level_sum = 0.0;
  Scene scene = scene_with(surface);
  for (int i = 0; i < 20000; ++i) {
    if (i % 50 == 0) {
      SceneSettings settings;
      settings.view.camera.pixels = (i / 50) % 2 == 0 ? 100 : 4000;
      scene = scene_with(surface, settings);
    }
    const Vec3 next(0.006 * std::sin(0.002 * i), -4e-4 + 6e-4 * std::cos(0.0031 * i), 0.004 * std::sin(0.0017 * i));
    work += force.dot(next - hand);
    most = std::max(most, work);
    hand = next;
    force = touch(scene, state, hand).wrench.force;
    if (!state.contacts.empty()) level_sum += state.contacts[0].hint.moment.level;
  }
  EXPECT_GT(level_sum, 100.0);  // levels did change
  // What holding a force for a tick gives: 1/2 k (v T)^2 each.
  EXPECT_LT(most, 20000.0 * 0.5 * stiffness * 1.4e-5 * 1.4e-5 * 0.25);
}

TEST(View, Errors_name_what_is_wrong) {
  const MeshSurface base = sheet();
  const auto error = [&](auto&& change) {
    Instance instance;
    instance.name = "test";
    instance.surface = flat_relief(base, 0.0);
    SceneSettings settings;
    change(instance, settings);
    Result<Scene> scene = Scene::build({instance}, settings);
    return scene ? std::string("built") : scene.error().place;
  };
  EXPECT_EQ(error([](Instance&, SceneSettings& s) { s.view.zoom = 0.0; }), "view.zoom");
  EXPECT_EQ(error([](Instance&, SceneSettings& s) { s.view.camera.pixels = -1; }), "view.camera.pixels");
  EXPECT_EQ(error([](Instance&, SceneSettings& s) { s.handover = Seconds(-1.0); }), "handover");
  EXPECT_EQ(error([](Instance&, SceneSettings& s) { s.change_power = -1.0; }), "change_power");
  EXPECT_EQ(error([](Instance&, SceneSettings& s) { s.level_rate = 0.0; }), "level_rate");
  EXPECT_EQ(error([](Instance& i, SceneSettings&) { i.motion.velocity.linear.x() = NAN; }), "surfaces[0].motion");
  EXPECT_EQ(error([](Instance& i, SceneSettings&) { i.material.viscosity = -1.0; }), "surfaces[0].material.viscosity");
  EXPECT_EQ(error([](Instance& i, SceneSettings&) { i.material.magnetic_band = 0.0; }),
            "surfaces[0].material.magnetic_band");
  EXPECT_EQ(error([](Instance& i, SceneSettings&) {
              i.material.stickiness = 1.0;
              i.law = GodObjectLaw{};
            }),
            "surfaces[0].material.stickiness");
  EXPECT_EQ(error([](Instance& i, SceneSettings& s) {
              i.material.magnetism = 1.0;
              s.probe_radius = 1e-3;
            }),
            "surfaces[0].material.magnetism");
  EXPECT_EQ(error([](Instance&, SceneSettings&) {}), "built");
}

}  // namespace
}  // namespace asperity::test
