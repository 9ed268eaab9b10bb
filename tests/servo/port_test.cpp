// The port: what passes between a loop and a device, and who lets go of the force when one of them is silent.

#include "asperity/device/port.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <thread>

#include "asperity/device/shared_board.h"
#include "asperity/servo/device_process.h"
#include "tests/servo/live_loops.h"

namespace asperity::port_test {
namespace {

using test::comes;
using test::sleep_for_ms;
using test::StandingDevice;

std::shared_ptr<SharedBoard> board() {
  return SharedBoard::create().value();
}

struct Numbers {
  std::array<std::uint64_t, 15> all{};
};

TEST(SharedValue, IsNeverReadTorn) {
  SharedValue<Numbers> value;
  std::atomic<bool> done = false;
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= 200'000; ++i) {
      Numbers numbers;
      numbers.all.fill(i);
      value.put(numbers);
    }
    done = true;
  });
  std::uint64_t last = 0;
  std::uint64_t reads = 0;
  while (!done || last < 200'000) {
    Numbers numbers;
    if (!value.get(numbers)) continue;
    ++reads;
    for (const std::uint64_t number : numbers.all) ASSERT_EQ(number, numbers.all[0]);
    ASSERT_GE(numbers.all[0], last) << "an older one after a newer one";
    last = numbers.all[0];
  }
  writer.join();
  EXPECT_GT(reads, 100u);
}

TEST(SharedBoard, BringsEveryNumberAcross) {
  const auto between = board();
  PortReading told;
  told.beat = 7;
  told.released = 3;
  told.finished = true;
  told.probe.pose.position = Vec3(0.1, -0.2, 0.3);
  told.probe.pose.orientation = Quat(0.5, -0.5, 0.5, 0.5);
  told.probe.twist.linear = Vec3(1.0, 2.0, 3.0);
  told.probe.twist.angular = Vec3(4.0, 5.0, 6.0);
  told.probe.buttons = 0xF0000001U;
  told.probe.time = Seconds(12.5);
  between->tell(told);
  SharedPort port(between);
  EXPECT_EQ(between->asked()->beat, 0u) << "nothing was asked yet";
  const PortReading read = port.read();
  EXPECT_EQ(read.beat, 7u);
  EXPECT_EQ(read.released, 3u);
  EXPECT_TRUE(read.finished);
  EXPECT_EQ(read.probe.pose.position, told.probe.pose.position);
  EXPECT_EQ(read.probe.pose.orientation.coeffs(), told.probe.pose.orientation.coeffs());
  EXPECT_EQ(read.probe.twist.linear, told.probe.twist.linear);
  EXPECT_EQ(read.probe.twist.angular, told.probe.twist.angular);
  EXPECT_EQ(read.probe.buttons, told.probe.buttons);
  EXPECT_EQ(read.probe.time, told.probe.time);

  port.write(Vec3(1.0, -2.0, 3.5));
  EXPECT_EQ(between->asked()->beat, 1u);
  EXPECT_EQ(between->asked()->force, Vec3(1.0, -2.0, 3.5));
  EXPECT_EQ(between->asked()->released, 3u) << "what the loop had read by then";
  EXPECT_FALSE(between->halted());
  port.halt();
  EXPECT_TRUE(between->halted());
  port.resume();
  EXPECT_FALSE(between->halted());
  EXPECT_FALSE(between->closed());
  between->close();
  EXPECT_TRUE(between->closed());
}

TEST(SharedBoard, KeepsTheLastThatWasPutOut) {
  const auto between = board();
  for (std::size_t i = 0; i < SharedBoard::most_put_out + 10; ++i)
    between->put_out({static_cast<std::int64_t>(i), i, {0.0, 1.0, 0.0}, 0});
  const std::vector<PutOut> all = between->last_put_out();
  ASSERT_EQ(all.size(), SharedBoard::most_put_out);
  EXPECT_EQ(all.front().heard, 10u);
  EXPECT_EQ(all.back().heard, SharedBoard::most_put_out + 9);
}

/// A clock that a test moves on by a period at each wait.
struct SteppedTime {
  std::int64_t* ns;
  [[nodiscard]] std::int64_t now() const noexcept { return *ns; }
  void sleep_until(std::int64_t until) const noexcept { *ns = until; }
};

/// The far side, tick by tick: before each one `at(n)` says what the loop does.
struct Script {
  StandingDevice device;
  SharedBoard* between;
  std::function<void(int)> at;
  std::vector<Vec3>* forces;
  int tick = 0;
  ProbeSample read() noexcept {
    at(++tick);
    return device.read();
  }
  void apply(const Vec3& force, Seconds dt) noexcept {
    forces->push_back(force);
    device.apply(force, dt);
  }
  [[nodiscard]] Vec3 aim() const noexcept { return Vec3::Zero(); }
  [[nodiscard]] bool finished() const noexcept { return false; }
};

std::vector<Vec3> put_out_by(SharedBoard& between, const std::function<void(int)>& at,
                             const DeviceProcessSettings& settings = {}) {
  std::int64_t ns = 0;
  std::vector<Vec3> forces;
  Script script{{}, &between, at, &forces};
  run_device(between, script, PeriodicClock<SteppedTime>::build(1000.0, {&ns}).value(), settings);
  return forces;
}

