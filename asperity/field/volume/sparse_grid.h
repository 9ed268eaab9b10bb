#pragma once
// A signed potential stored near a surface alone (hybrid-surface-2004, "Octree-based data structure").

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "asperity/core/math.h"
#include "asperity/core/result.h"
#include "asperity/field/volume/min_max_octree.h"

namespace asperity {

/// Material of a stored point (hybrid-surface-2004, "Material editing"); what is not a number is the surface's own.
struct PointMaterial {
  static constexpr float own = std::numeric_limits<float>::quiet_NaN();
  float stiffness = own;         ///< N/m, above 0
  float damping = own;           ///< N·s/m, 0 or more
  float static_friction = own;   ///< not below the dynamic one
  float dynamic_friction = own;  ///< 0 or more
  float roughness = own;         ///< level: what the surface's noise is multiplied with; 0 or more
  /// The five in the order above.
  [[nodiscard]] float get(std::size_t channel) const noexcept {
    const float all[] = {stiffness, damping, static_friction, dynamic_friction, roughness};
    return all[channel];
  }
  void set(std::size_t channel, float value) noexcept {
    float* all[] = {&stiffness, &damping, &static_friction, &dynamic_friction, &roughness};
    *all[channel] = value;
  }
};
inline constexpr std::size_t material_channels = 5;
/// "stiffness", "damping", "static_friction", "dynamic_friction", "roughness". [any]
std::span<const char* const> material_channel_names();
/// Whether a number can be a channel's value: finite, above 0 for a stiffness, 0 or more for the others. [any]
bool fits_channel(std::size_t channel, float value) noexcept;

/// 8 x 8 x 8 stored points, x fastest: what builds, edits and files deal in.
struct SparseBlock {
  static constexpr int side = 8;
  static constexpr std::size_t points = 512;
  std::array<std::int32_t, 3> at{};     ///< in blocks; point (i, j, k) of it is node 8 at + (i, j, k)
  std::array<float, points> value{};    ///< m, positive outside
  std::vector<std::uint32_t> face;      ///< closest face of the mesh; empty: not known
  std::vector<PointMaterial> material;  ///< empty: the surface's own
  static constexpr std::size_t index(int i, int j, int k) noexcept {
    return static_cast<std::size_t>(i + side * (j + side * k));
  }
};

/// Everything a sparse grid is made from.
struct SparseSource {
  double voxel = 0.0;          ///< distance of neighbouring nodes (m)
  Vec3 origin = Vec3::Zero();  ///< of node (0, 0, 0) (m); nodes may be negative
  double outside = 0.0;        ///< largest value stored, above 0 (m)
  double inside = 0.0;         ///< smallest value stored, below 0 (m)
  std::vector<SparseBlock> blocks;
};

/// Which brick was read last. A cache in the caller's hands. [servo]
struct SparseHint {
  std::uint64_t owner = 0;             ///< identity of the grid; 0: nothing
  double middle[3] = {0.0, 0.0, 0.0};  ///< of the brick, in cells of the bricks' box
  const void* brick = nullptr;         ///< of the grid whose identity `owner` is; nullptr: none is stored there
};

/// Value and gradient of a potential.
struct Potential {
  double value = 0.0;  ///< m
  Vec3 gradient = Vec3::Zero();
};

/// A potential on a regular grid, kept in bricks of 8 x 8 x 8 cells where it lies within a band around zero; beyond the
/// band it is constant. Each brick repeats its neighbours' nearest points (its apron), so that a query reads one brick.
/// Immutable; queries are const, allocation-free and safe from any thread. An edited copy shares the bricks that did
/// not change.
class SparseGrid {
 public:
  static constexpr int brick_cells = 8;
  static constexpr int brick_side = brick_cells + 3;  ///< points -1 … 9 along each axis
  static constexpr std::size_t brick_points = brick_side * brick_side * brick_side;
  static constexpr std::size_t most_bricks = std::size_t{1} << 26;

  /// What is beyond the band lies on the side that the band's nearest points say. Errors: bad_value (voxel, band, value
  /// or material not finite or out of range, a block given twice, no block), too_large, each with the block's place.
  /// [build]
  static Result<SparseGrid> build(SparseSource source);
  /// The stored points again, in the order of their place. [build]
  [[nodiscard]] SparseSource source() const;
  /// A copy in which these blocks replace the ones at their place; bricks that are not concerned are shared. Errors as
  /// build, and bad_value for a block that is not there. [build]
  [[nodiscard]] Result<SparseGrid> edited(std::vector<SparseBlock> blocks) const;

