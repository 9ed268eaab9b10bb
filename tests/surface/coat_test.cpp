#include "asperity/surface/coat.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "asperity/field/height/detail_pyramid.h"
#include "asperity/field/height/image.h"
#include "asperity/surface/material_maps.h"
#include "tests/surface/coats.h"

namespace asperity::coat_test {
namespace {

using namespace test;

/// Slope of the height along `direction` in the face's plane by central differences.
double finite_slope(const Coat& coat, const TriangleMesh& mesh, std::uint32_t face, const Vec3& point,
                    const Vec3& direction, double h) {
  const BarycentricFrame frame = barycentric_frame(mesh, face);
  const double ahead = coat.sample(mesh, face, frame.coordinates(point + h * direction)).height;
  const double behind = coat.sample(mesh, face, frame.coordinates(point - h * direction)).height;
  return (ahead - behind) / (2.0 * h);
}

void expect_gradients(const TriangleMesh& mesh, const Coat& coat, Rng& rng) {
  const std::uint32_t face = random_face(rng, mesh);
  const Vec3 barycentric = random_barycentric(rng);
  const Vec3 point = point_on(mesh, face, barycentric);
  const BarycentricFrame frame = barycentric_frame(mesh, face);
  const CoatSample sample = coat.sample(mesh, face, barycentric);
  Vec3 along = random_direction(rng);
  along = (along - along.dot(frame.normal) * frame.normal).normalized();
  const double expected = finite_slope(coat, mesh, face, point, along, 1e-4 * coat.texel_size());
  // A kink of the second derivative within the difference costs slope * h / texel.
  RC_ASSERT(std::abs(sample.gradient.dot(along) - expected) <= 1e-4 * (0.01 + std::abs(expected)));
  RC_ASSERT(std::abs(sample.gradient.dot(frame.normal)) <= 1e-12 * (1.0 + sample.gradient.norm()));
  RC_ASSERT(std::abs(sample.normal.norm() - 1.0) <= 1e-12);
  // Without a normal map the normal is the one of the displaced plane.
  RC_ASSERT((sample.normal - (frame.normal - sample.gradient).normalized()).norm() <= 1e-12);
}

RC_GTEST_PROP(CoatGradient, uv_agrees_with_finite_differences, (std::uint64_t seed)) {
  static const TriangleMesh mesh = mesh_of(trial_mesh_b());
  static const Coat coat = coat_on(mesh, wavy_map(1e-3), Mapping::uv);
  Rng rng(seed);
  expect_gradients(mesh, coat, rng);
}

RC_GTEST_PROP(CoatGradient, per_face_agrees_with_finite_differences, (std::uint64_t seed)) {
  static const TriangleMesh mesh = mesh_of(icosphere(1, 0.02));
  static const Coat coat = coat_on(mesh, wavy_map(1e-3), Mapping::per_face);
  Rng rng(seed);
  expect_gradients(mesh, coat, rng);
}

RC_GTEST_PROP(CoatGradient, triplanar_agrees_with_finite_differences, (std::uint64_t seed)) {
  static const TriangleMesh mesh = mesh_of(icosphere(1, 0.02));
  static const Coat coat = coat_on(mesh, wavy_map(1e-3), Mapping::triplanar);
  Rng rng(seed);
  expect_gradients(mesh, coat, rng);
}

/// Largest step of the height over the inner edges, and how many edges there were.
std::pair<double, int> largest_edge_step(const TriangleMesh& mesh, const Coat& coat) {
  double largest = 0.0;
  int edges = 0;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    for (int edge = 0; edge < 3; ++edge) {
      const std::uint32_t other = mesh.neighbour(face, edge);
      if (other == no_index) continue;
      ++edges;
      for (const double along : {0.1, 0.37, 0.5, 0.91}) {
        Vec3 barycentric = Vec3::Zero();
        barycentric[edge] = 1.0 - along;
        barycentric[(edge + 1) % 3] = along;
        const Vec3 across = barycentric_frame(mesh, other).coordinates(point_on(mesh, face, barycentric));
        largest = std::max(
            largest, std::abs(coat.sample(mesh, face, barycentric).height - coat.sample(mesh, other, across).height));
      }
    }
  }
  return {largest, edges};
}

TEST(CoatContinuity, triplanar_is_continuous_over_every_edge_even_with_a_map_that_does_not_fit) {
  for (const MeshSource& source :
       {icosphere(1, 0.02), box_mesh(Vec3(0.03, 0.02, 0.01)), random_closed_mesh(3, 2, 0.02, 0.4)}) {
    const TriangleMesh mesh = mesh_of(source);
    const auto [step, edges] = largest_edge_step(mesh, coat_on(mesh, wavy_map(1e-3), Mapping::triplanar, 0.0137));
    EXPECT_GT(edges, 20);
    EXPECT_LE(step, 1e-14);
  }
}

TEST(CoatContinuity, uv_is_continuous_where_the_uvs_are) {
  const TriangleMesh mesh = mesh_of(trial_mesh_a());
  const auto [step, edges] = largest_edge_step(mesh, coat_on(mesh, wavy_map(1e-3), Mapping::uv));
  EXPECT_GT(edges, 300);
  EXPECT_LE(step, 1e-14);
}

TEST(CoatContinuity, per_face_steps_at_edges_where_the_map_does_not_repeat_over_them) {
  const TriangleMesh mesh = mesh_of(icosphere(1, 0.02));
  EXPECT_GT(largest_edge_step(mesh, coat_on(mesh, wavy_map(1e-3), Mapping::per_face)).first, 1e-4);
}

TEST(CoatContinuity, a_uv_seam_does_not_break_adjacency) {
  const TriangleMesh mesh = mesh_of(box_mesh(Vec3(0.03, 0.02, 0.01)));
  int seams = 0;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    for (int edge = 0; edge < 3; ++edge) {
      const std::uint32_t other = mesh.neighbour(face, edge);
      ASSERT_NE(other, no_index);
      const std::uint32_t vertex = mesh.triangles()[face][static_cast<std::size_t>(edge)];
      for (std::size_t i = 0; i < 3; ++i) {
        if (mesh.triangles()[other][i] == vertex &&
            mesh.uvs(other)[i] != mesh.uvs(face)[static_cast<std::size_t>(edge)])
          ++seams;
      }
    }
  }
  EXPECT_GT(seams, 0);
  EXPECT_TRUE(mesh.report().closed());
}

