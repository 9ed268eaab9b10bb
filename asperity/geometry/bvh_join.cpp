// Which of many boxes, one a triangle, meet: the hierarchy joined with itself.

#include <algorithm>
#include <cstring>

#include "asperity/core/parallel_for.h"
#include "asperity/core/processor.h"
#include "asperity/geometry/bvh.h"
#include "asperity/geometry/triangle_index.h"

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

namespace asperity {

namespace {

#define ASPERITY_INLINE [[gnu::always_inline]] inline

// As many as make starting a thread pay.
constexpr std::size_t leaves_a_share = 256;

using Floats = float __attribute__((vector_size(32)));
using Ints = std::int32_t __attribute__((vector_size(32)));

/// The sign bits of eight numbers.
ASPERITY_INLINE unsigned bits_of(const Ints& all) {
#if defined(__x86_64__)
  __m128 half[2];
  std::memcpy(half, &all, sizeof(half));
  return static_cast<unsigned>(_mm_movemask_ps(half[0])) | static_cast<unsigned>(_mm_movemask_ps(half[1])) << 4U;
#else
  unsigned bits = 0;
  for (unsigned i = 0; i < 8; ++i) bits |= all[i] < 0 ? 1U << i : 0U;
  return bits;
#endif
}

/// Which of the eight boxes meet `box`, a bit each.
ASPERITY_INLINE unsigned meeting(const BoxesOf8& boxes, const FloatBox& box) {
  Ints all = Ints{} - 1;
  for (int axis = 0; axis < 3; ++axis) {
    Floats lower;
    Floats upper;
    std::memcpy(&lower, boxes.lower[axis], sizeof(lower));
    std::memcpy(&upper, boxes.upper[axis], sizeof(upper));
    all &= (lower <= box.upper[axis]) & (upper >= box.lower[axis]);
  }
  return bits_of(all);
}

/// Of one thread: a cache line of its own, or writing it would hold up the others.
struct alignas(64) Farthest {
  double value = 0.0;
};
double farthest_of(const std::vector<Farthest>& all) {
  double most = 0.0;
  for (const Farthest& one : all) most = std::max(most, one.value);
  return most;
}

/// How far a box reaches beyond a triangle's own (m).
double beyond(const TriangleMesh& mesh, std::uint32_t face, const Box& box) {
  Box own;
  for (const Vec3& corner : mesh.corners(face)) own.include(corner);
  return std::max((own.lower - box.lower).maxCoeff(), (box.upper - own.upper).maxCoeff());
}

/// Of eight numbers the one that `choose` prefers.
template <class Choose>
ASPERITY_INLINE float best_of(const float (&eight)[8], const Choose& choose) {
  float four[4];
  for (int i = 0; i < 4; ++i) four[i] = choose(eight[i], eight[i + 4]);
  return choose(choose(four[0], four[2]), choose(four[1], four[3]));
}

ASPERITY_INLINE FloatBox around(const BoxesOf8& boxes) {
  FloatBox all;
  for (int axis = 0; axis < 3; ++axis) {
    all.lower[axis] = best_of(boxes.lower[axis], [](float a, float b) { return b < a ? b : a; });
    all.upper[axis] = best_of(boxes.upper[axis], [](float a, float b) { return a < b ? b : a; });
  }
  return all;
}

}  // namespace

class Bvh::Join {
 public:
  Join(const Bvh& bvh, const FaceBoxes& boxes)
      : bvh_(bvh), leaves_(boxes.leaves), nodes_(boxes.nodes), corners_(boxes.leaves.size()) {
    parallel_for(corners_.size(), {.grain = leaves_a_share}, [&](std::size_t leaf) {
      for (std::size_t i = 0; i < 8; ++i) {
        const std::uint32_t face = bvh.leaves_[leaf].face[i];
        for (std::size_t k = 0; k < 3; ++k)
          corners_[leaf].vertex[k][i] = face == no_index ? no_index : bvh.mesh_->triangles()[face][k];
      }
    });
    // Each leaf is joined with those that come after it: a subtree whose leaves all come before has nothing to offer.
    last_leaf_ = UnsetVector<std::uint32_t>(nodes_.size());
    for (std::size_t node = nodes_.size(); node-- > 0;) {
      std::uint32_t last = 0;
      for (const std::uint32_t child : bvh.nodes_[node].child) {
        if (child != empty_child)
          last = std::max(last, (child & leaf_bit) != 0 ? child & ~leaf_bit : last_leaf_[child]);
      }
      last_leaf_[node] = last;
    }
  }

