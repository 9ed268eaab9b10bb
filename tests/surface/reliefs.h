#pragma once
// Reliefs that the tests compare with brute force: dense meshes of the displaced surface, and how far off those are.

#include <algorithm>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "tests/surface/coats.h"

namespace asperity::test {

/// A relief whose faces wear the given maps in turn.
inline std::shared_ptr<const ReliefSurface> relief_on(TriangleMesh mesh,
                                                      std::vector<std::shared_ptr<const Mesostructure>> maps,
                                                      const CoatSettings& settings) {
  std::vector<std::uint8_t> map_of_face;
  if (maps.size() > 1) {
    for (std::size_t face = 0; face < mesh.triangles().size(); ++face)
      map_of_face.push_back(static_cast<std::uint8_t>(face % maps.size()));
  }
  Coat coat = must(Coat::build(mesh, std::move(maps), std::move(map_of_face), settings));
  return std::make_shared<const ReliefSurface>(MeshSurface(TriangleIndex::build(std::move(mesh))), std::move(coat));
}

/// Three unlike reliefs of the same amplitude (m): what neighbouring faces disagree about.
inline std::vector<std::shared_ptr<const Mesostructure>> unlike_maps(
    double amplitude, double tile = 0.01, Reconstruction how = Reconstruction::quadratic_bspline) {
  const double turn = 2.0 * std::numbers::pi;
  const HeightMap stripes = map_of(
      16, [=](double s, double t) { return amplitude * std::sin(turn * (s - t) + 0.7); }, Wrap::repeat, how);
  return {tiled(wavy_map(amplitude, 16, how), tile), tiled(flat_map(0.6 * amplitude), tile), tiled(stripes, tile)};
}

/// A cone of `count` narrow triangles: one vertex of high valence, open at its base.
inline MeshSource cone(int count, double radius, double height) {
  MeshSource source;
  source.positions.emplace_back(0.0, 0.0, height);
  for (int i = 0; i < count; ++i) {
    const double a = 2.0 * std::numbers::pi * i / count;
    source.positions.emplace_back(radius * std::cos(a), radius * std::sin(a), 0.0);
  }
  for (int i = 0; i < count; ++i) {
    source.triangles.push_back({0, static_cast<std::uint32_t>(1 + i), static_cast<std::uint32_t>(1 + (i + 1) % count)});
  }
  return source;
}

/// Meshes that have all that a shell finds hard: open, closed, concave, of high valence, graded, with slivers.
inline constexpr int kinds_of_base = 9;
inline MeshSource base_of_kind(int kind, std::uint64_t seed) {
  switch (kind) {
    case 0: return icosphere(1, 0.02);
    case 1: return random_closed_mesh(seed, 2, 0.02, 0.15);
    case 2: return trial_mesh_a({4, 4, 0.01});
    case 3: return trial_mesh_b(std::numbers::pi / 12.0, {4, 4, 0.01});
    case 4: return trial_mesh_c({4, 6, 0.01});
    case 5: return trial_mesh_e(3, std::numbers::pi / 2.0, 0.01);
    case 6: return cone(40, 0.02, 0.008);
    case 7: return trial_mesh_f(12, 0.01);
    default: return plane_grid(0.04, 2e-4, 20, 1);
  }
}

/// The displaced surface as a mesh, and how far the surface is from it at most.
struct Tessellation {
  TriangleIndex index;
  double error = 0.0;  // m
};

/// Every face cut into n x n triangles with their corners on the relief; neighbours share those on their edge.
inline Tessellation dense_net(const ReliefSurface& surface, int n) {
  const TriangleMesh& base = surface.base().mesh();
  MeshSource source;
  std::map<std::array<std::uint32_t, 3>, std::uint32_t> shared;
  double off = 0.0;
  const auto faces = static_cast<std::uint32_t>(base.triangles().size());
  for (std::uint32_t face = 0; face < faces; ++face) {
    const ReliefFrame frame = surface.frame(face);
    const TriangleMesh::Triangle& t = base.triangles()[face];
    const auto at = [&](double i, double j) { return surface.point(frame, i / n, j / n).point; };
    std::vector<std::uint32_t> numbers;
    const auto number = [&](int i, int j) -> std::uint32_t {
      const auto next = static_cast<std::uint32_t>(source.positions.size());
      const int weights[3] = {n - i - j, i, j};
      // Named by its edge (or vertex) and how far it is from the end with the lesser number.
      std::array<std::uint32_t, 3> name{no_index, no_index, 0};
      for (std::size_t k = 0; k < 3; ++k) {
        if (weights[k] == n) name = {t[k], t[k], 0};
        const std::size_t one = (k + 1) % 3;
        const std::size_t other = (k + 2) % 3;
        if (weights[k] != 0 || weights[one] == 0 || weights[other] == 0) continue;
        const bool ordered = t[one] < t[other];
        name = {std::min(t[one], t[other]), std::max(t[one], t[other]),
                static_cast<std::uint32_t>(ordered ? weights[other] : weights[one])};
      }
      if (name[0] != no_index) {
        const auto [where, fresh] = shared.emplace(name, next);
        if (!fresh) return where->second;
      }
      source.positions.push_back(at(i, j));
      return next;
    };
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i + j <= n; ++i) numbers.push_back(number(i, j));
    }
    const auto row = [n](int j) { return static_cast<std::size_t>(j * (n + 1) - j * (j - 1) / 2); };
    // (i, j) is the middle of the triangle's longest side in (u, v), where a quadratic surface is farthest from it.
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, int side, double i, double j) {
      source.triangles.push_back({a, b, c});
      const Vec3 p[3] = {source.positions[a], source.positions[b], source.positions[c]};
      const double third = side == 1 ? 1.0 / 6.0 : -1.0 / 6.0;
      off = std::max({off, (at(i, j) - 0.5 * (p[side] + p[2])).norm(),
                      (at(i - third, j - third) - (p[0] + p[1] + p[2]) / 3.0).norm()});
    };
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i + j < n; ++i) {
        const std::uint32_t a = numbers[row(j) + static_cast<std::size_t>(i)];
        const std::uint32_t b = numbers[row(j) + static_cast<std::size_t>(i) + 1];
        const std::uint32_t c = numbers[row(j + 1) + static_cast<std::size_t>(i)];
        add(a, b, c, 1, i + 0.5, j + 0.5);
        if (i + j + 1 == n) continue;
        add(b, numbers[row(j + 1) + static_cast<std::size_t>(i) + 1], c, 0, i + 0.5, j + 0.5);
      }
    }
  }
  // The other two sides' middles are as near on the whole; the rest is room.
  return {TriangleIndex::build(mesh_of(std::move(source))), 2.0 * off};
}

/// Depth of p under a closed mesh (m): above 0 inside.
inline double depth_inside(const TriangleIndex& index, const Vec3& p) {
  const Foot foot = index.closest(p, infinity);
  const TriangleMesh& mesh = index.mesh();
  const Vec3 offset = p - foot.point;
  // At an edge or vertex the angle-weighted normal of all faces there decides.
  Vec3 normal = Vec3::Zero();
  int zeros = 0;
  for (int k = 0; k < 3; ++k) zeros += foot.at[k] < 1e-9 ? 1 : 0;
  if (zeros == 0) {
    normal = mesh.face_normal(foot.element);
  } else {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t vertex = mesh.triangles()[foot.element][static_cast<std::size_t>(k)];
      if (zeros == 2 && foot.at[k] > 0.5) normal = mesh.vertex_normal(vertex);
      const std::uint32_t across = mesh.neighbour(foot.element, (k + 1) % 3);
      if (zeros == 1 && foot.at[k] < 1e-9 && across != no_index)
        normal = mesh.face_normal(foot.element) + mesh.face_normal(across);
    }
  }
  return offset.dot(normal) < 0.0 ? foot.distance : -foot.distance;
}

}  // namespace asperity::test
