#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "asperity/core/unset_vector.h"
#include "asperity/geometry/closest_point.h"
#include "asperity/geometry/mesh.h"
#include "asperity/geometry/simd_kernels.h"
#include "asperity/geometry/triangle_patch.h"

namespace asperity {

/// How the hierarchy is searched.
struct BvhSettings {
  bool plain_kernels = false;  ///< plain C++ in place of AVX2: the oracle
};

/// Takes a triangle and those that it was paired with; called from several threads at a time.
using MeetingVisit = std::function<void(std::uint32_t, std::span<const std::uint32_t>)>;
/// Writes boxes (m) around what stands over a few triangles, one for each, and is told which are likely to come next;
/// called from several threads at a time, once for each triangle.
using BoxesOver = std::function<void(std::span<const std::uint32_t> faces, std::span<const std::uint32_t> next,
                                     std::span<Box> boxes)>;

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
  UnsetVector<BoxesOf8> leaves;
  UnsetVector<BoxesOf8> nodes;
  UnsetVector<Box> faces;  ///< without a hierarchy (m), by the triangles' numbers
  double farther = 0.0;    ///< and how far they reach beyond the triangles' own boxes at most (m)
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return (leaves.capacity() + nodes.capacity()) * sizeof(BoxesOf8) + faces.capacity() * sizeof(Box);
  }
};

/// Bounding-volume hierarchy, eight wide, binned by surface area (Wald 2007); leaves hold up to eight triangles in
/// single precision relative to the object's centre and size. Single precision only discards, with a bound on its
/// rounding; every answer is decided in double precision on the mesh's own vertices, so it equals brute force. Queries
/// are const, allocation-free and safe from any thread. The mesh must outlive the hierarchy.
class Bvh {
 public:
  /// On all cores; the answer does not depend on how many they are. [build]
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

  /// See TriangleIndex::enclosed. [build]
  [[nodiscard]] FaceBoxes enclosed(const BoxesOver& over, std::size_t grain) const;
  /// See TriangleIndex::for_each_meeting. [build]
  void for_each_meeting(const FaceBoxes& boxes, const MeetingVisit& visit) const;
  /// Calls visit(face) for each triangle in a leaf whose box meets `box`; once for each triangle. [servo]
  template <class Visit>
  void for_each_in_box(const Box& box, Visit&& visit) const;
  /// Calls visit(face) for every triangle that may come within `margin` (m) of the triangle with these corners and this
  /// unit normal: all but most of those that lie wholly above it, below it or beyond one of its edges by more. [servo]
  template <class Visit>
  void for_each_beside(const std::array<Vec3, 3>& corners, const Vec3& normal, double margin, Visit&& visit) const;
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
  /// More than a coordinate along a normal of length 1 is rounded, of anything in the hierarchy, in units of scale_.
  static constexpr double plane_rounding = 6e-6;

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
  /// A box as the kernels take it, grown by its rounding.
  [[nodiscard]] FloatBox local_box(const Box& box) const noexcept;
  /// Calls visit(leaf) for each leaf whose box meets `box`.
  template <class Visit>
  void for_each_leaf(const FloatBox& box, Visit&& visit) const;
  class Builder;
  class Fitter;
  class Join;

  /// Sets the mesh, and the origin and unit of single precision.
  void frame(const TriangleMesh& mesh) noexcept;
  void fit_avx2(BvhFitting& fitting) noexcept;
  void to_local(const Vec3& p, float local[3]) const noexcept;
  [[nodiscard]] PlanesAround planes_around(const std::array<Vec3, 3>& corners, const Vec3& normal,
                                           double margin) const noexcept;
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
  UnsetVector<Node> nodes_;  ///< each before its children
  UnsetVector<Leaf> leaves_;
  UnsetVector<Cylinder> cylinders_;  ///< one around each leaf
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

}  // namespace asperity
