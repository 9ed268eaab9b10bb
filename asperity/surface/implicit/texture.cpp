#include "asperity/surface/implicit/texture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "asperity/core/parallel_for.h"
#include "asperity/core/rng.h"
#include "asperity/field/volume/places.h"
#include "asperity/geometry/closest_point.h"
#include "asperity/surface/iso/surface.h"
#include "asperity/surface/walk.h"

namespace asperity {

namespace {

constexpr int side = SparseBlock::side;
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// Finaliser of SplitMix64 (Steele, Lea and Flood 2014): every bit of the answer depends on every bit of x.
constexpr std::uint64_t mixed(std::uint64_t x) noexcept {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27U)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31U);
}

/// In (0, 1).
constexpr double uniform_of(std::uint64_t bits) noexcept {
  return (static_cast<double>(bits >> 11U) + 0.5) * 0x1p-53;
}

/// Improved noise (Perlin 2002) over a permutation of its own; repeats after 256 lattice cells.
class LatticeNoise {
 public:
  /// What no value exceeds: the most that eight corners, each with the edge direction that suits it best, add up to
  /// (1.036354, found numerically).
  static constexpr double bound = 1.0364;

  explicit LatticeNoise(std::uint64_t seed) {
    for (std::uint32_t i = 0; i < period; ++i) order_[i] = static_cast<std::uint8_t>(i);
    Rng rng(seed);
    for (std::uint32_t i = period - 1; i > 0; --i) std::swap(order_[i], order_[rng.below(i + 1)]);
  }

  [[nodiscard]] double operator()(const Vec3& p) const noexcept {
    std::uint32_t cell[3];
    double f[3];
    double fade[3];
    for (int a = 0; a < 3; ++a) {
      const double x = p[a] - period * std::floor(p[a] / period);
      if (!(x >= 0.0 && x <= period)) return not_a_number;
      cell[a] = static_cast<std::uint32_t>(x);
      f[a] = x - cell[a];
      fade[a] = f[a] * f[a] * f[a] * (f[a] * (f[a] * 6.0 - 15.0) + 10.0);
    }
    double sum = 0.0;
    for (std::uint32_t corner = 0; corner < 8; ++corner) {
      const std::uint32_t up[3] = {corner & 1U, corner >> 1U & 1U, corner >> 2U};
      double weight = 1.0;
      for (int a = 0; a < 3; ++a) weight *= up[a] != 0 ? fade[a] : 1.0 - fade[a];
      const std::uint32_t hash = at(at(at(cell[0] + up[0]) + cell[1] + up[1]) + cell[2] + up[2]);
      sum += weight * edge_product(hash, f[0] - up[0], f[1] - up[1], f[2] - up[2]);
    }
    return sum;
  }

 private:
  static constexpr std::uint32_t period = 256;
  [[nodiscard]] std::uint32_t at(std::uint32_t i) const noexcept { return order_[i & (period - 1)]; }
  /// With the direction from the cell's middle to one of its twelve edges.
  static double edge_product(std::uint32_t hash, double x, double y, double z) noexcept {
    const std::uint32_t h = hash & 15U;
    const double u = h < 8 ? x : y;
    const double v = h < 4 ? y : h == 12 || h == 14 ? x : z;
    return ((h & 1U) == 0 ? u : -u) + ((h & 2U) == 0 ? v : -v);
  }

  std::array<std::uint8_t, period> order_{};
};

/// Blocks shared out over all cores; `from` and `to`: their part of the whole.
ParallelSettings blocks_shared(std::string_view what, double from, double to, const Progress& progress) {
  return {.grain = 16, .progress = &progress, .what = what, .from = from, .to = to};
}

