#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "asperity/core/result.h"
#include "asperity/field/image.h"

namespace asperity {

/// Reads a PNG (1 to 16 bits; grey, grey + alpha, RGB, RGBA, palette; interlaced or not) or a JPEG (8 bits). The
/// content decides, not the file's name. Samples are as stored: colour profiles, gamma and orientation tags are not
/// applied. Errors: file_missing, file_empty, file_truncated, file_malformed, file_unsupported, too_large (more than
/// `max_pixels`, refused before allocating). [build]
Result<Image> read_image(const std::filesystem::path& path);

/// The same from memory; `name` stands for the file in messages. [build]
Result<Image> read_image_bytes(std::string_view bytes, const std::string& name);

/// Encodes grey, grey + alpha, RGB or RGBA with 8 or 16 bits as PNG. Errors: bad_value for an image that is none.
/// [build]
Result<std::string> encode_png(const Image& image);

/// Writes a PNG: aside first, then renamed, so that no half-written file is ever seen. Errors: file_unwritable,
/// bad_value. [build]
Status write_png(const std::filesystem::path& path, const Image& image);

}  // namespace asperity
