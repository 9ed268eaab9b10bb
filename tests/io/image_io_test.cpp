#include "asperity/io/image_io.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <zlib.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "asperity/core/rng.h"
#include "asperity/field/mesostructure/mesostructure.h"

namespace asperity::image_io_test {
namespace {

namespace fs = std::filesystem;

// ---- PNG files made by hand from the specification (ISO/IEC 15948), independent of the library that reads them
// -------------

std::string big_endian(std::uint32_t value) {
  return {static_cast<char>(value >> 24U), static_cast<char>(value >> 16U), static_cast<char>(value >> 8U),
          static_cast<char>(value)};
}

std::string chunk(const std::string& type, const std::string& data) {
  const std::string checked = type + data;
  const auto crc = crc32(0, reinterpret_cast<const Bytef*>(checked.data()), static_cast<uInt>(checked.size()));
  return big_endian(static_cast<std::uint32_t>(data.size())) + checked + big_endian(static_cast<std::uint32_t>(crc));
}

std::string deflated(const std::string& data) {
  uLongf size = compressBound(static_cast<uLong>(data.size()));
  std::string packed(size, '\0');
  EXPECT_EQ(compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(data.data()),
                     static_cast<uLong>(data.size())),
            Z_OK);
  packed.resize(size);
  return packed;
}

struct HandMade {
  std::uint32_t width = 1;
  std::uint32_t height = 1;
  int bits = 8;
  int colour_type = 0;  // 0 grey, 2 RGB, 3 palette, 4 grey + alpha, 6 RGBA
  std::string rows;     // each row: filter byte 0, then packed samples
  std::string extra;    // chunks before the data
  bool interlaced = false;
};

std::string png(const HandMade& file) {
  std::string header = big_endian(file.width) + big_endian(file.height);
  header +=
      {static_cast<char>(file.bits), static_cast<char>(file.colour_type), 0, 0, static_cast<char>(file.interlaced)};
  return std::string("\x89PNG\r\n\x1a\n") + chunk("IHDR", header) + file.extra + chunk("IDAT", deflated(file.rows)) +
         chunk("IEND", "");
}

std::string bytes_of(std::initializer_list<int> values) {
  std::string bytes;
  for (const int value : values) bytes += static_cast<char>(value);
  return bytes;
}

std::vector<std::uint16_t> read_samples(const std::string& bytes, int channels, int bits) {
  const auto image = read_image_bytes(bytes, "hand-made.png");
  EXPECT_TRUE(image.ok()) << (image.ok() ? "" : image.error().message());
  if (!image) return {};
  EXPECT_EQ(image->channels, channels);
  EXPECT_EQ(image->bits, bits);
  EXPECT_TRUE(validate(*image).ok());
  return image->samples;
}

using Samples = std::vector<std::uint16_t>;

TEST(ReadPng, GreyOfOneTwoAndFourBitsIsExpandedToTheRangeOfEight) {
  EXPECT_EQ(read_samples(png({4, 1, 1, 0, bytes_of({0, 0b10110000}), ""}), 1, 8), (Samples{255, 0, 255, 255}));
  EXPECT_EQ(read_samples(png({4, 1, 2, 0, bytes_of({0, 0b00011011}), ""}), 1, 8), (Samples{0, 85, 170, 255}));
  EXPECT_EQ(read_samples(png({2, 2, 4, 0, bytes_of({0, 0x0F, 0, 0x3A}), ""}), 1, 8), (Samples{0, 255, 51, 170}));
}

TEST(ReadPng, EightBitsOfEachColourType) {
  EXPECT_EQ(read_samples(png({2, 1, 8, 0, bytes_of({0, 7, 200}), ""}), 1, 8), (Samples{7, 200}));
  EXPECT_EQ(read_samples(png({1, 1, 8, 4, bytes_of({0, 7, 200}), ""}), 2, 8), (Samples{7, 200}));
  EXPECT_EQ(read_samples(png({1, 1, 8, 2, bytes_of({0, 1, 2, 3}), ""}), 3, 8), (Samples{1, 2, 3}));
  EXPECT_EQ(read_samples(png({1, 1, 8, 6, bytes_of({0, 1, 2, 3, 4}), ""}), 4, 8), (Samples{1, 2, 3, 4}));
}

TEST(ReadPng, SixteenBitsKeepTheirByteOrder) {
  EXPECT_EQ(read_samples(png({2, 1, 16, 0, bytes_of({0, 0x12, 0x34, 0xFF, 0x00}), ""}), 1, 16),
            (Samples{0x1234, 0xFF00}));
  EXPECT_EQ(read_samples(png({1, 1, 16, 6, bytes_of({0, 0, 1, 0, 2, 0, 3, 1, 0}), ""}), 4, 16),
            (Samples{1, 2, 3, 256}));
}

TEST(ReadPng, PaletteIsExpandedWithAndWithoutAlpha) {
  const std::string palette = chunk("PLTE", bytes_of({10, 20, 30, 40, 50, 60}));
  EXPECT_EQ(read_samples(png({2, 1, 8, 3, bytes_of({0, 1, 0}), palette}), 3, 8), (Samples{40, 50, 60, 10, 20, 30}));
  EXPECT_EQ(read_samples(png({2, 1, 1, 3, bytes_of({0, 0b10000000}), palette}), 3, 8),
            (Samples{40, 50, 60, 10, 20, 30}));
  const std::string alpha = chunk("tRNS", bytes_of({128}));
  EXPECT_EQ(read_samples(png({2, 1, 8, 3, bytes_of({0, 1, 0}), palette + alpha}), 4, 8),
            (Samples{40, 50, 60, 255, 10, 20, 30, 128}));
}

TEST(ReadPng, InterlacedRowsComeInOrder) {
  // 3 x 3 in Adam7: pass 1 (0,0); passes 2, 3 empty; pass 4 (2,0); pass 5 (0,2) (2,2); pass 6 (1,0), (1,2); pass 7
  // row 1.
  const std::string rows = bytes_of({0, 1, 0, 3, 0, 7, 9, 0, 2, 0, 8, 0, 4, 5, 6});
  EXPECT_EQ(read_samples(png({3, 3, 8, 0, rows, "", true}), 1, 8), (Samples{1, 2, 3, 4, 5, 6, 7, 8, 9}));
}

// ---- JPEG made by hand from ITU T.81: one grey block of 8 x 8, quantised by 8, with the shortest possible Huffman
// tables -----

std::string grey_jpeg() {
  std::string bytes = bytes_of({0xFF, 0xD8, 0xFF, 0xDB, 0, 67, 0}) + std::string(64, '\x08');
  bytes += bytes_of({0xFF, 0xC0, 0, 11, 8, 0, 8, 0, 8, 1, 1, 0x11, 0});
  bytes += bytes_of({0xFF, 0xC4, 0, 20, 0x00, 1}) + std::string(15, '\0') + bytes_of({7});  // DC: code 0 is category 7
  bytes += bytes_of({0xFF, 0xC4, 0, 20, 0x10, 1}) + std::string(15, '\0') + bytes_of({0});  // AC: code 0 ends the block
  bytes += bytes_of({0xFF, 0xDA, 0, 8, 1, 1, 0x00, 0, 63, 0});
  // 0, then 1000000 (DC difference 64: 64 * 8 / 8 = 64 above 128), then 0, padded with ones.
  return bytes + bytes_of({0x40, 0x7F, 0xFF, 0xD9});
}

TEST(ReadJpeg, DecodesAGreyBlock) {
  const auto image = read_image_bytes(grey_jpeg(), "grey.jpg");
  ASSERT_TRUE(image.ok()) << image.error().message();
  EXPECT_EQ(image->width, 8);
  EXPECT_EQ(image->height, 8);
  EXPECT_EQ(image->channels, 1);
  EXPECT_EQ(image->samples, Samples(64, 192));
}

TEST(ReadJpeg, EveryTruncationIsNamed) {
  const std::string whole = grey_jpeg();
  for (std::size_t size = 3; size < whole.size(); ++size) {
    const auto image = read_image_bytes(std::string_view(whole).substr(0, size), "cut.jpg");
    ASSERT_FALSE(image.ok()) << size;
    EXPECT_EQ(image.error().code, ErrorCode::file_truncated) << size;
  }
}

// ---- round trips
// ------------------------------------------------------------------------------------------------------

RC_GTEST_PROP(PngRoundTrip, GivesBackEverySample, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  Image image{
      *rc::gen::inRange(1, 20), *rc::gen::inRange(1, 20), *rc::gen::inRange(1, 5), *rc::gen::element(8, 16), {}};
  const auto levels = static_cast<std::uint32_t>(image.maximum() + 1);
  for (std::size_t i = 0; i < image.pixels() * static_cast<std::size_t>(image.channels); ++i) {
    image.samples.push_back(static_cast<std::uint16_t>(rng.below(levels)));
  }
  const auto bytes = encode_png(image);
  RC_ASSERT(bytes.ok());
  const auto back = read_image_bytes(*bytes, "round.png");
  RC_ASSERT(back.ok());
  RC_ASSERT(back->width == image.width && back->height == image.height);
  RC_ASSERT(back->channels == image.channels && back->bits == image.bits);
  RC_ASSERT(back->samples == image.samples);
}

class ImageFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() /
              ("asperity_image_io_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path put(const std::string& name, const std::string& bytes) {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  ErrorCode refusal(const fs::path& path) {
    const auto image = read_image(path);
    EXPECT_FALSE(image.ok());
    if (image.ok()) return ErrorCode::mismatch;
    EXPECT_EQ(image.error().file, path.string());
    EXPECT_FALSE(image.error().what.empty());
    EXPECT_FALSE(image.error().accepted.empty());
    return image.error().code;
  }
  fs::path folder_;
};

