#pragma once
// Chance on a tile that repeats: noise and scattered points. Private to field.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "asperity/core/math.h"

namespace asperity {

/// Smooth from 0 at 0 and below to 1 at 1 and above. [any]
inline double smooth_step(double q) noexcept {
  const double u = std::clamp(q, 0.0, 1.0);
  return u * u * u * (u * (6.0 * u - 15.0) + 10.0);
}

/// The remainder, 0 to below `count`, of any whole number. [any]
inline int wrapped(int i, int count) noexcept {
  const int rest = i % count;
  return rest < 0 ? rest + count : rest;
}

/// Numbers that belong to a cell: the same for the same cell, key and index. [any]
class CellChance {
 public:
  explicit CellChance(std::uint64_t key) : key_(mixed(key + 0x51ED2701ULL)) {}
  /// 0 to below 1. [any]
  [[nodiscard]] double operator()(int i, int j, unsigned index) const noexcept {
    const auto place = (static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)) << 32U) |
                       static_cast<std::uint64_t>(static_cast<std::uint32_t>(j));
    return static_cast<double>(mixed(mixed(place + key_) + index * 0x9E3779B97F4A7C15ULL) >> 11U) * 0x1p-53;
  }

 private:
  static std::uint64_t mixed(std::uint64_t x) noexcept {
    x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    x = (x ^ (x >> 27U)) * 0x94D049BB133111EBULL;
    return x ^ (x >> 31U);
  }
  std::uint64_t key_;
};

/// Smooth gradient noise within about +-1 on a tile of `columns` x `rows` cells that closes on itself.
class TileNoise {
 public:
  TileNoise(int columns, int rows, std::uint64_t key) : columns_(columns), rows_(rows), chance_(key) {}
  /// At texture coordinates of any size. [any]
  [[nodiscard]] double operator()(double s, double t) const noexcept {
    const double x = s * columns_;
    const double y = t * rows_;
    const double column = std::floor(x);
    const double row = std::floor(y);
    const double dx = x - column;
    const double dy = y - row;
    const int i = static_cast<int>(column);
    const int j = static_cast<int>(row);
    const double u = smooth_step(dx);
    const double low = std::lerp(slope(i, j, dx, dy), slope(i + 1, j, dx - 1.0, dy), u);
    const double high = std::lerp(slope(i, j + 1, dx, dy - 1.0), slope(i + 1, j + 1, dx - 1.0, dy - 1.0), u);
    return std::numbers::sqrt2 * std::lerp(low, high, smooth_step(dy));
  }

 private:
  [[nodiscard]] double slope(int i, int j, double dx, double dy) const noexcept {
    const double angle = 2.0 * std::numbers::pi * chance_(wrapped(i, columns_), wrapped(j, rows_), 0);
    return std::cos(angle) * dx + std::sin(angle) * dy;
  }
  int columns_;
  int rows_;
  CellChance chance_;
};

/// Octaves of noise, each twice as fine and `share` as high as the one before; within about +-1.
class TileOctaves {
 public:
  TileOctaves(int columns, int rows, int octaves, double share, std::uint64_t key)
      : columns_(columns), rows_(rows), octaves_(octaves), share_(share), key_(key) {}
  /// At texture coordinates of any size. [any]
  [[nodiscard]] double operator()(double s, double t) const noexcept {
    double sum = 0.0;
    double weight = 1.0;
    double weights = 0.0;
    for (int k = 0; k < octaves_; ++k) {
      sum += weight * TileNoise(columns_ << k, rows_ << k, key_ + static_cast<std::uint64_t>(k))(s, t);
      weights += weight;
      weight *= share_;
    }
    return sum / weights;
  }

 private:
  int columns_;
  int rows_;
  int octaves_;
  double share_;
  std::uint64_t key_;
};

/// One point in each of `columns` x `rows` cells, moved by up to `jitter` / 2 cells from its middle.
class ScatteredPoints {
 public:
  ScatteredPoints(int columns, int rows, double jitter, std::uint64_t key)
      : columns_(columns), rows_(rows), jitter_(jitter), chance_(key) {}

  /// Visits the points of the cells up to `reach` away: visit(dx, dy, i, j), (dx, dy) from the point to the place in
  /// cells, (i, j) the point's cell. [any]
  template <class Visit>
  void near(double s, double t, int reach, Visit&& visit) const {
    const double x = s * columns_;
    const double y = t * rows_;
    const int column = static_cast<int>(std::floor(x));
    const int row = static_cast<int>(std::floor(y));
    for (int b = row - reach; b <= row + reach; ++b) {
      for (int a = column - reach; a <= column + reach; ++a) {
        const int i = wrapped(a, columns_);
        const int j = wrapped(b, rows_);
        const double px = a + 0.5 + jitter_ * (chance_(i, j, 100) - 0.5);
        const double py = b + 0.5 + jitter_ * (chance_(i, j, 101) - 0.5);
        visit(x - px, y - py, i, j);
      }
    }
  }

  /// The greatest of what height(dx, dy, i, j) answers for the points that near() visits, and 0. [any]
  template <class Height>
  [[nodiscard]] double highest(double s, double t, int reach, Height&& height) const {
    double most = 0.0;
    near(s, t, reach, [&](double dx, double dy, int i, int j) { most = std::max(most, height(dx, dy, i, j)); });
    return most;
  }

  /// Distances (cells) to the nearest point and the next one, and the nearest one's cell.
  struct Nearest {
    double first = infinity;
    double second = infinity;
    int i = 0;
    int j = 0;
  };
  [[nodiscard]] Nearest nearest(double s, double t) const {
    Nearest found;
    near(s, t, 2, [&](double dx, double dy, int i, int j) {
      const double distance = std::hypot(dx, dy);
      if (distance < found.first) {
        found.second = found.first;
        found.first = distance;
        found.i = i;
        found.j = j;
      } else {
        found.second = std::min(found.second, distance);
      }
    });
    return found;
  }
  [[nodiscard]] const CellChance& chance() const noexcept { return chance_; }

 private:
  int columns_;
  int rows_;
  double jitter_;
  CellChance chance_;
};

}  // namespace asperity
