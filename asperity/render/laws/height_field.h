#pragma once

#include "asperity/render/laws/normal_map_use.h"

namespace asperity {

/// Height field over the base triangle (haptic-textures-2005, 3.3; hrm-2010, Algorithm 1).
///   literal     in the prism, penetration = H - |distance to the plane|, force along the plane's normal; contact is
///   lost below the
///               base at depth H, and heights below 0 are never met (erratum 1)
///   consistent  penetration = H - h with the signed distance h of the nearest base point, force = -grad(k (h - H)^2 /
///   2):
///               no energy from nothing (errata 1, 10)
struct HeightFieldLaw {
  static constexpr LawFacts facts{.name = "height-field",
                                  .title = "heights over the base triangle, along its normal",
                                  .source = "haptic-textures-2005, 3.3 and hrm-2010, Algorithm 1",
                                  .needs = LawNeeds::coat,
                                  .coat = LawCoat::moment,
                                  .linear = true,
                                  .compared = on_relief};
  /// The 2005 paper forces heights to 0 at the edges; it gives no width, so the later paper's band is taken.
  static constexpr double literal_taper = 0.05;
  Formulation formulation = Formulation::consistent;
  /// Share of each triangle (in barycentric coordinates) over which heights fall to 0 towards its edges: the C0 rule of
  /// 2005. 0 turns it off. In 0 … 1/3.
  double edge_taper = formulation == Formulation::literal ? literal_taper : 0.0;

  /// literal: the distance to the plane is signed, so that heights below 0 are met (2005, section 5: scratches).
  bool negative_heights = false;
  NormalMapUse normal_map = NormalMapUse::automatic;  ///< consistent: whether it is felt

  static void options(std::vector<Option>& rows);
  [[nodiscard]] Status validate() const { return check_normal_map(normal_map, formulation); }
  LawForce force(const TouchedSurface& surface, const Material& material, const Vec3& probe, const Vec3& velocity,
                 Seconds dt) const noexcept;
};

}  // namespace asperity
