#include "asperity/surface/relief/atlas.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asperity/field/height/image.h"

namespace asperity {

namespace {

// A jump between tiles rings on in an interpolating spline, weaker by 0.17 a texel: after six it is lost in a float.
constexpr int border = 6;

/// Two triangles a square tile: one from its lower left corner, one from its upper right.
struct Layout {
  int texels;
  int tile;     ///< texels a side
  int columns;  ///< tiles a row
  int rows;
  Layout(std::size_t faces, int texels_) : texels(texels_), tile(texels_ + 4 * border) {
    const std::size_t tiles = (faces + 1) / 2;
    columns = std::max(1, static_cast<int>(std::ceil(std::sqrt(static_cast<double>(tiles)))));
    rows = static_cast<int>((tiles + static_cast<std::size_t>(columns) - 1) / static_cast<std::size_t>(columns));
  }
  [[nodiscard]] int width() const { return columns * tile; }
  [[nodiscard]] int height() const { return rows * tile; }
};

}  // namespace

std::ptrdiff_t nearest_texel_within(const AtlasTexel& texel, double border, int texels) noexcept {
  const double margin = (border - 0.7) / texels;
  double u = texel.u;
  double v = texel.v;
  // Back and forth between two sides towards an acute corner: what is left halves each time.
  constexpr int most_rounds = 16;
  for (int i = 0; i < most_rounds; ++i) {
    u = std::max(u, -margin);
    v = std::max(v, -margin);
    const double beyond = 0.5 * std::max(0.0, u + v - 1.0 - margin);
    u -= beyond;
    v -= beyond;
  }
  return static_cast<std::ptrdiff_t>(std::lround((u - texel.u) * texels)) * texel.right +
         static_cast<std::ptrdiff_t>(std::lround((v - texel.v) * texels)) * texel.up;
}

std::size_t atlas_texels(std::size_t faces, int texels) noexcept {
  const Layout layout(faces, texels);
  return static_cast<std::size_t>(layout.width()) * static_cast<std::size_t>(layout.height());
}

Result<ReliefAtlas> bake_relief(const TriangleMesh& mesh, const Shell& shell, int texels, const RayHeight& ray,
                                const Progress& progress) {
  ShellPrism prism{};
  std::uint32_t of = no_index;
  return bake_relief(
      mesh, texels,
      [&](const AtlasTexel& texel) {
        if (texel.face != of) prism = shell.prism(mesh, texel.face);
        of = texel.face;
        return ray(prism.base_at(texel.u, texel.v), prism.direction_at(texel.u, texel.v));
      },
      progress);
}

Result<ReliefAtlas> flat_atlas(const TriangleMesh& mesh, int texels) {
  if (texels < 2) return bad_value(fmt::format("is {}", texels), "texels", "2 texels an edge or more");
  const std::size_t faces = mesh.triangles().size();
  const Layout layout(faces, texels);
  if (static_cast<double>(layout.width()) * layout.height() > static_cast<double>(max_pixels)) {
    return refused(ErrorCode::too_large,
                   fmt::format("the atlas would have {} x {} texels", layout.width(), layout.height()), "texels",
                   fmt::format("fewer texels an edge: at most {} in all", max_pixels));
  }
  ReliefAtlas atlas;
  atlas.width = layout.width();
  atlas.height = layout.height();
  atlas.texels = texels;
  atlas.heights.assign(static_cast<std::size_t>(atlas.width) * static_cast<std::size_t>(atlas.height), 0.0F);
  atlas.corner_uvs.resize(faces);
  const double inset = border + 0.5;
  const double far = layout.tile - inset;
  const Vec2 local[3] = {Vec2(inset, inset), Vec2(inset + texels, inset), Vec2(inset, inset + texels)};
  for (std::size_t face = 0; face < faces; ++face) {
    const int tile = static_cast<int>(face / 2);
    const Vec2 first(tile % layout.columns * layout.tile, tile / layout.columns * layout.tile);
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2 at = first + (face % 2 == 1 ? Vec2(Vec2(far + inset, far + inset) - local[k]) : local[k]);
      atlas.corner_uvs[face][k] =
          Vec2f(static_cast<float>(at.x() / atlas.width), static_cast<float>(at.y() / atlas.height));
    }
  }
  return atlas;
}

AtlasTile atlas_tile(const ReliefAtlas& atlas, std::uint32_t face) noexcept {
  const Layout layout(atlas.corner_uvs.size(), atlas.texels);
  const auto tile = static_cast<int>(face / 2);
  const bool upper = face % 2 == 1;
  const int corner = upper ? layout.tile - 1 - border : border;
  const int x = tile % layout.columns * layout.tile + corner;
  const int y = tile / layout.columns * layout.tile + corner;
  const std::ptrdiff_t onward = upper ? -1 : 1;
  return {static_cast<std::size_t>(atlas.height - 1 - y) * static_cast<std::size_t>(atlas.width) +
              static_cast<std::size_t>(x),
          onward, -onward * atlas.width, border, atlas.texels + 2 * border - (upper ? 2 : 1)};
}

Result<ReliefAtlas> bake_relief(const TriangleMesh& mesh, int texels, const TexelHeight& heights,
                                const Progress& progress) {
  ASPERITY_TRY(ReliefAtlas atlas, flat_atlas(mesh, texels));
  const std::size_t faces = mesh.triangles().size();
  for (std::uint32_t face = 0; face < faces; ++face) {
    // The corners as floats hold them: heights are taken where the coat will read them.
    Vec2 corner[3];
    for (std::size_t k = 0; k < 3; ++k)
      corner[k] = atlas.corner_uvs[face][k].cast<double>().cwiseProduct(Vec2(atlas.width, atlas.height));
    const Vec2 along_u = corner[1] - corner[0];
    const Vec2 along_v = corner[2] - corner[0];
    const double det = along_u.x() * along_v.y() - along_u.y() * along_v.x();
    const AtlasTile tile = atlas_tile(atlas, face);
    const Vec2 first(static_cast<double>(tile.origin % static_cast<std::size_t>(atlas.width)) + 0.5,
                     atlas.height - static_cast<double>(tile.origin / static_cast<std::size_t>(atlas.width)) - 0.5);
    const auto onward = static_cast<double>(tile.right);
    // Row by row of the picture from its foot, whichever way the face lies in it.
    const int rows = tile.most_sum + 2 * tile.border;
    for (int row = 0; row <= rows; ++row) {
      const int j = tile.right > 0 ? row - tile.border : rows - tile.border - row;
      for (int column = 0; column <= tile.most_sum - j + tile.border; ++column) {
        const int i = tile.right > 0 ? column - tile.border : tile.most_sum - j - column;
        const Vec2 offset = first + onward * Vec2(i, j) - corner[0];
        const double u = (offset.x() * along_v.y() - offset.y() * along_v.x()) / det;
        const double v = (along_u.x() * offset.y() - along_u.y() * offset.x()) / det;
        const AtlasTexel texel{face, u, v, tile.at(i, j), tile.right, tile.up};
        const double height = heights(texel);
        if (!std::isfinite(height)) {
          return bad_value(fmt::format("the ray from barycentric ({:.3g}, {:.3g}) meets nothing", u, v),
                           fmt::format("face {}", face), "a surface that every ray of the shell meets");
        }
        atlas.heights[texel.index] = static_cast<float>(height);
      }
    }
    if (progress && face % 16 == 0)
      progress("baking the relief", static_cast<double>(face) / static_cast<double>(faces));
  }
  return atlas;
}

}  // namespace asperity
