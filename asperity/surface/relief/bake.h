#pragma once
// A formula as a relief: where the rays of the shell over a mesh meet its surface, and the mesh that wears what was
// found there.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "asperity/core/progress.h"
#include "asperity/core/result.h"
#include "asperity/geometry/mesh.h"
#include "asperity/surface/relief/atlas.h"
#include "asperity/surface/relief/surface.h"

namespace asperity {

/// A surface as a formula of a place (m, the mesh's frame): below 0 inside, 0 on it, above 0 outside. The values may
/// have any unit; where they change sign is the surface. Asked by the thread that bakes, one place at a time.
using SignedFormula = std::function<double(const Vec3& place)>;

/// What becomes of a texel over whose place the formula has no surface within the range.
enum class OnMiss {
  refuse,  ///< Error naming the first faces and how many texels of each
  flat,    ///< height 0: the base itself; counted by BakeReport
};

/// How a formula is baked. Heights are along the directions of the shell, whose component across their triangle is
/// about 1: nearly metric over the triangle.
struct FormulaBakeSettings {
  int texels = 32;          ///< along each edge of a triangle, 2 or more
  double lowest = -1e-3;    ///< m: heights from here ...
  double highest = 1e-3;    ///< m: ... to here are searched; 0 lies between, and they differ
  double tolerance = 1e-9;  ///< m, above 0: of the heights. The atlas holds them in single precision (6e-8 of each)
  /// Into how many steps the range is cut in search of a change of sign, 1 to 4096. What is thinner than a step along
  /// a ray may be missed.
  int steps = 16;
  OnMiss on_miss = OnMiss::refuse;
};

/// A face over part of which there is no surface.
struct MissedFace {
  std::uint32_t face = no_index;
  std::size_t texels = 0;           ///< over it that miss
  Vec3 barycentric = Vec3::Zero();  ///< of the first of them
};

/// What baking a formula found out.
struct BakeReport {
  std::size_t texels = 0;          ///< that lie over triangles
  std::size_t missed_texels = 0;   ///< of them, over which there is no surface within the range
  std::size_t turned_texels = 0;   ///< of those, over which there is one that is seen from inside
  std::vector<MissedFace> missed;  ///< ascending
  std::size_t continued_texels =
      0;                        ///< beside triangles, whose own ray misses: as high as the nearest over the triangle
  double lowest = 0.0;          ///< m, of the heights over triangles
  double highest = 0.0;         ///< m
  std::size_t evaluations = 0;  ///< of the formula
  /// One sentence: the heights, and what was missed where. [any]
  [[nodiscard]] std::string summary() const;
};

/// A formula baked onto a mesh.
struct BakedRelief {
  TriangleMesh mesh;  ///< the base, with the atlas's texture coordinates
  ReliefAtlas atlas;  ///< heights (m)
  BakeReport report;
};

/// Bakes the surface of a formula onto a mesh near it. Over each texel the ray base + h direction of the shell is
/// followed in steps: from outside downwards, from inside upwards, and where that way leads to no surface seen from
/// outside, the other way; the root in the step is then found by ITP (oliveira-2021), which never takes more
/// evaluations than bisection and one. Texels beside a triangle hold the surface as it goes on there, so that
/// reconstruction sees no seam.
/// Errors: bad_value (a setting, by name; a formula that is not finite over a triangle, naming face and place; with
/// OnMiss::refuse texels without a surface, naming the first face and the texels of each), too_large. [build]
Result<BakedRelief> bake_relief(const TriangleMesh& mesh, const SignedFormula& formula,
                                const FormulaBakeSettings& settings = {}, const Progress& progress = {});

/// What was baked as a surface to be touched: one map on the mesh, joined by its own height. A cure for a relief that
/// folds over would feel another surface than the formula's, so by default such a relief is refused. Errors: those of
/// wear_atlas, bad_mesh (a cure that turned the directions along which was baked). [build]
Result<std::shared_ptr<const ReliefSurface>> wear_baked(const BakedRelief& baked,
                                                        const ReliefSettings& settings = {
                                                            ShellDirections::least_squares, OnOverlap::refuse});

/// A mesh with an atlas's texture coordinates in place of its own. Errors: mismatch (an atlas of another number of
/// triangles), bad_mesh. [build]
Result<TriangleMesh> with_atlas_uvs(const TriangleMesh& mesh, const ReliefAtlas& atlas);

/// A mesh that has an atlas's texture coordinates, wearing its heights by their interpolating spline. Faces are joined
/// in a narrow band (folds `round`): both sides of an edge describe the same surface. Errors: those of make_relief.
/// [build]
Result<std::shared_ptr<const ReliefSurface>> wear_atlas(const TriangleMesh& mesh, const ReliefAtlas& atlas,
                                                        const ReliefSettings& settings = {});
/// The same of maps that were made of the atlas: its heights, with normals or levels of detail beside. [build]
Result<std::shared_ptr<const ReliefSurface>> wear_atlas(const TriangleMesh& mesh, int texels, Mesostructure maps,
                                                        const ReliefSettings& settings);
/// Heights laid out as an atlas's, as the spline that wear_atlas makes of them. [build]
Result<HeightMap> atlas_heights(const ReliefAtlas& atlas, const std::vector<float>& heights);
/// Size of one repeat of an atlas (m): its texels are as large as those along the mesh's mean edge. [build]
Vec2 atlas_size(const TriangleMesh& mesh, const ReliefAtlas& atlas) noexcept;

}  // namespace asperity
