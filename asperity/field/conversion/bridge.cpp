#include <algorithm>
#include <bitset>
#include <cmath>
#include <queue>
#include <unordered_set>

#include "asperity/field/conversion/detail/signs.h"

namespace asperity::conversion {
namespace {

/// Follows the surface on which the winding number is 1/2 across holes, and makes distances to it.
class Bridge {
 public:
  Bridge(const TriangleIndex& index, const OrientedMesh& oriented, const BandFrame& frame,
         std::vector<VoxelBlock>& blocks)
      : index_(index),
        oriented_(oriented),
        frame_(frame),
        blocks_(blocks),
        map_(blocks),
        signed_(blocks.size(), std::bitset<SparseBlock::points>().set()) {}

  void run() {
    for_each_node(blocks_, [&](const Node& node) { look_around(node, 1); });
    // Holes can be wider than the band: its border is followed into what is not stored yet.
    for (std::size_t i = 0; i < edge_.size(); ++i) {
      const Node node = edge_[i];
      for (std::uint32_t way = 0; way < 6; ++way) {
        const Node next = made_beside(node, way);
        if (settle(next)) look_around(next, 6);
      }
    }
    if (edge_.empty()) return;
    for (const Node& node : edge_) offer(node, distance_to_crossing(node));
    march();
    parallel_for(blocks_.size(), shared_out, [&](std::size_t b) {
      for (std::uint32_t n = 0; n < SparseBlock::points; ++n) {
        const Node node{static_cast<std::uint32_t>(b), n};
        if (!signed_[b][n]) take_sign(node, winding(node));
        // The nearest face is that of the rim.
        if (moved_.contains(key_of(node)) && blocks_[b].face[n] == no_index)
          blocks_[b].face[n] = index_.closest(position(node), infinity).element;
      }
    });
  }

 private:
  static std::uint64_t key_of(const Node& node) { return std::uint64_t{node.block} << 9U | node.point; }
  [[nodiscard]] Vec3 position(const Node& node) const {
    return position_of(blocks_[node.block], node.point, frame_.origin, frame_.voxel);
  }
  [[nodiscard]] double winding(const Node& node) const { return oriented_.winding->at(position(node)); }
  [[nodiscard]] double value(const Node& node) const {
    return static_cast<double>(blocks_[node.block].distance[node.point]);
  }
  [[nodiscard]] bool is_signed(const Node& node) const { return signed_[node.block][node.point]; }
  [[nodiscard]] bool inside(const Node& node) const { return value(node) < 0.0; }
  [[nodiscard]] double limit(const Node& node) const { return inside(node) ? frame_.inward : frame_.outward; }

  void take_sign(const Node& node, double winding_number) {
    float& distance = blocks_[node.block].distance[node.point];
    distance = std::copysign(distance, winding_number > 0.5 ? -1.0F : 1.0F);
  }
  /// Gives a point its sign; false where it has one.
  bool settle(const Node& node) {
    if (is_signed(node)) return false;
    take_sign(node, winding(node));
    signed_[node.block][node.point] = true;
    return true;
  }

  /// The point beside one, its block made where it is not there.
  Node made_beside(const Node& node, std::uint32_t way) {
    Node next = map_.beside(node, way);
    if (next.block != no_index) return next;
    const double beyond = std::max(frame_.outward, frame_.inward);
    next.block = map_.append(place_beside(blocks_[node.block].at, way), beyond, blocks_);
    signed_.emplace_back();
    return next;
  }

  /// Whether inside meets outside between two points without a face between them.
  [[nodiscard]] bool crossed(const Node& a, const Node& b) const {
    return is_signed(a) && is_signed(b) && inside(a) != inside(b) &&
           std::abs(value(a)) + std::abs(value(b)) > frame_.voxel * (1.0 + 1e-5);
  }
  /// Notes the crossings around a point; `ways` 1: towards +x, +y, +z alone.
  void look_around(const Node& node, int ways) {
    for (std::uint32_t way = 0; way < 6; ++way) {
      if (ways == 1 && way % 2 == 0) continue;
      const Node next = map_.beside(node, way);
      if (next.block == no_index || !crossed(node, next)) continue;
      for (const Node& one : {node, next}) {
        if (listed_.insert(key_of(one)).second) edge_.push_back(one);
      }
    }
  }

