#pragma once
// What of a relief decides whether it can be felt: how high, how wide, how sharp. Measured on the reconstruction.

#include <array>
#include <cstddef>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/field/height/map.h"
#include "asperity/field/height/surface_features.h"
#include "asperity/geometry/mesh.h"
#include "asperity/surface/coat.h"

namespace asperity {

/// Radii of the convex places of a relief (m): 1 over the larger principal value of minus its matrix of second
/// derivatives. Where the relief slopes by g it is rounder than that, by up to (1 + g^2)^1.5; crests do not slope.
struct CrestRadii {
  /// percentiles[i]: i percent of the convex places are sharper. All infinite where nothing is convex.
  std::array<double, 101> percentiles;
  double convex_share = 0.0;  ///< of all places, 0 to 1

  CrestRadii() { percentiles.fill(infinity); }
  [[nodiscard]] double smallest() const noexcept { return percentiles[0]; }
  [[nodiscard]] double sharpest_percent() const noexcept { return percentiles[1]; }
  [[nodiscard]] double median() const noexcept { return percentiles[50]; }
  /// Share of all places that are convex and sharper than `radius` (m), 0 to 1. [any]
  [[nodiscard]] double share_sharper(double radius) const noexcept;
};

/// A relief in the numbers that renderability rests on.
struct ReliefShape {
  double lowest = 0.0;   ///< m
  double highest = 0.0;  ///< m
  /// m: twice the mean run above or below the middle height, whichever is shorter, along whichever axis it is shorter.
  /// A wave's length; twice the width of a groove. The middle lies between the 1st and the 99th percentile, and less
  /// than 15 % of their distance is no crossing.
  double wave = 0.0;
  /// m: 2 pi times rms slope over rms curvature, along whichever axis it is shorter: the wave that makes the crests.
  double finest_wave = 0.0;
  CrestRadii crests;
  double step = 0.0;   ///< between the levels of the map it came from (m); 0: none
  double texel = 0.0;  ///< of that map, on the surface (m); 0: a formula

  [[nodiscard]] double range() const noexcept { return highest - lowest; }              ///< m
  [[nodiscard]] double amplitude() const noexcept { return 0.5 * (highest - lowest); }  ///< c of D5 (m)
};

/// R of D5: lambda^2 / (4 pi^2 c), the crest of c cos(2 pi x / lambda). Infinite for c = 0. [any]
double cosine_crest_radius(double wavelength, double amplitude) noexcept;
/// c cos(2 pi x / lambda) by formula. [any]
ReliefShape cosine_shape(double wavelength, double amplitude) noexcept;

/// The same relief `height` times as high and `width` times as wide (both above 0); exact but for rounding. [any]
ReliefShape scaled(const ReliefShape& shape, double height, double width) noexcept;

/// Of a map whose one repeat has the size `tile` (m, above 0). At most 512 x 512 places are looked at for crests, at
/// most 512 rows and columns for waves, evenly spread. Where the reconstruction has creases in place of second
/// derivatives (bilinear, nearest) they are the texels' second differences. [build]
ReliefShape measure_shape(const HeightMap& map, const Vec2& tile);

/// Of a coat with the size that its texels really have on the mesh: crests from 65536 places spread by area, layers
/// included, each with its own face's texel; waves of the first map, with the median texel. [build]
ReliefShape measure_shape(const TriangleMesh& mesh, const Coat& coat);

/// Of the sum of features over their plane: formulas for one grating, circular grating or grid; others are baked with
/// 16 texels a wave over the longest ones' repeats, and 1024 texels a side at most, so that edges of ridges count as
/// round as a texel. Errors: bad_value (no feature). [build]
Result<ReliefShape> measure_shape(const std::vector<SurfaceFeature>& features);

/// Relief against the triangles that carry it (hrm-2010, section 5.4.1: surface variation beyond 15 % of the edge is
/// for a finer mesh).
struct BaseMeshAdvice {
  double mean_edge = 0.0;       ///< of the mesh (m)
  double range = 0.0;           ///< of the coat (m)
  double share_of_faces = 0.0;  ///< 0 to 1: their own relief exceeds 15 % of their own mean edge
  double largest_ratio = 0.0;   ///< the largest of those ratios
  double height_allowed = 0.0;  ///< range at which 15 % of the mean edge is met on the same mesh (m)
  bool exceeded = false;        ///< range over mean edge is above 15 %, or it is on a twentieth of the faces
  int subdivisions = 0;         ///< each halves the edges; 0: none needed, or none of 10 helps
  double edge_needed = 0.0;     ///< mean edge after them (m); 0: none helps, the relief has walls
  double residual = 0.0;        ///< range that is left to the coat then (m)
  std::size_t triangles = 0;    ///< after them
};
/// The rule itself: 15 %. [any]
inline constexpr double largest_relief_over_edge = 0.15;

/// What a finer base mesh would have to be. It carries the relief at its vertices, and its coat what is left: the 99th
/// percentile of the relief's distance from straight chords as long as an edge, twice. [build]
BaseMeshAdvice advise_base_mesh(const TriangleMesh& mesh, const Coat& coat);

}  // namespace asperity
