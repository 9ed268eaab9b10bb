#include "asperity/render/contact/joint.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "asperity/core/principal_axes.h"
#include "asperity/geometry/triangle_contact.h"

namespace asperity {

namespace {

constexpr int most_attempts = 4;
// Between two walls a ball is pushed from one to the other, each time by less.
constexpr int most_pushes = 12;
// On a relief a move of this share of its finest grain is not worth making, on what bends smoothly of this one; on
// triangles near the corner of a valley single moves can be a fraction of the skin long and still lead out of it.
constexpr double rest_of_grain = 2e-3;
constexpr double rest_of_smooth_grain = 2e-4;
constexpr double rest_of_skin_beside_smooth = 0.05;
// A point is blown up to a ball of this share of the finest grain where it may touch two places of a relief at once.
constexpr double point_of_grain = 1e-3;

}  // namespace

void JointSolve::add(Touched& touch) noexcept {
  Entry entry;
  entry.touch = &touch;
  entry.smooth = touch.facts->smooth;
  entry.near = touch.contact->first();
  if (touch.facts->facets) {
    // As many patches as contacts: never full.
    facets_ = true;
    entry.patch = patches_->emplace_back();
    entry.patch->start(*relief_of(*touch.instance), touch.instance->law.facets());
    entry.skin = entry.patch->skin();
  } else {
    entry.skin = on_view(touch.view, [](const auto& view) { return view.skin(); });
  }
  on_smooth_view(touch.view, [&](const auto& view) {
    if (!entry.smooth) return;
    entry.grain = view.grain();
    entry.direct = view.direction_from();
    entry.folds = view.has_folds();
  });
  widest_skin_ = std::max(widest_skin_, entry.skin);
  entries_.push_back(entry);
  if (!entry.smooth) return;
  smooth_ = true;
  margin_ = std::max(margin_, 4.0 * entry.skin);
  if (entry.folds) blown_up_ = std::max(blown_up_, point_of_grain * entry.grain);
}

bool JointSolve::complete() const noexcept {
  bool all = true;
  for (const Entry& entry : entries_) all = all && (entry.patch == nullptr || entry.patch->complete());
  return all;
}

bool JointSolve::rolls(const ConstraintPlane& plane) const noexcept {
  return radius_ > 0.0 && entries_[plane.owner].patch == nullptr && plane.contact.at.minCoeff() <= 0.0;
}

bool JointSolve::foot_plane(std::size_t index, const Vec3& position, ConstraintPlane& plane) noexcept {
  Entry& entry = entries_[index];
  const Touched& touch = *entry.touch;
  const Vec3 local = touch.to_local(position);
  // How far beyond touching a tangent plane is worth knowing.
  const double reach = radius_ + gap(entry) + (entry.folds ? 2.0 * entry.skin : 0.05 * entry.grain);
  const Foot foot =
      on_smooth_view(touch.view, [&](const auto& view) { return view.nearest(local, reach, entry.near); });
  return foot.found() && plane_off(index, local, foot, entry.near, plane);
}

/// The plane that keeps a ball, its centre at `local`, off a place of a smooth surface. False where that is behind it.
bool JointSolve::plane_off(std::size_t index, const Vec3& local, const Foot& foot, Place& place,
                           ConstraintPlane& plane) const noexcept {
  const Entry& entry = entries_[index];
  const Touched& touch = *entry.touch;
  // Between folds the nearest point may be an edge: away from it, the ball rolls over it. A foot that is all but
  // reached has no direction of its own, the surface's is taken.
  const Vec3 way = foot.distance > entry.direct ? Vec3((local - foot.point) / foot.distance) : foot.normal;
  const Vec3 front = on_smooth_view(touch.view, [&](const auto& view) { return Vec3(view.front(foot)); });
  place = {foot.element, way.dot(front) < 0.0, foot.at};
  if (place.back && touch.facts->sides == Sides::front) return false;
  const Vec3 normal = touch.turned(way);
  plane = {normal, normal.dot(touch.to_world(foot.point)) + radius_, gap(entry), static_cast<std::uint32_t>(index),
           foot};
  return true;
}

void JointSolve::remember(const ConstraintPlane& plane) noexcept {
  // One plane a direction: the newest.
  constexpr double same_direction = 0.999;
  bool known = false;
  for (std::size_t i = feet_.size(); i-- > 0;) {
    if (feet_[i].owner != plane.owner || !(feet_[i].normal.dot(plane.normal) > same_direction)) continue;
    feet_.swap_remove(i);
    known = true;
  }
  if (feet_.size() == feet_.capacity()) feet_.swap_remove(0);
  met_ = met_ || !known;
  feet_.push_back(plane);
}

double JointSolve::distance_to_foot(const ConstraintPlane& plane, const Vec3& position) const noexcept {
  return (position - entries_[plane.owner].touch->to_world(plane.contact.point)).norm();
}

ConstraintPlane JointSolve::plane_of(std::size_t index, const Foot& contact) const noexcept {
  const Entry& entry = entries_[index];
  const Vec3 normal = entry.touch->turned(contact.normal);
  return {normal, normal.dot(entry.touch->to_world(contact.point)) + radius_, gap(entry),
          static_cast<std::uint32_t>(index), contact};
}

/// What of its triangles the ball touches.
void JointSolve::triangle_planes(std::size_t index, const Vec3& position, double within, PlaneSet& out) noexcept {
  Entry& entry = entries_[index];
  const Touched& touch = *entry.touch;
  const Vec3 local = touch.to_local(position);
  ContactSet contacts;
  if (entry.patch != nullptr) {
    entry.patch->contacts(local, within, touch.facts->sides, contacts);
  } else {
    std::get_if<TriangleView>(&touch.view)->contacts(local, within, touch.facts->sides, contacts);
  }
  for (const Foot& contact : contacts) out.push_back(plane_of(index, contact));
}

void JointSolve::touched(const Vec3& position, PlaneSet& out) noexcept {
  if (leads_point()) {
    if (!attached_) attach(position);
    planes_at(position, out);
    return;
  }
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    Entry& entry = entries_[i];
    if (knows_feet(entry)) {
      if (following_) {
        followed_planes(i, position, out);
      } else {
        for (const ConstraintPlane& plane : feet_planes(i, position)) out.push_back(plane);
      }
      continue;
    }
    if (entry.smooth) {
      ConstraintPlane plane;
      if (!foot_plane(i, position, plane)) continue;
      remember(plane);
      // Near a surface without folds its tangent plane holds before it is touched.
      if (!entry.folds) out.push_back(plane);
      continue;
    }
    triangle_planes(i, position, radius_ + margin(), out);
  }
  for (std::size_t i = feet_.size(); i-- > 0;) {
    const ConstraintPlane& plane = feet_[i];
    if (stands_among(plane, out)) continue;
    // Feet found on the way stay about as long as their surface bends.
    const double around = radius_ + plane.skin;
    if (plane.normal.dot(position) - plane.offset - plane.skin <= 0.1 * around + stride_ &&
        distance_to_foot(plane, position) <= 1.4 * around + stride_) {
      out.push_back(plane);
    } else {
      feet_.swap_remove(i);
    }
  }
}

