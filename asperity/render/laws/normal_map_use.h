#pragma once
// What the laws that feel a coat's heights make of the normal map that it is given beside them.

#include "asperity/core/names.h"
#include "asperity/core/option.h"
#include "asperity/render/law.h"

namespace asperity {

/// Whether a given normal map bends the force over what the heights themselves say (hrm-2010 pairs the two).
enum class NormalMapUse {
  automatic,  ///< felt where the map is all there is: where the heights are the same all over
  felt,
  ignored,
};
/// As in scene files.
template <>
struct Names<NormalMapUse> {
  static constexpr auto table = std::to_array<Named<NormalMapUse>>(
      {{NormalMapUse::automatic, "automatic"}, {NormalMapUse::felt, "felt"}, {NormalMapUse::ignored, "ignored"}});
};

/// The key that says so. [build]
template <class L>
Option normal_map_option(NormalMapUse L::*member) {
  return option("normal_map", member, OptionType::named<NormalMapUse>(),
                "whether a coat's given normal map bends the force over its heights; automatic: where they are flat.")
      .by_contents("felt or ignored by a printed form, which has its own way with normals");
}
/// Of a law that has two forms. Errors: mismatch (the literal form, which has its own way with normals). [build]
Status check_normal_map(NormalMapUse use, Formulation formulation);

}  // namespace asperity
