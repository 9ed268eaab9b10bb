// Meshes whose vertices move: the refitted index against brute force, and against an index built anew.

#include <gtest/gtest.h>

#include <rapidcheck/gtest.h>
#include <cmath>
#include <span>

#include "asperity/core/rng.h"
#include "asperity/geometry/generators.h"
#include "asperity/geometry/mesh_refitter.h"
#include "tests/geometry/random_meshes.h"

namespace asperity::refit_test {
namespace {

using Positions = std::vector<Vec3>;

Positions positions_of(const TriangleMesh& mesh) {
  return {mesh.positions().begin(), mesh.positions().end()};
}

Vec3 random_vector(Rng& rng, double size) {
  return {rng.uniform(-size, size), rng.uniform(-size, size), rng.uniform(-size, size)};
}

/// A wave, a stretch, a turn and a shift: neighbours stay neighbours.
Positions bent(const TriangleMesh& mesh, Rng& rng) {
  const double size = mesh.bounds().diagonal();
  const Vec3 along = random_vector(rng, 6.0 / size);
  const Vec3 by = random_vector(rng, 0.15 * size);
  const Vec3 stretch(rng.uniform(0.5, 2.0), rng.uniform(0.5, 2.0), rng.uniform(0.5, 2.0));
  const Mat3 turn = Eigen::AngleAxisd(rng.uniform(0.0, 6.0), random_vector(rng, 1.0).normalized()).toRotationMatrix();
  const Vec3 shift = random_vector(rng, 3.0 * size);
  Positions moved;
  for (const Vec3& p : mesh.positions())
    moved.push_back(turn * (p.cwiseProduct(stretch) + std::sin(along.dot(p)) * by) + shift);
  return moved;
}

/// Every vertex anywhere: nothing of the built tree fits any more.
Positions scattered(const TriangleMesh& mesh, Rng& rng) {
  Positions moved;
  for (std::size_t i = 0; i < mesh.positions().size(); ++i) moved.push_back(random_vector(rng, 0.5));
  return moved;
}

/// What a mesh built from these positions would be, vertex by vertex; in none of these tests does one get lost.
MeshSource source_of(const TriangleMesh& mesh) {
  MeshSource source;
  source.positions = positions_of(mesh);
  source.triangles.assign(mesh.triangles().begin(), mesh.triangles().end());
  return source;
}

double brute_squared_distance(const TriangleMesh& mesh, const Vec3& p) {
  double best = infinity;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const auto [a, b, c] = mesh.corners(face);
    best = std::min(best, closest_point_on_triangle(p, a, b, c).squared_distance);
  }
  return best;
}

double brute_first_hit(const TriangleMesh& mesh, const Segment& segment) {
  double first = infinity;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const auto [a, b, c] = mesh.corners(face);
    double t = 0.0;
    if (segment_triangle_intersection(segment, a, b, c, t)) first = std::min(first, t);
  }
  return first;
}

Vec3 random_point(Rng& rng, const Box& box) {
  return box.lower + Vec3(rng.uniform(), rng.uniform(), rng.uniform()).cwiseProduct(box.extent());
}

void expect_brute_force(const TriangleIndex& index, Rng& rng, int count) {
  const TriangleMesh& mesh = index.mesh();
  const Box around = mesh.bounds().grown(0.1 * mesh.bounds().diagonal());
  TrianglePatch patch;
  Vec3 near = random_point(rng, around);
  for (int i = 0; i < count; ++i) {
    const Vec3 p = random_point(rng, around);
    ASSERT_EQ(index.closest(p, infinity).distance, std::sqrt(brute_squared_distance(mesh, p)));
    near += random_vector(rng, 0.01 * mesh.bounds().diagonal());
    ASSERT_EQ(index.closest(near, infinity, patch).distance, std::sqrt(brute_squared_distance(mesh, near)));
    const Segment segment{p, random_point(rng, around)};
    const FirstHit hit = index.first_hit(segment);
    const double first = brute_first_hit(mesh, segment);
    ASSERT_EQ(hit.face == no_index, std::isinf(first));
    ASSERT_TRUE(hit.face == no_index || hit.t == first);
    Box box;
    box.include(p);
    box.include(p + random_vector(rng, 0.2 * mesh.bounds().diagonal()));
    std::vector<int> found(mesh.triangles().size(), 0);
    index.for_each_in_box(box, [&](std::uint32_t face) { found[face] = 1; });
    for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
      Box own;
      for (const Vec3& corner : mesh.corners(face)) own.include(corner);
      const bool meets =
          (own.lower.array() <= box.upper.array()).all() && (box.lower.array() <= own.upper.array()).all();
      ASSERT_TRUE(!meets || found[face] == 1) << "face " << face;
    }
  }
}

