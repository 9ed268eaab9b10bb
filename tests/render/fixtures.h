#pragma once
// Scenes of one instance, and probes that touch them.

#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "asperity/render/law_registry.h"
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

inline Law named(std::string_view name) {
  return must(law_by_name(name));
}

/// Names of the laws that can be felt on a relief.
inline std::vector<std::string> relief_laws() {
  std::vector<std::string> names;
  for (const std::string& name : law_names()) {
    if (named(name).facts().needs < LawNeeds::field) names.push_back(name);
  }
  return names;
}

inline ProbeSample probe_at(const Vec3& position) {
  ProbeSample probe;
  probe.pose.position = position;
  return probe;
}

inline ForceSample touch(const Scene& scene, ProxyState& state, const Vec3& position) {
  return step(scene, state, probe_at(position), tick);
}

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

/// Height along `axis` over `base` (m) at which a quasi-static probe, coming down from `above`, is pushed with `force`
/// (N) along the axis. Found on copies of the state by bisection of the height; the state is left at the answer.
inline double height_at_force(const Scene& scene, ProxyState& state, const Vec3& base, const Vec3& axis, double force,
                              double above, double below) {
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

/// Work that the surface does on a hand led once around a closed path (J), by the trapezoid rule; above 0 it gives
/// energy.
inline double loop_work(const Scene& scene, std::span<const Vec3> loop, const Vec3& outside) {
  const std::vector<Vec3> forces = slide(scene, loop, outside);
  double work = 0.0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const std::size_t next = (i + 1) % loop.size();
    work += 0.5 * (forces[i] + forces[next]).dot(loop[next] - loop[i]);
  }
  return work;
}

/// Size of the vector area that a closed path encloses (m²).
inline double loop_area(std::span<const Vec3> loop) {
  Vec3 area = Vec3::Zero();
  for (std::size_t i = 0; i < loop.size(); ++i)
    area += 0.5 * (loop[i] - loop[0]).cross(loop[(i + 1) % loop.size()] - loop[0]);
  return area.norm();
}

/// A smooth closed path around `centre`: about `reach` (m) wide along x and y and `depth` (m) up and down.
inline std::vector<Vec3> random_loop(Rng& rng, const Vec3& centre, double reach, double depth, int count) {
  double part[6];
  double phase[6];
  for (int i = 0; i < 6; ++i) {
    part[i] = rng.uniform(0.05, 0.3);
    phase[i] = rng.uniform(0.0, 2.0 * std::numbers::pi);
  }
  std::vector<Vec3> loop;
  for (int i = 0; i < count; ++i) {
    const double a = 2.0 * std::numbers::pi * i / count;
    const double x =
        0.6 * std::cos(a) + part[0] * std::cos(2.0 * a + phase[0]) + part[1] * 0.3 * std::cos(3.0 * a + phase[1]);
    const double y =
        0.6 * std::sin(a) + part[2] * std::cos(2.0 * a + phase[2]) + part[3] * 0.3 * std::cos(3.0 * a + phase[3]);
    const double z = 0.6 * std::cos(a + phase[4]) + part[5] * std::cos(2.0 * a + phase[5]);
    loop.emplace_back(centre + Vec3(reach * x, reach * y, depth * z));
  }
  return loop;
}

/// The reference case of erratum 10: a cosine relief with a crest at x = 0, 0.5 mm high either way, 5 mm long, on a
/// plane, and a loop of 2.5 mm (crest to trough) x 1 mm (up and down) in its x-z plane.
inline HeightMap reference_relief(double middle) {
  return map_of(1024,
                [=](double s, double) { return middle + 0.5e-3 * std::cos(2.0 * std::numbers::pi * 4.0 * (s - 0.5)); });
}
inline std::shared_ptr<const ReliefSurface> reference_surface(double middle) {
  return coated(plane_grid(0.02, 0.02, 1, 1), reference_relief(middle), Mapping::uv, 0.02);
}
inline std::vector<Vec3> reference_loop(double lowest, int per_side = 1500) {
  const double width = 2.5e-3;
  const double height = 1e-3;
  const Vec3 corners[] = {
      {0.0, 1e-3, lowest}, {0.0, 1e-3, lowest + height}, {width, 1e-3, lowest + height}, {width, 1e-3, lowest}};
  std::vector<Vec3> loop;
  for (int side = 0; side < 4; ++side) {
    const Vec3 from = corners[side];
    const Vec3 to = corners[(side + 1) % 4];
    for (int i = 0; i < per_side; ++i) loop.emplace_back(from + (static_cast<double>(i) / per_side) * (to - from));
  }
  return loop;
}

/// Minus the gradient of k penetration^2 / 2 at `position` (N), by central differences on probes that come straight
/// from `outside`.
inline Vec3 potential_force(const Scene& scene, const Vec3& outside, const Vec3& position, double h = 1e-7) {
  const auto energy = [&](const Vec3& p) {
    const double penetration = poke(scene, outside, p).contact.penetration;
    return 0.5 * stiffness * penetration * penetration;
  };
  Vec3 force;
  for (int k = 0; k < 3; ++k)
    force[k] = -(energy(position + h * Vec3::Unit(k)) - energy(position - h * Vec3::Unit(k))) / (2.0 * h);
  return force;
}

/// Two squares of `side` that meet at the y axis in a roof, bent down by `fold` in all; each cut into two triangles.
inline MeshSource roof(double fold, double side) {
  const double x = side * std::cos(0.5 * fold);
  const double z = -side * std::sin(0.5 * fold);
  const double y = 0.5 * side;
  MeshSource source;
  source.positions = {{-x, -y, z}, {0.0, -y, 0.0}, {x, -y, z}, {-x, y, z}, {0.0, y, 0.0}, {x, y, z}};
  source.triangles = {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}};
  const double s = 0.5;
  const auto uv = [&](std::uint32_t i) { return Vec2f(static_cast<float>(s * (i % 3)), i < 3 ? 0.0F : 1.0F); };
  for (const auto& t : source.triangles) source.corner_uvs.push_back({uv(t[0]), uv(t[1]), uv(t[2])});
  return source;
}

}  // namespace asperity::test
