// A relief whose base moves: the same coat on the moved triangles, nothing stale.

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <span>
#include <thread>

#include "asperity/core/parallel_for.h"
#include "asperity/surface/relief/view.h"
#include "tests/surface/reliefs.h"

namespace asperity::relief_refit_test {
namespace {

using test::must;

using Positions = std::vector<Vec3>;

template <class Move>
Positions moved_positions(const TriangleMesh& mesh, const Move& move) {
  Positions moved;
  for (const Vec3& p : mesh.positions()) moved.push_back(move(p));
  return moved;
}

Vec3 waved(const Vec3& p) {
  return p + 0.004 * Vec3(std::sin(90.0 * p.y()), std::sin(70.0 * p.z()), std::sin(80.0 * p.x()));
}

Vec3 turned(const Vec3& p) {
  return Eigen::AngleAxisd(0.9, Vec3(1.0, 2.0, -0.5).normalized()) * p + Vec3(0.3, -0.2, 0.1);
}

/// A ball that wears waves, and what moves it.
struct Fixture {
  explicit Fixture(Mapping mapping, const Stitching& stitching = {}, int subdivisions = 2)
      : rest(test::coated(icosphere(subdivisions, 0.05), test::wavy_map(0.2e-3), mapping, 0.01, 1.0, stitching)),
        deformable(rest->base()) {}
  ReliefSurface moved(const Positions& positions) { return must(rest->moved(must(deformable.moved(positions)))); }
  template <class Move>
  ReliefSurface moved_by(const Move& move) {
    return moved(moved_positions(rest->base().mesh(), move));
  }
  std::shared_ptr<const ReliefSurface> rest;
  DeformableMesh deformable;
};

Stitching of(FoldMode folds) {
  Stitching stitching;
  stitching.folds = folds;
  return stitching;
}

TEST(ReliefRefit, NearestPointsAreThoseOfTheMovedReliefCutFinely) {
  Rng rng(1);
  for (const Mapping mapping : {Mapping::triplanar, Mapping::per_face}) {
    Fixture fixture(mapping, {}, 1);
    const ReliefSurface relief = fixture.moved_by(waved);
    const test::Tessellation dense = test::dense_net(relief, 12);
    SurfaceCache cache;
    for (int i = 0; i < 60; ++i) {
      const std::uint32_t face = test::random_face(rng, relief.base().mesh());
      const Vec3 p =
          test::point_on(relief.base().mesh(), face, test::random_barycentric(rng)) + test::random_point(rng, 0.001);
      EXPECT_NEAR(relief.view(cache).nearest(p, infinity).distance, dense.index.closest(p, infinity).distance,
                  dense.error);
    }
  }
}

TEST(ReliefRefit, WithTextureCoordinatesItIsTheReliefBuiltOnTheMovedMesh) {
  Rng rng(2);
  for (const FoldMode folds : {FoldMode::keep, FoldMode::round}) {
    Fixture fixture(Mapping::per_face, of(folds));
    const MeshSurface base = must(fixture.deformable.moved(moved_positions(fixture.rest->base().mesh(), waved)));
    const ReliefSurface moved = must(fixture.rest->moved(base));
    const ReliefSurface built(base, fixture.rest->coat());
    ASSERT_EQ(moved.shell().directions, built.shell().directions);
    EXPECT_EQ(moved.skin(), built.skin());
    EXPECT_EQ(moved.reach(), built.reach());
    EXPECT_EQ(moved.report().faces_at_fault, built.report().faces_at_fault);
    EXPECT_EQ(moved.report().overlapping_pairs, built.report().overlapping_pairs);
    SurfaceCache one;
    SurfaceCache other;
    for (int i = 0; i < 30; ++i) {
      const Vec3 p = waved(0.05 * test::random_direction(rng)) + test::random_point(rng, 0.002);
      const Foot foot = moved.view(one).nearest(p, infinity);
      const Foot same = built.view(other).nearest(p, infinity);
      EXPECT_EQ(foot.point, same.point);
      EXPECT_EQ(foot.normal, same.normal);
    }
  }
}

TEST(ReliefRefit, AMappingByPlacesDoesNotSwim) {
  Rng rng(3);
  Fixture fixture(Mapping::triplanar);
  for (int how = 0; how < 2; ++how) {
    const ReliefSurface moved = how == 0 ? fixture.moved_by(turned) : fixture.moved_by(waved);
    // A relief laid on the moved mesh from new would be another one.
    const ReliefSurface laid_anew(moved.base(), fixture.rest->coat());
    double swum = 0.0;
    for (int i = 0; i < 200; ++i) {
      const std::uint32_t face = test::random_face(rng, moved.base().mesh());
      const Vec3 at = test::random_barycentric(rng);
      const HeightJet here = moved.height(moved.frame(face), at[1], at[2]);
      const HeightJet there = fixture.rest->height(fixture.rest->frame(face), at[1], at[2]);
      ASSERT_EQ(here.height, there.height);
      ASSERT_EQ(here.u, there.u);
      ASSERT_EQ(moved.coat_sample(face, at).height, fixture.rest->coat_sample(face, at).height);
      swum = std::max(swum, std::abs(laid_anew.height(laid_anew.frame(face), at[1], at[2]).height - here.height));
    }
    EXPECT_GT(swum, 0.05e-3);
  }
}

TEST(ReliefRefit, ATurnedReliefIsFeltTurned) {
  Rng rng(4);
  Fixture fixture(Mapping::triplanar);
  const ReliefSurface moved = fixture.moved_by(turned);
  SurfaceCache one;
  SurfaceCache other;
  for (int i = 0; i < 100; ++i) {
    const Vec3 p = 0.05 * test::random_direction(rng) + test::random_point(rng, 0.001);
    const Foot before = fixture.rest->view(one).nearest(p, infinity);
    const Foot after = moved.view(other).nearest(turned(p), infinity);
    EXPECT_NEAR(after.distance, before.distance, 1e-8);
    const FieldSample field = fixture.rest->eval(p, one);
    EXPECT_NEAR(moved.eval(turned(p), other).value, field.value, 1e-8);
  }
}

TEST(ReliefRefit, SampledGradientsAreSlopesOnTheMovedFace) {
  Rng rng(5);
  Fixture fixture(Mapping::triplanar);
  const ReliefSurface moved = fixture.moved_by([](const Vec3& p) { return Vec3(1.7 * p.x(), 0.6 * p.y(), p.z()); });
  for (int i = 0; i < 100; ++i) {
    const std::uint32_t face = test::random_face(rng, moved.base().mesh());
    const Vec3 at = test::random_barycentric(rng, 0.05);
    const CoatSample sample = moved.coat_sample(face, at);
    const BarycentricFrame frame = barycentric_frame(moved.base().mesh(), face);
    EXPECT_NEAR(sample.gradient.dot(frame.normal), 0.0, 1e-12);
    const Vec3 step = 1e-7 * frame.normal.cross(test::random_direction(rng)).normalized();
    const auto height_at = [&](const Vec3& offset) {
      return moved.coat_sample(face, frame.coordinates(test::point_on(moved.base().mesh(), face, at) + offset)).height;
    };
    EXPECT_NEAR((height_at(step) - height_at(-step)) / 2.0e-7, sample.gradient.dot(step) / 1e-7, 1e-5);
    EXPECT_NEAR((sample.normal - (frame.normal - sample.gradient).normalized()).norm(), 0.0, 1e-9);
  }
}

TEST(ReliefRefit, OverlapsComeAndGo) {
  // A strip bent back over itself until the reliefs of its two ends meet, and straightened again.
  MeshSource source = plane_grid(0.1, 0.02, 40, 4);
  const auto rest = test::coated(std::move(source), test::wavy_map(0.3e-3), Mapping::per_face, 0.01);
  DeformableMesh deformable(rest->base());
  const auto hairpin = [](const Vec3& p) {
    const double radius = 1e-4 + 0.02 / 3.0;
    const double s = p.x() / radius;
    if (std::abs(s) < 1.45) return Vec3(radius * std::sin(s), p.y(), radius * (1.0 - std::cos(s)));
    // The legs lean towards each other.
    const double rest_length = (std::abs(s) - 1.45) * radius;
    const double angle = 1.45 + 0.25 * std::min(1.0, rest_length / 0.01);
    return Vec3(std::copysign(radius * std::sin(1.45) + rest_length * std::cos(angle) * 1.4, p.x()), p.y(),
                radius * (1.0 - std::cos(1.45)) + rest_length * std::sin(angle));
  };
  EXPECT_EQ(rest->report().overlapping_pairs, 0u);
  const ReliefSurface bent = must(rest->moved(must(deformable.moved(moved_positions(rest->base().mesh(), hairpin)))));
  EXPECT_GT(bent.report().overlapping_pairs, 0u);
  const ReliefSurface straight = must(bent.moved(
      must(deformable.moved({rest->base().mesh().positions().begin(), rest->base().mesh().positions().end()}))));
  EXPECT_EQ(straight.report().overlapping_pairs, 0u);
  for (std::uint32_t face = 0; face < straight.base().mesh().triangles().size(); ++face)
    EXPECT_FALSE(straight.overlapped(face));
}

/// All that a relief found out of itself is that of another one, bit for bit.
void expect_the_same(const ReliefSurface& one, const ReliefSurface& other) {
  EXPECT_EQ(one.shell().directions, other.shell().directions);
  EXPECT_EQ(one.reach(), other.reach());
  EXPECT_EQ(one.least_fillet(), other.least_fillet());
  EXPECT_EQ(one.boxes().farther, other.boxes().farther);
  EXPECT_EQ(one.skin(), other.skin());
  const ReliefReport& report = one.report();
  const ReliefReport& same = other.report();
  EXPECT_EQ(report.faces_at_fault, same.faces_at_fault);
  EXPECT_EQ(report.blind_vertices, same.blind_vertices);
  EXPECT_EQ(report.fitting_share, same.fitting_share);
  EXPECT_EQ(report.lowered_vertices, same.lowered_vertices);
  EXPECT_EQ(report.least_share, same.least_share);
  EXPECT_EQ(report.directions_relaxed, same.directions_relaxed);
  EXPECT_EQ(report.overlapping_pairs, same.overlapping_pairs);
  const auto faces = static_cast<std::uint32_t>(one.base().mesh().triangles().size());
  Rng rng(5);
  for (std::uint32_t face = 0; face < faces; ++face) {
    ASSERT_EQ(one.range(face).lowest, other.range(face).lowest);
    ASSERT_EQ(one.range(face).highest, other.range(face).highest);
    ASSERT_EQ(one.overlapped(face), other.overlapped(face));
    for (std::size_t k = 0; k < 3; ++k) {
      ASSERT_EQ(one.frame(face).band.rho[k], other.frame(face).band.rho[k]);
      ASSERT_EQ(one.frame(face).band.look[k], other.frame(face).band.look[k]);
      ASSERT_EQ(one.frame(face).band.reach[k], other.frame(face).band.reach[k]);
    }
    const Vec3 at = test::random_barycentric(rng);
    ASSERT_EQ(one.point(one.frame(face), at[1], at[2]).point, other.point(other.frame(face), at[1], at[2]).point);
  }
  const auto expect_boxes = [](std::span<const BoxesOf8> boxes, std::span<const BoxesOf8> equal) {
    ASSERT_EQ(boxes.size(), equal.size());
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t k = 0; k < 8; ++k) {
          ASSERT_EQ(boxes[i].lower[axis][k], equal[i].lower[axis][k]);
          ASSERT_EQ(boxes[i].upper[axis][k], equal[i].upper[axis][k]);
        }
      }
    }
  };
  expect_boxes(one.boxes().leaves, other.boxes().leaves);
  expect_boxes(one.boxes().nodes, other.boxes().nodes);
}

