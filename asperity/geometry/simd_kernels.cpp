#include "asperity/geometry/simd_kernels.h"

#include <algorithm>
#include <cmath>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace asperity {
namespace {

// A tiny term keeps the division defined for an edge of zero length.
constexpr float tiny = 1e-30F;

unsigned plain_boxes(const BoxesOf8& boxes, const float point[3], float bound, float squared[8]) noexcept {
  unsigned mask = 0;
  for (unsigned i = 0; i < 8; ++i) {
    float sum = 0.0F;
    for (int axis = 0; axis < 3; ++axis) {
      const float outside = std::max({boxes.lower[axis][i] - point[axis], point[axis] - boxes.upper[axis][i], 0.0F});
      sum += outside * outside;
    }
    squared[i] = sum;
    mask |= static_cast<unsigned>(sum <= bound) << i;
  }
  return mask;
}

unsigned plain_cylinders(const CylindersOf8& cylinders, const float point[3], float bound) noexcept {
  unsigned mask = 0;
  for (unsigned i = 0; i < 8; ++i) {
    const float x = point[0] - cylinders.centre[0][i];
    const float y = point[1] - cylinders.centre[1][i];
    const float z = point[2] - cylinders.centre[2][i];
    const float along = x * cylinders.axis[0][i] + y * cylinders.axis[1][i] + z * cylinders.axis[2][i];
    const float across_x = x - along * cylinders.axis[0][i];
    const float across_y = y - along * cylinders.axis[1][i];
    const float across_z = z - along * cylinders.axis[2][i];
    const float across = std::sqrt(across_x * across_x + across_y * across_y + across_z * across_z);
    const float beyond = std::max(0.0F, across - cylinders.radius[i]);
    const float above = std::max(0.0F, std::abs(along) - cylinders.half_height[i]);
    mask |= static_cast<unsigned>(beyond * beyond + above * above <= bound * bound) << i;
  }
  return mask;
}

unsigned plain_ray(const BoxesOf8& boxes, const float origin[3], const float inverse_direction[3], float t_end,
                   float margin, float entry[8]) noexcept {
  unsigned mask = 0;
  for (unsigned i = 0; i < 8; ++i) {
    float enter = 0.0F;
    float leave = t_end;
    for (int axis = 0; axis < 3; ++axis) {
      const float a = (boxes.lower[axis][i] - margin - origin[axis]) * inverse_direction[axis];
      const float b = (boxes.upper[axis][i] + margin - origin[axis]) * inverse_direction[axis];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    entry[i] = enter;
    mask |= static_cast<unsigned>(enter <= leave && boxes.lower[0][i] <= boxes.upper[0][i]) << i;
  }
  return mask;
}

unsigned plain_meeting(const BoxesOf8& boxes, const FloatBox& box) noexcept {
  unsigned mask = 0;
  for (unsigned i = 0; i < 8; ++i) {
    bool meet = true;
    for (int axis = 0; axis < 3; ++axis)
      meet = meet && boxes.lower[axis][i] <= box.upper[axis] && boxes.upper[axis][i] >= box.lower[axis];
    mask |= static_cast<unsigned>(meet) << i;
  }
  return mask;
}

unsigned plain_within(const TrianglesOf8& triangles, const PlanesAround& planes) noexcept {
  unsigned mask = 0;
  for (unsigned i = 0; i < 8; ++i) {
    bool beyond = false;
    for (int k = 0; k < PlanesAround::count; ++k) {
      const auto along = [&](const float(&v)[3][8]) {
        return v[0][i] * planes.normal[k][0] + v[1][i] * planes.normal[k][1] + v[2][i] * planes.normal[k][2];
      };
      const float least = along(triangles.corner) + std::min({0.0F, along(triangles.edge1), along(triangles.edge2)});
      beyond = beyond || least > planes.limit[k];
    }
    mask |= static_cast<unsigned>(!beyond) << i;
  }
  return mask;
}

struct Candidate {
  float x, y, z, squared;
};

Candidate edge_candidate(float px, float py, float pz, float ex, float ey, float ez) noexcept {
  const float along = px * ex + py * ey + pz * ez;
  const float t = std::clamp(along / (ex * ex + ey * ey + ez * ez + tiny), 0.0F, 1.0F);
  const float x = px - t * ex;
  const float y = py - t * ey;
  const float z = pz - t * ez;
  return {x, y, z, x * x + y * y + z * z};
}

// Distance to the three edges always; distance to the plane where the foot falls inside all three.
void plain_triangles(const TrianglesOf8& triangles, const float point[3], DistancesOf8& out) noexcept {
  for (int i = 0; i < 8; ++i) {
    const float px = point[0] - triangles.corner[0][i];
    const float py = point[1] - triangles.corner[1][i];
    const float pz = point[2] - triangles.corner[2][i];
    const float ax = triangles.edge1[0][i];
    const float ay = triangles.edge1[1][i];
    const float az = triangles.edge1[2][i];
    const float bx = triangles.edge2[0][i];
    const float by = triangles.edge2[1][i];
    const float bz = triangles.edge2[2][i];
    Candidate best = edge_candidate(px, py, pz, ax, ay, az);
    const Candidate second = edge_candidate(px, py, pz, bx, by, bz);
    if (second.squared < best.squared) best = second;
    const Candidate third = edge_candidate(px - ax, py - ay, pz - az, bx - ax, by - ay, bz - az);
    if (third.squared < best.squared) best = third;
    const float nx = ay * bz - az * by;
    const float ny = az * bx - ax * bz;
    const float nz = ax * by - ay * bx;
    const float nn = nx * nx + ny * ny + nz * nz;
    // Barycentric coordinates times nn: (p x b) . n and (a x p) . n.
    const float v = (py * bz - pz * by) * nx + (pz * bx - px * bz) * ny + (px * by - py * bx) * nz;
    const float w = (ay * pz - az * py) * nx + (az * px - ax * pz) * ny + (ax * py - ay * px) * nz;
    if (v >= 0.0F && w >= 0.0F && v + w <= nn && nn > 0.0F) {
      const float height = (px * nx + py * ny + pz * nz) / nn;
      const float x = height * nx;
      const float y = height * ny;
      const float z = height * nz;
      const float squared = x * x + y * y + z * z;
      if (squared < best.squared) best = {x, y, z, squared};
    }
    out.offset[0][i] = best.x;
    out.offset[1][i] = best.y;
    out.offset[2][i] = best.z;
    out.distance[i] = std::sqrt(best.squared);
  }
}

#if defined(__x86_64__)
#define ASPERITY_AVX2 __attribute__((target("avx2,fma")))

ASPERITY_AVX2 unsigned avx2_boxes(const BoxesOf8& boxes, const float point[3], float bound, float squared[8]) noexcept {
  __m256 sum = _mm256_setzero_ps();
  for (int axis = 0; axis < 3; ++axis) {
    const __m256 p = _mm256_set1_ps(point[axis]);
    const __m256 below = _mm256_sub_ps(_mm256_load_ps(boxes.lower[axis]), p);
    const __m256 above = _mm256_sub_ps(p, _mm256_load_ps(boxes.upper[axis]));
    const __m256 outside = _mm256_max_ps(_mm256_max_ps(below, above), _mm256_setzero_ps());
    sum = _mm256_fmadd_ps(outside, outside, sum);
  }
  _mm256_storeu_ps(squared, sum);
  return static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(sum, _mm256_set1_ps(bound), _CMP_LE_OQ)));
}

