#pragma once
// Friction laws. All of them answer one tick of one contact from the same input and keep what they remember in one
// FrictionState, so that they can be driven by `step` and by a rig alike.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/formulation.h"
#include "asperity/core/math.h"
#include "asperity/core/result.h"
#include "asperity/core/units.h"

namespace asperity {

/// The friction laws.
enum class FrictionKind : std::uint8_t {
  /// Coulomb's set-valued law by an implicit Euler step (Kikuuwe et al. 2006): a spring to an anchor that is dragged
  /// along where the spring would leave the cone. No velocity is read, no drift, exact sticking. The default.
  implicit_coulomb,
  viscous,            ///< proportional to velocity
  coulomb,            ///< sliding friction alone, against the velocity
  karnopp,            ///< stick by a spring, slip by Coulomb (heterogeneous-features-2008, eq. 13 and 14)
  dahl,               ///< friction as a function of displacement (Dahl 1968)
  hayward_armstrong,  ///< Dahl's law with an adhesion map: no drift (Hayward and Armstrong 2000)
  lugre,              ///< bristles with Stribeck's curve (Canudas de Wit et al. 1995)
};
/// As in scene files.
template <>
struct Names<FrictionKind> {
  static constexpr auto table =
      std::to_array<Named<FrictionKind>>({{FrictionKind::implicit_coulomb, "implicit-coulomb"},
                                          {FrictionKind::viscous, "viscous"},
                                          {FrictionKind::coulomb, "coulomb"},
                                          {FrictionKind::karnopp, "karnopp"},
                                          {FrictionKind::dahl, "dahl"},
                                          {FrictionKind::hayward_armstrong, "hayward-armstrong"},
                                          {FrictionKind::lugre, "lugre"}});
};

/// A friction law and its parameters, SI. Coefficients are the material's; what a law does not take is left at its
/// default (validate says so).
///   literal     as printed: Karnopp's stick is decided by speed and the break by force, its limit is `break_away`
///               whatever pushes; Coulomb's force jumps at rest; LuGre's bristle damping is constant
///   consistent  passive: a state machine that re-anchors where the force is continuous; limits grow with the push
///               unless `break_away` is given; Coulomb's force is proportional to speed below `stick_speed`; LuGre's
///               bristle damping falls with speed and the sum stays within the cone
struct FrictionLaw {
  FrictionKind kind = FrictionKind::implicit_coulomb;
  Formulation formulation = Formulation::consistent;
  double stiffness = 0.0;     ///< of the contact's tangential spring (N/m): k_s, sigma_0; 0: the contact's own
  double damping = 0.0;       ///< beside that spring (N·s/m): implicit_coulomb, karnopp (consistent), lugre (sigma_1)
  double viscosity = 0.0;     ///< N·s/m: viscous, and added where a law slides: karnopp, coulomb, lugre (sigma_2)
  double break_away = 0.0;    ///< F_s (N), constant; 0: static coefficient times push. karnopp, implicit_coulomb, lugre
  double stick_speed = 5e-3;  ///< m/s, above 0: karnopp's delta v; coulomb (consistent)
  double stribeck_speed = 1e-2;  ///< m/s, above 0: lugre
  double exponent = 1.0;         ///< dahl: shape of the approach to sliding, 0.5 to 4
  double adhesion = 0.1;  ///< hayward_armstrong: share of the largest stretch below which nothing creeps, 0 to 0.9
  bool operator==(const FrictionLaw&) const = default;
};

/// "implicit-coulomb", "viscous", "coulomb", "karnopp", "dahl", "hayward-armstrong", "lugre". [any]
const char* friction_name(FrictionKind kind);
/// Errors: bad_value listing the names. [any]
Result<FrictionKind> friction_by_name(std::string_view name);
/// Every name that friction_by_name accepts. [any]
const std::vector<std::string>& friction_names();
/// The members of FrictionLaw that a kind reads, by the names that scene files give them ("stiffness", "stick_speed",
/// ...). [any]
const std::vector<std::string>& friction_parameters(FrictionKind kind);
/// Errors: bad_value naming the parameter and what would be accepted; also a parameter set that the kind does not
/// read. [build]
Status validate(const FrictionLaw& law);

/// Coefficients of one contact, and how they depend on the direction.
struct FrictionCoefficients {
  double still = 0.0;            ///< static coefficient across the lay, where it is largest; not below `sliding`
  double sliding = 0.0;          ///< dynamic coefficient across the lay
  double still_ratio = 1.0;      ///< along the lay over across it, 0 to 1; 1: the same in every direction
  double sliding_ratio = 1.0;    ///< likewise
  double stiffness_ratio = 1.0;  ///< stiffness of the law's spring along the lay over across it, above 0 to 1
  Vec3 across = Vec3::Zero();    ///< unit, in the tangent plane: along the gradient of the features; zero: isotropic
  /// literal: coefficients and stiffness interpolated by the angle between velocity and gradient, force against the
  /// velocity (heterogeneous-features-2008, eq. 15), which feeds energy where a stretched spring turns stiffer;
  /// consistent: an ellipse, force of maximum dissipation, and a spring of two stiffnesses.
  Formulation formulation = Formulation::consistent;
};

/// What a friction law is told at one tick. Any frame, the same from tick to tick.
struct FrictionContact {
  Vec3 normal = Vec3::UnitZ();   ///< unit, away from the surface
  double push = 0.0;             ///< normal force (N), not negative
  Vec3 motion = Vec3::Zero();    ///< of the probe over the surface since the last tick (m); its tangential part counts
  Vec3 velocity = Vec3::Zero();  ///< m/s, the device's estimate; its tangential part counts
  double stiffness = 1000.0;     ///< N/m above 0: of the tangential spring where the law has none of its own
  Seconds dt{1e-3};              ///< since the last tick, above 0
  FrictionCoefficients coefficients;
};

/// What a contact remembers between ticks. `FrictionState{}` is one that has just been made.
struct FrictionState {
  /// Of the spring: from its anchor to the probe (m), in the tangent plane. Of two stiffnesses (consistent): along the
  /// lay as long as what holds as much energy across it, so that a lay that turns gives none.
  Vec3 stretch = Vec3::Zero();
  double stiffness = 0.0;  ///< of the spring that holds it (N/m), across the lay; 0: not stretched yet
  FrictionKind kind = FrictionKind::implicit_coulomb;  ///< that the rest belongs to
  bool sliding = false;                                ///< the last tick slid
  bool fast = false;                                   ///< karnopp: has been as fast as stick_speed since it broke away
  bool held = false;                                   ///< the state is of a contact that goes on
};

/// Friction force on the probe (N), in the tangent plane. The first tick of a contact stretches nothing.
///
/// Laws without a spring never push along the velocity. For the others, the sum of -f . motion (f the force answered
/// with that motion) is not below the change of friction_energy, at any dt (formulation, amendment 7). [servo]
Vec3 friction_force(const FrictionLaw& law, const FrictionContact& contact, FrictionState& state) noexcept;
/// Energy held in the tangential spring (J). [servo]
double friction_energy(const FrictionState& state) noexcept;
/// The part of the force of a law with a spring that its spring pulls with (N), after the same contact was answered.
/// [servo]
Vec3 friction_spring(const FrictionContact& contact, const FrictionState& state) noexcept;

/// The point of an ellipse's disc that is nearest to `pull`, in the tangent plane: `across` unit, the half-axis along
/// it, and the half-axis at right angles to it in the plane of `normal`, none negative. With `across` zero a circle of
/// half-axis `along_across`. To 1e-6 of the larger half-axis, and never outside. [servo]
Vec3 nearest_in_ellipse(const Vec3& pull, const Vec3& normal, const Vec3& across, double along_across,
                        double along_lay) noexcept;

}  // namespace asperity
