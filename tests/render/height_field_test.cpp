// Height field over the base: haptic-textures-2005, 3.3; hrm-2010, Algorithm 1.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>

#include "tests/render/fixtures.h"

namespace asperity::height_field_test {
namespace {

using namespace test;

constexpr double height = 1e-3;
const HeightFieldLaw printed{Formulation::literal, 0.0};

TEST(HeightFieldLiteral, loses_contact_below_the_base_at_the_depth_of_the_height) {
  const Scene scene = scene_of(coated(plane_grid(0.04, 0.04, 2, 2), flat_map(height), Mapping::uv), printed);
  const auto force = [&](double z) {
    return poke(scene, Vec3(3e-3, 1e-3, 2e-3), Vec3(3e-3, 1e-3, z)).wrench.force.z();
  };
  // Erratum 1: penetration = Z - |distance|, greatest on the base and falling again below it.
  EXPECT_EQ(force(1.1 * height), 0.0);
  EXPECT_NEAR(force(0.5 * height), 0.5 * stiffness * height, 1e-6);
  EXPECT_NEAR(force(0.0), stiffness * height, 1e-6);
  EXPECT_NEAR(force(-0.5 * height), 0.5 * stiffness * height, 1e-6);
  EXPECT_EQ(force(-1.001 * height), 0.0);
}

TEST(HeightFieldConsistent, keeps_contact_below_the_base) {
  const Scene scene =
      scene_of(coated(plane_grid(0.04, 0.04, 2, 2), flat_map(height), Mapping::uv), named("height-field"));
  for (const double z : {0.5e-3, 0.0, -0.5e-3, -1e-3, -5e-3}) {
    EXPECT_NEAR(poke(scene, Vec3(3e-3, 1e-3, 2e-3), Vec3(3e-3, 1e-3, z)).wrench.force.z(), stiffness * (height - z),
                1e-6)
        << z;
  }
}

TEST(HeightFieldLiteral, never_feels_heights_below_zero) {
  const Scene scene = scene_of(coated(plane_grid(0.04, 0.04, 2, 2), flat_map(-height), Mapping::uv), printed);
  for (const double z : {1e-3, 0.0, -0.5e-3, -1.5e-3, -3e-3}) {
    EXPECT_EQ(poke(scene, Vec3(3e-3, 1e-3, 2e-3), Vec3(3e-3, 1e-3, z)).wrench.force, Vec3::Zero().eval()) << z;
  }
}

TEST(HeightFieldLiteral, pushes_along_the_base_normal_alone) {
  const Scene scene = scene_of(coated(plane_grid(0.04, 0.04, 2, 2), wavy_map(height), Mapping::uv), printed);
  Rng rng(3);
  for (int i = 0; i < 300; ++i) {
    Vec3 p = random_point(rng, 0.018);
    p.z() = rng.uniform(0.0, height);
    const Vec3 force = poke(scene, p, p).wrench.force;
    ASSERT_EQ(force.x(), 0.0);
    ASSERT_EQ(force.y(), 0.0);
  }
}

/// Largest change of force between 1 um left and right of the inner edges of M_a with a map that steps there.
double step_at_edges(const Law& law, double z, double& strongest) {
  const auto surface = coated(
      trial_mesh_a(), map_of(32, [](double s, double t) { return 1e-3 * (0.6 + 0.3 * std::sin(5.0 * s + 3.0 * t)); }),
      Mapping::per_face);
  const TriangleMesh& mesh = surface->base().mesh();
  const Scene scene = scene_of(surface, law);
  double largest = 0.0;
  strongest = 0.0;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const auto corners = mesh.corners(face);
    for (std::size_t edge = 0; edge < 3; ++edge) {
      if (mesh.neighbour(face, static_cast<int>(edge)) == no_index) continue;
      const Vec3& a = corners[edge];
      const Vec3& b = corners[(edge + 1) % 3];
      const Vec3 across = 1e-7 * Vec3::UnitZ().cross(b - a).normalized();
      for (const double along : {0.2, 0.4, 0.7}) {
        const Vec3 p = a + along * (b - a) + Vec3(0.0, 0.0, z);
        const Vec3 left = poke(scene, p + Vec3(0.0, 0.0, 5e-3), p + across).wrench.force;
        const Vec3 right = poke(scene, p + Vec3(0.0, 0.0, 5e-3), p - across).wrench.force;
        largest = std::max(largest, (left - right).norm());
        strongest = std::max({strongest, left.norm(), right.norm()});
      }
    }
  }
  return largest;
}

TEST(A2_edges, the_taper_of_2005_forces_heights_to_zero_on_every_edge_so_that_nothing_jumps) {
  double strongest = 0.0;
  EXPECT_LT(step_at_edges(HeightFieldLaw{Formulation::literal, 0.05}, 0.0, strongest), 1e-5);
  EXPECT_LT(strongest, 1e-5) << "the height itself is 0 there";
  EXPECT_GT(step_at_edges(printed, 0.0, strongest), 0.05) << "without it the force steps";
  EXPECT_GT(strongest, 0.3);
}

TEST(A2_edges, on_the_edge_itself_the_tapered_height_is_exactly_zero) {
  const Scene scene = scene_of(coated(plane_grid(0.04, 0.04, 2, 2), flat_map(height), Mapping::uv),
                               HeightFieldLaw{Formulation::literal, 0.05});
  // Along the grid's lines x = 0 and y = 0, and its diagonals.
  for (const double along : {-0.017, -0.011, 0.003, 0.013}) {
    for (const Vec3& p : {Vec3(0.0, along, 0.0), Vec3(along, 0.0, 0.0), Vec3(along, along, 0.0)}) {
      // Barycentric coordinates are 0 up to rounding there.
      EXPECT_LT(poke(scene, p + Vec3(0.0, 0.0, 3e-3), p).wrench.force.norm(), 1e-24);
    }
  }
}

/// Points pressed into the relief of a plane, straight from above.
void expect_gradient_of_potential(const Scene& scene, std::uint64_t seed) {
  Rng rng(seed);
  Vec3 p = random_point(rng, 0.017);
  p.z() = rng.uniform(-3e-3, -1.2e-3);
  const Vec3 outside(p.x(), p.y(), 5e-3);
  const Vec3 force = poke(scene, outside, p).wrench.force;
  RC_ASSERT(force.norm() > 0.0);
  RC_ASSERT((force - potential_force(scene, outside, p)).norm() <= 1e-5 * force.norm());
}

RC_GTEST_PROP(HeightFieldConsistent, force_is_minus_the_gradient_of_its_potential, (std::uint64_t seed)) {
  static const Scene scene =
      scene_of(coated(plane_grid(0.04, 0.04, 4, 4), wavy_map(1e-3), Mapping::uv), named("height-field"));
  expect_gradient_of_potential(scene, seed);
}

RC_GTEST_PROP(HeightFieldConsistent, force_is_minus_the_gradient_with_a_taper, (std::uint64_t seed)) {
  static const Scene scene = scene_of(coated(plane_grid(0.04, 0.04, 4, 4), wavy_map(1e-3), Mapping::per_face),
                                      HeightFieldLaw{Formulation::consistent, 0.2});
  expect_gradient_of_potential(scene, seed);
}

RC_GTEST_PROP(HeightFieldConsistent, force_is_minus_the_gradient_on_a_sphere, (std::uint64_t seed)) {
  static const auto surface = coated(icosphere(1, 0.02), wavy_map(5e-4), Mapping::triplanar);
  static const Scene scene = scene_of(surface, named("height-field"));
  Rng rng(seed);
  const TriangleMesh& mesh = surface->base().mesh();
  const std::uint32_t face = random_face(rng, mesh);
  const Vec3 foot = point_on(mesh, face, random_barycentric(rng, 0.15));
  const Vec3 p = foot - rng.uniform(6e-4, 8e-4) * mesh.face_normal(face);
  const Vec3 outside = foot + 2e-3 * mesh.face_normal(face);
  const Vec3 force = poke(scene, outside, p).wrench.force;
  RC_ASSERT(force.norm() > 0.0);
  RC_ASSERT((force - potential_force(scene, outside, p)).norm() <= 1e-5 * force.norm());
}

TEST(T1_energy, no_loop_gives_or_takes_energy_under_the_consistent_height_field) {
  const Scene scene = scene_of(coated(trial_mesh_a(), wavy_map(1e-3), Mapping::uv), named("height-field"));
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    Rng rng(seed);
    const auto loop = random_loop(rng, Vec3(0.0, 0.0, -2.5e-3), 8e-3, 1e-3, 8000);
    const double area = loop_area(loop);
    ASSERT_GT(area, 1e-5);
    EXPECT_LT(std::abs(loop_work(scene, loop, loop.front() + Vec3(0.0, 0.0, 6e-3))), 1e-6 * stiffness * area) << seed;
  }
}

