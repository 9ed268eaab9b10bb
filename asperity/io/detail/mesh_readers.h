#pragma once
// Private to asperity/io: the readers behind read_mesh(), and the text handling that they share.

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "asperity/core/result.h"
#include "asperity/geometry/mesh.h"

namespace asperity::mesh_readers {

/// More corners than any modeller writes; it bounds the time that triangulating one polygon can take.
inline constexpr std::size_t most_corners = 1024;

/// The whole of a mesh file. Errors, with its name: file_missing (or a folder), too_large. [build]
Result<std::string> read_mesh_file(const std::filesystem::path& path);
/// Errors of these functions carry no file name: read_mesh_bytes() fills it in. [build]
Result<MeshSource> read_obj(std::string_view bytes);
Result<MeshSource> read_ply(std::string_view bytes);
Result<MeshSource> read_stl(std::string_view bytes);
/// glTF 2.0, text or binary: the triangles of the default scene in their nodes' places, in metres. `folder` is where
/// the buffers that it names lie; null: such a file is refused. [build]
Result<MeshSource> read_gltf(std::string_view bytes, const std::filesystem::path* folder);
/// Whether the bytes are a binary STL of exactly the size that its triangle count asks for.
bool is_exact_binary_stl(std::string_view bytes);

/// Reads a decimal number, "nan" or "inf" that makes up the whole token. Too large becomes infinite, too small 0.
bool parse_number(std::string_view token, double& value);
/// Reads a decimal integer that makes up the whole token.
bool parse_integer(std::string_view token, std::int64_t& value);

/// Decodes base64 until `length` bytes are there, or the text ends; false at a character that base64 does not have.
bool decode_base64(std::string_view text, std::size_t length, std::string& bytes);

/// Reads a little-endian 32-bit pattern; `at` + 4 must lie within `bytes`.
inline std::uint32_t bits_at(std::string_view bytes, std::size_t at) {
  std::uint32_t bits = 0;
  for (std::size_t i = 4; i-- > 0;) bits = (bits << 8U) | static_cast<std::uint8_t>(bytes[at + i]);
  return bits;
}

inline bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v';
}

/// Whether two words are the same, large and small letters alike.
bool same_word(std::string_view a, std::string_view b);

/// Takes the next word off the front of `line`; empty at its end.
std::string_view take_word(std::string_view& line);

/// Walks text by lines or by words and knows the line it is on.
class TextCursor {
 public:
  explicit TextCursor(std::string_view text) : text_(text) {}
  /// The next line without its end; false when there is none.
  bool next_line(std::string_view& line);
  /// The next word, across line ends; empty at the end of the text.
  std::string_view next_word();
  [[nodiscard]] std::size_t line() const { return line_; }
  [[nodiscard]] std::string place() const { return "line " + std::to_string(line_); }
  [[nodiscard]] std::size_t offset() const { return at_; }

 private:
  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t line_ = 0;  ///< of what was taken last, from 1
  std::size_t ends_passed_ = 0;
};

}  // namespace asperity::mesh_readers
