#pragma once
// What of a mesh changes when its vertices move: normals, lengths, areas. Four triangles at a time, in double
// precision; the same operations in the same order on every x86 processor, so that answers are equal bit for bit.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "asperity/core/math.h"
#include "asperity/geometry/mesh.h"

namespace asperity {

/// Sums and extremes over all triangles of a mesh. Edges count once for each triangle they belong to.
struct FaceMeasures {
  double area = 0.0;           ///< m²
  double signed_volume = 0.0;  ///< m³, about the given centre
  double worst_aspect = 0.0;   ///< largest longest-edge / smallest-height
  double edge_sum = 0.0;       ///< m, each triangle's three edges
  double min_edge = infinity;  ///< m
  double max_edge = 0.0;       ///< m
  bool suspect = false;        ///< some triangle may have lost its area, or its size
};

/// Room for the sums at the vertices, kept from one call to the next.
using NormalSums = std::vector<Vec3>;

/// Unit vertex normals of a mesh, weighted by the angles of the triangles around (to 1e-12 of an angle before they are
/// rounded to single precision), and the measures. `centre` (m): volumes are summed about it. Where the triangles at a
/// vertex cancel, its normal is left zero. [build]
FaceMeasures measure_faces(std::span<const Vec3> positions, std::span<const std::array<std::uint32_t, 3>> triangles,
                           const Vec3& centre, NormalSums& sums, std::vector<Vec3f>& normals);

/// TriangleMesh::face_corners, for some of a mesh's triangles. [build]
void measure_corners(std::span<const Vec3> positions, std::span<const std::array<std::uint32_t, 3>> triangles,
                     std::span<FaceCorners> corners);

}  // namespace asperity
