#pragma once
// The proxy law where a point touches a surface that overlaps itself in space: from fold to fold.

#include "asperity/render/contact/point_creases.h"

namespace asperity {

template <SurfaceView View>
DescentEnd PointProxy<View>::settle_over_folds() noexcept {
  constexpr int most_moves = 64;
  // Along a crease in ever longer moves: where it rests in one, the first is made in vain in every tick.
  constexpr double least_grains = 1.0;
  constexpr double most_grains = 16.0;
  constexpr double growth = 4.0;
  double grains = least_grains;
  learned_ = 0;
  state_.held = {};
  recall_flanks();
  for (int move = 0; move < most_moves && moves_ < most_moves_of_tick && !work_.spent(); ++move, ++moves_) {
    held_within_ = infinity;
    PlaneSet planes;
    planes.push_back(plane_through(spot_.point, normal()));
    for (const Fold& flank : flanks_) planes.push_back(plane_through(flank.spot.point, flank.normal()));
    const PlaneProjection held = project_onto_planes(probe_, planes, false);
    if (held.active.size() < 2) {
      const Fold before{place_, spot_};
      const auto flanks = flanks_;
      if (!held.active.empty() && held.active[0].plane > 0) lead_with(held.active[0].plane - 1);
      DescentEnd end = DescentEnd::rest;
      const Way way = go(end);
      if (way == Way::on) continue;
      // The flank that it leads with may be a hair's breadth farther.
      if (!no_farther(spot_.point, before.spot.point, probe_)) {
        lead_by(before);
        flanks_ = flanks;
        return DescentEnd::rest;
      }
      if (way == Way::free) return end;
      hold();
      return DescentEnd::rest;
    }
    Vec3 way = along_crease(held) - spot_.point;
    const double most = grains * view_.grain();
    if (way.norm() > most) way *= most / way.norm();
    if (way.norm() <= view_.skin()) return DescentEnd::rest;
    const double distance = (spot_.point - probe_).norm();
    const Way end = go_along(held, way);
    if (end == Way::on) continue;
    const double gain = distance - (spot_.point - probe_).norm();
    if (end == Way::stuck) hold();
    if (end == Way::stuck || gain <= worth_going_on()) return DescentEnd::rest;
    grains = std::min(most_grains, growth * grains);
  }
  return DescentEnd::limited;
}

template <SurfaceView View>
bool PointProxy<View>::still_held() noexcept {
  const HeldBetween& held = state_.held;
  if (!state_.rests || !((probe_ - held.probe).norm() < held.within) ||
      (spot_.point - held.probe).norm() != held.distance)
    return false;
  flanks_.clear();
  for (std::size_t i = 1; i < state_.places.size(); ++i) flanks_.push_back({state_.places[i], {}});
  return true;
}

template <SurfaceView View>
void PointProxy<View>::not_nearer(const Vec3& there, const Vec3& stands) noexcept {
  const Vec3 way = there - stands;
  const double length = way.norm();
  // What is farther by this much, squared, is so until the probe has gone that far towards it.
  const double farther = way.dot(there + stands - 2.0 * probe_);
  if (length > 0.0) held_within_ = std::min(held_within_, std::max(0.0, 0.5 * farther / length));
}

template <SurfaceView View>
void PointProxy<View>::hold() noexcept {
  // The places looked at are few, and where folds do not meet is known for this direction of the pull alone.
  constexpr double sure_of = 0.3;
  constexpr double most_turn = 0.01;
  if (!(held_within_ < infinity) || work_.spent()) return;
  const double distance = (spot_.point - probe_).norm();
  state_.held = {probe_, distance, std::min(sure_of * held_within_, most_turn * distance)};
}

template <SurfaceView View>
void PointProxy<View>::recall_flanks() noexcept {
  flanks_.clear();
  if (!state_.rests) return;
  for (std::size_t i = 1; i < state_.places.size(); ++i) {
    Fold flank{state_.places[i], {}};
    flank.spot = view_.at(flank.place, flank.place.side() * state_.normal);
    if (touches(flank)) flanks_.push_back(flank);
  }
  state_.places.clear();
}

template <SurfaceView View>
bool PointProxy<View>::touches(const Fold& flank) const noexcept {
  const Vec3 apart = spot_.point - flank.spot.point;
  const double above = flank.normal().dot(apart);
  const double room = room_beside();
  return std::abs(above) <= room && (apart - above * flank.normal()).squaredNorm() <= room * room;
}

template <SurfaceView View>
void PointProxy<View>::lead_with(std::size_t index) noexcept {
  Folds both;
  both.push_back(flanks_[index]);
  both.push_back({place_, spot_});
  // Where both are, or else it may begin inside of the other.
  if ((flanks_[index].spot.point - spot_.point).norm() > view_.skin() && !onto(both, spot_.point)) {
    both.clear();
    both.push_back(flanks_[index]);
    both.push_back({place_, spot_});
  }
  lead_by(both[0]);
  flanks_[index] = both[1];
}

template <SurfaceView View>
auto PointProxy<View>::go(DescentEnd& end) noexcept -> Way {
  constexpr int first_leg = 24;
  constexpr int short_leg = 2;
  const Spot begin = spot_;
  const std::uint32_t likely = flanks_.empty() ? no_index : flanks_[0].place.element;
  Fold left;
  SweptHit hit;
  bool at_once = false;
  for (int walked = 0, leg = first_leg; walked < most_walk;) {
    left = {place_, spot_};
    // By as much at both ends, so that a way of no length meets nothing.
    const Vec3 lift = off(all_folds()) - spot_.point;
    end = settle_on_fold(leg);
    const std::uint32_t along[] = {left.place.element, place_.element};
    hit = view_.beside(along, {left.spot.point + lift, spot_.point + lift}, sides_, likely);
    at_once = hit.hit && hit.t * (spot_.point - left.spot.point).norm() <= room_beside();
    if (at_once && leg > short_leg && !work_.spent()) {
      // Beside another fold a way that bends may lead off it, and its chord into it.
      lead_by(left);
      leg = short_leg;
      continue;
    }
    if (hit.hit || end != DescentEnd::limited || work_.spent()) break;
    walked += leg;
    leg *= 2;
  }
  if (!hit.hit) {
    flanks_.clear();
    return Way::free;
  }
  const Fold from = left;
  const Fold met{place_of(hit), view_.at(place_of(hit), hit.side * hit.contact.normal)};
  const std::size_t known = at_once ? same_as(met) : soon_again(met, from);
  if (at_once && known == flanks_.size()) {
    lead_by(from);
    return learn(met) ? Way::on : Way::stuck;
  }
  if (known < flanks_.size()) {
    const Fold to{place_, spot_};
    const auto flanks = flanks_;
    lead_by(from);
    const Way way = along_flank(known);
    if (at_once || way != Way::stuck) return way;
    lead_by(to);
    flanks_ = flanks;
  }
  flanks_.clear();
  take(hit);
  view_.descend(left.place, left.spot, beside());
  // The way is a chord of the fold, over it or under it: to where the two meet.
  if (std::abs(left.normal().dot(spot_.point - left.spot.point)) > view_.skin()) {
    Folds both;
    both.push_back({place_, spot_});
    both.push_back(left);
    if (onto(both, spot_.point)) {
      lead_by(both[0]);
      left = both[1];
    }
  }
  if (!nearer(spot_, from.spot)) {
    not_nearer(spot_.point, from.spot.point);
    lead_by(from);
    return nearer(spot_, begin) ? Way::on : Way::stuck;
  }
  if (touches(left)) flanks_.push_back(left);
  return Way::on;
}

template <SurfaceView View>
std::size_t PointProxy<View>::same_as(const Fold& met) const noexcept {
  std::size_t known = 0;
  while (known < flanks_.size() && !is_same(flanks_[known], met)) ++known;
  return known;
}

template <SurfaceView View>
bool PointProxy<View>::learn(const Fold& met) noexcept {
  constexpr int most_learned = 4;
  if (++learned_ > most_learned || is_same({place_, spot_}, met) || same_as(met) < flanks_.size()) return false;
  if (flanks_.size() == flanks_.capacity()) flanks_.swap_remove(0);
  flanks_.push_back(met);
  return true;
}

template <SurfaceView View>
std::size_t PointProxy<View>::soon_again(const Fold& met, const Fold& from) const noexcept {
  const bool soon = (met.spot.point - from.spot.point).norm() <= view_.grain();
  std::size_t known = soon ? 0 : flanks_.size();
  while (known < flanks_.size() &&
         (flanks_[known].place.element != met.place.element || !(flanks_[known].normal().dot(met.normal()) > 0.0)))
    ++known;
  return known;
}

template <SurfaceView View>
auto PointProxy<View>::along_flank(std::size_t known) noexcept -> Way {
  PlaneSet both;
  both.push_back(plane_through(spot_.point, normal()));
  both.push_back(plane_through(flanks_[known].spot.point, flanks_[known].normal()));
  PlaneProjection held;
  held.point = probe_;
  if (!onto_all(both, held.point)) return Way::stuck;
  held.active.push_back({0, 0.5 * (held.point - probe_).norm()});
  held.active.push_back({known + 1, 0.5 * (held.point - probe_).norm()});
  Vec3 step = along_crease(held) - spot_.point;
  if (!(step.norm() > rest_along_crease())) {
    held_within_ = std::min(held_within_, rest_along_crease() - step.norm());
    return Way::stuck;
  }
  if (step.norm() > view_.grain()) step *= view_.grain() / step.norm();
  return go_along(held, step) == Way::stuck ? Way::stuck : Way::on;
}

}  // namespace asperity
