#pragma once
// A scalar field over one cell of its grid, as a polynomial.

#include <cstdint>

#include "asperity/core/lanes.h"
#include "asperity/core/math.h"
#include "asperity/core/names.h"

namespace asperity {

/// How a field is reconstructed between its samples. Both pass through every sample.
enum class CellReconstruction : std::uint8_t {
  trilinear,  ///< as large-data-2008; its gradient jumps at cell faces
  smooth,     ///< tricubic, Hermite with slopes of second order on stretched axes: its gradient is continuous
};
/// As in scene files.
template <>
struct Names<CellReconstruction> {
  static constexpr auto table = std::to_array<Named<CellReconstruction>>(
      {{CellReconstruction::trilinear, "trilinear"}, {CellReconstruction::smooth, "smooth"}});
};

/// Cell (i, j, k) of a level of a field.
struct CellIndex {
  std::uint32_t at[3] = {no_index, no_index, no_index};
  bool operator==(const CellIndex&) const = default;
};

/// Value and derivatives of a field at a point, by the field's unit and metre.
struct FieldJet {
  double value = 0.0;
  Vec3 gradient = Vec3::Zero();
  Mat3 hessian = Mat3::Zero();
};

/// The field over one cell, in Bernstein form of degree 1 or 3 along each axis: its coefficients bound it, and their
/// differences bound its gradient. Positions are in the field's frame (m). A cache in the caller's hands. [servo]
class CellPolynomial {
 public:
  std::uint64_t owner = 0;  ///< identity of the field; 0: nothing
  int level = 0;
  CellIndex cell;
  int degree = 1;
  bool known = false;  ///< false where a sample that the cell needs is not a number
  Vec3 lower = Vec3::Zero();
  Vec3 width = Vec3::Ones();
  Vec3 per_width = Vec3::Ones();  ///< 1 / width
  /// Bernstein coefficients; place (i, j, k) at i + n (j + n k) with n = degree + 1.
  double coefficient[64];

  /// After the coefficients were written: finds the bounds. [servo]
  void finish() noexcept;

  [[nodiscard]] double low() const noexcept { return low_; }    ///< not above the field anywhere in the cell
  [[nodiscard]] double high() const noexcept { return high_; }  ///< not below it
  [[nodiscard]] Vec3 upper() const noexcept { return lower + width; }
  /// Whether a place lies in the cell and clear of its faces, so that no rounding would find it in another one. [servo]
  [[nodiscard]] bool has_well_inside(const Vec3& p) const noexcept {
    constexpr double clear = 1e-6;  // of its width
    const auto within = [&](int a) {
      const double at = (p[a] - lower[a]) * per_width[a];
      return at > clear && at < 1.0 - clear;
    };
    return within(0) && within(1) && within(2);
  }
  /// Least and greatest of the gradient's component along direction `d` anywhere in the cell: bounds. [servo]
  void slope_range(const Vec3& d, double& least, double& greatest) const noexcept;
  /// How fast the gradient changes by length anywhere in the cell at most: a bound, found when first asked for. [servo]
  [[nodiscard]] double most_bend() const noexcept;

  [[nodiscard]] double value(const Vec3& p) const noexcept;
  /// The coordinates of four places.
  using Places = std::array<Lanes, 3>;
  /// At four places side by side, each to rounding what it is alone. [servo]
  void values(const Places& places, Lanes& out) const noexcept;
  /// Value and gradient; the hessian is left at zero. [servo]
  [[nodiscard]] FieldJet gradient(const Vec3& p) const noexcept;
  /// Value, gradient and hessian. [servo]
  [[nodiscard]] FieldJet jet(const Vec3& p) const noexcept {
    FieldJet out;
    jet(p, out);
    return out;
  }
  void jet(const Vec3& p, FieldJet& out) const noexcept;

  /// First t in [t0, t1] of the segment from a to b (which lies in the cell there) at which value - threshold has not
  /// the sign `sign` (+1 or -1) any more; false when it keeps that sign throughout. Exact to rounding: no pair of roots
  /// is missed. [servo]
  bool leaves_sign(const Vec3& a, const Vec3& b, double t0, double t1, double threshold, double sign,
                   double& t) const noexcept;

 private:
  double low_ = 0.0;
  double high_ = 0.0;
  Vec3 gradient_low_ = Vec3::Zero();
  Vec3 gradient_high_ = Vec3::Zero();
  mutable double most_bend_ = -1.0;  ///< below 0: not known yet
};

}  // namespace asperity
