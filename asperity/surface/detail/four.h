#pragma once
// Four of what is otherwise computed one by one, side by side in double precision: the same operations in the same
// order, so that answers are equal bit for bit. Inlined into functions for AVX2 and into plain ones. Private to
// surface.

#include <array>
#include <cmath>
#include <cstddef>

#if defined(__x86_64__)
#include <emmintrin.h>
#endif

namespace asperity::four {

using Wide = double __attribute__((vector_size(32)));
using Floats = float __attribute__((vector_size(16)));
/// A vector of each of the four.
using Vectors = std::array<Wide, 3>;

#define ASPERITY_FOUR [[gnu::always_inline]] inline

/// Rounded as one by itself is. [any]
ASPERITY_FOUR void square_root(const Wide& x, Wide& root) {
#if defined(__x86_64__)
  const __m128d low = _mm_sqrt_pd(__m128d{x[0], x[1]});
  const __m128d high = _mm_sqrt_pd(__m128d{x[2], x[3]});
  root = Wide{low[0], low[1], high[0], high[1]};
#else
  for (std::size_t i = 0; i < 4; ++i) root[i] = std::sqrt(x[i]);
#endif
}
/// Of each without its sign. [any]
ASPERITY_FOUR void magnitude(const Wide& x, Wide& out) {
  out = x < 0.0 ? -x : x;
}
/// As std::max, of each. [any]
ASPERITY_FOUR void keep_larger(Wide& most, const Wide& x) {
  most = x > most ? x : most;
}
/// As std::min, of each. [any]
ASPERITY_FOUR void keep_smaller(Wide& least, const Wide& x) {
  least = x < least ? x : least;
}
/// In the order in which sums of three are formed elsewhere. [any]
ASPERITY_FOUR void dot(const Vectors& a, const Vectors& b, Wide& out) {
  out = a[0] * b[0] + (a[1] * b[1] + a[2] * b[2]);
}
/// As Eigen forms it. [any]
ASPERITY_FOUR void cross(const Vectors& a, const Vectors& b, Vectors& out) {
  out = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

}  // namespace asperity::four