/// Planes of what is touched, not only near: what friction can hold by.
void JointSolve::rests_on(const Vec3& position, PlaneSet& out) noexcept {
  touched(position, out);
  for (std::size_t i = out.size(); i-- > 0;) {
    const ConstraintPlane& plane = out[i];
    const double rest = 2.0 * plane.skin + rest_of_smooth_grain * entries_[plane.owner].grain;
    if (plane.normal.dot(position) - plane.offset - plane.skin > rest) out.swap_remove(i);
  }
}

/// How far a ball may go so that its centre stays half of it away from a smooth surface: from there it can be pushed
/// back to where it came from. As far each time as nothing is near.
double JointSolve::free_share_of_ball(Entry& entry, const Segment& motion) noexcept {
  constexpr int most_strides = 32;
  const Vec3 way = motion.to - motion.from;
  const double length = way.norm();
  const double inner = 0.5 * (radius_ + margin());
  double gone = 0.0;
  for (int stride = 0; stride < most_strides; ++stride) {
    const Vec3 here = motion.from + gone / length * way;
    const Foot foot = on_smooth_view(entry.touch->view, [&](const auto& view) {
      const Foot found = view.nearest(here, length - gone + inner, entry.near);
      if (found.found()) entry.near = {found.element, false, found.at};
      return found;
    });
    if (!foot.found()) return 1.0;
    const double free = foot.distance - inner;
    if (gone + free >= length) return 1.0;
    if (free < 1e-3 * inner) break;
    gone += free;
  }
  return gone / length;
}