TEST_F(ImageFiles, SixteenBitGreyIsWrittenAndReadBack) {
  Image image{3, 2, 1, 16, {0, 1, 255, 256, 4660, 65535}};
  ASSERT_TRUE(write_png(folder_ / "relief.png", image).ok());
  const auto back = read_image(folder_ / "relief.png");
  ASSERT_TRUE(back.ok()) << back.error().message();
  EXPECT_EQ(back->samples, image.samples);
  EXPECT_EQ(back->bits, 16);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);  // nothing left aside
}

TEST_F(ImageFiles, WritingFailsWithAReason) {
  const Image image{1, 1, 1, 8, {5}};
  const auto nowhere = write_png(folder_ / "no" / "such" / "folder.png", image);
  ASSERT_FALSE(nowhere.ok());
  EXPECT_EQ(nowhere.error().code, ErrorCode::file_unwritable);
  EXPECT_EQ(write_png(folder_ / "none.png", Image{}).error().code, ErrorCode::bad_value);
  EXPECT_EQ(write_png(folder_ / "none.png", Image{1, 1, 1, 8, {256}}).error().code, ErrorCode::bad_value);
  EXPECT_FALSE(fs::exists(folder_ / "none.png"));
}

// ---- bad input, one by one
// ----------------------------------------------------------------------------------------------

