#include <gtest/gtest.h>

#include <cmath>

#include "asperity/surface/iso/kept_cells.h"
#include "asperity/surface/iso/surface.h"
#include "tests/field/volumes.h"

namespace asperity::test::iso_nearest_test {
namespace {

/// So steep that it bulges within cells.
IsoSurface rough_surface(std::uint32_t count, CellReconstruction reconstruction, std::uint64_t seed, double threshold) {
  return IsoSurface::build(random_field(count, reconstruction, seed, 0.4), threshold, Inside::high).value();
}

class IsoNearest : public ::testing::TestWithParam<CellReconstruction> {};
INSTANTIATE_TEST_SUITE_P(Both, IsoNearest,
                         ::testing::Values(CellReconstruction::trilinear, CellReconstruction::smooth));

// A surface may bulge within one cell, towards a place from where no way to the cell's corners meets it.
TEST_P(IsoNearest, TheNearestPlaceIsAsNearAsWhatRaysMeet) {
  std::normal_distribution<double> normal;
  int seen = 0;
  int missed = 0;
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    const IsoSurface surface = rough_surface(14, GetParam(), seed, 0.35);
    SurfaceCache cache;
    const IsoView view = surface.view(cache);
    std::mt19937_64 generator(seed + 100);
    for (int i = 0; i < 200; ++i) {
      const Vec3 p = random_point(generator, 0.045);
      double nearest = 0.02;
      const Foot foot = view.nearest(p, nearest);
      const Foot exact = view.nearest_exactly(p, nearest);
      for (int ray = 0; ray < 1500; ++ray) {
        const Vec3 way = Vec3(normal(generator), normal(generator), normal(generator)).normalized();
        const IsoCrossing crossing = view.first_crossing({p, p + nearest * way});
        if (crossing.found) nearest *= crossing.t;
      }
      if (!(nearest < 0.02)) continue;
      ++seen;
      // A walk ends a share of a cell off.
      missed += foot.found() && foot.distance <= nearest + 1e-9 ? 0 : 1;
      missed += exact.found() && exact.distance <= (1.0 + 1e-9) * nearest ? 0 : 1;
    }
  }
  EXPECT_GT(seen, 700);
  EXPECT_EQ(missed, 0);
}

// As a ball asks: from the last foot, of a place near the last one or the same once more, within this or that bound.
TEST_P(IsoNearest, WhatIsKeptChangesNeitherAnswersNorWhatTheyTake) {
  std::mt19937_64 generator(5);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  int found = 0;
  int again = 0;
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    const IsoSurface surface = rough_surface(14, GetParam(), seed, 0.3);
    KeptCells kept;
    WorkMeter with;
    WorkMeter without;
    SurfaceCache cache;
    cache.cells.kept = &kept;
    cache.work = &with;
    Place start;
    Vec3 p = random_point(generator, 0.04);
    for (int i = 0; i < 600; ++i) {
      const double radius = 1e-3 + 4e-3 * share(generator);
      const double bound = share(generator) < 0.5 ? 0.02 : radius;
      const bool same = i > 0 && share(generator) < 0.4;
      if (!same) p = share(generator) < 0.05 ? random_point(generator, 0.04) : Vec3(p + random_point(generator, 1e-4));
      with.begin(0);
      without.begin(0);
      SurfaceCache none;
      none.work = &without;
      const Foot foot = surface.view(cache).nearest_exactly(p, bound, start);
      const Foot other = surface.view(none).nearest_exactly(p, bound, start);
      ASSERT_EQ(foot.found(), other.found());
      ASSERT_EQ(foot.point, other.point) << seed << " " << i;
      ASSERT_EQ(foot.normal, other.normal);
      ASSERT_EQ(foot.distance, other.distance);
      ASSERT_EQ(foot.element, other.element);
      ASSERT_EQ(with.done().sum(), without.done().sum()) << seed << " " << i;
      found += foot.found() ? 1 : 0;
      again += foot.found() && same ? 1 : 0;
      if (foot.found() && share(generator) < 0.8) start = {foot.element, false, foot.at};
    }
  }
  EXPECT_GT(found, 900);
  EXPECT_GT(again, 300);
}

// With gradients that are continuous, the way to a foot is along the surface's normal.
TEST(IsoNearestExactly, TellsTheDirectionToRounding) {
  std::mt19937_64 generator(7);
  int found = 0;
  double most = 0.0;
  double most_as_walked = 0.0;
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    const IsoSurface surface = rough_surface(12, CellReconstruction::smooth, seed, 0.3);
    SurfaceCache cache;
    const IsoView view = surface.view(cache);
    for (int i = 0; i < 200; ++i) {
      const Vec3 p = random_point(generator, 0.035);
      const Foot foot = view.nearest_exactly(p, 0.01);
      const Foot walked = view.nearest(p, 0.01);
      if (!foot.found() || foot.distance < 1e-3) continue;
      const CellPolynomial* cell = view.over(foot.point);
      if (cell == nullptr || !cell->has_well_inside(foot.point)) continue;
      ++found;
      most = std::max(most, (p - foot.point).normalized().cross(foot.normal).norm());
      most_as_walked = std::max(most_as_walked, (p - walked.point).normalized().cross(walked.normal).norm());
    }
  }
  EXPECT_GT(found, 300);
  EXPECT_LT(most, 1e-8);
  EXPECT_GT(most_as_walked, 1e-6);
}

}  // namespace
}  // namespace asperity::test::iso_nearest_test
