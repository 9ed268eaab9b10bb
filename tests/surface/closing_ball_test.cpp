// Balls at rest on the samples of a relief: what closing asks for texel by texel.

#include "asperity/surface/relief/detail/closing_ball.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/surface/folded.h"
#include "tests/surface/reliefs.h"

namespace asperity::closing_ball_test {
namespace {

using namespace test;

constexpr double radius = 2e-3;

struct Rests {
  int answered = 0;
  int off = 0;      ///< balls that do not pass through the place that they hold
  int blocked = 0;  ///< balls with something in them
};

/// Over every texel of a relief as rough as maps get, no two texels of it alike: let down from above, and from the ball
/// on the texel itself.
Rests rests_on(const MeshSource& base, int texels, std::uint64_t seed) {
  Rng rng(seed);
  const HeightMap noise = map_of(32, [&](double, double) { return radius * rng.uniform(); });
  const auto surface = coated(base, noise, Mapping::triplanar, 3.0 * radius);
  const ReliefSamples samples(*surface, {}, texels, radius / 48.0, {});
  BallSolver solver(*surface, samples, {}, radius);
  Rests all;
  const auto count = [&](const ShellRay& ray, double height, const RestingBall& ball) {
    if (!std::isfinite(height)) return;
    ++all.answered;
    if (std::abs((ball.centre - ray.at(height)).norm() - radius) > 1e-3 * radius) ++all.off;
    if (!solver.is_free(ball.centre, 1e-3)) ++all.blocked;
  };
  for (std::uint32_t face = 0; face < surface->base().mesh().triangles().size(); ++face) {
    const ShellPrism prism = samples.prism(face);
    const int nodes = samples.cuts(face) / texels;
    for (int i = 0; i <= texels; ++i) {
      for (int j = 0; i + j <= texels; ++j) {
        const double u = static_cast<double>(i) / texels;
        const double v = static_cast<double>(j) / texels;
        const ShellRay ray{prism.base_at(u, v), prism.direction_at(u, v)};
        const auto lowest = static_cast<double>(samples.height(face, i * nodes, j * nodes));
        const ReliefPatch patch(samples, prism, face, i * nodes, j * nodes);
        RestingBall own;
        own.centre = ray.at(lowest) + radius * patch.normal(i * nodes - patch.i, j * nodes - patch.j);
        own.count = 1;
        own.node[0] = {face, i * nodes, j * nodes, false};
        RestingBall rest;
        const double from_own = solver.settle(ray, lowest, own, rest);
        count(ray, from_own, rest);
        const double from_above = solver.settle_from_above(ray, lowest, rest);
        count(ray, from_above, rest);
      }
    }
  }
  return all;
}

TEST(BallSolver, a_rest_that_is_answered_is_free_and_its_ball_passes_through_the_place_it_holds) {
  const MeshSource bases[] = {base_of_kind(5, 0), base_of_kind(1, 3)};
  for (const MeshSource& base : bases) {
    const int texels = base.triangles.size() > 100 ? 4 : 8;
    const Rests rests = rests_on(base, texels, 11);
    EXPECT_GT(rests.answered, 4000);
    EXPECT_EQ(rests.off, 0) << "of " << rests.answered;
    EXPECT_EQ(rests.blocked, 0);
  }
}

}  // namespace
}  // namespace asperity::closing_ball_test
