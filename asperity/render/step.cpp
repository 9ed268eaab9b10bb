#include "asperity/render/step.h"

#include <algorithm>

#include "asperity/render/fine_contact.h"
#include "asperity/render/iso_proxy.h"
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
    out.parts.friction += law.friction;
    out.parts.texture += law.texture;
    out.parts.held += law.held;
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

/// `material`: felt at the probe.
LawForce force_at(const Instance& instance, const Material& material, const Vec3& probe, const Vec3& velocity,
                  Seconds dt, ContactState& slot) noexcept {
  if (needs_potential(instance.law)) {
    const ImplicitSurface& surface = *implicit_of(instance.surface);
    // Where friction is a force of its own the contact point is not held back as well.
    Material own = instance.material;
    own.friction_named = adds_friction(instance);
    if (const auto* law = std::get_if<VirtualContactPointLaw>(&instance.law))
      return virtual_contact_force(*law, surface, own, probe, velocity, dt, slot);
    if (const auto* law = std::get_if<MagneticLaw>(&instance.law))
      return magnetic_force(*law, surface, own, probe, velocity, dt, slot);
    return normal_perturbation_force(surface, material, probe, slot);
  }
  if (const IsoSurface* iso = iso_of(instance.surface)) {
    const IsoView view = felt_view(*iso, slot);
    if (const auto* law = std::get_if<AvilaLaw>(&instance.law))
      return avila_force(*law, *iso, view, material, probe, velocity, slot);
    return cross_uncross_force(*std::get_if<CrossUncrossLaw>(&instance.law), *iso, view, material, probe, velocity,
                               slot);
  }
  const ReliefSurface& relief = **std::get_if<std::shared_ptr<const ReliefSurface>>(&instance.surface);
  if (const auto* law = std::get_if<HeightFieldLaw>(&instance.law)) {
    return height_field_force(*law, relief, material, probe, slot);
  }
  return mesostructure_force(*std::get_if<MesostructureLaw>(&instance.law), relief, material, probe, slot);
}

/// The probe's motion as an instance sees it.
FineMotion motion_over(const Instance& instance, const ProbeSample& probe, const Vec3& previous, Seconds dt) noexcept {
  const Pose& pose = instance.world_from_object;
  const Vec3 moved = probe.pose.position - previous;
  if (pose.is_identity()) return {moved, probe.twist.linear, dt};
  return {pose.rotate_inverse(moved), pose.rotate_inverse(probe.twist.linear), dt};
}

/// A law's answer and its parts, turned into the world frame.
void to_world(const Pose& pose, LawForce& law) noexcept {
  if (pose.is_identity()) return;
  law.force = pose.rotate(law.force);
  law.friction = pose.rotate(law.friction);
  law.texture = pose.rotate(law.texture);
  law.point = pose.apply(law.point);
  law.normal = pose.rotate(law.normal);
}

/// A law without a proxy, in the world frame, with friction and texture.
LawForce added_force(const Instance& instance, const ProbeSample& probe, const Vec3& previous, bool first_tick,
                     Seconds dt, ContactState& slot, Tick& tick, EnergyTank& tank) noexcept {
  const Pose& pose = instance.world_from_object;
  const bool at_origin = pose.is_identity();
  const FineMotion motion = motion_over(instance, probe, previous, dt);
  // A probe that enters within one tick was outside at the last one: ask there first.
  const IsoSurface* iso = iso_of(instance.surface);
  const bool fresh = iso != nullptr ? !slot.iso.started : !slot.seen_outside;
  const Vec3 position = at_origin ? probe.pose.position : pose.apply_inverse(probe.pose.position);
  // The contact point's laws look the material up where that is.
  const bool elsewhere = needs_potential(instance.law) && !std::holds_alternative<NormalPerturbationLaw>(instance.law);
  const Material material = elsewhere ? instance.material : local_material(instance, position, slot.hint.sparse);
  if (fresh && !first_tick) force_at(instance, material, pose.apply_inverse(previous), motion.velocity, dt, slot);
  LawForce law = force_at(instance, material, position, motion.velocity, dt, slot);
  slot.touching = law.contact;
  if (law.contact) {
    if (iso != nullptr) law.element = element_at(instance, law.point, slot);
    if (!law.damped) {
      law.push = law.force.dot(law.normal);
      law.force = with_damping(law.force, law.normal, motion.velocity, material.damping);
    }
  }
  const bool adds = adds_friction(instance);
  if (instance.fine != nullptr || adds) {
    const Material felt = elsewhere ? local_material(instance, law.point, slot.hint.sparse) : material;
    if (add_fine_forces(instance, felt, adds, felt.stiffness, motion, slot, tank, law))
      tick.out.flags.set(TickFlag::texture_faded);
  }
  to_world(pose, law);
  return law;
}

