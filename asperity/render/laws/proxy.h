#pragma once

#include "asperity/render/laws/normal_map_use.h"

namespace asperity {

/// The default: one proxy on the true surface, the displaced one where there is a coat (formulation D6, amendments 5 to
/// 9). It never passes through, moves only where its distance to the probe falls, sticks and slides by Coulomb's cone
/// of the material, and touches with the probe's radius. Several surfaces are solved jointly.
struct ProxyLaw {
  static constexpr LawFacts facts{.name = "proxy",
                                  .title = "one proxy on the true surface, displaced where there is a coat",
                                  .source = "formulation D6",
                                  .proxy = LawProxy::surface,
                                  .coat = LawCoat::moment,
                                  .linear = true,
                                  .compared = on_mesh | on_relief | on_iso | on_implicit};
  NormalMapUse normal_map = NormalMapUse::automatic;  ///< of a coat

  static void options(std::vector<Option>& rows) { rows.push_back(normal_map_option(&ProxyLaw::normal_map)); }
  /// Turns its force on a coat. [servo]
  void finish(const Touched& touch, const Foot& contact, LawForce& answer) const noexcept;
};

}  // namespace asperity
