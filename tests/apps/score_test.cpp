// asperity score, and what inspect says of reliefs, by the real program.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

namespace asperity::score_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class Score : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("asperity-score-" + std::to_string(::getpid()) + "-" +
                                           ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
    // A quarter of a second of touch.
    write(
        "quick.json",
        R"({"name":"quick","surfaces":[{"mesh":{"generator":"M_a"},"coat":{"height_map":{"generator":"H_3","size":64},"height":"1mm"}}],
      "stroke":{"type":"line","start":["40%","100%","30%"],"end":["50%","100%","30%"],"speed":"40mm/s","approach_height":"1mm","approach_speed":"20mm/s"}})");
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
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
  void refused(const std::string& arguments, const std::string& part) const {
    EXPECT_EQ(run(arguments), 2) << arguments;
    const std::string message = read(".err");
    EXPECT_NE(message.find(part), std::string::npos) << arguments << ": " << message;
    EXPECT_EQ(message.rfind("asperity: ", 0), 0U) << message;
    EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 1) << message;
    EXPECT_FALSE(fs::exists(folder_ / "out")) << arguments;
  }

  fs::path folder_;
};

TEST_F(Score, SynthesisesAReferenceAndScoresIt) {
  ASSERT_EQ(run("score ref.csv --scene quick.json --synthesise --laws proxy,god-object,mesh/proxy --out o --json"), 0)
      << read(".err");
  const json numbers = json::parse(read(".out"));
  EXPECT_EQ(numbers["positions"], "surface");
  ASSERT_EQ(numbers["laws"].size(), 3U);
  EXPECT_EQ(numbers["laws"][0]["law"], "proxy");
  EXPECT_LT(numbers["laws"][0]["rms_error_n"].get<double>(), 1e-9);
  EXPECT_GT(numbers["laws"][0]["peak_measured_n"].get<double>(), 0.5);
  EXPECT_GT(numbers["laws"][1]["relative_error"].get<double>(), 0.05) << "the base alone is another surface";
  EXPECT_EQ(numbers["laws"][2]["law"], "mesh/proxy");
  EXPECT_EQ(read("ref.csv").substr(0, read("ref.csv").find('\n')), "time_s,x_m,y_m,z_m,fx_N,fy_N,fz_N");
  EXPECT_EQ(json::parse(read("o/score.json"))["laws"], numbers["laws"]);
  EXPECT_NE(read("o/score.csv").find("\"mesh/proxy error\""), std::string::npos);
  EXPECT_NE(read("o/report.html").find("dygraph"), std::string::npos);
  // Once more from the file, as a table.
  ASSERT_EQ(run("score ref.csv --scene quick.json --laws proxy --out p --no-report"), 0) << read(".err");
  EXPECT_NE(read(".out").find("RMS |dF|"), std::string::npos);
  EXPECT_FALSE(fs::exists(folder_ / "p" / "report.html"));
}

TEST_F(Score, PlaysATraceOnItsOwnScene) {
  ASSERT_EQ(run("touch quick.json --out t --no-report"), 0) << read(".err");
  std::string trace;
  for (const auto& entry : fs::directory_iterator(folder_ / "t")) {
    if (entry.path().extension() == ".asptrace") trace = "t/" + entry.path().filename().string();
  }
  ASSERT_FALSE(trace.empty());
  ASSERT_EQ(run("score " + trace + " --laws proxy --out o --json --no-report"), 0) << read(".err");
  const json numbers = json::parse(read(".out"));
  EXPECT_EQ(numbers["positions"], "probe");
  EXPECT_LT(numbers["laws"][0]["rms_error_n"].get<double>(), 1e-9);
}

