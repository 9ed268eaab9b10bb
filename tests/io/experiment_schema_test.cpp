// The published schema against the built-in scenes and against what the reader reads.

#if defined(__GNUC__) && !defined(__clang__)
// GCC 12 reports a false positive inside valijson at -O3 (GCC bug 105329).
#pragma GCC diagnostic ignored "-Wrestrict"
#endif

#include <nlohmann/json.hpp>
#include <set>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>

#include "asperity/field/brick/file.h"
#include "asperity/field/conversion/mesh_conversion.h"
#include "asperity/io/detail/scene_json.h"
#include "asperity/io/gltf_material.h"
#include "asperity/io/sparse_io.h"
#include "asperity/io/volume_io.h"
#include "asperity/render/law_registry.h"
#include "tests/field/sparse_grids.h"
#include "tests/io/experiment_fixture.h"
#include "tests/io/scene_hosts.h"

namespace asperity::experiment_schema_test {
namespace {

using nlohmann::json;
using scene_hosts::Host;
using scene_hosts::hosts;

class ExperimentSchema : public ExperimentTest {
 protected:
  static json schema() { return json::parse(scene_schema_json()); }

  /// What the schema has against `scene`; empty when it is valid.
  static std::string violations(const std::string& scene) {
    const json document = schema();
    valijson::Schema compiled;
    valijson::SchemaParser parser;
    parser.populateSchema(valijson::adapters::NlohmannJsonAdapter(document), compiled);
    const json instance = json::parse(scene);
    valijson::Validator validator;
    valijson::ValidationResults results;
    if (validator.validate(compiled, valijson::adapters::NlohmannJsonAdapter(instance), &results)) return {};
    std::string text;
    valijson::ValidationResults::Error error;
    while (results.popError(error)) {
      for (const std::string& step : error.context) text += step;
      text += ": " + error.description + "\n";
    }
    return text.empty() ? "invalid" : text;
  }

