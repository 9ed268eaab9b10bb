// Isosurfaces that are crossed and uncrossed: large-data-2008, section 4.2 (M2).

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>

#include "asperity/core/option.h"
#include "asperity/render/laws/cross_uncross.h"
#include "asperity/render/touched_surface.h"

namespace asperity {

namespace {

/// What the law remembers, while it is asked.
struct Crossing : CrossUncrossLaw::State {
  Vec3 point;   ///< crossed, or held to
  Vec3 normal;  ///< the gradient saved there
  bool started = false;
  bool seen_outside = false;
};

// --- as printed ---

// Grid points looked at in one walk; the rest of a longer motion goes unseen.
constexpr int most_path_points = 1024;

/// Reach of [R, T] where the scene names none, in cells.
constexpr double literal_reach_cells = 64.0;

/// The 3-D line of Bresenham between the grid points nearest to two places. Grid: as fine as the narrowest cell, evenly
/// spaced from the volume's lower corner.
class GridLine {
 public:
  GridLine(const IsoView& view, const Vec3& from, const Vec3& to) noexcept
      : origin_(view.field->bounds().lower), spacing_(view.field->narrowest_cell()) {
    for (std::size_t a = 0; a < 3; ++a) {
      at_[a] = nearest(from, a);
      const std::int64_t way = nearest(to, a) - at_[a];
      step_[a] = way < 0 ? -1 : 1;
      count_[a] = std::abs(way);
    }
    longest_ = std::max({count_[0], count_[1], count_[2]});
    for (std::size_t a = 0; a < 3; ++a) error_[a] = 2 * count_[a] - longest_;
  }

  [[nodiscard]] Vec3 point() const noexcept {
    return origin_ +
           spacing_ * Vec3(static_cast<double>(at_[0]), static_cast<double>(at_[1]), static_cast<double>(at_[2]));
  }
  /// Goes on to the next point; false at the end.
  bool advance() noexcept {
    if (done_ >= longest_ || done_ + 1 >= most_path_points) return false;
    ++done_;
    for (std::size_t a = 0; a < 3; ++a) {
      // The longest axis steps every time: its error is at least 0 throughout.
      if (count_[a] == longest_) {
        at_[a] += step_[a];
      } else {
        if (error_[a] >= 0) {
          at_[a] += step_[a];
          error_[a] -= 2 * longest_;
        }
        error_[a] += 2 * count_[a];
      }
    }
    return true;
  }

 private:
  [[nodiscard]] std::int64_t nearest(const Vec3& p, std::size_t axis) const noexcept {
    // Far beyond any volume, and still far from the range of the integer.
    constexpr double farthest = 1e12;
    const auto a = static_cast<Eigen::Index>(axis);
    return static_cast<std::int64_t>(std::round(std::clamp((p[a] - origin_[a]) / spacing_, -farthest, farthest)));
  }

