// The wide BVH against brute force, plain kernels against AVX2, the certificate of the patch against both.

#include "asperity/geometry/bvh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include "asperity/core/parallel_for.h"
#include "asperity/core/rng.h"
#include "asperity/geometry/generators.h"
#include "asperity/geometry/triangle_index.h"
#include "tests/geometry/random_meshes.h"

namespace asperity::bvh_test {
namespace {

Vec3 random_point(Rng& rng, const Box& box) {
  return {rng.uniform(box.lower.x(), box.upper.x()), rng.uniform(box.lower.y(), box.upper.y()),
          rng.uniform(box.lower.z(), box.upper.z())};
}

double brute_squared_distance(const TriangleMesh& mesh, const Vec3& p) {
  double best = infinity;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const auto [a, b, c] = mesh.corners(face);
    best = std::min(best, closest_point_on_triangle(p, a, b, c).squared_distance);
  }
  return best;
}

/// Every kind of random mesh of the octree's tests, the same oracle.
std::vector<TriangleMesh> meshes() {
  std::vector<TriangleMesh> all;
  for (int kind = 0; kind < 8; ++kind) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      auto mesh = TriangleMesh::build(test::mesh_of_kind(kind, seed));
      if (mesh) all.push_back(std::move(mesh).value());
    }
  }
  return all;
}

/// The same, a rough one of many triangles and a flat sheet.
std::vector<TriangleMesh> meshes_and_sheet() {
  std::vector<TriangleMesh> all = meshes();
  all.push_back(TriangleMesh::build(random_closed_mesh(9, 4, 0.05, 0.5)).value());
  all.push_back(TriangleMesh::build(plane_grid(0.1, 0.1, 12, 12)).value());
  return all;
}

TEST(Bvh, ClosestEqualsBruteForceOnEveryKindOfMesh) {
  Rng rng(1);
  for (const TriangleMesh& mesh : meshes()) {
    for (const bool plain : {false, true}) {
      const Bvh bvh = Bvh::build(mesh, {plain});
      const double size = mesh.bounds().diagonal();
      for (int i = 0; i < 200; ++i) {
        const Vec3 p = random_point(rng, mesh.bounds().grown(i % 3 == 0 ? 3.0 * size : 0.1 * size));
        EXPECT_EQ(bvh.closest(p, infinity).point.squared_distance, brute_squared_distance(mesh, p));
      }
    }
  }
}

TEST(Bvh, ClosestAnswersFromAnyDistance) {
  const TriangleMesh mesh = TriangleMesh::build(random_closed_mesh(3, 1, 0.05, 0.3)).value();
  for (const bool plain : {false, true}) {
    const Bvh bvh = Bvh::build(mesh, {plain});
    for (double far = 1.0; far < 1e150; far *= 1e3) {
      const Vec3 p(0.3 * far, far, -0.1 * far);
      EXPECT_EQ(bvh.closest(p, infinity).point.squared_distance, brute_squared_distance(mesh, p)) << far;
      EXPECT_EQ(bvh.closest(p, 0.5 * far).face, no_index) << far;
      EXPECT_NE(bvh.closest(p, 1e3 * far).face, no_index) << far;
    }
  }
}

TEST(Bvh, ClosestKeepsItsBound) {
  Rng rng(2);
  const TriangleMesh mesh = TriangleMesh::build(random_closed_mesh(3, 3, 0.05, 0.4)).value();
  const Bvh bvh = Bvh::build(mesh);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p = random_point(rng, mesh.bounds().grown(0.05));
    const double distance = std::sqrt(brute_squared_distance(mesh, p));
    EXPECT_EQ(bvh.closest(p, 0.999 * distance).face, no_index);
    EXPECT_NE(bvh.closest(p, 1.001 * distance).face, no_index);
  }
}

TEST(Bvh, FirstHitEqualsBruteForce) {
  Rng rng(3);
  for (const TriangleMesh& mesh : meshes()) {
    const Bvh bvh = Bvh::build(mesh);
    for (int i = 0; i < 200; ++i) {
      const Box around = mesh.bounds().grown(0.2 * mesh.bounds().diagonal());
      const Segment segment{random_point(rng, around), random_point(rng, around)};
      double first = infinity;
      for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
        const auto [a, b, c] = mesh.corners(face);
        double t = 0.0;
        if (segment_triangle_intersection(segment, a, b, c, t)) first = std::min(first, t);
      }
      const FirstHit hit = bvh.first_hit(segment);
      EXPECT_EQ(hit.face == no_index, std::isinf(first));
      EXPECT_TRUE(hit.face == no_index || hit.t == first);
    }
  }
}

