// What of a glTF file is refused and how, and that no damage to one does harm.

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "tests/io/gltf_builder.h"

namespace asperity::gltf_damage_test {
namespace {

namespace fs = std::filesystem;
using namespace test;
using Builder = GltfBuilder;

// ---- what is refused

TEST(Gltf, CyclesAndNodesWithTwoParentsAreRefused) {
  Builder b = plain_square();
  const int child = b.node({{"children", {0}}});
  b.root["nodes"][0]["children"] = {child};
  EXPECT_ERROR(b.text(), ErrorCode::file_malformed, "nodes[0]");
  b.root["nodes"][0].erase("children");
  b.root["scenes"][0]["nodes"] = {child, 0};
  EXPECT_ERROR(b.text(), ErrorCode::file_malformed, "nodes[0]");
  b.root["nodes"][1]["children"] = std::vector<int>(1000, 0);
  b.root["scenes"][0]["nodes"] = {child};
  EXPECT_ERROR(b.text(), ErrorCode::file_malformed, "nodes[1]");
}

TEST(Gltf, DeepHierarchiesAreWalkedWithoutRecursion) {
  Builder b = plain_square({{"translation", {1, 0, 0}}});
  for (int i = 0; i < 20000; ++i) b.node({{"children", {i}}, {"translation", {1, 0, 0}}});
  b.root["scenes"][0]["nodes"] = {20000};
  EXPECT_EQ(read(b.text()).positions[0], Vec3(20001, 0, 0));
}

TEST(Gltf, ExtensionsThatItRequiresAreRefusedByName) {
  for (const char* name : {"KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_mesh_quantization",
                           "EXT_mesh_gpu_instancing", "NEW_thing"}) {
    Builder b = plain_square();
    b.root["extensionsUsed"] = {name};
    EXPECT_EQ(read(b.text()).triangles.size(), 2U);
    b.root["extensionsRequired"] = {name};
    EXPECT_ERROR(b.text(), ErrorCode::file_unsupported, "extensionsRequired");
    EXPECT_NE(error_of(b.text()).what.find(name), std::string::npos);
  }
  Builder b = plain_square();
  b.root["extensionsRequired"] = {"KHR_materials_unlit", "KHR_texture_transform"};
  EXPECT_EQ(read(b.text()).triangles.size(), 2U);
}

TEST(Gltf, OtherVersionsAreRefused) {
  Builder b = plain_square();
  b.root["asset"]["version"] = "1.0";
  EXPECT_ERROR(b.text(), ErrorCode::file_unsupported, "asset.version");
  b.root["asset"] = {{"version", "2.1"}};
  EXPECT_EQ(read(b.text()).triangles.size(), 2U);
  b.root["asset"]["minVersion"] = "2.1";
  EXPECT_ERROR(b.text(), ErrorCode::file_unsupported, "asset.minVersion");
  std::string old = plain_square().binary();
  old[4] = 1;
  EXPECT_ERROR(old, ErrorCode::file_unsupported, "byte 4");
}

TEST(Gltf, EveryReferenceAndRangeIsChecked) {
  struct Case {
    const char* pointer;
    Json value;
    ErrorCode code;
    const char* place;
  };
  constexpr auto huge = std::numeric_limits<std::uint64_t>::max();
  const ErrorCode bad = ErrorCode::bad_mesh;
  const ErrorCode malformed = ErrorCode::file_malformed;
  const std::vector<Case> cases = {
      {"/scene", 1, bad, "scene"},
      {"/scenes/0/nodes/0", 7, bad, "scenes[0].nodes[0]"},
      {"/nodes/0/mesh", 1, bad, "nodes[0].mesh"},
      {"/nodes/0/mesh", -1, malformed, "nodes[0].mesh"},
      {"/nodes/0/mesh", "0", malformed, "nodes[0].mesh"},
      {"/nodes/0/matrix", {1, 2, 3}, malformed, "nodes[0].matrix"},
      {"/nodes/0/matrix", std::vector<double>(16, 1.0), malformed, "nodes[0].matrix"},
      {"/nodes/0/rotation", {0, 0, 0, 0}, malformed, "nodes[0].rotation"},
      {"/nodes/0/scale", {1e300, 1e300, 1e300}, ErrorCode{}, nullptr},
      {"/nodes/0/translation", {"a", 0, 0}, malformed, "nodes[0].translation"},
      {"/nodes/0/children", {5}, bad, "nodes[0].children[0]"},
      {"/meshes/0/primitives/0/attributes/POSITION", 9, bad, "meshes[0].primitives[0].attributes.POSITION"},
      {"/meshes/0/primitives/0/attributes/POSITION", 1, ErrorCode::file_unsupported,
       "meshes[0].primitives[0].attributes.POSITION"},
      {"/meshes/0/primitives/0/attributes", 3, malformed, "meshes[0].primitives[0].attributes"},
      {"/meshes/0/primitives/0/indices", 9, bad, "meshes[0].primitives[0].indices"},
      {"/meshes/0/primitives/0/indices", 0, malformed, "meshes[0].primitives[0].indices"},
      {"/meshes/0/primitives/0/mode", 7, malformed, "meshes[0].primitives[0].mode"},
      {"/meshes/0/primitives", 7, malformed, "meshes[0].primitives"},
      {"/accessors/0/bufferView", 9, bad, "accessors[0].bufferView"},
      {"/accessors/0/count", 5, bad, "accessors[0]"},
      {"/accessors/0/count", 100'000'000, bad, "accessors[0]"},
      {"/accessors/0/count", huge, ErrorCode::too_large, "nodes[0]"},
      {"/accessors/0/count", 4.5, malformed, "accessors[0].count"},
      {"/accessors/0/byteOffset", 4, bad, "accessors[0]"},
      {"/accessors/0/byteOffset", huge, bad, "accessors[0]"},
      {"/accessors/0/componentType", 5124, ErrorCode::file_unsupported, "meshes[0].primitives[0].attributes.POSITION"},
      {"/accessors/1/count", 3, bad, "meshes[0].primitives[0].attributes.TEXCOORD_0"},
      {"/accessors/2/count", huge, ErrorCode::too_large, "nodes[0]"},
      {"/accessors/2/componentType", 5122, malformed, "meshes[0].primitives[0].indices"},
      {"/accessors/2/byteOffset", 2, bad, "accessors[2]"},
      {"/bufferViews/0/buffer", 1, bad, "bufferViews[0].buffer"},
      {"/bufferViews/0/byteOffset", 1'000'000, bad, "bufferViews[0]"},
      {"/bufferViews/0/byteOffset", huge, bad, "bufferViews[0]"},
      {"/bufferViews/0/byteLength", huge, bad, "bufferViews[0]"},
      {"/bufferViews/0/byteStride", 8, malformed, "bufferViews[0]"},
      {"/bufferViews/0/byteStride", 252, bad, "accessors[0]"},
  };
  for (const Case& c : cases) {
    Builder b = plain_square();
    b.root[Json::json_pointer(c.pointer)] = c.value;
    if (c.place == nullptr) {
      EXPECT_EQ(read(b.text()).triangles.size(), 2U) << c.pointer;  // large, but a number still
      continue;
    }
    SCOPED_TRACE(std::string(c.pointer) + " = " + c.value.dump());
    EXPECT_ERROR(b.text(), c.code, c.place);
    EXPECT_ERROR(b.binary(), c.code, c.place);
  }
}

TEST(Gltf, CoordinatesThatAreNotFiniteAreRefused) {
  for (const float wrong : {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    Builder b = plain_square();
    std::memcpy(b.data.data() + 16, &wrong, sizeof wrong);
    EXPECT_ERROR(b.text(), ErrorCode::bad_mesh, "meshes[0].primitives[0]");
    b = plain_square();
    std::memcpy(b.data.data() + 48, &wrong, sizeof wrong);
    EXPECT_ERROR(b.text(), ErrorCode::bad_mesh, "meshes[0].primitives[0].attributes.TEXCOORD_0");
  }
  Builder far = plain_square({{"scale", {1e308, 1, 1}}, {"translation", {1.7e308, 0, 0}}});
  EXPECT_ERROR(far.text(), ErrorCode::bad_mesh, "nodes[0]");
  Builder index = plain_square();
  index.data[index.root["bufferViews"][2]["byteOffset"].get<std::size_t>()] = 4;
  EXPECT_ERROR(index.text(), ErrorCode::bad_mesh, "meshes[0].primitives[0].indices");
}

TEST(Gltf, InstancesCannotAskForAnyAmountOfMemory) {
  // 1,000 nodes place a mesh of 1,000 parts that share a thousand vertices: 1,000 million triangles from 100 kB.
  Builder b;
  const int positions = b.positions(std::vector<float>(3'000, 0.5F));
  Json primitives = Json::array();
  for (int i = 0; i < 1000; ++i) primitives.push_back({{"attributes", {{"POSITION", positions}}}, {"mode", 5}});
  const int mesh = b.mesh(primitives);
  std::vector<int> nodes;
  for (int i = 0; i < 1000; ++i) nodes.push_back(b.node({{"mesh", mesh}}));
  b.scene(nodes);
  EXPECT_ERROR(b.binary(), ErrorCode::too_large, "nodes[67]");
  // The same with parts that hold no triangle.
  for (Json& primitive : b.root["meshes"][0]["primitives"]) primitive["mode"] = 0;
  for (int i = 0; i < 20'000; ++i) nodes.push_back(b.node({{"mesh", mesh}}));
  b.root["scenes"][0]["nodes"] = nodes;
  EXPECT_ERROR(b.binary(), ErrorCode::too_large, "nodes[16777]");
}

TEST(Gltf, ScenesWithoutTrianglesAreRefused) {
  Builder b = plain_square();
  b.root["meshes"][0]["primitives"][0]["mode"] = 0;
  EXPECT_ERROR(b.text(), ErrorCode::bad_mesh, "");
  EXPECT_ERROR(R"({"asset":{"version":"2.0"}})", ErrorCode::bad_mesh, "");
  EXPECT_ERROR(R"({"asset":{"version":"2.0"},"scenes":[]})", ErrorCode::bad_mesh, "");
  EXPECT_ERROR("[]", ErrorCode::file_malformed, "");
  EXPECT_ERROR("{}", ErrorCode::file_malformed, "asset");
  EXPECT_ERROR("", ErrorCode::file_empty, "");
  EXPECT_ERROR("{\"asset\":1e999}", ErrorCode::file_malformed, "");
  EXPECT_ERROR(std::string(100'000, '['), ErrorCode::file_truncated, "");
}

// ---- buffers

/// A folder of its own for each test.
class GltfFiles : public testing::Test {
 protected:
  GltfFiles() {
    folder_ = fs::temp_directory_path() /
              ("asperity-gltf-" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + "-" +
               std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "parts");
  }
  ~GltfFiles() override { fs::remove_all(folder_); }
  [[nodiscard]] fs::path file(const std::string& name, const std::string& content) const {
    std::ofstream(folder_ / name, std::ios::binary) << content;
    return folder_ / name;
  }
  fs::path folder_;
};

TEST_F(GltfFiles, BuffersLieInFilesBesideIt) {
  const Builder b = plain_square();
  for (const char* name : {"square.bin", "parts/square.bin", "a b.bin"}) {
    const fs::path data = file(name, b.data + "left over");
    const std::string uri = std::string(name) == "a b.bin" ? "a%20b.bin" : name;
    const fs::path path = file("square.gltf", b.text(uri));
    const auto source = read_mesh(path);
    ASSERT_TRUE(source.ok()) << source.error().message();
    EXPECT_EQ(source->triangles.size(), 2U);

    std::ofstream(data, std::ios::binary) << b.data.substr(0, b.data.size() - 1);
    const auto cut = read_mesh(path);
    ASSERT_FALSE(cut.ok());
    EXPECT_EQ(cut.error().code, ErrorCode::file_truncated) << cut.error().message();
    EXPECT_EQ(cut.error().place, "buffers[0]");
    EXPECT_EQ(cut.error().file, path.string());
    EXPECT_NE(cut.error().what.find(name), std::string::npos);

    fs::remove(data);
    const auto missing = read_mesh(path);
    ASSERT_FALSE(missing.ok());
    EXPECT_EQ(missing.error().code, ErrorCode::file_missing) << missing.error().message();
    EXPECT_NE(missing.error().what.find(name), std::string::npos);
    fs::create_directories(data);
    EXPECT_EQ(read_mesh(path).error().code, ErrorCode::file_missing);
    fs::remove(data);
  }
}

TEST_F(GltfFiles, OnlyRelativePathsAreFollowed) {
  const Builder b = plain_square();
  const fs::path data = file("square.bin", b.data);
  for (const std::string& uri :
       {data.string(), "file://" + data.string(), std::string("http://example.com/square.bin"),
        std::string("D:\\square.bin"), "%2F" + data.string().substr(1), std::string("\\\\host\\square.bin")}) {
    const auto source = read_mesh(file("square.gltf", b.text(uri)));
    ASSERT_FALSE(source.ok()) << uri;
    EXPECT_EQ(source.error().code, ErrorCode::file_unsupported) << source.error().message();
    EXPECT_EQ(source.error().place, "buffers[0].uri");
  }
  EXPECT_EQ(read_mesh(file("parts/square.gltf", b.text("../square.bin")))->triangles.size(), 2U);
  // From memory there is no folder to look in.
  EXPECT_ERROR(b.text("square.bin"), ErrorCode::file_unsupported, "buffers[0].uri");
}

TEST(Gltf, DamagedDataUrisAreRefused) {
  const Builder b = plain_square();
  EXPECT_ERROR(b.text("data:application/octet-stream,abc"), ErrorCode::file_malformed, "buffers[0].uri");
  EXPECT_ERROR(b.text("data:application/octet-stream;base64"), ErrorCode::file_malformed, "buffers[0].uri");
  EXPECT_ERROR(b.text("data:;base64,AAA*"), ErrorCode::file_malformed, "buffers[0].uri");
  EXPECT_ERROR(b.text("data:;base64,AAAA"), ErrorCode::file_truncated, "buffers[0]");
  EXPECT_ERROR(b.text("data:;base64,"), ErrorCode::file_truncated, "buffers[0]");
  EXPECT_ERROR(b.text(""), ErrorCode::file_malformed, "buffers[0]");
  EXPECT_EQ(read(b.text("data:;base64," + base64(b.data))).triangles.size(), 2U);
}

TEST(Gltf, DamagedContainersAreRefused) {
  const std::string good = plain_square().binary();
  const auto with = [&](std::size_t at, std::uint32_t number) {
    std::string bytes = good;
    std::memcpy(bytes.data() + at, &number, sizeof number);
    return bytes;
  };
  std::uint32_t json_size = 0;
  std::memcpy(&json_size, good.data() + 12, sizeof json_size);
  const auto size = static_cast<std::uint32_t>(good.size());
  const std::string end = "byte " + std::to_string(size);
  EXPECT_ERROR(with(8, size + 1), ErrorCode::file_truncated, end);
  EXPECT_ERROR(with(8, 0xffffffffU), ErrorCode::file_truncated, end);
  EXPECT_ERROR(with(12, 0xffffffffU), ErrorCode::file_malformed, "byte 12");
  EXPECT_ERROR(with(16, 0), ErrorCode::file_malformed, "byte 12");
  // The binary chunk may not reach beyond the file by as much as its own header.
  const std::size_t binary_chunk = 20 + json_size;
  std::uint32_t binary_size = 0;
  std::memcpy(&binary_size, good.data() + binary_chunk, sizeof binary_size);
  EXPECT_ERROR(with(binary_chunk, binary_size + 8), ErrorCode::file_malformed, "byte " + std::to_string(binary_chunk));
  EXPECT_ERROR(with(binary_chunk + 4, 0), ErrorCode::file_malformed, "buffers[0]");  // a chunk of no known type
  EXPECT_EQ(read(good + "more", "a.glb").triangles.size(), 2U);
  EXPECT_TRUE(has_note(read(good + "more", "a.glb"), "4 bytes behind"));
}

TEST(Gltf, NoTruncationAndNoFlippedByteDoesHarm) {
  for (const std::string& good : {plain_square().binary(), plain_square().text()}) {
    for (std::size_t size = 0; size < good.size(); ++size) {
      const auto source = read_mesh_bytes(good.substr(0, size), "a.gltf");
      ASSERT_FALSE(source.ok()) << size;
      EXPECT_FALSE(source.error().what.empty());
    }
    std::size_t read_anyway = 0;
    for (std::size_t at = 0; at < good.size(); ++at) {
      for (const unsigned flip : {0x01U, 0x80U, 0xffU}) {
        std::string bytes = good;
        bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ flip);
        const auto source = read_mesh_bytes(bytes, "a.gltf");
        if (!source.ok()) {
          EXPECT_FALSE(source.error().what.empty());
          continue;
        }
        ++read_anyway;
        for (const auto& triangle : source->triangles) {
          for (const std::uint32_t corner : triangle) ASSERT_LT(corner, source->positions.size());
        }
        for (const Vec3& position : source->positions) ASSERT_TRUE(position.allFinite());
      }
    }
    EXPECT_GT(read_anyway, 0U);  // a changed coordinate is no error
  }
}

}  // namespace
}  // namespace asperity::gltf_damage_test
