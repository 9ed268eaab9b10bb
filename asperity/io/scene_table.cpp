#include "asperity/io/detail/scene_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>

#include "asperity/core/suggest.h"
#include "asperity/io/detail/scene_json.h"
#include "asperity/io/detail/scene_rows.h"
#include "asperity/render/law_registry.h"

namespace asperity {
namespace {

std::vector<SceneObject> make_table() {
  std::vector<SceneObject> table;
  for (const auto make :
       {scene_rows::hand_rows, scene_rows::shape_rows, scene_rows::coat_rows, scene_rows::feel_rows}) {
    for (auto& [object, fill] : make()) fill(table.emplace_back(std::move(object)));
  }
  return table;
}

/// What stands at a path, or nullptr.
const SceneJson* at_path(const SceneJson& json, std::string_view path) {
  const SceneJson* found = &json;
  while (found != nullptr && !path.empty()) {
    const std::size_t dot = std::min(path.find('.'), path.size());
    const auto next = found->is_object() ? found->find(path.substr(0, dot)) : found->end();
    found = found->is_object() && next != found->end() ? &*next : nullptr;
    path.remove_prefix(std::min(dot + 1, path.size()));
  }
  return found;
}

/// The text that a key says or stands for; nothing where that depends on more than the table.
std::optional<std::string> text_at(const std::string& path, const SceneJson& json, const SceneObject& object) {
  const SceneJson* said = at_path(json, path);
  if (said != nullptr) return said->is_string() ? said->get<std::string>() : std::string();
  for (const Option& row : object.rows) {
    const auto* fallback = std::get_if<std::string>(&row.fallback);
    if (row.key == path && fallback != nullptr) return *fallback;
  }
  return std::nullopt;
}

bool names_it(const OptionType& type, const SceneJson& text) {
  const std::vector<std::string> names = type.all_names();
  return std::find(names.begin(), names.end(), text.get_ref<const std::string&>()) != names.end();
}

/// Whether a type takes this kind of JSON at all, whatever it says.
bool admits(const OptionType& type, const SceneJson& json) {
  switch (type.kind) {
    case OptionKind::number:
    case OptionKind::integer:
    case OptionKind::seed: return json.is_number();
    case OptionKind::quantity:
    case OptionKind::bytes: return json.is_number() || json.is_string();
    case OptionKind::boolean: return json.is_boolean();
    case OptionKind::text:
    case OptionKind::choice:
    case OptionKind::share: return json.is_string();
    case OptionKind::array: return json.is_array();
    case OptionKind::object: return json.is_object();
    case OptionKind::numbers: {
      if (!json.is_object() || type.more_names == nullptr) return json.is_object();
      return json.contains("type") && json["type"].is_string() && names_it(type, json["type"]);
    }
    case OptionKind::any: break;
  }
  return std::any_of(type.parts.begin(), type.parts.end(), [&](const OptionType& part) { return admits(part, json); });
}

/// Of several objects the one whose first key is there, a program's own before all others.
const OptionType& object_among(const std::vector<const OptionType*>& parts, const SceneJson& json) {
  for (const OptionType* part : parts) {
    if (part->kind == OptionKind::numbers) return *part;
  }
  for (const OptionType* part : parts) {
    if (json.contains(scene_object(part->word).rows.front().key)) return *part;
  }
  return *parts.front();
}

constexpr std::pair<const char*, double> byte_units[] = {
    {"B", 1.0}, {"kB", 1e3}, {"MB", 1e6}, {"GB", 1e9}, {"KiB", 1024.0}, {"MiB", 1048576.0}, {"GiB", 1073741824.0}};

Result<double> parse_bytes(const std::string& text) {
  const std::size_t end = std::min(text.find_first_not_of("0123456789. "), text.size());
  const Result<double> number = parse_quantity(text.substr(0, end), Dimension::ratio);
  for (const auto& [unit, bytes] : byte_units) {
    if (number && text.substr(end) == unit) return *number * bytes;
  }
  return bad_value(fmt::format("\"{}\" is no size", text), {}, {});
}

/// A number as it stands, or a text with a unit.
Result<double> number_of(const SceneJson& json, const OptionType& type) {
  if (json.is_number()) return json.get<double>();
  const auto& text = json.get_ref<const std::string&>();
  if (type.kind == OptionKind::bytes) return parse_bytes(text);
  const bool share = text.find('%') != std::string::npos && (type.share || type.kind == OptionKind::share);
  if (type.kind == OptionKind::share && !share) return bad_value(fmt::format("\"{}\" is no share", text), {}, {});
  Result<double> number = parse_quantity(text, share ? Dimension::ratio : type.dimension);
  if (!number && share) number.error().what = fmt::format("\"{}\" is no share", text);
  return number;
}

/// The kinds of object that a type leads to.
void add_objects(const OptionType& type, std::vector<const SceneObject*>& objects) {
  if (type.kind == OptionKind::object) objects.push_back(&scene_object(type.word));
  for (const OptionType& part : type.parts) add_objects(part, objects);
}

/// Walks a scene along the table.
class StructureCheck {
 public:
  Status object(const SceneJson& json, const std::string& place, const SceneObject& object) {
    if (!json.is_object()) return wrong_type(json, place, "an object");
    const auto at = [&](const std::string& key) { return place.empty() ? key : place + "." + key; };
    // Of a law or a shape that nobody knows its keys say nothing.
    const Option& first = object.rows.front();
    if (first.type.kind == OptionKind::choice && json.contains(first.key))
      ASPERITY_CHECK(value(json[first.key], at(first.key), first.type));
    for (const auto& item : json.items()) {
      if (object.row(item.key(), json) == nullptr) return unknown_key(item.key(), at(item.key()), json, object);
    }
    // In the table's order: what others depend on stands before them.
    for (const Option& row : object.rows) {
      if (!json.contains(row.key) || object.row(row.key, json) != &row) continue;
      for (const OptionTest& test : row.only) {
        if (holds(test, json, object)) continue;
        const std::string said = text_at(test.path, json, object).value_or("");
        return refused(ErrorCode::bad_key, "is not read " + fmt::format(fmt::runtime(test.why), said), at(row.key),
                       "no such key here");
      }
      ASPERITY_CHECK(value(json[row.key], at(row.key), row.type));
    }
    for (const Option& row : object.rows) {
      if (json.contains(row.key) || !row.required || object.row(row.key, json) != &row) continue;
      if (holds(*row.required, json, object)) return bad_value("is missing", at(row.key), row.type.accepted());
    }
    return success();
  }

