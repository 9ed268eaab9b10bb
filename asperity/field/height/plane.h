#pragma once

#include <cstddef>
#include <vector>

#include "asperity/core/math.h"
#include "asperity/field/height/range.h"

namespace asperity {

/// A plane that a relief keeps to over a rectangle of texture coordinates around `centre`: |H(st) - height - slope .
/// (st - centre)| <= error for each st of it.
struct HeightPlane {
  Vec2 centre = Vec2::Zero();
  double height = 0.0;        ///< m, at the centre
  Vec2 slope = Vec2::Zero();  ///< m per unit of texture coordinate
  double error = 0.0;         ///< m
};

/// The same over a span of texels.
struct TexelPlane {
  double height = 0.0;        ///< m, at the middle of the span
  Vec2 slope = Vec2::Zero();  ///< m a texel
  double error = 0.0;         ///< m
};

/// A plane with its error over every block of 4 x 4, 8 x 8, 16 x 16 ... texels, and from them over any rectangle: where
/// a relief is smooth the error falls with the square of the rectangle's size, where it is rough it is what the relief
/// has beside its slope. All heights are relative to the map's base. Of `nearest` there is no slope to know: its planes
/// are level.
class PlanePyramid {
 public:
  PlanePyramid() = default;
  /// Takes a third of the texels' memory. [build]
  explicit PlanePyramid(const StoredTexels& texels);

  /// Over the rectangle s x t of the map this was built from. On few texels exact to a term of second order in the
  /// rectangle; on more from at most 12 blocks. `level_s`, `level_t`: there may be no slope along that axis. [servo]
  [[nodiscard]] TexelPlane over(const StoredTexels& texels, const TexelSpan& s, const TexelSpan& t, bool level_s,
                                bool level_t) const noexcept;
  /// Bytes held besides the object itself. [any]
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

 private:
  /// Of one block, about its middle.
  struct Block {
    float height = 0.0F;
    float slope_s = 0.0F;
    float slope_t = 0.0F;
    float error = 0.0F;
  };
  class Fit;
  static Block rounded(const TexelPlane& plane, double half_s, double half_t) noexcept;
  void build_first_level(const StoredTexels& texels);
  void build_next_level(const StoredTexels& texels, unsigned level);

  std::vector<Block> blocks_;             // level after level, each row after row from the bottom
  std::vector<std::size_t> level_begin_;  // of the levels from 4 x 4 texels a block to a single one
};

}  // namespace asperity
