#include "asperity/field/height/map.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "asperity/core/rng.h"

namespace asperity::height_map_test {
namespace {

using std::numbers::pi;

constexpr Reconstruction all_reconstructions[] = {Reconstruction::nearest, Reconstruction::bilinear,
                                                  Reconstruction::quadratic_bspline, Reconstruction::bicubic};
constexpr Wrap both_wraps[] = {Wrap::repeat, Wrap::clamp};

static_assert(noexcept(std::declval<const HeightMap&>().sample(std::declval<const Vec2&>())));
static_assert(noexcept(std::declval<const HeightMap&>().height_at(std::declval<const Vec2&>())));
static_assert(noexcept(std::declval<const HeightMap&>().curvature(std::declval<const Vec2&>())));

/// Heights from a formula at the texel centres.
template <class Formula>
std::vector<float> tabulate(int width, int height, Formula&& formula) {
  std::vector<float> heights;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      heights.push_back(static_cast<float>(formula((x + 0.5) / width, 1.0 - (y + 0.5) / height)));
    }
  }
  return heights;
}

std::vector<float> random_heights(int width, int height, std::uint64_t seed) {
  Rng rng(seed);
  return tabulate(width, height, [&](double, double) { return rng.uniform(-1e-3, 1e-3); });
}

HeightMap map_of(std::vector<float> heights, int width, int height, Wrap wrap, Reconstruction reconstruction) {
  auto map = HeightMap::build(std::move(heights), width, height, wrap, reconstruction);
  EXPECT_TRUE(map.ok());
  return std::move(map).value();
}

Image grey_image(int width, int height, std::vector<std::uint16_t> samples, int bits = 8) {
  return Image{width, height, 1, bits, std::move(samples)};
}

// ---- against equations
// ------------------------------------------------------------------------------------------------

class Ramp : public testing::TestWithParam<Reconstruction> {};

TEST_P(Ramp, IsReproducedWithItsGradientAwayFromTheBorder) {
  const int size = 64;
  const Vec2 slope(3e-3, -2e-3);
  const auto ramp = [&](double s, double t) { return slope.x() * s + slope.y() * t + 5e-4; };
  const HeightMap map = map_of(tabulate(size, size, ramp), size, size, Wrap::clamp, GetParam());
  Rng rng(1);
  for (int i = 0; i < 2000; ++i) {
    // The mirrored border's influence falls by 5.8 a texel, the cubic spline's by 3.7: 16 texels inside it is under
    // 1e-9.
    const Vec2 st(rng.uniform(0.25, 0.75), rng.uniform(0.25, 0.75));
    const HeightSample sample = map.sample(st);
    ASSERT_NEAR(sample.height, ramp(st.x(), st.y()), 1e-6 * 5e-3);
    ASSERT_NEAR((sample.gradient - slope).norm(), 0.0, 1e-4 * slope.norm());
  }
}
INSTANTIATE_TEST_SUITE_P(Smooth, Ramp,
                         testing::Values(Reconstruction::bilinear, Reconstruction::quadratic_bspline,
                                         Reconstruction::bicubic));

struct Errors {
  double height = 0.0;
  double gradient = 0.0;
};

Errors cosine_errors(int size, Reconstruction reconstruction) {
  const auto relief = [](double s, double t) { return std::cos(4.0 * pi * s) * std::cos(2.0 * pi * t); };
  const HeightMap map = map_of(tabulate(size, size, relief), size, size, Wrap::repeat, reconstruction);
  Rng rng(2);
  Errors errors;
  for (int i = 0; i < 20000; ++i) {
    const Vec2 st(rng.uniform(-1.0, 2.0), rng.uniform(-1.0, 2.0));
    const Vec2 gradient(-4.0 * pi * std::sin(4.0 * pi * st.x()) * std::cos(2.0 * pi * st.y()),
                        -2.0 * pi * std::cos(4.0 * pi * st.x()) * std::sin(2.0 * pi * st.y()));
    const HeightSample sample = map.sample(st);
    errors.height = std::max(errors.height, std::abs(sample.height - relief(st.x(), st.y())));
    errors.gradient = std::max(errors.gradient, (sample.gradient - gradient).norm());
  }
  return errors;
}

