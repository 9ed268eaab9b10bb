#include "asperity/render/contact/contact_point.h"

#include <algorithm>
#include <cmath>

#include "asperity/render/local_material.h"

namespace asperity {

namespace {

// f_v of eq. 2 at most: at 1 the contact point would stay for ever, above 1 it would go backwards.
constexpr double most_friction = 0.999;

/// Eq. 2.
double friction_of(const Material& material, double depth_gain, double depth) noexcept {
  return std::min(most_friction, material.dynamic_friction * (1.0 + depth_gain * depth));
}

// --- as printed ---

constexpr double small_step = 0.1;      // voxels
constexpr int most_small_steps = 1024;  // of one search
constexpr double beyond_reach = 2.0;    // voxels: how much farther than the potential can be trusted a search goes

/// Small steps along `way` (unit) until the potential has passed `level`; the last one ends where the line through its
/// two values does. False: it does not within `farthest`.
bool walk(const SparseGrid& grid, const Vec3& from, const Vec3& way, double level, double farthest, SparseHint& hint,
          Vec3& out) noexcept {
  const double step = small_step * grid.voxel();
  const double count = std::min(std::ceil(farthest / step), static_cast<double>(most_small_steps));
  double before = grid.trilinear(from, hint).value - level;
  const bool inside = before < 0.0;
  for (int i = 1; i <= static_cast<int>(count); ++i) {
    const double now = grid.trilinear(from + (i * step) * way, hint).value - level;
    if ((now < 0.0) != inside) {
      out = from + ((i - 1) + before / (before - now)) * step * way;
      return true;
    }
    before = now;
  }
  return false;
}

/// The virtual contact point before friction.
struct PrintedContact {
  bool found = false;
  Vec3 direction = Vec3::Zero();  ///< unit, of the force
  double depth = 0.0;             ///< m, along it
  Vec3 original = Vec3::Zero();   ///< of the surface without offset: where materials are looked up
};

/// `here`: the potential at the probe, which is less than `offset` outside.
PrintedContact printed_contact(const ImplicitSurface& surface, ContactMagnitude magnitude, double offset,
                               const Potential& here, const Vec3& probe, SparseHint& hint) noexcept {
  PrintedContact contact;
  const SparseGrid& grid = surface.grid();
  const double slope = here.gradient.norm();
  if (!(slope > 0.0)) return contact;
  const Vec3 normal = here.gradient / slope;
  const double f = here.value - surface.offset();
  const double farthest = surface.reach_inside() + surface.offset() + offset + beyond_reach * grid.voxel();
  if (magnitude == ContactMagnitude::potential) {
    contact.depth = offset - f;
  } else {
    Vec3 reached;
    if (!walk(grid, probe, normal, surface.offset() + offset, farthest, hint, reached)) return contact;
    contact.depth = (reached - probe).norm();
  }
  contact.found = true;
  contact.direction = normal;
  contact.original = probe + contact.depth * normal;
  if (offset > 0.0) {
    const Vec3 way = f < 0.0 ? normal : Vec3(-normal);
    if (!walk(grid, probe, way, surface.offset(), farthest, hint, contact.original))
      contact.original = probe - f * normal;
    const Vec3 there = grid.node_gradients(contact.original, hint).gradient;
    if (const double length = there.norm(); length > 0.0) contact.direction = there / length;
  }
  return contact;
}

/// The contact point that friction has held back, by the tick: p_n of eq. 2, back on the surface that is felt.
Vec3 printed_drag(const ImplicitSurface& surface, double offset, double friction, const Vec3& free, const Vec3& probe,
                  HeldPoint& state) noexcept {
  const Vec3 last = state.pushed ? state.point : free;
  const Vec3 moved = free - last;                     // F_t
  const Vec3 held = last + moved - friction * moved;  // p_n = p_c + F_t + F_r
  const Vec3 ray = held - probe;
  const double length = ray.norm();
  const SparseGrid& grid = surface.grid();
  Vec3 reached;
  if (!(length > 0.0) ||
      !walk(grid, probe, ray / length, surface.offset() + offset,
            length + surface.reach_inside() + beyond_reach * grid.voxel(), state.cache.sparse, reached))
    return free;
  return reached;
}

// --- consistent ---

/// The potential that is felt, by the surface's own reconstruction.
class Felt {
 public:
  Felt(const ImplicitSurface& surface, double offset, SurfaceCache& cache) noexcept
      : grid_(surface.grid()),
        view_(surface.view(cache)),
        level_(view_.threshold + offset),
        trilinear_(view_.field->reconstruction() == CellReconstruction::trilinear) {}