std::vector<TriangleMesh> meshes() {
  std::vector<TriangleMesh> all;
  for (int kind = 0; kind < test::kinds_of_mesh; ++kind) {
    auto mesh = TriangleMesh::build(test::mesh_of_kind(kind, 1 + static_cast<std::uint64_t>(kind)));
    if (mesh) all.push_back(std::move(mesh).value());
  }
  return all;
}

TEST(Refit, QueriesEqualBruteForceOnEveryKindOfMeshHoweverItIsMoved) {
  Rng rng(1);
  for (const TriangleMesh& mesh : meshes()) {
    for (const SearchStructure structure : {SearchStructure::bvh, SearchStructure::octree}) {
      MeshRefitter refitter(TriangleIndex::build(mesh, structure));
      int moved_often = 0;
      for (int i = 0; i < 6; ++i) {
        auto moved = refitter.moved(i % 2 == 0 ? bent(mesh, rng) : scattered(mesh, rng));
        if (!moved) continue;
        ++moved_often;
        expect_brute_force(*moved, rng, 12);
        if (HasFatalFailure()) return;
      }
      EXPECT_GE(moved_often, 4);
    }
  }
}

TEST(Refit, PlainKernelsAnswerTheSame) {
  Rng rng(2);
  const TriangleMesh mesh = TriangleMesh::build(random_closed_mesh(4, 3, 0.05, 0.4)).value();
  MeshRefitter refitter(TriangleIndex::build(mesh, SearchStructure::bvh, {true}));
  for (int i = 0; i < 3; ++i) expect_brute_force(refitter.moved(bent(mesh, rng)).value(), rng, 20);
}

TEST(Refit, FarFromTheOriginLeavesKeepTheirDigits) {
  Rng rng(3);
  const TriangleMesh mesh = TriangleMesh::build(icosphere(3, 0.05)).value();
  MeshRefitter refitter(TriangleIndex::build(mesh));
  Positions far = positions_of(mesh);
  for (Vec3& p : far) p += Vec3(1e5, -3e4, 7e5);
  expect_brute_force(refitter.moved(far).value(), rng, 30);
}

RC_GTEST_PROP(Refit, AMovedMeshIsTheMeshBuiltFromItsPositions, (std::uint64_t seed)) {
  Rng rng(seed);
  const int kind = static_cast<int>(seed % 3U);
  const auto rest = TriangleMesh::build(test::mesh_of_kind(kind, seed % 100U));
  RC_PRE(rest.ok());
  const auto moved = rest->moved(bent(*rest, rng));
  RC_ASSERT(moved.ok());
  const auto built = TriangleMesh::build(source_of(*moved), {1.0, false});
  RC_PRE(built.ok() && built->positions().size() == moved->positions().size());
  // Vertices of a source are numbered by first use, which triangles of a built mesh need not follow.
  for (std::uint32_t face = 0; face < moved->triangles().size(); ++face) {
    RC_ASSERT(moved->corners(face) == built->corners(face));
    for (std::size_t k = 0; k < 3; ++k) {
      RC_ASSERT(moved->vertex_normal(moved->triangles()[face][k]) == built->vertex_normal(built->triangles()[face][k]));
    }
  }
  const MeshReport& one = moved->report();
  const MeshReport& other = built->report();
  const auto near = [](double a, double b) { return std::abs(a - b) <= 1e-12 * (std::abs(a) + std::abs(b)); };
  RC_ASSERT(near(one.mean_edge, other.mean_edge));
  RC_ASSERT(one.min_edge == other.min_edge);
  RC_ASSERT(one.max_edge == other.max_edge);
  RC_ASSERT(near(one.area, other.area));
  RC_ASSERT(std::abs(one.signed_volume - other.signed_volume) <= 1e-12 * one.area * moved->bounds().diagonal());
  RC_ASSERT(near(one.worst_aspect, other.worst_aspect));
  RC_ASSERT(one.closed() == other.closed());
  RC_ASSERT(moved->bounds().lower == built->bounds().lower);
  RC_ASSERT(moved->bounds().upper == built->bounds().upper);
}

