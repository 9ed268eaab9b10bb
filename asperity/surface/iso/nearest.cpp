// The nearest places of an isosurface: cells in order of distance, dismissed by bounds.

#include <algorithm>
#include <cmath>
#include <limits>

#include "asperity/field/volume/cell_part.h"
#include "asperity/surface/iso/kept_cells.h"
#include "asperity/surface/iso/surface.h"

namespace asperity {

namespace {

// What is nearer by less than this share is not looked for.
constexpr double no_nearer = 1e-9;

/// By what is known of a field at one place of a box it is bounded over all of it.
struct FieldBound {
  double value = 0.0;  ///< above 0
  Vec3 gradient = Vec3::Zero();
  double bend = 0.0;  ///< how fast the gradient changes at most
};

/// Whether a field is above 0 wherever a box is nearer to the origin than `distance`, by its Taylor polynomial at `at`,
/// from where the box reaches to `before` and `beyond`: less the field's slope over twice the distance, Lagrange's
/// multiplier, times by how much the squared distance falls short, what is bounded is bent as the ball around the
/// origin is, and its least over the box is the sum of that along each axis.
bool is_positive_around(const FieldBound& field, const Vec3& at, const Vec3& before, const Vec3& beyond,
                        double distance) noexcept {
  const double slope = field.gradient.norm();
  const double weight = 0.5 * slope / distance;
  const double curved = weight - 0.5 * field.bend;
  double least = field.value + weight * (at.squaredNorm() - distance * distance);
  for (int a = 0; a < 3; ++a) {
    const double rise = field.gradient[a] + 2.0 * weight * at[a];
    const auto there = [&](double x) { return x * (rise + curved * x); };
    least += curved > 0.0 ? there(std::clamp(-0.5 * rise / curved, before[a], beyond[a]))
                          : std::min(there(before[a]), there(beyond[a]));
  }
  return least >= -no_nearer * slope * distance;
}

float rounded_down(double x) noexcept {
  const auto rounded = static_cast<float>(x);
  return static_cast<double>(rounded) > x ? std::nextafter(rounded, -std::numeric_limits<float>::infinity()) : rounded;
}
float rounded_up(double x) noexcept {
  return -rounded_down(-x);
}

/// How a nearest place is told.
enum class Feet {
  as_walked,  ///< where a walk ends, a share of a cell off
  exact,      ///< to rounding
};

/// Leaves of the octree nearest first, cut off at what has been found.
class NearestSearch {
 public:
  NearestSearch(const IsoView& surface, const Vec3& p, double bound, const Place& start, Feet feet) noexcept
      : surface_(surface),
        field_(*surface.field),
        axes_(field_.axes(surface.level)),
        octree_(field_.octree(surface.level)),
        kept_(field_.bricks() == nullptr ? surface.cells->kept : nullptr),
        p_(p),
        best_(bound),
        start_(start),
        feet_(feet) {
    foot_.distance = bound;
  }

  Foot run() noexcept {
    if (start_.known()) {
      if (!go_to(start_.at)) {
        lead(start_.at);
      } else if (foot_.found()) {
        from_start_ = best_;
      }
    }
    // Downhill from the point itself: near a smooth surface that is all.
    if (feet_ == Feet::as_walked || (!foot_.found() && best_ == infinity))
      lead(p_.cwiseMax(field_.bounds().lower).cwiseMin(field_.bounds().upper));
    // Until one that begins with what has been found finds nothing nearer: what is answered to a search that begins
    // with this answer is it.
    const auto pass = [&] {
      found_nearer_ = false;
      last_pass_ = work_;
      visit(octree_.root());
      return found_nearer_;
    };
    for (int i = 0; pass() && feet_ == Feet::exact && i < most_passes; ++i) continue;
    tell(surface_.work, work_);
    return foot_;
  }
  /// How far the foot is that Newton's method alone led to from the start: no bound beyond that changes anything.
  [[nodiscard]] double from_start() const noexcept { return from_start_; }
  /// Whether it ends with such a foot: what a search that begins with it takes is the last pass.
  [[nodiscard]] bool is_settled() const noexcept { return settled_ && !found_nearer_; }
  [[nodiscard]] WorkCount last_pass() const noexcept {
    return {work_.evaluations - last_pass_.evaluations, 0, work_.frames - last_pass_.frames};
  }
  [[nodiscard]] const WorkCount& work() const noexcept { return work_; }

