// Where a motion first meets a displaced surface, and which of its points is nearest: both by splitting triangles.

#include <algorithm>
#include <cmath>

#include "asperity/surface/relief/view.h"

namespace asperity {

namespace {

// Triangles are split until they are this small against a texel: the surface over one is then nearly a plane.
constexpr double leaf_of_texel = 0.5;
constexpr int deepest = 18;
constexpr int stack_capacity = 4 * deepest + 8;

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

/// How often a triangle has to be split to be as small as a leaf.
int leaf_level(const ReliefFrame& frame) noexcept {
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
  while (level < deepest && texels > leaf_of_texel) {
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

/// Cuts [from, to] down to where start + t rate lies within [low, high].
bool cut(double start, double rate, double low, double high, double& from, double& to) noexcept {
  if (rate == 0.0) return start >= low && start <= high;
  double enter = (low - start) / rate;
  double leave = (high - start) / rate;
  if (enter > leave) std::swap(enter, leave);
  from = std::max(from, enter);
  to = std::min(to, leave);
  return from <= to;
}

/// A hit on one triangle.
struct PatchHit {
  double t = infinity;
  double u = 0.0;
  double v = 0.0;
};

/// Searches one triangle for the first place where a segment meets its relief.
class PatchRay {
 public:
  PatchRay(const ReliefSurface& surface, const ReliefFrame& frame, const Segment& segment, Sides sides) noexcept
      : surface_(surface),
        frame_(frame),
        plane_(frame.prism),
        start_(plane_.turned(segment.from - frame.prism.corner)),
        rate_(plane_.turned(segment.to - segment.from)),
        segment_(segment),
        way_(segment.to - segment.from),
        sides_(sides),
        leaf_(leaf_level(frame)) {
    corner_[0] = plane_.turned(frame.prism.direction);
    turn_u_ = plane_.turned(frame.prism.turn_u);
    turn_v_ = plane_.turned(frame.prism.turn_v);
  }

  PatchHit first(double limit) noexcept {
    PatchHit best;
    best.t = limit;
    Part stack[stack_capacity];
    int top = 0;
    stack[top] = whole();
    double from = 0.0;
    double to = limit;
    if (!meets(stack[top], from, to)) return {};
    stack[top++].key = from;
    bool found = false;
    while (top > 0) {
      const Part part = stack[--top];
      if (part.key > best.t) continue;
      if (part.level >= leaf_) {
        found = solve(part, best) || found;
        continue;
      }
      Part parts[4];
      split(part, parts);
      const int below = top;
      for (Part& child : parts) {
        from = 0.0;
        to = best.t;
        if (!meets(child, from, to)) continue;
        child.key = from;
        int slot = top++;
        for (; slot > below && stack[slot - 1].key < child.key; --slot) stack[slot] = stack[slot - 1];
        stack[slot] = child;
      }
    }
    if (!found) best = {};
    return best;
  }

 private:
  /// Whether the segment meets the hull of the relief over a part; cuts [from, to] down to where.
  bool meets(const Part& part, double& from, double& to) const noexcept {
    const HeightRange range = surface_.range(frame_, part.corner);
    // u, v, 1 - u - v and the height over the plane, at six points: exact bounds of their hull.
    double low[4] = {infinity, infinity, infinity, infinity};
    double high[4] = {-infinity, -infinity, -infinity, -infinity};
    for (const Vec2& corner : part.corner) {
      const Vec3 direction = corner_[0] + corner.x() * turn_u_ + corner.y() * turn_v_;
      for (const double height : {range.lowest, range.highest}) {
        const double u = corner.x() + height * direction.x();
        const double v = corner.y() + height * direction.y();
        const double values[4] = {u, v, 1.0 - u - v, height * direction.z()};
        for (int k = 0; k < 4; ++k) {
          low[k] = std::min(low[k], values[k]);
          high[k] = std::max(high[k], values[k]);
        }
      }
    }
    // Room for the rounding of all this: far below a skin.
    const double room_plane = 1e-12 * (1.0 + std::abs(start_.x()) + std::abs(start_.y()));
    const double room_height = 1e-3 * surface_.skin() + 1e-14 * std::abs(start_.z());
    return cut(start_.x(), rate_.x(), low[0] - room_plane, high[0] + room_plane, from, to) &&
           cut(start_.y(), rate_.y(), low[1] - room_plane, high[1] + room_plane, from, to) &&
           cut(1.0 - start_.x() - start_.y(), -rate_.x() - rate_.y(), low[2] - room_plane, high[2] + room_plane, from,
               to) &&
           cut(start_.z(), rate_.z(), low[3] - room_height, high[3] + room_height, from, to);
  }

  /// Height of the segment over the relief, in the shell's coordinates (m). False where the shell does not reach.
  bool over(double t, ShellPlace& place, double& value) const noexcept {
    if (!frame_.prism.invert(segment_.from + t * way_, place)) return false;
    value = place.height - surface_.height(frame_, place.u, place.v).height;
    return true;
  }

  /// The motion at a time, in the shell's coordinates.
  struct Moment {
    double t = 0.0;
    ShellPlace place;
    double value = 0.0;    ///< height over the relief (m)
    bool reached = false;  ///< by the shell
  };

  Moment at(double t, const ShellPlace& near) const noexcept {
    Moment moment{t, near, 0.0, false};
    moment.reached = over(t, moment.place, moment.value);
    return moment;
  }

  /// Looks for a change of sign of the height over the relief between samples within a leaf, and closes in on it.
  bool solve(const Part& part, PatchHit& best) const noexcept {
    constexpr int samples = 3;
    double from = 0.0;
    double to = std::min(1.0, best.t);
    if (!meets(part, from, to)) return false;
    const Vec2 middle = (part.corner[0] + part.corner[1] + part.corner[2]) / 3.0;
    const ShellPlace guess{middle.x(), middle.y(), 0.0};
    Moment before = at(from, guess);
    // A motion that starts on the surface starts outside it, whatever rounding says.
    if (from == 0.0 && before.value < 0.0 && before.value >= -surface_.skin()) before.value = 0.0;
    for (int i = 1; i <= samples; ++i) {
      const double t = i == samples ? to : from + (to - from) * i / samples;
      const Moment after = at(t, before.reached ? before.place : guess);
      Moment first = before;
      Moment last = after;
      if (keep_over_face(first, last)) {
        const bool enters = first.value >= 0.0 && last.value < 0.0;
        const bool leaves = first.value < 0.0 && last.value >= 0.0;
        if ((enters || (leaves && sides_ == Sides::both)) && close_in(first, last, best)) return true;
      }
      before = after;
    }
    return false;
  }

  /// How far inside a side of the triangle a place is (barycentric).
  static double inside(const ShellPlace& place, int side) noexcept {
    return side == 0 ? place.u : side == 1 ? place.v : 1.0 - place.u - place.v;
  }

  /// Moves the two ends together to where the motion is over this face, which is where its relief counts: what its
  /// formula goes on to beyond an edge may rise over the motion once more. Faces overlap by a hair, so that nothing
  /// slips in between. False when it is nowhere over the face between them.
  bool keep_over_face(Moment& first, Moment& last) const noexcept {
    constexpr double overlap = 1e-9;
    if (!first.reached && !last.reached) return false;
    if (!last.reached && !retreat(first, last)) return false;
    if (!first.reached && !retreat(last, first)) return false;
    for (int side = 0; side < 3; ++side) {
      const double at_first = inside(first.place, side) + overlap;
      const double at_last = inside(last.place, side) + overlap;
      if (at_first < 0.0 && at_last < 0.0) return false;
      if (at_last < 0.0) {
        last = at_side(first, last, side, overlap);
      } else if (at_first < 0.0) {
        first = at_side(last, first, side, overlap);
        // Beside this face it came in over the neighbour if at all, where the same height had the same sign but for
        // rounding.
        if (first.value < 0.0 && first.value >= -1e-4 * surface_.skin()) first.value = 0.0;
      }
    }
    return first.t < last.t;
  }

  /// Puts the far moment, which the shell does not reach, to the last one found that it does.
  bool retreat(const Moment& near, Moment& far) const noexcept {
    double beyond = far.t;
    far = near;
    for (int i = 0; i < 16; ++i) {
      const Moment middle = at(0.5 * (far.t + beyond), far.place);
      if (middle.reached)
        far = middle;
      else
        beyond = middle.t;
    }
    return far.t != near.t;
  }

  /// The moment between one over the face and one beyond a side of it in which the motion is on that side: by false
  /// position, in the half of the overlap that is next to the face.
  Moment at_side(Moment within, Moment beyond, int side, double overlap) const noexcept {
    double weight_within = inside(within.place, side) + 0.5 * overlap;
    double weight_beyond = inside(beyond.place, side) + 0.5 * overlap;
    if (weight_within <= 0.0) return within;
    for (int i = 0; i < 60; ++i) {
      double t = within.t + (beyond.t - within.t) * weight_within / (weight_within - weight_beyond);
      if (i % 4 == 3) t = 0.5 * (within.t + beyond.t);
      if (t == within.t || t == beyond.t) break;
      const Moment there = at(t, within.place);
      if (!there.reached) break;
      const double weight = inside(there.place, side) + 0.5 * overlap;
      if (std::abs(weight) <= 0.5 * overlap) return there;
      if (weight > 0.0) {
        within = there;
        weight_within = weight;
        weight_beyond *= 0.5;
      } else {
        beyond = there;
        weight_beyond = weight;
        weight_within *= 0.5;
      }
    }
    return within;
  }

  /// The root between two values of different sign: false position, halving where that is slow. The answer is on the
  /// first value's side of it.
  bool close_in(const Moment& first, const Moment& last, PatchHit& best) const noexcept {
    const double enough = 1e-4 * surface_.skin() / way_.norm();
    double from = first.t;
    double to = last.t;
    ShellPlace answer = first.place;
    double weight_from = first.value;
    double weight_to = last.value;
    for (int i = 0; i < 80 && to - from > enough; ++i) {
      double t = from + (to - from) * weight_from / (weight_from - weight_to);
      if (i % 3 == 2 || !(t > from && t < to)) t = 0.5 * (from + to);
      if (t <= from || t >= to) break;
      const Moment there = at(t, answer);
      if (!there.reached) return false;
      if ((there.value >= 0.0) == (first.value >= 0.0)) {
        from = t;
        weight_from = there.value;
        answer = there.place;
        weight_to *= 0.5;
      } else {
        to = t;
        weight_to = there.value;
        weight_from *= 0.5;
      }
    }
    if (from > best.t) return false;
    best = {from, answer.u, answer.v};
    return true;
  }

  const ReliefSurface& surface_;
  const ReliefFrame& frame_;
  PlaneFrame plane_;
  Vec3 start_;
  Vec3 rate_;
  Vec3 corner_[1];
  Vec3 turn_u_;
  Vec3 turn_v_;
  Segment segment_;
  Vec3 way_;
  Sides sides_;
  int leaf_;
};

/// Searches triangles for the point of their relief that is nearest to a point.
class ReliefNearestSearch {
 public:
  ReliefNearestSearch(const ReliefSurface& surface, const Vec3& p, double bound, const CoatMoment& moment) noexcept
      : surface_(surface), p_(p), moment_(moment), distance_(bound) {}

  [[nodiscard]] double distance() const noexcept { return distance_; }
  [[nodiscard]] bool found() const noexcept { return place_.frame.face != no_index; }
  [[nodiscard]] const ReliefPlace& place() const noexcept { return place_; }
  [[nodiscard]] const ReliefPoint& spot() const noexcept { return spot_; }

  /// Starts a descent from a place, and keeps where it ends if that is nearer than all before.
  void descend_from(const ReliefPlace& place) noexcept {
    ReliefPlace at = place;
    ReliefPoint spot = surface_.point(at.frame, at.u, at.v);
    descend(surface_, at, spot, 1.0, {.point = p_, .may_leave = false});
    const double now = (spot.point - p_).norm();
    if (now > distance_ || (now == distance_ && found())) return;
    distance_ = now;
    place_ = at;
    spot_ = spot;
  }

  void visit(std::uint32_t face) noexcept {
    ReliefPlace here;
    here.frame = surface_.frame(face, moment_);
    const int leaf = leaf_level(here.frame);
    Part stack[stack_capacity];
    int top = 0;
    stack[0] = whole();
    measure(here.frame, stack[0]);
    top = stack[0].key < distance_ ? 1 : 0;
    while (top > 0) {
      const Part part = stack[--top];
      if (part.key >= distance_) continue;
      if (part.level >= leaf) {
        const Vec2 middle = (part.corner[0] + part.corner[1] + part.corner[2]) / 3.0;
        here.u = middle.x();
        here.v = middle.y();
        const double now = (surface_.point(here.frame, here.u, here.v).point - p_).norm();
        // Before anything is found every leaf that may reach into the bound is tried; after that, a leaf this small
        // whose middle is no nearer lies on the way of a descent that was made already.
        const double slack = found() ? std::min(0.5, part.radius / std::max(distance_, part.radius)) : 2.0;
        if (now < distance_ + slack * part.radius) descend_from(here);
        continue;
      }
      Part parts[4];
      split(part, parts);
      const int below = top;
      for (Part& child : parts) {
        measure(here.frame, child);
        if (child.key >= distance_) continue;
        int slot = top++;
        for (; slot > below && stack[slot - 1].key < child.key; --slot) stack[slot] = stack[slot - 1];
        stack[slot] = child;
      }
    }
  }

 private:
  /// Sets the part's key, which no point of its relief is nearer than: by the ball around its hull and by its slab.
  void measure(const ReliefFrame& frame, Part& part) const noexcept {
    const HeightRange range = surface_.range(frame, part.corner);
    Vec3 points[6];
    Vec3 centre = Vec3::Zero();
    for (int k = 0; k < 3; ++k) {
      const Vec3 base = frame.prism.base_at(part.corner[k].x(), part.corner[k].y());
      const Vec3 direction = frame.prism.direction_at(part.corner[k].x(), part.corner[k].y());
      points[2 * k] = base + range.lowest * direction;
      points[2 * k + 1] = base + range.highest * direction;
      centre += points[2 * k] + points[2 * k + 1];
    }
    centre /= 6.0;
    const Vec3 normal = frame.prism.edge_u.cross(frame.prism.edge_v).normalized();
    double radius = 0.0;
    double low = infinity;
    double high = -infinity;
    for (const Vec3& point : points) {
      radius = std::max(radius, (point - centre).squaredNorm());
      low = std::min(low, normal.dot(point));
      high = std::max(high, normal.dot(point));
    }
    const double level = normal.dot(p_);
    const double slab = std::max({0.0, low - level, level - high});
    part.radius = std::sqrt(radius);
    // Across the slab and along it are at right angles: far tighter than the ball alone where p is far.
    const Vec3 offset = p_ - centre;
    const double along = (offset - normal.dot(offset) * normal).norm() - part.radius;
    part.key = along > 0.0 ? std::sqrt(slab * slab + along * along) : slab;
    part.key = std::max(part.key, offset.norm() - part.radius);
  }

  const ReliefSurface& surface_;
  Vec3 p_;
  CoatMoment moment_;
  double distance_;
  ReliefPlace place_;
  ReliefPoint spot_;
};

Foot foot_at(const ReliefPlace& place, const ReliefPoint& spot, const Vec3& p) noexcept {
  Foot foot;
  foot.point = spot.point;
  foot.distance = (p - spot.point).norm();
  foot.element = place.frame.face;
  foot.at = {1.0 - place.u - place.v, place.u, place.v};
  foot.normal = spot.front;
  if (foot.normal.dot(p - spot.point) < 0.0) foot.normal = -foot.normal;
  return foot;
}

}  // namespace

template <class Skip>
SweptHit ReliefView::first_met(const Segment& motion, Sides sides, const Skip& skip) const noexcept {
  SweptHit best;
  const Vec3 way = motion.to - motion.from;
  if (!(way.squaredNorm() > 0.0)) return best;
  ReliefPlace place;
  // Nearly all motions are far shorter than a face: the neighbourhood decides.
  surface_->base().index().for_each_along(motion, surface_->reach(), [&](std::uint32_t face) {
    if (skip(face)) return best.t;
    const ReliefFrame here = surface_->frame(face, moment_);
    const PatchHit hit = PatchRay(*surface_, here, motion, sides).first(best.t);
    if (hit.t < best.t || (!best.hit && hit.t <= 1.0)) {
      best.hit = true;
      best.t = hit.t;
      place = {here, std::clamp(hit.u, 0.0, 1.0), std::clamp(hit.v, 0.0, 1.0)};
      if (place.u + place.v > 1.0) place.v = 1.0 - place.u;
    }
    return best.t;
  });
  if (!best.hit) return best;
  const ReliefPoint spot = surface_->point(place.frame, place.u, place.v);
  best.contact = foot_at(place, spot, motion.from);
  best.side = spot.front.dot(way) > 0.0 ? -1.0 : 1.0;
  best.contact.normal = best.side * spot.front;
  best.contact.distance = 0.0;
  cache_->relief = {place, spot, true};
  return best;
}

SweptHit ReliefView::first_touch(const Segment& motion, Sides sides) const noexcept {
  return first_met(motion, sides, [](std::uint32_t) { return false; });
}

SweptHit ReliefView::between(const Place& from, const ReliefPoint& start, const Place& to, const ReliefPoint& end,
                             Sides sides) const noexcept {
  if (!surface_->overlapped(from.element) && !surface_->overlapped(to.element)) return {};
  const Segment moved{start.point + from.side() * skin() * start.front, end.point + skin() * (to.side() * end.front)};
  const auto triangles = surface_->base().mesh().triangles();
  return first_met(moved, sides, [&](std::uint32_t face) {
    return share_vertex(triangles[face], triangles[from.element]) ||
           share_vertex(triangles[face], triangles[to.element]);
  });
}

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
  Box around;
  around.include(p);
  base.index().for_each_in_box(around.grown(search.distance() + surface_->reach()),
                               [&](std::uint32_t face) { search.visit(face); });
  if (!search.found()) return {};
  cache_->relief = {search.place(), search.spot(), true};
  return foot_at(search.place(), search.spot(), p);
}

}  // namespace asperity