TEST(ReliefRefit, HowTheBaseMovesItIsTheReliefBuiltAnew) {
  Rng rng(8);
  int lowered = 0;
  int turned = 0;
  int come_to_overlap = 0;
  for (int trial = 0; trial < 36; ++trial) {
    SCOPED_TRACE(trial);
    // Sheets have texture coordinates that are continuous: no seams. Elsewhere each face has its own.
    const bool sheet = trial % 2 == 0;
    const FoldMode folds = trial % 6 < 3 ? FoldMode::keep : trial % 6 < 5 ? FoldMode::round : FoldMode::fillet;
    MeshSource source =
        sheet ? plane_grid(0.06, 0.04, 16, 10) : random_closed_mesh(static_cast<std::uint64_t>(trial), 2, 0.02, 0.1);
    const double amplitude = rng.uniform(0.1e-3, 1.5e-3);
    const auto rest = test::coated(std::move(source), test::wavy_map(amplitude),
                                   sheet ? Mapping::uv : Mapping::per_face, 0.01, 1.0, of(folds));
    DeformableMesh deformable(rest->base());
    const double bump = rng.uniform(0.0, 1.5e-3);
    const double bend = trial % 3 == 0 ? rng.uniform(60.0, 110.0) : rng.uniform(0.0, 20.0);  // 1/m
    const auto move = [&](const Vec3& p) {
      // Rolled up about y: the ends of the sheet may come to meet.
      const double angle = bend * p.x();
      const double radius = 1.0 / std::max(bend, 1e-3) - p.z();
      return Vec3(Vec3(radius * std::sin(angle), p.y(), -radius * std::cos(angle)) + test::random_point(rng, bump));
    };
    for (int step = 0; step < 2; ++step) {
      const MeshSurface base = must(deformable.moved(moved_positions(rest->base().mesh(), move)));
      const ReliefSurface built(base, rest->coat());
      const ReliefSurface moved = must(rest->moved(base));
      expect_the_same(moved, built);
      // Nor does it matter where it comes from.
      expect_the_same(must(moved.moved(base)), built);
      lowered += moved.report().lowered_vertices > 0;
      turned += moved.report().directions_relaxed;
      come_to_overlap += !rest->overlaps() && moved.overlaps();
    }
  }
  EXPECT_GT(lowered, 5);
  EXPECT_GT(turned, 0);
  EXPECT_GT(come_to_overlap, 5);
}

