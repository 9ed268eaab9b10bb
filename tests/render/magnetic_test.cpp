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

TEST(Magnetic, K_7_PrintedAttractionIsProportionalToTheDistanceOfABall) {
  // Not by what the potential says: by how far a ball of 30 mm really is.
  MagnetTouch touch{surface_of(test::sparse_ball(voxel, 8e-3)), {Formulation::literal, band}, {}};
  Rng rng(6);
  for (int i = 0; i < 300; ++i) {
    const Vec3 way = Vec3(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)).normalized();
    const double height = rng.uniform(0.05 * band, 0.99 * band);
    const LawForce force = touch.at((0.03 + height) * way);
    // The trilinear potential of a ball is off by h^2 / 8 R along each axis at most.
    EXPECT_NEAR(-force.force.dot(way), stiffness * height, stiffness * 3.0 * voxel * voxel / (8.0 * 0.03));
    EXPECT_LT(force.force.cross(way).norm(), 0.02 * stiffness * height);
  }
}

TEST(Magnetic, K_7_OursIsASpringAtTheSurfaceAndGoneWithoutAKinkAtTheBandsEdge) {
  // What is asked of a window that makes k f continuous, and what its energy then is: of all even polynomials of the
  // fifth degree k f (1 + a f^2 + b f^4) just one has neither value nor slope at the edge, and it holds k e^2 / 6.
  MagnetTouch touch = magnet(Formulation::consistent);
  const auto pull = [&](double height) { return -touch.at(over_the_top(height)).force.z(); };
  const double small = 1e-3 * band;
  EXPECT_NEAR(pull(small) / small, stiffness, 0.01 * stiffness);
  EXPECT_NEAR(pull(-small) / -small, stiffness, 0.01 * stiffness);
  EXPECT_LT(pull(band - small), 1e-4 * stiffness * band);
  EXPECT_FALSE(touch.at(over_the_top(band + small)).contact);
  double energy = 0.0;
  double most = 0.0;
  double at = 0.0;
  constexpr int parts = 3000;
  for (int i = 0; i < parts; ++i) {
    const double height = band * (i + 0.5) / parts;
    const double force = pull(height);
    energy += force * band / parts;
    if (force > most) at = height;
    most = std::max(most, force);
  }
  EXPECT_NEAR(energy, stiffness * band * band / 6.0, 1e-3 * stiffness * band * band / 6.0);
  // Where its slope is 0: 1 - 6 s^2 + 5 s^4 = 0.
  EXPECT_NEAR(at, band / std::sqrt(5.0), 1e-3 * band);
  EXPECT_NEAR(most, 16.0 / 25.0 / std::sqrt(5.0) * stiffness * band, 1e-4 * stiffness * band);
}

TEST(Magnetic, K_7_InAtOnePlaceAndOutAtAnotherDoesNoWork) {
  // In along a ball's radius, round it at a depth that changes, and out aslant: a force that went by the height alone
  // but along another direction, or by anything else than the distance, would do work.
  const auto ball = surface_of(test::sparse_ball(voxel, 8e-3));
  double printed_most = 0.0;
  for (const double depth : {-1.5e-3, 0.1e-3, 2.5e-3}) {
    std::vector<Vec3> path = test::line(Vec3(0.0, 0.0, 0.03 + 1.5 * band), Vec3(0.0, 0.0, 0.03 - depth), 8000);
    for (int i = 1; i <= 8000; ++i) {
      const double t = i / 8000.0;
      const double angle = 0.4 * t;
      const double radius = 0.03 - depth + 1.2e-3 * std::sin(5.0 * t);
      path.push_back(radius * Vec3(std::sin(angle), 0.1 * std::sin(angle), std::cos(angle)));
    }
    const std::vector<Vec3> out = test::line(path.back(), Vec3(0.005, 0.0, 0.03 + 1.7 * band), 8000);
    path.insert(path.end(), out.begin(), out.end());
    MagnetTouch ours{ball, {Formulation::consistent, band}, {}};
    EXPECT_LT(std::abs(loop_work(ours, path)), 1e-8);
    // The printed one jumps at the band's edge; let in it gives nothing, let out it takes k e^2 / 2.
    MagnetTouch printed{ball, {Formulation::literal, band}, {}};
    printed_most = std::max(printed_most, std::abs(loop_work(printed, path)));
  }
  EXPECT_GT(printed_most, 1e-6);
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

TEST(Magnetic, InsideIsTheVirtualContactPointButBesideEdges) {
  for (const Formulation formulation : {Formulation::literal, Formulation::consistent}) {
    MagnetTouch touch = magnet(formulation);
    PointTouch point{touch.surface, {}, {}};
    point.law.formulation = formulation;
    touch.at(far_outside());
    point.at(far_outside());
    Rng rng(9);
    for (int i = 0; i < 400; ++i) {
      const Vec3 p(half - rng.uniform(0.1e-3, 4e-3), rng.uniform(-0.01, 0.01), half - rng.uniform(0.1e-3, 4e-3));
      const Vec3 pulled = touch.at(p).force;
      const Vec3 pushed = point.at(p).force;
      // There the consistent point keeps its size, which no energy's slope could; a magnet is one all over.
      const double from_bisector = std::abs(p.x() - p.z()) / std::numbers::sqrt2;
      const bool beside_edge = formulation == Formulation::consistent && from_bisector < 3.0 * voxel;
      EXPECT_LT((pulled - pushed).norm(), beside_edge ? 2.0 : 1e-12);
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

TEST(Magnetic, WithFrictionTheSpringStoresTheWorkOfTheWayIn) {
  for (const double friction : {0.0, 0.6}) {
    MagnetTouch touch = magnet(Formulation::consistent);
    touch.material.static_friction = touch.material.dynamic_friction = friction;
    touch.at(far_outside());
    Vec3 last = over_the_top(1.01 * band);
    Vec3 force = touch.at(last).force;
    double spent = 0.0;
    // Straight down, so that nothing is dragged: what the hand spent is all there, below what it was drawn with.
    for (const Vec3& p : test::line(last, over_the_top(-3e-3), 8000)) {
      const LawForce now = touch.at(p);
      spent -= 0.5 * (force + now.force).dot(p - last);
      last = p;
      force = now.force;
      if (!now.contact) continue;
      ASSERT_TRUE(now.stored);
      ASSERT_NEAR(*now.stored, spent, 1e-7) << p.z() - half << " " << friction;
    }
    EXPECT_GT(spent, 2e-3);
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
