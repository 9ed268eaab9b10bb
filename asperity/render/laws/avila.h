#pragma once

#include "asperity/render/law.h"

namespace asperity {

class IsoSurface;

/// Isosurface felt from the field's value at the probe alone (Avila and Sobierajski 1996; large-data-2008, M1, eq. 5 to
/// 10). Between two thresholds the volume pushes along its gradient; a probe that jumps over that layer within a tick
/// feels nothing. Felt from the front alone: a probe that starts inside, or comes in where the volume ends, feels
/// nothing in the consistent form until it has been outside. No force beyond the layer.
///   literal     as printed, eq. 6 to 8, N the gradient: where low values are inside the force is greatest at first
///               touch, where high ones are it pulls inwards; R points along the motion and f_r takes the field's unit
///   consistent  f_s rises from the surface's threshold inwards, along the outward normal, f_r = C2 (1 + share of the
///               layer), R = -f_r v
struct AvilaLaw {
  static constexpr LawFacts facts{.name = "avila",
                                  .title = "a layer that pushes by the field's value at the probe",
                                  .source = "large-data-2008, M1 and Avila and Sobierajski 1996",
                                  .needs = LawNeeds::field,
                                  .compared = on_iso | on_implicit};
  Formulation formulation = Formulation::consistent;
  /// Width of the layer in the field's unit, from the surface's threshold inwards; 0: as wide as makes the material's
  /// stiffness where the field's slope is typical.
  double band = 0.0;
  double largest_force = 3.0;  ///< C1 (N), above 0
  double retarding = 0.0;      ///< C2 (N·s/m), 0 or more

  /// Width of the layer that the law pushes in, by the field's unit: its own, or the one whose force rises by the
  /// material's stiffness where the field's slope is typical. Above 0. [any]
  [[nodiscard]] double layer(const IsoSurface& surface, const Material& material) const noexcept;
  static void options(std::vector<Option>& rows);
  LawForce force(const TouchedSurface& surface, const Material& material, const Vec3& probe, const Vec3& velocity,
                 Seconds dt) const noexcept;
};

}  // namespace asperity
