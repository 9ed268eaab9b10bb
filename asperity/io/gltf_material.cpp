// What the materials of a glTF file say about touch.

#include "asperity/io/gltf_material.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>

#include "asperity/io/detail/file_reading.h"
#include "asperity/io/detail/gltf_looks.h"
#include "asperity/io/detail/mesh_readers.h"
#include "asperity/io/image_io.h"

namespace asperity {
namespace {

using Json = nlohmann::json;
using mesh_readers::GltfDocument;
using mesh_readers::malformed;
using mesh_readers::PrimitiveLook;
using mesh_readers::PrimitiveLooks;

/// The present name, and that of the drafts of 2022 and 2023.
constexpr const char* haptic_extensions[] = {"MPEG_haptic_material", "MPEG_material_haptic"};
constexpr const char* haptic_properties[] = {"stiffness",   "friction",  "vibrotactileTexture",
                                             "temperature", "vibration", "custom"};
constexpr const char* texture_types[] = {"High_Resolution", "Low_Resolution", "Reference", "Other"};

/// The member of that name, if `from` is an object that has it.
const Json* member(const Json& from, const char* key) {
  return from.is_object() && from.contains(key) ? &from[key] : nullptr;
}

const Json* member(const Json* from, const char* key) {
  return from == nullptr ? nullptr : member(*from, key);
}

Result<int> index_in(const Json& value, std::size_t count, const char* section, const std::string& place) {
  if (!value.is_number_unsigned()) return malformed("is no index", place, "a whole number from 0");
  if (value.get<std::uint64_t>() >= count) {
    return malformed(fmt::format("refers to {}[{}] of {}", section, value.get<std::uint64_t>(), count), place,
                     "indices of things that are there");
  }
  return value.get<int>();
}

std::size_t count_of(const Json& root, const char* section) {
  const Json* found = member(root, section);
  return found != nullptr && found->is_array() ? found->size() : 0;
}

Result<double> number_at(const Json& object, const char* key, double fallback, const std::string& place,
                         bool negative = true) {
  const Json* value = member(object, key);
  if (value == nullptr) return fallback;
  const double number = value->is_number() ? value->get<double>() : std::nan("");
  if (std::isfinite(number) && (negative || number >= 0.0)) return number;
  return malformed("is no such number", fmt::format("{}.{}", place, key),
                   negative ? "a finite number" : "a number of 0 or more");
}

std::string text_of(const Json* value) {
  return value != nullptr && value->is_string() ? value->get<std::string>() : std::string();
}

/// A textureInfo: which texture, and how it lies.
struct TextureInfo {
  int texture = 0;
  PrimitiveLook lie;
  std::string place;
  [[nodiscard]] bool lies_as(const TextureInfo& other) const {
    return lie.texcoord == other.lie.texcoord && lie.matrix == other.lie.matrix;
  }
};

/// A haptic entry before its image is read.
struct Entry {
  std::string property;
  std::string type;
  TextureInfo info;
  const Json* extras = nullptr;
};

/// A material before its images are read.
struct Plan {
  GltfMaterial material;
  std::optional<TextureInfo> normals;
  std::optional<TextureInfo> height;
  std::vector<Entry> entries;
};

/// What `extras.asperity` may hold.
Status only_keys(const Json& object, std::initializer_list<std::string_view> known, const std::string& place) {
  if (!object.is_object()) return malformed("is no object", place, "an object");
  for (const auto& [key, value] : object.items()) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    std::string accepted;
    for (const std::string_view name : known) accepted += (accepted.empty() ? "" : ", ") + std::string(name);
    return refused(ErrorCode::bad_key, "is not read", fmt::format("{}.{}", place, key.substr(0, 60)), accepted);
  }
  return success();
}

Result<PrimitiveLook> read_lie(const Json& info, const std::string& place) {
  PrimitiveLook lie;
  const auto set = [&](const Json& from, const std::string& at) -> Status {
    const Json* texcoord = member(from, "texCoord");
    if (texcoord == nullptr) return success();
    if (!texcoord->is_number_unsigned() || texcoord->get<std::uint64_t>() >= mesh_readers::most_texcoords) {
      return malformed("is no set of texture coordinates", at + ".texCoord",
                       fmt::format("0 to {}", mesh_readers::most_texcoords - 1));
    }
    lie.texcoord = texcoord->get<int>();
    return success();
  };
  ASPERITY_CHECK(set(info, place));
  const Json* moved = member(member(info, "extensions"), "KHR_texture_transform");
  if (moved == nullptr) return lie;
  const std::string at = place + ".extensions.KHR_texture_transform";
  if (!moved->is_object()) return malformed("is no object", at, "an object");
  ASPERITY_CHECK(set(*moved, at));
  const auto pair = [&](const char* key, double fallback) -> Result<Vec2> {
    const Json* value = member(*moved, key);
    if (value == nullptr) return Vec2(fallback, fallback);
    const bool good = value->is_array() && value->size() == 2 && (*value)[0].is_number() && (*value)[1].is_number();
    if (!good) return malformed("is no pair of numbers", fmt::format("{}.{}", at, key), "two numbers");
    return Vec2((*value)[0].get<double>(), (*value)[1].get<double>());
  };
  ASPERITY_TRY(const Vec2 offset, pair("offset", 0.0));
  ASPERITY_TRY(const Vec2 scale, pair("scale", 1.0));
  ASPERITY_TRY(const double angle, number_at(*moved, "rotation", 0.0, at));
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  lie.moved = true;
  lie.matrix = {c * scale.x(), s * scale.y(), offset.x(), -s * scale.x(), c * scale.y(), offset.y()};
  return lie;
}

/// Reads the JSON of materials: plans of what triangles wear, and how the maps of each primitive lie.
class MaterialPlanner {
 public:
  MaterialPlanner(const Json& root, std::vector<std::string>& notes) : root_(root), notes_(notes) {}

