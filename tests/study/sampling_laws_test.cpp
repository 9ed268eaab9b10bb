// Row H-III': what sampling leaves of a saw-tooth. With p texels a ridge, read bilinearly, its peak-to-peak height is
// (p - 1) / p of the formula's and its asymmetry (p - 2) / p: the share of a ridge that falls less the share that
// rises.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "asperity/field/mesostructure/generators.h"

namespace asperity::sampling_laws_test {
namespace {

/// What a probe that follows the map along s finds. Exact for a bilinear map: it is straight between texel centres.
struct Followed {
  double peak_to_peak = 0.0;  ///< over the amplitude
  double asymmetry = 0.0;     ///< (falling - rising) / (falling + rising), in lengths
  int ridges = 0;
};

Followed follow(const HeightMap& map, double amplitude, double t) {
  std::vector<double> heights;
  // Between the centres too: half a texel is where a reconstruction of another kind would show.
  const int samples = 2 * map.width();
  for (int i = 0; i < samples; ++i) heights.push_back(map.height_at({(i + 1) / static_cast<double>(samples), t}));
  Followed found;
  const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
  found.peak_to_peak = (*high - *low) / amplitude;
  int rising = 0;
  int falling = 0;
  bool rose = false;
  const double noise = 1e-9 * amplitude;
  for (int i = 0; i < samples; ++i) {
    const double change = heights[static_cast<std::size_t>((i + 1) % samples)] - heights[static_cast<std::size_t>(i)];
    rising += change > noise ? 1 : 0;
    falling += change < -noise ? 1 : 0;
    if (change > noise && !rose) ++found.ridges;
    rose = change > noise;
  }
  // The first ridge begins where the last one ends.
  found.asymmetry = static_cast<double>(falling - rising) / (falling + rising);
  return found;
}

Followed follow_serrated(int size, int count, double amplitude = 1e-3) {
  MesostructureSpec spec;
  spec.kind = MesostructureKind::serrated;
  spec.size = size;
  spec.count = count;
  spec.amplitude = amplitude;
  const auto map = generate_height_map(spec, Wrap::repeat, Reconstruction::bilinear);
  EXPECT_TRUE(map.ok());
  return follow(*map, amplitude, 0.37);
}

// Heights are stored as floats, so that peak-to-peak is exact to a millionth; shares are counts, and exact.
constexpr double rounding = 1e-6;

TEST(SamplingLaws, H_III_PeakToPeakAndAsymmetryOfEveryRidgeWidth) {
  for (int p = 2; p <= 64; p *= 2) {
    const Followed found = follow_serrated(256, 256 / p);
    EXPECT_NEAR(found.peak_to_peak, (p - 1.0) / p, rounding) << p;
    EXPECT_EQ(found.asymmetry, (p - 2.0) / p) << p;
    EXPECT_EQ(found.ridges, 256 / p) << p;
  }
}

TEST(SamplingLaws, H_III_RidgesThatAreNoPowersOfTwo) {
  for (const int p : {3, 5, 6, 7, 10}) {
    const Followed found = follow_serrated(12 * p, 12);
    EXPECT_NEAR(found.peak_to_peak, (p - 1.0) / p, rounding) << p;
    EXPECT_NEAR(found.asymmetry, (p - 2.0) / p, 1e-15) << p;
  }
}

TEST(SamplingLaws, H_III_PapersMap1024) {
  // 256 ridges have 4 texels each: half of the direction's sense is left; 512 have 2 and none.
  const Followed k256 = follow_serrated(1024, 256);
  EXPECT_NEAR(k256.peak_to_peak, 3.0 / 4.0, rounding);
  EXPECT_EQ(k256.asymmetry, 0.5);
  EXPECT_EQ(k256.ridges, 256);
  const Followed k512 = follow_serrated(1024, 512);
  EXPECT_NEAR(k512.peak_to_peak, 1.0 / 2.0, rounding);
  EXPECT_EQ(k512.asymmetry, 0.0);
  EXPECT_EQ(k512.ridges, 512);
}

TEST(SamplingLaws, H_III_AsymmetryChangesSignWithTheDirection) {
  MesostructureSpec spec;
  spec.kind = MesostructureKind::serrated;
  spec.size = 128;
  spec.count = 8;
  const auto heights = generate_heights(spec);
  ASSERT_TRUE(heights.ok());
  std::vector<float> mirrored = *heights;
  for (auto row = mirrored.begin(); row != mirrored.end(); row += 128) std::reverse(row, row + 128);
  const auto there = HeightMap::build(*heights, 128, 128, Wrap::repeat, Reconstruction::bilinear);
  const auto back = HeightMap::build(mirrored, 128, 128, Wrap::repeat, Reconstruction::bilinear);
  EXPECT_EQ(follow(*there, spec.amplitude, 0.5).asymmetry, 14.0 / 16.0);
  EXPECT_EQ(follow(*back, spec.amplitude, 0.5).asymmetry, -14.0 / 16.0);
}

}  // namespace
}  // namespace asperity::sampling_laws_test
