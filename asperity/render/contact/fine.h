#pragma once
// Friction and texture of one contact, on top of what constrains it (heterogeneous-features-2008, eq. 1).

#include "asperity/render/local_material.h"

namespace asperity {

/// Whether the proxy itself is the anchor of the instance's friction: the default law under the proxy law, nothing else
/// felt on top. [servo]
bool proxy_holds_friction(const Instance& instance) noexcept;
/// Whether friction is a force of its own, felt on top of the constraint. [servo]
bool adds_friction(const Instance& instance) noexcept;

/// How the probe moves over what it touches, object frame.
struct FineMotion {
  Vec3 moved = Vec3::Zero();     ///< since the last tick (m)
  Vec3 velocity = Vec3::Zero();  ///< m/s
  Seconds dt{1e-3};
};

/// Adds texture and friction to what a law answers, object frame; `law.push` is the constraint's force along the
/// normal. Forgets what it knew where there is no contact. True where a texture was felt weaker than it is. `friction`:
/// what adds_friction answers; `stiffness`: of the contact's spring (N/m). [servo]
bool add_fine_forces(const Touched& touch, const Material& material, bool friction, double stiffness,
                     const FineMotion& motion, LawForce& law) noexcept;

/// What of an instance's texture and friction cannot be felt on its surface or by its law. Errors: unsupported_pair.
/// [build]
Status check_fine(const Instance& instance, const std::string& place);

}  // namespace asperity
