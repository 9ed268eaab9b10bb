#include "asperity/servo/session.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <limits>
#include <new>
#include <vector>

#include "asperity/device/ideal_probe.h"
#include "asperity/device/replay_device.h"
#include "asperity/device/simulated_device.h"

namespace {
std::atomic<bool> counting{false};
std::atomic<int> allocations{0};
}  // namespace

// Counts what the loop allocates; everything else is the default behaviour. Inlined, GCC 12 takes the pair for a
// mismatch.
[[gnu::noinline]] void* operator new(std::size_t size) {
  if (counting.load(std::memory_order_relaxed)) allocations.fetch_add(1, std::memory_order_relaxed);
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace asperity::session_test {
namespace {

SurfacePoint on_plane(const Vec3& p) {
  return {Vec3(p.x(), 0.0, p.z()), Vec3::UnitY()};
}

StrokePath line(PressMode press) {
  StrokeSettings settings;
  settings.start = Vec3(-0.01, 0, 0);
  settings.end = Vec3(0.01, 0, 0);
  settings.press = press;
  return build_stroke(settings, on_plane).value();
}

/// A frictionless wall at y = 0, 1 N/mm.
ForceSample wall(const ProbeSample& probe, Seconds) {
  ForceSample sample;
  sample.proxy = probe.pose.position;
  const double depth = -probe.pose.position.y();
  if (depth <= 0.0) return sample;
  sample.proxy.y() = 0.0;
  sample.wrench.force.y() = 1000.0 * depth;
  sample.flags.set(TickFlag::contact);
  return sample;
}

SafetyStage wide_stage() {
  return SafetyStage::build({100.0, 1e9}).value();
}

std::vector<TraceRecord> run_simulated(Seconds dt) {
  SimulatedDevice device =
      SimulatedDevice::build(line(PressMode::force), find_profile("omega.3").value(), HandImpedance{}).value();
  SafetyStage safety = wide_stage();
  std::vector<TraceRecord> records;
  run_session(wall, device, safety, dt, [&](const TraceRecord& r) { records.push_back(r); });
  return records;
}

TEST(Session, RecordsEveryTickWithInputOutputAndHand) {
  const StrokePath path = line(PressMode::depth);
  IdealProbe probe = IdealProbe::build(path).value();
  SafetyStage safety = wide_stage();
  std::vector<TraceRecord> records;
  const SessionSummary summary =
      run_session(wall, probe, safety, Seconds(1e-3), [&](const TraceRecord& r) { records.push_back(r); });
  ASSERT_EQ(summary.ticks, records.size());
  EXPECT_NEAR(static_cast<double>(summary.ticks), static_cast<double>(session_ticks(path.duration(), Seconds(1e-3))),
              1.0);
  EXPECT_FALSE(summary.stopped);
  EXPECT_NEAR(summary.max_force, 1.0, 1e-9);
  EXPECT_TRUE(summary.flags.has(TickFlag::contact));
  for (std::size_t i = 0; i < records.size(); ++i) {
    ASSERT_EQ(records[i].tick, i);
    ASSERT_NEAR(records[i].probe.time.count(), static_cast<double>(i) * 1e-3, 1e-9);
    ASSERT_EQ(records[i].hand, records[i].probe.pose.position);
    ASSERT_EQ(records[i].commanded, records[i].rendered.wrench.force);
    ASSERT_GE(records[i].update_seconds, 0.0);
  }
}

TEST(Session, SameRunTwiceIsBitEqual) {
  const std::vector<TraceRecord> a = run_simulated(Seconds(1e-3));
  const std::vector<TraceRecord> b = run_simulated(Seconds(1e-3));
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].commanded, b[i].commanded) << i;
    ASSERT_EQ(a[i].probe.pose.position, b[i].probe.pose.position) << i;
    ASSERT_EQ(a[i].probe.twist.linear, b[i].probe.twist.linear) << i;
  }
}

TEST(Session, ReplayOfTheProbeGivesTheSameForces) {
  const std::vector<TraceRecord> first = run_simulated(Seconds(1e-3));
  std::vector<ProbeSample> samples;
  for (const TraceRecord& record : first) samples.push_back(record.probe);
  ReplayDevice device = ReplayDevice::build(samples).value();
  SafetyStage safety = wide_stage();
  std::size_t i = 0;
  run_session(wall, device, safety, Seconds(1e-3), [&](const TraceRecord& r) {
    EXPECT_EQ(r.commanded, first[i].commanded) << i;
    ++i;
  });
  EXPECT_EQ(i, first.size());
}

