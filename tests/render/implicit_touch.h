#pragma once
// Laws that are felt on implicit surfaces, tick by tick.

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "asperity/render/laws.h"
#include "asperity/render/step.h"
#include "tests/field/sparse_grids.h"
#include "tests/render/asked_law.h"
#include "tests/render/fixtures.h"

namespace asperity::implicit {

inline std::shared_ptr<const ImplicitSurface> surface_of(std::shared_ptr<const SparseGrid> grid,
                                                         CellReconstruction reconstruction = CellReconstruction::smooth,
                                                         double offset = 0.0) {
  ImplicitParts parts;
  parts.grid = std::move(grid);
  parts.reconstruction = reconstruction;
  parts.offset = offset;
  return std::make_shared<const ImplicitSurface>(test::must(ImplicitSurface::build(std::move(parts))));
}

/// As if nothing had been felt yet.
inline void forget(Contact& state) {
  state = {};
}

/// A probe and the law that it feels a surface by.
template <class L>
struct Touch {
  std::shared_ptr<const ImplicitSurface> surface;
  L law;
  Material material{};
  Seconds dt{1e-3};
  Contact state{};
  SurfaceCache cache{};

  LawForce at(const Vec3& p, const Vec3& velocity = Vec3::Zero()) {
    return test::asked(law, surface, std::monostate(), material, p, velocity, dt, state, cache);
  }
};
using PointTouch = Touch<VirtualContactPointLaw>;
using MagnetTouch = Touch<MagneticLaw>;

/// From a ball up along y to where its torque is told about (m).
inline constexpr double tool_length = 0.1;

/// The same through whole ticks, which pay for what the law gives.
struct WholeTouch {
  Scene scene;
  ProxyState state{};

  /// By a ball of `radius` (m), whose middle is led; 0: a point.
  template <class L>
  explicit WholeTouch(const Touch<L>& touch, double radius = 0.0) : scene(scene_of(touch, radius)) {}

  struct Felt {
    Vec3 force;
    Vec3 torque;
    Vec3 point;
    bool contact;
  };
  Felt at(const Vec3& p) {
    ProbeSample probe;
    probe.pose.position = p;
    const ForceSample tick = step(scene, state, probe, Seconds(1e-3));
    return {tick.wrench.force, tick.wrench.torque, tick.contact.point, tick.flags.has(TickFlag::contact)};
  }

 private:
  template <class L>
  static Scene scene_of(const Touch<L>& touch, double radius) {
    Instance instance;
    instance.name = "implicit";
    instance.surface = touch.surface;
    instance.law = touch.law;
    instance.material = touch.material;
    SceneSettings settings;
    settings.probe_radius = radius;
    settings.tool_length = radius > 0.0 ? tool_length : 0.0;
    return test::must(Scene::build({instance}, settings));
  }
};

inline Vec3 far_outside() {
  return Vec3(0.0, 0.0, 1.0);
}

/// Forces (N) along a path, after having been far outside.
template <class T>
std::vector<Vec3> forces_along(T& touch, std::span<const Vec3> path) {
  touch.at(far_outside());
  std::vector<Vec3> forces;
  for (const Vec3& p : path) forces.push_back(touch.at(p).force);
  return forces;
}

/// Work on a hand that is led once around a closed path (J), trapezoid rule; from its highest point on, which is to be
/// outside.
template <class T>
double loop_work(T& touch, std::vector<Vec3> loop) {
  const auto lower = [](const Vec3& a, const Vec3& b) { return a.z() < b.z(); };
  std::rotate(loop.begin(), std::max_element(loop.begin(), loop.end(), lower), loop.end());
  const std::vector<Vec3> forces = forces_along(touch, loop);
  double work = 0.0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const std::size_t next = (i + 1) % loop.size();
    work += 0.5 * (forces[i] + forces[next]).dot(loop[next] - loop[i]);
  }
  return work;
}

/// Largest change of force between neighbouring places of a straight way (N).
template <class L>
double largest_jump_on(Touch<L> touch, const Vec3& from, const Vec3& to, double step) {
  const int count = static_cast<int>(std::ceil((to - from).norm() / step));
  return test::largest_jump(forces_along(touch, test::line(from, to, count)));
}

/// Angle between two directions (degrees).
inline double angle_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi;
}

}  // namespace asperity::implicit
