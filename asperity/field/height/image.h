#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "asperity/core/result.h"

namespace asperity {

/// Most pixels an image or a map may have. Larger ones are refused before anything is allocated.
inline constexpr std::size_t max_pixels = std::size_t{1} << 28U;

/// A picture in memory as its file stored it: no gamma, no scaling. Row 0 is the top row, channels are interleaved in
/// the order grey | grey, alpha | red, green, blue | red, green, blue, alpha.
struct Image {
  int width = 0;     ///< pixels
  int height = 0;    ///< pixels
  int channels = 0;  ///< 1 to 4
  int bits = 8;      ///< 8 or 16 per sample; 1, 2 and 4 bit sources are expanded to the range of 8 bits
  std::vector<std::uint16_t> samples;  ///< width * height * channels values in 0 ... maximum()

  /// Value of full white: 255 or 65535. [any]
  [[nodiscard]] int maximum() const noexcept { return bits == 16 ? 65535 : 255; }
  [[nodiscard]] std::size_t pixels() const noexcept {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
  [[nodiscard]] bool has_colour() const noexcept { return channels >= 3; }
  [[nodiscard]] bool has_alpha() const noexcept { return channels == 2 || channels == 4; }
  /// Stored value of channel `c` at column `x`, row `y` (row 0 on top); all in range. [any]
  [[nodiscard]] std::uint16_t sample(int x, int y, int c) const noexcept {
    const std::size_t pixel =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
    return samples[pixel * static_cast<std::size_t>(channels) + static_cast<std::size_t>(c)];
  }
  /// The same as a fraction of full white, 0 to 1. [any]
  [[nodiscard]] double normalised(int x, int y, int c) const noexcept {
    return static_cast<double>(sample(x, y, c)) / maximum();
  }
};

/// Which number of a pixel is meant. `luminance` is 0.2126 R + 0.7152 G + 0.0722 B of the stored values (no gamma:
/// heights are data, not light), or the grey channel. `automatic` asks `choose_channel` to find the height.
enum class Channel { automatic, luminance, red, green, blue, alpha };
/// As in scene files.
template <>
struct Names<Channel> {
  static constexpr auto table = std::to_array<Named<Channel>>({{Channel::automatic, "automatic"},
                                                               {Channel::luminance, "luminance"},
                                                               {Channel::red, "red"},
                                                               {Channel::green, "green"},
                                                               {Channel::blue, "blue"},
                                                               {Channel::alpha, "alpha"}});
};

/// The channel that is read, and why.
struct ChannelChoice {
  Channel channel = Channel::luminance;  ///< never `automatic`
  std::string reason;                    ///< one clause for people: "alpha varies under a colour image"
};

/// Decides which channel holds the height. A named channel is kept if the image has it. `automatic` takes, in order:
/// the only channel; the alpha channel if it varies (by more than 2 % of white) while the rest looks like a colour
/// image (more than 1 % of the pixels have red, green and blue apart by more than 3 % of white) or is constant; else
/// luminance. Errors: bad_value when the image has no pixels or not the asked channel. [build]
Result<ChannelChoice> choose_channel(const Image& image, Channel requested);

/// Checks size, depth and the number of samples of an image that somebody else filled in. Errors: bad_value, too_large.
/// [build]
Status validate(const Image& image);

/// Which of a pixel's numbers a channel (not `automatic`) is; of the luminance of colours the first of three. [any]
int channel_index(const Image& image, Channel channel);
/// One channel (not `automatic`) of a valid image that has it, as fractions of full white, row 0 on top. [build]
std::vector<float> extract_channel(const Image& image, Channel channel);

}  // namespace asperity
