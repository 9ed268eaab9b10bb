// Friction of a material in a scene file: its law, its lay, its map.

#include <fmt/format.h>

#include <algorithm>

#include "asperity/io/detail/scene_fine.h"
#include "asperity/io/detail/scene_heights.h"

namespace asperity {
namespace {

/// Reads the members that the law takes; others are refused by name.
class FrictionReader {
 public:
  FrictionReader(ObjectReader& reader, FrictionKind kind) : reader_(reader) { law_.kind = kind; }

  FrictionLaw read() {
    const auto read = [&](const std::string& key) {
      return key == "law" || takes(key) || (key == "formulation" && printed_otherwise());
    };
    reader_.refuse_unless(read, fmt::format("by the friction law \"{}\"", friction_name(law_.kind)));
    if (printed_otherwise()) law_.formulation = reader_.choice("formulation", Formulation::consistent);
    number("stiffness", Dimension::stiffness, Range::not_negative(), law_.stiffness);
    number("damping", Dimension::damping, Range::not_negative(), law_.damping);
    number("viscosity", Dimension::damping, Range::not_negative(), law_.viscosity);
    number("break_away", Dimension::force, Range::not_negative(), law_.break_away);
    number("stick_speed", Dimension::speed, Range::positive(), law_.stick_speed);
    number("stribeck_speed", Dimension::speed, Range::positive(), law_.stribeck_speed);
    number("exponent", Dimension::ratio, Range{0.5, 4.0}, law_.exponent);
    number("adhesion", Dimension::ratio, Range{0.0, 0.9}, law_.adhesion);
    return law_;
  }

 private:
  [[nodiscard]] bool takes(const std::string& key) const {
    const auto& taken = friction_parameters(law_.kind);
    return std::find(taken.begin(), taken.end(), key) != taken.end();
  }
  /// Whether the literal form is another one.
  [[nodiscard]] bool printed_otherwise() const {
    return law_.kind == FrictionKind::karnopp || law_.kind == FrictionKind::coulomb || law_.kind == FrictionKind::lugre;
  }
  void number(const char* key, Dimension dimension, const Range& range, double& value) {
    if (takes(key)) value = reader_.quantity(key, dimension, value, range);
  }

  ObjectReader& reader_;
  FrictionLaw law_;
};

Status read_law(const SceneJson& json, ObjectReader& material, Material& into) {
  if (!json.is_string() && !json.is_object()) {
    material.fail_type("friction", json, "a friction law's name, or an object with a law");
    return material.status();
  }
  const SceneJson wrapped = json.is_string() ? SceneJson{{"law", json}} : json;
  ObjectReader reader(wrapped, material.place_of("friction"), "friction");
  reader.require("law", "a friction law's name");
  const auto kind = reader.choice("law", FrictionKind::implicit_coulomb);
  ASPERITY_CHECK(reader.status());
  into.friction = FrictionReader(reader, kind).read();
  into.friction_named = true;
  ASPERITY_CHECK(reader.status());
  ASPERITY_CHECK(at_place(validate(into.friction), reader.place()));
  material.take("friction", std::move(reader));
  return success();
}

void read_lay(const SceneJson& json, ObjectReader& material, FrictionLay& lay) {
  ObjectReader reader(json, material.place_of("lay"), "lay");
  lay.still_ratio = reader.quantity("still_ratio", Dimension::ratio, 1.0, Range{0.0, 1.0});
  lay.sliding_ratio = reader.quantity("sliding_ratio", Dimension::ratio, lay.still_ratio, Range{0.0, 1.0});
  lay.formulation = reader.choice("formulation", Formulation::consistent);
  if (reader.has("direction")) lay.direction = reader.quantity("direction", Dimension::angle, 0.0);
  material.take("lay", std::move(reader));
}

Result<FrictionMap> read_friction_map(const SceneJson& json, ObjectReader& material, SceneContext& context) {
  ObjectReader reader(json, material.place_of("friction_map"), "friction map");
  ASPERITY_CHECK(reader.status());
  HeightSourceReader source(reader, context, "image", "friction map", 0.0);
  ASPERITY_CHECK(source.read_source());
  const double low = reader.number("low", 0.0, Range{0.0, 1e3});
  const double high = reader.number("high", 1.0, Range{0.0, 1e3});
  FrictionMap map;
  reader.require("tile", "size of one repeat: a length above 0, or two");
  map.tile = reader.pair("tile", Dimension::length, map.tile, Range::positive());
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

void note_friction(const Instance& instance, const FinePart& part, SceneContext& context) {
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
