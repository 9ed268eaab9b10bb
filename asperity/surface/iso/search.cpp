// Where motions meet an isosurface, and its nearest points.

#include <algorithm>
#include <cmath>
#include <limits>

#include "asperity/field/volume/places.h"
#include "asperity/geometry/clip.h"
#include "asperity/surface/iso/surface.h"

namespace asperity {

namespace {

/// Walks the cells that a motion passes, one after the other, by where it leaves each (Amanatides and Woo 1987).
class CellWalk {
 public:
  CellWalk(const GridAxes& axes, const Segment& motion, double from, double to) noexcept
      : axes_(axes), from_(motion.from), motion_(motion.to - motion.from), t_(from), end_(to) {
    const Vec3 start = from_ + from * motion_;
    for (std::size_t a = 0; a < 3; ++a) {
      const int axis = static_cast<int>(a);
      std::uint32_t cell = axes[a].locate(start[axis]).cell;
      // On a face the motion goes into the cell that it moves towards.
      if (motion_[axis] < 0.0 && cell > 0 && start[axis] <= axes[a].node(cell)) --cell;
      if (motion_[axis] > 0.0 && cell + 1 < axes[a].cells() && start[axis] >= axes[a].node(cell + 1)) ++cell;
      cell_.at[a] = cell;
    }
    find_exit();
  }

  [[nodiscard]] const CellIndex& cell() const noexcept { return cell_; }
  [[nodiscard]] double entry() const noexcept { return t_; }
  [[nodiscard]] double exit() const noexcept { return std::min(exit_, end_); }
  /// On to the next cell. False at the end of the motion or of the grid.
  bool next() noexcept {
    if (!(exit_ < end_)) return false;
    t_ = std::max(t_, exit_);
    const bool forward = motion_[static_cast<int>(axis_)] > 0.0;
    if (forward ? cell_.at[axis_] + 1 >= axes_[axis_].cells() : cell_.at[axis_] == 0) return false;
    cell_.at[axis_] += forward ? 1U : ~0U;
    find_exit();
    return true;
  }
  /// On to the first cell beyond a box of cells [first, last). False at the end.
  bool leave(const std::uint32_t first[3], const std::uint32_t last[3]) noexcept {
    double t = infinity;
    for (std::size_t a = 0; a < 3; ++a) {
      const double d = motion_[static_cast<int>(a)];
      if (d == 0.0) continue;
      const std::uint32_t node = d > 0.0 ? std::min(last[a], axes_[a].cells()) : first[a];
      t = std::min(t, (axes_[a].node(node) - from_[static_cast<int>(a)]) / d);
    }
    if (!(t < end_)) return false;
    // From there on cell by cell until the box is left: rounding may put the place on either side of its face.
    const CellWalk there(axes_, {from_, from_ + motion_}, std::max(t, t_), end_);
    cell_ = there.cell_;
    t_ = there.t_;
    exit_ = there.exit_;
    axis_ = there.axis_;
    const auto inside = [&] {
      for (std::size_t a = 0; a < 3; ++a) {
        if (cell_.at[a] < first[a] || cell_.at[a] >= last[a]) return false;
      }
      return true;
    };
    while (inside()) {
      if (!next()) return false;
    }
    return true;
  }

 private:
  void find_exit() noexcept {
    exit_ = infinity;
    for (std::size_t a = 0; a < 3; ++a) {
      const double d = motion_[static_cast<int>(a)];
      if (d == 0.0) continue;
      const double t = (axes_[a].node(cell_.at[a] + (d > 0.0 ? 1 : 0)) - from_[static_cast<int>(a)]) / d;
      if (t < exit_) {
        exit_ = t;
        axis_ = a;
      }
    }
  }

  const GridAxes& axes_;
  Vec3 from_;
  Vec3 motion_;
  double t_;
  double end_;
  double exit_ = 0.0;
  std::size_t axis_ = 0;
  CellIndex cell_;
};

/// Leaves of the octree nearest first, cut off at what has been found.
class NearestSearch {
 public:
  NearestSearch(const IsoView& surface, const Vec3& p, double bound, const Place& start) noexcept
      : surface_(surface), p_(p), best_(bound), start_(start) {
    foot_.distance = bound;
  }

  Foot run() noexcept {
    const ScalarField& field = *surface_.field;
    if (start_.known()) lead(start_.at);
    // Downhill from the point itself: near a smooth surface that is all.
    lead(p_.cwiseMax(field.bounds().lower).cwiseMin(field.bounds().upper));
    visit(field.octree(surface_.level).root());
    tell(surface_.work, {0, 0, cells_});
    return foot_;
  }

