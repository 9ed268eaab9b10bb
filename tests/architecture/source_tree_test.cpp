// The checks check something: the readers below them find what they should.

#include "tests/architecture/source_tree.h"

#include <gtest/gtest.h>

namespace asperity::architecture {
namespace {

TEST(SourceTree, FindsTheProjectsFiles) {
  EXPECT_GT(files_below("asperity/", {".h"}).size(), 40U);
  EXPECT_GT(files_below("asperity/", {".cpp"}).size(), 40U);
  for (const SourceFile& file : text_files()) EXPECT_NE(file.path.substr(0, 6), "build/");
}

TEST(SourceTree, ReadsIncludesAndModules) {
  EXPECT_EQ(included("#include \"asperity/core/math.h\""), "\"asperity/core/math.h\"");
  EXPECT_EQ(included("# include <png.h>  // pictures"), "<png.h>");
  EXPECT_EQ(included("// #include <png.h>"), "");
  EXPECT_EQ(module_of("asperity/field/height/image.h"), "field");
  EXPECT_EQ(module_of("apps/asperity/run.h"), "");
}

TEST(SourceTree, FindsDeclarationsAndTheirDocstrings) {
  const SourceFile header{"x.h",
                          {"#pragma once",
                           "#define TWICE(x) \\",
                           "  twice(x)",
                           "namespace asperity {",
                           "class Later;",
                           "/// Told.",
                           "struct Told {",
                           "  void member();",
                           "};",
                           "",
                           "struct Untold {};",
                           "using Alias = int;",
                           "inline constexpr int four = 4;",
                           "/// Answers. [any]",
                           "int answer(int a,",
                           "           int b = f());",
                           "int silent(char c = '{');",
                           "",
                           "inline int Told::member() { return 1; }",
                           "template <class T>",
                           "concept Odd = requires(T t) { t.odd(); };",
                           "const char* name(int);  ///< beside it [any]",
                           "}  // namespace asperity"}};
  const std::vector<Declaration> found = declarations(header);
  ASSERT_EQ(found.size(), 6U);
  const std::vector<std::size_t> lines = {7, 11, 15, 17, 20, 22};
  const std::vector<bool> documented = {true, false, true, true, false, true};
  const std::vector<bool> functions = {false, false, true, true, false, true};
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].line, lines[i]) << found[i].text;
    EXPECT_EQ(found[i].documented(), documented[i]) << found[i].text;
    EXPECT_EQ(found[i].is_function, functions[i]) << found[i].text;
  }
}

}  // namespace
}  // namespace asperity::architecture
