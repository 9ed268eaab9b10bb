#include "asperity/field/volume/cell_polynomial.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>

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

/// At one place, or at four side by side.
template <int Degree, class Number>
struct Basis {
  Number value[std::size_t{Degree} + 1];
  Number slope[std::size_t{Degree} + 1];
  Number bend[std::size_t{Degree} + 1];
};

/// Bernstein polynomials at u and their derivatives up to `Order`.
template <int Degree, int Order, class Number>
ASPERITY_INLINE void bernstein(const Number& u, double scale, Basis<Degree, Number>& b) noexcept {
  const Number w = 1.0 - u;
  if constexpr (Degree == 1) {
    b.value[0] = w;
    b.value[1] = u;
    if constexpr (Order >= 1) {
      b.slope[0] = -scale;
      b.slope[1] = scale;
    }
    if constexpr (Order >= 2) b.bend[0] = b.bend[1] = 0.0;
  } else {
    b.value[0] = w * w * w;
    b.value[1] = 3.0 * u * w * w;
    b.value[2] = 3.0 * u * u * w;
    b.value[3] = u * u * u;
    if constexpr (Order >= 1) {
      const double s = 3.0 * scale;
      b.slope[0] = -s * w * w;
      b.slope[1] = s * w * (w - 2.0 * u);
      b.slope[2] = s * u * (2.0 * w - u);
      b.slope[3] = s * u * u;
    }
    if constexpr (Order >= 2) {
      const double s = 6.0 * scale * scale;
      b.bend[0] = s * w;
      b.bend[1] = s * (u - 2.0 * w);
      b.bend[2] = s * (w - 2.0 * u);
      b.bend[3] = s * u;
    }
  }
}

/// out[0 … Count) = sum over k of weights[k] * in[Count k …): the slowest index first, so that the sums run over
/// neighbours in memory.
template <int Degree, int Count, class In, class Number>
ASPERITY_INLINE void contract(const In* in, const Number* weights, Number* out) noexcept {
  for (int i = 0; i < Count; ++i) out[i] = weights[0] * in[i];
  for (int k = 1; k <= Degree; ++k) {
    for (int i = 0; i < Count; ++i) out[i] += weights[k] * in[Count * k + i];
  }
}

template <int Count>
ASPERITY_INLINE double along_x(const double* in, const double* weights) noexcept {
  double sum = 0.0;
  for (int i = 0; i < Count; ++i) sum += weights[i] * in[i];
  return sum;
}

template <int Degree, int Order>
ASPERITY_INLINE FieldJet evaluate(const CellPolynomial& cell, const Vec3& p) noexcept {
  constexpr int n = Degree + 1;
  constexpr auto row = static_cast<std::size_t>(n);
  constexpr std::size_t plane = row * row;
  Basis<Degree, double> b[3];
  for (int a = 0; a < 3; ++a) {
    const double scale = cell.per_width[a];
    bernstein<Degree, Order>((p[a] - cell.lower[a]) * scale, scale, b[a]);
  }
  FieldJet out;
  double v[plane];
  double v_[row];
  contract<Degree, n * n>(cell.coefficient, b[2].value, v);
  contract<Degree, n>(v, b[1].value, v_);
  out.value = along_x<n>(v_, b[0].value);
  if constexpr (Order >= 1) {
    double z[plane];
    double z_[row];
    double y_[row];
    contract<Degree, n * n>(cell.coefficient, b[2].slope, z);
    contract<Degree, n>(z, b[1].value, z_);
    contract<Degree, n>(v, b[1].slope, y_);
    out.gradient = Vec3(along_x<n>(v_, b[0].slope), along_x<n>(y_, b[0].value), along_x<n>(z_, b[0].value));
    if constexpr (Order >= 2) {
      double zz[plane];
      double zz_[row];
      double yz_[row];
      double yy_[row];
      contract<Degree, n * n>(cell.coefficient, b[2].bend, zz);
      contract<Degree, n>(zz, b[1].value, zz_);
      contract<Degree, n>(z, b[1].slope, yz_);
      contract<Degree, n>(v, b[1].bend, yy_);
      const double xy = along_x<n>(y_, b[0].slope);
      const double xz = along_x<n>(z_, b[0].slope);
      const double yz = along_x<n>(yz_, b[0].value);
      out.hessian << along_x<n>(v_, b[0].bend), xy, xz,  //
          xy, along_x<n>(yy_, b[0].value), yz,           //
          xz, yz, along_x<n>(zz_, b[0].value);
    }
  }
  return out;
}

