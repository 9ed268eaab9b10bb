// What of a glTF file is read, where it stands and which side it shows.

#include <gtest/gtest.h>

#include <cmath>

#include "asperity/geometry/generators.h"
#include "tests/io/gltf_builder.h"

namespace asperity::gltf_test {
namespace {

namespace fs = std::filesystem;
using namespace test;
using Builder = GltfBuilder;

// ---- what is read

TEST(Gltf, ReadsTheSameFromTextAndBinary) {
  const Builder b = plain_square();
  for (const MeshSource& source : {read(b.text()), read(b.binary(), "a.glb"), read(b.binary(), "anything")}) {
    ASSERT_EQ(source.positions.size(), 4U);
    ASSERT_EQ(source.triangles.size(), 2U);
    EXPECT_EQ(source.positions[2], Vec3(1, 1, 0));
    EXPECT_EQ(source.triangles[1], (std::array<std::uint32_t, 3>{0, 2, 3}));
    EXPECT_TRUE(has_note(source, "lengths are metres"));
  }
}

TEST(Gltf, ContentDecidesBeforeTheExtension) {
  const Builder b = plain_square();
  for (const char* name : {"a.glb", "a.GLTF"}) EXPECT_EQ(read(b.text(), name).triangles.size(), 2U) << name;
  for (const char* name : {"a.obj", "a.ply", "a.stl"}) EXPECT_EQ(read(b.binary(), name).triangles.size(), 2U) << name;
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  EXPECT_EQ(read(ply, "a.gltf").triangles.size(), 1U);
}

TEST(Gltf, MapsLieAsInObjFiles) {
  // The vertex at the origin has v = 1 in glTF, the lower edge of a map; in OBJ files that edge is v = 0.
  const MeshSource source = read(plain_square().text());
  ASSERT_EQ(source.corner_uvs.size(), 2U);
  for (std::size_t face = 0; face < 2; ++face) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Vec3& position = source.positions[source.triangles[face][corner]];
      EXPECT_EQ(source.corner_uvs[face][corner].cast<double>(), Vec2(position.x(), position.y()));
    }
  }
}

TEST(Gltf, ReadsEveryTypeOfIndexAndNone) {
  const auto with = [](auto type) {
    Builder b;
    const int positions = b.positions(square);
    const int indices = b.indices<decltype(type)>({0, 1, 2, 0, 2, 3});
    b.scene(
        {b.node({{"mesh", b.mesh(Json::array({{{"attributes", {{"POSITION", positions}}}, {"indices", indices}}}))}})});
    return twice_area(read(b.text()));
  };
  EXPECT_EQ(with(std::uint8_t{}), Vec3(0, 0, 2));
  EXPECT_EQ(with(std::uint16_t{}), Vec3(0, 0, 2));
  EXPECT_EQ(with(std::uint32_t{}), Vec3(0, 0, 2));
  Builder bare;
  const int positions = bare.positions({0, 0, 0, 1, 0, 0, 1, 1, 0, 5, 5, 5});
  bare.scene({bare.node({{"mesh", bare.mesh(Json::array({{{"attributes", {{"POSITION", positions}}}}}))}})});
  const MeshSource source = read(bare.text());
  EXPECT_EQ(source.triangles.size(), 1U);
  EXPECT_TRUE(has_note(source, "1 parts end with an incomplete triangle"));
}

TEST(Gltf, StripsAndFansKeepTheirSide) {
  // Both go round the same pentagon, whose twice the area is known from its corners.
  std::vector<float> ring;
  for (int i = 0; i < 5; ++i) {
    const double angle = 2.0 * 3.14159265358979 * i / 5;
    ring.insert(ring.end(), {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0.0F});
  }
  const double area = 5.0 * std::sin(2.0 * 3.14159265358979 / 5.0);
  for (const int mode : {5, 6}) {
    Builder b;
    const int positions = b.positions(ring);
    const auto order = mode == 5 ? std::vector<std::uint8_t>{0, 1, 4, 2, 3} : std::vector<std::uint8_t>{0, 1, 2, 3, 4};
    const int indices = b.indices(order);
    b.scene({b.node(
        {{"mesh",
          b.mesh(Json::array({{{"attributes", {{"POSITION", positions}}}, {"indices", indices}, {"mode", mode}}}))}})});
    const MeshSource source = read(b.text());
    EXPECT_EQ(source.triangles.size(), 3U);
    EXPECT_NEAR(twice_area(source).z(), area, 1e-6) << "mode " << mode;
  }
}