TEST(Coat, per_face_puts_the_map_on_an_equilateral_triangle_without_distortion) {
  const TriangleMesh mesh = mesh_of(trial_mesh_a());
  const HeightMap map = wavy_map(1e-3);
  const Coat coat = coat_on(mesh, map, Mapping::per_face);
  const double edge = mesh.mean_edge();
  const Vec3 barycentric(0.2, 0.5, 0.3);
  const HeightSample expected = map.sample(Vec2(0.5 + 0.3 * 0.5, 0.3 * 0.5 * std::numbers::sqrt3));
  const CoatSample sample = coat.sample(mesh, 5, barycentric);
  EXPECT_NEAR(sample.height, expected.height, 1e-15);
  // Angles are kept: one unit of texture coordinate is one edge in every direction.
  EXPECT_NEAR(sample.gradient.norm(), expected.gradient.norm() / edge, 1e-9 * expected.gradient.norm() / edge);
}

TEST(Coat, uv_reads_the_map_at_the_corners_interpolated_uvs_times_repeat) {
  const TriangleMesh mesh = mesh_of(plane_grid(0.02, 0.01, 3, 2));
  const HeightMap map = wavy_map(1e-3);
  const Coat coat = must(Coat::build(mesh, tiled(map), CoatSettings{Mapping::uv, Vec2(3.0, 2.0)}));
  Rng rng(7);
  for (int i = 0; i < 200; ++i) {
    const std::uint32_t face = random_face(rng, mesh);
    const Vec3 barycentric = random_barycentric(rng);
    const Vec3 point = point_on(mesh, face, barycentric);
    const Vec2 st(3.0 * (point.x() / 0.02 + 0.5), 2.0 * (point.y() / 0.01 + 0.5));
    EXPECT_NEAR(coat.sample(mesh, face, barycentric).height, map.sample(st).height, 1e-9);
  }
}

TEST(Coat, triplanar_on_an_axis_aligned_plane_is_the_projected_map) {
  const TriangleMesh mesh = mesh_of(plane_grid(0.02, 0.02, 4, 4));
  const HeightMap map = wavy_map(1e-3);
  const Coat coat = coat_on(mesh, map, Mapping::triplanar, 0.008);
  const Vec3 barycentric(0.2, 0.3, 0.5);
  const Vec3 point = point_on(mesh, 9, barycentric);
  EXPECT_NEAR(coat.sample(mesh, 9, barycentric).height, map.sample(Vec2(point.x() / 0.008, point.y() / 0.008)).height,
              1e-15);
}

