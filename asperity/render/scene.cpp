#include "asperity/render/scene.h"

#include <fmt/format.h>

#include <atomic>
#include <cmath>

#include "asperity/core/units.h"
#include "asperity/render/fine_contact.h"
#include "asperity/surface/relief_mesh.h"

namespace asperity {

namespace {

std::uint64_t next_epoch() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

bool needs_coat(const Law& law) {
  return std::holds_alternative<HeightFieldLaw>(law) || std::holds_alternative<MesostructureLaw>(law) ||
         std::holds_alternative<GeneratedGeometryLaw>(law) || std::holds_alternative<DenseMeshLaw>(law);
}

/// The relief as a mesh, where the law feels that; the one that the instance brings if it was made from the same.
Status make_dense(Instance& instance, std::size_t index) {
  const auto* law = std::get_if<DenseMeshLaw>(&instance.law);
  if (law == nullptr) {
    instance.dense.reset();
    return success();
  }
  const ReliefSurface& relief = **std::get_if<std::shared_ptr<const ReliefSurface>>(&instance.surface);
  const std::uint64_t identity = relief.base().index().identity();
  const int subdivisions = law->subdivisions > 0 ? law->subdivisions : texel_subdivisions(relief);
  if (instance.dense != nullptr && instance.dense->relief == identity && instance.dense->subdivisions == subdivisions)
    return success();
  Result<TriangleMesh> mesh = tessellate(relief, subdivisions);
  if (!mesh) return std::move(mesh).error().at(fmt::format("surfaces[{}].law", index));
  instance.dense = std::make_shared<const DenseMesh>(
      DenseMesh{identity, subdivisions, MeshSurface(TriangleIndex::build(std::move(mesh).value()))});
  return success();
}

/// Whether the law's reach lies within the band that the potential is stored in, and what it reads is there.
Status check_potential(const Instance& instance, const std::string& place) {
  const ImplicitSurface& surface = *implicit_of(instance.surface);
  double reach = 0.0;
  const char* key = ".offset";
  if (const auto* contact = std::get_if<VirtualContactPointLaw>(&instance.law)) reach = contact->offset;
  if (const auto* magnetic = std::get_if<MagneticLaw>(&instance.law)) {
    reach = magnetic->band;
    key = ".band";
  }
  if (reach > surface.reach_outside()) {
    return Error{ErrorCode::bad_value,
                 fmt::format("is {}, and \"{}\" stores its potential up to {} outside", format_length(reach),
                             instance.name, format_length(surface.grid().outside())),
                 {},
                 place + ".law" + key,
                 fmt::format("at most {}, or a wider implicit.band_outside", format_length(surface.reach_outside()))};
  }
  if (std::holds_alternative<NormalPerturbationLaw>(instance.law) && surface.offset() > 0.0) {
    return Error{ErrorCode::unsupported_pair,
                 fmt::format("the law \"normal-perturbation\" touches the mesh itself, and \"{}\" has an offset of {}",
                             instance.name, format_length(surface.offset())),
                 {},
                 place + ".law",
                 "another law, or implicit.offset 0"};
  }
  if (std::holds_alternative<NormalPerturbationLaw>(instance.law) &&
      (surface.mesh() == nullptr || !surface.textured())) {
    return Error{ErrorCode::unsupported_pair,
                 fmt::format("the law \"normal-perturbation\" needs a mesh with a texture, and \"{}\" has no {}",
                             instance.name, surface.mesh() == nullptr ? "mesh" : "texture"),
                 {},
                 place + ".law",
                 "another law, or implicit.texture on a mesh"};
  }
  return success();
}

/// Whether the law can be felt on the surface at all.
Status check_pair(const Instance& instance, const std::string& place) {
  const bool iso = iso_of(instance.surface) != nullptr;
  const bool implicit = implicit_of(instance.surface) != nullptr;
  const bool parametric = parametric_of(instance.surface) != nullptr;
  const bool bare = instance.surface.index() == 0;
  const auto refuse = [&](const char* what, const char* accepted) {
    return Error{ErrorCode::unsupported_pair,
                 fmt::format("the law \"{}\" needs {}, and \"{}\" is {}", law_name(instance.law), what, instance.name,
                             implicit     ? "an implicit surface"
                             : iso        ? "an isosurface"
                             : parametric ? "a parametric surface"
                             : bare       ? "a bare mesh"
                                          : "a relief"),
                 {},
                 place + ".law",
                 accepted};
  };
  if (needs_field(instance.law) && !iso) return refuse("a volume", "another law, or a surface with a volume");
  if (needs_potential(instance.law) && !implicit)
    return refuse("an implicit surface", "another law, or a surface with \"implicit\"");
  if (implicit && needs_potential(instance.law)) return check_potential(instance, place);
  if (iso && !needs_field(instance.law) && !std::holds_alternative<ProxyLaw>(instance.law)) {
    return refuse(needs_coat(instance.law) ? "a coat" : "triangles",
                  implicit ? "proxy, virtual-contact-point, magnetic, normal-perturbation, avila or cross-uncross"
                           : "proxy, avila or cross-uncross");
  }
  if (parametric && !std::holds_alternative<ProxyLaw>(instance.law))
    return refuse(needs_coat(instance.law) ? "a coat" : "triangles", "proxy");
  if (bare && needs_coat(instance.law))
    return refuse("a coat", "proxy, god-object or force-shading, or a coat on the mesh");
  return success();
}

Status check(const Instance& instance, std::size_t index, double probe_radius) {
  const std::string place = fmt::format("surfaces[{}]", index);
  if (std::visit([](const auto& surface) { return surface == nullptr; }, instance.surface)) {
    return Error{ErrorCode::bad_value,
                 "holds no surface",
                 {},
                 place + ".surface",
                 "a mesh, relief, isosurface, implicit or parametric surface"};
  }
  ASPERITY_CHECK(check_pair(instance, place));
  ASPERITY_CHECK(check_fine(instance, place));
  if (auto valid = validate(instance.law); !valid) return std::move(valid).error().at(place + ".law");
  if (auto valid = validate(instance.material); !valid) return std::move(valid).error().at(place + ".material");
  if (probe_radius > 0.0 && !constrains(instance.law)) {
    return Error{ErrorCode::unsupported_pair,
                 fmt::format("the law \"{}\" touches with a point, and the probe has a radius of {}",
                             law_name(instance.law), format_length(probe_radius)),
                 {},
                 place + ".law",
                 base_of(instance.surface) != nullptr && iso_of(instance.surface) == nullptr
                     ? "proxy, god-object or force-shading, or probe.radius 0"
                     : "proxy, or probe.radius 0"};
  }
  const Pose& pose = instance.world_from_object;
  if (!pose.position.allFinite() || !pose.orientation.coeffs().allFinite() ||
      std::abs(pose.orientation.norm() - 1.0) > 1e-9) {
    return Error{
        ErrorCode::bad_value, "is not a finite position and unit quaternion", {}, place + ".pose", "finite numbers"};
  }
  return success();
}

Box transformed(const Box& box, const Pose& pose) {
  Box world;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 local((corner & 1) != 0 ? box.upper.x() : box.lower.x(),
                     (corner & 2) != 0 ? box.upper.y() : box.lower.y(),
                     (corner & 4) != 0 ? box.upper.z() : box.lower.z());
    world.include(pose.apply(local));
  }
  return world;
}

}  // namespace

