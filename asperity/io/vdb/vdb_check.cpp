#include "asperity/io/vdb/vdb_check.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <limits>
#include <set>

namespace asperity::vdb_io {
namespace {

// Format versions (openvdb/version.h).
constexpr std::uint32_t oldest_version = 222;  // values under masks
constexpr std::uint32_t newest_version = 224;
// Compression flags (openvdb/io/Compression.h).
constexpr std::uint32_t zip = 1;
constexpr std::uint32_t active_mask = 2;
constexpr std::uint32_t blosc = 4;
constexpr std::size_t most_grids = 1000;
constexpr std::size_t most_metadata = 10'000;

/// A place in the bytes that only moves on over bytes that are there.
class Cursor {
 public:
  Cursor(std::string_view bytes, std::size_t at, std::size_t end) : bytes_(bytes), at_(at), end_(end) {}

  [[nodiscard]] std::size_t at() const { return at_; }
  [[nodiscard]] std::size_t left() const { return end_ - at_; }

  Status skip(std::uint64_t count) {
    if (count > left()) return truncated(count);
    at_ += static_cast<std::size_t>(count);
    return success();
  }
  Result<std::string_view> take(std::uint64_t count) {
    if (count > left()) return truncated(count);
    const std::string_view out = bytes_.substr(at_, static_cast<std::size_t>(count));
    at_ += static_cast<std::size_t>(count);
    return out;
  }
  template <class T>
  Result<T> number() {
    ASPERITY_TRY(const std::string_view from, take(sizeof(T)));
    T out;
    std::memcpy(&out, from.data(), sizeof(T));
    return out;
  }
  Result<std::string> text() {
    ASPERITY_TRY(const auto size, number<std::uint32_t>());
    ASPERITY_TRY(const std::string_view from, take(size));
    return std::string(from);
  }
  [[nodiscard]] Error malformed(std::string what, std::string accepted) const {
    return refused(ErrorCode::file_malformed, std::move(what), fmt::format("byte {}", at_), std::move(accepted));
  }

 private:
  [[nodiscard]] Error truncated(std::uint64_t count) const {
    return refused(end_ == bytes_.size() ? ErrorCode::file_truncated : ErrorCode::file_malformed,
                   fmt::format("declares {} bytes where {} are left", count, left()), fmt::format("byte {}", at_),
                   "the whole file, as it was written");
  }

