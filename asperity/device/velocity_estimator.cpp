#include "asperity/device/velocity_estimator.h"

#include <algorithm>
#include <cmath>

namespace asperity {

VelocityEstimator::VelocityEstimator(double resolution, std::size_t max_window) noexcept
    : resolution_(std::max(0.0, resolution)), max_window_(std::clamp<std::size_t>(max_window, 1, capacity - 1)) {}

void VelocityEstimator::reset() noexcept {
  *this = VelocityEstimator(resolution_, max_window_);
}

Vec3 VelocityEstimator::update(const Vec3& position, Seconds time) noexcept {
  const bool usable = position.allFinite() && std::isfinite(time.count());
  if (!usable || (count_ > 0 && time.count() <= times_[newest_])) return velocity_;
  newest_ = count_ == 0 ? 0 : (newest_ + 1) % capacity;
  times_[newest_] = time.count();
  positions_[newest_] = position;
  count_ = std::min(count_ + 1, capacity);
  if (count_ > 1) {
    for (int axis = 0; axis < 3; ++axis) fit_axis(axis);
  }
  return velocity_;
}

// A window of n periods is accepted when every sample inside it allows its chord's slope: sample i allows the slopes
// that pass within one step of it. Keeping the intersection of these intervals makes the whole search O(n) instead of
// O(n^2).
void VelocityEstimator::fit_axis(int axis) noexcept {
  // Two roundings of half a step each; the slack keeps constant speed from failing by a rounding of the arithmetic.
  const double tolerance = resolution_ * (1.0 + 1e-6);
  const double y0 = positions_[newest_][axis];
  const double t0 = times_[newest_];
  double lowest = -infinity;
  double highest = infinity;
  const std::size_t longest = std::min(max_window_, count_ - 1);
  for (std::size_t n = 1; n <= longest; ++n) {
    const std::size_t k = slot(n);
    const double span = t0 - times_[k];
    const double change = y0 - positions_[k][axis];
    const double slope = change / span;
    if (slope < lowest || slope > highest) break;
    velocity_[axis] = slope;
    error_bound_[axis] = resolution_ / span;
    window_[static_cast<std::size_t>(axis)] = n;
    lowest = std::max(lowest, (change - tolerance) / span);
    highest = std::min(highest, (change + tolerance) / span);
  }
}

}  // namespace asperity
