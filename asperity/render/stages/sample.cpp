#include "asperity/render/stages/tick.h"

namespace asperity {

namespace {

/// A probe of the workspace as it is in the scene.
ProbeSample in_scene(const View& view, const ProbeSample& probe) noexcept {
  ProbeSample out = probe;
  out.pose.position = view.to_scene(probe.pose.position);
  out.pose.orientation = view.orientation * probe.pose.orientation;
  out.twist.linear = view.orientation * probe.twist.linear / view.zoom;
  out.twist.angular = view.orientation * probe.twist.angular;
  return out;
}

bool same(const View& a, const View& b) noexcept {
  return a.zoom == b.zoom && a.focus == b.focus && a.home == b.home && a.orientation.coeffs() == b.orientation.coeffs();
}

/// Takes the state from the view of the last tick to this one: forces stay what they are to the hand.
void adopt_view(const View& view, Tick& tick) noexcept {
  ProxyState& state = tick.state;
  const View last = state.view;
  state.view = view;
  if (same(last, view)) return;
  const auto turn = [&](const Vec3& v) { return Vec3(view.orientation * (last.orientation.conjugate() * v)); };
  const double scale = last.zoom / view.zoom;
  const auto turn_held = [&](HeldForce& held) {
    held.force = turn(held.force) / scale;
    held.stiffness /= static_cast<float>(scale * scale);
  };
  turn_held(state.spring);
  state.account.turn([&](const Vec3& force) { return Vec3(turn(force) / scale); });
  state.force = turn(state.force) / scale;
  state.residual = turn(state.residual) / scale;
  state.previous_probe = view.to_scene(state.workspace_probe);
  for (Contact& contact : state.contacts) {
    const auto turned = [&](const Vec3& v) { return contact.pose.rotate_inverse(turn(contact.pose.rotate(v))); };
    contact.law.friction.stretch = scale * turned(contact.law.friction.stretch);
    contact.law.friction.stiffness /= scale * scale;
    turn_held(contact.push);
    turn_held(contact.drag);
    turn_held(contact.draw);
    const Vec3 previous = contact.pose.apply_inverse(state.previous_probe);
    if (contact.law.memory.begun && contact.law.kind->seen_from != nullptr)
      contact.law.kind->seen_from(contact.law.memory, previous);
  }
}

/// What a contact is in another scene: what is of the law goes on with the law, what is of the surface with the
/// surface. False: nothing of it does.
bool adopt(Contact& contact, const Instance& instance) noexcept {
  const bool same_law = contact.law.kind == &instance.law.kind();
  const bool same_surface = contact.surface.identity == surface_identity(instance.surface);
  const bool volume = iso_of(instance.surface) != nullptr;
  // A proxy finds its surface again by itself; a law without one has come in from the front, and goes on pushing on the
  // same volume by another law, or by the same law in another volume.
  const bool pushed = contact.touching && !instance.law.constrains();
  if (volume ? !same_surface && !(same_law && pushed) : !same_law) return false;
  if (volume && same_law && same_surface) return true;
  if (volume) {
    contact.seen_outside = contact.seen_outside || contact.touching;
    contact.touching = contact.asked = false;
    contact.surface.rests = false;
    contact.surface.places.clear();
    contact.surface.normal = Vec3::Zero();
  }
  if (!same_surface) {
    contact.surface = {};
    if (instance.law.kind().of_surface) contact.law.memory = {};
  }
  if (!same_law) contact.law = {};
  return true;
}

}  // namespace

bool sample(Tick& tick) noexcept {
  ProxyState& state = tick.state;
  if (!is_place(tick.workspace)) {
    tick.out.flags.set(TickFlag::input_not_finite);
    tick.out.proxy = state.proxy;
    return false;
  }
  const View& view = tick.scene.settings().view;
  tick.direct = tick.scene.direct();
  if (!tick.direct) {
    ProbeSample* probe = tick.in_scene.emplace_back();
    *probe = in_scene(view, tick.workspace);
    tick.probe = probe;
  }
  tick.first = state.epoch == 0;
  if (tick.first) {
    state.proxy = state.previous_probe = tick.probe->pose.position;
    state.workspace_probe = tick.workspace.pose.position;
    state.view = view;
  }
  tick.changed = state.epoch != tick.scene.epoch();
  if (tick.changed && !tick.first) adopt_view(view, tick);
  state.account.open(tick.probe->pose.position - state.previous_probe, tick.scene.settings().energy_capacity,
                     tick.first);
  if (tick.changed) {
    for (std::size_t i = state.contacts.size(); i-- > 0;) {
      Contact& contact = state.contacts[i];
      const auto felt = tick.scene.felt();
      if (contact.instance >= felt.size() || !adopt(contact, felt[contact.instance])) {
        let_go(state, i);
      } else if (!tick.scene.facts(contact.instance).changes) {
        contact.outside.reset();
      }
    }
  }
  state.epoch = tick.scene.epoch();
  return true;
}

}  // namespace asperity
