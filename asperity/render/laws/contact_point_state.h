#pragma once
// What the laws of a contact point have in common.

#include "asperity/core/math.h"
#include "asperity/core/names.h"

namespace asperity {

/// How far the virtual contact point is taken to be.
enum class ContactMagnitude {
  distance,   ///< to the virtual contact point (hybrid-surface-2004)
  potential,  ///< what the potential says (Avila and Sobierajski 1996): softer where edges are interpolated
};
/// As in scene files.
template <>
struct Names<ContactMagnitude> {
  static constexpr auto table = std::to_array<Named<ContactMagnitude>>(
      {{ContactMagnitude::distance, "distance"}, {ContactMagnitude::potential, "potential"}});
};

/// What the laws of a contact point remember. It and the direction of its push are the contact's place and normal.
struct ContactPointState {
  static constexpr bool of_surface = true;
  Vec3 previous = Vec3::Zero();  ///< the probe at the last tick (m, object frame)
  bool pushed = false;           ///< at the last tick
};

}  // namespace asperity