  Result<PrimitiveLooks> run() {
    ASPERITY_CHECK(find_haptic_materials());
    PrimitiveLooks looks;
    const std::size_t meshes = count_of(root_, "meshes");
    for (std::size_t m = 0; m < meshes; ++m) {
      const Json& mesh = root_["meshes"][m];
      const std::string place = fmt::format("meshes[{}]", m);
      auto& row = looks.emplace_back();
      for (std::size_t p = 0; p < count_of(mesh, "primitives"); ++p) {
        ASPERITY_TRY(const PrimitiveLook look,
                     look_of(mesh, mesh["primitives"][p], place, fmt::format("{}.primitives[{}]", place, p)));
        row.push_back(look);
      }
    }
    return looks;
  }

  [[nodiscard]] std::vector<Plan>& plans() { return plans_; }

 private:
  /// A material and a haptic material; -1: none.
  using Worn = std::pair<int, int>;

  Status find_haptic_materials() {
    const Json* extensions = member(root_, "extensions");
    for (const char* name : haptic_extensions) {
      const Json* extension = member(extensions, name);
      if (extension == nullptr || haptic_ != nullptr) continue;
      haptic_place_ = fmt::format("extensions.{}.materials", name);
      haptic_ = member(*extension, "materials");
      if (haptic_ == nullptr || !haptic_->is_array() || haptic_->empty())
        return malformed("is no list of haptic materials", haptic_place_, "an array of at least one");
    }
    return success();
  }

  /// The haptic material that a mesh, primitive or material names; -1: none.
  Result<int> haptic_index(const Json& from, const std::string& place, int fallback) {
    for (const char* name : haptic_extensions) {
      const Json* extension = member(member(from, "extensions"), name);
      if (extension == nullptr) continue;
      const std::string at = fmt::format("{}.extensions.{}", place, name);
      const Json* index = extension->is_object() ? member(*extension, "hapticMaterialIndex") : extension;
      if (index == nullptr)
        return malformed("is missing", at + ".hapticMaterialIndex", "the index of a haptic material");
      return index_in(*index, haptic_ == nullptr ? 0 : haptic_->size(), "haptic materials",
                      extension->is_object() ? at + ".hapticMaterialIndex" : at);
    }
    return fallback;
  }

