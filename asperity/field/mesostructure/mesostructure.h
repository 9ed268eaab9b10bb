#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "asperity/core/math.h"
#include "asperity/core/result.h"
#include "asperity/field/height/detail_pyramid.h"
#include "asperity/field/height/map.h"
#include "asperity/field/height/normal_map.h"

namespace asperity {

/// One reading of a mesostructure.
struct MesostructureSample {
  double height = 0.0;           ///< m over the base surface
  Vec2 gradient = Vec2::Zero();  ///< (dH/ds, dH/dt), m per unit of texture coordinate
  Vec3 normal = Vec3::UnitZ();   ///< unit, tangent frame: x along +s, y along +t, z outward
};

/// The normal of a relief with this gradient: n ~ (-dH/ds / tile.x, -dH/dt / tile.y, 1), unit. `gradient` in m per unit
/// of texture coordinate, `tile` the size of one repeat (m). [servo]
[[nodiscard]] inline Vec3 normal_from_gradient(const Vec2& gradient, const Vec2& tile) noexcept {
  return Vec3(-gradient.x() / tile.x(), -gradient.y() / tile.y(), 1.0).normalized();
}

/// Hybrid rugosity mesostructure: a height map and normals over one physical tile (hrm-2010, section 4). Without a
/// given normal map the normals are those of the reconstructed heights at the very point asked. Immutable.
class Mesostructure {
 public:
  /// `tile` is the size of one repeat of the map (m). Errors: bad_value when it is below 1e-12 m or not finite. [build]
  static Result<Mesostructure> build(HeightMap heights, const Vec2& tile);
  /// The same with normals of their own; the maps may differ in size, not in wrap (mismatch). [build]
  static Result<Mesostructure> build(HeightMap heights, NormalMap normals, const Vec2& tile);

  /// Height, gradient and normal at texture coordinates `st`. [servo]
  [[nodiscard]] MesostructureSample sample(const Vec2& st) const noexcept;
  /// Height with its derivatives at a level of detail: 0 the map itself, between two levels mixed. Without a pyramid
  /// every level is 0. [servo]
  [[nodiscard]] HeightCurvature curvature(const Vec2& st, double level) const noexcept {
    return level <= 0.0 || detail_ == nullptr ? heights_.curvature(st) : mixed_curvature(st, level);
  }
  /// That height alone (m). [servo]
  [[nodiscard]] double height(const Vec2& st, double level) const noexcept {
    return level <= 0.0 || detail_ == nullptr ? heights_.height_at(st) : mixed_curvature(st, level).height;
  }
  /// The same at several places at once, equal to the bit. [servo]
  void heights(const Lanes& s, const Lanes& t, double level, Lanes& heights) const noexcept {
    if (level <= 0.0 || detail_ == nullptr) return heights_.heights_at(s, t, heights);
    for (std::size_t i = 0; i < lanes; ++i) heights[i] = mixed_curvature(Vec2(s[i], t[i]), level).height;
  }
  /// Bounds of that height over a rectangle, as HeightMap::range_over. [servo]
  [[nodiscard]] HeightRange range_over(const Vec2& lower, const Vec2& upper, double level) const noexcept;
  /// A plane that it keeps to, as HeightMap::plane_over. [servo]
  [[nodiscard]] HeightPlane plane_over(const Vec2& lower, const Vec2& upper, double level) const noexcept;
  /// The same mesostructure with levels of detail. [build]
  [[nodiscard]] Mesostructure with_detail(std::shared_ptr<const DetailPyramid> detail) const;
  /// Its levels of detail, or nullptr. [any]
  [[nodiscard]] const DetailPyramid* detail() const noexcept { return detail_.get(); }
  /// Bounds of every height at every level (m). [any]
  [[nodiscard]] HeightRange range() const noexcept;

  [[nodiscard]] const HeightMap& heights() const noexcept { return heights_; }
  [[nodiscard]] bool has_normal_map() const noexcept { return normals_.has_value(); }
  /// The given normal map, or nullptr. [any]
  [[nodiscard]] const NormalMap* normals() const noexcept { return normals_ ? &*normals_ : nullptr; }
  /// Size of one repeat (m). [any]
  [[nodiscard]] const Vec2& tile() const noexcept { return tile_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

 private:
  [[nodiscard]] HeightCurvature mixed_curvature(const Vec2& st, double level) const noexcept;
  Mesostructure(HeightMap heights, std::optional<NormalMap> normals, const Vec2& tile);

  /// The two maps that a level lies between, and the part of the way from the first to the second.
  struct BetweenMaps {
    const HeightMap* first;
    const HeightMap* second;
    double part;
  };
  [[nodiscard]] BetweenMaps maps_at(double level) const noexcept;

  HeightMap heights_;
  std::optional<NormalMap> normals_;
  std::shared_ptr<const DetailPyramid> detail_;
  Vec2 tile_ = Vec2::Ones();
};

/// How well a given normal map belongs to a height map. Slopes are (-n_x / n_z, -n_y / n_z) of the normals against
/// central differences of the heights, compared with their means removed: point by point and averaged over blocks of 2,
/// 4, 8 ... points, of which the best fitting counts, because real pairs often differ in their finest detail
/// (compression, levels, filters).
struct NormalAgreement {
  double correlation = 0.0;          ///< of both slopes together, -1 to 1; 0 when either map is flat
  double flipped_correlation = 0.0;  ///< the same with the green channel the other way round
  double correlation_s = 0.0;        ///< of the slopes along s alone
  double correlation_t = 0.0;        ///< of the slopes along t alone
  double scale = 0.0;                ///< least-squares ratio of given slopes to the heights' slopes; 1: same amplitude
  double rms_angle = 0.0;            ///< rad, between the given normals and those of the heights, point by point
  int block = 1;                     ///< points a side averaged over, where the maps fit best
  bool green_flipped_fits_better = false;  ///< the other GreenConvention agrees clearly better
  bool heights_flat = false;               ///< the heights have no slope: nothing to compare
  bool normals_flat = false;               ///< the normal map is one direction throughout
};

/// Compares on a grid of at most 512 x 512 points. `tile` is the size of one repeat (m). [build]
NormalAgreement compare_normals(const HeightMap& heights, const NormalMap& normals, const Vec2& tile);

/// One sentence when a normal map does not belong to its heights, with the likeliest cause (other green convention,
/// inverted heights, another picture); nothing when it does. Normal maps are authored with an unknown height scale, so
/// a scale other than 1 alone is no disagreement. [build]
std::optional<std::string> disagreement_warning(const NormalAgreement& agreement);

}  // namespace asperity
