// VTK's XML files, checked before VTK reads them.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "asperity/io/detail/mesh_readers.h"
#include "asperity/io/vtk/file_checks.h"
#include "asperity/io/vtk/xml_scan.h"

namespace asperity::vtk_io {
namespace {

// zlib packs at most about 1030 to 1; LZ4 less.
constexpr std::uint64_t most_packed = 1100;
// A value of 8 bytes takes two characters of text.
constexpr std::uint64_t most_unpacked = 8;
constexpr std::int64_t most_index = std::int64_t{1} << 30;

class XmlFile {
 public:
  XmlFile(std::string_view text, std::string_view type, std::size_t most_bytes)
      : text_(text), type_(type), most_bytes_(most_bytes) {}

  Status check() {
    ASPERITY_TRY(elements_, scan_xml(text_));
    ASPERITY_CHECK(check_root());
    if (elements_.back().name == "AppendedData") ASPERITY_CHECK(find_appended());
    for (const XmlElement& element : elements_) {
      if (element.name == type_) ASPERITY_CHECK(check_grid(element));
      if (element.name == "Piece") ASPERITY_CHECK(check_piece(element));
      if (element.name == "DataArray" || element.name == "Array") ASPERITY_CHECK(check_array(element));
    }
    if (pieces_ == 0) return bad(elements_.front(), "holds no <Piece>", "a file with data");
    return success();
  }

 private:
  [[nodiscard]] Error bad(const XmlElement& element, std::string what, std::string accepted,
                          ErrorCode code = ErrorCode::file_malformed) const {
    return refused(code, fmt::format("<{}>: {}", element.name.substr(0, 40), what), line_of(text_, element.at),
                   std::move(accepted));
  }

  Status check_root() {
    const XmlElement& root = elements_.front();
    if (root.attribute("type") != type_) {
      return bad(root, fmt::format("type is \"{}\"", root.attribute("type").substr(0, 40)), std::string(type_),
                 ErrorCode::file_unsupported);
    }
    const std::string_view order = root.attribute("byte_order");
    if (order != "LittleEndian" && order != "BigEndian")
      return bad(root, fmt::format("byte_order is \"{}\"", order.substr(0, 40)), "LittleEndian or BigEndian");
    big_endian_ = order == "BigEndian";
    const std::string_view header = root.attribute("header_type");
    if (!header.empty() && header != "UInt32" && header != "UInt64")
      return bad(root, fmt::format("header_type is \"{}\"", header.substr(0, 40)), "UInt32 or UInt64");
    word_ = header == "UInt64" ? 8 : 4;
    const std::string_view compressor = root.attribute("compressor");
    if (!compressor.empty() && compressor != "vtkZLibDataCompressor" && compressor != "vtkLZ4DataCompressor") {
      return bad(root, fmt::format("compressor is \"{}\"", compressor.substr(0, 40)),
                 "none, vtkZLibDataCompressor or vtkLZ4DataCompressor", ErrorCode::file_unsupported);
    }
    compressed_ = !compressor.empty();
    return success();
  }

  Status find_appended() {
    const XmlElement& appended = elements_.back();
    const std::string_view encoding = appended.attribute("encoding");
    if (encoding != "raw" && encoding != "base64")
      return bad(appended, fmt::format("encoding is \"{}\"", encoding.substr(0, 40)), "raw or base64");
    appended_base64_ = encoding == "base64";
    const std::size_t mark = text_.find('_', appended.content);
    const std::size_t end = text_.rfind("</AppendedData");
    if (mark == std::string_view::npos || end == std::string_view::npos || end <= mark)
      return bad(appended, "does not hold the mark _ and an end", "a whole file", ErrorCode::file_truncated);
    appended_ = text_.substr(mark + 1, end - mark - 1);
    return success();
  }

  /// Six whole numbers with at least one cell along each axis.
  Result<std::array<std::int64_t, 6>> extent(const XmlElement& element, std::string_view key) const {
    ASPERITY_TRY(const std::vector<std::int64_t> read, whole_numbers(text_, element, key, 6));
    std::array<std::int64_t, 6> values{};
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int64_t low = read[2 * a];
      const std::int64_t high = read[2 * a + 1];
      if (low < -most_index || high > most_index || high <= low) {
        return bad(element, fmt::format("{} of axis {} is {} to {}", key, "xyz"[a], low, high),
                   "two whole numbers, the second above the first", ErrorCode::bad_value);
      }
      values[2 * a] = low;
      values[2 * a + 1] = high;
    }
    return values;
  }

