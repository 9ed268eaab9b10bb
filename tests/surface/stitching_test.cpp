// Joining the reliefs of neighbouring faces (formulation D3, amendments 1 and 3), and T8: gradients against finite
// differences.

#include "asperity/surface/stitching.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <functional>
#include <optional>
#include <set>
#include <string>

#include "asperity/surface/relief/view.h"
#include "tests/surface/folded.h"
#include "tests/surface/reliefs.h"

namespace asperity::stitching_test {
namespace {

using namespace test;

constexpr double amplitude = 5e-4;
const std::vector<double> uneven_image = {0.0, 0.1, 0.7, 1.0};

Stitching joined(Blend blend, FoldMode folds = FoldMode::keep, double rho = 0.1) {
  return {folds, blend, rho, blend == Blend::image ? uneven_image : std::vector<double>{}};
}

CoatSettings coat_settings(Mapping mapping, Stitching stitching) {
  return {mapping, Vec2::Ones(), std::move(stitching)};
}

/// Surfaces whose neighbouring faces disagree: unlike maps on every face of a folded or flat mesh.
std::shared_ptr<const ReliefSurface> patchwork(int kind, std::uint64_t seed, const Stitching& stitching,
                                               Mapping mapping = Mapping::per_face, double high = amplitude) {
  return relief_on(mesh_of(base_of_kind(kind, seed)), unlike_maps(high), coat_settings(mapping, stitching));
}

const Blend continuous_blends[] = {Blend::linear, Blend::s_shape, Blend::quintic, Blend::image};
// Kinds of base that have no faces narrower than the relief is high.
const int sound_kinds[] = {0, 1, 2, 3, 4, 5, 6};

/// Coordinates in `face` of the point between two vertices, `along` from the first.
Vec2 on_edge(const TriangleMesh& mesh, std::uint32_t face, std::uint32_t from, std::uint32_t to, double along) {
  Vec3 barycentric = Vec3::Zero();
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t vertex = mesh.triangles()[face][static_cast<std::size_t>(k)];
    if (vertex == from) barycentric[k] = 1.0 - along;
    if (vertex == to) barycentric[k] = along;
  }
  return {barycentric[1], barycentric[2]};
}

/// The largest difference of heights (m) between both sides of any edge, and of any two faces around a vertex.
double largest_disagreement(const ReliefSurface& surface, Rng& rng) {
  const TriangleMesh& mesh = surface.base().mesh();
  double largest = 0.0;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const ReliefFrame here = surface.frame(face);
    for (int edge = 0; edge < 3; ++edge) {
      const std::uint32_t from = mesh.triangles()[face][static_cast<std::size_t>(edge)];
      const std::uint32_t to = mesh.triangles()[face][static_cast<std::size_t>((edge + 1) % 3)];
      const std::uint32_t other = mesh.neighbour(face, edge);
      if (other != no_index) {
        const ReliefFrame there = surface.frame(other);
        for (const double along : {0.0, 1e-3, rng.uniform(), rng.uniform(), rng.uniform(), 1.0 - 1e-3}) {
          const Vec2 a = on_edge(mesh, face, from, to, along);
          const Vec2 b = on_edge(mesh, other, from, to, along);
          largest = std::max(largest, std::abs(surface.height(here, a.x(), a.y()).height -
                                               surface.height(there, b.x(), b.y()).height));
        }
      }
      const Vec2 corner = on_edge(mesh, face, from, to, 0.0);
      for (const std::uint32_t around : mesh.faces_of_vertex(from)) {
        const Vec2 its = on_edge(mesh, around, from, to, 0.0);
        largest = std::max(largest, std::abs(surface.height(here, corner.x(), corner.y()).height -
                                             surface.height(surface.frame(around), its.x(), its.y()).height));
      }
    }
  }
  return largest;
}

class StitchingContinuity : public testing::TestWithParam<FoldMode> {};

