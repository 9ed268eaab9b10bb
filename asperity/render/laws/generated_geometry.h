#pragma once

#include "asperity/render/law.h"

namespace asperity {

/// God-object on geometry generated per triangle at run time inside the probe's influence area (haptic-textures-2005,
/// 3.1): base triangles near the proxy are cut into a grid of small flat ones on the displaced surface, anew every
/// tick. Facets and their edges are felt; where heights of neighbouring faces differ, the seam stays open.
struct GeneratedGeometryLaw {
  static constexpr LawFacts facts{.name = "generated-geometry",
                                  .title = "a god-object on small flat triangles, generated around it in every tick",
                                  .source = "haptic-textures-2005, 3.1",
                                  .needs = LawNeeds::coat,
                                  .proxy = LawProxy::facets,
                                  .coat = LawCoat::relief,
                                  .linear = true};
  static constexpr int most_subdivisions = 4096;
  int subdivisions = 32;          ///< cuts along each edge of a base triangle; 1 to most_subdivisions
  double influence_radius = 0.0;  ///< m around the proxy within which triangles are made; 0: one and a half of theirs

  static void options(std::vector<Option>& rows);
  [[nodiscard]] LawFacets facets() const noexcept { return {subdivisions, influence_radius}; }
};

}  // namespace asperity
