// What is written as glTF comes back, bit for bit where the format can hold it, and other readers take it as it is.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <tiny_gltf.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "asperity/core/rng.h"
#include "asperity/io/gltf_material.h"

namespace asperity::gltf_writer_test {
namespace {

namespace fs = std::filesystem;

class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("asperity-gltf-writer-" + std::to_string(getpid()))) {
    fs::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  fs::path operator/(const std::string& name) const { return path_ / name; }

 private:
  fs::path path_;
};

std::string bytes_of(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

int below(Rng& random, int count) {
  return static_cast<int>(random.uniform() * count);
}

GltfTexture texture(Rng& random, int channels, int bits) {
  auto image = std::make_shared<Image>();
  image->width = 1 + below(random, 4);
  image->height = 1 + below(random, 4);
  image->channels = channels;
  image->bits = bits;
  for (std::size_t i = 0; i < image->pixels() * static_cast<std::size_t>(channels); ++i)
    image->samples.push_back(static_cast<std::uint16_t>(below(random, image->maximum() + 1)));
  return {image, "", random.uniform() < 0.5 ? Wrap::clamp : Wrap::repeat};
}

GltfMaterial material(Rng& random) {
  GltfMaterial made;
  const auto chance = [&] { return random.uniform() < 0.6; };
  if (chance()) made.name = "wool \xc3\xa9";
  if (chance()) made.normals = GltfNormals{texture(random, 3, 8), chance() ? 1.0 : random.uniform()};
  if (chance()) made.height = GltfHeight{texture(random, 1, 16), random.uniform() * 1e-3, -random.uniform(), chance()};
  if (chance()) made.stiffness = GltfValueMap{texture(random, 1, 8), 100.0, 1000.0 * random.uniform(), true};
  if (chance()) made.friction = GltfValueMap{texture(random, 1, 16), 0.0, 1.0, false};
  if (chance()) made.kept.push_back({"stiffness", "Reference", texture(random, 2, 8), ""});
  if (chance()) made.kept.push_back({"temperature", "Low_Resolution", texture(random, 4, 8), R"({"unit":"K"})"});
  if (made.stiffness || made.friction || !made.kept.empty()) made.haptic_name = "felt";
  return made;
}

struct Made {
  MeshSource mesh;
  std::vector<GltfMaterial> materials;
  std::vector<std::uint32_t> material_of_triangle;
};

Made random_model(std::uint64_t seed) {
  Rng random(seed);
  Made made;
  const int vertices = 3 + below(random, 20);
  for (int i = 0; i < vertices; ++i) {
    made.mesh.positions.emplace_back(static_cast<double>(static_cast<float>(random.uniform() - 0.5)),
                                     static_cast<double>(static_cast<float>(random.uniform() * 1e-3)),
                                     static_cast<double>(static_cast<float>(random.uniform() * 1e6)));
  }
  const int materials = 1 + below(random, 3);
  for (int i = 0; i < materials; ++i) made.materials.push_back(material(random));
  const int triangles = 1 + below(random, 30);
  for (int i = 0; i < triangles; ++i) {
    std::array<std::uint32_t, 3> corners{};
    std::array<Vec2f, 3> uvs;
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] = static_cast<std::uint32_t>(below(random, vertices));
      // Multiples of 2^-23, whose difference from 1 a float holds.
      for (int axis = 0; axis < 2; ++axis)
        uvs[k][axis] = static_cast<float>(below(random, 1 << 24) - (1 << 22)) * 0x1p-23F;
    }
    made.mesh.triangles.push_back(corners);
    made.mesh.corner_uvs.push_back(uvs);
    made.material_of_triangle.push_back(static_cast<std::uint32_t>(below(random, materials)));
  }
  return made;
}

void expect_same(const std::optional<GltfValueMap>& a, const std::optional<GltfValueMap>& b) {
  ASSERT_EQ(a.has_value(), b.has_value());
  if (!a) return;
  EXPECT_EQ(a->texture.image->samples, b->texture.image->samples);
  EXPECT_EQ(a->texture.wrap, b->texture.wrap);
  EXPECT_EQ(a->black, b->black);
  EXPECT_EQ(a->white, b->white);
  EXPECT_EQ(a->stated, b->stated);
}

void expect_same(const GltfMaterial& a, const GltfMaterial& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.haptic_name, b.haptic_name);
  ASSERT_EQ(a.normals.has_value(), b.normals.has_value());
  if (a.normals) {
    EXPECT_EQ(a.normals->texture.image->samples, b.normals->texture.image->samples);
    EXPECT_EQ(a.normals->scale, b.normals->scale);
  }
  ASSERT_EQ(a.height.has_value(), b.height.has_value());
  if (a.height) {
    EXPECT_EQ(a.height->texture.image->samples, b.height->texture.image->samples);
    EXPECT_EQ(a.height->texture.image->bits, 16);
    EXPECT_EQ(a.height->texture.wrap, b.height->texture.wrap);
    EXPECT_EQ(a.height->amplitude, b.height->amplitude);
    EXPECT_EQ(a.height->offset, b.height->offset);
    EXPECT_EQ(a.height->white_is_deep, b.height->white_is_deep);
  }
  expect_same(a.stiffness, b.stiffness);
  expect_same(a.friction, b.friction);
  ASSERT_EQ(a.kept.size(), b.kept.size());
  for (std::size_t i = 0; i < a.kept.size(); ++i) {
    EXPECT_EQ(a.kept[i].property, b.kept[i].property);
    EXPECT_EQ(a.kept[i].type, b.kept[i].type);
    EXPECT_EQ(a.kept[i].extras, b.kept[i].extras);
    EXPECT_EQ(a.kept[i].texture.image->samples, b.kept[i].texture.image->samples);
  }
}