TEST_P(StitchingContinuity, heights_agree_on_both_sides_of_every_edge_and_around_every_vertex) {
  Rng rng(1);
  for (const int kind : sound_kinds) {
    for (const Blend blend : continuous_blends) {
      for (const double rho : {0.05, 1.0 / 3.0}) {
        const auto surface = patchwork(kind, 5, joined(blend, GetParam(), rho));
        ASSERT_FALSE(surface->has_jumps());
        EXPECT_LE(largest_disagreement(*surface, rng), 1e-12)
            << "base " << kind << ", blend " << static_cast<int>(blend) << ", rho " << rho;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Folds, StitchingContinuity, testing::Values(FoldMode::keep, FoldMode::round),
                         [](const auto& value) { return value.param == FoldMode::keep ? "keep" : "round"; });

TEST(StitchingJumps, persist_without_a_blend) {
  Rng rng(2);
  for (const int kind : sound_kinds) {
    const auto surface = patchwork(kind, 5, joined(Blend::none));
    EXPECT_TRUE(surface->has_jumps());
    EXPECT_GT(largest_disagreement(*surface, rng), 0.5 * amplitude) << kind;
  }
}

TEST(StitchingContinuity, one_map_laid_per_face_is_joined_as_well) {
  Rng rng(3);
  for (const int kind : sound_kinds) {
    const auto surface = relief_on(mesh_of(base_of_kind(kind, 5)), {tiled(wavy_map(amplitude, 16))},
                                   coat_settings(Mapping::per_face, joined(Blend::quintic)));
    EXPECT_LE(largest_disagreement(*surface, rng), 1e-12) << kind;
  }
}

TEST(StitchingContinuity, triplanar_needs_no_stitching) {
  Rng rng(4);
  for (const int kind : sound_kinds) {
    const auto surface = relief_on(mesh_of(base_of_kind(kind, 5)), {tiled(wavy_map(amplitude, 16))},
                                   coat_settings(Mapping::triplanar, joined(Blend::none)));
    EXPECT_FALSE(surface->coat().has_seams());
    EXPECT_LE(largest_disagreement(*surface, rng), 1e-12) << kind;
  }
}

TEST(StitchingContinuity, a_lowered_relief_is_continuous_too) {
  Rng rng(5);
  const auto surface = relief_on(mesh_of(icosphere(1, 0.02)), unlike_maps(0.03),
                                 coat_settings(Mapping::per_face, joined(Blend::quintic)));
  ASSERT_GT(surface->report().lowered_vertices, 0U);
  EXPECT_LE(largest_disagreement(*surface, rng), 1e-12);
}

/// Largest change of height along a straight way within a face, cut into `steps`.
double largest_step(const ReliefSurface& surface, std::uint32_t face, const Vec2& from, const Vec2& to, int steps) {
  const ReliefFrame frame = surface.frame(face);
  double largest = 0.0;
  double before = 0.0;
  for (int i = 0; i <= steps; ++i) {
    const Vec2 at = from + (static_cast<double>(i) / steps) * (to - from);
    const double here = surface.height(frame, at.x(), at.y()).height;
    if (i > 0) largest = std::max(largest, std::abs(here - before));
    before = here;
  }
  return largest;
}

TEST_P(StitchingContinuity, within_a_face_the_bands_begin_without_a_jump) {
  Rng rng(6);
  for (const int kind : sound_kinds) {
    const auto surface = patchwork(kind, 5, joined(Blend::quintic, GetParam(), 1.0 / 3.0));
    for (int i = 0; i < 8; ++i) {
      const std::uint32_t face = random_face(rng, surface->base().mesh());
      const Vec3 a = random_barycentric(rng);
      const Vec3 b = random_barycentric(rng);
      const Vec2 from(a[1], a[2]);
      const Vec2 to(b[1], b[2]);
      const double coarse = largest_step(*surface, face, from, to, 4000);
      EXPECT_LE(largest_step(*surface, face, from, to, 40000), 0.2 * coarse + 1e-14)
          << "base " << kind << ", face " << face << ", from " << from.transpose() << " to " << to.transpose();
    }
  }
}

RC_GTEST_PROP(Gutters, on_a_flat_mesh_a_face_says_beyond_its_edge_what_its_neighbour_says, (std::uint64_t seed)) {
  // The coat's own height with continuous UVs, and the joined height within the band.
  static const auto plain =
      relief_on(mesh_of(trial_mesh_a({4, 4, 0.01})), {tiled(wavy_map(amplitude))}, coat_settings(Mapping::uv, {}));
  static const auto patched = patchwork(2, 1, joined(Blend::quintic, FoldMode::keep, 0.2));
  Rng rng(seed);
  const TriangleMesh& mesh = plain->base().mesh();
  const std::uint32_t face = random_face(rng, mesh);
  const int edge = static_cast<int>(rng.below(3));
  const std::uint32_t other = mesh.neighbour(face, edge);
  RC_PRE(other != no_index);
  // A point a little beyond the edge, away from its ends.
  const double beyond = rng.uniform(0.0, 0.05);
  Vec3 barycentric;
  const double along = rng.uniform(0.4, 0.6);
  barycentric[(edge + 2) % 3] = -beyond;
  barycentric[edge] = (1.0 + beyond) * (1.0 - along);
  barycentric[(edge + 1) % 3] = (1.0 + beyond) * along;
  const Vec3 there = barycentric_frame(mesh, other).coordinates(point_on(mesh, face, barycentric));
  const auto own = [&](const ReliefSurface& surface, std::uint32_t one, const Vec3& at) {
    return surface.coat().jet(surface.frame(one).coat, at[1], at[2]).height;
  };
  // Texture coordinates are floats.
  RC_ASSERT(std::abs(own(*plain, face, barycentric) - own(*plain, other, there)) <= 1e-6 * amplitude * 20.0);
  const double seen = patched->height(patched->frame(face), barycentric[1], barycentric[2]).height;
  const double owned = patched->height(patched->frame(other), there[1], there[2]).height;
  RC_ASSERT(std::abs(seen - owned) <= 1e-6 * amplitude);
}

RC_GTEST_PROP(ReliefRange, bounds_every_height_of_the_triangle_asked_for, (std::uint64_t seed)) {
  Rng rng(seed);
  const int kind = static_cast<int>(rng.below(7));
  const FoldMode folds = rng.below(2) == 0 ? FoldMode::keep : FoldMode::round;
  const Mapping mapping = rng.below(3) == 0 ? Mapping::triplanar : Mapping::per_face;
  // Every third is so high that it is rendered lower in places.
  const double high = rng.below(3) == 0 ? 0.03 : amplitude;
  const auto surface =
      patchwork(kind, seed, joined(Blend::quintic, folds, rng.uniform(0.02, 1.0 / 3.0)), mapping, high);
  for (int i = 0; i < 30; ++i) {
    const std::uint32_t face = random_face(rng, surface->base().mesh());
    const ReliefFrame frame = surface->frame(face);
    // From the whole triangle down to a thousandth of it, half of them near an edge or corner.
    const double size = std::pow(10.0, rng.uniform(-3.0, 0.0));
    Vec3 middle = random_barycentric(rng);
    if (i % 2 == 0) middle[static_cast<int>(rng.below(3))] *= 0.05;
    middle /= middle.sum();
    Vec2 corners[3];
    for (int k = 0; k < 3; ++k) {
      const Vec3 corner = (1.0 - size) * middle + size * Vec3::Unit(k);
      corners[k] = Vec2(corner[1], corner[2]);
    }
    const HeightRange range = surface->range(frame, corners);
    for (int j = 0; j < 60; ++j) {
      const Vec3 at = random_barycentric(rng);
      const Vec2 place = at[0] * corners[0] + at[1] * corners[1] + at[2] * corners[2];
      const double height = surface->height(frame, place.x(), place.y()).height;
      const bool bounded = height >= range.lowest - 1e-12 * high && height <= range.highest + 1e-12 * high;
      if (!bounded) {
        RC_LOG() << "base " << kind << (folds == FoldMode::keep ? ", keep" : ", round") << ", amplitude " << high
                 << ", face " << face << " at " << place.transpose() << ", part of size " << size << ": height "
                 << height << " not in " << range.lowest << " to " << range.highest << "\n";
      }
      RC_ASSERT(bounded);
    }
  }
}

TEST(StitchingFolds, kept_heights_never_leave_the_heights_that_are_joined) {
  Rng rng(8);
  for (const int kind : sound_kinds) {
    const auto surface = patchwork(kind, 5, joined(Blend::quintic, FoldMode::keep, 1.0 / 3.0));
    for (int i = 0; i < 2000; ++i) {
      const ReliefFrame frame = surface->frame(random_face(rng, surface->base().mesh()));
      const Vec3 at = random_barycentric(rng);
      const double height = surface->height(frame, at[1], at[2]).height;
      ASSERT_GE(height, surface->coat().lowest() - 1e-15);
      ASSERT_LE(height, surface->coat().highest() + 1e-15);
    }
  }
}

TEST(StitchingFolds, keep_leaves_the_folds_of_a_bare_mesh_and_round_rounds_them) {
  // Amendment 1: H = 0 everywhere, but a coat with seams on ridges and valleys.
  const auto folded = [](FoldMode folds) {
    return relief_on(mesh_of(trial_mesh_c({4, 6, 0.01})), {tiled(flat_map(0.0)), tiled(flat_map(0.0))},
                     coat_settings(Mapping::uv, joined(Blend::quintic, folds, 0.1)));
  };
  const auto kept = folded(FoldMode::keep);
  const auto rounded = folded(FoldMode::round);
  double lowest = 0.0;
  double highest = 0.0;
  for (std::uint32_t face = 0; face < kept->base().mesh().triangles().size(); ++face) {
    for (double u = 0.0; u <= 1.0; u += 0.02) {
      for (double v = 0.0; u + v <= 1.0; v += 0.02) {
        ASSERT_EQ(kept->height(kept->frame(face), u, v).height, 0.0);
        const double height = rounded->height(rounded->frame(face), u, v).height;
        lowest = std::min(lowest, height);
        highest = std::max(highest, height);
      }
    }
  }
  EXPECT_LT(lowest, -1e-5) << "ridges are cut";
  EXPECT_GT(highest, 1e-5) << "valleys are filled";
}

TEST(StitchingFolds, the_bound_on_rounding_holds_for_round_folds_and_leaves_fillets_alone) {
  const double bound = 1e-5;
  const auto folded = [&](FoldMode folds, Mapping mapping) {
    Stitching stitching = joined(Blend::quintic, folds, 1.0 / 3.0);
    stitching.most_rounding = bound;
    stitching.fillet_radius = 0.5e-3;
    return relief_on(mesh_of(valley(degrees(90.0), 0.02)), {tiled(flat_map(0.0))}, coat_settings(mapping, stitching));
  };
  const auto rounded = folded(FoldMode::round, Mapping::per_face);
  double longest = 0.0;
  for (const Vec3f& direction : rounded->shell().directions)
    longest = std::max(longest, static_cast<double>(direction.norm()));
  // Searches look no farther than the surface may have been moved.
  EXPECT_LE(rounded->reach(), longest * bound * (1.0 + 1e-9));
  double most = 0.0;
  for (std::uint32_t face = 0; face < rounded->base().mesh().triangles().size(); ++face) {
    for (double u = 0.0; u <= 1.0; u += 0.02) {
      for (double v = 0.0; u + v <= 1.0; v += 0.02)
        most = std::max(most, std::abs(rounded->height(rounded->frame(face), u, v).height));
    }
  }
  EXPECT_NEAR(most, bound, 1e-9) << "and that is as far as it is";
  // A ball of 0.5 mm in the fold rests 0.21 mm above it: met there, far above where rounding would have to end.
  const auto fillet = folded(FoldMode::fillet, Mapping::triplanar);
  SurfaceCache cache;
  for (const double x : {0.05e-3, 0.2e-3, -0.3e-3}) {
    const Segment down{Vec3(x, 1e-3, 5e-3), Vec3(x, 1e-3, -1e-3)};
    const SweptHit hit = fillet->view(cache).first_touch(down, Sides::front);
    ASSERT_TRUE(hit.hit) << x;
    EXPECT_LT(off_fillet(down.from + hit.t * (down.to - down.from), degrees(90.0), 0.0, 0.5e-3), 1e-6) << x;
  }
}

/// A derivative by central differences of fourth order; nothing where it has not converged (across a texel's line).
std::optional<double> derivative(const std::function<double(double)>& f, double step, double scale) {
  const auto of = [&](double h) { return (8.0 * (f(h) - f(-h)) - (f(2.0 * h) - f(-2.0 * h))) / (12.0 * h); };
  const double fine = of(0.5 * step);
  return std::abs(of(step) - fine) <= 2e-7 * scale ? std::optional<double>(fine) : std::nullopt;
}

struct Counted {
  int checked = 0;
  int skipped = 0;
};

/// Derivatives of the height over random places, the second ones where asked for, against differences: 1e-6 of the
/// largest.
void expect_derivatives(const ReliefSurface& surface, Rng& rng, bool second, const std::string& name) {
  Counted count;
  Counted bends;
  const TriangleMesh& mesh = surface.base().mesh();
  const double slope = 30.0 * surface.coat().amplitude_bound();
  const double bend = 30.0 * slope;
  for (int i = 0; i < 200; ++i) {
    const ReliefFrame frame = surface.frame(random_face(rng, mesh));
    Vec3 at = random_barycentric(rng, 2e-3);
    if (i % 3 == 0) at[static_cast<int>(rng.below(3))] *= 0.1;
    at /= at.sum();
    const double u = at[1];
    const double v = at[2];
    const HeightJet jet = surface.height(frame, u, v);
    const double step = 1e-5;
    const auto by_u = derivative([&](double h) { return surface.height(frame, u + h, v).height; }, step, slope);
    const auto by_v = derivative([&](double h) { return surface.height(frame, u, v + h).height; }, step, slope);
    const bool both = by_u.has_value() && by_v.has_value();
    ++(both ? count.checked : count.skipped);
    if (both) {
      ASSERT_NEAR(*by_u, jet.u, 1e-6 * slope) << name << " at " << at.transpose() << " of face " << frame.face;
      ASSERT_NEAR(*by_v, jet.v, 1e-6 * slope) << name << " at " << at.transpose() << " of face " << frame.face;
    }
    if (!second) continue;
    const auto uu = derivative([&](double h) { return surface.height(frame, u + h, v).u; }, step, bend);
    const auto uv = derivative([&](double h) { return surface.height(frame, u, v + h).u; }, step, bend);
    const auto vv = derivative([&](double h) { return surface.height(frame, u, v + h).v; }, step, bend);
    const bool all = uu.has_value() && uv.has_value() && vv.has_value();
    ++(all ? bends.checked : bends.skipped);
    if (!all) continue;
    ASSERT_NEAR(*uu, jet.uu, 1e-6 * bend) << name << " at " << at.transpose();
    ASSERT_NEAR(*uv, jet.uv, 1e-6 * bend) << name << " at " << at.transpose();
    ASSERT_NEAR(*vv, jet.vv, 1e-6 * bend) << name << " at " << at.transpose();
  }
  EXPECT_GT(count.checked, 150) << name;
  if (second) {
    EXPECT_GT(bends.checked, 100) << name;
  }
}

TEST(T8_gradients, heights_with_and_without_stitching) {
  Rng rng(9);
  for (const int kind : sound_kinds) {
    for (const FoldMode folds : {FoldMode::keep, FoldMode::round}) {
      for (const Blend blend : {Blend::none, Blend::linear, Blend::s_shape, Blend::quintic, Blend::image}) {
        const auto surface = patchwork(kind, 5, joined(blend, folds, 0.2));
        expect_derivatives(*surface, rng, blend == Blend::none || folds == FoldMode::keep,
                           "base " + std::to_string(kind) + ", blend " + std::to_string(static_cast<int>(blend)) +
                               (folds == FoldMode::keep ? ", keep" : ", round"));
      }
    }
  }
}

TEST(HeightsAlone, are_those_with_their_derivatives) {
  Rng rng(15);
  int blended = 0;
  for (const int kind : sound_kinds) {
    for (const FoldMode folds : {FoldMode::keep, FoldMode::round}) {
      for (const double high : {amplitude, 60.0 * amplitude}) {
        const auto surface = patchwork(kind, 5, joined(Blend::quintic, folds, 0.2), Mapping::per_face, high);
        const double rounding = 1e-14 * surface->coat().amplitude_bound();
        for (int i = 0; i < 200; ++i) {
          const ReliefFrame frame = surface->frame(random_face(rng, surface->base().mesh()));
          const Vec3 at = random_barycentric(rng, 1e-3);
          blended += surface->heights_at(frame, at[1], at[2]) > 1 ? 1 : 0;
          ASSERT_NEAR(surface->height_alone(frame, at[1], at[2]), surface->height(frame, at[1], at[2]).height, rounding)
              << "kind " << kind << " at " << at.transpose();
        }
      }
    }
  }
  EXPECT_GT(blended, 2000);
}

TEST(HeightsAlone, several_at_once_are_each_as_alone) {
  Rng rng(16);
  int blended = 0;
  for (const int kind : sound_kinds) {
    for (const Mapping mapping : {Mapping::per_face, Mapping::triplanar}) {
      for (const double high : {amplitude, 60.0 * amplitude}) {
        const auto surface = patchwork(kind, 5, joined(Blend::quintic, FoldMode::keep, 0.2), mapping, high);
        for (int i = 0; i < 100; ++i) {
          const ReliefFrame frame = surface->frame(random_face(rng, surface->base().mesh()));
          Lanes u;
          Lanes v;
          for (std::size_t lane = 0; lane < lanes; ++lane) {
            const Vec3 at = random_barycentric(rng, 1e-3);
            u[lane] = at[1];
            v[lane] = at[2];
          }
          Lanes heights;
          surface->heights_alone(frame, u, v, heights);
          const Vec3 from = random_point(rng, 0.02);
          Lanes squares;
          surface->squared_distances(frame, u, v, from, squares);
          for (std::size_t lane = 0; lane < lanes; ++lane) {
            blended += surface->heights_at(frame, u[lane], v[lane]) > 1 ? 1 : 0;
            ASSERT_EQ(heights[lane], surface->height_alone(frame, u[lane], v[lane])) << "kind " << kind;
            const double expected = (surface->place(frame, u[lane], v[lane]) - from).squaredNorm();
            ASSERT_NEAR(squares[lane], expected, 1e-14 * expected) << "kind " << kind;
          }
        }
      }
    }
  }
  EXPECT_GT(blended, 500);
}

TEST(WalksInBands, come_to_rest_at_newtons_pace) {
  // With the bend of the weights left out each step of such a walk is but a tenth shorter than the one before.
  Rng rng(14);
  int walks = 0;
  std::uint64_t looks = 0;
  for (const int kind : sound_kinds) {
    const auto surface = patchwork(kind, 5, joined(Blend::quintic, FoldMode::keep, 0.03));
    const TriangleMesh& mesh = surface->base().mesh();
    for (int i = 0; i < 200; ++i) {
      const ReliefFrame frame = surface->frame(random_face(rng, mesh));
      Vec3 at = random_barycentric(rng, 0.2);
      at[static_cast<int>(rng.below(3))] = 0.012;
      at /= at.sum();
      if (surface->heights_at(frame, at[1], at[2]) == 1) continue;
      const ReliefPoint aim = surface->point(frame, at[1], at[2]);
      const Vec3 goal = aim.point - amplitude * aim.front;
      ReliefPlace place{frame, at[1] + rng.uniform(-0.006, 0.006), at[2] + rng.uniform(-0.006, 0.006)};
      ReliefPoint spot = surface->point(frame, place.u, place.v);
      WorkCount count;
      const Goal to{.point = goal, .may_leave = false, .exactly = true};
      ASSERT_EQ(descend(*surface, place, spot, 1.0, to, count), DescentEnd::rest);
      ASSERT_LE((spot.point - goal).norm(), amplitude * (1.0 + 1e-6)) << "kind " << kind << ", walk " << i;
      ++walks;
      looks += count.evaluations;
    }
  }
  ASSERT_GT(walks, 1000);
  // Each look is at four heights.
  EXPECT_LT(static_cast<double>(looks) / walks, 4.0 * 8.0);
}

TEST(T8_gradients, triplanar_heights_with_their_second_derivatives) {
  Rng rng(10);
  for (const int kind : sound_kinds) {
    const auto surface =
        relief_on(mesh_of(base_of_kind(kind, 5)), {tiled(wavy_map(amplitude))}, coat_settings(Mapping::triplanar, {}));
    expect_derivatives(*surface, rng, true, "triplanar, base " + std::to_string(kind));
  }
}

TEST(T8_gradients, lowered_heights_with_their_second_derivatives) {
  Rng rng(11);
  const auto plain =
      relief_on(mesh_of(icosphere(1, 0.02)), {tiled(wavy_map(0.03))}, coat_settings(Mapping::triplanar, {}));
  const auto patched = relief_on(mesh_of(icosphere(1, 0.02)), unlike_maps(0.03),
                                 coat_settings(Mapping::per_face, joined(Blend::quintic, FoldMode::keep, 0.2)));
  ASSERT_GT(plain->report().lowered_vertices, 0U);
  ASSERT_GT(patched->report().lowered_vertices, 0U);
  expect_derivatives(*plain, rng, true, "lowered");
  // Unlike faces are lowered by unlike shares: those have slopes of their own.
  const auto uneven =
      relief_on(mesh_of(base_of_kind(1, 5)), {tiled(wavy_map(0.02))}, coat_settings(Mapping::triplanar, {}));
  double steepest = 0.0;
  for (std::uint32_t face = 0; face < uneven->base().mesh().triangles().size(); ++face) {
    const ReliefFrame frame = uneven->frame(face);
    steepest = std::max({steepest, std::abs(frame.share_u), std::abs(frame.share_v)});
  }
  ASSERT_GT(steepest, 0.1);
  expect_derivatives(*uneven, rng, true, "lowered by unlike shares");
  expect_derivatives(*patched, rng, true, "lowered and stitched");
}

/// Gradients of Phi at places in the shell against differences in space, 1e-6 of a unit slope.
void expect_field_gradients(const ReliefSurface& surface, Rng& rng, bool own, const std::string& name) {
  Counted count;
  const TriangleMesh& mesh = surface.base().mesh();
  const double step = 1e-5 * mesh.mean_edge();
  for (int i = 0; i < 150; ++i) {
    const ReliefFrame frame = surface.frame(random_face(rng, mesh));
    Vec3 at = random_barycentric(rng, 5e-3);
    if (i % 3 == 0) at[static_cast<int>(rng.below(3))] *= 0.1;
    at /= at.sum();
    if (at.minCoeff() < 5e-4) continue;
    const double height = surface.height(frame, at[1], at[2]).height;
    const ShellPlace place{at[1], at[2], height + rng.uniform(-amplitude, amplitude)};
    const Vec3 p = frame.prism.point(place);
    const FieldSample sample = own ? surface.own_field(frame, place) : surface.field(frame, place);
    for (int k = 0; k < 3; ++k) {
      const auto value = [&](double h) {
        ShellPlace there = place;
        EXPECT_TRUE(frame.prism.invert(p + h * Vec3::Unit(k), there)) << name << " at " << at.transpose();
        return (own ? surface.own_field(frame, there) : surface.field(frame, there)).value;
      };
      const auto slope = derivative(value, step, 1.0);
      ++(slope ? count.checked : count.skipped);
      if (slope) {
        ASSERT_NEAR(*slope, sample.gradient[k], 1e-6) << name << " at " << at.transpose();
      }
    }
  }
  EXPECT_GT(count.checked, 300) << name;
}

TEST(T8_gradients, of_the_field_and_of_the_own_field) {
  Rng rng(12);
  for (const int kind : sound_kinds) {
    for (const FoldMode folds : {FoldMode::keep, FoldMode::round}) {
      for (const Blend blend : {Blend::linear, Blend::s_shape, Blend::quintic, Blend::image}) {
        const auto surface = patchwork(kind, 5, joined(blend, folds, 0.2));
        const std::string name = "base " + std::to_string(kind) + ", blend " + std::to_string(static_cast<int>(blend)) +
                                 (folds == FoldMode::keep ? ", keep" : ", round");
        expect_field_gradients(*surface, rng, false, name);
        if (blend == Blend::quintic) expect_field_gradients(*surface, rng, true, name + ", own");
      }
    }
  }
}

TEST(T8_gradients, of_the_field_of_triplanar_and_of_lowered_coats) {
  Rng rng(13);
  const auto triplanar =
      relief_on(mesh_of(icosphere(1, 0.02)), {tiled(wavy_map(amplitude))}, coat_settings(Mapping::triplanar, {}));
  expect_field_gradients(*triplanar, rng, false, "triplanar");
  for (const FoldMode folds : {FoldMode::keep, FoldMode::round}) {
    const auto lowered = relief_on(mesh_of(icosphere(1, 0.02)), unlike_maps(0.03),
                                   coat_settings(Mapping::per_face, joined(Blend::quintic, folds, 0.1)));
    ASSERT_GT(lowered->report().lowered_vertices, 0U);
    expect_field_gradients(*lowered, rng, false, folds == FoldMode::keep ? "lowered, keep" : "lowered, round");
  }
}

TEST(T8_gradients, of_the_height_are_tangent_to_the_surface) {
  // The displaced surface's normal is that of its level set: grad Phi is parallel to it, and so across every tangent.
  Rng rng(14);
  for (const int kind : sound_kinds) {
    for (const FoldMode folds : {FoldMode::keep, FoldMode::round}) {
      const auto surface = patchwork(kind, 5, joined(Blend::quintic, folds, 0.2));
      for (int i = 0; i < 300; ++i) {
        const ReliefFrame frame = surface->frame(random_face(rng, surface->base().mesh()));
        const Vec3 at = random_barycentric(rng, 1e-6);
        const ReliefPoint point = surface->point(frame, at[1], at[2]);
        const FieldSample sample = surface->field(frame, {at[1], at[2], point.jet.height});
        ASSERT_LE(std::abs(sample.value), 1e-12);
        ASSERT_LT(std::abs(sample.gradient.dot(point.along_u)) / point.along_u.norm(), 1e-12);
        ASSERT_LT(std::abs(sample.gradient.dot(point.along_v)) / point.along_v.norm(), 1e-12);
        ASSERT_GT(sample.gradient.dot(point.front), 0.0);
      }
    }
  }
}

TEST(StitchBands, are_the_same_width_from_both_faces_and_end_within_the_faces_around) {
  for (int kind = 0; kind < kinds_of_base; ++kind) {
    const TriangleMesh mesh = mesh_of(base_of_kind(kind, 5));
    const std::vector<StitchBand> bands = stitch_bands(mesh, Shell::build(mesh), 1.0 / 3.0);
    ASSERT_EQ(bands.size(), mesh.triangles().size());
    const auto height = [&](std::uint32_t face, int corner) {
      const auto corners = mesh.corners(face);
      const auto k = static_cast<std::size_t>(corner);
      return (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm() /
             (corners[(k + 1) % 3] - corners[(k + 2) % 3]).norm();
    };
    for (std::uint32_t face = 0; face < bands.size(); ++face) {
      for (int k = 0; k < 3; ++k) {
        const double rho = static_cast<double>(bands[face].rho[k]);
        EXPECT_GT(rho, 0.0);
        EXPECT_LE(rho, 1.0 / 3.0 + 1e-6);
        EXPECT_GE(bands[face].look[k], bands[face].rho[k]);
        const std::uint32_t other = mesh.neighbour(face, (k + 1) % 3);
        if (other == no_index) continue;
        for (int j = 0; j < 3; ++j) {
          if (mesh.neighbour(other, (j + 1) % 3) != face) continue;
          const double here = rho * height(face, k);
          EXPECT_NEAR(here, static_cast<double>(bands[other].rho[j]) * height(other, j), 1e-6 * here) << kind;
        }
      }
    }
  }
}

/// How much of a say (the least of what its three coordinates are above -rho, as shares of rho; below 0: none) a face
/// has at a place of another one, seen along the place's own direction.
double say_at(const ShellPrism& prism, double u, double v, const TriangleMesh& mesh, std::uint32_t other,
              const StitchBand& band) {
  const auto corners = mesh.corners(other);
  const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
  const Vec3 direction = prism.direction_at(u, v);
  // Faces that are seen more aslant than by 0.02 have none.
  if (normal.dot(direction) <= 0.02 * direction.norm()) return -1.0;
  const Vec3 base = prism.base_at(u, v);
  const Vec3 there = base + normal.dot(corners[0] - base) / normal.dot(direction) * direction;
  const Vec3 at = barycentric_frame(mesh, other).coordinates(there);
  double least = infinity;
  for (int k = 0; k < 3; ++k) least = std::min(least, at[k] / static_cast<double>(band.rho[k]) + 1.0);
  return least;
}

TEST(StitchBands, tell_all_faces_around_that_have_a_say) {
  int say = 0;
  for (int kind = 0; kind < kinds_of_base; ++kind) {
    for (const double rho : {0.05, 0.2, 1.0 / 3.0}) {
      const TriangleMesh mesh = mesh_of(base_of_kind(kind, 5));
      const Shell shell = Shell::build(mesh);
      std::vector<StitchBand> bands = stitch_bands(mesh, shell, rho);
      narrow_reaches(mesh, shell, bands);
      Rng rng(7);
      for (int i = 0; i < 20000; ++i) {
        const std::uint32_t face = random_face(rng, mesh);
        // At all distances from a corner.
        const auto corner = static_cast<int>(rng.below(3));
        const double off = std::pow(10.0, rng.uniform(-3.0, 0.0));
        const double share = rng.uniform();
        Vec3 at = Vec3::Zero();
        at[corner] = 1.0 - off;
        at[(corner + 1) % 3] = off * share;
        at[(corner + 2) % 3] = off * (1.0 - share);
        const ShellPrism prism = shell.prism(mesh, face);
        const TriangleMesh::Triangle& t = mesh.triangles()[face];
        for (std::size_t k = 0; k < 3; ++k) {
          for (const std::uint32_t other : mesh.faces_of_vertex(t[k])) {
            if (other == face) continue;
            const double here = say_at(prism, at[1], at[2], mesh, other, bands[other]);
            if (here <= 1e-6) continue;
            ++say;
            bool asked = at[static_cast<int>(k)] > 1.0 - static_cast<double>(bands[face].reach[k]);
            for (int edge = 0; edge < 3; ++edge)
              asked = asked || (mesh.neighbour(face, (edge + 1) % 3) == other &&
                                at[edge] < static_cast<double>(bands[face].look[edge]));
            ASSERT_TRUE(asked) << "kind " << kind << ", rho " << rho << ": face " << other << " at " << at.transpose()
                               << " of " << face << ": " << here;
          }
        }
      }
    }
  }
  EXPECT_GT(say, 100000);
}

TEST(StitchBands, leave_most_of_a_face_to_itself_beside_a_sliver) {
  // One sliver widens the reach of every face around its vertex.
  MeshSource fan;
  fan.positions = {{0.0, 0.0, 0.0},  {1.0, 0.0, 0.0},    {0.5, 0.9, 0.0},   {-0.5, 0.9, 0.0},
                   {-1.0, 0.0, 0.0}, {-1.0, -0.12, 0.0}, {-0.5, -0.9, 0.0}, {0.5, -0.9, 0.0}};
  fan.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}, {0, 5, 6}, {0, 6, 7}, {0, 7, 1}};
  const TriangleMesh mesh = mesh_of(fan);
  const Shell shell = Shell::build(mesh);
  std::vector<StitchBand> bands = stitch_bands(mesh, shell, 0.2);
  const std::vector<StitchBand> wide = bands;
  narrow_reaches(mesh, shell, bands);
  for (const std::uint32_t far : {0U, 1U}) {
    EXPECT_GT(wide[far].reach[0], 0.4F);
    EXPECT_LT(bands[far].reach[0], 0.15F);
  }
  for (std::size_t face = 0; face < bands.size(); ++face) EXPECT_LE(bands[face].reach[0], wide[face].reach[0]);
}

TEST(StitchingSettings, each_bad_value_is_named) {
  const auto expect_refused = [](const Stitching& stitching, const std::string& place) {
    const Status status = validate(stitching);
    ASSERT_FALSE(status.ok()) << place;
    EXPECT_EQ(status.error().code, ErrorCode::bad_value);
    EXPECT_EQ(status.error().place, place);
    EXPECT_FALSE(status.error().accepted.empty());
    const TriangleMesh mesh = mesh_of(icosphere(0, 0.01));
    const auto coat = Coat::build(mesh, tiled(flat_map(0.0)), coat_settings(Mapping::uv, stitching));
    ASSERT_FALSE(coat.ok());
    EXPECT_EQ(coat.error().place, "stitching." + place);
  };
  for (const double bad : {0.0, -0.1, 0.34, std::nan(""), infinity})
    expect_refused({FoldMode::keep, Blend::quintic, bad, {}}, "rho");
  for (const std::vector<double>& bad :
       {std::vector<double>{}, {1.0}, {0.0, 1.1}, {-0.1, 1.0}, {0.0, std::nan(""), 1.0}, {1.0, 0.0}})
    expect_refused({FoldMode::keep, Blend::image, 0.1, bad}, "blend_map");
  EXPECT_TRUE(validate(Stitching{FoldMode::round, Blend::image, 1.0 / 3.0, {0.0, 1.0}}).ok());
}

}  // namespace
}  // namespace asperity::stitching_test
