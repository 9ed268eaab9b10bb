#pragma once
// A relief as one tick touches it, and walks along it.

#include <span>

#include "asperity/surface/relief/surface.h"

namespace asperity {

/// Leads a place of a relief, touched from `side`, along it, across edges and round vertices; `spot` is the surface at
/// `place`, before and after. What it took is added to `count`. [servo]
DescentEnd descend(const ReliefSurface& surface, ReliefPlace& place, ReliefPoint& spot, double side, const Goal& goal,
                   WorkCount& count) noexcept;

/// Which places a ball may rest on are looked for around its centre.
struct FeetAsked {
  /// Up to here (m) those on narrow crests as well, where the distance hardly changes from one to the next.
  double touching = 0.0;
  double reach = 0.0;  ///< m
  /// Of more than these, the nearest.
  std::size_t most = ContactSet::capacity();
  /// Below 1: where something is nearer than `touching`, only what is farther than that by no more than this share of
  /// how much, or than `reach` is beyond `touching`.
  double of_overlap = 1.0;
  friend bool operator==(const FeetAsked&, const FeetAsked&) = default;
};

/// A relief at one moment of its coat: see SurfaceView. [servo]
class ReliefView {
 public:
  using Spot = ReliefPoint;

  ReliefView(const ReliefSurface& surface, const CoatMoment& moment, SurfaceCache& cache) noexcept
      : surface_(&surface), moment_(moment), cache_(&cache) {}

  /// No relief, however thin, is stepped over. `starts_on`: the face on whose relief the motion starts, if it does.
  [[nodiscard]] SweptHit first_touch(const Segment& motion, Sides sides,
                                     std::uint32_t starts_on = no_index) const noexcept;
  /// Whether folds overlap in space; and then what a point meets that keeps to some of them, from places on these faces
  /// to others, moved a skin off them: of the rest, for what belongs to the faces, or shares a vertex with one of them,
  /// is not met. `likely`: what it may meet at once, if anything is known of that; looked at first.
  [[nodiscard]] bool overlaps() const noexcept { return surface_->overlaps(); }
  [[nodiscard]] SweptHit beside(std::span<const std::uint32_t> faces, const Segment& moved, Sides sides,
                                std::uint32_t likely = no_index) const noexcept;
  /// Of the displaced surface. `normal` is that of the surface, turned towards p.
  [[nodiscard]] Foot nearest(const Vec3& p, double bound, const Place& start = {}) const noexcept;
  /// Every place of the surface within reach of p that is nearer to it than those around, as far as asked for; the
  /// nearest first. Normals as nearest's.
  void feet(const Vec3& p, const FeetAsked& asked, ContactSet& out) const noexcept;
  /// How far p is at least from the surface (m), `within` where that is farther: a bound that is looked up.
  [[nodiscard]] double room_around(const Vec3& p, double within) const noexcept;
  /// Where a place that feet has told is led to by a ball whose centre is now at p. It may come to that of another one.
  [[nodiscard]] Foot follow(const Vec3& p, const Foot& foot) const noexcept;
  [[nodiscard]] const ReliefPoint& at(const Place& place, const Vec3& = Vec3::Zero()) const noexcept {
    if (cache_->blocks != nullptr) return kept_spot(place.element, place.at[1], place.at[2]);
    ReliefCache& cache = hold(place.element);
    const double u = place.at[1];
    const double v = place.at[2];
    if (!cache.evaluated || cache.place.u != u || cache.place.v != v) {
      cache.place.u = u;
      cache.place.v = v;
      cache.spot = surface_->point(cache.place.frame, u, v);
      cache.evaluated = true;
    }
    return cache.spot;
  }
  [[nodiscard]] Vec3 front(const Foot& foot) const noexcept { return at(place_of(foot)).front; }
  DescentEnd descend(Place& place, ReliefPoint& spot, const Goal& goal) const noexcept;
  bool launch(const Place& place, const ReliefPoint& spot, Vec3& from) const noexcept {
    from = spot.point + skin() * way_off(place, spot);
    return true;
  }
  [[nodiscard]] FieldSample eval(const Vec3& p) const noexcept { return surface_->eval(p, *cache_, moment_); }
  /// ReliefSurface::locate.
  const ReliefFrame* locate(const Vec3& p, ShellPlace& place) const noexcept {
    return surface_->locate(p, *cache_, moment_, place);
  }
  /// The nearest point of the base mesh.
  [[nodiscard]] Foot nearest_base(const Vec3& p) const noexcept {
    return surface_->base().index().closest(p, infinity, cache_->patch);
  }
  [[nodiscard]] double skin() const noexcept { return surface_->skin(); }
  [[nodiscard]] double grain() const noexcept { return surface_->grain(); }
  [[nodiscard]] static bool has_folds() noexcept { return true; }
  /// Distance from which the way to the nearest point tells the direction better than the surface's own normal does:
  /// folds have none. Nearest points are found to about a skin, sideways too.
  [[nodiscard]] double direction_from() const noexcept { return 4.0 * skin(); }
  [[nodiscard]] std::uint32_t element(const Place& place, const ReliefPoint&) const noexcept { return place.element; }
  [[nodiscard]] double height(const ReliefPoint& spot) const noexcept { return spot.jet.height; }
  /// How the front normal changes along the surface at a place (1/m): symmetric, 0 along the normal.
  [[nodiscard]] Mat3 bend(const Place& place, const ReliefPoint& spot) const noexcept;

  [[nodiscard]] const ReliefSurface& surface() const noexcept { return *surface_; }
  [[nodiscard]] const CoatMoment& moment() const noexcept { return moment_; }
  /// The triangle of a place.
  [[nodiscard]] const ReliefFrame& frame(std::uint32_t face) const noexcept {
    return cache_->blocks != nullptr ? kept_frame(face) : hold(face).place.frame;
  }

 private:
  [[nodiscard]] ReliefCache& hold(std::uint32_t face) const noexcept {
    ReliefCache& cache = cache_->relief;
    if (!surface_->holds(cache.place.frame, face, moment_)) {
      cache.place.frame = surface_->frame(face, moment_);
      cache.evaluated = false;
    }
    return cache;
  }
  /// What is kept for balls, who touch several places at once: see ReliefBlocks.
  [[nodiscard]] const ReliefFrame& kept_frame(std::uint32_t face) const noexcept;
  [[nodiscard]] ReliefPoint& kept_spot(std::uint32_t face, double u, double v) const noexcept;
  /// The surface at a place, which is asked for next.
  void keep(const ReliefPlace& place, const ReliefPoint& spot) const noexcept;
  [[nodiscard]] static Place place_of(const Foot& foot) noexcept { return {foot.element, false, foot.at}; }
  /// Unit direction that leads off a place, on its side, and away from all faces around it.
  [[nodiscard]] Vec3 way_off(const Place& place, const ReliefPoint& spot) const noexcept;
  template <class Skip>
  [[nodiscard]] SweptHit first_met(const Segment& motion, Sides sides, const Skip& skip, std::uint32_t likely,
                                   std::uint32_t starts_on) const noexcept;

  const ReliefSurface* surface_;
  CoatMoment moment_;
  SurfaceCache* cache_;
};
static_assert(SurfaceView<ReliefView>);

inline ReliefView ReliefSurface::view(SurfaceCache& cache, const CoatMoment& moment) const noexcept {
  return {*this, moment, cache};
}

}  // namespace asperity
