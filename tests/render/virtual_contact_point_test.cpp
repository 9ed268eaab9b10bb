#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>

#include "asperity/render/local_material.h"
#include "tests/render/implicit_touch.h"

namespace asperity::virtual_contact_point_test {
namespace {

using implicit::angle_between;
using implicit::far_outside;
using implicit::forces_along;
using implicit::largest_jump_on;
using implicit::loop_work;
using implicit::PointTouch;
using implicit::surface_of;
using implicit::WholeTouch;
using test::stiffness;

constexpr double voxel = 1e-3;
constexpr double half = 0.02;  // m, of the box

std::shared_ptr<const ImplicitSurface> box(CellReconstruction reconstruction = CellReconstruction::smooth) {
  static const auto grid = test::sparse_box(voxel, 8e-3);
  static const auto smooth = surface_of(grid);
  static const auto trilinear = surface_of(grid, CellReconstruction::trilinear);
  return reconstruction == CellReconstruction::smooth ? smooth : trilinear;
}
/// The same with little beneath its surface: trusted 3 mm deep, and held from 2 mm on.
std::shared_ptr<const ImplicitSurface> thin_banded() {
  static const auto surface = surface_of(test::sparse_box(voxel, 5e-3));
  return surface;
}

VirtualContactPointLaw with(Formulation formulation, ContactMagnitude magnitude = ContactMagnitude::distance) {
  VirtualContactPointLaw law;
  law.formulation = formulation;
  law.magnitude = magnitude;
  return law;
}

PointTouch literal(ContactMagnitude magnitude = ContactMagnitude::distance) {
  return {box(), with(Formulation::literal, magnitude), {}};
}
PointTouch consistent(CellReconstruction reconstruction = CellReconstruction::smooth) {
  return {box(reconstruction), with(Formulation::consistent), {}};
}

/// The four that are compared near edges.
struct Compared {
  const char* name;
  PointTouch touch;
};
std::vector<Compared> compared() {
  return {{"literal", literal()},
          {"literal, potential", literal(ContactMagnitude::potential)},
          {"consistent, trilinear", consistent(CellReconstruction::trilinear)},
          {"consistent, smooth", consistent()}};
}

LawForce pressed(PointTouch& touch, const Vec3& p) {
  implicit::forget(touch.state);
  touch.at(far_outside());
  return touch.at(p);
}

/// A probe in the box, `depth` under its top and `from_bisector` (m) from the plane in which top and right side are
/// equally near; above 0 the top is nearer.
Vec3 near_edge(double depth, double from_bisector) {
  return {half - depth - std::numbers::sqrt2 * from_bisector, 0.7e-3, half - depth};
}

// --- direction and size (rows K-3 and K-4) ---

TEST(VirtualContactPoint, K_3_DirectionIsTheFacesBeyondAFewVoxelsFromAnEdge) {
  // In voxels: beyond it exact. A smooth cell reads nodes up to 2.8 voxels away, the farther the less.
  const std::array<double, 4> reach = {1.5, 1.5, std::numbers::sqrt2, 4.0 / std::numbers::sqrt2};
  std::size_t which = 0;
  for (auto& [name, touch] : compared()) {
    double worst_near = 0.0;
    double farthest_wrong = 0.0;
    for (int i = 0; i <= 400; ++i) {
      const double away = i * 0.01 * voxel;
      const LawForce force = pressed(touch, near_edge(3.13e-3, away));
      ASSERT_TRUE(force.contact);
      const double error = angle_between(force.force, Vec3::UnitZ());
      if (error > 0.1) farthest_wrong = std::max(farthest_wrong, away / voxel);
      if (away > reach[which] * voxel) {
        EXPECT_LT(error, 0.01) << name << ' ' << away;
      }
      if (away > 1.5 * voxel) {
        EXPECT_LT(error, 1.0) << name << ' ' << away;
      }
      if (away < voxel) worst_near = std::max(worst_near, error);
    }
    RecordProperty(std::string("largest distance with more than 0.1 degrees, in voxels: ") + name,
                   std::to_string(farthest_wrong));
    EXPECT_GT(worst_near, 20.0) << name;  // 45 in the bisector itself
    EXPECT_LT(farthest_wrong, 2.2) << name;
    ++which;
  }
}

TEST(VirtualContactPoint, K_3_ForceShadingIsWrongOverTheWholeFace) {
  const TriangleMesh mesh = test::mesh_of(box_mesh(Vec3::Constant(2.0 * half)));
  const MeshSurface surface(TriangleIndex::build(mesh));
  SurfaceCache hint;
  PointTouch touch = literal();
  int shaded_wrong = 0;
  int felt_wrong = 0;
  int places = 0;
  for (int i = -9; i <= 9; ++i) {
    for (int j = -9; j <= 9; ++j) {
      const Vec3 p(1.9e-3 * i, 1.9e-3 * j, half - 0.4e-3);
      const Foot foot = surface.view(hint).nearest(p, infinity);
      const Vec3 shaded = interpolated_normal(surface.mesh(), foot.element, foot.at);
      ++places;
      shaded_wrong += angle_between(shaded, Vec3::UnitZ()) > 1.0 ? 1 : 0;
      felt_wrong += angle_between(pressed(touch, p).force, Vec3::UnitZ()) > 1.0 ? 1 : 0;
    }
  }
  EXPECT_GT(shaded_wrong, places - 3);  // all but the face's centre
  EXPECT_EQ(felt_wrong, 0);             // the nearest is 2.9 mm from an edge
}

TEST(VirtualContactPoint, K_4_ForceIsStiffnessTimesDepthOnFlatFaces) {
  Rng rng(4);
  for (auto& [name, touch] : compared()) {
    for (int i = 0; i < 200; ++i) {
      const double depth = rng.uniform(1e-6, 4e-3);
      const Vec3 p(rng.uniform(-0.01, 0.01), rng.uniform(-0.01, 0.01), half - depth);
      const LawForce force = pressed(touch, p);
      ASSERT_TRUE(force.contact) << name;
      EXPECT_LT((force.force - Vec3(0.0, 0.0, stiffness * depth)).norm(), 1e-5) << name;
      EXPECT_LT((force.point - Vec3(p.x(), p.y(), half)).norm(), 1e-8) << name;
      EXPECT_LT((force.normal - Vec3::UnitZ()).norm(), 1e-5) << name;
      EXPECT_NEAR(force.penetration, depth, 1e-8) << name;
    }
  }
}

TEST(VirtualContactPoint, BallPushesAlongItsRadius) {
  for (const Formulation formulation : {Formulation::literal, Formulation::consistent}) {
    PointTouch touch{surface_of(test::sparse_ball(voxel, 6e-3)), with(formulation), {}};
    Rng rng(7);
    for (int i = 0; i < 200; ++i) {
      const Vec3 way = Vec3(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)).normalized();
      const double depth = rng.uniform(0.1e-3, 2.5e-3);
      const LawForce force = pressed(touch, (0.03 - depth) * way);
      EXPECT_LT((force.force - stiffness * depth * way).norm(), 0.02);
    }
  }
}

// --- who is felt ---

TEST(VirtualContactPoint, WhoStartsInsideIsPushedByThePrintedFormAlone) {
  const Vec3 inside(0.001, 0.002, half - 1e-3);
  PointTouch printed = literal();
  EXPECT_TRUE(printed.at(inside).contact);
  PointTouch ours = consistent();
  EXPECT_FALSE(ours.at(inside).contact);
  EXPECT_FALSE(ours.at(inside - Vec3(0.0, 0.0, 1e-3)).contact);
  EXPECT_FALSE(ours.at(Vec3(0.001, 0.002, half + 1e-4)).contact);
  EXPECT_TRUE(ours.at(inside).contact);
}

TEST(VirtualContactPoint, ProbesThatMeanNothingAreNotFelt) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (auto& [name, touch] : compared()) {
    for (const Vec3& p : {Vec3(nan, 0.0, 0.0), Vec3(0.0, infinity, 0.0), Vec3(1e6, -1e6, 1e6)}) {
      const LawForce force = touch.at(p);
      EXPECT_TRUE(force.force.allFinite()) << name;
      EXPECT_FALSE(force.contact) << name << p.transpose();
    }
    EXPECT_NEAR(pressed(touch, Vec3(0.0, 0.0, half - 1e-3)).force.z(), 1.0, 1e-5) << name;
  }
}

