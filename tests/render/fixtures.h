#pragma once
// Scenes of one instance, and probes that touch them.

#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "asperity/render/step.h"
#include "tests/surface/coats.h"

namespace asperity::test {

inline constexpr double stiffness = 1000.0;  // N/m: 1 N/mm, as the papers' figures
inline constexpr Seconds tick{1e-3};

inline Scene scene_of(Surface surface, Law law, double k = stiffness, double probe_radius = 0.0) {
  Instance instance;
  instance.name = "test";
  instance.surface = std::move(surface);
  instance.law = std::move(law);
  instance.material.stiffness = k;
  std::vector<Instance> instances;
  instances.push_back(std::move(instance));
  return must(Scene::build(std::move(instances), probe_radius));
}

inline Law named(std::string_view name) { return must(law_by_name(name)); }

inline ProbeSample probe_at(const Vec3& position) {
  ProbeSample probe;
  probe.pose.position = position;
  return probe;
}

inline ForceSample touch(const Scene& scene, ProxyState& state, const Vec3& position) { return step(scene, state, probe_at(position), tick); }

/// One probe that comes from `outside` straight to `position`.
inline ForceSample poke(const Scene& scene, const Vec3& outside, const Vec3& position) {
  ProxyState state;
  touch(scene, state, outside);
  return touch(scene, state, position);
}

/// The forces (N) along a path, from one probe; it starts at `outside` unless that is nothing.
inline std::vector<Vec3> slide(const Scene& scene, std::span<const Vec3> path, std::optional<Vec3> outside = {}) {
  ProxyState state;
  std::vector<Vec3> forces;
  if (outside) touch(scene, state, *outside);
  for (const Vec3& position : path) forces.push_back(touch(scene, state, position).wrench.force);
  return forces;
}

/// `count` + 1 points from one end to the other.
inline std::vector<Vec3> line(const Vec3& from, const Vec3& to, int count) {
  std::vector<Vec3> path;
  for (int i = 0; i <= count; ++i) path.emplace_back(from + (static_cast<double>(i) / count) * (to - from));
  return path;
}

/// Largest change of force between neighbouring ticks (N).
inline double largest_jump(std::span<const Vec3> forces) {
  double largest = 0.0;
  for (std::size_t i = 1; i < forces.size(); ++i) largest = std::max(largest, (forces[i] - forces[i - 1]).norm());
  return largest;
}

/// Height along `axis` over `base` (m) at which a quasi-static probe, coming down from `above`, is pushed with `force` (N)
/// along the axis. Found on copies of the state by bisection of the height; the state is left at the answer.
inline double height_at_force(const Scene& scene, ProxyState& state, const Vec3& base, const Vec3& axis, double force, double above, double below) {
  ProxyState best = state;
  touch(scene, best, base + above * axis);
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (above + below);
    ProxyState trial = best;
    if (touch(scene, trial, base + middle * axis).wrench.force.dot(axis) > force) {
      below = middle;
    } else {
      above = middle;
    }
  }
  touch(scene, best, base + above * axis);
  state = best;
  return above;
}

}  // namespace asperity::test
