// Writes meshes with their materials as glTF 2.0, text or binary, in one file.

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "asperity/io/atomic_file.h"
#include "asperity/io/detail/file_reading.h"
#include "asperity/io/gltf_material.h"
#include "asperity/io/image_io.h"

namespace asperity {
namespace {

using Json = nlohmann::json;

static_assert(std::endian::native == std::endian::little, "glTF's buffers are little-endian");

constexpr std::uint64_t largest_file = std::numeric_limits<std::uint32_t>::max();
constexpr const char* extension_name = "MPEG_haptic_material";

/// The document and its one buffer, put together piece by piece.
class GltfWriter {
 public:
  GltfWriter(const MeshView& mesh, std::span<const std::uint32_t> material_of_triangle,
             std::span<const GltfMaterial> materials)
      : mesh_(mesh), material_of_triangle_(material_of_triangle), materials_(materials) {}

  Status run() {
    ASPERITY_CHECK(check());
    root_["asset"] = {{"version", "2.0"}, {"generator", "asperity"}};
    // Sorted by material, each as its own mesh: a haptic material belongs to a mesh.
    std::vector<std::vector<std::uint32_t>> parts(std::max<std::size_t>(materials_.size(), 1));
    for (std::uint32_t face = 0; face < mesh_.triangles.size(); ++face) {
      parts[material_of_triangle_.empty() ? 0 : material_of_triangle_[face]].push_back(face);
    }
    Json nodes = Json::array();
    for (std::size_t m = 0; m < parts.size(); ++m) {
      if (parts[m].empty()) continue;
      nodes.push_back(root_["nodes"].size());
      root_["nodes"].push_back({{"mesh", root_["meshes"].size()}});
      ASPERITY_CHECK(add_part(parts[m], materials_.empty() ? nullptr : &materials_[m], m));
    }
    root_["scenes"] = Json::array({{{"nodes", nodes}}});
    root_["scene"] = 0;
    return success();
  }

  Result<std::string> text() {
    root_["buffers"] =
        Json::array({{{"byteLength", data_.size()}, {"uri", "data:application/octet-stream;base64," + base64(data_)}}});
    return root_.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
  }

  Result<std::string> binary() {
    root_["buffers"] = Json::array({{{"byteLength", data_.size()}}});
    std::string words = root_.dump(-1, ' ', false, Json::error_handler_t::replace);
    words.resize((words.size() + 3) / 4 * 4, ' ');
    align();
    const std::uint64_t size = 12 + 8 + words.size() + 8 + data_.size();
    if (size > largest_file) return too_large(size);
    std::string bytes = "glTF";
    const auto put = [&](std::uint64_t number) {
      for (unsigned i = 0; i < 4; ++i) bytes += static_cast<char>((number >> (8 * i)) & 255U);
    };
    put(2);
    put(size);
    put(words.size());
    bytes += "JSON" + words;
    put(data_.size());
    bytes += std::string("BIN\0", 4) + data_;
    return bytes;
  }

 private:
  static Error too_large(std::uint64_t size) {
    return refused(ErrorCode::too_large, fmt::format("would have {} bytes", size), {}, "up to 4 GiB");
  }

  [[nodiscard]] Status check() const {
    if (mesh_.triangles.empty())
      return refused(ErrorCode::bad_mesh, "has no triangles", "mesh", "at least one triangle");
    if (!mesh_.corner_uvs.empty() && mesh_.corner_uvs.size() != mesh_.triangles.size()) {
      return refused(ErrorCode::mismatch,
                     fmt::format("has UVs for {} of {} triangles", mesh_.corner_uvs.size(), mesh_.triangles.size()),
                     "mesh", "none, or those of every triangle");
    }
    if (!material_of_triangle_.empty()) {
      const auto most = *std::max_element(material_of_triangle_.begin(), material_of_triangle_.end());
      if (material_of_triangle_.size() != mesh_.triangles.size() || most >= materials_.size()) {
        return refused(ErrorCode::mismatch,
                       fmt::format("are {} for {} triangles, up to {} of {} materials", material_of_triangle_.size(),
                                   mesh_.triangles.size(), most, materials_.size()),
                       "material_of_triangle", "one number of a material for every triangle");
      }
    }
    for (std::size_t m = 0; m < materials_.size(); ++m) {
      if (materials_[m].felt() && mesh_.corner_uvs.empty()) {
        return refused(ErrorCode::mismatch, "has maps, but the mesh has no UVs", fmt::format("materials[{}]", m),
                       "a mesh with UVs");
      }
    }
    return success();
  }

  void align() { data_.resize((data_.size() + 3) / 4 * 4, '\0'); }

