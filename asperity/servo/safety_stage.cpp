#include "asperity/servo/safety_stage.h"

#include <fmt/format.h>

#include <algorithm>
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

Status require(bool good, const char* place, double value, const char* accepted) {
  if (good) return success();
  return bad_value(fmt::format("is {}", value), place, accepted);
}

bool is_time(Seconds dt) noexcept {
  return std::isfinite(dt.count()) && dt.count() > 0.0;
}

}  // namespace

std::string_view fault_sentence(Fault fault) noexcept {
  switch (fault) {
    case Fault::none: return "nothing is wrong";
    case Fault::input_not_finite: return "the device reported a place or a speed that is not a number";
    case Fault::output_not_finite: return "the renderer answered a force that is not a number";
    case Fault::too_fast: return "the tip moved faster than a hand does: the device reports wrong places or runs away";
    case Fault::overrun: return "a tick took longer than the loop may be blind";
    case Fault::stalled: return "the renderer did not answer in time";
    case Fault::device_lost: return "the device no longer answers";
    case Fault::clock_stopped: return "the clock that ticks go by stands still";
  }
  return "";
}

SafetySettings SafetySettings::from_profile(const DeviceProfile& profile) {
  SafetySettings settings;
  settings.max_force = profile.max_force;
  settings.slew_limit = profile.slew_limit;
  settings.max_power = profile.max_power;
  settings.max_velocity = profile.max_velocity;
  return settings;
}

SafetySettings SafetySettings::for_hands(const DeviceProfile& profile, const Vec3& middle) {
  SafetySettings settings = from_profile(profile);
  settings.workspace = middle;
  settings.workspace_radius = profile.workspace_radius;
  settings.engage = Seconds(0.5);
  settings.longest_tick = Seconds(0.05);
  settings.latches = true;
  return settings;
}

Result<SafetyStage> SafetyStage::build(const SafetySettings& settings) {
  const SafetySettings& s = settings;
  const auto positive = [](const char* place, double value, const char* accepted) {
    return require(std::isfinite(value) && value > 0.0, place, value, accepted);
  };
  const auto limit = [](const char* place, double value, const char* accepted) {
    return require(value > 0.0, place, value, accepted);  // infinity is no limit
  };
  ASPERITY_CHECK(positive("max_force", s.max_force, "a force above 0 (N)"));
  ASPERITY_CHECK(positive("slew_limit", s.slew_limit, "a force rate above 0 (N/s)"));
  ASPERITY_CHECK(limit("max_power", s.max_power, "a power above 0 (W)"));
  ASPERITY_CHECK(limit("max_velocity", s.max_velocity, "a speed above 0 (m/s)"));
  ASPERITY_CHECK(limit("workspace_radius", s.workspace_radius, "a length above 0 (m)"));
  ASPERITY_CHECK(limit("longest_tick", s.longest_tick.count(), "a time above 0 (s)"));
  ASPERITY_CHECK(require(s.workspace.allFinite(), "workspace", s.workspace.sum(), "a place (m)"));
  ASPERITY_CHECK(require(s.border >= 0.0 && s.border <= 1.0, "border", s.border, "a share of the radius, 0 to 1"));
  const double engage = s.engage.count();
  ASPERITY_CHECK(require(std::isfinite(engage) && engage >= 0.0, "engage", engage, "a time of 0 or more (s)"));
  ASPERITY_CHECK(require(s.enabling_button >= -1 && s.enabling_button < 32, "enabling_button", s.enabling_button,
                         "a button, 0 to 31, or -1 for none"));
  return SafetyStage(settings);
}

/// What is wrong with this tick alone.
Fault SafetyStage::seen(const ForceSample& rendered, const ProbeSample& probe, Seconds dt) const noexcept {
  if (!finite(probe)) return Fault::input_not_finite;
  if (!rendered.wrench.force.allFinite()) return Fault::output_not_finite;
  if (probe.twist.linear.norm() > settings_.max_velocity) return Fault::too_fast;
  if (dt > settings_.longest_tick) return Fault::overrun;
  return Fault::none;
}