double JointSolve::free_share(const Segment& motion) noexcept {
  double share = 1.0;
  const double length = (motion.to - motion.from).norm();
  if (length == 0.0) return share;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    Entry& entry = entries_[i];
    const Touched& touch = *entry.touch;
    const Sides sides = touch.facts->sides;
    const Segment local = touch.to_local(motion);
    if (entry.patch != nullptr) {
      share = std::min(share, entry.patch->segment(local, radius_ + margin(), sides).t);
    } else if (!entry.smooth) {
      const SweptHit hit = std::get_if<TriangleView>(&touch.view)->sweep(local, radius_ + margin(), sides);
      share = std::min(share, hit.t);
      // What stops it may be farther off than what counts as touched.
      if (smooth_ && hit.hit && hit.t < 1.0) remember(plane_of(i, hit.contact));
    } else {
      const SweptHit hit = on_smooth_view(touch.view, [&](const auto& view) { return view.first_touch(local, sides); });
      // The centre itself must stay outside: half of the ball before what it meets.
      if (hit.hit) share = std::min(share, std::max(0.0, hit.t - 0.5 * (radius_ + margin()) / length));
      // What is thinner than a real ball must not slip past it; what is thinner than a blown-up point is below its
      // skin.
      if (radius_ > 0.25 * entry.grain) share = std::min(share, free_share_of_ball(entry, local));
    }
  }
  return share;
}

bool JointSolve::push_out(Vec3& position) noexcept {
  PlaneSet held;
  for (int push = 0; push < most_pushes; ++push) {
    bool clear = true;
    // Of those that tell all, what is there now.
    for (std::size_t k = held.size(); k-- > 0;) {
      if (knows_feet(entries_[held[k].owner])) held.swap_remove(k);
    }
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      if (!entries_[i].smooth) continue;
      if (knows_feet(entries_[i])) {
        for (const ConstraintPlane& foot : feet_planes(i, position)) {
          if (!held.push_back(foot)) return false;
          if (foot.offset + foot.skin - foot.normal.dot(position) <= 0.25 * entries_[i].skin) continue;
          remember(foot);
          clear = false;
        }
        continue;
      }
      ConstraintPlane plane;
      if (!foot_plane(i, position, plane)) continue;
      remember(plane);
      if (plane.offset + plane.skin - plane.normal.dot(position) <= 0.25 * entries_[i].skin) continue;
      if (held.size() == held.capacity()) return false;
      held.push_back(plane);
      clear = false;
    }
    if (clear) return true;
    const Vec3 out = project_onto_planes(position, held, true).point;
    const double share = free_share({position, out});
    position += share * (out - position);
    // Between walls it is led along all of them.
    if (share < 1.0) {
      PlaneSet walls;
      for (std::size_t i = 0; i < entries_.size(); ++i) {
        if (!entries_[i].smooth) triangle_planes(i, position, radius_ + margin(), walls);
      }
      for (const ConstraintPlane& wall : walls) {
        if (!stands_among(wall, held)) held.push_back(wall);
      }
    }
  }
  return false;
}

/// Along the step and out of what is met there, or along a part of it. False when no part of it comes nearer.
bool JointSolve::advance(const Vec3& whole, const Vec3& goal, Vec3& proxy) noexcept {
  Vec3 step = whole;
  met_ = false;
  const double distance = (proxy - goal).norm();
  for (int attempt = 0; attempt < most_attempts; ++attempt) {
    Vec3 next = proxy + free_share({proxy, proxy + step}) * step;
    if (push_out(next) && (next - goal).norm() < distance - 1e-2 * tolerance_) {
      proxy = next;
      return true;
    }
    step *= 0.35;
    if (step.norm() <= tolerance_) break;
  }
  return false;
}

