#include "asperity/study/metrics.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/study/synthetic.h"

namespace asperity::metrics_test {
namespace {

using namespace synthetic;

constexpr double pi = std::numbers::pi;

TEST(ForceMetrics, KnownWaveHasItsMeanRmsAndPeak) {
  const StrokePath path = line_path();
  const auto records =
      records_along(path, [](const Vec3&, double t) { return Vec3(0.0, 0.0, 2.0 + std::sin(2.0 * pi * 50.0 * t)); });
  const RunMetrics m = measure_run(records, bare_scene(), path);
  EXPECT_NEAR(m.force.mean, 2.0, 1e-3);
  EXPECT_NEAR(m.force.mean_normal, 2.0, 1e-3);
  EXPECT_NEAR(m.force.max, 3.0, 1e-6);
  EXPECT_NEAR(m.force.rms, std::sqrt(4.5), 1e-3);
  EXPECT_NEAR(m.spectrum.normal_time.peak_frequency, 50.0, 0.1);
  // At 20 mm/s, 50 waves a second are 2.5 a millimetre.
  EXPECT_NEAR(m.spectrum.normal_distance.peak_frequency, 2500.0, 10.0);
  EXPECT_NEAR(m.ticks.length, 0.04, 2.1e-5);
  EXPECT_EQ(m.ticks.ticks, records.size());
}

TEST(ForceMetrics, LargestJumpIsFoundWhereItIs) {
  const StrokePath path = line_path();
  const double when = path.contact_begin().count() + 1.0;
  const auto records = records_along(
      path, [&](const Vec3&, double t) { return Vec3(t > when ? 0.3 * std::exp(-8.0 * (t - when)) : 0.0, 0.0, 0.05); });
  const RunMetrics m = measure_run(records, bare_scene(), path);
  EXPECT_NEAR(m.force.largest_jump, 0.3, 0.01);
  EXPECT_NEAR(m.force.jump_distance, 0.02, 4.1e-5);
}

TEST(EnergyMetrics, ConstantForceDoesNoWorkOnAClosedLoop) {
  const StrokePath path = circle_path(2);
  const auto records = records_along(path, [](const Vec3&, double) { return Vec3(0.7, -0.4, 1.1); });
  const RunMetrics m = measure_run(records, bare_scene(), path);
  ASSERT_EQ(m.energy.loops.size(), 2u);
  // Loops end between ticks: a straight line misses the circle by (20 um)^2 / (8 * 10 mm) = 5 nm at either end.
  for (const double loop : m.energy.loops) EXPECT_NEAR(loop, 0.0, 2.0 * 5e-9 * 1.4);
}

TEST(EnergyMetrics, CurlFieldFeedsItsCirculationALoop) {
  // F = c (-y, x, 0) has curl 2 c: by Stokes a loop around the area A feeds 2 c A, or takes it when c is negative.
  const StrokePath path = circle_path(2);
  for (const double c : {30.0, -30.0}) {
    const auto records = records_along(path, [&](const Vec3& p, double) { return Vec3(-c * p.y(), c * p.x(), 0.0); });
    const RunMetrics m = measure_run(records, bare_scene(), path);
    const double expected = 2.0 * c * pi * 0.01 * 0.01;
    // The stroke's direction of turning decides the sign; the size is the field's.
    ASSERT_EQ(m.energy.loops.size(), 2u);
    EXPECT_NEAR(std::abs(m.energy.mean_loop), std::abs(expected), 2e-3 * std::abs(expected));
    const double turning = (path.points()[0].cross(path.points()[1])).z() > 0.0 ? 1.0 : -1.0;
    EXPECT_GT(m.energy.mean_loop * c * turning, 0.0);
    EXPECT_EQ(m.energy.generated > 1e-4, c * turning > 0.0);
  }
}

TEST(EnergyMetrics, SpringGivesBackWhatItTook) {
  const StrokePath path = line_path();
  const Scene scene = bare_scene();
  const RunMetrics m = measure_run(rendered_along(path, scene), scene, path);
  // 1 kN/m pressed 1 mm: half a millijoule, to one part in the ticks of the approach.
  EXPECT_NEAR(m.energy.absorbed, 0.5e-3, 1e-5);
  EXPECT_NEAR(m.energy.work, 0.0, 1e-8);
  EXPECT_LT(m.energy.generated, 1e-6);
  EXPECT_TRUE(m.energy.loops.empty());
  EXPECT_TRUE(std::isnan(m.energy.mean_loop));
}

TEST(DirectionMetrics, TiltedForceIsOffByItsTilt) {
  const StrokePath path = line_path();
  const double tilt = 0.2;
  const auto records =
      records_along(path, [&](const Vec3&, double) { return Vec3(std::sin(tilt), 0.0, std::cos(tilt)); });
  const RunMetrics m = measure_run(records, bare_scene(), path);
  EXPECT_NEAR(m.direction.mean, tilt, 1e-12);
  EXPECT_NEAR(m.direction.max, tilt, 1e-12);
  EXPECT_GT(m.direction.samples, 1900u);
}

TEST(HeightMetrics, H_II_ConsistentHeightFieldFollowsGentleReliefAndGodObjectDoesNot) {
  const MesostructureSpec spec{MesostructureKind::rings, 256, 1e-3, 8, 1};
  const StrokePath path = line_path();
  const Scene relief = relief_scene(spec, HeightFieldLaw{}, Reconstruction::quadratic_bspline);
  const RunMetrics followed = measure_run(rendered_along(path, relief), relief, path);
  ASSERT_GT(followed.height.samples, 1000u);
  EXPECT_GT(followed.height.amplitude, 0.2e-3);
  EXPECT_LT(followed.height.relative_error, 0.01);
  EXPECT_LT(followed.direction.max, 1e-6);

  const Scene base = relief_scene(spec, GodObjectLaw{}, Reconstruction::quadratic_bspline);
  const RunMetrics flat = measure_run(rendered_along(path, base), base, path);
  EXPECT_LT(flat.height.excursion, 0.05 * flat.height.amplitude);
  EXPECT_GT(flat.height.relative_error, 0.2);
}

TEST(HeightMetrics, H_II_SamplesWithinOneTexelOfAStepAreLeftOutAndNoOthers) {
  // Eight ridges over 60 mm, 128 texels: one vertical wall each 7.5 mm, a texel is 0.47 mm.
  const MesostructureSpec spec{MesostructureKind::serrated, 128, 1e-3, 8, 1};
  const StrokePath path = line_path();
  const Scene scene = relief_scene(spec, HeightFieldLaw{});
  const auto records = rendered_along(path, scene);
  const RunSeries series = derive_series(records, scene, path);
  const double texel = 0.06 / 128;
  std::size_t marked = 0;
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (!series.near_step[i]) continue;
    ++marked;
    // Walls stand at multiples of 7.5 mm from the left edge at -30 mm, one texel wide.
    const double from_wall = std::abs(std::remainder(records[i].probe.pose.position.x() + 0.03, 0.0075));
    EXPECT_LE(from_wall, 2.6 * texel);
  }
  // Five walls, each with its own texel and one on either side, 23.4 ticks a texel; where contact was kept.
  EXPECT_GT(marked, 100u);
  EXPECT_LT(marked, 5u * 120u);
  const RunMetrics m = measure_run(records, series, path);
  EXPECT_EQ(m.height.excluded, marked);
}

TEST(HeightMetrics, RangeOfAPressedSheetIsZero) {
  const StrokePath path = line_path();
  const Scene scene = bare_scene();
  const RunMetrics m = measure_run(rendered_along(path, scene), scene, path);
  EXPECT_LT(m.height.rms_error, 1e-6);  // the proxy rests one skin above the sheet
  EXPECT_EQ(m.height.amplitude, 0.0);
  EXPECT_TRUE(std::isnan(m.height.relative_error));
}

TEST(TickMetrics, FlagsAndInterventionsAreCounted) {
  const StrokePath path = line_path();
  auto records = records_along(path, [](const Vec3&, double) { return Vec3(0.0, 0.0, 2.0); });
  for (std::size_t i = 600; i < 605; ++i) {
    records[i].rendered.flags.set(TickFlag::force_limited);
    records[i].commanded *= 0.5;
  }
  const RunMetrics m = measure_run(records, bare_scene(), path);
  EXPECT_EQ(m.ticks.flags[4], 5u);
  EXPECT_STREQ(flag_name(4), "force_limited");
  EXPECT_EQ(m.ticks.safety_interventions, 5u);
  EXPECT_NEAR(m.ticks.largest_intervention, 1.0, 1e-12);
  EXPECT_EQ(m.ticks.contact, m.ticks.flags[0]);
}

TEST(UpdateMetrics, PercentilesAndHistogramOfKnownTimes) {
  const StrokePath path = line_path();
  auto records = records_along(path, [](const Vec3&, double) { return Vec3(0.0, 0.0, 1.0); });
  for (std::size_t i = 0; i < records.size(); ++i) records[i].update_seconds = 1e-6 * static_cast<double>(i + 1);
  const RunMetrics m = measure_run(records, bare_scene(), path);
  const auto n = static_cast<double>(records.size());
  EXPECT_NEAR(m.update.p50, 1e-6 * std::ceil(0.5 * n), 1e-12);
  EXPECT_NEAR(m.update.p999, 1e-6 * std::ceil(0.999 * n), 1e-12);
  EXPECT_NEAR(m.update.max, 1e-6 * n, 1e-12);
  std::uint64_t total = 0;
  for (const std::uint64_t count : m.update.counts) total += count;
  EXPECT_EQ(total, records.size());
  ASSERT_EQ(m.update.edges.size(), m.update.counts.size() + 1);
  EXPECT_LE(m.update.edges.front(), 1e-6 * (1.0 + 1e-9));
  EXPECT_GE(m.update.edges.back(), m.update.max);
}

TEST(RunMetrics, EmptyAndUntouchedRunsHaveNumbersToo) {
  const StrokePath path = line_path();
  const RunMetrics none = measure_run({}, bare_scene(), path);
  EXPECT_EQ(none.ticks.ticks, 0u);
  auto records = records_along(path, [](const Vec3&, double) { return Vec3(Vec3::Zero()); });
  for (TraceRecord& record : records) record.rendered.flags = Flags{};
  const RunMetrics untouched = measure_run(records, bare_scene(), path);
  EXPECT_EQ(untouched.ticks.contact, 0u);
  EXPECT_EQ(untouched.force.mean, 0.0);
  EXPECT_EQ(untouched.height.samples, 0u);
  const auto json = nlohmann::json::parse(metrics_json(untouched));
  EXPECT_TRUE(json["height"]["rms_error"].is_null());
  EXPECT_EQ(json["ticks"]["count"], records.size());
}

TEST(RunMetrics, ForceThatIsNoNumberDoesNotSpreadIntoTheEnergy) {
  const StrokePath path = line_path();
  auto records = records_along(path, [](const Vec3&, double) { return Vec3(0.0, 0.0, 1.0); });
  records[700].commanded.x() = std::nan("");
  const RunMetrics m = measure_run(records, bare_scene(), path);
  EXPECT_TRUE(std::isfinite(m.energy.work));
  EXPECT_TRUE(std::isfinite(m.energy.held_work));
}

RC_GTEST_PROP(Percentile, IsAValueThatTheShareDoesNotExceed, ()) {
  const auto ints = *rc::gen::nonEmpty<std::vector<int>>();
  const double p = *rc::gen::inRange(1, 101) / 100.0;
  const std::vector<double> values(ints.begin(), ints.end());
  const double answer = percentile(values, p);
  const auto below =
      static_cast<double>(std::count_if(values.begin(), values.end(), [&](double v) { return v <= answer; }));
  const auto under =
      static_cast<double>(std::count_if(values.begin(), values.end(), [&](double v) { return v < answer; }));
  RC_ASSERT(std::find(values.begin(), values.end(), answer) != values.end());
  RC_ASSERT(below >= p * static_cast<double>(values.size()) - 1e-9);
  RC_ASSERT(under < p * static_cast<double>(values.size()));
}

}  // namespace
}  // namespace asperity::metrics_test
