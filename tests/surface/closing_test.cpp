// Closing of concave folds: formulation D4 and T7, hrm-2010 4.2.

#include "asperity/surface/relief/closing.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "asperity/surface/mesh/view.h"
#include "asperity/surface/relief/view.h"
#include "tests/surface/folded.h"

namespace asperity::closing_test {
namespace {

using namespace test;

struct Closed {
  std::shared_ptr<const ReliefSurface> open;
  ClosedRelief maps;
  ReliefSurface surface;
};

Closed closed(std::shared_ptr<const ReliefSurface> open, double radius, int texels = 0) {
  ClosedRelief maps = must(close_relief(*open, {radius, texels}));
  ReliefSurface surface = *must(wear_closed(*open, maps));
  return {std::move(open), std::move(maps), std::move(surface)};
}

void expect_fillet(double opening_degrees, double height, double radius, double side, int texels) {
  SCOPED_TRACE(opening_degrees);
  const double opening = degrees(opening_degrees);
  const Closed valley_closed =
      closed(coated(valley(opening, side), flat_map(height), Mapping::triplanar), radius, texels);
  const ReliefSurface& surface = valley_closed.surface;
  const double tangent = radius / std::tan(0.5 * opening);
  Rng rng(7);
  double worst = 0.0;
  int round = 0;
  for (int i = 0; i < 4000; ++i) {
    const std::uint32_t face = random_face(rng, surface.base().mesh());
    const Vec3 barycentric = random_barycentric(rng);
    const Vec3 p = surface.point(surface.frame(face), barycentric[1], barycentric[2]).point;
    // Where the sheet ends the ball comes in from beside it.
    if (std::abs(p.y()) > 0.5 * side - radius) continue;
    worst = std::max(worst, off_fillet(p, opening, height, radius));
    const double along = std::sin(0.5 * opening) * std::abs(p.x()) + std::cos(0.5 * opening) * p.z();
    if (along < tangent && valley_closed.maps.rise_at(face, barycentric) > 0.0) ++round;
  }
  EXPECT_LE(worst, 1e-3 * radius);
  EXPECT_GT(round, 100);
  const ClosingReport& report = valley_closed.maps.report;
  EXPECT_EQ(report.unsettled_texels, 0U) << report.summary();
  // Along the fold's ray, in shell heights: those are 1 / sin of half the opening times as long.
  const double rise = radius * (1.0 - std::sin(0.5 * opening));
  EXPECT_GE(report.largest_rise, 0.6 * rise);
  EXPECT_LE(report.largest_rise, 1.4 * rise) << "rays beside the fold meet the fillet later than the fold's own";
}

TEST(Closing, a_fold_between_planes_gets_a_fillet_of_exactly_the_radius) {
  expect_fillet(150.0, 0.3e-3, 2e-3, 6e-3, 28);
  expect_fillet(120.0, 0.0, 2e-3, 6e-3, 28);
  expect_fillet(90.0, 0.3e-3, 2e-3, 6e-3, 28);
  expect_fillet(60.0, 0.0, 2e-3, 6e-3, 28);
}

TEST(Closing, also_between_planes_at_30_degrees) {
  expect_fillet(30.0, 0.0, 1e-3, 6e-3, 48);
}

/// A profile across x: a smooth wave with a narrow groove and a pit in it (m).
double profile(double x) {
  const auto dip = [&](double at, double width, double depth) {
    const double t = (x - at) / width;
    return -depth * std::exp(-t * t);
  };
  return 0.1e-3 * std::cos(2.0 * std::numbers::pi * x / 8e-3) + dip(-1.5e-3, 0.25e-3, 0.5e-3) +
         dip(1.4e-3, 0.6e-3, 0.6e-3);
}

/// A square sheet, its grooves across it from rim to rim. `width` in m.
std::shared_ptr<const ReliefSurface> grooved_sheet(double width) {
  return coated(plane_grid(width, width, 1, 1),
                map_of(
                    128, [&](double s, double) { return profile((s - 0.5) * width); }, Wrap::clamp),
                Mapping::uv, width);
}

TEST(Closing, grooves_inside_one_relief_are_filled_as_a_rolling_disc_fills_their_profile) {
  constexpr double width = 8e-3;
  constexpr double radius = 1e-3;
  const auto open = grooved_sheet(width);
  const Closed result = closed(open, radius, 96);
  // Greyscale closing of the profile, sampled every 4 um: dilation by the disc, then erosion.
  constexpr double step = 4e-6;
  const int count = static_cast<int>(width / step) + 1;
  const int reach = static_cast<int>(radius / step);
  SurfaceCache cache;
  std::vector<double> height;
  for (int i = 0; i < count; ++i) {
    const double x = -0.5 * width + i * step;
    const Foot foot = open->base().view(cache).nearest(Vec3(x, 1e-3, 0.0), infinity);
    height.push_back(open->height(open->frame(foot.element), foot.at[1], foot.at[2]).height);
  }
  std::vector<double> cap;
  for (int k = -reach; k <= reach; ++k) cap.push_back(std::sqrt(radius * radius - k * k * step * step));
  const auto swept = [&](const std::vector<double>& from, double sign) {
    std::vector<double> to;
    for (int i = 0; i < count; ++i) {
      double best = -infinity;
      for (int k = std::max(-reach, -i); k <= std::min(reach, count - 1 - i); ++k) {
        best = std::max(best, sign * from[static_cast<std::size_t>(i + k)] + cap[static_cast<std::size_t>(k + reach)]);
      }
      to.push_back(sign * best);
    }
    return to;
  };
  const std::vector<double> right = swept(swept(height, 1.0), -1.0);
  double worst = 0.0;
  double deepest = 0.0;
  for (int i = count / 6; i < 5 * count / 6; i += 7) {
    const double x = -0.5 * width + i * step;
    const Foot foot = result.surface.base().view(cache).nearest(Vec3(x, 1e-3, 0.0), infinity);
    const ReliefFrame frame = result.surface.frame(foot.element);
    const double felt = result.surface.height(frame, foot.at[1], foot.at[2]).height;
    const auto k = static_cast<std::size_t>(i);
    worst = std::max(worst, std::abs(felt - right[k]));
    deepest = std::max(deepest, right[k] - height[k]);
  }
  EXPECT_GT(deepest, 0.3e-3);
  EXPECT_LE(worst, 2e-3 * radius);
  EXPECT_EQ(result.maps.report.unsettled_texels, 0U);
}

TEST(Closing, a_ball_comes_into_a_groove_from_beside_the_rim) {
  constexpr double width = 8e-3;
  constexpr double radius = 1e-3;
  const auto open = grooved_sheet(width);
  const Closed result = closed(open, radius, 96);
  const TriangleMesh& mesh = open->base().mesh();
  int at_rim = 0;
  double filled = 0.0;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const auto [a, b, c] = mesh.corners(face);
    for (int i = 0; i <= 96; ++i) {
      for (int j = 0; i + j <= 96; ++j) {
        const Vec3 at(1.0 - (i + j) / 96.0, i / 96.0, j / 96.0);
        const Vec3 place = at[0] * a + at[1] * b + at[2] * c;
        const double rise = result.maps.rise_at(face, at);
        if (std::abs(place.y()) > 0.5 * width - 1e-9) {
          // It touches the groove's end at its own height, out over the rim.
          ++at_rim;
          ASSERT_LE(rise, 1e-3 * radius) << place.transpose();
        } else if (std::abs(place.y()) < 1e-3) {
          filled = std::max(filled, rise);
        }
      }
    }
  }
  // The other triangle has a corner on each.
  EXPECT_EQ(at_rim, 2 * 97 + 2);
  EXPECT_GT(filled, 0.3e-3);
}

TEST(Closing, what_it_raised_taken_off_again_is_the_relief_that_it_was_made_from) {
  // Beside triangles too: what is worn there tells of the faces around.
  const auto open = coated(trial_mesh_e(2, std::numbers::pi / 2.0, 0.01),
                           map_of(64,
                                  [](double s, double t) {
                                    const double turn = 2.0 * std::numbers::pi;
                                    return 1.5e-3 + 0.4e-3 * std::sin(turn * s) * std::sin(turn * t);
                                  }),
                           Mapping::uv);
  const ClosedRelief filled = must(close_relief(*open, {2e-3, 24}));
  ASSERT_GT(filled.report.changed_share, 0.2);
  // A ball so small leaves all but the very folds as it was.
  const ClosedRelief as_it_was = must(close_relief(*open, {1e-4, 24}));
  ASSERT_EQ(filled.rise.size(), as_it_was.rise.size());
  std::size_t alike = 0;
  std::size_t apart = 0;
  for (std::size_t i = 0; i < filled.rise.size(); ++i) {
    const double lowered = static_cast<double>(filled.atlas.heights[i]) - static_cast<double>(filled.rise[i]);
    ++(std::abs(lowered - static_cast<double>(as_it_was.atlas.heights[i])) < 1e-5 ? alike : apart);
  }
  EXPECT_LT(apart, alike / 500) << "beside " << alike << " texels";
}

TEST(Closing, what_the_ball_reaches_everywhere_keeps_its_height) {
  const auto open = coated(icosphere(1, 0.02), wavy_map(0.05e-3, 16), Mapping::triplanar, 0.02);
  const Closed result = closed(open, 1e-3, 24);
  EXPECT_EQ(result.maps.report.changed_texels, 0U) << result.maps.report.summary();
  EXPECT_EQ(result.maps.report.largest_rise, 0.0);
  Rng rng(3);
  for (int i = 0; i < 500; ++i) {
    const std::uint32_t face = random_face(rng, open->base().mesh());
    const Vec3 b = random_barycentric(rng, 0.05);
    ASSERT_NEAR(result.surface.height(result.surface.frame(face), b[1], b[2]).height,
                open->height(open->frame(face), b[1], b[2]).height, 1e-6);
  }
}

/// A cup of few faces with rings, peaks and holes: folds, grooves and pits at once.
std::shared_ptr<const ReliefSurface> ringed_cup() {
  MesostructureSpec spec;
  spec.kind = MesostructureKind::rings;
  spec.size = 128;
  spec.amplitude = 0.8e-3;
  spec.seed = 3;
  return coated(trial_mesh_e(2, std::numbers::pi / 2.0, 0.01),
                must(generate_height_map(spec, Wrap::repeat, Reconstruction::quadratic_bspline)), Mapping::uv);
}

/// Of `count` places of a surface farther than `radius` from its rim: the least share of `radius` that is free around
/// the centre of a ball that touches, and how many were looked at and met.
struct Freedom {
  double least = 1.0;
  int places = 0;
  int met = 0;
};
Freedom least_freedom(const ReliefSurface& surface, double radius, std::uint64_t seed, int count) {
  Rng rng(seed);
  Freedom freedom;
  SurfaceCache cache;
  for (int i = 0; i < count; ++i) {
    const std::uint32_t face = random_face(rng, surface.base().mesh());
    Vec3 b = random_barycentric(rng);
    if (i % 2 == 0) b[static_cast<int>(rng.below(3))] *= 0.1;
    b /= b.sum();
    const ReliefPoint point = surface.point(surface.frame(face), b[1], b[2]);
    if (point.point.z() > -1.5 * radius) continue;
    ++freedom.places;
    const Foot foot = surface.view(cache).nearest(point.point + radius * point.front, 1.01 * radius);
    if (!foot.found()) continue;
    ++freedom.met;
    freedom.least = std::min(freedom.least, foot.distance / radius);
  }
  return freedom;
}

TEST(T7_closing, outside_the_closed_cup_no_point_nearer_than_the_radius_has_two_feet) {
  // The ball that touches a place is free if and only if nothing between has a second foot.
  const double radius = 1.5e-3;
  const auto open = ringed_cup();
  const Freedom before = least_freedom(*open, radius, 5, 150);
  EXPECT_LT(before.least, 0.9) << "the open cup has such points";
  EXPECT_GE(before.places, 60);
  const Closed result = closed(open, radius, 40);
  EXPECT_GT(result.maps.report.changed_texels, 1000U);
  EXPECT_LE(result.maps.report.unsettled_texels * 500, result.maps.report.texels);
  for (const double share : {0.3, 0.7, 0.95}) {
    const Freedom after = least_freedom(result.surface, share * radius, 11, 150);
    EXPECT_GT(after.least, 0.99) << share;
    // The touched place itself is a foot: whoever is not met has not been looked at.
    EXPECT_GE(after.places, 60) << share;
    EXPECT_EQ(after.met, after.places) << share;
  }
}

TEST(Closing, the_report_counts_what_the_picture_shows) {
  const auto open = ringed_cup();
  const Closed result = closed(open, 1.5e-3, 24);
  const ClosingReport& report = result.maps.report;
  EXPECT_EQ(result.maps.rise.size(), result.maps.atlas.heights.size());
  float highest = 0.0F;
  for (const float rise : result.maps.rise) highest = std::max(highest, rise);
  EXPECT_GE(static_cast<double>(highest), 0.999 * report.largest_rise);
  EXPECT_GT(report.changed_share, 0.01);
  EXPECT_LT(report.changed_share, 0.9);
  EXPECT_TRUE(std::is_sorted(report.changed_faces.begin(), report.changed_faces.end()));
  EXPECT_TRUE(std::binary_search(report.changed_faces.begin(), report.changed_faces.end(), report.largest_face));
  EXPECT_NE(report.summary().find("face " + std::to_string(report.largest_face)), std::string::npos);
}

TEST(Closing, the_report_counts_the_texels_over_faces_and_those_that_rose) {
  const Closed result = closed(coated(valley(degrees(90.0), 6e-3), flat_map(0.3e-3), Mapping::triplanar), 2e-3, 24);
  const ReliefAtlas& atlas = result.maps.atlas;
  const ClosingReport& report = result.maps.report;
  ASSERT_EQ(report.unsettled_texels, 0U);
  const TriangleMesh& mesh = result.open->base().mesh();
  std::size_t over = 0;
  std::size_t risen = 0;
  double area = 0.0;
  double changed = 0.0;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    // Centres of texels within the face's triangle of the picture.
    const auto corner = [&](std::size_t k) { return Vec2(atlas.corner_uvs[face][k].cast<double>()); };
    Eigen::Matrix2d edges;
    edges << corner(1) - corner(0), corner(2) - corner(0);
    std::size_t over_face = 0;
    std::size_t risen_face = 0;
    for (int y = 0; y < atlas.height; ++y) {
      for (int x = 0; x < atlas.width; ++x) {
        const Vec2 centre((x + 0.5) / atlas.width, 1.0 - (y + 0.5) / atlas.height);
        const Vec2 uv = edges.inverse() * (centre - corner(0));
        if (std::min({uv.x(), uv.y(), 1.0 - uv.sum()}) < -1e-4) continue;
        ++over_face;
        const auto at = static_cast<std::size_t>(y * atlas.width + x);
        if (static_cast<double>(result.maps.rise[at]) > report.tolerance) ++risen_face;
      }
    }
    const auto [a, b, c] = mesh.corners(face);
    const double own = 0.5 * (b - a).cross(c - a).norm();
    area += own;
    changed += own * static_cast<double>(risen_face) / static_cast<double>(over_face);
    over += over_face;
    risen += risen_face;
  }
  EXPECT_GT(risen, 100U);
  EXPECT_EQ(report.texels, over);
  EXPECT_EQ(report.changed_texels, risen);
  EXPECT_NEAR(report.changed_share, changed / area, 1e-12);
}

