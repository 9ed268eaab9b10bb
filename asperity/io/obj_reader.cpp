#include <fmt/format.h>
#include <tiny_obj_loader.h>

#include <charconv>

#include "asperity/io/detail/mesh_readers.h"

namespace asperity::mesh_readers {
namespace {

std::string_view without_plus(std::string_view token) {
  if (token.size() > 1 && token.front() == '+' && token[1] != '-') token.remove_prefix(1);
  return token;
}

/// Checks an OBJ text line by line and takes its exact positions and texture coordinates. tinyobjloader answers
/// out-of-range indices with a warning only, reads "nan" as a number and rounds decimals coarsely; it gets the checked
/// lines, in a canonical spelling, and makes the triangles.
class ObjScan {
 public:
  Status run(std::string_view bytes) {
    TextCursor cursor(bytes);
    std::string_view line;
    std::string joined;
    while (cursor.next_line(line)) {
      line_ = cursor.line();
      if (continues(line)) {
        joined.clear();
        for (bool more = true; more;) {
          more = continues(line);
          joined += line.substr(0, more ? line.find_last_of('\\') : line.size());
          joined += ' ';
          if (more) more = cursor.next_line(line);
        }
        line = joined;
      }
      ASPERITY_CHECK(read_line(line));
    }
    return check_forward_references();
  }

  std::string clean;  ///< what tinyobjloader is to read
  std::vector<Vec3> positions;
  std::vector<Vec2f> uvs;
  std::size_t expected_triangles = 0;
  std::size_t short_faces = 0;

 private:
  /// Largest index of its kind and the line that uses it: faces may name vertices that come later.
  struct Reach {
    std::int64_t index = 0;
    std::size_t line = 0;
  };

  static bool continues(std::string_view line) {
    while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
    return !line.empty() && line.back() == '\\';
  }

  [[nodiscard]] Error error(ErrorCode code, std::string what, std::string accepted) const {
    return {code, std::move(what), {}, fmt::format("line {}", line_), std::move(accepted)};
  }

  Status read_line(std::string_view line) {
    const std::string_view keyword = take_word(line);
    if (keyword == "v") return read_position(line);
    if (keyword == "vt") return read_uv(line);
    if (keyword == "f") return read_face(line);
    if (line.find('\0') != std::string_view::npos) {
      return error(ErrorCode::file_malformed, "holds a zero byte", "a text file");
    }
    return success();
  }

  Status read_numbers(std::string_view line, double* values, int count, int required, const char* accepted) {
    for (int i = 0; i < count; ++i) {
      const std::string_view word = take_word(line);
      if (word.empty() && i >= required) return success();
      if (word.empty()) return error(ErrorCode::file_malformed, fmt::format("has {} numbers", i), accepted);
      if (!parse_number(word, values[i])) {
        return error(ErrorCode::file_malformed, fmt::format("'{}' is no number", word.substr(0, 40)), accepted);
      }
      if (!std::isfinite(values[i])) {
        return error(ErrorCode::bad_mesh, "has a coordinate that is not finite", "finite coordinates");
      }
    }
    return success();
  }

  Status read_position(std::string_view line) {
    Vec3 position;
    ASPERITY_CHECK(read_numbers(line, position.data(), 3, 3, "v x y z"));
    if (positions.size() >= largest_count) return too_many();
    positions.push_back(position);
    fmt::format_to(std::back_inserter(clean), "v {} {} {}\n", position.x(), position.y(), position.z());
    return success();
  }

  Status read_uv(std::string_view line) {
    Vec2 uv = Vec2::Zero();
    ASPERITY_CHECK(read_numbers(line, uv.data(), 2, 1, "vt u v"));
    if (uvs.size() >= largest_count) return too_many();
    uvs.push_back(uv.cast<float>());
    if (!uvs.back().allFinite()) {
      return error(ErrorCode::bad_mesh, "has a texture coordinate out of range", "coordinates within single precision");
    }
    clean += "vt 0 0\n";
    return success();
  }

  [[nodiscard]] Error too_many() const {
    return error(ErrorCode::too_large, "has too many vertices", "up to 2,000,000,000 of a kind");
  }

  Status read_face(std::string_view line) {
    const std::size_t before = clean.size();
    clean += 'f';
    std::size_t corners = 0;
    for (std::string_view word = take_word(line); !word.empty(); word = take_word(line), ++corners) {
      if (word.front() == '#') break;
      if (corners == most_corners) {
        return error(ErrorCode::file_unsupported, "has too many corners",
                     fmt::format("up to {} corners a face", most_corners));
      }
      ASPERITY_CHECK(read_corner(word));
    }
    if (corners < 3) {
      clean.resize(before);
      ++short_faces;
      return success();
    }
    clean += '\n';
    expected_triangles += corners - 2;
    return success();
  }

  Status read_corner(std::string_view word) {
    std::array<std::string_view, 3> parts;
    std::size_t count = 0;
    for (std::string_view rest = word; count < 3; ++count) {
      const std::size_t slash = std::min(rest.find('/'), rest.size());
      parts[count] = rest.substr(0, slash);
      if (slash == rest.size()) break;
      rest.remove_prefix(slash + 1);
      if (count == 2) parts[0] = {};  // a fourth part: refused below
    }
    std::int64_t position = 0;
    ASPERITY_CHECK(read_index(parts[0], positions.size(), "vertex", position_reach_, position));
    fmt::format_to(std::back_inserter(clean), " {}", position);
    if (parts[1].empty()) return success();
    std::int64_t uv = 0;
    ASPERITY_CHECK(read_index(parts[1], uvs.size(), "texture coordinate", uv_reach_, uv));
    fmt::format_to(std::back_inserter(clean), "/{}", uv);
    return success();
  }

