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
  learned_ = 0;
  recall_flanks();
  for (int move = 0; move < most_moves && moves_ < most_moves_of_tick && !work_.spent(); ++move, ++moves_) {
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
      return way == Way::free ? end : DescentEnd::rest;
    }
    Vec3 way = along_crease(held) - spot_.point;
    const double most = grains * view_.grain();
    if (way.norm() > most) way *= most / way.norm();
    if (way.norm() <= view_.skin()) return DescentEnd::rest;
    const double distance = (spot_.point - probe_).norm();
    const Way end = go_along(held, way);
    if (end == Way::on) continue;
    const double gain = distance - (spot_.point - probe_).norm();
    if (end == Way::stuck || gain <= worth_going_on()) return DescentEnd::rest;
    grains = std::min(most_grains, growth * grains);
  }
  return DescentEnd::limited;
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
bool PointProxy<View>::onto(Folds& folds, Vec3 point) noexcept {
  constexpr int most_steps = 8;
  constexpr int short_walk = 24;
  constexpr double near_enough = 1.0;  // of a skin
  constexpr double least_gain = 0.5;   // in two steps
  constexpr double smooth = 0.98;
  const Vec3 start = point;
  Vec3 along = Vec3::Zero();
  double earlier = infinity;
  double before = infinity;
  const Folds begin = folds;
  kink_.reset();
  for (int step = 0; step < most_steps; ++step) {
    PlaneSet planes;
    double off = 0.0;
    for (std::size_t i = 0; i < folds.size(); ++i) {
      Fold& fold = folds[i];
      view_.descend(fold.place, fold.spot,
                    {.point = point, .may_leave = false, .exactly = true, .moves = short_walk, .work = work_.left()});
      if (fold.normal().dot(begin[i].normal()) < smooth) {
        kink_ = fold;
        kink_rises_ = begin[i].normal().dot(fold.spot.point - begin[i].spot.point) > 0.0;
      }
      planes.push_back(plane_through(fold.spot.point, fold.normal()));
      off = std::max(off, (fold.spot.point - point).norm());
    }
    if (off <= near_enough * view_.skin()) return true;
    // To and fro between two faces of a fold: they do not meet across here.
    if (off > least_gain * std::exchange(earlier, std::exchange(before, off))) return false;
    if (folds.size() == 2) {
      // Across the crease: what is nearest would be a corner of it wherever it turns one.
      if (step == 0) along = planes[0].normal.cross(planes[1].normal).stableNormalized();
      planes.push_back(plane_through(start, along));
    }
    if (!onto_all(planes, point)) return false;
  }
  return false;
}

template <SurfaceView View>
Vec3 PointProxy<View>::off(const Folds& folds) const noexcept {
  constexpr double most_skins = 16.0;
  const Vec3& on = folds[0].spot.point;
  PlaneSet planes;
  for (const Fold& fold : folds) {
    planes.push_back(plane_through(fold.spot.point, fold.normal()));
    planes[planes.size() - 1].skin = view_.skin();
  }
  const PlaneProjection away = project_onto_planes(on, planes, true);
  // Between folds that all but meet there is no such place near.
  if (away.feasible && (away.point - on).norm() <= most_skins * view_.skin() + room_beside()) return away.point;
  return on + view_.skin() * folds[0].normal();
}

template <SurfaceView View>
auto PointProxy<View>::all_folds() const noexcept -> Folds {
  Folds all;
  all.push_back({place_, spot_});
  for (const Fold& flank : flanks_) all.push_back(flank);
  return all;
}

template <SurfaceView View>
bool PointProxy<View>::search_along(const Folds& from, Vec3 step, Folds& on) noexcept {
  constexpr int most_attempts = 3;
  constexpr double shorter = 0.2;
  const double distance = (probe_ - spot_.point).norm();
  const double slope = (probe_ - spot_.point).dot(step) / (distance * step.norm());
  for (int attempt = 0; attempt < most_attempts; ++attempt) {
    const double length = step.norm();
    const double gain = 0.5 * slope * length;  // at most: less by what the crease bends
    if (attempt > 0 && !(length > rest_along_crease() && gain > worth_going_on())) return false;
    on = from;
    const bool meet = onto(on, spot_.point + step);
    if (meet && nearer(on[0].spot, spot_)) return true;
    double share = shorter;
    if (kink_) {
      // It turns a corner on the way, most likely that.
      PlaneSet planes;
      for (const Fold& fold : from) planes.push_back(plane_through(spot_.point, fold.normal()));
      planes.push_back(plane_through(kink_->spot.point, kink_->normal()));
      Vec3 corner = spot_.point;
      if (onto_all(planes, corner)) share = std::min(0.5, (corner - spot_.point).norm() / length);
    } else if (meet) {
      // To where a parabola through what is known of it would be nearest.
      const double lost = (probe_ - on[0].spot.point).norm() - distance;
      share = std::clamp(0.5 * slope * length / (slope * length + std::max(0.0, lost)), 0.0, 0.5);
    }
    step *= share;
  }
  return false;
}