 private:
  static Error wrong_type(const SceneJson& json, const std::string& place, const std::string& accepted) {
    return refused(ErrorCode::bad_type, fmt::format("is {}", json_type(json)), place, accepted);
  }

  static Error unknown_key(const std::string& key, const std::string& place, const SceneJson& json,
                           const SceneObject& object) {
    // Those that say something beside what is there.
    std::vector<std::string> known = object.keys();
    std::erase_if(known, [&](const std::string& one) { return !object.reads(*object.row(one, json), json); });
    const std::string near = nearest_name(key, known);
    const bool vowel = object.name.find_first_of("aeiou") == 0;
    return refused(ErrorCode::bad_key,
                   fmt::format("is not a key of {} {}{}", vowel ? "an" : "a", object.name,
                               near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near)),
                   place, fmt::format("{}", fmt::join(known, ", ")));
  }

  static Error unknown_name(const SceneJson& json, const std::string& place, const OptionType& names,
                            std::string accepted) {
    const auto& given = json.get_ref<const std::string&>();
    const std::string near = nearest_name(given, names.all_names());
    return bad_value(
        fmt::format("\"{}\" is not known{}", given, near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near)),
        place, std::move(accepted));
  }

  Status value(const SceneJson& json, const std::string& place, const OptionType& type) {
    if (!admits(type, json)) return wrong_type(json, place, type.accepted());
    switch (type.kind) {
      case OptionKind::number:
      case OptionKind::quantity:
      case OptionKind::share:
      case OptionKind::bytes: return in_range(json, place, type);
      case OptionKind::integer:
      case OptionKind::seed: {
        const double number = json.get<double>();
        if (type.range.holds(number) && number == std::floor(number) && number < 0x1p64) return success();
        return bad_value(fmt::format("is {}", number), place, type.accepted());
      }
      case OptionKind::text:
        if (json.get_ref<const std::string&>().size() < type.least)
          return bad_value("is missing", place, type.accepted());
        return success();
      case OptionKind::choice: {
        if (names_it(type, json)) return success();
        return unknown_name(json, place, type, type.accepted());
      }
      case OptionKind::array: return entries(json, place, type);
      case OptionKind::object: return object(json, place, scene_object(type.word));
      case OptionKind::numbers: return named_numbers(json, place);
      case OptionKind::any: return one_of(json, place, type);
      case OptionKind::boolean: break;
    }
    return success();
  }

