// Laws in a scene file.

#include <fmt/format.h>

#include <algorithm>

#include "asperity/io/detail/scene_custom.h"
#include "asperity/io/detail/scene_reader.h"
#include "asperity/io/image_io.h"
#include "asperity/render/law_registry.h"

namespace asperity {
namespace {

Result<std::vector<double>> column_means(const Image& image, Channel channel) {
  ASPERITY_TRY(const ChannelChoice choice, choose_channel(image, channel));
  const std::vector<float> values = extract_channel(image, choice.channel);
  const auto width = static_cast<std::size_t>(image.width);
  std::vector<double> means(width, 0.0);
  for (std::size_t i = 0; i < values.size(); ++i) means[i % width] += static_cast<double>(values[i]);
  for (double& mean : means) mean /= static_cast<double>(image.height);
  return means;
}

/// Weights across the band, from the columns of an image: its left edge is the outside of the band.
Result<std::vector<double>> read_blend_map(const SceneJson& json, const std::string& place, const SceneContext& context,
                                           ObjectReader& law) {
  ObjectReader reader(json, place, "blend map");
  const std::string file = reader.required_text("image", "an image file");
  const auto channel = reader.choice("channel", Channel::automatic);
  ASPERITY_CHECK(reader.status());
  const std::string path = context.resolve(file).string();
  ASPERITY_TRY(const Image image, read_image(path));
  ASPERITY_TRY(std::vector<double> means, in_file(column_means(image, channel), path));
  reader.write("image", path);
  law.take("blend", std::move(reader));
  return means;
}

/// A blend by its name, an image or an array of weights, as both laws and coats have it.
Status read_blend(ObjectReader& reader, const SceneContext& context, Blend& kind, std::vector<double>& weights) {
  const SceneJson* blend = reader.raw("blend");
  if (blend != nullptr && blend->is_object()) {
    ASPERITY_TRY(weights, read_blend_map(*blend, reader.place_of("blend"), context, reader));
    kind = Blend::image;
  } else if (blend != nullptr && blend->is_array()) {
    for (std::size_t i = 0; i < blend->size(); ++i) {
      if (!(*blend)[i].is_number()) {
        return refused(ErrorCode::bad_type, fmt::format("is {}", json_type((*blend)[i])), reader.place_of("blend", i),
                       "weights from 0 to 1");
      }
      weights.push_back((*blend)[i].get<double>());
    }
    kind = Blend::image;
    reader.write("blend", *blend);
  } else if (blend != nullptr && !blend->is_string()) {
    reader.fail_type("blend", *blend, name_list<Blend>("\"") + ", {\"image\": file}, or an array of weights");
  } else {
    kind = reader.choice("blend", kind);
  }
  return reader.status();
}

/// Refuses every option but those in `own`.
void only(ObjectReader& reader, std::initializer_list<std::string_view> own, const std::string& who) {
  reader.refuse_unless(
      [&](const auto& key) { return key == "type" || std::find(own.begin(), own.end(), key) != own.end(); }, who);
}

Status read_mesostructure(ObjectReader& reader, const SceneContext& context, MesostructureLaw& law) {
  only(reader, {"formulation", "rho", "blend", "test_neighbours"}, "by a mesostructure law");
  if (law.formulation == Formulation::consistent) {
    reader.refuse({"rho", "blend", "test_neighbours"},
                  "by the consistent mesostructure law: the coat's \"stitching\" says how it blends");
    return reader.status();
  }
  law.rho = reader.number("rho", law.rho, Range{0.0, 1.0 / 3.0, true});
  law.test_neighbours = reader.boolean("test_neighbours", law.test_neighbours);
  return read_blend(reader, context, law.blend, law.blend_map);
}

void read_generated(ObjectReader& reader, GeneratedGeometryLaw& law) {
  only(reader, {"subdivisions", "influence_radius"}, "by the law \"generated-geometry\"");
  law.subdivisions = reader.integer("subdivisions", law.subdivisions, 1, most_generated_subdivisions);
  law.influence_radius =
      reader.optional_quantity("influence_radius", Dimension::length, Range::positive()).value_or(0.0);
}

void read_dense(ObjectReader& reader, DenseMeshLaw& law) {
  only(reader, {"subdivisions"}, "by the law \"dense-mesh\"");
  if (reader.has("subdivisions")) law.subdivisions = reader.integer("subdivisions", 1, 1, most_generated_subdivisions);
}

void read_virtual_contact_point(ObjectReader& reader, VirtualContactPointLaw& law) {
  only(reader, {"formulation", "magnitude", "depth_gain", "offset"}, "by the law \"virtual-contact-point\"");
  if (law.formulation == Formulation::consistent) {
    reader.refuse({"magnitude"}, "by the consistent law \"virtual-contact-point\", which has one magnitude");
  } else {
    law.magnitude = reader.choice("magnitude", ContactMagnitude::distance);
  }
  law.depth_gain = reader.number("depth_gain", law.depth_gain, Range::not_negative());
  law.offset = reader.quantity("offset", Dimension::length, law.offset, Range::not_negative());
}

SceneJson blend_json(Blend blend, const std::vector<double>& weights) {
  return blend == Blend::image ? SceneJson(weights) : SceneJson(to_string(blend));
}

}  // namespace

SceneJson law_json(const Law& law) {
  if (const CustomLaw* custom = custom_of(law)) return named_numbers_json(custom->name(), custom->numbers());
  SceneJson json = SceneJson::object();
  json["type"] = law_name(in_formulation(law, Formulation::consistent));
  const std::optional<Formulation> form = formulation_of(law);
  const bool literal = form == Formulation::literal;
  if (form) json["formulation"] = to_string(*form);
  if (const auto* height_field = std::get_if<HeightFieldLaw>(&law)) {
    json["edge_taper"] = height_field->edge_taper;
  } else if (const auto* meso = std::get_if<MesostructureLaw>(&law); meso != nullptr && literal) {
    json["rho"] = meso->rho;
    json["blend"] = blend_json(meso->blend, meso->blend_map);
    json["test_neighbours"] = meso->test_neighbours;
  } else if (const auto* avila = std::get_if<AvilaLaw>(&law)) {
    json["band"] = avila->band;
    json["largest_force"] = avila->largest_force;
    json["retarding"] = avila->retarding;
  } else if (const auto* cross = std::get_if<CrossUncrossLaw>(&law)) {
    json["retarding"] = cross->retarding;
    if (literal) json["reach"] = cross->reach;
  } else if (const auto* contact = std::get_if<VirtualContactPointLaw>(&law)) {
    if (literal) json["magnitude"] = to_string(contact->magnitude);
    json["depth_gain"] = contact->depth_gain;
    json["offset"] = contact->offset;
  } else if (const auto* magnetic = std::get_if<MagneticLaw>(&law)) {
    json["band"] = magnetic->band;
  } else if (const auto* generated = std::get_if<GeneratedGeometryLaw>(&law)) {
    json["subdivisions"] = generated->subdivisions;
    if (generated->influence_radius > 0.0) json["influence_radius"] = generated->influence_radius;
  } else if (const auto* dense = std::get_if<DenseMeshLaw>(&law); dense != nullptr && dense->subdivisions > 0) {
    json["subdivisions"] = dense->subdivisions;
  }
  return json;
}

Result<ScenePart<Law>> read_law(const SceneJson& json, const std::string& place, const SceneContext& context) {
  if (json.is_string()) {
    ASPERITY_TRY(const Law law, at_place(law_by_name(json.get_ref<const std::string&>()), place));
    return ScenePart<Law>{law, law_json(law)};
  }
  if (!json.is_object()) {
    return refused(ErrorCode::bad_type, fmt::format("is {}", json_type(json)), place, "a law's name or an object");
  }
  if (json.contains("type") && json["type"].is_string()) {
    // Its numbers are its own, and so is what is said of them.
    const std::string name = json["type"].get<std::string>();
    const std::vector<std::string>& own = custom_law_names();
    if (std::find(own.begin(), own.end(), name) != own.end()) {
      ASPERITY_TRY(NamedNumbers numbers, read_named_numbers(json, place));
      ASPERITY_TRY(const Law law, at_place(make_custom_law(name, std::move(numbers)), place));
      return ScenePart<Law>{law, law_json(law)};
    }
    // Before its keys: of a law that nobody knows they say nothing.
    ASPERITY_CHECK(at_place(law_by_name(name), place + ".type"));
  }
  ObjectReader reader(json, place, "law");
  const std::string type = reader.text("type", "proxy");
  ASPERITY_CHECK(reader.status());
  ASPERITY_TRY(Law law, at_place(law_by_name(type), place + ".type"));
  // Told by "formulation" or by a name that ends in "-literal", a form has the same options by default.
  if (const std::optional<Formulation> named = formulation_of(law))
    law = in_formulation(law, reader.choice("formulation", *named));
  if (auto* meso = std::get_if<MesostructureLaw>(&law)) {
    ASPERITY_CHECK(read_mesostructure(reader, context, *meso));
  } else if (std::holds_alternative<ForceShadingLaw>(law)) {
    only(reader, {"formulation"}, "by force shading");
  } else if (auto* height_field = std::get_if<HeightFieldLaw>(&law)) {
    only(reader, {"formulation", "edge_taper"}, "by a height-field law");
    height_field->edge_taper = reader.number("edge_taper", height_field->edge_taper, Range{0.0, 1.0 / 3.0});
  } else if (auto* generated = std::get_if<GeneratedGeometryLaw>(&law)) {
    read_generated(reader, *generated);
  } else if (auto* dense = std::get_if<DenseMeshLaw>(&law)) {
    read_dense(reader, *dense);
  } else if (auto* avila = std::get_if<AvilaLaw>(&law)) {
    only(reader, {"formulation", "band", "largest_force", "retarding"}, "by the law \"avila\"");
    avila->band = reader.number("band", avila->band, Range::not_negative());
    avila->largest_force = reader.quantity("largest_force", Dimension::force, avila->largest_force, Range::positive());
    avila->retarding = reader.quantity("retarding", Dimension::damping, avila->retarding, Range::not_negative());
  } else if (auto* contact = std::get_if<VirtualContactPointLaw>(&law)) {
    read_virtual_contact_point(reader, *contact);
  } else if (auto* magnetic = std::get_if<MagneticLaw>(&law)) {
    only(reader, {"formulation", "band"}, "by the law \"magnetic\"");
    magnetic->band = reader.quantity("band", Dimension::length, magnetic->band, Range::positive());
  } else if (auto* cross = std::get_if<CrossUncrossLaw>(&law)) {
    only(reader, {"formulation", "retarding", "reach"}, "by the law \"cross-uncross\"");
    cross->retarding = reader.quantity("retarding", Dimension::damping, cross->retarding, Range::not_negative());
    if (cross->formulation == Formulation::consistent)
      reader.refuse({"reach"}, "by the consistent law \"cross-uncross\", which looks as far as it has to");
    cross->reach = reader.optional_quantity("reach", Dimension::length, Range::not_negative()).value_or(0.0);
  } else {
    only(reader, {}, fmt::format("by the law \"{}\"", type));
  }
  ASPERITY_CHECK(reader.status());
  ASPERITY_CHECK(at_place(validate(law), place));
  return ScenePart<Law>{law, law_json(law)};
}

Result<Stitching> read_stitching(const SceneJson& json, const std::string& place, const SceneContext& context,
                                 ObjectReader& coat) {
  ObjectReader reader(json, place, "stitching");
  Stitching stitching;
  stitching.folds = reader.choice("folds", stitching.folds);
  stitching.rho = reader.number("rho", stitching.rho, Range{0.0, 1.0 / 3.0, true});
  if (stitching.folds == FoldMode::fillet) {
    stitching.fillet_radius =
        reader.quantity("fillet_radius", Dimension::length, stitching.fillet_radius, Range::positive());
  } else {
    reader.refuse({"fillet_radius"}, "without \"folds\": \"fillet\"");
  }
  ASPERITY_CHECK(read_blend(reader, context, stitching.blend, stitching.blend_map));
  ASPERITY_CHECK(at_place(validate(stitching), place));
  coat.take("stitching", std::move(reader));
  return stitching;
}

}  // namespace asperity
