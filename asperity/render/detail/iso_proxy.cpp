#include "asperity/render/detail/iso_proxy.h"

#include <algorithm>
#include <cmath>

#include "asperity/surface/iso_descent.h"
#include "asperity/surface/relief_descent.h"

namespace asperity {

namespace {

// One tick may leave the surface and meet it again this often: over a field of needles.
constexpr int most_iso_flights = 16;

class IsoProxy {
 public:
  IsoProxy(const IsoView& surface, Sides sides, const Friction& friction, const Vec3& probe,
           ContactState& state) noexcept
      : surface_(surface), sides_(sides), friction_(friction), probe_(probe), state_(state) {}

  ProxyRest run(const Vec3& from) noexcept {
    if (!state_.touching && !fly(from)) return free();
    away_ = state_.iso.normal;
    for (int flight = 0; flight < most_iso_flights; ++flight) {
      const IsoEnd end = settle();
      if (end != IsoEnd::left && end != IsoEnd::rim) return resting(end != IsoEnd::limited);
      // At the rim it starts within the volume: what comes in from outside has no side.
      const Box bounds = surface_.field->bounds();
      const Vec3 start = (state_.iso.point + surface_.skin() * away_).cwiseMax(bounds.lower).cwiseMin(bounds.upper);
      // In a corner narrower than the skin there is no place to fly from: it stays.
      if (!on_its_side(start)) return resting(true);
      if (!fly(start)) return free();
    }
    return resting(false);
  }

 private:
  /// Straight to the probe through free space. False when nothing is in the way.
  bool fly(const Vec3& from) noexcept {
    state_.touching = false;
    state_.sliding = false;
    const IsoCrossing met = surface_.first_touch({from, probe_}, sides_, state_.hint.iso);
    if (!met.found || met.outward.isZero()) return false;
    state_.iso.point = met.point;
    state_.side = met.inward ? 1.0 : -1.0;
    state_.iso.normal = state_.side * met.outward;
    state_.touching = true;
    return true;
  }

