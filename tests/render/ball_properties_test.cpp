// T1, T2, T5 and T7 (formulation D8) for a probe with a radius, on every kind of surface that leads one.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "asperity/surface/relief/closing.h"
#include "tests/field/volumes.h"
#include "tests/render/fixtures.h"
#include "tests/surface/folded.h"
#include "tests/surface/reliefs.h"

namespace asperity::test::ball_properties_test {
namespace {

/// Something with a wavy upper side near the origin, which z points out of.
struct Ground {
  std::string name;
  Surface surface;
};

std::shared_ptr<const ReliefSurface> wavy(MeshSource source, double amplitude, double tile) {
  return relief_on(mesh_of(std::move(source)), {tiled(wavy_map(amplitude, 32), tile)},
                   CoatSettings{Mapping::triplanar, Vec2::Ones(), {}});
}

double wave(double x, double y) {
  return 3e-4 * std::sin(x / 1.6e-3) * std::cos(y / 1.9e-3);
}

const std::vector<Ground>& grounds() {
  static const std::vector<Ground> all = [] {
    const auto field = std::make_shared<const ScalarField>(
        sampled(cube_axes(0.02, 81), [](const Vec3& p) { return p.z() - wave(p.x(), p.y()); }),
        CellReconstruction::smooth);
    MeshSource grid = plane_grid(0.04, 0.04, 80, 80);
    for (Vec3& p : grid.positions) p.z() = wave(p.x(), p.y());
    std::vector<Ground> made = {
        {"relief on a flat sheet", wavy(trial_mesh_a({4, 4, 0.01}), 3e-4, 0.01)},
        {"relief on a folded sheet", wavy(trial_mesh_b(std::numbers::pi / 12.0, {6, 6, 0.01}), 3e-4, 0.01)},
        {"volume", std::make_shared<const IsoSurface>(must(IsoSurface::build(field, 0.0, Inside::low)))},
        {"mesh", std::make_shared<const MeshSurface>(TriangleIndex::build(mesh_of(std::move(grid))))}};
    return made;
  }();
  return all;
}

Scene scene_of(const Surface& surface, double radius, double friction = 0.0, std::optional<std::uint32_t> budget = {}) {
  Instance instance;
  instance.name = "ground";
  instance.surface = surface;
  instance.sides = Sides::both;
  instance.material.stiffness = stiffness;
  instance.material.static_friction = friction;
  instance.material.dynamic_friction = 0.8 * friction;
  SceneSettings settings;
  settings.probe_radius = radius;
  settings.budget = budget;
  return must(Scene::build({instance}, settings));
}

/// A ball that is led, with what its instance keeps from tick to tick.
class Ball {
 public:
  explicit Ball(const Scene& scene) : scene_(scene), cache_(scene) {}
  ForceSample at(const Vec3& p) { return step(scene_, state_, cache_, probe_at(p), tick); }