TEST(HeightMapCosine, BsplineConvergesWithThirdOrderHeightsAndSecondOrderGradients) {
  const Errors coarse = cosine_errors(32, Reconstruction::quadratic_bspline);
  const Errors fine = cosine_errors(64, Reconstruction::quadratic_bspline);
  EXPECT_GT(coarse.height / fine.height, 8.0 * 0.8);
  EXPECT_GT(coarse.gradient / fine.gradient, 4.0 * 0.8);
  EXPECT_LT(fine.height, 2e-3);
  EXPECT_LT(fine.gradient, 0.02 * 4.0 * pi);
}

TEST(HeightMapCosine, BicubicConvergesWithFourthOrderHeightsAndThirdOrderGradients) {
  const Errors coarse = cosine_errors(16, Reconstruction::bicubic);
  const Errors fine = cosine_errors(32, Reconstruction::bicubic);
  EXPECT_GT(coarse.height / fine.height, 16.0 * 0.8);
  EXPECT_GT(coarse.gradient / fine.gradient, 8.0 * 0.8);
  EXPECT_LT(fine.height, cosine_errors(32, Reconstruction::quadratic_bspline).height);
  EXPECT_LT(fine.gradient, 0.3 * cosine_errors(32, Reconstruction::quadratic_bspline).gradient);
}

TEST(HeightMapCosine, BilinearConvergesWithSecondOrderHeightsAndFirstOrderGradients) {
  const Errors coarse = cosine_errors(32, Reconstruction::bilinear);
  const Errors fine = cosine_errors(64, Reconstruction::bilinear);
  EXPECT_NEAR(coarse.height / fine.height, 4.0, 0.8);
  EXPECT_NEAR(coarse.gradient / fine.gradient, 2.0, 0.4);
}

/// Largest error of a spline's second derivatives.
double cosine_curvature_error(int size, Reconstruction reconstruction) {
  const auto relief = [](double s, double t) { return std::cos(4.0 * pi * s) * std::cos(2.0 * pi * t); };
  const HeightMap map = map_of(tabulate(size, size, relief), size, size, Wrap::repeat, reconstruction);
  Rng rng(3);
  double error = 0.0;
  for (int i = 0; i < 20000; ++i) {
    const Vec2 st(rng.uniform(-1.0, 2.0), rng.uniform(-1.0, 2.0));
    const HeightCurvature curvature = map.curvature(st);
    const double height = relief(st.x(), st.y());
    const double mixed = 8.0 * pi * pi * std::sin(4.0 * pi * st.x()) * std::sin(2.0 * pi * st.y());
    error = std::max({error, std::abs(curvature.ss + 16.0 * pi * pi * height),
                      std::abs(curvature.tt + 4.0 * pi * pi * height), std::abs(curvature.st - mixed)});
  }
  return error;
}

TEST(HeightMapCosine, BsplineConvergesWithFirstOrderSecondDerivatives) {
  const double fine = cosine_curvature_error(128, Reconstruction::quadratic_bspline);
  EXPECT_NEAR(cosine_curvature_error(64, Reconstruction::quadratic_bspline) / fine, 2.0, 0.2);
  // Half a texel of the third derivative.
  EXPECT_NEAR(fine, std::pow(4.0 * pi, 3) * 0.5 / 128, 0.1 * fine);
}

TEST(HeightMapCosine, BicubicConvergesWithSecondOrderSecondDerivatives) {
  const double fine = cosine_curvature_error(64, Reconstruction::bicubic);
  EXPECT_NEAR(cosine_curvature_error(32, Reconstruction::bicubic) / fine, 4.0, 0.4);
  // At a texel's centre it is that of the samples: a twelfth of the fourth derivative.
  EXPECT_NEAR(fine, std::pow(4.0 * pi, 4) / (12.0 * 64 * 64), 0.25 * fine);
}

TEST(HeightMapStep, BsplineOvershootsByTenPercentAndTheBoundsSaySo) {  // formulation amendment 11
  const int size = 64;
  const HeightMap map = map_of(tabulate(size, 2, [](double s, double) { return s < 0.5 ? 0.0 : 1.0; }), size, 2,
                               Wrap::clamp, Reconstruction::quadratic_bspline);
  double highest = -infinity;
  for (int i = 0; i <= 20000; ++i) highest = std::max(highest, map.height_at({i / 20000.0, 0.5}));
  EXPECT_NEAR(highest, 1.10, 0.02);
  EXPECT_GE(map.highest(), highest);
  EXPECT_LE(map.highest(), 1.17);  // its own coefficients reach 1.21
  EXPECT_NEAR(map.highest() + map.lowest(), 1.0, 1e-6);
}

