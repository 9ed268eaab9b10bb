// The joint solve of a point: led along the surfaces themselves, as a point on one surface is, and along the creases
// between them.

#include <algorithm>
#include <cmath>
#include <utility>

#include "asperity/render/contact/joint.h"

namespace asperity {

namespace {

// Evaluations of one way along a surface: in legs, so that what is in the way is seen before much is walked in vain.
constexpr int first_leg = 24;
constexpr int short_leg = 2;
constexpr int most_walk = 1024;
// Back to a surface from a place near it.
constexpr int short_walk = 24;
// Of the tolerance: what it comes nearer by less in a move waits for the next tick.
constexpr double worth_going_on = 0.1;

bool nearer(const Vec3& now, const Vec3& before, const Vec3& goal) noexcept {
  constexpr double least_gain = 1e-9;
  return (now - goal).squaredNorm() < (before - goal).squaredNorm() * (1.0 - least_gain);
}

}  // namespace

/// Whether a point is where a place is. Walks find that to within a share of the grain, along the surface.
bool JointSolve::touches(const Held& held, const Vec3& position) const noexcept {
  constexpr double found_of_grain = 4e-3;
  const Vec3 apart = position - held.point;
  const double above = held.normal.dot(apart);
  const double room = 2.0 * margin();
  const double aside = room + found_of_grain * entries_[held.owner].grain;
  return std::abs(above) <= room && (apart - above * held.normal).squaredNorm() <= aside * aside;
}

void JointSolve::hold(std::size_t index, const Place& place, const Vec3& normal, Held& held) const noexcept {
  const Touched& touch = *entries_[index].touch;
  held.owner = static_cast<std::uint32_t>(index);
  held.place = place;
  on_smooth_view(touch.view, [&](const auto& view) {
    const auto& spot = view.at(place, place.side() * touch.turned_back(normal));
    held.point = touch.to_world(spot.point);
    held.normal = place.side() * touch.turned(spot.front);
    return true;
  });
}

/// What it touches before it is led anywhere.
void JointSolve::attach(const Vec3& position) noexcept {
  attached_ = true;
  held_.clear();
  const auto keep = [&](std::size_t index, const Place& place, const Vec3& normal) {
    Held held;
    hold(index, place, normal, held);
    if (touches(held, position)) held_.push_back(held);
  };
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    Entry& entry = entries_[i];
    if (!entry.smooth) continue;
    const Touched& touch = *entry.touch;
    const OfSurface& surface = touch.contact->surface;
    if (!touch.moved) {
      for (const Place& place : surface.places) {
        if (place.known()) keep(i, place, touch.turned(surface.normal));
      }
      continue;
    }
    const Vec3 local = touch.to_local(position);
    const Foot foot =
        on_smooth_view(touch.view, [&](const auto& view) { return view.nearest(local, 2.0 * margin(), entry.near); });
    if (!foot.found()) continue;
    const bool back =
        on_smooth_view(touch.view, [&](const auto& view) { return foot.normal.dot(view.front(foot)) < 0.0; });
    if (!back || touch.facts->sides == Sides::both) keep(i, {foot.element, back, foot.at}, touch.turned(foot.normal));
  }
}

DescentEnd JointSolve::walk(Held& held, const Vec3& goal, bool may_leave, int moves,
                            std::uint32_t work) const noexcept {
  const Touched& touch = *entries_[held.owner].touch;
  return on_smooth_view(touch.view, [&](const auto& view) {
    using Spot = typename std::decay_t<decltype(view)>::Spot;
    Spot spot = view.at(held.place, held.place.side() * touch.turned_back(held.normal));
    const DescentEnd end = view.descend(held.place, spot,
                                        {.point = touch.to_local(goal),
                                         .may_leave = may_leave,
                                         .sides = touch.facts->sides,
                                         .moves = moves,
                                         .work = work});
    held.point = touch.to_world(spot.point);
    held.normal = held.place.side() * touch.turned(spot.front);
    return end;
  });
}

