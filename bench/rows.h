#pragma once
// The groups of rows, one mesh each.

#include <cstdint>
#include <string>
#include <vector>

#include "asperity/core/progress.h"
#include "asperity/core/result.h"
#include "bench/measure.h"

namespace asperity::bench {

// Names of rows that ratios are made of.
inline constexpr const char* god_object_point = "god-object, point";
inline constexpr const char* god_object_radius = "god-object, 1 mm radius";
inline constexpr const char* closest_coherent = "closest(), patch, 3 mm bound";
inline constexpr const char* closest_anew = "closest(), no patch, infinite bound";
inline constexpr const char* embree_infinite = "Embree, infinite start radius";
inline constexpr const char* embree_bounded = "Embree, 3 mm start radius";

inline constexpr const char* proxy_cosine = "proxy, cosine, UVs";
inline constexpr const char* proxy_inside = "proxy, per face, inside a face";
inline constexpr const char* proxy_edge = "proxy, per face, along an edge";

inline constexpr const char* bare_contact = "contact alone, no friction";

inline constexpr const char* contact_point_friction = "virtual contact point, friction, smooth";

inline constexpr const char* mesh_refit = "mesh, vertices moved";
inline constexpr const char* mesh_refit_alone = "mesh, vertices moved, one thread";
inline constexpr const char* mesh_rebuild = "mesh, built anew";
inline constexpr const char* relief_refit = "relief, vertices moved";
inline constexpr const char* relief_rebuild = "relief, built anew";

/// What a part of the tick costs on top of the rest, the median of differences taken in turn.
struct Extra {
  std::string what;
  double nanoseconds = 0.0;
  double owed = 0.0;  ///< at most (ns)
};

/// What was measured on one mesh.
struct Group {
  std::string kind;  ///< "mesh", "relief", "volume", "potential", "fine", "formula" or "refit"
  std::size_t triangles = 0;
  std::uint32_t resolution = 0;       ///< of a volume: samples along each axis
  double mesh_build_seconds = 0.0;    ///< welding, checks, adjacency, normals
  double search_build_seconds = 0.0;  ///< our hierarchy
  double embree_build_seconds = 0.0;  ///< 0 where Embree takes no part
  double bytes_per_triangle = 0.0;    ///< mesh (UVs included) and search structure; without coat
  std::size_t coat_bytes = 0;         ///< heights, shell directions and bands; 0 without a coat
  double largest_disagreement = 0.0;  ///< m, between our distance and Embree's over the whole slide
  std::vector<RowResult> rows;
  std::vector<Extra> on_top;  ///< of "fine"

  /// "1280 triangles", "128^3 samples", "one sphere".
  [[nodiscard]] std::string size() const;
  /// The row of that name, or nullptr.
  [[nodiscard]] const RowResult* row(const std::string& name) const;
};

/// An icosphere of 20 * 4^subdivisions triangles as it is: god-object, the proxy law with friction, closest point,
/// Embree. [build]
Result<Group> measure_mesh(int subdivisions, const Effort& effort, double clock_cost);

/// The same mesh with coats of map_size x map_size texels, by six charts of UVs and triplanar: the cosine of the relief
/// test (0.30 mm from trough to crest, 4.9 mm long) and H_1 with its walls; proxy law with friction 0.3 / 0.2, sliding
/// and at rest, and the consistent forms of Algorithms 1 and 2. On the two coarsest meshes also near an edge against
/// inside a face. [build]
Result<Group> measure_relief(int subdivisions, int map_size, const Effort& effort, double clock_cost);

/// A sphere of 50 mm, slightly wavy, as the isosurface of count^3 samples over a cube of 120 mm: the proxy law with
/// friction 0.3 / 0.2, cross-uncross and avila, and the search for a crossing alone. [build]
Result<Group> measure_volume(std::uint32_t count, const Effort& effort, double clock_cost);

/// The same mesh as a potential on voxels of 0.78 mm, 128 across, whatever the count of its triangles: the virtual
/// contact point with and without friction and as printed, the proxy law, and the sampling alone. [build]
Result<Group> measure_potential(int subdivisions, const Effort& effort, double clock_cost);

/// The same mesh felt by its proxy alone, and with friction and texture as forces of their own on top: what they cost
/// is measured against the bare contact in turn, a few ticks each, on the same slide. [build]
Result<Group> measure_fine(int subdivisions, const Effort& effort, double clock_cost);

/// The same sphere as a parametric surface and as a program's own, which tells value and gradient, or also how much it
/// bends: the proxy law without friction and with 0.3 / 0.2. [build]
Result<Group> measure_formula(const Effort& effort, double clock_cost);

/// What moving all vertices costs, in place of one update: a sheet of about so many triangles, bare and with a coat of
/// 256 x 256 texels by triplanar mapping, refitted and built anew. [build]
Result<Group> measure_refit(std::uint32_t triangles, const Effort& effort, double clock_cost);

}  // namespace asperity::bench