  std::string_view bytes_;
  std::size_t at_ = 0;
  std::size_t end_ = 0;
};

/// Bytes of a value of metadata, which OpenVDB reads by its type, whatever size the file declares; 0: any.
std::size_t metadata_bytes(const std::string& type) {
  static const std::map<std::string, std::size_t> sizes{{"bool", 1},   {"int32", 4},  {"int64", 8},  {"float", 4},
                                                        {"double", 8}, {"vec2i", 8},  {"vec2s", 8},  {"vec2d", 16},
                                                        {"vec3i", 12}, {"vec3s", 12}, {"vec3d", 24}, {"vec4i", 16},
                                                        {"vec4s", 16}, {"vec4d", 32}, {"mat4s", 64}, {"mat4d", 128}};
  const auto found = sizes.find(type);
  return found == sizes.end() ? 0 : found->second;
}

/// An index of the leaves, for reading some of them alone. OpenVDB makes room for as many leaves as it declares.
Status check_index(std::string_view bytes, std::size_t tree_bytes, const Cursor& after) {
  if (bytes.empty()) return success();
  Cursor index(bytes, 0, bytes.size());
  const auto read = [&]() -> Status {
    ASPERITY_TRY(const auto leaves, index.number<std::uint32_t>());
    if (leaves > tree_bytes / 64) return index.malformed("lists more leaves than there is room for", "at most as many");
    for (const std::uint64_t size : {std::uint64_t{1}, std::uint64_t{8}}) {
      ASPERITY_TRY(const auto packed, index.number<std::uint32_t>());
      ASPERITY_CHECK(index.skip(packed > 0 ? packed : size * leaves));
    }
    return success();
  };
  if (!read()) return after.malformed("has an index of leaves that does not fit the file", "one that does");
  return success();
}

/// `tree_bytes`: of the grid that it is of.
Result<std::map<std::string, MetaValue>> read_metadata(Cursor& cursor, std::size_t tree_bytes) {
  std::map<std::string, MetaValue> out;
  ASPERITY_TRY(const auto count, cursor.number<std::uint32_t>());
  if (count > most_metadata) return cursor.malformed(fmt::format("declares {} metadata", count), "at most 10000");
  for (std::uint32_t n = 0; n < count; ++n) {
    ASPERITY_TRY(std::string name, cursor.text());
    MetaValue value;
    ASPERITY_TRY(value.type, cursor.text());
    ASPERITY_TRY(value.bytes, cursor.text());
    const std::size_t wanted = metadata_bytes(value.type);
    if (wanted > 0 && value.bytes.size() != wanted) {
      return cursor.malformed(
          fmt::format("declares {} bytes for metadata of type {}", value.bytes.size(), shown(value.type)),
          fmt::format("{} bytes", wanted));
    }
    if (value.type == "__delayedload") {
      ASPERITY_CHECK(check_index(value.bytes, tree_bytes, cursor));
      continue;
    }
    out.insert_or_assign(std::move(name), std::move(value));
  }
  return out;
}

Result<Vec3> read_vector(Cursor& cursor) {
  Vec3 out;
  for (int a = 0; a < 3; ++a) {
    ASPERITY_TRY(out[a], cursor.number<double>());
  }
  return out;
}

/// The transform: which kind, and what it does. OpenVDB keeps what follows from the scale in the file as well.
Status read_transform(Cursor& cursor, GridOutline& grid) {
  ASPERITY_TRY(grid.map, cursor.text());
  const bool translated = grid.map == "ScaleTranslateMap" || grid.map == "UniformScaleTranslateMap";
  if (grid.map == "ScaleMap" || grid.map == "UniformScaleMap" || translated) {
    if (translated) {
      ASPERITY_TRY(grid.origin, read_vector(cursor));
    }
    ASPERITY_TRY(const Vec3 scale, read_vector(cursor));
    grid.linear = scale.asDiagonal();
    return cursor.skip(4 * 24);
  }
  if (grid.map == "TranslationMap") {
    grid.linear = Mat3::Identity();
    ASPERITY_TRY(grid.origin, read_vector(cursor));
    return success();
  }
  if (grid.map == "AffineMap" || grid.map == "UnitaryMap") {
    // Row vectors: the translation is the last row.
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column) {
        ASPERITY_TRY(const double value, cursor.number<double>());
        if (column == 3) continue;
        (row < 3 ? grid.linear(column, row) : grid.origin[column]) = value;
      }
    }
    return success();
  }
  return success();  // A frustum: nobody reads on.
}

Status read_descriptor(Cursor& cursor, GridOutline& grid, std::size_t file_bytes) {
  ASPERITY_TRY(grid.unique_name, cursor.text());
  grid.name = grid.unique_name.substr(0, grid.unique_name.find('\x1e'));
  ASPERITY_TRY(grid.tree, cursor.text());
  constexpr std::string_view half_suffix = "_HalfFloat";
  if (grid.tree.ends_with(half_suffix)) {
    grid.half = true;
    grid.tree.resize(grid.tree.size() - half_suffix.size());
  }
  ASPERITY_TRY(grid.parent, cursor.text());
  std::array<std::int64_t, 3> places{};
  for (std::int64_t& place : places) {
    ASPERITY_TRY(place, cursor.number<std::int64_t>());
  }
  const auto here = static_cast<std::int64_t>(cursor.at());
  if (places[0] < here || places[1] < places[0] || places[2] < places[1]) {
    return cursor.malformed(
        fmt::format("puts grid \"{}\" at bytes {}, {} and {}", shown(grid.name), places[0], places[1], places[2]),
        "places behind each other");
  }
  if (static_cast<std::uint64_t>(places[2]) > file_bytes) {
    return refused(ErrorCode::file_truncated,
                   fmt::format("ends at byte {}, and grid \"{}\" at byte {}", file_bytes, shown(grid.name), places[2]),
                   fmt::format("byte {}", cursor.at()), "the whole file, as it was written");
  }
  grid.at = static_cast<std::size_t>(places[0]);
  grid.buffers_at = static_cast<std::size_t>(places[1]);
  grid.end = static_cast<std::size_t>(places[2]);
  return success();
}