  Vec3 origin_;
  double spacing_;
  std::array<std::int64_t, 3> at_{};
  std::array<std::int64_t, 3> step_{};
  std::array<std::int64_t, 3> count_{};
  std::array<std::int64_t, 3> error_{};
  std::int64_t longest_ = 0;
  std::int64_t done_ = 0;
};

/// The field at a point; not-a-number where nothing is known.
double value_at(const IsoView& view, const Vec3& p) noexcept {
  const CellPolynomial* cell = view.over(p);
  return cell != nullptr ? cell->value(p) : std::numeric_limits<double>::quiet_NaN();
}

/// Positive outside, negative inside; not-a-number where nothing is known.
double phi_of(const IsoView& view, double value) noexcept {
  return view.sigma * (value - view.threshold);
}

/// Intersection of a segment with the isosurface by the printed walk: of the two grid points around the first change of
/// side, the one whose value is nearer to the threshold. A segment within one grid point answers that point when
/// `single` is set.
bool walked_intersection(const IsoView& view, const Vec3& from, const Vec3& to, bool single, Vec3& out) noexcept {
  GridLine line(view, from, to);
  Vec3 last = line.point();
  double last_phi = phi_of(view, value_at(view, last));
  out = last;
  bool moved = false;
  while (line.advance()) {
    moved = true;
    const Vec3 here = line.point();
    const double phi = phi_of(view, value_at(view, here));
    if ((last_phi < 0.0 && phi >= 0.0) || (last_phi >= 0.0 && phi < 0.0)) {
      out = std::abs(phi) < std::abs(last_phi) ? here : last;
      return true;
    }
    last = here;
    last_phi = phi;
  }
  return single && !moved;
}

/// The third part of the printed loop: T from the probe along the gradient that was saved at I, V by the same walk.
LawForce literal_push(const CrossUncrossLaw& law, const IsoView& view, double stiffness, const Vec3& probe,
                      const Vec3& velocity, Crossing& state) noexcept {
  LawForce answer;
  const double reach = law.reach > 0.0 ? law.reach : literal_reach_cells * view.field->narrowest_cell();
  const Vec3 target = probe + reach * state.normal;  // eq. 15
  Vec3 virtual_point;
  if (!walked_intersection(view, probe, target, false, virtual_point)) return answer;
  state.point = virtual_point;
  answer.contact = true;
  answer.force = stiffness * (virtual_point - probe) - law.retarding * velocity;
  answer.point = virtual_point;
  answer.normal = state.normal;
  answer.penetration = (virtual_point - probe).norm();
  return answer;
}

/// One tick of the printed algorithm: each `return` is its `Exit` of the path loop.
LawForce literal_force(const CrossUncrossLaw& law, const IsoView& view, double stiffness, const Vec3& probe,
                       const Vec3& velocity, Crossing& state) noexcept {
  LawForce force;
  GridLine path(view, state.previous, probe);
  do {
    const Vec3 here = path.point();
    const double before = phi_of(view, state.value);
    state.value = value_at(view, here);
    const double now = phi_of(view, state.value);
    if (!(now <= 0.0)) {  // new > d0, or nothing known
      state.crossed = false;
      return {};
    }
    if (now < 0.0 && before > 0.0) {
      // Only the gradient is saved: the force comes with the next tick.
      state.crossed = walked_intersection(view, state.previous, here, true, state.point);
      state.normal = view.outward(state.point);
      state.crossed = state.crossed && !state.normal.isZero();
      return {};
    }
    // The force is that of R, which does not change along the path: once is enough.
    if (state.crossed && !force.contact) force = literal_push(law, view, stiffness, probe, velocity, state);
  } while (path.advance());
  return force;
}

// --- consistent ---

// Crossings of one motion that are followed one by one.
constexpr int most_crossings = 64;
// Projections of the probe along the normal at the point that the last one found, and when they have settled: what is
// left of the probe's offset along the surface is this share of its depth, or of a cell.
constexpr int most_projections = 4;
constexpr double settled_share = 1e-3;
constexpr double settled_cells = 1e-4;
// How far a line is searched that has lost its root: this times the last penetration, and some cells.
constexpr double reach_factor = 2.0;
constexpr double reach_cells = 2.0;

/// Follows every crossing of the motion, in order: afterwards `crossed` says whether the probe came in from outside.
void follow_crossings(const IsoView& view, const Segment& motion, Crossing& state) noexcept {
  const double length = (motion.to - motion.from).norm();
  if (!(length > 0.0)) return;
  // Beyond the crossing by less than anything that can be felt, so that it is not met again.
  const double after = view.skin() / length;
  double from = 0.0;
  for (int i = 0; i < most_crossings && from < 1.0; ++i) {
    const IsoCrossing crossing = view.first_crossing(motion, from);
    if (!crossing.found) return;
    // Whatever crosses inwards was outside just before, even if its motion began beyond the volume.
    state.crossed = crossing.inward;
    state.seen_outside = true;
    if (crossing.inward) {
      state.point = crossing.point;
      state.normal = crossing.outward;
    }
    from = crossing.t + after;
  }
}

/// The root near `height` on a line from the probe, by Newton's method: only where it is so near that nothing can lie
/// in between. Sets V and its normal.
bool polish(const IsoView& view, const Vec3& probe, const Vec3& line, double height, Crossing& state) noexcept {
  constexpr int most_steps = 4;
  constexpr double farthest = 0.1;  // cells, of the root from `height`
  constexpr double close = 1e-4;    // cells: the next step would be the square of that
  const double cell = view.field->narrowest_cell();
  double at = height;
  for (int i = 0; i < most_steps; ++i) {
    FieldJet jet;
    const Vec3 p = probe + at * line;
    if (!view.field->sample(view.level, p, view.cells->other, jet)) return false;
    const double length = jet.gradient.norm();
    const double slope = view.sigma * jet.gradient.dot(line);
    if (!(slope > 0.1 * length)) return false;
    const double step = -phi_of(view, jet.value) / slope;
    at += step;
    if (!(std::abs(at - height) < farthest * cell) || at < 0.0) return false;
    if (std::abs(step) > close * cell) continue;
    state.point = probe + at * line;
    state.normal = (view.sigma / length) * jet.gradient;
    return true;
  }
  return false;
}

/// Puts V where a line from the probe meets the surface: near the last V, or else at the first place where it leaves
/// the inside. False: no surface that way.
bool project_along(const IsoView& view, const Vec3& probe, const Vec3& line, Crossing& state) noexcept {
  if (polish(view, probe, line, (state.point - probe).dot(line), state)) return true;
  const double reach = reach_factor * (state.point - probe).norm() + reach_cells * view.field->narrowest_cell();
  const IsoCrossing hit = view.first_crossing({probe, probe + reach * line});
  if (!hit.found || hit.inward || hit.outward.isZero()) return false;
  state.point = hit.point;
  state.normal = hit.outward;
  return true;
}

/// What lies between the probe and V along the surface: zero where V is a nearest point.
Vec3 offset_along(const Crossing& state, const Vec3& probe) noexcept {
  const Vec3 way = probe - state.point;
  return way - way.dot(state.normal) * state.normal;
}

/// Projects the probe along the normal at V until the normal there is the one that it was projected along. Each round
/// leaves the share depth x curvature of the offset; from the second on the normal is extrapolated to where that series
/// ends. False: no surface that way.
bool project(const IsoView& view, const Vec3& probe, Crossing& state) noexcept {
  if (state.normal.isZero()) return false;
  Vec3 line = state.normal;
  for (int i = 0; i < most_projections; ++i) {
    const Vec3 last_point = state.point;
    const Vec3 last_normal = state.normal;
    if (!project_along(view, probe, line, state)) return i > 0;
    const Vec3 left = offset_along(state, probe);
    const double settled =
        std::max(settled_cells * view.field->narrowest_cell(), settled_share * (state.point - probe).norm());
    if (left.squaredNorm() <= settled * settled) break;
    const Vec3 moved = state.point - last_point;
    const double squared = moved.squaredNorm();
    const double share = squared > 0.0 ? std::clamp(left.dot(moved) / squared, -0.5, 0.8) : 0.0;
    line = (state.normal + (share / (1.0 - share)) * (state.normal - last_normal)).normalized();
  }
  return true;
}

/// V by the nearest point of the surface, where the normal leads nowhere: at most as far as V was.
bool nearest_point(const IsoView& view, const Vec3& probe, Crossing& state) noexcept {
  const double bound = reach_factor * (state.point - probe).norm() + reach_cells * view.field->narrowest_cell();
  const Foot foot = view.nearest(probe, bound, {0, false, state.point});
  if (!foot.found()) return false;
  const Vec3 normal = view.outward(foot.point);
  if (normal.isZero()) return false;
  state.point = foot.point;
  state.normal = normal;
  return true;
}

/// The surface has come over a place that was outside: its threshold changed, or its level.
void take_over(const IsoView& view, const Vec3& place, Crossing& state) noexcept {
  state.crossed = true;
  state.point = place;
  state.normal = view.outward(place);
}

LawForce consistent_force(const CrossUncrossLaw& law, const IsoView& view, double stiffness, const Vec3& probe,
                          const Vec3& velocity, Crossing& state) noexcept {
  const double before = state.started ? phi_of(view, state.value) : std::numeric_limits<double>::quiet_NaN();
  state.value = value_at(view, probe);
  const double now = phi_of(view, state.value);
  if (!state.started || std::isnan(now)) {
    // Beyond the volume nobody knows on which side the probe is, until it is outside again.
    state.crossed = false;
    state.seen_outside = now >= 0.0;
    return {};
  }
  if (std::isnan(before)) {
    state.crossed = false;
    state.seen_outside = false;
  } else if (before >= 0.0) {
    state.crossed = false;
    state.seen_outside = true;
  } else if (state.seen_outside && !state.crossed) {
    take_over(view, state.previous, state);
  }
  follow_crossings(view, {state.previous, probe}, state);
  if (now >= 0.0) {
    state.crossed = false;
    state.seen_outside = true;
  } else if (state.seen_outside && !state.crossed) {
    take_over(view, probe, state);
  }
  if (!state.crossed) return {};
  if (!project(view, probe, state) && !nearest_point(view, probe, state)) {
    state.crossed = false;
    state.seen_outside = false;
    return {};
  }
  LawForce answer;
  answer.contact = true;
  answer.spring = stiffness * (state.point - probe);
  answer.stiffness = stiffness;
  answer.force = answer.spring - law.retarding * velocity;
  answer.point = state.point;
  answer.normal = state.normal;
  answer.penetration = (state.point - probe).norm();
  answer.stored = 0.5 * stiffness * (state.point - probe).squaredNorm();
  return answer;
}

}  // namespace

void CrossUncrossLaw::options(std::vector<Option>& rows) {
  using L = CrossUncrossLaw;
  rows.push_back(option("retarding", &L::retarding, OptionType::quantity(Dimension::damping, Range::not_negative()),
                        "resistance against motion within."));
  rows.push_back(option("reach", &L::reach, OptionType::quantity(Dimension::length, Range::not_negative()),
                        "how far along the gradient the surface is looked for; 0: 64 cells.")
                     .of_printed_form("which looks as far as it has to"));
}

LawForce CrossUncrossLaw::force(const TouchedSurface& surface, const Material& material, const Vec3& probe,
                                const Vec3& velocity, Seconds, State& memory) const noexcept {
  if (!probe.allFinite()) return {};
  const IsoView& view = surface.touch().iso();
  Contact& contact = *surface.touch().contact;
  Crossing state{memory, contact.first().at, contact.surface.normal, contact.asked, contact.seen_outside};
  LawForce answer;
  if (formulation == Formulation::consistent) {
    answer = consistent_force(*this, view, material.stiffness, probe, velocity, state);
  } else if (state.started) {
    answer = literal_force(*this, view, material.stiffness, probe, velocity, state);
  } else {
    state.value = value_at(view, probe);
  }
  memory = state;
  memory.previous = probe;
  contact.put({0, false, state.point});
  contact.surface.normal = state.normal;
  contact.seen_outside = state.seen_outside;
  contact.asked = true;
  return answer;
}

}  // namespace asperity
