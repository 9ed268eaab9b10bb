// Formulas baked onto meshes: the heights are the formula's roots on the shell's rays, and what has none is told.

#include "asperity/surface/relief/bake.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "tests/surface/coats.h"

namespace asperity::relief_bake_test {
namespace {

using namespace test;

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// The texels of an atlas that lie over triangles, in their order.
std::vector<AtlasTexel> texels_over(const TriangleMesh& mesh, int texels) {
  std::vector<AtlasTexel> found;
  must(bake_relief(mesh, texels, [&](const AtlasTexel& texel) {
    if (std::max({-texel.u, -texel.v, texel.u + texel.v - 1.0}) <= 0.0) found.push_back(texel);
    return 0.0;
  }));
  return found;
}

/// Outside above 0: a sphere with waves on it.
double wavy_sphere(const Vec3& p) {
  const Vec3 d = p.normalized();
  return p.norm() - 0.05 - 0.3e-3 * std::cos(30.0 * d.x()) * std::cos(30.0 * d.y());
}

TEST(ReliefBake, a_plane_over_a_sheet_has_one_height) {
  const TriangleMesh sheet = mesh_of(plane_grid(0.1, 0.1, 4, 4));
  for (const double height : {0.4e-3, -0.4e-3, 0.0, 0.999e-3, -0.999e-3}) {
    const BakedRelief baked = must(bake_relief(sheet, [&](const Vec3& p) { return p.z() - height; }, {.texels = 8}));
    EXPECT_EQ(baked.report.missed_texels, 0U);
    EXPECT_NEAR(baked.report.lowest, height, 1.1e-9);
    EXPECT_NEAR(baked.report.highest, height, 1.1e-9);
    for (const AtlasTexel& texel : texels_over(sheet, 8)) EXPECT_NEAR(baked.atlas.heights[texel.index], height, 1.2e-9);
  }
}

TEST(ReliefBake, all_around_a_triangle_its_plane_goes_on) {
  // Into the acute corners, too, where what is nearest lies in none of the three sides' own strips.
  const TriangleMesh sheet = mesh_of(plane_grid(0.1, 0.1, 4, 4));
  for (const int texels : {5, 8, 24}) {
    const BakedRelief baked =
        must(bake_relief(sheet, [&](const Vec3& p) { return p.z() - 0.4e-3; }, {.texels = texels}));
    must(bake_relief(sheet, texels, [&](const AtlasTexel& texel) {
      EXPECT_NEAR(baked.atlas.heights[texel.index], 0.4e-3, 1.2e-9) << texel.u * texels << " " << texel.v * texels;
      return 0.0;
    }));
  }
}

TEST(ReliefBake, a_texel_takes_after_one_of_the_nearest_that_may_be_taken) {
  const TriangleMesh sheet = mesh_of(plane_grid(0.1, 0.1, 1, 1));
  for (const int texels : {5, 8, 16}) {
    std::map<std::size_t, AtlasTexel> all;
    must(bake_relief(sheet, texels, [&](const AtlasTexel& texel) {
      all.emplace(texel.index, texel);
      return 0.0;
    }));
    const auto beside = [&](const AtlasTexel& at) { return texels * std::max({-at.u, -at.v, at.u + at.v - 1.0}); };
    for (const double border : {0.01, 3.2}) {
      for (const auto& [index, texel] : all) {
        if (beside(texel) <= border) continue;
        const auto apart = [&, here = texel](const AtlasTexel& one) {
          return one.face == here.face ? texels * std::hypot(one.u - here.u, one.v - here.v) : infinity;
        };
        const std::ptrdiff_t step = nearest_texel_within(texel, border, texels);
        const auto taken = all.find(static_cast<std::size_t>(static_cast<std::ptrdiff_t>(index) + step));
        ASSERT_TRUE(taken != all.end());
        EXPECT_LE(beside(taken->second), border);
        double nearest = infinity;
        for (const auto& [other, one] : all) {
          if (beside(one) <= border) nearest = std::min(nearest, apart(one));
        }
        // Texels are whole: one diagonally beside it may be as good a choice for all that the rounding knows.
        EXPECT_LT(apart(taken->second), nearest + 1.5) << texel.u * texels << " " << texel.v * texels;
      }
    }
  }
}

// The unit of the values and the slope of the formula have no say.
TEST(ReliefBake, steep_and_flat_formulas_have_the_same_roots) {
  const TriangleMesh sheet = mesh_of(plane_grid(0.1, 0.1, 2, 2));
  const auto surface = [](const Vec3& p) { return p.z() - 0.3e-3 * std::sin(40.0 * p.x()); };
  const std::vector<SignedFormula> formulas = {surface, [&](const Vec3& p) { return 1e6 * surface(p); },
                                               [&](const Vec3& p) { return std::cbrt(surface(p)); },
                                               [&](const Vec3& p) { return std::pow(1e3 * surface(p), 5.0); },
                                               [&](const Vec3& p) { return std::copysign(1.0, surface(p)); }};
  for (const SignedFormula& formula : formulas) {
    const BakedRelief baked = must(bake_relief(sheet, formula, {.texels = 12}));
    const std::vector<AtlasTexel> texels = texels_over(sheet, 12);
    const Shell shell = Shell::build(sheet);
    for (const AtlasTexel& texel : texels) {
      const Vec3 at = shell.prism(sheet, texel.face).base_at(texel.u, texel.v);
      EXPECT_NEAR(baked.atlas.heights[texel.index], 0.3e-3 * std::sin(40.0 * at.x()), 1.2e-9);
    }
    // Never more than the steps of the range and the bisection of one: 2^17 tolerances.
    const double all = static_cast<double>(baked.atlas.heights.size());
    EXPECT_LE(static_cast<double>(baked.report.evaluations), all * (1.0 + 16.0 + 17.0 + 1.0));
  }
}

TEST(ReliefBake, a_displaced_sphere_is_recovered_to_the_tolerance) {
  const TriangleMesh base = mesh_of(icosphere(2, 0.05));
  const int texels = 24;
  for (const double tolerance : {1e-6, 1e-9}) {
    const BakedRelief baked = must(
        bake_relief(base, wavy_sphere, {.texels = texels, .lowest = -1e-3, .highest = 3e-3, .tolerance = tolerance}));
    EXPECT_EQ(baked.report.missed_texels, 0U);
    const Shell shell = Shell::build(base);
    // Half a unit in the last place of the single precision that heights are held in.
    const double rounding = 3e-3 * 6e-8;
    std::size_t seen = 0;
    for (const AtlasTexel& texel : texels_over(base, texels)) {
      const ShellPrism prism = shell.prism(base, texel.face);
      const double height = baked.atlas.heights[texel.index];
      const double reach = tolerance + rounding;
      EXPECT_LE(wavy_sphere(prism.point({texel.u, texel.v, height - reach})), 0.0);
      EXPECT_GE(wavy_sphere(prism.point({texel.u, texel.v, height + reach})), 0.0);
      ++seen;
    }
    EXPECT_EQ(seen, baked.report.texels);
    EXPECT_LT(static_cast<double>(baked.report.evaluations), 25.0 * static_cast<double>(baked.atlas.heights.size()));
  }
}

TEST(ReliefBake, what_wears_it_is_the_formulas_surface) {
  const TriangleMesh base = mesh_of(icosphere(3, 0.05));
  const BakedRelief baked = must(bake_relief(base, wavy_sphere, {.texels = 24}));
  const auto surface = must(wear_baked(baked));
  EXPECT_TRUE(surface->report().fits());
  Rng rng(7);
  double within = 0.0;
  double along_edges = 0.0;
  for (int i = 0; i < 3000; ++i) {
    const Vec3 place = random_barycentric(rng);
    const ReliefFrame frame = surface->frame(random_face(rng, baked.mesh));
    const double off = std::abs(wavy_sphere(surface->point(frame, place.y(), place.z()).point));
    double& worst = place.minCoeff() > 0.06 ? within : along_edges;
    worst = std::max(worst, off);
  }
  // Waves of 0.3 mm amplitude, 35 texels long: what the spline of the map leaves, and beside it the band along edges.
  EXPECT_LT(within, 1e-7);
  EXPECT_LT(along_edges, 4e-7);
}

TEST(ReliefBake, from_outside_downwards_and_from_inside_upwards) {
  const TriangleMesh sheet = mesh_of(plane_grid(0.1, 0.1, 1, 1));
  // Inside at the base; below it a gap, above it the surface.
  const auto gap = [](const Vec3& p) { return (p.z() - 0.5e-3) * (p.z() + 0.3e-3) * (p.z() + 0.6e-3) * 1e9; };
  EXPECT_NEAR(must(bake_relief(sheet, gap, {.texels = 4})).report.lowest, 0.5e-3, 1.1e-9);
  // Outside at the base, and nothing below: the top of the sheet above it, not its bottom.
  const auto above = [](const Vec3& p) { return std::abs(p.z() - 0.3e-3) - 0.2e-3; };
  EXPECT_NEAR(must(bake_relief(sheet, above, {.texels = 4})).report.highest, 0.5e-3, 1.1e-9);
  // Inside at the base, outside all the way up: the next surface below the gap.
  const auto below = [](const Vec3& p) {
    return p.z() > -0.2e-3 ? -1.0 : std::abs(p.z() + 0.6e-3) < 0.1e-3 ? -1.0 : 1.0;
  };
  EXPECT_NEAR(must(bake_relief(sheet, below, {.texels = 4, .steps = 64})).report.lowest, -0.5e-3, 1.1e-9);
}

TEST(ReliefBake, misses_are_told_by_face_and_number_of_texels) {
  const TriangleMesh sheet = mesh_of(plane_grid(0.1, 0.1, 4, 1));
  const auto slope = [](const Vec3& p) { return p.z() - 0.05 * p.x(); };  // within 1 mm for |x| <= 20 mm
  const Result<BakedRelief> refused = bake_relief(sheet, slope, {.texels = 16});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::bad_value);
  EXPECT_EQ(refused.error().place.substr(0, 5), "face ");

