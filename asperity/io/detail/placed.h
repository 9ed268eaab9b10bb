#pragma once
// Where what went wrong stands: a result whose error is told its place, or its file. Internal to io.

#include <string>
#include <utility>

#include "asperity/core/result.h"

namespace asperity {

/// The result, its error with `place` put before the place that it names. [any]
template <class T>
Result<T> at_place(Result<T> result, const std::string& place) {
  return result ? std::move(result) : std::move(result).error().at(place);
}

/// The result, its error with the file that it is about, and with `place` where it names none. [any]
template <class T>
Result<T> in_file(Result<T> result, std::string file, const std::string& place = {}) {
  if (result) return result;
  Error error = std::move(result).error().in_file(std::move(file));
  if (error.place.empty()) error.place = place;
  return error;
}

/// The Error of a file as a whole. [any]
inline Error refused_file(ErrorCode code, std::string what, std::string file, std::string accepted = {}) {
  return refused(code, std::move(what), {}, std::move(accepted)).in_file(std::move(file));
}

}  // namespace asperity
