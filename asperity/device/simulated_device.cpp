#include "asperity/device/simulated_device.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "asperity/core/rng.h"
#include "asperity/device/detail/checks.h"

namespace asperity {
namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;
constexpr double tremor_low = 8.0;    // Hz, physiological tremor of the hand
constexpr double tremor_high = 12.0;  // Hz

Vec3 shortened(const Vec3& v, double limit) noexcept {
  const double norm = v.norm();
  return norm > limit ? Vec3(v * (limit / norm)) : v;
}

}  // namespace

Result<SimulatedDevice> SimulatedDevice::build(StrokePath path, const DeviceProfile& profile, const HandImpedance& hand,
                                               const SimulatedDeviceSettings& settings) {
  if (auto status = validate_profile(profile); !status) return std::move(status).error().at("device");
  if (auto status = validate_hand(hand); !status) return std::move(status).error().at("hand");
  const SimulatedDeviceSettings& s = settings;
  ASPERITY_CHECK(require(s.force_bandwidth > 0.0, "force_bandwidth", s.force_bandwidth, "a frequency above 0 (Hz)"));
  ASPERITY_CHECK(require(s.reach > 0.0, "reach", s.reach, "a length above 0 (m)"));
  ASPERITY_CHECK(require(s.tremor >= 0.0, "tremor", s.tremor, "a length of 0 or more (m)"));
  ASPERITY_CHECK(require(s.max_substep >= 1e-7, "max_substep", s.max_substep, "a time of 100 ns or more (s)"));
  return SimulatedDevice(std::move(path), profile, hand, settings);
}

SimulatedDevice::SimulatedDevice(StrokePath path, const DeviceProfile& profile, const HandImpedance& hand,
                                 const SimulatedDeviceSettings& settings)
    : path_(std::move(path)),
      profile_(profile),
      hand_(hand),
      settings_(settings),
      estimator_(profile.position_resolution) {
  Rng rng(settings.seed);
  for (TremorTone& tone : tones_) {
    tone.frequency = rng.uniform(tremor_low, tremor_high);
    for (int axis = 0; axis < 3; ++axis) tone.phase[axis] = rng.uniform(0.0, two_pi);
  }
  position_ = path_.pose(Seconds(0.0)).target + tremor_offset(0.0);
  aim_ = position_;
}

// Four equal tones of random phase: RMS = amplitude * sqrt(4 / 2).
Vec3 SimulatedDevice::tremor_offset(double time) const noexcept {
  if (settings_.tremor == 0.0) return Vec3::Zero();
  Vec3 sum = Vec3::Zero();
  for (const TremorTone& tone : tones_) {
    for (int axis = 0; axis < 3; ++axis) sum[axis] += std::sin(two_pi * tone.frequency * time + tone.phase[axis]);
  }
  return sum * (settings_.tremor / std::sqrt(2.0));
}

Vec3 SimulatedDevice::quantised(const Vec3& position) const noexcept {
  const double step = profile_.position_resolution;
  if (step == 0.0) return position;
  return step * (position / step).array().round().matrix();
}

Vec3 SimulatedDevice::velocity_error_bound() const noexcept {
  return profile_.admittance ? Vec3(Vec3::Zero()) : estimator_.error_bound();
}

ProbeSample SimulatedDevice::read() noexcept {
  ProbeSample sample;
  sample.pose.position = quantised(position_);
  sample.time = Seconds(time_);
  const Vec3 estimate = estimator_.update(sample.pose.position, sample.time);
  sample.twist.linear = profile_.admittance ? velocity_ : estimate;
  return sample;
}

void SimulatedDevice::apply(const Vec3& force, Seconds dt) noexcept {
  const double duration = dt.count();
  if (!(duration > 0.0) || !std::isfinite(duration)) return;
  const Vec3 held = force.allFinite() ? shortened(force, profile_.max_force) : Vec3(Vec3::Zero());
  const double pieces = std::max(1.0, std::ceil(duration / settings_.max_substep * (1.0 - 1e-9)));
  const double h = duration / pieces;
  const double begin = time_;
  for (double k = 1.0; k <= pieces; k += 1.0) {
    time_ = begin + k * h;
    substep(held, h);
  }
}

