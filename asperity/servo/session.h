#pragma once
// The loop: read, step, safety, record, apply. Offline and in real time it is the same, with another clock.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <type_traits>
#include <utility>

#include "asperity/core/progress.h"
#include "asperity/core/trace_record.h"
#include "asperity/device/device.h"
#include "asperity/servo/loop_clock.h"
#include "asperity/servo/safety_stage.h"
#include "asperity/servo/time_histogram.h"

namespace asperity {

/// Length of a loop.
struct LoopSettings {
  std::uint64_t max_ticks = 10'000'000;    ///< the loop ends here, or earlier when the device has finished
  std::uint64_t progress_interval = 1000;  ///< ticks between two calls of the progress function, 1 or more
  std::uint64_t expected_ticks = 0;        ///< for the progress fraction only; 0: `max_ticks`
};

/// The same with the length of its ticks, where no clock tells it.
struct SessionSettings : LoopSettings {
  SessionSettings() = default;
  SessionSettings(Seconds of, const LoopSettings& length = {}) : LoopSettings(length), dt(of) {}  // NOLINT: may convert
  Seconds dt{0.001};                                                                              ///< above 0
};

/// What a session did, in brief.
struct SessionSummary {
  std::uint64_t ticks = 0;
  bool stopped = false;       ///< the recorder asked to stop
  Flags flags;                ///< every flag that any tick had
  double max_force = 0.0;     ///< largest commanded force (N)
  double step_seconds = 0.0;  ///< time spent in `step`, all ticks; a measurement
  std::uint64_t missed = 0;   ///< ticks that were due while another one took too long, and are left out
};

/// What a loop's ticks were like in time, to be read while it runs.
struct LoopMeters {
  TimeHistogram period;    ///< from a tick to the next
  TimeHistogram lateness;  ///< from when a tick was due to when it began
  TimeHistogram step;      ///< that `step` took
};

/// Ticks of length `dt` that cover `duration`, its end included. [any]
inline std::uint64_t session_ticks(Seconds duration, Seconds dt) {
  return static_cast<std::uint64_t>(std::floor(std::max(0.0, duration.count() / dt.count()) * (1.0 + 1e-12))) + 1;
}

namespace detail {

/// Calls `record`; false when it answered false. [servo]
template <class Record>
bool keep_going(Record& record, const TraceRecord& tick) {
  if constexpr (std::is_convertible_v<std::invoke_result_t<Record&, const TraceRecord&>, bool>) {
    return record(tick);
  } else {
    record(tick);
    return true;
  }
}

/// Runs `step` and puts its answer and the time it took into `tick`. [servo]
template <class Step>
void timed_step(Step& step, TraceRecord& tick) {
  const auto begin = std::chrono::steady_clock::now();
  tick.rendered = step(std::as_const(tick.probe), tick.dt);
  tick.update_seconds = Seconds(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace detail

/// Runs ticks until `device` has finished or `max_ticks` are done: wait for the clock, read, step, safety, record,
/// apply.
///
/// `step(const ProbeSample&, Seconds) -> ForceSample` is the renderer with its scene and state bound to it; it is
/// timed. Each tick's dt is what the clock says has passed. `record(const TraceRecord&)` gets every tick, before the
/// force is applied; when it returns bool, false stops the session. The recorded flags are those of `step` and of the
/// safety stage together. The loop itself does not allocate; neither does a session as long as `step`, `record` and
/// `progress` do not. `meters`: may be nullptr. [servo]
template <LoopClock Clock, class Step, Device D, class Record>
SessionSummary run_loop(Clock& clock, Step&& step, D& device, SafetyStage& safety, const LoopSettings& settings,
                        Record&& record, const Progress& progress = {}, LoopMeters* meters = nullptr) {
  SessionSummary summary;
  const std::uint64_t expected = settings.expected_ticks > 0 ? settings.expected_ticks : settings.max_ticks;
  const std::uint64_t interval = std::max<std::uint64_t>(1, settings.progress_interval);
  TraceRecord tick;
  while (summary.ticks < settings.max_ticks && !device.finished() && !summary.stopped) {
    const LoopTick due = clock.wait();
    tick.tick = summary.ticks;
    tick.dt = due.dt;
    tick.probe = device.read();
    tick.hand = std::as_const(device).aim();
    detail::timed_step(step, tick);
    const SafetyOutput output = safety.apply(tick.rendered, tick.probe, tick.dt);
    tick.commanded = output.force;
    tick.rendered.flags = Flags::from_bits(tick.rendered.flags.bits() | output.flags.bits());
    summary.stopped = !detail::keep_going(record, tick);
    device.apply(output.force, tick.dt);
    summary.flags = Flags::from_bits(summary.flags.bits() | tick.rendered.flags.bits());
    summary.max_force = std::max(summary.max_force, output.force.norm());
    summary.step_seconds += tick.update_seconds;
    summary.missed += due.missed;
    if (meters != nullptr) {
      if (summary.ticks > 0) meters->period.add(due.dt.count());
      meters->lateness.add(due.lateness);
      meters->step.add(tick.update_seconds);
    }
    ++summary.ticks;
    if (progress && summary.ticks % interval == 0) {
      progress("touching", std::min(1.0, static_cast<double>(summary.ticks) / static_cast<double>(expected)));
    }
  }
  if (progress) progress("touching", 1.0);
  return summary;
}

/// The same as fast as the machine goes, every tick of length `settings.dt`. [servo]
template <class Step, Device D, class Record>
SessionSummary run_session(Step&& step, D& device, SafetyStage& safety, const SessionSettings& settings,
                           Record&& record, const Progress& progress = {}) {
  OfflineClock clock(settings.dt);
  return run_loop(clock, step, device, safety, settings, record, progress);
}

}  // namespace asperity