TEST_F(Score, RefusesOneByOne) {
  refused("score absent.csv --scene quick.json", "no such file");
  refused("score . --scene quick.json", "is a folder");
  write("none.csv", "");
  refused("score none.csv --scene quick.json", "no header");
  write("columns.csv", "time,x,y,z\n0,0,0,0\n");
  refused("score columns.csv --scene quick.json", "no column \"fx\"");
  write("cell.csv", "time,x,y,z,fx,fy,fz\n0,0,0,0,0,0,much\n");
  refused("score cell.csv --scene quick.json", "line 2");
  write("back.csv", "time,x,y,z,fx,fy,fz\n1,0,0,0,0,0,0\n0,0,0,0,0,0,0\n");
  refused("score back.csv --scene quick.json", "line 3");
  const std::string good = "time,x,y,z,fx,fy,fz\n0,0,0.1,0,0,0,0\n1,0,0.1,0,0,0,0\n";
  write("good.csv", good);
  refused("score good.csv", "--scene");
  refused("score good.csv --scene no-scene", "no-scene");
  refused("score good.csv --scene quick.json --laws proxi", "proxy");
  refused("score good.csv --scene quick.json --laws avila", "avila");
  refused("score good.csv --scene quick.json --positions there", "--positions");
  refused("score good.csv --scene quick.json --synthesise", "overwrites nothing");
  refused("score good.csv --scene quick.json --rate 1000kHz --laws proxy,god-object --stiffness soft", "stiffness");
  write("long.csv", "time,x,y,z,fx,fy,fz\n0,0,0.1,0,0,0,0\n99999,0,0.1,0,0,0,0\n");
  refused("score long.csv --scene quick.json", "ticks");
  EXPECT_EQ(read("good.csv"), good) << "the measurement is as it was";
}

TEST_F(Score, InspectAdvisesOnReliefs) {
  ASSERT_EQ(run("inspect quick.json --device phantom-desktop --force 1N --speed 10mm/s --hand firm --json"), 0)
      << read(".err");
  const json answer = json::parse(read(".out"));
  ASSERT_EQ(answer["reliefs"].size(), 1U);
  const json& relief = answer["reliefs"][0];
  EXPECT_EQ(relief["device"], "phantom-desktop");
  EXPECT_EQ(relief["hand"], "firm");
  EXPECT_EQ(relief["force_n"], 1.0);
  EXPECT_NEAR(relief["speed_m_s"].get<double>(), 0.01, 1e-15);
  EXPECT_EQ(relief["criteria"].size(), 8U);
  EXPECT_EQ(relief["devices"].size(), 15U);
  EXPECT_TRUE(relief["base_mesh"]["mean_edge_m"].is_number());
  for (const json& criterion : relief["criteria"]) {
    const bool holds = criterion["limit"].is_null() || criterion["value"] <= criterion["limit"];
    EXPECT_EQ(criterion["passes"].get<bool>(), holds) << criterion.dump();
  }
  // A grating that is too sharp says what would do, and that does: the same scene pressed as suggested.
  ASSERT_EQ(run("inspect quick.json --device falcon --force 6N --json"), 0) << read(".err");
  const json hard = json::parse(read(".out"))["reliefs"][0];
  ASSERT_FALSE(hard["renderable"].get<bool>());
  bool tried = false;
  for (const json& suggestion : hard["suggestions"]) {
    if (suggestion["changes"].size() != 1 || suggestion["changes"][0]["what"] != "force_n") continue;
    tried = true;
    const double force = suggestion["changes"][0]["to"].get<double>();
    ASSERT_EQ(run("inspect quick.json --device falcon --json --force " + std::to_string(force)), 0) << read(".err");
    EXPECT_TRUE(json::parse(read(".out"))["reliefs"][0]["renderable"].get<bool>()) << force;
    ASSERT_EQ(run("inspect quick.json --device falcon --json --force " + std::to_string(1.05 * force)), 0);
    EXPECT_FALSE(json::parse(read(".out"))["reliefs"][0]["renderable"].get<bool>()) << 1.05 * force;
  }
  EXPECT_TRUE(tried) << hard["suggestions"].dump();
  ASSERT_EQ(run("inspect quick.json"), 0);
  for (const char* part : {"fidelity", "sampling", "On every device", "base mesh", "hapticmaster"})
    EXPECT_NE(read(".out").find(part), std::string::npos) << part << "\n" << read(".out");
}

}  // namespace
}  // namespace asperity::score_test
