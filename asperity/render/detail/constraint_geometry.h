#pragma once
// What a constraint law runs on for one instance and one tick: a mesh, or facets generated around the proxy. Private to
// render.

#include "asperity/render/detail/generated_geometry.h"
#include "asperity/render/scene.h"

namespace asperity {

/// The mesh that the law constrains the proxy with: the dense one, the base of a coated surface, the mesh itself.
/// Nothing where facets are generated. [servo]
inline const MeshSurface* constraint_mesh(const Instance& instance) noexcept {
  if (std::holds_alternative<GeneratedGeometryLaw>(instance.law)) return nullptr;
  if (std::holds_alternative<DenseMeshLaw>(instance.law)) return &instance.dense->surface;
  return base_of(instance.surface);
}

/// Either of them, with the queries that the constraint solve asks.
class ConstraintGeometry {
 public:
  ConstraintGeometry() = default;
  explicit ConstraintGeometry(const MeshSurface& mesh) noexcept : mesh_(&mesh) {}
  explicit ConstraintGeometry(GeneratedPatch& patch) noexcept : patch_(&patch) {}

  [[nodiscard]] double skin() const noexcept { return mesh_ != nullptr ? mesh_->skin() : patch_->skin(); }
  void contacts(const Vec3& position, double radius, Sides sides, Hint& hint, ContactSet& out) const noexcept {
    if (mesh_ != nullptr) {
      mesh_->contacts(position, radius, sides, hint, out);
    } else {
      patch_->contacts(position, radius, sides, out);
    }
  }
  [[nodiscard]] SweptHit segment(const Segment& motion, double radius, Sides sides, Hint& hint) const noexcept {
    return mesh_ != nullptr ? mesh_->segment(motion, radius, sides, hint) : patch_->segment(motion, radius, sides);
  }
  /// False when a query could not be answered whole. [servo]
  [[nodiscard]] bool complete() const noexcept { return mesh_ != nullptr || patch_->complete(); }

 private:
  const MeshSurface* mesh_ = nullptr;
  GeneratedPatch* patch_ = nullptr;
};

/// Facets for as many instances as one tick may hold, on the stack.
class GeneratedPatches {
 public:
  static constexpr std::size_t capacity = 4;

  /// What `instance` is felt through. Its law must not be one that follows the smooth relief. [servo]
  ConstraintGeometry of(const Instance& instance) noexcept {
    if (const MeshSurface* mesh = constraint_mesh(instance)) return ConstraintGeometry(*mesh);
    // As many instances as slots: never full.
    GeneratedPatch* patch = patches_.emplace_back();
    patch->start(**std::get_if<std::shared_ptr<const ReliefSurface>>(&instance.surface),
                 *std::get_if<GeneratedGeometryLaw>(&instance.law));
    return ConstraintGeometry(*patch);
  }

 private:
  FixedVector<GeneratedPatch, capacity> patches_;
};

}  // namespace asperity
