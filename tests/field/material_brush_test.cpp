#include "asperity/field/volume/material_brush.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "asperity/core/rng.h"
#include "tests/field/sparse_grids.h"

namespace asperity::material_brush_test {
namespace {

constexpr double voxel = 1e-3;
constexpr float unset = PointMaterial::own;

const PointMaterial& own() {
  static const PointMaterial material{1000.0F, 2.0F, 0.5F, 0.3F, 1.0F};
  return material;
}

/// A ball of 16 mm.
const SparseGrid& ball() {
  static const auto grid = test::sparse_grid([](const Vec3& p) { return test::ball_distance(p, 0.016); },
                                             test::cube(0.016), voxel, 3.0 * voxel, 3.0 * voxel);
  return *grid;
}

PointMaterial only(std::size_t channel, float value) {
  PointMaterial material;
  material.set(channel, value);
  return material;
}

MaterialBrush brush(const Vec3& centre, double radius, double falloff, const PointMaterial& material) {
  return {centre, radius, falloff, material};
}

SparseGrid must_paint(const std::vector<MaterialBrush>& brushes, const SparseGrid& grid = ball()) {
  Result<SparseGrid> result = painted(grid, brushes, own());
  EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().message());
  return std::move(result).value();
}

Error must_fail(const std::vector<MaterialBrush>& brushes, const PointMaterial& base = own()) {
  const Result<SparseGrid> result = painted(ball(), brushes, base);
  EXPECT_FALSE(result.ok());
  return result.ok() ? Error{} : result.error();
}

PointMaterial at(const SparseGrid& grid, const Vec3& p) {
  SparseHint hint;
  return grid.material(p, own(), hint);
}

/// From 0 to 1 without a kink at either end: de Casteljau's way along 0, 0, 1, 1.
double eased(double t) {
  std::array<double, 4> row = {0.0, 0.0, 1.0, 1.0};
  for (std::size_t left = 3; left > 0; --left) {
    for (std::size_t i = 0; i < left; ++i) row[i] += t * (row[i + 1] - row[i]);
  }
  return row[0];
}

/// What a stored point has after brushes of stiffness alone: each takes it nearer to its own, by how deep in it it is.
double stiffness_after(const std::vector<MaterialBrush>& brushes, const Vec3& node) {
  double stiffness = static_cast<double>(own().stiffness);
  for (const MaterialBrush& b : brushes) {
    const double distance = (node - b.centre).norm();
    if (distance > b.radius) continue;
    const double share = distance <= b.radius - b.falloff ? 1.0 : eased((b.radius - distance) / b.falloff);
    stiffness = share * static_cast<double>(b.material.stiffness) + (1.0 - share) * stiffness;
  }
  return stiffness;
}

TEST(MaterialBrush, IsFeltAsTheStoredPointsInterpolated) {
  const std::vector<MaterialBrush> brushes = {brush({0.016, 0.0, 0.0}, 8e-3, 5e-3, only(0, 200.0F)),
                                              brush({0.014, 0.006, 0.0}, 5e-3, 5e-3, only(0, 3000.0F))};
  const SparseGrid grid = must_paint(brushes);
  ASSERT_TRUE(grid.has_materials());
  Rng rng(3);
  double softest = 1e9;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 d = Vec3(1.0, rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)).normalized();
    const Vec3 p = (0.016 + rng.uniform(-1.0, 1.0) * voxel) * d;
    double expected = 0.0;
    const Vec3 cell = (p / voxel).array().floor();
    for (int n = 0; n < 8; ++n) {
      const Vec3 node = cell + Vec3(n & 1, n >> 1 & 1, n >> 2);
      const Vec3 share = Vec3::Ones() - (p / voxel - node).cwiseAbs();
      expected += share.prod() * stiffness_after(brushes, voxel * node);
    }
    const PointMaterial felt = at(grid, p);
    EXPECT_NEAR(static_cast<double>(felt.stiffness), expected, 1e-3);
    // The other channels are the surface's own.
    EXPECT_EQ(felt.damping, own().damping);
    EXPECT_EQ(felt.roughness, own().roughness);
    softest = std::min(softest, expected);
  }
  EXPECT_LT(softest, 400.0);
}

