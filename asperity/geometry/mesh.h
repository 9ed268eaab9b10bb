#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "asperity/core/math.h"
#include "asperity/core/result.h"
#include "asperity/core/unset_vector.h"
#include "asperity/geometry/corner_uvs.h"

namespace asperity {

/// A mesh as a file or a generator gives it: nothing is checked yet.
struct MeshSource {
  std::vector<Vec3> positions;                          ///< in the file's unit
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices into `positions`
  std::vector<std::array<Vec2f, 3>> corner_uvs;         ///< per triangle; empty: the mesh has no UVs
  std::vector<std::string> notes;                       ///< what the reader repaired or left out, for `inspect`
};

/// What is true of a mesh. Counts are of the welded, cleaned mesh unless they say "dropped".
struct MeshReport {
  std::size_t vertices = 0;
  std::size_t triangles = 0;
  std::size_t welded_vertices = 0;       ///< source vertices merged into another at the same position
  std::size_t dropped_degenerate = 0;    ///< triangles without area (two corners equal, or collinear)
  std::size_t dropped_duplicate = 0;     ///< triangles with the same three corners as an earlier one
  std::size_t boundary_edges = 0;        ///< edges with one triangle
  std::size_t nonmanifold_edges = 0;     ///< edges with three or more triangles
  std::size_t misoriented_edges = 0;     ///< edges whose two triangles run the same way along it
  std::size_t nonmanifold_vertices = 0;  ///< vertices whose triangles form more than one fan
  std::size_t components = 0;            ///< connected over shared vertices
  double mean_edge = 0.0;                ///< m
  double min_edge = 0.0;                 ///< m
  double max_edge = 0.0;                 ///< m
  double area = 0.0;                     ///< m²
  double signed_volume = 0.0;            ///< m³; meaningful when closed, negative when normals point inward
  double worst_aspect = 0.0;             ///< largest longest-edge / smallest-height over the triangles
  [[nodiscard]] bool closed() const { return triangles > 0 && boundary_edges == 0 && nonmanifold_edges == 0; }
  [[nodiscard]] bool oriented() const { return misoriented_edges == 0 && nonmanifold_edges == 0; }
};

/// How a source becomes a mesh.
struct MeshBuildSettings {
  double scale = 1.0;          ///< multiplies positions: the file's unit in metres
  bool orient_outward = true;  ///< flip a closed, oriented mesh whose volume is negative
};

/// Unit normal of a triangle, and the angles at its corners.
struct FaceCorners {
  Vec3 normal;
  double angle[3];
};

/// Immutable triangle mesh: welded positions (m, object frame), corner UVs, vertex adjacency.
///
/// Corners of triangles are welded by position alone, so that a UV seam never breaks adjacency.
/// All queries are const and safe from any thread.
class TriangleMesh {
 public:
  using Triangle = std::array<std::uint32_t, 3>;

  /// Welds, cleans and validates. Errors: bad_mesh (no triangle with area, index out of range, position not finite,
  /// more than 1.4e9 triangles), each naming the vertex or triangle. [build]
  static Result<TriangleMesh> build(MeshSource source, const MeshBuildSettings& settings = {});
  /// The same triangles with vertices elsewhere (m, as many as positions()); shares what does not change. Everything
  /// measured (normals, bounds, lengths, areas) is measured anew; orientation stays as it is. Errors: mismatch (count),
  /// bad_mesh (not finite, naming the vertex; a triangle that lost its area, naming it). [build]
  [[nodiscard]] Result<TriangleMesh> moved(std::span<const Vec3> positions) const;

  [[nodiscard]] std::span<const Vec3> positions() const noexcept { return positions_; }
  [[nodiscard]] std::span<const Triangle> triangles() const noexcept { return triangles_; }
  [[nodiscard]] bool has_uvs() const noexcept { return corner_uvs_ != nullptr; }
  /// Corner UVs of triangle `face`; only when has_uvs(). [servo]
  [[nodiscard]] std::array<Vec2f, 3> uvs(std::uint32_t face) const noexcept {
    return corner_uvs_->at(face, triangles_[face]);
  }
  [[nodiscard]] std::array<Vec3, 3> corners(std::uint32_t face) const noexcept {
    const Triangle& t = triangles_[face];
    return {positions_[t[0]], positions_[t[1]], positions_[t[2]]};
  }
  /// Which of a triangle's corners a vertex of it is. [any]
  [[nodiscard]] std::size_t corner_of(std::uint32_t face, std::uint32_t vertex) const noexcept {
    const Triangle& t = triangles_[face];
    return t[0] == vertex ? 0 : t[1] == vertex ? 1 : 2;
  }
  /// Unit face normal, computed from the corners (right-hand rule). [servo]
  [[nodiscard]] Vec3 face_normal(std::uint32_t face) const noexcept;
  /// Normals of all triangles and angles at their corners (to 1e-12 of an angle), on all cores. [build]
  [[nodiscard]] UnsetVector<FaceCorners> face_corners() const;
  /// Unit vertex normal, weighted by the angles of the incident triangles. [servo]
  [[nodiscard]] Vec3 vertex_normal(std::uint32_t vertex) const noexcept {
    return vertex_normals_[vertex].cast<double>();
  }
  /// Triangles that have `vertex` as a corner, ascending. [servo]
  [[nodiscard]] std::span<const std::uint32_t> faces_of_vertex(std::uint32_t vertex) const noexcept {
    return {vertex_faces_ + vertex_offsets_[vertex], vertex_faces_ + vertex_offsets_[vertex + 1]};
  }
  /// The triangle across edge `edge` of `face` (edge i runs from corner i to corner (i+1)%3), or no_index at a
  /// boundary or where three or more triangles meet. [servo]
  [[nodiscard]] std::uint32_t neighbour(std::uint32_t face, int edge) const noexcept;

