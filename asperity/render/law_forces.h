#pragma once
// What the laws answer inside `step`; one source file per method. Private to render.

#include "asperity/core/samples.h"
#include "asperity/render/scene.h"
#include "asperity/render/step.h"

namespace asperity {

/// Force of one instance, object frame.
struct LawForce {
  bool contact = false;
  Vec3 force = Vec3::Zero();   ///< N
  Vec3 point = Vec3::Zero();   ///< felt point of the surface (m)
  Vec3 normal = Vec3::Zero();  ///< unit
  double penetration = 0.0;    ///< m
  double height = 0.0;         ///< relief height under the probe (m)
  std::uint32_t element = no_index;
  Vec3 turn = Vec3::Zero();  ///< N, lateral force of consistent shading, to be added as far as its budget lets it
};

/// haptic-textures-2005, 3.3; hrm-2010, Algorithm 1. `probe` and `velocity` in the object frame. [servo]
LawForce height_field_force(const HeightFieldLaw& law, const ReliefSurface& surface, const Material& material,
                            const Vec3& probe, ContactState& state) noexcept;
/// hrm-2010, Algorithm 2. [servo]
LawForce mesostructure_force(const MesostructureLaw& law, const ReliefSurface& surface, const Material& material,
                             const Vec3& probe, ContactState& state) noexcept;

/// The shell around a probe, as the consistent forms of Algorithms 1 and 2 need it.
struct ShellContact {
  bool found = false;       ///< false: no surface
  bool located = false;     ///< false: no prism holds the probe, the nearest base point stands in
  bool beyond_rim = false;  ///< the foot is on the rim of an open mesh and the probe is not over the face
  ReliefFrame frame;
  ShellPlace place;
};
ShellContact shell_contact(const ReliefSurface& surface, const Vec3& probe, Hint& hint) noexcept;

/// Contact of a potential k Phi^2 / 2 whose penetration is -value: force = -k value gradient, if the probe came in from
/// outside. Keeps state.seen_outside. [servo]
LawForce potential_contact(double value, const Vec3& gradient, double height, std::uint32_t element, bool beyond_rim,
                           double stiffness, const Vec3& probe, ContactState& state) noexcept;

/// Adds the material's damping along the contact normal, never turning the push into a pull. [servo]
Vec3 with_damping(const Vec3& force, const Vec3& normal, const Vec3& velocity, double damping) noexcept;

}  // namespace asperity