 private:
  const Scene& scene_;
  ProxyState state_;
  ProxyCache cache_;
};

/// Where a ball that comes down onto the ground at (x, y) touches it first.
double height_of_touch(const Scene& scene, double x, double y) {
  double above = 0.012;
  double below = -0.006;
  for (int i = 0; i < 24; ++i) {
    const double middle = 0.5 * (above + below);
    Ball ball(scene);
    ball.at(Vec3(x, y, 0.012));
    (ball.at(Vec3(x, y, middle)).flags.has(TickFlag::contact) ? below : above) = middle;
  }
  return above;
}

constexpr double radii[] = {0.3e-3, 1e-3, 3e-3};

/// A ball that is led, each tick also from the same state with nothing kept: by searches and the joint solve.
struct BesideSearches {
  double farthest = 0.0;  ///< between both proxies (m)
  double apart = 0.0;     ///< between both forces (N)
  int touching = 0;       ///< ticks
  int sliding = 0;
};

BesideSearches beside_searches(const Scene& scene, std::span<const Vec3> path) {
  BesideSearches found;
  ProxyState state;
  ProxyCache cache(scene);
  for (const Vec3& p : path) {
    ProxyState anew = state;
    const ForceSample searched = step(scene, anew, probe_at(p), tick);
    const ForceSample felt = step(scene, state, cache, probe_at(p), tick);
    found.farthest = std::max(found.farthest, (anew.proxy - state.proxy).norm());
    found.apart = std::max(found.apart, (felt.wrench.force - searched.wrench.force).norm());
    found.touching += felt.flags.has(TickFlag::contact) ? 1 : 0;
    found.sliding += state.sliding ? 1 : 0;
  }
  return found;
}

TEST(BallOnAFace, is_led_as_by_searches_and_the_joint_solve) {
  MeshSource rough = plane_grid(0.04, 0.04, 60, 60);
  Rng heights(5);
  for (Vec3& p : rough.positions) p.z() = heights.uniform(0.0, 1e-4);
  MeshSource bumps = plane_grid(0.04, 0.04, 40, 40);
  for (Vec3& p : bumps.positions) p.z() = 3e-4 * std::abs(std::sin(500.0 * p.x()) * std::cos(350.0 * p.y()));
  const auto on = [](MeshSource source) {
    return std::make_shared<const MeshSurface>(TriangleIndex::build(mesh_of(std::move(source))));
  };
  const Surface surfaces[] = {on(rough), on(plane_grid(0.04, 0.04, 4, 4)), on(bumps)};
  for (const Surface& surface : surfaces) {
    for (const double friction : {0.0, 0.4}) {
      for (const double radius : radii) {
        const Scene scene = scene_of(surface, radius, friction);
        Rng rng(31);
        std::vector<Vec3> path;
        Vec3 p(2e-3, 1e-3, 0.0);
        Vec3 way = Vec3::UnitX();
        for (int i = 0; i < 3000; ++i) {
          way = (way + 0.2 * Vec3(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), 0.0)).normalized();
          if (p.head<2>().norm() > 0.012) way = -Vec3(p.x(), p.y(), 0.0).normalized();
          p += rng.uniform(0.0, 4e-5) * way;
          // Down through first touch, pressed by up to a millimetre, and off again now and then.
          p.z() = i % 1000 < 20 ? 6e-3 : radius - 0.5e-3 * (1.0 + std::sin(0.013 * i));
          path.push_back(p);
        }
        const BesideSearches found = beside_searches(scene, path);
        EXPECT_EQ(found.farthest, 0.0) << friction << " " << radius;
        EXPECT_EQ(found.apart, 0.0) << friction << " " << radius;
        EXPECT_GT(found.touching, 1500);
        EXPECT_GT(found.sliding, friction > 0.0 ? 300 : -1);
      }
    }
  }
}

// --- T1 ---

/// Work on the hand over a closed loop, once it has been led around it so that it ends as it began.
double settled_work(const Scene& scene, std::span<const Vec3> loop) {
  Ball ball(scene);
  ball.at(loop.front() + Vec3(0.0, 0.0, 8e-3));
  for (const Vec3& probe : loop) ball.at(probe);
  double work = 0.0;
  Vec3 at = loop.back();
  Vec3 force = ball.at(at).wrench.force;
  for (const Vec3& probe : loop) {
    const Vec3 now = ball.at(probe).wrench.force;
    work += 0.5 * (force + now).dot(probe - at);
    force = now;
    at = probe;
  }
  return work;
}

TEST(T1_loop_work, a_ball_never_gives_energy) {
  for (const Ground& ground : grounds()) {
    for (const double radius : radii) {
      const Scene scene = scene_of(ground.surface, radius);
      const Vec3 centre(1e-3, 0.5e-3, height_of_touch(scene, 1e-3, 0.5e-3));
      for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        const auto loop = [&](int count) {
          Rng rng(seed);
          return random_loop(rng, centre, 3e-3, 0.5e-3, count);
        };
        const double coarse = settled_work(scene, loop(1500));
        const double fine = settled_work(scene, loop(3000));
        const double area = loop_area(loop(1000));
        const double error = std::abs(fine - coarse);
        EXPECT_LE(fine + (fine - coarse) / 3.0, 1e-6 * stiffness * area + error)
            << ground.name << ", " << radius << ", loop " << seed;
        EXPECT_LT(error, 5e-3 * stiffness * area) << ground.name << ", " << radius << ", loop " << seed;
      }
    }
  }
}

