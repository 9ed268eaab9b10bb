#pragma once
// What changes of a scene do to a probe in it: surfaces that move, deform, change their coat, their level of detail or
// their size, and who pays for it (formulation, amendment 6). Private to render.

#include "asperity/render/step.h"

namespace asperity {

/// A probe of the workspace as it is in the scene. [servo]
ProbeSample in_scene(const View& view, const ProbeSample& probe) noexcept;
/// Takes a state from the view of the last tick to this one. What its spring held stays what it is to the hand:
/// `held` becomes where the proxy would have to be for that. [servo]
void adopt_view(const View& view, ProxyState& state, const ProbeSample& workspace, Vec3& held) noexcept;

/// Tells every contact where its instance is now and which of its coat's states is felt, and takes the proxy along with
/// what it touches or is overtaken by. `held`: as above; state.proxy is moved. True where something has changed since
/// the last tick. [servo]
bool follow_surfaces(const Scene& scene, ProxyState& state, const ProbeSample& probe, Seconds dt,
                     bool new_scene) noexcept;

/// Whether this instance has changed under the probe since the last tick. [servo]
inline bool has_moved(const ContactState& slot) noexcept {
  return slot.moved;
}
/// What a law without a proxy may render of its force, 0 to 1, and what it holds then, after its instance has changed
/// from holding slot.potential to `now` (J) with the probe where it was; pays from the tank. [servo]
void pay_for_change(double now, ContactState& slot, EnergyTank& tank) noexcept;
/// Takes from what friction and texture give through the surface's own motion (world) as much as the tank does not
/// hold: the share of them that may be rendered. [servo]
double carried_share(const Vec3& force, const Vec3& surface_motion, EnergyTank& tank) noexcept;
/// Where in the world the surface's point under p (world) has come from within the last tick: p minus that. [servo]
Vec3 surface_motion(const ContactState& slot, const Vec3& p) noexcept;

/// Remembers the face under a contact (world) where the proxy (world) is held by triangles, so that it is found again
/// when the mesh has been refitted. [servo]
void remember_anchor(const Instance& instance, const Vec3& point, std::uint32_t element, const Vec3& proxy,
                     ContactState& slot) noexcept;
/// Remembers on which side of a changing surface the probe is. [servo]
void remember_places(const Scene& scene, ProxyState& state, const Vec3& probe, bool new_scene) noexcept;

/// Spreads the change of the force over the scene's hand-over time, as far as the tank pays. [servo]
Vec3 handed_over(const Scene& scene, ProxyState& state, const Vec3& force, const Vec3& probe, Seconds dt,
                 bool new_scene) noexcept;

}  // namespace asperity
