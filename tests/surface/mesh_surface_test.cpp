#include "asperity/surface/mesh/surface.h"

#include <gtest/gtest.h>

#include "asperity/surface/mesh/view.h"
#include "tests/surface/coats.h"

namespace asperity::mesh_surface_test {
namespace {

using namespace test;

TEST(MeshSurfaceEval, is_the_exact_signed_distance_of_a_box) {
  const Vec3 half(0.015, 0.01, 0.005);
  const auto box = bare(box_mesh(2.0 * half));
  Rng rng(1);
  SurfaceCache cache;
  for (int i = 0; i < 3000; ++i) {
    const Vec3 p = random_point(rng, 0.02);
    const Vec3 over = p.cwiseAbs() - half;
    const double expected = over.cwiseMax(0.0).norm() + std::min(over.maxCoeff(), 0.0);
    const FieldSample sample = box->eval(p, cache);
    ASSERT_NEAR(sample.value, expected, 1e-15) << p.transpose();
    ASSERT_NEAR(sample.gradient.norm(), 1.0, 1e-12);
    ASSERT_EQ(sample.height, 0.0);
  }
}

TEST(MeshSurfaceEval, gradient_agrees_with_finite_differences) {
  const auto surface = bare(random_closed_mesh(6, 2, 0.02, 0.4));
  Rng rng(2);
  SurfaceCache cache;
  int checked = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 p = random_point(rng, 0.03);
    const FieldSample here = surface->eval(p, cache);
    const double h = 1e-8;
    Vec3 expected;
    for (int k = 0; k < 3; ++k) {
      expected[k] =
          (surface->eval(p + h * Vec3::Unit(k), cache).value - surface->eval(p - h * Vec3::Unit(k), cache).value) /
          (2.0 * h);
    }
    // The medial axis has measure zero; there the two sides of the difference see different feet.
    if (std::abs(expected.norm() - 1.0) > 1e-4) continue;
    ++checked;
    ASSERT_LT((expected - here.gradient).norm(), 1e-4);
  }
  EXPECT_GT(checked, 950);
}

TEST(MeshSurfaceEval, on_a_face_the_gradient_is_the_faces_normal) {
  const auto surface = bare(plane_grid(0.02, 0.02, 2, 2));
  SurfaceCache cache;
  const Vec3 corner = surface->mesh().positions()[4];
  const FieldSample sample = surface->eval(corner, cache);
  EXPECT_EQ(sample.value, 0.0);
  EXPECT_EQ(sample.gradient, Vec3(0.0, 0.0, 1.0));
}

TEST(Pseudonormal, tells_inside_from_outside_at_edges_and_corners_where_face_normals_do_not) {
  // A spike: far beyond the tip some faces see the point from behind.
  const TriangleMesh mesh = mesh_of(random_closed_mesh(12, 1, 1.0, 0.8));
  Rng rng(4);
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    for (int k = 0; k < 3; ++k) {
      const Vec3 corner = pseudonormal(mesh, face, Vec3::Unit(k));
      EXPECT_EQ(corner, mesh.vertex_normal(mesh.triangles()[face][static_cast<std::size_t>(k)]));
      Vec3 barycentric = Vec3::Constant(0.5);
      barycentric[k] = 0.0;
      const std::uint32_t other = mesh.neighbour(face, (k + 1) % 3);
      EXPECT_LT((pseudonormal(mesh, face, barycentric) - mesh.face_normal(face) - mesh.face_normal(other)).norm(),
                1e-15);
    }
    EXPECT_EQ(pseudonormal(mesh, face, random_barycentric(rng, 0.01)), mesh.face_normal(face));
  }
}

TEST(InterpolatedNormal, is_unit_and_the_vertex_normal_at_corners) {
  const TriangleMesh mesh = mesh_of(icosphere(1, 1.0));
  Rng rng(8);
  for (int i = 0; i < 300; ++i) {
    const std::uint32_t face = random_face(rng, mesh);
    const Vec3 barycentric = random_barycentric(rng);
    EXPECT_NEAR(interpolated_normal(mesh, face, barycentric).norm(), 1.0, 1e-12);
    // On a sphere it points away from the centre.
    EXPECT_GT(interpolated_normal(mesh, face, barycentric).dot(point_on(mesh, face, barycentric).normalized()), 0.99);
    EXPECT_LT((interpolated_normal(mesh, face, Vec3::UnitX()) - mesh.vertex_normal(mesh.triangles()[face][0])).norm(),
              1e-6);
  }
}

