// Row K-8: a texture on a corner, felt by the laws.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

#include "asperity/surface/implicit/texture.h"
#include "tests/field/sparse_grids.h"
#include "tests/render/fixtures.h"

namespace asperity::test::implicit_texture_test {
namespace {

using asperity::test::box_distance;

constexpr double voxel = 0.5e-3;
constexpr double half = 0.02;

PointHeight bumps(double amplitude, double wavelength) {
  const double k = 2.0 * std::numbers::pi / wavelength;
  return [=](const Vec3& p, std::uint32_t, std::uint64_t) {
    return amplitude * std::sin(k * p.x()) * std::sin(k * p.y() + 1.0) * std::sin(k * p.z() + 2.0);
  };
}

/// One edge of a box of 40 mm, and as much of the faces beside it as is touched.
std::shared_ptr<const SparseGrid> edge() {
  Box box;
  box.lower = Vec3(0.008, -0.004, 0.008);
  box.upper = Vec3(half, 0.01, half);
  return asperity::test::sparse_grid([](const Vec3& p) { return box_distance(p, Vec3::Constant(half)); }, box, voxel,
                                     4.0 * voxel, 4.0 * voxel);
}

std::shared_ptr<const ImplicitSurface> textured_edge(const PointHeight& height, Redistancing mode) {
  const auto smooth = edge();
  ImplicitParts parts;
  parts.grid = std::make_shared<const SparseGrid>(must(textured(*smooth, height, mode)).grid);
  parts.untextured = smooth;
  parts.mesh = std::make_shared<const MeshSurface>(TriangleIndex::build(mesh_of(box_mesh(Vec3::Constant(2.0 * half)))));
  return std::make_shared<const ImplicitSurface>(must(ImplicitSurface::build(std::move(parts))));
}

/// Along the upper face, over the edge and down the side, at `depth` under the untextured faces, in steps of `way`.
std::vector<Vec3> path_over_edge(double depth, double way) {
  const double wall = half - depth;
  const double top = wall - 0.013;
  std::vector<Vec3> path;
  for (double s = 0.0; s <= 2.0 * top; s += way)
    path.push_back(s < top ? Vec3(0.013 + s, 0.003, wall) : Vec3(wall, 0.003, wall - (s - top)));
  return path;
}

/// Largest change of force between ticks (N).
double largest_change(const Scene& scene, double depth, double way) {
  return largest_jump(slide(scene, path_over_edge(depth, way), Vec3(0.013, 0.003, half + 0.002)));
}

TEST(ImplicitTexture, K_8_ForceOnACornerChangesWithTheStepAndNeverJumps) {
  const std::pair<const char*, PointHeight> textures[] = {{"waves", bumps(0.5 * voxel, 6.0 * voxel)},
                                                          {"gradient noise", gradient_noise(voxel, 6.0 * voxel, 4)}};
  for (const auto& [name, height] : textures) {
    for (const Redistancing mode : {Redistancing::none, Redistancing::normalised, Redistancing::redistanced}) {
      const auto surface = textured_edge(height, mode);
      // Below every groove: higher up a probe goes through the sides of bumps, and a point proxy snaps over their
      // crests wherever they are, on a corner or not.
      const double depth = 0.6 * voxel;
      const std::pair<const char*, Law> laws[] = {{"virtual-contact-point", VirtualContactPointLaw{}},
                                                  {"proxy", ProxyLaw{}}};
      for (const auto& [law, settings] : laws) {
        const Scene scene = scene_of(surface, settings);
        const double coarse = largest_change(scene, depth, 16e-6);
        const double fine = largest_change(scene, depth, 4e-6);
        const double finest = largest_change(scene, depth, 1e-6);
        std::printf("%-14s %-11s %-21s largest change %6.2f, %6.2f, %6.2f mN in 16, 4, 1 um\n", name, to_string(mode),
                    law, 1e3 * coarse, 1e3 * fine, 1e3 * finest);
        EXPECT_GT(finest, 1e-4);
        EXPECT_NEAR(coarse / fine, 4.0, 0.8) << name << " " << to_string(mode) << " " << law;
        EXPECT_NEAR(fine / finest, 4.0, 0.8) << name << " " << to_string(mode) << " " << law;
      }
      // The rival's jumps however short the step.
      const Scene rival = scene_of(surface, NormalPerturbationLaw{});
      const double fine = largest_change(rival, depth, 4e-6);
      const double finest = largest_change(rival, depth, 1e-6);
      std::printf("%-14s %-11s %-21s largest change         %6.2f, %6.2f mN in     4, 1 um\n", name, to_string(mode),
                  "normal-perturbation", 1e3 * fine, 1e3 * finest);
      EXPECT_GT(finest, 0.9 * fine);
      EXPECT_GT(finest, 0.05);
    }
  }
}

}  // namespace
}  // namespace asperity::test::implicit_texture_test
