#pragma once
// A smooth surface as the joint solve sees it: a relief, a parametric surface, a program's own, or an isosurface of
// this tick. Private to render.

#include "asperity/render/detail/iso_proxy.h"
#include "asperity/render/scene.h"

namespace asperity {

/// One of the four, or nothing where an instance is felt on triangles.
class SmoothSurface {
 public:
  SmoothSurface() = default;
  /// What the proxy law feels of an instance. [servo]
  SmoothSurface(const Instance& instance, const ContactState& slot) noexcept {
    if (!std::holds_alternative<ProxyLaw>(instance.law)) return;
    if (const auto* relief = std::get_if<std::shared_ptr<const ReliefSurface>>(&instance.surface))
      relief_ = relief->get();
    parametric_ = parametric_of(instance.surface);
    custom_ = custom_of(instance.surface);
    if (const IsoSurface* iso = iso_of(instance.surface)) iso_ = felt_view(*iso, slot);
  }

  explicit operator bool() const noexcept {
    return relief_ != nullptr || parametric_ != nullptr || custom_ != nullptr || iso_.field != nullptr;
  }
  [[nodiscard]] double skin() const noexcept {
    if (parametric_ != nullptr) return parametric_->skin();
    if (custom_ != nullptr) return custom_->skin();
    return relief_ != nullptr ? relief_->skin() : iso_.skin();
  }
  /// Smallest length over which the surface changes (m).
  [[nodiscard]] double grain() const noexcept {
    if (parametric_ != nullptr) return parametric_->grain();
    if (custom_ != nullptr) return custom_->grain();
    return relief_ != nullptr ? relief_->grain() : iso_.field->narrowest_cell();
  }
  /// Distance from which the way to the nearest point tells the direction better than the surface's own normal does
  /// (m): a relief's folds have none; on an isosurface the point is found to within a share of a cell.
  [[nodiscard]] double direction_from() const noexcept { return iso_.field == nullptr ? skin() : 0.05 * grain(); }
  /// Whether two of its tangent planes may meet in an edge.
  [[nodiscard]] bool has_folds() const noexcept {
    return relief_ != nullptr || (parametric_ != nullptr && parametric_->has_folds()) ||
           (custom_ != nullptr && custom_->has_folds());
  }
  /// How far beyond touching a tangent plane is worth knowing (m).
  [[nodiscard]] double plane_reach() const noexcept { return has_folds() ? 2.0 * skin() : 0.05 * grain(); }
  /// The nearest point within `bound`, and the surface's front normal there. [servo]
  [[nodiscard]] Foot closest(const Vec3& p, double bound, Hint& hint, Vec3& front) const noexcept {
    if (parametric_ != nullptr) {
      const Foot foot = parametric_->closest(p, bound, hint);
      if (foot.found()) front = parametric_->normal(parametric_->jet(hint.parametric.uv));
      return foot;
    }
    if (custom_ != nullptr) {
      const Foot foot = custom_->closest(p, bound, hint);
      if (foot.found()) front = custom_->outward(foot.point);
      return foot;
    }
    if (relief_ == nullptr) {
      const Foot foot = iso_.closest(p, bound, hint.iso);
      if (foot.found()) front = iso_.outward(foot.point, hint.iso);
      return foot;
    }
    const Foot foot = relief_->closest(p, bound, hint);
    if (foot.found()) front = relief_->point(hint.relief.frame, hint.relief.u, hint.relief.v).normal();
    return foot;
  }
  /// First touch of a point. [servo]
  [[nodiscard]] SweptHit segment(const Segment& motion, Sides sides, Hint& hint) const noexcept {
    if (relief_ != nullptr) return relief_->segment(motion, 0.0, sides, hint);
    if (parametric_ != nullptr) return parametric_->segment(motion, 0.0, sides, hint);
    if (custom_ != nullptr) return custom_->segment(motion, 0.0, sides, hint);
    SweptHit hit;
    const IsoCrossing crossing = iso_.first_touch(motion, sides, hint.iso);
    hit.hit = crossing.found;
    hit.t = crossing.found ? crossing.t : 1.0;
    return hit;
  }

 private:
  const ReliefSurface* relief_ = nullptr;
  const ParametricSurface* parametric_ = nullptr;
  const CustomSurface* custom_ = nullptr;
  IsoView iso_;
};

}  // namespace asperity
