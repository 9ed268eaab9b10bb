#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "asperity/geometry/closest_point.h"
#include "asperity/geometry/mesh.h"
#include "asperity/geometry/simd_kernels.h"
#include "asperity/geometry/triangle_patch.h"

namespace asperity {

/// How the hierarchy is searched.
struct BvhSettings {
  bool plain_kernels = false;  ///< plain C++ in place of AVX2: the oracle
};

/// Takes a pair of triangles.
using MeetingVisit = std::function<void(std::uint32_t, std::uint32_t)>;

/// Where refitting finds the corners of each leaf's triangles in a row, and room for what it measures. [build]
struct BvhFitting {
  struct Corners {
    std::uint32_t vertex[3][8];  ///< unused places repeat the first triangle
    std::uint32_t used;
  };
  std::vector<Corners> leaves;
  std::vector<FloatBox> bounds;
};

/// Boxes around what stands over each triangle, in the order of a hierarchy over the triangles: what is searched for
/// may be larger than they are. [build]
struct FaceBoxes {
  std::vector<BoxesOf8> leaves;
  std::vector<BoxesOf8> nodes;
  double farther = 0.0;  ///< how far they reach beyond the triangles' own boxes at most (m)
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return (leaves.capacity() + nodes.capacity()) * sizeof(BoxesOf8);
  }
};

/// Bounding-volume hierarchy, eight wide, binned by surface area (Wald 2007); leaves hold up to eight triangles in
/// single precision relative to the object's centre and size. Single precision only discards, with a bound on its
/// rounding; every answer is decided in double precision on the mesh's own vertices, so it equals brute force. Queries
/// are const, allocation-free and safe from any thread. The mesh must outlive the hierarchy.
class Bvh {
 public:
  /// About 0.5 s for 1.3 M triangles. [build]
  static Bvh build(const TriangleMesh& mesh, const BvhSettings& settings = {});
  /// Fits boxes and leaves to another mesh of the same triangles; which triangles share a leaf stays. Every answer is
  /// the mesh's, as after building; only the time it takes may grow (see cost()). [build]
  void refit(const TriangleMesh& mesh, BvhFitting& fitting) noexcept;
  /// What refitting needs beside the hierarchy, for it and all its copies. [build]
  [[nodiscard]] BvhFitting fitting() const;
  /// Boxes that a random line through the root's box meets, on average (surface area heuristic): what a search costs.
  /// [any]
  [[nodiscard]] double cost() const noexcept { return cost_; }

  /// Nearest triangle within `bound` (m) of `p`; face == no_index when there is none. [servo]
  [[nodiscard]] ClosestHit closest(const Vec3& p, double bound) const noexcept;
  /// First triangle met by the segment, from either side. [servo]
  [[nodiscard]] FirstHit first_hit(const Segment& segment) const noexcept;
  /// Fills `patch` around `centre` with every leaf nearer than `reach` (m), or with the nearest ones if they do not
  /// fit, and certifies how far the list is complete. [servo]
  void gather(const Vec3& centre, double reach, std::uint64_t owner, TrianglePatch& patch) const noexcept;

  /// Calls visit(face, distance, offset) for every triangle that comes within `reach` (m) of `p`, and perhaps for some
  /// that come a rounding less near; distance and offset (from the triangle to p) in metres, single precision,
  /// `error()` of it off at most. From the patch alone, which must cover the ball. [servo]
  template <class Visit>
  void scan(const TrianglePatch& patch, const Vec3& p, double reach, Visit&& visit) const noexcept;
  /// The same from the whole tree. [servo]
  template <class Visit>
  void scan(const Vec3& p, double reach, Visit&& visit) const noexcept;
  /// Bound on the error of distances and offsets that `scan` gives around `p` (m). [servo]
  [[nodiscard]] double error(const Vec3& p) const noexcept {
    float local[3];
    to_local(p, local);
    return static_cast<double>(rounding(local)) * scale_;
  }

  /// Boxes, one a triangle (m), ready to be searched; never too small. [build]
  [[nodiscard]] FaceBoxes enclosed(std::span<const Box> boxes) const;
  /// Calls visit(one, other) once for every pair of triangles whose boxes meet, and perhaps for some that miss each
  /// other by a rounding. [build]
  void for_each_meeting(const FaceBoxes& boxes, const MeetingVisit& visit) const;
  /// Calls visit(face) for each triangle in a leaf whose box meets `box`; once for each triangle. [servo]
  template <class Visit>
  void for_each_in_box(const Box& box, Visit&& visit) const;
  /// Calls visit(face, t_entry) for triangles in leaves that the segment, grown by `radius`, passes, nearest leaf
  /// first, until visit answers a t (0 … 1) below the entry of all that remain. [servo]
  template <class Visit>
  void for_each_along(const Segment& segment, double radius, Visit&& visit) const;

