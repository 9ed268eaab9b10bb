#include "asperity/geometry/mesh.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <numbers>
#include <set>

#include "tests/geometry/random_meshes.h"

namespace asperity::mesh_test {
namespace {

TriangleMesh built(MeshSource source, const MeshBuildSettings& settings = {}) {
  auto mesh = TriangleMesh::build(std::move(source), settings);
  EXPECT_TRUE(mesh.ok()) << (mesh.ok() ? "" : mesh.error().message());
  return std::move(mesh).value();
}

MeshSource tetrahedron() {
  MeshSource source;
  source.positions = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
  source.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return source;
}

using EdgeKey = std::pair<std::uint32_t, std::uint32_t>;

/// Triangles at each edge, the slow and obvious way.
std::map<EdgeKey, std::vector<std::uint32_t>> faces_of_edges(const TriangleMesh& mesh) {
  std::map<EdgeKey, std::vector<std::uint32_t>> edges;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const auto& t = mesh.triangles()[face];
    for (std::size_t i = 0; i < 3; ++i) edges[std::minmax(t[i], t[(i + 1) % 3])].push_back(face);
  }
  return edges;
}

TEST(TriangleMesh, TetrahedronReport) {
  const TriangleMesh mesh = built(tetrahedron());
  const MeshReport& report = mesh.report();
  EXPECT_EQ(report.vertices, 4U);
  EXPECT_EQ(report.triangles, 4U);
  EXPECT_TRUE(report.closed());
  EXPECT_TRUE(report.oriented());
  EXPECT_EQ(report.nonmanifold_vertices, 0U);
  EXPECT_EQ(report.components, 1U);
  EXPECT_NEAR(report.signed_volume, 1.0 / 6.0, 1e-15);
  EXPECT_NEAR(report.area, 1.5 + std::sqrt(3.0) / 2.0, 1e-15);
  EXPECT_NEAR(report.mean_edge, (3.0 + 3.0 * std::numbers::sqrt2) / 6.0, 1e-15);
  EXPECT_EQ(report.min_edge, 1.0);
  EXPECT_NEAR(report.max_edge, std::numbers::sqrt2, 1e-15);
  EXPECT_NEAR(report.worst_aspect, 2.0, 1e-15);  // right isosceles: sqrt(2) over its height 1/sqrt(2)
  EXPECT_EQ(mesh.bounds().upper, Vec3(1.0, 1.0, 1.0));
  EXPECT_TRUE(mesh.notes().empty());
}

TEST(TriangleMesh, NegativeZeroWeldsWithZero) {
  MeshSource source = tetrahedron();
  source.positions.emplace_back(-0.0, 0.0, -0.0);
  source.triangles[0][0] = 4;
  const TriangleMesh mesh = built(std::move(source));
  EXPECT_EQ(mesh.report().vertices, 4U);
  EXPECT_EQ(mesh.report().welded_vertices, 1U);
  EXPECT_TRUE(mesh.report().closed());
}

TEST(TriangleMesh, ScaleMultipliesLengthsAreaAndVolume) {
  const TriangleMesh metres = built(tetrahedron());
  const TriangleMesh millimetres = built(tetrahedron(), {.scale = 1e-3});
  EXPECT_NEAR(millimetres.mean_edge(), 1e-3 * metres.mean_edge(), 1e-18);
  EXPECT_NEAR(millimetres.report().area, 1e-6 * metres.report().area, 1e-20);
  EXPECT_NEAR(millimetres.report().signed_volume, 1e-9 * metres.report().signed_volume, 1e-24);
  EXPECT_EQ(millimetres.report().worst_aspect, metres.report().worst_aspect);
}

TEST(TriangleMesh, DropsDegenerateAndDuplicateTrianglesAndKeepsUvsAligned) {
  MeshSource source = tetrahedron();
  source.positions.emplace_back(0.5, 0.0, 0.0);  // 4: in line with 0 and 1
  source.positions.emplace_back(9.0, 9.0, 9.0);  // 5: unused
  source.triangles = {{0, 2, 1}, {0, 0, 1}, {0, 1, 4}, {1, 0, 2}, {2, 0, 1}, {0, 1, 3}};
  for (std::size_t i = 0; i < source.triangles.size(); ++i) {
    const auto base = static_cast<float>(10 * i);
    source.corner_uvs.push_back({Vec2f(base, 0.0F), Vec2f(base + 1.0F, 0.0F), Vec2f(base + 2.0F, 0.0F)});
  }
  const TriangleMesh mesh = built(std::move(source));
  EXPECT_EQ(mesh.report().dropped_degenerate, 2U);
  EXPECT_EQ(mesh.report().dropped_duplicate, 2U);  // one turned, one turned over
  ASSERT_EQ(mesh.triangles().size(), 2U);
  EXPECT_EQ(mesh.report().vertices, 4U);
  EXPECT_EQ(mesh.uvs(0)[1], Vec2f(1.0F, 0.0F));
  EXPECT_EQ(mesh.uvs(1)[2], Vec2f(52.0F, 0.0F));
  EXPECT_EQ(mesh.corners(0)[1], Vec3(0.0, 1.0, 0.0));  // the first of the duplicates is the one that stays
  EXPECT_EQ(mesh.notes().size(), 3U);
}

TEST(TriangleMesh, FlipsInwardMeshTogetherWithItsUvs) {
  MeshSource inward = box_mesh({1.0, 2.0, 3.0});
  const MeshSource outward = inward;
  for (auto& t : inward.triangles) std::swap(t[1], t[2]);
  for (auto& uvs : inward.corner_uvs) std::swap(uvs[1], uvs[2]);
  const TriangleMesh mesh = built(inward);
  EXPECT_NEAR(mesh.report().signed_volume, 6.0, 1e-14);
  for (std::uint32_t face = 0; face < 12; ++face) {
    EXPECT_GT(mesh.face_normal(face).dot(mesh.corners(face)[0]), 0.0);
    EXPECT_EQ(mesh.uvs(face), outward.corner_uvs[face]);
  }
  const TriangleMesh kept = built(inward, {.orient_outward = false});
  EXPECT_NEAR(kept.report().signed_volume, -6.0, 1e-14);
}

TEST(TriangleMesh, ReportsWhatIsWrongWithTheTopology) {
  MeshSource fan = tetrahedron();  // three triangles on the edge 0-1
  fan.triangles = {{0, 1, 2}, {1, 0, 3}};
  fan.positions.emplace_back(0.0, -1.0, 0.0);
  fan.triangles.push_back({0, 1, 4});
  EXPECT_EQ(built(fan).report().nonmanifold_edges, 1U);
  EXPECT_EQ(built(fan).report().boundary_edges, 6U);
  EXPECT_FALSE(built(fan).report().oriented());

  MeshSource turned = tetrahedron();
  std::swap(turned.triangles[3][0], turned.triangles[3][1]);
  EXPECT_EQ(built(turned).report().misoriented_edges, 3U);
  EXPECT_TRUE(built(turned).report().closed());

  MeshSource hourglass = tetrahedron();  // two tetrahedra that share one vertex
  for (int i = 1; i < 4; ++i) hourglass.positions.push_back(-hourglass.positions[static_cast<std::size_t>(i)]);
  for (const auto& t : tetrahedron().triangles) {
    const auto mirrored = [](std::uint32_t v) { return v == 0 ? 0 : v + 3; };
    hourglass.triangles.push_back({mirrored(t[0]), mirrored(t[2]), mirrored(t[1])});
  }
  const MeshReport report = built(hourglass).report();
  EXPECT_EQ(report.nonmanifold_vertices, 1U);
  EXPECT_EQ(report.components, 1U);
  EXPECT_TRUE(report.closed());

  MeshSource apart = tetrahedron();
  for (const Vec3& position : tetrahedron().positions) apart.positions.push_back(position + Vec3(5.0, 0.0, 0.0));
  for (const auto& t : tetrahedron().triangles) apart.triangles.push_back({t[0] + 4, t[1] + 4, t[2] + 4});
  EXPECT_EQ(built(apart).report().components, 2U);
}

TEST(TriangleMesh, VertexNormalsAreWeightedByAngle) {
  // At a cube's corner every side takes a right angle, however its diagonals run: the normal is the space diagonal.
  const TriangleMesh mesh = built(box_mesh({2.0, 2.0, 2.0}));
  for (std::uint32_t vertex = 0; vertex < 8; ++vertex) {
    EXPECT_LT((mesh.vertex_normal(vertex) - mesh.positions()[vertex].normalized()).norm(), 1e-6);
  }
}

TEST(TriangleMesh, EveryBadInputIsNamed) {
  const auto error_of = [](MeshSource source, MeshBuildSettings settings = {}) {
    auto mesh = TriangleMesh::build(std::move(source), settings);
    EXPECT_FALSE(mesh.ok());
    return mesh.ok() ? Error{} : mesh.error();
  };
  MeshSource source = tetrahedron();
  source.positions[2].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(error_of(source).code, ErrorCode::bad_mesh);
  EXPECT_EQ(error_of(source).place, "vertex 2 (counted from 0)");
  source = tetrahedron();
  source.positions[1].x() = 1e200;
  EXPECT_EQ(error_of(source).place, "vertex 1 (counted from 0)");
  source = tetrahedron();
  source.triangles[3][1] = 4;
  EXPECT_EQ(error_of(source).place, "triangle 3 (counted from 0)");
  source = tetrahedron();
  source.triangles.clear();
  EXPECT_EQ(error_of(source).code, ErrorCode::bad_mesh);
  source = tetrahedron();
  source.triangles = {{0, 0, 1}, {2, 3, 3}};
  EXPECT_NE(error_of(source).what.find("none of its 2"), std::string::npos);
  source = tetrahedron();
  source.corner_uvs.resize(3);
  EXPECT_EQ(error_of(source).code, ErrorCode::bad_mesh);
  source.corner_uvs.assign(4, {Vec2f(0.0F, 0.0F), Vec2f(1.0F, 0.0F), Vec2f(0.0F, std::nanf(""))});
  EXPECT_EQ(error_of(source).place, "triangle 0 (counted from 0)");
  EXPECT_EQ(error_of(MeshSource{}).code, ErrorCode::bad_mesh);
  for (const double scale : {0.0, -1.0, infinity, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(error_of(tetrahedron(), {.scale = scale}).code, ErrorCode::bad_value);
  }
  EXPECT_EQ(error_of(tetrahedron(), {.scale = 1e-80}).code, ErrorCode::bad_mesh);
}

TEST(TriangleMesh, SeamInUvsDoesNotBreakAdjacency) {
  const TriangleMesh mesh = built(icosphere(2, 1.0));  // every face has UVs of its own
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    for (int edge = 0; edge < 3; ++edge) EXPECT_NE(mesh.neighbour(face, edge), no_index);
  }
}

TEST(TriangleMesh, UnweldedMeshEqualsWelded) {
  const MeshSource source = random_closed_mesh(5, 3, 1.0, 0.4);
  const TriangleMesh welded = built(source);
  const TriangleMesh from_soup = built(test::unwelded(source));
  EXPECT_EQ(from_soup.report().vertices, welded.report().vertices);
  EXPECT_TRUE(from_soup.report().closed());
  EXPECT_NEAR(from_soup.report().signed_volume, welded.report().signed_volume, 1e-12);
}

RC_GTEST_PROP(TriangleMesh, AdjacencyAndReportEqualTheSlowWay, ()) {
  const int kind = *rc::gen::inRange(0, test::kinds_of_mesh);
  const auto seed = *rc::gen::inRange<std::uint64_t>(0, 1000);
  const auto result = TriangleMesh::build(test::mesh_of_kind(kind, seed));
  RC_ASSERT(result.ok());
  const TriangleMesh& mesh = *result;
  std::size_t boundary = 0;
  std::size_t nonmanifold = 0;
  const auto edges = faces_of_edges(mesh);
  for (const auto& [edge, faces] : edges) {
    boundary += faces.size() == 1 ? 1U : 0U;
    nonmanifold += faces.size() > 2 ? 1U : 0U;
  }
  RC_ASSERT(mesh.report().boundary_edges == boundary);
  RC_ASSERT(mesh.report().nonmanifold_edges == nonmanifold);
  std::vector<std::vector<std::uint32_t>> at_vertex(mesh.positions().size());
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const auto& t = mesh.triangles()[face];
    for (std::size_t i = 0; i < 3; ++i) {
      at_vertex[t[i]].push_back(face);
      const auto& faces = edges.at(std::minmax(t[i], t[(i + 1) % 3]));
      const std::uint32_t other = faces.size() != 2 ? no_index : faces[0] == face ? faces[1] : faces[0];
      RC_ASSERT(mesh.neighbour(face, static_cast<int>(i)) == other);
    }
  }
  for (std::uint32_t vertex = 0; vertex < at_vertex.size(); ++vertex) {
    const auto listed = mesh.faces_of_vertex(vertex);
    RC_ASSERT(std::vector<std::uint32_t>(listed.begin(), listed.end()) == at_vertex[vertex]);
    RC_ASSERT(std::abs(mesh.vertex_normal(vertex).norm() - 1.0) < 1e-6);
  }
}

