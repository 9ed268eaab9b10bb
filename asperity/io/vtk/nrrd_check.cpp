// Headers of NRRD files (.nrrd, .nhdr), read before VTK reads the samples.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asperity/io/detail/mesh_readers.h"
#include "asperity/io/vtk/file_checks.h"

namespace asperity::vtk_io {
namespace {

constexpr std::uint64_t most_nrrd_samples_along_axis = 1U << 24U;

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") + 1 - first);
}

std::size_t nrrd_type_bytes(std::string_view type) {
  static constexpr std::pair<std::string_view, std::size_t> types[] = {
      {"signed char", 1},  {"int8", 1},       {"int8_t", 1},   {"uchar", 1},          {"unsigned char", 1},
      {"uint8", 1},        {"uint8_t", 1},    {"short", 2},    {"short int", 2},      {"int16", 2},
      {"int16_t", 2},      {"ushort", 2},     {"uint16", 2},   {"unsigned short", 2}, {"uint16_t", 2},
      {"int", 4},          {"signed int", 4}, {"int32", 4},    {"int32_t", 4},        {"uint", 4},
      {"unsigned int", 4}, {"uint32", 4},     {"uint32_t", 4}, {"int64", 8},          {"uint64", 8},
      {"long long", 8},    {"float", 4},      {"double", 8}};
  return bytes_of(types, type);
}

/// Fields that say nothing of what is read here.
bool is_other_field(std::string_view key) {
  constexpr std::string_view fields =
      "|content|centers|centerings|block size|blocksize|min|max|old min|oldmin|old max|oldmax|number|"
      "thicknesses|axis maxs|axismaxs|labels|units|space|space dimension|space units|sample units|"
      "sampleunits|measurement frame|axis units|measurementframe|";
  return key.find('|') == std::string_view::npos && fields.find(fmt::format("|{}|", key)) != std::string_view::npos;
}

class NrrdFile {
 public:
  NrrdFile(std::string_view bytes, std::size_t most_bytes, std::string& detached)
      : bytes_(bytes), cursor_(bytes), most_bytes_(most_bytes), detached_(detached) {}

  Result<NrrdHeader> check() {
    std::string_view line;
    if (!cursor_.next_line(line) || !line.starts_with("NRRD000"))
      return bad("does not begin with \"NRRD000\"", "a NRRD file");
    bool ended = false;
    while (cursor_.next_line(line)) {
      line = trimmed(line);
      if (line.empty()) {
        ended = true;
        break;
      }
      if (!std::all_of(line.begin(), line.end(), [](char c) { return (c >= ' ' && c <= '~') || c == '\t'; }))
        return bad("has a character that is not printed", "a header of plain text");
      if (line.front() == '#' || line.find(":=") != std::string_view::npos) continue;
      const std::size_t colon = line.find(':');
      if (colon == std::string_view::npos) return bad("has a line that is no field", "field: value");
      ASPERITY_CHECK(field(std::string(trimmed(line.substr(0, colon))), trimmed(line.substr(colon + 1))));
    }
    if (!ended && detached_.empty()) {
      return refused(ErrorCode::file_truncated, "ends within its header", cursor_.place(), "a whole file");
    }
    header_.data_at = std::min(cursor_.offset(), bytes_.size());
    ASPERITY_CHECK(complete());
    header_.plain = written_anew();
    return header_;
  }

 private:
  [[nodiscard]] Error bad(std::string what, std::string accepted, ErrorCode code = ErrorCode::file_malformed) const {
    return refused(code, std::move(what), cursor_.place(), std::move(accepted));
  }

  Status field(const std::string& key, std::string_view value) {
    if (key == "type") {
      bytes_each_ = nrrd_type_bytes(value);
      type_ = std::string(value);
      if (bytes_each_ == 0)
        return bad(fmt::format("type is \"{}\"", value.substr(0, 40)), "a type of numbers",
                   ErrorCode::file_unsupported);
    } else if (key == "dimension") {
      if (!mesh_readers::parse_integer(value, dimension_) || dimension_ < 1 || dimension_ > 16)
        return bad(fmt::format("dimension is \"{}\"", value.substr(0, 40)), "3, or 4 with vectors",
                   ErrorCode::bad_value);
    } else if (key == "sizes") {
      return sizes(value);
    } else if (key == "encoding") {
      encoding_ = std::string(value);
    } else if (key == "endian") {
      if (value != "little" && value != "big")
        return bad(fmt::format("endian is \"{}\"", value.substr(0, 40)), "little or big", ErrorCode::bad_value);
      have_endian_ = true;
      endian_ = std::string(value);
    } else if (key == "spacings") {
      return spacings(value);
    } else if (key == "space directions") {
      return directions(value);
    } else if (key == "space origin") {
      return vector(value, header_.origin, "space origin");
    } else if (key == "axis mins" || key == "axismins") {
      has_axis_mins_ = true;
    } else if (key == "kinds") {
      domain_first_ = value.starts_with("domain") || value.starts_with("space");
    } else if (key == "data file" || key == "datafile") {
      detached_ = std::string(value);
    } else if (key == "line skip" || key == "lineskip" || key == "byte skip" || key == "byteskip") {
      if (value != "0")
        return bad(fmt::format("{} is not 0", key), "data that begin at once", ErrorCode::file_unsupported);
    } else if (!is_other_field(key)) {
      return bad(fmt::format("\"{}\" is no field of a NRRD file", key.substr(0, 40)), "the fields of the format",
                 ErrorCode::bad_key);
    }
    return success();
  }