 private:
  /// A cell that may hold what is nearer, and its place nearest to p.
  struct Looked {
    const CellPolynomial& cell;
    Vec3 start;
    double sign;  ///< of the field less the threshold, there
  };
  // How often a cell is halved, along each axis in turn: to an eighth, and on where p is as near as that.
  static constexpr int finest_part = 9;
  static constexpr int finer = 6;  ///< and so often more where Newton's method does not come to rest
  static constexpr int most_halvings = 30;
  static constexpr int most_passes = 16;
  static constexpr double finest_of_distance = 0.5;

  /// How far p is along one axis from the cells first … last - 1, squared.
  [[nodiscard]] double beyond(std::size_t axis, std::uint32_t first, std::uint32_t last) const noexcept {
    const double x = p_[static_cast<int>(axis)];
    const double off = std::max({0.0, axes_[axis].node(first) - x, x - axes_[axis].node(last)});
    return off * off;
  }
  [[nodiscard]] double beyond(std::size_t axis, std::uint32_t cell) const noexcept {
    return beyond(axis, cell, cell + 1);
  }

  void visit(const MinMaxOctree::Node& node) noexcept {
    if (!field_.may_cross(surface_.level, node, surface_.threshold)) return;
    if (node.level == 0) {
      visit_leaf(node);
      return;
    }
    MinMaxOctree::Node children[8];
    double distance[8];
    int order[8];
    const int count = octree_.children(node, children);
    for (int i = 0; i < count; ++i) {
      std::uint32_t first[3];
      std::uint32_t last[3];
      octree_.cells_of(children[i], first, last);
      double squared = 0.0;
      for (std::size_t a = 0; a < 3; ++a) squared += beyond(a, first[a], std::min(last[a], axes_[a].cells()));
      distance[i] = std::sqrt(squared);
      int at = i;
      for (; at > 0 && distance[order[at - 1]] > distance[i]; --at) order[at] = order[at - 1];
      order[at] = i;
    }
    for (int i = 0; i < count; ++i) {
      if (distance[order[i]] < best_) visit(children[order[i]]);
    }
  }

  void visit_leaf(const MinMaxOctree::Node& node) noexcept {
    std::uint32_t first[3];
    std::uint32_t last[3];
    octree_.cells_of(node, first, last);
    for (std::size_t a = 0; a < 3; ++a) {
      last[a] = std::min(last[a], axes_[a].cells());
      while (first[a] < last[a] && !(beyond(a, first[a]) < best_ * best_)) ++first[a];
      while (first[a] < last[a] && !(beyond(a, last[a] - 1) < best_ * best_)) --last[a];
    }
    for (std::uint32_t k = first[2]; k < last[2]; ++k) {
      const double z = beyond(2, k);
      for (std::uint32_t j = first[1]; j < last[1]; ++j) {
        const double yz = z + beyond(1, j);
        for (std::uint32_t i = first[0]; i < last[0]; ++i) {
          if (yz + beyond(0, i) < best_ * best_) visit_cell({{i, j, k}});
        }
      }
    }
  }

  /// The polynomial of a cell; none where that is not known.
  const CellPolynomial* polynomial(const CellIndex& index) noexcept {
    CellPolynomial& slot = kept_ != nullptr ? kept_->polynomial(index) : scratch_;
    return field_.load(surface_.level, index, slot) ? &slot : nullptr;
  }