  Result<PrimitiveLook> look_of(const Json& mesh, const Json& primitive, const std::string& mesh_place,
                                const std::string& place) {
    Worn worn{-1, -1};
    ASPERITY_TRY(worn.second, haptic_index(mesh, mesh_place, -1));
    ASPERITY_TRY(worn.second, haptic_index(primitive, place, worn.second));
    if (const Json* material = member(primitive, "material")) {
      ASPERITY_TRY(worn.first, index_in(*material, count_of(root_, "materials"), "materials", place + ".material"));
      const std::string at = fmt::format("materials[{}]", worn.first);
      ASPERITY_TRY(worn.second,
                   haptic_index(root_["materials"][static_cast<std::size_t>(worn.first)], at, worn.second));
    }
    const auto [known, added] = numbers_.try_emplace(worn, looks_.size());
    if (added) {
      ASPERITY_TRY(PrimitiveLook look, plan(worn));
      look.number = static_cast<std::uint32_t>(looks_.size());
      looks_.push_back(look);
    }
    return looks_[known->second];
  }

  Result<TextureInfo> texture_info(const Json& info, const std::string& place) {
    TextureInfo read;
    read.place = place;
    const Json* index = member(info, "index");
    if (index == nullptr) return malformed("is missing", place + ".index", "the index of a texture");
    ASPERITY_TRY(read.texture, index_in(*index, count_of(root_, "textures"), "textures", place + ".index"));
    ASPERITY_TRY(read.lie, read_lie(info, place));
    return read;
  }

  Result<PrimitiveLook> plan(const Worn& worn) {
    Plan& plan = plans_.emplace_back();
    if (worn.first >= 0) {
      ASPERITY_CHECK(read_material(root_["materials"][static_cast<std::size_t>(worn.first)],
                                   fmt::format("materials[{}]", worn.first), plan));
    }
    if (worn.second >= 0) {
      ASPERITY_CHECK(read_haptic((*haptic_)[static_cast<std::size_t>(worn.second)],
                                 fmt::format("{}[{}]", haptic_place_, worn.second), plan));
    }
    return make_alike(plan);
  }

  Status read_material(const Json& json, const std::string& place, Plan& plan) {
    plan.material.name = text_of(member(json, "name"));
    if (const Json* normal = member(json, "normalTexture")) {
      ASPERITY_TRY(plan.normals, texture_info(*normal, place + ".normalTexture"));
      GltfNormals normals;
      ASPERITY_TRY(normals.scale, number_at(*normal, "scale", 1.0, place + ".normalTexture"));
      plan.material.normals = normals;
    }
    const Json* own = member(member(json, "extras"), "asperity");
    if (own == nullptr) return success();
    const std::string at = place + ".extras.asperity";
    ASPERITY_CHECK(only_keys(*own, {"height_texture", "amplitude", "offset", "white_is"}, at));
    const Json* texture = member(*own, "height_texture");
    if (texture == nullptr) return malformed("is missing", at + ".height_texture", "a texture: {\"index\": 0}");
    return read_height(*own, at, *texture, at + ".height_texture", plan);
  }

  Status read_height(const Json& own, const std::string& place, const Json& texture, const std::string& texture_place,
                     Plan& plan) {
    GltfHeight height;
    if (member(own, "amplitude") == nullptr) {
      return malformed("is missing", place + ".amplitude", "the heights of white over black in metres, 0 or more");
    }
    ASPERITY_TRY(height.amplitude, number_at(own, "amplitude", 0.0, place, false));
    ASPERITY_TRY(height.offset, number_at(own, "offset", 0.0, place));
    if (const Json* white = member(own, "white_is")) {
      const std::string text = text_of(white);
      if (text != "high" && text != "deep") return bad_value("is neither", place + ".white_is", "\"high\", \"deep\"");
      height.white_is_deep = text == "deep";
    }
    ASPERITY_TRY(plan.height, texture_info(texture, texture_place));
    plan.material.height = height;
    return success();
  }

