#pragma once
// Analytic surfaces to lay strokes on.

#include "asperity/device/stroke.h"

namespace asperity {

/// The plane y = 0.
inline SurfacePoint on_plane(const Vec3& p) {
  return {Vec3(p.x(), 0.0, p.z()), Vec3::UnitY()};
}

/// A sphere around the origin.
struct OnSphere {
  double radius;
  SurfacePoint operator()(const Vec3& p) const {
    const Vec3 n = p.norm() > 0.0 ? Vec3(p.normalized()) : Vec3(Vec3::UnitY());
    return {radius * n, n};
  }
};

/// A flat line of `length` along x, at 20 mm/s, 1 mm deep.
inline StrokeSettings line_settings(double length = 0.04) {
  StrokeSettings settings;
  settings.start = Vec3(-0.5 * length, 0.01, 0.0);
  settings.end = Vec3(0.5 * length, 0.01, 0.0);
  return settings;
}

}  // namespace asperity
