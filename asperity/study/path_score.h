#pragma once
// Laws against a measured trajectory: a probe's path over a known surface with the forces that were felt on it
// (Ruffaldi et al. 2006; formulation D8, T11).

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/names.h"
#include "asperity/core/progress.h"
#include "asperity/core/trace_record.h"
#include "asperity/io/trace_file.h"
#include "asperity/render/scene.h"
#include "asperity/study/metrics.h"

namespace asperity {

/// A measured place and force. World frame, SI.
struct MeasuredSample {
  Seconds time{0.0};
  Vec3 position = Vec3::Zero();
  Vec3 force = Vec3::Zero();  ///< on the probe (N): away from the surface
};

/// Where measured positions lie.
enum class PathPlace {
  surface,  ///< on the true surface, as a stiff probe's tip does: laws are driven at x - F / k
  probe,    ///< of a device's probe, F / k beneath what it touches already: laws are driven there
};
/// As in options and `--json`.
template <>
struct Names<PathPlace> {
  static constexpr auto table =
      std::to_array<Named<PathPlace>>({{PathPlace::surface, "surface"}, {PathPlace::probe, "probe"}});
};

/// A trajectory.
struct MeasuredPath {
  std::string name;
  PathPlace place = PathPlace::surface;
  std::vector<MeasuredSample> samples;  ///< two or more, times increasing from 0
};

/// Most samples of a file.
inline constexpr std::size_t most_measured_samples = 500'000;

/// Reads CSV text: a header that names time, x, y, z, fx, fy, fz in any order and case (also t; position_x, ...;
/// force_x, ...), each with a unit in brackets ("x [mm]") or as a suffix ("x_mm"), SI without one; other columns are
/// passed over, as are blank lines and lines that begin with '#'. Errors: file_empty, too_large, file_malformed or
/// bad_value with the line as place (column missing, unit unknown, cell not a finite number, time not increasing, fewer
/// than two rows). [build]
Result<MeasuredPath> parse_measured_path(std::string_view text);
/// Of a run: where the probe was, and what `step` answered. On the surface: at x + F / k, k in N/m. Errors: mismatch
/// (fewer than two ticks), bad_value naming a tick that is not finite or not later, too_large. [build]
Result<MeasuredPath> measured_path_from(std::span<const TraceRecord> records, PathPlace place, double stiffness);
/// Reads a CSV file, whose positions are on the surface, or a trace, whose positions are the probe's. Errors: those
/// above and of reading the file. [build]
Result<MeasuredPath> read_measured_path(const std::filesystem::path& file);
/// The same file, every bit of every number kept. [any]
std::string measured_path_csv(const MeasuredPath& path);

/// The path on which laws of stiffness `k` (N/m, above 0) are driven: x - F / k of positions on the surface. [any]
std::vector<Vec3> subsurface_path(const MeasuredPath& path, double k);

/// A law's forces against measured ones.
struct ForceErrors {
  std::size_t samples = 0;     ///< all
  std::size_t compared = 0;    ///< of those, where either is above 1 mN: what follows is over them
  double rms_measured = 0.0;   ///< of the measured force (N)
  double rms_error = 0.0;      ///< of |rendered - measured| (N)
  double relative = 0.0;       ///< rms_error / rms_measured; not-a-number without a measured force
  double mean_error = 0.0;     ///< of |rendered - measured| (N)
  double largest_error = 0.0;  ///< N
  std::size_t largest_at = 0;  ///< the sample it is at
  double peak_measured = 0.0;  ///< largest measured force (N)
  double peak_rendered = 0.0;  ///< largest of the law (N)
  double mean_angle = 0.0;     ///< between both where both are above 1 mN (rad); not-a-number where they never are
  double largest_angle = 0.0;  ///< rad, likewise
  double missed = 0.0;         ///< share of the samples with a measured force where the law answers none
  double added = 0.0;          ///< share of the samples without one where it answers some; 0 where there are none
  std::vector<double> error;   ///< |rendered - measured| of each sample (N)
  std::vector<double> angle;   ///< rad of each sample; not-a-number where it has no meaning
};
/// Both must be equally long. [any]
ForceErrors compare_forces(std::span<const Vec3> measured, std::span<const Vec3> rendered);

/// How a path is followed.
struct ScoreSettings {
  double stiffness = 0.0;  ///< of the path's correction (N/m); 0: of the scene's surfaces, which must be one
  double rate = 1000.0;    ///< ticks a second at least (Hz): longer steps between samples are divided evenly
  /// A path that begins pressed in is entered from so far outside (m), along its first force.
  double lead_in = 2e-3;
};

/// One law on one path.
struct PathScore {
  std::string law;
  double stiffness = 0.0;  ///< of the correction (N/m)
  ForceErrors force;
  DirectionMetrics normal;           ///< angle of the law's force to the normal of the true surface
  double mean_penetration = 0.0;     ///< m, over samples in contact
  double p99_penetration = 0.0;      ///< m
  double largest_penetration = 0.0;  ///< m
  std::vector<Vec3> rendered;        ///< force at each sample (N)
};

/// Stiffness (N/m) that all surfaces of the scene have. Errors: mismatch where they differ. [any]
Result<double> common_stiffness(const Scene& scene);
/// Drives the scene's laws along the path, and scores the answer of `step` at every sample. Errors: bad_value (path or
/// settings), mismatch (stiffness), too_large (more than 5 million ticks), of reading volumes. [main]
Result<PathScore> score_path(const Scene& scene, const MeasuredPath& path, const ScoreSettings& settings,
                             const Progress& progress = {});

/// Distance travelled along the positions, one value a sample (m). [any]
std::vector<double> distance_along(const MeasuredPath& path);
/// Columns time_s, distance_m, the measured force and each law's, and each law's error. [any]
std::string scores_csv(const MeasuredPath& path, std::span<const PathScore> scores);

}  // namespace asperity