TEST(VirtualContactPoint, DampingPullsInThePrintedFormAlone) {
  const Vec3 shallow(0.0, 0.0, half - 0.1e-3);
  const Vec3 leaving(0.05, 0.0, 0.2);
  PointTouch printed = literal();
  printed.material.damping = 2.0;
  const LawForce pulled = printed.at(shallow, leaving);
  EXPECT_LT((pulled.force - Vec3(-0.1, 0.0, 0.1 - 0.4)).norm(), 1e-5);  // eq. 1: all of the velocity
  PointTouch ours = consistent();
  ours.material.damping = 2.0;
  ours.at(far_outside());
  const LawForce let_go = ours.at(shallow, leaving);
  EXPECT_TRUE(let_go.damped);
  EXPECT_LT(let_go.force.norm(), 1e-6);
  EXPECT_LT((ours.at(shallow, -leaving).force - Vec3(0.0, 0.0, 0.1 + 0.4)).norm(), 1e-5);
}

// --- friction (row K-5) ---

/// Tangential force (N) against a probe that has moved along x over the box's top at `speed` (m/s) for `seconds`.
double dragging_force(PointTouch& touch, double speed, double rate, double seconds = 0.08) {
  touch.dt = Seconds(1.0 / rate);
  implicit::forget(touch.state);
  touch.at(far_outside());
  LawForce force;
  const int ticks = static_cast<int>(seconds * rate);
  for (int i = 0; i <= ticks; ++i) {
    force = touch.at(Vec3(-0.008 + speed * i / rate, 0.0, half - 0.5e-3));
  }
  EXPECT_NEAR(force.force.z(), 0.5, 1e-4);
  return -force.force.x();
}

