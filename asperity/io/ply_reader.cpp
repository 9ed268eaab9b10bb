#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <optional>

#include "asperity/io/detail/mesh_readers.h"

namespace asperity::mesh_readers {
namespace {

enum class Scalar { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

constexpr std::size_t size_of(Scalar type) {
  constexpr std::array<std::size_t, 8> sizes = {1, 1, 2, 2, 4, 4, 4, 8};
  return sizes[static_cast<std::size_t>(type)];
}

std::optional<Scalar> scalar_named(std::string_view name) {
  constexpr std::array<std::string_view, 8> old = {"char", "uchar", "short", "ushort",
                                                   "int",  "uint",  "float", "double"};
  constexpr std::array<std::string_view, 8> sized = {"int8",  "uint8",  "int16",   "uint16",
                                                     "int32", "uint32", "float32", "float64"};
  for (std::size_t i = 0; i < old.size(); ++i) {
    if (name == old[i] || name == sized[i]) return static_cast<Scalar>(i);
  }
  return std::nullopt;
}

enum class Encoding { ascii, little, big };

struct Property {
  std::string name;
  Scalar type = Scalar::float32;
  std::optional<Scalar> count_type;  ///< set for a list
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
  std::size_t body = 0;   ///< byte where the data begin
  std::size_t lines = 0;  ///< lines of the header
};

constexpr const char* accepted_header =
    "ply, format (ascii, binary_little_endian or binary_big_endian) 1.0, elements vertex and face, end_header";

class HeaderReader {
 public:
  explicit HeaderReader(std::string_view bytes) : cursor_(bytes) {}

  Result<Header> run() {
    std::string_view line;
    if (!cursor_.next_line(line) || take_word(line) != "ply") {
      return error("does not begin with the line 'ply'");
    }
    while (cursor_.next_line(line)) {
      const std::string_view keyword = take_word(line);
      if (keyword == "end_header") return finish();
      if (keyword.empty() || keyword == "comment" || keyword == "obj_info") continue;
      if (keyword == "format") {
        ASPERITY_CHECK(read_format(line));
      } else if (keyword == "element") {
        ASPERITY_CHECK(read_element(line));
      } else if (keyword == "property") {
        ASPERITY_CHECK(read_property(line));
      } else {
        return error(fmt::format("has the unknown header line '{}'", keyword.substr(0, 40)));
      }
    }
    return refused(ErrorCode::file_truncated, "ends within its header", cursor_.place(), accepted_header);
  }

 private:
  [[nodiscard]] Error error(std::string what) const {
    return refused(ErrorCode::file_malformed, std::move(what), cursor_.place(), accepted_header);
  }

  Result<Header> finish() {
    if (!has_format_) return error("has no format line");
    header_.body = cursor_.offset();
    header_.lines = cursor_.line();
    return std::move(header_);
  }

  Status read_format(std::string_view line) {
    constexpr std::array<std::string_view, 3> encodings = {"ascii", "binary_little_endian", "binary_big_endian"};
    const std::string_view name = take_word(line);
    const auto found = std::find(encodings.begin(), encodings.end(), name);
    if (found == encodings.end()) return error(fmt::format("has the unknown format '{}'", name.substr(0, 40)));
    header_.encoding = static_cast<Encoding>(found - encodings.begin());
    if (take_word(line) != "1.0") return error("is not of PLY version 1.0");
    has_format_ = true;
    return success();
  }

  Status read_element(std::string_view line) {
    Element element;
    element.name = take_word(line);
    std::int64_t count = 0;
    if (!parse_integer(take_word(line), count) || count < 0) return error("has an element without a count");
    element.count = static_cast<std::uint64_t>(count);
    header_.elements.push_back(std::move(element));
    return success();
  }

  Status read_property(std::string_view line) {
    if (header_.elements.empty()) return error("has a property before any element");
    Property property;
    std::string_view word = take_word(line);
    if (word == "list") {
      property.count_type = scalar_named(take_word(line));
      if (!property.count_type || *property.count_type >= Scalar::float32)
        return error("has a list without a count type");
      word = take_word(line);
    }
    const std::optional<Scalar> type = scalar_named(word);
    if (!type) return error(fmt::format("has the unknown property type '{}'", word.substr(0, 40)));
    property.type = *type;
    property.name = take_word(line);
    header_.elements.back().properties.push_back(std::move(property));
    return success();
  }

  TextCursor cursor_;
  Header header_;
  bool has_format_ = false;
};

/// Reads one number after the other, whatever the encoding.
class ValueReader {
 public:
  ValueReader(std::string_view bytes, const Header& header)
      : bytes_(bytes.substr(std::min(header.body, bytes.size()))), header_(header), cursor_(bytes_) {}

  Status next(Scalar type, double& value) {
    if (header_.encoding != Encoding::ascii) return next_binary(type, value);
    const std::string_view word = cursor_.next_word();
    if (word.empty()) return truncated();
    if (parse_number(word, value)) return success();
    return refused(ErrorCode::file_malformed, fmt::format("'{}' is no number", word.substr(0, 40)), place(), "numbers");
  }

