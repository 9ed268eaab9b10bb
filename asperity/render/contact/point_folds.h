#pragma once
// The proxy law where a point touches a surface that overlaps itself in space: from fold to fold, and along the creases
// between them.

#include "asperity/render/contact/point.h"

namespace asperity {

template <SurfaceView View>
DescentEnd PointProxy<View>::settle_over_folds() noexcept {
  constexpr int most_moves = 64;
  // Along a crease in ever longer moves: where it rests in one, the first is made in vain in every tick.
  constexpr double least_grains = 1.0;
  constexpr double most_grains = 16.0;
  constexpr double growth = 4.0;
  double grains = least_grains;
  recall_flanks();
  for (int move = 0; move < most_moves && moves_ < most_moves_of_tick && !work_.spent(); ++move, ++moves_) {
    PlaneSet planes;
    planes.push_back(plane_through(spot_.point, normal()));
    for (const Flank& flank : flanks_) planes.push_back(plane_through(flank.spot.point, flank.normal()));
    const PlaneProjection held = project_onto_planes(probe_, planes, false);
    if (held.active.size() < 2) {
      if (!held.active.empty() && held.active[0].plane > 0 && !lead_with(held.active[0].plane - 1))
        return DescentEnd::rest;
      flanks_.clear();
      DescentEnd end = DescentEnd::rest;
      const Way way = go(end, [&](int moves) { return settle_on_fold(moves); });
      if (way == Way::on) continue;
      return way == Way::free ? end : DescentEnd::rest;
    }
    Vec3 way = along_crease(held) - spot_.point;
    const double most = grains * view_.grain();
    if (way.norm() > most) way *= most / way.norm();
    if (way.norm() <= view_.skin()) return DescentEnd::rest;
    const Way end = go_along(way);
    if (end == Way::on) continue;
    if (end == Way::stuck) return DescentEnd::rest;
    grains = std::min(most_grains, growth * grains);
    for (Flank& flank : flanks_) view_.descend(flank.place, flank.spot, beside());
  }
  return DescentEnd::limited;
}

template <SurfaceView View>
void PointProxy<View>::recall_flanks() noexcept {
  flanks_.clear();
  if (!state_.rests) return;
  for (std::size_t i = 1; i < state_.places.size(); ++i) {
    Flank flank{state_.places[i], {}};
    flank.spot = view_.at(flank.place, flank.place.side() * state_.normal);
    if ((flank.spot.point - spot_.point).norm() <= view_.grain()) flanks_.push_back(flank);
  }
  state_.places.clear();
}

template <SurfaceView View>
bool PointProxy<View>::lead_with(std::size_t index) noexcept {
  const Flank flank = flanks_[index];
  if (!no_farther(flank.spot.point, spot_.point, probe_)) return false;
  flanks_[index] = {place_, spot_};
  place_ = flank.place;
  spot_ = flank.spot;
  return true;
}

template <SurfaceView View>
Vec3 PointProxy<View>::along_crease(const PlaneProjection& held) noexcept {
  const Vec3 way = held.point - spot_.point;
  if (friction_.still <= 0.0) return held.point;
  double push = 0.0;
  for (const PlaneProjection::Active& one : held.active) push += one.multiplier;
  const double length = way.norm();
  state_.sliding = length > (state_.sliding ? friction_.sliding : friction_.still) * push;
  if (!state_.sliding) return spot_.point;
  return held.point - std::min(1.0, friction_.sliding * push / length) * way;
}

template <SurfaceView View>
auto PointProxy<View>::go_along(const Vec3& step) noexcept -> Way {
  const Place place = place_;
  const Spot spot = spot_;
  DescentEnd end = DescentEnd::rest;
  const auto lead = [&](int moves) {
    return view_.descend(place_, spot_,
                         {.point = spot.point + step, .may_leave = false, .moves = moves, .work = work_.left()});
  };
  const Way way = go(end, lead, short_walk);
  if (way == Way::on || (way == Way::free && nearer(spot))) return way;
  place_ = place;
  spot_ = spot;
  return Way::stuck;
}

template <SurfaceView View>
template <class Lead>
auto PointProxy<View>::go(DescentEnd& end, const Lead& lead, int most) noexcept -> Way {
  constexpr int first_leg = 24;
  const Spot begin = spot_;
  Place place;
  Spot spot;
  SweptHit hit;
  for (int walked = 0, leg = first_leg; !hit.hit; walked += leg, leg *= 2) {
    place = place_;
    spot = spot_;
    end = lead(leg);
    hit = view_.between(place, spot, place_, spot_, sides_);
    if (end != DescentEnd::limited || walked + leg >= most || work_.spent()) break;
  }
  if (!hit.hit) return Way::free;
  Flank left{place, spot};
  take(hit);
  if (!nearer(spot)) {
    place_ = place;
    spot_ = spot;
    return nearer(begin) ? Way::on : Way::stuck;
  }
  view_.descend(left.place, left.spot, beside());
  if (flanks_.size() == flanks_.capacity()) flanks_.swap_remove(0);
  flanks_.push_back(left);
  return Way::on;
}

}  // namespace asperity