TEST(VirtualContactPoint, K_5_PrintedFrictionIsViscousAndGoesWithTheRate) {
  PointTouch touch = literal();
  touch.material.static_friction = touch.material.dynamic_friction = 0.6;
  const std::array<double, 3> speed = {0.01, 0.05, 0.1};
  const std::array<double, 3> expected = {0.015, 0.075, 0.15};  // k v T f_v / (1 - f_v)
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(dragging_force(touch, speed[i], 1e3), expected[i], 1e-4);
    EXPECT_NEAR(dragging_force(touch, speed[i], 1e4), 0.1 * expected[i], 1e-4);
  }
}

TEST(VirtualContactPoint, K_5_OursIsTheSameAtEveryRate) {
  PointTouch touch = consistent();
  touch.material.static_friction = touch.material.dynamic_friction = 0.6;
  for (const double rate : {500.0, 1e3, 4e3, 1e4}) {
    EXPECT_NEAR(dragging_force(touch, 0.01, rate), 0.015, 1e-4) << rate;
    EXPECT_NEAR(dragging_force(touch, 0.05, rate), 0.075, 1e-4) << rate;
    EXPECT_NEAR(dragging_force(touch, 0.1, rate), 0.15, 2e-4) << rate;
  }
}

TEST(VirtualContactPoint, K_5_HeldStillItCreepsBackWithinTenUpdates) {
  PointTouch touch = literal();
  touch.material.static_friction = touch.material.dynamic_friction = 0.6;
  const double steady = dragging_force(touch, 0.1, 1e3);
  const Vec3 last(-0.008 + 0.1 * 0.08, 0.0, half - 0.5e-3);
  LawForce force;
  for (int i = 0; i < 10; ++i) force = touch.at(last);
  EXPECT_NEAR(-force.force.x(), std::pow(0.6, 10) * steady, 1e-5);
  EXPECT_LT(-force.force.x(), 0.01 * steady);
}

