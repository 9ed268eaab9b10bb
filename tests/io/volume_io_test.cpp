// Raw volumes and their sidecars: what is read, and every way in which they can be wrong.

#include "asperity/io/volume_io.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

namespace asperity::volume_io_test {
namespace {

using Json = nlohmann::json;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

template <class T>
std::string bytes_of(const std::vector<T>& values, bool big = false) {
  std::string bytes;
  for (const T value : values) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    if (big) std::reverse(raw, raw + sizeof raw);
    bytes.append(raw, sizeof raw);
  }
  return bytes;
}

/// 3 x 2 x 2 samples counting up: value = i + 3 j + 6 k.
std::vector<float> counting(std::size_t count = 12) {
  std::vector<float> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<float>(i);
  return values;
}

Json plain() {
  return Json{{"asperity_volume", 1},       {"file", "a.raw"},        {"size", {3, 2, 2}},
              {"type", "float32"},          {"byte_order", "little"}, {"spacing", {1.0, 2.0, 3.0}},
              {"origin", {10.0, 0.0, -1.0}}};
}

Result<VolumeSource> read(const Json& sidecar, const std::string& bytes, const VolumeRequest& request = {}) {
  return read_sidecar_volume(sidecar.dump(), bytes, "a.json", request);
}

const ScalarGrid& scalars(const Result<VolumeSource>& source) {
  return *std::get_if<ScalarGrid>(&source->data);
}

bool has_note(const VolumeSource& source, const std::string& part) {
  for (const std::string& note : source.notes) {
    if (note.find(part) != std::string::npos) return true;
  }
  return false;
}

TEST(Sidecar, SamplesSitWhereItSays) {
  Json sidecar = plain();
  sidecar["array"] = "density";
  sidecar["unit"] = "kg/m^3";
  const auto source = read(sidecar, bytes_of(counting()));
  ASSERT_TRUE(source.ok()) << source.error().message();
  const ScalarGrid& grid = scalars(source);
  EXPECT_EQ(grid.type(), SampleType::float32);
  EXPECT_EQ(source->array, "density");
  EXPECT_EQ(source->unit, "kg/m^3");
  EXPECT_EQ(grid.axis(0).size(), 3U);
  EXPECT_EQ(grid.axis(0).front(), 10.0);
  EXPECT_EQ(grid.axis(0).back(), 12.0);
  EXPECT_EQ(grid.axis(2).front(), -1.0);
  EXPECT_EQ(grid.axis(2).back(), 2.0);
  EXPECT_EQ(grid.value(2, 1, 1), 11.0);
  EXPECT_EQ(grid.value(1, 0, 1), 7.0);
  ASSERT_EQ(source->arrays.size(), 1U);
  EXPECT_EQ(source->arrays[0].highest, 11.0);
  EXPECT_TRUE(source->notes.empty());
}

TEST(Sidecar, EveryTypeInEitherByteOrder) {
  for (const bool big : {false, true}) {
    Json sidecar = plain();
    sidecar["byte_order"] = big ? "big" : "little";
    EXPECT_EQ(scalars(read(sidecar, bytes_of(counting(), big))).value(2, 0, 0), 2.0);
    sidecar["type"] = "int16";
    const std::vector<std::int16_t> shorts{-300, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 32767};
    const auto source = read(sidecar, bytes_of(shorts, big));
    ASSERT_TRUE(source.ok());
    EXPECT_EQ(scalars(source).type(), SampleType::int16);
    EXPECT_EQ(scalars(source).value(0, 0, 0), -300.0);
    EXPECT_EQ(scalars(source).highest(), 32767.0);
    sidecar["type"] = "uint8";
    const std::vector<std::uint8_t> bytes{255, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
    EXPECT_EQ(scalars(read(sidecar, bytes_of(bytes, big))).highest(), 255.0);
  }
}

TEST(Sidecar, CellDataSitInTheMiddlesOfTheCells) {
  Json sidecar = plain();
  sidecar["association"] = "cell";
  const auto source = read(sidecar, bytes_of(counting()));
  ASSERT_TRUE(source.ok()) << source.error().message();
  EXPECT_TRUE(source->cell_data);
  EXPECT_EQ(scalars(source).axis(0).size(), 3U);
  EXPECT_EQ(scalars(source).axis(0).front(), 10.5);
  EXPECT_EQ(scalars(source).axis(1).back(), 3.0);
  // One cell along an axis spans nothing between its middles.
  sidecar["size"] = {12, 1, 1};
  const auto thin = read(sidecar, bytes_of(counting()));
  ASSERT_FALSE(thin.ok());
  EXPECT_EQ(thin.error().code, ErrorCode::bad_value);
  EXPECT_NE(thin.error().place.find("axis y"), std::string::npos);
}

TEST(Sidecar, ExplicitAxesAndTheirRepair) {
  Json sidecar = plain();
  sidecar.erase("spacing");
  sidecar.erase("origin");
  sidecar["axes"] = {{"x", {0.0, 1.0, 4.0}}, {"y", {5.0, 3.0}}, {"z", {0.0, 1.0}}};
  const auto source = read(sidecar, bytes_of(counting()));
  ASSERT_TRUE(source.ok()) << source.error().message();
  EXPECT_TRUE(has_note(*source, "y axis descends"));
  EXPECT_FALSE(scalars(source).axis(0).is_uniform());
  EXPECT_EQ(scalars(source).axis(1).front(), 3.0);
  // The sample that was at y = 5 (j = 0) is still at y = 5.
  EXPECT_EQ(scalars(source).value(2, 1, 0), 2.0);
  EXPECT_EQ(scalars(source).value(2, 0, 0), 5.0);
}

TEST(Sidecar, VectorsAndTheirComponents) {
  Json sidecar = plain();
  sidecar["components"] = 3;
  const std::string bytes = bytes_of(counting(36));
  const auto vectors = read(sidecar, bytes);
  ASSERT_TRUE(vectors.ok()) << vectors.error().message();
  const auto* grid = std::get_if<VectorGrid>(&vectors->data);
  ASSERT_NE(grid, nullptr);
  EXPECT_EQ(grid->samples[5], 5.0F);
  VolumeRequest request;
  request.component = 1;
  EXPECT_EQ(scalars(read(sidecar, bytes, request)).value(2, 0, 0), 7.0);
  request.component = 3;
  const auto beyond = read(sidecar, bytes, request);
  ASSERT_FALSE(beyond.ok());
  EXPECT_NE(beyond.error().what.find("component 3"), std::string::npos);
}

TEST(Sidecar, SamplesThatAreNotNumbers) {
  std::vector<float> values = counting();
  values[4] = nan;
  values[7] = nan;
  const auto holes = read(plain(), bytes_of(values));
  ASSERT_TRUE(holes.ok());
  EXPECT_TRUE(has_note(*holes, "2 of 12 samples are not numbers"));
  EXPECT_EQ(scalars(holes).unknown(), 2U);
  EXPECT_TRUE(std::isnan(scalars(holes).value(1, 1, 0)));

  values[7] = std::numeric_limits<float>::infinity();
  const auto infinite = read(plain(), bytes_of(values));
  ASSERT_FALSE(infinite.ok());
  EXPECT_EQ(infinite.error().place, "sample [1, 0, 1]");

  const auto nothing = read(plain(), bytes_of(std::vector<float>(12, nan)));
  ASSERT_FALSE(nothing.ok());
  EXPECT_EQ(nothing.error().code, ErrorCode::bad_value);
}

TEST(Sidecar, TheFileIsExactlyAsLongAsDeclared) {
  const std::string bytes = bytes_of(counting());
  for (std::size_t length = 0; length < bytes.size(); length += 5) {
    const auto source = read(plain(), bytes.substr(0, length));
    ASSERT_FALSE(source.ok());
    EXPECT_EQ(source.error().code, ErrorCode::file_truncated);
    EXPECT_NE(source.error().what.find(std::to_string(length) + " bytes"), std::string::npos);
    EXPECT_NE(source.error().what.find("48 bytes"), std::string::npos);
  }
  const auto longer = read(plain(), bytes + "x");
  ASSERT_FALSE(longer.ok());
  EXPECT_EQ(longer.error().code, ErrorCode::file_malformed);
}

/// A sidecar with one thing wrong, and what the error has to name.
struct Wrong {
  const char* patch;  ///< a JSON merge patch; null removes a key
  ErrorCode code;
  const char* place;
};

class WrongSidecar : public ::testing::TestWithParam<Wrong> {};

TEST_P(WrongSidecar, IsRefusedWithItsPlace) {
  Json sidecar = plain();
  sidecar.merge_patch(Json::parse(GetParam().patch));
  const auto source = read(sidecar, bytes_of(counting()));
  ASSERT_FALSE(source.ok()) << sidecar.dump();
  EXPECT_EQ(source.error().code, GetParam().code) << source.error().message();
  EXPECT_EQ(source.error().place, GetParam().place) << source.error().message();
  EXPECT_FALSE(source.error().accepted.empty()) << source.error().message();
  EXPECT_FALSE(source.error().file.empty());
}

INSTANTIATE_TEST_SUITE_P(
    Keys, WrongSidecar,
    ::testing::Values(Wrong{R"({"asperity_volume":null})", ErrorCode::bad_value, "asperity_volume"},
                      Wrong{R"({"asperity_volume":2})", ErrorCode::file_unsupported, "asperity_volume"},
                      Wrong{R"({"asperity_volume":"1"})", ErrorCode::bad_type, "asperity_volume"},
                      Wrong{R"({"spaceing":[1,1,1]})", ErrorCode::bad_key, "spaceing"},
                      Wrong{R"({"file":null})", ErrorCode::bad_value, "file"},
                      Wrong{R"({"file":7})", ErrorCode::bad_type, "file"},
                      Wrong{R"({"size":null})", ErrorCode::bad_value, "size"},
                      Wrong{R"({"size":12})", ErrorCode::bad_type, "size"},
                      Wrong{R"({"size":[3,2]})", ErrorCode::bad_value, "size"},
                      Wrong{R"({"size":[3,2,"2"]})", ErrorCode::bad_type, "size[2]"},
                      Wrong{R"({"size":[3,0,2]})", ErrorCode::bad_value, "size[1]"},
                      Wrong{R"({"size":[-3,2,2]})", ErrorCode::bad_value, "size[0]"},
                      Wrong{R"({"size":[3.5,2,2]})", ErrorCode::bad_value, "size[0]"},
                      Wrong{R"({"size":[1e30,2,2]})", ErrorCode::bad_value, "size[0]"},
                      Wrong{R"({"size":[1048576,1048576,1048576]})", ErrorCode::too_large, "size"},
                      Wrong{R"({"size":[4294967295,2,2]})", ErrorCode::bad_value, "size[0]"}));

INSTANTIATE_TEST_SUITE_P(Samples, WrongSidecar,
                         ::testing::Values(Wrong{R"({"type":null})", ErrorCode::bad_value, "type"},
                                           Wrong{R"({"type":"float64"})", ErrorCode::bad_value, "type"},
                                           Wrong{R"({"type":4})", ErrorCode::bad_type, "type"},
                                           Wrong{R"({"byte_order":null})", ErrorCode::bad_value, "byte_order"},
                                           Wrong{R"({"byte_order":"middle"})", ErrorCode::bad_value, "byte_order"},
                                           Wrong{R"({"components":2})", ErrorCode::bad_value, "components"},
                                           Wrong{R"({"components":0})", ErrorCode::bad_value, "components"},
                                           Wrong{R"({"association":"vertex"})", ErrorCode::bad_value, "association"},
                                           Wrong{R"({"array":3})", ErrorCode::bad_type, "array"},
                                           Wrong{R"({"unit":[]})", ErrorCode::bad_type, "unit"}));

INSTANTIATE_TEST_SUITE_P(
    Places, WrongSidecar,
    ::testing::Values(Wrong{R"({"spacing":[1,0,1]})", ErrorCode::bad_value, "spacing[1]"},
                      Wrong{R"({"spacing":[1,1,-1]})", ErrorCode::bad_value, "spacing[2]"},
                      Wrong{R"({"spacing":[1,1]})", ErrorCode::bad_value, "spacing"},
                      Wrong{R"({"spacing":["1",1,1]})", ErrorCode::bad_type, "spacing[0]"},
                      Wrong{R"({"origin":[0,"a",0]})", ErrorCode::bad_type, "origin[1]"},
                      Wrong{R"({"origin":5})", ErrorCode::bad_type, "origin"},
                      Wrong{R"({"axes":{"x":[0,1,2],"y":[0,1],"z":[0,1]}})", ErrorCode::bad_key, "spacing"},
                      Wrong{R"({"spacing":null,"origin":null,"axes":{"x":[0,1,2],"y":[0,1]}})", ErrorCode::bad_value,
                            "axes.z"},
                      Wrong{R"({"spacing":null,"origin":null,"axes":{"x":[0,1],"y":[0,1],"z":[0,1]}})",
                            ErrorCode::bad_value, "axes.x"},
                      Wrong{R"({"spacing":null,"origin":null,"axes":{"x":[0,1,"2"],"y":[0,1],"z":[0,1]}})",
                            ErrorCode::bad_type, "axes.x[2]"},
                      Wrong{R"({"spacing":null,"origin":null,"axes":{"x":[0,1,1],"y":[0,1],"z":[0,1]}})",
                            ErrorCode::bad_value, "axis x"},
                      Wrong{R"({"spacing":null,"origin":null,"axes":{"x":[0,2,1],"y":[0,1],"z":[0,1]}})",
                            ErrorCode::bad_value, "axis x"},
                      Wrong{R"({"spacing":null,"origin":null,"axes":{"x":[0,1,2],"y":[0,1],"z":[0,1],"w":[0]}})",
                            ErrorCode::bad_key, "axes.w"},
                      Wrong{R"({"size":[12,1,1]})", ErrorCode::bad_value, "axis y"}));

TEST(Sidecar, AnUnknownKeySuggestsTheNearest) {
  Json sidecar = plain();
  sidecar["byteorder"] = "little";
  const auto source = read(sidecar, bytes_of(counting()));
  ASSERT_FALSE(source.ok());
  EXPECT_NE(source.error().what.find("did you mean \"byte_order\""), std::string::npos) << source.error().message();
}

TEST(Sidecar, TextThatIsNoJson) {
  for (const char* text : {"", "  ", "{", "[1]", "null", "\"a\"", "{\"asperity_volume\": 1", "{\"a\":1,\"a\":2}"}) {
    const auto source = read_sidecar_volume(text, "", "a.json");
    ASSERT_FALSE(source.ok()) << text;
    EXPECT_EQ(source.error().file, "a.json");
  }
}

TEST(Sidecar, ArrayAndAssociationThatItDoesNotHold) {
  VolumeRequest request;
  request.array = "pressure";
  Json sidecar = plain();
  sidecar["array"] = "presure";
  auto source = read(sidecar, bytes_of(counting()), request);
  ASSERT_FALSE(source.ok());
  EXPECT_NE(source.error().what.find("did you mean \"presure\""), std::string::npos) << source.error().message();
  request.array = "presure";
  request.association = Association::cell;
  source = read(sidecar, bytes_of(counting()), request);
  ASSERT_FALSE(source.ok());
  EXPECT_NE(source.error().what.find("sits on nodes"), std::string::npos) << source.error().message();
}

TEST(Sidecar, NothingOfADeclaredSizeIsMadeBeforeItIsAllowed) {
  VolumeRequest request;
  request.most_bytes = 40;
  const auto source = read(plain(), bytes_of(counting()), request);
  ASSERT_FALSE(source.ok());
  EXPECT_EQ(source.error().code, ErrorCode::too_large);
}

class VolumeFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("asperity-volume-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override {
    std::filesystem::remove_all(folder_);
    register_volume_reader(nullptr);
  }
  void write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
  }
  std::filesystem::path folder_;
};