TEST(HeightMapStep, BicubicPassesThroughTheTexelsBesideTheStepAndTheBoundsHold) {
  const int size = 64;
  const HeightMap map = map_of(tabulate(size, 2, [](double s, double) { return s < 0.5 ? 0.0 : 1.0; }), size, 2,
                               Wrap::clamp, Reconstruction::bicubic);
  double highest = -infinity;
  for (int i = 0; i <= 20000; ++i) highest = std::max(highest, map.height_at({i / 20000.0, 0.5}));
  EXPECT_NEAR(map.height_at({33.5 / size, 0.5}), 1.0, 1e-6);
  EXPECT_NEAR(highest, 1.11, 0.005);
  EXPECT_GE(map.highest(), highest);
  EXPECT_LE(map.highest(), highest + 0.04);  // its own coefficients reach 1 + 1 / (1 + sqrt 3) = 1.37
  EXPECT_NEAR(map.highest() + map.lowest(), 1.0, 1e-6);
}

TEST(HeightMapConstant, IsExactWithGradientZeroEverywhere) {
  const double height = 1.2345678912345e-3;
  for (const Wrap wrap : both_wraps) {
    for (const Reconstruction reconstruction : all_reconstructions) {
      const auto map = HeightMap::build(grey_image(5, 3, std::vector<std::uint16_t>(15, 0)), Channel::automatic,
                                        {2e-3, height, false, wrap, reconstruction});
      ASSERT_TRUE(map.ok());
      Rng rng(3);
      for (int i = 0; i < 100; ++i) {
        const HeightSample sample = map->sample({rng.uniform(-5.0, 5.0), rng.uniform(-5.0, 5.0)});
        ASSERT_EQ(sample.height, height);
        ASSERT_EQ(sample.gradient, Vec2::Zero());
      }
      EXPECT_EQ(map->lowest(), height);
      EXPECT_EQ(map->highest(), height);
      EXPECT_EQ(map->quantisation_step(), 0.0);
    }
  }
}

// ---- invariants
// -------------------------------------------------------------------------------------------------------

TEST(HeightMapTexels, EveryReconstructionPassesThroughThem) {
  const int sizes[][2] = {{1, 1}, {2, 1}, {1, 2}, {2, 2}, {3, 2}, {3, 3}, {5, 4}, {17, 64}, {64, 33}};
  for (const auto& [width, height] : sizes) {
    const std::vector<float> heights = random_heights(width, height, 7);
    for (const Wrap wrap : both_wraps) {
      for (const Reconstruction reconstruction : all_reconstructions) {
        const HeightMap map = map_of(heights, width, height, wrap, reconstruction);
        for (int y = 0; y < height; ++y) {
          for (int x = 0; x < width; ++x) {
            const double expected = heights[static_cast<std::size_t>(y * width + x)];
            ASSERT_NEAR(map.texel(x, y), expected, 1e-6 * 2e-3) << width << " x " << height << " " << x << "," << y;
          }
        }
      }
    }
  }
}

TEST(HeightMapTexels, AFarOffsetDoesNotCostPrecision) {
  std::vector<std::uint16_t> codes{0, 10000, 65535, 4321, 30000, 22222};
  const double amplitude = 1e-6;
  const auto map = HeightMap::build(grey_image(3, 2, codes, 16), Channel::automatic,
                                    {amplitude, 1.0, false, Wrap::repeat, Reconstruction::quadratic_bspline});
  ASSERT_TRUE(map.ok());
  for (int i = 0; i < 6; ++i) {
    const double expected = 1.0 + amplitude * codes[static_cast<std::size_t>(i)] / 65535.0;
    EXPECT_NEAR(map->texel(i % 3, i / 3), expected, 1e-6 * amplitude);
  }
}

