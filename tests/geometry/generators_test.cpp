#include "asperity/geometry/generators.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace asperity::generators_test {
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

TEST(Generators, MbAsAnArchIsMaWithFoldsOf180To225Degrees) {
  for (const int rows : {1, 2, 7, 8, 300}) {
    const TriangleMesh mesh = built(trial_mesh_b(45.0 * degree, {3, rows, 0.02}, TrialBend::arch));
    expect_clean(mesh);
    EXPECT_FALSE(mesh.report().closed());
    EXPECT_NEAR(mesh.report().min_edge, 0.02, 1e-12);
    EXPECT_NEAR(mesh.report().max_edge, 0.02, 1e-12);
    EXPECT_NEAR(mesh.bounds().centre().y(), 0.0, 0.02);
    const std::vector<double> found = bends(mesh);
    EXPECT_GE(*std::min_element(found.begin(), found.end()), -1e-9);
    EXPECT_NEAR(*std::max_element(found.begin(), found.end()), rows > 1 ? 45.0 * degree : 0.0, 1e-9);
    // Once the middle, then half of it on either side; all together never overhang.
    const auto count = [&](double angle) {
      return std::count_if(found.begin(), found.end(),
                           [&](double bend) { return std::abs(bend - angle * degree) < 1e-6; });
    };
    if (rows >= 7) {
      EXPECT_EQ(count(45.0), 3);
      EXPECT_EQ(count(22.5), 6);
      EXPECT_EQ(count(11.25), 6);
    }
    for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) EXPECT_GT(mesh.face_normal(face).z(), 0.35);
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

TEST(Generators, McFoldsAtTheAnglesAsked) {
  const std::vector<double> ridges{45.0 * degree, 150.0 * degree};
  const TriangleMesh mesh = built(trial_mesh_c({3, 8, 0.02}, ridges));
  expect_clean(mesh);
  const std::vector<double> found = bends(mesh);
  const auto count = [&](double angle) {
    return std::count_if(found.begin(), found.end(),
                         [&](double bend) { return std::abs(bend - angle * degree) < 1e-9; });
  };
  // Ridge, valley, ridge, valley ...: 4 ridges and 3 valleys on 8 strips, 3 edges wide.
  EXPECT_EQ(count(180.0 - 45.0), 6);
  EXPECT_EQ(count(180.0 - 150.0), 6);
  EXPECT_EQ(count(0.5 * (45.0 + 150.0) - 180.0), 9);
  EXPECT_NEAR(mesh.report().max_edge, 0.02, 1e-15);
  // The paper's angles are the own ones, and pi is flat.
  const std::vector<double> papers{60.0 * degree, 90.0 * degree, 120.0 * degree};
  const std::vector<double> flat{pi};
  EXPECT_EQ(trial_mesh_c({3, 8, 0.02}, papers).positions.size(), trial_mesh_c({3, 8, 0.02}).positions.size());
  const std::vector<double> own = bends(built(trial_mesh_c({3, 8, 0.02})));
  const std::vector<double> stated = bends(built(trial_mesh_c({3, 8, 0.02}, papers)));
  for (std::size_t i = 0; i < own.size(); ++i) EXPECT_NEAR(own[i], stated[i], 1e-12);
  for (const double bend : bends(built(trial_mesh_c({3, 8, 0.02}, flat)))) EXPECT_EQ(bend, 0.0);
}

TEST(Generators, MfIsGradedAsAsked) {
  for (const double grading : {0.1, 0.3, 0.5, 0.7, 0.9}) {
    const int most = most_graded_triangles(grading);
    EXPECT_GE(std::pow(grading, most), std::exp2(-40.0) * (1.0 - 1e-9));
    EXPECT_TRUE(most == 40 || std::pow(grading, most + 1) < std::exp2(-40.0));
    const TriangleMesh mesh = built(trial_mesh_f(9, 0.02, grading));
    expect_clean(mesh);
    EXPECT_NEAR(mesh.mean_edge(), 0.02, 1e-14);
    double last = 0.0;
    for (std::uint32_t face = 0; face < 9; ++face) {
      const auto c = mesh.corners(face);
      const double area = 0.5 * (c[1] - c[0]).cross(c[2] - c[0]).norm();
      if (face > 0) {
        EXPECT_NEAR(area / last, grading, 1e-9);
      }
      last = area;
      EXPECT_EQ(mesh.face_normal(face), Vec3(0.0, 0.0, 1.0));
      for (std::size_t i = 0; i < 3; ++i) {
        const double cosine = (c[(i + 1) % 3] - c[i]).normalized().dot((c[(i + 2) % 3] - c[i]).normalized());
        EXPECT_EQ(mesh.uvs(face)[i].isZero(0.0F), std::abs(cosine) < 1e-9) << grading;
      }
    }
    EXPECT_EQ(built(trial_mesh_f(1000, 1.0, grading)).report().triangles, static_cast<std::size_t>(most));
  }
}

/// Euler characteristic: the same for every cutting of a surface.
std::int64_t euler(const TriangleMesh& mesh) {
  const auto faces = static_cast<std::int64_t>(mesh.report().triangles);
  const auto boundary = static_cast<std::int64_t>(mesh.report().boundary_edges);
  return static_cast<std::int64_t>(mesh.report().vertices) - (3 * faces + boundary) / 2 + faces;
}

TEST(Generators, DisplacedBySameHeightIsTheOffsetMesh) {
  // On a sphere's mesh interpolated vertex normals point nearly outward: distances stay between facets and sphere.
  const TriangleMesh base = built(icosphere(3, 0.05));
  for (const int times : {0, 1, 2, 3}) {
    const TriangleMesh raised = built(displaced_mesh(base, times, [](auto, const Vec3&) { return 2e-3; }));
    expect_clean(raised);
    EXPECT_TRUE(raised.report().closed());
    EXPECT_EQ(euler(raised), 2);
    EXPECT_EQ(raised.report().triangles, base.report().triangles << (2 * times));
    for (const Vec3& p : raised.positions()) {
      EXPECT_LE(p.norm(), 0.052 + 1e-9);
      EXPECT_GE(p.norm(), 0.0515);
    }
  }
}

RC_GTEST_PROP(Generators, DisplacedPointsLieAtTheirHeightAlongTheVertexNormals, ()) {
  const auto seed = *rc::gen::arbitrary<std::uint32_t>();
  const int times = *rc::gen::inRange(0, 4);
  const TriangleMesh base = built(random_closed_mesh(seed, 1, 1.0, 0.5));
  const auto height = [&](std::uint32_t face, const Vec3& b) {
    // Continuous across edges: a function of the place.
    const auto c = base.corners(face);
    const Vec3 place = b[0] * c[0] + b[1] * c[1] + b[2] * c[2];
    return 0.01 * std::sin(7.0 * place.x() + 5.0 * place.y() * place.z());
  };
  const MeshSource source = displaced_mesh(base, times, height);
  const int parts = 1 << times;
  RC_ASSERT(source.triangles.size() == base.triangles().size() << static_cast<unsigned>(2 * times));
  RC_ASSERT(source.corner_uvs.size() == source.triangles.size());
  // Each expected point, by its formula, is among the vertices, and there are no others.
  std::size_t expected = 0;
  for (std::uint32_t face = 0; face < base.triangles().size(); ++face) {
    const auto c = base.corners(face);
    const auto& t = base.triangles()[face];
    for (int i = 0; i <= parts; ++i) {
      for (int j = 0; i + j <= parts; ++j) {
        const Vec3 b = Vec3(parts - i - j, i, j) / parts;
        const Vec3 normal =
            (b[0] * base.vertex_normal(t[0]) + b[1] * base.vertex_normal(t[1]) + b[2] * base.vertex_normal(t[2]))
                .normalized();
        const Vec3 p = b[0] * c[0] + b[1] * c[1] + b[2] * c[2] + height(face, b) * normal;
        const auto near = std::count_if(source.positions.begin(), source.positions.end(),
                                        [&](const Vec3& q) { return (p - q).norm() < 1e-12; });
        RC_ASSERT(near == 1);
        ++expected;
      }
    }
  }
  const auto faces = base.triangles().size();
  const auto inside = static_cast<std::size_t>((parts - 1) * (parts - 2) / 2);
  RC_ASSERT(expected == faces * static_cast<std::size_t>((parts + 1) * (parts + 2) / 2));
  RC_ASSERT(source.positions.size() ==
            base.positions().size() + 3 * faces / 2 * static_cast<std::size_t>(parts - 1) + faces * inside);
  // Triangles keep their side.
  for (std::size_t k = 0; k < source.triangles.size(); ++k) {
    const auto& [a, b, c] = source.triangles[k];
    const Vec3 normal = (source.positions[b] - source.positions[a]).cross(source.positions[c] - source.positions[a]);
    RC_ASSERT(normal.dot(base.face_normal(static_cast<std::uint32_t>(k >> static_cast<unsigned>(2 * times)))) > 0.0);
  }
}

TEST(Generators, DisplacedHeightsThatDifferMeetAtTheirMean) {
  const TriangleMesh base = built(plane_grid(1.0, 1.0, 1, 1));
  const TriangleMesh mesh =
      built(displaced_mesh(base, 2, [](std::uint32_t face, const Vec3&) { return face == 0 ? 0.1 : 0.3; }));
  expect_clean(mesh);  // no gap along the diagonal
  EXPECT_EQ(euler(mesh), 1);
  for (const Vec3& p : mesh.positions()) {
    const double side = p.y() - p.x();
    EXPECT_NEAR(p.z(), std::abs(side) < 1e-9 ? 0.2 : (side < 0.0 ? 0.1 : 0.3), 1e-12);
  }
}

TEST(Generators, MGFollowsItsHeightsOnMb) {
  const TrialMeshSettings settings{6, 4, 0.01};
  const TriangleMesh base = built(trial_mesh_b(6.0 * degree, settings));
  const TriangleMesh flat = built(trial_mesh_g(
      3, [](auto, const Vec3&) { return 0.0; }, 6.0 * degree, settings));
  expect_clean(flat);
  EXPECT_EQ(flat.report().triangles, 48U * 64U);
  EXPECT_EQ(euler(flat), euler(base));
  EXPECT_NEAR(flat.report().area, base.report().area, 1e-15);
  EXPECT_NEAR(flat.mean_edge(), 0.01 / 8.0, 1e-5);
  const auto bump = [](std::uint32_t, const Vec3& b) { return 27e-3 * b[0] * b[1] * b[2]; };
  const TriangleMesh bumpy = built(trial_mesh_g(3, bump, 6.0 * degree, settings));
  EXPECT_GT(bumpy.report().area, 1.01 * flat.report().area);
  // UVs stay those of M_b: a map lies the same.
  for (std::uint32_t face = 0; face < bumpy.triangles().size(); ++face) EXPECT_EQ(bumpy.uvs(face), flat.uvs(face));
  EXPECT_EQ(trial_mesh_g(99, bump, 6.0 * degree, {1000, 1000, 0.01}).triangles.size(), 2'000'000U);
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
  EXPECT_EQ(built(trial_mesh_f(5, 1.0, nan)).report().triangles, 5U);
  EXPECT_GT(built(trial_mesh_c({2, 2, 1.0}, std::vector<double>{nan, -1.0, 9.0})).report().triangles, 2U);
  EXPECT_TRUE(built(box_mesh({nan, 0.0, 1.0})).report().closed());
}

}  // namespace
}  // namespace asperity::generators_test