ConstraintPlane JointSolve::plane_at(const Held& held) const noexcept {
  const Touched& touch = *entries_[held.owner].touch;
  return {held.normal,
          held.normal.dot(held.point),
          0.0,
          held.owner,
          {touch.to_local(held.point), touch.turned_back(held.normal), 0.0, held.place.element, held.place.at}};
}

/// Planes of what the point touches: first those of `held_`, in their order.
void JointSolve::planes_at(const Vec3& position, PlaneSet& out) noexcept {
  out.clear();
  for (const Held& held : held_) out.push_back(plane_at(held));
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (!entries_[i].smooth) triangle_planes(i, position, margin(), out);
  }
  for (const ConstraintPlane& wall : feet_) {
    if (!stands_among(wall, out)) out.push_back(wall);
  }
}

/// A place that is on some folds of one surface, a skin off them, and off the others that it touches.
Vec3 JointSolve::off(const HeldSet& on, std::size_t owner, const Vec3& position) const noexcept {
  constexpr double most_skins = 16.0;
  const double skin = entries_[owner].skin;
  PlaneSet planes;
  for (const Held& held : on) {
    if (held.owner == owner) planes.push_back({held.normal, held.normal.dot(position), skin, held.owner, {}});
  }
  for (const Held& held : held_) {
    const double above = held.normal.dot(position - held.point);
    if (held.owner == owner && above < skin && touches(held, position))
      planes.push_back({held.normal, held.normal.dot(position), skin, held.owner, {}});
  }
  const PlaneProjection away = project_onto_planes(position, planes, true);
  // Between folds that all but meet there is no such place near.
  if (away.feasible && (away.point - position).norm() <= most_skins * skin) return away.point;
  return position + skin * planes[0].normal;
}

/// What a point meets first on its way; of the surfaces that it goes along (`from`, and where on them it comes to, in
/// the same order) only what overlaps them.
JointSolve::Met JointSolve::first_met(const Segment& motion, const HeldSet& from, const HeldSet& to) noexcept {
  Met met;
  if ((motion.to - motion.from).norm() == 0.0) return met;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const Entry& entry = entries_[i];
    const Touched& touch = *entry.touch;
    const Sides sides = touch.facts->sides;
    Segment local = touch.to_local(motion);
    SweptHit hit;
    const bool along = std::any_of(from.begin(), from.end(), [&](const Held& held) { return held.owner == i; });
    if (along) {
      const auto* relief = std::get_if<ReliefView>(&touch.view);
      if (relief == nullptr || !relief->overlaps()) continue;
      // The folds that it keeps to are held anyway, however they bend between the two places.
      FixedVector<std::uint32_t, 2 * HeldSet::capacity()> faces;
      for (std::size_t k = 0; k < from.size(); ++k) {
        if (from[k].owner != i) continue;
        faces.push_back(from[k].place.element);
        faces.push_back(to[k].place.element);
      }
      const Segment moved{off(from, i, motion.from), off(to, i, motion.to)};
      hit = relief->beside({faces.begin(), faces.end()}, touch.to_local(moved), sides);
    }
    if (!entry.smooth) {
      hit = std::get_if<TriangleView>(&touch.view)->sweep(local, margin(), sides);
    } else if (!along) {
      // From a little above what it touches there.
      for (const Held& held : held_) {
        if (held.owner != i) continue;
        const double short_of = 0.5 * entry.skin - held.normal.dot(motion.from - held.point);
        if (short_of > 0.0) local.from += short_of * touch.turned_back(held.normal);
      }
      hit = on_smooth_view(touch.view, [&](const auto& view) { return view.first_touch(local, sides); });
      hit.hit = hit.hit && !hit.contact.normal.isZero();
    }
    if (hit.hit && (!met.hit || hit.t < met.t)) met = {true, hit.t, i, hit};
  }
  return met;
}

