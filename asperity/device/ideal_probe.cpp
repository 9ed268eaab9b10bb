#include "asperity/device/ideal_probe.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "asperity/device/detail/checks.h"

namespace asperity {
Result<IdealProbe> IdealProbe::build(StrokePath path, const IdealProbeSettings& settings) {
  ASPERITY_CHECK(require(settings.stiffness_estimate > 0.0, "stiffness_estimate", settings.stiffness_estimate,
                         "a stiffness above 0 (N/m)"));
  ASPERITY_CHECK(require(settings.bandwidth > 0.0, "bandwidth", settings.bandwidth, "a frequency above 0 (Hz)"));
  ASPERITY_CHECK(require(settings.max_depth > 0.0, "max_depth", settings.max_depth, "a length above 0 (m)"));
  return IdealProbe(std::move(path), settings);
}

IdealProbe::IdealProbe(StrokePath path, const IdealProbeSettings& settings)
    : path_(std::move(path)), settings_(settings) {
  place();
}

void IdealProbe::place() noexcept {
  pose_ = path_.pose(Seconds(time_));
  position_ = pose_.target - depth_ * pose_.normal;
  velocity_ = pose_.velocity - depth_rate_ * pose_.normal - depth_ * pose_.normal_rate;
}

ProbeSample IdealProbe::read() noexcept {
  ProbeSample sample;
  sample.pose.position = position_;
  sample.twist.linear = velocity_;
  sample.time = Seconds(time_);
  return sample;
}

void IdealProbe::apply(const Vec3& force, Seconds dt) noexcept {
  const double step = dt.count();
  if (!(step > 0.0) || !std::isfinite(step)) return;
  double depth = depth_;
  if (path_.press() == PressMode::force && pose_.phase == StrokePhase::contact && force.allFinite()) {
    const double gain = 1.0 - std::exp(-2.0 * std::numbers::pi * settings_.bandwidth * step);
    const double missing = path_.normal_force() - force.dot(pose_.normal);
    depth =
        std::clamp(depth + gain * missing / settings_.stiffness_estimate, -settings_.max_depth, settings_.max_depth);
  } else if (pose_.phase != StrokePhase::contact) {
    // Leaving the surface, the regulated depth goes back to zero as fast as the stroke itself lifts.
    const double back = path_.approach_speed() * step;
    depth = depth > 0.0 ? std::max(0.0, depth - back) : std::min(0.0, depth + back);
  }
  depth_rate_ = (depth - depth_) / step;
  depth_ = depth;
  time_ += step;
  place();
}

}  // namespace asperity
