#pragma once

#include <memory>
#include <span>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/field/mesostructure/mesostructure.h"
#include "asperity/field/mesostructure/solid.h"
#include "asperity/geometry/mesh.h"
#include "asperity/surface/height_form.h"
#include "asperity/surface/height_jet.h"
#include "asperity/surface/material_maps.h"
#include "asperity/surface/stitching.h"

namespace asperity {

/// How texture coordinates are found on a triangle.
///   per_face   every triangle carries the map's lower left, lower right and (1/2, sqrt(3)/2): equilateral triangles
///              keep angles
///   uv         the mesh's own corner UVs, times `repeat`
///   triplanar  the position projected along the three axes, one tile of the map each, mixed by the smooth normal n:
///              axis a weighs max(0, n_a^2 - |n|^2 / 5)^2, so that within about 27 degrees of an axis it is alone.
///              Continuous over every edge, no UVs needed
enum class Mapping { per_face, uv, triplanar };
/// As in scene files.
template <>
struct Names<Mapping> {
  static constexpr auto table = std::to_array<Named<Mapping>>(
      {{Mapping::uv, "uv"}, {Mapping::per_face, "per_face"}, {Mapping::triplanar, "triplanar"}});
};

/// How a mesostructure lies on a mesh.
struct CoatSettings {
  Mapping mapping = Mapping::uv;
  Vec2 repeat = Vec2::Ones();  ///< uv and per_face: how often the map fits into one unit of texture coordinate, above 0
  Stitching stitching = {};    ///< how heights are joined where neighbouring faces disagree
};

/// Which of its states a coat is asked about: it may have levels of detail and change with time.
struct CoatMoment {
  double level = 0.0;  ///< of detail: 0 the finest, between two levels heights are mixed
  double time = 0.0;   ///< s
  friend bool operator==(const CoatMoment&, const CoatMoment&) = default;
};

/// Another mesostructure summed to the first: a map laid by the coat's own mapping, or a solid one in the mesh's frame.
struct CoatLayer {
  std::shared_ptr<const Mesostructure> maps;  ///< flat mappings: `repeat` times the coat's; triplanar: by its own tile
  Vec2 repeat = Vec2::Ones();                 ///< above 0
  std::shared_ptr<const SolidMesostructure> solid;  ///< in place of `maps`
};

/// What a coat is made of.
struct CoatParts {
  std::vector<std::shared_ptr<const Mesostructure>> maps;  ///< at least one
  std::vector<std::uint8_t> map_of_face;                   ///< face i wears maps[map_of_face[i]]; empty: the first
  std::vector<CoatLayer> layers;                           ///< at most most_layers, summed on every face
  std::shared_ptr<const MaterialMaps> materials;           ///< nullptr: the material is one throughout
};

/// The coat at one place of one triangle, object frame.
struct CoatSample {
  double height = 0.0;           ///< H (m), positive outward
  Vec3 gradient = Vec3::Zero();  ///< surface gradient of H in the triangle's plane (m/m)
  Vec3 normal =
      Vec3::Zero();  ///< unit normal of the relief: the given normal map's where there is one, else from `gradient`
};

/// The mapping of one triangle, ready to be sampled: what a probe that stays on it need not fetch again.
struct CoatFrame {
  const Mesostructure* maps = nullptr;
  std::span<const CoatLayer> layers;
  CoatMoment moment;
  double level = 0.0;  ///< of `maps` at the moment
  bool triplanar = false;
  Vec2 st = Vec2::Zero();  ///< flat mappings: texture coordinates of the first corner, and their change along u and v
  Vec2 st_u = Vec2::Zero();
  Vec2 st_v = Vec2::Zero();
  double twice_area = 0.0;    ///< of the triangle (m^2), where there are levels of detail
  Vec3 point = Vec3::Zero();  ///< triplanar and solid layers: the first corner (m), and its change along u and v
  Vec3 point_u = Vec3::Zero();
  Vec3 point_v = Vec3::Zero();
  Vec3 normal = Vec3::Zero();  ///< triplanar: smooth normal of the first corner, and its change
  Vec3 normal_u = Vec3::Zero();
  Vec3 normal_v = Vec3::Zero();
};

/// A mesostructure laid on a mesh (hrm-2010, section 4). Immutable; shares the maps with other coats.
class Coat {
 public:
  /// Errors: bad_value (repeat), mismatch (uv mapping on a mesh without UVs, or with UVs that span no area). [build]
  static Result<Coat> build(const TriangleMesh& mesh, std::shared_ptr<const Mesostructure> maps,
                            const CoatSettings& settings);
  /// Different mesostructures on the faces of one mesh: face i wears maps[map_of_face[i]]. Errors: those above, and
  /// mismatch (one entry a face, each naming a map). [build]
  static Result<Coat> build(const TriangleMesh& mesh, std::vector<std::shared_ptr<const Mesostructure>> maps,
                            std::vector<std::uint8_t> map_of_face, const CoatSettings& settings);
  static constexpr std::size_t most_layers = 8;
  /// Several mesostructures summed, and maps of the material. Errors: those above, mismatch ("layers"), too_large.
  /// [build]
  static Result<Coat> build(const TriangleMesh& mesh, CoatParts parts, const CoatSettings& settings);