/// Holds it to what it has met; of the same place before, only the newer. Where there is no room, it stays with the
/// ones that it had, and the number is none of theirs.
std::size_t JointSolve::hold_to(const Met& met) noexcept {
  const Touched& touch = *entries_[met.owner].touch;
  const Foot& contact = met.what.contact;
  Held held;
  hold(met.owner, {contact.element, met.what.side < 0.0, contact.at}, touch.turned(contact.normal), held);
  constexpr double same_direction = 0.999;
  for (std::size_t i = 0; i < held_.size(); ++i) {
    if (held_[i].owner != held.owner || !(held_[i].normal.dot(held.normal) > same_direction)) continue;
    held_[i] = held;
    return i;
  }
  return held_.push_back(held) ? held_.size() - 1 : held_.size();
}

/// From near them onto all of the surfaces that `on` names, and as near as it can to where it is: Newton's steps on
/// their tangent planes. `walls`: of triangles, which it stays on as well.
bool JointSolve::onto(HeldSet& on, const PlaneSet& walls, Vec3& position) noexcept {
  constexpr int most_steps = 8;
  Vec3 p = position;
  for (int step = 0; step < most_steps; ++step) {
    PlaneSet planes = walls;
    double off = 0.0;
    for (Held& held : on) {
      walk(held, p, false, short_walk);
      const ConstraintPlane plane = plane_at(held);
      off = std::max(off, std::abs(held.normal.dot(p - held.point)) / entries_[held.owner].skin);
      planes.push_back(plane);
    }
    for (const ConstraintPlane& wall : walls)
      off = std::max(off, std::abs(wall.normal.dot(p) - wall.offset - wall.skin) / entries_[wall.owner].skin);
    if (off <= 0.1) {
      position = p;
      return true;
    }
    if (planes.size() == 1 && walls.empty()) {
      position = on[0].point;
      return true;
    }
    if (!onto_all(planes, p)) return false;
  }
  return false;
}

/// To where some of what it is held to and walls meet, near a place. Whether they do, with nothing else on the way.
bool JointSolve::come_to(std::span<const std::size_t> which, const PlaneSet& walls, Vec3 place, Vec3& proxy) noexcept {
  HeldSet before;
  for (const std::size_t one : which) before.push_back(held_[one]);
  HeldSet on = before;
  if (!onto(on, walls, place) || first_met({proxy, place}, before, on).hit) return false;
  for (std::size_t k = 0; k < which.size(); ++k) held_[which[k]] = on[k];
  proxy = place;
  return true;
}

/// Along one surface to the goal, or to what is in the way: `stopped`, then. Whether it came to rest on it.
bool JointSolve::slide(std::size_t which, const Vec3& goal, Vec3& proxy, std::size_t& stopped) noexcept {
  stopped = no_owner;
  int leg = first_leg;
  for (int walked = 0; walked < most_walk && !work_.spent(); leg *= 2) {
    walked += leg;
    const HeldSet had = held_;
    HeldSet before;
    before.push_back(held_[which]);
    const DescentEnd end = walk(held_[which], goal, true, leg, work_.left());
    HeldSet after;
    after.push_back(held_[which]);
    const Vec3 to = held_[which].point;
    const Met met = first_met({proxy, to}, before, after);
    if (!met.hit) {
      proxy = to;
      if (end != DescentEnd::limited) return end != DescentEnd::left;
      continue;
    }
    stopped = met.owner;
    held_[which] = before[0];
    // To where the two meet; or else, from where it was, by planes that hold both.
    FixedVector<std::size_t, 2> both;
    both.push_back(which);
    PlaneSet walls;
    if (entries_[met.owner].smooth) {
      const std::size_t other = hold_to(met);
      if (other == which || other == held_.size()) return false;
      both.push_back(other);
    } else {
      walls.push_back(plane_of(met.owner, met.what.contact));
    }
    if (come_to({both.begin(), both.end()}, walls, proxy + met.t * (to - proxy), proxy) || leg <= short_leg)
      return false;
    // The way bends, and what its chord meets it may never come to.
    held_ = had;
    leg = short_leg / 2;
  }
  return false;
}

