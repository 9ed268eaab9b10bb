// Field effects of a scene file: volumes that are felt without a surface.

#include <fmt/format.h>

#include "asperity/io/detail/scene_reader.h"

namespace asperity {
namespace {

constexpr std::size_t most_effects = 64;

/// "transfer": [[value, answer], ...]
Result<TransferFunction> read_transfer(ObjectReader& reader) {
  const char* accepted = "an array of points [value, answer]";
  const SceneJson* json = reader.raw("transfer");
  reader.require("transfer", accepted);
  if (json != nullptr && !json->is_array()) reader.fail_type("transfer", *json, accepted);
  ASPERITY_CHECK(reader.status());
  std::vector<TransferFunction::Point> points;
  for (std::size_t i = 0; i < json->size(); ++i) {
    const SceneJson& point = (*json)[i];
    if (!are_numbers(point, 2))
      return refused(ErrorCode::bad_type, "is no pair of numbers", reader.place_of("transfer", i), accepted);
    points.push_back({point[0].get<double>(), point[1].get<double>()});
  }
  reader.write("transfer", *json);
  return at_place(TransferFunction::build(std::move(points)), reader.place());
}

Result<ScenePart<FieldEffect>> read_effect(const SceneJson& json, const std::string& place, SceneContext& context) {
  ObjectReader reader(json, place, "effect");
  ASPERITY_CHECK(reader.status());
  FieldEffect effect;
  reader.require("type", "a kind of effect");
  effect.kind = reader.choice("type", FieldEffectKind::viscosity);
  const std::string kind = to_string(effect.kind);
  const bool scalars =
      effect.kind == FieldEffectKind::gravity_scalars || effect.kind == FieldEffectKind::viscosity_scalars;
  if (effect.kind != FieldEffectKind::iwata) reader.refuse({"direction"}, "by the effect \"" + kind + "\"");
  if (!scalars) reader.refuse({"value"}, "by the effect \"" + kind + "\"");
  if (effect.kind != FieldEffectKind::pao) reader.refuse({"formulation"}, "by the effect \"" + kind + "\"");
  ASPERITY_CHECK(reader.status());
  ASPERITY_TRY(effect.transfer, read_transfer(reader));
  if (effect.kind == FieldEffectKind::iwata)
    effect.direction = reader.direction("direction", effect.direction).normalized();
  if (scalars) effect.value = reader.number("value", effect.value);
  if (effect.kind == FieldEffectKind::pao) effect.formulation = reader.choice("formulation", Formulation::consistent);
  effect.largest_force = reader.quantity("largest_force", Dimension::force, effect.largest_force, Range::positive());
  ASPERITY_CHECK(reader.status());
  ASPERITY_TRY(const VolumePart volume, read_volume_part(reader, context));
  effect.field = volume.field;
  effect.name = reader.text("name", kind + " of " + volume.name);
  ASPERITY_TRY(effect.world_from_object, read_pose(reader));
  ASPERITY_CHECK(reader.status());
  ASPERITY_CHECK(at_place(validate(effect), place));
  return ScenePart<FieldEffect>{std::move(effect), std::move(reader.canonical())};
}

}  // namespace

Result<std::vector<FieldEffect>> read_effects(ObjectReader& root, SceneContext& context, SceneJson& canonical) {
  const char* accepted = "an array of effects, each at least {\"volume\", \"type\", \"transfer\"}";
  std::vector<FieldEffect> effects;
  canonical = SceneJson::array();
  const SceneJson* json = root.raw("effects");
  if (json == nullptr) return effects;
  if (!json->is_array()) {
    root.fail_type("effects", *json, accepted);
  } else if (json->size() > most_effects) {
    root.fail("effects", fmt::format("has {} entries", json->size()), fmt::format("at most {} effects", most_effects));
  }
  ASPERITY_CHECK(root.status());
  for (std::size_t i = 0; i < json->size(); ++i) {
    ASPERITY_TRY(ScenePart<FieldEffect> part, read_effect((*json)[i], fmt::format("effects[{}]", i), context));
    effects.push_back(std::move(part.value));
    canonical.push_back(std::move(part.canonical));
  }
  return effects;
}

}  // namespace asperity
