#include "asperity/geometry/octree.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "tests/geometry/random_meshes.h"

namespace asperity::octree_test {
namespace {

ClosestHit brute_force_closest(const TriangleMesh& mesh, const Vec3& p, double bound) {
  ClosestHit best;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const auto [a, b, c] = mesh.corners(face);
    const TrianglePoint point = closest_point_on_triangle(p, a, b, c);
    if (point.squared_distance <= bound * bound && point.squared_distance < best.point.squared_distance) {
      best = {face, point};
    }
  }
  return best;
}

FirstHit brute_force_first_hit(const TriangleMesh& mesh, const Segment& segment) {
  FirstHit best;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const auto [a, b, c] = mesh.corners(face);
    double t = 1.0;
    if (!segment_triangle_intersection(segment, a, b, c, t)) continue;
    if (best.face == no_index || t < best.t) best = {face, t};
  }
  return best;
}

Box bounds_of(const TriangleMesh& mesh, std::uint32_t face) {
  Box bounds;
  for (const Vec3& corner : mesh.corners(face)) bounds.include(corner);
  return bounds;
}

/// A point where queries go wrong if they ever do: anywhere, on a vertex, on an edge, or far away.
Vec3 query_point(Rng& rng, const TriangleMesh& mesh) {
  const double size = mesh.bounds().diagonal();
  const auto face = rng.below(static_cast<std::uint32_t>(mesh.triangles().size()));
  const auto [a, b, c] = mesh.corners(face);
  switch (rng.below(5)) {
    case 0: return a;
    case 1: return 0.5 * (a + b);
    case 2: return (a + b + c) / 3.0 + test::random_point(rng, 1e-3 * size);
    case 3: return test::random_point(rng, 100.0 * size);
    default: return mesh.bounds().centre() + test::random_point(rng, size);
  }
}

TriangleMesh built(MeshSource source) {
  auto mesh = TriangleMesh::build(std::move(source));
  EXPECT_TRUE(mesh.ok()) << (mesh.ok() ? "" : mesh.error().message());
  return std::move(mesh).value();
}

void expect_equal_to_brute_force(const TriangleMesh& mesh, const TriangleOctree& octree, Rng& rng, int queries) {
  for (int i = 0; i < queries; ++i) {
    const Vec3 p = query_point(rng, mesh);
    const double bound = rng.below(2) == 0 ? infinity : rng.uniform(0.0, mesh.bounds().diagonal());
    const ClosestHit expected = brute_force_closest(mesh, p, bound);
    const ClosestHit found = octree.closest(p, bound);
    ASSERT_EQ(found.face == no_index, expected.face == no_index);
    ASSERT_EQ(found.point.squared_distance, expected.point.squared_distance);
    const Segment segment{p, query_point(rng, mesh)};
    const FirstHit expected_hit = brute_force_first_hit(mesh, segment);
    const FirstHit hit = octree.first_hit(segment);
    ASSERT_EQ(hit.face == no_index, expected_hit.face == no_index);
    ASSERT_EQ(hit.t, expected_hit.t);
  }
}

void expect_box_query_complete(const TriangleMesh& mesh, const TriangleOctree& octree, const Box& box) {
  std::set<std::uint32_t> found;
  octree.for_each_in_box(box, [&](std::uint32_t face) { found.insert(face); });
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const Box bounds = bounds_of(mesh, face);
    const bool meets =
        (bounds.lower.array() <= box.upper.array()).all() && (box.lower.array() <= bounds.upper.array()).all();
    ASSERT_EQ(found.count(face) == 1, meets) << "face " << face;
  }
}

class OctreeOnMeshKind : public testing::TestWithParam<int> {};

