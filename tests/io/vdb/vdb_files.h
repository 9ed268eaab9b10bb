#pragma once
// Meshes and files that the tests of OpenVDB's part share.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <string>

#include "asperity/field/conversion/mesh_conversion.h"
#include "asperity/geometry/generators.h"
#include "asperity/io/sparse_io.h"
#include "asperity/io/vdb/vdb.h"

namespace asperity {

class WithVdb : public ::testing::Test {
 protected:
  void SetUp() override {
    register_vdb();
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ =
        std::filesystem::temp_directory_path() / ("asperity-vdb-" + std::to_string(::getpid()) + "-" + info->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static std::string bytes_of(const std::filesystem::path& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  [[nodiscard]] std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }

  std::filesystem::path folder_;
};

inline TriangleIndex index_of(MeshSource source) {
  Result<TriangleMesh> mesh = TriangleMesh::build(std::move(source));
  EXPECT_TRUE(mesh) << (mesh ? "" : mesh.error().message());
  return TriangleIndex::build(std::move(mesh).value());
}

/// A ring around the z axis (m), outward.
inline MeshSource torus_mesh(double major, double minor, std::uint32_t around, std::uint32_t across) {
  MeshSource source;
  for (std::uint32_t i = 0; i < around; ++i) {
    for (std::uint32_t j = 0; j < across; ++j) {
      const double u = 2.0 * std::numbers::pi * i / around;
      const double v = 2.0 * std::numbers::pi * j / across;
      const double r = major + minor * std::cos(v);
      source.positions.emplace_back(r * std::cos(u), r * std::sin(u), minor * std::sin(v));
      const std::uint32_t a = i * across + j;
      const std::uint32_t b = (i + 1) % around * across + j;
      const std::uint32_t c = (i + 1) % around * across + (j + 1) % across;
      const std::uint32_t d = i * across + (j + 1) % across;
      source.triangles.push_back({a, b, c});
      source.triangles.push_back({a, c, d});
    }
  }
  return source;
}

/// Both, the second moved.
inline MeshSource joined(MeshSource a, const MeshSource& b, const Vec3& moved = Vec3::Zero()) {
  const auto offset = static_cast<std::uint32_t>(a.positions.size());
  for (const Vec3& p : b.positions) a.positions.emplace_back(p + moved);
  for (const auto& t : b.triangles) a.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  a.corner_uvs.clear();
  return a;
}

}  // namespace asperity