Vec3 JointSolve::put_down(const Vec3& position) noexcept {
  if (!leads_point()) return position;
  attach(position);
  Vec3 down = position;
  for (const Held& held : held_) {
    const double above = held.normal.dot(down - held.point);
    down -= std::clamp(above, 0.0, entries_[held.owner].skin) * held.normal;
  }
  return down;
}

Vec3 JointSolve::lifted(const Vec3& position) const noexcept {
  Vec3 out = position;
  for (const Held& held : held_) {
    const double skin = entries_[held.owner].skin;
    out += std::max(0.0, skin - held.normal.dot(out - held.point)) * held.normal;
  }
  return out;
}

/// Straight to the goal through free space. Whether it got there.
bool JointSolve::fly(const Vec3& goal, Vec3& proxy) noexcept {
  Vec3 start = lifted(proxy);
  if (first_met({proxy, start}, held_, held_).hit) start = proxy;
  held_.clear();
  const Met met = first_met({start, goal}, {}, {});
  if (!met.hit) {
    proxy = goal;
    return true;
  }
  if (entries_[met.owner].smooth) {
    proxy = held_[hold_to(met)].point;
  } else {
    proxy = start + met.t * (goal - start);
  }
  return false;
}

/// What a step along a crease keeps to. A step that is not the `whole` way only what it touches: it comes to what it
/// does not touch yet at the end of the way, not on a part of it. `also`: walls that it has met where it stands.
JointSolve::Along JointSolve::along(const PlaneSet& planes, const PlaneProjection& projection, const PlaneSet& also,
                                    const Vec3& position, bool whole) const noexcept {
  Along along;
  along.walls = also;
  along.pressed = also.empty();
  for (const PlaneProjection::Active& active : projection.active) {
    const ConstraintPlane& plane = planes[active.plane];
    const bool near = plane.normal.dot(position) - plane.offset - plane.skin <= 2.0 * margin();
    along.pressed = along.pressed && active.multiplier > 0.0 && near;
    if (!whole && !near) continue;
    if (active.plane < held_.size()) {
      along.which.push_back(active.plane);
    } else if (!stands_among(plane, also)) {
      along.walls.push_back(plane);
    }
  }
  return along;
}

/// Whether what it touches and does not go along is not in the way at `position`, where they are led to.
bool JointSolve::clear_of_others(const Along& along, const Vec3& position, HeldSet& held) const noexcept {
  for (std::size_t i = 0; i < held.size(); ++i) {
    if (along.keeps_to(i)) continue;
    walk(held[i], position, false, short_walk);
    if (!(held[i].normal.dot(position - held[i].point) >= -0.1 * entries_[held[i].owner].skin)) return false;
  }
  return true;
}

/// To where it meets a surface on its way that it did not know of; or else it knows of it from now on.
JointSolve::Move JointSolve::come_to_met(std::size_t met, Along& along, const Vec3& place, const Vec3& goal,
                                         Vec3& proxy) noexcept {
  const Vec3 left = proxy;
  const HeldSet held = held_;
  along.which.push_back(met);
  if ((place - left).norm() > tolerance_ &&
      come_to({along.which.begin(), along.which.end()}, along.walls, place, proxy) && nearer(proxy, left, goal))
    return Move::nearer;
  proxy = left;
  held_ = held;
  return Move::learned;
}