/// The blocks around each block.
class Neighbours {
 public:
  /// Blocks are in the order of their place, as SparseGrid::source has them.
  explicit Neighbours(const std::vector<SparseBlock>& blocks) : around_(blocks.size()) {
    const auto before = [](const SparseBlock& block, const std::array<std::int32_t, 3>& at) {
      return std::lexicographical_compare(block.at.rbegin(), block.at.rend(), at.rbegin(), at.rend());
    };
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      for (int n = 0; n < 27; ++n) {
        const std::array<std::int32_t, 3> at = {blocks[b].at[0] + n % 3 - 1, blocks[b].at[1] + n / 3 % 3 - 1,
                                                blocks[b].at[2] + n / 9 - 1};
        const auto found = std::lower_bound(blocks.begin(), blocks.end(), at, before);
        around_[b][static_cast<std::size_t>(n)] =
            found != blocks.end() && found->at == at ? static_cast<std::int32_t>(found - blocks.begin()) : -1;
      }
    }
  }
  /// 27, x fastest, itself in the middle; -1: none.
  [[nodiscard]] const std::array<std::int32_t, 27>& of(std::size_t block) const noexcept { return around_[block]; }

 private:
  std::vector<std::array<std::int32_t, 27>> around_;
};

constexpr int padded_side = side + 2;
/// A block and one point around it: place of point (i, j, k), -1 … 8.
constexpr std::size_t padded_index(int i, int j, int k) noexcept {
  return static_cast<std::size_t>(i + 1 + padded_side * (j + 1 + padded_side * (k + 1)));
}
template <class T>
using Padded = std::array<T, static_cast<std::size_t>(padded_side) * padded_side * padded_side>;

/// `stored(block, point)` where there is a block, `beyond(n)` where neighbour n is none.
template <class T, class Stored, class Beyond>
void pad(const std::array<std::int32_t, 27>& around, Padded<T>& out, const Stored& stored, const Beyond& beyond) {
  std::array<T, 27> missing;
  for (int n = 0; n < 27; ++n) {
    if (around[static_cast<std::size_t>(n)] < 0) missing[static_cast<std::size_t>(n)] = beyond(n);
  }
  std::size_t to = 0;
  for_each_in_cube(-1, side + 1, [&](int i, int j, int k) {
    const int x = (i + side) / side;
    const int y = (j + side) / side;
    const int z = (k + side) / side;
    const auto n = static_cast<std::size_t>(x + 3 * (y + 3 * z));
    out[to++] = around[n] < 0 ? missing[n]
                              : stored(static_cast<std::size_t>(around[n]),
                                       SparseBlock::index(i - (x - 1) * side, j - (y - 1) * side, k - (z - 1) * side));
  });
}

/// Place of a point in its block.
std::array<int, 3> place_in_block(std::size_t point) noexcept {
  const auto n = static_cast<int>(point);
  return {n % side, n / side % side, n / side / side};
}

Vec3 node_position(const SparseSource& source, const SparseBlock& block, std::size_t point) noexcept {
  Vec3 node;
  for (std::size_t a = 0, rest = point; a < 3; ++a, rest /= side)
    node[static_cast<int>(a)] =
        static_cast<double>(side * std::int64_t{block.at[a]}) + static_cast<double>(rest % side);
  return source.origin + source.voxel * node;
}

/// Tells nodes apart over two million along each axis, whatever blocks are stored around them.
std::uint64_t node_number(const SparseBlock& block, std::size_t point) noexcept {
  std::uint64_t number = 0;
  for (std::size_t a = 0, rest = point; a < 3; ++a, rest /= side) {
    const std::int64_t node = side * std::int64_t{block.at[a]} + static_cast<std::int64_t>(rest % side);
    number |= (static_cast<std::uint64_t>(node) & 0x1fffffU) << (21U * a);
  }
  return number;
}

/// Neither at the band's constant outside nor inside.
bool within_band(const SparseSource& source, float value) noexcept {
  return value < static_cast<float>(source.outside) && value > static_cast<float>(source.inside);
}

struct AppliedHeights {
  double lowest = infinity;  ///< at points within a voxel of the surface
  double highest = -infinity;
  double up = 0.0;  ///< the largest anywhere in the band, outwards and inwards
  double down = 0.0;
  [[nodiscard]] double largest() const noexcept { return std::max(up, down); }
  void include(const AppliedHeights& other) noexcept {
    lowest = std::min(lowest, other.lowest);
    highest = std::max(highest, other.highest);
    up = std::max(up, other.up);
    down = std::max(down, other.down);
  }
};

