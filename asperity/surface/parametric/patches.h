#pragma once
// A quadtree of boxes over the parameters of a surface: what a ray passes, and what is near a point.

#include <algorithm>
#include <cstdint>
#include <vector>

#include "asperity/core/math.h"
#include "asperity/geometry/clip.h"
#include "asperity/geometry/simd_kernels.h"

namespace asperity {

/// 2^levels by 2^levels patches of equal parameter size and, above them, boxes of four each. Immutable.
class ParametricPatches {
 public:
  static constexpr int most_levels = 8;

  ParametricPatches() = default;
  /// `leaves`: bounds of the patches, row by row (u varies fastest), 4^levels of them. [build]
  ParametricPatches(int levels, const std::vector<Box>& leaves);

  [[nodiscard]] int levels() const noexcept { return levels_; }
  /// Patches along either parameter. [servo]
  [[nodiscard]] std::uint32_t count() const noexcept { return 1U << static_cast<unsigned>(levels_); }
  /// Bounds of all. [servo]
  [[nodiscard]] Box bounds() const noexcept { return box(0, 0, 0); }
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return sizeof(*this) + boxes_.size() * sizeof(FloatBox); }

  /// Calls leaf(column, row) for patches whose box the segment enters before `until`, nearer ones first as a rule.
  /// `until` (fraction of the segment) may be lowered by the callee. [servo]
  template <class Leaf>
  void along(const Segment& segment, const double& until, Leaf&& leaf) const noexcept {
    if (boxes_.empty()) return;
    const Vec3 direction = segment.to - segment.from;
    const auto entry = [&](const Box& box) {
      double first = 0.0;
      double last = 1.0;
      return clip_line(box, segment.from, direction, first, last) ? first : infinity;
    };
    visit(entry, until, leaf);
  }
  /// Calls leaf(column, row) for patches whose box comes nearer to `p` than `bound` (m), nearer ones first as a rule;
  /// `bound` may be lowered by the callee. [servo]
  template <class Leaf>
  void near(const Vec3& p, const double& bound, Leaf&& leaf) const noexcept {
    if (boxes_.empty()) return;
    visit([&](const Box& box) { return box.distance(p); }, bound, leaf);
  }

 private:
  struct Node {
    double key = 0.0;
    std::uint16_t level = 0;
    std::uint16_t column = 0;
    std::uint16_t row = 0;
  };

  [[nodiscard]] std::size_t index(unsigned level, std::uint32_t column, std::uint32_t row) const noexcept {
    return ((std::size_t{1} << (2U * level)) - 1) / 3 + (static_cast<std::size_t>(row) << level) + column;
  }
  [[nodiscard]] Box box(unsigned level, std::uint32_t column, std::uint32_t row) const noexcept {
    const FloatBox& b = boxes_[index(level, column, row)];
    return {Vec3(static_cast<double>(b.lower[0]), static_cast<double>(b.lower[1]), static_cast<double>(b.lower[2])),
            Vec3(static_cast<double>(b.upper[0]), static_cast<double>(b.upper[1]), static_cast<double>(b.upper[2]))};
  }
  /// Depth first, the child with the least key first; what has no lower key than `limit` is passed over.
  template <class Key, class Leaf>
  void visit(const Key& key, const double& limit, Leaf&& leaf) const noexcept {
    Node stack[3 * most_levels + 4];
    int size = 0;
    stack[size++] = {key(box(0, 0, 0)), 0, 0, 0};
    while (size > 0) {
      const Node node = stack[--size];
      if (!(node.key < limit)) continue;
      if (node.level == levels_) {
        leaf(static_cast<std::uint32_t>(node.column), static_cast<std::uint32_t>(node.row));
        continue;
      }
      Node children[4];
      for (unsigned k = 0; k < 4; ++k) {
        Node& child = children[k];
        child.level = static_cast<std::uint16_t>(node.level + 1U);
        child.column = static_cast<std::uint16_t>(2U * node.column + (k & 1U));
        child.row = static_cast<std::uint16_t>(2U * node.row + (k >> 1U));
        child.key = key(box(child.level, child.column, child.row));
      }
      std::sort(children, children + 4, [](const Node& a, const Node& b) { return a.key > b.key; });
      for (const Node& child : children) {
        if (child.key < limit) stack[size++] = child;
      }
    }
  }

  std::vector<FloatBox> boxes_;  ///< level by level from the root
  int levels_ = 0;
};

}  // namespace asperity