  /// Tells grids apart, never 0. [any]
  [[nodiscard]] std::uint64_t identity() const noexcept { return identity_; }
  [[nodiscard]] double voxel() const noexcept { return voxel_; }
  /// Position of node (0, 0, 0) as blocks count nodes (m). [any]
  [[nodiscard]] const Vec3& origin() const noexcept { return origin_; }
  /// First corner of the bricks' box (m), and how many there are along each axis. [any]
  [[nodiscard]] const Vec3& lower() const noexcept { return lower_; }
  [[nodiscard]] const std::array<std::uint32_t, 3>& brick_counts() const noexcept { return counts_; }
  [[nodiscard]] Box bounds() const noexcept;
  [[nodiscard]] double outside() const noexcept { return outside_; }
  [[nodiscard]] double inside() const noexcept { return inside_; }
  [[nodiscard]] std::size_t bricks() const noexcept { return bricks_.size(); }
  [[nodiscard]] bool has_faces() const noexcept { return has_faces_; }
  [[nodiscard]] bool has_materials() const noexcept { return has_materials_; }
  /// The greatest stiffness that is stored (N/m); 0: none is. [any]
  [[nodiscard]] float stiffest() const noexcept { return stiffest_; }
  [[nodiscard]] const MinMaxOctree& octree() const noexcept { return octree_; }
  [[nodiscard]] float lowest() const noexcept { return lowest_; }
  [[nodiscard]] float highest() const noexcept { return highest_; }
  /// Bytes of this grid; bricks shared with another are counted in both. [any]
  [[nodiscard]] std::size_t memory_bytes() const noexcept;
  /// What the same box would take with a value at every node (bytes). [any]
  [[nodiscard]] std::size_t dense_bytes() const noexcept;

  /// Trilinear value and the gradient of that. Beyond the band the constant and no gradient. [servo]
  [[nodiscard]] Potential trilinear(const Vec3& p, SparseHint& hint) const noexcept;
  /// As hybrid-surface-2004 has it: the trilinear value, and the gradients of the eight nodes (centre differences)
  /// interpolated, which is not the gradient of the value. [servo]
  [[nodiscard]] Potential node_gradients(const Vec3& p, SparseHint& hint) const noexcept;
  /// The same gradients' mean, those that are shorter counting less. Of a distance each is as long as 1, but shorter
  /// where the difference reaches over an edge of what is nearest: from a voxel off an edge on this is the nearest
  /// face's. Beyond the bricks' box none. [servo]
  [[nodiscard]] Vec3 clear_gradient(const Vec3& p, SparseHint& hint) const noexcept;
  /// The stored point nearest to p: its closest face; no_index where none is known. [servo]
  [[nodiscard]] std::uint32_t face(const Vec3& p, SparseHint& hint) const noexcept;
  /// The eight stored points' materials, interpolated; `own` stands in for what they leave open. [servo]
  [[nodiscard]] PointMaterial material(const Vec3& p, const PointMaterial& own, SparseHint& hint) const noexcept;

  /// Nodes of cell (i, j, k) of the bricks' box and, where `ring` is 1, those around them: 8 or 64 values, x fastest.
  /// [servo]
  void cell_samples(const std::uint32_t cell[3], int ring, double* out) const noexcept;

 private:
  struct Brick {
    float value[brick_points];
    std::vector<std::uint32_t> face;      ///< 512 or none
    std::vector<PointMaterial> material;  ///< 9 x 9 x 9 or none
    bool owns_material = false;           ///< some of its own 512 points have one
  };
  SparseGrid() = default;
  [[nodiscard]] std::size_t table_index(std::uint32_t i, std::uint32_t j, std::uint32_t k) const noexcept {
    return i + static_cast<std::size_t>(counts_[0]) * (j + static_cast<std::size_t>(counts_[1]) * k);
  }
  /// Where p is in its brick: cell along each axis, 0 … 7, and the fraction of it.
  struct Place {
    std::uint32_t cell[3];
    double fraction[3];
  };
  /// The brick of the cell that holds p; nullptr where none is stored, then with hint.owner 0 beyond the bricks' box.
  const Brick* locate(const Vec3& p, SparseHint& hint, Place& place) const noexcept;
  /// Makes the hint that of a place, in cells of the bricks' box; false beyond that.
  bool find_brick(const double at[3], SparseHint& hint) const noexcept;
  /// cell_samples around a place where no brick is stored.
  void far_samples(const SparseHint& hint, const Place& place, int ring, double* out) const noexcept;
  [[nodiscard]] float constant(std::int32_t entry) const noexcept {
    return static_cast<float>(entry == outside_entry ? outside_ : inside_);
  }
  void settle_signs(const std::vector<const SparseBlock*>& blocks);
  void fill(const std::vector<const SparseBlock*>& blocks, const std::vector<bool>& wanted);
  void finish();
  [[nodiscard]] SparseBlock block_of(std::size_t entry) const;

  static constexpr std::int32_t outside_entry = -1;
  static constexpr std::int32_t inside_entry = -2;
  double voxel_ = 0.0;
  double per_voxel_ = 0.0;
  Vec3 origin_ = Vec3::Zero();
  Vec3 lower_ = Vec3::Zero();
  std::array<std::int32_t, 3> first_{};  ///< block of the bricks' box's first corner
  std::array<std::uint32_t, 3> counts_{};
  Vec3 extent_ = Vec3::Zero();  ///< of the bricks' box, in cells
  double outside_ = 0.0;
  double inside_ = 0.0;
  std::vector<std::int32_t> table_;  ///< brick, or outside_entry, inside_entry
  std::vector<std::shared_ptr<const Brick>> bricks_;
  MinMaxOctree octree_;  ///< of leaves of one brick
  bool has_faces_ = false;
  bool has_materials_ = false;
  float stiffest_ = 0.0F;
  float lowest_ = 0.0F;
  float highest_ = 0.0F;
  std::uint64_t identity_ = 0;
};

}  // namespace asperity
