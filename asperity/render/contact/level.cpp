#include "asperity/render/contact/level.h"

#include <algorithm>
#include <cmath>

namespace asperity {

namespace {

/// Finds the surface again near a point that it was at, or has come over: straight along the gradient, from the side
/// that is touched. False when it is gone.
bool take_up(const IsoView& surface, double side, const Vec3& near, OfSurface& state) noexcept {
  FieldJet jet;
  state.rests = false;
  if (!surface.sample(near, jet)) return false;
  const double length = jet.gradient.norm();
  if (!(length > 0.0)) return false;
  const Vec3 normal = (side * surface.sigma / length) * jet.gradient;
  // Twice as far as the gradient says, so that its change on the way does not matter.
  const double off = std::abs(jet.value - surface.threshold) / length;
  const double reach = 2.0 * off + 4.0 * surface.skin();
  // Where the field is all but flat its slope tells nothing.
  if (!(reach < surface.field->bounds().diagonal())) return false;
  const Segment inward{near + reach * normal, near - reach * normal};
  const IsoCrossing met = surface.first_crossing(inward);
  if (!met.found || met.outward.isZero() || met.inward != (side > 0.0)) return false;
  state.rests = true;
  state.places.clear();
  state.places.push_back({0, side < 0.0, met.point});
  state.normal = side * met.outward;
  return true;
}

}  // namespace

double ball_level(const Instance& instance, const Scene& scene) noexcept {
  const ImplicitSurface* implicit = implicit_of(instance.surface);
  const double radius = scene.probe_radius();
  if (implicit == nullptr || implicit->textured() || radius == 0.0) return 0.0;
  if (instance.law.facts().proxy != LawProxy::surface || scene.instances().size() != 1) return 0.0;
  // Level sets of the potential turn their front to the outside only.
  if (instance.sides.value_or(Sides::front) != Sides::front || implicit->offset() + radius > implicit->reach_outside())
    return 0.0;
  return radius;
}

std::uint32_t element_at(const Instance& instance, int level, const Vec3& place, SurfaceCache& cache) noexcept {
  const ImplicitSurface* implicit = implicit_of(instance.surface);
  if (implicit != nullptr && implicit->grid().has_faces()) {
    const std::uint32_t face = implicit->grid().face(place, cache.sparse);
    if (face != no_index) return face;
  }
  const IsoSurface& iso = *iso_of(instance.surface);
  return iso.view(cache.cells, level, iso.threshold()).element_at(place);
}

bool felt_level(const IsoSurface& surface, double target, Sides sides, int level, Seconds dt, const Vec3& free,
                SurfaceCache& cache, OfSurface& state) noexcept {
  if (state.identity != surface.field().identity()) {
    state = {};
    state.identity = surface.field().identity();
    state.threshold = target;
    state.level = level;
    return false;
  }
  if (state.level == level && state.threshold == target) return false;
  const auto felt = [&] { return surface.view(cache.cells, state.level, state.threshold); };
  const Vec3 place = state.rests ? state.places[0].at : free;
  FieldJet before;
  const IsoView old = felt();
  const bool was_known = old.sample(place, before);
  const double old_phi = was_known ? old.sigma * (before.value - old.threshold) : 0.0;
  FieldJet here = before;
  bool known = was_known;
  if (state.level != level) {
    state.level = level;
    known = felt().sample(place, here);
    // The surface goes on from where it is felt, or as far from the probe as it is, and then finds its place.
    if (known && was_known) state.threshold += here.value - before.value;
  }
  constexpr double least_slope = 0.05;  // of the typical one: where the field is flat the surface may run ahead
  const double slope = std::max(known ? here.gradient.norm() : 0.0, least_slope * surface.typical_slope());
  const double most = slope * surface.threshold_speed() * std::max(0.0, dt.count());
  state.threshold = known ? state.threshold + std::clamp(target - state.threshold, -most, most) : target;
  const IsoView now = felt();
  if (state.rests) {
    take_up(now, state.places[0].side(), place, state);
    return true;
  }
  const double new_phi = known ? now.sigma * (here.value - now.threshold) : 0.0;
  const bool came_over = was_known && known && (old_phi >= 0.0) != (new_phi >= 0.0);
  if (came_over && (sides == Sides::both || old_phi >= 0.0)) take_up(now, old_phi >= 0.0 ? 1.0 : -1.0, place, state);
  return true;
}

}  // namespace asperity
