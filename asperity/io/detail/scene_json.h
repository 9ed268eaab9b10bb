#pragma once
// Scene files are read through this: an object's structure is checked by its table before anything is asked of it, what
// was decided is written into a canonical copy, and the first thing that is wrong is kept as the error. Internal to io.

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "asperity/core/math.h"
#include "asperity/core/result.h"
#include "asperity/io/detail/scene_table.h"

namespace asperity {

/// Parses JSON text of at most 16 MiB. Errors: file_empty, file_malformed with "line 3, column 7" as place (a syntax
/// error, or a key given twice), too_large. [build]
Result<SceneJson> parse_scene_json(std::string_view text, const std::string& name);

/// "a string", "an object": a JSON type as messages say it. [any]
const char* json_type(const SceneJson& value);

/// Reads one JSON object. Getters answer the fallback once something is wrong, and `status` tells what. [build]
class ObjectReader {
 public:
  /// `object` names an entry of the table; the structure of `json` is checked, all the way down.
  ObjectReader(const SceneJson& json, std::string place, std::string_view object)
      : ObjectReader(json, std::move(place), scene_object(object)) {}
  /// The same; nullptr: an object without keys.
  ObjectReader(const SceneJson* json, std::string place, std::string_view object);
  /// The same for an object of another kind of file, whose rows outlive the reader.
  ObjectReader(const SceneJson& json, std::string place, const SceneObject& object);

  /// Whether there is such a key, and nothing is wrong yet.
  [[nodiscard]] bool has(std::string_view key) const { return raw(key) != nullptr; }
  [[nodiscard]] const std::string& place() const { return place_; }
  [[nodiscard]] std::string place_of(std::string_view key) const;
  /// Of the entry `index` of an array.
  [[nodiscard]] std::string place_of(std::string_view key, std::size_t index) const;
  [[nodiscard]] bool failed() const { return error_.has_value(); }
  /// The value as it stands, or nullptr.
  [[nodiscard]] const SceneJson* raw(std::string_view key) const;
  /// Whether the conditions of a row of that key hold.
  [[nodiscard]] bool reads(std::string_view key) const;

  /// What a key says, or `fallback`; written into the canonical copy.
  template <class T>
  T get(std::string_view key, T fallback) {
    if (const SceneJson* value = raw(key)) fallback = from_option<T>(value_at(key, *value));
    write(key, json_of(to_option(fallback)));
    return fallback;
  }
  /// The same with the row's own default, where it has one.
  template <class T>
  T get(std::string_view key) {
    const OptionValue& own = object_->row(key, *json_)->fallback;
    return get(key, own.index() == 0 ? T{} : from_option<T>(own));
  }
  /// Nothing, and nothing written, where the key is absent.
  template <class T>
  std::optional<T> find(std::string_view key) {
    if (!has(key)) return std::nullopt;
    return get(key, T{});
  }
  /// Into a setting that holds its default, where the conditions of the row hold.
  template <class T>
  void read(std::string_view key, T& setting) {
    if (reads(key)) setting = get(key, setting);
  }
  /// Every row that is bound to a member of S and whose conditions hold. Where a key is absent the row's default
  /// counts; where that is no one value, what the setting holds. `given`: what is not given is not written.
  template <class S>
  void read_all(S& settings, bool given = false) {
    read_bound(typeid(S), &settings, given);
  }
  /// The same where the type is known at run time.
  void read_bound(std::type_index type, void* settings, bool given = false);

  /// Writes the value that was decided for `key` into the canonical copy.
  void write(std::string_view key, SceneJson value) { canonical_[std::string(key)] = std::move(value); }
  void write(std::string_view key, const Vec2& value) { write(key, json_of(to_option(value))); }
  void write(std::string_view key, const Vec3& value) { write(key, json_of(to_option(value))); }
  /// Keeps the first error only.
  void fail(std::string_view key, std::string what, std::string accepted, ErrorCode code = ErrorCode::bad_value);
  void fail(Error error);
  /// The value; or `fallback`, and the error is kept.
  template <class T>
  T value_or(Result<T> result, T fallback) {
    if (result) return std::move(result).value();
    fail(std::move(result).error());
    return fallback;
  }
  /// Refuses `keys` that contents or files leave to nobody; `why` completes "is not read ...".
  void refuse(std::initializer_list<std::string_view> keys, const std::string& why);
  /// A sub-object that was read: its error, or its canonical copy under `key`.
  void take(std::string_view key, ObjectReader&& child);

  [[nodiscard]] const std::optional<Error>& error() const { return error_; }
  [[nodiscard]] Status status() const { return error_ ? Status(*error_) : success(); }
  [[nodiscard]] SceneJson& canonical() { return canonical_; }

 private:
  OptionValue value_at(std::string_view key, const SceneJson& value);

  const SceneJson* json_;
  const SceneObject* object_;
  std::string place_;
  std::optional<Error> error_;
  SceneJson canonical_ = SceneJson::object();
};

/// The settings whose rows hold in `json`, as they stand in a canonical copy, added to it. What a row would not take
/// stands for nothing, and is not written. [any]
void write_bound(SceneJson& json, const SceneObject& object, std::type_index type, const void* settings);
/// The same. [any]
template <class S>
void write_settings(SceneJson& json, const SceneObject& object, const S& settings) {
  write_bound(json, object, typeid(S), &settings);
}

}  // namespace asperity
