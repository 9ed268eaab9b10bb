#include "asperity/surface/custom/view.h"

#include <algorithm>
#include <cmath>

#include "asperity/geometry/clip.h"
#include "asperity/surface/walk.h"

namespace asperity {

namespace {

constexpr int most_trace_steps = 512;  // of one motion
constexpr double touch_share = 0.5;    // of a skin: nearer than this is touched

/// The tangent plane of a field's surface as it is walked along.
class FieldChart {
 public:
  using Spot = CustomSpot;

  FieldChart(const CustomView& view, CustomSpot& spot, double side) noexcept
      : view_(view), surface_(view.surface()), spot_(spot), side_(side) {
    face();
  }

  [[nodiscard]] const CustomSpot& spot() const noexcept { return spot_; }

  /// The bend of the surface by differences of the gradient, where a step is worth making at all.
  [[nodiscard]] WalkForms forms(const Vec3& goal) noexcept {
    const Vec3 rest = spot_.point - goal;
    const double off = spot_.front.dot(rest);
    WalkForms f;
    f.g_u = along_u_.dot(rest);
    f.g_v = along_v_.dot(rest);
    f.uu = f.vv = f.h_uu = f.h_vv = 1.0;
    uu_ = uv_ = vv_ = 0.0;
    const double slope = spot_.gradient.norm();
    if (std::hypot(f.g_u, f.g_v) <= rest_length(true) || !(slope > 0.0)) return f;
    const double step = 1e-3 * surface_.grain();
    const Vec3 by_u = view_.eval(spot_.point + step * along_u_).gradient - spot_.gradient;
    const Vec3 by_v = view_.eval(spot_.point + step * along_v_).gradient - spot_.gradient;
    const double per = 1.0 / (step * slope);
    // Across an edge the differences are no bend: the steps go without.
    const double most = 2.0 / surface_.grain();
    if (!(std::max(by_u.norm(), by_v.norm()) * per < most)) return f;
    uu_ = per * by_u.dot(along_u_);
    uv_ = 0.5 * per * (by_u.dot(along_v_) + by_v.dot(along_u_));
    vv_ = per * by_v.dot(along_v_);
    f.h_uu -= off * uu_;
    f.h_uv = -off * uv_;
    f.h_vv -= off * vv_;
    return f;
  }
  [[nodiscard]] double rest_length(bool) const noexcept { return surface_.settled(); }
  [[nodiscard]] double stride() const noexcept { return 0.5 * surface_.grain(); }
  [[nodiscard]] bool has_flanks() const noexcept { return surface_.has_folds(); }
  [[nodiscard]] Vec3 direction(const WalkStep& step) const noexcept { return step.u * along_u_ + step.v * along_v_; }
  [[nodiscard]] WalkStep towards(const Vec3& way) const noexcept { return {along_u_.dot(way), along_v_.dot(way)}; }

  /// The surface ends with its box.
  [[nodiscard]] bool blocked(const WalkStep& step) const noexcept {
    int border = -1;
    return reach(step, border) * step.length <= rest_length(false) && border >= 0;
  }
  static Turn turn(WalkStep&, const Vec3&, bool may_leave, int&) noexcept { return may_leave ? Turn::rim : Turn::rest; }
  [[nodiscard]] double reach(const WalkStep& step, int& border) const noexcept {
    const Vec3 way = direction(step);
    const Vec3 bend = -drop(uu_, uv_, vv_, step.u, step.v) * spot_.front;
    // Half of what a place may be off the box and still be held.
    const Box box = surface_.facts().bounds.grown(0.5 * surface_.skin());
    double far = 1.0;
    for (int k = 0; k < 3; ++k) {
      // A tangent leads out of the box wherever the surface touches that, and the surface only where it does not bend
      // back: the first share at which way and bend together go as far as there is room.
      for (const double side : {-1.0, 1.0}) {
        const double room = std::max(0.0, side > 0.0 ? box.upper[k] - spot_.point[k] : spot_.point[k] - box.lower[k]);
        const double along = side * way[k];
        const double square = along * along + 4.0 * side * bend[k] * room;
        const double rate = square > 0.0 ? along + std::sqrt(square) : 0.0;
        if (!(rate > 0.0) || 2.0 * room >= far * rate) continue;
        far = 2.0 * room / rate;
        border = k;
      }
    }
    return far;
  }