// Large meshes are built in parts, on all cores; within a loop that is shared already by one.
TEST(Bvh, PartsOnAnyNumberOfThreadsMakeTheSameHierarchy) {
  const TriangleMesh mesh = TriangleMesh::build(icosphere(6, 0.05)).value();
  const auto order_of = [&](const Bvh& bvh) {
    std::vector<std::uint32_t> order;
    bvh.for_each_in_box(mesh.bounds(), [&](std::uint32_t face) { order.push_back(face); });
    return order;
  };
  const Bvh shared = Bvh::build(mesh);
  std::vector<std::uint32_t> alone[2];
  parallel_for(2, {}, [&](std::size_t i) { alone[i] = order_of(Bvh::build(mesh)); });
  std::vector<std::uint32_t> order = order_of(shared);
  EXPECT_EQ(order, alone[0]);
  EXPECT_EQ(order, alone[1]);
  std::sort(order.begin(), order.end());
  ASSERT_EQ(order.size(), mesh.triangles().size());
  for (std::uint32_t face = 0; face < order.size(); ++face) ASSERT_EQ(order[face], face);
  Rng rng(3);
  for (int i = 0; i < 20; ++i) {
    const Vec3 p = random_point(rng, mesh.bounds().grown(0.01));
    EXPECT_NEAR(shared.closest(p, infinity).point.squared_distance, brute_squared_distance(mesh, p), 1e-18);
  }
}

// What a leaf does not hold is memory that is paid for nevertheless.
TEST(Bvh, LeavesAndTheNodesOverThemAreFull) {
  for (const int subdivisions : {3, 4, 6}) {
    const TriangleMesh mesh = TriangleMesh::build(icosphere(subdivisions, 0.05)).value();
    const auto triangles = static_cast<double>(mesh.triangles().size());
    // A leaf of eight with its cylinder is 352 bytes, 44 a triangle; a node of eight leaves adds 3.5.
    EXPECT_LT(static_cast<double>(Bvh::build(mesh).memory_bytes()), 50.0 * triangles) << subdivisions;
  }
}

TEST(Bvh, BoxQueryFindsEveryTriangleWhoseBoxMeets) {
  Rng rng(4);
  for (const TriangleMesh& mesh : meshes()) {
    const Bvh bvh = Bvh::build(mesh);
    for (int i = 0; i < 50; ++i) {
      Box box;
      box.include(random_point(rng, mesh.bounds()));
      box.include(random_point(rng, mesh.bounds()));
      std::vector<int> found(mesh.triangles().size(), 0);
      bvh.for_each_in_box(box, [&](std::uint32_t face) { ++found[face]; });
      for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
        Box own;
        for (const Vec3& corner : mesh.corners(face)) own.include(corner);
        const bool meets =
            (own.lower.array() <= box.upper.array()).all() && (box.lower.array() <= own.upper.array()).all();
        EXPECT_TRUE(!meets || found[face] == 1) << "face " << face;
        EXPECT_LE(found[face], 1);
      }
    }
  }
}

