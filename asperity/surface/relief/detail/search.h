#pragma once
// What searching a relief face by face needs, along a motion and around a point. Private to surface.

#include <algorithm>
#include <cmath>

#include "asperity/surface/relief/view.h"

namespace asperity {

// Triangles are split until they are this small against a texel: the surface over one is then nearly a plane.
inline constexpr double leaf_of_texel = 0.5;
inline constexpr int deepest_part = 18;

/// How often a triangle has to be split to be as small as a leaf. [servo]
inline int leaf_level(const ReliefFrame& frame) noexcept {
  const HeightMap& map = frame.coat.maps->heights();
  double texels = 0.0;
  if (frame.coat.triplanar) {
    const Vec2& tile = frame.coat.maps->tile();
    const double per = std::max(map.width() / tile.x(), map.height() / tile.y());
    texels = per * std::max({frame.coat.point_u.cwiseAbs().maxCoeff(), frame.coat.point_v.cwiseAbs().maxCoeff(),
                             (frame.coat.point_u - frame.coat.point_v).cwiseAbs().maxCoeff()});
  } else {
    const auto span = [&](const Vec2& st) {
      return std::max(std::abs(st.x()) * map.width(), std::abs(st.y()) * map.height());
    };
    texels = std::max({span(frame.coat.st_u), span(frame.coat.st_v), span(frame.coat.st_u - frame.coat.st_v)});
  }
  int level = 0;
  while (level < deepest_part && texels > leaf_of_texel) {
    texels *= 0.5;
    ++level;
  }
  // Even the flattest map is bent where faces are joined.
  return std::max(level, frame.stitched ? 5 : 2);
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
