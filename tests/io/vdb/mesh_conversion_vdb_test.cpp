// Meshes made potentials with OpenVDB, against brute force over all triangles (checklists K-1, K-9).

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include "asperity/core/rng.h"
#include "asperity/geometry/closest_point.h"
#include "asperity/geometry/winding_number.h"
#include "asperity/io/mesh_io.h"
#include "asperity/render/law_registry.h"
#include "asperity/render/step.h"
#include "asperity/surface/implicit/surface.h"
#include "tests/io/vdb/vdb_files.h"

namespace asperity::mesh_conversion_vdb_test {
namespace {

class MeshConversionVdb : public WithVdb {};

ConversionSettings at_resolution(std::uint32_t resolution, InsideRule rule = InsideRule::automatic) {
  ConversionSettings settings;
  settings.resolution = resolution;
  settings.rule = rule;
  return settings;
}

double brute_distance(const TriangleMesh& mesh, const Vec3& p) {
  double least = infinity;
  for (std::uint32_t f = 0; f < mesh.triangles().size(); ++f) {
    const auto c = mesh.corners(f);
    least = std::min(least, closest_point_on_triangle(p, c[0], c[1], c[2]).squared_distance);
  }
  return std::sqrt(least);
}

double brute_winding(const TriangleMesh& mesh, const Vec3& p) {
  double sum = 0.0;
  for (std::uint32_t f = 0; f < mesh.triangles().size(); ++f) {
    const auto c = mesh.corners(f);
    sum += triangle_winding(c[0], c[1], c[2], p);
  }
  return sum;
}

Vec3 node_at(const SparseSource& source, const std::array<std::int32_t, 3>& block, int i, int j, int k) {
  return source.origin + source.voxel * Vec3(8 * block[0] + i, 8 * block[1] + j, 8 * block[2] + k);
}

template <class Visit>
void for_each_node(const SparseSource& source, const Visit& visit) {
  for (const SparseBlock& block : source.blocks) {
    for (int k = 0; k < 8; ++k) {
      for (int j = 0; j < 8; ++j) {
        for (int i = 0; i < 8; ++i) visit(block, SparseBlock::index(i, j, k), node_at(source, block.at, i, j, k));
      }
    }
  }
}

/// Values, signs and faces of every stored point, and that every point of the band is stored. `inside`: whether a point
/// is, by other means. One point in `stride` is looked at.
template <class Inside>
void expect_exact(const ConvertedMesh& converted, const TriangleMesh& mesh, const Inside& inside,
                  std::size_t stride = 1) {
  const SparseSource source = converted.grid.source();
  const double voxel = source.voxel;
  std::map<std::array<std::int32_t, 3>, bool> stored;
  double worst_value = 0.0;
  double worst_face = 0.0;
  std::size_t wrong_signs = 0;
  std::size_t in_band = 0;
  std::size_t looked = 0;
  for_each_node(source, [&](const SparseBlock& block, std::size_t at, const Vec3& p) {
    stored[block.at] = true;
    const bool within =
        block.value[at] > static_cast<float>(source.inside) && block.value[at] < static_cast<float>(source.outside);
    if (within) ++in_band;
    if (++looked % stride != 0) return;
    const double distance = brute_distance(mesh, p);
    const auto value = static_cast<double>(block.value[at]);
    if (distance > 1e-4 * voxel && (value < 0.0) != inside(p)) ++wrong_signs;
    const double expected = std::clamp(value < 0.0 ? -distance : distance, source.inside, source.outside);
    worst_value = std::max(worst_value, std::abs(value - expected));
    if (!within) return;
    ASSERT_FALSE(block.face.empty());
    ASSERT_LT(block.face[at], mesh.triangles().size());
    const auto c = mesh.corners(block.face[at]);
    worst_face = std::max(
        worst_face, std::abs(std::sqrt(closest_point_on_triangle(p, c[0], c[1], c[2]).squared_distance) - distance));
  });
  EXPECT_EQ(wrong_signs, 0U);
  EXPECT_LT(worst_value, 1e-6 * voxel);
  EXPECT_LT(worst_face, 1e-9 * voxel);
  EXPECT_EQ(in_band, converted.report.points);
  // Blocks that are not stored hold no point of the band: their middle is too far away.
  const double reach = 0.5 * std::sqrt(3.0) * 7.0 * voxel;
  std::array<std::int32_t, 3> low = source.blocks.front().at;
  std::array<std::int32_t, 3> high = low;
  for (const SparseBlock& block : source.blocks) {
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], block.at[a] - 1);
      high[a] = std::max(high[a], block.at[a] + 1);
    }
  }
  std::array<std::int32_t, 3> at{};
  for (at[2] = low[2]; at[2] <= high[2]; ++at[2]) {
    for (at[1] = low[1]; at[1] <= high[1]; ++at[1]) {
      for (at[0] = low[0]; at[0] <= high[0]; ++at[0]) {
        if (stored.contains(at)) continue;
        const Vec3 middle = node_at(source, at, 0, 0, 0) + Vec3::Constant(3.5 * voxel);
        const double band = inside(middle) ? -source.inside : source.outside;
        if (brute_distance(mesh, middle) - reach >= band) continue;
        for (int n = 0; n < 512; n += 7) {
          const Vec3 p = node_at(source, at, n % 8, n / 8 % 8, n / 64);
          EXPECT_GE(brute_distance(mesh, p), (inside(p) ? -source.inside : source.outside) - 1e-9 * voxel);
        }
      }
    }
  }
}

