#include "asperity/core/identity.h"

#include <atomic>

namespace asperity {

std::uint64_t next_identity() noexcept {
  static constinit std::atomic<std::uint64_t> last{0};
  return last.fetch_add(1, std::memory_order_relaxed) + 1;
}

}  // namespace asperity
