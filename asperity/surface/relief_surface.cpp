#include "asperity/surface/relief_surface.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace asperity {

namespace {

// A root is bracketed this tightly, relative to a texel.
constexpr double root_of_texel = 1e-6;
constexpr double least_step_of_texel = 0.25;
// Far over the relief a step is this share of the height over it.
constexpr double share_of_height = 0.25;
constexpr int step_limit = 100000;

}  // namespace

ReliefSurface::ReliefSurface(MeshSurface base, Coat coat) : base_(std::move(base)), coat_(std::move(coat)) {
  // The steepest texel step of the map bounds the slope on a face of median size.
  const HeightMap& heights = coat_.maps().heights();
  double steepest = 0.0;
  for (int y = 0; y < heights.height(); ++y) {
    for (int x = 0; x < heights.width(); ++x) {
      const double here = heights.texel(x, y);
      if (x > 0) steepest = std::max(steepest, std::abs(here - heights.texel(x - 1, y)));
      if (y > 0) steepest = std::max(steepest, std::abs(here - heights.texel(x, y - 1)));
    }
  }
  const double slope = coat_.texel_size() > 0.0 ? std::numbers::sqrt2 * steepest / coat_.texel_size() : 0.0;
  lipschitz_ = std::sqrt(1.0 + slope * slope);
}

FieldSample ReliefSurface::eval(const Vec3& p, Hint& hint) const noexcept {
  const Foot nearest = base_.closest(p, infinity, hint);
  FieldSample sample;
  if (!nearest.found()) return sample;
  const TriangleMesh& mesh = base_.mesh();
  const Vec3 offset = p - nearest.point;
  const bool outside = offset.dot(pseudonormal(mesh, nearest.element, nearest.barycentric)) >= 0.0;
  const CoatSample coat = coat_.sample(mesh, nearest.element, nearest.barycentric);
  Vec3 up = outside ? nearest.normal : Vec3(-nearest.normal);
  if (nearest.distance == 0.0) up = mesh.face_normal(nearest.element);
  sample.height = coat.height;
  sample.value = (outside ? nearest.distance : -nearest.distance) - coat.height;
  sample.gradient = up - coat.gradient;
  sample.element = nearest.element;
  return sample;
}

SweptHit ReliefSurface::segment(const Segment& motion, double radius, Sides sides, Hint& hint) const noexcept {
  const Vec3 direction = motion.to - motion.from;
  const double length = direction.norm();
  SweptHit best;
  if (length == 0.0) return best;
  const double least = least_step_of_texel * coat_.texel_size();
  const double highest = coat_.highest() + radius;
  double travelled = 0.0;
  FieldSample here = eval(motion.from, hint);
  double sign = here.value >= radius ? 1.0 : -1.0;
  double before = 0.0;
  for (int i = 0; i < step_limit && travelled < length; ++i) {
    // Above every height the base's own distance is the step; within the shell the slopes' bound is.
    const double above = here.value + here.height - highest;
    const double bounded = std::abs(here.value - radius) / lipschitz_;
    before = travelled;
    travelled = std::min(
        length, travelled + std::max({above, bounded, least, share_of_height * std::abs(here.value - radius)}));
    here = eval(motion.from + (travelled / length) * direction, hint);
    const double now = here.value >= radius ? 1.0 : -1.0;
    if (now == sign) continue;
    sign = now;
    if (sides == Sides::front && now > 0.0) continue;  // came out through the back
    double low = before;
    double high = travelled;
    while (high - low > root_of_texel * coat_.texel_size()) {
      const double middle = 0.5 * (low + high);
      if (middle <= low || middle >= high) break;
      const FieldSample at = eval(motion.from + (middle / length) * direction, hint);
      ((at.value >= radius ? 1.0 : -1.0) == now ? high : low) = middle;
    }
    const Vec3 touch = motion.from + (low / length) * direction;
    best.hit = true;
    best.t = low / length;
    best.contact = closest(touch, infinity, hint);
    if (now > 0.0) best.contact.normal = -best.contact.normal;
    return best;
  }
  return best;
}

void ReliefSurface::contacts(const Vec3& position, double radius, Sides, Hint& hint, ContactSet& out) const noexcept {
  const Foot foot = closest(position, infinity, hint);
  if (foot.found() && foot.distance <= radius + 2.0 * skin()) out.push_back(foot);
}

Foot ReliefSurface::closest(const Vec3& p, double bound, Hint& hint) const noexcept {
  const FieldSample sample = eval(p, hint);
  Foot foot;
  const double steepness = sample.gradient.norm();
  if (sample.element == no_index || steepness == 0.0) return foot;
  foot.normal = sample.gradient / steepness;
  const double signed_distance = sample.value / steepness;
  foot.distance = std::abs(signed_distance);
  if (foot.distance > bound) return Foot{};
  foot.point = p - signed_distance * foot.normal;
  foot.element = sample.element;
  return foot;
}

}  // namespace asperity
