#include "asperity/field/height/range.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "asperity/core/math.h"
#include "asperity/field/height/detail/blocks.h"
#include "asperity/field/height/detail/control_points.h"
#include "asperity/field/height/detail/texel_coordinate.h"

namespace asperity {
namespace {

// What is larger than a piece of control points is bounded by up to so many blocks: for a square five to eight a side.
constexpr std::size_t most_blocks = 64;

/// The whole number at or below a coordinate.
double period_of(double s) noexcept {
  if (!(std::abs(s) < 0x1p31)) [[unlikely]] {
    return std::floor(s);
  }
  const double towards_zero = static_cast<double>(static_cast<std::int64_t>(s));
  return towards_zero > s ? towards_zero - 1.0 : towards_zero;
}

// ---- bounds of a small rectangle --------------------------------------------------------

/// Bounds of all control points from those of each row, by making them along the columns too.
template <std::size_t width>
HeightRange range_of_points(const double (&rows)[width][width], std::size_t last, const EndControls& ends) noexcept {
  double lowest[width];
  double highest[width];
  const auto include = [&](std::size_t x, double point) {
    lowest[x] = std::min(lowest[x], point);
    highest[x] = std::max(highest[x], point);
  };
  std::fill(lowest, lowest + width, infinity);
  std::fill(highest, highest + width, -infinity);
  const auto* end = rows + last - 2;
  for (int i = 0; i < 2; ++i) {
    for (std::size_t x = 0; x < width; ++x) include(x, ends.point(i, rows[0][x], rows[1][x], rows[2][x]));
    for (std::size_t x = 0; x < width; ++x) include(x, ends.point(i + 2, end[0][x], end[1][x], end[2][x]));
  }
  for (std::size_t y = 2; y + 1 < last; ++y) {
    for (std::size_t x = 0; x < width; ++x) include(x, rows[y][x]);
  }
  return {*std::min_element(lowest, lowest + width), *std::max_element(highest, highest + width)};
}

/// Bounds over a rectangle on up to `width` - 2 texels a side: a width known to the compiler saves half of the time.
template <std::size_t width>
HeightRange piece_range(const StoredTexels& texels, const TexelSpan& s, const TexelSpan& t) noexcept {
  const EndControls across = end_controls(s, texels.reconstruction);
  const EndControls along = end_controls(t, texels.reconstruction);
  const std::size_t last_x = width == 3 ? 2 : static_cast<std::size_t>(s.count) + 1;
  const std::size_t last_y = width == 3 ? 2 : static_cast<std::size_t>(t.count) + 1;
  std::size_t columns[width];
  for (std::size_t x = 0; x < width; ++x) columns[x] = place(s, std::min(x, last_x), texels.width);
  double rows[width][width];
  for (std::size_t y = 0; y <= last_y; ++y) {
    const float* stored = texels.values + place(t, y, texels.height) * (static_cast<std::size_t>(texels.width) + 2);
    for (std::size_t x = 0; x < width; ++x) rows[y][x] = stored[columns[x]];
    make_points(rows[y], last_x, across);
  }
  return range_of_points(rows, last_y, along);
}

HeightRange piece_range(const StoredTexels& texels, const TexelSpan& s, const TexelSpan& t) noexcept {
  const int longer_side = std::max(s.count, t.count);
  if (longer_side == 1) return piece_range<3>(texels, s, t);
  if (longer_side == 2) return piece_range<4>(texels, s, t);
  return piece_range<most_texels + 2>(texels, s, t);
}

/// Bounds over a rectangle of a bicubic surface on up to most_texels a side.
HeightRange cubic_range(const StoredTexels& texels, const TexelSpan& s, const TexelSpan& t) noexcept {
  const CubicControls across(s, texels.width);
  const CubicControls along(t, texels.height);
  constexpr int most_points = 4 * CubicControls::most_gaps;
  double rows[CubicControls::most_gaps + 3][most_points];
  for (int y = 0; y < along.gaps + 3; ++y) {
    const float* stored = texels.values + along.place[y] * texels.stride();
    for (int x = 0; x < 4 * across.gaps; ++x) {
      const std::size_t* from = across.place + x / 4;
      const auto& weights = across.weights[x];
      rows[y][x] = weights[0] * stored[from[0]] + weights[1] * stored[from[1]] + weights[2] * stored[from[2]] +
                   weights[3] * stored[from[3]];
    }
  }
  HeightRange range{infinity, -infinity};
  for (int y = 0; y < 4 * along.gaps; ++y) {
    const auto* from = rows + y / 4;
    const auto& weights = along.weights[y];
    for (int x = 0; x < 4 * across.gaps; ++x) {
      const double point =
          weights[0] * from[0][x] + weights[1] * from[1][x] + weights[2] * from[2][x] + weights[3] * from[3][x];
      range.lowest = std::min(range.lowest, point);
      range.highest = std::max(range.highest, point);
    }
  }
  return range;
}

// ---- blocks -----------------------------------------------------------------------------

/// Bounds of each column's elements.
class BoundsRow {
 public:
  explicit BoundsRow(std::size_t columns) : lowest_(columns, infinity), highest_(columns, -infinity) {}
  void set(std::size_t x, double lowest, double highest) {
    lowest_[x] = lowest;
    highest_[x] = highest;
  }
  void include(const BoundsRow& row) {
    for (std::size_t x = 0; x < lowest_.size(); ++x) lowest_[x] = std::min(lowest_[x], row.lowest_[x]);
    for (std::size_t x = 0; x < highest_.size(); ++x) highest_[x] = std::max(highest_[x], row.highest_[x]);
  }
  [[nodiscard]] HeightRange range(std::size_t begin, std::size_t end) const {
    HeightRange range{lowest_[begin], highest_[begin]};
    for (std::size_t x = begin + 1; x < end; ++x) {
      range.lowest = std::min(range.lowest, lowest_[x]);
      range.highest = std::max(range.highest, highest_[x]);
    }
    return range;
  }