TEST(Closing, what_is_worn_keeps_directions_that_were_relaxed_on_purpose) {
  ReliefSettings relaxed;
  relaxed.directions = ShellDirections::relaxed;
  TriangleMesh mesh = mesh_of(icosphere(1, 0.02));
  for (const ReliefSettings& settings : {ReliefSettings{}, relaxed}) {
    // Low enough for the other directions as well.
    Coat coat = coat_on(mesh, wavy_map(0.05e-3, 16), Mapping::triplanar, 0.02);
    const ReliefSurface open =
        must(ReliefSurface::build(MeshSurface(TriangleIndex::build(mesh)), std::move(coat), settings));
    ASSERT_TRUE(open.report().fits());
    const auto worn = wear_closed(open, must(close_relief(open, {1e-3, 8})));
    ASSERT_TRUE(worn) << worn.error().message();
    EXPECT_EQ((*worn)->report().directions_relaxed, settings.directions == ShellDirections::relaxed);
    EXPECT_EQ((*worn)->shell().directions, open.shell().directions);
  }
}

void expect_refused(const ClosingSettings& settings, ErrorCode code, std::string_view place) {
  static const auto open = coated(valley(degrees(90.0), 5e-3), flat_map(0.0), Mapping::triplanar);
  const auto answer = close_relief(*open, settings);
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().code, code);
  EXPECT_EQ(answer.error().place, place);
  EXPECT_FALSE(answer.error().accepted.empty());
}

