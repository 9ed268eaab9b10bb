// The joint solve of a ball among surfaces that tell all places it may rest on: Newton's method within their planes.

#include <algorithm>
#include <cmath>

#include "asperity/core/principal_axes.h"
#include "asperity/render/contact/joint.h"

namespace asperity {

namespace {

// A stride is no longer than this share of the radius: what it comes to is then still in front of the centre.
constexpr double longest_stride = 0.25;
// What it may come to is foreseen for a stride of this share at most, and where it rests for this one: what it lay
// between at the last tick it is not to meet anew.
constexpr double farthest_foreseen = 0.02;
constexpr double least_foreseen = 0.006;
// Of what a ball overlaps, a look tells so many places, and of what it overlaps most this share: three hold it, and
// pushed out of these it is looked again.
constexpr std::size_t most_feet = 12;
constexpr double deepest_share = 0.5;
// Curvature that a step reckons with at least, as a share of that of the distance to the goal: where less is left, the
// place is hardly held, or not at all, and strides are what is long enough.
constexpr double least_curvature = 0.1;
// What is further off than this share is not followed.
constexpr double farthest_followed = 0.3;
// Feet that are nearer than this share of the radius are led to where they are now, others stay the places they were.
constexpr double as_near = 2e-3;
constexpr int most_restores = 8;
// Of their multipliers, which are what overlaps are worth.
constexpr double overlap_weighs = 1.5;
// A ball may overlap what it touches by this share of how far it is kept off.
constexpr double found_of_margin = 5e-4;
// Of what is worth a move: a stride that is to be no longer is none.
constexpr double least_room = 0.01;

/// What holds a step, in the metric in which the distance to the goal is as round as near the place.
struct Metric {
  Mat3 inverse_root = Mat3::Identity();
  Mat3 matrix = Mat3::Identity();
};

Metric metric_of(const Mat3& hessian, double stiffest) noexcept {
  const PrincipalAxes principal = principal_axes(hessian);
  const Vec3 curvature = principal.values.cwiseMax(least_curvature).cwiseMin(stiffest);
  return {principal.scaling_by(curvature.cwiseSqrt().cwiseInverse()), principal.scaling_by(curvature)};
}

/// How the direction from a surface changes with the place at a distance from it, by how it changes on the surface.
Mat3 bend_at_distance(const Mat3& bend, double distance) noexcept {
  // Where it bends towards the place as much as a ball around that, it is as good as a corner.
  constexpr double least = 1e-6;
  const PrincipalAxes principal = principal_axes(bend);
  const Vec3& curvature = principal.values;
  return principal.scaling_by(curvature.array() / (1.0 + distance * curvature.array()).max(least));
}

/// A foot as exactly as the surface can tell it.
template <SurfaceView View>
Foot refined(const View& view, const Foot& foot, const Vec3& local) noexcept {
  if constexpr (requires { view.refined(foot, local); }) {
    if (foot.found()) return view.refined(foot, local);
  }
  return foot;
}

/// The nearest place, as exactly as the surface can tell it.
template <SurfaceView View>
Foot nearest_exactly(const View& view, const Vec3& p, double bound, const Place& start) noexcept {
  if constexpr (requires { view.nearest_exactly(p, bound, start); }) {
    return view.nearest_exactly(p, bound, start);
  } else {
    return view.nearest(p, bound, start);
  }
}

}  // namespace

bool JointSolve::knows_feet(const Entry& entry) const noexcept {
  return radius_ > 0.0 && entry.smooth && (!facets_ || std::holds_alternative<ReliefView>(entry.touch->view));
}

/// Of those, whether a look tells the nearest place alone.
bool JointSolve::tells_nearest_alone(const Entry& entry) const noexcept {
  return knows_feet(entry) && !std::holds_alternative<ReliefView>(entry.touch->view);
}

/// The second derivative of the distance from what a plane is of, where the ball's centre is.
Mat3 JointSolve::bend_of(const ConstraintPlane& plane, const Vec3& position) const noexcept {
  constexpr double as_surface = 1.0 - 1e-6;
  const Entry& entry = entries_[plane.owner];
  const Touched& touch = *entry.touch;
  const double distance = std::max(distance_to_foot(plane, position), 1e-9 * radius_);
  const Mat3 round = (Mat3::Identity() - plane.normal * plane.normal.transpose()) / distance;
  const auto around = [&](const Vec3& edge) { return Mat3(round - edge * edge.transpose() / distance); };
  if (!entry.smooth) return rolls(plane) ? around(edge_of(plane)) : Mat3(Mat3::Zero());
  const Vec3 front =
      touch.turned(on_smooth_view(touch.view, [&](const auto& view) { return Vec3(view.front(plane.contact)); }));
  const double aligned = plane.normal.dot(front);
  if (std::abs(aligned) < as_surface) {
    // On a fold, which goes across both; at its corners it is round.
    const bool corner = plane.contact.at.maxCoeff() >= 1.0 || !std::holds_alternative<ReliefView>(touch.view);
    return corner ? round : around(plane.normal.cross(front).normalized());
  }
  const Place place{plane.contact.element, false, plane.contact.at};
  const Mat3 bend = on_smooth_view(touch.view, [&](const auto& view) -> Mat3 {
    if constexpr (requires { view.bend(place, view.at(place, plane.contact.normal)); }) {
      return view.bend(place, view.at(place, plane.contact.normal));
    } else if constexpr (requires { view.bend_at(plane.contact.point); }) {
      return view.bend_at(plane.contact.point);
    } else {
      return Mat3::Zero();
    }
  });
  const Mat3 local = bend_at_distance(std::copysign(1.0, aligned) * bend, distance);
  if (touch.at_origin) return local;
  const Mat3 turn = touch.pose->orientation.toRotationMatrix();
  return turn * local * turn.transpose();
}

/// From `proxy` to the place that is nearest to the goal within planes, by how they and what they are of bend.
Vec3 JointSolve::bent_step(const PlaneSet& planes, const PlaneProjection& flat, const Vec3& proxy, const Vec3& goal,
                           double stiffest, double& gain) const noexcept {
  const Vec3 pull = goal - proxy;
  const Vec3 straight = flat.point - proxy;
  gain = pull.dot(straight) - 0.5 * straight.squaredNorm();
  if (flat.active.empty() || flat.active.size() == 3) return straight;
  Mat3 hessian = Mat3::Identity();
  for (const PlaneProjection::Active& active : flat.active)
    hessian -= active.multiplier * bend_of(planes[active.plane], proxy);
  const Metric metric = metric_of(hessian, stiffest);
  PlaneSet bent;
  for (const ConstraintPlane& plane : planes) {
    ConstraintPlane there;
    there.normal = metric.inverse_root * plane.normal;
    const double length = there.normal.norm();
    there.normal /= length;
    there.offset = (plane.offset + plane.skin - plane.normal.dot(proxy)) / length;
    bent.push_back(there);
  }
  const Vec3 step = metric.inverse_root * project_onto_planes(metric.inverse_root * pull, bent, true).point;
  gain = pull.dot(step) - 0.5 * step.dot(metric.matrix * step);
  return step;
}

/// Planes that keep the ball off all that it touches or would on the next step from here: of a relief what there is, of
/// others the nearest place and what is known already.
const PlaneSet& JointSolve::feet_planes(std::size_t index, const Vec3& position) noexcept {
  const double beyond = std::clamp(stride_, least_foreseen * radius_, longest_stride * radius_);
  if (last_feet_.index == index && last_feet_.position == position && last_feet_.beyond == beyond)
    return last_feet_.planes;
  last_feet_.index = index;
  last_feet_.position = position;
  last_feet_.beyond = beyond;
  last_feet_.planes.clear();
  Entry& entry = entries_[index];
  const Vec3 local = entry.touch->to_local(position);
  ContactSet feet;
  const double touching = radius_ + gap(entry) + 2.0 * entry.skin;
  const auto* relief = std::get_if<ReliefView>(&entry.touch->view);
  if (relief != nullptr) {
    relief->feet(local,
                 {.touching = touching, .reach = touching + beyond, .most = most_feet, .of_overlap = deepest_share},
                 feet);
  } else {
    const Foot foot = on_smooth_view(entry.touch->view, [&](const auto& view) {
      return nearest_exactly(view, local, touching + beyond, entry.near);
    });
    if (foot.found()) feet.push_back(foot);
  }
  keep_following(index, position, relief != nullptr ? touching + beyond : 0.0, feet);
  for (std::size_t i = 0; i < feet.size(); ++i) {
    Place place;
    ConstraintPlane plane;
    if (plane_off(index, local, feet[i], place, plane)) last_feet_.planes.push_back(plane);
    if (i == 0) entry.near = place;
  }
  return last_feet_.planes;
}

/// Where a place that is followed is led to by a ball whose centre is now `local`.
Foot JointSolve::led_to(const Entry& entry, const Vec3& local, const Foot& foot) noexcept {
  if (const auto* relief = std::get_if<ReliefView>(&entry.touch->view)) return relief->follow(local, foot);
  return on_smooth_view(entry.touch->view, [&](const auto& view) {
    const Vec3 front = view.front(foot);
    const double side = front.dot(local - foot.point) < 0.0 ? -1.0 : 1.0;
    Place place{foot.element, side < 0.0, foot.at};
    auto spot = view.at(place, front);
    view.descend(place, spot, {.point = local, .may_leave = false});
    Foot led{spot.point, Vec3::Zero(), (local - spot.point).norm(), place.element, place.at};
    if constexpr (requires { view.element_at(spot.point); }) led.element = view.element_at(spot.point);
    led.normal = side * view.front(led);
    return refined(view, led, local);
  });
}

/// After a look that has found `feet` nearer than `within` to a ball at `position`: adds what was followed there and
/// not found, and follows them all. What is further off stays followed.
void JointSolve::keep_following(std::size_t index, const Vec3& position, double within, ContactSet& feet) noexcept {
  const Entry& entry = entries_[index];
  const Vec3 local = entry.touch->to_local(position);
  const double farthest = (1.0 + farthest_followed) * radius_;
  const double near = radius_ + gap(entry) + as_near * radius_;
  for (std::size_t i = followed_.size(); i-- > 0;) {
    const Followed& one = followed_[i];
    if (one.index != index) continue;
    const double distance = (one.foot.point - local).norm();
    const bool is_near = !one.stays && distance <= near;
    if (!is_near && distance <= farthest && (one.stays || distance > within)) continue;
    if (is_near) {
      const Foot foot = led_to(entry, local, one.foot);
      const bool found =
          std::any_of(feet.begin(), feet.end(), [&](const Foot& other) { return same_place(index, foot, other); });
      if (!found) feet.push_back(foot);
    }
    followed_.swap_remove(i);
  }
  for (const Foot& foot : feet) follow({index, foot, position});
}

bool JointSolve::same_place(std::size_t index, const Foot& a, const Foot& b) const noexcept {
  const double same = 1e-2 * entries_[index].grain;
  return (a.point - b.point).squaredNorm() <= same * same;
}

void JointSolve::follow(const Followed& one) noexcept {
  for (Followed& other : followed_) {
    if (other.index != one.index || other.stays != one.stays || !same_place(one.index, one.foot, other.foot)) continue;
    other = one;
    return;
  }
  if (followed_.push_back(one)) return;
  Followed* farthest = std::max_element(followed_.begin(), followed_.end(), [](const Followed& a, const Followed& b) {
    return a.foot.distance < b.foot.distance;
  });
  if (one.foot.distance < farthest->foot.distance) *farthest = one;
}

/// Planes of what is followed, in place of a look.
void JointSolve::followed_planes(std::size_t index, const Vec3& position, PlaneSet& out) noexcept {
  const Entry& entry = entries_[index];
  const Vec3 local = entry.touch->to_local(position);
  const double touching = radius_ + gap(entry);
  const std::size_t before = out.size();
  for (Followed& one : followed_) {
    if (one.index != index) continue;
    const Vec3 off = local - one.foot.point;
    const double distance = off.norm();
    if (distance > touching + longest_stride * radius_) continue;
    // Of what is bent somewhat more than the ball is round, the nearest place may be nearer by as much as that.
    const double beside = off.cross(one.foot.normal).squaredNorm() / distance;
    if (!one.stays && position != one.position && distance - 2.0 * beside <= touching + as_near * radius_) {
      one.foot = led_to(entry, local, one.foot);
      one.position = position;
    } else {
      one.foot.distance = distance;
    }
    const bool met =
        std::any_of(out.begin() + static_cast<std::ptrdiff_t>(before), out.end(),
                    [&](const ConstraintPlane& other) { return same_place(index, one.foot, other.contact); });
    Place place;
    ConstraintPlane plane;
    if (!met && plane_off(index, local, one.foot, place, plane)) out.push_back(plane);
  }
}

/// Adds what has been found since `planes` were looked for at `position`, of surfaces of which a look tells the nearest
/// place alone: pressed against several at once, a ball knew one there, and tried in vain to leave the others.
void JointSolve::recall(const Vec3& position, PlaneSet& planes) noexcept {
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (!tells_nearest_alone(entries_[i])) continue;
    PlaneSet known;
    followed_planes(i, position, known);
    for (const ConstraintPlane& plane : known) {
      const bool there = std::any_of(planes.begin(), planes.end(), [&](const ConstraintPlane& other) {
        return other.owner == i && same_place(i, plane.contact, other.contact);
      });
      if (!there) planes.push_back(plane);
    }
  }
}

