#include "asperity/material/friction.h"

#include <algorithm>
#include <cmath>

#include "asperity/material/detail/friction_limits.h"

namespace asperity {

// Every law with a spring answers f = -K z (+ damping), z the stretch at the end of the tick, and is passive by that
// right-end rule: K z·d >= K (|z|² - |z0|²) / 2 for the motion d, whatever the step. Two facts give it:
//   1. where the anchor moves by s = d - (z - z0) with s·z >= 0 (nearest point of a convex set that holds 0);
//   2. per component, where z goes monotonically from z0 towards d / h (relaxation below); and where (2) holds, it
//      holds too after a component has been shrunk towards 0, since the slack is concave in the factor.

namespace {

/// Viscous friction of a law with a spring. The estimated velocity lags behind the motion; where the two disagree it
/// would push along the motion, so there is none.
Vec3 drag(const FrictionLaw& law, const TangentContact& c) noexcept {
  if (law.viscosity <= 0.0) return Vec3::Zero();
  if (law.formulation == Formulation::consistent && c.drift.dot(c.motion) < 0.0) return Vec3::Zero();
  return -law.viscosity * c.drift;
}

Vec3 coulomb(const FrictionLaw& law, const TangentContact& c) noexcept {
  Vec3 force = c.against(c.velocity, c.sliding);
  if (law.formulation == Formulation::consistent) {
    if (c.speed < law.stick_speed) force *= c.speed / law.stick_speed;
  }
  return force - law.viscosity * c.drift;
}

// Kikuuwe et al. 2006: the spring's stretch after the tick solves K z + B (z - z0) / dt = -f with f on the ellipse;
// the nearest point of the ellipse is that solution in closed form.
Vec3 implicit_coulomb(const FrictionLaw& law, const TangentContact& c, FrictionState& state) noexcept {
  const double damping = law.damping > 0.0 ? law.damping / c.dt : 0.0;
  const Vec3 stretched = state.stretch + c.motion;
  const Vec3 pull = c.stiffness * stretched + damping * c.motion;
  const bool sticks = !state.sliding && c.within(pull, c.still);
  const Limited held = sticks ? Limited{pull} : c.limited(pull, c.sliding);
  state.sliding = !(sticks || (state.sliding && held.inside));
  state.stretch =
      state.sliding ? Vec3((1.0 / (c.stiffness + damping)) * (held.value + damping * state.stretch)) : stretched;
  return -held.value;
}

Vec3 karnopp_literal(const FrictionLaw& law, const TangentContact& c, FrictionState& state) noexcept {
  const bool fast = c.speed >= law.stick_speed;
  // It comes to stick where it is now: the anchor jumps there, and the force with it.
  Vec3 stretched = state.sliding ? Vec3::Zero() : Vec3(state.stretch + c.motion);
  const Vec3 pull = c.stiffness * stretched;
  if (!fast && c.within(pull, c.still)) {
    state.sliding = false;
    state.stretch = stretched;
    return -pull;
  }
  state.sliding = true;
  state.stretch = Vec3::Zero();
  return c.against(c.velocity.isZero(0.0) ? stretched : c.velocity, c.sliding) + drag(law, c);
}

/// Largest share of `step`, 0 to 1, by which `from` can go without leaving the ellipse it is in.
double share_within(const TangentContact& c, const Vec3& from, const Vec3& step, const Limits& limits) noexcept {
  if (c.within(from + step, limits)) return 1.0;
  const auto inverse = [](double limit) noexcept { return limit > 0.0 ? 1.0 / limit : 0.0; };
  const double by_across = inverse(limits.across);
  const double by_lay = inverse(limits.lay);
  // A direction without friction carries no damping either.
  if (by_across == 0.0 || (!c.round && by_lay == 0.0)) return 0.0;
  const Vec3 p = c.scaled(from, by_across, by_lay);
  const Vec3 d = c.scaled(step, by_across, by_lay);
  const double dd = d.squaredNorm();
  if (dd <= 0.0) return 0.0;
  const double pd = p.dot(d);
  const double room = std::max(0.0, 1.0 - p.squaredNorm());
  const double root = std::sqrt(pd * pd + dd * room);
  // The form that does not cancel.
  const double share = pd > 0.0 ? room / (pd + root) : (root - pd) / dd;
  return std::clamp(share, 0.0, 1.0);
}

// The machine sticks again once it has been fast and is slow again, or where the spring no longer reaches the sliding
// limit; the first alone would never let a slow drag stick, the speed alone would stick at the tick after the break.
Vec3 karnopp(const FrictionLaw& law, const TangentContact& c, FrictionState& state) noexcept {
  if (law.formulation == Formulation::literal) return karnopp_literal(law, c, state);
  const bool slow = c.speed < law.stick_speed;
  const Vec3 pull = c.stiffness * (state.stretch + c.motion);
  if (state.sliding && slow && (state.fast || c.within(pull, c.sliding))) state.sliding = false;
  if (!state.sliding) {
    if (c.within(pull, c.still)) {
      state.stretch += c.motion;
      // The spring alone breaks away; damping takes what the cone leaves.
      const Vec3 damped = (law.damping / c.dt) * c.motion;
      return -pull - (law.damping > 0.0 ? share_within(c, pull, damped, c.still) : 0.0) * damped;
    }
    state.sliding = true;
    state.fast = false;
  }
  if (!slow) state.fast = true;
  const Vec3 held = c.nearest(pull, c.sliding);
  state.stretch = held / c.stiffness;
  return drag(law, c) - held;
}

/// Half-axes of the stretch (m) at which the spring is at `limits`.
Limits stretch_limits(const Limits& limits, double stiffness) noexcept {
  const double softness = 1.0 / stiffness;
  return {limits.across * softness, limits.lay * softness};
}

/// How fast the stretch forgets along the motion: |A d|, A the stretch's half-axes (m²).
double forgetting(const TangentContact& c, const Limits& axes) noexcept {
  // The root of the motion alone does not wait for the axes.
  if (c.round) return axes.across * c.motion.norm();
  return c.scaled(c.motion, axes.across, axes.lay).norm();
}

/// exp(-h) and the share (1 - exp(-h)) / h of a motion that is left at the end of the step.
struct Decay {
  double kept = 1.0;
  double share = 1.0;
};
Decay decay(double amount, double axis) noexcept {
  if (amount <= 0.0) return {};
  if (axis <= 0.0) return {0.0, 0.0};
  const double square = axis * axis;
  const double h = amount / square;
  if (h < 1e-4) {
    const double share = 1.0 - 0.5 * h * (1.0 - h / 3.0);
    return {1.0 - h * share, share};
  }
  const double kept = std::exp(-h);
  return {kept, (1.0 - kept) * (square / amount)};
}

/// Exact solution of dz = dx - h |A dx| A^-2 z over a straight motion, kept within the ellipse of `held`. In every
/// direction z ends at the ellipse's point of maximum dissipation (elliptic LuGre, Velenis et al. 2005, without its
/// Stribeck part). Off the axes the ODE may leave a slim ellipse on its way; the ellipse is the cone, so it may not.
Vec3 relaxed(const TangentContact& c, const Vec3& stretch, double rate, double forgotten, const Limits& axes,
             const Limits& held) noexcept {
  const double amount = rate * forgotten;
  const Decay across = decay(amount, axes.across);
  if (c.round) return c.nearest(across.kept * stretch + across.share * c.motion, held);
  const Decay lay = decay(amount, axes.lay);
  return c.nearest(c.scaled(stretch, across.kept, lay.kept) + c.scaled(c.motion, across.share, lay.share), held);
}

/// Keeps the new stretch; more moved of the anchor than of the stretch is sliding.
void keep_stretch(const TangentContact& c, const Vec3& stretch, FrictionState& state) noexcept {
  const Vec3 change = stretch - state.stretch;
  state.sliding = (c.motion - change).squaredNorm() > change.squaredNorm();
  state.stretch = stretch;
}

/// Weight of the rate at the start of a step: half for short steps, none for long ones. `square` over `forgotten` is
/// the step's length.
double start_weight(double square, double forgotten) noexcept {
  const double forgotten_square = forgotten * forgotten;
  return forgotten_square > 0.0 ? 0.5 * forgotten_square / (forgotten_square + square * square) : 0.5;
}

// Dahl 1968: dF/dx = K (1 - F/F_c sgn)^i. Written as a relaxation at the rate h(r) = (1 - (1 - r)^i) / r, r the share
// of the limit that points along the motion; h = 1 for i = 1.
Vec3 dahl(const FrictionLaw& law, const TangentContact& c, FrictionState& state) noexcept {
  const Limits axes = stretch_limits(c.sliding, c.stiffness);
  const double forgotten = forgetting(c, axes);
  double rate = 1.0;
  if (std::abs(law.exponent - 1.0) > 1e-6 && forgotten > 0.0) {
    const double power = law.exponent;
    const double square = c.motion.squaredNorm();
    const double length = square / forgotten;
    // `rest` is 1 - r; the one-dimensional law, d(rest) = -rest^i d(length), is solved exactly for its end.
    const double before = 1.0 - std::clamp(state.stretch.dot(c.motion) / forgotten, -1.0, 1.0);
    double rate_before = 1.0;
    double rate_after = 1.0;
    if (before > 0.0) {
      const auto rate_at = [power](double rest, double rest_to_power) noexcept {
        const double r = 1.0 - rest;
        return std::abs(r) > 1e-6 ? (1.0 - rest_to_power) / r : power;
      };
      const double root_before = std::pow(before, 1.0 - power);
      const double root_after = root_before + (power - 1.0) * length;
      const double after = root_after > 0.0 ? std::min(before, std::pow(root_after, 1.0 / (1.0 - power))) : 0.0;
      rate_before = rate_at(before, before / root_before);
      if (after > 0.0) rate_after = rate_at(after, after / root_after);
    }
    const double weight = start_weight(square, forgotten);
    rate = weight * rate_before + (1.0 - weight) * rate_after;
  }
  keep_stretch(c, relaxed(c, state.stretch, rate, forgotten, axes, axes), state);
  return -c.stiffness * state.stretch;
}

/// Share of the largest stretch, over the adhesion: 0 where nothing creeps to 1 where everything does, smooth at both.
double creep(double share, double adhesion) noexcept {
  const double t = std::clamp((share - adhesion) / (1.0 - adhesion), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

double share_of(const TangentContact& c, const Vec3& stretch, const Limits& axes) noexcept {
  const auto part = [](double value, double axis) noexcept {
    return axis > 0.0 ? value / axis : (value == 0.0 ? 0.0 : 1.0);
  };
  if (c.round) return part(stretch.norm(), axes.across);
  return std::hypot(part(stretch.dot(c.across), axes.across), part(stretch.dot(c.lay), axes.lay));
}

// Hayward and Armstrong 2000: Dahl's law whose anchor creeps at a rate that is 0 until the stretch is `adhesion` of
// the largest one.
Vec3 hayward_armstrong(const FrictionLaw& law, const TangentContact& c, FrictionState& state) noexcept {
  const Limits axes = stretch_limits(c.sliding, c.stiffness);
  const double forgotten = forgetting(c, axes);
  const double before = share_of(c, state.stretch, axes);
  const double reached = share_of(c, state.stretch + c.motion, axes);
  Vec3 stretch;
  if (before <= law.adhesion && reached <= law.adhesion) {
    stretch = state.stretch + c.motion;
  } else {
    const double first = creep(before, law.adhesion);
    // Where the stretch will be once the anchor has come along for its share of the way.
    const double moved = reached - before;
    const double last = creep(before + moved - first * before * std::abs(moved), law.adhesion);
    const double weight = start_weight(c.motion.squaredNorm(), forgotten);
    const double rate = weight * first + (1.0 - weight) * last;
    stretch = relaxed(c, state.stretch, rate, forgotten, axes, axes);
  }
  keep_stretch(c, stretch, state);
  return -c.stiffness * state.stretch;
}

/// Bristle damping as far as it neither leaves the cone nor gives back more than the bristles lost: with a constant
/// coefficient it does once speed exceeds 4 g(v) / sigma_1.
Vec3 passive_bristle_damping(const TangentContact& c, const Limits& cone, const Vec3& spring, const Vec3& damped,
                             double lost) noexcept {
  double share = share_within(c, spring, damped, cone);
  const double given = -share * damped.dot(c.motion);
  if (given > lost) share *= std::max(0.0, lost) / given;
  return share * damped;
}

// Canudas de Wit et al. 1995; along two axes as Velenis et al. 2005.
Vec3 lugre(const FrictionLaw& law, const TangentContact& c, FrictionState& state) noexcept {
  const double slow = law.stribeck_speed;
  const double stribeck = std::exp(-c.speed * c.speed / (slow * slow));
  const auto between = [stribeck](double low, double high) noexcept { return low + (high - low) * stribeck; };
  const Limits level{between(c.sliding.across, c.still.across), between(c.sliding.lay, c.still.lay)};
  const Limits axes = stretch_limits(level, c.stiffness);
  const Limits cone{std::max(c.still.across, c.sliding.across), std::max(c.still.lay, c.sliding.lay)};
  const Vec3 before = state.stretch;
  keep_stretch(c, relaxed(c, before, 1.0, forgetting(c, axes), axes, stretch_limits(cone, c.stiffness)), state);
  const Vec3& z = state.stretch;
  const Vec3 spring = c.stiffness * z;
  Vec3 damped = Vec3::Zero();
  if (law.damping > 0.0) {
    damped = (law.damping / c.dt) * (z - before);
    if (law.formulation == Formulation::consistent) {
      const double lost = spring.dot(c.motion) - 0.5 * c.stiffness * (z.squaredNorm() - before.squaredNorm());
      damped = passive_bristle_damping(c, cone, spring, stribeck * damped, lost);
    }
  }
  return drag(law, c) - spring - damped;
}

bool has_spring(FrictionKind kind) noexcept {
  return kind != FrictionKind::viscous && kind != FrictionKind::coulomb;
}

Vec3 force_of(const FrictionLaw& law, const TangentContact& c, FrictionState& state) noexcept {
  switch (law.kind) {
    case FrictionKind::implicit_coulomb: return implicit_coulomb(law, c, state);
    case FrictionKind::viscous: return -law.viscosity * c.drift;
    case FrictionKind::coulomb: return coulomb(law, c);
    case FrictionKind::karnopp: return karnopp(law, c, state);
    case FrictionKind::dahl: return dahl(law, c, state);
    case FrictionKind::hayward_armstrong: return hayward_armstrong(law, c, state);
    case FrictionKind::lugre: return lugre(law, c, state);
  }
  return Vec3::Zero();
}

/// The printed stiffness changes with the direction, and the stretch stays (eq. 13 with eq. 15).
bool stiff_by_angle(const FrictionCoefficients& coefficients) noexcept {
  return coefficients.stiffness_ratio != 1.0 && coefficients.formulation == Formulation::literal;
}

/// A law or a stiffness that was changed while touching. The spring may not gain: a stiffer one goes on with its force,
/// a softer one with its energy. `printed`: it may.
void take_over(const FrictionLaw& law, double own, bool printed, FrictionState& state) noexcept {
  const double stiffness = !has_spring(law.kind) ? 0.0 : law.stiffness > 0.0 ? law.stiffness : own;
  if (state.kind != law.kind) {
    state.kind = law.kind;
    state.sliding = state.fast = false;
  }
  if (stiffness == state.stiffness) return;
  if (stiffness == 0.0) {
    state.stretch.setZero();
  } else if (state.stiffness > 0.0 && !printed) {
    const double ratio = state.stiffness / stiffness;
    state.stretch *= ratio < 1.0 ? ratio : std::sqrt(ratio);
  }
  state.stiffness = stiffness;
}

}  // namespace

Vec3 friction_force(const FrictionLaw& law, const FrictionContact& contact, FrictionState& state) noexcept {
  const bool first = !state.held;
  if (first) state = FrictionState{};
  state.held = true;
  state.stretch -= contact.normal.dot(state.stretch) * contact.normal;
  const bool by_angle = stiff_by_angle(contact.coefficients);
  take_over(law, contact.stiffness, by_angle, state);
  TangentContact tangent = tangent_contact(law, contact, state.stretch);
  if (by_angle && state.stiffness > 0.0) state.stiffness = tangent.stiffness;
  if (first && has_spring(law.kind)) {
    // Where the motion began is not known to have been on the surface.
    if (law.kind == FrictionKind::karnopp) {
      state.fast = tangent.speed >= law.stick_speed;
      state.sliding = state.fast;
    }
    if (law.kind != FrictionKind::karnopp || law.formulation == Formulation::consistent) return Vec3::Zero();
    tangent.motion.setZero();
  }
  const Vec3 force = tangent.felt(force_of(law, tangent, state));
  if (std::isfinite(force.squaredNorm() + state.stretch.squaredNorm())) return force;
  state = FrictionState{};
  return Vec3::Zero();
}

double friction_energy(const FrictionState& state) noexcept {
  return 0.5 * state.stiffness * state.stretch.squaredNorm();
}

Vec3 friction_spring(const FrictionContact& contact, const FrictionState& state) noexcept {
  const FrictionCoefficients& coefficients = contact.coefficients;
  const Vec3 pull = -state.stiffness * state.stretch;
  if (coefficients.stiffness_ratio == 1.0 || stiff_by_angle(coefficients)) return pull;
  const Vec3 lay = contact.normal.cross(coefficients.across);
  const double square = lay.squaredNorm();
  if (!(square > no_lay * no_lay)) return pull;
  return pull - ((1.0 - std::sqrt(coefficients.stiffness_ratio)) * pull.dot(lay) / square) * lay;
}

}  // namespace asperity