TEST(TriangleIndex, WhatComesNearAFaceIsFoundBesideIt) {
  std::size_t seen = 0;
  std::size_t left_out = 0;
  for (const TriangleMesh& mesh : meshes()) {
    const double margin = 1e-6 * mesh.bounds().diagonal();
    for (const SearchStructure structure : {SearchStructure::bvh, SearchStructure::octree}) {
      const TriangleIndex index = TriangleIndex::build(mesh, structure);
      for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
        std::vector<int> found(mesh.triangles().size(), 0);
        index.for_each_beside(face, margin, [&](std::uint32_t other) { ++found[other]; });
        const std::array<Vec3, 3> own = mesh.corners(face);
        const Vec3 front = mesh.face_normal(face);
        const auto beyond = [&](const std::array<Vec3, 3>& corners, const Vec3& at, const Vec3& outward) {
          double least = infinity;
          for (const Vec3& corner : corners) least = std::min(least, outward.dot(corner - at));
          return least > margin;
        };
        Box around;
        for (const Vec3& corner : own) around.include(corner);
        around = around.grown(margin);
        for (std::uint32_t other = 0; other < mesh.triangles().size(); ++other) {
          const std::array<Vec3, 3> corners = mesh.corners(other);
          bool apart = beyond(corners, own[0], front) || beyond(corners, own[0], -front);
          for (std::size_t k = 0; k < 3; ++k)
            apart = apart || beyond(corners, own[k], (own[(k + 1) % 3] - own[k]).cross(front).normalized());
          Box box;
          for (const Vec3& corner : corners) box.include(corner);
          ASSERT_TRUE(found[other] > 0 || apart || !box.overlaps(around)) << "face " << other << " beside " << face;
          // All that have a vertex in common are told of: they can be counted.
          const bool around_it = share_vertex(mesh.triangles()[face], mesh.triangles()[other]);
          ASSERT_TRUE(!around_it || found[other] > 0) << "face " << other << " at " << face;
          if (structure == SearchStructure::octree) continue;
          ASSERT_LE(found[other], 1);
          seen += found[other] > 0 && !around_it ? 1U : 0U;
          left_out += found[other] == 0 && box.overlaps(around) ? 1U : 0U;
        }
      }
    }
  }
  EXPECT_GT(seen, 100u);
  EXPECT_GT(2 * left_out, seen);
}

// The certificate: a coherent walk answers as brute force does at every step, for any length of step.
TEST(TriangleIndex, CoherentClosestIsExactOnRandomWalks) {
  Rng rng(5);
  for (TriangleMesh& mesh : meshes()) {
    const double size = mesh.bounds().diagonal();
    const Box around = mesh.bounds().grown(0.1 * size);
    for (const SearchStructure structure : {SearchStructure::bvh, SearchStructure::octree}) {
      const TriangleIndex index = TriangleIndex::build(mesh, structure);
      TrianglePatch patch;
      Vec3 p = random_point(rng, around);
      for (int i = 0; i < 150; ++i) {
        const double reach = size * std::pow(10.0, rng.uniform(-5.0, -0.5));
        p = (p + reach * Vec3(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)))
                .cwiseMax(around.lower)
                .cwiseMin(around.upper);
        const double expected = brute_squared_distance(index.mesh(), p);
        ASSERT_EQ(index.closest(p, infinity, patch).distance, std::sqrt(expected));
      }
    }
  }
}

TEST(TriangleIndex, PatchOfAnotherMeshIsNeverRead) {
  const TriangleIndex a = TriangleIndex::build(TriangleMesh::build(icosphere(3, 0.05)).value());
  const TriangleIndex b = TriangleIndex::build(TriangleMesh::build(icosphere(2, 0.02)).value());
  TrianglePatch patch;
  const Vec3 p(0.0, 0.03, 0.01);
  EXPECT_EQ(a.closest(p, infinity, patch).distance, a.closest(p, infinity).distance);
  EXPECT_EQ(b.closest(p, infinity, patch).distance, b.closest(p, infinity).distance);
}

// First touch of a moving ball, against small steps of the closest distance.
TEST(TriangleIndex, SweepStopsWhereTheBallFirstTouches) {
  Rng rng(6);
  for (const SearchStructure structure : {SearchStructure::bvh, SearchStructure::octree}) {
    const TriangleIndex index =
        TriangleIndex::build(TriangleMesh::build(random_closed_mesh(9, 2, 0.05, 0.5)).value(), structure);
    const Box around = index.mesh().bounds().grown(0.03);
    int hits = 0;
    for (int i = 0; i < 400; ++i) {
      const double radius = i % 2 == 0 ? 0.0 : rng.uniform(0.0, 0.01);
      const Segment motion{random_point(rng, around), random_point(rng, around)};
      if (index.closest(motion.from, infinity).distance < radius + 1e-4) continue;
      TrianglePatch patch;
      const SweptHit hit = index.sweep(motion, radius, Sides::both, patch);
      const double end = hit.hit ? hit.t : 1.0;
      for (int j = 0; j <= 400; ++j) {
        const Vec3 x = motion.from + (end * j / 400.0) * (motion.to - motion.from);
        ASSERT_GE(index.closest(x, infinity).distance, radius - 1e-12) << "passed a triangle before the hit";
      }
      if (!hit.hit) continue;
      ++hits;
      const Vec3 x = motion.from + hit.t * (motion.to - motion.from);
      EXPECT_NEAR(index.closest(x, infinity).distance, radius, 2.0 * index.skin());
    }
    EXPECT_GT(hits, 100);
  }
}

