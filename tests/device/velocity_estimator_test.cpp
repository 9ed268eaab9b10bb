#include "asperity/device/velocity_estimator.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace asperity::velocity_estimator_test {
namespace {

double rounded(double x, double step) {
  return step * std::round(x / step);
}

/// Constant speed, any encoder: the error stays inside the stated bound, which shrinks to D / (max window).
RC_GTEST_PROP(VelocityEstimator, ErrorAtConstantSpeedIsInsideTheBound, ()) {
  const double resolution = *rc::gen::element(5e-6, 20e-6, 60e-6);
  const double period = *rc::gen::element(1e-3, 2.5e-4, 1e-4);
  const double speed = *rc::gen::map(rc::gen::inRange(-300000, 300000), [](int v) { return v * 1e-6; });
  const double offset = *rc::gen::map(rc::gen::inRange(0, 1000), [](int v) { return v * 1e-7; });
  VelocityEstimator estimator(resolution);
  for (int k = 0; k < 300; ++k) {
    const double t = k * period;
    estimator.update(Vec3(rounded(offset + speed * t, resolution), 0.0, 0.0), Seconds(t));
    if (k == 0) continue;
    RC_ASSERT(std::abs(estimator.velocity().x() - speed) <= estimator.error_bound().x() * (1.0 + 1e-6) + 1e-12);
  }
  RC_ASSERT(estimator.window()[0] == VelocityEstimator::capacity - 1);
  RC_ASSERT(estimator.error_bound().x() <= 1.0001 * resolution / (127.0 * period));
}

TEST(VelocityEstimator, BeatsRawDifferencesByItsWindow) {
  // Amendment 17: 0.02 mm at 1 kHz makes raw differences of 20 mm/s.
  const double step = 20e-6;
  const double speed = 5e-3;
  VelocityEstimator adaptive(step);
  VelocityEstimator raw(step, 1);
  double worst_adaptive = 0.0;
  double worst_raw = 0.0;
  for (int k = 0; k < 1000; ++k) {
    const Vec3 p(rounded(speed * k * 1e-3, step), 0.0, 0.0);
    const double a = adaptive.update(p, Seconds(k * 1e-3)).x();
    const double r = raw.update(p, Seconds(k * 1e-3)).x();
    if (k < 200) continue;
    worst_adaptive = std::max(worst_adaptive, std::abs(a - speed));
    worst_raw = std::max(worst_raw, std::abs(r - speed));
  }
  EXPECT_NEAR(worst_raw, 15e-3, 1e-6);
  EXPECT_LT(worst_adaptive, 0.2e-3);
}

TEST(VelocityEstimator, AccelerationKeepsTheStatedErrorAndWindow) {
  const double step = 20e-6;
  const double period = 1e-3;
  for (const double acceleration : {0.1, 1.0, 10.0}) {
    VelocityEstimator estimator(step);
    for (int k = 0; k < 500; ++k) {
      const double t = k * period;
      estimator.update(Vec3(rounded(0.5 * acceleration * t * t, step), 0.0, 0.0), Seconds(t));
      if (k == 0) continue;
      const double window = static_cast<double>(estimator.window()[0]) * period;
      EXPECT_LE(window, 4.0 * std::sqrt(step / acceleration) + period + 1e-12);
      EXPECT_LE(std::abs(estimator.velocity().x() - acceleration * t),
                step / window + 0.5 * acceleration * window + 1e-9);
    }
  }
}

TEST(VelocityEstimator, ReversalIsFollowed) {
  const double step = 20e-6;
  VelocityEstimator estimator(step);
  const auto position = [](double t) { return t < 0.5 ? 0.05 * t : 0.05 * (1.0 - t); };
  double after = 0.0;
  for (int k = 0; k <= 520; ++k) {
    const double t = k * 1e-3;
    after = estimator.update(Vec3(0.0, rounded(position(t), step), 0.0), Seconds(t)).y();
  }
  // 20 ms after the reversal the window holds nothing of the motion before it.
  EXPECT_NEAR(after, -0.05, 3e-3);
}

TEST(VelocityEstimator, ExactPositionsGiveTheSlopeOfTheLastPeriod) {
  VelocityEstimator estimator;
  for (int k = 0; k < 50; ++k) {
    const double t = k * 1e-3;
    const double before = (k - 1) * 1e-3;
    const double v = estimator.update(Vec3(std::sin(30.0 * t), 0.0, 0.0), Seconds(t)).x();
    if (k > 2) {
      EXPECT_NEAR(v, (std::sin(30.0 * t) - std::sin(30.0 * before)) / 1e-3, 1e-9);
    }
  }
}

TEST(VelocityEstimator, AxesDoNotDisturbEachOther) {
  const double step = 20e-6;
  VelocityEstimator estimator(step);
  for (int k = 0; k < 300; ++k) {
    const double t = k * 1e-3;
    estimator.update(Vec3(rounded(0.01 * t, step), rounded(0.02 * std::sin(60.0 * t), step), 0.0), Seconds(t));
  }
  EXPECT_EQ(estimator.window()[0], VelocityEstimator::capacity - 1);
  EXPECT_LT(estimator.window()[1], 40U);
  EXPECT_EQ(estimator.velocity().z(), 0.0);
}

TEST(VelocityEstimator, UnusableSamplesAreLeftOut) {
  VelocityEstimator estimator(1e-5);
  EXPECT_EQ(estimator.update(Vec3::Zero(), Seconds(0.0)), Vec3(Vec3::Zero()));
  estimator.update(Vec3(1e-3, 0, 0), Seconds(0.1));
  const Vec3 good = estimator.velocity();
  EXPECT_NEAR(good.x(), 1e-2, 1e-12);
  EXPECT_EQ(estimator.update(Vec3(1.0, 0, 0), Seconds(0.1)), good);
  EXPECT_EQ(estimator.update(Vec3(1.0, 0, 0), Seconds(0.05)), good);
  EXPECT_EQ(estimator.update(Vec3(std::nan(""), 0, 0), Seconds(0.2)), good);
  EXPECT_EQ(estimator.update(Vec3(1.0, 0, 0), Seconds(std::nan(""))), good);
  estimator.reset();
  EXPECT_EQ(estimator.velocity(), Vec3(Vec3::Zero()));
  EXPECT_EQ(estimator.error_bound().x(), infinity);
}

}  // namespace
}  // namespace asperity::velocity_estimator_test
