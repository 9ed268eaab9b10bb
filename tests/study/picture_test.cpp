#include "asperity/study/picture.h"

#include <gtest/gtest.h>

#include "asperity/io/image_io.h"
#include "asperity/study/detail/camera.h"
#include "asperity/study/detail/ray_cast.h"
#include "tests/study/synthetic.h"

namespace asperity::picture_test {
namespace {

using namespace synthetic;

PictureSettings small_picture() {
  PictureSettings settings;
  settings.width = 120;
  settings.height = 80;
  settings.budget = 1e6;  // never gives up detail: the picture does not depend on the machine
  return settings;
}

TEST(Camera, ProjectsWhereItsRaysGo) {
  const std::vector<Vec3> points{Vec3(-1, 0, -1), Vec3(1, 0.2, 1), Vec3(0.3, 0.5, 0)};
  const Camera camera = three_quarter_view(points, Vec3::UnitY(), 300, 200);
  for (const Vec3& point : points) {
    const Vec3 image = camera.project(point);
    EXPECT_LT((camera.eye + image.z() * camera.ray(image.x(), image.y()) - point).norm(), 1e-9);
    EXPECT_TRUE(image.x() > 0.0 && image.x() < 300.0 && image.y() > 0.0 && image.y() < 200.0);
  }
  EXPECT_GT(camera.up.y(), 0.0);
}

TEST(Camera, LooksOntoTheSideThatTheNormalPointsTo) {
  const std::vector<Vec3> points{Vec3(-1, -1, 0), Vec3(1, 1, 0)};
  EXPECT_GT(three_quarter_view(points, Vec3::UnitZ(), 300, 200).eye.z(), 0.5);
  EXPECT_LT(three_quarter_view(points, -Vec3::UnitZ(), 300, 200).eye.z(), -0.5);
}

TEST(RayCaster, SeesTheSheetWhereItsPlaneIs) {
  const Scene scene = bare_scene();
  const StrokePath path = line_path();
  const Camera camera = three_quarter_view(path.points(), Vec3::UnitZ(), 60, 40);
  RayCaster caster(scene, camera);
  for (int i = 0; i < 40; ++i) {
    const Pixel pixel = caster.cast(1.5 * i, i);
    const Vec3 direction = camera.ray(1.5 * i, i);
    const double depth = -camera.eye.z() / direction.z();
    const Vec3 at = camera.eye + depth * direction;
    if (std::abs(at.x()) > 0.0299 || std::abs(at.y()) > 0.0299) continue;
    ASSERT_TRUE(pixel.hit());
    EXPECT_NEAR(pixel.depth, depth, 1e-5);
    EXPECT_GT(pixel.normal.z(), 0.999);
  }
}

TEST(RayCaster, ReliefEndsAtTheRimOfAnOpenSheet) {
  const Scene scene = relief_scene({MesostructureKind::flat, 16, 2e-3, 8, 1}, HeightFieldLaw{});
  Camera camera;
  camera.eye = Vec3(0.0, 0.0, 1.0);
  camera.pixel = 0.001;
  camera.width = camera.height = 200.0;
  RayCaster caster(scene, camera);
  const Pixel inside = caster.cast(100.0 + 29.0, 100.0);  // 29 mm from the middle
  ASSERT_TRUE(inside.hit());
  EXPECT_NEAR(inside.depth, 1.0 - 2e-3, 1e-5);
  EXPECT_FALSE(caster.cast(100.0 + 30.7, 100.0).hit());  // within the amplitude of the rim, but beside it
}

TEST(CastImage, InterpolatedCellsAgreeWithCastOnes) {
  const Scene scene =
      relief_scene({MesostructureKind::rings, 128, 1e-3, 8, 1}, HeightFieldLaw{}, Reconstruction::quadratic_bspline);
  const StrokePath path = line_path();
  const Camera camera = three_quarter_view(path.points(), Vec3::UnitZ(), 90, 60);
  const PixelGrid every = cast_image(scene, camera, 1, 1, {});
  const PixelGrid blocks = cast_image(scene, camera, 3, 2, {});
  ASSERT_EQ(every.pixels.size(), blocks.pixels.size());
  std::size_t hits = 0;
  for (std::size_t i = 0; i < every.pixels.size(); ++i) {
    if (!every.pixels[i].hit() || !blocks.pixels[i].hit()) continue;
    ++hits;
    EXPECT_NEAR(blocks.pixels[i].depth, every.pixels[i].depth, 3.0 * camera.pixel * every.pixels[i].depth);
  }
  EXPECT_GT(hits, 1000u);
}

TEST(Picture, ShowsTheSheetAndTheStrokeInTheColoursOfItsForces) {
  const Scene scene = bare_scene();
  const StrokePath path = line_path();
  const double start = path.contact_begin().count();
  const auto records = records_along(path, [&](const Vec3&, double t) { return Vec3(0.0, 0.0, 1.0 + (t - start)); });
  const auto picture = render_picture(scene, path, records, small_picture());
  ASSERT_TRUE(picture.ok()) << picture.error().message();
  EXPECT_EQ(picture->block, 1);
  EXPECT_EQ(picture->image.width, 120);
  EXPECT_EQ(picture->image.height, 80);
  // Forces run from 1 to 3 N evenly: 2 % from either end.
  EXPECT_NEAR(picture->force_low, 1.04, 0.01);
  EXPECT_NEAR(picture->force_high, 2.96, 0.01);
  const auto count_like = [&](const std::array<std::uint8_t, 3>& colour) {
    int count = 0;
    for (int y = 0; y < 80; ++y) {
      for (int x = 0; x < 120; ++x) {
        int off = 0;
        for (int c = 0; c < 3; ++c)
          off = std::max(off, std::abs(picture->image.sample(x, y, c) - colour[static_cast<std::size_t>(c)]));
        count += off < 30 ? 1 : 0;
      }
    }
    return count;
  };
  EXPECT_GT(count_like(force_colour(0.02)), 3);
  EXPECT_GT(count_like(force_colour(0.5)), 3);
  EXPECT_GT(count_like(force_colour(0.98)), 3);
  EXPECT_GT(count_like({251, 251, 250}), 500);  // ground
  const auto decoded = read_image_bytes(picture->png, "picture.png");
  ASSERT_TRUE(decoded.ok()) << decoded.error().message();
  EXPECT_EQ(decoded->samples, picture->image.samples);
}

TEST(Picture, SameInputsGiveTheSamePictureWithAnyNumberOfThreads) {
  const Scene scene = relief_scene({MesostructureKind::warts, 64, 1e-3, 8, 1}, HeightFieldLaw{});
  const StrokePath path = line_path();
  const auto records = rendered_along(path, scene);
  PictureSettings settings = small_picture();
  settings.threads = 1;
  const auto one = render_picture(scene, path, records, settings);
  settings.threads = 3;
  const auto three = render_picture(scene, path, records, settings);
  ASSERT_TRUE(one.ok() && three.ok());
  // What is remembered is a cache: an answer may differ in its last bits, a colour by one step.
  ASSERT_EQ(one->image.samples.size(), three->image.samples.size());
  int different = 0;
  for (std::size_t i = 0; i < one->image.samples.size(); ++i)
    different += std::abs(one->image.samples[i] - three->image.samples[i]) > 2 ? 1 : 0;
  EXPECT_LT(different, 30);
}

TEST(Picture, BadSettingsAreNamed) {
  const Scene scene = bare_scene();
  const StrokePath path = line_path();
  const auto refused = [&](auto change) {
    PictureSettings settings = small_picture();
    change(settings);
    const auto result = render_picture(scene, path, {}, settings);
    return result.ok() ? std::string() : result.error().place;
  };
  EXPECT_EQ(refused([](PictureSettings& s) { s.width = 0; }), "picture.width");
  EXPECT_EQ(refused([](PictureSettings& s) { s.height = 100000; }), "picture.height");
  EXPECT_EQ(refused([](PictureSettings& s) { s.threads = -1; }), "picture.threads");
  EXPECT_EQ(refused([](PictureSettings& s) { s.threads = 65; }), "picture.threads");
  EXPECT_EQ(refused([](PictureSettings& s) { s.budget = std::nan(""); }), "picture.budget");
}

TEST(ForceColour, BrightensEvenlyFromEndToEnd) {
  double before = -1.0;
  for (int i = 0; i <= 50; ++i) {
    const auto c = force_colour(i / 50.0);
    const double brightness = 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
    EXPECT_GT(brightness, before);
    before = brightness;
  }
  EXPECT_EQ(force_colour(-1.0), force_colour(0.0));
  EXPECT_EQ(force_colour(7.0), force_colour(1.0));
  EXPECT_EQ(force_colour(std::nan("")), force_colour(0.0));
}

}  // namespace
}  // namespace asperity::picture_test
