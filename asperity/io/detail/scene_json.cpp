#include "asperity/io/detail/scene_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <set>

#include "asperity/io/detail/file_reading.h"

namespace asperity {
namespace {

constexpr std::size_t largest_scene_file = std::size_t{16} << 20U;

std::string line_and_column(std::string_view text, std::size_t byte) {
  const std::string_view before = text.substr(0, std::min(byte, text.size()));
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const std::size_t start = before.rfind('\n');
  const std::size_t column = before.size() - (start == std::string_view::npos ? 0 : start + 1) + 1;
  return fmt::format("line {}, column {}", line, column);
}

Error malformed_json(std::string what, const std::string& name, std::string place, std::string accepted = "JSON") {
  return Error{ErrorCode::file_malformed, std::move(what), name, std::move(place), std::move(accepted)};
}

/// The library keeps the last of two equal keys without a word; this finds them.
class DuplicateKeys {
 public:
  bool operator()(int depth, SceneJson::parse_event_t event, SceneJson& parsed) {
    const auto level = static_cast<std::size_t>(depth);
    if (event == SceneJson::parse_event_t::object_start) {
      seen_.resize(level + 1);
      seen_[level].clear();
    } else if (event == SceneJson::parse_event_t::key && level >= 1 && level <= seen_.size()) {
      const auto* key = parsed.get_ptr<const std::string*>();
      if (key != nullptr && !seen_[level - 1].insert(*key).second && first_.empty()) first_ = *key;
    }
    return true;
  }
  [[nodiscard]] const std::string& first() const { return first_; }

 private:
  std::vector<std::set<std::string>> seen_;
  std::string first_;
};

/// The library's message without its prefix "[json.exception...] parse error at line 1, column 2: ".
std::string short_message(std::string message) {
  for (const char* mark : {"] ", ": "}) {
    const std::size_t found = message.find(mark);
    if (found != std::string::npos) message.erase(0, found + 2);
  }
  return message;
}

const SceneJson& empty_object() {
  static const SceneJson empty = SceneJson::object();
  return empty;
}

}  // namespace

Result<SceneJson> parse_scene_json(std::string_view text, const std::string& name) {
  if (text.size() > largest_scene_file) {
    return refused_file(ErrorCode::too_large, fmt::format("has {} bytes", text.size()), name,
                        "a scene of at most 16 MiB");
  }
  if (text.find_first_not_of(" \t\r\n") == std::string_view::npos) {
    return refused_file(ErrorCode::file_empty, "is empty", name, "a scene in JSON");
  }
  DuplicateKeys duplicates;
  try {
    SceneJson json = SceneJson::parse(text.begin(), text.end(), std::ref(duplicates));
    if (!duplicates.first().empty()) {
      return malformed_json(fmt::format("the key \"{}\" is given twice in one object", duplicates.first()), name, {},
                            "each key once");
    }
    return json;
  } catch (const SceneJson::parse_error& failure) {
    const std::size_t byte = failure.byte > 0 ? failure.byte - 1 : 0;
    return malformed_json("is not JSON: " + short_message(failure.what()), name, line_and_column(text, byte));
  } catch (const std::exception& failure) {
    return malformed_json("is not JSON: " + short_message(failure.what()), name, {});
  }
}

const char* json_type(const SceneJson& value) {
  switch (value.type()) {
    case SceneJson::value_t::object: return "an object";
    case SceneJson::value_t::array: return "an array";
    case SceneJson::value_t::string: return "a string";
    case SceneJson::value_t::boolean: return "a boolean";
    case SceneJson::value_t::number_integer:
    case SceneJson::value_t::number_unsigned:
    case SceneJson::value_t::number_float: return "a number";
    case SceneJson::value_t::null: return "null";
    case SceneJson::value_t::binary:
    case SceneJson::value_t::discarded: break;
  }
  return "no value";
}

ObjectReader::ObjectReader(const SceneJson* json, std::string place, std::string_view object)
    : ObjectReader(json == nullptr ? empty_object() : *json, std::move(place), scene_object(object)) {}

ObjectReader::ObjectReader(const SceneJson& json, std::string place, const SceneObject& object)
    : json_(&json), object_(&object), place_(std::move(place)) {
  if (Status good = check_structure(json, place_, object); !good) error_ = std::move(good).error();
}

std::string ObjectReader::place_of(std::string_view key) const {
  return place_.empty() ? std::string(key) : fmt::format("{}.{}", place_, key);
}

std::string ObjectReader::place_of(std::string_view key, std::size_t index) const {
  return fmt::format("{}[{}]", place_of(key), index);
}

const SceneJson* ObjectReader::raw(std::string_view key) const {
  if (failed()) return nullptr;
  const auto found = json_->find(key);
  return found == json_->end() ? nullptr : &*found;
}

bool ObjectReader::reads(std::string_view key) const {
  return !failed() && object_->reads(*object_->row(key, *json_), *json_);
}

OptionValue ObjectReader::value_at(std::string_view key, const SceneJson& value) {
  const OptionType& type = object_->row(key, *json_)->type;
  OptionValue answer = value_of(value, type);
  if (type.is_direction()) {
    const Vec3 direction = from_option<Vec3>(answer);
    if (!direction.allFinite() || direction.norm() < 1e-150)
      fail(key, "has no direction", "three numbers that are not all 0");
  }
  return answer;
}

void ObjectReader::read_bound(std::type_index settings, void* into, bool given) {
  for (const Option& row : object_->rows) {
    if (failed() || row.settings != settings || object_->row(row.key, *json_) != &row || !reads(row.key)) continue;
    const SceneJson* value = raw(row.key);
    if (value != nullptr && value->is_object()) continue;
    if (value != nullptr) row.set(into, value_at(row.key, *value));
    if (value == nullptr && row.otherwise.empty()) row.set(into, row.fallback);
    if (value == nullptr && given) continue;
    if (const OptionValue held = row.get(into); row.type.takes(held)) write(row.key, json_of(held));
  }
}

void ObjectReader::fail(Error error) {
  if (!error_) error_ = std::move(error);
}

void ObjectReader::fail(std::string_view key, std::string what, std::string accepted, ErrorCode code) {
  fail(Error{code, std::move(what), {}, key.empty() ? place_ : place_of(key), std::move(accepted)});
}

void ObjectReader::refuse(std::initializer_list<std::string_view> keys, const std::string& why) {
  for (const std::string_view key : keys) {
    if (has(key)) fail(key, "is not read " + why, "no such key here", ErrorCode::bad_key);
  }
}

void ObjectReader::take(std::string_view key, ObjectReader&& child) {
  if (child.error_) {
    fail(std::move(*child.error_));
  } else {
    write(key, std::move(child.canonical_));
  }
}

void write_bound(SceneJson& json, const SceneObject& object, std::type_index type, const void* settings) {
  for (const auto& [row, value] : object.bound(type, settings, json)) json[row->key] = json_of(value);
}

}  // namespace asperity
