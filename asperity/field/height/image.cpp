#include "asperity/field/height/image.h"

#include <fmt/format.h>

#include <algorithm>

namespace asperity {
namespace {

struct Range {
  std::uint16_t low = 65535;
  std::uint16_t high = 0;
  void include(std::uint16_t value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  [[nodiscard]] int spread() const { return high - low; }
};

Range channel_range(const Image& image, int channel) {
  Range range;
  const auto step = static_cast<std::size_t>(image.channels);
  for (std::size_t i = static_cast<std::size_t>(channel); i < image.samples.size(); i += step) {
    range.include(image.samples[i]);
  }
  return range;
}

/// Fraction of the pixels whose red, green and blue are apart by more than 3 % of white.
double coloured_fraction(const Image& image) {
  const int threshold = image.maximum() * 3 / 100;
  const auto step = static_cast<std::size_t>(image.channels);
  std::size_t coloured = 0;
  for (std::size_t i = 0; i < image.samples.size(); i += step) {
    Range range;
    for (std::size_t c = 0; c < 3; ++c) range.include(image.samples[i + c]);
    if (range.spread() > threshold) ++coloured;
  }
  return static_cast<double>(coloured) / static_cast<double>(image.pixels());
}

bool only_alpha_varies(const Image& image) {
  const int colours = image.has_colour() ? 3 : 1;
  for (int c = 0; c < colours; ++c) {
    if (channel_range(image, c).spread() > 0) return false;
  }
  return true;
}

ChannelChoice choose_automatically(const Image& image) {
  if (image.channels == 1) return {Channel::luminance, "the only channel"};
  if (image.has_alpha() && channel_range(image, image.channels - 1).spread() > image.maximum() / 50) {
    if (image.has_colour() && coloured_fraction(image) > 0.01) {
      return {Channel::alpha, "alpha varies under a colour image"};
    }
    if (only_alpha_varies(image)) return {Channel::alpha, "only alpha varies"};
  }
  return {Channel::luminance, image.has_alpha() ? "alpha does not look like heights" : "no alpha channel"};
}

float luminance(const std::uint16_t* pixel) {
  if (pixel[0] == pixel[1] && pixel[1] == pixel[2]) return pixel[0];
  return static_cast<float>(0.2126 * pixel[0] + 0.7152 * pixel[1] + 0.0722 * pixel[2]);
}

}  // namespace

int channel_index(const Image& image, Channel channel) {
  switch (channel) {
    case Channel::green: return 1;
    case Channel::blue: return 2;
    case Channel::alpha: return image.channels - 1;
    default: return 0;
  }
}

Status validate(const Image& image) {
  const auto bad = [](std::string what, std::string accepted) {
    return Status(bad_value(std::move(what), {}, std::move(accepted)));
  };
  if (image.width <= 0 || image.height <= 0) {
    return bad(fmt::format("the image has no pixels ({} x {})", image.width, image.height), "at least 1 x 1 pixel");
  }
  if (image.pixels() > max_pixels) {
    return refused(ErrorCode::too_large, fmt::format("the image has {} x {} pixels", image.width, image.height), {},
                   fmt::format("at most {} pixels", max_pixels));
  }
  if (image.channels < 1 || image.channels > 4) {
    return bad(fmt::format("the image has {} channels", image.channels), "1 to 4 channels");
  }
  if (image.bits != 8 && image.bits != 16) return bad(fmt::format("the image has {} bits", image.bits), "8 or 16 bits");
  const std::size_t expected = image.pixels() * static_cast<std::size_t>(image.channels);
  if (image.samples.size() != expected) {
    return bad(fmt::format("the image has {} samples", image.samples.size()),
               fmt::format("width x height x channels = {} samples", expected));
  }
  return success();
}

Result<ChannelChoice> choose_channel(const Image& image, Channel requested) {
  ASPERITY_CHECK(validate(image));
  if (requested == Channel::automatic) return choose_automatically(image);
  const bool colour = requested == Channel::red || requested == Channel::green || requested == Channel::blue;
  if ((colour && !image.has_colour()) || (requested == Channel::alpha && !image.has_alpha())) {
    std::string accepted = "automatic, luminance";
    if (image.has_colour()) accepted += ", red, green, blue";
    if (image.has_alpha()) accepted += ", alpha";
    return bad_value(fmt::format("the image has no {} channel", to_string(requested)), {}, std::move(accepted));
  }
  return ChannelChoice{requested, "as asked"};
}

std::vector<float> extract_channel(const Image& image, Channel channel) {
  std::vector<float> values(image.pixels());
  const auto step = static_cast<std::size_t>(image.channels);
  const auto maximum = static_cast<float>(image.maximum());
  if (channel == Channel::luminance && image.has_colour()) {
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = luminance(&image.samples[i * step]) / maximum;
    return values;
  }
  const auto index = static_cast<std::size_t>(channel_index(image, channel));
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = static_cast<float>(image.samples[i * step + index]) / maximum;
  }
  return values;
}

}  // namespace asperity