/// How far nothing is in the way of a ball that touches nothing, whichever way it goes, up to `far`.
double JointSolve::free_around(const Vec3& position, double far) noexcept {
  double free = far;
  for (Entry& entry : entries_) {
    if (!entry.smooth) continue;
    const double around = radius_ + gap(entry);
    const Vec3 local = entry.touch->to_local(position);
    // Mostly nothing is that near, and a bound tells so that is looked up.
    const auto* const relief = std::get_if<ReliefView>(&entry.touch->view);
    if (relief != nullptr && relief->room_around(local, free + around) >= free + around) continue;
    const Foot foot = on_smooth_view(
        entry.touch->view, [&](const auto& view) { return nearest_exactly(view, local, free + around, entry.near); });
    if (foot.found()) free = std::max(0.0, std::min(free, foot.distance - around));
  }
  return free;
}

/// Along a step as far as triangles let it, and what stops it there.
double JointSolve::swept_share(const Segment& motion, CutSet& met) noexcept {
  double share = 1.0;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const Entry& entry = entries_[i];
    if (entry.smooth) continue;
    const Touched& touch = *entry.touch;
    const Segment local = touch.to_local(motion);
    const SweptHit hit =
        entry.patch != nullptr
            ? entry.patch->segment(local, radius_ + margin(), touch.facts->sides)
            : std::get_if<TriangleView>(&touch.view)->sweep(local, radius_ + margin(), touch.facts->sides);
    if (!hit.hit || hit.t >= 1.0) continue;
    share = std::min(share, hit.t);
    if (hit.contact.found()) met.push_back(plane_of(i, hit.contact));
  }
  return share;
}

