#include <gtest/gtest.h>

#include <array>
#include <limits>

#include "tests/render/implicit_touch.h"

namespace asperity::magnetic_test {
namespace {

using implicit::far_outside;
using implicit::forces_along;
using implicit::largest_jump_on;
using implicit::loop_work;
using implicit::MagnetTouch;
using implicit::PointTouch;
using implicit::surface_of;
using implicit::WholeTouch;
using test::stiffness;

constexpr double voxel = 1e-3;
constexpr double half = 0.02;  // m, of the box
constexpr double band = 3e-3;  // m, of attraction

std::shared_ptr<const ImplicitSurface> box() {
  static const auto surface = surface_of(test::sparse_box(voxel, 8e-3));
  return surface;
}

MagnetTouch magnet(Formulation formulation) {
  return {box(), {formulation, band}, {}};
}

Vec3 over_the_top(double height) {
  return {0.003, -0.002, half + height};
}

TEST(Magnetic, K_7_PrintedAttractionIsProportionalInTheBandAndNothingBeyond) {
  MagnetTouch touch = magnet(Formulation::literal);
  Rng rng(1);
  for (int i = 0; i < 200; ++i) {
    const double height = rng.uniform(1e-6, 0.999 * band);
    const LawForce force = touch.at(over_the_top(height));
    ASSERT_TRUE(force.contact);
    EXPECT_LT((force.force - Vec3(0.0, 0.0, -stiffness * height)).norm(), 1e-5);
    EXPECT_LT((force.point - over_the_top(0.0)).norm(), 1e-8);
    EXPECT_NEAR(force.penetration, -height, 1e-8);
    EXPECT_FALSE(touch.at(over_the_top(rng.uniform(1.001 * band, 3.0 * band))).contact);
  }
  // At the band's edge the force drops from k e to nothing.
  const double inside = touch.at(over_the_top(band - 1e-8)).force.z();
  const double outside = touch.at(over_the_top(band + 1e-8)).force.z();
  EXPECT_NEAR(outside - inside, stiffness * band, 1e-4);
}

TEST(Magnetic, K_7_OursIsTheSlopeOfAWindowAndJoinsOnBothSides) {
  MagnetTouch touch = magnet(Formulation::consistent);
  Rng rng(2);
  for (int i = 0; i < 200; ++i) {
    const double height = rng.uniform(1e-6, 0.999 * band);
    const double window = 1.0 - height * height / (band * band);
    const LawForce force = touch.at(over_the_top(height));
    ASSERT_TRUE(force.contact);
    EXPECT_LT((force.force - Vec3(0.0, 0.0, -stiffness * height * window * window)).norm(), 1e-5);
    EXPECT_LT((force.point - over_the_top(0.0)).norm(), 1e-8);
    EXPECT_NEAR(force.penetration, -height, 1e-8);
    EXPECT_FALSE(touch.at(over_the_top(rng.uniform(1.001 * band, 3.0 * band))).contact);
  }
  // Near the surface both sides are the same spring.
  const double small = 1e-6;
  EXPECT_NEAR(touch.at(over_the_top(small)).force.z(), -stiffness * small, 1e-5 * stiffness * voxel);
  EXPECT_NEAR(touch.at(over_the_top(-small)).force.z(), stiffness * small, 1e-5 * stiffness * voxel);
}

TEST(Magnetic, K_7_InAndOutAgainDoesNoWork) {
  for (const double depth : {2.5e-3, 0.1e-3, -1.5e-3}) {
    for (const double aside : {0.0, 4e-3}) {
      std::vector<Vec3> path = test::line(over_the_top(1.5 * band), over_the_top(-depth), 4000);
      const Vec3 end = over_the_top(1.5 * band) + Vec3(aside, 0.3 * aside, 0.0);
      for (const std::vector<Vec3>& more : {test::line(path.back(), path.back() + Vec3(aside, 0.3 * aside, 0.0), 4000),
                                            test::line(path.back() + Vec3(aside, 0.3 * aside, 0.0), end, 4000)})
        path.insert(path.end(), more.begin(), more.end());
      MagnetTouch ours = magnet(Formulation::consistent);
      EXPECT_LT(std::abs(loop_work(ours, path)), 1e-9);
    }
  }
}

TEST(Magnetic, T_1_OursDoesNoWorkInAClosedLoop) {
  const std::array<std::pair<std::shared_ptr<const ImplicitSurface>, Vec3>, 3> cases = {{
      {surface_of(test::sparse_ball(voxel, 8e-3)), Vec3(0.0, 0.0, 0.031)},
      {box(), Vec3(half, 0.0, half)},
      {box(), Vec3(half, half, half)},
  }};
  double printed_worst = 0.0;
  for (const auto& [surface, centre] : cases) {
    Rng rng(12);
    for (int i = 0; i < 3; ++i) {
      const std::vector<Vec3> loop = test::random_loop(rng, centre, 3e-3, 3e-3, 20000);
      const double scale = stiffness * test::loop_area(loop);
      MagnetTouch ours{surface, {Formulation::consistent, band}, {}};
      EXPECT_LT(std::abs(loop_work(ours, loop)), 1e-6 * scale);
      std::vector<Vec3> coarse;
      for (std::size_t j = 0; j < loop.size(); j += 10) coarse.push_back(loop[j]);
      MagnetTouch printed{surface, {Formulation::literal, band}, {}};
      printed_worst = std::max(printed_worst, std::abs(loop_work(printed, coarse)) / scale);
    }
  }
  RecordProperty("literal, of k A", std::to_string(printed_worst));
  EXPECT_GT(printed_worst, 1e-3);
}

TEST(Magnetic, ForceChangesWithTheStep) {
  const std::array<std::pair<Vec3, Vec3>, 3> ways = {{
      {over_the_top(1.5 * band), over_the_top(-2e-3)},
      {{0.012, 0.014, half + 1.1e-3}, {half + 1.3 * band, half + 0.6e-3, half - 2.7e-3}},
      {{half - 3e-3, 0.002, half - 3.3e-3}, {half + 5e-3, 0.001, half + 5e-3}},
  }};
  for (const auto& [from, to] : ways) {
    double last = 0.0;
    for (const double step : {4e-5, 4e-6, 4e-7}) {
      const double jump = largest_jump_on(magnet(Formulation::consistent), from, to, step);
      EXPECT_LT(jump, 12.0 * stiffness * step);
      if (last > 0.0) {
        EXPECT_NEAR(last / jump, 10.0, 2.0);
      }
      last = jump;
    }
  }
}

TEST(Magnetic, InsideIsTheVirtualContactPoint) {
  for (const Formulation formulation : {Formulation::literal, Formulation::consistent}) {
    MagnetTouch touch = magnet(formulation);
    PointTouch point{touch.surface, {}, {}};
    point.law.formulation = formulation;
    touch.at(far_outside());
    point.at(far_outside());
    Rng rng(9);
    for (int i = 0; i < 200; ++i) {
      const Vec3 p(half - rng.uniform(0.1e-3, 4e-3), rng.uniform(-0.01, 0.01), half - rng.uniform(0.1e-3, 4e-3));
      EXPECT_LT((touch.at(p).force - point.at(p).force).norm(), 1e-12);
    }
  }
}

TEST(Magnetic, FrictionIsThatOfTheVirtualContactPointAndEndsAtTheSurface) {
  for (const Formulation formulation : {Formulation::literal, Formulation::consistent}) {
    MagnetTouch touch = magnet(formulation);
    touch.material.static_friction = touch.material.dynamic_friction = 0.6;
    touch.at(far_outside());
    LawForce force;
    for (int i = 0; i < 100; ++i) force = touch.at(Vec3(-0.005 + 5e-5 * i, 0.0, half - 0.5e-3));
    EXPECT_NEAR(-force.force.x(), 0.075, 2e-4);
    for (int i = 0; i < 100; ++i) force = touch.at(Vec3(-0.005 + 5e-5 * i, 0.0, half + 0.5e-3));
    EXPECT_NEAR(force.force.x(), 0.0, 1e-9);
    EXPECT_LT(force.force.z(), -0.4);
  }
}

TEST(Magnetic, WhoStartsInsideIsNotPushedByOursUntilItHasBeenOutside) {
  MagnetTouch ours = magnet(Formulation::consistent);
  EXPECT_FALSE(ours.at(over_the_top(-1e-3)).contact);
  EXPECT_TRUE(ours.at(over_the_top(1e-3)).contact);
  EXPECT_TRUE(ours.at(over_the_top(-1e-3)).contact);
  MagnetTouch printed = magnet(Formulation::literal);
  EXPECT_TRUE(printed.at(over_the_top(-1e-3)).contact);
}

TEST(Magnetic, DampingTakesEnergyOnBothSidesAndFadesWithTheBand) {
  MagnetTouch ours = magnet(Formulation::consistent);
  ours.material.damping = 2.0;
  const Vec3 velocity(0.3, 0.0, 0.1);
  for (const double height : {2.9e-3, 1.5e-3, 1e-6, -1e-6, -1e-3}) {
    const Vec3 still = ours.at(over_the_top(height)).force;
    const Vec3 moving = ours.at(over_the_top(height), velocity).force;
    const double share = std::max(0.0, height) / band;
    const double window = (1.0 - share * share) * (1.0 - share * share);
    EXPECT_LT((moving - still - Vec3(0.0, 0.0, -0.2 * window)).norm(), 1e-5) << height;
  }
  MagnetTouch printed = magnet(Formulation::literal);
  printed.material.damping = 2.0;
  const Vec3 still = printed.at(over_the_top(1e-3)).force;
  EXPECT_LT((printed.at(over_the_top(1e-3), velocity).force - still + 2.0 * velocity).norm(), 1e-12);
}

TEST(Magnetic, ChangesOfStiffnessGiveNoMoreThanTheyTook) {
  SparseSource source = test::sparse_source([](const Vec3& p) { return test::box_distance(p, Vec3::Constant(half)); },
                                            test::cube(half), voxel, 6e-3, 6e-3);
  for (SparseBlock& block : source.blocks) {
    block.material.resize(SparseBlock::points);
    for (int n = 0; n < static_cast<int>(SparseBlock::points); ++n) {
      const double x = voxel * (SparseBlock::side * block.at[0] + n % SparseBlock::side);
      block.material[static_cast<std::size_t>(n)].stiffness = x < 0.0 ? 500.0F : 1500.0F;
    }
  }
  const auto surface = surface_of(std::make_shared<const SparseGrid>(test::must(SparseGrid::build(std::move(source)))));
  // In where it draws, along the surface, out where it draws less: that would give the difference of the two wells.
  const auto work = [&](Formulation formulation, double from, double to) {
    std::vector<Vec3> path;
    const std::array<Vec3, 5> corners = {Vec3(from, 0.0, half + 4e-3), Vec3(from, 0.0, half), Vec3(to, 0.0, half),
                                         Vec3(to, 0.0, half + 4e-3), Vec3(from, 0.0, half + 4e-3)};
    for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
      const std::vector<Vec3> part = test::line(corners[i], corners[i + 1], 4000);
      path.insert(path.end(), part.begin(), part.end());
    }
    WholeTouch touch(MagnetTouch{surface, {formulation, band}, {}});
    return loop_work(touch, path);
  };
  const double printed = 1000.0 * band * band / 2.0;
  EXPECT_NEAR(work(Formulation::literal, 5e-3, -5e-3), printed, 0.01 * printed);
  EXPECT_LT(work(Formulation::consistent, 5e-3, -5e-3), 1e-6);
  EXPECT_NEAR(work(Formulation::consistent, -5e-3, 5e-3), -1000.0 * band * band / 6.0, 1e-5);
}

TEST(Magnetic, ProbesThatMeanNothingAreNotFelt) {
  for (const Formulation formulation : {Formulation::literal, Formulation::consistent}) {
    MagnetTouch touch = magnet(formulation);
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    for (const Vec3& p : {Vec3(nan, 0.0, 0.0), Vec3(0.0, infinity, 0.0), Vec3(1e6, -1e6, 1e6)}) {
      const LawForce force = touch.at(p);
      EXPECT_FALSE(force.contact);
      EXPECT_TRUE(force.force.isZero());
    }
    EXPECT_TRUE(touch.at(over_the_top(1e-3)).contact);
  }
}

}  // namespace
}  // namespace asperity::magnetic_test
