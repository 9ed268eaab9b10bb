#pragma once
// The papers' mesostructures H_0 ... H_7 (hrm-2010, Table 2), made from formulas.
//
// All answer size * size heights in metres, row 0 on top (as HeightMap::build takes them), and all tile: their right
// edge continues at their left edge and their top at their bottom. The amplitude (m) is highest minus lowest of the
// formula; where its top is a point, the texels reach it within their spacing. Widths and radii are shares of the tile.

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/field/height/map.h"

namespace asperity {

/// The papers' mesostructures.
enum class MesostructureKind {
  /// H_0: one height throughout.
  flat,
  /// H_1,k: k ridges along t, steep left side, sloping right side. With a vertical left side a ridge of
  /// p = size / count texels falls from the amplitude to amplitude / p and steps up again: sampled bilinearly it has
  /// the peak-to-peak amplitude (p - 1) / p.
  serrated,
  /// H_2: raised beams crossing at right angles; tops at the amplitude, ground at 0.
  beams,
  /// H_3: gently sloping rings, peaks and holes on a ground at half the amplitude; every flank is a raised cosine.
  /// Peaks and rings reach the amplitude, holes 0. Without a `number` the tile holds a ring around a hole, a ring
  /// around a peak, a peak and a hole in a fixed arrangement; with one, so many of the four in turn at seeded places,
  /// without overlap.
  rings,
  /// H_4: rounded bumps and steeper warts, none overlapping, as high as they are wide and denser in the middle of the
  /// tile (along s) than at its sides; ground at 0, the widest reaches the amplitude.
  warts,
  /// H_5: raised flat cylinders "like a coin" lying about, a later one over an earlier one where they overlap, as high
  /// as the amplitude; ground at 0. With a lower `field` they are struck: a rim at the amplitude around the flat field,
  /// on the field a cross half as high as the rim over it.
  coins,
  /// H_6: a letter S cut to minus the amplitude into ground at 0; flat bottom, raised-cosine walls, clear of all
  /// borders.
  groove,
  /// H_7: a mountain range: octaves of smooth noise, each half as wide as the one before and 2^-hurst as high, the
  /// coarsest with two cells a side. The lowest valley is at 0, the highest peak at the amplitude.
  fractal,
};
/// As in scene files, beside the papers' own (paper_name).
template <>
struct Names<MesostructureKind> {
  static constexpr auto table = std::to_array<Named<MesostructureKind>>({{MesostructureKind::flat, "flat"},
                                                                         {MesostructureKind::serrated, "serrated"},
                                                                         {MesostructureKind::beams, "beams"},
                                                                         {MesostructureKind::rings, "rings"},
                                                                         {MesostructureKind::warts, "warts"},
                                                                         {MesostructureKind::coins, "coins"},
                                                                         {MesostructureKind::groove, "groove"},
                                                                         {MesostructureKind::fractal, "fractal"}});
};

/// Smallest and largest of something (shares of the tile).
struct ShareRange {
  double low = 0.0;
  double high = 0.0;
};

/// What to generate. A member that a kind does not take (parameters_of) is ignored; one without a value stands for the
/// kind's own (completed).
struct MesostructureSpec {
  MesostructureKind kind = MesostructureKind::flat;
  int size = 1024;  ///< texels a side, 2 to 8192
  double amplitude =
      1e-3;       ///< m, highest minus lowest, >= 0; for `flat` the height itself (may be negative; 0 is the paper's)
  int count = 8;  ///< `serrated`: ridges k, 1 to size / 2; `beams`: beams each way, 1 to size / 4
  std::uint64_t seed = 1;  ///< `rings` with a number, `warts`, `coins`, `fractal`: the same seed, the same map
  /// How many there are. `rings`: 1 to 64, own: the fixed arrangement; `warts`: 1 to 2000, own: as many as 600 trials
  /// place; `coins`: 1 to 200, own: 5. It is an error when they find no place.
  std::optional<int> number = std::nullopt;
  /// `serrated`: share of a ridge that its left side takes, 0 (vertical: one texel) to 0.5 (both sides alike).
  double wall = 0.0;
  /// `beams`: share of their pitch, own: 1/3; beams and gaps are at least a texel wide. `groove`: of the stroke, 0.005
  /// to 0.2, own: 0.08.
  std::optional<double> width = std::nullopt;
  /// `coins`: of each edge, 0 (vertical: one texel) to half of the narrowest rim or flat coin, own: 0. `groove`: of
  /// each wall, 0 to half of the width, own: a quarter of the width.
  std::optional<double> flank = std::nullopt;
  /// `warts`: own: 0.015 to 0.06; `coins`: own: 0.09 to 0.15; both within 0.001 to 0.25. `groove`: of both bows of the
  /// S (low = high), 0.05 to 0.24 less a quarter of the width, own: 0.16.
  std::optional<ShareRange> radius = std::nullopt;
  /// `coins` with a field below 1: width of the rim, share of the radius, 0.02 to 0.5, own: 0.12. An error on flat
  /// ones.
  std::optional<double> rim = std::nullopt;
  double field = 1.0;  ///< `coins`: height of the field, share of the amplitude, 0 to 1; 1: the paper's flat cylinders
  double overlap = 0.2;  ///< `coins`: how far two may overlap, share of the sum of their radii, 0 to 0.9
  double hurst = 0.8;    ///< `fractal`: Hurst exponent, 0.05 (rugged) to 1 (smooth)
  /// `fractal`: 1 to log2(size / 2), so that the finest cells have two texels; own: one fewer.
  std::optional<int> octaves = std::nullopt;
};

/// Names of the members besides kind, size and amplitude that a kind takes; scene files call them the same. [any]
std::span<const std::string_view> parameters_of(MesostructureKind kind);

/// The spec with the kind's own values where it has none; the number of `rings` and `warts` may stay open. [any]
MesostructureSpec completed(MesostructureSpec spec);

/// Heights (m) of a mesostructure. Errors: bad_value naming the member and what it accepts. [build]
Result<std::vector<float>> generate_heights(const MesostructureSpec& spec);
/// The same as a map. [build]
Result<HeightMap> generate_height_map(const MesostructureSpec& spec, Wrap wrap = Wrap::repeat,
                                      Reconstruction reconstruction = Reconstruction::quadratic_bspline);

/// Paper's name of a kind: "H_0" to "H_7". [any]
const char* paper_name(MesostructureKind kind);
/// Kind from its name in scene files ("flat", "serrated", ...) or in the paper ("H_0", "h0"). Errors: bad_value.
/// [build]
Result<MesostructureKind> parse_mesostructure_kind(std::string_view name);

}  // namespace asperity