TEST(Energy_erratum_10, algorithm_1_gives_k_dh_dy_in_the_reference_case) {
  const Scene scene = scene_of(reference_surface(2e-3), printed);
  EXPECT_NEAR(std::abs(loop_work(scene, reference_loop(0.2e-3), Vec3(0.0, 1e-3, 5e-3))), 1.0e-3, 0.02 * 1.0e-3);
}

TEST(Energy_erratum_10, the_consistent_height_field_gives_nothing_in_the_reference_case) {
  const Scene scene = scene_of(reference_surface(0.0), named("height-field"));
  EXPECT_LT(std::abs(loop_work(scene, reference_loop(-2e-3), Vec3(0.0, 1e-3, 2e-3))), 1e-6 * 1.0e-3 + 1e-9);
}

TEST(HeightFieldConsistent, comes_in_from_outside_only) {
  const Scene scene =
      scene_of(coated(plane_grid(0.04, 0.04, 2, 2), flat_map(height), Mapping::uv), named("height-field"));
  // From below an open sheet nothing is felt until the probe has been in front of it.
  EXPECT_EQ(poke(scene, Vec3(1e-3, 2e-3, -4e-3), Vec3(1e-3, 2e-3, -1e-3)).wrench.force, Vec3::Zero().eval());
  EXPECT_GT(poke(scene, Vec3(1e-3, 2e-3, 4e-3), Vec3(1e-3, 2e-3, -1e-3)).wrench.force.z(), 0.0);
}

