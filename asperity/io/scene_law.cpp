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
  ASPERITY_CHECK(reader.status());
  const std::string path = context.resolve(reader.get<std::string>("image")).string();
  const auto channel = reader.get<Channel>("channel");
  ASPERITY_TRY(const Image image, read_image(path));
  ASPERITY_TRY(std::vector<double> means, in_file(column_means(image, channel), path));
  reader.write("image", path);
  law.take("blend", std::move(reader));
  return means;
}

/// A blend that is an image; by its name or as weights it is bound to the settings.
Status read_blend(ObjectReader& reader, const SceneContext& context, Blend& kind, std::vector<double>& weights) {
  const SceneJson* blend = reader.raw("blend");
  if (blend == nullptr || !blend->is_object()) return reader.status();
  ASPERITY_TRY(weights, read_blend_map(*blend, reader.place_of("blend"), context, reader));
  kind = Blend::image;
  return reader.status();
}

}  // namespace

SceneJson law_json(const Law& law) {
  if (const CustomLaw* custom = custom_of(law)) return named_numbers_json(custom->name(), custom->numbers());
  SceneJson json = SceneJson::object();
  json["type"] = law_name(in_formulation(law, Formulation::consistent));
  if (const std::optional<Formulation> form = formulation_of(law)) json["formulation"] = to_string(*form);
  std::visit([&](const auto& one) { write_settings(json, scene_object("law"), one); }, law);
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
  const auto type = reader.get<std::string>("type");
  ASPERITY_CHECK(reader.status());
  ASPERITY_TRY(Law law, at_place(law_by_name(type), place + ".type"));
  // Told by "formulation" or by a name that ends in "-literal", a form has the same options by default.
  if (const std::optional<Formulation> named = formulation_of(law))
    law = in_formulation(law, reader.get("formulation", *named));
  std::visit([&](auto& one) { reader.read_all(one); }, law);
  if (auto* meso = std::get_if<MesostructureLaw>(&law))
    ASPERITY_CHECK(read_blend(reader, context, meso->blend, meso->blend_map));
  ASPERITY_CHECK(reader.status());
  ASPERITY_CHECK(at_place(validate(law), place));
  return ScenePart<Law>{law, law_json(law)};
}

Result<Stitching> read_stitching(const SceneJson& json, const std::string& place, const SceneContext& context,
                                 ObjectReader& coat) {
  ObjectReader reader(json, place, "stitching");
  Stitching stitching;
  reader.read_all(stitching);
  ASPERITY_CHECK(read_blend(reader, context, stitching.blend, stitching.blend_map));
  ASPERITY_CHECK(at_place(validate(stitching), place));
  coat.take("stitching", std::move(reader));
  return stitching;
}

}  // namespace asperity
