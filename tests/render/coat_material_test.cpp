// Maps of the material on a coat, and what a view makes of touch.
#include "asperity/render/local_material.h"

#include <gtest/gtest.h>

#include <cmath>

#include "asperity/geometry/generators.h"
#include "tests/render/sheets.h"

namespace asperity::test::coat_material_test {
namespace {

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

// In a valley it touches both walls, its middle over neither place.
TEST(CoatMaps, A_ball_feels_the_material_of_the_wall_that_it_is_pressed_against) {
  const double tile = 0.02;
  const double radius = 3e-3;
  const double steep = 0.5;
  const MeshSurface base = sheet();
  const HeightMap valley = map_of(512, [&](double s, double) { return steep * tile * std::abs(s - 0.5); });
  const auto scene_of = [&](MaterialChannel channel, double low, double high, double slip) {
    Instance instance;
    instance.surface = relief(base, coat_of(base, tiled(valley, tile), {}, map_for(channel, low, high)));
    instance.material.static_friction = instance.material.dynamic_friction = slip;
    return must(Scene::build({instance}, radius));
  };
  // Walls are touched where they are as steep as the ball: by so much beside the bottom at 10 mm.
  const double beside = radius * std::sin(std::atan(steep));
  const Scene soft = scene_of(MaterialChannel::stiffness, 400.0, 1200.0, 0.0);
  const Scene smooth = scene_of(MaterialChannel::friction, 0.1, 0.5, 1.0);
  for (const double side : {-1.0, 1.0}) {
    const Vec3 above(0.001, 0.012, 0.010);
    const Vec3 pressed(0.001, 2e-3, 0.010 + side * 0.3e-3);
    ProxyState state;
    touch(soft, state, above);
    const ForceSample held = touch(soft, state, pressed);
    ASSERT_EQ(held.contact.places.size(), 2U);
    const double k = 800.0 + side * 800.0 * beside / (0.5 * tile);
    EXPECT_NEAR(held.wrench.force.norm() / (held.proxy - pressed).norm(), k, 0.01 * k) << side;
    // Drawn along the valley it slides by that wall's coefficient.
    ProxyState drawn;
    touch(smooth, drawn, above);
    ForceSample slid;
    for (int i = 0; i <= 40; ++i) slid = touch(smooth, drawn, pressed + Vec3(1e-4 * i, 0.0, 0.0));
    const Vec3 push(0.0, slid.wrench.force.y(), slid.wrench.force.z());
    const double friction = 0.3 + side * 0.4 * beside / (0.5 * tile);
    EXPECT_NEAR(-slid.wrench.force.x() / push.norm(), friction, 0.05 * friction) << side;
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

// T10: a level change moves the surface under the hand; what that would give comes from the account.
TEST(View, T10_level_changes_pay_from_the_account) {
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
    if (!state.contacts.empty()) level_sum += state.contacts[0].detail_level.value_or(0.0);
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
  EXPECT_EQ(error([](Instance&, SceneSettings& s) { s.energy_capacity = -1.0; }), "energy_capacity");
  EXPECT_EQ(error([](Instance&, SceneSettings& s) { s.energy_capacity = infinity; }), "energy_capacity");
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
}  // namespace asperity::test::coat_material_test