TEST(VirtualContactPoint, FrictionGrowsWithDepthAndStaysBelowOne) {
  for (PointTouch touch : {literal(), consistent()}) {
    touch.law.depth_gain = 1000.0;  // by half at 0.5 mm
    touch.material.static_friction = touch.material.dynamic_friction = 0.4;
    EXPECT_NEAR(dragging_force(touch, 0.05, 1e3), 0.075, 2e-4);
    touch.material.static_friction = touch.material.dynamic_friction = 5.0;
    const double dragged = dragging_force(touch, 0.05, 1e3, 0.02);
    EXPECT_GT(dragged, 0.5);
    EXPECT_LE(dragged, stiffness * 0.05 * 0.0201);
  }
}

TEST(VirtualContactPoint, DraggedFastOverABallItStaysOnTheBall) {
  // The contact point lags by some millimetres: the straight way back to it runs through the ball.
  const auto ball = surface_of(test::sparse_ball(voxel, 6e-3));
  PointTouch touch{ball, with(Formulation::consistent), {}};
  touch.material.static_friction = touch.material.dynamic_friction = 0.6;
  touch.at(far_outside());
  double farthest_back = 0.0;
  for (int i = 0; i <= 60; ++i) {
    const double angle = 0.1 * i;
    const Vec3 out(std::sin(angle), 0.0, std::cos(angle));
    const LawForce force = touch.at(0.028 * out);
    ASSERT_TRUE(force.contact) << i;
    // Stored as floats in voxels: the ball itself is known to microns.
    ASSERT_NEAR(force.point.norm(), 0.03, 1e-5) << i;
    farthest_back = std::max(farthest_back, (force.point - 0.03 * out).norm());
  }
  EXPECT_GT(farthest_back, 3e-3);
}

/// What a random walk over a ball and a box with friction must not gain.
void expect_passive(const std::shared_ptr<const ImplicitSurface>& surface, const Vec3& centre, std::uint64_t seed) {
  Rng rng(seed);
  PointTouch touch{surface, with(Formulation::consistent), {}};
  touch.law.depth_gain = rng.uniform(0.0, 500.0);
  touch.material.static_friction = touch.material.dynamic_friction = rng.uniform(0.05, 0.95);
  Vec3 place = centre + Vec3(0.0, 0.0, 3e-3);
  touch.at(place);
  Vec3 velocity = Vec3::Zero();
  Vec3 force = Vec3::Zero();
  double given = 0.0;
  double leak = 0.0;
  int touched = 0;
  for (int i = 0; i < 4000; ++i) {
    touch.dt = Seconds(rng.uniform(0.1e-3, 3e-3));
    velocity = 0.98 * velocity + 0.02 * Vec3(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1));
    velocity -= 3.0 * touch.dt.count() * (place - centre) / 0.004;
    const Vec3 move = velocity * touch.dt.count();
    given += force.dot(move);  // the force is held over the tick
    leak += 0.5 * stiffness * move.squaredNorm();
    place += move;
    const LawForce answer = touch.at(place, velocity);
    force = answer.force;
    touched += answer.contact ? 1 : 0;
    const double stored = answer.contact ? 0.5 * force.squaredNorm() / stiffness : 0.0;
    // Of the energy that the hand put in, no more comes back or is stored than a spring sampled by the tick adds.
    ASSERT_LE(given + stored, leak + 1e-9) << i;
  }
  EXPECT_GT(touched, 400);
  EXPECT_LT(given, 0.0);
}

TEST(VirtualContactPoint, FrictionGivesNoEnergy) {
  const auto ball = surface_of(test::sparse_ball(voxel, 6e-3));
  const auto cube = box();
  const auto plain = box(CellReconstruction::trilinear);
  const auto plate = surface_of(test::sparse_slab(3e-3, 5e-3, 0.5e-3, 4e-3));
  // No distance any more: its slope is up to 1.6.
  const auto rough = surface_of(test::sparse_grid(
      [](const Vec3& p) {
        return test::ball_distance(p, 0.03) + 0.6e-3 * std::sin(1e3 * p.x()) * std::sin(1e3 * p.z());
      },
      test::cube(0.03), voxel, 6e-3, 6e-3));
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    expect_passive(ball, Vec3(0.0, 0.0, 0.0295), seed);
    expect_passive(cube, Vec3(half, 0.002, half), seed);
    expect_passive(plain, Vec3(half, half, half), seed);
    expect_passive(plate, Vec3(0.003, 0.0, 0.5e-3), seed);
    expect_passive(rough, Vec3(0.0, 0.0, 0.0295), seed);
  }
}

