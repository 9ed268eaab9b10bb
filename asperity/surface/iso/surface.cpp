#include "asperity/surface/iso/surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asperity/field/volume/places.h"

namespace asperity {

namespace {

/// Leaves of a level's octree that the field may pass the threshold in.
std::vector<MinMaxOctree::Node> crossed_leaves(const ScalarField& field, int level, double threshold) {
  const MinMaxOctree& octree = field.octree(level);
  std::vector<MinMaxOctree::Node> stack{octree.root()};
  std::vector<MinMaxOctree::Node> leaves;
  while (!stack.empty()) {
    const MinMaxOctree::Node node = stack.back();
    stack.pop_back();
    if (!field.may_cross(level, node, threshold)) continue;
    if (node.level == 0) {
      leaves.push_back(node);
      continue;
    }
    MinMaxOctree::Node children[8];
    const int count = octree.children(node, children);
    stack.insert(stack.end(), children, children + count);
  }
  return leaves;
}

/// Cells [first, last) of a leaf, and their box.
Box leaf_cells(const ScalarField& field, int level, const MinMaxOctree::Node& leaf, std::uint32_t first[3],
               std::uint32_t last[3]) {
  Box box;
  field.octree(level).cells_of(leaf, first, last);
  for (std::size_t a = 0; a < 3; ++a) {
    const GridAxis& axis = field.axes(level)[a];
    last[a] = std::min(last[a], axis.cells());
    box.lower[static_cast<int>(a)] = axis.node(first[a]);
    box.upper[static_cast<int>(a)] = axis.node(last[a]);
  }
  return box;
}

Status check_threshold(const ScalarField& field, double threshold) {
  if (threshold > field.lowest() && threshold < field.highest()) return success();
  return bad_value(
      fmt::format("is {:g}, and the field ranges from {:g} to {:g}", threshold, field.lowest(), field.highest()),
      "threshold", "a value between them");
}

}  // namespace

Result<IsoSurface> IsoSurface::build(std::shared_ptr<const ScalarField> field, double threshold, Inside inside,
                                     double threshold_speed) {
  if (field == nullptr) return bad_value("holds no field", "volume", "a scalar field");
  ASPERITY_CHECK(check_threshold(*field, threshold));
  if (!(threshold_speed > 0.0 && std::isfinite(threshold_speed))) {
    return bad_value(fmt::format("is {:g}", threshold_speed), "threshold_speed", "a speed above 0");
  }
  IsoSurface surface;
  surface.field_ = std::move(field);
  surface.threshold_ = threshold;
  surface.inside_ = inside;
  surface.threshold_speed_ = threshold_speed;
  surface.measure();
  if (surface.surface_bounds_.empty()) {
    return bad_value(fmt::format("is {:g}: nowhere in the volume does the field pass it", threshold), "threshold",
                     "a value that the field passes");
  }
  return surface;
}

Result<IsoSurface> IsoSurface::with_threshold(double threshold) const {
  return build(field_, threshold, inside_, threshold_speed_);
}

Result<IsoSurface> IsoSurface::moved_to(double threshold) const {
  ASPERITY_CHECK(check_threshold(*field_, threshold));
  IsoSurface moved = *this;
  moved.threshold_ = threshold;
  moved.schedule_.clear();
  moved.surface_bounds_ = field_->bounds();
  return moved;
}

Result<IsoSurface> IsoSurface::with_schedule(std::vector<ThresholdStep> steps) const {
  Seconds last{0.0};
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const std::string place = fmt::format("schedule[{}]", i);
    if (!(steps[i].time > last && std::isfinite(steps[i].time.count()))) {
      return bad_value(fmt::format("is {:g}, after {:g}", steps[i].time.count(), last.count()), place + ".time",
                       "a time after that of the step before (s, ms)");
    }
    if (Status good = check_threshold(*field_, steps[i].threshold); !good) return std::move(good).error().at(place);
    last = steps[i].time;
  }
  IsoSurface scheduled = *this;
  scheduled.schedule_ = std::move(steps);
  return scheduled;
}

double IsoSurface::scheduled(Seconds time) const noexcept {
  const auto next = std::upper_bound(schedule_.begin(), schedule_.end(), time,
                                     [](Seconds at, const ThresholdStep& step) { return at < step.time; });
  if (next == schedule_.end()) return schedule_.back().threshold;
  const ThresholdStep last = next == schedule_.begin() ? ThresholdStep{Seconds(0.0), threshold_} : *(next - 1);
  const double share = std::clamp((time - last.time) / (next->time - last.time), 0.0, 1.0);
  return last.threshold + share * (next->threshold - last.threshold);
}

/// Bounds and typical slope, from the cells that the surface crosses: all of a small volume's, a sample of a large
/// one's. A volume in bricks is measured on its coarsest level, the one that is always here.
void IsoSurface::measure() {
  constexpr std::size_t most_leaves = 4096;
  const bool bricked = field_->bricks() != nullptr;
  std::uint32_t first[3];
  std::uint32_t last[3];
  const int level = field_->levels() - 1;
  const std::vector<MinMaxOctree::Node> leaves = crossed_leaves(*field_, level, threshold_);
  std::vector<double> slopes;
  CellPolynomial cell;
  const std::size_t stride = std::max<std::size_t>(1, leaves.size() / most_leaves);
  for (std::size_t n = 0; n < leaves.size(); ++n) {
    const Box box = leaf_cells(*field_, level, leaves[n], first, last);
    const bool inside = !surface_bounds_.empty() && (box.lower.array() >= surface_bounds_.lower.array()).all() &&
                        (box.upper.array() <= surface_bounds_.upper.array()).all();
    if (inside && n % stride != 0) continue;
    field_->enter();
    for_each_place(first, last, [&](std::uint32_t i, std::uint32_t j, std::uint32_t k) {
      if (field_->approach(level, {{i, j, k}}, threshold_, cell) != CellSide::near) return;
      surface_bounds_.include(Box{cell.lower, cell.upper()});
      if (n % stride == 0) slopes.push_back(cell.gradient(cell.lower + 0.5 * cell.width).gradient.norm());
    });
    field_->leave();
  }
  if (slopes.empty() && bricked) {
    // Sheets that the coarsest level has lost: the finest level's ranges bound them, and the volume's own range over
    // its shortest side stands in for the slope.
    for (const MinMaxOctree::Node& leaf : crossed_leaves(*field_, 0, threshold_))
      surface_bounds_.include(leaf_cells(*field_, 0, leaf, first, last));
    slopes.push_back((field_->highest() - field_->lowest()) / field_->bounds().extent().minCoeff());
  }
  if (slopes.empty()) return;
  const auto middle = slopes.begin() + static_cast<std::ptrdiff_t>(slopes.size() / 2);
  std::nth_element(slopes.begin(), middle, slopes.end());
  typical_slope_ = *middle;
}

FieldSample IsoView::eval(const Vec3& p) const noexcept {
  FieldSample out;
  FieldJet jet;
  if (!sample(p, jet)) return out;
  const double length = jet.gradient.norm();
  if (!(length > 0.0)) return out;
  out.value = sigma * (jet.value - threshold) / length;
  out.gradient = (sigma / length) * jet.gradient;
  out.element = element_at(p);
  return out;
}

}  // namespace asperity
