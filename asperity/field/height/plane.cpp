#include "asperity/field/height/plane.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "asperity/field/height/detail/blocks.h"
#include "asperity/field/height/detail/control_points.h"

namespace asperity {
namespace {

// Texels a side, by their power of two, of the smallest blocks.
constexpr unsigned first_plane_level = 2;
// A rectangle is covered by up to so many blocks: three a side of a square.
constexpr std::size_t most_plane_blocks = 12;
// A bicubic piece has sixteen control points a gap: on more texels a side than this the blocks are quicker.
constexpr int most_cubic_texels = 3;

/// The plane through the mean of a net's edges, and how far its points are off: `value(x, y)` of the points at
/// (at_s[x], at_t[y]), of which the first and the last along each axis are the corners of the rectangle.
template <class Value>
TexelPlane plane_of_net(int columns, const double* at_s, int rows, const double* at_t, bool level_s, bool level_t,
                        const Value& value) noexcept {
  const double from_s = at_s[0];
  const double from_t = at_t[0];
  const double long_s = at_s[columns - 1] - from_s;
  const double long_t = at_t[rows - 1] - from_t;
  const double a = value(0, 0);
  const double b = value(columns - 1, 0);
  const double c = value(0, rows - 1);
  const double d = value(columns - 1, rows - 1);
  TexelPlane plane;
  if (!level_s && long_s > 0.0) plane.slope.x() = 0.5 * ((b - a) + (d - c)) / long_s;
  if (!level_t && long_t > 0.0) plane.slope.y() = 0.5 * ((c - a) + (d - b)) / long_t;
  double lowest = infinity;
  double highest = -infinity;
  double bottom = infinity;
  double top = -infinity;
  for (int y = 0; y < rows; ++y) {
    const double along = plane.slope.y() * (at_t[y] - from_t);
    for (int x = 0; x < columns; ++x) {
      const double point = value(x, y);
      const double rest = point - plane.slope.x() * (at_s[x] - from_s) - along;
      lowest = std::min(lowest, rest);
      highest = std::max(highest, rest);
      bottom = std::min(bottom, point);
      top = std::max(top, point);
    }
  }
  // Of noise the corners say nothing.
  if (top - bottom < highest - lowest) return {0.5 * (bottom + top), Vec2::Zero(), 0.5 * (top - bottom)};
  plane.height = 0.5 * (lowest + highest + plane.slope.x() * long_s + plane.slope.y() * long_t);
  plane.error = 0.5 * (highest - lowest);
  return plane;
}

/// Where the points of an axis stand (texels from the first one's centre).
void place_points(const TexelSpan& span, const EndControls& ends, double* at) noexcept {
  const int last = span.count + 1;
  for (int i = 2; i + 1 < last; ++i) at[i] = i - 1;
  at[0] = ends.at[0];
  at[1] = ends.at[1];
  at[last - 1] = span.count - 1 + ends.at[2];
  at[last] = span.count - 1 + ends.at[3];
}

/// Over a rectangle on up to `width` - 2 texels a side.
template <std::size_t width>
TexelPlane piece_plane(const StoredTexels& texels, const TexelSpan& s, const TexelSpan& t, bool level_s,
                       bool level_t) noexcept {
  const EndControls across = end_controls(s, texels.reconstruction);
  const EndControls along = end_controls(t, texels.reconstruction);
  const auto last_x = static_cast<std::size_t>(s.count) + 1;
  const auto last_y = static_cast<std::size_t>(t.count) + 1;
  double at_s[width];
  double at_t[width];
  place_points(s, across, at_s);
  place_points(t, along, at_t);
  std::size_t columns[width];
  for (std::size_t x = 0; x < width; ++x) columns[x] = place(s, std::min(x, last_x), texels.width);
  double rows[width][width];
  for (std::size_t y = 0; y <= last_y; ++y) {
    const float* stored = texels.values + place(t, y, texels.height) * texels.stride();
    for (std::size_t x = 0; x < width; ++x) rows[y][x] = stored[columns[x]];
    make_points(rows[y], last_x, across);
  }
  for (std::size_t x = 0; x <= last_x; ++x) {
    const double first[3] = {rows[0][x], rows[1][x], rows[2][x]};
    const double end[3] = {rows[last_y - 2][x], rows[last_y - 1][x], rows[last_y][x]};
    rows[0][x] = along.point(0, first[0], first[1], first[2]);
    rows[1][x] = along.point(1, first[0], first[1], first[2]);
    rows[last_y - 1][x] = along.point(2, end[0], end[1], end[2]);
    rows[last_y][x] = along.point(3, end[0], end[1], end[2]);
  }
  return plane_of_net(s.count + 2, at_s, t.count + 2, at_t, level_s, level_t, [&](int x, int y) { return rows[y][x]; });
}

TexelPlane cubic_plane(const StoredTexels& texels, const TexelSpan& s, const TexelSpan& t, bool level_s,
                       bool level_t) noexcept {
  const CubicControls across(s, texels.width);
  const CubicControls along(t, texels.height);
  constexpr int most_gaps = most_cubic_texels + 1;
  double rows[most_gaps + 3][4 * most_gaps];
  for (int y = 0; y < along.gaps + 3; ++y) {
    const float* stored = texels.values + along.place[y] * texels.stride();
    for (int x = 0; x < 4 * across.gaps; ++x) {
      const std::size_t* from = across.place + x / 4;
      rows[y][x] = 0.0;
      for (std::size_t k = 0; k < 4; ++k) rows[y][x] += across.weights[x][k] * static_cast<double>(stored[from[k]]);
    }
  }
  double points[4 * most_gaps][4 * most_gaps];
  for (int y = 0; y < 4 * along.gaps; ++y) {
    const auto* from = rows + y / 4;
    const auto& weights = along.weights[y];
    for (int x = 0; x < 4 * across.gaps; ++x)
      points[y][x] =
          weights[0] * from[0][x] + weights[1] * from[1][x] + weights[2] * from[2][x] + weights[3] * from[3][x];
  }
  return plane_of_net(4 * across.gaps, across.at, 4 * along.gaps, along.at, level_s, level_t,
                      [&](int x, int y) { return points[y][x]; });
}

/// Over a rectangle on few texels.
TexelPlane small_plane(const StoredTexels& texels, const TexelSpan& s, const TexelSpan& t, bool level_s,
                       bool level_t) noexcept {
  if (texels.reconstruction == Reconstruction::bicubic) return cubic_plane(texels, s, t, level_s, level_t);
  const int longer_side = std::max(s.count, t.count);
  if (longer_side == 1) return piece_plane<3>(texels, s, t, level_s, level_t);
  if (longer_side == 2) return piece_plane<4>(texels, s, t, level_s, level_t);
  return piece_plane<most_texels + 2>(texels, s, t, level_s, level_t);
}

int most_texels_of(const StoredTexels& texels) noexcept {
  return texels.reconstruction == Reconstruction::bicubic ? most_cubic_texels : most_texels;
}

}  // namespace

/// One plane for several that lie beside one another.
class PlanePyramid::Fit {
 public:
  /// A plane over a rectangle of this half width and height around (s, t), all in texels.
  void add(double s, double t, double half_s, double half_t, const TexelPlane& plane) noexcept {
    pieces_[count_++] = {s, t, half_s, half_t, plane};
  }

