#pragma once
// A program's own surface as one tick touches it. Places are points.

#include "asperity/surface/custom/surface.h"

namespace asperity {

/// The surface at a place: what its field answers there.
struct CustomSpot {
  Vec3 point = Vec3::Zero();
  Vec3 front = Vec3::Zero();     ///< unit; zero where the field has no slope
  Vec3 gradient = Vec3::Zero();  ///< of the value
  std::uint32_t element = 0;
};

/// See SurfaceView. What the type does itself is asked of it; the rest are conservative steps by what it says of
/// itself. [servo]
class CustomView {
 public:
  using Spot = CustomSpot;

  /// `work`: as of SurfaceCache.
  explicit CustomView(const CustomSurface& surface, WorkMeter* work = nullptr) noexcept
      : surface_(&surface), work_(work) {}

  /// To within a skin (sphere tracing, Hart 1996); nothing is passed through as long as `lipschitz` holds. A search
  /// that takes too many steps ends early, as if touched there.
  [[nodiscard]] SweptHit first_touch(const Segment& motion, Sides sides) const noexcept;
  /// The best of walks from p, from `start`, and from four places around p. What all of these miss is not found.
  [[nodiscard]] Foot nearest(const Vec3& p, double bound, const Place& start = {}) const noexcept;
  [[nodiscard]] CustomSpot at(const Place& place, const Vec3& = Vec3::Zero()) const noexcept { return spot(place.at); }
  [[nodiscard]] CustomSpot spot(const Vec3& p) const noexcept;
  /// The same for a point that was led onto the surface, kept on a side of it: it lies off by what landing leaves.
  [[nodiscard]] CustomSpot on_side(const Vec3& landed, double side) const noexcept;
  [[nodiscard]] Vec3 front(const Foot& foot) const noexcept { return spot(foot.point).front; }
  /// No move passes a sheet: each is one that a point could make through free space just off the surface.
  DescentEnd descend(Place& place, CustomSpot& spot, const Goal& goal) const noexcept;
  bool launch(const Place& place, const CustomSpot& spot, Vec3& from) const noexcept {
    from = spot.point + skin() * (place.side() * spot.front);
    // In a valley narrower than the skin there is no place to fly from.
    return place.side() * eval(from).value >= 0.0;
  }
  [[nodiscard]] FieldSample eval(const Vec3& p) const noexcept {
    tell(work_, {1, 0, 0});
    return surface_->eval(p);
  }
  /// CustomSurface::land.
  [[nodiscard]] bool land(Vec3& q) const noexcept { return surface_->land(q, work_); }
  [[nodiscard]] double skin() const noexcept { return surface_->skin(); }
  [[nodiscard]] double grain() const noexcept { return surface_->grain(); }
  [[nodiscard]] bool has_folds() const noexcept { return surface_->has_folds(); }
  [[nodiscard]] double direction_from() const noexcept { return skin(); }
  [[nodiscard]] std::uint32_t element(const Place&, const CustomSpot& spot) const noexcept { return spot.element; }
  [[nodiscard]] const CustomSurface& surface() const noexcept { return *surface_; }

 private:
  [[nodiscard]] SweptHit trace(const Segment& motion, Sides sides) const noexcept;
  [[nodiscard]] Foot foot_at(const Vec3& p, const CustomSpot& spot) const noexcept;

  const CustomSurface* surface_;
  WorkMeter* work_;
};
static_assert(SurfaceView<CustomView>);

inline CustomView CustomSurface::view(WorkMeter* work) const noexcept {
  return CustomView(*this, work);
}

}  // namespace asperity
