#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "asperity/core/rng.h"
#include "asperity/render/law_registry.h"
#include "asperity/render/laws.h"
#include "tests/render/asked_law.h"
#include "tests/render/volumes.h"

namespace asperity::avila_test {
namespace {

using volumes::cube;
using volumes::sampled;
using volumes::surface_of;

constexpr double stiffness = 1000.0;

/// A law that is felt on one surface, tick by tick.
struct Touch {
  std::shared_ptr<const IsoSurface> surface;
  AvilaLaw law;
  Material material;
  Contact state;
  SurfaceCache cache;

  LawForce at(const Vec3& p, const Vec3& v = Vec3::Zero()) {
    return test::asked(law, surface, surface->view(cache), material, p, v, Seconds(1e-3), state, cache);
  }
};

/// The field `slope` x over |x|, |y|, |z| <= 0.02, its surface at x = 0; low values, x < 0, are inside.
Touch wall(double slope, AvilaLaw law, Inside inside = Inside::low) {
  Touch touch;
  touch.surface = surface_of(sampled(cube(0.02, 8), [slope](const Vec3& p) { return slope * p.x(); }), 0.0, inside);
  touch.law = law;
  touch.material.stiffness = stiffness;
  return touch;
}

AvilaLaw with(Formulation formulation, double band = 0.0, double largest = 3.0, double retarding = 0.0) {
  return {formulation, band, largest, retarding};
}

// --- the consistent form ---

TEST(Avila, RisesFromTheThresholdInwardsAndEndsBehindTheLayer) {
  Touch touch = wall(100.0, with(Formulation::consistent, 0.1));  // a layer 1 mm thick
  EXPECT_FALSE(touch.at(Vec3(0.0005, 0.0, 0.0)).contact);
  for (const double share : {0.01, 0.25, 0.5, 0.99}) {
    const LawForce force = touch.at(Vec3(-1e-3 * share, 0.002, -0.001));
    ASSERT_TRUE(force.contact);
    EXPECT_LT((force.force - Vec3(3.0 * share, 0.0, 0.0)).norm(), 1e-4);
    EXPECT_LT((force.normal - Vec3::UnitX()).norm(), 1e-5);
    EXPECT_NEAR(force.penetration, 1e-3 * share, 1e-8);
    EXPECT_LT((force.point - Vec3(0.0, 0.002, -0.001)).norm(), 1e-8);
  }
  EXPECT_FALSE(touch.at(Vec3(-1.01e-3, 0.0, 0.0)).contact);
}

TEST(Avila, DefaultLayerIsAsStiffAsTheMaterialWhateverTheFieldsUnit) {
  for (const double slope : {0.01, 3.0, 1e5}) {
    Touch touch = wall(slope, with(Formulation::consistent));
    touch.at(Vec3(0.001, 0.0, 0.0));
    const double step = 1e-4;
    const double low = touch.at(Vec3(-0.001, 0.0, 0.0)).force.x();
    const double high = touch.at(Vec3(-0.001 - step, 0.0, 0.0)).force.x();
    EXPECT_NEAR((high - low) / step, stiffness, 1e-3 * stiffness) << slope;
  }
}

TEST(Avila, HighInsideIsTheSameTurnedRound) {
  Touch low = wall(100.0, with(Formulation::consistent, 0.1), Inside::low);
  Touch high = wall(-100.0, with(Formulation::consistent, 0.1), Inside::high);
  for (const double x : {0.001, -0.0002, -0.0007, -0.002}) {
    EXPECT_LT((low.at(Vec3(x, 0.0, 0.0)).force - high.at(Vec3(x, 0.0, 0.0)).force).norm(), 1e-6);
  }
}

TEST(Avila, RetardsAgainstTheMotionMoreInsideTheLayer) {
  Touch touch = wall(100.0, with(Formulation::consistent, 0.1, 3.0, 2.0));
  const Vec3 v(0.0, 0.3, 0.1);
  touch.at(Vec3(0.001, 0.0, 0.0), v);
  const LawForce force = touch.at(Vec3(-0.25e-3, 0.0, 0.0), v);
  EXPECT_LT((force.force - (Vec3(0.75, 0.0, 0.0) - 2.0 * 1.25 * v)).norm(), 1e-4);
}

TEST(Avila, StartedInsideFeelsNothingUntilItHasBeenOutside) {
  Touch touch = wall(100.0, with(Formulation::consistent, 0.1));
  EXPECT_FALSE(touch.at(Vec3(-0.0005, 0.0, 0.0)).contact);
  EXPECT_FALSE(touch.at(Vec3(-0.0002, 0.0, 0.0)).contact);
  EXPECT_FALSE(touch.at(Vec3(0.0002, 0.0, 0.0)).contact);
  EXPECT_TRUE(touch.at(Vec3(-0.0002, 0.0, 0.0)).contact);
  // Leaving the volume and coming back into its inside is a start inside.
  EXPECT_FALSE(touch.at(Vec3(-0.021, 0.0, 0.0)).contact);
  EXPECT_FALSE(touch.at(Vec3(-0.0002, 0.0, 0.0)).contact);
}

TEST(Avila, AnswersNothingForInputThatIsNotANumber) {
  Touch touch = wall(100.0, with(Formulation::consistent, 0.1));
  touch.at(Vec3(0.001, 0.0, 0.0));
  EXPECT_FALSE(touch.at(Vec3(std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0)).contact);
}

// --- rows ---

/// Share of the passages through a layer `thickness` thick in which M1 answers at some tick.
double detected(double thickness, double speed, double rate, int passages) {
  const double advance = speed / rate;
  const double slope = 1e4;  // a steep field: 0.5 units over 0.05 mm
  Touch touch = wall(slope, with(Formulation::consistent, slope * thickness));
  Rng rng(7);
  int found = 0;
  for (int i = 0; i < passages; ++i) {
    touch.state = {};
    touch.state.seen_outside = false;
    bool felt = false;
    for (double x = advance * (1.0 + rng.uniform()); x > -thickness - advance; x -= advance)
      felt = felt || touch.at(Vec3(x, 1e-4, 2e-4), Vec3(-speed, 0.0, 0.0)).contact;
    found += felt ? 1 : 0;
  }
  return static_cast<double>(found) / passages;
}

TEST(Avila, M_3_MissesThinLayersAsTheSamplingSays) {
  constexpr int passages = 4000;
  struct Row {
    double thickness, speed, rate, expected;
  };
  for (const Row& row : {Row{0.05e-3, 0.2, 1400.0, 0.35}, Row{0.05e-3, 0.5, 1400.0, 0.14},
                         Row{0.2e-3, 0.2, 1400.0, 1.0}, Row{0.1e-3, 0.5, 1000.0, 0.2}}) {
    const double law = std::min(1.0, row.thickness * row.rate / row.speed);
    EXPECT_NEAR(law, row.expected, 1e-9);
    // Four standard deviations of a share of so many.
    const double tolerance = 4.0 * std::sqrt(law * (1.0 - law) / passages) + 1e-12;
    EXPECT_NEAR(detected(row.thickness, row.speed, row.rate, passages), law, tolerance);
  }
}

TEST(Avila, M_7_AnswersNothingAfterTheJumpOfFigure7) {
  // Steep at the crossing from A to B, gentle at the one from C to D, as in the figure.
  const auto field = sampled(cube(0.02, 64), [](const Vec3& p) {
    const double steepness = p.z() < 0.0 ? 40000.0 : 300.0;
    return 10.0 * std::tanh(steepness * p.x() / 10.0);
  });
  Touch touch;
  touch.surface = surface_of(field, 0.0);
  touch.law = with(Formulation::consistent, 1.0);
  EXPECT_FALSE(touch.at(Vec3(0.004, 0.0, -0.01)).contact);   // A
  EXPECT_FALSE(touch.at(Vec3(-0.004, 0.0, -0.01)).contact);  // B: beyond the layer, which it never saw
  EXPECT_TRUE(touch.at(Vec3(-0.002, 0.0, 0.01)).contact);    // C: within the thick part of it
  EXPECT_FALSE(touch.at(Vec3(0.004, 0.0, 0.01)).contact);    // D
}

// --- the printed form ---

TEST(AvilaLiteral, ErratumForceIsGreatestAtFirstTouchAndFallsInwards) {
  Touch literal = wall(100.0, with(Formulation::literal, 0.1));
  Touch consistent = wall(100.0, with(Formulation::consistent, 0.1));
  consistent.at(Vec3(0.001, 0.0, 0.0));
  for (const double share : {0.01, 0.5, 0.99}) {
    const Vec3 p(-1e-3 * share, 0.0, 0.0);
    EXPECT_NEAR(literal.at(p).force.x(), 3.0 * (1.0 - share), 1e-4);
    EXPECT_NEAR(consistent.at(p).force.x(), 3.0 * share, 1e-4);
  }
}

TEST(AvilaLiteral, ErratumHighValuesInsidePullInwards) {
  Touch touch = wall(-100.0, with(Formulation::literal, 0.1), Inside::high);
  const LawForce force = touch.at(Vec3(-0.5e-3, 0.0, 0.0));
  EXPECT_NEAR(force.force.x(), -1.5, 1e-4);
  EXPECT_GT(force.normal.x(), 0.99);
}

TEST(AvilaLiteral, ErratumRetardingForceDrivesAndDependsOnTheUnit) {
  const Vec3 v(0.0, 0.2, 0.0);
  for (const double unit : {1.0, 1000.0}) {
    Touch touch = wall(100.0 * unit, with(Formulation::literal, 0.1 * unit, 3.0, 2.0));
    const LawForce force = touch.at(Vec3(-0.5e-3, 0.0, 0.0), v);
    // f_r = C2 (d - d_i) + C2, along the motion: positive power, and a thousand units make it 25 times as strong.
    EXPECT_NEAR(force.force.y(), 2.0 * (0.05 * unit + 1.0) * 0.2, 1e-3 * unit);
    EXPECT_GT(force.force.dot(v), 0.0);
  }
}

TEST(AvilaLiteral, PushesWhoeverStartsInTheLayer) {
  Touch touch = wall(100.0, with(Formulation::literal, 0.1));
  EXPECT_TRUE(touch.at(Vec3(-0.0005, 0.0, 0.0)).contact);
  EXPECT_FALSE(touch.at(Vec3(-0.0011, 0.0, 0.0)).contact);
  EXPECT_FALSE(touch.at(Vec3(0.0001, 0.0, 0.0)).contact);
}

TEST(AvilaLiteral, TellsHowFarItIsToTheThresholdAndWhereThatIs) {
  // The field is 100 or -100 a metre along x: its threshold lies in the plane x = 0, whose outside is x > 0.
  for (const Inside inside : {Inside::low, Inside::high}) {
    Touch touch = wall(inside == Inside::low ? 100.0 : -100.0, with(Formulation::literal, 0.1), inside);
    for (const double depth : {0.1e-3, 0.5e-3, 0.9e-3}) {
      const LawForce force = touch.at(Vec3(-depth, 0.002, -0.001));
      ASSERT_TRUE(force.contact);
      EXPECT_NEAR(force.penetration, depth, 1e-8);
      EXPECT_LT((force.point - Vec3(0.0, 0.002, -0.001)).norm(), 1e-8);
    }
  }
}

// --- options ---

TEST(AvilaLaw, NamesAndOptions) {
  EXPECT_EQ(law_name(Law(AvilaLaw{})), "avila");
  const auto literal = law_by_name("avila-literal");
  ASSERT_TRUE(literal.ok());
  EXPECT_EQ(literal->as<AvilaLaw>()->formulation, Formulation::literal);
  EXPECT_EQ(law_name(*literal), "avila-literal");
  EXPECT_TRUE(validate(Law(AvilaLaw{})).ok());
  EXPECT_TRUE((literal->facts().needs == LawNeeds::field));
  const auto place_of = [](const AvilaLaw& law) {
    const Status status = validate(Law(law));
    return status.ok() ? std::string("accepted") : status.error().place;
  };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  constexpr Formulation form = Formulation::consistent;
  EXPECT_EQ(place_of({form, -1.0, 3.0, 0.0}), "band");
  EXPECT_EQ(place_of({form, nan, 3.0, 0.0}), "band");
  EXPECT_EQ(place_of({form, 0.0, 0.0, 0.0}), "largest_force");
  EXPECT_EQ(place_of({form, 0.0, nan, 0.0}), "largest_force");
  EXPECT_EQ(place_of({form, 0.0, 3.0, -0.1}), "retarding");
  EXPECT_EQ(place_of({form, 0.0, 3.0, std::numeric_limits<double>::infinity()}), "retarding");
}

}  // namespace
}  // namespace asperity::avila_test