/// By how much (m) planes are overlapped at most.
double JointSolve::overlap(const PlaneSet& planes, const Vec3& position) noexcept {
  double most = 0.0;
  for (const ConstraintPlane& plane : planes)
    most = std::max(most, plane.offset + plane.skin - plane.normal.dot(position));
  return most;
}

/// Out of all that a ball overlaps; `around`: planes where it then is. What it has met goes into `met`.
bool JointSolve::restore(Vec3& position, PlaneSet& around, CutSet& met) noexcept {
  const double room = found_of_margin * (margin() + widest_skin_);
  for (int round = 0; round < most_restores; ++round) {
    if (round > 0 && !following_ && may_end()) return false;
    around.clear();
    touched(position, around);
    if (overlap(around, position) <= room) return true;
    for (const ConstraintPlane& plane : around) {
      if (round == 0 && plane.offset + plane.skin - plane.normal.dot(position) > room) met.push_back(plane);
    }
    const Vec3 out = project_onto_planes(position, around, true).point;
    if ((out - position).norm() > radius_) return false;
    position += swept_share({position, out}, met) * (out - position);
  }
  return false;
}

/// Planes around a place, and those of what a ball would come to that went on from there.
void JointSolve::with_cuts(const CutSet& cuts, const Vec3& position, PlaneSet& planes) const noexcept {
  for (ConstraintPlane cut : cuts) {
    const Vec3 foot = entries_[cut.owner].touch->to_world(cut.contact.point);
    const Vec3 off = position - foot;
    const double distance = off.norm();
    if (distance > 2.0 * (radius_ + margin()) || distance == 0.0) continue;
    cut.normal = off / distance;
    cut.offset = cut.normal.dot(foot) + radius_;
    if (!stands_among(cut, planes)) planes.push_back(cut);
  }
}