/// At four places side by side: to rounding what each alone is, as sums may be fused in another order.
template <int Degree>
ASPERITY_INLINE void evaluate_four(const CellPolynomial& cell, const Places& places, Lanes& values) noexcept {
  constexpr int n = Degree + 1;
  constexpr auto row = static_cast<std::size_t>(n);
  constexpr std::size_t plane = row * row;
  Basis<Degree, FourLanes> b[3];
  for (int a = 0; a < 3; ++a) {
    FourLanes u;
    std::memcpy(&u, &places[static_cast<std::size_t>(a)], sizeof(u));
    bernstein<Degree, 0>(FourLanes((u - cell.lower[a]) * cell.per_width[a]), 1.0, b[a]);
  }
  FourLanes v[plane];
  FourLanes v_[row];
  contract<Degree, n * n>(cell.coefficient, b[2].value, v);
  contract<Degree, n>(v, b[1].value, v_);
  FourLanes sum = {};
  for (std::size_t i = 0; i < row; ++i) sum += b[0].value[i] * v_[i];
  std::memcpy(&values, &sum, sizeof(sum));
}

double cubic_value(const CellPolynomial& cell, const Vec3& p) noexcept {
  return evaluate<3, 0>(cell, p).value;
}
void cubic_values(const CellPolynomial& cell, const Places& places, Lanes& values) noexcept {
  evaluate_four<3>(cell, places, values);
}
FieldJet cubic_gradient(const CellPolynomial& cell, const Vec3& p) noexcept {
  return evaluate<3, 1>(cell, p);
}
FieldJet cubic_jet(const CellPolynomial& cell, const Vec3& p) noexcept {
  return evaluate<3, 2>(cell, p);
}
#ifdef ASPERITY_WIDE
[[gnu::target("avx2,fma")]] double cubic_value_wide(const CellPolynomial& cell, const Vec3& p) noexcept {
  return evaluate<3, 0>(cell, p).value;
}
[[gnu::target("avx2,fma")]] void cubic_values_wide(const CellPolynomial& cell, const Places& places,
                                                   Lanes& values) noexcept {
  evaluate_four<3>(cell, places, values);
}
[[gnu::target("avx2,fma")]] FieldJet cubic_gradient_wide(const CellPolynomial& cell, const Vec3& p) noexcept {
  return evaluate<3, 1>(cell, p);
}
[[gnu::target("avx2,fma")]] FieldJet cubic_jet_wide(const CellPolynomial& cell, const Vec3& p) noexcept {
  return evaluate<3, 2>(cell, p);
}
#endif

/// What a cell's coefficients say of all of it.
struct CellRanges {
  double low = infinity;
  double high = -infinity;
  double sum = 0.0;
  Vec3 step_low = Vec3::Constant(infinity);  ///< of differences of neighbours along each axis
  Vec3 step_high = Vec3::Constant(-infinity);
};

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

/// A row along x fills the lanes.
ASPERITY_INLINE void cubic_ranges_of(const double* c, CellRanges& out) noexcept {
  using Four = long long __attribute__((vector_size(lanes * sizeof(long long))));
  FourLanes row[16];
  std::memcpy(row, c, sizeof(row));
  LaneRange all;
  LaneRange steps[3];
  FourLanes sum = {};
  for (int r = 0; r < 16; ++r) {
    all.include(row[r]);
    sum += row[r];
    // Three differences; the last one twice.
    const FourLanes along = __builtin_shuffle(row[r], Four{1, 2, 3, 3}) - __builtin_shuffle(row[r], Four{0, 1, 2, 2});
    steps[0].include(along);
    if (r % 4 != 3) steps[1].include(row[r + 1] - row[r]);
    if (r < 12) steps[2].include(row[r + 4] - row[r]);
  }
  all.tell(out.low, out.high);
  out.sum = sum[0] + sum[1] + sum[2] + sum[3];
  for (int a = 0; a < 3; ++a) steps[a].tell(out.step_low[a], out.step_high[a]);
}

