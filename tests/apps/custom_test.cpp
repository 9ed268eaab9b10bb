// The examples that add a law and a surface: each is the whole program, and knows one thing more.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

namespace asperity::custom_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// What a call of a program did.
struct Call {
  int code = -1;
  std::string out;
  std::string err;
};

class CustomPrograms : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("asperity-custom-" + std::to_string(::getpid()) + "-" +
                                           ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
    write(
        "sheet.json",
        R"({"name":"sheet","surfaces":[{"mesh":{"generator":"M_a"},"law":{"type":"hunt-crossley","exponent":1.2}}],)" +
            stroke());
    write("gyroid.json", R"({"name":"gyroid","surfaces":[{"custom":{"type":"gyroid","radius":"25 mm"}}],)" + stroke());
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// A short way over the top, so that the tests are quick.
  static std::string stroke() {
    return R"("stroke":{"type":"line","start":["45%","100%","50%"],"end":["55%","100%","50%"],"speed":"40mm/s",
      "approach_height":"1mm","approach_speed":"20mm/s"}})";
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  [[nodiscard]] std::string read(const fs::path& file) const {
    std::ifstream stream(folder_ / file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  [[nodiscard]] Call run(const std::string& program, const std::string& arguments) const {
    const std::string line =
        "cd '" + folder_.string() + "' && '" + program + "' " + arguments + " >.out 2>.err </dev/null";
    const int status = std::system(line.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read(".out"), read(".err")};
  }
  static bool has(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

  const std::string law_ = ASPERITY_EXAMPLES "/custom_law";
  const std::string surface_ = ASPERITY_EXAMPLES "/custom_surface";
  fs::path folder_;
};

TEST_F(CustomPrograms, LawIsComparedAndReported) {
  const Call call = run(law_, "compare sheet.json --laws proxy,hunt-crossley --out out");
  ASSERT_EQ(call.code, 0) << call.err;
  EXPECT_TRUE(has(call.out, "\nproxy ")) << call.out;
  EXPECT_TRUE(has(call.out, "\nhunt-crossley ")) << call.out;
  bool page = false;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "out")) {
    if (entry.path().extension() == ".html") page = page || has(read(entry.path()), "hunt-crossley");
  }
  EXPECT_TRUE(page);
}

TEST_F(CustomPrograms, LawReplaysToTheSameForces) {
  ASSERT_EQ(run(law_, "touch sheet.json --out out").code, 0);
  fs::path trace;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "out")) {
    if (entry.path().extension() == ".asptrace") trace = entry.path();
  }
  const Call replay = run(law_, "replay '" + trace.string() + "'");
  EXPECT_EQ(replay.code, 0) << replay.out << replay.err;
  // Who does not know the law says so.
  const Call stranger = run(ASPERITY_PROGRAM, "replay '" + trace.string() + "'");
  EXPECT_EQ(stranger.code, 2);
  EXPECT_TRUE(has(stranger.err, "law.type: \"hunt-crossley\" is not known")) << stranger.err;
}

TEST_F(CustomPrograms, LawsNumbersAreReadByName) {
  write("typo.json", R"({"surfaces":[{"mesh":{"generator":"M_a"},"law":{"type":"hunt-crossley","exponant":1.2}}]})");
  const Call typo = run(law_, "touch typo.json");
  EXPECT_EQ(typo.code, 2);
  EXPECT_TRUE(has(typo.err, "surfaces[0].law.exponant: is read by nobody; did you mean \"exponent\"?")) << typo.err;
  write("low.json", R"({"surfaces":[{"mesh":{"generator":"M_a"},"law":{"type":"hunt-crossley","exponent":0.5}}]})");
  EXPECT_EQ(run(law_, "touch low.json").code, 2);
  const Call near = run(law_, "compare sheet.json --laws hunt-crosley");
  EXPECT_EQ(near.code, 2);
  EXPECT_TRUE(has(near.err, "did you mean \"hunt-crossley\"?")) << near.err;
}

TEST_F(CustomPrograms, SurfaceIsTouchedDrawnAndInspected) {
  const Call call = run(surface_, "touch gyroid.json --out out");
  ASSERT_EQ(call.code, 0) << call.err;
  EXPECT_TRUE(has(call.out, "gyroid")) << call.out;
  const Call inspected = run(surface_, "inspect gyroid.json --json");
  ASSERT_EQ(inspected.code, 0) << inspected.err;
  EXPECT_TRUE(has(json::parse(inspected.out).dump(), "custom surface")) << inspected.out;
  const Call compared = run(surface_, "compare gyroid.json --laws proxy,god-object");
  EXPECT_EQ(compared.code, 2);
  EXPECT_TRUE(has(compared.err, "the law \"god-object\" needs triangles, and \"gyroid\" is a surface of its own"))
      << compared.err;
  const Call stranger = run(ASPERITY_PROGRAM, "touch gyroid.json");
  EXPECT_EQ(stranger.code, 2);
  EXPECT_TRUE(has(stranger.err, "surfaces[0].custom.type: \"gyroid\" is no surface")) << stranger.err;
}

}  // namespace
}  // namespace asperity::custom_test
