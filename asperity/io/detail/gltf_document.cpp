#include "asperity/io/detail/gltf_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "asperity/io/detail/mesh_readers.h"

namespace asperity::mesh_readers {
namespace {

using Json = nlohmann::json;

constexpr const char* accepted_container = "a glTF 2.0 file (.gltf or .glb)";
/// Bounds what the JSON may become in memory; scenes with a million parts stay below.
constexpr std::size_t most_values = 20'000'000;
/// Geometry lies less deep; what is deeper belongs to extras and extensions.
constexpr int deepest_level = 16;
constexpr std::uint64_t largest_buffer = std::uint64_t{4} << 30U;
/// Of an image file.
constexpr std::uint64_t largest_resource = std::uint64_t{2} << 30U;

// ---- the keys of glTF's geometry

enum class Kind {
  size,        ///< a whole number from 0
  flag,        ///< true or false
  word,        ///< a string
  numbers,     ///< `count` numbers
  reference,   ///< an index into the root's array `section`
  references,  ///< an array of them
  attributes,  ///< an object of them, by semantic
  object,      ///< with the keys `within`
  objects,     ///< an array of them
};

struct Key {
  const char* name;
  Kind kind;
  bool required = false;
  const char* section = nullptr;
  std::size_t count = 0;  ///< numbers: how many; size: the largest value, 0 for none
  std::span<const Key> within = {};
};

constexpr std::size_t largest_int = 0x7fffffff;
constexpr Key sparse_indices_keys[] = {{"bufferView", Kind::reference, true, "bufferViews"},
                                       {"byteOffset", Kind::size, false, nullptr, largest_int},
                                       {"componentType", Kind::size, true, nullptr, largest_int}};
constexpr Key sparse_values_keys[] = {{"bufferView", Kind::reference, true, "bufferViews"},
                                      {"byteOffset", Kind::size, false, nullptr, largest_int}};
constexpr Key sparse_keys[] = {{"count", Kind::size, true, nullptr, largest_int},
                               {"indices", Kind::object, true, nullptr, 0, sparse_indices_keys},
                               {"values", Kind::object, true, nullptr, 0, sparse_values_keys}};
constexpr Key accessor_keys[] = {{"bufferView", Kind::reference, false, "bufferViews"},
                                 {"byteOffset", Kind::size},
                                 {"componentType", Kind::size, true, nullptr, largest_int},
                                 {"normalized", Kind::flag},
                                 {"count", Kind::size, true},
                                 {"type", Kind::word, true},
                                 {"sparse", Kind::object, false, nullptr, 0, sparse_keys}};
constexpr Key view_keys[] = {{"buffer", Kind::reference, true, "buffers"},
                             {"byteOffset", Kind::size},
                             {"byteLength", Kind::size, true},
                             {"byteStride", Kind::size}};
constexpr Key primitive_keys[] = {{"attributes", Kind::attributes, true, "accessors"},
                                  {"indices", Kind::reference, false, "accessors"},
                                  {"mode", Kind::size, false, nullptr, 6}};
constexpr Key mesh_keys[] = {{"name", Kind::word}, {"primitives", Kind::objects, true, nullptr, 0, primitive_keys}};
constexpr Key node_keys[] = {{"name", Kind::word},
                             {"mesh", Kind::reference, false, "meshes"},
                             {"skin", Kind::reference, false, "skins"},
                             {"children", Kind::references, false, "nodes"},
                             {"matrix", Kind::numbers, false, nullptr, 16},
                             {"translation", Kind::numbers, false, nullptr, 3},
                             {"rotation", Kind::numbers, false, nullptr, 4},
                             {"scale", Kind::numbers, false, nullptr, 3}};
constexpr Key scene_keys[] = {{"nodes", Kind::references, false, "nodes"}};
constexpr Key root_keys[] = {{"scene", Kind::reference, false, "scenes"},
                             {"scenes", Kind::objects, false, nullptr, 0, scene_keys},
                             {"nodes", Kind::objects, false, nullptr, 0, node_keys},
                             {"meshes", Kind::objects, false, nullptr, 0, mesh_keys},
                             {"accessors", Kind::objects, false, nullptr, 0, accessor_keys},
                             {"bufferViews", Kind::objects, false, nullptr, 0, view_keys}};
constexpr Key buffer_keys[] = {{"uri", Kind::word}, {"byteLength", Kind::size, true}};
constexpr Key buffers_key[] = {{"buffers", Kind::objects, false, nullptr, 0, buffer_keys}};

constexpr const char* material_keys[] = {"meshes", "materials", "textures", "samplers", "images", "extensions"};

bool is_root_key(std::string_view name, GltfParts parts) {
  const auto among = [&](const auto& keys) { return std::ranges::find(keys, name) != std::end(keys); };
  constexpr const char* kept[] = {"asset", "extensionsUsed", "extensionsRequired", "buffers", "skins", "animations"};
  return among(kept) || (parts == GltfParts::geometry_and_materials && among(material_keys)) ||
         std::ranges::find(root_keys, name, &Key::name) != std::end(root_keys);
}

/// Copies the keys of a table out of the file's JSON and refuses values of another type.
class JsonCheck {
 public:
  JsonCheck(const Json& root, GltfParts parts) : root_(root), parts_(parts) {}

