// Folds that are rounded: the height over a face against the field that all faces around it make.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>

#include "tests/surface/folded.h"
#include "tests/surface/reliefs.h"

namespace asperity::round_folds_test {
namespace {

using namespace test;

constexpr double amplitude = 5e-4;

/// How far (m) the field of all faces around is from 0 on the rounded surface, near corners, where many faces meet, and
/// near edges: the largest of some places.
double largest_value(const ReliefSurface& surface, double rho, Rng& rng) {
  SurfaceCache cache;
  double largest = 0.0;
  for (int i = 0; i < 200; ++i) {
    const std::uint32_t face = random_face(rng, surface.base().mesh());
    const auto corner = static_cast<int>(rng.below(3));
    const double off = rng.uniform(0.0, 1.2 * rho);
    const double along = rng.below(2) == 0 ? rng.uniform(0.0, 1.0 - off) : rng.uniform(0.0, std::min(rho, 1.0 - off));
    Vec3 at;
    at[corner] = 1.0 - off - along;
    at[(corner + 1) % 3] = off;
    at[(corner + 2) % 3] = along;
    const Vec3 point = surface.point(surface.frame(face), at[1], at[2]).point;
    largest = std::max(largest, std::abs(surface.eval(point, cache).value));
  }
  return largest;
}

std::shared_ptr<const ReliefSurface> rounded(const MeshSource& base, double high, double rho) {
  return relief_on(mesh_of(base), unlike_maps(high),
                   {Mapping::per_face, Vec2::Ones(), {FoldMode::round, Blend::quintic, rho, {}}});
}

// Heights leave out faces that are far from having a say; the field asks every one of them.

RC_GTEST_PROP(RoundFolds, a_rounded_height_is_a_root_of_the_field_that_all_faces_around_make, (std::uint64_t seed)) {
  // On bases whose folds are not so sharp that the root runs away.
  Rng rng(seed);
  constexpr int kinds[] = {0, 1, 2, 5};
  const int kind = kinds[rng.below(std::size(kinds))];
  const double rho = rng.uniform(0.005, 0.1);
  const double high = amplitude * rng.uniform(0.5, 2.0);
  const double value = largest_value(*rounded(base_of_kind(kind, rng.below(1000)), high, rho), rho, rng);
  if (value > 1e-9 * amplitude)
    RC_LOG() << "base " << kind << ", rho " << rho << ", amplitude " << high << ": " << value << " m\n";
  RC_ASSERT(value <= 1e-9 * amplitude);
}

TEST(RoundFolds, around_a_vertex_of_many_faces_a_rounded_height_is_such_a_root_as_well) {
  // More of them than are kept ready.
  constexpr std::uint32_t around = 20;
  MeshSource fan;
  fan.positions.emplace_back(0.0, 0.0, 2e-3);
  for (std::uint32_t i = 0; i < around; ++i) {
    const double angle = degrees(360.0) * i / around;
    fan.positions.emplace_back(0.02 * std::cos(angle), 0.02 * std::sin(angle), 0.0);
    fan.triangles.push_back({0, 1 + i, 1 + (i + 1) % around});
  }
  Rng rng(3);
  for (const double rho : {0.02, 0.1, 0.25})
    EXPECT_LE(largest_value(*rounded(fan, 0.2 * amplitude, rho), rho, rng), 1e-9 * amplitude) << rho;
}

}  // namespace
}  // namespace asperity::round_folds_test
