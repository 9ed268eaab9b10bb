#pragma once
// Exact elementary queries on one triangle. Everything larger is built from these, and tested against them.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "asperity/core/math.h"

namespace asperity {

/// The point of a triangle that is nearest to a query point.
struct TrianglePoint {
  Vec3 point = Vec3::Zero();           ///< m
  Vec3 barycentric = Vec3::Zero();     ///< weights of the three corners; non-negative, sum 1
  double squared_distance = infinity;  ///< m²
};

/// Closest point of triangle (a, b, c) to `p`, by Voronoi regions (Ericson 2005, 5.1.5). [servo]
inline TrianglePoint closest_point_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) noexcept {
  const Vec3 ab = b - a;
  const Vec3 ac = c - a;
  const Vec3 ap = p - a;
  const auto answer = [&](double u, double v, double w, const Vec3& point) {
    return TrianglePoint{point, Vec3(u, v, w), (p - point).squaredNorm()};
  };
  const double d1 = ab.dot(ap);
  const double d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) return answer(1.0, 0.0, 0.0, a);
  const Vec3 bp = p - b;
  const double d3 = ab.dot(bp);
  const double d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) return answer(0.0, 1.0, 0.0, b);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    const double v = d1 / (d1 - d3);
    return answer(1.0 - v, v, 0.0, a + v * ab);
  }
  const Vec3 cp = p - c;
  const double d5 = ab.dot(cp);
  const double d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) return answer(0.0, 0.0, 1.0, c);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    const double w = d2 / (d2 - d6);
    return answer(1.0 - w, 0.0, w, a + w * ac);
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && (d4 - d3) >= 0.0 && (d5 - d6) >= 0.0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return answer(0.0, 1.0 - w, w, b + w * (c - b));
  }
  const double sum = va + vb + vc;
  const double v = vb / sum;
  const double w = vc / sum;
  return answer(1.0 - v - w, v, w, a + v * ab + w * ac);
}

/// Answer of a nearest-triangle query; face == no_index: none within the bound.
struct ClosestHit {
  std::uint32_t face = no_index;
  TrianglePoint point;
  /// Whether it is nearer, or as near and of a smaller number: so that no order of asking decides.
  [[nodiscard]] bool before(const ClosestHit& other) const noexcept {
    return point.squared_distance < other.point.squared_distance ||
           (point.squared_distance == other.point.squared_distance && face < other.face);
  }
};

/// Answer of a first-hit query; face == no_index: nothing is met.
struct FirstHit {
  std::uint32_t face = no_index;
  double t = 1.0;  ///< along the segment: 0 at `from`, 1 at `to`
  /// Of two as far along the lower number counts, in whatever order they come.
  [[nodiscard]] bool before(const FirstHit& other) const noexcept {
    return t < other.t || (t == other.t && face < other.face);
  }
};

/// On which side of the edge from `a` to `b` the line through the origin along `direction` passes: the sign, with the
/// rounding that the value may carry. Exchanging a and b negates the value exactly, whatever the compiler fuses, so
/// that two triangles that share an edge never both miss a line through it. [servo]
struct EdgeSide {
  double value = 0.0;
  double rounding = 0.0;
};
inline EdgeSide edge_side(const Vec3& direction, const Vec3& a, const Vec3& b) noexcept {
  const Vec3 difference = a - b;
  const Vec3 sum = a + b;
  const double size = difference.cwiseAbs().maxCoeff() * sum.cwiseAbs().maxCoeff() * direction.cwiseAbs().maxCoeff();
  return {difference.cross(sum).dot(direction), 16.0 * std::numeric_limits<double>::epsilon() * size};
}

/// Whether the segment meets triangle (a, b, c), from either side; if so `t` is where (0 to 1), else untouched.
///
/// Edges, corners and both ends of the segment belong, with the rounding of doubles (about 1e-14 of the distances
/// involved) given to the triangle: a line through an edge or a corner of a closed mesh meets one of the triangles
/// there as long as it crosses them at more than 1e-6 rad, and of two segments that join end to start on the triangle's
/// plane at least one meets it. A segment in the triangle's plane does not meet it. Lengths from 1e-60 to 1e60 m.
/// [servo]
inline bool segment_triangle_intersection(const Segment& segment, const Vec3& a, const Vec3& b, const Vec3& c,
                                          double& t) noexcept {
  // Each end is judged by itself, so that the end of one segment and the start of the next are judged alike.
  const Vec3 normal = (b - a).cross(c - a);
  const double from_side = normal.dot(segment.from - a);
  const double to_side = normal.dot(segment.to - a);
  if ((from_side > 0.0 && to_side > 0.0) || (from_side < 0.0 && to_side < 0.0) || from_side == to_side) return false;
  const Vec3 direction = segment.to - segment.from;
  const Vec3 from_a = a - segment.from;
  const Vec3 from_b = b - segment.from;
  const Vec3 from_c = c - segment.from;
  const EdgeSide sides[3] = {edge_side(direction, from_a, from_b), edge_side(direction, from_b, from_c),
                             edge_side(direction, from_c, from_a)};
  bool left = true;
  bool right = true;
  bool certain = true;
  for (const EdgeSide& side : sides) {
    left = left && side.value >= -side.rounding;
    right = right && side.value <= side.rounding;
    certain = certain && (side.value > side.rounding || side.value < -side.rounding);
  }
  if (!left && !right) return false;
  const double at = from_side / (from_side - to_side);
  if (!certain) {
    // A line along the triangle's plane is undecided about every edge, however far away: the point itself decides.
    const double size = from_a.cwiseAbs().maxCoeff() + from_b.cwiseAbs().maxCoeff() + from_c.cwiseAbs().maxCoeff() +
                        segment.from.cwiseAbs().maxCoeff() + direction.cwiseAbs().maxCoeff();
    const double slope = std::abs(from_side - to_side) / (normal.norm() * direction.norm());
    const double reach = 64.0 * std::numeric_limits<double>::epsilon() * size / std::max(slope, 1e-6);
    const Vec3 point = segment.from + at * direction;
    if (!(closest_point_on_triangle(point, a, b, c).squared_distance <= reach * reach)) return false;
  }
  t = at;
  return true;
}

}  // namespace asperity