  /// Whether it may lie on this mesh: the one that it was built for, a copy of it, one built from the same, or one of
  /// these with its vertices moved. Errors: mismatch. [any]
  [[nodiscard]] Status check_fits(const TriangleMesh& mesh) const;

  /// The coat over the point of `face` with these barycentric coordinates, which may lie outside the triangle (its
  /// plane and its mapping are continued): stitching needs that. [servo]
  [[nodiscard]] CoatSample sample(const TriangleMesh& mesh, std::uint32_t face, const Vec3& barycentric,
                                  const CoatMoment& moment = {}) const noexcept;

  /// What sampling on `face` needs of the mesh. [servo]
  [[nodiscard]] CoatFrame frame(const TriangleMesh& mesh, std::uint32_t face,
                                const CoatMoment& moment = {}) const noexcept;
  /// The face's own height with its derivatives, before any stitching; (u, v) may lie outside the triangle. [servo]
  [[nodiscard]] HeightJet jet(const CoatFrame& frame, double u, double v) const noexcept {
    return frame.layers.empty() ? own_jet(frame, u, v) : layered_jet(frame, u, v);
  }
  /// That height alone (m), to within rounding. [servo]
  [[nodiscard]] double height(const CoatFrame& frame, double u, double v) const noexcept {
    return frame.layers.empty() ? own_height(frame, u, v) : layered_jet(frame, u, v).height;
  }
  /// The same at several places at once, equal to the bit. [servo]
  void heights(const CoatFrame& frame, const Lanes& u, const Lanes& v, Lanes& heights) const noexcept;
  /// Bounds of the face's own height over the triangle with these three corners (barycentric u, v). [servo]
  [[nodiscard]] HeightRange range(const CoatFrame& frame, const Vec2 corners[3]) const noexcept;
  /// A plane that the face's own height keeps to over part of it: where the relief is smooth the error is of second
  /// order in the part. [servo]
  [[nodiscard]] HeightForm form(const CoatFrame& frame, const FacePart& part) const noexcept;
  /// Whether heights may differ between neighbours at some edge, so that they have to be stitched. [any]
  [[nodiscard]] bool has_seams() const noexcept { return has_seams_; }
  /// Whether some edge at `vertex` is one of them. [servo]
  [[nodiscard]] bool seam_at(std::uint32_t vertex) const noexcept {
    return has_seams_ && (seam_vertices_.empty() || seam_vertices_[vertex] != 0);
  }

  /// Its levels of detail beside the finest one: those of the first mesostructure. [any]
  [[nodiscard]] int levels() const noexcept {
    return maps_.front()->detail() == nullptr ? 0 : maps_.front()->detail()->levels();
  }
  /// The level (with its fraction) at which nothing finer than `scale` (m on the surface, around the frame's face) is
  /// left and the heights left out are at most `height` (m). Both rules are met; 0 where there are no levels. [servo]
  [[nodiscard]] double level_for(const CoatFrame& frame, double scale, double height) const noexcept;
  /// Whether heights change with time. [any]
  [[nodiscard]] bool moves() const noexcept { return moves_; }
  /// Its maps of the material, or nullptr. [any]
  [[nodiscard]] const MaterialMaps* materials() const noexcept { return materials_.get(); }
  /// What the material's maps say over a place of the frame's face. Only with materials(). [servo]
  [[nodiscard]] LocalMaterial material(const CoatFrame& frame, double u, double v) const noexcept;
  [[nodiscard]] std::span<const CoatLayer> layers() const noexcept { return layers_; }

