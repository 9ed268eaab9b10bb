#pragma once

#include <cstdint>

#include "asperity/core/progress.h"

namespace asperity {

/// What `warm_memory` went over.
struct WarmedMemory {
  std::uint64_t pages = 0;  ///< pages read
  std::uint64_t bytes = 0;  ///< their size together
};

/// Reads one byte of every page that the process has in memory: its data and its code.
///
/// The first access to a page from a loop costs far more than the next ones, although the page has long been written:
/// address translations are missing, on a virtual machine several microseconds a page, and a long slip looks at a
/// hundred pages that no tick has seen before. Called when the scene has been built and before the first tick, on the
/// loop's own thread, this moves that time out of the ticks. Pages that are reserved and were never written stay so:
/// nothing is allocated for them. No other thread may return memory to the system meanwhile: it is for a program whose
/// other threads have not begun or wait.
/// Where the system does not tell a process about its own memory (/proc is absent), no page is read. [build]
WarmedMemory warm_memory(const Progress& progress = {});

}  // namespace asperity
