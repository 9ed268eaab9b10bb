#pragma once
// Meshes for tests that no modeller would be proud of: open, non-manifold, with duplicated vertices and slivers.

#include <cmath>

#include "asperity/core/rng.h"
#include "asperity/geometry/generators.h"
#include "asperity/geometry/mesh.h"
#include "asperity/geometry/mesh_refitter.h"

namespace asperity::test {

inline Vec3 random_point(Rng& rng, double size) {
  return {rng.uniform(-size, size), rng.uniform(-size, size), rng.uniform(-size, size)};
}

inline Vec3 random_direction(Rng& rng) {
  for (;;) {
    const Vec3 v = random_point(rng, 1.0);
    const double length = v.norm();
    if (length > 0.1 && length <= 1.0) return v / length;
  }
}

/// Unrelated triangles in a cube of half-width 1, of many sizes; every fourth a sliver with an aspect of up to 1e5.
inline MeshSource random_soup(std::uint64_t seed, std::uint32_t triangles) {
  Rng rng(seed);
  MeshSource source;
  for (std::uint32_t i = 0; i < triangles; ++i) {
    const double size = std::pow(10.0, rng.uniform(-3.0, 0.0));
    const Vec3 centre = random_point(rng, 1.0);
    for (int corner = 0; corner < 3; ++corner) source.positions.push_back(centre + random_point(rng, size));
    if (i % 4 == 3) {
      const std::size_t last = source.positions.size() - 1;
      const Vec3 along = source.positions[last - 1] - source.positions[last - 2];
      const double width = std::pow(10.0, rng.uniform(-5.0, -1.0));
      source.positions[last] =
          source.positions[last - 2] + rng.uniform() * along + random_point(rng, width * along.norm());
    }
    source.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return source;
}

/// Triangles over a few shared vertices: edges with many triangles, every vertex non-manifold, planes through planes.
inline MeshSource random_tangle(std::uint64_t seed, std::uint32_t vertices, std::uint32_t triangles) {
  Rng rng(seed);
  MeshSource source;
  for (std::uint32_t i = 0; i < vertices; ++i) source.positions.push_back(random_point(rng, 1.0));
  for (std::uint32_t i = 0; i < triangles; ++i) {
    source.triangles.push_back({rng.below(vertices), rng.below(vertices), rng.below(vertices)});
  }
  source.triangles.push_back({0, 1, 2});  // so that at least one triangle has an area
  return source;
}

/// Every triangle with three vertices of its own, as an STL file holds them.
inline MeshSource unwelded(const MeshSource& source) {
  MeshSource apart;
  for (const auto& triangle : source.triangles) {
    const auto first = static_cast<std::uint32_t>(apart.positions.size());
    for (const std::uint32_t corner : triangle) apart.positions.push_back(source.positions[corner]);
    apart.triangles.push_back({first, first + 1, first + 2});
  }
  apart.corner_uvs = source.corner_uvs;
  return apart;
}

/// The mesh without about one triangle in `one_in`: holes and loose ends.
inline MeshSource with_holes(MeshSource source, std::uint64_t seed, std::uint32_t one_in) {
  Rng rng(seed);
  MeshSource open;
  open.positions = std::move(source.positions);
  for (const auto& triangle : source.triangles) {
    if (open.triangles.empty() || rng.below(one_in) != 0) open.triangles.push_back(triangle);
  }
  return open;
}

/// The kinds of mesh that a search structure must answer for exactly, by number.
inline constexpr int kinds_of_mesh = 8;
inline MeshSource mesh_of_kind(int kind, std::uint64_t seed) {
  switch (kind) {
    case 0: return random_closed_mesh(seed, 3, 1.0, 0.5);
    case 1: return with_holes(random_closed_mesh(seed, 3, 1.0, 0.3), seed, 4);
    case 2: return unwelded(random_closed_mesh(seed, 2, 1.0, 0.3));
    case 3: return random_soup(seed, 300);
    case 4: return random_tangle(seed, 24, 200);
    case 5: return plane_grid(2.0, 1e-4, 200, 1);  // slivers side by side
    case 6: return trial_mesh_c({6, 12, 0.2});
    default: return trial_mesh_f(24, 0.1);  // sizes over three decades
  }
}

/// The same triangles at the same places in a tree that was cut for a squeezed mesh.
inline TriangleIndex otherwise_cut(const TriangleMesh& mesh, SearchStructure structure = SearchStructure::bvh) {
  std::vector<Vec3> squeezed;
  for (const Vec3& p : mesh.positions()) squeezed.emplace_back(0.2 * p.x() + 0.3 * p.z(), 3.0 * p.y(), p.z());
  MeshRefitter refitter(TriangleIndex::build(mesh.moved(squeezed).value(), structure));
  return refitter.moved(mesh.positions()).value();
}

/// Three closed blobs of a size through one another.
inline MeshSource overlapping_blobs(Rng& rng, double size) {
  MeshSource source = random_closed_mesh(rng.next(), 3, size, 0.2);
  for (int more = 0; more < 2; ++more) {
    const MeshSource other = random_closed_mesh(rng.next(), 3, size, 0.2);
    const auto first = static_cast<std::uint32_t>(source.positions.size());
    const Vec3 aside = 0.2 * size * random_direction(rng);
    for (const Vec3& p : other.positions) source.positions.emplace_back(p + aside);
    for (const auto& [a, b, c] : other.triangles) source.triangles.push_back({first + a, first + b, first + c});
  }
  source.corner_uvs.clear();
  return source;
}

/// Leads a probe about at random, in and out of what lies `radius` around the origin, by 0.2 mm.
inline void wander(Rng& rng, double radius, Vec3& probe, Vec3& heading) {
  if (rng.below(30) == 0)
    heading = (random_direction(rng) - 20.0 * (probe.norm() - radius) * probe.normalized()).normalized();
  probe += 2e-4 * heading;
}

}  // namespace asperity::test
