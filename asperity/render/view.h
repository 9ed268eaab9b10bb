#pragma once
// How a scene is seen, and how the device's workspace lies in it: what zooming changes for eye and hand alike.

#include "asperity/core/frames.h"
#include "asperity/core/result.h"
#include "asperity/core/units.h"

namespace asperity {

/// Where a scene is seen from.
struct Viewpoint {
  Vec3 eye = Vec3(0.0, 0.3, 0.3);  ///< m, scene
  Vec3 target = Vec3::Zero();      ///< m, scene: the middle of the picture
  double field_of_view = 0.7;      ///< rad, over the picture's height, above 0 and below pi
  int pixels = 0;                  ///< rows of the picture; 0: nobody looks, and nothing is too small to be seen
};

/// The view of a scene (hrm-2010, section 4 and 5.4: "the scaling effect is kept in sync between the visual and haptic
/// field of view"). The probe at p in the device's workspace is in the scene at focus + R (p - home) / zoom. Zooming in
/// brings the camera nearer to the focus by the same factor, so that a centimetre of the hand is always the same share
/// of the picture. Forces, stiffness and friction are those of the hand: they do not change with the zoom.
struct View {
  Viewpoint camera;
  double zoom = 1.0;                    ///< size of what is shown over its own, 1e-3 to 1e6
  Vec3 focus = Vec3::Zero();            ///< m, scene: what stays where it is when zoomed
  Vec3 home = Vec3::Zero();             ///< m, workspace: where the focus is felt
  Quat orientation = Quat::Identity();  ///< R: from the workspace's axes to the scene's, unit

  /// Whether workspace and scene are the same. [servo]
  [[nodiscard]] bool identity() const noexcept {
    return zoom == 1.0 && focus == home && orientation.w() == 1.0 && orientation.vec() == Vec3::Zero();
  }
  /// [servo]
  [[nodiscard]] Vec3 to_scene(const Vec3& p) const noexcept { return focus + orientation * (p - home) / zoom; }
  /// [servo]
  [[nodiscard]] Vec3 to_workspace(const Vec3& p) const noexcept {
    return home + orientation.conjugate() * (zoom * (p - focus));
  }
  /// Size of a pixel at a place of the scene (m): what is smaller cannot be seen; 0 where nobody looks. The camera is
  /// taken to be where zooming has brought it. [servo]
  [[nodiscard]] double pixel_at(const Vec3& p) const noexcept;
};

/// Errors: bad_value naming the member and what would be accepted. [build]
Status validate(const View& view);

/// How an instance moves on from its pose until the next scene tells more. World frame.
struct Motion {
  Twist velocity;        ///< of the instance's origin, and about it
  Seconds since{0.0};    ///< when the instance was at its pose, on the clock of ProbeSample::time
  Seconds horizon{0.1};  ///< from then on it is not trusted: the instance stands still
  [[nodiscard]] bool moves() const noexcept {
    return velocity.linear != Vec3::Zero() || velocity.angular != Vec3::Zero();
  }
  /// Where an instance of this pose is at a time. Before `since`: at its pose. [servo]
  [[nodiscard]] Pose at(const Pose& pose, Seconds time) const noexcept;
  /// Velocity of the instance's point that is at p, then (m/s). [servo]
  [[nodiscard]] Vec3 velocity_at(const Pose& now, const Vec3& p, Seconds time) const noexcept;
};

}  // namespace asperity
