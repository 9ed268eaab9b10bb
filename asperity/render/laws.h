#pragma once
// How a surface is felt: the settings of the contact laws. One source file per method holds what they do.

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "asperity/core/formulation.h"
#include "asperity/core/result.h"
#include "asperity/surface/stitching.h"

namespace asperity {

/// The default: one proxy on the true surface, the displaced one where there is a coat (formulation D6, amendments 5 to
/// 9). It never passes through, moves only where its distance to the probe falls, sticks and slides by Coulomb's cone
/// of the material, and touches with the probe's radius. Several surfaces are solved jointly.
struct ProxyLaw {};

/// Constraint-based god-object on the geometry (Zilles and Salisbury 1995; a ball where the probe has a radius, Ruspini
/// 1997). Each tick ends with the complete solve: the proxy is the constrained local minimiser of its distance to the
/// probe. On a coated mesh it feels the base alone.
struct GodObjectLaw {};

/// God-object force turned into the direction of the coat's normal map at the contact, or of the interpolated vertex
/// normals on a bare mesh (Morgenbesser and Srinivasan 1996; force mapping of haptic-textures-2005, 3.2). Its magnitude
/// stays, so it renders no height, and it feeds energy (0.89 mJ a loop in the reference case).
///   literal     as printed
///   consistent  the normal part of the force stays, the lateral part is that of the blended relief's slope. What it
///               does to the hand is kept in a budget that only its own resistance fills: it never gives more than it
///               took
struct ForceShadingLaw {
  Formulation formulation = Formulation::consistent;
};

/// Height field over the base triangle (haptic-textures-2005, 3.3; hrm-2010, Algorithm 1).
///   literal     in the prism, penetration = H - |distance to the plane|, force along the plane's normal; contact is
///   lost below the
///               base at depth H, and heights below 0 are never met (erratum 1)
///   consistent  penetration = H - h with the signed distance h of the nearest base point, force = -grad(k (h - H)^2 /
///   2):
///               no energy from nothing (errata 1, 10)
struct HeightFieldLaw {
  /// The 2005 paper forces heights to 0 at the edges; it gives no width, so the later paper's band is taken.
  static constexpr double literal_taper = 0.05;
  Formulation formulation = Formulation::consistent;
  /// Share of each triangle (in barycentric coordinates) over which heights fall to 0 towards its edges: the C0 rule of
  /// 2005. 0 turns it off. In 0 … 1/3.
  double edge_taper = formulation == Formulation::literal ? literal_taper : 0.0;
};

/// Mesostructure blended over adjoining faces (hrm-2010, Algorithm 2).
///   literal     the printed band test, unsigned distance to one plane, averaged normals that are not unit (errata 1,
///   2, 4, 5)
///   consistent  Phi of the relief in shell coordinates, blended as the coat's stitching says, force = -grad(k Phi^2 /
///   2)
struct MesostructureLaw {
  Formulation formulation = Formulation::consistent;
  double rho = 0.05;                   ///< literal: width of the band in barycentric coordinates, above 0, at most 1/3
  Blend blend = Blend::s_shape;        ///< literal: weights over the band
  std::vector<double> blend_map = {};  ///< literal, Blend::image: weights at t = 0 … 1, evenly spaced, at least two
  /// literal: the blend on the fly of section 4.2. Within the band around any edge heights and normals are averaged
  /// over every neighbouring prism that holds the probe.
  bool test_neighbours = false;
};

/// God-object on geometry generated per triangle at run time inside the probe's influence area (haptic-textures-2005,
/// 3.1): base triangles near the proxy are cut into a grid of small flat ones on the displaced surface, anew every
/// tick. Facets and their edges are felt; where heights of neighbouring faces differ, the seam stays open.
struct GeneratedGeometryLaw {
  int subdivisions = 32;          ///< cuts along each edge of a base triangle; 1 to most_generated_subdivisions
  double influence_radius = 0.0;  ///< m around the proxy within which triangles are made; 0: one and a half of theirs
};
inline constexpr int most_generated_subdivisions = 4096;

/// God-object on the relief as a dense mesh, made once when the scene is built: what detail costs as plain geometry.
struct DenseMeshLaw {
  int subdivisions = 0;  ///< cuts along each edge of a base triangle; 0: triangles of a texel, if not too many
};

/// Isosurface felt from the field's value at the probe alone (Avila and Sobierajski 1996; large-data-2008, M1, eq. 5 to
/// 10). Between two thresholds the volume pushes along its gradient; a probe that jumps over that layer within a tick
/// feels nothing. Felt from the front alone.
///   literal     as printed, eq. 6 to 8, N the gradient: where low values are inside the force is greatest at first
///               touch, where high ones are it pulls inwards; R points along the motion and f_r takes the field's unit
///   consistent  f_s rises from the surface's threshold inwards, along the outward normal, f_r = C2 (1 + share of the
///               layer), R = -f_r v
struct AvilaLaw {
  Formulation formulation = Formulation::consistent;
  /// Width of the layer in the field's unit, from the surface's threshold inwards; 0: as wide as makes the material's
  /// stiffness where the field's slope is typical.
  double band = 0.0;
  double largest_force = 3.0;  ///< C1 (N), above 0
  double retarding = 0.0;      ///< C2 (N·s/m), 0 or more
};

/// Isosurface that is crossed and uncrossed (large-data-2008, M2, eq. 11 to 15): from a crossing on, the probe is held
/// by a spring to the surface's point along the gradient. Felt from the front alone.
///   literal     as printed: at most 1024 grid points of a 3-D line (Bresenham) a tick, the path loop that leaves at
///   its
///               first outside point, the sample nearest to the threshold in place of a root, the gradient saved at the
///               crossing. The printed f_s of eq. 8 is not part of it: S = k (V - R)
///   consistent  every crossing on the way, by exact roots; V found anew every tick, along the normal where it was last
struct CrossUncrossLaw {
  Formulation formulation = Formulation::consistent;
  double retarding = 0.0;  ///< R = -retarding v while crossed (N·s/m), 0 or more
  double reach = 0.0;      ///< literal: alpha |N| of eq. 15, how far T lies from the probe (m); 0: 64 cells
};

/// How far the virtual contact point is taken to be.
enum class ContactMagnitude {
  distance,   ///< to the virtual contact point (hybrid-surface-2004)
  potential,  ///< what the potential says (Avila and Sobierajski 1996): softer where edges are interpolated
};
/// As in scene files.
template <>
struct Names<ContactMagnitude> {
  static constexpr auto table = std::to_array<Named<ContactMagnitude>>(
      {{ContactMagnitude::distance, "distance"}, {ContactMagnitude::potential, "potential"}});
};

/// Virtual contact point of an implicit surface: the probe is held by a spring and a damper to the surface's point
/// along the potential's gradient (hybrid-surface-2004, eq. 1), which friction retards (eq. 2; f_c is the material's
/// dynamic friction). Felt from the front alone; it has no memory of the side, so a sheet thinner than twice the
/// penetration lets the probe through: `offset` gives it volume.
///   literal     as printed: node gradients interpolated, small steps along them, F = k (p_c - p_t) - b V with all of
///               the velocity, friction by the tick, whatever its length (its errata: F_r for F_v in p_n; f_v over 1
///               reverses, so it is kept under 0.999)
///   consistent  F = -grad(k f^2 / 2) of the potential's own reconstruction: no work in a closed loop, continuous where
///               the reconstruction is; p_c = p_t + F / k. Damping never pulls. Friction by the millisecond
///               (formulation, amendment 15). Changes of local stiffness give no more energy than they took
struct VirtualContactPointLaw {
  Formulation formulation = Formulation::consistent;
  ContactMagnitude magnitude = ContactMagnitude::distance;  ///< literal alone; the consistent form has one magnitude
  double depth_gain = 0.0;                                  ///< d of eq. 2 (1/m), 0 or more
  /// Offset surface for thin objects (Fig. 6a): the force pushes out to where the potential is this (m), 0 or more;
  /// direction, friction and material are those of the original surface's point.
  double offset = 0.0;
};

/// Magnetic surface (hybrid-surface-2004, Fig. 6b): within a band outside the surface the probe is drawn to it, inside
/// it is pushed out as by the virtual contact point.
///   literal     attraction k f, which drops to 0 at the band's edge
///   consistent  k f (1 - (f / band)^2)^2, the slope of a potential: continuous, and a loop in and out does no work
struct MagneticLaw {
  Formulation formulation = Formulation::consistent;
  double band = 0.002;  ///< m, above 0
};

/// The rival of implicit haptic texturing (hybrid-surface-2004, Fig. 10a; Ho, Basdogan and Srinivasan 1999): the
/// contact is the untextured mesh's nearest point, the force along its face's normal turned by the slope of the
/// texture's height there, and longer by that height. Force and direction jump where the nearest face changes.
struct NormalPerturbationLaw {};

/// A law that a program has added (asperity/render/custom_law.h).
class CustomLaw;

using Law = std::variant<ProxyLaw, GodObjectLaw, ForceShadingLaw, HeightFieldLaw, MesostructureLaw,
                         GeneratedGeometryLaw, DenseMeshLaw, AvilaLaw, CrossUncrossLaw, VirtualContactPointLaw,
                         MagneticLaw, NormalPerturbationLaw, std::shared_ptr<const CustomLaw>>;

/// Whether the law reads a scalar field, and so is felt on isosurfaces alone. [any]
constexpr bool needs_field(const Law& law) noexcept {
  return std::holds_alternative<AvilaLaw>(law) || std::holds_alternative<CrossUncrossLaw>(law);
}

/// Whether the law reads a potential on a sparse grid, and so is felt on implicit surfaces alone. [any]
constexpr bool needs_potential(const Law& law) noexcept {
  return std::holds_alternative<VirtualContactPointLaw>(law) || std::holds_alternative<MagneticLaw>(law) ||
         std::holds_alternative<NormalPerturbationLaw>(law);
}

/// The law that a program has added, or nullptr. [any]
inline const CustomLaw* custom_of(const Law& law) noexcept {
  const auto* custom = std::get_if<std::shared_ptr<const CustomLaw>>(&law);
  return custom != nullptr ? custom->get() : nullptr;
}

/// Whether the law takes part in the joint constraint solve (it moves the proxy) rather than adding a force of its own.
/// [any]
constexpr bool constrains(const Law& law) noexcept {
  return std::holds_alternative<ProxyLaw>(law) || std::holds_alternative<GodObjectLaw>(law) ||
         std::holds_alternative<ForceShadingLaw>(law) || std::holds_alternative<GeneratedGeometryLaw>(law) ||
         std::holds_alternative<DenseMeshLaw>(law);
}

/// Whether the law feels a surface as its coat displaces it at the moment. [any]
constexpr bool feels_moment(const Law& law) noexcept {
  return std::holds_alternative<ProxyLaw>(law) || std::holds_alternative<HeightFieldLaw>(law) ||
         std::holds_alternative<MesostructureLaw>(law);
}

/// Whether the law's proxy rests on the displaced surface, smooth or in facets. [any]
constexpr bool follows_relief(const Law& law) noexcept {
  return std::holds_alternative<ProxyLaw>(law) || std::holds_alternative<GeneratedGeometryLaw>(law) ||
         std::holds_alternative<DenseMeshLaw>(law);
}

}  // namespace asperity
