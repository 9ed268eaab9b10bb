// Runs on potentials, judged by the exact geometry.

#include <gtest/gtest.h>

#include "asperity/study/metrics.h"
#include "tests/field/sparse_grids.h"
#include "tests/study/synthetic.h"

namespace asperity::exact_geometry_test {
namespace {

using namespace synthetic;

constexpr double half = 0.02;

std::shared_ptr<const MeshSurface> box() {
  return std::make_shared<const MeshSurface>(
      TriangleIndex::build(TriangleMesh::build(box_mesh(Vec3::Constant(2.0 * half))).value()));
}

Scene potential_scene(const std::shared_ptr<const MeshSurface>& mesh, double offset = 0.0) {
  return scene_of(
      std::make_shared<const ImplicitSurface>(
          ImplicitSurface::build({test::sparse_box(0.0005, 0.003), nullptr, mesh, CellReconstruction::smooth, offset})
              .value()),
      ProxyLaw{});
}

/// Over the face z = +half, from its middle to its edge at x = +half.
StrokePath to_the_edge() {
  StrokeSettings settings;
  settings.start = Vec3(0.0, 0.003, half);
  settings.end = Vec3(half - 0.0001, 0.003, half);
  return build_stroke(settings,
                      [](const Vec3& p) {
                        return SurfacePoint{Vec3(p.x(), p.y(), half), Vec3::UnitZ()};
                      })
      .value();
}

/// Pushed up by 1 N, tilted by `tilt` (rad) where x is beyond `from`.
std::vector<TraceRecord> tilted(const StrokePath& path, double from, double tilt) {
  std::vector<TraceRecord> records = records_along(path, [&](const Vec3& p, double) {
    const double angle = p.x() > from ? tilt : 0.0;
    return Vec3(std::sin(angle), 0.0, std::cos(angle));
  });
  for (TraceRecord& record : records) {
    if (record.rendered.flags.has(TickFlag::contact)) {
      record.rendered.proxy = record.probe.pose.position;
      record.rendered.proxy.z() = half;
    }
  }
  return records;
}

TEST(ExactGeometry, DirectionsNearEdgesAreToldApart) {
  const auto mesh = box();
  const Scene scene = potential_scene(mesh);
  EXPECT_NEAR(edge_reach_of(scene), 0.00075, 1e-12);
  EXPECT_NEAR(edge_reach_of(bare_scene()), 0.001, 1e-12);
  const StrokePath path = to_the_edge();
  const auto records = tilted(path, half - 0.002, 0.1);
  const RunSeries series = derive_series(records, scene, path, {nullptr, 0.002});
  const RunMetrics m = measure_run(records, series, path);
  ASSERT_GT(m.direction_near.samples, 50U);
  ASSERT_GT(m.direction_far.samples, 500U);
  EXPECT_NEAR(m.direction_near.mean, 0.1, 2e-3);
  EXPECT_NEAR(m.direction_far.mean, 0.0, 2e-3);
  EXPECT_EQ(m.direction.samples, m.direction_near.samples + m.direction_far.samples);
}

TEST(ExactGeometry, EdgesOfATriangulationThatDoNotFoldAreNone) {
  const Scene sheet_scene = bare_scene();
  const StrokePath path = line_path();
  const auto records = records_along(path, [](const Vec3&, double) { return Vec3(0.0, 0.0, 1.0); });
  EXPECT_EQ(measure_run(records, sheet_scene, path).direction_near.samples, 0U);
}

TEST(ExactGeometry, AnotherScenesSurfacesMayJudge) {
  const auto mesh = box();
  // An offset surface is judged as it is felt, unless the mesh is to judge it.
  const Scene felt = potential_scene(mesh, 0.001);
  const Scene exact = scene_of(mesh);
  const StrokePath path = to_the_edge();
  std::vector<TraceRecord> records = tilted(path, 1.0, 0.0);
  for (TraceRecord& record : records) record.rendered.proxy.z() = half + 0.001;
  const auto heights = [&](const Scene* judge) {
    const RunSeries series = derive_series(records, felt, path, {judge, 0.001});
    return measure_run(records, series, path).height;
  };
  EXPECT_NEAR(heights(nullptr).max_error, 0.0, 1e-4);
  EXPECT_NEAR(heights(&exact).max_error, 0.001, 1e-5);
}

}  // namespace
}  // namespace asperity::exact_geometry_test
