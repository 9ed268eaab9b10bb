#include "asperity/surface/relief/view.h"

#include <gtest/gtest.h>

#include "tests/surface/balls.h"
#include "tests/surface/coats.h"

namespace asperity::relief_surface_test {
namespace {

using namespace test;

constexpr double side = 0.04;

/// The relief over the square as a mesh of its own: the same heights, read from the map at the vertices.
TriangleIndex dense_plane(const HeightMap& map, int cells) {
  MeshSource source = plane_grid(side, side, cells, cells);
  for (Vec3& p : source.positions) p.z() = map.sample(Vec2(p.x() / side + 0.5, p.y() / side + 0.5)).height;
  return TriangleIndex::build(mesh_of(std::move(source)));
}

TEST(ReliefSegment, agrees_with_a_dense_displaced_mesh) {
  const HeightMap map = wavy_map(1e-3, 32);
  const auto relief = coated(plane_grid(side, side, 4, 4), map, Mapping::uv);
  const TriangleIndex dense = dense_plane(map, 256);
  const double texel = relief->coat().texel_size();
  Rng rng(31);
  SurfaceCache cache;
  int hits = 0;
  for (int i = 0; i < 3000; ++i) {
    const double reach = 0.45 * side;
    const Vec3 from(rng.uniform(-reach, reach), rng.uniform(-reach, reach), rng.uniform(0.0015, 0.004));
    const Vec3 to(rng.uniform(-reach, reach), rng.uniform(-reach, reach), rng.uniform(-0.004, -0.0015));
    const Segment motion = i % 2 == 0 ? Segment{from, to} : Segment{to, from};
    const FirstHit oracle = dense.first_hit(motion);
    const SweptHit hit = relief->view(cache).first_touch(motion, Sides::both);
    ASSERT_NE(oracle.face, no_index);
    ASSERT_TRUE(hit.hit) << i;
    const double length = (motion.to - motion.from).norm();
    // A grazing crest may be met by one of the two and missed by the other: a texel, but rarely.
    hits += std::abs(hit.t - oracle.t) * length < 0.02 * texel ? 1 : 0;
    ASSERT_NEAR(hit.t * length, oracle.t * length, length) << i;
    const Vec3 touch = motion.from + hit.t * (motion.to - motion.from);
    ASSERT_LT(std::abs(relief->eval(touch, cache).value), 1e-5 * texel);
  }
  EXPECT_GE(hits, 2990);
}

TEST(ReliefSegment, nothing_is_met_above_the_highest_point) {
  const auto relief = coated(plane_grid(side, side, 4, 4), wavy_map(1e-3, 32), Mapping::uv);
  SurfaceCache cache;
  EXPECT_FALSE(relief->view(cache).first_touch({Vec3(-0.01, 0.0, 0.0011), Vec3(0.01, 0.005, 0.0012)}, Sides::both).hit);
  EXPECT_FALSE(relief->view(cache).first_touch({Vec3(0.0, 0.0, 0.002), Vec3(0.0, 0.0, 0.002)}, Sides::both).hit);
}

TEST(ReliefSegment, front_alone_is_touched_from_outside_only) {
  const auto relief = coated(plane_grid(side, side, 4, 4), flat_map(0.5e-3), Mapping::uv);
  SurfaceCache cache;
  const Segment down{Vec3(0.001, 0.002, 0.002), Vec3(0.001, 0.002, -0.002)};
  const Segment up{down.to, down.from};
  const SweptHit entered = relief->view(cache).first_touch(down, Sides::front);
  ASSERT_TRUE(entered.hit);
  EXPECT_NEAR(entered.t, 1.5 / 4.0, 5e-6);
  EXPECT_LT((entered.contact.normal - Vec3::UnitZ()).norm(), 1e-9);
  EXPECT_FALSE(relief->view(cache).first_touch(up, Sides::front).hit);
  const SweptHit left = relief->view(cache).first_touch(up, Sides::both);
  ASSERT_TRUE(left.hit);
  EXPECT_NEAR(left.t, 2.5 / 4.0, 5e-6);
  EXPECT_LT((left.contact.normal + Vec3::UnitZ()).norm(), 1e-9)
      << "the side that is touched faces where the motion came from";
}

TEST(ReliefSegment, a_ball_stops_one_radius_above_a_flat_coat) {
  const auto relief = coated(plane_grid(side, side, 4, 4), flat_map(0.5e-3), Mapping::uv);
  SurfaceCache cache;
  const double t = ball_touch({Vec3(0.001, 0.002, 0.004), Vec3(0.001, 0.002, 0.0)}, 1e-3,
                              [&](const Vec3& p) { return relief->view(cache).nearest(p, infinity); });
  ASSERT_LE(t, 1.0);
  EXPECT_NEAR(4e-3 * (1.0 - t), 1.5e-3, 1e-8);
}

/// Value and gradient against central differences at points whose foot stays inside one face.
void expect_gradient(const ReliefSurface& relief, const Vec3& p, int& checked) {
  SurfaceCache cache;
  const double h = 1e-7;
  const FieldSample here = relief.eval(p, cache);
  Vec3 expected;
  for (int k = 0; k < 3; ++k) {
    const FieldSample ahead = relief.eval(p + h * Vec3::Unit(k), cache);
    const FieldSample behind = relief.eval(p - h * Vec3::Unit(k), cache);
    if (ahead.element != here.element || behind.element != here.element) return;
    expected[k] = (ahead.value - behind.value) / (2.0 * h);
  }
  ++checked;
  ASSERT_LT((expected - here.gradient).norm(), 1e-4) << p.transpose();
}

TEST(ReliefEval, gradient_agrees_with_finite_differences) {
  Rng rng(3);
  int checked = 0;
  const auto plane = coated(plane_grid(side, side, 4, 4), wavy_map(1e-3), Mapping::uv);
  const auto ball = coated(icosphere(2, 0.02), wavy_map(1e-3), Mapping::triplanar);
  for (int i = 0; i < 500; ++i) {
    expect_gradient(*plane, random_point(rng, 0.4 * side), checked);
    const TriangleMesh& mesh = ball->base().mesh();
    const std::uint32_t face = random_face(rng, mesh);
    const Vec3 over =
        point_on(mesh, face, random_barycentric(rng, 0.1)) + rng.uniform(-3e-4, 3e-4) * mesh.face_normal(face);
    expect_gradient(*ball, over, checked);
  }
  EXPECT_GT(checked, 900);
}

TEST(ReliefEval, value_is_the_height_over_the_relief_on_a_plane) {
  const HeightMap map = wavy_map(1e-3);
  const auto relief = coated(plane_grid(side, side, 4, 4), map, Mapping::uv);
  Rng rng(9);
  SurfaceCache cache;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 p = random_point(rng, 0.4 * side);
    const double height = map.sample(Vec2(p.x() / side + 0.5, p.y() / side + 0.5)).height;
    const FieldSample sample = relief->eval(p, cache);
    ASSERT_NEAR(sample.value, p.z() - height, 1e-9);
    ASSERT_NEAR(sample.height, height, 1e-9);
  }
}

TEST(ReliefEval, a_coat_of_height_zero_is_the_base) {
  const auto relief = coated(random_closed_mesh(3, 2, 0.02, 0.4), flat_map(0.0), Mapping::triplanar);
  Rng rng(10);
  SurfaceCache one;
  SurfaceCache other;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 p = random_point(rng, 0.03);
    const FieldSample a = relief->eval(p, one);
    const FieldSample b = relief->base().eval(p, other);
    // Shell heights are not distances; inside and outside, and where the surface is, they agree.
    ASSERT_EQ(a.value > 0.0, b.value > 0.0);
    const Foot foot = relief->view(one).nearest(p, infinity);
    ASSERT_NEAR(foot.distance, std::abs(b.value), 1e-9);
  }
}

