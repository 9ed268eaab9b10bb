// The tangent frames of normal textures, held against the models made to test them.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numbers>

#include "asperity/io/gltf_material.h"
#include "asperity/surface/coat.h"

namespace asperity::gltf_tangent_test {
namespace {

namespace fs = std::filesystem;

constexpr double degree = std::numbers::pi / 180.0;

double angle_between(const Vec3& a, const Vec3& b) {
  return std::acos(std::clamp(a.normalized().dot(b.normalized()), -1.0, 1.0));
}

double share(std::vector<double> values, double of) {
  const auto at = static_cast<std::ptrdiff_t>(of * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

/// A flat coat that shows the normals of an image.
Coat coat_of(const TriangleMesh& mesh, const Image& normals, GreenConvention green = GreenConvention::up) {
  auto map = NormalMap::build(normals, {green, Wrap::repeat, NormalFilter::bilinear});
  auto heights = HeightMap::build(std::vector<float>(4, 0.0F), 2, 2, Wrap::repeat, Reconstruction::bilinear);
  auto maps =
      std::make_shared<const Mesostructure>(*Mesostructure::build(std::move(*heights), std::move(*map), Vec2::Ones()));
  CoatSettings settings;
  settings.mapping = Mapping::uv;
  return *Coat::build(mesh, maps, settings);
}

/// One colour everywhere: a normal tilted by 45 degrees along +x or +y of its frame.
Image tilted(int axis) {
  Image image;
  image.width = 1;
  image.height = 1;
  image.channels = 3;
  image.samples = {128, 128, 218};
  image.samples[static_cast<std::size_t>(axis)] = 218;
  return image;
}

/// Where the coat's frame has its x (0) or y (1) axis on a face.
Vec3 axis_on(const TriangleMesh& mesh, const Coat& coat, std::uint32_t face) {
  const Vec3 third = Vec3::Constant(1.0 / 3.0);
  const Vec3 normal = mesh.face_normal(face);
  const Vec3 shown = coat.sample(mesh, face, third).normal;
  return (shown - shown.dot(normal) * normal).normalized();
}

// NormalTangentTest shows 15 shapes twice: modelled, and 0.32 m to the right of it as two triangles that wear its
// normals, every row with its texture turned another way. Both must look alike.
TEST(GltfTangents, EveryTileOfTheConformanceModelLooksLikeItsModelledTwin) {
  const fs::path path = fs::path(ASPERITY_SHARED_DATA) / "meshes" / "NormalTangentTest.glb";
  if (!fs::exists(path)) GTEST_SKIP() << "no " << path;
  const auto model = read_gltf_model(path);
  ASSERT_TRUE(model.ok()) << model.error().message();
  ASSERT_EQ(model->materials.size(), 1U);
  ASSERT_TRUE(model->materials[0].normals);
  const auto image = normal_image_of(*model->materials[0].normals);
  const auto mesh = TriangleMesh::build(model->mesh, {1.0, false});
  ASSERT_TRUE(mesh.ok());
  const Coat coat = coat_of(*mesh, *image);
  const Coat wrong = coat_of(*mesh, *image, GreenConvention::down);
  const auto in_tile = [&](std::uint32_t face, const Vec2& centre) {
    const auto [a, b, c] = mesh->corners(face);
    const Vec3 middle = (a + b + c) / 3.0;
    return (middle.head<2>() - centre).cwiseAbs().maxCoeff() < 0.15;
  };
  for (const double row : {-0.8, -0.4, 0.0, 0.4, 0.8}) {
    for (const double column : {-0.96, -0.16, 0.64}) {
      std::vector<std::uint32_t> modelled;
      std::vector<std::uint32_t> flat;
      for (std::uint32_t face = 0; face < mesh->triangles().size(); ++face) {
        if (in_tile(face, {column, row})) modelled.push_back(face);
        if (in_tile(face, {column + 0.32, row})) flat.push_back(face);
      }
      ASSERT_EQ(modelled.size(), 516U);
      ASSERT_EQ(flat.size(), 2U);
      std::vector<double> off;
      std::vector<double> off_wrong;
      for (const std::uint32_t face : modelled) {
        const auto [a, b, c] = mesh->corners(face);
        Vec3 twin = (a + b + c) / 3.0 + Vec3(0.32, 0.0, 0.0);
        twin.z() = 0.0;
        for (const std::uint32_t under : flat) {
          const Vec3 barycentric = barycentric_frame(*mesh, under).coordinates(twin);
          if (barycentric.minCoeff() < 0.0) continue;
          off.push_back(angle_between(coat.sample(*mesh, under, barycentric).normal, mesh->face_normal(face)));
          off_wrong.push_back(angle_between(wrong.sample(*mesh, under, barycentric).normal, mesh->face_normal(face)));
        }
      }
      ASSERT_GT(off.size(), 500U);
      // The twins agree to the coarseness of the facets, but for the steep rim; a mirrored frame is nowhere near.
      EXPECT_LT(share(off, 0.5), 4.0 * degree) << row << " " << column;
      EXPECT_LT(share(off, 0.97), 30.0 * degree) << row << " " << column;
      EXPECT_GT(share(off_wrong, 0.5), 20.0 * degree) << row << " " << column;
    }
  }
}

// FlightHelmet states its tangents. They belong to smooth normals and to vertices that several triangles share; on the
// triangles themselves they can only agree in the mean.
TEST(GltfTangents, FramesOfTheHelmetAreThoseThatItsFileStates) {
  const fs::path folder = fs::path(ASPERITY_SHARED_DATA) / "meshes" / "FlightHelmet";
  if (!fs::exists(folder)) GTEST_SKIP() << "no " << folder;
  const auto model = read_gltf_model(folder / "FlightHelmet.gltf");
  ASSERT_TRUE(model.ok()) << model.error().message();
  ASSERT_EQ(model->materials.size(), 6U);
  for (const GltfMaterial& material : model->materials) {
    ASSERT_TRUE(material.normals) << material.name;
    EXPECT_TRUE(material.normals->texture.image->has_colour());
  }
  const auto mesh = TriangleMesh::build(model->mesh, {1.0, false});
  ASSERT_TRUE(mesh.ok());
  const auto source = source_of_faces(model->mesh, *mesh);
  ASSERT_TRUE(source.ok());
  const Coat along = coat_of(*mesh, tilted(0));
  const Coat across = coat_of(*mesh, tilted(1));

  std::ifstream text(folder / "FlightHelmet.gltf");
  const nlohmann::json json = nlohmann::json::parse(text);
  std::ifstream data(folder / "FlightHelmet.bin", std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(data), std::istreambuf_iterator<char>()};
  std::vector<std::array<Vec3, 3>> tangents;
  std::vector<double> hand;
  for (const auto& one : json["meshes"]) {
    const auto& primitive = one["primitives"][0];
    const auto start = [&](const nlohmann::json& index) {
      const auto& accessor = json["accessors"][index.get<std::size_t>()];
      const auto& view = json["bufferViews"][accessor["bufferView"].get<std::size_t>()];
      return bytes.data() + view.value("byteOffset", 0) + accessor.value("byteOffset", 0);
    };
    const char* indices = start(primitive["indices"]);
    const char* stated = start(primitive["attributes"]["TANGENT"]);
    const auto corners = json["accessors"][primitive["indices"].get<std::size_t>()]["count"].get<std::size_t>();
    for (std::size_t i = 0; i + 2 < corners; i += 3) {
      double w = 0.0;
      for (std::size_t k = 0; k < 3; ++k) {
        std::uint16_t vertex = 0;
        std::memcpy(&vertex, indices + 2 * (i + k), sizeof vertex);
        float tangent[4];
        std::memcpy(tangent, stated + 16 * std::size_t{vertex}, sizeof tangent);
        if (k == 0) tangents.emplace_back();
        tangents.back()[k] = Vec3f(tangent[0], tangent[1], tangent[2]).cast<double>();
        w += static_cast<double>(tangent[3]);
      }
      hand.push_back(w);
    }
  }
  ASSERT_EQ(tangents.size(), model->mesh.triangles.size());

  std::vector<double> off;
  std::vector<double> off_across;
  std::size_t turned = 0;
  for (std::uint32_t face = 0; face < mesh->triangles().size(); face += 5) {
    const std::size_t from = (*source)[face];
    const Vec3 normal = mesh->face_normal(face);
    const Vec3 sum = tangents[from][0] + tangents[from][1] + tangents[from][2];
    const Vec3 stated = (sum - sum.dot(normal) * normal).normalized();
    const Vec3 x = axis_on(*mesh, along, face);
    const Vec3 y = axis_on(*mesh, across, face);
    off.push_back(angle_between(x, stated));
    off_across.push_back(angle_between(y, std::copysign(1.0, hand[from]) * normal.cross(stated)));
    turned += (x.cross(y).dot(normal) > 0.0) != (hand[from] > 0.0) ? 1U : 0U;
  }
  EXPECT_LT(share(off, 0.5), 3.0 * degree);
  EXPECT_LT(share(off, 0.9), 10.0 * degree);
  EXPECT_LT(share(off_across, 0.5), 3.0 * degree);
  EXPECT_LT(share(off_across, 0.9), 10.0 * degree);
  // Left- and right-handed parts alike.
  EXPECT_LT(static_cast<double>(turned), 1e-3 * static_cast<double>(off.size()));
  EXPECT_GT(std::count_if(hand.begin(), hand.end(), [](double w) { return w < 0.0; }), 100);
}

// glTF 2.0, 3.7.2.1: the tangent runs along growing u at constant v, the bitangent is N x T times the hand. Where the
// coordinates are sheared that is not where u grows fastest.
TEST(GltfTangents, ShearedAndMirroredCoordinatesKeepAnOrthogonalFrame) {
  for (const bool mirrored : {false, true}) {
    MeshSource source;
    source.positions = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
    source.triangles = {{0, 1, 2}};
    // s along x at constant t; (0, 1) is half a unit further in s.
    const float sign = mirrored ? -1.0F : 1.0F;
    source.corner_uvs = {{Vec2f(0.0F, 0.0F), Vec2f(sign * 1.0F, 0.0F), Vec2f(sign * 0.5F, 1.0F)}};
    const auto mesh = TriangleMesh::build(source);
    ASSERT_TRUE(mesh.ok());
    const Vec3 x = axis_on(*mesh, coat_of(*mesh, tilted(0)), 0);
    const Vec3 y = axis_on(*mesh, coat_of(*mesh, tilted(1)), 0);
    EXPECT_NEAR((x - Vec3(mirrored ? -1.0 : 1.0, 0.0, 0.0)).norm(), 0.0, 1e-6) << x.transpose();
    EXPECT_NEAR((y - Vec3::UnitY()).norm(), 0.0, 1e-6) << y.transpose();
  }
}

}  // namespace
}  // namespace asperity::gltf_tangent_test
