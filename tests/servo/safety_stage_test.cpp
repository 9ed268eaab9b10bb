#include "asperity/servo/safety_stage.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
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

// --- limits of a place and a speed ---

ProbeSample probe_at(const Vec3& position, const Vec3& velocity = Vec3::Zero(), std::uint32_t buttons = 0) {
  ProbeSample probe;
  probe.pose.position = position;
  probe.twist.linear = velocity;
  probe.buttons = buttons;
  return probe;
}

rc::Gen<Vec3> any_vector(int most, double unit) {
  const auto component = rc::gen::map(rc::gen::inRange(-most, most + 1), [unit](int v) { return v * unit; });
  return rc::gen::map(rc::gen::tuple(component, component, component), [](const std::tuple<double, double, double>& t) {
    return Vec3(std::get<0>(t), std::get<1>(t), std::get<2>(t));
  });
}

/// How much of the largest force may lead out of a workspace around the origin.
double let_out(const SafetySettings& settings, const Vec3& position) {
  const double left = settings.workspace_radius - position.norm();
  return settings.max_force * std::clamp(left / (settings.border * settings.workspace_radius), 0.0, 1.0);
}

RC_GTEST_PROP(SafetyStage, NoSequenceOfForcesPlacesSpeedsAndTimesLeavesAnyLimit, ()) {
  SafetySettings settings = SafetySettings::for_hands(find_profile("falcon").value());
  settings.latches = *rc::gen::arbitrary<bool>();
  settings.enabling_button = *rc::gen::element(-1, 0, 3);
  settings.engage = Seconds(*rc::gen::element(0.0, 0.01));
  settings.border = *rc::gen::element(0.05, 0.5, 1.0);
  SafetyStage s = SafetyStage::build(settings).value();
  Vec3 before = Vec3::Zero();
  for (int tick = 0; tick < 60; ++tick) {
    const bool free = tick == 0 || *rc::gen::inRange(0, 12) == 0;
    const bool wild = *rc::gen::inRange(0, 30) == 0;
    const Vec3 rendered = free ? Vec3(Vec3::Zero()) : wild ? *any_force() : *any_vector(30000, 1e-3);
    ProbeSample probe =
        probe_at(*any_vector(40, 1e-3), *any_vector(2500, 1e-3), *rc::gen::inRange(0, 10) == 0 ? 0U : 9U);
    if (*rc::gen::inRange(0, 30) == 0) probe.twist.linear.y() = *rc::gen::element(nan, infinity, 1e300);
    const Seconds dt(*rc::gen::element(1e-3, 1e-3, 25e-6, 0.02, 0.2));
    if (*rc::gen::inRange(0, 15) == 0) s.acknowledge();
    const SafetyOutput output = s.apply(force(rendered), probe, dt);
    RC_ASSERT(output.force.allFinite());
    RC_ASSERT(output.force.norm() <= settings.max_force);
    if (probe.twist.linear.allFinite()) {
      RC_ASSERT(output.force.dot(probe.twist.linear) <= settings.max_power * (1.0 + 1e-12));
      const Vec3& position = probe.pose.position;
      RC_ASSERT(output.force.dot(position) <= let_out(settings, position) * position.norm() + 1e-12);
    }
    const double slewed = settings.slew_limit * dt.count() * (1.0 + 1e-12) + 1e-12;
    const bool cut = output.flags.has(TickFlag::at_border) || output.flags.has(TickFlag::power_limited);
    RC_ASSERT(cut || (output.force - before).norm() <= slewed);
    RC_ASSERT(output.force.norm() <= before.norm() + slewed);
    before = output.force;
  }
}

