// OpenEXR heights. The library is used here and nowhere else. It allocates what a header promises, so the header is
// walked and held against the file's size first.

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputFile.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>

#include "asperity/io/image_io.h"

namespace asperity {
namespace {

constexpr const char* accepted_exr =
    "an OpenEXR image of one flat part: scanlines or tiles of half, float or uint samples";
/// A chunk costs at least its entry in the table of chunks and its own header; what is in it may shrink by some
/// thousands (constant areas). More than this many pixels a byte are a promise that the file cannot hold.
constexpr std::uint64_t most_pixels_a_byte = 16384;
/// Bounds the buffer of one chunk: a row of tiles, or the lines that are compressed together.
constexpr std::uint64_t largest_chunk = std::uint64_t{1} << 30U;
/// Most lines that OpenEXR compresses together (DWAB).
constexpr std::uint64_t most_chunk_lines = 256;
/// Coordinates of the data window beyond this leave no room for arithmetic.
constexpr std::int64_t largest_coordinate = std::int64_t{1} << 30U;

Error exr_error(ErrorCode code, std::string what, const std::string& name, std::string place = "",
                std::string accepted = accepted_exr) {
  return Error{code, std::move(what), name, std::move(place), std::move(accepted)};
}

struct ExrChannel {
  std::string name;
  int sampling_x = 1;
  int sampling_y = 1;
};

/// What the header says of sizes.
struct ExrHeader {
  std::int64_t width = 0;
  std::int64_t height = 0;
  std::vector<ExrChannel> channels;
  std::uint64_t pixel_bytes = 0;
  std::uint64_t tile_pixels = 0;  ///< 0: scanlines
};

/// Walks the attributes of a header (OpenEXR file layout, "Header"): name, type, size, value.
class HeaderWalk {
 public:
  HeaderWalk(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  Result<ExrHeader> run() {
    if (bytes_.size() < 8) return truncated();
    const std::uint32_t version = number(4);
    if ((version & 0xffU) != 2)
      return exr_error(ErrorCode::file_unsupported, fmt::format("is version {} of OpenEXR", version & 0xffU), name_,
                       "byte 4");
    if ((version & deep_flag) != 0)
      return exr_error(ErrorCode::file_unsupported, "holds deep samples: many for one pixel", name_, "byte 4");
    if ((version & parts_flag) != 0)
      return exr_error(ErrorCode::file_unsupported, "has several parts", name_, "byte 4");
    tiled_ = (version & tiles_flag) != 0;
    at_ = 8;
    while (true) {
      if (at_ >= bytes_.size()) return truncated();
      if (bytes_[at_] == '\0') break;
      ASPERITY_CHECK(attribute());
    }
    return finish();
  }

 private:
  static constexpr std::uint32_t tiles_flag = 0x200;
  static constexpr std::uint32_t deep_flag = 0x800;
  static constexpr std::uint32_t parts_flag = 0x1000;

  [[nodiscard]] std::uint32_t number(std::size_t at) const {
    std::uint32_t bits = 0;
    for (std::size_t i = 4; i-- > 0;) bits = (bits << 8U) | static_cast<unsigned char>(bytes_[at + i]);
    return bits;
  }
  [[nodiscard]] std::int64_t coordinate(std::size_t at) const { return static_cast<std::int32_t>(number(at)); }
  [[nodiscard]] std::string place() const { return fmt::format("byte {}", at_); }
  [[nodiscard]] Error truncated() const {
    return exr_error(ErrorCode::file_truncated, "ends within its header", name_, fmt::format("byte {}", bytes_.size()));
  }
  [[nodiscard]] Error malformed(std::string what) const {
    return exr_error(ErrorCode::file_malformed, std::move(what), name_, place());
  }

  /// A name that ends in a zero byte, at most 255 characters.
  Result<std::string> word() {
    const std::size_t end = bytes_.substr(0, std::min(bytes_.size(), at_ + 256)).find('\0', at_);
    if (end == std::string_view::npos)
      return at_ + 256 > bytes_.size() ? truncated() : malformed("has a name of more than 255 characters");
    std::string text(bytes_.substr(at_, end - at_));
    at_ = end + 1;
    return text;
  }

  Status attribute() {
    ASPERITY_TRY(const std::string key, word());
    ASPERITY_TRY(const std::string type, word());
    if (bytes_.size() - at_ < 4) return truncated();
    const std::size_t size = number(at_);
    at_ += 4;
    if (size > bytes_.size() - at_) {
      return exr_error(
          ErrorCode::file_truncated,
          fmt::format("promises {} bytes of \"{}\" and has {}", size, key.substr(0, 40), bytes_.size() - at_), name_,
          place());
    }
    if (key == "dataWindow") ASPERITY_CHECK(window(size));
    if (key == "channels") ASPERITY_CHECK(channels(size));
    if (key == "tiles") {
      if (size != 9) return malformed("has a damaged description of its tiles");
      header_.tile_pixels = std::uint64_t{number(at_)} * number(at_ + 4);
    }
    at_ += size;
    return success();
  }

  Status window(std::size_t size) {
    if (size != 16) return malformed("has a damaged data window");
    const std::int64_t low_x = coordinate(at_);
    const std::int64_t low_y = coordinate(at_ + 4);
    const std::int64_t high_x = coordinate(at_ + 8);
    const std::int64_t high_y = coordinate(at_ + 12);
    if (high_x < low_x || high_y < low_y)
      return malformed(fmt::format("has no pixels: a data window of {}, {} to {}, {}", low_x, low_y, high_x, high_y));
    for (const std::int64_t c : {low_x, low_y, high_x, high_y}) {
      if (std::abs(c) > largest_coordinate) return too_large(high_x - low_x + 1, high_y - low_y + 1);
    }
    header_.width = high_x - low_x + 1;
    header_.height = high_y - low_y + 1;
    return success();
  }

  Status channels(std::size_t size) {
    const std::size_t end = at_ + size;
    const std::size_t begin = at_;
    header_.channels.clear();
    header_.pixel_bytes = 0;
    while (at_ < end && bytes_[at_] != '\0') {
      ASPERITY_TRY(const std::string name, word());
      if (at_ > end || end - at_ < 16) return malformed("has a damaged list of channels");
      const std::uint32_t type = number(at_);
      if (type > 2) return malformed(fmt::format("has the sample type {} in channel \"{}\"", type, name));
      header_.pixel_bytes += type == 1 ? 2 : 4;
      header_.channels.push_back(
          {name, static_cast<int>(number(at_ + 8) & 0x7fffffffU), static_cast<int>(number(at_ + 12) & 0x7fffffffU)});
      at_ += 16;
    }
    at_ = begin;
    return success();
  }

  [[nodiscard]] Error too_large(std::int64_t width, std::int64_t height) const {
    return exr_error(ErrorCode::too_large, fmt::format("the image has {} x {} pixels", width, height), name_, "",
                     fmt::format("at most {} pixels", max_pixels));
  }

  Result<ExrHeader> finish() {
    if (header_.width == 0) return exr_error(ErrorCode::file_malformed, "has no data window", name_);
    if (header_.channels.empty()) return exr_error(ErrorCode::file_malformed, "has no channels", name_);
    const auto most = static_cast<std::int64_t>(max_pixels);
    if (header_.width > most || header_.height > most || header_.width * header_.height > most)
      return too_large(header_.width, header_.height);
    const auto width = static_cast<std::uint64_t>(header_.width);
    const auto height = static_cast<std::uint64_t>(header_.height);
    if (width * height / most_pixels_a_byte > bytes_.size()) {
      return exr_error(ErrorCode::file_truncated,
                       fmt::format("{} x {} pixels cannot be in {} bytes", width, height, bytes_.size()), name_);
    }
    if (tiled_ != (header_.tile_pixels > 0))
      return exr_error(ErrorCode::file_malformed, "says that it has tiles, and not which, or the reverse", name_);
    // Tiles are held whole, even where they reach beyond the image.
    if (tiled_ && header_.tile_pixels > 4 * width * height + (std::uint64_t{1} << 18U)) {
      return exr_error(ErrorCode::file_malformed,
                       fmt::format("has tiles of {} pixels in an image of {}", header_.tile_pixels, width * height),
                       name_);
    }
    const std::uint64_t line = width * header_.pixel_bytes;
    if (line > largest_chunk / most_chunk_lines || header_.tile_pixels > largest_chunk / header_.pixel_bytes) {
      return exr_error(ErrorCode::too_large,
                       fmt::format("has {} channels over {} columns, read together", header_.channels.size(), width),
                       name_);
    }
    return header_;
  }

  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_ = 0;
  bool tiled_ = false;
  ExrHeader header_;
};

class MemoryStream : public Imf::IStream {
 public:
  MemoryStream(std::string_view bytes, const std::string& name) : IStream(name.c_str()), bytes_(bytes) {}
  bool read(char to[], int count) override {
    const auto wanted = static_cast<std::size_t>(std::max(count, 0));
    if (wanted > bytes_.size() - std::min(at_, bytes_.size())) throw std::runtime_error("the file ends early");
    std::memcpy(to, bytes_.data() + at_, wanted);
    at_ += wanted;
    return at_ < bytes_.size();
  }
  std::uint64_t tellg() override { return at_; }
  void seekg(std::uint64_t position) override { at_ = static_cast<std::size_t>(position); }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
};

std::string names_of(const ExrHeader& header) {
  std::string names;
  for (const ExrChannel& channel : header.channels) {
    names += (names.empty() ? "" : ", ") + (channel.name.size() > 40 ? channel.name.substr(0, 40) : channel.name);
    if (names.size() > 200) return names + ", ...";
  }
  return names;
}

const ExrChannel* find_channel(const ExrHeader& header, std::string_view name) {
  const auto found = std::ranges::find(header.channels, name, &ExrChannel::name);
  return found == header.channels.end() ? nullptr : &*found;
}

/// Which channels are read: one, or three for their luminance.
struct Choice {
  std::vector<std::string> channels;
  std::string reason;
};

Result<Choice> choose(const ExrHeader& header, const std::string& requested, const std::string& name) {
  const bool colours = find_channel(header, "R") != nullptr && find_channel(header, "G") != nullptr &&
                       find_channel(header, "B") != nullptr;
  if (!requested.empty() && requested != "automatic") {
    if (find_channel(header, requested) != nullptr) return Choice{{requested}, "as asked"};
    for (const auto& [word, letter] : {std::pair{"red", "R"}, {"green", "G"}, {"blue", "B"}, {"alpha", "A"}}) {
      if (requested == word && find_channel(header, letter) != nullptr) return Choice{{letter}, "as asked"};
    }
    if (requested == "luminance" && find_channel(header, "Y") != nullptr) return Choice{{"Y"}, "as asked"};
    if (requested == "luminance" && colours) return Choice{{"R", "G", "B"}, "as asked"};
    return exr_error(
        ErrorCode::bad_value, fmt::format("the image has no {} channel", requested), name, "",
        fmt::format("automatic, or one of its channels: {}{}", names_of(header), colours ? ", luminance" : ""));
  }
  if (header.channels.size() == 1) return Choice{{header.channels.front().name}, "the only channel"};
  for (const char* one : {"Y", "Z", "height", "displacement"}) {
    if (find_channel(header, one) != nullptr) return Choice{{one}, "the channel of heights among several"};
  }
  if (colours) return Choice{{"R", "G", "B"}, "luminance of red, green and blue"};
  if (find_channel(header, "R") != nullptr) return Choice{{"R"}, "there is no Y"};
  return exr_error(ErrorCode::bad_map, "has several channels, and none that is known to hold heights", name, "",
                   fmt::format("the name of a channel: {}", names_of(header)));
}

Result<std::vector<std::vector<float>>> read_channels(std::string_view bytes, const ExrHeader& header,
                                                      const Choice& choice, const std::string& name) {
  const auto pixels = static_cast<std::size_t>(header.width * header.height);
  std::vector<std::vector<float>> planes;
  try {
    MemoryStream stream(bytes, name);
    Imf::InputFile file(stream, 0);
    const Imath::Box2i window = file.header().dataWindow();
    if (window.max.x - window.min.x + 1 != header.width || window.max.y - window.min.y + 1 != header.height)
      return exr_error(ErrorCode::file_malformed, "states its data window twice", name);
    Imf::FrameBuffer target;
    for (const std::string& channel : choice.channels) {
      std::vector<float>& plane = planes.emplace_back(pixels, 0.0F);
      target.insert(channel, Imf::Slice::Make(Imf::FLOAT, plane.data(), window, sizeof(float),
                                              sizeof(float) * static_cast<std::size_t>(header.width)));
    }
    file.setFrameBuffer(target);
    file.readPixels(window.min.y, window.max.y);
  } catch (const std::bad_alloc&) {
    return exr_error(ErrorCode::too_large, "there is no memory to read the image", name);
  } catch (const std::exception& problem) {
    std::string reason = problem.what();
    const bool ends = reason.find("ends early") != std::string::npos ||
                      reason.find("is missing") != std::string::npos || reason.find("incomplete") != std::string::npos;
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    return exr_error(ends ? ErrorCode::file_truncated : ErrorCode::file_malformed,
                     fmt::format("cannot be read as OpenEXR: {}", reason.substr(0, 200)), name);
  }
  return planes;
}

/// Equal channels are one grey: no rounding by weights.
float luminance(float red, float green, float blue) {
  if (red == green && green == blue) return red;
  return static_cast<float>(0.2126 * static_cast<double>(red) + 0.7152 * static_cast<double>(green) +
                            0.0722 * static_cast<double>(blue));
}

}  // namespace

bool is_exr(std::string_view bytes) {
  return bytes.starts_with("\x76\x2f\x31\x01");
}

Result<FloatImage> read_float_image_bytes(std::string_view bytes, const std::string& name, const std::string& channel) {
  if (bytes.empty()) return exr_error(ErrorCode::file_empty, "the file is empty", name);
  if (!is_exr(bytes)) return exr_error(ErrorCode::file_unsupported, "is no OpenEXR image", name);
  try {
    ASPERITY_TRY(const ExrHeader header, HeaderWalk(bytes, name).run());
    ASPERITY_TRY(const Choice choice, choose(header, channel, name));
    for (const std::string& one : choice.channels) {
      const ExrChannel* read = find_channel(header, one);
      if (read->sampling_x != 1 || read->sampling_y != 1) {
        return exr_error(
            ErrorCode::file_unsupported,
            fmt::format("holds channel \"{}\" for every {} x {} pixels only", one, read->sampling_x, read->sampling_y),
            name);
      }
    }
    ASPERITY_TRY(auto planes, read_channels(bytes, header, choice, name));
    FloatImage image;
    image.width = static_cast<int>(header.width);
    image.height = static_cast<int>(header.height);
    image.channel = choice.channels.size() == 3 ? "luminance" : choice.channels.front();
    image.reason = choice.reason;
    image.values = std::move(planes.front());
    if (planes.size() == 3) {
      for (std::size_t i = 0; i < image.values.size(); ++i)
        image.values[i] = luminance(image.values[i], planes[1][i], planes[2][i]);
    }
    image.lowest = std::numeric_limits<float>::infinity();
    image.highest = -std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < image.values.size(); ++i) {
      const float value = image.values[i];
      if (!std::isfinite(value)) {
        const auto width = static_cast<std::size_t>(image.width);
        const char* what = std::isnan(value) ? "no number (NaN)" : "an infinite value";
        return exr_error(ErrorCode::bad_map, fmt::format("has {} in channel {}", what, image.channel), name,
                         fmt::format("column {}, row {} (counted from 0, from the upper left)", i % width, i / width),
                         "finite values");
      }
      image.lowest = std::min(image.lowest, value);
      image.highest = std::max(image.highest, value);
    }
    return image;
  } catch (const std::bad_alloc&) {
    return exr_error(ErrorCode::too_large, "there is no memory to read the image", name);
  }
}

}  // namespace asperity
