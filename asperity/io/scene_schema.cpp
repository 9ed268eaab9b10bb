// The published schema of scene files and their reference page, made from the table of scene keys.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "asperity/core/suggest.h"
#include "asperity/io/detail/scene_table.h"
#include "asperity/io/experiment.h"

namespace asperity {
namespace {

SceneJson schema_of(const OptionType& type);

std::string definition_name(std::string name) {
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}

SceneJson required_key(const std::string& key) {
  return {{"required", SceneJson::array({key})}};
}

/// A schema of what stands at a path, which has to be there.
SceneJson along(std::string_view path, const SceneJson& schema) {
  const std::size_t dot = path.find('.');
  const std::string key(path.substr(0, dot));
  SceneJson step = required_key(key);
  step["properties"][key] = dot == std::string_view::npos ? schema : along(path.substr(dot + 1), schema);
  if (dot != std::string_view::npos) step["properties"][key]["type"] = "object";
  return step;
}

SceneJson schema_of(const OptionTest& test, const SceneObject& object) {
  const auto each = [&](const char* how) {
    SceneJson parts = SceneJson::array();
    for (const OptionTest& part : test.of) parts.push_back(schema_of(part, object));
    return parts.empty() ? SceneJson::object() : SceneJson{{how, parts}};
  };
  switch (test.kind) {
    case OptionTest::Kind::given: return along(test.path, SceneJson::object());
    case OptionTest::Kind::an_object: return along(test.path, {{"type", "object"}});
    case OptionTest::Kind::filled: return along(test.path, {{"type", "array"}, {"minItems", 1}});
    case OptionTest::Kind::is: {
      SceneJson schema = along(test.path, {{"enum", test.names}});
      // Without the key its default counts.
      if (holds(test, SceneJson::object(), object)) schema.erase("required");
      return schema;
    }
    case OptionTest::Kind::all: return each("allOf");
    case OptionTest::Kind::any: return test.of.empty() ? SceneJson{{"not", SceneJson::object()}} : each("anyOf");
    case OptionTest::Kind::none: break;
  }
  return {{"not", each("anyOf")}};
}

SceneJson all_of(const std::vector<OptionTest>& tests, const SceneObject& object) {
  SceneJson all = SceneJson::array();
  for (const OptionTest& test : tests) all.push_back(schema_of(test, object));
  return all.size() == 1 ? all.front() : SceneJson{{"allOf", all}};
}

SceneJson number_schema(const Range& range, const char* name) {
  SceneJson schema{{"type", name}};
  if (std::isfinite(range.low)) schema[range.above_low ? "exclusiveMinimum" : "minimum"] = range.low;
  if (std::isfinite(range.high)) schema["maximum"] = range.high;
  return schema;
}

/// Texts as parse_quantity reads them: a number and one of `units`, which may be missing where `bare`.
SceneJson text_schema(const std::vector<std::string>& units, bool bare) {
  return {{"type", "string"},
          {"pattern", fmt::format(R"(^[ \t]*\+?-?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?[ \t]*({}){}[ \t]*$)",
                                  fmt::join(units, "|"), bare ? "?" : "")}};
}

std::vector<std::string> every_unit() {
  std::vector<std::string> all;
  for (std::size_t d = 0; d <= static_cast<std::size_t>(Dimension::angle); ++d) {
    for (std::string& unit : unit_names(static_cast<Dimension>(d))) {
      if (std::find(all.begin(), all.end(), unit) == all.end()) all.push_back(std::move(unit));
    }
  }
  return all;
}

SceneJson numbers_schema(const OptionType& type) {
  SceneJson name{{"description", "What it is."}, {"type", "string"}, {"minLength", 1}};
  if (type.more_names != nullptr) name = {{"enum", type.all_names()}};
  return {{"type", "object"},
          {"required", {"type"}},
          {"properties", {{"type", std::move(name)}}},
          {"additionalProperties", {{"anyOf", {{{"type", "number"}}, text_schema(every_unit(), true)}}}}};
}

SceneJson any_schema(const OptionType& type) {
  SceneJson parts = SceneJson::array();
  for (const OptionType& part : type.parts) {
    if (part.kind == OptionKind::numbers && part.more_names != nullptr && part.more_names().empty()) continue;
    SceneJson schema = schema_of(part);
    if (!schema.contains("anyOf")) {
      parts.push_back(std::move(schema));
    } else {
      for (SceneJson& one : schema["anyOf"]) parts.push_back(std::move(one));
    }
  }
  return {{"anyOf", std::move(parts)}};
}

SceneJson schema_of(const OptionType& type) {
  const std::vector<std::string> bytes{"B", "kB", "MB", "GB", "KiB", "MiB", "GiB"};
  switch (type.kind) {
    case OptionKind::number: return number_schema(type.range, "number");
    case OptionKind::integer:
    case OptionKind::seed: return number_schema(type.range, "integer");
    case OptionKind::quantity: {
      std::vector<std::string> units = unit_names(type.dimension);
      if (type.share) units.emplace_back("%");
      return {{"anyOf", {number_schema(type.range, "number"), text_schema(units, true)}}};
    }
    case OptionKind::bytes: {
      const char* pattern = "^ *([0-9]+\\.?[0-9]*|\\.[0-9]+) *({})$";
      return {{"anyOf",
               {number_schema(type.range, "number"),
                {{"type", "string"}, {"pattern", fmt::format(fmt::runtime(pattern), fmt::join(bytes, "|"))}}}}};
    }
    case OptionKind::share: return text_schema({"%"}, false);
    case OptionKind::boolean: return {{"type", "boolean"}};
    case OptionKind::text: {
      SceneJson schema{{"type", "string"}};
      if (type.least > 0) schema["minLength"] = type.least;
      return schema;
    }
    case OptionKind::choice: return {{"enum", type.all_names()}};
    case OptionKind::numbers: return numbers_schema(type);
    case OptionKind::array:
      return {{"type", "array"},
              {"items", schema_of(type.parts.front())},
              {"minItems", type.least},
              {"maxItems", type.most}};
    case OptionKind::object: return {{"$ref", "#/definitions/" + definition_name(type.word)}};
    case OptionKind::any: break;
  }
  return any_schema(type);
}

/// What a type is, in words: "A number in m/s above 0, or a text with one of the units m/s, cm/s, mm/s".
std::string words_for(const OptionType& type) {
  if (!type.said.empty() || type.kind != OptionKind::quantity || type.dimension == Dimension::ratio)
    return type.accepted();
  const std::string units = accepted_units(type.dimension);
  const bool ranged = std::isfinite(type.range.low) || std::isfinite(type.range.high);
  return fmt::format("a number in {}{}, or a text with one of the units {}{}", units.substr(0, units.find(',')),
                     ranged ? " " + type.range.text() : "", units, type.share ? ", or a share (\"10 %\")" : "");
}

/// A condition in words: "`type` is circle, spiral", "no `normal_force`".
std::string words_for(const OptionTest& test) {
  const auto each = [&](const char* between) {
    std::string list;
    for (const OptionTest& part : test.of) list += (list.empty() ? "" : between) + words_for(part);
    return list;
  };
  switch (test.kind) {
    case OptionTest::Kind::given: return fmt::format("`{}`", test.path);
    case OptionTest::Kind::is: return fmt::format("`{}` {}", test.path, fmt::join(test.names, ", "));
    case OptionTest::Kind::an_object: return fmt::format("`{}` as an object", test.path);
    case OptionTest::Kind::filled: return fmt::format("entries in `{}`", test.path);
    case OptionTest::Kind::all: return each(" and ");
    case OptionTest::Kind::any: return test.of.empty() ? "nothing" : each(" or ");
    case OptionTest::Kind::none: break;
  }
  return "no " + each(", no ");
}

/// When a row is read, and when it has to be there.
std::string conditions_of(const Option& row) {
  std::string text;
  for (const OptionTest& test : row.only) text += (text.empty() ? " With " : "; ") + words_for(test);
  if (!text.empty()) text += ".";
  const std::string when = row.required ? words_for(*row.required) : "";
  if (row.required) text += when.empty() ? " Has to be there." : " Has to be there with " + when + ".";
  return text;
}

std::string description_of(const Option& row) {
  std::string text = row.help + conditions_of(row);
  const OptionKind kind = row.type.kind;
  std::string type = kind == OptionKind::quantity || kind == OptionKind::array ? words_for(row.type) : std::string();
  if (!type.empty()) type[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(type[0])));
  if (!type.empty()) text += fmt::format(" {}.", type);
  if (!row.otherwise.empty()) text += fmt::format(" Default: {}.", row.otherwise);
  if (!row.contents.empty()) text += fmt::format(" Refused when it is read: {}.", row.contents);
  return text;
}

/// The rows of one key as one property: several of them are told apart by their conditions.
SceneJson property_of(const std::vector<const Option*>& rows) {
  std::string text;
  SceneJson parts = SceneJson::array();
  for (const Option* row : rows) {
    text += (text.empty() ? "" : " ") + description_of(*row);
    SceneJson schema = schema_of(row->type);
    if (std::find(parts.begin(), parts.end(), schema) == parts.end()) parts.push_back(std::move(schema));
  }
  SceneJson property{{"description", text}};
  // In draft 7 what stands beside a reference is ignored.
  property.update(parts.size() == 1 && !parts.front().contains("$ref") ? parts.front() : SceneJson{{"anyOf", parts}});
  if (rows.size() == 1 && rows.front()->otherwise.empty() && rows.front()->fallback.index() != 0)
    property["default"] = json_of(rows.front()->fallback);
  return property;
}

std::vector<const Option*> rows_of(const SceneObject& object, const std::string& key) {
  std::vector<const Option*> rows;
  for (const Option& row : object.rows) {
    if (row.key == key) rows.push_back(&row);
  }
  return rows;
}

/// The conditions of one key.
void add_conditions(SceneJson& schema, const SceneObject& object, const std::string& key) {
  SceneJson& all = schema["allOf"];
  const std::vector<const Option*> rows = rows_of(object, key);
  SceneJson some = SceneJson::array();
  std::vector<OptionTest> earlier;
  for (const Option* row : rows) {
    OptionTest holds_here = OptionTest::all(row->only);
    if (!row->only.empty()) some.push_back(all_of(row->only, object));
    // The first row whose conditions hold is in force.
    std::vector<OptionTest> in_force{holds_here};
    if (!earlier.empty()) in_force.push_back(OptionTest::none(earlier));
    earlier.push_back(holds_here);
    if (rows.size() > 1)
      all.push_back({{"if", all_of(in_force, object)}, {"then", {{"properties", {{key, schema_of(row->type)}}}}}});
    if (!row->required) continue;
    if (rows.size() > 1 || row->required->kind != OptionTest::Kind::all || !row->required->of.empty()) {
      in_force.push_back(*row->required);
      all.push_back({{"if", all_of(in_force, object)}, {"then", required_key(key)}});
    } else {
      schema["required"].push_back(key);
    }
  }
  if (some.size() == rows.size())
    schema["dependencies"][key] = some.size() == 1 ? some.front() : SceneJson{{"anyOf", some}};
}

SceneJson schema_of(const SceneObject& object) {
  SceneJson schema{{"description", object.help}, {"type", "object"}, {"additionalProperties", false}};
  schema["required"] = SceneJson::array();
  schema["properties"] = SceneJson::object();
  schema["dependencies"] = SceneJson::object();
  schema["allOf"] = SceneJson::array();
  for (const std::string& key : object.keys()) {
    schema["properties"][key] = property_of(rows_of(object, key));
    add_conditions(schema, object, key);
  }
  for (const char* part : {"required", "dependencies", "allOf"}) {
    if (schema[part].empty()) schema.erase(part);
  }
  return schema;
}

/// Every object that a type leads to.
void reach(const OptionType& type, std::set<std::string>& reached) {
  for (const OptionType& part : type.parts) reach(part, reached);
  if (type.kind != OptionKind::object || !reached.insert(type.word).second) return;
  for (const Option& row : scene_object(type.word).rows) reach(row.type, reached);
}

std::string default_words(const Option& row) {
  if (!row.otherwise.empty()) return row.otherwise;
  return row.fallback.index() == 0 ? std::string() : json_of(row.fallback).dump();
}

/// What a row takes, in a table's cell.
std::string type_words(const OptionType& type) {
  if (type.kind == OptionKind::object) return fmt::format("[{}](#{})", type.word, definition_name(type.word));
  if (type.kind != OptionKind::any) return words_for(type);
  std::string list;
  for (const OptionType& part : type.parts) {
    if (part.kind != OptionKind::numbers || part.more_names == nullptr)
      list += (list.empty() ? "" : "; ") + type_words(part);
  }
  return list;
}

/// One row as a line of text: "| `speed` | a number ... | default | help |".
std::string line_of(const Option& row) {
  std::string help = row.help + conditions_of(row);
  if (!row.contents.empty()) help += fmt::format(" *Refused when it is read: {}.*", row.contents);
  return fmt::format("| `{}` | {} | {} | {} |\n", row.key, type_words(row.type), default_words(row), help);
}

}  // namespace

