// A probe with a radius under laws without a proxy: felt where the surface lies that much farther out.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "tests/render/implicit_touch.h"

namespace asperity::offset_ball_test {
namespace {

using implicit::far_outside;
using implicit::loop_work;
using implicit::MagnetTouch;
using implicit::PointTouch;
using implicit::surface_of;
using implicit::WholeTouch;
using test::stiffness;

constexpr double voxel = 1e-3;
constexpr double sphere = 0.03;  // m, of sparse_ball
constexpr double half = 0.02;    // m, of sparse_box
constexpr double radius = 2e-3;  // m, of the probe
constexpr double band = 3e-3;

std::shared_ptr<const ImplicitSurface> ball() {
  static const auto surface = surface_of(test::sparse_ball(voxel, 8e-3));
  return surface;
}
std::shared_ptr<const ImplicitSurface> box() {
  static const auto surface = surface_of(test::sparse_box(voxel, 8e-3));
  return surface;
}

PointTouch pushed(std::shared_ptr<const ImplicitSurface> surface, double friction = 0.0) {
  PointTouch touch{std::move(surface), VirtualContactPointLaw{}};
  touch.material.stiffness = stiffness;
  touch.material.static_friction = touch.material.dynamic_friction = friction;
  return touch;
}

Vec3 any_way(Rng& rng) {
  return Vec3(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)).normalized();
}

// The smooth reconstruction of a sphere's distance is off by a few micrometres at voxels of 1 mm.
constexpr double off_sphere = 6e-6;

TEST(OffsetBall, AVirtualContactPointPushesABallOffASphereAsTheSphereDoes) {
  Rng rng(21);
  for (int i = 0; i < 200; ++i) {
    WholeTouch touch(pushed(ball()), radius);
    const Vec3 way = any_way(rng);
    touch.at(far_outside());
    EXPECT_FALSE(touch.at((sphere + radius + 2.0 * off_sphere) * way).contact);
    const double depth = rng.uniform(0.05e-3, 3.5e-3);  // also with the middle inside
    const WholeTouch::Felt felt = touch.at((sphere + radius - depth) * way);
    ASSERT_TRUE(felt.contact);
    EXPECT_NEAR(felt.force.dot(way), stiffness * depth, stiffness * (off_sphere + 0.01 * depth)) << depth;
    EXPECT_LT(felt.force.cross(way).norm(), 0.01 * felt.force.norm());
    // Where it touches is on the sphere, not where its middle is held.
    EXPECT_NEAR(felt.point.norm(), sphere, 3.0 * off_sphere);
    // A push goes through the ball's middle.
    const Vec3 grip(0.0, implicit::tool_length, 0.0);
    EXPECT_LT((felt.torque + grip.cross(felt.force)).norm(), 1e-9);
  }
}

TEST(OffsetBall, AMagnetDrawsABallFromWhereItsSurfaceIsWithinTheBand) {
  Rng rng(22);
  for (int i = 0; i < 200; ++i) {
    MagnetTouch magnet{ball(), {Formulation::consistent, band}, {}};
    magnet.material.stiffness = stiffness;
    WholeTouch touch(magnet, radius);
    const Vec3 way = any_way(rng);
    touch.at(far_outside());
    EXPECT_FALSE(touch.at((sphere + radius + band + 2.0 * off_sphere) * way).contact);
    const double gap = rng.uniform(0.05, 0.95) * band;
    const double share = 1.0 - gap * gap / (band * band);
    const WholeTouch::Felt felt = touch.at((sphere + radius + gap) * way);
    EXPECT_NEAR(-felt.force.dot(way), stiffness * gap * share * share, stiffness * (2.0 * off_sphere + 0.01 * gap));
    const WholeTouch::Felt inside = touch.at((sphere + radius - 1e-3) * way);
    EXPECT_NEAR(inside.force.dot(way), stiffness * 1e-3, stiffness * 2e-5);
  }
}

TEST(OffsetBall, FrictionTurnsTheBallWhereItRubs) {
  WholeTouch touch(pushed(box(), 0.5), radius);
  touch.at(far_outside());
  WholeTouch::Felt felt{};
  for (int i = 0; i <= 200; ++i) felt = touch.at(Vec3(-0.01 + 1e-4 * i, 0.0, half + radius - 1e-3));
  ASSERT_LT(felt.force.x(), -0.01);
  // The lever is from the grip to where the ball touches, right below its middle.
  const Vec3 lever(0.0, -implicit::tool_length, -radius);
  EXPECT_LT((felt.torque - lever.cross(felt.force)).norm(), 1e-6 * radius * felt.force.norm());
}

TEST(OffsetBall, T1_AClosedWayAlongAFaceDoesNoWork) {
  WholeTouch touch(pushed(ball()), radius);
  std::vector<Vec3> loop;
  constexpr int steps = 4000;
  constexpr double wide = 2e-3;
  for (int i = 0; i < steps; ++i) {
    const double a = 2.0 * std::numbers::pi * i / steps;
    loop.push_back(Vec3(wide * std::cos(a), 0.3e-3 * std::sin(2.0 * a), sphere + radius + 1.5e-3 * std::sin(a)));
  }
  const double area = std::numbers::pi * wide * 1.5e-3;
  EXPECT_LT(std::abs(loop_work(touch, loop)), 3e-6 * stiffness * area);
}

TEST(OffsetBall, T2_ForcesOfABallOverAnEdgeChangeByTheStep) {
  // From the top around the edge, 0.5 to 1 mm deep.
  const Vec3 from(half - 2e-3, 0.3e-3, half + radius - 0.5e-3);
  const Vec3 to(half + radius - 0.5e-3, 0.5e-3, half - 2e-3);
  const auto jump = [&](int count) {
    WholeTouch touch(pushed(box()), radius);
    touch.at(far_outside());
    Vec3 before = touch.at(from).force;
    double largest = 0.0;
    for (int i = 1; i <= count; ++i) {
      const Vec3 now = touch.at(from + static_cast<double>(i) / count * (to - from)).force;
      largest = std::max(largest, (now - before).norm());
      before = now;
    }
    return largest;
  };
  const std::array<double, 3> jumps = {jump(400), jump(4000), jump(40000)};
  EXPECT_NEAR(jumps[0] / jumps[1], 10.0, 2.0);
  EXPECT_NEAR(jumps[1] / jumps[2], 10.0, 2.0);
  // It turns by a right angle on the way.
  EXPECT_GT(400 * jumps[0], 0.5 * stiffness * 1e-3);
}

/// A program's own law that says it takes a ball: a spring to where the surface lies its radius farther out.
struct OwnSpring {
  static constexpr LawFacts facts{
      .name = "own-spring", .title = "a spring off a distance", .source = "this test", .ball = true};
  static LawForce force(const TouchedSurface& surface, const Material& material, const Vec3& probe, const Vec3&,
                        Seconds) noexcept {
    const FieldSample sample = surface.eval(probe);
    const double depth = surface.probe_radius() - sample.value;
    LawForce answer;
    if (!(depth > 0.0)) return answer;
    answer.contact = true;
    answer.normal = sample.gradient.normalized();
    answer.point = probe - sample.value * answer.normal;
    answer.penetration = depth;
    answer.push = material.stiffness * depth;
    answer.force = answer.push * answer.normal;
    answer.stored = 0.5 * material.stiffness * depth * depth;
    return answer;
  }
};

TEST(OffsetBall, AProgramsOwnLawIsToldTheRadiusIfItTakesABall) {
  Instance instance;
  instance.name = "ball";
  instance.surface = ball();
  instance.law = OwnSpring{};
  instance.material.stiffness = stiffness;
  for (const double ball_radius : {0.0, radius}) {
    const Scene scene = test::must(Scene::build({instance}, ball_radius));
    ProxyState state;
    test::touch(scene, state, far_outside());
    const ForceSample felt = test::touch(scene, state, Vec3(0.0, sphere + ball_radius - 1e-3, 0.0));
    EXPECT_NEAR(felt.wrench.force.y(), stiffness * 1e-3, 0.02 * stiffness * 1e-3) << ball_radius;
  }
}

TEST(OffsetBall, FormsAsPrintedAreOfPointsAndSaySo) {
  Instance instance;
  instance.name = "ball";
  instance.surface = ball();
  for (const Law& law : {Law(VirtualContactPointLaw{.formulation = Formulation::literal}),
                         Law(MagneticLaw{.formulation = Formulation::literal})}) {
    instance.law = law;
    const Result<Scene> built = Scene::build({instance}, radius);
    ASSERT_FALSE(static_cast<bool>(built));
    EXPECT_EQ(built.error().place, "surfaces[0].law");
    EXPECT_NE(built.error().message().find("touches with a point"), std::string::npos);
    EXPECT_NE(built.error().accepted.find("virtual-contact-point"), std::string::npos) << built.error().accepted;
    EXPECT_EQ(built.error().accepted.find("height-field"), std::string::npos) << built.error().accepted;
    EXPECT_TRUE(static_cast<bool>(Scene::build({instance}, 0.0)));
  }
}

TEST(OffsetBall, ABandThatIsTooNarrowForTheBallIsRefusedAndSaysWhatWouldDo) {
  Instance instance;
  instance.name = "ball";
  instance.surface = ball();
  VirtualContactPointLaw law;
  law.offset = 1e-3;
  instance.law = law;
  const double most = ball()->reach_outside() - law.offset;
  EXPECT_TRUE(static_cast<bool>(Scene::build({instance}, 0.999 * most)));
  const Result<Scene> built = Scene::build({instance}, 1.001 * most);
  ASSERT_FALSE(static_cast<bool>(built));
  EXPECT_EQ(built.error().place, "probe.radius");
  EXPECT_NE(built.error().accepted.find("band_outside"), std::string::npos);
  // A scene shown twice its size has as wide a band in the hand's lengths.
  SceneSettings zoomed;
  zoomed.probe_radius = 1.9 * most;
  zoomed.view.zoom = 2.0;
  EXPECT_TRUE(static_cast<bool>(Scene::build({instance}, zoomed)));
}

}  // namespace
}  // namespace asperity::offset_ball_test