  Status read_haptic(const Json& json, const std::string& place, Plan& plan) {
    if (!json.is_object()) return malformed("is no object", place, "an object");
    plan.material.haptic_name = text_of(member(json, "name"));
    if (json.contains("haptic")) {
      notes_.push_back(place + ".haptic left out: signals of MPEG_haptic are not read");
    }
    for (const char* property : haptic_properties) {
      const Json* list = member(json, property);
      // The schema's own text has it both ways.
      if (list == nullptr && std::string_view(property) == "stiffness") list = member(json, "stifness");
      if (list == nullptr) continue;
      const std::string at = fmt::format("{}.{}", place, property);
      if (list->is_object()) {
        ASPERITY_CHECK(read_entry(property, *list, at, plan));
        continue;
      }
      if (!list->is_array()) return malformed("is no list of textures", at, "an array of textures");
      for (std::size_t i = 0; i < list->size(); ++i)
        ASPERITY_CHECK(read_entry(property, (*list)[i], fmt::format("{}[{}]", at, i), plan));
    }
    return success();
  }

  Status read_entry(const char* property, const Json& json, const std::string& place, Plan& plan) {
    Entry entry;
    entry.property = property;
    const Json* texture = member(json, "texture");
    if (texture == nullptr) return malformed("is missing", place + ".texture", "a texture: {\"index\": 0}");
    ASPERITY_TRY(entry.info, texture_info(*texture, place + ".texture"));
    const Json* type = member(json, "type");
    entry.type = type == nullptr ? "High_Resolution" : text_of(type);
    if (std::find(std::begin(texture_types), std::end(texture_types), entry.type) == std::end(texture_types)) {
      return bad_value("is no such type", place + ".type",
                       "\"High_Resolution\", \"Low_Resolution\", \"Reference\", \"Other\"");
    }
    entry.extras = member(json, "extras");
    const Json* own = member(entry.extras, "asperity");
    const std::string at = place + ".extras.asperity";
    if (own != nullptr && entry.property == "vibrotactileTexture") {
      ASPERITY_CHECK(only_keys(*own, {"amplitude", "offset", "white_is"}, at));
      if (!plan.height) return read_height(*own, at, *texture, place + ".texture", plan);
    } else if (own != nullptr && (entry.property == "stiffness" || entry.property == "friction")) {
      ASPERITY_CHECK(only_keys(*own, {"black", "white"}, at));
    }
    if (own == nullptr || entry.property != "vibrotactileTexture") return take_entry(std::move(entry), own, at, plan);
    plan.entries.push_back(std::move(entry));
    return success();
  }

  /// The first stiffness and the first friction that are plain images become maps.
  Status take_entry(Entry entry, const Json* own, const std::string& place, Plan& plan) {
    std::optional<GltfValueMap>* map = entry.property == "stiffness"  ? &plan.material.stiffness
                                       : entry.property == "friction" ? &plan.material.friction
                                                                      : nullptr;
    if (map != nullptr && !map->has_value() && entry.type != "Reference") {
      GltfValueMap read;
      if (own != nullptr) {
        read.stated = true;
        ASPERITY_TRY(read.black, number_at(*own, "black", 0.0, place, false));
        ASPERITY_TRY(read.white, number_at(*own, "white", 1.0, place, false));
      }
      *map = read;
      entry.type.clear();  // says that the map is this one
    }
    plan.entries.push_back(std::move(entry));
    return success();
  }

  /// One mesh has one set of coordinates: maps that lie otherwise than the leading one are left out.
  PrimitiveLook make_alike(Plan& plan) {
    const auto lead = [&]() -> std::optional<TextureInfo> {
      if (plan.height) return plan.height;
      if (plan.normals) return plan.normals;
      return plan.entries.empty() ? std::nullopt : std::optional(plan.entries.front().info);
    }();
    if (!lead) return {};
    const auto differs = [&](const TextureInfo& info) {
      if (info.lies_as(*lead)) return false;
      notes_.push_back(
          fmt::format("{} left out: its texture coordinates are not those of {}", info.place, lead->place));
      return true;
    };
    if (plan.normals && differs(*plan.normals)) {
      plan.normals.reset();
      plan.material.normals.reset();
    }
    std::erase_if(plan.entries, [&](const Entry& entry) {
      if (!differs(entry.info)) return false;
      if (entry.type.empty())
        (entry.property == "stiffness" ? plan.material.stiffness : plan.material.friction).reset();
      return true;
    });
    PrimitiveLook look = lead->lie;
    look.needs_uvs = true;
    return look;
  }