TEST(MeshSurface, natural_sides_are_front_for_closed_meshes_alone) {
  EXPECT_EQ(bare(icosphere(1, 1.0))->natural_sides(), Sides::front);
  EXPECT_EQ(bare(trial_mesh_a())->natural_sides(), Sides::both);
  EXPECT_EQ(bare(trial_mesh_e())->natural_sides(), Sides::both);
}

TEST(MeshSurface, answers_the_same_with_and_without_a_cache) {
  const auto surface = bare(random_closed_mesh(2, 3, 0.02, 0.4));
  Rng rng(14);
  SurfaceCache kept;
  Vec3 p = random_point(rng, 0.02);
  for (int i = 0; i < 2000; ++i) {
    p += random_point(rng, 2e-4);
    SurfaceCache fresh;
    const FieldSample a = surface->eval(p, kept);
    const FieldSample b = surface->eval(p, fresh);
    ASSERT_EQ(a.value, b.value);
    // A foot on an edge may be told from either of its faces, which round it differently.
    ASSERT_LT((a.gradient - b.gradient).norm(), 1e-12);
  }
}

/// A point that is led along a surface.
struct Led {
  std::shared_ptr<const MeshSurface> surface;
  Place place;
  FlatSpot spot;
  explicit Led(std::shared_ptr<const MeshSurface> on) : surface(std::move(on)) {
    SurfaceCache cache;
    const Foot foot = surface->view(cache).nearest(surface->mesh().corners(0)[0], infinity);
    place = {foot.element, false, foot.at};
    spot = surface->view(cache).at(place);
  }
  DescentEnd to(const Vec3& goal, SurfaceCache& cache) {
    return surface->view(cache).descend(place, spot, {.point = goal, .may_leave = false});
  }
};

TEST(TriangleView, leads_a_point_the_same_with_and_without_a_cache) {
  Rng rng(15);
  const std::shared_ptr<const MeshSurface> surfaces[] = {
      bare(icosphere(3, 0.02)), bare(random_closed_mesh(2, 3, 0.02, 0.4)), bare(plane_grid(0.04, 0.04, 12, 10))};
  for (const auto& surface : surfaces) {
    Led led(surface);
    // The same triangles, larger: what the cache holds of one mesh is not read of another.
    MeshSource source;
    for (const Vec3& at : surface->mesh().positions()) source.positions.push_back(1.3 * at);
    source.triangles.assign(surface->mesh().triangles().begin(), surface->mesh().triangles().end());
    Led twin(bare(std::move(source)));
    SurfaceCache kept;
    Vec3 way = random_point(rng, 1.0).normalized();
    int crossed = 0;
    int ready = 0;
    for (int tick = 0; tick < 4000; ++tick) {
      way = (way + random_point(rng, 0.05)).normalized();
      if (tick % 400 == 0) way = random_point(rng, 1.0).normalized();
      const Vec3 goal = led.spot.point + 1e-4 * way;
      const std::uint32_t before = led.place.element;
      const FlatAhead ahead = kept.ahead;
      const Place start = led.place;
      Led fresh = led;
      SurfaceCache empty;
      const DescentEnd end = led.to(goal, kept);
      ASSERT_EQ(fresh.to(goal, empty), end);
      ASSERT_EQ(fresh.place.element, led.place.element);
      ASSERT_EQ(fresh.place.at, led.place.at);
      ASSERT_EQ(fresh.spot.point, led.spot.point);
      ASSERT_EQ(fresh.spot.front, led.spot.front);
      if (led.place.element != before) {
        ++crossed;
        ready += ahead.from == before && ahead.frame.face == led.place.element ? 1 : 0;
        EXPECT_TRUE(!ready || ahead.frame.asked || ahead.frame.face != led.place.element);
      }
      if (tick % 3 == 0) {
        twin.place = start;
        twin.spot = twin.surface->view(empty).at(start);
        twin.to(1.3 * goal, kept);
      }
    }
    EXPECT_GT(crossed, 60);
    EXPECT_GT(ready, crossed / 2);
  }
}

}  // namespace
}  // namespace asperity::mesh_surface_test
