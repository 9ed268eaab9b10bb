#pragma once

#include <cstddef>
#include <vector>

namespace asperity {

enum class Reconstruction;
enum class Wrap;

/// The heights a piece of a relief keeps to.
struct HeightRange {
  double lowest = 0.0;   ///< m
  double highest = 0.0;  ///< m
};

/// The texels an interval of a texture coordinate touches: `count` of them from `first` on, to the right or upwards; on
/// a map that repeats, texel 0 follows the last.
struct TexelSpan {
  int first = 0;
  int count = 1;      ///< 1 to the texels of the axis
  double from = 0.0;  ///< where the interval begins: texels from the first one's centre, -0.5 to 0.5
  double to = 0.0;    ///< where it ends: texels from the last one's centre, -0.5 to 0.5
};

/// The texels under the coordinates from `lower` to `upper` (finite, in this order) on an axis of `texels`. [servo]
TexelSpan texels_under(double lower, double upper, int texels, Wrap wrap) noexcept;

/// The numbers a relief is made of, as HeightMap stores them: rows of `stride` floats, bottom row first, inside an
/// apron; texel heights or B-spline coefficients (m), relative to the map's base.
struct StoredTexels {
  const float* values = nullptr;
  int width = 0;   ///< texels
  int height = 0;  ///< texels
  Reconstruction reconstruction{};
  /// How many texels wide the apron is: two for bicubic, one for all others. [any]
  [[nodiscard]] int apron() const noexcept;
  [[nodiscard]] std::size_t stride() const noexcept {
    return static_cast<std::size_t>(width) + 2 * static_cast<std::size_t>(apron());
  }
};

/// Bounds of a relief over every block of 2 x 2, 4 x 4, 8 x 8 ... texels, and from them over any rectangle. The heights
/// of a spline are bounded by coefficients on a finer grid (it is a weighted mean of them, overshoot included);
/// what lies between two texels counts for the blocks of both. All heights are relative to the map's base and exact but
/// for the rounding of double precision.
class RangePyramid {
 public:
  RangePyramid() = default;
  /// Takes the time of a few passes over the texels, and two thirds of their memory. [build]
  explicit RangePyramid(const StoredTexels& texels);

  /// Bounds of the whole relief: the least and greatest texel, or coefficient of the spline on a grid twice as fine.
  /// [any]
  [[nodiscard]] const HeightRange& whole() const noexcept { return whole_; }
  /// Bounds over the rectangle s x t of the map this was built from, in a time that does not depend on its size.
  /// [servo]
  [[nodiscard]] HeightRange over(const StoredTexels& texels, const TexelSpan& s, const TexelSpan& t) const noexcept;
  /// Bytes held besides the object itself. [any]
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

 private:
  /// Bounds of one block, rounded outwards.
  struct Block {
    float lowest = 0.0F;
    float highest = 0.0F;
  };
  void build_first_level(const StoredTexels& texels);
  void build_next_level(const StoredTexels& texels, unsigned level);
  [[nodiscard]] HeightRange cover(const StoredTexels& texels, const TexelSpan& s, const TexelSpan& t) const noexcept;

  HeightRange whole_;
  std::vector<Block> blocks_;             // level after level, each row after row from the bottom
  std::vector<std::size_t> level_begin_;  // of the levels from 2 x 2 texels a block to few enough blocks for any span
};

}  // namespace asperity