/// A move of a ball from where it is, and what the ones before have taught.
struct JointSolve::BallMove {
  Vec3 goal = Vec3::Zero();
  CutSet cuts = {};
  double room = 0.0;      ///< a stride is no longer (m)
  double stiffest = 1e2;  ///< curvature that a step reckons with at most
  PlaneSet around = {};
  PlaneProjection flat = {};  ///< of the goal onto them
  double rest = 0.0;          ///< how far that is (m)
  Vec3 step = Vec3::Zero();
  double length = 0.0;
  double gain = 0.0;    ///< of half the squared distance that it should come to, overlaps left behind counted in (m^2)
  double weight = 0.0;  ///< what an overlap of 1 m counts
  double overlapped = 0.0;
};

/// Looks where it is to go from `proxy`. False where that is no farther than what is worth a move.
bool JointSolve::plan(const Vec3& proxy, const PlaneSet& planes, BallMove& move) noexcept {
  move.around = planes;
  const auto look = [&] {
    move.flat = project_onto_planes(move.goal, move.around, true);
    move.rest = (move.flat.point - proxy).norm();
    return move.rest > tolerance_;
  };
  if (!look()) return false;
  if (!move.cuts.empty()) {
    with_cuts(move.cuts, proxy, move.around);
    if (!look()) return false;
  }
  move.step = bent_step(move.around, move.flat, proxy, move.goal, move.stiffest, move.gain);
  move.length = move.step.norm();
  double longest = move.room;
  if (move.around.empty() && move.length > longest && !following_)
    longest = std::max(longest, free_around(proxy, move.length));
  if (move.length > longest) {
    move.step *= longest / move.length;
    move.gain *= longest / move.length;
    move.length = longest;
  }
  move.weight = 0.0;
  for (const PlaneProjection::Active& active : move.flat.active) move.weight += overlap_weighs * active.multiplier;
  move.overlapped = move.weight * overlap(move.around, proxy);
  move.gain += move.overlapped;
  return true;
}

