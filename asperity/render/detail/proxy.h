#pragma once
// The proxy law on one relief touched by a point: the servo loop's fast path. Private to render.

#include "asperity/render/law_forces.h"
#include "asperity/surface/relief_descent.h"

namespace asperity {

/// Coulomb's coefficients of a material under a law.
struct Friction {
  double still = 0.0;
  double sliding = 0.0;
  double grip = 0.0;  ///< m: how far off a sticky surface the probe may be drawn before it lets go
};
/// A material's coefficients, and its grip; no coefficients unless the proxy itself holds the friction. [servo]
Friction friction_of(const Instance& instance, const Material& material) noexcept;

/// Where the proxy of a point came to rest.
struct ProxyRest {
  bool contact = false;
  bool sliding = false;
  bool converged = true;
  Vec3 proxy = Vec3::Zero();   ///< m
  Vec3 normal = Vec3::Zero();  ///< unit, on the side touched
  bool pulls = false;          ///< the probe is outside, and a sticky surface holds on to it
};

/// One tick on one relief, object frame: from the state's place, or from `from` through free space, towards `probe`.
/// [servo]
ProxyRest solve_on_relief(const ReliefSurface& surface, Sides sides, const Friction& friction, const Vec3& from,
                          const Vec3& probe, ContactState& state) noexcept;

}  // namespace asperity
