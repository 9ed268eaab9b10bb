#pragma once
// The point of an implicit surface that a probe is held to: what virtual contact points and magnets have in common
// (hybrid-surface-2004, eq. 1 and 2, Fig. 6). Private to render.

#include "asperity/render/felt.h"
#include "asperity/render/laws/contact_point_state.h"

namespace asperity {

/// What the laws remember, while they are asked.
struct HeldPoint : ContactPointState {
  Vec3 point;   ///< p_c
  Vec3 normal;  ///< direction of the push
  bool started = false;
  bool seen_outside = false;
  bool retarded = true;  ///< by the laws' own friction (eq. 2); false: friction is a force of its own
  SurfaceCache& cache;
};

/// What tells the two consistent laws apart.
struct ContactPointRule {
  double offset = 0.0;
  double band = 0.0;  ///< of attraction; 0: none
  double depth_gain = 0.0;
};

/// Forgets it. [servo]
void leave_contact_point(HeldPoint& state) noexcept;
/// Eq. 1 as printed. `here`: the potential at the probe, which is less than `offset` outside; `own`: the surface's
/// material, local ones are looked up. [servo]
LawForce printed_push(const ImplicitSurface& surface, ContactMagnitude magnitude, double offset, double depth_gain,
                      const Potential& here, const Material& own, const Vec3& probe, const Vec3& velocity,
                      HeldPoint& state) noexcept;
/// The consistent form of both. [servo]
LawForce potential_push(const ContactPointRule& rule, const ImplicitSurface& surface, const Material& own,
                        const Vec3& probe, const Vec3& velocity, Seconds dt, HeldPoint& state) noexcept;

/// Asks one of the two with what the contact remembers. [servo]
template <class Ask>
LawForce ask_contact_point(const Touched& touch, ContactPointState& memory, const Vec3& probe,
                           const Ask& force) noexcept {
  if (!probe.allFinite()) return {};
  Contact& contact = *touch.contact;
  HeldPoint state{memory,        contact.first().at,   contact.surface.normal,
                  contact.asked, contact.seen_outside, !touch.facts->adds_friction,
                  *touch.cache};
  const LawForce answer = force(state);
  memory = state;
  contact.put({0, false, state.point});
  contact.surface.normal = state.normal;
  contact.seen_outside = state.seen_outside;
  contact.asked = true;
  return answer;
}

}  // namespace asperity
