// A relief as plain geometry: as closed as its base, on the relief, and nearer to it the finer it is.

#include "asperity/surface/relief/mesh.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "asperity/surface/relief/view.h"
#include "tests/surface/coats.h"

namespace asperity::relief_mesh_test {
namespace {

using namespace test;

std::size_t edges_of(const MeshReport& report) {
  return (3 * report.triangles + report.boundary_edges) / 2;
}

/// A relief whose faces each carry the map: heights disagree at every edge.
std::shared_ptr<const ReliefSurface> seamed(MeshSource source, Blend blend) {
  TriangleMesh mesh = mesh_of(std::move(source));
  CoatSettings settings;
  settings.mapping = Mapping::per_face;
  settings.stitching.blend = blend;
  Coat coat = must(Coat::build(mesh, tiled(wavy_map(3e-4)), settings));
  return std::make_shared<const ReliefSurface>(MeshSurface(TriangleIndex::build(std::move(mesh))), std::move(coat));
}

void expect_cut(const ReliefSurface& relief, int subdivisions) {
  const MeshReport& base = relief.base().mesh().report();
  const TriangleMesh mesh = must(tessellate(relief, subdivisions));
  const MeshReport& dense = mesh.report();
  const auto n = static_cast<std::size_t>(subdivisions);
  EXPECT_EQ(dense.triangles, base.triangles * n * n);
  EXPECT_EQ(dense.vertices, base.vertices + edges_of(base) * (n - 1) + base.triangles * (n - 1) * (n - 2) / 2);
  EXPECT_EQ(dense.welded_vertices, 0U);
  EXPECT_EQ(dense.dropped_degenerate + dense.dropped_duplicate, 0U);
  EXPECT_EQ(dense.boundary_edges, n * base.boundary_edges);
  EXPECT_EQ(dense.closed(), base.closed());
  EXPECT_EQ(dense.oriented(), base.oriented());
  EXPECT_EQ(dense.components, base.components);
  EXPECT_EQ(dense.nonmanifold_vertices, base.nonmanifold_vertices);
}

TEST(Tessellate, is_closed_and_oriented_where_the_base_is) {
  for (const int n : {1, 2, 3, 7}) {
    expect_cut(*coated(icosphere(1, 0.02), wavy_map(5e-4), Mapping::triplanar), n);
    expect_cut(*coated(box_mesh(Vec3(0.02, 0.03, 0.04)), wavy_map(5e-4), Mapping::uv), n);
    expect_cut(*coated(plane_grid(0.04, 0.04, 3, 2), wavy_map(5e-4), Mapping::uv), n);
    expect_cut(*coated(trial_mesh_e(2), wavy_map(5e-4), Mapping::uv), n);
    expect_cut(*seamed(icosphere(1, 0.02), Blend::quintic), n);
    expect_cut(*seamed(icosphere(1, 0.02), Blend::none), n);
  }
}

RC_GTEST_PROP(Tessellate, keeps_the_topology_of_random_closed_meshes, (std::uint64_t seed)) {
  Rng rng(seed);
  const auto relief = coated(random_closed_mesh(seed, 1, 0.02, 0.4), wavy_map(rng.uniform(0.0, 1e-3)),
                             Mapping::triplanar, rng.uniform(0.005, 0.02));
  const TriangleMesh mesh = must(tessellate(*relief, 1 + static_cast<int>(rng.below(6))));
  RC_ASSERT(mesh.report().closed() && mesh.report().oriented());
  RC_ASSERT(mesh.report().vertices + mesh.report().triangles == edges_of(mesh.report()) + 2);
}

/// Calls visit(triangle of the tessellation, its three corners in the grid) for the pieces of one face, in order.
template <class Visit>
void for_each_piece(int n, const Visit& visit) {
  std::uint32_t piece = 0;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i + j < n; ++i) {
      visit(piece++, std::array{grid_place(i, j, n), grid_place(i + 1, j, n), grid_place(i, j + 1, n)});
      if (i + j + 2 <= n)
        visit(piece++, std::array{grid_place(i + 1, j, n), grid_place(i + 1, j + 1, n), grid_place(i, j + 1, n)});
    }
  }
}

TEST(Tessellate, every_corner_lies_on_the_relief_over_its_own_face) {
  const int n = 5;
  for (const auto& relief : {coated(icosphere(1, 0.02), wavy_map(5e-4), Mapping::triplanar),
                             coated(plane_grid(0.04, 0.04, 3, 2), wavy_map(5e-4), Mapping::uv),
                             seamed(icosphere(1, 0.02), Blend::quintic)}) {
    const TriangleMesh mesh = must(tessellate(*relief, n));
    for (std::uint32_t face = 0; face < relief->base().mesh().triangles().size(); ++face) {
      const ReliefFrame frame = relief->frame(face);
      for_each_piece(n, [&](std::uint32_t piece, const std::array<Vec2, 3>& grid) {
        const auto corners = mesh.corners(static_cast<std::uint32_t>(n * n) * face + piece);
        for (std::size_t k = 0; k < 3; ++k) {
          const Vec3 smooth = relief->point(frame, grid[k].x(), grid[k].y()).point;
          // Where faces meet they say the same to rounding.
          ASSERT_LT((corners[k] - smooth).norm(), 1e-15) << face << ", " << piece;
        }
      });
    }
  }
}

