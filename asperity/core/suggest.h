#pragma once

#include <span>
#include <string>
#include <string_view>

namespace asperity {

/// Number of single-character insertions, deletions, replacements and swaps of neighbours that turn `a` into `b`
/// (optimal string alignment). Case is ignored: "Omega.7" is 0 away from "omega.7". [any]
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The name among `names` that was probably meant by `name`, for messages ("did you mean ..."): the one with the
/// smallest edit distance, the first of equals. Empty when none is near (more than a third of the longer name, and more
/// than one character, would have to change). [any]
std::string nearest_name(std::string_view name, std::span<const std::string> names);

}  // namespace asperity
