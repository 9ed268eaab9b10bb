#include "asperity/surface/implicit/surface.h"

#include <gtest/gtest.h>

#include <random>

#include "asperity/geometry/generators.h"
#include "tests/field/sparse_grids.h"
#include "tests/field/volumes.h"

namespace asperity::implicit_surface_test {
namespace {

TEST(ImplicitSurface, AnswersWithTheDistanceOfWhatItWasMadeFrom) {
  const auto grid = test::sparse_box(0.0005, 0.003);
  const ImplicitSurface surface =
      ImplicitSurface::build({grid, nullptr, nullptr, CellReconstruction::smooth, 0.0}).value();
  std::mt19937_64 generator(1);
  SurfaceCache cache;
  int asked = 0;
  for (int n = 0; n < 4000; ++n) {
    const Vec3 p = test::random_point(generator, 0.023);
    const double exact = test::box_distance(p, Vec3::Constant(0.02));
    if (std::abs(exact) > 0.0015) continue;
    // Two voxels from edges a box's distance is what lies between its samples.
    const Vec3 q = p.cwiseAbs();
    int near = 0;
    for (int a = 0; a < 3; ++a) near += q[a] > 0.02 - 0.003 ? 1 : 0;
    if (near != 1) continue;
    ++asked;
    const FieldSample sample = surface.eval(p, cache);
    EXPECT_NEAR(sample.value, exact, 1e-8);
    EXPECT_NEAR(sample.gradient.norm(), 1.0, 1e-5);
    const Foot foot = surface.view(cache).nearest(p, 0.01);
    ASSERT_TRUE(foot.found());
    EXPECT_NEAR(foot.distance, std::abs(exact), 1e-8);
  }
  EXPECT_GT(asked, 100);
}

TEST(ImplicitSurface, TheFirstTouchOfAMotionIsExact) {
  const auto grid = test::sparse_ball(0.0006, 0.003);
  const ImplicitSurface surface =
      ImplicitSurface::build({grid, nullptr, nullptr, CellReconstruction::smooth, 0.0}).value();
  std::mt19937_64 generator(2);
  SurfaceCache cache;
  int hits = 0;
  for (int n = 0; n < 2000; ++n) {
    const Segment motion{0.05 * test::random_point(generator, 1.0).normalized(), test::random_point(generator, 0.05)};
    const Vec3 d = motion.to - motion.from;
    const double b = motion.from.dot(d);
    const double c = motion.from.squaredNorm() - 0.03 * 0.03;
    const double root = b * b - d.squaredNorm() * c;
    const double t = root >= 0.0 ? (-b - std::sqrt(root)) / d.squaredNorm() : 2.0;
    // Grazing passes are decided by the interpolation.
    if (t < 0.0 || std::abs(root) < 1e-9 || std::abs(t - 1.0) < 1e-4) continue;
    const SweptHit hit = surface.view(cache).first_touch(motion, Sides::front);
    EXPECT_EQ(hit.hit, t <= 1.0) << n;
    if (!hit.hit) continue;
    ++hits;
    EXPECT_NEAR(hit.contact.point.norm(), 0.03, 1e-6);
  }
  EXPECT_GT(hits, 300);
}

TEST(ImplicitSurface, FacesBeyondTheMeshAreRefused) {
  auto mesh =
      std::make_shared<const MeshSurface>(TriangleIndex::build(TriangleMesh::build(icosphere(1, 0.03)).value()));
  SparseSource source = test::sparse_ball(0.002, 0.006)->source();
  for (SparseBlock& block : source.blocks) block.face.assign(SparseBlock::points, 3);
  auto good = std::make_shared<const SparseGrid>(SparseGrid::build(source).value());
  EXPECT_TRUE(ImplicitSurface::build({good, nullptr, mesh, CellReconstruction::smooth, 0.0}).ok());
  source.blocks[2].face[100] = 80;
  auto bad = std::make_shared<const SparseGrid>(SparseGrid::build(source).value());
  const Result<ImplicitSurface> refused = ImplicitSurface::build({bad, nullptr, mesh, CellReconstruction::smooth, 0.0});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("face 80"), std::string::npos);
}

TEST(ImplicitSurface, APotentialWithoutASurfaceIsRefused) {
  const auto empty = test::sparse_grid([](const Vec3&) { return 0.001; }, test::cube(0.01), 0.001, 0.004, 0.004);
  const Result<ImplicitSurface> refused =
      ImplicitSurface::build({empty, nullptr, nullptr, CellReconstruction::smooth, 0.0});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("no surface"), std::string::npos);
  EXPECT_FALSE(ImplicitSurface::build({nullptr, nullptr, nullptr, CellReconstruction::smooth, 0.0}).ok());
}

}  // namespace
}  // namespace asperity::implicit_surface_test
