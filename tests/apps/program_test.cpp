// The asperity program: every command's good day, every bad input's one message and exit code, nothing half-written.

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

#include "asperity/geometry/generators.h"
#include "asperity/io/experiment.h"
#include "asperity/io/image_io.h"
#include "asperity/io/mesh_io.h"
#include "asperity/io/trace_file.h"

namespace asperity::program_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// What a call of the program did.
struct Call {
  int code = -1;
  std::string out;
  std::string err;
};

class Program : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("asperity-program-" + std::to_string(::getpid()) + "-" +
                                           ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
    MeshSource ball = icosphere(2, 3.0);
    ball.corner_uvs.clear();
    ASSERT_TRUE(write_obj(folder_ / "ball.obj", ball).ok());
    Image map{8, 8, 1, 8, {}};
    for (int i = 0; i < 64; ++i) map.samples.push_back(static_cast<std::uint16_t>(i * 4));
    ASSERT_TRUE(write_png(folder_ / "map.png", map).ok());
    // Half a second of touch, so that the tests are quick.
    write(
        "quick.json",
        R"({"name":"quick","surfaces":[{"mesh":{"generator":"M_a"},"coat":{"height_map":{"generator":"H_3","size":64},"height":"1mm"}}],
      "stroke":{"type":"line","start":["40%","100%","30%"],"end":["50%","100%","30%"],"speed":"40mm/s","approach_height":"1mm","approach_speed":"20mm/s"}})");
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  [[nodiscard]] std::string read(const fs::path& file) const {
    std::ifstream stream(folder_ / file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  /// Runs `asperity ARGUMENTS` in the test's folder.
  [[nodiscard]] Call run(const std::string& arguments) const {
    const std::string line =
        "cd '" + folder_.string() + "' && '" ASPERITY_PROGRAM "' " + arguments + " >.out 2>.err </dev/null";
    const int status = std::system(line.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read(".out"), read(".err")};
  }
  /// A call that must fail with code 2 and one message holding every part, and leave no output behind.
  void refused(const std::string& arguments, std::initializer_list<const char*> parts) const {
    const Call call = run(arguments);
    EXPECT_EQ(call.code, 2) << arguments << "\n" << call.err;
    EXPECT_EQ(call.err.rfind("asperity: ", 0), 0u) << call.err;
    EXPECT_EQ(std::count(call.err.begin(), call.err.end(), '\n'), 1) << call.err;
    EXPECT_EQ(call.out, "") << arguments;
    for (const char* part : parts) EXPECT_NE(call.err.find(part), std::string::npos) << arguments << "\n" << call.err;
    EXPECT_FALSE(fs::exists(folder_ / "out")) << arguments;
  }
  static bool has(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

  fs::path folder_;
};

TEST_F(Program, HelpTeaches) {
  const Call help = run("--help");
  EXPECT_EQ(help.code, 0);
  EXPECT_TRUE(has(help.out, "Exit codes"));
  for (const char* command : {"touch", "compare", "replay", "inspect", "scenes", "bench", "schema", "doctor"}) {
    EXPECT_TRUE(has(help.out, command)) << command;
    const Call one = run(std::string(command) + " --help");
    EXPECT_EQ(one.code, 0) << command;
    EXPECT_TRUE(has(one.out, "Example")) << command;
    EXPECT_TRUE(has(one.out, (std::string("asperity ") + command).c_str())) << command;
  }
  EXPECT_EQ(run("--version").out.rfind("asperity ", 0), 0u);
}

TEST_F(Program, TouchWritesTraceNumbersAndReport) {
  const Call call = run("touch quick.json");
  ASSERT_EQ(call.code, 0) << call.err;
  EXPECT_LE(std::count(call.out.begin(), call.out.end(), '\n'), 12);
  for (const char* part : {"quick", "proxy", "force", "height", "p99.9", "flags", "out/quick/report.html"})
    EXPECT_TRUE(has(call.out, part)) << part;
  const std::string page = read("out/quick/report.html");
  EXPECT_TRUE(has(page, "<html")) << page.size();
  const json numbers = json::parse(read("out/quick/run.json"));
  EXPECT_EQ(numbers["scene"], "quick");
  EXPECT_GT(numbers["metrics"]["force"]["max"].get<double>(), 0.5);
  const Result<Trace> trace = read_trace((folder_ / "out/quick/trace.asptrace").string());
  ASSERT_TRUE(trace.ok());
  EXPECT_TRUE(trace->complete);
  EXPECT_EQ(numbers["ticks"].get<std::size_t>(), trace->records.size());
  EXPECT_EQ(numbers["force_hash"].get<std::string>(), format_hash(force_hash(trace->records)));
  for (const auto& file : fs::recursive_directory_iterator(folder_ / "out"))
    EXPECT_NE(file.path().extension(), ".part");
}

TEST_F(Program, TouchTwiceIsBitEqual) {
  const Call first = run("touch quick.json --no-report --json --out a");
  const Call second = run("touch quick.json --no-report --json --out b");
  ASSERT_EQ(first.code, 0) << first.err;
  ASSERT_EQ(second.code, 0) << second.err;
  EXPECT_EQ(json::parse(first.out)["force_hash"], json::parse(second.out)["force_hash"]);
  const Call other = run("touch quick.json --no-report --json --out c --stiffness 0.8N/mm");
  EXPECT_NE(json::parse(first.out)["force_hash"], json::parse(other.out)["force_hash"]);
}

TEST_F(Program, AMeshAndAMapAreEnough) {
  const Call bare = run("touch ball.obj --no-report --json --speed 100mm/s");
  ASSERT_EQ(bare.code, 0) << bare.err;
  EXPECT_EQ(json::parse(bare.out)["law"], "proxy");
  EXPECT_TRUE(has(bare.err, "states no unit"));
  const Call relief =
      run("touch ball.obj --relief map.png --height 0.5mm --tile 20mm --no-report --json --speed 100mm/s --csv "
          "--device omega.7 --force 1N");
  ASSERT_EQ(relief.code, 0) << relief.err;
  const json document = json::parse(relief.out);
  EXPECT_EQ(document["law"], "proxy");
  EXPECT_EQ(document["scene"], "ball");
  EXPECT_TRUE(has(document["setup"]["stroke"].get<std::string>(), "pressed with 1 N"));
  EXPECT_TRUE(has(document["setup"]["device"].get<std::string>(), "omega.7"));
  EXPECT_TRUE(fs::exists(folder_ / "out/ball/trace.csv"));
  EXPECT_EQ(run("replay out/ball/trace.asptrace").code, 0);
}

TEST_F(Program, EveryOptionReachesTheScene) {
  ASSERT_EQ(run("touch ball.obj --relief map.png --height 1mm --tile 9mm --channel luminance --white-is deep --mapping "
                "triplanar --magnify 0.5 "
                "--units cm --fit 60mm --up z --law height-field --stiffness 500 --damping 0.25 --depth 0.5mm --speed "
                "200mm/s --device falcon "
                "--hand firm --rate 500 --probe dynamic --no-report --out o")
                .code,
            0);
  const Result<Trace> trace = read_trace((folder_ / "o/trace.asptrace").string());
  ASSERT_TRUE(trace.ok());
  const json scene = json::parse(trace->metadata.scene);
  const json& surface = scene["surfaces"][0];
  EXPECT_EQ(surface["units"], "cm");
  EXPECT_EQ(surface["fit"], 0.06);
  EXPECT_EQ(surface["up"], "z");
  EXPECT_EQ(surface["law"]["type"], "height-field");
  EXPECT_EQ(surface["material"]["stiffness"], 500.0);
  EXPECT_EQ(surface["material"]["damping"], 0.25);
  EXPECT_EQ(surface["coat"]["height"], 0.001);
  EXPECT_DOUBLE_EQ(surface["coat"]["tile"].get<double>(), 0.009);
  EXPECT_EQ(surface["coat"]["channel"], "luminance");
  EXPECT_EQ(surface["coat"]["white_is"], "deep");
  EXPECT_EQ(surface["coat"]["mapping"], "triplanar");
  EXPECT_EQ(surface["coat"]["magnify"], 0.5);
  EXPECT_EQ(scene["stroke"]["depth"], 0.0005);
  EXPECT_EQ(scene["stroke"]["speed"], 0.2);
  EXPECT_EQ(scene["device"], "falcon");
  EXPECT_EQ(scene["hand"], "firm");
  EXPECT_EQ(scene["probe"]["rate"], 500.0);
  EXPECT_EQ(scene["probe"]["kind"], "dynamic");
  EXPECT_EQ(run("replay o/trace.asptrace").code, 0);
  // What described the scene's own map does not describe another one: its height is the default again.
  std::string low = read("quick.json");
  low.replace(low.find("\"1mm\"}"), 5, "\"0.3mm\"");
  write("low.json", low);
  ASSERT_EQ(run("touch low.json --relief map.png --no-report --out r").code, 0);
  EXPECT_NEAR(
      json::parse(read_trace((folder_ / "r/trace.asptrace").string())->metadata.scene)["surfaces"][0]["coat"]["height"]
          .get<double>(),
      1e-3, 1e-9);
  ASSERT_EQ(run("touch ball.obj --probe-radius 1mm --speed 200mm/s --no-report --out p").code, 0);
  EXPECT_EQ(json::parse(read_trace((folder_ / "p/trace.asptrace").string())->metadata.scene)["probe"]["radius"], 0.001);
}

TEST_F(Program, ReplayIsBitEqualAndSaysWhenNot) {
  ASSERT_EQ(run("touch quick.json --no-report").code, 0);
  const std::string path = "out/quick/trace.asptrace";
  const Call good = run("replay " + path);
  EXPECT_EQ(good.code, 0) << good.err;
  EXPECT_TRUE(has(good.out, "bit-equal"));
  EXPECT_EQ(json::parse(run("replay " + path + " --json").out)["different"], 0);

  // Another force at one tick, in a file that is whole: found by rendering, not by a checksum.
  Result<Trace> trace = read_trace((folder_ / path).string());
  ASSERT_TRUE(trace.ok());
  const std::size_t middle = trace->records.size() / 2;
  trace->records[middle].commanded.x() = std::nextafter(trace->records[middle].commanded.x(), 1.0);
  ASSERT_TRUE(write_trace((folder_ / "changed.asptrace").string(), trace->metadata, trace->records).ok());
  const Call changed = run("replay changed.asptrace");
  EXPECT_EQ(changed.code, 1);
  EXPECT_TRUE(has(changed.err, ("tick " + std::to_string(middle) + ": commanded force").c_str())) << changed.err;

  // A flipped bit and a cut file.
  std::string bytes = read(path);
  const std::size_t late = bytes.size() * 3 / 4;
  bytes[late] = static_cast<char>(bytes[late] ^ 1);
  write("flipped.asptrace", bytes);
  const Call flipped = run("replay flipped.asptrace");
  EXPECT_EQ(flipped.code, 1);
  EXPECT_TRUE(has(flipped.err, "not whole")) << flipped.err;
  bytes[bytes.size() / 8] = static_cast<char>(bytes[bytes.size() / 8] ^ 1);
  write("early.asptrace", bytes);
  const Call early = run("replay early.asptrace");
  EXPECT_EQ(early.code, 2);
  EXPECT_TRUE(has(early.err, "holds no whole tick")) << early.err;
  write("cut.asptrace", read(path).substr(0, bytes.size() - 100));
  EXPECT_EQ(run("replay cut.asptrace").code, 1);
}

TEST_F(Program, ATraceFromBeforeTicksHadABudgetIsReplayedWithoutOne) {
  json scene = json::parse(read("quick.json"));
  scene["surfaces"][0]["coat"]["height_map"]["size"] = 1024;
  scene["stroke"]["speed"] = "5m/s";
  scene["stroke"]["end"] = json::array({"90%", "100%", "60%"});
  scene["budget"] = 0;
  write("free.json", scene.dump());
  ASSERT_EQ(run("touch free.json --no-report --out free").code, 0);
  Result<Trace> trace = read_trace((folder_ / "free/trace.asptrace").string());
  ASSERT_TRUE(trace.ok());
  json told = json::parse(trace->metadata.scene);
  EXPECT_EQ(told["budget"], 0);
  const auto replayed = [&](const char* name) {
    trace->metadata.scene = told.dump();
    EXPECT_TRUE(write_trace((folder_ / name).string(), trace->metadata, trace->records).ok());
    return run(std::string("replay ") + name);
  };
  told.erase("budget");
  EXPECT_EQ(replayed("before.asptrace").code, 0);
  // Which matters here.
  told["budget"] = 100;
  EXPECT_EQ(replayed("other.asptrace").code, 1);
}

TEST_F(Program, CompareSetsLawsSideBySide) {
  const Call call = run("compare quick.json --laws force-shading,mesostructure --json");
  ASSERT_EQ(call.code, 0) << call.err;
  const json document = json::parse(call.out);
  ASSERT_EQ(document["laws"].size(), 2u);
  EXPECT_EQ(document["laws"][0]["law"], "force-shading");
  EXPECT_NE(document["laws"][0]["force_hash"], document["laws"][1]["force_hash"]);
  EXPECT_TRUE(has(read("out/quick-compare/report.html"), "<html"));
  const Call table = run("compare quick.json --no-report --out t");
  ASSERT_EQ(table.code, 0) << table.err;
  for (const char* part : {"force-shading", "height-field", "mesostructure", "direction", "energy/loop"})
    EXPECT_TRUE(has(table.out, part)) << part;
}

/// Without a picture the page is whole, and says nothing of one.
TEST_F(Program, APageWithoutAPicture) {
  ASSERT_EQ(run("touch quick.json --out with").code, 0);
  EXPECT_TRUE(has(read("with/report.html"), "<div id=\"picture-store\" hidden><img id=\"picture-image\""));
  EXPECT_TRUE(fs::exists(folder_ / "with/picture.png"));

  const Call call = run("touch quick.json --no-picture --json --out without");
  ASSERT_EQ(call.code, 0) << call.err;
  const json files = json::parse(call.out)["files"];
  EXPECT_FALSE(files.contains("picture"));
  for (const char* file : {"trace", "numbers", "report"})
    EXPECT_TRUE(fs::exists(folder_ / files[file].get<std::string>())) << file;
  EXPECT_FALSE(fs::exists(folder_ / "without/picture.png"));
  const std::string page = read("without/report.html");
  EXPECT_FALSE(has(page, "<img"));
  EXPECT_TRUE(has(page, "<div id=\"picture-store\" hidden></div>"));
  // All the numbers that plots are made of are there.
  for (const char* plot : {"\"force_distance\":", "\"height_distance\":", "\"direction_distance\":", "\"force_time\":"})
    EXPECT_TRUE(has(page, plot)) << plot;

  const Call laws = run("compare quick.json --laws proxy,mesostructure --no-picture --json --out laws");
  ASSERT_EQ(laws.code, 0) << laws.err;
  EXPECT_TRUE(json::parse(laws.out)["files"].contains("report"));
  EXPECT_TRUE(has(read("laws/report.html"), "\"force_distance\":"));
  EXPECT_FALSE(has(read("laws/report.html"), "<img"));
  refused("touch quick.json --no-picture --no-report", {"--no-picture", "--no-report"});
  refused("compare quick.json --no-report --no-picture", {"--no-picture", "--no-report"});
}

/// Row M-3: who notices the isosurface is asked of the scene that is compared, its volume and its laws.
TEST_F(Program, CompareDetectsOnTheSceneItself) {
  const auto detection = [&](double gradient, double band) {
    const json scene{{"surfaces",
                      {{{"volume", {{"generator", "ramp"}, {"size", {9, 9, 9}}, {"gradient", gradient}}},
                        {"iso", {{"threshold", 0.0}, {"inside", "low"}}},
                        {"law", {{"type", "avila"}, {"band", band}}}}}},
                     {"stroke", {{"start", {-0.01, 0, 0}}, {"end", {0.01, 0, 0}}, {"depth", "0.1 mm"}}}};
    write("ramp.json", scene.dump());
    const Call call = run("compare ramp.json --laws cross-uncross,avila --no-report --json --one-way");
    EXPECT_EQ(call.code, 0) << call.err;
    return json::parse(call.out)["detection"];
  };
  for (const auto& [gradient, band] : {std::pair(1000.0, 0.2), std::pair(1000.0, 0.4), std::pair(250.0, 0.2)}) {
    const double layer = band / gradient;
    const json rows = detection(gradient, band);
    ASSERT_EQ(rows.size(), 8U);
    for (const json& row : rows) {
      const double law = std::min(1.0, layer * 1000.0 / row["speed"].get<double>());
      EXPECT_NEAR(row["layer"].get<double>(), layer, 1e-3 * layer);
      EXPECT_NEAR(row["expected"].get<double>(), law, 1e-3);
      // Four standard deviations of a share of 300 passages.
      EXPECT_NEAR(row["share"]["avila"].get<double>(), law, 4.0 * std::sqrt(law * (1.0 - law) / 300.0) + 1e-12) << row;
      EXPECT_EQ(row["share"]["cross-uncross"], 1.0) << row;
    }
  }
}

/// Vorticity of a kitchen's air: from a fifth of its range on its surfaces lie on the volume's border.
TEST_F(Program, TouchMeetsSurfacesOnTheBorderOfAVolume) {
  const fs::path kitchen = fs::path(ASPERITY_SHARED_DATA) / "volumes" / "kitchen.vtk";
  if (!fs::exists(kitchen)) GTEST_SKIP() << "shared data are not here";
  for (const char* threshold : {"20 %", "30 %", "40 %", "50 %"}) {
    SCOPED_TRACE(threshold);
    const json scene{{"surfaces",
                      {{{"volume", {{"file", kitchen.string()}, {"derive", "vorticity_magnitude"}}},
                        {"iso", {{"threshold", threshold}, {"inside", "high"}}}}}}};
    write("kitchen.json", scene.dump());
    const Call call = run("touch kitchen.json --no-report --json --out kitchen");
    ASSERT_EQ(call.code, 0) << call.err;
    const json document = json::parse(call.out);
    EXPECT_TRUE(document["warnings"].empty()) << document["warnings"];
    const double contact = document["metrics"]["ticks"]["contact"].get<double>();
    EXPECT_GT(contact, 0.25 * document["ticks"].get<double>());
  }
}

TEST_F(Program, InspectKnowsEveryKindOfFile) {
  ASSERT_EQ(run("touch quick.json --no-report").code, 0);
  const auto kind = [&](const std::string& file) {
    const Call call = run("inspect " + file + " --json");
    EXPECT_EQ(call.code, 0) << file << call.err;
    return call.code == 0 ? json::parse(call.out)["kind"].get<std::string>() : std::string();
  };
  EXPECT_EQ(kind("ball.obj"), "mesh");
  EXPECT_EQ(kind("map.png"), "map");
  EXPECT_EQ(kind("quick.json"), "scene");
  EXPECT_EQ(kind("M_a-H_3"), "scene");
  EXPECT_EQ(kind("out/quick/trace.asptrace"), "trace");
  write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nv 6 5 5\nv 7 5 5\nf 1 2 3\nf 4 5 6\n");
  const Call open = run("inspect open.obj");
  EXPECT_TRUE(has(open.out, "1 triangles without area")) << open.out;
  EXPECT_TRUE(has(open.out, "the mesh is open")) << open.out;
  // 10 um at 0.4 N/mm are 4 mN: not noticed on a Touch, and said so; 1 mm is.
  EXPECT_TRUE(has(run("inspect map.png --height 10um --device touch").out, "less than the 0.03 N that are noticed"));
  EXPECT_TRUE(has(run("inspect map.png --height 1mm --device touch").out, "are just noticed"));
  EXPECT_TRUE(has(run("inspect quick.json --stiffness 5000").out, "it may buzz"));
}

TEST_F(Program, InspectProposesFrictionFromATopography) {
  // Grooves upright in the picture: each texel of 1 mm is 64 um above or below its neighbour, a slope of 0.064.
  Image grooves{32, 32, 1, 8, {}};
  for (int i = 0; i < 32 * 32; ++i)
    grooves.samples.push_back(static_cast<std::uint16_t>(64 * (2 - std::abs(i % 4 - 2))));
  ASSERT_TRUE(write_png(folder_ / "grooves.png", grooves).ok());
  const Call call = run("inspect grooves.png --height 255um --tile 32mm --json");
  ASSERT_EQ(call.code, 0) << call.err;
  const json facts = json::parse(call.out)["facts"];
  EXPECT_EQ(facts["friction proposed"], "0.264 along the width, 0.2 along the height");
  EXPECT_TRUE(has(facts["roughness along the width"].get<std::string>(), "mean slope 0.064"));
  const Call smooth = run("inspect grooves.png --height 255um --tile 32mm --friction 0.5");
  EXPECT_TRUE(has(smooth.out, "0.564 along the width, 0.5 along the height")) << smooth.out;
  EXPECT_TRUE(has(smooth.out, "to 0.5 of the smooth material (--friction) comes the mean slope")) << smooth.out;
  refused("inspect grooves.png --friction 9", {"--friction"});
}

TEST_F(Program, InspectTellsFeaturesOfAScene) {
  const Call call = run("inspect vase --friction 0.3 --json");
  ASSERT_EQ(call.code, 0) << call.err;
  const json feature = json::parse(call.out)["features"][0];
  // c cos(2 pi u / L), c = 0.25 mm, L = 4.5 mm: R_a = 2 c / pi, R_q = c / sqrt 2, mean slope 4 c / L.
  EXPECT_EQ(feature["felt_as"], "texture");
  EXPECT_NEAR(feature["across"]["r_a_m"].get<double>(), 1.5915e-4, 1e-8);
  EXPECT_NEAR(feature["across"]["r_q_m"].get<double>(), 1.7678e-4, 1e-8);
  EXPECT_NEAR(feature["across"]["mean_slope"].get<double>(), 0.2222, 1e-4);
  EXPECT_NEAR(feature["along"]["r_a_m"].get<double>(), 0.0, 1e-15);
  EXPECT_NEAR(feature["friction_proposed"]["across"].get<double>(), 0.5222, 1e-4);
  EXPECT_NEAR(feature["friction_proposed"]["along"].get<double>(), 0.3, 1e-9);
  const json waves = feature["under_the_stroke"];
  EXPECT_NEAR(waves["shortest_wave_m"].get<double>(), 1.5e-3, 1e-5);
  EXPECT_NEAR(waves["longest_wave_m"].get<double>(), 4.5e-3, 1e-5);
  EXPECT_LT(waves["felt_roughness_of_shortest"], waves["felt_roughness_of_longest"]);
  EXPECT_LT(waves["felt_roughness_of_longest"], waves["felt_roughness_of_roughest"]);
  EXPECT_TRUE(has(run("inspect vase").out, "finest waves feel smoothest, although the force")) << call.out;
}

TEST_F(Program, InspectTellsATopographyThatNoSheetHolds) {
  // Columns 30 m apart in height by turns, 100 m wide: a slope of 0.3 along the width.
  Image columns{32, 16, 1, 16, {}};
  for (int i = 0; i < 32 * 16; ++i) columns.samples.push_back(static_cast<std::uint16_t>(65535 * (i % 2)));
  ASSERT_TRUE(write_png(folder_ / "peak.png", columns).ok());
  write("peak.json", R"({"width":32,"height":16,"pixel_size_m":[100,100],"height_min_m":1000,"height_max_m":1030})");
  const Call call = run("inspect peak.png --json");
  ASSERT_EQ(call.code, 0) << call.err;
  const json document = json::parse(call.out);
  EXPECT_EQ(document["kind"], "map");
  EXPECT_TRUE(has(document["facts"]["size as it is"].get<std::string>(), "3.2e+03 m x 1.6e+03 m"));
  EXPECT_EQ(document["facts"]["friction proposed"], "0.5 along the width, 0.2 along the height");
  EXPECT_TRUE(has(document["to_know"].dump(), "too large for the trial sheet")) << call.out;
  EXPECT_TRUE(has(document["to_know"].dump(), "magnify")) << call.out;
  refused("inspect map.png --height 1000m", {"half the diagonal"});
}

TEST_F(Program, ScenesAndSchemaPrint) {
  const Call list = run("scenes");
  EXPECT_EQ(list.code, 0);
  for (const BuiltinScene& scene : builtin_scenes()) EXPECT_TRUE(has(list.out, scene.name.c_str())) << scene.name;
  EXPECT_EQ(json::parse(run("scenes --json").out).size(), builtin_scenes().size());
  write("printed.json", run("scenes icosphere").out);
  EXPECT_EQ(run("inspect printed.json").code, 0);
  EXPECT_EQ(run("schema").out, scene_schema_json());
  EXPECT_EQ(run("schema --page").out, scene_page());
  EXPECT_TRUE(has(run("schema stroke.speed").out, "m/s"));
  EXPECT_TRUE(has(run("schema surfaces.coat.height").out, "share of the mean edge"));
  EXPECT_TRUE(has(run("schema coat").out, "keys: from, height_map"));
  refused("schema stroke.spede", {"did you mean \"stroke.speed\"?"});
  refused("scenes icospher", {"did you mean \"icosphere\""});
}

TEST_F(Program, BenchMeasuresTicks) {
  const Call call = run("bench quick.json --ticks 2000 --cold-ticks 5 --json");
  ASSERT_EQ(call.code, 0) << call.err;
  const json document = json::parse(call.out);
  for (const char* kind : {"warm", "cold"}) {
    const json& row = document[kind];
    EXPECT_GE(row["p99_s"].get<double>(), row["p50_s"].get<double>());
    EXPECT_GE(row["p999_s"].get<double>(), row["p99_s"].get<double>());
    EXPECT_GE(row["max_s"].get<double>(), row["p999_s"].get<double>());
    EXPECT_GT(row["p50_s"].get<double>(), 0.0);
  }
  EXPECT_EQ(document["warm"]["ticks"], 2000);
  EXPECT_TRUE(has(run("bench quick.json --ticks 100 --cold-ticks 2").out, "p99.9"));
}

TEST_F(Program, DoctorExaminesTheMachine) {
  const Call call = run("doctor quick.json --seconds 0.3 --rate 2kHz --priority 0 --json");
  ASSERT_LE(call.code, 1) << call.err;
  const json document = json::parse(call.out);
  EXPECT_EQ(document["rate_hz"], 2000.0);
  ASSERT_EQ(document["parts"].size(), 2u);
  for (const json& part : document["parts"]) {
    EXPECT_GE(part["ticks"], 600);
    EXPECT_LE(part["ticks"], 650) << "and those that ramp the force down";
    EXPECT_GE(part["lateness"]["max_s"].get<double>(), part["lateness"]["p50_s"].get<double>());
  }
  EXPECT_GT(document["parts"][1]["step"]["p50_s"].get<double>(), document["parts"][0]["step"]["p50_s"].get<double>())
      << "the second part touches a scene";
  EXPECT_EQ(call.code, document["verdict"] == "unfit" ? 1 : 0);
  for (const json& asked : document["asked"]) EXPECT_EQ(asked["got"].get<bool>(), asked["advice"] == "");
  refused("doctor quick.json --rate 100Hz", {"rate", "500 Hz to 40 kHz"});
  refused("doctor quick.json --cpu 4000", {"cpu", "or -1 for any"});
  refused("doctor quick.json --priority 100", {"priority"});
  refused("doctor quick.json --seconds 0", {"seconds"});
  refused("doctor quick.json --seconds nan", {"seconds", "nan is not a number"});
}

TEST_F(Program, ProgressIsShownOnRequest) {
  EXPECT_TRUE(has(run("touch quick.json --no-report --progress").err, "touching ..."));
  EXPECT_FALSE(has(run("touch quick.json --no-report").err, "touching"));
}

TEST_F(Program, BadUsage) {
  refused("", {"subcommand"});
  refused("tuoch", {"--help"});
  refused("touch --colour red", {"--colour"});
  refused("touch quick.json --depth 1mm --force 1N", {"--force"});
  refused("bench quick.json --ticks 0", {"--ticks"});
  refused("replay", {"TRACE"});
}

TEST_F(Program, BadInput) {
  write("empty.json", "");
  write("broken.json", "{\n \"surfaces\": [}\n");
  write("unknown.json", R"({"surfaces":[{"mesh":"ball.obj","coatt":{}}]})");
  write("type.json", R"({"surfaces":[{"mesh":"ball.obj","coat":{"height_map":"map.png","height":true}}]})");
  write("empty.obj", "");
  write("nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n");
  write("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n");
  write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
  write("nothing.png", "");
  refused("touch absent.obj", {"absent.obj", "no such file"});
  refused("touch map.png", {"map.png", "is a picture", "--relief"});
  refused("touch icospher", {"did you mean \"icosphere\""});
  refused("touch empty.json", {"empty.json", "is empty"});
  refused("touch broken.json", {"broken.json", "line 2, column 15"});
  refused("touch unknown.json", {"unknown.json", "surfaces[0].coatt", "did you mean \"coat\"?"});
  refused("touch type.json", {"type.json", "surfaces[0].coat.height", "is a boolean", "accepted"});
  refused("touch empty.obj", {"empty.obj"});
  refused("touch nan.obj", {"nan.obj"});
  refused("touch index.obj", {"index.obj"});
  refused("touch flat.obj", {"flat.obj"});
  refused("touch ball.obj --relief nothing.png", {"nothing.png"});
  refused("touch ball.obj --relief map.png --height 1m", {"coat.height", "half the diagonal"});
  refused("touch ball.obj --relief map.png --height 2furlongs", {"coat.height", "furlongs", "mm"});
  refused("touch ball.obj --law mesostructure", {"surfaces[0].law", "needs a coat"});
  refused("touch ball.obj --law mesostructur", {"did you mean \"mesostructure\""});
  refused("touch ball.obj --device omega.8", {"device", "did you mean"});
  refused("touch ball.obj --rate 900kHz", {"ticks"});
  refused("compare ball.obj --laws god-object,height-field", {"surfaces[0].law", "needs a coat"});
  refused("compare quick.json --laws god-objekt", {"--laws", "did you mean \"god-object\""});
  refused("replay quick.json", {"quick.json"});
  refused("replay absent.asptrace", {"absent.asptrace"});
  refused("inspect absent.png", {"absent.png"});
}

TEST_F(Program, UnwritableOutputIsFoundBeforeTheRun) {
  write("taken", "a file, no folder");
  const Call call = run("touch quick.json --out taken/below");
  EXPECT_EQ(call.code, 2);
  EXPECT_TRUE(has(call.err, "taken/below")) << call.err;
  EXPECT_EQ(read("taken"), "a file, no folder");
  EXPECT_EQ(run("touch quick.json --out taken").code, 2);
  EXPECT_EQ(run("compare quick.json --out taken").code, 2);
}

TEST_F(Program, AFailedRunKeepsTheOldOutput) {
  ASSERT_EQ(run("touch quick.json --no-report --out kept").code, 0);
  const std::string before = read("kept/trace.asptrace");
  EXPECT_EQ(run("touch quick.json --no-report --out kept --rate 900kHz --speed 0.1mm/s").code, 2);
  EXPECT_EQ(read("kept/trace.asptrace"), before);
  EXPECT_FALSE(fs::exists(folder_ / "kept/trace.asptrace.part"));
}

}  // namespace
}  // namespace asperity::program_test
