#pragma once
// The proxy law where a point touches one surface: the servo loop's fast path, once for every kind of surface.

#include <optional>

#include "asperity/geometry/triangle_contact.h"
#include "asperity/render/contact/coulomb.h"
#include "asperity/render/contact/planes.h"
#include "asperity/render/state.h"

namespace asperity {

/// One tick on one surface, object frame: from the place that the state rests on, or from free space, towards the
/// probe; along the surface, off it and on to where it is met again. [servo]
template <SurfaceView View>
class PointProxy {
 public:
  using Spot = typename View::Spot;

  PointProxy(const View& view, Sides sides, const Friction& friction, const Vec3& probe, OfSurface& state,
             const WorkMeter& work) noexcept
      : view_(view), sides_(sides), friction_(friction), probe_(probe), state_(state), work_(work) {}

  [[gnu::always_inline]] inline PointRest run(const Vec3& from) noexcept {
    // One tick may leave the surface and meet it again this often: over a field of needles.
    constexpr int most_flights = 64;
    if (state_.rests) {
      place_ = state_.places[0];
      spot_ = view_.at(place_, place_.side() * state_.normal);
    } else if (!fly(from)) {
      return free();
    } else if constexpr (on_triangles) {
      // On an edge it is held by the edge, from wherever it came.
      if (!view_.within_face(place_)) return {.simple = false};
      if (friction_.still > 0.0) {
        // What it touches already may hold it, whichever of several faces it goes into first.
        if ((from - spot_.point).dot(normal()) <= touch_in_skins * view_.skin()) return {.simple = false};
        // As several planes do it: friction holds from where the probe has led it by the end of the tick.
        slide(0.0);
      }
    }
    for (int flight = 0; flight < most_flights; ++flight) {
      const DescentEnd end = settle();
      if constexpr (on_triangles) {
        const bool near = end == DescentEnd::left && (probe_ - spot_.point).dot(normal()) <= 2.0 * view_.skin();
        const bool between = end == DescentEnd::rest && !view_.within_face(place_);
        const bool limited = end == DescentEnd::limited && !work_.spent();
        if (between) return {.simple = false, .on_border = friction_.still <= 0.0};
        const bool behind = end == DescentEnd::left && !view_.may_launch(place_, spot_);
        if (near || behind || limited || end == DescentEnd::blocked) return {.simple = false};
      }
      // A walk has a limit of its own.
      if (end == DescentEnd::limited && !work_.spent() && !stays()) continue;
      if (end != DescentEnd::left && end != DescentEnd::rim) return resting(end != DescentEnd::limited);
      if (end == DescentEnd::left && friction_.grip > 0.0 && holds_on()) {
        PointRest rest = resting(true);
        rest.pulls = true;
        return rest;
      }
      // Nothing is between: a flight from a skin off would come back to where the probe is all but on the surface.
      if (end == DescentEnd::left && (probe_ - spot_.point).norm() <= view_.skin()) {
        leave();
        return free();
      }
      Vec3 start;
      // Where there is no place to fly from it stays.
      if (!view_.launch(place_, spot_, start)) return resting(true);
      if (pinched(start)) start = spot_.point;
      if (stays()) return end == DescentEnd::rim ? held_by_rim() : resting(true);
      if (work_.spent()) break;
      if (!fly(start, place_.element)) return free();
    }
    return resting(false);
  }

  /// Where it rests. [servo]
  [[nodiscard]] const Place& place() const noexcept { return place_; }
  [[nodiscard]] const Spot& spot() const noexcept { return spot_; }

 private:
  /// Evaluations that one way along a surface may take.
  static constexpr int most_walk = 1024;
  /// Moves between overlapping folds that one tick may take, over all of its flights.
  static constexpr int most_moves_of_tick = 128;
  static constexpr bool may_overlap = requires(const View& v) { v.overlaps(); };
  static constexpr bool on_triangles = requires(const View& v, const Place& p) { v.within_face(p); };

  [[nodiscard]] Vec3 normal() const noexcept { return place_.side() * spot_.front; }

  void leave() noexcept {
    state_.rests = state_.sliding = false;
    state_.held = {};
    if constexpr (may_overlap) flanks_.clear();
  }

