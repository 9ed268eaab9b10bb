// OpenEXR heights: files put together by hand from the format's description, damaged ones, and the real ones.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <limits>

#include "asperity/io/image_io.h"

namespace asperity::exr_test {
namespace {

namespace fs = std::filesystem;

template <class Number>
std::string little(Number value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

/// Bits of the half that a float which one can hold is (IEEE 754-2008, binary16), normal numbers and zero.
std::uint16_t half_bits(float value) {
  if (value == 0.0F) return 0;
  int exponent = 0;
  const float mantissa = std::frexp(std::abs(value), &exponent);  // in [1/2, 1)
  const auto fraction = static_cast<std::uint32_t>((mantissa * 2.0F - 1.0F) * 1024.0F);
  return static_cast<std::uint16_t>((value < 0.0F ? 0x8000U : 0U) |
                                    (static_cast<std::uint32_t>(exponent - 1 + 15) << 10U) | fraction);
}

enum class Type { uint = 0, half = 1, real = 2 };

struct Plane {
  std::string name;
  Type type = Type::real;
  std::function<float(int, int)> value;  // of column and row, the upper left from 0
  int sampling = 1;
};

/// An uncompressed OpenEXR file.
struct HandMade {
  int width = 3;
  int height = 2;
  int left = 0;
  int top = 0;
  std::vector<Plane> planes;  // by name, ascending
  int tile = 0;               // 0: scanlines
  std::uint32_t version = 2;
  bool window = true;

  [[nodiscard]] static std::string attribute(const std::string& name, const std::string& type,
                                             const std::string& value) {
    return name + '\0' + type + '\0' + little(static_cast<std::uint32_t>(value.size())) + value;
  }
  [[nodiscard]] static std::string sample(const Plane& plane, int x, int y) {
    const float value = plane.value(x, y);
    if (plane.type == Type::half) return little(half_bits(value));
    return plane.type == Type::uint ? little(static_cast<std::uint32_t>(value)) : little(value);
  }
  [[nodiscard]] std::string header() const {
    std::string list;
    for (const Plane& plane : planes) {
      list += plane.name + '\0' + little(static_cast<std::uint32_t>(plane.type)) + std::string(4, '\0') +
              little(plane.sampling) + little(plane.sampling);
    }
    const std::string box = little(left) + little(top) + little(left + width - 1) + little(top + height - 1);
    std::string text = "\x76\x2f\x31\x01" + little(version | (tile > 0 ? 0x200U : 0U));
    text +=
        attribute("channels", "chlist", list + '\0') + attribute("compression", "compression", std::string(1, '\0'));
    if (window) text += attribute("dataWindow", "box2i", box);
    text += attribute("displayWindow", "box2i", box) + attribute("lineOrder", "lineOrder", std::string(1, '\0')) +
            attribute("pixelAspectRatio", "float", little(1.0F)) +
            attribute("screenWindowCenter", "v2f", little(0.0F) + little(0.0F)) +
            attribute("screenWindowWidth", "float", little(1.0F));
    if (tile > 0) text += attribute("tiles", "tiledesc", little(tile) + little(tile) + std::string(1, '\0'));
    return text + '\0';
  }
  [[nodiscard]] std::string block(int x0, int x1, int y0, int y1) const {
    std::string data;
    for (int y = y0; y < y1; ++y) {
      for (const Plane& plane : planes) {
        for (int x = x0; x < x1; ++x) data += sample(plane, x, y);
      }
    }
    return data;
  }
  [[nodiscard]] std::string bytes() const {
    std::vector<std::string> chunks;
    if (tile == 0) {
      for (int y = 0; y < height; ++y) {
        const std::string data = block(0, width, y, y + 1);
        chunks.push_back(little(top + y) + little(static_cast<std::uint32_t>(data.size())) + data);
      }
    } else {
      for (int j = 0; j * tile < height; ++j) {
        for (int i = 0; i * tile < width; ++i) {
          const std::string data =
              block(i * tile, std::min(width, (i + 1) * tile), j * tile, std::min(height, (j + 1) * tile));
          chunks.push_back(little(i) + little(j) + little(0) + little(0) +
                           little(static_cast<std::uint32_t>(data.size())) + data);
        }
      }
    }
    std::string all = header();
    std::uint64_t offset = all.size() + 8 * chunks.size();
    for (const std::string& chunk : chunks) {
      all += little(offset);
      offset += chunk.size();
    }
    for (const std::string& chunk : chunks) all += chunk;
    return all;
  }
};

float ramp(int x, int y) {
  return static_cast<float>(10 * y + x);
}

FloatImage read(const std::string& bytes, const std::string& channel = "") {
  auto image = read_float_image_bytes(bytes, "a.exr", channel);
  EXPECT_TRUE(image.ok()) << (image.ok() ? "" : image.error().message());
  return image.ok() ? std::move(image).value() : FloatImage{};
}

Error error_of(const std::string& bytes, const std::string& channel = "") {
  const auto image = read_float_image_bytes(bytes, "a.exr", channel);
  EXPECT_FALSE(image.ok());
  if (image.ok()) return {};
  EXPECT_EQ(image.error().file, "a.exr");
  EXPECT_FALSE(image.error().what.empty());
  EXPECT_FALSE(image.error().accepted.empty()) << image.error().message();
  return image.error();
}

TEST(Exr, EverySampleTypeIsReadRowZeroOnTop) {
  for (const Type type : {Type::uint, Type::half, Type::real}) {
    for (const int tile : {0, 2, 16}) {
      HandMade file;
      file.width = 5;
      file.height = 3;
      file.left = -2;
      file.top = 7;
      file.tile = tile;
      file.planes = {{"Y", type, ramp}};
      const FloatImage image = read(file.bytes());
      ASSERT_EQ(image.width, 5);
      ASSERT_EQ(image.height, 3);
      EXPECT_EQ(image.channel, "Y");
      for (int y = 0; y < 3; ++y) {
        for (int x = 0; x < 5; ++x) EXPECT_EQ(image.values[static_cast<std::size_t>(5 * y + x)], ramp(x, y));
      }
      EXPECT_EQ(image.lowest, 0.0F);
      EXPECT_EQ(image.highest, 24.0F);
    }
  }
}

RC_GTEST_PROP(Exr, FloatsComeBackBitForBitWhateverTheirSize, ()) {
  const auto width = *rc::gen::inRange(1, 9);
  const auto height = *rc::gen::inRange(1, 9);
  std::vector<float> values;
  for (int i = 0; i < width * height; ++i) {
    const auto bits = *rc::gen::arbitrary<std::uint32_t>();
    float value = 0.0F;
    std::memcpy(&value, &bits, sizeof value);
    values.push_back(std::isfinite(value) ? value : 1.0F);
  }
  HandMade file;
  file.width = width;
  file.height = height;
  file.tile = *rc::gen::element(0, 3);
  file.planes = {{"Z", Type::real, [&](int x, int y) { return values[static_cast<std::size_t>(y * width + x)]; }}};
  const auto image = read_float_image_bytes(file.bytes(), "a.exr");
  RC_ASSERT(image.ok());
  RC_ASSERT(std::memcmp(image->values.data(), values.data(), values.size() * sizeof(float)) == 0);
}

TEST(Exr, ChannelsAreChosenByRuleOrByName) {
  const auto constant = [](float value) { return [value](int, int) { return value; }; };
  HandMade file;
  file.planes = {{"A", Type::real, constant(9)},
                 {"B", Type::real, constant(4)},
                 {"G", Type::half, constant(2)},
                 {"R", Type::uint, constant(1)}};
  const double luminance = 0.2126 * 1 + 0.7152 * 2 + 0.0722 * 4;
  EXPECT_FLOAT_EQ(read(file.bytes()).values[0], static_cast<float>(luminance));
  EXPECT_EQ(read(file.bytes()).channel, "luminance");
  EXPECT_EQ(read(file.bytes(), "red").values[0], 1.0F);
  EXPECT_EQ(read(file.bytes(), "A").values[0], 9.0F);
  EXPECT_EQ(read(file.bytes(), "alpha").values[0], 9.0F);
  const Error absent = error_of(file.bytes(), "depth");
  EXPECT_EQ(absent.code, ErrorCode::bad_value);
  EXPECT_NE(absent.accepted.find("A, B, G, R"), std::string::npos) << absent.message();

  // Equal channels are one grey, to the bit.
  file.planes = {
      {"B", Type::real, constant(0.1F)}, {"G", Type::real, constant(0.1F)}, {"R", Type::real, constant(0.1F)}};
  EXPECT_EQ(read(file.bytes()).values[3], 0.1F);

  file.planes = {{"RY", Type::half, constant(5), 2}, {"Y", Type::real, constant(3)}};
  file.planes[0].sampling = 1;
  EXPECT_EQ(read(file.bytes()).values[0], 3.0F);
  file.planes = {{"p", Type::real, constant(5)}, {"q", Type::real, constant(3)}};
  const Error unknown = error_of(file.bytes());
  EXPECT_EQ(unknown.code, ErrorCode::bad_map);
  EXPECT_NE(unknown.accepted.find("p, q"), std::string::npos);
  EXPECT_EQ(read(file.bytes(), "q").values[0], 3.0F);
  file.planes[1].sampling = 2;
  EXPECT_EQ(error_of(file.bytes(), "q").code, ErrorCode::file_unsupported);
}

TEST(Exr, ValuesThatAreNotFiniteAreNamedByTheirPixel) {
  for (const float wrong : {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity()}) {
    HandMade file;
    file.planes = {{"Y", Type::real, [wrong](int x, int y) { return x == 2 && y == 1 ? wrong : 0.0F; }}};
    const Error error = error_of(file.bytes());
    EXPECT_EQ(error.code, ErrorCode::bad_map);
    EXPECT_TRUE(error.place.starts_with("column 2, row 1")) << error.message();
  }
}

TEST(Exr, OtherKindsAreRefusedByName) {
  HandMade file;
  file.planes = {{"Y", Type::real, ramp}};
  file.version = 2 | 0x1000U;
  EXPECT_EQ(error_of(file.bytes()).code, ErrorCode::file_unsupported);
  EXPECT_NE(error_of(file.bytes()).what.find("several parts"), std::string::npos);
  file.version = 2 | 0x800U;
  EXPECT_NE(error_of(file.bytes()).what.find("deep"), std::string::npos);
  file.version = 3;
  EXPECT_EQ(error_of(file.bytes()).place, "byte 4");
  file.version = 2;
  file.window = false;
  EXPECT_EQ(error_of(file.bytes()).code, ErrorCode::file_malformed);
  EXPECT_EQ(error_of("").code, ErrorCode::file_empty);
  EXPECT_EQ(error_of("P6 nothing").code, ErrorCode::file_unsupported);
  const auto greys = read_image_bytes("\x76\x2f\x31\x01 more", "a.exr");
  ASSERT_FALSE(greys.ok());
  EXPECT_NE(greys.error().what.find("OpenEXR"), std::string::npos);
  EXPECT_EQ(read_float_image("/no/such/file.exr").error().code, ErrorCode::file_missing);
}

TEST(Exr, WhatTheHeaderPromisesIsHeldAgainstTheFile) {
  HandMade file;
  file.planes = {{"Y", Type::real, ramp}};
  const auto header_of = [&](int width, int height) {
    HandMade other = file;
    other.width = width;
    other.height = height;
    return other.header() + std::string(64, '\0');
  };
  EXPECT_EQ(error_of(header_of(16384, 16384)).code, ErrorCode::file_truncated);
  EXPECT_EQ(error_of(header_of(1 << 20, 1 << 20)).code, ErrorCode::too_large);
  EXPECT_EQ(error_of(header_of(std::numeric_limits<int>::max(), 1)).code, ErrorCode::too_large);
  EXPECT_EQ(error_of(header_of(0, 4)).code, ErrorCode::file_malformed);
  // Attributes that reach beyond the file.
  std::string bytes = file.bytes();
  const std::size_t size = bytes.find("chlist") + 7;
  bytes.replace(size, 4, little(0x7fffffffU));
  EXPECT_EQ(error_of(bytes).code, ErrorCode::file_truncated);
  // Tiles of thousands of millions of pixels for an image of six.
  file.tile = 4;
  bytes = file.bytes();
  const std::size_t tile = bytes.find("tiledesc") + 13;
  bytes.replace(tile, 8, little(0x7fffffffU) + little(0x7fffffffU));
  EXPECT_EQ(error_of(bytes).code, ErrorCode::file_malformed);
}

TEST(Exr, NoTruncationAndNoFlippedByteDoesHarm) {
  for (const int tile : {0, 2}) {
    HandMade file;
    file.tile = tile;
    file.planes = {{"Y", Type::half, ramp}};
    const std::string good = file.bytes();
    for (std::size_t size = 0; size < good.size(); ++size) {
      const auto image = read_float_image_bytes(good.substr(0, size), "a.exr");
      ASSERT_FALSE(image.ok()) << size;
      EXPECT_FALSE(image.error().what.empty());
    }
    for (std::size_t at = 0; at < good.size(); ++at) {
      for (const unsigned flip : {0x01U, 0x80U, 0xffU}) {
        std::string bytes = good;
        bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ flip);
        const auto image = read_float_image_bytes(bytes, "a.exr");
        if (!image.ok()) {
          EXPECT_FALSE(image.error().what.empty());
          continue;
        }
        ASSERT_EQ(image->values.size(),
                  static_cast<std::size_t>(image->width) * static_cast<std::size_t>(image->height));
      }
    }
  }
}

TEST(Exr, HeightsKeepTheFilesValuesOrFillTheRange) {
  HandMade file;
  file.planes = {{"Y", Type::real, [](int x, int y) { return -0.5F + 0.25F * static_cast<float>(x + 4 * y); }}};
  const FloatImage image = read(file.bytes());  // -0.5 to 1: outside 0 to 1
  HeightMapSettings settings;
  settings.amplitude = 1.0;
  settings.reconstruction = Reconstruction::nearest;
  const auto metres = float_heights(image, settings);
  ASSERT_TRUE(metres.ok());
  EXPECT_NEAR(metres->texel(0, 0), -0.5, 1e-6);
  EXPECT_NEAR(metres->texel(2, 1), 1.0, 1e-6);

  settings.amplitude = 2e-3;
  settings.offset = 1e-3;
  settings.white_is_deep = true;
  EXPECT_NEAR(float_heights(image, settings)->texel(2, 1), 1e-3 - 2e-3, 1e-9);
  const auto filled = float_heights(image, settings, true);
  EXPECT_NEAR(filled->texel(0, 0), 1e-3, 1e-9);
  EXPECT_NEAR(filled->texel(2, 1), -1e-3, 1e-9);

  settings.amplitude = -1.0;
  EXPECT_EQ(float_heights(image, settings).error().place, "amplitude");
  settings.amplitude = 1e300;
  EXPECT_FALSE(float_heights(image, settings).ok());
}

TEST(Exr, RealHeightStampsAreRead) {
  const fs::path folder = fs::path(ASPERITY_SHARED_DATA) / "textures" / "exr-height";
  if (!fs::exists(folder)) GTEST_SKIP() << "no " << folder;
  struct Expected {
    const char* name;
    int side;
  };
  for (const Expected& expected : {Expected{"acrylic1", 100}, Expected{"stones", 512}, Expected{"terrain1", 512},
                                   Expected{"texture1", 100}, Expected{"texture2", 380}}) {
    const auto image = read_float_image(folder / (std::string(expected.name) + ".exr"));
    ASSERT_TRUE(image.ok()) << image.error().message();
    EXPECT_EQ(image->width, expected.side) << expected.name;
    EXPECT_EQ(image->height, expected.side);
    EXPECT_EQ(image->channel, "luminance");
    EXPECT_LT(image->lowest, image->highest);
    // The stamps are greys: any one of their channels holds the same heights.
    const auto red = read_float_image(folder / (std::string(expected.name) + ".exr"), "R");
    ASSERT_TRUE(red.ok());
    EXPECT_EQ(red->values, image->values) << expected.name;
  }
}

}  // namespace
}  // namespace asperity::exr_test
