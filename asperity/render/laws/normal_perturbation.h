#pragma once

#include "asperity/render/law.h"

namespace asperity {

/// The rival of implicit haptic texturing (hybrid-surface-2004, Fig. 10a; Ho, Basdogan and Srinivasan 1999): the
/// contact is the untextured mesh's nearest point, the force along its face's normal turned by the slope of the
/// texture's height there, and longer by that height. Force and direction jump where the nearest face changes.
struct NormalPerturbationLaw {
  static constexpr LawFacts facts{.name = "normal-perturbation",
                                  .title = "the mesh's nearest point, its normal turned by the texture's slope",
                                  .source = "hybrid-surface-2004, Fig. 10a and Ho, Basdogan and Srinivasan 1999",
                                  .needs = LawNeeds::potential,
                                  .linear = true,
                                  .compared = on_implicit};

  [[nodiscard]] std::string lacks(const Instance& instance) const;
  LawForce force(const TouchedSurface& surface, const Material& material, const Vec3& probe, const Vec3& velocity,
                 Seconds dt) const noexcept;
};

}  // namespace asperity
