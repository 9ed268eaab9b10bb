#pragma once
// Records of a slider that is pulled by a spring over a surface: measured ones from CSV files, simulated ones from
// friction_rig.h, and what stick-slip there is in either.

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/core/units.h"

namespace asperity {

/// Spring force over load, evenly sampled, with what drove it.
struct FrictionTrace {
  std::string name;              ///< of the file without its extension
  double stiffness = 0.0;        ///< of the pulling spring (N/m)
  double speed = 0.0;            ///< of its far end (m/s)
  double spacing = 0.0;          ///< between samples (s)
  std::vector<double> friction;  ///< spring force over load
};

/// What a file does not say itself. Its name does where it has "k168Nm" (N/m) and "v42" (um/s).
struct FrictionTraceSettings {
  std::optional<double> stiffness;  ///< N/m, for names without one
  std::optional<double> speed;      ///< m/s, likewise
};

/// Reads a CSV file with the columns t_s (s) and friction_over_load; others are passed over. Samples that are not
/// evenly spaced are interpolated to their median spacing.
/// Errors: file_missing, file_empty, too_large, file_malformed (columns missing, no number, not finite, time not
/// increasing: the line is named), bad_value (too few samples; neither name nor settings say stiffness or speed).
/// [main]
Result<FrictionTrace> read_friction_trace(const std::filesystem::path& path, const FrictionTraceSettings& settings);

/// How stick-slip is told from noise.
struct StickSlipSettings {
  Seconds filter{5e-3};    ///< width of the running median that takes out impulses; not negative
  double threshold = 0.0;  ///< a drop of friction over load is an event from this on; 0: threshold_of the trace
};

/// Stick-slip of one trace. Events are drops from a peak to the next valley by the threshold or more.
struct StickSlip {
  std::size_t events = 0;
  double threshold = 0.0;      ///< that was used
  double level = 0.0;          ///< mean of friction over load
  double swing = 0.0;          ///< from its 2nd to its 98th percentile
  double period = 0.0;         ///< mean time from peak to peak (s); 0: fewer than 3 events, steady sliding
  double period_spread = 0.0;  ///< standard deviation (s)
  double amplitude = 0.0;      ///< mean drop of the events; 0 where steady
  double amplitude_spread = 0.0;
  double still = 0.0;         ///< mean peak: the static level; `level` where steady
  double sliding = 0.0;       ///< mean middle of the drops: the dynamic level, since a slip overshoots as far below it
  std::vector<double> cycle;  ///< median cycle, valley to valley, less its mean (friction over load); empty: steady

  /// Static over dynamic level. [any]
  [[nodiscard]] double ratio() const { return sliding > 0.0 ? still / sliding : 1.0; }
  [[nodiscard]] bool steady() const { return period <= 0.0; }
};

/// Running median over `width` samples, an odd number; ends are taken over what there is. [main]
std::vector<double> running_median(const std::vector<double>& values, std::size_t width);

/// The trace after the filter. [main]
std::vector<double> filtered(const FrictionTrace& trace, const StickSlipSettings& settings);

/// Stick-slip of a trace. The threshold, where none is given, is 0.15 of the filtered trace's range from the 5th to the
/// 95th percentile, and three times the noise that the filter took out at least. [main]
StickSlip measure_stick_slip(const FrictionTrace& trace, const StickSlipSettings& settings);

/// Load (N) that the steepest lasting rises speak of: while the slider sticks friction over load grows by stiffness
/// times speed over load. Creep makes it too large, never too small. 0 where nothing rises. [main]
double load_of_sticking(const FrictionTrace& trace, const StickSlipSettings& settings);

}  // namespace asperity
