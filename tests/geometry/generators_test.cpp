#include "asperity/geometry/generators.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <numbers>

namespace asperity {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180.0;

TriangleMesh built(MeshSource source) {
  auto mesh = TriangleMesh::build(std::move(source));
  EXPECT_TRUE(mesh.ok()) << (mesh.ok() ? "" : mesh.error().message());
  return std::move(mesh).value();
}

/// Bends of all inner edges (rad): positive where the surface is convex, seen from the side its normals point to.
std::vector<double> bends(const TriangleMesh& mesh) {
  std::vector<double> found;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    for (int edge = 0; edge < 3; ++edge) {
      const std::uint32_t other = mesh.neighbour(face, edge);
      if (other == no_index || other < face) continue;
      const Vec3 n = mesh.face_normal(face);
      const Vec3 m = mesh.face_normal(other);
      const auto corners = mesh.corners(face);
      const Vec3 along =
          (corners[static_cast<std::size_t>(edge + 1) % 3] - corners[static_cast<std::size_t>(edge)]).normalized();
      found.push_back(std::atan2(n.cross(m).dot(along), n.dot(m)));
    }
  }
  return found;
}

/// Neither dropped nor welded anything: the generator gave a clean mesh with UVs.
void expect_clean(const TriangleMesh& mesh) {
  EXPECT_EQ(mesh.report().welded_vertices, 0U);
  EXPECT_EQ(mesh.report().dropped_degenerate, 0U);
  EXPECT_EQ(mesh.report().dropped_duplicate, 0U);
  EXPECT_EQ(mesh.report().nonmanifold_vertices, 0U);
  EXPECT_EQ(mesh.report().components, 1U);
  EXPECT_TRUE(mesh.report().oriented());
  EXPECT_TRUE(mesh.has_uvs());
  EXPECT_TRUE(mesh.notes().empty());
}

TEST(Generators, IcosphereHasTwentyTimesFourToTheJFaces) {
  for (int j = 0; j <= 5; ++j) {
    const TriangleMesh mesh = built(icosphere(j, 0.05));
    expect_clean(mesh);
    EXPECT_EQ(mesh.report().triangles, std::size_t{20} << (2 * j));
    EXPECT_EQ(mesh.report().vertices, (std::size_t{10} << (2 * j)) + 2);
    EXPECT_TRUE(mesh.report().closed());
    for (const Vec3& position : mesh.positions()) EXPECT_NEAR(position.norm(), 0.05, 1e-16);
    EXPECT_LT(mesh.report().signed_volume, 4.0 / 3.0 * pi * 0.05 * 0.05 * 0.05);
    for (const double bend : bends(mesh)) EXPECT_GT(bend, 0.0);
  }
  const double regular = 5.0 * (3.0 + std::sqrt(5.0)) / 12.0 * std::pow(1.0 / std::sin(2.0 * pi / 5.0), 3.0);
  EXPECT_NEAR(built(icosphere(0, 1.0)).report().signed_volume, regular, 1e-13);
}

TEST(Generators, IcosphereRadiusForEdge) {
  EXPECT_NEAR(built(icosphere(3, icosphere_radius_for_edge(3, 0.02))).mean_edge(), 0.02, 1e-14);
}

TEST(Generators, PlaneGridIsOneRectangleHoweverItIsCut) {
  for (std::uint32_t triangles = 2; triangles <= 32768; triangles *= 2) {
    const TriangleMesh mesh = built(plane_grid(0.2, 0.1, triangles));
    expect_clean(mesh);
    EXPECT_EQ(mesh.report().triangles, triangles);
    EXPECT_NEAR(mesh.report().area, 0.02, 1e-14);
    EXPECT_EQ(mesh.bounds().upper, Vec3(0.1, 0.05, 0.0));
    EXPECT_EQ(mesh.bounds().lower, Vec3(-0.1, -0.05, 0.0));
    for (std::uint32_t face = 0; face < triangles; ++face) {
      EXPECT_EQ(mesh.face_normal(face), Vec3(0.0, 0.0, 1.0));
      for (std::size_t i = 0; i < 3; ++i) {
        const Vec3 corner = mesh.corners(face)[i];
        EXPECT_NEAR(static_cast<double>(mesh.uvs(face)[i].x()), corner.x() / 0.2 + 0.5, 1e-7);
        EXPECT_NEAR(static_cast<double>(mesh.uvs(face)[i].y()), corner.y() / 0.1 + 0.5, 1e-7);
      }
    }
  }
}

