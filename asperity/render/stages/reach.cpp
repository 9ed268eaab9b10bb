#include <algorithm>

#include "asperity/render/stages/tick.h"
#include "asperity/render/stages/volumes.h"

namespace asperity {

namespace {

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

/// The instances that a motion can reach, nearest first as far as there is room.
class Reached {
 public:
  Reached(const Scene& scene, const ProxyState& state, const Vec3& probe) noexcept
      : scene_(scene),
        state_(state),
        probe_(probe),
        touched_(scene.probe_radius() + 0.5 * (state.proxy - probe).norm()) {}

  /// What is touched comes first.
  void visit(std::uint32_t instance, bool touching) noexcept {
    ++met_;
    if (met_ <= most_contacts) {
      near_.push_back({instance, touching ? -1.0 : 0.0});
      return;
    }
    // Only now does it matter how near they are.
    if (met_ == most_contacts + 1) {
      for (Near& one : near_) one.distance = one.distance < 0.0 ? -1.0 : distance(one.instance, infinity);
    }
    Near* farthest = &near_[0];
    for (Near& one : near_) farthest = one.distance > farthest->distance ? &one : farthest;
    const double there = distance(instance, std::max(farthest->distance, touched_));
    nearest_left_ = std::min(nearest_left_, std::max(farthest->distance, there));
    if (there < farthest->distance) *farthest = {instance, there};
    farthest_ = 0.0;
    for (const Near& one : near_) farthest_ = std::max(farthest_, one.distance);
  }
  /// Whether anything in a box may be nearer than what there is room for, or be touched.
  [[nodiscard]] bool matters(const Box& box) const noexcept { return distance(box) <= std::max(farthest_, touched_); }
  template <class Visit>
  void for_each(Visit&& visit) const noexcept {
    for (const Near& one : near_) visit(one.instance);
  }
  /// Whether there was room for all that the tip may touch on its way.
  [[nodiscard]] bool all() const noexcept { return nearest_left_ > touched_; }
  [[nodiscard]] bool holds(std::uint32_t instance) const noexcept {
    return std::any_of(near_.begin(), near_.end(), [&](const Near& one) { return one.instance == instance; });
  }

 private:
  struct Near {
    std::uint32_t instance;
    double distance;
  };
  [[nodiscard]] double distance(const Box& box) const noexcept {
    return std::min(box.distance(state_.proxy), box.distance(probe_));
  }
  /// Of the motion's ends from the surface, or as near as its bounds tell (m); infinity may stand for more than
  /// `bound`.
  [[nodiscard]] double distance(std::uint32_t instance, double bound) const noexcept {
    const double off = distance(scene_.world_bounds(instance));
    const Instance& one = scene_.felt()[instance];
    const MeshSurface* base = base_of(one.surface);
    if (!(off < bound) || base == nullptr || one.motion.moves()) return off;
    const ReliefSurface* relief = relief_of(one);
    const double coat = relief == nullptr ? 0.0 : relief->reach();
    double least = infinity;
    for (const Vec3& p : {state_.proxy, probe_}) {
      const Foot foot = base->index().closest(one.world_from_object.apply_inverse(p), std::min(least, bound + coat));
      if (foot.found()) least = foot.distance;
    }
    return std::max(off, least - coat);
  }

  const Scene& scene_;
  const ProxyState& state_;
  const Vec3& probe_;
  double touched_;  ///< m: how far off the motion's ends what it may touch can be
  FixedVector<Near, most_contacts> near_;
  std::size_t met_ = 0;
  double farthest_ = infinity;      ///< m: of those, once there is room for no more
  double nearest_left_ = infinity;  ///< m: of those without room
};

const Contact* contact_of(const ProxyState& state, std::uint32_t instance) noexcept {
  for (const Contact& contact : state.contacts) {
    if (contact.instance == instance) return &contact;
  }
  return nullptr;
}

/// Keeps one contact for each instance that the tick's motion can reach. False when there were too few.
bool keep_contacts(const Scene& scene, ProxyState& state, const Vec3& probe, const Box& around) noexcept {
  // Mostly they are those of the last tick.
  std::size_t met = 0;
  std::size_t known = 0;
  const auto count = [&](std::uint32_t instance) {
    ++met;
    known += contact_of(state, instance) != nullptr ? 1U : 0U;
  };
  scene.for_each_in_box(around, count, [&](const Box&) { return met == known; });
  if (met == known && known == state.contacts.size()) return true;
  Reached reached(scene, state, probe);
  // Under a thin sheet a pressed probe is far outside the sheet's own bounds, and still in contact.
  for (const Contact& contact : state.contacts) {
    if (contact.touching) reached.visit(contact.instance, true);
  }
  const auto visit = [&](std::uint32_t instance) {
    const Contact* contact = contact_of(state, instance);
    if (contact == nullptr || !contact->touching) reached.visit(instance, false);
  };
  scene.for_each_in_box(around, visit, [&](const Box& box) { return reached.matters(box); });
  for (std::size_t i = state.contacts.size(); i-- > 0;) {
    if (!reached.holds(state.contacts[i].instance)) let_go(state, i);
  }
  reached.for_each([&](std::uint32_t instance) {
    if (contact_of(state, instance) == nullptr) state.contacts.emplace_back()->instance = instance;
  });
  return reached.all();
}

/// The finest level at which all volumes are in memory around the probe; one for all of them, so that a replay can ask
/// for it. Tells their streaming threads where the probe is and goes.
int level_now(const Tick& tick) noexcept {
  int level = 0;
  for_each_volume(tick.scene, [&](const ScalarField& field, const Pose& pose) {
    if (field.bricks() == nullptr) return;
    const Vec3& position = tick.probe->pose.position;
    field.bricks()->look_ahead(pose.apply_inverse(position), pose.rotate_inverse(tick.probe->twist.linear));
    const Box box = tick_reach(field, pose, tick.state, position, tick.scene.probe_radius());
    level = std::max(level, field.ready_level(box, tick.state.wanted_level));
  });
  return level;
}

}  // namespace

void reach(Tick& tick) noexcept {
  const Scene& scene = tick.scene;
  ProxyState& state = tick.state;
  const Vec3& position = tick.probe->pose.position;
  // The proxy may go wherever it is no farther from the probe than it was.
  Box around = Box{position, position}.grown((state.proxy - position).norm());
  around.include(state.previous_probe);
  around = around.grown(scene.probe_radius() + farthest_carried(scene, state.proxy, tick.dt));
  if (!keep_contacts(scene, state, position, around)) tick.out.flags.set(TickFlag::contacts_dropped);
  for (Contact& contact : state.contacts) {
    Touched& touch = *tick.touches.emplace_back();
    touch.instance = &scene.felt()[contact.instance];
    touch.facts = &scene.facts(contact.instance);
    touch.contact = &contact;
    touch.cache = &tick.cache.of(contact.instance);
  }
  if (!scene.reads_bricks()) return;
  tick.level = level_now(tick);
  tick.out.flags.set(TickFlag::coarse_data, tick.level > 0);
  tick.out.level = static_cast<std::uint8_t>(tick.level);
}

}  // namespace asperity
