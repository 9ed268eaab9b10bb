#pragma once
// The steps of a walk along a surface: by Newton's method on the squared distance to a goal.

#include <algorithm>
#include <cmath>

#include "asperity/core/math.h"

namespace asperity {

/// A step along a surface, in the two coordinates of its chart.
struct WalkStep {
  double u = 0.0;
  double v = 0.0;
  double length = 0.0;  ///< m
};

/// The squared distance to a goal around a place, by the coordinates of a chart: half its slope, the metric, half its
/// second derivatives.
struct WalkForms {
  double g_u = 0.0;
  double g_v = 0.0;
  double uu = 0.0;
  double uv = 0.0;
  double vv = 0.0;
  double h_uu = 0.0;
  double h_uv = 0.0;
  double h_vv = 0.0;
};

/// Newton's step is a guide where what is left of the squared distance's curvature is this share of its metric's.
inline constexpr double usually_flattest = 0.02;

/// Newton's step where the squared distance is convex, by more than the share `flattest` of its metric's determinant,
/// Gauss and Newton's where it is not. [servo]
inline WalkStep newton_step(const WalkForms& f, double flattest = usually_flattest) noexcept {
  const auto solved = [&](double uu, double uv, double vv, double det) {
    const double u = -(vv * f.g_u - uv * f.g_v) / det;
    const double v = -(uu * f.g_v - uv * f.g_u) / det;
    return WalkStep{u, v, std::sqrt(std::max(0.0, u * (u * f.uu + 2.0 * v * f.uv) + v * v * f.vv))};
  };
  const double det = f.uu * f.vv - f.uv * f.uv;
  const double newton_det = f.h_uu * f.h_vv - f.h_uv * f.h_uv;
  // Not convex, or nearly flat: its step would be no guide.
  if (f.h_uu > 0.0 && newton_det > flattest * det) return solved(f.h_uu, f.h_uv, f.h_vv, newton_det);
  if (det > 0.0) return solved(f.uu, f.uv, f.vv, det);
  return {};
}

/// Newton's step with each curvature of the squared distance counted as positive: along a ravine, where it is not
/// convex, and not to and fro across. [servo]
[[gnu::noinline]] inline WalkStep ravine_step(const WalkForms& f) noexcept {
  constexpr double least_curvature = 0.05;
  if (!(f.uu > 0.0)) return {};
  // In axes in which the metric is 1.
  const double a = 1.0 / std::sqrt(f.uu);
  const double det = f.vv - f.uv * f.uv / f.uu;
  if (!(det > 0.0)) return {};
  const double c = 1.0 / std::sqrt(det);
  const double b = -f.uv / f.uu * c;
  const double g0 = a * f.g_u;
  const double g1 = b * f.g_u + c * f.g_v;
  const double h00 = a * a * f.h_uu;
  const double h01 = a * (b * f.h_uu + c * f.h_uv);
  const double h11 = b * b * f.h_uu + 2.0 * b * c * f.h_uv + c * c * f.h_vv;
  const double mean = 0.5 * (h00 + h11);
  const double half = std::hypot(0.5 * (h00 - h11), h01);
  double along0 = 1.0;
  double along1 = 0.0;
  if (half > 0.0) {
    const double angle = 0.5 * std::atan2(2.0 * h01, h00 - h11);
    along0 = std::cos(angle);
    along1 = std::sin(angle);
  }
  const double first = (along0 * g0 + along1 * g1) / std::max(least_curvature, std::abs(mean + half));
  const double second = (along0 * g1 - along1 * g0) / std::max(least_curvature, std::abs(mean - half));
  const double y0 = -(along0 * first - along1 * second);
  const double y1 = -(along1 * first + along0 * second);
  return {a * y0 + b * y1, c * y1, std::hypot(y0, y1)};
}

/// A step in a tangent plane.
struct TangentStep {
  Vec3 step = Vec3::Zero();
  double drop = 0.0;  ///< how far the surface falls below its end (m)
};

/// The same in the tangent plane of a surface that a field gives: from a place where the goal lies `pull` (m) along it,
/// `rate` its length, above 0, and `depth` (m) above it; `second` the field's second derivatives, times `scale` those
/// over its slope. The pull itself where the distance is not convex. Of a goal that `friction`, a coefficient, has
/// moved back (`friction_goal`), with how that changes on the way: as the surface bends, the probe is less deep under
/// it. [servo]
inline TangentStep tangent_step(const Vec3& normal, const Vec3& pull, double rate, double depth, const Mat3& second,
                                double scale, double friction = 0.0) noexcept {
  const Vec3 along = (1.0 / rate) * pull;
  const Vec3 across = normal.cross(along);
  const Vec3 bent = second * along;
  const double bend_along = scale * along.dot(bent);
  const double bend_both = scale * across.dot(bent);
  const double bend_across = scale * across.dot(second * across);
  const double a = 1.0 + depth * bend_along;
  const double b = depth * bend_both;
  const double c = 1.0 + depth * bend_across;
  const double determinant = a * c - b * b;
  double go_along = rate;
  double go_across = 0.0;
  if (a > 0.05 && determinant > 0.05 * c && c > 0.0) {
    // What the cone holds is friction times how deep the probe is, and that falls by the whole pull, held part
    // included, times the bend.
    const double held = depth < 0.0 ? friction * (rate - friction * depth) : 0.0;
    const double with_friction = determinant - held * (c * bend_along - b * bend_both);
    const double share = rate / (with_friction > 0.05 * c ? with_friction : determinant);
    go_along = share * c;
    go_across = -share * b;
  }
  return {go_along * along + go_across * across,
          0.5 * (go_along * go_along * bend_along + 2.0 * go_along * go_across * bend_both +
                 go_across * go_across * bend_across)};
}

}  // namespace asperity
