#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace asperity {

/// One-sided power spectral density of an evenly sampled signal. Its integral over frequency is the signal's variance.
struct Spectrum {
  std::vector<double> frequency;  ///< of the bins, ascending from the first above 0 (1/x, x the unit of `spacing`)
  std::vector<double> density;    ///< squared unit of the signal per unit of frequency
  double peak_frequency = 0.0;  ///< of the largest bin, refined by a parabola through the logarithms around it; 0: none
  double peak_density = 0.0;    ///< of the largest bin
  std::size_t segments = 0;     ///< averaged
  [[nodiscard]] bool empty() const noexcept { return frequency.empty(); }
};

/// Welch's estimate: segments of a power of two (the largest that fits a quarter of the signal, 64 to 8192, or the
/// whole of a shorter signal), half overlapping, mean removed, Hann window. Empty for fewer than 16 samples or a
/// spacing that is not above 0. [main]
Spectrum power_spectrum(std::span<const double> signal, double spacing);

/// Values at evenly spaced abscissae, by linear interpolation between samples in ascending order of `x`; samples that
/// do not advance, or are not finite, are left out. As many as fit at the given spacing. [main]
std::vector<double> resample(std::span<const double> x, std::span<const double> y, double spacing);

}  // namespace asperity
