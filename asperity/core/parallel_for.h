#pragma once
// The one way in which building is shared out over threads. Never from the servo thread: threads are started, and
// memory taken.
//
// Plain std::thread serves: these loops run for milliseconds to minutes, starting the threads costs some tens of
// microseconds, and their items are even enough for shares that are taken in turn. A task scheduler (TBB) would add a
// dependency for every user and a pool of threads that lives on beside the servo thread.

#include <cstddef>
#include <memory>
#include <string_view>
#include <type_traits>

#include "asperity/core/progress.h"

namespace asperity {

/// How a loop is shared out.
struct ParallelSettings {
  std::size_t grain = 1;               ///< items that a thread takes at a time; loops of no more are not shared; 0 is 1
  unsigned threads = 0;                ///< at most so many, the caller's included; 0: one a processor
  const Progress* progress = nullptr;  ///< asked in the calling thread alone, before each share that it takes itself
  std::string_view what = {};          ///< what it is told is being done
  double from = 0.0;                   ///< what it is told at the first item
  double to = 1.0;                     ///< and what would be told after the last; in between in proportion
};

/// How many threads parallel_for uses for a loop of `count` items, the caller's included: bodies are given a worker
/// below it. At least 1; 1 within a body of another loop that is shared. [build]
unsigned parallel_workers(std::size_t count, const ParallelSettings& settings) noexcept;

namespace detail {
/// One share of a loop: items [first, last) by one worker.
using ParallelShare = void (*)(const void* body, std::size_t first, std::size_t last, unsigned worker);
/// What parallel_for does, for a body of any type. [build]
void run_parallel(std::size_t count, const ParallelSettings& settings, const void* body, ParallelShare share);
}  // namespace detail

/// Calls body(i), or body(i, worker), once for every i in 0 … count - 1, on all cores, and returns when all is done.
///
/// Bodies must not depend on each other or on their order; then results do not depend on the number of threads. What is
/// to be reused from item to item (hints, scratch) is the worker's: no two bodies with the same worker run at the same
/// time, the caller's thread is worker 0. Items are shared out in ascending order.
/// Within a body of a loop that several threads share another parallel_for stays in its own thread. Where the system
/// refuses threads, fewer do the work. Exceptions: of a body or of `progress`. No further shares are begun, all threads
/// are waited for, and the one that a plain loop would have thrown first goes to the caller. There is no other way to
/// stop a loop. [build]
template <class Body>
void parallel_for(std::size_t count, const ParallelSettings& settings, const Body& body) {
  detail::run_parallel(count, settings, std::addressof(body),
                       [](const void* erased, std::size_t first, std::size_t last, unsigned worker) {
                         const Body& call = *static_cast<const Body*>(erased);
                         for (std::size_t i = first; i < last; ++i) {
                           if constexpr (std::is_invocable_v<const Body&, std::size_t, unsigned>) {
                             call(i, worker);
                           } else {
                             call(i);
                           }
                         }
                       });
}

}  // namespace asperity