TEST(Gltf, StripsLeaveOutTheirStitches) {
  Builder b;
  const int positions = b.positions(square);
  const int indices = b.indices<std::uint8_t>({0, 1, 2, 2, 0, 2, 3});
  b.scene({b.node({{"mesh", b.mesh(Json::array(
                                {{{"attributes", {{"POSITION", positions}}}, {"indices", indices}, {"mode", 5}}}))}})});
  const MeshSource source = read(b.text());
  EXPECT_EQ(source.triangles.size(), 2U);
  EXPECT_EQ(twice_area(source), Vec3(0, 0, 2));
}

TEST(Gltf, LeavesOutPointsAndLinesWithANote) {
  Builder b = plain_square();
  Json& primitives = b.root["meshes"][0]["primitives"];
  for (const int mode : {0, 1, 2, 3}) primitives.push_back({{"attributes", {{"POSITION", 0}}}, {"mode", mode}});
  const MeshSource source = read(b.text());
  EXPECT_EQ(source.triangles.size(), 2U);
  EXPECT_EQ(source.positions.size(), 4U);
  EXPECT_TRUE(has_note(source, "4 parts of points or lines"));
}

TEST(Gltf, HonoursStridesAndOffsets) {
  Builder b;
  const int view = b.view<float>({9, 9, 9, 0, 0, 0, 1, 0, 0, 1, 1, 0}, 20, 12);
  const int positions = b.accessor(view, 5126, 3, "VEC3");
  b.root["accessors"][0]["byteOffset"] = 20;
  b.scene({b.node({{"mesh", b.mesh(Json::array({{{"attributes", {{"POSITION", positions}}}}}))}})});
  EXPECT_EQ(twice_area(read(b.text())), Vec3(0, 0, 1));
  // The last element needs no room for a whole stride behind it.
  b.root["bufferViews"][0]["byteLength"] = 72;
  EXPECT_EQ(twice_area(read(b.text())), Vec3(0, 0, 1));
  b.root["bufferViews"][0]["byteLength"] = 71;
  EXPECT_ERROR(b.text(), ErrorCode::bad_mesh, "accessors[0]");
}

TEST(Gltf, ReadsNormalisedTextureCoordinates) {
  for (const bool bytes : {true, false}) {
    Builder b = plain_square();
    const int view = bytes ? b.view<std::uint8_t>({0, 255, 255, 255, 255, 0, 0, 51})
                           : b.view<std::uint16_t>({0, 65535, 65535, 65535, 65535, 0, 0, 13107});
    b.root["accessors"].push_back({{"bufferView", view},
                                   {"componentType", bytes ? 5121 : 5123},
                                   {"normalized", true},
                                   {"count", 4},
                                   {"type", "VEC2"}});
    b.root["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = 3;
    const MeshSource source = read(b.text());
    ASSERT_EQ(source.corner_uvs.size(), 2U);
    EXPECT_EQ(source.corner_uvs[0][1], Vec2f(1.0F, 0.0F));
    EXPECT_NEAR(source.corner_uvs[1][2].y(), 0.8F, 1e-6F);
    b.root["accessors"][3]["normalized"] = false;
    EXPECT_ERROR(b.text(), ErrorCode::file_unsupported, "meshes[0].primitives[0].attributes.TEXCOORD_0");
  }
}

TEST(Gltf, TextureCoordinatesOfAPartOfTheTrianglesAreLeftOut) {
  Builder b = plain_square();
  b.root["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", 0}}}, {"indices", 2}});
  const MeshSource source = read(b.text());
  EXPECT_EQ(source.triangles.size(), 4U);
  EXPECT_EQ(source.positions.size(), 4U);  // both parts share one accessor
  EXPECT_TRUE(source.corner_uvs.empty());
  EXPECT_TRUE(has_note(source, "only 2 of 4 triangles"));
}

