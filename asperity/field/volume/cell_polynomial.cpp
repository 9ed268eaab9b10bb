#include "asperity/field/volume/cell_polynomial.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#if defined(__GNUC__) && defined(__x86_64__)
// The same code once more for processors with wider registers.
#define ASPERITY_WIDE 1
#define ASPERITY_INLINE [[gnu::always_inline]] inline
#else
#define ASPERITY_INLINE inline
#endif

namespace asperity {

namespace {

template <int Degree>
struct Basis {
  double value[std::size_t{Degree} + 1];
  double slope[std::size_t{Degree} + 1];
  double bend[std::size_t{Degree} + 1];
};

/// Bernstein polynomials at u and their derivatives up to `Order`.
template <int Degree, int Order>
ASPERITY_INLINE void bernstein(double u, double scale, Basis<Degree>& b) noexcept {
  const double w = 1.0 - u;
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
template <int Degree, int Count>
ASPERITY_INLINE void contract(const double* in, const double* weights, double* out) noexcept {
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
  Basis<Degree> b[3];
  for (int a = 0; a < 3; ++a) {
    const double scale = 1.0 / cell.width[a];
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

double cubic_value(const CellPolynomial& cell, const Vec3& p) noexcept {
  return evaluate<3, 0>(cell, p).value;
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
[[gnu::target("avx2,fma")]] FieldJet cubic_gradient_wide(const CellPolynomial& cell, const Vec3& p) noexcept {
  return evaluate<3, 1>(cell, p);
}
[[gnu::target("avx2,fma")]] FieldJet cubic_jet_wide(const CellPolynomial& cell, const Vec3& p) noexcept {
  return evaluate<3, 2>(cell, p);
}
#endif

/// How cubic cells are evaluated on this processor: chosen once.
struct CubicKernels {
  double (*value)(const CellPolynomial&, const Vec3&) noexcept = cubic_value;
  FieldJet (*gradient)(const CellPolynomial&, const Vec3&) noexcept = cubic_gradient;
  FieldJet (*jet)(const CellPolynomial&, const Vec3&) noexcept = cubic_jet;
  CubicKernels() noexcept {
#ifdef ASPERITY_WIDE
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
      value = cubic_value_wide;
      gradient = cubic_gradient_wide;
      jet = cubic_jet_wide;
    }
#endif
  }
};
const CubicKernels cubic;

/// Least and greatest difference of neighbours along one axis, times `scale`.
template <int Degree, int Axis>
inline void difference_range(const double* c, double scale, double& low, double& high) noexcept {
  constexpr int n = Degree + 1;
  constexpr int stride = Axis == 0 ? 1 : Axis == 1 ? n : n * n;
  double least = infinity;
  double greatest = -infinity;
  for (int k = 0; k < (Axis == 2 ? Degree : n); ++k) {
    for (int j = 0; j < (Axis == 1 ? Degree : n); ++j) {
      for (int i = 0; i < (Axis == 0 ? Degree : n); ++i) {
        const double* at = c + i + n * (j + n * k);
        const double difference = at[stride] - at[0];
        least = difference < least ? difference : least;
        greatest = difference > greatest ? difference : greatest;
      }
    }
  }
  low = scale * least;
  high = scale * greatest;
}

template <int Degree>
inline void gradient_range(const CellPolynomial& cell, Vec3& low, Vec3& high) noexcept {
  const double* c = cell.coefficient;
  difference_range<Degree, 0>(c, Degree / cell.width[0], low[0], high[0]);
  difference_range<Degree, 1>(c, Degree / cell.width[1], low[1], high[1]);
  difference_range<Degree, 2>(c, Degree / cell.width[2], low[2], high[2]);
}

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

/// The one root of f between t0, where it is above 0, and t1, where it is below: regula falsi after Illinois, halving
/// where that stands still.
template <class F>
double bracketed_root(const F& f, double t0, double f0, double t1, double f1) noexcept {
  constexpr int most_rounds = 60;
  const double close = 1e-14 * (t1 - t0);
  double low = t0;
  double high = t1;
  double f_low = f0;
  double f_high = f1;
  for (int round = 0; round < most_rounds && high - low > close; ++round) {
    double middle = low + (high - low) * (f_low / (f_low - f_high));
    if (!(middle > low && middle < high)) middle = 0.5 * (low + high);
    if (!(middle > low && middle < high)) break;
    const double there = f(middle);
    if (there >= 0.0) {
      low = middle;
      f_low = there;
      f_high *= round % 2 == 0 ? 1.0 : 0.5;
    } else {
      high = middle;
      f_high = there;
      f_low *= round % 2 == 0 ? 1.0 : 0.5;
    }
    if (there == 0.0) break;
  }
  return low;
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

/// The first zero between t0 and t1 of a polynomial with as many coefficients as `from` has rows, as a fraction.
template <class F, int Count>
bool first_zero_of(const F& f, const FromValues<Count>& from, double t0, double f0, double t1, double f1,
                   double& found) noexcept {
  constexpr auto size = static_cast<std::size_t>(Count);
  double values[size];
  double c[size];
  values[0] = f0;
  values[size - 1] = f1;
  for (int i = 1; i + 1 < Count; ++i) values[i] = f(t0 + (t1 - t0) * i / (Count - 1));
  for (int row = 0; row < Count; ++row) {
    c[row] = 0.0;
    for (int i = 0; i < Count; ++i) c[row] += from.weight[row][i] * values[i];
  }
  c[0] = f0;
  c[size - 1] = f1;
  return first_zero<Count>(c, found);
}

}  // namespace

void CellPolynomial::finish() noexcept {
  const int n = degree + 1;
  const int count = n * n * n;
  double least = coefficient[0];
  double greatest = coefficient[0];
  double sum = 0.0;
  for (int i = 0; i < count; ++i) {
    least = coefficient[i] < least ? coefficient[i] : least;
    greatest = coefficient[i] > greatest ? coefficient[i] : greatest;
    sum += coefficient[i];
  }
  known = std::isfinite(sum);
  low_ = least;
  high_ = greatest;
  if (degree == 1) {
    gradient_range<1>(*this, gradient_low_, gradient_high_);
  } else {
    gradient_range<3>(*this, gradient_low_, gradient_high_);
  }
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

double CellPolynomial::value(const Vec3& p) const noexcept {
  return degree == 1 ? evaluate<1, 0>(*this, p).value : cubic.value(*this, p);
}

FieldJet CellPolynomial::gradient(const Vec3& p) const noexcept {
  return degree == 1 ? evaluate<1, 1>(*this, p) : cubic.gradient(*this, p);
}

FieldJet CellPolynomial::jet(const Vec3& p) const noexcept {
  return degree == 1 ? evaluate<1, 2>(*this, p) : cubic.jet(*this, p);
}

bool CellPolynomial::leaves_sign(const Vec3& a, const Vec3& b, double t0, double t1, double threshold, double sign,
                                 double& t) const noexcept {
  const double nearest = sign > 0.0 ? low_ - threshold : threshold - high_;
  if (nearest > 0.0) return false;
  const Vec3 motion = b - a;
  const auto f = [&](double at) { return sign * (value(a + at * motion) - threshold); };
  double f0 = f(t0);
  if (f0 < 0.0) {
    t = t0;
    return true;
  }
  const double f1 = f(t1);
  const double length = t1 - t0;
  double least = 0.0;
  double greatest = 0.0;
  slope_range(sign * motion, least, greatest);
  if (f1 >= 0.0) {
    // Above 0 at both ends: it can only dip below where its slope may fall and rise again.
    if (least >= 0.0 || greatest <= 0.0) return false;
    const double cut = (f1 - f0 - greatest * length) / (least - greatest);
    if (f0 + least * cut > 0.0) return false;
  } else if (greatest <= 0.0 || least >= 0.0) {
    t = bracketed_root(f, t0, f0, t1, f1);
    return true;
  }
  double found = 0.0;
  const bool reaches = degree == 1 ? first_zero_of(f, from_4_values, t0, f0, t1, f1, found)
                                   : first_zero_of(f, from_10_values, t0, f0, t1, f1, found);
  if (!reaches) return false;
  t = t0 + length * found;
  return true;
}

}  // namespace asperity
