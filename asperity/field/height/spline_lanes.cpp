#include "asperity/field/height/detail/spline_lanes.h"

#include <cstdint>

#include "asperity/core/processor.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace asperity {

#if defined(__x86_64__)

namespace {

// Without fused products, so that every bit is as in plain C++.
#define ASPERITY_AVX2 __attribute__((target("avx2")))
#define ASPERITY_AVX2_INLINE __attribute__((target("avx2"), always_inline)) inline

/// The texels under four coordinates: their indices, and the offsets from their middles.
struct TexelsUnder {
  __m128i index;
  __m256d offset;
};

/// False, nothing answered, where a coordinate is too large or not finite.
ASPERITY_AVX2_INLINE bool texels_under(__m256d coordinate, int count, Wrap wrap, TexelsUnder& under) {
  const __m256d size = _mm256_andnot_pd(_mm256_set1_pd(-0.0), coordinate);
  if (_mm256_movemask_pd(_mm256_cmp_pd(size, _mm256_set1_pd(0x1p31), _CMP_LT_OQ)) != 0xf) return false;
  const __m256d one = _mm256_set1_pd(1.0);
  __m256d unit;
  if (wrap == Wrap::clamp) {
    unit = _mm256_min_pd(_mm256_max_pd(coordinate, _mm256_setzero_pd()), one);
  } else {
    const __m256d whole = _mm256_round_pd(coordinate, _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC);
    const __m256d fraction = _mm256_sub_pd(coordinate, whole);
    unit = _mm256_blendv_pd(fraction, _mm256_add_pd(fraction, one), fraction);
  }
  const __m256d position = _mm256_mul_pd(unit, _mm256_set1_pd(count));
  under.index = _mm_min_epi32(_mm256_cvttpd_epi32(position), _mm_set1_epi32(count - 1));
  under.offset = _mm256_sub_pd(_mm256_sub_pd(position, _mm256_cvtepi32_pd(under.index)), _mm256_set1_pd(0.5));
  return true;
}

/// The weights of SplineWeights, of four places or four times one.
struct WideWeights {
  __m256d before;
  __m256d after;
  __m256d slope_before;
  __m256d slope_after;
};

ASPERITY_AVX2_INLINE WideWeights weights_at(__m256d offset) {
  const __m256d half = _mm256_set1_pd(0.5);
  WideWeights weights;
  weights.slope_before = _mm256_sub_pd(half, offset);
  weights.slope_after = _mm256_add_pd(half, offset);
  weights.before = _mm256_mul_pd(_mm256_mul_pd(half, weights.slope_before), weights.slope_before);
  weights.after = _mm256_mul_pd(_mm256_mul_pd(half, weights.slope_after), weights.slope_after);
  return weights;
}

/// Three numbers for each of four lanes.
struct WideThree {
  __m256d at[3];
};

ASPERITY_AVX2_INLINE __m256d value_of(const WideWeights& w, const WideThree& three) {
  const __m256d before = _mm256_mul_pd(w.before, _mm256_sub_pd(three.at[0], three.at[1]));
  const __m256d after = _mm256_mul_pd(w.after, _mm256_sub_pd(three.at[2], three.at[1]));
  return _mm256_add_pd(_mm256_add_pd(three.at[1], before), after);
}
ASPERITY_AVX2_INLINE __m256d slope_of(const WideWeights& w, const WideThree& three) {
  return _mm256_add_pd(_mm256_mul_pd(w.slope_before, _mm256_sub_pd(three.at[1], three.at[0])),
                       _mm256_mul_pd(w.slope_after, _mm256_sub_pd(three.at[2], three.at[1])));
}
ASPERITY_AVX2_INLINE __m256d bend_of(const WideThree& three) {
  return _mm256_sub_pd(_mm256_sub_pd(three.at[2], three.at[1]), _mm256_sub_pd(three.at[1], three.at[0]));
}

/// Four rows of four floats, of which three count, as three columns.
ASPERITY_AVX2_INLINE WideThree columns_of(__m128 a, __m128 b, __m128 c, __m128 d) {
  const __m128 low_ab = _mm_unpacklo_ps(a, b);
  const __m128 low_cd = _mm_unpacklo_ps(c, d);
  const __m128 high_ab = _mm_unpackhi_ps(a, b);
  const __m128 high_cd = _mm_unpackhi_ps(c, d);
  return {{_mm256_cvtps_pd(_mm_movelh_ps(low_ab, low_cd)), _mm256_cvtps_pd(_mm_movehl_ps(low_cd, low_ab)),
           _mm256_cvtps_pd(_mm_movelh_ps(high_ab, high_cd))}};
}

ASPERITY_AVX2 bool avx2_heights(const SplineTexels& texels, const Lanes& s, const Lanes& t, Lanes& heights) noexcept {
  TexelsUnder in_s;
  TexelsUnder in_t;
  if (!texels_under(_mm256_loadu_pd(s.data()), texels.width, texels.wrap, in_s) ||
      !texels_under(_mm256_loadu_pd(t.data()), texels.height, texels.wrap, in_t))
    return false;
  alignas(16) std::int32_t columns[lanes];
  alignas(16) std::int32_t rows[lanes];
  _mm_store_si128(reinterpret_cast<__m128i*>(columns), in_s.index);
  _mm_store_si128(reinterpret_cast<__m128i*>(rows), in_t.index);
  const std::ptrdiff_t stride = static_cast<std::ptrdiff_t>(texels.width) + 2;
  const float* from[lanes];
  for (std::size_t i = 0; i < lanes; ++i) from[i] = texels.values + rows[i] * stride + columns[i];
  const WideWeights along_s = weights_at(in_s.offset);
  WideThree across;
  for (int row = 0; row < 3; ++row) {
    across.at[row] = value_of(along_s, columns_of(_mm_loadu_ps(from[0]), _mm_loadu_ps(from[1]), _mm_loadu_ps(from[2]),
                                                  _mm_loadu_ps(from[3])));
    for (const float*& one : from) one += stride;
  }
  const __m256d height = value_of(weights_at(in_t.offset), across);
  _mm256_storeu_pd(heights.data(), _mm256_add_pd(_mm256_set1_pd(texels.base), height));
  return true;
}

ASPERITY_AVX2 bool avx2_curvature(const SplineTexels& texels, const Vec2& st, HeightCurvature& curvature) noexcept {
  TexelsUnder in_s;
  TexelsUnder in_t;
  if (!texels_under(_mm256_set1_pd(st.x()), texels.width, texels.wrap, in_s) ||
      !texels_under(_mm256_set1_pd(st.y()), texels.height, texels.wrap, in_t))
    return false;
  const std::ptrdiff_t stride = static_cast<std::ptrdiff_t>(texels.width) + 2;
  const float* from = texels.values + _mm_cvtsi128_si32(in_t.index) * stride + _mm_cvtsi128_si32(in_s.index);
  // Lane by lane the three rows; then, turned over, what becomes of them along s: height, slope and bend.
  const WideWeights along_s = weights_at(in_s.offset);
  const WideThree columns =
      columns_of(_mm_loadu_ps(from), _mm_loadu_ps(from + stride), _mm_loadu_ps(from + 2 * stride), _mm_setzero_ps());
  const __m256d heights = value_of(along_s, columns);
  const __m256d slopes = slope_of(along_s, columns);
  const __m256d bends = bend_of(columns);
  const __m256d low = _mm256_unpacklo_pd(heights, slopes);   // h0 s0 h2 s2
  const __m256d high = _mm256_unpackhi_pd(heights, slopes);  // h1 s1 h3 s3
  const __m256d turned = _mm256_unpackhi_pd(bends, bends);   // b1 b1 b3 b3
  const WideThree rows = {{_mm256_permute2f128_pd(low, bends, 0x20), _mm256_permute2f128_pd(high, turned, 0x20),
                           _mm256_permute2f128_pd(low, bends, 0x31)}};
  const WideWeights along_t = weights_at(in_t.offset);
  alignas(32) double value[4];
  alignas(32) double slope[4];
  alignas(32) double bend[4];
  _mm256_store_pd(value, value_of(along_t, rows));
  _mm256_store_pd(slope, slope_of(along_t, rows));
  _mm256_store_pd(bend, bend_of(rows));
  const double width = texels.width;
  const double height = texels.height;
  curvature = {texels.base + value[0],
               {value[1] * width, slope[0] * height},
               value[2] * (width * width),
               slope[1] * (width * height),
               bend[0] * (height * height)};
  return true;
}

}  // namespace

bool wide_spline_heights(const SplineTexels& texels, const Lanes& s, const Lanes& t, Lanes& heights) noexcept {
  return has_avx2() && avx2_heights(texels, s, t, heights);
}

bool wide_spline_curvature(const SplineTexels& texels, const Vec2& st, HeightCurvature& curvature) noexcept {
  return has_avx2() && avx2_curvature(texels, st, curvature);
}

#else

bool wide_spline_heights(const SplineTexels&, const Lanes&, const Lanes&, Lanes&) noexcept {
  return false;
}

bool wide_spline_curvature(const SplineTexels&, const Vec2&, HeightCurvature&) noexcept {
  return false;
}

#endif

}  // namespace asperity
