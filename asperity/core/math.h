#pragma once
// Small linear-algebra aliases over Eigen, so that the rest of the code names one vocabulary.
// All types are unaligned: their layout does not depend on the instruction set a user compiles for.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>

namespace asperity {

using Vec2 = Eigen::Matrix<double, 2, 1, Eigen::DontAlign>;
using Vec3 = Eigen::Matrix<double, 3, 1, Eigen::DontAlign>;
using Mat3 = Eigen::Matrix<double, 3, 3, Eigen::DontAlign>;
using Quat = Eigen::Quaternion<double, Eigen::DontAlign>;
using Vec2f = Eigen::Matrix<float, 2, 1, Eigen::DontAlign>;
using Vec3f = Eigen::Matrix<float, 3, 1, Eigen::DontAlign>;

inline constexpr double infinity = std::numeric_limits<double>::infinity();
inline constexpr std::uint32_t no_index = std::numeric_limits<std::uint32_t>::max();

/// A straight motion from one point to another (m).
struct Segment {
  Vec3 from = Vec3::Zero();
  Vec3 to = Vec3::Zero();
};

/// Axis-aligned box (m). Default constructed it is empty: `lower > upper`.
struct Box {
  Vec3 lower = Vec3::Constant(infinity);
  Vec3 upper = Vec3::Constant(-infinity);

  void include(const Vec3& point) {
    lower = lower.cwiseMin(point);
    upper = upper.cwiseMax(point);
  }
  void include(const Box& other) {
    lower = lower.cwiseMin(other.lower);
    upper = upper.cwiseMax(other.upper);
  }
  [[nodiscard]] bool empty() const { return (lower.array() > upper.array()).any(); }
  [[nodiscard]] Vec3 centre() const { return 0.5 * (lower + upper); }
  [[nodiscard]] Vec3 extent() const { return upper - lower; }
  /// Corner 0 to 7: bit `a` of `k` takes the upper end along axis a.
  [[nodiscard]] Vec3 corner(unsigned k) const {
    return {((k & 1U) != 0 ? upper : lower).x(), ((k & 2U) != 0 ? upper : lower).y(),
            ((k & 4U) != 0 ? upper : lower).z()};
  }
  /// Length of the diagonal (m); 0 for an empty box.
  [[nodiscard]] double diagonal() const { return empty() ? 0.0 : extent().norm(); }
  [[nodiscard]] bool overlaps(const Box& other) const {
    return lower.x() <= other.upper.x() && lower.y() <= other.upper.y() && lower.z() <= other.upper.z() &&
           other.lower.x() <= upper.x() && other.lower.y() <= upper.y() && other.lower.z() <= upper.z();
  }
  /// From a point to the nearest of the box (m); 0 inside.
  [[nodiscard]] double distance(const Vec3& p) const { return (p - p.cwiseMax(lower).cwiseMin(upper)).norm(); }
  /// The box grown by `margin` (m) on every side.
  [[nodiscard]] Box grown(double margin) const { return {lower.array() - margin, upper.array() + margin}; }
  /// The box around what `map` (Vec3 to Vec3, affine) makes of this one: around its eight corners. An empty box stays
  /// empty.
  template <class Map>
  [[nodiscard]] Box mapped(const Map& map) const {
    Box out;
    if (empty()) return out;
    for (unsigned k = 0; k < 8; ++k) out.include(Vec3(map(corner(k))));
    return out;
  }
};

}  // namespace asperity