 private:
  std::vector<double> lowest_;
  std::vector<double> highest_;
};

/// What a relief's bounds are put together from. Nearest: the texels. Otherwise the gaps, squares between four
/// neighbouring texel centres, apron included: gap (x, y) is the one to the left of and below texel (x, y)'s centre.
class Elements {
 public:
  explicit Elements(const StoredTexels& texels) : texels_(texels) {}
  /// Whether a texel is bounded by its own element and the next to the right and above, which are its neighbours' too.
  [[nodiscard]] bool shared_by_neighbours() const { return texels_.reconstruction != Reconstruction::nearest; }
  [[nodiscard]] std::size_t columns() const { return count(texels_.width); }
  [[nodiscard]] std::size_t rows() const { return count(texels_.height); }
  void read_row(std::size_t y, BoundsRow& bounds) const {
    const float* below = texels_.values + y * texels_.stride();
    const float* above = below + texels_.stride();
    switch (texels_.reconstruction) {
      case Reconstruction::bicubic: return read_cubic_gaps(below, bounds);
      case Reconstruction::quadratic_bspline: return read_spline_gaps(below, above, bounds);
      case Reconstruction::bilinear: return read_gaps(below, above, bounds);
      case Reconstruction::nearest: break;
    }
    for (std::size_t x = 0; x < columns(); ++x) bounds.set(x, above[x + 1], above[x + 1]);
  }

