// What no file may do to the mesh readers: crash, throw, answer a mesh that points outside itself, or an error that
// says nothing. The first byte chooses the name the bytes are read under, so that every reader sees every kind of file.

#include <cmath>
#include <cstdlib>
#include <cstring>

#include "asperity/io/mesh_io.h"
#include "tests/fuzz/fuzz_driver.h"

namespace {

using asperity::MeshSource;

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "broken: %s\n", what);
  std::abort();
}

void check_source(const MeshSource& source) {
  require(!source.triangles.empty(), "a mesh has triangles");
  for (const auto& position : source.positions) require(position.allFinite(), "coordinates are finite");
  for (const auto& triangle : source.triangles) {
    for (const std::uint32_t corner : triangle) require(corner < source.positions.size(), "indices are in range");
  }
  require(source.corner_uvs.empty() || source.corner_uvs.size() == source.triangles.size(), "UVs for all or none");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const char* const names[] = {"a.obj", "a.ply", "a.stl", "a", "a.gltf"};
  if (size == 0) return 0;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const char* name = names[data[0] % 5];
  const auto source = asperity::read_mesh_bytes(bytes, name);
  if (!source) {
    require(!source.error().what.empty() && source.error().file == name, "an error names its cause and file");
    return 0;
  }
  check_source(*source);
  const auto mesh = asperity::TriangleMesh::build(*source);
  require(mesh.ok() || !mesh.error().what.empty(), "a mesh or a named error");
  if (mesh) require(std::isfinite(mesh->report().area) && mesh->report().area > 0.0, "an area");
  return 0;
}

#ifndef ASPERITY_FUZZ_WITHOUT_MAIN

namespace {

template <class Number>
void put(std::string& bytes, Number number, bool big = false) {
  char raw[sizeof number];
  std::memcpy(raw, &number, sizeof number);
  if (big) std::reverse(raw, raw + sizeof number);
  bytes.append(raw, sizeof number);
}

std::string binary_stl() {
  std::string bytes(80, ' ');
  put(bytes, std::uint32_t{2});
  for (int i = 0; i < 24; ++i) {
    put(bytes, static_cast<float>(i % 7));
    if (i % 12 == 11) put(bytes, std::uint16_t{0});
  }
  return bytes;
}

std::string binary_ply(bool big) {
  std::string bytes = std::string("ply\nformat ") + (big ? "binary_big_endian" : "binary_little_endian") +
                      " 1.0\ncomment x\nelement vertex 4\nproperty float x\nproperty float y\nproperty double z\n"
                      "property uchar red\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n";
  for (int i = 0; i < 4; ++i) {
    put(bytes, static_cast<float>(i % 2), big);
    put(bytes, static_cast<float>(i / 2), big);
    put(bytes, static_cast<double>(i), big);
    put(bytes, std::uint8_t{7});
  }
  for (int i = 0; i < 2; ++i) {
    put(bytes, std::uint8_t{3});
    for (int k = 0; k < 3; ++k) put(bytes, std::int32_t{i + k}, big);
  }
  return bytes;
}

/// Two triangles in a strip, moved by their node; the buffer as `buffer` says.
std::string gltf_json(const std::string& buffer) {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"children":[1],"scale":[2,-1,1]},)"
         R"({"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,5,1]}],"meshes":[{"primitives":[{"attributes":)"
         R"({"POSITION":0,"TEXCOORD_0":2},"indices":1,"mode":5}]}],"accessors":[{"bufferView":0,"componentType":5126,)"
         R"("count":4,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":1,"componentType":5121},"values":)"
         R"({"bufferView":0,"byteOffset":12}}},{"bufferView":1,"byteOffset":4,"componentType":5121,"count":4,)"
         R"("type":"SCALAR"},{"bufferView":2,"componentType":5121,"normalized":true,"count":4,"type":"VEC2"}],)"
         R"("bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":8},)"
         R"({"buffer":0,"byteOffset":56,"byteLength":16,"byteStride":4}],"buffers":[{"byteLength":72)" +
         buffer + "}]}";
}

std::string text_gltf() {
  return gltf_json(
      R"(,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAACAPwAAgD8AAAA/)"
      R"(AgAAAAABAgMAAAAA/wAAAAD/AAD//wAA")");
}

std::string binary_gltf() {
  std::string json = gltf_json("");
  while (json.size() % 4 != 0) json += ' ';
  std::string bytes = "glTF";
  put(bytes, std::uint32_t{2});
  put(bytes, static_cast<std::uint32_t>(28 + json.size() + 72));
  put(bytes, static_cast<std::uint32_t>(json.size()));
  bytes += "JSON" + json;
  put(bytes, std::uint32_t{72});
  bytes += std::string("BIN\0", 4);
  for (const float number : {0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 1.F, 1.F, 0.5F}) put(bytes, number);
  for (const int byte : {2, 0, 0, 0, 0, 1, 2, 3, 0, 0, 0, 0, 255, 0, 0, 0, 0, 255, 0, 0, 255, 255, 0, 0}) {
    put(bytes, static_cast<std::uint8_t>(byte));
  }
  return bytes;
}

/// Each valid file under its own reader, named by the byte in front.
std::vector<std::string> corpus() {
  const std::string obj =
      "# c\nmtllib a.mtl\no thing\nv 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0\nv 2e-1 -3.5 7 0.5 0.5 0.5\nvt 0 0\nvt 1 0\n"
      "vt 1 1\nvn 0 0 1\ng part\nusemtl m\ns off\nf 1/1/1 2/2/1 3/3/1\nf -5 -4 -3 -2 \\\n -1\nf 1//1 2//1 3//1\n";
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float "
      "u\n"
      "property float v\nelement face 2\nproperty list uchar int vertex_index\nproperty int flags\nelement edge 1\n"
      "property int a\nend_header\n0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0.5 0 1\n3 0 1 2 9\n4 0 1 2 3 9\n5\n";
  const std::string stl =
      "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e-1 "
      "0\nendloop\nendfacet\nendsolid a\n";
  const std::string zero(1, '\0');
  std::vector<std::string> files = {
      zero + obj,          "\1" + ply,         "\1" + binary_ply(false), "\1" + binary_ply(true), "\2" + stl,
      "\2" + binary_stl(), "\4" + text_gltf(), "\4" + binary_gltf(),     "\3" + binary_gltf()};
  for (const std::string& bytes : {obj, ply, stl, binary_stl()}) files.push_back("\3" + bytes);
  return files;
}

}  // namespace

int main(int argc, char** argv) {
  return asperity::fuzz::run(argc, argv, "mesh", corpus());
}

#endif
