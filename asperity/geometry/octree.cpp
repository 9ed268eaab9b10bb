#include "asperity/geometry/octree.h"

#include <algorithm>

namespace asperity {
namespace {

/// Bound on the rounding of a distance between coordinates of the given size, in units of that size.
constexpr double rounding_of_magnitude = 64.0 * std::numeric_limits<double>::epsilon();

double squared_distance(const Box& box, const Vec3& p) noexcept {
  const Vec3 outside = (box.lower - p).cwiseMax(p - box.upper).cwiseMax(0.0);
  return outside.squaredNorm();
}

}  // namespace

class TriangleOctree::Builder {
 public:
  Builder(TriangleOctree& octree, const OctreeSettings& settings)
      : octree_(octree),
        leaf_size_(std::max(settings.max_triangles_per_leaf, 1U)),
        depth_(std::clamp(settings.max_depth, 0, depth_limit)) {}

  void run() {
    const std::size_t count = octree_.mesh_->triangles().size();
    bounds_.reserve(count);
    listed_.reserve(3 * count);
    for (std::uint32_t face = 0; face < count; ++face) {
      bounds_.push_back(octree_.bounds_of(face));
      listed_.push_back(face);
    }
    octree_.nodes_.emplace_back();
    split(0, octree_.root_, 0, count, depth_, 1.0);
    octree_.nodes_.shrink_to_fit();
    octree_.faces_.shrink_to_fit();
  }

 private:
  /// Bit i is set if the box reaches into octant i.
  static unsigned octants(const Box& box, const Vec3& centre) {
    const auto halves = [&](int axis, unsigned low, unsigned high) {
      return (box.lower[axis] <= centre[axis] ? low : 0U) | (box.upper[axis] >= centre[axis] ? high : 0U);
    };
    return halves(0, 0x55U, 0xAAU) & halves(1, 0x33U, 0xCCU) & halves(2, 0x0FU, 0xF0U);
  }

  void make_leaf(std::size_t node, std::size_t begin, std::size_t end) {
    octree_.nodes_[node] = {static_cast<std::uint32_t>(octree_.faces_.size()), static_cast<std::uint32_t>(end - begin)};
    const auto from = listed_.begin();
    octree_.faces_.insert(octree_.faces_.end(), from + static_cast<std::ptrdiff_t>(begin),
                          from + static_cast<std::ptrdiff_t>(end));
  }

  /// Splits the cell that lists listed_[begin, end), the end of that array. `copies`: how often splitting has listed a
  /// triangle again on the way here.
  void split(std::size_t node, const Box& cell, std::size_t begin, std::size_t end, int levels, double copies) {
    const Vec3 centre = cell.centre();
    std::size_t entries = 0;
    const bool may_split = end - begin > leaf_size_ && levels > 0;
    for (std::size_t i = begin; may_split && i < end; ++i) {
      entries += static_cast<std::size_t>(__builtin_popcount(octants(bounds_[listed_[i]], centre)));
    }
    const double child_copies = copies * static_cast<double>(entries) / static_cast<double>(end - begin);
    if (!may_split || child_copies > most_copies) return make_leaf(node, begin, end);
    const std::size_t first_child = octree_.nodes_.size();
    octree_.nodes_.resize(first_child + 8);
    octree_.nodes_[node] = {static_cast<std::uint32_t>(first_child), inner_node};
    for (unsigned octant = 0; octant < 8; ++octant) {
      const std::size_t child_begin = listed_.size();
      for (std::size_t i = begin; i < end; ++i) {
        if ((octants(bounds_[listed_[i]], centre) >> octant & 1U) != 0) listed_.push_back(listed_[i]);
      }
      split(first_child + octant, child_cell(cell, centre, octant), child_begin, listed_.size(), levels - 1,
            child_copies);
      listed_.resize(child_begin);
    }
  }

  TriangleOctree& octree_;
  std::uint32_t leaf_size_;
  int depth_;
  std::vector<Box> bounds_;
  std::vector<std::uint32_t> listed_;
};

TriangleOctree TriangleOctree::build(const TriangleMesh& mesh, const OctreeSettings& settings) {
  TriangleOctree octree;
  octree.mesh_ = &mesh;
  const Box& bounds = mesh.bounds();
  const double half = 0.5 * bounds.extent().maxCoeff();
  octree.root_.include(bounds);
  octree.root_.include(Vec3(bounds.centre().array() - half));
  octree.root_.include(Vec3(bounds.centre().array() + half));
  octree.magnitude_ = std::max(octree.root_.lower.cwiseAbs().maxCoeff(), octree.root_.upper.cwiseAbs().maxCoeff());
  Builder(octree, settings).run();
  return octree;
}

ClosestHit TriangleOctree::closest(const Vec3& p, double bound) const noexcept {
  ClosestHit best;
  if (!(bound >= 0.0)) return best;
  // Cells are grown by the rounding of the distances that they are compared with, so that no nearest triangle is lost.
  const double margin = rounding_of_magnitude * (magnitude_ + p.cwiseAbs().maxCoeff());
  double limit = bound * bound;
  // Written so that not-a-number is refused.
  walk([&](const Box& cell) { return squared_distance(cell.grown(margin), p); },
       [&](double key) { return !(key <= limit); },
       [&](std::uint32_t face) {
         const auto [a, b, c] = mesh_->corners(face);
         const ClosestHit hit{face, closest_point_on_triangle(p, a, b, c)};
         if (!(hit.point.squared_distance <= limit && hit.before(best))) return;
         best = hit;
         limit = hit.point.squared_distance;
       });
  return best;
}

FirstHit TriangleOctree::first_hit(const Segment& segment) const noexcept {
  FirstHit best;
  const Vec3 direction = segment.to - segment.from;
  const double reach = std::max(segment.from.cwiseAbs().maxCoeff(), segment.to.cwiseAbs().maxCoeff());
  const double margin = rounding_of_magnitude * (magnitude_ + reach);
  // Widened by the rounding of the divisions, so that no cell is missed.
  const auto entry = [&](const Box& cell) {
    double enter = 0.0;
    double leave = best.t;
    for (int axis = 0; axis < 3; ++axis) {
      const double to_lower = cell.lower[axis] - margin - segment.from[axis];
      const double to_upper = cell.upper[axis] + margin - segment.from[axis];
      if (direction[axis] == 0.0) {
        if (to_lower > 0.0 || to_upper < 0.0) return infinity;
        continue;
      }
      const double t_lower = to_lower / direction[axis];
      const double t_upper = to_upper / direction[axis];
      enter = std::max(enter, std::min(t_lower, t_upper));
      leave = std::min(leave, std::max(t_lower, t_upper));
    }
    return enter * (1.0 - rounding_of_magnitude) > leave * (1.0 + rounding_of_magnitude) ? infinity : enter;
  };
  walk(
      entry, [&](double key) { return !(key <= 1.0 && key * (1.0 - rounding_of_magnitude) <= best.t); },
      [&](std::uint32_t face) {
        const auto [a, b, c] = mesh_->corners(face);
        FirstHit hit{face};
        if (segment_triangle_intersection(segment, a, b, c, hit.t) && hit.before(best)) best = hit;
      });
  return best;
}

}  // namespace asperity
