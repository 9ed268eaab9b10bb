#include "asperity/io/detail/scene_custom.h"

#include <fmt/format.h>

#include <cmath>

namespace asperity {

Result<NamedNumbers> read_named_numbers(const SceneJson& json, const std::string& place) {
  std::map<std::string, double, std::less<>> numbers;
  for (const auto& item : json.items()) {
    if (item.key() == "type") continue;
    const std::string where = fmt::format("{}.{}", place, item.key());
    const std::optional<double> value = number_in_any_unit(item.value());
    if (!value || !std::isfinite(*value)) {
      const ErrorCode code =
          item.value().is_number() || item.value().is_string() ? ErrorCode::bad_value : ErrorCode::bad_type;
      return refused(code, fmt::format("is {}", item.value().dump()), where,
                     "a finite number (SI), or a text with a unit (\"2 mm\", \"0.5 N/mm\")");
    }
    numbers.emplace(item.key(), *value);
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
  const std::string type = json["type"].get<std::string>();
  ASPERITY_TRY(NamedNumbers numbers, read_named_numbers(json, place));
  ASPERITY_TRY(CustomSurface made, at_place(make_custom_surface(type, numbers), place));
  surface.write("custom", named_numbers_json(type, numbers));
  instance.name = surface.get("name", type);
  instance.sides = surface.get<std::optional<Sides>>("sides");
  instance.surface = std::make_shared<const CustomSurface>(std::move(made));
  return surface.status();
}

}  // namespace asperity
