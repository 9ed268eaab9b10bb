#pragma once
// What the readers of files share: errors that know their file and their place in it, a file's extension. Internal to
// io.

#include <filesystem>
#include <string>
#include <utility>

#include "asperity/core/result.h"

namespace asperity {

/// The Error of a file as a whole. [any]
inline Error refused_file(ErrorCode code, std::string what, std::string file, std::string accepted = {}) {
  return refused(code, std::move(what), {}, std::move(accepted)).in_file(std::move(file));
}

/// The result, its error with `place` put before the place that it names. [any]
template <class T>
Result<T> at_place(Result<T> result, const std::string& place) {
  if (result) return result;
  return std::move(result).error().at(place);
}

/// The result, its error with the file that it is about, and with `place` where it names none. [any]
template <class T>
Result<T> in_file(Result<T> result, std::string file, const std::string& place = {}) {
  if (result) return result;
  Error error = std::move(result).error().in_file(std::move(file));
  if (error.place.empty()) error.place = place;
  return error;
}

/// ".vti" of "A.VTI". [any]
inline std::string lower_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return extension;
}

}  // namespace asperity
