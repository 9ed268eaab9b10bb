#pragma once

#include "asperity/core/samples.h"
#include "asperity/device/stroke.h"

namespace asperity {

/// How the ideal probe regulates a normal force. Depth strokes do not read it.
struct IdealProbeSettings {
  double stiffness_estimate = 1000.0;  ///< of the contact (N/m), above 0; the true one may be up to twice this
  double bandwidth = 20.0;             ///< of the regulator (Hz), above 0
  double max_depth = 0.01;             ///< regulated depth stays within this, below and above the surface (m), above 0
};

/// A probe without mass or hand: exactly on its stroke, at the given depth or regulated to the given normal force.
/// [servo]
///
/// The regulator is quasi-static: each tick  depth += (1 - exp(-2 pi bandwidth dt)) (F_target - F_n) /
/// stiffness_estimate, with F_n the last commanded force along the stroke's normal. On a linear contact whose stiffness
/// is the estimate, the force error decays by exp(-2 pi bandwidth t) whatever dt is. The reported twist is the exact
/// velocity of the motion.
class IdealProbe {
 public:
  /// Errors: bad_value with the setting's name as place. [build]
  static Result<IdealProbe> build(StrokePath path, const IdealProbeSettings& settings = {});

  [[nodiscard]] ProbeSample read() noexcept;
  void apply(const Vec3& force, Seconds dt) noexcept;
  /// The probe's own position: nothing pulls it elsewhere.
  [[nodiscard]] Vec3 aim() const noexcept { return position_; }
  [[nodiscard]] bool finished() const noexcept { return time_ > path_.duration().count(); }

  [[nodiscard]] const StrokePath& path() const noexcept { return path_; }
  /// Regulated depth (m); 0 for depth strokes.
  [[nodiscard]] double regulated_depth() const noexcept { return depth_; }

 private:
  IdealProbe(StrokePath path, const IdealProbeSettings& settings);
  void place() noexcept;

  StrokePath path_;
  IdealProbeSettings settings_;
  double time_ = 0.0;
  double depth_ = 0.0;
  double depth_rate_ = 0.0;
  StrokePose pose_;
  Vec3 position_ = Vec3::Zero();
  Vec3 velocity_ = Vec3::Zero();
};

}  // namespace asperity
