// Rows H-I, H-II, H-neg and H-edge of the checklist (hrm-2010, tests I, II and Figures 4, 12).

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
    Vec3 to = box.centre() + 0.35 * box.extent().cwiseProduct(random_vector(rng, 1.0));
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

/// A map of amplitude 10 % of the edge on M_a, and where on it a point is, found without the coat.
struct Relief {
  MeshSource source = trial_mesh_a();
  Box box = mesh_of(trial_mesh_a()).bounds();
  double amplitude = 1e-3;
  HeightMap map;

  explicit Relief(MesostructureKind kind, Reconstruction how = Reconstruction::bilinear)
      : map(must(generate_height_map({kind, 256, 1e-3, 3, 1}, Wrap::repeat, how))) {}

  [[nodiscard]] Vec2 texture_at(const Vec3& p) const {
    return {(p.x() - box.lower.x()) / box.extent().x(), (p.y() - box.lower.y()) / box.extent().y()};
  }
  [[nodiscard]] double height(const Vec3& p) const { return map.height_at(texture_at(p)); }
  /// Whether the relief steps within a texel of here by more than a quarter of the amplitude.
  [[nodiscard]] bool near_step(const Vec3& p) const {
    const Vec2 st = texture_at(p);
    double low = infinity;
    double high = -infinity;
    for (int i = -2; i <= 2; ++i) {
      for (int j = -2; j <= 2; ++j) {
        const double h = map.height_at(st + Vec2(0.5 * i, 0.5 * j) / map.width());
        low = std::min(low, h);
        high = std::max(high, h);
      }
    }
    return high - low > 0.25 * amplitude;
  }
};

struct Trace {
  double excursion = 0.0;  ///< highest minus lowest of the probe with F/k removed (m)
  double lowest = infinity;
  double rms = 0.0;  ///< of the probe with F/k removed against the relief (m)
  int samples = 0;
};

/// Slow scans at constant normal force over M_a, F/k removed, samples within a texel of a step left out (amendment 16).
Trace scan(const Relief& relief, const Law& law, bool leave_out_steps) {
  constexpr double force = 0.25;  // N
  const Scene scene = scene_of(coated(relief.source, relief.map, Mapping::uv), law);
  Trace trace;
  double highest = -infinity;
  double squares = 0.0;
  ProxyState state;
  for (const double y : {-0.0231, -0.0097, 0.0018, 0.0126, 0.0243}) {
    for (const Vec3& base : line(Vec3(-0.034, y, 0.0), Vec3(0.034, y + 0.003, 0.0), 160)) {
      const double z = height_at_force(scene, state, base, Vec3::UnitZ(), force, 3e-3, -3e-3) + force / stiffness;
      if (leave_out_steps && relief.near_step(base)) continue;
      trace.lowest = std::min(trace.lowest, z);
      highest = std::max(highest, z);
      squares += std::pow(z - relief.height(base), 2);
      ++trace.samples;
    }
  }
  trace.excursion = highest - trace.lowest;
  trace.rms = std::sqrt(squares / trace.samples);
  return trace;
}

TEST(H_II, force_shading_has_no_height_over_H_2_and_H_3) {
  for (const MesostructureKind kind : {MesostructureKind::beams, MesostructureKind::rings}) {
    const Relief relief(kind);
    const Trace trace = scan(relief, ForceShadingLaw{Formulation::literal}, kind == MesostructureKind::beams);
    EXPECT_GT(trace.samples, 600);
    EXPECT_LT(trace.excursion, 0.05 * relief.amplitude) << paper_name(kind);
  }
}

void expect_followed(MesostructureKind kind, bool leave_out_steps) {
  for (const Reconstruction how : {Reconstruction::bilinear, Reconstruction::quadratic_bspline}) {
    const Relief relief(kind, how);
    for (const char* law : {"height-field", "mesostructure"}) {
      const Trace trace = scan(relief, named(law), leave_out_steps);
      EXPECT_GT(trace.samples, 600);
      EXPECT_GT(trace.excursion, 0.6 * relief.amplitude) << law;
      EXPECT_LT(trace.rms, 0.05 * relief.amplitude) << law << " over " << paper_name(kind);
    }
  }
}
TEST(H_II, height_field_and_mesostructure_follow_H_2_on_M_a) {
  expect_followed(MesostructureKind::beams, true);
}
TEST(H_II, height_field_and_mesostructure_follow_H_3_on_M_a) {
  expect_followed(MesostructureKind::rings, false);
}
TEST(H_II, height_field_and_mesostructure_follow_H_4_on_M_a) {
  expect_followed(MesostructureKind::warts, false);
}