/// A picture of one direction, as a normal map stores it.
NormalMap leaning_normals(const Vec3& normal) {
  Image image{2, 2, 3, 16, {}};
  for (int pixel = 0; pixel < 4; ++pixel) {
    for (int c = 0; c < 3; ++c)
      image.samples.push_back(static_cast<std::uint16_t>(std::lround(32768.0 + 32767.0 * normal[c])));
  }
  return must(NormalMap::build(image, {}));
}

TEST(Coat, a_given_normal_map_leans_along_the_maps_own_axes) {
  const Vec3 lean = Vec3(0.3, -0.2, 1.0).normalized();
  const TriangleMesh mesh = mesh_of(plane_grid(0.02, 0.02, 2, 2));
  const auto maps = std::make_shared<const Mesostructure>(
      must(Mesostructure::build(flat_map(0.0), leaning_normals(lean), Vec2(0.02, 0.02))));
  for (const Mapping mapping : {Mapping::uv, Mapping::triplanar}) {
    const Coat coat = must(Coat::build(mesh, maps, CoatSettings{mapping, Vec2::Ones()}));
    const CoatSample sample = coat.sample(mesh, 3, Vec3(0.2, 0.3, 0.5));
    EXPECT_LT((sample.normal - lean).norm(), 1e-4);
    EXPECT_EQ(sample.gradient.norm(), 0.0);
  }
}

TEST(Coat, texel_size_is_the_tiles_share) {
  const TriangleMesh mesh = mesh_of(plane_grid(0.064, 0.064, 3, 3));
  EXPECT_NEAR(coat_on(mesh, wavy_map(1e-3, 64), Mapping::uv).texel_size(), 1e-3, 1e-9);
  EXPECT_NEAR(coat_on(mesh, wavy_map(1e-3, 64), Mapping::triplanar, 0.064).texel_size(), 1e-3, 1e-12);
}

TEST(Coat, what_is_laid_twice_as_large_loses_its_detail_at_twice_the_scale) {
  // The same picture over sheets of 10 mm, the size of its tile, and of 20 mm.
  const HeightMap map = wavy_map(1e-3, 64);
  const Vec2 tile = Vec2::Constant(0.01);
  DetailSettings settings;
  settings.kind = DetailKind::low_pass;
  const auto pyramid = std::make_shared<const DetailPyramid>(must(DetailPyramid::build(map, tile, settings)));
  const auto maps = std::make_shared<const Mesostructure>(must(Mesostructure::build(map, tile)).with_detail(pyramid));
  const auto level_on = [&](double side, double scale) {
    const TriangleMesh mesh = mesh_of(plane_grid(side, side, 1, 1));
    const Coat coat = must(Coat::build(mesh, maps, CoatSettings{Mapping::uv, Vec2::Ones(), {}}));
    return coat.level_for(coat.frame(mesh, 0), scale, 0.0);
  };
  for (const double scale : {0.4e-3, 0.9e-3, 2e-3}) {
    EXPECT_NEAR(level_on(0.01, scale), pyramid->level_of_scale(scale), 1e-12);
    EXPECT_NEAR(level_on(0.02, 2.0 * scale), level_on(0.01, scale), 1e-12);
    EXPECT_NEAR(level_on(0.005, 0.5 * scale), level_on(0.01, scale), 1e-12);
    EXPECT_GT(level_on(0.01, scale), level_on(0.02, scale) + 0.5);
  }
}

