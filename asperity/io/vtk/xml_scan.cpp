#include "asperity/io/vtk/xml_scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asperity/io/detail/mesh_readers.h"

namespace asperity::vtk_io {
namespace {

constexpr std::size_t most_elements = 200'000;

bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

Error malformed(std::string_view text, std::size_t at, std::string what) {
  return refused(ErrorCode::file_malformed, std::move(what), line_of(text, at), "a VTK XML file");
}

class Scanner {
 public:
  explicit Scanner(std::string_view text) : text_(text) {}

  Result<std::vector<XmlElement>> scan() {
    while (!finished_) {
      at_ = text_.find('<', at_);
      if (at_ == std::string_view::npos) return truncated();
      ASPERITY_CHECK(take_tag());
    }
    return std::move(elements_);
  }

 private:
  [[nodiscard]] Error truncated() const {
    return refused(ErrorCode::file_truncated, "ends before its last tag is closed", line_of(text_, text_.size()),
                   "a whole VTK XML file");
  }

  Status skip_to(std::string_view end) {
    const std::size_t found = text_.find(end, at_);
    if (found == std::string_view::npos) return truncated();
    at_ = found + end.size();
    return success();
  }

  Status take_tag() {
    const std::string_view rest = text_.substr(at_);
    if (rest.starts_with("<?")) return skip_to("?>");
    if (rest.starts_with("<!--")) return skip_to("-->");
    if (rest.starts_with("<!")) return malformed(text_, at_, "has a document type, which VTK files do not need");
    if (rest.starts_with("</")) return close();
    return open();
  }

  Status close() {
    const std::size_t begin = at_ + 2;
    ASPERITY_CHECK(skip_to(">"));
    std::string_view name = text_.substr(begin, at_ - 1 - begin);
    while (!name.empty() && is_space(name.back())) name.remove_suffix(1);
    if (open_.empty() || elements_[open_.back()].name != name)
      return malformed(text_, begin, fmt::format("closes <{}>, which is not open", name.substr(0, 40)));
    open_.pop_back();
    finished_ = open_.empty();
    return success();
  }

  void skip_space() {
    while (at_ < text_.size() && is_space(text_[at_])) ++at_;
  }

  Status open() {
    XmlElement element;
    element.at = at_++;
    const std::size_t begin = at_;
    while (at_ < text_.size() && !is_space(text_[at_]) && text_[at_] != '>' && text_[at_] != '/') ++at_;
    element.name = text_.substr(begin, at_ - begin);
    if (element.name.empty()) return malformed(text_, begin, "has a tag without a name");
    for (skip_space(); at_ < text_.size() && text_[at_] != '>' && text_[at_] != '/'; skip_space())
      ASPERITY_CHECK(take_attribute(element));
    const bool empty = at_ < text_.size() && text_[at_] == '/';
    if (empty) ++at_;
    if (at_ >= text_.size()) return truncated();
    if (text_[at_] != '>') return malformed(text_, at_, "has a tag that does not end");
    element.content = ++at_;
    return add(std::move(element), empty);
  }

  Status add(XmlElement element, bool empty) {
    if (elements_.size() == most_elements)
      return malformed(text_, element.at, fmt::format("has more than {} tags", most_elements));
    element.parent = open_.empty() ? 0 : open_.back();
    const bool appended = element.name == "AppendedData";
    elements_.push_back(std::move(element));
    if (!empty) open_.push_back(elements_.size() - 1);
    if (!appended) {
      finished_ = open_.empty();
      return success();
    }
    // What is appended may look like tags; only the file's end is looked at again.
    finished_ = true;
    const std::string_view tail = text_.substr(text_.size() - std::min<std::size_t>(text_.size(), 200));
    return tail.find("</VTKFile") == std::string_view::npos ? Status(truncated()) : success();
  }

  Status take_attribute(XmlElement& element) {
    const std::size_t begin = at_;
    while (at_ < text_.size() && !is_space(text_[at_]) && text_[at_] != '=' && text_[at_] != '>') ++at_;
    const std::string_view key = text_.substr(begin, at_ - begin);
    skip_space();
    if (at_ >= text_.size()) return truncated();
    if (text_[at_] != '=') return malformed(text_, begin, "has an attribute without a value");
    ++at_;
    skip_space();
    if (at_ >= text_.size()) return truncated();
    const char quote = text_[at_];
    if (quote != '"' && quote != '\'') return malformed(text_, at_, "has an attribute without quotes");
    const std::size_t end = text_.find(quote, at_ + 1);
    if (end == std::string_view::npos) return truncated();
    element.attributes.emplace_back(key, text_.substr(at_ + 1, end - at_ - 1));
    at_ = end + 1;
    return success();
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::vector<XmlElement> elements_;
  std::vector<std::size_t> open_;
  bool finished_ = false;
};

/// Words of an attribute through `parse(word, value)`.
template <class T, class Parse>
Result<std::vector<T>> parsed(std::string_view text, const XmlElement& element, std::string_view key, std::size_t count,
                              Parse&& parse) {
  std::vector<T> values;
  mesh_readers::TextCursor words(element.attribute(key));
  for (std::string_view word = words.next_word(); !word.empty(); word = words.next_word()) {
    T value{};
    if (values.size() == count || !parse(word, value)) {
      values.clear();
      break;
    }
    values.push_back(value);
  }
  if (values.size() != count) {
    return refused(ErrorCode::file_malformed,
                   element.has(key)
                       ? fmt::format("<{}>: {} is \"{}\"", element.name, key, element.attribute(key).substr(0, 80))
                       : fmt::format("<{}>: {} is missing", element.name, key),
                   line_of(text, element.at), fmt::format("{} number{}", count, count == 1 ? "" : "s"));
  }
  return values;
}

}  // namespace

std::string_view XmlElement::attribute(std::string_view key) const {
  for (const auto& [name_of, value] : attributes) {
    if (name_of == key) return value;
  }
  return {};
}

bool XmlElement::has(std::string_view key) const {
  return std::any_of(attributes.begin(), attributes.end(), [&](const auto& entry) { return entry.first == key; });
}

Result<std::vector<XmlElement>> scan_xml(std::string_view text) {
  ASPERITY_TRY(std::vector<XmlElement> elements, Scanner(text).scan());
  if (elements.empty() || elements.front().name != "VTKFile")
    return malformed(text, 0, "does not begin with <VTKFile>");
  return elements;
}

std::string line_of(std::string_view text, std::size_t at) {
  const std::string_view before = text.substr(0, at);
  return fmt::format("line {}", 1 + std::count(before.begin(), before.end(), '\n'));
}

Result<std::vector<std::int64_t>> whole_numbers(std::string_view text, const XmlElement& element, std::string_view key,
                                                std::size_t count) {
  return parsed<std::int64_t>(text, element, key, count, [](std::string_view word, std::int64_t& value) {
    return mesh_readers::parse_integer(word, value);
  });
}

Result<std::vector<double>> numbers(std::string_view text, const XmlElement& element, std::string_view key,
                                    std::size_t count) {
  return parsed<double>(text, element, key, count, [](std::string_view word, double& value) {
    return mesh_readers::parse_number(word, value) && std::isfinite(value);
  });
}

}  // namespace asperity::vtk_io