/// Along the crease between what holds it, or a part of the way.
JointSolve::Move JointSolve::step_between(const PlaneSet& planes, const PlaneProjection& projection, const Vec3& goal,
                                          Vec3& proxy) noexcept {
  constexpr int most_attempts = 4;
  constexpr double most_grains = 4.0;
  constexpr double shorter = 0.35;
  Vec3 step = projection.point - proxy;
  bool whole = true;
  for (const PlaneProjection::Active& active : projection.active) {
    if (active.plane >= held_.size()) continue;
    const double most = most_grains * entries_[held_[active.plane].owner].grain;
    if (step.norm() <= most) continue;
    step *= most / step.norm();
    whole = false;
  }
  PlaneSet also;
  for (int attempt = 0; attempt < most_attempts; ++attempt) {
    Along along = this->along(planes, projection, also, proxy, whole);
    HeldSet after = held_;
    HeldSet from;
    for (const std::size_t which : along.which) from.push_back(held_[which]);
    HeldSet on = from;
    Vec3 next = proxy + step;
    const bool meet = onto(on, along.walls, next);
    const bool good = meet && nearer(next, proxy, goal);
    whole = false;
    if (meet && !good && attempt + 1 < most_attempts) {
      const double distance = (proxy - goal).norm();
      const double gain = (goal - proxy).dot(step) / distance;
      if (gain > 0.0) step *= nearest_share(gain, (next - goal).norm() - distance);
      if (!(gain > 0.0 && step.norm() > tolerance_)) return along.pressed ? Move::rest : Move::none;
      continue;
    }
    if (good && clear_of_others(along, next, after)) {
      for (std::size_t k = 0; k < on.size(); ++k) after[along.which[k]] = on[k];
      const Met met = first_met({proxy, next}, from, on);
      if (!met.hit) {
        held_ = after;
        proxy = next;
        return Move::nearer;
      }
      if (entries_[met.owner].smooth) {
        const HeldSet before = held_;
        const std::size_t known = hold_to(met);
        if (known == held_.size()) return Move::none;
        if (!along.keeps_to(known)) return come_to_met(known, along, proxy + met.t * (next - proxy), goal, proxy);
        // It keeps to that already: no farther than there.
        held_ = before;
      } else {
        const ConstraintPlane wall = plane_of(met.owner, met.what.contact);
        if (!stands_among(wall, planes)) {
          remember(wall);
          return Move::learned;
        }
        if (met.t * step.norm() <= tolerance_ && !stands_among(wall, along.walls)) {
          also.push_back(wall);
          continue;
        }
      }
      step *= std::max(0.0, met.t - 1e-3);
    } else {
      step *= shorter;
    }
    if (step.norm() <= tolerance_) break;
  }
  return Move::none;
}

/// Knows of what it touches where it is now, and forgets the rest.
void JointSolve::release(const Vec3& position) noexcept {
  for (std::size_t i = held_.size(); i-- > 0;) {
    if (held_[i].point != position) walk(held_[i], position, false, short_walk);
    if (!touches(held_[i], position)) held_.swap_remove(i);
  }
}

/// The goal's nearest place on the crease between one surface that holds the point and what has stopped it there,
/// though its plane, as it is known, would let it pass. False where there is none.
bool JointSolve::along_crease(std::size_t which, std::size_t stopped, const Vec3& goal, const PlaneSet& planes,
                              PlaneProjection& projection) const noexcept {
  std::size_t other = planes.size();
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (i != which && planes[i].owner == stopped) other = i;
  }
  if (other == planes.size()) return false;
  PlaneSet both;
  both.push_back(planes[which]);
  both.push_back(planes[other]);
  Vec3 target = goal;
  if (!onto_all(both, target)) return false;
  projection.point = target;
  projection.active.clear();
  projection.active.push_back({which, 0.0});
  projection.active.push_back({other, 0.0});
  return true;
}

