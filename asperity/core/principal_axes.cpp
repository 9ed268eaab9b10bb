#include "asperity/core/principal_axes.h"

#include <Eigen/Eigenvalues>

namespace asperity {

PrincipalAxes principal_axes(const Mat3& symmetric) noexcept {
  Eigen::SelfAdjointEigenSolver<Mat3> solver;
  solver.computeDirect(symmetric);
  return {solver.eigenvectors(), solver.eigenvalues()};
}

}  // namespace asperity
