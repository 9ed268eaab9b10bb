#pragma once
// How a hierarchy over triangles is searched: what Bvh declares, with what is called for each triangle.

#include "asperity/geometry/bvh.h"

namespace asperity {

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

inline FloatBox Bvh::local_box(const Box& box) const noexcept {
  FloatBox local;
  to_local(box.lower, local.lower);
  to_local(box.upper, local.upper);
  const float grow = rounding(local.lower) + rounding(local.upper);
  for (int axis = 0; axis < 3; ++axis) {
    local.lower[axis] -= grow;
    local.upper[axis] += grow;
  }
  return local;
}

template <class Visit>
void Bvh::for_each_leaf(const FloatBox& box, Visit&& visit) const {
  if (nodes_.empty()) return;
  std::uint32_t stack[stack_capacity];
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const Node& node = nodes_[stack[--top]];
    for (unsigned mask = kernels_->meeting(node.boxes, box); mask != 0; mask &= mask - 1) {
      const std::uint32_t child = node.child[__builtin_ctz(mask)];
      if (child == empty_child) continue;
      if ((child & leaf_bit) == 0) {
        stack[top++] = child;
      } else {
        visit(leaves_[child & ~leaf_bit]);
      }
    }
  }
}

template <class Visit>
void Bvh::for_each_in_box(const Box& box, Visit&& visit) const {
  if (box.empty()) return;
  for_each_leaf(local_box(box), [&](const Leaf& leaf) {
    for (const std::uint32_t face : leaf.face) {
      if (face != no_index) visit(face);
    }
  });
}

inline PlanesAround Bvh::planes_around(const std::array<Vec3, 3>& corners, const Vec3& normal,
                                       double margin) const noexcept {
  PlanesAround planes;
  const double local_margin = margin * per_scale_;
  const auto set = [&](int k, const Vec3& outward, const Vec3& at) {
    for (int axis = 0; axis < 3; ++axis) planes.normal[k][axis] = static_cast<float>(outward[axis]);
    // The sum of its coordinates is no less than the normal's length.
    const double size = outward.cwiseAbs().sum();
    planes.limit[k] = static_cast<float>(outward.dot(at) + (local_margin + plane_rounding) * size);
  };
  Vec3 at[3];
  for (std::size_t i = 0; i < 3; ++i) at[i] = (corners[i] - origin_) * per_scale_;
  set(0, normal, at[0]);
  set(1, -normal, at[0]);
  for (std::size_t i = 0; i < 3; ++i) set(static_cast<int>(i) + 2, (at[(i + 1) % 3] - at[i]).cross(normal), at[i]);
  return planes;
}

template <class Visit>
void Bvh::for_each_beside(const std::array<Vec3, 3>& corners, const Vec3& normal, double margin, Visit&& visit) const {
  Box box;
  for (const Vec3& corner : corners) box.include(corner);
  const PlanesAround planes = planes_around(corners, normal, margin);
  for_each_leaf(local_box(box.grown(margin)), [&](const Leaf& leaf) {
    for (unsigned mask = kernels_->within(leaf.triangles, planes); mask != 0; mask &= mask - 1) {
      const std::uint32_t face = leaf.face[__builtin_ctz(mask)];
      if (face != no_index) visit(face);
    }
  });
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
