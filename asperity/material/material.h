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
  /// Against any motion while in touch (N·s/m), not negative: moving through honey.
  double viscosity = 0.0;
  /// The surface draws the probe from outside by a force of at most `magnetism` times `magnetic_band` over 3.5, with
  /// the potential of MagneticLaw's consistent form: magnetism (N/m) how steeply it rises from the surface, the band
  /// (m) how far it reaches. Coated meshes, a point, by the laws proxy, height-field and mesostructure.
  double magnetism = 0.0;
  double magnetic_band = 0.002;
  /// Pull (N) up to which the proxy stays on the surface: sticky. Law proxy on coated meshes, a point alone.
  double stickiness = 0.0;
  /// How they are felt. The default needs no state of its own under the proxy law, whose proxy is its anchor; under
  /// laws without a proxy friction is felt where a law is named (`friction_named`).
  FrictionLaw friction = {};
  /// The friction law was chosen on purpose: it is felt under every contact law.
  bool friction_named = false;
};

/// Errors: bad_value, naming the field and what would be accepted. [build]
Status validate(const Material& material);

}  // namespace asperity