/// Largest change of the gradient over a step of `step` texels across the borders of texels (`at` = 0) or their centres
/// (0.5).
double gradient_jump(const HeightMap& map, double step, double at) {
  double largest = 0.0;
  const Vec2 texel(1.0 / map.width(), 1.0 / map.height());
  for (int i = -1; i <= map.width() + 1; ++i) {
    for (int j = 0; j < 40; ++j) {
      const double across = (i + at) * texel.x();
      const double along = j / 37.0;
      const Vec2 half(0.5 * step * texel.x(), 0.0);
      const Vec2 jump =
          map.sample(Vec2(across, along) + half).gradient - map.sample(Vec2(across, along) - half).gradient;
      largest = std::max(largest, jump.norm());
    }
  }
  return largest;
}

TEST(HeightMapContinuity, BsplineGradientIsContinuousAcrossTexelsSeamsAndBorders) {
  for (const Wrap wrap : both_wraps) {
    const HeightMap map = map_of(random_heights(16, 12, 5), 16, 12, wrap, Reconstruction::quadratic_bspline);
    for (const double at : {0.0, 0.5}) {
      const double ratio = gradient_jump(map, 1e-3, at) / gradient_jump(map, 1e-4, at);
      EXPECT_NEAR(ratio, 10.0, 2.0) << to_string(wrap);
    }
  }
}

TEST(HeightMapContinuity, BicubicCurvatureIsContinuousAcrossTexelsAndSeams) {
  const HeightMap map = map_of(random_heights(16, 12, 5), 16, 12, Wrap::repeat, Reconstruction::bicubic);
  const auto jump = [&](double step) {
    double largest = 0.0;
    for (int i = -1; i <= 33; ++i) {
      for (int j = 0; j < 40; ++j) {
        const Vec2 half(0.25 * step / 16.0, 0.25 * step / 12.0);
        const Vec2 st(0.5 * i / 16.0, j / 37.0);
        const HeightCurvature after = map.curvature(st + half);
        const HeightCurvature before = map.curvature(st - half);
        largest = std::max(
            {largest, std::abs(after.ss - before.ss), std::abs(after.st - before.st), std::abs(after.tt - before.tt)});
      }
    }
    return largest;
  };
  EXPECT_NEAR(jump(1e-3) / jump(1e-4), 10.0, 1.0);
}

TEST(HeightMapContinuity, BilinearGradientJumpsAtTexelCentres) {
  const HeightMap map = map_of(random_heights(16, 12, 5), 16, 12, Wrap::repeat, Reconstruction::bilinear);
  EXPECT_NEAR(gradient_jump(map, 1e-3, 0.5) / gradient_jump(map, 1e-4, 0.5), 1.0, 0.1);
}

TEST(HeightMapContinuity, HeightsAreContinuousAcrossTheSeam) {
  for (const Reconstruction reconstruction :
       {Reconstruction::bilinear, Reconstruction::quadratic_bspline, Reconstruction::bicubic}) {
    const HeightMap map = map_of(random_heights(11, 9, 6), 11, 9, Wrap::repeat, reconstruction);
    for (int j = 0; j < 50; ++j) {
      const double along = j / 50.0;
      EXPECT_NEAR(map.height_at({-1e-9, along}), map.height_at({1e-9, along}), 1e-9);
      EXPECT_NEAR(map.height_at({along, 1.0 - 1e-9}), map.height_at({along, 1.0 + 1e-9}), 1e-9);
      EXPECT_NEAR(map.height_at({-1e-18, along}), map.height_at({0.0, along}), 1e-12);
    }
  }
}

