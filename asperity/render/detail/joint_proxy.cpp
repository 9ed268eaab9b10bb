#include "asperity/render/detail/joint_proxy.h"

#include <algorithm>
#include <cmath>

namespace asperity {

namespace {

constexpr int most_moves = 16;
constexpr int most_attempts = 4;
// Between two walls a ball is pushed from one to the other, each time by less.
constexpr int most_pushes = 12;
// On a relief a move of this share of its finest grain is not worth making.
constexpr double rest_of_grain = 2e-3;
// A point is blown up to a ball of this share of the finest grain where it may touch two places of a relief at once.
constexpr double point_of_grain = 1e-3;

}  // namespace

void JointProxy::add(const Instance& instance, ContactState& state) noexcept {
  if (entries_.size() == capacity) return;
  Entry entry{&instance, {}, SmoothSurface(instance, state), &state};
  if (!entry.smooth) entry.mesh = patches_.of(instance);
  entries_.push_back(entry);
  const double skin = entry.smooth ? entry.smooth.skin() : entry.mesh.skin();
  const double rest = entry.smooth ? rest_of_grain * entry.smooth.grain() : 0.05 * skin;
  tolerance_ = entries_.size() == 1 ? rest : std::max(tolerance_, rest);
  if (!entry.smooth) return;
  margin_ = std::max({margin_, point_of_grain * entry.smooth.grain(), 4.0 * skin});
  // What is thinner than a real ball must not slip past it; what is thinner than a blown-up point is below its skin.
  if (radius_ > 0.25 * entry.smooth.grain()) longest_step_ = std::min(longest_step_, 0.5 * radius_);
}

double JointProxy::gap(const Entry& entry) const noexcept {
  return margin_ + (entry.smooth ? entry.smooth.skin() : entry.mesh.skin());
}

bool JointProxy::foot_plane(std::size_t index, const Vec3& position, ConstraintPlane& plane,
                            double& distance) noexcept {
  const Entry& entry = entries_[index];
  const Pose& pose = entry.state->pose;
  const Vec3 local = pose.apply_inverse(position);
  Vec3 front = Vec3::Zero();
  const Foot foot =
      entry.smooth.closest(local, radius_ + gap(entry) + entry.smooth.plane_reach(), entry.state->hint, front);
  if (!foot.found()) return false;
  const Vec3 offset = local - foot.point;
  distance = foot.distance;
  // Between folds the nearest point may be an edge: away from it, the ball rolls over it. A foot that is all but
  // reached has no direction of its own, the surface's is taken.
  Vec3 normal = foot.distance > entry.smooth.direction_from() ? Vec3(offset / foot.distance) : foot.normal;
  if (entry.instance->sides == Sides::front && normal.dot(front) < 0.0) return false;
  normal = pose.rotate(normal);
  const Vec3 point = pose.apply(foot.point);
  plane = {normal, normal.dot(point) + radius_, gap(entry), static_cast<std::uint32_t>(index), foot};
  return true;
}

void JointProxy::remember(const ConstraintPlane& plane) noexcept {
  // One plane a direction: the newest.
  constexpr double same_direction = 0.999;
  for (std::size_t i = feet_.size(); i-- > 0;) {
    if (feet_[i].owner == plane.owner && feet_[i].normal.dot(plane.normal) > same_direction) feet_.swap_remove(i);
  }
  if (feet_.size() == feet_.capacity()) feet_.swap_remove(0);
  feet_.push_back(plane);
}

void JointProxy::touched(const Vec3& position, PlaneSet& out) noexcept {
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    Entry& entry = entries_[i];
    if (entry.smooth) {
      ConstraintPlane plane;
      double distance = 0.0;
      if (!foot_plane(i, position, plane, distance)) continue;
      remember(plane);
      // Near a surface without folds its tangent plane holds before it is touched.
      if (!entry.smooth.has_folds()) out.push_back(plane);
      continue;
    }
    const Pose& pose = entry.state->pose;
    ContactSet contacts;
    entry.mesh.contacts(pose.apply_inverse(position), radius_ + margin_, entry.instance->sides, entry.state->hint,
                        contacts);
    for (const Foot& contact : contacts) {
      const Vec3 normal = pose.rotate(contact.normal);
      out.push_back({normal, normal.dot(pose.apply(contact.point)) + radius_, gap(entry), static_cast<std::uint32_t>(i),
                     contact});
    }
  }
  for (std::size_t i = feet_.size(); i-- > 0;) {
    const ConstraintPlane& plane = feet_[i];
    bool known = false;
    for (const ConstraintPlane& other : out)
      known = known || (other.owner == plane.owner && other.normal == plane.normal);
    if (known) continue;
    const double apart = plane.normal.dot(position) - plane.offset - plane.skin;
    const Vec3 foot = entries_[plane.owner].state->pose.apply(plane.contact.point);
    // Feet found on the way stay as long as the ball is about as near to them as their surface bends.
    const double around = radius_ + plane.skin;
    if (apart > 0.1 * around || (position - foot).squaredNorm() > 2.0 * around * around) {
      feet_.swap_remove(i);
    } else {
      out.push_back(plane);
    }
  }
}

