// Which of many boxes, one a triangle, meet: the hierarchy joined with itself.

#include <cstring>

#include "asperity/geometry/bvh.h"
#include "asperity/geometry/triangle_index.h"

namespace asperity {

namespace {

#define ASPERITY_INLINE [[gnu::always_inline]] inline

/// Which of the eight boxes meet `box`: not zero for those that do. Answers whether any does.
ASPERITY_INLINE bool meeting(const BoxesOf8& boxes, const FloatBox& box, std::int32_t (&met)[8]) {
  using Floats = float __attribute__((vector_size(32)));
  using Ints = std::int32_t __attribute__((vector_size(32)));
  Ints all = Ints{} - 1;
  for (int axis = 0; axis < 3; ++axis) {
    Floats lower;
    Floats upper;
    std::memcpy(&lower, boxes.lower[axis], sizeof(lower));
    std::memcpy(&upper, boxes.upper[axis], sizeof(upper));
    all &= (lower <= box.upper[axis]) & (upper >= box.lower[axis]);
  }
  std::memcpy(met, &all, sizeof(met));
  std::uint64_t words[4];
  std::memcpy(words, &all, sizeof(words));
  return (words[0] | words[1] | words[2] | words[3]) != 0;
}

FloatBox around(const BoxesOf8& boxes) {
  FloatBox all;
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < 8; ++i) {
      all.lower[axis] = std::min(all.lower[axis], boxes.lower[axis][i]);
      all.upper[axis] = std::max(all.upper[axis], boxes.upper[axis][i]);
    }
  }
  return all;
}

}  // namespace

class Bvh::Join {
 public:
  Join(const Bvh& bvh, const FaceBoxes& boxes) : bvh_(bvh), leaves_(boxes.leaves), nodes_(boxes.nodes) {}

  ASPERITY_INLINE void run(const MeetingVisit& visit) const {
    for (std::uint32_t leaf = 0; leaf < leaves_.size(); ++leaf) {
      const FloatBox whole = around(leaves_[leaf]);
      std::uint32_t stack[stack_capacity];
      int top = 0;
      stack[top++] = 0;
      while (top > 0) {
        const std::uint32_t node = stack[--top];
        std::int32_t met[8];
        if (!meeting(nodes_[node], whole, met)) continue;
        for (std::size_t i = 0; i < 8; ++i) {
          if (met[i] == 0) continue;
          const std::uint32_t child = bvh_.nodes_[node].child[i];
          if ((child & leaf_bit) == 0) {
            stack[top++] = child;
          } else if ((child & ~leaf_bit) >= leaf) {
            join(leaf, child & ~leaf_bit, visit);
          }
        }
      }
    }
  }
#if defined(__x86_64__)
  __attribute__((target("avx2"))) void run_avx2(const MeetingVisit& visit) const {
    run(visit);
  }
#endif

 private:
  ASPERITY_INLINE void join(std::uint32_t one, std::uint32_t other, const MeetingVisit& visit) const {
    const BoxesOf8& boxes = leaves_[one];
    for (std::size_t i = 0; i < 8; ++i) {
      const std::uint32_t face = bvh_.leaves_[one].face[i];
      if (face == no_index) continue;
      const FloatBox box{{boxes.lower[0][i], boxes.lower[1][i], boxes.lower[2][i]},
                         {boxes.upper[0][i], boxes.upper[1][i], boxes.upper[2][i]}};
      std::int32_t met[8];
      if (!meeting(leaves_[other], box, met)) continue;
      for (std::size_t j = one == other ? i + 1 : 0; j < 8; ++j) {
        if (met[j] != 0) visit(face, bvh_.leaves_[other].face[j]);
      }
    }
  }

  const Bvh& bvh_;
  const std::vector<BoxesOf8>& leaves_;
  const std::vector<BoxesOf8>& nodes_;
};

FaceBoxes Bvh::enclosed(std::span<const Box> boxes) const {
  // In the hierarchy's own units, grown by more than their rounding.
  const auto local = [&](const Box& box) {
    FloatBox grown;
    to_local(box.lower, grown.lower);
    to_local(box.upper, grown.upper);
    for (int axis = 0; axis < 3; ++axis) {
      grown.lower[axis] -= 1e-6F * (1.0F + std::abs(grown.lower[axis]));
      grown.upper[axis] += 1e-6F * (1.0F + std::abs(grown.upper[axis]));
    }
    return grown;
  };
  FaceBoxes all{std::vector<BoxesOf8>(leaves_.size()), std::vector<BoxesOf8>(nodes_.size())};
  for (std::size_t leaf = 0; leaf < leaves_.size(); ++leaf) {
    for (std::size_t i = 0; i < 8; ++i) {
      const std::uint32_t face = leaves_[leaf].face[i];
      all.leaves[leaf].set(i, face == no_index ? FloatBox{} : local(boxes[face]));
    }
  }
  for (std::size_t node = nodes_.size(); node-- > 0;) {
    for (std::size_t i = 0; i < 8; ++i) {
      const std::uint32_t child = nodes_[node].child[i];
      const bool empty = child == empty_child;
      all.nodes[node].set(
          i, empty ? FloatBox{} : around((child & leaf_bit) != 0 ? all.leaves[child & ~leaf_bit] : all.nodes[child]));
    }
  }
  return all;
}

void Bvh::for_each_meeting(const FaceBoxes& boxes, const MeetingVisit& visit) const {
  const Join join(*this, boxes);
#if defined(__x86_64__)
  static const bool wide = __builtin_cpu_supports("avx2");
  if (wide) return join.run_avx2(visit);
#endif
  join.run(visit);
}

FaceBoxes TriangleIndex::enclosed(std::span<const Box> boxes) const {
  FaceBoxes all;
  if (const auto* bvh = std::get_if<Bvh>(&inside_->structure)) all = bvh->enclosed(boxes);
  for (std::uint32_t face = 0; face < boxes.size(); ++face) {
    Box own;
    for (const Vec3& corner : mesh().corners(face)) own.include(corner);
    all.farther =
        std::max({all.farther, (own.lower - boxes[face].lower).maxCoeff(), (boxes[face].upper - own.upper).maxCoeff()});
  }
  return all;
}

void TriangleIndex::for_each_meeting(std::span<const Box> boxes, const MeetingVisit& visit) const {
  const FaceBoxes all = enclosed(boxes);
  if (const auto* bvh = std::get_if<Bvh>(&inside_->structure)) return bvh->for_each_meeting(all, visit);
  // The octree knows where the triangles are.
  std::vector<std::uint32_t> last_met(boxes.size(), no_index);
  for (std::uint32_t face = 0; face < boxes.size(); ++face) {
    for_each_in_box(boxes[face].grown(all.farther), [&](std::uint32_t other) {
      // A face that stands in several cells counts once.
      if (other <= face || last_met[other] == face) return;
      last_met[other] = face;
      if (boxes[face].overlaps(boxes[other])) visit(face, other);
    });
  }
}

}  // namespace asperity
