#include "asperity/field/volume/min_max_octree.h"

#include <cassert>
#include <iterator>

#include "asperity/field/volume/places.h"

namespace asperity {

MinMaxOctree MinMaxOctree::build(const std::array<std::uint32_t, 3>& leaves, std::uint32_t leaf_cells,
                                 std::vector<ValueRange> ranges) {
  assert(ranges.size() == static_cast<std::size_t>(leaves[0]) * leaves[1] * leaves[2]);
  // From the root down, as the paper has it; then turned, so that level 0 are the leaves.
  std::vector<Level> down(1);
  for (std::size_t a = 0; a < 3; ++a) down[0].axes[a].leaf = {0, leaves[a]};
  const auto whole = [&](const Level& level) {
    for (std::size_t a = 0; a < 3; ++a) {
      if (level.count(a) < leaves[a]) return false;
    }
    return true;
  };
  while (!whole(down.back())) {
    Level next;
    Level& above = down.back();
    for (std::size_t a = 0; a < 3; ++a) {
      Cuts& cuts = above.axes[a];
      std::vector<std::uint32_t>& leaf = next.axes[a].leaf;
      for (std::size_t i = 0; i + 1 < cuts.leaf.size(); ++i) {
        cuts.child.push_back(static_cast<std::uint32_t>(leaf.size()));
        leaf.push_back(cuts.leaf[i]);
        const std::uint32_t length = cuts.leaf[i + 1] - cuts.leaf[i];
        if (length > 1) leaf.push_back(cuts.leaf[i] + (length + 1) / 2);
      }
      cuts.child.push_back(static_cast<std::uint32_t>(leaf.size()));
      leaf.push_back(leaves[a]);
    }
    down.push_back(std::move(next));
  }
  MinMaxOctree tree;
  tree.leaf_cells_ = leaf_cells;
  tree.levels_.assign(std::make_move_iterator(down.rbegin()), std::make_move_iterator(down.rend()));
  tree.levels_.front().ranges = std::move(ranges);
  for (std::size_t l = 1; l < tree.levels_.size(); ++l) {
    Level& level = tree.levels_[l];
    const Level& below = tree.levels_[l - 1];
    level.ranges.resize(static_cast<std::size_t>(level.count(0)) * level.count(1) * level.count(2));
    const std::uint32_t first[3] = {};
    const std::uint32_t last[3] = {level.count(0), level.count(1), level.count(2)};
    for_each_place(first, last, [&](std::uint32_t i, std::uint32_t j, std::uint32_t k) {
      Node children[8];
      const Node node{static_cast<std::uint8_t>(l), {i, j, k}};
      const int count = tree.children(node, children);
      ValueRange& range = level.ranges[level.index(i, j, k)];
      for (int c = 0; c < count; ++c) {
        range.include(below.ranges[below.index(children[c].at[0], children[c].at[1], children[c].at[2])]);
      }
    });
  }
  return tree;
}

int MinMaxOctree::children(const Node& node, Node children[8]) const noexcept {
  if (node.level == 0) return 0;
  const Level& level = levels_[node.level];
  std::uint32_t first[3];
  std::uint32_t last[3];
  for (std::size_t a = 0; a < 3; ++a) {
    first[a] = level.axes[a].child[node.at[a]];
    last[a] = level.axes[a].child[node.at[a] + 1];
  }
  int written = 0;
  for_each_place(first, last, [&](std::uint32_t i, std::uint32_t j, std::uint32_t k) {
    children[written++] = {static_cast<std::uint8_t>(node.level - 1), {i, j, k}};
  });
  return written;
}

std::size_t MinMaxOctree::memory_bytes() const noexcept {
  std::size_t bytes = sizeof(*this);
  for (const Level& level : levels_) {
    bytes += level.ranges.capacity() * sizeof(ValueRange);
    for (const Cuts& cuts : level.axes) bytes += (cuts.leaf.capacity() + cuts.child.capacity()) * sizeof(std::uint32_t);
  }
  return bytes;
}

}  // namespace asperity
