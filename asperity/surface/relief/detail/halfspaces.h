#pragma once
// The point of a few half-spaces that is nearest to the origin: where a ball rests against several walls at once.

#include <cstddef>
#include <span>

#include "asperity/core/math.h"

namespace asperity {

/// Half-space {w : normal . w >= offset}; `normal` unit.
struct HalfSpace {
  Vec3 normal = Vec3::Zero();
  double offset = 0.0;
};

/// Nearest point of an intersection of half-spaces to the origin, with the (at most three) that hold it there.
struct NearestInHalfSpaces {
  bool found = false;  ///< false: they have nothing in common, or nearly so
  Vec3 point = Vec3::Zero();
  int count = 0;
  std::size_t active[3] = {0, 0, 0};
  double force[3] = {0.0, 0.0, 0.0};  ///< point = sum force normal, all >= 0
};

/// By trying all sets of at most three: for up to about eight. `slack` (in units of the offsets) is what a half-space
/// may be missed by. [servo]
inline NearestInHalfSpaces nearest_in_halfspaces(std::span<const HalfSpace> all, double slack) noexcept {
  NearestInHalfSpaces best;
  double least = infinity;
  const auto offer = [&](const Vec3& w, int count, const std::size_t* index, const double* force) {
    const double size = w.squaredNorm();
    if (!(size < least)) return;
    for (const HalfSpace& one : all) {
      if (one.normal.dot(w) < one.offset - slack) return;
    }
    least = size;
    best.found = true;
    best.point = w;
    best.count = count;
    for (int k = 0; k < count; ++k) {
      best.active[k] = index[k];
      best.force[k] = force[k];
    }
  };
  offer(Vec3::Zero(), 0, nullptr, nullptr);
  if (best.found) return best;
  // Walls this close to parallel give no corner to rest in.
  constexpr double least_determinant = 1e-9;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double one_force[1] = {all[i].offset};
    if (all[i].offset > 0.0) offer(all[i].offset * all[i].normal, 1, &i, one_force);
    for (std::size_t j = i + 1; j < all.size(); ++j) {
      const double c = all[i].normal.dot(all[j].normal);
      const double det = 1.0 - c * c;
      if (det > least_determinant) {
        const double force[2] = {(all[i].offset - c * all[j].offset) / det, (all[j].offset - c * all[i].offset) / det};
        const std::size_t pair[2] = {i, j};
        if (force[0] >= 0.0 && force[1] >= 0.0)
          offer(force[0] * all[i].normal + force[1] * all[j].normal, 2, pair, force);
      }
      for (std::size_t k = j + 1; k < all.size(); ++k) {
        const Vec3 jk = all[j].normal.cross(all[k].normal);
        const Vec3 ki = all[k].normal.cross(all[i].normal);
        const Vec3 ij = all[i].normal.cross(all[j].normal);
        const double volume = all[i].normal.dot(jk);
        if (!(volume * volume > least_determinant)) continue;
        const Vec3 w = (all[i].offset * jk + all[j].offset * ki + all[k].offset * ij) / volume;
        const double force[3] = {w.dot(jk) / volume, w.dot(ki) / volume, w.dot(ij) / volume};
        const std::size_t triple[3] = {i, j, k};
        if (force[0] >= 0.0 && force[1] >= 0.0 && force[2] >= 0.0) offer(w, 3, triple, force);
      }
    }
  }
  return best;
}

}  // namespace asperity
