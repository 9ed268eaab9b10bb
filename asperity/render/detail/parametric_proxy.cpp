#include "asperity/render/detail/parametric_proxy.h"

#include "asperity/surface/parametric_descent.h"

namespace asperity {

namespace {

// One tick may leave the surface and meet it again this often: over a field of ridges.
constexpr int most_parametric_flights = 16;

class ParametricProxy {
 public:
  ParametricProxy(const ParametricSurface& surface, Sides sides, const Friction& friction, const Vec3& probe,
                  ContactState& state, ParametricJet& at_rest) noexcept
      : surface_(surface), sides_(sides), friction_(friction), probe_(probe), state_(state), jet_(at_rest) {}

  ProxyRest run(const Vec3& from) noexcept {
    const bool held = state_.touching && state_.hint.parametric.owner == surface_.identity();
    if (held) {
      jet_ = surface_.jet(state_.hint.parametric.uv);
    } else if (!fly(from)) {
      return free();
    }
    for (int flight = 0; flight < most_parametric_flights; ++flight) {
      const DescentEnd end = settle();
      if (end != DescentEnd::left && end != DescentEnd::rim) return resting(end != DescentEnd::limited);
      const Vec3 start = state_.iso.point + surface_.skin() * state_.iso.normal;
      // In a valley narrower than the skin there is no place to fly from: it stays.
      if (surface_.has_folds() && !on_its_side(start)) return resting(true);
      if (!fly(start)) return free();
    }
    return resting(false);
  }

 private:
  /// Straight to the probe through free space. False when nothing is in the way.
  bool fly(const Vec3& from) noexcept {
    state_.touching = false;
    state_.sliding = false;
    const SweptHit hit = surface_.segment({from, probe_}, 0.0, sides_, state_.hint);
    if (!hit.hit) return false;
    jet_ = surface_.jet(state_.hint.parametric.uv);
    const Vec3 front = surface_.normal(jet_);
    state_.side = hit.contact.normal.dot(front) >= 0.0 ? 1.0 : -1.0;
    state_.iso.point = jet_.point;
    state_.iso.normal = state_.side * front;
    state_.touching = true;
    return true;
  }

  /// Whether a place just off the surface is on the side touched, and not behind the next flank.
  [[nodiscard]] bool on_its_side(const Vec3& place) const noexcept {
    return state_.side * surface_.clearance(state_.hint.parametric.uv, place) >= 0.0;
  }

  ProxyRest free() noexcept {
    ProxyRest rest;
    rest.proxy = probe_;
    return rest;
  }

  ProxyRest resting(bool converged) noexcept {
    return {true, state_.sliding, converged, state_.iso.point, state_.iso.normal};
  }

  /// Sticks, or slides as far as friction lets it.
  DescentEnd settle() noexcept {
    if (friction_.still <= 0.0) return slide(0.0);
    const Vec3 from = state_.iso.point;
    const Vec3 normal = state_.iso.normal;
    if ((probe_ - from).dot(normal) > 0.0) return DescentEnd::left;
    const double coefficient = state_.sliding ? friction_.sliding : friction_.still;
    if (friction_goal(from, normal, probe_, coefficient) == from) {
      state_.sliding = false;
      return DescentEnd::rest;
    }
    state_.sliding = true;
    const Vec2 uv = state_.hint.parametric.uv;
    const ParametricJet jet = jet_;
    const DescentEnd end = slide(friction_.sliding);
    if ((state_.iso.point - probe_).squaredNorm() <= (from - probe_).squaredNorm()) return end;
    // Nearer to where friction would have it, but farther from the probe: on a bent surface the spring would gain.
    state_.hint.parametric.uv = uv;
    state_.iso.point = from;
    state_.iso.normal = normal;
    jet_ = jet;
    return DescentEnd::rest;
  }

  DescentEnd slide(double friction) noexcept {
    ParametricDescent descent;
    descent.uv = state_.hint.parametric.uv;
    descent.jet = jet_;
    descent.goal = probe_;
    descent.side = state_.side;
    descent.friction = friction;
    const DescentEnd end = descend(surface_, descent);
    state_.hint.parametric.uv = descent.uv;
    jet_ = descent.jet;
    state_.iso.point = descent.jet.point;
    state_.iso.normal = state_.side * descent.normal;
    return end;
  }

  const ParametricSurface& surface_;
  Sides sides_;
  Friction friction_;
  Vec3 probe_;
  ContactState& state_;
  ParametricJet& jet_;  ///< at the state's place
};

}  // namespace

ProxyRest solve_on_parametric(const ParametricSurface& surface, Sides sides, const Friction& friction, const Vec3& from,
                              const Vec3& probe, ContactState& state, ParametricJet& at_rest) noexcept {
  return ParametricProxy(surface, sides, friction, probe, state, at_rest).run(from);
}

}  // namespace asperity