TEST(Tessellate, heights_that_differ_at_an_edge_meet_in_the_middle) {
  const auto relief = seamed(icosphere(0, 0.02), Blend::none);
  ASSERT_TRUE(relief->has_jumps());
  const TriangleMesh& base = relief->base().mesh();
  const TriangleMesh mesh = must(tessellate(*relief, 2));
  int apart = 0;
  for (std::uint32_t face = 0; face < base.triangles().size(); ++face) {
    const std::uint32_t other = base.neighbour(face, 0);
    const auto middle_of = [&](std::uint32_t of) {
      const TriangleMesh::Triangle& t = base.triangles()[of];
      const TriangleMesh::Triangle& here = base.triangles()[face];
      Vec2 at = Vec2::Zero();
      for (std::size_t k = 1; k < 3; ++k) {
        if (t[k] == here[0] || t[k] == here[1]) at[static_cast<int>(k) - 1] = 0.5;
      }
      return relief->point(relief->frame(of), at.x(), at.y()).point;
    };
    const Vec3 one = middle_of(face);
    const Vec3 two = middle_of(other);
    // Edge 0 of the face's first piece ends at the edge's middle.
    ASSERT_LT((mesh.corners(4 * face)[1] - 0.5 * (one + two)).norm(), 1e-15);
    apart += (one - two).norm() > 1e-5 ? 1 : 0;
  }
  EXPECT_GT(apart, 10);
}

/// Mean distance (m) from the middles of facets, and of their edges, to the displaced surface.
double facet_error(const ReliefSurface& relief, int n) {
  const TriangleMesh mesh = must(tessellate(relief, n));
  Rng rng(7);
  SurfaceCache cache;
  double sum = 0.0;
  constexpr int count = 1500;
  for (int i = 0; i < count; ++i) {
    const auto [a, b, c] = mesh.corners(random_face(rng, mesh));
    const Vec3 place = i % 2 == 0 ? Vec3((a + b + c) / 3.0) : Vec3(0.5 * (a + b));
    sum += relief.view(cache).nearest(place, infinity).distance;
  }
  return sum / count;
}

TEST(Tessellate, facets_come_nearer_to_the_relief_with_the_square_of_their_number) {
  for (const auto& relief : {coated(plane_grid(0.04, 0.04, 4, 4), wavy_map(1e-3), Mapping::uv),
                             coated(icosphere(2, 0.02), wavy_map(3e-4), Mapping::triplanar, 0.02)}) {
    const double errors[3] = {facet_error(*relief, 8), facet_error(*relief, 16), facet_error(*relief, 32)};
    for (int i = 0; i < 2; ++i) {
      EXPECT_GT(errors[i] / errors[i + 1], 3.5) << errors[i];
      EXPECT_LT(errors[i] / errors[i + 1], 4.5) << errors[i];
    }
  }
}

TEST(TessellateErrors, each_bad_number_is_named) {
  const auto relief = coated(plane_grid(0.04, 0.04, 4, 4), wavy_map(5e-4), Mapping::uv);
  for (const int bad : {0, -3}) {
    const auto mesh = tessellate(*relief, bad);
    ASSERT_FALSE(mesh.ok());
    EXPECT_EQ(mesh.error().code, ErrorCode::bad_value);
    EXPECT_EQ(mesh.error().place, "subdivisions");
  }
  // 32 * 363^2 > 4,194,304 >= 32 * 362^2
  const auto mesh = tessellate(*relief, 363);
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.error().code, ErrorCode::too_large);
  EXPECT_EQ(mesh.error().place, "subdivisions");
  EXPECT_NE(mesh.error().accepted.find("1 to 362"), std::string::npos) << mesh.error().message();
  EXPECT_NE(mesh.error().accepted.find("4194304"), std::string::npos) << mesh.error().message();
}

TEST(TexelSubdivisions, make_triangles_of_a_texel_where_they_are_not_too_many) {
  // Texels of 0.04 / 32 m under edges of 0.01 m and diagonals of 0.0141 m.
  const auto coarse = coated(plane_grid(0.04, 0.04, 4, 4), wavy_map(5e-4), Mapping::uv);
  const int n = texel_subdivisions(*coarse);
  EXPECT_GE(n, 8);
  EXPECT_LE(n, 12);
  const auto fine = coated(plane_grid(0.04, 0.04, 4, 4), wavy_map(5e-4, 1024), Mapping::uv);
  const auto most = static_cast<std::size_t>(texel_subdivisions(*fine));
  EXPECT_LE(32 * most * most, most_chosen_triangles);
  EXPECT_GT(32 * (most + 1) * (most + 1), most_chosen_triangles);
  const auto many = coated(plane_grid(0.04, 0.04, 501, 500), wavy_map(5e-4, 2048), Mapping::uv);
  EXPECT_EQ(texel_subdivisions(*many), 1);
}

}  // namespace
}  // namespace asperity::relief_mesh_test
