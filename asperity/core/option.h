#pragma once
// What can be told by keys: one row a key, with its type, range, default, the condition under which it is read and one
// line of help. Files are read by tables of such rows, and their schema and reference pages are made from them. Nothing
// here knows of JSON: whoever has settings can tell their rows.
//
//   Option("bandwidth", OptionType::quantity(Dimension::frequency, Range::positive()), "Of the regulator.")
//

#include <concepts>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <typeindex>
#include <variant>
#include <vector>

#include "asperity/core/math.h"
#include "asperity/core/names.h"
#include "asperity/core/units.h"

namespace asperity {

/// Every unit that parse_quantity accepts for a dimension, each way it may be spelled. [any]
std::vector<std::string> unit_names(Dimension dimension);

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

/// A value as rows hold it; nothing where there is none.
using OptionValue =
    std::variant<std::monostate, bool, std::int64_t, std::uint64_t, double, std::string, std::vector<double>>;

/// What a row may hold; whole numbers are kept apart from others.
enum class OptionKind {
  number,    ///< a plain number
  quantity,  ///< a number (SI), or a text with a unit
  integer,   ///< a whole number
  seed,      ///< a whole number, 0 or more, of 64 bits
  boolean,
  text,
  choice,   ///< one of several names
  share,    ///< a text in % of something
  bytes,    ///< a number, or a text with kB, MiB, ...
  numbers,  ///< an object with a name ("type") and any numbers, each SI or with a unit
  array,
  object,  ///< one that has a table of its own
  any,     ///< whichever of its parts fits
};

/// Type and range of a row.
struct OptionType {
  OptionKind kind = OptionKind::text;
  Dimension dimension = Dimension::ratio;  ///< quantity
  Range range = {};                        ///< of a number; of a text with a unit once it is read
  std::size_t least = 0;                   ///< characters of a text, entries of an array
  std::size_t most = std::numeric_limits<std::size_t>::max();
  std::string word = {};                                      ///< object: its table; array: what its entries are
  std::vector<std::string> names = {};                        ///< choice
  const std::vector<std::string>& (*more_names)() = nullptr;  ///< choice, numbers: names that a program adds
  std::vector<OptionType> parts = {};                         ///< array: of an entry; any: each
  bool share = false;                                         ///< quantity: a text in % is a share of something
  std::string said = {};                                      ///< what messages say in place of accepted()

  /// What it would take, for messages: "a number above 0 (m, cm, mm, um, nm, in)". [any]
  [[nodiscard]] std::string accepted() const;
  /// Whether a number is in the range; anything else is but nothing. [any]
  [[nodiscard]] bool takes(const OptionValue& value) const;
  /// Three plain numbers. [any]
  [[nodiscard]] bool is_direction() const {
    return kind == OptionKind::array && most == 3 && parts.front().kind == OptionKind::number;
  }
  /// Every name there is now. [any]
  [[nodiscard]] std::vector<std::string> all_names() const;
  /// The same type with other words for what it accepts.
  [[nodiscard]] OptionType saying(std::string words) && {
    said = std::move(words);
    return std::move(*this);
  }

