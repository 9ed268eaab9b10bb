// Where a stroke is at a time: the part of StrokePath that runs in the servo thread.

#include <algorithm>
#include <cmath>

#include "asperity/device/stroke.h"

namespace asperity {
namespace {

/// Interpolated unit normal and its change per unit of the interpolation parameter.
struct Blend {
  Vec3 normal;
  Vec3 rate;
};

Blend blend(const Vec3& n0, const Vec3& n1, double u) noexcept {
  const Vec3 mean = (1.0 - u) * n0 + u * n1;
  const double norm = mean.norm();
  // Opposite normals (a blade) have no mean: jump half way.
  if (norm < 1e-6) return {u < 0.5 ? n0 : n1, Vec3::Zero()};
  const Vec3 n = mean / norm;
  const Vec3 change = n1 - n0;
  return {n, (change - n * n.dot(change)) / norm};
}

/// Index i of the interval [knots[i], knots[i + 1]] that holds `value`.
std::size_t interval(const std::vector<double>& knots, double value) noexcept {
  const auto above = std::upper_bound(knots.begin() + 1, knots.end() - 1, value);
  return static_cast<std::size_t>(above - knots.begin()) - 1;
}

}  // namespace

StrokePose StrokePath::pose_at_arc(double arc, double direction, double speed, double height,
                                   double climb) const noexcept {
  const double s = std::clamp(arc, 0.0, arcs_.back());
  const std::size_t i = interval(arcs_, s);
  const double ds = arcs_[i + 1] - arcs_[i];
  const double u = (s - arcs_[i]) / ds;
  const Blend n = blend(normals_[i], normals_[i + 1], u);
  StrokePose pose;
  pose.point = (1.0 - u) * points_[i] + u * points_[i + 1];
  pose.normal = n.normal;
  pose.tangent = (direction / ds) * (points_[i + 1] - points_[i]);
  pose.height = height;
  pose.target = pose.point + height * pose.normal;
  pose.normal_rate = (direction * speed / ds) * n.rate;
  pose.velocity = speed * pose.tangent + climb * pose.normal + height * pose.normal_rate;
  pose.arc = s;
  return pose;
}

StrokePose StrokePath::recorded_pose(double time) const noexcept {
  const double t = std::clamp(time, 0.0, times_.back());
  const std::size_t i = interval(times_, t);
  const double span = times_[i + 1] - times_[i];
  const double u = (t - times_[i]) / span;
  const Blend n = blend(normals_[i], normals_[i + 1], u);
  const Vec3 step = points_[i + 1] - points_[i];
  const double length = step.norm();
  StrokePose pose;
  pose.point = points_[i] + u * step;
  pose.target = pose.point;
  pose.normal = n.normal;
  pose.tangent = length > 0.0 ? Vec3(step / length) : Vec3(n.normal.unitOrthogonal());
  pose.velocity = step / span;
  pose.normal_rate = n.rate / span;
  pose.arc = arcs_[i] + u * length;
  pose.distance = pose.arc;
  pose.phase = time < times_.back() ? StrokePhase::contact : StrokePhase::done;
  return pose;
}

StrokePose StrokePath::pose(Seconds time) const noexcept {
  const double t = std::isfinite(time.count()) ? std::clamp(time.count(), 0.0, duration().count()) : 0.0;
  if (arcs_.empty()) {
    StrokePose nowhere;
    nowhere.phase = StrokePhase::done;
    return nowhere;
  }
  if (recorded()) return recorded_pose(t);
  const double end_arc = back_and_forth_ ? 0.0 : length();
  const double end_direction = back_and_forth_ ? -1.0 : 1.0;
  const double drop = contact_height_ - approach_height_;
  if (t < approach_time_) {
    const double climb = drop / approach_time_;
    return pose_at_arc(0.0, 1.0, 0.0, approach_height_ + climb * t, climb);
  }
  if (t < approach_time_ + contact_time_) {
    const double distance = speed_ * (t - approach_time_);
    const double cycle = (back_and_forth_ ? 2.0 : 1.0) * length();
    const double within = std::fmod(distance, cycle);
    const bool back = within > length();
    StrokePose pose = pose_at_arc(back ? cycle - within : within, back ? -1.0 : 1.0, speed_, contact_height_, 0.0);
    pose.distance = distance;
    pose.phase = StrokePhase::contact;
    return pose;
  }
  const double lifting = t - approach_time_ - contact_time_;
  const bool done = t >= duration().count();
  const double climb = lift_time_ > 0.0 ? -drop / lift_time_ : 0.0;
  StrokePose pose = pose_at_arc(end_arc, end_direction, 0.0, contact_height_ + climb * std::min(lifting, lift_time_),
                                done ? 0.0 : climb);
  pose.distance = total_distance_;
  pose.phase = done ? StrokePhase::done : StrokePhase::lift;
  return pose;
}

}  // namespace asperity
