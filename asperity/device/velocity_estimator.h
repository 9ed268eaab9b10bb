#pragma once

#include <array>
#include <cstddef>

#include "asperity/core/math.h"
#include "asperity/core/units.h"

namespace asperity {

/// Velocity from quantised positions by first-order adaptive windowing, end-fit (Janabi-Sharifi, Hayward & Chen 2000).
///
/// Per axis, the estimate is the slope of the chord over the longest window, up to `capacity` samples, whose samples
/// all lie within one encoder step of that chord: a long window at constant speed, a short one when the motion changes.
/// Positions rounded to steps of `resolution` D have an error of at most D/2 each, so that, with W the window's
/// duration:
///   constant speed:         |estimate - speed| <= D / W               (raw differencing: D / T)
///   acceleration up to A:   |estimate - speed| <= D / W + A W / 2     and the window keeps W <= 4 sqrt(D / A) + T
/// `error_bound()` gives D / W. With D = 0 the window is one period unless the samples are exactly collinear.
/// Fixed storage; update costs at most `capacity` steps an axis. [servo]
class VelocityEstimator {
 public:
  static constexpr std::size_t capacity = 128;

  /// `resolution` (m): the encoder's step, 0 or more. `max_window`: longest window, in periods, clamped to 1 ...
  /// capacity - 1.
  explicit VelocityEstimator(double resolution = 0.0, std::size_t max_window = capacity - 1) noexcept;

  /// Takes the position (m) read at `time` and returns the velocity (m/s). A time that does not increase, or a position
  /// that is not finite, is left out and the last estimate returned. The first sample gives zero. [servo]
  Vec3 update(const Vec3& position, Seconds time) noexcept;

  [[nodiscard]] const Vec3& velocity() const noexcept { return velocity_; }
  /// Largest error that quantisation can cause at constant velocity (m/s), per axis; infinite before the second sample.
  [[nodiscard]] const Vec3& error_bound() const noexcept { return error_bound_; }
  /// Window in periods, per axis; 0 before the second sample.
  [[nodiscard]] const std::array<std::size_t, 3>& window() const noexcept { return window_; }
  void reset() noexcept;

 private:
  void fit_axis(int axis) noexcept;
  [[nodiscard]] std::size_t slot(std::size_t age) const noexcept { return (newest_ + capacity - age) % capacity; }

  double resolution_;
  std::size_t max_window_;
  std::array<double, capacity> times_{};
  std::array<Vec3, capacity> positions_{};
  std::size_t newest_ = 0;
  std::size_t count_ = 0;
  Vec3 velocity_ = Vec3::Zero();
  Vec3 error_bound_ = Vec3::Constant(infinity);
  std::array<std::size_t, 3> window_{};
};

}  // namespace asperity
