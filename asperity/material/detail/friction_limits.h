#pragma once
// How large friction may be, by direction. Private to material.

#include <algorithm>
#include <cmath>

#include "asperity/core/math.h"
#include "asperity/material/friction.h"

namespace asperity {

/// Half-axes of an ellipse in the tangent plane, not negative (N, or m for a stretch).
struct Limits {
  double across = 0.0;
  double lay = 0.0;
};

/// The point of the disc of `radius` that is nearest to `pull`. [servo]
inline Vec3 nearest_in_circle(const Vec3& pull, double radius) noexcept {
  const double square = pull.squaredNorm();
  if (square <= radius * radius) return pull;
  return (radius / std::sqrt(square)) * pull;
}

/// One tick of a contact, reduced to its tangent plane.
struct TangentContact {
  Vec3 motion;             ///< m
  Vec3 velocity;           ///< m/s
  double stiffness = 0.0;  ///< N/m, the law's own or the contact's
  double dt = 0.0;         ///< s
  Limits still;            ///< N
  Limits sliding;          ///< N
  bool round = true;       ///< both limits are circles, and the axes below are not set
  Vec3 across;
  Vec3 lay;

  /// `v` with its two components scaled. [servo]
  [[nodiscard]] Vec3 scaled(const Vec3& v, double by_across, double by_lay) const noexcept {
    if (round) return by_across * v;
    return (by_across * v.dot(across)) * across + (by_lay * v.dot(lay)) * lay;
  }
  /// `pull` is on or within the ellipse. [servo]
  [[nodiscard]] bool within(const Vec3& pull, const Limits& limits) const noexcept {
    if (round) return pull.squaredNorm() <= limits.across * limits.across;
    return within_sides(pull, limits);
  }
  /// The point of the ellipse's disc that is nearest to `pull`. [servo]
  [[nodiscard]] Vec3 nearest(const Vec3& pull, const Limits& limits) const noexcept {
    if (round) return nearest_in_circle(pull, limits.across);
    return nearest_by_sides(pull, limits);
  }
  /// The point of the ellipse that lies farthest against `direction`: Coulomb friction of maximum dissipation.
  /// Zero where `direction` is, or is not resisted. [servo]
  [[nodiscard]] Vec3 against(const Vec3& direction, const Limits& limits) const noexcept {
    const Vec3 resisted = scaled(direction, limits.across, limits.lay);
    const double norm = resisted.norm();
    if (norm <= 0.0) return Vec3::Zero();
    return scaled(resisted, -limits.across / norm, -limits.lay / norm);
  }

 private:
  [[nodiscard]] bool within_sides(const Vec3& pull, const Limits& limits) const noexcept;
  [[nodiscard]] Vec3 nearest_by_sides(const Vec3& pull, const Limits& limits) const noexcept;
};

/// Sets the axes and what the limits are along them, or by the direction (literal), from circles. `stretch`: which way
/// the contact is strained, for an angle where nothing moves. [servo]
void set_anisotropy(TangentContact& tangent, const FrictionContact& contact, const Vec3& stretch) noexcept;

/// The tick without what is along the normal, with both limits. [servo]
inline TangentContact tangent_contact(const FrictionLaw& law, const FrictionContact& contact,
                                      const Vec3& stretch) noexcept {
  const Vec3& normal = contact.normal;
  const FrictionCoefficients& coefficients = contact.coefficients;
  TangentContact tangent;
  tangent.motion = contact.motion - normal.dot(contact.motion) * normal;
  tangent.velocity = contact.velocity - normal.dot(contact.velocity) * normal;
  tangent.stiffness = law.stiffness > 0.0 ? law.stiffness : contact.stiffness;
  tangent.dt = contact.dt.count();
  const double push = std::max(0.0, contact.push);
  const double still = law.break_away > 0.0 ? law.break_away : coefficients.still * push;
  const double sliding = coefficients.sliding * push;
  tangent.still = {still, still};
  tangent.sliding = {sliding, sliding};
  if (coefficients.still_ratio != 1.0 || coefficients.sliding_ratio != 1.0) set_anisotropy(tangent, contact, stretch);
  return tangent;
}

}  // namespace asperity