TEST(Gltf, SparseAccessorsChangeWhatTheySay) {
  Builder b = plain_square();
  const int indices = b.view<std::uint8_t>({1, 2});
  const int values = b.view<float>({3, 0, 0, 3, 1, 0});
  b.root["accessors"][0]["sparse"] = {{"count", 2},
                                      {"indices", {{"bufferView", indices}, {"componentType", 5121}}},
                                      {"values", {{"bufferView", values}}}};
  EXPECT_EQ(twice_area(read(b.text())), Vec3(0, 0, 6));
  Builder zeros = b;
  zeros.root["accessors"][0].erase("bufferView");
  EXPECT_EQ(twice_area(read(zeros.text())), Vec3(0, 0, 3));
  zeros.root["accessors"][0]["count"] = 2'000'000'000;
  zeros.root["meshes"][0]["primitives"][0]["attributes"].erase("TEXCOORD_0");
  EXPECT_EQ(error_of(zeros.text()).code, ErrorCode::too_large);
  b.data[b.root["bufferViews"][3]["byteOffset"].get<std::size_t>()] = 4;
  EXPECT_ERROR(b.text(), ErrorCode::bad_mesh, "accessors[0].sparse");
}

// ---- the scene

TEST(Gltf, PlacesMeshesByMatricesAndByTheirParts) {
  const double turn = std::sqrt(0.5);  // a quarter turn about z
  const Json parts = {{"translation", {1, 2, 3}}, {"rotation", {0, 0, turn, turn}}, {"scale", {2, 3, 1}}};
  const Json matrix = {{"matrix", {0, 2, 0, 0, -3, 0, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1}}};
  for (const Json& node : {parts, matrix}) {
    const MeshSource source = read(plain_square(node).text());
    ASSERT_EQ(source.positions.size(), 4U);
    EXPECT_LT((source.positions[0] - Vec3(1, 2, 3)).norm(), 1e-14);
    EXPECT_LT((source.positions[1] - Vec3(1, 4, 3)).norm(), 1e-14);
    EXPECT_LT((source.positions[3] - Vec3(-2, 2, 3)).norm(), 1e-14);
    EXPECT_LT((twice_area(source) - Vec3(0, 0, 12)).norm(), 1e-13);
  }
}

TEST(Gltf, PlacesChildrenInTheirParentsAndInstancesEachOnItsOwn) {
  Builder b = plain_square({{"translation", {0, 0, 1}}});
  const int twin = b.node({{"mesh", 0}, {"translation", {0, 0, 2}}});
  const int parent = b.node({{"children", {0, twin}}, {"scale", {10, 10, 10}}});
  b.root["scenes"][0]["nodes"] = {parent};
  const MeshSource source = read(b.text());
  ASSERT_EQ(source.positions.size(), 8U);
  EXPECT_EQ(source.triangles.size(), 4U);
  EXPECT_EQ(source.positions[2], Vec3(10, 10, 10));
  EXPECT_EQ(source.positions[6], Vec3(10, 10, 20));
}

TEST(Gltf, MirroredNodesTurnTheirTrianglesRound) {
  const MeshSource plain = read(plain_square().text());
  const MeshSource mirrored = read(plain_square({{"scale", {-1, 1, 1}}}).text());
  EXPECT_EQ(twice_area(mirrored), twice_area(plain));
  for (std::size_t corner = 0; corner < 3; ++corner) {
    const Vec3& position = mirrored.positions[mirrored.triangles[0][corner]];
    EXPECT_EQ(mirrored.corner_uvs[0][corner].cast<double>(), Vec2(-position.x(), position.y()));
  }
  // A closed solid keeps its outside.
  Builder b;
  const MeshSource ball = icosphere(1, 1.0);
  std::vector<float> positions;
  for (const Vec3& p : ball.positions) {
    for (int axis = 0; axis < 3; ++axis) positions.push_back(static_cast<float>(p[axis]));
  }
  std::vector<std::uint16_t> indices;
  for (const auto& triangle : ball.triangles) {
    for (const std::uint32_t corner : triangle) indices.push_back(static_cast<std::uint16_t>(corner));
  }
  const int position = b.positions(positions);
  const int index = b.indices(indices);
  const int mesh = b.mesh(Json::array({{{"attributes", {{"POSITION", position}}}, {"indices", index}}}));
  b.scene({b.node({{"mesh", mesh}, {"scale", {-1, -1, -1}}})});
  const auto built = TriangleMesh::build(read(b.text()), {1.0, false});
  ASSERT_TRUE(built.ok());
  EXPECT_GT(built->report().signed_volume, 3.0);
  EXPECT_TRUE(built->report().closed());
}