RC_GTEST_PROP(HeightMapGradient, AgreesWithFiniteDifferences, ()) {
  const int width = *rc::gen::inRange(1, 20);
  const int height = *rc::gen::inRange(1, 20);
  const Wrap wrap = *rc::gen::element(Wrap::repeat, Wrap::clamp);
  const Reconstruction reconstruction =
      *rc::gen::element(Reconstruction::bilinear, Reconstruction::quadratic_bspline, Reconstruction::bicubic);
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const HeightMap map = map_of(random_heights(width, height, rng.next()), width, height, wrap, reconstruction);
  const double step = 1e-4;  // texels
  for (int i = 0; i < 20; ++i) {
    Vec2 st(rng.uniform(-3.0, 3.0), rng.uniform(-3.0, 3.0));
    const Vec2 gradient = map.sample(st).gradient;
    const int counts[] = {width, height};
    for (int axis = 0; axis < 2; ++axis) {
      const double texels = st[axis] * counts[axis];
      const double to_crease = std::abs(texels - 0.5 - std::round(texels - 0.5));
      const double to_border = std::abs(texels - std::round(texels));
      if (std::min(to_crease, to_border) < 2.0 * step) continue;
      Vec2 before = st;
      Vec2 after = st;
      before[axis] -= step / counts[axis];
      after[axis] += step / counts[axis];
      const double difference = (map.height_at(after) - map.height_at(before)) * counts[axis] / (2.0 * step);
      // Between creases the difference quotient is exact for the first two (piecewise linear or quadratic along an
      // axis); what is left is rounding, and a sixth of a third derivative of the cubic one.
      const double left = reconstruction == Reconstruction::bicubic ? 2e-7 : 1e-8;
      RC_ASSERT(std::abs(difference - gradient[axis]) <= left * 1e-3 * counts[axis]);
    }
  }
}

TEST(HeightMapGradient, IsZeroForNearest) {
  const HeightMap map = map_of(random_heights(8, 8, 9), 8, 8, Wrap::repeat, Reconstruction::nearest);
  EXPECT_EQ(map.sample({0.3, 0.7}).gradient, Vec2::Zero());
}

/// Coordinates in and around the map, and those that a division by zero leaves behind.
double any_coordinate(Rng& rng) {
  const double special[] = {0.0,
                            1.0,
                            -1e-18,
                            -0.25,
                            1e-300,
                            0x1p31,
                            -0x1p40,
                            1e300,
                            infinity,
                            -infinity,
                            std::numeric_limits<double>::quiet_NaN()};
  return rng.below(4) == 0 ? special[rng.below(std::size(special))] : rng.uniform(-3.0, 3.0);
}

/// Of any size, of one texel too, wrap and reconstruction, to be drawn within a property.
HeightMap any_map(Rng& rng) {
  const int width = *rc::gen::inRange(1, 20);
  const int height = *rc::gen::inRange(1, 20);
  const Wrap wrap = *rc::gen::element(Wrap::repeat, Wrap::clamp);
  const Reconstruction reconstruction =
      *rc::gen::elementOf(std::vector<Reconstruction>(std::begin(all_reconstructions), std::end(all_reconstructions)));
  return map_of(random_heights(width, height, rng.next()), width, height, wrap, reconstruction);
}

RC_GTEST_PROP(HeightMapLanes, SeveralAtOnceAreEachAsAloneToTheBit, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const HeightMap map = any_map(rng);
  for (int i = 0; i < 50; ++i) {
    // Mostly all within reach of a register, sometimes one that is not.
    const bool strange = rng.below(3) == 0;
    Lanes s;
    Lanes t;
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      s[lane] = strange ? any_coordinate(rng) : rng.uniform(-3.0, 3.0);
      t[lane] = strange ? any_coordinate(rng) : rng.below(4) / 4.0;
    }
    Lanes heights;
    map.heights_at(s, t, heights);
    for (std::size_t lane = 0; lane < lanes; ++lane) RC_ASSERT(heights[lane] == map.height_at(Vec2(s[lane], t[lane])));
  }
}

RC_GTEST_PROP(HeightMapCurvature, HasTheHeightAndGradientOfSampleToTheBit, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const HeightMap map = any_map(rng);
  for (int i = 0; i < 50; ++i) {
    const Vec2 st(any_coordinate(rng), any_coordinate(rng));
    const HeightSample sample = map.sample(st);
    const HeightCurvature curvature = map.curvature(st);
    RC_ASSERT(curvature.height == sample.height);
    RC_ASSERT(curvature.gradient == sample.gradient);
    RC_ASSERT(std::isfinite(curvature.ss) && std::isfinite(curvature.st) && std::isfinite(curvature.tt));
  }
}

