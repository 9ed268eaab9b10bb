#pragma once
// A relief as plain geometry: the displaced surface cut into small flat triangles (haptic-textures-2005, 3.1).

#include <cstddef>

#include "asperity/surface/relief/surface.h"

namespace asperity {

/// Bound on the triangles of a tessellation.
inline constexpr std::size_t most_tessellated_triangles = 4'194'304;
/// Bound on those of one whose fineness is chosen for the user: half a gigabyte is nobody's default.
inline constexpr std::size_t most_chosen_triangles = 500'000;

/// Corner (i, j) of the grid that cuts a triangle `subdivisions` times along each edge, in the barycentric coordinates
/// of its second and third corner; i + j <= subdivisions. [servo]
inline Vec2 grid_place(int i, int j, int subdivisions) noexcept {
  return {static_cast<double>(i) / subdivisions, static_cast<double>(j) / subdivisions};
}

/// The relief with every triangle of its base cut into subdivisions^2, each corner on the displaced surface. Corners
/// on edges and vertices of the base are one vertex, so that the mesh is closed and oriented where the base is; where
/// heights of neighbouring faces differ there (no blend), it is the mean of their places. Triangle f of the base
/// becomes triangles f * subdivisions^2 and the following, unless some had no area. No UVs.
/// Errors: bad_value (subdivisions below 1), too_large (more than most_tessellated_triangles). [build]
Result<TriangleMesh> tessellate(const ReliefSurface& surface, int subdivisions);

/// How often edges are to be cut for triangles of about one texel; less where that would be more than
/// most_chosen_triangles. At least 1. [build]
int texel_subdivisions(const ReliefSurface& surface);

}  // namespace asperity
