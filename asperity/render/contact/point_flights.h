#pragma once
// The proxy law of a point between two touches: flights through free space, and what comes of those that lead nowhere.

#include "asperity/render/contact/point.h"

namespace asperity {

template <SurfaceView View>
bool PointProxy<View>::fly(const Vec3& from, std::uint32_t starts_on) noexcept {
  leave();
  const SweptHit hit = first_touch({from, probe_}, starts_on);
  if (!hit.hit || hit.contact.normal.isZero()) return false;
  take(hit);
  state_.rests = true;
  return true;
}

template <SurfaceView View>
SweptHit PointProxy<View>::first_touch(const Segment& motion, std::uint32_t starts_on) const noexcept {
  if constexpr (requires { view_.first_touch(motion, sides_, starts_on); })
    return view_.first_touch(motion, sides_, starts_on);
  else
    return view_.first_touch(motion, sides_);
}

template <SurfaceView View>
bool PointProxy<View>::stays() noexcept {
  constexpr int most_in_vain = 3;
  const double distance = (spot_.point - probe_).norm();
  in_vain_ = distance > left_at_ - view_.skin() ? in_vain_ + 1 : 0;
  left_at_ = distance;
  return in_vain_ == most_in_vain;
}

template <SurfaceView View>
bool PointProxy<View>::pinched(const Vec3& start) const noexcept {
  if constexpr (may_overlap) return view_.overlaps() && view_.first_touch({spot_.point, start}, sides_).hit;
  return false;
}

template <SurfaceView View>
PointRest PointProxy<View>::held_by_rim() noexcept {
  const DescentEnd end =
      view_.descend(place_, spot_, {.point = probe_, .may_leave = false, .sides = sides_, .work = work_.left()});
  return resting(end != DescentEnd::limited);
}

}  // namespace asperity