  /// Straight to the probe through free space, from this element if it is known. False when nothing is in the way.
  bool fly(const Vec3& from, std::uint32_t starts_on = no_index) noexcept;
  [[nodiscard]] SweptHit first_touch(const Segment& motion, std::uint32_t starts_on) const noexcept;
  /// Whether it has come no nearer for some time, by flying to and fro or by walking: what it flies from and what it
  /// meets then hold it between them.
  [[nodiscard]] bool stays() noexcept;
  /// Whether another fold lies between where it is and where it would fly from.
  [[nodiscard]] bool pinched(const Vec3& start) const noexcept;
  /// What goes off a rim only to meet the surface again is held by the rim.
  [[nodiscard]] PointRest held_by_rim() noexcept;

  [[nodiscard]] static Place place_of(const SweptHit& hit) noexcept {
    return {hit.contact.element, hit.side < 0.0, hit.contact.at};
  }

  void take(const SweptHit& hit) noexcept {
    place_ = place_of(hit);
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
    if constexpr (may_overlap) {
      // In a crease it is pushed along what draws it; and so it is on its way between folds.
      const bool between = !flanks_.empty() || (!converged && view_.overlaps());
      if (between && spot_.point != probe_) state_.normal = (spot_.point - probe_).normalized();
      for (const Fold& flank : flanks_) state_.places.push_back(flank.place);
    }
    return {true, true, converged, false, spot_.point, state_.normal};
  }

  /// Sticks, or slides as far as friction and what lies in the way let it.
  DescentEnd settle() noexcept {
    if constexpr (may_overlap) {
      if (view_.overlaps()) return still_held() ? DescentEnd::rest : settle_over_folds();
    }
    return settle_on_fold();
  }

  /// A fold that the proxy touches: its place nearest to it.
  struct Fold {
    Place place;
    Spot spot;
    [[nodiscard]] Vec3 normal() const noexcept { return place.side() * spot.front; }
  };
  using Folds = FixedVector<Fold, 3>;

  /// From one fold to another that overlaps it in space; where the probe draws it into both, along the crease between
  /// them. Each move comes nearer.
  [[gnu::noinline]] DescentEnd settle_over_folds() noexcept;

  /// What the last tick left it beside.
  void recall_flanks() noexcept;

  /// Whether the folds that it rests between hold it still: the probe has moved by less than would bring anything
  /// nearer that was looked at before.
  [[nodiscard]] bool still_held() noexcept;
  /// It looked at a place that is no nearer to the probe than where it stands.
  void not_nearer(const Vec3& there, const Vec3& stands) noexcept;
  void hold() noexcept;

  /// How far from a fold it touches it, as walks find that (m).
  [[nodiscard]] double room_beside() const noexcept {
    constexpr double skins = 8.0;
    constexpr double of_grain = 4e-3;
    return skins * view_.skin() + of_grain * view_.grain();
  }
  [[nodiscard]] bool touches(const Fold& flank) const noexcept;

  /// Takes a flank for the fold that it is on.
  void lead_with(std::size_t index) noexcept;
  void lead_by(const Fold& fold) noexcept {
    place_ = fold.place;
    spot_ = fold.spot;
  }

  /// Where the probe leads it along a crease: to the nearest point of the tangent planes, less what friction holds.
  Vec3 along_crease(const PlaneProjection& held) noexcept;

  /// Leads up to three folds to where they all meet near a point, as near to it as they can: Newton's steps on their
  /// tangent planes.
  [[nodiscard]] bool onto(Folds& folds, Vec3 point) noexcept;

  [[nodiscard]] Folds all_folds() const noexcept;

  /// Where all of some folds are, a skin off them.
  [[nodiscard]] Vec3 off(const Folds& folds) const noexcept;

  /// Moves along a crease that are not worth making (m).
  [[nodiscard]] double rest_along_crease() const noexcept {
    constexpr double of_grain = 2e-3;
    return std::max(view_.skin(), of_grain * view_.grain());
  }

