#pragma once
// Pre-blending of concave folds (hrm-2010, 4.2; formulation D4, amendment 4): morphological closing of a relief with a
// ball, baked into its heights.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "asperity/core/progress.h"
#include "asperity/core/result.h"
#include "asperity/surface/relief/atlas.h"
#include "asperity/surface/relief/surface.h"

namespace asperity {

/// How a relief is closed.
struct ClosingSettings {
  /// Of the ball (m), above 0: folds, grooves and holes that it does not fit into are filled as far as it stays out. At
  /// least the radius of the probe that is to touch the relief.
  double radius = 1e-3;
  /// Texels of the answer along each edge of a triangle, 2 to 512; 0: as fine as the coat or an eighth of the radius,
  /// whichever is finer, a multiple of 8 from 8 to 48.
  int texels = 0;
  std::size_t most_memory = std::size_t{1} << 30;  ///< bytes that closing may use at one time, the answer included
  unsigned threads = 0;                            ///< at most so many; 0: one a processor. The answer is the same
};

/// What closing did.
struct ClosingReport {
  std::size_t texels = 0;                    ///< that lie over triangles
  std::size_t changed_texels = 0;            ///< of them, whose height rose by more than `tolerance`
  double changed_share = 0.0;                ///< of the base's area
  double tolerance = 0.0;                    ///< m
  double largest_rise = 0.0;                 ///< m
  std::uint32_t largest_face = no_index;     ///< where that is
  std::vector<std::uint32_t> changed_faces;  ///< ascending
  std::size_t unsettled_texels = 0;          ///< over which no place of the ball was found: raised as those around them
  double texel_size = 0.0;                   ///< along the mean edge (m): fillets narrower than this are lost
  /// One sentence: what was filled, where most. [any]
  [[nodiscard]] std::string summary() const;
};

/// A closed relief, as maps.
struct ClosedRelief {
  ReliefAtlas atlas;  ///< heights (m) as closed; its corner UVs are for the mesh that wears it
  /// Heights (m) as closed of every level of detail of the coat beside the finest, laid out as the atlas's.
  std::vector<std::vector<float>> levels;
  std::vector<float> rise;  ///< m, one a texel of the atlas, row 0 on top: by how much closing raised it
  ClosingSettings settings;
  ClosingReport report;
  /// By how much closing raised the relief over a place (m), by the nearest texel: for pictures. [any]
  [[nodiscard]] double rise_at(std::uint32_t face, const Vec3& barycentric) const noexcept;
};

/// Closes a relief: a point outside of it is filled if and only if no ball of the radius that lies wholly outside holds
/// it. Heights are found along the shell's rays, to 1e-3 of the radius, and between texels by the spline of the map.
/// What the ball reaches everywhere keeps its height; convex creases stay as they are. On an open base the rim is an
/// edge of the solid like any other: what lies beside it is free, and a ball may come from there; behind an open base
/// there is no outside. Levels of detail are each closed by itself. What moves is not closed: of a coat that changes
/// with time its state at time 0 is. Errors: bad_value (radius, texels), too_large (most_memory; the size of the
/// atlas). [build]
Result<ClosedRelief> close_relief(const ReliefSurface& surface, const ClosingSettings& settings,
                                  const Progress& progress = {});

/// The closed relief on the mesh of the one it was made from, as a surface: corner UVs of the atlas, one map, joined by
/// its own height (folds `round` in a narrow band: both sides of an edge describe the same surface), with its levels of
/// detail, and with normals where the coat has a map of them: the coat's own where nothing was filled, those of the
/// closed heights elsewhere. Maps of the material are laid by UVs that the mesh no longer has: they are left behind.
/// Errors: those of Coat and ReliefSurface; mismatch (another mesh). [build]
Result<std::shared_ptr<const ReliefSurface>> wear_closed(const ReliefSurface& original, const ClosedRelief& closed,
                                                         const ReliefSettings& settings = {});

}  // namespace asperity
