#pragma once

#include <cstdint>
#include <vector>

#include "asperity/geometry/closest_point.h"
#include "asperity/geometry/mesh.h"

namespace asperity {

/// How far the octree divides.
struct OctreeSettings {
  std::uint32_t max_triangles_per_leaf = 8;  ///< a cell with more is split; at least 1
  int max_depth = 16;                        ///< levels below the root cell; 0 to 20
};

/// The papers' octree (hrm-2010, 3 and Alg. 2 line 3; haptic-textures-2005): cubic cells split in eight; a leaf lists
/// every triangle whose bounding box touches the cell, so that a triangle may stand in several leaves.
///
/// A cell is left whole, however many triangles it lists, where splitting would only list the same triangles again
/// (triangles larger than the cell, corners where many meet): no triangle stands in more than `most_copies` leaves on
/// average. Answers equal brute force: all distances and crossings are decided in double precision on the mesh's own
/// vertices. Queries are const, allocation-free and safe from any thread. The mesh must outlive the octree and stay in
/// place.
class TriangleOctree {
 public:
  static constexpr double most_copies = 8.0;

  /// About one second for 1.3 M triangles. Settings outside their range are moved into it. [build]
  static TriangleOctree build(const TriangleMesh& mesh, const OctreeSettings& settings = {});

  /// Calls visit(face) for each triangle whose bounding box meets `box` (touching counts), and for no other triangle.
  /// A triangle that spans several leaves may be visited several times. [servo]
  template <class Visit>
  void for_each_in_box(const Box& box, Visit&& visit) const;

  /// Nearest triangle within `bound` (m, inclusive; may be infinite) of `p`; face == no_index when there is none.
  /// Of several at the same distance any one is answered. [servo]
  [[nodiscard]] ClosestHit closest(const Vec3& p, double bound) const noexcept;

  /// First triangle that the segment meets, from either side, as by segment_triangle_intersection(). Of several at the
  /// same t any one is answered. [servo]
  [[nodiscard]] FirstHit first_hit(const Segment& segment) const noexcept;

  /// Bytes held by this object, its arrays included; the mesh is not counted.
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return sizeof(*this) + nodes_.capacity() * sizeof(Node) + faces_.capacity() * sizeof(std::uint32_t);
  }
  [[nodiscard]] std::size_t leaf_entries() const noexcept { return faces_.size(); }

 private:
  static constexpr int depth_limit = 20;
  /// A depth-first walk leaves at most seven siblings waiting on each level.
  static constexpr std::size_t stack_capacity = 7 * depth_limit + 8;
  static constexpr std::uint32_t inner_node = no_index;

  struct Node {
    std::uint32_t first = 0;  ///< leaf: into faces_; inner: first of eight consecutive children
    std::uint32_t count = 0;  ///< faces of a leaf, or inner_node
  };
  /// A node waiting to be visited. Cells are halved from the root on the way down, by the sums that built them.
  /// Without initial values: a query must not pay for filling a whole stack of them.
  struct Visit {
    std::uint32_t node;
    double key;
    Vec3 lower;
    Vec3 upper;
  };
  class Builder;

  /// Calls leaf(face) for the faces of every leaf that is not beyond, of each family of cells the nearest first:
  /// key(cell) answers how far away it is, beyond(key) whether that is farther than anything that is still wanted.
  template <class Key, class Beyond, class Leaf>
  void walk(const Key& key, const Beyond& beyond, const Leaf& leaf) const;
  /// Child `octant` of a cell: bit 0 is the upper half in x, bit 1 in y, bit 2 in z.
  static Box child_cell(const Box& cell, const Vec3& centre, unsigned octant) noexcept;
  [[nodiscard]] Box bounds_of(std::uint32_t face) const noexcept;

  const TriangleMesh* mesh_ = nullptr;
  Box root_;
  double magnitude_ = 0.0;  ///< largest coordinate of the root cell (m), for the bound on rounding
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> faces_;
};

inline Box TriangleOctree::child_cell(const Box& cell, const Vec3& centre, unsigned octant) noexcept {
  Box child = cell;
  for (unsigned axis = 0; axis < 3; ++axis) {
    ((octant >> axis) & 1U ? child.lower : child.upper)[static_cast<int>(axis)] = centre[static_cast<int>(axis)];
  }
  return child;
}

inline Box TriangleOctree::bounds_of(std::uint32_t face) const noexcept {
  const auto [a, b, c] = mesh_->corners(face);
  return {a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)};
}

template <class Key, class Beyond, class Leaf>
void TriangleOctree::walk(const Key& key, const Beyond& beyond, const Leaf& leaf) const {
  if (nodes_.empty()) return;
  std::array<Visit, stack_capacity> stack;  // NOLINT: filled as it grows
  std::size_t top = 0;
  std::size_t family = 0;
  const auto push = [&](std::uint32_t node, const Box& cell) {
    const double away = key(cell);
    if (beyond(away)) return;
    std::size_t slot = top++;
    for (; slot > family && stack[slot - 1].key < away; --slot) stack[slot] = stack[slot - 1];
    stack[slot] = {node, away, cell.lower, cell.upper};
  };
  push(0, root_);
  while (top > 0) {
    const Visit visit = stack[--top];
    if (beyond(visit.key)) continue;
    const Node& node = nodes_[visit.node];
    if (node.count != inner_node) {
      for (std::uint32_t i = 0; i < node.count; ++i) leaf(faces_[node.first + i]);
      continue;
    }
    family = top;
    const Box cell{visit.lower, visit.upper};
    const Vec3 centre = cell.centre();
    for (unsigned octant = 0; octant < 8; ++octant) {
      if (nodes_[node.first + octant].count != 0) push(node.first + octant, child_cell(cell, centre, octant));
    }
  }
}

template <class Visitor>
void TriangleOctree::for_each_in_box(const Box& box, Visitor&& visit) const {
  walk([&](const Box& cell) { return cell.overlaps(box) ? 0.0 : infinity; }, [](double key) { return key > 0.0; },
       [&](std::uint32_t face) {
         if (bounds_of(face).overlaps(box)) visit(face);
       });
}

}  // namespace asperity
