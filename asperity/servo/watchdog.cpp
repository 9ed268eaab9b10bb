#include "asperity/servo/watchdog.h"

#include <chrono>
#include <utility>

namespace asperity {

void Watchdog::start(Seconds longest, std::function<void()> on_stall) {
  stop();
  on_stall_ = std::move(on_stall);
  stopping_.store(false, std::memory_order_relaxed);
  thread_ = std::thread([this, longest] { look(longest); });
}

void Watchdog::stop() {
  stopping_.store(true, std::memory_order_relaxed);
  if (thread_.joinable()) thread_.join();
}

void Watchdog::look(Seconds longest) {
  using Clock = std::chrono::steady_clock;
  std::uint64_t seen = 0;
  Clock::time_point since = Clock::now();
  bool told = false;
  while (!stopping_.load(std::memory_order_relaxed)) {
    std::this_thread::sleep_for(0.25 * longest);
    const std::uint64_t turn = turns_.load(std::memory_order_relaxed);
    const Clock::time_point now = Clock::now();
    if (turn != seen || turn % 2 == 0) {
      seen = turn;
      since = now;
      told = false;
    } else if (!told && now - since > longest) {
      told = true;
      stalled_.store(true, std::memory_order_release);
      if (on_stall_) on_stall_();
    }
  }
}

}  // namespace asperity
