#include "asperity/core/principal_axes.h"

#include <gtest/gtest.h>

#include "asperity/core/rng.h"

namespace asperity {
namespace {

TEST(PrincipalAxes, AMatrixIsWhatItScalesByAlongThem) {
  Rng rng(4);
  for (int i = 0; i < 2000; ++i) {
    Mat3 any;
    for (int k = 0; k < 9; ++k) any(k / 3, k % 3) = rng.uniform(-1.0, 1.0);
    const double size = std::pow(10.0, rng.uniform(-6.0, 6.0));
    Mat3 symmetric = size * (any + any.transpose());
    // Some that are flat, and some that scale by one number.
    if (i % 4 == 0) symmetric = size * any.col(0) * any.col(0).transpose();
    if (i % 50 == 0) symmetric = size * Mat3::Identity();
    const PrincipalAxes principal = principal_axes(symmetric);
    const double largest = symmetric.cwiseAbs().maxCoeff();
    ASSERT_LT((principal.scaling_by(principal.values) - symmetric).cwiseAbs().maxCoeff(), 1e-7 * largest) << i;
    ASSERT_LT((principal.axes.transpose() * principal.axes - Mat3::Identity()).cwiseAbs().maxCoeff(), 1e-7) << i;
    ASSERT_LE(principal.values.x(), principal.values.y());
    ASSERT_LE(principal.values.y(), principal.values.z());
  }
}

}  // namespace
}  // namespace asperity