// --- thin things (row K-6) ---

/// Greatest force (N) that holds a probe up as it is pressed through a slab from above.
double strength(PointTouch touch) {
  touch.at(far_outside());
  double most = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const LawForce force = touch.at(Vec3(0.1e-3, 0.2e-3, 1.5e-3 - 1e-6 * i));
    if (force.force.z() < 0.0) break;
    most = std::max(most, force.force.z());
  }
  return most;
}

TEST(VirtualContactPoint, K_6_OffsetGivesAThinSlabItsStrength) {
  const auto slab = test::sparse_slab(0.5e-3, 2.5e-3, 0.125e-3, 1.5e-3);
  for (const double offset : {0.0, 1e-3}) {
    const double expected = stiffness * (offset + 0.25e-3);
    PointTouch printed{surface_of(slab), with(Formulation::literal), {}};
    printed.law.offset = offset;
    EXPECT_NEAR(strength(printed), expected, 2e-3);
    PointTouch plain{surface_of(slab, CellReconstruction::trilinear), with(Formulation::consistent), {}};
    plain.law.offset = offset;
    // In the slab's middle the nodes' gradients are short, as at an edge: some hundredths of a voxel are taken for it.
    EXPECT_NEAR(strength(plain), expected, 4e-3);
    PointTouch whole{surface_of(slab, CellReconstruction::trilinear, offset), with(Formulation::consistent), {}};
    EXPECT_NEAR(strength(whole), expected, 4e-3);
    // Smooth: the potential's crest in the middle is rounded, and its slope is up to 4/3 just before.
    PointTouch smooth{surface_of(slab), with(Formulation::consistent), {}};
    smooth.law.offset = offset;
    const double rounded = strength(smooth);
    RecordProperty("smooth, offset " + std::to_string(offset), std::to_string(rounded));
    EXPECT_LE(rounded, 4.0 / 3.0 * expected);
    EXPECT_GE(rounded, expected);
  }
}

TEST(VirtualContactPoint, OffsetTakesDirectionAndPlaceFromTheOriginalSurface) {
  PointTouch touch = literal();
  touch.law.offset = 2e-3;
  // Outside of the box and beside its edge: the offset surface is round there.
  const Vec3 p(half + 0.6e-3, 0.0, half + 0.8e-3);
  const LawForce force = touch.at(p);
  ASSERT_TRUE(force.contact);
  EXPECT_NEAR(force.force.norm(), stiffness * 1e-3, 0.15);
  EXPECT_LT((force.point - Vec3(half, 0.0, half)).norm(), 0.4e-3);
  EXPECT_LT(angle_between(force.force, force.normal), 1e-3);
}

// --- work and continuity ---

