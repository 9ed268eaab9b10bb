#pragma once
// The proxy law where a point touches one surface: the servo loop's fast path, once for every kind of surface.

#include "asperity/render/contact/coulomb.h"
#include "asperity/render/state.h"

namespace asperity {

/// Where the proxy of a point came to rest.
struct PointRest {
  bool simple = true;  ///< false: more than one plane may hold it, and nothing else here is known
  bool contact = false;
  bool converged = true;
  bool pulls = false;          ///< the probe is outside, and a sticky surface holds on to it
  Vec3 proxy = Vec3::Zero();   ///< m
  Vec3 normal = Vec3::Zero();  ///< unit, on the side touched
};

/// One tick on one surface, object frame: from the place that the state rests on, or from free space, towards the
/// probe; along the surface, off it and on to where it is met again. [servo]
template <SurfaceView View>
class PointProxy {
 public:
  using Spot = typename View::Spot;

  PointProxy(const View& view, Sides sides, const Friction& friction, const Vec3& probe, OfSurface& state) noexcept
      : view_(view), sides_(sides), friction_(friction), probe_(probe), state_(state) {}

  PointRest run(const Vec3& from) noexcept {
    // One tick may leave the surface and meet it again this often: over a field of needles.
    constexpr int most_flights = 16;
    if (state_.rests) {
      place_ = state_.places[0];
      spot_ = view_.at(place_, place_.side() * state_.normal);
    } else if (!fly(from)) {
      return free();
    } else if constexpr (on_triangles) {
      // On an edge it is held by the edge, from wherever it came.
      if (!view_.within_face(place_)) return {.simple = false};
      // As several planes do it: friction holds from where the probe has led it by the end of the tick.
      if (friction_.still > 0.0) slide(0.0);
    }
    for (int flight = 0; flight < most_flights; ++flight) {
      const DescentEnd end = settle();
      if constexpr (on_triangles) {
        const bool near = end == DescentEnd::left && (probe_ - spot_.point).dot(normal()) <= 2.0 * view_.skin();
        const bool between = end == DescentEnd::rest && !view_.within_face(place_);
        if (near || between || end == DescentEnd::limited || end == DescentEnd::blocked) return {.simple = false};
      }
      if (end != DescentEnd::left && end != DescentEnd::rim) return resting(end != DescentEnd::limited);
      if (end == DescentEnd::left && friction_.grip > 0.0 && holds_on()) {
        PointRest rest = resting(true);
        rest.pulls = true;
        return rest;
      }
      Vec3 start;
      // Where there is no place to fly from it stays.
      if (!view_.launch(place_, spot_, start)) return resting(true);
      if (!fly(start)) return free();
    }
    return resting(false);
  }

  /// Where it rests. [servo]
  [[nodiscard]] const Place& place() const noexcept { return place_; }
  [[nodiscard]] const Spot& spot() const noexcept { return spot_; }

 private:
  static constexpr bool on_triangles = requires(const View& v, const Place& p) { v.within_face(p); };

  [[nodiscard]] Vec3 normal() const noexcept { return place_.side() * spot_.front; }

  /// Straight to the probe through free space. False when nothing is in the way.
  bool fly(const Vec3& from) noexcept {
    state_.rests = state_.sliding = false;
    const SweptHit hit = view_.first_touch({from, probe_}, sides_);
    if (!hit.hit || hit.contact.normal.isZero()) return false;
    take(hit);
    state_.rests = true;
    return true;
  }

  void take(const SweptHit& hit) noexcept {
    place_ = {hit.contact.element, hit.side < 0.0, hit.contact.at};
    spot_ = view_.at(place_, hit.side * hit.contact.normal);
  }

  /// Goes to the surface's point nearest to a probe that is drawn off it; false where that is too far to hold.
  bool holds_on() noexcept {
    view_.descend(place_, spot_, {.point = probe_, .may_leave = false});
    state_.sliding = false;
    return (spot_.point - probe_).norm() <= friction_.grip;
  }

  PointRest free() noexcept {
    PointRest rest;
    rest.proxy = probe_;
    return rest;
  }

  PointRest resting(bool converged) noexcept {
    state_.places.clear();
    state_.places.push_back(place_);
    state_.normal = normal();
    return {true, true, converged, false, spot_.point, state_.normal};
  }

  /// Sticks, or slides as far as friction and what lies in the way let it.
  DescentEnd settle() noexcept {
    if constexpr (requires { view_.overlaps(); }) {
      if (view_.overlaps()) return settle_over_folds();
    }
    return settle_on_fold();
  }

  /// From one fold to another that overlaps it in space, and back: along the crease between them each change must come
  /// nearer.
  [[gnu::noinline]] DescentEnd settle_over_folds() noexcept {
    constexpr int most_folds = 16;
    constexpr double least_gain = 1e-9;
    for (int fold = 0; fold < most_folds; ++fold) {
      const Place place = place_;
      const Spot spot = spot_;
      const DescentEnd end = settle_on_fold();
      const SweptHit hit = view_.between(place, spot, place_, spot_, sides_);
      if (!hit.hit) return end;
      // Another fold was in the way: the proxy goes on from there, on that one, if it is nearer there.
      take(hit);
      const double distance = (spot.point - probe_).squaredNorm();
      if (!((spot_.point - probe_).squaredNorm() < distance * (1.0 - least_gain))) {
        place_ = place;
        spot_ = spot;
        return DescentEnd::rest;
      }
    }
    return DescentEnd::limited;
  }

  DescentEnd settle_on_fold() noexcept {
    if (friction_.still <= 0.0) return slide(0.0);
    const Vec3 normal_before = normal();
    if ((probe_ - spot_.point).dot(normal_before) > 0.0) return DescentEnd::left;
    if (holds(friction_, spot_.point, normal_before, probe_, state_.sliding)) return DescentEnd::rest;
    const Place place = place_;
    const Vec3 at = spot_.point;
    const DescentEnd end = slide(friction_.sliding);
    if (no_farther(spot_.point, at, probe_)) return end;
    place_ = place;
    spot_ = view_.at(place_, normal_before);
    return DescentEnd::rest;
  }

  DescentEnd slide(double friction) noexcept {
    return view_.descend(place_, spot_, {.point = probe_, .friction = friction, .sides = sides_});
  }

  const View& view_;
  Sides sides_;
  const Friction& friction_;
  Vec3 probe_;
  OfSurface& state_;
  Place place_;
  Spot spot_;
};

}  // namespace asperity
