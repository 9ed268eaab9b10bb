// The slider on its spring against what can be solved by hand, and stick-slip told from traces.

#include "asperity/study/friction_rig.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

namespace asperity::friction_rig_test {
namespace {

namespace fs = std::filesystem;
using std::numbers::pi;

FrictionCoefficients coefficients(double still, double sliding) {
  FrictionCoefficients c;
  c.still = still;
  c.sliding = sliding;
  return c;
}

FrictionLaw law_of(FrictionKind kind, double stiffness) {
  FrictionLaw law;
  law.kind = kind;
  law.stiffness = stiffness;
  return law;
}

/// A slider that is pulled so slowly that slips are short against sticking.
RigSettings slow_rig() {
  RigSettings rig;
  rig.mass = 0.02;
  rig.load = 0.2;
  rig.stiffness = 168.0;
  rig.speed = 200e-6;
  rig.start = 0.3;
  rig.warm_up = Seconds(1.5);
  rig.duration = Seconds(5.0);
  return rig;
}

/// Stick-slip of Coulomb friction whose slips begin `drop` (N) above the dynamic friction: x - V t swings about it
/// until the slider has the surface's speed again.
void expect_stick_slip(const StickSlip& found, const RigSettings& rig, double sliding, double drop) {
  const double frequency = std::sqrt(rig.stiffness / rig.mass);
  const double swing = rig.speed * std::sqrt(rig.stiffness * rig.mass);
  const double slip = 2.0 * (pi - std::atan(drop / swing)) / frequency;
  const double period = 2.0 * drop / (rig.stiffness * rig.speed) + slip;
  EXPECT_GE(found.events, 5U);
  EXPECT_NEAR(found.period, period, 0.03 * period);
  const double amplitude = 2.0 * std::hypot(drop, swing) / rig.load;
  EXPECT_NEAR(found.amplitude, amplitude, 0.05 * amplitude);
  EXPECT_NEAR(found.still, sliding + drop / rig.load, 0.01);
  EXPECT_NEAR(found.sliding, sliding, 0.02 * sliding);
}

TEST(FrictionRig, StickSlipHasThePeriodAndAmplitudeOfTheExactSolution) {
  const RigSettings rig = slow_rig();
  FrictionLaw law = law_of(FrictionKind::implicit_coulomb, 2e5);
  law.damping = 20.0;
  const Result<FrictionTrace> trace = pull_slider(law, coefficients(0.36, 0.32), rig);
  ASSERT_TRUE(trace.ok()) << trace.error().message();
  expect_stick_slip(measure_stick_slip(*trace, {.threshold = 0.02}), rig, 0.32, 0.04 * rig.load);
}

TEST(FrictionRig, AContactThatRingsBreaksHalfWay) {
  // A slip ends with the contact's spring stretched to the dynamic friction, and the pull as far below it as it had
  // been above. Without damping that difference rings on, and adds to the pull until both reach the static friction.
  const RigSettings rig = slow_rig();
  for (const FrictionKind kind : {FrictionKind::karnopp, FrictionKind::implicit_coulomb}) {
    const Result<FrictionTrace> trace = pull_slider(law_of(kind, 2e5), coefficients(0.36, 0.32), rig);
    ASSERT_TRUE(trace.ok()) << trace.error().message();
    expect_stick_slip(measure_stick_slip(*trace, {.threshold = 0.02}), rig, 0.32, 0.02 * rig.load);
  }
}

TEST(FrictionRig, SwingsFreelyWithoutFriction) {
  RigSettings rig;
  rig.stiffness = 1002.0;
  rig.speed = 4.3e-3;
  const Result<FrictionTrace> trace = pull_slider(law_of(FrictionKind::coulomb, 0.0), coefficients(0.0, 0.0), rig);
  ASSERT_TRUE(trace.ok()) << trace.error().message();
  const StickSlip found = measure_stick_slip(*trace, {.filter = Seconds(0.0), .threshold = 0.05});
  EXPECT_NEAR(found.period, 2.0 * pi * std::sqrt(rig.mass / rig.stiffness), 1e-3 * found.period);
  const double amplitude = 2.0 * rig.speed * std::sqrt(rig.stiffness * rig.mass) / rig.load;
  EXPECT_NEAR(found.amplitude, amplitude, 0.01 * amplitude);
  EXPECT_LT(found.amplitude_spread, 0.01 * amplitude) << "swings grow or decay";
}

TEST(FrictionRig, ViscousSlidingSettlesAtViscosityTimesSpeed) {
  FrictionLaw law;
  law.kind = FrictionKind::viscous;
  law.viscosity = 4.0;
  RigSettings rig = slow_rig();
  rig.warm_up = Seconds(2.0);
  const Result<FrictionTrace> trace = pull_slider(law, coefficients(0.0, 0.0), rig);
  ASSERT_TRUE(trace.ok()) << trace.error().message();
  const StickSlip found = measure_stick_slip(*trace, {.threshold = 1e-4});
  EXPECT_TRUE(found.steady());
  EXPECT_NEAR(found.level, law.viscosity * rig.speed / rig.load, 1e-6);
}

RC_GTEST_PROP(FrictionRig, SlidesAtTheDynamicCoefficientOnAverage, ()) {
  const double sliding = 0.01 * *rc::gen::inRange(10, 60);
  RigSettings rig = slow_rig();
  rig.start = sliding;
  rig.duration = Seconds(1.0);
  const Result<FrictionTrace> trace =
      pull_slider(law_of(FrictionKind::implicit_coulomb, 2e4), coefficients(sliding, sliding), rig);
  RC_ASSERT(trace.ok());
  RC_ASSERT(std::abs(measure_stick_slip(*trace, {.threshold = 1.0}).level - sliding) < 0.02 * sliding);
}

TEST(FrictionRig, RepeatsBitByBit) {
  for (const std::string& name : friction_names()) {
    FrictionLaw law;
    law.kind = friction_by_name(name).value();
    RigSettings rig = slow_rig();
    rig.duration = Seconds(0.5);
    const Result<FrictionTrace> first = pull_slider(law, coefficients(0.4, 0.3), rig);
    const Result<FrictionTrace> second = pull_slider(law, coefficients(0.4, 0.3), rig);
    ASSERT_TRUE(first.ok() && second.ok()) << name;
    EXPECT_EQ(first->friction, second->friction) << name;
    EXPECT_EQ(first->friction.size(), 1000U) << name;
  }
}

TEST(FrictionRig, RefusesWhatCannotBeIntegrated) {
  const auto refused = [](const RigSettings& rig, const char* part) {
    const Result<FrictionTrace> trace = pull_slider({}, coefficients(0.4, 0.3), rig);
    ASSERT_FALSE(trace.ok()) << part;
    EXPECT_NE(trace.error().message().find(part), std::string::npos) << trace.error().message();
  };
  RigSettings rig;
  rig.mass = 0.0;
  refused(rig, "mass");
  rig = {};
  rig.load = std::nan("");
  refused(rig, "load");
  rig = {};
  rig.dt = Seconds(-1e-4);
  refused(rig, "dt");
  rig = {};
  rig.duration = Seconds(1e9);
  refused(rig, "dt");
  rig = {};
  rig.start = infinity;
  refused(rig, "start");
}

/// Rises by `drop` in 0.9 of `period`, falls in 0.1 of it.
FrictionTrace sawtooth(double period, double drop, std::size_t samples) {
  FrictionTrace trace;
  trace.stiffness = 168.0;
  trace.speed = 42e-6;
  trace.spacing = 5e-4;
  for (std::size_t i = 0; i < samples; ++i) {
    const double phase = std::fmod(static_cast<double>(i) * trace.spacing / period, 1.0);
    trace.friction.push_back(0.3 + drop * (phase < 0.9 ? phase / 0.9 : (1.0 - phase) / 0.1));
  }
  return trace;
}

RC_GTEST_PROP(StickSlip, IsWhatASawtoothIsMadeOf, ()) {
  const double period = 1e-3 * *rc::gen::inRange(100, 900);
  const double drop = 1e-3 * *rc::gen::inRange(10, 100);
  const StickSlip found = measure_stick_slip(sawtooth(period, drop, 12000), {});
  RC_ASSERT(std::abs(found.period - period) < 0.01 * period);
  RC_ASSERT(std::abs(found.amplitude - drop) < 0.08 * drop);
  RC_ASSERT(std::abs(found.ratio() - (0.3 + drop) / (0.3 + 0.5 * drop)) < 0.01);
}

TEST(StickSlip, IsNotMadeOfImpulses) {
  FrictionTrace trace = sawtooth(0.3, 0.05, 12000);
  const StickSlip clean = measure_stick_slip(trace, {});
  for (std::size_t i = 7; i < trace.friction.size(); i += 23) trace.friction[i] += i % 2 == 0 ? 0.3 : -0.3;
  const StickSlip noisy = measure_stick_slip(trace, {});
  EXPECT_EQ(noisy.events, clean.events);
  EXPECT_NEAR(noisy.period, clean.period, 0.01 * clean.period);
  EXPECT_NEAR(noisy.amplitude, clean.amplitude, 0.05 * clean.amplitude);
}

TEST(StickSlip, OfASteadySlideIsNone) {
  FrictionTrace trace = sawtooth(0.3, 0.05, 4000);
  const StickSlip found = measure_stick_slip(trace, {.threshold = 0.06});
  EXPECT_TRUE(found.steady());
  EXPECT_EQ(found.amplitude, 0.0);
  EXPECT_EQ(found.ratio(), 1.0);
  for (double& value : trace.friction) value = 0.3;
  EXPECT_TRUE(measure_stick_slip(trace, {}).steady());
}

TEST(StickSlip, TellsTheLoadWhileItSticks) {
  // 0.9 of the period at the slope k V / load.
  FrictionTrace trace = sawtooth(0.5, 0.05, 12000);
  EXPECT_NEAR(load_of_sticking(trace, {}), 168.0 * 42e-6 / (0.05 / 0.45), 0.003);
}

RC_GTEST_PROP(StickSlip, RunningMedianIsTheMedian, (std::vector<double> values, std::uint8_t half)) {
  for (double& value : values) value = std::isfinite(value) ? value : 0.0;
  const std::size_t h = half % 9;
  const std::vector<double> found = running_median(values, 2 * h + 1);
  RC_ASSERT(found.size() == values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t begin = i > h ? i - h : 0;
    std::vector<double> window(values.begin() + static_cast<std::ptrdiff_t>(begin),
                               values.begin() + static_cast<std::ptrdiff_t>(std::min(values.size(), i + h + 1)));
    std::sort(window.begin(), window.end());
    RC_ASSERT(found[i] == window[window.size() / 2]);
  }
}

class FrictionFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("asperity-friction-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  [[nodiscard]] static std::string rows(std::size_t count) {
    std::string text = "t_s,friction_over_load\n";
    for (std::size_t i = 0; i < count; ++i) text += std::to_string(0.001 * static_cast<double>(i)) + ",0.3\n";
    return text;
  }
  void refused(const std::string& name, const std::string& text, const char* part) const {
    const Result<FrictionTrace> trace = read_friction_trace(write(name, text), {});
    ASSERT_FALSE(trace.ok()) << name << part;
    EXPECT_NE(trace.error().message().find(part), std::string::npos) << trace.error().message();
  }

