#include "asperity/render/local_material.h"

#include <algorithm>

namespace asperity {

namespace {

double mapped(const LocalMaterial& local, MaterialChannel channel) noexcept {
  return local.value[static_cast<std::size_t>(channel)];
}

Material mapped_material(const Instance& instance, const ReliefSurface& relief, const CoatPlace& place) noexcept {
  Material material = instance.material;
  const MaterialMaps* maps = relief.coat().materials();
  if (maps == nullptr || !place.found) return material;
  const LocalMaterial local = relief.coat().material(place.frame.coat, place.u, place.v);
  const double stiffness = instance.zoom * instance.zoom;
  const auto take = [&](MaterialChannel channel, double factor, double& value) {
    if (maps->has(channel)) value = factor * std::max(0.0, mapped(local, channel));
  };
  const double least = 1e-3 * material.stiffness;
  take(MaterialChannel::stiffness, stiffness, material.stiffness);
  // Rounding between two texels must not leave a spring without stiffness.
  material.stiffness = std::max(material.stiffness, least * 1e-9);
  take(MaterialChannel::damping, stiffness, material.damping);
  take(MaterialChannel::viscosity, stiffness, material.viscosity);
  take(MaterialChannel::magnetism, stiffness, material.magnetism);
  take(MaterialChannel::stickiness, instance.zoom, material.stickiness);
  if (maps->has(MaterialChannel::friction)) {
    const double factor = std::max(0.0, mapped(local, MaterialChannel::friction));
    material.static_friction *= factor;
    material.dynamic_friction *= factor;
  }
  return material;
}

}  // namespace

CoatPlace coat_place(const ReliefView& view, const Place& rests, const Vec3& p) noexcept {
  if (rests.known()) return {true, view.frame(rests.element), rests.at[1], rests.at[2]};
  const Foot foot = view.nearest_base(p);
  if (!foot.found()) return {};
  return {true, view.frame(foot.element), foot.at[1], foot.at[2]};
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

Material local_material(const Instance& instance, const Place& rests, const Vec3& p, const CoatMoment& moment,
                        SurfaceCache& cache) noexcept {
  if (const ReliefSurface* relief = relief_of(instance)) {
    if (relief->coat().materials() == nullptr) return instance.material;
    return mapped_material(instance, *relief, coat_place(relief->view(cache, moment), rests, p));
  }
  const ImplicitSurface* implicit = implicit_of(instance.surface);
  if (implicit == nullptr || !implicit->grid().has_materials()) return instance.material;
  // A ball's centre, or a probe pressed in, is off the surface by what the potential says.
  SparseHint& hint = cache.sparse;
  const Potential here = implicit->grid().trilinear(p, hint);
  return material_at(*implicit, instance.material, p - here.value * here.gradient, hint);
}

bool has_local_material(const Instance& instance) noexcept {
  if (const ReliefSurface* relief = relief_of(instance)) return relief->coat().materials() != nullptr;
  const ImplicitSurface* implicit = implicit_of(instance.surface);
  return implicit != nullptr && implicit->grid().has_materials();
}

Vec3 mapped_lay(const ReliefSurface& relief, const CoatPlace& place, double& strength) noexcept {
  strength = 0.0;
  const MaterialMaps* maps = relief.coat().materials();
  if (maps == nullptr || !maps->has_lay() || !place.found) return Vec3::Zero();
  const LocalMaterial local = relief.coat().material(place.frame.coat, place.u, place.v);
  const Vec3 along = local.lay.x() * place.frame.prism.edge_u + local.lay.y() * place.frame.prism.edge_v;
  const double length = along.norm();
  if (!(length > 0.0)) return Vec3::Zero();
  strength = local.lay_strength;
  return along / length;
}

double attraction_reach(const Instance& instance) noexcept {
  const ReliefSurface* relief = relief_of(instance);
  if (relief == nullptr) return 0.0;
  const MaterialMaps* maps = relief->coat().materials();
  const bool map = maps != nullptr && maps->has(MaterialChannel::magnetism);
  return map || instance.material.magnetism > 0.0 ? instance.material.magnetic_band : 0.0;
}

Attraction attraction_at(const Touched& touch, const Vec3& p) noexcept {
  const Instance& instance = *touch.instance;
  Attraction pull;
  const ReliefSurface* relief = relief_of(instance);
  const double band = attraction_reach(instance);
  if (relief == nullptr || band <= 0.0) return pull;
  ShellPlace place;
  const ReliefFrame* frame = relief->locate(p, *touch.cache, touch.moment, place);
  if (frame == nullptr) return pull;
  const FieldSample phi = relief->field(*frame, place);
  if (phi.value >= band) return pull;
  double strength = instance.material.magnetism;
  Vec3 slope = Vec3::Zero();
  const MaterialMaps* maps = relief->coat().materials();
  if (maps != nullptr && maps->has(MaterialChannel::magnetism)) {
    const double stiffness = instance.zoom * instance.zoom;
    const LocalMaterial local = relief->coat().material(frame->coat, place.u, place.v);
    constexpr auto channel = static_cast<std::size_t>(MaterialChannel::magnetism);
    const ShellGradients gradients = shell_gradients(frame->prism, place);
    strength = stiffness * local.value[channel];
    slope = stiffness * (local.slope[channel].x() * gradients.u + local.slope[channel].y() * gradients.v);
  }
  const double share = std::max(0.0, phi.value) / band;
  const double inner = 1.0 - share * share;
  const double depth = band * band / 6.0 * inner * inner * inner;
  pull.felt = true;
  pull.stiffness = strength;
  pull.potential = -strength * depth;
  pull.force = depth * slope - strength * band * share * inner * inner * phi.gradient;
  return pull;
}

}  // namespace asperity