TEST(Closing, refuses_what_it_cannot_do) {
  for (const double radius : {0.0, -1e-3, std::nan(""), 1.0}) expect_refused({radius}, ErrorCode::bad_value, "radius");
  for (const int texels : {-1, 1, 513}) expect_refused({1e-3, texels}, ErrorCode::bad_value, "texels");
  expect_refused({1e-6}, ErrorCode::too_large, "radius");
  expect_refused({1e-3, 0, 1000}, ErrorCode::too_large, "radius");
  const auto one = coated(valley(degrees(90.0), 5e-3), flat_map(0.0), Mapping::triplanar);
  const ClosedRelief maps = must(close_relief(*one, {1e-3, 4}));
  const auto other = coated(valley(degrees(90.0), 5e-3, 2), flat_map(0.0), Mapping::triplanar);
  const auto worn = wear_closed(*other, maps);
  ASSERT_FALSE(worn);
  EXPECT_EQ(worn.error().code, ErrorCode::mismatch);
}

TEST(Closing, is_the_same_to_the_bit_on_any_number_of_threads) {
  const auto open = coated(icosphere(2, 0.02), wavy_map(0.3e-3, 16), Mapping::triplanar, 3e-3);
  ClosingSettings settings{2e-3, 16};
  settings.threads = 1;
  const ClosedRelief alone = must(close_relief(*open, settings));
  settings.threads = 3;
  const ClosedRelief together = must(close_relief(*open, settings));
  EXPECT_GT(alone.report.changed_texels, 1000U);
  EXPECT_EQ(alone.atlas.heights, together.atlas.heights);
  EXPECT_EQ(alone.rise, together.rise);
  EXPECT_EQ(alone.report.changed_faces, together.report.changed_faces);
}

