#include "asperity/field/brick/file.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>

namespace asperity {
namespace {

static_assert(std::endian::native == std::endian::little, "bricked files are read as they lie");

constexpr char magic[8] = {'A', 'S', 'P', 'V', 'O', 'L', '\r', '\n'};
constexpr std::uint32_t version = 1;
constexpr std::uint32_t most_levels = 32;
constexpr std::uint32_t longest_name = 4096;
constexpr std::size_t record_bytes = 24;
constexpr std::size_t level_bytes = 12;

template <class Number>
void put(std::string& bytes, Number number) {
  char raw[sizeof number];
  std::memcpy(raw, &number, sizeof number);
  bytes.append(raw, sizeof number);
}

Error at_byte(ErrorCode code, std::string what, const std::string& file, std::uint64_t byte, std::string accepted) {
  return {code, std::move(what), file, fmt::format("byte {}", byte), std::move(accepted)};
}

/// A header's bytes, taken from the front.
class Cursor {
 public:
  Cursor(const std::string& bytes, std::size_t at, const std::string& file) : bytes_(bytes), at_(at), file_(file) {}

  template <class Number>
  Number take() {
    Number number{};
    std::memcpy(&number, bytes_.data() + at_, sizeof number);
    at_ += sizeof number;
    return number;
  }
  std::string text(std::size_t length) {
    at_ += length;
    return bytes_.substr(at_ - length, length);
  }
  [[nodiscard]] bool has(std::uint64_t count) const { return count <= bytes_.size() - at_; }
  [[nodiscard]] std::size_t at() const { return at_; }
  [[nodiscard]] const std::string& file() const { return file_; }
  [[nodiscard]] Error malformed(std::string what, std::size_t byte, std::string accepted) const {
    return at_byte(ErrorCode::file_malformed, std::move(what), file_, byte, std::move(accepted));
  }

