#pragma once
// Fine surface features made from formulas (heterogeneous-features-2008, section 3.1): heights over a plane of feature
// coordinates (u, v) in metres, with analytic gradients. What they are laid on is the mapping's business.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/math.h"
#include "asperity/core/result.h"
#include "asperity/field/height/map.h"

namespace asperity {

/// What a feature's heights are made by.
enum class FeatureKind : std::uint8_t {
  grating,           ///< c cos(w u') (eq. 3), u' along `direction`
  circular_grating,  ///< c cos(w r) around `centre` (eq. 4); its gradient is 0 in the centre (erratum d)
  grid,        ///< c cos(w_u u') cos(w_v v') (eq. 5, with the factors w_u and w_v that the print lacks, erratum a)
  triangular,  ///< straight ridges, both flanks alike; slopes of one size (Fig. 7)
  serrated,    ///< straight ridges, the rising flank takes the share `wall` of the wavelength
  noise,       ///< a random surface, smooth and Gaussian, of a given roughness and correlation length
  map,         ///< a height map, one repeat of which is `wavelength` in size
};
/// As in scene files.
template <>
struct Names<FeatureKind> {
  static constexpr auto table = std::to_array<Named<FeatureKind>>({{FeatureKind::grating, "grating"},
                                                                   {FeatureKind::circular_grating, "circular-grating"},
                                                                   {FeatureKind::grid, "grid"},
                                                                   {FeatureKind::triangular, "triangular"},
                                                                   {FeatureKind::serrated, "serrated"},
                                                                   {FeatureKind::noise, "noise"},
                                                                   {FeatureKind::map, "map"}});
};

/// One feature. A member that a kind does not take (feature_parameters) is left at its default.
struct FeatureSpec {
  FeatureKind kind = FeatureKind::grating;
  /// c (m), above 0: heights lie within -c and c. noise: unused. map: unused (the map's heights are metres).
  double amplitude = 0.0;
  /// m, above 0, along u' and v'; the second counts for grid and map alone.
  Vec2 wavelength = Vec2::Zero();
  double direction = 0.0;           ///< rad, of u' from u towards v
  double phase = 0.0;               ///< rad: grating, circular_grating, triangular, serrated
  Vec2 centre = Vec2::Zero();       ///< m: circular_grating
  double wall = 0.25;               ///< serrated: 0.01 to 0.5
  double roughness = 0.0;           ///< noise: R_q (m), above 0. R_a is sqrt(2 / pi) of it
  double correlation_length = 0.0;  ///< noise: m, where the autocorrelation has fallen to 1/e
  std::uint64_t seed = 1;           ///< noise
  /// noise: the pattern repeats after this many metres along u and v, 0: after 64 cells. What is wrapped around a
  /// cylinder or a sphere needs its circumference here.
  Vec2 period = Vec2::Zero();
  std::shared_ptr<const HeightMap> heights;  ///< map
};

/// "grating", "circular-grating", "grid", "triangular", "serrated", "noise", "map". [any]
const char* feature_name(FeatureKind kind);
/// Every kind's name. [any]
const std::vector<std::string>& feature_names();
/// The members of FeatureSpec besides kind that a kind takes; scene files call them the same. [any]
const std::vector<std::string>& feature_parameters(FeatureKind kind);

/// Height of features and its gradient by (u, v).
struct FeatureSample {
  double height = 0.0;           ///< m
  Vec2 gradient = Vec2::Zero();  ///< m/m
};

/// Roughness of a profile or a surface about its mean.
struct Roughness {
  double average = 0.0;     ///< R_a (m)
  double rms = 0.0;         ///< R_q (m)
  double mean_slope = 0.0;  ///< mean of the absolute slope (m/m)
};

/// One feature, ready to be sampled. Immutable; copies share what is large.
class SurfaceFeature {
 public:
  /// Errors: bad_value naming the member and what it accepts. [build]
  static Result<SurfaceFeature> build(const FeatureSpec& spec);

