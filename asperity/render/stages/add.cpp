#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "asperity/render/contact/fine.h"
#include "asperity/render/contact/level.h"
#include "asperity/render/local_material.h"
#include "asperity/render/stages/tick.h"
#include "asperity/render/touched_surface.h"

namespace asperity {

namespace {

void add_contact(Tick& tick, const Touched& touch, const LawForce& law) noexcept {
  ForceSample& out = tick.out;
  if (!law.contact) {
    if (out.contact.count == 0 && law.element != no_index) out.contact.height = law.height;
    return;
  }
  out.flags.set(TickFlag::contact);
  out.wrench.force += law.force;
  // A ball is pushed where it touches: about its centre nothing but what rubs turns it.
  out.wrench.torque -= touch.facts->radius * law.normal.cross(law.force);
  out.parts.friction += law.friction;
  out.parts.texture += law.texture;
  out.parts.held += law.held;
  ++out.contact.count;
  const double size = law.force.norm();
  if (size <= tick.strongest) return;
  tick.strongest = size;
  out.contact.instance = touch.contact->instance;
  out.contact.element = law.element;
  out.contact.point = law.point;
  out.contact.normal = law.normal;
  out.contact.penetration = law.penetration;
  out.contact.height = law.height;
  out.contact.places = touch.contact->surface.places;
}

/// What a program's own law has answered, or nothing where that is no number.
void check(LawForce& answer) noexcept {
  const bool finite = std::isfinite(answer.force.sum() + answer.point.sum() + answer.normal.sum() +
                                    answer.spring.sum() + answer.penetration + answer.push + answer.stiffness);
  if (!finite) answer.contact = false;
  if (!std::isfinite(answer.height)) answer.height = 0.0;
  if (!answer.damped) answer.spring = answer.force;
  answer.keeps = !answer.stored;
  answer.local = 0.0;
}

/// What the law of an instance without a proxy answers, object frame. `material`: felt at the probe, or the instance's
/// own for a law that looks it up itself.
LawForce ask(const Touched& touch, const Material& material, const Vec3& probe, const Vec3& velocity,
             Seconds dt) noexcept {
  const Law& law = touch.instance->law;
  Contact& contact = *touch.contact;
  // Others keep them: what was before the first tick in reach is known once a law has been asked.
  if (touch.facts->custom) contact.seen_outside = contact.asked = true;
  LawForce answer =
      law.kind().force(law.settings(), TouchedSurface(touch), material, probe, velocity, dt, contact.law.memory);
  if (touch.facts->custom) check(answer);
  return answer;
}

/// Velocity of the probe over a moving instance (m/s, world).
Vec3 velocity_over(const Tick& tick, const Touched& touch) noexcept {
  const Vec3& velocity = tick.probe->twist.linear;
  if (!touch.instance->motion.moves()) return velocity;
  return velocity - touch.instance->motion.velocity_at(*touch.pose, tick.probe->pose.position, tick.probe->time);
}

/// The probe's motion as an instance sees it.
FineMotion motion_over(const Tick& tick, const Touched& touch) noexcept {
  const Vec3& position = tick.probe->pose.position;
  const Vec3& previous = tick.state.previous_probe;
  if (touch.instance->motion.moves()) {
    return {touch.to_local(position) - touch.before->apply_inverse(previous),
            touch.turned_back(velocity_over(tick, touch)), tick.dt};
  }
  return {touch.turned_back(position - previous), touch.turned_back(tick.probe->twist.linear), tick.dt};
}

/// A law's answer and its parts, turned into the world frame.
void to_world(const Touched& touch, LawForce& law) noexcept {
  if (touch.at_origin) return;
  law.force = touch.turned(law.force);
  law.spring = touch.turned(law.spring);
  law.friction = touch.turned(law.friction);
  law.drawn = touch.turned(law.drawn);
  law.texture = touch.turned(law.texture);
  if (law.turns) law.turn = touch.turned(law.turn);
  law.point = touch.to_world(law.point);
  law.normal = touch.turned(law.normal);
}

/// What makes a contact hold more than was put into it.
Giver cause_of(const Tick& tick, const Touched& touch, float before, float now) noexcept {
  if (tick.changed) return Giver::change;
  if (touch.moved) return Giver::motion;
  if (tick.surfaces_moved && touch.facts->volume) return Giver::level;
  if (touch.facts->custom) return Giver::custom;
  return before > 0.0F && now != before ? Giver::stiffness : Giver::spring;
}

double stiffness_of(const LawForce& law, const Material& material) noexcept {
  return law.stiffness > 0.0 ? law.stiffness : material.stiffness;
}

/// The spring of a program's own law, as far as what that says of its energy can be believed: no more than the
/// material's stiffness but where it is seen, and no less energy than so strong a spring holds.
Spring believed(const LawForce& law, const Material& material, const HeldForce& held, const Vec3& moved) noexcept {
  const double way = moved.norm();
  const double seen = way > 0.0 ? 2.0 * (law.spring - held.force).norm() / way : 0.0;
  Spring spring{law.spring, std::min(stiffness_of(law, material), std::max(material.stiffness, seen)), {}, law.keeps};
  if (law.stored) spring.stored = std::max(std::isfinite(*law.stored) ? *law.stored : 0.0, spring.least());
  return spring;
}

/// Tells that something else is rendered than there would be; what is rounding is not told.
void tell(Tick& tick, double share) noexcept {
  constexpr double rounding = 1e-6;
  tick.limited = tick.limited || std::abs(share - 1.0) > rounding;
}

/// Renders a share of what a contact pushes with, and of the friction and texture that go by it.
void soften(Tick& tick, double share, LawForce& law) noexcept {
  tell(tick, share);
  law.force *= share;
  law.spring *= share;
  law.friction *= share;
  law.texture *= share;
  if (law.turns) law.turn *= share;
}

/// Pays for all that a contact gives beside its spring, which is paid for already, and of which `rendered` is the
/// share. World frame.
void settle_loose(Tick& tick, const Touched& touch, double rendered, LawForce& law) noexcept {
  EnergyAccount& account = tick.state.account;
  Contact& contact = *touch.contact;
  const Instance& instance = *touch.instance;
  Vec3 loose = law.force - law.spring;
  // Of a friction law: its spring, and what only ever takes, unless the surface carries the hand along.
  const FrictionState& friction = contact.law.friction;
  const bool printed = instance.material.friction.formulation == Formulation::literal;
  const double stiffness = rendered * friction.stiffness;
  if (law.contact && stiffness > 0.0 && !printed) {
    const Vec3 spring = rendered * law.drawn;
    loose -= spring;
    const double share = account.hold(touch.moved ? Giver::motion : Giver::friction, contact.drag,
                                      {spring, stiffness, rendered * law.held});
    if (share < 1.0) {
      tell(tick, share);
      law.force -= (1.0 - share) * spring;
      law.friction -= (1.0 - share) * spring;
    }
  } else {
    account.release(contact.drag);
  }
  if (law.turns) {
    const double share = account.spend(Giver::shading, law.turn, tick.ahead());
    tell(tick, share);
    law.turn *= share;
    law.force += law.turn;
  }
  if (printed) loose -= law.friction;
  if (instance.fine != nullptr && instance.fine->settings().formulation == Formulation::literal) loose -= law.texture;
  if (touch.moved || touch.facts->custom) {
    const double share = account.spend(touch.moved ? Giver::motion : Giver::custom, loose, tick.ahead());
    tell(tick, share);
    law.force -= (1.0 - share) * loose;
    law.friction *= share;
  } else {
    account.take(loose);
  }
}

/// Whether a contact gives anything beside its spring, or has.
bool has_loose(const Touched& touch, const LawForce& law) noexcept {
  return !touch.facts->printed &&
         (touch.facts->adds_friction || law.turns || law.force != law.spring || touch.contact->drag.stiffness > 0.0F);
}

/// World frame.
void add_viscosity(double viscosity, const Vec3& velocity, LawForce& law) noexcept {
  if (viscosity <= 0.0 || !law.contact) return;
  law.friction -= viscosity * velocity;
  law.force -= viscosity * velocity;
}

/// Pays for a law without a proxy.
void settle_law(Tick& tick, const Touched& touch, const Material& material, LawForce& law) noexcept {
  if (touch.facts->printed) return;
  EnergyAccount& account = tick.state.account;
  HeldForce& held = touch.contact->push;
  const double stiffness = stiffness_of(law, material);
  double share = 1.0;
  if (law.contact && (law.stored || !law.spring.isZero(0.0))) {
    const auto local = static_cast<float>(law.local > 0.0 ? law.local : material.stiffness);
    const Giver cause = cause_of(tick, touch, touch.contact->stiffness, local);
    touch.contact->stiffness = local;
    const Spring spring = touch.facts->custom ? believed(law, material, held, account.moved())
                                              : Spring{law.spring, stiffness, law.stored, law.keeps};
    share = account.hold(cause, held, spring);
    if (share != 1.0) soften(tick, share, law);
  } else {
    touch.contact->stiffness = 0.0F;
    account.release(held);
  }
  if (has_loose(touch, law)) settle_loose(tick, touch, share, law);
}

/// What makes the proxy's spring hold more than was put into it.
Giver cause_of_spring(const Tick& tick, const Part& strongest, float before, float now) noexcept {
  if (!tick.changed && !tick.surfaces_moved) return before > 0.0F && now != before ? Giver::stiffness : Giver::spring;
  Giver cause = cause_of(tick, *strongest.touch, before, now);
  for (const Part& part : tick.parts) cause = part.touch->moved && !tick.changed ? Giver::motion : cause;
  return cause;
}

double stiffness_of(const Part& part) noexcept {
  return part.law.stiffness > 0.0 ? part.law.stiffness : part.stiffness;
}

/// Pays for what the proxy's parts hold together; answers the share that is rendered.
double settle_spring(Tick& tick) noexcept {
  ProxyState& state = tick.state;
  const Part* strongest = &tick.parts[0];
  Spring spring{strongest->law.spring, strongest->law.contact ? stiffness_of(*strongest) : 0.0, strongest->law.stored};
  for (std::size_t i = 1; i < tick.parts.size(); ++i) {
    const Part& part = tick.parts[i];
    if (!part.law.contact) continue;
    spring.force += part.law.spring;
    spring.stored.reset();
    if (stiffness_of(part) <= spring.stiffness) continue;
    strongest = &part;
    spring.stiffness = stiffness_of(part);
  }
  if (!(spring.stiffness > 0.0)) {
    state.stiffness = 0.0F;
    state.account.release(state.spring);
    return 1.0;
  }
  const auto local = static_cast<float>(strongest->stiffness);
  const float before = std::exchange(state.stiffness, local);
  return state.account.hold(cause_of_spring(tick, *strongest, before, local), state.spring, spring);
}

/// Pays for the proxy, and then for the rest of each part.
void settle_parts(Tick& tick) noexcept {
  if (tick.parts.empty()) {
    tick.state.stiffness = 0.0F;
    return tick.state.account.release(tick.state.spring);
  }
  const double share = settle_spring(tick);
  for (Part& part : tick.parts) {
    if (share != 1.0) soften(tick, share, part.law);
    if (has_loose(*part.touch, part.law)) settle_loose(tick, *part.touch, share, part.law);
  }
}

/// A law without a proxy, with friction and texture.
void add_law(Tick& tick, Touched& touch, Vec3& shadow) noexcept {
  const Instance& instance = *touch.instance;
  Contact& contact = *touch.contact;
  const FineMotion motion = motion_over(tick, touch);
  const bool volume = touch.facts->volume;
  const Vec3 position = touch.to_local(tick.probe->pose.position);
  const Vec3 previous = touch.to_local(tick.state.previous_probe);
  // The contact point's laws look the material up where that is.
  const bool elsewhere = instance.law.facts().own_place;
  MaterialRoom room;
  const Material& material = elsewhere ? instance.material : material_there(touch, position, room);
  // A probe that enters within one tick was outside at the last one: ask there first.
  const bool fresh = volume ? !contact.asked : !contact.seen_outside;
  if (fresh && !tick.first) ask(touch, material, previous, motion.velocity, tick.dt);
  LawForce law = ask(touch, material, position, motion.velocity, tick.dt);
  contact.touching = law.contact;
  // What it is held to goes along with a surface that changes.
  contact.surface.rests = law.contact && !contact.surface.places.empty();
  if (law.contact) {
    if (volume) law.element = element_at(instance, contact.surface.level, law.point, *touch.cache);
    if (!law.damped) {
      law.push = law.force.dot(law.normal);
      // What resists by its speed is told apart by those that do.
      if (law.stiffness == 0.0 && law.spring.isZero(0.0)) law.spring = law.force;
      // Against the hand's own motion: damping by a surface that moves would drag the hand along.
      law.force = with_damping(law.force, law.normal, touch.turned_back(tick.probe->twist.linear), material.damping);
    }
  }
  const bool adds = touch.facts->adds_friction;
  if (instance.fine != nullptr || adds) {
    MaterialRoom there;
    const Material& felt = elsewhere ? material_there(touch, law.point, there) : material;
    if (add_fine_forces(touch, felt, adds, felt.stiffness, motion, law)) tick.out.flags.set(TickFlag::texture_faded);
  }
  to_world(touch, law);
  add_viscosity(material.viscosity, velocity_over(tick, touch), law);
  settle_law(tick, touch, material, law);
  add_contact(tick, touch, law);
  if (law.contact) shadow = law.point;
}

/// What friction and texture add to what a proxy answers, which is in the world frame.
void add_to_proxy(Tick& tick, Part& part) noexcept {
  LawForce& law = part.law;
  Touched& touch = *part.touch;
  const Instance& instance = *touch.instance;
  const bool adds = touch.facts->adds_friction;
  const bool mapped = touch.facts->varies && !touch.facts->volume;
  MaterialRoom room;
  const Material& local = mapped ? material_there(touch, touch.to_local(law.point), room) : instance.material;
  if (local.viscosity > 0.0) add_viscosity(local.viscosity, velocity_over(tick, touch), law);
  if (!adds && instance.fine == nullptr) {
    if (law.contact && instance.material.static_friction > 0.0 && touch.facts->holds_friction)
      law.friction = law.force - law.force.dot(law.normal) * law.normal;
    return;
  }
  const double stiffness = part.stiffness;
  law.push = law.pulls ? 0.0 : stiffness * law.penetration;
  if (!touch.at_origin) {
    law.force = touch.turned_back(law.force);
    law.spring = touch.turned_back(law.spring);
    law.point = touch.to_local(law.point);
    law.normal = touch.turned_back(law.normal);
    law.friction = touch.turned_back(law.friction);
    if (law.bends) {
      const Mat3 turn = touch.pose->orientation.toRotationMatrix();
      law.bend = turn.transpose() * law.bend * turn;
    }
  }
  const Vec3 kept = law.friction;
  law.friction = Vec3::Zero();
  const Material& felt = implicit_of(instance.surface) != nullptr ? material_there(touch, law.point, room) : local;
  if (add_fine_forces(touch, felt, adds, stiffness, motion_over(tick, touch), law))
    tick.out.flags.set(TickFlag::texture_faded);
  law.friction += kept;
  to_world(touch, law);
}

/// What draws the probe to an instance, where something does.
void add_attraction(Tick& tick, Touched& touch) noexcept {
  const Attraction pull = attraction_at(touch, touch.to_local(tick.probe->pose.position));
  HeldForce& held = touch.contact->draw;
  if (!pull.felt) return tick.state.account.release(held);
  const Vec3 force = touch.turned(pull.force);
  const double share = tick.state.account.hold(Giver::attraction, held, {force, pull.stiffness, pull.potential});
  tell(tick, share);
  tick.out.wrench.force += share * force;
  if (!force.isZero(0.0)) tick.out.flags.set(TickFlag::field_force);
}

/// What is felt of volumes without a surface.
void add_effects(Tick& tick) noexcept {
  for (const FieldEffect& effect : tick.scene.felt_effects()) {
    CellPolynomial cache;
    const int here = std::min(tick.level, effect.field->levels() - 1);
    const Vec3 force = field_effect_force(effect, here, tick.probe->pose.position, tick.probe->twist.linear, cache);
    if (force.isZero()) continue;
    tick.out.flags.set(TickFlag::field_force);
    const double share = tick.state.account.spend(Giver::effect, force, tick.ahead());
    tell(tick, share);
    tick.out.wrench.force += share * force;
  }
}

}  // namespace

void add(Tick& tick) noexcept {
  Vec3 shadow = tick.felt;
  // A part of the proxy stands for each that constrains it.
  if (tick.parts.size() < tick.touches.size()) {
    for (Touched& touch : tick.touches) {
      if (!touch.facts->constrains) add_law(tick, touch, shadow);
    }
  }
  for (Part& part : tick.parts) add_to_proxy(tick, part);
  settle_parts(tick);
  for (const Part& part : tick.parts) {
    add_contact(tick, *part.touch, part.law);
    part.touch->contact->touching = part.law.contact;
  }
  tick.out.proxy = tick.parts.empty() ? shadow : tick.felt;
  if (tick.scene.draws()) {
    for (Touched& touch : tick.touches) {
      if (touch.facts->draws) add_attraction(tick, touch);
    }
  }
  if (!tick.scene.felt_effects().empty()) add_effects(tick);
}

}  // namespace asperity
