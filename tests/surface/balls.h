#pragma once
// Moving balls in tests, by a surface's nearest points alone.

#include "asperity/geometry/contact.h"

namespace asperity::test {

/// Fraction of the centre's motion at which a ball first touches a surface; 2 where it does not. `nearest(p)` answers
/// the surface's nearest point of p: by how much that is farther than the radius, the centre can go without a touch.
template <class Nearest>
double ball_touch(const Segment& motion, double radius, const Nearest& nearest) {
  constexpr double touched = 1e-9;  // m
  const Vec3 way = motion.to - motion.from;
  const double length = way.norm();
  double t = 0.0;
  while (t <= 1.0) {
    const double gap = nearest(motion.from + t * way).distance - radius;
    if (gap <= touched) return t;
    t += gap / length;
  }
  return 2.0;
}

}  // namespace asperity::test