Result<AppliedHeights> apply(const SparseSource& before, const PointHeight& height, SparseSource& after,
                             const Progress& progress) {
  struct PerBlock : AppliedHeights {
    std::size_t bad = SparseBlock::points;
    double bad_height = 0.0;
  };
  const double limit = std::min(before.outside, -before.inside) - 2.0 * before.voxel;
  std::vector<PerBlock> found(before.blocks.size());
  parallel_for(before.blocks.size(), blocks_shared("texturing", 0.0, 0.3, progress), [&](std::size_t b) {
    const SparseBlock& block = before.blocks[b];
    PerBlock& here = found[b];
    for (std::size_t point = 0; point < SparseBlock::points; ++point) {
      if (!within_band(before, block.value[point])) continue;
      double h = height(node_position(before, block, point), block.face.empty() ? no_index : block.face[point],
                        node_number(block, point));
      if (!block.material.empty() && !std::isnan(block.material[point].roughness))
        h *= static_cast<double>(block.material[point].roughness);
      if (!std::isfinite(h) || (h != 0.0 && !(std::abs(h) <= limit))) {
        here.bad = point;
        here.bad_height = h;
        return;
      }
      const double value = static_cast<double>(block.value[point]);
      const bool at_surface = std::abs(value) <= before.voxel;
      here.include({at_surface ? h : infinity, at_surface ? h : -infinity, h, -h});
      after.blocks[b].value[point] = static_cast<float>(std::clamp(value - h, before.inside, before.outside));
    }
  });
  AppliedHeights all;
  for (std::size_t b = 0; b < found.size(); ++b) {
    const PerBlock& here = found[b];
    if (here.bad < SparseBlock::points) {
      const Vec3 p = 1e3 * node_position(before, before.blocks[b], here.bad);
      const std::string place = fmt::format("texture at ({:.6g}, {:.6g}, {:.6g}) mm", p.x(), p.y(), p.z());
      if (!std::isfinite(here.bad_height))
        return bad_value("gives a height that is not a finite number", place, "finite heights");
      return bad_value(
          fmt::format("gives a height of {:.6g} mm", 1e3 * here.bad_height), place,
          limit > 0.0
              ? fmt::format("heights of up to {:.6g} mm up or down (the stored band less two voxels), or a wider band",
                            1e3 * limit)
              : std::string("a stored band of more than two voxels on either side"));
    }
    all.include(here);
  }
  if (!(all.lowest <= all.highest)) all.lowest = all.highest = 0.0;
  return all;
}

