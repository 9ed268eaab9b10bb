#pragma once

#include "asperity/core/result.h"
#include "asperity/core/samples.h"
#include "asperity/device/profile.h"

namespace asperity {

/// Limits that no force sent to a device may exceed.
struct SafetySettings {
  double max_force = 3.0;      ///< N, above 0
  double slew_limit = 1000.0;  ///< N/s, above 0

  static SafetySettings from_profile(const DeviceProfile& profile) { return {profile.max_force, profile.slew_limit}; }
};

/// What is sent to the device, and why it differs from what was rendered.
struct SafetyOutput {
  Vec3 force = Vec3::Zero();  ///< N, world; finite, within both limits
  Flags flags;                ///< only the bits that this stage sets
};

/// The last stage before any device, simulated or real. [servo]
///
/// Each tick, in this order:
///  1. probe or rendered force not finite: the target is zero (input_not_finite, output_not_finite);
///  2. started inside: until a tick whose rendered force is exactly zero has been seen, the target is zero
///     (started_inside), so that a probe that begins inside an object never gets a kick; the sample's own contact flag
///     still tells that there is contact. A sample that itself says started_inside does not count as such a tick; one
///     that a volume alone pushes does: there is no inside to start from;
///  3. the magnitude is limited, direction kept (force_limited);
///  4. the change since the last tick is limited to slew_limit * dt (slew_limited). Targets of zero are reached by this
///     ramp as well: a sudden drop is a kick too.
/// For every sequence of inputs the output is finite, at most `max_force`, and changes by at most slew_limit * dt.
/// Limiting the magnitude is passive, limiting the slew is not (formulation.md, amendment 6): an energy observer
/// belongs after this stage.
class SafetyStage {
 public:
  /// Errors: bad_value with the setting's name as place. [build]
  static Result<SafetyStage> build(const SafetySettings& settings);

  /// The force to send for `rendered`, answered to `probe`, to be held for `dt`. A `dt` that is not a positive number
  /// allows no change: the last force is held.
  SafetyOutput apply(const ForceSample& rendered, const ProbeSample& probe, Seconds dt) noexcept;
  /// Ramps to zero at the slew limit: what a loop sends when it has no new force (overrun, stop).
  SafetyOutput ramp_down(Seconds dt) noexcept;
  /// As at the start: last force zero, and the next contact counts as started inside until a free tick was seen.
  void reset() noexcept;

  [[nodiscard]] const Vec3& last_force() const noexcept { return last_; }
  /// True once a tick with zero rendered force has been seen.
  [[nodiscard]] bool armed() const noexcept { return armed_; }
  [[nodiscard]] const SafetySettings& settings() const noexcept { return settings_; }

 private:
  explicit SafetyStage(const SafetySettings& settings) : settings_(settings) {}
  SafetyOutput limit(const Vec3& target, Seconds dt, Flags flags) noexcept;

  SafetySettings settings_;
  Vec3 last_ = Vec3::Zero();
  bool armed_ = false;
};

}  // namespace asperity