/// Points of a relief, `cuts` along each edge of its faces.
std::vector<Vec3> points_of(const ReliefSurface& surface, int cuts) {
  std::vector<Vec3> points;
  for (std::uint32_t face = 0; face < surface.base().mesh().triangles().size(); ++face) {
    const ReliefFrame frame = surface.frame(face);
    for (int i = 0; i <= cuts; ++i) {
      for (int j = 0; i + j <= cuts; ++j)
        points.push_back(surface.point(frame, static_cast<double>(i) / cuts, static_cast<double>(j) / cuts).point);
    }
  }
  return points;
}

TEST(Closing, where_it_filled_a_free_ball_holds_what_is_above_and_none_of_many_holds_what_is_below) {
  // Told by points of the relief alone: nothing here knows how heights were found.
  const double radius = 2e-3;
  const auto open = coated(plane_grid(0.01, 0.01, 2, 2), wavy_map(0.8e-3, 32), Mapping::triplanar, 4e-3);
  const ClosedRelief closed = must(close_relief(*open, {radius, 32}));
  const std::vector<Vec3> points = points_of(*open, 128);
  const auto lowest_free = [&](const Vec3& foot) {
    // Height of the lowest ball over a place that is above all points.
    double most = -infinity;
    for (const Vec3& p : points) {
      const double across = radius * radius - (p - foot).head<2>().squaredNorm();
      if (across > 0.0) most = std::max(most, p.z() + std::sqrt(across));
    }
    return most;
  };
  Rng rng(4);
  int filled = 0;
  for (int tries = 0; tries < 4000 && filled < 10; ++tries) {
    const std::uint32_t face = random_face(rng, open->base().mesh());
    const auto i = static_cast<int>(rng.below(33));
    const auto j = static_cast<int>(rng.below(33));
    if (i + j > 32) continue;
    const AtlasTile tile = atlas_tile(closed.atlas, face);
    if (static_cast<double>(closed.rise[tile.at(i, j)]) < 20e-3 * radius) continue;
    const Vec3 base = point_on(open->base().mesh(), face, Vec3(1.0 - (i + j) / 32.0, i / 32.0, j / 32.0));
    if (base.head<2>().cwiseAbs().maxCoeff() > 5e-3 - 1.1 * radius) continue;
    ++filled;
    // Over a plane the shell's rays are upright: the lowest underside of all balls over a grid of feet, then finer.
    const auto underside = [&](const Vec3& foot) {
      const double across = radius * radius - (foot - base).head<2>().squaredNorm();
      return across > 0.0 ? lowest_free(foot) - std::sqrt(across) : infinity;
    };
    // The undersides meet in creases, along which steps of a grid get stuck: by chance, and ever nearer to the best.
    double best = infinity;
    Vec3 at = base;
    for (double reach = radius; reach > 1e-4 * radius; reach *= reach == radius ? 0.1 : 0.6) {
      const Vec3 around = at;
      for (int k = 0; k < (reach == radius ? 1500 : 120); ++k) {
        const Vec3 foot =
            (reach == radius ? base : around) + Vec3(rng.uniform(-reach, reach), rng.uniform(-reach, reach), 0.0);
        if (const double here = underside(foot); here < best) {
          best = here;
          at = foot;
        }
      }
    }
    const auto height = static_cast<double>(closed.atlas.heights[tile.at(i, j)]);
    EXPECT_LE(height, best + 1e-3 * radius) << "face " << face << ", texel " << i << ", " << j;
    EXPECT_GE(height, best - 1e-3 * radius) << "face " << face << ", texel " << i << ", " << j;
  }
  EXPECT_EQ(filled, 10);
}

