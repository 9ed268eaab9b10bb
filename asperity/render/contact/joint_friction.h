#pragma once
// Friction on what holds a proxy jointly: JointSolve::solve_with_friction.

#include "asperity/render/contact/coulomb.h"
#include "asperity/render/contact/joint.h"

namespace asperity {

/// The coefficients and the normal that friction on several planes goes by: those of the one that pushes most.
struct Hold {
  Friction friction;
  Vec3 normal = Vec3::Zero();
};
/// [servo]
template <class FrictionOf>
Hold strongest_hold(const PlaneSet& planes, const Vec3& goal, const FrictionOf& friction_of) noexcept {
  const PlaneProjection projection = project_onto_planes(goal, planes, false);
  Hold hold;
  double strongest = 0.0;
  for (const PlaneProjection::Active& active : projection.active) {
    if (active.multiplier <= strongest) continue;
    strongest = active.multiplier;
    hold.friction = friction_of(planes[active.plane]);
  }
  const Vec3 push = projection.point - goal;
  const double length = push.norm();
  if (length > 0.0) hold.normal = push / length;
  return hold;
}

/// Where friction that has been overcome lets a proxy go.
struct Slip {
  /// [servo]
  Slip(const Vec3& proxy, const Vec3& normal, const Vec3& probe, double coefficient) noexcept
      : aim(friction_goal(proxy, normal, probe, coefficient)), still(proxy - (proxy - aim).dot(normal) * normal) {}
  /// After a share of the way. [servo]
  [[nodiscard]] Vec3 goal(double share) const noexcept { return still + share * (aim - still); }
  Vec3 aim;
  Vec3 still;  ///< what would leave it where it is
};

template <class FrictionOf>
ConstraintSolution JointSolve::solve_with_friction(const Vec3& from, const Vec3& probe, bool& sliding, Vec3& goal,
                                                   const FrictionOf& friction_of) noexcept {
  constexpr int most_rounds = 4;
  constexpr int most_parts = 3;
  ConstraintSolution solution;
  Vec3 proxy = from;
  PlaneSet planes;
  rests_on(proxy, planes);
  bool slid = false;
  bool landed = false;
  for (int round = 0; round < most_rounds; ++round) {
    const Hold hold = strongest_hold(planes, probe, friction_of);
    if (hold.friction.still <= 0.0 || hold.normal.isZero()) {
      // In free space, or without friction, the proxy goes all the way; what it meets then decides.
      goal = probe;
      solution = solve(proxy, goal);
      const bool met = !was_cut(solution) && planes.empty() && !solution.planes.empty() && round == 0 &&
                       strongest_hold(solution.planes, probe, friction_of).friction.still > 0.0;
      if (!met) {
        sliding = false;
        return solution;
      }
      // It met something with friction: it would have stopped there, not slid on for nothing.
      planes = solution.planes;
      proxy = solution.proxy;
      landed = true;
      continue;
    }
    bool slipped = !holds(hold.friction, proxy, hold.normal, probe, sliding);
    if (slipped) {
      // On a bent surface the cone turns on the way: where all of it leads away from the probe, a part of it may not.
      const Slip slip(proxy, hold.normal, probe, hold.friction.sliding);
      const HeldSet held = held_;
      double share = 1.0;
      slipped = false;
      for (int part = 0; part < most_parts && !slipped && (leads_ball() || !work_.spent()); ++part, share *= 0.25) {
        goal = slip.goal(share);
        solution = solve(proxy, goal);
        slipped = no_farther(solution.proxy, proxy, probe);
        if (!slipped) held_ = held;
      }
      // What holds it is known where it comes to rest.
      if (slipped && was_cut(solution)) {
        sliding = true;
        return solution;
      }
    }
    if (!slipped) {
      sliding = sliding || (slid && !landed);
      // The spring's force is its own, whatever its direction: what the planes hold is the push, the rest is
      // friction's.
      solution = {};
      solution.proxy = proxy;
      solution.planes = planes;
      solution.converged = true;
      solution.projection = project_onto_planes(probe, planes, false);
      goal = proxy - (solution.projection.point - probe);
      solution.projection.point = proxy;
      return solution;
    }
    slid = true;
    proxy = solution.proxy;
    planes = solution.planes;
  }
  return solution;
}

}  // namespace asperity