TEST_F(MeshConversionVdb, K_1_SphereIsExactAndNearTheBallBySquareOfTheEdge) {
  double error[2] = {};
  for (const int level : {2, 3}) {
    const TriangleIndex index = index_of(icosphere(level, 0.05));
    const auto converted = convert_mesh(index, at_resolution(24));
    ASSERT_TRUE(converted) << converted.error().message();
    EXPECT_EQ(converted->report.rule, InsideRule::flood);
    EXPECT_DOUBLE_EQ(converted->report.voxel, index.mesh().bounds().extent().maxCoeff() / 24);
    if (level == 2) {
      expect_exact(*converted, index.mesh(), [&](const Vec3& p) { return brute_winding(index.mesh(), p) > 0.5; });
    }
    const SparseSource source = converted->grid.source();
    for_each_node(source, [&](const SparseBlock& block, std::size_t at, const Vec3& p) {
      const auto value = static_cast<double>(block.value[at]);
      if (value > source.inside && value < source.outside)
        error[level - 2] = std::max(error[level - 2], std::abs(value - (p.norm() - 0.05)));
    });
  }
  // Sagitta of the triangles, (largest edge)^2 / (6 radius) and less: a quarter at half the edge.
  EXPECT_LT(error[0], 0.05 * 0.02);
  EXPECT_NEAR(error[0] / error[1], 4.0, 0.6);
}

TEST_F(MeshConversionVdb, K_1_BoxIsExactIntoItsInterior) {
  const TriangleIndex index = index_of(box_mesh({0.08, 0.05, 0.03}));
  ConversionSettings settings = at_resolution(24);
  settings.band_inside = infinity;
  const auto converted = convert_mesh(index, settings);
  ASSERT_TRUE(converted) << converted.error().message();
  const Vec3 half(0.04, 0.025, 0.015);
  expect_exact(*converted, index.mesh(), [&](const Vec3& p) { return (half - p.cwiseAbs()).minCoeff() > 0.0; });
  // The middle is 15 mm deep, and stored.
  SparseHint hint;
  EXPECT_NEAR(converted->grid.trilinear(Vec3(0.0005, 0.0004, 0.0003), hint).value, -0.0147, converted->report.voxel);
}

TEST_F(MeshConversionVdb, K_1_TorusIsExactWithItsHoleOutside) {
  const TriangleIndex index = index_of(torus_mesh(0.03, 0.012, 40, 20));
  ConversionSettings settings = at_resolution(32);
  settings.band_outside = 0.012;
  const auto converted = convert_mesh(index, settings);
  ASSERT_TRUE(converted) << converted.error().message();
  const WindingNumber winding(index.mesh());
  expect_exact(
      *converted, index.mesh(), [&](const Vec3& p) { return winding.at(p) > 0.5; }, 5);
  SparseHint hint;
  EXPECT_GT(converted->grid.trilinear(Vec3::Zero(), hint).value, 0.01);
}

