#include "asperity/io/image_io.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <csetjmp>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <memory>
#include <new>
#include <system_error>
#include <utility>
#include <vector>

#include "asperity/io/atomic_file.h"
#include "asperity/io/detail/file_reading.h"

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#endif
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_JPEG
#define STBI_NO_STDIO
// Zeroed memory: a scan may name a Huffman table that the file never defined.
#define STBI_MALLOC(size) std::calloc(1, size)
#define STBI_REALLOC(pointer, size) std::realloc(pointer, size)
#define STBI_FREE(pointer) std::free(pointer)
#include <stb/stb_image.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

namespace asperity {
namespace {

constexpr const char* accepted_images = "a PNG (8 or 16 bits, any kind) or a JPEG";
constexpr std::uintmax_t largest_image_file = std::uintmax_t{1} << 31U;
/// Deflate shrinks at most 1032 times; JPEG spends at least one bit on each block of 64 pixels. A header that promises
/// more than this many samples a byte promises what the file cannot hold, and is refused before allocating.
constexpr std::size_t most_image_pixels_a_byte = 1100 * 8;

Error image_error(ErrorCode code, std::string what, const std::string& name, std::string place = "",
                  std::string accepted = accepted_images) {
  return Error{code, std::move(what), name, std::move(place), std::move(accepted)};
}

Status check_size(std::uint64_t width, std::uint64_t height, std::size_t bytes, const std::string& name) {
  if (width == 0 || height == 0) {
    return image_error(ErrorCode::file_malformed, fmt::format("the image has no pixels ({} x {})", width, height),
                       name);
  }
  if (width > max_pixels || height > max_pixels || width * height > max_pixels) {
    return image_error(ErrorCode::too_large, fmt::format("the image has {} x {} pixels", width, height), name, "",
                       fmt::format("at most {} pixels", max_pixels));
  }
  if (width * height / most_image_pixels_a_byte > bytes) {
    return image_error(ErrorCode::file_truncated,
                       fmt::format("{} x {} pixels cannot be in {} bytes", width, height, bytes), name);
  }
  return success();
}

// ---- PNG ------------------------------------------------------------------------------------------------------------
// libpng reports errors by longjmp. The functions that call setjmp hold no object with a destructor and call only
// libpng; what they fill lives in a PngFile of the caller.

struct PngFile {
  std::string_view bytes;  // read from
  std::size_t position = 0;
  std::string output;  // written to
  bool out_of_data = false;
  bool out_of_memory = false;
  std::array<char, 160> message{};

  png_structp png = nullptr;
  png_infop info = nullptr;
  png_uint_32 width = 0;
  png_uint_32 height = 0;
  int channels = 0;
  int bits = 0;
};

[[noreturn]] void on_png_error(png_structp png, png_const_charp message) {
  auto* file = static_cast<PngFile*>(png_get_error_ptr(png));
  std::snprintf(file->message.data(), file->message.size(), "%s", message);
  png_longjmp(png, 1);
}

void on_png_warning(png_structp, png_const_charp) {}

void read_png_bytes(png_structp png, png_bytep to, png_size_t count) {
  auto* file = static_cast<PngFile*>(png_get_io_ptr(png));
  if (count > file->bytes.size() - file->position) {
    file->out_of_data = true;
    png_error(png, "the file ends early");
  }
  std::memcpy(to, file->bytes.data() + file->position, count);
  file->position += count;
}

void write_png_bytes(png_structp png, png_bytep from, png_size_t count) {
  auto* file = static_cast<PngFile*>(png_get_io_ptr(png));
  try {
    file->output.append(reinterpret_cast<const char*>(from), count);
  } catch (...) {
    file->out_of_memory = true;
  }
  if (file->out_of_memory) png_error(png, "out of memory");
}

void flush_png_bytes(png_structp) {}

struct PngReadCloser {
  void operator()(PngFile* file) const { png_destroy_read_struct(&file->png, &file->info, nullptr); }
};
struct PngWriteCloser {
  void operator()(PngFile* file) const { png_destroy_write_struct(&file->png, &file->info); }
};

bool read_png_header(PngFile& file) {
  if (setjmp(png_jmpbuf(file.png)) != 0) return false;  // NOLINT: libpng's way to report errors
  png_set_user_limits(file.png, 0x7fffffffU, 0x7fffffffU);
  png_set_read_fn(file.png, &file, read_png_bytes);
  png_read_info(file.png, file.info);
  file.width = png_get_image_width(file.png, file.info);
  file.height = png_get_image_height(file.png, file.info);
  return true;
}

/// libpng allocates a row here: only after the size has been checked.
bool prepare_png_rows(PngFile& file) {
  if (setjmp(png_jmpbuf(file.png)) != 0) return false;  // NOLINT
  png_set_expand(file.png);
  if (std::endian::native == std::endian::little) png_set_swap(file.png);
  png_set_interlace_handling(file.png);
  png_read_update_info(file.png, file.info);
  file.channels = png_get_channels(file.png, file.info);
  file.bits = png_get_bit_depth(file.png, file.info);
  return true;
}

bool read_png_rows(PngFile& file, png_bytepp rows) {
  if (setjmp(png_jmpbuf(file.png)) != 0) return false;  // NOLINT
  png_read_image(file.png, rows);
  png_read_end(file.png, nullptr);
  return true;
}

std::vector<png_bytep> row_pointers(void* first, std::size_t rows, std::size_t row_bytes) {
  std::vector<png_bytep> pointers(rows);
  for (std::size_t y = 0; y < rows; ++y) pointers[y] = static_cast<png_bytep>(first) + y * row_bytes;
  return pointers;
}

Error png_failure(const PngFile& file, const std::string& name) {
  return image_error(file.out_of_data ? ErrorCode::file_truncated : ErrorCode::file_malformed,
                     fmt::format("cannot be read as PNG: {}", file.message.data()), name,
                     fmt::format("byte {}", file.position));
}

Result<Image> read_png(std::string_view bytes, const std::string& name) {
  PngFile file;
  file.bytes = bytes;
  file.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &file, on_png_error, on_png_warning);
  const std::unique_ptr<PngFile, PngReadCloser> closer(&file);
  file.info = file.png != nullptr ? png_create_info_struct(file.png) : nullptr;
  if (file.info == nullptr) return image_error(ErrorCode::too_large, "there is no memory to read the image", name);
  if (!read_png_header(file)) return png_failure(file, name);
  ASPERITY_CHECK(check_size(file.width, file.height, bytes.size(), name));
  if (!prepare_png_rows(file)) return png_failure(file, name);

