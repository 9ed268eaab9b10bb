// A closed relief as a surface: the mesh with the atlas's UVs, and the maps of the coat that go with it.

#include <algorithm>
#include <cmath>

#include "asperity/surface/relief/bake.h"
#include "asperity/surface/relief/closing.h"

namespace asperity {

namespace {

/// Writes the normals over a face into an image of the atlas's size: the coat's own, and where the relief rose those
/// of the closed heights.
void write_normals(const ReliefSurface& original, const ClosedRelief& closed, std::uint32_t face, Image& image) {
  const int texels = closed.settings.texels;
  const AtlasTile tile = atlas_tile(closed.atlas, face);
  const BarycentricFrame frame = barycentric_frame(original.base().mesh(), face);
  // The map's axes as they lie on the triangle, as Coat::sample reads them.
  const auto& uvs = closed.atlas.corner_uvs[face];
  Vec3 along_t = Vec3::Zero();
  for (std::size_t k = 0; k < 3; ++k) along_t += static_cast<double>(uvs[k].y()) * frame.gradient[k];
  const Vec3 bitangent = along_t.normalized();
  const Vec3 tangent = bitangent.cross(frame.normal);
  const auto height = [&](int i, int j) { return static_cast<double>(closed.atlas.heights[tile.at(i, j)]); };
  // One texel beside the triangle too, as far as filters see.
  for (int i = -1; i <= texels + 1; ++i) {
    for (int j = -1; i + j <= texels + 1; ++j) {
      const int over_i = std::clamp(i, 0, texels);
      const int over_j = std::clamp(j, 0, texels - over_i);
      const double u = static_cast<double>(over_i) / texels;
      const double v = static_cast<double>(over_j) / texels;
      Vec3 slope;
      if (static_cast<double>(closed.rise[tile.at(over_i, over_j)]) > closed.report.tolerance) {
        const double along_u = 0.5 * texels * (height(over_i + 1, over_j) - height(over_i - 1, over_j));
        const double along_v = 0.5 * texels * (height(over_i, over_j + 1) - height(over_i, over_j - 1));
        slope = along_u * frame.gradient[1] + along_v * frame.gradient[2];
      } else {
        const Vec3 normal = original.coat_sample(face, Vec3(1.0 - u - v, u, v)).normal;
        slope = frame.normal - normal / std::max(1e-3, normal.dot(frame.normal));
      }
      const Vec3 local = Vec3(-slope.dot(tangent), -slope.dot(bitangent), 1.0).normalized();
      std::uint16_t* to = image.samples.data() + 3 * tile.at(i, j);
      for (int k = 0; k < 3; ++k) to[k] = static_cast<std::uint16_t>(std::lround(32768.0 + 32767.0 * local[k]));
    }
  }
}

Result<NormalMap> closed_normals(const ReliefSurface& original, const ClosedRelief& closed) {
  Image image;
  image.width = closed.atlas.width;
  image.height = closed.atlas.height;
  image.channels = 3;
  image.bits = 16;
  image.samples.assign(3 * closed.atlas.heights.size(), 32768);
  for (std::size_t i = 2; i < image.samples.size(); i += 3) image.samples[i] = 65535;
  for (std::uint32_t face = 0; face < original.base().mesh().triangles().size(); ++face)
    write_normals(original, closed, face, image);
  NormalMapSettings settings;
  settings.wrap = Wrap::clamp;
  return NormalMap::build(image, settings);
}

/// The levels of detail, as closed; nullptr: the coat has none.
Result<std::shared_ptr<const DetailPyramid>> closed_levels(const ReliefSurface& original, const ClosedRelief& closed,
                                                           const HeightMap& heights) {
  const DetailPyramid* own = original.coat().maps().detail();
  if (own == nullptr || closed.levels.empty()) return std::shared_ptr<const DetailPyramid>();
  std::vector<HeightMap> levels;
  for (const std::vector<float>& level : closed.levels) {
    ASPERITY_TRY(HeightMap map, atlas_heights(closed.atlas, level));
    levels.push_back(std::move(map));
  }
  ASPERITY_TRY(DetailPyramid pyramid, DetailPyramid::build(heights, std::move(levels), *own));
  return std::make_shared<const DetailPyramid>(std::move(pyramid));
}

Result<Mesostructure> closed_maps(const ReliefSurface& original, const ClosedRelief& closed) {
  ASPERITY_TRY(HeightMap heights, atlas_heights(closed.atlas, closed.atlas.heights));
  const Vec2 size = atlas_size(original.base().mesh(), closed.atlas);
  ASPERITY_TRY(const std::shared_ptr<const DetailPyramid> detail, closed_levels(original, closed, heights));
  const auto finish = [&](Mesostructure maps) { return detail == nullptr ? maps : maps.with_detail(detail); };
  const auto faces = static_cast<std::uint32_t>(original.base().mesh().triangles().size());
  bool has_normals = false;
  for (std::uint32_t face = 0; face < faces && !has_normals; ++face)
    has_normals = original.coat().maps_on(face).has_normal_map();
  if (!has_normals) {
    ASPERITY_TRY(Mesostructure maps, Mesostructure::build(std::move(heights), size));
    return finish(std::move(maps));
  }
  ASPERITY_TRY(NormalMap normals, closed_normals(original, closed));
  ASPERITY_TRY(Mesostructure maps, Mesostructure::build(std::move(heights), std::move(normals), size));
  return finish(std::move(maps));
}

}  // namespace

Result<std::shared_ptr<const ReliefSurface>> wear_closed(const ReliefSurface& original, const ClosedRelief& closed,
                                                         const ReliefSettings& settings) {
  ASPERITY_TRY(TriangleMesh mesh, with_atlas_uvs(original.base().mesh(), closed.atlas));
  ReliefSettings same = settings;
  same.directions = original.report().directions_relaxed ? ShellDirections::relaxed : ShellDirections::least_squares;
  ASPERITY_TRY(Mesostructure maps, closed_maps(original, closed));
  ASPERITY_TRY(std::shared_ptr<const ReliefSurface> surface,
               wear_atlas(mesh, closed.atlas.texels, std::move(maps), same));
  if (surface->shell().directions != original.shell().directions) {
    return refused(ErrorCode::bad_mesh, "the filled relief is higher than the shell over its faces holds", "radius",
                   "a smaller radius, a lower relief, or a finer base mesh");
  }
  return surface;
}

}  // namespace asperity