/// What friction and texture add to a proxy's answer, which is in the world frame.
void add_to_proxy(const Instance& instance, double share, const FineMotion& motion, ContactState& slot, Tick& tick,
                  EnergyTank& tank, ProxyAnswer::Part& part) noexcept {
  LawForce& law = part.law;
  const bool adds = adds_friction(instance);
  if (!adds && instance.fine == nullptr) {
    if (law.contact && instance.material.static_friction > 0.0 && proxy_holds_friction(instance))
      law.friction = law.force - law.force.dot(law.normal) * law.normal;
    return;
  }
  const double stiffness = share * part.stiffness;
  law.push = stiffness * law.penetration;
  const Pose& pose = instance.world_from_object;
  if (!pose.is_identity()) {
    law.force = pose.rotate_inverse(law.force);
    law.point = pose.apply_inverse(law.point);
    law.normal = pose.rotate_inverse(law.normal);
    if (law.bends) {
      const Mat3 turn = pose.orientation.toRotationMatrix();
      law.bend = turn.transpose() * law.bend * turn;
    }
  }
  const bool own = implicit_of(instance.surface) == nullptr;
  const Material local = own ? Material{} : local_material(instance, law.point, slot.hint.sparse);
  if (add_fine_forces(instance, own ? instance.material : local, adds, stiffness, motion, slot, tank, law))
    tick.out.flags.set(TickFlag::texture_faded);
  to_world(pose, law);
}

/// Every place that one tick may ask a volume about: the proxy never gets farther from the probe than it is, and both
/// the law's searches and the gradient look a few cells around. Object frame.
Box tick_reach(const ScalarField& field, const Pose& pose, const ProxyState& state, const Vec3& probe,
               double probe_radius) noexcept {
  constexpr double cells_around = 4.0;
  double widest = 0.0;
  const Vec3 local = pose.apply_inverse(probe);
  for (int a = 0; a < 3; ++a) {
    const GridAxis& axis = field.axes()[static_cast<std::size_t>(a)];
    widest = std::max(widest, axis.width(axis.locate(local[a]).cell));
  }
  const double apart = std::max((state.proxy - probe).norm(), (state.previous_probe - probe).norm());
  Box box;
  box.include(local);
  return box.grown(apart + 2.0 * probe_radius + cells_around * widest);
}

/// Keeps the bricks that a tick reads in place while it lasts.
class VolumeReading {
 public:
  explicit VolumeReading(const Scene& scene) noexcept : scene_(scene) {
    for_each([](const ScalarField& field) { field.enter(); });
  }
  ~VolumeReading() {
    for_each([](const ScalarField& field) { field.leave(); });
  }
  VolumeReading(const VolumeReading&) = delete;
  VolumeReading& operator=(const VolumeReading&) = delete;

 private:
  template <class Visit>
  void for_each(Visit&& visit) const noexcept {
    for (const Instance& instance : scene_.instances()) {
      if (const IsoSurface* iso = iso_of(instance.surface)) visit(iso->field());
    }
    for (const FieldEffect& effect : scene_.effects()) visit(*effect.field);
  }
  const Scene& scene_;
};