 private:
  [[nodiscard]] std::size_t count(int texels) const {
    return static_cast<std::size_t>(texels) + (shared_by_neighbours() ? 1 : 0);
  }
  static void set_to_bounds(BoundsRow& bounds, std::size_t x, double a, double b, double c, double d) {
    bounds.set(x, std::min(std::min(a, b), std::min(c, d)), std::max(std::max(a, b), std::max(c, d)));
  }
  void read_gaps(const float* below, const float* above, BoundsRow& bounds) const {
    for (std::size_t x = 0; x < columns(); ++x)
      set_to_bounds(bounds, x, below[x], below[x + 1], above[x], above[x + 1]);
  }
  /// The coefficients of the same spline on a grid twice as fine (Chaikin's rule, weights 3/4 and 1/4 along each axis),
  /// four in each gap.
  void read_spline_gaps(const float* below, const float* above, BoundsRow& bounds) const {
    for (std::size_t x = 0; x < columns(); ++x) {
      const double a = below[x];
      const double b = below[x + 1];
      const double c = above[x];
      const double d = above[x + 1];
      set_to_bounds(bounds, x, (9.0 * a + 3.0 * b + 3.0 * c + d) / 16.0, (3.0 * a + 9.0 * b + c + 3.0 * d) / 16.0,
                    (3.0 * a + b + 9.0 * c + 3.0 * d) / 16.0, (a + 3.0 * b + 3.0 * c + 9.0 * d) / 16.0);
    }
  }
  /// The control points of each gap's four quarters, from four rows of coefficients.
  void read_cubic_gaps(const float* first, BoundsRow& bounds) const {
    static const std::array<std::array<double, 4>, 7> halves{cubic_blossom(0.0, 0.0, 0.0), cubic_blossom(0.0, 0.0, 0.5),
                                                             cubic_blossom(0.0, 0.5, 0.5), cubic_blossom(0.5, 0.5, 0.5),
                                                             cubic_blossom(0.5, 0.5, 1.0), cubic_blossom(0.5, 1.0, 1.0),
                                                             cubic_blossom(1.0, 1.0, 1.0)};
    for (std::size_t x = 0; x < columns(); ++x) {
      double lowest = infinity;
      double highest = -infinity;
      for (const auto& across : halves) {
        double line[4] = {0.0, 0.0, 0.0, 0.0};
        for (std::size_t y = 0; y < 4; ++y) {
          for (std::size_t i = 0; i < 4; ++i) line[y] += across[i] * first[y * texels_.stride() + x + i];
        }
        for (const auto& along : halves) {
          const double point = along[0] * line[0] + along[1] * line[1] + along[2] * line[2] + along[3] * line[3];
          lowest = std::min(lowest, point);
          highest = std::max(highest, point);
        }
      }
      bounds.set(x, lowest, highest);
    }
  }
  StoredTexels texels_;
};

}  // namespace

TexelSpan texels_under(double lower, double upper, int texels, Wrap wrap) noexcept {
  const TexelPlace from = texel_under(unit_coordinate(lower, wrap), texels);
  const TexelPlace to = texel_under(unit_coordinate(upper, wrap), texels);
  // Coordinates within one period keep their order in unit_coordinate and texel_under, rounding included: the texels of
  // all of them lie between those of the ends.
  const double periods = wrap == Wrap::repeat ? period_of(upper) - period_of(lower) : 0.0;
  if (periods == 0.0) return {from.index, to.index - from.index + 1, from.offset, to.offset};
  if (periods == 1.0 && to.index < from.index) {
    return {from.index, to.index + texels - from.index + 1, from.offset, to.offset};
  }
  return {0, texels, -0.5, 0.5};
}

int StoredTexels::apron() const noexcept {
  return reconstruction == Reconstruction::bicubic ? 2 : 1;
}

RangePyramid::RangePyramid(const StoredTexels& texels) {
  std::size_t count = 0;
  std::size_t columns = 0;
  std::size_t rows = 0;
  do {
    level_begin_.push_back(count);
    const auto level = static_cast<unsigned>(level_begin_.size());
    columns = blocks_along(texels.width, level);
    rows = blocks_along(texels.height, level);
    count += columns * rows;
    // A span over the border may count its first block, which is its last too, twice.
  } while ((columns + 1) * (rows + 1) > most_blocks);
  level_begin_.shrink_to_fit();
  blocks_.reserve(count);
  build_first_level(texels);
  for (unsigned level = 2; level <= level_begin_.size(); ++level) build_next_level(texels, level);
}

void RangePyramid::build_first_level(const StoredTexels& texels) {
  const Elements elements(texels);
  const std::size_t shared = elements.shared_by_neighbours() ? 1 : 0;
  const std::size_t columns = blocks_along(texels.width, 1);
  const std::size_t rows = blocks_along(texels.height, 1);
  BoundsRow all(elements.columns());
  BoundsRow sum(elements.columns());
  BoundsRow next(elements.columns());
  for (std::size_t y = 0; y < rows; ++y) {
    // A shared row has been read for the blocks below.
    if (y == 0 || shared == 0) elements.read_row(2 * y, next);
    sum = next;
    for (std::size_t row = 2 * y + 1; row < std::min(2 * y + 2 + shared, elements.rows()); ++row) {
      elements.read_row(row, next);
      sum.include(next);
    }
    all.include(sum);
    for (std::size_t x = 0; x < columns; ++x) {
      const HeightRange range = sum.range(2 * x, std::min(2 * x + 2 + shared, elements.columns()));
      blocks_.push_back({rounded_down(range.lowest), rounded_up(range.highest)});
    }
  }
  whole_ = all.range(0, elements.columns());
}

void RangePyramid::build_next_level(const StoredTexels& texels, unsigned level) {
  const std::size_t columns = blocks_along(texels.width, level);
  const std::size_t rows = blocks_along(texels.height, level);
  const std::size_t finer_columns = blocks_along(texels.width, level - 1);
  const std::size_t finer_rows = blocks_along(texels.height, level - 1);
  for (std::size_t y = 0; y < rows; ++y) {
    const Block* below = &blocks_[level_begin_[level - 2] + 2 * y * finer_columns];
    const Block* above = 2 * y + 1 < finer_rows ? below + finer_columns : below;
    for (std::size_t x = 0; x < columns; ++x) {
      const std::size_t left = 2 * x;
      const std::size_t right = std::min(left + 1, finer_columns - 1);
      blocks_.push_back(
          {std::min({below[left].lowest, below[right].lowest, above[left].lowest, above[right].lowest}),
           std::max({below[left].highest, below[right].highest, above[left].highest, above[right].highest})});
    }
  }
}

std::size_t RangePyramid::memory_bytes() const noexcept {
  return blocks_.capacity() * sizeof(Block) + level_begin_.capacity() * sizeof(std::size_t);
}

HeightRange RangePyramid::over(const StoredTexels& texels, const TexelSpan& s, const TexelSpan& t) const noexcept {
  if (s.count > most_texels || t.count > most_texels) return cover(texels, s, t);
  return texels.reconstruction == Reconstruction::bicubic ? cubic_range(texels, s, t) : piece_range(texels, s, t);
}

HeightRange RangePyramid::cover(const StoredTexels& texels, const TexelSpan& s, const TexelSpan& t) const noexcept {
  // Below this level there are too many blocks for certain.
  const std::uint64_t area = static_cast<std::uint64_t>(s.count) * static_cast<std::uint64_t>(t.count);
  auto level = static_cast<unsigned>(std::max(1, static_cast<int>(std::bit_width(area / most_blocks)) / 2));
  BlockRuns columns(s, texels.width, level);
  BlockRuns rows(t, texels.height, level);
  while (columns.count() * rows.count() > most_blocks) {
    ++level;
    columns = BlockRuns(s, texels.width, level);
    rows = BlockRuns(t, texels.height, level);
  }
  const std::size_t stride = blocks_along(texels.width, level);
  float lowest = std::numeric_limits<float>::infinity();
  float highest = -lowest;
  for (int upper = 0; upper < 2; ++upper) {
    for (std::size_t y = rows.begin[upper]; y < rows.end[upper]; ++y) {
      const Block* row = &blocks_[level_begin_[level - 1] + y * stride];
      for (int right = 0; right < 2; ++right) {
        for (std::size_t x = columns.begin[right]; x < columns.end[right]; ++x) {
          lowest = std::min(lowest, row[x].lowest);
          highest = std::max(highest, row[x].highest);
        }
      }
    }
  }
  return {lowest, highest};
}

}  // namespace asperity
