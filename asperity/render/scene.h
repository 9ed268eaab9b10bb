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
#include "asperity/render/view.h"
#include "asperity/surface/closing.h"
#include "asperity/surface/custom_surface.h"
#include "asperity/surface/implicit_surface.h"
#include "asperity/surface/iso_surface.h"
#include "asperity/surface/mesh_surface.h"
#include "asperity/surface/parametric_surface.h"
#include "asperity/surface/relief_surface.h"

namespace asperity {

/// The closed set of providers. Shared, because snapshots that follow one another share what did not change.
using Surface = std::variant<std::shared_ptr<const MeshSurface>, std::shared_ptr<const ReliefSurface>,
                             std::shared_ptr<const IsoSurface>, std::shared_ptr<const ImplicitSurface>,
                             std::shared_ptr<const ParametricSurface>, std::shared_ptr<const CustomSurface>>;

/// "mesh", "relief", "iso", "implicit", "parametric", "custom": the provider's name in messages. [any]
const char* surface_kind(const Surface& surface);
/// Bounds in the object frame (m). [any]
Box surface_bounds(const Surface& surface);
/// The provider of that kind, or nullptr. [any]
template <class Provider>
const Provider* provider_of(const Surface& surface) noexcept {
  const auto* provider = std::get_if<std::shared_ptr<const Provider>>(&surface);
  return provider != nullptr ? provider->get() : nullptr;
}
/// The implicit surface, or nullptr. [any]
inline const ImplicitSurface* implicit_of(const Surface& surface) noexcept {
  return provider_of<ImplicitSurface>(surface);
}
/// The isosurface, also the one of an implicit surface's potential, or nullptr. [any]
inline const IsoSurface* iso_of(const Surface& surface) noexcept {
  if (const ImplicitSurface* implicit = implicit_of(surface)) return &implicit->iso();
  return provider_of<IsoSurface>(surface);
}
/// The parametric surface, or nullptr. [any]
inline const ParametricSurface* parametric_of(const Surface& surface) noexcept {
  return provider_of<ParametricSurface>(surface);
}
/// The surface that a program has added, or nullptr. [any]
inline const CustomSurface* custom_of(const Surface& surface) noexcept {
  return provider_of<CustomSurface>(surface);
}
/// The mesh that carries the surface, or that an implicit surface was made from; nullptr where there is none. [any]
const MeshSurface* base_of(const Surface& surface) noexcept;
/// The mesh of a surface that has one. [any]
const TriangleMesh& base_mesh(const Surface& surface);

/// A relief as a dense mesh, with what it was made from.
struct DenseMesh {
  std::uint64_t relief = 0;  ///< identity of the relief's index
  int subdivisions = 0;
  MeshSurface surface;
};

/// What closing did to a relief: for pictures, and to feel it as it was.
struct ClosedFrom {
  std::shared_ptr<const ReliefSurface> before;
  ClosedRelief closed;
};

/// One touchable thing: a surface at a place, felt by a law, of a material. Every member names its default, so that
/// compilers do not warn of those that {.name = ..., .surface = ...} leaves out.
struct Instance {
  std::string name = {};
  Surface surface = {};
  Law law = ProxyLaw{};
  Material material = {};
  /// Texture, lay and maps of friction beside what is in the surface; nullptr: none.
  std::shared_ptr<const FineFeatures> fine = nullptr;
  Sides sides = Sides::both;
  Pose world_from_object = {};
  Motion motion = {};  ///< from there, by the clock of the probe
  double zoom = 1.0;   ///< filled by Scene::build: by how much a material that varies over the surface is magnified
  /// What the surface was made from, where it is a closed relief; nullptr: it is not.
  std::shared_ptr<const ClosedFrom> closed_from = nullptr;
  /// Law dense-mesh: what is felt. Filled by Scene::build, which takes one that is here already if it fits.
  std::shared_ptr<const DenseMesh> dense = nullptr;
};

/// What an implicit surface is made of at p (object frame): stored there, or the instance's own. [servo]
Material material_at(const ImplicitSurface& surface, const Material& own, const Vec3& p, SparseHint& hint) noexcept;
/// What an instance is made of at the place of its surface nearest to p (object frame). [servo]
Material local_material(const Instance& instance, const Vec3& p, Hint& hint) noexcept;
/// Whether it may differ from place to place. [servo]
bool has_local_material(const Instance& instance) noexcept;
/// The relief of an instance that wears a coat, or nullptr. [servo]
inline const ReliefSurface* relief_of(const Instance& instance) noexcept {
  return provider_of<ReliefSurface>(instance.surface);
}

/// What is true of a scene as a whole.
struct SceneSettings {
  double probe_radius = 0.0;  ///< m, workspace: of the probe's tip; 0 is a point
  /// Radius (m, workspace) of the tip whose path a point follows on coats with levels of detail by dilation; 0: none.
  double tip_radius = 0.0;
  View view = {};
  /// Over how long a change of the scene is spread, as far as the tank pays for it (s); 0: felt at once.
  Seconds handover{0.01};
  /// Power (W) that moving, deforming and changing surfaces may give to the hand beyond what it has spent on them: 0,
  /// the default, keeps every change passive.
  double change_power = 0.0;
  /// How fast coats change their level of detail (levels a second), above 0.
  double level_rate = 8.0;
};

/// Validated and immutable: `step` cannot fail on it. Copies share the surfaces.
class Scene {
 public:
  /// Validates everything. Errors: unsupported_pair (a law that needs a coat on a bare mesh), bad_value (material, law
  /// option, probe radius, pose not finite), too_large (a dense mesh of too many triangles), each with the instance's
  /// place. [build]
  static Result<Scene> build(std::vector<Instance> instances, double probe_radius,
                             std::vector<FieldEffect> effects = {});

