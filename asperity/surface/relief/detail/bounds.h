#pragma once
// Bounds of what relief heights near edges are made of, over part of a face. Private to surface.

#include <algorithm>
#include <cmath>

#include "asperity/surface/height_form.h"
#include "asperity/surface/relief/detail/weights.h"
#include "asperity/surface/relief/surface.h"

namespace asperity {

/// A blend over a coordinate that is `at` in the middle and at most `off` from there, following it along u and v but
/// for `bend`, which is part of `off`. [servo]
inline WeightForm blend_form(const Stitching& stitching, double rho, double at, double by_u, double by_v, double off,
                             double bend) noexcept {
  const double t_off = rho > 0.0 ? off / (2.0 * rho) : infinity;
  const double t = rho > 0.0 ? (at + rho) / (2.0 * rho) : (at >= 0.0 ? infinity : -infinity);
  if (t - t_off >= 1.0 || (rho <= 0.0 && at - off >= 0.0)) return {1.0, 0.0, 0.0, 0.0};
  if (t + t_off <= 0.0 || (rho <= 0.0 && at + off < 0.0)) return {0.0, 0.0, 0.0, 0.0};
  const BlendValue here = blend_value(stitching, rho, at);
  // Largest slope and second derivative by t.
  double slope = infinity;
  double curve = infinity;
  switch (stitching.blend) {
    case Blend::quintic:
      slope = 1.875;
      curve = 10.0 / std::sqrt(3.0);
      break;
    case Blend::s_shape:
      slope = 1.5;
      curve = 6.0;
      break;
    case Blend::linear:
      slope = 1.0;
      curve = t - t_off >= 0.0 && t + t_off <= 1.0 ? 0.0 : infinity;
      break;
    case Blend::image: {
      slope = 0.0;
      const auto last = static_cast<double>(stitching.blend_map.size() - 1);
      for (std::size_t i = 1; i < stitching.blend_map.size(); ++i)
        slope = std::max(slope, last * std::abs(stitching.blend_map[i] - stitching.blend_map[i - 1]));
      break;
    }
    case Blend::none: break;
  }
  const double t_bend = rho > 0.0 ? bend / (2.0 * rho) : 0.0;
  const double second = std::isfinite(curve) ? 0.5 * curve * t_off * t_off + slope * t_bend : infinity;
  const double first = std::isfinite(slope) ? slope * t_off : 1.0;
  // Where it is not known to follow its slope it is taken to stay: it may leave by what it changes.
  if (second < std::min(1.0, first)) return {here.weight, here.slope * by_u, here.slope * by_v, second};
  return {here.weight, 0.0, 0.0, std::min(1.0, first)};
}

/// Of two factors from 0 to 1. [servo]
inline WeightForm product(const WeightForm& a, const WeightForm& b, const FacePart& part) noexcept {
  const double change_a = part.spread(a.u, a.v);
  const double change_b = part.spread(b.u, b.v);
  return {a.weight * b.weight, a.u * b.weight + a.weight * b.u, a.v * b.weight + a.weight * b.v,
          std::min(1.0, change_a * change_b + a.rest * std::min(1.0, b.weight + change_b + b.rest) +
                            b.rest * std::min(1.0, a.weight + change_a + a.rest))};
}

/// Where part of a face lies in another one's coordinates, and how those bend over it.
struct ProjectedPart {
  bool seen = false;
  Projection middle;
  Vec2 bend = Vec2::Zero();  ///< of the coordinates: how far they are from following their slopes
};

/// [servo]
inline ProjectedPart project(const ShellPrism& from, const FacePart& part, const ShellPrism& onto) noexcept {
  ProjectedPart answer;
  answer.middle = project(from, part.middle.x(), part.middle.y(), onto);
  if (!answer.middle.seen) return answer;
  const Vec3 cross = onto.edge_u.cross(onto.edge_v);
  const Vec3 direction = from.direction_at(part.middle.x(), part.middle.y());
  const double facing = cross.dot(direction);
  const double facing_change = part.spread(cross.dot(from.turn_u), cross.dot(from.turn_v));
  const double least = facing - facing_change;
  const double turn = part.spread(from.turn_u, from.turn_v);
  const double longest = direction.norm() + turn;
  const double area = cross.squaredNorm();
  if (!(least > 0.5 * facing && least > least_cosine * std::sqrt(area) * longest)) return answer;
  // rise = -(cross . offset) / facing, a quotient of linear functions of the place: r(d) = r + r'd + e with
  // e = -(f'd) (r'd) / f, where f is the facing at the place.
  const Vec3 offset = from.base_at(part.middle.x(), part.middle.y()) - onto.corner;
  const double rise = -cross.dot(offset) / facing;
  const double rise_u = -(cross.dot(from.edge_u) + rise * cross.dot(from.turn_u)) / facing;
  const double rise_v = -(cross.dot(from.edge_v) + rise * cross.dot(from.turn_v)) / facing;
  const double rise_change = part.spread(rise_u, rise_v);
  const double rise_bend = facing_change * rise_change / least;
  // there = offset + rise direction: what is left beside the slopes.
  const Vec3 gradient[2] = {onto.edge_v.cross(cross) / area, cross.cross(onto.edge_u) / area};
  for (int k = 0; k < 2; ++k)
    answer.bend[k] =
        std::abs(gradient[k].dot(direction)) * rise_bend + gradient[k].norm() * turn * (rise_change + rise_bend);
  answer.seen = true;
  return answer;
}

/// Where a relief is over part of a face whose height is this. [servo]
inline ReliefBound bound_over(const ShellPrism& prism, const HeightForm& height, const FacePart& part) noexcept {
  const Vec3 direction = prism.direction_at(part.middle.x(), part.middle.y());
  const Vec3 middle = prism.base_at(part.middle.x(), part.middle.y()) + height.height * direction;
  const Vec3 along_u = prism.edge_u + height.u * direction + height.height * prism.turn_u;
  const Vec3 along_v = prism.edge_v + height.v * direction + height.height * prism.turn_v;
  ReliefBound bound;
  for (int k = 0; k < 3; ++k) {
    const Vec2 off = part.corner[static_cast<std::size_t>(k)] - part.middle;
    bound.corner[k] = middle + off.x() * along_u + off.y() * along_v;
  }
  // The slopes of height and direction over one another, and what the height has beside its plane.
  const double turn = part.spread(prism.turn_u, prism.turn_v);
  bound.error = part.spread(height.u, height.v) * turn + height.error * (direction.norm() + turn) +
                4e-16 * middle.cwiseAbs().sum();
  return bound;
}

}  // namespace asperity
