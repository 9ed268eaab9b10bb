#include <algorithm>

#include "asperity/render/contact/fine.h"
#include "asperity/render/contact/joint_friction.h"
#include "asperity/render/contact/level.h"
#include "asperity/render/contact/point_folds.h"
#include "asperity/render/local_material.h"
#include "asperity/render/stages/tick.h"

namespace asperity {

namespace {

/// A material's coefficients, and its grip; no coefficients unless the proxy itself holds the friction.
Friction friction_of(const Touched& touch, const Material& material) noexcept {
  const double grip = material.stickiness / material.stiffness;
  if (!touch.facts->holds_friction) return {0.0, 0.0, grip};
  return {std::max(material.static_friction, material.dynamic_friction), material.dynamic_friction, grip};
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

/// What a point that rests on a surface answers, world frame. `foot`: of the surface, object frame.
template <SurfaceView View>
void answer_at_rest(const View& view, const PointProxy<View>& point, const PointRest& rest, const Vec3& foot,
                    const Friction& friction, const Material& material, Tick& tick, Part& part) noexcept {
  constexpr bool triangles = std::is_same_v<View, TriangleView>;
  Touched& touch = *part.touch;
  OfSurface& surface = touch.contact->surface;
  const Vec3& position = tick.probe->pose.position;
  LawForce& law = part.law;
  law.contact = true;
  law.normal = touch.turned(rest.normal);
  tick.felt = tick.state.proxy = touch.to_world(rest.proxy);
  if constexpr (triangles) tick.state.proxy += view.skin() * law.normal;
  Vec3 spring = tick.felt - position;
  if constexpr (triangles) {
    // Without friction a plane pushes along its normal alone; what friction holds is the proxy itself, skin and all.
    spring = friction.still > 0.0 ? Vec3(tick.state.proxy - position) : Vec3(spring.dot(law.normal) * law.normal);
  }
  law.penetration = spring.norm();
  law.pulls = rest.pulls;
  law.force = law.spring = material.stiffness * spring;
  law.point = tick.felt - tick.scene.probe_radius() * law.normal;
  if constexpr (requires { view.element(point.place(), point.spot()); }) {
    law.element = view.element(point.place(), point.spot());
  } else {
    law.element = element_at(*touch.instance, view.level, foot, *touch.cache);
  }
  surface.places[0].element = law.element;
  if constexpr (triangles) {
    surface.height = point.place().side() * view.skin();
  }
  if constexpr (triangles || std::is_same_v<View, ReliefView>)
    finish_by_law(touch, {foot, rest.normal, 0.0, law.element, point.place().at}, law);
  // Of the bare mesh under it, should the scene take the coat away.
  if constexpr (std::is_same_v<View, ReliefView>) surface.height = point.place().side() * view.surface().base().skin();
  if (!rest.pulls) {
    // A law as printed has turned the force away from what the spring holds.
    const bool turned = law.force != law.spring;
    // What the cone cuts off is no gift: the proxy is where it is.
    law.stored = 0.5 * material.stiffness * spring.squaredNorm();
    const Vec3 force = on_cone(law.force, law.normal, friction, surface.sliding);
    law.spring = turned ? on_cone(law.spring, law.normal, friction, surface.sliding) : force;
    law.force = with_damping(force, law.normal, tick.probe->twist.linear, material.damping);
  }
  if constexpr (requires { view.height(point.spot()); }) law.height = view.height(point.spot());
  if constexpr (requires { view.bend(point.place(), point.spot()); }) {
    if (touch.instance->fine == nullptr) return;
    law.bends = true;
    law.bend = point.place().side() * view.bend(point.place(), point.spot());
    if (touch.at_origin) return;
    const Mat3 turn = touch.pose->orientation.toRotationMatrix();
    law.bend = turn * law.bend * turn.transpose();
  }
}

/// One surface touched by a point, or by a ball where the surface has one level further out for it. False, and nothing
/// done, where more than one plane of a mesh may hold it; `border`: the place where
/// those of an edge or a vertex do.
template <SurfaceView View>
bool constrain_on(const View& view, Touched& touch, Tick& tick, Place& border) noexcept {
  OfSurface& surface = touch.contact->surface;
  const Vec3& position = tick.probe->pose.position;
  const Vec3 from = touch.to_local(tick.state.proxy);
  // Friction is that of the place where the proxy rests.
  const Vec3& place = surface.rests && touch.facts->volume ? surface.places[0].at : from;
  MaterialRoom room;
  const Friction friction = friction_of(touch, material_there(touch, place, room));
  const bool rested = surface.rests;
  const bool slid = surface.sliding;
  PointProxy<View> point(view, touch.facts->sides, friction, touch.to_local(position), surface, tick.cache.work());
  const PointRest rest = point.run(from);
  if (!rest.simple) {
    surface.rests = rested;
    surface.sliding = slid;
    if (rest.on_border) border = point.place();
    return false;
  }
  tick.converged = rest.converged;
  Part& part = *tick.parts.emplace_back();
  part.touch = &touch;
  part.stiffness = touch.instance->material.stiffness;
  if (!rest.contact) {
    tick.felt = tick.state.proxy = position;
    return true;
  }
  const Vec3 foot = rest.proxy - tick.scene.probe_radius() * rest.normal;
  const Material& material = material_there(touch, foot, room);
  part.stiffness = material.stiffness;
  answer_at_rest(view, point, rest, foot, friction, material, tick, part);
  return true;
}

/// Whether a point goes on by itself from what holds it: one plane of a mesh, or, where nothing rubs, those of faces
/// that meet. A place on a border may be of a face that is seen from elsewhere there: only if it was `led` to it.
bool goes_on_alone(const TriangleView& view, const OfSurface& surface, bool rubs, bool led) noexcept {
  const auto& places = surface.places;
  if (places.empty() || (places.size() > 1 && rubs)) return false;
  return std::all_of(places.begin(), places.end(), [&](const Place& place) {
    return (led || view.within_face(place)) && place.back == places[0].back &&
           view.meet(place.element, places[0].element);
  });
}

/// Several surfaces, triangles, or a ball. `border`: of a mesh, where a point was led to by
/// itself.
void constrain_jointly(Tick& tick, GeneratedPatches* patches, const Place& border) noexcept {
  ProxyState& state = tick.state;
  const Vec3& position = tick.probe->pose.position;
  JointSolve joint(tick.scene.probe_radius(), patches, tick.cache.work());
  const Vec3 before = state.proxy;
  Vec3 from = before;
  bool rubs = false;
  bool smooth = false;
  bool led = false;
  for (Touched& touch : tick.touches) {
    if (!touch.facts->constrains) continue;
    OfSurface& surface = touch.contact->surface;
    joint.add(touch);
    rubs = rubs || touch.facts->rubs;
    if (!touch.facts->smooth) continue;
    smooth = true;
    // A little off the surface that a point was held on: from there a ball may roll.
    if (surface.rests)
      from += 2.0 * on_view(touch.view, [](const auto& view) { return view.skin(); }) * touch.turned(surface.normal);
    surface.rests = false;
  }
  if (smooth && tick.surfaces_moved) static_cast<void>(joint.push_out(from));
  from = joint.put_down(from);
  const bool ball = tick.scene.probe_radius() > 0.0;
  const auto friction_in = [&](const ConstraintPlane& plane) {
    const Touched& touch = joint.touch(plane.owner);
    MaterialRoom room;
    return friction_of(touch, material_there(touch, ball ? plane.contact.point : touch.to_local(before), room));
  };
  Vec3 goal = position;
  ConstraintSolution solution;
  if (rubs) {
    solution = joint.solve_with_friction(from, position, state.sliding, goal, friction_in);
  } else {
    state.sliding = false;
    if (border.known()) solution = joint.on_border(border, goal);
    led = solution.settled();
    if (!led) solution = joint.solve(from, goal);
  }
  state.proxy = joint.lifted(solution.proxy);
  tick.converged = solution.converged && joint.complete();
  // While friction holds it, the proxy is where it is, not where the goal would have it.
  tick.felt = solution.settled() ? Vec3(solution.projection.point) : solution.proxy;
  for (std::size_t i = 0; i < joint.size(); ++i) {
    Touched& touch = joint.touch(i);
    MaterialRoom room;
    const ConstraintPlane* plane = ball ? strongest_plane(i, solution) : nullptr;
    const Vec3 place = plane != nullptr ? plane->contact.point : touch.to_local(solution.proxy);
    const Material& material = material_there(touch, place, room);
    Part& part = *tick.parts.emplace_back();
    part = {&touch, owner_force(touch, material, i, solution, goal, *tick.probe), material.stiffness};
    joint.remember_places(i, solution);
    OfSurface& surface = touch.contact->surface;
    surface.rests = joint.size() == 1 && !touch.facts->smooth && !touch.facts->by_planes &&
                    tick.scene.probe_radius() == 0.0 && solution.settled() &&
                    goes_on_alone(*std::get_if<TriangleView>(&touch.view), surface, rubs, led);
    surface.sliding = state.sliding;
  }
}

/// The plane of a face that a ball rests on, and how a probe presses it against that.
struct FacePlane {
  FacePlane(const Touched& touch, const Foot& foot, double radius, double skin, const Vec3& probe) noexcept {
    of.normal = touch.turned(foot.normal);
    of.offset = of.normal.dot(touch.to_world(foot.point)) + radius;
    of.skin = skin;
    pressed = of.offset - of.normal.dot(probe);
    // As strongest_hold gets it from two places, to the bit.
    push = (probe + pressed * of.normal) - probe;
    push /= push.norm();
  }
  ConstraintPlane of;
  double pressed = 0.0;      ///< m; not above 0: the probe is on the free side
  Vec3 push = Vec3::Zero();  ///< the way to the plane, unit
};

/// A ball that rests on one face of a mesh, and slides along it to nothing else: to the bit what the joint solve makes
/// of one plane, as that may be all that a tick without a cache has. False, and nothing done but that what is around
/// may have been looked at, where that is not all.
bool constrain_on_face(Touched& touch, Tick& tick) noexcept {
  ProxyState& state = tick.state;
  const auto& view = *std::get_if<TriangleView>(&touch.view);
  const Sides sides = touch.facts->sides;
  const double radius = tick.scene.probe_radius();
  const Vec3& probe = tick.probe->pose.position;
  const Vec3 from = touch.to_local(state.proxy);
  const Foot* rest = view.rests_on_face(from, radius, sides);
  if (rest == nullptr) return false;
  FacePlane plane(touch, *rest, radius, view.skin(), probe);
  // Past its own plane the probe is led off.
  if (!(plane.pressed > 0.0)) return false;
  MaterialRoom room;
  Friction friction = friction_of(touch, material_there(touch, rest->point, room));
  const bool rubs = friction.still > 0.0;
  bool sliding = rubs && state.sliding;
  const bool held = rubs && holds(friction, state.proxy, plane.push, probe, sliding);
  Vec3 proxy = state.proxy;
  if (!held) {
    const Vec3 goal = rubs ? Slip(proxy, plane.push, probe, friction.sliding).goal(1.0) : probe;
    const Vec3 step = onto_plane(goal, plane.of) - proxy;
    if (step.norm() > JointSolve::rest_on_triangles * view.skin()) {
      const Vec3 to = proxy + step;
      if (rubs && !no_farther(to, proxy, probe)) return false;
      if (!view.slides({from, touch.to_local(to)}, radius, sides)) return false;
      plane = FacePlane(touch, *rest, radius, view.skin(), probe);
      proxy = to;
    }
    if (!(plane.pressed > 0.0)) return false;
    if (rubs) {
      friction = friction_of(touch, material_there(touch, rest->point, room));
      if (!(friction.still > 0.0) || !holds(friction, proxy, plane.push, probe, sliding)) return false;
    }
  }
  state.proxy = proxy;
  state.sliding = sliding || (rubs && !held);
  const Material& material = material_there(touch, rest->point, room);
  const Vec3 spring = plane.pressed * plane.of.normal;
  const Vec3 led = probe + spring;
  tick.felt = rubs ? proxy : led;
  Part& part = *tick.parts.emplace_back();
  part = {&touch, {}, material.stiffness};
  part.law = pushed_by(spring, material.stiffness);
  const Vec3 goal = rubs ? Vec3(proxy - (led - probe)) : probe;
  finish_push(touch, material, *rest, goal - probe, *tick.probe, part.law);
  OfSurface& surface = touch.contact->surface;
  surface.normal = touch.turned_back(plane.of.normal);
  const OnFace on(touch, *rest, surface.normal, proxy);
  surface.places.clear();
  surface.places.push_back(on.place);
  surface.height = on.height;
  surface.rests = false;
  surface.sliding = state.sliding;
  return true;
}

[[gnu::noinline]] void constrain_with_facets(Tick& tick) noexcept {
  GeneratedPatches patches;
  constrain_jointly(tick, &patches, {});
}

/// Whether a proxy that is not at rest has anything left to do. `before`: where the tick found it.
void see_what_is_left(Tick& tick, const Vec3& before, bool budgeted) noexcept {
  // All that two ticks can do, for what no hand could tell, is as good as a rest. One may have flown in vain.
  constexpr double least_gain = 1e-4;
  ProxyState& state = tick.state;
  if (tick.converged) {
    state.idle = false;
    return;
  }
  const Vec3& position = tick.probe->pose.position;
  const bool idle = (state.proxy - position).norm() >= (1.0 - least_gain) * (before - position).norm();
  if (idle && state.idle) tick.converged = true;
  state.idle = idle;
  tick.open = budgeted && !tick.converged && tick.cache.work().spent();
  tick.converged = tick.converged || tick.open;
}

}  // namespace

void constrain(Tick& tick) noexcept {
  Touched* last = nullptr;
  std::size_t count = 0;
  bool facets = false;
  bool smooth = false;
  for (Touched& touch : tick.touches) {
    if (!touch.facts->constrains) continue;
    ++count;
    last = &touch;
    facets = facets || touch.facts->facets;
    smooth = smooth || touch.facts->smooth;
  }
  if (count == 0) {
    tick.state.proxy = tick.felt = tick.probe->pose.position;
    return;
  }
  const bool point =
      tick.scene.probe_radius() == 0.0 || (last->facts->volume && ball_level(*last->instance, tick.scene) > 0.0);
  // What several planes of a mesh held, they mostly hold on.
  const bool alone = count == 1 && point && !last->facts->by_planes &&
                     (last->facts->smooth || last->contact->surface.rests || last->contact->surface.places.size() <= 1);
  const Vec3 before = tick.state.proxy;
  // A ball on triangles alone makes few moves, and what it looks at hangs on what is known of them.
  const bool budgeted = tick.scene.probe_radius() == 0.0 || smooth;
  if (alone) tick.state.sliding = last->contact->surface.sliding;
  Place border;
  const bool on_mesh = count == 1 && tick.scene.probe_radius() > 0.0 && !last->facts->smooth && !facets;
  if (on_mesh && constrain_on_face(*last, tick)) return see_what_is_left(tick, before, budgeted);
  if (!alone || !on_view(last->view, [&](const auto& view) { return constrain_on(view, *last, tick, border); })) {
    if (facets) {
      constrain_with_facets(tick);
    } else {
      constrain_jointly(tick, nullptr, border);
    }
  }
  see_what_is_left(tick, before, budgeted);
}

}  // namespace asperity