// A motion of a few hundredths of the radius past an edge, off which the ball is at both ends.
TEST(TriangleIndex, ShortMotionsOfABallAreJudgedAlongTheirWay) {
  Rng rng(66);
  for (const SearchStructure structure : {SearchStructure::bvh, SearchStructure::octree}) {
    const TriangleIndex index =
        TriangleIndex::build(TriangleMesh::build(random_closed_mesh(9, 2, 0.05, 0.5)).value(), structure);
    const Box around = index.mesh().bounds().grown(0.01);
    const double skin = index.skin();
    int only_on_the_way = 0;
    int free = 0;
    for (int i = 0; i < 6000; ++i) {
      const double radius = rng.uniform(0.001, 0.01);
      // Off some place by less than is left of the way's bow, and across it.
      const Vec3 near = random_point(rng, around);
      const Foot foot = index.closest(near, infinity);
      const double length = rng.uniform(0.02, 0.249) * radius;
      const Vec3 out = (near - foot.point).normalized();
      const Vec3 across = out.cross(random_point(rng, around)).normalized();
      const Vec3 middle = foot.point + (radius - rng.uniform(-0.2, 1.0) * length * length / (8.0 * radius)) * out;
      const Segment motion{middle - 0.5 * length * across, middle + 0.5 * length * across};
      if (index.closest(motion.from, infinity).distance < radius + 2.0 * skin) continue;
      TrianglePatch patch;
      const SweptHit hit = index.sweep(motion, radius, Sides::both, patch);
      const double reached = hit.hit ? hit.t : 1.0;
      double least = infinity;
      for (int j = 0; j <= 100; ++j) {
        const Vec3 x = motion.from + (reached * j / 100.0) * (motion.to - motion.from);
        least = std::min(least, index.closest(x, infinity).distance);
      }
      ASSERT_GT(least, radius) << i;
      if (hit.hit) {
        EXPECT_NEAR(index.closest(motion.from + hit.t * (motion.to - motion.from), infinity).distance, radius,
                    2.0 * skin);
        only_on_the_way += index.closest(motion.to, infinity).distance > radius + 2.0 * skin ? 1 : 0;
      } else {
        ++free;
      }
    }
    EXPECT_GT(only_on_the_way, 100);
    EXPECT_GT(free, 100);
  }
}

// Where more triangles are near than a patch holds: a fine sheet over one whose triangles are far larger, so that a
// motion of the mean edge is long against the fine ones.
TEST(TriangleIndex, SweepThroughACrowdOfSmallTrianglesMeetsTheFirst) {
  MeshSource source = plane_grid(0.02, 0.02, 60, 60);
  const MeshSource large = plane_grid(0.6, 0.6, 60, 60);
  const auto before = static_cast<std::uint32_t>(source.positions.size());
  for (Vec3& p : source.positions) p.z() = 1e-3 * std::sin(900.0 * p.x()) * std::cos(700.0 * p.y());
  for (const Vec3& p : large.positions) source.positions.push_back(p - Vec3(0.0, 0.0, 0.05));
  for (const auto& t : large.triangles) source.triangles.push_back({t[0] + before, t[1] + before, t[2] + before});
  source.corner_uvs.clear();
  const TriangleIndex index = TriangleIndex::build(TriangleMesh::build(source).value());
  const double edge = index.mesh().mean_edge();
  Rng rng(7);
  TrianglePatch warm;
  int hits = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 from(rng.uniform(-8e-3, 8e-3), rng.uniform(-8e-3, 8e-3), rng.uniform(-2e-3, 2e-3));
    const Vec3 way = Vec3(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-0.5, 0.5)).normalized();
    const Segment motion{from, from + edge * std::pow(10.0, rng.uniform(-1.0, 0.5)) * way};
    const FirstHit expected = index.first_hit(motion);
    TrianglePatch cold;
    for (TrianglePatch* patch : {&warm, &cold}) {
      const SweptHit hit = index.sweep(motion, 0.0, Sides::both, *patch);
      ASSERT_EQ(hit.hit, expected.face != no_index) << i;
      if (hit.hit) {
        // A swept point stops where it touches, a skin before it is through.
        ASSERT_LE(hit.t, expected.t + 1e-9) << i;
        const Vec3 x = motion.from + hit.t * (motion.to - motion.from);
        ASSERT_LE(index.closest(x, infinity).distance, 2.0 * index.skin()) << i;
      }
    }
    hits += expected.face != no_index ? 1 : 0;
  }
  EXPECT_GT(hits, 500);
}