  /// Resolves a one-based or, counted back from the latest, negative index.
  Status read_index(std::string_view part, std::size_t so_far, const char* kind, Reach& reach, std::int64_t& index) {
    constexpr const char* accepted = "f v v v or f v/vt/vn ..., indices from 1, or negative ones that count back";
    if (!parse_integer(part, index)) {
      return error(ErrorCode::file_malformed, fmt::format("has a {} index that is no whole number", kind), accepted);
    }
    const std::int64_t given = index;
    if (index < 0) index += static_cast<std::int64_t>(so_far) + 1;
    if (index <= 0 || index > static_cast<std::int64_t>(largest_count)) {
      return error(ErrorCode::bad_mesh, fmt::format("refers to {} {}, out of range", kind, given), accepted);
    }
    if (index > reach.index) reach = {index, line_};
    return success();
  }

  Status check_forward_references() {
    const auto check = [&](const Reach& reach, std::size_t count, const char* kind) -> Status {
      if (reach.index <= static_cast<std::int64_t>(count)) return success();
      line_ = reach.line;
      return error(ErrorCode::bad_mesh, fmt::format("refers to {} {} of {}", kind, reach.index, count),
                   fmt::format("{} indices from 1 to {}", kind, count));
    };
    ASPERITY_CHECK(check(position_reach_, positions.size(), "vertex"));
    return check(uv_reach_, uvs.size(), "texture coordinate");
  }

  static constexpr std::size_t largest_count = 2'000'000'000;
  std::size_t line_ = 0;
  Reach position_reach_;
  Reach uv_reach_;
};

/// Takes the triangles that tinyobjloader made, with the scan's own coordinates.
void take_triangles(const std::vector<tinyobj::shape_t>& shapes, ObjScan& scan, MeshSource& source) {
  std::size_t with_uvs = 0;
  for (const tinyobj::shape_t& shape : shapes) {
    const auto& indices = shape.mesh.indices;
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
      auto& triangle = source.triangles.emplace_back();
      auto& uvs = source.corner_uvs.emplace_back();
      bool all = true;
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const tinyobj::index_t& index = indices[i + corner];
        triangle[corner] = static_cast<std::uint32_t>(index.vertex_index);
        all = all && index.texcoord_index >= 0;
        uvs[corner] = all ? scan.uvs[static_cast<std::size_t>(index.texcoord_index)] : Vec2f(Vec2f::Zero());
      }
      if (all) ++with_uvs;
    }
  }
  if (with_uvs == source.triangles.size()) return;
  source.corner_uvs.clear();
  source.corner_uvs.shrink_to_fit();
  if (with_uvs > 0) {
    source.notes.push_back(fmt::format("texture coordinates left out: only {} of {} triangles have them", with_uvs,
                                       source.triangles.size()));
  }
}

}  // namespace

bool parse_number(std::string_view token, double& value) {
  token = without_plus(token);
  const char* end = token.data() + token.size();
  const auto [stop, problem] = std::from_chars(token.data(), end, value);
  if (stop != end || problem == std::errc::invalid_argument) return false;
  if (problem == std::errc::result_out_of_range) {
    const bool tiny = token.find("e-") != std::string_view::npos || token.find("E-") != std::string_view::npos;
    value = tiny ? 0.0 : infinity;
  }
  return true;
}

bool parse_integer(std::string_view token, std::int64_t& value) {
  token = without_plus(token);
  const char* end = token.data() + token.size();
  const auto [stop, problem] = std::from_chars(token.data(), end, value);
  return stop == end && problem == std::errc{};
}

Result<MeshSource> read_obj(std::string_view bytes) {
  ObjScan scan;
  ASPERITY_CHECK(scan.run(bytes));
  if (scan.expected_triangles == 0) {
    return refused(ErrorCode::bad_mesh, fmt::format("has {} vertices and no faces", scan.positions.size()), {},
                   "an OBJ file with at least one f line of three corners or more");
  }
  tinyobj::ObjReaderConfig config;
  config.vertex_color = false;
  tinyobj::ObjReader reader;
  if (!reader.ParseFromString(scan.clean, {}, config)) {
    return refused(ErrorCode::file_malformed, "cannot be read as OBJ: " + reader.Error(), {}, "an OBJ file");
  }
  MeshSource source;
  source.positions = std::move(scan.positions);
  take_triangles(reader.GetShapes(), scan, source);
  if (scan.short_faces > 0) {
    source.notes.push_back(fmt::format("{} faces with fewer than three corners left out", scan.short_faces));
  }
  if (source.triangles.empty()) {
    return refused(ErrorCode::bad_mesh, "has no face with an area", {}, "at least one face with an area");
  }
  if (source.triangles.size() < scan.expected_triangles) {
    source.notes.push_back(
        fmt::format("{} triangles of degenerate polygons left out", scan.expected_triangles - source.triangles.size()));
  }
  return source;
}

}  // namespace asperity::mesh_readers