  [[nodiscard]] const MeshReport& report() const noexcept { return report_; }
  [[nodiscard]] const Box& bounds() const noexcept { return bounds_; }
  [[nodiscard]] double mean_edge() const noexcept { return report_.mean_edge; }
  /// Whether the two have the same triangles in common: one is the other, its copy or moved. [any]
  [[nodiscard]] bool same_topology(const TriangleMesh& other) const noexcept { return topology_ == other.topology_; }
  /// Tells meshes apart by what they were built from: triangles, texture coordinates and the positions of then. Copies
  /// and moved ones keep it, and meshes built twice from the same have the same. [any]
  [[nodiscard]] std::uint64_t fingerprint() const noexcept { return topology_->fingerprint; }
  /// Bytes held by this object, its arrays included; what it shares with moved ones too.
  [[nodiscard]] std::size_t memory_bytes() const noexcept;
  /// What the reader or the builder changed, for `inspect`.
  [[nodiscard]] std::span<const std::string> notes() const noexcept { return topology_->notes; }

 private:
  friend class MeshRefitter;

  /// An edge that has another number of triangles than two.
  struct OddEdge {
    std::uint32_t from;
    std::uint32_t to;
    std::uint32_t triangles;
  };
  /// What stays when vertices move.
  struct Topology {
    std::vector<Triangle> triangles;
    CornerUvs corner_uvs;
    std::vector<std::uint32_t> vertex_offsets;
    std::vector<std::uint32_t> vertex_faces;
    std::vector<OddEdge> odd_edges;
    std::vector<std::string> notes;
    std::uint64_t fingerprint = 0;
  };
  class EdgeSurvey;

  TriangleMesh() = default;
  void derive(MeshSource source, bool orient_outward);
  /// Takes the positions over, in two parts so that a search structure can be refitted beside the second.
  Status place(std::span<const Vec3> positions);
  Status measure(std::vector<Vec3>& sums);
  [[nodiscard]] bool measure_faces(std::vector<Vec3>& sums);

  std::vector<Vec3> positions_;
  std::vector<Vec3f> vertex_normals_;
  Box bounds_;
  MeshReport report_;
  std::shared_ptr<const Topology> topology_;
  // Into topology_, so that a query need not go through it.
  std::span<const Triangle> triangles_;
  const CornerUvs* corner_uvs_ = nullptr;
  const std::uint32_t* vertex_offsets_ = nullptr;
  const std::uint32_t* vertex_faces_ = nullptr;
};

/// Whether two triangles have a corner in common. [servo]
inline bool share_vertex(const TriangleMesh::Triangle& a, const TriangleMesh::Triangle& b) noexcept {
  // All nine at once: which of them it is cannot be guessed.
  unsigned same = 0;
  for (const std::uint32_t one : a) {
    for (const std::uint32_t other : b) same |= static_cast<unsigned>(one == other);
  }
  return same != 0;
}

/// Calls `visit(face)` once for every triangle that shares at least one vertex with `face`, itself included:
/// the papers' "adjoining" faces (hrm-2010, 4.1). Does not allocate. [servo]
template <class Visit>
void for_each_adjoining_face(const TriangleMesh& mesh, std::uint32_t face, Visit&& visit) {
  const TriangleMesh::Triangle& corners = mesh.triangles()[face];
  for (int k = 0; k < 3; ++k) {
    for (const std::uint32_t other : mesh.faces_of_vertex(corners[static_cast<std::size_t>(k)])) {
      // A face that shares two vertices is listed by both: take it at the first shared corner only.
      const TriangleMesh::Triangle& t = mesh.triangles()[other];
      if (std::find_first_of(corners.begin(), corners.begin() + k, t.begin(), t.end()) == corners.begin() + k)
        visit(other);
    }
  }
}

}  // namespace asperity