TEST_F(ImageFiles, MissingEmptyAndFolder) {
  EXPECT_EQ(refusal(folder_ / "missing.png"), ErrorCode::file_missing);
  EXPECT_EQ(refusal(folder_), ErrorCode::file_missing);
  EXPECT_EQ(refusal(put("empty.png", "")), ErrorCode::file_empty);
}

TEST_F(ImageFiles, NotAnImage) {
  EXPECT_EQ(refusal(put("text.png", "This is a letter, not a picture.")), ErrorCode::file_unsupported);
  EXPECT_EQ(refusal(put("gif.png", "GIF89a\1\1\1\1")), ErrorCode::file_unsupported);
}

TEST_F(ImageFiles, TruncatedPngAtEveryByte) {
  const std::string whole =
      png({3, 2, 8, 2, bytes_of({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 0, 9, 8, 7, 6, 5, 4, 3, 2, 1}), ""});
  ASSERT_TRUE(read_image_bytes(whole, "whole.png").ok());
  for (std::size_t size = 1; size < whole.size(); ++size) {
    const auto image = read_image_bytes(std::string_view(whole).substr(0, size), "cut.png");
    ASSERT_FALSE(image.ok()) << size;
    EXPECT_EQ(image.error().code, ErrorCode::file_truncated) << size << ": " << image.error().message();
  }
}

TEST_F(ImageFiles, DamagedPng) {
  std::string bytes = png({2, 1, 8, 0, bytes_of({0, 7, 200}), ""});
  bytes[bytes.size() - 16] = static_cast<char>(bytes[bytes.size() - 16] ^ 0x55);  // checksum of the data
  EXPECT_EQ(refusal(put("damaged.png", bytes)), ErrorCode::file_malformed);
  EXPECT_EQ(refusal(put("short-data.png", png({2, 9, 8, 0, bytes_of({0, 7, 200}), ""}))), ErrorCode::file_malformed);
  EXPECT_EQ(refusal(put("no-palette.png", png({2, 1, 8, 3, bytes_of({0, 1, 0}), ""}))), ErrorCode::file_malformed);
}

