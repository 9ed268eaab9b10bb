#include "asperity/field/volume/cubic_kernels.h"

#include <array>
#include <cstddef>
#include <cstring>

#if defined(__GNUC__) && defined(__x86_64__)
// The same code once more for processors with wider registers.
#define ASPERITY_WIDE 1
#define ASPERITY_INLINE [[gnu::always_inline]] inline
#else
#define ASPERITY_INLINE inline
#endif

namespace asperity {

namespace {

using Places = CellPolynomial::Places;
using FourLanes = double __attribute__((vector_size(lanes * sizeof(double))));
/// Of coefficients, where they lie.
using Row [[gnu::may_alias]] = double __attribute__((vector_size(lanes * sizeof(double)), aligned(alignof(double))));
using Pick = long long __attribute__((vector_size(lanes * sizeof(long long))));

/// Bernstein polynomials of degree 3 and their derivatives: the same for all lanes, or at four places.
struct Basis {
  FourLanes value[4];
  FourLanes slope[4];
  FourLanes bend[4];
};

/// At u, derivatives up to `Order`.
template <int Order>
ASPERITY_INLINE void bernstein(const FourLanes& u, double scale, Basis& b) noexcept {
  const FourLanes w = 1.0 - u;
  const FourLanes w_squared = w * w;
  const FourLanes u_squared = u * u;
  b.value[0] = w_squared * w;
  b.value[1] = 3.0 * u * w_squared;
  b.value[2] = 3.0 * w * u_squared;
  b.value[3] = u_squared * u;
  if constexpr (Order >= 1) {
    const FourLanes s = FourLanes{} + 3.0 * scale;
    b.slope[0] = -s * w_squared;
    b.slope[1] = s * w * (w - 2.0 * u);
    b.slope[2] = s * u * (2.0 * w - u);
    b.slope[3] = s * u_squared;
  }
  if constexpr (Order >= 2) {
    const FourLanes s = FourLanes{} + 6.0 * scale * scale;
    b.bend[0] = s * w;
    b.bend[1] = s * (u - 2.0 * w);
    b.bend[2] = s * (w - 2.0 * u);
    b.bend[3] = s * u;
  }
}

/// One polynomial a lane, all at the same u.
struct LaneBasis {
  FourLanes value;
  FourLanes slope;
  FourLanes bend;
};

template <int Order>
ASPERITY_INLINE void bernstein_lanes(const FourLanes& u, double scale, LaneBasis& b) noexcept {
  const FourLanes w = 1.0 - u;
  const FourLanes both = __builtin_shuffle(w, u, Pick{0, 0, 4, 4});
  b.value = FourLanes{1.0, 3.0, 3.0, 1.0} * __builtin_shuffle(w, u, Pick{0, 0, 0, 4}) * both *
            __builtin_shuffle(w, u, Pick{0, 4, 4, 4});
  if constexpr (Order >= 1)
    b.slope = 3.0 * scale * both * (FourLanes{-1.0, 1.0, 2.0, 0.0} * w + FourLanes{0.0, -2.0, -1.0, 1.0} * u);
  if constexpr (Order >= 2)
    b.bend = 6.0 * scale * scale * (FourLanes{1.0, -2.0, 1.0, 0.0} * w + FourLanes{0.0, 1.0, -2.0, 1.0} * u);
}

// Lanes are handed back through references: where registers are narrower no function could return them.

/// Weighted sum of four, `Stride` apart.
template <int Stride, class In>
ASPERITY_INLINE void blend(const In* in, const FourLanes* weights, FourLanes& out) noexcept {
  out = weights[0] * in[0] + weights[1] * in[Stride] + weights[2] * in[2 * Stride] + weights[3] * in[3 * Stride];
}

/// Along z: a plane of rows.
ASPERITY_INLINE void blend_planes(const Row* rows, const FourLanes* weights, FourLanes* plane) noexcept {
  for (int j = 0; j < 4; ++j) blend<4>(rows + j, weights, plane[j]);
}

/// The sums of the lanes of each.
ASPERITY_INLINE void add_lanes(const FourLanes (&of)[4], FourLanes& sums) noexcept {
  const FourLanes low =
      __builtin_shuffle(of[0], of[1], Pick{0, 4, 2, 6}) + __builtin_shuffle(of[0], of[1], Pick{1, 5, 3, 7});
  const FourLanes high =
      __builtin_shuffle(of[2], of[3], Pick{0, 4, 2, 6}) + __builtin_shuffle(of[2], of[3], Pick{1, 5, 3, 7});
  sums = __builtin_shuffle(low, high, Pick{0, 1, 4, 5}) + __builtin_shuffle(low, high, Pick{2, 3, 6, 7});
}

template <int Order>
ASPERITY_INLINE void evaluate(const CellPolynomial& cell, const Vec3& p, FieldJet& out) noexcept {
  LaneBasis x;
  Basis y;
  Basis z;
  FourLanes at[3];
  for (int a = 0; a < 3; ++a) at[a] = FourLanes{} + (p[a] - cell.lower[a]) * cell.per_width[a];
  bernstein_lanes<Order>(at[0], cell.per_width[0], x);
  bernstein<Order>(at[1], cell.per_width[1], y);
  bernstein<Order>(at[2], cell.per_width[2], z);
  const auto* rows = reinterpret_cast<const Row*>(cell.coefficient);
  FourLanes plane[4];
  FourLanes row;
  blend_planes(rows, z.value, plane);
  blend<1>(plane, y.value, row);
  if constexpr (Order == 0) {
    const FourLanes terms = row * x.value;
    out.value = (terms[0] + terms[1]) + (terms[2] + terms[3]);
  } else {
    FourLanes slopes[4];
    FourLanes row_y;
    FourLanes row_z;
    blend_planes(rows, z.slope, slopes);
    blend<1>(plane, y.slope, row_y);
    blend<1>(slopes, y.value, row_z);
    FourLanes sums;
    add_lanes({row * x.value, row * x.slope, row_y * x.value, row_z * x.value}, sums);
    out.value = sums[0];
    out.gradient = Vec3(sums[1], sums[2], sums[3]);
    if constexpr (Order == 2) {
      FourLanes bends[4];
      FourLanes row_yy;
      FourLanes row_yz;
      FourLanes row_zz;
      blend_planes(rows, z.bend, bends);
      blend<1>(plane, y.bend, row_yy);
      blend<1>(slopes, y.slope, row_yz);
      blend<1>(bends, y.value, row_zz);
      FourLanes mixed;  // xx, xy, xz, yy
      FourLanes rest;   // yz, zz
      add_lanes({row * x.bend, row_y * x.slope, row_z * x.slope, row_yy * x.value}, mixed);
      add_lanes({row_yz * x.value, row_zz * x.value, FourLanes{}, FourLanes{}}, rest);
      out.hessian << mixed[0], mixed[1], mixed[2],  //
          mixed[1], mixed[3], rest[0],              //
          mixed[2], rest[0], rest[1];
    }
  }
}

/// At four places side by side: to rounding what each alone is, as sums may be fused in another order.
ASPERITY_INLINE void evaluate_four(const CellPolynomial& cell, const Places& places, Lanes& values) noexcept {
  Basis b[3];
  for (int a = 0; a < 3; ++a) {
    FourLanes u;
    std::memcpy(&u, &places[static_cast<std::size_t>(a)], sizeof(u));
    bernstein<0>((u - cell.lower[a]) * cell.per_width[a], 1.0, b[a]);
  }
  FourLanes plane[16];
  FourLanes row[4];
  FourLanes sum;
  for (int i = 0; i < 16; ++i) blend<16>(cell.coefficient + i, b[2].value, plane[i]);
  for (int i = 0; i < 4; ++i) blend<4>(plane + i, b[1].value, row[i]);
  blend<1>(row, b[0].value, sum);
  std::memcpy(&values, &sum, sizeof(sum));
}

class LaneRange {
 public:
  ASPERITY_INLINE void include(const FourLanes& values) noexcept {
    least_ = values < least_ ? values : least_;
    greatest_ = values > greatest_ ? values : greatest_;
  }
  ASPERITY_INLINE void tell(double& low, double& high) const noexcept {
    for (std::size_t l = 0; l < lanes; ++l) {
      low = least_[l] < low ? least_[l] : low;
      high = greatest_[l] > high ? greatest_[l] : high;
    }
  }

