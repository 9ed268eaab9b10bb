#pragma once
// Moving along a parametric surface towards the point of it nearest to a goal.

#include "asperity/surface/parametric_surface.h"
#include "asperity/surface/relief_descent.h"

namespace asperity {

/// A point on a parametric surface that is led towards a goal.
struct ParametricDescent {
  Vec2 uv = Vec2::Zero();  ///< where it is: read and written
  Vec3 goal = Vec3::Zero();
  double side = 1.0;           ///< 1: touched from the front, -1: from the back
  double friction = 0.0;       ///< Coulomb's coefficient: the point comes to rest where its pull lies on that cone
  bool may_leave = true;       ///< false: stays on the surface whatever the goal (closest points)
  ParametricJet jet;           ///< at `uv`; has to be there before
  Vec3 normal = Vec3::Zero();  ///< of the front, at `uv`; valid after descend
  int moves = 0;               ///< evaluations used
  int budget = 96;
};

/// Moves the point along the surface by Newton's method on its squared distance to the goal, in the metric of the
/// surface: seams of closed parameters and the poles of a sphere are places like others. Between samples no farther
/// apart than the surface's stride the distance always falls, so that no ridge is crossed that the distance would have
/// to rise over. With friction the goal is moved back by what the cone holds. [servo]
DescentEnd descend(const ParametricSurface& surface, ParametricDescent& descent) noexcept;

}  // namespace asperity
