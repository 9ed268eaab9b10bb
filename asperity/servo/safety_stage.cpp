#include "asperity/servo/safety_stage.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace asperity {
namespace {

// Scaling rounds: this much less keeps the result inside the limit.
constexpr double inside = 1.0 - 8.0 * std::numeric_limits<double>::epsilon();

// `v` with a norm of at most `limit`; true when it had to be shortened. Components up to the largest double are fine.
bool shorten(Vec3& v, double limit) noexcept {
  const double largest = v.cwiseAbs().maxCoeff();
  if (largest == 0.0) return false;
  const Vec3 scaled = v / largest;
  const double norm = scaled.norm();
  if (largest <= limit / norm) return false;
  v = scaled * (limit * inside / norm);
  return true;
}

bool finite(const ProbeSample& probe) noexcept {
  return probe.pose.position.allFinite() && probe.pose.orientation.coeffs().allFinite() &&
         probe.twist.linear.allFinite() && probe.twist.angular.allFinite() && std::isfinite(probe.time.count());
}

Status require_positive(double value, const char* place, const char* accepted) {
  if (std::isfinite(value) && value > 0.0) return success();
  return bad_value(fmt::format("is {}", value), place, accepted);
}

}  // namespace

Result<SafetyStage> SafetyStage::build(const SafetySettings& settings) {
  ASPERITY_CHECK(require_positive(settings.max_force, "max_force", "a force above 0 (N)"));
  ASPERITY_CHECK(require_positive(settings.slew_limit, "slew_limit", "a force rate above 0 (N/s)"));
  return SafetyStage(settings);
}

SafetyOutput SafetyStage::apply(const ForceSample& rendered, const ProbeSample& probe, Seconds dt) noexcept {
  Flags flags;
  const Vec3& force = rendered.wrench.force;
  const bool input_good = finite(probe);
  const bool output_good = force.allFinite();
  flags.set(TickFlag::input_not_finite, !input_good);
  flags.set(TickFlag::output_not_finite, !output_good);
  const bool good = input_good && output_good;
  const bool said_inside = rendered.flags.has(TickFlag::started_inside);
  // A probe that begins in a volume is where it should be: the slew limit alone keeps its force from kicking.
  const bool field_alone = rendered.flags.has(TickFlag::field_force) && !rendered.flags.has(TickFlag::contact);
  if (!armed_ && good) armed_ = !said_inside && (force.isZero(0.0) || field_alone);
  flags.set(TickFlag::started_inside, !armed_);
  return limit(good && armed_ ? force : Vec3(Vec3::Zero()), dt, flags);
}

SafetyOutput SafetyStage::ramp_down(Seconds dt) noexcept {
  return limit(Vec3::Zero(), dt, Flags{});
}

void SafetyStage::reset() noexcept {
  last_.setZero();
  armed_ = false;
}

SafetyOutput SafetyStage::limit(const Vec3& target, Seconds dt, Flags flags) noexcept {
  Vec3 force = target;
  flags.set(TickFlag::force_limited, shorten(force, settings_.max_force));
  const double duration = std::isfinite(dt.count()) && dt.count() > 0.0 ? dt.count() : 0.0;
  Vec3 change = force - last_;
  if (shorten(change, settings_.slew_limit * duration)) {
    flags.set(TickFlag::slew_limited);
    force = last_ + change;
    shorten(force, settings_.max_force);
  }
  last_ = force;
  return {force, flags};
}

}  // namespace asperity