  static Status in_range(const SceneJson& json, const std::string& place, const OptionType& type) {
    Result<double> number = number_of(json, type);
    if (!number) return bad_value(number.error().what, place, type.accepted());
    if (std::isfinite(*number) && type.range.holds(*number)) return success();
    return bad_value(fmt::format("is {:.6g}", *number), place, type.accepted());
  }

  Status entries(const SceneJson& json, const std::string& place, const OptionType& type) {
    if (json.size() < type.least || json.size() > type.most)
      return bad_value(fmt::format("has {} {}", json.size(), type.word), place, type.accepted());
    for (std::size_t i = 0; i < json.size(); ++i)
      ASPERITY_CHECK(value(json[i], fmt::format("{}[{}]", place, i), type.parts.front()));
    return success();
  }

  Status named_numbers(const SceneJson& json, const std::string& place) {
    const char* accepted = "a number (SI), or a text with a unit (\"2 mm\", \"0.5 N/mm\")";
    if (!json.contains("type"))
      return bad_value("is missing", place + ".type", "the name of a surface that the program has registered");
    for (const auto& item : json.items()) {
      const std::string where = place + "." + item.key();
      if (item.key() == "type") {
        ASPERITY_CHECK(value(item.value(), where, OptionType::text(1)));
      } else {
        if (!item.value().is_number() && !item.value().is_string()) return wrong_type(item.value(), where, accepted);
        if (!number_in_any_unit(item.value()))
          return bad_value(fmt::format("{} is no number with a unit", item.value().dump()), where, accepted);
      }
    }
    return success();
  }

  Status one_of(const SceneJson& json, const std::string& place, const OptionType& type) {
    std::vector<const OptionType*> fitting;
    for (const OptionType& part : type.parts) {
      if (admits(part, json)) fitting.push_back(&part);
    }
    if (json.is_object()) return value(json, place, object_among(fitting, json));
    for (const OptionType* part : fitting) {
      if (Status good = value(json, place, *part); good || fitting.size() == 1) return good;
    }
    return unknown_name(json, place, *fitting.front(), type.accepted());
  }
};

}  // namespace

std::vector<std::string> SceneObject::keys() const {
  std::vector<std::string> all;
  for (const Option& one : rows) {
    if (std::find(all.begin(), all.end(), one.key) == all.end()) all.push_back(one.key);
  }
  return all;
}

const Option* SceneObject::row(std::string_view key, const SceneJson& json) const {
  const Option* first = nullptr;
  for (const Option& one : rows) {
    if (one.key != key) continue;
    if (first == nullptr) first = &one;
    if (reads(one, json)) return &one;
  }
  return first;
}

bool SceneObject::reads(const Option& one, const SceneJson& json) const {
  return std::all_of(one.only.begin(), one.only.end(), [&](const auto& test) { return holds(test, json, *this); });
}

std::vector<std::pair<const Option*, OptionValue>> SceneObject::bound(std::type_index type, const void* settings,
                                                                      const SceneJson& json) const {
  std::vector<std::pair<const Option*, OptionValue>> found;
  for (const Option& one : rows) {
    if (one.settings != type || !reads(one, json)) continue;
    if (OptionValue value = one.get(settings); one.type.takes(value)) found.emplace_back(&one, std::move(value));
  }
  return found;
}

const std::vector<SceneObject>& scene_table() {
  // One for every number of laws that there were: a program may add some, and who holds a row of before keeps it.
  static std::mutex guard;
  static std::map<std::size_t, const std::vector<SceneObject>> tables;
  const std::lock_guard<std::mutex> alone(guard);
  const std::size_t laws = law_names().size();
  const auto found = tables.find(laws);
  return found != tables.end() ? found->second : tables.emplace(laws, make_table()).first->second;
}

const SceneObject& scene_object(std::string_view name) {
  const std::vector<SceneObject>& table = scene_table();
  return *std::find_if(table.begin(), table.end(), [&](const SceneObject& one) { return one.name == name; });
}

