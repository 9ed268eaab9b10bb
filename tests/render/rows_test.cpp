// Rows H-I and H-edge of the checklist (hrm-2010, Test I and Fig. 4).

#include <gtest/gtest.h>

#include "tests/render/fixtures.h"

namespace asperity::rows_test {
namespace {

using namespace test;

constexpr double newton_tolerance = 1e-9;
const char* const coated_laws[] = {"proxy", "force-shading", "height-field", "mesostructure"};

/// A long path over a flat mesh, pressed in all the time: straight lines through the interior and along a line of
/// vertices.
std::vector<Vec3> pressed_path(const TriangleMesh& mesh, Rng& rng, int points) {
  const Box& box = mesh.bounds();
  std::vector<Vec3> path;
  Vec3 from = box.centre();
  for (int leg = 0; leg < 12; ++leg) {
    Vec3 to = box.centre() + 0.35 * box.extent().cwiseProduct(random_point(rng, 1.0));
    // Every third leg ends on a vertex, the next one starts there.
    if (leg % 3 == 0) {
      const Vec3 vertex = mesh.positions()[rng.below(static_cast<std::uint32_t>(mesh.positions().size()))];
      if ((vertex - box.centre()).cwiseAbs().cwiseQuotient(box.extent().cwiseMax(1e-9)).maxCoeff() < 0.35) to = vertex;
    }
    for (int i = 0; i <= points; ++i) {
      Vec3 p = from + (static_cast<double>(i) / points) * (to - from);
      p.z() = -1e-3;
      path.push_back(p);
    }
    from = to;
  }
  return path;
}

/// Points well inside M_f's strip of triangles.
std::vector<Vec3> strip_path(const TriangleMesh& mesh, int points) {
  std::vector<Vec3> path;
  for (std::uint32_t face = 0; face + 1 < mesh.triangles().size(); ++face) {
    const Vec3 from = point_on(mesh, face, Vec3::Constant(1.0 / 3.0));
    const Vec3 to = point_on(mesh, face + 1, Vec3::Constant(1.0 / 3.0));
    for (int i = 0; i <= points; ++i)
      path.emplace_back(from + (static_cast<double>(i) / points) * (to - from) - Vec3(0.0, 0.0, 1e-4));
  }
  return path;
}

void expect_same_as_bare(const MeshSource& source, const std::vector<Vec3>& path) {
  const Vec3 outside = path.front() + Vec3(0.0, 0.0, 2e-3);
  const std::vector<Vec3> plain = slide(scene_of(bare(source), GodObjectLaw{}), path, outside);
  EXPECT_GT(plain.back().norm(), 0.0);
  EXPECT_LE(largest_jump(plain), 1e-9 * plain.front().norm());
  for (const char* law : coated_laws) {
    for (const Mapping mapping : {Mapping::uv, Mapping::per_face, Mapping::triplanar}) {
      const std::vector<Vec3> forces =
          slide(scene_of(coated(source, flat_map(0.0), mapping), named(law)), path, outside);
      for (std::size_t i = 0; i < path.size(); ++i) {
        ASSERT_LE((forces[i] - plain[i]).norm(), newton_tolerance) << law << " at " << path[i].transpose();
      }
      EXPECT_LE(largest_jump(forces), 1e-9 * forces.front().norm()) << law;
    }
  }
}

TEST(H_I, flat_coat_on_M_a_is_the_bare_mesh_over_edges_and_vertices) {
  const MeshSource source = trial_mesh_a();
  Rng rng(1);
  expect_same_as_bare(source, pressed_path(mesh_of(source), rng, 100));
}

TEST(H_I, flat_coat_on_M_f_is_the_bare_mesh_over_every_edge) {
  const MeshSource source = trial_mesh_f();
  expect_same_as_bare(source, strip_path(mesh_of(source), 100));
}

TEST(H_I, a_coat_of_constant_height_is_the_bare_mesh_so_much_higher) {
  const MeshSource source = trial_mesh_a();
  Rng rng(2);
  const std::vector<Vec3> path = pressed_path(mesh_of(source), rng, 50);
  const Vec3 outside = path.front() + Vec3(0.0, 0.0, 5e-3);
  const std::vector<Vec3> plain = slide(scene_of(bare(source), GodObjectLaw{}), path, outside);
  for (const double height : {1.25e-3, -0.5e-3}) {
    std::vector<Vec3> lifted = path;
    for (Vec3& p : lifted) p.z() += height;
    for (const char* law : {"height-field", "mesostructure"}) {
      const std::vector<Vec3> forces =
          slide(scene_of(coated(source, flat_map(height), Mapping::uv), named(law)), lifted, outside);
      for (std::size_t i = 0; i < path.size(); ++i) {
        // Heights are kept as floats: a constant one is exact up to its own rounding.
        ASSERT_LE((forces[i] - plain[i]).norm(), stiffness * 1e-7 * std::abs(height) + newton_tolerance) << law;
      }
    }
  }
}

/// Pokes over the inside of random faces, farther from every edge than the depth and the blend's band reach round the
/// sharpest folds.
void expect_same_away_from_folds(const MeshSource& source, double depth) {
  constexpr double bands = 3.0 * 0.05;
  const TriangleMesh mesh = mesh_of(source);
  const Scene plain = scene_of(bare(source), GodObjectLaw{});
  std::vector<std::pair<std::string, Scene>> scenes;
  const auto surface = coated(source, flat_map(0.0), Mapping::uv);
  for (const char* law : coated_laws) scenes.emplace_back(law, scene_of(surface, named(law)));
  Rng rng(3);
  int checked = 0;
  for (int i = 0; i < 50000 && checked < 300; ++i) {
    const std::uint32_t face = random_face(rng, mesh);
    const Vec3 barycentric = random_barycentric(rng, 0.06);
    const BarycentricFrame frame = barycentric_frame(mesh, face);
    double to_edge = infinity;
    double altitude = 0.0;
    for (int k = 0; k < 3; ++k) {
      to_edge = std::min(to_edge, barycentric[k] / frame.gradient[k].norm());
      altitude = std::max(altitude, 1.0 / frame.gradient[k].norm());
    }
    if (to_edge < 2.0 * depth + bands * altitude) continue;
    ++checked;
    const Vec3 foot = point_on(mesh, face, barycentric);
    const Vec3 outside = foot + depth * frame.normal;
    const Vec3 inside = foot - rng.uniform(0.1, 1.0) * depth * frame.normal;
    const Vec3 expected = poke(plain, outside, inside).wrench.force;
    ASSERT_GT(expected.norm(), 0.0);
    // Shell heights are metric over a face as far as its corners' directions are (amendment 2): on the zero set the
    // laws agree exactly, in depth to that.
    double slant = 0.0;
    for (const std::uint32_t vertex : mesh.triangles()[face])
      slant = std::max(slant, std::abs(1.0 - frame.normal.dot(surface->shell().directions[vertex].cast<double>())));
    for (const auto& [law, scene] : scenes) {
      const bool in_depth = law == "height-field" || law == "mesostructure";
      ASSERT_LE((poke(scene, outside, inside).wrench.force - expected).norm(),
                4.0 * newton_tolerance + (in_depth ? 4.0 * slant * expected.norm() : 0.0))
          << law << " on face " << face;
      ASSERT_EQ(poke(scene, outside, foot + 1e-7 * depth * frame.normal).wrench.force, Vec3::Zero().eval()) << law;
    }
  }
  EXPECT_EQ(checked, 300);
}

TEST(H_I, flat_coat_on_M_b_is_the_bare_mesh_away_from_folds) {
  expect_same_away_from_folds(trial_mesh_b(), 5e-4);
}
TEST(H_I, flat_coat_on_M_b_with_the_strongest_folds) {
  expect_same_away_from_folds(trial_mesh_b(std::numbers::pi / 4.0), 5e-4);
}
TEST(H_I, flat_coat_on_M_c_is_the_bare_mesh_away_from_folds) {
  expect_same_away_from_folds(trial_mesh_c(), 5e-4);
}
TEST(H_I, flat_coat_on_an_icosahedron_is_the_bare_mesh_away_from_folds) {
  expect_same_away_from_folds(icosphere(0, 0.02), 5e-4);
}
TEST(H_I, flat_coat_on_icospheres_is_the_bare_mesh_away_from_folds) {
  expect_same_away_from_folds(icosphere(1, 0.02), 5e-4);
  expect_same_away_from_folds(icosphere(2, 0.02), 2e-4);
}
TEST(H_I, flat_coat_on_a_box_is_the_bare_mesh_away_from_folds) {
  expect_same_away_from_folds(box_mesh(Vec3(0.04, 0.03, 0.02)), 1e-3);
}

/// Largest change of force a tick along a line, sampled every `step` (m), from one end to the other.
struct Jumps {
  double force = 0.0;
  double normal_force = 0.0;
};
Jumps jumps_along(const Scene& scene, const Vec3& from, const Vec3& to, double step) {
  const auto path = line(from, to, static_cast<int>(std::lround((to - from).norm() / step)));
  const std::vector<Vec3> forces = slide(scene, path, from + Vec3(0.0, 0.0, 3e-3));
  Jumps jumps{largest_jump(forces), 0.0};
  for (std::size_t i = 1; i < forces.size(); ++i)
    jumps.normal_force = std::max(jumps.normal_force, std::abs(forces[i].z() - forces[i - 1].z()));
  return jumps;
}

/// Over many edges of M_a with a coat that steps there. The blend is the coat's, or the law's own where it has one.
Jumps jumps_over_edges(Blend blend, double step, const Law& law = MesostructureLaw{}) {
  const auto surface =
      coated(trial_mesh_a(), wavy_map(5e-4), Mapping::per_face, 0.01, 1.0, Stitching{FoldMode::keep, blend, 0.05, {}});
  return jumps_along(scene_of(surface, law), Vec3(-0.0093, -0.0061, -1e-3), Vec3(0.0112, 0.0087, -1e-3), step);
}

TEST(H_edge, without_a_blend_the_jump_at_edges_persists) {
  const Blend law = Blend::none;
  const double coarse = jumps_over_edges(law, 1e-6).normal_force;
  EXPECT_GT(coarse, 0.02);
  EXPECT_GT(jumps_over_edges(law, 0.5e-6).normal_force, 0.95 * coarse);
}

TEST(H_edge, with_the_s_shape_halving_the_step_halves_the_change_of_force) {
  const Blend law = Blend::s_shape;
  const double ratio = jumps_over_edges(law, 2e-6).force / jumps_over_edges(law, 1e-6).force;
  EXPECT_GT(ratio, 1.6);
  EXPECT_LT(ratio, 2.4);
}

TEST(H_edge, with_the_linear_blend_halving_the_step_halves_the_change_of_height) {
  const Blend law = Blend::linear;
  const double ratio = jumps_over_edges(law, 2e-6).normal_force / jumps_over_edges(law, 1e-6).normal_force;
  EXPECT_GT(ratio, 1.6);
  EXPECT_LT(ratio, 2.4);
}

// The paper's force: along averaged normals, so that it is as continuous as the weights.
TEST(H_edge, under_averaged_normals_the_whole_force_goes_with_the_step_under_every_blend_but_none) {
  const auto largest = [](Blend blend, double step) {
    return jumps_over_edges(blend, step, MesostructureIntendedLaw{.blend = blend, .prism_height = 3e-3}).force;
  };
  for (const Blend blend : {Blend::linear, Blend::s_shape, Blend::quintic}) {
    const double coarse = largest(blend, 2e-6);
    const double ratio = coarse / largest(blend, 1e-6);
    EXPECT_GT(coarse, 1e-4) << to_string(blend);
    EXPECT_GT(ratio, 1.6) << to_string(blend);
    EXPECT_LT(ratio, 2.4) << to_string(blend);
  }
  const double unblended = largest(Blend::none, 1e-6);
  EXPECT_GT(unblended, 0.02);
  EXPECT_GT(largest(Blend::none, 0.5e-6), 0.95 * unblended);
}

/// Two flat halves of one plane, one higher than the other, with the band of their edge along the y axis.
constexpr double side = 0.02;        // m, of either half: the height of the triangles over the edge
constexpr double difference = 2e-4;  // m
Scene scene_of_halves(Blend blend, const Law& law) {
  TriangleMesh mesh = mesh_of(roof(0.0, side));
  const std::vector<std::shared_ptr<const Mesostructure>> maps{tiled(flat_map(0.0)), tiled(flat_map(difference))};
  CoatSettings settings;
  settings.stitching = {FoldMode::keep, blend, 0.05, {}};
  Coat coat = must(Coat::build(mesh, maps, {0, 0, 1, 1}, settings));
  return scene_of(
      std::make_shared<const ReliefSurface>(MeshSurface(TriangleIndex::build(std::move(mesh))), std::move(coat)), law);
}

// Within the band the height rises by difference / (2 rho side), beside it not at all; the force of a potential is its
// slope, and so it has a lateral part within the band alone. No blend that has a corner can be without that step.
TEST(H_edge, with_the_linear_blend_a_potential_pushes_sideways_within_the_band_alone) {
  const double slope = difference / (2.0 * 0.05 * side);
  const double depth = 1e-3;
  const auto largest = [&](Blend blend, double step) {
    const Scene scene = scene_of_halves(blend, MesostructureLaw{});
    return jumps_along(scene, Vec3(-2e-3, 0.0, -depth), Vec3(2e-3, 0.0, -depth), step);
  };
  for (const double step : {2e-6, 1e-6, 0.5e-6}) {
    // At the higher border the probe is deeper by the difference, and pushed that much more.
    const double expected = stiffness * (depth + difference) * slope;
    EXPECT_NEAR(largest(Blend::linear, step).force, expected, 0.01 * expected) << step;
  }
  const double smooth = largest(Blend::s_shape, 2e-6).force;
  EXPECT_NEAR(smooth / largest(Blend::s_shape, 1e-6).force, 2.0, 0.1);
}

}  // namespace
}  // namespace asperity::rows_test
