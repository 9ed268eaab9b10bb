#pragma once
// The numbers of a run. Each is one sentence here, one function in metrics.cpp and one test.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "asperity/render/energy/account.h"
#include "asperity/study/follow.h"
#include "asperity/study/series.h"
#include "asperity/study/spectrum.h"

namespace asperity {

/// Commanded force over the ticks in contact (N).
struct ForceMetrics {
  double mean = 0.0;
  double max = 0.0;
  double rms = 0.0;
  double mean_normal = 0.0;     ///< along the stroke's normal
  double largest_jump = 0.0;    ///< largest change of the force vector from one tick to the next, whole run
  std::uint64_t jump_tick = 0;  ///< the tick it arrived at
  double jump_distance = 0.0;   ///< travelled distance there (m); not-a-number off the surface
};

/// Torque about where the hand holds the tool, over the ticks in contact (N m); 0 where the scene has no tool.
struct TorqueMetrics {
  double mean = 0.0;
  double max = 0.0;
};

/// Angle between rendered force and reference normal (rad), over the ticks of the contact phase.
struct DirectionMetrics {
  std::size_t samples = 0;
  double mean = 0.0;
  double p99 = 0.0;
  double max = 0.0;
};

/// Followed height against the relief (m), over the ticks in contact of the contact phase.
struct HeightMetrics {
  std::size_t samples = 0;      ///< compared
  std::size_t excluded = 0;     ///< left out, within one texel of a step
  double rms_error = 0.0;       ///< of followed - relief
  double max_error = 0.0;       ///< largest absolute difference
  double amplitude = 0.0;       ///< highest - lowest relief met on the way
  double relative_error = 0.0;  ///< rms_error / amplitude; not-a-number without relief
  double excursion = 0.0;       ///< highest - lowest followed height
};

/// Commanded force of the contact phase; over time in Hz, over distance in 1/m.
struct SpectrumMetrics {
  Spectrum normal_time;
  Spectrum tangential_time;
  Spectrum normal_distance;
  Spectrum tangential_distance;
};

/// Time that `step` took (s): measurements of the machine that ran it.
struct UpdateMetrics {
  double mean = 0.0;
  double p50 = 0.0;
  double p99 = 0.0;
  double p999 = 0.0;
  double max = 0.0;
  std::vector<double> edges;  ///< of the histogram's bins (s), ten a decade; one more than `counts`
  std::vector<std::uint64_t> counts;
};

/// Work of the commanded force on the probe (J). Positive is energy fed into the hand.
struct EnergyMetrics {
  double work = 0.0;          ///< whole run, trapezoid
  double held_work = 0.0;     ///< whole run, with the force held from tick to tick as a device holds it
  double absorbed = 0.0;      ///< most that the contact held or dissipated at one time: -min(work)
  double generated = 0.0;     ///< largest rise of work + stored energy from any earlier tick; 0 for a passive contact
  std::vector<double> loops;  ///< work + change of stored energy of each full loop (closed, or there and back)
  double mean_loop = 0.0;     ///< not-a-number without a full loop
  /// What would have given more than the hand had put in: who, how much (J), and how much of it the account paid.
  /// Givers that never asked are left out. Of the run itself: its trace does not tell.
  struct Asked {
    std::string giver;
    double asked = 0.0;
    double paid = 0.0;
  };
  std::vector<Asked> account;
};

/// What a run's account has been asked for. [any]
std::vector<EnergyMetrics::Asked> account_rows(const EnergyAccount& account);

/// Ticks that had each flag, and what the safety stage changed.
struct TickMetrics {
  std::uint64_t ticks = 0;
  std::uint64_t contact = 0;
  double duration = 0.0;                                             ///< s
  double rate = 0.0;                                                 ///< ticks a second (Hz)
  double length = 0.0;                                               ///< distance travelled in the contact phase (m)
  std::array<std::uint64_t, Names<TickFlag>::table.size()> flags{};  ///< by bit of TickFlag
  std::uint64_t safety_interventions = 0;  ///< ticks whose commanded force is not the rendered one
  double largest_intervention = 0.0;       ///< largest |rendered - commanded| (N)
};

/// The numbers of one run.
struct RunMetrics {
  TickMetrics ticks;
  ForceMetrics force;
  TorqueMetrics torque;
  DirectionMetrics direction;
  DirectionMetrics direction_near;  ///< near sharp edges of the geometry
  DirectionMetrics direction_far;   ///< elsewhere
  HeightMetrics height;
  SpectrumMetrics spectrum;
  UpdateMetrics update;
  EnergyMetrics energy;
  FollowMetrics follow;  ///< of the first isosurface; without samples where the scene has none
};

/// Everything above. `series` is derive_series of the same records. [main]
RunMetrics measure_run(std::span<const TraceRecord> records, const RunSeries& series, const StrokePath& path);
/// The same in one call. [main]
RunMetrics measure_run(std::span<const TraceRecord> records, const Scene& scene, const StrokePath& path);

/// "contact", "not_converged", ...: the name of flag bit `bit`, 0 to 12; "unknown" beyond. [any]
const char* flag_name(std::size_t bit);

/// The numbers as JSON text, SI, without spectra and histograms; not-a-number becomes null. [main]
std::string metrics_json(const RunMetrics& metrics);

/// Smallest value that at least the share `p` (0 to 1) of `values` does not exceed (nearest rank); not-a-number when
/// there is none. Values that are not finite are left out. [main]
double percentile(std::span<const double> values, double p);
/// What they are like; those that are no numbers are left out. [any]
DirectionMetrics measure_angles(std::span<const double> angles);

}  // namespace asperity
