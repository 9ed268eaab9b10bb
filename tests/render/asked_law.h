#pragma once
// Laws that are asked without a scene around them.

#include "asperity/render/touched_surface.h"

namespace asperity::test {

/// What `law` answers where a contact is in `state`.
template <class L>
LawForce asked(const L& law, const Surface& surface, const FeltView& view, const Material& material, const Vec3& p,
               const Vec3& velocity, Seconds dt, Contact& state, SurfaceCache& cache) {
  Instance instance;
  instance.surface = surface;
  InstanceFacts facts;
  facts.adds_friction = material.friction_named;
  Touched touch;
  touch.facts = &facts;
  touch.instance = &instance;
  touch.contact = &state;
  touch.cache = &cache;
  touch.view = view;
  const TouchedSurface touched(touch);
  if constexpr (requires { typename L::State; }) {
    auto& memory = detail::law_state<typename L::State>(state.law.memory);
    return law.force(touched, material, p, velocity, dt, memory);
  } else {
    return law.force(touched, material, p, velocity, dt);
  }
}

}  // namespace asperity::test
