#include "asperity/io/experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "asperity/io/detail/scene_fine.h"

namespace asperity {
namespace {

constexpr int format_version = 1;

Result<std::string> read_text(const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    return refused_file(ErrorCode::file_missing, "is a folder", file.string(), "a scene file (JSON)");
  }
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    return refused_file(ErrorCode::file_missing, "cannot be read: no such file, or no permission", file.string(),
                        "a scene file (JSON)");
  }
  return std::string{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/// Bounds of the base meshes in the world frame: what strokes are laid over and shares refer to.
Box base_bounds(std::span<const Instance> instances) {
  Box bounds;
  for (const Instance& instance : instances) {
    const MeshSurface* base = base_of(instance.surface);
    const IsoSurface* iso = iso_of(instance.surface);
    const Box local = base != nullptr  ? base->bounds()
                      : iso != nullptr ? iso->surface_bounds()
                                       : surface_bounds(instance.surface);
    bounds.include(transformed(local, instance.world_from_object));
  }
  return bounds;
}

/// The nearest point of what carries a surface, its base mesh or the isosurface, with its outward normal. A volume in
/// bricks is asked on its coarsest level, the one that is always in memory.
SurfacePoint nearest_on(const Surface& surface, const Vec3& p, SurfaceCache& cache, double& distance) {
  SurfacePoint nearest{p, Vec3::Zero()};
  const auto ask = [&](const auto& view) {
    const Foot foot = view.nearest(p, infinity);
    distance = foot.distance;
    if (foot.found()) nearest = {foot.point, view.front(foot)};
  };
  if (const ParametricSurface* parametric = parametric_of(surface)) {
    ask(parametric->view());
  } else if (const CustomSurface* custom = custom_of(surface)) {
    ask(custom->view());
  } else if (const MeshSurface* base = base_of(surface)) {
    ask(base->view(cache));
  } else {
    const IsoSurface& iso = *iso_of(surface);
    iso.field().enter();
    ask(iso.view(cache.cells, iso.field().levels() - 1, iso.threshold()));
    iso.field().leave();
  }
  return nearest;
}

/// What carries a surface's features: a stroke runs along it, and not up and down with them.
Surface carrier_of(const Surface& surface) {
  const ParametricSurface* parametric = parametric_of(surface);
  if (parametric == nullptr || parametric->settings().features.empty()) return surface;
  ParametricSettings bare = parametric->settings();
  bare.features.clear();
  Result<ParametricSurface> carrier = ParametricSurface::build(bare);
  return carrier ? Surface(std::make_shared<const ParametricSurface>(std::move(*carrier))) : surface;
}

/// What the hand can reach of the scene's bounds: strokes are laid in the workspace.
Box in_workspace(const View& view, const Box& bounds) {
  if (view.identity()) return bounds;
  return bounds.mapped([&](const Vec3& corner) { return view.to_workspace(corner); });
}

/// A stroke as it runs through the scene.
StrokePath in_scene(const View& view, const StrokePath& path) {
  return view.identity() ? path
                         : path.mapped([&](const Vec3& p) { return view.to_scene(p); },
                                       [&](const Vec3& n) { return Vec3(view.orientation * n); });
}

/// Says what asks for levels of detail that no coat has, and what of them is never used.
void note_detail(std::span<const Instance> instances, const SceneSettings& settings, SceneContext& context) {
  bool dilation = false;
  bool low_pass = false;
  for (const Instance& instance : instances) {
    const ReliefSurface* relief = relief_of(instance);
    if (relief == nullptr || relief->coat().levels() == 0) continue;
    const bool ball = relief->coat().maps().detail()->kind() == DetailKind::dilation;
    dilation = dilation || ball;
    low_pass = low_pass || !ball;
    if (ball && settings.tip_radius == 0.0 && settings.view.camera.pixels == 0)
      context.note(
          fmt::format("surface \"{}\": its levels of detail are those of a ball, and probe.tip is 0: the finest "
                      "one is felt throughout",
                      instance.name));
  }
  if (settings.tip_radius > 0.0 && !dilation)
    context.note("probe.tip: no coat has levels of detail by dilation (\"detail\": \"dilation\"), so a point is felt");
  if (settings.view.camera.pixels > 0 && !dilation && !low_pass)
    context.note(
        "view.camera: no coat has levels of detail (\"detail\"), so what is too small to be seen is felt all the same");
}

/// The nearest point of all surfaces, in the workspace.
SurfaceProjector projector(const Scene& scene) {
  std::vector<Surface> carriers;
  for (const Instance& instance : scene.instances()) carriers.push_back(carrier_of(instance.surface));
  return [&scene, carriers = std::move(carriers),
          caches = std::vector<SurfaceCache>(scene.instances().size())](const Vec3& hand) mutable {
    const View& view = scene.settings().view;
    const Vec3 p = view.identity() ? hand : view.to_scene(hand);
    SurfacePoint best{p, Vec3::Zero()};
    double nearest = infinity;
    for (std::size_t i = 0; i < scene.instances().size(); ++i) {
      const Instance& instance = scene.instances()[i];
      double distance = infinity;
      const SurfacePoint found =
          nearest_on(carriers[i], instance.world_from_object.apply_inverse(p), caches[i], distance);
      if (!(distance < nearest)) continue;
      nearest = distance;
      best.point = instance.world_from_object.apply(found.point);
      best.normal = instance.world_from_object.rotate(found.normal).normalized();
    }
    if (!view.identity()) {
      best.point = view.to_workspace(best.point);
      best.normal = view.orientation.conjugate() * best.normal;
    }
    return best;
  };
}

bool says_radius(const SceneJson* probe) {
  return probe != nullptr && probe->contains("radius");
}

/// The probe's radius ahead of the probe, whose defaults depend on the surfaces.
double probe_radius_of(const SceneJson* probe) {
  return says_radius(probe) ? from_option<double>(value_of((*probe)["radius"], OptionType::quantity(Dimension::length)))
                            : default_probe_radius;
}

/// A ball where all of the scene can be felt by one, else a point; says which. `settings`: the scene's, but for it.
double default_radius(std::span<const Instance> instances, SceneSettings settings, SceneContext& context) {
  if (instances.empty()) return 0.0;
  settings.probe_radius = default_probe_radius;
  const std::string chosen = "(probe.radius or --probe-radius chooses otherwise)";
  if (settings.tip_radius > 0.0) {
    context.note("probe: a point, which follows the path of probe.tip " + chosen);
    return 0.0;
  }
  for (const Instance& instance : instances) {
    const Status taken = takes_ball(instance, settings);
    if (taken) continue;
    const Error& error = taken.error();
    context.note(fmt::format("probe: a point, because of \"{}\": {}{}", instance.name,
                             error.place == "probe.radius" ? "a radius that " : "", error.what));
    return 0.0;
  }
  context.note(fmt::format("probe: a ball of {} {}; 0 is a point", format_length(settings.probe_radius), chosen));
  return settings.probe_radius;
}

Result<std::vector<Instance>> read_surfaces(ObjectReader& root, SceneContext& context, SceneJson& canonical) {
  const SceneJson* surfaces = root.raw("surfaces");
  canonical = SceneJson::array();
  if (surfaces == nullptr) return std::vector<Instance>{};
  std::vector<Instance> instances;
  for (std::size_t i = 0; i < surfaces->size(); ++i) {
    ASPERITY_TRY(ScenePart<Instance> part, read_surface((*surfaces)[i], fmt::format("surfaces[{}]", i), context));
    instances.push_back(std::move(part.value));
    canonical.push_back(std::move(part.canonical));
  }
  return instances;
}

/// World bounds of the volumes that are felt without a surface.
Box effect_bounds(std::span<const FieldEffect> effects) {
  Box bounds;
  for (const FieldEffect& effect : effects)
    bounds.include(transformed(effect.field->bounds(), effect.world_from_object));
  return bounds;
}

/// Where there is no surface a stroke stays where it is drawn; depth counts downwards from there.
SurfaceProjector drawn_as_it_is() {
  return [](const Vec3& p) { return SurfacePoint{p, Vec3::UnitY()}; };
}

/// Ahead of the structure, which a newer format may have another of.
Status check_version(const SceneJson& json) {
  const bool given = json.is_object() && json.contains("asperity") && json["asperity"].is_number_integer();
  if (!given || json["asperity"] == format_version || json["asperity"] < format_version) return success();
  return refused(ErrorCode::file_unsupported,
                 fmt::format("is {}, a newer format than this program reads", json["asperity"].dump()), "asperity",
                 fmt::format("{}", format_version));
}

std::string read_heading(ObjectReader& root, const std::string& fallback) {
  root.get<int>("asperity");
  const std::string name = root.get("name", fallback);
  root.find<std::string>("summary");
  root.find<std::string>("$schema");
  return name;
}

/// How the scene is touched and seen; the probe's radius where it is not said.
Result<SceneSettings> read_settings(ObjectReader& root, std::span<const Instance> instances, const Box& bounds,
                                    ScenePart<ProbeSettings>& probe, SceneContext& context) {
  SceneSettings settings;
  settings.tip_radius = probe.value.tip;
  settings.tool_length = probe.value.tool_length;
  settings.tool_axis = probe.value.tool_axis;
  ASPERITY_TRY(settings.view, read_view(root, bounds));
  ASPERITY_CHECK(read_change(root, settings));
  if (!says_radius(root.raw("probe"))) {
    probe.value.radius = default_radius(instances, settings, context);
    probe.canonical["radius"] = probe.value.radius;
  }
  settings.probe_radius = probe.value.radius;
  settings.budget = static_cast<std::uint32_t>(
      root.get("budget", static_cast<int>(SceneSettings::budget_for(settings.probe_radius))));
  return settings;
}

Result<Experiment> build_experiment(const SceneJson& json, const std::filesystem::path& folder,
                                    const std::string& fallback_name, const Progress& progress) {
  ASPERITY_CHECK(check_version(json));
  ObjectReader root(json, "", "scene");
  ASPERITY_CHECK(root.status());
  const std::string name = read_heading(root, fallback_name);
  const auto whole = [&](const char* key) {
    return root.has(key) ? *root.raw(key) : json_of(scene_object("scene").row(key, json)->fallback);
  };
  ASPERITY_TRY(ScenePart<DeviceProfile> device, read_device(whole("device"), "device"));
  ASPERITY_TRY(ScenePart<HandImpedance> hand, read_hand(whole("hand"), "hand"));
  SceneContext context{folder, device.value, progress, {}, {}, probe_radius_of(root.raw("probe"))};
  SceneJson surfaces;
  SceneJson effects_json;
  ASPERITY_TRY(std::vector<FieldEffect> effects, read_effects(root, context, effects_json));
  const bool felt_alone = !effects.empty();
  ASPERITY_TRY(std::vector<Instance> instances, read_surfaces(root, context, surfaces));
  const bool bodiless = instances.empty();
  const double stiffness =
      bodiless ? std::min(1000.0, device.value.max_stiffness) : instances.front().material.stiffness;
  ASPERITY_TRY(ScenePart<ProbeSettings> probe, read_probe(root.raw("probe"), "probe", device.value, stiffness));
  const Box bounds = bodiless ? effect_bounds(effects) : base_bounds(instances);
  ASPERITY_TRY(const SceneSettings settings, read_settings(root, instances, bounds, probe, context));
  note_detail(instances, settings, context);
  ASPERITY_TRY(ScenePart<StrokeSettings> stroke,
               read_stroke(root.raw("stroke"), "stroke", in_workspace(settings.view, bounds), context));
  stroke.value.probe_radius = bodiless ? 0.0 : settings.probe_radius;
  const SceneJson* stroke_json = root.raw("stroke");
  const auto says = [&](const char* key) { return stroke_json != nullptr && stroke_json->contains(key); };
  if (bodiless && !says("depth") && !says("normal_force") && !says("path")) {
    // Half way down from the top, through the middle of the volume.
    stroke.value.depth = 0.5 * bounds.extent().y();
    stroke.canonical["depth"] = stroke.value.depth;
  }
  ASPERITY_TRY(Scene scene, Scene::build(std::move(instances), settings, std::move(effects)));
  if (progress) progress("laying the stroke", 0.0);
  const bool placed = stroke.value.type != StrokeType::line || says("start") || says("end");
  const SurfaceProjector project = bodiless ? drawn_as_it_is() : projector(scene);
  ASPERITY_TRY(StrokePath path,
               at_place(bodiless || placed ? build_stroke(stroke.value, project)
                                           : lay_default_stroke(scene, probe.value, in_workspace(settings.view, bounds),
                                                                project, stroke, context),
                        "stroke"));
  for (const Instance& instance : scene.instances())
    note_rendering(instance, in_scene(scene.settings().view, path), stroke.value.speed / scene.settings().view.zoom,
                   probe.value.rate, context);

  root.write("device", std::move(device.canonical));
  root.write("hand", std::move(hand.canonical));
  root.write("probe", std::move(probe.canonical));
  if (!bodiless) root.write("surfaces", std::move(surfaces));
  if (felt_alone) root.write("effects", std::move(effects_json));
  root.write("stroke", std::move(stroke.canonical));
  Experiment experiment{name,
                        std::move(scene),
                        probe.value.dynamic ? ProbeKind::dynamic : ProbeKind::ideal,
                        device.value,
                        hand.value,
                        probe.value.ideal,
                        probe.value.simulated,
                        probe.value.rate,
                        std::move(stroke.value),
                        std::move(path),
                        std::move(context.notes),
                        root.canonical().dump(2, ' ', false, SceneJson::error_handler_t::replace)};
  return experiment;
}

}  // namespace

Result<Experiment> read_experiment(const std::filesystem::path& file, const Progress& progress) {
  ASPERITY_TRY(const std::string text, read_text(file));
  return parse_experiment(text, file.parent_path(), file.string(), progress);
}

Result<Experiment> parse_experiment(std::string_view json, const std::filesystem::path& folder, const std::string& name,
                                    const Progress& progress) {
  try {
    ASPERITY_TRY(const SceneJson parsed, parse_scene_json(json, name));
    return in_file(build_experiment(parsed, folder, std::filesystem::path(name).stem().string(), progress), name);
  } catch (const std::bad_alloc&) {
    return refused_file(ErrorCode::too_large, "needs more memory than there is", name, "a smaller scene");
  } catch (const std::exception& failure) {
    return refused_file(ErrorCode::bad_value, std::string("cannot be used: ") + failure.what(), name);
  }
}

Result<Experiment> with_law(const Experiment& experiment, const Law& law) {
  try {
    std::vector<Instance> instances(experiment.scene.instances().begin(), experiment.scene.instances().end());
    for (Instance& instance : instances) instance.law = law;
    std::vector<FieldEffect> effects(experiment.scene.effects().begin(), experiment.scene.effects().end());
    ASPERITY_TRY(Scene scene, Scene::build(std::move(instances), experiment.scene.settings(), std::move(effects)));
    Experiment changed = experiment;
    changed.scene = std::move(scene);
    SceneJson json = SceneJson::parse(experiment.canonical_json);
    if (json.contains("surfaces")) {
      for (SceneJson& surface : json["surfaces"]) surface["law"] = law_json(law);
    }
    changed.canonical_json = json.dump(2, ' ', false, SceneJson::error_handler_t::replace);
    return changed;
  } catch (const std::exception& failure) {
    return bad_value(std::string("cannot be felt by another law: ") + failure.what(), "", "");
  }
}

}  // namespace asperity
