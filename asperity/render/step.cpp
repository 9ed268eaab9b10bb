#include "asperity/render/step.h"

#include "asperity/render/proxy_tick.h"

namespace asperity {

namespace {

/// Gathers one tick's answer from the instances.
struct Tick {
  ForceSample out;
  double strongest = -1.0;

  void add(std::uint32_t instance, const LawForce& law) noexcept {
    if (!law.contact) {
      if (out.contact.count == 0 && law.element != no_index) out.contact.height = law.height;
      return;
    }
    out.flags.set(TickFlag::contact);
    out.wrench.force += law.force;
    ++out.contact.count;
    const double size = law.force.norm();
    if (size <= strongest) return;
    strongest = size;
    const std::uint32_t count = out.contact.count;
    out.contact = {count, instance, law.element, law.point, law.normal, law.penetration, law.height};
  }
};

bool overlap(const Box& a, const Box& b) noexcept {
  return (a.lower.array() <= b.upper.array()).all() && (b.lower.array() <= a.upper.array()).all();
}

/// Keeps one slot for each instance that the tick's motion can reach. False when there were too few slots.
bool update_slots(const Scene& scene, ProxyState& state, const Box& reach) noexcept {
  for (std::size_t i = state.contacts.size(); i-- > 0;) {
    const std::uint32_t instance = state.contacts[i].instance;
    // Under a thin sheet a pressed probe is far outside the sheet's own bounds, and still in contact.
    if (instance < scene.instances().size() &&
        (state.contacts[i].touching || overlap(scene.world_bounds(instance), reach)))
      continue;
    state.contacts.swap_remove(i);
  }
  bool all = true;
  for (std::uint32_t instance = 0; instance < scene.instances().size(); ++instance) {
    if (!overlap(scene.world_bounds(instance), reach)) continue;
    bool held = false;
    for (const ContactState& slot : state.contacts) held = held || slot.instance == instance;
    if (held) continue;
    if (ContactState* slot = state.contacts.emplace_back()) {
      slot->instance = instance;
    } else {
      all = false;
    }
  }
  return all;
}

LawForce relief_force(const Instance& instance, const ReliefSurface& relief, const Vec3& probe,
                      ContactState& slot) noexcept {
  if (const auto* law = std::get_if<HeightFieldLaw>(&instance.law)) {
    return height_field_force(*law, relief, instance.material, probe, slot);
  }
  return mesostructure_force(*std::get_if<MesostructureLaw>(&instance.law), relief, instance.material, probe, slot);
}

/// A law without a proxy, in the world frame.
LawForce added_force(const Instance& instance, const ProbeSample& probe, const Vec3& previous, bool first_tick,
                     ContactState& slot) noexcept {
  const ReliefSurface& relief = **std::get_if<std::shared_ptr<const ReliefSurface>>(&instance.surface);
  const Pose& pose = instance.world_from_object;
  // A probe that enters within one tick was outside at the last one: ask there first.
  if (!slot.seen_outside && !first_tick) relief_force(instance, relief, pose.apply_inverse(previous), slot);
  LawForce law = relief_force(instance, relief, pose.apply_inverse(probe.pose.position), slot);
  if (!law.contact) return law;
  law.force =
      with_damping(pose.rotate(law.force), pose.rotate(law.normal), probe.twist.linear, instance.material.damping);
  law.point = pose.apply(law.point);
  law.normal = pose.rotate(law.normal);
  return law;
}

bool finite(const ProbeSample& probe) noexcept {
  // No device is a thousand kilometres away: such a number is as broken as a NaN, and would leave the searches' range.
  constexpr double farthest = 1e6;
  return probe.pose.position.cwiseAbs().maxCoeff() < farthest && probe.pose.position.allFinite() &&
         probe.pose.orientation.coeffs().allFinite() && probe.twist.linear.allFinite() &&
         probe.twist.angular.allFinite();
}

}  // namespace

ForceSample step(const Scene& scene, ProxyState& state, const ProbeSample& probe,
                 [[maybe_unused]] Seconds dt) noexcept {
  Tick tick;
  const Vec3& position = probe.pose.position;
  if (!finite(probe)) {
    tick.out.flags.set(TickFlag::input_not_finite);
    tick.out.proxy = state.proxy;
    return tick.out;
  }
  const bool first_tick = state.epoch == 0;
  if (first_tick) state.proxy = state.previous_probe = position;
  const bool changed = state.epoch != scene.epoch();
  if (changed) state.contacts.clear();
  state.epoch = scene.epoch();

  Box reach;
  reach.include(position);
  reach.include(state.proxy);
  reach.include(state.previous_probe);
  if (!update_slots(scene, state, reach.grown(scene.probe_radius()))) tick.out.flags.set(TickFlag::contacts_dropped);
  // Where the new scene's surfaces have come over a resting proxy it starts from their outside.
  const Vec3 held = state.proxy;
  if (changed && state.stiffness > 0.0) state.proxy = reacquired(scene, state);

  Vec3 shadow = position;
  for (ContactState& slot : state.contacts) {
    const Instance& instance = scene.instances()[slot.instance];
    if (constrains(instance.law)) continue;
    const LawForce law = added_force(instance, probe, state.previous_probe, first_tick, slot);
    slot.touching = law.contact;
    tick.add(slot.instance, law);
    if (law.contact) shadow = law.point;
  }
  const ProxyAnswer answer = solve_proxies(scene, state, probe, held);
  state.proxy = answer.proxy;
  for (const ProxyAnswer::Part& part : answer.parts) tick.add(part.instance, part.law);
  tick.out.proxy = answer.parts.empty() ? shadow : answer.felt;
  tick.out.flags.set(TickFlag::not_converged, !answer.converged);
  tick.out.flags.set(TickFlag::energy_limited, answer.energy_limited);
  state.previous_probe = position;
  return tick.out;
}

}  // namespace asperity
