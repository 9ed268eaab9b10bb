// Where a stroke is laid of which a scene does not say where.

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "asperity/io/detail/scene_reader.h"
#include "asperity/render/step.h"

namespace asperity {
namespace {

/// A stroke over one side of the bounds, and how much of it is in contact.
struct LaidSide {
  StrokeSettings settings;
  StrokePath path;
  std::string name;   ///< "+y"
  double felt = 0.0;  ///< share of the contact phase, 0 to 1
};

/// Share of the contact phase in which the scene is touched, tick by tick as in a run of the ideal probe: whether a
/// motion that comes in over a volume's border meets a surface there depends on where its ticks lie. Stops at `enough`.
Result<double> felt_share(const Scene& scene, const StrokePath& path, const ProbeSettings& probe, double enough) {
  ASPERITY_TRY(IdealProbe hand, IdealProbe::build(path, probe.ideal));
  const Seconds dt(1.0 / probe.rate);
  const double all = (path.contact_end() - path.contact_begin()) / dt;
  ProxyState state;
  ProxyCache cache(scene);
  double contact = 0.0;
  while (!hand.finished() && contact < enough * all) {
    const ProbeSample sample = hand.read();
    ASPERITY_CHECK(fetch_volumes(scene, state, sample));
    const ForceSample force = step(scene, state, cache, sample, dt);
    const bool over = path.pose(sample.time).phase == StrokePhase::contact;
    contact += over && force.flags.has(TickFlag::contact) ? 1.0 : 0.0;
    hand.apply(force.wrench.force, dt);
  }
  return all > 0.0 ? std::min(1.0, contact / all) : 0.0;
}

/// The same line over another side: through its middle, along `along`, 40 % of it.
StrokeSettings over_side(StrokeSettings settings, const Box& bounds, int across, bool upper, int along) {
  Vec3 middle = bounds.centre();
  middle[across] = upper ? bounds.upper[across] : bounds.lower[across];
  const double half = 0.2 * bounds.extent()[along];
  settings.start = middle - half * Vec3::Unit(along);
  settings.end = middle + half * Vec3::Unit(along);
  return settings;
}

/// What of it is worth: as long as it was drawn and in contact throughout is 1. Where a surface turns away from the
/// line, what is laid on it is a corner, or a way round.
double worth(const LaidSide& side) {
  const double drawn = (side.settings.end - side.settings.start).norm();
  const double laid = side.path.length();
  return drawn > 0.0 && laid > 0.0 ? side.felt * std::min(drawn / laid, laid / drawn) : 0.0;
}

/// The scene touched with a point: where a stroke is laid does not hang on how large the probe is, and takes no longer.
Result<Scene> touched_by_point(const Scene& scene) {
  if (scene.probe_radius() == 0.0) return scene;
  SceneSettings settings = scene.settings();
  settings.probe_radius = 0.0;
  const auto instances = scene.instances();
  const auto effects = scene.effects();
  return Scene::build({instances.begin(), instances.end()}, settings, {effects.begin(), effects.end()});
}

}  // namespace

Result<StrokePath> lay_default_stroke(const Scene& scene, const ProbeSettings& probe, const Box& bounds,
                                      const SurfaceProjector& project, ScenePart<StrokeSettings>& stroke,
                                      SceneContext& context) {
  // Less is a stroke that goes by.
  constexpr double enough = 0.25;
  // Of a side that is tried: a stroke has 2000, each of them a search for the nearest point.
  constexpr double trial_samples = 64.0;
  ASPERITY_TRY(const Scene by_point, touched_by_point(scene));
  StrokeSettings of_point = stroke.value;
  of_point.probe_radius = 0.0;
  LaidSide best{of_point, {}, {}, 0.0};
  Result<StrokePath> first = build_stroke(stroke.value, project);
  if (first) {
    ASPERITY_TRY(best.path, build_stroke(of_point, project));
    ASPERITY_TRY(best.felt, felt_share(by_point, best.path, probe, enough));
    if (best.felt >= enough) return first;
  }
  const double asked = best.felt;
  constexpr std::array<const char*, 6> names{"-x", "+x", "-y", "+y", "-z", "+z"};
  for (int side = 0; side < 6; ++side) {
    const int across = side / 2;
    for (const int along : {(across + 1) % 3, (across + 2) % 3}) {
      LaidSide other{
          over_side(of_point, bounds, across, side % 2 == 1, along), {}, names[static_cast<std::size_t>(side)]};
      StrokeSettings trial = other.settings;
      trial.sample_spacing = (trial.end - trial.start).norm() / trial_samples;
      Result<StrokePath> path = build_stroke(trial, project);
      if (!path) continue;
      other.path = std::move(*path);
      ASPERITY_TRY(other.felt, felt_share(by_point, other.path, probe, 1.0));
      if (worth(other) > worth(best)) best = std::move(other);
    }
  }
  if (best.name.empty()) {
    if (first && best.felt == 0.0)
      context.note("stroke: meets nothing over any side of what there is (\"start\" and \"end\" lay it elsewhere)");
    return first;
  }
  context.note(
      fmt::format("stroke: where it is laid by default it meets {}: laid over the side {} of what there is, in "
                  "contact for {:.0f} % of its way (\"start\" and \"end\" choose otherwise)",
                  asked > 0.0 ? fmt::format("the surface for {:.0f} % of its way", 100.0 * asked) : "nothing",
                  best.name, 100.0 * best.felt));
  best.settings.probe_radius = stroke.value.probe_radius;
  Result<StrokePath> laid = build_stroke(best.settings, project);
  stroke.value = std::move(best.settings);
  for (const auto& [key, at] : {std::pair("start", stroke.value.start), std::pair("end", stroke.value.end)})
    stroke.canonical[key] = {at.x(), at.y(), at.z()};
  return laid;
}

}  // namespace asperity
