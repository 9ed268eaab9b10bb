#pragma once

#include "asperity/geometry/mesh.h"

namespace asperity {

/// The prisms of hrm-2010, section 3: for each triangle the solid between V_i - mh N_i and V_i + mh N_i, N_i the vertex
/// normals. Its bilinear sides are split into triangles by a diagonal that both owners choose alike (from the vertex
/// with the smaller index below to the other above), so that neighbouring prisms neither overlap nor leak.
class Prisms {
 public:
  /// `half_height` is mh (m).
  Prisms(const TriangleMesh& mesh, double half_height) : mesh_(&mesh), half_height_(half_height) {}

  /// Whether `p` lies in the prism of `face`, its surface included. [servo]
  [[nodiscard]] bool contains(std::uint32_t face, const Vec3& p) const noexcept;
  [[nodiscard]] double half_height() const noexcept { return half_height_; }

 private:
  const TriangleMesh* mesh_;
  double half_height_;
};

}  // namespace asperity