/// Divided by its own slope where it is near zero; from one voxel to four the exponent of the slope falls to 0, so that
/// what is far off stays as it was. With the slope taken as 1/2 at least, that rises with the potential everywhere.
void normalise(const SparseGrid& grid, SparseSource& source, const Progress& progress) {
  constexpr double least_slope = 0.5;
  constexpr double full_until = 1.0;
  constexpr double none_from = 4.0;
  const Neighbours neighbours(source.blocks);
  std::vector<std::array<float, SparseBlock::points>> old(source.blocks.size());
  for (std::size_t b = 0; b < old.size(); ++b) old[b] = source.blocks[b].value;
  parallel_for(old.size(), blocks_shared("normalising", 0.3, 0.7, progress), [&](std::size_t b) {
    SparseBlock& block = source.blocks[b];
    Padded<float> value;
    SparseHint hint;
    const auto beyond = [&](int n) {
      const Vec3 blocks(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
      const Vec3 middle = node_position(source, block, SparseBlock::index(4, 4, 4)) + side * source.voxel * blocks;
      return static_cast<float>(grid.trilinear(middle, hint).value);
    };
    pad(
        neighbours.of(b), value, [&](std::size_t from, std::size_t point) { return old[from][point]; }, beyond);
    for (std::size_t point = 0; point < SparseBlock::points; ++point) {
      const double here = static_cast<double>(old[b][point]);
      const double far = (std::abs(here) / source.voxel - full_until) / (none_from - full_until);
      if (far >= 1.0 || !within_band(source, old[b][point])) continue;
      const std::array<int, 3> at = place_in_block(point);
      double squared = 0.0;
      for (int a = 0; a < 3; ++a) {
        const int d[3] = {a == 0, a == 1, a == 2};
        const auto up = static_cast<double>(value[padded_index(at[0] + d[0], at[1] + d[1], at[2] + d[2])]);
        const auto down = static_cast<double>(value[padded_index(at[0] - d[0], at[1] - d[1], at[2] - d[2])]);
        const double slope = (up - down) / (2.0 * source.voxel);
        squared += slope * slope;
      }
      const double slope = std::max(std::sqrt(squared), least_slope);
      const double t = std::max(far, 0.0);
      const double share = 1.0 - t * t * (3.0 - 2.0 * t);
      block.value[point] = static_cast<float>(std::clamp(here / std::pow(slope, share), source.inside, source.outside));
    }
  });
}

/// Leads points to the nearest place of a smooth field's zero set from a place near it.
class FootFinder {
 public:
  FootFinder(const ScalarField& field, double voxel) : field_(field), voxel_(voxel), cells_(64) {}

  /// False where no zero was found from x.
  bool lead(const Vec3& p, Vec3& x) {
    constexpr int most_moves = 16;
    constexpr double at_rest = 1e-3;
    if (!project(x)) return false;
    for (int move = 0; move < most_moves; ++move) {
      const FieldJet jet = cell(x).jet(x);
      const double length = jet.gradient.norm();
      if (!(length > 0.0)) return true;
      const Vec3 normal = jet.gradient / length;
      const Vec3 v = p - x;
      const double depth = v.dot(normal);
      const Vec3 s = v - depth * normal;
      const double rate = s.norm();
      if (rate <= at_rest * voxel_) return true;
      const TangentStep to = tangent_step(normal, s, rate, depth, jet.hessian, 1.0 / length);
      const double share = std::min(1.0, voxel_ / to.step.norm());
      if (!descend(p, share * to.step, share * share * to.drop * normal, x)) return true;
    }
    return true;
  }

 private:
  bool descend(const Vec3& p, const Vec3& step, const Vec3& drop, Vec3& x) {
    constexpr int most_halvings = 6;
    const double before = (p - x).squaredNorm();
    double share = 1.0;
    for (int attempt = 0; attempt < most_halvings; ++attempt, share *= 0.5) {
      Vec3 y = x + share * step - share * share * drop;
      if (!project(y) || !((p - y).squaredNorm() < before)) continue;
      x = y;
      return true;
    }
    return false;
  }

  bool project(Vec3& x) {
    constexpr int most_rounds = 8;
    for (int round = 0; round < most_rounds; ++round) {
      if (!field_.contains(x)) return false;
      const FieldJet jet = cell(x).gradient(x);
      const double squared = jet.gradient.squaredNorm();
      if (!(squared > 1e-6)) return false;
      const Vec3 step = (jet.value / squared) * jet.gradient;
      const double length = step.norm();
      if (length > 2.0 * voxel_) return false;
      x -= step;
      // Newton's next error is about the square of this one.
      if (length <= 1e-3 * voxel_) return true;
    }
    return false;
  }

  const CellPolynomial& cell(const Vec3& x) {
    const CellIndex index = field_.cell_of(0, x);
    CellPolynomial& slot = cells_[(index.at[0] & 3U) + 4U * (index.at[1] & 3U) + 16U * (index.at[2] & 3U)];
    field_.load(0, index, slot);
    return slot;
  }

  const ScalarField& field_;
  double voxel_;
  std::vector<CellPolynomial> cells_;
};

/// Distances to the zero set of a smooth potential at stored points.
class Redistancer {
 public:
  Redistancer(std::shared_ptr<const SparseGrid> grid, const SparseSource& untextured, SparseSource& textured,
              const AppliedHeights& heights, const Progress& progress)
      : field_(std::move(grid)),
        untextured_(untextured),
        textured_(textured),
        outside_(band_left(untextured.outside, heights.up, untextured.voxel)),
        inside_(-band_left(-untextured.inside, heights.down, untextured.voxel)),
        voxel_(textured.voxel),
        reach_(std::min(std::max(outside_, -inside_), std::max(8.0 * voxel_, 4.0 * heights.largest()))),
        progress_(progress),
        neighbours_(textured.blocks),
        feet_(textured.blocks.size()),
        next_(feet_) {}

  void run() {
    each_block(0.3, 0.32, [&](std::size_t b) { seed(b); });
    next_ = feet_;
    const int rounds = static_cast<int>(std::ceil(reach_ / voxel_)) + 2;
    for (int round = 0; round < rounds; ++round) {
      each_block(0.32, 0.4, [&](std::size_t b) { spread(b, nullptr); });
      feet_.swap(next_);
    }
    std::vector<FootFinder> finders(parallel_workers(feet_.size(), blocks_shared({}, 0.0, 1.0, progress_)),
                                    FootFinder{field_, voxel_});
    each_block(0.4, 0.6, [&](std::size_t b, unsigned worker) { refine(b, finders[worker]); });
    // A neighbour may have found a place that is nearer: start from there again.
    for (int round = 0; round < 2; ++round) {
      each_block(0.6, 0.7, [&](std::size_t b, unsigned worker) { spread(b, &finders[worker]); });
      feet_.swap(next_);
    }
    each_block(0.7, 0.72, [&](std::size_t b) { store(b); });
    textured_.outside = outside_;
    textured_.inside = inside_;
  }

 private:
  /// Way from a point to its nearest place of the surface (voxels).
  using Feet = std::array<Vec3f, SparseBlock::points>;
  static constexpr float nowhere = 1e6F;

  template <class Work>
  void each_block(double from, double to, const Work& work) {
    parallel_for(feet_.size(), blocks_shared("redistancing", from, to, progress_), work);
  }

  /// Two voxels at least, as the largest heights accepted leave; rounding takes nothing off them.
  static double band_left(double band, double height, double voxel) noexcept {
    return std::min(band, std::max(band - height, 2.0 * (1.0 + 1e-9) * voxel));
  }

  /// Where edges to the six neighbours pass zero.
  void seed(std::size_t b) {
    Padded<float> value;
    // Beyond the band there is no surface: the sign is that of the point beside it.
    pad(
        neighbours_.of(b), value,
        [&](std::size_t from, std::size_t point) { return textured_.blocks[from].value[point]; },
        [](int) { return std::numeric_limits<float>::quiet_NaN(); });
    for (std::size_t point = 0; point < SparseBlock::points; ++point) {
      const std::array<int, 3> at = place_in_block(point);
      const float here = value[padded_index(at[0], at[1], at[2])];
      Vec3f foot = Vec3f::Constant(nowhere);
      float best = std::numeric_limits<float>::infinity();
      for (int a = 0; a < 3; ++a) {
        for (const int direction : {-1, 1}) {
          std::array<int, 3> to = at;
          to[static_cast<std::size_t>(a)] += direction;
          const float there = value[padded_index(to[0], to[1], to[2])];
          if (std::isnan(there) || (here >= 0.0F) == (there >= 0.0F)) continue;
          const float t = here / (here - there);
          if (!(t < best)) continue;
          best = t;
          foot.setZero();
          foot[a] = static_cast<float>(direction) * t;
        }
      }
      feet_[b][point] = foot;
    }
  }

  /// Takes over what a neighbour found, where that is nearer; with a finder, from there to the nearest place.
  void spread(std::size_t b, FootFinder* finder) {
    Padded<Vec3f> foot;
    pad(
        neighbours_.of(b), foot, [&](std::size_t from, std::size_t point) { return feet_[from][point]; },
        [](int) { return Vec3f(Vec3f::Constant(nowhere)); });
    const float margin = finder != nullptr ? 1.0F - 1e-4F : 1.0F;
    const auto limit = static_cast<float>(reach_ / voxel_) + 1.0F;
    for (std::size_t point = 0; point < SparseBlock::points; ++point) {
      const Vec3f own = feet_[b][point];
      Vec3f best = own;
      next_[b][point] = own;
      if (!within_band(untextured_, untextured_.blocks[b].value[point])) continue;
      float least = margin * std::min(own.squaredNorm(), limit * limit);
      const std::array<int, 3> at = place_in_block(point);
      bool nearer = false;
      for_each_in_cube(-1, 2, [&](int i, int j, int k) {
        const Vec3f way = foot[padded_index(at[0] + i, at[1] + j, at[2] + k)] +
                          Vec3f(static_cast<float>(i), static_cast<float>(j), static_cast<float>(k));
        const float squared = way.squaredNorm();
        if (!(squared < least)) return;
        least = squared;
        best = way;
        nearer = true;
      });
      if (!nearer) continue;
      if (finder != nullptr && !led(b, point, *finder, best)) continue;
      if (finder == nullptr || best.squaredNorm() < own.squaredNorm()) next_[b][point] = best;
    }
  }

  void refine(std::size_t b, FootFinder& finder) {
    for (std::size_t point = 0; point < SparseBlock::points; ++point) {
      Vec3f& foot = feet_[b][point];
      if (foot.x() < nowhere && within_band(untextured_, untextured_.blocks[b].value[point]))
        led(b, point, finder, foot);
    }
  }

  bool led(std::size_t b, std::size_t point, FootFinder& finder, Vec3f& foot) const {
    const Vec3 p = node_position(textured_, textured_.blocks[b], point);
    Vec3 x = p + voxel_ * foot.cast<double>();
    if (!finder.lead(p, x)) return false;
    foot = ((x - p) / voxel_).cast<float>();
    return true;
  }

  /// Distances with the potential's sign, cut at the band that is left: from the old band's edge the textured surface
  /// is as near as the old band less the largest height, so that is where the new constant begins without a step. In a
  /// band wider than `reach` the potential stays as it is beyond, and towards that the distance turns into it.
  void store(std::size_t b) {
    SparseBlock& block = textured_.blocks[b];
    const bool all = std::max(outside_, -inside_) <= reach_;
    for (std::size_t point = 0; point < SparseBlock::points; ++point) {
      const auto textured = static_cast<double>(block.value[point]);
      double size = all ? infinity : std::abs(textured);
      const Vec3f& foot = feet_[b][point];
      if (foot.x() < nowhere && within_band(untextured_, untextured_.blocks[b].value[point])) {
        const double distance = voxel_ * static_cast<double>(foot.norm());
        const double t = std::clamp(2.0 * distance / reach_ - 1.0, 0.0, 1.0);
        size = all ? distance : (1.0 - t) * distance + t * size;
      }
      block.value[point] = static_cast<float>(std::clamp(textured < 0.0 ? -size : size, inside_, outside_));
    }
  }

  ScalarField field_;
  const SparseSource& untextured_;
  SparseSource& textured_;
  double outside_;  ///< the band that is left
  double inside_;
  double voxel_;
  double reach_;
  const Progress& progress_;
  Neighbours neighbours_;
  std::vector<Feet> feet_;
  std::vector<Feet> next_;
};

struct DistanceError {
  double largest = 0.0;
  double rms = 0.0;
};

/// | |potential| - distance | at a sample of the points within two voxels of the zero set, by the isosurface's search.
DistanceError distance_error(const SparseGrid& grid, const SparseSource& source, const std::vector<Vec3>& sample,
                             double from, double to, const Progress& progress) {
  const ScalarField field(std::make_shared<const SparseGrid>(grid));
  std::vector<double> error(sample.size(), not_a_number);
  const ParallelSettings settings = blocks_shared("measuring", from, to, progress);
  std::vector<CellCache> caches(parallel_workers(sample.size(), settings));
  std::vector<SparseHint> bricks(caches.size());
  parallel_for(sample.size(), settings, [&](std::size_t i, unsigned worker) {
    const Foot foot = IsoView{&field, 0, 0.0, 1.0, &caches[worker]}.nearest(sample[i], 2.0 * source.voxel);
    if (foot.found()) error[i] = std::abs(std::abs(grid.trilinear(sample[i], bricks[worker]).value) - foot.distance);
  });
  DistanceError all;
  double squares = 0.0;
  std::size_t count = 0;
  for (const double e : error) {
    if (std::isnan(e)) continue;
    all.largest = std::max(all.largest, e);
    squares += e * e;
    ++count;
  }
  if (count > 0) all.rms = std::sqrt(squares / static_cast<double>(count));
  return all;
}

/// Evenly spread over the points that may be within two voxels of the textured surface.
std::vector<Vec3> sample_points(const SparseSource& untextured, double largest_height) {
  const double near = 2.0 * untextured.voxel + largest_height;
  const auto visit = [&](const auto& take) {
    for (const SparseBlock& block : untextured.blocks) {
      for (std::size_t point = 0; point < SparseBlock::points; ++point) {
        if (within_band(untextured, block.value[point]) && std::abs(static_cast<double>(block.value[point])) <= near)
          take(block, point);
      }
    }
  };
  std::size_t count = 0;
  visit([&](const SparseBlock&, std::size_t) { ++count; });
  const std::size_t wanted = std::clamp<std::size_t>(count / 64, 128, 2048);
  const std::size_t step = count / wanted + 1;
  std::vector<Vec3> sample;
  std::size_t n = 0;
  visit([&](const SparseBlock& block, std::size_t point) {
    if (n++ % step == 0) sample.push_back(node_position(untextured, block, point));
  });
  return sample;
}

}  // namespace

