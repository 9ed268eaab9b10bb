// Faults, planted one by one: each ends with no force at the device, stays until it is acknowledged, and is told.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <functional>

#include "tests/servo/live_loops.h"

namespace asperity::fault_test {
namespace {

using test::comes;
using test::for_a_hand;
using test::Keep;
using test::Kept;
using test::Push;
using test::Pushing;
using test::room_for_ticks;
using test::sleep_for_ms;
using test::StandingDevice;
using test::ticks_with_force;

using Port = PortDevice<SharedPort>;
template <class Time = SteadyTime>
using Loop = ServoThread<Pushing, Push, Port, Keep, Time>;

/// A device in a process of its own, and a loop that pushes on it with 2 N.
template <class Time = SteadyTime>
struct Live {
  std::shared_ptr<SharedBoard> board = SharedBoard::create().value();
  std::unique_ptr<DeviceProcess> device;
  std::shared_ptr<Kept> kept = room_for_ticks();
  std::unique_ptr<Loop<Time>> loop;

  explicit Live(const ServoSettings& settings = for_a_hand(), Time time = {}, Pushing felt = {}) {
    device = DeviceProcess::start(board, StandingDevice{}, test::plain_device()).value();
    loop = Loop<Time>::start(std::make_shared<const Pushing>(felt), {}, Port(SharedPort(board), Seconds(0.02)), {kept},
                             settings, time)
               .value();
  }
  [[nodiscard]] std::array<double, 3> put_out() const { return board->last_put_out().back().force; }
  [[nodiscard]] bool pushes() const { return put_out()[1] == 2.0; }
  [[nodiscard]] bool is_free() const { return put_out() == std::array<double, 3>{}; }
};

/// Pushes until it is felt, then with a force that is no number until none is.
template <class L>
void break_the_force_of(L& live) {
  ASSERT_TRUE(comes([&] { return live.pushes(); }));
  Pushing broken;
  broken.not_a_number = true;
  live.loop->put(std::make_shared<const Pushing>(broken));
  ASSERT_TRUE(comes([&] { return live.is_free(); }));
}

/// The device had its force, then the fault came: no force after at most `most_ms` of the loop's own time from the
/// first tick in which it could be seen, none from there on, and nobody was pushed harder meanwhile.
void expect_ended(const Kept& kept, Fault fault, double most_ms = 5.0) {
  std::size_t first = 0;
  while (first < kept.ticks.size() && kept.ticks[first].fault != fault) ++first;
  ASSERT_LT(first, kept.ticks.size()) << "the fault was never told";
  double seconds = 0.0;
  std::size_t i = first;
  for (; i < kept.ticks.size() && !kept.ticks[i].commanded.isZero(0.0); ++i) seconds += kept.ticks[i].dt;
  // Of a tick that was late itself only what came after it counts.
  EXPECT_LE(seconds - (i > first ? kept.ticks[first].dt : 0.0), 1e-3 * most_ms);
  for (std::size_t k = first; k < kept.ticks.size(); ++k) {
    ASSERT_LE(kept.ticks[k].commanded.norm(), 2.0);
    ASSERT_TRUE(k < i || kept.ticks[k].commanded.isZero(0.0)) << k;
    ASSERT_EQ(kept.ticks[k].fault, fault) << "it stays";
  }
}

/// Whoever else is late: the device counts from when it heard the loop's last word, and lets go before three of its
/// periods are over.
void expect_let_go_by(const std::vector<PutOut>& all) {
  std::size_t last = all.size() - 1;
  while (last > 0 && all[last - 1].heard == all[last].heard) --last;
  ASSERT_GT(all.size() - last, 4u);
  constexpr std::int64_t three_periods = 2'800'000;
  for (std::size_t i = last; i < all.size(); ++i)
    ASSERT_TRUE(all[i].time - all[last].time < three_periods || all[i].force[1] == 0.0) << i - last;
  EXPECT_EQ(all.back().let_go, 1u);
}

TEST(Fault, AForceThatIsNoNumberEndsTheForceUntilItIsAcknowledged) {
  Live<> live;
  ASSERT_NO_FATAL_FAILURE(break_the_force_of(live));
  // All is well again, but nobody has seen it yet.
  live.loop->put(std::make_shared<const Pushing>());
  sleep_for_ms(50);
  EXPECT_TRUE(live.is_free());
  EXPECT_EQ(live.kept->fault.load(), static_cast<int>(Fault::output_not_finite));
  live.loop->stop();
  expect_ended(*live.kept, Fault::output_not_finite);
  for (const PutOut& put : live.board->last_put_out()) ASSERT_TRUE(std::isfinite(put.force[1]));
}

TEST(Fault, OnceAcknowledgedTheForceComesBackFromNothing) {
  Live<> live;
  ASSERT_NO_FATAL_FAILURE(break_the_force_of(live));
  Pushing nothing;
  nothing.newtons = 0.0;
  live.loop->put(std::make_shared<const Pushing>(nothing));
  live.loop->acknowledge();
  ASSERT_TRUE(comes([&] { return live.kept->fault.load() == 0; }));
  live.loop->put(std::make_shared<const Pushing>());
  EXPECT_TRUE(comes([&] { return live.pushes(); }));
  live.loop->stop();
  Vec3 before = Vec3::Zero();
  std::size_t acknowledged = 0;
  for (const Kept::Tick& tick : live.kept->ticks) {
    ASSERT_LE((tick.commanded - before).norm(), 1500.0 * tick.dt * (1.0 + 1e-9));
    before = tick.commanded;
    acknowledged += tick.notes.acknowledged ? 1 : 0;
  }
  EXPECT_EQ(acknowledged, 1u);
}

TEST(Fault, AStepThatNeverComesBackIsSeenByTheWatchdogAndTheDeviceLetsGo) {
  ServoSettings settings = for_a_hand();
  settings.longest_step = Seconds(0.02);
  Live<> live(settings);
  ASSERT_TRUE(comes([&] { return live.pushes(); }));
  Pushing stalls;
  stalls.for_ever = true;
  live.loop->put(std::make_shared<const Pushing>(stalls));
  ASSERT_TRUE(comes([&] { return live.is_free(); }));
  ASSERT_TRUE(comes([&] { return live.board->halted(); })) << "the watchdog has halted it";
  const std::vector<PutOut> all = live.board->last_put_out();
  expect_let_go_by(all);
  // It comes back after all: the fault stays.
  live.loop->put(std::make_shared<const Pushing>());
  stalls.go_on->store(true);
  ASSERT_TRUE(comes([&] { return live.kept->fault.load() == static_cast<int>(Fault::stalled); }));
  sleep_for_ms(30);
  EXPECT_TRUE(live.is_free());
  live.loop->stop();
  expect_ended(*live.kept, Fault::stalled);
}

TEST(Fault, ATickOfFiftyMillisecondsIsAnOverrun) {
  Live<> live;
  ASSERT_TRUE(comes([&] { return live.pushes(); }));
  Pushing slow;
  slow.takes_ms = 60;
  live.loop->put(std::make_shared<const Pushing>(slow));
  ASSERT_TRUE(comes([&] { return live.kept->fault.load() == static_cast<int>(Fault::overrun); }));
  live.loop->put(std::make_shared<const Pushing>());
  ASSERT_TRUE(comes([&] { return live.is_free(); }));
  live.loop->stop();
  expect_ended(*live.kept, Fault::overrun);
}

TEST(Fault, ALoopThatWasAwayForTenMillisecondsComesBackFromNothing) {
  Live<> live;
  ASSERT_TRUE(comes([&] { return live.pushes(); }));
  Pushing slow;
  slow.takes_ms = 10;
  for (int i = 0; i < 5; ++i) {
    live.loop->put(std::make_shared<const Pushing>(slow));
    sleep_for_ms(15);
    live.loop->put(std::make_shared<const Pushing>());
    ASSERT_TRUE(comes([&] { return live.pushes(); }));
  }
  live.loop->stop();
  EXPECT_EQ(live.kept->fault.load(), 0) << "no fault: told, and gone over";
  std::size_t released = 0;
  for (const Kept::Tick& tick : live.kept->ticks) released += tick.notes.released ? 1 : 0;
  EXPECT_GE(released, 5u);
  // What the device puts out falls to nothing at once, but never grows by more than the loop's slew in its longest
  // tick.
  double before = 0.0;
  for (const PutOut& put : live.board->last_put_out()) {
    ASSERT_TRUE(put.force[1] <= before + 1500.0 * 0.05) << "no kick";
    before = put.force[1];
  }
}

TEST(Fault, ADeviceThatVanishesIsLostAndStaysSoWhenItReturns) {
  Live<> live;
  ASSERT_TRUE(comes([&] { return live.pushes(); }));
  ::kill(live.device->pid(), SIGSTOP);
  ASSERT_TRUE(comes([&] { return live.kept->fault.load() == static_cast<int>(Fault::device_lost); }));
  ASSERT_TRUE(comes([&] { return live.kept->force.load() == 0.0; }));
  const std::int64_t returns = SteadyTime::now();
  ::kill(live.device->pid(), SIGCONT);
  const std::uint64_t beat = live.board->read().value_or(PortReading{}).beat;
  ASSERT_TRUE(comes([&] { return live.board->read().value_or(PortReading{}).beat > beat + 50; }));
  EXPECT_EQ(ticks_with_force(live.board->last_put_out(), returns), 0u) << "not with the force that it went with";
  live.loop->stop();
  expect_ended(*live.kept, Fault::device_lost);
}

TEST(Fault, ADeviceThatRepeatsItselfIsLost) {
  // The far side is the test: it tells the same sample again and again.
  const auto board = SharedBoard::create().value();
  PortReading told;
  told.beat = 1;
  board->tell(told);
  const auto kept = room_for_ticks();
  std::atomic<bool> stop = false;
  std::atomic<bool> repeats = false;
  std::thread far([&] {
    while (!stop) {
      if (!repeats) ++told.beat;
      told.released = 0;
      board->tell(told);
      sleep_for_ms(1);
    }
  });
  auto loop =
      Loop<>::start(std::make_shared<const Pushing>(), {}, Port(SharedPort(board), Seconds(0.05)), {kept}, for_a_hand())
          .value();
  EXPECT_TRUE(comes([&] { return kept->force.load() == 2.0; }));
  repeats = true;
  EXPECT_TRUE(comes([&] { return kept->fault.load() == static_cast<int>(Fault::device_lost); }));
  EXPECT_TRUE(comes([&] { return kept->force.load() == 0.0; }));
  loop->stop();
  stop = true;
  far.join();
  expect_ended(*kept, Fault::device_lost);
}

/// A clock that a test stops or makes leap; a stopped one wakes whoever sleeps after a while all the same.
struct BrokenTime {
  struct State {
    std::atomic<std::int64_t> stopped_at = 0;
    std::atomic<std::int64_t> ahead = 0;
  };
  std::shared_ptr<State> state = std::make_shared<State>();
  [[nodiscard]] std::int64_t now() const noexcept {
    const std::int64_t stopped = state->stopped_at;
    return stopped != 0 ? stopped : SteadyTime::now() + state->ahead;
  }
  void sleep_until(std::int64_t ns) const noexcept {
    if (state->stopped_at != 0) {
      SteadyTime::sleep_until(SteadyTime::now() + 1'000'000);
    } else {
      SteadyTime::sleep_until(ns - state->ahead);
    }
  }
};

TEST(Fault, AClockThatStandsStillEndsTheForceAtOnce) {
  BrokenTime time;
  Live<BrokenTime> live(for_a_hand(), time);
  ASSERT_TRUE(comes([&] { return live.pushes(); }));
  time.state->stopped_at = time.now();
  ASSERT_TRUE(comes([&] { return live.is_free(); }));
  EXPECT_TRUE(live.board->halted());
  std::size_t with_force = 0;
  const std::int64_t stopped = time.state->stopped_at;
  with_force = ticks_with_force(live.board->last_put_out(), stopped);
  live.loop->stop();
  std::size_t first = 0;
  while (live.kept->ticks[first].notes.raised != Fault::clock_stopped) ++first;
  EXPECT_EQ(live.kept->ticks[first - 3].dt, 0.0);
  EXPECT_GT(live.kept->ticks[first - 4].dt, 0.0) << "three ticks may have no length, the fourth may not";
  EXPECT_LE(with_force, 8u) << "of the device's own periods";
}

TEST(Fault, AClockThatLeapsAheadIsAnOverrun) {
  BrokenTime time;
  Live<BrokenTime> live(for_a_hand(), time);
  ASSERT_TRUE(comes([&] { return live.pushes(); }));
  time.state->ahead = 1'000'000'000;
  ASSERT_TRUE(comes([&] { return live.kept->fault.load() == static_cast<int>(Fault::overrun); }));
  ASSERT_TRUE(comes([&] { return live.is_free(); }));
  live.loop->stop();
  expect_ended(*live.kept, Fault::overrun);
}

/// Runs `host` in a process of its own, that pushes on a device in another, until the device has its force; then
/// `ends(pid)`. Answers what the device put out.
std::vector<PutOut> after_the_end_of(const std::function<void(pid_t)>& ends, const std::function<void()>& within = {}) {
  const auto board = SharedBoard::create().value();
  const auto device = DeviceProcess::start(board, StandingDevice{}, test::plain_device()).value();
  const pid_t host = ::fork();
  if (host == 0) {
    auto loop = Loop<>::start(std::make_shared<const Pushing>(), {}, Port(SharedPort(board), Seconds(0.02)),
                              {room_for_ticks()}, for_a_hand())
                    .value();
    if (within) {
      comes([&] { return board->last_put_out().back().force[1] == 2.0; });
      std::thread(within).join();
    }
    sleep_for_ms(20'000);
    ::_exit(0);
  }
  EXPECT_TRUE(comes([&] { return board->last_put_out().back().force[1] == 2.0; }));
  if (ends) ends(host);
  int status = 0;
  ::waitpid(host, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_TRUE(comes([&] { return board->last_put_out().back().force[1] == 0.0; }));
  sleep_for_ms(20);
  return board->last_put_out();
}

TEST(Fault, AHostThatIsKilledLeavesNoForceBehind) {
  expect_let_go_by(after_the_end_of([](pid_t host) { ::kill(host, SIGKILL); }));
}

#ifndef ASPERITY_SANITIZED
TEST(Fault, AnotherThreadThatCrashesLeavesNoForceBehind) {
  expect_let_go_by(after_the_end_of({}, [] { ::raise(SIGSEGV); }));
}
#endif

}  // namespace
}  // namespace asperity::fault_test