/// What a move that came to nothing has met is kept to from then on; followed as well, where no look may tell it.
void JointSolve::learn(const CutSet& met, BallMove& move) noexcept {
  for (const ConstraintPlane& plane : met) {
    if (move.cuts.size() == move.cuts.capacity()) move.cuts.swap_remove(0);
    move.cuts.push_back(plane);
    if (tells_nearest_alone(entries_[plane.owner])) follow({plane.owner, plane.contact, Vec3::Constant(infinity)});
  }
}

/// Makes the move where it comes to enough; learns from it in any case.
bool JointSolve::make(BallMove& move, Vec3& proxy, PlaneSet& planes) noexcept {
  constexpr double least_share = 0.05;
  constexpr double more_than_told = 1.5;
  stride_ = std::min(move.length, farthest_foreseen * radius_);
  CutSet met;
  PlaneSet there;
  Vec3 next = proxy + swept_share({proxy, proxy + move.step}, met) * move.step;
  if (restore(next, there, met)) {
    const double nearer = 0.5 * ((proxy - move.goal).squaredNorm() - (next - move.goal).squaredNorm());
    const double gained = nearer + move.overlapped - move.weight * overlap(there, next);
    bool worth = gained > least_share * move.gain;
    // Near the end what is gained is lost among what overlaps are known to.
    if (!worth && gained > -move.weight * found_of_margin * (margin() + widest_skin_))
      worth = (project_onto_planes(move.goal, there, true).point - next).norm() < 0.5 * move.rest;
    if (worth) {
      if (gained > more_than_told * move.gain) move.stiffest = std::max(10.0, 0.1 * move.stiffest);
      if (move.length >= 0.9 * move.room) move.room = std::min(2.0 * move.room, longest_stride * radius_);
      proxy = next;
      planes = there;
      return true;
    }
  }
  learn(met, move);
  move.room = 0.3 * move.length;
  move.stiffest *= 10.0;
  return false;
}