  [[nodiscard]] const IsoView& view() const noexcept { return view_; }
  /// The potential's value on the surface that is felt (m).
  [[nodiscard]] double level() const noexcept { return level_; }

  /// Above 0 outside of what is felt. False beyond the grid's box.
  bool at(const Vec3& p, SurfaceCache& cache, Potential& out) const noexcept {
    if (trilinear_) {
      if (!view_.field->contains(p)) return false;
      out = grid_.trilinear(p, cache.sparse);
    } else {
      FieldJet jet;
      if (!view_.sample(p, jet)) return false;
      out = {jet.value, jet.gradient};
    }
    out.value -= level_;
    return true;
  }
  [[nodiscard]] double value(const Vec3& p, SurfaceCache& cache) const noexcept {
    if (trilinear_)
      return (view_.field->contains(p) ? grid_.trilinear(p, cache.sparse).value : grid_.outside()) - level_;
    const CellPolynomial* cell = view_.over(p);
    return (cell != nullptr ? cell->value(p) : grid_.outside()) - level_;
  }

 private:
  const SparseGrid& grid_;
  IsoView view_;
  double level_;
  bool trilinear_;
};

/// Where the potential can be trusted: down to `depth`, and less and less over the `fade` that follows (m).
struct Trust {
  double depth = 0.0;
  double fade = 0.0;

