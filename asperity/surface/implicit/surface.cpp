#include "asperity/surface/implicit/surface.h"

#include <fmt/format.h>

#include "asperity/core/units.h"

namespace asperity {

Result<ImplicitSurface> ImplicitSurface::build(ImplicitParts parts) {
  if (parts.grid == nullptr) return bad_value("holds no potential", "implicit", "a sparse grid");
  const SparseGrid& grid = *parts.grid;
  const double most = grid.outside() - 2.0 * grid.voxel();
  if (!(parts.offset >= 0.0 && parts.offset <= most)) {
    return bad_value(fmt::format("is {}, and the potential is stored up to {} outside", format_length(parts.offset),
                                 format_length(grid.outside())),
                     "offset", fmt::format("0 to {}, or a wider band_outside", format_length(most)));
  }
  if (parts.mesh != nullptr && grid.has_faces()) {
    const std::size_t faces = parts.mesh->mesh().triangles().size();
    const SparseSource source = grid.source();
    for (const SparseBlock& block : source.blocks) {
      for (const std::uint32_t face : block.face) {
        if (face == no_index || face < faces) continue;
        return bad_value(fmt::format("names face {} as the closest, and the mesh has {}", face, faces), "implicit",
                         "the mesh that the potential was made from");
      }
    }
  }
  auto field = std::make_shared<const ScalarField>(parts.grid, parts.reconstruction);
  Result<IsoSurface> iso = IsoSurface::build(std::move(field), parts.offset, Inside::low);
  if (!iso) {
    return bad_value(fmt::format("has no surface: the potential ranges from {} to {}", format_length(grid.lowest()),
                                 format_length(grid.highest())),
                     "implicit", "a potential that is 0 somewhere, positive outside");
  }
  return ImplicitSurface(std::move(parts), std::move(iso).value());
}

std::size_t ImplicitSurface::memory_bytes() const noexcept {
  std::size_t bytes = sizeof(*this) + parts_.grid->memory_bytes();
  if (parts_.untextured != nullptr) bytes += parts_.untextured->memory_bytes();
  if (parts_.mesh != nullptr) bytes += parts_.mesh->index().memory_bytes();
  return bytes;
}

FieldSample ImplicitSurface::eval(const Vec3& p, SurfaceCache& cache) const noexcept {
  FieldSample sample;
  FieldJet jet;
  if (!iso_.view(cache).sample(p, jet)) return sample;
  sample.value = jet.value - parts_.offset;
  sample.gradient = jet.gradient;
  sample.element = iso_.view(cache).element_at(p);
  if (textured()) sample.height = untextured().trilinear(p, cache.sparse).value - jet.value;
  return sample;
}

}  // namespace asperity