  static std::string definition_name(std::string_view object) {
    std::string name(object);
    for (char& c : name) c = c == ' ' ? '_' : c;
    return name;
  }
  /// The kinds of object that a scene holds, without those of other files.
  static std::vector<SceneObject> scene_objects() {
    std::vector<SceneObject> all;
    for (const SceneObject& object : scene_table())
      if (object.name.find("sidecar") == std::string::npos) all.push_back(object);
    return all;
  }
  /// A key of a coat that the geometry of M_G has no use for: it is known so that its refusal says why.
  static bool never_read(const SceneObject& object, const std::string& key) {
    const Option& row = *object.row(key, SceneJson::object());
    return row.only.size() == 1 && row.only.front().kind == OptionTest::Kind::any && row.only.front().of.empty();
  }
  static json properties_of(const json& document, std::string_view object) {
    return object == "scene" ? document["properties"] : document["definitions"][definition_name(object)]["properties"];
  }
};

TEST_F(ExperimentSchema, BuiltinScenesAreValid) {
  for (const BuiltinScene& scene : builtin_scenes())
    EXPECT_EQ(violations(*builtin_scene_json(scene.name)), "") << scene.name;
}

TEST_F(ExperimentSchema, CanonicalCopiesAreValid) {
  EXPECT_EQ(
      violations(
          good(
              R"({"surfaces":[{"mesh":"sphere.ply","coat":{"height_map":"map.png","height_range":[0,"1mm"]}}],"device":{"rate":500}})")
              .canonical_json),
      "");
  for (const BuiltinScene& scene : builtin_scenes()) {
    if (scene.name.starts_with("implicit") && !has_mesh_voxelizer()) continue;
    EXPECT_EQ(violations(good(*builtin_scene_json(scene.name)).canonical_json), "") << scene.name;
  }
}

TEST_F(ExperimentSchema, ItRefusesWhatTheReaderRefuses) {
  for (
      const char* scene : {
          R"({})",
          R"({"surfaces":[]})",
          R"({"effects":[]})",
          R"({"surfaces":[{}]})",
          R"({"surfaces":[{"volume":{"generator":"sphre"}}]})",
          R"({"surfaces":[{"volume":{"generator":"sphere","size":[1,8,8]}}]})",
          R"({"effects":[{"volume":{"generator":"sphere"},"type":"viscosity"}]})",
          R"({"effects":[{"volume":{"generator":"sphere"},"type":"viscosity","transfer":[[0]]}]})",
          R"({"surfaces":[{"mesh":3}]})",
          R"({"surfaces":[{"parametric":{"shape":"cone"}}]})",
          R"({"surfaces":[{"parametric":{"radius":0.01}}]})",
          R"({"surfaces":[{"mesh":{"generator":"box"},"texture":{"features":[]}}]})",
          R"({"surfaces":[{"mesh":{"generator":"box"},"texture":{"features":{"type":"bump"}}}]})",
          R"({"surfaces":[{"mesh":{"generator":"box"},"texture":{"features":{"type":"grating","amplitude":0,"wavelength":1e-3}}}]})",
          R"({"surfaces":[{"mesh":{"generator":"box"},"texture":{"mapping":{"surface":"cone"}}}]})",
          R"({"surfaces":[{"mesh":{"generator":"box"},"material":{"friction":"stribeck"}}]})",
          R"({"surfaces":[{"mesh":{"generator":"box"},"material":{"friction":{"law":"dahl","exponent":5}}}]})",
          R"({"surfaces":[{"mesh":{"generator":"box"},"material":{"lay":{"still_ratio":2}}}]})",
          R"({"surfaces":[{"mesh":{"generator":"box"},"material":{"friction_map":{"image":"map.png"}}}]})",
          R"({"surfaces":[{"mesh":{"generator":"box"},"implicit":{"resolution":2}}]})",
          R"({"surfaces":[{"mesh":{"generator":"box"},"implicit":{"voxel":0}}]})",
          R"({"surfaces":[{"mesh":{"generator":"box"},"implicit":{"inside":"outside"}}]})",
          R"({"surfaces":[{"mesh":{"generator":"box"},"implicit":{"texture":{"type":"perlin"}}}]})",
          R"({"surfaces":[{"mesh":{"generator":"box"},"implicit":{"materials":[]}}]})",
          R"({"surfaces":[{"mesh":{"generator":"box"},"implicit":{"materials":[{"radius":0.01}]}}]})",
          R"({"surfaces":[{"mesh":"a.obj","colour":"red"}]})",
          R"({"surfaces":[{"mesh":{"generator":"icosphare"}}]})",
          R"({"surfaces":[{"mesh":"a.obj","material":{"stiffness":0}}]})",
          R"({"surfaces":[{"mesh":"a.obj","law":{"type":"mesostructure-literal","rho":0.5}}]})",
          R"({"surfaces":[{"mesh":"a.obj"}],"device":"omega.8"})",
          R"({"surfaces":[{"mesh":"a.obj"}],"stroke":{"type":"polyline","points":[[0,0,0]]}})",
      }) {
    EXPECT_NE(violations(scene), "") << scene;
    EXPECT_FALSE(parse(scene).ok()) << scene;
  }
}

TEST_F(ExperimentSchema, ReaderAndSchemaKnowTheSameKeys) {
  const json document = schema();
  std::set<std::string> objects;
  for (const SceneObject& entry : scene_objects()) {
    if (entry.name != "scene") objects.insert(definition_name(entry.name));
    const json properties = properties_of(document, entry.name);
    ASSERT_TRUE(properties.is_object()) << entry.name;
    std::set<std::string> described;
    for (const auto& item : properties.items()) described.insert(item.key());
    const std::vector<std::string> keys = entry.keys();
    EXPECT_EQ(described, std::set<std::string>(keys.begin(), keys.end())) << entry.name;
  }
  for (const auto& item : document["definitions"].items()) EXPECT_TRUE(objects.count(item.key())) << item.key();
}

TEST_F(ExperimentSchema, EveryKeyIsDescribed) {
  const json document = schema();
  for (const SceneObject& entry : scene_table()) {
    EXPECT_GT(entry.help.size(), 8U) << entry.name;
    for (const Option& row : entry.rows) EXPECT_GT(row.help.size(), 1U) << entry.name << "." << row.key;
  }
  for (const SceneObject& entry : scene_objects()) {
    const json properties = properties_of(document, entry.name);
    for (const auto& item : properties.items()) {
      EXPECT_TRUE(item.value().contains("description") && item.value()["description"].get<std::string>().size() > 8)
          << entry.name << "." << item.key();
    }
  }
}

TEST_F(ExperimentSchema, TheReferencePageIsThatOfTheTable) {
  std::ifstream file(ASPERITY_SOURCE_DIR "/docs/scene.md", std::ios::binary);
  const std::string page{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  EXPECT_TRUE(page == scene_page()) << "docs/scene.md is old: asperity schema --page > docs/scene.md";
}

TEST_F(ExperimentSchema, NamesAreThoseOfTheProgram) {
  const json document = schema();
  EXPECT_EQ(document["definitions"]["device"]["properties"]["profile"]["enum"], json(device_profile_names()));
  EXPECT_EQ(document["definitions"]["hand"]["properties"]["preset"]["enum"], json(hand_preset_names()));
  EXPECT_EQ(document["definitions"]["law"]["properties"]["type"]["enum"], json(law_names()));
  EXPECT_EQ(document["definitions"]["friction"]["properties"]["law"]["enum"], json(friction_names()));
  EXPECT_EQ(document["definitions"]["feature"]["properties"]["type"]["enum"], json(feature_names()));
  EXPECT_EQ(document["definitions"]["parametric"]["properties"]["shape"]["enum"], json(parametric_names()));
}

TEST_F(ExperimentSchema, EveryKeyIsReallyRead) {
  if (!has_mesh_voxelizer()) GTEST_SKIP() << "without OpenVDB nothing implicit is read";
  ASSERT_TRUE(write_sparse(folder_ / "ball.vdb", *test::sparse_ball(0.003, 0.012)).ok());
  GltfMaterial tiles;
  tiles.name = "tiles";
  tiles.height = GltfHeight{};
  tiles.height->texture.image = std::make_shared<const Image>(ramp(4, 4));
  tiles.height->amplitude = 1e-3;
  ASSERT_TRUE(write_gltf(folder_ / "tiles.glb", plane_grid(0.08, 0.08, 1, 1), {}, std::span(&tiles, 1)).ok());
  write("path.csv", "time,x,y,z\n0,0,0.05,0\n1,0.01,0.05,0\n");
  write("cube.json", R"({"asperity_volume":1,"file":"cube.raw","size":[2,2,2],"type":"uint8","byte_order":"little"})");
  write("cube.raw", std::string("\0\0\0\0\3\3\3\3", 8));
  const Result<VolumeSource> cube = read_volume(folder_ / "cube.json");
  ASSERT_TRUE(cube.ok());
  ASSERT_TRUE(write_brick_file(folder_ / "cube.aspvol", *std::get_if<ScalarGrid>(&cube->data)).ok());
  for (const SceneObject& entry : scene_objects()) {
    for (const std::string& key : entry.keys()) {
      if (never_read(entry, key)) continue;
      bool read = false;
      for (const Host& host : hosts) {
        if (host.object != entry.name || read) continue;
        json scene = json::parse(host.scene);
        ASSERT_TRUE(parse(scene.dump()).ok()) << host.scene << parse(scene.dump()).error().message();
        // No key takes an array of an array of nothing.
        scene[json::json_pointer(host.pointer)][key] = json::array({json::array()});
        const Result<Experiment> result = parse(scene.dump());
        ASSERT_FALSE(result.ok()) << entry.name << "." << key << " is accepted and ignored";
        const Error& error = result.error();
        read = error.code != ErrorCode::bad_key && error.place.find(key) != std::string::npos;
      }
      EXPECT_TRUE(read) << entry.name << "." << key << " is read in no scene";
    }
  }
}

}  // namespace
}  // namespace asperity::experiment_schema_test