  const BakedRelief flat = must(bake_relief(sheet, slope, {.texels = 16, .on_miss = OnMiss::flat}));
  std::size_t missed = 0;
  std::vector<std::size_t> on_face(sheet.triangles().size(), 0);
  const Shell shell = Shell::build(sheet);
  for (const AtlasTexel& texel : texels_over(sheet, 16)) {
    const double x = shell.prism(sheet, texel.face).base_at(texel.u, texel.v).x();
    const double height = flat.atlas.heights[texel.index];
    if (std::abs(x) > 0.02) {
      ++missed;
      ++on_face[texel.face];
      EXPECT_EQ(height, 0.0);
    } else {
      EXPECT_NEAR(height, 0.05 * x, 1.2e-9);
    }
  }
  EXPECT_GT(missed, 0U);
  EXPECT_EQ(flat.report.missed_texels, missed);
  std::size_t faces = 0;
  for (const std::size_t count : on_face) faces += count > 0 ? 1U : 0U;
  ASSERT_EQ(flat.report.missed.size(), faces);
  for (const MissedFace& one : flat.report.missed) EXPECT_EQ(one.texels, on_face[one.face]);
  EXPECT_EQ(refused.error().place, "face " + std::to_string(flat.report.missed.front().face));
  EXPECT_NE(refused.error().what.find(std::to_string(missed) + " of"), std::string::npos) << refused.error().message();
  EXPECT_NE(flat.report.summary().find("no surface over"), std::string::npos) << flat.report.summary();
}

TEST(ReliefBake, a_surface_outside_the_range_is_refused_by_place) {
  const TriangleMesh base = mesh_of(icosphere(0, 0.05));
  // A face of the icosahedron is up to 10 mm below its sphere.
  const auto sphere = [](const Vec3& p) { return p.norm() - 0.05; };
  const Result<BakedRelief> refused = bake_relief(base, sphere, {.texels = 8});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().place, "face 0");
  EXPECT_NE(refused.error().accepted.find("range"), std::string::npos) << refused.error().message();
  EXPECT_TRUE(bake_relief(base, sphere, {.texels = 8, .highest = 0.02}));
}

