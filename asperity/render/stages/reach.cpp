#include <algorithm>

#include "asperity/render/stages/tick.h"
#include "asperity/render/stages/volumes.h"

namespace asperity {

namespace {

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

/// Keeps one contact for each instance that the tick's motion can reach. False when there were too few.
bool keep_contacts(const Scene& scene, ProxyState& state, const Box& around) noexcept {
  for (std::size_t i = state.contacts.size(); i-- > 0;) {
    const Contact& contact = state.contacts[i];
    // Under a thin sheet a pressed probe is far outside the sheet's own bounds, and still in contact.
    if (!contact.touching && !overlap(scene.world_bounds(contact.instance), around)) state.contacts.swap_remove(i);
  }
  bool all = true;
  for (std::uint32_t instance = 0; instance < scene.felt().size(); ++instance) {
    if (!overlap(scene.world_bounds(instance), around)) continue;
    bool held = false;
    for (const Contact& contact : state.contacts) held = held || contact.instance == instance;
    if (held) continue;
    if (Contact* contact = state.contacts.emplace_back()) {
      contact->instance = instance;
    } else {
      all = false;
    }
  }
  return all;
}

/// The finest level at which all volumes are in memory around the probe; one for all of them, so that a replay can ask
/// for it. Tells their streaming threads where the probe is and goes.
int level_now(const Tick& tick) noexcept {
  int level = 0;
  for_each_volume(tick.scene, [&](const ScalarField& field, const Pose& pose) {
    if (field.bricks() == nullptr) return;
    const Vec3& position = tick.probe.pose.position;
    field.bricks()->look_ahead(pose.apply_inverse(position), pose.rotate_inverse(tick.probe.twist.linear));
    const int finest = std::clamp(tick.state.wanted_level, 0, field.levels() - 1);
    const Box box = tick_reach(field, pose, tick.state, position, tick.scene.probe_radius());
    level = std::max(level, field.ready_level(box, finest));
  });
  return level;
}

}  // namespace

void reach(Tick& tick) noexcept {
  const Scene& scene = tick.scene;
  ProxyState& state = tick.state;
  const Vec3& position = tick.probe.pose.position;
  // The proxy may go wherever it is no farther from the probe than it was.
  Box around;
  around.include(position);
  around = around.grown((state.proxy - position).norm());
  around.include(state.previous_probe);
  around = around.grown(scene.probe_radius() + farthest_carried(scene, state.proxy, tick.dt));
  if (!keep_contacts(scene, state, around)) tick.out.flags.set(TickFlag::contacts_dropped);
  for (Contact& contact : state.contacts) {
    tick.touches.push_back(
        {&scene.felt()[contact.instance], &scene.facts(contact.instance), &contact, &tick.cache.of(contact.instance)});
  }
  if (!scene.reads_volumes()) return;
  tick.level = level_now(tick);
  tick.out.flags.set(TickFlag::coarse_data, tick.level > 0);
  tick.out.level = static_cast<std::uint8_t>(tick.level);
}

}  // namespace asperity