TEST(TriangleIndex, ContactsAreThePlanesWithinTouch) {
  const TriangleIndex index = TriangleIndex::build(TriangleMesh::build(box_mesh(Vec3(0.1, 0.1, 0.1))).value());
  for (const double radius : {0.0, 0.003}) {
    const auto count = [&](const Vec3& position, Sides sides) {
      TrianglePatch patch;
      ContactSet contacts;
      index.contacts(position, radius, sides, patch, contacts);
      return contacts.size();
    };
    const double in = 0.05 - radius - index.skin();
    EXPECT_EQ(count(Vec3(in, 0.01, 0.004), Sides::both), 1u);
    EXPECT_EQ(count(Vec3(in, in, 0.004), Sides::both), 2u);
    EXPECT_EQ(count(Vec3(in, in, in), Sides::both), 3u);
    EXPECT_EQ(count(Vec3(in, in, in), Sides::front), 0u) << "from behind";
    EXPECT_EQ(count(Vec3(0.05 + radius + index.skin(), 0.01, 0.004), Sides::front), 1u);
    EXPECT_EQ(count(Vec3(0.06, 0.01, 0.004), Sides::front), 0u);
  }
}

Vec3 random_unit(Rng& rng) {
  return Vec3(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)).normalized();
}

/// A place at most `apart` from a corner, an edge or the inside of one of the mesh's triangles.
Vec3 place_on(Rng& rng, const TriangleMesh& mesh, double apart) {
  const auto corners = mesh.corners(rng.below(static_cast<std::uint32_t>(mesh.triangles().size())));
  Vec3 weights(rng.uniform(), rng.uniform(), rng.uniform());
  const std::uint32_t kind = rng.below(3);
  if (kind != 0) weights[0] = 0.0;
  if (kind == 2) weights[1] = 0.0;
  weights /= weights.sum();
  return weights[0] * corners[0] + weights[1] * corners[1] + weights[2] * corners[2] + apart * random_unit(rng);
}

std::string told(const Foot& foot) {
  std::ostringstream text;
  text << std::hexfloat << foot.element << " at " << foot.point.transpose() << " normal " << foot.normal.transpose()
       << " distance " << foot.distance << "\n";
  return text.str();
}

std::string told(const ContactSet& contacts) {
  std::string all;
  for (const Foot& contact : contacts) all += told(contact);
  return all;
}

std::string told(const SweptHit& hit) {
  std::ostringstream text;
  if (hit.hit) text << std::hexfloat << hit.t << " " << told(hit.contact);
  return text.str();
}

// A patch is a cache: whatever it holds, an answer has the same bits. Where several triangles are as near, which is on
// every edge and corner, the choice between them must not follow the order in which a patch lists them.
TEST(TriangleIndex, NoAnswerDependsOnWhatAPatchHolds) {
  Rng rng(11);
  const std::vector<TriangleMesh> all = meshes_and_sheet();
  int hits = 0;
  int several = 0;
  for (std::size_t which = 0; which < 2 * all.size(); ++which) {
    const auto structure = which % 2 == 0 ? SearchStructure::bvh : SearchStructure::octree;
    const TriangleIndex index = TriangleIndex::build(all[which / 2], structure);
    const double edge = index.mesh().mean_edge();
    const double skin = index.skin();
    TrianglePatch walked;
    Vec3 position = place_on(rng, index.mesh(), skin);
    for (int i = 0; i < 200; ++i) {
      if (i % 20 == 0) position = place_on(rng, index.mesh(), skin);
      const double radius = i % 3 == 0 ? edge * std::pow(10.0, rng.uniform(-2.0, 0.5)) : 0.0;
      const Sides sides = rng.below(2) == 0 ? Sides::both : Sides::front;
      const Vec3 to = rng.below(3) == 0 ? place_on(rng, index.mesh(), skin)
                                        : position + edge * std::pow(10.0, rng.uniform(-6.0, 1.0)) * random_unit(rng);
      const Segment motion{position, to};
      const double bound = rng.below(2) == 0 ? infinity : edge;
      TrianglePatch cold[3];
      TrianglePatch elsewhere;
      (void)index.closest(place_on(rng, index.mesh(), 0.3 * edge), infinity, elsewhere);
      const std::string swept = told(index.sweep(motion, radius, sides, cold[0]));
      EXPECT_EQ(told(index.sweep(motion, radius, sides, elsewhere)), swept) << i;
      EXPECT_EQ(told(index.sweep(motion, radius, sides, walked)), swept) << i;
      hits += swept.empty() ? 0 : 1;

      ContactSet touched[3];
      index.contacts(to, radius, sides, cold[1], touched[0]);
      index.contacts(to, radius, sides, elsewhere, touched[1]);
      index.contacts(to, radius, sides, walked, touched[2]);
      EXPECT_EQ(told(touched[1]), told(touched[0])) << i;
      EXPECT_EQ(told(touched[2]), told(touched[0])) << i;
      several += touched[0].size() > 1 ? 1 : 0;

      const std::string nearest = told(index.closest(to, bound));
      EXPECT_EQ(told(index.closest(to, bound, cold[2])), nearest) << i;
      EXPECT_EQ(told(index.closest(to, bound, elsewhere)), nearest) << i;
      EXPECT_EQ(told(index.closest(to, bound, walked)), nearest) << i;
      ASSERT_FALSE(testing::Test::HasFailure()) << index.mesh().triangles().size() << " triangles";
      position = to;
    }
  }
  EXPECT_GT(hits, 1000);
  EXPECT_GT(several, 1000);
}