void cubic_ranges(const double* coefficients, CellRanges& out) noexcept {
  cubic_ranges_of(coefficients, out);
}
#ifdef ASPERITY_WIDE
[[gnu::target("avx2,fma")]] void cubic_ranges_wide(const double* coefficients, CellRanges& out) noexcept {
  cubic_ranges_of(coefficients, out);
}
#endif

/// Of a trilinear cell.
void linear_ranges(const double* c, CellRanges& out) noexcept {
  const auto least = [](double p, double q) { return p < q ? p : q; };
  const auto greatest = [](double p, double q) { return p > q ? p : q; };
  const auto all = [&](const auto& of, double p, double q, double r, double s) { return of(of(p, q), of(r, s)); };
  const double steps[3][4] = {{c[1] - c[0], c[3] - c[2], c[5] - c[4], c[7] - c[6]},
                              {c[2] - c[0], c[3] - c[1], c[6] - c[4], c[7] - c[5]},
                              {c[4] - c[0], c[5] - c[1], c[6] - c[2], c[7] - c[3]}};
  for (int a = 0; a < 3; ++a) {
    out.step_low[a] = all(least, steps[a][0], steps[a][1], steps[a][2], steps[a][3]);
    out.step_high[a] = all(greatest, steps[a][0], steps[a][1], steps[a][2], steps[a][3]);
  }
  out.low = least(all(least, c[0], c[1], c[2], c[3]), all(least, c[4], c[5], c[6], c[7]));
  out.high = greatest(all(greatest, c[0], c[1], c[2], c[3]), all(greatest, c[4], c[5], c[6], c[7]));
  out.sum = ((c[0] + c[1]) + (c[2] + c[3])) + ((c[4] + c[5]) + (c[6] + c[7]));
}

/// How cubic cells are evaluated on this processor: chosen once.
struct CubicKernels {
  double (*value)(const CellPolynomial&, const Vec3&) noexcept = cubic_value;
  void (*values)(const CellPolynomial&, const Places&, Lanes&) noexcept = cubic_values;
  FieldJet (*gradient)(const CellPolynomial&, const Vec3&) noexcept = cubic_gradient;
  FieldJet (*jet)(const CellPolynomial&, const Vec3&) noexcept = cubic_jet;
  void (*ranges)(const double*, CellRanges&) noexcept = cubic_ranges;
  CubicKernels() noexcept {
#ifdef ASPERITY_WIDE
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
      value = cubic_value_wide;
      values = cubic_values_wide;
      gradient = cubic_gradient_wide;
      jet = cubic_jet_wide;
      ranges = cubic_ranges_wide;
    }
#endif
  }
};
const CubicKernels cubic;

