#include "asperity/io/scene_edit_json.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace asperity {
namespace {

using EditJson = nlohmann::json;

}  // namespace

std::string to_json(const SceneEdit& edit) {
  EditJson json{{"kind", to_string(edit.kind)}};
  if (!edit.instance.empty()) json["instance"] = edit.instance;
  if (edit.kind == SceneEditKind::law) {
    json["law"] = edit.law;
  } else {
    json["value"] = edit.value;
  }
  return json.dump(-1, ' ', false, EditJson::error_handler_t::replace);
}

Result<SceneEdit> parse_scene_edit(std::string_view text) {
  const EditJson json = EditJson::parse(text.begin(), text.end(), nullptr, false);
  if (!json.is_object()) return refused(ErrorCode::file_malformed, "is no JSON object", {}, to_json(SceneEdit{}));
  const auto text_at = [&](const char* key) -> Result<std::string> {
    const auto it = json.find(key);
    if (it == json.end()) return std::string();
    if (!it->is_string()) return refused(ErrorCode::bad_type, "is " + it->dump(), key, "a text");
    return it->get<std::string>();
  };
  SceneEdit edit;
  ASPERITY_TRY(const std::string kind, text_at("kind"));
  const std::optional<SceneEditKind> known = value_named<SceneEditKind>(kind);
  if (!known) return bad_value(fmt::format("is \"{}\"", kind), "kind", name_list<SceneEditKind>());
  edit.kind = *known;
  ASPERITY_TRY(edit.instance, text_at("instance"));
  const bool of_law = edit.kind == SceneEditKind::law;
  ASPERITY_TRY(edit.law, text_at("law"));
  const auto value = json.find("value");
  if (of_law && edit.law.empty()) return refused(ErrorCode::bad_type, "names no law", "law", "the name of a law");
  if (!of_law) {
    if (value == json.end() || !value->is_number())
      return refused(ErrorCode::bad_type, "is no number", "value", "a number (SI)");
    edit.value = value->get<double>();
  }
  const std::size_t known_keys = 2U + json.count("instance");
  if (json.size() != known_keys || json.contains(of_law ? "value" : "law"))
    return refused(ErrorCode::bad_key, "holds keys that nobody reads", {}, to_json(edit));
  return edit;
}

}  // namespace asperity
