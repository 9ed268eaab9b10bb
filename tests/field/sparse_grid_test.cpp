#include "asperity/field/volume/sparse_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "asperity/field/volume/scalar_field.h"
#include "tests/field/sparse_grids.h"
#include "tests/field/volumes.h"

namespace asperity::sparse_grid_test {
namespace {

using test::random_point;

constexpr double voxel = 0.001;

/// A smooth potential whose trilinear interpolant is known node by node.
double wave(const Vec3& p) {
  return 0.02 * std::sin(90.0 * p.x()) + 0.01 * std::cos(70.0 * p.y() + 1.0) + 0.3 * p.z();
}

std::shared_ptr<const SparseGrid> wavy() {
  return test::sparse_grid(wave, test::cube(0.03), voxel, 0.05, 0.05);
}

/// The trilinear interpolant of f's nodes.
double oracle(const std::function<double(const Vec3&)>& f, const Vec3& p) {
  double sum = 0.0;
  const Vec3 at = (p / voxel).array().floor();
  for (int n = 0; n < 8; ++n) {
    double weight = 1.0;
    Vec3 node = at;
    for (int a = 0; a < 3; ++a) {
      const double u = p[a] / voxel - at[a];
      weight *= (n >> a & 1) != 0 ? u : 1.0 - u;
      node[a] += n >> a & 1;
    }
    sum += weight * f(voxel * node);
  }
  return sum;
}

TEST(SparseGrid, TrilinearEqualsTheNodesInterpolatedAndItsOwnSlope) {
  const auto grid = wavy();
  std::mt19937_64 generator(1);
  SparseHint hint;
  for (int n = 0; n < 20000; ++n) {
    const Vec3 p = random_point(generator, 0.03);
    const Potential here = grid->trilinear(p, hint);
    EXPECT_NEAR(here.value, oracle(wave, p), 1e-8);
    constexpr double d = 1e-7;
    for (int a = 0; a < 3; ++a) {
      const double u = p[a] / voxel;
      if (std::abs(u - std::round(u)) < 2e-4) continue;  // across a face the slope jumps
      const Vec3 move = d * Vec3::Unit(a);
      SparseHint other;
      const double slope = (grid->trilinear(p + move, other).value - grid->trilinear(p - move, other).value) / (2 * d);
      EXPECT_NEAR(here.gradient[a], slope, 1e-6);
    }
  }
}

TEST(SparseGrid, NodeGradientsAreCentreDifferencesInterpolated) {
  const auto grid = wavy();
  std::mt19937_64 generator(2);
  SparseHint hint;
  for (int n = 0; n < 5000; ++n) {
    const Vec3 p = random_point(generator, 0.03);
    const Potential here = grid->node_gradients(p, hint);
    EXPECT_NEAR(here.value, oracle(wave, p), 1e-8);
    for (int a = 0; a < 3; ++a) {
      const auto slope = [&](const Vec3& q) {
        const Vec3 step = voxel * Vec3::Unit(a);
        return (wave(q + step) - wave(q - step)) / (2 * voxel);
      };
      EXPECT_NEAR(here.gradient[a], oracle(slope, p), 1e-5);
    }
  }
}

TEST(SparseGrid, ClearGradientWeighsNodesByTheEighthPowerOfTheirSlopes) {
  const auto grid = wavy();
  std::mt19937_64 generator(3);
  SparseHint hint;
  double farthest = 0.0;
  for (int n = 0; n < 2000; ++n) {
    const Vec3 p = random_point(generator, 0.03);
    const auto difference = [&](const Vec3& q) {
      Vec3 slope;
      for (int a = 0; a < 3; ++a) {
        const Vec3 step = voxel * Vec3::Unit(a);
        slope[a] = (wave(q + step) - wave(q - step)) / (2 * voxel);
      }
      return slope;
    };
    const auto weight = [&](const Vec3& q) { return std::pow(difference(q).norm(), 8.0); };
    Vec3 expected;
    for (int a = 0; a < 3; ++a) {
      const auto weighed = [&](const Vec3& q) { return weight(q) * difference(q)[a]; };
      expected[a] = oracle(weighed, p) / oracle(weight, p);
    }
    const Vec3 clear = grid->clear_gradient(p, hint);
    EXPECT_LT((clear - expected).norm(), 1e-4 * expected.norm());
    farthest = std::max(farthest, (clear - grid->node_gradients(p, hint).gradient).norm() / expected.norm());
  }
  // Not the mean by another name.
  EXPECT_GT(farthest, 0.01);
  EXPECT_EQ(grid->clear_gradient(Vec3::Constant(100.0), hint), Vec3::Zero());
}

TEST(SparseGrid, BeyondTheBandLiesASideOfItsOwn) {
  const auto grid = test::sparse_ball(voxel, 0.004);
  SparseHint hint;
  EXPECT_FLOAT_EQ(static_cast<float>(grid->trilinear(Vec3::Zero(), hint).value), -0.004F);
  EXPECT_FLOAT_EQ(static_cast<float>(grid->trilinear(Vec3(0.05, 0, 0), hint).value), 0.004F);
  EXPECT_TRUE(grid->trilinear(Vec3::Zero(), hint).gradient.isZero());
  EXPECT_FLOAT_EQ(static_cast<float>(grid->trilinear(Vec3(1, 1, 1), hint).value), 0.004F);
  EXPECT_FLOAT_EQ(static_cast<float>(grid->trilinear(Vec3(std::nan(""), 0, 0), hint).value), 0.004F);
  // A cavity: outside again, though it cannot be reached from outside.
  const auto hollow = test::sparse_grid([](const Vec3& p) { return std::abs(p.norm() - 0.04) - 0.01; },
                                        test::cube(0.05), voxel, 0.004, 0.004);
  EXPECT_FLOAT_EQ(static_cast<float>(hollow->trilinear(Vec3::Zero(), hint).value), 0.004F);
  EXPECT_FLOAT_EQ(static_cast<float>(hollow->trilinear(Vec3(0.04, 0, 0), hint).value), -0.004F);
}

TEST(SparseGrid, TheValueIsContinuousIntoBricksThatAreNotStored) {
  const auto grid = test::sparse_ball(voxel, 0.004);
  SparseHint hint;
  std::mt19937_64 generator(3);
  for (int n = 0; n < 2000; ++n) {
    const Vec3 direction = random_point(generator, 1.0).normalized();
    double last = grid->trilinear(0.02 * direction, hint).value;
    for (double r = 0.02; r < 0.045; r += 1e-5) {
      const double value = grid->trilinear(r * direction, hint).value;
      // A unit slope, and a little for the kink at the band's end.
      ASSERT_LE(std::abs(value - last), 2e-5);
      last = value;
    }
  }
}

class EveryReconstruction : public ::testing::TestWithParam<CellReconstruction> {};

TEST_P(EveryReconstruction, EqualsTheSameSamplesOnADenseGrid) {
  const auto sparse = wavy();
  const ScalarField field(sparse, GetParam());
  const GridAxis axis = GridAxis::uniform(-0.032, voxel, 65).value();
  const ScalarField dense(test::sampled({axis, axis, axis}, wave), GetParam());
  std::mt19937_64 generator(4);
  CellPolynomial cell;
  CellPolynomial other;
  for (int n = 0; n < 5000; ++n) {
    const Vec3 p = random_point(generator, 0.028);
    FieldJet here;
    FieldJet there;
    ASSERT_TRUE(field.sample(0, p, cell, here));
    ASSERT_TRUE(dense.sample(0, p, other, there));
    EXPECT_NEAR(here.value, there.value, 1e-7);
    EXPECT_NEAR((here.gradient - there.gradient).norm(), 0.0, 1e-4);
  }
}

TEST_P(EveryReconstruction, NoBrickIsLeftOutThatAThresholdMayBeIn) {
  const ScalarField field(test::sparse_ball(voxel, 0.006), GetParam());
  std::mt19937_64 generator(5);
  std::uniform_real_distribution<double> any(-0.0059, 0.0059);
  CellPolynomial cell;
  int crossed = 0;
  for (int n = 0; n < 200000; ++n) {
    const Vec3 p = random_point(generator, 0.04);
    const double threshold = any(generator);
    if (!field.load(0, field.cell_of(0, p), cell) || cell.low() > threshold || cell.high() < threshold) continue;
    ++crossed;
    const auto node =
        field.octree().outermost(cell.cell.at, [&](const auto& n0) { return field.may_cross(0, n0, threshold); });
    // The bounds of a cell's polynomial may reach beyond its samples; its values may not.
    FieldJet jet;
    ASSERT_TRUE(field.sample(0, p, cell, jet));
    EXPECT_TRUE(field.may_cross(0, node, jet.value));
  }
  EXPECT_GT(crossed, 1000);
}

INSTANTIATE_TEST_SUITE_P(Both, EveryReconstruction,
                         ::testing::Values(CellReconstruction::trilinear, CellReconstruction::smooth),
                         [](const auto& test) {
                           return test.param == CellReconstruction::smooth ? "smooth" : "trilinear";
                         });

TEST(SparseGrid, TheLeastAndTheMostAreFoundInWhicheverBrickTheyAre) {
  SparseSource source = test::sparse_source(wave, test::cube(0.001), voxel, 0.041, 0.041);
  // Two bricks along each axis.
  std::erase_if(source.blocks, [](const SparseBlock& block) {
    return std::any_of(block.at.begin(), block.at.end(), [](std::int32_t at) { return at < 0 || at > 1; });
  });
  ASSERT_EQ(source.blocks.size(), 8U);
  const std::size_t middle = SparseBlock::index(4, 4, 4);
  for (std::size_t b = 0; b < source.blocks.size(); ++b) {
    // The wave itself stays between -0.04 and 0.04.
    float& value = source.blocks[b].value[middle];
    const float own = value;
    value = 0.045F;
    EXPECT_EQ(SparseGrid::build(source).value().highest(), 0.045F) << b;
    value = -0.045F;
    EXPECT_EQ(SparseGrid::build(source).value().lowest(), -0.045F) << b;
    value = own;
  }
}

TEST(SparseGrid, GoesThroughItsSourceUnchanged) {
  SparseSource source =
      test::sparse_source([](const Vec3& p) { return p.norm() - 0.01; }, test::cube(0.01), voxel, 0.004, 0.004);
  std::uint32_t number = 0;
  for (SparseBlock& block : source.blocks) {
    block.face.resize(SparseBlock::points);
    for (std::uint32_t& face : block.face) face = ++number;
  }
  source.blocks[3].material.resize(SparseBlock::points);
  source.blocks[3].material[7].stiffness = 300.0F;
  const SparseGrid grid = SparseGrid::build(source).value();
  EXPECT_TRUE(grid.has_faces());
  EXPECT_TRUE(grid.has_materials());
  EXPECT_EQ(grid.stiffest(), 300.0F);
  const SparseSource back = grid.source();
  ASSERT_EQ(back.blocks.size(), source.blocks.size());
  for (std::size_t b = 0; b < back.blocks.size(); ++b) {
    EXPECT_EQ(back.blocks[b].at, source.blocks[b].at);
    EXPECT_EQ(back.blocks[b].value, source.blocks[b].value);
    EXPECT_EQ(back.blocks[b].face, source.blocks[b].face);
    EXPECT_EQ(back.blocks[b].material.size(), source.blocks[b].material.size());
  }
  EXPECT_EQ(back.blocks[3].material[7].stiffness, 300.0F);
  EXPECT_TRUE(std::isnan(back.blocks[3].material[7].damping));
}

TEST(SparseGrid, TheNearestPointTellsTheFace) {
  SparseSource source =
      test::sparse_source([](const Vec3& p) { return p.norm() - 0.01; }, test::cube(0.01), voxel, 0.004, 0.004);
  const auto number = [](const Vec3& node) {
    return static_cast<std::uint32_t>(1000000.0 + node.x() + 100.0 * node.y() + 10000.0 * node.z());
  };
  for (SparseBlock& block : source.blocks) {
    block.face.resize(SparseBlock::points);
    for (int k = 0; k < 8; ++k) {
      for (int j = 0; j < 8; ++j) {
        for (int i = 0; i < 8; ++i)
          block.face[SparseBlock::index(i, j, k)] =
              number(Vec3(8 * block.at[0] + i, 8 * block.at[1] + j, 8 * block.at[2] + k));
      }
    }
  }
  const SparseGrid grid = SparseGrid::build(source).value();
  std::mt19937_64 generator(6);
  SparseHint hint;
  for (int n = 0; n < 2000; ++n) {
    const Vec3 p = 0.01 * random_point(generator, 1.0).normalized();
    EXPECT_EQ(grid.face(p, hint), number((p / voxel).array().round()));
  }
  EXPECT_EQ(grid.face(Vec3(1, 0, 0), hint), no_index);
}

TEST(SparseGrid, MaterialsAreInterpolatedAcrossBricks) {
  SparseSource source = test::sparse_source([](const Vec3& p) { return p.z(); }, test::cube(0.02), voxel, 0.02, 0.02);
  const auto stiffness = [](const Vec3& p) { return 500.0 + 1e4 * p.x() + 2e4 * p.y() * p.y(); };
  for (SparseBlock& block : source.blocks) {
    if (block.at[0] < 0) continue;  // there the surface's own
    block.material.resize(SparseBlock::points);
    for (int k = 0; k < 8; ++k) {
      for (int j = 0; j < 8; ++j) {
        for (int i = 0; i < 8; ++i) {
          const Vec3 p = voxel * Vec3(8 * block.at[0] + i, 8 * block.at[1] + j, 8 * block.at[2] + k);
          block.material[SparseBlock::index(i, j, k)].stiffness = static_cast<float>(stiffness(p));
        }
      }
    }
  }
  const SparseGrid grid = SparseGrid::build(source).value();
  PointMaterial own;
  own.stiffness = 100.0F;
  own.damping = 1.0F;
  std::mt19937_64 generator(7);
  SparseHint hint;
  for (int n = 0; n < 5000; ++n) {
    const Vec3 p = random_point(generator, 0.015);
    const PointMaterial m = grid.material(p, own, hint);
    EXPECT_EQ(m.damping, 1.0F);
    if (p.x() > 0.0) {
      EXPECT_NEAR(m.stiffness, oracle(stiffness, p), 1e-3);
    } else if (p.x() < -voxel) {
      EXPECT_EQ(m.stiffness, 100.0F);
    }
    if (p.x() < 0.0 && p.x() > -voxel) {
      const Vec3 q(0.0, p.y(), p.z());
      const double share = 1.0 + p.x() / voxel;
      EXPECT_NEAR(m.stiffness, 100.0 + share * (oracle(stiffness, q) - 100.0), 1e-2);
    }
  }
}

TEST(SparseGrid, AnEditSharesWhatItDoesNotTouch) {
  const auto grid = test::sparse_ball(voxel, 0.004);
  SparseSource source = grid->source();
  const std::size_t chosen = source.blocks.size() / 2;
  SparseBlock block = source.blocks[chosen];
  for (float& value : block.value) value += 0.0005F;
  const SparseGrid edited = grid->edited({block}).value();
  source.blocks[chosen] = block;
  const SparseGrid again = SparseGrid::build(source).value();
  EXPECT_NE(edited.identity(), grid->identity());
  SparseHint a;
  SparseHint b;
  SparseHint old;
  int shared = 0;
  int own = 0;
  std::mt19937_64 generator(8);
  for (int n = 0; n < 20000; ++n) {
    const Vec3 p = random_point(generator, 0.036);
    EXPECT_EQ(edited.trilinear(p, a).value, again.trilinear(p, b).value);
    EXPECT_TRUE(edited.node_gradients(p, a).gradient == again.node_gradients(p, b).gradient);
    // The very same brick, unless the edit reaches it or, by its repeated neighbours, one beside it.
    const double before = grid->trilinear(p, old).value;
    ASSERT_TRUE(std::isfinite(before));
    if (a.brick == nullptr) continue;
    int far = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const int at = static_cast<int>(std::floor((p - grid->origin())[axis] / (8.0 * voxel)));
      far = std::max(far, std::abs(at - block.at[static_cast<std::size_t>(axis)]));
    }
    if (far == 0) {
      EXPECT_NE(a.brick, old.brick);
      ++own;
    } else if (far > 1) {
      EXPECT_EQ(a.brick, old.brick);
      ++shared;
    }
  }
  EXPECT_GT(own, 3);
  EXPECT_GT(shared, 1000);
  SparseBlock elsewhere = block;
  elsewhere.at = {100, 0, 0};
  EXPECT_EQ(grid->edited({elsewhere}).error().code, ErrorCode::bad_value);
}

struct BadSource {
  const char* name;
  void (*spoil)(SparseSource&);
  const char* place;
};

class SparseGridErrors : public ::testing::TestWithParam<BadSource> {};

TEST_P(SparseGridErrors, AreNamed) {
  SparseSource source =
      test::sparse_source([](const Vec3& p) { return p.norm() - 0.01; }, test::cube(0.01), voxel, 0.004, 0.004);
  GetParam().spoil(source);
  const Result<SparseGrid> grid = SparseGrid::build(std::move(source));
  ASSERT_FALSE(grid);
  EXPECT_EQ(grid.error().place, GetParam().place);
  EXPECT_FALSE(grid.error().accepted.empty());
}

INSTANTIATE_TEST_SUITE_P(
    Each, SparseGridErrors,
    ::testing::Values(BadSource{"no_blocks", [](SparseSource& s) { s.blocks.clear(); }, "blocks"},
                      BadSource{"voxel", [](SparseSource& s) { s.voxel = 0.0; }, "voxel"},
                      BadSource{"origin", [](SparseSource& s) { s.origin.y() = infinity; }, "origin"},
                      BadSource{"outside", [](SparseSource& s) { s.outside = -1.0; }, "outside"},
                      BadSource{"inside", [](SparseSource& s) { s.inside = 1.0; }, "inside"},
                      BadSource{"value", [](SparseSource& s) { s.blocks[2].value[5] = NAN; }, "blocks[2].value[5]"},
                      BadSource{"twice", [](SparseSource& s) { s.blocks[4].at = s.blocks[1].at; }, "blocks[4]"},
                      BadSource{"faces", [](SparseSource& s) { s.blocks[1].face.resize(3); }, "blocks[1].face"},
                      BadSource{"materials", [](SparseSource& s) { s.blocks[1].material.resize(3); },
                                "blocks[1].material"},
                      BadSource{"stiffness",
                                [](SparseSource& s) {
                                  s.blocks[1].material.resize(512);
                                  s.blocks[1].material[9].stiffness = -1.0F;
                                },
                                "blocks[1].material[9].stiffness"},
                      BadSource{"far_apart",
                                [](SparseSource& s) {
                                  s.blocks[0].at = {-1000000, -1000000, -1000000};
                                  s.blocks[1].at = {1000000, 1000000, 1000000};
                                },
                                "blocks"},
                      BadSource{"farther",
                                [](SparseSource& s) {
                                  s.blocks[0].at = {1 << 30, 0, 0};
                                },
                                "blocks[0]"}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace asperity::sparse_grid_test