TEST(VirtualContactPoint, T_1_OursDoesNoWorkInAClosedLoop) {
  // Where no edge is near; there it asks the account (K-4). The rough ball is no distance any more, its slope is more
  // than 1.
  const auto rough = [](const Vec3& p) {
    return test::ball_distance(p, 0.03) + 0.3e-3 * std::sin(500.0 * p.x()) * std::sin(500.0 * p.z());
  };
  const auto grid = test::sparse_ball(voxel, 8e-3);
  ImplicitParts textured;
  textured.grid = test::sparse_grid(rough, test::cube(0.03), voxel, 8e-3, 8e-3);
  textured.untextured = grid;
  const std::array<std::pair<std::shared_ptr<const ImplicitSurface>, Vec3>, 4> cases = {{
      {surface_of(grid), Vec3(0.0, 0.0, 0.0295)},
      {box(), Vec3(0.0, 0.0, half - 1e-3)},
      {std::make_shared<const ImplicitSurface>(test::must(ImplicitSurface::build(std::move(textured)))),
       Vec3(0.0, 0.0, 0.0295)},
      {surface_of(grid, CellReconstruction::trilinear), Vec3(0.0, 0.0, 0.0295)},
  }};
  double worst = 0.0;
  double printed_worst = 0.0;
  for (const auto& [surface, centre] : cases) {
    Rng rng(11);
    const bool plain = surface->parts().reconstruction == CellReconstruction::trilinear;
    for (int i = 0; i < 3; ++i) {
      const std::vector<Vec3> loop = test::random_loop(rng, centre, 2.5e-3, 2e-3, 20000);
      const double scale = stiffness * test::loop_area(loop);
      PointTouch ours{surface, with(Formulation::consistent), {}};
      const double share = std::abs(loop_work(ours, loop)) / scale;
      EXPECT_LT(share, plain ? 1e-4 : 1e-6);  // the trilinear gradient jumps at cell faces: quadrature's first order
      worst = std::max(worst, plain ? 0.0 : share);
      std::vector<Vec3> coarse;
      for (std::size_t j = 0; j < loop.size(); j += 10) coarse.push_back(loop[j]);
      PointTouch printed{surface, with(Formulation::literal), {}};
      printed_worst = std::max(printed_worst, std::abs(loop_work(printed, coarse)) / scale);
    }
  }
  RecordProperty("consistent, of k A", std::to_string(worst));
  RecordProperty("literal, of k A", std::to_string(printed_worst));
  EXPECT_GT(printed_worst, 1e-3);
}

TEST(VirtualContactPoint, ForceChangesWithTheStepAcrossEdgesCornersAndTheBandsEnd) {
  const std::array<std::pair<Vec3, Vec3>, 4> ways = {{
      {{0.010, 0.001, half - 2.2e-3}, {half + 1e-3, 0.0015, half - 2.7e-3}},         // over an edge
      {{0.012, 0.014, half - 3.1e-3}, {half + 1e-3, half + 0.6e-3, half - 2.7e-3}},  // over a corner
      {{half - 4e-3, 0.002, half + 1e-3}, {half - 5e-3, 0.001, half - 5e-3}},        // down the bisector
      {{0.0, 0.001, half + 1e-3}, {half + 1e-3, 0.0, -0.002}},                       // through the middle
  }};
  for (const auto& [from, to] : ways) {
    double last = 0.0;
    for (const double step : {4e-5, 4e-6, 4e-7}) {
      const double jump = largest_jump_on(consistent(), from, to, step);
      EXPECT_LT(jump, 30.0 * stiffness * step);
      if (last > 0.0) {
        EXPECT_NEAR(last / jump, 10.0, 2.5);
      }
      last = jump;
    }
  }
}

TEST(VirtualContactPoint, BeyondTheBandItHoldsWithoutGivingEnergy) {
  const auto thin_band = thin_banded();
  PointTouch touch{thin_band, with(Formulation::consistent), {}};
  touch.at(far_outside());
  LawForce force;
  for (int i = 0; i <= 1200; ++i) force = touch.at(Vec3(0.001, 0.0, half + 1e-3 - 1e-5 * i));
  ASSERT_TRUE(force.contact);
  // Two voxels of the band are not trusted, and over one more the hold sets in: 2 mm.
  EXPECT_LT((force.force - Vec3(0.0, 0.0, stiffness * 2e-3)).norm(), 1e-3);
  Rng rng(3);
  double taken = 0.0;
  for (int n = 0; n < 8; ++n) {
    WholeTouch again(PointTouch{thin_band, with(Formulation::consistent), {}});
    const std::vector<Vec3> loop = test::random_loop(rng, Vec3(half, 0.0, half - 5e-3), 0.014, 0.008, 40000);
    const double given = loop_work(again, loop);
    EXPECT_LT(given, 1e-5) << n;
    taken = std::max(taken, -given);
  }
  EXPECT_GT(taken, 1e-3);
}

