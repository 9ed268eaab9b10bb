#pragma once
// A triangle mesh as one tick touches it. Places are barycentric.

#include <algorithm>
#include <cstdint>

#include "asperity/surface/face_chart.h"
#include "asperity/surface/mesh/surface.h"

namespace asperity {

/// See SurfaceView; touched by a point or a ball. [servo]
class TriangleView {
 public:
  using Spot = FlatSpot;

  TriangleView(const MeshSurface& surface, SurfaceCache& cache) noexcept : surface_(&surface), cache_(&cache) {}

  /// First touch of a ball moving along a segment.
  [[nodiscard]] SweptHit sweep(const Segment& motion, double radius, Sides sides) const noexcept {
    tell(cache_->work, one_sweep(motion));
    return surface_->index().sweep(motion, radius, sides, cache_->patch);
  }
  [[nodiscard]] SweptHit first_touch(const Segment& motion, Sides sides) const noexcept;
  /// Every plane that a ball touches where it rests: what a constraint solve needs at once. (One that only knew the
  /// last hit could not rest in a corner without finding the other walls again by moving.)
  void contacts(const Vec3& position, double radius, Sides sides, ContactSet& out) const noexcept {
    tell(cache_->work, one_query);
    surface_->index().contacts(position, radius, sides, cache_->patch, out);
  }
  /// The face that a ball was left resting on, alone; nullptr: not known to be so.
  [[nodiscard]] const Foot* rests_on_face(const Vec3& position, double radius, Sides sides) const noexcept {
    return surface_->index().rests_on_face(position, radius, sides, cache_->patch);
  }
  /// Whether it slides along that and comes to nothing else; then that is what it rests on.
  [[nodiscard]] bool slides(const Segment& motion, double radius, Sides sides) const noexcept {
    tell(cache_->work, one_query);
    return surface_->index().slides(motion, radius, sides, cache_->patch);
  }
  [[nodiscard]] Foot nearest(const Vec3& p, double bound, const Place& = {}) const noexcept {
    tell(cache_->work, one_query);
    return surface_->index().closest(p, bound, cache_->patch);
  }
  [[nodiscard]] FlatSpot at(const Place& place, const Vec3& = Vec3::Zero()) const noexcept {
    return frame(place.element).at(place.at[1], place.at[2]);
  }
  /// The triangle of a place.
  const FlatFrame& frame(std::uint32_t face) const noexcept {
    const FlatFrame& last = cache_->flat.frame;
    if (last.face != face || last.owner != surface_->index().identity()) make_frame(face);
    return last;
  }
  /// Of the face, edge or vertex.
  [[nodiscard]] Vec3 front(const Foot& foot) const noexcept {
    return pseudonormal(surface_->mesh(), foot.element, foot.at).normalized();
  }
  /// From face to face; it ends as `blocked` where a part of the mesh is in the way that is not next to the face.
  DescentEnd descend(Place& place, FlatSpot& spot, const Goal& goal) const noexcept;
  bool launch(const Place& place, const FlatSpot& spot, Vec3& from) const noexcept {
    from = spot.point + skin() * (place.side() * spot.front);
    return true;
  }
  /// Whether one plane is all that holds a point there.
  [[nodiscard]] bool within_face(const Place& place) const noexcept {
    const Vec3& beside = frame(place.element).beside;
    return place.at[0] > beside[0] && place.at[1] > beside[1] && place.at[2] > beside[2];
  }
  /// Whether where `launch` begins is behind none of the faces around. [servo]
  [[nodiscard]] bool may_launch(const Place& place, const FlatSpot& spot) const noexcept;
  /// The planes of the faces around a place on an edge or a vertex, on the side of the place; none where anything else
  /// may come near. [servo]
  void beside_border(const Place& place, ContactSet& out) const noexcept;
  /// Whether two faces have a vertex in common. [servo]
  [[nodiscard]] bool meet(std::uint32_t face, std::uint32_t other) const noexcept;
  [[nodiscard]] FieldSample eval(const Vec3& p) const noexcept { return surface_->eval(p, *cache_); }
  [[nodiscard]] double skin() const noexcept { return surface_->skin(); }
  [[nodiscard]] double grain() const noexcept { return surface_->mesh().mean_edge(); }
  [[nodiscard]] static bool has_folds() noexcept { return true; }
  [[nodiscard]] double direction_from() const noexcept { return skin(); }
  [[nodiscard]] std::uint32_t element(const Place& place, const FlatSpot&) const noexcept { return place.element; }
  [[nodiscard]] const MeshSurface& surface() const noexcept { return *surface_; }

 private:
  /// How many triangles it looks at hangs on what the cache holds.
  static constexpr WorkCount one_query{0, 0, 1};
  /// About as many as it is edges long.
  [[nodiscard]] WorkCount one_sweep(const Segment& motion) const noexcept {
    constexpr double most = 1000.0;
    const double edges = (motion.to - motion.from).norm() / grain();
    return {0, 0, 1 + static_cast<std::uint32_t>(std::min(edges, most))};
  }

  void make_frame(std::uint32_t face) const noexcept;
  /// The faces that a place on an edge or a vertex is on; none where they are too many, or more come near.
  void around(const Place& place, ContactSet& out) const noexcept;

  const MeshSurface* surface_;
  SurfaceCache* cache_;
};
static_assert(SurfaceView<TriangleView>);

inline TriangleView MeshSurface::view(SurfaceCache& cache) const noexcept {
  return {*this, cache};
}

}  // namespace asperity
