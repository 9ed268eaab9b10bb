#include "asperity/field/volume/scalar_field.h"

#include <algorithm>
#include <cmath>

#include "asperity/core/identity.h"
#include "asperity/core/parallel_for.h"
#include "asperity/field/volume/cubic_kernels.h"

namespace asperity {

namespace {

constexpr std::uint32_t leaf_cells = 4;

/// Least and greatest sample that the cells of each leaf need, for the leaves of layer k.
template <class T>
void leaf_ranges(const ScalarGrid& grid, const std::vector<T>& samples, std::uint32_t ring,
                 const std::array<std::uint32_t, 3>& leaves, std::uint32_t k, std::vector<ValueRange>& ranges) {
  std::uint32_t size[3];
  for (std::size_t a = 0; a < 3; ++a) size[a] = grid.axis(a).size();
  const auto from = [&](std::uint32_t leaf) { return leaf * leaf_cells - std::min(leaf * leaf_cells, ring); };
  const auto to = [&](std::uint32_t leaf, std::size_t a) {
    return std::min(size[a] - 1, (leaf + 1) * leaf_cells + ring);
  };
  for (std::uint32_t z = from(k); z <= to(k, 2); ++z) {
    for (std::uint32_t j = 0; j < leaves[1]; ++j) {
      for (std::uint32_t y = from(j); y <= to(j, 1); ++y) {
        const T* row = samples.data() + grid.index(0, y, z);
        for (std::uint32_t i = 0; i < leaves[0]; ++i) {
          ValueRange& range =
              ranges[i + static_cast<std::size_t>(leaves[0]) * (j + static_cast<std::size_t>(leaves[1]) * k)];
          float low = range.lower;
          float high = range.upper;
          const std::uint32_t end = to(i, 0);
          for (std::uint32_t x = from(i); x <= end; ++x) {
            // Comparisons with what is not a number are false: it is left out.
            const auto value = static_cast<float>(row[x]);
            low = value < low ? value : low;
            high = value > high ? value : high;
          }
          range.lower = low;
          range.upper = high;
        }
      }
    }
  }
}

MinMaxOctree build_octree(const ScalarGrid& grid, CellReconstruction reconstruction) {
  std::array<std::uint32_t, 3> leaves{};
  for (std::size_t a = 0; a < 3; ++a) leaves[a] = (grid.axis(a).cells() + leaf_cells - 1) / leaf_cells;
  std::vector<ValueRange> ranges(static_cast<std::size_t>(leaves[0]) * leaves[1] * leaves[2]);
  const std::uint32_t ring = reconstruction == CellReconstruction::smooth ? 1 : 0;
  // Below this, starting threads takes longer than it saves.
  constexpr std::size_t parallel_samples = 1000000;
  const auto layer = [&](const auto& samples, std::size_t k) {
    leaf_ranges(grid, samples, ring, leaves, static_cast<std::uint32_t>(k), ranges);
  };
  parallel_for(leaves[2], {.threads = grid.size() > parallel_samples ? 0U : 1U},
               [&](std::size_t k) { std::visit([&](const auto& samples) { layer(samples, k); }, grid.samples()); });
  return MinMaxOctree::build(leaves, leaf_cells, std::move(ranges));
}

HermiteWeights hermite_weights(const GridAxis& axis, std::uint32_t cell) noexcept {
  double at_start[3];
  double at_end[3];
  axis.slope_weights(cell, at_start);
  axis.slope_weights(cell + 1, at_end);
  const double third = axis.width(cell) / 3.0;
  return {{third * at_start[0], 1.0 + third * at_start[1], third * at_start[2], 0.0},
          {0.0, -third * at_end[0], 1.0 - third * at_end[1], -third * at_end[2]}};
}

constexpr HermiteWeights even_weights{{-1.0 / 6.0, 1.0, 1.0 / 6.0, 0.0}, {0.0, 1.0 / 6.0, 1.0, -1.0 / 6.0}};

}  // namespace

ScalarField::ScalarField(ScalarGrid grid, CellReconstruction reconstruction)
    : grid_(std::move(grid)), reconstruction_(reconstruction) {
  octree_ = build_octree(*grid_, reconstruction);
  finish();
}

ScalarField::ScalarField(std::unique_ptr<BrickStore> bricks, CellReconstruction reconstruction)
    : bricks_(std::move(bricks)), reconstruction_(reconstruction) {
  finish();
}

ScalarField::ScalarField(std::shared_ptr<const SparseGrid> sparse, CellReconstruction reconstruction)
    : sparse_(std::move(sparse)), reconstruction_(reconstruction) {
  for (std::size_t a = 0; a < 3; ++a) {
    const std::uint32_t nodes = sparse_->brick_counts()[a] * SparseGrid::brick_cells + 1;
    // Its voxel is above 0 and there is at least one brick: this cannot fail.
    sparse_axes_[a] = GridAxis::uniform(sparse_->lower()[static_cast<int>(a)], sparse_->voxel(), nodes).value();
  }
  finish();
}

void ScalarField::finish() {
  identity_ = next_identity();
  const GridAxes& finest = axes();
  for (int a = 0; a < 3; ++a) {
    bounds_.lower[a] = finest[static_cast<std::size_t>(a)].front();
    bounds_.upper[a] = finest[static_cast<std::size_t>(a)].back();
  }
  if (sparse_) {
    per_cell_ = 1.0 / sparse_->voxel();
    for (std::size_t a = 0; a < 3; ++a) last_cell_[static_cast<int>(a)] = sparse_axes_[a].cells() - 1.0;
  }
  narrowest_ = std::min({finest[0].narrowest(), finest[1].narrowest(), finest[2].narrowest()});
  if (reconstruction_ == CellReconstruction::trilinear) return;
  // A coefficient is a weighted mean whose weights sum to 1 and may be below 0: by how much the sum of their sizes
  // exceeds 1 it may leave the samples' range, on both sides together.
  for (int level = 0; level < levels(); ++level) {
    double product = 1.0;
    for (const GridAxis& axis : axes(level)) {
      double most = 1.0;
      for (std::uint32_t cell = 0; cell < axis.cells(); ++cell) {
        const HermiteWeights w = hermite_weights(axis, cell);
        double first = 0.0;
        double second = 0.0;
        for (int i = 0; i < 4; ++i) {
          first += std::abs(w.first[i]);
          second += std::abs(w.second[i]);
        }
        most = std::max({most, first, second});
      }
      product *= most;
    }
    overshoot_ = std::max(overshoot_, 0.5 * (product - 1.0));
  }
}

std::size_t ScalarField::memory_bytes() const noexcept {
  if (bricks_) return sizeof(*this) + bricks_->resident_bytes();
  if (sparse_) return sizeof(*this) + sparse_->memory_bytes();
  return sizeof(*this) + grid_->memory_bytes() + octree_.memory_bytes();
}

CellIndex ScalarField::grid_cell(int level, const Vec3& p) const noexcept {
  const GridAxes& a = axes(level);
  return {{a[0].locate(p.x()).cell, a[1].locate(p.y()).cell, a[2].locate(p.z()).cell}};
}

template <std::uint32_t Ring>
void ScalarField::fetch_samples(const CellIndex& cell, double* out) const noexcept {
  constexpr std::uint32_t count = 2 + 2 * Ring;
  const ScalarGrid& grid = *grid_;
  std::uint32_t at[3][count];
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::uint32_t n = 0; n < count; ++n) {
      const std::uint32_t i = cell.at[a] + n;
      at[a][n] = std::min(i > Ring ? i - Ring : 0, grid.axis(a).size() - 1);
    }
  }
  const bool together = at[0][count - 1] - at[0][0] == count - 1;
  std::visit(
      [&](const auto& samples) {
        for (std::uint32_t k = 0; k < count; ++k) {
          for (std::uint32_t j = 0; j < count; ++j) {
            const auto* row = samples.data() + grid.index(0, at[1][j], at[2][k]);
            if (together) {
              for (std::uint32_t i = 0; i < count; ++i) *out++ = static_cast<double>(row[at[0][0] + i]);
            } else {
              for (std::uint32_t i = 0; i < count; ++i) *out++ = static_cast<double>(row[at[0][i]]);
            }
          }
        }
      },
      grid.samples());
}

