#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "asperity/core/rng.h"
#include "asperity/render/law_registry.h"
#include "asperity/render/laws.h"
#include "tests/render/asked_law.h"
#include "tests/render/volumes.h"

namespace asperity::cross_uncross_test {
namespace {

using volumes::cube;
using volumes::sampled;
using volumes::surface_of;

constexpr double stiffness = 1000.0;

/// A law that is felt on one surface, tick by tick.
struct Touch {
  std::shared_ptr<const IsoSurface> surface;
  CrossUncrossLaw law;
  Contact state;
  SurfaceCache cache;

  /// What it remembers of its field.
  [[nodiscard]] CrossUncrossLaw::State& memory() { return detail::law_state<CrossUncrossLaw::State>(state.law.memory); }

  LawForce at(const Vec3& p, const Vec3& v = Vec3::Zero()) { return through(surface->view(cache), p, v); }
  LawForce through(const IsoView& view, const Vec3& p, const Vec3& v = Vec3::Zero()) {
    Material material;
    material.stiffness = stiffness;
    return test::asked(law, surface, view, material, p, v, Seconds(1e-3), state, cache);
  }
};

Touch touching(std::shared_ptr<const IsoSurface> surface, Formulation formulation = Formulation::consistent) {
  Touch touch;
  touch.surface = std::move(surface);
  touch.law.formulation = formulation;
  return touch;
}

/// The field `slope` x over |x|, |y|, |z| <= 0.02, its surface at x = 0; low values, x < 0, are inside.
std::shared_ptr<const IsoSurface> wall(double slope, Inside inside = Inside::low) {
  return surface_of(sampled(cube(0.02, 8), [slope](const Vec3& p) { return slope * p.x(); }), 0.0, inside);
}

/// Distance from the centre over |x|, |y|, |z| <= 0.02, touched as a ball of 10 mm.
std::shared_ptr<const IsoSurface> ball() {
  return surface_of(sampled(cube(0.02, 48), [](const Vec3& p) { return p.norm(); }), 0.01);
}

// --- the consistent form ---

TEST(CrossUncross, IsASpringToTheSurfaceFromTheCrossingOn) {
  for (const Inside inside : {Inside::low, Inside::high}) {
    Touch touch = touching(wall(inside == Inside::low ? 50.0 : -50.0, inside));
    EXPECT_FALSE(touch.at(Vec3(0.001, 0.0, 0.0)).contact);
    for (const double depth : {1e-6, 0.5e-3, 4e-3, 1e-3}) {
      const LawForce force = touch.at(Vec3(-depth, 0.001, 0.002));
      ASSERT_TRUE(force.contact);
      EXPECT_LT((force.force - Vec3(stiffness * depth, 0.0, 0.0)).norm(), 1e-5);
      EXPECT_NEAR(force.penetration, depth, 1e-8);
      EXPECT_LT((force.normal - Vec3::UnitX()).norm(), 1e-5);
    }
    EXPECT_FALSE(touch.at(Vec3(1e-6, 0.001, 0.002)).contact);
    EXPECT_FALSE(touch.memory().crossed);
  }
}

TEST(CrossUncross, RetardsAgainstTheMotionWhileCrossed) {
  Touch touch = touching(wall(50.0));
  touch.law.retarding = 2.0;
  const Vec3 v(-0.1, 0.3, 0.0);
  EXPECT_EQ(touch.at(Vec3(0.001, 0.0, 0.0), v).force, Vec3::Zero());
  EXPECT_LT((touch.at(Vec3(-0.001, 0.0, 0.0), v).force - (Vec3(1.0, 0.0, 0.0) - 2.0 * v)).norm(), 1e-5);
}

TEST(CrossUncross, FollowsTheSurfaceWhileTheProbeSlidesUnderIt) {
  Touch touch = touching(ball());
  double worst_point = 0.0;
  double worst_direction = 0.0;
  touch.at(Vec3(0.0, 0.0, 0.011));
  for (int i = 0; i <= 600; ++i) {
    // Half way round the ball, 1 mm deep, in two seconds at 300 Hz.
    const double angle = 3.0 * i / 600.0;
    const Vec3 out(std::sin(angle) * std::cos(0.3), std::sin(angle) * std::sin(0.3), std::cos(angle));
    const LawForce force = touch.at(0.009 * out);
    ASSERT_TRUE(force.contact) << i;
    worst_point = std::max(worst_point, std::abs(force.point.norm() - 0.01));
    worst_direction = std::max(worst_direction, std::acos(std::min(1.0, force.force.normalized().dot(out))));
  }
  EXPECT_LT(worst_point, 5e-6);  // the field's own error at this resolution
  EXPECT_LT(worst_direction * 57.3, 0.5);
}

TEST(CrossUncross, StaysOnTheSurfaceThatItCameThroughOverAHollow) {
  // Half a space under z = 0 with a hollow ball in it. A probe that slides along beneath the hollow is still held to
  // the top that it came in by, as deep as before, though the hollow's wall is nearer.
  const auto hollow = surface_of(
      sampled(cube(0.02, 81), [](const Vec3& p) { return std::max(p.z(), 2e-3 - (p - Vec3(0.0, 0.0, -6e-3)).norm()); }),
      0.0);
  Touch touch = touching(hollow);
  constexpr double depth = 0.011;
  touch.at(Vec3(-0.01, 0.001, 0.001));
  for (int i = 0; i <= 200; ++i) {
    const Vec3 p(-0.01 + 1e-4 * i, 0.001, -depth);
    const LawForce force = touch.at(p);
    ASSERT_TRUE(force.contact) << i;
    ASSERT_LT((force.force - Vec3(0.0, 0.0, stiffness * depth)).norm(), 1e-3) << i;
  }
}

TEST(CrossUncross, ForceIsContinuousWhileSliding) {
  Touch touch = touching(ball());
  touch.at(Vec3(0.0, 0.0, 0.011));
  Vec3 last = touch.at(Vec3(0.0, 0.0, 0.009)).force;
  for (int i = 1; i <= 2000; ++i) {
    const double angle = 3.0 * i / 2000.0;
    const Vec3 force = touch.at(0.009 * Vec3(std::sin(angle), 0.0, std::cos(angle))).force;
    ASSERT_LT((force - last).norm(), 0.02) << i;  // the probe moves 13.5 um a tick: 0.0135 N, and the turn
    last = force;
  }
}

TEST(CrossUncross, ClosedWaysUnderASmoothSurfaceGainNothing) {
  // Loops of 0.5 to 4 mm depth under a quarter of the ball: what the spring takes on the way down it gives back.
  Touch touch = touching(ball());
  touch.at(Vec3(0.0, 0.0, 0.011));
  const auto place = [](double turn) {
    const double angle = 0.8 * std::sin(turn);
    const double depth = 2.25e-3 - 1.75e-3 * std::cos(turn);
    return Vec3((0.01 - depth) * Vec3(std::sin(angle), 0.3 * std::sin(2.0 * turn), std::cos(angle)).normalized());
  };
  Vec3 last = place(0.0);
  Vec3 before = touch.at(last).force;
  double work = 0.0;
  constexpr int ticks = 2000;
  for (int i = 1; i <= ticks; ++i) {
    const Vec3 p = place(2.0 * 3.14159265358979 * i / ticks);
    const Vec3 force = touch.at(p).force;
    work += 0.5 * (force + before).dot(p - last);
    before = force;
    last = p;
  }
  const double stored = 0.5 * stiffness * 4e-3 * 4e-3;
  EXPECT_LT(std::abs(work), 1e-3 * stored);
}

TEST(CrossUncross, StartedInsideFeelsNothingUntilItHasBeenOutside) {
  Touch touch = touching(wall(50.0));
  EXPECT_FALSE(touch.at(Vec3(-0.002, 0.0, 0.0)).contact);
  EXPECT_FALSE(touch.at(Vec3(-0.001, 0.0, 0.0)).contact);
  EXPECT_FALSE(touch.at(Vec3(0.001, 0.0, 0.0)).contact);
  EXPECT_TRUE(touch.at(Vec3(-0.001, 0.0, 0.0)).contact);
}

TEST(CrossUncross, EndsWhereTheVolumeEnds) {
  Touch touch = touching(wall(50.0));
  touch.at(Vec3(0.001, 0.0, 0.0));
  EXPECT_TRUE(touch.at(Vec3(-0.001, 0.0, 0.0)).contact);
  EXPECT_FALSE(touch.at(Vec3(-0.021, 0.0, 0.0)).contact);
  EXPECT_FALSE(touch.at(Vec3(-0.001, 0.0, 0.0)).contact);  // came in through the volume's end
  EXPECT_FALSE(touch.at(Vec3(std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0)).contact);
}

TEST(CrossUncross, MotionFromBeyondTheVolumeStillCrosses) {
  Touch touch = touching(wall(50.0));
  touch.at(Vec3(0.05, 0.0, 0.0));
  EXPECT_TRUE(touch.at(Vec3(-0.001, 0.0, 0.0)).contact);
}

TEST(CrossUncross, SheetCrossedAndUncrossedWithinATickLeavesNothing) {
  // Low within 0.3 mm of x = 0: two faces, both passed at once.
  const auto sheet = surface_of(sampled(cube(0.02, 201), [](const Vec3& p) { return std::abs(p.x()); }), 0.3e-3);
  Touch touch = touching(sheet);
  touch.at(Vec3(0.005, 0.0, 0.0));
  EXPECT_FALSE(touch.at(Vec3(-0.005, 0.0, 0.0)).contact);
  EXPECT_FALSE(touch.memory().crossed);
  // Back over both faces and into the sheet, then on: the contact is the one with the face crossed last.
  const LawForce force = touch.at(Vec3(-0.1e-3, 0.0, 0.0));
  ASSERT_TRUE(force.contact);
  EXPECT_LT(force.force.x(), 0.0);
  EXPECT_NEAR(force.penetration, 0.2e-3, 2e-5);
}

TEST(CrossUncross, ThresholdThatPassesOverTheProbePicksItUpAndLetsItGo) {
  Touch touch = touching(wall(50.0));
  const Vec3 p(0.001, 0.0, 0.0);  // where the field is 0.05
  EXPECT_FALSE(touch.through(touch.surface->view(touch.cache.cells, 0, 0.0), p).contact);
  EXPECT_FALSE(touch.through(touch.surface->view(touch.cache.cells, 0, 0.04), p).contact);
  double last = 0.0;
  for (const double threshold : {0.051, 0.06, 0.07, 0.08}) {
    const LawForce force = touch.through(touch.surface->view(touch.cache.cells, 0, threshold), p);
    ASSERT_TRUE(force.contact) << threshold;
    EXPECT_NEAR(force.force.x(), stiffness * (threshold / 50.0 - 0.001), 1e-4);
    EXPECT_GT(force.force.x(), last);
    last = force.force.x();
  }
  EXPECT_FALSE(touch.through(touch.surface->view(touch.cache.cells, 0, 0.045), p).contact);
  EXPECT_TRUE(touch.state.seen_outside);
}

RC_GTEST_PROP(CrossUncross, ContactIsTheSideOfTheProbeOnceSeenOutside, ()) {
  static const auto gyroid = surface_of(sampled(cube(0.02, 24),
                                                [](const Vec3& p) {
                                                  const Vec3 q = 400.0 * p;
                                                  return std::sin(q.x()) * std::cos(q.y()) +
                                                         std::sin(q.y()) * std::cos(q.z()) +
                                                         std::sin(q.z()) * std::cos(q.x());
                                                }),
                                        0.2);
  const auto number = [] { return 0.019 * (1e-4 * *rc::gen::inRange(-10000, 10001)); };
  Touch touch = touching(gyroid);
  bool outside_before = false;
  for (int i = 0; i < 12; ++i) {
    const Vec3 p(number(), number(), number());
    const LawForce force = touch.at(p);
    FieldJet jet;
    CellCache hint;
    RC_ASSERT(gyroid->view(hint).sample(p, jet));
    const bool inside = jet.value < 0.2;
    outside_before = outside_before || !inside || touch.state.seen_outside;
    if (std::abs(jet.value - 0.2) < 1e-6) continue;
    RC_ASSERT(force.contact == (inside && touch.state.seen_outside));
    if (!force.contact) continue;
    RC_ASSERT(gyroid->view(hint).sample(force.point, jet));
    RC_ASSERT(std::abs(jet.value - 0.2) < 1e-4);
    RC_ASSERT(force.force.isApprox(stiffness * (force.point - p), 1e-9));
  }
}

// --- rows ---

TEST(CrossUncross, M_3_DetectsEveryCrossingAtAnySpeed) {
  const auto surface = wall(1e4);
  Rng rng(11);
  for (const double speed : {0.01, 0.05, 0.2, 0.5, 2.0, 20.0}) {
    const double advance = speed / 1400.0;
    for (int i = 0; i < 300; ++i) {
      Touch touch = touching(surface);
      double x = advance * rng.uniform();
      const Vec3 side(0.0, 0.01 * rng.uniform(), 0.01 * rng.uniform());
      touch.at(Vec3(x, 0.0, 0.0) + side);
      x -= advance;
      const LawForce force = touch.at(Vec3(x, 0.0, 0.0) + side);
      ASSERT_EQ(force.contact, x < 0.0) << speed << " " << i;
      if (x < 0.0) {
        ASSERT_NEAR(force.penetration, -x, 1e-7);
      }
      x -= advance;
      if (x > -0.02) {
        ASSERT_TRUE(touch.at(Vec3(x, 0.0, 0.0) + side).contact);
      }
    }
  }
}

/// Steep where z < 0, gentle where z > 0: Fig. 7's crossing from A to B and the one from C to D.
std::shared_ptr<const IsoSurface> figure_7() {
  return surface_of(sampled(cube(0.02, 64),
                            [](const Vec3& p) {
                              const double steepness = p.z() < 0.0 ? 40000.0 : 300.0;
                              return 10.0 * std::tanh(steepness * p.x() / 10.0);
                            }),
                    0.0);
}

constexpr double a_to_d[4][3] = {{0.004, 0.0, -0.01}, {-0.004, 0.0, -0.01}, {-0.002, 0.0, 0.01}, {0.004, 0.0, 0.01}};

TEST(CrossUncross, M_7_SequenceOfFigure7) {
  Touch touch = touching(figure_7());
  Vec3 forces[4];
  for (int i = 0; i < 4; ++i) forces[i] = touch.at(Vec3(a_to_d[i][0], a_to_d[i][1], a_to_d[i][2])).force;
  EXPECT_EQ(forces[0], Vec3::Zero());
  EXPECT_NEAR(forces[1].x(), 4.0, 0.05);  // F1 at B, k times 4 mm
  EXPECT_NEAR(forces[2].x(), 2.0, 0.05);  // F2 at C
  EXPECT_EQ(forces[3], Vec3::Zero());     // F3 at D
}

TEST(CrossUncrossLiteral, M_7_PrintedLoopNeverPushesInFigure7) {
  Touch touch = touching(figure_7(), Formulation::literal);
  for (const auto& p : a_to_d) EXPECT_EQ(touch.at(Vec3(p[0], p[1], p[2])).force, Vec3::Zero());
}

// --- the printed form ---

TEST(CrossUncrossLiteral, ErratumPathLoopLeavesAtItsFirstOutsidePoint) {
  const auto surface = wall(50.0);
  const auto contacts = [&](Formulation formulation) {
    int count = 0;
    for (int i = 0; i < 100; ++i) {
      Touch touch = touching(surface, formulation);
      touch.at(Vec3(0.001 + 1e-5 * i, 0.0, 0.0));
      count += touch.at(Vec3(-0.012, 0.0, 0.0)).contact ? 1 : 0;
    }
    return count;
  };
  EXPECT_EQ(contacts(Formulation::literal), 0);
  EXPECT_EQ(contacts(Formulation::consistent), 100);
}

TEST(CrossUncrossLiteral, CrossingIsNoticedATickLateAndFeltTwoTicksLate) {
  Touch touch = touching(wall(50.0), Formulation::literal);
  const Vec3 inside(-0.008, 0.0, 0.0);
  touch.at(Vec3(0.003, 0.0, 0.0));
  EXPECT_FALSE(touch.at(inside).contact);  // left the loop at the first point of the path
  EXPECT_FALSE(touch.memory().crossed);
  EXPECT_FALSE(touch.at(inside).contact);  // the path begins inside: Cross = 1, and Exit
  EXPECT_TRUE(touch.memory().crossed);
  const LawForce force = touch.at(inside);
  ASSERT_TRUE(force.contact);
  EXPECT_GT(force.force.x(), 0.0);
  EXPECT_FALSE(touch.at(Vec3(0.003, 0.0, 0.0)).contact);
}

TEST(CrossUncrossLiteral, ErratumSampleNearestTheThresholdIsOffByUpToHalfACell) {
  // The surface at 0.35 of a cell: the nearest grid point is 0.35 cells from it.
  const double cell = 0.04 / 7.0;
  const auto surface =
      surface_of(sampled(cube(0.02, 8), [&](const Vec3& p) { return p.x() + 0.02 - 3.35 * cell; }), 0.0);
  const Vec3 inside(-0.02 + 2.1 * cell, 0.0, 0.0);
  Touch literal = touching(surface, Formulation::literal);
  literal.at(Vec3(-0.02 + 5.0 * cell, 0.0, 0.0));
  for (int i = 0; i < 2; ++i) literal.at(inside);
  const LawForce force = literal.at(inside);
  ASSERT_TRUE(force.contact);
  EXPECT_NEAR(force.point.x(), -0.02 + 3.0 * cell, 1e-9);
  Touch consistent = touching(surface);
  consistent.at(Vec3(-0.02 + 5.0 * cell, 0.0, 0.0));
  EXPECT_NEAR(consistent.at(inside).point.x(), -0.02 + 3.35 * cell, 1e-8);
}

TEST(CrossUncrossLiteral, ErratumGradientOfTheCrossingIsStaleAfterSliding) {
  // Crossed at the ball's pole, then half way round it: the line along the pole's gradient runs through the ball.
  const auto slide = [](Formulation formulation) {
    Touch touch = touching(ball(), formulation);
    touch.at(Vec3(0.0, 0.0, 0.012));
    LawForce force;
    for (int i = 0; i <= 400; ++i) {
      const double angle = 2.0 * i / 400.0;
      force = touch.at(0.008 * Vec3(std::sin(angle), 0.0, std::cos(angle)));
    }
    return force;
  };
  const Vec3 out(std::sin(2.0), 0.0, std::cos(2.0));
  const LawForce stale = slide(Formulation::literal);
  // Straight up to the surface of the upper half: 10 mm and more instead of 2 mm.
  ASSERT_TRUE(stale.contact);
  EXPECT_GT(stale.penetration, 0.008);
  EXPECT_LT(stale.force.normalized().dot(out), 0.0);
  const LawForce fresh = slide(Formulation::consistent);
  ASSERT_TRUE(fresh.contact);
  EXPECT_NEAR(fresh.penetration, 0.002, 1e-5);
  EXPECT_GT(fresh.force.normalized().dot(out), 0.9999);
}

TEST(CrossUncrossLiteral, ErratumShortReachMissesTheSurface) {
  Touch touch = touching(wall(50.0), Formulation::literal);
  touch.law.reach = 0.007;
  touch.at(Vec3(0.003, 0.0, 0.0));
  for (int i = 0; i < 2; ++i) touch.at(Vec3(-0.003, 0.0, 0.0));
  EXPECT_TRUE(touch.at(Vec3(-0.003, 0.0, 0.0)).contact);
  EXPECT_FALSE(touch.at(Vec3(-0.015, 0.0, 0.0)).contact);
  EXPECT_TRUE(touch.memory().crossed);  // still held, and nothing felt
}

TEST(CrossUncrossLiteral, ErratumLineOfGridPointsSkipsWhatTheMotionPasses) {
  // Everything is inside but for a bubble of outside, about a cell wide, around one node. Random motions through it:
  // whoever sees it uncrosses on the way.
  const auto surface =
      surface_of(sampled(cube(0.02, 41), [](const Vec3& p) { return p.norm() < 1e-9 ? 1.0 : -1.0; }), 0.0);
  CellCache hint;
  const auto outside = [&](const Vec3& p) {
    FieldJet jet;
    return surface->view(hint).sample(p, jet) && jet.value > 0.0;
  };
  Rng rng(3);
  const auto within = [&rng](double half) {
    return Vec3(rng.uniform(-half, half), rng.uniform(-half, half), rng.uniform(-half, half));
  };
  int passed = 0;
  int seen_by_roots = 0;
  int seen_by_grid_points = 0;
  while (passed < 400) {
    const Vec3 from = within(0.012);
    const Vec3 to = 2.0 * within(0.0005) - from;
    bool passes = false;
    for (int i = 0; i <= 2000 && !passes; ++i) passes = outside(from + i / 2000.0 * (to - from));
    if (!passes || outside(from) || outside(to)) continue;
    ++passed;
    seen_by_roots += surface->view(hint).first_crossing({from, to}).found ? 1 : 0;
    Touch touch = touching(surface, Formulation::literal);
    touch.at(from);
    touch.memory().crossed = true;
    touch.state.surface.normal = Vec3::UnitX();
    touch.at(to);
    seen_by_grid_points += touch.memory().crossed ? 0 : 1;
  }
  EXPECT_EQ(seen_by_roots, passed);
  EXPECT_LT(seen_by_grid_points, 0.75 * passed);
  EXPECT_GT(seen_by_grid_points, 0.45 * passed);  // it is 0.61
}

TEST(CrossUncrossLiteral, WalkIsBoundedOnEndlessMotions) {
  Touch touch = touching(ball(), Formulation::literal);
  touch.at(Vec3(0.0, 0.0, 0.008));
  touch.at(Vec3(1e6, -1e6, 1e6));
  EXPECT_FALSE(touch.at(Vec3(0.0, 0.0, 0.008)).contact);
}

// --- options ---

TEST(CrossUncrossLaw, NamesAndOptions) {
  EXPECT_EQ(law_name(Law(CrossUncrossLaw{})), "cross-uncross");
  const auto literal = law_by_name("cross-uncross-literal");
  ASSERT_TRUE(literal.ok());
  EXPECT_EQ(literal->as<CrossUncrossLaw>()->formulation, Formulation::literal);
  EXPECT_EQ(law_name(*literal), "cross-uncross-literal");
  EXPECT_TRUE((literal->facts().needs == LawNeeds::field));
  EXPECT_FALSE(Law(ProxyLaw{}).facts().needs == LawNeeds::field);
  const auto place_of = [](const CrossUncrossLaw& law) {
    const Status status = validate(Law(law));
    return status.ok() ? std::string("accepted") : status.error().place;
  };
  EXPECT_EQ(place_of({Formulation::consistent, 0.5, 0.0}), "accepted");
  EXPECT_EQ(place_of({Formulation::literal, 0.5, 0.01}), "accepted");
  EXPECT_EQ(place_of({Formulation::consistent, -0.5, 0.0}), "retarding");
  EXPECT_EQ(place_of({Formulation::literal, 0.0, -0.01}), "reach");
  EXPECT_EQ(place_of({Formulation::literal, 0.0, std::numeric_limits<double>::quiet_NaN()}), "reach");
  EXPECT_EQ(place_of({Formulation::consistent, 0.0, 0.01}), "reach");
}

}  // namespace
}  // namespace asperity::cross_uncross_test