  /// Bounds of every height of the coat (m), at every level and moment, overshoot of the reconstruction included. [any]
  [[nodiscard]] double lowest() const noexcept { return lowest_; }
  [[nodiscard]] double highest() const noexcept { return highest_; }
  /// mh of the papers: the largest absolute height (m). [any]
  [[nodiscard]] double amplitude_bound() const noexcept { return std::max(std::abs(lowest()), std::abs(highest())); }
  /// Size of one texel on the surface (m), the median over the faces: the finest thing that can be felt. [any]
  [[nodiscard]] double texel_size() const noexcept { return texel_size_; }
  /// The first mesostructure, and the one on a face. [any]
  [[nodiscard]] const Mesostructure& maps() const noexcept { return *maps_.front(); }
  [[nodiscard]] const Mesostructure& maps_on(std::uint32_t face) const noexcept {
    return map_of_face_.empty() ? *maps_.front() : *maps_[map_of_face_[face]];
  }
  [[nodiscard]] const CoatSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

 private:
  Coat() = default;
  [[nodiscard]] CoatSample sample_flat(const TriangleMesh& mesh, std::uint32_t face,
                                       const Vec3& barycentric) const noexcept;
  [[nodiscard]] CoatSample sample_triplanar(const TriangleMesh& mesh, std::uint32_t face,
                                            const Vec3& barycentric) const noexcept;

  [[nodiscard]] double own_height(const CoatFrame& frame, double u, double v) const noexcept;
  static void triplanar_heights(const CoatFrame& frame, const Lanes& u, const Lanes& v, Lanes& heights) noexcept;
  [[nodiscard]] HeightJet own_jet(const CoatFrame& frame, double u, double v) const noexcept;
  [[nodiscard]] HeightJet layered_jet(const CoatFrame& frame, double u, double v) const noexcept;
  [[nodiscard]] HeightJet triplanar_jet(const CoatFrame& frame, double u, double v) const noexcept;
  [[nodiscard]] HeightRange own_range(const CoatFrame& frame, const Vec2 corners[3]) const noexcept;
  [[nodiscard]] HeightForm own_form(const CoatFrame& frame, const FacePart& part) const noexcept;
  [[nodiscard]] HeightForm triplanar_form(const CoatFrame& frame, const FacePart& part) const noexcept;
  /// Of a layer's map by itself: for own_jet, own_range and own_form, which see no layers.
  [[nodiscard]] CoatFrame layer_frame(const CoatFrame& frame, const CoatLayer& layer) const noexcept;
  Status take_layers(std::vector<CoatLayer> layers);
  void find_seams(const TriangleMesh& mesh);
  [[nodiscard]] double finest_grain(const TriangleMesh& mesh) const;

  std::uint64_t mesh_ = 0;          ///< fingerprint of the mesh that it was built for
  std::size_t mesh_triangles_ = 0;  ///< and how many triangles that has
  std::vector<std::shared_ptr<const Mesostructure>> maps_;
  std::vector<std::uint8_t> map_of_face_;  ///< empty: the first map everywhere
  std::vector<CoatLayer> layers_;
  std::shared_ptr<const MaterialMaps> materials_;
  bool moves_ = false;
  bool places_ = false;  ///< some layer is solid: frames hold places in space
  CoatSettings settings_;
  double lowest_ = 0.0;
  double highest_ = 0.0;
  bool has_seams_ = false;
  std::vector<std::uint8_t> seam_vertices_;  ///< one a vertex; empty: where there are seams, they are everywhere
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
BarycentricFrame barycentric_frame(const Vec3& a, const Vec3& b, const Vec3& c) noexcept;
BarycentricFrame barycentric_frame(const TriangleMesh& mesh, std::uint32_t face) noexcept;

}  // namespace asperity
