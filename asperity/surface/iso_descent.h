#pragma once
// Moving along an isosurface towards the point of it nearest to a goal.

#include "asperity/surface/iso_surface.h"

namespace asperity {

/// A point on an isosurface that is led towards a goal.
struct IsoDescent {
  Vec3 point = Vec3::Zero();   ///< on the surface; read and written (m)
  Vec3 normal = Vec3::Zero();  ///< unit, on the side touched; written
  Vec3 away = Vec3::Zero();    ///< unit, off all cells that meet at the point: their normals' mean; written
  Vec3 goal = Vec3::Zero();
  double side = 1.0;      ///< 1: touched from the outside, -1: from the inside
  double friction = 0.0;  ///< Coulomb's coefficient: the point rests where its pull lies on that cone
  bool may_leave = true;  ///< false: stays on the surface whatever the goal (closest points)
  int moves = 0;          ///< evaluations used
  int budget = 400;
};

/// How it ended.
enum class IsoEnd {
  rest,     ///< no move along the surface comes nearer
  left,     ///< the goal lies outside the tangent plane: the surface no longer holds the point
  rim,      ///< at the border of the volume, and the goal lies beyond it
  limited,  ///< out of moves; on the surface and nearer than before
};

/// Leads the point along its sheet. Every move is one that a point could make through free space just off the surface:
/// certified by the bounds of the cells around it, or searched exactly; none passes a sheet, however near it is. The
/// distance to the goal falls with every move. [servo]
IsoEnd descend(const IsoView& surface, IsoDescent& descent, IsoHint& hint) noexcept;

}  // namespace asperity
