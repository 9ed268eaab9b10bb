#include "asperity/io/mesh_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <limits>

#include "asperity/io/atomic_file.h"
#include "asperity/io/detail/file_reading.h"
#include "asperity/io/detail/mesh_readers.h"

namespace asperity {
namespace {

constexpr std::uintmax_t largest_mesh_file = std::uintmax_t{4} << 30U;
constexpr const char* accepted_formats = "an OBJ, PLY, STL or glTF file";

bool has_obj_vertex(std::string_view bytes) {
  mesh_readers::TextCursor cursor(bytes);
  std::string_view line;
  for (int i = 0; i < 1000 && cursor.next_line(line); ++i) {
    if (mesh_readers::take_word(line) == "v") return true;
  }
  return false;
}

Result<MeshSource> read_by_format(std::string_view bytes, const std::string& name,
                                  const std::filesystem::path* folder) {
  if (bytes.empty()) return refused(ErrorCode::file_empty, "is empty", {}, accepted_formats);
  const std::string extension = lower_extension(name);
  if (bytes.starts_with("glTF")) return mesh_readers::read_gltf(bytes, folder);
  if (bytes.starts_with("ply\n") || bytes.starts_with("ply\r") || extension == ".ply") {
    return mesh_readers::read_ply(bytes);
  }
  if (extension == ".gltf" || extension == ".glb") return mesh_readers::read_gltf(bytes, folder);
  if (extension == ".stl" || mesh_readers::is_exact_binary_stl(bytes)) return mesh_readers::read_stl(bytes);
  if (extension == ".obj") return mesh_readers::read_obj(bytes);
  if (bytes.starts_with("solid")) return mesh_readers::read_stl(bytes);
  if (has_obj_vertex(bytes)) return mesh_readers::read_obj(bytes);
  return refused(ErrorCode::file_unsupported, "is no mesh format that is read here", {}, accepted_formats);
}

Error missing(const std::filesystem::path& path, std::string what) {
  return refused_file(ErrorCode::file_missing, std::move(what), path.string(), accepted_formats);
}

Result<std::string> read_file(const std::filesystem::path& path) {
  std::error_code problem;
  const std::filesystem::file_status status = std::filesystem::status(path, problem);
  if (!std::filesystem::exists(status)) return missing(path, "no such file");
  if (std::filesystem::is_directory(status)) return missing(path, "is a folder, not a file");
  if (!std::filesystem::is_regular_file(status)) return missing(path, "is not a regular file");
  const std::uintmax_t size = std::filesystem::file_size(path, problem);
  std::ifstream stream(path, std::ios::binary);
  if (problem || !stream) return missing(path, "cannot be opened for reading");
  if (size > largest_mesh_file)
    return refused_file(ErrorCode::too_large, fmt::format("has {} bytes", size), path.string(), "files up to 4 GiB");
  std::string bytes(static_cast<std::size_t>(size), '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(size));
  if (static_cast<std::uintmax_t>(stream.gcount()) != size) return missing(path, "cannot be read to its end");
  return bytes;
}

/// `folder`: where other files that the mesh file names are looked for; null: nowhere.
Result<MeshSource> read_named_mesh(std::string_view bytes, const std::string& name,
                                   const std::filesystem::path* folder) {
  try {
    return in_file(read_by_format(bytes, name, folder), name);
  } catch (const std::exception& problem) {
    return refused_file(ErrorCode::too_large, fmt::format("cannot be held in memory ({})", problem.what()), name);
  }
}

template <class Number>
void append(std::string& bytes, Number number) {
  static_assert(std::endian::native == std::endian::little, "the files written here are little-endian");
  std::array<char, sizeof(Number)> raw{};
  std::memcpy(raw.data(), &number, sizeof number);
  bytes.append(raw.data(), raw.size());
}

void append_corner_vertices(std::string& bytes, const MeshView& mesh) {
  for (std::size_t face = 0; face < mesh.triangles.size(); ++face) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Vec3& position = mesh.positions[mesh.triangles[face][corner]];
      for (int axis = 0; axis < 3; ++axis) append(bytes, position[axis]);
      append(bytes, mesh.corner_uvs[face][corner].x());
      append(bytes, mesh.corner_uvs[face][corner].y());
    }
  }
}

}  // namespace