  Image image{static_cast<int>(file.width), static_cast<int>(file.height), file.channels, file.bits == 16 ? 16 : 8, {}};
  const std::size_t row_samples = static_cast<std::size_t>(file.width) * static_cast<std::size_t>(file.channels);
  const std::size_t count = row_samples * file.height;
  image.samples.resize(count);
  if (image.bits == 16) {
    auto rows = row_pointers(image.samples.data(), file.height, row_samples * 2);
    if (!read_png_rows(file, rows.data())) return png_failure(file, name);
    return image;
  }
  std::vector<png_byte> narrow(count);
  auto rows = row_pointers(narrow.data(), file.height, row_samples);
  if (!read_png_rows(file, rows.data())) return png_failure(file, name);
  std::copy(narrow.begin(), narrow.end(), image.samples.begin());
  return image;
}

bool write_png_rows(PngFile& file, int colour_type, png_bytepp rows) {
  if (setjmp(png_jmpbuf(file.png)) != 0) return false;  // NOLINT
  png_set_write_fn(file.png, &file, write_png_bytes, flush_png_bytes);
  png_set_IHDR(file.png, file.info, file.width, file.height, file.bits, colour_type, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(file.png, file.info);
  if (file.bits == 16 && std::endian::native == std::endian::little) png_set_swap(file.png);
  png_write_image(file.png, rows);
  png_write_end(file.png, nullptr);
  return true;
}

Result<std::string> encode_valid_png(const Image& image) {
  constexpr std::array<int, 5> colour_types{0, PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                                            PNG_COLOR_TYPE_RGB_ALPHA};
  PngFile file;
  file.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &file, on_png_error, on_png_warning);
  const std::unique_ptr<PngFile, PngWriteCloser> closer(&file);
  file.info = file.png != nullptr ? png_create_info_struct(file.png) : nullptr;
  file.width = static_cast<png_uint_32>(image.width);
  file.height = static_cast<png_uint_32>(image.height);
  file.bits = image.bits;
  std::vector<png_byte> bytes(image.samples.size() * (image.bits == 16 ? 2 : 1));
  if (image.bits == 16) {
    std::memcpy(bytes.data(), image.samples.data(), bytes.size());
  } else {
    std::transform(image.samples.begin(), image.samples.end(), bytes.begin(),
                   [](std::uint16_t value) { return static_cast<png_byte>(value); });
  }
  auto rows = row_pointers(bytes.data(), file.height, bytes.size() / file.height);
  if (file.info == nullptr ||
      !write_png_rows(file, colour_types[static_cast<std::size_t>(image.channels)], rows.data())) {
    return bad_value(fmt::format("cannot be written as PNG: {}", file.message.data()), "", "");
  }
  return std::move(file.output);
}

// ---- JPEG -----------------------------------------------------------------------------------------------------------

// stb_image 2.27 takes three things on trust that a hostile file can use to write or read outside its tables: the
// number of codes of a Huffman table, the size of a DC category, and sampling factors that do not divide each other.
// They are checked first.

unsigned byte_at(std::string_view bytes, std::size_t index) {
  return static_cast<unsigned char>(bytes[index]);
}

/// DHT segment without its length (ITU T.81, B.2.4.2): tables of 16 counts and as many symbols as the counts say.
bool huffman_tables_are_sound(std::string_view segment) {
  while (!segment.empty()) {
    if (segment.size() < 17) return false;
    std::size_t symbols = 0;
    for (std::size_t i = 1; i <= 16; ++i) symbols += byte_at(segment, i);
    if (symbols > 256 || segment.size() < 17 + symbols) return false;
    const bool is_dc = byte_at(segment, 0) < 16;
    for (std::size_t i = 0; is_dc && i < symbols; ++i) {
      if (byte_at(segment, 17 + i) > 15) return false;
    }
    segment.remove_prefix(17 + symbols);
  }
  return true;
}

/// SOF segment without its length (ITU T.81, B.2.2): every sampling factor divides the largest along its axis.
bool sampling_is_sound(std::string_view segment) {
  if (segment.size() < 6 || segment.size() != 6 + 3 * std::size_t{byte_at(segment, 5)}) return false;
  unsigned most_across = 1;
  unsigned most_down = 1;
  for (std::size_t i = 7; i < segment.size(); i += 3) {
    most_across = std::max(most_across, byte_at(segment, i) >> 4U);
    most_down = std::max(most_down, byte_at(segment, i) & 15U);
  }
  for (std::size_t i = 7; i < segment.size(); i += 3) {
    const unsigned across = byte_at(segment, i) >> 4U;
    const unsigned down = byte_at(segment, i) & 15U;
    if (across == 0 || down == 0 || most_across % across != 0 || most_down % down != 0) return false;
  }
  return true;
}

/// Walks the marker segments (ITU T.81, B.1.1) to the end-of-image marker; the decoder itself fills a missing end with
/// grey.
Status check_jpeg_segments(std::string_view bytes, const std::string& name) {
  std::size_t at = 2;
  while (at + 1 < bytes.size()) {
    const unsigned marker = byte_at(bytes, at + 1);
    if (byte_at(bytes, at) != 0xFF || marker == 0x00 || marker == 0xFF) {
      ++at;  // coded data, or fill bytes before a marker
      continue;
    }
    at += 2;
    if (marker == 0xD9) return success();
    if (marker == 0x01 || (marker >= 0xD0 && marker <= 0xD8)) continue;
    if (at + 2 > bytes.size()) break;
    const std::size_t length = byte_at(bytes, at) * 256 + byte_at(bytes, at + 1);
    if (length > bytes.size() - at) break;
    const std::string_view segment = bytes.substr(at, length).substr(std::min<std::size_t>(length, 2));
    const bool is_frame = marker >= 0xC0 && marker <= 0xC2;
    if (length < 2 || (marker == 0xC4 && !huffman_tables_are_sound(segment)) ||
        (is_frame && !sampling_is_sound(segment))) {
      return image_error(ErrorCode::file_malformed, fmt::format("the JPEG has a damaged segment {:02X}", marker), name,
                         fmt::format("byte {}", at));
    }
    at += length;
  }
  return image_error(ErrorCode::file_truncated, "the JPEG ends before its end-of-image marker", name,
                     fmt::format("byte {}", bytes.size()));
}

Result<Image> read_jpeg(std::string_view bytes, const std::string& name) {
  if (bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) {
    return image_error(ErrorCode::too_large, fmt::format("the JPEG has {} bytes", bytes.size()), name);
  }
  ASPERITY_CHECK(check_jpeg_segments(bytes, name));
  const auto* data = reinterpret_cast<const stbi_uc*>(bytes.data());
  const int size = static_cast<int>(bytes.size());
  int width = 0;
  int height = 0;
  int channels = 0;
  const auto failure = [&] {
    const char* reason = stbi_failure_reason();
    return image_error(ErrorCode::file_malformed,
                       fmt::format("cannot be read as JPEG: {}", reason != nullptr ? reason : "unknown defect"), name);
  };
  if (stbi_info_from_memory(data, size, &width, &height, &channels) == 0) return failure();
  ASPERITY_CHECK(check_size(static_cast<std::uint64_t>(width), static_cast<std::uint64_t>(height), bytes.size(), name));
  const std::unique_ptr<stbi_uc, void (*)(void*)> pixels(
      stbi_load_from_memory(data, size, &width, &height, &channels, 0), stbi_image_free);
  if (pixels == nullptr) return failure();
  Image image{width, height, channels, 8, {}};
  image.samples.assign(pixels.get(), pixels.get() + image.pixels() * static_cast<std::size_t>(channels));
  return image;
}

Result<std::string> read_bytes(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::error_code failure;
  const auto status = std::filesystem::status(path, failure);
  if (!std::filesystem::exists(status)) return image_error(ErrorCode::file_missing, "there is no such file", name);
  if (std::filesystem::is_directory(status))
    return image_error(ErrorCode::file_missing, "is a folder, not a file", name);
  if (std::filesystem::is_regular_file(status) && std::filesystem::file_size(path, failure) > largest_image_file) {
    return image_error(ErrorCode::too_large, "the file has more than 2 GiB", name);
  }
  std::ifstream stream(path, std::ios::binary);
  if (!stream) return image_error(ErrorCode::file_missing, "the file cannot be opened", name);
  std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (stream.bad()) return image_error(ErrorCode::file_truncated, "the file cannot be read to its end", name);
  return bytes;
}

/// What `decode` makes of the file's bytes and its name.
template <class T, class Decode>
Result<T> decoded(const std::filesystem::path& path, const Decode& decode) {
  try {
    ASPERITY_TRY(const std::string bytes, read_bytes(path));
    return decode(bytes, path.string());
  } catch (const std::exception& error) {
    return image_error(ErrorCode::file_missing, fmt::format("cannot be read: {}", error.what()), path.string());
  }
}

}  // namespace