PointHeight gaussian_noise(double deviation, std::uint64_t seed) {
  return [deviation, seed](const Vec3&, std::uint32_t, std::uint64_t node) {
    constexpr double most = 3.0;
    const std::uint64_t first = mixed(node ^ mixed(seed));
    const double radius = std::sqrt(-2.0 * std::log(uniform_of(first)));
    const double normal = radius * std::cos(2.0 * std::numbers::pi * uniform_of(mixed(first)));
    return deviation * std::clamp(normal, -most, most);
  };
}

PointHeight gradient_noise(double amplitude, double wavelength, std::uint64_t seed) {
  return [amplitude, wavelength, noise = LatticeNoise(seed)](const Vec3& p, std::uint32_t, std::uint64_t) {
    if (!(wavelength > 0.0)) return not_a_number;
    return amplitude / LatticeNoise::bound * noise(p / wavelength);
  };
}

PointHeight coat_height(const Coat& coat, const TriangleMesh& mesh) {
  return [&coat, &mesh](const Vec3& p, std::uint32_t face, std::uint64_t) {
    if (face >= mesh.triangles().size()) return 0.0;
    const std::array<Vec3, 3> corner = mesh.corners(face);
    const TrianglePoint nearest = closest_point_on_triangle(p, corner[0], corner[1], corner[2]);
    return coat.sample(mesh, face, nearest.barycentric).height;
  };
}

Result<TexturedPotential> textured(const SparseGrid& grid, const PointHeight& height, Redistancing mode,
                                   const Progress& progress) {
  const SparseSource untextured = grid.source();
  SparseSource source = untextured;
  ASPERITY_TRY(const AppliedHeights heights, apply(untextured, height, source, progress));
  ASPERITY_TRY(SparseGrid modulated, SparseGrid::build(source));
  const std::vector<Vec3> sample = sample_points(untextured, heights.largest());
  const DistanceError before = distance_error(modulated, source, sample, 0.75, 0.85, progress);
  DistanceError after = before;
  if (mode != Redistancing::none) {
    if (mode == Redistancing::normalised) {
      normalise(modulated, source, progress);
    } else {
      Redistancer(std::make_shared<const SparseGrid>(modulated), untextured, source, heights, progress).run();
    }
    ASPERITY_TRY(modulated, SparseGrid::build(source));
    after = distance_error(modulated, source, sample, 0.85, 1.0, progress);
  }
  if (progress) progress("texturing", 1.0);
  return TexturedPotential{std::move(modulated), heights.lowest, heights.highest, before.largest,
                           before.rms,           after.largest,  after.rms};
}

}  // namespace asperity
