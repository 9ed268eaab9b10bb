#include "asperity/render/scene_edit.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "asperity/core/units.h"
#include "asperity/render/law_registry.h"

namespace asperity {
namespace {

std::string place_of_edit(const SceneEdit& edit) {
  return (edit.instance.empty() ? std::string() : edit.instance + ".") + to_string(edit.kind);
}

std::string instance_names(const Scene& scene) {
  std::vector<std::string> names;
  for (const Instance& instance : scene.instances()) names.push_back(instance.name);
  return listed(names, "\"");
}

/// An isosurface of its own, not that of a potential, which is felt where it is 0.
const IsoSurface* plain_iso(const Instance& instance) noexcept {
  return provider_of<IsoSurface>(instance.surface);
}

/// Changes an instance that has what the edit is of.
Status edit_instance(const SceneEdit& edit, Instance& instance) {
  Material& material = instance.material;
  switch (edit.kind) {
    case SceneEditKind::stiffness: material.stiffness = edit.value; break;
    case SceneEditKind::friction: material.static_friction = material.dynamic_friction = edit.value; break;
    case SceneEditKind::static_friction: material.static_friction = edit.value; break;
    case SceneEditKind::dynamic_friction: material.dynamic_friction = edit.value; break;
    case SceneEditKind::threshold: {
      ASPERITY_TRY(IsoSurface moved, plain_iso(instance)->moved_to(edit.value));
      instance.surface = std::make_shared<const IsoSurface>(std::move(moved));
      break;
    }
    case SceneEditKind::law: {
      ASPERITY_TRY(instance.law, law_by_name(edit.law));
      break;
    }
    case SceneEditKind::zoom: break;
  }
  return success();
}

Result<std::vector<Instance>> edited_instances(const Scene& scene, const SceneEdit& edit) {
  std::vector<Instance> instances(scene.instances().begin(), scene.instances().end());
  bool named = false;
  bool changed = false;
  for (Instance& instance : instances) {
    if (!edit.instance.empty() && instance.name != edit.instance) continue;
    named = true;
    if (edit.kind == SceneEditKind::threshold && plain_iso(instance) == nullptr) continue;
    ASPERITY_CHECK(edit_instance(edit, instance));
    changed = true;
  }
  if (changed) return instances;
  if (named) {
    return refused(ErrorCode::unsupported_pair, "is of an isosurface, and what is named is none", {},
                   "an isosurface of a volume");
  }
  return bad_value(fmt::format("there is no surface \"{}\"", edit.instance), {}, instance_names(scene));
}

Result<Scene> edited_at_once(const Scene& scene, const SceneEdit& edit) {
  SceneSettings settings = scene.settings();
  if (edit.kind != SceneEditKind::law && !std::isfinite(edit.value))
    return bad_value(fmt::format("is {}", edit.value), {}, "a finite number");
  std::vector<Instance> instances(scene.instances().begin(), scene.instances().end());
  if (edit.kind == SceneEditKind::zoom) {
    if (!edit.instance.empty()) return bad_value("is of the view, not of a surface", {}, "zoom alone");
    settings.view.zoom = edit.value;
  } else {
    ASPERITY_TRY(instances, edited_instances(scene, edit));
  }
  return Scene::build(std::move(instances), settings, {scene.effects().begin(), scene.effects().end()});
}

Dimension dimension_of(SceneEditKind kind) noexcept {
  return kind == SceneEditKind::stiffness ? Dimension::stiffness : Dimension::ratio;
}

}  // namespace

Result<Scene> edited(const Scene& scene, const SceneEdit& edit) {
  Result<Scene> next = edited_at_once(scene, edit);
  if (next) return next;
  Error error = std::move(next).error();
  error.place = error.place.empty() ? place_of_edit(edit) : place_of_edit(edit) + ": " + error.place;
  return error;
}

Result<SceneEdit> parse_scene_edit_text(std::string_view text) {
  const std::size_t equals = text.find('=');
  const std::string whole(text);
  if (equals == std::string_view::npos)
    return bad_value("changes nothing", whole, "stiffness=800, dragon.stiffness=0.5N/mm, zoom=2, law=proxy");
  const std::string_view left = text.substr(0, equals);
  const std::string_view right = text.substr(equals + 1);
  // A surface's name may have points in it.
  const std::size_t point = left.rfind('.');
  const std::string_view kind = point == std::string_view::npos ? left : left.substr(point + 1);
  const std::optional<SceneEditKind> known = value_named<SceneEditKind>(kind);
  if (!known) return bad_value(fmt::format("\"{}\" cannot be changed", kind), whole, name_list<SceneEditKind>());
  SceneEdit edit;
  edit.kind = *known;
  if (point != std::string_view::npos) edit.instance = left.substr(0, point);
  if (edit.kind == SceneEditKind::law) {
    edit.law = right;
    if (edit.law.empty()) return bad_value("names no law", whole, listed(law_names()));
    return edit;
  }
  // Of a threshold a share is one of the field's range, which is not known here.
  if (edit.kind == SceneEditKind::threshold && right.find('%') != std::string_view::npos)
    return bad_value("is a share", whole, "a number in the field's unit");
  Result<double> value = parse_quantity(right, dimension_of(edit.kind));
  if (!value) return std::move(value).error().at(whole);
  edit.value = *value;
  return edit;
}

}  // namespace asperity