  const CellSummary& summary_of(const CellIndex& index) noexcept {
    CellSummary& summary = kept_ != nullptr ? kept_->summary(index) : scratch_summary_;
    const FieldLevel of{field_.identity(), surface_.level};
    if (summary.cell == index && summary.of == of) return summary;
    summary.of = of;
    summary.cell = index;
    if (const CellPolynomial* cell = polynomial(index)) {
      const FieldJet middle = cell->gradient(cell->lower + 0.5 * cell->width);
      summary.low = rounded_down(cell->low());
      summary.high = rounded_up(cell->high());
      summary.bend = rounded_up(cell->most_bend());
      summary.value = middle.value;
      summary.gradient = middle.gradient;
    } else {
      // No threshold lies between.
      summary.low = std::numeric_limits<float>::infinity();
      summary.high = -summary.low;
    }
    return summary;
  }

  void visit_cell(const CellIndex& index) noexcept {
    const CellSummary& summary = summary_of(index);
    ++work_.evaluations;
    if (!(static_cast<double>(summary.low) <= surface_.threshold &&
          surface_.threshold <= static_cast<double>(summary.high)))
      return;
    Vec3 half;
    Vec3 middle;
    for (std::size_t a = 0; a < 3; ++a) {
      const int axis = static_cast<int>(a);
      half[axis] = 0.5 * axes_[a].width(index.at[a]);
      middle[axis] = axes_[a].node(index.at[a]) + half[axis];
    }
    const auto bend = static_cast<double>(summary.bend);
    const auto bound = [&](double value, const Vec3& gradient) {
      const double sign = value >= surface_.threshold ? 1.0 : -1.0;
      return FieldBound{sign * (value - surface_.threshold), sign * gradient, bend};
    };
    if (is_positive_around(bound(summary.value, summary.gradient), middle - p_, -half, half, best_)) return;
    const CellPolynomial* cell = polynomial(index);
    if (cell == nullptr) return;
    ++work_.frames;
    // Where what is known comes nearest, bounds are closest.
    const Vec3 high = cell->upper();
    const Vec3 at = (foot_.found() ? foot_.point : p_).cwiseMax(cell->lower).cwiseMin(high);
    const FieldJet jet = cell->gradient(at);
    if (is_positive_around(bound(jet.value, jet.gradient), at - p_, cell->lower - at, high - at, best_)) return;
    const Vec3 start = p_.cwiseMax(cell->lower).cwiseMin(high);
    const double sign = cell->value(start) >= surface_.threshold ? 1.0 : -1.0;
    look_within({*cell, start, sign}, CellPart(*cell, surface_.threshold, sign), 0);
  }

  void look_within(const Looked& looked, const CellPart& part, int halvings) noexcept {
    if ((p_ - p_.cwiseMax(part.low).cwiseMin(part.high)).squaredNorm() >= best_ * best_) return;
    ++work_.evaluations;
    const double weight = 0.5 * part.slope_near(foot_.found() ? foot_.point : p_) / best_;
    if (part.is_positive_around(p_, best_, weight, no_nearer)) return;
    for (unsigned corner = 0; corner < 8; ++corner) {
      if (part.at_corner(corner) > 0.0) continue;
      const Vec3 end = part.corner(corner);
      double t = 0.0;
      if ((p_ - end).squaredNorm() >= best_ * best_) continue;
      if (!looked.cell.leaves_sign(looked.start, end, 0.0, 1.0, surface_.threshold, looked.sign, t)) continue;
      const Vec3 root = looked.start + t * (end - looked.start);
      if (!go_to(root)) lead(root);
    }
    const double size = (part.high - part.low).norm();
    const bool fine = halvings >= finest_part && size <= finest_of_distance * best_;
    const Vec3 middle = 0.5 * (part.low + part.high);
    if (fine && (tells_all_within(looked.cell, middle, size) || go_to(middle))) return;
    const bool by_walks = feet_ == Feet::as_walked || looked.cell.degree == 1;
    if (halvings >= most_halvings || (fine && (by_walks || halvings >= finest_part + finer))) {
      lead(middle);
      return;
    }
    const int axis = 2 - halvings % 3;
    CellPart halves[2];
    part.halves(axis, halves[0], halves[1]);
    const unsigned nearer = p_[axis] > halves[1].low[axis] ? 1U : 0U;
    look_within(looked, halves[nearer], halvings + 1);
    look_within(looked, halves[1U - nearer], halvings + 1);
  }

