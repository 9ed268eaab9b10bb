#pragma once
// How well an isosurface is followed, and how surely it is met: the measures of large-data-2008.

#include <cstdint>
#include <span>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/core/trace_record.h"
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

/// What is put through a layer to see who notices it.
struct DetectionSettings {
  std::vector<double> thicknesses{0.05e-3, 0.2e-3};  ///< of the layer that M1 feels (m), each above 0
  std::vector<double> speeds{0.2, 0.5};              ///< of the probe along the field's gradient (m/s), each above 0
  double rate = 1400.0;                              ///< ticks a second (Hz), above 0
  int passages = 500;                                ///< each with its own random start; 1 to 1,000,000
  std::uint64_t seed = 1;
};

/// Shares of the passages in which a law answered with a contact at some tick.
struct DetectionRow {
  double thickness = 0.0;  ///< m
  double speed = 0.0;      ///< m/s
  double expected = 0.0;   ///< of M1: min(1, thickness / (speed / rate))
  double avila = 0.0;
  double cross_uncross = 0.0;
  double proxy = 0.0;
};

/// Drives a point probe straight through the isosurface of a linear field, with the consistent laws through `step`.
/// One row for each thickness and speed, thicknesses outermost. Errors: bad_value naming the setting. [main]
Result<std::vector<DetectionRow>> detection_table(const DetectionSettings& settings = {});

}  // namespace asperity
