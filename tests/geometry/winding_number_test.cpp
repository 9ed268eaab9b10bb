// The winding number's tree against the sum of all solid angles, against the inside and outside of closed meshes, and
// against solid angles known in closed form.

#include "asperity/geometry/winding_number.h"

#include <gtest/gtest.h>

#include <rapidcheck/gtest.h>
#include <cmath>
#include <numbers>

#include "tests/geometry/random_meshes.h"

namespace asperity::winding_number_test {
namespace {

/// The solid angle by another formula than the program's: the spherical excess of the triangle seen (l'Huilier).
double winding_by_excess(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
  const Vec3 u = (a - p).normalized();
  const Vec3 v = (b - p).normalized();
  const Vec3 w = (c - p).normalized();
  const auto angle = [](const Vec3& from, const Vec3& to) { return std::atan2(from.cross(to).norm(), from.dot(to)); };
  const double x = angle(v, w);
  const double y = angle(w, u);
  const double z = angle(u, v);
  const double s = 0.5 * (x + y + z);
  const double product =
      std::tan(0.5 * s) * std::tan(0.5 * (s - x)) * std::tan(0.5 * (s - y)) * std::tan(0.5 * (s - z));
  const double excess = 4.0 * std::atan(std::sqrt(std::max(product, 0.0)));
  return std::copysign(excess, u.dot(v.cross(w))) / (4.0 * std::numbers::pi);
}

double brute_winding(const TriangleMesh& mesh, const Vec3& p) {
  double sum = 0.0;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const auto [a, b, c] = mesh.corners(face);
    sum += winding_by_excess(a, b, c, p);
  }
  return sum;
}

MeshSource flipped(MeshSource source) {
  for (auto& triangle : source.triangles) std::swap(triangle[1], triangle[2]);
  return source;
}

void append(MeshSource& source, const MeshSource& other, double scale) {
  const auto first = static_cast<std::uint32_t>(source.positions.size());
  for (const Vec3& position : other.positions) source.positions.push_back(scale * position);
  for (const auto& [a, b, c] : other.triangles) source.triangles.push_back({first + a, first + b, first + c});
  source.corner_uvs.clear();
}

TriangleMesh as_given(MeshSource source) {
  return TriangleMesh::build(std::move(source), {1.0, false}).value();
}

TEST(WindingNumber, SolidAngleOfTheOctantIsAnEighth) {
  const Vec3 x = Vec3::UnitX();
  const Vec3 y = Vec3::UnitY();
  const Vec3 z = Vec3::UnitZ();
  EXPECT_NEAR(triangle_winding(x, y, z, Vec3::Zero()), 0.125, 1e-15);
  EXPECT_NEAR(triangle_winding(x, z, y, Vec3::Zero()), -0.125, 1e-15);
  EXPECT_NEAR(std::abs(triangle_winding(x, y, z, Vec3::Constant(1.0 / 3.0))), 0.5, 1e-12);  // in the triangle
  EXPECT_EQ(triangle_winding(x, y, z, x), 0.0);                                             // on a corner
}

RC_GTEST_PROP(WindingNumber, SolidAngleEqualsTheSphericalExcess, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const Vec3 a = test::random_point(rng, 1.0);
  const Vec3 b = test::random_point(rng, 1.0);
  const Vec3 c = test::random_point(rng, 1.0);
  const Vec3 p = test::random_point(rng, 2.0);
  RC_ASSERT(std::abs(triangle_winding(a, b, c, p) - winding_by_excess(a, b, c, p)) < 1e-6);
}

TEST(WindingNumber, EqualsTheSumOfSolidAnglesOnSoups) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Rng rng(seed);
    const TriangleMesh mesh = as_given(test::random_soup(seed, 400));
    const WindingNumber winding(mesh);
    for (int i = 0; i < 300; ++i) {
      const Vec3 p = test::random_point(rng, i % 3 == 0 ? 5.0 : 1.5);
      EXPECT_NEAR(winding.at(p), brute_winding(mesh, p), 1e-2);
    }
  }
}

TEST(WindingNumber, EqualsTheSumOfSolidAnglesOnEveryKindOfMesh) {
  for (int kind = 0; kind < test::kinds_of_mesh; ++kind) {
    Rng rng(static_cast<std::uint64_t>(kind) + 1);
    const TriangleMesh mesh = as_given(test::mesh_of_kind(kind, 5));
    const WindingNumber winding(mesh);
    for (int i = 0; i < 150; ++i) {
      const Vec3 p = mesh.bounds().centre() + test::random_point(rng, mesh.bounds().diagonal());
      EXPECT_NEAR(winding.at(p), brute_winding(mesh, p), 1e-2) << "kind " << kind;
    }
  }
}

TEST(WindingNumber, PassesThroughAHoleAsTheExactSumDoes) {
  for (const std::uint32_t one_in : {2U, 5U, 20U}) {
    Rng rng(one_in);
    const TriangleMesh mesh = as_given(test::with_holes(icosphere(4, 1.0), one_in, one_in));
    const WindingNumber winding(mesh);
    double largest = 0.0;
    for (int i = 0; i < 300; ++i) {
      // Most of them close to the surface, where the decision falls.
      const Vec3 direction = test::random_point(rng, 1.0).normalized();
      const Vec3 p = direction * (i % 2 == 0 ? 1.0 + rng.uniform(-0.05, 0.05) : rng.uniform(0.0, 2.0));
      largest = std::max(largest, std::abs(winding.at(p) - brute_winding(mesh, p)));
    }
    EXPECT_LT(largest, 5e-3) << "one missing in " << one_in;
    const double expected = static_cast<double>(mesh.triangles().size()) / (20.0 * 256.0);
    EXPECT_NEAR(winding.at(Vec3::Zero()), expected, 0.02);  // the missing triangles' part of the sphere
  }
}