double JointProxy::free_share(const Segment& motion) noexcept {
  double share = 1.0;
  const double length = (motion.to - motion.from).norm();
  for (Entry& entry : entries_) {
    const Pose& pose = entry.state->pose;
    const Segment local{pose.apply_inverse(motion.from), pose.apply_inverse(motion.to)};
    if (!entry.smooth) {
      share = std::min(share, entry.mesh.segment(local, radius_ + margin_, entry.instance->sides, entry.state->hint).t);
      continue;
    }
    Hint scratch;
    scratch.moment = entry.state->hint.moment;
    const SweptHit hit = entry.smooth.segment(local, entry.instance->sides, scratch);
    // The centre itself must stay outside: half of the ball before what it meets.
    if (hit.hit) share = std::min(share, std::max(0.0, hit.t - 0.5 * (radius_ + margin_) / length));
  }
  return share;
}

Vec3 JointProxy::pushed_out(Vec3 position, bool& clear) noexcept {
  clear = false;
  for (int push = 0; push < most_pushes && !clear; ++push) {
    clear = true;
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      if (!entries_[i].smooth) continue;
      ConstraintPlane plane;
      double distance = 0.0;
      if (!foot_plane(i, position, plane, distance)) continue;
      remember(plane);
      const double missing = plane.offset + plane.skin - plane.normal.dot(position);
      if (missing <= 0.25 * entries_[i].smooth.skin()) continue;
      position += missing * plane.normal;
      clear = false;
    }
  }
  return position;
}

ConstraintSolution JointProxy::solve(const Vec3& from, const Vec3& goal) noexcept {
  ConstraintSolution solution;
  solution.proxy = from;
  for (int move = 0; move < most_moves; ++move) {
    solution.planes.clear();
    touched(solution.proxy, solution.planes);
    const Vec3 target = project_onto_planes(goal, solution.planes, true).point;
    Vec3 step = target - solution.proxy;
    double length = step.norm();
    if (length <= tolerance_) {
      if (solution.planes.empty()) solution.proxy = target;
      solution.converged = true;
      break;
    }
    if (length > longest_step_) step *= longest_step_ / length;
    const double distance = (solution.proxy - goal).norm();
    bool moved = false;
    for (int attempt = 0; attempt < most_attempts && !moved; ++attempt) {
      const double share = free_share({solution.proxy, solution.proxy + step});
      Vec3 next = solution.proxy + share * step;
      bool clear = false;
      const Vec3 out = pushed_out(next, clear);
      if (out != next) next += free_share({next, out}) * (out - next);
      moved = clear && (next - goal).norm() < distance - 1e-2 * tolerance_;
      if (moved) {
        solution.proxy = next;
      } else {
        step *= 0.35;
        if (step.norm() <= tolerance_) break;
      }
    }
    if (!moved) {
      // No motion comes nearer: a local minimum, found by trying.
      solution.converged = true;
      break;
    }
  }
  solution.projection = project_onto_planes(goal, solution.planes, false);
  return solution;
}

}  // namespace asperity
