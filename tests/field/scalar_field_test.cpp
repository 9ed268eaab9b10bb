#include "asperity/field/volume/scalar_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>
#include <vector>

#include "asperity/field/volume/cubic_kernels.h"
#include "tests/field/volumes.h"

namespace asperity::test::scalar_field_test {
namespace {

TEST(GridAxis, LocatesEveryPlaceAsASearchDoes) {
  std::mt19937_64 generator(1);
  for (const double stretch : {0.0, 0.5, 0.98}) {
    const GridAxis axis = stretched_axis(-0.3, 0.7, 57, stretch);
    EXPECT_EQ(axis.is_uniform(), stretch == 0.0);
    std::uniform_real_distribution<double> place(-0.4, 0.8);
    for (int i = 0; i < 20000; ++i) {
      const double x = i < 57 ? axis.node(static_cast<std::uint32_t>(i)) : place(generator);
      const GridAxis::Place found = axis.locate(x);
      ASSERT_LT(found.cell, axis.cells());
      const double clamped = std::clamp(x, axis.front(), axis.back());
      const double back = axis.node(found.cell) + found.fraction * axis.width(found.cell);
      EXPECT_NEAR(back, clamped, 1e-12);
      EXPECT_GE(found.fraction, 0.0);
      EXPECT_LE(found.fraction, 1.0);
    }
  }
}

TEST(GridAxis, RefusesWhatIsNoAxis) {
  EXPECT_FALSE(GridAxis::build({1.0}));
  EXPECT_FALSE(GridAxis::build({}));
  EXPECT_EQ(GridAxis::build({0.0, 1.0, 1.0}).error().place, "node 2");
  EXPECT_EQ(GridAxis::build({0.0, std::nan(""), 1.0}).error().place, "node 1");
  EXPECT_FALSE(GridAxis::uniform(0.0, -1.0, 5));
  EXPECT_FALSE(GridAxis::uniform(0.0, 0.0, 5));
  EXPECT_FALSE(GridAxis::uniform(0.0, 1.0, 1));
}

TEST(GridAxis, SlopesAreExactForParabolasOnStretchedAxes) {
  const GridAxis axis = stretched_axis(0.0, 1.0, 12, 0.7);
  for (std::uint32_t i = 1; i + 1 < axis.size(); ++i) {
    double w[3];
    axis.slope_weights(i, w);
    double slope = 0.0;
    for (std::uint32_t n = 0; n < 3; ++n) {
      const double x = axis.node(i + n - 1);
      slope += w[n] * (3.0 * x * x - x + 2.0);
    }
    EXPECT_NEAR(slope, 6.0 * axis.node(i) - 1.0, 1e-10);
  }
}

TEST(GridAxis, CoarserLevelsKeepBothEnds) {
  for (const std::uint32_t count : {2U, 3U, 8U, 9U}) {
    const GridAxis axis = stretched_axis(0.0, 1.0, count, 0.4);
    const GridAxis half = axis.coarsened();
    EXPECT_EQ(half.front(), axis.front());
    EXPECT_EQ(half.back(), axis.back());
    EXPECT_EQ(half.size(), count == 2 ? 2U : count / 2 + 1);
  }
}

class EachReconstruction : public ::testing::TestWithParam<CellReconstruction> {};
INSTANTIATE_TEST_SUITE_P(Both, EachReconstruction,
                         ::testing::Values(CellReconstruction::trilinear, CellReconstruction::smooth));

TEST_P(EachReconstruction, PassesThroughEverySample) {
  for (const std::uint64_t seed : {1U, 2U}) {
    const auto field = random_field(9, GetParam(), seed);
    CellPolynomial cell;
    for (std::uint32_t k = 0; k < 9; ++k) {
      for (std::uint32_t j = 0; j < 9; ++j) {
        for (std::uint32_t i = 0; i < 9; ++i) {
          const Vec3 p(field->axes()[0].node(i), field->axes()[1].node(j), field->axes()[2].node(k));
          FieldJet jet;
          ASSERT_TRUE(field->sample(0, p, cell, jet));
          EXPECT_NEAR(jet.value, field->grid()->value(i, j, k), 1e-12);
        }
      }
    }
  }
}

TEST_P(EachReconstruction, T8_gradient_and_hessian_are_those_of_the_value) {
  const auto field = random_field(8, GetParam(), 5);
  std::mt19937_64 generator(2);
  CellPolynomial cell;
  for (int n = 0; n < 500; ++n) {
    const Vec3 p = random_point(generator, 0.0499);
    ASSERT_TRUE(field->load(0, field->cell_of(0, p), cell));
    const FieldJet jet = cell.jet(p);
    const FieldJet first = cell.gradient(p);
    EXPECT_DOUBLE_EQ(jet.value, cell.value(p));
    EXPECT_TRUE(first.gradient.isApprox(jet.gradient, 1e-12));
    const double step = 1e-7;
    for (int a = 0; a < 3; ++a) {
      Vec3 up = p;
      Vec3 down = p;
      up[a] += step;
      down[a] -= step;
      EXPECT_NEAR((cell.value(up) - cell.value(down)) / (2.0 * step), jet.gradient[a],
                  1e-6 * (1.0 + jet.gradient.norm()));
      const Vec3 change = (cell.gradient(up).gradient - cell.gradient(down).gradient) / (2.0 * step);
      EXPECT_TRUE((change - jet.hessian.col(a)).norm() < 1e-5 * (1.0 + jet.hessian.norm()));
    }
  }
}

/// Value and derivatives by Bernstein's form as it is written, in extended precision.
long double written_out(const CellPolynomial& cell, const Vec3& p, const std::array<int, 3>& derivatives) {
  const auto basis = [&](int degree, int i, long double u) {
    if (i < 0 || i > degree) return 0.0L;
    long double choose = 1.0L;
    for (int k = 0; k < i; ++k) choose = choose * (degree - k) / (k + 1);
    return choose * std::pow(u, static_cast<long double>(i)) * std::pow(1.0L - u, static_cast<long double>(degree - i));
  };
  const auto derived = [&](const auto& self, int degree, int i, long double u, int order) -> long double {
    if (order == 0) return basis(degree, i, u);
    return degree * (self(self, degree - 1, i - 1, u, order - 1) - self(self, degree - 1, i, u, order - 1));
  };
  const int n = cell.degree + 1;
  long double sum = 0.0L;
  for (int at = 0; at < n * n * n; ++at) {
    const int of[3] = {at % n, at / n % n, at / n / n};
    long double term = cell.coefficient[at];
    for (int a = 0; a < 3; ++a) {
      const int order = derivatives[static_cast<std::size_t>(a)];
      const long double width = cell.width[a];
      term *= derived(derived, cell.degree, of[a], (p[a] - static_cast<long double>(cell.lower[a])) / width, order) /
              std::pow(width, static_cast<long double>(order));
    }
    sum += term;
  }
  return sum;
}

TEST_P(EachReconstruction, JetsAreBernsteinsFormAsItIsWritten) {
  std::mt19937_64 generator(19);
  for (const std::uint64_t seed : {4U, 5U}) {
    const auto field = random_field(6, GetParam(), seed, 0.8);
    CellPolynomial cell;
    for (int n = 0; n < 300; ++n) {
      ASSERT_TRUE(field->load(0, field->cell_of(0, random_point(generator, 0.05)), cell));
      const Vec3 p = cell.lower + (random_point(generator, 0.6).array() + 0.5).matrix().cwiseProduct(cell.width);
      const FieldJet jet = cell.jet(p);
      const FieldJet first = cell.gradient(p);
      const double per = 1.0 / cell.width.minCoeff();
      EXPECT_NEAR(jet.value, static_cast<double>(written_out(cell, p, {0, 0, 0})), 1e-13);
      EXPECT_NEAR(first.value, jet.value, 1e-14);
      EXPECT_EQ(first.hessian, Mat3::Zero());
      for (int a = 0; a < 3; ++a) {
        std::array<int, 3> along{};
        ++along[static_cast<std::size_t>(a)];
        EXPECT_NEAR(jet.gradient[a], static_cast<double>(written_out(cell, p, along)), 1e-13 * per);
        EXPECT_NEAR(first.gradient[a], jet.gradient[a], 1e-13 * per);
        for (int b = 0; b < 3; ++b) {
          std::array<int, 3> both = along;
          ++both[static_cast<std::size_t>(b)];
          EXPECT_NEAR(jet.hessian(a, b), static_cast<double>(written_out(cell, p, both)), 1e-12 * per * per);
        }
      }
    }
  }
}

TEST(SmoothField, WideAndPlainKernelsAgree) {
  std::mt19937_64 generator(29);
  const CubicKernels plain = plain_cubic_kernels();
  const auto field = random_field(6, CellReconstruction::smooth, 6, 0.8);
  CellPolynomial cell;
  for (int n = 0; n < 1000; ++n) {
    ASSERT_TRUE(field->load(0, field->cell_of(0, random_point(generator, 0.05)), cell));
    const Vec3 p = cell.lower + (random_point(generator, 0.6).array() + 0.5).matrix().cwiseProduct(cell.width);
    const double per = 1.0 / cell.width.minCoeff();
    FieldJet jet;
    FieldJet first;
    plain.jet(cell, p, jet);
    plain.gradient(cell, p, first);
    const FieldJet wide = cell.jet(p);
    EXPECT_NEAR(jet.value, wide.value, 1e-14);
    EXPECT_LT((jet.gradient - wide.gradient).norm(), 1e-14 * per);
    EXPECT_LT((jet.hessian - wide.hessian).norm(), 1e-13 * per * per);
    EXPECT_NEAR(first.value, jet.value, 1e-14);
    EXPECT_LT((first.gradient - jet.gradient).norm(), 1e-14 * per);
    EXPECT_NEAR(plain.value(cell, p), cell.value(p), 1e-14);
    CellPolynomial::Places places;
    for (std::size_t a = 0; a < 3; ++a) places[a].fill(p[static_cast<int>(a)]);
    Lanes values;
    plain.values(cell, places, values);
    for (const double value : values) EXPECT_NEAR(value, jet.value, 1e-13);
    CellRanges ranges;
    plain.ranges(cell.coefficient, ranges);
    EXPECT_EQ(ranges.low, cell.low());
    EXPECT_EQ(ranges.high, cell.high());
  }
}

TEST_P(EachReconstruction, BoundsHoldTheFieldAndItsSlopes) {
  const auto field = random_field(7, GetParam(), 11);
  std::mt19937_64 generator(3);
  CellPolynomial cell;
  double most = 0.0;
  for (int n = 0; n < 3000; ++n) {
    const Vec3 p = random_point(generator, 0.05);
    ASSERT_TRUE(field->load(0, field->cell_of(0, p), cell));
    const FieldJet jet = cell.jet(p);
    EXPECT_LE(cell.low(), jet.value + 1e-12);
    EXPECT_GE(cell.high(), jet.value - 1e-12);
    const Vec3 d = random_point(generator, 1.0);
    double least = 0.0;
    double greatest = 0.0;
    cell.slope_range(d, least, greatest);
    EXPECT_LE(least, jet.gradient.dot(d) + 1e-9);
    EXPECT_GE(greatest, jet.gradient.dot(d) - 1e-9);
    const Vec3 unit = d.normalized();
    EXPECT_LE((jet.hessian * unit).norm(), cell.most_bend() + 1e-9);
    most = std::max(most, (jet.hessian * unit).norm() / cell.most_bend());
  }
  // No looser than what Bernstein's form and the sum over directions make of it.
  EXPECT_GE(most, 0.3);
}

TEST(SmoothField, GradientIsContinuousAcrossCellFacesOfStretchedGrids) {
  const auto field = random_field(8, CellReconstruction::smooth, 21, 0.6);
  std::mt19937_64 generator(4);
  CellPolynomial one;
  CellPolynomial other;
  for (int n = 0; n < 2000; ++n) {
    Vec3 p = random_point(generator, 0.0499);
    const int axis = n % 3;
    CellIndex cell = field->cell_of(0, p);
    if (cell.at[axis] + 1 >= field->axes()[0].cells()) continue;
    p[axis] = field->axes()[static_cast<std::size_t>(axis)].node(cell.at[axis] + 1);
    ASSERT_TRUE(field->load(0, cell, one));
    ++cell.at[axis];
    ASSERT_TRUE(field->load(0, cell, other));
    EXPECT_NEAR(one.value(p), other.value(p), 1e-11);
    EXPECT_LT((one.gradient(p).gradient - other.gradient(p).gradient).norm(), 1e-8 * one.gradient(p).gradient.norm());
  }
}

TEST(SmoothField, IsExactForParabolasAwayFromTheBorder) {
  const auto f = [](const Vec3& p) { return 3.0 * p.x() * p.x() - p.y() * p.z() + 2.0 * p.z() * p.z() + p.x(); };
  const ScalarField field(sampled(cube_axes(1.0, 24, 0.5), f));
  std::mt19937_64 generator(6);
  CellPolynomial cell;
  for (int n = 0; n < 2000; ++n) {
    const Vec3 p = random_point(generator, 0.8);
    FieldJet jet;
    ASSERT_TRUE(field.sample(0, p, cell, jet));
    // Samples are stored in single precision.
    EXPECT_NEAR(jet.value, f(p), 2e-6);
  }
}

TEST(ScalarField, IntegerSamplesAreTheirValues) {
  const GridAxis axis = *GridAxis::uniform(0.0, 1.0, 4);
  std::vector<std::int16_t> wide(64);
  std::vector<std::uint8_t> narrow(64);
  for (std::size_t i = 0; i < 64; ++i) {
    wide[i] = static_cast<std::int16_t>(-3000 + 97 * static_cast<int>(i));
    narrow[i] = static_cast<std::uint8_t>(4 * i);
  }
  const ScalarField a(*ScalarGrid::build({axis, axis, axis}, SampleArray(wide)), CellReconstruction::trilinear);
  const ScalarField b(*ScalarGrid::build({axis, axis, axis}, SampleArray(narrow)), CellReconstruction::trilinear);
  EXPECT_EQ(a.lowest(), -3000.0);
  EXPECT_EQ(b.highest(), 252.0);
  CellPolynomial cell;
  FieldJet jet;
  ASSERT_TRUE(a.sample(0, Vec3(1, 2, 3), cell, jet));
  EXPECT_DOUBLE_EQ(jet.value, -3000.0 + 97.0 * (1 + 4 * 2 + 16 * 3));
  ASSERT_TRUE(b.sample(0, Vec3(1.5, 2, 3), cell, jet));
  EXPECT_DOUBLE_EQ(jet.value, 4.0 * (1.5 + 4 * 2 + 16 * 3));
}

TEST(ScalarField, KnowsNothingOutsideAndWhereSamplesAreMissing) {
  ScalarGrid whole = sampled(cube_axes(1.0, 10), [](const Vec3& p) {
    return p.x() > 0.5 && p.y() > 0.5 ? std::numeric_limits<double>::quiet_NaN() : p.norm();
  });
  EXPECT_GT(whole.unknown(), 0U);
  const ScalarField field(std::move(whole));
  CellPolynomial cell;
  FieldJet jet;
  EXPECT_FALSE(field.sample(0, Vec3(0.9, 0.9, 0.0), cell, jet));
  EXPECT_FALSE(field.sample(0, Vec3(1.1, 0.0, 0.0), cell, jet));
  EXPECT_TRUE(field.sample(0, Vec3(-0.5, -0.5, 0.0), cell, jet));
}

TEST(ScalarGrid, RefusesSamplesThatDoNotFit) {
  const GridAxes axes = cube_axes(1.0, 3);
  EXPECT_EQ(ScalarGrid::build(axes, SampleArray(std::vector<float>(26))).error().code, ErrorCode::mismatch);
  std::vector<float> samples(27, 1.0F);
  samples[14] = std::numeric_limits<float>::infinity();
  const Error infinite = ScalarGrid::build(axes, SampleArray(samples), "p").error();
  EXPECT_EQ(infinite.place, "p, sample (2, 1, 1)");
  EXPECT_FALSE(ScalarGrid::build(axes, SampleArray(std::vector<float>(27, std::nanf("")))));
}

TEST(Otsu, SplitsTwoClassesInTheMiddleOfTheGap) {
  const ScalarGrid grid = sampled(cube_axes(1.0, 20), [](const Vec3& p) { return p.norm() < 0.7 ? 10.0 : 2.0; });
  EXPECT_NEAR(otsu_threshold(grid), 6.0, 0.1);
}

/// Row M-2: the paper's grid, split as Fig. 3 says.
TEST(M_2_octree, splits_by_eight_then_four_then_two) {
  std::vector<ValueRange> ranges(258UL * 126 * 127);
  const MinMaxOctree tree = MinMaxOctree::build({258, 126, 127}, 1, std::move(ranges));
  // Halving 258, 126 and 127 down to single cells.
  EXPECT_EQ(tree.levels(), 10);
  std::vector<std::set<int>> splits(10);
  for (int level = 9; level > 0; --level) {
    for (std::uint32_t i = 0; i < tree.count(level, 0); ++i) {
      const std::uint32_t other[3] = {i, i % tree.count(level, 1), i % tree.count(level, 2)};
      MinMaxOctree::Node children[8];
      const MinMaxOctree::Node node{static_cast<std::uint8_t>(level), {other[0], other[1], other[2]}};
      const int count = tree.children(node, children);
      splits[static_cast<std::size_t>(level)].insert(count);
      // Children fill their parent.
      for (std::size_t a = 0; a < 3; ++a) {
        std::uint32_t first = ~0U;
        std::uint32_t last = 0;
        for (int c = 0; c < count; ++c) {
          first = std::min(first, tree.first_cell(children[c], a));
          last = std::max(last, tree.last_cell(children[c], a));
        }
        EXPECT_EQ(first, tree.first_cell(node, a));
        EXPECT_EQ(last, tree.last_cell(node, a));
      }
    }
  }
  for (int level = 9; level > 3; --level) EXPECT_EQ(splits[static_cast<std::size_t>(level)], std::set<int>{8});
  // One halving is left for 126 and 127 where 258 has two, and for some ranges of odd length none.
  std::set<int> last;
  for (int level = 1; level <= 3; ++level) {
    last.insert(splits[static_cast<std::size_t>(level)].begin(), splits[static_cast<std::size_t>(level)].end());
  }
  EXPECT_TRUE(last.count(4) == 1 && last.count(2) == 1);
}

/// Leaves of the octree that a threshold may cross, from the root down.
std::set<std::array<std::uint32_t, 3>> crossed_from_root(const ScalarField& field, double threshold) {
  const MinMaxOctree& tree = field.octree();
  std::set<std::array<std::uint32_t, 3>> leaves;
  std::vector<MinMaxOctree::Node> stack{tree.root()};
  while (!stack.empty()) {
    const MinMaxOctree::Node node = stack.back();
    stack.pop_back();
    if (!field.may_cross(0, node, threshold)) continue;
    if (node.level == 0) leaves.insert({node.at[0], node.at[1], node.at[2]});
    MinMaxOctree::Node children[8];
    const int count = tree.children(node, children);
    stack.insert(stack.end(), children, children + count);
  }
  return leaves;
}

/// Row M-2: the octree that is felt, on the paper's grid, against every cell of it. A cell whose corners lie on both
/// sides of the threshold is passed by the field, whatever lies between them; a leaf is where its cells say.
TEST(Rows, M2_OctreeThatIsFeltMissesNoCellOfThePapersGrid) {
  const GridAxes axes{stretched_axis(-0.1, 0.1, 259, 0.6), stretched_axis(-0.05, 0.05, 127, 0.0),
                      stretched_axis(-0.05, 0.05, 128, 0.8)};
  // Gentle sheets, and samples that stand out of them alone.
  std::mt19937_64 generator(4);
  ScalarGrid grid = sampled(axes, [&](const Vec3& p) {
    const double field = std::sin(60.0 * p.x()) * std::cos(90.0 * p.y()) + 0.5 * std::sin(120.0 * p.z());
    return generator() % 5000 == 0 ? field + 3.0 : field;
  });
  for (const CellReconstruction reconstruction : {CellReconstruction::trilinear, CellReconstruction::smooth}) {
    const ScalarField field(ScalarGrid(grid), reconstruction);
    const MinMaxOctree& tree = field.octree();
    const std::uint32_t wide = tree.leaf_cells();
    // Of the leaves 65, 32 and 32 along the axes every node is halved wherever it has two: by eight, then by four and
    // two.
    EXPECT_EQ(tree.count(0, 0), (258 + wide - 1) / wide);
    std::set<int> splits;
    for (int level = tree.levels() - 1; level > 0; --level) {
      for (std::uint32_t i = 0; i < tree.count(level, 0); ++i) {
        MinMaxOctree::Node children[8];
        splits.insert(tree.children({static_cast<std::uint8_t>(level), {i, i % tree.count(level, 1), 0}}, children));
      }
    }
    EXPECT_TRUE(splits.count(8) == 1 && splits.count(2) == 1);
    for (const double threshold : {0.01, 0.3, -1.2, 2.0}) {
      std::set<std::array<std::uint32_t, 3>> passed;
      for (std::uint32_t k = 0; k + 1 < axes[2].size(); ++k) {
        for (std::uint32_t j = 0; j + 1 < axes[1].size(); ++j) {
          for (std::uint32_t i = 0; i + 1 < axes[0].size(); ++i) {
            const bool above = grid.value(i, j, k) > threshold;
            bool both = false;
            for (std::uint32_t corner = 1; corner < 8 && !both; ++corner)
              both = (grid.value(i + (corner & 1U), j + (corner >> 1U & 1U), k + (corner >> 2U)) > threshold) != above;
            if (both) passed.insert({i / wide, j / wide, k / wide});
          }
        }
      }
      const auto leaves = crossed_from_root(field, threshold);
      EXPECT_GT(passed.size(), 100U);
      EXPECT_TRUE(std::includes(leaves.begin(), leaves.end(), passed.begin(), passed.end())) << threshold;
      // And it excludes what it is there to exclude: smooth cells look a sample farther, and overshoot.
      if (reconstruction == CellReconstruction::trilinear) {
        EXPECT_EQ(leaves, passed) << threshold;
      }
      EXPECT_LT(leaves.size(), std::size_t{65} * 32 * 32);
    }
  }
}

TEST_P(EachReconstruction, M_2_octree_excludes_no_cell_that_the_field_passes) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const auto field = random_field(23, GetParam(), seed, 0.8);
    std::mt19937_64 generator(seed);
    const MinMaxOctree& tree = field->octree();
    CellPolynomial cell;
    for (int n = 0; n < 20000; ++n) {
      const Vec3 p = random_point(generator, 0.05);
      const CellIndex index = field->cell_of(0, p);
      ASSERT_TRUE(field->load(0, index, cell));
      const double threshold = cell.value(p);
      const MinMaxOctree::Node node =
          tree.outermost(index.at, [&](const MinMaxOctree::Node& at) { return field->may_cross(0, at, threshold); });
      ASSERT_EQ(node.level, 0);
      ASSERT_TRUE(field->may_cross(0, node, threshold));
      for (std::size_t a = 0; a < 3; ++a) {
        EXPECT_LE(tree.first_cell(node, a), index.at[a]);
        EXPECT_GT(tree.last_cell(node, a), index.at[a]);
      }
    }
  }
}