bool ScalarField::gather(int level, const CellIndex& cell, CellPolynomial& out) const noexcept {
  out.owner = 0;
  out.known = false;
  const bool smooth = reconstruction_ == CellReconstruction::smooth;
  out.degree = smooth ? 3 : 1;
  if (sparse_) {
    sparse_->cell_samples(cell.at, smooth ? 1 : 0, out.coefficient);
    return true;
  }
  if (bricks_ && smooth) return bricks_->samples(level, cell, out.coefficient);
  if (bricks_) {
    double samples[64];
    if (!bricks_->samples(level, cell, samples)) return false;
    for (int corner = 0; corner < 8; ++corner) {
      out.coefficient[corner] = samples[(1 + (corner & 1)) + 4 * (1 + (corner >> 1 & 1)) + 16 * (1 + (corner >> 2))];
    }
  } else if (smooth) {
    fetch_samples<1>(cell, out.coefficient);
  } else {
    fetch_samples<0>(cell, out.coefficient);
  }
  return true;
}

void ScalarField::convert(int level, const CellIndex& cell, CellPolynomial& out) const noexcept {
  const GridAxes& grid_axes = axes(level);
  if (reconstruction_ == CellReconstruction::smooth && sparse_) {
    // Evenly spaced, and constant where it ends.
    cubic_kernels.to_bernstein({even_weights, even_weights, even_weights}, out.coefficient);
  } else if (reconstruction_ == CellReconstruction::smooth) {
    cubic_kernels.to_bernstein({hermite_weights(grid_axes[0], cell.at[0]), hermite_weights(grid_axes[1], cell.at[1]),
                                hermite_weights(grid_axes[2], cell.at[2])},
                               out.coefficient);
  }
  out.owner = identity_;
  out.cell = cell;
  out.level = level;
  for (int a = 0; a < 3; ++a) {
    const GridAxis& axis = grid_axes[static_cast<std::size_t>(a)];
    const std::uint32_t i = cell.at[a];
    out.lower[a] = axis.node(i);
    out.width[a] = axis.width(i);
  }
  out.finish();
}