TEST(Session, RateChangesTheHandsForceLittle) {
  // The simulated hand does not depend on the rate of the loop beyond the loop's own sampling.
  const auto force_at = [](const std::vector<TraceRecord>& records, double time) {
    for (const TraceRecord& r : records) {
      if (r.probe.time.count() >= time) return r.commanded.y();
    }
    return std::numeric_limits<double>::quiet_NaN();
  };
  EXPECT_NEAR(force_at(run_simulated(Seconds(1e-3)), 1.0), force_at(run_simulated(Seconds(2.5e-4)), 1.0), 0.05);
}

TEST(Session, SafetyStandsBetweenStepAndDevice) {
  IdealProbe probe = IdealProbe::build(line(PressMode::depth)).value();
  SafetyStage safety = SafetyStage::build({0.3, 1e9}).value();
  const auto broken = [](const ProbeSample& sample, Seconds dt) {
    ForceSample answer = wall(sample, dt);
    if (sample.time > Seconds(0.8)) answer.wrench.force.x() = std::numeric_limits<double>::quiet_NaN();
    return answer;
  };
  bool limited = false;
  bool replaced = false;
  run_session(broken, probe, safety, Seconds(1e-3), [&](const TraceRecord& r) {
    ASSERT_TRUE(r.commanded.allFinite());
    ASSERT_LE(r.commanded.norm(), 0.3);
    limited |= r.rendered.flags.has(TickFlag::force_limited);
    replaced |= r.rendered.flags.has(TickFlag::output_not_finite);
  });
  EXPECT_TRUE(limited);
  EXPECT_TRUE(replaced);
}

TEST(Session, RecorderCanStopIt) {
  IdealProbe probe = IdealProbe::build(line(PressMode::depth)).value();
  SafetyStage safety = wide_stage();
  const SessionSummary summary =
      run_session(wall, probe, safety, Seconds(1e-3), [](const TraceRecord& r) { return r.tick < 9; });
  EXPECT_TRUE(summary.stopped);
  EXPECT_EQ(summary.ticks, 10U);
}

TEST(Session, EndsAtItsTickLimitAndShowsProgress) {
  IdealProbe probe = IdealProbe::build(line(PressMode::depth)).value();
  SafetyStage safety = wide_stage();
  std::vector<double> fractions;
  const SessionSummary summary = run_session(
      wall, probe, safety, {Seconds(1e-4), {.max_ticks = 500, .progress_interval = 100}}, [](const TraceRecord&) {},
      [&](std::string_view, double fraction) { fractions.push_back(fraction); });
  EXPECT_EQ(summary.ticks, 500U);
  EXPECT_EQ(fractions, (std::vector<double>{0.2, 0.4, 0.6, 0.8, 1.0, 1.0}));
}

TEST(Session, TheLoopDoesNotAllocate) {
  SimulatedDevice simulated =
      SimulatedDevice::build(line(PressMode::force), find_profile("phantom-desktop").value(), HandImpedance{}).value();
  IdealProbe ideal = IdealProbe::build(line(PressMode::force)).value();
  SafetyStage safety = wide_stage();
  std::vector<TraceRecord> storage(3000);
  const auto record = [&](const TraceRecord& r) { storage[r.tick] = r; };
  SessionSettings settings;
  settings.max_ticks = storage.size();
  allocations = 0;
  counting = true;
  run_session(wall, simulated, safety, settings, record);
  run_session(wall, ideal, safety, settings, record);
  counting = false;
  EXPECT_EQ(allocations.load(), 0);
  // The trap itself works.
  counting = true;
  std::vector<int> probe_of_the_trap(100);
  counting = false;
  EXPECT_GT(allocations.load(), 0) << probe_of_the_trap.size();
}

TEST(Session, TicksCoverADuration) {
  EXPECT_EQ(session_ticks(Seconds(1.0), Seconds(1e-3)), 1001U);
  EXPECT_EQ(session_ticks(Seconds(0.3), Seconds(0.1)), 4U);
  EXPECT_EQ(session_ticks(Seconds(0.0), Seconds(1e-3)), 1U);
}

}  // namespace
}  // namespace asperity::session_test
