#pragma once

#include <memory>
#include <string>
#include <vector>

#include "asperity/geometry/triangle_index.h"
#include "asperity/render/scene.h"
#include "bench/measure.h"

namespace asperity::bench {

inline constexpr double sphere_radius = 0.05;  ///< m
inline constexpr double slide_speed = 0.05;    ///< m/s
inline constexpr double slide_depth = 1e-3;    ///< m
inline constexpr double tick_seconds = 1e-3;   ///< s

/// A wandering slide over a round mesh of radius 50 mm around the origin: at every tick a place on the surface, 50 um
/// along from the last one (measured on the sphere around it), that hardly ever comes back to where it was.
struct Slide {
  std::vector<Vec3> direction;  ///< unit, from the centre to the place
  std::vector<double> surface;  ///< m, from the centre to the surface, along `direction`

  /// The probe's position at a tick, `depth` (m) under the surface and its centre `radius` (m) above that.
  [[nodiscard]] Vec3 probe(std::size_t tick, double radius, double depth = slide_depth) const {
    return (surface[tick] + radius - depth) * direction[tick];
  }
};

/// The slide's directions, one a tick. [build]
std::vector<Vec3> wandering_directions(std::size_t ticks);

/// Errors: none; a mesh that a ray from the centre misses counts as 50 mm away there. [build]
Slide make_slide(const TriangleIndex& index, std::size_t ticks);

/// How a probe is led along a slide.
struct Led {
  double radius = 0.0;                 ///< m, of the probe
  bool resting = false;                ///< at the first place all the time
  double start = 1.5 * sphere_radius;  ///< m, from the centre: where it is before
};
/// A row that takes a probe through `step`; a tick counts where something is touched. Errors: of the scene. [build]
Result<Row> sliding_row(const std::string& name, std::vector<Instance> instances, std::shared_ptr<const Slide> slide,
                        const Led& led = {});

}  // namespace asperity::bench