ASPERITY_AVX2 unsigned avx2_ray(const BoxesOf8& boxes, const float origin[3], const float inverse_direction[3],
                                float t_end, float margin, float entry[8]) noexcept {
  __m256 enter = _mm256_setzero_ps();
  __m256 leave = _mm256_set1_ps(t_end);
  const __m256 grow = _mm256_set1_ps(margin);
  for (int axis = 0; axis < 3; ++axis) {
    const __m256 o = _mm256_set1_ps(origin[axis]);
    const __m256 inverse = _mm256_set1_ps(inverse_direction[axis]);
    const __m256 lower = _mm256_sub_ps(_mm256_load_ps(boxes.lower[axis]), grow);
    const __m256 upper = _mm256_add_ps(_mm256_load_ps(boxes.upper[axis]), grow);
    const __m256 a = _mm256_mul_ps(_mm256_sub_ps(lower, o), inverse);
    const __m256 b = _mm256_mul_ps(_mm256_sub_ps(upper, o), inverse);
    enter = _mm256_max_ps(enter, _mm256_min_ps(a, b));
    leave = _mm256_min_ps(leave, _mm256_max_ps(a, b));
  }
  _mm256_storeu_ps(entry, enter);
  const __m256 used = _mm256_cmp_ps(_mm256_load_ps(boxes.lower[0]), _mm256_load_ps(boxes.upper[0]), _CMP_LE_OQ);
  const __m256 met = _mm256_and_ps(_mm256_cmp_ps(enter, leave, _CMP_LE_OQ), used);
  return static_cast<unsigned>(_mm256_movemask_ps(met));
}

