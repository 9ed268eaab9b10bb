#include "asperity/render/contact/planes.h"
#include "asperity/render/step.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/surface/coats.h"

namespace asperity::constraint_solve_test {
namespace {

using namespace test;

ConstraintPlane plane(const Vec3& normal, double offset, double skin = 0.0) {
  return {normal.normalized(), offset, skin, 0, {}};
}

/// The same quadratic programme by Hildreth's dual coordinate ascent: slow, and nothing like an active set.
Vec3 dual_ascent(const Vec3& goal, const PlaneSet& planes) {
  std::vector<double> multipliers(planes.size(), 0.0);
  Vec3 x = goal;
  for (int round = 0; round < 20000; ++round) {
    double change = 0.0;
    for (std::size_t i = 0; i < planes.size(); ++i) {
      const double wanted = std::max(0.0, multipliers[i] + planes[i].offset - planes[i].normal.dot(x));
      x += (wanted - multipliers[i]) * planes[i].normal;
      change = std::max(change, std::abs(wanted - multipliers[i]));
      multipliers[i] = wanted;
    }
    if (change < 1e-15) break;
  }
  return x;
}

/// Planes that all leave a ball of 0.1 around some point free.
PlaneSet random_feasible_planes(Rng& rng, std::uint32_t most) {
  PlaneSet planes;
  const Vec3 inside = random_point(rng, 1.0);
  const std::uint32_t count = rng.below(most + 1);
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec3 normal = random_direction(rng);
    planes.push_back(plane(normal, normal.dot(inside) - rng.uniform(0.1, 1.0)));
  }
  return planes;
}

/// Karush, Kuhn and Tucker: necessary and sufficient for the nearest point of a convex set.
void expect_optimal(const Vec3& goal, const PlaneSet& planes, const PlaneProjection& answer, double tolerance) {
  Vec3 moved = Vec3::Zero();
  for (const PlaneProjection::Active& active : answer.active) {
    RC_ASSERT(active.multiplier > 0.0);
    const ConstraintPlane& one = planes[active.plane];
    RC_ASSERT(std::abs(one.normal.dot(answer.point) - one.offset) <= tolerance);
    moved += active.multiplier * one.normal;
  }
  RC_ASSERT((goal + moved - answer.point).norm() <= tolerance);
  for (const ConstraintPlane& one : planes) RC_ASSERT(one.normal.dot(answer.point) >= one.offset - tolerance);
}

RC_GTEST_PROP(ProjectOntoPlanes, answers_the_optimum_of_random_sets, (std::uint64_t seed)) {
  Rng rng(seed);
  const PlaneSet planes = random_feasible_planes(rng, static_cast<std::uint32_t>(PlaneSet::capacity()));
  const Vec3 goal = random_point(rng, 2.0);
  const PlaneProjection answer = project_onto_planes(goal, planes, false);
  RC_ASSERT(answer.feasible);
  // Nearly parallel planes meet far away: their corner carries the rounding of that.
  expect_optimal(goal, planes, answer, 1e-9);
}

RC_GTEST_PROP(ProjectOntoPlanes, agrees_with_dual_ascent, (std::uint64_t seed)) {
  Rng rng(seed);
  const PlaneSet planes = random_feasible_planes(rng, 6);
  const Vec3 goal = random_point(rng, 2.0);
  const PlaneProjection answer = project_onto_planes(goal, planes, false);
  const Vec3 oracle = dual_ascent(goal, planes);
  // The oracle is never nearer than the answer, and as near up to how far it got.
  RC_ASSERT((answer.point - oracle).norm() <= 1e-5);
}

RC_GTEST_PROP(ProjectOntoPlanes, a_goal_within_the_planes_stays_exactly, (std::uint64_t seed)) {
  Rng rng(seed);
  PlaneSet planes;
  const Vec3 goal = random_point(rng, 1.0);
  for (int i = 0; i < 10; ++i) {
    const Vec3 normal = random_direction(rng);
    planes.push_back(plane(normal, normal.dot(goal) - rng.uniform(1e-12, 1.0)));
  }
  const PlaneProjection answer = project_onto_planes(goal, planes, false);
  RC_ASSERT(answer.feasible);
  RC_ASSERT(answer.point == goal);
  RC_ASSERT(answer.active.empty());
}

RC_GTEST_PROP(ProjectOntoPlanes, duplicates_and_parallels_change_nothing, (std::uint64_t seed)) {
  Rng rng(seed);
  PlaneSet planes = random_feasible_planes(rng, 4);
  const Vec3 goal = random_point(rng, 2.0);
  const PlaneProjection expected = project_onto_planes(goal, planes, false);
  const std::size_t count = planes.size();
  for (std::size_t i = 0; i < count; ++i) {
    planes.push_back(planes[i]);
    ConstraintPlane lower = planes[i];
    lower.offset -= rng.uniform(0.0, 1.0);
    planes.push_back(lower);
    // The same plane up to rounding.
    ConstraintPlane nearly = planes[i];
    nearly.normal = (nearly.normal + random_point(rng, 1e-15)).normalized();
    nearly.offset -= 1e-14;
    planes.push_back(nearly);
  }
  const PlaneProjection answer = project_onto_planes(goal, planes, false);
  RC_ASSERT(answer.feasible);
  RC_ASSERT((answer.point - expected.point).norm() <= 1e-9);
}

TEST(ProjectOntoPlanes, opposite_planes_hold_a_slab_and_refuse_an_empty_one) {
  PlaneSet slab;
  slab.push_back(plane(Vec3::UnitZ(), -1.0));
  slab.push_back(plane(-Vec3::UnitZ(), -1.0));
  EXPECT_EQ(project_onto_planes(Vec3(1.0, 2.0, 5.0), slab, false).point, Vec3(1.0, 2.0, 1.0));
  EXPECT_EQ(project_onto_planes(Vec3(1.0, 2.0, -5.0), slab, false).point, Vec3(1.0, 2.0, -1.0));
  EXPECT_EQ(project_onto_planes(Vec3(1.0, 2.0, 0.5), slab, false).point, Vec3(1.0, 2.0, 0.5));
  PlaneSet empty;
  empty.push_back(plane(Vec3::UnitZ(), 1.0));
  empty.push_back(plane(-Vec3::UnitZ(), 1.0));
  const PlaneProjection answer = project_onto_planes(Vec3::Zero(), empty, false);
  EXPECT_FALSE(answer.feasible);
  EXPECT_TRUE(answer.point.allFinite());
}

TEST(ProjectOntoPlanes, a_thin_slab_between_opposite_planes_is_a_point_of_it) {
  PlaneSet slab;
  slab.push_back(plane(Vec3(0.3, -0.2, 1.0), 0.4));
  slab.push_back(plane(-Vec3(0.3, -0.2, 1.0), -0.4));
  const Vec3 goal(1.0, 2.0, 3.0);
  const PlaneProjection answer = project_onto_planes(goal, slab, false);
  EXPECT_TRUE(answer.feasible);
  EXPECT_NEAR(slab[0].normal.dot(answer.point), 0.4, 1e-14);
  EXPECT_LT((answer.point - goal).cross(slab[0].normal).norm(), 1e-14);
}

TEST(ProjectOntoPlanes, two_and_three_planes_hold_edge_and_corner) {
  PlaneSet planes;
  planes.push_back(plane(Vec3::UnitX(), 0.0));
  planes.push_back(plane(Vec3::UnitY(), 0.0));
  PlaneProjection answer = project_onto_planes(Vec3(-1.0, -2.0, -3.0), planes, false);
  EXPECT_EQ(answer.point, Vec3(0.0, 0.0, -3.0));
  EXPECT_EQ(answer.active.size(), 2U);
  planes.push_back(plane(Vec3::UnitZ(), 0.0));
  answer = project_onto_planes(Vec3(-1.0, -2.0, -3.0), planes, false);
  EXPECT_EQ(answer.point, Vec3(0.0, 0.0, 0.0));
  EXPECT_EQ(answer.active.size(), 3U);
}

TEST(ProjectOntoPlanes, the_skin_is_added_when_asked_for) {
  PlaneSet planes;
  planes.push_back(plane(Vec3::UnitZ(), 1.0, 0.25));
  EXPECT_EQ(project_onto_planes(Vec3::Zero(), planes, true).point, Vec3(0.0, 0.0, 1.25));
  EXPECT_EQ(project_onto_planes(Vec3::Zero(), planes, false).point, Vec3(0.0, 0.0, 1.0));
  EXPECT_EQ(onto_plane(Vec3::Zero(), planes[0]), Vec3(0.0, 0.0, 1.25));
  EXPECT_EQ(onto_plane(Vec3(0.0, 0.0, 2.0), planes[0]), Vec3(0.0, 0.0, 2.0));
}

/// A large square of two triangles with this normal, `offset` along it from the origin.
std::shared_ptr<const MeshSurface> square(const Vec3& normal, double offset, double half) {
  const Vec3 u = half * normal.unitOrthogonal();
  const Vec3 v = normal.cross(u);
  const Vec3 centre = offset * normal;
  MeshSource source;
  source.positions = {centre - u - v, centre + u - v, centre + u + v, centre - u + v};
  source.triangles = {{0, 1, 2}, {0, 2, 3}};
  return must(make_mesh_surface(std::move(source)));
}

RC_GTEST_PROP(JointSolve, reaches_the_nearest_point_of_a_convex_cell_within_one_tick, (std::uint64_t seed)) {
  Rng rng(seed);
  std::vector<Instance> walls;
  PlaneSet planes;
  for (int i = 0; i < 5; ++i) {
    const Vec3 normal = random_direction(rng);
    const double offset = -rng.uniform(0.1, 1.0);
    Instance wall;
    wall.name = "wall";
    wall.surface = square(normal, offset, 100.0);
    wall.law = GodObjectLaw{};
    planes.push_back(plane(normal, offset, base_of(wall.surface)->skin()));
    walls.push_back(std::move(wall));
  }
  const Scene scene = must(Scene::build(std::move(walls), 0.0));
  const Vec3 goal = random_point(rng, 3.0);
  ProxyState state;
  step(scene, state, {}, Seconds(1e-3));
  ProbeSample probe;
  probe.pose.position = goal;
  const ForceSample felt = step(scene, state, probe, Seconds(1e-3));
  RC_ASSERT(!unfinished(felt.flags));
  for (const ConstraintPlane& one : planes) RC_ASSERT(one.normal.dot(state.proxy) >= one.offset);
  const PlaneProjection best = project_onto_planes(goal, planes, true);
  RC_ASSERT((state.proxy - best.point).norm() <= 1e-3);
  RC_ASSERT(std::abs((state.proxy - goal).norm() - (best.point - goal).norm()) <= 1e-6);
}

}  // namespace
}  // namespace asperity::constraint_solve_test