/// By the textbook: std::atan2 at every corner.
Vec3 normal_by_angles(const TriangleMesh& mesh, std::uint32_t vertex) {
  Vec3 sum = Vec3::Zero();
  for (const std::uint32_t face : mesh.faces_of_vertex(vertex)) {
    const TriangleMesh::Triangle& t = mesh.triangles()[face];
    std::size_t k = 0;
    while (t[k] != vertex) ++k;
    const Vec3 one = mesh.positions()[t[(k + 1) % 3]] - mesh.positions()[vertex];
    const Vec3 other = mesh.positions()[t[(k + 2) % 3]] - mesh.positions()[vertex];
    sum += std::atan2(one.cross(other).norm(), one.dot(other)) * one.cross(other).normalized();
  }
  return sum.normalized();
}

TEST(Refit, VertexNormalsAreWeightedByAngles) {
  Rng rng(5);
  for (const int kind : {0, 1, 2, 6, 7}) {
    const TriangleMesh rest = TriangleMesh::build(test::mesh_of_kind(kind, 3)).value();
    const TriangleMesh mesh = rest.moved(bent(rest, rng)).value();
    for (std::uint32_t vertex = 0; vertex < mesh.positions().size(); ++vertex)
      ASSERT_LE((mesh.vertex_normal(vertex) - normal_by_angles(mesh, vertex)).norm(), 2e-7) << "kind " << kind;
  }
}

TEST(Refit, MeanEdgeAndVolumeOfKnownShapes) {
  const TriangleMesh rest = TriangleMesh::build(box_mesh(Vec3(0.1, 0.1, 0.1))).value();
  Positions twice = positions_of(rest);
  for (Vec3& p : twice) p *= 2.0;
  const TriangleMesh mesh = rest.moved(twice).value();
  EXPECT_NEAR(mesh.report().signed_volume, 0.008, 1e-15);
  EXPECT_NEAR(mesh.report().area, 0.24, 1e-14);
  EXPECT_NEAR(mesh.mean_edge(), 2.0 * rest.mean_edge(), 1e-15);
  // Open: a boundary edge is counted by one triangle only.
  const TriangleMesh sheet = TriangleMesh::build(plane_grid(1.0, 1.0, 1, 1)).value();
  EXPECT_NEAR(sheet.mean_edge(), (4.0 + std::sqrt(2.0)) / 5.0, 1e-15);
}

TEST(Refit, SnapshotsKeepTheirPositionsWhileNewOnesAreMade) {
  Rng rng(6);
  const TriangleMesh rest = TriangleMesh::build(random_closed_mesh(2, 2, 0.05, 0.3)).value();
  const TriangleIndex base = TriangleIndex::build(rest);
  MeshRefitter refitter(base);
  std::vector<TriangleIndex> held;
  std::vector<Positions> where;
  for (int i = 0; i < 7; ++i) {
    where.push_back(bent(rest, rng));
    held.push_back(refitter.moved(where.back()).value());
  }
  for (std::size_t i = 0; i < held.size(); ++i) {
    ASSERT_EQ(positions_of(held[i].mesh()), where[i]);
    expect_brute_force(held[i], rng, 6);
  }
  expect_brute_force(base, rng, 6);
  EXPECT_EQ(positions_of(base.mesh()), positions_of(rest));
}

TEST(Refit, ArraysAreReusedOnceNobodyHoldsThem) {
  const TriangleMesh rest = TriangleMesh::build(icosphere(2, 0.05)).value();
  MeshRefitter refitter(TriangleIndex::build(rest));
  Rng rng(7);
  const Vec3* first = nullptr;
  {
    const TriangleIndex one = refitter.moved(bent(rest, rng)).value();
    first = one.mesh().positions().data();
    const TriangleIndex copy = one;
    EXPECT_EQ(copy.mesh().positions().data(), first) << "a copy shares";
    const TriangleIndex two = refitter.moved(bent(rest, rng)).value();
    EXPECT_NE(two.mesh().positions().data(), first);
    EXPECT_EQ(refitter.buffers(), 2u);
  }
  const TriangleIndex again = refitter.moved(bent(rest, rng)).value();
  EXPECT_EQ(again.mesh().positions().data(), first);
  EXPECT_EQ(refitter.buffers(), 2u);
  EXPECT_EQ(again.mesh().triangles().data(), refitter.rest().mesh().triangles().data()) << "triangles are shared";
}

