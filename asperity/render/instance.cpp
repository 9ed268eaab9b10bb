#include "asperity/render/instance.h"

namespace asperity {

const char* surface_kind(const Surface& surface) {
  constexpr const char* names[] = {"mesh", "relief", "iso", "implicit", "parametric", "custom"};
  return names[surface.index()];
}

Box surface_bounds(const Surface& surface) {
  return std::visit([](const auto& s) { return s->bounds(); }, surface);
}

Sides natural_sides(const Surface& surface) noexcept {
  if (implicit_of(surface) != nullptr) return Sides::front;
  if (const ParametricSurface* parametric = parametric_of(surface)) return parametric->natural_sides();
  if (const CustomSurface* custom = custom_of(surface)) return custom->natural_sides();
  const MeshSurface* base = base_of(surface);
  return base != nullptr ? base->natural_sides() : Sides::both;
}

const MeshSurface* base_of(const Surface& surface) noexcept {
  if (const auto* relief = std::get_if<std::shared_ptr<const ReliefSurface>>(&surface)) return &(*relief)->base();
  if (const ImplicitSurface* implicit = implicit_of(surface)) return implicit->mesh();
  const auto* mesh = std::get_if<std::shared_ptr<const MeshSurface>>(&surface);
  return mesh != nullptr ? mesh->get() : nullptr;
}

std::uint64_t surface_identity(const Surface& surface) noexcept {
  if (const IsoSurface* iso = iso_of(surface)) return iso->field().identity();
  if (const MeshSurface* base = base_of(surface)) return base->index().lineage();
  if (const ParametricSurface* parametric = parametric_of(surface)) return parametric->identity();
  return custom_of(surface)->identity();
}

const TriangleMesh& base_mesh(const Surface& surface) {
  return base_of(surface)->mesh();
}

std::size_t law_bytes(const Instance& instance) noexcept {
  std::size_t bytes = instance.law.kind().state_bytes;
  if (instance.dense != nullptr) bytes += sizeof(DenseMesh) + instance.dense->surface.index().memory_bytes();
  return bytes;
}

}  // namespace asperity