RC_GTEST_PROP(HeightMapCurvature, AgreesWithFiniteDifferencesOfTheGradient, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const HeightMap map = any_map(rng);
  // Pieces of the quadratic spline meet on the texels' borders, those of the others at least on the lines through
  // centres.
  const double piece = map.reconstruction() == Reconstruction::quadratic_bspline ? 0.0 : 0.5;
  // In a piece of the cubic one the mixed derivative is quadratic across: a short step leaves little of that.
  const bool cubic = map.reconstruction() == Reconstruction::bicubic;
  const Vec2 step = Vec2(1.0 / map.width(), 1.0 / map.height()) * (cubic ? 1e-3 : 0.05);
  const double left = cubic ? 1e-4 : 1e-9;
  for (int i = 0; i < 20; ++i) {
    const auto inside_a_piece = [&](int count) {
      const double half = piece > 0.0 ? 0.25 * static_cast<double>(rng.below(2)) : 0.0;  // nearest: not on a border
      const double texel = std::floor(rng.uniform(-2.0 * count, 3.0 * count));
      return (texel + piece + (piece > 0.0 ? rng.uniform(0.06, 0.19) + half * 2.0 : rng.uniform(0.06, 0.94))) / count;
    };
    const Vec2 st(inside_a_piece(map.width()), inside_a_piece(map.height()));
    const Vec2 along_s =
        (map.sample(st + Vec2(step.x(), 0.0)).gradient - map.sample(st - Vec2(step.x(), 0.0)).gradient) /
        (2.0 * step.x());
    const Vec2 along_t =
        (map.sample(st + Vec2(0.0, step.y())).gradient - map.sample(st - Vec2(0.0, step.y())).gradient) /
        (2.0 * step.y());
    const HeightCurvature curvature = map.curvature(st);
    // Within a piece the gradient is at most quadratic along an axis, so the quotient is exact but for rounding.
    RC_ASSERT(std::abs(curvature.ss - along_s.x()) <= left * 1e-3 * map.width() * map.width());
    RC_ASSERT(std::abs(curvature.st - along_s.y()) <= left * 1e-3 * map.width() * map.height());
    RC_ASSERT(std::abs(curvature.st - along_t.x()) <= left * 1e-3 * map.width() * map.height());
    RC_ASSERT(std::abs(curvature.tt - along_t.y()) <= left * 1e-3 * map.height() * map.height());
  }
}

TEST(HeightMapCurvature, IsZeroAlongAClampedAxisOutside) {
  const HeightMap map = map_of(random_heights(9, 14, 12), 9, 14, Wrap::clamp, Reconstruction::quadratic_bspline);
  const HeightCurvature border = map.curvature({0.0, 0.4});
  EXPECT_NE(border.ss, 0.0);
  EXPECT_NE(border.tt, 0.0);
  const HeightCurvature outside = map.curvature({-1e-9, 0.4});
  EXPECT_EQ(outside.ss, 0.0);
  EXPECT_EQ(outside.st, 0.0);
  EXPECT_EQ(outside.tt, border.tt);
  const HeightCurvature above = map.curvature({0.4, 1.0 + 1e-9});
  EXPECT_EQ(above.ss, map.curvature({0.4, 1.0}).ss);
  EXPECT_EQ(above.st, 0.0);
  EXPECT_EQ(above.tt, 0.0);
  // A coordinate that is not finite reads as 0, which is not outside.
  EXPECT_EQ(map.curvature({infinity, 0.4}).ss, border.ss);
}

TEST(HeightMapWrap, RepeatIsEqualAfterWholeShiftsOfAnySize) {
  for (const Reconstruction reconstruction : all_reconstructions) {
    const HeightMap map = map_of(random_heights(13, 8, 11), 13, 8, Wrap::repeat, reconstruction);
    Rng rng(4);
    for (int i = 0; i < 500; ++i) {
      // Multiples of 1/1024 stay exact under these shifts, so the answers must be equal to the bit.
      const Vec2 st(rng.below(1024) / 1024.0, rng.below(1024) / 1024.0);
      const HeightSample here = map.sample(st);
      for (const double shift : {-1.0, 1.0, 4.0, -1000.0, 0x1p31, -0x1p33, 0x1p40}) {
        const HeightSample there = map.sample(st + Vec2(shift, -2.0 * shift));
        ASSERT_EQ(there.height, here.height) << shift;
        ASSERT_EQ(there.gradient, here.gradient) << shift;
      }
    }
  }
}