  fs::path folder_;
};

TEST_F(FrictionFiles, SayStiffnessAndSpeedInTheirNames) {
  const Result<FrictionTrace> trace = read_friction_trace(write("stickslip_k168Nm_v42.csv", rows(300)), {});
  ASSERT_TRUE(trace.ok()) << trace.error().message();
  EXPECT_EQ(trace->name, "stickslip_k168Nm_v42");
  EXPECT_EQ(trace->stiffness, 168.0);
  EXPECT_DOUBLE_EQ(trace->speed, 42e-6);
  EXPECT_NEAR(trace->spacing, 1e-3, 1e-9);
  EXPECT_EQ(trace->friction.size(), 300U);
  const Result<FrictionTrace> told = read_friction_trace(write("a.csv", rows(300)), {.stiffness = 5.0, .speed = 1e-3});
  ASSERT_TRUE(told.ok()) << told.error().message();
  EXPECT_EQ(told->stiffness, 5.0);
  EXPECT_EQ(told->speed, 1e-3);
}

TEST_F(FrictionFiles, AreInterpolatedWhereTheirSamplesAreUneven) {
  std::string text = "load,friction_over_load,t_s\r\n";
  for (int i = 0; i < 400; ++i) {
    const double time = 1e-3 * i + (i % 3 == 0 ? 2e-4 : 0.0);
    text += "1," + std::to_string(2.0 * time) + "," + std::to_string(time) + "\r\n";
  }
  const Result<FrictionTrace> trace = read_friction_trace(write("k1Nm_v1.csv", text), {});
  ASSERT_TRUE(trace.ok()) << trace.error().message();
  for (std::size_t i = 1; i < trace->friction.size(); ++i)
    EXPECT_NEAR(trace->friction[i] - trace->friction[i - 1], 2.0 * trace->spacing, 1e-5);
}

TEST_F(FrictionFiles, AreRefusedOneByOne) {
  const std::string name = "k168Nm_v42.csv";
  refused(name, "", "is empty");
  refused(name, "t_s,force\n0,1\n", "friction_over_load");
  refused(name, "\x89PNG\r\n\x1a\n", "t_s");
  refused(name, rows(300) + "0.5,nan\n", "line 302: friction_over_load is not finite");
  refused(name, rows(300) + "0.5,abc\n", "is no number");
  refused(name, rows(300) + "0.5\n", "has no friction_over_load");
  refused(name, rows(300) + "0.1,0.3\n", "line 302: t_s does not increase");
  refused(name, rows(20), "20 samples");
  refused(name, rows(300) + "1e9,0.3\n", "gaps");
  refused("v42.csv", rows(300), "stiffness");
  refused("k168Nm.csv", rows(300), "--speed");
  const Result<FrictionTrace> missing = read_friction_trace(folder_ / "k1Nm_v1.none", {});
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::file_missing);
  EXPECT_EQ(read_friction_trace(folder_, {}).error().code, ErrorCode::file_missing);
}

TEST(MeasuredFriction, IsStickSlipWhereItIsSlowAndSoftAndSwingsWhereItIsFast) {
  const fs::path folder = fs::path(ASPERITY_SHARED_DATA) / "friction";
  if (!fs::exists(folder)) GTEST_SKIP() << "no measured friction in " << folder;
  const auto measured = [&](const char* name) {
    const Result<FrictionTrace> trace = read_friction_trace(folder / name, {});
    EXPECT_TRUE(trace.ok()) << name;
    return trace ? measure_stick_slip(*trace, {}) : StickSlip{};
  };
  const StickSlip slow = measured("stickslip_k168Nm_v42.csv");
  EXPECT_GE(slow.events, 10U);
  EXPECT_NEAR(slow.period, 2.0, 0.5);
  // Swings: nearly the same from one to the next, unlike stick-slip on paper.
  const StickSlip fast = measured("stickslip_k1002Nm_v4300.csv");
  EXPECT_NEAR(fast.period, 0.0286, 0.001);
  EXPECT_LT(fast.period_spread, 0.1 * fast.period);
  EXPECT_GT(slow.period_spread, 0.2 * slow.period);
}

}  // namespace
}  // namespace asperity::friction_rig_test
