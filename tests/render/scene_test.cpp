#include "asperity/render/scene.h"

#include <gtest/gtest.h>

#include "tests/render/fixtures.h"

namespace asperity::scene_test {
namespace {

using namespace test;

Instance good(Law law = GodObjectLaw{}, bool with_coat = true) {
  Instance instance;
  instance.name = "plate";
  if (with_coat) {
    instance.surface = coated(plane_grid(0.04, 0.04, 2, 2), flat_map(1e-3), Mapping::uv);
  } else {
    instance.surface = bare(plane_grid(0.04, 0.04, 2, 2));
  }
  instance.law = std::move(law);
  return instance;
}

/// The error of a scene of one good instance and `bad`.
Error refused(Instance bad, double radius = 0.0) {
  const auto scene = Scene::build({good(), std::move(bad)}, radius);
  EXPECT_FALSE(scene.ok());
  return scene.ok() ? Error{} : scene.error();
}

void expect_named(const Error& error, ErrorCode code, const std::string& place) {
  EXPECT_EQ(error.code, code) << error.message();
  EXPECT_EQ(error.place, place) << error.message();
  EXPECT_FALSE(error.what.empty());
  EXPECT_FALSE(error.accepted.empty()) << error.message();
}

TEST(SceneErrors, each_law_that_needs_a_coat_is_refused_on_a_bare_mesh) {
  for (const char* law : {"height-field", "height-field-literal", "mesostructure", "mesostructure-literal"}) {
    const Error error = refused(good(named(law), false));
    expect_named(error, ErrorCode::unsupported_pair, "surfaces[1].law");
    EXPECT_NE(error.what.find(law), std::string::npos);
    EXPECT_NE(error.what.find("plate"), std::string::npos);
  }
  for (const char* law : {"god-object", "force-shading"})
    EXPECT_TRUE(Scene::build({good(named(law), false)}, 0.0).ok());
}

TEST(SceneErrors, each_law_that_touches_with_a_point_is_refused_with_a_radius) {
  for (const char* law : {"height-field", "height-field-literal", "mesostructure", "mesostructure-literal"}) {
    expect_named(refused(good(named(law)), 1e-3), ErrorCode::unsupported_pair, "surfaces[1].law");
  }
  for (const char* law : {"god-object", "force-shading"}) EXPECT_TRUE(Scene::build({good(named(law))}, 1e-3).ok());
}

TEST(SceneErrors, each_bad_material_value_is_named) {
  for (const double bad : {0.0, -1.0, std::nan(""), infinity}) {
    Instance instance = good();
    instance.material.stiffness = bad;
    expect_named(refused(instance), ErrorCode::bad_value, "surfaces[1].material.stiffness");
  }
  for (const double bad : {-1.0, std::nan(""), infinity}) {
    Instance instance = good();
    instance.material.damping = bad;
    expect_named(refused(instance), ErrorCode::bad_value, "surfaces[1].material.damping");
  }
}

TEST(SceneErrors, each_bad_law_option_is_named) {
  expect_named(refused(good(HeightFieldLaw{Formulation::literal, 0.5})), ErrorCode::bad_value,
               "surfaces[1].law.edge_taper");
  expect_named(refused(good(MesostructureLaw{Formulation::literal, 0.0, Blend::linear, {}})), ErrorCode::bad_value,
               "surfaces[1].law.rho");
  expect_named(refused(good(MesostructureLaw{Formulation::literal, 0.05, Blend::image, {}})), ErrorCode::bad_value,
               "surfaces[1].law.blend_map");
  expect_named(refused(good(MesostructureLaw{Formulation::literal, 0.05, Blend::image, {0.0, 2.0}})),
               ErrorCode::bad_value, "surfaces[1].law.blend_map");
}

TEST(SceneErrors, each_bad_pose_is_named) {
  for (const double bad : {std::nan(""), infinity}) {
    Instance moved = good();
    moved.world_from_object.position.x() = bad;
    expect_named(refused(moved), ErrorCode::bad_value, "surfaces[1].pose");
    Instance rotated = good();
    rotated.world_from_object.orientation.w() = bad;
    expect_named(refused(rotated), ErrorCode::bad_value, "surfaces[1].pose");
  }
  Instance scaled = good();
  scaled.world_from_object.orientation = Quat(2.0, 0.0, 0.0, 0.0);
  expect_named(refused(scaled), ErrorCode::bad_value, "surfaces[1].pose");
}

TEST(SceneErrors, bad_radius_and_empty_scenes_are_named) {
  for (const double bad : {-1e-9, std::nan(""), infinity}) {
    const auto scene = Scene::build({good()}, bad);
    ASSERT_FALSE(scene.ok());
    expect_named(scene.error(), ErrorCode::bad_value, "probe.radius");
  }
  const auto empty = Scene::build({}, 0.0);
  ASSERT_FALSE(empty.ok());
  expect_named(empty.error(), ErrorCode::bad_value, "surfaces");
}

TEST(SceneErrors, a_surface_that_is_not_there_is_named) {
  Instance instance = good();
  instance.surface = std::shared_ptr<const MeshSurface>();
  expect_named(refused(instance), ErrorCode::bad_value, "surfaces[1].surface");
  instance.surface = std::shared_ptr<const ReliefSurface>();
  expect_named(refused(instance), ErrorCode::bad_value, "surfaces[1].surface");
}

TEST(SceneTest, snapshots_have_epochs_of_their_own) {
  const Scene one = must(Scene::build({good()}, 0.0));
  const Scene other = must(Scene::build({good()}, 0.0));
  EXPECT_NE(one.epoch(), 0U);
  EXPECT_NE(one.epoch(), other.epoch());
  EXPECT_GT(one.memory_bytes(), 1000U);
}

TEST(SceneTest, world_bounds_hold_the_turned_relief) {
  Instance instance = good();
  instance.world_from_object.position = Vec3(0.1, 0.2, 0.3);
  instance.world_from_object.orientation = Quat(Eigen::AngleAxisd(0.5 * std::numbers::pi, Vec3::UnitX()));
  const Scene scene = must(Scene::build({instance}, 0.002));
  const Box box = scene.world_bounds(0);
  for (const double x : {-0.02, 0.02}) {
    for (const double y : {-0.02, 0.02}) {
      const Vec3 p = instance.world_from_object.apply(Vec3(x, y, 1e-3));
      EXPECT_TRUE((p.array() >= box.lower.array()).all() && (p.array() <= box.upper.array()).all());
    }
  }
  EXPECT_LT(box.diagonal(), 0.08);
  EXPECT_EQ(scene.world_bounds().lower, box.lower);
}

TEST(SceneTest, a_moved_and_turned_instance_feels_as_one_at_the_origin) {
  Rng rng(3);
  for (const std::string& name : relief_laws()) {
    Instance instance = good(named(name));
    instance.surface = coated(plane_grid(0.04, 0.04, 4, 4), wavy_map(5e-4), Mapping::uv);
    const Scene here = must(Scene::build({instance}, 0.0));
    const Pose pose{Vec3(0.3, -0.1, 0.2), Quat(Eigen::AngleAxisd(1.1, random_direction(rng)))};
    instance.world_from_object = pose;
    const Scene there = must(Scene::build({instance}, 0.0));
    for (int i = 0; i < 200; ++i) {
      Vec3 p = random_point(rng, 0.015);
      p.z() = rng.uniform(-4e-4, 4e-4);
      const Vec3 outside(p.x(), p.y(), 3e-3);
      const Vec3 expected = pose.rotate(poke(here, outside, p).wrench.force);
      ASSERT_LT((poke(there, pose.apply(outside), pose.apply(p)).wrench.force - expected).norm(), 1e-9) << name;
    }
  }
}

}  // namespace
}  // namespace asperity::scene_test