TEST(Refit, IdentityIsItsOwnAndLineageShared) {
  const TriangleMesh rest = TriangleMesh::build(icosphere(2, 0.05)).value();
  const TriangleIndex base = TriangleIndex::build(rest);
  const TriangleIndex stranger = TriangleIndex::build(rest);
  MeshRefitter refitter(base);
  std::uint64_t before = 0;
  {
    const TriangleIndex once = refitter.moved(positions_of(rest)).value();
    before = once.identity();
  }
  // The same arrays again: a patch of the earlier snapshot must not be read.
  const TriangleIndex moved = refitter.moved(positions_of(rest)).value();
  EXPECT_NE(moved.identity(), before);
  EXPECT_NE(moved.identity(), base.identity());
  EXPECT_EQ(moved.lineage(), base.lineage());
  EXPECT_EQ(TriangleIndex(moved).identity(), moved.identity());
  EXPECT_NE(stranger.lineage(), base.lineage());
  EXPECT_EQ(MeshRefitter(moved).moved(positions_of(rest))->lineage(), base.lineage());
  EXPECT_TRUE(moved.mesh().same_topology(rest));
  EXPECT_FALSE(moved.mesh().same_topology(TriangleMesh::build(icosphere(2, 0.05)).value()));
}

TEST(Refit, APatchOfAnOlderSnapshotIsNotRead) {
  Rng rng(8);
  const TriangleMesh rest = TriangleMesh::build(icosphere(3, 0.05)).value();
  MeshRefitter refitter(TriangleIndex::build(rest));
  TrianglePatch patch;
  for (int i = 0; i < 20; ++i) {
    const TriangleIndex index = refitter.moved(bent(rest, rng)).value();
    const Vec3 p = index.mesh().positions()[7] + random_vector(rng, 0.002);
    EXPECT_EQ(index.closest(p, infinity, patch).distance, std::sqrt(brute_squared_distance(index.mesh(), p)));
  }
}

TEST(Refit, TheSkinFollowsTheMesh) {
  const TriangleMesh rest = TriangleMesh::build(icosphere(2, 0.05)).value();
  const TriangleIndex base = TriangleIndex::build(rest);
  MeshRefitter refitter(base);
  Positions large = positions_of(rest);
  for (Vec3& p : large) p *= 10.0;
  EXPECT_NEAR(refitter.moved(large)->skin(), 10.0 * base.skin(), 1e-9 * base.skin());
}

TEST(Refit, CostGrowsOnlyWithDeformation) {
  Rng rng(9);
  const TriangleMesh rest = TriangleMesh::build(icosphere(4, 0.05)).value();
  const TriangleIndex base = TriangleIndex::build(rest);
  EXPECT_EQ(base.cost_ratio(), 1.0);
  MeshRefitter refitter(base);
  Positions twice = positions_of(rest);
  for (Vec3& p : twice) p *= 2.0;
  EXPECT_EQ(refitter.moved(positions_of(rest))->cost_ratio(), 1.0);
  EXPECT_NEAR(refitter.moved(twice)->cost_ratio(), 1.0, 1e-4);
  const TriangleIndex torn = refitter.moved(scattered(rest, rng)).value();
  EXPECT_GT(torn.cost_ratio(), 2.0);
  EXPECT_EQ(TriangleIndex::build(torn.mesh()).cost_ratio(), 1.0);
}

TEST(Refit, TwoThreadsAnswerAsOne) {
  Rng rng(10);
  const TriangleMesh rest = TriangleMesh::build(plane_grid(0.1, 0.1, 110, 110)).value();
  ASSERT_GT(rest.triangles().size(), 20000u) << "fewer are not shared out";
  const TriangleIndex base = TriangleIndex::build(rest);
  MeshRefitter one(base, 1);
  MeshRefitter two(base, 2);
  const Positions where = bent(rest, rng);
  const TriangleIndex first = one.moved(where).value();
  const TriangleIndex second = two.moved(where).value();
  for (std::uint32_t vertex = 0; vertex < where.size(); ++vertex)
    ASSERT_EQ(first.mesh().vertex_normal(vertex), second.mesh().vertex_normal(vertex));
  const Box around = first.mesh().bounds();
  for (int i = 0; i < 200; ++i) {
    const Vec3 p = random_point(rng, around);
    EXPECT_EQ(first.closest(p, infinity).distance, second.closest(p, infinity).distance);
  }
}

