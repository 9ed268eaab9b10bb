#pragma once
// One change of a scene that shares all else with it: what is turned while it is touched.

#include <cstdint>
#include <string>
#include <string_view>

#include "asperity/core/names.h"
#include "asperity/core/result.h"
#include "asperity/render/scene.h"

namespace asperity {

/// What an edit changes.
enum class SceneEditKind : std::uint8_t {
  stiffness,         ///< of the material (N/m)
  friction,          ///< both of its coefficients
  static_friction,   ///< of the material
  dynamic_friction,  ///< of the material
  threshold,         ///< of an isosurface, in the field's unit
  zoom,              ///< of the view
  law,               ///< that a surface is felt by, with its default options
};
/// As in traces and on command lines.
template <>
struct Names<SceneEditKind> {
  static constexpr auto table =
      std::to_array<Named<SceneEditKind>>({{SceneEditKind::stiffness, "stiffness"},
                                           {SceneEditKind::friction, "friction"},
                                           {SceneEditKind::static_friction, "static_friction"},
                                           {SceneEditKind::dynamic_friction, "dynamic_friction"},
                                           {SceneEditKind::threshold, "threshold"},
                                           {SceneEditKind::zoom, "zoom"},
                                           {SceneEditKind::law, "law"}});
};

/// One change of a scene.
struct SceneEdit {
  SceneEditKind kind = SceneEditKind::stiffness;
  std::string instance = {};  ///< by its name; empty: every one that has such a thing. A zoom is the view's: empty
  double value = 0.0;         ///< SI, as its kind says
  std::string law = {};       ///< of kind law: its name
  bool operator==(const SceneEdit&) const = default;
};

/// The scene with that change, all of it or none. It shares its surfaces with `scene`, so that a probe that touches one
/// goes on; it takes some ten microseconds, but for the law dense-mesh, which makes its mesh. Errors, with the
/// instance's name and the kind as place: bad_value (no such instance, a value that Scene::build refuses),
/// unsupported_pair (a threshold of what has none, a law that does not feel the surface). [build]
Result<Scene> edited(const Scene& scene, const SceneEdit& edit);

/// An edit as people write it: "stiffness=800", "dragon.stiffness=0.5N/mm", "zoom=2", "law=height-field",
/// "threshold=0.4"; units as parse_quantity reads them. Errors: bad_value naming what would be accepted. [any]
Result<SceneEdit> parse_scene_edit_text(std::string_view text);

}  // namespace asperity
