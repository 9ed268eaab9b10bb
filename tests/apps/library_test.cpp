// asperity library: the list, the pictures and the height maps, by the real program.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

#include "asperity/field/mesostructure/library.h"
#include "asperity/io/image_io.h"

namespace asperity::library_test {
namespace {

namespace fs = std::filesystem;

class Library : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("asperity-library-" + std::to_string(::getpid()) + "-" +
                                           ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string read(const fs::path& name) const {
    std::ifstream stream(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  [[nodiscard]] int run(const std::string& arguments) const {
    const std::string line =
        "cd '" + folder_.string() + "' && '" ASPERITY_PROGRAM "' library " + arguments + " >.out 2>.err </dev/null";
    const int status = std::system(line.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  void refused(const std::string& arguments, const char* part) const {
    EXPECT_EQ(run(arguments), 2) << arguments;
    const std::string message = read(".err");
    EXPECT_EQ(message.rfind("asperity: ", 0), 0U) << message;
    EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 1) << message;
    EXPECT_NE(message.find(part), std::string::npos) << message;
  }

  fs::path folder_;
};

TEST_F(Library, ListsEveryRelief) {
  ASSERT_EQ(run(""), 0) << read(".err");
  for (const LibraryEntry& entry : mesostructure_library()) {
    EXPECT_NE(read(".out").find(entry.name), std::string::npos);
    EXPECT_NE(read(".out").find(entry.summary), std::string::npos);
  }
  ASSERT_EQ(run("--json"), 0) << read(".err");
  const auto list = nlohmann::json::parse(read(".out"));
  ASSERT_EQ(list.size(), mesostructure_library().size());
  EXPECT_EQ(list[3]["name"], mesostructure_library()[3].name);
  EXPECT_EQ(list[3]["tile_m"], mesostructure_library()[3].tile);
}

TEST_F(Library, WritesHeightsWithTheirSizesAndAPicture) {
  ASSERT_EQ(run("knurled-metal linen --out drawn --size 96"), 0) << read(".err");
  for (const char* name : {"knurled-metal", "linen"}) {
    const auto image = read_image(folder_ / "drawn" / (std::string(name) + ".png"));
    ASSERT_TRUE(image.ok()) << image.error().message();
    EXPECT_EQ(image->bits, 16);
    const auto sidecar = nlohmann::json::parse(read(fs::path("drawn") / (std::string(name) + ".json")));
    EXPECT_EQ(sidecar["width"], image->width);
    EXPECT_EQ(sidecar["height"], image->height);
    const LibraryEntry entry = *library_entry(name);
    EXPECT_NEAR(sidecar["pixel_size_m"][0].get<double>() * 96.0, entry.tile, 1e-12);
    // The file's heights are the library's to half a step of 16 bits.
    const LibraryRelief relief = *library_mesostructure(name, 96);
    const double low = sidecar["height_min_m"];
    const double high = sidecar["height_max_m"];
    for (std::size_t i = 0; i < relief.heights.size(); i += 37)
      EXPECT_NEAR(low + image->samples[i] / 65535.0 * (high - low), relief.heights[i], 0.51 * (high - low) / 65535.0);
    const auto picture = read_image(folder_ / "drawn" / (std::string(name) + "-thumbnail.png"));
    ASSERT_TRUE(picture.ok()) << picture.error().message();
    EXPECT_EQ(picture->width, 256);
    EXPECT_EQ(picture->height, 256);
    const auto [dark, light] = std::minmax_element(picture->samples.begin(), picture->samples.begin() + 200 * 256);
    EXPECT_GT(*light - *dark, 60) << "relief can be seen";
    EXPECT_NE(read("drawn/index.html").find(std::string(name) + "-thumbnail.png"), std::string::npos);
  }
  EXPECT_EQ(read("drawn/index.html").find("denim"), std::string::npos);
}

TEST_F(Library, PicturesAreLitFromTheUpperLeft) {
  // A stud's upper left edge is lighter than its lower right one.
  ASSERT_EQ(run("stud-plate --out drawn"), 0) << read(".err");
  const auto picture = read_image(folder_ / "drawn/stud-plate-thumbnail.png");
  ASSERT_TRUE(picture.ok());
  const int middle = 256 / 10;  // of the first stud, 8 mm a pitch on 40 mm
  const int edge = static_cast<int>(std::lround(2.38e-3 / 40e-3 * 256.0 * std::sqrt(0.5)));
  const int upper = picture->sample(middle - edge, middle - edge, 0);
  const int lower = picture->sample(middle + edge, middle + edge, 0);
  EXPECT_GT(upper, lower + 40);
}

TEST_F(Library, ReplacesItsFilesWhole) {
  ASSERT_EQ(run("bricks --out drawn --size 32"), 0) << read(".err");
  ASSERT_EQ(run("bricks --out drawn --size 64"), 0) << read(".err");
  EXPECT_EQ(read_image(folder_ / "drawn/bricks.png")->width, 64);
  // Three files and the page: nothing is left beside them.
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "drawn"), fs::directory_iterator()), 4);
}

TEST_F(Library, RefusesWithOneMessage) {
  refused("linnen", "did you mean 'linen'");
  refused("linen --out drawn --size 7", "--size");
  refused("linen --wide", "--wide");
  std::ofstream(folder_ / "taken") << "a file";
  refused("linen --out taken", "taken");
  EXPECT_FALSE(fs::exists(folder_ / "drawn"));
}

}  // namespace
}  // namespace asperity::library_test
