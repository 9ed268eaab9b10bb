#include "asperity/core/parallel_for.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace asperity {

namespace {

/// Whether this thread is at a body of a loop that others share.
thread_local bool within_parallel_for = false;

/// Joins what was started, also where starting the next failed.
struct ParallelHelpers {
  std::vector<std::thread> threads;
  ParallelHelpers() = default;
  ParallelHelpers(const ParallelHelpers&) = delete;
  ParallelHelpers& operator=(const ParallelHelpers&) = delete;
  ~ParallelHelpers() {
    for (std::thread& thread : threads) thread.join();
  }
};

/// One loop while it runs.
class ParallelLoop {
 public:
  ParallelLoop(std::size_t count, const ParallelSettings& settings, const void* body, detail::ParallelShare share)
      : count_(count),
        grain_(std::max<std::size_t>(1, settings.grain)),
        settings_(settings),
        body_(body),
        share_(share) {}

  /// Takes shares until there are none left. `shared`: other threads may do so as well.
  void work(unsigned worker, bool shared) noexcept {
    const bool outer = within_parallel_for;
    within_parallel_for = outer || shared;
    std::size_t first = 0;
    while (!stopped_.load(std::memory_order_relaxed) && take(first)) {
      try {
        if (worker == 0) report(first);
        share_(body_, first, first + std::min(grain_, count_ - first), worker);
      } catch (...) {
        keep(first, std::current_exception());
      }
    }
    within_parallel_for = outer;
  }

  /// Throws what was kept. After all threads are through.
  void finish() const {
    if (thrown_) std::rethrow_exception(thrown_);
  }

 private:
  bool take(std::size_t& first) noexcept {
    // Not fetch_add: it could run over where `count` is near the largest number.
    first = next_.load(std::memory_order_relaxed);
    while (first < count_) {
      if (next_.compare_exchange_weak(first, first + std::min(grain_, count_ - first), std::memory_order_relaxed))
        return true;
    }
    return false;
  }

  void report(std::size_t first) const {
    if (settings_.progress == nullptr || !*settings_.progress) return;
    const double share = static_cast<double>(first) / static_cast<double>(count_);
    (*settings_.progress)(settings_.what, settings_.from + (settings_.to - settings_.from) * share);
  }

  /// Shares are begun in ascending order and those begun go on to their end: whatever is thrown before this one is
  /// thrown as well. The first of all is kept.
  void keep(std::size_t first, std::exception_ptr exception) noexcept {
    stopped_.store(true, std::memory_order_relaxed);
    const std::lock_guard lock(mutex_);
    if (thrown_ && thrown_at_ <= first) return;
    thrown_ = std::move(exception);
    thrown_at_ = first;
  }

  const std::size_t count_;
  const std::size_t grain_;
  const ParallelSettings& settings_;
  const void* body_;
  detail::ParallelShare share_;
  std::atomic<std::size_t> next_{0};
  std::atomic<bool> stopped_{false};
  std::mutex mutex_;
  std::exception_ptr thrown_;
  std::size_t thrown_at_ = 0;
};

}  // namespace

unsigned parallel_workers(std::size_t count, const ParallelSettings& settings) noexcept {
  if (within_parallel_for) return 1;
  const unsigned wanted = settings.threads != 0 ? settings.threads : std::max(1U, std::thread::hardware_concurrency());
  const std::size_t grain = std::max<std::size_t>(1, settings.grain);
  const std::size_t shares = count / grain + (count % grain != 0 ? 1 : 0);
  return static_cast<unsigned>(std::clamp<std::size_t>(shares, 1, wanted));
}

void detail::run_parallel(std::size_t count, const ParallelSettings& settings, const void* body, ParallelShare share) {
  if (count == 0) return;
  ParallelLoop loop(count, settings, body, share);
  {
    ParallelHelpers helpers;
    const unsigned workers = parallel_workers(count, settings);
    try {
      helpers.threads.reserve(workers - 1);
      for (unsigned worker = 1; worker < workers; ++worker)
        helpers.threads.emplace_back([&loop, worker] { loop.work(worker, true); });
    } catch (const std::exception&) {
      // No thread or no memory to be had: fewer threads do the same work.
    }
    loop.work(0, workers > 1);
  }
  loop.finish();
}

}  // namespace asperity
