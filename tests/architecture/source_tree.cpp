#include "tests/architecture/source_tree.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <regex>

namespace asperity::architecture {
namespace {

namespace fs = std::filesystem;

bool is_text(const fs::path& path) {
  static const std::vector<std::string> endings = {".h",    ".cpp", ".txt", ".cmake", ".in",  ".md",  ".json",
                                                   ".html", ".js",  ".css", ".bib",   ".yml", ".yaml"};
  static const std::vector<std::string> names = {
      "run", "test", "build", "tidy", "install-packages", ".clang-format", ".clang-tidy", ".gitignore"};
  const auto among = [](const auto& list, const std::string& value) {
    return std::find(list.begin(), list.end(), value) != list.end();
  };
  return among(endings, path.extension().string()) || among(names, path.filename().string());
}

bool is_left_out(const fs::path& folder) {
  const std::string name = folder.filename().string();
  return name == ".git" || name == "node_modules" ||
         (folder.parent_path() == fs::path(ASPERITY_SOURCE_DIR) && (name == "build" || name == "out"));
}

SourceFile read(const fs::path& path) {
  SourceFile file;
  file.path = fs::relative(path, ASPERITY_SOURCE_DIR).generic_string();
  std::ifstream stream(path);
  for (std::string line; std::getline(stream, line);) file.lines.push_back(line);
  return file;
}

std::vector<SourceFile> read_all() {
  std::vector<SourceFile> files;
  for (fs::recursive_directory_iterator entry(ASPERITY_SOURCE_DIR), end; entry != end; ++entry) {
    if (entry->is_directory() && is_left_out(entry->path())) {
      entry.disable_recursion_pending();
    } else if (entry->is_regular_file() && is_text(entry->path())) {
      files.push_back(read(entry->path()));
    }
  }
  std::sort(files.begin(), files.end(), [](const SourceFile& a, const SourceFile& b) { return a.path < b.path; });
  return files;
}

/// A line without its comment and without what stands between quotes.
std::string code_of(const std::string& line) {
  std::string code;
  char quote = '\0';
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (quote != '\0') {
      if (line[i] == '\\')
        ++i;
      else if (line[i] == quote)
        quote = '\0';
      continue;
    }
    if (line.compare(i, 2, "//") == 0) break;
    const bool digit_separator = line[i] == '\'' && i > 0 && std::isalnum(static_cast<unsigned char>(line[i - 1])) != 0;
    if ((line[i] == '"' || line[i] == '\'') && !digit_separator)
      quote = line[i];
    else
      code += line[i];
  }
  return code;
}

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(' ');
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(' ') - first + 1);
}

bool starts_with(const std::string& text, std::string_view start) {
  return text.compare(0, start.size(), start) == 0;
}

/// What a statement at namespace level declares, if it is one of the kinds that want a docstring.
enum class Kind { none, type, function };

Kind kind_of(const std::string& statement, bool has_body) {
  static const std::regex type(R"(^(template <.*> ?)?(class|struct|enum class|enum|concept) )");
  static const std::regex concept_type(R"(^template <.*> ?concept )");
  if (std::regex_search(statement, concept_type)) return Kind::type;
  if (std::regex_search(statement, type)) return has_body ? Kind::type : Kind::none;
  for (const std::string_view other : {"using ", "static_assert", "namespace", "extern ", "typedef ", "friend "}) {
    if (starts_with(statement, other)) return Kind::none;
  }
  const std::size_t parenthesis = statement.find('(');
  const std::size_t assignment = statement.find('=');
  if (parenthesis == std::string::npos || (assignment < parenthesis && statement.find("operator") == std::string::npos))
    return Kind::none;
  // A qualified name before the parenthesis is a member's definition.
  static const std::regex member(R"([A-Za-z_>]::~?[A-Za-z_]+ ?$)");
  const std::string before = trimmed(statement.substr(0, parenthesis));
  const std::size_t name = before.find_last_of(" &*");
  return std::regex_search(name == std::string::npos ? before : before.substr(name + 1), member) ? Kind::none
                                                                                                 : Kind::function;
}