TEST(MaterialBrush, LeavesValuesAndFacesAsTheyAre) {
  const SparseGrid grid = must_paint({brush({0.0, 0.0, 0.016}, 5e-3, 0.0, only(1, 9.0F))});
  const SparseSource before = ball().source();
  const SparseSource after = grid.source();
  ASSERT_EQ(before.blocks.size(), after.blocks.size());
  for (std::size_t b = 0; b < before.blocks.size(); ++b) EXPECT_EQ(before.blocks[b].value, after.blocks[b].value);
}

TEST(MaterialBrush, FadesSteadilyFromItsMiddleToItsRim) {
  const Vec3 centre(0.016, 0.0, 0.0);
  const SparseGrid grid = must_paint({brush(centre, 7e-3, 6e-3, only(0, 100.0F))});
  // Along the surface, at the nodes' own places.
  SparseSource source = grid.source();
  std::vector<std::pair<double, float>> seen;
  for (const SparseBlock& block : source.blocks) {
    for (std::size_t n = 0; n < block.material.size(); ++n) {
      const Vec3 node = voxel * Vec3(8.0 * block.at[0] + static_cast<double>(n % 8),
                                     8.0 * block.at[1] + static_cast<double>(n / 8 % 8),
                                     8.0 * block.at[2] + static_cast<double>(n / 64));
      const double distance = (node - centre).norm();
      if (distance >= 7e-3) {
        EXPECT_TRUE(std::isnan(block.material[n].stiffness)) << distance;
      } else {
        seen.emplace_back(distance, block.material[n].stiffness);
      }
    }
  }
  ASSERT_GT(seen.size(), 200U);
  std::sort(seen.begin(), seen.end());
  EXPECT_EQ(seen.front().second, 100.0F);
  EXPECT_GT(seen.back().second, 900.0F);
  for (std::size_t i = 1; i < seen.size(); ++i) EXPECT_GE(seen[i].second, seen[i - 1].second - 1e-3F);
}

TEST(MaterialBrush, WithoutFalloffEndsAtItsRadius) {
  const SparseGrid grid = must_paint({brush({0.016, 0.0, 0.0}, 3e-3, 0.0, only(0, 100.0F))});
  EXPECT_FLOAT_EQ(at(grid, Vec3(0.016, 0.003, 0.0)).stiffness, 100.0F);
  EXPECT_FLOAT_EQ(at(grid, Vec3(0.016, 0.004, 0.0)).stiffness, 1000.0F);
}

TEST(MaterialBrush, TheLaterOneLiesOnTop) {
  const MaterialBrush soft = brush({0.016, 0.0, 0.0}, 5e-3, 0.0, only(0, 100.0F));
  const MaterialBrush hard = brush({0.016, 0.0, 0.0}, 5e-3, 0.0, only(0, 5000.0F));
  const MaterialBrush sticky = brush({0.016, 0.0, 0.0}, 5e-3, 0.0, PointMaterial{unset, unset, 0.9F, 0.8F, unset});
  const Vec3 p(0.016, 0.0, 0.0);
  EXPECT_FLOAT_EQ(at(must_paint({soft, hard}), p).stiffness, 5000.0F);
  EXPECT_FLOAT_EQ(at(must_paint({hard, soft}), p).stiffness, 100.0F);
  // Channels that a brush leaves open keep what was there; laid on in two goes it is the same.
  const PointMaterial both = at(must_paint({soft, sticky}), p);
  EXPECT_FLOAT_EQ(both.stiffness, 100.0F);
  EXPECT_FLOAT_EQ(both.static_friction, 0.9F);
  const SparseGrid first = must_paint({soft});
  const PointMaterial again = at(must_paint({sticky}, first), p);
  EXPECT_EQ(again.stiffness, both.stiffness);
  EXPECT_EQ(again.static_friction, both.static_friction);
}