/// Forgets feet whose planes hold the ball, but not where it is. False where there were none.
bool JointSolve::loosen(const Vec3& position) noexcept {
  stride_ = 0.0;
  const std::size_t before = feet_.size();
  for (std::size_t i = before; i-- > 0;) {
    const double around = radius_ + feet_[i].skin;
    const double off = 1e-3 * around + tolerance_;
    if (feet_[i].normal.dot(position) - feet_[i].offset - feet_[i].skin <= off &&
        distance_to_foot(feet_[i], position) > around + off)
      feet_.swap_remove(i);
  }
  return feet_.size() < before;
}

/// Direction of the edge that a ball rests on, zero on a corner.
Vec3 JointSolve::edge_of(const ConstraintPlane& plane) const noexcept {
  const Touched& touch = *entries_[plane.owner].touch;
  const Vec3& at = plane.contact.at;
  Eigen::Index across = 0;
  at.minCoeff(&across);
  const auto next = static_cast<std::size_t>((across + 1) % 3);
  const auto last = static_cast<std::size_t>((across + 2) % 3);
  if (at[static_cast<Eigen::Index>(next)] <= 0.0 || at[static_cast<Eigen::Index>(last)] <= 0.0) return Vec3::Zero();
  const auto corners = std::get_if<TriangleView>(&touch.view)->surface().mesh().corners(plane.contact.element);
  return touch.turned((corners[last] - corners[next]).normalized());
}

/// Where a ball is led that has gone a little too far and touches nothing any more: along what it was about to come to,
/// in place of straight through that and back by a long motion. The goal, where nothing is that near.
Vec3 JointSolve::over_what_is_near(const Vec3& position, double gone, const Vec3& goal) noexcept {
  // As far as what it has left bends away from its motion; over a sharp edge farther.
  constexpr double of_motion = 0.5;
  constexpr double most_of_radius = 0.25;
  for (const double near : {passed_within(gone, radius_), std::min(of_motion * gone, most_of_radius * radius_)}) {
    PlaneSet planes;
    for (std::size_t i = 0; i < entries_.size(); ++i) triangle_planes(i, position, radius_ + margin() + near, planes);
    if (planes.empty()) continue;
    const Vec3 along = project_onto_planes(goal, planes, true).point;
    return (along - position).norm() > tolerance_ ? along : goal;
  }
  return goal;
}

/// Adds planes off what a ball has touched before and is still near to: where it rolls over an edge between others, its
/// tangent plane holds before that is touched.
void JointSolve::keep_near(const PlaneSet& earlier, const Vec3& position, PlaneSet& planes) const noexcept {
  constexpr double near = 0.25;  // of the radius
  for (const ConstraintPlane& plane : earlier) {
    const Touched& touch = *entries_[plane.owner].touch;
    const TriangleMesh& mesh = std::get_if<TriangleView>(&touch.view)->surface().mesh();
    const std::uint32_t face = plane.contact.element;
    const auto [a, b, c] = mesh.corners(face);
    const Vec3 local = touch.to_local(position);
    const Vec3 front = mesh.face_normal(face);
    const Foot foot = triangle_foot(face, closest_point_on_triangle(local, a, b, c), local, front, {});
    const bool behind = touch.facts->sides == Sides::front && front.dot(local - foot.point) < 0.0;
    if (behind || foot.distance > (1.0 + near) * radius_) continue;
    const bool there = std::any_of(planes.begin(), planes.end(), [&](const ConstraintPlane& other) {
      return other.owner == plane.owner && (other.contact.point - foot.point).norm() <= plane.skin;
    });
    if (!there) planes.push_back(plane_of(plane.owner, foot));
  }
}

