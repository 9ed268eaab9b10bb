#pragma once
// A slider on a surface, pulled by a spring whose far end moves at constant speed: m x'' = k (V t - x) + f, with the
// friction force f of any law of asperity/material/friction.h. What tribometers measure, and what friction_fit.h fits.

#include "asperity/core/result.h"
#include "asperity/core/units.h"
#include "asperity/material/friction.h"
#include "asperity/study/friction_trace.h"

namespace asperity {

/// The slider, what pulls it, and how it is integrated.
struct RigSettings {
  double mass = 0.02;              ///< kg, above 0
  double load = 0.2;               ///< normal force on the surface (N), above 0
  double stiffness = 168.0;        ///< of the pulling spring (N/m), above 0
  double speed = 42e-6;            ///< of its far end (m/s), above 0
  double contact_stiffness = 1e4;  ///< of the contact's tangential spring where the law has none of its own (N/m)
  double start = 0.0;              ///< spring force over load at the beginning
  double start_speed = 0.0;        ///< of the slider at the beginning (m/s)
  Seconds warm_up{0.0};            ///< not recorded
  Seconds duration{1.0};           ///< recorded
  Seconds spacing{5e-4};           ///< between recorded samples: a whole number of steps, `dt` or more
  Seconds dt{1e-4};                ///< of a step, above 0 and short against the slider's own swings
};

/// Pulls the slider. The velocity that the law is told is the slider's own, the motion its displacement in a step
/// (semi-implicit Euler, whose free swings neither grow nor decay).
/// Errors: bad_value (not above 0, not finite, more than 1e8 steps; the law's own validate). [main]
Result<FrictionTrace> pull_slider(const FrictionLaw& law, const FrictionCoefficients& coefficients,
                                  const RigSettings& settings);

}  // namespace asperity
