// Legacy VTK files (.vtk), walked through before VTK reads them.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "asperity/io/detail/mesh_readers.h"
#include "asperity/io/vtk/file_checks.h"

namespace asperity::vtk_io {
namespace {

constexpr std::uint64_t most_along_axis = 1U << 24U;

using mesh_readers::same_word;

class LegacyFile {
 public:
  LegacyFile(std::string_view bytes, std::size_t most_bytes) : bytes_(bytes), most_bytes_(most_bytes) {}

  Result<std::string> check() {
    ASPERITY_CHECK(heading());
    ASPERITY_CHECK(expect("DATASET"));
    const std::string kind(word());
    for (const char* known : {"STRUCTURED_POINTS", "RECTILINEAR_GRID", "STRUCTURED_GRID"}) {
      if (same_word(kind, known)) kind_ = known;
    }
    if (kind_.empty()) {
      return refused(ErrorCode::file_unsupported, fmt::format("holds a dataset \"{}\"", kind.substr(0, 40)), place(),
                     "STRUCTURED_POINTS, RECTILINEAR_GRID or STRUCTURED_GRID; unstructured grids as .vtu");
    }
    for (std::string_view key = word(); !key.empty(); key = word()) ASPERITY_CHECK(section(std::string(key)));
    if (!have_size_) return bad("states no DIMENSIONS", "DIMENSIONS with three numbers of nodes");
    ASPERITY_CHECK(complete());
    kept_.append(bytes_.substr(kept_to_));
    return std::move(kept_);
  }

 private:
  [[nodiscard]] std::string place() const {
    const std::string_view before = bytes_.substr(0, std::min(word_at_, bytes_.size()));
    // Lines of a binary file mean nothing after its first data.
    if (binary_ && data_seen_) return fmt::format("byte {}", word_at_);
    return fmt::format("line {}", 1 + std::count(before.begin(), before.end(), '\n'));
  }
  [[nodiscard]] Error bad(std::string what, std::string accepted, ErrorCode code = ErrorCode::file_malformed) const {
    return refused(code, std::move(what), place(), std::move(accepted));
  }
  [[nodiscard]] Error ends() const {
    return refused(ErrorCode::file_truncated, "ends before what it declares", fmt::format("byte {}", bytes_.size()),
                   "a whole file");
  }

  std::string_view word() {
    while (at_ < bytes_.size() && (mesh_readers::is_blank(bytes_[at_]) || bytes_[at_] == '\n')) ++at_;
    word_at_ = at_;
    while (at_ < bytes_.size() && !mesh_readers::is_blank(bytes_[at_]) && bytes_[at_] != '\n') ++at_;
    return bytes_.substr(word_at_, at_ - word_at_);
  }
  std::string_view line() {
    word_at_ = at_;
    const std::size_t end = std::min(bytes_.find('\n', at_), bytes_.size());
    const std::string_view text = bytes_.substr(at_, end - at_);
    at_ = std::min(end + 1, bytes_.size());
    return text;
  }
  /// The next word without taking it.
  std::string peek() {
    const std::size_t at = at_;
    const std::string next(word());
    at_ = at;
    return next;
  }

  Status expect(std::string_view key) {
    const std::string_view found = word();
    if (found.empty()) return ends();
    if (!same_word(found, key))
      return bad(fmt::format("\"{}\" stands where {} is expected", found.substr(0, 40), key), std::string(key));
    return success();
  }

  Status heading() {
    const std::string_view first = line();
    if (!first.starts_with("# vtk DataFile Version"))
      return bad("does not begin with \"# vtk DataFile Version\"", "a legacy VTK file");
    line();
    const std::string_view format = word();
    if (format.empty()) return ends();
    binary_ = same_word(format, "BINARY");
    if (!binary_ && !same_word(format, "ASCII"))
      return bad(fmt::format("\"{}\" is no format", format.substr(0, 40)), "ASCII or BINARY");
    return success();
  }

