#pragma once
// Sparse potentials whose distances are known in closed form.

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

#include "asperity/field/volume/sparse_grid.h"

namespace asperity::test {

/// Everything of a potential f (m, positive outside) over a box: blocks that hold a point within the band.
inline SparseSource sparse_source(const std::function<double(const Vec3&)>& f, const Box& box, double voxel,
                                  double outside, double inside) {
  SparseSource source;
  source.voxel = voxel;
  source.outside = outside;
  source.inside = -inside;
  const double block = voxel * SparseBlock::side;
  std::array<std::int32_t, 3> first{};
  std::array<std::int32_t, 3> last{};
  for (std::size_t a = 0; a < 3; ++a) {
    first[a] = static_cast<std::int32_t>(std::floor((box.lower[static_cast<int>(a)] - outside) / block));
    last[a] = static_cast<std::int32_t>(std::floor((box.upper[static_cast<int>(a)] + outside) / block));
  }
  for (std::int32_t z = first[2]; z <= last[2]; ++z) {
    for (std::int32_t y = first[1]; y <= last[1]; ++y) {
      for (std::int32_t x = first[0]; x <= last[0]; ++x) {
        SparseBlock stored;
        stored.at = {x, y, z};
        bool within = false;
        for (int k = 0; k < SparseBlock::side; ++k) {
          for (int j = 0; j < SparseBlock::side; ++j) {
            for (int i = 0; i < SparseBlock::side; ++i) {
              const Vec3 p =
                  voxel * Vec3(SparseBlock::side * x + i, SparseBlock::side * y + j, SparseBlock::side * z + k);
              const double value = f(p);
              within = within || (value < outside && value > -inside);
              stored.value[SparseBlock::index(i, j, k)] = static_cast<float>(std::clamp(value, -inside, outside));
            }
          }
        }
        if (within) source.blocks.push_back(std::move(stored));
      }
    }
  }
  return source;
}

inline std::shared_ptr<const SparseGrid> sparse_grid(const std::function<double(const Vec3&)>& f, const Box& box,
                                                     double voxel, double outside, double inside) {
  return std::make_shared<const SparseGrid>(SparseGrid::build(sparse_source(f, box, voxel, outside, inside)).value());
}

/// Signed distance to a ball around the origin (m).
inline double ball_distance(const Vec3& p, double radius) {
  return p.norm() - radius;
}

/// Signed distance to an axis-aligned box around the origin, exact outside and inside (m).
inline double box_distance(const Vec3& p, const Vec3& half) {
  const Vec3 q = p.cwiseAbs() - half;
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
}

/// Signed distance to a torus around z (m).
inline double torus_distance(const Vec3& p, double major, double minor) {
  const double ring = std::hypot(p.x(), p.y()) - major;
  return std::hypot(ring, p.z()) - minor;
}

inline Box cube(double half) {
  Box box;
  box.lower = Vec3::Constant(-half);
  box.upper = Vec3::Constant(half);
  return box;
}

/// A ball of 30 mm and a box of 40 x 40 x 40 mm, with bands of `band` (m).
inline std::shared_ptr<const SparseGrid> sparse_ball(double voxel, double band) {
  return sparse_grid([](const Vec3& p) { return ball_distance(p, 0.03); }, cube(0.03), voxel, band, band);
}
inline std::shared_ptr<const SparseGrid> sparse_box(double voxel, double band) {
  return sparse_grid([](const Vec3& p) { return box_distance(p, Vec3::Constant(0.02)); }, cube(0.02), voxel, band,
                     band);
}
/// A plate across z, `thickness` thick and 2 `half` wide (m).
inline std::shared_ptr<const SparseGrid> sparse_slab(double thickness, double half, double voxel, double band) {
  const Vec3 size(half, half, 0.5 * thickness);
  Box box;
  box.lower = -size;
  box.upper = size;
  return sparse_grid([size](const Vec3& p) { return box_distance(p, size); }, box, voxel, band, band);
}

}  // namespace asperity::test