/// Bits of a mask in the file.
template <std::size_t Bits>
class MaskView {
 public:
  explicit MaskView(std::string_view bytes) { std::memcpy(words_.data(), bytes.data(), Bits / 8); }
  [[nodiscard]] bool operator[](std::size_t bit) const { return (words_[bit / 64] >> (bit % 64) & 1U) != 0; }
  [[nodiscard]] std::size_t count() const {
    std::size_t sum = 0;
    for (const std::uint64_t word : words_) sum += static_cast<std::size_t>(std::popcount(word));
    return sum;
  }
  [[nodiscard]] bool meets(const MaskView& other) const {
    for (std::size_t w = 0; w < words_.size(); ++w) {
      if ((words_[w] & other.words_[w]) != 0) return true;
    }
    return false;
  }

 private:
  std::array<std::uint64_t, Bits / 64> words_{};
};

class TreeWalk {
 public:
  TreeWalk(std::string_view bytes, const GridOutline& grid, std::size_t value_bytes, bool real)
      : bytes_(bytes),
        grid_(grid),
        value_bytes_(value_bytes),
        half_(grid.half && real),
        cursor_(bytes, grid.tree_at, grid.buffers_at) {}

  Result<TreeSize> run() {
    ASPERITY_TRY(const auto buffers, cursor_.number<std::int32_t>());
    if (buffers != 1) return cursor_.malformed(fmt::format("declares {} buffers", buffers), "1");
    ASPERITY_CHECK(root());
    cursor_ = Cursor(bytes_, grid_.buffers_at, grid_.end);
    for (const std::size_t mask : leaves_) ASPERITY_CHECK(buffer(mask));
    return size_;
  }

 private:
  static constexpr std::int32_t root_side = 4096;

  Status root() {
    ASPERITY_CHECK(cursor_.skip(value_bytes_));
    ASPERITY_TRY(const auto tiles, cursor_.number<std::uint32_t>());
    ASPERITY_TRY(const auto children, cursor_.number<std::uint32_t>());
    std::set<std::array<std::int32_t, 3>> places;
    for (std::uint32_t n = 0; n < tiles; ++n) {
      ASPERITY_CHECK(place(places));
      ASPERITY_CHECK(cursor_.skip(value_bytes_));
      ASPERITY_TRY(const auto active, cursor_.number<std::uint8_t>());
      if (active > 1) return cursor_.malformed(fmt::format("has {} for whether a tile is active", active), "0 or 1");
      if (active == 1) size_.tiles += std::uint64_t{512} * 512 * 512;
    }
    for (std::uint32_t n = 0; n < children; ++n) {
      ASPERITY_CHECK(place(places));
      ASPERITY_CHECK(inner_5());
    }
    return success();
  }

  Status place(std::set<std::array<std::int32_t, 3>>& places) {
    std::array<std::int32_t, 3> at{};
    for (std::int32_t& a : at) {
      ASPERITY_TRY(a, cursor_.number<std::int32_t>());
      if (a % root_side != 0) return cursor_.malformed(fmt::format("puts a node at {}", a), "multiples of 4096");
    }
    if (!places.insert(at).second) return cursor_.malformed("puts two nodes at one place", "one");
    return success();
  }