/// Where the stroke is now; on the way back it is as when time runs backwards.
StrokePose SimulatedDevice::pose() const noexcept {
  const double duration = path_.duration().count();
  if (!settings_.back_and_forth || !(duration > 0.0)) return path_.pose(Seconds(time_));
  const double within = std::fmod(time_, 2.0 * duration);
  if (within <= duration) return path_.pose(Seconds(within));
  StrokePose pose = path_.pose(Seconds(2.0 * duration - within));
  pose.tangent = -pose.tangent;
  pose.velocity = -pose.velocity;
  pose.normal_rate = -pose.normal_rate;
  if (pose.phase == StrokePhase::approach) {
    pose.phase = StrokePhase::lift;
  } else if (pose.phase != StrokePhase::contact) {
    pose.phase = StrokePhase::approach;
  }
  return pose;
}

void SimulatedDevice::update_normal_mode(const StrokePose& pose, double h) noexcept {
  const bool pressing = path_.press() == PressMode::force && pose.phase == StrokePhase::contact;
  const double wanted = pressing ? path_.normal_force() : 0.0;
  push_ += (1.0 - std::exp(-two_pi * settings_.force_bandwidth * h)) * (wanted - push_);
  const bool leaving =
      path_.press() == PressMode::force && (pose.phase == StrokePhase::lift || pose.phase == StrokePhase::done);
  if (leaving && !lifting_) lift_offset_ = std::min(0.0, (position_ - pose.point).dot(pose.normal));
  lifting_ = leaving;
}

SimulatedDevice::Drive SimulatedDevice::drive(const StrokePose& pose, const Vec3& force) const noexcept {
  const Vec3& n = pose.normal;
  const Vec3 miss = aim_ - position_;
  const double miss_normal = miss.dot(n);
  const Vec3 lateral = hand_.stiffness * (miss - miss_normal * n);
  const bool pressing = path_.press() == PressMode::force && pose.phase == StrokePhase::contact;
  Drive drive;
  drive.stiffness_tangent = lateral.norm() > hand_.lateral_limit ? 0.0 : hand_.stiffness;
  // A pressing hand has no aim along the normal until its arm reaches no further.
  const double slack = pressing ? settings_.reach : 0.0;
  const bool pulled = !pressing || miss_normal > slack;
  drive.stiffness_normal = pulled ? hand_.stiffness : 0.0;
  const double along = drive.stiffness_normal * (miss_normal - slack) - push_;
  drive.force = force + shortened(lateral, hand_.lateral_limit) + along * n + hand_.damping * pose.velocity;
  return drive;
}

// Linearly implicit Euler: momentum balance at the end of the step, with spring and dampers taken there. `inertia` is
// mass plus what spring and dampers add over one step; it differs along the normal when the hand presses instead of
// aiming.
void SimulatedDevice::substep(const Vec3& force, double h) noexcept {
  const StrokePose pose = this->pose();
  update_normal_mode(pose, h);
  const Vec3& n = pose.normal;
  aim_ = pose.target + tremor_offset(time_) + (lifting_ ? lift_offset_ : 0.0) * n;
  const Drive pull = drive(pose, force);
  const double mass = hand_.mass + profile_.mass;
  const double damped = mass + h * (hand_.damping + profile_.damping);
  const double inertia_normal = damped + h * h * pull.stiffness_normal;
  const double inertia_tangent = damped + h * h * pull.stiffness_tangent;
  const Vec3 momentum = mass * velocity_ + h * pull.force;
  const double momentum_normal = momentum.dot(n);
  Vec3 v_normal = (momentum_normal / inertia_normal) * n;
  Vec3 v_tangent = (momentum - momentum_normal * n) / inertia_tangent;
  // Implicit Coulomb friction: it takes what momentum it can in one step, and all of it when that is enough to stop.
  const double stop = h * profile_.friction;
  const double speed = (v_normal + v_tangent).norm();
  if (stop > 0.0) {
    const bool sticks = momentum.norm() <= stop || speed == 0.0;
    v_normal *= sticks ? 0.0 : std::max(0.0, 1.0 - stop / (speed * inertia_normal));
    v_tangent *= sticks ? 0.0 : std::max(0.0, 1.0 - stop / (speed * inertia_tangent));
  }
  velocity_ = v_normal + v_tangent;
  position_ += h * velocity_;
}

}  // namespace asperity