TEST_P(OctreeOnMeshKind, QueriesEqualBruteForce) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const TriangleMesh mesh = built(test::mesh_of_kind(GetParam(), seed));
    const TriangleOctree octree = TriangleOctree::build(mesh, {.max_triangles_per_leaf = 4, .max_depth = 12});
    Rng rng(seed);
    expect_equal_to_brute_force(mesh, octree, rng, 150);
    for (int i = 0; i < 40; ++i) {
      Box box;
      box.include(query_point(rng, mesh));
      expect_box_query_complete(mesh, octree, box.grown(std::pow(10.0, rng.uniform(-4.0, 0.0))));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(AllKinds, OctreeOnMeshKind, testing::Range(0, test::kinds_of_mesh));

RC_GTEST_PROP(Octree, AnswersDoNotDependOnItsSettings, ()) {
  const int kind = *rc::gen::inRange(0, test::kinds_of_mesh);
  const auto seed = *rc::gen::inRange<std::uint64_t>(0, 1000);
  OctreeSettings settings;
  settings.max_triangles_per_leaf = *rc::gen::inRange(0U, 40U);
  settings.max_depth = *rc::gen::inRange(-1, 25);
  const auto mesh = TriangleMesh::build(test::mesh_of_kind(kind, seed));
  RC_ASSERT(mesh.ok());
  const TriangleOctree octree = TriangleOctree::build(*mesh, settings);
  Rng rng(seed);
  const Vec3 p = query_point(rng, *mesh);
  const Segment segment{p, query_point(rng, *mesh)};
  RC_ASSERT(octree.closest(p, infinity).point.squared_distance ==
            brute_force_closest(*mesh, p, infinity).point.squared_distance);
  RC_ASSERT(octree.first_hit(segment).t == brute_force_first_hit(*mesh, segment).t);
  RC_ASSERT(static_cast<double>(octree.leaf_entries()) <=
            TriangleOctree::most_copies * static_cast<double>(mesh->triangles().size()));
}

TEST(Octree, EqualsBruteForceOnTheBunny) {
  const std::filesystem::path path = std::filesystem::path(ASPERITY_SHARED_DATA) / "meshes/bunny-28k.obj";
  std::ifstream file(path);
  if (!file) GTEST_SKIP() << "shared data absent: " << path;
  MeshSource source;  // a reader of its own: geometry does not know the module io
  std::string keyword;
  while (file >> keyword) {
    if (keyword == "v") {
      Vec3 position;
      file >> position.x() >> position.y() >> position.z();
      source.positions.push_back(position);
    } else if (keyword == "f") {
      std::array<std::string, 3> corners;
      file >> corners[0] >> corners[1] >> corners[2];
      auto& triangle = source.triangles.emplace_back();
      for (std::size_t i = 0; i < 3; ++i) triangle[i] = static_cast<std::uint32_t>(std::stoul(corners[i]) - 1);
    } else {
      file.ignore(10000, '\n');
    }
  }
  const TriangleMesh mesh = built(std::move(source));
  EXPECT_GT(mesh.triangles().size(), 28000U);
  const TriangleOctree octree = TriangleOctree::build(mesh);
  Rng rng(7);
  expect_equal_to_brute_force(mesh, octree, rng, 200);
}

TEST(Octree, BoundIsInclusiveAndRespected) {
  const TriangleMesh mesh = built(plane_grid(1.0, 1.0, 4, 4));
  const TriangleOctree octree = TriangleOctree::build(mesh);
  EXPECT_NE(octree.closest({0.1, 0.2, 0.25}, 0.25).face, no_index);
  EXPECT_EQ(octree.closest({0.1, 0.2, 0.25}, 0.2499999).face, no_index);
  EXPECT_NE(octree.closest({0.1, 0.2, 0.0}, 0.0).face, no_index);
  EXPECT_EQ(octree.closest({0.1, 0.2, 0.0}, -1.0).face, no_index);
}

TEST(Octree, NotANumberIsAnsweredWithNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const TriangleMesh mesh = built(icosphere(2, 1.0));
  const TriangleOctree octree = TriangleOctree::build(mesh);
  EXPECT_EQ(octree.closest({nan, 0.0, 0.0}, 1.0).face, no_index);
  EXPECT_EQ(octree.closest(Vec3::Zero(), nan).face, no_index);
  EXPECT_EQ(octree.first_hit({Vec3(nan, nan, nan), Vec3::Zero()}).face, no_index);
}

TEST(Octree, StacksOfLargeTrianglesStayBounded) {
  MeshSource source;  // every triangle spans every cell: splitting cannot help
  for (std::uint32_t i = 0; i < 500; ++i) {
    const double z = 1e-6 * i;
    source.positions.insert(source.positions.end(), {Vec3(-1.0, -1.0, z), Vec3(1.0, -1.0, z), Vec3(0.0, 1.0, z)});
    source.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const TriangleMesh mesh = built(std::move(source));
  const TriangleOctree octree = TriangleOctree::build(mesh);
  EXPECT_LE(octree.leaf_entries(), static_cast<std::size_t>(TriangleOctree::most_copies * 500.0));
  EXPECT_NEAR(octree.first_hit({Vec3(0.0, 0.0, 1.0), Vec3(0.0, 0.0, -1.0)}).t, 0.5 * (1.0 - 499e-6), 1e-12);
}

TEST(Octree, MemoryGrowsWithTheMesh) {
  const TriangleMesh mesh = built(icosphere(5, 1.0));
  const TriangleOctree octree = TriangleOctree::build(mesh);
  EXPECT_LT(octree.memory_bytes(), 60 * mesh.triangles().size());
  EXPECT_GE(octree.memory_bytes(), 4 * octree.leaf_entries());
}

// A line through a closed mesh crosses it, also exactly through vertices and edges (Plücker sides agree across edges).
RC_GTEST_PROP(SegmentTriangle, NoLineSlipsThroughAClosedMesh, ()) {
  static const TriangleMesh mesh = built(icosphere(1, 1.0));
  const auto face = *rc::gen::inRange<std::uint32_t>(0, 80);
  const int where = *rc::gen::inRange(0, 3);
  const auto [a, b, c] = mesh.corners(face);
  const double part = *rc::gen::inRange(0, 1001) / 1000.0;
  const Vec3 target = where == 0 ? a : where == 1 ? Vec3(a + part * (b - a)) : Vec3((a + b + c) / 3.0);
  const Vec3 direction(*rc::gen::inRange(-50, 51), *rc::gen::inRange(-50, 51), *rc::gen::inRange(-50, 51));
  // From the centre outwards through the target, and from a point inside, off the centre.
  const Vec3 inside = 0.005 * direction;
  RC_ASSERT(brute_force_first_hit(mesh, {Vec3::Zero(), 3.0 * target}).face != no_index);
  RC_ASSERT(brute_force_first_hit(mesh, {inside, inside + 5.0 * (target - inside)}).face != no_index);
}

// Two segments that join on the plane: one of them meets it, whatever the rounding at the joint.
RC_GTEST_PROP(SegmentTriangle, JoinedSegmentsDoNotLoseACrossing, ()) {
  const auto seed = *rc::gen::arbitrary<std::uint64_t>();
  Rng rng(seed);
  const Vec3 a(-10.0, -10.0, rng.uniform(-1.0, 1.0));
  const Vec3 b(10.0, -10.0, rng.uniform(-1.0, 1.0));
  const Vec3 c(0.0, 10.0, rng.uniform(-1.0, 1.0));
  const Vec3 joint = (a + b + c) / 3.0 + rng.uniform(-1.0, 1.0) * (b - a) / 10.0;
  const Vec3 above = joint + Vec3(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), 3.0);
  const Vec3 below = joint - Vec3(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), 3.0);
  double t = 0.0;
  const bool first = segment_triangle_intersection({above, joint}, a, b, c, t);
  const bool second = segment_triangle_intersection({joint, below}, a, b, c, t);
  RC_ASSERT(first || second);
}

