// Laws in a scene file.

#include <fmt/format.h>

#include <array>

#include "asperity/io/image_io.h"
#include "asperity/io/scene_reader.h"

namespace asperity {
namespace {

const std::vector<std::string>& blend_names() {
  static const std::vector<std::string> names{"none", "linear", "s_shape"};
  return names;
}
const std::vector<std::string>& formulation_names() {
  static const std::vector<std::string> names{"literal", "consistent"};
  return names;
}
const std::vector<std::string>& channel_names() {
  static const std::vector<std::string> names{"automatic", "luminance", "red", "green", "blue", "alpha"};
  return names;
}

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
  const std::string file = reader.text("image", "");
  if (!reader.failed() && file.empty()) reader.fail("image", "is missing", "an image file");
  const auto channel = static_cast<Channel>(reader.choice("channel", channel_names(), 0));
  ASPERITY_CHECK(reader.status());
  const std::string path = context.resolve(file).string();
  ASPERITY_TRY(const Image image, read_image(path));
  Result<std::vector<double>> means = column_means(image, channel);
  if (!means) return std::move(means).error().in_file(path);
  reader.write("image", path);
  law.take("blend", std::move(reader));
  return means;
}

Status read_mesostructure(ObjectReader& reader, const SceneContext& context, MesostructureLaw& law) {
  reader.refuse({"edge_taper"}, "by a mesostructure law");
  law.rho = reader.number("rho", law.rho, Range{0.0, 1.0 / 3.0, true});
  const SceneJson* blend = reader.raw("blend");
  if (blend != nullptr && blend->is_object()) {
    ASPERITY_TRY(law.blend_map, read_blend_map(*blend, reader.place_of("blend"), context, reader));
    law.blend = Blend::image;
  } else if (blend != nullptr && blend->is_array()) {
    for (std::size_t i = 0; i < blend->size(); ++i) {
      if (!(*blend)[i].is_number()) {
        return Error{ErrorCode::bad_type,
                     fmt::format("is {}", json_type((*blend)[i])),
                     {},
                     fmt::format("{}[{}]", reader.place_of("blend"), i),
                     "weights from 0 to 1"};
      }
      law.blend_map.push_back((*blend)[i].get<double>());
    }
    law.blend = Blend::image;
    reader.write("blend", *blend);
  } else if (blend != nullptr && !blend->is_string()) {
    reader.fail_type("blend", *blend, "\"none\", \"linear\", \"s_shape\", {\"image\": file}, or an array of weights");
  } else {
    law.blend = static_cast<Blend>(reader.choice("blend", blend_names(), static_cast<std::size_t>(law.blend)));
  }
  return reader.status();
}

}  // namespace

SceneJson law_json(const Law& law) {
  SceneJson json = SceneJson::object();
  if (const auto* height_field = std::get_if<HeightFieldLaw>(&law)) {
    json["type"] = "height-field";
    json["formulation"] = formulation_names()[static_cast<std::size_t>(height_field->formulation)];
    json["edge_taper"] = height_field->edge_taper;
  } else if (const auto* meso = std::get_if<MesostructureLaw>(&law)) {
    json["type"] = "mesostructure";
    json["formulation"] = formulation_names()[static_cast<std::size_t>(meso->formulation)];
    json["rho"] = meso->rho;
    if (meso->blend == Blend::image) {
      json["blend"] = meso->blend_map;
    } else {
      json["blend"] = blend_names()[static_cast<std::size_t>(meso->blend)];
    }
  } else {
    json["type"] = law_name(law);
  }
  return json;
}

Result<ScenePart<Law>> read_law(const SceneJson& json, const std::string& place, const SceneContext& context) {
  if (json.is_string()) {
    Result<Law> law = law_by_name(json.get_ref<const std::string&>());
    if (!law) return std::move(law).error().at(place);
    return ScenePart<Law>{*law, law_json(*law)};
  }
  if (!json.is_object()) {
    return Error{ErrorCode::bad_type, fmt::format("is {}", json_type(json)), {}, place, "a law's name or an object"};
  }
  ObjectReader reader(json, place, "law");
  const std::string type = reader.text("type", "mesostructure");
  ASPERITY_CHECK(reader.status());
  Result<Law> law = law_by_name(type);
  if (!law) return std::move(law).error().at(place + ".type");
  const auto formulation = [&](Formulation fallback) {
    return static_cast<Formulation>(
        reader.choice("formulation", formulation_names(), static_cast<std::size_t>(fallback)));
  };
  if (auto* meso = std::get_if<MesostructureLaw>(&*law)) {
    meso->formulation = formulation(meso->formulation);
    ASPERITY_CHECK(read_mesostructure(reader, context, *meso));
  } else if (auto* height_field = std::get_if<HeightFieldLaw>(&*law)) {
    reader.refuse({"rho", "blend"}, "by a height-field law");
    height_field->formulation = formulation(height_field->formulation);
    height_field->edge_taper = reader.number("edge_taper", height_field->edge_taper, Range{0.0, 1.0 / 3.0});
  } else {
    reader.refuse({"formulation", "rho", "blend", "edge_taper"}, fmt::format("by the law \"{}\"", type));
  }
  ASPERITY_CHECK(reader.status());
  if (auto valid = validate(*law); !valid) return std::move(valid).error().at(place);
  return ScenePart<Law>{*law, law_json(*law)};
}

}  // namespace asperity