  ASPERITY_INLINE void run(std::uint32_t leaf, const MeetingVisit& visit) const {
    const FloatBox whole = around(leaves_[leaf]);
    std::uint32_t stack[stack_capacity];
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
      const std::uint32_t node = stack[--top];
      for (unsigned met = meeting(nodes_[node], whole); met != 0; met &= met - 1) {
        const auto i = static_cast<std::size_t>(__builtin_ctz(met));
        const std::uint32_t child = bvh_.nodes_[node].child[i];
        if ((child & leaf_bit) == 0) {
          if (last_leaf_[child] >= leaf) stack[top++] = child;
        } else if ((child & ~leaf_bit) >= leaf) {
          join(leaf, child & ~leaf_bit, slot(nodes_[node], i), visit);
        }
      }
    }
  }
#if defined(__x86_64__)
  __attribute__((target("avx2"))) void run_avx2(std::uint32_t leaf, const MeetingVisit& visit) const {
    run(leaf, visit);
  }
#endif

 private:
  ASPERITY_INLINE static FloatBox slot(const BoxesOf8& boxes, std::size_t i) {
    return {{boxes.lower[0][i], boxes.lower[1][i], boxes.lower[2][i]},
            {boxes.upper[0][i], boxes.upper[1][i], boxes.upper[2][i]}};
  }

  /// `whole`: around all boxes of the other leaf.
  ASPERITY_INLINE void join(std::uint32_t one, std::uint32_t other, const FloatBox& whole,
                            const MeetingVisit& visit) const {
    for (unsigned in_reach = meeting(leaves_[one], whole); in_reach != 0; in_reach &= in_reach - 1) {
      const auto i = static_cast<unsigned>(__builtin_ctz(in_reach));
      // Within one leaf, with those that come after.
      unsigned met = meeting(leaves_[other], slot(leaves_[one], i)) & (one == other ? ~1U << i : ~0U);
      if (met == 0) continue;
      met &= ~neighbours(corners_[other], corners_[one], i);
      if (met == 0) continue;
      // All eight are written, each over the last that was not wanted: how many are is anyone's guess.
      std::uint32_t others[8];
      std::size_t count = 0;
      for (std::size_t j = 0; j < 8; ++j) {
        others[count] = bvh_.leaves_[other].face[j];
        count += met >> j & 1U;
      }
      visit(bvh_.leaves_[one].face[i], {others, count});
    }
  }

  struct CornersOf8 {
    alignas(32) std::uint32_t vertex[3][8];
  };
  /// Which of eight triangles have a vertex in common with the i-th of others, a bit each.
  ASPERITY_INLINE static unsigned neighbours(const CornersOf8& corners, const CornersOf8& others, std::size_t i) {
    Ints all{};
    for (int k = 0; k < 3; ++k) {
      Ints vertices;
      std::memcpy(&vertices, corners.vertex[k], sizeof(vertices));
      for (int j = 0; j < 3; ++j) all |= vertices == static_cast<std::int32_t>(others.vertex[j][i]);
    }
    return bits_of(all);
  }

  const Bvh& bvh_;
  const UnsetVector<BoxesOf8>& leaves_;
  const UnsetVector<BoxesOf8>& nodes_;
  UnsetVector<CornersOf8> corners_;
  UnsetVector<std::uint32_t> last_leaf_;  ///< below each node
};