/// A place inside a face, the ball's centre at rest over it.
Vec3 resting_over(Rng& rng, const TriangleMesh& mesh, double radius, double skin, Vec3& normal) {
  const std::uint32_t face = rng.below(static_cast<std::uint32_t>(mesh.triangles().size()));
  const auto corners = mesh.corners(face);
  Vec3 weights(rng.uniform(0.05, 1.0), rng.uniform(0.05, 1.0), rng.uniform(0.05, 1.0));
  weights /= weights.sum();
  normal = mesh.face_normal(face);
  return weights[0] * corners[0] + weights[1] * corners[1] + weights[2] * corners[2] + (radius + skin) * normal;
}

// A ball that stays on one face is not searched for: what else it may touch is listed and left behind in time.
TEST(TriangleIndex, ABallThatSlidesAlongAFaceAnswersAsSearchesDo) {
  Rng rng(71);
  const std::vector<TriangleMesh> all = meshes_and_sheet();
  int slid = 0;
  int stopped = 0;
  int listed = 0;
  for (std::size_t which = 0; which < 2 * all.size(); ++which) {
    const TriangleIndex index =
        TriangleIndex::build(all[which / 2], which % 2 == 0 ? SearchStructure::bvh : SearchStructure::octree);
    const double edge = index.mesh().mean_edge();
    for (int stroke = 0; stroke < 60; ++stroke) {
      const double radius = edge * std::pow(10.0, rng.uniform(-1.0, 0.7));
      const Sides sides = rng.below(2) == 0 ? Sides::both : Sides::front;
      Vec3 normal;
      Vec3 position = resting_over(rng, index.mesh(), radius, index.skin(), normal);
      const Vec3 along = normal.cross(random_unit(rng)).normalized();
      const double length = edge * std::pow(10.0, rng.uniform(-3.0, -0.5));
      TrianglePatch kept;
      ContactSet before;
      index.contacts(position, radius, sides, kept, before);
      for (int i = 0; i < 40; ++i) {
        TrianglePatch cold;
        ContactSet touched;
        index.contacts(position, radius, sides, cold, touched);
        const Vec3 way = (along + 0.2 * normal.cross(random_unit(rng))).normalized();
        const Segment motion{position, position + length * way};
        TrianglePatch tried = kept;
        const bool slides = index.slides(motion, radius, sides, tried);
        slid += slides ? 1 : 0;
        listed += slides && !tried.beside.listed.empty() ? 1 : 0;
        const SweptHit hit = index.sweep(motion, radius, sides, kept);
        ASSERT_EQ(told(hit), told(index.sweep(motion, radius, sides, cold))) << which << " " << stroke << " " << i;
        if (hit.hit) {
          ++stopped;
          break;
        }
        position = motion.to;
        ContactSet as_kept;
        ContactSet as_searched;
        TrianglePatch none;
        index.contacts(position, radius, sides, kept, as_kept);
        index.contacts(position, radius, sides, none, as_searched);
        ASSERT_EQ(told(as_kept), told(as_searched)) << which << " " << stroke << " " << i;
      }
    }
  }
  EXPECT_GT(slid, 4000);
  EXPECT_GT(listed, 500);
  EXPECT_GT(stopped, 100);
}

