// The loop on its own thread: begins, is given other things to touch, and ends with nothing left in the hand.

#include "asperity/servo/servo_thread.h"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <vector>

namespace asperity::servo_thread_test {
namespace {

/// What a test touches: it pushes up by so much.
struct Pushing {
  double newtons = 0.0;
  int number = 0;
};

/// What a device was told to hold; written by the servo thread, read once that has ended.
struct Held {
  std::vector<Vec3> forces;
  std::vector<double> dt;
  std::uint64_t ends_after = UINT64_MAX;
};

struct HoldingDevice {
  std::shared_ptr<Held> held;
  ProbeSample read() noexcept { return {}; }
  void apply(const Vec3& force, Seconds dt) noexcept {
    if (held->forces.size() == held->forces.capacity()) return;
    held->forces.push_back(force);
    held->dt.push_back(dt.count());
  }
  [[nodiscard]] Vec3 aim() const noexcept { return Vec3::Zero(); }
  [[nodiscard]] bool finished() const noexcept { return held->forces.size() >= held->ends_after; }
};

std::shared_ptr<Held> room_for(std::size_t ticks) {
  auto held = std::make_shared<Held>();
  held->forces.reserve(ticks);
  held->dt.reserve(ticks);
  return held;
}

/// Free at its first ticks, so that the safety stage lets forces through; then what is touched says.
struct Push {
  int free = 3;
  int last = 0;
  int* wrong = nullptr;
  ForceSample operator()(const Pushing& felt, const ProbeSample&, Seconds) noexcept {
    if (wrong != nullptr && felt.number < last) ++*wrong;
    last = felt.number;
    ForceSample sample;
    if (free > 0) {
      --free;
      return sample;
    }
    sample.wrench.force = Vec3(0.0, felt.newtons, 0.0);
    sample.flags.set(TickFlag::contact);
    return sample;
  }
};

struct NoRecord {
  void operator()(const TraceRecord&) const noexcept {}
};

using Loop = ServoThread<Pushing, Push, HoldingDevice, NoRecord>;

ServoSettings quick() {
  ServoSettings settings;
  settings.rate = 2000.0;
  settings.realtime = {.priority = 0, .lock_memory = false, .cpu = -1};
  settings.safety = {.max_force = 3.0, .slew_limit = 500.0};
  return settings;
}

void sleep_ms(int ms) {
  std::this_thread::sleep_for(std::chrono::milliseconds(ms));
}

/// No force changes by more than the slew limit lets it in its tick, and the last one is none.
void expect_ramped(const Held& held, const ServoSettings& settings) {
  ASSERT_FALSE(held.forces.empty());
  Vec3 before = Vec3::Zero();
  for (std::size_t i = 0; i < held.forces.size(); ++i) {
    ASSERT_LE((held.forces[i] - before).norm(), settings.safety.slew_limit * held.dt[i] * (1.0 + 1e-9)) << i;
    before = held.forces[i];
  }
  EXPECT_TRUE(held.forces.back().isZero());
}

TEST(ServoThread, RampsDownBeforeItEnds) {
  const auto held = room_for(100000);
  const ServoSettings settings = quick();
  auto loop = Loop::start(std::make_shared<const Pushing>(Pushing{2.0, 1}), {}, {held}, {}, settings);
  ASSERT_TRUE(loop) << loop.error().message();
  sleep_ms(60);
  EXPECT_FALSE((*loop)->ended());
  const SessionSummary summary = (*loop)->stop();
  EXPECT_TRUE((*loop)->ended());
  EXPECT_EQ(summary.ticks, held->forces.size());
  EXPECT_NEAR(summary.max_force, 2.0, 1e-12) << "it had come to its full force";
  expect_ramped(*held, settings);
  EXPECT_EQ((*loop)->meters().step.counts().total, summary.ticks);
  EXPECT_EQ((*loop)->stop().ticks, summary.ticks) << "once more changes nothing";
}

TEST(ServoThread, EndsWithItsTicksOrItsDevice) {
  for (const bool by_device : {false, true}) {
    const auto held = room_for(100000);
    ServoSettings settings = quick();
    (by_device ? held->ends_after : settings.max_ticks) = 50;
    auto loop = Loop::start(std::make_shared<const Pushing>(Pushing{2.0, 1}), {}, {held}, {}, settings);
    ASSERT_TRUE(loop) << loop.error().message();
    for (int i = 0; i < 2000 && !(*loop)->ended(); ++i) sleep_ms(1);
    EXPECT_TRUE((*loop)->ended());
    (*loop)->stop();
    EXPECT_GT(held->forces.size(), 50u) << "the ramp comes after them";
    EXPECT_LT(held->forces.size(), 80u);
    expect_ramped(*held, settings);
  }
}

TEST(ServoThread, TouchesTheLatestThatItIsGiven) {
  const auto held = room_for(1000000);
  const ServoSettings settings = quick();
  int wrong = 0;
  Push push;
  push.wrong = &wrong;
  auto loop = Loop::start(std::make_shared<const Pushing>(Pushing{0.5, 1}), push, {held}, {}, settings);
  ASSERT_TRUE(loop) << loop.error().message();
  constexpr int swaps = 2000;
  for (int i = 2; i <= swaps; ++i) {
    (*loop)->put(std::make_shared<const Pushing>(Pushing{0.5 + 1e-4 * i, i}));
    if (i % 16 == 0) sleep_ms(1);
  }
  const double last = 0.5 + 1e-4 * swaps;
  sleep_ms(60);
  const MailboxCount count = (*loop)->handed_over();
  EXPECT_EQ(count.put, static_cast<std::uint64_t>(swaps));
  EXPECT_EQ(count.taken + count.replaced, count.put);
  EXPECT_GT(count.taken, 20u);
  const SessionSummary summary = (*loop)->stop();
  EXPECT_EQ(wrong, 0) << "never an older one again";
  EXPECT_NEAR(summary.max_force, last, 1e-9) << "the newest was felt";
  expect_ramped(*held, settings);
}

TEST(ServoThread, RefusesWhatCannotRun) {
  const auto start = [](const ServoSettings& settings) {
    return Loop::start(std::make_shared<const Pushing>(), {}, {room_for(10)}, {}, settings);
  };
  ServoSettings settings = quick();
  settings.rate = 100.0;
  EXPECT_EQ(start(settings).error().place, "rate");
  settings = quick();
  settings.safety.max_force = -1.0;
  EXPECT_EQ(start(settings).error().place, "max_force");
  settings = quick();
  settings.realtime.cpu = 100000;
  EXPECT_EQ(start(settings).error().place, "cpu");
}

}  // namespace
}  // namespace asperity::servo_thread_test