TEST(HeightMapWrap, ClampIsConstantOutsideWithoutSlopeAcrossTheBorder) {
  for (const Reconstruction reconstruction : all_reconstructions) {
    const HeightMap map = map_of(random_heights(9, 14, 12), 9, 14, Wrap::clamp, reconstruction);
    for (const double t : {0.0, 0.31, 0.5, 0.99, 1.0}) {
      for (const double outside : {-1e-3, -0.7, -12.0, -1e12, -1e300}) {
        EXPECT_EQ(map.height_at({outside, t}), map.height_at({0.0, t}));
        EXPECT_EQ(map.height_at({1.0 - outside, t}), map.height_at({1.0, t}));
        EXPECT_EQ(map.sample({outside, t}).gradient.x(), 0.0);
        EXPECT_EQ(map.sample({1.0 - outside, t}).gradient.x(), 0.0);
        EXPECT_EQ(map.sample({outside, t}).gradient.y(), map.sample({0.0, t}).gradient.y());
      }
    }
  }
}

TEST(HeightMapWrap, ACoordinateThatIsNotFiniteReadsAsZero) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Wrap wrap : both_wraps) {
    for (const Reconstruction reconstruction : all_reconstructions) {
      const HeightMap map = map_of(random_heights(7, 5, 13), 7, 5, wrap, reconstruction);
      for (const double bad : {nan, -nan, infinity, -infinity}) {
        EXPECT_EQ(map.height_at({bad, 0.4}), map.height_at({0.0, 0.4}));
        EXPECT_EQ(map.height_at({0.4, bad}), map.height_at({0.4, 0.0}));
        EXPECT_EQ(map.height_at({bad, bad}), map.height_at({0.0, 0.0}));
      }
    }
  }
}

TEST(HeightMapBounds, HoldEverySampleAndAreNotWide) {
  for (const Reconstruction reconstruction : all_reconstructions) {
    for (const Wrap wrap : both_wraps) {
      const HeightMap map = map_of(random_heights(31, 17, 14), 31, 17, wrap, reconstruction);
      Rng rng(5);
      double low = infinity;
      double high = -infinity;
      for (int i = 0; i < 100000; ++i) {
        const double height = map.height_at({rng.uniform(-2.0, 2.0), rng.uniform(-2.0, 2.0)});
        low = std::min(low, height);
        high = std::max(high, height);
      }
      EXPECT_GE(low, map.lowest());
      EXPECT_LE(high, map.highest());
      // Noise from texel to texel is the worst case for a spline's bounds.
      const double widest = is_spline(reconstruction) ? 1.4 : 1.05;
      EXPECT_LE(map.highest() - map.lowest(), widest * (high - low));
    }
  }
}

// ---- from images
// ------------------------------------------------------------------------------------------------------

TEST(HeightMapImage, RowZeroIsTheTopAndTRunsUp) {
  for (const Reconstruction reconstruction : all_reconstructions) {
    const auto map = HeightMap::build(grey_image(2, 2, {255, 0, 0, 51}), Channel::automatic,
                                      {1e-3, 0.0, false, Wrap::clamp, reconstruction});
    ASSERT_TRUE(map.ok());
    EXPECT_NEAR(map->height_at({0.25, 0.75}), 1e-3, 1e-9);  // top left
    EXPECT_NEAR(map->height_at({0.75, 0.75}), 0.0, 1e-9);
    EXPECT_NEAR(map->height_at({0.25, 0.25}), 0.0, 1e-9);
    EXPECT_NEAR(map->height_at({0.75, 0.25}), 0.2e-3, 1e-9);  // bottom right
    EXPECT_NEAR(map->texel(1, 1), 0.2e-3, 1e-9);
  }
}

TEST(HeightMapImage, AmplitudeOffsetAndWhiteIsDeepMakeMetres) {
  const Image image = grey_image(3, 1, {0, 51, 255});
  HeightMapSettings settings{2e-3, -5e-4, false, Wrap::clamp, Reconstruction::bilinear};
  auto map = HeightMap::build(image, Channel::automatic, settings);
  ASSERT_TRUE(map.ok());
  EXPECT_NEAR(map->texel(0, 0), -5e-4, 1e-9);
  EXPECT_NEAR(map->texel(1, 0), -1e-4, 1e-9);
  EXPECT_NEAR(map->texel(2, 0), 15e-4, 1e-9);
  settings.white_is_deep = true;
  map = HeightMap::build(image, Channel::automatic, settings);
  ASSERT_TRUE(map.ok());
  EXPECT_NEAR(map->texel(0, 0), -5e-4, 1e-9);
  EXPECT_NEAR(map->texel(2, 0), -25e-4, 1e-9);
  EXPECT_NEAR(map->lowest(), -25e-4, 1e-9);
}