TEST(HeightFieldConsistent, a_probe_held_below_an_open_sheet_stays_held) {
  // Deeper than the sheet's own box reaches, tick after tick.
  for (const char* law : {"height-field", "mesostructure"}) {
    const Scene scene = scene_of(coated(plane_grid(0.04, 0.04, 2, 2), flat_map(0.0), Mapping::uv), named(law));
    ProxyState state;
    touch(scene, state, Vec3(1e-3, 2e-3, 1e-3));
    for (int i = 0; i < 10; ++i) {
      ASSERT_NEAR(touch(scene, state, Vec3(1e-3 + 1e-4 * i, 2e-3, -1e-3)).wrench.force.z(), 1e-3 * stiffness, 1e-9)
          << law << ", tick " << i;
    }
  }
}

TEST(Damping, pushes_against_going_in_and_never_pulls_back) {
  auto surface = coated(plane_grid(0.04, 0.04, 2, 2), flat_map(0.0), Mapping::uv);
  Instance instance;
  instance.name = "damped";
  instance.surface = surface;
  instance.law = named("height-field");
  instance.material = Material{stiffness, 5.0};
  const Scene scene = must(Scene::build({instance}, 0.0));
  for (const double speed : {-0.1, 0.0, 0.1, 10.0}) {
    ProxyState state;
    touch(scene, state, Vec3(1e-3, 2e-3, 1e-3));
    ProbeSample probe = probe_at(Vec3(1e-3, 2e-3, -1e-3));
    probe.twist.linear = Vec3(0.3, 0.0, speed);
    const Vec3 force = step(scene, state, probe, tick).wrench.force;
    EXPECT_NEAR(force.z(), std::max(0.0, 1e-3 * stiffness - 5.0 * speed), 1e-9);
    EXPECT_NEAR(force.head<2>().norm(), 0.0, 1e-12);
  }
}

// ---- haptic-textures-2005: Fig. 4, and the scratches of section 5

/// Two squares of 40 mm that meet in an edge along y, each rising by `slope` (radians) away from it.
MeshSource valley(double slope) {
  const double x = 0.04 * std::cos(slope);
  const double z = 0.04 * std::sin(slope);
  MeshSource source;
  source.positions = {{-x, -0.02, z}, {0.0, -0.02, 0.0}, {x, -0.02, z}, {-x, 0.02, z}, {0.0, 0.02, 0.0}, {x, 0.02, z}};
  source.triangles = {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}};
  return source;
}

TEST(A2_two_prisms, beside_a_concave_edge_the_printed_force_jumps_however_short_the_step) {
  // In both prisms the deeper one pushes: where both are as deep, over the bisector, from one normal to the other.
  const double slope = 0.9;
  const double high = 4e-3;
  const Scene scene =
      scene_of(coated(valley(slope), flat_map(high), Mapping::per_face), HeightFieldLaw{Formulation::literal});
  // Beyond the taper of 5 %: the papers' remedy is for heights, not for this.
  const double z = 3e-3;
  const double depth = high - z * std::cos(slope);
  const double expected = stiffness * depth * 2.0 * std::sin(slope);
  for (const double step : {1e-5, 1e-6, 1e-7}) {
    const Vec3 from(-2.5 * step, 3e-3, z);
    const Vec3 to(2.5 * step, 3e-3, z);
    EXPECT_NEAR(largest_jump(slide(scene, line(from, to, 5))), expected, 0.01 * expected) << step;
  }
  // The consistent form turns there with the potential, over a convex edge's heights or a fillet's radius.
  const Scene proxy = scene_of(coated(valley(slope), flat_map(high), Mapping::per_face), ProxyLaw{});
  EXPECT_LT(largest_jump(slide(proxy, line(Vec3(-2.5e-7, 3e-3, z), Vec3(2.5e-7, 3e-3, z), 5), Vec3(0, 3e-3, 0.02))),
            1e-3 * expected);
}

