#pragma once
// Files that are part of the library (cmake/EmbedFiles.cmake).

#include <span>
#include <string_view>

namespace asperity {

/// A file that the build put into the library.
struct EmbeddedFile {
  std::string_view name;  ///< without folder: "icosphere.json"
  std::string_view text;
};

/// The built-in scenes, in the order they are listed to people. [any]
std::span<const EmbeddedFile> embedded_scenes();

}  // namespace asperity
