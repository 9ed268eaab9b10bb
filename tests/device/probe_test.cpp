#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "asperity/device/device.h"
#include "asperity/device/ideal_probe.h"
#include "asperity/device/replay_device.h"
#include "asperity/device/simulated_device.h"
#include "tests/device/surfaces.h"

namespace asperity::probe_test {
namespace {

static_assert(Device<IdealProbe> && Device<SimulatedDevice> && Device<ReplayDevice>);

constexpr double pi = std::numbers::pi;

/// A frictionless wall at y = 0.
Vec3 wall(const Vec3& p, double stiffness) {
  return Vec3(0.0, std::max(0.0, -stiffness * p.y()), 0.0);
}

StrokePath pressing_line(double force, double length = 0.04) {
  StrokeSettings s = line_settings(length);
  s.press = PressMode::force;
  s.normal_force = force;
  return build_stroke(s, on_plane).value();
}

TEST(IdealProbe, FollowsTheStrokeExactlyAtItsDepth) {
  StrokeSettings s = line_settings();
  s.depth = 0.0007;
  const StrokePath path = build_stroke(s, OnSphere{0.05}).value();
  IdealProbe probe = IdealProbe::build(path).value();
  for (int k = 0; !probe.finished(); ++k) {
    const ProbeSample sample = probe.read();
    const StrokePose pose = path.pose(sample.time);
    ASSERT_EQ(sample.pose.position, pose.target);
    ASSERT_EQ(sample.twist.linear, pose.velocity);
    if (pose.phase == StrokePhase::contact) {
      ASSERT_NEAR(sample.pose.position.norm(), 0.05 - 0.0007, 1e-7);
    }
    probe.apply(Vec3(0, 5, 0), Seconds(1e-3));
  }
}

/// With the right stiffness the force error decays by exp(-2 pi f t), whatever the period is.
RC_GTEST_PROP(IdealProbe, RegulatedForceApproachesAsStatedAtAnyPeriod, ()) {
  const double period = *rc::gen::element(1e-2, 1e-3, 1e-4);
  const double stiffness = *rc::gen::element(300.0, 1000.0, 5000.0);
  IdealProbeSettings settings;
  settings.stiffness_estimate = stiffness;
  settings.bandwidth = *rc::gen::element(2.0, 10.0, 20.0);
  const StrokePath path = pressing_line(1.5);
  IdealProbe probe = IdealProbe::build(path, settings).value();
  double begin = -1.0;
  while (probe.read().time < path.contact_begin() + Seconds(0.3)) {
    const Vec3 force = wall(probe.read().pose.position, stiffness);
    const double t = probe.read().time.count();
    if (begin < 0.0 && path.pose(Seconds(t)).phase == StrokePhase::contact) begin = t;
    if (begin >= 0.0) {
      const double expected = 1.5 * (1.0 - std::exp(-2.0 * pi * settings.bandwidth * (t - begin)));
      RC_ASSERT(std::abs(force.y() - expected) < 1e-6);
    }
    probe.apply(force, Seconds(period));
  }
  RC_ASSERT(begin > 0.0);
}

TEST(IdealProbe, RegulatorConvergesForEstimatesFromHalfTheStiffnessUp) {
  for (const double estimate : {510.0, 1000.0, 4000.0}) {
    IdealProbeSettings settings;
    settings.stiffness_estimate = estimate;
    IdealProbe probe = IdealProbe::build(pressing_line(1.0), settings).value();
    double force = 0.0;
    while (probe.read().time < probe.path().contact_end() - Seconds(0.01)) {
      force = wall(probe.read().pose.position, 1000.0).y();
      probe.apply(Vec3(0, force, 0), Seconds(1e-3));
    }
    EXPECT_NEAR(force, 1.0, 1e-6) << estimate;
  }
}

TEST(IdealProbe, DepthIsLimitedWhereThereIsNothingToPressOn) {
  IdealProbeSettings settings;
  settings.max_depth = 0.003;
  IdealProbe probe = IdealProbe::build(pressing_line(1.0), settings).value();
  double deepest = 0.0;
  while (!probe.finished()) {
    deepest = std::min(deepest, probe.read().pose.position.y());
    probe.apply(Vec3::Zero(), Seconds(1e-3));
  }
  EXPECT_NEAR(deepest, -0.003, 1e-12);
  EXPECT_EQ(probe.regulated_depth(), 0.0);
}

TEST(IdealProbe, TwistIsTheMotionBetweenTicks) {
  IdealProbe probe = IdealProbe::build(pressing_line(1.0)).value();
  Vec3 before = probe.read().pose.position;
  int checked = 0;
  while (!probe.finished()) {
    probe.apply(wall(probe.read().pose.position, 1000.0), Seconds(1e-4));
    const ProbeSample sample = probe.read();
    const Vec3 difference = (sample.pose.position - before) / 1e-4;
    before = sample.pose.position;
    const StrokePhase now = probe.path().pose(sample.time).phase;
    const StrokePhase earlier = probe.path().pose(sample.time - Seconds(1.01e-4)).phase;
    if (now != earlier) continue;
    ASSERT_NEAR((difference - sample.twist.linear).norm(), 0.0, 1e-6);
    ++checked;
  }
  EXPECT_GT(checked, 1000);
}

TEST(IdealProbe, RefusesSettingsOneByOne) {
  const auto place = [](IdealProbeSettings s) { return IdealProbe::build(pressing_line(1.0), s).error().place; };
  EXPECT_EQ(place({0.0, 20.0, 0.01}), "stiffness_estimate");
  EXPECT_EQ(place({1000.0, -1.0, 0.01}), "bandwidth");
  EXPECT_EQ(place({1000.0, 20.0, std::nan("")}), "max_depth");
}

DeviceProfile bare_profile() {
  DeviceProfile profile = find_profile("ideal").value();
  profile.name = "bare";
  return profile;
}

SimulatedDevice device_on(StrokePath path, const DeviceProfile& profile, const SimulatedDeviceSettings& settings = {}) {
  return SimulatedDevice::build(std::move(path), profile, HandImpedance{}, settings).value();
}

TEST(SimulatedDevice, FreeMotionTracksTheStroke) {
  SimulatedDevice device = device_on(build_stroke(line_settings(), on_plane).value(), bare_profile());
  double worst = 0.0;
  while (!device.finished()) {
    device.apply(Vec3::Zero(), Seconds(1e-3));
    worst = std::max(worst, (device.position() - device.aim()).norm());
  }
  // Velocity steps of 20 to 28 mm/s on a 52 rad/s mass: transients stay below v / omega.
  EXPECT_LT(worst, 0.028 / std::sqrt(400.0 / 0.15));
}

TEST(SimulatedDevice, GoesItsStrokeBackAndForth) {
  for (const PressMode press : {PressMode::depth, PressMode::force}) {
    StrokeSettings s = line_settings();
    s.press = press;
    const StrokePath path = build_stroke(s, on_plane).value();
    const double duration = path.duration().count();
    const auto dt = Seconds(1e-3);
    SimulatedDevice device = device_on(path, bare_profile(), {.back_and_forth = true});
    SimulatedDevice once = device_on(path, bare_profile());
    double fastest = 0.0;
    double worst = 0.0;
    int contacts = 0;
    bool pressed = false;
    Vec3 before = device.position();
    for (double time = 0.0; time < 6.0 * duration; time += dt.count()) {
      // The plane pushes back; a hand that presses would go through it else.
      const Vec3& p = device.position();
      const Vec3 push(0.0, std::max(0.0, -1000.0 * p.y()), 0.0);
      contacts += !pressed && push.y() > 0.0 ? 1 : 0;
      pressed = push.y() > 0.0 || (pressed && p.y() < 1e-3);
      if (time < duration - 2.0 * dt.count()) {
        once.apply(push, dt);
        device.apply(push, dt);
        ASSERT_EQ(device.position(), once.position()) << "the first way is the stroke's own";
      } else {
        device.apply(push, dt);
      }
      ASSERT_FALSE(device.finished());
      fastest = std::max(fastest, (device.position() - before).norm() / dt.count());
      before = device.position();
      const double within = std::fmod(time + dt.count(), 2.0 * duration);
      const double there = std::min(within, 2.0 * duration - within);
      if (press == PressMode::depth) worst = std::max(worst, (device.aim() - path.pose(Seconds(there)).target).norm());
    }
    EXPECT_LT(fastest, 0.2) << "no leap at either end";
    EXPECT_LT(worst, 1e-4);
    EXPECT_EQ(contacts, 6) << "each way it comes down and is lifted off again";
  }
}

TEST(SimulatedDevice, HeldForceDeflectsTheHandByItsStiffness) {
  StrokeSettings s = line_settings(0.2);
  SimulatedDevice device = device_on(build_stroke(s, on_plane).value(), bare_profile());
  for (int k = 0; k < 3000; ++k) device.apply(Vec3(0.0, 0.8, 0.0), Seconds(1e-3));
  const Vec3 offset = device.position() - device.aim();
  EXPECT_NEAR(offset.y(), 0.8 / 400.0, 1e-6);
  EXPECT_NEAR(offset.x(), 0.0, 1e-6);
}

TEST(SimulatedDevice, OscillationMatchesTheClosedForm) {
  // At rest 2 mm above an immobile aim; then x(t) of a damped oscillator.
  StrokeSettings s;
  s.type = StrokeType::recorded;
  s.recorded = {
      {Seconds(0.0), Vec3(0, 0.01, 0)}, {Seconds(1e-6), Vec3(0, 0.008, 0)}, {Seconds(1.0), Vec3(0, 0.008, 0)}};
  SimulatedDeviceSettings fine;
  fine.max_substep = 2e-6;
  HandImpedance hand;
  hand.damping = 2.0;
  SimulatedDevice device =
      SimulatedDevice::build(build_stroke(s, on_plane).value(), bare_profile(), hand, fine).value();
  const double decay = hand.damping / (2.0 * hand.mass);
  const double omega = std::sqrt(hand.stiffness / hand.mass - decay * decay);
  for (int k = 1; k <= 200; ++k) {
    device.apply(Vec3::Zero(), Seconds(1e-3));
    const double t = k * 1e-3;
    const double x = 0.002 * std::exp(-decay * t) * (std::cos(omega * t) + decay / omega * std::sin(omega * t));
    ASSERT_NEAR(device.position().y() - 0.008, x, 3e-6) << t;
  }
}

TEST(SimulatedDevice, PressingHandReachesItsForceOnAWall) {
  SimulatedDevice device = device_on(pressing_line(1.5), find_profile("omega.3").value());
  double force = 0.0;
  while (device.read().time < device.path().contact_end() - Seconds(0.05)) {
    force = wall(device.read().pose.position, 1000.0).y();
    device.apply(Vec3(0, force, 0), Seconds(1e-3));
  }
  // Coulomb friction of the mechanism and one encoder step stand between push and force.
  EXPECT_NEAR(force, 1.5, 0.1 + 1000.0 * 10e-6);
  while (!device.finished()) device.apply(wall(device.read().pose.position, 1000.0), Seconds(1e-3));
  EXPECT_GT(device.position().y(), 0.002);
}

TEST(SimulatedDevice, ArmStopsAPressingHandWithinItsReach) {
  SimulatedDeviceSettings settings;
  settings.reach = 0.004;
  SimulatedDevice device = device_on(pressing_line(1.0, 0.08), bare_profile(), settings);
  double deepest = 0.0;
  while (!device.finished()) {
    device.apply(Vec3::Zero(), Seconds(1e-3));
    deepest = std::min(deepest, device.position().y());
  }
  // Static: reach + F / k, with room for overshoot.
  EXPECT_LT(deepest, -0.0064);
  EXPECT_GT(deepest, -0.0095);
}

TEST(SimulatedDevice, ForceIsSaturatedAtTheActuators) {
  DeviceProfile weak = bare_profile();
  weak.max_force = 0.4;
  SimulatedDevice device = device_on(build_stroke(line_settings(0.2), on_plane).value(), weak);
  for (int k = 0; k < 3000; ++k) device.apply(Vec3(0.0, 50.0, 0.0), Seconds(1e-3));
  EXPECT_NEAR((device.position() - device.aim()).y(), 0.4 / 400.0, 1e-6);
}

TEST(SimulatedDevice, LateralPullOfTheHandIsLimited) {
  // A force of 5 N against a hand that spends at most 4 N: it is carried away, and its spring is not the reason it
  // stops.
  HandImpedance hand;
  hand.lateral_limit = 4.0;
  SimulatedDevice device =
      SimulatedDevice::build(build_stroke(line_settings(0.2), on_plane).value(), bare_profile(), hand).value();
  for (int k = 0; k < 3000; ++k) device.apply(Vec3(0.0, 0.0, 5.0), Seconds(1e-3));
  EXPECT_NEAR(device.velocity().z(), (5.0 - 4.0) / hand.damping, 1e-2);
}

TEST(SimulatedDevice, CoulombFrictionHoldsAndReleases) {
  DeviceProfile rough = bare_profile();
  rough.friction = 0.5;
  StrokeSettings s;
  s.type = StrokeType::recorded;
  s.recorded = {{Seconds(0.0), Vec3(0, 0.01, 0)}, {Seconds(1.0), Vec3(0, 0.01, 0)}};
  SimulatedDevice device = device_on(build_stroke(s, on_plane).value(), rough);
  const Vec3 start = device.position();
  for (int k = 0; k < 100; ++k) device.apply(Vec3(0.3, 0.39, 0.0), Seconds(1e-3));
  EXPECT_EQ(device.position(), start) << "0.492 N is below friction";
  for (int k = 0; k < 400; ++k) device.apply(Vec3(0.9, 0.0, 0.0), Seconds(1e-3));
  EXPECT_GT(device.position().x(), start.x() + (0.9 - 0.5) / 400.0 - 1e-6);
  EXPECT_EQ(device.velocity(), Vec3(Vec3::Zero())) << "it stops for good, without creep";
}

/// Hand and device alone never gain energy: with a fixed aim and no force, spring plus kinetic energy only falls.
RC_GTEST_PROP(SimulatedDevice, EnergyOnlyFallsWhenNothingDrives, ()) {
  DeviceProfile profile = bare_profile();
  profile.mass = *rc::gen::element(0.0, 0.1, 2.0);
  profile.friction = *rc::gen::element(0.0, 0.2);
  profile.damping = *rc::gen::element(0.0, 1.0);
  StrokeSettings s;
  s.type = StrokeType::recorded;
  s.recorded = {
      {Seconds(0.0), Vec3(0, 0.01, 0)}, {Seconds(1e-6), Vec3(0.001, 0.012, 0)}, {Seconds(2.0), Vec3(0.001, 0.012, 0)}};
  SimulatedDeviceSettings settings;
  settings.max_substep = *rc::gen::element(1e-5, 1e-3, 1e-1);
  SimulatedDevice device = device_on(build_stroke(s, on_plane).value(), profile, settings);
  device.apply(Vec3::Zero(), Seconds(1e-5));
  double energy = infinity;
  for (int k = 0; k < 200; ++k) {
    device.apply(Vec3::Zero(), Seconds(5e-3));
    const double now = 0.5 * 400.0 * (device.position() - device.aim()).squaredNorm() +
                       0.5 * (0.15 + profile.mass) * device.velocity().squaredNorm();
    RC_ASSERT(now <= energy + 1e-15);
    energy = now;
  }
}

TEST(SimulatedDevice, PositionComesInEncoderSteps) {
  const DeviceProfile profile = find_profile("phantom-desktop").value();
  SimulatedDevice device = device_on(build_stroke(line_settings(), on_plane).value(), profile);
  int moved = 0;
  while (!device.finished()) {
    const Vec3 steps = device.read().pose.position / profile.position_resolution;
    for (int i = 0; i < 3; ++i) ASSERT_NEAR(steps[i], std::round(steps[i]), 1e-6);
    ASSERT_LE((device.read().pose.position - device.position()).cwiseAbs().maxCoeff(), 10.001e-6);
    moved += device.position() != device.read().pose.position ? 1 : 0;
    device.apply(Vec3::Zero(), Seconds(1e-3));
  }
  EXPECT_GT(moved, 100);
}

TEST(SimulatedDevice, ReportedVelocityIsEstimatedExceptOnAnAdmittanceDevice) {
  const StrokePath path = build_stroke(line_settings(), on_plane).value();
  SimulatedDevice estimated = device_on(path, find_profile("phantom-desktop").value());
  DeviceProfile admittance = find_profile("hapticmaster").value();
  SimulatedDevice known = device_on(path, admittance);
  for (int k = 0; k < 1500; ++k) {
    static_cast<void>(estimated.read());
    estimated.apply(Vec3::Zero(), Seconds(1e-3));
    known.apply(Vec3::Zero(), Seconds(1e-3));
  }
  const Vec3 reported = estimated.read().twist.linear;
  EXPECT_LE(std::abs(reported.x() - estimated.velocity().x()), estimated.velocity_error_bound().x() + 1e-3);
  EXPECT_NE(reported.x(), estimated.velocity().x());
  EXPECT_EQ(known.read().twist.linear, known.velocity());
  EXPECT_EQ(known.velocity_error_bound(), Vec3(Vec3::Zero()));
}

TEST(SimulatedDevice, TremorHasItsSizeAndSeed) {
  SimulatedDeviceSettings shaking;
  shaking.tremor = 50e-6;
  StrokeSettings s;
  s.type = StrokeType::recorded;
  s.recorded = {{Seconds(0.0), Vec3(0, 0.01, 0)}, {Seconds(20.0), Vec3(0, 0.01, 0)}};
  const StrokePath path = build_stroke(s, on_plane).value();
  SimulatedDevice a = device_on(path, bare_profile(), shaking);
  SimulatedDevice same = device_on(path, bare_profile(), shaking);
  shaking.seed = 2;
  SimulatedDevice other = device_on(path, bare_profile(), shaking);
  double squares = 0.0;
  const int ticks = 2000;
  for (int k = 0; k < ticks; ++k) {
    for (SimulatedDevice* device : {&a, &same, &other}) device->apply(Vec3::Zero(), Seconds(1e-2));
    squares += (a.aim() - Vec3(0, 0.01, 0)).squaredNorm();
    ASSERT_EQ(a.position(), same.position());
  }
  EXPECT_NEAR(std::sqrt(squares / (3.0 * ticks)), 50e-6, 10e-6);
  EXPECT_NE(a.position(), other.position());
}

TEST(SimulatedDevice, BrokenForceCountsAsNone) {
  const StrokePath path = build_stroke(line_settings(), on_plane).value();
  SimulatedDevice a = device_on(path, bare_profile());
  SimulatedDevice b = device_on(path, bare_profile());
  a.apply(Vec3(std::nan(""), 0, 0), Seconds(1e-3));
  b.apply(Vec3::Zero(), Seconds(1e-3));
  EXPECT_EQ(a.position(), b.position());
}

TEST(SimulatedDevice, RefusesSettingsOneByOne) {
  const StrokePath path = build_stroke(line_settings(), on_plane).value();
  DeviceProfile profile = bare_profile();
  profile.mass = -1.0;
  EXPECT_NE(SimulatedDevice::build(path, profile, {}).error().message().find("mass"), std::string::npos);
  HandImpedance hand;
  hand.stiffness = 0.0;
  EXPECT_NE(SimulatedDevice::build(path, bare_profile(), hand).error().message().find("stiffness"), std::string::npos);
  const auto place = [&](SimulatedDeviceSettings s) {
    return SimulatedDevice::build(path, bare_profile(), {}, s).error().place;
  };
  EXPECT_EQ(place({.force_bandwidth = 0.0}), "force_bandwidth");
  EXPECT_EQ(place({.reach = -1.0}), "reach");
  EXPECT_EQ(place({.tremor = -1.0}), "tremor");
  EXPECT_EQ(place({.max_substep = 0.0}), "max_substep");
}

TEST(ReplayDevice, GivesTheSamplesBackInOrder) {
  std::vector<ProbeSample> samples(3);
  for (std::size_t i = 0; i < 3; ++i) samples[i].pose.position.x() = static_cast<double>(i);
  ReplayDevice device = ReplayDevice::build(samples).value();
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_FALSE(device.finished());
    EXPECT_EQ(device.read().pose.position.x(), static_cast<double>(i));
    EXPECT_EQ(device.aim().x(), static_cast<double>(i));
    device.apply(Vec3(1, 2, 3), Seconds(1e-3));
  }
  EXPECT_TRUE(device.finished());
  EXPECT_EQ(device.read().pose.position.x(), 2.0);
  EXPECT_EQ(ReplayDevice::build({}).error().place, "samples");
}

}  // namespace
}  // namespace asperity::probe_test
