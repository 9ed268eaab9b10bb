#pragma once
// One touchable thing: a surface at a place, felt by a law, of a material.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "asperity/core/frames.h"
#include "asperity/material/material.h"
#include "asperity/render/fine/features.h"
#include "asperity/render/laws/proxy.h"
#include "asperity/render/view.h"
#include "asperity/surface/custom/view.h"
#include "asperity/surface/implicit/surface.h"
#include "asperity/surface/mesh/view.h"
#include "asperity/surface/parametric/view.h"
#include "asperity/surface/relief/closing.h"
#include "asperity/surface/relief/view.h"

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
/// Tells apart what places are of: meshes by their lineage, which moving their vertices does not change, volumes by
/// their field, the others by themselves. Never 0. [servo]
std::uint64_t surface_identity(const Surface& surface) noexcept;
/// Front where a surface tells front from back: a mesh that is closed and consistently oriented, a solid; both
/// elsewhere. [any]
Sides natural_sides(const Surface& surface) noexcept;
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
  /// That can be touched; nothing: as natural_sides tells.
  std::optional<Sides> sides = {};
  Pose world_from_object = {};
  Motion motion = {};  ///< from there, by the clock of the probe
  double zoom = 1.0;   ///< filled by Scene::build: by how much a material that varies over the surface is magnified
  /// What the surface was made from, where it is a closed relief; nullptr: it is not.
  std::shared_ptr<const ClosedFrom> closed_from = nullptr;
  /// Law dense-mesh: what is felt. Filled by Scene::build, which takes one that is here already if it fits.
  std::shared_ptr<const DenseMesh> dense = nullptr;
};

/// What its law needs beside the surface: what was made for it, and what it remembers of one probe (bytes). [any]
std::size_t law_bytes(const Instance& instance) noexcept;
/// The sides that can be touched. [any]
inline Sides sides_of(const Instance& instance) noexcept {
  return instance.sides.value_or(natural_sides(instance.surface));
}

/// What a tick asks of an instance again and again: found out when the scene is built.
struct InstanceFacts {
  std::uint64_t identity = 0;   ///< surface_identity
  double radius = 0.0;          ///< of the probe (m); 0: a point
  Sides sides = Sides::both;    ///< that can be touched
  bool constrains = false;      ///< its law moves the proxy
  bool smooth = false;          ///< and leads it along the surface itself rather than along triangles
  bool facets = false;          ///< or along triangles that are generated in every tick
  bool by_planes = false;       ///< always by the joint solve: what is generated, and the dense mesh that it is held to
  bool volume = false;          ///< an isosurface, also of a potential
  bool varies = false;          ///< its material may differ from place to place
  bool holds_friction = false;  ///< the proxy is the anchor of its friction
  bool rubs = false;            ///< and there may be some
  bool adds_friction = false;   ///< friction is a force of its own
  bool moves = false;           ///< by itself
  bool at_origin = false;       ///< and stays at the world's axes
  bool changes = false;         ///< and the surface may move or change its shape under the proxy
  bool moment = false;          ///< its coat moves or has levels of detail, and its law feels which
  bool draws = false;           ///< it draws the probe from outside
  bool custom = false;          ///< its law is a program's own: nothing that it says of its energy is believed
  bool printed = false;         ///< its law is felt as printed: what that gives is paid by nobody
};

/// The relief of an instance that wears a coat, or nullptr. [servo]
inline const ReliefSurface* relief_of(const Instance& instance) noexcept {
  return provider_of<ReliefSurface>(instance.surface);
}

}  // namespace asperity