// A tree is a way to find things: which triangle an answer names where several are as near is not its to say.
TEST(TriangleIndex, NoAnswerDependsOnHowTheTreeIsCut) {
  Rng rng(23);
  std::vector<TriangleMesh> all = meshes();
  all.push_back(TriangleMesh::build(icosphere(4, 0.05)).value());
  all.push_back(TriangleMesh::build(plane_grid(0.1, 0.1, 12, 12)).value());
  int hits = 0;
  for (const TriangleMesh& mesh : all) {
    const TriangleIndex indices[] = {TriangleIndex::build(mesh), test::otherwise_cut(mesh),
                                     TriangleIndex::build(mesh, SearchStructure::octree)};
    const double edge = mesh.mean_edge();
    for (int i = 0; i < 300; ++i) {
      // Corners and edges for the most part.
      const Vec3 p = place_on(rng, mesh, 0.0);
      const Vec3 way = edge * random_unit(rng);
      const Segment through{p - way, p + way};
      const FirstHit hit = indices[0].first_hit(through);
      const std::string nearest = told(indices[0].closest(p, infinity));
      TrianglePatch patches[3];
      const std::string swept = told(indices[0].sweep(through, 0.0, Sides::both, patches[0]));
      for (int other = 1; other < 3; ++other) {
        const FirstHit again = indices[other].first_hit(through);
        EXPECT_EQ(again.face, hit.face) << other << ", t " << again.t << " and " << hit.t;
        EXPECT_EQ(again.t, hit.t);
        EXPECT_EQ(told(indices[other].closest(p, infinity)), nearest);
        EXPECT_EQ(told(indices[other].sweep(through, 0.0, Sides::both, patches[other])), swept);
      }
      hits += hit.face == no_index ? 0 : 1;
      ASSERT_FALSE(testing::Test::HasFailure()) << mesh.triangles().size() << " triangles, " << i;
    }
  }
  EXPECT_GT(hits, 500);
}

// What a search leaves out is not met: a motion that ends on a corner or an edge comes near it at its end alone, which
// is what single precision, at its start, can least tell.
TEST(TriangleIndex, SweepEqualsAskingEveryTriangle) {
  Rng rng(12);
  int ends = 0;
  int missed = 0;
  for (const TriangleMesh& mesh : meshes()) {
    const TriangleIndex index = TriangleIndex::build(mesh);
    const ContactTolerance tolerance = ContactTolerance::of(mesh.mean_edge(), mesh.bounds());
    for (int i = 0; i < 2000; ++i) {
      const Vec3 to = place_on(rng, mesh, 0.3 * index.skin());
      const Segment motion{to + mesh.mean_edge() * std::pow(10.0, rng.uniform(-3.0, 1.0)) * random_unit(rng), to};
      SweptHit expected;
      for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
        const auto [a, b, c] = mesh.corners(face);
        sweep_triangle(face, a, b, c, motion, 0.0, Sides::both, tolerance, expected);
      }
      TrianglePatch patch;
      const SweptHit hit = index.sweep(motion, 0.0, Sides::both, patch);
      missed += hit.hit != expected.hit ? 1 : 0;
      ends += expected.hit && expected.t > 1.0 - 1e-4 ? 1 : 0;
      if (hit.hit && expected.hit) {
        EXPECT_LE(std::abs(hit.t - expected.t) * (motion.to - motion.from).norm(), index.skin());
      }
    }
  }
  EXPECT_EQ(missed, 0);
  EXPECT_GT(ends, 3000);
}

