#pragma once
// glTF models with what their materials say about touch: normal textures, heights, MPEG_haptic_material.
// docs/methods/gltf.md lists every key that is read and written.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/field/height/image.h"
#include "asperity/field/height/map.h"
#include "asperity/field/height/normal_map.h"
#include "asperity/geometry/mesh.h"
#include "asperity/io/mesh_io.h"

namespace asperity {

/// An image as a material wears it.
struct GltfTexture {
  std::shared_ptr<const Image> image;  ///< as its file stores it, row 0 on top; never null
  std::string source;                  ///< for messages: "images[2] (wool.png)"
  Wrap wrap = Wrap::repeat;
};

/// glTF's normalTexture: x along growing s, y up the image (green up), z outward.
struct GltfNormals {
  GltfTexture texture;
  double scale = 1.0;  ///< multiplies x and y before they are made unit
};

/// Heights in metres (extras of asperity): H = offset + amplitude v, or offset - amplitude v where white is deep, with
/// v from 0 (black) to 1 (white).
struct GltfHeight {
  GltfTexture texture;
  double amplitude = 0.0;  ///< m, 0 or more
  double offset = 0.0;     ///< m
  bool white_is_deep = false;
};

/// A map of stiffness or friction: black and white stand for these values, greys between.
struct GltfValueMap {
  GltfTexture texture;
  double black = 0.0;
  double white = 1.0;
  /// Whether the file states `black` and `white` (extras of asperity): then they are N/m, or a coefficient of friction.
  /// If not they are 0 and 1: a coefficient of friction as it is, of stiffness a share of the surface's own.
  bool stated = false;
};

/// An entry of MPEG_haptic_material that is not rendered, but kept and written back.
struct GltfHapticTexture {
  std::string property;  ///< "stiffness", "friction", "vibrotactileTexture", "temperature", "vibration" or "custom"
  std::string type;      ///< "High_Resolution", "Low_Resolution", "Reference" or "Other"
  GltfTexture texture;
  std::string extras;  ///< JSON; empty: none
};

/// What a glTF material and its haptic material say together.
struct GltfMaterial {
  std::string name;
  std::string haptic_name;
  std::optional<GltfNormals> normals;
  std::optional<GltfHeight> height;
  std::optional<GltfValueMap> stiffness;
  std::optional<GltfValueMap> friction;
  std::vector<GltfHapticTexture> kept;
  /// Whether anything of it can be felt.
  [[nodiscard]] bool felt() const { return normals || height || stiffness || friction; }
};

/// A mesh and its materials.
struct GltfModel {
  MeshSource mesh;  ///< corner UVs are those of each material's maps, KHR_texture_transform applied, v up
  std::vector<GltfMaterial> materials;              ///< one for each material and haptic material worn together
  std::vector<std::uint32_t> material_of_triangle;  ///< one a triangle of `mesh`
};

/// Reads a .gltf or .glb file: its triangles as read_mesh() does, and the materials that they wear. Images may be PNG
/// or JPEG, in buffer views, data URIs or files at relative paths. MPEG_haptic_material is read by its present and its
/// earlier name (MPEG_material_haptic), at meshes, primitives and materials. What is there and not used stands in
/// `mesh.notes`. All maps of one material must lie alike: those whose texture coordinates or KHR_texture_transform
/// differ from the height's (else the normals') are left out with a note.
/// Errors: those of read_mesh() and read_image(); file_malformed, bad_value and bad_key, with the path within the JSON.
/// Images of one file may have max_pixels pixels together (too_large). [build]
Result<GltfModel> read_gltf_model(const std::filesystem::path& path);

/// The same from memory; a glTF that names other files is refused. [build]
Result<GltfModel> read_gltf_model_bytes(std::string_view bytes, const std::string& name);

/// Which triangle of the source each face of the mesh built from it is: building drops triangles without area and keeps
/// the order. `source` as it was given to TriangleMesh::build, `scale` the one of its settings. Errors: mismatch when
/// the mesh is not made from it. [build]
Result<std::vector<std::uint32_t>> source_of_faces(const MeshSource& source, const TriangleMesh& mesh,
                                                   double scale = 1.0);

/// The heights of a material as a map. Errors: those of HeightMap::build. [build]
Result<HeightMap> height_map_of(const GltfHeight& height, Reconstruction reconstruction);

/// The image of normals with `scale` worked in, ready for NormalMap::build with green up; the image itself where scale
/// is 1, else one of 16 bits. Errors: bad_map (no colours), bad_value (scale not finite). [build]
Result<Image> normal_image_of(const GltfNormals& normals);

/// Heights as a 16-bit grey texture whose black and white are the lowest and highest texel: off by at most a
/// 131,070th of their difference. [build]
GltfHeight height_texture_of(const HeightMap& heights);

/// Normals as a 16-bit texture, off by at most 1/65,534 along each axis. [build]
GltfNormals normal_texture_of(const NormalMap& normals);

/// Writes a mesh with its materials as .glb (or, by the extension, .gltf with everything inside): positions and UVs as
/// floats, triangles sorted by material, images as PNG, MPEG_haptic_material by its present name.
/// `material_of_triangle` may be empty: then all wear the first material, or none. A file of glTF that was read comes
/// back bit for bit but for what notes said was left out. Errors: file_unwritable, bad_value (a name with neither
/// extension, amplitude, extras), mismatch (counts), too_large (over 4 GiB). [build] [main]
Status write_gltf(const std::filesystem::path& path, const MeshView& mesh,
                  std::span<const std::uint32_t> material_of_triangle = {},
                  std::span<const GltfMaterial> materials = {});

/// Whether a file of this name would be written as glTF. [any]
bool is_gltf_path(const std::filesystem::path& path);

}  // namespace asperity