  struct Start {
    Vec3 point, along_u, along_v, front;
    double uu, uv, vv;
  };
  [[nodiscard]] Start start() const noexcept { return {spot_.point, along_u_, along_v_, spot_.front, uu_, uv_, vv_}; }
  [[nodiscard]] static Vec3 moved(const Start& from, const WalkStep& step, double share, int) noexcept {
    const double u = share * step.u;
    const double v = share * step.v;
    return from.point + u * from.along_u + v * from.along_v - drop(from.uu, from.uv, from.vv, u, v) * from.front;
  }
  bool evaluate(Vec3 to, CustomSpot& spot) const noexcept {
    if (!view_.land(to) || !surface_.holds(to)) return false;
    spot = view_.on_side(to, side_);
    return free_way(spot);
  }
  void take(const Vec3&, const CustomSpot& spot) noexcept {
    spot_ = spot;
    face();
  }

 private:
  /// How far the surface falls off its tangent plane.
  [[nodiscard]] static double drop(double uu, double uv, double vv, double u, double v) noexcept {
    return 0.5 * (uu * u * u + 2.0 * uv * u * v + vv * v * v);
  }
  void face() noexcept {
    along_u_ = spot_.front.unitOrthogonal();
    along_v_ = spot_.front.cross(along_u_);
  }

  /// Whether a point could get there just off the surface, over a place a little above the middle: by the bound on the
  /// gradient's change where there is one, or by flying there.
  [[nodiscard]] bool free_way(const CustomSpot& to) const noexcept {
    constexpr double lift = 0.25;
    const Vec3 way = to.point - spot_.point;
    const Vec3 apex = 0.5 * (spot_.point + to.point) + lift * way.norm() * (side_ * spot_.front);
    const double bend = surface_.facts().bend;
    const auto rises = [&](const CustomSpot& from) {
      const Vec3 up = apex - from.point;
      return side_ * from.gradient.dot(up) > 0.5 * bend * up.squaredNorm();
    };
    if (!surface_.has_folds()) return rises(spot_) && rises(to);
    const double skin = surface_.skin();
    const auto flies = [&](const CustomSpot& from) {
      return !view_.first_touch({from.point + skin * (side_ * from.front), apex}, Sides::both).hit;
    };
    return side_ * view_.eval(apex).value > 0.0 && flies(spot_) && flies(to);
  }

