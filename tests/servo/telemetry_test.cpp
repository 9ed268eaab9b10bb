// What a loop tells comes to every reader whole and in order, or what is lost is counted; nobody holds anybody up.

#include "asperity/servo/telemetry.h"

#include <gtest/gtest.h>

#include <thread>

#include "tests/servo/live_loops.h"

namespace asperity::telemetry_test {
namespace {

using test::comes;
using test::for_a_hand;
using test::Push;
using test::Pushing;
using test::sleep_for_ms;
using test::StandingDevice;

TEST(RingQueue, RefusesWhatFindsNoRoomAndLosesNothingElse) {
  RingQueue<std::uint64_t> queue(5);
  EXPECT_EQ(queue.capacity(), 8u);
  for (std::uint64_t i = 0; i < 8; ++i) EXPECT_TRUE(queue.push(i));
  EXPECT_FALSE(queue.push(8));
  std::vector<std::uint64_t> out;
  EXPECT_EQ(queue.pop_all([&](std::uint64_t value) { out.push_back(value); }), 8u);
  EXPECT_EQ(out, (std::vector<std::uint64_t>{0, 1, 2, 3, 4, 5, 6, 7}));
  EXPECT_TRUE(queue.push(9));
  out.clear();
  EXPECT_EQ(queue.pop_all([&](std::uint64_t value) { out.push_back(value); }), 1u);
  EXPECT_EQ(out.front(), 9u);
}

TEST(RingQueue, KeepsOrderBetweenTwoThreads) {
  RingQueue<std::uint64_t> queue(64);
  constexpr std::uint64_t most = 300'000;
  std::uint64_t refused = 0;
  std::thread pushes([&] {
    for (std::uint64_t i = 1; i <= most;) {
      if (queue.push(i)) {
        ++i;
      } else {
        ++refused;
        std::this_thread::yield();
      }
    }
  });
  std::uint64_t last = 0;
  bool in_order = true;
  while (last < most) {
    queue.pop_all([&](std::uint64_t value) {
      in_order = in_order && value == last + 1;
      last = value;
    });
    std::this_thread::yield();
  }
  pushes.join();
  EXPECT_TRUE(in_order);
}

/// What stands in for a proxy's state.
struct Counted {
  std::uint64_t ticks = 0;
};
/// Counts its ticks.
struct CountingPush {
  Push push;
  Counted state;
  ForceSample operator()(const Pushing& felt, const ProbeSample& probe, Seconds dt) noexcept {
    ++state.ticks;
    return push(felt, probe, dt);
  }
};
struct Feed {
  std::shared_ptr<Telemetry<Counted>> telemetry;
  void operator()(const LiveTick<Pushing, CountingPush>& tick) const noexcept {
    telemetry->put(tick, tick.felt.number, tick.step.state);
  }
};
using Loop = ServoThread<Pushing, CountingPush, StandingDevice, Feed>;
using Reader = TelemetryReader<Counted>;

/// All that a reader gets, a little late each time.
struct Taken {
  Reader::Batch all;
  void take(Reader& reader, int pause_ms) {
    Reader::Batch batch;
    while (reader.take(batch, std::chrono::milliseconds(100))) {
      all.ticks.insert(all.ticks.end(), batch.ticks.begin(), batch.ticks.end());
      all.key_frames.insert(all.key_frames.end(), batch.key_frames.begin(), batch.key_frames.end());
      sleep_for_ms(pause_ms);
    }
  }
};

TEST(Telemetry, BringsEveryTickToEveryReaderWithAKeyFrameBeforeItsTick) {
  const auto telemetry = std::make_shared<Telemetry<Counted>>(TelemetrySettings{.ticks = 4096, .key_frame_every = 100});
  const auto quick = telemetry->read(100'000);
  const auto slow = telemetry->read(100'000);
  Taken by_quick;
  Taken by_slow;
  std::thread first([&] { by_quick.take(*quick, 0); });
  std::thread second([&] { by_slow.take(*slow, 20); });
  ServoSettings settings = for_a_hand(2000.0);
  settings.max_ticks = 1000;
  Pushing felt;
  felt.number = 7;
  auto loop = Loop::start(std::make_shared<const Pushing>(felt), {}, {}, {telemetry}, settings).value();
  sleep_for_ms(100);
  felt.number = 8;
  felt.newtons = 1.0;
  loop->put(std::make_shared<const Pushing>(felt));
  ASSERT_TRUE(comes([&] { return loop->ended(); }));
  const SessionSummary summary = loop->stop();
  telemetry->end();
  first.join();
  second.join();
  EXPECT_EQ(telemetry->lost(), 0u);
  for (const Taken* taken : {&by_quick, &by_slow}) {
    const auto& ticks = taken->all.ticks;
    ASSERT_EQ(ticks.size(), summary.ticks);
    std::size_t changes = 0;
    for (std::size_t i = 0; i < ticks.size(); ++i) {
      ASSERT_EQ(ticks[i].record.tick, i);
      ASSERT_EQ(ticks[i].lost, 0u);
      ASSERT_EQ(ticks[i].notes.taken, i == 0 || ticks[i].scene != ticks[i - 1].scene);
      changes += ticks[i].notes.taken ? 1U : 0U;
    }
    EXPECT_EQ(changes, 2u);
    EXPECT_EQ(ticks.front().scene, 7u);
    EXPECT_EQ(ticks.back().scene, 8u);
    EXPECT_TRUE(ticks.back().record.commanded.isZero(0.0)) << "ramped down";
    ASSERT_GE(taken->all.key_frames.size(), 10u);
    for (std::size_t i = 0; i < taken->all.key_frames.size(); ++i) {
      const auto& frame = taken->all.key_frames[i];
      ASSERT_EQ(frame.tick, 100 * (i + 1));
      ASSERT_EQ(frame.state.ticks, frame.tick) << "as it was before that tick";
      ASSERT_EQ(frame.scene, ticks[frame.tick - 1].scene);
      ASSERT_EQ(frame.safety.last_force, ticks[frame.tick - 1].record.commanded);
    }
  }
}

TEST(Telemetry, AReaderThatSleepsLosesItsOwnTicksAndIsTold) {
  const auto telemetry = std::make_shared<Telemetry<Counted>>();
  const auto awake = telemetry->read(100'000);
  const auto asleep = telemetry->read(50);
  ServoSettings settings = for_a_hand(2000.0);
  settings.max_ticks = 400;
  auto loop = Loop::start(std::make_shared<const Pushing>(), {}, {}, {telemetry}, settings).value();
  ASSERT_TRUE(comes([&] { return awake->lost() == 0 && asleep->lost() > 100; }));
  Reader::Batch batch;
  ASSERT_TRUE(asleep->take(batch, std::chrono::milliseconds(0)));
  EXPECT_EQ(batch.ticks.size(), 50u);
  EXPECT_EQ(batch.ticks.back().record.tick, 49u);
  ASSERT_TRUE(comes([&] { return loop->ended(); }));
  const SessionSummary summary = loop->stop();
  telemetry->end();
  ASSERT_TRUE(asleep->take(batch, std::chrono::milliseconds(0)));
  ASSERT_FALSE(batch.ticks.empty());
  EXPECT_EQ(batch.ticks.front().lost, batch.ticks.front().record.tick - 50) << "the gap before it";
  EXPECT_FALSE(asleep->take(batch, std::chrono::milliseconds(0))) << "that was all";
  ASSERT_TRUE(awake->take(batch, std::chrono::milliseconds(0)));
  EXPECT_EQ(batch.ticks.size(), summary.ticks);
}

}  // namespace
}  // namespace asperity::telemetry_test