RC_GTEST_PROP(TriangleMesh, AdjoiningFacesAreVisitedOnce, ()) {
  const int kind = *rc::gen::inRange(0, test::kinds_of_mesh);
  const auto result = TriangleMesh::build(test::mesh_of_kind(kind, *rc::gen::inRange<std::uint64_t>(0, 100)));
  RC_ASSERT(result.ok());
  const auto face = *rc::gen::inRange<std::uint32_t>(0, static_cast<std::uint32_t>(result->triangles().size()));
  std::vector<std::uint32_t> visited;
  for_each_adjoining_face(*result, face, [&](std::uint32_t other) { visited.push_back(other); });
  std::set<std::uint32_t> expected;
  for (const std::uint32_t corner : result->triangles()[face]) {
    for (const std::uint32_t other : result->faces_of_vertex(corner)) expected.insert(other);
  }
  std::sort(visited.begin(), visited.end());
  RC_ASSERT(visited == std::vector<std::uint32_t>(expected.begin(), expected.end()));
}

RC_GTEST_PROP(TriangleMesh, DropsWhatASetOfCornersSaysIsThereAlready, (std::uint64_t seed)) {
  Rng rng(seed);
  MeshSource source;
  // Few vertices: most triangles repeat another, many of them around one vertex.
  const std::uint32_t vertices = 3 + rng.below(12);
  for (std::uint32_t i = 0; i < vertices; ++i)
    source.positions.emplace_back(rng.uniform(0.0, 1.0), rng.uniform(0.0, 1.0), rng.uniform(0.0, 1.0));
  const std::uint32_t triangles = 1 + rng.below(300);
  for (std::uint32_t i = 0; i < triangles; ++i)
    source.triangles.push_back({rng.below(vertices), rng.below(vertices), rng.below(vertices)});
  std::set<std::array<std::uint32_t, 3>> there;
  std::vector<TriangleMesh::Triangle> expected;
  for (const TriangleMesh::Triangle& triangle : source.triangles) {
    TriangleMesh::Triangle key = triangle;
    std::sort(key.begin(), key.end());
    if (key[0] != key[1] && key[1] != key[2] && there.insert(key).second) expected.push_back(triangle);
  }
  RC_PRE(!expected.empty());
  const MeshSource before = source;
  const auto mesh = TriangleMesh::build(std::move(source), {.orient_outward = false});
  RC_ASSERT(mesh.ok());
  RC_ASSERT(mesh->triangles().size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      RC_ASSERT(mesh->positions()[mesh->triangles()[i][k]] == before.positions[expected[i][k]]);
  }
}