TEST_F(ImageFiles, ZeroPixelsAndAbsurdSizes) {
  EXPECT_EQ(refusal(put("zero.png", png({0, 5, 8, 0, "", ""}))), ErrorCode::file_malformed);
  EXPECT_EQ(refusal(put("huge.png", png({1U << 16U, 1U << 16U, 8, 0, "", ""}))), ErrorCode::too_large);
  EXPECT_EQ(refusal(put("long.png", png({0x7fffffffU, 0x7fffffffU, 16, 6, "", ""}))), ErrorCode::too_large);
  // Within the bound, but more pixels than so few bytes can hold: refused before a gigabyte is allocated.
  EXPECT_EQ(refusal(put("bomb.png", png({1U << 14U, 1U << 14U, 16, 6, "", ""}))), ErrorCode::file_truncated);
  std::string jpeg = grey_jpeg();
  const std::size_t size_at = jpeg.find(bytes_of({0, 8, 0, 8}), 71);
  std::string zero = jpeg;
  zero.replace(size_at, 4, bytes_of({0, 8, 0, 0}));
  EXPECT_EQ(refusal(put("zero.jpg", zero)), ErrorCode::file_malformed);
  jpeg.replace(size_at, 4, bytes_of({0xFF, 0xFF, 0xFF, 0xFF}));
  EXPECT_EQ(refusal(put("huge.jpg", jpeg)), ErrorCode::too_large);
}

TEST(ReadJpeg, TablesThatTheDecoderWouldOverrunAreRefused) {
  const std::string whole = grey_jpeg();
  const std::size_t dc_table = whole.find(bytes_of({0xFF, 0xC4}));
  const auto refused = [&](std::size_t at, int value) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(value);
    const auto image = read_image_bytes(bytes, "hostile.jpg");
    return !image.ok() && image.error().code == ErrorCode::file_malformed;
  };
  EXPECT_TRUE(refused(dc_table + 20, 255));  // 256 codes announced, one given
  EXPECT_TRUE(refused(dc_table + 21, 17));   // a DC difference of 17 bits
  EXPECT_TRUE(refused(dc_table + 3, 19));    // segment shorter than its table
  const std::size_t frame = whole.find(bytes_of({0xFF, 0xC0}));
  EXPECT_TRUE(refused(frame + 11, 0x01));  // sampled zero times
}

TEST(ReadImageFuzz, NeverCrashesAndAnswersAValidImageOrAnError) {
  const std::string seeds[] = {png({3, 3, 8, 0, bytes_of({0, 1, 0, 3, 0, 7, 9, 0, 2, 0, 8, 0, 4, 5, 6}), "", true}),
                               png({2, 1, 8, 3, bytes_of({0, 1, 0}), chunk("PLTE", bytes_of({1, 2, 3, 4, 5, 6}))}),
                               grey_jpeg()};
  Rng rng(20100101);
  int read = 0;
  for (int round = 0; round < 20000; ++round) {
    std::string bytes = seeds[rng.below(3)];
    for (std::uint32_t flips = 1 + rng.below(4); flips > 0; --flips) {
      bytes[rng.below(static_cast<std::uint32_t>(bytes.size()))] = static_cast<char>(rng.below(256));
    }
    const auto image = read_image_bytes(bytes, "fuzz");
    if (image.ok()) {
      ++read;
      ASSERT_TRUE(validate(*image).ok());
    } else {
      ASSERT_FALSE(image.error().what.empty());
    }
  }
  EXPECT_GT(read, 0);  // some changes are harmless: the reader is reached
}

// ---- real maps
// ----------------------------------------------------------------------------------------------------------

const fs::path shared_data = ASPERITY_SHARED_DATA;

Image load(const std::string& name) {
  auto image = read_image(shared_data / name);
  EXPECT_TRUE(image.ok()) << image.error().message();
  return image.ok() ? std::move(image).value() : Image{};
}

TEST(RealMaps, MeasuredTopographyHasTheHeightsItsScaleStates) {
  const fs::path scale_path = shared_data / "topography/matrix-2_height16.json";
  if (!fs::exists(scale_path)) GTEST_SKIP() << "shared data absent: " << scale_path;
  std::ifstream stream(scale_path);
  const auto scale = nlohmann::json::parse(stream);
  const double low = scale["height_min_m"];
  const double high = scale["height_max_m"];
  const Image image = load("topography/matrix-2_height16.png");
  EXPECT_EQ(image.width, scale["width"]);
  EXPECT_EQ(image.height, scale["height"]);
  EXPECT_EQ(image.bits, 16);
  const auto map = HeightMap::build(image, Channel::automatic,
                                    {high - low, low, false, Wrap::clamp, Reconstruction::quadratic_bspline});
  ASSERT_TRUE(map.ok());
  double least = infinity;
  double greatest = -infinity;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      least = std::min(least, map->texel(x, y));
      greatest = std::max(greatest, map->texel(x, y));
    }
  }
  EXPECT_NEAR(least, low, 1e-6 * (high - low));
  EXPECT_NEAR(greatest, high, 1e-6 * (high - low));
  EXPECT_NEAR(map->quantisation_step(), (high - low) / 65535, 1e-15);
  EXPECT_LE(map->lowest(), low);
  EXPECT_GE(map->highest(), high);
}