bool ScalarField::load(int level, const CellIndex& cell, CellPolynomial& out) const noexcept {
  if (out.owner == identity_ && out.cell == cell && out.level == level) return out.known;
  if (!gather(level, cell, out)) return false;
  convert(level, cell, out);
  return out.known;
}

CellSide ScalarField::approach(int level, const CellIndex& cell, double threshold, CellPolynomial& out) const noexcept {
  double low = 0.0;
  double high = 0.0;
  if (out.owner == identity_ && out.cell == cell && out.level == level) {
    if (!out.known) return CellSide::unknown;
    low = out.low();
    high = out.high();
  } else {
    if (!gather(level, cell, out)) return CellSide::unknown;
    const int count = out.degree == 1 ? 8 : 64;
    low = high = out.coefficient[0];
    double sum = 0.0;
    for (int i = 0; i < count; ++i) {
      const double c = out.coefficient[i];
      low = c < low ? c : low;
      high = c > high ? c : high;
      sum += c;
    }
    if (!std::isfinite(sum)) return CellSide::unknown;
    const double beyond = overshoot_ * (high - low);
    low -= beyond;
    high += beyond;
    if (low <= threshold && threshold <= high) {
      convert(level, cell, out);
      if (!out.known) return CellSide::unknown;
      low = out.low();
      high = out.high();
    }
  }
  if (low > threshold) return CellSide::above;
  if (high < threshold) return CellSide::below;
  return CellSide::near;
}

bool ScalarField::sample(int level, const Vec3& p, CellPolynomial& cache, FieldJet& out) const noexcept {
  if (!contains(p) || !load(level, cell_of(level, p), cache)) return false;
  out = cache.gradient(p);
  return true;
}

}  // namespace asperity