SafetyOutput SafetyStage::apply(const ForceSample& rendered, const ProbeSample& probe, Seconds dt) noexcept {
  Flags flags;
  const Vec3& force = rendered.wrench.force;
  if (!faulted()) now_.fault = seen(rendered, probe, dt);
  flags.set(TickFlag::input_not_finite, !finite(probe));
  flags.set(TickFlag::output_not_finite, !force.allFinite());
  const bool has_own_flag = now_.fault == Fault::input_not_finite || now_.fault == Fault::output_not_finite;
  flags.set(TickFlag::fault, faulted() || (now_.fault != Fault::none && !has_own_flag));
  const int button = settings_.enabling_button;
  const bool enabled = !now_.withheld && (button < 0 || (probe.buttons >> button & 1U) != 0);
  flags.set(TickFlag::not_enabled, !enabled);
  if (!enabled || faulted()) start_anew();
  const bool good = now_.fault == Fault::none && enabled;
  const bool said_inside = rendered.flags.has(TickFlag::started_inside);
  // A probe that begins in a volume is where it should be: the slew limit alone keeps its force from kicking.
  const bool field_alone = rendered.flags.has(TickFlag::field_force) && !rendered.flags.has(TickFlag::contact);
  if (!now_.armed && good) now_.armed = !said_inside && (force.isZero(0.0) || field_alone);
  flags.set(TickFlag::started_inside, !now_.armed);
  if (now_.armed && is_time(dt)) now_.engaged += dt;

  Vec3 target = good && now_.armed ? force : Vec3(Vec3::Zero());
  const double share = settings_.engage.count() > 0.0 ? std::min(1.0, now_.engaged / settings_.engage) : 1.0;
  flags.set(TickFlag::force_limited, shorten(target, share * settings_.max_force));
  keep_slew(target, dt, flags);
  keep_inside(probe, flags);
  return {now_.last_force, flags};
}

SafetyOutput SafetyStage::ramp_down(Seconds dt) noexcept {
  Flags flags;
  keep_slew(Vec3::Zero(), dt, flags);
  return {now_.last_force, flags};
}

void SafetyStage::reset() noexcept {
  now_ = SafetyMemory{};
}

void SafetyStage::raise(Fault fault) noexcept {
  if (fault == Fault::none || faulted()) return;
  now_.fault = fault;
  now_.raised = true;
}

void SafetyStage::acknowledge() noexcept {
  if (faulted()) start_anew();
  now_.fault = Fault::none;
  now_.raised = false;
}

void SafetyStage::start_anew() noexcept {
  now_.armed = false;
  now_.engaged = Seconds(0.0);
}

/// Cuts the force to the workspace and the power: both make it smaller, the second without turning it.
void SafetyStage::keep_inside(const ProbeSample& probe, Flags& flags) noexcept {
  if (!finite(probe)) return;
  const Vec3 off = probe.pose.position - settings_.workspace;
  const double away = off.stableNorm();
  const double radius = settings_.workspace_radius;
  if (away > (1.0 - settings_.border) * radius) {
    const Vec3 outward = off / away;
    const double left = settings_.border > 0.0 ? std::max(0.0, (radius - away) / (settings_.border * radius)) : 0.0;
    const double beyond = now_.last_force.dot(outward) - left * settings_.max_force;
    if (beyond > 0.0) {
      now_.last_force -= beyond * outward;
      flags.set(TickFlag::at_border);
    }
  }
  // A sum that overflows is beyond the limit as well.
  const double power = now_.last_force.dot(probe.twist.linear);
  if (!(power <= settings_.max_power)) {
    now_.last_force *= std::isfinite(power) ? settings_.max_power * inside / power : 0.0;
    flags.set(TickFlag::power_limited);
  }
}

/// From the last force towards another one as fast as it may.
void SafetyStage::keep_slew(const Vec3& force, Seconds dt, Flags& flags) noexcept {
  Vec3 next = force;
  Vec3 change = force - now_.last_force;
  if (shorten(change, settings_.slew_limit * (is_time(dt) ? dt.count() : 0.0))) {
    flags.set(TickFlag::slew_limited);
    next = now_.last_force + change;
    shorten(next, settings_.max_force);
  }
  now_.last_force = next;
}

}  // namespace asperity