TEST(MaterialBrush, FadesToWhatLiesBelowNotToTheSurfacesOwn) {
  const Vec3 centre(0.016, 0.0, 0.0);
  const MaterialBrush below = brush(centre, 10e-3, 0.0, only(0, 200.0F));
  const MaterialBrush above = brush(centre, 5e-3, 5e-3, only(0, 400.0F));
  const SparseGrid grid = must_paint({below, above});
  // Half way out smoothstep is 1/2; node (16, 0, 0) is the middle, so take one at 2.5 mm from a centre between nodes.
  const SparseGrid shifted = must_paint({below, brush({0.016, 0.0005, 0.0}, 5e-3, 5e-3, only(0, 400.0F))});
  EXPECT_NEAR(static_cast<double>(at(shifted, Vec3(0.016, 0.003, 0.0)).stiffness), 300.0, 1e-3);
  EXPECT_FLOAT_EQ(at(grid, Vec3(0.016, 0.005, 0.0)).stiffness, 200.0F);
}

TEST(MaterialBrush, AFrictionThatDoesNotFitIsRefusedWhereItDoesNot) {
  const Vec3 centre(0.016, 0.0, 0.0);
  // Below the surface's own dynamic one.
  const Error low = must_fail({brush(centre, 5e-3, 0.0, only(2, 0.2F))});
  EXPECT_EQ(low.place, "[0].static_friction");
  EXPECT_NE(low.what.find("0.2"), std::string::npos) << low.message();
  // A dynamic one above the surface's own static one.
  EXPECT_EQ(must_fail({brush(centre, 5e-3, 0.0, only(3, 0.6F))}).place, "[0].static_friction");
  // Together they fit, in either order: what counts is the end.
  must_paint({brush(centre, 5e-3, 2e-3, only(3, 0.6F)), brush(centre, 5e-3, 0.0, only(2, 0.7F))});
  must_paint({brush(centre, 5e-3, 0.0, only(2, 0.7F)), brush(centre, 5e-3, 2e-3, only(3, 0.6F))});
  // Where the second does not reach, the first does not fit; it is the one that is named.
  EXPECT_EQ(must_fail({brush(centre, 5e-3, 0.0, only(3, 0.6F)), brush(centre, 2e-3, 0.0, only(2, 0.7F))}).place,
            "[0].static_friction");
}

TEST(MaterialBrush, EqualFrictionsStayEqualWhereTheyFade) {
  const PointMaterial base{1000.0F, 0.0F, 0.3F, 0.3F, 1.0F};
  const std::vector<MaterialBrush> brushes = {
      brush({0.016, 0.0, 0.0}, 6e-3, 6e-3, PointMaterial{unset, unset, 0.71F, 0.71F, unset}),
      brush({0.015, 0.003, 0.0}, 6e-3, 6e-3, PointMaterial{unset, unset, 0.13F, 0.13F, unset})};
  const Result<SparseGrid> grid = painted(ball(), brushes, base);
  ASSERT_TRUE(grid.ok()) << grid.error().message();
  const SparseSource source = grid->source();
  for (const SparseBlock& block : source.blocks) {
    for (const PointMaterial& m : block.material) EXPECT_FALSE(m.static_friction < m.dynamic_friction);
  }
}

