#pragma once

#include <array>
#include <cstdint>

#include "asperity/core/samples.h"
#include "asperity/device/hand.h"
#include "asperity/device/profile.h"
#include "asperity/device/stroke.h"
#include "asperity/device/velocity_estimator.h"

namespace asperity {

/// How the simulated hand and device are integrated, beyond hand and profile.
struct SimulatedDeviceSettings {
  double force_bandwidth = 4.0;  ///< how fast the pressing force builds up and fades (Hz), above 0; people: 2 to 5
  double reach = 0.01;           ///< below the surface, where the arm's own spring stops a pressing hand (m), above 0
  double tremor = 0.0;           ///< RMS of the hand's tremor (m), each axis, 8 to 12 Hz; 0: none
  std::uint64_t seed = 1;        ///< of the tremor
  double max_substep = 50e-6;    ///< longest integration step (s), above 0
  /// At its end the hand goes the stroke back, and so on: such a device never has finished.
  bool back_and_forth = false;
};

/// A hand that holds a device: the closed loop that a renderer meets in life. Deterministic. [servo]
///
/// One body of mass (hand + device) is pulled by: the commanded force, held between ticks and saturated at the
/// profile's limit; the hand's spring (limited) and damper towards the stroke's target in the tangent plane; along the
/// normal either the same spring (depth strokes, approach and lift) or a constant push with the hand's damper (force
/// strokes); the device's viscous damping and Coulomb friction. Positions are reported in steps of the encoder, the
/// velocity as estimated from them (an admittance device knows the velocity of its virtual mass and reports that).
///
/// Integration: `max_substep` or shorter; spring and dampers are taken implicitly, friction as implicit Coulomb
/// friction (Kikuuwe et al. 2005), so the hand and device alone are stable for any step and never gain energy; the
/// error per second is of first order in the sub-step (numerical damping ratio omega h / 2: 0.0013 for the default hand
/// at 50 us). The commanded force is explicit, as in a real sampled loop: a stiff contact can be unstable here exactly
/// because it is there.
class SimulatedDevice {
 public:
  /// Starts at rest at the stroke's first pose. Errors: bad_value of profile, hand or settings, with the field's name.
  /// [build]
  static Result<SimulatedDevice> build(StrokePath path, const DeviceProfile& profile, const HandImpedance& hand,
                                       const SimulatedDeviceSettings& settings = {});

  [[nodiscard]] ProbeSample read() noexcept;
  /// Holds `force` for `dt` and advances. A force that is not finite counts as zero: the safety stage never sends one.
  void apply(const Vec3& force, Seconds dt) noexcept;
  [[nodiscard]] Vec3 aim() const noexcept { return aim_; }
  [[nodiscard]] bool finished() const noexcept { return !settings_.back_and_forth && time_ > path_.duration().count(); }

  [[nodiscard]] const StrokePath& path() const noexcept { return path_; }
  [[nodiscard]] const DeviceProfile& profile() const noexcept { return profile_; }
  /// True position (m) and velocity (m/s), before encoder and estimator; for tests and metrics.
  [[nodiscard]] const Vec3& position() const noexcept { return position_; }
  [[nodiscard]] const Vec3& velocity() const noexcept { return velocity_; }
  /// Error bound of the reported velocity at constant speed (m/s), per axis; zero for an admittance device.
  [[nodiscard]] Vec3 velocity_error_bound() const noexcept;

 private:
  struct TremorTone {
    double frequency = 0.0;
    Vec3 phase = Vec3::Zero();
  };

  /// Sum of the forces at the start of a sub-step, without those that are taken implicitly, and the springs that are.
  struct Drive {
    Vec3 force = Vec3::Zero();
    double stiffness_normal = 0.0;
    double stiffness_tangent = 0.0;
  };

  SimulatedDevice(StrokePath path, const DeviceProfile& profile, const HandImpedance& hand,
                  const SimulatedDeviceSettings& settings);
  [[nodiscard]] StrokePose pose() const noexcept;
  [[nodiscard]] Drive drive(const StrokePose& pose, const Vec3& force) const noexcept;
  void substep(const Vec3& force, double h) noexcept;
  void update_normal_mode(const StrokePose& pose, double h) noexcept;
  [[nodiscard]] Vec3 tremor_offset(double time) const noexcept;
  [[nodiscard]] Vec3 quantised(const Vec3& position) const noexcept;

  StrokePath path_;
  DeviceProfile profile_;
  HandImpedance hand_;
  SimulatedDeviceSettings settings_;
  VelocityEstimator estimator_;
  std::array<TremorTone, 4> tones_{};
  double time_ = 0.0;
  Vec3 position_ = Vec3::Zero();
  Vec3 velocity_ = Vec3::Zero();
  Vec3 aim_ = Vec3::Zero();
  double push_ = 0.0;         // present pressing force (N)
  double lift_offset_ = 0.0;  // height at which a pressing hand began to lift (m)
  bool lifting_ = false;
};

}  // namespace asperity
