#pragma once
// Frames and symbols, defined once.
//
//   device   the device's own axes; a profile maps them to the world frame
//   world    right-handed, y up; probe, proxy and forces are given here
//   object   the frame a surface is stored in; an instance's pose maps object to world
//   tangent  at a surface point: tangent t (along +u), bitangent b (along +v), outward normal n
//
// A Pose named `a_from_b` maps coordinates given in b to coordinates given in a.
// Outward normals; signed heights and distances are positive outside.

#include "asperity/core/math.h"

namespace asperity {

/// Rigid placement of one frame in another.
struct Pose {
  Vec3 position = Vec3::Zero();         ///< m
  Quat orientation = Quat::Identity();  ///< unit quaternion

  [[nodiscard]] Vec3 apply(const Vec3& point) const { return orientation * point + position; }
  [[nodiscard]] Vec3 apply_inverse(const Vec3& point) const { return orientation.conjugate() * (point - position); }
  [[nodiscard]] Vec3 rotate(const Vec3& direction) const { return orientation * direction; }
  [[nodiscard]] Vec3 rotate_inverse(const Vec3& direction) const { return orientation.conjugate() * direction; }
  [[nodiscard]] bool is_identity() const {
    return position == Vec3::Zero() && orientation.w() == 1.0 && orientation.vec() == Vec3::Zero();
  }
};

/// The axis-aligned box around a box that was moved by `pose`; an empty one stays empty. [any]
inline Box transformed(const Box& box, const Pose& pose) {
  return box.mapped([&](const Vec3& corner) { return pose.apply(corner); });
}

/// Linear (m/s) and angular (rad/s) velocity, world frame.
struct Twist {
  Vec3 linear = Vec3::Zero();
  Vec3 angular = Vec3::Zero();
};

/// Force (N) and torque (N·m) on the probe, world frame, torque about where the probe is held.
struct Wrench {
  Vec3 force = Vec3::Zero();
  Vec3 torque = Vec3::Zero();
};

}  // namespace asperity
