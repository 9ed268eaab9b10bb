#include "asperity/study/loop_rate.h"

#include <gtest/gtest.h>

#include "asperity/render/step.h"
#include "tests/field/volumes.h"

namespace asperity::loop_rate_test {
namespace {

Instance sphere(std::uint32_t count) {
  Instance instance;
  instance.name = "sphere";
  instance.surface =
      std::make_shared<const IsoSurface>(IsoSurface::build(test::sphere_field(count), 0.03, Inside::low).value());
  return instance;
}

StrokePath over_the_top(const Scene& scene) {
  StrokeSettings settings;
  settings.start = Vec3(-0.01, 0.05, 0.0);
  settings.end = Vec3(0.01, 0.05, 0.0);
  settings.speed = 0.05;
  const IsoSurface& iso = *iso_of(scene.instances()[0].surface);
  return build_stroke(settings,
                      [&, cache = CellCache()](const Vec3& p) mutable {
                        const Foot foot = iso.view(cache).nearest(p, infinity);
                        return SurfacePoint{foot.point, iso.view(cache).outward(foot.point)};
                      })
      .value();
}

TEST(LoopRate, M_4_TimesEveryLawOnEverySizeOfTheData) {
  const Scene scene = Scene::build({sphere(65)}, 0.0).value();
  const std::vector<Law> laws{AvilaLaw{}, CrossUncrossLaw{}, ProxyLaw{}};
  const auto rows = loop_rates(scene, over_the_top(scene), laws, 1000.0, 300);
  ASSERT_TRUE(rows) << rows.error().message();
  ASSERT_EQ(rows->size(), 4U);
  const std::uint64_t along[] = {9, 17, 33, 65};
  for (std::size_t i = 0; i < 4; ++i) {
    const LoopRateRow& row = (*rows)[i];
    EXPECT_EQ(row.samples, along[i] * along[i] * along[i]);
    EXPECT_GE(row.bytes, 4.0 * static_cast<double>(row.samples));
    ASSERT_EQ(row.p50.size(), laws.size());
    for (const double p50 : row.p50) EXPECT_GT(p50, 0.0);
  }
}

TEST(LoopRate, LeavesOutSizesThatLoseTheSurface) {
  const Scene scene = Scene::build({sphere(12)}, 0.0).value();
  const std::vector<Law> laws{ProxyLaw{}};
  const auto rows = loop_rates(scene, over_the_top(scene), laws, 1000.0, 50);
  ASSERT_TRUE(rows);
  // Every fourth of twelve samples are four, every eighth too few.
  ASSERT_EQ(rows->size(), 3U);
  EXPECT_EQ(rows->front().samples, 64U);
  EXPECT_EQ(rows->back().samples, 1728U);
}

}  // namespace
}  // namespace asperity::loop_rate_test