TEST(A2_two_prisms, of_faces_that_are_equally_deep_the_first_pushes) {
  // Over a plane's inner vertices all faces around are.
  for (const bool turned : {false, true}) {
    MeshSource source = plane_grid(0.04, 0.04, 4, 4);
    if (turned) std::reverse(source.triangles.begin(), source.triangles.end());
    const auto triangles = source.triangles;
    const auto positions = source.positions;
    const Scene scene = scene_of(coated(std::move(source), flat_map(height), Mapping::uv), printed);
    for (std::uint32_t vertex = 0; vertex < positions.size(); ++vertex) {
      const Vec3& p = positions[vertex];
      if (std::max(std::abs(p.x()), std::abs(p.y())) > 0.015) continue;
      std::uint32_t first = 0;
      while (std::find(triangles[first].begin(), triangles[first].end(), vertex) == triangles[first].end()) ++first;
      const ForceSample felt = poke(scene, p + Vec3(0.0, 0.0, 2e-3), p + Vec3(0.0, 0.0, 0.5 * height));
      EXPECT_NEAR(felt.wrench.force.z(), 0.5 * stiffness * height, 1e-6);
      EXPECT_EQ(felt.contact.element, first) << p.transpose();
    }
  }
}

TEST(A2_two_prisms, the_deeper_face_pushes_whichever_comes_first) {
  const double slope = 0.9;
  const double high = 4e-3;
  MeshSource source = valley(slope);
  for (const bool turned : {false, true}) {
    if (turned) std::reverse(source.triangles.begin(), source.triangles.end());
    const Scene scene = scene_of(coated(source, flat_map(high), Mapping::per_face), printed);
    for (const double x : {-0.2e-3, 0.2e-3}) {
      for (const double y : {-4e-3, 3e-3}) {
        const Vec3 p(x, y, 3e-3);
        // Of the two planes it is nearer to the one on its own side.
        const Vec3 normal(x < 0.0 ? std::sin(slope) : -std::sin(slope), 0.0, std::cos(slope));
        const Vec3 expected = stiffness * (high - normal.dot(p)) * normal;
        EXPECT_LT((poke(scene, p, p).wrench.force - expected).norm(), 1e-5) << p.transpose();
      }
    }
  }
}

TEST(H_neg, a_groove_is_felt_by_the_printed_form_that_takes_heights_below_zero) {
  const HeightMap groove =
      must(generate_height_map({MesostructureKind::groove, 96, 1e-3, 1, 1}, Wrap::repeat, Reconstruction::bilinear));
  ASSERT_LT(groove.lowest(), -0.5e-3);
  const auto surface = coated(plane_grid(0.03, 0.03, 1, 1), groove, Mapping::uv, 0.03);
  HeightFieldLaw signed_law{Formulation::literal};
  signed_law.edge_taper = 0.0;
  HeightFieldLaw printed_law = signed_law;
  signed_law.negative_heights = true;
  const Scene extended = scene_of(surface, signed_law);
  const Scene as_printed = scene_of(surface, printed_law);
  Rng rng(8);
  int within = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3 base(rng.uniform(-0.014, 0.014), rng.uniform(-0.014, 0.014), 0.0);
    const double height = groove.sample(Vec2(base.x() / 0.03 + 0.5, base.y() / 0.03 + 0.5)).height;
    // A little over and under the relief.
    const double depth = rng.uniform(-0.1e-3, 0.1e-3);
    const Vec3 p(base.x(), base.y(), height - depth);
    if (std::abs(p.z()) > 0.95e-3) continue;  // outside of the prisms
    const ForceSample felt = poke(extended, p, p);
    ASSERT_NEAR(felt.wrench.force.z(), stiffness * std::max(0.0, depth), 1e-6) << height;
    if (height < -0.2e-3 && depth > 0.0) {
      ++within;
      EXPECT_EQ(poke(as_printed, p, p).wrench.force.norm(), 0.0) << "printed, it is never met";
    }
  }
  EXPECT_GT(within, 50);
}

}  // namespace
}  // namespace asperity::height_field_test
