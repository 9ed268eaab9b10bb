#pragma once

#include "asperity/render/law.h"
#include "asperity/render/laws/contact_point_state.h"

namespace asperity {

/// Virtual contact point of an implicit surface: the probe is held by a spring and a damper to the surface's point
/// along the potential's gradient (hybrid-surface-2004, eq. 1), which friction retards (eq. 2; f_c is the material's
/// dynamic friction). Felt from the front alone (literal: whoever starts inside is pushed at once; consistent: after
/// having been outside); it has no memory of the side, so a sheet thinner than twice the penetration lets the probe
/// through: `offset` gives it volume.
///   literal     as printed: node gradients interpolated, small steps along them, F = k (p_c - p_t) - b V with all of
///               the velocity, friction by the tick, whatever its length (its errata: F_r for F_v in p_n; f_v over 1
///               reverses, so it is kept under 0.999)
///   consistent  F = -grad(k f^2 / 2) of the potential's own reconstruction: no work in a closed loop, continuous where
///               the reconstruction is; p_c = p_t + F / k. Damping never pulls. Friction by the millisecond
///               (formulation, amendment 15)
struct VirtualContactPointLaw {
  static constexpr LawFacts facts{.name = "virtual-contact-point",
                                  .title = "a spring to the implicit surface's point along the gradient",
                                  .source = "hybrid-surface-2004, eq. 1 and 2",
                                  .needs = LawNeeds::potential,
                                  .linear = true,
                                  .retards = true,
                                  .own_place = true,
                                  .ball = true,
                                  .compared = on_implicit | literal_too};
  Formulation formulation = Formulation::consistent;
  ContactMagnitude magnitude = ContactMagnitude::distance;  ///< literal alone; the consistent form has one magnitude
  double depth_gain = 0.0;                                  ///< d of eq. 2 (1/m), 0 or more
  /// Offset surface for thin objects (Fig. 6a): the force pushes out to where the potential is this (m), 0 or more;
  /// direction, friction and material are those of the original surface's point. A ball adds its radius.
  double offset = 0.0;

  using State = ContactPointState;
  static void options(std::vector<Option>& rows);
  [[nodiscard]] LawReach outside() const noexcept { return {offset, "offset"}; }
  LawForce force(const TouchedSurface& surface, const Material& material, const Vec3& probe, const Vec3& velocity,
                 Seconds dt, State& state) const noexcept;
};

}  // namespace asperity
