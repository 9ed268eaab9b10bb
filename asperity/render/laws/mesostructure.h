#pragma once

#include "asperity/render/laws/normal_map_use.h"
#include "asperity/surface/stitching.h"

namespace asperity {

/// Mesostructure blended over adjoining faces (hrm-2010, Algorithm 2).
///   literal     the printed band test, unsigned distance to one plane, averaged normals that are not unit (errata 1,
///   2, 4, 5)
///   consistent  Phi of the relief in shell coordinates, blended as the coat's stitching says, force = -grad(k Phi^2 /
///   2)
struct MesostructureLaw {
  static constexpr LawFacts facts{.name = "mesostructure",
                                  .title = "heights blended over adjoining faces",
                                  .source = "hrm-2010, Algorithm 2",
                                  .needs = LawNeeds::coat,
                                  .coat = LawCoat::moment,
                                  .linear = true,
                                  .compared = on_relief};
  Formulation formulation = Formulation::consistent;
  double rho = 0.05;                   ///< literal: width of the band in barycentric coordinates, above 0, at most 1/3
  Blend blend = Blend::s_shape;        ///< literal: weights over the band
  std::vector<double> blend_map = {};  ///< literal, Blend::image: weights at t = 0 … 1, evenly spaced, at least two
  /// literal: the blend on the fly of section 4.2. Within the band around any edge heights and normals are averaged
  /// over every neighbouring prism that holds the probe.
  bool test_neighbours = false;
  NormalMapUse normal_map = NormalMapUse::automatic;  ///< consistent: whether it is felt

  static void options(std::vector<Option>& rows);
  [[nodiscard]] Status validate() const;
  LawForce force(const TouchedSurface& surface, const Material& material, const Vec3& probe, const Vec3& velocity,
                 Seconds dt) const noexcept;
};

}  // namespace asperity
