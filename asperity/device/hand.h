#pragma once
// How a hand holds the device: a mass, a damper and a spring to where the hand wants to be.

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/result.h"

namespace asperity {

/// Second-order hand impedance, equal in all directions (form: Hasser & Cutkosky 2002).
struct HandImpedance {
  std::string name = "default";
  double mass = 0.15;          ///< of the hand that moves with the device (kg), above 0
  double damping = 6.0;        ///< against the motion the hand intends (N·s/m), 0 or more
  double stiffness = 400.0;    ///< towards the position the hand intends (N/m), above 0
  double lateral_limit = 4.0;  ///< largest tangential force the hand spends on following its path (N), above 0
};

/// Built-in hands: default (0.15 kg, 6 N·s/m, 400 N/m), light and firm (the ends of the population that the papers'
/// bands are drawn from), paper (0.25, 6.5, 400: the simulated subject behind the evidence for hrm-2010, H-III). [any]
std::span<const HandImpedance> hand_presets();

/// Names of the built-in hands, in the same order. [any]
std::vector<std::string> hand_preset_names();

/// The built-in hand called `name` (case ignored). Errors: bad_value, with the nearest name and the whole list. [build]
Result<HandImpedance> find_hand(std::string_view name);

/// Checks every number of `hand` against its range. Errors: bad_value, with the field's name as place. [build]
Status validate_hand(const HandImpedance& hand);

}  // namespace asperity
