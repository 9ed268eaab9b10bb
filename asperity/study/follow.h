#pragma once
// How well an isosurface is followed, and how surely it is met: the measures of large-data-2008.

#include <cstdint>
#include <span>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/core/trace_record.h"
#include "asperity/device/stroke.h"
#include "asperity/render/scene.h"

namespace asperity {

/// Follow error of the probe over the contact phase, as a share of the largest error that the volume allows:
///   e_k = |F(L(t_k)) - G| / H,   e = sum e_k |L(t_k) - L(t_k-1)| / sum |L(t_k) - L(t_k-1)|,
/// F the field, G the threshold, L the probe's path, H = max |F - G| over the volume (large-data-2008, eq. 20 without
/// its spurious dt and with |L'|). It is the probe's error, so it grows with the force and falls with the stiffness.
struct FollowMetrics {
  std::size_t samples = 0;   ///< ticks with a value; 0 without an isosurface
  std::size_t excluded = 0;  ///< ticks of the contact phase outside the volume
  double mean = 0.0;         ///< of e_k, 0 to 1; this and all below not-a-number without samples
  double min = 0.0;
  double max = 0.0;
  double global = 0.0;  ///< e, 0 to 1
};

/// The isosurface that the follow error is about: of the first instance that has one; nullptr without any. [any]
const Instance* followed_instance(const Scene& scene) noexcept;
/// max |F - G| over the volume, in the field's unit; above 0. [any]
double largest_deviation(const IsoView& surface) noexcept;
/// e_k at a point of the object frame (m); not-a-number outside the volume and where nothing is known. [any]
double follow_error(const IsoView& surface, const Vec3& p) noexcept;
/// From e_k and the probe's place (m) of each tick; both equally long. Ticks whose error is not a number, and the way
/// to them, are left out. [any]
FollowMetrics measure_follow(std::span<const double> errors, std::span<const Vec3> path);

/// What is put through an isosurface to see who notices.
struct DetectionSettings {
  std::vector<double> speeds{0.2, 0.5};  ///< of the probe against the surface's normal (m/s), each above 0
  double rate = 1400.0;                  ///< ticks a second (Hz), above 0
  int passages = 500;                    ///< each at a random place of the stroke, from a random start; 1 to 1,000,000
  std::uint64_t seed = 1;
};

/// Shares of the passages at one speed in which a law answered with a contact at some tick.
struct DetectionRow {
  double speed = 0.0;         ///< m/s
  double layer = 0.0;         ///< how thick M1's layer is on the way (m, median of the places); without M1 not-a-number
  double expected = 0.0;      ///< of M1: mean of min(1, layer / (speed / rate)); without M1 not-a-number
  std::vector<double> share;  ///< one a scene; not-a-number where no passage could begin outside of what is touched
};

/// Drives a point straight in through the isosurface that `felt` follow, at places of the stroke, with each scene's own
/// law through `step`, until it is a tick's way beyond M1's layer: the one of the first scene that is felt by `avila`.
/// The scenes differ in their laws alone. One row a speed; none without scenes, or without an isosurface in memory.
/// Errors: bad_value naming the setting. [main]
Result<std::vector<DetectionRow>> detection_table(std::span<const Scene> felt, const StrokePath& path,
                                                  const DetectionSettings& settings = {});

}  // namespace asperity
