#pragma once
// The dense mesh as an oracle: where a motion first crosses a relief, known as well as the facets know it.

#include <algorithm>
#include <cmath>

#include "asperity/surface/relief/mesh.h"
#include "tests/surface/coats.h"

namespace asperity::test {

/// A relief's tessellation, with how far it is from the relief. Every place of the relief lies within `error` of the
/// facets and every place of the facets within `error` of the relief, so that what the facets say of a motion bounds
/// what is true of it.
class DenseOracle {
 public:
  DenseOracle(const ReliefSurface& relief, int subdivisions)
      : index_(TriangleIndex::build(must(tessellate(relief, subdivisions)))), error_(measured(relief, subdivisions)) {}

  /// m
  [[nodiscard]] double error() const { return error_; }
  [[nodiscard]] const TriangleIndex& index() const { return index_; }

  /// Between which shares of a motion it first crosses the relief.
  struct Crossing {
    bool possible = false;  ///< false: it comes nowhere near enough
    bool certain = false;   ///< false: it may only graze, and then cross nothing
    double earliest = 0.0;  ///< where possible
    double latest = 1.0;    ///< where certain
  };

  [[nodiscard]] Crossing first_crossing(const Segment& motion) const {
    Crossing crossing;
    crossing.earliest = first_within_error(motion);
    crossing.possible = crossing.earliest <= 1.0;
    if (!crossing.possible || distance(motion.from) <= error_) return crossing;
    // From one facet crossing to the next the motion is on one side of the facets: the relief is crossed for certain
    // once it is on the other side than it began and out of the error's reach.
    double from = crossing_after(motion, 0.0);
    for (bool beyond = true; from <= 1.0; beyond = !beyond) {
      const double next = crossing_after(motion, from);
      const double out = first_beyond_error(motion, from, std::min(next, 1.0));
      if (beyond && out <= 1.0) {
        crossing.certain = true;
        crossing.latest = out;
        break;
      }
      from = next;
    }
    return crossing;
  }

 private:
  static Vec3 at(const Segment& motion, double t) { return motion.from + t * (motion.to - motion.from); }
  [[nodiscard]] double distance(const Vec3& p) const { return index_.closest(p, infinity).distance; }

  /// Beyond 1: never.
  [[nodiscard]] double first_within_error(const Segment& motion) const {
    const double length = (motion.to - motion.from).norm();
    for (double t = 0.0; t <= 1.0;) {
      const double gap = distance(at(motion, t)) - error_;
      if (gap <= 0.01 * error_) return t;
      t += gap / length;
    }
    return infinity;
  }
  [[nodiscard]] double first_beyond_error(const Segment& motion, double from, double to) const {
    const double length = (motion.to - motion.from).norm();
    for (double t = from; t <= to;) {
      const double missing = error_ - distance(at(motion, t));
      if (missing <= 0.0) return t;
      t += std::max(missing, 0.02 * error_) / length;
    }
    return infinity;
  }
  [[nodiscard]] double crossing_after(const Segment& motion, double from) const {
    const double length = (motion.to - motion.from).norm();
    const double start = from == 0.0 ? 0.0 : from + 1e-3 * index_.skin() / length;
    if (start >= 1.0) return infinity;
    const FirstHit hit = index_.first_hit({at(motion, start), motion.to});
    return hit.face == no_index ? infinity : start + hit.t * (1.0 - start);
  }

  /// Largest distance between a place of the relief and the place of its facet with the same coordinates, at ten places
  /// of every facet, with a fifth more for what is between them.
  static double measured(const ReliefSurface& relief, int subdivisions) {
    constexpr double share[10][2] = {{0.5, 0.0},  {0.0, 0.5},  {0.5, 0.5},  {1.0 / 3, 1.0 / 3}, {0.25, 0.25},
                                     {0.5, 0.25}, {0.25, 0.5}, {0.25, 0.0}, {0.0, 0.25},        {0.25, 0.75}};
    const auto place = [&](const ReliefFrame& frame, const Vec2& uv) {
      return relief.point(frame, uv.x(), uv.y()).point;
    };
    double worst = 0.0;
    for (std::uint32_t face = 0; face < relief.base().mesh().triangles().size(); ++face) {
      const ReliefFrame frame = relief.frame(face);
      for (int j = 0; j < subdivisions; ++j) {
        for (int i = 0; i + j < subdivisions; ++i) {
          for (const bool upper : {false, true}) {
            if (upper && i + j + 2 > subdivisions) continue;
            const Vec2 corner = upper ? grid_place(i + 1, j + 1, subdivisions) : grid_place(i, j, subdivisions);
            const Vec2 right = upper ? grid_place(i, j + 1, subdivisions) : grid_place(i + 1, j, subdivisions);
            const Vec2 left = upper ? grid_place(i + 1, j, subdivisions) : grid_place(i, j + 1, subdivisions);
            const Vec3 a = place(frame, corner);
            const Vec3 b = place(frame, right) - a;
            const Vec3 c = place(frame, left) - a;
            for (const auto& [s, t] : share) {
              const Vec3 smooth = place(frame, corner + s * (right - corner) + t * (left - corner));
              worst = std::max(worst, (smooth - (a + s * b + t * c)).norm());
            }
          }
        }
      }
    }
    return 1.2 * worst;
  }

  TriangleIndex index_;
  double error_;
};

}  // namespace asperity::test