Result<Image> read_image_bytes(std::string_view bytes, const std::string& name) {
  using namespace std::string_view_literals;
  try {
    if (bytes.empty()) return image_error(ErrorCode::file_empty, "the file is empty", name);
    constexpr std::string_view png_signature = "\x89PNG\r\n\x1a\n"sv;
    if (bytes.starts_with(png_signature)) return read_png(bytes, name);
    if (bytes.starts_with("\xff\xd8\xff")) return read_jpeg(bytes, name);
    if (png_signature.starts_with(bytes)) {
      return image_error(ErrorCode::file_truncated, "the file ends within the PNG signature", name);
    }
    if (is_exr(bytes)) {
      return image_error(ErrorCode::file_unsupported, "is an OpenEXR image, of which only heights are read", name);
    }
    return image_error(ErrorCode::file_unsupported, "is neither a PNG nor a JPEG", name);
  } catch (const std::bad_alloc&) {
    return image_error(ErrorCode::too_large, "there is no memory to read the image", name);
  }
}

Result<Image> read_image(const std::filesystem::path& path) {
  return decoded<Image>(path, read_image_bytes);
}

Result<FloatImage> read_float_image(const std::filesystem::path& path, const std::string& channel) {
  return decoded<FloatImage>(path, [&](std::string_view bytes, const std::string& name) {
    return read_float_image_bytes(bytes, name, channel);
  });
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = (bits << 8U) | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : alphabet[(bits >> (18 - 6 * k)) & 63U];
  }
  return text;
}

