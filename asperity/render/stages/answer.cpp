#include <algorithm>
#include <cmath>

#include "asperity/render/stages/tick.h"

namespace asperity {

namespace {

/// Spreads the change of the force over the scene's hand-over time, as far as it is paid for.
Vec3 handed_over(Tick& tick, const Vec3& force) noexcept {
  ProxyState& state = tick.state;
  const bool new_scene = tick.changed && !tick.first;
  if (!new_scene && state.residual == Vec3::Zero()) return force;
  const double time = tick.scene.settings().handover.count();
  if (new_scene) state.residual = time > 0.0 ? Vec3(state.force - force) : Vec3(Vec3::Zero());
  if (state.residual.isZero(0.0)) return force;
  state.residual *= time > 0.0 ? std::exp(-tick.dt.count() / time) : 0.0;
  constexpr double gone = 1e-6;  // N
  if (state.residual.norm() < gone) {
    state.residual = Vec3::Zero();
    return force;
  }
  // The hand moves as it did or is told to, or twice as far.
  const double way = 2.0 * std::max(state.account.moved().norm(), tick.ahead().norm()) + 1e-7;
  state.residual *= state.account.spend_anywhere(Giver::handover, state.residual, way);
  return force + state.residual;
}

/// Forces as the hand feels them; places stay the scene's.
void to_hand(const View& view, ForceSample& out) noexcept {
  const auto turn = [&](Vec3& force) { force = view.orientation.conjugate() * force / view.zoom; };
  turn(out.wrench.force);
  turn(out.parts.friction);
  turn(out.parts.texture);
  // Its arm is as much longer in the hand as its force is weaker.
  out.wrench.torque = view.orientation.conjugate() * out.wrench.torque;
}

/// What has been about the tip, about where the hand holds the tool.
void to_grip(const SceneSettings& settings, const Quat& orientation, Wrench& wrench) noexcept {
  if (settings.tool_length == 0.0) {
    wrench.torque = Vec3::Zero();
    return;
  }
  const Vec3 from_grip = -settings.tool_length * (orientation * settings.tool_axis);
  wrench.torque += from_grip.cross(wrench.force);
}

}  // namespace

void answer(Tick& tick) noexcept {
  ProxyState& state = tick.state;
  ForceSample& out = tick.out;
  out.wrench.force = handed_over(tick, out.wrench.force);
  if (!tick.converged) out.flags.set(TickFlag::not_converged);
  if (tick.open) out.flags.set(TickFlag::work_left);
  state.open_ticks = tick.open ? state.open_ticks + 1 : 0;
  if (tick.limited) out.flags.set(TickFlag::energy_limited);
  if (tick.scene.changes()) remember_sides(tick);
  state.force = out.wrench.force;
  state.previous_probe = tick.probe->pose.position;
  state.previous_time = tick.probe->time;
  state.workspace_probe = tick.workspace.pose.position;
  if (!tick.direct) to_hand(tick.scene.settings().view, out);
  to_grip(tick.scene.settings(), tick.workspace.pose.orientation, out.wrench);
}

}  // namespace asperity