 private:
  [[nodiscard]] double distance_to(const std::uint32_t first[3], const std::uint32_t last[3]) const noexcept {
    const GridAxes& axes = surface_.field->axes(surface_.level);
    double squared = 0.0;
    for (std::size_t a = 0; a < 3; ++a) {
      const double x = p_[static_cast<int>(a)];
      const double low = axes[a].node(first[a]);
      const double high = axes[a].node(std::min(last[a], axes[a].cells()));
      const double beyond = std::max({0.0, low - x, x - high});
      squared += beyond * beyond;
    }
    return std::sqrt(squared);
  }

  void visit(const MinMaxOctree::Node& node) noexcept {
    const MinMaxOctree& octree = surface_.field->octree(surface_.level);
    if (!surface_.field->may_cross(surface_.level, node, surface_.threshold)) return;
    if (node.level == 0) {
      visit_leaf(node);
      return;
    }
    MinMaxOctree::Node children[8];
    double distance[8];
    int order[8];
    const int count = octree.children(node, children);
    for (int i = 0; i < count; ++i) {
      std::uint32_t first[3];
      std::uint32_t last[3];
      octree.cells_of(children[i], first, last);
      distance[i] = distance_to(first, last);
      int at = i;
      for (; at > 0 && distance[order[at - 1]] > distance[i]; --at) order[at] = order[at - 1];
      order[at] = i;
    }
    for (int i = 0; i < count; ++i) {
      if (distance[order[i]] < best_) visit(children[order[i]]);
    }
  }

  void visit_leaf(const MinMaxOctree::Node& node) noexcept {
    const GridAxes& axes = surface_.field->axes(surface_.level);
    std::uint32_t first[3];
    std::uint32_t last[3];
    surface_.field->octree(surface_.level).cells_of(node, first, last);
    for (std::size_t a = 0; a < 3; ++a) last[a] = std::min(last[a], axes[a].cells());
    for_each_place(first, last, [&](std::uint32_t i, std::uint32_t j, std::uint32_t k) {
      const std::uint32_t low[3] = {i, j, k};
      const std::uint32_t high[3] = {i + 1, j + 1, k + 1};
      if (distance_to(low, high) < best_) visit_cell({{i, j, k}});
    });
  }

  void visit_cell(const CellIndex& index) noexcept {
    ++cells_;
    CellPolynomial& cell = surface_.cells->other;
    if (surface_.field->approach(surface_.level, index, surface_.threshold, cell) != CellSide::near) return;
    // Within the cell the surface is looked for from its place nearest to p, towards its middle and its corners.
    const CellPolynomial here = cell;
    const Vec3 start = p_.cwiseMax(here.lower).cwiseMin(here.upper());
    // From there the field has to change by `off` before the surface is reached, no faster than its steepest slope; and
    // within a box the way on from the place nearest to p never leads back towards p.
    const double off = here.value(start) - surface_.threshold;
    const double steepest = steepest_of(here);
    const double rise = off / steepest;
    if ((p_ - start).squaredNorm() + rise * rise >= best_ * best_) return;
    const double sign = off >= 0.0 ? 1.0 : -1.0;
    bool led = false;
    for (int corner = -1; corner < 8 && !led; ++corner) {
      Vec3 end = here.lower + 0.5 * here.width;
      for (int a = 0; corner >= 0 && a < 3; ++a)
        end[a] = here.lower[a] + ((corner >> a & 1) != 0 ? here.width[a] : 0.0);
      double t = 0.0;
      if (!here.leaves_sign(start, end, 0.0, 1.0, surface_.threshold, sign, t)) continue;
      const Vec3 root = start + t * (end - start);
      if ((root - p_).norm() - here.width.norm() < best_) lead(root);
      led = true;
    }
    // What bulges within the cell none of those ways need meet.
    look_within({here, start, steepest, sign}, here.lower + 0.5 * here.width, 0.5 * here.width, finest_part);
  }

  /// A cell whose value, less the threshold, has the sign `sign` at `start`, its place nearest to p.
  struct Bulging {
    const CellPolynomial& cell;
    Vec3 start;
    double steepest;
    double sign;
  };
  static constexpr int finest_part = 3;  ///< how often a cell is halved: to an eighth

