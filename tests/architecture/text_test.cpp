// What no file of the project may hold, how long files may be, and how they are laid out.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>

#include "tests/architecture/source_tree.h"

namespace asperity::architecture {
namespace {

constexpr const char* this_file = "tests/architecture/text_test.cpp";

bool has_emoji(const std::string& line) {
  // U+1F000 and above begin with these bytes in UTF-8; mathematical signs and Greek letters do not.
  return line.find("\xF0\x9F") != std::string::npos;
}

TEST(Text, HoldsNoTabsNoCarriageReturnsAndNoSpacesAtLineEnds) {
  for (const SourceFile& file : text_files()) {
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      const std::string& line = file.lines[i];
      EXPECT_EQ(line.find_first_of("\t\r"), std::string::npos) << file.path << ":" << i + 1;
      EXPECT_FALSE(!line.empty() && line.back() == ' ')
          << file.path << ":" << i + 1 << ": space at the end of the line";
      EXPECT_FALSE(has_emoji(line)) << file.path << ":" << i + 1;
    }
  }
}

TEST(Text, HoldsNoPathsOfAMachineAndNoUnfinishedWork) {
  const std::array<const char*, 7> forbidden = {"/home/", "/root/", "/work/", "/Users/", "C:\\\\", "TODO", "FIXME"};
  for (const SourceFile& file : text_files()) {
    if (file.path == this_file) continue;
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      for (const char* word : forbidden) {
        EXPECT_EQ(file.lines[i].find(word), std::string::npos) << file.path << ":" << i + 1 << ": " << word;
      }
    }
  }
}

// It locks, and spins where no trap sees it; what passes between threads goes by Mailbox, RingQueue and plain atomics.
TEST(Text, NoAtomicPointerIsShared) {
  std::size_t atomics = 0;
  for (const SourceFile& file : files_below("asperity", {".h", ".cpp"})) {
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      const std::string& line = file.lines[i];
      atomics += line.find("std::atomic<") != std::string::npos ? 1U : 0U;
      for (const char* word : {"atomic<std::shared_ptr", "atomic<std::weak_ptr", "atomic_load(", "atomic_store("})
        EXPECT_EQ(line.find(word), std::string::npos) << file.path << ":" << i + 1 << ": " << word;
    }
  }
  EXPECT_GT(atomics, 10U) << "files were read";
}

TEST(Text, FilesAreShort) {
  for (const SourceFile& file : files_below("", {".h"})) EXPECT_LE(file.lines.size(), 300U) << file.path;
  for (const SourceFile& file : files_below("", {".cpp"})) EXPECT_LE(file.lines.size(), 700U) << file.path;
}

/// Standard output and error of a shell command, and whether it succeeded.
std::pair<std::string, bool> output_of(const std::string& command) {
  std::string text;
  std::FILE* pipe = popen((command + " 2>&1").c_str(), "r");  // NOLINT(cert-env33-c): the command is built below
  if (pipe == nullptr) return {"cannot start " + command, false};
  std::array<char, 4096> buffer{};
  for (std::size_t count = 1; count > 0;) {
    count = std::fread(buffer.data(), 1, buffer.size(), pipe);
    text.append(buffer.data(), count);
  }
  return {text, pclose(pipe) == 0};
}

TEST(Text, SourcesAreLaidOutByClangFormat) {
  if (!output_of("clang-format --version").second) GTEST_SKIP() << "clang-format is not installed";
  std::string command = "cd '" ASPERITY_SOURCE_DIR "' && clang-format --dry-run -Werror --ferror-limit=1";
  for (const SourceFile& file : files_below("", {".h", ".cpp"})) command += " '" + file.path + "'";
  const auto [text, formatted] = output_of(command);
  EXPECT_TRUE(formatted) << text.substr(0, 4000);
}

}  // namespace
}  // namespace asperity::architecture