TEST(Generators, MaIsFlatAndEquilateral) {
  const TriangleMesh mesh = built(trial_mesh_a({5, 4, 0.03}));
  expect_clean(mesh);
  EXPECT_EQ(mesh.report().triangles, 40U);
  EXPECT_NEAR(mesh.report().min_edge, 0.03, 1e-15);
  EXPECT_NEAR(mesh.report().max_edge, 0.03, 1e-15);
  EXPECT_LT(mesh.bounds().centre().norm(), 1e-15);
  for (const double bend : bends(mesh)) EXPECT_EQ(bend, 0.0);
  EXPECT_EQ(mesh.face_normal(0), Vec3(0.0, 0.0, 1.0));
}

TEST(Generators, MbFoldsBetween180And225DegreesAndStaysNearEquilateral) {
  for (const double fold : {2.0 * degree, 6.0 * degree, 45.0 * degree}) {
    const TriangleMesh mesh = built(trial_mesh_b(fold, {8, 8, 0.01}));
    expect_clean(mesh);
    EXPECT_EQ(mesh.report().triangles, 128U);
    EXPECT_FALSE(mesh.report().closed());
    EXPECT_NEAR(mesh.mean_edge(), 0.01, 1e-15);
    const std::vector<double> found = bends(mesh);
    EXPECT_GT(*std::min_element(found.begin(), found.end()), 0.0);
    EXPECT_LE(*std::max_element(found.begin(), found.end()), fold * (1.0 + 1e-9));
    EXPECT_GT(*std::max_element(found.begin(), found.end()), 0.8 * fold);
    EXPECT_LT(mesh.report().worst_aspect, fold < 10.0 * degree ? 1.6 : 4.0);  // equilateral: 1.155
  }
}

TEST(Generators, McFoldsAcuteSquareAndObtuse) {
  const TriangleMesh mesh = built(trial_mesh_c({6, 6, 0.02}));
  expect_clean(mesh);
  EXPECT_NEAR(mesh.report().min_edge, 0.02, 1e-15);
  EXPECT_NEAR(mesh.report().max_edge, 0.02, 1e-15);
  const std::vector<double> found = bends(mesh);
  // Angles between faces are 180 degrees minus the bend.
  const auto count = [&](double angle) {
    return std::count_if(found.begin(), found.end(),
                         [&](double bend) { return std::abs(bend - angle * degree) < 1e-9; });
  };
  EXPECT_EQ(count(120.0), 6);   // ridge of 60 degrees
  EXPECT_EQ(count(90.0), 6);    // ridge of 90
  EXPECT_EQ(count(60.0), 6);    // ridge of 120
  EXPECT_EQ(count(-105.0), 6);  // valley of 75
  EXPECT_EQ(count(-75.0), 6);   // valley of 105
  EXPECT_EQ(static_cast<std::size_t>(count(0.0) + 30), found.size());
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) EXPECT_GT(mesh.face_normal(face).z(), 0.0);
}

TEST(Generators, MeIsAConcaveCupWithAPlaneRim) {
  for (const double opening : {0.5, pi / 2.0, 2.5}) {
    const TriangleMesh mesh = built(trial_mesh_e(8, opening, 0.01));
    expect_clean(mesh);
    EXPECT_EQ(mesh.report().triangles, 384U);
    EXPECT_EQ(mesh.report().boundary_edges, 48U);
    EXPECT_NEAR(mesh.mean_edge(), 0.01, 1e-14);
    const double radius = mesh.positions()[0].norm();
    for (const Vec3& position : mesh.positions()) EXPECT_NEAR(position.norm(), radius, 1e-15);
    EXPECT_NEAR(mesh.bounds().upper.z(), -radius * std::cos(opening), 1e-14);
    for (const double bend : bends(mesh)) EXPECT_LT(bend, 0.0);
    for (std::uint32_t face = 0; face < 384; ++face) {
      EXPECT_LT(mesh.face_normal(face).dot(mesh.corners(face)[0]), 0.0);  // to the centre: the inside is touched
    }
  }
}

