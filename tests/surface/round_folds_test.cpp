// Folds that are rounded: the height over a face against the field that all faces around it make.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "tests/surface/folded.h"
#include "tests/surface/reliefs.h"

namespace asperity::round_folds_test {
namespace {

using namespace test;

constexpr double amplitude = 5e-4;

RC_GTEST_PROP(RoundFolds, a_rounded_height_is_a_root_of_the_field_that_all_faces_around_make, (std::uint64_t seed)) {
  // Heights leave out faces that are far from having a say; the field asks every one of them. On bases whose folds
  // are not so sharp that the root runs away.
  Rng rng(seed);
  constexpr int kinds[] = {0, 1, 2, 5};
  const int kind = kinds[rng.below(std::size(kinds))];
  const double rho = rng.uniform(0.005, 0.1);
  const double high = amplitude * rng.uniform(0.5, 2.0);
  const auto surface = relief_on(mesh_of(base_of_kind(kind, rng.below(1000))), unlike_maps(high),
                                 {Mapping::per_face, Vec2::Ones(), {FoldMode::round, Blend::quintic, rho, {}}});
  const TriangleMesh& mesh = surface->base().mesh();
  SurfaceCache cache;
  for (int i = 0; i < 200; ++i) {
    const std::uint32_t face = random_face(rng, mesh);
    const ReliefFrame frame = surface->frame(face);
    // Near corners, where many faces meet, and near edges.
    const std::uint32_t corner = rng.below(3);
    const double off = rng.uniform(0.0, 1.2 * rho);
    const double along = rng.below(2) == 0 ? rng.uniform(0.0, 1.0 - off) : rng.uniform(0.0, std::min(rho, 1.0 - off));
    Vec3 at;
    at[static_cast<int>(corner)] = 1.0 - off - along;
    at[static_cast<int>((corner + 1) % 3)] = off;
    at[static_cast<int>((corner + 2) % 3)] = along;
    const Vec3 point = surface->point(frame, at[1], at[2]).point;
    const double value = surface->eval(point, cache).value;
    if (std::abs(value) > 1e-9 * amplitude) {
      RC_LOG() << "base " << kind << ", rho " << rho << ", amplitude " << high << ", face " << face << " at "
               << at.transpose() << ": " << value << " m\n";
    }
    RC_ASSERT(std::abs(value) <= 1e-9 * amplitude);
  }
}

}  // namespace
}  // namespace asperity::round_folds_test
