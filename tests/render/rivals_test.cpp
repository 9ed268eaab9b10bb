// The relief as geometry: generated around the probe at run time, and as a dense mesh made beforehand. Each is the
// other's oracle, and both are the smooth proxy's.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "asperity/render/contact/generated_geometry.h"
#include "tests/render/fixtures.h"
#include "tests/render/oracle.h"

namespace asperity::rivals_test {
namespace {

using namespace test;

/// A relief whose faces each carry the map, joined over their edges.
std::shared_ptr<const ReliefSurface> stitched(MeshSource source, FoldMode folds, double amplitude = 3e-4) {
  TriangleMesh mesh = mesh_of(std::move(source));
  CoatSettings settings;
  settings.mapping = Mapping::per_face;
  settings.stitching.folds = folds;
  Coat coat = must(Coat::build(mesh, tiled(wavy_map(amplitude)), settings));
  return std::make_shared<const ReliefSurface>(MeshSurface(TriangleIndex::build(std::move(mesh))), std::move(coat));
}

std::shared_ptr<const ReliefSurface> wavy_plane() {
  return coated(plane_grid(0.04, 0.04, 3, 3), wavy_map(5e-4), Mapping::uv);
}
std::shared_ptr<const ReliefSurface> wavy_ball() {
  return coated(icosphere(1, 0.02), wavy_map(3e-4), Mapping::triplanar);
}

/// Where the base is first met from `from` towards `to`.
Vec3 on_base(const ReliefSurface& relief, const Vec3& from, const Vec3& to) {
  return from + relief.base().index().first_hit({from, to}).t * (to - from);
}

/// A probe pressed about 0.3 mm into a sheet, all over it, or into a ball of about 0.02 m, all around it.
std::vector<Vec3> pressed_path(const ReliefSurface& relief, bool round, double radius) {
  std::vector<Vec3> path;
  for (int i = 0; i < 4000; ++i) {
    const double a = 2e-3 * i;
    const double depth = 3e-4 - 2.5e-4 * std::sin(9.0 * a);
    if (round) {
      const Vec3 direction(std::cos(a), std::sin(a) * std::cos(0.3 * a), std::sin(a) * std::sin(0.3 * a));
      path.emplace_back(on_base(relief, 0.1 * direction, Vec3::Zero()) + (radius - depth) * direction);
    } else {
      const Vec3 above(0.015 * std::sin(a), 0.014 * std::cos(1.618 * a), 0.1);
      path.emplace_back(on_base(relief, above, above - 0.2 * Vec3::UnitZ()) + (radius - depth) * Vec3::UnitZ());
    }
  }
  return path;
}

struct Slide {
  std::string name;
  std::shared_ptr<const ReliefSurface> relief;
  bool round = false;  ///< a ball, not a sheet
};

std::vector<Slide> slides() {
  return {{"plane", wavy_plane(), false},
          {"ball", wavy_ball(), true},
          {"stitched sheet", stitched(trial_mesh_b(0.1, {5, 5, 0.008}), FoldMode::keep), false},
          {"stitched ball", stitched(icosphere(1, 0.02), FoldMode::keep), true},
          {"round folds", stitched(icosphere(1, 0.02), FoldMode::round), true}};
}

/// Ticks of a slide, for both rivals.
struct Pair {
  std::vector<ForceSample> generated;
  std::vector<ForceSample> dense;
  double skin = 0.0;
};

Pair felt(const Slide& slide, int subdivisions, double radius, double influence = 0.0) {
  const Scene scenes[2] = {scene_of(slide.relief, GeneratedGeometryLaw{subdivisions, influence}, stiffness, radius),
                           scene_of(slide.relief, DenseMeshLaw{subdivisions}, stiffness, radius)};
  const std::vector<Vec3> path = pressed_path(*slide.relief, slide.round, radius);
  const Vec3 outside = slide.round ? Vec3(1.2 * path.front()) : Vec3(path.front() + 0.01 * Vec3::UnitZ());
  Pair pair;
  pair.skin = scenes[1].instances()[0].dense->surface.skin();
  for (int i = 0; i < 2; ++i) {
    ProxyState state;
    touch(scenes[i], state, outside);
    for (const Vec3& position : path)
      (i == 0 ? pair.generated : pair.dense).push_back(touch(scenes[i], state, position));
  }
  return pair;
}

TEST(GeneratedGeometry, is_the_dense_mesh_of_the_same_subdivision) {
  for (const Slide& slide : slides()) {
    for (const int n : {1, 6, 32}) {
      for (const double radius : {0.0, 1.5e-3}) {
        const Pair pair = felt(slide, n, radius);
        int touching = 0;
        for (std::size_t i = 0; i < pair.dense.size(); ++i) {
          const Vec3 expected = pair.dense[i].wrench.force;
          touching += pair.dense[i].flags.has(TickFlag::contact) ? 1 : 0;
          ASSERT_FALSE(pair.generated[i].flags.has(TickFlag::not_converged)) << slide.name << " at " << i;
          // Corners agree to rounding, and so do forces on faces; where an edge is between, places may differ by skins.
          ASSERT_LT((pair.generated[i].wrench.force - expected).norm(), 3.0 * stiffness * pair.skin)
              << slide.name << ", " << n << " cuts, radius " << radius << ", at " << i;
        }
        EXPECT_GT(touching, 2000) << slide.name;
      }
    }
  }
}

/// A steep relief on a coarse base, whose directions lean far over its faces.
std::shared_ptr<const ReliefSurface> steep(SearchStructure structure) {
  TriangleMesh mesh = mesh_of(icosphere(0, 0.02));
  Coat coat = coat_on(mesh, wavy_map(2e-3), Mapping::triplanar);
  return std::make_shared<const ReliefSurface>(MeshSurface(TriangleIndex::build(std::move(mesh), structure)),
                                               std::move(coat));
}

TEST(GeneratedGeometry, stops_every_motion_where_the_dense_mesh_does) {
  // Facets so small that the relief leans over many of them.
  const int n = 96;
  for (const SearchStructure structure : {SearchStructure::bvh, SearchStructure::octree}) {
    const auto relief = steep(structure);
    const MeshSurface dense(TriangleIndex::build(must(tessellate(*relief, n))));
    Rng rng(41);
    int hits = 0;
    int unknown = 0;
    for (int i = 0; i < 4000; ++i) {
      SurfaceCache hint;
      const double radius = i % 2 == 0 ? 0.0 : rng.uniform(1e-4, 2e-3);
      const Vec3 middle = dense.mesh().corners(random_face(rng, dense.mesh()))[0];
      const Vec3 way = rng.uniform(1e-4, 3e-3) * random_direction(rng);
      const Segment motion{middle - way, middle + way};
      // A motion that begins within the surface's touch may be taken for either.
      if (dense.view(hint).nearest(motion.from, infinity).distance < radius + 3.0 * dense.skin()) continue;
      GeneratedPatch patch;
      patch.start(*relief, LawFacets{n, i % 3 == 0 ? 0.0 : rng.uniform(3e-4, 2e-3)});
      const SweptHit expected = dense.view(hint).sweep(motion, radius, Sides::both);
      const SweptHit hit = patch.segment(motion, radius, Sides::both);
      if (!patch.complete()) {
        ++unknown;
        continue;
      }
      ASSERT_EQ(hit.hit, expected.hit) << i;
      if (!hit.hit) continue;
      ++hits;
      // Both stop within a skin of the facet, however flat they come in.
      const Vec3 between = (hit.t - expected.t) * (motion.to - motion.from);
      ASSERT_LT(std::abs(between.dot(expected.contact.normal)), dense.skin()) << i;
    }
    EXPECT_GT(hits, 800);
    EXPECT_LT(unknown, 80);
  }
}

TEST(GeneratedGeometry, touches_the_planes_that_the_dense_mesh_touches) {
  const int n = 24;
  const auto relief = steep(SearchStructure::bvh);
  const MeshSurface dense(TriangleIndex::build(must(tessellate(*relief, n))));
  Rng rng(43);
  int several = 0;
  for (int i = 0; i < 4000; ++i) {
    // Within touch of an edge: there what counts as a plane has to be settled.
    const std::array<Vec3, 3> corners = dense.mesh().corners(random_face(rng, dense.mesh()));
    const Vec3 p = corners[0] + rng.uniform(0.1, 0.9) * (corners[1] - corners[0]) +
                   rng.uniform(0.6, 1.8) * dense.skin() * random_direction(rng);
    SurfaceCache hint;
    ContactSet expected;
    dense.view(hint).contacts(p, 0.0, Sides::both, expected);
    GeneratedPatch patch;
    patch.start(*relief, LawFacets{n, 0.0});
    // The same thickness, so that both are asked the same.
    ContactSet found;
    patch.contacts(p, 2.0 * (dense.skin() - patch.skin()), Sides::both, found);
    ASSERT_EQ(found.size(), expected.size()) << i;
    several += expected.size() > 1 ? 1 : 0;
    for (const Foot& plane : expected) {
      double nearest = infinity;
      for (const Foot& other : found) nearest = std::min(nearest, (other.normal - plane.normal).norm());
      ASSERT_LT(nearest, 1e-6) << i;
    }
  }
  EXPECT_GT(several, 1000);
}

TEST(GeneratedGeometry, feels_the_same_with_any_influence_radius) {
  const Slide slide{"plane", wavy_plane(), false};
  const Pair derived = felt(slide, 16, 0.0);
  for (const double influence : {1e-4, 3e-4, 2e-3, 1.0}) {
    const Pair pair = felt(slide, 16, 0.0, influence);
    for (std::size_t i = 0; i < pair.dense.size(); ++i) {
      ASSERT_FALSE(pair.generated[i].flags.has(TickFlag::not_converged)) << influence;
      ASSERT_LT((pair.generated[i].wrench.force - derived.generated[i].wrench.force).norm(), 1e-9) << influence;
    }
  }
}

TEST(GeneratedGeometry, names_the_triangle_of_the_base) {
  const Pair pair = felt({"plane", wavy_plane(), false}, 8, 0.0);
  const auto relief = wavy_plane();
  const TriangleMesh& mesh = relief->base().mesh();
  int checked = 0;
  for (const ForceSample& sample : pair.generated) {
    if (!sample.flags.has(TickFlag::contact)) continue;
    // On a sheet without tilt the relief stands straight over its triangle.
    const Vec3 place = barycentric_frame(mesh, sample.contact.element).coordinates(sample.contact.point);
    ASSERT_GT(place.minCoeff(), -1e-9);
    ++checked;
  }
  EXPECT_GT(checked, 2000);
}

TEST(GeneratedGeometry, a_motion_too_long_to_be_looked_at_whole_waits_and_says_so) {
  // Half a metre along a sheet, a tenth of a millimetre over it, in one tick: thousands of facets.
  // A peak far aside makes room for them.
  const auto peak = [](double s, double t) { return s > 0.95 && t > 0.95 ? 5e-4 : 0.0; };
  const auto relief = coated(plane_grid(0.6, 0.02, 60, 2), map_of(64, peak), Mapping::uv);
  const Scene scene = scene_of(relief, GeneratedGeometryLaw{64, 0.0});
  ProxyState state;
  const Vec3 from(-0.25, 1e-3, 1e-4);
  const Vec3 to(0.25, 1e-3, 1e-4);
  touch(scene, state, from);
  const ForceSample first = touch(scene, state, to);
  EXPECT_TRUE(first.flags.has(TickFlag::not_converged));
  EXPECT_GT(first.proxy.x(), from.x());
  EXPECT_LT(first.proxy.x(), to.x());
  ForceSample later = first;
  for (int i = 0; i < 200; ++i) later = touch(scene, state, to);
  EXPECT_FALSE(later.flags.has(TickFlag::not_converged));
  EXPECT_EQ(later.proxy, to);
  EXPECT_EQ(later.wrench.force, Vec3::Zero());
}

TEST(GeneratedGeometry, a_ball_that_touches_more_than_the_buffer_holds_is_held_outside) {
  // A cup of the ball's own radius: it touches everywhere at once, in facets a thousandth of it.
  const double radius = 0.01;
  MeshSource source = trial_mesh_e(6, 1.2, 0.002);
  const double cup = source.positions[0].norm();
  for (Vec3& p : source.positions) p *= radius / cup;
  const auto relief = coated(std::move(source), flat_map(0.0), Mapping::uv);
  const Scene scene = scene_of(relief, GeneratedGeometryLaw{1024, 0.0}, stiffness, radius * 0.9999);
  ProxyState state;
  bool said = false;
  for (int i = 0; i <= 100; ++i) {
    const ForceSample sample = touch(scene, state, Vec3(0.0, 0.0, 0.01 - 1.5e-4 * i));
    said = said || sample.flags.has(TickFlag::not_converged);
    // Through the cup's bottom its centre would be 0.9999 radii below the rim's.
    ASSERT_GT(sample.proxy.z(), -1e-4) << i;
  }
  EXPECT_TRUE(said);
}

TEST(Rivals, nothing_is_passed_at_any_speed) {
  for (const Slide& slide : {slides()[1], slides()[3]}) {
    for (const Law& law : {Law(GeneratedGeometryLaw{}), Law(DenseMeshLaw{16})}) {
      Instance instance;
      instance.surface = slide.relief;
      instance.law = law;
      instance.sides = Sides::front;
      const Scene scene = must(Scene::build({instance}, 0.0));
      Rng rng(17);
      SurfaceCache hint;
      for (int i = 0; i < 200; ++i) {
        ProxyState state;
        const Vec3 direction = random_direction(rng);
        touch(scene, state, 0.024 * direction);
        // Up to 40 m/s, to the other side and back.
        for (int k = 0; k < 3; ++k) {
          const ForceSample sample = touch(scene, state, rng.uniform(0.0, 0.016) * random_direction(rng));
          ASSERT_TRUE(sample.flags.has(TickFlag::contact) || sample.flags.has(TickFlag::not_converged));
          ASSERT_GT(slide.relief->base().eval(sample.proxy, hint).value, -6e-4) << "behind the relief";
        }
      }
    }
  }
}

TEST(Rivals, the_smooth_proxy_agrees_within_the_facets_error) {
  const int n = 64;
  for (const Slide& slide : slides()) {
    const double error = DenseOracle(*slide.relief, n).error();
    ASSERT_LT(error, 2e-5) << slide.name;
    const Scene smooth = scene_of(slide.relief, ProxyLaw{});
    for (const Law& law : {Law(GeneratedGeometryLaw{n, 0.0}), Law(DenseMeshLaw{n})}) {
      const Scene faceted = scene_of(slide.relief, law);
      const std::vector<Vec3> path = pressed_path(*slide.relief, slide.round, 0.0);
      int compared = 0;
      for (std::size_t i = 0; i < path.size(); i += 7) {
        // Shallow enough that there is one nearest place.
        const Vec3 outward = slide.round ? Vec3(path[i].normalized()) : Vec3(Vec3::UnitZ());
        SurfaceCache hint;
        const Foot foot = slide.relief->view(hint).nearest(path[i], infinity);
        const Vec3 probe = foot.point - 4e-5 * slide.relief->view(hint).front(foot);
        const Vec3 outside = foot.point + 2e-3 * outward;
        const ForceSample expected = poke(smooth, outside, probe);
        const ForceSample sample = poke(faceted, outside, probe);
        if (!expected.flags.has(TickFlag::contact)) continue;
        ++compared;
        ASSERT_NEAR(sample.contact.penetration, expected.contact.penetration, 1.5 * error)
            << slide.name << ", " << law_name(law) << " at " << i;
      }
      EXPECT_GT(compared, 500) << slide.name;
    }
  }
}

RC_GTEST_PROP(Rivals, render_no_force_over_the_relief_and_its_facets, (std::uint64_t seed)) {
  static const auto relief = wavy_plane();
  static const double error = DenseOracle(*relief, 16).error();
  static const Scene scenes[2] = {scene_of(relief, GeneratedGeometryLaw{16, 0.0}), scene_of(relief, DenseMeshLaw{16})};
  Rng rng(seed);
  for (const Scene& scene : scenes) {
    ProxyState state;
    for (int i = 0; i < 20; ++i) {
      const Vec3 above(rng.uniform(-0.018, 0.018), rng.uniform(-0.018, 0.018), 2e-3);
      SurfaceCache hint;
      const SweptHit hit = relief->view(hint).first_touch({above, above - 4e-3 * Vec3::UnitZ()}, Sides::both);
      // Slopes of up to one in three make of a distance at most half as much again along z.
      const Vec3 p = hit.contact.point + (1.5 * error + 1e-8 + rng.uniform(0.0, 1e-3)) * Vec3::UnitZ();
      // Straight down, so that no other wave is in the way.
      touch(scene, state, Vec3(p.x(), p.y(), 2e-3));
      const ForceSample sample = touch(scene, state, p);
      RC_ASSERT(sample.wrench.force == Vec3::Zero());
      RC_ASSERT(sample.contact.count == 0U);
      RC_ASSERT(sample.proxy == p);
    }
  }
}

TEST(Rivals, feel_a_mesh_in_millimetres_as_the_same_mesh_in_metres) {
  const auto metres = coated(icosphere(2, 0.02), wavy_map(5e-4), Mapping::triplanar);
  const auto millimetres = coated(icosphere(2, 20.0), wavy_map(5e-4), Mapping::triplanar, 0.01, 1e-3);
  // Along no facet's edge: there rounding decides which one is felt.
  const Quat turn(Eigen::AngleAxisd(0.4, Vec3(1.0, 2.0, 3.0).normalized()));
  std::vector<Vec3> path = pressed_path(*metres, true, 0.0);
  for (Vec3& p : path) p = turn * p;
  for (const Law& law : {Law(GeneratedGeometryLaw{16, 0.0}), Law(DenseMeshLaw{16})}) {
    const auto expected = slide(scene_of(metres, law), path, 1.2 * path.front());
    const auto forces = slide(scene_of(millimetres, law), path, 1.2 * path.front());
    for (std::size_t i = 0; i < path.size(); ++i)
      ASSERT_LT((forces[i] - expected[i]).norm(), 1e-5) << law_name(law) << " at " << i;
    EXPECT_GT(largest_jump(expected), 0.001);
  }
}

TEST(Rivals, feel_facets_where_the_proxy_feels_none) {
  // Pressed by a steady depth along a cosine, eight facets a wave: the facets' jumps are many times the smooth ones.
  const auto relief = reference_surface(0.0);
  std::vector<Vec3> path;
  for (const Vec3& p : line(Vec3(-4e-3, 1e-3, 0.0), Vec3(4e-3, 1e-3, 0.0), 4000)) {
    SurfaceCache hint;
    const Foot foot = relief->view(hint).nearest(
        Vec3(p.x(), p.y(), 5.5e-4 * std::cos(2.0 * std::numbers::pi * p.x() / 5e-3)), infinity);
    path.emplace_back(foot.point - 2e-4 * relief->view(hint).front(foot));
  }
  const Vec3 outside = path.front() + 2e-3 * Vec3::UnitZ();
  const double smooth = largest_jump(slide(scene_of(relief, ProxyLaw{}), path, outside));
  const double faceted = largest_jump(slide(scene_of(relief, DenseMeshLaw{32}), path, outside));
  EXPECT_GT(faceted, 5.0 * smooth);
}

TEST(Rivals, stay_in_contact_when_the_scene_changes) {
  for (const Law& law : {Law(GeneratedGeometryLaw{}), Law(DenseMeshLaw{16})}) {
    Instance instance;
    instance.surface = wavy_ball();
    instance.law = law;
    instance.sides = Sides::front;
    Scene scene = must(Scene::build({instance}, 0.0));
    ProxyState state;
    touch(scene, state, Vec3(0.0, 0.0, 0.025));
    const Vec3 probe(1e-4, 2e-4, 0.019);
    const ForceSample before = touch(scene, state, probe);
    ASSERT_TRUE(before.flags.has(TickFlag::contact));
    // Moved up by 2 mm: the proxy is inside, and has to come out to the front.
    instance.world_from_object.position.z() = 2e-3;
    scene = must(Scene::build({instance}, 0.0));
    const ForceSample after = touch(scene, state, probe);
    ASSERT_TRUE(after.flags.has(TickFlag::contact)) << law_name(law);
    EXPECT_NEAR((after.proxy - before.proxy).z(), 2e-3, 5e-4) << law_name(law);
  }
}

TEST(Rivals, meet_other_surfaces_jointly) {
  // A wall of plain geometry, and one that the proxy law feels, beside the relief: held in the corner by both.
  MeshSource wall = plane_grid(0.05, 0.05, 2, 2);
  for (Vec3& p : wall.positions) p = Vec3(0.005, p.x(), p.y());
  for (const bool smooth_wall : {false, true}) {
    std::vector<Vec3> forces;
    for (const Law& law : {Law(GeneratedGeometryLaw{16, 0.0}), Law(DenseMeshLaw{16})}) {
      Instance floor;
      floor.surface = wavy_plane();
      floor.law = law;
      Instance side;
      side.surface = smooth_wall ? Surface(coated(wall, flat_map(0.0), Mapping::uv)) : Surface(bare(wall));
      side.law = smooth_wall ? Law(ProxyLaw{}) : Law(GodObjectLaw{});
      const Scene scene = must(Scene::build({floor, side}, 0.0));
      ProxyState state;
      touch(scene, state, Vec3(0.0, 1e-3, 3e-3));
      touch(scene, state, Vec3(0.004, 1e-3, 1e-3));
      const ForceSample sample = touch(scene, state, Vec3(0.006, 1e-3, -1.5e-3));
      EXPECT_EQ(sample.contact.count, 2U) << law_name(law) << smooth_wall;
      EXPECT_LT(sample.wrench.force.x(), -0.9) << law_name(law);
      EXPECT_GT(sample.wrench.force.z(), 0.5) << law_name(law);
      forces.push_back(sample.wrench.force);
    }
    EXPECT_LT((forces[0] - forces[1]).norm(), smooth_wall ? 1e-4 : 1e-9) << smooth_wall;
  }
}

Instance plate(Law law, bool coat = true) {
  Instance instance;
  instance.name = "plate";
  instance.surface = coat ? Surface(wavy_plane()) : Surface(bare(plane_grid(0.04, 0.04, 2, 2)));
  instance.law = std::move(law);
  return instance;
}

TEST(RivalScenes, need_a_coat) {
  for (const char* law : {"generated-geometry", "dense-mesh"}) {
    const auto scene = Scene::build({plate(named(law), false)}, 0.0);
    ASSERT_FALSE(scene.ok());
    EXPECT_EQ(scene.error().code, ErrorCode::unsupported_pair);
    EXPECT_EQ(scene.error().place, "surfaces[0].law");
    EXPECT_NE(scene.error().what.find(law), std::string::npos);
    EXPECT_TRUE(Scene::build({plate(named(law))}, 1e-3).ok()) << "both touch with a ball, too";
  }
}

TEST(RivalScenes, each_bad_option_is_named) {
  const std::pair<Law, const char*> bad[] = {
      {GeneratedGeometryLaw{0, 0.0}, "subdivisions"},
      {GeneratedGeometryLaw{GeneratedGeometryLaw::most_subdivisions + 1, 0.0}, "subdivisions"},
      {GeneratedGeometryLaw{8, -1.0}, "influence_radius"},
      {GeneratedGeometryLaw{8, std::nan("")}, "influence_radius"},
      {GeneratedGeometryLaw{8, infinity}, "influence_radius"},
      {DenseMeshLaw{-1}, "subdivisions"}};
  for (const auto& [law, option] : bad) {
    const auto scene = Scene::build({plate(law)}, 0.0);
    ASSERT_FALSE(scene.ok()) << option;
    EXPECT_EQ(scene.error().code, ErrorCode::bad_value);
    EXPECT_EQ(scene.error().place, std::string("surfaces[0].law.") + option);
    EXPECT_FALSE(scene.error().accepted.empty());
  }
  const auto scene = Scene::build({plate(GodObjectLaw{}), plate(DenseMeshLaw{2000})}, 0.0);
  ASSERT_FALSE(scene.ok());
  EXPECT_EQ(scene.error().code, ErrorCode::too_large);
  EXPECT_EQ(scene.error().place, "surfaces[1].law.subdivisions");
}

TEST(RivalScenes, share_the_dense_mesh_until_it_no_longer_fits) {
  const Scene first = must(Scene::build({plate(DenseMeshLaw{8})}, 0.0));
  const Instance& made = first.instances()[0];
  ASSERT_NE(made.dense, nullptr);
  EXPECT_EQ(made.dense->surface.mesh().triangles().size(), 18U * 64U);
  const Scene without = must(Scene::build({plate(GeneratedGeometryLaw{8, 0.0})}, 0.0));
  EXPECT_EQ(without.instances()[0].dense, nullptr);
  EXPECT_GE(first.memory_bytes(), without.memory_bytes() + made.dense->surface.index().memory_bytes());

  Instance stiffer = made;
  stiffer.material.stiffness *= 2.0;
  EXPECT_EQ(must(Scene::build({stiffer}, 0.0)).instances()[0].dense, made.dense);
  Instance finer = made;
  finer.law = DenseMeshLaw{9};
  EXPECT_EQ(must(Scene::build({finer}, 0.0)).instances()[0].dense->subdivisions, 9);
  Instance other = made;
  other.surface = wavy_plane();
  EXPECT_NE(must(Scene::build({other}, 0.0)).instances()[0].dense, made.dense);
  Instance changed = made;
  changed.law = ProxyLaw{};
  EXPECT_EQ(must(Scene::build({changed}, 0.0)).instances()[0].dense, nullptr);
  const Scene chosen = must(Scene::build({plate(DenseMeshLaw{})}, 0.0));
  EXPECT_EQ(chosen.instances()[0].dense->subdivisions,
            texel_subdivisions(**std::get_if<std::shared_ptr<const ReliefSurface>>(&made.surface)));
}

TEST(DenseOracleTest, bounds_the_crossing_of_a_relief_known_by_formula) {
  // Straight down onto a plane's waves the crossing is the map's own height.
  const HeightMap map = wavy_map(5e-4);
  const auto relief = coated(plane_grid(0.04, 0.04, 3, 3), map, Mapping::uv);
  const DenseOracle oracle(*relief, 24);
  ASSERT_LT(oracle.error(), 1e-5);
  Rng rng(5);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 from(rng.uniform(-0.019, 0.019), rng.uniform(-0.019, 0.019), 2e-3);
    const Segment motion{from, from - 4e-3 * Vec3::UnitZ()};
    const double height = map.height_at(Vec2(from.x() / 0.04 + 0.5, from.y() / 0.04 + 0.5));
    const double exact = (from.z() - height) / 4e-3;
    const DenseOracle::Crossing crossing = oracle.first_crossing(motion);
    ASSERT_TRUE(crossing.possible && crossing.certain);
    ASSERT_LE(crossing.earliest, exact);
    ASSERT_GE(crossing.latest, exact);
    // No wider than the error is on slopes of up to one in three.
    ASSERT_LT((crossing.latest - crossing.earliest) * 4e-3, 4.0 * oracle.error());
  }
  EXPECT_FALSE(oracle.first_crossing({Vec3(-0.01, 0.0, 6e-4), Vec3(0.01, 0.0, 6e-4)}).possible);
}

TEST(DenseOracleTest, the_relief_is_first_crossed_where_the_facets_say) {
  for (const Slide& slide : slides()) {
    const DenseOracle oracle(*slide.relief, 32);
    Rng rng(23);
    SurfaceCache hint;
    int certain = 0;
    for (int i = 0; i < 1500; ++i) {
      Vec3 middle = slide.round ? Vec3(0.02 * random_direction(rng)) : random_point(rng, 0.012);
      if (!slide.round) middle.z() *= 0.05;
      const Vec3 way = rng.uniform(0.5e-3, 8e-3) * random_direction(rng);
      const Segment motion{middle - way, middle + way};
      const DenseOracle::Crossing crossing = oracle.first_crossing(motion);
      const SweptHit hit = slide.relief->view(hint).first_touch(motion, Sides::both);
      const double skin = slide.relief->skin() / (2.0 * way.norm());
      if (!crossing.possible) {
        ASSERT_FALSE(hit.hit) << slide.name << " at " << i;
      } else if (crossing.certain) {
        ++certain;
        ASSERT_TRUE(hit.hit) << slide.name << " at " << i;
        ASSERT_LE(hit.t, crossing.latest + skin) << slide.name << " at " << i;
      }
      if (hit.hit) {
        ASSERT_GE(hit.t, crossing.earliest - skin) << slide.name << " at " << i;
      }
    }
    EXPECT_GT(certain, 400) << slide.name;
  }
}

}  // namespace
}  // namespace asperity::rivals_test
