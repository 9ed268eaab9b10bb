#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "asperity/core/result.h"

namespace asperity {

/// Where the samples of a grid lie along one axis (m): evenly spaced, or stretched as simulations need it.
class GridAxis {
 public:
  /// A cell of the axis and the place within it.
  struct Place {
    std::uint32_t cell = 0;
    double fraction = 0.0;  ///< 0 … 1
  };

  GridAxis() = default;
  /// Errors: bad_value (fewer than two nodes, not finite, not strictly increasing), with the node's number as place.
  /// [build]
  static Result<GridAxis> build(std::vector<double> nodes);
  /// `count` nodes from `origin` on. Errors: bad_value (fewer than two, spacing not above 0). [build]
  static Result<GridAxis> uniform(double origin, double spacing, std::uint32_t count);

  [[nodiscard]] std::uint32_t size() const noexcept { return static_cast<std::uint32_t>(nodes_.size()); }
  [[nodiscard]] std::uint32_t cells() const noexcept { return size() - 1; }
  [[nodiscard]] double node(std::uint32_t i) const noexcept { return nodes_[i]; }
  [[nodiscard]] double width(std::uint32_t cell) const noexcept { return nodes_[cell + 1] - nodes_[cell]; }
  [[nodiscard]] double front() const noexcept { return nodes_.front(); }
  [[nodiscard]] double back() const noexcept { return nodes_.back(); }
  [[nodiscard]] std::span<const double> nodes() const noexcept { return nodes_; }
  [[nodiscard]] bool is_uniform() const noexcept { return uniform_; }
  [[nodiscard]] double narrowest() const noexcept { return narrowest_; }  ///< cell (m)
  /// Cell that holds x and the place in it; x beyond an end is taken to the end. Constant time on an evenly spaced
  /// axis, a short binary search on a stretched one. [servo]
  [[nodiscard]] Place locate(double x) const noexcept;

  /// Middles of the cells: where cell data sit. Of an axis of two nodes: an error, one sample spans nothing. [build]
  [[nodiscard]] Result<GridAxis> centres() const;
  /// Every second node, both ends kept: the next coarser level. [build]
  [[nodiscard]] GridAxis coarsened() const;
  /// Nodes scaled, then moved (m). `scale` above 0. [build]
  [[nodiscard]] GridAxis placed(double scale, double offset) const;
  /// Centre differences of second order on stretched axes: weights of nodes i-1, i, i+1 in the slope at node i; at an
  /// end, the secant's. [servo]
  void slope_weights(std::uint32_t node, double weights[3]) const noexcept;
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return nodes_.capacity() * sizeof(double) + buckets_.capacity() * sizeof(std::uint32_t);
  }

 private:
  explicit GridAxis(std::vector<double> nodes);

  std::vector<double> nodes_;
  std::vector<std::uint32_t> buckets_;  ///< of a stretched axis: first cell that each even piece meets
  double per_bucket_ = 0.0;             ///< 1 / length of a piece, or of a cell
  double narrowest_ = 0.0;
  bool uniform_ = false;
};

}  // namespace asperity
