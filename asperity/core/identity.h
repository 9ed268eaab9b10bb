#pragma once

#include <cstdint>

namespace asperity {

/// A number that no other call of this process has had or will have, never 0: what caches tell objects apart by. From
/// any thread at once; the order of numbers says nothing. [any]
std::uint64_t next_identity() noexcept;

}  // namespace asperity
