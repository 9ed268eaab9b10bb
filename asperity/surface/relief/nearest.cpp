// Which point of a displaced surface is nearest to one in space: by splitting triangles.

#include <algorithm>
#include <cmath>

#include "asperity/geometry/closest_point.h"
#include "asperity/surface/relief/detail/search.h"

namespace asperity {

namespace {

constexpr int stack_capacity = 4 * deepest_part + 8;

/// Part of a triangle: three corners in its barycentric (u, v).
struct Part {
  Vec2 corner[3];
  int level = 0;
  double key = 0.0;
  double radius = 0.0;  ///< of a ball around its relief (m)
};

void split(const Part& part, Part out[4]) noexcept {
  const Vec2 middle[3] = {0.5 * (part.corner[1] + part.corner[2]), 0.5 * (part.corner[2] + part.corner[0]),
                          0.5 * (part.corner[0] + part.corner[1])};
  for (int k = 0; k < 3; ++k) {
    out[k] = part;
    out[k].corner[(k + 1) % 3] = middle[(k + 2) % 3];
    out[k].corner[(k + 2) % 3] = middle[(k + 1) % 3];
  }
  out[3] = part;
  for (int k = 0; k < 3; ++k) out[3].corner[k] = middle[k];
  for (int k = 0; k < 4; ++k) out[k].level = part.level + 1;
}

Part whole() noexcept {
  Part part;
  part.corner[0] = Vec2(0.0, 0.0);
  part.corner[1] = Vec2(1.0, 0.0);
  part.corner[2] = Vec2(0.0, 1.0);
  return part;
}

/// Searches triangles for the point of their relief that is nearest to a point.
class ReliefNearestSearch {
 public:
  ReliefNearestSearch(const ReliefSurface& surface, const Vec3& p, double bound, const CoatMoment& moment) noexcept
      : surface_(surface), p_(p), moment_(moment), distance_(bound) {}

  [[nodiscard]] double distance() const noexcept { return distance_; }
  [[nodiscard]] bool found() const noexcept { return place_.frame.face != no_index; }
  [[nodiscard]] const ReliefPlace& place() const noexcept { return place_; }
  [[nodiscard]] const ReliefPoint& spot() const noexcept { return spot_; }
  [[nodiscard]] const WorkCount& count() const noexcept { return count_; }

  /// Starts a descent from a place, and keeps where it ends if that is nearer than all before.
  void descend_from(const ReliefPlace& place) noexcept {
    ReliefPlace at = place;
    ReliefPoint spot = surface_.point(at.frame, at.u, at.v);
    const Goal goal{.point = p_, .may_leave = false, .exactly = true};
    const DescentEnd end = descend(surface_, at, spot, 1.0, goal, count_);
    const double now = (spot.point - p_).norm();
    if (now > distance_ || (now == distance_ && found())) return;
    distance_ = now;
    place_ = at;
    spot_ = spot;
    rests_ = end == DescentEnd::rest;
  }

  void visit(std::uint32_t face) noexcept {
    ReliefPlace here;
    ++count_.frames;
    here.frame = found() && place_.frame.face == face ? place_.frame : surface_.frame(face, moment_);
    const double small = std::ldexp(1.0, -leaf_level(here.frame));
    Part stack[stack_capacity];
    int top = 0;
    if (!window(here.frame, stack[0])) stack[0] = whole();
    constexpr double tiny = 0.05;
    if (is_outside(stack[0]) || (is_small(stack[0], tiny * small) && holds_found(face, stack[0]))) return;
    measure(here.frame, stack[0]);
    top = stack[0].key < distance_ ? 1 : 0;
    while (top > 0) {
      const Part part = stack[--top];
      if (part.key >= distance_) continue;
      if (is_small(part, small) || part.level >= deepest_part) {
        const Vec2 middle = within_face((part.corner[0] + part.corner[1] + part.corner[2]) / 3.0);
        here.u = middle.x();
        here.v = middle.y();
        ++count_.evaluations;
        const double now = (surface_.point(here.frame, here.u, here.v).point - p_).norm();
        // Before anything is found every leaf that may reach into the bound is tried; after that, a leaf this small
        // whose middle is no nearer lies on the way of a descent that was made already.
        double slack = 2.0;
        if (found())
          slack = holds_found(face, part) ? 0.0 : std::min(0.5, part.radius / std::max(distance_, part.radius));
        if (now < distance_ + slack * part.radius) descend_from(here);
        continue;
      }
      Part parts[4];
      split(part, parts);
      const int below = top;
      for (Part& child : parts) {
        if (is_outside(child)) continue;
        measure(here.frame, child);
        if (child.key >= distance_) continue;
        int slot = top++;
        for (; slot > below && stack[slot - 1].key < child.key; --slot) stack[slot] = stack[slot - 1];
        stack[slot] = child;
      }
    }
  }

