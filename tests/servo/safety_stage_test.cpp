#include "asperity/servo/safety_stage.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace asperity::safety_stage_test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double largest = std::numeric_limits<double>::max();

SafetyStage stage(double max_force, double slew) {
  return SafetyStage::build({max_force, slew}).value();
}

ForceSample force(const Vec3& f) {
  ForceSample sample;
  sample.wrench.force = f;
  sample.flags.set(TickFlag::contact, !f.isZero(0.0));
  return sample;
}

/// Past the rule about starting inside: one free tick.
SafetyStage armed(double max_force, double slew) {
  SafetyStage s = stage(max_force, slew);
  s.apply(force(Vec3::Zero()), {}, Seconds(1e-3));
  return s;
}

/// Any double a broken law could give: usual forces, huge ones, NaN and infinities.
rc::Gen<double> any_component() {
  return rc::gen::oneOf(rc::gen::map(rc::gen::inRange(-20000, 20000), [](int v) { return v * 1e-3; }),
                        rc::gen::element(nan, infinity, -infinity, largest, -largest, 0.0, -0.0, 5e-324));
}

rc::Gen<Vec3> any_force() {
  return rc::gen::map(
      rc::gen::tuple(any_component(), any_component(), any_component()),
      [](const std::tuple<double, double, double>& t) { return Vec3(std::get<0>(t), std::get<1>(t), std::get<2>(t)); });
}

RC_GTEST_PROP(SafetyStage, EveryOutputIsFiniteAndInsideBothLimits, ()) {
  const double max_force = *rc::gen::map(rc::gen::inRange(1, 300), [](int v) { return v * 0.1; });
  const double slew = *rc::gen::map(rc::gen::inRange(1, 100000), [](int v) { return v * 1.0; });
  const Seconds dt(*rc::gen::element(1e-3, 25e-6, 1e-2, 0.5));
  SafetyStage s = stage(max_force, slew);
  Vec3 before = Vec3::Zero();
  for (const Vec3& f : *rc::gen::container<std::vector<Vec3>>(any_force())) {
    ProbeSample probe;
    probe.pose.position.x() = *rc::gen::element(0.0, 0.0, 0.0, nan);
    const SafetyOutput output = s.apply(force(f), probe, dt);
    RC_ASSERT(output.force.allFinite());
    RC_ASSERT(output.force.norm() <= max_force);
    RC_ASSERT((output.force - before).norm() <= slew * dt.count() + 1e-13 * max_force);
    RC_ASSERT(output.flags.has(TickFlag::output_not_finite) == !f.allFinite());
    RC_ASSERT(output.flags.has(TickFlag::input_not_finite) == std::isnan(probe.pose.position.x()));
    before = output.force;
  }
}

RC_GTEST_PROP(SafetyStage, MagnitudeLimitKeepsTheDirection, ()) {
  const auto component = rc::gen::map(rc::gen::inRange(-100000, 100001), [](int v) { return v * 1e-3; });
  const Vec3 f(*component, *component, *component);
  RC_PRE(f.norm() > 0.0);
  SafetyStage s = armed(5.0, 1e9);
  const SafetyOutput output = s.apply(force(f), {}, Seconds(1e-3));
  RC_ASSERT(output.force.cross(f).norm() <= 1e-12 * f.norm() * output.force.norm());
  RC_ASSERT(output.force.dot(f) > 0.0);
  RC_ASSERT(output.flags.has(TickFlag::force_limited) == (f.norm() > 5.0));
  RC_ASSERT(std::abs(output.force.norm() - std::min(5.0, f.norm())) < 1e-12);
}

TEST(SafetyStage, ForceInsideTheLimitsPassesBitForBit) {
  SafetyStage s = armed(10.0, 1e6);
  const Vec3 f(0.1, -2.3, 3.7);
  const SafetyOutput output = s.apply(force(f), {}, Seconds(1e-3));
  EXPECT_EQ(output.force, f);
  EXPECT_EQ(output.flags.bits(), 0U);
}

TEST(SafetyStage, NotFiniteRampsToZeroAtTheSlewLimit) {
  SafetyStage s = armed(10.0, 1000.0);
  while (s.last_force().y() < 5.0) s.apply(force(Vec3(0, 5, 0)), {}, Seconds(1e-3));
  for (int k = 4; k >= 0; --k) {
    const SafetyOutput output = s.apply(force(Vec3(0, nan, 0)), {}, Seconds(1e-3));
    EXPECT_NEAR(output.force.y(), k, 1e-12);
    EXPECT_TRUE(output.flags.has(TickFlag::output_not_finite));
  }
  s.ramp_down(Seconds(1e-3));
  EXPECT_EQ(s.last_force(), Vec3(Vec3::Zero()));
}