TEST(Closing, no_texel_is_below_the_relief_that_it_was_made_from) {
  const auto open = ringed_cup();
  const ClosedRelief closed = must(close_relief(*open, {1.5e-3, 24}));
  for (std::uint32_t face = 0; face < open->base().mesh().triangles().size(); ++face) {
    const ReliefFrame frame = open->frame(face);
    const AtlasTile tile = atlas_tile(closed.atlas, face);
    for (int i = 0; i <= 24; ++i) {
      for (int j = 0; i + j <= 24; ++j) {
        const double height = open->height(frame, i / 24.0, j / 24.0).height;
        ASSERT_GE(static_cast<double>(closed.atlas.heights[tile.at(i, j)]), height - 1e-9);
      }
    }
  }
}

TEST(Closing, carries_a_normal_map_where_nothing_was_filled_and_the_fillets_own_normals_elsewhere) {
  const TriangleMesh mesh = mesh_of(valley(degrees(90.0), 6e-3));
  // Normals that lean the same way everywhere, over heights that are level.
  Image image;
  image.width = image.height = 4;
  image.channels = 3;
  for (int k = 0; k < 16; ++k) {
    for (const std::uint16_t code : {std::uint16_t{166}, std::uint16_t{153}, std::uint16_t{245}})
      image.samples.push_back(code);
  }
  NormalMapSettings as;
  auto maps = std::make_shared<const Mesostructure>(
      must(Mesostructure::build(flat_map(0.3e-3), must(NormalMap::build(image, as)), Vec2(4e-3, 4e-3))));
  CoatSettings settings;
  settings.mapping = Mapping::triplanar;
  const auto open = must(make_relief(MeshSurface(TriangleIndex::build(mesh)), *maps, settings));
  const ClosedRelief closed = must(close_relief(*open, {1.5e-3, 32}));
  const auto worn = must(wear_closed(*open, closed));
  ASSERT_TRUE(worn->coat().maps().has_normal_map());
  Rng rng(9);
  int kept = 0;
  int filled = 0;
  for (int k = 0; k < 2000; ++k) {
    const std::uint32_t face = random_face(rng, mesh);
    const Vec3 at = random_barycentric(rng, 0.03);
    const Vec3 place = point_on(mesh, face, at);
    const double along = std::hypot(place.x(), place.z());
    const Vec3 before = open->coat_sample(face, at).normal;
    const Vec3 after = worn->coat_sample(face, at).normal;
    const double rise = closed.rise_at(face, at);
    if (rise == 0.0 && along > 2.6e-3) {
      ++kept;
      ASSERT_LT((after - before).norm(), 2e-3) << "face " << face;
    } else if (rise > 0.1e-3 && along > 0.4e-3 && std::abs(place.y()) < 2.5e-3) {
      ++filled;
      const CoatSample sample = worn->coat_sample(face, at);
      const Vec3 own = (barycentric_frame(mesh, face).normal - sample.gradient).normalized();
      ASSERT_LT((after - own).norm(), 0.25) << "face " << face << " at " << at.transpose() << ", " << along;
      ASSERT_GT((after - before).norm(), 0.05) << "face " << face;
    }
  }
  EXPECT_GT(kept, 200);
  EXPECT_GT(filled, 50);
}

