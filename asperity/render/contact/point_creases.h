#pragma once
// The proxy law where a point is between folds of a surface that overlaps itself in space: along the creases where they
// meet.

#include "asperity/render/contact/point_flights.h"

namespace asperity {

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
    if (meet) not_nearer(on[0].spot.point, spot_.point);
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
      share = nearest_share(slope * length, (probe_ - on[0].spot.point).norm() - distance);
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
    if (!nearer(met.spot, spot_)) {
      not_nearer(met.spot.point, spot_.point);
      return learn(met) ? Way::on : Way::stuck;
    }
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

}  // namespace asperity
