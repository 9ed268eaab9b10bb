#pragma once
// What evaluating a relief near the edges of its faces is made of. Private to surface.

#include <cmath>

#include "asperity/surface/height_jet.h"
#include "asperity/surface/relief/frame.h"
#include "asperity/surface/stitching.h"

namespace asperity {

/// The k-th barycentric coordinate. [servo]
inline double coordinate(int k, double u, double v) noexcept {
  return k == 0 ? 1.0 - u - v : (k == 1 ? u : v);
}

/// Weight of a face at a place in its coordinates: the product of the blends of the three. [servo]
inline HeightJet place_weight(const Stitching& stitching, const StitchBand& band, double u, double v) noexcept {
  BlendValue one[3];
  for (int k = 0; k < 3; ++k) one[k] = blend_value(stitching, static_cast<double>(band.rho[k]), coordinate(k, u, v));
  const double by[3] = {one[0].slope * one[1].weight * one[2].weight, one[0].weight * one[1].slope * one[2].weight,
                        one[0].weight * one[1].weight * one[2].slope};
  const double by_00 = one[0].bend * one[1].weight * one[2].weight;
  const double by_01 = one[0].slope * one[1].slope * one[2].weight;
  const double by_02 = one[0].slope * one[1].weight * one[2].slope;
  const double by_12 = one[0].weight * one[1].slope * one[2].slope;
  return {one[0].weight * one[1].weight * one[2].weight,
          by[1] - by[0],
          by[2] - by[0],
          by_00 - 2.0 * by_01 + one[0].weight * one[1].bend * one[2].weight,
          by_00 - by_01 - by_02 + by_12,
          by_00 - 2.0 * by_02 + one[0].weight * one[1].weight * one[2].bend};
}

/// That weight alone. [servo]
inline double weight_alone(const Stitching& stitching, const StitchBand& band, double u, double v) noexcept {
  double weight = 1.0;
  for (int k = 0; k < 3; ++k)
    weight *= blend_value(stitching, static_cast<double>(band.rho[k]), coordinate(k, u, v)).weight;
  return weight;
}

/// Where a place of one triangle lies on another one's plane, seen along the place's own direction, and how that
/// changes with the place.
struct Projection {
  bool seen = false;
  double u = 0.0;
  double v = 0.0;
  Vec2 by_u = Vec2::Zero();  ///< of (u, v) along the first triangle's u
  Vec2 by_v = Vec2::Zero();
};

// Faces that are seen more aslant than this have no say.
inline constexpr double least_cosine = 0.02;

/// The first half of a projection: where the place lies.
struct ProjectedPlace {
  bool seen = false;
  double u = 0.0;
  double v = 0.0;
  double rise = 0.0;  ///< along `direction`
  double facing = 0.0;
  Vec3 direction;
  Vec3 cross;  ///< of the other triangle's edges
  Vec3 gradient_u;
  Vec3 gradient_v;
};

/// [servo]
inline ProjectedPlace project_place(const ShellPrism& from, double u, double v, const ShellPrism& onto) noexcept {
  ProjectedPlace answer;
  answer.direction = from.direction_at(u, v);
  answer.cross = onto.edge_u.cross(onto.edge_v);
  answer.facing = answer.cross.dot(answer.direction);
  const double area = answer.cross.squaredNorm();
  if (!(answer.facing > 0.0) ||
      answer.facing * answer.facing <= least_cosine * least_cosine * area * answer.direction.squaredNorm())
    return answer;
  const Vec3 offset = from.base_at(u, v) - onto.corner;
  answer.rise = -answer.cross.dot(offset) / answer.facing;
  const Vec3 there = offset + answer.rise * answer.direction;
  answer.gradient_u = onto.edge_v.cross(answer.cross) / area;
  answer.gradient_v = answer.cross.cross(onto.edge_u) / area;
  answer.seen = true;
  answer.u = answer.gradient_u.dot(there);
  answer.v = answer.gradient_v.dot(there);
  return answer;
}

/// The second half: how that changes. [servo]
inline Projection with_changes(const ProjectedPlace& place, const ShellPrism& from) noexcept {
  Projection answer{place.seen, place.u, place.v, Vec2::Zero(), Vec2::Zero()};
  if (!place.seen) return answer;
  const auto change = [&](const Vec3& edge, const Vec3& turn) {
    const double rise_change = -(place.cross.dot(edge) + place.rise * place.cross.dot(turn)) / place.facing;
    const Vec3 moved = edge + place.rise * turn + rise_change * place.direction;
    return Vec2(place.gradient_u.dot(moved), place.gradient_v.dot(moved));
  };
  answer.by_u = change(from.edge_u, from.turn_u);
  answer.by_v = change(from.edge_v, from.turn_v);
  return answer;
}

/// How the changes themselves change along u and v.
struct ProjectionBend {
  Vec2 uu = Vec2::Zero();
  Vec2 uv = Vec2::Zero();
  Vec2 vv = Vec2::Zero();
};

/// Of a place that is seen: rise times facing is linear in u and v. [servo]
inline ProjectionBend bend_of(const ProjectedPlace& place, const ShellPrism& from) noexcept {
  const double facing_u = place.cross.dot(from.turn_u) / place.facing;
  const double facing_v = place.cross.dot(from.turn_v) / place.facing;
  const double rise_u = -place.cross.dot(from.edge_u) / place.facing - place.rise * facing_u;
  const double rise_v = -place.cross.dot(from.edge_v) / place.facing - place.rise * facing_v;
  const auto within = [&](const Vec3& moved) { return Vec2(place.gradient_u.dot(moved), place.gradient_v.dot(moved)); };
  const Vec2 turn_u = within(from.turn_u);
  const Vec2 turn_v = within(from.turn_v);
  const Vec2 direction = within(place.direction);
  return {2.0 * rise_u * (turn_u - facing_u * direction),
          rise_u * (turn_v - facing_v * direction) + rise_v * (turn_u - facing_u * direction),
          2.0 * rise_v * (turn_v - facing_v * direction)};
}

/// What the other face has at a place, by the first one's coordinates. [servo]
inline HeightJet seen_from(const HeightJet& there, const Projection& at, const ProjectionBend& bend) noexcept {
  const auto first = [&](const Vec2& a) { return there.u * a.x() + there.v * a.y(); };
  const auto second = [&](const Vec2& a, const Vec2& b) {
    return there.uu * a.x() * b.x() + there.uv * (a.x() * b.y() + a.y() * b.x()) + there.vv * a.y() * b.y();
  };
  return {there.height,
          first(at.by_u),
          first(at.by_v),
          second(at.by_u, at.by_u) + first(bend.uu),
          second(at.by_u, at.by_v) + first(bend.uv),
          second(at.by_v, at.by_v) + first(bend.vv)};
}

/// [servo]
inline Projection project(const ShellPrism& from, double u, double v, const ShellPrism& onto) noexcept {
  return with_changes(project_place(from, u, v, onto), from);
}

/// Whether a face has a say at a place in its coordinates: some do not, however wide its bands. [servo]
inline bool has_say(const StitchBand& band, double u, double v) noexcept {
  for (int k = 0; k < 3; ++k) {
    if (coordinate(k, u, v) + static_cast<double>(band.rho[k]) < 0.0) return false;
  }
  return true;
}

/// Heights as they are rendered where the relief had to be lowered. [servo]
inline void lower_by_share(const ReliefFrame& frame, double u, double v, HeightJet& jet) noexcept {
  if (!frame.lowered) return;
  const double share = frame.share + u * frame.share_u + v * frame.share_v;
  jet.uu = jet.uu * share + 2.0 * jet.u * frame.share_u;
  jet.uv = jet.uv * share + jet.u * frame.share_v + jet.v * frame.share_u;
  jet.vv = jet.vv * share + 2.0 * jet.v * frame.share_v;
  jet.u = jet.u * share + jet.height * frame.share_u;
  jet.v = jet.v * share + jet.height * frame.share_v;
  jet.height *= share;
}

}  // namespace asperity