TEST(VirtualContactPoint, HeldUnderAHigherPartItGivesNoMoreThanItTook) {
  // A step: whoever comes in through its lower part and rises under the higher one is held upwards all the way.
  const auto step_distance = [](const Vec3& p) {
    return std::min(test::box_distance(p, Vec3(0.03, 0.015, 0.015)),
                    test::box_distance(p - Vec3(0.015, 0.0, 0.01), Vec3(0.015, 0.015, 0.025)));
  };
  Box bounds;
  bounds.lower = Vec3(-0.03, -0.015, -0.015);
  bounds.upper = Vec3(0.03, 0.015, 0.035);
  WholeTouch touch(PointTouch{surface_of(test::sparse_grid(step_distance, bounds, voxel, 5e-3, 5e-3)), {}, {}});
  const std::array<Vec3, 5> corners = {Vec3(-0.012, 0.0, 0.038), Vec3(-0.012, 0.0, 0.008), Vec3(0.015, 0.0, 0.008),
                                       Vec3(0.015, 0.0, 0.038), Vec3(-0.012, 0.0, 0.038)};
  std::vector<Vec3> path;
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    const std::vector<Vec3> part = test::line(corners[i], corners[i + 1], 20000);
    path.insert(path.end(), part.begin(), part.end());
  }
  const double given = loop_work(touch, path);
  EXPECT_LT(given, 1e-5);
  EXPECT_GT(given, -1e-3);  // and it does give back what it took
}

TEST(VirtualContactPoint, AProbeThatJumpsOverTheBandIsHeldWhereItCameIn) {
  PointTouch touch{thin_banded(), with(Formulation::consistent), {}};
  touch.at(Vec3(0.001, 0.002, half + 1e-3));
  const LawForce force = touch.at(Vec3(0.002, 0.001, half - 9e-3));
  ASSERT_TRUE(force.contact);
  EXPECT_LT((force.force - Vec3(0.0, 0.0, stiffness * 2e-3)).norm(), 1e-3);
}

// --- local materials ---

/// A box whose stiffness rises along x, from 500 N/m to 1500 N/m around x = 0.
std::shared_ptr<const ImplicitSurface> half_soft() {
  const auto distance = [](const Vec3& p) { return test::box_distance(p, Vec3::Constant(half)); };
  SparseSource source = test::sparse_source(distance, test::cube(half), voxel, 6e-3, 6e-3);
  for (SparseBlock& block : source.blocks) {
    block.material.resize(SparseBlock::points);
    for (int n = 0; n < static_cast<int>(SparseBlock::points); ++n) {
      const double x = voxel * (SparseBlock::side * block.at[0] + n % SparseBlock::side);
      block.material[static_cast<std::size_t>(n)].stiffness = x < 0.0 ? 500.0F : 1500.0F;
    }
  }
  return surface_of(std::make_shared<const SparseGrid>(test::must(SparseGrid::build(std::move(source)))));
}

TEST(VirtualContactPoint, MaterialIsLookedUpAtTheContact) {
  const auto surface = half_soft();
  Material own;
  own.stiffness = 123.456;
  own.damping = 0.1;
  own.static_friction = 0.7;
  own.dynamic_friction = 0.3;
  SparseHint hint;
  const auto stiffness_at = [&](double x) { return material_at(*surface, own, Vec3(x, 0.0, half), hint).stiffness; };
  EXPECT_EQ(stiffness_at(-5e-3), 500.0);
  EXPECT_EQ(stiffness_at(5e-3), 1500.0);
  EXPECT_NEAR(stiffness_at(-0.25 * voxel), 1250.0, 1e-3);
  const Material there = material_at(*surface, own, Vec3(5e-3, 0.0, half), hint);
  EXPECT_EQ(there.damping, 0.1);
  EXPECT_EQ(there.static_friction, 0.7);
  EXPECT_EQ(there.dynamic_friction, 0.3);
  EXPECT_EQ(material_at(*surface, own, Vec3(1.0, 0.0, 0.0), hint).stiffness, 123.456);
  for (const Formulation formulation : {Formulation::literal, Formulation::consistent}) {
    PointTouch touch{surface, with(formulation), own};
    touch.material.dynamic_friction = touch.material.static_friction = 0.0;
    EXPECT_NEAR(pressed(touch, Vec3(-5e-3, 0.0, half - 1e-3)).force.z(), 0.5, 1e-4);
    EXPECT_NEAR(pressed(touch, Vec3(5e-3, 0.0, half - 1e-3)).force.z(), 1.5, 1e-4);
  }
}

