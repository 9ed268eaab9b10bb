#include "asperity/device/stroke.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "tests/device/surfaces.h"

namespace asperity::stroke_test {
namespace {

constexpr double pi = std::numbers::pi;

StrokePath on_sphere(const StrokeSettings& settings, double radius = 0.05) {
  return build_stroke(settings, OnSphere{radius}).value();
}

StrokeSettings of_type(StrokeType type) {
  StrokeSettings s = line_settings();
  s.type = type;
  s.centre = Vec3(0.0, 0.06, 0.0);
  s.points = {Vec3(-0.02, 0.05, 0.0), Vec3(0.0, 0.05, 0.02), Vec3(0.02, 0.05, 0.0)};
  if (type == StrokeType::raster) {
    s.start = Vec3(-0.02, 0.05, -0.01);
    s.end = Vec3(0.02, 0.05, 0.01);
  }
  if (type == StrokeType::spiral) s.turns = 3.0;
  return s;
}

constexpr StrokeType drawn_types[] = {StrokeType::line, StrokeType::raster, StrokeType::circle, StrokeType::spiral,
                                      StrokeType::polyline};

TEST(Stroke, EverySampleLiesOnTheSurfaceWithItsNormal) {
  for (const StrokeType type : drawn_types) {
    StrokeSettings settings = of_type(type);
    settings.normal_smoothing = 0.0;
    const StrokePath path = on_sphere(settings);
    for (std::size_t i = 0; i < path.points().size(); ++i) {
      ASSERT_NEAR(path.points()[i].norm(), 0.05, 1e-12) << to_string(type);
      ASSERT_NEAR((path.normals()[i] - path.points()[i] / 0.05).norm(), 0.0, 1e-9) << to_string(type);
    }
  }
}

TEST(Stroke, LineOnThePlaneHasItsLengthAndTiming) {
  StrokeSettings s = line_settings(0.04);
  s.depth = 0.001;
  s.approach_height = 0.005;
  s.approach_speed = 0.02;
  s.speed = 0.01;
  const StrokePath path = build_stroke(s, on_plane).value();
  EXPECT_NEAR(path.length(), 0.04, 1e-12);
  EXPECT_NEAR(path.contact_begin().count(), 0.3, 1e-12);
  EXPECT_NEAR((path.contact_end() - path.contact_begin()).count(), 4.0, 1e-9);
  EXPECT_NEAR(path.duration().count(), 4.6, 1e-9);
  EXPECT_NEAR((path.pose(Seconds(0.0)).target - Vec3(-0.02, 0.005, 0.0)).norm(), 0.0, 1e-12);
  const StrokePose half = path.pose(Seconds(2.3));
  EXPECT_NEAR((half.target - Vec3(0.0, -0.001, 0.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((half.velocity - Vec3(0.01, 0.0, 0.0)).norm(), 0.0, 1e-12);
  EXPECT_EQ(half.phase, StrokePhase::contact);
  EXPECT_NEAR(half.distance, 0.02, 1e-12);
  EXPECT_EQ(path.pose(path.duration()).phase, StrokePhase::done);
  EXPECT_NEAR((path.pose(Seconds(100.0)).target - Vec3(0.02, 0.005, 0.0)).norm(), 0.0, 1e-12);
}

TEST(Stroke, ABallIsLedByItsLowestPoint) {
  for (const double radius : {2e-4, 1e-3, 1e-2}) {
    StrokeSettings s = line_settings(0.04);
    s.depth = 3e-4;
    s.approach_height = 0.004;
    s.approach_speed = 0.02;
    s.probe_radius = radius;
    const StrokePath path = build_stroke(s, on_plane).value();
    EXPECT_NEAR(path.pose(Seconds(0.0)).height - radius, 0.004, 1e-12);
    EXPECT_NEAR(path.pose(path.contact_begin()).height - radius, -3e-4, 1e-12);
    EXPECT_NEAR(path.contact_begin().count(), 0.0043 / 0.02, 1e-12) << "it goes as fast and as far as a point";
    s.press = PressMode::force;
    EXPECT_NEAR(build_stroke(s, on_plane)->pose(path.contact_begin()).height, radius, 1e-12);
  }
}

TEST(Stroke, CircleOnThePlaneIsRoundAndClosed) {
  StrokeSettings s = of_type(StrokeType::circle);
  s.centre = Vec3(0.01, 0.02, 0.03);
  s.radius = 0.012;
  s.turns = 2.0;
  const StrokePath path = build_stroke(s, on_plane).value();
  EXPECT_TRUE(path.closed());
  EXPECT_NEAR(path.length(), 2.0 * 2.0 * pi * 0.012, 1e-6);
  for (const Vec3& p : path.points()) EXPECT_NEAR((p - Vec3(0.01, 0.0, 0.03)).norm(), 0.012, 1e-12);
  EXPECT_NEAR((path.points().front() - path.points().back()).norm(), 0.0, 1e-15);
}

TEST(Stroke, SpiralGrowsByItsPitch) {
  StrokeSettings s = of_type(StrokeType::spiral);
  s.centre = Vec3::Zero();
  s.radius = 0.01;
  s.pitch = 0.002;
  const StrokePath path = build_stroke(s, on_plane).value();
  // Archimedean spiral: arc length is the integral of sqrt(r^2 + (pitch / 2 pi)^2) over the angle.
  const double a = s.pitch / (2.0 * pi);
  double expected = 0.0;
  const int steps = 100000;
  for (int i = 0; i < steps; ++i) {
    const double angle = (i + 0.5) / steps * 2.0 * pi * 5.0;
    expected += std::hypot(a * angle, a) * 2.0 * pi * 5.0 / steps;
  }
  // Chords of the innermost winding, where the curve turns fastest, are all that is missing.
  EXPECT_NEAR(path.length(), expected, 5e-4 * expected);
  EXPECT_NEAR(path.points().back().norm(), 0.01, 1e-12);
}

TEST(Stroke, RasterRunsRowByRow) {
  StrokeSettings s = of_type(StrokeType::raster);
  s.rows = 5;
  const StrokePath path = build_stroke(s, on_plane).value();
  EXPECT_NEAR(path.length(), 5 * 0.04 + 4 * 0.005, 1e-9);
  s.pitch = 0.004;
  // Rows at 0, 4, ... 20 mm.
  const StrokePath pitched = build_stroke(s, on_plane).value();
  EXPECT_NEAR(pitched.length(), 6 * 0.04 + 5 * 0.004, 1e-9);
}

TEST(Stroke, ClosedPolylineIsRecognised) {
  StrokeSettings s = of_type(StrokeType::polyline);
  EXPECT_FALSE(build_stroke(s, on_plane)->closed());
  s.points.push_back(s.points.front());
  EXPECT_TRUE(build_stroke(s, on_plane)->closed());
}

TEST(Stroke, BackAndForthEndsWhereItBegan) {
  StrokeSettings s = line_settings();
  s.repeats = 3;
  s.back_and_forth = true;
  const StrokePath path = build_stroke(s, on_plane).value();
  const double one_way = path.length() / s.speed;
  EXPECT_NEAR((path.contact_end() - path.contact_begin()).count(), 6.0 * one_way, 1e-9);
  const StrokePose returning = path.pose(path.contact_begin() + Seconds(1.25 * one_way));
  EXPECT_NEAR(returning.velocity.x(), -s.speed, 1e-12);
  EXPECT_NEAR(returning.arc, 0.75 * path.length(), 1e-9);
  EXPECT_NEAR((path.pose(path.duration()).target - path.pose(Seconds(0.0)).target).norm(), 0.0, 1e-12);
}

/// Positions have no gaps, and the stated velocity is the derivative of the target, away from corners.
RC_GTEST_PROP(Stroke, VelocityIsTheDerivativeOfTheTarget, ()) {
  StrokeSettings s =
      of_type(*rc::gen::elementOf(std::vector<StrokeType>(std::begin(drawn_types), std::end(drawn_types))));
  s.back_and_forth = *rc::gen::arbitrary<bool>();
  s.press = *rc::gen::element(PressMode::depth, PressMode::force);
  const StrokePath path = on_sphere(s);
  const double t = path.duration().count() * *rc::gen::map(rc::gen::inRange(0, 100000), [](int v) { return v * 1e-5; });
  const double h = 1e-6;
  const StrokePose before = path.pose(Seconds(t));
  const StrokePose after = path.pose(Seconds(t + h));
  const double fastest = s.speed * 1.1 + s.approach_speed;
  RC_ASSERT((after.target - before.target).norm() <= fastest * h);
  RC_ASSERT(std::abs(before.normal.norm() - 1.0) < 1e-12);
  RC_ASSERT(std::abs(before.tangent.norm() - 1.0) < 1e-9);
  // Between two samples the path is straight; at a sample its direction changes.
  const bool corner = before.phase != after.phase || before.tangent.dot(after.tangent) < 1.0 - 1e-12;
  if (!corner) {
    const Vec3 difference = (after.target - before.target) / h;
    RC_ASSERT((difference - before.velocity).norm() < 1e-3 * fastest);
  }
}

TEST(Stroke, NormalsOfFacetsAreSmoothedWithoutLeavingTheirMean) {
  // A roof with its ridge at x = 0: normals jump by 60 degrees there.
  const auto roof = [](const Vec3& p) {
    const double side = p.x() < 0.0 ? -1.0 : 1.0;
    const Vec3 n = Vec3(0.5 * side, std::sqrt(0.75), 0.0);
    const Vec3 along = Vec3(std::sqrt(0.75) * side, -0.5, 0.0);
    return SurfacePoint{along * std::max(0.0, p.dot(along)), n};
  };
  StrokeSettings s = line_settings();
  s.normal_smoothing = 0.004;
  const StrokePath path = build_stroke(s, roof).value();
  double largest_turn = 0.0;
  for (std::size_t i = 1; i < path.normals().size(); ++i) {
    const double turn = std::acos(std::min(1.0, path.normals()[i].dot(path.normals()[i - 1])));
    largest_turn = std::max(largest_turn, turn / (path.arcs()[i] - path.arcs()[i - 1]));
  }
  EXPECT_LT(largest_turn, 1.5 * (pi / 3.0) / 0.004);
  EXPECT_NEAR(path.normals().front().x(), -0.5, 1e-9);
  EXPECT_NEAR(path.normals().back().x(), 0.5, 1e-9);
}

TEST(Stroke, JumpsOfTheNearestPointAreBridgedOverTheSurface) {
  // The line passes below the sphere's centre: nearest points would jump from one side to the other at the centre.
  StrokeSettings s = line_settings();
  s.start = Vec3(-0.06, 1e-7, 0.0);
  s.end = Vec3(0.06, 1e-7, 0.0);
  const StrokePath path = on_sphere(s);
  EXPECT_NEAR(path.length(), pi * 0.05, 1e-3);
}

TEST(Stroke, RecordedPathIsFollowedAsItIs) {
  StrokeSettings s;
  s.type = StrokeType::recorded;
  s.recorded = {
      {Seconds(5.0), Vec3(0, 0.01, 0)}, {Seconds(6.0), Vec3(0, -0.001, 0)}, {Seconds(8.0), Vec3(0.02, -0.001, 0)}};
  const StrokePath path = build_stroke(s, on_plane).value();
  EXPECT_TRUE(path.recorded());
  EXPECT_NEAR(path.duration().count(), 3.0, 1e-12);
  const StrokePose pose = path.pose(Seconds(2.0));
  EXPECT_NEAR((pose.target - Vec3(0.01, -0.001, 0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((pose.velocity - Vec3(0.01, 0, 0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR(path.pose(Seconds(0.5)).velocity.y(), -0.011, 1e-12);
  EXPECT_EQ(path.pose(Seconds(3.0)).phase, StrokePhase::done);
}

TEST(Stroke, DefaultCrossesTheTopOfTheObject) {
  Box box;
  box.include(Vec3(-0.02, -0.01, -0.04));
  box.include(Vec3(0.02, 0.03, 0.04));
  const StrokeSettings s = default_stroke(box);
  const StrokePath path = build_stroke(s, on_plane).value();
  EXPECT_NEAR(path.length(), 0.4 * 0.08, 1e-9);
  EXPECT_NEAR((path.contact_end() - path.contact_begin()).count(), 4.0, 1e-6);
  EXPECT_EQ(s.start.y(), 0.03);
}

TEST(Stroke, EmptyPathIsDoneAtTheOrigin) {
  const StrokePath path;
  EXPECT_EQ(path.length(), 0.0);
  EXPECT_EQ(path.duration().count(), 0.0);
  EXPECT_EQ(path.pose(Seconds(1.0)).phase, StrokePhase::done);
  EXPECT_EQ(path.pose(Seconds(0.0)).target, Vec3(Vec3::Zero()));
}

TEST(Stroke, TypesHaveNamesAndNearestOnesAreSuggested) {
  for (const StrokeType type : drawn_types) EXPECT_EQ(find_stroke_type(to_string(type)).value(), type);
  EXPECT_NE(find_stroke_type("spirl").error().what.find("did you mean \"spiral\""), std::string::npos);
}

TEST(Stroke, EachBadSettingIsNamed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto place = [](StrokeType type, auto change) {
    StrokeSettings s = of_type(type);
    change(s);
    const auto result = build_stroke(s, on_plane);
    return result ? std::string("accepted") : result.error().place;
  };
  using S = StrokeSettings;
  EXPECT_EQ(place(StrokeType::line, [&](S& s) { s.start.x() = nan; }), "start");
  EXPECT_EQ(place(StrokeType::line, [&](S& s) { s.probe_radius = -1e-3; }), "probe_radius");
  EXPECT_EQ(place(StrokeType::line, [&](S& s) { s.end = s.start; }), "line");
  EXPECT_EQ(place(StrokeType::line, [&](S& s) { s.end = s.start + Vec3::UnitY(); }), "line");
  EXPECT_EQ(place(StrokeType::line, [&](S& s) { s.speed = 0.0; }), "speed");
  EXPECT_EQ(place(StrokeType::line, [&](S& s) { s.depth = nan; }), "depth");
  EXPECT_EQ(place(StrokeType::line, [&](S& s) { s.approach_speed = -1.0; }), "approach_speed");
  EXPECT_EQ(place(StrokeType::line, [&](S& s) { s.approach_height = -1.0; }), "approach_height");
  EXPECT_EQ(place(StrokeType::line, [&](S& s) { s.repeats = 0; }), "repeats");
  EXPECT_EQ(place(StrokeType::line, [&](S& s) { s.repeats = 2; }), "repeats");
  EXPECT_EQ(place(StrokeType::line, [&](S& s) { s.sample_spacing = 0.0; }), "sample_spacing");
  EXPECT_EQ(place(StrokeType::line, [&](S& s) { s.sample_spacing = 1e-12; }), "sample_spacing");
  EXPECT_EQ(place(StrokeType::line, [&](S& s) { s.normal_smoothing = -1.0; }), "normal_smoothing");
  EXPECT_EQ(place(StrokeType::line, [&](S& s) { s.press = PressMode::force, s.normal_force = 0.0; }), "normal_force");
  EXPECT_EQ(place(StrokeType::circle, [&](S& s) { s.radius = 0.0; }), "radius");
  EXPECT_EQ(place(StrokeType::circle, [&](S& s) { s.axis.setZero(); }), "axis");
  EXPECT_EQ(place(StrokeType::circle, [&](S& s) { s.turns = 0.0; }), "turns");
  EXPECT_EQ(place(StrokeType::circle, [&](S& s) { s.sample_spacing = 1e-12; }), "sample_spacing");
  EXPECT_EQ(place(StrokeType::spiral, [&](S& s) { s.pitch = -1.0; }), "pitch");
  EXPECT_EQ(place(StrokeType::spiral, [&](S& s) { s.pitch = 1e-9; }), "pitch");
  EXPECT_EQ(place(StrokeType::raster, [&](S& s) { s.rows = 0; }), "rows");
  EXPECT_EQ(place(StrokeType::raster, [&](S& s) { s.pitch = 1e-12; }), "pitch");
  EXPECT_EQ(place(StrokeType::polyline, [&](S& s) { s.points.resize(1); }), "points");
  EXPECT_EQ(place(StrokeType::polyline, [&](S& s) { s.points[1].y() = nan; }), "points[1]");
  EXPECT_EQ(place(StrokeType::recorded, [&](S&) {}), "recorded");
  EXPECT_EQ(place(StrokeType::recorded, [&](S& s) { s.recorded.resize(2); }), "recorded[1]");
}

TEST(Stroke, SurfaceThatGivesNothingIsAnError) {
  const auto nothing = [](const Vec3&) { return SurfacePoint{Vec3::Constant(infinity), Vec3::UnitY()}; };
  EXPECT_EQ(build_stroke(line_settings(), nothing).error().place, "surface");
  EXPECT_EQ(build_stroke(line_settings(), SurfaceProjector{}).error().place, "surface");
}

}  // namespace
}  // namespace asperity::stroke_test