ASPERITY_AVX2 unsigned avx2_meeting(const BoxesOf8& boxes, const FloatBox& box) noexcept {
  __m256 meet = _mm256_castsi256_ps(_mm256_set1_epi32(-1));
  for (int axis = 0; axis < 3; ++axis) {
    const __m256 below = _mm256_cmp_ps(_mm256_load_ps(boxes.lower[axis]), _mm256_set1_ps(box.upper[axis]), _CMP_LE_OQ);
    const __m256 above = _mm256_cmp_ps(_mm256_load_ps(boxes.upper[axis]), _mm256_set1_ps(box.lower[axis]), _CMP_GE_OQ);
    meet = _mm256_and_ps(meet, _mm256_and_ps(below, above));
  }
  return static_cast<unsigned>(_mm256_movemask_ps(meet));
}

struct Vector8 {
  __m256 x, y, z;
};

ASPERITY_AVX2 inline Vector8 load8(const float v[3][8]) noexcept {
  return {_mm256_load_ps(v[0]), _mm256_load_ps(v[1]), _mm256_load_ps(v[2])};
}
ASPERITY_AVX2 inline Vector8 sub8(const Vector8& a, const Vector8& b) noexcept {
  return {_mm256_sub_ps(a.x, b.x), _mm256_sub_ps(a.y, b.y), _mm256_sub_ps(a.z, b.z)};
}
ASPERITY_AVX2 inline __m256 dot8(const Vector8& a, const Vector8& b) noexcept {
  return _mm256_fmadd_ps(a.x, b.x, _mm256_fmadd_ps(a.y, b.y, _mm256_mul_ps(a.z, b.z)));
}
ASPERITY_AVX2 inline Vector8 cross8(const Vector8& a, const Vector8& b) noexcept {
  return {_mm256_fmsub_ps(a.y, b.z, _mm256_mul_ps(a.z, b.y)), _mm256_fmsub_ps(a.z, b.x, _mm256_mul_ps(a.x, b.z)),
          _mm256_fmsub_ps(a.x, b.y, _mm256_mul_ps(a.y, b.x))};
}
ASPERITY_AVX2 inline Vector8 select8(const Vector8& a, const Vector8& b, __m256 take_b) noexcept {
  return {_mm256_blendv_ps(a.x, b.x, take_b), _mm256_blendv_ps(a.y, b.y, take_b), _mm256_blendv_ps(a.z, b.z, take_b)};
}
ASPERITY_AVX2 inline Vector8 from_edge8(const Vector8& p, const Vector8& e) noexcept {
  const __m256 length = _mm256_add_ps(dot8(e, e), _mm256_set1_ps(tiny));
  const __m256 t =
      _mm256_min_ps(_mm256_max_ps(_mm256_div_ps(dot8(p, e), length), _mm256_setzero_ps()), _mm256_set1_ps(1.0F));
  return {_mm256_fnmadd_ps(t, e.x, p.x), _mm256_fnmadd_ps(t, e.y, p.y), _mm256_fnmadd_ps(t, e.z, p.z)};
}

ASPERITY_AVX2 unsigned avx2_cylinders(const CylindersOf8& cylinders, const float point[3], float bound) noexcept {
  const Vector8 query{_mm256_set1_ps(point[0]), _mm256_set1_ps(point[1]), _mm256_set1_ps(point[2])};
  const Vector8 p = sub8(query, load8(cylinders.centre));
  const Vector8 axis = load8(cylinders.axis);
  const __m256 along = dot8(p, axis);
  const Vector8 across{_mm256_fnmadd_ps(along, axis.x, p.x), _mm256_fnmadd_ps(along, axis.y, p.y),
                       _mm256_fnmadd_ps(along, axis.z, p.z)};
  const __m256 zero = _mm256_setzero_ps();
  const __m256 magnitude = _mm256_andnot_ps(_mm256_set1_ps(-0.0F), along);
  const __m256 beyond =
      _mm256_max_ps(zero, _mm256_sub_ps(_mm256_sqrt_ps(dot8(across, across)), _mm256_load_ps(cylinders.radius)));
  const __m256 above = _mm256_max_ps(zero, _mm256_sub_ps(magnitude, _mm256_load_ps(cylinders.half_height)));
  const __m256 squared = _mm256_fmadd_ps(beyond, beyond, _mm256_mul_ps(above, above));
  return static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(squared, _mm256_set1_ps(bound * bound), _CMP_LE_OQ)));
}

