#include "asperity/study/friction_rig.h"

#include <fmt/format.h>

#include <cmath>

namespace asperity {
namespace {

constexpr double most_steps = 1e8;

Status check(const RigSettings& s) {
  const std::pair<const char*, double> positive[] = {{"mass", s.mass},
                                                     {"load", s.load},
                                                     {"stiffness", s.stiffness},
                                                     {"speed", s.speed},
                                                     {"contact_stiffness", s.contact_stiffness},
                                                     {"duration", s.duration.count()},
                                                     {"dt", s.dt.count()}};
  for (const auto& [name, value] : positive) {
    if (!(std::isfinite(value) && value > 0.0))
      return bad_value(fmt::format("is {:g}", value), name, "a number above 0");
  }
  if (!(s.warm_up.count() >= 0.0) || !std::isfinite(s.start) || !std::isfinite(s.start_speed))
    return bad_value("is not finite, or negative", "warm_up, start, start_speed", "finite numbers");
  if (!(s.spacing >= s.dt) || !((s.warm_up + s.duration) / s.dt <= most_steps)) {
    return bad_value("does not fit the spacing, or is too short for the duration", "dt",
                     "a step of at most the spacing, and no more than 1e8 of them");
  }
  return success();
}

}  // namespace

Result<FrictionTrace> pull_slider(const FrictionLaw& law, const FrictionCoefficients& coefficients,
                                  const RigSettings& settings) {
  ASPERITY_CHECK(check(settings));
  ASPERITY_CHECK(validate(law));
  const auto steps_of = [&](Seconds time) { return static_cast<std::size_t>(std::llround(time / settings.dt)); };
  const std::size_t every = std::max<std::size_t>(1, steps_of(settings.spacing));
  const std::size_t skipped = steps_of(settings.warm_up);
  const std::size_t steps = skipped + steps_of(settings.duration);
  const double dt = settings.dt.count();
  FrictionTrace trace;
  trace.stiffness = settings.stiffness;
  trace.speed = settings.speed;
  trace.spacing = static_cast<double>(every) * dt;
  trace.friction.reserve((steps - skipped) / every + 1);
  FrictionContact contact{
      .push = settings.load, .stiffness = settings.contact_stiffness, .dt = settings.dt, .coefficients = coefficients};
  FrictionState state;
  double stretch = settings.start * settings.load / settings.stiffness;  // of the pulling spring
  double velocity = settings.start_speed;
  double moved = 0.0;
  for (std::size_t i = 0; i < steps; ++i) {
    const double pull = settings.stiffness * stretch;
    if (i >= skipped && (i - skipped) % every == 0) trace.friction.push_back(pull / settings.load);
    contact.motion = Vec3(moved, 0.0, 0.0);
    contact.velocity = Vec3(velocity, 0.0, 0.0);
    const double friction = friction_force(law, contact, state).x();
    velocity += dt / settings.mass * (pull + friction);
    moved = dt * velocity;
    stretch += dt * settings.speed - moved;
  }
  return trace;
}

}  // namespace asperity