/// Along a straight line a cell of degree d is a polynomial of degree 3 d. Its Bernstein coefficients from its values
/// at evenly spaced places: the inverse of the basis at these places, found once.
template <int Count>
struct FromValues {
  double weight[std::size_t{Count}][std::size_t{Count}];
  FromValues() noexcept {
    // Gauss-Jordan on the basis matrix; at most 10 x 10.
    double matrix[std::size_t{Count}][2 * std::size_t{Count}];
    for (int row = 0; row < Count; ++row) {
      const double t = static_cast<double>(row) / (Count - 1);
      double choose = 1.0;
      for (int i = 0; i < Count; ++i) {
        matrix[row][i] = choose * std::pow(t, i) * std::pow(1.0 - t, Count - 1 - i);
        matrix[row][Count + i] = row == i ? 1.0 : 0.0;
        choose = choose * (Count - 1 - i) / (i + 1);
      }
    }
    for (int column = 0; column < Count; ++column) {
      int pivot = column;
      for (int row = column + 1; row < Count; ++row) {
        if (std::abs(matrix[row][column]) > std::abs(matrix[pivot][column])) pivot = row;
      }
      for (int i = 0; i < 2 * Count; ++i) std::swap(matrix[column][i], matrix[pivot][i]);
      const double divisor = matrix[column][column];
      for (int i = 0; i < 2 * Count; ++i) matrix[column][i] /= divisor;
      for (int row = 0; row < Count; ++row) {
        if (row == column) continue;
        const double factor = matrix[row][column];
        for (int i = 0; i < 2 * Count; ++i) matrix[row][i] -= factor * matrix[column][i];
      }
    }
    for (int row = 0; row < Count; ++row) {
      for (int i = 0; i < Count; ++i) weight[row][i] = matrix[row][Count + i];
    }
  }
};
const FromValues<4> from_4_values;
const FromValues<10> from_10_values;

/// The one root of f between t0, where it is not below 0, and t1, where it is below, by Chandrupatla's method (1997):
/// the parabola through three values where that can be trusted, and halving where not. The answer is on t0's side of
/// it.
template <class F>
double bracketed_root(const F& f, double t0, double f0, double t1, double f1) noexcept {
  constexpr int most_rounds = 100;
  const double close =
      std::max(1e-14 * (t1 - t0), 4.0 * std::numeric_limits<double>::epsilon() * std::max(std::abs(t0), std::abs(t1)));
  double at = t0;
  double value = f0;
  double other = t1;  // of the other sign
  double other_value = f1;
  double share = f0 / (f0 - f1);
  for (int round = 0; round < most_rounds && std::abs(other - at) > close; ++round) {
    const double least = 0.5 * close / std::abs(other - at);
    const double next = at + std::clamp(share, least, 1.0 - least) * (other - at);
    const double there = f(next);
    const bool same = (there >= 0.0) == (value >= 0.0);
    const double third = same ? at : other;
    const double third_value = same ? value : other_value;
    if (!same) {
      other = at;
      other_value = value;
    }
    at = next;
    value = there;
    if (value == 0.0) return at;
    const double xi = (at - other) / (third - other);
    const double phi = (value - other_value) / (third_value - other_value);
    share = 0.5;
    if (phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi) {
      share = value / (other_value - value) * third_value / (other_value - third_value) +
              (third - at) / (other - at) * value / (third_value - value) * other_value / (third_value - other_value);
    }
  }
  return value >= 0.0 ? at : other;
}

/// A Bernstein polynomial at a place in [0, 1], by Horner's scheme.
template <int Count>
double bernstein(const double* c, double at) noexcept {
  constexpr int degree = Count - 1;
  constexpr auto binomials = [] {
    std::array<double, std::size_t{Count}> row{};
    row[0] = 1.0;
    for (std::size_t i = 1; i < row.size(); ++i)
      row[i] = row[i - 1] * static_cast<double>(row.size() - i) / static_cast<double>(i);
    return row;
  }();
  const double rest = 1.0 - at;
  double power = 1.0;
  double sum = c[0] * rest;
  for (int i = 1; i < degree; ++i) {
    power *= at;
    sum = (sum + power * binomials[static_cast<std::size_t>(i)] * c[i]) * rest;
  }
  return sum + power * at * c[degree];
}