  Result<Json> object(const Json& from, const std::string& place, std::span<const Key> keys) const {
    if (!from.is_object()) return malformed("is no object", place, "an object");
    Json copy = Json::object();
    for (const Key& key : keys) {
      const auto found = from.find(key.name);
      const std::string at = place.empty() ? key.name : fmt::format("{}.{}", place, key.name);
      if (found == from.end()) {
        if (key.required) return malformed("is missing", at, "a complete glTF file");
        continue;
      }
      ASPERITY_TRY(copy[key.name], value(*found, at, key));
    }
    return copy;
  }

 private:
  [[nodiscard]] Result<Json> value(const Json& from, const std::string& place, const Key& key) const {
    switch (key.kind) {
      case Kind::size: return size(from, place, key.count);
      case Kind::flag: return from.is_boolean() ? Result<Json>(from) : malformed("is no boolean", place, "true, false");
      case Kind::word: return from.is_string() ? Result<Json>(from) : malformed("is no string", place, "a string");
      case Kind::numbers: return numbers(from, place, key.count);
      case Kind::reference: return reference(from, place, key.section);
      case Kind::references:
      case Kind::objects: return array(from, place, key);
      case Kind::attributes: return attributes(from, place, key.section);
      case Kind::object: break;
    }
    return object(from, place, key.within);
  }

  static Result<Json> size(const Json& from, const std::string& place, std::size_t most) {
    if (!from.is_number_unsigned()) return malformed("is no whole number from 0", place, "a whole number from 0");
    if (most > 0 && from.get<std::uint64_t>() > most) {
      return malformed("is too large", place, fmt::format("a whole number from 0 to {}", most));
    }
    return from;
  }

  static Result<Json> numbers(const Json& from, const std::string& place, std::size_t count) {
    bool good = from.is_array() && from.size() == count;
    for (std::size_t i = 0; good && i < count; ++i) good = from[i].is_number();
    if (!good)
      return malformed(fmt::format("is no array of {} numbers", count), place, fmt::format("{} numbers", count));
    return from;
  }

  [[nodiscard]] Result<Json> reference(const Json& from, const std::string& place, const char* section) const {
    const auto found = root_.find(section);
    const std::size_t count = found != root_.end() && found->is_array() ? found->size() : 0;
    if (!from.is_number_unsigned()) return malformed("is no index", place, "a whole number from 0");
    const auto index = from.get<std::uint64_t>();
    if (index < count) return from;
    return refused(ErrorCode::bad_mesh, fmt::format("refers to {}[{}] of {}", section, index, count), place,
                   "indices of things that are there");
  }

  [[nodiscard]] Result<Json> array(const Json& from, const std::string& place, const Key& key) const {
    if (!from.is_array()) return malformed("is no array", place, "an array");
    Json copy = Json::array();
    for (std::size_t i = 0; i < from.size(); ++i) {
      const std::string at = fmt::format("{}[{}]", place, i);
      ASPERITY_TRY(Json element,
                   key.kind == Kind::objects ? object(from[i], at, key.within) : reference(from[i], at, key.section));
      copy.push_back(std::move(element));
    }
    return copy;
  }

