#include "asperity/material/detail/friction_limits.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace asperity {

namespace {

/// Nearest point of the ellipse x²/a² + y²/b² = 1 to (x, y) outside of it, a the larger half-axis and above 0.
Vec2 nearest_on_ellipse(double x, double y, double a, double b) noexcept {
  // A segment: the root below would be 0 / 0.
  if (b <= 1e-9 * a) return {std::clamp(x, -a, a), 0.0};
  // In units of the larger half-axis. The point is (p / (1 + t), b² q / (b² + t)) with the t > 0 that puts it on the
  // ellipse. 1 / norm is concave and nearly straight in t: Newton's steps from below never overshoot.
  const double unit = 1.0 / a;
  const double p = x * unit;
  const double q = y * unit;
  const double ratio = b * unit;
  const double square = ratio * ratio;
  const double bq = ratio * q;
  constexpr int most_steps = 12;
  // Of the limit; the cone and passivity hold at any t, this is the direction alone.
  constexpr double close_enough = 1e-6;
  double t = 0.0;
  double u = 0.0;
  double v = 0.0;
  double excess = 0.0;
  for (int step = 0; step < most_steps; ++step) {
    // One division for both.
    const double by_both = 1.0 / ((t + 1.0) * (t + square));
    const double by_a = by_both * (t + square);
    const double by_b = by_both * (t + 1.0);
    u = p * by_a;
    v = bq * by_b;
    excess = u * u + v * v - 1.0;
    if (excess <= close_enough) break;
    if (step == 0 && excess > 3.0) {
      // From far away a start that the root cannot be below.
      t = std::max({0.0, std::abs(p) - 1.0, std::abs(bq) - square, std::sqrt(p * p + bq * bq) - 1.0});
      continue;
    }
    // norm - 1; near the ellipse two terms of the root, which are below it.
    const double beyond = excess < 0.1 ? excess * (0.5 - 0.125 * excess) : std::sqrt(1.0 + excess) - 1.0;
    t += (1.0 + excess) * beyond / (u * u * by_a + v * v * by_b);
  }
  // Onto the ellipse along the ray: what the steps left over never leaves the disc.
  const double onto = excess > 0.0 ? a / std::sqrt(1.0 + excess) : a;
  return {onto * u, ratio * onto * v};
}

bool within_ellipse(double x, double y, const Limits& limits) noexcept {
  const double p = x * limits.lay;
  const double q = y * limits.across;
  const double r = limits.across * limits.lay;
  return std::abs(x) <= limits.across && std::abs(y) <= limits.lay && p * p + q * q <= r * r;
}

/// Of a place outside.
Vec2 nearest_on_rim(double x, double y, const Limits& limits) noexcept {
  if (limits.across >= limits.lay)
    return limits.across > 0.0 ? nearest_on_ellipse(x, y, limits.across, limits.lay) : Vec2(0.0, 0.0);
  const Vec2 turned = nearest_on_ellipse(y, x, limits.lay, limits.across);
  return {turned.y(), turned.x()};
}

Vec2 nearest_in_disc(double x, double y, const Limits& limits) noexcept {
  return within_ellipse(x, y, limits) ? Vec2(x, y) : nearest_on_rim(x, y, limits);
}

/// Share of the way from the coefficient across the lay to the one along it (heterogeneous-features-2008, eq. 15).
double turned_share(const Vec3& direction, const Vec3& across, const Vec3& lay) noexcept {
  return std::atan2(std::abs(direction.dot(lay)), std::abs(direction.dot(across))) / (0.5 * std::numbers::pi);
}

}  // namespace

bool TangentContact::within_sides(const Vec3& pull, const Limits& limits) const noexcept {
  return within_ellipse(pull.dot(across), pull.dot(lay), limits);
}

Limited TangentContact::limited_by_sides(const Vec3& pull, const Limits& limits) const noexcept {
  const Vec2 sides(pull.dot(across), pull.dot(lay));
  if (within_ellipse(sides.x(), sides.y(), limits)) return {pull, true};
  const Vec2 point = nearest_on_rim(sides.x(), sides.y(), limits);
  return {point.x() * across + point.y() * lay, false};
}

void set_anisotropy(TangentContact& tangent, const FrictionContact& contact, const Vec3& stretch) noexcept {
  const Vec3& normal = contact.normal;
  const FrictionCoefficients& coefficients = contact.coefficients;
  Vec3 across = coefficients.across - normal.dot(coefficients.across) * normal;
  const double length = across.squaredNorm();
  if (!(length > no_lay * no_lay)) return;
  // Mostly it comes as a unit vector.
  constexpr double rounding = 1e-14;
  if (std::abs(length - 1.0) > rounding) across *= 1.0 / std::sqrt(length);
  const Vec3 lay = normal.cross(across);
  const double still = tangent.still.across;
  const double sliding = tangent.sliding.across;
  if (coefficients.formulation == Formulation::literal) {
    const Vec3& moving = tangent.velocity.isZero(0.0) ? tangent.motion : tangent.velocity;
    const double share = turned_share(moving.isZero(0.0) ? stretch : moving, across, lay);
    const double still_here = still * (1.0 - (1.0 - coefficients.still_ratio) * share);
    const double sliding_here = sliding * (1.0 - (1.0 - coefficients.sliding_ratio) * share);
    tangent.still = {still_here, still_here};
    tangent.sliding = {sliding_here, sliding_here};
    tangent.stiffness *= 1.0 - (1.0 - coefficients.stiffness_ratio) * share;
    return;
  }
  tangent.round = false;
  tangent.across = across;
  tangent.lay = lay;
  tangent.still.lay = still * coefficients.still_ratio;
  tangent.sliding.lay = sliding * coefficients.sliding_ratio;
  if (coefficients.stiffness_ratio == 1.0) return;
  const double root = std::sqrt(coefficients.stiffness_ratio);
  tangent.lay_root = root;
  tangent.motion = tangent.scaled(tangent.motion, 1.0, root);
  tangent.velocity = tangent.scaled(tangent.velocity, 1.0, root);
  tangent.drift = tangent.scaled(tangent.drift, 1.0, 1.0 / root);
  tangent.still.lay /= root;
  tangent.sliding.lay /= root;
}

Vec3 nearest_in_ellipse(const Vec3& pull, const Vec3& normal, const Vec3& across, double along_across,
                        double along_lay) noexcept {
  const Vec3 flat = pull - normal.dot(pull) * normal;
  if (across.isZero(0.0)) return limited_by_circle(flat, along_across).value;
  const Vec3 lay = normal.cross(across);
  const Vec2 point = nearest_in_disc(flat.dot(across), flat.dot(lay), {along_across, along_lay});
  return point.x() * across + point.y() * lay;
}

}  // namespace asperity
