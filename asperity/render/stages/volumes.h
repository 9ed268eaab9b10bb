#pragma once
// Volumes larger than memory: which of their levels a tick can be felt from.

#include "asperity/render/scene.h"
#include "asperity/render/state.h"

namespace asperity {

/// Every place that one tick may ask a volume about: the proxy never gets farther from the probe than it is, and both
/// the law's searches and the gradient look a few cells around. Object frame. [servo]
Box tick_reach(const ScalarField& field, const Pose& pose, const ProxyState& state, const Vec3& probe,
               double probe_radius) noexcept;

/// Calls visit(field, pose) for every volume of a scene that reads bricks, with a surface or without. [servo]
template <class Visit>
void for_each_volume(const Scene& scene, Visit&& visit) noexcept {
  if (!scene.reads_bricks()) return;
  for (const Instance& instance : scene.felt()) {
    if (const IsoSurface* iso = iso_of(instance.surface)) visit(iso->field(), instance.world_from_object);
  }
  for (const FieldEffect& effect : scene.felt_effects()) visit(*effect.field, effect.world_from_object);
}

}  // namespace asperity