TEST(Closing, closes_each_level_of_detail_by_itself) {
  const HeightMap heights = wavy_map(0.5e-3, 32);
  const Vec2 tile(5e-3, 5e-3);
  DetailSettings detail;
  detail.kind = DetailKind::low_pass;
  detail.levels = 3;
  const auto pyramid = std::make_shared<const DetailPyramid>(must(DetailPyramid::build(heights, tile, detail)));
  const Mesostructure maps = must(Mesostructure::build(heights, tile)).with_detail(pyramid);
  CoatSettings settings;
  settings.mapping = Mapping::triplanar;
  const TriangleMesh mesh = mesh_of(icosphere(2, 0.02));
  const auto open = must(make_relief(MeshSurface(TriangleIndex::build(mesh)), maps, settings));
  const ClosedRelief closed = must(close_relief(*open, {3e-3, 16}));
  EXPECT_GT(closed.report.changed_texels, 1000U);
  ASSERT_EQ(closed.levels.size(), 3U);
  const auto worn = must(wear_closed(*open, closed));
  ASSERT_EQ(worn->coat().levels(), 3);
  Rng rng(2);
  for (int level = 0; level <= 3; ++level) {
    // The same level as a coat of its own, closed.
    const HeightMap& own = level == 0 ? heights : pyramid->map(level);
    const auto alone =
        must(make_relief(MeshSurface(TriangleIndex::build(mesh)), must(Mesostructure::build(own, tile)), settings));
    const auto right = must(wear_closed(*alone, must(close_relief(*alone, {3e-3, 16}))));
    const CoatMoment moment{static_cast<double>(level), 0.0};
    for (int k = 0; k < 100; ++k) {
      const std::uint32_t face = random_face(rng, mesh);
      const Vec3 at = random_barycentric(rng, 0.05);
      ASSERT_NEAR(worn->height(worn->frame(face, moment), at[1], at[2]).height,
                  right->height(right->frame(face), at[1], at[2]).height, 5e-6)
          << "level " << level;
    }
  }
}

TEST(Closing, closes_the_sum_of_a_coats_layers) {
  const TriangleMesh mesh = mesh_of(icosphere(2, 0.02));
  CoatSettings settings;
  settings.mapping = Mapping::triplanar;
  CoatParts parts;
  parts.maps.push_back(tiled(wavy_map(0.1e-3, 16), 3e-3));
  parts.layers.push_back({tiled(wavy_map(0.2e-3, 16), 3e-3), Vec2::Ones(), nullptr});
  const auto layered = must(make_relief(MeshSurface(TriangleIndex::build(mesh)), std::move(parts), settings));
  const auto summed =
      must(make_relief(MeshSurface(TriangleIndex::build(mesh)), *tiled(wavy_map(0.3e-3, 16), 3e-3), settings));
  const ClosedRelief one = must(close_relief(*layered, {2e-3, 16}));
  const ClosedRelief other = must(close_relief(*summed, {2e-3, 16}));
  EXPECT_GT(one.report.changed_texels, 500U);
  EXPECT_NEAR(one.report.largest_rise, other.report.largest_rise, 2e-6);
}

}  // namespace
}  // namespace asperity::closing_test
