#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "asperity/core/math.h"

namespace asperity {

/// Least and greatest value over a part of a grid; lower > upper where nothing is known.
struct ValueRange {
  float lower = std::numeric_limits<float>::infinity();
  float upper = -std::numeric_limits<float>::infinity();
  void include(const ValueRange& other) noexcept {
    if (other.lower < lower) lower = other.lower;
    if (other.upper > upper) upper = other.upper;
  }
};

/// Octree of least and greatest values over the cells of a grid (large-data-2008, section 2, Fig. 3). From the root on,
/// a node is halved along every axis along which it has more than one leaf: into eight, and further down, where the
/// grid's shorter axes are used up, into four or two. All nodes of a level are one array, without pointers.
class MinMaxOctree {
 public:
  /// A box of leaves.
  struct Node {
    std::uint8_t level = 0;
    std::uint32_t at[3] = {0, 0, 0};
  };

  MinMaxOctree() = default;
  /// From the ranges of the leaves, x fastest; `leaves` along each axis, each 1 or more; a leaf is `leaf_cells` cells
  /// wide. [build]
  static MinMaxOctree build(const std::array<std::uint32_t, 3>& leaves, std::uint32_t leaf_cells,
                            std::vector<ValueRange> ranges);

  [[nodiscard]] int levels() const noexcept { return static_cast<int>(levels_.size()); }
  [[nodiscard]] std::uint32_t leaf_cells() const noexcept { return leaf_cells_; }
  /// Nodes of a level along an axis; level 0 are the leaves, the last level is the root.
  [[nodiscard]] std::uint32_t count(int level, std::size_t axis) const noexcept {
    return levels_[static_cast<std::size_t>(level)].count(axis);
  }
  [[nodiscard]] const ValueRange& range(const Node& node) const noexcept {
    const Level& level = levels_[node.level];
    return level.ranges[level.index(node.at[0], node.at[1], node.at[2])];
  }
  [[nodiscard]] Node root() const noexcept { return {static_cast<std::uint8_t>(levels() - 1), {0, 0, 0}}; }
  /// How many children a node has: 8, 4, 2, 1; 0 for a leaf. Writes them to `children`. [servo]
  int children(const Node& node, Node children[8]) const noexcept;
  /// The largest node that holds a cell and for which `crosses(node)` is false; its leaf when there is none. [servo]
  template <class Crosses>
  [[nodiscard]] Node outermost(const std::uint32_t cell[3], Crosses&& crosses) const noexcept {
    Node node = root();
    while (node.level > 0 && crosses(node)) {
      const Level& level = levels_[node.level];
      const Level& below = levels_[node.level - 1U];
      for (std::size_t a = 0; a < 3; ++a) {
        const std::uint32_t first = level.axes[a].child[node.at[a]];
        const std::uint32_t second = level.axes[a].child[node.at[a] + 1] - 1;
        node.at[a] = second > first && cell[a] >= below.axes[a].leaf[second] * leaf_cells_ ? second : first;
      }
      --node.level;
    }
    return node;
  }
  /// Cells [first, last) of a node along an axis, before cutting at the grid's end. [servo]
  [[nodiscard]] std::uint32_t first_cell(const Node& node, std::size_t axis) const noexcept {
    return levels_[node.level].axes[axis].leaf[node.at[axis]] * leaf_cells_;
  }
  [[nodiscard]] std::uint32_t last_cell(const Node& node, std::size_t axis) const noexcept {
    return levels_[node.level].axes[axis].leaf[node.at[axis] + 1] * leaf_cells_;
  }
  /// The same along all axes. [servo]
  void cells_of(const Node& node, std::uint32_t first[3], std::uint32_t last[3]) const noexcept {
    for (std::size_t a = 0; a < 3; ++a) {
      first[a] = first_cell(node, a);
      last[a] = last_cell(node, a);
    }
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

 private:
  /// How a level is cut along one axis; one more entry than nodes.
  struct Cuts {
    std::vector<std::uint32_t> leaf;   ///< first leaf of each node
    std::vector<std::uint32_t> child;  ///< first child of each on the level below
  };
  struct Level {
    std::array<Cuts, 3> axes;
    std::vector<ValueRange> ranges;
    [[nodiscard]] std::uint32_t count(std::size_t axis) const noexcept {
      return static_cast<std::uint32_t>(axes[axis].leaf.size() - 1);
    }
    [[nodiscard]] std::size_t index(std::uint32_t i, std::uint32_t j, std::uint32_t k) const noexcept {
      return i + static_cast<std::size_t>(count(0)) * (j + static_cast<std::size_t>(count(1)) * k);
    }
  };
  std::vector<Level> levels_;  ///< leaves first
  std::uint32_t leaf_cells_ = 1;
};

}  // namespace asperity