TEST(HeightMapImage, QuantisationStepIsThatOfTheLevelsInUse) {
  const HeightMapSettings settings{1e-3, 0.0, false, Wrap::repeat, Reconstruction::bilinear};
  const auto step = [&](const Image& image) {
    const auto map = HeightMap::build(image, Channel::automatic, settings);
    return map.ok() ? map->quantisation_step() : -1.0;
  };
  EXPECT_DOUBLE_EQ(step(grey_image(3, 1, {0, 100, 255})), 1e-3 * 5 / 255);  // all differ by multiples of 5
  EXPECT_DOUBLE_EQ(step(grey_image(3, 1, {0, 101, 255})), 1e-3 / 255);
  EXPECT_DOUBLE_EQ(step(grey_image(3, 1, {0, 1, 65535}, 16)), 1e-3 / 65535);
  EXPECT_DOUBLE_EQ(step(grey_image(3, 1, {0, 257, 65535}, 16)), 1e-3 / 255);  // 8 bits stretched to 16
  const Image colour{2, 1, 3, 8, {10, 10, 10, 20, 30, 40}};
  EXPECT_DOUBLE_EQ(step(colour), 1e-3 / 255);
}

TEST(HeightMapImage, ReportsSizeMemoryAndChannel) {
  const auto map = HeightMap::build(grey_image(4, 2, std::vector<std::uint16_t>(8, 9)), Channel::automatic, {});
  ASSERT_TRUE(map.ok());
  EXPECT_EQ(map->width(), 4);
  EXPECT_EQ(map->height(), 2);
  EXPECT_EQ(map->channel().channel, Channel::luminance);
  EXPECT_EQ(map->channel().reason, "the only channel");
  EXPECT_GE(map->memory_bytes(), 6 * 4 * sizeof(float));
  EXPECT_LT(map->memory_bytes(), 6 * 4 * sizeof(float) + 512);
}

TEST(HeightMapBadInput, IsRefusedWithAnErrorThatNamesIt) {
  const Image image = grey_image(1, 1, {5});
  const auto refused = [&](HeightMapSettings settings) {
    const auto map = HeightMap::build(image, Channel::automatic, settings);
    EXPECT_FALSE(map.ok());
    return map.ok() ? std::string() : map.error().place;
  };
  EXPECT_EQ(refused({-1e-3, 0.0}), "amplitude");
  EXPECT_EQ(refused({infinity, 0.0}), "amplitude");
  EXPECT_EQ(refused({std::numeric_limits<double>::quiet_NaN(), 0.0}), "amplitude");
  EXPECT_EQ(refused({1e-3, infinity}), "offset");

  const auto build = [](std::vector<float> heights, int width, int height) {
    return HeightMap::build(std::move(heights), width, height, Wrap::repeat, Reconstruction::bilinear);
  };
  EXPECT_EQ(build({}, 0, 0).error().code, ErrorCode::bad_value);
  EXPECT_EQ(build({}, -1, 5).error().code, ErrorCode::bad_value);
  EXPECT_EQ(build({1.0F, 2.0F}, 3, 1).error().code, ErrorCode::bad_value);
  EXPECT_EQ(build({}, 1 << 20, 1 << 20).error().code, ErrorCode::too_large);
  const auto nan_height = build({1.0F, 2.0F, 3.0F, std::numeric_limits<float>::quiet_NaN()}, 2, 2);
  ASSERT_FALSE(nan_height.ok());
  EXPECT_EQ(nan_height.error().place, "column 1, row 1");
  EXPECT_EQ(HeightMap::build(Image{}, Channel::automatic, {}).error().code, ErrorCode::bad_value);
  EXPECT_EQ(HeightMap::build(image, Channel::alpha, {}).error().code, ErrorCode::bad_value);
}

}  // namespace
}  // namespace asperity::height_map_test
