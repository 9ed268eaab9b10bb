#include "asperity/servo/realtime.h"

#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace asperity {
namespace {

constexpr int highest_priority = 99;

RealtimeGrant refused(std::string asked, int error, std::string advice) {
  return {std::move(asked), false, std::strerror(error), std::move(advice)};
}

RealtimeGrant ask_for_priority(int priority) {
  std::string asked = fmt::format("real-time scheduling (SCHED_FIFO, priority {})", priority);
  sched_param parameter{};
  parameter.sched_priority = priority;
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter);
  if (error == 0) return {std::move(asked), true, {}, {}};
  return refused(std::move(asked), error,
                 "run as root, or let your user: a line \"@realtime - rtprio 99\" in /etc/security/limits.conf, then "
                 "log in again");
}

RealtimeGrant lock_memory() {
  std::string asked = "memory that stays in place (mlockall)";
  rlimit limit{};
  const bool unlimited = getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY;
  // Under a limit what is allocated later would fail.
  const int what = unlimited || geteuid() == 0 ? MCL_CURRENT | MCL_FUTURE : MCL_CURRENT;
  if (mlockall(what) == 0) return {std::move(asked), true, {}, {}};
  return refused(std::move(asked), errno,
                 "run as root, or let your user: a line \"@realtime - memlock unlimited\" in "
                 "/etc/security/limits.conf, then log in again");
}

RealtimeGrant stay_on(int cpu) {
  std::string asked = fmt::format("to stay on one processor (cpu {})", cpu);
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(static_cast<unsigned>(cpu), &set);
  const int error = pthread_setaffinity_np(pthread_self(), sizeof set, &set);
  if (error == 0) return {std::move(asked), true, {}, {}};
  return refused(std::move(asked), error, "name a processor that this process may use (taskset -p shows them)");
}

/// Sleeps end when they are due: by default a thread without real-time scheduling is woken up to 50 us later.
RealtimeGrant wake_at_once() {
  std::string asked = "sleeps that end on time (timer slack 1 ns)";
  if (prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL) == 0) return {std::move(asked), true, {}, {}};
  return refused(std::move(asked), errno, "use a kernel that knows PR_SET_TIMERSLACK (2.6.28 or later)");
}

[[gnu::noinline]] void reach_stack() {
  constexpr std::size_t deep = 256 * 1024;
  volatile char stack[deep];  // NOLINT: what it holds does not matter
  for (std::size_t i = 0; i < deep; i += 1024) stack[i] = static_cast<char>(stack[i] + 1);
}

}  // namespace

Result<std::vector<RealtimeGrant>> become_realtime(const RealtimeSettings& settings) {
  if (settings.priority < 0 || settings.priority > highest_priority)
    return bad_value(fmt::format("is {}", settings.priority), "priority", "1 to 99, or 0 for none");
  const long processors = sysconf(_SC_NPROCESSORS_CONF);
  if (settings.cpu < -1 || settings.cpu >= processors)
    return bad_value(fmt::format("is {}", settings.cpu), "cpu", fmt::format("0 to {}, or -1 for any", processors - 1));
  std::vector<RealtimeGrant> grants;
  if (settings.lock_memory) grants.push_back(lock_memory());
  reach_stack();
  if (settings.cpu >= 0) grants.push_back(stay_on(settings.cpu));
  grants.push_back(wake_at_once());
  if (settings.priority > 0) grants.push_back(ask_for_priority(settings.priority));
  return grants;
}

}  // namespace asperity