TEST(Coat, materials_change_by_their_slopes_on_projected_and_on_laid_maps) {
  // The base's normals turn within each face, and with them the weights of the three projections.
  const TriangleMesh mesh = mesh_of(icosphere(1, 0.02));
  MaterialMaps::Parts parts;
  parts.channels[0] = std::make_shared<const HeightMap>(map_of(32, [](double s, double t) {
    return 800.0 + 300.0 * std::sin(2.0 * std::numbers::pi * s) * std::cos(2.0 * std::numbers::pi * (s + t));
  }));
  const auto materials = std::make_shared<const MaterialMaps>(must(MaterialMaps::build(std::move(parts))));
  for (const Mapping mapping : {Mapping::triplanar, Mapping::per_face}) {
    CoatParts of;
    of.maps.push_back(tiled(flat_map(0.0), 0.03));
    of.materials = materials;
    CoatSettings settings;
    settings.mapping = mapping;
    const Coat coat = must(Coat::build(mesh, std::move(of), settings));
    Rng rng(23);
    for (int i = 0; i < 500; ++i) {
      const CoatFrame frame = coat.frame(mesh, random_face(rng, mesh));
      const Vec3 b = random_barycentric(rng, 0.01);
      const auto value = [&](double u, double v) { return coat.material(frame, u, v).value[0]; };
      constexpr double step = 1e-6;
      const Vec2 slope = coat.material(frame, b[1], b[2]).slope[0];
      const double by_u = (value(b[1] + step, b[2]) - value(b[1] - step, b[2])) / (2.0 * step);
      const double by_v = (value(b[1], b[2] + step) - value(b[1], b[2] - step)) / (2.0 * step);
      ASSERT_NEAR(slope.x(), by_u, 0.05) << to_string(mapping) << i;
      ASSERT_NEAR(slope.y(), by_v, 0.05) << to_string(mapping) << i;
    }
  }
}

TEST(Coat, bounds_hold_every_sample) {
  const TriangleMesh mesh = mesh_of(icosphere(1, 0.02));
  Rng rng(11);
  for (const Mapping mapping : {Mapping::per_face, Mapping::uv, Mapping::triplanar}) {
    const Coat coat = coat_on(mesh, map_of(32, [](double s, double) { return s < 0.5 ? -1e-3 : 2e-3; }), mapping);
    for (int i = 0; i < 5000; ++i) {
      const double height = coat.sample(mesh, random_face(rng, mesh), random_barycentric(rng)).height;
      ASSERT_GE(height, coat.lowest());
      ASSERT_LE(height, coat.highest());
    }
    EXPECT_EQ(coat.amplitude_bound(), std::max(-coat.lowest(), coat.highest()));
  }
}

TEST(CoatErrors, repeat_must_be_above_zero_and_finite) {
  const TriangleMesh mesh = mesh_of(icosphere(0, 0.02));
  for (const double bad : {0.0, -1.0, std::nan(""), infinity}) {
    const auto coat = Coat::build(mesh, tiled(flat_map(0.0)), CoatSettings{Mapping::uv, Vec2(1.0, bad)});
    ASSERT_FALSE(coat.ok()) << bad;
    EXPECT_EQ(coat.error().code, ErrorCode::bad_value);
    EXPECT_EQ(coat.error().place, "repeat");
    EXPECT_FALSE(coat.error().accepted.empty());
  }
}

TEST(CoatErrors, uv_mapping_needs_uvs) {
  MeshSource source = icosphere(0, 0.02);
  source.corner_uvs.clear();
  const TriangleMesh mesh = mesh_of(source);
  const auto coat = Coat::build(mesh, tiled(flat_map(0.0)), CoatSettings{Mapping::uv, Vec2::Ones()});
  ASSERT_FALSE(coat.ok());
  EXPECT_EQ(coat.error().code, ErrorCode::mismatch);
  EXPECT_EQ(coat.error().place, "mapping");
  EXPECT_NE(coat.error().accepted.find("triplanar"), std::string::npos);
  EXPECT_TRUE(Coat::build(mesh, tiled(flat_map(0.0)), CoatSettings{Mapping::triplanar, Vec2::Ones()}).ok());
}

TEST(CoatErrors, uvs_without_area_are_named) {
  MeshSource source = icosphere(0, 0.02);
  for (auto& uvs : source.corner_uvs) uvs = {Vec2f(0.5F, 0.5F), Vec2f(0.5F, 0.5F), Vec2f(0.5F, 0.5F)};
  const TriangleMesh mesh = mesh_of(source);
  const auto coat = Coat::build(mesh, tiled(flat_map(0.0)), CoatSettings{Mapping::uv, Vec2::Ones()});
  ASSERT_FALSE(coat.ok());
  EXPECT_EQ(coat.error().code, ErrorCode::mismatch);
}

