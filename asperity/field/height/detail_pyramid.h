#pragma once
// The same relief with ever less detail: what a larger probe follows, or what is left when it is seen from afar.

#include <cstddef>
#include <memory>
#include <vector>

#include "asperity/core/math.h"
#include "asperity/core/result.h"
#include "asperity/field/height/map.h"

namespace asperity {

/// What a level leaves out.
enum class DetailKind {
  /// H_r(x) = max over |u| <= r of H(x + u) + sqrt(r^2 - |u|^2) - r: what a ball of radius r really follows
  dilation,
  /// wavelengths below the level's scale: a quadratic B-spline (three boxes as wide as the scale along each
  /// axis), which lets through nothing of that wavelength, at most 1 % of any shorter one, 26 % of twice and 73 % of
  /// four times its length, and never leaves the map's range
  low_pass,
};
/// As in scene files.
template <>
struct Names<DetailKind> {
  static constexpr auto table =
      std::to_array<Named<DetailKind>>({{DetailKind::dilation, "dilation"}, {DetailKind::low_pass, "low_pass"}});
};

/// How a pyramid is made.
struct DetailSettings {
  DetailKind kind = DetailKind::dilation;
  /// Scale of level 1 (m on the tile): radius of the ball, or shortest wavelength that is left. 0: one texel's size
  /// (dilation), two texels (low pass).
  double finest = 0.0;
  /// Levels beside the map itself, each of twice the scale of the one before; 0: as many as the map has octaves.
  int levels = 0;
  /// Bytes that the levels together may take.
  std::size_t most_bytes = std::size_t{256} << 20U;
};

/// A relief's levels of detail (formulation, D5: haptic mipmapping). Level 0 is the map itself; the last level of a
/// low-pass pyramid is flat, the map's mean. Between two levels heights are mixed in proportion. Reconstruction and
/// wrap are the map's. Dilation levels have the map's texels; low-pass levels of a spline have fewer, at least four for
/// the shortest wavelength that is left, and the flat one has a single texel. Immutable; any number of threads may read
/// it.
class DetailPyramid {
 public:
  static constexpr int most_levels = 16;
  /// `tile`: size of one repeat (m), in which scales are measured. Errors: bad_value (tile, finest, levels), too_large
  /// (before anything is allocated). [build]
  static Result<DetailPyramid> build(const HeightMap& heights, const Vec2& tile, const DetailSettings& settings);

  /// Of levels that were made otherwise, each as large as `heights`, with the kind and the scales of `like`, of which
  /// there are as many. Errors: mismatch, too_large. [build]
  static Result<DetailPyramid> build(const HeightMap& heights, std::vector<HeightMap> levels,
                                     const DetailPyramid& like);

  [[nodiscard]] DetailKind kind() const noexcept { return kind_; }
  /// Levels beside the map itself. [any]
  [[nodiscard]] int levels() const noexcept { return static_cast<int>(maps_.size()); }
  /// Level 1 to levels(). [servo]
  [[nodiscard]] const HeightMap& map(int level) const noexcept { return *maps_[static_cast<std::size_t>(level) - 1]; }
  /// Scale of a level (m on the tile); 0 for level 0, infinite for a flat one. [servo]
  [[nodiscard]] double scale(int level) const noexcept {
    return level == 0 ? 0.0 : scales_[static_cast<std::size_t>(level) - 1];
  }
  /// Largest distance between the map's height and that of the level, anywhere (m), bounded as HeightMap::lowest is;
  /// never falls with the level. [servo]
  [[nodiscard]] double removed(int level) const noexcept {
    return level == 0 ? 0.0 : removed_[static_cast<std::size_t>(level) - 1];
  }
  /// The level (with its fraction) of this scale: 0 for 0 and below, in proportion up to level 1, from there one more
  /// for each doubling, at most levels(). [servo]
  [[nodiscard]] double level_of_scale(double scale) const noexcept;
  /// The coarsest level (with its fraction) that leaves out no more height than this (m), by mixing: 0 for 0, rising
  /// with it. Where `removed` does not rise from one level to the next, a little finer, so that it is continuous.
  /// [servo]
  [[nodiscard]] double level_of_removed(double height) const noexcept;
  /// Bytes held. [any]
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

 private:
  DetailPyramid() = default;
  /// Builds a level's map from what measures it against `heights`.
  Status add(const HeightMap& heights, HeightMap level, double scale);

  DetailKind kind_ = DetailKind::dilation;
  double finest_ = 0.0;  ///< m, scale of level 1
  std::vector<std::shared_ptr<const HeightMap>> maps_;
  std::vector<double> scales_;
  std::vector<double> removed_;
  std::vector<double> climb_;  ///< `removed`, made to rise from level to level
};

/// The relief that a ball of radius `radius` (m) follows: max over |u| <= radius of H(x + u) + sqrt(radius^2 - |u|^2) -
/// radius, at every texel, from the reconstruction's texels: exact, found by branch and bound over blocks of texels.
/// Takes 0.1 to 3 s for 1024 x 1024 texels, whatever the radius. Reconstruction and wrap as the map's. Errors:
/// bad_value (tile, radius), too_large (more than 2^25 texels). [build]
Result<HeightMap> dilated(const HeightMap& heights, const Vec2& tile, double radius);

}  // namespace asperity
