#pragma once

#include "asperity/render/law.h"

namespace asperity {

/// Isosurface that is crossed and uncrossed (large-data-2008, M2, eq. 11 to 15): from a crossing on, the probe is held
/// by a spring to the surface's point along the gradient: force = k (V - probe) - retarding velocity, penetration |V -
/// probe|. Felt from the front alone, whatever the instance's sides: inside out is the "uncross" that ends a contact.
/// Leaving the volume ends it too. Of a motion that crosses and uncrosses within a tick only the end counts.
///   literal     as printed: at most 1024 grid points of a 3-D line (Bresenham) a tick, the path loop that leaves at
///               its first outside point, the sample nearest to the threshold in place of a root, the gradient saved at
///               the crossing. The printed f_s of eq. 8 is not part of it: S = k (V - R)
///   consistent  every crossing on the way, by exact roots; V found anew every tick, along the normal where it was last
struct CrossUncrossLaw {
  static constexpr LawFacts facts{.name = "cross-uncross",
                                  .title = "a spring to the isosurface's point along the gradient, from a crossing on",
                                  .source = "large-data-2008, M2",
                                  .needs = LawNeeds::field,
                                  .linear = true,
                                  .compared = on_iso};
  Formulation formulation = Formulation::consistent;
  double retarding = 0.0;  ///< R = -retarding v while crossed (N·s/m), 0 or more
  double reach = 0.0;      ///< literal: alpha |N| of eq. 15, how far T lies from the probe (m); 0: 64 cells

  /// The point crossed and the gradient saved there are the contact's place and normal.
  struct State {
    static constexpr bool of_surface = true;
    Vec3 previous = Vec3::Zero();  ///< the probe at the last tick (m, object frame)
    double value = 0.0;            ///< of the field there
    bool crossed = false;          ///< the flag of the paper
  };

  static void options(std::vector<Option>& rows);
  LawForce force(const TouchedSurface& surface, const Material& material, const Vec3& probe, const Vec3& velocity,
                 Seconds dt, State& state) const noexcept;
};

}  // namespace asperity
