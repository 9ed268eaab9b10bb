#pragma once
// Touching single triangles: what a ball that moves or rests among a few of them meets. The same rules as TriangleIndex
// follows, for triangles that are in no index because they exist for one tick only.

#include <algorithm>
#include <cmath>

#include "asperity/core/fixed_vector.h"
#include "asperity/geometry/closest_point.h"
#include "asperity/geometry/contact.h"

namespace asperity {

/// Lengths below which places are one, for a set of triangles.
struct ContactTolerance {
  double skin = 0.0;      ///< thickness that separates a resting probe from the surface (m)
  double rounding = 0.0;  ///< of a coordinate, with room (m)

  /// For triangles of this mean edge (m) that lie within `bounds`. [any]
  static ContactTolerance of(double mean_edge, const Box& bounds) noexcept {
    const double size = bounds.diagonal() + bounds.lower.cwiseAbs().cwiseMax(bounds.upper.cwiseAbs()).norm();
    return {std::max(1e-6 * mean_edge, 1e-9 * bounds.diagonal()), 64.0 * std::numeric_limits<double>::epsilon() * size};
  }
};

// In skins: a motion is blocked when it would come nearer than the first, and ends at the second. Between the two a
// probe slides freely, so that rounding never holds it where it rests. Either counts as reached within the third.
inline constexpr double blocked_in_skins = 0.5;
inline constexpr double stopped_in_skins = 0.75;
inline constexpr double reached_in_skins = 0.0025;
/// A ball resting within this many skins of a triangle touches it.
inline constexpr double touch_in_skins = 2.0;
/// A ball whose motion is shorter than this share of its radius is judged by what is near its end.
inline constexpr double glide_of_radius = 0.25;
/// How far off the end (m) what such a motion of this length has come too near to on its way can be: to a place that it
/// was off by a radius at its start. [servo]
inline double passed_within(double length, double radius) noexcept {
  constexpr double of_square = 0.55;
  return of_square * length * length / radius;
}

/// The foot of `p` on a triangle: its normal is the face's inside the face, and points to `p` on edges and corners.
/// [servo]
inline Foot triangle_foot(std::uint32_t element, const TrianglePoint& at, const Vec3& p, const Vec3& face_normal,
                          const ContactTolerance& tolerance) noexcept {
  Foot foot;
  foot.point = at.point;
  foot.distance = std::sqrt(at.squared_distance);
  foot.element = element;
  foot.at = at.barycentric;
  const Vec3 offset = p - at.point;
  foot.normal = offset.dot(face_normal) < 0.0 ? Vec3(-face_normal) : face_normal;
  if (at.barycentric.minCoeff() > 0.0 || foot.distance <= tolerance.rounding) return foot;
  // The direction of a short offset is rounding; where it agrees with the face within that rounding, it is the face's.
  if ((offset - foot.distance * foot.normal).norm() > tolerance.rounding) foot.normal = offset / foot.distance;
  return foot;
}

/// Shortens `best` to where a ball that moves along `motion` first touches triangle (a, b, c). Its distance is convex
/// along the motion, so Newton's method from the start never passes the first touch. Of triangles touched at once the
/// one of the smallest number stays, whatever the order in which they are asked. [servo]
inline void sweep_triangle(std::uint32_t element, const Vec3& a, const Vec3& b, const Vec3& c, const Segment& motion,
                           double radius, Sides sides, const ContactTolerance& tolerance, SweptHit& best) noexcept {
  constexpr int newton_limit = 32;
  const Vec3 direction = motion.to - motion.from;
  const Vec3 cross = (b - a).cross(c - a);
  if (sides == Sides::front && cross.dot(motion.from - a) < 0.0) return;
  const double blocked = radius + (blocked_in_skins + reached_in_skins) * tolerance.skin;
  const double stopped = radius + (stopped_in_skins + reached_in_skins) * tolerance.skin;
  const auto too_late = [&](double t) {
    return t > best.t || (t == best.t && (!best.hit || element > best.contact.element));
  };
  double t = 0.0;
  double t_stop = -1.0;
  TrianglePoint at_stop;
  for (int i = 0; i < newton_limit; ++i) {
    const Vec3 x = motion.from + t * direction;
    const TrianglePoint at = closest_point_on_triangle(x, a, b, c);
    const double distance = std::sqrt(at.squared_distance);
    // Exactly on a sheet its side is not decided yet: the motion away from it decides.
    if (distance == 0.0 && (sides == Sides::both || cross.dot(direction) >= 0.0)) return;
    const double slope = distance > 0.0 ? (x - at.point).dot(direction) / distance : -1.0;
    if (slope >= 0.0) return;
    if (t_stop < 0.0 && distance <= stopped) {
      t_stop = t;
      at_stop = at;
    }
    if (distance <= blocked) break;
    const double next = radius + (t_stop < 0.0 ? stopped_in_skins : blocked_in_skins) * tolerance.skin;
    t += (distance - next) / -slope;
    // Where it is blocked need not be before what else is touched, only where it stops.
    if (t >= 1.0 || (t_stop < 0.0 && too_late(t))) return;
  }
  if (t_stop < 0.0) {
    // A ball that grazes is not decided yet: up to here the way is free.
    t_stop = t;
    at_stop = closest_point_on_triangle(motion.from + t * direction, a, b, c);
  }
  if (too_late(t_stop)) return;
  best.hit = true;
  best.t = t_stop;
  best.contact = triangle_foot(element, at_stop, motion.from + best.t * direction, cross.normalized(), tolerance);
}

/// Whether a ball that moves along `motion` stays `least` (m) off triangle (a, b, c), whose place nearest to the end is
/// `at_end`: there, and on its way, unless it is nearer at the start and goes away from there. Its distance is convex
/// along the motion, and so above its tangents at both ends. False where these do not tell. [servo]
inline bool stays_off(const Vec3& a, const Vec3& b, const Vec3& c, const Segment& motion, const TrianglePoint& at_end,
                      double least) noexcept {
  if (at_end.squared_distance <= least * least) return false;
  const Vec3 way = motion.to - motion.from;
  const double end = std::sqrt(at_end.squared_distance);
  const double end_slope = (motion.to - at_end.point).dot(way) / end;
  if (end - end_slope > least) return true;
  const TrianglePoint at_start = closest_point_on_triangle(motion.from, a, b, c);
  const double start = std::sqrt(at_start.squared_distance);
  if (!(start > 0.0)) return false;
  const double start_slope = (motion.from - at_start.point).dot(way) / start;
  if (start_slope >= 0.0) return true;
  // Where both tangents meet.
  const double t = (end - end_slope - start) / (start_slope - end_slope);
  return start + start_slope * t > least;
}

/// Triangles near a place, the nearest first and equally near ones by number, in whatever order they were found; of
/// more than fit, the nearest.
class NearTriangles {
 public:
  /// Takes it where it comes within `reach` (m). [servo]
  void offer(const ClosestHit& near, double reach) noexcept {
    if (!(near.point.squared_distance <= reach * reach)) return;
    std::size_t at = nearest_.size();
    if (!nearest_.push_back(near) && !near.before(nearest_[--at])) return;
    for (; at > 0 && near.before(nearest_[at - 1]); --at) nearest_[at] = nearest_[at - 1];
    nearest_[at] = near;
  }
  [[nodiscard]] const ClosestHit* begin() const noexcept { return nearest_.begin(); }
  [[nodiscard]] const ClosestHit* end() const noexcept { return nearest_.end(); }

