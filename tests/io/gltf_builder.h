#pragma once
// glTF files put together in memory, and what the tests ask of reading them.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "asperity/io/mesh_io.h"

namespace asperity::test {

using Json = nlohmann::json;

inline std::string base64(const std::string& bytes) {
  const char* alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      bits = (bits << 8U) | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : alphabet[(bits >> (18 - 6 * k)) & 63U];
  }
  return text;
}

/// A glTF document and its one buffer, put together piece by piece.
struct GltfBuilder {
  Json root = {{"asset", {{"version", "2.0"}}}};
  std::string data;

  template <class Number>
  int view(const std::vector<Number>& numbers, std::size_t stride = 0, std::size_t element = 0) {
    while (data.size() % 4 != 0) data += '\0';
    const std::size_t first = data.size();
    const auto* raw = reinterpret_cast<const char*>(numbers.data());
    const std::size_t size = numbers.size() * sizeof(Number);
    if (stride == 0) {
      data.append(raw, size);
    } else {
      for (std::size_t i = 0; i < size; i += element) {
        data.append(raw + i, element);
        data.append(stride - element, '\x7f');
      }
    }
    Json json = {{"buffer", 0}, {"byteOffset", first}, {"byteLength", data.size() - first}};
    if (stride > 0) json["byteStride"] = stride;
    root["bufferViews"].push_back(json);
    return static_cast<int>(root["bufferViews"].size()) - 1;
  }
  int accessor(int view_index, int component, std::size_t count, const char* type) {
    root["accessors"].push_back(
        {{"bufferView", view_index}, {"componentType", component}, {"count", count}, {"type", type}});
    return static_cast<int>(root["accessors"].size()) - 1;
  }
  int positions(const std::vector<float>& numbers) { return accessor(view(numbers), 5126, numbers.size() / 3, "VEC3"); }
  int uvs(const std::vector<float>& numbers) { return accessor(view(numbers), 5126, numbers.size() / 2, "VEC2"); }
  template <class Number>
  int indices(const std::vector<Number>& numbers) {
    return accessor(view(numbers),
                    sizeof(Number) == 1   ? 5121
                    : sizeof(Number) == 2 ? 5123
                                          : 5125,
                    numbers.size(), "SCALAR");
  }
  int mesh(const Json& primitives) {
    root["meshes"].push_back({{"primitives", primitives}});
    return static_cast<int>(root["meshes"].size()) - 1;
  }
  int node(const Json& node) {
    root["nodes"].push_back(node);
    return static_cast<int>(root["nodes"].size()) - 1;
  }
  void scene(const Json& nodes) {
    root["scenes"].push_back({{"nodes", nodes}});
    root["scene"] = 0;
  }

  [[nodiscard]] std::string text(const std::string& uri) const {
    Json json = root;
    json["buffers"] = Json::array({{{"byteLength", data.size()}, {"uri", uri}}});
    return json.dump();
  }
  [[nodiscard]] std::string text() const { return text("data:application/octet-stream;base64," + base64(data)); }
  [[nodiscard]] std::string binary() const {
    Json json = root;
    json["buffers"] = Json::array({{{"byteLength", data.size()}}});
    std::string words = json.dump();
    std::string chunk = data;
    while (words.size() % 4 != 0) words += ' ';
    while (chunk.size() % 4 != 0) chunk += '\0';
    std::string bytes = "glTF";
    const auto put = [&](std::size_t number) {
      for (unsigned i = 0; i < 4; ++i) bytes += static_cast<char>((number >> (8 * i)) & 255U);
    };
    put(2);
    put(12 + 8 + words.size() + 8 + chunk.size());
    put(words.size());
    bytes += "JSON" + words;
    put(chunk.size());
    bytes += std::string("BIN\0", 4) + chunk;
    return bytes;
  }
};

inline const std::vector<float> square = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
inline const std::vector<float> square_uvs = {0, 1, 1, 1, 1, 0, 0, 0};

/// A unit square of two triangles in one node.
inline GltfBuilder plain_square(const Json& node = Json::object()) {
  GltfBuilder b;
  const int positions = b.positions(square);
  const int uvs = b.uvs(square_uvs);
  const int indices = b.indices<std::uint16_t>({0, 1, 2, 0, 2, 3});
  Json placed = node;
  placed["mesh"] =
      b.mesh(Json::array({{{"attributes", {{"POSITION", positions}, {"TEXCOORD_0", uvs}}}, {"indices", indices}}}));
  b.scene({b.node(placed)});
  return b;
}

inline MeshSource read(const std::string& bytes, const std::string& name = "a.gltf") {
  auto source = read_mesh_bytes(bytes, name);
  EXPECT_TRUE(source.ok()) << (source.ok() ? "" : source.error().message());
  return source.ok() ? std::move(source).value() : MeshSource{};
}

inline Error error_of(const std::string& bytes, const std::string& name = "a.gltf") {
  const auto source = read_mesh_bytes(bytes, name);
  EXPECT_FALSE(source.ok()) << "accepted: " << bytes.substr(0, 400);
  if (source.ok()) return {};
  EXPECT_EQ(source.error().file, name);
  EXPECT_FALSE(source.error().what.empty());
  EXPECT_FALSE(source.error().accepted.empty()) << source.error().message();
  return source.error();
}

#define EXPECT_ERROR(bytes, expected_code, expected_place)                 \
  do {                                                                     \
    const Error error_found = error_of(bytes);                             \
    EXPECT_EQ(error_found.code, expected_code) << error_found.message();   \
    EXPECT_EQ(error_found.place, expected_place) << error_found.message(); \
  } while (false)

inline bool has_note(const MeshSource& source, const std::string& part) {
  return std::any_of(source.notes.begin(), source.notes.end(),
                     [&](const std::string& note) { return note.find(part) != std::string::npos; });
}

/// Twice the vector area: direction and size of what the triangles show.
inline Vec3 twice_area(const MeshSource& source) {
  Vec3 sum = Vec3::Zero();
  for (const auto& [a, b, c] : source.triangles) {
    const Vec3& corner = source.positions[a];
    sum += (source.positions[b] - corner).cross(source.positions[c] - corner);
  }
  return sum;
}

}  // namespace asperity::test
