#pragma once
// Private to asperity/io: what the materials of a glTF file ask of the reader of its triangles.

#include <array>
#include <cstdint>
#include <vector>

#include "asperity/core/math.h"
#include "asperity/core/result.h"
#include "asperity/geometry/mesh.h"
#include "asperity/io/detail/gltf_document.h"

namespace asperity::mesh_readers {

/// How the maps of one primitive lie on it.
struct PrimitiveLook {
  std::uint32_t number = 0;  ///< of its material, among those that the triangles are told apart by
  int texcoord = 0;          ///< the set of texture coordinates
  bool needs_uvs = false;    ///< whether it has maps at all
  bool moved = false;        ///< KHR_texture_transform, rows of its matrix
  std::array<double, 6> matrix = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0};

  /// glTF's texture coordinates (v down), moved. [build]
  [[nodiscard]] Vec2f transform(const Vec2f& uv) const {
    const Vec2 from = uv.cast<double>();
    const Vec2 to(matrix[0] * from.x() + matrix[1] * from.y() + matrix[2],
                  matrix[3] * from.x() + matrix[4] * from.y() + matrix[5]);
    return to.cast<float>();
  }
};
/// By mesh, then by primitive.
using PrimitiveLooks = std::vector<std::vector<PrimitiveLook>>;

/// The triangles of a scene and, where looks were given, the number of each one's.
struct GltfTriangles {
  MeshSource mesh;
  std::vector<std::uint32_t> look_of_triangle;
};

/// Reads the triangles of the default scene. Errors: those of read_mesh(), without a file's name. [build]
Result<GltfTriangles> read_triangles(GltfDocument& document, const PrimitiveLooks* looks);

}  // namespace asperity::mesh_readers
