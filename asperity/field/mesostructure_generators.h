#pragma once
// The papers' mesostructures H_0 ... H_6 (hrm-2010, Table 2), made from formulas.
//
// All answer size * size heights in metres, row 0 on top (as HeightMap::build takes them), and all tile: their right
// edge continues at their left edge and their top at their bottom. `amplitude` (m) is highest minus lowest of
// the formula; where its top is a point, the texels reach it within their spacing.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/field/height_map.h"

namespace asperity {

/// The papers' mesostructures that can be made.
enum class MesostructureKind {
  flat,      ///< H_0: one height throughout
  serrated,  ///< H_1,k: k ridges, steep vertical left side, sloping right side
  beams,     ///< H_2: raised beams crossing at right angles
  rings,     ///< H_3: gently sloping rings, peaks and holes
  warts,     ///< H_4: bumps and warts of varying sizes
  groove,    ///< H_6: engraved letter S, negative heights
};

/// What to generate.
struct MesostructureSpec {
  MesostructureKind kind = MesostructureKind::flat;
  int size = 1024;  ///< texels a side, 2 to 8192
  double amplitude =
      1e-3;       ///< m, highest minus lowest, >= 0; for `flat` the height itself (may be negative; 0 is the paper's)
  int count = 8;  ///< `serrated`: ridges k, 1 to size / 2; `beams`: beams each way, 1 to size / 4; others ignore it
  std::uint64_t seed = 1;  ///< `warts`: their places and sizes
};

/// Heights (m) of a mesostructure. Errors: bad_value naming the member and what it accepts. [build]
Result<std::vector<float>> generate_heights(const MesostructureSpec& spec);
/// The same as a map. [build]
Result<HeightMap> generate_height_map(const MesostructureSpec& spec, Wrap wrap, Reconstruction reconstruction);

/// Paper's name of a kind: "H_0", "H_1", "H_2", "H_3", "H_4", "H_6". [any]
const char* paper_name(MesostructureKind kind);
/// Kind from its name in scene files ("flat", "serrated", ...) or in the paper ("H_0", "h0"). Errors: bad_value.
/// [build]
Result<MesostructureKind> parse_mesostructure_kind(std::string_view name);

// The formulas themselves; the arguments are those that generate_heights accepts.

/// H_0: `height` (m) throughout. [build]
std::vector<float> flat_heights(int size, double height = 0.0);
/// H_1,k: within a ridge of p = size / ridges texels the height falls from `amplitude` to amplitude / p and steps up
/// again, so sampled bilinearly it has peak-to-peak amplitude (p - 1) / p. Ridges run along t. [build]
std::vector<float> serrated_heights(int size, int ridges, double amplitude);
/// H_2: `beams` beams each way, a third of their pitch wide, tops at `amplitude`, ground at 0. [build]
std::vector<float> beam_heights(int size, int beams, double amplitude);
/// H_3: ground at amplitude / 2; two rings, one around a peak and one around a hole, and a peak and a hole alone; peaks
/// and rings reach `amplitude`, holes 0; every flank is a raised cosine. [build]
std::vector<float> ring_heights(int size, double amplitude);
/// H_4: rounded bumps and steeper warts with radii from 1.5 % to 6 % of the tile, none overlapping, as high as they are
/// wide and denser in the middle of the tile (along s) than at its sides; ground at 0, the highest reaches `amplitude`.
/// [build]
std::vector<float> wart_heights(int size, double amplitude, std::uint64_t seed);
/// H_6: a letter S cut to -`amplitude` into ground at 0; flat bottom, sloping walls, clear of the borders. [build]
std::vector<float> groove_heights(int size, double amplitude);

}  // namespace asperity
