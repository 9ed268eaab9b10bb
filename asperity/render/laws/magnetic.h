#pragma once

#include "asperity/render/law.h"
#include "asperity/render/laws/contact_point_state.h"

namespace asperity {

/// Magnetic surface (hybrid-surface-2004, Fig. 6b): within a band outside the surface the probe is drawn to it, inside
/// it is pushed out as by the virtual contact point. Of a ball both are measured from where its middle touches.
///   literal     attraction k f, which drops to 0 at the band's edge
///   consistent  k f (1 - (f / band)^2)^2, the slope of a potential: continuous, and a loop in and out does no work
struct MagneticLaw {
  static constexpr LawFacts facts{.name = "magnetic",
                                  .title = "an implicit surface that draws the probe to it within a band",
                                  .source = "hybrid-surface-2004, Fig. 6b",
                                  .needs = LawNeeds::potential,
                                  .linear = true,
                                  .retards = true,
                                  .own_place = true,
                                  .ball = true};
  Formulation formulation = Formulation::consistent;
  double band = 0.002;  ///< m, above 0

  using State = ContactPointState;
  static void options(std::vector<Option>& rows);
  [[nodiscard]] LawReach outside() const noexcept { return {band, "band"}; }
  [[nodiscard]] double well(const Material& material) const noexcept { return material.stiffness * band * band / 6.0; }
  LawForce force(const TouchedSurface& surface, const Material& material, const Vec3& probe, const Vec3& velocity,
                 Seconds dt, State& state) const noexcept;
};

}  // namespace asperity
