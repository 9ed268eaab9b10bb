#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>

#include "asperity/core/units.h"

namespace asperity {

/// A thread that sees whether another one comes back from what it does, each time. What that one spends on it are two
/// writes.
class Watchdog {
 public:
  Watchdog() = default;
  ~Watchdog() { stop(); }
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  /// Begins to look, every quarter of `longest` (s, above 0). `on_stall` is called once for each stay that lasts longer
  /// than that, on the watchdog's thread. [build]
  void start(Seconds longest, std::function<void()> on_stall);
  /// [build]
  void stop();

  /// [servo]
  void enter() noexcept { turns_.store(++turn_, std::memory_order_relaxed); }
  void leave() noexcept { turns_.store(++turn_, std::memory_order_relaxed); }
  /// Whether it has been called since the last time this was asked. [servo]
  bool take_stalled() noexcept {
    return stalled_.load(std::memory_order_relaxed) && stalled_.exchange(false, std::memory_order_acquire);
  }

 private:
  void look(Seconds longest);

  std::uint64_t turn_ = 0;  ///< the watched thread's: odd while it is within
  std::atomic<std::uint64_t> turns_ = 0;
  std::atomic<bool> stalled_ = false;
  std::atomic<bool> stopping_ = false;
  std::function<void()> on_stall_;
  std::thread thread_;
};

}  // namespace asperity