  [[nodiscard]] Result<Json> attributes(const Json& from, const std::string& place, const char* section) const {
    if (!from.is_object()) return malformed("is no object", place, "an object of accessor indices");
    Json copy = Json::object();
    const auto take = [&](const std::string& semantic) -> Status {
      const auto found = from.find(semantic);
      if (found == from.end()) return success();
      ASPERITY_TRY(copy[semantic], reference(*found, fmt::format("{}.{}", place, semantic), section));
      return success();
    };
    ASPERITY_CHECK(take("POSITION"));
    const int sets = parts_ == GltfParts::geometry ? 1 : most_texcoords;
    for (int set = 0; set < sets; ++set) ASPERITY_CHECK(take(fmt::format("TEXCOORD_{}", set)));
    return copy;
  }

  const Json& root_;
  GltfParts parts_;
};

// ---- what the file needs from its reader

std::vector<std::string> words(const Json& root, const char* key) {
  std::vector<std::string> all;
  const auto found = root.find(key);
  if (found == root.end() || !found->is_array()) return all;
  for (const Json& word : *found) {
    if (word.is_string()) all.push_back(word.get<std::string>());
  }
  return all;
}

/// Extensions that say how something looks, not where it is.
bool leaves_geometry_alone(std::string_view extension) {
  constexpr const char* starts[] = {"KHR_materials_", "KHR_texture_",  "KHR_lights_",
                                    "KHR_xmp",        "EXT_texture_",  "EXT_lights_",
                                    "MSFT_texture_",  "MSFT_packing_", "ADOBE_materials_"};
  return std::ranges::any_of(starts, [&](const char* start) { return extension.starts_with(start); });
}

Status check_version(const Json& root) {
  const auto asset = root.find("asset");
  if (asset == root.end() || !asset->is_object()) return malformed("is missing", "asset", accepted_container);
  for (const char* key : {"version", "minVersion"}) {
    const auto version = asset->find(key);
    const std::string place = fmt::format("asset.{}", key);
    if (version == asset->end()) {
      if (std::string_view(key) == "version") return malformed("is missing", place, accepted_container);
      continue;
    }
    if (!version->is_string()) return malformed("is no string", place, accepted_container);
    const auto& text = version->get_ref<const std::string&>();
    // A later 2.x may be read as 2.0 unless the file says otherwise by minVersion.
    const bool good = std::string_view(key) == "version" ? text.starts_with("2.") : text == "2.0";
    if (good) continue;
    return refused(ErrorCode::file_unsupported, fmt::format("is \"{}\"", text.substr(0, 20)), place,
                   accepted_container);
  }
  return success();
}

Status check_extensions(const Json& root) {
  for (const std::string& extension : words(root, "extensionsRequired")) {
    if (leaves_geometry_alone(extension)) continue;
    return refused(ErrorCode::file_unsupported,
                   fmt::format("requires the extension {}, which is not read", extension.substr(0, 60)),
                   "extensionsRequired",
                   "plain glTF 2.0 geometry: export without compression, quantisation and instancing");
  }
  return success();
}

std::size_t length_of(const Json& root, const char* key) {
  const auto found = root.find(key);
  return found != root.end() && found->is_array() ? found->size() : 0;
}

void note_what_is_left_out(const Json& root, std::vector<std::string>& notes) {
  std::size_t morphed = 0;
  if (const auto meshes = root.find("meshes"); meshes != root.end() && meshes->is_array()) {
    for (const Json& mesh : *meshes) {
      const auto primitives = mesh.is_object() ? mesh.find("primitives") : mesh.end();
      if (!mesh.is_object() || primitives == mesh.end() || !primitives->is_array()) continue;
      for (const Json& primitive : *primitives) {
        if (primitive.is_object() && length_of(primitive, "targets") > 0) ++morphed;
      }
    }
  }
  if (morphed > 0) notes.push_back(fmt::format("morph targets of {} parts left out: the base shape is read", morphed));
  if (length_of(root, "animations") > 0) {
    notes.push_back(
        fmt::format("{} animations left out: every node stands in its own transform", length_of(root, "animations")));
  }
  for (const std::string& extension : words(root, "extensionsUsed")) {
    if (extension == "EXT_mesh_gpu_instancing") {
      notes.emplace_back("instances by EXT_mesh_gpu_instancing left out: every mesh stands once where its node is");
    }
  }
}

// ---- containers and buffers

std::string without_percents(std::string_view uri) {
  const auto digit = [](char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
  };
  std::string plain;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const bool escaped = uri[i] == '%' && i + 2 < uri.size() && digit(uri[i + 1]) >= 0 && digit(uri[i + 2]) >= 0;
    plain += escaped ? static_cast<char>(16 * digit(uri[i + 1]) + digit(uri[i + 2])) : uri[i];
    if (escaped) i += 2;
  }
  return plain;
}

/// "http:", "file:", "C:".
bool has_scheme(std::string_view uri) {
  const std::size_t colon = uri.find(':');
  if (colon == std::string_view::npos || colon == 0) return false;
  return uri.substr(0, colon).find_first_of("/?#") == std::string_view::npos;
}

}  // namespace