  /// The same for the triangles whose own boxes the segment meets. [servo]
  template <class Visit>
  void for_each_along(const Segment& segment, const FaceBoxes& boxes, Visit&& visit) const;
  /// Calls visit(face) for triangles whose boxes come within a bound (m) of `p`, the nearest first, roughly; visit
  /// answers the bound from then on. [servo]
  template <class Visit>
  void for_each_near(const Vec3& p, double bound, const FaceBoxes& boxes, Visit&& visit) const;

  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return sizeof(*this) + nodes_.capacity() * sizeof(Node) + leaves_.capacity() * sizeof(Leaf) +
           cylinders_.capacity() * sizeof(Cylinder);
  }

 private:
  static constexpr std::uint32_t leaf_bit = 0x80000000U;
  static constexpr std::uint32_t empty_child = no_index;
  static constexpr int stack_capacity = 256;

  struct Node {
    BoxesOf8 boxes;
    std::uint32_t child[8];
  };
  struct Leaf {
    TrianglesOf8 triangles;
    std::uint32_t face[8];
  };
  struct Cylinder {
    float centre[3];
    float axis[3];
    float radius;
    float half_height;
  };
  struct Entry {
    float key;
    std::uint32_t child;
  };
  struct LocalSegment;
  class Builder;
  class Fitter;
  class Join;

  /// Sets the mesh, and the origin and unit of single precision.
  void frame(const TriangleMesh& mesh) noexcept;
  void fit_avx2(BvhFitting& fitting) noexcept;
  void to_local(const Vec3& p, float local[3]) const noexcept;
  [[nodiscard]] LocalSegment local_segment(const Segment& segment) const noexcept;
  template <class Boxes, class Meets, class TakeLeaf>
  void descend(float& limit, const Boxes& boxes, const Meets& meets, const TakeLeaf& leaf) const;
  /// The one of a mask with the least key.
  static unsigned nearest_of(unsigned mask, const float (&keys)[8]) noexcept;
  [[nodiscard]] ClosestHit closest_from_afar(const Vec3& p, double bound) const noexcept;
  static bool reaches(const Cylinder& cylinder, const float local[3], float limit) noexcept;
  template <class Visit>
  void scan_leaf(std::uint32_t index, const float local[3], float limit, Visit& visit) const noexcept;
  /// Bound on the rounding of distances from `local`, in units of scale_.
  static float rounding(const float local[3]) noexcept;

  const TriangleMesh* mesh_ = nullptr;
  const SearchKernels* kernels_ = nullptr;
  Vec3 origin_ = Vec3::Zero();
  double scale_ = 1.0;
  double per_scale_ = 1.0;  ///< 1 / scale_
  double cost_ = 0.0;
  std::vector<Node> nodes_;  ///< each before its children
  std::vector<Leaf> leaves_;
  std::vector<Cylinder> cylinders_;  ///< one around each leaf
};

inline void Bvh::to_local(const Vec3& p, float local[3]) const noexcept {
  for (int axis = 0; axis < 3; ++axis) local[axis] = static_cast<float>((p[axis] - origin_[axis]) * per_scale_);
}

inline unsigned Bvh::nearest_of(unsigned mask, const float (&keys)[8]) noexcept {
  auto nearest = static_cast<unsigned>(__builtin_ctz(mask));
  for (mask &= mask - 1; mask != 0; mask &= mask - 1) {
    const auto i = static_cast<unsigned>(__builtin_ctz(mask));
    if (keys[i] < keys[nearest]) nearest = i;
  }
  return nearest;
}

inline float Bvh::rounding(const float local[3]) noexcept {
  const auto magnitude = [](float v) { return v < 0.0F ? -v : v; };
  return 2e-6F * (1.0F + magnitude(local[0]) + magnitude(local[1]) + magnitude(local[2]));
}

inline bool Bvh::reaches(const Cylinder& cylinder, const float local[3], float limit) noexcept {
  const Eigen::Vector3f offset(local[0] - cylinder.centre[0], local[1] - cylinder.centre[1],
                               local[2] - cylinder.centre[2]);
  const Eigen::Vector3f axis(cylinder.axis[0], cylinder.axis[1], cylinder.axis[2]);
  const float along = offset.dot(axis);
  const float beyond = std::max(0.0F, (offset - along * axis).norm() - cylinder.radius);
  const float above = std::max(0.0F, std::abs(along) - cylinder.half_height);
  return beyond * beyond + above * above <= limit * limit;
}