TEST(T1_loop_work, a_ball_that_rubs_only_takes_energy) {
  for (const Ground& ground : grounds()) {
    const Scene scene = scene_of(ground.surface, 1e-3, 0.4);
    const Vec3 centre(1e-3, 0.5e-3, height_of_touch(scene, 1e-3, 0.5e-3) - 0.3e-3);
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      Rng rng(seed);
      EXPECT_LT(settled_work(scene, random_loop(rng, centre, 3e-3, 0.2e-3, 3000)), 0.0)
          << ground.name << ", loop " << seed;
    }
  }
}

// --- T2 ---

TEST(T2_continuity, a_balls_force_changes_by_the_step_over_edges_cells_and_from_wall_to_wall) {
  for (const Ground& ground : grounds()) {
    for (const double radius : radii) {
      const Scene scene = scene_of(ground.surface, radius);
      // Pressed by half of the radius: by more than that a crest's round offset is slipped off at once.
      constexpr int places = 40;
      std::vector<Vec3> pressed;
      for (const Vec3& p : line(Vec3(-2e-3, -1e-3, 0.0), Vec3(2e-3, 1.2e-3, 0.0), places))
        pressed.push_back(Vec3(p.x(), p.y(), height_of_touch(scene, p.x(), p.y()) - 0.5 * radius));
      const auto jump = [&](int count) {
        Ball ball(scene);
        ball.at(pressed.front() + Vec3(0.0, 0.0, 5e-3));
        std::vector<Vec3> forces;
        for (std::size_t i = 0; i < places; ++i) {
          for (const Vec3& p : line(pressed[i], pressed[i + 1], count / places))
            forces.push_back(ball.at(p).wrench.force);
        }
        return largest_jump(forces);
      };
      const double length = Vec3(4e-3, 2.2e-3, 0.0).norm();
      // Where the offset is bent by 1 / r and pressed by r / 2 it turns twice as fast as the probe goes; and what a
      // solve leaves undone is less than a micrometre.
      for (const int count : {800, 8000}) {
        const double jumped = jump(count);
        EXPECT_GT(jumped, 0.0) << ground.name << ", " << radius;
        EXPECT_LT(jumped, stiffness * (3.0 * length / count + 1e-6)) << ground.name << ", " << radius << ", " << count;
      }
    }
  }
}

// --- T5 ---

/// A closed relief, and a mesh so fine that it stands for it.
struct Body {
  std::string name;
  std::shared_ptr<const ReliefSurface> surface;
  Tessellation mesh;
};
std::vector<Body> bodies() {
  std::vector<Body> made;
  const auto add = [&](const char* name, std::shared_ptr<const ReliefSurface> surface, int cells) {
    Tessellation mesh = dense_net(*surface, cells);
    made.push_back({name, std::move(surface), std::move(mesh)});
  };
  add("sheet", wavy(box_mesh(Vec3(0.02, 0.02, 0.5e-3)), 0.2e-3, 0.01), 60);
  add("blob", wavy(random_closed_mesh(3, 2, 0.01, 0.2), 2e-4, 0.005), 40);
  return made;
}

