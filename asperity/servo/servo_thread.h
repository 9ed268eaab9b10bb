#pragma once
// The loop on a thread of its own.

#include <atomic>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "asperity/servo/loop_clock.h"
#include "asperity/servo/mailbox.h"
#include "asperity/servo/realtime.h"
#include "asperity/servo/session.h"
#include "asperity/servo/warm_memory.h"
#include "asperity/servo/watchdog.h"

namespace asperity {

/// How a loop runs.
struct ServoSettings {
  double rate = 1000.0;  ///< Hz, 500 to 40000
  RealtimeSettings realtime;
  SafetySettings safety;
  std::uint64_t max_ticks = UINT64_MAX;  ///< it ends by itself then, or with its device, ramped down as by stop()
  /// Above 0; a step that takes longer: Fault::stalled, and a device that can be halted is, while it lasts.
  Seconds longest_step{infinity};
};

/// What has come up since the tick before, in the order in which a loop goes by it.
struct TickNotes {
  bool acknowledged = false;   ///< the fault was
  Fault raised = Fault::none;  ///< by the loop: stalled, device_lost, clock_stopped
  bool released = false;       ///< the device had let go by itself
  bool taken = false;          ///< something else is touched from this tick on
  bool withheld = false;       ///< the session ends: no force from this tick on
};

/// A tick of a live loop, with all that it has led to.
template <class Felt, class Step>
struct LiveTick {
  const TraceRecord& record;
  const TickNotes& notes;
  const Felt& felt;
  const Step& step;           ///< after the tick
  const SafetyStage& safety;  ///< likewise
};

/// Touches what it is given, tick by tick, until it is stopped. `Felt` is what is touched (a Scene) and comes by a
/// mailbox: latest wins. `Step(const Felt&, const ProbeSample&, Seconds) -> ForceSample` holds the state and its
/// caches; `Record(const TraceRecord&)` or `Record(const LiveTick<Felt, Step>&)` gets every tick, on the servo thread,
/// and must be as quick. A device that can be lost, released or halted (PortDevice) is asked. `Time` is what the clock
/// goes by.
template <class Felt, class Step, Device D, class Record, class Time = SteadyTime>
class ServoThread {
 public:
  /// Starts at once. What the system refuses is told by grants(), not an error. Errors: bad_value (rate, longest_step,
  /// safety, real-time settings). [build]
  static Result<std::unique_ptr<ServoThread>> start(std::shared_ptr<const Felt> felt, Step step, D device,
                                                    Record record, const ServoSettings& settings, Time time = {}) {
    ASPERITY_TRY(PeriodicClock<Time> clock, PeriodicClock<Time>::build(settings.rate, std::move(time)));
    if (!(settings.longest_step.count() > 0.0))
      return bad_value("is not above 0", "longest_step", "a time above 0 (s)");
    ASPERITY_TRY(SafetyStage safety, SafetyStage::build(settings.safety));
    std::unique_ptr<ServoThread> servo(
        new ServoThread(std::move(step), std::move(device), std::move(record), std::move(safety)));
    servo->coming_.put(std::move(felt));
    servo->watch(settings.longest_step);
    servo->thread_ = std::thread([self = servo.get(), clock, settings] { self->run(clock, settings); });
    // What it was granted is known before its first tick.
    servo->begun_.wait(false);
    if (servo->refused_) return *servo->refused_;
    return servo;
  }
  ServoThread(const ServoThread&) = delete;
  ServoThread& operator=(const ServoThread&) = delete;
  /// Ramps down first. [build]
  ~ServoThread() { stop(); }

  /// What is touched from the next tick on. [build]
  void put(std::shared_ptr<const Felt> felt) { coming_.put(std::move(felt)); }
  /// Ramps the force to zero at the slew limit, ends the loop and tells what it did. [build]
  SessionSummary stop() {
    stopping_.store(true, std::memory_order_relaxed);
    if (thread_.joinable()) thread_.join();
    watchdog_.stop();
    return summary_;
  }
  /// Whoever holds the device has seen the fault: force is let in again. [any]
  void acknowledge() noexcept { acknowledged_.store(true, std::memory_order_relaxed); }
  /// Whether it has ended: it was stopped, or has done all of its ticks. [any]
  [[nodiscard]] bool ended() const noexcept { return ended_.load(std::memory_order_acquire); }
  /// [any]
  [[nodiscard]] const LoopMeters& meters() const noexcept { return meters_; }
  [[nodiscard]] const std::vector<RealtimeGrant>& grants() const noexcept { return grants_; }
  [[nodiscard]] MailboxCount handed_over() const noexcept { return coming_.count(); }
  /// The device, once the loop has ended. [build]
  [[nodiscard]] const D& device() const noexcept { return device_; }

