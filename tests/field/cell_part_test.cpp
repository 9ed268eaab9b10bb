#include "asperity/field/volume/cell_part.h"

#include <gtest/gtest.h>

#include <cmath>

#include "asperity/field/volume/cubic_kernels.h"
#include "tests/field/volumes.h"

namespace asperity::test::cell_part_test {
namespace {

class CellPartEach : public ::testing::TestWithParam<CellReconstruction> {
 protected:
  std::mt19937_64 generator{31};
  std::shared_ptr<const ScalarField> field = random_field(6, GetParam(), 6, 0.8);

  double share() { return std::uniform_real_distribution<double>(0.0, 1.0)(generator); }
  CellPolynomial any_cell() {
    CellPolynomial cell;
    EXPECT_TRUE(field->load(0, field->cell_of(0, random_point(generator, 0.05)), cell));
    return cell;
  }
  Vec3 within(const CellPart& part) {
    return part.low + Vec3(share(), share(), share()).cwiseProduct(part.high - part.low);
  }
  /// One of its halves, again and again.
  CellPart halved(CellPart part, int times) {
    for (int i = 0; i < times; ++i) {
      CellPart halves[2];
      part.halves(static_cast<int>(3.0 * share()), halves[0], halves[1]);
      part = halves[share() < 0.5 ? 0 : 1];
    }
    return part;
  }
};
INSTANTIATE_TEST_SUITE_P(Both, CellPartEach,
                         ::testing::Values(CellReconstruction::trilinear, CellReconstruction::smooth));

TEST_P(CellPartEach, HalvesAreWhatTheCellIsThere) {
  for (int n = 0; n < 300; ++n) {
    const CellPolynomial cell = any_cell();
    const double sign = n % 2 == 0 ? 1.0 : -1.0;
    const CellPart part = halved(CellPart(cell, 0.3, sign), n % 12);
    EXPECT_TRUE((part.low.array() >= cell.lower.array() - 1e-15).all());
    EXPECT_TRUE((part.high.array() <= cell.upper().array() + 1e-15).all());
    for (unsigned corner = 0; corner < 8; ++corner) {
      const Vec3 at = part.corner(corner);
      EXPECT_NEAR(part.at_corner(corner), sign * (cell.value(at) - 0.3), 1e-13);
      const double slope = cell.gradient(at).gradient.norm();
      EXPECT_NEAR(part.slope_near(at), slope, 1e-9 * (1.0 + slope));
    }
  }
}

// Whatever the multiplier: what is said to be positive is at every place of the box that is as near.
TEST_P(CellPartEach, NothingIsSaidToBePositiveThatIsNot) {
  int said = 0;
  int said_by_nearness = 0;
  int left = 0;
  for (int n = 0; n < 20000; ++n) {
    const CellPolynomial cell = any_cell();
    const double sign = share() < 0.5 ? 1.0 : -1.0;
    const double threshold = 0.6 * (share() - 0.5);
    const CellPart part = halved(CellPart(cell, threshold, sign), static_cast<int>(10.0 * share()));
    const double width = (part.high - part.low).norm();
    const Vec3 p = within(part) + random_point(generator, 2.0 * width);
    const double distance = 2.0 * width * share();
    const double slope = cell.gradient(within(part)).gradient.norm();
    const bool positive = part.is_positive_around(p, distance, share() * slope / distance, 0.0);
    bool somewhere_not = false;
    bool somewhere_near = false;
    for (int i = 0; i < 40; ++i) {
      const Vec3 at = i < 8 ? part.corner(static_cast<unsigned>(i)) : within(part);
      const double value = sign * (cell.value(at) - threshold);
      const bool near = (at - p).norm() < distance;
      somewhere_near = somewhere_near || near;
      somewhere_not = somewhere_not || value < 0.0;
      if (positive && near) {
        ASSERT_GT(value, -1e-14) << n;
      }
    }
    said += positive && somewhere_near ? 1 : 0;
    said_by_nearness += positive && somewhere_near && somewhere_not ? 1 : 0;
    left += positive ? 0 : 1;
  }
  EXPECT_GT(said, 700);
  EXPECT_GT(said_by_nearness, 100);
  EXPECT_GT(left, 1000);
}

// Bounds close in with the square of the width: what is positive by a margin is said to be once it is halved enough.
TEST_P(CellPartEach, HalvingTellsWhatIsPositive) {
  int positive = 0;
  for (int n = 0; n < 2000; ++n) {
    const CellPolynomial cell = any_cell();
    const CellPart part = halved(CellPart(cell, 0.0, 1.0), 15);
    const Vec3 p = random_point(generator, 0.1);
    const double slope = cell.gradient(part.low).gradient.norm();
    const double width = (part.high - part.low).norm();
    if (cell.value(part.low) < 2.0 * slope * width + cell.most_bend() * width * width) continue;
    ++positive;
    EXPECT_TRUE(part.is_positive_around(p, 1.0, 0.0, 0.0));
  }
  EXPECT_GT(positive, 100);
}

TEST(CellPart, WideAndPlainKernelsAreTheSame) {
  std::mt19937_64 generator(29);
  const CubicKernels plain = plain_cubic_kernels();
  const auto field = random_field(6, CellReconstruction::smooth, 6, 0.8);
  CellPolynomial cell;
  for (int n = 0; n < 300; ++n) {
    ASSERT_TRUE(field->load(0, field->cell_of(0, random_point(generator, 0.05)), cell));
    double first[2][64];
    double second[2][64];
    plain.halve(cell.coefficient, n % 3, first[0], second[0]);
    cubic_kernels.halve(cell.coefficient, n % 3, first[1], second[1]);
    for (std::size_t i = 0; i < 64; ++i) {
      EXPECT_EQ(first[0][i], first[1][i]);
      EXPECT_EQ(second[0][i], second[1][i]);
    }
    double along[3][4];
    for (auto& axis : along) {
      for (double& one : axis) one = random_point(generator, 1.0).x();
    }
    const LeastCoefficients a = plain.least(cell.coefficient, along);
    const LeastCoefficients b = cubic_kernels.least(cell.coefficient, along);
    EXPECT_EQ(a.alone, b.alone);
    EXPECT_EQ(a.with_sums, b.with_sums);
    double least = infinity;
    for (std::size_t i = 0; i < 64; ++i)
      least = std::min(least, cell.coefficient[i] + (along[1][i / 4 % 4] + along[2][i / 16]) + along[0][i % 4]);
    EXPECT_NEAR(a.with_sums, least, 1e-14);
  }
}

}  // namespace
}  // namespace asperity::test::cell_part_test