 private:
  FourLanes least_ = FourLanes{} + infinity;
  FourLanes greatest_ = FourLanes{} - infinity;
};

ASPERITY_INLINE void ranges_of(const double* c, CellRanges& out) noexcept {
  const auto* row = reinterpret_cast<const Row*>(c);
  LaneRange all;
  LaneRange steps[3];
  FourLanes sum = {};
#pragma GCC unroll 4
  for (int k = 0; k < 16; k += 4) {
#pragma GCC unroll 4
    for (int j = 0; j < 4; ++j) {
      const FourLanes here = row[k + j];
      all.include(here);
      sum += here;
      // Three differences; the last one twice.
      steps[0].include(__builtin_shuffle(here, Pick{1, 2, 3, 3}) - __builtin_shuffle(here, Pick{0, 1, 2, 2}));
      if (j < 3) steps[1].include(row[k + j + 1] - here);
      if (k < 12) steps[2].include(row[k + j + 4] - here);
    }
  }
  all.tell(out.low, out.high);
  out.sum = sum[0] + sum[1] + sum[2] + sum[3];
  for (int a = 0; a < 3; ++a) steps[a].tell(out.step_low[a], out.step_high[a]);
}

/// Four rows, `stride` apart, to coefficients across them.
ASPERITY_INLINE void mix_rows(const HermiteWeights& w, int stride, Row* rows) noexcept {
  const FourLanes s[4] = {rows[0], rows[stride], rows[2 * stride], rows[3 * stride]};
  rows[0] = s[1];
  rows[stride] = w.first[0] * s[0] + w.first[1] * s[1] + w.first[2] * s[2];
  rows[2 * stride] = w.second[1] * s[1] + w.second[2] * s[2] + w.second[3] * s[3];
  rows[3 * stride] = s[2];
}

ASPERITY_INLINE void samples_to_bernstein(const std::array<HermiteWeights, 3>& weights, double* c) noexcept {
  auto* rows = reinterpret_cast<Row*>(c);
  const HermiteWeights& x = weights[0];
  // The outer two are the inner samples themselves.
  const FourLanes left = {1.0, x.first[0], x.second[1], 1.0};
  const FourLanes middle = {0.0, x.first[1], x.second[2], 0.0};
  const FourLanes right = {0.0, x.first[2], x.second[3], 0.0};
#pragma GCC unroll 4
  for (int r = 0; r < 16; ++r) {
    const FourLanes s = rows[r];
    rows[r] = left * __builtin_shuffle(s, Pick{1, 0, 1, 2}) + middle * __builtin_shuffle(s, Pick{1, 1, 2, 2}) +
              right * __builtin_shuffle(s, Pick{1, 2, 3, 2});
  }
#pragma GCC unroll 4
  for (int k = 0; k < 16; k += 4) mix_rows(weights[1], 1, rows + k);
#pragma GCC unroll 4
  for (int j = 0; j < 4; ++j) mix_rows(weights[2], 4, rows + j);
}

ASPERITY_INLINE void halve_rows(const Row* from, int stride, Row* first, Row* second) noexcept {
  const FourLanes left = 0.5 * (from[0] + from[stride]);
  const FourLanes middle = 0.5 * (from[stride] + from[2 * stride]);
  const FourLanes right = 0.5 * (from[2 * stride] + from[3 * stride]);
  const FourLanes before = 0.5 * (left + middle);
  const FourLanes after = 0.5 * (middle + right);
  const FourLanes at = 0.5 * (before + after);
  first[0] = from[0];
  first[stride] = left;
  first[2 * stride] = before;
  first[3 * stride] = at;
  second[0] = at;
  second[stride] = after;
  second[2 * stride] = right;
  second[3 * stride] = from[3 * stride];
}

ASPERITY_INLINE void halve_along(const double* whole, int axis, double* first, double* second) noexcept {
  const auto* from = reinterpret_cast<const Row*>(whole);
  auto* low = reinterpret_cast<Row*>(first);
  auto* high = reinterpret_cast<Row*>(second);
  if (axis == 0) {
#pragma GCC unroll 4
    for (int r = 0; r < 16; ++r) {
      const FourLanes c = from[r];
      const FourLanes once = 0.5 * (c + __builtin_shuffle(c, Pick{1, 2, 3, 3}));
      const FourLanes twice = 0.5 * (once + __builtin_shuffle(once, Pick{1, 2, 3, 3}));
      const FourLanes thrice = 0.5 * (twice + __builtin_shuffle(twice, Pick{1, 2, 3, 3}));
      // c0, once 0, twice 0, thrice 0; and thrice 0, twice 1, once 2, c3.
      low[r] = __builtin_shuffle(__builtin_shuffle(c, once, Pick{0, 4, 0, 0}),
                                 __builtin_shuffle(twice, thrice, Pick{0, 4, 0, 0}), Pick{0, 1, 4, 5});
      high[r] = __builtin_shuffle(__builtin_shuffle(thrice, twice, Pick{0, 5, 0, 0}),
                                  __builtin_shuffle(once, c, Pick{2, 7, 0, 0}), Pick{0, 1, 4, 5});
    }
    return;
  }
#pragma GCC unroll 4
  for (int i = 0; i < 4; ++i) {
    const int at = axis == 1 ? 4 * i : i;
    halve_rows(from + at, axis == 1 ? 1 : 4, low + at, high + at);
  }
}

ASPERITY_INLINE LeastCoefficients least_of(const double* coefficients, const double (&along)[3][4]) noexcept {
  const auto* row = reinterpret_cast<const Row*>(coefficients);
  FourLanes least = row[0];
  FourLanes with = FourLanes{} + infinity;
#pragma GCC unroll 4
  for (int k = 0; k < 4; ++k) {
#pragma GCC unroll 4
    for (int j = 0; j < 4; ++j) {
      const FourLanes here = row[4 * k + j];
      const FourLanes sum = here + (along[1][j] + along[2][k]);
      least = here < least ? here : least;
      with = sum < with ? sum : with;
    }
  }
  with += *reinterpret_cast<const Row*>(along[0]);
  LeastCoefficients out;
  for (std::size_t l = 0; l < lanes; ++l) {
    out.alone = least[l] < out.alone ? least[l] : out.alone;
    out.with_sums = with[l] < out.with_sums ? with[l] : out.with_sums;
  }
  return out;
}

// The names of both forms of each.
#define ASPERITY_CUBIC_KERNELS(suffix, target)                                                                    \
  target double value##suffix(const CellPolynomial& cell, const Vec3& p) noexcept {                               \
    FieldJet out;                                                                                                 \
    evaluate<0>(cell, p, out);                                                                                    \
    return out.value;                                                                                             \
  }                                                                                                               \
  target void values##suffix(const CellPolynomial& cell, const Places& places, Lanes& values) noexcept {          \
    evaluate_four(cell, places, values);                                                                          \
  }                                                                                                               \
  target void gradient##suffix(const CellPolynomial& cell, const Vec3& p, FieldJet& out) noexcept {               \
    evaluate<1>(cell, p, out);                                                                                    \
  }                                                                                                               \
  target void jet##suffix(const CellPolynomial& cell, const Vec3& p, FieldJet& out) noexcept {                    \
    evaluate<2>(cell, p, out);                                                                                    \
  }                                                                                                               \
  target void ranges##suffix(const double* coefficients, CellRanges& out) noexcept {                              \
    ranges_of(coefficients, out);                                                                                 \
  }                                                                                                               \
  target void to_bernstein##suffix(const std::array<HermiteWeights, 3>& weights, double* coefficients) noexcept { \
    samples_to_bernstein(weights, coefficients);                                                                  \
  }                                                                                                               \
  target void halve##suffix(const double* whole, int axis, double* first, double* second) noexcept {              \
    halve_along(whole, axis, first, second);                                                                      \
  }                                                                                                               \
  target LeastCoefficients least##suffix(const double* coefficients, const double(&along)[3][4]) noexcept {       \
    return least_of(coefficients, along);                                                                         \
  }

ASPERITY_CUBIC_KERNELS(_plain, )
#ifdef ASPERITY_WIDE
ASPERITY_CUBIC_KERNELS(_wide, [[gnu::target("avx2,fma")]])
#endif

CubicKernels chosen() noexcept {
#ifdef ASPERITY_WIDE
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
    return {value_wide, values_wide, gradient_wide, jet_wide, ranges_wide, to_bernstein_wide, halve_wide, least_wide};
#endif
  return plain_cubic_kernels();
}

}  // namespace

CubicKernels plain_cubic_kernels() noexcept {
  return {value_plain,  values_plain,       gradient_plain, jet_plain,
          ranges_plain, to_bernstein_plain, halve_plain,    least_plain};
}

const CubicKernels cubic_kernels = chosen();

}  // namespace asperity