template <SurfaceView View>
auto PointProxy<View>::go_along(const PlaneProjection& held, const Vec3& step) noexcept -> Way {
  Folds before;
  Folds others;
  for (std::size_t i = 0; i <= flanks_.size(); ++i) {
    const Fold fold = i == 0 ? Fold{place_, spot_} : flanks_[i - 1];
    const bool holds = std::any_of(held.active.begin(), held.active.end(),
                                   [i](const PlaneProjection::Active& one) { return one.plane == i; });
    (holds ? before : others).push_back(fold);
  }
  Folds on;
  if (!search_along(before, step, on)) return learn_kink() ? Way::on : Way::stuck;
  FixedVector<std::uint32_t, 6> faces;
  for (const Folds& some : {before, on}) {
    for (const Fold& fold : some) faces.push_back(fold.place.element);
  }
  const SweptHit hit = view_.beside({faces.begin(), faces.end()}, {off(all_folds()), off(on)}, sides_);
  if (hit.hit) {
    const Fold met{place_of(hit), view_.at(place_of(hit), hit.side * hit.contact.normal)};
    // Where it stands it touches another one.
    if (!nearer(met.spot, spot_)) return learn(met) ? Way::on : Way::stuck;
    lead_by(met);
    stay_beside(on);
    return Way::on;
  }
  lead_by(on[0]);
  stay_beside(others);
  for (std::size_t i = on.size(); i-- > 1;) {
    if (flanks_.size() == flanks_.capacity()) flanks_.swap_remove(flanks_.size() - 1);
    flanks_.push_back(on[i]);
  }
  return Way::free;
}

template <SurfaceView View>
bool PointProxy<View>::learn_kink() noexcept {
  if (!kink_ || !kink_rises_) return false;
  view_.descend(kink_->place, kink_->spot, beside());
  return touches(*kink_) && learn(*kink_);
}

template <SurfaceView View>
void PointProxy<View>::stay_beside(Folds& folds) noexcept {
  flanks_.clear();
  for (Fold& fold : folds) {
    view_.descend(fold.place, fold.spot, beside());
    if (touches(fold)) flanks_.push_back(fold);
  }
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
    const Vec3 start = walked == 0 ? off(all_folds()) : Vec3(spot_.point + view_.skin() * normal());
    end = settle_on_fold(leg);
    const std::uint32_t along[] = {left.place.element, place_.element};
    hit = view_.beside(along, {start, spot_.point + view_.skin() * normal()}, sides_, likely);
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
  if (at_once) {
    lead_by(from);
    return stand_beside({place_of(hit), view_.at(place_of(hit), hit.side * hit.contact.normal)});
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
auto PointProxy<View>::stand_beside(const Fold& met) noexcept -> Way {
  const std::size_t known = same_as(met);
  if (known == flanks_.size()) return learn(met) ? Way::on : Way::stuck;
  if (flanks_[known].normal().dot(met.normal()) < 0.0) return Way::stuck;
  // Its plane, as it is known, would let it pass: along the crease of the two.
  PlaneSet both;
  both.push_back(plane_through(spot_.point, normal()));
  both.push_back(plane_through(flanks_[known].spot.point, flanks_[known].normal()));
  PlaneProjection held;
  held.point = probe_;
  if (!onto_all(both, held.point)) return Way::stuck;
  held.active.push_back({0, 0.5 * (held.point - probe_).norm()});
  held.active.push_back({known + 1, 0.5 * (held.point - probe_).norm()});
  Vec3 step = along_crease(held) - spot_.point;
  if (!(step.norm() > rest_along_crease())) return Way::stuck;
  if (step.norm() > view_.grain()) step *= view_.grain() / step.norm();
  return go_along(held, step) == Way::stuck ? Way::stuck : Way::on;
}

}  // namespace asperity