 private:
  const std::string& bytes_;
  std::size_t at_;
  const std::string& file_;
};

Status read_all(int descriptor, const std::string& name, std::uint64_t from, char* to, std::size_t count) {
  while (count > 0) {
    const ssize_t got = ::pread(descriptor, to, count, static_cast<off_t>(from));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0)
      return at_byte(ErrorCode::file_truncated, "ends within its header", name, from, "a whole bricked volume");
    to += got;
    from += static_cast<std::uint64_t>(got);
    count -= static_cast<std::size_t>(got);
  }
  return success();
}

std::uint64_t stride_of(SampleType type) {
  return brick_aligned(brick_bytes(type));
}

/// The sizes that a prefix states, against each other and the file's length: afterwards they are safe to allocate by.
Status check_sizes(const BrickFilePrefix& prefix, std::uint64_t length, const std::string& file) {
  const auto malformed = [&](std::string what, std::size_t byte, std::string accepted) {
    return at_byte(ErrorCode::file_malformed, std::move(what), file, byte, std::move(accepted));
  };
  if (prefix.version != version) {
    return at_byte(ErrorCode::file_unsupported, fmt::format("is of version {}", prefix.version), file,
                   offsetof(BrickFilePrefix, version), fmt::format("version {}", version));
  }
  if (prefix.type > static_cast<std::uint32_t>(SampleType::uint8))
    return malformed(fmt::format("has samples of an unknown type {}", prefix.type), offsetof(BrickFilePrefix, type),
                     "0 (float32), 1 (int16), 2 (uint8)");
  if (prefix.cells != brick_cells || prefix.nodes != brick_nodes)
    return malformed(fmt::format("has bricks of {} cells and {} nodes", prefix.cells, prefix.nodes),
                     offsetof(BrickFilePrefix, cells), fmt::format("{} and {}", brick_cells, brick_nodes));
  if (prefix.levels < 1 || prefix.levels > most_levels)
    return malformed(fmt::format("has {} levels", prefix.levels), offsetof(BrickFilePrefix, levels),
                     fmt::format("1 to {}", most_levels));
  if (prefix.name_bytes > longest_name)
    return malformed(fmt::format("has a name of {} bytes", prefix.name_bytes), offsetof(BrickFilePrefix, name_bytes),
                     fmt::format("at most {}", longest_name));
  if (prefix.file_bytes > length)
    return at_byte(ErrorCode::file_truncated, fmt::format("should have {} bytes", prefix.file_bytes), file, length,
                   "a whole bricked volume");
  if (prefix.file_bytes < length)
    return malformed(fmt::format("goes on after its {} bytes", prefix.file_bytes), prefix.file_bytes, "nothing there");
  const std::uint64_t stride = stride_of(static_cast<SampleType>(prefix.type));
  if (prefix.bricks < prefix.levels || prefix.bricks > length / stride)
    return malformed(fmt::format("has {} bricks", prefix.bricks), offsetof(BrickFilePrefix, bricks),
                     fmt::format("{} to {}, as many as its length holds", prefix.levels, length / stride));
  // A row of one brick along each axis has at most 33 nodes a brick.
  if (prefix.axis_nodes > 3 * (brick_cells + 1) * prefix.bricks)
    return malformed(fmt::format("has {} nodes along its axes", prefix.axis_nodes),
                     offsetof(BrickFilePrefix, axis_nodes), "as many as its bricks hold");
  const std::uint64_t header = sizeof(BrickFilePrefix) + prefix.name_bytes + level_bytes * prefix.levels +
                               sizeof(double) * prefix.axis_nodes + record_bytes * prefix.bricks;
  if (prefix.header_bytes != header)
    return malformed(fmt::format("has a header of {} bytes", prefix.header_bytes),
                     offsetof(BrickFilePrefix, header_bytes), fmt::format("{} by its own counts", header));
  if (brick_aligned(header) + prefix.bricks * stride != length)
    return malformed(fmt::format("has {} bytes", length), offsetof(BrickFilePrefix, file_bytes),
                     fmt::format("{} by its own counts", brick_aligned(header) + prefix.bricks * stride));
  if (!std::isfinite(prefix.lowest) || !std::isfinite(prefix.highest) || prefix.lowest > prefix.highest)
    return malformed(fmt::format("has values from {} to {}", prefix.lowest, prefix.highest),
                     offsetof(BrickFilePrefix, lowest), "finite numbers that do not decrease");
  return success();
}

Result<GridAxes> read_axes(Cursor& cursor) {
  const std::size_t counts_at = cursor.at();
  if (!cursor.has(level_bytes)) return cursor.malformed("has a level without axes", counts_at, "three node counts");
  std::array<std::uint32_t, 3> counts{};
  for (std::uint32_t& count : counts) count = cursor.take<std::uint32_t>();
  GridAxes axes;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::size_t from = cursor.at();
    if (!cursor.has(sizeof(double) * std::uint64_t{counts[a]}))
      return cursor.malformed(fmt::format("has an axis of {} nodes", counts[a]), counts_at + 4 * a,
                              "as many as its header holds");
    std::vector<double> nodes(counts[a]);
    for (double& node : nodes) node = cursor.take<double>();
    Result<GridAxis> axis = GridAxis::build(std::move(nodes));
    if (!axis) {
      return cursor.malformed(fmt::format("has a bad {} axis: {}", "xyz"[a], axis.error().what), from,
                              axis.error().accepted);
    }
    axes[a] = std::move(*axis);
  }
  return axes;
}

bool same_nodes(const GridAxis& a, const GridAxis& b) {
  return std::equal(a.nodes().begin(), a.nodes().end(), b.nodes().begin(), b.nodes().end());
}

