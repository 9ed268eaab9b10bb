#pragma once
// What settings and tables of the device module are checked and searched by. Internal to device.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/core/suggest.h"

namespace asperity {

/// Errors: bad_value where the number is not finite, or not `good`. [build]
inline Status require(bool good, const char* place, double value, const char* accepted) {
  if (good && std::isfinite(value)) return success();
  return bad_value(fmt::format("is {}", value), place, accepted);
}

/// The names of a table's entries. [any]
template <class T>
std::vector<std::string> names_in(std::span<const T> table) {
  std::vector<std::string> names;
  for (const T& entry : table) names.push_back(entry.name);
  return names;
}

/// The entry of that name, in any case. Errors: bad_value with the nearest name; `what` the table holds. [any]
template <class T>
Result<T> find_in(std::span<const T> table, std::string_view name, const char* what) {
  for (const T& entry : table) {
    if (edit_distance(name, entry.name) == 0) return entry;
  }
  const std::vector<std::string> names = names_in(table);
  const std::string near = nearest_name(name, names);
  const std::string hint = near.empty() ? std::string() : fmt::format("; did you mean \"{}\"?", near);
  return bad_value(fmt::format("{} \"{}\" is not known{}", what, name, hint), "",
                   fmt::format("{}", fmt::join(names, ", ")));
}

}  // namespace asperity