template <class Visit>
void Bvh::scan_leaf(std::uint32_t index, const float local[3], float limit, Visit& visit) const noexcept {
  const Leaf& leaf = leaves_[index];
  DistancesOf8 found;
  kernels_->triangles(leaf.triangles, local, found);
  for (unsigned i = 0; i < 8; ++i) {
    // Unused places lie far away, outside every limit that a bounded reach can have.
    if (found.distance[i] > limit || leaf.face[i] == no_index) continue;
    visit(leaf.face[i], static_cast<double>(found.distance[i]) * scale_,
          Vec3(scale_ * static_cast<double>(found.offset[0][i]), scale_ * static_cast<double>(found.offset[1][i]),
               scale_ * static_cast<double>(found.offset[2][i])));
  }
}

template <class Visit>
void Bvh::scan(const TrianglePatch& patch, const Vec3& p, double reach, Visit&& visit) const noexcept {
  float local[3];
  to_local(p, local);
  const float limit = static_cast<float>(reach * per_scale_) + rounding(local);
  const auto moved = static_cast<float>((p - patch.centre).norm() * per_scale_);
  for (std::uint32_t first = 0; first < patch.count; first += 8) {
    // The nearest leaf of the block has come at most `moved` nearer; blocks are in ascending order.
    if (patch.nearest[first / 8] - moved > limit) break;
    unsigned mask = kernels_->cylinders(patch.bounds[first / 8], local, limit);
    for (; mask != 0; mask &= mask - 1) {
      scan_leaf(patch.leaf[first + static_cast<unsigned>(__builtin_ctz(mask))], local, limit, visit);
    }
  }
}

template <class Visit>
void Bvh::scan(const Vec3& p, double reach, Visit&& visit) const noexcept {
  if (nodes_.empty()) return;
  float local[3];
  to_local(p, local);
  const float limit = static_cast<float>(reach * per_scale_) + rounding(local);
  std::uint32_t stack[stack_capacity];
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const Node& node = nodes_[stack[--top]];
    float squared[8];
    unsigned mask = kernels_->boxes(node.boxes, local, limit * limit, squared);
    for (; mask != 0; mask &= mask - 1) {
      const std::uint32_t child = node.child[__builtin_ctz(mask)];
      if (child == empty_child) continue;
      if ((child & leaf_bit) == 0) {
        stack[top++] = child;
      } else if (reaches(cylinders_[child & ~leaf_bit], local, limit)) {
        scan_leaf(child & ~leaf_bit, local, limit, visit);
      }
    }
  }
}

template <class Visit>
void Bvh::for_each_in_box(const Box& box, Visit&& visit) const {
  if (nodes_.empty() || box.empty()) return;
  float lower[3];
  float upper[3];
  to_local(box.lower, lower);
  to_local(box.upper, upper);
  const float grow = rounding(lower) + rounding(upper);
  const auto meets = [&](const BoxesOf8& boxes, unsigned i) {
    bool overlap = true;
    for (int axis = 0; axis < 3; ++axis) {
      overlap = overlap && boxes.lower[axis][i] <= upper[axis] + grow && boxes.upper[axis][i] >= lower[axis] - grow;
    }
    return overlap;
  };
  std::uint32_t stack[stack_capacity];
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const Node& node = nodes_[stack[--top]];
    for (unsigned i = 0; i < 8; ++i) {
      const std::uint32_t child = node.child[i];
      if (child == empty_child || !meets(node.boxes, i)) continue;
      if ((child & leaf_bit) == 0) {
        stack[top++] = child;
        continue;
      }
      for (const std::uint32_t face : leaves_[child & ~leaf_bit].face) {
        if (face != no_index) visit(face);
      }
    }
  }
}

/// A segment as the kernels take it.
struct Bvh::LocalSegment {
  float origin[3];
  float inverse[3];
  float grow;  ///< bound on the rounding of both ends
};

inline Bvh::LocalSegment Bvh::local_segment(const Segment& segment) const noexcept {
  LocalSegment local;
  float end[3];
  to_local(segment.from, local.origin);
  to_local(segment.to, end);
  local.grow = rounding(local.origin) + rounding(end);
  for (int axis = 0; axis < 3; ++axis) {
    const float direction = end[axis] - local.origin[axis];
    // A direction of zero would turn 0 * infinity into NaN on a box's face; a tiny one keeps every comparison defined.
    local.inverse[axis] = 1.0F / (direction >= 0.0F ? direction + 1e-20F : direction - 1e-20F);
  }
  return local;
}