bool decode_base64(std::string_view text, std::size_t length, std::string& bytes) {
  std::array<std::int8_t, 256> value{};
  value.fill(-1);
  const std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < alphabet.size(); ++i) {
    value[static_cast<std::uint8_t>(alphabet[i])] = static_cast<std::int8_t>(i);
  }
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  bytes.reserve(std::min(length, text.size() / 4 * 3 + 3));
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const std::int8_t six = value[static_cast<std::uint8_t>(c)];
    if (six < 0) return false;
    bits = (bits << 6U) | static_cast<std::uint32_t>(six);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    if (bytes.size() < length) bytes += static_cast<char>((bits >> static_cast<unsigned>(count)) & 0xffU);
  }
  return true;
}

namespace {

/// What stands behind "data:...;base64,"; nothing where `uri` is no such thing.
std::optional<std::string_view> base64_of(std::string_view uri) {
  const std::size_t comma = uri.find(',');
  if (comma == std::string_view::npos || !uri.substr(0, comma).ends_with(";base64")) return std::nullopt;
  return uri.substr(comma + 1);
}

Error too_short(std::size_t wanted, std::string_view what, std::uint64_t has, const std::string& place) {
  return refused(ErrorCode::file_truncated, fmt::format("promises {} bytes and {} has {}", wanted, what, has), place,
                 "a complete file");
}

}  // namespace

Error malformed(std::string what, std::string place, std::string accepted) {
  return refused(ErrorCode::file_malformed, std::move(what), std::move(place), std::move(accepted));
}

Status GltfDocument::read_container(std::string_view bytes) {
  if (!bytes.starts_with("glTF")) {
    json_ = bytes;
    return success();
  }
  const auto truncated = [&](std::uint64_t wanted) {
    return refused(ErrorCode::file_truncated, fmt::format("promises {} bytes and has {}", wanted, bytes.size()),
                   fmt::format("byte {}", bytes.size()), "a complete .glb file");
  };
  constexpr std::size_t header_size = 12;
  constexpr std::size_t chunk_header = 8;
  if (bytes.size() < header_size + chunk_header) return truncated(header_size + chunk_header);
  if (bits_at(bytes, 4) != 2) {
    return refused(ErrorCode::file_unsupported, fmt::format("is version {} of binary glTF", bits_at(bytes, 4)),
                   "byte 4", accepted_container);
  }
  const std::size_t length = bits_at(bytes, 8);
  if (length > bytes.size()) return truncated(length);
  if (length < bytes.size()) notes_.push_back(fmt::format("{} bytes behind the glTF left out", bytes.size() - length));
  bool has_json = false;
  for (std::size_t at = header_size; at < length;) {
    const std::string place = fmt::format("byte {}", at);
    if (length - at < chunk_header) return malformed("ends within the header of a chunk", place, accepted_container);
    const std::size_t size = bits_at(bytes, at);
    const std::uint32_t type = bits_at(bytes, at + 4);
    at += chunk_header;
    if (size > length - at) return malformed("has a chunk that is longer than the file", place, accepted_container);
    constexpr std::uint32_t json_type = 0x4e4f534a;
    constexpr std::uint32_t binary_type = 0x004e4942;
    if (!has_json && type != json_type) return malformed("begins with no JSON chunk", place, accepted_container);
    if (!has_json) {
      json_ = bytes.substr(at, size);
    } else if (type == binary_type && !has_binary_) {
      binary_ = bytes.substr(at, size);
      has_binary_ = true;
    }
    has_json = true;
    at += size;
  }
  if (!has_json) return malformed("has no JSON chunk", "byte 12", accepted_container);
  return success();
}