  Result<std::uint64_t> count(const char* what, std::uint64_t least, std::uint64_t most) {
    const std::string_view text = word();
    if (text.empty()) return ends();
    std::int64_t value = 0;
    if (!mesh_readers::parse_integer(text, value) || value < static_cast<std::int64_t>(least) ||
        static_cast<std::uint64_t>(value) > most) {
      return bad(fmt::format("{} is \"{}\"", what, text.substr(0, 40)),
                 fmt::format("a whole number, {} to {}", least, most), ErrorCode::bad_value);
    }
    return static_cast<std::uint64_t>(value);
  }

  Status three(const char* what, bool above_zero) {
    for (const char axis : {'x', 'y', 'z'}) {
      const std::string_view text = word();
      if (text.empty()) return ends();
      double value = 0.0;
      if (!mesh_readers::parse_number(text, value) || !std::isfinite(value) || (above_zero && !(value > 0.0))) {
        return bad(fmt::format("{} of axis {} is \"{}\"", what, axis, text.substr(0, 40)),
                   above_zero ? "a number above 0" : "a number", ErrorCode::bad_value);
      }
    }
    return success();
  }

  Status dimensions() {
    static constexpr std::array<const char*, 3> axes{"DIMENSIONS of axis x", "DIMENSIONS of axis y",
                                                     "DIMENSIONS of axis z"};
    points_ = cells_ = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      ASPERITY_TRY(size_[a], count(axes[a], 2, most_along_axis));
      points_ *= size_[a];
      cells_ *= size_[a] - 1;
      if (points_ > most_bytes_) return bad(fmt::format("declares {} points and more", points_), limit(), too_large);
    }
    // Every sample takes at least a bit.
    if (points_ / 8 > bytes_.size() && kind_ != "RECTILINEAR_GRID")
      return bad(fmt::format("declares {} points in a file of {} bytes", points_, bytes_.size()),
                 "no more than the file can hold", too_large);
    have_size_ = true;
    return success();
  }

  [[nodiscard]] std::string limit() const { return fmt::format("at most {} MiB", most_bytes_ >> 20U); }

  /// The values of an array: numbers in text, bytes otherwise.
  Status values(std::uint64_t tuples, std::uint64_t components, std::string_view type) {
    const std::size_t bytes_each = legacy_type_bytes(type);
    if (bytes_each == 0) {
      return bad(fmt::format("an array is of type \"{}\"", type.substr(0, 40)), "a type of numbers",
                 ErrorCode::file_unsupported);
    }
    const std::uint64_t left = bytes_.size() - at_;
    const std::uint64_t per = std::max<std::uint64_t>(components, 1);
    if (tuples > most_bytes_ / per / bytes_each)
      return bad(fmt::format("declares {} times {} values", tuples, components), limit(), too_large);
    const std::uint64_t all = tuples * components;
    allocated_ += all * bytes_each;
    if (allocated_ > most_bytes_) return bad("declares too much data", limit(), too_large);
    if (binary_) return skip_binary(all, type, bytes_each);
    if (all > left) return ends();
    for (std::uint64_t i = 0; i < all; ++i) {
      const std::string_view text = word();
      if (text.empty()) return ends();
      double value = 0.0;
      if (!mesh_readers::parse_number(text, value))
        return bad(fmt::format("\"{}\" stands where a number is expected", text.substr(0, 40)), "a number");
      if (!std::isfinite(value))
        return bad(fmt::format("\"{}\" cannot be read from a text file", text.substr(0, 40)), "a finite number");
    }
    return success();
  }

  Status skip_binary(std::uint64_t all, std::string_view type, std::size_t bytes_each) {
    line();
    data_seen_ = true;
    const std::uint64_t length = same_word(type, "bit") ? (all + 7) / 8 : all * bytes_each;
    if (length > bytes_.size() - at_) return ends();
    at_ += static_cast<std::size_t>(length);
    return success();
  }

