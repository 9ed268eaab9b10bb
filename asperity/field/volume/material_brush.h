#pragma once
// Local materials, laid on stored points by balls (hybrid-surface-2004, "Material editing").

#include <span>

#include "asperity/field/volume/sparse_grid.h"

namespace asperity {

/// A ball that gives its points a material.
struct MaterialBrush {
  Vec3 centre = Vec3::Zero();  ///< m, object frame
  double radius = 0.0;         ///< m, above 0
  double falloff = 0.0;        ///< m, at most the radius: over it the material fades to what was there before
  PointMaterial material;      ///< channels that are not a number are left as they are
};

/// The grid with the brushes laid on in turn; `own` is what points without a material have. Errors: bad_value naming
/// the brush ("[2].radius") and what would be accepted. [build]
Result<SparseGrid> painted(const SparseGrid& grid, std::span<const MaterialBrush> brushes, const PointMaterial& own);

}  // namespace asperity
