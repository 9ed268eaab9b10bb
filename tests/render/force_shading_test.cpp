#include <gtest/gtest.h>

#include <algorithm>

#include "tests/render/fixtures.h"

namespace asperity::force_shading_test {
namespace {

using namespace test;

TEST(ForceShading, turns_the_god_objects_force_and_keeps_its_size) {
  const HeightMap map = wavy_map(1e-3);
  const MeshSource source = plane_grid(0.04, 0.04, 4, 4);
  const Scene shaded = scene_of(coated(source, map, Mapping::uv), ForceShadingLaw{Formulation::literal});
  Rng rng(1);
  for (int i = 0; i < 500; ++i) {
    Vec3 p = random_point(rng, 0.015);
    p.z() = -rng.uniform(1e-5, 2e-3);
    const Vec3 force = poke(shaded, p + Vec3(0.0, 0.0, 5e-3), p).wrench.force;
    ASSERT_NEAR(force.norm(), stiffness * -p.z(), 1e-9);
    const Vec2 slope = map.sample(Vec2(p.x() / 0.04 + 0.5, p.y() / 0.04 + 0.5)).gradient / 0.04;
    ASSERT_LT((force.normalized() - Vec3(-slope.x(), -slope.y(), 1.0).normalized()).norm(), 1e-5);
  }
}

TEST(ForceShading, on_a_bare_mesh_the_direction_is_that_of_the_interpolated_vertex_normals) {
  const auto surface = bare(icosphere(1, 0.02));
  const Scene shaded = scene_of(surface, ForceShadingLaw{Formulation::literal});
  const TriangleMesh& mesh = surface->mesh();
  Rng rng(2);
  for (int i = 0; i < 300; ++i) {
    const std::uint32_t face = random_face(rng, mesh);
    const Vec3 barycentric = random_barycentric(rng, 0.2);
    const Vec3 foot = point_on(mesh, face, barycentric);
    const Vec3 normal = mesh.face_normal(face);
    const Vec3 force = poke(shaded, foot + 1e-3 * normal, foot - 3e-4 * normal).wrench.force;
    ASSERT_NEAR(force.norm(), 0.3, 1e-9);
    ASSERT_LT((force.normalized() - interpolated_normal(mesh, face, barycentric)).norm(), 1e-6);
  }
}

TEST(ForceShading, pushes_outward_on_the_back_of_an_open_sheet) {
  const Scene shaded = scene_of(coated(plane_grid(0.04, 0.04, 4, 4), wavy_map(1e-3), Mapping::uv),
                                ForceShadingLaw{Formulation::literal});
  const Vec3 p(0.003, 0.004, 5e-4);
  const Vec3 force = poke(shaded, Vec3(p.x(), p.y(), -2e-3), p).wrench.force;
  EXPECT_LT(force.z(), 0.0);
  EXPECT_NEAR(force.norm(), stiffness * p.z(), 1e-9);
}

/// How often the lateral force along x changes sign while it is stronger than `least` (N), across the centre of H_2's
/// cross.
int sign_changes(const Law& law, double depth, double least, double& strongest) {
  const HeightMap map =
      must(generate_height_map({MesostructureKind::beams, 96, 1e-3, 1, 1}, Wrap::repeat, Reconstruction::bilinear));
  const Scene scene = scene_of(coated(plane_grid(0.03, 0.03, 1, 1), map, Mapping::uv, 0.03), law);
  int changes = 0;
  double last = 0.0;
  strongest = 0.0;
  // A small circle around the crossing that cuts the corners of both beams.
  ProxyState state;
  touch(scene, state, Vec3(0.0, 0.0, 5e-3));
  for (int i = 0; i <= 4000; ++i) {
    const double a = 2.0 * std::numbers::pi * i / 4000.0;
    const double lateral =
        touch(scene, state, Vec3(7.5e-3 * std::cos(a), 7.5e-3 * std::sin(a), depth)).wrench.force.x();
    strongest = std::max(strongest, std::abs(lateral));
    if (std::abs(lateral) < least) continue;
    if (lateral * last < 0.0) ++changes;
    last = lateral;
  }
  return changes;
}

TEST(A2_force_mapping, lateral_force_alternates_at_the_centre_of_the_cross_and_the_height_fields_does_not) {
  double strongest = 0.0;
  EXPECT_GE(sign_changes(ForceShadingLaw{Formulation::literal}, -1e-3, 0.2, strongest), 2);
  EXPECT_GT(strongest, 0.5) << "of 1 N";
  EXPECT_EQ(sign_changes(HeightFieldLaw{Formulation::literal, 0.0}, 1e-4, 1e-12, strongest), 0);
  EXPECT_EQ(strongest, 0.0) << "the height field of 2005 pushes along the base's normal alone";
}

TEST(Energy_erratum_10, force_shading_gives_0_89_mJ_a_loop_in_the_reference_case) {
  const Scene scene = scene_of(reference_surface(0.0), ForceShadingLaw{Formulation::literal});
  const double work = std::abs(loop_work(scene, reference_loop(-1.5e-3), Vec3(0.0, 1e-3, 1e-3)));
  EXPECT_NEAR(work, 0.89e-3, 0.02 * 0.89e-3);
}

TEST(T1_loop_work, consistent_force_shading_gives_no_more_than_it_took) {
  const Scene scene = scene_of(reference_surface(0.0), ForceShadingLaw{});
  EXPECT_LT(loop_work(scene, reference_loop(-1.5e-3), Vec3(0.0, 1e-3, 1e-3)), 0.02 * 0.89e-3);
  std::vector<Vec3> backwards = reference_loop(-1.5e-3);
  std::reverse(backwards.begin(), backwards.end());
  EXPECT_LT(loop_work(scene, backwards, Vec3(0.0, 1e-3, 1e-3)), 0.02 * 0.89e-3);
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    Rng rng(seed);
    const auto loop = random_loop(rng, Vec3(0.0, 0.0, -2e-3), 4e-3, 1e-3, 16000);
    EXPECT_LT(loop_work(scene, loop, loop.front() + Vec3(0.0, 0.0, 6e-3)), 1e-5) << seed;
  }
}

TEST(ForceShadingConsistent, resists_the_way_up_and_keeps_the_push) {
  const Scene scene = scene_of(reference_surface(0.0), ForceShadingLaw{});
  const Scene plain = scene_of(reference_surface(0.0), GodObjectLaw{});
  // From the trough to the crest and on to the next trough: first against the slope, then with it.
  const auto path = line(Vec3(-2.5e-3, 1e-3, -1e-3), Vec3(2.5e-3, 1e-3, -1e-3), 2000);
  const auto shaded = slide(scene, path, Vec3(-2.5e-3, 1e-3, 1e-3));
  const auto pushed = slide(plain, path, Vec3(-2.5e-3, 1e-3, 1e-3));
  double up = 0.0;
  double down = 0.0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    EXPECT_NEAR(shaded[i].z(), pushed[i].z(), 1e-9);
    (path[i].x() < 0.0 ? up : down) += shaded[i].x() * 2.5e-6;
  }
  EXPECT_LT(up, -0.5e-3) << "J taken on the way up";
  EXPECT_GT(down, 0.8 * -up) << "J given back on the way down";
  EXPECT_LE(down, -up * 1.001);
}

}  // namespace
}  // namespace asperity::force_shading_test
