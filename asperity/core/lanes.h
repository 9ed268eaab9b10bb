#pragma once
// Numbers side by side: what is asked of several places at once.

#include <array>
#include <cstddef>

namespace asperity {

/// How many places go side by side.
inline constexpr std::size_t lanes = 4;
/// One number for each of them. Unaligned: its layout does not depend on the instruction set a user compiles for.
using Lanes = std::array<double, lanes>;

}  // namespace asperity
