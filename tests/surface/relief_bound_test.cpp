// Bounds of first order over parts of faces: no place outside, and how much tighter they are than a range of heights.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include <fmt/format.h>

#include "asperity/field/mesostructure/solid.h"
#include "asperity/geometry/closest_point.h"
#include "tests/surface/folded.h"
#include "tests/surface/reliefs.h"

namespace asperity::relief_bound_test {
namespace {

using namespace test;

/// A triangle of this size (barycentric) somewhere on a face, or, one time in three, a line and what is beside it.
FacePart random_part(Rng& rng, double size) {
  const Vec3 at = random_barycentric(rng);
  const auto place = [&] {
    Vec2 moved = Vec2(at[1], at[2]) + size * Vec2(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0));
    moved = moved.cwiseMax(0.0);
    if (moved.sum() > 1.0) moved /= moved.sum();
    return moved;
  };
  const Vec2 a = place();
  const Vec2 b = place();
  if (rng.below(3) != 0) return FacePart::triangle(a, b, place());
  // Its places may lie beyond the face's edges by the pad.
  return FacePart::line(a, b, 0.1 * size * Vec2(rng.uniform(), rng.uniform()));
}

Vec2 random_place(Rng& rng, const FacePart& part) {
  Vec3 weights = random_barycentric(rng);
  // Corners and edges count too.
  if (rng.below(3) == 0) weights[static_cast<int>(rng.below(3))] = 0.0;
  weights /= weights.sum();
  Vec2 at = weights[0] * part.corner[0] + weights[1] * part.corner[1] + weights[2] * part.corner[2];
  at += Vec2(rng.uniform(-1.0, 1.0) * part.pad.x(), rng.uniform(-1.0, 1.0) * part.pad.y());
  return at;
}

struct Tightness {
  double bound = 0.0;  // sums over parts of: error of the form
  double range = 0.0;  // half of the range of heights
  double there = 0.0;  // what the surface really is off its best plane, sampled
};

double distance_to_line(const Vec3& a, const Vec3& b, const Vec3& p) {
  const Vec3 way = b - a;
  const double t = way.isZero() ? 0.0 : std::clamp((p - a).dot(way) / way.squaredNorm(), 0.0, 1.0);
  return (a + t * way - p).norm();
}

double distance_to(const ReliefBound& bound, const Vec3& p) {
  const Vec3 side = bound.corner[1] - bound.corner[0];
  const Vec3 other = bound.corner[2] - bound.corner[0];
  // Three places on an edge make no triangle.
  if (side.cross(other).norm() < 1e-3 * side.norm() * other.norm()) {
    return std::min({distance_to_line(bound.corner[0], bound.corner[1], p),
                     distance_to_line(bound.corner[1], bound.corner[2], p),
                     distance_to_line(bound.corner[2], bound.corner[0], p)}) -
           1e-3 * side.norm();
  }
  const double square =
      closest_point_on_triangle(p, bound.corner[0], bound.corner[1], bound.corner[2]).squared_distance;
  return std::sqrt(std::max(0.0, square));
}

/// No height and no point of random parts of this size leaves its bounds.
Tightness expect_within(const ReliefSurface& surface, double size, std::uint64_t seed, int parts,
                        const CoatMoment& moment = {}) {
  Rng rng(seed);
  Tightness sum;
  for (int i = 0; i < parts; ++i) {
    const ReliefFrame frame = surface.frame(random_face(rng, surface.base().mesh()), moment);
    const FacePart part = random_part(rng, size);
    const HeightForm form = surface.form(frame, part);
    const ReliefBound bound = surface.bound(frame, part);
    double lowest = infinity;
    double highest = -infinity;
    for (int k = 0; k < 40; ++k) {
      const Vec2 at = random_place(rng, part);
      // Beyond its face a relief is another face's.
      if (at.minCoeff() < 0.0 || at.sum() > 1.0) continue;
      const Vec2 off = at - part.middle;
      const double height = surface.height(frame, at.x(), at.y()).height;
      const double rest = height - form.height - form.u * off.x() - form.v * off.y();
      lowest = std::min(lowest, rest);
      highest = std::max(highest, rest);
      if (!(std::abs(rest) <= form.error * (1.0 + 1e-9) + 1e-15)) {
        ADD_FAILURE() << "face " << frame.face << " at " << at.transpose() << ", part of " << size << ": off by "
                      << rest << ", bound " << form.error;
        return sum;
      }
      const Vec3 point = surface.point(frame, at.x(), at.y()).point;
      // A line has no width: what lies beside it is for the height's form alone.
      if (part.pad.isZero() && !(distance_to(bound, point) <= bound.error * (1.0 + 1e-9) + 1e-12)) {
        ADD_FAILURE() << "face " << frame.face << " at " << at.transpose() << ": " << distance_to(bound, point)
                      << " from the triangle, bound " << bound.error;
        return sum;
      }
    }
    if (!part.pad.isZero()) continue;
    const HeightRange range = surface.range(frame, part.corner.data());
    sum.bound += form.error / parts;
    sum.range += 0.5 * (range.highest - range.lowest) / parts;
    sum.there += 0.5 * (highest - lowest) / parts;
  }
  return sum;
}

constexpr double sizes[] = {0.5, 0.2, 0.05, 0.01, 1e-3, 1e-5};

void expect_within_at_all_sizes(const ReliefSurface& surface, std::uint64_t seed, const CoatMoment& moment = {},
                                int parts = 400) {
  for (const double size : sizes) expect_within(surface, size, seed, parts, moment);
}

HeightMap rough_map(double amplitude, int size, Reconstruction how) {
  return map_of(
      size,
      [&](double s, double t) {
        double height = 0.0;
        for (int octave = 1; octave <= size / 4; octave *= 2)
          height += std::sin(2.0 * std::numbers::pi * octave * (s + 0.31 * octave)) *
                    std::cos(2.0 * std::numbers::pi * octave * t) / octave;
        return 0.5 * amplitude * height;
      },
      Wrap::repeat, how);
}

TEST(ReliefBound, HoldsOnEveryBaseByEveryMappingAndReconstruction) {
  for (int kind = 0; kind < kinds_of_base; ++kind) {
    for (const Mapping mapping : {Mapping::per_face, Mapping::triplanar}) {
      for (const Reconstruction how : {Reconstruction::nearest, Reconstruction::bilinear,
                                       Reconstruction::quadratic_bspline, Reconstruction::bicubic}) {
        SCOPED_TRACE(fmt::format("base {}, {}, {}", kind, to_string(mapping), to_string(how)));
        const auto surface = coated(base_of_kind(kind, 3), rough_map(3e-4, 64, how), mapping, 0.008);
        expect_within_at_all_sizes(*surface, static_cast<std::uint64_t>(kind) + 1);
        if (testing::Test::HasFailure()) return;
      }
    }
  }
}

TEST(ReliefBound, HoldsByTextureCoordinatesWithSeams) {
  for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
    const auto surface =
        coated(icosphere(2, 0.02),
               map_of(
                   64, [](double s, double t) { return 3e-4 * std::sin(40.0 * s) * std::cos(30.0 * t); }, wrap),
               Mapping::uv);
    expect_within_at_all_sizes(*surface, 5);
  }
}

