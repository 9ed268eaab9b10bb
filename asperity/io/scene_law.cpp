// Laws in a scene file.

#include <fmt/format.h>

#include <algorithm>

#include "asperity/io/detail/scene_reader.h"
#include "asperity/io/image_io.h"
#include "asperity/render/law_registry.h"
#include "asperity/surface/blend_option.h"

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

/// What a row holds whose value is a blend that is an image: its weights. By its name or as weights it is bound to the
/// settings already.
Status read_blend(ObjectReader& reader, const SceneContext& context, const Option& row, void* settings) {
  const SceneJson* blend = reader.raw(row.key);
  if (blend == nullptr || !blend->is_object()) return reader.status();
  ASPERITY_TRY(std::vector<double> weights, read_blend_map(*blend, reader.place_of(row.key), context, reader));
  row.set(settings, std::move(weights));
  return reader.status();
}

}  // namespace

SceneJson law_json(const Law& law) {
  SceneJson json = SceneJson::object();
  json["type"] = law.facts().name;
  if (const std::optional<Formulation> form = law.formulation()) json["formulation"] = to_string(*form);
  write_bound(json, scene_object("law"), *law.kind().type, law.settings());
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
  // Before its keys: of a law that nobody knows they say nothing.
  if (json.contains("type") && json["type"].is_string())
    ASPERITY_CHECK(at_place(law_by_name(json["type"].get<std::string>()), place + ".type"));
  ObjectReader reader(json, place, "law");
  const auto type = reader.get<std::string>("type");
  ASPERITY_CHECK(reader.status());
  ASPERITY_TRY(Law named, at_place(law_by_name(type), place + ".type"));
  // Told by "formulation" or by a name that ends in "-literal", a form has the same options by default.
  if (const std::optional<Formulation> form = named.formulation())
    named = named.in_form(reader.get("formulation", *form));
  Status read = success();
  const Law law = named.changed([&](void* settings) {
    reader.read_bound(*named.kind().type, settings);
    for (const Option& row : law_options(named.kind())) {
      if (read && reader.reads(row.key)) read = read_blend(reader, context, row, settings);
    }
  });
  ASPERITY_CHECK(read);
  ASPERITY_CHECK(reader.status());
  ASPERITY_CHECK(at_place(validate(law), place));
  return ScenePart<Law>{law, law_json(law)};
}

Result<Stitching> read_stitching(const SceneJson& json, const std::string& place, const SceneContext& context,
                                 ObjectReader& coat) {
  ObjectReader reader(json, place, "stitching");
  Stitching stitching;
  reader.read_all(stitching);
  ASPERITY_CHECK(read_blend(reader, context, blend_option(&Stitching::blend, &Stitching::blend_map), &stitching));
  ASPERITY_CHECK(at_place(validate(stitching), place));
  coat.take("stitching", std::move(reader));
  return stitching;
}

}  // namespace asperity