/// Largest error (m) of a potential on the surface and within half a voxel of it, against the distance in closed form.
double potential_error(const MeshSource& mesh, std::uint32_t resolution, CellReconstruction reconstruction,
                       const std::function<double(const Vec3&)>& distance) {
  auto converted = convert_mesh(index_of(mesh), at_resolution(resolution));
  EXPECT_TRUE(converted) << converted.error().message();
  const double voxel = converted->report.voxel;
  ImplicitParts parts;
  parts.grid = std::make_shared<const SparseGrid>(std::move(converted->grid));
  parts.reconstruction = reconstruction;
  const ImplicitSurface surface = ImplicitSurface::build(std::move(parts)).value();
  SurfaceCache cache;
  Rng rng(5);
  double worst = 0.0;
  for (int found = 0; found < 20000;) {
    const Vec3 p(rng.uniform(-0.06, 0.06), rng.uniform(-0.06, 0.06), rng.uniform(-0.06, 0.06));
    const double expected = distance(p);
    if (std::abs(expected) > 0.5 * voxel) continue;
    ++found;
    worst = std::max(worst, std::abs(surface.eval(p, cache).value - expected));
  }
  return worst;
}

TEST_F(MeshConversionVdb, K_1_PotentialIsNearTheSurfaceBySquareOfTheVoxel) {
  const auto ball = [](const Vec3& p) { return p.norm() - 0.05; };
  const auto torus = [](const Vec3& p) { return std::hypot(std::hypot(p.x(), p.y()) - 0.035, p.z()) - 0.015; };
  const std::tuple<const char*, MeshSource, std::function<double(const Vec3&)>, double> shapes[] = {
      {"ball", icosphere(6, 0.05), ball, 0.05}, {"torus", torus_mesh(0.035, 0.015, 500, 220), torus, 0.015}};
  for (const auto& [name, mesh, distance, radius] : shapes) {
    double flat = 0.0;  // by how much the triangles themselves are off
    for (const auto& [i, j, k] : mesh.triangles)
      flat = std::max(flat, std::abs(distance((mesh.positions[i] + mesh.positions[j] + mesh.positions[k]) / 3.0)));
    double error[2][3] = {};
    for (const int n : {0, 1, 2}) {
      error[0][n] = potential_error(mesh, 16U << n, CellReconstruction::trilinear, distance);
      error[1][n] = potential_error(mesh, 16U << n, CellReconstruction::smooth, distance);
      const double voxel = 0.1 / (16U << n);
      std::printf("%-5s at %3u voxels: trilinear %.2f, smooth %.2f um, triangles %.2f um\n", name, 16U << n,
                  1e6 * error[0][n], 1e6 * error[1][n], 1e6 * flat);
      // A parabola between nodes, voxel^2 / 8 radius, along each of three axes at most; smooth follows the curvature.
      EXPECT_LT(error[0][n], 3.0 * voxel * voxel / (8.0 * radius) + flat) << name;
      EXPECT_LT(error[1][n], 0.25 * error[0][n] + 2.0 * flat) << name;
    }
    for (const int n : {0, 1}) {
      EXPECT_GT(error[0][n] / error[0][n + 1], 3.2) << name;
      EXPECT_LT(error[0][n] / error[0][n + 1], 5.2) << name;
    }
  }
}

/// The same surface in four times as many triangles.
MeshSource divided(const MeshSource& mesh) {
  MeshSource out;
  out.positions = mesh.positions;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [found, added] = middles.emplace(std::minmax(a, b), static_cast<std::uint32_t>(out.positions.size()));
    if (added) out.positions.push_back(0.5 * (mesh.positions[a] + mesh.positions[b]));
    return found->second;
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::uint32_t ab = middle(a, b);
    const std::uint32_t bc = middle(b, c);
    const std::uint32_t ca = middle(c, a);
    for (const auto& part :
         {std::array{a, ab, ca}, std::array{ab, b, bc}, std::array{ca, bc, c}, std::array{ab, bc, ca}})
      out.triangles.push_back(part);
  }
  return out;
}

/// Least time (s) of a pass over the same thousand places, pressed into a ball of 50 mm.
struct PressedBall {
  Scene scene;
  ProxyState state{};
  double least = infinity;