RC_GTEST_PROP(SegmentTriangle, HitPointLiesOnTheTriangle, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const Vec3 a = test::random_point(rng, 1.0);
  const Vec3 b = test::random_point(rng, 1.0);
  const Vec3 c = test::random_point(rng, 1.0);
  // Aimed at the triangle, and about half of the time long enough to reach it.
  const double u = rng.uniform();
  const double v = rng.uniform(0.0, 1.0 - u);
  const Vec3 target = a + u * (b - a) + v * (c - a);
  const Vec3 from = test::random_point(rng, 1.0);
  const Segment segment{from, from + rng.uniform(0.0, 2.0) * (target - from)};
  const Vec3 direction = segment.to - segment.from;
  const double slope = std::abs((b - a).cross(c - a).normalized().dot(direction.normalized()));
  double t = -1.0;
  const bool meets = segment_triangle_intersection(segment, a, b, c, t);
  double reversed = -1.0;
  RC_ASSERT(segment_triangle_intersection(segment, a, c, b, reversed) == meets);
  if (!meets || slope < 1e-3) return;
  RC_ASSERT(t >= 0.0 && t <= 1.0);
  RC_ASSERT(closest_point_on_triangle(segment.from + t * direction, a, b, c).squared_distance < 1e-20);
  RC_ASSERT(std::abs(reversed - t) < 1e-10);
}

TEST(SegmentTriangle, MissesBesideBeforeAndBehind) {
  const Vec3 a(0.0, 0.0, 0.0);
  const Vec3 b(1.0, 0.0, 0.0);
  const Vec3 c(0.0, 1.0, 0.0);
  const auto meets = [&](const Vec3& from, const Vec3& to) {
    double t = 0.0;
    return segment_triangle_intersection({from, to}, a, b, c, t);
  };
  EXPECT_TRUE(meets({0.2, 0.2, 1.0}, {0.2, 0.2, -1.0}));
  EXPECT_TRUE(meets({0.2, 0.2, -1.0}, {0.2, 0.2, 1.0}));
  EXPECT_TRUE(meets({0.2, 0.2, 1.0}, {0.2, 0.2, 0.0}));   // ends on it
  EXPECT_TRUE(meets({0.2, 0.2, 0.0}, {0.2, 0.2, -1.0}));  // starts on it
  EXPECT_TRUE(meets({0.5, 0.5, 1.0}, {0.5, 0.5, -1.0}));  // through an edge
  EXPECT_TRUE(meets({1.0, 0.0, 1.0}, {1.0, 0.0, -1.0}));  // through a corner
  EXPECT_FALSE(meets({0.6, 0.6, 1.0}, {0.6, 0.6, -1.0}));
  EXPECT_FALSE(meets({0.2, 0.2, 1.0}, {0.2, 0.2, 1e-9}));
  EXPECT_FALSE(meets({0.2, 0.2, -1e-9}, {0.2, 0.2, -1.0}));
  EXPECT_FALSE(meets({-1.0, 0.2, 0.0}, {1.0, 0.2, 0.0}));  // in its plane
  EXPECT_FALSE(meets({0.2, 0.2, 1.0}, {0.2, 0.2, 1.0}));
}

}  // namespace
}  // namespace asperity::octree_test
