#include "asperity/render/view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace asperity {

double View::pixel_at(const Vec3& p) const noexcept {
  if (camera.pixels <= 0) return 0.0;
  const Vec3 eye = focus + (camera.eye - focus) / zoom;
  const double distance = (p - eye).norm();
  return 2.0 * std::tan(0.5 * camera.field_of_view) * distance / camera.pixels;
}

Status validate(const View& view) {
  const auto bad = [](const char* place, const std::string& what, const char* accepted) {
    return bad_value(what, place, accepted);
  };
  if (!(view.zoom >= 1e-3 && view.zoom <= 1e6)) return bad("zoom", fmt::format("is {:g}", view.zoom), "0.001 to 1e6");
  if (!view.focus.allFinite() || !view.home.allFinite()) return bad("focus", "is not finite", "finite places");
  if (!(std::abs(view.orientation.norm() - 1.0) <= 1e-9))
    return bad("orientation", "is no rotation", "a unit quaternion");
  if (!view.camera.eye.allFinite() || !view.camera.target.allFinite() || view.camera.eye == view.camera.target)
    return bad("camera", "looks at its own place, or is not finite", "two different places");
  if (!(view.camera.field_of_view > 0.0 && view.camera.field_of_view < std::numbers::pi))
    return bad("camera.field_of_view", fmt::format("is {:g} rad", view.camera.field_of_view),
               "above 0 and below 180 degrees");
  if (view.camera.pixels < 0 || view.camera.pixels > 100000)
    return bad("camera.pixels", fmt::format("is {}", view.camera.pixels), "0 (nobody looks) to 100000 rows");
  return success();
}

namespace {

double elapsed(const Motion& motion, Seconds time) noexcept {
  return std::clamp((time - motion.since).count(), 0.0, std::max(0.0, motion.horizon.count()));
}

}  // namespace

Pose Motion::at(const Pose& pose, Seconds time) const noexcept {
  if (!moves()) return pose;
  const double t = elapsed(*this, time);
  const double rate = velocity.angular.norm();
  Pose now = pose;
  now.position += t * velocity.linear;
  if (rate > 0.0) {
    now.orientation = Quat(Eigen::AngleAxisd(t * rate, velocity.angular / rate)) * pose.orientation;
    now.orientation.normalize();
  }
  return now;
}

Vec3 Motion::velocity_at(const Pose& now, const Vec3& p, Seconds time) const noexcept {
  const double t = (time - since).count();
  if (!moves() || t < 0.0 || t > horizon.count()) return Vec3::Zero();
  return velocity.linear + velocity.angular.cross(p - now.position);
}

}  // namespace asperity
