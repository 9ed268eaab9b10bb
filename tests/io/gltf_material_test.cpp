// What the materials of glTF files say about touch: textures, heights in extras, MPEG_haptic_material in every
// spelling.

#include "asperity/io/gltf_material.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "asperity/io/image_io.h"
#include "tests/io/gltf_builder.h"

namespace asperity::gltf_material_test {
namespace {

using namespace test;
using Builder = GltfBuilder;

Image picture(int channels, int bits, std::uint16_t first) {
  Image image;
  image.width = 2;
  image.height = 2;
  image.channels = channels;
  image.bits = bits;
  for (int i = 0; i < 4 * channels; ++i) image.samples.push_back(static_cast<std::uint16_t>(first + i));
  return image;
}

std::string png(const Image& image) {
  auto bytes = encode_png(image);
  EXPECT_TRUE(bytes.ok());
  return bytes.ok() ? *bytes : "";
}

/// A square with one material and three textures: 0 normals, 1 heights (16 bits, clamped), 2 a data URI.
Builder dressed_square() {
  Builder b = plain_square();
  const auto embedded = [&](const std::string& bytes) { return b.view(std::vector<char>(bytes.begin(), bytes.end())); };
  const int normals = embedded(png(picture(3, 8, 100)));
  const int heights = embedded(png(picture(1, 16, 1000)));
  const std::string uri = "data:image/png;base64," + base64(png(picture(1, 8, 7)));
  b.root["images"] = {{{"bufferView", normals}, {"mimeType", "image/png"}},
                      {{"bufferView", heights}, {"mimeType", "image/png"}},
                      {{"uri", uri}}};
  b.root["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33071}}};
  b.root["textures"] = {{{"source", 0}}, {{"source", 1}, {"sampler", 0}}, {{"source", 2}}};
  b.root["materials"] = Json::array({{{"name", "wool"}}});
  b.root["meshes"][0]["primitives"][0]["material"] = 0;
  return b;
}

GltfModel model_of(const Builder& b) {
  auto model = read_gltf_model_bytes(b.binary(), "a.glb");
  EXPECT_TRUE(model.ok()) << (model.ok() ? "" : model.error().message());
  return model.ok() ? std::move(model).value() : GltfModel{};
}

Error refusal_of(const Builder& b) {
  const auto model = read_gltf_model_bytes(b.text(), "a.gltf");
  EXPECT_FALSE(model.ok());
  if (model.ok()) return {};
  EXPECT_EQ(model.error().file, "a.gltf");
  EXPECT_FALSE(model.error().what.empty());
  EXPECT_FALSE(model.error().accepted.empty()) << model.error().message();
  return model.error();
}

const Json height_extras = {{"asperity",
                             {{"height_texture", {{"index", 1}, {"texCoord", 0}}},
                              {"amplitude", 0.002},
                              {"offset", -0.001},
                              {"white_is", "deep"}}}};

TEST(GltfMaterial, NormalsAndHeightsAreRead) {
  Builder b = dressed_square();
  b.root["materials"][0]["normalTexture"] = {{"index", 0}, {"scale", 0.5}};
  b.root["materials"][0]["extras"] = height_extras;
  const GltfModel model = model_of(b);
  ASSERT_EQ(model.materials.size(), 1U);
  EXPECT_EQ(model.material_of_triangle, (std::vector<std::uint32_t>{0, 0}));
  const GltfMaterial& material = model.materials[0];
  EXPECT_EQ(material.name, "wool");
  ASSERT_TRUE(material.normals && material.height);
  EXPECT_EQ(material.normals->texture.image->samples, picture(3, 8, 100).samples);
  EXPECT_EQ(material.normals->scale, 0.5);
  EXPECT_EQ(material.normals->texture.wrap, Wrap::repeat);
  EXPECT_EQ(material.height->texture.image->samples, picture(1, 16, 1000).samples);
  EXPECT_EQ(material.height->texture.wrap, Wrap::clamp);
  EXPECT_EQ(material.height->amplitude, 0.002);
  EXPECT_EQ(material.height->offset, -0.001);
  EXPECT_TRUE(material.height->white_is_deep);
  const auto heights = height_map_of(*material.height, Reconstruction::nearest);
  ASSERT_TRUE(heights.ok());
  EXPECT_NEAR(heights->texel(0, 0), -0.001 - 0.002 * 1000 / 65535.0, 1e-9);
  // The mesh itself is what read_mesh() gives.
  EXPECT_EQ(model.mesh.triangles, read(b.text()).triangles);
  EXPECT_EQ(model.mesh.corner_uvs, read(b.text()).corner_uvs);
}

TEST(GltfMaterial, EverySpellingOfHapticMaterialsIsRead) {
  for (const char* name : {"MPEG_haptic_material", "MPEG_material_haptic"}) {
    for (const char* where : {"/meshes/0", "/meshes/0/primitives/0", "/materials/0"}) {
      for (const bool object : {true, false}) {
        for (const bool listed : {true, false}) {
          for (const char* stiffness : {"stiffness", "stifness"}) {
            Builder b = dressed_square();
            Json entry = {{"texture", {{"index", 2}}}, {"type", "High_Resolution"}};
            entry["extras"]["asperity"] = {{"black", 200.0}, {"white", 900.0}};
            Json friction = {{"texture", {{"index", 1}}}};
            Json& haptic = b.root["extensions"][name]["materials"][0];
            haptic["name"] = "felt";
            haptic[stiffness] = listed ? Json::array({entry}) : entry;
            haptic["friction"] = listed ? Json::array({friction}) : friction;
            const Json index = object ? Json{{"hapticMaterialIndex", 0}} : Json(0);
            b.root[Json::json_pointer(where)]["extensions"][name] = index;
            const GltfModel model = model_of(b);
            SCOPED_TRACE(fmt::format("{} {} {} {} {}", name, where, object, listed, stiffness));
            ASSERT_EQ(model.materials.size(), 1U);
            const GltfMaterial& material = model.materials[0];
            EXPECT_EQ(material.haptic_name, "felt");
            ASSERT_TRUE(material.stiffness && material.friction);
            EXPECT_TRUE(material.stiffness->stated);
            EXPECT_EQ(material.stiffness->black, 200.0);
            EXPECT_EQ(material.stiffness->white, 900.0);
            EXPECT_EQ(material.stiffness->texture.image->samples, picture(1, 8, 7).samples);
            EXPECT_FALSE(material.friction->stated);
            EXPECT_EQ(material.friction->white, 1.0);
          }
        }
      }
    }
  }
}

TEST(GltfMaterial, WhatIsNotFeltIsKeptWithANote) {
  Builder b = dressed_square();
  Json& haptic = b.root["extensions"]["MPEG_haptic_material"]["materials"][0];
  b.root["meshes"][0]["extensions"]["MPEG_haptic_material"]["hapticMaterialIndex"] = 0;
  const auto entry = [](int texture, const char* type) {
    return Json{{"texture", {{"index", texture}}}, {"type", type}, {"extras", {{"unit", "K"}}}};
  };
  for (const char* property : {"vibrotactileTexture", "temperature", "vibration", "custom"})
    haptic[property] = Json::array({entry(2, "Other")});
  haptic["stiffness"] = Json::array({entry(1, "Reference"), entry(2, "Low_Resolution"), entry(1, "High_Resolution")});
  haptic["haptic"] = 0;
  const GltfModel model = model_of(b);
  const GltfMaterial& material = model.materials.at(0);
  // A reference is no image of values; the first that is one is felt.
  ASSERT_TRUE(material.stiffness.has_value());
  EXPECT_EQ(material.stiffness->texture.image->bits, 8);
  ASSERT_EQ(material.kept.size(), 6U);
  EXPECT_EQ(material.kept[0].property, "stiffness");
  EXPECT_EQ(material.kept[0].type, "Reference");
  EXPECT_EQ(material.kept[3].property, "temperature");
  EXPECT_EQ(material.kept[3].extras, R"({"unit":"K"})");
  EXPECT_TRUE(has_note(model.mesh, "temperature[0].texture is kept, not felt"));
  EXPECT_TRUE(has_note(model.mesh, "signals of MPEG_haptic"));
}

TEST(GltfMaterial, AVibrotactileTextureIsReliefIfItSaysSo) {
  Builder b = dressed_square();
  Json& haptic = b.root["extensions"]["MPEG_haptic_material"]["materials"][0];
  b.root["meshes"][0]["extensions"]["MPEG_haptic_material"]["hapticMaterialIndex"] = 0;
  haptic["vibrotactileTexture"] = Json::array({{{"texture", {{"index", 1}}}, {"type", "High_Resolution"}}});
  EXPECT_FALSE(model_of(b).materials.at(0).height);
  haptic["vibrotactileTexture"][0]["extras"]["asperity"] = {{"amplitude", 3e-4}};
  const GltfModel model = model_of(b);
  ASSERT_TRUE(model.materials.at(0).height);
  EXPECT_EQ(model.materials[0].height->amplitude, 3e-4);
  EXPECT_TRUE(model.materials[0].kept.empty());
  // The material's own height goes before.
  b.root["materials"][0]["extras"] = height_extras;
  EXPECT_EQ(model_of(b).materials[0].height->amplitude, 0.002);
  EXPECT_EQ(model_of(b).materials[0].kept.size(), 1U);
}

TEST(GltfMaterial, TextureCoordinatesAreThoseOfTheMaps) {
  Builder b = dressed_square();
  const int second = b.uvs({0.5F, 0.5F, 0.75F, 0.5F, 0.75F, 0.25F, 0.5F, 0.25F});
  b.root["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = second;
  b.root["materials"][0]["normalTexture"] = {{"index", 0}, {"texCoord", 1}};
  EXPECT_EQ(model_of(b).mesh.corner_uvs[0][1], Vec2f(0.75F, 0.5F));
  EXPECT_EQ(model_of(b).mesh.corner_uvs[0][2], Vec2f(0.75F, 0.75F));
  // What lies otherwise than the heights is left out.
  b.root["materials"][0]["extras"] = height_extras;
  const GltfModel model = model_of(b);
  EXPECT_FALSE(model.materials[0].normals);
  EXPECT_TRUE(has_note(model.mesh, "materials[0].normalTexture left out"));
  EXPECT_EQ(model.mesh.corner_uvs[0][1], Vec2f(1.0F, 0.0F));
  // A set that the mesh does not have.
  b.root["materials"][0]["normalTexture"]["texCoord"] = 2;
  b.root["materials"][0].erase("extras");
  EXPECT_TRUE(has_note(model_of(b).mesh, "no TEXCOORD_2"));
}

TEST(GltfMaterial, TextureTransformsAreWorkedIn) {
  // The extension's own example: the lower left quadrant of the image, turned by 90 degrees.
  Builder b = dressed_square();
  b.root["extensionsRequired"] = {"KHR_texture_transform"};
  Json& moved = b.root["materials"][0]["normalTexture"]["extensions"]["KHR_texture_transform"];
  b.root["materials"][0]["normalTexture"]["index"] = 0;
  moved = {{"offset", {0, 1}}, {"rotation", std::numbers::pi / 2}, {"scale", {0.5, 0.5}}};
  const GltfModel model = model_of(b);
  // glTF's (u, v) goes to (v / 2, 1 - u / 2), v down; here v is up.
  const auto expect = [&](std::size_t triangle, std::size_t corner, float u, float v_up) {
    EXPECT_NEAR(model.mesh.corner_uvs[triangle][corner].x(), u, 1e-6F);
    EXPECT_NEAR(model.mesh.corner_uvs[triangle][corner].y(), v_up, 1e-6F);
  };
  expect(0, 0, 0.5F, 0.0F);  // (0, 1)
  expect(0, 1, 0.5F, 0.5F);  // (1, 1)
  expect(0, 2, 0.0F, 0.5F);  // (1, 0)
  expect(1, 2, 0.0F, 0.0F);  // (0, 0)
  moved = {{"texCoord", 1}};
  EXPECT_TRUE(has_note(model_of(b).mesh, "no TEXCOORD_1"));
}

TEST(GltfMaterial, EveryMaterialKeepsItsTriangles) {
  Builder b = dressed_square();
  const Json primitive = b.root["meshes"][0]["primitives"][0];
  b.root["materials"].push_back({{"name", "unused"}});
  b.root["materials"].push_back({{"name", "felt"}, {"extras", height_extras}});
  b.root["meshes"][0]["primitives"].push_back(primitive);
  b.root["meshes"][0]["primitives"][0]["material"] = 2;
  b.root["meshes"][0]["primitives"].push_back(primitive);
  b.root["meshes"][0]["primitives"][2].erase("material");
  const GltfModel model = model_of(b);
  ASSERT_EQ(model.materials.size(), 3U);
  EXPECT_EQ(model.material_of_triangle, (std::vector<std::uint32_t>{0, 0, 1, 1, 2, 2}));
  EXPECT_EQ(model.materials[0].name, "felt");
  EXPECT_EQ(model.materials[1].name, "wool");
  EXPECT_EQ(model.materials[2].name, "");
}

TEST(GltfMaterial, WrappingThatIsNotRenderedIsSaid) {
  Builder b = dressed_square();
  b.root["materials"][0]["extras"] = height_extras;
  for (const auto& [s, t] : {std::pair{33648, 33648}, {10497, 33071}}) {
    b.root["samplers"][0] = {{"wrapS", s}, {"wrapT", t}};
    const GltfModel model = model_of(b);
    EXPECT_EQ(model.materials[0].height->texture.wrap, Wrap::repeat);
    EXPECT_TRUE(has_note(model.mesh, "samplers[0]"));
  }
}

TEST(GltfMaterial, NormalScaleTiltsTheNormals) {
  GltfNormals normals;
  Image image = picture(3, 8, 0);
  image.samples = {128, 128, 255, 191, 128, 219, 128, 65, 219, 255, 255, 128};
  normals.texture.image = std::make_shared<const Image>(image);
  EXPECT_EQ(normal_image_of(normals)->samples, image.samples);
  normals.scale = 2.0;
  const auto scaled = normal_image_of(normals);
  ASSERT_TRUE(scaled.ok());
  for (std::size_t i = 0; i < 4; ++i) {
    const auto axis = [&](std::size_t c) { return (image.samples[3 * i + c] - 128.0) / 127.0; };
    const Vec3 expected = Vec3(2.0 * axis(0), 2.0 * axis(1), axis(2)).normalized();
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_NEAR((scaled->samples[3 * i + c] - 32768.0) / 32767.0, expected[static_cast<int>(c)], 2e-5);
  }
  normals.scale = std::nan("");
  EXPECT_EQ(normal_image_of(normals).error().place, "scale");
}

TEST(GltfMaterial, EveryWrongValueIsRefusedAtItsPlace) {
  struct Case {
    const char* pointer;
    Json value;
    ErrorCode code;
    const char* place;
  };
  const ErrorCode malformed = ErrorCode::file_malformed;
  const std::string haptic = "extensions.MPEG_haptic_material.materials";
  const std::vector<Case> cases = {
      {"/meshes/0/primitives/0/material", 1, malformed, "meshes[0].primitives[0].material"},
      {"/meshes/0/primitives/0/material", "wool", malformed, "meshes[0].primitives[0].material"},
      {"/materials/0/normalTexture/index", 3, malformed, "materials[0].normalTexture.index"},
      {"/materials/0/normalTexture", 3, malformed, "materials[0].normalTexture.index"},
      {"/materials/0/normalTexture/texCoord", 8, malformed, "materials[0].normalTexture.texCoord"},
      {"/materials/0/normalTexture/scale", "big", malformed, "materials[0].normalTexture.scale"},
      {"/materials/0/normalTexture/index", 1, ErrorCode::bad_map, "materials[0].normalTexture"},
      {"/materials/0/normalTexture/extensions/KHR_texture_transform/offset",
       {1},
       malformed,
       "materials[0].normalTexture.extensions.KHR_texture_transform.offset"},
      {"/textures/1/source", 9, malformed, "textures[1].source"},
      {"/textures/1", Json::object(), ErrorCode::file_unsupported, "textures[1].source"},
      {"/textures/1/sampler", 9, malformed, "textures[1].sampler"},
      {"/samplers/0/wrapS", 1, malformed, "samplers[0].wrapS"},
      {"/images/1", Json::object(), malformed, "images[1]"},
      {"/images/1/bufferView", 99, ErrorCode::bad_mesh, "bufferViews[99]"},
      {"/images/1", {{"uri", "height.png"}}, ErrorCode::file_unsupported, "images[1].uri"},
      {"/images/1", {{"uri", "data:image/png;base64,AAAA"}}, ErrorCode::file_unsupported, "images[1]"},
      {"/images/1", {{"uri", "data:image/png,AAAA"}}, malformed, "images[1].uri"},
      {"/images/1", {{"uri", "data:image/png;base64,"}}, ErrorCode::file_empty, "images[1]"},
      {"/materials/0/extras/asperity", 3, malformed, "materials[0].extras.asperity"},
      {"/materials/0/extras/asperity", Json::object(), malformed, "materials[0].extras.asperity.height_texture"},
      {"/materials/0/extras/asperity/height_texture", 1, malformed,
       "materials[0].extras.asperity.height_texture.index"},
      {"/materials/0/extras/asperity/amplitude", -1, malformed, "materials[0].extras.asperity.amplitude"},
      {"/materials/0/extras/asperity/amplitude", "1 mm", malformed, "materials[0].extras.asperity.amplitude"},
      {"/materials/0/extras/asperity/offset", nullptr, malformed, "materials[0].extras.asperity.offset"},
      {"/materials/0/extras/asperity/white_is", "low", ErrorCode::bad_value, "materials[0].extras.asperity.white_is"},
      {"/materials/0/extras/asperity/height", 1, ErrorCode::bad_key, "materials[0].extras.asperity.height"},
      {"/meshes/0/extensions/MPEG_haptic_material/hapticMaterialIndex", 1, malformed,
       "meshes[0].extensions.MPEG_haptic_material.hapticMaterialIndex"},
      {"/meshes/0/extensions/MPEG_haptic_material", Json::object(), malformed,
       "meshes[0].extensions.MPEG_haptic_material.hapticMaterialIndex"},
      {"/extensions/MPEG_haptic_material", Json::object(), malformed, haptic.c_str()},
      {"/extensions/MPEG_haptic_material/materials", Json::array(), malformed, haptic.c_str()},
      {"/extensions/MPEG_haptic_material/materials/0/stiffness", 4, malformed,
       "extensions.MPEG_haptic_material.materials[0].stiffness"},
      {"/extensions/MPEG_haptic_material/materials/0/stiffness/0", Json::object(), malformed,
       "extensions.MPEG_haptic_material.materials[0].stiffness[0].texture"},
      {"/extensions/MPEG_haptic_material/materials/0/stiffness/0/type", "Medium", ErrorCode::bad_value,
       "extensions.MPEG_haptic_material.materials[0].stiffness[0].type"},
      {"/extensions/MPEG_haptic_material/materials/0/stiffness/0/extras/asperity/black", -1, malformed,
       "extensions.MPEG_haptic_material.materials[0].stiffness[0].extras.asperity.black"},
  };
  Builder good = dressed_square();
  good.root["materials"][0]["normalTexture"] = {{"index", 0}};
  good.root["materials"][0]["extras"] = height_extras;
  good.root["extensions"]["MPEG_haptic_material"]["materials"][0]["stiffness"] =
      Json::array({{{"texture", {{"index", 2}}}, {"type", "High_Resolution"}}});
  good.root["meshes"][0]["extensions"]["MPEG_haptic_material"]["hapticMaterialIndex"] = 0;
  ASSERT_TRUE(model_of(good).materials.at(0).stiffness);
  for (const Case& c : cases) {
    Builder b = good;
    b.root[Json::json_pointer(c.pointer)] = c.value;
    SCOPED_TRACE(std::string(c.pointer) + " = " + c.value.dump());
    const Error error = refusal_of(b);
    EXPECT_EQ(error.code, c.code) << error.message();
    EXPECT_EQ(error.place, c.place) << error.message();
  }
  // Who asks for the mesh alone is not bothered.
  good.root["materials"] = 3;
  EXPECT_EQ(read(good.text()).triangles.size(), 2U);
}

TEST(GltfMaterial, NoTruncationAndNoFlippedByteDoesHarm) {
  Builder b = dressed_square();
  b.root["materials"][0]["normalTexture"] = {{"index", 0}};
  b.root["materials"][0]["extras"] = height_extras;
  const std::string good = b.binary();
  for (std::size_t size = 0; size < good.size(); size += 3) {
    ASSERT_FALSE(read_gltf_model_bytes(good.substr(0, size), "a.glb").ok()) << size;
  }
  std::size_t read_anyway = 0;
  for (std::size_t at = 0; at < good.size(); ++at) {
    std::string bytes = good;
    bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ 0x05U);
    const auto model = read_gltf_model_bytes(bytes, "a.glb");
    if (!model.ok()) {
      EXPECT_FALSE(model.error().what.empty());
      continue;
    }
    ++read_anyway;
    ASSERT_EQ(model->material_of_triangle.size(), model->mesh.triangles.size());
    for (const std::uint32_t material : model->material_of_triangle) ASSERT_LT(material, model->materials.size());
  }
  EXPECT_GT(read_anyway, 0U);
}

}  // namespace
}  // namespace asperity::gltf_material_test
