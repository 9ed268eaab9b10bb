#include "asperity/field/volume/grid_axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace asperity {

namespace {

// Of a cell's width: how far evenly spaced nodes may be off by rounding.
constexpr double even = 1e-9;

}  // namespace

GridAxis::GridAxis(std::vector<double> nodes) : nodes_(std::move(nodes)) {
  const double length = back() - front();
  const double mean = length / cells();
  narrowest_ = length;
  uniform_ = true;
  for (std::uint32_t i = 0; i < cells(); ++i) {
    narrowest_ = std::min(narrowest_, width(i));
    uniform_ = uniform_ && std::abs(node(i) - (front() + i * mean)) <= even * mean;
  }
  if (uniform_) {
    per_bucket_ = 1.0 / mean;
    return;
  }
  // Two pieces a cell keep the search within a piece short where the axis is stretched evenly.
  const std::uint32_t pieces = 2 * cells();
  per_bucket_ = pieces / length;
  buckets_.resize(pieces + 1);
  std::uint32_t cell = 0;
  for (std::uint32_t piece = 0; piece <= pieces; ++piece) {
    const double from = front() + piece / per_bucket_;
    while (cell + 1 < cells() && nodes_[cell + 1] <= from) ++cell;
    buckets_[piece] = cell;
  }
}

Result<GridAxis> GridAxis::build(std::vector<double> nodes) {
  if (nodes.size() < 2 || nodes.size() > (std::size_t{1} << 30)) {
    return bad_value(fmt::format("has {} nodes", nodes.size()), "", "two nodes or more");
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!std::isfinite(nodes[i])) {
      return bad_value("is not finite", fmt::format("node {}", i), "a finite position");
    }
    if (i > 0 && !(nodes[i] > nodes[i - 1])) {
      return bad_value(fmt::format("is {:g} after {:g}", nodes[i], nodes[i - 1]), fmt::format("node {}", i),
                       "positions that increase");
    }
  }
  return GridAxis(std::move(nodes));
}

Result<GridAxis> GridAxis::uniform(double origin, double spacing, std::uint32_t count) {
  if (!std::isfinite(origin) || !std::isfinite(spacing) || !(spacing > 0.0)) {
    return bad_value(fmt::format("starts at {:g} with a spacing of {:g}", origin, spacing), "",
                     "a finite origin and a spacing above 0");
  }
  if (count > (1U << 30)) {
    return bad_value(fmt::format("has {} nodes", count), "", "fewer nodes");
  }
  std::vector<double> nodes(count);
  for (std::uint32_t i = 0; i < count; ++i) nodes[i] = origin + spacing * i;
  return build(std::move(nodes));
}

GridAxis::Place GridAxis::locate(double x) const noexcept {
  const double from = x - nodes_.front();
  if (!(from > 0.0)) return {0, 0.0};
  if (!(x < nodes_.back())) return {cells() - 1, 1.0};
  std::uint32_t cell = 0;
  if (uniform_) {
    const double at = from * per_bucket_;
    cell = std::min(static_cast<std::uint32_t>(at), cells() - 1);
    return {cell, std::clamp(at - cell, 0.0, 1.0)};
  }
  const auto piece = std::min(static_cast<std::size_t>(from * per_bucket_), buckets_.size() - 2);
  std::uint32_t low = buckets_[piece];
  std::uint32_t high = buckets_[piece + 1];
  // The last cell that starts at or before x.
  while (low < high) {
    const std::uint32_t middle = (low + high + 1) / 2;
    if (nodes_[middle] <= x) {
      low = middle;
    } else {
      high = middle - 1;
    }
  }
  // Rounding of the piece's border can be off by one cell.
  while (low > 0 && nodes_[low] > x) --low;
  while (low + 1 < cells() && nodes_[low + 1] <= x) ++low;
  return {low, std::clamp((x - nodes_[low]) / width(low), 0.0, 1.0)};
}

Result<GridAxis> GridAxis::centres() const {
  std::vector<double> middles(cells());
  for (std::uint32_t i = 0; i < cells(); ++i) middles[i] = 0.5 * (node(i) + node(i + 1));
  return build(std::move(middles));
}

GridAxis GridAxis::coarsened() const {
  std::vector<double> nodes;
  for (std::uint32_t i = 0; i < size(); i += 2) nodes.push_back(nodes_[i]);
  if (size() % 2 == 0) nodes.push_back(nodes_.back());
  return GridAxis(std::move(nodes));
}

GridAxis GridAxis::placed(double scale, double offset) const {
  std::vector<double> nodes = nodes_;
  for (double& node : nodes) node = node * scale + offset;
  return GridAxis(std::move(nodes));
}

void GridAxis::slope_weights(std::uint32_t i, double weights[3]) const noexcept {
  if (i == 0 || i == cells()) {
    const double h = width(i == 0 ? 0 : i - 1);
    weights[0] = i == 0 ? 0.0 : -1.0 / h;
    weights[1] = i == 0 ? -1.0 / h : 1.0 / h;
    weights[2] = i == 0 ? 1.0 / h : 0.0;
    return;
  }
  const double before = width(i - 1);
  const double after = width(i);
  const double sum = before + after;
  weights[0] = -after / (before * sum);
  weights[1] = (after - before) / (before * after);
  weights[2] = before / (after * sum);
}

}  // namespace asperity
