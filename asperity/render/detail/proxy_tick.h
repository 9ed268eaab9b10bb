#pragma once
// One tick of everything that moves the proxy: the laws "proxy", "god-object" and "force-shading". Private to render.

#include "asperity/render/law_forces.h"

namespace asperity {

/// What the constrained instances answer together, world frame.
struct ProxyAnswer {
  struct Part {
    std::uint32_t instance = no_index;
    LawForce law;
    double stiffness = 0.0;  ///< N/m, where it is touched
  };
  Vec3 proxy = Vec3::Zero();  ///< to carry to the next tick (m)
  Vec3 felt = Vec3::Zero();   ///< to show: without skins
  FixedVector<Part, 4> parts;
  bool converged = true;
  bool energy_limited = false;
  double rendered_share = 1.0;  ///< of the parts' stiffness, where energy was limited
};

/// Solves for the instances of the state's slots whose law constrains. Reads and writes the state's tank and friction,
/// not its proxy. `held`: where the proxy was at the end of the last tick, before a change of the scene moved it: what
/// the spring may hold is counted from there. `moved`: an isosurface is on its way to another threshold and may have
/// come into a ball. [servo]
ProxyAnswer solve_proxies(const Scene& scene, ProxyState& state, const ProbeSample& probe, const Vec3& held,
                          bool moved) noexcept;

/// The place on the front (or the back) of a surface nearest to a proxy (world) that it has come over; the proxy where
/// that is there already. [servo]
Vec3 pushed_to_front(const Scene& scene, const Instance& instance, bool front_side, ContactState& slot,
                     const Vec3& proxy) noexcept;

/// After a change of the scene: where the proxy may start, outside of every front that it would now be behind. [servo]
Vec3 reacquired(const Scene& scene, ProxyState& state) noexcept;

}  // namespace asperity