  Status check_grid(const XmlElement& element) {
    if (type_ == "UnstructuredGrid") return success();
    ASPERITY_TRY(whole_, extent(element, "WholeExtent"));
    have_whole_ = true;
    if (type_ != "ImageData") return success();
    if (element.has("Origin")) ASPERITY_CHECK(numbers(text_, element, "Origin", 3));
    if (element.has("Direction")) {
      ASPERITY_TRY(const std::vector<double> direction, numbers(text_, element, "Direction", 9));
      for (std::size_t i = 0; i < 9; ++i) {
        if (std::abs(direction[i] - (i % 4 == 0 ? 1.0 : 0.0)) > 1e-6)
          return bad(element, "Direction is turned", "a grid along x, y, z", ErrorCode::file_unsupported);
      }
    }
    if (!element.has("Spacing")) return success();
    ASPERITY_TRY(const std::vector<double> spacing, numbers(text_, element, "Spacing", 3));
    for (std::size_t a = 0; a < 3; ++a) {
      if (!(spacing[a] > 0.0)) {
        return bad(element, fmt::format("Spacing of axis {} is {:g}", "xyz"[a], spacing[a]), "a number above 0",
                   ErrorCode::bad_value);
      }
    }
    return success();
  }

  Status check_piece(const XmlElement& element) {
    ++pieces_;
    if (type_ == "UnstructuredGrid") {
      for (const char* key : {"NumberOfPoints", "NumberOfCells"}) {
        ASPERITY_TRY(const std::vector<std::int64_t> count, whole_numbers(text_, element, key, 1));
        if (count[0] < 0)
          return bad(element, fmt::format("{} is {}", key, count[0]), "0 or more", ErrorCode::bad_value);
        (key[8] == 'P' ? points_ : cells_) = static_cast<std::uint64_t>(count[0]);
      }
    } else {
      ASPERITY_TRY(piece_, extent(element, "Extent"));
      if (!have_whole_) return bad(element, "stands outside its grid", "a piece within the grid");
      points_ = cells_ = 1;
      for (std::size_t a = 0; a < 3; ++a) {
        if (piece_[2 * a] < whole_[2 * a] || piece_[2 * a + 1] > whole_[2 * a + 1])
          return bad(element, "Extent is not within WholeExtent", "a piece within the grid", ErrorCode::bad_value);
        const auto cells = static_cast<std::uint64_t>(piece_[2 * a + 1] - piece_[2 * a]);
        cells_ *= cells;
        points_ *= cells + 1;
        if (points_ > most_bytes_) return too_much(element, points_, "points");
      }
    }
    if (points_ > most_held() || cells_ > most_held()) return too_much(element, std::max(points_, cells_), "points");
    return success();
  }

  [[nodiscard]] std::uint64_t most_held() const {
    return std::min<std::uint64_t>(most_bytes_, text_.size() * (compressed_ ? most_packed : most_unpacked));
  }
  [[nodiscard]] Error too_much(const XmlElement& element, std::uint64_t count, const char* what) const {
    return bad(element, fmt::format("declares {} {} or more in a file of {} bytes", count, what, text_.size()),
               fmt::format("no more than the file can hold, and at most {} MiB", most_bytes_ >> 20U),
               ErrorCode::too_large);
  }

  /// Values that an array has to hold by where it stands; nothing where only its own data can tell.
  Result<std::optional<std::uint64_t>> expected_tuples(const XmlElement& element) const {
    const XmlElement& parent = elements_[element.parent];
    const std::string_view place = parent.name;
    if (place == "PointData" || place == "Points") return std::optional(points_);
    if (place == "CellData") return std::optional(cells_);
    if (place == "FieldData") {
      if (!element.has("NumberOfTuples")) return std::optional<std::uint64_t>{};
      ASPERITY_TRY(const std::vector<std::int64_t> tuples, whole_numbers(text_, element, "NumberOfTuples", 1));
      if (tuples[0] < 0 || static_cast<std::uint64_t>(tuples[0]) > most_held())
        return too_much(element, static_cast<std::uint64_t>(std::max<std::int64_t>(tuples[0], 0)), "tuples");
      return std::optional<std::uint64_t>{};
    }
    if (place == "Coordinates") {
      std::size_t axis = 0;
      for (const XmlElement& other : elements_) {
        if (&other == &element) break;
        if (other.name == "DataArray" && other.parent == element.parent) ++axis;
      }
      if (axis > 2) return bad(element, "is a fourth axis", "three axes");
      return std::optional(static_cast<std::uint64_t>(piece_[2 * axis + 1] - piece_[2 * axis]) + 1);
    }
    if (place == "Cells") {
      const std::string_view name = element.attribute("Name");
      if (name == "offsets" || name == "types") return std::optional(cells_);
      return std::optional<std::uint64_t>{};
    }
    return bad(element, fmt::format("stands in <{}>", place.substr(0, 40)), "PointData, CellData, Points, Coordinates");
  }