ASPERITY_AVX2 unsigned avx2_within(const TrianglesOf8& triangles, const PlanesAround& planes) noexcept {
  const Vector8 corner = load8(triangles.corner);
  const Vector8 one = load8(triangles.edge1);
  const Vector8 other = load8(triangles.edge2);
  __m256 beyond = _mm256_setzero_ps();
  for (int k = 0; k < PlanesAround::count; ++k) {
    const float* n = planes.normal[k];
    const Vector8 normal{_mm256_set1_ps(n[0]), _mm256_set1_ps(n[1]), _mm256_set1_ps(n[2])};
    const __m256 least = _mm256_min_ps(_mm256_min_ps(dot8(one, normal), dot8(other, normal)), _mm256_setzero_ps());
    const __m256 limit = _mm256_set1_ps(planes.limit[k]);
    beyond = _mm256_or_ps(beyond, _mm256_cmp_ps(_mm256_add_ps(dot8(corner, normal), least), limit, _CMP_GT_OQ));
  }
  return ~static_cast<unsigned>(_mm256_movemask_ps(beyond)) & 0xFFU;
}

ASPERITY_AVX2 void avx2_triangles(const TrianglesOf8& triangles, const float point[3], DistancesOf8& out) noexcept {
  const Vector8 query{_mm256_set1_ps(point[0]), _mm256_set1_ps(point[1]), _mm256_set1_ps(point[2])};
  const Vector8 p = sub8(query, load8(triangles.corner));
  const Vector8 a = load8(triangles.edge1);
  const Vector8 b = load8(triangles.edge2);
  Vector8 best = from_edge8(p, a);
  __m256 squared = dot8(best, best);
  const auto offer = [&](const Vector8& other, __m256 other_squared, __m256 allowed) ASPERITY_AVX2 {
    const __m256 nearer = _mm256_and_ps(_mm256_cmp_ps(other_squared, squared, _CMP_LT_OQ), allowed);
    best = select8(best, other, nearer);
    squared = _mm256_blendv_ps(squared, other_squared, nearer);
  };
  const __m256 always = _mm256_castsi256_ps(_mm256_set1_epi32(-1));
  const Vector8 second = from_edge8(p, b);
  offer(second, dot8(second, second), always);
  const Vector8 third = from_edge8(sub8(p, a), sub8(b, a));
  offer(third, dot8(third, third), always);
  const Vector8 n = cross8(a, b);
  const __m256 nn = dot8(n, n);
  const __m256 v = dot8(cross8(p, b), n);
  const __m256 w = dot8(cross8(a, p), n);
  const __m256 zero = _mm256_setzero_ps();
  const __m256 inside = _mm256_and_ps(
      _mm256_and_ps(_mm256_cmp_ps(v, zero, _CMP_GE_OQ), _mm256_cmp_ps(w, zero, _CMP_GE_OQ)),
      _mm256_and_ps(_mm256_cmp_ps(_mm256_add_ps(v, w), nn, _CMP_LE_OQ), _mm256_cmp_ps(nn, zero, _CMP_GT_OQ)));
  const __m256 height = _mm256_div_ps(dot8(p, n), _mm256_max_ps(nn, _mm256_set1_ps(tiny)));
  const Vector8 face{_mm256_mul_ps(height, n.x), _mm256_mul_ps(height, n.y), _mm256_mul_ps(height, n.z)};
  offer(face, dot8(face, face), inside);
  _mm256_store_ps(out.offset[0], best.x);
  _mm256_store_ps(out.offset[1], best.y);
  _mm256_store_ps(out.offset[2], best.z);
  _mm256_store_ps(out.distance, _mm256_sqrt_ps(squared));
}
#endif

}  // namespace

const SearchKernels& plain_kernels() noexcept {
  static constexpr SearchKernels kernels{plain_boxes,   plain_cylinders, plain_ray,
                                         plain_meeting, plain_within,    plain_triangles};
  return kernels;
}

const SearchKernels& best_kernels() noexcept {
#if defined(__x86_64__)
  static constexpr SearchKernels avx2{avx2_boxes, avx2_cylinders, avx2_ray, avx2_meeting, avx2_within, avx2_triangles};
  static const bool supported = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (supported) return avx2;
#endif
  return plain_kernels();
}

}  // namespace asperity