TEST(ReliefClosest, agrees_with_eval_near_the_surface) {
  const auto relief = coated(icosphere(2, 0.02), wavy_map(5e-4), Mapping::triplanar);
  const TriangleMesh& mesh = relief->base().mesh();
  Rng rng(4);
  SurfaceCache cache;
  for (int i = 0; i < 1000; ++i) {
    const std::uint32_t face = random_face(rng, mesh);
    const Vec3 barycentric = random_barycentric(rng, 0.1);
    const double height = relief->coat().sample(mesh, face, barycentric).height;
    const double off = rng.uniform(-1e-6, 1e-6);
    const Vec3 p = point_on(mesh, face, barycentric) + (height + off) * mesh.face_normal(face);
    const FieldSample sample = relief->eval(p, cache);
    const Foot foot = relief->view(cache).nearest(p, infinity);
    ASSERT_TRUE(foot.found());
    ASSERT_NEAR(foot.distance, std::abs(sample.value) / sample.gradient.norm(), 0.01 * std::abs(off) + 1e-9);
    ASSERT_NEAR((p - foot.point).norm(), foot.distance, 1e-15);
    ASSERT_NEAR(foot.normal.norm(), 1.0, 1e-12);
    // First order: what is left is of the order of the distance squared over a texel.
    ASSERT_LT(std::abs(relief->eval(foot.point, cache).value), 0.01 * std::abs(off) + 1e-15);
    ASSERT_FALSE(relief->view(cache).nearest(p, 0.5 * foot.distance).found());
  }
}