/// Everything after the prefix. Its sizes have been checked, so that nothing here outgrows the file.
Status read_tables(Cursor& cursor, const BrickFilePrefix& prefix, BrickFileHeader& header) {
  header.name = cursor.text(prefix.name_bytes);
  for (std::uint32_t l = 0; l < prefix.levels; ++l) {
    const std::size_t from = cursor.at();
    ASPERITY_TRY(GridAxes axes, read_axes(cursor));
    if (l == 0) {
      Result<std::vector<BrickLevel>> levels = brick_levels(axes);
      if (!levels) return std::move(levels).error().in_file(cursor.file());
      header.levels = std::move(*levels);
      if (header.levels.size() != prefix.levels)
        return cursor.malformed(fmt::format("has {} levels", prefix.levels), offsetof(BrickFilePrefix, levels),
                                fmt::format("{} for its axes", header.levels.size()));
    }
    const GridAxes& expected = header.levels[l].axes;
    if (!same_nodes(axes[0], expected[0]) || !same_nodes(axes[1], expected[1]) || !same_nodes(axes[2], expected[2]))
      return cursor.malformed(fmt::format("has a level {} of other axes", l), from,
                              "every second node of the level below");
  }
  const BrickLevel& last = header.levels.back();
  const std::uint64_t bricks = std::uint64_t{last.first} + last.count();
  if (bricks != prefix.bricks || !cursor.has(record_bytes * bricks))
    return cursor.malformed(fmt::format("has {} bricks", prefix.bricks), offsetof(BrickFilePrefix, bricks),
                            fmt::format("{} for its axes", bricks));
  const std::uint64_t stride = stride_of(header.type);
  header.bricks.resize(bricks);
  for (std::uint64_t n = 0; n < bricks; ++n) {
    const std::size_t from = cursor.at();
    BrickRecord& record = header.bricks[n];
    record.offset = cursor.take<std::uint64_t>();
    record.range.lower = cursor.take<float>();
    record.range.upper = cursor.take<float>();
    record.checksum = cursor.take<std::uint64_t>();
    if (record.offset % brick_alignment != 0 || record.offset < brick_aligned(prefix.header_bytes) ||
        record.offset > header.file_bytes - stride)
      return cursor.malformed(fmt::format("has brick {} at byte {}", n, record.offset), from,
                              fmt::format("a multiple of {} within the file", brick_alignment));
    const ValueRange nothing;
    const bool known = std::isfinite(record.range.lower) && std::isfinite(record.range.upper) &&
                       record.range.lower <= record.range.upper;
    const bool unknown = record.range.lower == nothing.lower && record.range.upper == nothing.upper;
    if (!known && !unknown)
      return cursor.malformed(
          fmt::format("has brick {} with values from {} to {}", n, record.range.lower, record.range.upper), from + 8,
          "finite numbers that do not decrease");
  }
  return success();
}

}  // namespace

std::size_t brick_bytes(SampleType type) noexcept {
  return brick_samples * sample_bytes(type);
}

std::uint64_t brick_checksum(const void* bytes, std::size_t count) noexcept {
  // Four lanes of multiply and shift, so that the multiplications overlap; any single changed bit changes its lane.
  constexpr std::uint64_t odd = 0x9E3779B97F4A7C15ULL;
  std::uint64_t lanes[4] = {odd, ~odd, odd >> 1U, count};
  const auto mix = [](std::uint64_t state, std::uint64_t word) {
    state = (state ^ word) * odd;
    return state ^ (state >> 29U);
  };
  const char* from = static_cast<const char*>(bytes);
  for (; count >= 32; count -= 32, from += 32) {
    std::uint64_t words[4];
    std::memcpy(words, from, sizeof words);
    for (int lane = 0; lane < 4; ++lane) lanes[lane] = mix(lanes[lane], words[lane]);
  }
  std::uint64_t rest[4] = {};
  std::memcpy(rest, from, count);
  for (int lane = 0; lane < 4; ++lane) lanes[lane] = mix(lanes[lane], rest[lane]);
  return mix(mix(mix(lanes[0], lanes[1]), lanes[2]), lanes[3]);
}

Result<std::vector<BrickLevel>> brick_levels(const GridAxes& axes) {
  std::vector<BrickLevel> levels;
  std::uint64_t first = 0;
  GridAxes next = axes;
  while (true) {
    BrickLevel level;
    level.axes = std::move(next);
    level.first = static_cast<std::uint32_t>(first);
    std::uint64_t count = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      level.bricks[a] = (level.axes[a].cells() + brick_cells - 1) / brick_cells;
      // Each factor is below 2^26, so that two cannot overflow; three are looked at in between.
      count = count > (std::uint64_t{1} << 31U) ? count : count * level.bricks[a];
    }
    first += count;
    if (first > (std::uint64_t{1} << 31U)) {
      return refused(ErrorCode::too_large, "has more bricks than can be numbered", {}, "at most 2^31 bricks");
    }
    levels.push_back(std::move(level));
    if (count == 1) return levels;
    for (std::size_t a = 0; a < 3; ++a) next[a] = levels.back().axes[a].coarsened();
  }
}