TEST(Generators, MfHalvesAreaAndShrinksHeightBySqrtTwo) {
  const TriangleMesh mesh = built(trial_mesh_f(12, 0.02));
  expect_clean(mesh);
  EXPECT_NEAR(mesh.mean_edge(), 0.02, 1e-14);
  double last_x = -infinity;
  double last_area = 0.0;
  double last_height = 0.0;
  for (std::uint32_t face = 0; face < 12; ++face) {
    const auto c = mesh.corners(face);
    const double area = 0.5 * (c[1] - c[0]).cross(c[2] - c[0]).norm();
    const double longest = std::max({(c[1] - c[0]).norm(), (c[2] - c[1]).norm(), (c[0] - c[2]).norm()});
    const double height = 2.0 * area / longest;
    EXPECT_NEAR(height, 0.5 * longest, 1e-14);  // isosceles with a right angle
    if (face > 0) {
      EXPECT_NEAR(area / last_area, 0.5, 1e-9);
      EXPECT_NEAR(height / last_height, std::sqrt(0.5), 1e-9);
    }
    const double x = (c[0] + c[1] + c[2]).x() / 3.0;
    EXPECT_GT(x, last_x);
    EXPECT_EQ(mesh.face_normal(face), Vec3(0.0, 0.0, 1.0));
    for (std::size_t i = 0; i < 3; ++i) {
      const bool right_angle = (c[(i + 1) % 3] - c[i]).dot(c[(i + 2) % 3] - c[i]) < 1e-12 * area;
      EXPECT_EQ(mesh.uvs(face)[i].isZero(0.0F), right_angle);
    }
    last_x = x;
    last_area = area;
    last_height = height;
  }
}

TEST(Generators, BoxIsClosedAndOutward) {
  const TriangleMesh mesh = built(box_mesh({1.0, 2.0, 3.0}));
  expect_clean(mesh);
  EXPECT_TRUE(mesh.report().closed());
  EXPECT_NEAR(mesh.report().signed_volume, 6.0, 1e-14);
  EXPECT_NEAR(mesh.report().area, 22.0, 1e-13);
}

RC_GTEST_PROP(Generators, RandomClosedMeshIsStarShapedWithinItsBound, ()) {
  const auto seed = *rc::gen::arbitrary<std::uint64_t>();
  const int subdivisions = *rc::gen::inRange(0, 4);
  const double roughness = *rc::gen::inRange(0, 91) / 100.0;
  auto mesh = TriangleMesh::build(random_closed_mesh(seed, subdivisions, 2.0, roughness), {.orient_outward = false});
  RC_ASSERT(mesh.ok());
  RC_ASSERT(mesh->report().closed() && mesh->report().oriented());
  RC_ASSERT(mesh->report().triangles == std::size_t{20} << (2 * subdivisions));
  for (const Vec3& position : mesh->positions()) {
    RC_ASSERT(position.norm() >= 2.0 * (1.0 - roughness) - 1e-12);
    RC_ASSERT(position.norm() <= 2.0 * (1.0 + roughness) + 1e-12);
  }
  // Every face is seen from the origin from behind: the faces' cones tile all directions, so no two can meet.
  for (std::uint32_t face = 0; face < mesh->triangles().size(); ++face) {
    const auto [a, b, c] = mesh->corners(face);
    RC_ASSERT(a.dot(b.cross(c)) > 0.0);
  }
}

TEST(Generators, SameSeedSameMesh) {
  EXPECT_EQ(random_closed_mesh(3, 2, 1.0, 0.5).positions, random_closed_mesh(3, 2, 1.0, 0.5).positions);
  EXPECT_NE(random_closed_mesh(3, 2, 1.0, 0.5).positions, random_closed_mesh(4, 2, 1.0, 0.5).positions);
}

TEST(Generators, ParametersOutOfRangeStillGiveAMesh) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(built(icosphere(-3, nan)).report().triangles, 20U);
  EXPECT_EQ(built(plane_grid(-1.0, infinity, 0, -5)).report().triangles, 2U);
  EXPECT_EQ(built(plane_grid(1.0, 1.0, 0U)).report().triangles, 2U);
  EXPECT_EQ(built(trial_mesh_a({0, 0, 0.0})).report().triangles, 2U);
  EXPECT_GT(built(trial_mesh_b(10.0)).report().triangles, 2U);
  EXPECT_EQ(built(trial_mesh_e(0, nan, 1.0)).report().triangles, 6U);
  EXPECT_EQ(built(trial_mesh_f(0, 1.0)).report().triangles, 1U);
  EXPECT_EQ(built(trial_mesh_f(1000, 1.0)).report().triangles, 40U);
  EXPECT_TRUE(built(box_mesh({nan, 0.0, 1.0})).report().closed());
}

}  // namespace
}  // namespace asperity
