#pragma once
// What a law is asked about.

#include "asperity/render/felt.h"

namespace asperity {

/// The surface that a law touches, object frame, whatever kind it is.
class TouchedSurface {
 public:
  explicit TouchedSurface(const Touched& touch) noexcept : touch_(&touch) {}
  /// Signed value and gradient: below 0 inside; a distance on meshes, and to first order elsewhere. [servo]
  [[nodiscard]] FieldSample eval(const Vec3& p) const noexcept {
    return on_view(touch_->view, [&](const auto& view) { return view.eval(p); });
  }
  /// The nearest point within `bound` (m). [servo]
  [[nodiscard]] Foot nearest(const Vec3& p, double bound) const noexcept {
    return on_view(touch_->view, [&](const auto& view) { return view.nearest(p, bound, {}); });
  }
  /// Those that can be touched. [servo]
  [[nodiscard]] Sides sides() const noexcept { return touch_->facts->sides; }
  /// Of the probe's ball (m), whose middle is what a law is asked about; 0 is a point. [servo]
  [[nodiscard]] double probe_radius() const noexcept { return touch_->facts->radius; }
  /// What it is, for laws of one kind of surface. [servo]
  [[nodiscard]] const Instance& instance() const noexcept { return *touch_->instance; }
  /// All that the tick knows of it, for laws within render. [servo]
  [[nodiscard]] const Touched& touch() const noexcept { return *touch_; }

 private:
  const Touched* touch_;
};

}  // namespace asperity