  const Json& root_;
  std::vector<std::string>& notes_;
  const Json* haptic_ = nullptr;
  std::string haptic_place_;
  std::map<Worn, std::size_t> numbers_;
  std::vector<PrimitiveLook> looks_;
  std::vector<Plan> plans_;
};

/// Decodes every image once.
class ImageLoader {
 public:
  ImageLoader(const Json& root, GltfDocument& document, std::vector<std::string>& notes)
      : root_(root), document_(document), notes_(notes) {}

  Result<GltfTexture> texture(int index) {
    const std::string place = fmt::format("textures[{}]", index);
    const Json& json = root_["textures"][static_cast<std::size_t>(index)];
    const Json* source = member(json, "source");
    if (source == nullptr) {
      return refused(ErrorCode::file_unsupported, "names no PNG or JPEG", place + ".source", "the index of an image");
    }
    ASPERITY_TRY(const int image, index_in(*source, count_of(root_, "images"), "images", place + ".source"));
    GltfTexture texture;
    ASPERITY_TRY(texture.wrap, wrap_of(json, place));
    ASPERITY_TRY(texture.image, load(image));
    texture.source = names_[image];
    return texture;
  }

 private:
  Result<Wrap> wrap_of(const Json& texture, const std::string& place) {
    const Json* sampler = member(texture, "sampler");
    if (sampler == nullptr) return Wrap::repeat;
    ASPERITY_TRY(const int index, index_in(*sampler, count_of(root_, "samplers"), "samplers", place + ".sampler"));
    const Json& json = root_["samplers"][static_cast<std::size_t>(index)];
    constexpr int repeat = 10497;
    constexpr int clamp = 33071;
    constexpr int mirror = 33648;
    int modes[2] = {repeat, repeat};
    for (int axis = 0; axis < 2; ++axis) {
      const char* key = axis == 0 ? "wrapS" : "wrapT";
      const Json* mode = member(json, key);
      if (mode == nullptr) continue;
      const bool known = mode->is_number_unsigned() && (*mode == repeat || *mode == clamp || *mode == mirror);
      if (!known)
        return malformed("is no way to wrap", fmt::format("samplers[{}].{}", index, key), "10497, 33071, 33648");
      modes[axis] = mode->get<int>();
    }
    if (modes[0] == modes[1] && modes[0] != mirror) return modes[0] == clamp ? Wrap::clamp : Wrap::repeat;
    const std::string note =
        fmt::format("samplers[{}] mirrors or wraps the two axes differently: its maps repeat along both", index);
    if (std::find(notes_.begin(), notes_.end(), note) == notes_.end()) notes_.push_back(note);
    return Wrap::repeat;
  }

  Result<std::shared_ptr<const Image>> load(int index) {
    if (const auto known = images_.find(index); known != images_.end()) return known->second;
    const std::string place = fmt::format("images[{}]", index);
    const Json& json = root_["images"][static_cast<std::size_t>(index)];
    const Json* uri = member(json, "uri");
    const Json* view = member(json, "bufferView");
    std::string held;
    std::string_view bytes;
    std::string name = text_of(member(json, "name"));
    if (uri != nullptr && uri->is_string()) {
      const auto& text = uri->get_ref<const std::string&>();
      if (!text.starts_with("data:")) name = text.substr(0, 200);
      ASPERITY_TRY(held, document_.resource(text, place + ".uri"));
      bytes = held;
    } else if (view != nullptr && view->is_number_unsigned()) {
      ASPERITY_TRY(bytes, document_.view(view->get<std::size_t>()));
    } else {
      return malformed("names no data", place, "a uri or a bufferView");
    }
    Result<Image> image = read_image_bytes(bytes, name);
    if (!image) {
      Error error = std::move(image).error();
      error.file.clear();
      error.place = error.place.empty() ? place : fmt::format("{}, {}", place, error.place);
      if (error.accepted.empty()) error.accepted = "a PNG or a JPEG";
      return error;
    }
    if (image->pixels() > max_pixels - pixels_) {
      return refused(ErrorCode::too_large, "brings the images to too many pixels", place,
                     fmt::format("at most {} together", max_pixels));
    }
    pixels_ += image->pixels();
    names_[index] = name.empty() ? place : fmt::format("{} ({})", place, name);
    return images_[index] = std::make_shared<const Image>(std::move(*image));
  }

