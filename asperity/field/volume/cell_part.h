#pragma once
// A field over part of a cell: what bounds it from below, and its halves.

#include "asperity/field/volume/cell_polynomial.h"

namespace asperity {

/// A cell's polynomial, or its negative, over a box within the cell, in Bernstein form of degree 3 along each axis. Its
/// coefficients bound it from below, the closer the smaller the box is: by its second derivatives and the square of its
/// width. [servo]
class CellPart {
 public:
  Vec3 low = Vec3::Zero();   ///< m, the field's frame
  Vec3 high = Vec3::Zero();  ///< m

  CellPart() = default;  // NOLINT(*-member-init): what halves() fills
  /// sign (field - threshold) over the whole cell; `sign`: 1 or -1.
  CellPart(const CellPolynomial& cell, double threshold, double sign) noexcept;

  /// The halves along an axis.
  void halves(int axis, CellPart& first, CellPart& second) const noexcept;
  /// At a corner, its bit a set: at the box's upper end along axis a.
  [[nodiscard]] double at_corner(unsigned corner) const noexcept {
    return coefficient_[((corner & 1U) != 0 ? 3U : 0U) + ((corner & 2U) != 0 ? 12U : 0U) +
                        ((corner & 4U) != 0 ? 48U : 0U)];
  }
  [[nodiscard]] Vec3 corner(unsigned corner) const noexcept {
    return {((corner & 1U) != 0 ? high : low)[0], ((corner & 2U) != 0 ? high : low)[1],
            ((corner & 4U) != 0 ? high : low)[2]};
  }
  /// Length of its gradient at the corner nearest to a place.
  [[nodiscard]] double slope_near(const Vec3& p) const noexcept;
  /// Whether it is above 0 wherever the box is nearer to `p` than `distance`, as far as bounds tell: by itself, or with
  /// `weight` times by how much the squared distance falls short of that (Lagrange's multiplier of being that near). To
  /// a share `slack` of what that is worth at p.
  [[nodiscard]] bool is_positive_around(const Vec3& p, double distance, double weight, double slack) const noexcept;

 private:
  double coefficient_[64];  ///< as of a cell of degree 3
};

}  // namespace asperity