  Trust(const ImplicitSurface& surface, double level) noexcept {
    const double voxel = surface.grid().voxel();
    const double reach = std::max(surface.reach_inside(), 0.5 * voxel);
    fade = std::min(voxel, 0.5 * reach);
    depth = reach - fade + level;
  }
  /// 1 to `depth`, 0 at the end of the band.
  [[nodiscard]] double at(double g) const noexcept { return std::clamp((g + depth) / fade + 1.0, 0.0, 1.0); }
};

/// What the potential says at the probe. Force = stiffness pull, and pull = -grad energy where `trust` is 1 and no edge
/// is near.
struct Pull {
  Vec3 pull = Vec3::Zero();   ///< m
  Vec3 slope = Vec3::Zero();  ///< of the potential, as it is felt
  double energy = 0.0;        ///< m²; 0 far outside
  double trust = 1.0;
  Vec3 foot = Vec3::Zero();  ///< of the surface that is felt
};

/// Depth of the well that a magnet's band is, from its edge to the surface (m², by stiffness).
double well(double band) noexcept {
  return band * band / 6.0;
}

/// Normal of the surface where the probe came in, if it has jumped over the band within one tick.
Vec3 arrival_normal(const Felt& felt, const Vec3& probe, HeldPoint& state) noexcept {
  IsoView view = felt.view();
  view.threshold = felt.level();
  return view.first_touch({state.previous, probe}, Sides::front).contact.normal;
}

/// Of a probe that is inside by `depth` (m): the pull per depth. The potential's own gradient; near an edge, where an
/// energy's slope is too short to stand for the depth and its direction swings, the direction of the nodes' gradients.
Vec3 slope_inside(double depth, const Vec3& gradient, const SparseGrid& untextured, const Vec3& probe,
                  SparseHint& hint) noexcept {
  // Lengths of the mean gradient. A texture's slope is 1 and more; a distance's is less within two voxels of an edge.
  constexpr double no_edge = 0.9975;
  constexpr double at_edge = 0.975;
  constexpr double clear = 0.95;
  constexpr double mixed = 0.7;     // where two faces at a right angle are equally near
  constexpr double crest = 0.25;    // less: the middle of a thin sheet, where the force turns round through 0
  constexpr double rounding = 0.3;  // voxels: what an edge's interpolated depth lacks, by what its gradient does
  const Vec3 mean = untextured.node_gradients(probe, hint).gradient;
  const double length = mean.norm();
  if (length >= no_edge) return gradient;
  if (!(length > 0.0)) return Vec3::Zero();
  const double share = std::min(1.0, (no_edge - length) / (no_edge - at_edge));
  const Vec3 middle = mean / length;
  Vec3 way = middle;
  if (length > mixed) {
    const double t = std::min(1.0, (length - mixed) / (clear - mixed));
    const Vec3 sharp = untextured.clear_gradient(probe, hint);
    if (const double size = sharp.norm(); size > 0.0)
      way = (middle + t * t * (3.0 - 2.0 * t) * (sharp / size - middle)).normalized();
  }
  const double voxel = untextured.voxel();
  const double size = std::min(1.0, length / crest) *
                      (1.0 + rounding * (1.0 - length * length) * std::min(1.0, voxel / std::max(depth, 1e-3 * voxel)));
  return (1.0 - share) * gradient + share * size * way;
}

/// Keeps state.normal: the pull's direction, held where that cannot be trusted. `g`: less than the band.
Pull spring_at(const Felt& felt, const Trust& trust, double band, const Potential& here, const SparseGrid& untextured,
               const Vec3& probe, HeldPoint& state) noexcept {
  const double g = here.value;
  Pull spring;
  spring.slope = here.gradient;
  // A magnet stays an energy's slope all over: what it gives on the way in is asked back on the way out.
  if (g < 0.0 && band == 0.0) spring.slope = slope_inside(-g, here.gradient, untextured, probe, state.cache.sparse);
  spring.foot = probe - g * spring.slope;
  spring.trust = trust.at(g);
  if (spring.trust == 1.0) {
    constexpr double least_slope = 1e-6;
    const double slope = spring.slope.norm();
    if (slope > least_slope) state.normal = spring.slope / slope;
  } else if (state.normal.isZero()) {
    state.normal = arrival_normal(felt, probe, state);
  }
  if (g > 0.0) {
    const double share = g / band;
    const double window = 1.0 - share * share;
    spring.pull = -g * window * window * spring.slope;
    spring.energy = -well(band) * window * window * window;
    return spring;
  }
  spring.pull = -g * spring.slope;
  const double depth = std::min(-g, trust.depth);
  spring.energy = 0.5 * depth * depth - well(band);
  if (spring.trust < 1.0) {
    spring.pull = spring.trust * spring.pull + (1.0 - spring.trust) * trust.depth * state.normal;
    spring.foot = probe + spring.pull;
  }
  return spring;
}

/// How far along `way` (unit) from the probe, which is inside by `start`, the surface lies; `guess` if it is not found.
double surface_along(const Felt& felt, const Vec3& probe, const Vec3& way, double start, double guess, double voxel,
                     SurfaceCache& cache) noexcept {
  constexpr int most_samples = 16;
  // Near the root for its depth, the chord from the probe is wrong by far less than what is left.
  const double close = std::min(1e-3 * voxel, -1e-2 * start);
  const double met = 1e-6 * voxel;
  const double farthest = 3.0 * guess + 4.0 * voxel;
  double low = 0.0;
  double low_value = start;
  double high = 0.0;
  double high_value = 0.0;
  bool bracketed = false;
  int side = 0;
  double at = guess;
  for (int i = 0; i < most_samples; ++i) {
    const double value = felt.value(probe + at * way, cache);
    if (std::abs(value) <= met) return at;
    if (std::abs(value) <= close) return at * (start / (start - value));
    const double before = low;
    const double before_value = low_value;
    if (value < 0.0) {
      // Illinois: an end that stays counts half, or it would stay for ever.
      if (side < 0) high_value *= 0.5;
      side = -1;
      low = at;
      low_value = value;
    } else {
      if (side > 0) low_value *= 0.5;
      side = 1;
      high = at;
      high_value = value;
      bracketed = true;
    }
    if (bracketed) {
      at = low + (high - low) * (low_value / (low_value - high_value));
      continue;
    }
    // A distance is left in steps not longer than itself; the secant through the last two may know better.
    const double rise = low_value - before_value;
    const double most = -4.0 * low_value + voxel;
    const double secant = rise > 0.0 ? -low_value * (low - before) / rise : most;
    at = low + std::clamp(secant, -low_value, most);
    if (at > farthest) return guess;
  }
  return bracketed ? at : guess;
}

/// The contact point that friction holds back: by the millisecond what eq. 2 does by the tick (amendment 15).
Vec3 dragged(const Felt& felt, double voxel, double friction, Seconds dt, const Pull& spring, double start,
             const Vec3& probe, HeldPoint& state) noexcept {
  constexpr double printed_tick = 1e-3;  // s: the paper's loop runs at 1 kHz
  const double ticks = std::max(0.0, dt.count()) / printed_tick;
  const double share = 1.0 / (1.0 + ticks * (1.0 - friction) / friction);
  const Vec3 last = state.pushed ? state.point : spring.foot;
  const Vec3 held = spring.foot + share * (last - spring.foot);
  const Vec3 ray = held - probe;
  const double length = ray.norm();
  if (!(length > 0.0)) return held;
  double along = length;
  if (spring.trust > 0.0)
    along += spring.trust * (surface_along(felt, probe, ray / length, start, length, voxel, state.cache) - length);
  // A contact point that moves may not lengthen the spring: that is what keeps it from giving energy (formulation D1).
  if (state.pushed) along = std::min(along, (last - probe).norm());
  return probe + (along / length) * ray;
}

/// Damping of a magnetic surface: along the normal, fading with the attraction. It may pull, as the magnet does.
Vec3 magnet_damping(double g, double band, double damping, const Vec3& normal, const Vec3& velocity) noexcept {
  const double share = std::max(0.0, g) / band;
  const double window = 1.0 - share * share;
  return -damping * window * window * velocity.dot(normal) * normal;
}

}  // namespace

void leave_contact_point(HeldPoint& state) noexcept {
  state.pushed = false;
  state.normal = Vec3::Zero();
}

LawForce printed_push(const ImplicitSurface& surface, ContactMagnitude magnitude, double offset, double depth_gain,
                      const Potential& here, const Material& own, const Vec3& probe, const Vec3& velocity,
                      HeldPoint& state) noexcept {
  const PrintedContact contact = printed_contact(surface, magnitude, offset, here, probe, state.cache.sparse);
  if (!contact.found) {
    leave_contact_point(state);
    return {};
  }
  Vec3 point = probe + contact.depth * contact.direction;
  const Material material = material_at(surface, own, contact.original, state.cache.sparse);
  if (material.dynamic_friction > 0.0 && state.retarded)
    point = printed_drag(surface, offset, friction_of(material, depth_gain, contact.depth), point, probe, state);
  state.pushed = true;
  state.point = point;
  state.normal = contact.direction;
  LawForce answer;
  answer.contact = true;
  answer.damped = true;
  answer.push = material.stiffness * (point - probe).dot(contact.direction);
  answer.force = material.stiffness * (point - probe) - material.damping * velocity;  // eq. 1
  answer.point = offset > 0.0 ? contact.original : point;
  answer.normal = contact.direction;
  answer.penetration = (point - probe).norm();
  return answer;
}

LawForce potential_push(const ContactPointRule& rule, const ImplicitSurface& surface, const Material& own,
                        const Vec3& probe, const Vec3& velocity, Seconds dt, HeldPoint& state) noexcept {
  const Felt felt(surface, rule.offset, state.cache);
  const Vec3 previous = state.started ? state.previous : probe;
  state.previous = previous;
  state.started = true;
  Potential here;
  const bool known = felt.at(probe, state.cache, here);
  const bool outside = !known || here.value >= 0.0;
  state.seen_outside = state.seen_outside || outside;
  if (!known || !state.seen_outside || (outside && !(here.value < rule.band))) {
    leave_contact_point(state);
    state.previous = probe;
    return {};
  }
  const Trust trust(surface, felt.level());
  const Pull spring = spring_at(felt, trust, rule.band, here, surface.untextured(), probe, state);
  const Vec3 normal = state.normal;
  const Material material = material_at(surface, own, spring.foot - rule.offset * normal, state.cache.sparse);
  const bool drags = material.dynamic_friction > 0.0 && state.retarded && !outside;
  Vec3 point = spring.foot;
  Vec3 pull = spring.pull;
  const bool held = !(spring.trust < 1.0 && normal.isZero());
  if (drags) {
    point = dragged(felt, surface.grid().voxel(), friction_of(material, rule.depth_gain, spring.pull.norm()), dt,
                    spring, here.value, probe, state);
    pull = point - probe;
  }
  state.previous = probe;
  if (!held) {
    // Nobody knows the way out: felt again after having been outside.
    leave_contact_point(state);
    state.seen_outside = false;
    return {};
  }
  state.pushed = !outside;
  state.point = point;
  LawForce answer;
  answer.contact = true;
  answer.damped = true;
  answer.normal = normal;
  answer.point = point - rule.offset * normal;
  // Of a force that is an energy's slope, the depth that the energy goes by.
  answer.penetration = !drags && spring.trust == 1.0 ? -here.value : pull.norm();
  answer.force = material.stiffness * pull;
  answer.local = material.stiffness;
  answer.spring = answer.force;
  answer.stored = material.stiffness * ((drags ? 0.5 * pull.squaredNorm() - well(rule.band) : spring.energy));
  answer.keeps = spring.trust < 1.0;
  if (!drags && !answer.keeps) answer.stiffness = material.stiffness * std::max(1.0, spring.slope.squaredNorm());
  answer.push = outside ? 0.0 : answer.force.dot(normal);
  if (rule.band > 0.0) {
    answer.force += magnet_damping(here.value, rule.band, material.damping, normal, velocity);
  } else {
    answer.force = with_damping(answer.force, normal, velocity, material.damping);
  }
  return answer;
}

}  // namespace asperity