  Status sizes(std::string_view value) {
    for (std::string_view word = mesh_readers::take_word(value); !word.empty(); word = mesh_readers::take_word(value)) {
      std::int64_t n = 0;
      if (!mesh_readers::parse_integer(word, n) || n < 1 ||
          static_cast<std::uint64_t>(n) > most_nrrd_samples_along_axis) {
        return bad(fmt::format("sizes has \"{}\"", word.substr(0, 40)),
                   fmt::format("whole numbers, 1 to {}", most_nrrd_samples_along_axis), ErrorCode::bad_value);
      }
      if (sizes_.size() == 16) return bad("has more than 16 sizes", "three or four sizes", ErrorCode::bad_value);
      sizes_.push_back(static_cast<std::uint64_t>(n));
    }
    return success();
  }

  Status spacings(std::string_view value) {
    spacings_.clear();
    for (std::string_view word = mesh_readers::take_word(value); !word.empty(); word = mesh_readers::take_word(value)) {
      if (!mesh_readers::parse_number(word, spacings_.emplace_back()))
        return bad(fmt::format("spacings has \"{}\"", word.substr(0, 40)), "numbers above 0", ErrorCode::bad_value);
    }
    return success();
  }

  /// "(1,0,0)"
  Status vector(std::string_view value, std::array<double, 3>& out, const char* what) {
    std::string text(value);
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c == '(' || c == ')' || c == ','; }, ' ');
    std::string_view rest = text;
    for (double& number : out) {
      const std::string_view word = mesh_readers::take_word(rest);
      if (!mesh_readers::parse_number(word, number) || !std::isfinite(number))
        return bad(fmt::format("{} is \"{}\"", what, value.substr(0, 60)), "(x,y,z)", ErrorCode::bad_value);
    }
    return success();
  }

  Status directions(std::string_view value) {
    std::size_t axis = 0;
    while (!(value = trimmed(value)).empty()) {
      if (value.starts_with("none")) {
        value.remove_prefix(4);
        continue;
      }
      const std::size_t end = value.find(')');
      if (axis == 3 || end == std::string_view::npos)
        return bad("space directions are not three vectors", "(x,0,0) (0,y,0) (0,0,z)", ErrorCode::bad_value);
      std::array<double, 3> direction{};
      ASPERITY_CHECK(vector(value.substr(0, end + 1), direction, "space directions"));
      for (std::size_t a = 0; a < 3; ++a) {
        if (a != axis && std::abs(direction[a]) > 1e-9 * std::abs(direction[axis]))
          return bad("space directions are turned", "a grid along x, y, z", ErrorCode::file_unsupported);
      }
      header_.spacing[axis] = direction[axis];
      ++axis;
      value.remove_prefix(end + 1);
    }
    return success();
  }

  Status complete() {
    if (bytes_each_ == 0 || dimension_ == 0 || sizes_.empty() || encoding_.empty())
      return bad("does not state type, dimension, sizes and encoding", "a whole NRRD header");
    if (sizes_.size() != static_cast<std::size_t>(dimension_)) {
      return bad(fmt::format("has {} sizes of {} dimensions", sizes_.size(), dimension_), "a size for each dimension",
                 ErrorCode::bad_value);
    }
    const auto flat = [&](std::size_t colours, std::size_t a, std::size_t b) {
      return sizes_[colours] <= 4 && sizes_[a] > 4 && sizes_[b] > 4;
    };
    const bool image = dimension_ < 3 || (dimension_ == 3 && !domain_first_ && (flat(0, 1, 2) || flat(2, 0, 1)));
    if (image) {
      return bad(fmt::format("is an image ({} samples): it has no depth", joined()),
                 "a volume of three dimensions, or four with the components first", ErrorCode::file_unsupported);
    }
    const bool vectors = dimension_ == 4;
    if (dimension_ > 4 || (vectors && sizes_[0] != 1 && sizes_[0] != 3)) {
      return bad(fmt::format("has {} samples", joined()), "three dimensions, or four with 1 or 3 components first",
                 ErrorCode::file_unsupported);
    }
    header_.components = vectors ? static_cast<int>(sizes_[0]) : 1;
    std::uint64_t count = 1;
    for (const std::uint64_t n : sizes_) {
      if (count > most_bytes_ / n / bytes_each_) {
        return bad(fmt::format("declares {} samples", joined()), fmt::format("at most {} MiB", most_bytes_ >> 20U),
                   ErrorCode::too_large);
      }
      count *= n;
    }
    for (std::size_t a = 0; a < 3; ++a) {
      header_.size[a] = sizes_[a + (vectors ? 1 : 0)];
      if (header_.size[a] < 2)
        return bad(fmt::format("axis {} has one sample", "xyz"[a]), "two samples or more", ErrorCode::bad_value);
    }
    ASPERITY_CHECK(geometry(vectors));
    return length(count);
  }

  [[nodiscard]] std::string joined() const {
    std::string text;
    for (const std::uint64_t n : sizes_) text += (text.empty() ? "" : " x ") + std::to_string(n);
    return text;
  }

  Status geometry(bool vectors) {
    if (has_axis_mins_)
      return bad("places its axes by \"axis mins\"", "spacings, or space directions and origin",
                 ErrorCode::file_unsupported);
    if (!spacings_.empty()) {
      if (spacings_.size() != sizes_.size())
        return bad(fmt::format("has {} spacings", spacings_.size()), "a spacing for each size", ErrorCode::bad_value);
      for (std::size_t a = 0; a < 3; ++a) header_.spacing[a] = spacings_[a + (vectors ? 1 : 0)];
    }
    for (std::size_t a = 0; a < 3; ++a) {
      if (!std::isfinite(header_.spacing[a]) || !(header_.spacing[a] > 0.0)) {
        return bad(fmt::format("spacing of axis {} is {:g}", "xyz"[a], header_.spacing[a]), "a number above 0",
                   ErrorCode::bad_value);
      }
    }
    return success();
  }

  [[nodiscard]] std::string written_anew() const {
    std::string sizes;
    for (const std::uint64_t n : sizes_) sizes.append(1, ' ').append(std::to_string(n));
    return fmt::format("NRRD0004\ntype: {}\ndimension: {}\nsizes:{}\nencoding: {}\nendian: {}\n\n", type_,
                       sizes_.size(), sizes, header_.packed ? "gzip" : "raw", endian_);
  }

  /// Whether what follows the header can be what it declares.
  Status length(std::uint64_t count) {
    // VTK 9.1 also takes text, and misreads it.
    if (encoding_ != "raw" && encoding_ != "gzip" && encoding_ != "gz") {
      return bad(fmt::format("encoding is \"{}\"", encoding_.substr(0, 40)), "raw or gzip",
                 ErrorCode::file_unsupported);
    }
    if (encoding_ == "raw" && bytes_each_ > 1 && !have_endian_)
      return bad("does not state its endian", "endian: little");
    header_.packed = encoding_ != "raw";
    header_.data_bytes = count * bytes_each_;
    if (!detached_.empty()) return success();
    const std::uint64_t held = bytes_.size() - std::min(bytes_.size(), cursor_.offset());
    if (header_.data_bytes <= (header_.packed ? held * 1100 : held)) return success();
    return refused(ErrorCode::file_truncated,
                   fmt::format("declares {} bytes of samples, {} are there", header_.data_bytes, held),
                   fmt::format("byte {}", bytes_.size()), "a whole file");
  }

  std::string_view bytes_;
  mesh_readers::TextCursor cursor_;
  std::size_t most_bytes_;
  std::string& detached_;
  NrrdHeader header_;
  std::size_t bytes_each_ = 0;
  std::int64_t dimension_ = 0;
  std::vector<std::uint64_t> sizes_;
  std::vector<double> spacings_;
  std::string encoding_;
  bool have_endian_ = false;
  std::string endian_ = "little";
  std::string type_;
  bool has_axis_mins_ = false;
  bool domain_first_ = false;
};

}  // namespace

Result<NrrdHeader> check_nrrd(std::string_view bytes, std::size_t most_bytes, std::string& detached) {
  if (bytes.empty()) return refused(ErrorCode::file_empty, "is empty", {}, "a NRRD file");
  return NrrdFile(bytes, most_bytes, detached).check();
}

}  // namespace asperity::vtk_io
