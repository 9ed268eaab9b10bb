#pragma once
// Isosurfaces of scalar fields, touched directly: no triangles anywhere.

#include <memory>
#include <vector>

#include "asperity/core/names.h"
#include "asperity/core/units.h"
#include "asperity/field/volume/scalar_field.h"
#include "asperity/surface/view.h"

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

/// A point of an isosurface. Between cells it has more than one front: the one that holds it, and the mean of all.
struct IsoSpot {
  Vec3 point = Vec3::Zero();
  Vec3 front = Vec3::Zero();  ///< unit
  Vec3 away = Vec3::Zero();   ///< unit, on the side touched: off all cells that meet at the point
};

/// An isosurface as one tick sees it, a level of the field and a threshold: see SurfaceView. Places are points. [servo]
struct IsoView {
  using Spot = IsoSpot;

  const ScalarField* field = nullptr;
  int level = 0;
  double threshold = 0.0;
  double sigma = 1.0;  ///< 1 where low values are inside, -1 where high ones are: phi = sigma (value - threshold)
  CellCache* cells = nullptr;
  WorkMeter* work = nullptr;  ///< as of SurfaceCache

  /// The field over the cell that holds p; none outside the volume and where nothing is known.
  [[nodiscard]] const CellPolynomial* over(const Vec3& p) const noexcept {
    if (const CellPolynomial* known = cells->around(field->identity(), level, p)) return known;
    if (!field->contains(p)) return nullptr;
    const CellIndex index = field->cell_of(level, p);
    CellPolynomial& slot = cells->slot(field->identity(), level, index);
    return field->load(level, index, slot) ? &slot : nullptr;
  }
  /// Value and gradient of the field itself. False outside the volume and where nothing is known.
  bool sample(const Vec3& p, FieldJet& out) const noexcept {
    const CellPolynomial* cell = over(p);
    if (cell == nullptr) return false;
    out = cell->gradient(p);
    return true;
  }
  /// The first place where the motion passes the threshold after fraction `from`, found cell by cell (Amanatides and
  /// Woo 1987) by the exact root of the cell's polynomial (Parker et al. 1998, Marmitt et al. 2004); cells that the
  /// octree excludes are not visited. A start on the threshold counts as outside. Places outside the volume, or where
  /// nothing is known, hold no surface.
  [[nodiscard]] IsoCrossing first_crossing(const Segment& motion, double from = 0.0) const noexcept;
  /// The first crossing of a kind: into the inside from `front`, either way from `both`. The normal is zero where the
  /// field has no slope.
  [[nodiscard]] SweptHit first_touch(const Segment& motion, Sides sides) const noexcept;
  /// Cells in order of distance, dismissed by bounds of the field over them and their parts; what is left leads
  /// downhill by Newton's method. Of several places within an eighth of a cell and half of the distance, all nearer
  /// than what else there is, it may be another than the nearest.
  [[nodiscard]] Foot nearest(const Vec3& p, double bound, const Place& start = {}) const noexcept;
  /// The same to rounding where the foot lies within one cell, as balls need it: see refined(). What it took and found
  /// is kept, where there is room for it.
  [[nodiscard]] Foot nearest_exactly(const Vec3& p, double bound, const Place& start = {}) const noexcept;
  /// A foot of `p` as exactly as the cell's polynomial tells it, where it lies within one cell: as far as a walk leaves
  /// it, where the surface is bent about as much as a ball around p is round, the direction to it is not known to what
  /// a ball at rest takes.
  [[nodiscard]] Foot refined(const Foot& foot, const Vec3& p) const noexcept;
  /// By Newton's method within one cell, from `foot` on and no more than a share of the cell from it: whether it comes
  /// to rest there. `room`: the least curvature of half the squared distance along the surface there; 1 where it is
  /// flat, 0 where it is bent as a ball around p is.
  bool settle(Foot& foot, const Vec3& p, double farthest, double* room = nullptr) const noexcept;
  static constexpr double left_by_walks = 0.05;  ///< of a cell: how far off a foot a walk may end
  [[nodiscard]] IsoSpot at(const Place& place, const Vec3& normal) const noexcept {
    return {place.at, normal, place.side() * normal};
  }
  /// Every move is one that a point could make through free space just off the surface: certified by the bounds of the
  /// cells around it, or searched exactly; none passes a sheet, however near it is. The distance to the goal falls with
  /// every move.
  DescentEnd descend(Place& place, IsoSpot& spot, const Goal& goal) const noexcept;
  bool launch(const Place& place, const IsoSpot& spot, Vec3& from) const noexcept;
  /// The gradient of phi at p, which is on or near the surface, unit; zero where there is none.
  [[nodiscard]] Vec3 outward(const Vec3& p) const noexcept;
  [[nodiscard]] Vec3 front(const Foot& foot) const noexcept { return outward(foot.point); }
  /// How the front normal changes along the surface at a place (1/m): symmetric, 0 along the normal.
  [[nodiscard]] Mat3 bend_at(const Vec3& point) const noexcept;
  /// phi / |grad phi|: a distance to first order near the surface; its gradient is unit.
  [[nodiscard]] FieldSample eval(const Vec3& p) const noexcept;
  /// Distance that keeps a resting probe off the surface (m).
  [[nodiscard]] double skin() const noexcept { return 1e-6 * field->narrowest_cell(); }
  [[nodiscard]] double grain() const noexcept { return field->narrowest_cell(); }
  [[nodiscard]] static bool has_folds() noexcept { return false; }
  /// The nearest point is found to within a share of a cell: nearer, the surface's own normal tells the direction.
  [[nodiscard]] double direction_from() const noexcept { return 0.05 * grain(); }
  /// Number of a cell, for messages and traces; never no_index.
  [[nodiscard]] std::uint32_t element_of(const CellIndex& cell) const noexcept {
    const GridAxes& axes = field->axes(level);
    const std::uint32_t number = cell.at[0] + axes[0].cells() * (cell.at[1] + axes[1].cells() * cell.at[2]);
    return number == no_index ? 0 : number;
  }
  [[nodiscard]] std::uint32_t element_at(const Vec3& p) const noexcept {
    const CellPolynomial* known = cells->around(field->identity(), level, p);
    return element_of(known != nullptr ? known->cell : field->cell_of(level, p));
  }
};
static_assert(SurfaceView<IsoView>);