  Status check_array(const XmlElement& element) {
    const std::string_view type = element.attribute("type");
    const bool strings = type == "String" && elements_[element.parent].name == "FieldData";
    const std::size_t bytes_each = strings ? 1 : xml_type_bytes(type);
    if (bytes_each == 0) {
      return bad(element, fmt::format("type is \"{}\"", type.substr(0, 40)), "a type of numbers",
                 ErrorCode::file_unsupported);
    }
    std::uint64_t components = 1;
    if (element.has("NumberOfComponents")) {
      ASPERITY_TRY(const std::vector<std::int64_t> read, whole_numbers(text_, element, "NumberOfComponents", 1));
      if (read[0] < 1 || read[0] > 1000)
        return bad(element, fmt::format("NumberOfComponents is {}", read[0]), "1 to 1000", ErrorCode::bad_value);
      components = static_cast<std::uint64_t>(read[0]);
    }
    if (elements_[element.parent].name == "Points" && components != 3)
      return bad(element, fmt::format("NumberOfComponents is {}", components), "3", ErrorCode::bad_value);
    ASPERITY_TRY(const std::optional<std::uint64_t> tuples, expected_tuples(element));
    std::optional<std::uint64_t> declared;
    if (tuples) {
      declared = *tuples * components * bytes_each;
      declared_ += *declared;
      if (declared_ > most_held()) return too_much(element, declared_, "bytes");
    }
    const std::string_view format = element.attribute("format");
    if (format == "ascii") return check_text(element, strings, tuples ? std::optional(*tuples * components) : tuples);
    if (format == "binary") return check_block(element, content(element), true, declared);
    if (format != "appended")
      return bad(element, fmt::format("format is \"{}\"", format.substr(0, 40)), "ascii, binary or appended");
    ASPERITY_TRY(const std::vector<std::int64_t> offset, whole_numbers(text_, element, "offset", 1));
    if (offset[0] < 0 || static_cast<std::uint64_t>(offset[0]) >= appended_.size()) {
      return bad(element, fmt::format("offset is {} of {} bytes appended", offset[0], appended_.size()),
                 "a place within the file", ErrorCode::file_truncated);
    }
    return check_block(element, appended_.substr(static_cast<std::size_t>(offset[0])), appended_base64_, declared);
  }

  /// What stands between the array's tags, without the space around it.
  [[nodiscard]] std::string_view content(const XmlElement& element) const {
    const std::size_t end = std::min(text_.find('<', element.content), text_.size());
    std::string_view inside = text_.substr(element.content, end - element.content);
    const std::size_t first = inside.find_first_not_of(" \t\r\n");
    if (first == std::string_view::npos) return {};
    return inside.substr(first, inside.find_last_not_of(" \t\r\n") + 1 - first);
  }

  Status check_text(const XmlElement& element, bool strings, std::optional<std::uint64_t> expected) const {
    if (strings) return success();
    mesh_readers::TextCursor words(content(element));
    std::uint64_t count = 0;
    for (std::string_view word = words.next_word(); !word.empty(); word = words.next_word(), ++count) {
      double value = 0.0;
      if (!mesh_readers::parse_number(word, value) || !std::isfinite(value))
        return bad(element, fmt::format("\"{}\" stands where a number is expected", word.substr(0, 40)),
                   "finite numbers");
    }
    if (!expected || count == *expected) return success();
    return bad(element, fmt::format("holds {} numbers, {} are needed", count, *expected), "as many as its piece has",
               count < *expected ? ErrorCode::file_truncated : ErrorCode::file_malformed);
  }

