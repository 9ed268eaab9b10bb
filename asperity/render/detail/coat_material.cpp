#include "asperity/render/detail/coat_material.h"

#include <algorithm>

namespace asperity {

namespace {

double mapped(const LocalMaterial& local, MaterialChannel channel) noexcept {
  return local.value[static_cast<std::size_t>(channel)];
}

}  // namespace

CoatPlace coat_place(const Instance& instance, const ReliefSurface& relief, const Vec3& p, Hint& hint) noexcept {
  CoatPlace place;
  const ReliefPlace& held = hint.relief;
  if (std::holds_alternative<ProxyLaw>(instance.law) && relief.holds(held.frame, held.frame.face, hint.moment)) {
    place = {true, held.frame, held.u, held.v};
    return place;
  }
  const Foot foot = relief.base().closest(p, infinity, hint);
  if (!foot.found()) return place;
  const bool cached = relief.holds(held.frame, foot.element, hint.moment);
  place = {true, cached ? held.frame : relief.frame(foot.element, hint.moment), foot.barycentric[1],
           foot.barycentric[2]};
  return place;
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

Attraction attraction_at(const Instance& instance, const Vec3& p, Hint& hint) noexcept {
  Attraction pull;
  const ReliefSurface* relief = relief_of(instance);
  const double band = attraction_reach(instance);
  if (relief == nullptr || band <= 0.0) return pull;
  // The place that a proxy rests on is not this search's to move.
  const ReliefPlace rest = hint.relief;
  ReliefFrame frame;
  ShellPlace place;
  const bool located = relief->locate(p, hint, frame, place);
  hint.relief = rest;
  if (!located) return pull;
  const FieldSample phi = relief->field(frame, place);
  if (phi.value >= band) return pull;
  double strength = instance.material.magnetism;
  Vec3 slope = Vec3::Zero();
  const MaterialMaps* maps = relief->coat().materials();
  if (maps != nullptr && maps->has(MaterialChannel::magnetism)) {
    const double stiffness = instance.zoom * instance.zoom;
    const LocalMaterial local = relief->coat().material(frame.coat, place.u, place.v);
    constexpr auto channel = static_cast<std::size_t>(MaterialChannel::magnetism);
    const ShellGradients gradients = shell_gradients(frame.prism, place);
    strength = stiffness * local.value[channel];
    slope = stiffness * (local.slope[channel].x() * gradients.u + local.slope[channel].y() * gradients.v);
  }
  const double share = std::max(0.0, phi.value) / band;
  const double inner = 1.0 - share * share;
  const double depth = band * band / 6.0 * inner * inner * inner;
  pull.potential = -strength * depth;
  pull.force = depth * slope - strength * band * share * inner * inner * phi.gradient;
  return pull;
}

}  // namespace asperity
