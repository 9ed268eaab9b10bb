#pragma once
// What searching a relief face by face needs, along a motion and around a point. Private to surface.

#include <algorithm>
#include <cmath>

#include "asperity/surface/relief/view.h"

namespace asperity {

// Triangles are split until they are this small against a texel: the surface over one is then nearly a plane.
inline constexpr double leaf_of_texel = 0.5;
inline constexpr int deepest_part = 18;

/// Texels along a triangle's edge, the most of the three. [servo]
inline double texels_across(const ReliefFrame& frame) noexcept {
  const HeightMap& map = frame.coat.maps->heights();
  if (frame.coat.triplanar) {
    const Vec2& tile = frame.coat.maps->tile();
    const double per = std::max(map.width() / tile.x(), map.height() / tile.y());
    return per * std::max({frame.coat.point_u.cwiseAbs().maxCoeff(), frame.coat.point_v.cwiseAbs().maxCoeff(),
                           (frame.coat.point_u - frame.coat.point_v).cwiseAbs().maxCoeff()});
  }
  const auto span = [&](const Vec2& st) {
    return std::max(std::abs(st.x()) * map.width(), std::abs(st.y()) * map.height());
  };
  return std::max({span(frame.coat.st_u), span(frame.coat.st_v), span(frame.coat.st_u - frame.coat.st_v)});
}

// Even the flattest map is bent where faces are joined.
inline constexpr int least_level = 2;
inline constexpr int least_level_stitched = 5;

/// How often a triangle has to be split to be as small as a leaf. [servo]
inline int leaf_level(const ReliefFrame& frame) noexcept {
  double texels = texels_across(frame);
  int level = 0;
  while (level < deepest_part && texels > leaf_of_texel) {
    texels *= 0.5;
    ++level;
  }
  return std::max(level, frame.stitched ? least_level_stitched : least_level);
}

/// The triangle's own affine frame: barycentric (u, v) of the projection, height over the plane.
struct PlaneFrame {
  Vec3 gradient_u;
  Vec3 gradient_v;
  Vec3 normal;
  explicit PlaneFrame(const ShellPrism& prism) noexcept {
    const Vec3 cross = prism.edge_u.cross(prism.edge_v);
    const double area = cross.squaredNorm();
    gradient_u = prism.edge_v.cross(cross) / area;
    gradient_v = cross.cross(prism.edge_u) / area;
    normal = cross / std::sqrt(area);
  }
  [[nodiscard]] Vec3 turned(const Vec3& vector) const noexcept {
    return {gradient_u.dot(vector), gradient_v.dot(vector), normal.dot(vector)};
  }
};

/// Around the places over a face that can come within a distance (m) of a point: what is that near to it has shell
/// coordinates that near to its own. False where these are not known well enough. [servo]
inline bool places_within(const ShellPrism& prism, const Vec3& p, double distance, Vec2& middle, Vec2& reach) noexcept {
  const Vec3 coordinates = PlaneFrame(prism).turned(p - prism.corner);
  ShellPlace place{coordinates.x(), coordinates.y(), coordinates.z()};
  // Far from the face it is large in any case.
  if (!(coordinates.cwiseAbs().head<2>().maxCoeff() < 3.0) || !prism.invert(p, place)) return false;
  const ShellGradients by = shell_gradients(prism, place);
  const double u = by.u.norm();
  const double v = by.v.norm();
  // By how much the shell's Jacobian may change on the way, as a share of itself: then coordinates change by at most
  // twice what they do here.
  const double change = 4.0 * distance * by.height.norm() * (u * prism.turn_u.norm() + v * prism.turn_v.norm());
  middle = {place.u, place.v};
  reach = 2.0 * distance * Vec2(u, v) + Vec2::Constant(1e-12);
  return change <= 0.25;
}

/// [servo]
inline Foot foot_at(const ReliefPlace& place, const ReliefPoint& spot, const Vec3& p) noexcept {
  Foot foot;
  foot.point = spot.point;
  foot.distance = (p - spot.point).norm();
  foot.element = place.frame.face;
  foot.at = {1.0 - place.u - place.v, place.u, place.v};
  foot.normal = spot.front;
  if (foot.normal.dot(p - spot.point) < 0.0) foot.normal = -foot.normal;
  return foot;
}

}  // namespace asperity
