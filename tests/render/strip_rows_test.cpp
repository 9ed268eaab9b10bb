// Row H-V (hrm-2010, Test V): maps laid on each face of M_f, from big to small.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/render/relief_scans.h"

namespace asperity::strip_rows_test {
namespace {

using namespace test;

/// M_f with a mesostructure five times along each face: the first corner of a face has the texture coordinates (0, 0),
/// the second (5, 0), the third (5/2, 5 sqrt(3)/2).
struct Strip {
  static constexpr double repeat = 5.0;
  static constexpr double tile = 0.01;  // m

  TriangleMesh mesh = mesh_of(trial_mesh_f());
  Texels texels;
  std::shared_ptr<const ReliefSurface> surface;

  explicit Strip(MesostructureKind kind, bool levels = false)
      : texels({.kind = kind, .size = 128, .amplitude = amplitude, .count = 2}) {
    Mesostructure maps = must(Mesostructure::build(texels.map(), Vec2(tile, tile)));
    if (levels) {
      const DetailSettings settings{.kind = DetailKind::low_pass};
      maps = maps.with_detail(
          std::make_shared<const DetailPyramid>(must(DetailPyramid::build(maps.heights(), maps.tile(), settings))));
    }
    surface = must(make_relief(MeshSurface(TriangleIndex::build(mesh)), std::move(maps),
                               CoatSettings{Mapping::per_face, Vec2(repeat, repeat), {}}));
  }