/// Of one body, fast and slowly, through and around it. `longest`: ticks in a row at which it was not at rest, where a
/// stride is at most 2 mm.
void lead_at_any_speed(const Body& body, double radius, double friction, std::optional<std::uint32_t> budget, Rng& rng,
                       int& longest) {
  const Box box = body.surface->bounds().grown(4e-3);
  Scene scene = scene_of(body.surface, radius, friction, budget);
  int pressed = 0;
  longest = 0;
  for (int run = 0; run < 20; ++run) {
    int open = 0;
    Ball ball(scene);
    Vec3 probe = box.upper;
    ball.at(probe);
    Vec3 goal = probe;
    double stride = 0.0;
    for (int i = 0; i < 60; ++i) {
      if ((goal - probe).norm() <= stride || i % 20 == 0) {
        goal = box.lower + Vec3(rng.uniform(), rng.uniform(), rng.uniform()).cwiseProduct(box.extent());
        stride = 1e-3 * 0.01 * std::pow(2000.0, rng.uniform());
      } else {
        probe += stride * (goal - probe).normalized();
      }
      const ForceSample felt = ball.at(probe);
      const double off = -depth_inside(body.mesh.index, felt.proxy) - radius;
      const double slack = 2.0 * body.mesh.error + 2.0 * body.surface->skin();
      ASSERT_GT(off, -slack) << body.name << ", " << radius << ", run " << run << ", tick " << i;
      open = unfinished(felt.flags) && stride < 2e-3 ? open + 1 : 0;
      longest = std::max(longest, open);
      if (!felt.flags.has(TickFlag::contact)) continue;
      ++pressed;
      if (unfinished(felt.flags)) continue;
      ASSERT_LT(off, slack) << body.name << ", " << radius << ", run " << run << ", tick " << i;
    }
  }
  EXPECT_GT(pressed, 100) << body.name << ", " << radius;
}

TEST(T5_pop_through, a_ball_is_never_nearer_than_its_radius_at_any_speed) {
  Rng rng(521);
  for (const Body& body : bodies()) {
    for (const double radius : radii) {
      for (const double friction : {0.0, 0.4}) {
        SCOPED_TRACE(fmt::format("{}, {}, friction {}", body.name, radius, friction));
        int open = 0;
        // Faster than 2 m/s it may be led around half of the body in one tick.
        lead_at_any_speed(body, radius, friction, 0U, rng, open);
        EXPECT_EQ(open, 0);
        lead_at_any_speed(body, radius, friction, {}, rng, open);
        EXPECT_LE(open, 5);
        // With next to no budget it is behind wherever it goes.
        lead_at_any_speed(body, radius, friction, SceneSettings::least_budget, rng, open);
        EXPECT_GT(open, 5);
      }
    }
  }
}

// --- T7 ---

TEST(T7_closing, a_ball_no_larger_than_the_closing_is_led_over_the_fillets_offset) {
  const double opening = degrees(90.0);
  const double height = 0.1e-3;
  const double closing = 2e-3;
  const auto open = coated(valley(opening, 8e-3), flat_map(height), Mapping::triplanar);
  const ClosedRelief maps = must(close_relief(*open, {closing, 80}));
  const std::shared_ptr<const ReliefSurface> closed = must(wear_closed(*open, maps));
  for (const double share : {0.3, 0.9}) {
    const double radius = share * closing;
    // How far the middle is from the fillet's parallel surface, around the fillet's own axis.
    const Vec3 axis(0.0, 0.0, (closing + height) / std::sin(0.5 * opening));
    const auto off = [&](const std::shared_ptr<const ReliefSurface>& surface) {
      const Scene scene = scene_of(surface, radius);
      Ball ball(scene);
      ball.at(Vec3(-1e-3, 0.3e-3, 8e-3));
      double most = 0.0;
      for (int i = 0; i <= 400; ++i) {
        const Vec3 probe(-1e-3 + 5e-6 * i, 0.3e-3, 0.5e-3);
        const ForceSample felt = ball.at(probe);
        EXPECT_TRUE(felt.flags.has(TickFlag::contact));
        most = std::max(most, std::abs(Vec2(felt.proxy.x(), felt.proxy.z() - axis.z()).norm() - (closing - radius)));
      }
      return most;
    };
    EXPECT_LT(off(closed), 1e-3 * closing) << share;
    EXPECT_GT(off(open), 0.02 * closing) << share;
  }
}

}  // namespace
}  // namespace asperity::test::ball_properties_test