TEST(ReliefClosest, a_ball_has_the_plane_within_its_reach_and_nothing_beyond) {
  const auto relief = coated(plane_grid(side, side, 4, 4), flat_map(0.5e-3), Mapping::uv);
  SurfaceCache cache;
  const Foot near = relief->view(cache).nearest(Vec3(0.001, 0.002, 0.0014), 1e-3);
  ASSERT_TRUE(near.found());
  EXPECT_NEAR(near.point.z(), 0.5e-3, 1e-9);
  EXPECT_FALSE(relief->view(cache).nearest(Vec3(0.001, 0.002, 0.0016), 1e-3).found());
}

TEST(ReliefSurfaceTest, bounds_hold_the_relief) {
  const auto relief = coated(icosphere(2, 0.02), wavy_map(1e-3), Mapping::triplanar);
  const Box bounds = relief->bounds();
  const TriangleMesh& mesh = relief->base().mesh();
  Rng rng(6);
  for (int i = 0; i < 2000; ++i) {
    const std::uint32_t face = random_face(rng, mesh);
    const Vec3 barycentric = random_barycentric(rng);
    const Vec3 p = point_on(mesh, face, barycentric) +
                   relief->coat().sample(mesh, face, barycentric).height * mesh.face_normal(face);
    ASSERT_TRUE((p.array() >= bounds.lower.array()).all() && (p.array() <= bounds.upper.array()).all());
  }
  EXPECT_EQ(relief->prisms().half_height(), relief->coat().amplitude_bound());
}

// The mesh is named once; what comes out is what a coat laid by hand gives.
TEST(MakeRelief, is_the_relief_of_a_coat_on_that_very_mesh) {
  const auto base = must(make_mesh_surface(icosphere(2, 0.02)));
  const auto by_hand = coated(icosphere(2, 0.02), wavy_map(0.5e-3), Mapping::triplanar);
  const Mesostructure maps = must(Mesostructure::build(wavy_map(0.5e-3), Vec2(0.01, 0.01)));
  CoatSettings coat;
  coat.mapping = Mapping::triplanar;
  const auto made = must(make_relief(*base, maps, coat));
  EXPECT_EQ(&made->base().mesh(), &base->mesh());
  EXPECT_EQ(&made->rest_mesh(), &base->mesh());
  CoatParts parts;
  parts.maps.push_back(std::make_shared<const Mesostructure>(maps));
  const auto from_parts = must(make_relief(*base, std::move(parts), coat));
  Rng rng(8);
  for (int i = 0; i < 300; ++i) {
    const Vec3 p = rng.uniform(0.019, 0.022) * random_direction(rng);
    SurfaceCache a;
    SurfaceCache b;
    SurfaceCache c;
    const Foot foot = by_hand->view(a).nearest(p, infinity);
    EXPECT_EQ(made->view(b).nearest(p, infinity).point, foot.point);
    EXPECT_EQ(from_parts->view(c).nearest(p, infinity).point, foot.point);
  }
}

TEST(MakeRelief, hands_on_what_coat_and_shell_refuse) {
  MeshSource bald = icosphere(1, 0.02);
  bald.corner_uvs.clear();
  const auto without_uvs = must(make_mesh_surface(std::move(bald)));
  const Mesostructure maps = must(Mesostructure::build(wavy_map(0.5e-3), Vec2(0.01, 0.01)));
  const auto unmapped = make_relief(*without_uvs, maps);
  ASSERT_FALSE(unmapped);
  EXPECT_EQ(unmapped.error().code, ErrorCode::mismatch);
  const auto no_map = make_relief(*without_uvs, CoatParts{});
  ASSERT_FALSE(no_map);

  const auto coarse = must(make_mesh_surface(icosphere(1, 0.02)));
  const Mesostructure high = must(Mesostructure::build(wavy_map(0.05), Vec2(0.01, 0.01)));
  const auto folded = make_relief(*coarse, high, {}, {ShellDirections::least_squares, OnOverlap::refuse});
  ASSERT_FALSE(folded);
  EXPECT_EQ(folded.error().code, ErrorCode::bad_mesh);
}

TEST(MakeMeshSurface, scales_and_refuses) {
  EXPECT_NEAR(must(make_mesh_surface(box_mesh(Vec3(40.0, 40.0, 40.0)), {.scale = 1e-3}))->bounds().upper.z(), 0.02,
              1e-15);
  const auto empty = make_mesh_surface(MeshSource{});
  ASSERT_FALSE(empty);
  EXPECT_EQ(empty.error().code, ErrorCode::bad_mesh);
}

}  // namespace
}  // namespace asperity::relief_surface_test
