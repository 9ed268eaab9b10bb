// T1 loop work and T2 continuity (formulation D8 with amendments 1 and 5), for the proxy and for the consistent force
// laws.

#include <gtest/gtest.h>

#include <cstddef>
#include <functional>
#include <string>

#include "tests/render/fixtures.h"
#include "tests/surface/reliefs.h"

namespace asperity::continuity_test {
namespace {

using namespace test;

Scene scene_with(const std::shared_ptr<const ReliefSurface>& surface, Law law, double still = 0.0, double sliding = 0.0,
                 Sides sides = Sides::both) {
  Instance instance;
  instance.name = "test";
  instance.surface = surface;
  instance.law = std::move(law);
  instance.sides = sides;
  instance.material.stiffness = stiffness;
  instance.material.static_friction = still;
  instance.material.dynamic_friction = sliding;
  return must(Scene::build({instance}, 0.0));
}

std::shared_ptr<const ReliefSurface> smooth_relief(MeshSource source, double amplitude, double tile = 0.01) {
  return relief_on(mesh_of(std::move(source)), {tiled(wavy_map(amplitude, 32), tile)},
                   CoatSettings{Mapping::triplanar, Vec2::Ones(), {}});
}

struct Ground {
  std::string name;
  std::shared_ptr<const ReliefSurface> surface;
  Vec3 centre;   // over which loops are led
  Vec3 outward;  // the touched side there
};

const std::vector<Ground>& grounds() {
  static const std::vector<Ground> all = {
      {"M_a", smooth_relief(trial_mesh_a({4, 4, 0.01}), 3e-4), Vec3(1e-3, 1e-3, 0.0), Vec3::UnitZ()},
      {"M_b", smooth_relief(trial_mesh_b(std::numbers::pi / 12.0, {6, 6, 0.01}), 3e-4), Vec3::Zero(), Vec3::UnitZ()},
      {"icosphere", smooth_relief(icosphere(2, 0.02), 3e-4), Vec3(0.0, 0.0, 0.02), Vec3::UnitZ()},
      {"cup", smooth_relief(trial_mesh_e(4, std::numbers::pi / 2.0, 0.01), 3e-4), Vec3::Zero(), Vec3::UnitZ()}};
  return all;
}

/// A ground's own height over (x, y): where its middle is touched from outside.
Vec3 over(const Ground& ground, double above) {
  SurfaceCache hint;
  const Vec3 high = ground.centre + 0.03 * ground.outward;
  const SweptHit hit =
      ground.surface->view(hint).first_touch({high, ground.centre - 0.2 * ground.outward}, Sides::both);
  EXPECT_TRUE(hit.hit) << ground.name;
  return hit.contact.point + above * ground.outward;
}

/// Work on the hand over one closed loop, once the state has been led around it so that it ends as it began.
double settled_work(const Scene& scene, std::span<const Vec3> loop, const Vec3& outside) {
  ProxyState state;
  touch(scene, state, outside);
  for (const Vec3& probe : loop) touch(scene, state, probe);
  double work = 0.0;
  Vec3 at = loop.back();
  Vec3 force = touch(scene, state, at).wrench.force;
  for (const Vec3& probe : loop) {
    const Vec3 now = touch(scene, state, probe).wrench.force;
    work += 0.5 * (force + now).dot(probe - at);
    force = now;
    at = probe;
  }
  return work;
}

/// The trapezoid rule's own error falls with the square of the step; that of a half as fine loop shows how much is
/// left.
struct Work {
  double value = 0.0;
  double error = 0.0;
};
Work extrapolated_work(const Scene& scene, const std::function<std::vector<Vec3>(int)>& loop, int count,
                       const Vec3& outside) {
  const double coarse = settled_work(scene, loop(count), outside);
  const double fine = settled_work(scene, loop(2 * count), outside);
  return {fine + (fine - coarse) / 3.0, std::abs(fine - coarse)};
}

TEST(T1_loop_work, the_proxy_never_gives_energy_and_takes_none_below_the_crests_radius) {
  // Crests of wavy_map bend with a radius of about (tile / 2 pi)^2 / amplitude / 3 = 3 mm: loops dip 0.5 mm.
  for (const Ground& ground : grounds()) {
    const Scene scene = scene_with(ground.surface, ProxyLaw{});
    const Vec3 centre = over(ground, 0.0);
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      const auto loop = [&](int count) {
        Rng rng(seed);
        return random_loop(rng, centre, 3e-3, 0.5e-3, count);
      };
      const double area = loop_area(loop(1000));
      const Work work = extrapolated_work(scene, loop, 3000, centre + 5e-3 * ground.outward);
      EXPECT_LE(work.value, 1e-6 * stiffness * area + work.error) << ground.name << ", loop " << seed;
      EXPECT_LT(work.error, 2e-4 * stiffness * area) << ground.name << ", loop " << seed;
    }
  }
}

TEST(T1_loop_work, the_proxys_net_work_is_zero_where_nothing_is_sharp) {
  const Ground& ground = grounds().front();
  const Scene scene = scene_with(ground.surface, ProxyLaw{});
  const Vec3 centre = over(ground, -0.6e-3);
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const auto loop = [&](int count) {
      Rng rng(seed);
      return random_loop(rng, centre, 2e-3, 0.2e-3, count);
    };
    const double area = loop_area(loop(1000));
    const Work work = extrapolated_work(scene, loop, 4000, centre + 5e-3 * ground.outward);
    EXPECT_NEAR(work.value, 0.0, 1e-6 * stiffness * area + work.error) << "loop " << seed;
    EXPECT_LT(work.error, 1e-5 * stiffness * area) << "loop " << seed;
  }
}

