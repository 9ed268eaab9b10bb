#pragma once
// The immutable snapshot that the servo thread reads: what is touched, how it is felt, what it is made of.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "asperity/core/frames.h"
#include "asperity/core/result.h"
#include "asperity/material/material.h"
#include "asperity/render/field_effects.h"
#include "asperity/render/fine_features.h"
#include "asperity/render/laws.h"
#include "asperity/surface/implicit_surface.h"
#include "asperity/surface/iso_surface.h"
#include "asperity/surface/mesh_surface.h"
#include "asperity/surface/parametric_surface.h"
#include "asperity/surface/relief_surface.h"

namespace asperity {

/// The closed set of providers. Shared, because snapshots that follow one another share what did not change.
using Surface = std::variant<std::shared_ptr<const MeshSurface>, std::shared_ptr<const ReliefSurface>,
                             std::shared_ptr<const IsoSurface>, std::shared_ptr<const ImplicitSurface>,
                             std::shared_ptr<const ParametricSurface>>;

/// "mesh", "relief", "iso", "implicit", "parametric": the provider's name in messages. [any]
const char* surface_kind(const Surface& surface);
/// Bounds in the object frame (m). [any]
Box surface_bounds(const Surface& surface);
/// The mesh that carries the surface, or that an implicit surface was made from; nullptr where there is none. [any]
const MeshSurface* base_of(const Surface& surface) noexcept;
/// The isosurface, also the one of an implicit surface's potential, or nullptr. [any]
const IsoSurface* iso_of(const Surface& surface) noexcept;
/// The implicit surface, or nullptr. [any]
const ImplicitSurface* implicit_of(const Surface& surface) noexcept;
/// The parametric surface, or nullptr. [any]
const ParametricSurface* parametric_of(const Surface& surface) noexcept;
/// The mesh of a surface that has one. [any]
const TriangleMesh& base_mesh(const Surface& surface);

/// A relief as a dense mesh, with what it was made from.
struct DenseMesh {
  std::uint64_t relief = 0;  ///< identity of the relief's index
  int subdivisions = 0;
  MeshSurface surface;
};

/// One touchable thing: a surface at a place, felt by a law, of a material.
struct Instance {
  std::string name;
  Surface surface;
  Law law = ProxyLaw{};
  Material material;
  /// Texture, lay and maps of friction beside what is in the surface; nullptr: none.
  std::shared_ptr<const FineFeatures> fine;
  Sides sides = Sides::both;
  Pose world_from_object;
  /// Law dense-mesh: what is felt. Filled by Scene::build, which takes one that is here already if it fits.
  std::shared_ptr<const DenseMesh> dense;
};

/// What an implicit surface is made of at p (object frame): stored there, or the instance's own. [servo]
Material material_at(const ImplicitSurface& surface, const Material& own, const Vec3& p, SparseHint& hint) noexcept;
/// What an instance is made of at the place of its surface nearest to p (object frame). [servo]
Material local_material(const Instance& instance, const Vec3& p, SparseHint& hint) noexcept;

/// Validated and immutable: `step` cannot fail on it. Copies share the surfaces.
class Scene {
 public:
  /// Validates everything. Errors: unsupported_pair (a law that needs a coat on a bare mesh), bad_value (material, law
  /// option, probe radius, pose not finite), too_large (a dense mesh of too many triangles), each with the instance's
  /// place. [build]
  static Result<Scene> build(std::vector<Instance> instances, double probe_radius,
                             std::vector<FieldEffect> effects = {});

  [[nodiscard]] std::span<const Instance> instances() const noexcept { return instances_; }
  /// What is felt everywhere in a volume, without a surface. [servo]
  [[nodiscard]] std::span<const FieldEffect> effects() const noexcept { return effects_; }
  /// Radius of the probe's tip (m); 0 is a point. [servo]
  [[nodiscard]] double probe_radius() const noexcept { return probe_radius_; }
  /// Tells snapshots apart, never 0. A state made for another one re-acquires its contacts. [servo]
  [[nodiscard]] std::uint64_t epoch() const noexcept { return epoch_; }
  /// World bounds of instance `index`, coat included (m). [servo]
  [[nodiscard]] const Box& world_bounds(std::size_t index) const noexcept { return bounds_[index]; }
  [[nodiscard]] Box world_bounds() const noexcept;
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

 private:
  Scene() = default;

  std::vector<Instance> instances_;
  std::vector<FieldEffect> effects_;
  std::vector<Box> bounds_;
  double probe_radius_ = 0.0;
  std::uint64_t epoch_ = 0;
};

}  // namespace asperity