/// The triangles of the written mesh in the order that the file has them: by material.
std::vector<std::size_t> sorted_by_material(const Made& made) {
  std::vector<std::size_t> order(made.mesh.triangles.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return made.material_of_triangle[a] < made.material_of_triangle[b];
  });
  return order;
}

void expect_back_bit_for_bit(const Made& made, const Folder& folder) {
  for (const char* name : {"a.glb", "a.gltf"}) {
    const fs::path path = folder / name;
    const Status written = write_gltf(path, made.mesh, made.material_of_triangle, made.materials);
    ASSERT_TRUE(written.ok());
    const auto read = read_gltf_model(path);
    ASSERT_TRUE(read.ok()) << read.error().message();
    const std::vector<std::size_t> order = sorted_by_material(made);
    ASSERT_TRUE(read->mesh.triangles.size() == order.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        ASSERT_TRUE(read->mesh.positions[read->mesh.triangles[i][k]] ==
                    made.mesh.positions[made.mesh.triangles[order[i]][k]]);
        ASSERT_TRUE(read->mesh.corner_uvs[i][k] == made.mesh.corner_uvs[order[i]][k]);
      }
      expect_same(read->materials[read->material_of_triangle[i]], made.materials[made.material_of_triangle[order[i]]]);
    }
    // Written again it is the same file.
    const fs::path again = folder / ("again" + path.extension().string());
    ASSERT_TRUE(write_gltf(again, read->mesh, read->material_of_triangle, read->materials).ok());
    const bool same = bytes_of(again) == bytes_of(path);
    ASSERT_TRUE(same);
    // And the plain reader sees the same triangles.
    const auto plain = read_mesh(path);
    ASSERT_TRUE(plain.ok());
    ASSERT_TRUE(plain->triangles == read->mesh.triangles);
  }
}

// Every file is flushed to the disk: few of them, each with everything drawn anew.
TEST(GltfWriter, WhatIsWrittenComesBackBitForBit) {
  const Folder folder;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    expect_back_bit_for_bit(random_model(seed), folder);
  }
}

TEST(GltfWriter, AnotherReaderTakesItWithoutAWarning) {
  const Folder folder;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const Made made = random_model(seed);
    for (const char* name : {"a.glb", "a.gltf"}) {
      const fs::path path = folder / name;
      ASSERT_TRUE(write_gltf(path, made.mesh, made.material_of_triangle, made.materials).ok());
      tinygltf::TinyGLTF reader;
      tinygltf::Model model;
      std::string error;
      std::string warning;
      const bool good = path.extension() == ".glb" ? reader.LoadBinaryFromFile(&model, &error, &warning, path.string())
                                                   : reader.LoadASCIIFromFile(&model, &error, &warning, path.string());
      EXPECT_TRUE(good) << error;
      EXPECT_EQ(error, "");
      EXPECT_EQ(warning, "");
      bool haptic = false;
      for (const GltfMaterial& one : made.materials) {
        const auto number = static_cast<std::uint32_t>(&one - made.materials.data());
        const bool worn = std::count(made.material_of_triangle.begin(), made.material_of_triangle.end(), number) > 0;
        haptic = haptic || (worn && !one.haptic_name.empty());
      }
      EXPECT_EQ(model.extensions.count("MPEG_haptic_material") > 0, haptic);
      EXPECT_EQ(std::count(model.extensionsUsed.begin(), model.extensionsUsed.end(), "MPEG_haptic_material") > 0,
                haptic);
      for (const tinygltf::Accessor& accessor : model.accessors) {
        const auto& view = model.bufferViews[static_cast<std::size_t>(accessor.bufferView)];
        EXPECT_EQ(view.byteOffset % 4, 0U);
      }
    }
  }
}

TEST(GltfWriter, HeightsOfAFormulaAreQuantisedToSixteenBits) {
  std::vector<float> heights;
  for (int i = 0; i < 64; ++i) heights.push_back(1e-3F * std::sin(0.7F * static_cast<float>(i)));
  const auto map = HeightMap::build(heights, 8, 8, Wrap::clamp, Reconstruction::nearest);
  ASSERT_TRUE(map.ok());
  const GltfHeight texture_of = height_texture_of(*map);
  const auto back = height_map_of(texture_of, Reconstruction::nearest);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->wrap(), Wrap::clamp);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x)
      EXPECT_NEAR(back->texel(x, y), map->texel(x, y), texture_of.amplitude / 131070.0 * 1.001);
  }
}