TEST(MaterialBrush, EveryMistakeHasItsMessage) {
  const Vec3 on(0.016, 0.0, 0.0);
  const MaterialBrush good = brush(on, 5e-3, 1e-3, only(0, 500.0F));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto inf = std::numeric_limits<float>::infinity();
  const struct {
    MaterialBrush wrong;
    const char* place;
  } cases[] = {
      {brush(Vec3(nan, 0.0, 0.0), 5e-3, 0.0, only(0, 500.0F)), "[1].centre"},
      {brush(on, 0.0, 0.0, only(0, 500.0F)), "[1].radius"},
      {brush(on, -1e-3, 0.0, only(0, 500.0F)), "[1].radius"},
      {brush(on, nan, 0.0, only(0, 500.0F)), "[1].radius"},
      {brush(on, infinity, 0.0, only(0, 500.0F)), "[1].radius"},
      {brush(on, 5e-3, 6e-3, only(0, 500.0F)), "[1].falloff"},
      {brush(on, 5e-3, -1e-3, only(0, 500.0F)), "[1].falloff"},
      {brush(on, 5e-3, nan, only(0, 500.0F)), "[1].falloff"},
      {brush(on, 5e-3, 0.0, only(0, 0.0F)), "[1].stiffness"},
      {brush(on, 5e-3, 0.0, only(0, -1.0F)), "[1].stiffness"},
      {brush(on, 5e-3, 0.0, only(0, inf)), "[1].stiffness"},
      {brush(on, 5e-3, 0.0, only(1, -0.1F)), "[1].damping"},
      {brush(on, 5e-3, 0.0, only(2, -0.1F)), "[1].static_friction"},
      {brush(on, 5e-3, 0.0, only(3, -0.1F)), "[1].dynamic_friction"},
      {brush(on, 5e-3, 0.0, only(4, -0.1F)), "[1].roughness"},
      {brush(on, 5e-3, 0.0, PointMaterial{}), "[1]"},
      {brush(Vec3(0.05, 0.0, 0.0), 5e-3, 0.0, only(0, 500.0F)), "[1]"},
      {brush(Vec3(0.0163, 0.0003, 0.0004), 0.2e-3, 0.0, only(0, 500.0F)), "[1]"},
  };
  for (const auto& c : cases) {
    const Error error = must_fail({good, c.wrong});
    EXPECT_EQ(error.code, ErrorCode::bad_value);
    EXPECT_EQ(error.place, c.place) << error.message();
    EXPECT_FALSE(error.what.empty());
    EXPECT_FALSE(error.accepted.empty()) << error.message();
  }
}

TEST(MaterialBrush, WhatItFadesToMustBeKnown) {
  PointMaterial base = own();
  base.stiffness = unset;
  const MaterialBrush soft = brush({0.016, 0.0, 0.0}, 5e-3, 5e-3, only(0, 500.0F));
  EXPECT_EQ(must_fail({soft}, base).place, "own.stiffness");
  base = own();
  base.damping = -1.0F;
  EXPECT_EQ(must_fail({soft}, base).place, "own.damping");
  // A texture without a level is felt as it is: 1.
  base = own();
  base.roughness = unset;
  const Result<SparseGrid> rough =
      painted(ball(), std::vector{brush({0.016, 0.0005, 0.0}, 5e-3, 5e-3, only(4, 3.0F))}, base);
  ASSERT_TRUE(rough.ok());
  EXPECT_NEAR(static_cast<double>(at(*rough, Vec3(0.016, 0.003, 0.0)).roughness), 2.0, 1e-5);
}

TEST(MaterialBrush, NoBrushChangesNothing) {
  const SparseGrid grid = must_paint({});
  EXPECT_FALSE(grid.has_materials());
  EXPECT_EQ(grid.memory_bytes(), ball().memory_bytes());
}

TEST(MaterialBrush, OnlyBricksThatItReachesTakeMemory) {
  // Within one block: the bricks whose cells may read its points are that one and seven beside it.
  const SparseGrid grid = must_paint({brush({0.012, 0.011, 0.004}, 1e-3, 0.0, only(0, 500.0F))});
  int with_material = 0;
  const SparseSource source = grid.source();
  for (const SparseBlock& block : source.blocks) with_material += block.material.empty() ? 0 : 1;
  EXPECT_EQ(with_material, 1);
  ASSERT_GT(grid.bricks(), 50U);
  const std::size_t more = grid.memory_bytes() - ball().memory_bytes();
  EXPECT_GE(more, SparseBlock::points * sizeof(PointMaterial));
  EXPECT_LE(more, 8 * 729 * sizeof(PointMaterial));
  // Elsewhere everything answers as before.
  SparseHint hint;
  SparseHint other;
  Rng rng(8);
  for (int i = 0; i < 500; ++i) {
    const Vec3 p(rng.uniform(-0.018, 0.0), rng.uniform(-0.018, 0.018), rng.uniform(-0.018, 0.018));
    EXPECT_EQ(grid.trilinear(p, hint).value, ball().trilinear(p, other).value);
    EXPECT_EQ(grid.material(p, own(), hint).stiffness, own().stiffness);
  }
}

}  // namespace
}  // namespace asperity::material_brush_test