  /// The first words of a block's header.
  Result<std::vector<std::uint64_t>> words(const XmlElement& element, std::string_view block, bool base64,
                                           std::size_t count) const {
    const std::size_t length = count * word_;
    std::string decoded;
    if (!base64) {
      decoded = std::string(block.substr(0, length));
    } else if (!mesh_readers::decode_base64(block.substr(0, (length + 2) / 3 * 4), length, decoded)) {
      decoded.clear();
    }
    if (decoded.size() < length)
      return bad(element, "its data end within their header", "a whole file", ErrorCode::file_truncated);
    std::vector<std::uint64_t> read(count, 0);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < word_; ++k) {
        const std::size_t byte = i * word_ + (big_endian_ ? k : word_ - 1 - k);
        read[i] = (read[i] << 8U) | static_cast<unsigned char>(decoded[byte]);
      }
    }
    return read;
  }

  Status check_block(const XmlElement& element, std::string_view block, bool base64,
                     std::optional<std::uint64_t> declared) {
    const std::uint64_t held = base64 ? block.size() / 4 * 3 + 3 : block.size();
    const auto truncated = [&](std::uint64_t needed) {
      return bad(element, fmt::format("its data need {} bytes, {} are there", needed, held), "a whole file",
                 ErrorCode::file_truncated);
    };
    ASPERITY_TRY(const std::vector<std::uint64_t> first, words(element, block, base64, 1));
    std::uint64_t unpacked = first[0];
    if (!compressed_) {
      if (first[0] > held) return truncated(first[0]);
    } else {
      if (first[0] > held / word_) return truncated(first[0]);
      ASPERITY_TRY(const std::vector<std::uint64_t> sizes,
                   words(element, block, base64, first[0] == 0 ? 1 : 3 + static_cast<std::size_t>(first[0])));
      std::uint64_t packed = 0;
      unpacked = 0;
      if (first[0] > 0) {
        if (sizes[1] > most_held() || sizes[2] > sizes[1] || sizes[1] == 0 || sizes[1] > most_held() / first[0])
          return too_much(element, sizes[1], "bytes");
        unpacked = (first[0] - (sizes[2] > 0 ? 1 : 0)) * sizes[1] + sizes[2];
        for (std::size_t i = 3; i < sizes.size(); ++i) {
          if (sizes[i] > held) return truncated(sizes[i]);
          packed += sizes[i];
        }
      }
      if (packed > held) return truncated(packed);
    }
    if (unpacked > most_held()) return too_much(element, unpacked, "bytes");
    if (!declared) {
      declared_ += unpacked;
      return declared_ > most_held() ? Status(too_much(element, declared_, "bytes")) : success();
    }
    if (unpacked == *declared) return success();
    return bad(element, fmt::format("its data are {} bytes, {} are needed", unpacked, *declared),
               "as many as its piece has",
               unpacked < *declared ? ErrorCode::file_truncated : ErrorCode::file_malformed);
  }

  std::string_view text_;
  std::string_view type_;
  std::size_t most_bytes_;
  std::vector<XmlElement> elements_;
  std::string_view appended_;
  bool appended_base64_ = false;
  bool big_endian_ = false;
  bool compressed_ = false;
  bool have_whole_ = false;
  std::size_t word_ = 4;
  std::size_t pieces_ = 0;
  std::array<std::int64_t, 6> whole_{};
  std::array<std::int64_t, 6> piece_{};
  std::uint64_t points_ = 0;
  std::uint64_t cells_ = 0;
  std::uint64_t declared_ = 0;
};

}  // namespace

std::size_t xml_type_bytes(std::string_view type) {
  static constexpr std::pair<std::string_view, std::size_t> types[] = {
      {"Int8", 1},  {"UInt8", 1},  {"Int16", 2},   {"UInt16", 2},  {"Int32", 4}, {"UInt32", 4},
      {"Int64", 8}, {"UInt64", 8}, {"Float32", 4}, {"Float64", 8}, {"Bit", 1}};
  return bytes_of(types, type);
}

Status check_xml(std::string_view bytes, std::string_view type, std::size_t most_bytes) {
  if (bytes.empty()) return refused(ErrorCode::file_empty, "is empty", {}, "a VTK XML file");
  return XmlFile(bytes, type, most_bytes).check();
}

}  // namespace asperity::vtk_io
