#pragma once
// What the laws without a proxy answer; one source file per method.

#include "asperity/core/samples.h"
#include "asperity/render/instance.h"
#include "asperity/render/state.h"

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
  Vec3 spring = Vec3::Zero();    ///< N, the part of the force that is held: neither damping nor friction
  double stiffness = 0.0;        ///< N/m: by how much that changes; 0: the material's
  std::optional<double> stored;  ///< J, the energy that `spring` is the slope of; not told: as its size tells
  bool keeps = false;            ///< `spring` is no energy's slope, and holds whatever is put into it
  double local = 0.0;            ///< N/m: the material's where it is touched, if the law looks that up; 0: it does not
  bool damped = false;           ///< damping is part of the force already, and `spring` is told
  double push = 0.0;             ///< N along the normal, before damping: what friction and texture go by
  Vec3 friction = Vec3::Zero();  ///< N, the part of the force that is friction
  Vec3 texture = Vec3::Zero();   ///< N, the part that is texture
  bool pulls = false;            ///< a sticky surface holds the probe back: `penetration` is how far it was drawn off
  double held = 0.0;             ///< J, in the spring of a friction law
  bool turns = false;            ///< `turn` is known
  Vec3 turn;                     ///< N, lateral force of consistent shading, to be added as far as it is paid
  bool bends = false;            ///< `bend` is known
  Mat3 bend;                     ///< 1/m: how the normal changes along the surface (shape operator)
};

/// haptic-textures-2005, 3.3; hrm-2010, Algorithm 1. `probe` and `velocity` in the object frame. [servo]
LawForce height_field_force(const HeightFieldLaw& law, const ReliefView& view, const Material& material,
                            const Vec3& probe, Contact& contact) noexcept;
/// hrm-2010, Algorithm 2. [servo]
LawForce mesostructure_force(const MesostructureLaw& law, const ReliefView& view, const Material& material,
                             const Vec3& probe, Contact& contact) noexcept;

/// Width of the layer that the law pushes in, by the field's unit: its own, or the one whose force rises by the
/// material's stiffness where the field's slope is typical. Above 0. [any]
double avila_band(const AvilaLaw& law, const IsoSurface& surface, const Material& material) noexcept;
/// large-data-2008, eq. 5 to 8 (M1). `probe` and `velocity` in the object frame, `view` what is felt now of `surface`.
/// Felt from the front alone: a probe that starts inside, or comes in where the volume ends, feels nothing in the
/// consistent form until it has been outside. No force beyond the layer. [servo]
LawForce avila_force(const AvilaLaw& law, const IsoSurface& surface, const IsoView& view, const Material& material,
                     const Vec3& probe, const Vec3& velocity, Contact& contact) noexcept;
/// large-data-2008, eq. 11 to 15 (M2): force = k (V - probe) - retarding velocity while crossed; penetration |V -
/// probe|. Felt from the front alone, whatever the instance's sides: inside out is the "uncross" that ends a contact.
/// Leaving the volume ends it too. Of a motion that crosses and uncrosses within a tick only the end counts. [servo]
LawForce cross_uncross_force(const CrossUncrossLaw& law, const IsoView& view, const Material& material,
                             const Vec3& probe, const Vec3& velocity, Contact& contact) noexcept;

/// hybrid-surface-2004, eq. 1 and 2; Fig. 6a. `probe` and `velocity` in the object frame, `material` the surface's own:
/// local ones are looked up. Felt from the front alone (literal: whoever starts inside is pushed at once; consistent:
/// after having been outside). Sets `damped`. [servo]
LawForce virtual_contact_force(const VirtualContactPointLaw& law, const ImplicitSurface& surface,
                               const Material& material, const Vec3& probe, const Vec3& velocity, Seconds dt,
                               Contact& contact, SurfaceCache& cache) noexcept;
/// hybrid-surface-2004, Fig. 6b. As above. [servo]
LawForce magnetic_force(const MagneticLaw& law, const ImplicitSurface& surface, const Material& material,
                        const Vec3& probe, const Vec3& velocity, Seconds dt, Contact& contact,
                        SurfaceCache& cache) noexcept;
/// hybrid-surface-2004, Fig. 10a: the previous method. [servo]
LawForce normal_perturbation_force(const ImplicitSurface& surface, const Material& material, const Vec3& probe,
                                   Contact& contact, SurfaceCache& cache) noexcept;
/// The shell around a probe, as the consistent forms of Algorithms 1 and 2 need it.
struct ShellContact {
  bool found = false;       ///< false: no surface
  bool beyond_rim = false;  ///< the foot is on the rim of an open mesh and the probe is not over the face
  /// In the view's cache. Null: no prism holds the probe, the nearest base point stands in.
  const ReliefFrame* frame = nullptr;
  ShellPlace place;
};
ShellContact shell_contact(const ReliefView& view, const Vec3& probe) noexcept;

/// Contact of a potential k Phi^2 / 2 whose penetration is -value: force = -k value gradient, if the probe came in from
/// outside. Keeps contact.seen_outside. [servo]
LawForce potential_contact(double value, const Vec3& gradient, double height, std::uint32_t element, bool beyond_rim,
                           double stiffness, const Vec3& probe, Contact& contact) noexcept;

/// Adds the material's damping along the contact normal, never turning the push into a pull. [servo]
Vec3 with_damping(const Vec3& force, const Vec3& normal, const Vec3& velocity, double damping) noexcept;

}  // namespace asperity
