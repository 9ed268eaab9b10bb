#include "asperity/render/detail/proxy.h"

#include <algorithm>
#include <cmath>

#include "asperity/render/fine_contact.h"

namespace asperity {

namespace {

// One tick may leave the surface and meet it again this often: over a field of needles.
constexpr int most_relief_flights = 16;
class ReliefProxy {
 public:
  ReliefProxy(const ReliefSurface& surface, Sides sides, const Friction& friction, const Vec3& from, const Vec3& probe,
              ContactState& state) noexcept
      : surface_(surface), sides_(sides), friction_(friction), position_(from), probe_(probe), state_(state) {}

  ProxyRest run() noexcept {
    const bool held = state_.touching && state_.hint.relief.frame.owner == surface_.identity();
    if (!held) {
      state_.touching = false;
      state_.sliding = false;
      if (!fly(position_)) return free();
    } else {
      position_ = state_.point.position;
    }
    for (int flight = 0; flight < most_relief_flights; ++flight) {
      const DescentEnd end = settle();
      if (end != DescentEnd::left && end != DescentEnd::rim) return resting(end != DescentEnd::limited);
      if (end == DescentEnd::left && friction_.grip > 0.0 && holds_on()) {
        ProxyRest rest = resting(true);
        rest.pulls = true;
        return rest;
      }
      if (!fly(state_.point.position + state_.side * surface_.skin() * state_.point.normal())) return free();
    }
    return resting(false);
  }

 private:
  [[nodiscard]] Vec3 normal() const noexcept { return state_.side * state_.point.normal(); }

  /// Straight to the probe through free space. False when nothing is in the way.
  bool fly(const Vec3& from) noexcept {
    state_.touching = false;
    state_.sliding = false;
    const SweptHit hit = surface_.segment({from, probe_}, 0.0, sides_, state_.hint);
    if (!hit.hit) return false;
    const ReliefPlace& place = state_.hint.relief;
    state_.point = surface_.point(place.frame, place.u, place.v);
    state_.side = hit.contact.normal.dot(state_.point.normal()) >= 0.0 ? 1.0 : -1.0;
    state_.touching = true;
    return true;
  }

  /// Goes to the surface's point nearest to a probe that is drawn off it; false where that is too far to hold.
  bool holds_on() noexcept {
    Descent descent;
    descent.place = &state_.hint.relief;
    descent.goal = probe_;
    descent.side = state_.side;
    descent.may_leave = false;
    descent.point = state_.point;
    descend(surface_, descent);
    state_.point = descent.point;
    state_.sliding = false;
    return (state_.point.position - probe_).norm() <= friction_.grip;
  }

  ProxyRest free() noexcept {
    ProxyRest rest;
    rest.proxy = probe_;
    return rest;
  }

  ProxyRest resting(bool converged) noexcept {
    return {true, state_.sliding, converged, state_.point.position, normal()};
  }

  /// Sticks, or slides as far as friction and folds that overlap in space let it.
  DescentEnd settle() noexcept {
    if (surface_.report().overlapping_pairs == 0) return settle_on_fold();
    // From one fold to the other and back: along the crease between them each change must come nearer.
    constexpr int most_folds = 16;
    constexpr double least_gain = 1e-9;
    for (int fold = 0; fold < most_folds; ++fold) {
      const ReliefPlace place = state_.hint.relief;
      const ReliefPoint point = state_.point;
      const double side = state_.side;
      const DescentEnd end = settle_on_fold();
      const std::uint32_t before = place.frame.face;
      const std::uint32_t after = state_.hint.relief.frame.face;
      if (!surface_.overlapped(before) && !surface_.overlapped(after)) return end;
      const double skin = surface_.skin();
      const Segment moved{point.position + side * skin * point.normal(), state_.point.position + skin * normal()};
      Hint other;
      other.moment = state_.hint.moment;
      const SweptHit hit = surface_.segment_elsewhere(moved, sides_, before, after, other);
      if (!hit.hit) return end;
      // Another fold was in the way: the proxy goes on from there, on that one, if it is nearer there.
      const ReliefPoint met = surface_.point(other.relief.frame, other.relief.u, other.relief.v);
      const double distance = (point.position - probe_).squaredNorm();
      if (!((met.position - probe_).squaredNorm() < distance * (1.0 - least_gain))) {
        state_.hint.relief = place;
        state_.point = point;
        state_.side = side;
        return DescentEnd::rest;
      }
      state_.hint.relief = other.relief;
      state_.point = met;
      state_.side = hit.contact.normal.dot(met.normal()) >= 0.0 ? 1.0 : -1.0;
    }
    return DescentEnd::limited;
  }

  DescentEnd settle_on_fold() noexcept {
    if (friction_.still <= 0.0) return slide(0.0);
    const Vec3 from = state_.point.position;
    const Vec3 outward = normal();
    if ((probe_ - from).dot(outward) > 0.0) return DescentEnd::left;
    const double coefficient = state_.sliding ? friction_.sliding : friction_.still;
    if (friction_goal(from, outward, probe_, coefficient) == from) {
      // Within the cone: it holds, and next time it must be torn off again.
      state_.sliding = false;
      return DescentEnd::rest;
    }
    state_.sliding = true;
    const ReliefPlace place = state_.hint.relief;
    const ReliefPoint point = state_.point;
    const DescentEnd end = slide(friction_.sliding);
    if ((state_.point.position - probe_).squaredNorm() <= (from - probe_).squaredNorm()) return end;
    // Nearer to where friction would have it, but farther from the probe: on a bent surface the spring would gain.
    state_.hint.relief = place;
    state_.point = point;
    return DescentEnd::rest;
  }

  DescentEnd slide(double friction) noexcept {
    Descent descent;
    descent.place = &state_.hint.relief;
    descent.goal = probe_;
    descent.side = state_.side;
    descent.friction = friction;
    descent.point = state_.point;
    const DescentEnd end = descend(surface_, descent);
    state_.point = descent.point;
    return end;
  }

  const ReliefSurface& surface_;
  Sides sides_;
  Friction friction_;
  Vec3 position_;
  Vec3 probe_;
  ContactState& state_;
};

}  // namespace

Friction friction_of(const Instance& instance, const Material& material) noexcept {
  const double grip = material.stickiness / material.stiffness;
  if (!proxy_holds_friction(instance)) return {0.0, 0.0, grip};
  return {std::max(material.static_friction, material.dynamic_friction), material.dynamic_friction, grip};
}

ProxyRest solve_on_relief(const ReliefSurface& surface, Sides sides, const Friction& friction, const Vec3& from,
                          const Vec3& probe, ContactState& state) noexcept {
  return ReliefProxy(surface, sides, friction, from, probe, state).run();
}

}  // namespace asperity
