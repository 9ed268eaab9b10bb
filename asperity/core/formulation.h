#pragma once

#include <cstdint>

namespace asperity {

/// As printed in the paper, its defects included, for reproduction; or with its errata resolved.
enum class Formulation : std::uint8_t { literal, consistent };

}  // namespace asperity