  /// Leads to what is nearer than all that is known from parts of a cell whose middle lies beyond the surface, the
  /// nearest first.
  void look_within(const Bulging& bulging, const Vec3& middle, const Vec3& half, int halvings) noexcept {
    const CellPolynomial& cell = bulging.cell;
    const Vec3 nearest = p_.cwiseMax(middle - half).cwiseMin(middle + half);
    if ((p_ - nearest).squaredNorm() >= best_ * best_) return;
    const double off = bulging.sign * (cell.value(middle) - surface_.threshold);
    if (off > bulging.steepest * half.norm()) return;
    if (off <= 0.0) {
      double t = 0.0;
      if (cell.leaves_sign(bulging.start, middle, 0.0, 1.0, surface_.threshold, bulging.sign, t)) {
        const Vec3 root = bulging.start + t * (middle - bulging.start);
        if ((root - p_).squaredNorm() < best_ * best_) lead(root);
      }
    }
    if (halvings == 0) return;
    unsigned near = 0;
    for (int a = 0; a < 3; ++a) near |= p_[a] > middle[a] ? 1U << a : 0U;
    const Vec3 quarter = 0.5 * half;
    for (const unsigned off_near : {0U, 1U, 2U, 4U, 3U, 5U, 6U, 7U}) {
      const unsigned octant = near ^ off_near;
      Vec3 there = middle;
      for (int a = 0; a < 3; ++a) there[a] += (octant >> a & 1U) != 0 ? quarter[a] : -quarter[a];
      look_within(bulging, there, quarter, halvings - 1);
    }
  }

  /// Bound on the gradient's length in a cell, above 0.
  static double steepest_of(const CellPolynomial& cell) noexcept {
    double squared = std::numeric_limits<double>::min();
    for (int a = 0; a < 3; ++a) {
      double least = 0.0;
      double greatest = 0.0;
      cell.slope_range(Vec3::Unit(a), least, greatest);
      squared += std::max(least * least, greatest * greatest);
    }
    return std::sqrt(squared);
  }

  /// Newton along the gradient onto the surface, then along it to the nearest point.
  void lead(Vec3 x) noexcept {
    constexpr int most_steps = 8;
    constexpr double close = 1e-9;
    const ScalarField& field = *surface_.field;
    const double grain = field.narrowest_cell();
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
      x = (x + move).cwiseMax(field.bounds().lower).cwiseMin(field.bounds().upper);
    }
    if (!on_surface) return;
    Place place{0, !(surface_.sigma * (p_ - x).dot(jet.gradient) >= 0.0), x};
    IsoSpot spot{x, Vec3::Zero(), Vec3::Zero()};
    surface_.descend(place, spot, {.point = p_, .may_leave = false});
    const double distance = (spot.point - p_).norm();
    if (distance >= best_) return;
    best_ = distance;
    foot_.point = foot_.at = spot.point;
    foot_.distance = distance;
    const Vec3 outward = surface_.outward(spot.point);
    foot_.normal = (p_ - spot.point).dot(outward) >= 0.0 ? outward : Vec3(-outward);
    foot_.element = surface_.element_at(spot.point);
  }

  const IsoView& surface_;
  Vec3 p_;
  double best_;
  const Place& start_;
  Foot foot_;
  std::uint32_t cells_ = 0;  ///< that it has looked into
};

}  // namespace

IsoCrossing IsoView::first_crossing(const Segment& motion, double from) const noexcept {
  IsoCrossing crossing;
  double start = from;
  double end = 1.0;
  if (motion.from == motion.to || !clip_line(field->bounds(), motion.from, motion.to - motion.from, start, end))
    return crossing;
  const GridAxes& axes = field->axes(level);
  const MinMaxOctree& octree = field->octree(level);
  CellWalk walk(axes, motion, start, end);
  // Where it starts it mostly was at the last tick.
  CellPolynomial& polynomial = cells->slot(field->identity(), level, walk.cell());
  double sign = 0.0;  // of value - threshold; 0: not known yet
  std::uint32_t leaf[3] = {no_index, no_index, no_index};
  WorkCount count;
  for (bool more = true; more;) {
    ++count.evaluations;
    const CellIndex& cell = walk.cell();
    bool same_leaf = true;
    for (std::size_t a = 0; a < 3; ++a) {
      const std::uint32_t at = cell.at[a] / octree.leaf_cells();
      same_leaf = same_leaf && at == leaf[a];
      leaf[a] = at;
    }
    if (!same_leaf &&
        !(polynomial.owner == field->identity() && polynomial.cell == cell && polynomial.level == level)) {
      const MinMaxOctree::Node node =
          octree.outermost(cell.at, [&](const MinMaxOctree::Node& n) { return field->may_cross(level, n, threshold); });
      if (!field->may_cross(level, node, threshold)) {
        const ValueRange& range = octree.range(node);
        const double there = static_cast<double>(range.lower) > threshold ? 1.0 : -1.0;
        const bool known = range.lower <= range.upper;
        if (!known || sign == 0.0 || sign == there) {
          if (known) sign = there;
          std::uint32_t first[3];
          std::uint32_t last[3];
          octree.cells_of(node, first, last);
          more = walk.leave(first, last);
          continue;
        }
      }
    }
    const CellSide side = field->approach(level, cell, threshold, polynomial);
    const double there = side == CellSide::above ? 1.0 : -1.0;
    if (side == CellSide::unknown || (side != CellSide::near && (sign == 0.0 || sign == there))) {
      sign = side == CellSide::unknown ? 0.0 : there;
      more = walk.next();
      continue;
    }
    // What passes the threshold right on a face is neither cell's; the next one shows that it has.
    if (side != CellSide::near && !field->load(level, cell, polynomial)) break;
    ++count.frames;
    if (sign == 0.0) {
      const double value = polynomial.value(motion.from + walk.entry() * (motion.to - motion.from));
      sign = value > threshold || (value == threshold && sigma > 0.0) ? 1.0 : -1.0;
    }
    double t = 1.0;
    if (polynomial.leaves_sign(motion.from, motion.to, walk.entry(), walk.exit(), threshold, sign, t)) {
      crossing.found = true;
      crossing.t = t;
      crossing.inward = sign * sigma > 0.0;
      crossing.point = motion.from + t * (motion.to - motion.from);
      crossing.cell = cell;
      const Vec3 gradient = sigma * polynomial.gradient(crossing.point).gradient;
      const double length = gradient.norm();
      if (length > 0.0) crossing.outward = gradient / length;
      break;
    }
    more = walk.next();
  }
  tell(work, count);
  return crossing;
}