  /// The masks and values of an inner node, its active tiles of so many blocks each. Answers how many children it has.
  template <std::size_t Side>
  Result<std::size_t> inner(std::uint64_t blocks_a_tile) {
    constexpr std::size_t bits = Side * Side * Side;
    ASPERITY_TRY(const std::string_view child, cursor_.take(bits / 8));
    ASPERITY_TRY(const std::string_view value, cursor_.take(bits / 8));
    const MaskView<bits> children(child);
    const MaskView<bits> active(value);
    if (children.meets(active)) return cursor_.malformed("has a child and an active value at one place", "one of them");
    size_.tiles += active.count() * blocks_a_tile;
    ASPERITY_CHECK(values(bits, active.count()));
    return children.count();
  }

  Status inner_5() {
    ++size_.nodes_5;
    ASPERITY_TRY(const std::size_t children, inner<32>(16 * 16 * 16));
    for (std::size_t n = 0; n < children; ++n) ASPERITY_CHECK(inner_4());
    return success();
  }

  Status inner_4() {
    ++size_.nodes_4;
    ASPERITY_TRY(const std::size_t children, inner<16>(1));
    for (std::size_t n = 0; n < children; ++n) {
      leaves_.push_back(cursor_.at());
      ASPERITY_CHECK(cursor_.skip(512 / 8));
      ++size_.leaves;
    }
    return success();
  }

  Status buffer(std::size_t mask) {
    const std::string_view topology = bytes_.substr(mask, 512 / 8);
    ASPERITY_TRY(const std::string_view again, cursor_.take(512 / 8));
    if (again != topology) return cursor_.malformed("has two different masks of a leaf", "the same mask twice");
    return values(512, MaskView<512>(topology).count());
  }

  /// Values under a mask, as openvdb/io/Compression.h writes them.
  Status values(std::size_t count, std::size_t active) {
    ASPERITY_TRY(const auto kind, cursor_.number<std::uint8_t>());
    if (kind > 6) return cursor_.malformed(fmt::format("has a mask of kind {}", kind), "0 to 6");
    if (kind == 2 || kind == 4) ASPERITY_CHECK(cursor_.skip(value_bytes_));
    if (kind == 5) ASPERITY_CHECK(cursor_.skip(2 * value_bytes_));
    if (kind == 3 || kind == 4 || kind == 5) ASPERITY_CHECK(cursor_.skip(count / 8));
    const std::size_t stored = (grid_.compression & active_mask) != 0 && kind != 6 ? active : count;
    if (half_ && stored == 0) return success();
    const std::size_t size = stored * (half_ ? 2 : value_bytes_);
    if ((grid_.compression & (zip | blosc)) == 0) return cursor_.skip(size);
    ASPERITY_TRY(const auto packed, cursor_.number<std::int64_t>());
    if (packed <= 0) {
      if (packed == std::numeric_limits<std::int64_t>::min() || static_cast<std::uint64_t>(-packed) != size)
        return cursor_.malformed(fmt::format("declares {} bytes for {} of values", packed, size), "as many");
      return cursor_.skip(size);
    }
    return cursor_.skip(static_cast<std::uint64_t>(packed));
  }

  std::string_view bytes_;
  const GridOutline& grid_;
  std::size_t value_bytes_;
  bool half_;
  Cursor cursor_;
  TreeSize size_;
  std::vector<std::size_t> leaves_;  ///< bytes of their masks
};

/// The result, its error with the grid before the place.
template <class T>
Result<T> at_grid(Result<T> result, const GridOutline& grid) {
  if (!result) result.error().place = fmt::format("grid \"{}\", {}", shown(grid.name), result.error().place);
  return result;
}

