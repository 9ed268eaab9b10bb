// Public headers explain themselves.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "tests/architecture/source_tree.h"

namespace asperity::architecture {
namespace {

TEST(Documentation, TypesAndFunctionsHaveDocstrings) {
  std::size_t checked = 0;
  for (const SourceFile& header : files_below("asperity/", {".h"})) {
    if (says_private(header)) continue;
    for (const Declaration& declaration : declarations(header)) {
      ++checked;
      EXPECT_TRUE(declaration.documented()) << header.path << ":" << declaration.line << ": " << declaration.text;
    }
  }
  EXPECT_GT(checked, 100U);
}

TEST(Documentation, FreeFunctionsNameTheThreadTheyAreFor) {
  for (const SourceFile& header : files_below("asperity/", {".h"})) {
    if (says_private(header)) continue;
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

/// A file of which there is one.
const SourceFile& file_at(const std::string& path) {
  const auto same = [&](const SourceFile& file) { return file.path == path; };
  const auto found = std::find_if(text_files().begin(), text_files().end(), same);
  if (found != text_files().end()) return *found;
  ADD_FAILURE() << "there is no " << path;
  static const SourceFile none;
  return none;
}

/// The blocks of a page that begin with `fence` ("```cpp").
std::vector<std::vector<std::string>> blocks_of(const SourceFile& page, const std::string& fence) {
  std::vector<std::vector<std::string>> blocks;
  for (auto line = page.lines.begin(); line != page.lines.end(); ++line) {
    if (*line != fence) continue;
    const auto end = std::find(line + 1, page.lines.end(), "```");
    blocks.emplace_back(line + 1, end);
    if (end == page.lines.end()) break;
    line = end;
  }
  return blocks;
}

/// An example without what is said at its head.
std::vector<std::string> program_of(const SourceFile& example) {
  const auto starts = [](const std::string& line) { return line.rfind("#include", 0) == 0; };
  return {std::find_if(example.lines.begin(), example.lines.end(), starts), example.lines.end()};
}

TEST(Documentation, FirstProgramHasTenLines) {
  const std::vector<std::string>& lines = file_at("examples/first_touch.cpp").lines;
  const auto begin = std::find(lines.begin(), lines.end(), "int main() {");
  const auto end = std::find(begin, lines.end(), "}");
  ASSERT_NE(end, lines.end());
  EXPECT_GT(end - begin, 1);
  EXPECT_LE(end - begin - 1, 10);
}

// The tests compile and run the examples, and the package test what the README's CMake lists say.
TEST(Documentation, ReadmeShowsTheExamples) {
  const auto shown = blocks_of(file_at("README.md"), "```cpp");
  const std::array<const char*, 2> examples = {"examples/first_touch.cpp", "examples/touch_mesh.cpp"};
  ASSERT_EQ(shown.size(), examples.size());
  for (std::size_t i = 0; i < shown.size(); ++i) EXPECT_EQ(shown[i], program_of(file_at(examples[i]))) << examples[i];
  EXPECT_EQ(blocks_of(file_at("README.md"), "```cmake").size(), 1U);
}

TEST(Documentation, BakingShowsItsExample) {
  const auto shown = blocks_of(file_at("docs/methods/baking.md"), "```cpp");
  ASSERT_EQ(shown.size(), 1U);
  EXPECT_EQ(shown.front(), program_of(file_at("examples/bake_formula.cpp")));
}

// What the README tells to run is there.
TEST(Documentation, ReadmeInstallsBeforeItFinds) {
  const SourceFile& readme = file_at("README.md");
  const auto line_with = [&](const std::string& text) {
    const auto holds = [&](const std::string& line) { return line.find(text) != std::string::npos; };
    return std::find_if(readme.lines.begin(), readme.lines.end(), holds);
  };
  const std::array<const char*, 5> steps = {"scripts/install-packages", "cmake --preset release",
                                            "cmake --build build/release", "cmake --install build/release --prefix",
                                            "find_package(asperity"};
  for (std::size_t i = 0; i < steps.size(); ++i) {
    ASSERT_NE(line_with(steps[i]), readme.lines.end()) << steps[i];
    if (i == 0) continue;
    EXPECT_LT(line_with(steps[i - 1]), line_with(steps[i])) << steps[i];
  }
}

}  // namespace
}  // namespace asperity::architecture