TEST(ReliefBake, a_formula_of_the_other_sign_is_named) {
  const TriangleMesh sheet = mesh_of(plane_grid(0.1, 0.1, 1, 1));
  const Result<BakedRelief> refused = bake_relief(sheet, [](const Vec3& p) { return 0.2e-3 - p.z(); }, {.texels = 4});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().accepted.find("above 0 outside"), std::string::npos) << refused.error().message();
}

TEST(ReliefBake, a_formula_that_is_not_finite_is_refused_by_place) {
  const TriangleMesh sheet = mesh_of(plane_grid(0.1, 0.1, 2, 2));
  for (const double strange : {not_a_number, infinity, -infinity}) {
    const auto formula = [&](const Vec3& p) { return p.x() > 0.03 && p.y() > 0.03 ? strange : p.z() - 0.2e-3; };
    const Result<BakedRelief> refused = bake_relief(sheet, formula, {.texels = 8, .on_miss = OnMiss::flat});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::bad_value);
    EXPECT_NE(refused.error().place.find("face "), std::string::npos);
    EXPECT_NE(refused.error().what.find("is not finite at (0.03"), std::string::npos) << refused.error().message();
  }
  // Beside the sheet it may be anything: the relief there is as high as the nearest over the sheet.
  const auto within = [](const Vec3& p) {
    return p.head<2>().lpNorm<Eigen::Infinity>() > 0.05 ? not_a_number : p.z() - 0.2e-3;
  };
  const BakedRelief baked = must(bake_relief(sheet, within, {.texels = 8}));
  EXPECT_GT(baked.report.continued_texels, 0U);
  for (const float height : baked.atlas.heights) EXPECT_TRUE(height == 0.0F || std::abs(height - 0.2e-3F) < 1.2e-9F);
}