  /// Whether a place just off the surface is on the side touched, or where nothing is known.
  bool on_its_side(const Vec3& place) noexcept {
    FieldJet jet;
    if (!surface_.sample(place, state_.hint.iso, jet)) return true;
    return state_.side * surface_.sigma * (jet.value - surface_.threshold) >= 0.0;
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
  IsoEnd settle() noexcept {
    if (friction_.still <= 0.0) return slide(0.0);
    const Vec3 from = state_.iso.point;
    const Vec3 normal = state_.iso.normal;
    if ((probe_ - from).dot(normal) > 0.0) return IsoEnd::left;
    const double coefficient = state_.sliding ? friction_.sliding : friction_.still;
    if (friction_goal(from, normal, probe_, coefficient) == from) {
      state_.sliding = false;
      return IsoEnd::rest;
    }
    state_.sliding = true;
    const IsoEnd end = slide(friction_.sliding);
    if ((state_.iso.point - probe_).squaredNorm() <= (from - probe_).squaredNorm()) return end;
    // Nearer to where friction would have it, but farther from the probe: on a bent surface the spring would gain.
    state_.iso.point = from;
    state_.iso.normal = normal;
    return IsoEnd::rest;
  }

  IsoEnd slide(double friction) noexcept {
    IsoDescent descent;
    descent.point = state_.iso.point;
    descent.normal = state_.iso.normal;
    descent.goal = probe_;
    descent.side = state_.side;
    descent.friction = friction;
    const IsoEnd end = descend(surface_, descent, state_.hint.iso);
    state_.iso.point = descent.point;
    state_.iso.normal = descent.normal;
    if (!descent.away.isZero()) away_ = descent.away;
    return end;
  }

  const IsoView& surface_;
  Sides sides_;
  Friction friction_;
  Vec3 probe_;
  ContactState& state_;
  Vec3 away_ = Vec3::Zero();  ///< off all that meets at the point
};

/// Finds the surface again near a point that it was at, or has come over: straight along the gradient, from the side
/// that is touched. False when it is gone.
bool take_up(const IsoView& surface, double side, const Vec3& near, ContactState& slot) noexcept {
  FieldJet jet;
  slot.touching = false;
  if (!surface.sample(near, slot.hint.iso, jet)) return false;
  const double length = jet.gradient.norm();
  if (!(length > 0.0)) return false;
  const Vec3 normal = (side * surface.sigma / length) * jet.gradient;
  // Twice as far as the gradient says, so that its change on the way does not matter.
  const double off = std::abs(jet.value - surface.threshold) / length;
  const double reach = 2.0 * off + 4.0 * surface.skin();
  const Segment inward{near + reach * normal, near - reach * normal};
  const IsoCrossing met = surface.first_crossing(inward, slot.hint.iso);
  if (!met.found || met.outward.isZero() || met.inward != (side > 0.0)) return false;
  slot.touching = true;
  slot.side = side;
  slot.iso.point = met.point;
  slot.iso.normal = side * met.outward;
  return true;
}

}  // namespace

double ball_level(const Instance& instance, const Scene& scene) noexcept {
  const ImplicitSurface* implicit = implicit_of(instance.surface);
  const double radius = scene.probe_radius();
  if (implicit == nullptr || implicit->textured() || radius == 0.0) return 0.0;
  if (!std::holds_alternative<ProxyLaw>(instance.law) || scene.instances().size() != 1) return 0.0;
  // Level sets of the potential turn their front to the outside only.
  if (instance.sides != Sides::front || implicit->offset() + radius > implicit->reach_outside()) return 0.0;
  return radius;
}

std::uint32_t element_at(const Instance& instance, const Vec3& place, ContactState& slot) noexcept {
  const ImplicitSurface* implicit = implicit_of(instance.surface);
  if (implicit != nullptr && implicit->grid().has_faces()) {
    const std::uint32_t face = implicit->grid().face(place, slot.hint.sparse);
    if (face != no_index) return face;
  }
  return iso_of(instance.surface)->element_of(slot.iso.level, place);
}

bool update_felt(const IsoSurface& surface, double further, Sides sides, int level, Seconds dt, const Vec3& free,
                 ContactState& slot) noexcept {
  IsoContact& felt = slot.iso;
  const double target = surface.threshold() + further;
  if (felt.field != surface.field().identity()) {
    felt = {};
    felt.field = surface.field().identity();
    felt.threshold = target;
    felt.level = level;
    slot.touching = false;
    return false;
  }
  if (felt.level == level && felt.threshold == target) return false;
  const Vec3 place = slot.touching ? felt.point : free;
  FieldJet before;
  const IsoView old = felt_view(surface, slot);
  const bool was_known = old.sample(place, slot.hint.iso, before);
  const double old_phi = was_known ? old.sigma * (before.value - old.threshold) : 0.0;
  FieldJet here = before;
  bool known = was_known;
  if (felt.level != level) {
    felt.level = level;
    known = felt_view(surface, slot).sample(place, slot.hint.iso, here);
    // The surface goes on from where it is felt, or as far from the probe as it is, and then finds its place.
    if (known && was_known) felt.threshold += here.value - before.value;
  }
  constexpr double least_slope = 0.05;  // of the typical one: where the field is flat the surface may run ahead
  const double slope = std::max(known ? here.gradient.norm() : 0.0, least_slope * surface.typical_slope());
  const double most = slope * surface.threshold_speed() * std::max(0.0, dt.count());
  felt.threshold = known ? felt.threshold + std::clamp(target - felt.threshold, -most, most) : target;
  const IsoView now = felt_view(surface, slot);
  if (slot.touching) {
    take_up(now, slot.side, place, slot);
    return true;
  }
  const double new_phi = known ? now.sigma * (here.value - now.threshold) : 0.0;
  const bool came_over = was_known && known && (old_phi >= 0.0) != (new_phi >= 0.0);
  if (came_over && (sides == Sides::both || old_phi >= 0.0)) take_up(now, old_phi >= 0.0 ? 1.0 : -1.0, place, slot);
  return true;
}

ProxyRest solve_on_iso(const IsoView& surface, Sides sides, const Friction& friction, const Vec3& from,
                       const Vec3& probe, ContactState& state) noexcept {
  return IsoProxy(surface, sides, friction, probe, state).run(from);
}

}  // namespace asperity
