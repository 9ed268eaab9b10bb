#pragma once
// The last stage before any device: what no force may exceed, and when there is to be none.

#include <cstdint>
#include <string_view>

#include "asperity/core/math.h"
#include "asperity/core/names.h"
#include "asperity/core/result.h"
#include "asperity/core/samples.h"
#include "asperity/device/profile.h"

namespace asperity {

/// Why a force is withheld.
enum class Fault : std::uint8_t {
  none,
  input_not_finite,   ///< the device reported a place or a speed that is none
  output_not_finite,  ///< the renderer answered a force that is none
  too_fast,           ///< the tip moved faster than a hand does
  overrun,            ///< a tick took longer than the loop may be blind
  stalled,            ///< the renderer did not answer
  device_lost,        ///< the device no longer answers
  clock_stopped,      ///< the clock that ticks go by stands still
};
/// As in traces.
template <>
struct Names<Fault> {
  static constexpr auto table = std::to_array<Named<Fault>>({{Fault::none, "none"},
                                                             {Fault::input_not_finite, "input_not_finite"},
                                                             {Fault::output_not_finite, "output_not_finite"},
                                                             {Fault::too_fast, "too_fast"},
                                                             {Fault::overrun, "overrun"},
                                                             {Fault::stalled, "stalled"},
                                                             {Fault::device_lost, "device_lost"},
                                                             {Fault::clock_stopped, "clock_stopped"}});
};
/// What has happened, in a sentence for whoever holds the device. [any]
std::string_view fault_sentence(Fault fault) noexcept;

/// Limits that no force sent to a device may exceed, and what a hand is asked for.
struct SafetySettings {
  double max_force = 3.0;              ///< N, above 0
  double slew_limit = 1000.0;          ///< N/s, above 0
  double max_power = infinity;         ///< that the force may do to the hand (W), above 0
  double max_velocity = infinity;      ///< m/s, above 0; a tip that is faster: Fault::too_fast
  Vec3 workspace = Vec3::Zero();       ///< middle of the sphere that the tip can reach (m, world)
  double workspace_radius = infinity;  ///< of that sphere (m), above 0
  double border = 0.1;                 ///< share of the radius over which what leads out fades to nothing, 0 to 1
  Seconds engage{0.0};                 ///< over which the largest force grows from 0 each time it is let in, 0 or more
  int enabling_button = -1;            ///< of the device, 0 to 31, that has to be held for any force; -1: none has to
  Seconds longest_tick{infinity};      ///< above 0; one that took longer: Fault::overrun
  bool latches = false;                ///< a fault stays until it is acknowledged; else it is over with what caused it

  /// The profile's limits of force, slew, power and velocity: for sessions whose world is not the device's own. [any]
  static SafetySettings from_profile(const DeviceProfile& profile);
  /// What a hand is given to hold: that, the workspace about `middle` (m, world), a tick of at most 50 ms, faults that
  /// stay, and a force that is let in over half a second. [any]
  static SafetySettings for_hands(const DeviceProfile& profile, const Vec3& middle = Vec3::Zero());
};

/// What is sent to the device, and why it differs from what was rendered.
struct SafetyOutput {
  Vec3 force = Vec3::Zero();  ///< N, world; finite, within all limits
  Flags flags;                ///< only the bits that this stage sets
};

/// All that a safety stage carries from tick to tick.
struct SafetyMemory {
  Vec3 last_force = Vec3::Zero();  ///< N, world: sent at the last tick
  Seconds engaged{0.0};            ///< since it was armed
  Fault fault = Fault::none;
  bool raised = false;  ///< the fault stays although nothing latches
  bool armed = false;
  bool withheld = false;
};

/// The last stage before any device, simulated or real. [servo]
///
/// Each tick, in this order:
///  1. faults: probe or rendered force not finite (input_not_finite, output_not_finite), a tip or a tick beyond its
///     limit (fault), and one that was raised or has latched (fault): the target is zero;
///  2. the button that has to be held is not: the target is zero (not_enabled);
///  3. started inside: until a tick whose rendered force is exactly zero has been seen, the target is zero
///     (started_inside), so that a probe that begins inside an object never gets a kick; the sample's own contact flag
///     still tells that there is contact. A sample that itself says started_inside does not count as such a tick; one
///     that a volume alone pushes does: there is no inside to start from. After a latched fault, and while the button
///     is not held, it starts anew;
///  4. the magnitude is limited, direction kept (force_limited): for `engage` after it was let in to less;
///  5. the change since the last tick is limited to slew_limit * dt (slew_limited). Targets of zero are reached by this
///     ramp as well: a sudden drop is a kick too;
///  6. what leads out of the workspace is cut near its border, and all of it beyond (at_border); and what the force
///     does to the hand per second, direction kept (power_limited): at once, for both only make it smaller.
/// For every sequence of inputs the output is finite, at most `max_force`, within 6, and but for 6 changes by at most
/// slew_limit * dt.
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
  /// From here on there is no force, as while a button that has to be held is not: how a session ends.
  void withhold() noexcept { now_.withheld = true; }
  /// The device has let go by itself: the force grows from zero again, at the slew limit.
  void released() noexcept { now_.last_force.setZero(); }
  /// As at the start: no fault, last force zero, and the next contact counts as started inside until a free tick was
  /// seen.
  void reset() noexcept;

  /// A fault that the loop has seen: stays until it is acknowledged. The first one is kept.
  void raise(Fault fault) noexcept;
  /// Whoever holds the device has seen it: force is let in again as at the start, from what is commanded now.
  void acknowledge() noexcept;
  /// The one that stays, or of a stage that does not latch that of the last tick.
  [[nodiscard]] Fault fault() const noexcept { return now_.fault; }

  [[nodiscard]] const Vec3& last_force() const noexcept { return now_.last_force; }
  /// True once a tick with zero rendered force has been seen.
  [[nodiscard]] bool armed() const noexcept { return now_.armed; }
  /// What the next tick goes by beside its inputs; to go on from, in another stage with the same settings.
  [[nodiscard]] const SafetyMemory& memory() const noexcept { return now_; }
  void restore(const SafetyMemory& memory) noexcept { now_ = memory; }
  [[nodiscard]] const SafetySettings& settings() const noexcept { return settings_; }

 private:
  explicit SafetyStage(const SafetySettings& settings) : settings_(settings) {}
  /// Whether there is a fault that is not over with what caused it.
  [[nodiscard]] bool faulted() const noexcept {
    return now_.fault != Fault::none && (settings_.latches || now_.raised);
  }
  [[nodiscard]] Fault seen(const ForceSample& rendered, const ProbeSample& probe, Seconds dt) const noexcept;
  void start_anew() noexcept;
  void keep_inside(const ProbeSample& probe, Flags& flags) noexcept;
  void keep_slew(const Vec3& force, Seconds dt, Flags& flags) noexcept;

  SafetySettings settings_;
  SafetyMemory now_;
};

}  // namespace asperity
