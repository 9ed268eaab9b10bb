#pragma once
// What evaluating a relief near the edges of its faces is made of. Private to surface.

#include <cmath>

#include "asperity/surface/relief/frame.h"
#include "asperity/surface/stitching.h"

namespace asperity {

/// The k-th barycentric coordinate. [servo]
inline double coordinate(int k, double u, double v) noexcept {
  return k == 0 ? 1.0 - u - v : (k == 1 ? u : v);
}

/// Product of the blends of the three coordinates, with its derivatives along u and v.
struct PlaceWeight {
  double weight = 0.0;
  double u = 0.0;
  double v = 0.0;
};

/// Of a face at a place in its coordinates. [servo]
inline PlaceWeight place_weight(const Stitching& stitching, const StitchBand& band, double u, double v) noexcept {
  BlendValue one[3];
  for (int k = 0; k < 3; ++k) one[k] = blend_value(stitching, static_cast<double>(band.rho[k]), coordinate(k, u, v));
  const double by[3] = {one[0].slope * one[1].weight * one[2].weight, one[0].weight * one[1].slope * one[2].weight,
                        one[0].weight * one[1].weight * one[2].slope};
  return {one[0].weight * one[1].weight * one[2].weight, by[1] - by[0], by[2] - by[0]};
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
