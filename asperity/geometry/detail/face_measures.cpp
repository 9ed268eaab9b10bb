#include "asperity/geometry/detail/face_measures.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asperity/core/processor.h"

#if defined(__x86_64__)
#include <emmintrin.h>
#endif

namespace asperity {

namespace {

// Four doubles side by side. Without fused multiply-add, so that every processor rounds alike.
using Lanes = double __attribute__((vector_size(32)));
constexpr std::size_t lane_count = 4;

using Triangle = std::array<std::uint32_t, 3>;

#define ASPERITY_INLINE [[gnu::always_inline]] inline

ASPERITY_INLINE void square_root(const Lanes& x, Lanes& root) {
#if defined(__x86_64__)
  const __m128d low = _mm_sqrt_pd(__m128d{x[0], x[1]});
  const __m128d high = _mm_sqrt_pd(__m128d{x[2], x[3]});
  root = Lanes{low[0], low[1], high[0], high[1]};
#else
  for (std::size_t i = 0; i < lane_count; ++i) root[i] = std::sqrt(x[i]);
#endif
}

ASPERITY_INLINE void keep_larger(Lanes& most, const Lanes& x) {
  most = x > most ? x : most;
}
ASPERITY_INLINE void keep_smaller(Lanes& least, const Lanes& x) {
  least = x < least ? x : least;
}

/// atan2(y, x) for y >= 0, to 1e-13 of itself: one division, then a polynomial up to tan(pi/8).
ASPERITY_INLINE void angle_of(const Lanes& y, const Lanes& x, Lanes& angle) {
  const Lanes zero{};
  const Lanes across = x < zero ? -x : x;
  const Lanes small = y < across ? y : across;
  const Lanes large = y < across ? across : y;
  const Lanes one = zero + 1.0;
  const Lanes folded = small > large * 0.41421356237309503 ? one : zero;
  const Lanes r = (small - folded * large) / (large + folded * small);
  const Lanes z = r * r;
  Lanes sum = z * 0.03065866630240884 - 0.058742621945218634;
  sum = sum * z + 0.07563640028050404;
  sum = sum * z - 0.09078383481487198;
  sum = sum * z + 0.11110384405903147;
  sum = sum * z - 0.14285690398092427;
  sum = sum * z + 0.19999999604387272;
  sum = sum * z - 0.3333333333079971;
  sum = sum * z + 0.9999999999999731;
  const Lanes sharp = r * sum + folded * (0.25 * std::numbers::pi);
  const Lanes first = y < across ? sharp : 0.5 * std::numbers::pi - sharp;
  angle = x < zero ? std::numbers::pi - first : first;
}

struct Totals {
  Lanes area{};
  Lanes volume{};
  Lanes aspect{};
  Lanes edges{};
  Lanes shortest = Lanes{} + infinity;
  Lanes longest{};
  Lanes sound = Lanes{} + 1.0;  ///< 0 once a triangle may have lost its area
};

struct FourFaces {
  Lanes normal[3];
  Lanes angle[3];
};

ASPERITY_INLINE void gather(const Vec3* positions, const Triangle* const* faces, std::size_t corner, Lanes (&out)[3]) {
  const Vec3& a = positions[(*faces[0])[corner]];
  const Vec3& b = positions[(*faces[1])[corner]];
  const Vec3& c = positions[(*faces[2])[corner]];
  const Vec3& d = positions[(*faces[3])[corner]];
  for (int axis = 0; axis < 3; ++axis) out[axis] = Lanes{a[axis], b[axis], c[axis], d[axis]};
}

/// `live`: 1 for a lane that counts, 0 for one that repeats another.
ASPERITY_INLINE void measure_four(const Vec3* positions, const Triangle* const* faces, const Vec3& centre,
                                  const Lanes& live, FourFaces& out, Totals& totals) {
  Lanes a[3];
  Lanes ab[3];
  Lanes ac[3];
  gather(positions, faces, 0, a);
  gather(positions, faces, 1, ab);
  gather(positions, faces, 2, ac);
  Lanes bc[3];
  for (int axis = 0; axis < 3; ++axis) {
    bc[axis] = ac[axis] - ab[axis];
    ab[axis] = ab[axis] - a[axis];
    ac[axis] = ac[axis] - a[axis];
  }
  const Lanes cross[3] = {ab[1] * ac[2] - ab[2] * ac[1], ab[2] * ac[0] - ab[0] * ac[2], ab[0] * ac[1] - ab[1] * ac[0]};
  const Lanes cross_squared = cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2];
  Lanes doubled_area;
  square_root(cross_squared, doubled_area);
  const Lanes zero{};
  const Lanes per_area = 1.0 / doubled_area;
  for (int axis = 0; axis < 3; ++axis) out.normal[axis] = cross[axis] * per_area;

  const Lanes ab_squared = ab[0] * ab[0] + ab[1] * ab[1] + ab[2] * ab[2];
  const Lanes ac_squared = ac[0] * ac[0] + ac[1] * ac[1] + ac[2] * ac[2];
  const Lanes bc_squared = bc[0] * bc[0] + bc[1] * bc[1] + bc[2] * bc[2];
  const Lanes along = ab[0] * ac[0] + ab[1] * ac[1] + ab[2] * ac[2];
  angle_of(doubled_area, along, out.angle[0]);
  angle_of(doubled_area, -(ab[0] * bc[0] + ab[1] * bc[1] + ab[2] * bc[2]), out.angle[1]);
  const Lanes rest = std::numbers::pi - out.angle[0] - out.angle[1];
  out.angle[2] = rest < zero ? zero : rest;

