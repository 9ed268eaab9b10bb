#pragma once
// Moving along a displaced surface towards the point of it nearest to a goal.

#include "asperity/surface/relief_surface.h"

namespace asperity {

/// How a descent ended.
enum class DescentEnd {
  rest,     ///< no move along the surface comes nearer: a local minimum of the distance
  left,     ///< the goal lies outside the tangent plane: the surface no longer holds the point
  rim,      ///< at the rim of an open mesh, and the goal lies beyond it
  limited,  ///< out of moves; the point is on the surface and nearer than before
};

/// A point on a relief that is led towards a goal.
struct Descent {
  ReliefPlace* place = nullptr;  ///< where it is: read and written
  Vec3 goal = Vec3::Zero();
  double side = 1.0;      ///< 1: touched from the front, -1: from the back
  double friction = 0.0;  ///< Coulomb's coefficient: the point comes to rest where its pull lies on that cone
  bool may_leave = true;  ///< false: stays on the surface whatever the goal (closest points)
  ReliefPoint point;      ///< at `place`; valid after descend
  int moves = 0;          ///< evaluations used
  int budget = 96;
};

/// Where a point without friction would be led to so that it rests where friction stops it: the goal moved back along
/// the pull's tangential part by what the cone holds, or the point itself while all of the pull lies within the cone.
/// `normal` unit, away from the surface. [servo]
Vec3 friction_goal(const Vec3& point, const Vec3& normal, const Vec3& goal, double coefficient) noexcept;

/// Moves the point along the surface, across edges and round vertices, by Newton's method on its squared distance to
/// the goal. Between samples no farther apart than the relief's grain the distance always falls, so that no ridge is
/// crossed that the distance would have to rise over. With friction the goal is moved back by what the cone holds,
/// anew at every step. `descent.point` must be that of `descent.place`. [servo]
DescentEnd descend(const ReliefSurface& surface, Descent& descent) noexcept;

/// Moves the place onto the face across the edge opposite corner `k`, where its coordinate is 0. False at a rim.
/// [servo]
bool cross_edge(const ReliefSurface& surface, ReliefPlace& place, int k) noexcept;

}  // namespace asperity