std::string encode_brick_header(const BrickFileHeader& header) {
  BrickFilePrefix prefix{};
  std::memcpy(prefix.magic, magic, sizeof magic);
  prefix.version = version;
  prefix.type = static_cast<std::uint32_t>(header.type);
  prefix.cells = brick_cells;
  prefix.nodes = brick_nodes;
  prefix.levels = static_cast<std::uint32_t>(header.levels.size());
  const std::string name = header.name.substr(0, longest_name);
  prefix.name_bytes = static_cast<std::uint32_t>(name.size());
  prefix.bricks = header.bricks.size();
  prefix.file_bytes = header.file_bytes;
  prefix.lowest = header.lowest;
  prefix.highest = header.highest;
  std::string tables = name;
  for (const BrickLevel& level : header.levels) {
    for (const GridAxis& axis : level.axes) put(tables, axis.size());
    for (const GridAxis& axis : level.axes) {
      for (const double node : axis.nodes()) put(tables, node);
      prefix.axis_nodes += axis.size();
    }
  }
  for (const BrickRecord& record : header.bricks) {
    put(tables, record.offset);
    put(tables, record.range.lower);
    put(tables, record.range.upper);
    put(tables, record.checksum);
  }
  prefix.header_bytes = sizeof prefix + tables.size();
  std::string bytes;
  put(bytes, prefix);
  bytes += tables;
  reseal_brick_header(bytes);
  return bytes;
}

void reseal_brick_header(std::string& bytes) {
  BrickFilePrefix prefix{};
  if (bytes.size() < sizeof prefix) return;
  std::memcpy(&prefix, bytes.data(), sizeof prefix);
  prefix.checksum = 0;
  std::memcpy(bytes.data(), &prefix, sizeof prefix);
  prefix.checksum = brick_checksum(bytes.data(), std::min<std::uint64_t>(prefix.header_bytes, bytes.size()));
  std::memcpy(bytes.data(), &prefix, sizeof prefix);
}

Result<BrickFileHeader> read_brick_header(int descriptor, const std::string& name) {
  struct stat about {};
  if (::fstat(descriptor, &about) != 0 || !S_ISREG(about.st_mode)) {
    return Error{ErrorCode::file_unsupported, "is no regular file", name, "", "a bricked volume (.aspvol)"};
  }
  const auto length = static_cast<std::uint64_t>(about.st_size);
  if (length == 0) return Error{ErrorCode::file_empty, "is empty", name, "", "a bricked volume (.aspvol)"};
  BrickFilePrefix prefix{};
  std::string bytes(std::min<std::uint64_t>(sizeof prefix, length), '\0');
  ASPERITY_CHECK(read_all(descriptor, name, 0, bytes.data(), bytes.size()));
  if (bytes.compare(0, sizeof magic, magic, std::min(sizeof magic, bytes.size())) != 0) {
    return at_byte(ErrorCode::file_malformed, "does not begin as a bricked volume does", name, 0,
                   "a file that `asperity convert` wrote");
  }
  if (bytes.size() < sizeof prefix)
    return at_byte(ErrorCode::file_truncated, "ends within its header", name, length, "a whole bricked volume");
  std::memcpy(&prefix, bytes.data(), sizeof prefix);
  ASPERITY_CHECK(check_sizes(prefix, length, name));
  bytes.resize(prefix.header_bytes);
  ASPERITY_CHECK(read_all(descriptor, name, 0, bytes.data(), bytes.size()));
  // Between the two reads the file may have changed: what counts is what was checked.
  const std::uint64_t stated = prefix.checksum;
  prefix.checksum = 0;
  std::memcpy(bytes.data(), &prefix, sizeof prefix);
  if (brick_checksum(bytes.data(), bytes.size()) != stated) {
    return at_byte(ErrorCode::file_malformed, "has a damaged header: its checksum differs", name,
                   offsetof(BrickFilePrefix, checksum), "the file as it was written");
  }
  BrickFileHeader header{
      static_cast<SampleType>(prefix.type), {}, prefix.lowest, prefix.highest, {}, {}, prefix.file_bytes};
  Cursor cursor(bytes, sizeof prefix, name);
  ASPERITY_CHECK(read_tables(cursor, prefix, header));
  return header;
}

}  // namespace asperity
