#pragma once

#include <memory>
#include <optional>

#include "asperity/field/brick/store.h"
#include "asperity/field/volume/cell_polynomial.h"
#include "asperity/field/volume/min_max_octree.h"
#include "asperity/field/volume/scalar_grid.h"
#include "asperity/field/volume/sparse_grid.h"

namespace asperity {

/// Where the field over a cell lies.
enum class CellSide : std::uint8_t {
  unknown,  ///< a sample is not here or not a number
  below,    ///< below the threshold throughout
  above,
  near,  ///< may pass it
};

/// A scalar field in space: samples on a rectilinear grid in memory, in bricks of a file, or near a surface alone, and
/// what lies between them. Immutable; queries are const, allocation-free and safe from any thread.
class ScalarField {
 public:
  /// In memory. Builds the octree (in parallel where it is large). [build]
  explicit ScalarField(ScalarGrid grid, CellReconstruction reconstruction = CellReconstruction::smooth);
  /// From bricks. [build]
  explicit ScalarField(std::unique_ptr<BrickStore> bricks,
                       CellReconstruction reconstruction = CellReconstruction::smooth);
  /// A signed potential. Beyond its band it is constant. [build]
  explicit ScalarField(std::shared_ptr<const SparseGrid> sparse,
                       CellReconstruction reconstruction = CellReconstruction::smooth);

  [[nodiscard]] CellReconstruction reconstruction() const noexcept { return reconstruction_; }
  /// Tells fields apart, never 0. [any]
  [[nodiscard]] std::uint64_t identity() const noexcept { return identity_; }
  /// 1 for a field in memory; level 0 is the finest.
  [[nodiscard]] int levels() const noexcept { return bricks_ ? bricks_->levels() : 1; }
  [[nodiscard]] const GridAxes& axes(int level = 0) const noexcept {
    return bricks_ ? bricks_->axes(level) : sparse_ ? sparse_axes_ : grid_->axes();
  }
  [[nodiscard]] const MinMaxOctree& octree(int level = 0) const noexcept {
    return bricks_ ? bricks_->octree(level) : sparse_ ? sparse_->octree() : octree_;
  }
  [[nodiscard]] Box bounds() const noexcept { return bounds_; }
  [[nodiscard]] double lowest() const noexcept {
    return bricks_ ? bricks_->lowest() : sparse_ ? static_cast<double>(sparse_->lowest()) : grid_->lowest();
  }
  [[nodiscard]] double highest() const noexcept {
    return bricks_ ? bricks_->highest() : sparse_ ? static_cast<double>(sparse_->highest()) : grid_->highest();
  }
  /// Width of the narrowest cell (m). [any]
  [[nodiscard]] double narrowest_cell() const noexcept { return narrowest_; }
  [[nodiscard]] const ScalarGrid* grid() const noexcept { return grid_ ? &*grid_ : nullptr; }
  [[nodiscard]] const SparseGrid* sparse() const noexcept { return sparse_.get(); }
  [[nodiscard]] const BrickStore* bricks() const noexcept { return bricks_.get(); }
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

  /// Whether the field may take the value `threshold` in a node of the octree. No false negatives. [servo]
  [[nodiscard]] bool may_cross(int level, const MinMaxOctree::Node& node, double threshold) const noexcept {
    const ValueRange& range = octree(level).range(node);
    const double lower = static_cast<double>(range.lower);
    const double upper = static_cast<double>(range.upper);
    const double beyond = overshoot_ * (upper - lower);
    return lower - beyond <= threshold && threshold <= upper + beyond;
  }
  [[nodiscard]] bool contains(const Vec3& p) const noexcept {
    return (p.array() >= bounds_.lower.array()).all() && (p.array() <= bounds_.upper.array()).all();
  }
  /// The cell that holds p (taken to the border where p is beyond it). [servo]
  [[nodiscard]] CellIndex cell_of(int level, const Vec3& p) const noexcept {
    if (!sparse_) return grid_cell(level, p);
    CellIndex cell;
    for (int a = 0; a < 3; ++a) {
      const double u = (p[a] - bounds_.lower[a]) * per_cell_;
      // Not a number is taken to the border as well.
      const double within = u > 0.0 ? (u < last_cell_[a] ? u : last_cell_[a]) : 0.0;
      cell.at[a] = static_cast<std::uint32_t>(static_cast<std::int32_t>(within));
    }
    return cell;
  }
  /// The field over a cell; keeps what `out` already holds when it is the same. False where its samples are not here
  /// or not numbers. [servo]
  bool load(int level, const CellIndex& cell, CellPolynomial& out) const noexcept;
  /// Where a cell's field is with regard to a threshold, as far as its samples tell; loads the polynomial only where
  /// they leave that open (`near`). Cheaper than load along a motion that meets nothing. [servo]
  [[nodiscard]] CellSide approach(int level, const CellIndex& cell, double threshold,
                                  CellPolynomial& out) const noexcept;
  /// Value and gradient at p. False outside the volume or where nothing is known. [servo]
  bool sample(int level, const Vec3& p, CellPolynomial& cache, FieldJet& out) const noexcept;

  /// For fields in bricks, see BrickStore; without effect, and level 0, for those in memory. [servo]
  void enter() const noexcept {
    if (bricks_) bricks_->enter();
  }
  void leave() const noexcept {
    if (bricks_) bricks_->leave();
  }
  [[nodiscard]] int ready_level(const Box& box, int finest = 0) const noexcept {
    return bricks_ ? bricks_->ready_level(box, finest) : 0;
  }

 private:
  [[nodiscard]] CellIndex grid_cell(int level, const Vec3& p) const noexcept;
  void finish();
  /// Of a grid in memory: the cell's own nodes and `Ring` more on every side, where the grid ends its last ones again.
  template <std::uint32_t Ring>
  void fetch_samples(const CellIndex& cell, double* out) const noexcept;
  /// Samples of a cell as the reconstruction needs them, 8 or 64. False where they are not here.
  bool gather(int level, const CellIndex& cell, CellPolynomial& out) const noexcept;
  void convert(int level, const CellIndex& cell, CellPolynomial& out) const noexcept;

  std::optional<ScalarGrid> grid_;
  std::unique_ptr<BrickStore> bricks_;
  std::shared_ptr<const SparseGrid> sparse_;
  GridAxes sparse_axes_;
  double per_cell_ = 0.0;  ///< of the sparse grid (1/m)
  Vec3 last_cell_ = Vec3::Zero();
  MinMaxOctree octree_;
  Box bounds_;
  CellReconstruction reconstruction_;
  std::uint64_t identity_ = 0;
  double narrowest_ = 0.0;
  double overshoot_ = 0.0;  ///< by how much of a node's range the field may leave it
};

}  // namespace asperity