  const CustomView& view_;
  const CustomSurface& surface_;
  CustomSpot& spot_;
  double side_;
  Vec3 along_u_;
  Vec3 along_v_;
  double uu_ = 0.0;  ///< how the front normal changes along the tangents (1/m)
  double uv_ = 0.0;
  double vv_ = 0.0;
};

}  // namespace

CustomSpot CustomView::spot(const Vec3& p) const noexcept {
  const FieldSample here = eval(p);
  const double length = here.gradient.norm();
  CustomSpot spot{p, Vec3::Zero(), here.gradient, here.element};
  if (length > 0.0 && std::isfinite(length)) spot.front = here.gradient / length;
  return spot;
}

CustomSpot CustomView::on_side(const Vec3& landed, double side) const noexcept {
  CustomSpot there = spot(landed);
  there.point += (side * surface_->settled()) * there.front;
  return there;
}

DescentEnd CustomView::descend(Place& place, CustomSpot& spot, const Goal& goal) const noexcept {
  FieldChart chart(*this, spot, place.side());
  const DescentEnd end = Walk<FieldChart>(chart, goal, place.side()).run();
  place.at = spot.point;
  place.element = spot.element;
  return end;
}

Foot CustomView::foot_at(const Vec3& p, const CustomSpot& spot) const noexcept {
  Foot foot;
  foot.point = foot.at = spot.point;
  foot.element = spot.element;
  const Vec3 offset = p - spot.point;
  foot.distance = offset.norm();
  if (foot.distance > skin()) {
    foot.normal = offset / foot.distance;
  } else {
    foot.normal = eval(p).value < 0.0 ? Vec3(-spot.front) : spot.front;
  }
  return foot;
}

Foot CustomView::nearest(const Vec3& p, double bound, const Place& start) const noexcept {
  Foot best;
  if (surface_->queries().nearest != nullptr) {
    tell(work_, {1, 0, 0});
    best = surface_->queries().nearest(surface_->field(), p, bound);
    best.at = best.point;
    return best;
  }
  const double value = eval(p).value;
  // The value cannot change faster: nothing is nearer.
  const double least = std::abs(value) / surface_->facts().lipschitz;
  if (!(least <= bound)) return best;
  const auto look_from = [&](Vec3 q) {
    if (!land(q)) return;
    CustomSpot there = spot(q);
    Place place{0, there.front.dot(p - q) < 0.0, q};
    descend(place, there, {.point = p, .may_leave = false});
    const double distance = (p - there.point).norm();
    // Landing is no more exact than that: where all places are nearly as far, the first one found counts.
    const double nearer = best.found() ? best.distance - 2.0 * surface_->settled() : infinity;
    if (!surface_->holds(there.point) || !(distance <= bound) || !(distance < nearer)) return;
    best = foot_at(p, there);
  };
  look_from(p);
  if (start.known()) look_from(start.at);
  const double reach = best.found() ? std::max(least, best.distance) : least;
  // Closer to the surface than it bends there is one nearest place.
  if (reach <= 0.1 * grain()) return best;
  constexpr double corners[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  constexpr double length = 0.5773502691896258;
  for (const auto& corner : corners) look_from(p + 0.7 * length * reach * Vec3(corner[0], corner[1], corner[2]));
  return best;
}

SweptHit CustomView::first_touch(const Segment& motion, Sides sides) const noexcept {
  if (surface_->queries().first_touch == nullptr) return trace(motion, sides);
  tell(work_, {1, 0, 0});
  SweptHit hit = surface_->queries().first_touch(surface_->field(), motion, sides);
  if (!hit.hit) return hit;
  hit.contact.at = hit.contact.point;
  if (hit.contact.element == no_index) hit.contact.element = 0;
  hit.side = spot(hit.contact.point).front.dot(hit.contact.normal) < 0.0 ? -1.0 : 1.0;
  return hit;
}

SweptHit CustomView::trace(const Segment& motion, Sides sides) const noexcept {
  const CustomFacts& facts = surface_->facts();
  const double skin = surface_->skin();
  SweptHit hit;
  const Vec3 way = motion.to - motion.from;
  const double length = way.norm();
  if (!(length > 0.0)) return hit;
  const Vec3 direction = way / length;
  double t = 0.0;
  double end = length;
  if (!clip_line(facts.bounds.grown(0.01 * facts.bounds.diagonal()), motion.from, direction, t, end)) return hit;
  const double touched = touch_share * skin * facts.lipschitz;
  FieldSample here = eval(motion.from + t * direction);
  double side = here.value < 0.0 ? -1.0 : 1.0;
  // From within a solid nothing is touched until the way has come out of it.
  bool counts = sides == Sides::both || side > 0.0;
  const auto touch = [&](double distance) {
    const Vec3 place = motion.from + distance * direction;
    Vec3 q = place;
    if (!land(q) || (q - place).norm() > 0.01 * facts.grain) q = place;
    const CustomSpot there = on_side(q, side);
    hit = point_touch(std::min(1.0, distance / length), side, there.point, there.front, there.element, there.point);
    hit.contact.distance = (place - q).norm();
    return hit;
  };
  for (int step = 0; step < most_trace_steps; ++step) {
    const double clear = side * here.value;
    const double rate = side * here.gradient.dot(direction);
    double ahead = touch_share * skin;
    const bool close = clear <= touched;
    if (close) {
      if (counts && rate < 0.0) return touch(t);
    } else {
      ahead = clear / facts.lipschitz;
      if (!surface_->has_folds() && (side > 0.0 || facts.sides == Sides::both))
        ahead = std::max(ahead, (rate + std::sqrt(rate * rate + 2.0 * facts.bend * clear)) / facts.bend);
      if (t + ahead >= end) return hit;
    }
    const double before = t;
    t = std::min(t + ahead, end);
    here = eval(motion.from + t * direction);
    if (side * here.value < 0.0) {
      if (counts) {
        double low = before;
        double high = t;
        while (high - low > touch_share * skin) {
          const double middle = 0.5 * (low + high);
          if (middle <= low || middle >= high) break;
          (side * eval(motion.from + middle * direction).value < 0.0 ? high : low) = middle;
        }
        return touch(low);
      }
      side = -side;
      counts = true;
    }
    if (t >= end) return hit;
  }
  // Along a surface for long: rather stopped early than let through.
  return counts ? touch(t) : hit;
}

}  // namespace asperity
