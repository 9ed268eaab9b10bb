#pragma once
// What tests of a live loop share: something to touch, a device that stands in it, and who keeps the ticks.

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include "asperity/device/shared_board.h"
#include "asperity/servo/device_process.h"
#include "asperity/servo/servo_thread.h"

namespace asperity::test {

inline void sleep_for_ms(int ms) {
  std::this_thread::sleep_for(std::chrono::milliseconds(ms));
}
/// Whether `holds()` comes true before `ms` are over.
template <class Holds>
bool comes(Holds&& holds, int ms = 5000) {
  for (int i = 0; i < ms; ++i) {
    if (holds()) return true;
    sleep_for_ms(1);
  }
  return holds();
}

/// A device that does not move.
struct StandingDevice {
  ProbeSample sample;
  Seconds time{0.0};
  ProbeSample read() noexcept {
    sample.time = time;
    return sample;
  }
  void apply(const Vec3&, Seconds dt) noexcept { time += dt; }
  [[nodiscard]] Vec3 aim() const noexcept { return sample.pose.position; }
  [[nodiscard]] bool finished() const noexcept { return false; }
};

/// Pushes up by so much; a test changes what it does.
struct Pushing {
  double newtons = 2.0;
  bool not_a_number = false;
  int takes_ms = 0;       ///< each tick
  bool for_ever = false;  ///< until `go_on` is true
  std::shared_ptr<std::atomic<bool>> go_on = std::make_shared<std::atomic<bool>>(false);
  std::uint64_t number = 0;
};

/// Free at its first tick, so that the safety stage lets forces through.
struct Push {
  bool begun = false;
  ForceSample operator()(const Pushing& felt, const ProbeSample&, Seconds) noexcept {
    ForceSample sample;
    if (!std::exchange(begun, true)) return sample;
    if (felt.takes_ms > 0) sleep_for_ms(felt.takes_ms);
    while (felt.for_ever && !felt.go_on->load()) sleep_for_ms(1);
    sample.wrench.force = Vec3(0.0, felt.not_a_number ? std::nan("") : felt.newtons, 0.0);
    sample.flags.set(TickFlag::contact);
    return sample;
  }
};

/// What the loop did, to be looked at once it has ended.
struct Kept {
  struct Tick {
    double dt = 0.0;
    Vec3 commanded = Vec3::Zero();
    TickNotes notes;
    Fault fault = Fault::none;
  };
  std::vector<Tick> ticks;
  std::atomic<int> fault = 0;     ///< to be looked at while it runs
  std::atomic<double> force = 0;  ///< N, likewise
};
struct Keep {
  std::shared_ptr<Kept> kept;
  void operator()(const LiveTick<Pushing, Push>& tick) const noexcept {
    if (kept->ticks.size() < kept->ticks.capacity())
      kept->ticks.push_back({tick.record.dt.count(), tick.record.commanded, tick.notes, tick.safety.fault()});
    kept->fault.store(static_cast<int>(tick.safety.fault()));
    kept->force.store(tick.record.commanded.norm());
  }
};

inline std::shared_ptr<Kept> room_for_ticks() {
  auto kept = std::make_shared<Kept>();
  kept->ticks.reserve(200'000);
  return kept;
}

/// As a hand is given it: faults stay.
inline ServoSettings for_a_hand(double rate = 1000.0) {
  ServoSettings settings;
  settings.rate = rate;
  settings.realtime = {.priority = 0, .lock_memory = false, .cpu = -1};
  settings.safety = {.max_force = 3.0, .slew_limit = 1500.0};
  settings.safety.latches = true;
  settings.safety.longest_tick = Seconds(0.05);
  return settings;
}

inline DeviceProcessSettings plain_device(double rate = 1000.0) {
  DeviceProcessSettings settings;
  settings.rate = rate;
  settings.realtime = {.priority = 0, .lock_memory = false, .cpu = -1};
  return settings;
}

/// Device ticks, from `from` on, in which something was put out.
inline std::size_t ticks_with_force(const std::vector<PutOut>& all, std::int64_t from) {
  std::size_t count = 0;
  for (const PutOut& put : all) {
    if (put.time >= from && (put.force[0] != 0.0 || put.force[1] != 0.0 || put.force[2] != 0.0)) ++count;
  }
  return count;
}

}  // namespace asperity::test
