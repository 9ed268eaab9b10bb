#include "asperity/study/spectrum.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <numbers>

namespace asperity::spectrum_test {
namespace {

std::vector<double> sine(double frequency, double amplitude, double spacing, std::size_t count) {
  std::vector<double> signal(count);
  for (std::size_t i = 0; i < count; ++i) {
    signal[i] = 3.0 + amplitude * std::sin(2.0 * std::numbers::pi * frequency * spacing * static_cast<double>(i));
  }
  return signal;
}

double variance_of(const Spectrum& spectrum) {
  double sum = 0.0;
  for (const double density : spectrum.density) sum += density * spectrum.frequency[0];
  return sum;
}

TEST(PowerSpectrum, PeakOfASineIsItsFrequency) {
  const Spectrum spectrum = power_spectrum(sine(87.3, 0.4, 1e-3, 8000), 1e-3);
  // Half a bin would be 0.24 Hz; the parabola through the logarithms of a Hann peak is better than a tenth of a bin.
  EXPECT_NEAR(spectrum.peak_frequency, 87.3, 0.05);
  EXPECT_GE(spectrum.segments, 6u);
}

TEST(PowerSpectrum, IntegralIsTheVarianceOfTheSignal) {
  EXPECT_NEAR(variance_of(power_spectrum(sine(125.0, 0.4, 1e-3, 8192), 1e-3)), 0.5 * 0.4 * 0.4, 1e-5);
}

TEST(PowerSpectrum, SpacingIsTheUnitOfFrequency) {
  // Ridges 4 mm apart, sampled each 0.1 mm: 250 ridges a metre.
  EXPECT_NEAR(power_spectrum(sine(250.0, 1.0, 1e-4, 4000), 1e-4).peak_frequency, 250.0, 1.0);
}

TEST(PowerSpectrum, ConstantHasNoPower) {
  const Spectrum spectrum = power_spectrum(std::vector<double>(1000, 2.5), 1e-3);
  EXPECT_LT(variance_of(spectrum), 1e-12);
}

TEST(PowerSpectrum, NothingForTooFewSamplesOrABadSpacing) {
  EXPECT_TRUE(power_spectrum(std::vector<double>(15, 1.0), 1e-3).empty());
  EXPECT_TRUE(power_spectrum(std::vector<double>(100, 1.0), 0.0).empty());
  EXPECT_TRUE(power_spectrum(std::vector<double>(100, 1.0), -1.0).empty());
  EXPECT_FALSE(power_spectrum(std::vector<double>(16, 1.0), 1e-3).empty());
}

RC_GTEST_PROP(PowerSpectrum, PowerScalesWithTheSquareOfTheAmplitude, ()) {
  const double factor = *rc::gen::inRange(1, 50) * 0.1;
  const double frequency = 20.0 + *rc::gen::inRange(0, 400);
  const double one = variance_of(power_spectrum(sine(frequency, 0.1, 1e-3, 2048), 1e-3));
  const double scaled = variance_of(power_spectrum(sine(frequency, 0.1 * factor, 1e-3, 2048), 1e-3));
  RC_ASSERT(std::abs(scaled / one - factor * factor) < 1e-3 * factor * factor);
}

TEST(Resample, StraightLinesStayStraight) {
  const std::vector<double> x{0.0, 0.3, 0.35, 1.1, 2.0};
  std::vector<double> y;
  for (const double value : x) y.push_back(2.0 * value - 1.0);
  const std::vector<double> out = resample(x, y, 0.1);
  ASSERT_EQ(out.size(), 21u);
  for (std::size_t i = 0; i < out.size(); ++i) EXPECT_NEAR(out[i], 0.2 * static_cast<double>(i) - 1.0, 1e-12);
}

TEST(Resample, SamplesThatStandStillOrAreNoNumberAreLeftOut) {
  const double none = std::nan("");
  const std::vector<double> x{0.0, 1.0, 1.0, 0.5, none, 2.0};
  const std::vector<double> y{0.0, 1.0, 9.0, 9.0, 9.0, 2.0};
  EXPECT_EQ(resample(x, y, 1.0), (std::vector<double>{0.0, 1.0, 2.0}));
}

}  // namespace
}  // namespace asperity::spectrum_test
