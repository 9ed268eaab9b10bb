#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/field/height/image.h"
#include "asperity/field/height/map.h"

namespace asperity {

/// Reads a PNG (1 to 16 bits; grey, grey + alpha, RGB, RGBA, palette; interlaced or not) or a JPEG (8 bits). The
/// content decides, not the file's name. Samples are as stored: colour profiles, gamma and orientation tags are not
/// applied. OpenEXR images hold no greys: read_float_image() reads them. Errors: file_missing, file_empty,
/// file_truncated, file_malformed, file_unsupported, too_large (more than `max_pixels`, refused before allocating).
/// [build]
Result<Image> read_image(const std::filesystem::path& path);

/// The same from memory; `name` stands for the file in messages. [build]
Result<Image> read_image_bytes(std::string_view bytes, const std::string& name);

/// One channel of values that are no greys: metres, or any other floats. Row 0 is the top row.
struct FloatImage {
  int width = 0;              ///< pixels
  int height = 0;             ///< pixels
  std::vector<float> values;  ///< width * height, finite, as the file stores them: not limited to 0 to 1
  std::string channel;        ///< the file's name of what was read ("Y", "R"), or "luminance" of R, G and B
  std::string reason;         ///< one clause for people: "the only channel"
  float lowest = 0.0F;        ///< of the values
  float highest = 0.0F;
};

/// Whether the bytes begin as an OpenEXR file does. [any]
bool is_exr(std::string_view bytes);

/// Reads one channel of an OpenEXR image: one part, scanlines or tiles (the finest level), any compression, half, float
/// or uint samples. `channel`: the file's own name of it, or red, green, blue, alpha, luminance; empty or "automatic"
/// takes, in order: the only channel; Y; Z; height; displacement; the luminance of R, G and B (equal channels are taken
/// as they are); R. What lies outside the data window is not there.
/// Errors: those of read_image(); file_unsupported (several parts, deep samples, a channel that is subsampled);
/// bad_value (no such channel); bad_map (a value that is not finite, named by its pixel; no channel known to hold
/// heights). Sizes in the header are held against the file's before anything is allocated. [build]
Result<FloatImage> read_float_image(const std::filesystem::path& path, const std::string& channel = "");

/// The same from memory. [build]
Result<FloatImage> read_float_image_bytes(std::string_view bytes, const std::string& name,
                                          const std::string& channel = "");

/// Heights from an image of floats: H = offset + amplitude v, or offset - amplitude v where white is deep, with v as
/// stored: it may lie outside 0 to 1. Values in metres are kept by an amplitude of 1 m and no offset. With
/// `normalised` v is first moved and scaled so that the image's lowest value is 0 and its highest 1 (a constant image
/// becomes 0). Errors: those of HeightMap::build. [build]
Result<HeightMap> float_heights(const FloatImage& image, const HeightMapSettings& settings, bool normalised = false);

/// Bytes as text, for data URIs. [any]
std::string base64(std::string_view bytes);
/// Encodes grey, grey + alpha, RGB or RGBA with 8 or 16 bits as PNG. Errors: bad_value for an image that is none.
/// [build]
Result<std::string> encode_png(const Image& image);

/// Writes a PNG: aside first, then renamed, so that no half-written file is ever seen. Errors: file_unwritable,
/// bad_value. [build]
Status write_png(const std::filesystem::path& path, const Image& image);

}  // namespace asperity
