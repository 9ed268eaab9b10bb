#pragma once
// What the values of an enum are called in files, messages and JSON: one table an enum, beside it.
//
//   enum class Wrap { repeat, clamp };
//   template <>
//   struct Names<Wrap> {
//     static constexpr auto table = std::to_array<Named<Wrap>>({{Wrap::repeat, "repeat"}, {Wrap::clamp, "clamp"}});
//   };
//
// to_string, value_named and name_list go by it, and so do the choices of scene files.

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace asperity {

/// A value and its name, which stays the same.
template <class E>
struct Named {
  E value;
  const char* name;
};

/// The names of E in the order in which messages list them; there are none unless it is specialised.
template <class E>
struct Names;

/// An enum with a table of names.
template <class E>
concept HasNames = requires {
  Names<E>::table.size();
};

/// Its name; "unknown" for what is no value of the enum. [any]
template <HasNames E>
constexpr const char* to_string(E value) noexcept {
  for (const Named<E>& entry : Names<E>::table)
    if (entry.value == value) return entry.name;
  return "unknown";
}

/// The value of that name. [any]
template <HasNames E>
constexpr std::optional<E> value_named(std::string_view name) noexcept {
  for (const Named<E>& entry : Names<E>::table)
    if (name == entry.name) return entry.value;
  return std::nullopt;
}

/// Where a value stands in its table; its size for what is not in it. [any]
template <HasNames E>
constexpr std::size_t place_of_name(E value) noexcept {
  std::size_t place = 0;
  while (place < Names<E>::table.size() && Names<E>::table[place].value != value) ++place;
  return place;
}

/// Whether no value and no name stands in the table twice, and none is empty: to be asserted where values are told by
/// number as well. [any]
template <HasNames E>
constexpr bool names_differ() noexcept {
  const auto& table = Names<E>::table;
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (std::string_view(table[i].name).empty()) return false;
    for (std::size_t j = 0; j < i; ++j)
      if (table[i].value == table[j].value || std::string_view(table[i].name) == table[j].name) return false;
  }
  return true;
}

/// Every name, in the table's order. [any]
template <HasNames E>
const std::vector<std::string>& all_names() {
  static_assert(names_differ<E>());
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const Named<E>& entry : Names<E>::table) all.emplace_back(entry.name);
    return all;
  }();
  return names;
}

/// "repeat, clamp": what would be accepted, each between two `quote`s, `last` before the last one. [any]
std::string listed(const std::vector<std::string>& names, std::string_view quote = "", std::string_view last = ", ");
/// The same of an enum's names. [any]
template <HasNames E>
std::string name_list(std::string_view quote = "", std::string_view last = ", ") {
  return listed(all_names<E>(), quote, last);
}

}  // namespace asperity
