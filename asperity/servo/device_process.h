#pragma once
// The far side of a port: a simulated device with a clock of its own, in a process of its own.

#include <sys/types.h>

#include <memory>
#include <utility>

#include "asperity/core/result.h"
#include "asperity/device/device.h"
#include "asperity/device/shared_board.h"
#include "asperity/servo/loop_clock.h"
#include "asperity/servo/realtime.h"

namespace asperity {

/// How the far side runs.
struct DeviceProcessSettings {
  double rate = 1000.0;         ///< Hz, of its own clock, 500 to 40000
  double loop_rate = 1000.0;    ///< Hz, at which it expects to hear of the loop, 500 to 40000
  unsigned silent_periods = 3;  ///< of the loop's, 1 or more: after so many without a word it lets go of the force
  Seconds leaves_after{2.0};    ///< of silence, above 0, after which it ends
  RealtimeSettings realtime = {.priority = 70, .lock_memory = false, .cpu = -1};
};

/// Moves `device` by its own clock until the board is closed or the loop has been silent for long. The force is what
/// the loop has asked for, held; after `silent_periods` without a word, and while it is halted, it is zero, and what is
/// asked for counts again only once the loop has seen that the device had let go: a loop that wakes up never puts its
/// old force out at once. [servo]
template <Device D, class Time>
void run_device(SharedBoard& board, D& device, PeriodicClock<Time> clock, const DeviceProcessSettings& settings) {
  // A quarter of a period is left for clocks that do not beat together.
  const Seconds longest((settings.silent_periods - 0.25) / settings.loop_rate);
  PortReading told;
  SharedBoard::Asked asked;
  std::uint64_t heard = 0;
  Seconds silent{0.0};
  bool holds = false;
  for (bool goes_on = true; goes_on;) {
    const LoopTick tick = clock.wait();
    asked = board.asked().value_or(asked);
    const bool closed = board.closed();
    silent = asked.beat == heard ? silent + tick.dt : Seconds(0.0);
    heard = asked.beat;
    const bool lets_go = board.halted() || closed || silent > longest;
    if (lets_go && holds) ++told.released;
    const Vec3 force = lets_go || asked.released != told.released ? Vec3(Vec3::Zero()) : asked.force;
    holds = !force.isZero(0.0);
    device.apply(force, tick.dt);
    board.put_out({SteadyTime::now(), heard, {force.x(), force.y(), force.z()}, lets_go ? 1U : 0U});
    ++told.beat;
    told.probe = device.read();
    told.finished = std::as_const(device).finished();
    board.tell(told);
    goes_on = !closed && silent < settings.leaves_after;
  }
}

/// A device in a process of its own. It is told to end, and waited for, when this goes.
class DeviceProcess {
 public:
  /// Forks: to be called before other threads are started. Returns once the device has told its first sample. Errors:
  /// bad_value (rates, silent_periods, leaves_after), too_large (no process to be had), mismatch (it has not begun).
  /// [build]
  template <Device D>
  static Result<std::unique_ptr<DeviceProcess>> start(std::shared_ptr<SharedBoard> board, D device,
                                                      const DeviceProcessSettings& settings) {
    ASPERITY_CHECK(check(settings));
    ASPERITY_TRY(const PeriodicClock<> clock, PeriodicClock<>::build(settings.rate));
    return begin(
        board, [&] { run_device(*board, device, clock, settings); }, settings);
  }
  ~DeviceProcess();
  DeviceProcess(const DeviceProcess&) = delete;
  DeviceProcess& operator=(const DeviceProcess&) = delete;

  [[nodiscard]] pid_t pid() const noexcept { return pid_; }

  /// Errors: bad_value (rate, loop_rate, silent_periods, leaves_after). [build]
  static Status check(const DeviceProcessSettings& settings);

 private:
  DeviceProcess(std::shared_ptr<SharedBoard> board, pid_t pid) : board_(std::move(board)), pid_(pid) {}
  /// Forks. True in the child, which is to run and then to leave().
  static bool split(pid_t& pid, const RealtimeSettings& realtime);
  [[noreturn]] static void leave() noexcept;
  static Status wait_for_first(SharedBoard& board);

  template <class Run>
  static Result<std::unique_ptr<DeviceProcess>> begin(const std::shared_ptr<SharedBoard>& board, Run&& run,
                                                      const DeviceProcessSettings& settings) {
    pid_t pid = -1;
    if (split(pid, settings.realtime)) {
      run();
      leave();
    }
    if (pid < 0)
      return Error{ErrorCode::too_large, "no process is to be had", {}, "device", "a system with room for one"};
    std::unique_ptr<DeviceProcess> process(new DeviceProcess(board, pid));
    ASPERITY_CHECK(wait_for_first(*board));
    return process;
  }

  std::shared_ptr<SharedBoard> board_;
  pid_t pid_;
};

}  // namespace asperity
