#pragma once
// Runs whose numbers are known beforehand.

#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <vector>

#include "asperity/core/trace_record.h"
#include "asperity/device/stroke.h"
#include "asperity/field/mesostructure/generators.h"
#include "asperity/geometry/generators.h"
#include "asperity/render/scene.h"
#include "asperity/render/step.h"

namespace asperity::synthetic {

inline constexpr double tick = 1e-3;  // s

/// 60 mm x 60 mm in z = 0, facing +z.
inline MeshSurface sheet() {
  return MeshSurface(TriangleIndex::build(TriangleMesh::build(plane_grid(0.06, 0.06, 2, 2)).value()));
}

inline Scene scene_of(Surface surface, Law law = GodObjectLaw{}) {
  std::vector<Instance> instances(1);
  instances[0].name = "sheet";
  instances[0].surface = std::move(surface);
  instances[0].law = law;
  return Scene::build(std::move(instances), 0.0).value();
}

inline Scene bare_scene() {
  return scene_of(std::make_shared<const MeshSurface>(sheet()));
}

/// The sheet with one map over all of it.
inline Scene relief_scene(const MesostructureSpec& spec, Law law,
                          Reconstruction reconstruction = Reconstruction::bilinear) {
  MeshSurface base = sheet();
  HeightMap heights = generate_height_map(spec, Wrap::repeat, reconstruction).value();
  auto maps = std::make_shared<const Mesostructure>(Mesostructure::build(std::move(heights), Vec2(0.06, 0.06)).value());
  Coat coat = Coat::build(base.mesh(), maps, CoatSettings{}).value();
  return scene_of(std::make_shared<const ReliefSurface>(std::move(base), std::move(coat)), law);
}

inline SurfacePoint on_sheet(const Vec3& p) {
  return {Vec3(p.x(), p.y(), 0.0), Vec3::UnitZ()};
}

/// Straight along x through the middle, 40 mm at 20 mm/s, 1 mm deep.
inline StrokePath line_path() {
  StrokeSettings settings;
  settings.start = Vec3(-0.02, 0.003, 0.0);
  settings.end = Vec3(0.02, 0.003, 0.0);
  return build_stroke(settings, on_sheet).value();
}

/// Circles of 10 mm radius in z = 0.
inline StrokePath circle_path(int turns) {
  StrokeSettings settings;
  settings.type = StrokeType::circle;
  settings.axis = Vec3::UnitZ();
  settings.radius = 0.01;
  settings.repeats = turns;
  return build_stroke(settings, on_sheet).value();
}

/// A tick for each period of the path with the probe exactly on it, and a force that is a function of place and time.
/// In contact during the stroke's contact phase.
inline std::vector<TraceRecord> records_along(const StrokePath& path,
                                              const std::function<Vec3(const Vec3&, double)>& force) {
  std::vector<TraceRecord> records;
  for (double t = 0.0; t <= path.duration().count(); t = tick * static_cast<double>(records.size())) {
    const StrokePose pose = path.pose(Seconds(t));
    TraceRecord record;
    record.tick = records.size();
    record.dt = Seconds(tick);
    record.probe.time = Seconds(t);
    record.probe.pose.position = pose.target;
    record.rendered.proxy = pose.point;
    record.hand = pose.target;
    if (pose.phase == StrokePhase::contact) {
      record.rendered.flags.set(TickFlag::contact);
      record.rendered.contact.count = 1;
      record.rendered.contact.instance = 0;
      record.rendered.wrench.force = record.commanded = force(pose.target, t);
    }
    records.push_back(record);
  }
  return records;
}

/// What `step` answers along the path.
inline std::vector<TraceRecord> rendered_along(const StrokePath& path, const Scene& scene) {
  std::vector<TraceRecord> records = records_along(path, [](const Vec3&, double) { return Vec3(Vec3::Zero()); });
  ProxyState state;
  ProxyCache cache;
  for (TraceRecord& record : records) {
    record.rendered = step(scene, state, cache, record.probe, record.dt);
    record.commanded = record.rendered.wrench.force;
  }
  return records;
}

}  // namespace asperity::synthetic