  static OptionType number(Range range = {}) { return {.kind = OptionKind::number, .range = range}; }
  static OptionType quantity(Dimension dimension, Range range = {}) {
    return {.kind = OptionKind::quantity, .dimension = dimension, .range = range};
  }
  /// A length, or a text in % of something that the help names.
  static OptionType length_or_share(Range range = {}) {
    return {.kind = OptionKind::quantity, .dimension = Dimension::length, .range = range, .share = true};
  }
  static OptionType share_alone(Range range) { return {.kind = OptionKind::share, .range = range}; }
  static OptionType integer(double low, double high) { return {.kind = OptionKind::integer, .range = {low, high}}; }
  static OptionType seed() { return {.kind = OptionKind::seed, .range = Range::not_negative()}; }
  static OptionType boolean() { return {.kind = OptionKind::boolean}; }
  static OptionType text(std::size_t least = 0) { return {.kind = OptionKind::text, .least = least}; }
  static OptionType file() { return text(1); }
  static OptionType one_of(std::vector<std::string> names, const std::vector<std::string>& (*more)() = nullptr) {
    return {.kind = OptionKind::choice, .names = std::move(names), .more_names = more};
  }
  template <HasNames E>
  static OptionType named() {
    return one_of(asperity::all_names<E>());
  }
  /// One of the names, or "auto": nothing.
  template <HasNames E>
  static OptionType named_or_auto() {
    OptionType type = named<E>();
    type.names.insert(type.names.begin(), "auto");
    return type;
  }
  static OptionType bytes(Range range) { return {.kind = OptionKind::bytes, .range = range}; }
  /// `names`: what "type" may be; nullptr: any text.
  static OptionType numbers(const std::vector<std::string>& (*names)() = nullptr) {
    return {.kind = OptionKind::numbers, .more_names = names};
  }
  static OptionType array(OptionType entry, std::size_t least, std::size_t most, std::string word) {
    return {.kind = OptionKind::array, .least = least, .most = most, .word = std::move(word), .parts = {entry}};
  }
  /// Three quantities [x, y, z].
  static OptionType vector(Dimension dimension, Range range = {});
  /// Three plain numbers [x, y, z].
  static OptionType direction() { return array(number(), 3, 3, "numbers").saying("three numbers [x, y, z]"); }
  /// One quantity for both, or two [along u, along v].
  static OptionType pair(OptionType entry);
  static OptionType object(std::string table) { return {.kind = OptionKind::object, .word = std::move(table)}; }
  static OptionType any(std::vector<OptionType> parts) { return {.kind = OptionKind::any, .parts = std::move(parts)}; }
};

/// A condition on the object that a row stands in. Paths name a key, or a key of a key ("volume.generator").
struct OptionTest {
  enum class Kind { given, is, an_object, filled, all, any, none };
  Kind kind = Kind::all;
  std::string path = {};
  std::vector<std::string> names = {};  ///< is: one of these; without the key its default counts
  std::vector<OptionTest> of = {};
  std::string why = {};  ///< completes "is not read ..."; {} is what the key at `path` says

  static OptionTest given(std::string path) { return {Kind::given, std::move(path)}; }
  static OptionTest is(std::string path, std::vector<std::string> names) { return {Kind::is, path, std::move(names)}; }
  static OptionTest an_object(std::string path) { return {Kind::an_object, std::move(path)}; }
  /// An array that is not empty.
  static OptionTest filled(std::string path) { return {Kind::filled, std::move(path)}; }
  static OptionTest all(std::vector<OptionTest> tests) { return {Kind::all, {}, {}, std::move(tests)}; }
  static OptionTest any(std::vector<OptionTest> tests) { return {Kind::any, {}, {}, std::move(tests)}; }
  static OptionTest none(std::vector<OptionTest> tests) { return {Kind::none, {}, {}, std::move(tests)}; }
  static OptionTest without(std::string path) { return none({given(std::move(path))}); }
};

/// A setting as a row's value. [any]
template <class T>
OptionValue to_option(const T& value) {
  if constexpr (HasNames<T>) {
    return std::string(to_string(value));
  } else if constexpr (std::is_same_v<T, Seconds>) {
    return value.count();
  } else if constexpr (std::is_same_v<T, bool> || std::is_same_v<T, std::uint64_t> || std::is_same_v<T, double>) {
    return value;
  } else if constexpr (std::is_integral_v<T>) {
    return static_cast<std::int64_t>(value);
  } else if constexpr (std::is_convertible_v<T, std::string>) {
    return std::string(value);
  } else {
    return std::vector<double>(value.begin(), value.end());
  }
}
/// The same of one that may not be there. [any]
template <class T>
OptionValue to_option(const std::optional<T>& value) {
  if (value) return to_option(*value);
  if constexpr (HasNames<T>) return std::string("auto");
  return std::monostate();
}

namespace detail {
/// Makes a T of a row's value.
template <class T>
struct FromOption {
  static T make(const OptionValue& value) {
    if constexpr (HasNames<T>) {
      return value_named<T>(std::get<std::string>(value)).value_or(T{});
    } else if constexpr (std::is_same_v<T, Seconds>) {
      return Seconds(std::get<double>(value));
    } else if constexpr (std::is_same_v<T, Vec2>) {
      if (const double* both = std::get_if<double>(&value)) return Vec2::Constant(*both);
      return Vec2(std::get<std::vector<double>>(value).data());
    } else if constexpr (std::is_same_v<T, Vec3>) {
      return Vec3(std::get<std::vector<double>>(value).data());
    } else if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool> && !std::is_same_v<T, std::uint64_t>) {
      return static_cast<T>(std::get<std::int64_t>(value));
    } else {
      return std::get<T>(value);
    }
  }
};
/// Nothing where there is no value, or "auto".
template <class T>
struct FromOption<std::optional<T>> {
  static std::optional<T> make(const OptionValue& value) {
    if (std::holds_alternative<std::monostate>(value)) return std::nullopt;
    if (const auto* text = std::get_if<std::string>(&value); HasNames<T> && text != nullptr && *text == "auto")
      return std::nullopt;
    return FromOption<T>::make(value);
  }
};
}  // namespace detail
/// The setting that a value of the row's type is. [any]
template <class T>
T from_option(const OptionValue& value) {
  return detail::FromOption<T>::make(value);
}