  explicit PressedBall(const std::shared_ptr<const ImplicitSurface>& surface, const Law& law)
      : scene(scene_of(surface, law)) {}
  static Scene scene_of(const std::shared_ptr<const ImplicitSurface>& surface, const Law& law) {
    Instance instance;
    instance.name = "ball";
    instance.surface = surface;
    instance.law = law;
    return Scene::build({instance}, 0.0).value();
  }
  void pass() {
    state = {};
    double felt = 0.0;
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < 1000; ++i) {
      const double t = 2.0 * std::numbers::pi * i / 1000.0;
      ProbeSample probe;
      probe.pose.position = (i == 0 ? 0.052 : 0.0494) * Vec3(std::cos(t), std::sin(t) * 0.8, std::sin(t) * 0.6);
      felt += step(scene, state, probe, Seconds(1e-3)).wrench.force.norm();
    }
    least = std::min(least, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    EXPECT_GT(felt, 0.0);
  }
};

TEST_F(MeshConversionVdb, K_2_ATickCostsTheSameWhateverTheTriangles) {
  std::vector<std::shared_ptr<const ImplicitSurface>> surfaces;
  MeshSource mesh = icosphere(3, 0.05);
  for (const std::size_t triangles : {std::size_t{1280}, std::size_t{1310720}}) {
    while (mesh.triangles.size() < triangles) mesh = divided(mesh);
    ASSERT_EQ(mesh.triangles.size(), triangles);
    auto converted = convert_mesh(index_of(mesh), at_resolution(64));
    ASSERT_TRUE(converted) << converted.error().message();
    ImplicitParts parts;
    parts.grid = std::make_shared<const SparseGrid>(std::move(converted->grid));
    surfaces.push_back(std::make_shared<const ImplicitSurface>(ImplicitSurface::build(std::move(parts)).value()));
  }
  for (const char* name : {"virtual-contact-point", "virtual-contact-point-literal", "proxy"}) {
    const Law law = law_by_name(name).value();
    PressedBall few(surfaces[0], law);
    PressedBall many(surfaces[1], law);
    // In turn, and the least of each: whatever else the machine does, one pass of many is left alone.
    double ratio = 0.0;
    for (int round = 0; round < 400; ++round) {
      few.pass();
      many.pass();
      ratio = many.least / few.least;
      if (round >= 40 && std::abs(ratio - 1.0) < 0.1) break;
    }
    std::printf("%-29s %.0f ns a tick at 1,280 triangles, %.0f at 1,310,720: %.3f\n", name, 1e6 * few.least,
                1e6 * many.least, ratio);
    EXPECT_GT(ratio, 0.8) << name;
    EXPECT_LT(ratio, 1.25) << name;
  }
}

TEST_F(MeshConversionVdb, RandomBlobsAreExact) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const TriangleIndex index = index_of(random_closed_mesh(seed, 2, 0.04, 0.5));
    const WindingNumber winding(index.mesh());
    const auto converted = convert_mesh(index, at_resolution(20));
    ASSERT_TRUE(converted) << converted.error().message();
    expect_exact(*converted, index.mesh(), [&](const Vec3& p) { return winding.at(p) > 0.5; });
  }
}

TEST_F(MeshConversionVdb, OverlappingBallsAreOneWithoutTheWallsInside) {
  // Two balls of 50 mm, 60 mm apart: a flood from outside meets neither lens nor walls within.
  const MeshSource ball = icosphere(4, 0.05);
  const TriangleIndex index = index_of(joined(ball, ball, Vec3(0.06, 0.0, 0.0)));
  ConversionSettings settings = at_resolution(48);
  settings.band_inside = infinity;
  const auto converted = convert_mesh(index, settings);
  ASSERT_TRUE(converted) << converted.error().message();
  const SparseSource source = converted->grid.source();
  const double voxel = source.voxel;
  const Vec3 middle(0.03, 0.0, 0.0);
  std::size_t shallow = 0;
  std::size_t deep = 0;
  for_each_node(source, [&](const SparseBlock& block, std::size_t at, const Vec3& p) {
    const double united = std::min(p.norm(), (p - Vec3(0.06, 0.0, 0.0)).norm()) - 0.05;
    const auto value = static_cast<double>(block.value[at]);
    if (std::abs(united) > 0.2 * voxel) {
      EXPECT_EQ(value < 0.0, united < 0.0) << p.transpose();
    }
    // In the lens, away from its rim, distances to its walls would be small, but those walls are none.
    if (united < -0.012 && std::abs(p.x() - 0.03) < 0.02 && Vec3(0.0, p.y(), p.z()).norm() < 0.02) {
      ++deep;
      if (value > -0.01) ++shallow;
    }
  });
  EXPECT_GT(deep, 500U);
  EXPECT_EQ(shallow, 0U);
}