  const Json& root_;
  GltfDocument& document_;
  std::vector<std::string>& notes_;
  std::map<int, std::shared_ptr<const Image>> images_;
  std::map<int, std::string> names_;
  std::size_t pixels_ = 0;
};

Result<GltfMaterial> finish(Plan plan, ImageLoader& images, std::vector<std::string>& notes) {
  GltfMaterial& material = plan.material;
  if (plan.normals) {
    ASPERITY_TRY(material.normals->texture, images.texture(plan.normals->texture));
    if (!material.normals->texture.image->has_colour()) {
      return refused(ErrorCode::bad_map, "has no colours, and so no normals", plan.normals->place,
                     "an image of red, green and blue");
    }
  }
  if (plan.height) {
    ASPERITY_TRY(material.height->texture, images.texture(plan.height->texture));
  }
  for (Entry& entry : plan.entries) {
    ASPERITY_TRY(GltfTexture texture, images.texture(entry.info.texture));
    if (entry.type.empty()) {
      (entry.property == "stiffness" ? material.stiffness : material.friction)->texture = std::move(texture);
      continue;
    }
    notes.push_back(fmt::format("{} is kept, not felt", entry.info.place));
    material.kept.push_back(
        {entry.property, entry.type, std::move(texture), entry.extras == nullptr ? "" : entry.extras->dump()});
  }
  return std::move(material);
}

Result<GltfModel> read_model(std::string_view bytes, const std::filesystem::path* folder) {
  ASPERITY_TRY(GltfDocument document,
               GltfDocument::open(bytes, folder, mesh_readers::GltfParts::geometry_and_materials));
  const Json root = Json::parse(document.material_json());
  std::vector<std::string> notes;
  MaterialPlanner planner(root, notes);
  ASPERITY_TRY(const PrimitiveLooks looks, planner.run());
  ASPERITY_TRY(mesh_readers::GltfTriangles triangles, mesh_readers::read_triangles(document, &looks));
  GltfModel model;
  model.mesh = std::move(triangles.mesh);
  model.material_of_triangle = std::move(triangles.look_of_triangle);
  ImageLoader images(root, document, notes);
  std::vector<std::uint32_t> moved(planner.plans().size(), no_index);
  for (std::uint32_t& number : model.material_of_triangle) {
    if (moved[number] == no_index) {
      moved[number] = static_cast<std::uint32_t>(model.materials.size());
      ASPERITY_TRY(GltfMaterial material, finish(std::move(planner.plans()[number]), images, notes));
      model.materials.push_back(std::move(material));
    }
    number = moved[number];
  }
  model.mesh.notes.insert(model.mesh.notes.end(), notes.begin(), notes.end());
  return model;
}

Result<GltfModel> read_named(std::string_view bytes, const std::string& name, const std::filesystem::path* folder) {
  constexpr const char* accepted = "a glTF 2.0 file (.gltf or .glb)";
  try {
    if (bytes.empty()) return refused_file(ErrorCode::file_empty, "is empty", name, accepted);
    return in_file(read_model(bytes, folder), name);
  } catch (const std::exception& problem) {
    return refused_file(ErrorCode::too_large, fmt::format("cannot be held in memory ({})", problem.what()), name,
                        accepted);
  }
}

}  // namespace

Result<GltfModel> read_gltf_model_bytes(std::string_view bytes, const std::string& name) {
  return read_named(bytes, name, nullptr);
}

Result<GltfModel> read_gltf_model(const std::filesystem::path& path) {
  ASPERITY_TRY(const std::string bytes, mesh_readers::read_mesh_file(path));
  const std::filesystem::path folder = path.parent_path();
  return read_named(bytes, path.string(), &folder);
}