  /// Refuses a count that the rest of the file cannot hold, before any memory is set aside for it.
  Status expect(const Element& element) const {
    std::size_t least = 0;
    for (const Property& property : element.properties) {
      least += header_.encoding == Encoding::ascii ? 1 : size_of(property.count_type.value_or(property.type));
    }
    const std::size_t used = header_.encoding == Encoding::ascii ? cursor_.offset() : at_;
    const std::size_t left = bytes_.size() - std::min(used, bytes_.size());
    if (element.count == 0 || (least > 0 && element.count <= left / least)) return success();
    if (least == 0) {
      return refused(ErrorCode::file_malformed, fmt::format("element {} has no properties", element.name), {},
                     accepted_header);
    }
    return truncated(
        fmt::format("promises {} entries of {}, more than its {} bytes can hold", element.count, element.name, left));
  }

  [[nodiscard]] std::string place() const {
    if (header_.encoding != Encoding::ascii) return fmt::format("byte {}", header_.body + at_);
    return fmt::format("line {}", header_.lines + std::max<std::size_t>(cursor_.line(), 1));
  }

 private:
  [[nodiscard]] Error truncated(std::string what = "ends before the data that its header promises") const {
    return refused(ErrorCode::file_truncated, std::move(what), place(), "a complete PLY file");
  }

  template <class Number>
  [[nodiscard]] double decode() const {
    std::array<char, sizeof(Number)> raw{};
    std::copy_n(bytes_.data() + at_, raw.size(), raw.begin());
    const bool swap = (header_.encoding == Encoding::big) == (std::endian::native == std::endian::little);
    if (swap) std::reverse(raw.begin(), raw.end());
    Number number{};
    std::memcpy(&number, raw.data(), raw.size());
    return static_cast<double>(number);
  }

  Status next_binary(Scalar type, double& value) {
    if (size_of(type) > bytes_.size() - at_) return truncated();
    switch (type) {
      case Scalar::int8: value = decode<std::int8_t>(); break;
      case Scalar::uint8: value = decode<std::uint8_t>(); break;
      case Scalar::int16: value = decode<std::int16_t>(); break;
      case Scalar::uint16: value = decode<std::uint16_t>(); break;
      case Scalar::int32: value = decode<std::int32_t>(); break;
      case Scalar::uint32: value = decode<std::uint32_t>(); break;
      case Scalar::float32: value = decode<float>(); break;
      case Scalar::float64: value = decode<double>(); break;
    }
    at_ += size_of(type);
    return success();
  }

  std::string_view bytes_;
  const Header& header_;
  TextCursor cursor_;
  std::size_t at_ = 0;
};

class BodyReader {
 public:
  BodyReader(std::string_view bytes, const Header& header) : header_(header), values_(bytes, header) {}

  Result<MeshSource> run() {
    const Element* vertices = find("vertex");
    const Element* faces = find("face");
    if (vertices == nullptr || faces == nullptr || vertices->count == 0 || faces->count == 0) {
      return refused(ErrorCode::bad_mesh,
                     fmt::format("has {} vertices and {} faces", vertices == nullptr ? 0 : vertices->count,
                                 faces == nullptr ? 0 : faces->count),
                     {}, "a PLY file with elements vertex and face (no point cloud, no triangle strips)");
    }
    vertex_count_ = vertices->count;
    for (const Element& element : header_.elements) {
      ASPERITY_CHECK(values_.expect(element));
      if (&element == vertices) {
        ASPERITY_CHECK(read_vertices(element));
      } else if (&element == faces) {
        ASPERITY_CHECK(read_faces(element));
      } else {
        ASPERITY_CHECK(skip(element));
      }
    }
    return finish();
  }

 private:
  const Element* find(std::string_view name) const {
    const auto found = std::find_if(header_.elements.begin(), header_.elements.end(),
                                    [&](const Element& element) { return element.name == name; });
    return found == header_.elements.end() ? nullptr : &*found;
  }

  /// Position of the first scalar property with one of these names, or -1.
  static std::ptrdiff_t column(const Element& element, std::initializer_list<std::string_view> names) {
    for (const std::string_view name : names) {
      for (std::size_t i = 0; i < element.properties.size(); ++i) {
        const Property& property = element.properties[i];
        if (property.name == name && !property.count_type) return static_cast<std::ptrdiff_t>(i);
      }
    }
    return -1;
  }

  Status skip_list(const Property& property) {
    double count = 0.0;
    double ignored = 0.0;
    ASPERITY_CHECK(values_.next(*property.count_type, count));
    for (double i = 0.0; i < count; ++i) ASPERITY_CHECK(values_.next(property.type, ignored));
    return success();
  }

