#pragma once
// Reliefs as their texels define them, worked out from the definitions alone: what the library's heights are compared
// with.

#include <Eigen/LU>

#include <cmath>
#include <cstddef>
#include <vector>

#include "asperity/core/math.h"

namespace asperity::test {

/// The cardinal B-spline of a degree, centred on 0 (Cox and de Boor's recursion).
inline double cardinal_spline(int degree, double x) {
  if (degree == 0) return x >= -0.5 && x < 0.5 ? 1.0 : 0.0;
  const double half = 0.5 * (degree + 1);
  if (std::abs(x) >= half) return 0.0;
  return ((half + x) * cardinal_spline(degree - 1, x + 0.5) + (half - x) * cardinal_spline(degree - 1, x - 0.5)) /
         degree;
}

/// The spline of degree 2 or 3 on a repeating map that passes through every texel at its centre: interpolation solved
/// as it stands, one equation a texel.
class SplineOracle {
 public:
  /// `texels`: size x size heights, row 0 on top.
  SplineOracle(const std::vector<float>& texels, int size, int degree) : size_(size), degree_(degree) {
    Eigen::MatrixXd heights(size, size);
    Eigen::MatrixXd spline = Eigen::MatrixXd::Zero(size, size);
    for (int row = 0; row < size; ++row) {
      for (int column = 0; column < size; ++column) {
        heights(size - 1 - row, column) = static_cast<double>(texels[static_cast<std::size_t>(row * size + column)]);
      }
      for (int off = -2; off <= 2; ++off) spline(row, wrapped(row + off)) += cardinal_spline(degree, off);
    }
    const Eigen::PartialPivLU<Eigen::MatrixXd> solver(spline);
    coefficients_ = solver.solve(solver.solve(heights).transpose()).transpose();
  }

  /// Height (m) at texture coordinates, t upwards.
  [[nodiscard]] double height(double s, double t) const {
    const double x = s * size_ - 0.5;
    const double y = t * size_ - 0.5;
    double sum = 0.0;
    for (int j = static_cast<int>(std::floor(y)) - 2; j <= static_cast<int>(std::floor(y)) + 3; ++j) {
      const double across = cardinal_spline(degree_, y - j);
      if (across == 0.0) continue;
      for (int i = static_cast<int>(std::floor(x)) - 2; i <= static_cast<int>(std::floor(x)) + 3; ++i)
        sum += across * cardinal_spline(degree_, x - i) * coefficients_(wrapped(j), wrapped(i));
    }
    return sum;
  }

 private:
  [[nodiscard]] int wrapped(int i) const { return ((i % size_) + size_) % size_; }

  int size_;
  int degree_;
  Eigen::MatrixXd coefficients_;  // row j from below
};

}  // namespace asperity::test