  /// Whether what has been found is all there is near it: the surface is there bent much less than a ball around p is,
  /// and over cells' faces its gradient does not jump.
  [[nodiscard]] bool tells_all_within(const CellPolynomial& cell, const Vec3& middle, double size) const noexcept {
    constexpr double much_less = 0.5;
    if (!foot_.found() || !(foot_room_ >= much_less) || (foot_.point - middle).norm() > size) return false;
    return cell.degree == 3 || cell.has_well_inside(foot_.point);
  }

  /// By Newton's method within a cell, where feet are told exactly. Whether it comes to rest there.
  bool go_to(const Vec3& x) noexcept {
    Foot foot{x, Vec3::Zero(), infinity, no_index, x};
    double room = 0.0;
    if (feet_ == Feet::as_walked || !surface_.settle(foot, p_, 1.0, &room)) return false;
    offer(foot.point, room, true);
    return true;
  }

  /// Newton along the gradient onto the surface, then along it to the nearest point.
  void lead(Vec3 x) noexcept {
    constexpr int most_steps = 8;
    constexpr double close = 1e-9;
    const double grain = field_.narrowest_cell();
    FieldJet jet;
    bool on_surface = false;
    for (int step = 0; step < most_steps && !on_surface; ++step) {
      if (!surface_.sample(x, jet)) return;
      const double squared = jet.gradient.squaredNorm();
      if (!(squared > 0.0)) return;
      const double off = surface_.threshold - jet.value;
      Vec3 move = (off / squared) * jet.gradient;
      const double length = move.norm();
      on_surface = length <= close * grain;
      if (length > 2.0 * grain) move *= 2.0 * grain / length;
      x = (x + move).cwiseMax(field_.bounds().lower).cwiseMin(field_.bounds().upper);
    }
    if (!on_surface) return;
    Place place{0, !(surface_.sigma * (p_ - x).dot(jet.gradient) >= 0.0), x};
    IsoSpot spot{x, Vec3::Zero(), Vec3::Zero()};
    WorkMeter walk;
    walk.begin(0);
    IsoView counted = surface_;
    counted.work = &walk;
    counted.descend(place, spot, {.point = p_, .may_leave = false, .any_sheet = feet_ == Feet::exact});
    work_ += walk.done();
    Foot foot{spot.point, Vec3::Zero(), infinity, no_index, spot.point};
    double room = 0.0;
    const bool settled = surface_.settle(foot, p_, IsoView::left_by_walks, &room);
    if (feet_ == Feet::exact) {
      offer(foot.point, room, settled);
    } else {
      offer(spot.point, room, false);
    }
  }

  /// What may be the nearest place. `room`: as IsoView::settle tells, or 0.
  void offer(const Vec3& point, double room, bool settled) noexcept {
    const double distance = (point - p_).norm();
    if (!(distance < (foot_.found() ? 1.0 - no_nearer : 1.0) * best_)) return;
    found_nearer_ = true;
    settled_ = settled;
    foot_room_ = room;
    best_ = foot_.distance = distance;
    foot_.point = foot_.at = point;
    const Vec3 outward = surface_.outward(point);
    foot_.normal = (p_ - point).dot(outward) >= 0.0 ? outward : Vec3(-outward);
    foot_.element = surface_.element_at(point);
  }