/// Work (J) on a hand that presses at x = from, slides to x = to at a depth of 1 mm and lets go there.
template <class T>
double slide_work(T& touch, double from, double to) {
  std::vector<Vec3> path = test::line({from, 0.0, half + 1e-4}, {from, 0.0, half - 1e-3}, 2000);
  const auto append = [&path](const std::vector<Vec3>& more) { path.insert(path.end(), more.begin(), more.end()); };
  append(test::line({from, 0.0, half - 1e-3}, {to, 0.0, half - 1e-3}, 8000));
  append(test::line({to, 0.0, half - 1e-3}, {to, 0.0, half + 1e-4}, 2000));
  double work = 0.0;
  Vec3 last_force = Vec3::Zero();
  for (std::size_t i = 0; i < path.size(); ++i) {
    const Vec3 force = touch.at(path[i]).force;
    if (i > 0) work += 0.5 * (force + last_force).dot(path[i] - path[i - 1]);
    last_force = force;
  }
  return work;
}

TEST(VirtualContactPoint, ChangesOfStiffnessGiveNoMoreThanTheyTook) {
  const auto surface = half_soft();
  PointTouch printed{surface, with(Formulation::literal), {}};
  EXPECT_NEAR(slide_work(printed, -5e-3, 5e-3), 0.5e-3, 1e-5);  // (1500 - 500) / 2 (1 mm)²
  for (const double friction : {0.0, 0.01}) {
    PointTouch law{surface, with(Formulation::consistent), {}};
    law.material.static_friction = law.material.dynamic_friction = friction;
    WholeTouch ours(law);
    EXPECT_LT(slide_work(ours, -5e-3, 5e-3), 1e-6);
    // What the way back takes pays for the next way there.
    const double taken = slide_work(ours, 5e-3, -5e-3);
    EXPECT_NEAR(taken, -0.5e-3, 2e-5);
    const double given = slide_work(ours, -5e-3, 5e-3);
    EXPECT_NEAR(given, 0.5e-3, 3e-5);
    EXPECT_LT(given + taken, 1e-6);
    EXPECT_LT(slide_work(ours, -5e-3, 5e-3), 1e-6);
  }
}

TEST(VirtualContactPoint, RandomLoopsOverChangingStiffnessGiveNoEnergy) {
  Rng rng(21);
  WholeTouch ours(PointTouch{half_soft(), with(Formulation::consistent), {}});
  double total = 0.0;
  for (int n = 0; n < 12; ++n) {
    const std::vector<Vec3> loop = test::random_loop(rng, Vec3(0.0, 0.0, half - 0.2e-3), 4e-3, 1.5e-3, 4000);
    total += loop_work(ours, loop);
    EXPECT_LT(total, 2e-6) << n;
  }
}

// --- through step ---

TEST(VirtualContactPoint, StepFeelsTheSame) {
  for (const Formulation formulation : {Formulation::literal, Formulation::consistent}) {
    PointTouch touch{box(), with(formulation), {}};
    touch.material.static_friction = touch.material.dynamic_friction = 0.5;
    touch.material.damping = 1.0;
    Instance instance;
    instance.name = "box";
    instance.surface = touch.surface;
    instance.law = touch.law;
    instance.material = touch.material;
    const Scene scene = test::must(Scene::build({instance}, 0.0));
    ProxyState state;
    Rng rng(5);
    for (int i = 0; i < 400; ++i) {
      const double t = i * 1e-3;
      ProbeSample probe = test::probe_at({0.012 + 0.02 * t, 0.001, half + 1e-3 * std::cos(20.0 * t)});
      probe.twist.linear = Vec3(0.02, 0.0, -0.02 * std::sin(20.0 * t));
      const ForceSample felt = step(scene, state, probe, test::tick);
      const LawForce direct = touch.at(probe.pose.position, probe.twist.linear);
      ASSERT_LT((felt.wrench.force - direct.force).norm(), 1e-12) << i;
      ASSERT_EQ(felt.flags.has(TickFlag::contact), direct.contact);
    }
  }
}

}  // namespace
}  // namespace asperity::virtual_contact_point_test
