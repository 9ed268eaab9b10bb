// What changes of a scene do to a proxy in it: surfaces that move, deform, change their coat, their level of detail or
// their threshold.

#include <algorithm>
#include <cmath>

#include "asperity/render/contact/joint.h"
#include "asperity/render/contact/level.h"
#include "asperity/render/stages/tick.h"

namespace asperity {

namespace {

bool same_pose(const Pose& a, const Pose& b) noexcept {
  return a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs();
}

/// Whether the proxy is held by the triangles of the instance's own mesh, which keep their numbers when it deforms.
bool on_own_triangles(const Touched& touch) noexcept {
  return touch.facts->constrains && !touch.facts->smooth && !touch.facts->by_planes &&
         base_of(touch.instance->surface) != nullptr;
}

/// The face that is touched, or the nearest where that is not known: a law without a proxy keeps no place.
std::uint32_t face_under(const Tick& tick, const Touched& touch, const ReliefSurface& relief) noexcept {
  const std::uint32_t face = touch.contact->first().element;
  if (face < relief.base().mesh().triangles().size()) return face;
  const Foot nearest = relief.base().view(*touch.cache).nearest(touch.to_local(tick.probe->pose.position), infinity);
  return nearest.found() ? nearest.element : 0;
}

/// The level that the probe, its speed and the view ask for around a place of the coat.
double wanted_level(const Tick& tick, const Touched& touch, const ReliefSurface& relief,
                    const CoatMoment& last) noexcept {
  const DetailPyramid* detail = relief.coat().maps().detail();
  const SceneSettings& settings = tick.scene.settings();
  const CoatFrame frame = relief.view(*touch.cache, last).frame(face_under(tick, touch, relief)).coat;
  double scale = 0.0;
  if (detail->kind() == DetailKind::dilation) {
    scale = settings.tip_radius / settings.view.zoom;
  } else {
    // Eight samples a wavelength (formulation, D5).
    constexpr double samples = 8.0;
    scale = samples * tick.probe->twist.linear.norm() * tick.dt.count();
  }
  const double pixel = settings.view.pixel_at(tick.state.proxy);
  // Two pixels show a wavelength, one shows a height.
  if (detail->kind() == DetailKind::low_pass) scale = std::max(scale, 2.0 * pixel);
  return relief.coat().level_for(frame, scale, pixel);
}

/// Which of its coat's states a contact feels.
void choose_moment(const Tick& tick, Touched& touch) noexcept {
  const ReliefSurface* relief = relief_of(*touch.instance);
  const Coat& coat = relief->coat();
  Contact& contact = *touch.contact;
  const CoatMoment last{contact.detail_level.value_or(0.0), coat.moves() ? tick.state.previous_time.count() : 0.0};
  if (coat.moves()) touch.moment.time = tick.probe->time.count();
  if (coat.levels() > 0) {
    const double wanted = wanted_level(tick, touch, *relief, last);
    const double most = tick.scene.settings().level_rate * tick.dt.count();
    touch.moment.level = contact.detail_level ? std::clamp(wanted, last.level - most, last.level + most) : wanted;
  }
  touch.moved = touch.moved || (contact.detail_level.has_value() && !(touch.moment == last));
  contact.detail_level = touch.moment.level;
}

/// The place of a relief that the proxy rested on, where it is now. False where it is not known.
bool carry_on_relief(const ReliefSurface& relief, Touched& touch, Vec3& proxy) noexcept {
  OfSurface& state = touch.contact->surface;
  if (!state.rests && touch.contact->first().known()) {
    // Held by the bare mesh until now: over the same place.
    Place& place = state.places[0];
    place.at[1] = std::clamp(place.at[1], 0.0, 1.0);
    place.at[2] = std::clamp(place.at[2], 0.0, 1.0 - place.at[1]);
    place.back = state.height < 0.0;
    state.rests = true;
  }
  if (!state.rests) return false;
  proxy = touch.pose->apply(relief.view(*touch.cache, touch.moment).at(state.places[0]).point);
  return true;
}

/// The same on triangles.
bool carry_on_mesh(const MeshSurface& mesh, const Touched& touch, Vec3& proxy) noexcept {
  const Place place = touch.contact->first();
  if (place.element >= mesh.mesh().triangles().size()) return false;
  const auto [a, b, c] = mesh.mesh().corners(place.element);
  const Vec3 base = a + place.at[1] * (b - a) + place.at[2] * (c - a);
  proxy = touch.pose->apply(base + touch.contact->surface.height * mesh.mesh().face_normal(place.element));
  return true;
}

/// Whether p (object frame) is on the front of a surface that changes.
bool in_front(const Touched& touch, const Vec3& p) noexcept {
  if (iso_of(touch.instance->surface) != nullptr || custom_of(touch.instance->surface) != nullptr) return true;
  return on_view(felt_view(touch), [&](const auto& view) { return view.eval(p).value >= 0.0; });
}

/// Beside the rim of an open mesh front and back are not told apart.
bool beside_rim(const Touched& touch, const Vec3& p) noexcept {
  const MeshSurface* mesh = base_of(touch.instance->surface);
  if (mesh == nullptr || mesh->mesh().report().closed()) return false;
  const Foot foot = mesh->view(*touch.cache).nearest(p, infinity);
  return !foot.found() || beyond_rim(mesh->mesh(), foot, p, mesh->skin());
}

/// The share of a motion (world) up to what an instance stops.
double free_share(const Tick& tick, const Touched& touch, const Segment& motion) noexcept {
  const Instance& instance = *touch.instance;
  if (iso_of(instance.surface) != nullptr || touch.facts->facets) return 1.0;
  const Segment local{touch.pose->apply_inverse(motion.from), touch.pose->apply_inverse(motion.to)};
  const FeltView view = felt_view(touch);
  if (const auto* mesh = std::get_if<TriangleView>(&view))
    return mesh->sweep(local, tick.scene.probe_radius(), touch.facts->sides).t;
  return on_smooth_view(view, [&](const auto& smooth) { return smooth.first_touch(local, touch.facts->sides); }).t;
}

/// A proxy that is carried from one place to another stops at what else is there.
Vec3 past_others(const Tick& tick, const Touched& mover, const Vec3& from, const Vec3& to) noexcept {
  const Vec3 way = to - from;
  const double length = way.norm();
  if (!(length > 0.0)) return to;
  double share = 1.0;
  for (const Touched& touch : tick.touches) {
    if (&touch != &mover && touch.facts->constrains) share = std::min(share, free_share(tick, touch, {from, to}));
  }
  if (share >= 1.0) return to;
  // A little before it: the solve then meets it from outside.
  constexpr double short_of = 1e-7;
  return from + std::max(0.0, share - short_of / length) * way;
}

/// The place on the front (or the back) of a surface nearest to a proxy (world) that it has come over; the proxy where
/// that is there already.
Vec3 pushed_to_front(const Tick& tick, const Touched& touch, bool front_side, const Vec3& proxy) noexcept {
  const Instance& instance = *touch.instance;
  const Vec3 local = touch.pose->apply_inverse(proxy);
  const double radius = tick.scene.probe_radius();
  double off = 0.0;
  double least = 0.0;
  Vec3 front = Vec3::Zero();
  Foot foot;
  if (const IsoSurface* iso = iso_of(instance.surface)) {
    // A point in touch moves with its isosurface (felt_level); here is one that the scene newly has.
    if (touch.contact->surface.identity != 0) return proxy;
    const double level = ball_level(instance, tick.scene);
    const IsoView view = iso->view(touch.cache->cells, 0, iso->threshold_at(tick.probe->time) + level);
    FieldJet jet;
    // A proxy that rested on the last scene's surface lies on this one's, or on either side of it by rounding.
    least = 2.0 * view.skin();
    if (!view.sample(local, jet)) return proxy;
    if (view.sigma * (jet.value - view.threshold) >= least * jet.gradient.norm()) return proxy;
    foot = view.nearest(local, infinity);
    if (!foot.found()) return proxy;
    front = view.front(foot);
    off = 2.0 * least + (level > 0.0 ? 0.0 : radius);
  } else if (touch.facts->facets) {
    GeneratedPatch patch;
    patch.start(*relief_of(instance), instance.law.facets());
    foot = patch.nearest(local, *touch.cache);
    if (!foot.found()) return proxy;
    front = foot.normal;
    off = patch.skin() + radius;
  } else {
    on_view(felt_view(touch), [&](const auto& view) {
      foot = view.nearest(local, infinity, touch.contact->first());
      if (foot.found()) front = view.front(foot);
      off = view.skin() + radius;
    });
    if (!foot.found()) return proxy;
  }
  if (!front_side) front = -front;
  if ((local - foot.point).dot(front) >= least) return proxy;
  return touch.pose->apply(foot.point + off * front);
}

/// Where every instance is now and which state of its coat is felt. True where one has changed since the last tick.
bool place_instances(Tick& tick) noexcept {
  bool any = false;
  for (Touched& touch : tick.touches) {
    const Instance& instance = *touch.instance;
    Contact& contact = *touch.contact;
    // What stood still at the last tick, and cannot move by itself, stands where it did.
    const bool stands = !tick.changed && !contact.moved && contact.placed && !touch.facts->moves;
    touch.pose = touch.before = &contact.pose;
    if (!stands) {
      const Pose now = instance.motion.at(instance.world_from_object, tick.probe->time);
      Pose* before = tick.earlier.emplace_back();
      *before = contact.placed ? contact.pose : now;
      touch.before = before;
      contact.pose = now;
      contact.placed = true;
      touch.moved = !same_pose(now, *before);
    }
    touch.at_origin = touch.facts->at_origin || (touch.facts->moves && touch.pose->is_identity());
    if (touch.facts->moment) choose_moment(tick, touch);
    contact.moved = touch.moved;
    any = any || touch.moved;
  }
  return any;
}

/// Takes the proxy along with what it touches or is overtaken by (`overtaken`). True where something has changed under
/// it.
bool follow_surfaces(Tick& tick, bool& overtaken) noexcept {
  ProxyState& state = tick.state;
  bool any = place_instances(tick);
  if (!any && !tick.changed) return false;
  const Touched* mover = nullptr;
  Vec3 proxy = state.proxy;
  for (Touched& touch : tick.touches) {
    const Instance& instance = *touch.instance;
    if (!touch.facts->constrains || (!touch.moved && !tick.changed)) continue;
    OfSurface& surface = touch.contact->surface;
    const bool same = surface.identity == touch.facts->identity;
    const bool other_pose = !same_pose(*touch.pose, *touch.before);
    bool carried = false;
    if (const ReliefSurface* relief = relief_of(instance);
        same && relief != nullptr && touch.facts->smooth && tick.scene.probe_radius() == 0.0) {
      carried = carry_on_relief(*relief, touch, proxy);
    } else if (same && on_own_triangles(touch)) {
      carried = carry_on_mesh(*constraint_mesh(instance), touch, proxy);
      // A fold may have closed over it.
      if (carried) proxy = pushed_to_front(tick, touch, surface.height >= 0.0, proxy);
    }
    if (!carried && other_pose && mover == nullptr) {
      proxy = touch.pose->apply(touch.before->apply_inverse(state.proxy));
      carried = true;
    }
    if (!carried || mover != nullptr) continue;
    mover = &touch;
    state.proxy = past_others(tick, touch, state.proxy, proxy);
    if (state.proxy == proxy) continue;
    // Between two surfaces: on the front of the one that moved, as near to where it would be as the other lets it.
    surface.rests = false;
    if (touch.contact->outside) state.proxy = pushed_to_front(tick, touch, *touch.contact->outside, state.proxy);
  }
  overtaken = mover != nullptr;
  for (Touched& touch : tick.touches) {
    const std::optional<bool>& outside = touch.contact->outside;
    if (!touch.facts->constrains || &touch == mover || !outside || !(touch.moved || tick.changed)) continue;
    if (touch.facts->sides == Sides::front && !*outside) continue;
    const Vec3 local = touch.pose->apply_inverse(state.proxy);
    if (in_front(touch, local) == *outside || beside_rim(touch, local)) continue;
    state.proxy = pushed_to_front(tick, touch, *outside, state.proxy);
    touch.contact->surface.rests = false;
    overtaken = any = true;
  }
  return any;
}

}  // namespace

void carry(Tick& tick) noexcept {
  ProxyState& state = tick.state;
  const SceneSettings& settings = tick.scene.settings();
  if (settings.change_power > 0.0) state.account.fill(settings.change_power * tick.dt.count());
  bool overtaken = false;
  tick.surfaces_moved = follow_surfaces(tick, overtaken);
  // Where the new scene's surfaces have come over a resting proxy it starts from their outside.
  if (tick.changed && (overtaken || state.spring.stiffness > 0.0F)) {
    for (const Touched& touch : tick.touches) {
      if (touch.facts->sides == Sides::front && touch.facts->constrains && !touch.contact->surface.rests)
        state.proxy = pushed_to_front(tick, touch, true, state.proxy);
    }
  }
  for (Touched& touch : tick.touches) {
    Contact& contact = *touch.contact;
    const Instance& instance = *touch.instance;
    contact.law.kind = &instance.law.kind();
    if (touch.facts->volume) {
      const IsoSurface* iso = iso_of(instance.surface);
      const int level = std::min(tick.level, iso->field().levels() - 1);
      const double target = iso->threshold_at(tick.probe->time) + ball_level(instance, tick.scene);
      if (felt_level(*iso, target, touch.facts->sides, level, tick.dt, touch.to_local(state.proxy), *touch.cache,
                     contact.surface))
        tick.surfaces_moved = true;
    } else if (tick.changed || contact.surface.identity == 0) {
      if (contact.surface.identity != touch.facts->identity) contact.surface = {};
      contact.surface.identity = touch.facts->identity;
    }
    touch.view = felt_view(touch);
  }
}

/// After the solve: on which side of a changing surface the probe is.
void remember_sides(Tick& tick) noexcept {
  for (Touched& touch : tick.touches) {
    Contact& contact = *touch.contact;
    if (!touch.facts->changes) continue;
    // A proxy that is held rests a skin above the side that it is held on.
    contact.outside =
        in_front(touch, touch.pose->apply_inverse(contact.touching ? tick.state.proxy : tick.probe->pose.position));
  }
}

}  // namespace asperity
