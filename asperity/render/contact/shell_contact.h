#pragma once
// What laws over the shell of a relief have in common. Private to render.

#include "asperity/render/felt.h"

namespace asperity {

/// The shell around a probe, as the consistent forms of Algorithms 1 and 2 need it.
struct ShellContact {
  bool found = false;       ///< false: no surface
  bool beyond_rim = false;  ///< the foot is on the rim of an open mesh and the probe is not over the face
  /// In the view's cache. Null: no prism holds the probe, the nearest base point stands in.
  const ReliefFrame* frame = nullptr;
  ShellPlace place;
};
ShellContact shell_contact(const ReliefView& view, const Vec3& probe) noexcept;

/// Contact of a potential k Phi^2 / 2 whose penetration is -value: force = -k value gradient, if the probe came in from
/// outside. Keeps contact.seen_outside. [servo]
LawForce potential_contact(double value, const Vec3& gradient, double height, std::uint32_t element, bool beyond_rim,
                           double stiffness, const Vec3& probe, Contact& contact) noexcept;

}  // namespace asperity