  std::size_t add_view(std::string_view bytes, int target) {
    align();
    Json view = {{"buffer", 0}, {"byteOffset", data_.size()}, {"byteLength", bytes.size()}};
    if (target > 0) view["target"] = target;
    data_ += bytes;
    root_["bufferViews"].push_back(std::move(view));
    return root_["bufferViews"].size() - 1;
  }

  template <class Number>
  std::size_t add_accessor(const std::vector<Number>& numbers, std::size_t components, const char* type, int component,
                           int target) {
    const std::string_view bytes(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number));
    root_["accessors"].push_back({{"bufferView", add_view(bytes, target)},
                                  {"componentType", component},
                                  {"count", numbers.size() / components},
                                  {"type", type}});
    return root_["accessors"].size() - 1;
  }

  Status add_part(const std::vector<std::uint32_t>& faces, const GltfMaterial* material, std::size_t number) {
    constexpr int vertex_target = 34962;
    constexpr int index_target = 34963;
    const bool has_uvs = !mesh_.corner_uvs.empty();
    std::vector<float> positions;
    std::vector<float> uvs;
    std::vector<std::uint32_t> indices;
    // Corners that share a position and a UV are one vertex.
    std::map<std::array<std::uint32_t, 3>, std::uint32_t> vertices;
    for (const std::uint32_t face : faces) {
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const std::uint32_t position = mesh_.triangles[face][corner];
        const Vec2f uv = has_uvs ? mesh_.corner_uvs[face][corner] : Vec2f(Vec2f::Zero());
        const auto [known, added] =
            vertices.try_emplace({position, std::bit_cast<std::uint32_t>(uv.x()), std::bit_cast<std::uint32_t>(uv.y())},
                                 static_cast<std::uint32_t>(vertices.size()));
        indices.push_back(known->second);
        if (!added) continue;
        for (int axis = 0; axis < 3; ++axis) {
          const auto value = static_cast<float>(mesh_.positions[position][axis]);
          if (!std::isfinite(value)) {
            return refused(ErrorCode::bad_mesh, fmt::format("vertex {} is beyond single precision", position), "mesh",
                           "coordinates that are finite as floats");
          }
          positions.push_back(value);
        }
        // glTF counts v down from a map's upper edge.
        uvs.push_back(uv.x());
        uvs.push_back(1.0F - uv.y());
      }
    }
    Json primitive = {{"mode", 4}};
    const std::size_t place = add_accessor(positions, 3, "VEC3", 5126, vertex_target);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      float low = positions[axis];
      float high = positions[axis];
      for (std::size_t i = axis; i < positions.size(); i += 3) {
        low = std::min(low, positions[i]);
        high = std::max(high, positions[i]);
      }
      root_["accessors"][place]["min"].push_back(low);
      root_["accessors"][place]["max"].push_back(high);
    }
    primitive["attributes"]["POSITION"] = place;
    if (has_uvs) primitive["attributes"]["TEXCOORD_0"] = add_accessor(uvs, 2, "VEC2", 5126, vertex_target);
    primitive["indices"] = add_accessor(indices, 1, "SCALAR", 5125, index_target);
    Json mesh = Json::object();
    if (material != nullptr) {
      primitive["material"] = root_["materials"].size();
      ASPERITY_TRY(const int haptic, add_material(*material, fmt::format("materials[{}]", number)));
      if (haptic >= 0) mesh["extensions"][extension_name]["hapticMaterialIndex"] = haptic;
    }
    mesh["primitives"] = Json::array({primitive});
    root_["meshes"].push_back(std::move(mesh));
    return data_.size() > largest_file ? Status(too_large(data_.size())) : success();
  }

  Result<std::size_t> add_texture(const GltfTexture& texture, const std::string& place) {
    if (!texture.image) return bad_value("has no image", place, "an image");
    const std::pair<const Image*, Wrap> key{texture.image.get(), texture.wrap};
    if (const auto known = textures_.find(key); known != textures_.end()) return known->second;
    if (!images_.contains(key.first)) {
      ASPERITY_TRY(const std::string png, at_place(encode_png(*texture.image), place));
      images_[key.first] = root_["images"].size();
      root_["images"].push_back({{"bufferView", add_view(png, 0)}, {"mimeType", "image/png"}});
    }
    if (!samplers_.contains(texture.wrap)) {
      const int mode = texture.wrap == Wrap::clamp ? 33071 : 10497;
      samplers_[texture.wrap] = root_["samplers"].size();
      root_["samplers"].push_back({{"wrapS", mode}, {"wrapT", mode}});
    }
    textures_[key] = root_["textures"].size();
    root_["textures"].push_back({{"source", images_[key.first]}, {"sampler", samplers_[texture.wrap]}});
    return textures_[key];
  }

  /// The index of its haptic material; -1: none.
  Result<int> add_material(const GltfMaterial& material, const std::string& place) {
    Json json = {{"pbrMetallicRoughness", {{"metallicFactor", 0.0}}}};
    if (!material.name.empty()) json["name"] = material.name;
    if (material.normals) {
      if (!std::isfinite(material.normals->scale))
        return bad_value("is not finite", place + ".normals.scale", "a finite number");
      ASPERITY_TRY(json["normalTexture"]["index"], add_texture(material.normals->texture, place + ".normals"));
      if (material.normals->scale != 1.0) json["normalTexture"]["scale"] = material.normals->scale;
    }
    if (material.height) {
      const GltfHeight& height = *material.height;
      if (!(height.amplitude >= 0.0) || !std::isfinite(height.amplitude) || !std::isfinite(height.offset)) {
        return bad_value(fmt::format("is {} m over {} m", height.amplitude, height.offset), place + ".height",
                         "an amplitude of 0 or more and a finite offset");
      }
      Json& own = json["extras"]["asperity"];
      ASPERITY_TRY(own["height_texture"]["index"], add_texture(height.texture, place + ".height"));
      own["height_texture"]["texCoord"] = 0;
      own["amplitude"] = height.amplitude;
      own["offset"] = height.offset;
      own["white_is"] = height.white_is_deep ? "deep" : "high";
    }
    root_["materials"].push_back(std::move(json));
    return add_haptic(material, place);
  }

  Result<int> add_haptic(const GltfMaterial& material, const std::string& place) {
    Json json = Json::object();
    if (!material.haptic_name.empty()) json["name"] = material.haptic_name;
    const auto add_map = [&](const std::optional<GltfValueMap>& map, const char* property) -> Status {
      if (!map) return success();
      const std::string at = fmt::format("{}.{}", place, property);
      Json entry = {{"type", "High_Resolution"}};
      ASPERITY_TRY(entry["texture"]["index"], add_texture(map->texture, at));
      if (map->stated) {
        if (!std::isfinite(map->black) || !std::isfinite(map->white) || map->black < 0.0 || map->white < 0.0)
          return bad_value(fmt::format("is {} to {}", map->black, map->white), at, "two numbers of 0 or more");
        entry["extras"]["asperity"] = {{"black", map->black}, {"white", map->white}};
      }
      json[property].push_back(std::move(entry));
      return success();
    };
    ASPERITY_CHECK(add_map(material.stiffness, "stiffness"));
    ASPERITY_CHECK(add_map(material.friction, "friction"));
    for (std::size_t i = 0; i < material.kept.size(); ++i) {
      const GltfHapticTexture& kept = material.kept[i];
      const std::string at = fmt::format("{}.kept[{}]", place, i);
      Json entry = {{"type", kept.type}};
      ASPERITY_TRY(entry["texture"]["index"], add_texture(kept.texture, at));
      if (!kept.extras.empty()) {
        entry["extras"] = Json::parse(kept.extras, nullptr, false);
        if (entry["extras"].is_discarded()) return bad_value("is not JSON", at + ".extras", "JSON, or nothing");
      }
      json[kept.property].push_back(std::move(entry));
    }
    if (json.empty()) return -1;
    root_["extensionsUsed"] = Json::array({extension_name});
    Json& list = root_["extensions"][extension_name]["materials"];
    list.push_back(std::move(json));
    return static_cast<int>(list.size()) - 1;
  }

  const MeshView& mesh_;
  std::span<const std::uint32_t> material_of_triangle_;
  std::span<const GltfMaterial> materials_;
  Json root_ = Json::object();
  std::string data_;
  std::map<const Image*, std::size_t> images_;
  std::map<Wrap, std::size_t> samplers_;
  std::map<std::pair<const Image*, Wrap>, std::size_t> textures_;
};

Result<std::string> encode(const std::filesystem::path& path, const MeshView& mesh,
                           std::span<const std::uint32_t> material_of_triangle,
                           std::span<const GltfMaterial> materials) {
  if (!is_gltf_path(path)) return bad_value("is no name of a glTF file", {}, ".glb, .gltf");
  try {
    GltfWriter writer(mesh, material_of_triangle, materials);
    ASPERITY_CHECK(writer.run());
    return lower_extension(path) == ".glb" ? writer.binary() : writer.text();
  } catch (const std::bad_alloc&) {
    return refused(ErrorCode::too_large, "there is no memory to write it", {}, "a smaller model");
  }
}

}  // namespace

bool is_gltf_path(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".glb" || extension == ".gltf";
}

Status write_gltf(const std::filesystem::path& path, const MeshView& mesh,
                  std::span<const std::uint32_t> material_of_triangle, std::span<const GltfMaterial> materials) {
  ASPERITY_TRY(const std::string bytes, in_file(encode(path, mesh, material_of_triangle, materials), path.string()));
  return write_file_atomically(path, bytes);
}

}  // namespace asperity
