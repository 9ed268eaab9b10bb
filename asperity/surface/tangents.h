#pragma once
// What follows from the tangents of a surface that is given over two parameters.

#include "asperity/core/math.h"

namespace asperity {

/// Gradients of u and v along the surface (1/m), from its tangents: the contravariant basis; zero where it has none.
/// [servo]
inline void parameter_gradients(const Vec3& along_u, const Vec3& along_v, Vec3& du, Vec3& dv) noexcept {
  const Vec3 cross = along_u.cross(along_v);
  const double square = cross.squaredNorm();
  if (!(square > 0.0)) {
    du = dv = Vec3::Zero();
    return;
  }
  du = along_v.cross(cross) / square;
  dv = cross.cross(along_u) / square;
}

/// How the unit normal changes along the surface (1/m), from the tangents and the second derivatives' parts along the
/// normal: symmetric, 0 along the normal. [servo]
inline Mat3 shape_operator(const Vec3& along_u, const Vec3& along_v, double uu, double uv, double vv) noexcept {
  Vec3 du;
  Vec3 dv;
  parameter_gradients(along_u, along_v, du, dv);
  const Vec3 across = uu * du + uv * dv;
  const Vec3 along = uv * du + vv * dv;
  return -(across * du.transpose() + along * dv.transpose());
}

}  // namespace asperity