TEST(Device, LetsGoAfterThreeSilentPeriodsAndWaitsUntilTheLoopHasSeenThat) {
  const auto between = board();
  SharedPort port(between);
  const Vec3 force(0.0, 2.0, 0.0);
  const std::vector<Vec3> forces = put_out_by(*between, [&](int tick) {
    if (tick <= 10) port.write(force);
    // Silent from 10 to 20. Then the loop wakes up and sends what it had in hand, before it reads again.
    if (tick == 20) port.write(force);
    if (tick > 21 && tick <= 30) {
      EXPECT_EQ(port.read().released, 1u);
      port.write(force);
    }
    if (tick == 31) between->close();
  });
  ASSERT_EQ(forces.size(), 32u);
  // The write after tick n is put out at tick n + 1, index n.
  for (std::size_t i = 1; i <= 10; ++i) EXPECT_EQ(forces[i], force) << i;
  EXPECT_EQ(forces[11], force) << "one silent period";
  EXPECT_EQ(forces[12], force) << "two";
  for (std::size_t i = 13; i <= 21; ++i) EXPECT_TRUE(forces[i].isZero(0.0)) << i;
  for (std::size_t i = 22; i <= 30; ++i) EXPECT_EQ(forces[i], force) << i;
  EXPECT_TRUE(forces[31].isZero(0.0)) << "closed";
}

TEST(Device, PutsOutNothingWhileItIsHalted) {
  const auto between = board();
  SharedPort port(between);
  const Vec3 force(1.0, 0.0, 0.0);
  const std::vector<Vec3> forces = put_out_by(*between, [&](int tick) {
    if (tick == 5) between->halt();
    if (tick == 10) between->resume();
    if (tick >= 15) static_cast<void>(port.read());
    if (tick == 20) between->close();
    port.write(force);
  });
  ASSERT_EQ(forces.size(), 21u);
  for (std::size_t i = 1; i <= 4; ++i) EXPECT_EQ(forces[i], force) << i;
  for (std::size_t i = 5; i <= 14; ++i)
    EXPECT_TRUE(forces[i].isZero(0.0)) << "halted, or the loop has not seen it: " << i;
  for (std::size_t i = 15; i <= 19; ++i) EXPECT_EQ(forces[i], force) << i;
}

TEST(Device, EndsWhenTheLoopHasBeenSilentForLong) {
  const auto between = board();
  SharedPort port(between);
  DeviceProcessSettings settings;
  settings.leaves_after = Seconds(0.1);
  const std::vector<Vec3> forces = put_out_by(
      *between,
      [&](int tick) {
        if (tick <= 50) port.write(Vec3::UnitX());
      },
      settings);
  EXPECT_NEAR(static_cast<double>(forces.size()), 151.0, 2.0);
}

TEST(PortDevice, CountsAsLostWhenItTellsNothingNew) {
  const auto between = board();
  PortDevice<SharedPort> device(SharedPort(between), Seconds(0.0105));
  PortReading told;
  const Seconds dt(0.001);
  for (int i = 0; i < 50; ++i) {
    ++told.beat;
    told.probe.pose.position = Vec3(i, 0.0, 0.0);
    between->tell(told);
    EXPECT_EQ(device.read().pose.position.x(), i);
    EXPECT_FALSE(device.lost());
    device.apply(Vec3::Zero(), dt);
  }
  // It repeats itself, and once tells something older again.
  for (int i = 0; i < 10; ++i) {
    if (i == 5) {
      PortReading older = told;
      --older.beat;
      older.probe.pose.position.setZero();
      between->tell(older);
    }
    EXPECT_EQ(device.read().pose.position.x(), 49.0);
    EXPECT_FALSE(device.lost()) << i;
    device.apply(Vec3::Zero(), dt);
  }
  device.read();
  EXPECT_TRUE(device.lost());
  told.beat += 1;
  between->tell(told);
  device.read();
  EXPECT_FALSE(device.lost()) << "it is there again";
  told.finished = true;
  told.beat += 1;
  between->tell(told);
  for (int i = 0; i < 100; ++i) {
    device.read();
    device.apply(Vec3::Zero(), dt);
  }
  EXPECT_TRUE(device.finished());
  EXPECT_FALSE(device.lost()) << "one that has finished is silent";
}

TEST(DeviceProcess, MovesByItsOwnClockAndEndsWhenItIsTold) {
  const auto between = board();
  pid_t pid = -1;
  {
    auto process = DeviceProcess::start(between, StandingDevice{}, test::plain_device(2000.0));
    ASSERT_TRUE(process) << process.error().message();
    pid = (*process)->pid();
    ASSERT_NE(pid, ::getpid());
    const std::uint64_t before = between->read().value_or(PortReading{}).beat;
    EXPECT_TRUE(comes([&] { return between->read().value_or(PortReading{}).beat > before + 50; }));
    EXPECT_EQ(::kill(pid, 0), 0);
  }
  EXPECT_EQ(::kill(pid, 0), -1) << "it is gone, and was waited for";
}

TEST(DeviceProcess, RefusesWhatCannotRun) {
  const auto place = [](const DeviceProcessSettings& settings) {
    return DeviceProcess::start(board(), StandingDevice{}, settings).error().place;
  };
  EXPECT_EQ(place({.rate = 10.0}), "rate");
  EXPECT_EQ(place({.loop_rate = 1e6}), "loop_rate");
  EXPECT_EQ(place({.silent_periods = 0}), "silent_periods");
  EXPECT_EQ(place({.leaves_after = Seconds(0.0)}), "leaves_after");
}

}  // namespace
}  // namespace asperity::port_test