TEST(BarycentricFrameTest, coordinates_and_height_undo_the_point) {
  const TriangleMesh mesh = mesh_of(random_closed_mesh(5, 1, 1.0, 0.4));
  Rng rng(3);
  for (int i = 0; i < 500; ++i) {
    const std::uint32_t face = random_face(rng, mesh);
    const BarycentricFrame frame = barycentric_frame(mesh, face);
    const Vec3 barycentric = random_barycentric(rng, -0.2);
    const double height = rng.uniform(-0.1, 0.1);
    const Vec3 point = point_on(mesh, face, barycentric) + height * frame.normal;
    EXPECT_LT((frame.coordinates(point) - barycentric).norm(), 1e-12);
    EXPECT_NEAR(frame.height(point), height, 1e-13);
  }
}

/// What building a relief of a coat and a base answers.
Error refused_on(MeshSource base, const Coat& coat) {
  const auto relief = ReliefSurface::build(MeshSurface(TriangleIndex::build(mesh_of(std::move(base)))), coat);
  EXPECT_FALSE(relief.ok());
  return relief ? Error{} : relief.error();
}

TEST(CoatsMesh, a_coat_of_another_mesh_is_refused) {
  const TriangleMesh own = mesh_of(plane_grid(0.04, 0.04, 8, 8));
  const Coat coat = coat_on(own, wavy_map(1e-3), Mapping::uv);
  MeshSource without_uvs = plane_grid(0.04, 0.04, 8, 8);
  without_uvs.corner_uvs.clear();
  MeshSource other_uvs = plane_grid(0.04, 0.04, 8, 8);
  for (auto& uvs : other_uvs.corner_uvs) {
    for (Vec2f& uv : uvs) uv *= 2.0F;
  }
  for (const MeshSource& other : {plane_grid(0.05, 0.04, 8, 8), icosphere(1, 0.02), without_uvs, other_uvs}) {
    const Error error = refused_on(other, coat);
    EXPECT_EQ(error.code, ErrorCode::mismatch);
    EXPECT_EQ(error.place, "coat");
    EXPECT_EQ(error.accepted, "a coat that Coat::build has laid on the base's own mesh");
  }
  EXPECT_EQ(refused_on(plane_grid(0.05, 0.04, 8, 8), coat).what,
            "was laid on another mesh of 128 triangles than this one");
  EXPECT_EQ(refused_on(icosphere(1, 0.02), coat).what, "was laid on a mesh of 128 triangles, this one has 80");
}

TEST(CoatsMesh, more_faces_than_the_coat_knows_of_are_refused) {
  // Reading the map of a face or the seam of a vertex that the coat's mesh does not have would go beyond its arrays.
  const TriangleMesh own = mesh_of(plane_grid(0.04, 0.04, 2, 2));
  const auto map = tiled(wavy_map(1e-3));
  const Coat coat = must(Coat::build(own, {map, map}, std::vector<std::uint8_t>(own.triangles().size(), 1),
                                     CoatSettings{Mapping::uv, Vec2::Ones(), {}}));
  EXPECT_EQ(refused_on(plane_grid(0.04, 0.04, 50, 50), coat).code, ErrorCode::mismatch);
}

TEST(CoatsMesh, its_own_mesh_a_twin_and_a_moved_one_are_accepted) {
  const TriangleMesh own = mesh_of(plane_grid(0.04, 0.04, 8, 8));
  const Coat coat = coat_on(own, wavy_map(1e-3), Mapping::uv);
  std::vector<Vec3> positions(own.positions().begin(), own.positions().end());
  for (Vec3& p : positions) p.z() += 0.1 * p.x();
  for (const TriangleMesh& mesh : {own, mesh_of(plane_grid(0.04, 0.04, 8, 8)), must(own.moved(positions))}) {
    for (const SearchStructure structure : {SearchStructure::bvh, SearchStructure::octree})
      EXPECT_TRUE(ReliefSurface::build(MeshSurface(TriangleIndex::build(mesh, structure)), coat).ok());
  }
}

TEST(CoatsMeshDeathTest, what_cannot_fail_ends_with_the_same_words) {
  const Coat coat = coat_on(mesh_of(plane_grid(0.04, 0.04, 8, 8)), wavy_map(1e-3), Mapping::uv);
  const MeshSurface other(TriangleIndex::build(mesh_of(icosphere(1, 0.02))));
  EXPECT_DEATH(ReliefSurface(other, coat), "coat: was laid on a mesh of 128 triangles, this one has 80; accepted: ");
}

}  // namespace
}  // namespace asperity::coat_test