  [[nodiscard]] double height(const Vec3& at) const {
    return texels.height(repeat * Vec2(at[1] + 0.5 * at[2], 0.5 * std::numbers::sqrt3 * at[2]));
  }
};

/// Two ways over the inside of every face, in barycentric coordinates: along the edge from its first corner to its
/// second and along that to its third. Beams of H_2 are crossed between those across, H_3 through its peaks.
struct Way {
  Vec3 from;
  Vec3 to;
};
Way way_along(MesostructureKind kind, int edge) {
  constexpr double margin = 0.12;
  const double off = (kind == MesostructureKind::rings ? 1.28 : 0.5) / Strip::repeat / (0.5 * std::numbers::sqrt3);
  Way way{{1.0 - margin - off, margin, off}, {margin, 1.0 - margin - off, off}};
  if (edge == 1) {
    std::swap(way.from[1], way.from[2]);
    std::swap(way.to[1], way.to[2]);
  }
  return way;
}

/// Where heights rise through three quarters of the amplitude, as shares of the way.
std::vector<double> rises(const std::vector<double>& heights) {
  std::vector<double> found;
  for (std::size_t i = 1; i < heights.size(); ++i) {
    const double before = heights[i - 1] - 0.75 * amplitude;
    const double after = heights[i] - 0.75 * amplitude;
    if (before < 0.0 && after >= 0.0)
      found.push_back((static_cast<double>(i) - after / (after - before)) / static_cast<double>(heights.size() - 1));
  }
  return found;
}

// "Neighboring triangles progressively reduce their area in half; since mesostructure remains at the same resolution,
// the resulting mapped areas actually double their density": by sqrt(2) per length.
TEST(H_V, features_are_felt_where_M_f_lays_them_denser_by_sqrt_2_from_triangle_to_triangle) {
  constexpr int samples = 2000;
  for (const MesostructureKind kind :
       {MesostructureKind::serrated, MesostructureKind::beams, MesostructureKind::rings}) {
    const Strip strip(kind);
    for (const Law& law : {Law(HeightFieldLaw{}), Law(MesostructureLaw{})}) {
      const std::string name(law.facts().name);
      const Scene scene = scene_of(strip.surface, law);
      std::vector<double> density;
      for (std::uint32_t face = 0; face < strip.mesh.triangles().size(); ++face) {
        double product = 1.0;
        for (const int edge : {0, 1}) {
          const auto [from, to] = way_along(kind, edge);
          std::vector<double> expected;
          std::vector<double> felt;
          for (const Vec3& at : line(from, to, samples)) {
            expected.push_back(strip.height(at));
            // Pressed to the depth of the ground; with F / k removed.
            const Vec3 p = point_on(strip.mesh, face, at);
            felt.push_back(poke(scene, p + Vec3(0.0, 0.0, 2.0 * amplitude), p).wrench.force.z() / stiffness);
          }
          const std::vector<double> due = rises(expected);
          const std::vector<double> found = rises(felt);
          ASSERT_EQ(found.size(), due.size()) << name << " on face " << face;
          ASSERT_GE(found.size(), 3U);
          const double texel = 1.0 / (strip.texels.size() * Strip::repeat);
          for (std::size_t i = 0; i < due.size(); ++i) EXPECT_NEAR(found[i], due[i], 2.0 * texel) << name;
          const double length = (point_on(strip.mesh, face, to) - point_on(strip.mesh, face, from)).norm();
          product *= static_cast<double>(found.size() - 1) / ((found.back() - found.front()) * length);
        }
        density.push_back(std::sqrt(product));
        if (face == 0) continue;
        EXPECT_NEAR(density[face] / density[face - 1], std::numbers::sqrt2, 0.02) << name;
      }
    }
  }
}

constexpr double eye = 0.3;            // m, over the face
constexpr double field_of_view = 0.7;  // rad
constexpr int pixels = 1000;

/// Which share of the features' height is left on a face that is looked at under a zoom.
double share_left(const Strip& strip, const Law& law, MesostructureKind kind, std::uint32_t face, double zoom) {
  constexpr double force = 0.1;  // N
  SceneSettings settings;
  settings.level_rate = 1e9;
  settings.view.zoom = zoom;
  settings.view.focus = settings.view.home = point_on(strip.mesh, face, Vec3::Constant(1.0 / 3.0));
  settings.view.camera = {settings.view.focus + eye * Vec3::UnitZ(), settings.view.focus, field_of_view, pixels};
  Instance instance;
  instance.name = "strip";
  instance.surface = strip.surface;
  instance.law = law;
  instance.material.stiffness = stiffness;
  const Scene scene = must(Scene::build({instance}, settings));
  const auto [from, to] = way_along(kind, 0);
  const double most = 3.0 * amplitude * std::max(1.0, zoom);
  double low = infinity;
  double high = -infinity;
  ProxyState state;
  for (const Vec3& at : line(from, to, 150)) {
    const Vec3 p = settings.view.to_workspace(point_on(strip.mesh, face, at));
    const double z = height_at_force(scene, state, p, Vec3::UnitZ(), force, most, -most) + force / stiffness;
    low = std::min(low, z / zoom);
    high = std::max(high, z / zoom);
  }
  return (high - low) / amplitude;
}

// "Sharp features perceptible at big triangles become smoothed at smaller triangles. If the scene is zoomed in they
// become sharper again. A feature becomes undetectable when the height difference becomes less than a corresponding
// visual pixel." Halving the triangles twice is as halving the zoom.
TEST(H_V, what_is_lower_than_a_pixel_or_closer_than_two_is_gone_and_zooming_brings_it_back) {
  constexpr double zooms[] = {0.2, 0.5, 1.0, 2.0, 4.0, 32.0};
  constexpr std::uint32_t faces = 8;
  for (const MesostructureKind kind :
       {MesostructureKind::serrated, MesostructureKind::beams, MesostructureKind::rings}) {
    const Strip strip(kind, true);
    for (const Law& law : {Law(HeightFieldLaw{}), Law(MesostructureLaw{})}) {
      double left[std::size(zooms)][faces];
      int gone = 0;
      int felt = 0;
      for (std::size_t z = 0; z < std::size(zooms); ++z) {
        const double pixel = 2.0 * std::tan(0.5 * field_of_view) * eye / zooms[z] / pixels;
        for (std::uint32_t face = 0; face < faces; ++face) {
          const double share = left[z][face] = share_left(strip, law, kind, face, zooms[z]);
          const auto [a, b, c] = strip.mesh.corners(face);
          const double area = 0.5 * (b - a).cross(c - a).norm();
          // A face holds sqrt(3)/4 of a square of repeat x repeat tiles; two ridges or beams are in each.
          const double pitch = 0.5 * std::sqrt(area / (0.25 * std::numbers::sqrt3)) / Strip::repeat;
          if (pixel > amplitude || pitch < 2.0 * pixel) {
            EXPECT_LT(share, 0.02) << law.facts().name << " on face " << face << " at zoom " << zooms[z];
            ++gone;
          }
          const bool large = pixel < amplitude / 8.0 && pitch > 40.0 * pixel;
          EXPECT_GT(large ? share : 1.0, 0.75) << law.facts().name << " on face " << face << " at zoom " << zooms[z];
          felt += large ? 1 : 0;
          const double beside = face > 0 ? left[z][face - 1] : 1.0;
          const double before = z > 0 ? left[z - 1][face] : 0.0;
          EXPECT_LT(share, beside + 0.01) << law.facts().name << " on face " << face << " at zoom " << zooms[z];
          EXPECT_GT(share, before - 0.01) << law.facts().name << " on face " << face << " at zoom " << zooms[z];
          // Of H_3 a pixel's height leaves out as much as its width does, and that is another share of the amplitude.
          const bool doubled = z > 1 && z < 5 && face > 1 && kind != MesostructureKind::rings;
          const double twice = doubled ? left[z - 1][face - 2] : share;
          EXPECT_NEAR(share, twice, 0.03) << law.facts().name << " on face " << face << " at zoom " << zooms[z];
        }
      }
      EXPECT_GE(felt, 8);
      EXPECT_GT(gone, 12);
    }
  }
}

}  // namespace
}  // namespace asperity::strip_rows_test
