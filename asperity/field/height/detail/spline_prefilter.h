#pragma once

#include <cstddef>
#include <vector>

#include "asperity/field/height/map.h"

namespace asperity {

/// Finds the coefficients c of the B-spline that passes through given values h: (c[i-1] + 6 c[i] + c[i+1]) / 8 = h[i]
/// of the quadratic one at its knots' middles, (c[i-1] + 4 c[i] + c[i+1]) / 6 of the cubic one at its knots. The
/// tridiagonal system is solved by elimination, exactly up to rounding for any count: as a ring for `Wrap::repeat`
/// (Sherman-Morrison), or with the border mirrored half a texel outside, c[-1] = c[0] and c[n] = c[n-1], for
/// `Wrap::clamp`, which makes the slope at the border 0. [build]
class SplinePrefilter {
 public:
  /// For `count` > 0 values, of a reconstruction that is a spline.
  SplinePrefilter(int count, Wrap wrap, Reconstruction reconstruction);

  /// Replaces values by coefficients, for `lanes` systems side by side: element i of lane l is values[i * stride + l].
  void solve(double* values, std::size_t stride, std::size_t lanes) const;

 private:
  void eliminate(std::vector<double> diagonal);
  void close_ring(double gamma);
  void solve_open(double* values, std::size_t stride, std::size_t lanes) const;

  std::size_t count_;
  double off_diagonal_;
  std::vector<double> upper_;  // elimination factors
  std::vector<double> inverse_pivot_;
  std::vector<double> ring_correction_;  // empty: the system is open
  double ring_corner_ = 0.0;
  double ring_scale_ = 0.0;
};

}  // namespace asperity
