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
  static const char* const names[] = {"a.obj", "a.ply", "a.stl", "a"};
  if (size == 0) return 0;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const char* name = names[data[0] % 4];
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
  std::vector<std::string> files = {zero + obj, "\1" + ply,         "\1" + binary_ply(false), "\1" + binary_ply(true),
                                    "\2" + stl, "\2" + binary_stl()};
  for (const std::string& bytes : {obj, ply, stl, binary_stl()}) files.push_back("\3" + bytes);
  return files;
}

}  // namespace

int main(int argc, char** argv) {
  return asperity::fuzz::run(argc, argv, "mesh", corpus());
}

#endif
