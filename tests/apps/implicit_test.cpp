// Implicit surfaces by the real program: convert, inspect, touch, compare.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

#include "asperity/geometry/generators.h"
#include "asperity/io/mesh_io.h"

namespace asperity::implicit_test {
namespace {

namespace fs = std::filesystem;

class ImplicitProgram : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("asperity-implicit-" + std::to_string(::getpid()) + "-" +
                                           ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
    ASSERT_TRUE(write_obj(folder_ / "ball.obj", icosphere(3, 30.0)).ok());
    if (run("convert ball.obj probe.vdb --resolution 16") != 0 && read(".err").find("OpenVDB") != std::string::npos)
      GTEST_SKIP() << "the program was built without OpenVDB";
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string read(const std::string& name) const {
    std::ifstream stream(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  [[nodiscard]] int run(const std::string& arguments) const {
    const std::string line =
        "cd '" + folder_.string() + "' && '" ASPERITY_PROGRAM "' " + arguments + " >.out 2>.err </dev/null";
    const int status = std::system(line.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  void refused(const std::string& arguments, const char* part) const {
    EXPECT_EQ(run(arguments), 2) << arguments;
    EXPECT_NE(read(".err").find(part), std::string::npos) << arguments << ": " << read(".err");
  }

  fs::path folder_;
};

TEST_F(ImplicitProgram, AMeshBecomesALevelSetThatIsTouched) {
  ASSERT_EQ(run("convert ball.obj ball.vdb --resolution 48 --json"), 0) << read(".err");
  const auto made = nlohmann::json::parse(read(".out"));
  EXPECT_NEAR(made["voxel"].get<double>(), 60.0 / 48.0, 0.02);
  EXPECT_EQ(made["inside"], "flood");
  ASSERT_EQ(run("inspect ball.vdb"), 0) << read(".err");
  EXPECT_NE(read(".out").find("closest faces: yes, of 1280 triangles"), std::string::npos) << read(".out");
  ASSERT_EQ(run("touch ball.vdb --no-report --out run --json"), 0) << read(".err");
  const auto touched = nlohmann::json::parse(read(".out"));
  EXPECT_GT(touched["metrics"]["ticks"]["contact"].get<int>(), 100) << read(".out");
  ASSERT_EQ(run("replay run/trace.asptrace"), 0) << read(".err") << read(".out");
}

TEST_F(ImplicitProgram, AMeshIsFeltThroughItsPotentialOnTheSpot) {
  for (const char* law : {"proxy", "virtual-contact-point", "virtual-contact-point-literal", "magnetic", "avila"}) {
    ASSERT_EQ(run(std::string("touch ball.obj --implicit=40 --no-report --out run --law ") + law), 0)
        << law << read(".err");
    ASSERT_EQ(run("replay run/trace.asptrace"), 0) << law << read(".err") << read(".out");
  }
  ASSERT_EQ(run("inspect ball.obj --implicit=40"), 0) << read(".err");
  EXPECT_NE(read(".out").find("potential of 1280 triangles"), std::string::npos) << read(".out");
}

TEST_F(ImplicitProgram, RepresentationsAreComparedByTheExactGeometry) {
  ASSERT_EQ(run("compare implicit-box --no-report --out compared --json"), 0) << read(".err");
  const auto compared = nlohmann::json::parse(read(".out"));
  double shading = 0.0;
  double proxy = 1.0;
  double point = 1.0;
  for (const auto& law : compared["laws"]) {
    const auto& direction = law["metrics"]["direction"];
    ASSERT_GT(direction["near_edges"]["samples"].get<int>(), 0) << law["law"];
    if (law["law"] == "mesh/force-shading-literal") shading = direction["elsewhere"]["mean"].get<double>();
    if (law["law"] == "proxy") proxy = direction["elsewhere"]["mean"].get<double>();
    if (law["law"] == "virtual-contact-point") point = direction["elsewhere"]["mean"].get<double>();
  }
  // Row K-3: shading turns the force over the whole face, a potential only near the edge.
  EXPECT_GT(shading, 0.1);
  EXPECT_LT(proxy, 1e-4);
  EXPECT_LT(point, 1e-4);
}

TEST_F(ImplicitProgram, TheScenesOwnLawKeepsItsOptions) {
  ASSERT_EQ(
      run("compare implicit-thin --no-report --out thin --laws virtual-contact-point,virtual-contact-point-literal"
          " --json"),
      0)
      << read(".err");
  const auto thin = nlohmann::json::parse(read(".out"));
  // With the scene's offset 1 N is held; the other law has none, and the plate lets it through.
  EXPECT_NEAR(thin["laws"][0]["metrics"]["force"]["max"].get<double>(), 1.0, 0.05);
  EXPECT_LT(thin["laws"][1]["metrics"]["force"]["max"].get<double>(), 0.5);
  ASSERT_EQ(run("compare implicit-texture --no-report --out texture --laws proxy --json"), 0) << read(".err");
  const auto texture = nlohmann::json::parse(read(".out"));
  EXPECT_LT(texture["laws"][0]["metrics"]["height"]["relative_error"].get<double>(), 0.01) << read(".out");
}

TEST_F(ImplicitProgram, WhatDoesNotGoTogetherIsRefused) {
  refused("convert ball.obj ball.vdb --resolution many", "--resolution");
  refused("convert ball.obj ball.vdb --voxel 1mm", "--voxel");
  refused("convert ball.obj ball.vdb --voxel 1 --resolution 64", "voxel");
  refused("convert ball.obj ball.vdb --inside out", "--inside");
  refused("convert ball.obj ball.vdb --budget lots", "--budget");
  refused("convert ball.obj ball.vdb --derive q_criterion", "options of meshes");
  refused("convert missing.obj ball.vdb", "missing.obj");
  refused("convert ball.obj nowhere/ball.vdb", "nowhere");
  refused("touch ball.obj --implicit=40 --law god-object", "virtual-contact-point");
  refused("compare ball.obj --laws implicit/god-object", "god-object");
  refused("touch missing.vdb", "missing.vdb");
  refused("compare probe.vdb --laws mesh/proxy", "no mesh");
  refused("convert ball.obj ball.vdb --budget '5 '", "--budget");
  EXPECT_FALSE(fs::exists(folder_ / "ball.vdb"));
}

}  // namespace
}  // namespace asperity::implicit_test
