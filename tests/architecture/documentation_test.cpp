// Public headers explain themselves.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "tests/architecture/source_tree.h"

namespace asperity::architecture {
namespace {

/// Headers that say so at their head are not for users of the module.
bool is_private(const SourceFile& header) {
  const auto end = header.lines.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(8, header.lines.size()));
  return std::any_of(header.lines.begin(), end, [](const std::string& line) {
    return line.rfind("// ", 0) == 0 &&
           (line.find("Private to ") != std::string::npos || line.find("private to ") != std::string::npos);
  });
}

TEST(Documentation, TypesAndFunctionsHaveDocstrings) {
  std::size_t checked = 0;
  for (const SourceFile& header : files_below("asperity/", {".h"})) {
    if (is_private(header)) continue;
    for (const Declaration& declaration : declarations(header)) {
      ++checked;
      EXPECT_TRUE(declaration.documented()) << header.path << ":" << declaration.line << ": " << declaration.text;
    }
  }
  EXPECT_GT(checked, 100U);
}

TEST(Documentation, FreeFunctionsNameTheThreadTheyAreFor) {
  for (const SourceFile& header : files_below("asperity/", {".h"})) {
    if (is_private(header)) continue;
    for (const Declaration& declaration : declarations(header)) {
      if (!declaration.is_function) continue;
      const std::array<const char*, 4> tags = {"[servo]", "[build]", "[main]", "[any]"};
      EXPECT_TRUE(std::any_of(tags.begin(), tags.end(),
                              [&](const char* tag) { return declaration.docstring.find(tag) != std::string::npos; }))
          << header.path << ":" << declaration.line << ": " << declaration.text;
    }
  }
}

TEST(Documentation, HeadersBeginWithPragmaOnce) {
  for (const SourceFile& header : files_below("", {".h"})) {
    ASSERT_FALSE(header.lines.empty()) << header.path;
    EXPECT_EQ(header.lines.front(), "#pragma once") << header.path;
  }
}

/// The lines of a file from the first that begins with `begin` up to the next that is `end`, both left out.
std::vector<std::string> lines_between(const SourceFile& file, const std::string& begin, const std::string& end) {
  const auto starts = [&](const std::string& line) { return line.rfind(begin, 0) == 0; };
  auto first = std::find_if(file.lines.begin(), file.lines.end(), starts);
  if (first == file.lines.end()) return {};
  return {++first, std::find(first, file.lines.end(), end)};
}

TEST(Documentation, FirstProgramHasTenLinesAndStandsInTheReadme) {
  const std::vector<SourceFile> examples = files_below("examples/first_touch.cpp", {".cpp"});
  ASSERT_EQ(examples.size(), 1U);
  const std::vector<std::string> body = lines_between(examples.front(), "int main() {", "}");
  const auto is_code = [](const std::string& line) { return line.find_first_not_of(" {}") != std::string::npos; };
  EXPECT_GT(std::count_if(body.begin(), body.end(), is_code), 0);
  EXPECT_LE(std::count_if(body.begin(), body.end(), is_code), 10);

  const std::vector<SourceFile> readme = files_below("README.md", {".md"});
  if (readme.empty()) GTEST_SKIP() << "there is no README.md yet";
  const std::vector<std::string>& lines = examples.front().lines;
  const auto program = std::find(lines.begin(), lines.end(), "#include <cstdio>");
  EXPECT_EQ(lines_between(readme.front(), "```cpp", "```"), std::vector<std::string>(program, lines.end()))
      << "README.md shows another program than examples/first_touch.cpp";
}

}  // namespace
}  // namespace asperity::architecture
