#pragma once

#include <cstdint>

#include "asperity/core/names.h"

namespace asperity {

/// As printed in the paper, its defects included, for reproduction; or with its errata resolved.
enum class Formulation : std::uint8_t { literal, consistent };
/// As in scene files.
template <>
struct Names<Formulation> {
  static constexpr auto table =
      std::to_array<Named<Formulation>>({{Formulation::literal, "literal"}, {Formulation::consistent, "consistent"}});
};

}  // namespace asperity
