#pragma once
// Private to asperity/io: the containers of glTF 2.0 (.gltf, .glb), the strict check of their JSON, and their buffers.
// tinygltf reads beyond a damaged .glb, takes a default for a key of the wrong type, and opens every file it is told
// to; so it gets the JSON that passed here and nothing else.

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/result.h"

namespace asperity::mesh_readers {

/// Sets of texture coordinates that a mesh may have: TEXCOORD_0 and on.
inline constexpr int most_texcoords = 8;

/// What of a file is looked at.
enum class GltfParts { geometry, geometry_and_materials };

/// The Error of a file that is not the JSON it should be: what is there, where, and what should be. [any]
Error malformed(std::string what, std::string place, std::string accepted);

/// A glTF file taken apart and checked. Errors carry no file name, their place is the path within the JSON.
class GltfDocument {
 public:
  /// `bytes` must outlive the document. `folder` is where the files that it names lie; none: they are refused.
  /// Errors: file_truncated, file_malformed (no JSON, a key of the wrong type), file_unsupported (another version of
  /// glTF, an extension that it requires), bad_mesh (a reference out of range), too_large. [build]
  static Result<GltfDocument> open(std::string_view bytes, const std::filesystem::path* folder,
                                   GltfParts parts = GltfParts::geometry);

  /// The JSON's geometry: scenes, nodes, meshes, accessors and buffer views. Every value has its type, every reference
  /// is in range. [build]
  [[nodiscard]] const std::string& geometry_json() const { return geometry_; }
  /// The bytes of a buffer, exactly as many as it promises; read on first use. Errors: file_missing, file_truncated,
  /// file_malformed, file_unsupported, too_large. [build]
  Result<std::string_view> buffer(std::size_t index);
  /// The JSON's meshes, materials, textures, samplers, images and root extensions as they stand in the file, nothing
  /// checked; empty unless they were asked for. [build]
  [[nodiscard]] const std::string& material_json() const { return materials_; }
  /// The bytes of a buffer view (its stride is not looked at). Errors: those of buffer(), bad_mesh. [build]
  Result<std::string_view> view(std::size_t index);
  /// The bytes that a URI stands for: base64 data, or a file at a relative path. `place` is that of the URI. Errors:
  /// file_missing, file_malformed, file_unsupported, too_large. [build]
  Result<std::string> resource(const std::string& uri, const std::string& place) const;
  /// What was found and left out. [build]
  [[nodiscard]] std::vector<std::string>& notes() { return notes_; }

 private:
  struct Buffer {
    std::string uri;
    std::size_t length = 0;
    std::unique_ptr<std::string> bytes;
  };

  struct View {
    std::size_t buffer = 0;
    std::size_t offset = 0;
    std::size_t length = 0;
  };

  Status read_container(std::string_view bytes);
  Status read_json(GltfParts parts);
  [[nodiscard]] Result<std::filesystem::path> resolve(const std::string& uri, const std::string& place) const;
  Status read_external(Buffer& buffer, const std::string& place) const;

  const std::filesystem::path* folder_ = nullptr;
  std::string_view json_;
  std::string_view binary_;  ///< the .glb file's own buffer; empty where there is none
  bool has_binary_ = false;
  std::string geometry_;
  std::string materials_;
  std::vector<Buffer> buffers_;
  std::vector<View> views_;
  std::vector<std::string> notes_;
};

}  // namespace asperity::mesh_readers