TEST(WindingNumber, IsOneInsideAndNoughtOutsideOfClosedMeshes) {
  Rng rng(7);
  const TriangleMesh box = as_given(box_mesh(Vec3(2.0, 1.0, 0.5)));
  const WindingNumber of_box(box);
  const TriangleMesh ball = as_given(icosphere(5, 1.0));
  const WindingNumber of_ball(ball);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 p = test::random_point(rng, 1.3);
    const double margin = (p.cwiseAbs() - Vec3(1.0, 0.5, 0.25)).maxCoeff();
    if (std::abs(margin) > 1e-9) {
      EXPECT_NEAR(of_box.at(p), margin < 0.0 ? 1.0 : 0.0, 1e-9);
    }
    // The polyhedron's faces lie up to 0.001 within the sphere.
    if (p.norm() > 1.0 || p.norm() < 0.998) {
      EXPECT_NEAR(of_ball.at(p), p.norm() < 1.0 ? 1.0 : 0.0, 5e-3);
    }
  }
}

TEST(WindingNumber, IsMinusOneInsideOutAndTwoTwiceCovered) {
  Rng rng(8);
  const TriangleMesh turned = as_given(flipped(icosphere(4, 1.0)));
  MeshSource both = icosphere(4, 1.0);
  append(both, icosphere(4, 1.0), 1.001);
  const TriangleMesh twice = as_given(both);
  MeshSource hollow = icosphere(4, 1.0);
  append(hollow, flipped(icosphere(4, 1.0)), 0.5);
  const TriangleMesh shell = as_given(hollow);
  const WindingNumber of_turned(turned);
  const WindingNumber of_twice(twice);
  const WindingNumber of_shell(shell);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 p = test::random_point(rng, 1.5);
    const double r = p.norm();
    if (r < 0.99) {
      EXPECT_NEAR(of_turned.at(p), -1.0, 5e-3);
    }
    if (r < 0.99) {
      EXPECT_NEAR(of_twice.at(p), 2.0, 1e-2);
    }
    if (r > 1.002) {
      EXPECT_NEAR(of_twice.at(p), 0.0, 1e-2);
    }
    if (r < 0.49) {
      EXPECT_NEAR(of_shell.at(p), 0.0, 1e-2);
    }
    if (r > 0.51 && r < 0.99) {
      EXPECT_NEAR(of_shell.at(p), 1.0, 1e-2);
    }
  }
}

TEST(WindingNumber, DecaysWithTheSquareOfTheDistanceFromASheet) {
  const TriangleMesh sheet = as_given(plane_grid(0.2, 0.1, 40, 20));
  const WindingNumber winding(sheet);
  for (const double distance : {10.0, 100.0, 1000.0}) {
    // A far sheet is seen as its area over the squared distance; from below it is seen from behind.
    const double expected = 0.02 / (4.0 * std::numbers::pi * distance * distance);
    EXPECT_NEAR(winding.at(Vec3(0.0, 0.0, -distance)) / expected, 1.0, 1e-3);
    EXPECT_NEAR(winding.at(Vec3(0.0, 0.0, distance)) / expected, -1.0, 1e-3);
    EXPECT_NEAR(winding.at(Vec3(distance, 0.0, 0.0)) / expected, 0.0, 1e-9);
  }
  EXPECT_NEAR(winding.at(Vec3(0.01, 0.01, -1e-7)), 0.5, 1e-4);
  EXPECT_NEAR(winding.at(Vec3(0.01, 0.01, 1e-7)), -0.5, 1e-4);
}

TEST(WindingNumber, DependsOnNoUnitAndOnNoPlace) {
  Rng rng(9);
  const MeshSource source = test::with_holes(icosphere(3, 1.0), 3, 4);
  const TriangleMesh mesh = as_given(source);
  constexpr double unit = 1.0 / 1024.0;  // a power of two: every rounding is the same
  const Vec3 offset(3e3, -2e3, 1e3);
  MeshSource small = source;
  MeshSource away = source;
  for (Vec3& position : small.positions) position *= unit;
  for (Vec3& position : away.positions) position += offset;
  const TriangleMesh small_mesh = as_given(small);
  const TriangleMesh away_mesh = as_given(away);
  const WindingNumber winding(mesh);
  const WindingNumber of_small(small_mesh);
  const WindingNumber of_away(away_mesh);
  for (int i = 0; i < 200; ++i) {
    const Vec3 p = test::random_point(rng, 1.5);
    EXPECT_NEAR(of_small.at(unit * p), winding.at(p), 1e-12);
    EXPECT_NEAR(of_away.at(p + offset), winding.at(p), 1e-2);  // clusters may be others
  }
}

TEST(WindingNumber, IsNoughtWhereThePointIsNoPoint) {
  const TriangleMesh ball = as_given(icosphere(2, 1.0));
  const WindingNumber winding(ball);
  EXPECT_EQ(winding.at(Vec3(std::nan(""), 0.0, 0.0)), 0.0);
  EXPECT_EQ(winding.at(Vec3(0.0, infinity, 0.0)), 0.0);
  EXPECT_EQ(winding.at(Vec3(0.0, 0.0, 1e300)), 0.0);
  EXPECT_GT(winding.memory_bytes(), sizeof(WindingNumber));
}

}  // namespace
}  // namespace asperity::winding_number_test
