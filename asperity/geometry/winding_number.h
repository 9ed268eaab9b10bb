#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "asperity/geometry/mesh.h"

namespace asperity {

/// Generalised winding number of a triangle soup (jacobson-2013): the solid angle under which the triangles are seen
/// from a point, as a part of the full sphere. Inside a closed mesh with outward normals it is 1, outside 0; twice
/// covered 2, turned inside out -1; near holes and loose ends it passes smoothly through 1/2, so that "above 1/2" is
/// a sign for meshes that have no inside strictly.
///
/// Triangles nearby count exactly (van-oosterom-1983); far clusters by their dipole, quadrupole and octupole (the
/// second-order expansion of barill-2018) once the point is `beta` times their radius away. The answer is within 5e-3
/// of the exact sum on surfaces, within 1e-2 on soups of a few hundred triangles. On a triangle itself it is the value
/// of either side. Queries cost O(log n) typically, allocate nothing and are safe from any thread. The mesh must
/// outlive this object and stay in place.
class WindingNumber {
 public:
  /// Distance from a cluster's centre, in units of its radius, from which on its expansion stands for it.
  static constexpr double beta = 2.3;

  /// O(n log n): about a second for 1.3 M triangles. [build]
  explicit WindingNumber(const TriangleMesh& mesh);

  /// The winding number around `p` (m, object frame; 0 where it is not finite). [servo]
  [[nodiscard]] double at(const Vec3& p) const noexcept;

  /// Bytes held by this object, its arrays included; the mesh is not counted. [any]
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return sizeof(*this) + nodes_.capacity() * sizeof(Node) + faces_.capacity() * sizeof(std::uint32_t);
  }

 private:
  /// A cluster; in depth-first order, so that `end` is where the walk goes on when the cluster is done with.
  struct Node {
    Vec3 centre = Vec3::Zero();          ///< area centroid (m)
    double reach_squared = 0.0;          ///< beyond it (m², from the centre) the expansion holds
    Vec3 dipole = Vec3::Zero();          ///< sum of area times normal (m²)
    std::array<double, 6> quadrupole{};  ///< coefficients of xx xy xz yy yz zz (m³)
    std::array<double, 10> octupole{};   ///< coefficients of xxx xxy xxz xyy xyz xzz yyy yyz yzz zzz (m⁴)
    std::uint32_t end = 0;               ///< the first node behind this one's descendants
    std::uint32_t first = 0;             ///< leaf: into faces_
    std::uint32_t count = 0;             ///< leaf: triangles; 0 for an inner node
  };
  class Builder;

  [[nodiscard]] static double expansion(const Node& node, const Vec3& offset, double squared_distance) noexcept;

  const TriangleMesh* mesh_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> faces_;
};

/// Solid angle of the triangle a, b, c (m) seen from `p`, as a part of the full sphere (-1/2 to 1/2): positive from
/// behind, that is from the side that its normal turns away from (van-oosterom-1983). [servo]
[[nodiscard]] double triangle_winding(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) noexcept;

}  // namespace asperity