/// Moves among what is followed alone, and looks around where these have led. False where that is no nearer to the
/// goal by as much; what is in the way there is followed from then on.
bool JointSolve::leap(const BallMove& move, Vec3& proxy, PlaneSet& planes) noexcept {
  constexpr int most_moves = 24;
  constexpr double least_share = 0.1;
  BallMove inner{.goal = move.goal, .room = longest_stride * radius_};
  Vec3 place = proxy;
  PlaneSet there = planes;
  bool rests = false;
  following_ = true;
  for (int i = 0; i < most_moves && !may_end(); ++i) {
    inner.room = std::min(inner.room, longest_stride * radius_ - (place - proxy).norm());
    if (inner.room <= tolerance_) break;
    rests = !plan(place, there, inner);
    if (rests) break;
    if (!make(inner, place, there) && inner.room <= least_room * tolerance_) break;
  }
  following_ = false;
  const auto nearer = [&](const Vec3& next) {
    return 0.5 * ((proxy - move.goal).squaredNorm() - (next - move.goal).squaredNorm());
  };
  const double hoped = nearer(place);
  if (!(hoped > 0.0)) return false;
  CutSet met;
  stride_ = rests ? 0.0 : farthest_foreseen * radius_;
  if (restore(place, there, met) && nearer(place) >= least_share * hoped) {
    proxy = place;
    planes = there;
    return true;
  }
  for (const ConstraintPlane& plane : met) {
    if (knows_feet(entries_[plane.owner])) follow({plane.owner, plane.contact, proxy, true});
  }
  for (const ConstraintPlane& plane : planes) {
    if (knows_feet(entries_[plane.owner])) follow({plane.owner, plane.contact, proxy});
  }
  return false;
}

void JointSolve::settle_ball(const Vec3& goal, ConstraintSolution& solution) noexcept {
  constexpr int most_moves = 160;
  // Where all that pulls is held, but for next to nothing, moves that come no nearer by as much are none; unless what
  // is known would have the ball elsewhere.
  constexpr int look_after = 12;
  constexpr double least_gain = 1e-5;
  double looked_at = infinity;
  constexpr int most_vain_leaps = 3;
  // A tick that is cut short brings the ball nearer by as much: else two of them would be taken for a rest.
  constexpr double worth_a_tick = 1e-2;
  const double begun_at = (solution.proxy - goal).norm();
  BallMove move{.goal = goal, .room = longest_stride * radius_};
  int vain_leaps = 0;
  solution.planes.clear();
  touched(solution.proxy, solution.planes);
  bool stayed = false;
  for (int i = 0; i < most_moves; ++i) {
    nearer_ = (solution.proxy - goal).norm() <= (1.0 - worth_a_tick) * begun_at;
    if (may_end()) return;
    if (stayed) recall(solution.proxy, solution.planes);
    const bool there = !plan(solution.proxy, solution.planes, move);
    bool on = !there;
    // Where nothing is known to hold it, it goes on.
    if (on && !solution.planes.empty() && i % look_after == look_after - 1) {
      const double distance = (solution.proxy - goal).norm();
      on = distance < looked_at * (1.0 - least_gain) || !explains(move.rest);
      looked_at = distance;
      if (!on) move.room = 0.0;
    }
    if (on && vain_leaps < most_vain_leaps && !solution.planes.empty()) {
      stayed = !leap(move, solution.proxy, solution.planes);
      vain_leaps = stayed ? vain_leaps + 1 : 0;
      continue;
    }
    vain_leaps = 0;
    stayed = !on || !make(move, solution.proxy, solution.planes);
    if (!stayed || (on && move.room > least_room * tolerance_)) continue;
    // At rest, or no move comes nearer: by all that is known to hold it.
    solution.planes = move.around;
    if (there && solution.planes.empty()) solution.proxy = move.flat.point;
    solution.converged = true;
    return;
  }
}

}  // namespace asperity
