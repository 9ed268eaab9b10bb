#pragma once
// Who pays for what: energy that changes of a scene would give (formulation, amendment 6).

#include "asperity/render/energy/tank.h"
#include "asperity/render/state.h"

namespace asperity {

/// What a law without a proxy may render of its force, 0 to 1, and what it holds then, after its instance has changed
/// from holding memory.potential to `now` (J) with the probe where it was; pays from the tank. [servo]
void pay_for_change(double now, PotentialMemory& memory, EnergyTank& tank) noexcept;
/// The share that may be rendered of what friction and texture give through the surface's own motion (world): as much
/// as the tank holds. [servo]
double carried_share(const Vec3& force, const Vec3& surface_motion, EnergyTank& tank) noexcept;

}  // namespace asperity
