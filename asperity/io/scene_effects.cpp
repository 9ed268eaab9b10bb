// Field effects of a scene file: volumes that are felt without a surface.

#include <fmt/format.h>

#include "asperity/io/detail/scene_reader.h"

namespace asperity {
namespace {

/// "transfer": [[value, answer], ...]
Result<TransferFunction> read_transfer(ObjectReader& reader) {
  std::vector<TransferFunction::Point> points;
  for (const SceneJson& point : *reader.raw("transfer"))
    points.push_back({point[0].get<double>(), point[1].get<double>()});
  reader.write("transfer", *reader.raw("transfer"));
  return at_place(TransferFunction::build(std::move(points)), reader.place());
}

Result<ScenePart<FieldEffect>> read_effect(const SceneJson& json, const std::string& place, SceneContext& context) {
  ObjectReader reader(json, place, "effect");
  ASPERITY_CHECK(reader.status());
  FieldEffect effect;
  reader.write("type", *reader.raw("type"));
  ASPERITY_TRY(effect.transfer, read_transfer(reader));
  reader.read_all(effect);
  if (effect.kind == FieldEffectKind::iwata) effect.direction.normalize();
  ASPERITY_CHECK(reader.status());
  ASPERITY_TRY(const VolumePart volume, read_volume_part(reader, context));
  effect.field = volume.field;
  effect.name = reader.get("name", to_string(effect.kind) + (" of " + volume.name));
  ASPERITY_TRY(effect.world_from_object, read_pose(reader));
  ASPERITY_CHECK(reader.status());
  ASPERITY_CHECK(at_place(validate(effect), place));
  return ScenePart<FieldEffect>{std::move(effect), std::move(reader.canonical())};
}

}  // namespace

Result<std::vector<FieldEffect>> read_effects(ObjectReader& root, SceneContext& context, SceneJson& canonical) {
  std::vector<FieldEffect> effects;
  canonical = SceneJson::array();
  const SceneJson* json = root.raw("effects");
  if (json == nullptr) return effects;
  for (std::size_t i = 0; i < json->size(); ++i) {
    ASPERITY_TRY(ScenePart<FieldEffect> part, read_effect((*json)[i], fmt::format("effects[{}]", i), context));
    effects.push_back(std::move(part.value));
    canonical.push_back(std::move(part.canonical));
  }
  return effects;
}

}  // namespace asperity
