// Fitting the hierarchy to the places of its triangles, leaves first. Building ends with the same code.

#include <cmath>

#include "asperity/core/processor.h"
#include "asperity/geometry/bvh.h"

namespace asperity {

#define ASPERITY_INLINE [[gnu::always_inline]] inline

/// The work itself, for one leaf or node at a time; eight triangles, or eight boxes, side by side.
class Bvh::Fitter {
 public:
  using Floats = float __attribute__((vector_size(32)));
  using Doubles = double __attribute__((vector_size(64)));

  ASPERITY_INLINE static void keep_larger(Floats& most, const Floats& x) { most = x > most ? x : most; }
  ASPERITY_INLINE static void keep_smaller(Floats& least, const Floats& x) { least = x < least ? x : least; }
  ASPERITY_INLINE static float sum_of(const Floats& x) {
    return ((x[0] + x[4]) + (x[1] + x[5])) + ((x[2] + x[6]) + (x[3] + x[7]));
  }
  ASPERITY_INLINE static float most_of(const Floats& x) {
    const auto more = [](float a, float b) { return a < b ? b : a; };
    return more(more(more(x[0], x[4]), more(x[1], x[5])), more(more(x[2], x[6]), more(x[3], x[7])));
  }
  ASPERITY_INLINE static float least_of(const Floats& x) {
    const auto less = [](float a, float b) { return b < a ? b : a; };
    return less(less(less(x[0], x[4]), less(x[1], x[5])), less(less(x[2], x[6]), less(x[3], x[7])));
  }
  ASPERITY_INLINE static void load(const float (&from)[8], Floats& to) {
    to = Floats{from[0], from[1], from[2], from[3], from[4], from[5], from[6], from[7]};
  }
  ASPERITY_INLINE static void store(const Floats& from, float (&to)[8]) {
    for (std::size_t i = 0; i < 8; ++i) to[i] = from[i];
  }

  /// Triangles, cylinder and bounds of one leaf.
  ASPERITY_INLINE static void fit_leaf(const Bvh& bvh, const Vec3* positions, const BvhFitting::Corners& corners,
                                       Leaf& leaf, Cylinder& cylinder, FloatBox& bounds) {
    const std::size_t used = corners.used;
    const auto at = [&](std::size_t i, std::size_t corner) -> const Vec3& {
      return positions[corners.vertex[corner][i]];
    };
    Floats a[3];
    Floats e1[3];
    Floats e2[3];
    for (int axis = 0; axis < 3; ++axis) {
      Doubles one;
      Doubles two;
      Doubles three;
      for (std::size_t i = 0; i < 8; ++i) {
        one[i] = at(i, 0)[axis];
        two[i] = at(i, 1)[axis];
        three[i] = at(i, 2)[axis];
      }
      // Edges from differences in double precision: they keep their own digits wherever they lie.
      a[axis] = __builtin_convertvector((one - bvh.origin_[axis]) * bvh.per_scale_, Floats);
      e1[axis] = __builtin_convertvector((two - one) * bvh.per_scale_, Floats);
      e2[axis] = __builtin_convertvector((three - one) * bvh.per_scale_, Floats);
    }
    Floats b[3];
    Floats c[3];
    for (int axis = 0; axis < 3; ++axis) {
      b[axis] = a[axis] + e1[axis];
      c[axis] = a[axis] + e2[axis];
      Floats low = a[axis];
      Floats high = a[axis];
      keep_smaller(low, b[axis]);
      keep_smaller(low, c[axis]);
      keep_larger(high, b[axis]);
      keep_larger(high, c[axis]);
      bounds.lower[axis] = least_of(low);
      bounds.upper[axis] = most_of(high);
    }
    fit_cylinder(a, b, c, e1, e2, used, bounds, cylinder);
    for (int axis = 0; axis < 3; ++axis) {
      store(a[axis], leaf.triangles.corner[axis]);
      store(e1[axis], leaf.triangles.edge1[axis]);
      store(e2[axis], leaf.triangles.edge2[axis]);
      for (std::size_t i = used; i < 8; ++i) {
        leaf.triangles.corner[axis][i] = 1e9F;
        leaf.triangles.edge1[axis][i] = 0.0F;
        leaf.triangles.edge2[axis][i] = 0.0F;
      }
    }
  }

  /// All of a node's boxes, from leaves and nodes that have been fitted before.
  ASPERITY_INLINE static void fit_node(Bvh& bvh, const BvhFitting& fitting, Node& node) {
    for (std::size_t i = 0; i < 8; ++i) {
      FloatBox bounds;
      if (node.child[i] != empty_child) {
        if ((node.child[i] & leaf_bit) != 0) {
          bounds = fitting.bounds[node.child[i] & ~leaf_bit];
        } else {
          around(bvh.nodes_[node.child[i]], bounds);
        }
      }
      node.boxes.set(i, bounds);
    }
  }

  ASPERITY_INLINE static void around(const Node& node, FloatBox& bounds) {
    for (int axis = 0; axis < 3; ++axis) {
      Floats x;
      load(node.boxes.lower[axis], x);
      bounds.lower[axis] = least_of(x);
      load(node.boxes.upper[axis], x);
      bounds.upper[axis] = most_of(x);
    }
  }