namespace mesh_readers {

Result<std::string> read_mesh_file(const std::filesystem::path& path) {
  try {
    return read_file(path);
  } catch (const std::exception& problem) {
    return missing(path, fmt::format("cannot be read ({})", problem.what()));
  }
}

bool TextCursor::next_line(std::string_view& line) {
  if (at_ >= text_.size()) return false;
  const std::size_t end = std::min(text_.find('\n', at_), text_.size());
  line = text_.substr(at_, end - at_);
  at_ = end + 1;
  line_ = ++ends_passed_;
  return true;
}

std::string_view TextCursor::next_word() {
  while (at_ < text_.size() && (is_blank(text_[at_]) || text_[at_] == '\n')) {
    if (text_[at_++] == '\n') ++ends_passed_;
  }
  line_ = ends_passed_ + 1;
  const std::size_t begin = at_;
  while (at_ < text_.size() && !is_blank(text_[at_]) && text_[at_] != '\n') ++at_;
  return text_.substr(begin, at_ - begin);
}

bool same_word(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::ranges::equal(a, b, {}, lower, lower);
}

std::string_view take_word(std::string_view& line) {
  std::size_t begin = 0;
  while (begin < line.size() && is_blank(line[begin])) ++begin;
  std::size_t end = begin;
  while (end < line.size() && !is_blank(line[end])) ++end;
  const std::string_view word = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return word;
}

}  // namespace mesh_readers

Result<MeshSource> read_mesh_bytes(std::string_view bytes, const std::string& name) {
  return read_named_mesh(bytes, name, nullptr);
}

Result<MeshSource> read_mesh(const std::filesystem::path& path) {
  try {
    ASPERITY_TRY(const std::string bytes, read_file(path));
    const std::filesystem::path folder = path.parent_path();
    return read_named_mesh(bytes, path.string(), &folder);
  } catch (const std::exception& problem) {
    return missing(path, fmt::format("cannot be read ({})", problem.what()));
  }
}

MeshView::MeshView(const MeshSource& source)
    : positions(source.positions), triangles(source.triangles), corner_uvs(source.corner_uvs) {}

MeshView::MeshView(const TriangleMesh& mesh) : positions(mesh.positions()), triangles(mesh.triangles()) {
  if (!mesh.has_uvs()) return;
  own_uvs_.reserve(triangles.size());
  for (std::uint32_t face = 0; face < triangles.size(); ++face) own_uvs_.push_back(mesh.uvs(face));
  corner_uvs = own_uvs_;
}

Status write_obj(const std::filesystem::path& path, const MeshView& mesh) {
  std::string text;
  auto out = std::back_inserter(text);
  for (const Vec3& p : mesh.positions) fmt::format_to(out, "v {} {} {}\n", p.x(), p.y(), p.z());
  for (const auto& uvs : mesh.corner_uvs) {
    for (const Vec2f& uv : uvs) fmt::format_to(out, "vt {} {}\n", uv.x(), uv.y());
  }
  for (std::size_t face = 0; face < mesh.triangles.size(); ++face) {
    text += 'f';
    for (std::size_t corner = 0; corner < 3; ++corner) {
      fmt::format_to(out, " {}", std::uint64_t{mesh.triangles[face][corner]} + 1);
      if (!mesh.corner_uvs.empty()) fmt::format_to(out, "/{}", 3 * face + corner + 1);
    }
    text += '\n';
  }
  return write_file_atomically(path, text);
}

Status write_ply(const std::filesystem::path& path, const MeshView& mesh) {
  const bool split = !mesh.corner_uvs.empty();
  const std::size_t vertices = split ? 3 * mesh.triangles.size() : mesh.positions.size();
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\n"
      "property double z\n{}element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
      vertices, split ? "property float s\nproperty float t\n" : "", mesh.triangles.size());
  if (split) {
    append_corner_vertices(bytes, mesh);
  } else {
    for (const Vec3& position : mesh.positions) {
      for (int axis = 0; axis < 3; ++axis) append(bytes, position[axis]);
    }
  }
  std::uint32_t next = 0;
  for (const auto& triangle : mesh.triangles) {
    append(bytes, std::uint8_t{3});
    for (const std::uint32_t corner : triangle) append(bytes, split ? next++ : corner);
  }
  return write_file_atomically(path, bytes);
}

Status write_stl(const std::filesystem::path& path, const MeshView& mesh) {
  if (mesh.triangles.size() > std::numeric_limits<std::uint32_t>::max()) {
    return refused_file(ErrorCode::file_unwritable, "has more triangles than an STL file can count", path.string(),
                        "PLY");
  }
  std::string bytes(80, '\0');
  append(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::array<Vec3, 3> corners = {mesh.positions[a], mesh.positions[b], mesh.positions[c]};
    const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    for (int axis = 0; axis < 3; ++axis) append(bytes, static_cast<float>(normal[axis]));
    for (const Vec3& corner : corners) {
      for (int axis = 0; axis < 3; ++axis) append(bytes, static_cast<float>(corner[axis]));
    }
    append(bytes, std::uint16_t{0});
  }
  return write_file_atomically(path, bytes);
}

}  // namespace asperity
