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
  EXPECT_TRUE(has(typo.err,
                  "surfaces[0].law.exponant: is not a key of a law; did you mean \"exponent\"?; accepted: "
                  "type, exponent, damping\n"))
      << typo.err;
  write("low.json", R"({"surfaces":[{"mesh":{"generator":"M_a"},"law":{"type":"hunt-crossley","exponent":0.5}}]})");
  EXPECT_EQ(run(law_, "touch low.json").code, 2);
  const Call near = run(law_, "compare sheet.json --laws hunt-crosley");
  EXPECT_EQ(near.code, 2);
  EXPECT_TRUE(has(near.err, "did you mean \"hunt-crossley\"?")) << near.err;
}

TEST_F(CustomPrograms, AnAddedLawIsFoundWhereverLawsAre) {
  const std::string added = ASPERITY_ADDED_LAW;
  write("felt.json", R"({"name":"felt","surfaces":[{"mesh":{"generator":"M_a"},"law":{"type":"felt-layer-literal",)"
                     R"("pile":"2 mm","recovery":"80 ms"}}],)" +
                         stroke());
  // The schema: what it can be told, with types and ranges.
  const Call schema = run(added, "schema");
  ASSERT_EQ(schema.code, 0) << schema.err;
  const json law = json::parse(schema.out)["definitions"]["law"];
  EXPECT_TRUE(has(law["properties"]["type"].dump(), "\"felt-layer-literal\"")) << law["properties"]["type"].dump();
  for (const char* key : {"pile", "share", "recovery"}) EXPECT_TRUE(law["properties"].contains(key)) << key;
  EXPECT_FALSE(has(run(ASPERITY_PROGRAM, "schema").out, "felt-layer"));
  // The help: of a key, of the command, and the reference page.
  const Call key = run(added, "schema law.recovery");
  EXPECT_TRUE(has(key.out, "felt-layer, literal: time in which it stands up again.")) << key.out;
  EXPECT_TRUE(has(run(added, "schema --page").out, "felt-layer: height of the nap."));
  for (const char* command : {"touch", "compare"}) {
    const Call help = run(added, std::string(command) + " --help");
    EXPECT_TRUE(has(help.out, "* felt-layer: a nap that yields before the ground does (of these tests, eq. 1)"))
        << help.out;
  }
  // compare: where nobody says which laws, in both of its forms; and what each felt differs.
  const Call compared = run(added, "compare felt.json --out compared --json");
  ASSERT_EQ(compared.code, 0) << compared.err;
  std::vector<std::string> laws;
  const json document = json::parse(compared.out);
  for (const json& one : document["laws"]) laws.push_back(one["law"]);
  EXPECT_EQ(laws,
            (std::vector<std::string>{"proxy", "god-object", "force-shading", "felt-layer", "felt-layer-literal"}));
  EXPECT_TRUE(has(read("compared/report.html"), "a nap that yields before the ground does"));
  // The report, and the scene as it was felt, written out.
  const Call touched = run(added, "touch felt.json --out touched --json");
  ASSERT_EQ(touched.code, 0) << touched.err;
  EXPECT_EQ(json::parse(touched.out)["law"], "felt-layer-literal");
  EXPECT_TRUE(has(read("touched/report.html"), "felt-layer-literal"));
  EXPECT_EQ(run(added, "replay touched/trace.asptrace").code, 0);
  // Bad values are refused one by one, as those of any law.
  const auto refused = [&](const std::string& options, const char* message) {
    write("bad.json", R"({"surfaces":[{"mesh":{"generator":"M_a"},"law":{"type":"felt-layer",)" + options + "}}]}");
    const Call call = run(added, "touch bad.json");
    EXPECT_EQ(call.code, 2) << options;
    EXPECT_TRUE(has(call.err, message)) << call.err;
  };
  refused(R"("pile":"-1 mm")", "surfaces[0].law.pile: is -0.001; accepted: a number above 0 (m");
  refused(R"("share":1.5)", "surfaces[0].law.share: is 1.5; accepted: a number 0 to 1");
  refused(R"("recovery":"80 ms")", "is not read by the consistent law \"felt-layer\", whose nap has no memory");
  refused(R"("pyle":1)", "did you mean \"pile\"?; accepted: type, formulation, pile, share");
  refused(R"("band":1)", "surfaces[0].law.band: is not read by the law \"felt-layer\"");
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