TEST(SimdKernels, PlainAndBestAgree) {
  Rng rng(7);
  for (int i = 0; i < 2000; ++i) {
    TrianglesOf8 triangles;
    BoxesOf8 boxes;
    for (int axis = 0; axis < 3; ++axis) {
      for (int lane = 0; lane < 8; ++lane) {
        triangles.corner[axis][lane] = static_cast<float>(rng.uniform(-1.0, 1.0));
        triangles.edge1[axis][lane] = static_cast<float>(rng.uniform(-0.3, 0.3));
        triangles.edge2[axis][lane] =
            lane == 3 ? 2.0F * triangles.edge1[axis][lane] : static_cast<float>(rng.uniform(-0.3, 0.3));
        boxes.lower[axis][lane] = static_cast<float>(rng.uniform(-1.0, 0.0));
        boxes.upper[axis][lane] = boxes.lower[axis][lane] + static_cast<float>(rng.uniform(0.0, 1.0));
      }
    }
    const float point[3] = {static_cast<float>(rng.uniform(-1.0, 1.0)), static_cast<float>(rng.uniform(-1.0, 1.0)),
                            static_cast<float>(rng.uniform(-1.0, 1.0))};
    DistancesOf8 plain;
    DistancesOf8 best;
    plain_kernels().triangles(triangles, point, plain);
    best_kernels().triangles(triangles, point, best);
    float plain_boxes[8];
    float best_boxes[8];
    plain_kernels().boxes(boxes, point, 0.5F, plain_boxes);
    best_kernels().boxes(boxes, point, 0.5F, best_boxes);
    for (int lane = 0; lane < 8; ++lane) {
      EXPECT_NEAR(plain.distance[lane], best.distance[lane], 2e-6F);
      EXPECT_NEAR(plain_boxes[lane], best_boxes[lane], 2e-6F);
    }
  }
}

TEST(SimdKernels, PlainAndBestLeaveOutTheSame) {
  Rng rng(17);
  const auto any = [&](double least, double most) { return static_cast<float>(rng.uniform(least, most)); };
  std::size_t met = 0;
  std::size_t within = 0;
  for (int i = 0; i < 2000; ++i) {
    TrianglesOf8 triangles;
    BoxesOf8 boxes;
    FloatBox box;
    PlanesAround planes;
    for (int axis = 0; axis < 3; ++axis) {
      box.lower[axis] = any(-1.0, 0.5);
      box.upper[axis] = box.lower[axis] + any(0.0, 1.0);
      for (int lane = 0; lane < 8; ++lane) {
        triangles.corner[axis][lane] = any(-1.0, 1.0);
        triangles.edge1[axis][lane] = any(-0.3, 0.3);
        triangles.edge2[axis][lane] = any(-0.3, 0.3);
        boxes.lower[axis][lane] = any(-1.0, 0.5);
        boxes.upper[axis][lane] = lane == 5 ? -1e30F : boxes.lower[axis][lane] + any(0.0, 1.0);
      }
      // Boxes that touch meet.
      if (i % 3 == 0) boxes.lower[axis][2] = box.upper[axis];
    }
    for (int k = 0; k < PlanesAround::count; ++k) {
      for (float& n : planes.normal[k]) n = any(-1.0, 1.0);
      planes.limit[k] = any(-0.5, 1.5);
    }
    const unsigned meeting = plain_kernels().meeting(boxes, box);
    ASSERT_EQ(meeting, best_kernels().meeting(boxes, box));
    for (unsigned lane = 0; lane < 8; ++lane) {
      bool meet = true;
      bool beyond = false;
      bool near_limit = false;
      for (int axis = 0; axis < 3; ++axis)
        meet = meet && boxes.lower[axis][lane] <= box.upper[axis] && boxes.upper[axis][lane] >= box.lower[axis];
      ASSERT_EQ(meet, (meeting >> lane & 1U) != 0);
      for (int k = 0; k < PlanesAround::count; ++k) {
        const auto along = [&](const auto& v) {
          double sum = 0.0;
          for (int axis = 0; axis < 3; ++axis)
            sum += static_cast<double>(v[axis][lane]) * static_cast<double>(planes.normal[k][axis]);
          return sum;
        };
        const double least = along(triangles.corner) + std::min({0.0, along(triangles.edge1), along(triangles.edge2)});
        beyond = beyond || least > static_cast<double>(planes.limit[k]);
        near_limit = near_limit || std::abs(least - static_cast<double>(planes.limit[k])) < 1e-6;
      }
      for (const SearchKernels* kernels : {&plain_kernels(), &best_kernels()})
        ASSERT_TRUE(near_limit || beyond == ((kernels->within(triangles, planes) >> lane & 1U) == 0));
      met += meet ? 1U : 0U;
      within += beyond ? 0U : 1U;
    }
  }
  EXPECT_GT(met, 500u);
  EXPECT_GT(within, 500u);
}

}  // namespace
}  // namespace asperity::bvh_test