TEST(ReliefBound, HoldsWhereFacesAreStitched) {
  for (const FoldMode folds : {FoldMode::keep, FoldMode::round, FoldMode::fillet}) {
    for (const Blend blend : {Blend::none, Blend::linear, Blend::s_shape, Blend::quintic, Blend::image}) {
      for (const int kind : {0, 1, 2, 4, 5, 6}) {
        SCOPED_TRACE(fmt::format("base {}, {}, blend {}", kind, to_string(folds), static_cast<int>(blend)));
        Stitching stitching;
        stitching.folds = folds;
        stitching.blend = blend;
        stitching.rho = 0.2;
        stitching.fillet_radius = 1e-3;
        if (blend == Blend::image) stitching.blend_map = {0.0, 0.1, 0.7, 0.6, 1.0};
        const auto surface = relief_on(mesh_of(base_of_kind(kind, 3)), unlike_maps(2e-4),
                                       CoatSettings{Mapping::per_face, Vec2(1.5, 1.5), stitching});
        // What is rounded is found anew at every place.
        expect_within_at_all_sizes(*surface, 7, {}, folds == FoldMode::keep ? 300 : 20);
        if (testing::Test::HasFailure()) return;
      }
    }
  }
}

TEST(ReliefBound, HoldsWhereReliefsAreLowered) {
  Stitching stitching;
  stitching.rho = 0.2;
  const auto plain = relief_on(mesh_of(icosphere(1, 0.02)), {tiled(wavy_map(0.03))},
                               CoatSettings{Mapping::triplanar, Vec2::Ones(), {}});
  const auto patched = relief_on(mesh_of(icosphere(1, 0.02)), unlike_maps(0.03),
                                 CoatSettings{Mapping::per_face, Vec2::Ones(), stitching});
  for (const auto& surface : {plain, patched}) {
    ASSERT_GT(surface->report().lowered_vertices, 0U);
    expect_within_at_all_sizes(*surface, 9);
  }
}