TEST(ReliefBake, settings_are_refused_by_name) {
  const TriangleMesh sheet = mesh_of(plane_grid(0.1, 0.1, 1, 1));
  const SignedFormula plane = [](const Vec3& p) { return p.z(); };
  const auto place = [&](const FormulaBakeSettings& settings) {
    const Result<BakedRelief> refused = bake_relief(sheet, plane, settings);
    return refused ? std::string("accepted") : refused.error().place;
  };
  EXPECT_EQ(place({.texels = 1}), "texels");
  EXPECT_EQ(place({.lowest = 1e-4}), "lowest");
  EXPECT_EQ(place({.lowest = not_a_number}), "lowest");
  EXPECT_EQ(place({.highest = -1e-4}), "highest");
  EXPECT_EQ(place({.lowest = 0.0, .highest = 0.0}), "highest");
  EXPECT_EQ(place({.tolerance = 0.0}), "tolerance");
  EXPECT_EQ(place({.tolerance = not_a_number}), "tolerance");
  EXPECT_EQ(place({.steps = 0}), "steps");
  EXPECT_EQ(place({.steps = 5000}), "steps");
  EXPECT_EQ(place({.texels = 2, .lowest = 0.0}), "accepted");
  const Result<BakedRelief> empty = bake_relief(sheet, SignedFormula(), FormulaBakeSettings{});
  ASSERT_FALSE(empty);
  EXPECT_EQ(empty.error().place, "formula");
}

TEST(ReliefBake, an_atlas_of_another_mesh_is_refused) {
  const TriangleMesh sheet = mesh_of(plane_grid(0.1, 0.1, 1, 1));
  const BakedRelief baked = must(bake_relief(sheet, [](const Vec3& p) { return p.z(); }, {.texels = 4}));
  const Result<TriangleMesh> other = with_atlas_uvs(mesh_of(plane_grid(0.1, 0.1, 2, 1)), baked.atlas);
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::mismatch);
}

}  // namespace
}  // namespace asperity::relief_bake_test
