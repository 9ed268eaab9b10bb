#pragma once
// The project's own files, as text, for tests that read them.

#include <filesystem>
#include <string>
#include <vector>

namespace asperity::architecture {

struct SourceFile {
  std::string path;                ///< from the project's root, with forward slashes
  std::vector<std::string> lines;  ///< without line ends
};

/// Every text file of the project, sorted by path; build output, reports and version control left out.
const std::vector<SourceFile>& text_files();
/// Those below `folder` ("asperity/") whose name ends in one of `endings`.
std::vector<SourceFile> files_below(const std::string& folder, const std::vector<std::string>& endings);

/// "asperity/core/math.h" -> "core"; empty for a path that is not inside a module.
std::string module_of(const std::string& path);
/// The header with everything that a program needs.
inline constexpr const char* umbrella = "asperity/asperity.h";
/// Whether a header says at its head that it is not for users of its module.
bool says_private(const SourceFile& header);
/// What an include line includes, its quotes or brackets kept: `"asperity/core/math.h"`, `<png.h>`; empty for other
/// lines.
std::string included(const std::string& line);

/// A declaration at namespace level: its first line and whether a docstring (///) stands right before it or on it.
struct Declaration {
  std::size_t line = 0;  ///< counted from 1
  std::string text;      ///< up to its first brace or semicolon
  std::string docstring;
  bool is_function = false;
  [[nodiscard]] bool documented() const { return !docstring.empty(); }
};

/// Classes, structs, enumerations, concepts and free functions that a header declares at namespace level. Left out:
/// what is only named again (forward declarations, members defined outside their class), aliases, constants and macros.
/// Reads tokens line by line, not C++: good for headers that clang-format has laid out.
std::vector<Declaration> declarations(const SourceFile& header);

}  // namespace asperity::architecture