/// The step of a ball from `proxy` to where planes would have it, by how round to it the edges are that it rolls along:
/// along what the planes leave free the squared distance bends by less than itself, and the step is to be longer.
Vec3 JointSolve::rolled(const PlaneSet& planes, const PlaneProjection& flat, const Vec3& proxy) const noexcept {
  constexpr double least_curvature = 0.05;
  const Vec3 step = flat.point - proxy;
  Mat3 free = Mat3::Identity();
  if (flat.active.size() == 1) {
    const Vec3& normal = planes[flat.active[0].plane].normal;
    free -= normal * normal.transpose();
  } else if (flat.active.size() == 2) {
    const Vec3 along = planes[flat.active[0].plane].normal.cross(planes[flat.active[1].plane].normal).normalized();
    free = along * along.transpose();
  } else {
    return step;
  }
  Mat3 bends = Mat3::Zero();
  for (const PlaneProjection::Active& active : flat.active)
    bends += active.multiplier * bend_of(planes[active.plane], proxy);
  const PrincipalAxes curvature = principal_axes(Mat3::Identity() - free * bends * free);
  const Vec3 pull = free * step;
  Vec3 more = curvature.scaling_by(curvature.values.cwiseMax(least_curvature).cwiseInverse()) * pull - pull;
  // No farther than the other planes let it.
  double share = 1.0;
  for (const ConstraintPlane& plane : planes) {
    const double room = plane.normal.dot(flat.point) - plane.offset - plane.skin;
    const double used = -plane.normal.dot(more);
    if (used > room + 1e-9 * more.norm()) share = std::min(share, std::max(0.0, room / used));
  }
  return step + share * more;
}

/// On triangles alone: from one set of planes to the next.
void JointSolve::settle_on_triangles(const Vec3& goal, ConstraintSolution& solution) noexcept {
  // Rarely needed, from this move on: planes of the last place are kept, of a point for one move in four, for valleys
  // so flat that either side is left before the other is felt; a ball rolls in steps that know how round to it the
  // edges are, and right above the one it rolls over it may stop.
  constexpr int most_moves = 64;
  constexpr int patience = 8;
  constexpr int most_passed = 3;  // moves that may end where nothing is touched any more
  constexpr double least_gain = 1e-6;
  PlaneSet earlier;
  PlaneSet& planes = solution.planes;
  double distance = infinity;
  double stride = 1.0;
  double gone = 0.0;
  Vec3 nearest = solution.proxy;
  int in_vain = 0;
  const bool ball = radius_ > 0.0 && !facets_;
  const auto remember_nearest = [&] {
    ++in_vain;
    if (!((solution.proxy - goal).squaredNorm() < (nearest - goal).squaredNorm())) return;
    nearest = solution.proxy;
    in_vain = 0;
  };
  for (int move = 0; move < most_moves && (ball || !work_.spent()); ++move) {
    const bool patient = move >= patience;
    if (patient) remember_nearest();
    // The middle of a ball that is led into an edge: it would roll to and fro over that for ever.
    solution.converged = ball && in_vain > patience;
    if (solution.converged) break;
    if (patient) earlier = planes;
    planes.clear();
    touched(solution.proxy, planes);
    if (patient && ball) keep_near(earlier, solution.proxy, planes);
    const bool rolling = move > 0 && planes.size() == 1 && rolls(planes[0]);
    Vec3 target = planes.size() == 1 ? onto_plane(goal, planes[0]) : project_onto_planes(goal, planes, true).point;
    const bool passed = planes.empty() && move > 0 && move <= most_passed;
    if (passed && radius_ > 0.0) target = over_what_is_near(solution.proxy, gone, goal);
    const Vec3 foot = rolling ? entries_[planes[0].owner].touch->to_world(planes[0].contact.point) : goal;
    if (rolling) target = rolling_target(planes[0], foot, edge_of(planes[0]), goal, target, patient ? 0.01 : 0.2);
    Vec3 step = target - solution.proxy;
    if (step.norm() <= tolerance_) {
      // Without contact nothing may remain between proxy and probe: free space gives no force at all.
      if (planes.empty()) solution.proxy = target;
      solution.converged = true;
      return;
    }
    if (rolling && patient) {
      if ((goal - foot).dot(planes[0].normal) < 0.0) {
        // The edge is between ball and goal: the ball rolls off it, slowly at first.
        stride *= 2.0;
        step *= std::min(stride, 0.2 * (solution.proxy - foot).norm() / step.norm());
      } else {
        const double now = (solution.proxy - goal).norm();
        solution.converged = std::exchange(distance, now) - now < least_gain * now;
        if (solution.converged) return;
      }
    } else if (patient && ball && in_vain < 2) {
      step = rolled(planes, project_onto_planes(goal, planes, true), solution.proxy);
    } else if (patient && !ball && move % 4 == 0) {
      PlaneSet both = planes;
      for (const ConstraintPlane& plane : earlier) both.push_back(plane);
      step = project_onto_planes(goal, both, true).point - solution.proxy;
    }
    const double t = free_share({solution.proxy, solution.proxy + step});
    solution.proxy = t < 1.0 ? Vec3(solution.proxy + t * step) : Vec3(solution.proxy + step);
    gone = t * step.norm();
  }
  // Not at rest: of all places that the moves came by, the nearest.
  remember_nearest();
  if (nearest == solution.proxy) return;
  solution.proxy = nearest;
  planes.clear();
  touched(nearest, planes);
}

