#pragma once
// Scene files are read through this: every key is asked for with its type, range and default, what was decided is
// written into a canonical copy, and the first thing that is wrong is kept as the error. Internal to io.

#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/math.h"
#include "asperity/core/names.h"
#include "asperity/core/result.h"
#include "asperity/core/units.h"

namespace asperity {

using SceneJson = nlohmann::ordered_json;

/// Parses JSON text of at most 16 MiB. Errors: file_empty, file_malformed with "line 3, column 7" as place (a syntax
/// error, or a key given twice), too_large. [build]
Result<SceneJson> parse_scene_json(std::string_view text, const std::string& name);

/// "a string", "an object": a JSON type as messages say it. [any]
const char* json_type(const SceneJson& value);
/// Whether it is an array of so many numbers. [any]
bool are_numbers(const SceneJson& value, std::size_t count);

/// The kinds of object that a scene file may hold, and the keys of each; the published schema describes the same ones.
/// The keys that the reader knows in one kind of object.
struct SceneObjectKeys {
  std::string_view object;  ///< "scene", "surface", "coat": the name of its definition in the schema
  std::vector<std::string> keys;
};
/// All of them, for the schema's test. [any]
const std::vector<SceneObjectKeys>& scene_object_keys();

/// Interval that a number has to lie in.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool above_low = false;  ///< `low` itself is not allowed

  static constexpr Range positive() { return {0.0, std::numeric_limits<double>::infinity(), true}; }
  static constexpr Range not_negative() { return {0.0, std::numeric_limits<double>::infinity(), false}; }
  [[nodiscard]] bool holds(double value) const { return value <= high && (above_low ? value > low : value >= low); }
  /// "above 0", "0 to 0.333", "of any size"
  [[nodiscard]] std::string text() const;
};

/// Reads one JSON object. Getters answer the fallback once something is wrong; `finish` then tells what. [build]
class ObjectReader {
 public:
  /// `object` names an entry of scene_object_keys(). A `json` that is no object, and an unknown key, are errors.
  ObjectReader(const SceneJson& json, std::string place, std::string_view object);
  /// The same; nullptr: an object without keys.
  ObjectReader(const SceneJson* json, std::string place, std::string_view object);
  /// The same for an object of another kind of file, with the keys that it may have, which outlive the reader.
  ObjectReader(const SceneJson& json, std::string place, std::string_view object,
               const std::vector<std::string>& known);

  [[nodiscard]] bool has(std::string_view key) const { return json_->is_object() && json_->contains(key); }
  [[nodiscard]] const std::string& place() const { return place_; }
  [[nodiscard]] std::string place_of(std::string_view key) const;
  /// Of the entry `index` of an array.
  [[nodiscard]] std::string place_of(std::string_view key, std::size_t index) const;
  [[nodiscard]] bool failed() const { return error_.has_value(); }

  /// A number (SI) or a text with a unit.
  double quantity(std::string_view key, Dimension dimension, double fallback, const Range& range = {});
  /// The same without a fallback: nothing when the key is absent.
  std::optional<double> optional_quantity(std::string_view key, Dimension dimension, const Range& range = {});
  double number(std::string_view key, double fallback, const Range& range = {});
  int integer(std::string_view key, int fallback, int low, int high);
  std::uint64_t seed(std::string_view key, std::uint64_t fallback);
  bool boolean(std::string_view key, bool fallback);
  std::string text(std::string_view key, std::string fallback);
  /// A text that has to be there, and not empty.
  std::string required_text(std::string_view key, std::string accepted);
  /// One of `names`; answers its position, `fallback` when the key is absent.
  std::size_t choice(std::string_view key, std::span<const std::string> names, std::size_t fallback);
  /// One of an enum's names.
  template <HasNames E>
  E choice(std::string_view key, E fallback) {
    return Names<E>::table[choice(key, all_names<E>(), place_of_name(fallback))].value;
  }
  /// One of an enum's names, or "auto": nothing. `fallback` when the key is absent.
  template <HasNames E>
  std::optional<E> choice_or_auto(std::string_view key, std::optional<E> fallback = {}) {
    const std::size_t absent = fallback ? place_of_name(*fallback) + 1 : 0;
    const std::size_t place = choice(key, with_auto(all_names<E>()), absent);
    return place == 0 ? std::nullopt : std::optional<E>(Names<E>::table[place - 1].value);
  }
  /// Three lengths (m, or texts with units).
  Vec3 lengths(std::string_view key, const Vec3& fallback);
  /// One quantity for both, or two (SI, or texts with units).
  Vec2 pair(std::string_view key, Dimension dimension, const Vec2& fallback, const Range& range = {});
  /// Three quantities of a dimension (SI, or texts with units), each of at most `most`; all may be 0.
  Vec3 vector(std::string_view key, Dimension dimension, const Vec3& fallback, double most);
  /// Three plain numbers, not all 0.
  Vec3 direction(std::string_view key, const Vec3& fallback);
  /// The number that `value` is, which stands at `place`: SI, or a text with a unit.
  double value_of(const SceneJson& value, const std::string& place, Dimension dimension, const Range& range);
  /// The value as it stands, or nullptr.
  [[nodiscard]] const SceneJson* raw(std::string_view key) const;

  /// Writes the value that was decided for `key` into the canonical copy.
  void write(std::string_view key, SceneJson value) { canonical_[std::string(key)] = std::move(value); }
  template <int Size>
  void write(std::string_view key, const Eigen::Matrix<double, Size, 1>& vector) {
    write(key, SceneJson(std::vector<double>(vector.begin(), vector.end())));
  }
  /// Keeps the first error only.
  void fail(std::string_view key, std::string what, std::string accepted, ErrorCode code = ErrorCode::bad_value);
  void fail(Error error);
  void fail_type(std::string_view key, const SceneJson& value, std::string accepted);
  /// The value; or `fallback`, and the error is kept.
  template <class T>
  T value_or(Result<T> result, T fallback) {
    if (result) return std::move(result).value();
    fail(std::move(result).error());
    return fallback;
  }
  /// An error where there is no such key.
  void require(std::string_view key, std::string accepted);
  /// Refuses `keys` where they would be read by nobody; `why` completes "is not read ...".
  void refuse(std::initializer_list<std::string_view> keys, const std::string& why);
  /// Refuses every key of this kind of object that `takes` does not answer true for.
  template <class Takes>
  void refuse_unless(const Takes& takes, const std::string& why) {
    for (const std::string& key : *known_) {
      if (!takes(key)) refuse({key}, why);
    }
  }
  /// A sub-object that was read: its error, or its canonical copy under `key`.
  void take(std::string_view key, ObjectReader&& child);

  [[nodiscard]] const std::optional<Error>& error() const { return error_; }
  [[nodiscard]] Status status() const { return error_ ? Status(*error_) : success(); }
  [[nodiscard]] SceneJson& canonical() { return canonical_; }

 private:
  static std::vector<std::string> with_auto(std::vector<std::string> names) {
    names.insert(names.begin(), "auto");
    return names;
  }
  /// The numbers of an array, written under `key`.
  template <class Vector>
  Vector values_of(const SceneJson& values, std::string_view key, Dimension dimension, const Range& range);
  /// What `key` holds, as it stands where it is of the type that `is` asks for.
  template <class T>
  T plain(std::string_view key, T fallback, bool (SceneJson::*is)() const noexcept, const char* accepted);

  const SceneJson* json_;
  const std::vector<std::string>* known_;
  std::string place_;
  std::optional<Error> error_;
  SceneJson canonical_ = SceneJson::object();
};

}  // namespace asperity