  /// Around (s, t): by least squares of the planes over their rectangles.
  [[nodiscard]] TexelPlane around(double s, double t, bool level_s, bool level_t) const noexcept {
    double area = 0.0;
    Vec2 mean = Vec2::Zero();
    double height = 0.0;
    for (const Piece& piece : pieces()) {
      const double one = piece.area();
      area += one;
      mean += one * Vec2(piece.s, piece.t);
      height += one * piece.plane.height;
    }
    mean /= area;
    height /= area;
    Vec2 moment = Vec2::Zero();
    Vec2 spread = Vec2::Zero();
    for (const Piece& piece : pieces()) {
      const Vec2 off(piece.s - mean.x(), piece.t - mean.y());
      const Vec2 own = Vec2(piece.half_s * piece.half_s, piece.half_t * piece.half_t) / 3.0;
      moment += piece.area() * ((piece.plane.height - height) * off + piece.plane.slope.cwiseProduct(own));
      spread += piece.area() * (off.cwiseProduct(off) + own);
    }
    TexelPlane all;
    if (!level_s && spread.x() > 0.0) all.slope.x() = moment.x() / spread.x();
    if (!level_t && spread.y() > 0.0) all.slope.y() = moment.y() / spread.y();
    all.height = height + all.slope.dot(Vec2(s, t) - mean);
    return all;
  }

