#include "asperity/render/step.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "asperity/render/custom_law.h"
#include "asperity/render/detail/change.h"
#include "asperity/render/detail/coat_material.h"
#include "asperity/render/detail/iso_proxy.h"
#include "asperity/render/detail/proxy_tick.h"
#include "asperity/render/fine_contact.h"

namespace asperity {

namespace {

/// Gathers one tick's answer from the instances.
struct Tick {
  ForceSample out;
  double strongest = -1.0;
  bool limited = false;  ///< a law without a proxy gave less than it would have

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

/// How far a moving instance may carry a proxy within a tick (m).
double farthest_carried(const Scene& scene, const Vec3& proxy, Seconds dt) noexcept {
  if (!scene.moves()) return 0.0;
  double farthest = 0.0;
  for (const Instance& instance : scene.felt()) {
    const Motion& motion = instance.motion;
    if (!motion.moves()) continue;
    const double around = (proxy - instance.world_from_object.position).norm();
    farthest =
        std::max(farthest, (motion.velocity.linear.norm() + motion.velocity.angular.norm() * around) * dt.count());
  }
  return farthest;
}

/// Keeps one slot for each instance that the tick's motion can reach. False when there were too few slots.
bool update_slots(const Scene& scene, ProxyState& state, const Box& reach) noexcept {
  for (std::size_t i = state.contacts.size(); i-- > 0;) {
    const std::uint32_t instance = state.contacts[i].instance;
    // Under a thin sheet a pressed probe is far outside the sheet's own bounds, and still in contact.
    if (instance < scene.felt().size() &&
        (state.contacts[i].touching || state.contacts[i].in_touch || overlap(scene.world_bounds(instance), reach)))
      continue;
    state.contacts.swap_remove(i);
  }
  bool all = true;
  for (std::uint32_t instance = 0; instance < scene.felt().size(); ++instance) {
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
  if (const CustomLaw* custom = custom_of(instance.law))
    return custom->force(instance, material, probe, velocity, dt, slot);
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

/// Velocity of the probe over a moving instance (m/s, world).
Vec3 velocity_over(const Instance& instance, const ContactState& slot, const ProbeSample& probe) noexcept {
  if (!instance.motion.moves()) return probe.twist.linear;
  return probe.twist.linear - instance.motion.velocity_at(slot.pose, probe.pose.position, probe.time);
}

/// The probe's motion as an instance sees it.
FineMotion motion_over(const Instance& instance, const ProbeSample& probe, const Vec3& previous, Seconds dt,
                       const ContactState& slot) noexcept {
  const Pose& pose = slot.pose;
  if (instance.motion.moves()) {
    return {pose.apply_inverse(probe.pose.position) - slot.pose_before.apply_inverse(previous),
            pose.rotate_inverse(velocity_over(instance, slot, probe)), dt};
  }
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

/// Whether a law's own changes are paid for: not those of volumes, which have budgets of their own, nor what is felt as
/// printed.
bool pays(const Instance& instance) noexcept {
  if (iso_of(instance.surface) != nullptr || custom_of(instance.law) != nullptr) return false;
  if (const auto* law = std::get_if<HeightFieldLaw>(&instance.law)) return law->formulation != Formulation::literal;
  if (const auto* law = std::get_if<MesostructureLaw>(&instance.law)) return law->formulation != Formulation::literal;
  return true;
}

double potential_of(const LawForce& law, double stiffness) noexcept {
  return law.contact ? 0.5 * stiffness * law.penetration * law.penetration : 0.0;
}

/// What the surface gives or takes by moving, beside what its law holds.
void limit_drag(const ContactState& slot, const Vec3& point, EnergyTank& tank, LawForce& law) noexcept {
  if (law.friction.isZero(0.0) && law.texture.isZero(0.0)) return;
  const double share = carried_share(law.friction + law.texture, surface_motion(slot, point), tank);
  if (share >= 1.0) return;
  law.force -= (1.0 - share) * (law.friction + law.texture);
  law.friction *= share;
  law.texture *= share;
}

/// World frame.
void add_viscosity(double viscosity, const Vec3& velocity, LawForce& law) noexcept {
  if (viscosity <= 0.0 || !law.contact) return;
  law.friction -= viscosity * velocity;
  law.force -= viscosity * velocity;
}

/// A law without a proxy, in the world frame, with friction and texture. `changed`: the scene is another one.
LawForce added_force(const Instance& instance, const ProbeSample& probe, const Vec3& previous, bool first_tick,
                     bool changed, Seconds dt, ContactState& slot, Tick& tick, EnergyTank& tank) noexcept {
  const Pose& pose = slot.pose;
  const bool at_origin = pose.is_identity();
  const FineMotion motion = motion_over(instance, probe, previous, dt, slot);
  // A probe that enters within one tick was outside at the last one: ask there first.
  const IsoSurface* iso = iso_of(instance.surface);
  const bool fresh = iso != nullptr ? !slot.iso.started : !slot.seen_outside;
  const Vec3 position = at_origin ? probe.pose.position : pose.apply_inverse(probe.pose.position);
  // The contact point's laws look the material up where that is.
  const bool elsewhere = needs_potential(instance.law) && !std::holds_alternative<NormalPerturbationLaw>(instance.law);
  const Material material = elsewhere ? instance.material : local_material(instance, position, slot.hint);
  if (fresh && !first_tick) force_at(instance, material, pose.apply_inverse(previous), motion.velocity, dt, slot);
  const bool paying = pays(instance);
  if (paying && slot.counted && (changed || has_moved(slot))) {
    ContactState there = slot;
    const LawForce before = force_at(instance, material, pose.apply_inverse(previous), motion.velocity, dt, there);
    pay_for_change(potential_of(before, material.stiffness), slot, tank);
  }
  LawForce law = force_at(instance, material, position, motion.velocity, dt, slot);
  slot.touching = law.contact;
  if (paying) {
    if (!law.contact) slot.share = 1.0;
    const bool stands = !changed && !has_moved(slot);
    if (stands && law.contact && slot.counted && slot.stiffness > 0.0 && slot.stiffness != material.stiffness) {
      // A stiffer place under the same depth holds more.
      slot.potential = slot.share * potential_of(law, slot.stiffness);
      pay_for_change(potential_of(law, material.stiffness), slot, tank);
    }
    slot.stiffness = law.contact ? material.stiffness : 0.0;
    slot.potential = slot.share * potential_of(law, material.stiffness);
    slot.counted = true;
    law.force *= slot.share;
    if (slot.share < 1.0) tick.limited = true;
  }
  if (law.contact) {
    if (iso != nullptr) law.element = element_at(instance, law.point, slot);
    if (!law.damped) {
      law.push = law.force.dot(law.normal);
      // Against the hand's own motion: damping by a surface that moves would drag the hand along.
      law.force = with_damping(law.force, law.normal, pose.rotate_inverse(probe.twist.linear), material.damping);
    }
  }
  const bool adds = adds_friction(instance);
  if (instance.fine != nullptr || adds) {
    const Material felt = elsewhere ? local_material(instance, law.point, slot.hint) : material;
    if (add_fine_forces(instance, felt, adds, felt.stiffness, motion, slot, tank, law))
      tick.out.flags.set(TickFlag::texture_faded);
  }
  to_world(pose, law);
  add_viscosity(material.viscosity, velocity_over(instance, slot, probe), law);
  if (has_moved(slot)) limit_drag(slot, probe.pose.position, tank, law);
  return law;
}

/// What draws the probe to an instance, where something does. Owes what a change of the surface would add to it, and
/// rests until the tank has paid.
void add_attraction(const Instance& instance, const ProbeSample& probe, const Vec3& previous, bool changed,
                    ContactState& slot, EnergyTank& tank, ForceSample& out) noexcept {
  if (attraction_reach(instance) <= 0.0) return;
  if (slot.attraction_known && (changed || has_moved(slot))) {
    const double now = attraction_at(instance, slot.pose.apply_inverse(previous), slot.hint).potential;
    slot.debt += std::max(0.0, now - slot.attraction);
  }
  slot.debt -= tank.pay(slot.debt);
  const Attraction pull = attraction_at(instance, slot.pose.apply_inverse(probe.pose.position), slot.hint);
  slot.attraction = pull.potential;
  slot.attraction_known = true;
  if (slot.debt > 0.0 || pull.force.isZero(0.0)) return;
  out.wrench.force += slot.pose.rotate(pull.force);
  out.flags.set(TickFlag::field_force);
}

/// What friction and texture add to a proxy's answer, which is in the world frame.
void add_to_proxy(const Instance& instance, double share, const ProbeSample& probe, const Vec3& previous, Seconds dt,
                  ContactState& slot, Tick& tick, EnergyTank& tank, ProxyAnswer::Part& part) noexcept {
  LawForce& law = part.law;
  const bool adds = adds_friction(instance);
  std::optional<Material> mapped;
  if (relief_of(instance) != nullptr && has_local_material(instance))
    mapped = local_material(instance, slot.pose.apply_inverse(law.point), slot.hint);
  const Material& local = mapped ? *mapped : instance.material;
  if (local.viscosity > 0.0) add_viscosity(local.viscosity, velocity_over(instance, slot, probe), law);
  if (!adds && instance.fine == nullptr) {
    if (has_moved(slot)) limit_drag(slot, law.point, tank, law);
    if (law.contact && instance.material.static_friction > 0.0 && proxy_holds_friction(instance))
      law.friction = law.force - law.force.dot(law.normal) * law.normal;
    return;
  }
  const FineMotion motion = motion_over(instance, probe, previous, dt, slot);
  const double stiffness = share * part.stiffness;
  law.push = law.pulls ? 0.0 : stiffness * law.penetration;
  const Pose& pose = slot.pose;
  if (!pose.is_identity()) {
    law.force = pose.rotate_inverse(law.force);
    law.point = pose.apply_inverse(law.point);
    law.normal = pose.rotate_inverse(law.normal);
    if (law.bends) {
      const Mat3 turn = pose.orientation.toRotationMatrix();
      law.bend = turn.transpose() * law.bend * turn;
    }
  }
  const bool implicit = implicit_of(instance.surface) != nullptr;
  if (!pose.is_identity()) law.friction = pose.rotate_inverse(law.friction);
  const Vec3 kept = law.friction;
  law.friction = Vec3::Zero();
  const Material felt = implicit ? local_material(instance, law.point, slot.hint) : local;
  if (add_fine_forces(instance, felt, adds, stiffness, motion, slot, tank, law))
    tick.out.flags.set(TickFlag::texture_faded);
  law.friction += kept;
  to_world(pose, law);
  if (has_moved(slot)) limit_drag(slot, law.point, tank, law);
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
    if (!scene_.reads_volumes()) return;
    for (const Instance& instance : scene_.felt()) {
      if (const IsoSurface* iso = iso_of(instance.surface)) visit(iso->field());
    }
    for (const FieldEffect& effect : scene_.felt_effects()) visit(*effect.field);
  }
  const Scene& scene_;
};

/// The finest level at which all volumes are in memory around the probe; one for all of them, so that a replay can ask
/// for it. Tells their streaming threads where the probe is and goes.
int level_now(const Scene& scene, const ProxyState& state, const ProbeSample& probe, ForceSample& out) noexcept {
  if (!scene.reads_volumes()) return 0;
  int level = 0;
  const auto ask = [&](const ScalarField& field, const Pose& pose) {
    if (field.bricks() == nullptr) return;
    const Vec3& position = probe.pose.position;
    field.bricks()->look_ahead(pose.apply_inverse(position), pose.rotate_inverse(probe.twist.linear));
    const int finest = std::clamp(state.wanted_level, 0, field.levels() - 1);
    const Box reach = tick_reach(field, pose, state, position, scene.probe_radius());
    level = std::max(level, field.ready_level(reach, finest));
  };
  for (const Instance& instance : scene.felt()) {
    if (const IsoSurface* iso = iso_of(instance.surface)) ask(iso->field(), instance.world_from_object);
  }
  for (const FieldEffect& effect : scene.felt_effects()) ask(*effect.field, effect.world_from_object);
  out.flags.set(TickFlag::coarse_data, level > 0);
  out.level = static_cast<std::uint8_t>(level);
  return level;
}

/// What is felt of volumes without a surface.
void add_effects(const Scene& scene, int level, const ProbeSample& probe, ForceSample& out) noexcept {
  for (const FieldEffect& effect : scene.felt_effects()) {
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
    const Instance* instance = slot.instance < scene.felt().size() ? &scene.felt()[slot.instance] : nullptr;
    const IsoSurface* iso = instance != nullptr ? iso_of(instance->surface) : nullptr;
    const bool same_law = instance != nullptr && slot.law == instance->law.index();
    if (iso == nullptr) {
      // A proxy finds its surface again by itself. What friction and texture hold of the hand goes on.
      if (!same_law) {
        state.contacts.swap_remove(i);
        continue;
      }
      ContactState fresh;
      fresh.instance = slot.instance;
      fresh.law = slot.law;
      fresh.friction = slot.friction;
      fresh.texture = slot.texture;
      // Where it was, what it held and what it touched: a surface that goes on is found again there.
      fresh.pose = slot.pose;
      fresh.placed = slot.placed;
      fresh.in_touch = slot.in_touch;
      fresh.lineage = slot.lineage;
      fresh.anchor = slot.anchor;
      fresh.outside = slot.outside;
      fresh.side_known = slot.side_known;
      fresh.potential = slot.potential;
      fresh.share = slot.share;
      fresh.stiffness = slot.stiffness;
      fresh.counted = slot.counted;
      fresh.attraction = slot.attraction;
      fresh.attraction_known = slot.attraction_known;
      fresh.debt = slot.debt;
      fresh.seen_outside = slot.seen_outside;
      fresh.custom = slot.custom;
      fresh.hint.moment = slot.hint.moment;
      fresh.level_known = slot.level_known;
      fresh.moment_known = slot.moment_known;
      if (relief_of(*instance) != nullptr && slot.touching) {
        fresh.touching = true;
        fresh.sliding = slot.sliding;
        fresh.side = slot.side;
        fresh.point = slot.point;
        fresh.hint.relief = slot.hint.relief;
      }
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

/// Forces as the hand feels them; places stay the scene's.
void to_hand(const View& view, ForceSample& out) noexcept {
  const auto turn = [&](Vec3& force) { force = view.orientation.conjugate() * force / view.zoom; };
  turn(out.wrench.force);
  turn(out.wrench.torque);
  turn(out.parts.friction);
  turn(out.parts.texture);
}

/// Tells every slot its law, and isosurfaces where their threshold is now. True where one has moved.
bool update_laws(const Scene& scene, int level, Seconds dt, ProxyState& state) noexcept {
  bool moved = false;
  for (ContactState& slot : state.contacts) {
    const Instance& instance = scene.felt()[slot.instance];
    slot.law = instance.law.index();
    const IsoSurface* iso = scene.reads_volumes() ? iso_of(instance.surface) : nullptr;
    if (iso == nullptr) continue;
    const Pose& pose = slot.pose;
    const int here = std::min(level, iso->field().levels() - 1);
    moved = update_felt(*iso, ball_level(instance, scene), instance.sides, here, dt, pose.apply_inverse(state.proxy),
                        slot) ||
            moved;
  }
  return moved;
}

/// Adds friction and texture to what the proxies answer, and remembers where they touch.
void take_answer(const Scene& scene, const ProbeSample& probe, Seconds dt, ProxyState& state, Tick& tick,
                 ProxyAnswer& answer) noexcept {
  for (ProxyAnswer::Part& part : answer.parts) {
    const Instance& instance = scene.felt()[part.instance];
    for (ContactState& slot : state.contacts) {
      if (slot.instance == part.instance)
        add_to_proxy(instance, answer.rendered_share, probe, state.previous_probe, dt, slot, tick, state.tank, part);
    }
    tick.add(part.instance, part.law);
    for (ContactState& slot : state.contacts) {
      if (slot.instance != part.instance) continue;
      slot.in_touch = part.law.contact;
      remember_anchor(instance, part.law.point, part.law.contact ? part.law.element : no_index, answer.proxy, slot);
    }
  }
}

bool finite(const ProbeSample& probe) noexcept {
  // No device is a thousand kilometres away: such a number is as broken as a NaN, and would leave the searches' range.
  constexpr double farthest = 1e6;
  const Vec3& place = probe.pose.position;
  if (!(std::abs(place.x()) < farthest && std::abs(place.y()) < farthest && std::abs(place.z()) < farthest))
    return false;
  // 0 times a number is 0; times an infinity or no number it is none.
  return (0.0 * probe.pose.orientation.coeffs()).sum() + (0.0 * probe.twist.linear).sum() +
             (0.0 * probe.twist.angular).sum() + 0.0 * probe.time.count() ==
         0.0;
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
  for (const Instance& instance : scene.felt()) {
    if (const IsoSurface* iso = iso_of(instance.surface))
      ASPERITY_CHECK(fetch(iso->field(), instance.world_from_object));
  }
  for (const FieldEffect& effect : scene.felt_effects()) ASPERITY_CHECK(fetch(*effect.field, effect.world_from_object));
  return success();
}

ForceSample step(const Scene& scene, ProxyState& state, const ProbeSample& sample, Seconds dt) noexcept {
  Tick tick;
  if (!finite(sample)) {
    tick.out.flags.set(TickFlag::input_not_finite);
    tick.out.proxy = state.proxy;
    return tick.out;
  }
  const View& view = scene.settings().view;
  const bool direct = view.identity();
  const ProbeSample probe = direct ? sample : in_scene(view, sample);
  const Vec3& position = probe.pose.position;
  const bool first_tick = state.epoch == 0;
  if (first_tick) {
    state.proxy = state.previous_probe = position;
    state.workspace_probe = sample.pose.position;
    state.view = view;
  }
  const bool changed = state.epoch != scene.epoch();
  Vec3 held = state.proxy;
  if (changed && !first_tick) adopt_view(view, state, sample, held);
  if (changed) forget_contacts(scene, state);
  state.epoch = scene.epoch();

  Box reach;
  reach.include(position);
  reach.include(state.proxy);
  reach.include(state.previous_probe);
  const double carried = farthest_carried(scene, state.proxy, dt);
  if (!update_slots(scene, state, reach.grown(scene.probe_radius() + carried)))
    tick.out.flags.set(TickFlag::contacts_dropped);
  const VolumeReading reading(scene);
  const int level = level_now(scene, state, probe, tick.out);
  if (scene.settings().change_power > 0.0) state.tank.fill(scene.settings().change_power * dt.count());
  bool moved = follow_surfaces(scene, state, probe, dt, changed);
  // Where the new scene's surfaces have come over a resting proxy it starts from their outside.
  if (changed && state.stiffness > 0.0) state.proxy = reacquired(scene, state);
  moved = update_laws(scene, level, dt, state) || moved;

  Vec3 shadow = position;
  for (ContactState& slot : state.contacts) {
    const Instance& instance = scene.felt()[slot.instance];
    if (constrains(instance.law)) continue;
    const LawForce law =
        added_force(instance, probe, state.previous_probe, first_tick, changed, dt, slot, tick, state.tank);
    tick.add(slot.instance, law);
    if (law.contact) shadow = law.point;
  }
  ProxyAnswer answer = solve_proxies(scene, state, probe, held, moved);
  state.proxy = answer.proxy;
  take_answer(scene, probe, dt, state, tick, answer);
  tick.out.proxy = answer.parts.empty() ? shadow : answer.felt;
  for (ContactState& slot : state.contacts)
    add_attraction(scene.felt()[slot.instance], probe, state.previous_probe, changed, slot, state.tank, tick.out);
  add_effects(scene, level, probe, tick.out);
  const bool handover = changed && !first_tick;
  tick.out.wrench.force = handed_over(scene, state, tick.out.wrench.force, position, dt, handover);
  state.force = tick.out.wrench.force;
  tick.out.flags.set(TickFlag::not_converged, !answer.converged);
  tick.out.flags.set(TickFlag::energy_limited, answer.energy_limited || tick.limited);
  remember_places(scene, state, position, changed);
  state.previous_probe = position;
  state.workspace_probe = sample.pose.position;
  if (!direct) to_hand(view, tick.out);
  return tick.out;
}

}  // namespace asperity
