#pragma once

#include "asperity/surface/coat.h"
#include "asperity/surface/mesh_surface.h"
#include "asperity/surface/prisms.h"

namespace asperity {

/// A base mesh that wears a coat of relief.
///
/// The displaced surface is the zero set of value(p) = h - H: h the signed distance of p from the base mesh, H the
/// height of the coat over the nearest base point. That is continuous over convex edges (where many points share one
/// base point) wherever H is, and steps where the nearest base point jumps: inside concave folds. Shell coordinates,
/// which remove that limit, take the place of `eval` and `segment` behind the same queries.
class ReliefSurface {
 public:
  ReliefSurface(MeshSurface base, Coat coat);

  /// First point of a motion where value(p) = radius, from either side unless `sides` is front (then only from
  /// outside). Steps are as long as the slopes' bound allows, and at least a quarter of a texel or of the height over
  /// the relief: a feature thinner than that along the motion can be stepped over.
  [[nodiscard]] SweptHit segment(const Segment& motion, double radius, Sides sides, Hint& hint) const noexcept;
  void contacts(const Vec3& position, double radius, Sides sides, Hint& hint, ContactSet& out) const noexcept;
  /// The foot of p by the first-order distance value / |gradient|, moved along the gradient. Reaches as far as the base
  /// lies within `bound` plus the coat's height.
  [[nodiscard]] Foot closest(const Vec3& p, double bound, Hint& hint) const noexcept;
  [[nodiscard]] FieldSample eval(const Vec3& p, Hint& hint) const noexcept;
  [[nodiscard]] double skin() const noexcept { return base_.skin(); }
  [[nodiscard]] Box bounds() const noexcept { return base_.bounds().grown(coat_.amplitude_bound()); }

  [[nodiscard]] const MeshSurface& base() const noexcept { return base_; }
  [[nodiscard]] const Coat& coat() const noexcept { return coat_; }
  [[nodiscard]] Prisms prisms() const noexcept { return {base_.mesh(), coat_.amplitude_bound()}; }

 private:
  MeshSurface base_;
  Coat coat_;
  double lipschitz_ = 1.0;  ///< bound on |gradient of value| that a step may rely on
};
static_assert(SurfaceQuery<ReliefSurface> && HasPrisms<ReliefSurface>);

}  // namespace asperity
