#pragma once
// What a coat by triplanar projection is made of. Private to surface.

#include "asperity/surface/coat.h"

namespace asperity {

// Below a third, so that some axis is always above it.
inline constexpr double triplanar_threshold = 0.2;

/// Texture coordinates of a place, or of a step, seen along an axis. [servo]
inline Vec2 seen_along(int axis, const Vec3& place, const Vec2& tile) noexcept {
  return {place[(axis + 1) % 3] / tile.x(), place[(axis + 2) % 3] / tile.y()};
}

/// Where a place of a face is as its coat sees it. [servo]
inline Vec3 place_at(const CoatFrame& frame, double u, double v) noexcept {
  return frame.point + u * frame.point_u + v * frame.point_v;
}

}  // namespace asperity
