#include "asperity/field/volume/cell_part.h"

#include "asperity/field/volume/cubic_kernels.h"

namespace asperity {

CellPart::CellPart(const CellPolynomial& cell, double threshold, double sign) noexcept
    : low(cell.lower), high(cell.upper()) {
  if (cell.degree == 3) {
    for (std::size_t i = 0; i < 64; ++i) coefficient_[i] = sign * (cell.coefficient[i] - threshold);
    return;
  }
  // A line's coefficients of degree 3 are its values at thirds.
  constexpr double thirds[4] = {0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0};
  for (std::size_t k = 0; k < 4; ++k) {
    for (std::size_t j = 0; j < 4; ++j) {
      for (std::size_t i = 0; i < 4; ++i) {
        double sum = 0.0;
        for (unsigned corner = 0; corner < 8; ++corner) {
          const double x = (corner & 1U) != 0 ? thirds[i] : 1.0 - thirds[i];
          const double y = (corner & 2U) != 0 ? thirds[j] : 1.0 - thirds[j];
          const double z = (corner & 4U) != 0 ? thirds[k] : 1.0 - thirds[k];
          sum += x * y * z * cell.coefficient[corner];
        }
        coefficient_[i + 4 * (j + 4 * k)] = sign * (sum - threshold);
      }
    }
  }
}

void CellPart::halves(int axis, CellPart& first, CellPart& second) const noexcept {
  first.low = second.low = low;
  first.high = second.high = high;
  first.high[axis] = second.low[axis] = 0.5 * (low[axis] + high[axis]);
  cubic_kernels.halve(coefficient_, axis, first.coefficient_, second.coefficient_);
}

double CellPart::slope_near(const Vec3& p) const noexcept {
  // There it is the difference of neighbours alone.
  constexpr std::size_t strides[3] = {1, 4, 16};
  const Vec3 middle = 0.5 * (low + high);
  std::size_t at = 0;
  for (std::size_t a = 0; a < 3; ++a) at += p[static_cast<int>(a)] > middle[static_cast<int>(a)] ? 3 * strides[a] : 0;
  Vec3 gradient;
  for (std::size_t a = 0; a < 3; ++a) {
    const int axis = static_cast<int>(a);
    const std::size_t beside = p[axis] > middle[axis] ? at - strides[a] : at + strides[a];
    gradient[axis] = 3.0 * (coefficient_[at] - coefficient_[beside]) / (high[axis] - low[axis]);
  }
  return gradient.norm();
}

bool CellPart::is_positive_around(const Vec3& p, double distance, double weight, double slack) const noexcept {
  // The squared distance along each axis in the same form.
  double along[3][4];
  const double third = weight / 3.0;
  for (int a = 0; a < 3; ++a) {
    const double u = low[a] - p[a];
    const double v = high[a] - p[a];
    along[a][0] = weight * u * u;
    along[a][1] = third * u * (u + 2.0 * v);
    along[a][2] = third * v * (v + 2.0 * u);
    along[a][3] = weight * v * v;
  }
  const LeastCoefficients least = cubic_kernels.least(coefficient_, along);
  return least.alone > 0.0 || least.with_sums >= (1.0 - slack) * weight * distance * distance;
}

}  // namespace asperity
