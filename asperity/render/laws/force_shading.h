#pragma once

#include "asperity/render/law.h"

namespace asperity {

/// God-object force turned into the direction of the coat's normal map at the contact, or of the interpolated vertex
/// normals on a bare mesh (Morgenbesser and Srinivasan 1996; force mapping of haptic-textures-2005, 3.2). Its magnitude
/// stays, so it renders no height, and it feeds energy (0.89 mJ a loop in the reference case).
///   literal     as printed
///   consistent  the normal part of the force stays, the lateral part is that of the blended relief's slope, as far as
///               the energy account pays for it
struct ForceShadingLaw {
  static constexpr LawFacts facts{.name = "force-shading",
                                  .title = "the god-object's force, turned as the normal map says",
                                  .source = "haptic-textures-2005, 3.2",
                                  .needs = LawNeeds::triangles,
                                  .proxy = LawProxy::triangles,
                                  .coat = LawCoat::directions,
                                  .linear = true,
                                  .compared = on_mesh | on_relief};
  Formulation formulation = Formulation::consistent;

  /// Turns a contact's force; the consistent form puts the lateral force into `answer.turn`. [servo]
  void finish(const Touched& touch, const Foot& contact, LawForce& answer) const noexcept;
};

}  // namespace asperity