const char* surface_kind(const Surface& surface) {
  constexpr const char* names[] = {"mesh", "relief", "iso", "implicit", "parametric"};
  return names[surface.index()];
}

Box surface_bounds(const Surface& surface) {
  return std::visit([](const auto& s) { return s->bounds(); }, surface);
}

const MeshSurface* base_of(const Surface& surface) noexcept {
  if (const auto* relief = std::get_if<std::shared_ptr<const ReliefSurface>>(&surface)) return &(*relief)->base();
  if (const ImplicitSurface* implicit = implicit_of(surface)) return implicit->mesh();
  const auto* mesh = std::get_if<std::shared_ptr<const MeshSurface>>(&surface);
  return mesh != nullptr ? mesh->get() : nullptr;
}

const ImplicitSurface* implicit_of(const Surface& surface) noexcept {
  const auto* implicit = std::get_if<std::shared_ptr<const ImplicitSurface>>(&surface);
  return implicit != nullptr ? implicit->get() : nullptr;
}

const ParametricSurface* parametric_of(const Surface& surface) noexcept {
  const auto* parametric = std::get_if<std::shared_ptr<const ParametricSurface>>(&surface);
  return parametric != nullptr ? parametric->get() : nullptr;
}

const IsoSurface* iso_of(const Surface& surface) noexcept {
  if (const ImplicitSurface* implicit = implicit_of(surface)) return &implicit->iso();
  const auto* iso = std::get_if<std::shared_ptr<const IsoSurface>>(&surface);
  return iso != nullptr ? iso->get() : nullptr;
}

