#pragma once
// The loop on a thread of its own.

#include <atomic>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "asperity/servo/loop_clock.h"
#include "asperity/servo/mailbox.h"
#include "asperity/servo/realtime.h"
#include "asperity/servo/session.h"
#include "asperity/servo/warm_memory.h"

namespace asperity {

/// How a loop runs.
struct ServoSettings {
  double rate = 1000.0;  ///< Hz, 500 to 40000
  RealtimeSettings realtime;
  SafetySettings safety;
  std::uint64_t max_ticks = UINT64_MAX;  ///< it ends by itself then, or with its device, ramped down as by stop()
};

/// Touches what it is given, tick by tick, until it is stopped. `Felt` is what is touched (a Scene) and comes by a
/// mailbox: latest wins. `Step(const Felt&, const ProbeSample&, Seconds) -> ForceSample` holds the state and its
/// caches; `Record(const TraceRecord&)` gets every tick, on the servo thread, and must be as quick.
template <class Felt, class Step, Device D, class Record>
class ServoThread {
 public:
  /// Starts at once. What the system refuses is told by grants(), not an error. Errors: bad_value (rate, safety,
  /// real-time settings). [build]
  static Result<std::unique_ptr<ServoThread>> start(std::shared_ptr<const Felt> felt, Step step, D device,
                                                    Record record, const ServoSettings& settings) {
    ASPERITY_TRY(PeriodicClock<> clock, PeriodicClock<>::build(settings.rate));
    ASPERITY_TRY(SafetyStage safety, SafetyStage::build(settings.safety));
    std::unique_ptr<ServoThread> servo(
        new ServoThread(std::move(step), std::move(device), std::move(record), std::move(safety)));
    servo->coming_.put(std::move(felt));
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
    return summary_;
  }
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

  void run(PeriodicClock<> clock, const ServoSettings& settings) {
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

  /// [servo]
  void tick_on(PeriodicClock<>& clock, const ServoSettings& settings) noexcept {
    Endless endless{device_};
    const Felt* felt = nullptr;
    std::uint64_t ticks = 0;
    bool ends = false;
    const auto step = [&](const ProbeSample& probe, Seconds dt) noexcept {
      if (const Felt* next = coming_.take()) felt = next;
      ends = ends || stopping_.load(std::memory_order_relaxed) || ++ticks > settings.max_ticks || device_.finished();
      return ends ? ForceSample{} : step_(*felt, probe, dt);
    };
    // Nothing is left in the hand: only then it ends.
    const auto record = [&](const TraceRecord& tick) noexcept {
      record_(tick);
      return !(ends && tick.commanded.isZero());
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
  std::vector<RealtimeGrant> grants_;
  std::optional<Error> refused_;
  std::atomic<bool> begun_ = false;
  std::atomic<bool> stopping_ = false;
  std::atomic<bool> ended_ = false;
  std::thread thread_;
};

}  // namespace asperity
