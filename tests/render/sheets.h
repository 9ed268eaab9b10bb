#pragma once
// Sheets in coats that change, and probes that press on them.

#include <memory>
#include <utility>
#include <vector>

#include "asperity/field/height/detail_pyramid.h"
#include "tests/render/fixtures.h"
#include "tests/surface/reliefs.h"

namespace asperity::test {

inline constexpr double depth = 1e-3;  // m

/// A mesh of the plane z = 0, laid flat: its front is up, +y.
inline TriangleMesh laid_flat(MeshSource source) {
  for (Vec3& p : source.positions) p = Vec3(p.x(), p.z(), -p.y());
  return mesh_of(std::move(source));
}

inline MeshSurface sheet(double side = 0.04) {
  return MeshSurface(TriangleIndex::build(laid_flat(plane_grid(side, side, 8, 8))));
}

inline Coat coat_of(const MeshSurface& base, std::shared_ptr<const Mesostructure> maps,
                    std::vector<CoatLayer> layers = {}, std::shared_ptr<const MaterialMaps> materials = nullptr) {
  CoatParts parts;
  parts.maps.push_back(std::move(maps));
  parts.layers = std::move(layers);
  parts.materials = std::move(materials);
  CoatSettings settings;
  settings.mapping = Mapping::triplanar;
  return must(Coat::build(base.mesh(), std::move(parts), settings));
}

inline Surface relief(const MeshSurface& base, Coat coat) {
  return std::make_shared<const ReliefSurface>(base, std::move(coat));
}

inline Surface flat_relief(const MeshSurface& base, double height) {
  return relief(base, coat_of(base, tiled(flat_map(height), 0.01)));
}

inline Scene scene_with(Surface surface, const SceneSettings& settings = {}, Law law = ProxyLaw{}, Motion motion = {}) {
  Instance instance;
  instance.name = "test";
  instance.surface = std::move(surface);
  instance.law = std::move(law);
  instance.material.stiffness = stiffness;
  instance.motion = motion;
  return must(Scene::build({instance}, settings));
}

inline ForceSample at_time(const Scene& scene, ProxyState& state, const Vec3& position, double time) {
  ProbeSample probe = probe_at(position);
  probe.time = Seconds(time);
  return step(scene, state, probe, tick);
}

/// Brings a probe from above to `place`, `depth` below the height there.
inline ForceSample press(const Scene& scene, ProxyState& state, const Vec3& place, double height) {
  ForceSample sample;
  for (int i = 0; i <= 20; ++i) sample = touch(scene, state, place + Vec3(0.0, height + depth - 0.1 * i * depth, 0.0));
  return sample;
}

}  // namespace asperity::test
