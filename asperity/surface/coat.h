#pragma once

#include <memory>

#include "asperity/core/result.h"
#include "asperity/field/mesostructure.h"
#include "asperity/geometry/mesh.h"

namespace asperity {

/// How texture coordinates are found on a triangle.
///   per_face   every triangle carries the map's lower left, lower right and (1/2, sqrt(3)/2): equilateral triangles
///   keep angles uv         the mesh's own corner UVs, times `repeat` triplanar  the position projected along the three
///   axes, one tile of the map each, mixed by the fourth powers of the
///              smooth normal's components: continuous over every edge, no UVs needed
enum class Mapping { per_face, uv, triplanar };

/// How a mesostructure lies on a mesh.
struct CoatSettings {
  Mapping mapping = Mapping::uv;
  Vec2 repeat = Vec2::Ones();  ///< uv and per_face: how often the map fits into one unit of texture coordinate, above 0
};

/// The coat at one place of one triangle, object frame.
struct CoatSample {
  double height = 0.0;           ///< H (m), positive outward
  Vec3 gradient = Vec3::Zero();  ///< surface gradient of H in the triangle's plane (m/m)
  Vec3 normal =
      Vec3::Zero();  ///< unit normal of the relief: the given normal map's where there is one, else from `gradient`
};

/// A mesostructure laid on a mesh (hrm-2010, section 4). Immutable; shares the maps with other coats.
class Coat {
 public:
  /// Errors: bad_value (repeat), mismatch (uv mapping on a mesh without UVs, or with UVs that span no area). [build]
  static Result<Coat> build(const TriangleMesh& mesh, std::shared_ptr<const Mesostructure> maps,
                            const CoatSettings& settings);

  /// The coat over the point of `face` with these barycentric coordinates, which may lie outside the triangle (its
  /// plane and its mapping are continued): stitching needs that. [servo]
  [[nodiscard]] CoatSample sample(const TriangleMesh& mesh, std::uint32_t face, const Vec3& barycentric) const noexcept;

  /// Bounds of every height of the coat (m), overshoot of the reconstruction included. [any]
  [[nodiscard]] double lowest() const noexcept { return maps_->heights().lowest(); }
  [[nodiscard]] double highest() const noexcept { return maps_->heights().highest(); }
  /// mh of the papers: the largest absolute height (m). [any]
  [[nodiscard]] double amplitude_bound() const noexcept { return std::max(std::abs(lowest()), std::abs(highest())); }
  /// Size of one texel on the surface (m), the median over the faces: the finest thing that can be felt. [any]
  [[nodiscard]] double texel_size() const noexcept { return texel_size_; }
  [[nodiscard]] const Mesostructure& maps() const noexcept { return *maps_; }
  [[nodiscard]] const CoatSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return sizeof(*this) + maps_->memory_bytes(); }

 private:
  Coat() = default;
  [[nodiscard]] CoatSample sample_flat(const TriangleMesh& mesh, std::uint32_t face,
                                       const Vec3& barycentric) const noexcept;
  [[nodiscard]] CoatSample sample_triplanar(const TriangleMesh& mesh, std::uint32_t face,
                                            const Vec3& barycentric) const noexcept;

  std::shared_ptr<const Mesostructure> maps_;
  CoatSettings settings_;
  double texel_size_ = 0.0;
};

/// Gradients of the three barycentric coordinates over the plane of a triangle (1/m), and its unit normal. [servo]
struct BarycentricFrame {
  Vec3 gradient[3];
  Vec3 normal = Vec3::Zero();
  Vec3 corner = Vec3::Zero();  ///< the first corner (m)
  /// Barycentric coordinates of the orthogonal projection of `p`. [servo]
  [[nodiscard]] Vec3 coordinates(const Vec3& p) const noexcept {
    const Vec3 offset = p - corner;
    const double v = gradient[1].dot(offset);
    const double w = gradient[2].dot(offset);
    return {1.0 - v - w, v, w};
  }
  /// Signed height of `p` over the plane (m). [servo]
  [[nodiscard]] double height(const Vec3& p) const noexcept { return normal.dot(p - corner); }
};
BarycentricFrame barycentric_frame(const TriangleMesh& mesh, std::uint32_t face) noexcept;

}  // namespace asperity
