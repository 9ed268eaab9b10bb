// Gradient noise of the position, as a height.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "asperity/core/rng.h"
#include "asperity/surface/implicit/texture.h"

namespace asperity::gradient_noise_test {
namespace {

TEST(GradientNoise, StaysWithinItsAmplitudeAndComesNear) {
  const PointHeight noise = gradient_noise(1e-3, 0.01, 5);
  Rng rng(1);
  double sum = 0.0;
  double largest = 0.0;
  constexpr int count = 200000;
  for (int i = 0; i < count; ++i) {
    const Vec3 p(rng.uniform(-2.0, 2.0), rng.uniform(-2.0, 2.0), rng.uniform(-2.0, 2.0));
    const double h = noise(p, no_index, 0);
    sum += h;
    largest = std::max(largest, std::abs(h));
  }
  EXPECT_LE(largest, 1e-3);
  EXPECT_GT(largest, 0.7e-3);
  EXPECT_NEAR(sum / count, 0.0, 0.01e-3);
}

TEST(GradientNoise, IsZeroOnItsLatticeAndSmoothBetween) {
  const double wavelength = 0.01;
  const PointHeight noise = gradient_noise(1e-3, wavelength, 5);
  for (int i = -5; i < 5; ++i) EXPECT_NEAR(noise(Vec3(i * wavelength, 0.02, -0.03), no_index, 0), 0.0, 1e-12);
  // No step, nor a step of slope, anywhere: also across lattice planes.
  const double d = 1e-6 * wavelength;
  Rng rng(2);
  for (int i = 0; i < 2000; ++i) {
    Vec3 p(rng.uniform(-0.05, 0.05), rng.uniform(-0.05, 0.05), rng.uniform(-0.05, 0.05));
    if (i % 2 == 0) p.x() = std::round(p.x() / wavelength) * wavelength;
    const double low = noise(p - d * Vec3::UnitX(), no_index, 0);
    const double here = noise(p, no_index, 0);
    const double high = noise(p + d * Vec3::UnitX(), no_index, 0);
    EXPECT_LT(std::abs(high - here), 4e-3 * 1e-6);
    EXPECT_NEAR(high - here, here - low, 1e-3 * 1e-10);
  }
}

/// Improved noise as its paper prints it (Perlin 2002), over this permutation.
double printed_noise(const std::vector<int>& order, double x, double y, double z) {
  const auto hash = [&](int i) { return order[static_cast<std::size_t>(i & 255)]; };
  const auto fade = [](double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); };
  // The twelve directions and the four that fill up to sixteen, one by one.
  static constexpr int directions[16][3] = {{1, 1, 0},  {-1, 1, 0},  {1, -1, 0}, {-1, -1, 0}, {1, 0, 1},  {-1, 0, 1},
                                            {1, 0, -1}, {-1, 0, -1}, {0, 1, 1},  {0, -1, 1},  {0, 1, -1}, {0, -1, -1},
                                            {1, 1, 0},  {0, -1, 1},  {-1, 1, 0}, {0, -1, -1}};
  const int cell[3] = {static_cast<int>(std::floor(x)), static_cast<int>(std::floor(y)),
                       static_cast<int>(std::floor(z))};
  const auto corner = [&](int i, int j, int k) {
    const int* d = directions[hash(hash(hash(cell[0] + i) + cell[1] + j) + cell[2] + k) & 15];
    return d[0] * (x - cell[0] - i) + d[1] * (y - cell[1] - j) + d[2] * (z - cell[2] - k);
  };
  const auto between = [](double t, double a, double b) { return a + t * (b - a); };
  const double u = fade(x - cell[0]);
  const double v = fade(y - cell[1]);
  const auto layer = [&](int k) {
    return between(v, between(u, corner(0, 0, k), corner(1, 0, k)), between(u, corner(0, 1, k), corner(1, 1, k)));
  };
  return between(fade(z - cell[2]), layer(0), layer(1));
}

TEST(GradientNoise, IsThePapersOverAPermutationThatIsTheSeedsInEveryVersion) {
  // From the last place to the second, each takes what one of the places up to its own had (Durstenfeld 1964).
  for (const std::uint64_t seed : {1U, 5U, 1000U}) {
    std::vector<int> order;
    for (int i = 0; i < 256; ++i) order.push_back(i);
    Rng rng(seed);
    for (std::uint32_t places = 256; places >= 2; --places) std::swap(order[places - 1], order[rng.below(places)]);
    const double wavelength = 0.01;
    const PointHeight noise = gradient_noise(1e-3, wavelength, seed);
    Rng places(7);
    // Scaled by its largest value, which is 1.0364.
    for (int i = 0; i < 1000; ++i) {
      const Vec3 p(places.uniform(-1.0, 1.0), places.uniform(-1.0, 1.0), places.uniform(-1.0, 1.0));
      const Vec3 at = p / wavelength;
      ASSERT_NEAR(noise(p, no_index, 0), 1e-3 / 1.0364 * printed_noise(order, at.x(), at.y(), at.z()), 1e-12) << i;
    }
  }
}

TEST(GradientNoise, SeedsGiveOtherNoise) {
  const PointHeight one = gradient_noise(1.0, 0.01, 1);
  const PointHeight same = gradient_noise(1.0, 0.01, 1);
  const PointHeight other = gradient_noise(1.0, 0.01, 2);
  Rng rng(3);
  double product = 0.0;
  double squares = 0.0;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 p(rng.uniform(0.0, 1.0), rng.uniform(0.0, 1.0), rng.uniform(0.0, 1.0));
    EXPECT_EQ(one(p, 0, 0), same(p, 1, 2));
    product += one(p, 0, 0) * other(p, 0, 0);
    squares += one(p, 0, 0) * one(p, 0, 0);
  }
  EXPECT_LT(std::abs(product), 0.1 * squares);
}

}  // namespace
}  // namespace asperity::gradient_noise_test