std::string scene_schema_json() {
  std::set<std::string> reached;
  reach(OptionType::object("scene"), reached);
  SceneJson schema{{"$schema", "http://json-schema.org/draft-07/schema#"},
                   {"$id", "scene.schema.json"},
                   {"title", "Asperity scene"}};
  schema.update(schema_of(scene_table().front()));
  for (const SceneObject& object : scene_table()) {
    if (object.name != "scene" && reached.count(object.name) != 0)
      schema["definitions"][definition_name(object.name)] = schema_of(object);
  }
  return schema.dump(1) + "\n";
}

std::string scene_page() {
  std::string page =
      "# Keys of scene files\n\nMade by `asperity schema --page` from the table that scenes are read by. `asperity "
      "schema "
      "stroke.speed` says the same of one key.\n\nQuantities are numbers in SI or texts with a unit. A key that is not "
      "listed is refused, and so is one whose condition does not hold (\"is not read ...\"). What the schema cannot "
      "know, "
      "because it depends on files or on what the numbers make, is marked as refused when it is read; so are texts "
      "with a "
      "unit whose number is out of range.\n";
  for (const SceneObject& object : scene_table()) {
    page += fmt::format("\n<a id=\"{}\"></a>\n## {}\n\n{}\n\n| key | takes | default | |\n|---|---|---|---|\n",
                        definition_name(object.name), object.name, object.help);
    for (const Option& row : object.rows) page += line_of(row);
  }
  return page;
}

Result<std::string> scene_key_help(std::string_view path) {
  std::string text;
  for (const Option* row : rows_at(path)) {
    const std::string fallback = default_words(*row);
    text += fmt::format("{}\n  {}\n  takes: {}\n{}{}", row->key, row->help + conditions_of(*row), row->type.accepted(),
                        fallback.empty() ? "" : fmt::format("  default: {}\n", fallback),
                        row->contents.empty() ? "" : fmt::format("  refused when it is read: {}\n", row->contents));
  }
  for (const SceneObject& object : scene_table()) {
    if (object.name == path) text += fmt::format("{}\n  keys: {}\n", object.help, fmt::join(object.keys(), ", "));
  }
  if (!text.empty()) return text;
  std::vector<std::string> known;
  for (const SceneObject& object : scene_table()) {
    known.push_back(object.name);
    for (const std::string& key : object.keys()) known.push_back(object.name + "." + key);
  }
  const std::string near = nearest_name(path, known);
  return bad_value(fmt::format("\"{}\" is no key of a scene{}", path,
                               near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near)),
                   "", "a path of keys (stroke.speed), or a kind of object and its key (coat.height)");
}

}  // namespace asperity
