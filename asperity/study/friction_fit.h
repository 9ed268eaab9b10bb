#pragma once
// Friction laws against measured stick-slip: parameters are fitted on some traces, and the others predicted.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "asperity/core/progress.h"
#include "asperity/core/result.h"
#include "asperity/material/friction.h"
#include "asperity/study/friction_rig.h"
#include "asperity/study/friction_trace.h"
#include "asperity/study/minimiser.h"

namespace asperity {

/// A measured trace and what it is for.
struct FitTrace {
  FrictionTrace trace;
  bool fitted = true;  ///< false: only predicted
};

/// How laws are fitted.
struct FitSettings {
  std::vector<FrictionKind> laws;  ///< at least one
  std::optional<double> mass;      ///< of the slider (kg); without it fitted
  std::optional<double> load;      ///< N; without it mass times gravity where `tied`: the slider's weight
  bool tied = true;                ///< false: load and mass are fitted apart
  double gravity = 9.81;           ///< m/s^2
  StickSlipSettings stick_slip;    ///< for measured and predicted traces alike; each trace has its own threshold
  /// Searched for at most so many evaluations for each parameter: over all of the bounds, then around the best.
  std::size_t global_evaluations = 50;
  std::size_t local_evaluations = 30;
  std::uint32_t seed = 1;
  Seconds dt{1e-4};  ///< step of the rig
  /// What is simulated of a trace: the longer of so many measured periods and of so much time. The warm-up lets
  /// the slider forget that it began at rest.
  double warm_up_periods = 1.2;
  Seconds warm_up{3.0};
  double periods = 5.0;
  Seconds duration{0.5};
};

/// Natural logarithms of predicted over measured: 0.1 is about 10 % too much. `shape` is the RMS difference of the
/// median cycles over the RMS of the measured one.
struct FitErrors {
  double level = 0.0;  ///< mean friction over load
  double period = 0.0;
  double amplitude = 0.0;
  double ratio = 0.0;  ///< static over dynamic
  double shape = 0.0;
  /// Root of the mean square of the five. [any]
  [[nodiscard]] double misfit() const;
};

/// What a prediction that slides where stick-slip was measured is given for its period, amplitude (at least) and shape;
/// so is stick-slip where steady sliding was measured.
inline constexpr double error_of_missing = 1.5;

/// A trace against a law.
struct TraceComparison {
  StickSlip measured;
  StickSlip predicted;
  FitErrors errors;
  FrictionTrace prediction;  ///< after the warm-up
  /// Begun at the drive's speed instead of at rest, the slider swings half as much or less: the law allows both this
  /// motion and steady sliding, and how it began decides.
  bool also_slides = false;
};

/// A law with the parameters that suit the fitted traces best.
struct LawFit {
  FrictionLaw law;
  FrictionCoefficients coefficients;
  double mass = 0.0;                    ///< kg
  double load = 0.0;                    ///< N
  std::vector<std::string> parameters;  ///< those that were searched, by their names in FrictionLaw, and "mass"
  std::vector<std::string> at_bounds;   ///< of these, those that ended at an end of what was searched
  std::vector<TraceComparison> traces;  ///< one for each that was given, in its order
  double fitted_misfit = 0.0;           ///< root of the mean square over the fitted traces
  double predicted_misfit = 0.0;        ///< over the others; 0 where there are none
  double step_error = 0.0;              ///< largest change of any trace's misfit when the step is halved
  std::size_t evaluations = 0;
};

/// Chooses what to fit on where nobody did: with traces in the order of speed times the root of stiffness, which goes
/// from stick-slip to inertial swings, every other one from the first is fitted, but never the last. With fewer than
/// three all are fitted. [main]
void choose_fitted(std::vector<FitTrace>& traces);

/// The number of a friction law that a parameter is; nullptr: none. [any]
double FrictionLaw::*member_of_law(const std::string& name);

/// Compares two measurements of stick-slip; `threshold` of both should be the same. [main]
FitErrors compare_stick_slip(const StickSlip& measured, const StickSlip& predicted);

/// The law's motion of the slider under a trace's drive, as `traces` of LawFit have it. Errors: of pull_slider. [main]
Result<TraceComparison> predict_trace(const LawFit& fit, const FrictionTrace& trace, const FitSettings& settings);

/// Fits every law on the fitted traces and predicts the others, in the order of settings.laws. The cost is the root
/// of the mean square of the fitted traces' misfits. The same input gives the same answer.
/// Errors: bad_value (no traces, none fitted, no laws), of the minimiser and of pull_slider. [main]
Result<std::vector<LawFit>> fit_friction(std::span<const FitTrace> traces, const FitSettings& settings,
                                         const Minimiser& minimiser, const Progress& progress);

}  // namespace asperity
