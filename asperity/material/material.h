#pragma once

#include "asperity/core/result.h"
#include "asperity/material/friction.h"

namespace asperity {

/// What a surface is made of, as far as the hand can tell.
struct Material {
  double stiffness = 1000.0;  ///< N/m, above 0
  double damping = 0.0;       ///< N·s/m along the normal, not negative; it never pulls the probe inward
  /// Coulomb's coefficients: the probe sticks while the tangential force is at most static_friction times the normal
  /// force, and slides with dynamic_friction times it. 0 <= dynamic <= static.
  double static_friction = 0.0;
  double dynamic_friction = 0.0;
  /// How they are felt. The default needs no state of its own under the proxy law, whose proxy is its anchor; under
  /// laws without a proxy friction is felt where a law is named (`friction_named`).
  FrictionLaw friction = {};
  /// The friction law was chosen on purpose: it is felt under every contact law.
  bool friction_named = false;
};

/// Errors: bad_value, naming the field and what would be accepted. [build]
Status validate(const Material& material);

}  // namespace asperity
