#pragma once
// The inner loops of smooth cells: Bernstein form of degree 3 along each axis, a row along x filling the lanes.
// Each exists twice, from the same source: for every processor, and for those with AVX2, chosen once. Private to field.

#include <array>

#include "asperity/field/volume/cell_polynomial.h"

namespace asperity {

/// What a cell's coefficients say of all of it.
struct CellRanges {
  double low = infinity;
  double high = -infinity;
  double sum = 0.0;
  Vec3 step_low = Vec3::Constant(infinity);  ///< of differences of neighbours along each axis
  Vec3 step_high = Vec3::Constant(-infinity);
};

/// Weights that turn samples i-1 … i+2 along an axis into the inner two Bernstein coefficients of cell i.
struct HermiteWeights {
  double first[4];
  double second[4];
};

/// Bounds on a polynomial from below.
struct LeastCoefficients {
  double alone = infinity;
  double with_sums = infinity;
};

/// How cubic cells are made and evaluated on this processor. [servo]
struct CubicKernels {
  double (*value)(const CellPolynomial&, const Vec3&) noexcept;
  void (*values)(const CellPolynomial&, const CellPolynomial::Places&, Lanes&) noexcept;
  /// Value and gradient; the rest of the jet is left as it is.
  void (*gradient)(const CellPolynomial&, const Vec3&, FieldJet&) noexcept;
  void (*jet)(const CellPolynomial&, const Vec3&, FieldJet&) noexcept;
  void (*ranges)(const double* coefficients, CellRanges&) noexcept;
  /// 4 x 4 x 4 samples to coefficients, in place; the weights along each axis.
  void (*to_bernstein)(const std::array<HermiteWeights, 3>&, double* coefficients) noexcept;
  /// Coefficients over the two halves along an axis, by de Casteljau.
  void (*halve)(const double* whole, int axis, double* first, double* second) noexcept;
  /// The least of them; `along` three axes added to each: the least of these sums.
  LeastCoefficients (*least)(const double* coefficients, const double (&along)[3][4]) noexcept;
};
extern const CubicKernels cubic_kernels;
/// Those for every processor: what the others are tested against. [any]
CubicKernels plain_cubic_kernels() noexcept;

}  // namespace asperity
