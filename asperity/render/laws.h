#pragma once
// How a surface is felt: the settings of the contact laws. One source file per method holds what they do.

#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "asperity/core/result.h"

namespace asperity {

/// As printed in the paper, its defects included, for reproduction; or with its errata resolved.
enum class Formulation { literal, consistent };

/// Constraint-based god-object on the geometry (Zilles and Salisbury 1995; a ball where the probe has a radius, Ruspini
/// 1997). Each tick ends with the complete solve: the proxy is the constrained local minimiser of its distance to the
/// probe. On a coated mesh it feels the base alone.
struct GodObjectLaw {};

/// God-object force turned into the direction of the coat's normal map at the contact, or of the interpolated vertex
/// normals on a bare mesh (Morgenbesser and Srinivasan 1996; force mapping of haptic-textures-2005, 3.2). Its magnitude
/// stays, so it renders no height, and it feeds energy (0.89 mJ a loop in the reference case). As printed only.
struct ForceShadingLaw {};

/// Height field over the base triangle (haptic-textures-2005, 3.3; hrm-2010, Algorithm 1).
///   literal     in the prism, penetration = H - |distance to the plane|, force along the plane's normal; contact is
///   lost below the
///               base at depth H, and heights below 0 are never met (erratum 1)
///   consistent  penetration = H - h with the signed distance h of the nearest base point, force = -grad(k (h - H)^2 /
///   2):
///               no energy from nothing (errata 1, 10)
struct HeightFieldLaw {
  Formulation formulation = Formulation::consistent;
  /// Share of each triangle (in barycentric coordinates) over which heights fall to 0 towards its edges: the C0 rule of
  /// 2005, whose width the paper leaves open. 0 turns it off. In 0 … 1/3.
  double edge_taper = 0.0;
};

/// Weight over the band around an edge, as a function of t from 0 (outside) to 1 (inside).
enum class Blend { none, linear, s_shape, image };

/// Mesostructure blended over adjoining faces (hrm-2010, Algorithm 2).
///   literal     the printed band test, unsigned distance to one plane, averaged normals that are not unit (errata 1,
///   2, 4, 5) consistent  blended signed penetration sum w_i (H_i - h_i) / sum w_i over the faces around, its gradient
///               included: force = -grad(k Phi^2 / 2), continuous where the weights are
struct MesostructureLaw {
  Formulation formulation = Formulation::consistent;
  double rho = 0.05;  ///< width of the band in barycentric coordinates, above 0, at most 1/3
  Blend blend = Blend::s_shape;
  std::vector<double> blend_map;  ///< Blend::image: weights at t = 0 … 1, evenly spaced, at least two
};

using Law = std::variant<GodObjectLaw, ForceShadingLaw, HeightFieldLaw, MesostructureLaw>;

/// "god-object", "force-shading", "height-field", "mesostructure", with "-literal" appended where it is. [any]
std::string law_name(const Law& law);
/// The law of that name with default options. Errors: bad_value listing the names. [any]
Result<Law> law_by_name(std::string_view name);
/// Every name that law_by_name accepts. [any]
const std::vector<std::string>& law_names();
/// Errors: bad_value naming the option and what would be accepted. [build]
Status validate(const Law& law);

/// Whether the law takes part in the joint constraint solve (it moves the proxy) rather than adding a force of its own.
/// [any]
constexpr bool constrains(const Law& law) noexcept {
  return std::holds_alternative<GodObjectLaw>(law) || std::holds_alternative<ForceShadingLaw>(law);
}

/// Weight of one barycentric coordinate, S((b + rho) / (2 rho)) with its derivative by b (erratum 3). [servo]
struct BlendValue {
  double weight;
  double slope;
};
BlendValue blend_value(const MesostructureLaw& law, double barycentric) noexcept;

}  // namespace asperity
