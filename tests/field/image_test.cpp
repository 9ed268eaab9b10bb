#include "asperity/field/height/image.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace asperity::image_test {
namespace {

/// A 10 x 10 image whose pixels come from a function of the pixel's number.
template <class Pixel>
Image image_of(int channels, Pixel&& pixel) {
  Image image{10, 10, channels, 8, {}};
  for (int i = 0; i < 100; ++i) {
    for (const int value : std::vector<int>(pixel(i))) image.samples.push_back(static_cast<std::uint16_t>(value));
  }
  return image;
}

Channel chosen(const Image& image) {
  const auto choice = choose_channel(image, Channel::automatic);
  EXPECT_TRUE(choice.ok());
  return choice.ok() ? choice->channel : Channel::automatic;
}

TEST(ChooseChannel, TakesTheOnlyOne) {
  EXPECT_EQ(chosen(image_of(1, [](int i) { return std::vector{i}; })), Channel::luminance);
}

TEST(ChooseChannel, TakesAlphaThatVariesUnderAColourImage) {
  EXPECT_EQ(chosen(image_of(4, [](int i) { return std::vector{200, i, 40, 100 + i}; })), Channel::alpha);
}

TEST(ChooseChannel, TakesLuminanceWhenAlphaIsConstant) {
  EXPECT_EQ(chosen(image_of(4, [](int i) { return std::vector{200, i, 40, 255}; })), Channel::luminance);
}

TEST(ChooseChannel, TakesLuminanceWhenTheImageIsGreyAndVaries) {
  EXPECT_EQ(chosen(image_of(4, [](int i) { return std::vector{i, i, i, 100 + i}; })), Channel::luminance);
  EXPECT_EQ(chosen(image_of(2, [](int i) { return std::vector{i, 100 + i}; })), Channel::luminance);
}

TEST(ChooseChannel, TakesAlphaWhenNothingElseVaries) {
  EXPECT_EQ(chosen(image_of(4, [](int i) { return std::vector{7, 7, 7, i}; })), Channel::alpha);
  EXPECT_EQ(chosen(image_of(2, [](int i) { return std::vector{7, i}; })), Channel::alpha);
}

TEST(ChooseChannel, RefusesAChannelThatIsNotThereAndNamesThoseThatAre) {
  const Image grey = image_of(1, [](int i) { return std::vector{i}; });
  for (const Channel channel : {Channel::red, Channel::green, Channel::blue, Channel::alpha}) {
    const auto choice = choose_channel(grey, channel);
    ASSERT_FALSE(choice.ok());
    EXPECT_EQ(choice.error().code, ErrorCode::bad_value);
    EXPECT_NE(choice.error().what.find(to_string(channel)), std::string::npos);
    EXPECT_EQ(choice.error().accepted, "automatic, luminance");
  }
}

TEST(ExtractChannel, ReadsEachChannelAsAFractionOfWhite) {
  const Image image{1, 1, 4, 8, {51, 102, 204, 255}};
  EXPECT_FLOAT_EQ(extract_channel(image, Channel::red)[0], 0.2F);
  EXPECT_FLOAT_EQ(extract_channel(image, Channel::green)[0], 0.4F);
  EXPECT_FLOAT_EQ(extract_channel(image, Channel::blue)[0], 0.8F);
  EXPECT_FLOAT_EQ(extract_channel(image, Channel::alpha)[0], 1.0F);
  EXPECT_NEAR(extract_channel(image, Channel::luminance)[0], 0.2126 * 0.2 + 0.7152 * 0.4 + 0.0722 * 0.8, 1e-6);
  EXPECT_DOUBLE_EQ(image.normalised(0, 0, 1), 0.4);
}

TEST(ExtractChannel, LuminanceOfGreyIsTheGreyItself) {
  for (int grey = 0; grey <= 255; ++grey) {
    const auto code = static_cast<std::uint16_t>(grey);
    EXPECT_EQ(extract_channel(Image{1, 1, 3, 8, {code, code, code}}, Channel::luminance)[0],
              static_cast<float>(grey) / 255.0F);
  }
}

TEST(ValidateImage, RefusesEachDefect) {
  EXPECT_TRUE(validate(Image{1, 1, 1, 16, {65535}}).ok());
  EXPECT_EQ(validate(Image{}).error().code, ErrorCode::bad_value);
  EXPECT_EQ(validate(Image{1, 1, 5, 8, {0, 0, 0, 0, 0}}).error().code, ErrorCode::bad_value);
  EXPECT_EQ(validate(Image{1, 1, 1, 12, {0}}).error().code, ErrorCode::bad_value);
  EXPECT_EQ(validate(Image{2, 1, 1, 8, {0}}).error().code, ErrorCode::bad_value);
  EXPECT_EQ(validate(Image{1 << 20, 1 << 20, 1, 8, {}}).error().code, ErrorCode::too_large);
}

}  // namespace
}  // namespace asperity::image_test
