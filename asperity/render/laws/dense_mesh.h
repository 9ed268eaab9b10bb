#pragma once

#include "asperity/render/law.h"

namespace asperity {

/// God-object on the relief as a dense mesh, made once when the scene is built: what detail costs as plain geometry.
struct DenseMeshLaw {
  static constexpr LawFacts facts{.name = "dense-mesh",
                                  .title = "a god-object on the relief as a dense mesh, made when the scene is built",
                                  .source = "haptic-textures-2005, 3.1",
                                  .needs = LawNeeds::coat,
                                  .proxy = LawProxy::dense_mesh,
                                  .coat = LawCoat::relief,
                                  .linear = true};
  int subdivisions = 0;  ///< cuts along each edge of a base triangle; 0: triangles of a texel, if not too many

  static void options(std::vector<Option>& rows);
  [[nodiscard]] LawFacets facets() const noexcept { return {subdivisions, 0.0}; }
};

}  // namespace asperity
