#pragma once
// Private to asperity/io/vtk: what a file has to hold before VTK is let at it. VTK allocates what headers declare and
// trusts counts; these checks tie both to the file's own length.

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "asperity/core/result.h"

namespace asperity::vtk_io {

/// What a table of types and their bytes says of one; 0: not known. [any]
template <std::size_t Count>
std::size_t bytes_of(const std::pair<std::string_view, std::size_t> (&types)[Count], std::string_view type) {
  for (const auto& [name, bytes] : types) {
    if (name == type) return bytes;
  }
  return 0;
}
/// Bytes of one value of a legacy or XML type ("unsigned_char", "UInt8"); 0: not known. Bits count as a byte.
std::size_t legacy_type_bytes(std::string_view type);
std::size_t xml_type_bytes(std::string_view type);

/// Walks through a legacy file: header, sizes, every array's length and, in text, every number. Answers what VTK may
/// read: the same bytes without METADATA, whose counts VTK follows past the end of the file. Errors: file_truncated,
/// file_malformed, file_unsupported, bad_value, too_large. [build]
Result<std::string> check_legacy(std::string_view bytes, std::size_t most_bytes);

/// Checks a serial XML file whose root is to be of `type` ("ImageData"): extents, declared sizes, places and lengths of
/// the blocks of data. Errors as check_legacy. [build]
Status check_xml(std::string_view bytes, std::string_view type, std::size_t most_bytes);

/// What the header of a NRRD file says.
struct NrrdHeader {
  std::array<std::uint64_t, 3> size{};
  int components = 1;
  std::array<double, 3> origin{};
  std::array<double, 3> spacing{1.0, 1.0, 1.0};
  std::string plain;             ///< the same header written anew: VTK trips over many that are legal
  std::size_t data_at = 0;       ///< byte of the file where the samples begin
  std::uint64_t data_bytes = 0;  ///< of the samples, unpacked
  bool packed = false;
};
/// `data_bytes`: of the detached data file, or 0; `detached` answers its name. Errors as check_legacy; a file that is
/// an image is file_unsupported. [build]
Result<NrrdHeader> check_nrrd(std::string_view bytes, std::size_t most_bytes, std::string& detached);

}  // namespace asperity::vtk_io
