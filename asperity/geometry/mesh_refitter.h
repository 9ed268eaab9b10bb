#pragma once

#include <memory>
#include <span>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/geometry/triangle_index.h"

namespace asperity {

/// Moves the vertices of an indexed mesh and fits the search structure to them, which costs a fraction of building both
/// anew. What it answers is immutable and a snapshot of its own: whoever holds an older one goes on reading the older
/// positions. Arrays are reused as soon as nobody holds the snapshot they belong to, so that a mesh that moves all the
/// time, seen by one reader, takes two or three sets of them.
///
/// Every answer of a moved index is the one that an index built from the same positions gives; only the time that
/// searches take grows with the deformation (TriangleIndex::cost_ratio()). An octree's cells stay where they are in
/// space, so it is built anew.
class MeshRefitter {
 public:
  /// `rest`: the mesh as it was built, or any of its moved ones.
  /// With two `threads`, normals and search structure are fitted side by side where the mesh is large enough to be
  /// worth it (20,000 triangles); with one the caller's does both. [build]
  explicit MeshRefitter(TriangleIndex rest, int threads = 2);

  /// The index with vertices at `positions` (m): one for every vertex of mesh(), by its numbers. Has an identity of its
  /// own and the lineage of `rest`. Errors: mismatch (count), bad_mesh (not finite, naming the vertex; a triangle that
  /// lost its area, naming it); whatever was answered before stays as it is. [build]
  Result<TriangleIndex> moved(std::span<const Vec3> positions);

  [[nodiscard]] const TriangleIndex& rest() const noexcept { return rest_; }
  /// Snapshots whose arrays are kept, those in use elsewhere included. [build]
  [[nodiscard]] std::size_t buffers() const noexcept { return buffers_.size(); }

 private:
  using Inside = TriangleIndex::Inside;
  [[nodiscard]] std::shared_ptr<Inside> fresh() const;
  std::shared_ptr<Inside> spare();

  TriangleIndex rest_;
  int threads_;
  std::vector<std::shared_ptr<Inside>> buffers_;
  BvhFitting fitting_;
  std::vector<Vec3> sums_;
};

}  // namespace asperity
