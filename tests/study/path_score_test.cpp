// Row T11: laws scored on a measured trajectory. References by formula; errors that are known come out as they are.

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "asperity/study/path_report.h"
#include "asperity/study/path_score.h"
#include "tests/render/fixtures.h"

namespace asperity::path_score_test {
namespace {

namespace fs = std::filesystem;
constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180.0;

/// A square sheet in y = 0 from (-1, -1) to (1, 1) times `half`, with texture coordinates from 0 to 1.
MeshSource sheet_source(double half) {
  MeshSource source;
  source.positions = {{-half, 0.0, -half}, {half, 0.0, -half}, {half, 0.0, half}, {-half, 0.0, half}};
  source.triangles = {{0, 2, 1}, {0, 3, 2}};
  const Vec2f uv[4] = {{0.0F, 0.0F}, {1.0F, 0.0F}, {1.0F, 1.0F}, {0.0F, 1.0F}};
  source.corner_uvs = {{uv[0], uv[2], uv[1]}, {uv[0], uv[3], uv[2]}};
  return source;
}

std::shared_ptr<const MeshSurface> sheet(double half) {
  return test::bare(sheet_source(half));
}

/// y = c cos(2 pi x / lambda) on that sheet.
struct Waves {
  double half = 0.02;
  double c = 0.3e-3;
  int count = 8;
  [[nodiscard]] double frequency() const { return 2.0 * pi * count / (2.0 * half); }
  [[nodiscard]] Vec3 point(double x) const { return {x, c * std::cos(frequency() * (x + half)), 1.3e-3}; }
  [[nodiscard]] Vec3 normal(double x) const {
    return Vec3(c * frequency() * std::sin(frequency() * (x + half)), 1.0, 0.0).normalized();
  }
  [[nodiscard]] Surface surface() const {
    const int size = 1024;
    std::vector<float> heights;
    for (int i = 0; i < size * size; ++i)
      heights.push_back(static_cast<float>(c * std::cos(2.0 * pi * count * (i % size + 0.5) / size)));
    HeightMap map =
        test::must(HeightMap::build(std::move(heights), size, size, Wrap::repeat, Reconstruction::quadratic_bspline));
    return test::coated(sheet_source(half), std::move(map), Mapping::uv, 2.0 * half);
  }
  /// A stiff probe's tip on the waves, pressed along the normal with `force` N, from 60 ticks of free flight on.
  [[nodiscard]] MeasuredPath stroke(double force, PathPlace place = PathPlace::surface) const {
    MeasuredPath path;
    path.place = place;
    for (int i = 0; i <= 1060; ++i) {
      const double x = -0.5 * half + 1e-5 * std::max(0, i - 60);
      const double pressed = i < 60 ? 0.0 : force;
      const double above = i < 60 ? 2e-5 * (60 - i) : 0.0;
      path.samples.push_back({Seconds(1e-3 * i), point(x) + above * normal(x), pressed * normal(x)});
    }
    return path;
  }
};

TEST(PathScore, T11_ReferencePathOnAPlaneScoresNothing) {
  MeasuredPath path;
  for (int i = 0; i <= 500; ++i) {
    const double force = std::max(0.0, 1.0 + 0.8 * std::sin(0.05 * i));
    path.samples.push_back({Seconds(1e-3 * i), Vec3(1e-5 * i, 0.0, 0.0), Vec3(0.0, force, 0.0)});
  }
  for (const char* law : {"proxy", "god-object"}) {
    const PathScore score = test::must(score_path(test::scene_of(sheet(0.02), test::named(law)), path, {}));
    EXPECT_EQ(score.law, law);
    EXPECT_EQ(score.stiffness, test::stiffness);
    EXPECT_LT(score.force.rms_error, 1e-5) << law;
    EXPECT_LT(score.force.largest_angle, 1e-7) << law;
    EXPECT_LT(score.normal.max, 1e-7) << law;
    EXPECT_EQ(score.force.missed, 0.0) << law;
    EXPECT_NEAR(score.largest_penetration, 1.8e-3, 1e-6) << law;
  }
}

TEST(PathScore, T11_WavesByFormula) {
  const Waves waves;
  const MeasuredPath path = waves.stroke(0.3);
  // Crests are 2.1 mm round, the contact is 0.3 mm deep: the exact law is known everywhere.
  const Surface surface = waves.surface();
  const PathScore proxy = test::must(score_path(test::scene_of(surface, ProxyLaw{}), path, {}));
  EXPECT_LT(proxy.force.relative, 2e-3);
  EXPECT_LT(proxy.force.largest_angle, 0.2 * degree);
  EXPECT_LT(proxy.normal.p99, 0.2 * degree);
  EXPECT_LT(proxy.force.missed, 0.01);
  // The base alone knows no waves: its force is off by more than they are steep.
  const PathScore base = test::must(score_path(test::scene_of(surface, GodObjectLaw{}), path, {}));
  EXPECT_GT(base.force.relative, 0.3);
  EXPECT_GT(base.force.largest_angle, 10.0 * degree);
  EXPECT_GT(base.normal.max, 10.0 * degree);
}

TEST(PathScore, T11_OwnPathOfTheReferenceLawScoresZero) {
  const Waves waves;
  const Scene scene = test::scene_of(waves.surface(), ProxyLaw{});
  std::vector<TraceRecord> records;
  ProxyState state;
  ProxyCache cache;
  for (int i = 0; i < 800; ++i) {
    TraceRecord record;
    record.dt = test::tick;
    record.probe.time = i * test::tick;
    record.probe.pose.position = waves.point(-5e-3 + 1e-5 * i) + Vec3(0.0, 0.4e-3 - std::min(1e-3, 5e-6 * i), 0.0);
    record.rendered = step(scene, state, cache, record.probe, record.dt);
    records.push_back(record);
  }
  for (const PathPlace place : {PathPlace::probe, PathPlace::surface}) {
    const MeasuredPath path = test::must(measured_path_from(records, place, test::stiffness));
    // Through the file, so that every bit counts.
    MeasuredPath read = test::must(parse_measured_path(measured_path_csv(path)));
    read.place = place;
    const PathScore score = test::must(score_path(scene, read, {}));
    EXPECT_GT(score.force.peak_measured, 0.3);
    EXPECT_LT(score.force.rms_error, 1e-9);
    EXPECT_LT(score.force.largest_angle, 1e-6);
  }
}

Vec3 turned(const Vec3& force, double angle) {
  const Vec3 axis = force.cross(Vec3(0.3, 0.2, 0.9)).normalized();
  return std::cos(angle) * force + std::sin(angle) * axis.cross(force);
}

/// Against a law that is 3 degrees and 10 % off.
TEST(PathScore, T11_KnownErrorsComeOutAsTheyAre) {
  std::vector<Vec3> measured;
  std::vector<Vec3> tilted;
  std::vector<Vec3> larger;
  double squares = 0.0;
  for (int i = 0; i < 100; ++i) {
    measured.emplace_back(Vec3(std::sin(0.1 * i), 1.5, std::cos(0.2 * i)));
    tilted.push_back(turned(measured.back(), 3.0 * degree));
    larger.push_back(1.1 * measured.back());
    squares += measured.back().squaredNorm() / 100.0;
  }
  const ForceErrors tilt = compare_forces(measured, tilted);
  EXPECT_NEAR(tilt.mean_angle, 3.0 * degree, 1e-12);
  EXPECT_NEAR(tilt.largest_angle, 3.0 * degree, 1e-12);
  EXPECT_NEAR(tilt.relative, 2.0 * std::sin(1.5 * degree), 1e-12) << "a chord of the circle";
  EXPECT_NEAR(tilt.peak_rendered, tilt.peak_measured, 1e-12);
  const ForceErrors scale = compare_forces(measured, larger);
  EXPECT_NEAR(scale.rms_measured, std::sqrt(squares), 1e-12);
  EXPECT_NEAR(scale.rms_error, 0.1 * std::sqrt(squares), 1e-12);
  EXPECT_NEAR(scale.relative, 0.1, 1e-12);
  EXPECT_NEAR(scale.peak_rendered, 1.1 * scale.peak_measured, 1e-12);
  EXPECT_NEAR(scale.largest_angle, 0.0, 1e-7);
}

RC_GTEST_PROP(PathScore, T11_TiltAndScaleTogether, ()) {
  const double scale = 0.5 + 0.001 * *rc::gen::inRange(0, 1001);
  const double tilt = 0.001 * *rc::gen::inRange(0, 1500);
  const Vec3 force(0.01 * *rc::gen::inRange(-300, 301), 0.7, 0.01 * *rc::gen::inRange(-300, 301));
  const std::vector<Vec3> measured{force};
  const std::vector<Vec3> rendered{scale * turned(force, tilt)};
  const ForceErrors e = compare_forces(measured, rendered);
  // Cosine rule.
  RC_ASSERT(std::abs(e.relative - std::sqrt(1.0 + scale * scale - 2.0 * scale * std::cos(tilt))) < 1e-9);
  RC_ASSERT(std::abs(e.mean_angle - tilt) < 1e-9);
}

/// Where a device's own probe path is played, forces that are off stay off: the law answers by place alone.
TEST(PathScore, T11_ForcesThatAreOffOnAProbesPath) {
  MeasuredPath path;
  path.place = PathPlace::probe;
  for (int i = 0; i <= 300; ++i) {
    const double depth = i < 50 ? -1e-4 : 1e-3;
    const Vec3 force(0.0, std::max(0.0, depth) * test::stiffness * 1.25, 0.0);
    path.samples.push_back({Seconds(1e-3 * i), Vec3(1e-5 * i, -depth, 0.0), force});
  }
  const PathScore score = test::must(score_path(test::scene_of(sheet(0.02), ProxyLaw{}), path, {}));
  EXPECT_NEAR(score.force.relative, 0.2, 1e-5) << "1 N where 1.25 N were measured";
  EXPECT_EQ(score.force.compared, 251U);
  EXPECT_EQ(score.force.missed, 0.0);
  EXPECT_EQ(score.force.added, 0.0);
  EXPECT_NEAR(score.mean_penetration, 1e-3, 1e-6);
}

TEST(PathScore, MissedAndAddedContacts) {
  const Vec3 push(0.0, 1.0, 0.0);
  const Vec3 none = Vec3::Zero();
  const ForceErrors e =
      compare_forces(std::vector<Vec3>{push, push, none, none, none}, std::vector<Vec3>{push, none, none, push, none});
  EXPECT_EQ(e.missed, 0.5);
  EXPECT_NEAR(e.added, 1.0 / 3.0, 1e-15);
  EXPECT_EQ(e.compared, 3U);
  EXPECT_EQ(e.largest_at, 1U);
  EXPECT_TRUE(std::isnan(compare_forces(std::vector<Vec3>{none}, std::vector<Vec3>{none}).relative));
}

TEST(PathScore, SparseSamplesAreDrivenAtTheRate) {
  // 20 samples a second and 5 mm between them: over a relief that a leap would miss.
  const Waves waves;
  MeasuredPath path;
  for (int i = 0; i <= 4; ++i) {
    const double x = -0.01 + 5e-3 * i;
    path.samples.push_back({Seconds(0.05 * i), waves.point(x), 0.2 * waves.normal(x)});
  }
  const PathScore score = test::must(score_path(test::scene_of(waves.surface(), ProxyLaw{}), path, {}));
  EXPECT_EQ(score.rendered.size(), 5U);
  EXPECT_LT(score.force.relative, 0.02);
}

TEST(PathScore, ReadsColumnsWithUnitsInAnyOrder) {
  const char* text =
      "# a comment\n\nTime_ms,ignored,FX,fy [mN],fz_N,x_mm,position_y,z (um)\n"
      "10,a,1,2000,3,4,0.005,6000\n20,b,0,0,0,4,0.005,6000\n";
  const MeasuredPath path = test::must(parse_measured_path(text));
  ASSERT_EQ(path.samples.size(), 2U);
  EXPECT_EQ(path.place, PathPlace::surface);
  EXPECT_EQ(path.samples[0].time.count(), 0.0);
  EXPECT_NEAR(path.samples[1].time.count(), 0.01, 1e-15);
  EXPECT_NEAR((path.samples[0].position - Vec3(4e-3, 5e-3, 6e-3)).norm(), 0.0, 1e-15);
  EXPECT_NEAR((path.samples[0].force - Vec3(1.0, 2.0, 3.0)).norm(), 0.0, 1e-15);
}

TEST(PathScore, BadTextIsNamed) {
  const auto message = [](const std::string& text) {
    const auto path = parse_measured_path(text);
    return path ? std::string("accepted") : path.error().message();
  };
  const std::string head = "time,x,y,z,fx,fy,fz\n";
  const auto says = [&](const std::string& text, const char* part) {
    EXPECT_NE(message(text).find(part), std::string::npos) << message(text);
  };
  says("", "no header");
  says("# nothing\n", "no header");
  says("time,x,y,z,fx,fy\n1,1,1,1,1,1\n", "no column \"fz\"");
  says("time,x_furlong,y,z,fx,fy,fz\n", "unit \"furlong\"");
  says("time,xx,y,z,fx,fy,fz\n", "no column \"x\"");
  says("time,x [furlong],y,z,fx,fy,fz\n", "unit \"furlong\"");
  says(head, "0 rows");
  says(head + "0,0,0,0,0,0,0\n", "1 rows");
  says(head + "0,0,0,0,0,0\n", "line 2");
  says(head + "0,0,0,0,0,0,nan\n", "not a finite number");
  says(head + "0,0,0,0,0,0,0\n0,0,0,0,0,0,0\n", "line 3");
  says(head + "0,0,0,1e400,0,0,0\n", "column \"z\"");
  EXPECT_FALSE(read_measured_path(fs::temp_directory_path()).ok());
  EXPECT_FALSE(read_measured_path(fs::temp_directory_path() / "no such file").ok());
}

TEST(PathScore, BadSettingsAreNamed) {
  const Scene scene = test::scene_of(sheet(0.02), ProxyLaw{});
  MeasuredPath path;
  EXPECT_FALSE(score_path(scene, path, {}).ok());
  path.samples = {{Seconds(0.0), Vec3::Zero(), Vec3::Zero()}, {Seconds(1.0), Vec3::UnitX(), Vec3::Zero()}};
  ScoreSettings settings;
  settings.rate = 0.0;
  EXPECT_EQ(score_path(scene, path, settings).error().place, "rate");
  settings.rate = 1e9;
  EXPECT_EQ(score_path(scene, path, settings).error().code, ErrorCode::too_large);
  settings = {};
  settings.stiffness = -1.0;
  EXPECT_EQ(score_path(scene, path, settings).error().place, "stiffness");
  std::vector<Instance> two{scene.instances()[0], scene.instances()[0]};
  two[1].name = "other";
  two[1].material.stiffness *= 2.0;
  const Scene unlike = test::must(Scene::build(two, 0.0));
  EXPECT_EQ(score_path(unlike, path, {}).error().code, ErrorCode::mismatch);
  settings = {};
  settings.stiffness = 500.0;
  EXPECT_TRUE(score_path(unlike, path, settings).ok());
}

TEST(PathScore, ColumnsForOtherPrograms) {
  const MeasuredPath path = Waves().stroke(0.2);
  PathScore score;
  score.law = "one";
  std::vector<Vec3> measured;
  for (const MeasuredSample& sample : path.samples) measured.push_back(sample.force);
  score.rendered = measured;
  score.force = compare_forces(measured, measured);
  const std::string text = scores_csv(path, std::vector<PathScore>{score});
  EXPECT_EQ(text.substr(0, text.find('\n')),
            "time_s,distance_m,measured_fx,measured_fy,measured_fz,\"one fx\",\"one fy\",\"one fz\",\"one error\"");
  EXPECT_EQ(static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')), path.samples.size() + 1);
  EXPECT_GT(distance_along(path).back(), 0.0099);
}

TEST(PathScore, PageHoldsItsNumbersAndNoMarkupOfNames) {
  PathReport report;
  report.origin.title = "a <b> title";
  report.path = Waves().stroke(0.2);
  std::vector<Vec3> measured;
  for (const MeasuredSample& sample : report.path.samples) measured.push_back(sample.force);
  PathScore score;
  score.law = "</script>";
  score.rendered = measured;
  score.force = compare_forces(measured, measured);
  report.scores.push_back(score);
  const std::string page = test::must(path_report_html(report));
  EXPECT_NE(page.find("Angle to the measured force"), std::string::npos);
  EXPECT_EQ(page.find("\"</script>"), std::string::npos);
  EXPECT_NE(verdict(score).find("0 N"), std::string::npos);
  report.scores[0].rendered.pop_back();
  EXPECT_EQ(path_report_html(report).error().code, ErrorCode::bad_value);
}

}  // namespace
}  // namespace asperity::path_score_test
