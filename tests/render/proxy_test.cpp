// The proxy law (formulation D6, amendments 5 to 9): what holds at every tick, whatever is touched.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstddef>
#include <cstring>
#include <set>
#include <string>
#include <vector>

#include "tests/render/fixtures.h"
#include "tests/surface/reliefs.h"

namespace asperity::proxy_test {
namespace {

using namespace test;

constexpr double amplitude = 4e-4;

/// Reliefs of every kind: flat, folded, concave, stitched both ways, triplanar, open and closed.
std::shared_ptr<const ReliefSurface> relief_of_kind(int kind) {
  static const std::vector<std::shared_ptr<const ReliefSurface>> all = [] {
    std::vector<std::shared_ptr<const ReliefSurface>> made;
    const auto add = [&](MeshSource source, Mapping mapping, FoldMode folds) {
      std::vector<std::shared_ptr<const Mesostructure>> maps = {tiled(wavy_map(amplitude, 16))};
      if (mapping == Mapping::per_face) maps = unlike_maps(amplitude);
      made.push_back(relief_on(mesh_of(std::move(source)), std::move(maps),
                               CoatSettings{mapping, Vec2::Ones(), {folds, Blend::quintic, 0.1, {}}}));
    };
    add(icosphere(1, 0.02), Mapping::triplanar, FoldMode::keep);
    add(icosphere(1, 0.02), Mapping::per_face, FoldMode::keep);
    add(icosphere(1, 0.02), Mapping::per_face, FoldMode::round);
    add(trial_mesh_a({4, 4, 0.01}), Mapping::per_face, FoldMode::keep);
    add(trial_mesh_c({4, 4, 0.01}), Mapping::per_face, FoldMode::keep);
    add(trial_mesh_e(3, std::numbers::pi / 2.0, 0.01), Mapping::triplanar, FoldMode::keep);
    add(random_closed_mesh(4, 2, 0.02, 0.3), Mapping::triplanar, FoldMode::keep);
    add(box_mesh(Vec3(0.02, 0.015, 0.01)), Mapping::triplanar, FoldMode::keep);
    return made;
  }();
  return all[static_cast<std::size_t>(kind)];
}
constexpr int kinds_of_relief = 8;

Instance instance_of(Surface surface, double still = 0.0, double sliding = 0.0) {
  Instance instance;
  instance.name = "test";
  instance.surface = std::move(surface);
  instance.material.stiffness = stiffness;
  instance.material.static_friction = still;
  instance.material.dynamic_friction = sliding;
  return instance;
}

/// A wandering probe around a surface: smooth for a while, then off in another direction, in and out.
class Wanderer {
 public:
  Wanderer(Rng& rng, const Box& box) : rng_(rng), box_(box.grown(2e-3)), position_(box_.upper) {}
  Vec3 next() {
    if (--left_ <= 0) {
      goal_ = box_.lower + Vec3(rng_.uniform(), rng_.uniform(), rng_.uniform()).cwiseProduct(box_.extent());
      left_ = 5 + static_cast<int>(rng_.below(60));
      step_ = (goal_ - position_) / left_;
      if (rng_.below(8) == 0) step_.setZero();  // holds still
    }
    position_ += step_;
    return position_;
  }

