#pragma once
// Meshes, maps and coats that the tests of surface/ and render/ share.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "asperity/core/rng.h"
#include "asperity/field/mesostructure/generators.h"
#include "asperity/geometry/generators.h"
#include "asperity/surface/relief/surface.h"
#include "tests/geometry/random_meshes.h"

namespace asperity::test {

/// The value of a Result that a test relies on; ends the program with the message when there is none.
template <class T>
T must(Result<T> result) {
  if (!result) {
    ADD_FAILURE() << result.error().message();
    std::abort();
  }
  return std::move(result).value();
}

inline TriangleMesh mesh_of(MeshSource source, double scale = 1.0) {
  return must(TriangleMesh::build(std::move(source), MeshBuildSettings{scale, true}));
}

/// A map of size x size texels from a formula of the texture coordinates, in metres.
template <class F>
HeightMap map_of(int size, F&& height, Wrap wrap = Wrap::repeat,
                 Reconstruction how = Reconstruction::quadratic_bspline) {
  std::vector<float> heights;
  for (int row = 0; row < size; ++row) {
    for (int column = 0; column < size; ++column) {
      heights.push_back(static_cast<float>(height((column + 0.5) / size, (size - row - 0.5) / size)));
    }
  }
  return must(HeightMap::build(std::move(heights), size, size, wrap, how));
}

inline HeightMap flat_map(double height) {
  return map_of(4, [&](double, double) { return height; });
}

/// Smooth, and different along both axes: waves of both directions between -amplitude and amplitude (m).
inline HeightMap wavy_map(double amplitude, int size = 32, Reconstruction how = Reconstruction::quadratic_bspline) {
  return map_of(
      size,
      [&](double s, double t) {
        const double turn = 2.0 * std::numbers::pi;
        return amplitude *
               (0.5 * std::sin(turn * s) + 0.3 * std::cos(turn * (s + 2.0 * t)) + 0.2 * std::sin(turn * 2.0 * t));
      },
      Wrap::repeat, how);
}

inline std::shared_ptr<const Mesostructure> tiled(HeightMap map, double tile = 0.01) {
  return std::make_shared<const Mesostructure>(must(Mesostructure::build(std::move(map), Vec2(tile, tile))));
}

inline Coat coat_on(const TriangleMesh& mesh, HeightMap map, Mapping mapping, double tile = 0.01,
                    const Stitching& stitching = {}) {
  return must(Coat::build(mesh, tiled(std::move(map), tile), CoatSettings{mapping, Vec2::Ones(), stitching}));
}

inline std::shared_ptr<const MeshSurface> bare(MeshSource source, double scale = 1.0) {
  return std::make_shared<const MeshSurface>(TriangleIndex::build(mesh_of(std::move(source), scale)));
}

inline std::shared_ptr<const ReliefSurface> coated(MeshSource source, HeightMap map, Mapping mapping,
                                                   double tile = 0.01, double scale = 1.0,
                                                   const Stitching& stitching = {}) {
  TriangleMesh mesh = mesh_of(std::move(source), scale);
  Coat coat = coat_on(mesh, std::move(map), mapping, tile, stitching);
  return std::make_shared<const ReliefSurface>(MeshSurface(TriangleIndex::build(std::move(mesh))), std::move(coat));
}

/// Barycentric coordinates inside a triangle, each at least `margin`.
inline Vec3 random_barycentric(Rng& rng, double margin = 0.0) {
  double u = rng.uniform();
  double v = rng.uniform();
  if (u + v > 1.0) {
    u = 1.0 - u;
    v = 1.0 - v;
  }
  return Vec3::Constant(margin) + (1.0 - 3.0 * margin) * Vec3(1.0 - u - v, u, v);
}

inline Vec3 point_on(const TriangleMesh& mesh, std::uint32_t face, const Vec3& barycentric) {
  const auto [a, b, c] = mesh.corners(face);
  return barycentric[0] * a + barycentric[1] * b + barycentric[2] * c;
}

inline std::uint32_t random_face(Rng& rng, const TriangleMesh& mesh) {
  return rng.below(static_cast<std::uint32_t>(mesh.triangles().size()));
}

}  // namespace asperity::test