  /// The same with all that can be set. Errors: those above, and bad_value (view, motion, a time or power below 0).
  /// [build]
  static Result<Scene> build(std::vector<Instance> instances, const SceneSettings& settings = {},
                             std::vector<FieldEffect> effects = {});

  [[nodiscard]] std::span<const Instance> instances() const noexcept { return given_.empty() ? felt_ : given_; }
  [[nodiscard]] const SceneSettings& settings() const noexcept { return settings_; }
  /// The instances with their materials as a zoomed hand feels them: what a tick goes by. [servo]
  [[nodiscard]] std::span<const Instance> felt() const noexcept { return felt_; }
  [[nodiscard]] std::span<const FieldEffect> felt_effects() const noexcept { return felt_effects_; }
  /// What is felt everywhere in a volume, without a surface. [servo]
  [[nodiscard]] std::span<const FieldEffect> effects() const noexcept {
    return given_effects_.empty() ? felt_effects_ : given_effects_;
  }
  /// Whether a tick may read a volume: for an isosurface or an effect. [servo]
  [[nodiscard]] bool reads_volumes() const noexcept { return reads_volumes_; }
  /// Whether an instance moves on by itself. [servo]
  [[nodiscard]] bool moves() const noexcept { return moves_; }
  /// Radius of the probe's tip in the scene (m); 0 is a point. [servo]
  [[nodiscard]] double probe_radius() const noexcept { return settings_.probe_radius / settings_.view.zoom; }
  /// Tells snapshots apart, never 0. A state made for another one re-acquires its contacts. [servo]
  [[nodiscard]] std::uint64_t epoch() const noexcept { return epoch_; }
  /// World bounds of instance `index`, coat and motion included (m). [servo]
  [[nodiscard]] const Box& world_bounds(std::size_t index) const noexcept { return bounds_[index]; }
  [[nodiscard]] Box world_bounds() const noexcept;
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

 private:
  Scene() = default;

  std::vector<Instance> felt_;
  std::vector<FieldEffect> felt_effects_;
  std::vector<Instance> given_;  ///< empty: they are felt as they are
  std::vector<FieldEffect> given_effects_;
  std::vector<Box> bounds_;
  SceneSettings settings_;
  std::uint64_t epoch_ = 0;
  bool reads_volumes_ = false;
  bool moves_ = false;
};

}  // namespace asperity