 private:
  FixedVector<ClosestHit, 64> nearest_;
};

/// Adds the plane of triangle (a, b, c), whose point nearest to `position` is `near`; of one plane the triangle that
/// was added first stays. [servo]
inline void add_triangle_contact(const ClosestHit& near, const Vec3& a, const Vec3& b, const Vec3& c,
                                 const Vec3& position, Sides sides, const ContactTolerance& tolerance,
                                 ContactSet& out) noexcept {
  // Two contacts whose normals differ by less than this angle are one plane: their common line is undefined.
  constexpr double same_plane_cosine = 1.0 - 1e-10;
  const Vec3 cross = (b - a).cross(c - a);
  if (sides == Sides::front && cross.dot(position - a) < 0.0) return;
  const Foot contact = triangle_foot(near.face, near.point, position, cross.normalized(), tolerance);
  for (const Foot& other : out) {
    if (contact.normal.dot(other.normal) >= same_plane_cosine) return;
  }
  out.push_back(contact);
}

/// Makes of the edges and corners among the contacts what they mean beside a touched face. A ball over a face also
/// comes near the edges of its neighbours; the face's own plane keeps it off those edges. Taken as planes of their own,
/// which lean back towards the ball, they would hold it at every edge it wants to slide across. `corners(element)`
/// answers a triangle's three corners. [servo]
template <class Corners>
void settle_edge_contacts(const Vec3& position, const ContactTolerance& tolerance, const Corners& corners,
                          ContactSet& contacts) noexcept {
  const auto inside_face = [](const Foot& foot) { return foot.at.minCoeff() > 0.0; };
  for (std::size_t i = contacts.size(); contacts.size() > 1 && i-- > 0;) {
    Foot& edge = contacts[i];
    if (inside_face(edge)) continue;
    const Foot* guard = nullptr;
    for (const Foot& face : contacts) {
      if (inside_face(face) && face.normal.dot(edge.point - face.point) <= tolerance.rounding) guard = &face;
    }
    if (guard == nullptr) continue;
    const std::array<Vec3, 3> triangle = corners(edge.element);
    double highest = -infinity;
    for (const Vec3& corner : triangle) highest = std::max(highest, guard->normal.dot(corner - guard->point));
    if (highest <= tolerance.rounding) {
      // Convex: the whole neighbour lies below the face's plane.
      contacts.swap_remove(i);
    } else {
      // Concave: what stops the slide is the neighbour's own plane.
      const Vec3 normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalized();
      edge.normal = normal.dot(position - edge.point) < 0.0 ? Vec3(-normal) : normal;
    }
  }
}

}  // namespace asperity