/// Walks through a header's lines and gathers what stands at namespace level.
class Reader {
 public:
  std::vector<Declaration> read(const SourceFile& header) {
    for (number_ = 1; number_ <= header.lines.size(); ++number_) take(header.lines[number_ - 1]);
    return std::move(found_);
  }

 private:
  void take(const std::string& line) {
    const std::string text = trimmed(line);
    if (continues_macro_ || starts_with(text, "#")) {
      continues_macro_ = !text.empty() && text.back() == '\\';
      return;
    }
    if (text.empty()) docstring_.clear();
    if (depth_ == 0 && starts_with(text, "///")) docstring_ += text.substr(3);
    const std::string code = trimmed(code_of(line));
    if (code.empty()) return;
    if (depth_ == 0 && statement_.empty()) {
      first_line_ = number_;
      const std::size_t trailing = line.find("///");
      if (trailing != std::string::npos) docstring_ += line.substr(trailing + 3);
    }
    for (const char c : code) take(c);
    if (!statement_.empty() && statement_.back() != ' ') statement_ += ' ';
  }

  void take(char c) {
    if (depth_ > 0) {
      depth_ += c == '{' ? 1 : (c == '}' ? -1 : 0);
      if (depth_ == 0) after_body_ = true;
      return;
    }
    if (after_body_ && c == ';') {
      after_body_ = false;
      return;
    }
    if (c != ' ') after_body_ = false;
    if (c == '{') {
      if (starts_with(statement_, "namespace") || starts_with(statement_, "inline namespace")) {
        statement_.clear();
      } else {
        finish(true);
        depth_ = 1;
      }
    } else if (c == ';') {
      finish(false);
    } else if (c == '}') {
      statement_.clear();
    } else if (c != ' ' || !statement_.empty()) {
      statement_ += c;
    }
  }

  void finish(bool has_body) {
    const std::string statement = trimmed(statement_);
    const Kind kind = kind_of(statement, has_body);
    if (kind != Kind::none) found_.push_back({first_line_, statement, docstring_, kind == Kind::function});
    statement_.clear();
  }

  std::vector<Declaration> found_;
  std::string statement_;
  std::string docstring_;
  std::size_t number_ = 0;
  std::size_t first_line_ = 0;
  int depth_ = 0;
  bool after_body_ = false;
  bool continues_macro_ = false;
};

}  // namespace

const std::vector<SourceFile>& text_files() {
  static const std::vector<SourceFile> files = read_all();
  return files;
}

std::vector<SourceFile> files_below(const std::string& folder, const std::vector<std::string>& endings) {
  std::vector<SourceFile> below;
  for (const SourceFile& file : text_files()) {
    const std::string ending = fs::path(file.path).extension().string();
    if (starts_with(file.path, folder) && std::find(endings.begin(), endings.end(), ending) != endings.end())
      below.push_back(file);
  }
  return below;
}

std::string module_of(const std::string& path) {
  static const std::regex pattern(R"(^asperity/([a-z]+)/)");
  std::smatch match;
  return std::regex_search(path, match, pattern) ? match[1].str() : "";
}

bool says_private(const SourceFile& header) {
  const auto end = header.lines.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(8, header.lines.size()));
  return std::any_of(header.lines.begin(), end, [](const std::string& line) {
    return line.rfind("// ", 0) == 0 &&
           (line.find("Private to ") != std::string::npos || line.find("private to ") != std::string::npos);
  });
}

std::string included(const std::string& line) {
  static const std::regex pattern(R"(^\s*#\s*include\s*(".*"|<.*>))");
  std::smatch match;
  return std::regex_search(line, match, pattern) ? match[1].str() : "";
}

std::vector<Declaration> declarations(const SourceFile& header) {
  return Reader().read(header);
}

}  // namespace asperity::architecture