TEST_F(MeshConversionVdb, ABallInABallIsSolid) {
  MeshSource inner = icosphere(3, 0.02);
  for (auto& t : inner.triangles) std::swap(t[1], t[2]);
  const TriangleIndex index = index_of(joined(icosphere(3, 0.05), inner));
  const auto converted = convert_mesh(index, at_resolution(40, InsideRule::flood));
  ASSERT_TRUE(converted) << converted.error().message();
  SparseHint hint;
  for (const double x : {0.0, 0.01, 0.0195, 0.0205, 0.03, 0.04})
    EXPECT_LT(converted->grid.trilinear(Vec3(x, 0.0, 0.0), hint).value, -2.9 * converted->report.voxel) << x;
  // The winding number knows that the hollow is none of it.
  const auto wound = convert_mesh(index, at_resolution(40, InsideRule::winding));
  ASSERT_TRUE(wound) << wound.error().message();
  EXPECT_GT(wound->grid.trilinear(Vec3(0.001, 0.0, 0.0), hint).value, 0.0);
  EXPECT_LT(wound->grid.trilinear(Vec3(0.035, 0.0, 0.0), hint).value, 0.0);
  EXPECT_GT(wound->grid.trilinear(Vec3(0.055, 0.0, 0.0), hint).value, 0.0);
}

TEST_F(MeshConversionVdb, MissingFacesAreBridgedByTheWindingNumber) {
  MeshSource source = icosphere(3, 0.05);
  // Six small holes far from each other: 6 of 1280 faces.
  for (const std::size_t f : {1200U, 1000U, 800U, 500U, 300U, 5U})
    source.triangles.erase(source.triangles.begin() + static_cast<std::ptrdiff_t>(f));
  source.corner_uvs.clear();
  const TriangleIndex index = index_of(std::move(source));
  ASSERT_EQ(index.mesh().report().boundary_edges, 18U);
  const auto converted = convert_mesh(index, at_resolution(40));
  ASSERT_TRUE(converted) << converted.error().message();
  EXPECT_EQ(converted->report.rule, InsideRule::winding);
  ASSERT_FALSE(converted->report.notes.empty());
  EXPECT_NE(converted->report.notes.front().find("18 edges with one face only"), std::string::npos)
      << converted->report.notes.front();
  std::size_t wrong = 0;
  std::size_t looked = 0;
  const SparseSource grid = converted->grid.source();
  for_each_node(grid, [&](const SparseBlock& block, std::size_t at, const Vec3& p) {
    if (++looked % 7 != 0) return;
    const double winding = brute_winding(index.mesh(), p);
    if (std::abs(winding - 0.5) > 0.01 && (block.value[at] < 0.0F) != (winding > 0.5)) ++wrong;
  });
  EXPECT_EQ(wrong, 0U);
}

TEST_F(MeshConversionVdb, AWideHoleIsClosedBySomethingToTouch) {
  // A ball without its cap above z = 30 mm: the rim is 40 mm wide, the band 9 mm.
  MeshSource source = icosphere(5, 0.05);
  std::erase_if(source.triangles, [&](const auto& t) {
    return std::max({source.positions[t[0]].z(), source.positions[t[1]].z(), source.positions[t[2]].z()}) > 0.03;
  });
  source.corner_uvs.clear();
  const TriangleIndex index = index_of(std::move(source));
  const auto converted = convert_mesh(index, at_resolution(32, InsideRule::winding));
  ASSERT_TRUE(converted) << converted.error().message();
  const SparseGrid& grid = converted->grid;
  const double voxel = grid.voxel();
  const WindingNumber winding(index.mesh());
  SparseHint hint;
  for (const Vec3& from : {Vec3(0.0, 0.0, 0.0), Vec3(0.012, -0.004, 0.0), Vec3(-0.02, 0.015, 0.0)}) {
    // Where the winding number passes 1/2 on the way out through the hole.
    double low = 0.0;
    double high = 0.06;
    for (int n = 0; n < 50; ++n) {
      const double middle = 0.5 * (low + high);
      (winding.at(from + Vec3(0.0, 0.0, middle)) > 0.5 ? low : high) = middle;
    }
    const Vec3 root = from + Vec3(0.0, 0.0, low);
    ASSERT_GT(root.z(), 0.02);
    EXPECT_NEAR(grid.trilinear(root, hint).value, 0.0, 0.25 * voxel) << from.transpose();
    // A distance: neither a jump nor a plateau, out and in.
    const Vec3 out = grid.trilinear(root, hint).gradient.normalized();
    EXPECT_GT(out.z(), 0.5);
    for (const double depth : {-2.0, -1.0, 1.0, 2.0})
      EXPECT_NEAR(grid.trilinear(root + depth * voxel * out, hint).value, depth * voxel, 0.4 * voxel) << depth;
  }
}