Result<std::vector<std::uint32_t>> source_of_faces(const MeshSource& source, const TriangleMesh& mesh, double scale) {
  std::vector<std::uint32_t> found;
  found.reserve(mesh.triangles().size());
  std::uint32_t at = 0;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face, ++at) {
    const auto corners = mesh.corners(face);
    const auto is_same = [&](std::uint32_t triangle) {
      std::array<Vec3, 3> from;
      for (std::size_t k = 0; k < 3; ++k) from[k] = scale * source.positions[source.triangles[triangle][k]];
      // Turned outward, two corners have changed places.
      const bool along = corners[0] == from[0] && corners[1] == from[1] && corners[2] == from[2];
      return along || std::is_permutation(from.begin(), from.end(), corners.begin());
    };
    while (at < source.triangles.size() && !is_same(at)) ++at;
    if (at >= source.triangles.size()) {
      return refused(ErrorCode::mismatch, fmt::format("face {} of the mesh is no triangle of the source", face), {},
                     "the source that the mesh was built from");
    }
    found.push_back(at);
  }
  return found;
}

Result<HeightMap> height_map_of(const GltfHeight& height, Reconstruction reconstruction) {
  return HeightMap::build(*height.texture.image, Channel::automatic,
                          {height.amplitude, height.offset, height.white_is_deep, height.texture.wrap, reconstruction});
}

namespace {

/// Of 16 bits, as NormalMap decodes it.
std::uint16_t normal_code(double component) {
  return static_cast<std::uint16_t>(std::lround(32768.0 + 32767.0 * component));
}

/// Of 16 bits, without samples yet.
std::shared_ptr<Image> blank_image(int width, int height, int channels) {
  return std::make_shared<Image>(Image{width, height, channels, 16, {}});
}

}  // namespace

Result<Image> normal_image_of(const GltfNormals& normals) {
  const Image& stored = *normals.texture.image;
  if (!stored.has_colour())
    return refused(ErrorCode::bad_map, "has no colours", normals.texture.source, "an image of red, green and blue");
  if (!std::isfinite(normals.scale)) return bad_value("is not finite", "scale", "a finite number");
  if (normals.scale == 1.0) return stored;
  Image scaled = stored;
  scaled.channels = 3;
  scaled.bits = 16;
  scaled.samples.resize(stored.pixels() * 3);
  // As NormalMap decodes them: the middle codes are exactly 0.
  const double middle = stored.bits == 16 ? 32768.0 : 128.0;
  const auto step = static_cast<std::size_t>(stored.channels);
  for (std::size_t i = 0; i < stored.pixels(); ++i) {
    const auto axis = [&](std::size_t c) { return (stored.samples[i * step + c] - middle) / (middle - 1.0); };
    Vec3 normal(normals.scale * axis(0), normals.scale * axis(1), axis(2));
    const double length = normal.norm();
    normal = length > 0.0 ? Vec3(normal / length) : Vec3(Vec3::UnitZ());
    for (std::size_t c = 0; c < 3; ++c) {
      scaled.samples[3 * i + c] = normal_code(normal[static_cast<Eigen::Index>(c)]);
    }
  }
  return scaled;
}

GltfHeight height_texture_of(const HeightMap& heights) {
  const auto image = blank_image(heights.width(), heights.height(), 1);
  std::vector<double> texels;
  for (int y = 0; y < heights.height(); ++y) {
    for (int x = 0; x < heights.width(); ++x) texels.push_back(heights.texel(x, y));
  }
  const auto [low, high] = std::minmax_element(texels.begin(), texels.end());
  GltfHeight height;
  height.offset = *low;
  height.amplitude = *high - *low;
  for (const double texel : texels) {
    const double share = height.amplitude > 0.0 ? (texel - height.offset) / height.amplitude : 0.0;
    image->samples.push_back(static_cast<std::uint16_t>(std::lround(65535.0 * std::clamp(share, 0.0, 1.0))));
  }
  height.texture = {image, "heights", heights.wrap()};
  return height;
}

GltfNormals normal_texture_of(const NormalMap& normals) {
  const auto image = blank_image(normals.width(), normals.height(), 3);
  for (int y = 0; y < normals.height(); ++y) {
    for (int x = 0; x < normals.width(); ++x) {
      const Vec3 normal = normals.texel(x, y);
      for (int c = 0; c < 3; ++c) image->samples.push_back(normal_code(normal[c]));
    }
  }
  GltfNormals texture;
  texture.texture = {image, "normals", normals.wrap()};
  return texture;
}

}  // namespace asperity