  /// Distance (m) to the plane through the crossings along the axes.
  [[nodiscard]] double distance_to_crossing(const Node& node) const {
    const double here = winding(node);
    double sum = 0.0;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      double nearest = infinity;
      for (const std::uint32_t way : {2 * axis, 2 * axis + 1}) {
        const Node next = map_.beside(node, way);
        if (next.block == no_index || !crossed(node, next)) continue;
        const double there = winding(next);
        const double part = here != there ? std::clamp((0.5 - here) / (there - here), 1e-3, 1.0) : 0.5;
        nearest = std::min(nearest, part * frame_.voxel);
      }
      if (std::isfinite(nearest)) sum += 1.0 / (nearest * nearest);
    }
    return sum > 0.0 ? 1.0 / std::sqrt(sum) : infinity;
  }

  void offer(const Node& node, double distance) {
    float& stored = blocks_[node.block].distance[node.point];
    const auto rounded = static_cast<float>(distance);
    if (!(rounded < std::abs(stored))) return;
    stored = std::copysign(rounded, stored);
    moved_.insert(key_of(node));
    front_.push({distance, node});
  }

  /// Carries the distances on (fast marching, first order) where they are less than those to faces.
  void march() {
    while (!front_.empty()) {
      const auto [distance, node] = front_.top();
      front_.pop();
      if (distance > std::abs(value(node)) * (1.0 + 1e-6)) continue;
      if (!(distance < limit(node))) continue;
      for (std::uint32_t way = 0; way < 6; ++way) {
        const Node next = made_beside(node, way);
        settle(next);
        if (inside(next) == inside(node)) offer(next, marched(next));
      }
    }
  }

  /// The distance at a point by |grad d| = 1 from the nearer neighbours on its own side.
  [[nodiscard]] double marched(const Node& node) const {
    std::array<double, 3> nearer{};
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      nearer[axis] = infinity;
      for (const std::uint32_t way : {2 * axis, 2 * axis + 1}) {
        const Node next = map_.beside(node, way);
        if (next.block == no_index || !is_signed(next) || inside(next) != inside(node)) continue;
        nearer[axis] = std::min(nearer[axis], std::abs(value(next)));
      }
    }
    std::sort(nearer.begin(), nearer.end());
    // (d - a)^2 + (d - b)^2 + ... = voxel^2 over as many axes as lie below d.
    double distance = nearer[0] + frame_.voxel;
    double sum = nearer[0];
    double squares = nearer[0] * nearer[0];
    for (std::size_t n = 1; n < 3 && nearer[n] < distance; ++n) {
      sum += nearer[n];
      squares += nearer[n] * nearer[n];
      const auto terms = static_cast<double>(n + 1);
      const double root = sum * sum - terms * (squares - frame_.voxel * frame_.voxel);
      if (root < 0.0) break;
      distance = (sum + std::sqrt(root)) / terms;
    }
    return distance;
  }

  using Reached = std::pair<double, Node>;
  struct Later {
    bool operator()(const Reached& a, const Reached& b) const { return a.first > b.first; }
  };

  const TriangleIndex& index_;
  const OrientedMesh& oriented_;
  const BandFrame& frame_;
  std::vector<VoxelBlock>& blocks_;
  BlockMap map_;
  std::vector<std::bitset<SparseBlock::points>> signed_;
  std::vector<Node> edge_;  ///< points beside a crossing
  std::unordered_set<std::uint64_t> listed_;
  std::unordered_set<std::uint64_t> moved_;
  std::priority_queue<Reached, std::vector<Reached>, Later> front_;
};

}  // namespace

void bridge_holes(const TriangleIndex& index, const OrientedMesh& oriented, const BandFrame& frame,
                  std::vector<VoxelBlock>& blocks) {
  Bridge(index, oriented, frame, blocks).run();
}

}  // namespace asperity::conversion
