// Bounds of a coat's heights over parts of a face.

#include <algorithm>
#include <span>

#include "asperity/surface/coat.h"
#include "asperity/surface/detail/triplanar.h"

namespace asperity {

namespace {

// By how much texture coordinates are rounded, as a share of them.
constexpr double read_room = 1e-15;

/// Around the places at three barycentric coordinates.
Box box_around(const CoatFrame& frame, const Vec2 corners[3]) noexcept {
  Box box;
  for (int k = 0; k < 3; ++k) box.include(place_at(frame, corners[k].x(), corners[k].y()));
  return box;
}

Box box_around(const CoatFrame& frame, const FacePart& part) noexcept {
  Box box;
  part.for_each_extreme([&](double u, double v) { box.include(place_at(frame, u, v)); });
  return box;
}

/// A map's plane over a rectangle of texture coordinates, by a part's own coordinates.
HeightForm form_of(const HeightPlane& plane, const Vec2& st, const Vec2& st_u, const Vec2& st_v) noexcept {
  return {plane.height + plane.slope.dot(st - plane.centre), plane.slope.dot(st_u), plane.slope.dot(st_v), plane.error};
}

/// How an axis of a triplanar mapping weighs over a part: max(0, q)^2, q a quadratic function of the place.
WeightForm axis_weight(const CoatFrame& frame, int axis, const Vec3& normal, double turn_square,
                       const FacePart& part) noexcept {
  const double n = normal[axis];
  const double nu = frame.normal_u[axis];
  const double nv = frame.normal_v[axis];
  const double q = n * n - triplanar_threshold * normal.squaredNorm();
  const double q_u = 2.0 * (n * nu - triplanar_threshold * normal.dot(frame.normal_u));
  const double q_v = 2.0 * (n * nv - triplanar_threshold * normal.dot(frame.normal_v));
  const double own = part.spread(nu, nv);
  // Of the two squares that q is the difference of, the greater bounds it.
  const double bend = std::max(own * own, triplanar_threshold * turn_square);
  const double change = part.spread(q_u, q_v) + bend;
  if (q <= 0.0) {
    const double most = std::max(0.0, q + change);
    return {0.0, 0.0, 0.0, most * most};
  }
  return {q * q, 2.0 * q * q_u, 2.0 * q * q_v, 2.0 * q * bend + change * change};
}

}  // namespace

HeightRange Coat::range(const CoatFrame& frame, const Vec2 corners[3]) const noexcept {
  HeightRange sum = own_range(frame, corners);
  for (const CoatLayer& layer : frame.layers) {
    HeightRange more;
    if (layer.solid != nullptr) {
      const Box box = box_around(frame, corners);
      more = layer.solid->range(box.centre(), 0.5 * box.extent(), frame.moment.time);
    } else {
      more = own_range(layer_frame(frame, layer), corners);
    }
    sum.lowest += more.lowest;
    sum.highest += more.highest;
  }
  return sum;
}

HeightRange Coat::own_range(const CoatFrame& frame, const Vec2 corners[3]) const noexcept {
  if (!frame.triplanar) {
    Vec2 lower = Vec2::Constant(infinity);
    Vec2 upper = Vec2::Constant(-infinity);
    for (int k = 0; k < 3; ++k) {
      const Vec2 st = frame.st + corners[k].x() * frame.st_u + corners[k].y() * frame.st_v;
      lower = lower.cwiseMin(st);
      upper = upper.cwiseMax(st);
    }
    return frame.maps->range_over(lower, upper, frame.level);
  }
  // A weighted mean of three heights lies between their bounds.
  const Box box = box_around(frame, corners);
  const Vec2& tile = frame.maps->tile();
  HeightRange all{infinity, -infinity};
  for (int axis = 0; axis < 3; ++axis) {
    const HeightRange one =
        frame.maps->range_over(seen_along(axis, box.lower, tile), seen_along(axis, box.upper, tile), frame.level);
    all.lowest = std::min(all.lowest, one.lowest);
    all.highest = std::max(all.highest, one.highest);
  }
  return all;
}

HeightForm Coat::form(const CoatFrame& frame, const FacePart& part) const noexcept {
  HeightForm sum = own_form(frame, part);
  for (const CoatLayer& layer : frame.layers) {
    if (layer.solid == nullptr) {
      sum.add(own_form(layer_frame(frame, layer), part));
      continue;
    }
    const Box box = box_around(frame, part);
    const SolidPlane plane = layer.solid->plane(box.centre(), 0.5 * box.extent(), frame.moment.time);
    const Vec3 middle = place_at(frame, part.middle.x(), part.middle.y());
    sum.add({plane.height + plane.gradient.dot(middle - box.centre()), plane.gradient.dot(frame.point_u),
             plane.gradient.dot(frame.point_v), plane.error});
  }
  return sum;
}

HeightForm Coat::own_form(const CoatFrame& frame, const FacePart& part) const noexcept {
  if (frame.triplanar) return triplanar_form(frame, part);
  Vec2 lower = Vec2::Constant(infinity);
  Vec2 upper = Vec2::Constant(-infinity);
  for (int k = 0; k < part.corners; ++k) {
    const Vec2& at = part.corner[static_cast<std::size_t>(k)];
    const Vec2 st = frame.st + at.x() * frame.st_u + at.y() * frame.st_v;
    lower = lower.cwiseMin(st);
    upper = upper.cwiseMax(st);
  }
  // Places on a texel's border may read the next one by rounding, which counts where heights are steps.
  const Vec2 grown = part.pad.x() * frame.st_u.cwiseAbs() + part.pad.y() * frame.st_v.cwiseAbs() +
                     read_room * (Vec2::Ones() + lower.cwiseAbs() + upper.cwiseAbs());
  return form_of(frame.maps->plane_over(lower - grown, upper + grown, frame.level),
                 frame.st + part.middle.x() * frame.st_u + part.middle.y() * frame.st_v, frame.st_u, frame.st_v);
}

HeightForm Coat::triplanar_form(const CoatFrame& frame, const FacePart& part) const noexcept {
  const Vec3 normal = frame.normal + part.middle.x() * frame.normal_u + part.middle.y() * frame.normal_v;
  const double turn = part.spread(frame.normal_u, frame.normal_v);
  const Box box = box_around(frame, part);
  const Vec3 point = place_at(frame, part.middle.x(), part.middle.y());
  const Vec2& tile = frame.maps->tile();
  HeightForm heights[3];
  WeightForm weights[3];
  std::size_t count = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const WeightForm weight = axis_weight(frame, axis, normal, turn * turn, part);
    if (weight.weight <= 0.0 && weight.rest <= 0.0) continue;
    const Vec2 lower = seen_along(axis, box.lower, tile);
    const Vec2 upper = seen_along(axis, box.upper, tile);
    const Vec2 room = read_room * (Vec2::Ones() + lower.cwiseAbs() + upper.cwiseAbs());
    const HeightPlane plane = frame.maps->plane_over(lower - room, upper + room, frame.level);
    heights[count] = form_of(plane, seen_along(axis, point, tile), seen_along(axis, frame.point_u, tile),
                             seen_along(axis, frame.point_v, tile));
    weights[count++] = weight;
  }
  if (count == 1) return heights[0];
  const std::span<WeightForm> used(weights, count);
  if (normalise(used, part)) return mixed({heights, count}, used, part);
  HeightRange all{infinity, -infinity};
  for (const HeightForm& one : std::span(heights, count)) {
    const double off = part.spread(one.u, one.v) + one.error;
    all.lowest = std::min(all.lowest, one.height - off);
    all.highest = std::max(all.highest, one.height + off);
  }
  return HeightForm::level(all.lowest, all.highest);
}

}  // namespace asperity
