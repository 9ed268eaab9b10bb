#pragma once
// What a thread asks of the system so that its ticks are not late.

#include <string>
#include <vector>

#include "asperity/core/result.h"

namespace asperity {

/// What is asked for. What is refused is told, and the loop goes on without.
struct RealtimeSettings {
  int priority = 80;        ///< of SCHED_FIFO, 1 to 99; 0: the thread stays as it is
  bool lock_memory = true;  ///< no page of the process leaves memory
  int cpu = -1;             ///< the thread stays on this processor; -1: on any
};

/// One thing asked for: whether it was got, and where not why, and what to do about it.
struct RealtimeGrant {
  std::string asked;
  bool got = false;
  std::string why;     ///< empty where it was got
  std::string advice;  ///< what somebody at this machine can do; empty where it was got
};

/// Asks for all of it, for the calling thread and (memory) its process, and reaches a part of the stack as deep as a
/// tick goes, so that no tick meets its pages first. On the loop's own thread, before its first tick. Errors: bad_value
/// (priority, cpu). [build]
Result<std::vector<RealtimeGrant>> become_realtime(const RealtimeSettings& settings);

}  // namespace asperity