struct Pair {
  const char* heights;
  const char* normals;
  bool white_is_deep;
  Channel channel;
};

const Pair matching[] = {
    {"godot/texture_bricks_depth.jpg", "godot/texture_bricks_normal.jpg", true, Channel::luminance},
    {"godot/texture_cheese_depth.png", "godot/texture_cheese_normal.png", true, Channel::luminance},
    {"godot/texture_rock_depth.png", "godot/texture_rock_normal.png", true, Channel::luminance},
    {"godot/wool_depth.png", "godot/wool_normal.png", true, Channel::luminance},
    {"bevy/cube_depth.png", "bevy/cube_normal.png", true, Channel::luminance},
    {"ambientcg/rock023_alb_ht.png", "ambientcg/rock023_nrm_rgh.png", false, Channel::alpha},
    {"ambientcg/ground037_alb_ht.png", "ambientcg/ground037_nrm_rgh.png", false, Channel::alpha}};

NormalAgreement compare(const Image& heights, const Image& normals, bool white_is_deep, GreenConvention green) {
  HeightMapSettings settings;
  settings.white_is_deep = white_is_deep;
  const auto height_map = HeightMap::build(heights, Channel::automatic, settings);
  const auto normal_map = NormalMap::build(normals, {.green = green});
  EXPECT_TRUE(height_map.ok() && normal_map.ok());
  return compare_normals(*height_map, *normal_map, {50e-3, 50e-3});
}

TEST(RealMaps, PairsAgreeAndEachWrongSettingGetsItsHint) {
  if (!fs::exists(shared_data / "textures")) GTEST_SKIP() << "shared data absent: " << shared_data / "textures";
  for (const Pair& pair : matching) {
    SCOPED_TRACE(pair.heights);
    const Image heights = load(std::string("textures/") + pair.heights);
    const Image normals = load(std::string("textures/") + pair.normals);
    EXPECT_EQ(choose_channel(heights, Channel::automatic)->channel, pair.channel);
    const NormalAgreement right = compare(heights, normals, pair.white_is_deep, GreenConvention::up);
    std::printf("%-32s correlation %.3f (%.3f along s, %.3f along t), scale %.3f, blocks of %d\n", pair.heights,
                right.correlation, right.correlation_s, right.correlation_t, right.scale, right.block);
    EXPECT_FALSE(disagreement_warning(right).has_value()) << *disagreement_warning(right);
    EXPECT_GE(right.correlation, 0.5);
    EXPECT_GT(right.scale, 0.0);

    const auto green = disagreement_warning(compare(heights, normals, pair.white_is_deep, GreenConvention::down));
    ASSERT_TRUE(green.has_value());
    EXPECT_NE(green->find("green convention"), std::string::npos) << *green;
    EXPECT_EQ(green->find("white_is"), std::string::npos) << *green;
    const auto inverted = disagreement_warning(compare(heights, normals, !pair.white_is_deep, GreenConvention::up));
    ASSERT_TRUE(inverted.has_value());
    EXPECT_NE(inverted->find("white_is"), std::string::npos) << *inverted;
    EXPECT_EQ(inverted->find("green"), std::string::npos) << *inverted;
  }
}

TEST(RealMaps, NormalsOfAnotherPictureAreNamed) {
  if (!fs::exists(shared_data / "textures")) GTEST_SKIP() << "shared data absent: " << shared_data / "textures";
  const std::pair<const char*, const char*> strangers[] = {
      {"godot/wool_depth.png", "bevy/cube_normal.png"},
      {"bevy/cube_depth.png", "godot/texture_cheese_normal.png"},
      {"godot/texture_bricks_depth.jpg", "godot/texture_rock_normal.png"},
      {"ambientcg/rock023_alb_ht.png", "ambientcg/ground037_nrm_rgh.png"}};
  for (const auto& [heights, normals] : strangers) {
    const auto warning =
        disagreement_warning(compare(load(std::string("textures/") + heights), load(std::string("textures/") + normals),
                                     false, GreenConvention::up));
    ASSERT_TRUE(warning.has_value()) << heights;
    EXPECT_NE(warning->find("same picture"), std::string::npos) << *warning;
  }
}

}  // namespace
}  // namespace asperity::image_io_test
