#pragma once
// The formulas of parametric surfaces: points, normals and their derivatives. Private to surface.

#include "asperity/surface/parametric/surface.h"

namespace asperity {

/// A unit normal and its derivatives by (u, v).
struct NormalJet {
  Vec3 n = Vec3::Zero();
  Vec3 u = Vec3::Zero();
  Vec3 v = Vec3::Zero();
  Vec3 uu = Vec3::Zero();
  Vec3 uv = Vec3::Zero();
  Vec3 vv = Vec3::Zero();
};

/// The smooth shape without features. `normals` nullptr: not asked for. [servo]
void shape_jet(const ParametricSettings& settings, const Vec2& uv, ParametricJet& out, NormalJet* normals) noexcept;
/// Height of all features and its gradient by (u, v), in m per unit of these. [servo]
FeatureSample feature_heights(const ParametricSettings& settings, const Vec2& uv) noexcept;
/// Whether a feature has edges, where its slope jumps. [any]
inline bool has_edges(FeatureKind kind) noexcept {
  return kind == FeatureKind::triangular || kind == FeatureKind::serrated;
}
/// Range of the parameters. [any]
void shape_range(const ParametricSettings& settings, Vec2& lower, Vec2& upper);
/// Whether u runs around an axis at right angles to v. [servo]
inline bool of_revolution(ParametricShape shape) noexcept {
  return shape != ParametricShape::plane && shape != ParametricShape::ramp;
}
/// Errors: bad_value naming the member. Does not look at the features. [build]
Status check_shape(const ParametricSettings& settings);

}  // namespace asperity