  Status skip(const Element& element) {
    double ignored = 0.0;
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (const Property& property : element.properties) {
        ASPERITY_CHECK(property.count_type ? skip_list(property) : values_.next(property.type, ignored));
      }
    }
    return success();
  }

  Status read_vertices(const Element& element) {
    const std::array<std::ptrdiff_t, 5> wanted = {
        column(element, {"x"}), column(element, {"y"}), column(element, {"z"}),
        column(element, {"s", "u", "texture_u", "texture_s"}), column(element, {"t", "v", "texture_v", "texture_t"})};
    if (std::min({wanted[0], wanted[1], wanted[2]}) < 0) {
      return refused(ErrorCode::file_malformed, "its vertices have no x, y and z", {}, "vertex properties x, y, z");
    }
    const bool has_uvs = wanted[3] >= 0 && wanted[4] >= 0;
    std::vector<double> row(element.properties.size());
    source_.positions.reserve(element.count);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (std::size_t k = 0; k < row.size(); ++k) {
        const Property& property = element.properties[k];
        ASPERITY_CHECK(property.count_type ? skip_list(property) : values_.next(property.type, row[k]));
      }
      const auto value = [&](std::size_t k) { return row[static_cast<std::size_t>(wanted[k])]; };
      source_.positions.emplace_back(value(0), value(1), value(2));
      if (has_uvs) vertex_uvs_.emplace_back(static_cast<float>(value(3)), static_cast<float>(value(4)));
      if (source_.positions.back().allFinite() && (!has_uvs || vertex_uvs_.back().allFinite())) continue;
      return refused(ErrorCode::bad_mesh,
                     fmt::format("vertex {} (counted from 0) has a coordinate that is not finite", i), values_.place(),
                     "finite coordinates");
    }
    return success();
  }

  Status read_faces(const Element& element) {
    const Property* indices = nullptr;
    for (const Property& property : element.properties) {
      if (property.count_type && (property.name == "vertex_indices" || property.name == "vertex_index")) {
        indices = &property;
      }
    }
    if (indices == nullptr || indices->type >= Scalar::float32) {
      return refused(ErrorCode::file_malformed, "its faces have no list of vertex indices", {},
                     "the face property vertex_indices (or vertex_index), a list of whole numbers");
    }
    double ignored = 0.0;
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (const Property& property : element.properties) {
        if (&property == indices) {
          ASPERITY_CHECK(read_polygon(property, i));
        } else {
          ASPERITY_CHECK(property.count_type ? skip_list(property) : values_.next(property.type, ignored));
        }
      }
    }
    return success();
  }

  Status read_polygon(const Property& property, std::uint64_t face) {
    double corners = 0.0;
    ASPERITY_CHECK(values_.next(*property.count_type, corners));
    if (!(corners >= 0.0 && corners <= static_cast<double>(most_corners))) {
      return refused(ErrorCode::file_unsupported, fmt::format("face {} has {} corners", face, corners), values_.place(),
                     fmt::format("3 to {} corners a face", most_corners));
    }
    if (corners < 3.0) ++short_faces_;
    std::array<std::uint32_t, 3> fan{};
    for (int i = 0; i < static_cast<int>(corners); ++i) {
      double index = 0.0;
      ASPERITY_CHECK(values_.next(property.type, index));
      if (!(index >= 0.0 && index < static_cast<double>(vertex_count_) && index < 4294967295.0)) {
        return refused(ErrorCode::bad_mesh,
                       fmt::format("face {} refers to vertex {} of {}", face, index, vertex_count_), values_.place(),
                       fmt::format("vertex indices from 0 to {}", vertex_count_ - 1));
      }
      fan[static_cast<std::size_t>(std::min(i, 2))] = static_cast<std::uint32_t>(index);
      if (i < 2) continue;
      source_.triangles.push_back(fan);
      fan[1] = fan[2];
    }
    return success();
  }

  Result<MeshSource> finish() {
    if (source_.triangles.empty()) {
      return refused(ErrorCode::bad_mesh, "has no face with three corners or more", {}, "at least one triangle");
    }
    if (short_faces_ > 0) {
      source_.notes.push_back(fmt::format("{} faces with fewer than three corners left out", short_faces_));
    }
    if (vertex_uvs_.empty()) return std::move(source_);
    source_.corner_uvs.reserve(source_.triangles.size());
    for (const auto& [a, b, c] : source_.triangles) {
      source_.corner_uvs.push_back({vertex_uvs_[a], vertex_uvs_[b], vertex_uvs_[c]});
    }
    return std::move(source_);
  }

  const Header& header_;
  ValueReader values_;
  MeshSource source_;
  std::vector<Vec2f> vertex_uvs_;
  std::uint64_t vertex_count_ = 0;
  std::size_t short_faces_ = 0;
};

}  // namespace

Result<MeshSource> read_ply(std::string_view bytes) {
  ASPERITY_TRY(const Header header, HeaderReader(bytes).run());
  return BodyReader(bytes, header).run();
}

}  // namespace asperity::mesh_readers
