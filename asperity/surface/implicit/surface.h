#pragma once
// Implicit surfaces made from meshes: a mesh for the eye, a signed potential for the hand (hybrid-surface-2004).

#include <memory>

#include "asperity/field/volume/sparse_grid.h"
#include "asperity/surface/iso/surface.h"
#include "asperity/surface/mesh/surface.h"

namespace asperity {

/// What an implicit surface is made of.
struct ImplicitParts {
  std::shared_ptr<const SparseGrid> grid;        ///< the potential that is felt
  std::shared_ptr<const SparseGrid> untextured;  ///< the potential before its texture; nullptr: the same
  std::shared_ptr<const MeshSurface> mesh;       ///< what it was made from; nullptr: a level set of another tool
  CellReconstruction reconstruction = CellReconstruction::smooth;
  /// What is felt is where the potential has this value (m): 0, or more to give thin objects some volume.
  double offset = 0.0;
  /// Where the potential is the distance from an open mesh less half of this (m); 0: it is the mesh's own.
  double shell_thickness = 0.0;
};

/// The zero set of a signed potential on a sparse grid. It is touched as the isosurface of the potential; laws that are
/// made for potentials read the grid itself.
class ImplicitSurface {
 public:
  /// Errors: bad_value (no grid, an offset outside the stored band, a potential that is nowhere zero, face indices
  /// beyond the mesh). [build]
  static Result<ImplicitSurface> build(ImplicitParts parts);

  [[nodiscard]] const SparseGrid& grid() const noexcept { return *parts_.grid; }
  /// The potential before its texture; `grid()` where there is none. [servo]
  [[nodiscard]] const SparseGrid& untextured() const noexcept {
    return parts_.untextured ? *parts_.untextured : *parts_.grid;
  }
  [[nodiscard]] bool textured() const noexcept { return parts_.untextured != nullptr; }
  /// nullptr without a mesh. [servo]
  [[nodiscard]] const MeshSurface* mesh() const noexcept { return parts_.mesh.get(); }
  [[nodiscard]] const ImplicitParts& parts() const noexcept { return parts_; }
  [[nodiscard]] double offset() const noexcept { return parts_.offset; }
  /// The potential as an isosurface: what the proxy, avila and cross-uncross feel. [servo]
  [[nodiscard]] const IsoSurface& iso() const noexcept { return iso_; }
  /// How far outside and inside the potential can be trusted to rise and fall (m, both above 0): the stored band less
  /// what reconstruction needs. [servo]
  [[nodiscard]] double reach_outside() const noexcept { return parts_.grid->outside() - 2.0 * parts_.grid->voxel(); }
  [[nodiscard]] double reach_inside() const noexcept { return -parts_.grid->inside() - 2.0 * parts_.grid->voxel(); }
  /// How deep a law that reads the potential at the probe finds it rising (m): from there on the force is held.
  [[nodiscard]] double trusted_depth() const noexcept {
    const double reach = std::max(reach_inside(), 0.5 * parts_.grid->voxel());
    return reach - std::min(parts_.grid->voxel(), 0.5 * reach);
  }
  /// Whether what is felt is the mesh itself: no texture, offset or shell. [any]
  [[nodiscard]] bool is_mesh() const noexcept {
    return mesh() != nullptr && !textured() && parts_.offset == 0.0 && parts_.shell_thickness == 0.0;
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

  /// What is touched: the isosurface of the potential. [servo]
  [[nodiscard]] IsoView view(SurfaceCache& cache) const noexcept { return iso_.view(cache); }
  /// The potential itself, less the offset. [servo]
  [[nodiscard]] FieldSample eval(const Vec3& p, SurfaceCache& cache) const noexcept;
  [[nodiscard]] double skin() const noexcept { return iso_.skin(); }
  [[nodiscard]] Box bounds() const noexcept { return iso_.bounds(); }

 private:
  ImplicitSurface(ImplicitParts parts, IsoSurface iso) : parts_(std::move(parts)), iso_(std::move(iso)) {}

  ImplicitParts parts_;
  IsoSurface iso_;
};

}  // namespace asperity
