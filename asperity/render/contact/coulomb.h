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

/// Whether a proxy at `at`, with friction, slips from there while the probe pulls it: `slide` moves it towards where
/// the cone lets it go and answers its new place. False: it sticks, or a slide would have led it farther from the probe
/// (on a bent surface its spring would gain), and the caller puts it back. `sliding`: friction was overcome at the last
/// tick, and is now. [servo]
template <class Slide>
bool slips(const Friction& friction, const Vec3& at, const Vec3& normal, const Vec3& probe, bool& sliding,
           Slide&& slide) noexcept {
  // What came to rest on the cone lies on it to within rounding.
  constexpr double on_cone = 1e-6;
  const double coefficient = sliding ? friction.sliding * (1.0 + on_cone) : friction.still;
  if (friction_goal(at, normal, probe, coefficient) == at) {
    // It holds, and next time it must be torn off again.
    sliding = false;
    return false;
  }
  sliding = true;
  const Vec3 to = slide();
  constexpr double rounding = 1e-12;
  return (to - probe).squaredNorm() <= (at - probe).squaredNorm() * (1.0 + rounding);
}

}  // namespace asperity