 private:
  Rng& rng_;
  Box box_;
  Vec3 position_;
  Vec3 goal_ = Vec3::Zero();
  Vec3 step_ = Vec3::Zero();
  int left_ = 0;
};

RC_GTEST_PROP(ProxyInvariants, the_proxy_never_moves_away_from_the_probe, (std::uint64_t seed)) {
  // |x' - p| <= |x - p|: the theorem that makes the contact passive.
  Rng rng(seed);
  const auto surface = relief_of_kind(static_cast<int>(rng.below(kinds_of_relief)));
  const double still = rng.below(2) == 0 ? 0.0 : rng.uniform(0.0, 1.0);
  const Scene scene = must(Scene::build({instance_of(surface, still, still * rng.uniform())}, 0.0));
  Wanderer wanderer(rng, surface->bounds());
  ProxyState state;
  Vec3 before = wanderer.next();
  bool cut = false;
  touch(scene, state, before);
  for (int i = 0; i < 200; ++i) {
    const Vec3 probe = wanderer.next();
    before = state.proxy;
    const ForceSample felt = touch(scene, state, probe);
    // A point that touches rests on the relief itself, one that does not has no skin either: rounding alone.
    RC_ASSERT((state.proxy - probe).norm() <= (before - probe).norm() + 2.0 * surface->skin());
    // Unless friction's cone has cut the last force off, as at a crease: then the hand has put less in than the spring
    // holds, which it feels until it lets go of some.
    const bool limited = felt.flags.has(TickFlag::energy_limited);
    RC_ASSERT(cut || !limited);
    cut = (cut && limited) || (still > 0.0 && felt.flags.has(TickFlag::contact) &&
                               felt.wrench.force.norm() < 0.9999 * stiffness * (state.proxy - probe).norm());
  }
}

/// What is wrong with the forces along a random way; nothing where all is well.
std::string wrong_without_friction(std::uint64_t seed) {
  Rng rng(seed);
  const auto surface = relief_of_kind(static_cast<int>(rng.below(kinds_of_relief)));
  const Scene scene = must(Scene::build({instance_of(surface)}, 0.0));
  Wanderer wanderer(rng, surface->bounds());
  ProxyState state;
  for (int i = 0; i < 200; ++i) {
    const Vec3 probe = wanderer.next();
    const ForceSample felt = touch(scene, state, probe);
    const Vec3& force = felt.wrench.force;
    if (!felt.flags.has(TickFlag::contact)) {
      // Free space: exactly nothing.
      if (force != Vec3::Zero()) return "a force in free space";
      if (felt.proxy != probe) return "a proxy left behind in free space";
      continue;
    }
    if ((force - stiffness * (felt.proxy - probe)).norm() > 1e-9) return "not the spring";
    // Out of its budget the proxy may still be on its way around a bend.
    if (unfinished(felt.flags)) continue;
    if (force.dot(felt.contact.normal) < -stiffness * surface->skin()) return "a force into the surface";
  }
  return {};
}

RC_GTEST_PROP(ProxyInvariants, without_friction_the_force_is_the_spring_along_the_surface_s_normal,
              (std::uint64_t seed)) {
  RC_ASSERT(wrong_without_friction(seed) == "");
}

TEST(ProxyInvariants, past_a_ridge_sharper_than_a_right_angle_it_is_not_drawn_back) {
  // Ways over such ridges: a motion that starts less than a skin behind the plane of the face that it came along, and
  // comes up beside it, has not gone into it.
  for (const std::uint64_t seed : {32U, 61U, 729U, 1526U, 2208U, 3442U, 3827U, 4371U})
    EXPECT_EQ(wrong_without_friction(seed), "") << "seed " << seed;
}

TEST(ProxyInvariants, led_along_the_rim_of_an_open_sheet_it_stays_on_the_rim) {
  // As on the bare mesh. Rounding alone says now that the next step leads off the sheet, now that it does not.
  for (MeshSource source : {trial_mesh_f(10, 0.02), cone(40, 0.02, 0.008)}) {
    const auto surface = relief_on(mesh_of(std::move(source)), {tiled(flat_map(0.0))},
                                   CoatSettings{Mapping::per_face, Vec2::Ones(), {}});
    const Scene scene = must(Scene::build({instance_of(surface)}, 0.0));
    const TriangleMesh& mesh = surface->base().mesh();
    int rims = 0;
    for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
      for (int edge = 0; edge < 3; ++edge) {
        if (mesh.neighbour(face, edge) != no_index) continue;
        const auto corners = mesh.corners(face);
        const Vec3& from = corners[static_cast<std::size_t>(edge)];
        const Vec3 way = corners[static_cast<std::size_t>((edge + 1) % 3)] - from;
        const Vec3 middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        const Vec3 normal = mesh.face_normal(face);
        ProxyState state;
        touch(scene, state, middle + 1e-3 * normal);
        touch(scene, state, middle - 1e-4 * normal);
        for (int i = 0; i <= 100; ++i) {
          const Vec3 on_rim = from + (0.1 + 0.008 * i) * way;
          const ForceSample felt = touch(scene, state, on_rim - 1e-4 * normal);
          ASSERT_TRUE(felt.flags.has(TickFlag::contact)) << "face " << face << ", step " << i;
          ASSERT_LE((felt.proxy - on_rim).norm(), 10.0 * surface->skin()) << "face " << face << ", step " << i;
        }
        ++rims;
      }
    }
    EXPECT_GT(rims, 10);
  }
}

RC_GTEST_PROP(ProxyInvariants, with_friction_the_force_lies_within_coulombs_cone_and_sticks_below_it,
              (std::uint64_t seed)) {
  // On smooth reliefs: at an edge or in a corner the normal is one of many.
  Rng rng(seed);
  static const auto plane = relief_on(mesh_of(plane_grid(0.04, 0.04, 4, 4)), {tiled(wavy_map(amplitude))}, {});
  const double still = rng.uniform(0.05, 1.0);
  const double sliding = still * rng.uniform(0.2, 1.0);
  const Scene scene = must(Scene::build({instance_of(plane, still, sliding)}, 0.0));
  ProxyState state;
  Vec3 probe(0.0, 0.0, 2e-3);
  touch(scene, state, probe);
  Vec3 heading = Vec3::Zero();
  for (int i = 0; i < 300; ++i) {
    if (i % 40 == 0) heading = random_point(rng, 4e-5);
    heading.z() = (-1e-3 - probe.z()) * 0.05;
    probe += heading;
    if (probe.head<2>().cwiseAbs().maxCoeff() > 0.015) heading = -heading;
    const Vec3 before = state.proxy;
    const bool held = state.contacts.size() > 0 && state.contacts[0].surface.rests;
    const Vec3 normal_before = held ? state.contacts[0].surface.normal : Vec3::Zero();
    const bool slid = held && state.contacts[0].surface.sliding;
    const ForceSample felt = touch(scene, state, probe);
    if (!felt.flags.has(TickFlag::contact)) continue;
    const Vec3& force = felt.wrench.force;
    const double push = force.dot(felt.contact.normal);
    const double along = (force - push * felt.contact.normal).norm();
    RC_ASSERT(push >= 0.0);
    RC_ASSERT(along <= still * push * (1.0 + 1e-6) + 1e-6);
    if (!held) continue;
    // The spring that the old place would have: below the cone nothing moves.
    const Vec3 spring = before - probe;
    const double hold = spring.dot(normal_before);
    const double pull = (spring - hold * normal_before).norm();
    if (hold > 0.0 && pull < (slid ? sliding : still) * hold * (1.0 - 1e-9)) RC_ASSERT(felt.proxy == before);
  }
}

RC_GTEST_PROP(ProxyInvariants, what_slides_is_pulled_by_the_dynamic_coefficient, (std::uint64_t seed)) {
  Rng rng(seed);
  static const auto flat = relief_on(mesh_of(plane_grid(0.04, 0.04, 4, 4)), {tiled(flat_map(3e-4))}, {});
  const double still = rng.uniform(0.1, 1.0);
  const double sliding = still * rng.uniform(0.2, 1.0);
  const double depth = rng.uniform(1e-4, 1e-3);
  const Scene scene = must(Scene::build({instance_of(flat, still, sliding)}, 0.0));
  ProxyState state;
  touch(scene, state, Vec3(0.0, 0.0, 1e-3));
  const double angle = rng.uniform(0.0, 6.28);
  const Vec3 heading(std::cos(angle), std::sin(angle), 0.0);
  bool slides = false;
  for (double way = 0.0; way < 3.0 * depth; way += 0.01 * depth) {
    const Vec3 force = touch(scene, state, way * heading + Vec3(0.0, 0.0, 3e-4 - depth)).wrench.force;
    const double along = -force.dot(heading);
    RC_ASSERT(std::abs(force.z() - stiffness * depth) <= 1e-6 * stiffness * depth);
    if (!slides && along >= 0.0 && way <= still * depth * (1.0 - 1e-6)) {
      RC_ASSERT(std::abs(along - stiffness * way) <= 1e-6 * stiffness * depth);
    } else if (way > still * depth * (1.0 + 1e-6)) {
      slides = true;
      RC_ASSERT(std::abs(along - sliding * stiffness * depth) <= 1e-5 * stiffness * depth);
    }
  }
  RC_ASSERT(slides);
}

RC_GTEST_PROP(ProxyInvariants, a_probe_that_has_left_feels_exactly_nothing, (std::uint64_t seed)) {
  Rng rng(seed);
  const auto surface = relief_of_kind(static_cast<int>(rng.below(kinds_of_relief)));
  const double still = rng.below(2) == 0 ? 0.0 : rng.uniform(0.0, 1.0);
  const Scene scene = must(Scene::build({instance_of(surface, still, still)}, 0.0));
  const TriangleMesh& mesh = surface->base().mesh();
  SurfaceCache hint;
  for (int i = 0; i < 20; ++i) {
    const ReliefFrame frame = surface->frame(random_face(rng, mesh));
    const Vec3 at = random_barycentric(rng, 0.2);
    const ReliefPoint point = surface->point(frame, at[1], at[2]);
    const Vec3 normal = point.front;
    const Vec3 out = point.point + 2e-5 * normal;
    // Only where the way in and out is free.
    if (surface->view(hint).first_touch({point.point + 1e-3 * normal, out}, Sides::both).hit) continue;
    ProxyState state;
    touch(scene, state, point.point + 1e-3 * normal);
    const ForceSample pressed = touch(scene, state, point.point - 1e-4 * normal);
    RC_ASSERT(pressed.flags.has(TickFlag::contact));
    RC_ASSERT(pressed.wrench.force.dot(normal) > 0.0);
    touch(scene, state, out);
    const ForceSample left = touch(scene, state, out + 1e-4 * normal);
    if (surface->view(hint).first_touch({out, out + 1e-4 * normal}, Sides::both).hit) continue;
    RC_ASSERT(left.wrench.force == Vec3::Zero());
    RC_ASSERT(!left.flags.has(TickFlag::contact));
    RC_ASSERT(left.proxy == out + 1e-4 * normal);
  }
}

RC_GTEST_PROP(ProxyInvariants, a_copied_state_replays_to_the_same_bits, (std::uint64_t seed)) {
  Rng rng(seed);
  const auto surface = relief_of_kind(static_cast<int>(rng.below(kinds_of_relief)));
  const double still = rng.uniform(0.0, 0.6);
  const Scene scene = must(Scene::build({instance_of(surface, still, 0.5 * still)}, rng.below(20) == 0 ? 3e-4 : 0.0));
  Wanderer wanderer(rng, surface->bounds());
  ProxyState state;
  for (int i = 0; i < 10; ++i) touch(scene, state, wanderer.next());
  ProxyState copy = state;
  std::vector<Vec3> path;
  std::vector<ForceSample> first;
  for (int i = 0; i < 10; ++i) path.push_back(wanderer.next());
  for (const Vec3& probe : path) first.push_back(touch(scene, state, probe));
  for (std::size_t i = 0; i < path.size(); ++i) {
    const ForceSample again = touch(scene, copy, path[i]);
    RC_ASSERT(again.wrench.force == first[i].wrench.force);
    RC_ASSERT(again.proxy == first[i].proxy);
    RC_ASSERT(again.flags.bits() == first[i].flags.bits());
  }
  RC_ASSERT(copy.proxy == state.proxy);
  RC_ASSERT(copy.account.level() == state.account.level());
}

TEST(ProxyTogether, a_corner_of_three_meshes_holds_the_proxy_at_its_corner) {
  // Three squares through the origin, each with its front towards the octant x, y, z > 0.
  std::vector<Instance> walls;
  for (int axis = 0; axis < 3; ++axis) {
    MeshSource source = plane_grid(0.04, 0.04, 2, 2);
    for (Vec3& p : source.positions) p = Vec3(p[(3 - axis) % 3], p[(4 - axis) % 3], p[(5 - axis) % 3]);
    walls.push_back(instance_of(bare(std::move(source))));
    walls.back().sides = Sides::front;
  }
  for (const double radius : {0.0, 1e-3}) {
    const Scene scene = must(Scene::build(walls, radius));
    Rng rng(60);
    for (int i = 0; i < 50; ++i) {
      const Vec3 depth(rng.uniform(1e-4, 2e-3), rng.uniform(1e-4, 2e-3), rng.uniform(1e-4, 2e-3));
      const ForceSample felt = poke(scene, Vec3(2e-3, 3e-3, 2.5e-3), Vec3::Constant(radius) - depth);
      ASSERT_LT((felt.proxy - Vec3::Constant(radius)).norm(), 1e-7) << radius;
      ASSERT_LT((felt.wrench.force - stiffness * depth).norm(), 1e-4) << "each wall is felt once";
      ASSERT_GE(felt.contact.count, 1U) << "radius " << radius << ", case " << i << ", force "
                                        << felt.wrench.force.transpose() << " at depth " << depth.transpose();
    }
  }
}

TEST(ProxyTogether, a_relief_against_a_mesh_holds_the_proxy_in_their_crease) {
  // A flat coat of 0.3 mm in z = 0 and a wall in x = 0: the crease is x = 0, z = 0.3 mm.
  const auto floor = relief_on(mesh_of(plane_grid(0.04, 0.04, 4, 4)), {tiled(flat_map(3e-4))}, {});
  MeshSource upright = plane_grid(0.04, 0.04, 2, 2);
  for (Vec3& p : upright.positions) p = Vec3(p.z(), p.x(), p.y());
  Instance wall = instance_of(bare(std::move(upright)));
  Instance ground = instance_of(floor);
  wall.sides = ground.sides = Sides::front;
  for (const double radius : {0.0, 1e-3}) {
    const Scene scene = must(Scene::build({ground, wall}, radius));
    Rng rng(61);
    for (int i = 0; i < 50; ++i) {
      const double y = rng.uniform(-5e-3, 5e-3);
      const double across = rng.uniform(1e-4, 1.5e-3);
      const double down = rng.uniform(1e-4, 1.5e-3);
      const ForceSample felt = poke(scene, Vec3(3e-3, y, 3e-3), Vec3(radius - across, y, 3e-4 + radius - down));
      ASSERT_LT((felt.proxy - Vec3(radius, y, 3e-4 + radius)).norm(), 3e-6) << "radius " << radius << ", case " << i;
      ASSERT_NEAR(felt.wrench.force.x(), stiffness * across, 3e-3) << "radius " << radius << ", case " << i;
      ASSERT_NEAR(felt.wrench.force.z(), stiffness * down, 3e-3) << "radius " << radius << ", case " << i;
    }
  }
}

TEST(ProxyBall, rests_its_radius_away_from_the_relief) {
  const auto surface = relief_on(mesh_of(plane_grid(0.02, 0.02, 2, 2)), {tiled(wavy_map(amplitude, 16))}, {});
  const Tessellation dense = dense_net(*surface, 160);
  Rng rng(62);
  for (const double radius : {1e-4, 5e-4, 1.5e-3}) {
    const Scene scene = must(Scene::build({instance_of(surface)}, radius));
    ProxyState state;
    touch(scene, state, Vec3(0.0, 0.0, 4e-3));
    Vec3 place(0.0, 0.0, radius - 6e-4);
    Vec3 heading = Vec3::Zero();
    for (int i = 0; i < 400; ++i) {
      if (i % 50 == 0) heading = 5e-5 * random_direction(rng);
      heading.z() = 0.0;
      place += heading;
      if (place.head<2>().cwiseAbs().maxCoeff() > 6e-3) heading = -heading;
      const ForceSample felt = touch(scene, state, place);
      ASSERT_TRUE(felt.flags.has(TickFlag::contact)) << "radius " << radius << ", tick " << i;
      const double distance = dense.index.closest(state.proxy, infinity).distance;
      ASSERT_NEAR(distance, radius, dense.error + 0.01 * surface->grain()) << "radius " << radius << ", tick " << i;
      ASSERT_GT(state.proxy.z(), surface->coat().lowest());
    }
  }
}

/// As rough as ground: waves of all lengths down to six texels.
HeightMap rough_map(Rng& rng, double height) {
  struct Wave {
    double s, t, turn, size;
  };
  std::vector<Wave> waves;
  double sum = 0.0;
  for (int i = 0; i < 80; ++i) {
    const double most = std::pow(40.0, rng.uniform(0.0, 1.0));
    const double turn = rng.uniform(0.0, 2.0 * std::numbers::pi);
    waves.push_back({std::round(most * std::cos(turn)), std::round(most * std::sin(turn)), rng.uniform(0.0, 6.3),
                     std::pow(most, -0.8)});
    sum += waves.back().size;
  }
  return map_of(256, [&](double s, double t) {
    double here = 0.0;
    for (const Wave& wave : waves)
      here += wave.size / sum * std::cos(2.0 * std::numbers::pi * (wave.s * s + wave.t * t) + wave.turn);
    return 2.0 * height * here;
  });
}

TEST(ProxyBall, comes_to_rest_among_all_that_it_touches) {
  Rng rng(71);
  int held_by_several = 0;
  for (const double radius : {2e-4, 1e-3}) {
    for (const double friction : {0.0, 0.4}) {
      const auto surface = relief_on(mesh_of(plane_grid(0.02, 0.02, 2, 2)), {tiled(rough_map(rng, 1e-3))}, {});
      const Scene scene = must(Scene::build({instance_of(surface, friction, friction)}, radius));
      ProxyState state;
      ProxyCache cache(scene);
      SurfaceCache looked;
      const ReliefView view = surface->view(looked);
      Vec3 place(0.0, 0.0, 2.4e-3);
      Vec3 heading(0.0, 0.0, -5e-5);
      for (int i = 0; i < 600; ++i) {
        if (i % 60 == 59) heading = 6e-5 * random_direction(rng);
        place += heading;
        if (place.head<2>().cwiseAbs().maxCoeff() > 6e-3) heading.head<2>() *= -1.0;
        if ((place.z() < -1.5e-3 && heading.z() < 0.0) || (place.z() > 2.5e-3 && heading.z() > 0.0))
          heading.z() *= -1.0;
        const ForceSample felt = step(scene, state, cache, probe_at(place), tick);
        ASSERT_FALSE(unfinished(felt.flags)) << "radius " << radius << ", tick " << i;
        held_by_several += felt.contact.places.size() > 1 ? 1 : 0;
        // It keeps a little off.
        const double kept = view.nearest(state.proxy, infinity).distance;
        ASSERT_GT(kept, radius * (1.0 - 1e-6)) << "tick " << i;
        if (friction > 0.0 || !felt.flags.has(TickFlag::contact)) continue;
        // Nowhere around is there room nearer to the probe.
        const double here = (state.proxy - place).norm();
        for (int k = 0; k < 24; ++k) {
          const double length = std::pow(10.0, rng.uniform(-6.0, -5.0));
          const Vec3 there = state.proxy + length * random_direction(rng);
          if (here - (there - place).norm() < 1e-2 * length) continue;
          ASSERT_LT(view.nearest(there, infinity).distance, kept + 0.01 * length)
              << "radius " << radius << ", tick " << i << ", " << length << " m off";
        }
      }
    }
  }
  ASSERT_GT(held_by_several, 100);
}

// Faces whose maps meet at unlike heights: walls that stand between two samples of a face.
TEST(ProxyBall, stays_off_walls_between_faces_and_never_comes_behind_them) {
  constexpr double height = 6e-4;
  Rng rng(73);
  int at_walls = 0;
  for (const double radius : {3e-4, 1e-3}) {
    for (const double rho : {0.01, 0.02, 0.05}) {
      const auto flat = [](double at) { return tiled(map_of(4, [at](double, double) { return at; })); };
      const auto surface = relief_on(mesh_of(plane_grid(0.02, 0.02, 4, 4)), {flat(0.0), flat(height)},
                                     {Mapping::per_face, Vec2::Ones(), {FoldMode::keep, Blend::quintic, rho, {}}});
      const Scene scene = must(Scene::build({instance_of(surface, 0.0, 0.0)}, radius));
      ProxyState state;
      ProxyCache cache(scene);
      SurfaceCache looked;
      const ReliefView view = surface->view(looked);
      Vec3 place(0.0, 0.0, height + 1.1 * radius);
      Vec3 heading(0.0, 0.0, -5e-5);
      for (int i = 0; i < 1500; ++i) {
        if (i % 60 == 59) heading = 6e-5 * random_direction(rng);
        place += heading;
        if (place.head<2>().cwiseAbs().maxCoeff() > 8e-3) heading.head<2>() *= -1.0;
        if ((place.z() < -5e-4 && heading.z() < 0.0) || (place.z() > 2.5e-3 && heading.z() > 0.0)) heading.z() *= -1.0;
        step(scene, state, cache, probe_at(place), tick);
        const Foot nearest = view.nearest(state.proxy, infinity);
        ASSERT_GT(nearest.distance, radius * (1.0 - 1e-6)) << "radius " << radius << ", rho " << rho << ", tick " << i;
        ASSERT_GT(view.front(nearest).dot(state.proxy - nearest.point), 0.0) << "tick " << i;
        at_walls += nearest.distance < 1.01 * radius && std::abs(nearest.normal.z()) < 0.7 ? 1 : 0;
      }
    }
  }
  ASSERT_GT(at_walls, 300);
}

TEST(ProxyEnergy, a_stiffer_scene_is_paid_from_the_account) {
  // Amendment 6: at a fixed probe, a change of the scene gives the hand no more than the contact has dissipated.
  const auto surface = relief_on(mesh_of(plane_grid(0.04, 0.04, 4, 4)), {tiled(wavy_map(amplitude))}, {});
  Instance soft = instance_of(surface, 0.5, 0.4);
  Instance hard = soft;
  hard.material.stiffness = 3.0 * stiffness;
  const Scene before = must(Scene::build({soft}, 0.0));
  const Scene after = must(Scene::build({hard}, 0.0));
  const Vec3 probe(1e-3, 0.0, -1e-3);
  {
    ProxyState state;
    touch(before, state, Vec3(1e-3, 0.0, 2e-3));
    touch(before, state, probe);
    const double stored = 0.5 * stiffness * (state.proxy - probe).squaredNorm();
    const double account = state.account.level();
    const ForceSample felt = touch(after, state, probe);
    const double stretch = (felt.proxy - probe).norm();
    const double now = 0.5 * felt.wrench.force.norm() * stretch;
    EXPECT_GT(felt.wrench.force.norm(), 0.0);
    EXPECT_LE(now, stored + account + 1e-12);
    EXPECT_EQ(felt.flags.has(TickFlag::energy_limited), account < 2.0 * stored);
  }
  {
    // After much sliding the account can pay more.
    ProxyState state;
    touch(before, state, Vec3(1e-3, 0.0, 2e-3));
    for (int i = 0; i < 4000; ++i) touch(before, state, probe + Vec3(5e-3 * std::sin(0.01 * i), 0.0, 0.0));
    touch(before, state, probe);
    const double account = state.account.level();
    EXPECT_GT(account, 1e-3);
    ForceSample felt;
    // Handed over within 10 ms.
    for (int i = 0; i < 300; ++i) {
      felt = touch(after, state, probe);
      EXPECT_FALSE(felt.flags.has(TickFlag::energy_limited));
    }
    EXPECT_LT(state.account.level(), account);
    EXPECT_NEAR(felt.wrench.force.norm(), 3.0 * stiffness * (felt.proxy - probe).norm(), 1e-9);
  }
  {
    // What is dissipated is lost to an account that holds nothing.
    SceneSettings none;
    none.energy_capacity = 0.0;
    const Scene poor = must(Scene::build({soft}, none));
    const Scene harder = must(Scene::build({hard}, none));
    ProxyState state;
    touch(poor, state, Vec3(1e-3, 0.0, 2e-3));
    for (int i = 0; i < 4000; ++i) touch(poor, state, probe + Vec3(5e-3 * std::sin(0.01 * i), 0.0, 0.0));
    touch(poor, state, probe);
    EXPECT_EQ(state.account.level(), 0.0);
    const ForceSample felt = touch(harder, state, probe);
    EXPECT_TRUE(felt.flags.has(TickFlag::energy_limited));
    EXPECT_EQ(state.account.flow(Giver::change).paid, 0.0);
    EXPECT_GT(state.account.flow(Giver::change).asked, 1e-4);
  }
}

TEST(ProxyEnergy, a_relief_that_rises_over_a_resting_probe_gives_no_more_than_was_stored) {
  const auto low = relief_on(mesh_of(plane_grid(0.04, 0.04, 4, 4)), {tiled(flat_map(0.0))}, {});
  const auto high = relief_on(mesh_of(plane_grid(0.04, 0.04, 4, 4)), {tiled(flat_map(2e-3))}, {});
  Instance one = instance_of(low);
  Instance other = instance_of(high);
  one.sides = other.sides = Sides::front;
  const Scene before = must(Scene::build({one}, 0.0));
  const Scene after = must(Scene::build({other}, 0.0));
  ProxyState state;
  const Vec3 probe(1e-3, 2e-3, -1e-3);
  touch(before, state, Vec3(1e-3, 2e-3, 5e-3));
  touch(before, state, probe);
  const double stored = 0.5 * stiffness * (state.proxy - probe).squaredNorm();
  const double account = state.account.level();
  double most = 0.0;
  for (int i = 0; i < 20; ++i) {
    const ForceSample felt = touch(after, state, probe);
    ASSERT_GT(felt.proxy.z(), 1.9e-3) << "it is outside the new relief";
    most = std::max(most, 0.5 * felt.wrench.force.norm() * (felt.proxy - probe).norm());
  }
  EXPECT_GT(most, 0.0);
  EXPECT_LE(most, stored + account + 1e-12);
}

// ---- what a tick remembers

TEST(ProxyCache, each_instance_has_one_of_its_own_until_there_is_no_room) {
  ProxyCache cache;
  std::vector<SurfaceCache*> own;
  for (std::uint32_t i = 0; i < most_contacts; ++i) own.push_back(&cache.of(7 * i));
  EXPECT_EQ(std::set<SurfaceCache*>(own.begin(), own.end()).size(), own.size());
  for (std::uint32_t i = most_contacts; i-- > 0;) EXPECT_EQ(&cache.of(7 * i), own[i]) << i;
  // One more takes that of the one that was not asked for longest: now the last.
  EXPECT_EQ(&cache.of(7 * most_contacts), own.back());
  for (std::uint32_t i = 0; i + 1 < most_contacts; ++i) EXPECT_EQ(&cache.of(7 * i), own[i]) << i;
}

}  // namespace
}  // namespace asperity::proxy_test