/// The finest level at which all volumes are in memory around the probe; one for all of them, so that a replay can ask
/// for it. Tells their streaming threads where the probe is and goes.
int level_now(const Scene& scene, const ProxyState& state, const ProbeSample& probe, ForceSample& out) noexcept {
  int level = 0;
  const auto ask = [&](const ScalarField& field, const Pose& pose) {
    if (field.bricks() == nullptr) return;
    const Vec3& position = probe.pose.position;
    field.bricks()->look_ahead(pose.apply_inverse(position), pose.rotate_inverse(probe.twist.linear));
    const int finest = std::clamp(state.wanted_level, 0, field.levels() - 1);
    const Box reach = tick_reach(field, pose, state, position, scene.probe_radius());
    level = std::max(level, field.ready_level(reach, finest));
  };
  for (const Instance& instance : scene.instances()) {
    if (const IsoSurface* iso = iso_of(instance.surface)) ask(iso->field(), instance.world_from_object);
  }
  for (const FieldEffect& effect : scene.effects()) ask(*effect.field, effect.world_from_object);
  out.flags.set(TickFlag::coarse_data, level > 0);
  out.level = static_cast<std::uint8_t>(level);
  return level;
}

/// What is felt of volumes without a surface.
void add_effects(const Scene& scene, int level, const ProbeSample& probe, ForceSample& out) noexcept {
  for (const FieldEffect& effect : scene.effects()) {
    CellPolynomial cache;
    const int here = std::min(level, effect.field->levels() - 1);
    const Vec3 force = field_effect_force(effect, here, probe.pose.position, probe.twist.linear, cache);
    if (force.isZero()) continue;
    out.flags.set(TickFlag::field_force);
    out.wrench.force += force;
  }
}

/// Of another scene nothing is known, except where the same volume is touched at another threshold or by another law,
/// that a law without a proxy has come in from the front, and what friction and texture hold.
void forget_contacts(const Scene& scene, ProxyState& state) noexcept {
  for (std::size_t i = state.contacts.size(); i-- > 0;) {
    ContactState& slot = state.contacts[i];
    const Instance* instance = slot.instance < scene.instances().size() ? &scene.instances()[slot.instance] : nullptr;
    const IsoSurface* iso = instance != nullptr ? iso_of(instance->surface) : nullptr;
    const bool same_law = instance != nullptr && slot.law == instance->law.index();
    if (iso == nullptr) {
      // A proxy finds its surface again by itself. What friction and texture hold of the hand goes on.
      if (!same_law || !constrains(instance->law)) {
        state.contacts.swap_remove(i);
        continue;
      }
      ContactState fresh;
      fresh.instance = slot.instance;
      fresh.law = slot.law;
      fresh.friction = slot.friction;
      fresh.texture = slot.texture;
      slot = fresh;
      continue;
    }
    const bool same_field = iso->field().identity() == slot.iso.field;
    if (same_law && same_field) continue;
    const bool pushed = slot.touching && !constrains(instance->law);
    if (!same_field && !(same_law && pushed)) {
      state.contacts.swap_remove(i);
      continue;
    }
    // What another law, or the law on another field, has left behind means nothing to this one.
    ContactState fresh;
    fresh.instance = slot.instance;
    fresh.seen_outside = slot.seen_outside || slot.touching;
    if (same_field) {
      fresh.iso.field = slot.iso.field;
      fresh.iso.threshold = slot.iso.threshold;
      fresh.iso.level = slot.iso.level;
    }
    if (same_law) {
      fresh.friction = slot.friction;
      fresh.texture = slot.texture;
    }
    slot = fresh;
  }
}

