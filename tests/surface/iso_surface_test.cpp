#include "asperity/surface/iso/surface.h"

#include <gtest/gtest.h>

#include <cmath>

#include "asperity/surface/walk_step.h"
#include "tests/field/volumes.h"
#include "tests/surface/balls.h"

namespace asperity::test::iso_surface_test {
namespace {

class IsoEach : public ::testing::TestWithParam<CellReconstruction> {};
INSTANTIATE_TEST_SUITE_P(Both, IsoEach, ::testing::Values(CellReconstruction::trilinear, CellReconstruction::smooth));

double value_at(const ScalarField& field, const Vec3& p) {
  CellPolynomial cell;
  FieldJet jet;
  return field.sample(0, p, cell, jet) ? jet.value : std::nan("");
}

/// First change of sign along a motion, by steps of a 200th of a cell.
bool marched(const ScalarField& field, const Segment& motion, double threshold, double& t) {
  const double length = (motion.to - motion.from).norm();
  const int steps = static_cast<int>(length / field.narrowest_cell() * 200.0) + 1;
  const double start = value_at(field, motion.from);
  for (int i = 1; i <= steps; ++i) {
    t = static_cast<double>(i) / steps;
    if ((value_at(field, motion.from + t * (motion.to - motion.from)) >= threshold) != (start >= threshold))
      return true;
  }
  return false;
}

TEST_P(IsoEach, T5_first_crossing_is_that_of_fine_steps_on_rough_fields) {
  std::mt19937_64 generator(1);
  int crossings = 0;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const auto field = random_field(12, GetParam(), seed, 0.6);
    const IsoSurface surface = IsoSurface::build(field, 0.1, Inside::low).value();
    CellCache cells;
    for (int n = 0; n < 60; ++n) {
      const Vec3 from = random_point(generator, 0.049);
      const Vec3 to = n % 3 == 0 ? random_point(generator, 0.049) : Vec3(from + random_point(generator, 0.004));
      if (!field->contains(to)) continue;
      const IsoCrossing found = surface.view(cells).first_crossing({from, to});
      double t = 0.0;
      if (marched(*field, {from, to}, 0.1, t)) {
        ASSERT_TRUE(found.found) << seed << " " << n;
        EXPECT_LE(found.t, t + 1e-9);
        ++crossings;
      }
      if (found.found) {
        // On the surface, and on the sides that it says.
        EXPECT_NEAR(value_at(*field, found.point), 0.1, 1e-6);
        const double before = value_at(*field, from);
        EXPECT_EQ(found.inward, before >= 0.1);
        EXPECT_GE((from - to).dot(found.outward) * (found.inward ? 1.0 : -1.0), -1e-9);
      }
    }
  }
  EXPECT_GT(crossings, 150);
}

TEST_P(IsoEach, M_3_no_speed_passes_a_sheet_thinner_than_a_cell) {
  const auto field = thin_wall(GetParam());
  const IsoSurface surface = IsoSurface::build(field, 0.0, Inside::low).value();
  std::mt19937_64 generator(2);
  std::uniform_real_distribution<double> side(-0.009, 0.009);
  CellCache cells;
  for (int n = 0; n < 20000; ++n) {
    const Vec3 from(side(generator), side(generator), 0.001 + 0.008 * std::abs(side(generator)) / 0.009);
    const Vec3 to(side(generator), side(generator), -from.z());
    const IsoCrossing in = surface.view(cells).first_crossing({from, to});
    ASSERT_TRUE(in.found && in.inward);
    const IsoCrossing out = surface.view(cells).first_crossing({from, to}, in.t + 1e-9);
    ASSERT_TRUE(out.found && !out.inward);
    // Thinner than a quarter of a cell.
    EXPECT_LT(std::abs((out.point - in.point).z()), 2.5e-4);
  }
}

TEST(IsoSurface, FrontAloneIsPassedFromBehind) {
  const IsoSurface surface = IsoSurface::build(sphere_field(33), 0.03, Inside::low).value();
  CellCache cells;
  const Segment out{Vec3(0.001, 0.002, 0.0), Vec3(0.045, 0.002, 0.0)};
  const Segment through{Vec3(-0.045, 0.001, 0.003), Vec3(0.045, 0.001, 0.003)};
  EXPECT_FALSE(surface.view(cells).first_touch(out, Sides::front).hit);
  EXPECT_TRUE(surface.view(cells).first_touch(out, Sides::both).hit);
  const SweptHit met = surface.view(cells).first_touch(through, Sides::front);
  EXPECT_TRUE(met.hit);
  EXPECT_EQ(met.side, 1.0);
  const Segment back{Vec3(0.0, 0.001, 0.003), Vec3(0.049, 0.001, 0.003)};
  EXPECT_FALSE(surface.view(cells).first_touch(back, Sides::front).hit);
  // The other inside turns front and back.
  const IsoSurface hollow = IsoSurface::build(sphere_field(33), 0.03, Inside::high).value();
  EXPECT_TRUE(hollow.view(cells).first_touch(out, Sides::front).hit);
  const SweptHit entered = hollow.view(cells).first_touch(out, Sides::front);
  EXPECT_LT(entered.side * entered.contact.normal.x(), -0.9);
}

TEST(IsoSurface, NestedShellsAreMetOneAfterTheOther) {
  const auto field = std::make_shared<const ScalarField>(
      sampled(cube_axes(0.05, 101), [](const Vec3& p) { return std::sin(p.norm() / 0.003); }));
  const IsoSurface surface = IsoSurface::build(field, 0.0, Inside::low).value();
  CellCache cells;
  const Segment motion{Vec3(0.0005, 0.0, 0.0001), Vec3(0.049, 0.001, 0.0)};
  double from = 0.0;
  int met = 0;
  for (;; ++met) {
    const IsoCrossing crossing = surface.view(cells).first_crossing(motion, from);
    if (!crossing.found) break;
    // Shells at multiples of pi times 3 mm, turn by turn.
    EXPECT_NEAR(crossing.point.norm() / 0.003 / 3.14159265358979, met + 1, 0.02);
    EXPECT_EQ(crossing.inward, met % 2 == 0);
    from = crossing.t + 1e-9;
  }
  EXPECT_EQ(met, 5);
}

TEST_P(IsoEach, NearestPointIsThatOfADenseSampling) {
  std::mt19937_64 generator(4);
  // Smooth, but with several sheets and both curvatures.
  const auto f = [](const Vec3& p) {
    return std::sin(p.x() / 0.012) * std::cos(p.y() / 0.012) + std::sin(p.y() / 0.012) * std::cos(p.z() / 0.012) +
           std::sin(p.z() / 0.012) * std::cos(p.x() / 0.012);
  };
  const auto field = std::make_shared<const ScalarField>(sampled(cube_axes(0.03, 41, 0.3), f), GetParam());
  const IsoSurface surface = IsoSurface::build(field, 0.2, Inside::high).value();
  std::vector<Vec3> points;
  CellCache cells;
  for (int i = 0; i <= 120; ++i) {
    for (int j = 0; j <= 120; ++j) {
      for (int axis = 0; axis < 3; ++axis) {
        Segment line;
        line.from[axis] = -0.03;
        line.to[axis] = 0.03;
        line.from[(axis + 1) % 3] = line.to[(axis + 1) % 3] = -0.03 + 0.0005 * i;
        line.from[(axis + 2) % 3] = line.to[(axis + 2) % 3] = -0.03 + 0.0005 * j;
        double from = 0.0;
        for (;;) {
          const IsoCrossing crossing = surface.view(cells).first_crossing(line, from);
          if (!crossing.found) break;
          points.push_back(crossing.point);
          from = crossing.t + 1e-7;
        }
      }
    }
  }
  ASSERT_GT(points.size(), 10000U);
  for (int n = 0; n < 300; ++n) {
    const Vec3 p = random_point(generator, 0.028);
    double nearest = infinity;
    for (const Vec3& point : points) nearest = std::min(nearest, (point - p).norm());
    CellCache fresh;
    const Foot foot = surface.view(fresh).nearest(p, 0.02);
    ASSERT_TRUE(foot.found());
    EXPECT_NEAR(value_at(*field, foot.point), 0.2, 1e-6);
    EXPECT_NEAR(foot.distance, (foot.point - p).norm(), 1e-12);
    // Never farther than a sample of the surface, and not nearer than the sampling allows.
    EXPECT_LE(foot.distance, nearest + 2e-7) << n;
    EXPECT_GE(foot.distance, nearest - 4e-4);
    // A bound below the distance finds nothing.
    CellCache none;
    EXPECT_FALSE(surface.view(none).nearest(p, 0.99 * foot.distance).found());
  }
}

TEST_P(IsoEach, DescentComesToTheNearestPointAndNeverFarther) {
  const auto field = sphere_field(65, GetParam());
  const IsoSurface surface = IsoSurface::build(field, 0.03, Inside::low).value();
  std::mt19937_64 generator(9);
  for (int n = 0; n < 500; ++n) {
    CellCache cells;
    const Vec3 goal = random_point(generator, 1.0).normalized() * 0.027;
    const Vec3 around = (goal + random_point(generator, 0.012)).normalized() * 0.045;
    const IsoCrossing start = surface.view(cells).first_crossing({around, Vec3::Zero()});
    ASSERT_TRUE(start.found);
    const IsoView view = surface.view(cells);
    Place place{view.element_of(start.cell), false, start.point};
    IsoSpot spot = view.at(place, start.outward);
    double distance = (start.point - goal).norm();
    const DescentEnd end = view.descend(place, spot, {.point = goal});
    EXPECT_EQ(end, DescentEnd::rest);
    EXPECT_EQ(place.at, spot.point);
    EXPECT_LE((spot.point - goal).norm(), distance);
    EXPECT_NEAR(value_at(*field, spot.point), 0.03, 1e-9);
    const double bound = GetParam() == CellReconstruction::smooth ? 1e-4 : 4e-2;
    EXPECT_LT((spot.point - 0.03 * goal.normalized()).norm(), bound * 0.03);
  }
}

TEST(IsoSurface, DescentThatIsCutShortTellsTheNormalWhereItStands) {
  const auto field = sphere_field(17, CellReconstruction::smooth);
  const IsoSurface surface = IsoSurface::build(field, 0.03, Inside::low).value();
  std::mt19937_64 generator(10);
  int cut = 0;
  for (int n = 0; n < 500; ++n) {
    CellCache cells;
    const Vec3 around = random_point(generator, 1.0).normalized() * 0.045;
    const Vec3 goal = random_point(generator, 1.0).normalized() * 0.02;
    const IsoCrossing start = surface.view(cells).first_crossing({around, Vec3::Zero()});
    ASSERT_TRUE(start.found);
    const IsoView view = surface.view(cells);
    Place place{view.element_of(start.cell), false, start.point};
    IsoSpot spot = view.at(place, start.outward);
    const DescentEnd end = view.descend(place, spot, {.point = goal, .moves = 1 + n % 16});
    if (end != DescentEnd::limited) continue;
    ++cut;
    EXPECT_LT((spot.front - view.outward(spot.point)).norm(), 1e-6) << n;
  }
  EXPECT_GT(cut, 200);
}

TEST(IsoSurface, DescentComesToRestInFewEvaluationsWhereTheDistanceIsNearlyFlat) {
  // Near its centre a sphere is all but as far away everywhere: what is left of a step's slope is a share of the depth.
  const auto field = sphere_field(17, CellReconstruction::smooth);
  const IsoSurface surface = IsoSurface::build(field, 0.03, Inside::low).value();
  std::mt19937_64 generator(11);
  for (int n = 0; n < 500; ++n) {
    CellCache cells;
    const Vec3 around = random_point(generator, 1.0).normalized() * 0.045;
    const double off = 0.03 * std::pow(10.0, -1.0 - 1.5 * (n % 10) / 9.0);
    const Vec3 goal = (around.normalized() + random_point(generator, 0.3)).normalized() * off;
    const IsoCrossing start = surface.view(cells).first_crossing({around, Vec3::Zero()});
    ASSERT_TRUE(start.found);
    const IsoView view = surface.view(cells);
    Place place{view.element_of(start.cell), false, start.point};
    IsoSpot spot = view.at(place, start.outward);
    const DescentEnd end = view.descend(place, spot, {.point = goal, .moves = 120});
    EXPECT_EQ(end, DescentEnd::rest) << n << " off the centre by " << off;
  }
}

/// On the ellipsoid x . form x = 1, from `x` on it towards a goal that friction moves back: how much of the pull is
/// left where one step ends.
double left_after_one_step(const Mat3& form, const Vec3& x, const Vec3& goal, double friction, bool told) {
  const auto onto = [&](Vec3 y) {
    for (int round = 0; round < 20; ++round) {
      const Vec3 gradient = form * y;
      y -= (0.5 * y.dot(gradient) - 0.5) / gradient.squaredNorm() * gradient;
    }
    return y;
  };
  const auto pull_at = [&](const Vec3& y, Vec3& normal, double& depth) -> Vec3 {
    normal = (form * y).normalized();
    const Vec3 v = friction_goal(y, normal, goal, friction) - y;
    depth = v.dot(normal);
    return v - depth * normal;
  };
  Vec3 normal;
  double depth = 0.0;
  const Vec3 pull = pull_at(x, normal, depth);
  if (!(pull.norm() > 0.0)) return 0.0;
  const double scale = 1.0 / (form * x).norm();
  const TangentStep to = tangent_step(normal, pull, pull.norm(), depth, form, scale, told ? friction : 0.0);
  return pull_at(onto(x + to.step - to.drop * normal), normal, depth).norm();
}

TEST(IsoSurface, AGoalThatFrictionMovesBackIsReachedAtNewtonsPace) {
  // A step a tenth as long leaves a hundredth; without how the cone shrinks on the way it would leave a tenth.
  std::mt19937_64 generator(12);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  int compared = 0;
  for (int n = 0; n < 300; ++n) {
    const Mat3 turn =
        Eigen::AngleAxisd(6.0 * share(generator), random_point(generator, 1.0).normalized()).toRotationMatrix();
    const Vec3 axes(0.6 + share(generator), 0.6 + share(generator), 0.6 + share(generator));
    const Mat3 form = turn * axes.asDiagonal() * turn.transpose();
    Vec3 x = random_point(generator, 1.0).normalized();
    x /= std::sqrt(x.dot(form * x));
    const Vec3 normal = (form * x).normalized();
    const Vec3 along = normal.cross(random_point(generator, 1.0)).normalized();
    const double deep = 0.05 + 0.1 * share(generator);
    const double friction = 0.1 + 0.7 * share(generator);
    const auto left = [&](double more, bool told) {
      return left_after_one_step(form, x, x - deep * normal + (friction * deep + more) * along, friction, told);
    };
    const double far = left(1e-3, true);
    const double near = left(1e-4, true);
    EXPECT_LT(far, 2e-5) << n;
    EXPECT_LT(near, 0.02 * far + 1e-12) << n;
    if (left(1e-4, false) > 0.05 * left(1e-3, false)) ++compared;
  }
  EXPECT_GT(compared, 290);
}

TEST(IsoSurface, EndsAtTheVolumesBorder) {
  const IsoSurface surface =
      IsoSurface::build(std::make_shared<const ScalarField>(
                            sampled(cube_axes(0.02, 21), [](const Vec3& p) { return p.z() + 0.1 * p.x(); })),
                        0.0, Inside::low)
          .value();
  CellCache cells;
  const Segment beside{Vec3(0.03, 0.0, 0.03), Vec3(0.03, 0.0, -0.03)};
  EXPECT_FALSE(surface.view(cells).first_crossing(beside).found);
  // In from outside the volume, under the surface: nothing is passed; out through it is.
  const Segment up{Vec3(0.0, 0.0, -0.05), Vec3(0.0, 0.0, 0.05)};
  const IsoCrossing crossing = surface.view(cells).first_crossing(up);
  EXPECT_TRUE(crossing.found && !crossing.inward);
  const IsoView view = surface.view(cells);
  Place place{view.element_of(crossing.cell), false, crossing.point};
  IsoSpot spot = view.at(place, crossing.outward);
  EXPECT_EQ(view.descend(place, spot, {.point = Vec3(0.05, 0.0, -0.01)}), DescentEnd::rim);
  EXPECT_NEAR(spot.point.x(), 0.02, 1e-9);
}

TEST(IsoSurface, RefusesAThresholdThatTheFieldNeverPasses) {
  const auto field = sphere_field(17);
  const Error beyond = IsoSurface::build(field, 1.0, Inside::low).error();
  EXPECT_EQ(beyond.code, ErrorCode::bad_value);
  EXPECT_EQ(beyond.place, "threshold");
  EXPECT_NE(beyond.what.find("ranges from 0"), std::string::npos);
  EXPECT_FALSE(IsoSurface::build(field, std::nan(""), Inside::low));
  EXPECT_FALSE(IsoSurface::build(field, 0.03, Inside::low, 0.0));
  EXPECT_FALSE(IsoSurface::build(nullptr, 0.03, Inside::low));
  const IsoSurface surface = IsoSurface::build(field, 0.03, Inside::low).value();
  EXPECT_NEAR(surface.typical_slope(), 1.0, 0.05);
  EXPECT_NEAR(surface.surface_bounds().upper.x(), 0.03, 0.007);
  EXPECT_EQ(surface.with_threshold(0.02)->threshold(), 0.02);
}

TEST(IsoSurface, AScheduleRunsEvenlyFromStepToStep) {
  const IsoSurface surface = IsoSurface::build(sphere_field(33), 0.02, Inside::low).value();
  EXPECT_EQ(surface.threshold_at(Seconds(7.0)), 0.02);
  const IsoSurface changing =
      surface.with_schedule({{Seconds(1.0), 0.03}, {Seconds(1.5), 0.03}, {Seconds(2.5), 0.01}}).value();
  const std::pair<double, double> expected[] = {{-1.0, 0.02}, {0.0, 0.02}, {0.25, 0.0225}, {1.0, 0.03}, {1.2, 0.03},
                                                {1.5, 0.03},  {2.0, 0.02}, {2.5, 0.01},    {9.0, 0.01}};
  for (const auto& [time, threshold] : expected)
    EXPECT_NEAR(changing.threshold_at(Seconds(time)), threshold, 1e-15) << time;
  EXPECT_EQ(changing.threshold(), 0.02);
  const auto refused = [&](std::vector<ThresholdStep> steps, const char* place) {
    const Error error = surface.with_schedule(std::move(steps)).error();
    EXPECT_EQ(error.code, ErrorCode::bad_value);
    EXPECT_EQ(error.place, place);
    EXPECT_FALSE(error.accepted.empty());
  };
  refused({{Seconds(0.0), 0.03}}, "schedule[0].time");
  refused({{Seconds(1.0), 0.03}, {Seconds(1.0), 0.02}}, "schedule[1].time");
  refused({{Seconds(std::nan("")), 0.03}}, "schedule[0].time");
  refused({{Seconds(infinity), 0.03}}, "schedule[0].time");
  refused({{Seconds(1.0), 0.03}, {Seconds(2.0), 1.0}}, "schedule[1].threshold");
  refused({{Seconds(1.0), std::nan("")}}, "schedule[0].threshold");
}

TEST(IsoSurface, BallStopsAtItsRadius) {
  const IsoSurface surface = IsoSurface::build(sphere_field(65), 0.03, Inside::low).value();
  std::mt19937_64 generator(12);
  for (int n = 0; n < 50; ++n) {
    SurfaceCache cache;
    const IsoView view = surface.view(cache);
    const Vec3 from = random_point(generator, 1.0).normalized() * 0.045;
    const Vec3 to = -from + random_point(generator, 0.02);
    const double t = ball_touch({from, to}, 0.002, [&](const Vec3& p) { return view.nearest(p, infinity); });
    const Vec3 d = (to - from).normalized();
    const double nearest = (from - from.dot(d) * d).norm();
    if (nearest > 0.0325) continue;
    if (nearest > 0.0315) continue;  // grazing
    ASSERT_LE(t, 1.0);
    EXPECT_NEAR((from + t * (to - from)).norm(), 0.032, 2e-6);
  }
}

}  // namespace
}  // namespace asperity::test::iso_surface_test
