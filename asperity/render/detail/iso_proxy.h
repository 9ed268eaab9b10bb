#pragma once
// The proxy law on one isosurface touched by a point, and what an isosurface is at this tick. Private to render.

#include "asperity/render/detail/proxy.h"
#include "asperity/surface/iso_surface.h"

namespace asperity {

/// The isosurface as the slot feels it: its level and threshold of this tick. [servo]
inline IsoView felt_view(const IsoSurface& surface, const ContactState& slot) noexcept {
  return surface.view_at(slot.iso.level, slot.iso.threshold);
}

/// By how much further out a ball's centre finds a level of an instance's potential to rest on (m): its radius, where
/// the potential is a distance and is stored that far, the proxy touches it, and nothing else is solved with it. 0: the
/// ball is solved as one. [servo]
double ball_level(const Instance& instance, const Scene& scene) noexcept;
/// The face or cell that messages and traces name for a place of an isosurface (object frame). [servo]
std::uint32_t element_at(const Instance& instance, const Vec3& place, ContactState& slot) noexcept;

/// Brings the slot's level and threshold up to this tick's: the level to `level`, where the surface first stays where
/// it was felt; the threshold towards the scene's own, no faster than the surface's threshold_speed along its normal.
/// What is touched moves along; a surface that comes over `free` (the proxy in free space, object frame) takes it up.
/// True when the surface moved. `further`: what ball_level answers. [servo]
bool update_felt(const IsoSurface& surface, double further, Sides sides, int level, Seconds dt, const Vec3& free,
                 ContactState& slot) noexcept;

/// One tick on one isosurface, object frame: from the state's place, or from `from` through free space, towards
/// `probe`. [servo]
ProxyRest solve_on_iso(const IsoView& surface, Sides sides, const Friction& friction, const Vec3& from,
                       const Vec3& probe, ContactState& state) noexcept;

}  // namespace asperity
