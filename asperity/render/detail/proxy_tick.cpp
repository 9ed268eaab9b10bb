#include "asperity/render/detail/proxy_tick.h"

#include <algorithm>
#include <optional>

#include "asperity/render/detail/god_object.h"
#include "asperity/render/detail/iso_proxy.h"
#include "asperity/render/detail/joint_proxy.h"
#include "asperity/render/detail/parametric_proxy.h"
#include "asperity/render/detail/proxy.h"
#include "asperity/render/fine_contact.h"

namespace asperity {

namespace {

const ReliefSurface* proxied_relief(const Instance& instance) noexcept {
  if (!std::holds_alternative<ProxyLaw>(instance.law)) return nullptr;
  const auto* relief = std::get_if<std::shared_ptr<const ReliefSurface>>(&instance.surface);
  return relief != nullptr ? relief->get() : nullptr;
}

/// A sliding contact's force lies on the cone to within what the descent left; here exactly.
Vec3 on_cone(const Vec3& force, const Vec3& normal, const Friction& friction, bool sliding) noexcept {
  if (friction.still <= 0.0) return force;
  const double push = std::max(0.0, force.dot(normal));
  const Vec3 along = force - push * normal;
  const double length = along.norm();
  const double most = (sliding ? friction.sliding : friction.still) * push;
  return length <= most ? force : Vec3(push * normal + (most / length) * along);
}

const IsoSurface* proxied_iso(const Instance& instance) noexcept {
  return std::holds_alternative<ProxyLaw>(instance.law) ? iso_of(instance.surface) : nullptr;
}

const ParametricSurface* proxied_parametric(const Instance& instance) noexcept {
  return std::holds_alternative<ProxyLaw>(instance.law) ? parametric_of(instance.surface) : nullptr;
}

const CustomSurface* proxied_custom(const Instance& instance) noexcept {
  return std::holds_alternative<ProxyLaw>(instance.law) ? custom_of(instance.surface) : nullptr;
}

/// Whether the proxy's law goes by a smooth surface rather than by triangles.
bool smooth(const Instance& instance) noexcept {
  if (provider_of<MeshSurface>(instance.surface) != nullptr) return false;
  return proxied_relief(instance) != nullptr || proxied_parametric(instance) != nullptr ||
         proxied_iso(instance) != nullptr || proxied_custom(instance) != nullptr;
}

/// The point of one smooth surface, object frame. `jet`: of a parametric surface, where it rests.
ProxyRest solve_on_smooth(const Instance& instance, const Friction& friction, const Vec3& from, const Vec3& probe,
                          ContactState& slot, ParametricJet& jet) noexcept {
  if (const ReliefSurface* relief = proxied_relief(instance))
    return solve_on_relief(*relief, instance.sides, friction, from, probe, slot);
  if (const ParametricSurface* parametric = proxied_parametric(instance))
    return solve_on_parametric(*parametric, instance.sides, friction, from, probe, slot, jet);
  return solve_on_iso(felt_view(*proxied_iso(instance), slot), instance.sides, friction, from, probe, slot);
}

/// How the normal of a relief changes along it at a point (1/m, object frame).
Mat3 bend_of(const ReliefPoint& point, const ReliefPlace& place) noexcept {
  const ShellPrism& prism = place.frame.prism;
  const Vec3 direction = prism.direction_at(place.u, place.v);
  const HeightJet& h = point.jet;
  ParametricJet jet;
  jet.u = point.along_u;
  jet.v = point.along_v;
  Vec3 du;
  Vec3 dv;
  ParametricSurface::parameter_gradients(jet, du, dv);
  const Vec3& n = point.outward;
  const double uu = n.dot(h.uu * direction + 2.0 * h.u * prism.turn_u);
  const double uv = n.dot(h.uv * direction + h.u * prism.turn_v + h.v * prism.turn_u);
  const double vv = n.dot(h.vv * direction + 2.0 * h.v * prism.turn_v);
  const Vec3 across = uu * du + uv * dv;
  const Vec3 along = uv * du + vv * dv;
  return -(across * du.transpose() + along * dv.transpose());
}

/// Tells what texture may go by, in the world frame.
void set_bend(const Mat3& bend, const Pose& pose, LawForce& law) noexcept {
  law.bends = true;
  law.bend = bend;
  if (pose.is_identity()) return;
  const Mat3 turn = pose.orientation.toRotationMatrix();
  law.bend = turn * bend * turn.transpose();
}

/// One smooth surface, touched by a point, or by a ball where the surface has one level further out for it.
ProxyAnswer on_smooth(const Instance& instance, ContactState& slot, const Vec3& from, const ProbeSample& probe,
                      double radius) noexcept {
  const Pose& pose = slot.pose;
  const bool at_origin = pose.is_identity();
  const Vec3& position = probe.pose.position;
  const Vec3 local_from = at_origin ? from : pose.apply_inverse(from);
  const Vec3 local_probe = at_origin ? position : pose.apply_inverse(position);
  // Friction is that of the place where the proxy rests.
  const Vec3& place = slot.touching ? slot.iso.point : local_from;
  const Friction friction = friction_of(instance, local_material(instance, place, slot.hint));
  ParametricJet jet;
  const ProxyRest rest = solve_on_smooth(instance, friction, local_from, local_probe, slot, jet);
  ProxyAnswer answer;
  answer.converged = rest.converged;
  answer.proxy = position;
  LawForce law;
  Material material = instance.material;
  if (rest.contact) {
    material = local_material(instance, rest.proxy - radius * rest.normal, slot.hint);
    law.contact = true;
    answer.proxy = at_origin ? rest.proxy : pose.apply(rest.proxy);
    law.normal = at_origin ? rest.normal : pose.rotate(rest.normal);
    const Vec3 spring = answer.proxy - position;
    law.penetration = spring.norm();
    law.pulls = rest.pulls;
    law.force = rest.pulls ? Vec3(material.stiffness * spring)
                           : with_damping(on_cone(material.stiffness * spring, law.normal, friction, slot.sliding),
                                          law.normal, probe.twist.linear, material.damping);
    law.point = answer.proxy - radius * law.normal;
    if (proxied_relief(instance) != nullptr) {
      law.height = slot.point.jet.height;
      law.element = slot.hint.relief.frame.face;
      if (instance.fine != nullptr) set_bend(slot.side * bend_of(slot.point, slot.hint.relief), pose, law);
    } else if (const ParametricSurface* parametric = proxied_parametric(instance)) {
      law.element = parametric->element_of(slot.hint.parametric.uv);
      law.height = jet.height;
      if (instance.fine != nullptr) set_bend(slot.side * parametric->shape_operator(jet), pose, law);
    } else {
      law.element = element_at(instance, rest.proxy - radius * rest.normal, slot);
    }
  }
  answer.felt = answer.proxy;
  answer.parts.push_back({slot.instance, law, material.stiffness});
  return answer;
}

/// Adds consistent shading's lateral force as far as its budget goes: against the motion it is free and fills the
/// budget, along the motion it spends it.
void add_turn(ContactState& slot, LawForce& law, const Vec3& moved) noexcept {
  constexpr double full_budget = 1e-6;  // J from which on nothing is held back
  constexpr double changeover = 0.1;    // cosine between force and motion over which the two cases blend
  slot.turn_budget -= slot.turned.dot(moved);
  slot.turned = Vec3::Zero();
  if (!law.contact || law.turn.isZero()) return;
  const double size = law.turn.norm() * moved.norm();
  const double cosine = size > 0.0 ? law.turn.dot(moved) / size : 0.0;
  const double along = std::clamp(0.5 + 0.5 * cosine / changeover, 0.0, 1.0);
  const double budget = std::clamp(slot.turn_budget / full_budget, 0.0, 1.0);
  const double giving = along * along * (3.0 - 2.0 * along);
  slot.turned = (1.0 + giving * (budget - 1.0)) * law.turn;
  law.force += slot.turned;
}

/// The coefficients and the normal that friction on several planes goes by: those of the one that pushes most.
struct Hold {
  Friction friction;
  Vec3 normal = Vec3::Zero();
};

template <class FrictionOf>
Hold strongest_hold(const PlaneSet& planes, const Vec3& goal, const FrictionOf& friction_of_owner) noexcept {
  const PlaneProjection projection = project_onto_planes(goal, planes, false);
  Hold hold;
  double strongest = 0.0;
  for (const PlaneProjection::Active& active : projection.active) {
    if (active.multiplier <= strongest) continue;
    strongest = active.multiplier;
    hold.friction = friction_of_owner(planes[active.plane].owner);
  }
  const Vec3 push = projection.point - goal;
  const double length = push.norm();
  if (length > 0.0) hold.normal = push / length;
  return hold;
}

/// Solves with Coulomb friction: each round leads the proxy to the probe as far as the cone lets it go.
template <class Touched, class Solve, class FrictionOf>
ConstraintSolution solve_with_friction(const Vec3& from, const Vec3& probe, bool& sliding, Vec3& goal,
                                       const Touched& touched, const Solve& solve,
                                       const FrictionOf& friction_of_owner) noexcept {
  constexpr int most_rounds = 4;
  constexpr double on_cone = 1e-6;
  ConstraintSolution solution;
  Vec3 proxy = from;
  goal = probe;
  PlaneSet planes;
  touched(proxy, planes);
  bool held = false;
  // The spring's force is its own, whatever its direction: what the planes hold is the push, the rest is friction's.
  const auto stick = [&](const Vec3& at, const PlaneSet& on) {
    ConstraintSolution still;
    still.proxy = at;
    still.planes = on;
    still.converged = true;
    still.projection = project_onto_planes(probe, on, false);
    goal = at - (still.projection.point - probe);
    still.projection.point = at;
    return still;
  };
  for (int round = 0; round < most_rounds; ++round) {
    const Hold hold = strongest_hold(planes, probe, friction_of_owner);
    if (hold.friction.still <= 0.0 || hold.normal.isZero()) {
      // In free space, or without friction, the proxy goes all the way; what it meets then decides.
      goal = probe;
      solution = solve(proxy, goal);
      if (planes.empty() && !solution.planes.empty() && round == 0) {
        const Hold met = strongest_hold(solution.planes, probe, friction_of_owner);
        if (met.friction.still > 0.0) {
          // It met something with friction: it would have stopped there, not slid on for nothing.
          planes = solution.planes;
          proxy = solution.proxy;
          held = true;
          continue;
        }
      }
      sliding = false;
      return solution;
    }
    const double coefficient = sliding ? hold.friction.sliding * (1.0 + on_cone) : hold.friction.still;
    if (friction_goal(proxy, hold.normal, probe, coefficient) == proxy) {
      sliding = round > 0 && !held;
      return stick(proxy, planes);
    }
    goal = friction_goal(proxy, hold.normal, probe, hold.friction.sliding);
    sliding = true;
    solution = solve(proxy, goal);
    if ((solution.proxy - probe).squaredNorm() > (proxy - probe).squaredNorm() * (1.0 + 1e-12)) {
      // On a bent surface the spring would gain: the proxy stays.
      return stick(proxy, planes);
    }
    proxy = solution.proxy;
    planes = solution.planes;
  }
  return solution;
}

/// What an instance is made of at a place (world): `room` holds it where that may differ from place to place.
const Material& material_there(const Instance& instance, const Vec3& place, ContactState& slot,
                               std::optional<Material>& room) noexcept {
  if (!has_local_material(instance)) return instance.material;
  return room.emplace(local_material(instance, slot.pose.apply_inverse(place), slot.hint));
}

/// Whether friction may hold the proxy on an instance.
bool may_rub(const Instance& instance) noexcept {
  const Material& material = instance.material;
  return (has_local_material(instance) || material.static_friction > 0.0 || material.dynamic_friction > 0.0) &&
         proxy_holds_friction(instance);
}

/// Keeps the spring between probe and proxy from gaining energy (formulation, amendment 6).
void limit_energy(ProxyState& state, const Vec3& before, const Vec3& probe, ProxyAnswer& answer) noexcept {
  double stiffness = 0.0;
  double strongest = 0.0;
  for (const ProxyAnswer::Part& part : answer.parts) {
    if (!part.law.contact || part.law.penetration < strongest) continue;
    strongest = part.law.penetration;
    stiffness = part.stiffness;
  }
  if (stiffness == 0.0) {
    state.stiffness = 0.0;
    return;
  }
  if (state.stiffness > 0.0) {
    constexpr double rounding = 1e-9;
    const double may = 0.5 * state.stiffness * (before - probe).squaredNorm();
    const double would = 0.5 * stiffness * (answer.proxy - probe).squaredNorm();
    if (would > may * (1.0 + rounding)) {
      const double paid = state.tank.pay(would - may);
      if (paid < would - may) {
        const double share = (may + paid) / would;
        // Never all of it: a spring that is still held is not a free one.
        stiffness *= std::max(share, 1e-12);
        answer.energy_limited = true;
        answer.rendered_share = share;
        for (ProxyAnswer::Part& part : answer.parts) part.law.force *= share;
      }
    } else {
      state.tank.fill(may - would);
    }
  }
  state.stiffness = stiffness;
}

/// A little off the surface that a point was held on: from there a ball may roll (m, world).
Vec3 off_the_surface(const Instance& instance, const ContactState& slot) noexcept {
  const ReliefSurface* relief = proxied_relief(instance);
  const Vec3 normal = relief != nullptr ? Vec3(slot.side * slot.point.normal()) : slot.iso.normal;
  const ParametricSurface* parametric = proxied_parametric(instance);
  const double skin = relief != nullptr       ? relief->skin()
                      : parametric != nullptr ? parametric->skin()
                                              : proxied_iso(instance)->skin();
  return 2.0 * skin * slot.pose.rotate(normal);
}

}  // namespace

ProxyAnswer solve_proxies(const Scene& scene, ProxyState& state, const ProbeSample& probe, const Vec3& held,
                          bool moved) noexcept {
  const Vec3& position = probe.pose.position;
  const Vec3 before = state.proxy;
  ContactState* smooth_slot = nullptr;
  std::size_t constrained = 0;
  for (ContactState& slot : state.contacts) {
    const Instance& instance = scene.felt()[slot.instance];
    if (!constrains(instance.law)) continue;
    ++constrained;
    if (smooth(instance)) smooth_slot = &slot;
  }
  ProxyAnswer answer;
  answer.proxy = answer.felt = position;
  if (constrained == 0) {
    state.stiffness = 0.0;
    return answer;
  }
  const auto gather = [&](auto& solver, const ConstraintSolution& solution, const Vec3& goal) {
    answer.proxy = solution.proxy;
    answer.converged = solution.converged && solver.complete();
    // While friction holds it, the proxy is where it is, not where the goal would have it.
    const bool settled = solution.converged && solution.projection.feasible;
    answer.felt = settled ? Vec3(solution.projection.point) : solution.proxy;
    for (std::size_t i = 0; i < solver.size(); ++i) {
      const Instance& instance = solver.instance(i);
      std::optional<Material> room;
      const Material& material = material_there(instance, solution.proxy, solver.state(i), room);
      LawForce law = owner_force(instance, material, solver.state(i).pose, i, solution, goal, probe);
      if (std::holds_alternative<ForceShadingLaw>(instance.law))
        add_turn(solver.state(i), law, position - state.previous_probe);
      answer.parts.push_back({solver.state(i).instance, law, material.stiffness});
    }
  };
  const auto friction_in = [&](auto& solver, std::uint32_t owner) {
    const Instance& instance = solver.instance(owner);
    std::optional<Material> room;
    return friction_of(instance, material_there(instance, before, solver.state(owner), room));
  };
  if (smooth_slot == nullptr) {
    MeshConstraints constraints(scene.probe_radius());
    bool rubs = false;
    for (ContactState& slot : state.contacts) {
      const Instance& instance = scene.felt()[slot.instance];
      if (!constrains(instance.law)) continue;
      constraints.add(instance, slot);
      rubs = rubs || may_rub(instance);
    }
    if (!rubs) {
      state.sliding = false;
      gather(constraints, solve_constraints(constraints, before, position), position);
      limit_energy(state, held, position, answer);
      return answer;
    }
    Vec3 goal;
    const ConstraintSolution solution = solve_with_friction(
        before, position, state.sliding, goal,
        [&](const Vec3& at, PlaneSet& planes) { constraints.contacts(at, planes); },
        [&](const Vec3& from, const Vec3& to) { return solve_constraints(constraints, from, to); },
        [&](std::uint32_t owner) { return friction_in(constraints, owner); });
    gather(constraints, solution, goal);
  } else if (constrained == 1 && proxied_custom(scene.felt()[smooth_slot->instance]) == nullptr &&
             (scene.probe_radius() == 0.0 || ball_level(scene.felt()[smooth_slot->instance], scene) > 0.0)) {
    answer = on_smooth(scene.felt()[smooth_slot->instance], *smooth_slot, before, probe, scene.probe_radius());
  } else {
    JointProxy joint(scene.probe_radius());
    Vec3 from = before;
    for (ContactState& slot : state.contacts) {
      const Instance& instance = scene.felt()[slot.instance];
      if (!constrains(instance.law)) continue;
      joint.add(instance, slot);
      if (slot.touching && smooth(instance) && proxied_custom(instance) == nullptr)
        from += off_the_surface(instance, slot);
      slot.touching = false;
    }
    bool clear = false;
    if (moved) from = joint.pushed_out(from, clear);
    Vec3 goal;
    const ConstraintSolution solution = solve_with_friction(
        from, position, state.sliding, goal, [&](const Vec3& at, PlaneSet& planes) { joint.touched(at, planes); },
        [&](const Vec3& start, const Vec3& to) { return joint.solve(start, to); },
        [&](std::uint32_t owner) { return friction_in(joint, owner); });
    gather(joint, solution, goal);
  }
  limit_energy(state, held, position, answer);
  return answer;
}

Vec3 pushed_to_front(const Scene& scene, const Instance& instance, bool front_side, ContactState& slot,
                     const Vec3& proxy) noexcept {
  const Pose& pose = slot.pose;
  const Vec3 local = pose.apply_inverse(proxy);
  Vec3 front;
  Foot foot;
  double skin = 0.0;
  double least = 0.0;
  if (iso_of(instance.surface) != nullptr) {
    // A point in touch moves with its isosurface (update_felt); here is one that the scene newly has.
    if (slot.touching || slot.iso.field != 0) return proxy;
    const IsoSurface& iso = *iso_of(instance.surface);
    const IsoView view = iso.view_at(0, iso.threshold() + ball_level(instance, scene));
    FieldJet jet;
    // A proxy that rested on the last scene's surface lies on this one's, or on either side of it by rounding.
    least = 2.0 * view.skin();
    if (!view.sample(local, slot.hint.iso, jet)) return proxy;
    if (view.sigma * (jet.value - view.threshold) >= least * jet.gradient.norm()) return proxy;
    foot = view.closest(local, infinity, slot.hint.iso);
    if (!foot.found()) return proxy;
    front = view.outward(foot.point, slot.hint.iso);
    skin = 2.0 * least - (ball_level(instance, scene) > 0.0 ? scene.probe_radius() : 0.0);
  } else if (const ReliefSurface* relief = proxied_relief(instance)) {
    foot = relief->closest(local, infinity, slot.hint);
    if (!foot.found()) return proxy;
    front = relief->point(slot.hint.relief.frame, slot.hint.relief.u, slot.hint.relief.v).normal();
    skin = relief->skin();
  } else if (const ParametricSurface* parametric = proxied_parametric(instance)) {
    foot = parametric->closest(local, infinity, slot.hint);
    if (!foot.found()) return proxy;
    front = parametric->normal(parametric->jet(slot.hint.parametric.uv));
    skin = parametric->skin();
  } else if (const CustomSurface* custom = proxied_custom(instance)) {
    foot = custom->closest(local, infinity, slot.hint);
    if (!foot.found()) return proxy;
    front = custom->outward(foot.point);
    skin = custom->skin();
  } else if (const MeshSurface* mesh = constraint_mesh(instance)) {
    foot = mesh->closest(local, infinity, slot.hint);
    if (!foot.found()) return proxy;
    front = pseudonormal(mesh->mesh(), foot.element, foot.barycentric).normalized();
    skin = mesh->skin();
  } else {
    GeneratedPatch patch;
    patch.start(**std::get_if<std::shared_ptr<const ReliefSurface>>(&instance.surface),
                *std::get_if<GeneratedGeometryLaw>(&instance.law));
    foot = patch.closest(local, slot.hint);
    if (!foot.found()) return proxy;
    front = foot.normal;
    skin = patch.skin();
  }
  if (!front_side) front = -front;
  if ((local - foot.point).dot(front) >= least) return proxy;
  return pose.apply(foot.point + (skin + scene.probe_radius()) * front);
}

Vec3 reacquired(const Scene& scene, ProxyState& state) noexcept {
  Vec3 proxy = state.proxy;
  for (ContactState& slot : state.contacts) {
    const Instance& instance = scene.felt()[slot.instance];
    if (instance.sides != Sides::front || !constrains(instance.law)) continue;
    proxy = pushed_to_front(scene, instance, true, slot, proxy);
  }
  return proxy;
}

}  // namespace asperity
