#include "asperity/render/detail/change.h"

#include <algorithm>
#include <cmath>

#include "asperity/render/detail/constraint_geometry.h"
#include "asperity/render/detail/proxy_tick.h"
#include "asperity/render/detail/smooth_surface.h"

namespace asperity {

namespace {

bool same_pose(const Pose& a, const Pose& b) noexcept {
  return a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs();
}

/// Whether the surface is felt as it is displaced by its coat at the moment.
bool feels_moment(const Instance& instance) noexcept {
  return std::holds_alternative<ProxyLaw>(instance.law) || std::holds_alternative<HeightFieldLaw>(instance.law) ||
         std::holds_alternative<MesostructureLaw>(instance.law);
}

/// The mesh that the contact's face and corners are of, where the proxy is held by triangles.
const MeshSurface* anchored_mesh(const Instance& instance) noexcept {
  if (!constrains(instance.law) || std::holds_alternative<DenseMeshLaw>(instance.law) ||
      iso_of(instance.surface) != nullptr)
    return nullptr;
  const bool displaced = relief_of(instance) != nullptr && std::holds_alternative<ProxyLaw>(instance.law);
  return displaced ? nullptr : constraint_mesh(instance);
}

std::uint64_t lineage_of(const Instance& instance) noexcept {
  const MeshSurface* base = base_of(instance.surface);
  return base != nullptr && iso_of(instance.surface) == nullptr ? base->index().lineage() : 0;
}

/// The level that the probe, its speed and the view ask for around a place of the coat.
double wanted_level(const Scene& scene, const ReliefSurface& relief, const ContactState& slot, const ProbeSample& probe,
                    Seconds dt, const Vec3& proxy) noexcept {
  const DetailPyramid* detail = relief.coat().maps().detail();
  const SceneSettings& settings = scene.settings();
  const ReliefPlace& place = slot.hint.relief;
  const bool known = relief.holds(place.frame, place.frame.face, place.frame.coat.moment);
  const CoatFrame frame = known ? place.frame.coat : relief.coat().frame(relief.base().mesh(), 0);
  double scale = 0.0;
  if (detail->kind() == DetailKind::dilation) {
    scale = settings.tip_radius / settings.view.zoom;
  } else {
    // Eight samples a wavelength (formulation, D5).
    constexpr double samples = 8.0;
    scale = samples * probe.twist.linear.norm() * dt.count();
  }
  const double pixel = settings.view.pixel_at(proxy);
  // Two pixels show a wavelength, one shows a height.
  if (detail->kind() == DetailKind::low_pass) scale = std::max(scale, 2.0 * pixel);
  return relief.coat().level_for(frame, scale, pixel);
}

/// Which of its coat's states a contact feels.
void choose_moment(const Scene& scene, const Instance& instance, const ProbeSample& probe, Seconds dt,
                   const Vec3& proxy, ContactState& slot) noexcept {
  const ReliefSurface* relief = relief_of(instance);
  if (relief == nullptr || !feels_moment(instance)) return;
  const Coat& coat = relief->coat();
  CoatMoment moment = slot.hint.moment;
  if (coat.moves()) moment.time = probe.time.count();
  if (coat.levels() > 0) {
    const double wanted = wanted_level(scene, *relief, slot, probe, dt, proxy);
    const double most = scene.settings().level_rate * dt.count();
    moment.level = slot.level_known ? std::clamp(wanted, moment.level - most, moment.level + most) : wanted;
    slot.level_known = true;
  }
  slot.moment_changed = !(moment == slot.hint.moment) && slot.moment_known;
  slot.moment_known = true;
  slot.hint.moment = moment;
}

/// Works out where an anchor on triangles is on its face.
void settle(SurfaceAnchor& anchor) noexcept {
  if (!anchor.raw) return;
  anchor.raw = false;
  const BarycentricFrame frame = barycentric_frame(anchor.corners[0], anchor.corners[1], anchor.corners[2]);
  const Vec3 place = frame.coordinates(anchor.point);
  anchor.u = place[1];
  anchor.v = place[2];
  anchor.height = frame.height(anchor.proxy);
}

/// The place of a relief that the proxy rested on, where it is now. False where it is not known.
bool carry_on_relief(const Instance& instance, const ReliefSurface& relief, ContactState& slot, Vec3& proxy) noexcept {
  ReliefPlace& place = slot.hint.relief;
  if (!slot.touching && slot.anchor.face != no_index && slot.lineage != 0 && slot.lineage == lineage_of(instance)) {
    // Held by the bare mesh until now: over the same place.
    place.frame.face = slot.anchor.face;
    place.u = std::clamp(slot.anchor.u, 0.0, 1.0);
    place.v = std::clamp(slot.anchor.v, 0.0, 1.0 - place.u);
    slot.side = slot.anchor.height >= 0.0 ? 1.0 : -1.0;
    slot.touching = true;
    place.frame.owner = 0;
  }
  if (!slot.touching || place.frame.face >= relief.base().mesh().triangles().size()) return false;
  const bool same = relief.holds(place.frame, place.frame.face, slot.hint.moment);
  if (same && same_pose(slot.pose, slot.pose_before)) return false;
  if (!same) {
    if (slot.lineage == 0 || slot.lineage != lineage_of(instance)) {
      // Another surface: what was held is not a place of it.
      slot.touching = false;
      return false;
    }
    place.frame = relief.frame(place.frame.face, slot.hint.moment);
    slot.point = relief.point(place.frame, place.u, place.v);
  }
  proxy = slot.pose.apply(slot.point.position);
  return true;
}

/// The same on triangles.
bool carry_on_mesh(const Instance& instance, const MeshSurface& mesh, const ContactState& slot, Vec3& proxy) noexcept {
  const SurfaceAnchor& anchor = slot.anchor;
  if (anchor.face == no_index || slot.lineage != lineage_of(instance) || anchor.face >= mesh.mesh().triangles().size())
    return false;
  const auto [a, b, c] = mesh.mesh().corners(anchor.face);
  const Vec3 base = a + anchor.u * (b - a) + anchor.v * (c - a);
  proxy = slot.pose.apply(base + anchor.height * mesh.mesh().face_normal(anchor.face));
  return true;
}

/// Whether p (object frame) is on the front of the surface.
bool in_front(const Instance& instance, const Vec3& p, Hint& hint) noexcept {
  if (const ReliefSurface* relief = relief_of(instance); relief != nullptr && feels_moment(instance))
    return relief->eval(p, hint).value >= 0.0;
  if (const MeshSurface* mesh = base_of(instance.surface)) return mesh->eval(p, hint).value >= 0.0;
  if (const ParametricSurface* parametric = parametric_of(instance.surface))
    return parametric->eval(p, hint).value >= 0.0;
  return true;
}

/// Beside the rim of an open mesh front and back are not told apart.
bool beside_rim(const Instance& instance, const Vec3& p, Hint& hint) noexcept {
  const MeshSurface* mesh = base_of(instance.surface);
  if (mesh == nullptr || mesh->mesh().report().closed()) return false;
  const Foot foot = mesh->closest(p, infinity, hint);
  return !foot.found() || beyond_rim(mesh->mesh(), foot, p, mesh->skin());
}

bool changes(const Instance& instance) noexcept {
  const ReliefSurface* relief = relief_of(instance);
  const MeshSurface* base = iso_of(instance.surface) == nullptr ? base_of(instance.surface) : nullptr;
  if (base != nullptr && base->index().identity() != base->index().lineage()) return true;
  return instance.motion.moves() ||
         (relief != nullptr && feels_moment(instance) && (relief->coat().moves() || relief->coat().levels() > 0));
}

/// The share of a motion (world) up to what an instance stops.
double free_share(const Scene& scene, const Instance& instance, ContactState& slot, const Segment& motion) noexcept {
  const Segment local{slot.pose.apply_inverse(motion.from), slot.pose.apply_inverse(motion.to)};
  const SmoothSurface smooth(instance, slot);
  Hint scratch;
  scratch.moment = slot.hint.moment;
  if (smooth) {
    if (iso_of(instance.surface) != nullptr) return 1.0;
    return smooth.segment(local, instance.sides, scratch).t;
  }
  const MeshSurface* mesh = constraint_mesh(instance);
  return mesh != nullptr ? mesh->segment(local, scene.probe_radius(), instance.sides, scratch).t : 1.0;
}

/// A proxy that is carried from one place to another stops at what else is there.
Vec3 past_others(const Scene& scene, ProxyState& state, const ContactState& mover, const Vec3& from,
                 const Vec3& to) noexcept {
  const Vec3 way = to - from;
  const double length = way.norm();
  if (!(length > 0.0)) return to;
  double share = 1.0;
  for (ContactState& slot : state.contacts) {
    const Instance& instance = scene.felt()[slot.instance];
    if (&slot == &mover || !constrains(instance.law)) continue;
    share = std::min(share, free_share(scene, instance, slot, {from, to}));
  }
  if (share >= 1.0) return to;
  // A little before it: the solve then meets it from outside.
  constexpr double short_of = 1e-7;
  return from + std::max(0.0, share - short_of / length) * way;
}

}  // namespace

ProbeSample in_scene(const View& view, const ProbeSample& probe) noexcept {
  ProbeSample out = probe;
  out.pose.position = view.to_scene(probe.pose.position);
  out.pose.orientation = view.orientation * probe.pose.orientation;
  out.twist.linear = view.orientation * probe.twist.linear / view.zoom;
  out.twist.angular = view.orientation * probe.twist.angular;
  return out;
}

void adopt_view(const View& view, ProxyState& state, const ProbeSample& workspace, Vec3& held) noexcept {
  const View& last = state.view;
  const bool same = last.zoom == view.zoom && last.focus == view.focus && last.home == view.home &&
                    last.orientation.coeffs() == view.orientation.coeffs();
  if (!same) {
    const Vec3& now = workspace.pose.position;
    // The spring and the forces as the hand has them.
    const auto turn = [&](const Vec3& v) { return Vec3(view.orientation * (last.orientation.conjugate() * v)); };
    const double scale = last.zoom / view.zoom;
    held = view.to_scene(now) + scale * turn(state.proxy - last.to_scene(now));
    state.stiffness /= scale * scale;
    state.force = turn(state.force) / scale;
    state.residual = turn(state.residual) / scale;
    state.previous_probe = view.to_scene(state.workspace_probe);
    for (ContactState& slot : state.contacts) {
      const auto turned = [&](const Vec3& v) { return slot.pose.rotate_inverse(turn(slot.pose.rotate(v))); };
      slot.friction.stretch = scale * turned(slot.friction.stretch);
      slot.friction.stiffness /= scale * scale;
      slot.texture.force = turned(slot.texture.force) / scale;
      slot.texture.penetration *= scale;
      slot.turned = turn(slot.turned) / scale;
      slot.stiffness /= scale * scale;
      slot.iso.previous = slot.pose.apply_inverse(state.previous_probe);
    }
  }
  state.view = view;
}

Vec3 surface_motion(const ContactState& slot, const Vec3& p) noexcept {
  return p - slot.pose_before.apply(slot.pose.apply_inverse(p));
}

bool follow_surfaces(const Scene& scene, ProxyState& state, const ProbeSample& probe, Seconds dt,
                     bool new_scene) noexcept {
  bool any = false;
  bool taken = false;
  Vec3 proxy = state.proxy;
  const ContactState* mover = nullptr;
  double strongest_stiffness = 0.0;
  for (ContactState& slot : state.contacts) {
    const Instance& instance = scene.felt()[slot.instance];
    bool other_pose = false;
    // What stood still at the last tick, and cannot move by itself, stands where it did.
    if (new_scene || slot.moved || !slot.placed || instance.motion.moves()) {
      const Pose now = instance.motion.at(instance.world_from_object, probe.time);
      slot.pose_before = slot.placed ? slot.pose : now;
      slot.pose = now;
      slot.placed = true;
      other_pose = !same_pose(slot.pose, slot.pose_before);
    }
    choose_moment(scene, instance, probe, dt, state.proxy, slot);
    slot.moved = slot.moment_changed || other_pose;
    any = any || slot.moved;
  }
  if (!any && !new_scene) return false;
  for (ContactState& slot : state.contacts) {
    const Instance& instance = scene.felt()[slot.instance];
    const bool moved = has_moved(slot);
    if (!constrains(instance.law) || (!moved && !new_scene)) continue;
    settle(slot.anchor);
    bool carried = false;
    if (const ReliefSurface* relief = relief_of(instance);
        relief != nullptr && std::holds_alternative<ProxyLaw>(instance.law) && scene.probe_radius() == 0.0) {
      carried = carry_on_relief(instance, *relief, slot, proxy);
    } else if (const MeshSurface* mesh = anchored_mesh(instance)) {
      carried = carry_on_mesh(instance, *mesh, slot, proxy);
      // A fold may have closed over it.
      if (carried) proxy = pushed_to_front(scene, instance, slot.anchor.height >= 0.0, slot, proxy);
    }
    if (!carried && !same_pose(slot.pose, slot.pose_before) && !taken) {
      proxy = slot.pose.apply(slot.pose_before.apply_inverse(state.proxy));
      carried = true;
    }
    if (carried && !taken) {
      state.proxy = past_others(scene, state, slot, state.proxy, proxy);
      if (state.proxy != proxy) {
        // Between two surfaces: on the front of the one that moved, as near to where it would be as the other lets it.
        slot.touching = false;
        if (slot.side_known) state.proxy = pushed_to_front(scene, instance, slot.outside, slot, state.proxy);
      }
      taken = true;
      mover = &slot;
      strongest_stiffness = instance.material.stiffness;
    }
  }
  // A surface that overtakes a free probe gives it no more than the probe's own motion would have stored.
  if (mover != nullptr && state.stiffness == 0.0) state.stiffness = strongest_stiffness;
  for (ContactState& slot : state.contacts) {
    const Instance& instance = scene.felt()[slot.instance];
    if (!constrains(instance.law) || &slot == mover || !slot.side_known || !(has_moved(slot) || new_scene)) continue;
    if (instance.sides == Sides::front && !slot.outside) continue;
    const Vec3 local = slot.pose.apply_inverse(state.proxy);
    if (in_front(instance, local, slot.hint) == slot.outside || beside_rim(instance, local, slot.hint)) continue;
    state.proxy = pushed_to_front(scene, instance, slot.outside, slot, state.proxy);
    slot.touching = false;
    if (state.stiffness == 0.0) state.stiffness = instance.material.stiffness;
    any = true;
  }
  return any;
}

void pay_for_change(double now, ContactState& slot, EnergyTank& tank) noexcept {
  const double gain = slot.share * now - slot.potential;
  if (gain <= 0.0) {
    tank.fill(-gain);
    return;
  }
  const double paid = tank.pay(gain);
  if (paid >= gain) return;
  slot.share = now > 0.0 ? std::clamp((std::max(0.0, slot.potential) + paid) / now, 0.0, 1.0) : 0.0;
}

double carried_share(const Vec3& force, const Vec3& surface_motion, EnergyTank& tank) noexcept {
  const double given = force.dot(surface_motion);
  if (given <= 0.0) return 1.0;
  return tank.pay(given) / given;
}

void remember_anchor(const Instance& instance, const Vec3& point, std::uint32_t element, const Vec3& proxy,
                     ContactState& slot) noexcept {
  SurfaceAnchor& anchor = slot.anchor;
  anchor.face = no_index;
  anchor.raw = false;
  if (const ReliefSurface* relief = relief_of(instance);
      relief != nullptr && std::holds_alternative<ProxyLaw>(instance.law) && slot.touching) {
    const ReliefPlace& place = slot.hint.relief;
    anchor.face = place.frame.face;
    anchor.u = place.u;
    anchor.v = place.v;
    anchor.height = slot.side * relief->base().skin();
    return;
  }
  const MeshSurface* mesh = anchored_mesh(instance);
  if (mesh == nullptr || element >= mesh->mesh().triangles().size()) return;
  anchor.face = element;
  anchor.raw = true;
  anchor.corners = mesh->mesh().corners(element);
  const bool at_origin = slot.pose.is_identity();
  anchor.point = at_origin ? point : slot.pose.apply_inverse(point);
  anchor.proxy = at_origin ? proxy : slot.pose.apply_inverse(proxy);
}

void remember_places(const Scene& scene, ProxyState& state, const Vec3& probe, bool new_scene) noexcept {
  for (ContactState& slot : state.contacts) {
    const Instance& instance = scene.felt()[slot.instance];
    if (new_scene || !slot.noted) {
      slot.lineage = lineage_of(instance);
      slot.side_known = constrains(instance.law) && changes(instance);
      slot.noted = true;
    }
    if (!slot.side_known) continue;
    Hint scratch;
    scratch.moment = slot.hint.moment;
    // A proxy that is held rests a skin above the side that it is held on.
    slot.outside = in_front(instance, slot.pose.apply_inverse(slot.in_touch ? state.proxy : probe),
                            slot.in_touch ? scratch : slot.hint);
  }
}

Vec3 handed_over(const Scene& scene, ProxyState& state, const Vec3& force, const Vec3& probe, Seconds dt,
                 bool new_scene) noexcept {
  if (!new_scene && state.residual.isZero(0.0)) return force;
  const double time = scene.settings().handover.count();
  // What the last tick's share of the old force has given since.
  state.tank.pay(state.residual.dot(probe - state.previous_probe));
  if (new_scene) state.residual = time > 0.0 ? Vec3(state.force - force) : Vec3(Vec3::Zero());
  if (state.residual.isZero(0.0)) return force;
  state.residual *= time > 0.0 ? std::exp(-dt.count() / time) : 0.0;
  constexpr double gone = 1e-6;  // N
  if (state.residual.norm() < gone) {
    state.residual = Vec3::Zero();
    return force;
  }
  // It may give over the next tick what the tank holds: the hand moves as it did, or twice as far.
  const double way = 2.0 * (probe - state.previous_probe).norm() + 1e-7;
  const double most = state.tank.level() / way;
  const double size = state.residual.norm();
  if (size > most) state.residual *= most / size;
  return force + state.residual;
}

}  // namespace asperity