/// First place in [0, 1] at which a Bernstein polynomial that starts above 0 reaches 0, by halving: where no
/// coefficient is below 0 there is none, where they change their sign once there is one. False when there is none.
template <int Count>
bool first_zero(const double* coefficients, double& t) noexcept {
  struct Piece {
    double c[std::size_t{Count}];
    double low;
    double high;
  };
  constexpr int most_pieces = 64;
  constexpr double finest = 1e-15;
  Piece stack[most_pieces];
  int top = 1;
  std::copy(coefficients, coefficients + Count, stack[0].c);
  stack[0].low = 0.0;
  stack[0].high = 1.0;
  while (top > 0) {
    Piece piece = stack[--top];
    bool negative = false;
    int changes = 0;
    for (int i = 0; i < Count; ++i) {
      negative = negative || piece.c[i] < 0.0;
      changes += i > 0 && (piece.c[i] < 0.0) != (piece.c[i - 1] < 0.0) ? 1 : 0;
    }
    if (!negative) continue;
    if (piece.c[0] < 0.0) {
      t = piece.low;
      return true;
    }
    const double width = piece.high - piece.low;
    const double end = piece.c[Count - 1];
    if (changes == 1 && end < 0.0) {
      const auto there = [&](double at) { return bernstein<Count>(piece.c, at); };
      t = piece.low + width * bracketed_root(there, 0.0, piece.c[0], 1.0, end);
      return true;
    }
    if (width < finest || top + 2 > most_pieces) {
      // Coefficients below 0 in a piece that is too short to halve are a touch within rounding.
      t = end < 0.0 ? piece.high : 0.5 * (piece.low + piece.high);
      return true;
    }
    Piece right = piece;
    Piece left = piece;
    for (int step = 1; step < Count; ++step) {
      for (int i = 0; i + step < Count; ++i) right.c[i] = 0.5 * (right.c[i] + right.c[i + 1]);
      left.c[step] = right.c[0];
    }
    // de Casteljau leaves the right half's coefficients where they were last written.
    const double middle = 0.5 * (piece.low + piece.high);
    left.high = middle;
    right.low = middle;
    stack[top++] = right;
    stack[top++] = left;
  }
  return false;
}

/// The first zero of a polynomial in [0, 1], by its values at evenly spaced places.
template <int Count>
bool first_zero_of(const FromValues<Count>& from, const double* values, double& found) noexcept {
  double c[std::size_t{Count}];
  for (int row = 0; row < Count; ++row) {
    c[row] = 0.0;
    for (int i = 0; i < Count; ++i) c[row] += from.weight[row][i] * values[i];
  }
  c[0] = values[0];
  c[Count - 1] = values[Count - 1];
  return first_zero<Count>(c, found);
}

}  // namespace

void CellPolynomial::finish() noexcept {
  CellRanges ranges;
  if (degree == 1) {
    linear_ranges(coefficient, ranges);
  } else {
    cubic.ranges(coefficient, ranges);
  }
  known = std::isfinite(ranges.sum);
  low_ = ranges.low;
  high_ = ranges.high;
  per_width = width.cwiseInverse();
  gradient_low_ = degree * ranges.step_low.cwiseProduct(per_width);
  gradient_high_ = degree * ranges.step_high.cwiseProduct(per_width);
  most_bend_ = -1.0;
}

void CellPolynomial::slope_range(const Vec3& d, double& least, double& greatest) const noexcept {
  least = 0.0;
  greatest = 0.0;
  for (int a = 0; a < 3; ++a) {
    const double low = gradient_low_[a] * d[a];
    const double high = gradient_high_[a] * d[a];
    least += std::min(low, high);
    greatest += std::max(low, high);
  }
}

double CellPolynomial::most_bend() const noexcept {
  if (most_bend_ >= 0.0) return most_bend_;
  const int n = degree + 1;
  const int stride[3] = {1, n, n * n};
  double squared = 0.0;  // of the matrix of the greatest second derivatives
  for (int a = 0; a < 3; ++a) {
    for (int b = a; b < 3; ++b) {
      double greatest = 0.0;
      int end[3] = {n, n, n};
      --end[a];
      --end[b];
      for (int k = 0; k < end[2]; ++k) {
        for (int j = 0; j < end[1]; ++j) {
          for (int i = 0; i < end[0]; ++i) {
            const double* c = coefficient + i + n * (j + n * k);
            const double step = c[stride[a] + stride[b]] - c[stride[a]] - c[stride[b]] + c[0];
            greatest = std::max(greatest, std::abs(step));
          }
        }
      }
      const double factor = degree * (a == b ? degree - 1.0 : degree) * per_width[a] * per_width[b];
      squared += (a == b ? 1.0 : 2.0) * (factor * greatest) * (factor * greatest);
    }
  }
  return most_bend_ = std::sqrt(squared);
}