TEST_F(MeshConversionVdb, FacesTurnedRoundDoNotMatter) {
  MeshSource source = icosphere(3, 0.05);
  for (const std::size_t f : {1200U, 1000U, 999U, 500U, 300U, 5U})
    std::swap(source.triangles[f][1], source.triangles[f][2]);
  source.corner_uvs.clear();
  const TriangleIndex index = index_of(std::move(source));
  ASSERT_FALSE(index.mesh().report().oriented());
  const auto converted = convert_mesh(index, at_resolution(32));
  ASSERT_TRUE(converted) << converted.error().message();
  EXPECT_EQ(converted->report.rule, InsideRule::winding);
  const TriangleIndex whole = index_of(icosphere(3, 0.05));
  const WindingNumber winding(whole.mesh());
  expect_exact(
      *converted, index.mesh(), [&](const Vec3& p) { return winding.at(p) > 0.5; }, 9);
}

TEST_F(MeshConversionVdb, AnOpenSheetGetsAShell) {
  const TriangleIndex index = index_of(plane_grid(0.1, 0.06, 6, 5));
  ConversionSettings settings = at_resolution(50);
  const auto converted = convert_mesh(index, settings);
  ASSERT_TRUE(converted) << converted.error().message();
  EXPECT_EQ(converted->report.rule, InsideRule::shell);
  EXPECT_DOUBLE_EQ(converted->report.shell_thickness, 0.004);
  ASSERT_GE(converted->report.notes.size(), 2U);
  EXPECT_NE(converted->report.notes[0].find("22 edges with one face only"), std::string::npos)
      << converted->report.notes[0];
  EXPECT_NE(converted->report.notes[1].find("voxels thick"), std::string::npos) << converted->report.notes[1];
  // Touched from both sides half the thickness off, and rounded at the rim.
  SparseHint hint;
  for (const double x : {-0.03, 0.0, 0.0411}) {
    for (const double height : {-0.006, -0.0035, -0.002, -0.001, 0.001, 0.002, 0.0035, 0.006}) {
      // The kink in the middle is a trilinear interpolant's to round off.
      EXPECT_NEAR(converted->grid.trilinear(Vec3(x, 0.007, height), hint).value, std::abs(height) - 0.002, 1.01e-3);
      if (std::abs(height) >= 0.002) {
        EXPECT_NEAR(converted->grid.trilinear(Vec3(x, 0.007, height), hint).value, std::abs(height) - 0.002, 1e-8);
      }
    }
  }
  EXPECT_NEAR(converted->grid.trilinear(Vec3(0.053, 0.0, 0.0), hint).value, 0.001, 2e-4);
  settings.shell_thickness = 0.01;
  const auto thick = convert_mesh(index, settings);
  ASSERT_TRUE(thick) << thick.error().message();
  EXPECT_NEAR(thick->grid.trilinear(Vec3(0.0, 0.0, 0.004), hint).value, -0.001, 1e-8);
  EXPECT_NEAR(thick->grid.trilinear(Vec3(0.0, 0.0, -0.009), hint).value, 0.004, 1e-8);
  settings.shell_thickness = 0.003;
  const auto thin = convert_mesh(index, settings);
  ASSERT_FALSE(thin);
  EXPECT_EQ(thin.error().place, "shell_thickness");
}

