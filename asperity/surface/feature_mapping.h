#pragma once
// Laying features on a surface: the two-stage shrink-wrap mapping (heterogeneous-features-2008, section 3.2).

#include <cstdint>
#include <optional>

#include "asperity/core/fixed_vector.h"
#include "asperity/core/formulation.h"
#include "asperity/core/math.h"
#include "asperity/core/result.h"
#include "asperity/field/height/surface_features.h"
#include "asperity/geometry/mesh.h"

namespace asperity {

/// The surface between features and object. A ray along its normal leads from a point of the object to it (O-mapping,
/// Fig. 3).
enum class IntermediateSurface : std::uint8_t {
  plane,     ///< u along `reference`, v along axis x reference (m)
  cylinder,  ///< u = radius x angle around `axis` from `reference`, -pi to pi; v along the axis (m)
  sphere,    ///< u = radius x longitude, v = radius x latitude (m), the poles on `axis`
  box,       ///< six planes, each with its own two edges as u and v; mixed near the box's edges so that nothing jumps
  uv,        ///< no surface between: the mesh's own texture coordinates, or a parametric surface's parameters, x `tile`
};
/// As in scene files.
template <>
struct Names<IntermediateSurface> {
  static constexpr auto table = std::to_array<Named<IntermediateSurface>>({{IntermediateSurface::plane, "plane"},
                                                                           {IntermediateSurface::cylinder, "cylinder"},
                                                                           {IntermediateSurface::sphere, "sphere"},
                                                                           {IntermediateSurface::box, "box"},
                                                                           {IntermediateSurface::uv, "uv"}});
};

/// Settings of FeatureMapping.
struct FeatureMappingSettings {
  IntermediateSurface surface = IntermediateSurface::plane;
  Vec3 origin = Vec3::Zero();      ///< object frame (m)
  Vec3 axis = Vec3::UnitZ();       ///< unit; normal of the plane, axis of the cylinder
  Vec3 reference = Vec3::UnitX();  ///< unit, at right angles to the axis
  double radius = 0.0;             ///< cylinder, sphere: above 0 (m)
  /// cylinder, sphere: angles [theta_1, theta_2] (rad) that features are wrapped over (eq. 6), from which on u counts;
  /// at most one turn. They go on beyond both up to the seam opposite their middle, and need not close: where they
  /// do not, their heights step there. Without a range u goes once around and they have to.
  std::optional<Vec2> range = std::nullopt;
  Vec3 half_extent = Vec3::Zero();  ///< box: above 0 (m), along reference, axis x reference, axis
  Vec2 tile = Vec2::Ones();         ///< uv: m per unit, above 0
};

/// Where a point of the object lies in the plane of the features.
struct MappedPlace {
  Vec2 uv = Vec2::Zero();  ///< m
  Vec3 du = Vec3::Zero();  ///< gradient of u in space (m/m): the chain rule of eq. 7 to 9
  Vec3 dv = Vec3::Zero();
  double weight = 1.0;          ///< of this place among several; they sum to 1
  Vec3 dweight = Vec3::Zero();  ///< gradient of the weight (1/m)
};
using MappedPlaces = FixedVector<MappedPlace, 3>;

/// Immutable. Object frame.
class FeatureMapping {
 public:
  FeatureMapping() = default;
  /// Errors: bad_value naming the member. [build]
  static Result<FeatureMapping> build(const FeatureMappingSettings& settings);

  /// Every intermediate surface but `uv`. On the axis of a cylinder or a sphere the gradients are 0. [servo]
  void map(const Vec3& point, MappedPlaces& out) const noexcept;
  /// `uv` on a mesh with texture coordinates: of `face`, at the projection of `point` on its plane. [servo]
  [[nodiscard]] MappedPlace on_mesh(const TriangleMesh& mesh, std::uint32_t face, const Vec3& point) const noexcept;

  [[nodiscard]] const FeatureMappingSettings& settings() const noexcept { return settings_; }
  /// Length (m) after which u comes back to where it started, 0 where it need not: around a cylinder or a sphere
  /// without a range. [any]
  [[nodiscard]] double circumference() const noexcept;
  /// Whether a feature closes where u comes back: a whole number of repeats has to go once around, to a ten-thousandth
  /// of one; circles never close. Errors: mismatch, naming the nearest lengths that fit. [build]
  [[nodiscard]] Status check(const SurfaceFeature& feature) const;
  /// The angle of the seam (rad, from the reference) and what u is just before and behind it (m). A round mapping.
  /// [any]
  struct Seam {
    double angle = 0.0;
    double last = 0.0;
    double first = 0.0;
  };
  [[nodiscard]] Seam seam() const noexcept;
  /// Counts the angle around a cylinder once more, as the example of section 3.1.3 prints it (erratum c): where the
  /// height along the axis of a surface with this normal changes with the angle, du gains the angle's derivative by
  /// that height, over the distance from the axis in the example's unit, which is the length that eq. 6 calls 1. Other
  /// surfaces between are left as they are. [servo]
  void count_angle_twice(const Vec3& point, const Vec3& normal, MappedPlace& place) const noexcept;

 private:
  void map_box(const Vec3& local, MappedPlaces& out) const noexcept;

  FeatureMappingSettings settings_;
  Vec3 second_ = Vec3::UnitY();  // axis x reference
  double middle_ = 0.0;          // of the range (rad)
  double half_ = 0.0;            // width of the range (rad)
};

/// The part of `gradient` in the tangent plane of a surface with unit normal `normal`: what a surface gradient is
/// (erratum c). [servo]
[[nodiscard]] inline Vec3 surface_gradient(const Vec3& gradient, const Vec3& normal) noexcept {
  return gradient - normal.dot(gradient) * normal;
}

}  // namespace asperity
