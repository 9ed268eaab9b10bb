#include <fmt/format.h>

#include <bit>
#include <cstring>

#include "asperity/io/detail/mesh_readers.h"

namespace asperity::mesh_readers {
namespace {

constexpr std::size_t header_size = 80;
constexpr std::size_t first_record = 84;
constexpr std::size_t record_size = 50;

Result<MeshSource> read_binary(std::string_view bytes) {
  const std::size_t count = bits_at(bytes, header_size);
  const std::size_t wanted = first_record + count * record_size;
  if (count == 0) {
    return refused(ErrorCode::bad_mesh, "has no triangles", "byte 80", "an STL file with at least one triangle");
  }
  if (bytes.size() < wanted) {
    return refused(ErrorCode::file_truncated,
                   fmt::format("promises {} triangles ({} bytes) and has {} bytes", count, wanted, bytes.size()),
                   fmt::format("byte {}", bytes.size()), "a complete STL file");
  }
  MeshSource source;
  source.positions.reserve(3 * count);
  source.triangles.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto first = static_cast<std::uint32_t>(source.positions.size());
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::size_t at = first_record + i * record_size + 12 * (corner + 1);
      Vec3 position;
      for (int axis = 0; axis < 3; ++axis) {
        const std::uint32_t bits = bits_at(bytes, at + 4 * static_cast<std::size_t>(axis));
        position[axis] = static_cast<double>(std::bit_cast<float>(bits));
      }
      if (!position.allFinite()) {
        return refused(ErrorCode::bad_mesh,
                       fmt::format("triangle {} (counted from 0) has a coordinate that is not finite", i),
                       fmt::format("byte {}", at), "finite coordinates");
      }
      source.positions.push_back(position);
    }
    source.triangles.push_back({first, first + 1, first + 2});
  }
  if (bytes.size() > wanted)
    source.notes.push_back(fmt::format("{} bytes after the last triangle left out", bytes.size() - wanted));
  return source;
}

class AsciiReader {
 public:
  explicit AsciiReader(std::string_view bytes) : cursor_(bytes) {}

  Result<MeshSource> run() {
    std::string_view name;
    if (!cursor_.next_line(name)) return unexpected({}, "solid");
    for (bool within = true;;) {
      const std::string_view word = cursor_.next_word();
      if (word.empty() && within) return unexpected(word, "facet or endsolid");
      if (word.empty()) break;
      if (within && same_word(word, "facet")) {
        ASPERITY_CHECK(read_facet());
      } else if (within ? same_word(word, "endsolid") : same_word(word, "solid")) {
        cursor_.next_line(name);
        within = !within;
      } else {
        return unexpected(word, within ? "facet or endsolid" : "solid");
      }
    }
    if (!source_.triangles.empty()) return std::move(source_);
    return refused(ErrorCode::bad_mesh, "has no facets", {}, "an STL file with at least one facet");
  }

 private:
  [[nodiscard]] Error unexpected(std::string_view word, std::string_view wanted) const {
    if (word.empty()) {
      return refused(ErrorCode::file_truncated, fmt::format("ends where {} should follow", wanted), cursor_.place(),
                     "a complete STL file");
    }
    return refused(ErrorCode::file_malformed, fmt::format("has '{}' where {} should stand", word.substr(0, 40), wanted),
                   cursor_.place(), "facet normal x y z, outer loop, three times vertex x y z, endloop, endfacet");
  }

  Status expect(std::string_view keyword) {
    const std::string_view word = cursor_.next_word();
    if (same_word(word, keyword)) return success();
    return unexpected(word, keyword);
  }

  Status read_vector(Vec3& vector) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view word = cursor_.next_word();
      if (!parse_number(word, vector[axis])) return unexpected(word, "a number");
    }
    return success();
  }

  Status read_facet() {
    Vec3 vector;
    ASPERITY_CHECK(expect("normal"));
    ASPERITY_CHECK(read_vector(vector));
    ASPERITY_CHECK(expect("outer"));
    ASPERITY_CHECK(expect("loop"));
    const auto first = static_cast<std::uint32_t>(source_.positions.size());
    for (int corner = 0; corner < 3; ++corner) {
      ASPERITY_CHECK(expect("vertex"));
      ASPERITY_CHECK(read_vector(vector));
      if (!vector.allFinite()) {
        return Error{
            ErrorCode::bad_mesh, "has a coordinate that is not finite", {}, cursor_.place(), "finite coordinates"};
      }
      source_.positions.push_back(vector);
    }
    source_.triangles.push_back({first, first + 1, first + 2});
    ASPERITY_CHECK(expect("endloop"));
    return expect("endfacet");
  }

  TextCursor cursor_;
  MeshSource source_;
};

}  // namespace

bool is_exact_binary_stl(std::string_view bytes) {
  return bytes.size() >= first_record &&
         bytes.size() == first_record + std::size_t{bits_at(bytes, header_size)} * record_size;
}

Result<MeshSource> read_stl(std::string_view bytes) {
  // Some programs begin binary files with "solid" too: the size tells, and text has no zero bytes.
  const bool text = bytes.starts_with("solid") && bytes.find('\0') == std::string_view::npos;
  if (text && !is_exact_binary_stl(bytes)) return AsciiReader(bytes).run();
  if (bytes.size() < first_record) {
    return refused(ErrorCode::file_truncated, fmt::format("has {} bytes", bytes.size()), {},
                   "an STL file: 'solid ...', or 84 bytes and 50 a triangle");
  }
  return read_binary(bytes);
}

}  // namespace asperity::mesh_readers