TEST(T1_loop_work, the_proxy_takes_energy_at_sharp_crests_and_never_gives_any) {
  // Loops far deeper than the crests are round, on coarse and folded bases.
  const std::shared_ptr<const ReliefSurface> sharp[] = {smooth_relief(trial_mesh_a({4, 4, 0.01}), 5e-4, 0.003),
                                                        smooth_relief(trial_mesh_c({4, 4, 0.01}), 2e-4),
                                                        smooth_relief(icosphere(0, 0.02), 5e-4, 0.004)};
  double most_taken = 0.0;
  for (const auto& surface : sharp) {
    const Scene scene = scene_with(surface, ProxyLaw{}, 0.0, 0.0, Sides::front);
    const Vec3 centre = over({"sharp", surface, Vec3(1e-3, 1e-3, 0.0), Vec3::UnitZ()}, -0.5e-3);
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      Rng rng(seed);
      const std::vector<Vec3> loop = random_loop(rng, centre, 5e-3, 1.5e-3, 6000);
      const double work = settled_work(scene, loop, centre + Vec3(0.0, 0.0, 8e-3));
      // Where the force jumps the trapezoid rule is off by half a jump times a step.
      EXPECT_LE(work, 1e-6 * stiffness * loop_area(loop) + 1e-6) << "loop " << seed;
      most_taken = std::min(most_taken, work);
    }
  }
  EXPECT_LT(most_taken, -1e-6);
}

TEST(T1_loop_work, friction_only_takes_energy) {
  for (const Ground& ground : grounds()) {
    for (const double friction : {0.1, 0.5}) {
      const Scene scene = scene_with(ground.surface, ProxyLaw{}, friction, 0.8 * friction);
      const Vec3 centre = over(ground, -0.2e-3);
      for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        Rng rng(seed);
        const std::vector<Vec3> loop = random_loop(rng, centre, 3e-3, 0.4e-3, 6000);
        EXPECT_LT(settled_work(scene, loop, centre + 5e-3 * ground.outward), 0.0)
            << ground.name << ", friction " << friction << ", loop " << seed;
      }
    }
  }
}

TEST(T1_loop_work, consistent_force_laws_are_potentials_where_they_are_continuous) {
  for (const char* name : {"height-field", "mesostructure"}) {
    for (const Ground& ground : grounds()) {
      const Scene scene = scene_with(ground.surface, named(name));
      const Vec3 centre = over(ground, 0.0);
      for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        const auto loop = [&](int count) {
          Rng rng(seed);
          return random_loop(rng, centre, 3e-3, 0.5e-3, count);
        };
        const double area = loop_area(loop(1000));
        const Work work = extrapolated_work(scene, loop, 6000, centre + 5e-3 * ground.outward);
        EXPECT_NEAR(work.value, 0.0, 1e-6 * stiffness * area + work.error)
            << name << " on " << ground.name << ", loop " << seed;
        EXPECT_LT(work.error, 2e-4 * stiffness * area) << name << " on " << ground.name << ", loop " << seed;
      }
    }
  }
}