TEST(ReliefRefit, BoundsHoldTheReliefOfAMappingByPlaces) {
  Rng rng(9);
  Fixture fixture(Mapping::triplanar);
  const ReliefSurface moved = fixture.moved_by([&](const Vec3& p) { return waved(p + test::random_point(rng, 2e-4)); });
  const FacePart whole = FacePart::triangle({0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0});
  for (std::uint32_t face = 0; face < moved.base().mesh().triangles().size(); ++face) {
    const ReliefFrame frame = moved.frame(face);
    const HeightForm form = moved.form(frame, whole);
    for (int i = 0; i < 20; ++i) {
      const Vec3 at = test::random_barycentric(rng);
      const double height = moved.height(frame, at[1], at[2]).height;
      EXPECT_GE(height, moved.range(face).lowest);
      EXPECT_LE(height, moved.range(face).highest);
      EXPECT_LE(std::abs(height - form.height - form.u * (at[1] - 1.0 / 3.0) - form.v * (at[2] - 1.0 / 3.0)),
                form.error + 1e-15);
    }
  }
}

TEST(ReliefRefit, ManyThreadsMayMoveOneRelief) {
  Fixture fixture(Mapping::triplanar);
  const MeshSurface base = must(fixture.deformable.moved(moved_positions(fixture.rest->base().mesh(), waved)));
  std::vector<std::optional<ReliefSurface>> moved(4);
  std::vector<std::thread> threads;
  for (auto& one : moved) {
    threads.emplace_back([&] {
      EXPECT_GT(fixture.rest->memory_bytes(), 0u);
      one = must(fixture.rest->moved(base));
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& one : moved) expect_the_same(*one, *moved[0]);
}

TEST(ReliefRefit, HoweverManyThreadsThereAreItIsTheSame) {
  // Large enough to be shared out; where threads are shared out already, each loop within stays in one.
  for (const FoldMode folds : {FoldMode::keep, FoldMode::round, FoldMode::fillet}) {
    for (const ShellDirections directions : {ShellDirections::least_squares, ShellDirections::relaxed}) {
      const Mapping mapping = folds == FoldMode::keep ? Mapping::triplanar : Mapping::per_face;
      const auto laid = test::coated(icosphere(4, 0.05), test::wavy_map(0.2e-3), mapping, 0.01, 1.0, of(folds));
      const ReliefSurface rest = must(ReliefSurface::build(laid->base(), laid->coat(), {.directions = directions}));
      DeformableMesh deformable(rest.base());
      const MeshSurface base = must(deformable.moved(moved_positions(rest.base().mesh(), waved)));
      const ReliefSurface shared = must(rest.moved(base));
      std::vector<std::optional<ReliefSurface>> alone(2);
      parallel_for(2, {.threads = 2}, [&](std::size_t i) { alone[i] = must(rest.moved(base)); });
      expect_the_same(*alone[0], shared);
      EXPECT_EQ(shared.report().directions_relaxed, directions == ShellDirections::relaxed);
    }
  }
}

TEST(ReliefRefit, OlderSnapshotsGoOnAnswering) {
  Fixture fixture(Mapping::triplanar);
  SurfaceCache cache;
  std::vector<ReliefSurface> held;
  std::vector<double> distance;
  const Vec3 p(0.01, 0.05, 0.02);
  for (int i = 0; i < 5; ++i) {
    held.push_back(fixture.moved_by([&](const Vec3& at) { return Vec3((1.0 + 0.1 * i) * at); }));
    SurfaceCache fresh;
    distance.push_back(held.back().view(fresh).nearest(p, infinity).distance);
  }
  // One cache for all of them in turn: what it remembers of another is never read.
  for (std::size_t i = held.size(); i-- > 0;) EXPECT_EQ(held[i].view(cache).nearest(p, infinity).distance, distance[i]);
  SurfaceCache fresh;
  EXPECT_NEAR(fixture.rest->view(cache).nearest(p, infinity).distance,
              fixture.rest->view(fresh).nearest(p, infinity).distance, 1e-15);
}

TEST(ReliefRefit, SettingsAreAskedForAgain) {
  const TriangleMesh mesh = test::mesh_of(plane_grid(0.1, 0.02, 20, 4));
  const Coat coat = test::coat_on(mesh, test::wavy_map(1e-3), Mapping::per_face);
  ReliefSettings refuse;
  refuse.on_overlap = OnOverlap::refuse;
  const ReliefSurface flat = must(ReliefSurface::build(MeshSurface(TriangleIndex::build(mesh)), coat, refuse));
  DeformableMesh deformable(flat.base());
  // A roll so tight that the inner side has no room for a millimetre.
  const auto rolled = moved_positions(mesh, [](const Vec3& p) {
    return Vec3(6e-4 * std::sin(p.x() / 6e-4 * 0.05), p.y(), 6e-4 * std::cos(p.x() / 6e-4 * 0.05));
  });
  const auto refused = flat.moved(must(deformable.moved(rolled)));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::bad_mesh);
  EXPECT_NE(refused.error().message().find("folds over itself"), std::string::npos);
  ReliefSettings relaxed;
  relaxed.directions = ShellDirections::relaxed;
  const ReliefSurface other = must(ReliefSurface::build(flat.base(), coat, relaxed));
  EXPECT_TRUE(must(other.moved(flat.base())).report().directions_relaxed);
}

TEST(ReliefRefit, AStrangerIsRefused) {
  Fixture fixture(Mapping::triplanar);
  const auto other = test::bare(icosphere(2, 0.05));
  const auto moved = fixture.rest->moved(*other);
  ASSERT_FALSE(moved.ok());
  EXPECT_EQ(
      moved.error().message(),
      "base: is not the base of this relief with its vertices moved; accepted: a mesh that DeformableMesh made of "
      "the relief's own base");
}

TEST(ReliefRefit, IdentityIsItsOwn) {
  Fixture fixture(Mapping::triplanar);
  const ReliefSurface moved = must(fixture.rest->moved(fixture.rest->base()));
  EXPECT_NE(moved.identity(), fixture.rest->identity());
  EXPECT_EQ(moved.base().index().lineage(), fixture.rest->base().index().lineage());
  EXPECT_EQ(&moved.rest_mesh(), &fixture.rest->base().mesh());
}

TEST(MovedSurface, SignedDistanceFollowsTheVertices) {
  const auto rest = test::bare(icosphere(3, 0.05));
  DeformableMesh deformable(*rest);
  const MeshSurface twice =
      must(deformable.moved(moved_positions(rest->mesh(), [](const Vec3& p) { return Vec3(2.0 * p); })));
  SurfaceCache cache;
  EXPECT_LT(twice.eval(Vec3(0.0, 0.0, 0.09), cache).value, 0.0);
  EXPECT_GT(rest->eval(Vec3(0.0, 0.0, 0.09), cache).value, 0.0);
  EXPECT_NEAR(twice.eval(Vec3(0.0, 0.0, 0.12), cache).value, 0.02, 2e-3);
}

}  // namespace
}  // namespace asperity::relief_refit_test