  /// Half the surface of all boxes of a node.
  ASPERITY_INLINE static float half_surface(const Node& node) {
    Floats size[3];
    for (int axis = 0; axis < 3; ++axis) {
      Floats lower;
      load(node.boxes.lower[axis], lower);
      load(node.boxes.upper[axis], size[axis]);
      size[axis] -= lower;
      // Places without a child are turned inside out.
      size[axis] = size[axis] > 0.0F ? size[axis] : Floats{};
    }
    return sum_of(size[0] * size[1] + size[1] * size[2] + size[2] * size[0]);
  }

  ASPERITY_INLINE static void fit_all(Bvh& bvh, BvhFitting& fitting) {
    const Vec3* positions = bvh.mesh_->positions().data();
    for (std::size_t i = 0; i < bvh.leaves_.size(); ++i) {
      // Vertices lie about in memory: those of a later leaf are asked for early.
      constexpr std::size_t ahead = 4;
      if (i + ahead < bvh.leaves_.size()) {
        for (const std::uint32_t vertex : fitting.leaves[i + ahead].vertex[0]) __builtin_prefetch(positions + vertex);
        for (const std::uint32_t vertex : fitting.leaves[i + ahead].vertex[2]) __builtin_prefetch(positions + vertex);
      }
      fit_leaf(bvh, positions, fitting.leaves[i], bvh.leaves_[i], bvh.cylinders_[i], fitting.bounds[i]);
    }
    double surface = 0.0;
    for (std::size_t i = bvh.nodes_.size(); i-- > 0;) {
      fit_node(bvh, fitting, bvh.nodes_[i]);
      surface += static_cast<double>(half_surface(bvh.nodes_[i]));
    }
    FloatBox root;
    around(bvh.nodes_.front(), root);
    const auto whole = static_cast<double>(root.area());
    bvh.cost_ = whole > 0.0 ? 1.0 + surface / whole : 1.0;
  }

 private:
  /// The cylinder around a leaf: its axis is the mean normal, by area. Measured by the sums that searches form.
  ASPERITY_INLINE static void fit_cylinder(const Floats (&a)[3], const Floats (&b)[3], const Floats (&c)[3],
                                           const Floats (&e1)[3], const Floats (&e2)[3], std::size_t used,
                                           const FloatBox& bounds, Cylinder& cylinder) {
    Floats counts;
    for (std::size_t i = 0; i < 8; ++i) counts[i] = i < used ? 1.0F : 0.0F;
    const Vec3 normal(static_cast<double>(sum_of(counts * (e1[1] * e2[2] - e1[2] * e2[1]))),
                      static_cast<double>(sum_of(counts * (e1[2] * e2[0] - e1[0] * e2[2]))),
                      static_cast<double>(sum_of(counts * (e1[0] * e2[1] - e1[1] * e2[0]))));
    const double length = normal.norm();
    const Vec3 axis = length > 0.0 ? Vec3(normal / length) : Vec3(Vec3::UnitZ());
    for (int k = 0; k < 3; ++k) {
      cylinder.axis[k] = static_cast<float>(axis[k]);
      cylinder.centre[k] = 0.5F * (bounds.lower[k] + bounds.upper[k]);
    }
    Floats height{};
    Floats across{};
    reach_of(a, cylinder, height, across);
    reach_of(b, cylinder, height, across);
    reach_of(c, cylinder, height, across);
    // Room for rounding: corners and sums are off by less than half of it.
    cylinder.radius = std::sqrt(most_of(across)) * 1.00001F + 1e-6F;
    cylinder.half_height = std::sqrt(most_of(height)) * 1.00001F + 1e-6F;
  }

  ASPERITY_INLINE static void reach_of(const Floats (&corner)[3], const Cylinder& cylinder, Floats& height,
                                       Floats& across) {
    const Floats x = corner[0] - cylinder.centre[0];
    const Floats y = corner[1] - cylinder.centre[1];
    const Floats z = corner[2] - cylinder.centre[2];
    const Floats along = x * cylinder.axis[0] + y * cylinder.axis[1] + z * cylinder.axis[2];
    const Floats away_x = x - along * cylinder.axis[0];
    const Floats away_y = y - along * cylinder.axis[1];
    const Floats away_z = z - along * cylinder.axis[2];
    keep_larger(height, along * along);
    keep_larger(across, away_x * away_x + away_y * away_y + away_z * away_z);
  }
};

#if defined(__x86_64__)
__attribute__((target("avx2"))) void Bvh::fit_avx2(BvhFitting& fitting) noexcept {
  Fitter::fit_all(*this, fitting);
}
#endif

void Bvh::refit(const TriangleMesh& mesh, BvhFitting& fitting) noexcept {
  frame(mesh);
  if (nodes_.empty()) return;
#if defined(__x86_64__)
  if (has_avx2()) return fit_avx2(fitting);
#endif
  Fitter::fit_all(*this, fitting);
}

BvhFitting Bvh::fitting() const {
  BvhFitting fitting;
  fitting.bounds.resize(leaves_.size());
  fitting.leaves.resize(leaves_.size());
  for (std::size_t leaf = 0; leaf < leaves_.size(); ++leaf) {
    BvhFitting::Corners& corners = fitting.leaves[leaf];
    corners.used = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      const bool used = leaves_[leaf].face[i] != no_index;
      corners.used += used ? 1U : 0U;
      const TriangleMesh::Triangle& triangle = mesh_->triangles()[leaves_[leaf].face[used ? i : 0]];
      for (std::size_t k = 0; k < 3; ++k) corners.vertex[k][i] = triangle[k];
    }
  }
  return fitting;
}

}  // namespace asperity
