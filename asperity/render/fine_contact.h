#pragma once
// Friction and texture of one contact, on top of what constrains it (heterogeneous-features-2008, eq. 1).

#include "asperity/render/law_forces.h"

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
bool add_fine_forces(const Instance& instance, const Material& material, bool friction, double stiffness,
                     const FineMotion& motion, ContactState& slot, EnergyTank& tank, LawForce& law) noexcept;

/// A texture as it is at a place of its surface.
struct TextureShape {
  double height = 0.0;           ///< m, over the smooth surface; crests at 0 in the consistent form
  Vec3 gradient = Vec3::Zero();  ///< along the surface (m/m)
};
/// The texture at a point of the instance's surface, object frame; nothing where there is none. `element`: the face
/// there, where the surface has faces. `hint`: of the query that found the point. Wavelengths below four times
/// `resolution` (m) are faded. [any]
TextureShape texture_at(const Instance& instance, std::uint32_t element, const Vec3& point, const Vec3& normal,
                        const Hint& hint, double resolution) noexcept;

/// What of an instance's texture and friction cannot be felt on its surface or by its law. Errors: unsupported_pair.
/// [build]
Status check_fine(const Instance& instance, const std::string& place);

}  // namespace asperity
