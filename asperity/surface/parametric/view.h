#pragma once
// A parametric surface as one tick touches it. Places are (u, v).

#include "asperity/surface/parametric/surface.h"
#include "asperity/surface/view.h"

namespace asperity {

/// The surface at a place, with its derivatives.
struct ParametricSpot : ParametricJet {
  Vec3 front = Vec3::Zero();  ///< unit
};

/// See SurfaceView. [servo]
class ParametricView {
 public:
  using Spot = ParametricSpot;

  /// `work`: as of SurfaceCache.
  explicit ParametricView(const ParametricSurface& surface, WorkMeter* work = nullptr) noexcept
      : surface_(&surface), work_(work) {}

  /// What a point passes is bounded patch by patch, so that nothing is missed. Under Sides::front it meets what it
  /// comes to against the front.
  [[nodiscard]] SweptHit first_touch(const Segment& motion, Sides sides) const noexcept;
  /// Of the whole surface.
  [[nodiscard]] Foot nearest(const Vec3& p, double bound, const Place& start = {}) const noexcept;
  [[nodiscard]] ParametricSpot at(const Place& place, const Vec3& = Vec3::Zero()) const noexcept {
    return spot(place.at.head<2>());
  }
  [[nodiscard]] ParametricSpot spot(const Vec2& uv) const noexcept {
    const ParametricJet jet = surface_->jet(uv);
    return {jet, surface_->normal(jet)};
  }
  [[nodiscard]] Vec3 front(const Foot& foot) const noexcept { return spot(foot.at.head<2>()).front; }
  /// Seams of closed parameters and the poles of a sphere are places like others.
  DescentEnd descend(Place& place, ParametricSpot& spot, const Goal& goal) const noexcept;
  bool launch(const Place& place, const ParametricSpot& spot, Vec3& from) const noexcept {
    from = spot.point + surface_->skin() * (place.side() * spot.front);
    // In a valley narrower than the skin there is no place to fly from.
    return !surface_->has_folds() || place.side() * surface_->clearance(place.at.head<2>(), from) >= 0.0;
  }
  /// Distance from the nearest point, below 0 behind the front; beside the rim of an open surface it goes by the side
  /// of the rim's tangent plane.
  [[nodiscard]] FieldSample eval(const Vec3& p) const noexcept;
  [[nodiscard]] double skin() const noexcept { return surface_->skin(); }
  [[nodiscard]] double grain() const noexcept { return surface_->grain(); }
  [[nodiscard]] bool has_folds() const noexcept { return surface_->has_folds(); }
  [[nodiscard]] double direction_from() const noexcept { return skin(); }
  [[nodiscard]] std::uint32_t element(const Place& place, const ParametricSpot&) const noexcept {
    return surface_->element_of(place.at.head<2>());
  }
  [[nodiscard]] double height(const ParametricSpot& spot) const noexcept { return spot.height; }
  [[nodiscard]] Mat3 bend(const Place&, const ParametricSpot& spot) const noexcept {
    return surface_->shape_operator(spot);
  }
  [[nodiscard]] const ParametricSurface& surface() const noexcept { return *surface_; }

 private:
  const ParametricSurface* surface_;
  WorkMeter* work_;
};
static_assert(SurfaceView<ParametricView>);

inline ParametricView ParametricSurface::view(WorkMeter* work) const noexcept {
  return ParametricView(*this, work);
}

}  // namespace asperity
