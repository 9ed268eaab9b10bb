#pragma once
// Private to asperity/io/vtk: the tags of a VTK XML file, as far as checking it before VTK sees it needs them.

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "asperity/core/result.h"

namespace asperity::vtk_io {

/// One opened tag.
struct XmlElement {
  std::string_view name;
  std::vector<std::pair<std::string_view, std::string_view>> attributes;
  std::size_t parent = 0;   ///< index; of the root its own
  std::size_t content = 0;  ///< byte after the tag
  std::size_t at = 0;       ///< byte of the tag

  /// Empty where it is not given.
  [[nodiscard]] std::string_view attribute(std::string_view key) const;
  [[nodiscard]] bool has(std::string_view key) const;
};

/// The tags in their order, the root first, up to <AppendedData ...>, which is the last. Errors: file_malformed (with
/// the line), file_truncated (no end of the root). [build]
Result<std::vector<XmlElement>> scan_xml(std::string_view text);

/// "line 3" of a byte. [build]
std::string line_of(std::string_view text, std::size_t at);
/// The numbers of an attribute. Errors: file_malformed naming the tag's line and the attribute. [build]
Result<std::vector<std::int64_t>> whole_numbers(std::string_view text, const XmlElement& element, std::string_view key,
                                                std::size_t count);
Result<std::vector<double>> numbers(std::string_view text, const XmlElement& element, std::string_view key,
                                    std::size_t count);

}  // namespace asperity::vtk_io