  Status section(const std::string& key) {
    if (same_word(key, "DIMENSIONS")) return dimensions();
    if (same_word(key, "SPACING") || same_word(key, "ASPECT_RATIO")) return three("SPACING", true);
    if (same_word(key, "ORIGIN")) return three("ORIGIN", false);
    for (std::size_t a = 0; a < 3; ++a) {
      static constexpr std::array<const char*, 3> keys{"X_COORDINATES", "Y_COORDINATES", "Z_COORDINATES"};
      if (same_word(key, keys[a])) return coordinates(keys[a], a);
    }
    if (same_word(key, "POINTS")) return points();
    if (same_word(key, "POINT_DATA")) return data(points_, true);
    if (same_word(key, "CELL_DATA")) return data(cells_, false);
    if (same_word(key, "FIELD")) return field();
    if (same_word(key, "METADATA")) return metadata();
    return attribute(key);
  }

  Status coordinates(const char* key, std::size_t axis) {
    if (!have_size_) return bad(fmt::format("{} stands before DIMENSIONS", key), "DIMENSIONS first");
    ASPERITY_TRY(const std::uint64_t n, count(key, 2, most_along_axis));
    if (n != size_[axis])
      return bad(fmt::format("{} are {}, DIMENSIONS say {}", key, n, size_[axis]), "as many as DIMENSIONS say");
    axes_seen_ |= 1U << axis;
    return values(n, 1, std::string(word()));
  }

  Status points() {
    if (!have_size_) return bad("POINTS stand before DIMENSIONS", "DIMENSIONS first");
    ASPERITY_TRY(const std::uint64_t n, count("POINTS", 1, most_bytes_));
    if (n != points_)
      return bad(fmt::format("POINTS are {}, DIMENSIONS say {}", n, points_), "as many as DIMENSIONS say");
    axes_seen_ |= 8U;
    return values(n, 3, std::string(word()));
  }

  Status data(std::uint64_t expected, bool of_points) {
    const char* key = of_points ? "POINT_DATA" : "CELL_DATA";
    if (!have_size_) return bad(fmt::format("{} stands before DIMENSIONS", key), "DIMENSIONS first");
    ASPERITY_TRY(tuples_, count(key, 0, most_bytes_));
    if (tuples_ != expected)
      return bad(fmt::format("{} is {}, DIMENSIONS say {}", key, tuples_, expected), "as many as DIMENSIONS say");
    in_data_ = true;
    return success();
  }