/// Among surfaces of which some are smooth: only ever nearer to the goal.
void JointSolve::settle_among_smooth(const Vec3& goal, ConstraintSolution& solution) noexcept {
  constexpr int most_moves = 160;
  Vec3 refused = Vec3::Constant(infinity);  // where the last advance could not go
  for (int move = 0; move < most_moves && !work_.spent(); ++move) {
    solution.planes.clear();
    touched(solution.proxy, solution.planes);
    const Vec3 target = project_onto_planes(goal, solution.planes, true).point;
    const Vec3 step = target - solution.proxy;
    if (step.norm() <= tolerance_) {
      if (loosen(solution.proxy)) continue;
      if (solution.planes.empty()) solution.proxy = target;
      solution.converged = true;
      return;
    }
    stride_ = step.norm();
    if (advance(step, goal, solution.proxy)) {
      refused = Vec3::Constant(infinity);
      continue;
    }
    // No motion comes nearer: a local minimum, found by trying, if all that holds it there is known and is there.
    const bool again = (target - refused).norm() > tolerance_ && (met_ || loosen(solution.proxy));
    refused = target;
    if (again) continue;
    solution.converged = true;
    return;
  }
}

ConstraintSolution JointSolve::solve(const Vec3& from, const Vec3& goal) noexcept {
  ConstraintSolution solution;
  solution.proxy = from;
  if (smooth_) {
    tolerance_ = 0.0;
    for (const Entry& entry : entries_) {
      const double rest = entry.smooth ? (entry.folds ? rest_of_grain : rest_of_smooth_grain) * entry.grain
                                       : rest_of_skin_beside_smooth * entry.skin;
      tolerance_ = std::max(tolerance_, rest);
    }
    if (leads_point()) {
      settle_point(goal, solution);
      explain(goal, solution);
      if (!solution.settled() && solution.projection.active.empty()) share_out(goal, solution);
      return solution;
    }
    if (leads_ball()) {
      settle_ball(goal, solution);
    } else {
      settle_among_smooth(goal, solution);
    }
  } else {
    tolerance_ = infinity;
    for (const Entry& entry : entries_) tolerance_ = std::min(tolerance_, rest_on_triangles * entry.skin);
    settle_on_triangles(goal, solution);
  }
  solution.projection = project_onto_planes(goal, solution.planes, false);
  // Planes that would have it elsewhere are not all that holds it.
  if (smooth_ && !explains((solution.projection.point - solution.proxy).norm())) solution.converged = false;
  if (!solution.settled()) share_out(goal, solution);
  return solution;
}

ConstraintSolution JointSolve::on_border(const Place& place, const Vec3& goal) const noexcept {
  // In valleys that are sharper a skin off all sides is elsewhere.
  constexpr double most_skins = 4.0;
  ConstraintSolution solution;
  const Entry& entry = entries_[0];
  ContactSet around;
  std::get_if<TriangleView>(&entry.touch->view)->beside_border(place, around);
  if (around.empty()) return solution;
  for (const Foot& foot : around) solution.planes.push_back(plane_of(0, foot));
  solution.proxy = project_onto_planes(goal, solution.planes, true).point;
  solution.projection = project_onto_planes(goal, solution.planes, false);
  const Vec3 border = entry.touch->to_world(around[0].point);
  solution.converged =
      solution.projection.active.size() > 1 && (solution.proxy - border).norm() <= most_skins * entry.skin;
  return solution;
}