Result<HeightMap> float_heights(const FloatImage& image, const HeightMapSettings& settings, bool normalised) {
  const auto bad = [](const char* place, double value, const char* accepted) {
    return bad_value(fmt::format("is {}", value), place, accepted);
  };
  if (!std::isfinite(settings.amplitude) || settings.amplitude < 0.0)
    return bad("amplitude", settings.amplitude, "a length of 0 or more");
  if (!std::isfinite(settings.offset)) return bad("offset", settings.offset, "a finite length");
  const double sign = settings.white_is_deep ? -1.0 : 1.0;
  const double low = normalised ? static_cast<double>(image.lowest) : 0.0;
  const double span = normalised ? static_cast<double>(image.highest) - low : 1.0;
  const double scale = span > 0.0 ? sign * settings.amplitude / span : 0.0;
  std::vector<float> heights(image.values.size());
  std::transform(image.values.begin(), image.values.end(), heights.begin(), [&](float value) {
    return static_cast<float>(settings.offset + scale * (static_cast<double>(value) - low));
  });
  return HeightMap::build(std::move(heights), image.width, image.height, settings.wrap, settings.reconstruction);
}

Result<std::string> encode_png(const Image& image) {
  ASPERITY_CHECK(validate(image));
  if (image.bits == 8 && std::any_of(image.samples.begin(), image.samples.end(), [](int v) { return v > 255; })) {
    return bad_value("an 8-bit image holds a sample above 255", "", "samples of 0 to 255");
  }
  try {
    return encode_valid_png(image);
  } catch (const std::bad_alloc&) {
    return refused(ErrorCode::too_large, "there is no memory to write the image", {}, "a smaller image");
  }
}

Status write_png(const std::filesystem::path& path, const Image& image) {
  ASPERITY_TRY(const std::string bytes, in_file(encode_png(image), path.string()));
  return write_file_atomically(path, bytes);
}

}  // namespace asperity
