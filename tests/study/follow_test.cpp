#include "asperity/study/follow.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "asperity/device/ideal_probe.h"
#include "asperity/render/step.h"
#include "asperity/study/detail/ray_cast.h"
#include "asperity/study/metrics.h"
#include "asperity/study/picture.h"
#include "asperity/study/report.h"
#include "tests/render/volumes.h"
#include "tests/study/synthetic.h"

namespace asperity::follow_test {
namespace {

using volumes::cube;
using volumes::sampled;
using volumes::surface_of;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// --- the formula ---

TEST(FollowMetrics, GlobalErrorWeighsByTheWayAndInstantaneousOnesDoNot) {
  // Ways 1, 2, 1 mm with errors 0.1, 0.4, 0.2: e = (0.1 + 0.8 + 0.2) / 4.
  const std::vector<double> errors{0.9, 0.1, 0.4, 0.2};
  const std::vector<Vec3> path{Vec3(0, 0, 0), Vec3(1e-3, 0, 0), Vec3(1e-3, 2e-3, 0), Vec3(1e-3, 2e-3, -1e-3)};
  const FollowMetrics m = measure_follow(errors, path);
  EXPECT_EQ(m.samples, 4u);
  EXPECT_NEAR(m.global, 1.1 / 4.0, 1e-12);
  EXPECT_NEAR(m.mean, 1.6 / 4.0, 1e-12);
  EXPECT_DOUBLE_EQ(m.min, 0.1);
  EXPECT_DOUBLE_EQ(m.max, 0.9);
}

TEST(FollowMetrics, GlobalErrorDoesNotDependOnTheRateOrOnPauses) {
  // Sampled twice as often, with a long rest in between: eq. 20 as printed would change by its dt.
  const auto along = [](int samples, int rest) {
    std::vector<double> errors;
    std::vector<Vec3> path;
    for (int i = 0; i <= samples; ++i) {
      const double s = static_cast<double>(i) / samples;
      for (int k = 0; k < (i == samples / 2 ? 1 + rest : 1); ++k) {
        errors.push_back(0.25 * s);
        path.emplace_back(0.01 * s, 0.0, 0.0);
      }
    }
    return measure_follow(errors, path);
  };
  EXPECT_NEAR(along(2000, 0).global, 0.125, 1e-4);
  EXPECT_NEAR(along(4000, 0).global, 0.125, 1e-4);
  EXPECT_NEAR(along(4000, 5000).global, 0.125, 1e-4);
  EXPECT_NEAR(along(4000, 5000).max, 0.25, 1e-12);
}

TEST(FollowMetrics, LeavesOutWhatIsNoNumberAndSaysSo) {
  const std::vector<double> errors{0.5, nan, 0.5};
  const std::vector<Vec3> path{Vec3(0, 0, 0), Vec3(5, 0, 0), Vec3(6, 0, 0)};
  const FollowMetrics m = measure_follow(errors, path);
  EXPECT_EQ(m.samples, 2u);
  EXPECT_EQ(m.excluded, 1u);
  EXPECT_DOUBLE_EQ(m.global, 0.5);
  const FollowMetrics none = measure_follow({}, {});
  EXPECT_EQ(none.samples, 0u);
  EXPECT_TRUE(std::isnan(none.global));
}

TEST(FollowError, IsTheShareOfTheLargestDeviationInTheVolume) {
  // Values 0 to 10 along x, threshold 4: the largest deviation is 6.
  const auto field = sampled(cube(0.05, 11), [](const Vec3& p) { return 5.0 + 100.0 * p.x(); });
  const auto surface = surface_of(field, 4.0);
  CellCache cells;
  const IsoView view = surface->view(cells);
  EXPECT_NEAR(largest_deviation(view), 6.0, 1e-5);
  EXPECT_NEAR(follow_error(view, Vec3(-0.01, 0.02, 0.01)), 0.0, 1e-6);
  EXPECT_NEAR(follow_error(view, Vec3(0.02, 0.0, 0.0)), 0.5, 1e-6);
  EXPECT_NEAR(follow_error(view, Vec3(0.05, 0.0, 0.0)), 1.0, 1e-6);
  EXPECT_NEAR(follow_error(view, Vec3(-0.04, 0.0, 0.0)), 0.5, 1e-6);
  EXPECT_TRUE(std::isnan(follow_error(view, Vec3(0.06, 0.0, 0.0))));
}

// --- detection ---

TEST(DetectionTable, RefusesBadSettingsByName) {
  const auto place_of = [](const DetectionSettings& settings) {
    const auto rows = detection_table({}, {}, settings);
    return rows.ok() ? std::string("accepted") : rows.error().place;
  };
  EXPECT_EQ(place_of({}), "accepted");
  EXPECT_EQ(place_of({{0.1, nan}, 1000.0, 10, 1}), "speeds[1]");
  EXPECT_EQ(place_of({{0.1}, 0.0, 10, 1}), "rate");
  EXPECT_EQ(place_of({{0.1}, 1000.0, 0, 1}), "passages");
}

TEST(DetectionTable, IsEmptyWithoutAnIsosurface) {
  const Scene bare[] = {synthetic::bare_scene()};
  EXPECT_TRUE(detection_table(bare, synthetic::line_path()).value().empty());
}

// --- runs on a volume ---

constexpr double stiffness = 3000.0;  // N/m
constexpr double force = 0.3;         // N: 0.1 mm deep
constexpr double rate = 1000.0;       // Hz

/// Steep in a strip across x, gentle beside it, in a box of 80 x 80 x 40 mm:
///   phi = s(x) y,  s = 100 (1 + 39 exp(-(x / 6 mm)^2)) per metre.
double steepness(double x) {
  return 100.0 * (1.0 + 39.0 * std::exp(-std::pow(x / 6e-3, 2)));
}

std::shared_ptr<const IsoSurface> strip() {
  const GridAxes axes{GridAxis::uniform(-0.04, 1e-3, 81).value(), GridAxis::uniform(-0.04, 2e-3, 41).value(),
                      GridAxis::uniform(-0.02, 0.25e-3, 161).value()};
  const auto field = sampled(axes, [](const Vec3& p) { return steepness(p.x()) * p.y(); });
  return surface_of(field, 0.0);
}

Scene scene_with(std::shared_ptr<const IsoSurface> surface, const Law& law) {
  std::vector<Instance> instances(1);
  instances[0].name = "strip";
  instances[0].surface = std::move(surface);
  instances[0].law = law;
  instances[0].material.stiffness = stiffness;
  return Scene::build(std::move(instances), 0.0).value();
}

/// Over the plane y = 0, pressed with the force, 40 mm/s.
StrokePath stroke(const Vec3& from, const Vec3& to) {
  StrokeSettings settings;
  settings.start = from;
  settings.end = to;
  settings.speed = 0.04;
  settings.press = PressMode::force;
  settings.normal_force = force;
  settings.approach_height = 1e-3;
  return build_stroke(settings,
                      [](const Vec3& p) {
                        return SurfacePoint{Vec3(p.x(), 0.0, p.z()), Vec3::UnitY()};
                      })
      .value();
}

/// An ideal probe that keeps pressing: its regulator follows within 100 Hz, and its arm ends 10 mm below the plane.
std::vector<TraceRecord> run(const Scene& scene, const StrokePath& path) {
  IdealProbeSettings settings;
  settings.stiffness_estimate = stiffness;
  settings.bandwidth = 100.0;
  IdealProbe probe = IdealProbe::build(path, settings).value();
  ProxyState state;
  ProxyCache cache;
  std::vector<TraceRecord> records;
  while (!probe.finished()) {
    TraceRecord record;
    record.tick = records.size();
    record.dt = Seconds(1.0 / rate);
    record.probe = probe.read();
    record.rendered = step(scene, state, cache, record.probe, record.dt);
    record.commanded = record.rendered.wrench.force;
    record.hand = probe.aim();
    probe.apply(record.commanded, record.dt);
    records.push_back(record);
  }
  return records;
}

TEST(Follow, SeriesMetricsAndPageSpeakOfTheIsosurface) {
  const Scene scene = scene_with(strip(), CrossUncrossLaw{});
  const StrokePath path = stroke(Vec3(-0.02, 0.0, 0.001), Vec3(0.02, 0.0, 0.001));
  const auto records = run(scene, path);
  RunReport report;
  report.law = "cross-uncross";
  report.series = derive_series(records, scene, path);
  report.metrics = measure_run(records, report.series, path);
  ASSERT_EQ(report.series.follow.size(), records.size());
  // Felt on the surface, along its normal, with the energy of its spring.
  EXPECT_LT(report.metrics.height.max_error, 2e-6);
  EXPECT_GT(report.metrics.direction.samples, 900u);
  EXPECT_LT(report.metrics.direction.max, 0.5 * std::numbers::pi / 180.0);
  EXPECT_LT(report.metrics.energy.generated, 1e-3 * force * 1e-4);
  const auto json = nlohmann::json::parse(metrics_json(report.metrics));
  EXPECT_NEAR(json["follow"]["global"].get<double>(), report.metrics.follow.global, 1e-12);
  EXPECT_TRUE(json["ticks"]["flags"].contains("coarse_data"));
  const auto html = run_report_html(report);
  ASSERT_TRUE(html.ok());
  EXPECT_NE(html->find("\"follow_time\":{"), std::string::npos);
  EXPECT_NE(verdict(report.metrics).find("follow error"), std::string::npos);
  EXPECT_NE(summarise(report).find("follow error"), std::string::npos);
}

TEST(Follow, ScenesWithoutAnIsosurfaceHaveNoFollowError) {
  const Scene scene = synthetic::bare_scene();
  const StrokePath path = synthetic::line_path();
  const auto records = synthetic::rendered_along(path, scene);
  EXPECT_EQ(followed_instance(scene), nullptr);
  const RunMetrics m = measure_run(records, scene, path);
  EXPECT_EQ(m.follow.samples, 0u);
  const auto json = nlohmann::json::parse(metrics_json(m));
  EXPECT_TRUE(json["follow"]["global"].is_null());
  EXPECT_EQ(verdict(m).find("follow error"), std::string::npos);
}

TEST(Flags, EveryBitHasItsName) {
  EXPECT_STREQ(flag_name(8), "energy_limited");
  EXPECT_STREQ(flag_name(9), "coarse_data");
  EXPECT_STREQ(flag_name(10), "field_force");
  EXPECT_STREQ(flag_name(11), "texture_faded");
  EXPECT_STREQ(flag_name(12), "work_left");
  EXPECT_STREQ(flag_name(16), "fault");
  EXPECT_STREQ(flag_name(17), "unknown");
}

TEST(Flags, EveryFlagOfATickIsCountedAndTold) {
  const Scene scene = synthetic::bare_scene();
  const StrokePath path = synthetic::line_path();
  auto records = synthetic::rendered_along(path, scene);
  Flags all;
  for (const auto& [flag, name] : Names<TickFlag>::table) all.set(flag);
  records[3].rendered.flags = all;
  const RunMetrics m = measure_run(records, scene, path);
  const auto json = nlohmann::json::parse(metrics_json(m));
  for (std::size_t bit = 0; bit < m.ticks.flags.size(); ++bit) {
    EXPECT_GE(m.ticks.flags[bit], 1u) << flag_name(bit);
    EXPECT_GE(json["ticks"]["flags"][flag_name(bit)].get<int>(), 1);
  }
  // No name is left without its count.
  EXPECT_EQ(json["ticks"]["flags"].size(), Names<TickFlag>::table.size());
  EXPECT_STREQ(flag_name(m.ticks.flags.size()), "unknown");
}

// --- pictures ---

TEST(IsosurfacePicture, RaysMeetTheBallWhereItIs) {
  const auto ball = surface_of(sampled(cube(0.03, 61), [](const Vec3& p) { return p.norm(); }), 0.02);
  const Scene scene = scene_with(ball, CrossUncrossLaw{});
  Camera camera;
  camera.eye = Vec3(0.0, 0.0, 0.3);
  camera.pixel = 1.5e-3;
  camera.width = camera.height = 100.0;
  RayCaster caster(scene, camera);
  int hits = 0;
  for (int i = 0; i < 100; ++i) {
    const double x = 50.0 + 40.0 * std::sin(i);
    const double y = 50.0 + 40.0 * std::cos(2.3 * i);
    const Vec3 direction = camera.ray(x, y);
    // |eye + t direction| = 20 mm
    const double a = direction.squaredNorm();
    const double b = camera.eye.dot(direction);
    const double root = b * b - a * (camera.eye.squaredNorm() - 4e-4);
    const Pixel pixel = caster.cast(x, y);
    if (std::abs(root) < 1e-4) continue;
    ASSERT_EQ(pixel.hit(), root > 0.0) << i;
    if (root < 0.0) continue;
    const double t = (-b - std::sqrt(root)) / a;
    ++hits;
    EXPECT_NEAR(pixel.depth, t, 2e-5);
    EXPECT_GT(pixel.normal.dot((camera.eye + t * direction).normalized()), 0.9999);
  }
  EXPECT_GT(hits, 20);
}

TEST(IsosurfacePicture, FramesTheSurfaceAndNotTheVolume) {
  // A ball of 5 mm in a volume of 200 mm.
  const auto ball = surface_of(sampled(cube(0.1, 81), [](const Vec3& p) { return p.norm(); }), 0.005);
  const Scene scene = scene_with(ball, CrossUncrossLaw{});
  StrokeSettings settings;
  settings.start = Vec3(-0.004, 0.005, 0.0);
  settings.end = Vec3(0.004, 0.005, 0.0);
  const StrokePath path = build_stroke(settings, [](const Vec3& p) {
                            return SurfacePoint{0.005 * p.normalized(), p.normalized()};
                          }).value();
  PictureSettings small;
  small.width = 90;
  small.height = 60;
  small.budget = 1e6;
  const auto picture = render_picture(scene, path, {}, small);
  ASSERT_TRUE(picture.ok()) << picture.error().message();
  // What is not background: the ball must fill a good part of the view.
  const auto& samples = picture->image.samples;
  const std::size_t corner = 0;
  std::size_t drawn = 0;
  for (std::size_t i = 0; i + 2 < samples.size(); i += 3) {
    int difference = 0;
    for (std::size_t k = 0; k < 3; ++k) difference += std::abs(int{samples[i + k]} - int{samples[corner + k]});
    drawn += difference > 40 ? 1U : 0U;
  }
  EXPECT_GT(static_cast<double>(drawn), 0.1 * static_cast<double>(samples.size()) / 3.0);
}

}  // namespace
}  // namespace asperity::follow_test
