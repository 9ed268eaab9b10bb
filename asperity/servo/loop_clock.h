#pragma once
// What tells a loop when its next tick is: as fast as the machine goes, or by the clock on the wall.

#include <cerrno>
#include <concepts>
#include <cstdint>
#include <ctime>

#include "asperity/core/result.h"
#include "asperity/core/samples.h"

namespace asperity {

/// One tick of a loop.
struct LoopTick {
  Seconds dt{0.0};           ///< since the tick before, as it was; of the first tick the period
  double lateness = 0.0;     ///< s: woken so long after it was due; 0 where nothing is waited for
  std::uint64_t missed = 0;  ///< ticks that were due in between and are left out
};

/// Waits for the next tick. [servo]
template <class C>
concept LoopClock = requires(C& clock) {
  { clock.wait() }
  noexcept->std::same_as<LoopTick>;
};

/// Waits for nothing: each tick is of the same length.
class OfflineClock {
 public:
  explicit OfflineClock(Seconds dt) noexcept : dt_(dt) {}
  LoopTick wait() const noexcept { return {dt_}; }

 private:
  Seconds dt_;
};

/// The system's steady clock. [servo]
struct SteadyTime {
  /// ns, of no particular beginning.
  [[nodiscard]] static std::int64_t now() noexcept {
    timespec at{};
    clock_gettime(CLOCK_MONOTONIC, &at);
    return std::int64_t{at.tv_sec} * 1'000'000'000 + at.tv_nsec;
  }
  /// Returns at once where that is past; signals do not end it early.
  static void sleep_until(std::int64_t ns) noexcept {
    const timespec at{static_cast<time_t>(ns / 1'000'000'000), static_cast<long>(ns % 1'000'000'000)};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr) == EINTR) {
    }
  }
};

/// Errors: bad_value ("rate": 500 Hz to 40 kHz). [build]
Status check_loop_rate(double rate);

/// Ticks at whole periods from its first one. A late tick is told and its dt is what it was; those that were due in
/// the meantime are left out, never made up for in a burst: the next is due at the next whole period. A time that
/// stands still or goes back gives a dt of 0, one that leaps ahead a dt that the loop sees as it is.
template <class Time = SteadyTime>
class PeriodicClock {
 public:
  /// Errors: of check_loop_rate. [build]
  static Result<PeriodicClock> build(double rate, Time time = {}) {
    ASPERITY_CHECK(check_loop_rate(rate));
    return PeriodicClock(static_cast<std::int64_t>(1e9 / rate + 0.5), time);
  }

  LoopTick wait() noexcept {
    LoopTick tick;
    if (due_ == not_begun) {
      last_ = time_.now();
      due_ = last_ + period_;
      tick.dt = seconds(period_);
      return tick;
    }
    // A clock that was set back would be waited for until it has caught up.
    const std::int64_t before = time_.now();
    if (due_ - before > 2 * period_) due_ = before + period_;
    time_.sleep_until(due_);
    const std::int64_t now = time_.now();
    const std::int64_t late = now > due_ ? now - due_ : 0;
    tick.lateness = seconds(late).count();
    tick.missed = static_cast<std::uint64_t>(late / period_);
    tick.dt = seconds(now > last_ ? now - last_ : 0);
    last_ = now;
    due_ += period_ * (late / period_ + 1);
    return tick;
  }
  [[nodiscard]] Seconds period() const noexcept { return seconds(period_); }

 private:
  static constexpr std::int64_t not_begun = INT64_MIN;
  PeriodicClock(std::int64_t period, Time time) noexcept : period_(period), time_(time) {}
  static Seconds seconds(std::int64_t ns) noexcept { return Seconds(1e-9 * static_cast<double>(ns)); }

  std::int64_t period_;  ///< ns
  Time time_;
  std::int64_t due_ = not_begun;
  std::int64_t last_ = 0;
};

}  // namespace asperity
