#pragma once
// Coulomb's law for whatever holds the proxy: a point on one surface, or several planes.

#include "asperity/surface/view.h"

namespace asperity {

/// Coulomb's coefficients of a material under a law.
struct Friction {
  double still = 0.0;
  double sliding = 0.0;
  double grip = 0.0;  ///< m: how far off a sticky surface the probe may be drawn before it lets go
};

/// Whether friction holds a proxy at `at` while the probe pulls it; otherwise it slips, to where the cone lets it go.
/// `sliding`: friction was overcome at the last tick, and is now. [servo]
inline bool holds(const Friction& friction, const Vec3& at, const Vec3& normal, const Vec3& probe,
                  bool& sliding) noexcept {
  // What came to rest on the cone lies on it to within rounding.
  constexpr double on_cone = 1e-6;
  sliding = !within_cone(at, normal, probe, sliding ? friction.sliding * (1.0 + on_cone) : friction.still);
  return !sliding;
}

/// Whether a slide has not led it farther from the probe: on a bent surface its spring would gain, and it is put back.
/// [servo]
inline bool no_farther(const Vec3& to, const Vec3& from, const Vec3& probe) noexcept {
  constexpr double rounding = 1e-12;
  return (to - probe).squaredNorm() <= (from - probe).squaredNorm() * (1.0 + rounding);
}

/// Where the proxy of a point came to rest.
struct PointRest {
  bool simple = true;  ///< false: more than one plane may hold it, and nothing but on_edge is known
  bool contact = false;
  bool converged = true;
  bool pulls = false;          ///< the probe is outside, and a sticky surface holds on to it
  Vec3 proxy = Vec3::Zero();   ///< m
  Vec3 normal = Vec3::Zero();  ///< unit, on the side touched
  bool on_border = false;      ///< not simple: on an edge or a vertex, held by the faces around
};

}  // namespace asperity