TEST_F(MeshConversionVdb, FloodNeedsAnInside) {
  const TriangleIndex index = index_of(plane_grid(0.1, 0.06, 6, 5));
  for (const InsideRule rule : {InsideRule::flood, InsideRule::winding}) {
    const auto converted = convert_mesh(index, at_resolution(32, rule));
    ASSERT_FALSE(converted) << to_string(rule);
    EXPECT_EQ(converted.error().code, ErrorCode::bad_mesh);
    EXPECT_NE(converted.error().message().find("shell"), std::string::npos);
  }
}

TEST_F(MeshConversionVdb, ABudgetIsKeptAndUsed) {
  const TriangleIndex index = index_of(icosphere(4, 0.05));
  for (const std::size_t mebi : {1U, 4U}) {
    ConversionSettings settings;
    settings.budget_bytes = mebi << 20U;
    const auto converted = convert_mesh(index, settings);
    ASSERT_TRUE(converted) << converted.error().message();
    EXPECT_LE(converted->grid.memory_bytes(), settings.budget_bytes);
    EXPECT_GE(converted->grid.memory_bytes(), settings.budget_bytes * 7 / 10);
  }
  ConversionSettings settings;
  settings.budget_bytes = 20'000;
  const auto converted = convert_mesh(index, settings);
  ASSERT_FALSE(converted);
  EXPECT_EQ(converted.error().place, "budget");
}

TEST_F(MeshConversionVdb, TooMuchIsRefusedBeforeItIsMade) {
  const TriangleIndex index = index_of(icosphere(3, 0.05));
  ConversionSettings settings = at_resolution(4096);
  settings.most_bytes = std::size_t{64} << 20U;
  const auto converted = convert_mesh(index, settings);
  ASSERT_FALSE(converted);
  EXPECT_EQ(converted.error().code, ErrorCode::too_large);
}

TEST_F(MeshConversionVdb, K_9_MemoryGrowsWithTheSurfaceNotTheVolume) {
  const TriangleIndex index = index_of(icosphere(4, 0.05));
  double bytes[4] = {};
  for (const int n : {0, 1, 2, 3}) {
    const auto converted = convert_mesh(index, at_resolution(64U << n));
    ASSERT_TRUE(converted) << converted.error().message();
    bytes[n] = static_cast<double>(converted->grid.memory_bytes());
    std::printf("resolution %u: %.2f MiB, dense %.1f MiB\n", 64U << n, bytes[n] / 1048576.0,
                static_cast<double>(converted->grid.dense_bytes()) / 1048576.0);
  }
  for (const int n : {0, 1, 2}) {
    const double slope = std::log2(bytes[n + 1] / bytes[n]);
    std::printf("slope %.3f\n", slope);
    EXPECT_GT(slope, 1.8);
    EXPECT_LT(slope, 2.3);
  }
}

TEST_F(MeshConversionVdb, TheBunnyIsExact) {
  const std::filesystem::path path = std::filesystem::path(ASPERITY_SHARED_DATA) / "meshes" / "bunny-28k.obj";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  auto source = read_mesh(path);
  ASSERT_TRUE(source) << source.error().message();
  const TriangleIndex index = index_of(std::move(source).value());
  const auto converted = convert_mesh(index, at_resolution(96));
  ASSERT_TRUE(converted) << converted.error().message();
  const WindingNumber winding(index.mesh());
  const SparseSource grid = converted->grid.source();
  std::size_t wrong = 0;
  std::size_t points = 0;
  std::size_t n = 0;
  double worst = 0.0;
  for_each_node(grid, [&](const SparseBlock& block, std::size_t at, const Vec3& p) {
    const auto value = static_cast<double>(block.value[at]);
    if (!(value > grid.inside && value < grid.outside) || ++n % 7 != 0) return;
    ++points;
    if (std::abs(value) > 1e-3 * grid.voxel && (value < 0.0) != (winding.at(p) > 0.5)) ++wrong;
    worst = std::max(worst, std::abs(std::abs(value) - index.closest(p, infinity).distance));
  });
  EXPECT_GT(points, 10'000U);
  EXPECT_EQ(wrong, 0U);
  EXPECT_LT(worst, 1e-6 * grid.voxel);
}

}  // namespace
}  // namespace asperity::mesh_conversion_vdb_test