double CellPolynomial::value(const Vec3& p) const noexcept {
  return degree == 1 ? evaluate<1, 0>(*this, p).value : cubic.value(*this, p);
}

FieldJet CellPolynomial::gradient(const Vec3& p) const noexcept {
  return degree == 1 ? evaluate<1, 1>(*this, p) : cubic.gradient(*this, p);
}

FieldJet CellPolynomial::jet(const Vec3& p) const noexcept {
  return degree == 1 ? evaluate<1, 2>(*this, p) : cubic.jet(*this, p);
}

void CellPolynomial::values(const Places& places, Lanes& out) const noexcept {
  degree == 1 ? evaluate_four<1>(*this, places, out) : cubic.values(*this, places, out);
}

bool CellPolynomial::leaves_sign(const Vec3& a, const Vec3& b, double t0, double t1, double threshold, double sign,
                                 double& t) const noexcept {
  const double nearest = sign > 0.0 ? low_ - threshold : threshold - high_;
  if (nearest > 0.0) return false;
  const Vec3 motion = b - a;
  const double length = t1 - t0;
  const auto f = [&](double at) { return sign * (value(a + at * motion) - threshold); };
  // Where it starts and ends is asked for alone: what is on the surface to rounding is on the same side for everyone.
  double values[10];
  const double f0 = values[0] = f(t0);
  if (f0 < 0.0) {
    t = t0;
    return true;
  }
  const double f1 = values[9] = f(t1);
  double least = 0.0;
  double greatest = 0.0;
  slope_range(sign * motion, least, greatest);
  if (f1 < 0.0 && (greatest <= 0.0 || least >= 0.0)) {
    t = bracketed_root(f, t0, f0, t1, f1);
    return true;
  }
  // Above 0 at both ends it can only dip below where its slope may fall and rise again.
  if (f1 >= 0.0 && (least >= 0.0 || greatest <= 0.0)) return false;
  const double ninth = length / 9.0;
  const auto may_dip = [&](std::size_t from, std::size_t to) {
    const double cut =
        (values[to] - values[from] - greatest * ninth * static_cast<double>(to - from)) / (least - greatest);
    return values[from] + least * cut <= 0.0;
  };
  if (f1 >= 0.0 && !may_dip(0, 9)) return false;
  // By ninths of the way, four at a time; of a trilinear cell thirds are enough.
  const auto ask = [&](const std::array<std::size_t, lanes>& ninths) {
    Places places;
    Lanes there;
    for (std::size_t l = 0; l < lanes; ++l) {
      const Vec3 place = a + (t0 + ninth * static_cast<double>(ninths[l])) * motion;
      for (int axis = 0; axis < 3; ++axis) places[static_cast<std::size_t>(axis)][l] = place[axis];
    }
    this->values(places, there);
    for (std::size_t l = 0; l < lanes; ++l) values[ninths[l]] = sign * (there[l] - threshold);
  };
  double found = 0.0;
  bool reaches = false;
  if (degree == 1) {
    ask({3, 6, 6, 6});
    const double thirds[4] = {values[0], values[3], values[6], values[9]};
    reaches = first_zero_of(from_4_values, thirds, found);
  } else {
    ask({2, 4, 5, 7});
    if (f1 >= 0.0 && !may_dip(0, 2) && !may_dip(2, 4) && !may_dip(4, 5) && !may_dip(5, 7) && !may_dip(7, 9))
      return false;
    ask({1, 3, 6, 8});
    reaches = first_zero_of(from_10_values, values, found);
  }
  if (!reaches) return false;
  t = t0 + length * found;
  return true;
}

}  // namespace asperity