TEST(GltfWriter, NormalsComeBackFromSixteenBits) {
  Rng random(3);
  const GltfTexture from = texture(random, 3, 8);
  const auto map = NormalMap::build(*from.image, {GreenConvention::up, Wrap::repeat, NormalFilter::nearest});
  ASSERT_TRUE(map.ok());
  const auto image = normal_image_of(normal_texture_of(*map));
  const auto back = NormalMap::build(*image, {GreenConvention::up, Wrap::repeat, NormalFilter::nearest});
  ASSERT_TRUE(back.ok());
  for (int y = 0; y < map->height(); ++y) {
    for (int x = 0; x < map->width(); ++x) EXPECT_LT((back->texel(x, y) - map->texel(x, y)).norm(), 5e-5);
  }
}

TEST(GltfWriter, WhatCannotBeWrittenIsRefusedAndLeavesNothing) {
  const Folder folder;
  const Made made = random_model(5);
  const auto refusal = [&](const fs::path& path, const Made& model) {
    const Status status = write_gltf(path, model.mesh, model.material_of_triangle, model.materials);
    EXPECT_FALSE(status.ok());
    EXPECT_FALSE(fs::exists(path));
    return status.ok() ? Error{} : status.error();
  };
  EXPECT_EQ(refusal(folder / "a.obj", made).code, ErrorCode::bad_value);
  Made wrong = made;
  wrong.material_of_triangle.pop_back();
  EXPECT_EQ(refusal(folder / "a.glb", wrong).code, ErrorCode::mismatch);
  wrong = made;
  wrong.material_of_triangle[0] = 7;
  EXPECT_EQ(refusal(folder / "a.glb", wrong).place, "material_of_triangle");
  wrong = made;
  wrong.mesh.corner_uvs.pop_back();
  EXPECT_EQ(refusal(folder / "a.glb", wrong).place, "mesh");
  wrong = made;
  wrong.mesh.positions[wrong.mesh.triangles[0][0]].x() = 1e300;
  EXPECT_EQ(refusal(folder / "a.glb", wrong).code, ErrorCode::bad_mesh);
  wrong = made;
  Rng random(1);
  wrong.material_of_triangle.assign(wrong.mesh.triangles.size(), 0);
  wrong.materials[0].height = GltfHeight{texture(random, 1, 16), -1.0, 0.0, false};
  EXPECT_EQ(refusal(folder / "a.glb", wrong).place, "materials[0].height");
  wrong.materials[0] = {};
  wrong.materials[0].kept.push_back({"custom", "Other", texture(random, 1, 8), "{"});
  EXPECT_EQ(refusal(folder / "a.glb", wrong).place, "materials[0].kept[0].extras");
  wrong.mesh.triangles.clear();
  EXPECT_EQ(refusal(folder / "a.glb", wrong).code, ErrorCode::bad_mesh);
  EXPECT_EQ(refusal(folder / "no/such/folder/a.glb", made).code, ErrorCode::file_unwritable);
}

RC_GTEST_PROP(GltfWriter, FacesOfTheBuiltMeshAreFoundInTheSource, ()) {
  Rng random(*rc::gen::arbitrary<std::uint64_t>());
  MeshSource source;
  const int vertices = 4 + below(random, 6);
  for (int i = 0; i < vertices; ++i)
    source.positions.emplace_back(random.uniform(), random.uniform(), random.uniform());
  source.positions.push_back(source.positions.front());  // welded
  for (int i = 0; i < 20; ++i) {
    std::array<std::uint32_t, 3> corners{};  // some without area, some twice
    for (auto& corner : corners) corner = static_cast<std::uint32_t>(below(random, vertices + 1));
    source.triangles.push_back(corners);
    source.corner_uvs.push_back({Vec2f(static_cast<float>(i), 0.0F), Vec2f(0, 1), Vec2f(1, 1)});
  }
  const double scale = 1e-3 * (1 + below(random, 5));
  const auto mesh = TriangleMesh::build(source, {scale, true});
  RC_PRE(mesh.ok());
  const auto found = source_of_faces(source, *mesh, scale);
  RC_ASSERT(found.ok());
  RC_ASSERT(found->size() == mesh->triangles().size());
  for (std::uint32_t face = 0; face < found->size(); ++face) {
    // Each source triangle is marked by its own UVs, whichever corner they are on now.
    float mark = 0.0F;
    for (const Vec2f& uv : mesh->uvs(face)) mark = uv.y() == 0.0F ? uv.x() : mark;
    RC_ASSERT((*found)[face] == static_cast<std::uint32_t>(mark));
  }
  MeshSource other = source;
  for (Vec3& p : other.positions) p.x() += 1.0;
  RC_ASSERT(!source_of_faces(other, *mesh, scale).ok());
}

}  // namespace
}  // namespace asperity::gltf_writer_test
