#pragma once
// Axes along which a symmetric matrix does nothing but scale.

#include "asperity/core/math.h"

namespace asperity {

/// Of a symmetric matrix: A = axes diag(values) axes^T.
struct PrincipalAxes {
  Mat3 axes = Mat3::Identity();  ///< unit, one a column
  Vec3 values = Vec3::Ones();

  /// The matrix that scales by others along the same axes. [any]
  [[nodiscard]] Mat3 scaling_by(const Vec3& others) const noexcept {
    return axes * others.asDiagonal() * axes.transpose();
  }
};

/// In closed form, to about 1e-8 of the largest value. [any]
PrincipalAxes principal_axes(const Mat3& symmetric) noexcept;

}  // namespace asperity
