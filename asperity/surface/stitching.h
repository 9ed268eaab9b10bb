#pragma once
// How reliefs of neighbouring faces are joined: weights that sum to one over the faces around (formulation D3).

#include <cstdint>
#include <limits>
#include <vector>

#include "asperity/core/math.h"
#include "asperity/core/names.h"
#include "asperity/core/result.h"
#include "asperity/geometry/mesh.h"
#include "asperity/surface/shell.h"

namespace asperity {

/// Weight over the band around an edge, as a function of t from 0 (outside) to 1 (inside).
///   none      a step: heights that differ at an edge keep their jump
///   linear    t          s_shape  3 t^2 - 2 t^3          quintic  6 t^5 - 15 t^4 + 10 t^3, C2
///   image     weights given at evenly spaced t
enum class Blend { none, linear, s_shape, quintic, image };
/// As in scene files; `image` is told by its weights.
template <>
struct Names<Blend> {
  static constexpr auto table = std::to_array<Named<Blend>>(
      {{Blend::none, "none"}, {Blend::linear, "linear"}, {Blend::s_shape, "s_shape"}, {Blend::quintic, "quintic"}});
};

/// What the join does to the base mesh's own folds.
enum class FoldMode {
  keep,    ///< heights are blended, over the base's own folds, which stay
  round,   ///< penetrations are blended: within the band the fold becomes round
  fillet,  ///< concave folds get a fillet in place: a ball of `fillet_radius` rests on the faces; convex ones stay
};
/// As in scene files.
template <>
struct Names<FoldMode> {
  static constexpr auto table = std::to_array<Named<FoldMode>>(
      {{FoldMode::keep, "keep"}, {FoldMode::round, "round"}, {FoldMode::fillet, "fillet"}});
};

/// How the reliefs of neighbouring faces are joined.
struct Stitching {
  FoldMode folds = FoldMode::keep;
  Blend blend = Blend::quintic;
  /// Half width of the band around an edge, as a share of the smaller of the two heights of the triangles over it;
  /// above 0, at most 1/3. Narrowed by itself around vertices with sharp corners, so that no face reaches beyond its
  /// neighbours.
  double rho = 0.05;
  std::vector<double> blend_map;  ///< Blend::image: weights at t = 0 … 1, at least two, each in 0 … 1
  /// FoldMode::fillet: of the ball (m), above 0. Around a vertex whose folds need more room than half the band it is
  /// smaller, and 0 where a convex fold ends.
  double fillet_radius = 1e-3;
  /// FoldMode::round: by how much (m) it may move the surface from the face's own height. Infinite: as far as the band
  /// lets it; small where both faces describe the same surface, which makes searches near edges cheap.
  double most_rounding = std::numeric_limits<double>::infinity();
};

/// Errors: bad_value naming the member and what would be accepted. [build]
Status validate(const Stitching& stitching);

/// A weight and its first two derivatives.
struct BlendValue {
  double weight = 1.0;
  double slope = 0.0;
  double bend = 0.0;
};
/// Weight of a barycentric coordinate in a band of half width `rho`: the blend at t = (b + rho) / (2 rho), with its
/// derivatives by b (erratum 3). [servo]
BlendValue blend_value(const Stitching& stitching, double rho, double barycentric) noexcept;

/// Where on one face other faces have a say.
struct StitchBand {
  /// Per edge (opposite corner k): half width in the barycentric coordinate of corner k.
  float rho[3] = {0.0F, 0.0F, 0.0F};
  /// Per edge: where the coordinate of corner k is below this, the face across may have a say: rho, and more where the
  /// fold and the directions over it are lopsided.
  float look[3] = {0.0F, 0.0F, 0.0F};
  /// Per corner: where its barycentric coordinate is above 1 - reach, every face around the corner may have a say;
  /// elsewhere those across its edges alone, which `look` tells.
  float reach[3] = {0.0F, 0.0F, 0.0F};
};

/// Bands in metres an edge, the same from both its faces, narrowed until what a face has a say in lies within the faces
/// around its vertices (amendment 3: "1/3 is safe" fails where a neighbour is less high). One band a face. [build]
std::vector<StitchBand> stitch_bands(const TriangleMesh& mesh, const Shell& shell, double rho);
/// Narrows `reach`, which stitch_bands finds by the sharpest corner around a vertex, to how far faces beyond the
/// neighbours of each do have a say, seen along the vertex's direction. [build]
void narrow_reaches(const TriangleMesh& mesh, const Shell& shell, std::vector<StitchBand>& bands);

}  // namespace asperity