TEST(SafetyStage, ZeroInRampsToZeroAndStaysThere) {
  SafetyStage s = armed(10.0, 1e4);
  s.apply(force(Vec3(3, 4, 0)), {}, Seconds(1e-3));
  ASSERT_NEAR(s.last_force().norm(), 5.0, 1e-12);
  SafetyOutput output;
  for (int k = 0; k < 3; ++k) output = s.apply(force(Vec3::Zero()), {}, Seconds(1e-3));
  EXPECT_EQ(output.force, Vec3(Vec3::Zero()));
  EXPECT_FALSE(output.flags.has(TickFlag::slew_limited));
}

TEST(SafetyStage, RampDownTakesTheTimeTheSlewLimitGives) {
  SafetyStage s = armed(10.0, 100.0);
  while (s.last_force().x() < 2.0) s.apply(force(Vec3(2, 0, 0)), {}, Seconds(1e-3));
  int ticks = 0;
  while (!s.last_force().isZero(0.0) && ticks < 1000) {
    s.ramp_down(Seconds(1e-3));
    ++ticks;
  }
  EXPECT_NEAR(ticks, 20, 1);
}

TEST(SafetyStage, ProbeThatBeginsInsideGetsNoForceUntilItHasLeft) {
  SafetyStage s = stage(10.0, 1e6);
  for (int k = 0; k < 100; ++k) {
    const SafetyOutput output = s.apply(force(Vec3(0, 3, 0)), {}, Seconds(1e-3));
    EXPECT_EQ(output.force, Vec3(Vec3::Zero()));
    EXPECT_TRUE(output.flags.has(TickFlag::started_inside));
  }
  EXPECT_FALSE(s.armed());
  s.apply(force(Vec3::Zero()), {}, Seconds(1e-3));
  EXPECT_TRUE(s.armed());
  const SafetyOutput output = s.apply(force(Vec3(0, 3, 0)), {}, Seconds(1e-3));
  EXPECT_EQ(output.force, Vec3(0, 3, 0));
  EXPECT_FALSE(output.flags.has(TickFlag::started_inside));
}

TEST(SafetyStage, TicksThatCannotBeTrustedDoNotArm) {
  SafetyStage s = stage(10.0, 1e6);
  s.apply(force(Vec3(nan, 0, 0)), {}, Seconds(1e-3));
  EXPECT_FALSE(s.armed());
  ProbeSample broken;
  broken.pose.orientation.w() = infinity;
  s.apply(force(Vec3::Zero()), broken, Seconds(1e-3));
  EXPECT_FALSE(s.armed());
  ForceSample withheld;
  withheld.flags.set(TickFlag::started_inside);
  s.apply(withheld, {}, Seconds(1e-3));
  EXPECT_FALSE(s.armed());
}

TEST(SafetyStage, ResetForgetsForceAndArming) {
  SafetyStage s = armed(10.0, 1e6);
  s.apply(force(Vec3(1, 0, 0)), {}, Seconds(1e-3));
  s.reset();
  EXPECT_EQ(s.last_force(), Vec3(Vec3::Zero()));
  EXPECT_FALSE(s.armed());
}

TEST(SafetyStage, ImpossiblePeriodHoldsTheLastForce) {
  SafetyStage s = armed(10.0, 1e6);
  s.apply(force(Vec3(1, 0, 0)), {}, Seconds(1e-3));
  for (const double dt : {0.0, -1.0, nan, infinity}) {
    EXPECT_EQ(s.apply(force(Vec3(5, 0, 0)), {}, Seconds(dt)).force, Vec3(1, 0, 0)) << dt;
  }
}

TEST(SafetyStage, RefusesLimitsThatAreNone) {
  for (const double bad : {0.0, -1.0, nan, infinity}) {
    EXPECT_EQ(SafetyStage::build({bad, 1.0}).error().place, "max_force");
    EXPECT_EQ(SafetyStage::build({1.0, bad}).error().place, "slew_limit");
  }
}

TEST(SafetyStage, EveryBuiltInProfileGivesAStage) {
  for (const DeviceProfile& profile : device_profiles()) {
    EXPECT_TRUE(SafetyStage::build(SafetySettings::from_profile(profile)).ok()) << profile.name;
  }
}

TEST(SafetyStage, AVolumesForceIsNoStartInside) {
  SafetyStage stage = SafetyStage::build({}).value();
  ForceSample rendered;
  rendered.wrench.force = Vec3(0.0, 0.0, 0.5);
  rendered.flags.set(TickFlag::field_force);
  EXPECT_FALSE(stage.apply(rendered, {}, Seconds(1.0)).flags.has(TickFlag::started_inside));
  EXPECT_NEAR(stage.last_force().z(), 0.5, 1e-12);
  // With a surface that pushes as well, it is one.
  SafetyStage other = SafetyStage::build({}).value();
  rendered.flags.set(TickFlag::contact);
  EXPECT_TRUE(other.apply(rendered, {}, Seconds(1.0)).flags.has(TickFlag::started_inside));
  EXPECT_TRUE(other.last_force().isZero());
}

}  // namespace
}  // namespace asperity::safety_stage_test