  Lanes longest = ab_squared;
  keep_larger(longest, ac_squared);
  keep_larger(longest, bc_squared);
  Lanes shortest = ab_squared;
  keep_smaller(shortest, ac_squared);
  keep_smaller(shortest, bc_squared);
  keep_larger(totals.longest, longest);
  keep_smaller(totals.shortest, shortest);
  Lanes length_ab;
  Lanes length_ac;
  Lanes length_bc;
  square_root(ab_squared, length_ab);
  square_root(ac_squared, length_ac);
  square_root(bc_squared, length_bc);
  totals.edges += live * (length_ab + length_ac + length_bc);
  totals.area += live * (0.5 * doubled_area);
  totals.volume +=
      live * ((cross[0] * (a[0] - centre[0]) + cross[1] * (a[1] - centre[1]) + cross[2] * (a[2] - centre[2])) / 6.0);
  keep_larger(totals.aspect, longest * per_area);
  // With room above what a mesh accepts: who is suspect is looked at again by itself.
  const Lanes areal = doubled_area > 2.1e-12 * longest ? zero + 1.0 : zero;
  keep_smaller(totals.sound, longest > 1.1e-120 ? areal : zero);
}

ASPERITY_INLINE void normalize_all(const NormalSums& sums, std::vector<Vec3f>& normals) {
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const double squared = sums[i].squaredNorm();
    // Triangles that face each other can cancel.
    const double per = squared > 1e-18 ? 1.0 / std::sqrt(squared) : 0.0;
    normals[i] = (per * sums[i]).cast<float>();
  }
}

ASPERITY_INLINE void measure_all(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                                 const Vec3& centre, NormalSums& sums, std::vector<Vec3f>& normals, Totals& totals) {
  for (std::size_t first = 0; first < triangles.size(); first += lane_count) {
    const std::size_t count = std::min(lane_count, triangles.size() - first);
    const Triangle* faces[lane_count];
    Lanes live;
    for (std::size_t i = 0; i < lane_count; ++i) {
      faces[i] = &triangles[first + std::min(i, count - 1)];
      live[i] = i < count ? 1.0 : 0.0;
    }
    FourFaces four;
    measure_four(positions.data(), faces, centre, live, four, totals);
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 normal(four.normal[0][i], four.normal[1][i], four.normal[2][i]);
      for (std::size_t k = 0; k < 3; ++k) sums[(*faces[i])[k]] += four.angle[k][i] * normal;
    }
  }
  normalize_all(sums, normals);
}

ASPERITY_INLINE void shape_all(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                               std::span<FaceCorners> corners) {
  for (std::size_t first = 0; first < triangles.size(); first += lane_count) {
    const std::size_t count = std::min(lane_count, triangles.size() - first);
    const Triangle* faces[lane_count];
    for (std::size_t i = 0; i < lane_count; ++i) faces[i] = &triangles[first + std::min(i, count - 1)];
    FourFaces four;
    Totals unused;
    measure_four(positions.data(), faces, Vec3::Zero(), Lanes{}, four, unused);
    for (std::size_t i = 0; i < count; ++i) {
      corners[first + i] = {Vec3(four.normal[0][i], four.normal[1][i], four.normal[2][i]),
                            {four.angle[0][i], four.angle[1][i], four.angle[2][i]}};
    }
  }
}

void shape_plain(std::span<const Vec3> positions, std::span<const Triangle> triangles, std::span<FaceCorners> corners) {
  shape_all(positions, triangles, corners);
}
#if defined(__x86_64__)
__attribute__((target("avx2"))) void shape_avx2(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                                                std::span<FaceCorners> corners) {
  shape_all(positions, triangles, corners);
}
#endif

void measure_plain(std::span<const Vec3> positions, std::span<const Triangle> triangles, const Vec3& centre,
                   NormalSums& sums, std::vector<Vec3f>& normals, Totals& totals) {
  measure_all(positions, triangles, centre, sums, normals, totals);
}
#if defined(__x86_64__)
__attribute__((target("avx2"))) void measure_avx2(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                                                  const Vec3& centre, NormalSums& sums, std::vector<Vec3f>& normals,
                                                  Totals& totals) {
  measure_all(positions, triangles, centre, sums, normals, totals);
}
#endif

double sum_of(const Lanes& x) {
  return (x[0] + x[1]) + (x[2] + x[3]);
}
double most_of(const Lanes& x) {
  return std::max({x[0], x[1], x[2], x[3]});
}
double least_of(const Lanes& x) {
  return std::min({x[0], x[1], x[2], x[3]});
}

}  // namespace

void measure_corners(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                     std::span<FaceCorners> corners) {
#if defined(__x86_64__)
  const auto shape = has_avx2() ? shape_avx2 : shape_plain;
#else
  const auto shape = shape_plain;
#endif
  shape(positions, triangles, corners);
}

FaceMeasures measure_faces(std::span<const Vec3> positions, std::span<const Triangle> triangles, const Vec3& centre,
                           NormalSums& sums, std::vector<Vec3f>& normals) {
  sums.assign(positions.size(), Vec3::Zero());
  normals.resize(positions.size());
  Totals totals;
#if defined(__x86_64__)
  const auto measure = has_avx2() ? measure_avx2 : measure_plain;
#else
  const auto measure = measure_plain;
#endif
  measure(positions, triangles, centre, sums, normals, totals);
  FaceMeasures measures;
  measures.area = sum_of(totals.area);
  measures.signed_volume = sum_of(totals.volume);
  measures.worst_aspect = most_of(totals.aspect);
  measures.edge_sum = sum_of(totals.edges);
  measures.min_edge = std::sqrt(least_of(totals.shortest));
  measures.max_edge = std::sqrt(most_of(totals.longest));
  measures.suspect = least_of(totals.sound) < 1.0;
  return measures;
}

}  // namespace asperity