TEST_P(EachReconstruction, FourPlacesSideBySideAreEachAsAlone) {
  std::mt19937_64 generator(9);
  const auto field = random_field(6, GetParam(), 3, 0.8);
  CellPolynomial cell;
  for (int n = 0; n < 2000; ++n) {
    ASSERT_TRUE(field->load(0, field->cell_of(0, random_point(generator, 0.05)), cell));
    CellPolynomial::Places places;
    Vec3 points[lanes];
    for (std::size_t l = 0; l < lanes; ++l) {
      points[l] = cell.lower + (random_point(generator, 0.6).array() + 0.5).matrix().cwiseProduct(cell.width);
      for (int a = 0; a < 3; ++a) places[static_cast<std::size_t>(a)][l] = points[l][a];
    }
    Lanes values;
    cell.values(places, values);
    for (std::size_t l = 0; l < lanes; ++l) ASSERT_NEAR(values[l], cell.value(points[l]), 1e-13);
  }
}

TEST_P(EachReconstruction, FindsTheFirstRootOfACellLikeFineSteps) {
  std::mt19937_64 generator(8);
  int found = 0;
  int double_roots = 0;
  for (int n = 0; n < 400; ++n) {
    const auto field = random_field(4, GetParam(), static_cast<std::uint64_t>(n), 0.3);
    CellPolynomial cell;
    ASSERT_TRUE(field->load(0, {{1, 1, 1}}, cell));
    for (int m = 0; m < 5; ++m) {
      const auto inside = [&] {
        return Vec3(cell.lower + (random_point(generator, 0.5).array() + 0.5).matrix().cwiseProduct(cell.width));
      };
      const Vec3 a = inside();
      const Vec3 b = inside();
      const double threshold = 0.3 * std::uniform_real_distribution<double>(-1.0, 1.0)(generator);
      const double sign = cell.value(a) >= threshold ? 1.0 : -1.0;
      double t = -1.0;
      const bool leaves = cell.leaves_sign(a, b, 0.0, 1.0, threshold, sign, t);
      const int steps = 4000;
      int first = steps + 1;
      for (int i = 0; i <= steps && first > steps; ++i) {
        if (sign * (cell.value(a + (b - a) * i / steps) - threshold) < 0.0) first = i;
      }
      if (first <= steps) {
        ASSERT_TRUE(leaves) << n << " " << m;
        EXPECT_NEAR(t, static_cast<double>(first) / steps, 1.5 / steps);
        ++found;
        double_roots += sign * (cell.value(b) - threshold) > 0.0 ? 1 : 0;
      } else if (leaves) {
        // Steps may miss a dip; the field itself must show it.
        EXPECT_LT(std::abs(cell.value(a + t * (b - a)) - threshold), 1e-4);
      }
    }
  }
  EXPECT_GT(found, 300);
  EXPECT_GT(double_roots, 10);
}

}  // namespace
}  // namespace asperity::test::scalar_field_test