/// One row.
struct Option {
  std::string key;
  OptionType type;
  std::string help;                         ///< one line: what it is; type, range and default are said by themselves
  OptionValue fallback = {};                ///< what stands for it where it is not given
  std::string otherwise = {};               ///< the same in words, where it is no one value ("the device's rate")
  std::vector<OptionTest> only = {};        ///< it is read where all of these hold
  std::optional<OptionTest> required = {};  ///< it has to be there where this holds
  std::string contents = {};                ///< what is refused of it by contents or files alone; no schema tells that
  std::string printed = {};                 ///< of a law's literal form alone: why the consistent one does not read it
  std::optional<int> zooms = {};            ///< see zoom_power
  std::type_index settings = typeid(void);  ///< what it is a member of
  std::function<OptionValue(const void*)> get = {};
  std::function<void(void*, const OptionValue&)> set = {};

  /// Binds it to a member, whose initialiser is the default.
  template <class S, class T>
  Option& of(T S::*member) {
    settings = typeid(S);
    fallback = to_option(S{}.*member);
    get = [member](const void* of) { return to_option(static_cast<const S*>(of)->*member); };
    set = [member](void* of, const OptionValue& value) { static_cast<S*>(of)->*member = from_option<T>(value); };
    return *this;
  }
  Option& only_if(OptionTest test, std::string why) {
    test.why = std::move(why);
    return only.push_back(std::move(test)), *this;
  }
  Option& or_else(std::string words) { return otherwise = std::move(words), *this; }
  Option& by_contents(std::string what) { return contents = std::move(what), *this; }
  Option& of_printed_form(std::string why) { return printed = std::move(why), *this; }
  Option& zooming(int power) { return zooms = power, *this; }
  /// The power of a view's zoom that a number grows by in the scene that is shown, where lengths are that much shorter
  /// than the hand's, and energies and times are the same: forces by the first, stiffnesses and dampings by the second,
  /// speeds by less. A length is the scene's own and stays, unless it is said to be the hand's. [any]
  [[nodiscard]] int zoom_power() const;
};

/// A row bound to a member. [any]
template <class S, class T>
Option option(std::string key, T S::*member, OptionType type, std::string help) {
  Option row{std::move(key), std::move(type), std::move(help)};
  return row.of(member);
}

}  // namespace asperity