TEST(T1_loop_work, the_mesostructure_law_is_a_potential_across_stitched_folds_as_well) {
  for (const FoldMode folds : {FoldMode::keep, FoldMode::round}) {
    const auto surface = relief_on(mesh_of(roof(std::numbers::pi / 6.0, 0.01)), unlike_maps(3e-4),
                                   CoatSettings{Mapping::per_face, Vec2::Ones(), {folds, Blend::quintic, 0.15, {}}});
    const Scene scene = scene_with(surface, named("mesostructure"));
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const auto loop = [&](int count) {
        Rng rng(seed);
        return random_loop(rng, Vec3(0.0, 1e-3, -0.4e-3), 3e-3, 0.4e-3, count);
      };
      const double area = loop_area(loop(1000));
      const Work work = extrapolated_work(scene, loop, 6000, Vec3(0.0, 1e-3, 5e-3));
      EXPECT_NEAR(work.value, 0.0, 1e-6 * stiffness * area + work.error)
          << (folds == FoldMode::keep ? "keep" : "round") << ", loop " << seed;
    }
  }
}

/// Largest change of force per metre along a way cut into steps of `step`.
double modulus(const Scene& scene, const Vec3& from, const Vec3& to, const Vec3& outside, double step) {
  const int count = static_cast<int>(std::lround((to - from).norm() / step));
  return largest_jump(slide(scene, line(from, to, count), outside)) / ((to - from).norm() / count);
}

/// The largest change falls tenfold when the step does, within 20 %: a modulus that stays.
void expect_continuous(const Scene& scene, const Vec3& from, const Vec3& to, const Vec3& outside, double step,
                       const std::string& name) {
  const double coarse = modulus(scene, from, to, outside, step);
  const double middle = modulus(scene, from, to, outside, 0.1 * step);
  const double fine = modulus(scene, from, to, outside, 0.01 * step);
  EXPECT_GT(coarse, 0.0) << name;
  EXPECT_NEAR(middle / coarse, 1.0, 0.2) << name << ", step " << step;
  EXPECT_NEAR(fine / middle, 1.0, 0.2) << name << ", step " << step;
}

/// From one place on a mesh to another, both sunk by `depth` along z.
struct Way {
  std::string name;
  Vec3 from;
  Vec3 to;
};
/// On M_a: across edges of all three directions, along one, and through vertices.
std::vector<Way> ways_over_flat_mesh(const TriangleMesh& mesh, double depth) {
  // The vertex nearest to the middle, and its faces.
  std::uint32_t middle = 0;
  for (std::uint32_t i = 0; i < mesh.positions().size(); ++i) {
    if (mesh.positions()[i].norm() < mesh.positions()[middle].norm()) middle = i;
  }
  const Vec3 vertex = mesh.positions()[middle] - depth * Vec3::UnitZ();
  const double edge = mesh.mean_edge();
  return {{"through a vertex", vertex - 0.3 * edge * Vec3(0.9, 0.3, 0.0), vertex + 0.3 * edge * Vec3(0.9, 0.3, 0.0)},
          {"past a vertex", vertex + edge * Vec3(-0.3, 0.01, 0.0), vertex + edge * Vec3(0.3, 0.02, 0.0)},
          {"along an edge", vertex - 0.3 * edge * Vec3::UnitX(), vertex + 0.4 * edge * Vec3::UnitX()},
          {"across edges", vertex + edge * Vec3(0.1, -0.35, 0.0), vertex + edge * Vec3(0.65, 0.4, 0.0)}};
}

TEST(T2_continuity, the_mesostructure_law_on_flat_meshes_over_edges_vertices_and_chart_seams) {
  for (const Blend blend : {Blend::s_shape, Blend::quintic}) {
    for (const FoldMode folds : {FoldMode::keep, FoldMode::round}) {
      const auto surface = relief_on(mesh_of(trial_mesh_a({4, 4, 0.01})), unlike_maps(3e-4),
                                     CoatSettings{Mapping::per_face, Vec2::Ones(), {folds, blend, 0.2, {}}});
      const Scene scene = scene_with(surface, named("mesostructure"));
      for (const Way& way : ways_over_flat_mesh(surface->base().mesh(), 0.7e-3)) {
        expect_continuous(scene, way.from, way.to, way.from + Vec3(0.0, 0.0, 5e-3), 2e-5,
                          way.name + (folds == FoldMode::keep ? ", keep" : ", round"));
      }
    }
  }
}

