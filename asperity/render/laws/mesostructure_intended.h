#pragma once

#include "asperity/render/law.h"
#include "asperity/surface/stitching.h"

namespace asperity {

/// Algorithm 2 of hrm-2010 as its authors meant it, for a fair comparison with their method: where text and listing
/// disagree, the text. A band of `rho` beside every edge (the comment of line 10; its test selects corners), the signed
/// distance to the plane (line 28 takes its size, so that heights below 0 are never met and contact is lost at depth
/// H), and the force along the averaged normal, of unit length. What is theirs stays: the penetration is measured along
/// one plane's normal, which changes at folds, the force is no energy's slope (0.107 mJ a loop in the reference case),
/// and it asks the energy account nothing.
struct MesostructureIntendedLaw {
  static constexpr LawFacts facts{.name = "mesostructure-intended",
                                  .title = "Algorithm 2 as its authors meant it",
                                  .source = "hrm-2010, Algorithm 2 and section 4.1",
                                  .needs = LawNeeds::coat,
                                  .coat = LawCoat::moment,
                                  .linear = true,
                                  .unpaid = true,
                                  .compared = on_relief};
  double rho = 0.05;                   ///< width of the band in barycentric coordinates, above 0, at most 1/3
  Blend blend = Blend::s_shape;        ///< weights over the band
  std::vector<double> blend_map = {};  ///< Blend::image: weights at t = 0 … 1, evenly spaced, at least two
  /// Half height mh of the prisms (m), 0 or more, where it is more than the highest and lowest of the heights: how deep
  /// a probe may be pressed. By itself a flat coat has no prisms, and is not felt.
  double prism_height = 0.0;

  static void options(std::vector<Option>& rows);
  [[nodiscard]] Status validate() const;
  LawForce force(const TouchedSurface& surface, const Material& material, const Vec3& probe, const Vec3& velocity,
                 Seconds dt) const noexcept;
};

}  // namespace asperity