TEST(Gltf, ReadsTheDefaultSceneAndSaysWhatElseThereIs) {
  Builder b = plain_square();
  b.scene({b.node({{"mesh", b.mesh(Json::array({{{"attributes", {{"POSITION", 0}}}}}))}})});
  b.root["scene"] = 1;
  const MeshSource source = read(b.text());
  EXPECT_EQ(source.triangles.size(), 1U);
  EXPECT_TRUE(has_note(source, "scene 1 of 2"));
  EXPECT_TRUE(has_note(source, "1 of 2 meshes stand in no node"));
  b.root.erase("scene");
  EXPECT_EQ(read(b.text()).triangles.size(), 2U);
  b.root.erase("scenes");
  EXPECT_EQ(read(b.text()).triangles.size(), 3U);
  b.root.erase("nodes");
  EXPECT_EQ(read(b.text()).triangles.size(), 3U);
}

TEST(Gltf, NotesSkinsMorphTargetsAndAnimations) {
  Builder b = plain_square({{"skin", 0}});
  b.root["skins"] = Json::array({{{"joints", {0}}}});
  b.root["animations"] = Json::array({Json::object()});
  b.root["meshes"][0]["primitives"][0]["targets"] = Json::array({{{"POSITION", 0}}});
  b.root["cameras"] = "nonsense that nobody looks at";
  b.root["images"] = Json::array({{{"uri", "no-such-image.png"}}});
  b.root["extras"] = {{"deep", {{"deeper", {1, 2, 3}}}}};
  const MeshSource source = read(b.text());
  EXPECT_TRUE(has_note(source, "skeleton"));
  EXPECT_TRUE(has_note(source, "morph targets of 1 parts"));
  EXPECT_TRUE(has_note(source, "1 animations"));
}

// ---- real files; their counts are those of their JSON

TEST(Gltf, ReadsRealFiles) {
  const fs::path data = fs::path(ASPERITY_SHARED_DATA) / "meshes";
  if (!fs::exists(data / "NormalTangentTest.glb")) GTEST_SKIP() << "shared data absent: " << data;
  const auto panels = read_mesh(data / "NormalTangentTest.glb");
  ASSERT_TRUE(panels.ok()) << panels.error().message();
  EXPECT_EQ(panels->positions.size(), 3983U);
  EXPECT_EQ(panels->triangles.size(), 23322U / 3U);
  EXPECT_EQ(panels->corner_uvs.size(), panels->triangles.size());
  const auto helmet = read_mesh(data / "FlightHelmet" / "FlightHelmet.gltf");
  ASSERT_TRUE(helmet.ok()) << helmet.error().message();
  EXPECT_EQ(helmet->positions.size(), 10472U + 13638U + 4676U + 13636U + 12534U + 436U);
  EXPECT_EQ(helmet->triangles.size(), (59040U + 72534U + 24408U + 60288U + 65688U + 2208U) / 3U);
  EXPECT_EQ(helmet->corner_uvs.size(), helmet->triangles.size());
  const auto mesh = TriangleMesh::build(*helmet);
  ASSERT_TRUE(mesh.ok()) << mesh.error().message();
  EXPECT_GT(mesh->bounds().extent().minCoeff(), 0.2);  // a helmet on its stand, in metres
  EXPECT_LT(mesh->bounds().extent().maxCoeff(), 1.0);
}

}  // namespace
}  // namespace asperity::gltf_test