std::vector<const Option*> rows_at(std::string_view path) {
  std::vector<const SceneObject*> objects{&scene_table().front()};
  const std::string_view first = path.substr(0, path.find_first_of(".["));
  for (const SceneObject& object : scene_table()) {
    if (object.name != first || objects.front()->row(first, SceneJson::object()) != nullptr) continue;
    objects = {&object};
    path.remove_prefix(std::min(first.size() + 1, path.size()));
  }
  std::vector<const Option*> rows;
  while (!path.empty()) {
    const std::string_view key = path.substr(0, path.find_first_of(".["));
    path.remove_prefix(std::min(path.find('.'), path.size() - 1) + 1);
    rows.clear();
    for (const SceneObject* object : objects) {
      for (const Option& row : object->rows) {
        if (row.key == key) rows.push_back(&row);
      }
    }
    objects.clear();
    for (const Option* row : rows) add_objects(row->type, objects);
  }
  return rows;
}

bool refused_by_contents(std::string_view place) {
  std::vector<const Option*> rows = rows_at(place);
  while (rows.empty() && place.find('.') != std::string_view::npos) {
    place = place.substr(0, place.rfind('.'));
    rows = rows_at(place);
  }
  return std::any_of(rows.begin(), rows.end(), [](const Option* row) { return !row->contents.empty(); });
}

bool holds(const OptionTest& test, const SceneJson& json, const SceneObject& object) {
  const auto met = [&](const OptionTest& part) { return holds(part, json, object); };
  const SceneJson* found = at_path(json, test.path);
  switch (test.kind) {
    case OptionTest::Kind::given: return found != nullptr;
    case OptionTest::Kind::an_object: return found != nullptr && found->is_object();
    case OptionTest::Kind::filled: return found != nullptr && found->is_array() && !found->empty();
    case OptionTest::Kind::is: {
      const std::optional<std::string> said = text_at(test.path, json, object);
      return !said || std::find(test.names.begin(), test.names.end(), *said) != test.names.end();
    }
    case OptionTest::Kind::all: return std::all_of(test.of.begin(), test.of.end(), met);
    case OptionTest::Kind::any: return std::any_of(test.of.begin(), test.of.end(), met);
    case OptionTest::Kind::none: break;
  }
  return std::none_of(test.of.begin(), test.of.end(), met);
}

Status check_structure(const SceneJson& json, const std::string& place, const SceneObject& object) {
  return StructureCheck().object(json, place, object);
}

std::optional<double> number_in_any_unit(const SceneJson& json) {
  if (json.is_number()) return json.get<double>();
  for (std::size_t d = 0; json.is_string() && d <= static_cast<std::size_t>(Dimension::angle); ++d) {
    const Result<double> number = parse_quantity(json.get_ref<const std::string&>(), static_cast<Dimension>(d));
    if (number) return *number;
  }
  return std::nullopt;
}

OptionValue value_of(const SceneJson& json, const OptionType& type) {
  switch (type.kind) {
    case OptionKind::number:
    case OptionKind::quantity:
    case OptionKind::share:
    case OptionKind::bytes: return *number_of(json, type);
    case OptionKind::integer: return static_cast<std::int64_t>(json.get<double>());
    case OptionKind::seed:
      return json.is_number_unsigned() ? json.get<std::uint64_t>() : static_cast<std::uint64_t>(json.get<double>());
    case OptionKind::boolean: return json.get<bool>();
    case OptionKind::text:
    case OptionKind::choice: return json.get<std::string>();
    case OptionKind::array: {
      std::vector<double> values;
      for (const SceneJson& entry : json) values.push_back(*number_of(entry, type.parts.front()));
      return values;
    }
    case OptionKind::any:
      for (const OptionType& part : type.parts) {
        if (admits(part, json) && (part.kind != OptionKind::choice || names_it(part, json)))
          return value_of(json, part);
      }
      break;
    case OptionKind::numbers:
    case OptionKind::object: break;
  }
  return std::monostate();
}

SceneJson json_of(const OptionValue& value) {
  return std::visit(
      []<class T>(const T& one) -> SceneJson {
        if constexpr (std::is_same_v<T, std::monostate>) {
          return nullptr;
        } else {
          return one;
        }
      },
      value);
}

}  // namespace asperity