SweptHit IsoView::first_touch(const Segment& motion, Sides sides) const noexcept {
  constexpr int most_crossings = 256;
  IsoCrossing crossing = first_crossing(motion);
  const double length = (motion.to - motion.from).norm();
  for (int i = 0; sides == Sides::front && crossing.found && !crossing.inward && i < most_crossings; ++i) {
    crossing = first_crossing(motion, crossing.t + 1e-9 * field->narrowest_cell() / length);
  }
  if (!crossing.found || (sides == Sides::front && !crossing.inward)) return {};
  return point_touch(crossing.t, crossing.inward ? 1.0 : -1.0, crossing.point, crossing.outward,
                     element_of(crossing.cell), crossing.point);
}

Foot IsoView::nearest(const Vec3& p, double bound, const Place& start) const noexcept {
  return NearestSearch(*this, p, bound, start).run();
}

Foot IsoView::refined(const Foot& foot, const Vec3& p) const noexcept {
  constexpr int most_steps = 4;
  constexpr double farthest = 0.05;  // of a cell, that a walk leaves it off
  constexpr double least = 1e-12;    // of a cell, that is worth a step
  constexpr double least_curvature = 1e-4;
  const CellPolynomial* cell = over(foot.point);
  if (cell == nullptr) return foot;
  const double width = cell->width.minCoeff();
  Vec3 x = foot.point;
  Vec3 normal = Vec3::Zero();
  for (int step = 0; step < most_steps; ++step) {
    const FieldJet jet = cell->jet(x);
    const double slope = jet.gradient.norm();
    if (!(slope > 0.0)) return foot;
    normal = jet.gradient / slope;
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
    if (!(uu + vv > 0.0) || !(determinant > least_curvature * (uu + vv))) return foot;
    const double along_u = (vv * u.dot(pull) - uv * v.dot(pull)) / determinant;
    const double along_v = (uu * v.dot(pull) - uv * u.dot(pull)) / determinant;
    const Vec3 move = along_u * u + along_v * v + rise * normal;
    x += move;
    if (!cell->has_well_inside(x) || !((x - foot.point).norm() <= farthest * width)) return foot;
    if (move.norm() > least * width) continue;
    Foot there = foot;
    there.point = there.at = x;
    there.distance = (p - x).norm();
    there.normal = std::copysign(1.0, foot.normal.dot(normal)) * normal;
    return there;
  }
  return foot;
}

Vec3 IsoView::outward(const Vec3& p) const noexcept {
  FieldJet jet;
  if (!sample(p, jet)) return Vec3::Zero();
  const double length = jet.gradient.norm();
  return length > 0.0 ? Vec3((sigma / length) * jet.gradient) : Vec3::Zero();
}

Mat3 IsoView::bend_at(const Vec3& point) const noexcept {
  const CellPolynomial* cell = over(point);
  if (cell == nullptr) return Mat3::Zero();
  const FieldJet jet = cell->jet(point);
  const double length = jet.gradient.norm();
  if (!(length > 0.0)) return Mat3::Zero();
  const Vec3 normal = jet.gradient / length;
  const Mat3 along = Mat3::Identity() - normal * normal.transpose();
  return (sigma / length) * (along * jet.hessian * along);
}

bool IsoView::launch(const Place& place, const IsoSpot& spot, Vec3& from) const noexcept {
  // At the rim it starts within the volume: what comes in from outside has no side.
  const Box bounds = field->bounds();
  from = (spot.point + skin() * spot.away).cwiseMax(bounds.lower).cwiseMin(bounds.upper);
  // In a corner narrower than the skin there is no place to fly from.
  FieldJet jet;
  return !sample(from, jet) || place.side() * sigma * (jet.value - threshold) >= 0.0;
}

}  // namespace asperity
