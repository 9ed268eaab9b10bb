#include "asperity/core/named_numbers.h"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "asperity/core/suggest.h"

namespace asperity {

double NamedNumbers::get(std::string_view name, double fallback) {
  const auto found = given_.find(name);
  const double value = found == given_.end() ? fallback : found->second;
  taken_[std::string(name)] = value;
  return value;
}

Status NamedNumbers::all_taken() const {
  std::vector<std::string> known;
  std::string list;
  for (const auto& [name, value] : taken_) {
    known.push_back(name);
    list += (list.empty() ? "" : ", ") + name;
    if (!std::isfinite(value)) return bad_value(fmt::format("is {}", value), name, "a finite number (SI)");
  }
  for (const auto& [name, value] : given_) {
    if (taken_.find(name) != taken_.end()) continue;
    const std::string near = nearest_name(name, known);
    return Error{
        ErrorCode::bad_key,
        near.empty() ? std::string("is read by nobody") : fmt::format("is read by nobody; did you mean \"{}\"?", near),
        {},
        name,
        list.empty() ? std::string("no numbers") : list};
  }
  return success();
}

bool is_plain_name(std::string_view name) {
  char last = '-';
  for (const char c : name) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
    if (!letter && (c != '-' || last == '-')) return false;
    last = c;
  }
  return last != '-';
}

}  // namespace asperity