/// Of a proxy that is not at rest: what each of the planes around it would hold where it is now.
void JointSolve::share_out(const Vec3& goal, ConstraintSolution& solution) noexcept {
  const Vec3& proxy = solution.proxy;
  stride_ = 0.0;
  solution.planes.clear();
  touched(proxy, solution.planes);
  for (ConstraintPlane& plane : solution.planes) plane.offset = plane.normal.dot(proxy);
  solution.projection = project_onto_planes(goal, solution.planes, false);
  solution.projection.feasible = false;
  if (!solution.projection.active.empty() || proxy == goal || entries_.empty()) return;
  // Between two moves it touches nothing: what is nearest is in its way.
  const double way = (proxy - goal).norm();
  const Vec3 normal = (proxy - goal) / way;
  double nearest = infinity;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const Touched& touch = *entries_[i].touch;
    const Foot foot = on_view(touch.view, [&](const auto& view) {
      return view.nearest(touch.to_local(proxy), way + radius_ + gap(entries_[i]), entries_[i].near);
    });
    if (!foot.found() || foot.distance >= nearest) continue;
    nearest = foot.distance;
    solution.planes.clear();
    solution.planes.push_back({normal, normal.dot(proxy), 0.0, static_cast<std::uint32_t>(i), foot});
  }
  if (solution.planes.empty()) return;
  solution.projection.active.push_back({0, way});
}

void JointSolve::remember_places(std::size_t index, const ConstraintSolution& solution) noexcept {
  const Entry& entry = entries_[index];
  if (entry.smooth && leads_point()) return remember_held(index, solution);
  const Touched& touch = *entry.touch;
  OfSurface& state = touch.contact->surface;
  state.places.clear();
  double strongest = 0.0;
  for (const PlaneProjection::Active& active : solution.projection.active) {
    const ConstraintPlane& plane = solution.planes[active.plane];
    if (plane.owner != index) continue;
    const Vec3 normal = touch.turned_back(plane.normal);
    Place place{plane.contact.element, false, plane.contact.at};
    if (entry.smooth) {
      place.back =
          on_smooth_view(touch.view, [&](const auto& view) { return normal.dot(view.front(plane.contact)) < 0.0; });
    } else if (entry.patch == nullptr) {
      const OnFace on(touch, plane.contact, normal, solution.proxy);
      place = on.place;
      if (active.multiplier > strongest) state.height = on.height;
    }
    state.places.push_back(place);
    if (!(active.multiplier > strongest)) continue;
    strongest = active.multiplier;
    state.normal = normal;
    std::swap(state.places[0], state.places[state.places.size() - 1]);
  }
  if (state.places.empty() && entry.smooth && entry.near.known()) state.places.push_back(entry.near);
}

const ConstraintPlane* strongest_plane(std::size_t owner, const ConstraintSolution& solution) noexcept {
  const ConstraintPlane* plane = nullptr;
  double strongest = 0.0;
  for (const PlaneProjection::Active& active : solution.projection.active) {
    if (solution.planes[active.plane].owner != owner || active.multiplier <= strongest) continue;
    strongest = active.multiplier;
    plane = &solution.planes[active.plane];
  }
  return plane;
}

LawForce owner_force(const Touched& touch, const Material& material, std::size_t owner,
                     const ConstraintSolution& solution, const Vec3& goal, const ProbeSample& probe) noexcept {
  const ConstraintPlane* plane = strongest_plane(owner, solution);
  if (plane == nullptr) return {};
  Vec3 spring = Vec3::Zero();
  double strongest = 0.0;
  double strongest_of_all = 0.0;
  for (const PlaneProjection::Active& active : solution.projection.active) {
    strongest_of_all = std::max(strongest_of_all, active.multiplier);
    if (solution.planes[active.plane].owner != owner) continue;
    spring += active.multiplier * solution.planes[active.plane].normal;
    strongest = std::max(strongest, active.multiplier);
  }
  LawForce answer = pushed_by(spring, material.stiffness);
  const bool leads = strongest == strongest_of_all;
  // Not at rest yet: the spring runs to where the proxy really is.
  if (!solution.settled() && leads) {
    Vec3 rest = solution.proxy - goal;
    for (const PlaneProjection::Active& active : solution.projection.active)
      rest -= active.multiplier * solution.planes[active.plane].normal;
    answer.force += material.stiffness * rest;
  }
  const Vec3 along = leads ? Vec3(goal - probe.pose.position) : Vec3(Vec3::Zero());
  finish_push(touch, material, plane->contact, along, probe, answer);
  return answer;
}

}  // namespace asperity
