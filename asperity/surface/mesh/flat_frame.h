#pragma once
// One triangle of a bare mesh, ready to be evaluated.

#include <cstdint>

#include "asperity/core/math.h"
#include "asperity/surface/face_place.h"

namespace asperity {

/// A point of a face.
struct FlatSpot {
  Vec3 point;
  Vec3 along_u;  ///< from the first corner to the second
  Vec3 along_v;  ///< and to the third
  Vec3 front;    ///< unit
};

/// What evaluating a face, and walking over it, needs.
struct FlatFrame {
  std::uint64_t owner = 0;  ///< identity of the mesh's index; 0: nothing
  std::uint32_t face = no_index;
  bool asked = false;   ///< `lonely` is known
  bool lonely = false;  ///< nothing but its neighbours comes near the face
  Vec3 corner = Vec3::Zero();
  Vec3 along_u = Vec3::Zero();
  Vec3 along_v = Vec3::Zero();
  Vec3 front = Vec3::Zero();
  Vec3 beside = Vec3::Zero();  ///< barycentric: what is less from an edge is beside it, some skins away

  [[nodiscard]] FlatSpot at(double u, double v) const noexcept {
    return {corner + u * along_u + v * along_v, along_u, along_v, front};
  }
};

/// The face across an edge that a walk was about to reach, ready before it gets there.
struct FlatAhead {
  std::uint32_t from = no_index;  ///< face that the edge is of
  int edge = 0;                   ///< as TriangleMesh::neighbour counts them
  FlatFrame frame;                ///< face == no_index: the edge is a rim
};

}  // namespace asperity