TEST_F(VolumeFiles, ARawFileIsFoundByItsSidecarAndTheOtherWayRound) {
  write("a.raw", bytes_of(counting()));
  EXPECT_FALSE(read_volume(folder_ / "a.raw").ok());
  write("a.json", plain().dump());
  for (const char* name : {"a.json", "a.raw"}) {
    const auto source = read_volume(folder_ / name);
    ASSERT_TRUE(source.ok()) << source.error().message();
    EXPECT_EQ(scalars(source).value(2, 1, 1), 11.0);
    EXPECT_TRUE(is_volume_path(folder_ / name));
  }
  write("scene.json", "{\"surfaces\": []}");
  EXPECT_FALSE(is_volume_path(folder_ / "scene.json"));
  write("a.raw", bytes_of(counting()).substr(1));
  const auto truncated = read_volume(folder_ / "a.json");
  ASSERT_FALSE(truncated.ok());
  EXPECT_EQ(truncated.error().code, ErrorCode::file_truncated);
  EXPECT_NE(truncated.error().file.find("a.raw"), std::string::npos);
  std::filesystem::remove(folder_ / "a.raw");
  const auto missing = read_volume(folder_ / "a.json");
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::file_missing);
  EXPECT_EQ(missing.error().place, "file");
}

TEST_F(VolumeFiles, WhatCannotBeReadIsNamed) {
  EXPECT_EQ(read_volume(folder_ / "absent.vti").error().code, ErrorCode::file_missing);
  EXPECT_EQ(read_volume(folder_).error().code, ErrorCode::file_missing);
  write("a.txt", "x");
  EXPECT_EQ(read_volume(folder_ / "a.txt").error().code, ErrorCode::file_unsupported);
}

TEST_F(VolumeFiles, WithoutVtkTheErrorSaysWhatToInstall) {
  write("a.vti", "x");
  const auto source = read_volume(folder_ / "a.vti");
  ASSERT_FALSE(source.ok());
  EXPECT_EQ(source.error().code, ErrorCode::file_unsupported);
  EXPECT_NE(source.error().accepted.find("install-packages volumes"), std::string::npos);
  register_volume_reader([](const std::filesystem::path& path, const VolumeRequest&, const Progress&) {
    return Result<VolumeSource>(Error{ErrorCode::file_empty, "was asked", path.string(), {}, {}});
  });
  EXPECT_EQ(read_volume(folder_ / "a.vti").error().what, "was asked");
}

}  // namespace
}  // namespace asperity::volume_io_test
