#pragma once

#include "asperity/render/law.h"

namespace asperity {

/// Constraint-based god-object on the geometry (Zilles and Salisbury 1995; a ball where the probe has a radius, Ruspini
/// 1997). Each tick ends with the complete solve: the proxy is the constrained local minimiser of its distance to the
/// probe. On a coated mesh it feels the base alone.
struct GodObjectLaw {
  static constexpr LawFacts facts{.name = "god-object",
                                  .title = "a god-object on the triangles, of a coated mesh the base alone",
                                  .source = "Zilles and Salisbury 1995",
                                  .needs = LawNeeds::triangles,
                                  .proxy = LawProxy::triangles,
                                  .linear = true,
                                  .compared = on_mesh};
};

}  // namespace asperity
