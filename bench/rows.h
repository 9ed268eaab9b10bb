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

/// What was measured on one mesh.
struct Group {
  std::string kind;  ///< "mesh" or "relief"
  std::size_t triangles = 0;
  double mesh_build_seconds = 0.0;    ///< welding, checks, adjacency, normals
  double search_build_seconds = 0.0;  ///< our hierarchy
  double embree_build_seconds = 0.0;  ///< 0 where Embree takes no part
  double bytes_per_triangle = 0.0;    ///< mesh (UVs included) and search structure; without coat
  std::size_t coat_bytes = 0;         ///< heights; 0 without a coat
  double largest_disagreement = 0.0;  ///< m, between our distance and Embree's over the whole slide
  std::vector<RowResult> rows;

  /// The row of that name, or nullptr.
  [[nodiscard]] const RowResult* row(const std::string& name) const;
};

/// An icosphere of 20 * 4^subdivisions triangles as it is: god-object, closest point, Embree. [build]
Result<Group> measure_mesh(int subdivisions, const Effort& effort, double clock_cost);

/// The same mesh with an H_3 coat of map_size x map_size texels and 1 mm, laid on by longitude and latitude so that
/// every mesh wears the same relief, and triplanar: height-field and mesostructure law. [build]
Result<Group> measure_relief(int subdivisions, int map_size, const Effort& effort, double clock_cost);

}  // namespace asperity::bench
