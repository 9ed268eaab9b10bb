#include "asperity/surface/relief/prisms.h"

#include <gtest/gtest.h>

#include "tests/surface/coats.h"

namespace asperity::prisms_test {
namespace {

using namespace test;

int prisms_that_contain(const TriangleMesh& mesh, const Prisms& prisms, const Vec3& p) {
  int count = 0;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) count += prisms.contains(face, p) ? 1 : 0;
  return count;
}

/// A point of the shell: the extruded face at this height.
Vec3 shell_point(const TriangleMesh& mesh, std::uint32_t face, const Vec3& barycentric, double height) {
  Vec3 point = point_on(mesh, face, barycentric);
  for (std::size_t i = 0; i < 3; ++i)
    point += height * barycentric[static_cast<int>(i)] * mesh.vertex_normal(mesh.triangles()[face][i]);
  return point;
}

TEST(Prisms, every_point_of_a_closed_meshs_shell_lies_in_exactly_one) {
  for (const MeshSource& source : {icosphere(0, 1.0), icosphere(2, 1.0), random_closed_mesh(4, 2, 1.0, 0.3)}) {
    const TriangleMesh mesh = mesh_of(source);
    const double half = 0.1 * mesh.mean_edge();
    const Prisms prisms(mesh, half);
    Rng rng(17);
    for (int i = 0; i < 4000; ++i) {
      const Vec3 p =
          shell_point(mesh, random_face(rng, mesh), random_barycentric(rng), rng.uniform(-0.98, 0.98) * half);
      ASSERT_EQ(prisms_that_contain(mesh, prisms, p), 1) << "point " << i;
    }
  }
}

TEST(Prisms, neighbours_choose_the_same_diagonal_so_that_bilinear_sides_do_not_leak) {
  // Vertices of very different normals: the sides are as bilinear as they come. Points close to the sides tell.
  const TriangleMesh mesh = mesh_of(random_closed_mesh(9, 1, 1.0, 0.6));
  const double half = 0.15 * mesh.mean_edge();
  const Prisms prisms(mesh, half);
  Rng rng(23);
  for (int i = 0; i < 8000; ++i) {
    Vec3 barycentric = random_barycentric(rng);
    const int side = static_cast<int>(rng.below(3));
    const double rest = 1.0 - barycentric[side];
    const double near = rng.uniform(0.0, 0.03);
    for (int k = 0; k < 3; ++k) barycentric[k] = k == side ? near : barycentric[k] * (1.0 - near) / rest;
    const Vec3 p = shell_point(mesh, random_face(rng, mesh), barycentric, rng.uniform(-0.9, 0.9) * half);
    ASSERT_EQ(prisms_that_contain(mesh, prisms, p), 1) << "point " << i;
  }
}

TEST(Prisms, points_above_and_below_the_shell_lie_in_none) {
  const TriangleMesh mesh = mesh_of(icosphere(1, 1.0));
  const Prisms prisms(mesh, 0.05);
  EXPECT_EQ(prisms.half_height(), 0.05);
  Rng rng(5);
  for (int i = 0; i < 1000; ++i) {
    const std::uint32_t face = random_face(rng, mesh);
    const Vec3 barycentric = random_barycentric(rng);
    EXPECT_EQ(prisms_that_contain(mesh, prisms, shell_point(mesh, face, barycentric, 0.0501)), 0);
    EXPECT_EQ(prisms_that_contain(mesh, prisms, shell_point(mesh, face, barycentric, -0.0501)), 0);
  }
}

TEST(Prisms, an_open_flat_meshs_shell_is_the_slab_over_it) {
  const TriangleMesh mesh = mesh_of(plane_grid(1.0, 1.0, 3, 3));
  for (std::uint32_t vertex = 0; vertex < mesh.positions().size(); ++vertex) {
    EXPECT_EQ(mesh.vertex_normal(vertex), Vec3(0.0, 0.0, 1.0)) << "the rim's vertices stand upright, too";
  }
  const Prisms prisms(mesh, 0.1);
  Rng rng(2);
  for (int i = 0; i < 4000; ++i) {
    const Vec3 p(rng.uniform(-0.6, 0.6), rng.uniform(-0.6, 0.6), rng.uniform(-0.2, 0.2));
    const bool inside = p.head<2>().cwiseAbs().maxCoeff() < 0.5 && std::abs(p.z()) < 0.1;
    ASSERT_EQ(prisms_that_contain(mesh, prisms, p), inside ? 1 : 0) << p.transpose();
  }
}

TEST(Prisms, rim_normals_of_a_folded_open_mesh_are_those_of_the_faces_there) {
  const TriangleMesh mesh = mesh_of(trial_mesh_c());
  for (std::uint32_t vertex = 0; vertex < mesh.positions().size(); ++vertex) {
    const Vec3 normal = mesh.vertex_normal(vertex);
    EXPECT_NEAR(normal.norm(), 1.0, 1e-6);
    for (const std::uint32_t face : mesh.faces_of_vertex(vertex)) EXPECT_GT(normal.dot(mesh.face_normal(face)), 0.0);
  }
}

TEST(Prisms, the_surface_of_a_prism_belongs_to_it) {
  const TriangleMesh mesh = mesh_of(plane_grid(1.0, 1.0, 1, 1));
  const Prisms prisms(mesh, 0.25);
  for (std::uint32_t face = 0; face < 2; ++face) {
    for (const Vec3& corner : mesh.corners(face)) {
      EXPECT_TRUE(prisms.contains(face, corner));
      EXPECT_TRUE(prisms.contains(face, corner + Vec3(0.0, 0.0, 0.25)));
    }
    EXPECT_TRUE(prisms.contains(face, Vec3::Zero())) << "on the shared diagonal";
  }
}

}  // namespace
}  // namespace asperity::prisms_test