/// Visits leaves, the nearest first, roughly: boxes(node) are those of a node's children, meets(boxes, keys) tells
/// which of the eight come into question, and their keys; what has a key above `limit`, which leaf(index) lowers, does
/// not.
template <class Boxes, class Meets, class TakeLeaf>
void Bvh::descend(float& limit, const Boxes& boxes, const Meets& meets, const TakeLeaf& leaf) const {
  if (nodes_.empty()) return;
  Entry stack[stack_capacity];
  int top = 0;
  stack[top++] = {0.0F, 0};
  while (top > 0) {
    const Entry entry = stack[--top];
    if (entry.key > limit) continue;
    if ((entry.child & leaf_bit) != 0) {
      leaf(entry.child & ~leaf_bit);
      continue;
    }
    float keys[8];
    unsigned mask = meets(boxes(entry.child), keys);
    const int first = top;
    for (; mask != 0; mask &= mask - 1) {
      const auto i = static_cast<unsigned>(__builtin_ctz(mask));
      const std::uint32_t child = nodes_[entry.child].child[i];
      if (child == empty_child) continue;
      int slot = top++;
      for (; slot > first && stack[slot - 1].key < keys[i]; --slot) stack[slot] = stack[slot - 1];
      stack[slot] = {keys[i], child};
    }
  }
}

template <class Visit>
void Bvh::for_each_along(const Segment& segment, double radius, Visit&& visit) const {
  const LocalSegment local = local_segment(segment);
  const float grow = static_cast<float>(radius * per_scale_) * 1.000001F + local.grow;
  float limit = 1.00001F;
  descend(
      limit, [&](std::uint32_t node) -> const BoxesOf8& { return nodes_[node].boxes; },
      [&](const BoxesOf8& boxes, float(&keys)[8]) {
        return kernels_->ray(boxes, local.origin, local.inverse, limit, grow, keys);
      },
      [&](std::uint32_t leaf) {
        for (const std::uint32_t face : leaves_[leaf].face) {
          if (face == no_index) continue;
          limit = static_cast<float>(visit(face)) * 1.00001F + 1e-6F;
        }
      });
}

template <class Visit>
void Bvh::for_each_along(const Segment& segment, const FaceBoxes& boxes, Visit&& visit) const {
  const LocalSegment local = local_segment(segment);
  float limit = 1.00001F;
  const auto meets = [&](const BoxesOf8& eight, float(&keys)[8]) {
    return kernels_->ray(eight, local.origin, local.inverse, limit, local.grow, keys);
  };
  descend(
      limit, [&](std::uint32_t node) -> const BoxesOf8& { return boxes.nodes[node]; }, meets,
      [&](std::uint32_t leaf) {
        float keys[8];
        unsigned mask = meets(boxes.leaves[leaf], keys);
        while (mask != 0) {
          const auto i = nearest_of(mask, keys);
          mask &= ~(1U << i);
          if (keys[i] > limit || leaves_[leaf].face[i] == no_index) continue;
          limit = static_cast<float>(visit(leaves_[leaf].face[i])) * 1.00001F + 1e-6F;
        }
      });
}

template <class Visit>
void Bvh::for_each_near(const Vec3& p, double bound, const FaceBoxes& boxes, Visit&& visit) const {
  float local[3];
  to_local(p, local);
  const float error = rounding(local);
  // Squares of distances that any box may have from here.
  const auto square = [&](double distance) {
    const float reach = std::min(static_cast<float>(std::min(distance * per_scale_, 1e15)) * 1.000001F + error, 1e15F);
    return reach * reach;
  };
  float limit = square(bound);
  const auto meets = [&](const BoxesOf8& eight, float(&keys)[8]) { return kernels_->boxes(eight, local, limit, keys); };
  descend(
      limit, [&](std::uint32_t node) -> const BoxesOf8& { return boxes.nodes[node]; }, meets,
      [&](std::uint32_t leaf) {
        float keys[8];
        unsigned mask = meets(boxes.leaves[leaf], keys);
        while (mask != 0) {
          const auto i = nearest_of(mask, keys);
          mask &= ~(1U << i);
          if (keys[i] > limit || leaves_[leaf].face[i] == no_index) continue;
          limit = square(visit(leaves_[leaf].face[i]));
        }
      });
}

}  // namespace asperity
