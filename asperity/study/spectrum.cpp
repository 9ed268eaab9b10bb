#include "asperity/study/spectrum.h"

#include <kissfft/kiss_fftr.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

namespace asperity {
namespace {

constexpr std::size_t fewest_for_a_spectrum = 16;
constexpr std::size_t shortest_segment = 64;
constexpr std::size_t longest_segment = 8192;

std::size_t power_of_two_within(std::size_t count) {
  std::size_t power = 1;
  while (power * 2 <= count) power *= 2;
  return power;
}

std::size_t segment_length(std::size_t samples) {
  const std::size_t whole = power_of_two_within(samples);
  return std::min(whole, std::clamp(power_of_two_within(samples / 4), shortest_segment, longest_segment));
}

std::vector<double> hann_window(std::size_t length) {
  std::vector<double> window(length);
  for (std::size_t i = 0; i < length; ++i) {
    window[i] = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(length));
  }
  return window;
}

/// Adds |X|^2 of one windowed segment to `power`, bin by bin.
void add_segment(std::span<const double> segment, std::span<const double> window, kiss_fftr_cfg plan,
                 std::vector<double>& power) {
  double mean = 0.0;
  for (const double value : segment) mean += value;
  mean /= static_cast<double>(segment.size());
  std::vector<kiss_fft_scalar> input(segment.size());
  std::vector<kiss_fft_cpx> output(segment.size() / 2 + 1);
  for (std::size_t i = 0; i < segment.size(); ++i)
    input[i] = static_cast<kiss_fft_scalar>((segment[i] - mean) * window[i]);
  kiss_fftr(plan, input.data(), output.data());
  for (std::size_t k = 0; k < output.size(); ++k) {
    const double re = static_cast<double>(output[k].r);
    const double im = static_cast<double>(output[k].i);
    power[k] += re * re + im * im;
  }
}

void find_peak(Spectrum& spectrum) {
  const auto& d = spectrum.density;
  const auto top = std::max_element(d.begin(), d.end());
  if (top == d.end() || *top <= 0.0) return;
  const auto i = static_cast<std::size_t>(top - d.begin());
  spectrum.peak_density = *top;
  spectrum.peak_frequency = spectrum.frequency[i];
  if (i == 0 || i + 1 == d.size() || d[i - 1] <= 0.0 || d[i + 1] <= 0.0) return;
  const double left = std::log(d[i - 1]);
  const double right = std::log(d[i + 1]);
  const double bend = left - 2.0 * std::log(d[i]) + right;
  if (bend < 0.0)
    spectrum.peak_frequency += 0.5 * (left - right) / bend * (spectrum.frequency[1] - spectrum.frequency[0]);
}

}  // namespace

Spectrum power_spectrum(std::span<const double> signal, double spacing) {
  Spectrum spectrum;
  if (signal.size() < fewest_for_a_spectrum || !(spacing > 0.0) || !std::isfinite(spacing)) return spectrum;
  const std::size_t length = segment_length(signal.size());
  const std::unique_ptr<kiss_fftr_state, void (*)(void*)> plan(
      kiss_fftr_alloc(static_cast<int>(length), 0, nullptr, nullptr), [](void* memory) { kiss_fftr_free(memory); });
  if (!plan) return spectrum;
  const std::vector<double> window = hann_window(length);
  std::vector<double> power(length / 2 + 1, 0.0);
  for (std::size_t at = 0; at + length <= signal.size(); at += length / 2, ++spectrum.segments) {
    add_segment(signal.subspan(at, length), window, plan.get(), power);
  }
  double window_power = 0.0;
  for (const double w : window) window_power += w * w;
  const double scale = spacing / (window_power * static_cast<double>(spectrum.segments));
  for (std::size_t k = 1; k < power.size(); ++k) {
    const bool nyquist = k + 1 == power.size();
    spectrum.frequency.push_back(static_cast<double>(k) / (static_cast<double>(length) * spacing));
    spectrum.density.push_back((nyquist ? 1.0 : 2.0) * scale * power[k]);
  }
  find_peak(spectrum);
  return spectrum;
}

std::vector<double> resample(std::span<const double> x, std::span<const double> y, double spacing) {
  std::vector<double> out;
  if (!(spacing > 0.0)) return out;
  double x0 = 0.0;
  double y0 = 0.0;
  double begin = 0.0;
  bool started = false;
  for (std::size_t i = 0; i < std::min(x.size(), y.size()); ++i) {
    if (!std::isfinite(x[i]) || !std::isfinite(y[i]) || (started && x[i] <= x0)) continue;
    if (!started) begin = x[i];
    if (!started) out.push_back(y[i]);
    while (started) {
      const double next = begin + spacing * static_cast<double>(out.size());
      if (next > x[i]) break;
      out.push_back(y0 + (y[i] - y0) * (next - x0) / (x[i] - x0));
    }
    started = true;
    x0 = x[i];
    y0 = y[i];
  }
  return out;
}

}  // namespace asperity
