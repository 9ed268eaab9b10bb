// Friction of a material in a scene file: its law, its lay, its map.

#include <fmt/format.h>

#include "asperity/io/detail/scene_fine.h"
#include "asperity/io/detail/scene_heights.h"

namespace asperity {
namespace {

Status read_law(const SceneJson& json, ObjectReader& material, Material& into) {
  const SceneJson wrapped = json.is_string() ? SceneJson{{"law", json}} : json;
  ObjectReader reader(wrapped, material.place_of("friction"), "friction");
  reader.read_all(into.friction);
  into.friction_named = true;
  ASPERITY_CHECK(reader.status());
  ASPERITY_CHECK(at_place(validate(into.friction), reader.place()));
  material.take("friction", std::move(reader));
  return success();
}

void read_lay(const SceneJson& json, ObjectReader& material, FrictionLay& lay) {
  ObjectReader reader(json, material.place_of("lay"), "lay");
  reader.read("still_ratio", lay.still_ratio);
  lay.sliding_ratio = reader.get("sliding_ratio", lay.still_ratio);
  reader.read("stiffness_ratio", lay.stiffness_ratio);
  reader.read("formulation", lay.formulation);
  lay.direction = reader.find<double>("direction");
  material.take("lay", std::move(reader));
}

Result<FrictionMap> read_friction_map(const SceneJson& json, ObjectReader& material, SceneContext& context) {
  ObjectReader reader(json, material.place_of("friction_map"), "friction map");
  ASPERITY_CHECK(reader.status());
  HeightSourceReader source(reader, context, "image", "friction map", 0.0);
  ASPERITY_CHECK(source.read_source());
  const auto low = reader.get<double>("low");
  const auto high = reader.get<double>("high");
  FrictionMap map;
  reader.read("tile", map.tile);
  ASPERITY_CHECK(reader.status());
  // Nothing between two factors may lie outside them.
  ASPERITY_TRY(HeightMap factors, source.build_between(low, high, Wrap::repeat, Reconstruction::bilinear));
  map.factors = std::make_shared<const HeightMap>(std::move(factors));
  material.take("friction_map", std::move(reader));
  return map;
}

}  // namespace

Result<FinePart> read_friction(ObjectReader& material, SceneContext& context, Material& into) {
  ASPERITY_CHECK(material.status());
  FinePart part;
  if (const SceneJson* friction = material.raw("friction")) ASPERITY_CHECK(read_law(*friction, material, into));
  if (const SceneJson* lay = material.raw("lay")) {
    part.lay_given = true;
    read_lay(*lay, material, part.lay);
  }
  ASPERITY_CHECK(material.status());
  if (const SceneJson* map = material.raw("friction_map")) {
    ASPERITY_TRY(part.friction_map, read_friction_map(*map, material, context));
  }
  ASPERITY_CHECK(material.status());
  return part;
}

namespace {

/// Says which coefficients the contact law does not read. A proxy on the surface itself reads both.
void note_unread_coefficients(const Instance& instance, SceneContext& context) {
  const Material& material = instance.material;
  const LawFacts& facts = instance.law.facts();
  const bool shaped = instance.fine != nullptr && instance.fine->shapes_friction();
  if (facts.proxy == LawProxy::surface || material.friction_named || shaped) return;
  constexpr const char* named = "\"friction\" of the material names a law that is felt";
  if (facts.retards) {
    if (material.static_friction > material.dynamic_friction) {
      context.note(
          fmt::format("surface \"{}\": the law \"{}\" retards by the dynamic_friction of {:g} alone and does "
                      "not read the static_friction of {:g} ({})",
                      instance.name, facts.name, material.dynamic_friction, material.static_friction, named));
    }
  } else if (material.static_friction > 0.0 || material.dynamic_friction > 0.0) {
    context.note(fmt::format("surface \"{}\": the law \"{}\" reads neither static_friction nor dynamic_friction ({})",
                             instance.name, facts.name, named));
  }
}

}  // namespace

void note_friction(const Instance& instance, const FinePart& part, SceneContext& context) {
  note_unread_coefficients(instance, context);
  const Material& material = instance.material;
  const FrictionLaw& law = material.friction;
  const bool asked_for = material.friction_named || part.lay_given || part.friction_map.factors != nullptr;
  if (!asked_for) return;
  const bool interlocks = instance.fine != nullptr && !instance.fine->settings().micro.empty();
  const bool viscous = law.kind == FrictionKind::viscous;
  const bool slides_alone = law.kind == FrictionKind::coulomb || law.kind == FrictionKind::dahl ||
                            law.kind == FrictionKind::hayward_armstrong;
  const bool by_coefficient = material.dynamic_friction > 0.0 || (material.static_friction > 0.0 && !slides_alone);
  const bool resists = law.viscosity > 0.0 || (!viscous && (by_coefficient || law.break_away > 0.0 || interlocks));
  if (!resists) {
    const std::string what = material.friction_named ? fmt::format("the friction law \"{}\"", friction_name(law.kind))
                                                     : std::string(part.lay_given ? "the lay" : "the friction map");
    const char* missing = viscous        ? "viscosity"
                          : slides_alone ? "dynamic_friction"
                                         : "static_friction and dynamic_friction";
    context.note(fmt::format("surface \"{}\": {} resists nothing, because {} {} 0 (\"{}\" of the material chooses)",
                             instance.name, what, missing, viscous || slides_alone ? "is" : "are",
                             viscous        ? "friction.viscosity"
                             : slides_alone ? "dynamic_friction"
                                            : "static_friction"));
  }
  if (part.lay.stiffness_ratio < 1.0 && (viscous || law.kind == FrictionKind::coulomb)) {
    context.note(fmt::format(
        "surface \"{}\": the friction law \"{}\" does not read the stiffness_ratio of the lay: it has no spring",
        instance.name, friction_name(law.kind)));
  }
  if (!material.friction_named) return;
  if (viscous && material.static_friction > 0.0) {
    context.note(
        fmt::format("surface \"{}\": the friction law \"viscous\" reads neither static_friction nor dynamic_friction, "
                    "only its viscosity",
                    instance.name));
  } else if (slides_alone && material.static_friction > material.dynamic_friction) {
    context.note(
        fmt::format("surface \"{}\": the friction law \"{}\" does not read the static_friction of {:g}: it slides at "
                    "the dynamic_friction of {:g}",
                    instance.name, friction_name(law.kind), material.static_friction, material.dynamic_friction));
  }
}

}  // namespace asperity
