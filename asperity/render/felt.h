#pragma once
// What is felt of an instance during one tick: the one visit of its surface.

#include <algorithm>
#include <utility>
#include <variant>

#include "asperity/render/instance.h"
#include "asperity/render/state.h"

namespace asperity {

/// Any provider's view; nothing before it is chosen.
using FeltView = std::variant<std::monostate, TriangleView, ReliefView, IsoView, ParametricView, CustomView>;

/// Calls visit(view) with the view that is held, and answers what that answers; a default of it where none is. [servo]
template <class Visit>
auto on_view(const FeltView& view, Visit&& visit) noexcept {
  using Answer = decltype(visit(std::declval<const TriangleView&>()));
  if (const auto* mesh = std::get_if<TriangleView>(&view)) return visit(*mesh);
  if (const auto* relief = std::get_if<ReliefView>(&view)) return visit(*relief);
  if (const auto* iso = std::get_if<IsoView>(&view)) return visit(*iso);
  if (const auto* parametric = std::get_if<ParametricView>(&view)) return visit(*parametric);
  if (const auto* custom = std::get_if<CustomView>(&view)) return visit(*custom);
  return Answer();
}
/// The same for what a point's proxy rests on without triangles. [servo]
template <class Visit>
auto on_smooth_view(const FeltView& view, Visit&& visit) noexcept {
  return on_view(view, [&]<class V>(const V& held) -> decltype(visit(std::declval<const ReliefView&>())) {
    if constexpr (SurfaceView<V>) {
      return visit(held);
    } else {
      return decltype(visit(std::declval<const ReliefView&>()))();
    }
  });
}

/// The mesh that a law constrains the proxy with: the dense one, the base of a coated surface, the mesh itself. [servo]
inline const MeshSurface* constraint_mesh(const Instance& instance) noexcept {
  return instance.law.facts().proxy == LawProxy::dense_mesh ? &instance.dense->surface : base_of(instance.surface);
}

/// Whether the proxy is led along the surface itself rather than along triangles. [servo]
inline bool follows_smoothly(const Instance& instance) noexcept {
  return instance.law.facts().proxy == LawProxy::surface && provider_of<MeshSurface>(instance.surface) == nullptr;
}

/// One instance in one tick.
struct Touched {
  const Instance* instance = nullptr;
  const InstanceFacts* facts = nullptr;
  Contact* contact = nullptr;
  SurfaceCache* cache = nullptr;
  const Pose* pose = nullptr;    ///< of the instance now
  const Pose* before = nullptr;  ///< at the last tick
  bool at_origin = true;         ///< `pose` is the identity: nothing to transform
  bool moved = false;            ///< it has changed under the probe since the last tick
  CoatMoment moment = {};        ///< of the coat, felt now
  FeltView view = {};            ///< once all of this is known

  /// The view of a law that needs a coat, a field, a potential.
  [[nodiscard]] const ReliefView& relief() const noexcept { return *std::get_if<ReliefView>(&view); }
  [[nodiscard]] const IsoView& iso() const noexcept { return *std::get_if<IsoView>(&view); }
  [[nodiscard]] const ImplicitSurface& implicit() const noexcept { return *implicit_of(instance->surface); }
  /// Where a point's proxy rests on it; unknown where none does.
  [[nodiscard]] Place resting_place() const noexcept { return contact->surface.rests ? contact->first() : Place{}; }
  [[nodiscard]] Vec3 to_local(const Vec3& p) const noexcept { return at_origin ? p : pose->apply_inverse(p); }
  [[nodiscard]] Vec3 to_world(const Vec3& p) const noexcept { return at_origin ? p : pose->apply(p); }
  [[nodiscard]] Vec3 turned(const Vec3& v) const noexcept { return at_origin ? v : pose->rotate(v); }
  [[nodiscard]] Vec3 turned_back(const Vec3& v) const noexcept { return at_origin ? v : pose->rotate_inverse(v); }
  [[nodiscard]] Segment to_local(const Segment& motion) const noexcept {
    return {to_local(motion.from), to_local(motion.to)};
  }
};

/// Adds the material's damping along the contact normal, never turning the push into a pull. [servo]
inline Vec3 with_damping(const Vec3& force, const Vec3& normal, const Vec3& velocity, double damping) noexcept {
  if (damping == 0.0) return force;
  const double push = force.dot(normal);
  const double damped = std::max(0.0, push - damping * velocity.dot(normal));
  return force + (damped - push) * normal;
}

/// What the law of a proxy makes of its force at a place that it is held to. [servo]
inline void finish_by_law(const Touched& touch, const Foot& foot, LawForce& answer) noexcept {
  const Law& law = touch.instance->law;
  if (law.kind().finish != nullptr) law.kind().finish(law.settings(), touch, foot, answer);
}

/// How a spring (m, from where the probe would be to the planes that hold it) pushes. [servo]
inline LawForce pushed_by(const Vec3& spring, double stiffness) noexcept {
  LawForce answer;
  answer.contact = true;
  answer.penetration = spring.norm();
  answer.normal = spring / answer.penetration;
  answer.force = stiffness * spring;
  return answer;
}

/// What is felt of that: as the law and the material say, with what friction holds beside it (`along`: m, to the
/// probe). [servo]
inline void finish_push(const Touched& touch, const Material& material, const Foot& foot, const Vec3& along,
                        const ProbeSample& probe, LawForce& answer) noexcept {
  answer.spring = answer.force;
  finish_by_law(touch, foot, answer);
  const Vec3 friction = material.stiffness * along;
  answer.force += friction;
  answer.spring += friction;
  answer.force = with_damping(answer.force, answer.normal, probe.twist.linear, material.damping);
  answer.point = touch.to_world(foot.point);
  answer.element = foot.element;
}

/// The surface as the instance's law feels it, at its contact's threshold and level and a moment of its coat. [servo]
inline FeltView felt_view(const Touched& touch) noexcept {
  SurfaceCache& cache = *touch.cache;
  const OfSurface& felt = touch.contact->surface;
  return std::visit(
      [&]<class Provider>(const std::shared_ptr<const Provider>& surface) -> FeltView {
        if constexpr (std::is_same_v<Provider, ImplicitSurface>) {
          return surface->iso().view(cache, felt.level, felt.threshold);
        } else if constexpr (std::is_same_v<Provider, IsoSurface>) {
          return surface->view(cache, felt.level, felt.threshold);
        } else if constexpr (std::is_same_v<Provider, MeshSurface> || std::is_same_v<Provider, ReliefSurface>) {
          if constexpr (std::is_same_v<Provider, ReliefSurface>) {
            if (touch.facts->smooth || !touch.facts->constrains) return surface->view(cache, touch.moment);
          }
          return constraint_mesh(*touch.instance)->view(cache);
        } else {
          return surface->view(cache.work);
        }
      },
      touch.instance->surface);
}

}  // namespace asperity
