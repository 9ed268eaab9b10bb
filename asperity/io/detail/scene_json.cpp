#include "asperity/io/detail/scene_json.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <set>

#include "asperity/core/suggest.h"
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

const std::vector<std::string>& keys_of(std::string_view object) {
  static const std::vector<std::string> none;
  const auto& objects = scene_object_keys();
  const auto found =
      std::find_if(objects.begin(), objects.end(), [&](const auto& one) { return one.object == object; });
  return found == objects.end() ? none : found->keys;
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

bool are_numbers(const SceneJson& value, std::size_t count) {
  return value.is_array() && value.size() == count &&
         std::all_of(value.begin(), value.end(), [](const SceneJson& one) { return one.is_number(); });
}

std::string Range::text() const {
  if (std::isfinite(low) && std::isfinite(high))
    return fmt::format("{}{:.4g} to {:.4g}", above_low ? "above " : "", low, high);
  if (std::isfinite(low)) return above_low ? fmt::format("above {:.4g}", low) : fmt::format("{:.4g} or more", low);
  if (std::isfinite(high)) return fmt::format("{:.4g} or less", high);
  return "of any size";
}

ObjectReader::ObjectReader(const SceneJson& json, std::string place, std::string_view object)
    : ObjectReader(json, std::move(place), object, keys_of(object)) {}

ObjectReader::ObjectReader(const SceneJson* json, std::string place, std::string_view object)
    : ObjectReader(json == nullptr ? empty_object() : *json, std::move(place), object) {}

ObjectReader::ObjectReader(const SceneJson& json, std::string place, std::string_view object,
                           const std::vector<std::string>& known)
    : json_(&json), known_(&known), place_(std::move(place)) {
  if (!json.is_object()) {
    error_ = refused(ErrorCode::bad_type, fmt::format("is {}", json_type(json)), place_, "an object");
    return;
  }
  for (const auto& item : json.items()) {
    if (std::find(known.begin(), known.end(), item.key()) != known.end()) continue;
    const std::string near = nearest_name(item.key(), known);
    const bool vowel = object.find_first_of("aeiou") == 0;
    std::string what = std::string(vowel ? "is not a key of an " : "is not a key of a ") + std::string(object);
    if (!near.empty()) what += fmt::format("; did you mean \"{}\"?", near);
    fail(item.key(), std::move(what), fmt::format("{}", fmt::join(known, ", ")), ErrorCode::bad_key);
    return;
  }
}

std::string ObjectReader::place_of(std::string_view key) const {
  return place_.empty() ? std::string(key) : fmt::format("{}.{}", place_, key);
}

std::string ObjectReader::place_of(std::string_view key, std::size_t index) const {
  return fmt::format("{}[{}]", place_of(key), index);
}

const SceneJson* ObjectReader::raw(std::string_view key) const {
  if (!json_->is_object()) return nullptr;
  const auto found = json_->find(key);
  return found == json_->end() ? nullptr : &*found;
}

void ObjectReader::fail(Error error) {
  if (!error_) error_ = std::move(error);
}

void ObjectReader::fail(std::string_view key, std::string what, std::string accepted, ErrorCode code) {
  fail(Error{code, std::move(what), {}, key.empty() ? place_ : place_of(key), std::move(accepted)});
}

void ObjectReader::fail_type(std::string_view key, const SceneJson& value, std::string accepted) {
  fail(key, fmt::format("is {}", json_type(value)), std::move(accepted), ErrorCode::bad_type);
}

void ObjectReader::require(std::string_view key, std::string accepted) {
  if (!has(key)) fail(key, "is missing", std::move(accepted));
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

double ObjectReader::value_of(const SceneJson& value, const std::string& place, Dimension dimension,
                              const Range& range) {
  const std::string units = accepted_units(dimension);
  const std::string accepted = fmt::format("a number {}{}", range.text(), units.empty() ? "" : " (" + units + ")");
  double number = 0.0;
  if (value.is_number()) {
    number = value.get<double>();
  } else if (value.is_string()) {
    number = value_or(at_place(parse_quantity(value.get_ref<const std::string&>(), dimension), place), 0.0);
  } else {
    fail(refused(ErrorCode::bad_type, fmt::format("is {}", json_type(value)), place, accepted));
  }
  if (!std::isfinite(number) || !range.holds(number)) {
    fail(bad_value(fmt::format("is {:.6g}", number), place, accepted));
  }
  return number;
}

double ObjectReader::quantity(std::string_view key, Dimension dimension, double fallback, const Range& range) {
  const SceneJson* value = raw(key);
  const double answer = value == nullptr ? fallback : value_of(*value, place_of(key), dimension, range);
  write(key, answer);
  return failed() ? fallback : answer;
}

std::optional<double> ObjectReader::optional_quantity(std::string_view key, Dimension dimension, const Range& range) {
  if (!has(key)) return std::nullopt;
  return quantity(key, dimension, 0.0, range);
}

double ObjectReader::number(std::string_view key, double fallback, const Range& range) {
  const SceneJson* value = raw(key);
  if (value != nullptr && !value->is_number()) {
    fail_type(key, *value, fmt::format("a number {}", range.text()));
    return fallback;
  }
  return quantity(key, Dimension::ratio, fallback, range);
}

int ObjectReader::integer(std::string_view key, int fallback, int low, int high) {
  const SceneJson* value = raw(key);
  const std::string accepted = fmt::format("a whole number, {} to {}", low, high);
  int answer = fallback;
  if (value != nullptr && !value->is_number()) {
    fail_type(key, *value, accepted);
  } else if (value != nullptr) {
    const double number = value->get<double>();
    if (number >= low && number <= high && number == std::floor(number)) {
      answer = static_cast<int>(number);
    } else {
      fail(key, fmt::format("is {}", number), accepted);
    }
  }
  write(key, answer);
  return answer;
}

std::uint64_t ObjectReader::seed(std::string_view key, std::uint64_t fallback) {
  const SceneJson* value = raw(key);
  const char* accepted = "a whole number, 0 or more";
  if (value != nullptr && value->is_number() && !value->is_number_unsigned())
    fail(key, fmt::format("is {}", value->get<double>()), accepted);
  return plain(key, fallback, &SceneJson::is_number_unsigned, accepted);
}

template <class T>
T ObjectReader::plain(std::string_view key, T fallback, bool (SceneJson::*is)() const noexcept, const char* accepted) {
  const SceneJson* value = raw(key);
  if (value != nullptr && (value->*is)()) {
    fallback = value->get<T>();
  } else if (value != nullptr) {
    fail_type(key, *value, accepted);
  }
  write(key, fallback);
  return fallback;
}

bool ObjectReader::boolean(std::string_view key, bool fallback) {
  return plain(key, fallback, &SceneJson::is_boolean, "true or false");
}

std::string ObjectReader::text(std::string_view key, std::string fallback) {
  return plain(key, std::move(fallback), &SceneJson::is_string, "a text");
}

std::string ObjectReader::required_text(std::string_view key, std::string accepted) {
  std::string given = text(key, "");
  if (given.empty()) fail(key, "is missing", std::move(accepted));
  return given;
}

std::size_t ObjectReader::choice(std::string_view key, std::span<const std::string> names, std::size_t fallback) {
  const std::string list = fmt::format("\"{}\"", fmt::join(names, "\", \""));
  const SceneJson* value = raw(key);
  std::size_t answer = fallback;
  if (value != nullptr && !value->is_string()) {
    fail_type(key, *value, list);
  } else if (value != nullptr) {
    const auto& given = value->get_ref<const std::string&>();
    const auto found = std::find(names.begin(), names.end(), given);
    if (found != names.end()) {
      answer = static_cast<std::size_t>(found - names.begin());
    } else {
      const std::string near = nearest_name(given, names);
      fail(key,
           fmt::format("\"{}\" is not known{}", given, near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near)),
           list);
    }
  }
  write(key, names[answer]);
  return answer;
}

template <class Vector>
Vector ObjectReader::values_of(const SceneJson& values, std::string_view key, Dimension dimension, const Range& range) {
  Vector answer;
  for (std::size_t i = 0; i < values.size(); ++i)
    answer[static_cast<int>(i)] = value_of(values[i], place_of(key, i), dimension, range);
  return answer;
}

Vec3 ObjectReader::lengths(std::string_view key, const Vec3& fallback) {
  const char* accepted = "three lengths [x, y, z] (m, or with a unit)";
  const SceneJson* value = raw(key);
  Vec3 answer = fallback;
  if (value != nullptr && !value->is_array()) {
    fail_type(key, *value, accepted);
  } else if (value != nullptr && value->size() != 3) {
    fail(key, fmt::format("has {} numbers", value->size()), accepted);
  } else if (value != nullptr) {
    answer = values_of<Vec3>(*value, key, Dimension::length, {});
  }
  write(key, answer);
  return answer;
}

Vec2 ObjectReader::pair(std::string_view key, Dimension dimension, const Vec2& fallback, const Range& range) {
  const SceneJson* value = raw(key);
  Vec2 answer = fallback;
  if (value != nullptr && !value->is_array()) {
    answer = Vec2::Constant(value_of(*value, place_of(key), dimension, range));
  } else if (value != nullptr && value->size() != 2) {
    const char* what = dimension == Dimension::length ? "length" : "number";
    fail(key, fmt::format("has {} {}s", value->size(), what), fmt::format("one {}, or two [along u, along v]", what));
  } else if (value != nullptr) {
    answer = values_of<Vec2>(*value, key, dimension, range);
  }
  write(key, answer);
  return failed() ? fallback : answer;
}

Vec3 ObjectReader::vector(std::string_view key, Dimension dimension, const Vec3& fallback, double most) {
  const SceneJson* value = raw(key);
  Vec3 answer = fallback;
  if (value != nullptr && (!value->is_array() || value->size() != 3)) {
    fail_type(key, *value, "three quantities [x, y, z]");
  } else if (value != nullptr) {
    answer = values_of<Vec3>(*value, key, dimension, Range{-most, most});
  }
  write(key, answer);
  return failed() ? fallback : answer;
}

Vec3 ObjectReader::direction(std::string_view key, const Vec3& fallback) {
  const SceneJson* value = raw(key);
  Vec3 answer = fallback;
  if (value != nullptr && !are_numbers(*value, 3)) {
    fail_type(key, *value, "three numbers [x, y, z]");
  } else if (value != nullptr) {
    for (std::size_t i = 0; i < 3; ++i) answer[static_cast<int>(i)] = (*value)[i].get<double>();
    if (!answer.allFinite() || answer.norm() < 1e-150)
      fail(key, "has no direction", "three numbers that are not all 0");
  }
  write(key, answer);
  return answer;
}

}  // namespace asperity
