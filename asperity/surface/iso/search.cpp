// Where motions meet an isosurface, and what it is like at a place.

#include <algorithm>
#include <cmath>

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
