#include "asperity/field/height/detail/spline_prefilter.h"

#include <utility>

namespace asperity {

SplinePrefilter::SplinePrefilter(int count, Wrap wrap, Reconstruction reconstruction)
    : count_(static_cast<std::size_t>(count)),
      off_diagonal_(reconstruction == Reconstruction::bicubic ? 1.0 / 6.0 : 0.125) {
  const double middle = reconstruction == Reconstruction::bicubic ? 2.0 / 3.0 : 0.75;
  std::vector<double> diagonal(count_, middle);
  if (count_ == 1) {
    diagonal[0] = 1.0;
    eliminate(std::move(diagonal));
  } else if (wrap == Wrap::clamp) {
    diagonal.front() = diagonal.back() = middle + off_diagonal_;
    eliminate(std::move(diagonal));
  } else if (count_ == 2) {
    // Each texel is the other's neighbour on both sides.
    off_diagonal_ *= 2.0;
    eliminate(std::move(diagonal));
  } else {
    const double gamma = -middle;
    diagonal.front() -= gamma;
    diagonal.back() -= off_diagonal_ * off_diagonal_ / gamma;
    eliminate(std::move(diagonal));
    close_ring(gamma);
  }
}

void SplinePrefilter::eliminate(std::vector<double> diagonal) {
  upper_.assign(count_, 0.0);
  inverse_pivot_.assign(count_, 0.0);
  for (std::size_t i = 0; i < count_; ++i) {
    const double above = i > 0 ? upper_[i - 1] : 0.0;
    inverse_pivot_[i] = 1.0 / (diagonal[i] - off_diagonal_ * above);
    upper_[i] = off_diagonal_ * inverse_pivot_[i];
  }
}

void SplinePrefilter::close_ring(double gamma) {
  std::vector<double> correction(count_, 0.0);
  correction.front() = gamma;
  correction.back() = off_diagonal_;
  solve_open(correction.data(), 1, 1);
  ring_corner_ = off_diagonal_ / gamma;
  ring_scale_ = 1.0 / (1.0 + correction.front() + ring_corner_ * correction.back());
  ring_correction_ = std::move(correction);
}

void SplinePrefilter::solve_open(double* values, std::size_t stride, std::size_t lanes) const {
  for (std::size_t i = 0; i < count_; ++i) {
    double* line = values + i * stride;
    const double* previous = i > 0 ? line - stride : line;
    const double from_previous = i > 0 ? off_diagonal_ : 0.0;
    for (std::size_t l = 0; l < lanes; ++l) line[l] = (line[l] - from_previous * previous[l]) * inverse_pivot_[i];
  }
  for (std::size_t i = count_ - 1; i-- > 0;) {
    double* line = values + i * stride;
    for (std::size_t l = 0; l < lanes; ++l) line[l] -= upper_[i] * line[stride + l];
  }
}

void SplinePrefilter::solve(double* values, std::size_t stride, std::size_t lanes) const {
  solve_open(values, stride, lanes);
  if (ring_correction_.empty()) return;
  const double* last = values + (count_ - 1) * stride;
  std::vector<double> factors(lanes);
  for (std::size_t l = 0; l < lanes; ++l) factors[l] = (values[l] + ring_corner_ * last[l]) * ring_scale_;
  for (std::size_t i = 0; i < count_; ++i) {
    double* line = values + i * stride;
    for (std::size_t l = 0; l < lanes; ++l) line[l] -= ring_correction_[i] * factors[l];
  }
}

}  // namespace asperity
