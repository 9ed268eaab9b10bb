#pragma once
// What a device can do: the limits a force has to stay inside, and what its mechanics add to the hand's own.

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/result.h"

namespace asperity {

/// A haptic device as far as rendering and simulation need it. SI; values at the tip, equal in all directions.
///
/// In the built-in profiles force, stiffness, damping and workspace are the constants of CHAI3D 3.3's drivers;
/// resolution, mass, viscous damping, friction, slew limit, power, velocity and rate are our own estimates unless
/// `profile.cpp` names a source beside the number.
struct DeviceProfile {
  std::string name;                  ///< "omega.7"
  double max_force = 10.0;           ///< largest force that may be commanded (N), above 0
  double max_stiffness = 1000.0;     ///< stiffest contact that the maker's software recommends (N/m), above 0
  double max_damping = 5.0;          ///< largest rendered damping (N·s/m), 0 or more
  double workspace_radius = 0.1;     ///< of the sphere that the tip can reach (m), above 0
  double position_resolution = 0.0;  ///< smallest step of the reported position (m); 0: continuous
  double mass = 0.0;           ///< apparent mass at the tip (kg), 0 or more; of an admittance device, the virtual one
  double damping = 0.0;        ///< the mechanism's own viscous damping (N·s/m), 0 or more
  double friction = 0.0;       ///< the mechanism's own Coulomb friction (N), 0 or more
  double slew_limit = 1000.0;  ///< largest change of the commanded force (N/s), above 0
  double max_power = 10.0;     ///< most that the force may do to the hand per second (W), above 0
  double max_velocity = 5.0;   ///< of the tip (m/s), above 0: what moves faster is no hand
  double rate = 1000.0;        ///< force updates a second (Hz), above 0
  bool admittance = false;     ///< measures force and moves a virtual mass; knows its velocity without an estimate
};

/// All built-in profiles, in the order they are listed to people. [any]
std::span<const DeviceProfile> device_profiles();

/// Names of the built-in profiles, in the same order. [any]
std::vector<std::string> device_profile_names();

/// The built-in profile called `name` (case ignored). Errors: bad_value, with the nearest name and the whole list.
/// [build]
Result<DeviceProfile> find_profile(std::string_view name);

/// Checks every number of `profile` against the range its docstring gives. Errors: bad_value, with the field's name as
/// place. [build]
Status validate_profile(const DeviceProfile& profile);

}  // namespace asperity