/// The threshold that an isosurface has at a time.
struct ThresholdStep {
  Seconds time{0.0};
  double threshold = 0.0;
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
  /// The same at once, without looking at the volume again: for what is changed again and again while it is touched.
  /// The typical slope stays what it was, and surface_bounds() become the field's. Errors: bad_value (beyond the
  /// field's range). [build]
  [[nodiscard]] Result<IsoSurface> moved_to(double threshold) const;
  /// The same with a threshold that changes by the probe's clock: from its own at time 0 to that of each step at its
  /// time, evenly in between, and as the last step leaves it from there on. Errors: bad_value naming the step (times
  /// that do not rise from 0, thresholds that the field nowhere reaches). [build]
  [[nodiscard]] Result<IsoSurface> with_schedule(std::vector<ThresholdStep> steps) const;

  [[nodiscard]] const ScalarField& field() const noexcept { return *field_; }
  [[nodiscard]] const std::shared_ptr<const ScalarField>& shared_field() const noexcept { return field_; }
  [[nodiscard]] double threshold() const noexcept { return threshold_; }
  /// That of its schedule. [servo]
  [[nodiscard]] double threshold_at(Seconds time) const noexcept {
    return schedule_.empty() ? threshold_ : scheduled(time);
  }
  [[nodiscard]] const std::vector<ThresholdStep>& schedule() const noexcept { return schedule_; }
  [[nodiscard]] Inside inside() const noexcept { return inside_; }
  [[nodiscard]] double threshold_speed() const noexcept { return threshold_speed_; }
  /// Typical length of the field's gradient on the surface, by the field's unit and metre. [any]
  [[nodiscard]] double typical_slope() const noexcept { return typical_slope_; }
  /// The finest level at the surface's own threshold. [servo]
  [[nodiscard]] IsoView view(CellCache& cells) const noexcept { return view(cells, 0, threshold_); }
  [[nodiscard]] IsoView view(SurfaceCache& cache) const noexcept { return view(cache, 0, threshold_); }
  [[nodiscard]] IsoView view(CellCache& cells, int level, double threshold) const noexcept {
    return {field_.get(), level, threshold, inside_ == Inside::low ? 1.0 : -1.0, &cells};
  }
  [[nodiscard]] IsoView view(SurfaceCache& cache, int level, double threshold) const noexcept {
    IsoView felt = view(cache.cells, level, threshold);
    felt.work = cache.work;
    return felt;
  }
  [[nodiscard]] double skin() const noexcept { return 1e-6 * field_->narrowest_cell(); }
  [[nodiscard]] Box bounds() const noexcept { return field_->bounds(); }
  /// Where the isosurface itself is: the cells that it crosses (m). [any]
  [[nodiscard]] const Box& surface_bounds() const noexcept { return surface_bounds_; }

 private:
  IsoSurface() = default;
  void measure();
  [[nodiscard]] double scheduled(Seconds time) const noexcept;

  std::shared_ptr<const ScalarField> field_;
  double threshold_ = 0.0;
  Inside inside_ = Inside::low;
  double threshold_speed_ = 0.02;
  double typical_slope_ = 0.0;
  std::vector<ThresholdStep> schedule_;
  Box surface_bounds_;
};

}  // namespace asperity
