// The loop by the clock on the wall: what it does when ticks are late, and what passes between threads.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <thread>
#include <vector>

#include "asperity/core/rng.h"
#include "asperity/servo/loop_clock.h"
#include "asperity/servo/mailbox.h"
#include "asperity/servo/realtime.h"
#include "asperity/servo/session.h"
#include "asperity/servo/time_histogram.h"

namespace asperity::loop_test {
namespace {

/// A clock that a test moves: it wakes a sleeper late, or stands, or leaps.
struct Told {
  std::int64_t now = 1'000'000'000'000;
  std::int64_t wakes_late = 0;
  bool stands = false;
  int sleeps = 0;
};
struct ToldTime {
  Told* told;
  [[nodiscard]] std::int64_t now() const noexcept { return told->now; }
  void sleep_until(std::int64_t ns) const noexcept {
    ++told->sleeps;
    if (told->stands) return;
    told->now = std::max(told->now, ns) + std::exchange(told->wakes_late, 0);
  }
};

constexpr double ms = 1e-3;
constexpr std::int64_t ns_a_ms = 1'000'000;

TEST(PeriodicClock, TicksAtWholePeriods) {
  Told told;
  auto clock = PeriodicClock<ToldTime>::build(1000.0, {&told}).value();
  const std::int64_t begin = told.now;
  EXPECT_DOUBLE_EQ(clock.wait().dt.count(), ms);
  for (int i = 1; i < 100; ++i) {
    told.now += 300'000;  // what the tick took
    const LoopTick tick = clock.wait();
    EXPECT_EQ(told.now, begin + i * ns_a_ms);
    EXPECT_DOUBLE_EQ(tick.dt.count(), ms);
    EXPECT_EQ(tick.lateness, 0.0);
    EXPECT_EQ(tick.missed, 0u);
  }
}

TEST(PeriodicClock, ALateTickIsToldAndNotMadeUpFor) {
  Told told;
  auto clock = PeriodicClock<ToldTime>::build(1000.0, {&told}).value();
  clock.wait();
  const std::int64_t begin = told.now;
  told.now += 3'400'000;  // the tick took 3.4 periods
  LoopTick tick = clock.wait();
  EXPECT_NEAR(tick.lateness, 2.4 * ms, 1e-9);
  EXPECT_EQ(tick.missed, 2u);
  EXPECT_NEAR(tick.dt.count(), 3.4 * ms, 1e-9);
  // No burst: the next one is due at the next whole period, and the true time has passed until then.
  tick = clock.wait();
  EXPECT_EQ(told.now, begin + 4 * ns_a_ms);
  EXPECT_NEAR(tick.dt.count(), 0.6 * ms, 1e-9);
  EXPECT_EQ(tick.missed, 0u);
  // Woken late by less than a period: told, nothing left out.
  told.wakes_late = 70'000;
  tick = clock.wait();
  EXPECT_NEAR(tick.lateness, 70e-6, 1e-12);
  EXPECT_EQ(tick.missed, 0u);
}

TEST(PeriodicClock, AStuckOrLeapingTimeIsSeenAsItIs) {
  Told told;
  auto clock = PeriodicClock<ToldTime>::build(1000.0, {&told}).value();
  clock.wait();
  told.stands = true;
  for (int i = 0; i < 3; ++i) EXPECT_EQ(clock.wait().dt.count(), 0.0);
  told.stands = false;
  told.now += 60'000 * ns_a_ms;
  const LoopTick tick = clock.wait();
  EXPECT_NEAR(tick.dt.count(), 60.0, 0.01);
  EXPECT_GT(tick.missed, 50'000u);
  // Set back by a minute: it does not wait until that has passed again.
  told.now -= 60'000 * ns_a_ms;
  const std::int64_t back = told.now;
  EXPECT_EQ(clock.wait().dt.count(), 0.0);
  EXPECT_NEAR(clock.wait().dt.count(), ms, 1e-9);
  EXPECT_EQ(told.now - back, 2 * ns_a_ms);
}

TEST(PeriodicClock, RefusesRatesThatNoLoopRunsAt) {
  for (const double rate : {0.0, -1000.0, 499.0, 40001.0, std::nan(""), infinity}) {
    const auto clock = PeriodicClock<>::build(rate);
    ASSERT_FALSE(clock) << rate;
    EXPECT_EQ(clock.error().place, "rate");
    EXPECT_FALSE(check_loop_rate(rate));
  }
}

TEST(PeriodicClock, OfTheSystemKeepsItsRate) {
  auto clock = PeriodicClock<>::build(2000.0).value();
  const std::int64_t begin = SteadyTime::now();
  clock.wait();
  double sum = 0.0;
  std::uint64_t ticks = 0;
  for (int i = 0; i < 200; ++i) {
    const LoopTick tick = clock.wait();
    sum += tick.dt.count();
    ticks += 1 + tick.missed;
  }
  const double passed = 1e-9 * static_cast<double>(SteadyTime::now() - begin);
  EXPECT_NEAR(sum, passed, 5e-3) << "every moment is part of some tick";
  EXPECT_NEAR(static_cast<double>(ticks) / 2000.0, passed, 5e-3) << "as many as were due";
}

TEST(TimeHistogram, QuantilesAreThoseOfTheTimesToThreePercent) {
  Rng rng(3);
  TimeHistogram histogram;
  std::vector<double> times;
  for (int i = 0; i < 20000; ++i) {
    times.push_back(std::pow(10.0, rng.uniform(-7.5, 1.0)));
    histogram.add(times.back());
  }
  std::sort(times.begin(), times.end());
  const TimeCounts counts = histogram.counts();
  EXPECT_EQ(counts.total, times.size());
  EXPECT_NEAR(counts.longest, times.back(), 1e-9);
  for (const double share : {0.001, 0.5, 0.9, 0.99, 0.999, 1.0}) {
    const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(times.size()))) - 1;
    EXPECT_GE(counts.quantile(share), times[rank] - 1e-9) << share;
    EXPECT_LE(counts.quantile(share), times[rank] * 1.035 + 1e-9) << share;
  }
}

TEST(TimeHistogram, TakesWhatIsNoTime) {
  TimeHistogram histogram;
  EXPECT_EQ(histogram.counts().quantile(0.5), 0.0);
  for (const double time : {-1.0, std::nan(""), infinity, 1e30}) histogram.add(time);
  EXPECT_EQ(histogram.counts().total, 4u);
  EXPECT_EQ(histogram.counts().quantile(0.5), 0.0);
  EXPECT_GT(histogram.counts().quantile(1.0), 1000.0);
}

/// Knows where it dies.
struct Mortal {
  static inline std::atomic<int> alive = 0;
  static inline std::atomic<int> died_on_the_taker = 0;
  static inline std::atomic<std::thread::id> taker;
  int number = 0;
  std::array<int, 64> copies{};
  explicit Mortal(int of) : number(of) {
    copies.fill(of);
    ++alive;
  }
  Mortal(const Mortal&) = delete;
  Mortal& operator=(const Mortal&) = delete;
  ~Mortal() {
    copies.fill(-1);
    --alive;
    if (std::this_thread::get_id() == taker.load()) ++died_on_the_taker;
  }
};

TEST(Mailbox, TheTakerNeverDropsTheLastReference) {
  Mortal::died_on_the_taker = 0;
  {
    Mailbox<Mortal> mailbox;
    std::atomic<bool> done = false;
    int wrong = 0;
    int last = 0;
    std::thread taker([&] {
      Mortal::taker = std::this_thread::get_id();
      const Mortal* held = nullptr;
      while (!done.load(std::memory_order_relaxed) || last < 20000) {
        if (const Mortal* next = mailbox.take()) held = next;
        if (held == nullptr) continue;
        // Whole, alive, and never older than the one before.
        wrong += held->number < last ? 1 : 0;
        for (const int copy : held->copies) wrong += copy != held->number ? 1 : 0;
        last = held->number;
      }
    });
    for (int i = 1; i <= 20000; ++i) {
      // Nobody but the mailbox holds it.
      mailbox.put(std::make_shared<const Mortal>(i));
      if (i % 64 == 0) std::this_thread::yield();
    }
    done = true;
    taker.join();
    EXPECT_EQ(wrong, 0);
    EXPECT_EQ(last, 20000) << "the newest has arrived";
    const MailboxCount count = mailbox.count();
    EXPECT_EQ(count.put, 20000u);
    EXPECT_EQ(count.taken + count.replaced, count.put);
    EXPECT_GT(count.taken, 1u);
    mailbox.collect();
    EXPECT_EQ(Mortal::alive.load(), 1) << "all but the one in use are freed";
  }
  EXPECT_EQ(Mortal::alive.load(), 0);
  EXPECT_EQ(Mortal::died_on_the_taker.load(), 0);
}

TEST(Mailbox, LatestWinsAndIsCounted) {
  Mailbox<Mortal> mailbox;
  EXPECT_EQ(mailbox.take(), nullptr);
  for (int i = 1; i <= 3; ++i) mailbox.put(std::make_shared<const Mortal>(i));
  const Mortal* got = mailbox.take();
  ASSERT_NE(got, nullptr);
  EXPECT_EQ(got->number, 3);
  EXPECT_EQ(mailbox.take(), nullptr);
  EXPECT_EQ(mailbox.count().replaced, 2u);
  mailbox.put(std::make_shared<const Mortal>(4));
  EXPECT_EQ(got->number, 3) << "in use until the next is taken";
  EXPECT_EQ(mailbox.take()->number, 4);
  mailbox.collect();
  EXPECT_EQ(mailbox.count().freed, 3u);
}

TEST(Realtime, TellsWhatItGotAndWhatToDo) {
  std::vector<RealtimeGrant> grants;
  std::thread([&] { grants = become_realtime({.priority = 1, .lock_memory = false, .cpu = 0}).value(); }).join();
  ASSERT_EQ(grants.size(), 3u);
  for (const RealtimeGrant& grant : grants) {
    EXPECT_FALSE(grant.asked.empty());
    EXPECT_EQ(grant.got, grant.why.empty()) << grant.asked;
    EXPECT_EQ(grant.got, grant.advice.empty()) << grant.asked;
  }
  EXPECT_FALSE(become_realtime({.priority = 100}));
  EXPECT_FALSE(become_realtime({.priority = -1}));
  EXPECT_EQ(become_realtime({.priority = 0, .lock_memory = false, .cpu = 4096}).error().place, "cpu");
}

/// Stands still; counts what it is told.
struct StillDevice {
  int reads = 0;
  double held = 0.0;  ///< s that forces were held for
  ProbeSample read() noexcept {
    ++reads;
    return {};
  }
  void apply(const Vec3&, Seconds dt) noexcept { held += dt.count(); }
  [[nodiscard]] Vec3 aim() const noexcept { return Vec3::Zero(); }
  [[nodiscard]] bool finished() const noexcept { return false; }
};

TEST(Loop, ByAClockStepsWithTheTrueTimeAndMetersIt) {
  Told told;
  auto clock = PeriodicClock<ToldTime>::build(1000.0, {&told}).value();
  StillDevice device;
  SafetyStage safety = SafetyStage::build({}).value();
  LoopSettings settings;
  settings.max_ticks = 100;
  LoopMeters meters;
  std::vector<double> steps;
  const auto step = [&](const ProbeSample&, Seconds dt) {
    steps.push_back(dt.count());
    told.now += steps.size() == 50 ? 5'200'000 : 200'000;
    return ForceSample{};
  };
  const SessionSummary summary = run_loop(
      clock, step, device, safety, settings, [](const TraceRecord&) {}, {}, &meters);
  EXPECT_EQ(summary.ticks, 100u);
  EXPECT_EQ(summary.missed, 4u);
  EXPECT_EQ(device.reads, 100);
  EXPECT_NEAR(steps[50], 5.2e-3, 1e-9) << "after the slow tick";
  EXPECT_NEAR(steps[51], 0.8e-3, 1e-9) << "up to the next whole period";
  EXPECT_NEAR(device.held, 104e-3, 1e-9);
  EXPECT_EQ(meters.period.counts().total, 99u);
  EXPECT_NEAR(meters.period.counts().longest, 5.2e-3, 1e-8);
  EXPECT_NEAR(meters.lateness.counts().longest, 4.2e-3, 1e-8);
  EXPECT_EQ(meters.step.counts().total, 100u);
}

}  // namespace
}  // namespace asperity::loop_test