bool finite(const ProbeSample& probe) noexcept {
  // No device is a thousand kilometres away: such a number is as broken as a NaN, and would leave the searches' range.
  constexpr double farthest = 1e6;
  return probe.pose.position.cwiseAbs().maxCoeff() < farthest && probe.pose.position.allFinite() &&
         probe.pose.orientation.coeffs().allFinite() && probe.twist.linear.allFinite() &&
         probe.twist.angular.allFinite();
}

}  // namespace

Status fetch_volumes(const Scene& scene, const ProxyState& state, const ProbeSample& probe) {
  if (!finite(probe)) return success();
  ProxyState now = state;
  if (now.epoch == 0) now.proxy = now.previous_probe = probe.pose.position;
  const auto fetch = [&](const ScalarField& field, const Pose& pose) -> Status {
    if (field.bricks() == nullptr) return success();
    const int level = std::clamp(now.wanted_level, 0, field.levels() - 1);
    return field.bricks()->fetch(tick_reach(field, pose, now, probe.pose.position, scene.probe_radius()), level);
  };
  for (const Instance& instance : scene.instances()) {
    if (const IsoSurface* iso = iso_of(instance.surface))
      ASPERITY_CHECK(fetch(iso->field(), instance.world_from_object));
  }
  for (const FieldEffect& effect : scene.effects()) ASPERITY_CHECK(fetch(*effect.field, effect.world_from_object));
  return success();
}

ForceSample step(const Scene& scene, ProxyState& state, const ProbeSample& probe, Seconds dt) noexcept {
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
  if (changed) forget_contacts(scene, state);
  state.epoch = scene.epoch();

  Box reach;
  reach.include(position);
  reach.include(state.proxy);
  reach.include(state.previous_probe);
  if (!update_slots(scene, state, reach.grown(scene.probe_radius()))) tick.out.flags.set(TickFlag::contacts_dropped);
  const VolumeReading reading(scene);
  const int level = level_now(scene, state, probe, tick.out);
  // Where the new scene's surfaces have come over a resting proxy it starts from their outside.
  const Vec3 held = state.proxy;
  if (changed && state.stiffness > 0.0) state.proxy = reacquired(scene, state);
  bool moved = false;
  for (ContactState& slot : state.contacts) {
    const Instance& instance = scene.instances()[slot.instance];
    slot.law = instance.law.index();
    const IsoSurface* iso = iso_of(instance.surface);
    if (iso == nullptr) continue;
    const Pose& pose = instance.world_from_object;
    const int here = std::min(level, iso->field().levels() - 1);
    moved = update_felt(*iso, ball_level(instance, scene), instance.sides, here, dt, pose.apply_inverse(state.proxy),
                        slot) ||
            moved;
  }

  Vec3 shadow = position;
  for (ContactState& slot : state.contacts) {
    const Instance& instance = scene.instances()[slot.instance];
    if (constrains(instance.law)) continue;
    const LawForce law = added_force(instance, probe, state.previous_probe, first_tick, dt, slot, tick, state.tank);
    tick.add(slot.instance, law);
    if (law.contact) shadow = law.point;
  }
  ProxyAnswer answer = solve_proxies(scene, state, probe, held, moved);
  state.proxy = answer.proxy;
  for (ProxyAnswer::Part& part : answer.parts) {
    const Instance& instance = scene.instances()[part.instance];
    for (ContactState& slot : state.contacts) {
      if (slot.instance == part.instance)
        add_to_proxy(instance, answer.rendered_share, motion_over(instance, probe, state.previous_probe, dt), slot,
                     tick, state.tank, part);
    }
    tick.add(part.instance, part.law);
  }
  tick.out.proxy = answer.parts.empty() ? shadow : answer.felt;
  add_effects(scene, level, probe, tick.out);
  tick.out.flags.set(TickFlag::not_converged, !answer.converged);
  tick.out.flags.set(TickFlag::energy_limited, answer.energy_limited);
  state.previous_probe = position;
  return tick.out;
}

}  // namespace asperity
