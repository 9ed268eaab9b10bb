#pragma once

#include <memory>

#include "asperity/geometry/mesh_refitter.h"
#include "asperity/geometry/triangle_index.h"
#include "asperity/surface/view.h"

namespace asperity {

class TriangleView;

/// A triangle mesh touched as it is. Copies share mesh and search structure.
class MeshSurface {
 public:
  explicit MeshSurface(TriangleIndex index) : index_(std::move(index)) {}

  /// [servo]
  [[nodiscard]] TriangleView view(SurfaceCache& cache) const noexcept;
  /// Signed distance: exact where the mesh is closed and oriented; elsewhere signed by the nearest feature's normal.
  [[nodiscard]] FieldSample eval(const Vec3& p, SurfaceCache& cache) const noexcept;
  [[nodiscard]] double skin() const noexcept { return index_.skin(); }
  [[nodiscard]] Box bounds() const noexcept { return index_.mesh().bounds(); }

  [[nodiscard]] const TriangleIndex& index() const noexcept { return index_; }
  [[nodiscard]] const TriangleMesh& mesh() const noexcept { return index_.mesh(); }
  /// Front where front and back are told apart (closed and oriented), both elsewhere.
  [[nodiscard]] Sides natural_sides() const noexcept {
    return mesh().report().closed() && mesh().report().oriented() ? Sides::front : Sides::both;
  }

 private:
  TriangleIndex index_;
};
/// A mesh as a reader or a generator gives it, ready to be touched: welded, checked and searched by a bounding volume
/// hierarchy. `settings.scale` is the source's unit (m). Errors: those of TriangleMesh::build. [build]
Result<std::shared_ptr<const MeshSurface>> make_mesh_surface(MeshSource source, const MeshBuildSettings& settings = {});

/// A mesh whose vertices the caller moves, as surfaces that can be touched: see MeshRefitter.
class DeformableMesh {
 public:
  /// [build]
  explicit DeformableMesh(const MeshSurface& rest, int threads = 2) : refitter_(rest.index(), threads), rest_(rest) {}
  /// The surface with vertices at `positions` (m), by the numbers of rest().mesh(). Errors: mismatch (count), bad_mesh
  /// (not finite, a triangle that lost its area). [build]
  Result<MeshSurface> moved(std::span<const Vec3> positions) {
    ASPERITY_TRY(TriangleIndex index, refitter_.moved(positions));
    return MeshSurface(std::move(index));
  }
  [[nodiscard]] const MeshSurface& rest() const noexcept { return rest_; }

 private:
  MeshRefitter refitter_;
  MeshSurface rest_;
};

/// Normal of the feature (face, edge or vertex) that a barycentric position lies on, whose sign tells inside from
/// outside exactly (angle-weighted pseudonormals: Baerentzen and Aanaes 2005). Not unit on edges. [servo]
Vec3 pseudonormal(const TriangleMesh& mesh, std::uint32_t face, const Vec3& barycentric) noexcept;

/// Whether `probe`, whose nearest point on the mesh is this, lies beside the rim of an open mesh: its foot is on a
/// boundary edge or vertex, and it is not straight over the face. There a relief ends (formulation, amendment 3).
/// [servo]
bool beyond_rim(const TriangleMesh& mesh, const Foot& foot, const Vec3& probe, double skin) noexcept;

/// Vertex normals interpolated over a face, unit: the smooth normal of force shading. [servo]
Vec3 interpolated_normal(const TriangleMesh& mesh, std::uint32_t face, const Vec3& barycentric) noexcept;

}  // namespace asperity
