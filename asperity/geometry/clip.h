#pragma once

#include <algorithm>

#include "asperity/core/math.h"

namespace asperity {

/// Cuts the part [first, last] of the line from + t direction down to what lies in a box; false where nothing is left.
/// Beside the box, along one of its axes, `last` becomes -infinity. [servo]
inline bool clip_line(const Box& box, const Vec3& from, const Vec3& direction, double& first, double& last) noexcept {
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0.0) {
      if (from[axis] < box.lower[axis] || from[axis] > box.upper[axis]) last = -infinity;
      continue;
    }
    const double a = (box.lower[axis] - from[axis]) / direction[axis];
    const double b = (box.upper[axis] - from[axis]) / direction[axis];
    first = std::max(first, std::min(a, b));
    last = std::min(last, std::max(a, b));
  }
  return first <= last;
}

}  // namespace asperity
