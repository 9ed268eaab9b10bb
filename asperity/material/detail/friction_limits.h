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

/// Length of a direction across the lay within the tangent plane below which there is no lay to speak of.
inline constexpr double no_lay = 1e-6;

/// A force or a stretch after a limit was set to it.
struct Limited {
  Vec3 value;
  bool inside = true;  ///< it was within the limit, and is as it was
};

/// The point of the disc of `radius` that is nearest to `pull`. [servo]
inline Limited limited_by_circle(const Vec3& pull, double radius) noexcept {
  const double square = pull.squaredNorm();
  if (square <= radius * radius) return {pull, true};
  return {(radius / std::sqrt(square)) * pull, false};
}

/// One tick of a contact, reduced to its tangent plane. A spring of two stiffnesses K and r² K (along the lay) is one
/// of K for who measures motion along the lay by r and forces by 1 / r: work and energy stay what they are, and nearest
/// points of the limits become those that dissipate most. Laws see all but `speed` and `drift` that way, and what they
/// answer is `felt` as a force.
struct TangentContact {
  Vec3 motion;             ///< m
  Vec3 velocity;           ///< m/s, as the motion is measured
  Vec3 drift;              ///< m/s, as forces are measured
  double speed = 0.0;      ///< m/s
  double lay_root = 1.0;   ///< r
  double stiffness = 0.0;  ///< N/m, the law's own or the contact's, across the lay
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
  /// A law's answer as a force (N). [servo]
  [[nodiscard]] Vec3 felt(const Vec3& force) const noexcept {
    return lay_root == 1.0 ? force : scaled(force, 1.0, lay_root);
  }
  /// `pull` is on or within the ellipse. [servo]
  [[nodiscard]] bool within(const Vec3& pull, const Limits& limits) const noexcept {
    if (round) return pull.squaredNorm() <= limits.across * limits.across;
    return within_sides(pull, limits);
  }
  /// The point of the ellipse's disc that is nearest to `pull`. [servo]
  [[nodiscard]] Limited limited(const Vec3& pull, const Limits& limits) const noexcept {
    return round ? limited_by_circle(pull, limits.across) : limited_by_sides(pull, limits);
  }
  [[nodiscard]] Vec3 nearest(const Vec3& pull, const Limits& limits) const noexcept {
    return limited(pull, limits).value;
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
  [[nodiscard]] Limited limited_by_sides(const Vec3& pull, const Limits& limits) const noexcept;
};

/// Sets the axes and what limits and stiffness are along them, or by the direction (literal), from those across the
/// lay. `stretch`: which way the contact is strained, for an angle where nothing moves. [servo]
void set_anisotropy(TangentContact& tangent, const FrictionContact& contact, const Vec3& stretch) noexcept;

/// The tick without what is along the normal, with both limits. [servo]
inline TangentContact tangent_contact(const FrictionLaw& law, const FrictionContact& contact,
                                      const Vec3& stretch) noexcept {
  const Vec3& normal = contact.normal;
  const FrictionCoefficients& coefficients = contact.coefficients;
  TangentContact tangent;
  tangent.motion = contact.motion - normal.dot(contact.motion) * normal;
  tangent.velocity = contact.velocity - normal.dot(contact.velocity) * normal;
  tangent.drift = tangent.velocity;
  tangent.speed = tangent.velocity.norm();
  tangent.stiffness = law.stiffness > 0.0 ? law.stiffness : contact.stiffness;
  tangent.dt = contact.dt.count();
  const double push = std::max(0.0, contact.push);
  const double still = law.break_away > 0.0 ? law.break_away : coefficients.still * push;
  const double sliding = coefficients.sliding * push;
  tangent.still = {still, still};
  tangent.sliding = {sliding, sliding};
  if (coefficients.still_ratio != 1.0 || coefficients.sliding_ratio != 1.0 || coefficients.stiffness_ratio != 1.0)
    set_anisotropy(tangent, contact, stretch);
  return tangent;
}

}  // namespace asperity