void JointSolve::settle_point(const Vec3& goal, ConstraintSolution& solution) noexcept {
  constexpr int most_moves = 64;
  constexpr int most_idle = 2;
  constexpr double short_slide = 0.1;  // of what it was to go
  if (!attached_) attach(solution.proxy);
  Vec3& proxy = solution.proxy;
  PlaneSet& planes = solution.planes;
  // What stands around one place is known after a few looks: planes that are met again and again hold nothing more.
  constexpr int most_learned = 6;
  int learned = 0;
  int idle = 0;
  std::size_t stopped = no_owner;
  for (int move = 0; move < most_moves && !solution.converged && !work_.spent(); ++move) {
    planes_at(proxy, planes);
    PlaneProjection projection = project_onto_planes(goal, planes, true);
    const Vec3 before = proxy;
    const Vec3 step = projection.point - proxy;
    if (projection.active.empty()) {
      solution.converged = fly(goal, proxy);
    } else if (step.norm() <= tolerance_) {
      solution.converged = true;
      return;
    } else {
      std::size_t lead = held_.size();
      double strongest = 0.0;
      for (const PlaneProjection::Active& active : projection.active) {
        if (active.plane >= held_.size() || !(active.multiplier > strongest)) continue;
        strongest = active.multiplier;
        lead = active.plane;
      }
      const bool crease = projection.active.size() > 1 || lead == held_.size() ||
                          (stopped != no_owner && along_crease(lead, stopped, goal, planes, projection));
      const Move way = crease ? step_between(planes, projection, goal, proxy) : Move::none;
      if (way == Move::rest) {
        solution.converged = true;
        return;
      }
      if (way == Move::learned && ++learned <= most_learned) continue;
      if (way != Move::nearer && lead < held_.size()) {
        solution.converged = slide(lead, goal, proxy, stopped);
        if ((proxy - before).norm() > short_slide * step.norm()) stopped = no_owner;
      }
    }
    release(proxy);
    if ((before - goal).norm() - (proxy - goal).norm() > worth_going_on * tolerance_) {
      idle = learned = 0;
      feet_.clear();
    } else if (++idle == most_idle) {
      // No motion comes nearer: a local minimum, found by trying.
      solution.converged = true;
    }
  }
  planes_at(proxy, planes);
}

void JointSolve::remember_held(std::size_t index, const ConstraintSolution& solution) noexcept {
  const Touched& touch = *entries_[index].touch;
  OfSurface& state = touch.contact->surface;
  state.places.clear();
  double strongest = 0.0;
  const ConstraintPlane* leads = nullptr;
  for (const PlaneProjection::Active& active : solution.projection.active) {
    const ConstraintPlane& plane = solution.planes[active.plane];
    if (plane.owner != index || !(active.multiplier > strongest)) continue;
    strongest = active.multiplier;
    leads = &plane;
  }
  if (leads != nullptr) state.normal = touch.turned_back(leads->normal);
  for (const Held& held : held_) {
    if (held.owner != index || !state.places.push_back(held.place)) continue;
    const bool first =
        leads != nullptr && leads->contact.element == held.place.element && leads->contact.at == held.place.at;
    if (first) std::swap(state.places[0], state.places[state.places.size() - 1]);
  }
}

/// What the planes do not explain the spring holds: it runs to where the proxy is.
void JointSolve::explain(const Vec3& goal, ConstraintSolution& solution) noexcept {
  const Vec3& proxy = solution.proxy;
  solution.projection = project_onto_planes(goal, solution.planes, false);
  const Vec3 spring = proxy - goal;
  const double length = spring.norm();
  if (length == 0.0 || (solution.projection.point - proxy).norm() <= tolerance_ + margin() + widest_skin_) return;
  if (solution.projection.active.size() <= 1 && !solution.planes.empty()) {
    // At the bottom of a valley, at a rim: held along the spring.
    const std::size_t which = solution.projection.active.empty() ? 0 : solution.projection.active[0].plane;
    ConstraintPlane& plane = solution.planes[which];
    plane.normal = spring / length;
    plane.offset = plane.normal.dot(proxy);
    plane.skin = 0.0;
    solution.projection.point = proxy;
    solution.projection.active.clear();
    solution.projection.active.push_back({which, length});
    solution.projection.feasible = true;
    return;
  }
  for (ConstraintPlane& plane : solution.planes) plane.offset = plane.normal.dot(proxy);
  solution.projection = project_onto_planes(goal, solution.planes, false);
  solution.projection.feasible = false;
}

}  // namespace asperity