TEST(SafetyStage, TheForceThatLeadsOutFadesTowardsTheBorderAndNoOtherDoes) {
  SafetySettings settings{.max_force = 4.0, .slew_limit = 1e9};
  settings.workspace_radius = 0.1;
  SafetyStage s = SafetyStage::build(settings).value();
  s.apply(force(Vec3::Zero()), {}, Seconds(1e-3));
  const auto sent = [&](double x, const Vec3& rendered) {
    return s.apply(force(rendered), probe_at(Vec3(x, 0, 0)), Seconds(1e-3));
  };
  EXPECT_EQ(sent(0.0899, Vec3(4, 0, 0)).force, Vec3(4, 0, 0));
  // A force of half of the limit is cut where half of the border is left, not before.
  EXPECT_EQ(sent(0.0949, Vec3(2, 1, 0)).force, Vec3(2, 1, 0));
  EXPECT_NEAR((sent(0.095, Vec3(3, 1, 0)).force - Vec3(2, 1, 0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((sent(0.0975, Vec3(3, 1, 0)).force - Vec3(1, 1, 0)).norm(), 0.0, 1e-12);
  const SafetyOutput beyond = sent(0.2, Vec3(3, 1, 0));
  EXPECT_NEAR((beyond.force - Vec3(0, 1, 0)).norm(), 0.0, 1e-12);
  EXPECT_TRUE(beyond.flags.has(TickFlag::at_border));
  // What leads back in is felt in full.
  const SafetyOutput back = sent(0.2, Vec3(-3, 1, 0));
  EXPECT_EQ(back.force, Vec3(-3, 1, 0));
  EXPECT_FALSE(back.flags.has(TickFlag::at_border));
}

TEST(SafetyStage, PowerIsLimitedOnlyWhereTheForceDoesWorkOnTheHand) {
  SafetySettings settings{.max_force = 10.0, .slew_limit = 1e9};
  settings.max_power = 2.0;
  SafetyStage s = SafetyStage::build(settings).value();
  s.apply(force(Vec3::Zero()), {}, Seconds(1e-3));
  const auto sent = [&](const Vec3& velocity) {
    return s.apply(force(Vec3(3, 4, 0)), probe_at(Vec3::Zero(), velocity), Seconds(1e-3));
  };
  EXPECT_EQ(sent(Vec3(0.2, 0.3, 0)).force, Vec3(3, 4, 0));  // 1.8 W
  const SafetyOutput limited = sent(Vec3(0.5, 1.0, 0));     // 5.5 W
  EXPECT_NEAR((limited.force - Vec3(3, 4, 0) * (2.0 / 5.5)).norm(), 0.0, 1e-12);
  EXPECT_TRUE(limited.flags.has(TickFlag::power_limited));
  EXPECT_EQ(sent(Vec3(-5, -5, 0)).force, Vec3(3, 4, 0));  // the hand does it
}

// --- faults ---

/// In contact with 2 N for a while, as a hand is given it.
SafetyStage in_the_hand(const SafetySettings& settings) {
  SafetyStage s = SafetyStage::build(settings).value();
  s.apply(force(Vec3::Zero()), probe_at(Vec3::Zero(), Vec3::Zero(), 1U), Seconds(1e-3));
  for (int tick = 0; tick < 1000; ++tick)
    s.apply(force(Vec3(0, 0, 2)), probe_at(Vec3::Zero(), Vec3::Zero(), 1U), Seconds(1e-3));
  return s;
}

struct Cause {
  Fault fault;
  Vec3 rendered;
  ProbeSample probe;
  double dt;
};
std::vector<Cause> causes() {
  const Vec3 pushes(0, 0, 2);
  return {{Fault::input_not_finite, pushes, probe_at(Vec3(nan, 0, 0)), 1e-3},
          {Fault::input_not_finite, pushes, probe_at(Vec3::Zero(), Vec3(0, infinity, 0)), 1e-3},
          {Fault::output_not_finite, Vec3(0, nan, 0), {}, 1e-3},
          {Fault::too_fast, pushes, probe_at(Vec3::Zero(), Vec3(0, 5.1, 0)), 1e-3},
          {Fault::overrun, pushes, {}, 0.051}};
}

TEST(SafetyStage, EveryFaultLatchesUntilItIsAcknowledgedAndForceIsLetInAnew) {
  const SafetySettings settings = SafetySettings::for_hands(find_profile("touch").value());
  for (const Cause& cause : causes()) {
    SCOPED_TRACE(fault_sentence(cause.fault));
    SafetyStage s = in_the_hand(settings);
    ASSERT_EQ(s.last_force(), Vec3(0, 0, 2));
    ASSERT_EQ(s.fault(), Fault::none);
    EXPECT_TRUE(s.apply(force(cause.rendered), cause.probe, Seconds(cause.dt)).flags.has(TickFlag::fault));
    // 2 N at 1,650 N/s.
    s.apply(force(Vec3(0, 0, 2)), {}, Seconds(1e-3));
    for (int tick = 0; tick < 100; ++tick) {
      const SafetyOutput output = s.apply(force(Vec3(0, 0, 2)), {}, Seconds(1e-3));
      ASSERT_EQ(output.force, Vec3(Vec3::Zero()));
      ASSERT_TRUE(output.flags.has(TickFlag::fault));
      ASSERT_EQ(s.fault(), cause.fault);
    }
    // The first one is what is told.
    s.raise(Fault::stalled);
    EXPECT_EQ(s.fault(), cause.fault);
    s.acknowledge();
    EXPECT_EQ(s.fault(), Fault::none);
    // Inside: nothing until it has left, and then over half a second.
    SafetyOutput output = s.apply(force(Vec3(0, 0, 2)), {}, Seconds(1e-3));
    EXPECT_EQ(output.force, Vec3(Vec3::Zero()));
    EXPECT_TRUE(output.flags.has(TickFlag::started_inside));
    EXPECT_FALSE(output.flags.has(TickFlag::fault));
    s.apply(force(Vec3::Zero()), {}, Seconds(1e-3));
    for (int tick = 2; tick <= 250; ++tick) output = s.apply(force(Vec3(0, 0, 3.3)), {}, Seconds(1e-3));
    EXPECT_NEAR(output.force.z(), 0.5 * 3.3, 1e-9);
    EXPECT_TRUE(output.flags.has(TickFlag::force_limited));
    for (int tick = 0; tick <= 250; ++tick) output = s.apply(force(Vec3(0, 0, 3.3)), {}, Seconds(1e-3));
    EXPECT_NEAR(output.force.z(), 3.3, 1e-12);
  }
}

TEST(SafetyStage, WithoutLatchesAFaultIsOverWithWhatCausedIt) {
  SafetySettings settings = SafetySettings::from_profile(find_profile("touch").value());
  settings.longest_tick = Seconds(0.05);
  for (const Cause& cause : causes()) {
    SCOPED_TRACE(fault_sentence(cause.fault));
    SafetyStage s = in_the_hand(settings);
    const SafetyOutput output = s.apply(force(cause.rendered), cause.probe, Seconds(cause.dt));
    EXPECT_LT(output.force.norm(), 2.0);
    EXPECT_EQ(s.fault(), cause.fault);
    for (int tick = 0; tick < 2; ++tick) s.apply(force(Vec3(0, 0, 2)), {}, Seconds(1e-3));
    EXPECT_EQ(s.last_force(), Vec3(0, 0, 2));
    EXPECT_EQ(s.fault(), Fault::none);
    // One that the loop raises stays all the same.
    s.raise(Fault::device_lost);
    for (int tick = 0; tick < 10; ++tick) s.apply(force(Vec3(0, 0, 2)), {}, Seconds(1e-3));
    EXPECT_EQ(s.last_force(), Vec3(Vec3::Zero()));
    EXPECT_EQ(s.fault(), Fault::device_lost);
  }
}

TEST(SafetyStage, PlacesAndSpeedsTooLargeToMultiplyAreBeyondTheLimits) {
  SafetySettings settings{.max_force = 4.0, .slew_limit = 1e9};
  settings.workspace_radius = 0.1;
  settings.max_power = 2.0;
  SafetyStage s = SafetyStage::build(settings).value();
  s.apply(force(Vec3::Zero()), {}, Seconds(1e-3));
  EXPECT_EQ(s.apply(force(Vec3(3, 0, 0)), probe_at(Vec3(1e300, 0, 0)), Seconds(1e-3)).force, Vec3(Vec3::Zero()));
  EXPECT_EQ(s.apply(force(Vec3(3, 0, 0)), probe_at(Vec3::Zero(), Vec3(largest, 0, 0)), Seconds(1e-3)).force,
            Vec3(Vec3::Zero()));
  EXPECT_EQ(s.apply(force(Vec3(3, 3, 0)), probe_at(Vec3::Zero(), Vec3(largest, -largest, 0)), Seconds(1e-3)).force,
            Vec3(Vec3::Zero()));
}

TEST(SafetyStage, NoForceWithoutTheButtonAndAFreeTickAfterEachLetGo) {
  SafetySettings settings = SafetySettings::for_hands(find_profile("touch").value());
  settings.enabling_button = 0;
  settings.engage = Seconds(0.0);
  SafetyStage s = in_the_hand(settings);
  ASSERT_EQ(s.last_force(), Vec3(0, 0, 2));
  const auto sent = [&](double z, std::uint32_t buttons) {
    return s.apply(force(Vec3(0, 0, z)), probe_at(Vec3::Zero(), Vec3::Zero(), buttons), Seconds(1e-3));
  };
  EXPECT_TRUE(sent(2.0, 0U).flags.has(TickFlag::not_enabled));
  EXPECT_EQ(sent(2.0, 2U).force, Vec3(Vec3::Zero()));  // another button is not it
  // While it is not held a free tick lets nothing in.
  sent(0.0, 0U);
  EXPECT_EQ(sent(2.0, 1U).force, Vec3(Vec3::Zero()));
  sent(0.0, 1U);
  sent(2.0, 3U);
  EXPECT_EQ(sent(2.0, 3U).force, Vec3(0, 0, 2));
}

TEST(SafetyStage, RefusesEveryOtherSettingThatIsNone) {
  const auto place = [](const auto& change) {
    SafetySettings settings;
    change(settings);
    const auto built = SafetyStage::build(settings);
    return built ? std::string("accepted") : built.error().place;
  };
  for (const double bad : {0.0, -1.0, nan}) {
    EXPECT_EQ(place([&](SafetySettings& s) { s.max_power = bad; }), "max_power");
    EXPECT_EQ(place([&](SafetySettings& s) { s.max_velocity = bad; }), "max_velocity");
    EXPECT_EQ(place([&](SafetySettings& s) { s.workspace_radius = bad; }), "workspace_radius");
    EXPECT_EQ(place([&](SafetySettings& s) { s.longest_tick = Seconds(bad); }), "longest_tick");
  }
  for (const double bad : {-0.1, 1.1, nan}) {
    EXPECT_EQ(place([&](SafetySettings& s) { s.border = bad; }), "border");
  }
  for (const double bad : {-0.1, infinity, nan}) {
    EXPECT_EQ(place([&](SafetySettings& s) { s.engage = Seconds(bad); }), "engage");
  }
  for (const double bad : {infinity, nan}) {
    EXPECT_EQ(place([&](SafetySettings& s) { s.workspace.y() = bad; }), "workspace");
  }
  for (const int bad : {-2, 32})
    EXPECT_EQ(place([&](SafetySettings& s) { s.enabling_button = bad; }), "enabling_button");
  EXPECT_EQ(place([](SafetySettings&) {}), "accepted");
}

/// A stage that uses all that there is.
SafetySettings every_setting() {
  SafetySettings settings;
  settings.max_force = 5.0;
  settings.slew_limit = 2000.0;
  settings.max_power = 1.0;
  settings.max_velocity = 2.0;
  settings.workspace_radius = 0.1;
  settings.engage = Seconds(0.02);
  settings.enabling_button = 1;
  settings.longest_tick = Seconds(0.02);
  return settings;
}

RC_GTEST_PROP(SafetyStage, GoesOnFromItsMemoryInAnotherStage, ()) {
  SafetySettings settings = every_setting();
  settings.latches = *rc::gen::arbitrary<bool>();
  SafetyStage one = SafetyStage::build(settings).value();
  SafetyStage other = SafetyStage::build(settings).value();
  const auto ticks = *rc::gen::inRange(1, 200);
  const auto share = [](int percent) { return *rc::gen::inRange(0, 100) < percent; };
  for (int i = 0; i < ticks; ++i) {
    // Whoever is not told anything else has it from the memory alone.
    if (share(3)) one.raise(Fault::stalled);
    if (share(3)) one.acknowledge();
    if (share(3)) one.released();
    other.restore(one.memory());
    ProbeSample probe;
    probe.buttons = share(90) ? 2U : 0U;
    probe.twist.linear.x() = share(3) ? 3.0 : 0.2;
    const ForceSample rendered = force(share(30) ? Vec3(Vec3::Zero()) : *any_force());
    const Seconds dt(share(3) ? 0.05 : 1e-3);
    const SafetyOutput a = one.apply(rendered, probe, dt);
    const SafetyOutput b = other.apply(rendered, probe, dt);
    RC_ASSERT(a.force == b.force);
    RC_ASSERT(a.flags.bits() == b.flags.bits());
    RC_ASSERT(one.fault() == other.fault());
    RC_ASSERT(one.armed() == other.armed());
  }
}

TEST(SafetyStage, RampsUpFromZeroOnceTheDeviceHasLetGo) {
  SafetyStage s = armed(10.0, 1000.0);
  for (int i = 0; i < 10; ++i) s.apply(force(Vec3(5.0, 0.0, 0.0)), {}, Seconds(1e-3));
  ASSERT_EQ(s.last_force().x(), 5.0);
  s.released();
  EXPECT_TRUE(s.last_force().isZero(0.0));
  EXPECT_TRUE(s.armed());
  EXPECT_NEAR(s.apply(force(Vec3(5.0, 0.0, 0.0)), {}, Seconds(1e-3)).force.x(), 1.0, 1e-12);
}

TEST(SafetyStage, EveryFaultHasANameAndASentence) {
  for (const Named<Fault>& fault : Names<Fault>::table) {
    EXPECT_EQ(value_named<Fault>(fault.name), fault.value);
    EXPECT_FALSE(fault_sentence(fault.value).empty()) << fault.name;
  }
  EXPECT_TRUE(names_differ<Fault>());
  // The next one would be missing in the table.
  EXPECT_EQ(Names<Fault>::table.size(), static_cast<std::size_t>(Fault::clock_stopped) + 1);
}

}  // namespace
}  // namespace asperity::safety_stage_test