TEST(ReliefBound, HoldsWithLayersThatChangeWithTimeAndAtLevelsOfDetail) {
  for (const SolidKind kind :
       {SolidKind::waves, SolidKind::lattice, SolidKind::rings, SolidKind::noise, SolidKind::pulse}) {
    SolidSpec spec;
    spec.kind = kind;
    spec.amplitude = 2e-4;
    spec.wavelength = kind == SolidKind::pulse ? 0.02 : 3e-3;
    spec.direction = Vec3(1.0, 2.0, -0.5);
    spec.centre = Vec3(0.0, 0.0, 0.02);
    spec.frequency = 2.0;
    spec.drift = Vec3(0.01, 0.0, 0.02);
    spec.octaves = 3;
    for (const Mapping mapping : {Mapping::per_face, Mapping::triplanar}) {
      SCOPED_TRACE(fmt::format("{}, {}", to_string(kind), to_string(mapping)));
      TriangleMesh mesh = mesh_of(icosphere(1, 0.02));
      const Mesostructure plain =
          must(Mesostructure::build(rough_map(2e-4, 64, Reconstruction::quadratic_bspline), Vec2(0.01, 0.01)));
      const auto detail =
          std::make_shared<const DetailPyramid>(must(DetailPyramid::build(plain.heights(), plain.tile(), {})));
      CoatParts parts;
      parts.maps.push_back(std::make_shared<const Mesostructure>(plain.with_detail(detail)));
      parts.layers.push_back({tiled(wavy_map(1e-4), 0.004), Vec2(2.0, 2.0), nullptr});
      parts.layers.push_back(
          {nullptr, Vec2::Ones(), std::make_shared<const SolidMesostructure>(must(SolidMesostructure::build(spec)))});
      const auto surface = must(make_relief(MeshSurface(TriangleIndex::build(std::move(mesh))), std::move(parts),
                                            CoatSettings{mapping, Vec2::Ones(), {}}));
      for (const double level : {0.0, 0.6, 2.3}) expect_within_at_all_sizes(*surface, 11, {level, 0.137});
      if (testing::Test::HasFailure()) return;
    }
  }
}

TEST(ReliefBound, IsFarThinnerThanTheRangeOfHeights) {
  struct Case {
    const char* name;
    std::shared_ptr<const ReliefSurface> surface;
    double share;  // of the range's, at most, where parts are small
  };
  Stitching wide;
  wide.rho = 0.3;
  const HeightMap smooth = wavy_map(3e-4, 128);
  const Case cases[] = {
      {"smooth, per face", coated(icosphere(1, 0.02), smooth, Mapping::per_face, 0.01, 1.0, wide), 0.02},
      {"smooth, triplanar", coated(icosphere(1, 0.02), smooth, Mapping::triplanar), 0.02},
      {"rough, triplanar",
       coated(icosphere(1, 0.02), rough_map(3e-4, 256, Reconstruction::quadratic_bspline), Mapping::triplanar), 0.1}};
  for (const Case& one : cases) {
    for (const double size : sizes) {
      const Tightness found = expect_within(*one.surface, size, 13, 1000);
      std::cout << fmt::format("{}, parts of {:g}: {:.3g} nm where {:.3g} are; the range {:.3g}\n", one.name, size,
                               1e9 * found.bound, 1e9 * found.there, 1e9 * found.range);
      if (size <= 0.01 && size > 1e-4) {
        EXPECT_LT(found.bound, one.share * found.range) << one.name << ", " << size;
        EXPECT_LT(found.bound, 6.0 * found.there + 1e-12) << one.name << ", " << size;
      }
    }
  }
}

TEST(ReliefBound, ErrorFallsWithTheSquareOfTheSize) {
  Stitching wide;
  wide.rho = 0.3;
  for (const auto& surface : {coated(icosphere(1, 0.02), wavy_map(3e-4, 128), Mapping::per_face, 0.01, 1.0, wide),
                              coated(icosphere(1, 0.02), wavy_map(3e-4, 128), Mapping::triplanar)}) {
    const double coarse = expect_within(*surface, 1e-2, 17, 2000).bound;
    const double fine = expect_within(*surface, 1e-3, 17, 2000).bound;
    EXPECT_NEAR(std::log10(coarse / fine), 2.0, 0.15);
  }
}

}  // namespace
}  // namespace asperity::relief_bound_test