Status GltfDocument::read_json(GltfParts parts) {
  std::size_t values = 0;
  // Unless they are asked for, images, materials, extras and the like never become objects in memory.
  const auto keep = [&](int depth, Json::parse_event_t event, Json& parsed) {
    if (event == Json::parse_event_t::object_start || event == Json::parse_event_t::array_start) {
      return ++values <= most_values && depth <= deepest_level;
    }
    if (event == Json::parse_event_t::value) return ++values <= most_values;
    if (event != Json::parse_event_t::key) return true;
    const auto* name = parsed.get_ptr<const std::string*>();
    if (name == nullptr) return true;
    return depth == 1 ? is_root_key(*name, parts) : parts == GltfParts::geometry_and_materials || *name != "extras";
  };
  Json root;
  try {
    root = Json::parse(json_.begin(), json_.end(), keep);
  } catch (const Json::parse_error& failure) {
    if (failure.byte > json_.size()) {
      return refused(ErrorCode::file_truncated, "ends within its JSON", {}, "a complete glTF file");
    }
    return malformed("is not JSON", fmt::format("byte {} of the JSON", failure.byte), accepted_container);
  } catch (const Json::exception&) {
    return malformed("holds a number that no computer holds", {}, accepted_container);
  }
  if (values > most_values) {
    return refused(ErrorCode::too_large, "has too many parts", {}, fmt::format("up to {} values", most_values));
  }
  if (!root.is_object()) return malformed("is no JSON object", {}, accepted_container);
  ASPERITY_CHECK(check_version(root));
  ASPERITY_CHECK(check_extensions(root));
  const JsonCheck check(root, parts);
  ASPERITY_TRY(Json geometry, check.object(root, {}, root_keys));
  ASPERITY_TRY(const Json buffers, check.object(root, {}, buffers_key));
  for (const Json& buffer : buffers.value("buffers", Json::array())) {
    buffers_.push_back({buffer.value("uri", ""), buffer["byteLength"].get<std::size_t>(), nullptr});
  }
  for (const Json& view : geometry.value("bufferViews", Json::array())) {
    views_.push_back({view["buffer"].get<std::size_t>(), view.value("byteOffset", std::size_t{0}),
                      view["byteLength"].get<std::size_t>()});
  }
  if (parts == GltfParts::geometry_and_materials) {
    Json kept = Json::object();
    for (const char* key : material_keys) {
      if (const auto found = root.find(key); found != root.end()) kept[key] = *found;
    }
    materials_ = kept.dump(-1, ' ', false, Json::error_handler_t::replace);
  }
  note_what_is_left_out(root, notes_);
  geometry["asset"] = {{"version", "2.0"}};
  geometry_ = geometry.dump(-1, ' ', false, Json::error_handler_t::replace);
  return success();
}

Result<GltfDocument> GltfDocument::open(std::string_view bytes, const std::filesystem::path* folder, GltfParts parts) {
  GltfDocument document;
  document.folder_ = folder;
  ASPERITY_CHECK(document.read_container(bytes));
  ASPERITY_CHECK(document.read_json(parts));
  return document;
}

Result<std::filesystem::path> GltfDocument::resolve(const std::string& uri, const std::string& place) const {
  const std::string name = without_percents(uri);
  const std::string shown = name.substr(0, 200);
  const auto error = [&](ErrorCode code, std::string what) {
    return refused(code, std::move(what), place, "a file path relative to the .gltf file, or a data URI");
  };
  if (has_scheme(uri) || name.empty() || name.front() == '/' || name.front() == '\\' ||
      name.find('\0') != std::string::npos) {
    return error(ErrorCode::file_unsupported, fmt::format("is \"{}\", which is no relative path", shown));
  }
  if (folder_ == nullptr) {
    return error(ErrorCode::file_unsupported, fmt::format("names the file \"{}\", which is not in memory", shown));
  }
  std::filesystem::path path = *folder_ / name;
  std::error_code problem;
  if (!std::filesystem::exists(path, problem)) {
    return error(ErrorCode::file_missing, fmt::format("names \"{}\": no such file", shown));
  }
  if (!std::filesystem::is_regular_file(path, problem)) {
    return error(ErrorCode::file_missing, fmt::format("names \"{}\", which is not a regular file", shown));
  }
  return path;
}

