#pragma once
// Isosurfaces whose threshold or level changes while they are touched.

#include "asperity/render/scene.h"
#include "asperity/render/state.h"

namespace asperity {

/// By how much further out a ball's centre finds a level of an instance's potential to rest on (m): its radius, where
/// the potential is a distance and is stored that far, the proxy touches it, and nothing else is solved with it. 0: the
/// ball is solved as one. [servo]
double ball_level(const Instance& instance, const Scene& scene) noexcept;

/// The face or cell that messages and traces name for a place of an isosurface (object frame). [servo]
std::uint32_t element_at(const Instance& instance, int level, const Vec3& place, SurfaceCache& cache) noexcept;

/// Brings level and threshold of a contact up to this tick's: the level to `level`, where the surface first stays where
/// it was felt; the threshold towards `target`, no faster than the surface's threshold_speed along its normal.
/// What is touched moves along; a surface that comes over `free` (the proxy in free space, object frame) takes it up.
/// True when the surface moved. [servo]
bool felt_level(const IsoSurface& surface, double target, Sides sides, int level, Seconds dt, const Vec3& free,
                SurfaceCache& cache, OfSurface& state) noexcept;

}  // namespace asperity
