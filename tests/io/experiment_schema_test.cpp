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

namespace asperity::experiment_schema_test {
namespace {

using nlohmann::json;

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
  for (const SceneObjectKeys& entry : scene_object_keys()) {
    if (entry.object != "scene") objects.insert(definition_name(entry.object));
    const json properties = properties_of(document, entry.object);
    ASSERT_TRUE(properties.is_object()) << entry.object;
    std::set<std::string> described;
    for (const auto& item : properties.items()) described.insert(item.key());
    EXPECT_EQ(described, std::set<std::string>(entry.keys.begin(), entry.keys.end())) << entry.object;
  }
  for (const auto& item : document["definitions"].items()) EXPECT_TRUE(objects.count(item.key())) << item.key();
}

TEST_F(ExperimentSchema, EveryKeyIsDescribed) {
  const json document = schema();
  for (const SceneObjectKeys& entry : scene_object_keys()) {
    const json properties = properties_of(document, entry.object);
    for (const auto& item : properties.items()) {
      EXPECT_TRUE(item.value().contains("description") && item.value()["description"].get<std::string>().size() > 8)
          << entry.object << "." << item.key();
    }
  }
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

/// A scene in which an object of one kind stands at `pointer`.
struct Host {
  std::string_view object;
  const char* pointer;
  const char* scene;
};

// Every kind of object, in as many variants as it takes for each of its keys to be read in one of them.
const Host hosts[] = {
    {"coat", "/surfaces/0/coat", R"({"surfaces":[{"mesh":"tiles.glb","coat":{"from":"gltf"}}]})"},
    {"detail", "/surfaces/0/coat/detail",
     R"({"surfaces":[{"mesh":{"generator":"plane","width":0.08,"depth":0.08,"columns":2,"rows":2},"coat":{"height_map":"map.png","mapping":"triplanar","detail":{"kind":"low_pass"}}}]})"},
    {"layer", "/surfaces/0/coat/layers/0",
     R"({"surfaces":[{"mesh":{"generator":"plane","width":0.08,"depth":0.08,"columns":2,"rows":2},"coat":{"height_map":"map.png","mapping":"triplanar","layers":[{"height_map":"map.png"}]}}]})"},
    {"layer", "/surfaces/0/coat/layers/0",
     R"({"surfaces":[{"mesh":"sheet.obj","coat":{"height_map":"map.png","layers":[{"height_map":"map.png"}]}}]})"},
    {"layer", "/surfaces/0/coat/layers/0",
     R"({"surfaces":[{"mesh":{"generator":"plane","width":0.08,"depth":0.08,"columns":2,"rows":2},"coat":{"height_map":"map.png","mapping":"triplanar","layers":[{"solid":"waves"}]}}]})"},
    {"layer", "/surfaces/0/coat/layers/0",
     R"({"surfaces":[{"mesh":{"generator":"plane","width":0.08,"depth":0.08,"columns":2,"rows":2},"coat":{"height_map":"map.png","mapping":"triplanar","layers":[{"solid":"rings"}]}}]})"},
    {"layer", "/surfaces/0/coat/layers/0",
     R"({"surfaces":[{"mesh":{"generator":"plane","width":0.08,"depth":0.08,"columns":2,"rows":2},"coat":{"height_map":"map.png","mapping":"triplanar","layers":[{"solid":"noise"}]}}]})"},
    {"material maps", "/surfaces/0/coat/maps",
     R"({"surfaces":[{"mesh":{"generator":"plane","width":0.08,"depth":0.08,"columns":2,"rows":2},"coat":{"height_map":"map.png","mapping":"triplanar","maps":{}}}]})"},
    {"material map", "/surfaces/0/coat/maps/viscosity",
     R"({"surfaces":[{"mesh":{"generator":"plane","width":0.08,"depth":0.08,"columns":2,"rows":2},"coat":{"height_map":"map.png","mapping":"triplanar","maps":{"viscosity":{"image":"map.png","low":0,"high":1}}}}]})"},
    {"lay map", "/surfaces/0/coat/maps/lay",
     R"({"surfaces":[{"mesh":{"generator":"plane","width":0.08,"depth":0.08,"columns":2,"rows":2},"coat":{"height_map":"map.png","mapping":"triplanar","maps":{"lay":{"image":"normal.png"}}}}]})"},
    {"closing", "/surfaces/0/coat/closing",
     R"({"surfaces":[{"mesh":{"generator":"plane","width":0.08,"depth":0.08,"columns":2,"rows":2},"coat":{"height_map":"map.png","mapping":"triplanar","closing":{"texels":4}}}]})"},
    {"library relief", "/surfaces/0/coat/height_map",
     R"({"surfaces":[{"mesh":"sheet.obj","coat":{"height_map":{"library":"linen","size":16}}}]})"},
    {"stitching", "/surfaces/0/coat/stitching",
     R"({"surfaces":[{"mesh":"sheet.obj","coat":{"height_map":"map.png","stitching":{"folds":"fillet"}}}]})"},
    {"motion", "/surfaces/0/motion", R"({"surfaces":[{"mesh":{"generator":"box"},"motion":{}}]})"},
    {"view", "/view", R"({"surfaces":[{"mesh":{"generator":"box"}}],"view":{}})"},
    {"camera", "/view/camera", R"({"surfaces":[{"mesh":{"generator":"box"}}],"view":{"camera":{}}})"},
    {"change", "/change", R"({"surfaces":[{"mesh":{"generator":"box"}}],"change":{}})"},
    {"law", "/surfaces/0/law",
     R"({"surfaces":[{"mesh":"sheet.obj","coat":{"height_map":"map.png"},"law":{"type":"mesostructure-literal"}}]})"},
    {"scene", "", R"({"surfaces":[{"mesh":{"generator":"box"}}]})"},
    {"probe", "/probe", R"({"surfaces":[{"mesh":{"generator":"box"}}],"probe":{}})"},
    {"ideal probe", "/probe/ideal", R"({"surfaces":[{"mesh":{"generator":"box"}}],"probe":{"ideal":{}}})"},
    {"dynamic probe", "/probe/dynamic", R"({"surfaces":[{"mesh":{"generator":"box"}}],"probe":{"dynamic":{}}})"},
    {"device", "/device", R"({"surfaces":[{"mesh":{"generator":"box"}}],"device":{}})"},
    {"hand", "/hand", R"({"surfaces":[{"mesh":{"generator":"box"}}],"hand":{}})"},
    {"surface", "/surfaces/0", R"({"surfaces":[{"mesh":"sphere.ply"}]})"},
    {"mesh generator", "/surfaces/0/mesh", R"({"surfaces":[{"mesh":{"generator":"icosphere"}}]})"},
    {"mesh generator", "/surfaces/0/mesh", R"({"surfaces":[{"mesh":{"generator":"M_b"}}]})"},
    {"mesh generator", "/surfaces/0/mesh", R"({"surfaces":[{"mesh":{"generator":"M_c"}}]})"},
    {"mesh generator", "/surfaces/0/mesh", R"({"surfaces":[{"mesh":{"generator":"M_e"}}]})"},
    {"mesh generator", "/surfaces/0/mesh", R"({"surfaces":[{"mesh":{"generator":"M_f"}}]})"},
    {"mesh generator", "/surfaces/0/mesh",
     R"({"surfaces":[{"mesh":{"generator":"M_G","mesostructure":{"height_map":{"generator":"H_3"}}}}]})"},
    {"mesh generator", "/surfaces/0/mesh", R"({"surfaces":[{"mesh":{"generator":"plane"}}]})"},
    {"mesh generator", "/surfaces/0/mesh", R"({"surfaces":[{"mesh":{"generator":"box"}}]})"},
    {"mesh generator", "/surfaces/0/mesh", R"({"surfaces":[{"mesh":{"generator":"random"}}]})"},
    {"pose", "/surfaces/0/pose", R"({"surfaces":[{"mesh":{"generator":"box"},"pose":{}}]})"},
    {"coat", "/surfaces/0/coat",
     R"({"surfaces":[{"mesh":"sphere.ply","coat":{"height_map":"map.png","normal_map":"normal.png"}}]})"},
    {"coat", "/surfaces/0/coat", R"({"surfaces":[{"mesh":"sheet.obj","coat":{"height_map":"map.png"}}]})"},
    {"height generator", "/surfaces/0/coat/height_map",
     R"({"surfaces":[{"mesh":"sheet.obj","coat":{"height_map":{"generator":"H_1"}}}]})"},
    {"height generator", "/surfaces/0/coat/height_map",
     R"({"surfaces":[{"mesh":"sheet.obj","coat":{"height_map":{"generator":"H_2"}}}]})"},
    {"height generator", "/surfaces/0/coat/height_map",
     R"({"surfaces":[{"mesh":"sheet.obj","coat":{"height_map":{"generator":"H_5"}}}]})"},
    {"height generator", "/surfaces/0/coat/height_map",
     R"({"surfaces":[{"mesh":"sheet.obj","coat":{"height_map":{"generator":"H_7"}}}]})"},
    {"law", "/surfaces/0/law",
     R"({"surfaces":[{"mesh":"sheet.obj","coat":{"height_map":{"generator":"H_2"}},"law":{}}]})"},
    {"law", "/surfaces/0/law",
     R"({"surfaces":[{"mesh":"sheet.obj","coat":{"height_map":{"generator":"H_2"}},"law":{"type":"height-field"}}]})"},
    {"law", "/surfaces/0/law",
     R"({"surfaces":[{"mesh":"sheet.obj","coat":{"height_map":{"generator":"H_2"}},"law":{"type":"generated-geometry"}}]})"},
    {"surface", "/surfaces/0",
     R"({"surfaces":[{"volume":{"generator":"sphere","size":[8,8,8]},"iso":{"threshold":0}}]})"},
    {"volume", "/effects/0/volume",
     R"({"effects":[{"volume":{"file":"cube.json"},"type":"viscosity","transfer":[[0,1]]}]})"},
    {"volume", "/effects/0/volume",
     R"({"effects":[{"volume":{"file":"cube.aspvol"},"type":"viscosity","transfer":[[0,1]]}]})"},
    {"volume", "/effects/0/volume",
     R"({"effects":[{"volume":{"generator":"shells","size":[16,16,16]},"type":"viscosity","transfer":[[0,1]]}]})"},
    {"volume", "/effects/0/volume",
     R"({"effects":[{"volume":{"generator":"waves","size":[16,8,8]},"type":"viscosity","transfer":[[0,1]]}]})"},
    {"volume", "/effects/0/volume",
     R"({"effects":[{"volume":{"generator":"ramp","size":[8,8,8]},"type":"viscosity","transfer":[[0,1]]}]})"},
    {"volume", "/effects/0/volume",
     R"({"effects":[{"volume":{"generator":"sphere","size":[8,8,8]},"type":"viscosity","transfer":[[0,1]]}]})"},
    {"volume", "/effects/0/volume",
     R"({"effects":[{"volume":{"generator":"cavity","size":[8,8,8],"derive":"vorticity_magnitude"},"type":"viscosity","transfer":[[0,1]]}]})"},
    {"iso", "/surfaces/0/iso", R"({"surfaces":[{"volume":{"generator":"sphere","size":[8,8,8]},"iso":{}}]})"},
    {"effect", "/effects/0", R"({"effects":[{"volume":"cube.json","type":"iwata","transfer":[[0,1]]}]})"},
    {"effect", "/effects/0", R"({"effects":[{"volume":"cube.json","type":"pao","transfer":[[0,1]]}]})"},
    {"effect", "/effects/0", R"({"effects":[{"volume":"cube.json","type":"gravity-scalars","transfer":[[0,1]]}]})"},
    {"law", "/surfaces/0/law",
     R"({"surfaces":[{"volume":{"generator":"sphere","size":[8,8,8]},"iso":{"threshold":0},"law":{"type":"avila"}}]})"},
    {"law", "/surfaces/0/law",
     R"({"surfaces":[{"volume":{"generator":"sphere","size":[8,8,8]},"iso":{"threshold":0},"law":{"type":"cross-uncross-literal"}}]})"},
    {"surface", "/surfaces/0", R"({"surfaces":[{"mesh":{"generator":"box"},"implicit":{"resolution":16}}]})"},
    {"implicit", "/surfaces/0/implicit", R"({"surfaces":[{"mesh":{"generator":"box"},"implicit":{"resolution":16}}]})"},
    {"implicit", "/surfaces/0/implicit",
     R"({"surfaces":[{"mesh":{"generator":"box"},"implicit":{"resolution":16,"texture":{"amplitude":"0.1mm","wavelength":"30mm"}}}]})"},
    {"implicit", "/surfaces/0/implicit", R"({"surfaces":[{"implicit":{"file":"ball.vdb"}}]})"},
    {"implicit", "/surfaces/0/implicit", R"({"surfaces":[{"mesh":{"generator":"box"},"implicit":{"voxel":"3 mm"}}]})"},
    {"implicit", "/surfaces/0/implicit", R"({"surfaces":[{"mesh":{"generator":"box"},"implicit":{"budget":"2 MB"}}]})"},
    {"implicit texture", "/surfaces/0/implicit/texture",
     R"({"surfaces":[{"mesh":{"generator":"box"},"implicit":{"resolution":16,"texture":{"amplitude":"0.1mm","wavelength":"30mm"}}}]})"},
    {"material brush", "/surfaces/0/implicit/materials/0",
     R"({"surfaces":[{"mesh":{"generator":"box"},"implicit":{"resolution":16,"materials":[{"centre":[0,0.04,0],"radius":0.02,"stiffness":100}]}}]})"},
    {"law", "/surfaces/0/law",
     R"({"surfaces":[{"mesh":{"generator":"box"},"implicit":{"resolution":16},"law":{"type":"virtual-contact-point-literal"}}]})"},
    {"law", "/surfaces/0/law",
     R"({"surfaces":[{"mesh":{"generator":"box"},"implicit":{"resolution":16},"law":{"type":"magnetic"}}]})"},
    {"blend map", "/surfaces/0/law/blend",
     R"({"surfaces":[{"mesh":"sheet.obj","coat":{"height_map":{"generator":"H_2"}},"law":{"type":"mesostructure-literal","blend":{"image":"map.png"}}}]})"},
    {"material", "/surfaces/0/material", R"({"surfaces":[{"mesh":{"generator":"box"},"material":{}}]})"},
    {"surface", "/surfaces/0", R"({"surfaces":[{"parametric":{"shape":"plane"}}]})"},
    {"parametric", "/surfaces/0/parametric", R"({"surfaces":[{"parametric":{"shape":"plane"}}]})"},
    {"parametric", "/surfaces/0/parametric", R"({"surfaces":[{"parametric":{"shape":"vase"}}]})"},
    {"parametric", "/surfaces/0/parametric", R"({"surfaces":[{"parametric":{"shape":"torus"}}]})"},
    {"parametric", "/surfaces/0/parametric", R"({"surfaces":[{"parametric":{"shape":"ramp"}}]})"},
    {"texture", "/surfaces/0/texture",
     R"({"surfaces":[{"mesh":{"generator":"box"},"texture":{"features":{"type":"grating","amplitude":1e-4,"wavelength":1e-3}}}]})"},
    {"feature", "/surfaces/0/texture/features",
     R"({"surfaces":[{"mesh":{"generator":"box"},"texture":{"features":{"type":"serrated","amplitude":1e-4,"wavelength":1e-3}}}]})"},
    {"feature", "/surfaces/0/texture/features",
     R"({"surfaces":[{"mesh":{"generator":"box"},"texture":{"features":{"type":"circular-grating","amplitude":1e-4,"wavelength":1e-3}}}]})"},
    {"feature", "/surfaces/0/texture/features",
     R"({"surfaces":[{"parametric":{"shape":"cylinder"},"texture":{"features":{"type":"grating","amplitude":1e-4,"count":100}}}]})"},
    {"feature", "/surfaces/0/texture/features",
     R"({"surfaces":[{"mesh":{"generator":"box"},"texture":{"features":{"type":"noise","roughness":1e-5,"correlation_length":1e-3}}}]})"},
    {"feature", "/surfaces/0/texture/features",
     R"({"surfaces":[{"mesh":{"generator":"box"},"texture":{"features":{"type":"noise","average_roughness":1e-5,"correlation_length":1e-3}}}]})"},
    {"feature", "/surfaces/0/texture/features/0",
     R"({"surfaces":[{"mesh":{"generator":"box"},"texture":{"features":[{"type":"map","height_map":"map.png","height":1e-4,"wavelength":0.01}],"as":"texture"}}]})"},
    {"feature", "/surfaces/0/texture/features",
     R"({"surfaces":[{"mesh":{"generator":"box"},"texture":{"features":{"type":"map","height_map":"map.png","height_range":[0,1e-4],"wavelength":0.01,"as":"texture"}}}]})"},
    {"feature mapping", "/surfaces/0/texture/mapping",
     R"({"surfaces":[{"mesh":{"generator":"box"},"texture":{"features":{"type":"grating","amplitude":1e-4,"wavelength":1e-3},"mapping":{"surface":"box"}}}]})"},
    {"feature mapping", "/surfaces/0/texture/mapping",
     R"({"surfaces":[{"mesh":{"generator":"box"},"texture":{"features":{"type":"grating","amplitude":1e-4,"count":60},"mapping":{"surface":"cylinder"}}}]})"},
    {"feature mapping", "/surfaces/0/texture/mapping",
     R"({"surfaces":[{"parametric":{"shape":"plane"},"texture":{"features":{"type":"grating","amplitude":1e-4,"wavelength":1e-3},"mapping":{"surface":"uv"}}}]})"},
    {"friction", "/surfaces/0/material/friction",
     R"({"surfaces":[{"mesh":{"generator":"box"},"material":{"friction":{"law":"karnopp"}}}]})"},
    {"friction", "/surfaces/0/material/friction",
     R"({"surfaces":[{"mesh":{"generator":"box"},"material":{"friction":{"law":"dahl"}}}]})"},
    {"friction", "/surfaces/0/material/friction",
     R"({"surfaces":[{"mesh":{"generator":"box"},"material":{"friction":{"law":"hayward-armstrong"}}}]})"},
    {"friction", "/surfaces/0/material/friction",
     R"({"surfaces":[{"mesh":{"generator":"box"},"material":{"friction":{"law":"lugre"}}}]})"},
    {"lay", "/surfaces/0/material/lay", R"({"surfaces":[{"mesh":{"generator":"box"},"material":{"lay":{}}}]})"},
    {"friction map", "/surfaces/0/material/friction_map",
     R"({"surfaces":[{"mesh":{"generator":"box"},"material":{"friction_map":{"image":"map.png","tile":0.01}}}]})"},
    {"stroke", "/stroke", R"({"surfaces":[{"mesh":{"generator":"box"}}],"stroke":{}})"},
    {"stroke", "/stroke", R"({"surfaces":[{"mesh":{"generator":"box"}}],"stroke":{"normal_force":1}})"},
    {"law", "/surfaces/0/law",
     R"({"surfaces":[{"mesh":"sphere.ply","coat":{"height_map":"map.png"},"law":{"type":"mesostructure-literal"}}]})"},
    {"stitching", "/surfaces/0/coat/stitching",
     R"({"surfaces":[{"mesh":"sphere.ply","coat":{"height_map":"map.png","stitching":{"folds":"round"}}}]})"},
    {"surface", "/surfaces/0", R"({"surfaces":[{"mesh":"sphere.ply","coat":{"height_map":"map.png"}}]})"},
    {"stroke", "/stroke", R"({"surfaces":[{"mesh":{"generator":"box"}}],"stroke":{"type":"raster"}})"},
    {"stroke", "/stroke", R"({"surfaces":[{"mesh":{"generator":"box"}}],"stroke":{"type":"spiral"}})"},
    {"stroke", "/stroke",
     R"({"surfaces":[{"mesh":{"generator":"box"}}],"stroke":{"type":"polyline","points":[["0%","100%","0%"],["100%","100%","0%"]]}})"},
    {"stroke", "/stroke",
     R"({"surfaces":[{"mesh":{"generator":"box"}}],"stroke":{"type":"recorded","path":"path.csv"}})"},
};

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
  for (const SceneObjectKeys& entry : scene_object_keys()) {
    for (const std::string& key : entry.keys) {
      bool read = false;
      for (const Host& host : hosts) {
        if (host.object != entry.object || read) continue;
        json scene = json::parse(host.scene);
        ASSERT_TRUE(parse(scene.dump()).ok()) << host.scene << parse(scene.dump()).error().message();
        // No key takes an array of an array of nothing.
        scene[json::json_pointer(host.pointer)][key] = json::array({json::array()});
        const Result<Experiment> result = parse(scene.dump());
        ASSERT_FALSE(result.ok()) << entry.object << "." << key << " is accepted and ignored";
        const Error& error = result.error();
        read = error.code != ErrorCode::bad_key && error.place.find(key) != std::string::npos;
      }
      EXPECT_TRUE(read) << entry.object << "." << key << " is read in no scene";
    }
  }
}

}  // namespace
}  // namespace asperity::experiment_schema_test
