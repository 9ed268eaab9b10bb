#pragma once
// Isosurfaces of scalar fields, touched directly: no triangles anywhere.

#include <memory>

#include "asperity/core/names.h"
#include "asperity/field/scalar_field.h"
#include "asperity/surface/surface.h"

namespace asperity {

/// Which side of the threshold is the inside of what is touched.
enum class Inside : std::uint8_t {
  low,   ///< values below the threshold (large-data-2008)
  high,  ///< values above it: densities, vortices
};
/// As in scene files.
template <>
struct Names<Inside> {
  static constexpr auto table = std::to_array<Named<Inside>>({{Inside::low, "low"}, {Inside::high, "high"}});
};

/// Where a motion passes a threshold.
struct IsoCrossing {
  bool found = false;
  double t = 1.0;       ///< fraction of the motion
  bool inward = false;  ///< from the outside in ("cross"); otherwise from the inside out ("uncross")
  Vec3 point = Vec3::Zero();
  Vec3 outward = Vec3::Zero();  ///< unit normal of the isosurface there, towards the outside
  CellIndex cell;
};

/// An isosurface as one tick sees it: a level of the field and a threshold. Small and free to copy. [servo]
struct IsoView {
  const ScalarField* field = nullptr;
  int level = 0;
  double threshold = 0.0;
  double sigma = 1.0;  ///< 1 where low values are inside, -1 where high ones are: phi = sigma (value - threshold)

  /// Value and gradient of the field itself. False outside the volume and where nothing is known. [servo]
  bool sample(const Vec3& p, IsoHint& hint, FieldJet& out) const noexcept {
    if (!field->contains(p)) return false;
    return field->sample(level, p, hint.slot(field->identity(), level, field->cell_of(level, p)), out);
  }
  /// The first place where the motion passes the threshold after fraction `from`, found cell by cell (Amanatides and
  /// Woo 1987) by the exact root of the cell's polynomial (Parker et al. 1998, Marmitt et al. 2004); cells that the
  /// octree excludes are not visited. A start on the threshold counts as outside. Places outside the volume, or where
  /// nothing is known, hold no surface. [servo]
  [[nodiscard]] IsoCrossing first_crossing(const Segment& motion, IsoHint& hint, double from = 0.0) const noexcept;
  /// The first crossing of a kind: into the inside from `front`, either way from `both`. [servo]
  [[nodiscard]] IsoCrossing first_touch(const Segment& motion, Sides sides, IsoHint& hint) const noexcept;
  /// The isosurface's nearest point to p within `bound` (m): cells in order of distance, in each the point led downhill
  /// by Newton's method. `hint.foot` is tried first. [servo]
  [[nodiscard]] Foot closest(const Vec3& p, double bound, IsoHint& hint) const noexcept;
  /// The gradient of phi at p, which is on or near the surface, unit; zero where there is none. [servo]
  [[nodiscard]] Vec3 outward(const Vec3& p, IsoHint& hint) const noexcept;
  /// Distance that keeps a resting probe off the surface (m).
  [[nodiscard]] double skin() const noexcept { return 1e-6 * field->narrowest_cell(); }
};

/// The isosurface of a scalar field at a threshold.
class IsoSurface {
 public:
  /// `threshold_speed`: how fast the surface may move along its normal (m/s) when its threshold is changed while it is
  /// touched; above 0. Errors: bad_value (a threshold that the field nowhere reaches, naming its range). [build]
  static Result<IsoSurface> build(std::shared_ptr<const ScalarField> field, double threshold, Inside inside,
                                  double threshold_speed = 0.02);
  /// The same field at another threshold: what a change while touching is made with. Errors as above. [build]
  [[nodiscard]] Result<IsoSurface> with_threshold(double threshold) const;

  [[nodiscard]] const ScalarField& field() const noexcept { return *field_; }
  [[nodiscard]] const std::shared_ptr<const ScalarField>& shared_field() const noexcept { return field_; }
  [[nodiscard]] double threshold() const noexcept { return threshold_; }
  [[nodiscard]] Inside inside() const noexcept { return inside_; }
  [[nodiscard]] double threshold_speed() const noexcept { return threshold_speed_; }
  /// Typical length of the field's gradient on the surface, by the field's unit and metre. [any]
  [[nodiscard]] double typical_slope() const noexcept { return typical_slope_; }
  [[nodiscard]] IsoView view(int level = 0) const noexcept {
    return {field_.get(), level, threshold_, inside_ == Inside::low ? 1.0 : -1.0};
  }
  [[nodiscard]] IsoView view_at(int level, double threshold) const noexcept {
    return {field_.get(), level, threshold, inside_ == Inside::low ? 1.0 : -1.0};
  }

  /// Number of the cell at p, for messages and traces; never no_index. [servo]
  [[nodiscard]] std::uint32_t element_of(int level, const Vec3& p) const noexcept {
    return element_of(level, field_->cell_of(level, p));
  }
  [[nodiscard]] std::uint32_t element_of(int level, const CellIndex& cell) const noexcept {
    const GridAxes& axes = field_->axes(level);
    const std::uint32_t number = cell.at[0] + axes[0].cells() * (cell.at[1] + axes[1].cells() * cell.at[2]);
    return number == no_index ? 0 : number;
  }

  // SurfaceQuery, at the finest level.
  /// First touch of a moving point, exact; of a ball, in steps of half its radius, each checked at its end. [servo]
  [[nodiscard]] SweptHit segment(const Segment& motion, double radius, Sides sides, Hint& hint) const noexcept;
  void contacts(const Vec3& position, double radius, Sides sides, Hint& hint, ContactSet& out) const noexcept;
  [[nodiscard]] Foot closest(const Vec3& p, double bound, Hint& hint) const noexcept {
    return view().closest(p, bound, hint.iso);
  }
  /// phi / |grad phi|: a distance to first order near the surface; its gradient is unit. [servo]
  [[nodiscard]] FieldSample eval(const Vec3& p, Hint& hint) const noexcept;
  [[nodiscard]] double skin() const noexcept { return view().skin(); }
  [[nodiscard]] Box bounds() const noexcept { return field_->bounds(); }
  /// Where the isosurface itself is: the cells that it crosses (m). [any]
  [[nodiscard]] const Box& surface_bounds() const noexcept { return surface_bounds_; }

 private:
  IsoSurface() = default;
  void measure();

  std::shared_ptr<const ScalarField> field_;
  double threshold_ = 0.0;
  Inside inside_ = Inside::low;
  double threshold_speed_ = 0.02;
  double typical_slope_ = 0.0;
  Box surface_bounds_;
};
static_assert(SurfaceQuery<IsoSurface>);

}  // namespace asperity
