// A normal map that is felt by the laws of a coat's heights (hrm-2010 pairs the two).

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/render/fixtures.h"

namespace asperity::normal_map_test {
namespace {

using namespace test;

constexpr double width = 0.04;

/// Everything leans by `angle` towards +s.
NormalMap leaning(double angle) {
  Image image;
  image.width = image.height = 4;
  image.channels = 3;
  image.bits = 16;
  for (int i = 0; i < 16; ++i) {
    for (const double n : {std::sin(angle), 0.0, std::cos(angle)})
      image.samples.push_back(static_cast<std::uint16_t>(std::lround(32768.0 + 32767.0 * n)));
  }
  return must(NormalMap::build(image, {}));
}

/// A plane of 40 mm that wears heights and a normal map, leaning as a whole by `pose`.
Scene plane(const HeightMap& heights, const NormalMap& normals, const Law& law, const Pose& pose = {}) {
  TriangleMesh mesh = mesh_of(plane_grid(width, width, 4, 4));
  Coat coat = must(Coat::build(
      mesh, std::make_shared<const Mesostructure>(must(Mesostructure::build(heights, normals, Vec2(width, width)))),
      CoatSettings{Mapping::uv, Vec2::Ones(), {}}));
  Instance instance;
  instance.name = "plane";
  instance.surface =
      std::make_shared<const ReliefSurface>(MeshSurface(TriangleIndex::build(std::move(mesh))), std::move(coat));
  instance.law = law;
  instance.world_from_object = pose;
  return must(Scene::build({instance}, 0.0));
}

std::vector<Law> laws(NormalMapUse use) {
  ProxyLaw proxy;
  proxy.normal_map = use;
  HeightFieldLaw height_field;
  height_field.normal_map = use;
  MesostructureLaw mesostructure;
  mesostructure.normal_map = use;
  return {proxy, height_field, mesostructure};
}

/// The force (N) at the end of a slide of 4 mm towards -x, 0.5 mm under the plane at z = `level`, as the plane sees it.
Vec3 dragged(const Scene& scene, double level, const Pose& pose = {}) {
  ProxyState state;
  Vec3 force;
  touch(scene, state, pose.apply(Vec3(2e-3, 1e-3, level + 2e-3)));
  for (int i = 0; i <= 400; ++i)
    force = touch(scene, state, pose.apply(Vec3(2e-3 - 1e-5 * i, 1e-3, level - 0.5e-3))).wrench.force;
  return pose.rotate_inverse(force);
}

TEST(NormalMapUse, WhereTheMapIsAllThereIsItBendsTheForce) {
  const double angle = 20.0 * std::numbers::pi / 180.0;
  Pose turned;
  turned.position = Vec3(0.1, -0.2, 0.3);
  turned.orientation = Quat(Eigen::AngleAxisd(1.1, Vec3(1.0, 2.0, -0.5).normalized()));
  for (const Law& law : laws(NormalMapUse::automatic)) {
    for (const Pose& pose : {Pose{}, turned}) {
      // The push stays k times the depth, and the rest is what leans it over: against the slide, so that it takes.
      const Vec3 force = dragged(plane(flat_map(0.3e-3), leaning(angle), law, pose), 0.3e-3, pose);
      EXPECT_NEAR(force.z(), 0.5, 1e-4) << law.facts().name;
      EXPECT_NEAR(force.x(), 0.5 * std::tan(angle), 1e-3) << law.facts().name;
      EXPECT_NEAR(force.y(), 0.0, 1e-3) << law.facts().name;
    }
  }
  for (const Law& law : laws(NormalMapUse::ignored))
    EXPECT_LT(dragged(plane(flat_map(0.3e-3), leaning(angle), law), 0.3e-3).head<2>().norm(), 1e-9);
}

TEST(NormalMapUse, WhereHeightsAreGivenItIsFeltWhenAsked) {
  const double angle = 20.0 * std::numbers::pi / 180.0;
  const HeightMap heights = wavy_map(0.4e-3);
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 plain = dragged(plane(heights, leaning(angle), laws(NormalMapUse::ignored)[i]), 0.0);
    const Vec3 automatic = dragged(plane(heights, leaning(angle), laws(NormalMapUse::automatic)[i]), 0.0);
    EXPECT_EQ(automatic, plain);
    const Vec3 felt = dragged(plane(heights, leaning(angle), laws(NormalMapUse::felt)[i]), 0.0);
    // As the map leans, and as strong along what the heights push by as it was.
    EXPECT_NEAR(felt.x() / felt.z(), std::tan(angle), 2e-3) << i;
    EXPECT_NEAR(felt.y() / felt.z(), 0.0, 2e-3) << i;
    EXPECT_NEAR(felt.dot(plain) / plain.squaredNorm(), 1.0, 1e-6) << i;
    // A map of the heights' own slopes changes next to nothing.
    const NormalMap own = must(NormalMap::build(wavy_map(0.4e-3, 256), Vec2(width, width)));
    const Vec3 same = dragged(plane(wavy_map(0.4e-3, 256), own, laws(NormalMapUse::felt)[i]), 0.0);
    const Vec3 without = dragged(plane(wavy_map(0.4e-3, 256), own, laws(NormalMapUse::ignored)[i]), 0.0);
    EXPECT_LT((same - without).norm(), 2e-3 * without.norm()) << i;
  }
}

TEST(NormalMapUse, WhatItGivesIsPaid) {
  // To and fro under a map that leans one way: the way along with it would give k d tan(angle) a metre, for ever.
  for (const Law& law : laws(NormalMapUse::felt)) {
    const Scene scene = plane(flat_map(0.0), leaning(0.5), law);
    ProxyState state;
    Vec3 last(-5e-3, 0.0, 1e-3);
    Vec3 force = touch(scene, state, last).wrench.force;
    double given = 0.0;
    double most_lateral = 0.0;
    double fed = 0.0;  // by a law that nobody holds back
    for (int i = 1; i <= 40000; ++i) {
      const Vec3 p(5e-3 * std::sin(1e-3 * i), 1e-3 * std::cos(1.7e-3 * i), -0.5e-3);
      const Vec3 move = p - last;
      given += force.dot(move) - 0.5 * stiffness * move.squaredNorm();
      EXPECT_LT(given, 1e-9) << i;
      fed = std::max(fed, 0.5 * std::tan(0.5) * (p.x() + 5e-3));
      force = touch(scene, state, p).wrench.force;
      most_lateral = std::max(most_lateral, force.x());
      last = p;
    }
    EXPECT_GT(most_lateral, 0.2) << law.facts().name;
    EXPECT_GT(fed, 1e-3);
  }
}

TEST(NormalMapUse, PrintedFormsHaveTheirOwnWay) {
  HeightFieldLaw height_field;
  height_field.formulation = Formulation::literal;
  height_field.normal_map = NormalMapUse::felt;
  MesostructureLaw mesostructure;
  mesostructure.formulation = Formulation::literal;
  mesostructure.normal_map = NormalMapUse::ignored;
  for (const Law& law : {Law(height_field), Law(mesostructure)}) {
    const Status status = validate(law);
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().code, ErrorCode::mismatch);
    EXPECT_NE(status.error().message().find("normal_map"), std::string::npos) << status.error().message();
  }
}

}  // namespace
}  // namespace asperity::normal_map_test
