#pragma once
// Rows of rays: pictures cast on reliefs themselves, and by Embree on triangles as fine as their maps.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/result.h"

namespace asperity::bench {

/// How fast one of the two answers the rays of a picture.
struct RaySpeed {
  double rays_a_second = 0.0;  ///< of the median of several pictures, by the thread's own time
  double hit_share = 0.0;      ///< of all rays
  double worst = 0.0;          ///< ns: the slowest ray, each taken at its least over the pictures
};

/// A picture of one body.
struct RayRow {
  std::string body;
  std::size_t faces = 0;    ///< of its base
  double texel = 0.0;       ///< m, of its map on the base
  std::size_t rays = 0;     ///< of the picture
  double both_share = 0.0;  ///< of all rays: those that hit in both

  RaySpeed relief;
  std::size_t relief_bytes = 0;       ///< coat, base, search structure and shell
  double relief_build_seconds = 0.0;  ///< and reading of its files, where it has some

  RaySpeed embree;
  std::size_t triangles = 0;
  double texels_an_edge = 0.0;     ///< edges of the triangles, in the mean
  bool capped = false;             ///< triangles of about one texel would be more than the most
  std::size_t triangle_bytes = 0;  ///< vertices and indices
  std::size_t embree_bytes = 0;    ///< those and Embree's tree, as its memory monitor counts
  double cut_seconds = 0.0;        ///< evaluating the relief at the vertices
  double embree_build_seconds = 0.0;

  double difference_p50 = 0.0;  ///< m, between the distances of the hits of one ray
  double difference_p99 = 0.0;  ///< m
  double flatness_p50 = 0.0;    ///< m, from the middle of a triangle to the relief at the same place of the base
  double flatness_p99 = 0.0;    ///< m
};

/// Of what, and how many.
struct RayEffort {
  int width = 240;   ///< pixels
  int height = 160;  ///< pixels
  int pictures = 5;  ///< the two take turns
  std::size_t most_triangles = std::size_t{8} << 20U;
  int map_size = 256;          ///< texels a side, on the sphere
  bool sphere_alone = false;   ///< no data
  std::filesystem::path data;  ///< meshes/, textures/
  std::string only;            ///< bodies whose name holds this text; empty: all
};

/// A displaced sphere, and meshes with maps; `told` hears of each as it is done, or skipped because its files are
/// missing. Errors: of scenes. [build]
Result<std::vector<RayRow>> measure_rays(const RayEffort& effort, double clock_cost,
                                         const std::function<void(std::string_view)>& told);

/// As a table; empty without rows. [build]
std::string rays_text(const std::vector<RayRow>& rows);

/// What does not hold, one sentence each: nothing hit, or distances that differ by more than triangles are flat.
/// [build]
std::vector<std::string> ray_failures(const std::vector<RayRow>& rows);

}  // namespace asperity::bench
