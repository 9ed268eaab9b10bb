#pragma once
// Baking: any surface near a mesh, written down as heights over it along the shell's rays.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "asperity/core/progress.h"
#include "asperity/core/result.h"
#include "asperity/surface/shell.h"

namespace asperity {

/// Height h (m) at which origin + h direction lies on the surface to be baked, near h = 0. `direction` is not unit.
using RayHeight = std::function<double(const Vec3& origin, const Vec3& direction)>;

/// A height image in which every triangle of a mesh has a tile of its own, with a border around it that holds the
/// surface as it goes on beyond the triangle, so that reconstruction near its edges sees no seam.
struct ReliefAtlas {
  int width = 0;                                 ///< texels
  int height = 0;                                ///< texels
  std::vector<float> heights;                    ///< m, row 0 on top, as HeightMap::build takes them
  std::vector<std::array<Vec2f, 3>> corner_uvs;  ///< per triangle, for MeshSource
  int texels = 0;                                ///< along each edge of a triangle
};

/// Where an atlas holds a face: the place with barycentric coordinates u = i / texels, v = j / texels (outside the
/// triangle in its border) is the texel at origin + i right + j up.
struct AtlasTile {
  std::size_t origin = 0;
  std::ptrdiff_t right = 1;
  std::ptrdiff_t up = 1;
  int border = 0;    ///< i and j are no less than minus this ...
  int most_sum = 0;  ///< ... and i + j no more than this
  [[nodiscard]] std::size_t at(int i, int j) const noexcept {
    return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(origin) + i * right + j * up);
  }
};

/// An atlas of heights 0. Errors: bad_value (texels below 2), too_large. [build]
Result<ReliefAtlas> flat_atlas(const TriangleMesh& mesh, int texels);
/// Where it holds a face. [any]
AtlasTile atlas_tile(const ReliefAtlas& atlas, std::uint32_t face) noexcept;

/// Bakes with `texels` texels along each edge of a triangle. The heights are along the directions of `shell`, which the
/// mesh that wears the atlas must have too (the same positions give the same directions). For those who find heights
/// on their own; of a formula relief_bake.h finds them. Errors: bad_value (texels
/// below 2, a height that is not finite, naming the face), too_large. [build]
Result<ReliefAtlas> bake_relief(const TriangleMesh& mesh, const Shell& shell, int texels, const RayHeight& ray,
                                const Progress& progress = {});

/// One texel of an atlas: the place of a triangle (barycentric u, v; outside the triangle in its border) that it holds.
struct AtlasTexel {
  std::uint32_t face = 0;
  double u = 0.0;
  double v = 0.0;
  std::size_t index = 0;     ///< in ReliefAtlas::heights
  std::ptrdiff_t right = 1;  ///< from `index` to the texel one further along u, and along v
  std::ptrdiff_t up = 1;
};
/// Height (m) at a texel.
using TexelHeight = std::function<double(const AtlasTexel&)>;

/// The same from heights by texel, asked once for each, face by face. [build]
Result<ReliefAtlas> bake_relief(const TriangleMesh& mesh, int texels, const TexelHeight& height,
                                const Progress& progress = {});
/// From a texel beside a triangle to the one nearest to it that is at most `border` texels beside: by how much its
/// index differs. `texels` along each edge. [any]
std::ptrdiff_t nearest_texel_within(const AtlasTexel& texel, double border, int texels) noexcept;
/// Texels that the atlas would have. [any]
std::size_t atlas_texels(std::size_t faces, int texels) noexcept;

}  // namespace asperity