  /// [servo]
  [[nodiscard]] FeatureSample sample(const Vec2& uv) const noexcept;
  /// Unit, across the lay at a place: the direction in which heights change, whether they do right there or not. Zero
  /// where there is none (grid, noise, map; the centre of circles). [servo]
  [[nodiscard]] Vec2 across(const Vec2& uv) const noexcept;
  /// Wavelength (m) that has to be rendered for the feature to be felt at all: the shorter one of a grid, four
  /// correlation lengths of noise, four texels of a map. [any]
  [[nodiscard]] double wavelength() const noexcept { return wavelength_; }
  [[nodiscard]] double lowest() const noexcept { return lowest_; }    ///< m, a bound
  [[nodiscard]] double highest() const noexcept { return highest_; }  ///< m, a bound
  /// Along a line in a direction (rad from u towards v), over so long that it counts for all. From formulas where there
  /// are any. [any]
  [[nodiscard]] Roughness roughness_along(double direction) const;
  /// As built: the direction and the phase as they were, the period of noise as it came out. [any]
  [[nodiscard]] const FeatureSpec& spec() const noexcept { return spec_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

 private:
  SurfaceFeature() = default;
  Status prepare_noise();
  [[nodiscard]] FeatureSample sample_ridges(double along) const noexcept;
  [[nodiscard]] FeatureSample sample_noise(const Vec2& uv) const noexcept;

  FeatureSpec spec_;
  double wavelength_ = 0.0;
  double lowest_ = 0.0;
  double highest_ = 0.0;
  // Derived once.
  Vec2 axis_ = Vec2::UnitX();                          // of u' in (u, v)
  Vec2 frequency_ = Vec2::Zero();                      // rad/m along u' and v'
  Vec2 per_repeat_ = Vec2::Zero();                     // 1/m: repeats per metre along u' and v'; noise: along u and v
  double rise_ = 0.0;                                  // ridges: slope of the rising flank
  double fall_ = 0.0;                                  // ridges: slope of the falling one, below 0
  double falling_share_ = 0.0;                         // ridges: of the wavelength, from a crest on
  int columns_ = 0;                                    // noise: cells of a repeat
  int rows_ = 0;                                       // noise
  std::shared_ptr<const std::vector<float>> lattice_;  // noise: spline coefficients (m), three more along each axis
};

/// Where features wear off, as Tab. 1 has it.
enum class FeatureScale : std::uint8_t {
  friction,  ///< microns: felt as friction
  texture,   ///< up to some millimetres: felt as texture force
  shape,     ///< larger: part of the geometry
};
/// As in scene files.
template <>
struct Names<FeatureScale> {
  static constexpr auto table = std::to_array<Named<FeatureScale>>(
      {{FeatureScale::friction, "friction"}, {FeatureScale::texture, "texture"}, {FeatureScale::shape, "geometry"}});
};
/// Limits of the middle class (m).
struct FeatureScales {
  /// Finer is friction: a tenth of a millimetre, or five steps of the device if that is more (errata; section 4.2:
  /// "only five different levels ... imprecise").
  double friction_below = 1e-4;
  /// From this on it is shape: "around 5 mm or larger are considered as small shape features" (section 4.2).
  double shape_from = 5e-3;
};
/// `resolution`: of the device (m), 0 for an ideal one. [any]
FeatureScales feature_scales(double resolution) noexcept;
/// heterogeneous-features-2008, Tab. 1, by wavelength. [any]
FeatureScale scale_of(double wavelength, const FeatureScales& scales) noexcept;
/// "friction", "texture", "geometry". [any]
const char* scale_name(FeatureScale scale);

/// The sum of the features as a height map over the rectangle from `lower` to `upper` (m), `texels` along each: bicubic
/// no finer than that. For what is to become geometry. Errors: bad_value, too_large. [build]
Result<HeightMap> bake(const std::vector<SurfaceFeature>& features, const Vec2& lower, const Vec2& upper, int columns,
                       int rows, Wrap wrap);

}  // namespace asperity
