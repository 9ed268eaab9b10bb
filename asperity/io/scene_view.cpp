// The view of a scene, how its surfaces move, and how changes are felt.

#include <algorithm>

#include "asperity/io/detail/scene_reader.h"

namespace asperity {

Result<Motion> read_motion(ObjectReader& surface) {
  Motion motion;
  const SceneJson* json = surface.raw("motion");
  if (json == nullptr) return motion;
  ObjectReader reader(*json, surface.place_of("motion"), "motion");
  constexpr double fastest = 100.0;     // m/s
  constexpr double fastest_turn = 1e3;  // rad/s
  motion.velocity.linear = reader.vector("velocity", Dimension::speed, Vec3::Zero(), fastest);
  motion.velocity.angular = reader.vector("angular_velocity", Dimension::angle, Vec3::Zero(), fastest_turn);
  motion.since = Seconds(reader.quantity("since", Dimension::time, 0.0, Range::not_negative()));
  // A scene file is one snapshot for the whole run: without a horizon the motion goes on.
  motion.horizon = Seconds(reader.quantity("horizon", Dimension::time, 3600.0, Range::not_negative()));
  ASPERITY_CHECK(reader.status());
  surface.take("motion", std::move(reader));
  return motion;
}

Result<View> read_view(ObjectReader& root, const Box& bounds) {
  View view;
  const SceneJson* json = root.raw("view");
  if (json == nullptr) return view;
  ObjectReader reader(*json, "view", "view");
  const Vec3 middle = 0.5 * (bounds.lower + bounds.upper);
  view.zoom = reader.number("zoom", 1.0, Range{1e-3, 1e6});
  view.focus = reader.lengths("focus", middle);
  view.home = reader.lengths("home", view.focus);
  if (const SceneJson* camera_json = reader.raw("camera")) {
    ObjectReader camera(*camera_json, "view.camera", "camera");
    const double distance = 1.5 * std::max(bounds.diagonal(), 1e-6);
    view.camera.target = camera.lengths("target", view.focus);
    view.camera.eye = camera.lengths("eye", view.camera.target + distance * Vec3(0.0, 0.8, 0.6));
    view.camera.field_of_view = camera.quantity("field_of_view", Dimension::angle, view.camera.field_of_view);
    view.camera.pixels = camera.integer("pixels", 1080, 0, 100000);
    reader.take("camera", std::move(camera));
  }
  if (reader.has("angle") || reader.has("axis")) {
    const Vec3 axis = reader.direction("axis", Vec3::UnitY());
    const double angle = reader.quantity("angle", Dimension::angle, 0.0);
    if (!reader.failed() && axis.isZero()) reader.fail("axis", "has no length", "three numbers, not all 0");
    if (!reader.failed()) view.orientation = Quat(Eigen::AngleAxisd(angle, axis.normalized()));
  }
  ASPERITY_CHECK(reader.status());
  ASPERITY_CHECK(at_place(validate(view), "view"));
  root.take("view", std::move(reader));
  return view;
}

Status read_change(ObjectReader& root, SceneSettings& settings) {
  const SceneJson* json = root.raw("change");
  if (json == nullptr) return success();
  ObjectReader reader(*json, "change", "change");
  settings.handover =
      Seconds(reader.quantity("handover", Dimension::time, settings.handover.count(), Range::not_negative()));
  settings.change_power = reader.number("power", settings.change_power, Range::not_negative());
  settings.level_rate = reader.number("level_rate", settings.level_rate, Range::positive());
  ASPERITY_CHECK(reader.status());
  root.take("change", std::move(reader));
  return success();
}

}  // namespace asperity
