#pragma once
// The table of scene keys: every kind of object that a scene file may hold, and each of its keys as a row. Reader,
// refusals, canonical copy, schema, help and reference page are made from it. Internal to io.

#include <concepts>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <typeindex>
#include <utility>
#include <vector>

#include "asperity/core/option.h"
#include "asperity/core/result.h"

namespace asperity {

using SceneJson = nlohmann::ordered_json;

/// A kind of object, and its keys in the order in which they are told.
struct SceneObject {
  std::string name;  ///< "scene", "surface", "coat"
  std::string help;
  std::vector<Option> rows = {};

  /// Adds a row; `more` is a member that it is bound to, and whatever else takes an Option& and tells it something.
  template <class... More>
  Option& operator()(std::string key, OptionType type, std::string help_line, const More&... more) {
    Option& row = rows.emplace_back(Option{std::move(key), std::move(type), std::move(help_line)});
    (tell(row, more), ...);
    return row;
  }
  /// Binds it. [any]
  template <class S, class T>
  static void tell(Option& row, T S::*const& member) {
    row.of(member);
  }
  /// Tells it more. [any]
  static void tell(Option& row, const std::invocable<Option&> auto& more) { more(row); }
  /// Each key once. [any]
  [[nodiscard]] std::vector<std::string> keys() const;
  /// The row of `key` that is in force in `json`: the first whose conditions hold there. Where none does, the first of
  /// that key; nullptr for no key. [any]
  [[nodiscard]] const Option* row(std::string_view key, const SceneJson& json) const;
  /// Whether the conditions of a row hold in `json`. [any]
  [[nodiscard]] bool reads(const Option& row, const SceneJson& json) const;
  /// Rows that are bound to `settings` and hold in `json`, with what the settings hold. [any]
  [[nodiscard]] std::vector<std::pair<const Option*, OptionValue>> bound(std::type_index type, const void* settings,
                                                                         const SceneJson& json) const;
};

/// All of them, the scene first. [any]
const std::vector<SceneObject>& scene_table();
/// The one of that name, which is in the table. [any]
const SceneObject& scene_object(std::string_view name);

/// The rows that a path of keys leads to ("surfaces[0].coat.height", "coat.height"), from the scene or from a kind of
/// object; none where there is no such key. [any]
std::vector<const Option*> rows_at(std::string_view path);
/// Whether the table marks what stands at `place`, or the nearest key around it, as refused by contents or files. [any]
bool refused_by_contents(std::string_view place);

/// Whether a condition holds in an object. [any]
bool holds(const OptionTest& test, const SceneJson& json, const SceneObject& object);
/// Whether `json`, which stands at `place`, has the structure of `object`: keys, conditions, types, ranges, all the way
/// down. What depends on contents or files is not looked at. Errors: bad_type, bad_key, bad_value. [any]
Status check_structure(const SceneJson& json, const std::string& place, const SceneObject& object);
/// A number, or a text with any unit there is; nothing for anything else. [any]
std::optional<double> number_in_any_unit(const SceneJson& json);
/// A value of that type, which it is known to have. [any]
OptionValue value_of(const SceneJson& json, const OptionType& type);
/// As it is written. [any]
SceneJson json_of(const OptionValue& value);

}  // namespace asperity