FaceBoxes Bvh::enclosed(const BoxesOver& over, std::size_t grain) const {
  // In the hierarchy's own units, grown by more than their rounding.
  const auto set = [&](BoxesOf8& to, const Box(&boxes)[8], std::size_t count) {
    using Eight = double __attribute__((vector_size(64)));
    const auto grown = [&](float(&out)[8], float sign, int axis, const auto& of) {
      const Eight at{of(boxes[0])[axis], of(boxes[1])[axis], of(boxes[2])[axis], of(boxes[3])[axis],
                     of(boxes[4])[axis], of(boxes[5])[axis], of(boxes[6])[axis], of(boxes[7])[axis]};
      const Floats x = __builtin_convertvector((at - origin_[axis]) * per_scale_, Floats);
      const Floats size = x < 0.0F ? -x : x;
      const Floats all = x + sign * (1e-6F * (1.0F + size));
      std::memcpy(out, &all, sizeof(out));
    };
    for (int axis = 0; axis < 3; ++axis) {
      grown(to.lower[axis], -1.0F, axis, [](const Box& box) -> const Vec3& { return box.lower; });
      grown(to.upper[axis], 1.0F, axis, [](const Box& box) -> const Vec3& { return box.upper; });
    }
    for (std::size_t i = count; i < 8; ++i) to.set(i, FloatBox{});
  };
  FaceBoxes all{UnsetVector<BoxesOf8>(leaves_.size()), UnsetVector<BoxesOf8>(nodes_.size()), {}};
  UnsetVector<FloatBox> whole(leaves_.size());
  const ParallelSettings shares{.grain = std::max<std::size_t>(1, grain / 8)};
  parallel_for(leaves_.size(), shares, [&](std::size_t leaf) {
    const auto used = [&](std::size_t of) {
      const std::uint32_t(&faces)[8] = leaves_[std::min(of, leaves_.size() - 1)].face;
      return std::span(faces, static_cast<std::size_t>(std::find(faces, faces + 8, no_index) - faces));
    };
    const std::span<const std::uint32_t> faces = used(leaf);
    Box boxes[8];
    over(faces, used(leaf + 2), {boxes, faces.size()});
    set(all.leaves[leaf], boxes, faces.size());
    whole[leaf] = around(all.leaves[leaf]);
  });
  UnsetVector<FloatBox> below(nodes_.size());
  for (std::size_t node = nodes_.size(); node-- > 0;) {
    for (std::size_t i = 0; i < 8; ++i) {
      const std::uint32_t child = nodes_[node].child[i];
      const bool empty = child == empty_child;
      all.nodes[node].set(i, empty ? FloatBox{} : (child & leaf_bit) != 0 ? whole[child & ~leaf_bit] : below[child]);
    }
    below[node] = around(all.nodes[node]);
  }
  return all;
}

void Bvh::for_each_meeting(const FaceBoxes& boxes, const MeetingVisit& visit) const {
  const Join join(*this, boxes);
  const auto leaves = boxes.leaves.size();
#if defined(__x86_64__)
  if (has_avx2()) {
    parallel_for(leaves, {.grain = leaves_a_share},
                 [&](std::size_t leaf) { join.run_avx2(static_cast<std::uint32_t>(leaf), visit); });
    return;
  }
#endif
  parallel_for(leaves, {.grain = leaves_a_share},
               [&](std::size_t leaf) { join.run(static_cast<std::uint32_t>(leaf), visit); });
}

FaceBoxes TriangleIndex::enclosed(const BoxesOver& over, std::size_t grain) const {
  if (const auto* bvh = std::get_if<Bvh>(&inside_->structure)) return bvh->enclosed(over, grain);
  const std::size_t count = mesh().triangles().size();
  const ParallelSettings shares{.grain = grain};
  std::vector<Farthest> farther(parallel_workers(count, shares));
  FaceBoxes all;
  all.faces = UnsetVector<Box>(count);
  parallel_for(count, shares, [&](std::size_t i, unsigned worker) {
    const auto face = static_cast<std::uint32_t>(i);
    over({&face, 1}, {}, {&all.faces[i], 1});
    farther[worker].value = std::max(farther[worker].value, beyond(mesh(), face, all.faces[i]));
  });
  all.farther = farthest_of(farther);
  return all;
}

void TriangleIndex::for_each_meeting(const FaceBoxes& boxes, const MeetingVisit& visit) const {
  if (const auto* bvh = std::get_if<Bvh>(&inside_->structure)) return bvh->for_each_meeting(boxes, visit);
  // The octree knows where the triangles are.
  std::vector<std::uint32_t> last_met(boxes.faces.size(), no_index);
  for (std::uint32_t face = 0; face < boxes.faces.size(); ++face) {
    for_each_in_box(boxes.faces[face].grown(boxes.farther), [&](std::uint32_t other) {
      // A face that stands in several cells counts once.
      if (other <= face || last_met[other] == face) return;
      last_met[other] = face;
      if (share_vertex(mesh().triangles()[face], mesh().triangles()[other])) return;
      if (boxes.faces[face].overlaps(boxes.faces[other])) visit(face, {&other, 1});
    });
  }
}

}  // namespace asperity