  /// How far what the pieces hold is from a plane around (s, t) that is given: makes that the middle of it.
  void bound(double s, double t, TexelPlane& all) const noexcept {
    double lowest = infinity;
    double highest = -infinity;
    for (const Piece& piece : pieces()) {
      const Vec2 turn = piece.plane.slope - all.slope;
      const double middle = piece.plane.height - all.height - all.slope.dot(Vec2(piece.s - s, piece.t - t));
      const double off = piece.plane.error + std::abs(turn.x()) * piece.half_s + std::abs(turn.y()) * piece.half_t;
      lowest = std::min(lowest, middle - off);
      highest = std::max(highest, middle + off);
    }
    all.height += 0.5 * (lowest + highest);
    all.error = 0.5 * (highest - lowest);
  }

 private:
  struct Piece {
    double s;
    double t;
    double half_s;
    double half_t;
    TexelPlane plane;
    // Of a line or a point as well: what it lies in counts.
    [[nodiscard]] double area() const noexcept { return std::max(half_s, 1e-6) * std::max(half_t, 1e-6); }
  };
  [[nodiscard]] std::span<const Piece> pieces() const noexcept { return {pieces_, count_}; }
  Piece pieces_[most_plane_blocks];
  std::size_t count_ = 0;
};

PlanePyramid::Block PlanePyramid::rounded(const TexelPlane& plane, double half_s, double half_t) noexcept {
  Block block{static_cast<float>(plane.height), static_cast<float>(plane.slope.x()),
              static_cast<float>(plane.slope.y()), 0.0F};
  const double off = std::abs(plane.height - static_cast<double>(block.height)) +
                     half_s * std::abs(plane.slope.x() - static_cast<double>(block.slope_s)) +
                     half_t * std::abs(plane.slope.y() - static_cast<double>(block.slope_t));
  block.error = static_cast<float>(rounded_up(plane.error + off));
  return block;
}

PlanePyramid::PlanePyramid(const StoredTexels& texels) {
  std::size_t count = 0;
  std::size_t columns = 0;
  std::size_t rows = 0;
  do {
    level_begin_.push_back(count);
    const auto level = static_cast<unsigned>(level_begin_.size()) + first_plane_level - 1;
    columns = blocks_along(texels.width, level);
    rows = blocks_along(texels.height, level);
    count += columns * rows;
  } while (columns * rows > 1);
  level_begin_.shrink_to_fit();
  blocks_.reserve(count);
  build_first_level(texels);
  for (unsigned level = first_plane_level + 1; level < first_plane_level + level_begin_.size(); ++level)
    build_next_level(texels, level);
}

void PlanePyramid::build_first_level(const StoredTexels& texels) {
  const bool level = texels.reconstruction == Reconstruction::nearest;
  constexpr int side = 1 << first_plane_level;
  // Pieces of control points at most as large as those of a query.
  const int piece = std::min(side, most_texels_of(texels) == most_texels ? side : side / 2);
  for (int y = 0; y < texels.height; y += side) {
    for (int x = 0; x < texels.width; x += side) {
      Fit fit;
      const int end_x = std::min(x + side, texels.width);
      const int end_y = std::min(y + side, texels.height);
      for (int v = y; v < end_y; v += piece) {
        for (int u = x; u < end_x; u += piece) {
          const TexelSpan s{u, std::min(piece, end_x - u), -0.5, 0.5};
          const TexelSpan t{v, std::min(piece, end_y - v), -0.5, 0.5};
          fit.add(u + 0.5 * s.count, v + 0.5 * t.count, 0.5 * s.count, 0.5 * t.count,
                  small_plane(texels, s, t, level, level));
        }
      }
      const double middle_s = 0.5 * (x + end_x);
      const double middle_t = 0.5 * (y + end_y);
      TexelPlane plane = fit.around(middle_s, middle_t, level, level);
      fit.bound(middle_s, middle_t, plane);
      blocks_.push_back(rounded(plane, 0.5 * (end_x - x), 0.5 * (end_y - y)));
    }
  }
}

void PlanePyramid::build_next_level(const StoredTexels& texels, unsigned level) {
  const int side = 1 << level;
  const int half = side / 2;
  const bool flat = texels.reconstruction == Reconstruction::nearest;
  const std::size_t stride = blocks_along(texels.width, level - 1);
  const Block* finer = &blocks_[level_begin_[level - 1 - first_plane_level]];
  for (int y = 0; y < texels.height; y += side) {
    for (int x = 0; x < texels.width; x += side) {
      Fit fit;
      const int end_x = std::min(x + side, texels.width);
      const int end_y = std::min(y + side, texels.height);
      for (int v = y; v < end_y; v += half) {
        for (int u = x; u < end_x; u += half) {
          const Block& one = finer[static_cast<std::size_t>(v / half) * stride + static_cast<std::size_t>(u / half)];
          const int far_u = std::min(u + half, end_x);
          const int far_v = std::min(v + half, end_y);
          fit.add(0.5 * (u + far_u), 0.5 * (v + far_v), 0.5 * (far_u - u), 0.5 * (far_v - v),
                  {one.height, Vec2(one.slope_s, one.slope_t), one.error});
        }
      }
      const double middle_s = 0.5 * (x + end_x);
      const double middle_t = 0.5 * (y + end_y);
      TexelPlane plane = fit.around(middle_s, middle_t, flat, flat);
      fit.bound(middle_s, middle_t, plane);
      blocks_.push_back(rounded(plane, 0.5 * (end_x - x), 0.5 * (end_y - y)));
    }
  }
}

std::size_t PlanePyramid::memory_bytes() const noexcept {
  return blocks_.capacity() * sizeof(Block) + level_begin_.capacity() * sizeof(std::size_t);
}

TexelPlane PlanePyramid::over(const StoredTexels& texels, const TexelSpan& s, const TexelSpan& t, bool level_s,
                              bool level_t) const noexcept {
  const bool stepped = texels.reconstruction == Reconstruction::nearest;
  level_s = level_s || stepped;
  level_t = level_t || stepped;
  const int most = most_texels_of(texels);
  if (s.count <= most && t.count <= most) return small_plane(texels, s, t, level_s, level_t);
  unsigned level = first_plane_level;
  BlockRuns columns(s, texels.width, level);
  BlockRuns rows(t, texels.height, level);
  while (columns.count() * rows.count() > most_plane_blocks) {
    ++level;
    columns = BlockRuns(s, texels.width, level);
    rows = BlockRuns(t, texels.height, level);
  }
  // In texels from the map's left and lower border, on over the border where a span goes on there.
  const double begin_s = s.first + 0.5 + s.from;
  const double end_s = s.first + s.count - 0.5 + s.to;
  const double begin_t = t.first + 0.5 + t.from;
  const double end_t = t.first + t.count - 0.5 + t.to;
  const int side = 1 << level;
  const std::size_t stride = blocks_along(texels.width, level);
  const Block* blocks = &blocks_[level_begin_[level - first_plane_level]];
  Fit fit;
  for (int upper = 0; upper < 2; ++upper) {
    for (std::size_t y = rows.begin[upper]; y < rows.end[upper]; ++y) {
      const int low_t = static_cast<int>(y) * side;
      const int high_t = std::min(low_t + side, texels.height);
      const double shift_t = upper == 0 ? 0.0 : texels.height;
      const double from_t = std::max(begin_t, low_t + shift_t);
      const double to_t = std::max(from_t, std::min(end_t, high_t + shift_t));
      for (int right = 0; right < 2; ++right) {
        for (std::size_t x = columns.begin[right]; x < columns.end[right]; ++x) {
          const Block& block = blocks[y * stride + x];
          const int low_s = static_cast<int>(x) * side;
          const int high_s = std::min(low_s + side, texels.width);
          const double shift_s = right == 0 ? 0.0 : texels.width;
          const double from_s = std::max(begin_s, low_s + shift_s);
          const double to_s = std::max(from_s, std::min(end_s, high_s + shift_s));
          const double middle_s = 0.5 * (from_s + to_s);
          const double middle_t = 0.5 * (from_t + to_t);
          const Vec2 slope(block.slope_s, block.slope_t);
          const double height = block.height + slope.x() * (middle_s - shift_s - 0.5 * (low_s + high_s)) +
                                slope.y() * (middle_t - shift_t - 0.5 * (low_t + high_t));
          fit.add(middle_s, middle_t, 0.5 * (to_s - from_s), 0.5 * (to_t - from_t), {height, slope, block.error});
        }
      }
    }
  }
  const double middle_s = 0.5 * (begin_s + end_s);
  const double middle_t = 0.5 * (begin_t + end_t);
  TexelPlane plane = fit.around(middle_s, middle_t, level_s, level_t);
  fit.bound(middle_s, middle_t, plane);
  return plane;
}

}  // namespace asperity
