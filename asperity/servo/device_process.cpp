#include "asperity/servo/device_process.h"

#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <ctime>

namespace asperity {
namespace {

void sleep_a_millisecond() {
  const timespec time{0, 1'000'000};
  ::nanosleep(&time, nullptr);
}

}  // namespace

Status DeviceProcess::check(const DeviceProcessSettings& settings) {
  ASPERITY_CHECK(check_loop_rate(settings.rate));
  if (Status status = check_loop_rate(settings.loop_rate); !status) {
    Error error = std::move(status).error();
    error.place = "loop_rate";
    return error;
  }
  if (settings.silent_periods < 1) return bad_value("is 0", "silent_periods", "1 or more");
  const double leaves = settings.leaves_after.count();
  if (!(std::isfinite(leaves) && leaves > 0.0))
    return bad_value(fmt::format("is {}", leaves), "leaves_after", "a time above 0 (s)");
  return success();
}

bool DeviceProcess::split(pid_t& pid, const RealtimeSettings& realtime) {
  pid = ::fork();
  if (pid != 0) return false;
  // Whoever interrupts the program interrupts its loop: the device holds on until that has ramped down.
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) std::signal(number, SIG_IGN);
  ::prctl(PR_SET_NAME, "device");
  // What is refused is the loop's to tell: it asks for the same.
  static_cast<void>(become_realtime(realtime).ok());
  return true;
}

void DeviceProcess::leave() noexcept {
  ::_exit(0);
}

Status DeviceProcess::wait_for_first(SharedBoard& board) {
  for (int i = 0; i < 5000; ++i) {
    if (board.read().value_or(PortReading{}).beat > 0) return success();
    sleep_a_millisecond();
  }
  return Error{ErrorCode::mismatch, "has not told a sample within 5 s", {}, "device", "a device that answers"};
}

DeviceProcess::~DeviceProcess() {
  board_->close();
  for (int i = 0; i < 1000; ++i) {
    if (::waitpid(pid_, nullptr, WNOHANG) != 0) return;
    sleep_a_millisecond();
  }
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
}

}  // namespace asperity