  Status field() {
    word();  // its name
    ASPERITY_TRY(const std::uint64_t arrays, count("FIELD", 0, 100'000));
    for (std::uint64_t i = 0; i < arrays; ++i) {
      while (same_word(peek(), "METADATA")) {
        word();
        ASPERITY_CHECK(metadata());
      }
      if (word().empty()) return ends();
      ASPERITY_TRY(const std::uint64_t components, count("number of components", 0, 1000));
      ASPERITY_TRY(const std::uint64_t tuples, count("number of tuples", 0, most_bytes_));
      ASPERITY_CHECK(values(tuples, components, std::string(word())));
    }
    return success();
  }

  /// Lines up to an empty one, left out of what is kept.
  Status metadata() {
    kept_.append(bytes_.substr(kept_to_, word_at_ - kept_to_));
    line();
    while (true) {
      if (bytes_.find('\n', at_) == std::string_view::npos) return ends();
      if (line().empty()) break;
    }
    kept_to_ = at_;
    return success();
  }

  Status scalars() {
    if (word().empty()) return ends();
    const std::string type(word());
    std::string_view rest = line();
    const std::string_view components_text = mesh_readers::take_word(rest);
    std::int64_t components = 1;
    if (!components_text.empty() &&
        (!mesh_readers::parse_integer(components_text, components) || components < 1 || components > 1000)) {
      return bad(fmt::format("number of components is \"{}\"", components_text.substr(0, 40)),
                 "a whole number, 1 to 1000");
    }
    ASPERITY_CHECK(expect("LOOKUP_TABLE"));
    word();
    return values(tuples_, static_cast<std::uint64_t>(components), type);
  }

  Status attribute(const std::string& key) {
    if (!in_data_) {
      return bad(fmt::format("\"{}\" stands where a section is expected", key.substr(0, 40)),
                 "DIMENSIONS, SPACING, ORIGIN, ..._COORDINATES, POINTS, POINT_DATA, CELL_DATA");
    }
    if (same_word(key, "SCALARS")) return scalars();
    const auto named = [&](std::uint64_t components) -> Status {
      if (word().empty()) return ends();
      return values(tuples_, components, std::string(word()));
    };
    if (same_word(key, "VECTORS") || same_word(key, "NORMALS")) return named(3);
    if (same_word(key, "TENSORS")) return named(9);
    if (same_word(key, "TENSORS6")) return named(6);
    if (same_word(key, "GLOBAL_IDS") || same_word(key, "PEDIGREE_IDS")) return named(1);
    if (same_word(key, "TEXTURE_COORDINATES")) {
      if (word().empty()) return ends();
      ASPERITY_TRY(const std::uint64_t components, count("number of components", 1, 3));
      return values(tuples_, components, std::string(word()));
    }
    const std::string bytes = binary_ ? "unsigned_char" : "float";
    if (same_word(key, "COLOR_SCALARS")) {
      if (word().empty()) return ends();
      ASPERITY_TRY(const std::uint64_t components, count("number of components", 1, 1000));
      return values(tuples_, components, bytes);
    }
    if (same_word(key, "LOOKUP_TABLE")) {
      if (word().empty()) return ends();
      ASPERITY_TRY(const std::uint64_t colours, count("size of the table", 1, most_along_axis));
      return values(colours, 4, bytes);
    }
    return bad(fmt::format("\"{}\" stands where an array is expected", key.substr(0, 40)),
               "SCALARS, VECTORS, NORMALS, TENSORS, TEXTURE_COORDINATES, FIELD or LOOKUP_TABLE");
  }

  Status complete() {
    const unsigned needed = kind_ == "RECTILINEAR_GRID" ? 7U : (kind_ == "STRUCTURED_GRID" ? 8U : 0U);
    if ((axes_seen_ & needed) != needed) return ends();
    if (axes_seen_ != needed) return bad("has coordinates that its kind of dataset does not have", "those of its kind");
    if (!in_data_) return ends();
    return success();
  }

  static constexpr ErrorCode too_large = ErrorCode::too_large;
  std::string_view bytes_;
  std::size_t most_bytes_;
  std::size_t at_ = 0;
  std::size_t word_at_ = 0;
  std::string kind_;
  std::string kept_;         ///< what has been walked through, without what is left out
  std::size_t kept_to_ = 0;  ///< bytes before this are in `kept_` or left out
  bool binary_ = false;
  bool data_seen_ = false;
  bool have_size_ = false;
  bool in_data_ = false;
  unsigned axes_seen_ = 0;  ///< bits: x, y, z, points
  std::array<std::uint64_t, 3> size_{};
  std::uint64_t points_ = 0;
  std::uint64_t cells_ = 0;
  std::uint64_t tuples_ = 0;
  std::uint64_t allocated_ = 0;
};

}  // namespace

std::size_t legacy_type_bytes(std::string_view type) {
  static constexpr std::pair<std::string_view, std::size_t> types[] = {
      {"bit", 1},           {"char", 1},           {"signed_char", 1},  {"unsigned_char", 1},
      {"short", 2},         {"unsigned_short", 2}, {"int", 4},          {"unsigned_int", 4},
      {"vtkidtype", 4},     {"float", 4},          {"double", 8},       {"long", 8},
      {"unsigned_long", 8}, {"vtktypeint64", 8},   {"vtktypeuint64", 8}};
  for (const auto& [name, bytes] : types) {
    if (same_word(type, name)) return bytes;
  }
  return 0;
}

Result<std::string> check_legacy(std::string_view bytes, std::size_t most_bytes) {
  if (bytes.empty()) return refused(ErrorCode::file_empty, "is empty", {}, "a legacy VTK file");
  if (bytes.size() > most_bytes) {
    return refused(ErrorCode::too_large, fmt::format("has {} bytes", bytes.size()), {},
                   fmt::format("at most {} MiB; larger volumes as .vti or .vtr", most_bytes >> 20U));
  }
  return LegacyFile(bytes, most_bytes).check();
}

}  // namespace asperity::vtk_io
