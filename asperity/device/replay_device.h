#pragma once

#include <cstddef>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/core/samples.h"

namespace asperity {

/// A device that gives recorded samples back, one a tick, whatever force it is sent. [servo]
class ReplayDevice {
 public:
  /// Samples are given back bit for bit, NaN included: a replay has to meet what the recording met.
  /// Errors: bad_value when there is no sample. [build]
  static Result<ReplayDevice> build(std::vector<ProbeSample> samples);

  [[nodiscard]] ProbeSample read() noexcept {
    return samples_[index_ < samples_.size() ? index_ : samples_.size() - 1];
  }
  void apply(const Vec3&, Seconds) noexcept {
    if (index_ < samples_.size()) ++index_;
  }
  [[nodiscard]] Vec3 aim() const noexcept {
    return samples_[index_ < samples_.size() ? index_ : samples_.size() - 1].pose.position;
  }
  [[nodiscard]] bool finished() const noexcept { return index_ >= samples_.size(); }
  [[nodiscard]] std::size_t size() const noexcept { return samples_.size(); }

 private:
  explicit ReplayDevice(std::vector<ProbeSample> samples) : samples_(std::move(samples)) {}
  std::vector<ProbeSample> samples_;
  std::size_t index_ = 0;
};

}  // namespace asperity