  const IsoView& surface_;
  const ScalarField& field_;
  const GridAxes& axes_;
  const MinMaxOctree& octree_;
  KeptCells* kept_;
  Vec3 p_;
  double best_;
  const Place& start_;
  Feet feet_;
  Foot foot_;
  double foot_room_ = 0.0;
  bool settled_ = false;
  double from_start_ = infinity;
  bool found_nearer_ = false;  ///< in this pass
  WorkCount work_;
  WorkCount last_pass_;     ///< what it had taken before that
  CellPolynomial scratch_;  ///< where nothing is kept
  CellSummary scratch_summary_;
};

}  // namespace

Foot IsoView::nearest(const Vec3& p, double bound, const Place& start) const noexcept {
  return NearestSearch(*this, p, bound, start, Feet::as_walked).run();
}

Foot IsoView::nearest_exactly(const Vec3& p, double bound, const Place& start) const noexcept {
  KeptCells* const kept = field->bricks() == nullptr ? cells->kept : nullptr;
  if (kept == nullptr) return NearestSearch(*this, p, bound, start, Feet::exact).run();
  const KeptCells::Asked asked{{field->identity(), level}, threshold, p};
  for (const unsigned before : {0U, 1U}) {
    const KeptCells::Answer& answer = kept->answer(before);
    if (!(answer.asked == asked)) continue;
    const auto begins_at = [&](const Vec3& at) { return start.known() && start.at == at; };
    const bool reached = answer.foot.found() && answer.foot.distance < bound;
    const bool as_then = (answer.from_start < bound || answer.bound == bound) &&
                         (answer.started ? begins_at(answer.start) : !start.known());
    const bool from_it = answer.settled && reached && begins_at(answer.foot.at);
    if (!as_then && !from_it) continue;
    tell(work, as_then ? answer.work : answer.last_pass);
    return answer.foot;
  }
  NearestSearch search(*this, p, bound, start, Feet::exact);
  const Foot foot = search.run();
  kept->keep({asked, bound, start.known(), start.at, search.from_start(), foot, search.is_settled(), search.work(),
              search.last_pass()});
  return foot;
}

Foot IsoView::refined(const Foot& foot, const Vec3& p) const noexcept {
  Foot there = foot;
  return settle(there, p, left_by_walks) ? there : foot;
}

bool IsoView::settle(Foot& foot, const Vec3& p, double farthest, double* room) const noexcept {
  constexpr int most_steps = 6;
  constexpr double least = 1e-12;  // of a cell, that is worth a step
  constexpr double none = 1e-10;   // of a cell, by which a place is one already
  constexpr double least_curvature = 1e-4;
  const CellPolynomial* cell = over(foot.point);
  if (cell == nullptr) return false;
  const double width = cell->width.minCoeff();
  Vec3 x = foot.point;
  for (int step = 0; step < most_steps; ++step) {
    const FieldJet jet = cell->jet(x);
    const double slope = jet.gradient.norm();
    if (!(slope > 0.0)) return false;
    const Vec3 normal = jet.gradient / slope;
    // Newton's step of half the squared distance along the surface, from where that is passed along the normal.
    const Vec3 off = p - x;
    const Mat3 curved = Mat3::Identity() + off.dot(normal) / slope * jet.hessian;
    const double rise = (threshold - jet.value) / slope;
    const Vec3 u = normal.unitOrthogonal();
    const Vec3 v = normal.cross(u);
    const Vec3 pull = off - rise * (curved * normal);
    const double uu = u.dot(curved * u);
    const double uv = u.dot(curved * v);
    const double vv = v.dot(curved * v);
    const double determinant = uu * vv - uv * uv;
    if (!(uu + vv > 0.0) || !(determinant > least_curvature * (uu + vv))) return false;
    const double along_u = (vv * u.dot(pull) - uv * v.dot(pull)) / determinant;
    const double along_v = (uu * v.dot(pull) - uv * u.dot(pull)) / determinant;
    const Vec3 move = along_u * u + along_v * v + rise * normal;
    const double length = move.norm();
    if (step > 0 || length > none * width) x += move;
    if (!cell->has_well_inside(x) || !((x - foot.point).norm() <= farthest * width)) return false;
    if (length > (step > 0 ? least : none) * width) continue;
    foot.point = foot.at = x;
    foot.distance = (p - x).norm();
    const double half = 0.5 * (uu + vv);
    if (room != nullptr) *room = half - std::sqrt(std::max(0.0, half * half - determinant));
    foot.normal = std::copysign(1.0, foot.normal.isZero() ? 1.0 : foot.normal.dot(normal)) * normal;
    return true;
  }
  return false;
}

}  // namespace asperity
