#pragma once
// What goes into `step` and what comes out of it.

#include <cstdint>

#include "asperity/core/fixed_vector.h"
#include "asperity/core/frames.h"
#include "asperity/core/names.h"
#include "asperity/core/place.h"
#include "asperity/core/units.h"

namespace asperity {

/// Where the probe is, as the device side reports it. World frame, SI.
struct ProbeSample {
  Pose pose = {};
  Twist twist = {};           ///< estimated by the device side; its error is the estimator's to state
  std::uint32_t buttons = 0;  ///< bit i: button i of the device is pressed
  Seconds time{0.0};          ///< since the start of the run
};

/// Status of one tick. Bits, because several can hold at once.
enum class TickFlag : std::uint32_t {
  contact = 1u << 0,         ///< a surface pushes on the probe
  not_converged = 1u << 1,   ///< the constraint solve used its whole budget; the proxy is feasible, not yet optimal
  started_inside = 1u << 2,  ///< the probe began inside an object and has not left it yet; force withheld
  input_not_finite =
      1u << 3,  ///< the probe sample held a NaN, an infinity or a place 1,000 km away; the last force was not continued
  force_limited = 1u << 4,      ///< the safety stage clamped the magnitude
  slew_limited = 1u << 5,       ///< the safety stage limited the change per second
  output_not_finite = 1u << 6,  ///< the safety stage replaced a force that was not finite by zero
  contacts_dropped =
      1u << 7,  ///< more instances within reach than a probe can hold at once; the farther ones are not felt
  energy_limited =
      1u << 8,  ///< a force would have given more energy than the hand has put in, and less of it was rendered
  coarse_data = 1u << 9,     ///< part of a volume was not in memory yet and was felt from a coarser level
  field_force = 1u << 10,    ///< a volume without a surface pushes
  texture_faded = 1u << 11,  ///< a texture is finer than speed or device can render, and was felt weaker
  work_left = 1u << 12,      ///< the tick's budget was spent; the proxy goes on from where it is in the next tick
  power_limited = 1u << 13,  ///< the safety stage limited what the force does to the hand per second
  at_border = 1u << 14,      ///< near the end of the workspace: the safety stage limited the force that leads out
  not_enabled = 1u << 15,    ///< the button that has to be held is not; force withheld
  fault = 1u << 16,          ///< a fault of the loop or the device; force withheld
};
/// As in reports.
template <>
struct Names<TickFlag> {
  static constexpr auto table = std::to_array<Named<TickFlag>>({{TickFlag::contact, "contact"},
                                                                {TickFlag::not_converged, "not_converged"},
                                                                {TickFlag::started_inside, "started_inside"},
                                                                {TickFlag::input_not_finite, "input_not_finite"},
                                                                {TickFlag::force_limited, "force_limited"},
                                                                {TickFlag::slew_limited, "slew_limited"},
                                                                {TickFlag::output_not_finite, "output_not_finite"},
                                                                {TickFlag::contacts_dropped, "contacts_dropped"},
                                                                {TickFlag::energy_limited, "energy_limited"},
                                                                {TickFlag::coarse_data, "coarse_data"},
                                                                {TickFlag::field_force, "field_force"},
                                                                {TickFlag::texture_faded, "texture_faded"},
                                                                {TickFlag::work_left, "work_left"},
                                                                {TickFlag::power_limited, "power_limited"},
                                                                {TickFlag::at_border, "at_border"},
                                                                {TickFlag::not_enabled, "not_enabled"},
                                                                {TickFlag::fault, "fault"}});
};

/// A set of TickFlag.
class Flags {
 public:
  constexpr void set(TickFlag flag, bool on = true) noexcept {
    const auto bit = static_cast<std::uint32_t>(flag);
    bits_ = on ? bits_ | bit : bits_ & ~bit;
  }
  [[nodiscard]] constexpr bool has(TickFlag flag) const noexcept {
    return (bits_ & static_cast<std::uint32_t>(flag)) != 0;
  }
  [[nodiscard]] constexpr std::uint32_t bits() const noexcept { return bits_; }
  static constexpr Flags from_bits(std::uint32_t bits) noexcept {
    Flags flags;
    flags.bits_ = bits;
    return flags;
  }

 private:
  std::uint32_t bits_ = 0;
};

/// Whether the proxy was not at rest yet: it ran out of moves, or of the tick's budget. [any]
constexpr bool unfinished(const Flags& flags) noexcept {
  return flags.has(TickFlag::not_converged) || flags.has(TickFlag::work_left);
}

/// What is touched, in brief. Fields that a law does not know are left at their defaults.
struct ContactSummary {
  std::uint32_t count = 0;            ///< constraints or patches that push
  std::uint32_t instance = no_index;  ///< of the strongest one
  std::uint32_t element = no_index;   ///< face, cell or patch of that instance
  Vec3 point = Vec3::Zero();          ///< on the surface (m, world)
  Vec3 normal = Vec3::Zero();         ///< unit, outward from what is touched (world); zero without contact
  double penetration = 0.0;           ///< m, along `normal`
  double height = 0.0;                ///< relief height under the probe (m); 0 without a coat
  /// Where that instance is touched, at most three planes at once; not recorded in traces.
  FixedVector<Place, 3> places = {};
};

/// Parts of a force (heterogeneous-features-2008, eq. 1); what remains of the whole is constraint. World frame (N).
struct ForceParts {
  Vec3 friction = Vec3::Zero();
  Vec3 texture = Vec3::Zero();
  double held = 0.0;  ///< energy in the springs of friction laws (J)
};

/// What the hand should feel. World frame, SI.
struct ForceSample {
  /// `wrench.torque` is about where the hand holds the tool (SceneSettings::tool_length), zero where the scene says
  /// nothing of that. Recorded in traces, rendered by no device yet.
  Wrench wrench;
  ForceParts parts;           ///< of the wrench's force; not recorded in traces
  Vec3 proxy = Vec3::Zero();  ///< the probe's constrained twin (m); equals the probe's position in free space
  ContactSummary contact;
  Flags flags;
  /// Coarsest level of a volume that was felt; 0 is the finest. A replay asks for the same one.
  std::uint8_t level = 0;
};

}  // namespace asperity
