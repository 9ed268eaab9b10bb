// Names in the schema of scenes are those of the program's tables.

#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "asperity/field/conversion/mesh_conversion.h"
#include "asperity/field/volume/derived_fields.h"
#include "asperity/field/volume/generators.h"
#include "asperity/geometry/generators.h"
#include "asperity/io/experiment.h"
#include "asperity/io/volume_io.h"
#include "asperity/surface/implicit/texture.h"

namespace asperity::names_schema_test {
namespace {

using Json = nlohmann::ordered_json;

/// Every "enum" of a property in the schema, by "object.key"; conditions list some of the names again.
void collect(const Json& part, const std::string& key, std::map<std::string, std::set<Json>>& found) {
  if (part.is_array()) {
    for (const Json& one : part) collect(one, key, found);
  }
  if (!part.is_object()) return;
  if (part.contains("enum")) found[key].insert(part["enum"]);
  for (const auto& item : part.items()) {
    if (item.key() == "properties") {
      for (const auto& property : item.value().items()) collect(property.value(), key + "." + property.key(), found);
    } else if (item.key() != "enum" && item.key() != "dependencies" && item.key() != "allOf") {
      collect(item.value(), key, found);
    }
  }
}

template <class E>
Json names() {
  return all_names<E>();
}
template <class E>
Json names_with_auto() {
  Json all{"auto"};
  for (const std::string& name : all_names<E>()) all.push_back(name);
  return all;
}

/// The enums that scene files name, each wherever it is.
const std::map<std::string, Json>& expected() {
  static const std::map<std::string, Json> all{
      {"probe.kind", names<ProbeKind>()},
      {"surface.sides", names_with_auto<Sides>()},
      {"surface.search", names<SearchStructure>()},
      {"surface.on_overlap", names<OnOverlap>()},
      {"surface.shell_directions", names<ShellDirections>()},
      {"coat.mapping", names_with_auto<Mapping>()},
      {"mesostructure.mapping", names_with_auto<Mapping>()},
      {"coat.wrap", names<Wrap>()},
      {"mesostructure.wrap", names<Wrap>()},
      {"coat.filter", names<Reconstruction>()},
      {"mesostructure.filter", names<Reconstruction>()},
      {"coat.green", names<GreenConvention>()},
      {"mesostructure.green", names<GreenConvention>()},
      {"coat.detail", names<DetailKind>()},
      {"mesostructure.detail", names<DetailKind>()},
      {"detail.kind", names<DetailKind>()},
      {"layer.solid", names<SolidKind>()},
      {"face_group.filter", names<Reconstruction>()},
      {"layer.filter", names<Reconstruction>()},
      {"law.formulation", names<Formulation>()},
      {"law.blend", names<Blend>()},
      {"law.magnitude", names<ContactMagnitude>()},
      {"law.normal_map", names<NormalMapUse>()},
      {"blend_map.channel", names<Channel>()},
      {"material.friction", names<FrictionKind>()},
      {"friction.law", names<FrictionKind>()},
      {"friction.formulation", names<Formulation>()},
      {"lay.formulation", names<Formulation>()},
      {"stroke.type", names<StrokeType>()},
      {"stitching.folds", names<FoldMode>()},
      {"stitching.blend", names<Blend>()},
      {"mesh_generator.bend", names<TrialBend>()},
      {"volume.component", names<VectorPart>()},
      {"volume.association", names<Association>()},
      {"volume.derive", names<DerivedField>()},
      {"volume.reconstruction", names<CellReconstruction>()},
      {"volume.generator", names<VolumeKind>()},
      {"volume.type", names<SampleType>()},
      {"iso.inside", names<Inside>()},
      {"implicit.inside", names<InsideRule>()},
      {"implicit.reconstruction", names<CellReconstruction>()},
      {"implicit.redistance", names<Redistancing>()},
      {"effect.type", names<FieldEffectKind>()},
      {"effect.formulation", names<Formulation>()},
      {"parametric.shape", names<ParametricShape>()},
      {"texture.as", names_with_auto<FeatureScale>()},
      {"texture.formulation", names<Formulation>()},
      {"texture.source", names<TextureSource>()},
      {"feature.type", names<FeatureKind>()},
      {"feature.as", names_with_auto<FeatureScale>()},
      {"feature.filter", names<Reconstruction>()},
      {"feature_mapping.surface", names<IntermediateSurface>()},
  };
  return all;
}

/// Choices of scene files that are no enum of the program.
const std::set<std::string> others{".device",
                                   ".hand",
                                   "device.profile",
                                   "hand.preset",
                                   "surface.units",
                                   "surface.fit",
                                   "surface.up",
                                   "surface.law",
                                   "effect.units",
                                   "effect.fit",
                                   "mesh_generator.generator",
                                   "coat.white_is",
                                   "layer.white_is",
                                   "face_group.white_is",
                                   "feature.white_is",
                                   "coat.normals",
                                   "coat.from",
                                   "law.type",
                                   "mesostructure.white_is",
                                   "mesostructure.normals",
                                   "mesostructure.from",
                                   "height_generator.generator",
                                   "library_relief.library",
                                   "implicit.band_inside",
                                   "implicit_texture.type"};

TEST(SchemaNames, AreThoseOfTheTables) {
  const Json schema = Json::parse(scene_schema_json());
  std::map<std::string, std::set<Json>> found;
  for (const auto& item : schema["definitions"].items()) collect(item.value(), item.key(), found);
  collect(Json{{"properties", schema["properties"]}}, "", found);
  for (const auto& [key, lists] : found) {
    if (others.count(key) != 0) continue;
    const auto table = expected().find(key);
    ASSERT_NE(table, expected().end()) << key << " has names that no table is known for";
    for (const Json& list : lists) EXPECT_EQ(list, table->second) << key;
  }
  for (const auto& [key, names] : expected()) EXPECT_EQ(found.count(key), 1U) << key << ": " << names;
  for (const std::string& key : others) EXPECT_EQ(found.count(key), 1U) << key;
}

}  // namespace
}  // namespace asperity::names_schema_test