TEST(TriangleIndex, PairsWithoutACommonVertexWhoseBoxesMeetAreFoundOnceEach) {
  Rng rng(12);
  for (const TriangleMesh& mesh : meshes()) {
    const auto faces = static_cast<std::uint32_t>(mesh.triangles().size());
    const double size = mesh.bounds().diagonal();
    std::vector<Box> boxes(faces);
    for (std::uint32_t face = 0; face < faces; ++face) {
      for (const Vec3& corner : mesh.corners(face)) boxes[face].include(corner);
      boxes[face] = boxes[face].grown(rng.uniform(0.0, 0.03 * size));
    }
    for (const SearchStructure structure : {SearchStructure::bvh, SearchStructure::octree}) {
      const TriangleIndex index = TriangleIndex::build(mesh, structure);
      std::vector<std::uint8_t> found(std::size_t{faces} * faces, 0);
      // Each pair has a place of its own, whichever thread tells of it.
      const FaceBoxes enclosed = index.enclosed([&](auto numbers, auto, auto out) {
        for (std::size_t i = 0; i < numbers.size(); ++i) out[i] = boxes[numbers[i]];
      });
      index.for_each_meeting(enclosed, [&](std::uint32_t one, std::span<const std::uint32_t> others) {
        for (const std::uint32_t other : others) {
          ASSERT_NE(one, other);
          ++found[std::size_t{std::min(one, other)} * faces + std::max(one, other)];
        }
      });
      for (std::uint32_t one = 0; one < faces; ++one) {
        for (std::uint32_t other = one + 1; other < faces; ++other) {
          const double apart =
              (boxes[one].lower - boxes[other].upper).cwiseMax(boxes[other].lower - boxes[one].upper).maxCoeff();
          const int times = found[std::size_t{one} * faces + other];
          if (share_vertex(mesh.triangles()[one], mesh.triangles()[other])) {
            ASSERT_EQ(times, 0) << one << " and " << other;
            continue;
          }
          ASSERT_TRUE(apart > 0.0 || times == 1) << one << " and " << other;
          ASSERT_TRUE(apart <= 1e-5 * size || times == 0) << one << " and " << other;
        }
      }
    }
  }
}

TEST(Refit, ErrorsNameWhatIsWrong) {
  const TriangleMesh rest = TriangleMesh::build(icosphere(1, 0.05)).value();
  MeshRefitter refitter(TriangleIndex::build(rest));
  const auto message = [&](const Positions& positions) {
    auto moved = refitter.moved(positions);
    return moved ? std::string("accepted") : moved.error().message();
  };
  Positions few = positions_of(rest);
  few.pop_back();
  EXPECT_EQ(message(few), "moved mesh: has 41 positions; accepted: 42, one for every vertex of the mesh");
  Positions broken = positions_of(rest);
  broken[17].y() = std::nan("");
  EXPECT_EQ(message(broken),
            "vertex 17 (counted from 0): has a coordinate that is not finite; accepted: finite coordinates");
  broken[17].y() = -1e70;
  EXPECT_EQ(message(broken),
            "vertex 17 (counted from 0): has a coordinate beyond 1e60 m; accepted: finite coordinates");
  Positions flat = positions_of(rest);
  const TriangleMesh::Triangle& t = rest.triangles()[5];
  flat[t[0]] = 0.5 * (flat[t[1]] + flat[t[2]]);
  EXPECT_EQ(message(flat),
            "triangle 5 (counted from 0): has lost its area; accepted: positions that leave every triangle an area");
  flat[t[0]] = flat[t[1]];
  EXPECT_NE(message(flat).find("has lost its area"), std::string::npos);
  EXPECT_NE(message(Positions(42, Vec3(1.0, 2.0, 3.0))).find("triangle 0 "), std::string::npos);
  // After all that it goes on working.
  Rng rng(11);
  expect_brute_force(refitter.moved(positions_of(rest)).value(), rng, 5);
}

TEST(Refit, ATriangleMayBeAlmostFlat) {
  // Whatever building accepts, moving accepts; and the other way round.
  for (const double height : {1e-5, 1e-9, 1e-11, 3e-12, 1.9e-12, 1e-13, 1e-20}) {
    MeshSource source;
    source.positions = {Vec3(0.0, 0.0, 0.0), Vec3(1.0, 0.0, 0.0), Vec3(0.5, 1.0, 0.0)};
    source.triangles = {{0, 1, 2}};
    const TriangleMesh rest = TriangleMesh::build(source).value();
    source.positions[2].y() = height;
    EXPECT_EQ(rest.moved(source.positions).ok(), TriangleMesh::build(source).ok()) << height;
  }
}

}  // namespace
}  // namespace asperity::refit_test
