#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "asperity/core/result.h"
#include "asperity/geometry/mesh.h"

namespace asperity {

/// Reads a triangle mesh from an OBJ, PLY (ascii, binary of either byte order), STL (ascii, binary) or glTF 2.0 (.gltf,
/// .glb) file. The content decides where it is unmistakable, else the extension. Positions stay in the file's unit,
/// which only glTF states (metres, y up): MeshBuildSettings::scale applies it later. Polygons (3 to 1,024 corners)
/// become triangles: in OBJ files by tinyobjloader's ear clipping, in PLY files as a fan around their first corner.
/// Texture coordinates are kept if every face has them, v upwards from a map's lower edge.
///
/// Of glTF files the triangles, strips and fans of the default scene are read, each mesh as often as nodes place it,
/// mirrored ones turned round. Buffers may be in the file, in data URIs or in files named by a relative path. Images
/// and materials are not looked at; skins, morph targets and animations are left out with a note. Compressed and
/// quantised geometry is refused.
///
/// What is read but left out (normals, colours, groups) needs no word; what may surprise stands in MeshSource::notes.
/// Errors, each naming file and place: file_missing (or a folder), file_empty, file_truncated, file_malformed,
/// file_unsupported, bad_mesh (no faces, index out of range, coordinate not finite), too_large (over 4 GiB; a glTF
/// scene of over 67 million triangles). Memory stays within a small multiple of the files' size, whatever their headers
/// promise, and that of the triangles that instances ask for. [build]
Result<MeshSource> read_mesh(const std::filesystem::path& path);

/// The same from memory. `name` stands in errors, and its extension takes the part of the file's. A glTF that names
/// other files is refused (file_unsupported). [build]
Result<MeshSource> read_mesh_bytes(std::string_view bytes, const std::string& name);

/// A mesh to be written, owned by somebody else.
struct MeshView {
  MeshView(const MeshSource& source);  // NOLINT: implicit by design
  MeshView(const TriangleMesh& mesh);  // NOLINT
  MeshView(const MeshView&) = delete;
  MeshView& operator=(const MeshView&) = delete;
  std::span<const Vec3> positions;
  std::span<const std::array<std::uint32_t, 3>> triangles;
  std::span<const std::array<Vec2f, 3>> corner_uvs;  ///< empty, or one entry a triangle

 private:
  std::vector<std::array<Vec2f, 3>> own_uvs_;  ///< what a mesh keeps in another form
};

/// Writes text OBJ: positions exactly, UVs as one `vt` a corner. Errors: file_unwritable. [build] [main]
Status write_obj(const std::filesystem::path& path, const MeshView& mesh);
/// Writes little-endian binary PLY with double positions. With UVs every corner becomes a vertex of its own (x y z s
/// t): TriangleMesh::build welds them again. Errors: file_unwritable. [build] [main]
Status write_ply(const std::filesystem::path& path, const MeshView& mesh);
/// Writes binary STL: positions rounded to single precision, no UVs, at most 2^32 - 1 triangles.
/// Errors: file_unwritable. [build] [main]
Status write_stl(const std::filesystem::path& path, const MeshView& mesh);

}  // namespace asperity