Material material_at(const ImplicitSurface& surface, const Material& own, const Vec3& p, SparseHint& hint) noexcept {
  if (!surface.grid().has_materials()) return own;
  PointMaterial mine;
  mine.stiffness = static_cast<float>(own.stiffness);
  mine.damping = static_cast<float>(own.damping);
  mine.static_friction = static_cast<float>(own.static_friction);
  mine.dynamic_friction = static_cast<float>(own.dynamic_friction);
  mine.roughness = 1.0F;
  const PointMaterial there = surface.grid().material(p, mine, hint);
  Material out = own;
  // What is the surface's own stays as exact as it is.
  const auto take = [](float stored, float rounded, double& value) {
    if (stored != rounded) value = static_cast<double>(stored);
  };
  take(there.stiffness, mine.stiffness, out.stiffness);
  take(there.damping, mine.damping, out.damping);
  take(there.static_friction, mine.static_friction, out.static_friction);
  take(there.dynamic_friction, mine.dynamic_friction, out.dynamic_friction);
  return out;
}

Material local_material(const Instance& instance, const Vec3& p, SparseHint& hint) noexcept {
  const ImplicitSurface* implicit = implicit_of(instance.surface);
  if (implicit == nullptr || !implicit->grid().has_materials()) return instance.material;
  // A ball's centre, or a probe pressed in, is off the surface by what the potential says.
  const Potential here = implicit->grid().trilinear(p, hint);
  return material_at(*implicit, instance.material, p - here.value * here.gradient, hint);
}

const TriangleMesh& base_mesh(const Surface& surface) {
  return base_of(surface)->mesh();
}

Result<Scene> Scene::build(std::vector<Instance> instances, double probe_radius, std::vector<FieldEffect> effects) {
  if (!std::isfinite(probe_radius) || probe_radius < 0.0) {
    return Error{
        ErrorCode::bad_value, fmt::format("is {}", probe_radius), {}, "probe.radius", "a length of 0 or more (m, mm)"};
  }
  if (instances.empty() && effects.empty()) {
    return Error{ErrorCode::bad_value, "holds nothing to touch", {}, "surfaces", "at least one surface or effect"};
  }
  for (std::size_t i = 0; i < effects.size(); ++i) {
    if (auto valid = validate(effects[i]); !valid) return std::move(valid).error().at(fmt::format("effects[{}]", i));
  }
  Scene scene;
  for (std::size_t i = 0; i < instances.size(); ++i) {
    ASPERITY_CHECK(check(instances[i], i, probe_radius));
    ASPERITY_CHECK(make_dense(instances[i], i));
    // Room for the probe and for the skin that it rests on.
    const Box bounds = surface_bounds(instances[i].surface);
    scene.bounds_.push_back(
        transformed(bounds.grown(probe_radius + 1e-6 * bounds.diagonal()), instances[i].world_from_object));
  }
  scene.instances_ = std::move(instances);
  scene.effects_ = std::move(effects);
  scene.probe_radius_ = probe_radius;
  scene.epoch_ = next_epoch();
  return scene;
}

Box Scene::world_bounds() const noexcept {
  Box all;
  for (const Box& box : bounds_) all.include(box);
  for (const FieldEffect& effect : effects_) all.include(transformed(effect.field->bounds(), effect.world_from_object));
  return all;
}

std::size_t Scene::memory_bytes() const noexcept {
  std::size_t bytes = sizeof(*this);
  for (const Instance& instance : instances_) {
    if (instance.dense != nullptr) bytes += sizeof(DenseMesh) + instance.dense->surface.index().memory_bytes();
    if (const ImplicitSurface* implicit = implicit_of(instance.surface)) {
      bytes += implicit->memory_bytes();
    } else if (const ParametricSurface* parametric = parametric_of(instance.surface)) {
      bytes += parametric->memory_bytes();
    } else if (const IsoSurface* iso = iso_of(instance.surface)) {
      bytes += iso->field().memory_bytes();
    } else if (const auto* relief = std::get_if<std::shared_ptr<const ReliefSurface>>(&instance.surface)) {
      bytes += (*relief)->base().index().memory_bytes() + (*relief)->coat().memory_bytes();
    } else {
      bytes += (*std::get_if<std::shared_ptr<const MeshSurface>>(&instance.surface))->index().memory_bytes();
    }
  }
  for (const FieldEffect& effect : effects_) bytes += sizeof(FieldEffect) + effect.field->memory_bytes();
  return bytes;
}

}  // namespace asperity
