#include "asperity/field/volume/cubic_kernels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace asperity {

namespace {

using Places = CellPolynomial::Places;

/// Of a trilinear cell: what it is along x, y and z, one after the other.
template <int Order>
FieldJet linear_jet(const CellPolynomial& cell, const Vec3& p) noexcept {
  const double* c = cell.coefficient;
  const Vec3 u = (p - cell.lower).cwiseProduct(cell.per_width);
  const Vec3 w = Vec3::Ones() - u;
  double low[4];  // along z
  double step[4];
  for (int i = 0; i < 4; ++i) {
    low[i] = w.z() * c[i] + u.z() * c[4 + i];
    step[i] = c[4 + i] - c[i];
  }
  const double row[2] = {w.y() * low[0] + u.y() * low[2], w.y() * low[1] + u.y() * low[3]};
  FieldJet out;
  out.value = w.x() * row[0] + u.x() * row[1];
  if constexpr (Order >= 1) {
    const double row_y[2] = {low[2] - low[0], low[3] - low[1]};
    const double row_z[2] = {w.y() * step[0] + u.y() * step[2], w.y() * step[1] + u.y() * step[3]};
    out.gradient = Vec3(row[1] - row[0], w.x() * row_y[0] + u.x() * row_y[1], w.x() * row_z[0] + u.x() * row_z[1])
                       .cwiseProduct(cell.per_width);
    if constexpr (Order >= 2) {
      const double xy = (row_y[1] - row_y[0]) * cell.per_width.x() * cell.per_width.y();
      const double xz = (row_z[1] - row_z[0]) * cell.per_width.x() * cell.per_width.z();
      const double yz =
          (w.x() * (step[2] - step[0]) + u.x() * (step[3] - step[1])) * cell.per_width.y() * cell.per_width.z();
      out.hessian << 0.0, xy, xz, xy, 0.0, yz, xz, yz, 0.0;
    }
  }
  return out;
}

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
    cubic_kernels.ranges(coefficient, ranges);
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
  return degree == 1 ? linear_jet<0>(*this, p).value : cubic_kernels.value(*this, p);
}

FieldJet CellPolynomial::gradient(const Vec3& p) const noexcept {
  if (degree == 1) return linear_jet<1>(*this, p);
  FieldJet out;
  cubic_kernels.gradient(*this, p, out);
  return out;
}

void CellPolynomial::jet(const Vec3& p, FieldJet& out) const noexcept {
  if (degree == 1) {
    out = linear_jet<2>(*this, p);
  } else {
    cubic_kernels.jet(*this, p, out);
  }
}

void CellPolynomial::values(const Places& places, Lanes& out) const noexcept {
  if (degree != 1) return cubic_kernels.values(*this, places, out);
  for (std::size_t l = 0; l < lanes; ++l) out[l] = value({places[0][l], places[1][l], places[2][l]});
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