 private:
  ServoThread(Step step, D device, Record record, SafetyStage safety)
      : step_(std::move(step)), device_(std::move(device)), record_(std::move(record)), safety_(std::move(safety)) {}

  static constexpr int most_still = 3;  ///< ticks without a length, one after the other
  static constexpr bool can_be_halted = requires(D & device) { device.halt(), device.resume(); };
  static constexpr bool can_be_lost = requires(D & device) { device.lost(); };
  static constexpr bool can_release = requires(D & device) { device.take_released(); };

  void watch(Seconds longest_step) {
    if (std::isinf(longest_step.count())) return;
    watchdog_.start(longest_step, [this] {
      if constexpr (can_be_halted) device_.halt();
    });
  }

  void run(PeriodicClock<Time> clock, const ServoSettings& settings) {
    Result<std::vector<RealtimeGrant>> asked = become_realtime(settings.realtime);
    if (asked) {
      grants_ = std::move(*asked);
      warm_memory();
    } else {
      refused_ = asked.error();
    }
    const bool go = asked.ok();
    begun_.store(true, std::memory_order_release);
    begun_.notify_one();
    if (go) tick_on(clock, settings);
    ended_.store(true, std::memory_order_release);
  }

  /// What the loop sees: a device that never has finished, so that the force is ramped down after its end.
  struct Endless {
    D& device;
    ProbeSample read() noexcept { return device.read(); }
    void apply(const Vec3& force, Seconds dt) noexcept { device.apply(force, dt); }
    [[nodiscard]] Vec3 aim() const noexcept { return std::as_const(device).aim(); }
    [[nodiscard]] static bool finished() noexcept { return false; }
  };

  /// What the loop itself has to tell before a tick. [servo]
  void look_around(Seconds dt) noexcept {
    if (acknowledged_.load(std::memory_order_relaxed) && acknowledged_.exchange(false, std::memory_order_relaxed)) {
      if constexpr (can_be_halted) device_.resume();
      safety_.acknowledge();
      notes_.acknowledged = true;
      still_ = 0;
    }
    if (watchdog_.take_stalled()) raise(Fault::stalled);
    if constexpr (can_be_lost) {
      if (device_.lost()) raise(Fault::device_lost);
    }
    if constexpr (can_release) {
      notes_.released = device_.take_released();
      if (notes_.released) safety_.released();
    }
    // A clock that was set back gives a tick or two without a length; one that stands gives nothing else, and no force
    // would ever be ramped down.
    still_ = dt.count() > 0.0 ? 0 : still_ + 1;
    if (still_ > most_still) {
      raise(Fault::clock_stopped);
      if constexpr (can_be_halted) device_.halt();
    }
  }
  void raise(Fault fault) noexcept {
    if (safety_.fault() == Fault::none) notes_.raised = fault;
    safety_.raise(fault);
  }

  /// [servo]
  void tick_on(PeriodicClock<Time>& clock, const ServoSettings& settings) noexcept {
    Endless endless{device_};
    const Felt* felt = nullptr;
    std::uint64_t ticks = 0;
    bool ends = false;
    const auto step = [&](const ProbeSample& probe, Seconds dt) noexcept {
      notes_ = TickNotes{};
      look_around(dt);
      if (const Felt* next = coming_.take()) {
        felt = next;
        notes_.taken = true;
      }
      if (!ends && (stopping_.load(std::memory_order_relaxed) || ++ticks > settings.max_ticks || device_.finished())) {
        ends = notes_.withheld = true;
        safety_.withhold();
      }
      watchdog_.enter();
      const ForceSample answer = step_(*felt, probe, dt);
      watchdog_.leave();
      return answer;
    };
    // Nothing is left in the hand: only then it ends.
    const auto record = [&](const TraceRecord& tick) noexcept {
      if constexpr (std::is_invocable_v<Record&, const LiveTick<Felt, Step>&>) {
        record_(LiveTick<Felt, Step>{tick, notes_, *felt, step_, safety_});
      } else {
        record_(tick);
      }
      return !(ends && (tick.commanded.isZero() || still_ > most_still));
    };
    summary_ = run_loop(clock, step, endless, safety_, LoopSettings{.max_ticks = UINT64_MAX}, record, {}, &meters_);
  }

  Step step_;
  D device_;
  Record record_;
  SafetyStage safety_;
  Mailbox<Felt> coming_;
  LoopMeters meters_;
  SessionSummary summary_;
  TickNotes notes_;
  int still_ = 0;
  std::vector<RealtimeGrant> grants_;
  std::optional<Error> refused_;
  std::atomic<bool> begun_ = false;
  std::atomic<bool> stopping_ = false;
  std::atomic<bool> ended_ = false;
  std::atomic<bool> acknowledged_ = false;
  Watchdog watchdog_;
  std::thread thread_;
};

}  // namespace asperity
