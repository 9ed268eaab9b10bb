#pragma once
// What is felt of a surface beside its geometry: texture, and friction that depends on place and direction
// (heterogeneous-features-2008). F = F_constraint + F_friction + F_texture (eq. 1).

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "asperity/core/formulation.h"
#include "asperity/core/result.h"
#include "asperity/core/units.h"
#include "asperity/field/height/map.h"
#include "asperity/field/height/surface_features.h"
#include "asperity/surface/feature_mapping.h"

namespace asperity {

/// Coefficients of friction over a surface: a map of factors.
struct FrictionMap {
  std::shared_ptr<const HeightMap> factors;  ///< of both coefficients, not negative
  Vec2 tile = Vec2::Ones();                  ///< m of feature coordinate that one repeat covers
};

/// Friction that depends on the direction.
struct FrictionLay {
  double still_ratio = 1.0;      ///< static coefficient along the lay over that across it, 0 to 1
  double sliding_ratio = 1.0;    ///< dynamic one, likewise
  double stiffness_ratio = 1.0;  ///< of the friction law's spring (k_s of eq. 13), likewise, 0.01 to 1
  /// literal: eq. 15, interpolated by the velocity's angle to the gradient; consistent: elliptic.
  Formulation formulation = Formulation::consistent;
  /// Direction across the lay (rad from u towards v). Without one it is that of the micro features, else of the first
  /// texture that has one, else u.
  std::optional<double> direction;
};

/// Where the lateral force comes from.
enum class TextureSource : std::uint8_t {
  features,  ///< procedural features and maps, by the mapping
  coat,      ///< the coat of a mesh that is felt as its bare base: its heights, and its normal map in the literal form
};
/// As in scene files.
template <>
struct Names<TextureSource> {
  static constexpr auto table =
      std::to_array<Named<TextureSource>>({{TextureSource::features, "features"}, {TextureSource::coat, "coat"}});
};

/// A coefficient of friction by direction in the plane of the features: e M e for a unit direction e.
struct LayMatrix {
  double uu = 0.0;
  double uv = 0.0;
  double vv = 0.0;
  /// `across` the unit direction `axis`, `along` at right angles to it; `across` everywhere where the axis is zero.
  static LayMatrix of(double across, double along, const Vec2& axis) noexcept {
    if (axis.isZero()) return {across, 0.0, across};
    const double more = across - along;
    return {along + more * axis.x() * axis.x(), more * axis.x() * axis.y(), along + more * axis.y() * axis.y()};
  }
  LayMatrix operator+(const LayMatrix& other) const noexcept { return {uu + other.uu, uv + other.uv, vv + other.vv}; }
  [[nodiscard]] double along(const Vec2& e) const noexcept {
    return e.x() * e.x() * uu + 2.0 * e.x() * e.y() * uv + e.y() * e.y() * vv;
  }
  /// The unit direction of the largest coefficient; zero where all are alike. [servo]
  [[nodiscard]] Vec2 principal() const noexcept;
};

/// Settings of FineFeatures.
struct FineSettings {
  FeatureMapping mapping;
  TextureSource source = TextureSource::features;
  std::vector<SurfaceFeature> texture;  ///< felt as texture force
  /// Too fine for a texture: they give friction its lay, and each adds its mean slope to the coefficients across.
  std::vector<SurfaceFeature> micro;
  /// Of the texture force.
  ///   literal     -grad h N with N the constraint's force (eq. 12), which feeds energy (erratum k), and the gradient
  ///               in space (eq. 8) rather than along the surface; on a formula's surface around a cylinder the angle
  ///               counts twice (erratum c)
  ///   consistent  the slope of one potential: spring force k p with p the penetration to the relief, whose crests lie
  ///               on the surface
  Formulation formulation = Formulation::consistent;
  FrictionLay lay;
  FrictionMap friction_map;
  double resolution = 0.0;  ///< of the device's position (m), 0: ideal
};

/// Immutable and shared by the scenes that follow one another. [any]
class FineFeatures {
 public:
  static constexpr std::size_t most_features = 16;
  /// Errors: bad_value, mismatch, naming the member. [build]
  static Result<FineFeatures> build(FineSettings settings);

  [[nodiscard]] const FineSettings& settings() const noexcept { return settings_; }
  /// Whether any texture force is felt. [servo]
  [[nodiscard]] bool has_texture() const noexcept {
    return settings_.source == TextureSource::coat || !settings_.texture.empty();
  }
  /// Whether friction depends on place or direction. [servo]
  [[nodiscard]] bool shapes_friction() const noexcept { return shapes_friction_; }
  /// Upper bound of the texture's height (m): what its crests are lowered by in the consistent form. [servo]
  [[nodiscard]] double highest() const noexcept { return highest_; }
  /// What the micro features add to both coefficients: along every direction the root of the sum of their squared mean
  /// slopes, for a load is carried up each of them and let fall behind it. [servo]
  [[nodiscard]] LayMatrix interlock(const Vec2& uv) const noexcept;
  [[nodiscard]] bool interlocks() const noexcept { return !settings_.micro.empty(); }
  /// Direction across the lay that the ratios go by, unit; zero where the feature that has it has none. [servo]
  [[nodiscard]] Vec2 across(const Vec2& uv) const noexcept;
  /// Steepest slope of a texture feature where the mapping does not stretch it (m/m). [servo]
  [[nodiscard]] double steepness(std::size_t texture) const noexcept { return steepness_[texture]; }
  /// Steeper slopes are not rendered: a force 4 times the push. Where a mapping crowds a texture beyond that it is
  /// felt weaker.
  static constexpr double most_slope = 4.0;

 private:
  FineFeatures() = default;

  FineSettings settings_;
  bool shapes_friction_ = false;
  double highest_ = 0.0;
  LayMatrix interlock_;
  Vec2 micro_across_ = Vec2::Zero();  ///< where the micro features are roughest; zero: alike in all directions
  bool rings_ = false;                ///< the one micro feature is round: its lay turns with the place
  std::vector<double> steepness_;
};

/// How much of a texture of some wavelength is felt, 0 to 1. Below two samples or two steps of the device a wavelength
/// would be felt as another one (errata l); it fades in up to four.
///   `wavelength` on the surface (m), `speed` along it (m/s), `resolution` (m). [servo]
double texture_share(double wavelength, double speed, Seconds dt, double resolution) noexcept;

}  // namespace asperity