 private:
  /// Around the places of a face that can come within the distance of the point. False where that is most of the face.
  bool window(const ReliefFrame& frame, Part& part) const noexcept {
    constexpr double most = 0.2;
    Vec2 middle;
    Vec2 reach;
    if (!places_within(frame.prism, p_, distance_, middle, reach) || reach.maxCoeff() > most) return false;
    const Vec2 lower = middle - reach;
    part = whole();
    part.corner[0] = lower;
    part.corner[1] = lower + Vec2(4.0 * reach.x(), 0.0);
    part.corner[2] = lower + Vec2(0.0, 4.0 * reach.y());
    return true;
  }

  static bool is_small(const Part& part, double size) noexcept {
    return (part.corner[1] - part.corner[0]).cwiseAbs().maxCoeff() <= size &&
           (part.corner[2] - part.corner[0]).cwiseAbs().maxCoeff() <= size;
  }
  static bool is_outside(const Part& part) noexcept {
    const auto [a, b, c] = part.corner;
    return std::max({a.x(), b.x(), c.x()}) < 0.0 || std::max({a.y(), b.y(), c.y()}) < 0.0 ||
           std::min({a.sum(), b.sum(), c.sum()}) > 1.0;
  }
  static Vec2 within_face(const Vec2& at) noexcept {
    Vec2 inside = at.cwiseMax(0.0);
    if (inside.sum() > 1.0) inside /= inside.sum();
    return inside;
  }
  /// Whether the nearest point so far, a local minimum, lies in the part or beside it by no more than half its size.
  [[nodiscard]] bool holds_found(std::uint32_t face, const Part& part) const noexcept {
    if (!rests_ || !found() || place_.frame.face != face) return false;
    const Vec2 middle = (part.corner[0] + part.corner[1] + part.corner[2]) / 3.0;
    const Vec2 off = Vec2(place_.u, place_.v) - middle;
    const Vec2 size = (part.corner[1] - part.corner[0]).cwiseAbs() + (part.corner[2] - part.corner[0]).cwiseAbs();
    return std::abs(off.x()) <= size.x() && std::abs(off.y()) <= size.y();
  }

  /// Sets the part's key, which no point of its relief is nearer than.
  void measure(const ReliefFrame& frame, Part& part) noexcept {
    const FacePart triangle = FacePart::triangle(part.corner[0], part.corner[1], part.corner[2]);
    count_.bounds += surface_.bounds_of(frame, triangle);
    const ReliefBound bound = surface_.bound(frame, triangle);
    const double square =
        closest_point_on_triangle(p_, bound.corner[0], bound.corner[1], bound.corner[2]).squared_distance;
    part.key = std::sqrt(std::max(0.0, square)) - bound.error;
    const Vec3 middle = (bound.corner[0] + bound.corner[1] + bound.corner[2]) / 3.0;
    part.radius = 0.0;
    for (const Vec3& corner : bound.corner) part.radius = std::max(part.radius, (corner - middle).norm());
    part.radius += bound.error;
  }

  const ReliefSurface& surface_;
  Vec3 p_;
  CoatMoment moment_;
  double distance_;
  ReliefPlace place_;
  ReliefPoint spot_;
  bool rests_ = false;  ///< at a local minimum
  WorkCount count_;
};

}  // namespace

Foot ReliefView::nearest(const Vec3& p, double bound, const Place& start) const noexcept {
  const MeshSurface& base = surface_->base();
  ReliefNearestSearch search(*surface_, p, bound, moment_);
  if (start.element < base.mesh().triangles().size())
    search.descend_from({frame(start.element), start.at[1], start.at[2]});
  if (!search.found() && bound == infinity) {
    const Foot under = base.index().closest(p, infinity, cache_->patch);
    if (!under.found()) return {};
    search.descend_from({surface_->frame(under.element, moment_), under.at[1], under.at[2]});
  }
  if (search.distance() == infinity) return {};
  base.index().for_each_near(p, search.distance(), surface_->boxes(), [&](std::uint32_t face) {
    search.visit(face);
    return search.distance();
  });
  tell(cache_->work, search.count());
  if (!search.found()) return {};
  cache_->relief = {search.place(), search.spot(), true};
  if (cache_->blocks != nullptr) keep(search.place(), search.spot());
  return foot_at(search.place(), search.spot(), p);
}

}  // namespace asperity