Result<std::size_t> read_header(Cursor& cursor) {
  constexpr std::int64_t magic = 0x56444220;
  if (cursor.left() < 8) return cursor.malformed("is no OpenVDB file", "a .vdb file");
  ASPERITY_TRY(const auto begins, cursor.number<std::int64_t>());
  if (begins != magic) return Cursor({}, 0, 0).malformed("is no OpenVDB file", "a .vdb file");
  ASPERITY_TRY(const auto version, cursor.number<std::uint32_t>());
  if (version < oldest_version || version > newest_version) {
    return refused(ErrorCode::file_unsupported, fmt::format("is of format {}", version), "byte 8",
                   fmt::format("formats {} to {}: OpenVDB 2 to 12", oldest_version, newest_version));
  }
  ASPERITY_CHECK(cursor.skip(8));  // of the library
  ASPERITY_TRY(const auto places, cursor.number<std::uint8_t>());
  if (places != 1) {
    return refused(ErrorCode::file_unsupported, "was written as a stream, without the places of its grids", "byte 20",
                   "a .vdb file written by OpenVDB's io::File");
  }
  ASPERITY_CHECK(cursor.skip(36));  // its unique tag
  ASPERITY_TRY([[maybe_unused]] const auto metadata, read_metadata(cursor, 0));
  ASPERITY_TRY(const auto grids, cursor.number<std::int32_t>());
  if (grids < 0 || static_cast<std::size_t>(grids) > most_grids)
    return cursor.malformed(fmt::format("declares {} grids", grids), "0 to 1000");
  return static_cast<std::size_t>(grids);
}

}  // namespace

std::string shown(std::string_view text) {
  constexpr std::size_t most = 60;
  std::string out(text.substr(0, most));
  for (char& c : out) {
    if (c < ' ' || c > '~') c = '?';
  }
  return text.size() > most ? out + "..." : out;
}

std::string GridOutline::text(const std::string& key) const {
  const auto found = metadata.find(key);
  return found != metadata.end() && found->second.type == "string" ? found->second.bytes : std::string();
}

double GridOutline::number(const std::string& key, double missing) const {
  const auto found = metadata.find(key);
  if (found == metadata.end()) return missing;
  const auto as = [&]<class T>(T out) {
    std::memcpy(&out, found->second.bytes.data(), sizeof(T));
    return static_cast<double>(out);
  };
  const std::string& type = found->second.type;
  if (type == "double") return as(double{});
  if (type == "float") return as(float{});
  if (type == "int64") return as(std::int64_t{});
  if (type == "int32") return as(std::int32_t{});
  return missing;
}

Result<std::vector<GridOutline>> outline(std::string_view bytes) {
  Cursor cursor(bytes, 0, bytes.size());
  ASPERITY_TRY(const std::size_t count, read_header(cursor));
  std::vector<GridOutline> grids;
  std::set<std::string> names;
  for (std::size_t n = 0; n < count; ++n) {
    GridOutline grid;
    ASPERITY_CHECK(read_descriptor(cursor, grid, bytes.size()));
    if (!names.insert(grid.unique_name).second)
      return cursor.malformed(fmt::format("holds two grids \"{}\"", shown(grid.name)), "grids that can be told apart");
    Cursor inner(bytes, grid.at, grid.buffers_at);
    const auto read = [&]() -> Status {
      ASPERITY_TRY(grid.compression, inner.number<std::uint32_t>());
      ASPERITY_TRY(grid.metadata, read_metadata(inner, grid.end - grid.at));
      ASPERITY_CHECK(read_transform(inner, grid));
      grid.tree_at = inner.at();
      return success();
    };
    ASPERITY_CHECK(at_grid(read(), grid));
    cursor = Cursor(bytes, grid.end, bytes.size());
    grids.push_back(std::move(grid));
  }
  return grids;
}

Result<TreeSize> check_tree(std::string_view bytes, const GridOutline& grid, std::size_t value_bytes, bool real) {
  return at_grid(TreeWalk(bytes, grid, value_bytes, real).run(), grid);
}

}  // namespace asperity::vdb_io
