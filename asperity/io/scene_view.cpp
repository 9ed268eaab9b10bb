// The view of a scene, how its surfaces move, and how changes are felt.

#include <algorithm>

#include "asperity/io/detail/scene_reader.h"

namespace asperity {

Result<Motion> read_motion(ObjectReader& surface) {
  Motion motion;
  const SceneJson* json = surface.raw("motion");
  if (json == nullptr) return motion;
  ObjectReader reader(*json, surface.place_of("motion"), "motion");
  motion.velocity.linear = reader.get<Vec3>("velocity");
  motion.velocity.angular = reader.get<Vec3>("angular_velocity");
  reader.read_all(motion);
  ASPERITY_CHECK(reader.status());
  surface.take("motion", std::move(reader));
  return motion;
}

Quat read_turn(ObjectReader& reader) {
  if (!reader.has("angle") && !reader.has("axis")) return Quat::Identity();
  const Vec3 axis = reader.get<Vec3>("axis");
  const auto angle = reader.get<double>("angle");
  return reader.failed() ? Quat(Quat::Identity()) : Quat(Eigen::AngleAxisd(angle, axis.normalized()));
}

Result<View> read_view(ObjectReader& root, const Box& bounds) {
  View view;
  const SceneJson* json = root.raw("view");
  if (json == nullptr) return view;
  ObjectReader reader(*json, "view", "view");
  const Vec3 middle = 0.5 * (bounds.lower + bounds.upper);
  reader.read("zoom", view.zoom);
  view.focus = reader.get("focus", middle);
  view.home = reader.get("home", view.focus);
  if (const SceneJson* camera_json = reader.raw("camera")) {
    ObjectReader camera(*camera_json, "view.camera", "camera");
    const double distance = 1.5 * std::max(bounds.diagonal(), 1e-6);
    view.camera.target = camera.get("target", view.focus);
    view.camera.eye = camera.get("eye", Vec3(view.camera.target + distance * Vec3(0.0, 0.8, 0.6)));
    camera.read("field_of_view", view.camera.field_of_view);
    view.camera.pixels = camera.get<int>("pixels");
    reader.take("camera", std::move(camera));
  }
  view.orientation = read_turn(reader);
  ASPERITY_CHECK(reader.status());
  ASPERITY_CHECK(at_place(validate(view), "view"));
  root.take("view", std::move(reader));
  return view;
}

Status read_change(ObjectReader& root, SceneSettings& settings) {
  const SceneJson* json = root.raw("change");
  if (json == nullptr) return success();
  ObjectReader reader(*json, "change", "change");
  reader.read_all(settings);
  ASPERITY_CHECK(reader.status());
  root.take("change", std::move(reader));
  return success();
}

}  // namespace asperity
