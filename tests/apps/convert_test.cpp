// asperity convert: volumes into bricked files, by the real program.

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

#include "asperity/field/brick/store.h"
#include "asperity/field/volume/generators.h"

namespace asperity::convert_test {
namespace {

namespace fs = std::filesystem;

class Convert : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("asperity-convert-" + std::to_string(::getpid()) + "-" +
                                           ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
    // A ramp of 20 x 4 x 3 samples, a millimetre apart.
    std::ofstream raw(folder_ / "ramp.raw", std::ios::binary);
    for (int n = 0; n < 240; ++n) raw.put(static_cast<char>(n % 20));
    write("ramp.json",
          R"({"asperity_volume":1,"file":"ramp.raw","size":[20,4,3],"type":"uint8","byte_order":"little",
              "spacing":[1,1,1],"origin":[5,0,0],"array":"ramp"})");
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  [[nodiscard]] std::string read(const std::string& name) const {
    std::ifstream stream(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  [[nodiscard]] int run(const std::string& arguments) const {
    const std::string line =
        "cd '" + folder_.string() + "' && '" ASPERITY_PROGRAM "' convert " + arguments + " >.out 2>.err </dev/null";
    const int status = std::system(line.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  void refused(const std::string& arguments, const char* part) const {
    EXPECT_EQ(run(arguments), 2) << arguments;
    const std::string message = read(".err");
    EXPECT_EQ(message.rfind("asperity: ", 0), 0U) << message;
    EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 1) << message;
    EXPECT_NE(message.find(part), std::string::npos) << message;
    EXPECT_FALSE(fs::exists(folder_ / "out.aspvol"));
  }
  [[nodiscard]] std::unique_ptr<BrickStore> opened() const {
    auto store = BrickStore::open(folder_ / "out.aspvol", {.stream = false});
    EXPECT_TRUE(store.ok()) << store.error().message();
    return std::move(*store);
  }

  fs::path folder_;
};

TEST_F(Convert, BuiltInVolumesAreWrittenSlabBySlab) {
  ASSERT_EQ(run("--generator sphere --size 70x40x35 out.aspvol"), 0) << read(".err");
  EXPECT_NE(read(".out").find("3 levels, 15 bricks"), std::string::npos) << read(".out");
  const auto store = opened();
  const VolumeGenerator generator{.kind = VolumeKind::sphere, .size = std::array<std::uint32_t, 3>{70, 40, 35}};
  const GridAxes axes = *volume_axes(generator);
  EXPECT_EQ(store->axes(0)[0].size(), 70U);
  EXPECT_NEAR(store->axes(0)[0].front(), -0.05, 1e-12) << "around the origin";
  const Vec3 p(axes[0].node(41), axes[1].node(20), axes[2].node(7));
  ASSERT_TRUE(store->fetch({p - Vec3::Constant(0.05), p - Vec3::Constant(0.05)}, 0).ok());
  double out[64];
  ASSERT_TRUE(store->samples(0, {{41, 20, 7}}, out));
  EXPECT_EQ(out[1 + 4 + 16], static_cast<double>(static_cast<float>(VolumeFunction::build(generator)->value(p))));
}

TEST_F(Convert, FilesAreScaledAndFitted) {
  ASSERT_EQ(run("ramp.json out.aspvol --units mm --json"), 0) << read(".err");
  const auto answer = nlohmann::json::parse(read(".out"));
  EXPECT_EQ(answer["levels"], 1);
  EXPECT_EQ(answer["highest"], 19.0);
  EXPECT_EQ(answer["bytes"], fs::file_size(folder_ / "out.aspvol"));
  EXPECT_EQ(opened()->type(), SampleType::uint8);
  EXPECT_NEAR(opened()->axes(0)[0].front(), 5e-3, 1e-12);
  EXPECT_NEAR(opened()->axes(0)[0].back(), 24e-3, 1e-12);
  ASSERT_EQ(run("ramp.json out.aspvol --fit 19cm"), 0) << read(".err");
  EXPECT_NEAR(opened()->axes(0)[0].front(), -0.095, 1e-12);
  EXPECT_NEAR(opened()->axes(0)[0].back(), 0.095, 1e-12);
}

TEST_F(Convert, SlopesAreByTheMetre) {
  ASSERT_EQ(run("ramp.json out.aspvol --units mm --derive gradient_magnitude"), 0) << read(".err");
  EXPECT_NEAR(opened()->lowest(), 1000.0, 1e-2);
  EXPECT_NEAR(opened()->highest(), 1000.0, 1e-2);
}

TEST_F(Convert, TheCavityFlowIsDerivedFrom) {
  ASSERT_EQ(run("--generator cavity --size 40x20x30 --derive vorticity_magnitude out.aspvol"), 0) << read(".err");
  EXPECT_GE(opened()->lowest(), 0.0);
  EXPECT_FALSE(opened()->axes(0)[2].is_uniform());
  ASSERT_EQ(run("--generator cavity --size 40x20x30 --component x out.aspvol"), 0) << read(".err");
  EXPECT_GT(opened()->highest(), 9.0);
}

TEST_F(Convert, RefusesWhatCannotBe) {
  refused("ramp.json", "FILES");
  refused("ramp.json out.vti", "no bricked file");
  refused("missing.json out.aspvol", "missing.json");
  refused("ramp.json out.aspvol --units parsec", "parsec");
  refused("ramp.json out.aspvol --fit -1cm", "--fit");
  refused("ramp.json out.aspvol --derive q_criterion", "vector");
  refused("ramp.json out.aspvol --component x", "--component");
  refused("ramp.json out.aspvol --size 12", "--size");
  refused("--generator sphere ramp.json out.aspvol", "FILES");
  refused("--generator ball out.aspvol", "sphere");
  refused("--generator sphere --size 12x13 out.aspvol", "--size");
  refused("--generator sphere --size 1 out.aspvol", "size");
  refused("--generator sphere --array v out.aspvol", "--array");
  refused("--generator cavity out.aspvol", "--derive");
  refused("--generator sphere no/such/folder/out.aspvol", "cannot be written");
}

}  // namespace
}  // namespace asperity::convert_test