RC_GTEST_PROP(TriangleMesh, KeepsEveryCornersUvsToTheBit, (std::uint64_t seed)) {
  Rng rng(seed);
  const TriangleMesh plain = built(test::mesh_of_kind(static_cast<int>(rng.below(test::kinds_of_mesh)), seed % 100));
  MeshSource source;
  source.positions.assign(plain.positions().begin(), plain.positions().end());
  source.triangles.assign(plain.triangles().begin(), plain.triangles().end());
  const auto any = [&] {
    const auto one = [&] { return rng.below(8) == 0 ? -0.0F : static_cast<float>(rng.uniform(-2.0, 2.0)); };
    return Vec2f(one(), one());
  };
  std::vector<Vec2f> of_vertex;
  for (std::size_t i = 0; i < source.positions.size(); ++i) of_vertex.push_back(any());
  // One a vertex, with seams of their own, or of a few for all; all of a few; none like another.
  const std::uint32_t kind = rng.below(5);
  std::vector<std::array<Vec2f, 3>> few(1 + rng.below(400));
  for (auto& corners : few) corners = {any(), any(), any()};
  for (const TriangleMesh::Triangle& t : source.triangles) {
    const std::uint32_t number = rng.below(static_cast<std::uint32_t>(few.size()));
    const bool seam = kind > 0 && rng.below(kind > 2 ? 1 : 6) == 0;
    auto& corners = source.corner_uvs.emplace_back();
    if (!seam) corners = {of_vertex[t[0]], of_vertex[t[1]], of_vertex[t[2]]};
    if (seam) corners = kind % 2 == 0 ? few[number] : std::array<Vec2f, 3>{any(), any(), any()};
  }
  const std::vector<std::array<Vec2f, 3>> given = source.corner_uvs;
  const auto mesh = TriangleMesh::build(std::move(source), {.orient_outward = false});
  RC_ASSERT(mesh.ok() && mesh->triangles().size() == given.size());
  for (std::uint32_t face = 0; face < given.size(); ++face) {
    const std::array<Vec2f, 3> kept = mesh->uvs(face);
    RC_ASSERT(std::memcmp(kept.data(), given[face].data(), sizeof(kept)) == 0);
  }
}

