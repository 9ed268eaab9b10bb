#pragma once
// Instances with texture and friction of their own.

#include <numbers>
#include <utility>

#include "tests/render/fixtures.h"

namespace asperity::test {

inline SurfaceFeature grating(double amplitude, double wavelength, double direction = 0.0) {
  FeatureSpec spec;
  spec.kind = FeatureKind::grating;
  spec.amplitude = amplitude;
  spec.wavelength = {wavelength, 0.0};
  spec.direction = direction;
  return must(SurfaceFeature::build(spec));
}

/// By a plane through the origin along z.
inline FineSettings fine_settings(std::vector<SurfaceFeature> texture,
                                  Formulation formulation = Formulation::consistent,
                                  const FeatureMappingSettings& mapping = {}) {
  FineSettings settings;
  settings.mapping = must(FeatureMapping::build(mapping));
  settings.texture = std::move(texture);
  settings.formulation = formulation;
  return settings;
}

inline std::shared_ptr<const FineFeatures> fine(FineSettings settings) {
  return std::make_shared<const FineFeatures>(must(FineFeatures::build(std::move(settings))));
}

inline Instance instance_of(Surface surface, Law law = ProxyLaw{}) {
  Instance instance;
  instance.name = "test";
  instance.surface = std::move(surface);
  instance.law = std::move(law);
  instance.material.stiffness = stiffness;
  return instance;
}

inline Scene scene_with(Instance instance, double probe_radius = 0.0) {
  std::vector<Instance> instances;
  instances.push_back(std::move(instance));
  return must(Scene::build(std::move(instances), probe_radius));
}

/// A square of 100 mm in z = 0.
inline std::shared_ptr<const MeshSurface> flat_square() {
  return bare(plane_grid(0.1, 0.1, 4, 4));
}

/// One probe along a path at an even speed, its velocity told as it is.
inline std::vector<ForceSample> stroke(const Scene& scene, std::span<const Vec3> path, Seconds dt = tick) {
  ProxyState state;
  std::vector<ForceSample> samples;
  Vec3 before = path.front();
  for (const Vec3& position : path) {
    ProbeSample probe = probe_at(position);
    probe.twist.linear = (position - before) / dt.count();
    samples.push_back(step(scene, state, probe, dt));
    before = position;
  }
  return samples;
}

}  // namespace asperity::test