/// Reads `length` bytes from the file's begin.
Result<std::string> read_start(const std::filesystem::path& path, std::size_t length, const std::string& place) {
  std::string bytes(length, '\0');
  std::ifstream stream(path, std::ios::binary);
  stream.read(bytes.data(), static_cast<std::streamsize>(length));
  if (stream) return bytes;
  return refused(ErrorCode::file_missing, fmt::format("names \"{}\", which cannot be read", path.filename().string()),
                 place, "a file that may be read");
}

Status GltfDocument::read_external(Buffer& buffer, const std::string& place) const {
  ASPERITY_TRY(const std::filesystem::path path, resolve(buffer.uri, place + ".uri"));
  std::error_code problem;
  const std::uintmax_t size = std::filesystem::file_size(path, problem);
  if (!problem && size < buffer.length) {
    return too_short(buffer.length, fmt::format("\"{}\"", without_percents(buffer.uri).substr(0, 200)), size, place);
  }
  ASPERITY_TRY(std::string bytes, read_start(path, buffer.length, place + ".uri"));
  buffer.bytes = std::make_unique<std::string>(std::move(bytes));
  return success();
}

Result<std::string> GltfDocument::resource(const std::string& uri, const std::string& place) const {
  if (uri.starts_with("data:")) {
    const std::optional<std::string_view> text = base64_of(uri);
    std::string bytes;
    if (text && decode_base64(*text, std::string::npos / 2, bytes)) return bytes;
    return malformed("is no data URI of base64", place, "data:image/png;base64,...");
  }
  ASPERITY_TRY(const std::filesystem::path path, resolve(uri, place));
  std::error_code problem;
  const std::uintmax_t size = std::filesystem::file_size(path, problem);
  if (problem || size > largest_resource) {
    return refused(ErrorCode::too_large, fmt::format("names \"{}\", which has {} bytes", uri.substr(0, 200), size),
                   place, "files up to 2 GiB");
  }
  return read_start(path, static_cast<std::size_t>(size), place);
}

Result<std::string_view> GltfDocument::view(std::size_t index) {
  const std::string place = fmt::format("bufferViews[{}]", index);
  if (index >= views_.size()) {
    return refused(ErrorCode::bad_mesh, fmt::format("is one of {}", views_.size()), place,
                   "indices of things that are there");
  }
  const View& one = views_[index];
  ASPERITY_TRY(const std::string_view bytes, buffer(one.buffer));
  if (one.offset > bytes.size() || one.length > bytes.size() - one.offset) {
    return refused(
        ErrorCode::bad_mesh,
        fmt::format("reaches from byte {} over {} bytes in a buffer of {}", one.offset, one.length, bytes.size()),
        place, "views that lie within their buffer");
  }
  return bytes.substr(one.offset, one.length);
}

Result<std::string_view> GltfDocument::buffer(std::size_t index) {
  Buffer& buffer = buffers_[index];
  if (buffer.bytes) return std::string_view(*buffer.bytes);
  const std::string place = fmt::format("buffers[{}]", index);
  if (buffer.length > largest_buffer) {
    return refused(ErrorCode::too_large, fmt::format("has {} bytes", buffer.length), place, "buffers up to 4 GiB");
  }
  if (buffer.uri.empty()) {
    if (index > 0 || !has_binary_) return malformed("names no data", place, "a uri, or the data of a .glb file");
    if (binary_.size() < buffer.length)
      return too_short(buffer.length, "the file's binary chunk", binary_.size(), place);
    return binary_.substr(0, buffer.length);
  }
  if (!buffer.uri.starts_with("data:")) {
    ASPERITY_CHECK(read_external(buffer, place));
    return std::string_view(*buffer.bytes);
  }
  constexpr const char* accepted = "data:application/octet-stream;base64,...";
  const std::optional<std::string_view> text = base64_of(buffer.uri);
  if (!text) return malformed("is a data URI without base64", place + ".uri", accepted);
  auto bytes = std::make_unique<std::string>();
  if (!decode_base64(*text, buffer.length, *bytes)) return malformed("is not base64", place + ".uri", accepted);
  if (bytes->size() < buffer.length) return too_short(buffer.length, "its data URI", bytes->size(), place);
  buffer.bytes = std::move(bytes);
  return std::string_view(*buffer.bytes);
}

}  // namespace asperity::mesh_readers