TEST(T2_continuity, the_proxy_on_flat_meshes_over_edges_vertices_and_chart_seams) {
  // Bands of 2 mm over differences of 0.1 mm: crests of a few mm, pressed by less. Steps down to 1 um: below, what the
  // proxy's descent leaves undone (3e-5 of a grain) is all that changes.
  const auto surface =
      relief_on(mesh_of(trial_mesh_a({4, 4, 0.01})), unlike_maps(5e-5),
                CoatSettings{Mapping::per_face, Vec2::Ones(), {FoldMode::keep, Blend::quintic, 1.0 / 3.0, {}}});
  const Scene scene = scene_with(surface, ProxyLaw{});
  for (const Way& way : ways_over_flat_mesh(surface->base().mesh(), 0.2e-3))
    expect_continuous(scene, way.from, way.to, way.from + Vec3(0.0, 0.0, 5e-3), 1e-4, "proxy, " + way.name);
}

TEST(T2_continuity, without_a_blend_the_force_jumps) {
  const auto surface = relief_on(mesh_of(trial_mesh_a({4, 4, 0.01})), unlike_maps(3e-4),
                                 CoatSettings{Mapping::per_face, Vec2::Ones(), {FoldMode::keep, Blend::none, 0.2, {}}});
  const Scene scene = scene_with(surface, named("mesostructure"));
  const Way way = ways_over_flat_mesh(surface->base().mesh(), 0.7e-3).back();
  const Vec3 outside = way.from + Vec3(0.0, 0.0, 5e-3);
  EXPECT_GT(modulus(scene, way.from, way.to, outside, 2e-6), 5.0 * modulus(scene, way.from, way.to, outside, 2e-5));
}

TEST(T2_continuity, the_mesostructure_law_over_all_dihedrals_with_unequal_heights_where_folds_are_rounded) {
  for (int degrees = -150; degrees <= 150; degrees += 30) {
    const double fold = degrees * std::numbers::pi / 180.0;
    const auto surface =
        relief_on(mesh_of(roof(fold, 0.01)),
                  {tiled(flat_map(1e-4)), tiled(flat_map(2e-4)), tiled(flat_map(2.5e-4)), tiled(flat_map(3e-4))},
                  CoatSettings{Mapping::per_face, Vec2::Ones(), {FoldMode::round, Blend::quintic, 0.1, {}}});
    const Scene scene = scene_with(surface, named("mesostructure"));
    // Along the surface on one side, over the ridge, down the other, a little inside.
    const double a = 0.5 * fold;
    const double depth = 1e-4;
    const double reach = 1.5e-3;
    std::vector<Vec3> corners = {Vec3(-reach * std::cos(a), 0.6e-3, -reach * std::sin(a)), Vec3(0.0, 0.7e-3, 0.0),
                                 Vec3(reach * std::cos(a), 0.8e-3, -reach * std::sin(a))};
    for (Vec3& corner : corners) corner.z() -= depth / std::max(0.2, std::cos(a));
    const Vec3 outside = corners[0] + 3e-3 * Vec3(-std::sin(a), 0.0, std::cos(a));
    for (int leg = 0; leg < 2; ++leg) {
      ProxyState state;
      const auto jump = [&](double step) {
        std::vector<Vec3> path = line(outside, corners[0], 50);
        const auto count = [&](int i) {
          return static_cast<int>(std::lround(
              (corners[static_cast<std::size_t>(i) + 1] - corners[static_cast<std::size_t>(i)]).norm() / step));
        };
        for (int i = 0; i < leg; ++i) {
          for (const Vec3& p :
               line(corners[static_cast<std::size_t>(i)], corners[static_cast<std::size_t>(i) + 1], count(i)))
            path.push_back(p);
        }
        const std::size_t skipped = path.size();
        for (const Vec3& p :
             line(corners[static_cast<std::size_t>(leg)], corners[static_cast<std::size_t>(leg) + 1], count(leg)))
          path.push_back(p);
        const std::vector<Vec3> forces = slide(scene, path);
        return largest_jump(std::span<const Vec3>(forces).subspan(skipped)) / step;
      };
      const double coarse = jump(1e-5);
      const double middle = jump(1e-6);
      const double fine = jump(1e-7);
      const std::string name = std::to_string(degrees) + " degrees, leg " + std::to_string(leg);
      EXPECT_GT(coarse, 0.0) << name;
      EXPECT_NEAR(middle / coarse, 1.0, 0.2) << name << ", " << coarse * 1e-5 << " N a step";
      EXPECT_NEAR(fine / middle, 1.0, 0.2) << name << ", " << middle * 1e-6 << " N a step";
    }
  }
}

}  // namespace
}  // namespace asperity::continuity_test