TEST(TriangleMesh, MemoryStaysSmall) {
  MeshSource source = icosphere(5, 1.0);
  MeshSource without = source;
  without.corner_uvs.clear();
  const TriangleMesh bare = built(std::move(without));
  const auto triangles = static_cast<double>(bare.triangles().size());
  EXPECT_LT(static_cast<double>(bare.memory_bytes()), 46.0 * triangles);
  // Every triangle wears the whole map: one set of corners for all.
  EXPECT_LT(static_cast<double>(built(source).memory_bytes()), 47.0 * triangles);
  // One a vertex.
  for (std::size_t face = 0; face < source.triangles.size(); ++face) {
    for (std::size_t k = 0; k < 3; ++k)
      source.corner_uvs[face][k] = source.positions[source.triangles[face][k]].head<2>().cast<float>();
  }
  EXPECT_LT(static_cast<double>(built(source).memory_bytes()), 49.0 * triangles);
  // None like another.
  Rng rng(1);
  for (auto& corners : source.corner_uvs) {
    for (Vec2f& uv : corners) uv = {static_cast<float>(rng.uniform()), static_cast<float>(rng.uniform())};
  }
  EXPECT_LT(static_cast<double>(built(source).memory_bytes()), 69.0 * triangles);
}

TEST(MeshFingerprint, TellsMeshesApartByWhatTheyWereBuiltFrom) {
  const auto built = [](MeshSource source) { return TriangleMesh::build(std::move(source)).value(); };
  const TriangleMesh mesh = built(plane_grid(0.04, 0.04, 4, 4));
  EXPECT_EQ(TriangleMesh(mesh).fingerprint(), mesh.fingerprint());
  EXPECT_EQ(built(plane_grid(0.04, 0.04, 4, 4)).fingerprint(), mesh.fingerprint());
  std::vector<Vec3> positions(mesh.positions().begin(), mesh.positions().end());
  for (Vec3& p : positions) p.z() += 0.001 * p.x();
  EXPECT_EQ(mesh.moved(positions).value().fingerprint(), mesh.fingerprint());

  std::vector<MeshSource> others{plane_grid(0.04, 0.04, 5, 4), plane_grid(0.05, 0.04, 4, 4), icosphere(1, 0.02)};
  others.push_back(plane_grid(0.04, 0.04, 4, 4));
  others.back().corner_uvs.clear();
  others.push_back(plane_grid(0.04, 0.04, 4, 4));
  others.back().corner_uvs[3][1].x() += 1e-3F;
  others.push_back(plane_grid(0.04, 0.04, 4, 4));
  others.back().positions[7].z() += 1e-9;
  others.push_back(plane_grid(0.04, 0.04, 4, 4));
  std::swap(others.back().triangles[2], others.back().triangles[9]);
  for (std::size_t i = 0; i < others.size(); ++i) EXPECT_NE(built(others[i]).fingerprint(), mesh.fingerprint()) << i;
}

}  // namespace
}  // namespace asperity::mesh_test