/// The same over the insides of faces of M_d,j, farther than the blend's band from the edges.
void expect_followed_on_sphere(MesostructureKind kind, int subdivisions, Mapping mapping) {
  constexpr double force = 0.05;  // N
  const double radius = icosphere_radius_for_edge(subdivisions, 0.01);
  const double amplitude = 1e-3;
  const HeightMap map = must(generate_height_map({kind, 256, amplitude, 3, 1}, Wrap::repeat, Reconstruction::bilinear));
  const auto surface = coated(icosphere(subdivisions, radius), map, mapping, 0.02);
  const TriangleMesh& mesh = surface->base().mesh();
  // Over the walls of H_2 a potential pushes sideways, and on a coarse base its rays lean: there the proxy alone is
  // exact.
  // Off the flanks of warts a point slips sideways, so there the potentials are asked.
  std::vector<const char*> laws;
  if (kind != MesostructureKind::warts) laws.push_back("proxy");
  if (kind != MesostructureKind::beams) laws.insert(laws.end(), {"height-field", "mesostructure"});
  for (const char* law : laws) {
    const Scene scene = scene_of(surface, named(law));
    Rng rng(5);
    double squares = 0.0;
    int samples = 0;
    for (int scan = 0; scan < 12; ++scan) {
      const std::uint32_t face = random_face(rng, mesh);
      const Vec3 normal = mesh.face_normal(face);
      ProxyState state;
      for (int i = 0; i <= 50; ++i) {
        const double t = i / 50.0;
        const Vec3 barycentric = (1.0 - t) * Vec3(0.7, 0.15, 0.15) + t * Vec3(0.15, 0.35, 0.5);
        const Vec3 base = point_on(mesh, face, barycentric);
        const double z = height_at_force(scene, state, base, normal, force, 2e-3, -1e-3) + force / stiffness;
        // Rays of the shell lean over a coarse base: the relief is where a probe that comes straight down meets it.
        SurfaceCache hint;
        const SweptHit met =
            surface->view(hint).first_touch({base + 3e-3 * normal, base - 3e-3 * normal}, Sides::front);
        ASSERT_TRUE(met.hit);
        // Next to a wall the height under the probe depends on where exactly it stands (amendment 16).
        if (met.contact.normal.dot(normal) < 0.8) continue;
        squares += std::pow(z - (3e-3 - 6e-3 * met.t), 2);
        ++samples;
      }
    }
    EXPECT_LT(std::sqrt(squares / samples), 0.05 * amplitude) << law << " over " << paper_name(kind);
  }
}
TEST(H_II, reliefs_are_followed_on_M_d_0_per_face) {
  expect_followed_on_sphere(MesostructureKind::beams, 0, Mapping::per_face);
  expect_followed_on_sphere(MesostructureKind::rings, 0, Mapping::per_face);
  expect_followed_on_sphere(MesostructureKind::warts, 0, Mapping::per_face);
}
TEST(H_II, reliefs_are_followed_on_M_d_2_per_face_and_triplanar) {
  for (const Mapping mapping : {Mapping::per_face, Mapping::triplanar}) {
    expect_followed_on_sphere(MesostructureKind::beams, 2, mapping);
    expect_followed_on_sphere(MesostructureKind::rings, 2, mapping);
    expect_followed_on_sphere(MesostructureKind::warts, 2, mapping);
  }
}

TEST(H_neg, a_groove_is_followed_by_the_consistent_laws) {
  const Relief relief(MesostructureKind::groove);
  for (const char* law : {"height-field", "mesostructure"}) {
    const Trace trace = scan(relief, named(law), false);
    EXPECT_LT(trace.lowest, -0.95 * relief.amplitude) << law;
    EXPECT_LT(trace.rms, 0.05 * relief.amplitude) << law;
  }
}

TEST(H_neg, a_groove_is_never_felt_by_the_literal_laws) {
  const Relief relief(MesostructureKind::groove);
  for (const char* law : {"height-field-literal", "mesostructure-literal"}) {
    const Scene scene = scene_of(coated(relief.source, relief.map, Mapping::uv), named(law));
    Rng rng(8);
    for (int i = 0; i < 300; ++i) {
      const Vec3 base(rng.uniform(-0.03, 0.03), rng.uniform(-0.03, 0.03), 0.0);
      for (const Vec3& force : slide(scene, line(base + Vec3(0.0, 0.0, 2e-3), base - Vec3(0.0, 0.0, 2e-3), 40))) {
        ASSERT_EQ(force, Vec3::Zero().eval()) << law;
      }
    }
  }
}

/// Largest change of force a tick at `step` (m) along a line over many edges of M_a with a coat that steps there.
struct Jumps {
  double force = 0.0;
  double normal_force = 0.0;
};
Jumps jumps_over_edges(Blend blend, double step) {
  const auto surface =
      coated(trial_mesh_a(), wavy_map(5e-4), Mapping::per_face, 0.01, 1.0, Stitching{FoldMode::keep, blend, 0.05, {}});
  const Scene scene = scene_of(surface, MesostructureLaw{});
  const Vec3 from(-0.0093, -0.0061, -1e-3);
  const Vec3 to(0.0112, 0.0087, -1e-3);
  const auto path = line(from, to, static_cast<int>(std::lround((to - from).norm() / step)));
  const std::vector<Vec3> forces = slide(scene, path, from + Vec3(0.0, 0.0, 3e-3));
  Jumps jumps{largest_jump(forces), 0.0};
  for (std::size_t i = 1; i < forces.size(); ++i)
    jumps.normal_force = std::max(jumps.normal_force, std::abs(forces[i].z() - forces[i - 1].z()));
  return jumps;
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
  // The weight has kinks at the band's borders, so its gradient, and with it the lateral force of the potential, steps
  // there.
  const Blend law = Blend::linear;
  const double ratio = jumps_over_edges(law, 2e-6).normal_force / jumps_over_edges(law, 1e-6).normal_force;
  EXPECT_GT(ratio, 1.6);
  EXPECT_LT(ratio, 2.4);
}

}  // namespace
}  // namespace asperity::rows_test
