#include "asperity/device/profile.h"

#include <array>

#include "asperity/device/detail/checks.h"

namespace asperity {
namespace {

// Force, stiffness, damping, workspace: CHAI3D 3.3 driver constants, but for hapticmaster and ideal (below).
// Resolution, mass, viscous damping, friction, rate: estimates, chosen as follows.
//   resolution  phantom-desktop 20 um is a source's (hybrid-surface-2004); the others are the order of magnitude of the
//               makers' nominal figures, to be replaced by a measurement where one is had
//   mass        0.045 to 0.075 kg for the small Phantoms (quoted range, not verified); the parallel Delta mechanisms
//   move
//               more: 0.1 to 0.4 kg by size
//   friction    0.04 to 0.06 N for the small Phantoms (quoted range, not verified); larger ones by size
//   slew        full force within 2 ms, a usual electrical time constant of motor and amplifier, rounded up: it stops
//               kicks, and leaves what a texture asks for (some 100 N/s) alone
//   rate        1 kHz, the field's usual loop
//   power       full force on a hand that is carried along at 1 m/s: more is a device that runs away
//   velocity    5 m/s: hands reach 2 to 3
constexpr double full_force_time = 2e-3;
constexpr double carried_along = 1.0;

constexpr std::size_t profile_count = 15;

DeviceProfile impedance(const char* name, double force, double stiffness, double damping, double radius,
                        double resolution, double mass, double own_damping, double friction) {
  return {name,
          force,
          stiffness,
          damping,
          radius,
          resolution,
          mass,
          own_damping,
          friction,
          force / full_force_time,
          force * carried_along};
}

// 250 N is the papers'; the radius is that of a sphere inside their 40 x 36 cm x 1 rad wedge (checklists H-dev). 2 kg
// and 10 N/mm (low end of 10 to 50) and 8 um (middle of 4 to 12) are quoted, not verified. Damping and the 2.5 kHz of
// its inner loop are estimates; its force loop takes friction away.
DeviceProfile hapticmaster() {
  DeviceProfile profile = impedance("hapticmaster", 250.0, 10000.0, 100.0, 0.18, 8e-6, 2.0, 0.0, 0.0);
  profile.rate = 2500.0;
  profile.admittance = true;
  return profile;
}

// No device: every limit out of the way of what a hand could feel, nothing added by mechanics.
DeviceProfile ideal() {
  DeviceProfile profile = impedance("ideal", 1000.0, 1e6, 1000.0, 0.1, 0.0, 0.0, 0.0, 0.0);
  profile.slew_limit = 1e9;
  profile.max_power = 1e9;
  profile.max_velocity = 1e6;
  return profile;
}

const std::array<DeviceProfile, profile_count>& profile_table() {
  static const std::array<DeviceProfile, profile_count> profiles{
      impedance("omega.3", 12.0, 5000.0, 30.0, 0.075, 10e-6, 0.20, 1.0, 0.10),
      impedance("omega.6", 12.0, 5000.0, 30.0, 0.075, 10e-6, 0.25, 1.0, 0.12),
      impedance("omega.7", 12.0, 5000.0, 30.0, 0.075, 10e-6, 0.27, 1.0, 0.12),
      impedance("delta.3", 20.0, 5000.0, 30.0, 0.15, 20e-6, 0.40, 2.0, 0.20),
      impedance("sigma.7", 12.0, 4000.0, 30.0, 0.075, 10e-6, 0.30, 1.0, 0.15),
      impedance("lambda.7", 12.0, 8000.0, 30.0, 0.1125, 10e-6, 0.35, 1.5, 0.15),
      impedance("falcon", 8.0, 3000.0, 20.0, 0.04, 60e-6, 0.15, 1.0, 0.30),
      impedance("touch", 3.3, 400.0, 4.0, 0.075, 55e-6, 0.045, 0.3, 0.06),
      impedance("phantom-omni", 3.3, 700.0, 5.0, 0.10, 55e-6, 0.045, 0.3, 0.06),
      impedance("phantom-desktop", 7.9, 1000.0, 5.0, 0.10, 20e-6, 0.045, 0.3, 0.06),
      impedance("premium-1.5", 8.5, 800.0, 5.0, 0.12, 30e-6, 0.075, 0.3, 0.04),
      impedance("premium-3.0", 22.0, 1000.0, 5.0, 0.25, 20e-6, 0.16, 0.5, 0.20),
      impedance("inverse3", 10.0, 1000.0, 6.0, 0.15, 30e-6, 0.20, 0.5, 0.10),
      hapticmaster(),
      ideal(),
  };
  return profiles;
}

}  // namespace

std::span<const DeviceProfile> device_profiles() {
  return profile_table();
}

std::vector<std::string> device_profile_names() {
  return names_in(device_profiles());
}

Result<DeviceProfile> find_profile(std::string_view name) {
  return find_in(device_profiles(), name, "device");
}

Status validate_profile(const DeviceProfile& profile) {
  const DeviceProfile& p = profile;
  ASPERITY_CHECK(require(p.max_force > 0.0, "max_force", p.max_force, "a force above 0 (N)"));
  ASPERITY_CHECK(require(p.max_stiffness > 0.0, "max_stiffness", p.max_stiffness, "a stiffness above 0 (N/m)"));
  ASPERITY_CHECK(require(p.max_damping >= 0.0, "max_damping", p.max_damping, "a damping of 0 or more (N s/m)"));
  ASPERITY_CHECK(require(p.workspace_radius > 0.0, "workspace_radius", p.workspace_radius, "a length above 0 (m)"));
  ASPERITY_CHECK(
      require(p.position_resolution >= 0.0, "position_resolution", p.position_resolution, "a length of 0 or more (m)"));
  ASPERITY_CHECK(require(p.mass >= 0.0, "mass", p.mass, "a mass of 0 or more (kg)"));
  ASPERITY_CHECK(require(p.damping >= 0.0, "damping", p.damping, "a damping of 0 or more (N s/m)"));
  ASPERITY_CHECK(require(p.friction >= 0.0, "friction", p.friction, "a force of 0 or more (N)"));
  ASPERITY_CHECK(require(p.slew_limit > 0.0, "slew_limit", p.slew_limit, "a force rate above 0 (N/s)"));
  ASPERITY_CHECK(require(p.max_power > 0.0, "max_power", p.max_power, "a power above 0 (W)"));
  ASPERITY_CHECK(require(p.max_velocity > 0.0, "max_velocity", p.max_velocity, "a speed above 0 (m/s)"));
  return require(p.rate > 0.0 && p.rate <= 1e6, "rate", p.rate, "a rate above 0 and up to 1 MHz (Hz)");
}

}  // namespace asperity
