#pragma once
// Surfaces given by formulas over two parameters: no triangles, no samples.

#include <string>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/core/work.h"
#include "asperity/field/height/surface_features.h"
#include "asperity/geometry/contact.h"
#include "asperity/surface/parametric/patches.h"

namespace asperity {

/// The formulas.
enum class ParametricShape : std::uint8_t {
  plane,     ///< (u, v, 0): u in 0 … width, v in 0 … depth, centred
  cylinder,  ///< (R cos u, R sin u, v), u the angle, v in 0 … height
  sphere,    ///< radius R, u longitude, v latitude, both in rad; closed at the poles
  torus,     ///< u around the axis at R, v around the tube of radius r
  vase,      ///< of revolution: bottom, belly, neck and lip of Fig. 11; profile rho(v), v the height
  ramp,  ///< (v cos u, v sin u, v^3 + 3 u) of section 3.1.3, u = theta in 0 … pi, v = r in 1 … 3, all times `scale`
};
/// As in scene files.
template <>
struct Names<ParametricShape> {
  static constexpr auto table = std::to_array<Named<ParametricShape>>({{ParametricShape::plane, "plane"},
                                                                       {ParametricShape::cylinder, "cylinder"},
                                                                       {ParametricShape::sphere, "sphere"},
                                                                       {ParametricShape::torus, "torus"},
                                                                       {ParametricShape::vase, "vase"},
                                                                       {ParametricShape::ramp, "ramp"}});
};

/// A formula and its sizes; a member that a shape does not take (parametric_parameters) is left at its default.
struct ParametricSettings {
  ParametricShape shape = ParametricShape::plane;
  double width = 0.1;       ///< plane (m)
  double depth = 0.1;       ///< plane (m)
  double radius = 0.03;     ///< cylinder, sphere, torus; vase: of the widest place, near the bottom (m)
  double tube = 0.01;       ///< torus (m), below radius
  double height = 0.1;      ///< cylinder, vase (m)
  double neck = 1.0 / 3.0;  ///< vase: radius of the neck over that of the widest place, 0.05 to 0.95
  double scale = 0.01;      ///< ramp: metres per unit of the paper's formula
  /// Laid on in (u, v) x `tile` along the normals, as geometry; they have to stay below the surface's radius of
  /// curvature.
  std::vector<SurfaceFeature> features;
  Vec2 tile = Vec2::Ones();  ///< m of feature coordinate per unit of u and v
};

/// Point and derivatives by (u, v), object frame.
struct ParametricJet {
  Vec3 point = Vec3::Zero();
  Vec3 u = Vec3::Zero();
  Vec3 v = Vec3::Zero();
  Vec3 uu = Vec3::Zero();
  Vec3 uv = Vec3::Zero();
  Vec3 vv = Vec3::Zero();
  double height = 0.0;  ///< of the features (m)
};

/// What certainly holds of a whole surface; sampled bounds carry a margin.
struct ParametricLimits {
  // Lengths of the second derivatives of the shape moved along its normals by any height of the features (m).
  double shape_uu = 0.0;
  double shape_uv = 0.0;
  double shape_vv = 0.0;
  // The same with the features on it, where these have no edges.
  double uu = 0.0;
  double uv = 0.0;
  double vv = 0.0;
  double slope_u = 0.0;  ///< of the heights by u and v (m)
  double slope_v = 0.0;
  double lowest = 0.0;  ///< height (m)
  double highest = 0.0;
};

class ParametricView;

/// Immutable; any number of threads. Its front is the side of S_u x S_v, outward for closed shapes.
class ParametricSurface {
 public:
  /// Errors: bad_value naming the member; also where features reach farther than the surface bends. [build]
  static Result<ParametricSurface> build(const ParametricSettings& settings);

  /// What is touched of it. [servo]
  [[nodiscard]] ParametricView view(WorkMeter* work = nullptr) const noexcept;
  [[nodiscard]] double skin() const noexcept { return skin_; }
  [[nodiscard]] Box bounds() const noexcept { return bounds_; }

  /// The surface with its features at a place of the parameters. Second derivatives of features other than gratings are
  /// differences of their gradients; 0 where these have edges. [servo]
  [[nodiscard]] ParametricJet jet(const Vec2& uv) const noexcept;
  /// Unit, on the front. [servo]
  [[nodiscard]] Vec3 normal(const ParametricJet& jet) const noexcept;
  /// Height (m) of a point, very near to the surface at `uv`, over the features that are below it; below 0 under them.
  /// [servo]
  [[nodiscard]] double clearance(const Vec2& uv, const Vec3& point) const noexcept;
  [[nodiscard]] Vec2 lower() const noexcept { return lower_; }  ///< of the parameters
  [[nodiscard]] Vec2 upper() const noexcept { return upper_; }
  [[nodiscard]] bool closed_u() const noexcept { return closed_[0]; }  ///< u comes back to where it started
  [[nodiscard]] bool closed_v() const noexcept { return closed_[1]; }
  /// Whether inside and outside are told apart. [any]
  [[nodiscard]] Sides natural_sides() const noexcept { return sides_; }
  /// Smallest length over which it changes (m). [any]
  [[nodiscard]] double grain() const noexcept { return grain_; }
  /// Distance (m) between places at which a way along it is looked at, so that no ridge is jumped. [servo]
  [[nodiscard]] double stride() const noexcept { return stride_; }
  /// Whether features have edges. [servo]
  [[nodiscard]] bool has_folds() const noexcept { return folds_; }
  /// [servo]
  [[nodiscard]] const ParametricLimits& limits() const noexcept { return limits_; }
  /// The parameters brought back into their range: around where they are closed, to the rim elsewhere. [servo]
  [[nodiscard]] Vec2 within_range(const Vec2& uv) const noexcept;
  /// Patch that holds a place: what messages and traces name as its element. [servo]
  [[nodiscard]] std::uint32_t element_of(const Vec2& uv) const noexcept;
  /// How the front normal changes along the surface (1/m): symmetric, 0 along the normal. [servo]
  [[nodiscard]] Mat3 shape_operator(const ParametricJet& jet) const noexcept;
  [[nodiscard]] const ParametricSettings& settings() const noexcept { return settings_; }
  /// Tells surfaces apart, never 0. [servo]
  [[nodiscard]] std::uint64_t identity() const noexcept { return identity_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

 private:
  friend class ParametricView;
  ParametricSurface() = default;
  Status measure();
  Status check_features() const;
  void make_patches();

  ParametricSettings settings_;
  ParametricLimits limits_;
  ParametricPatches patches_;
  Vec2 lower_ = Vec2::Zero();
  Vec2 upper_ = Vec2::Ones();
  bool closed_[2] = {false, false};
  Sides sides_ = Sides::both;
  double skin_ = 0.0;
  double grain_ = 0.0;
  double stride_ = 0.0;
  bool folds_ = false;
  Box bounds_;
  std::uint64_t identity_ = 0;
};

/// "plane", "cylinder", "sphere", "torus", "vase", "ramp". [any]
const char* parametric_name(ParametricShape shape);
/// Every shape's name. [any]
const std::vector<std::string>& parametric_names();
/// The members of ParametricSettings that a shape takes, by the names that scene files give them. [any]
const std::vector<std::string>& parametric_parameters(ParametricShape shape);

}  // namespace asperity
