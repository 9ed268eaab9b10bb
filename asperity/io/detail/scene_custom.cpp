#include "asperity/io/detail/scene_custom.h"

#include <fmt/format.h>

#include <cmath>

namespace asperity {
namespace {

/// A text with any unit.
Result<double> any_quantity(const std::string& text, const std::string& place) {
  constexpr Dimension dimensions[] = {Dimension::length, Dimension::force, Dimension::stiffness, Dimension::damping,
                                      Dimension::mass,   Dimension::time,  Dimension::frequency, Dimension::speed,
                                      Dimension::ratio,  Dimension::angle};
  for (const Dimension dimension : dimensions) {
    if (const Result<double> value = parse_quantity(text, dimension)) return *value;
  }
  return bad_value(fmt::format("\"{}\" is no number with a unit", text), place,
                   "a number (SI), or a text with a unit (\"2 mm\", \"0.5 N/mm\")");
}

}  // namespace

Result<NamedNumbers> read_named_numbers(const SceneJson& json, const std::string& place) {
  std::map<std::string, double, std::less<>> numbers;
  for (const auto& item : json.items()) {
    if (item.key() == "type") continue;
    const std::string where = fmt::format("{}.{}", place, item.key());
    double value = 0.0;
    if (item.value().is_number()) {
      value = item.value().get<double>();
    } else if (item.value().is_string()) {
      ASPERITY_TRY(value, any_quantity(item.value().get_ref<const std::string&>(), where));
    } else {
      return refused(ErrorCode::bad_type, fmt::format("is {}", json_type(item.value())), where,
                     "a number (SI), or a text with a unit");
    }
    if (!std::isfinite(value)) return bad_value(fmt::format("is {}", value), where, "a finite number");
    numbers.emplace(item.key(), value);
  }
  return NamedNumbers(std::move(numbers));
}

SceneJson named_numbers_json(const std::string& type, const NamedNumbers& numbers) {
  SceneJson json = SceneJson::object();
  json["type"] = type;
  for (const auto& [name, value] : numbers.taken()) json[name] = value;
  return json;
}

Status read_custom(ObjectReader& surface, Instance& instance) {
  const std::string place = surface.place_of("custom");
  const SceneJson& json = *surface.raw("custom");
  if (!json.is_object())
    return refused(ErrorCode::bad_type, fmt::format("is {}", json_type(json)), place, "an object with a \"type\"");
  const char* accepted = "the name of a surface that the program has registered";
  if (!json.contains("type")) return bad_value("is missing", place + ".type", accepted);
  if (!json["type"].is_string()) {
    return refused(ErrorCode::bad_type, fmt::format("is {}", json_type(json["type"])), place + ".type", accepted);
  }
  surface.refuse({"mesh", "parametric", "volume", "iso", "implicit", "units", "fit", "search", "coat", "on_overlap",
                  "shell_directions"},
                 "beside a surface of the program's own");
  ASPERITY_CHECK(surface.status());
  const std::string type = json["type"].get<std::string>();
  ASPERITY_TRY(NamedNumbers numbers, read_named_numbers(json, place));
  ASPERITY_TRY(CustomSurface made, at_place(make_custom_surface(type, numbers), place));
  surface.write("custom", named_numbers_json(type, numbers));
  instance.name = surface.text("name", type);
  instance.sides = surface.choice_or_auto<Sides>("sides");
  instance.surface = std::make_shared<const CustomSurface>(std::move(made));
  return surface.status();
}

}  // namespace asperity