  /// What it comes nearer by less in a move waits for the next tick (m).
  [[nodiscard]] double worth_going_on() const noexcept { return 0.1 * rest_along_crease(); }

  /// A flank's place nearest to where it is.
  [[nodiscard]] Goal beside() const noexcept {
    return {.point = spot_.point, .may_leave = false, .work = work_.left()};
  }

  [[nodiscard]] bool nearer(const Spot& spot, const Spot& before) const noexcept {
    constexpr double least_gain = 1e-9;
    return (spot.point - probe_).squaredNorm() < (before.point - probe_).squaredNorm() * (1.0 - least_gain);
  }

  /// What was on the way of a move along a fold.
  enum class Way {
    free,
    on,     ///< another fold: it goes on from there, on that one and beside the one that it was on
    stuck,  ///< another fold, no nearer: it is where it was
  };
  /// Along a crease of what holds it, or a part of the step; `stuck` where that comes no nearer.
  Way go_along(const PlaneProjection& held, const Vec3& step) noexcept;
  /// A place on the crease of some folds so far on, or less far, that is nearer. False where none is found.
  bool search_along(const Folds& from, Vec3 step, Folds& on) noexcept;
  /// At the foot of an edge both of its sides hold it.
  bool learn_kink() noexcept;
  /// Of these it is beside those that it touches.
  void stay_beside(Folds& folds) noexcept;

  /// Along one fold, in legs, so that what is in the way is seen before much has been walked in vain.
  Way go(DescentEnd& end) noexcept;
  /// Along the crease with a flank whose plane, as it is known, would let it pass.
  Way along_flank(std::size_t known) noexcept;
  /// The flank that a way along the fold from a place has left only to meet it a little farther on, or how many there
  /// are.
  [[nodiscard]] std::size_t soon_again(const Fold& met, const Fold& from) const noexcept;
  /// Whether two are one, from whichever side.
  [[nodiscard]] bool is_same(const Fold& one, const Fold& other) const noexcept {
    constexpr double same_direction = 0.999;
    return std::abs(one.normal().dot(other.normal())) >= same_direction &&
           (one.spot.point - other.spot.point).norm() <= room_beside();
  }
  /// The flank that is the same, or how many there are.
  [[nodiscard]] std::size_t same_as(const Fold& met) const noexcept;
  /// Takes it for a flank; false where it is known, or enough has been learned.
  bool learn(const Fold& met) noexcept;

  [[gnu::always_inline]] inline DescentEnd settle_on_fold(int moves = most_walk) noexcept {
    if (friction_.still <= 0.0) return slide(0.0, moves);
    const Vec3 normal_before = normal();
    if ((probe_ - spot_.point).dot(normal_before) > 0.0) return DescentEnd::left;
    if (holds(friction_, spot_.point, normal_before, probe_, state_.sliding)) return DescentEnd::rest;
    const Place place = place_;
    const Vec3 at = spot_.point;
    const DescentEnd end = slide(friction_.sliding, moves);
    if (no_farther(spot_.point, at, probe_)) return end;
    place_ = place;
    spot_ = view_.at(place_, normal_before);
    return DescentEnd::rest;
  }

  DescentEnd slide(double friction, int moves = most_walk) noexcept {
    return view_.descend(
        place_, spot_, {.point = probe_, .friction = friction, .sides = sides_, .moves = moves, .work = work_.left()});
  }

  const View& view_;
  Sides sides_;
  const Friction& friction_;
  Vec3 probe_;
  OfSurface& state_;
  const WorkMeter& work_;
  Place place_;
  Spot spot_;
  FixedVector<Fold, 2> flanks_;    ///< the others
  std::optional<Fold> kink_;       ///< where one of them had turned to over an edge when they were last led to a point
  bool kink_rises_ = false;        ///< over where it had been
  int moves_ = 0;                  ///< between overlapping folds
  int learned_ = 0;                ///< folds found where it stands
  double held_within_ = infinity;  ///< how far the probe may go before one of the places looked at would be nearer (m)
  int in_vain_ = 0;                ///< flights, or walks, that came hardly nearer
  double left_at_ = infinity;      ///< distance from the probe where one of them began last
};

}  // namespace asperity
