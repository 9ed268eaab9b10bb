
#include <algorithm>
#include <cmath>

#include "asperity/core/fixed_vector.h"
#include "asperity/surface/iso/surface.h"
#include "asperity/surface/walk.h"

namespace asperity {

namespace {

// Of the cell's narrowest width: a pull along the surface that is not worth following.
constexpr double rest_of_cell = 2e-5;
// From this near, of the same, one more step of Newton's method ends on the surface.
constexpr double nearly_on_surface = 1e-5;
// How near a face a point counts as on it, of the cell's width: nearer, a step to the face would be lost in rounding.
constexpr double on_face = 1e-8;

// A way that crosses a face by no more than this share of its length runs along the face: the rest is rounding.
constexpr double along_face = 1e-9;

/// The surface's own frame at a point, seen from one cell, and where the goal pulls the point in it.
struct Pull {
  bool known = false;
  bool at_rest = false;
  bool outside = false;  ///< the goal lies outside the tangent plane
  CellIndex cell;
  Vec3 normal = Vec3::Zero();  ///< unit, on the side touched; within the face, on a face
  Vec3 step = Vec3::Zero();    ///< along the tangent plane
  double drop = 0.0;           ///< how far the surface falls below the end of the step (m)
  double rate = 0.0;           ///< length of the pull
  double slope = 0.0;          ///< of the field along the normal
};

class Leader {
 public:
  Leader(const IsoView& surface, const Goal& goal, double side, IsoSpot& spot) noexcept
      : surface_(surface),
        axes_(surface.field->axes(surface.level)),
        goal_(goal),
        sign_(side * surface.sigma),
        x_(spot.point),
        away_(spot.away) {
    const double least = 0.5 * on_face * surface.field->narrowest_cell();
    least_way_ = least * least;
  }

  DescentEnd run() noexcept {
    const std::uint32_t most = std::min(static_cast<std::uint32_t>(std::min(budget, goal_.moves)), goal_.work);
    while (moves() < most) {
      if (const Step step = move(); step != Step::moved)
        return step == Step::rest ? DescentEnd::rest : step == Step::left ? DescentEnd::left : DescentEnd::rim;
    }
    // The last move has led on from where the normal was asked for.
    if (moves() > 0) look();
    return DescentEnd::limited;
  }
  /// Evaluations that it took.
  [[nodiscard]] std::uint32_t moves() const noexcept { return static_cast<std::uint32_t>(moves_); }
  /// On the side touched; zero where nothing was found out.
  [[nodiscard]] const Vec3& normal() const noexcept { return normal_; }

 private:
  enum class Step { moved, rest, left, rim };
  static constexpr int budget = 400;  // evaluations
  // So many times as far as the last step may the next one go, where that was cut short.
  static constexpr double wider = 3.0;
  // A pull that falls by less in a step is slow to.
  static constexpr double slow = 0.5;
  // Cosine of what turns so little that it goes the same way.
  static constexpr double same_way = 0.99;

  const CellPolynomial* load(const CellIndex& cell) noexcept {
    CellPolynomial& slot = surface_.cells->slot(surface_.field->identity(), surface_.level, cell);
    return surface_.field->load(surface_.level, cell, slot) ? &slot : nullptr;
  }

  /// The cells that x lies in or on the border of: `first` … `last` along each axis.
  void find_cells() noexcept {
    over_ = surface_.cells->around(surface_.field->identity(), surface_.level, x_);
    if (over_ != nullptr) {
      std::copy(over_->cell.at, over_->cell.at + 3, first_);
      std::copy(over_->cell.at, over_->cell.at + 3, last_);
      std::fill(on_face_, on_face_ + 3, false);
      return;
    }
    for (std::size_t a = 0; a < 3; ++a) {
      const GridAxis::Place place = axes_[a].locate(x_[static_cast<int>(a)]);
      first_[a] = last_[a] = place.cell;
      on_face_[a] = place.fraction <= on_face || place.fraction >= 1.0 - on_face;
      if (place.fraction <= on_face) {
        node_[a] = place.cell;
        if (place.cell > 0) first_[a] = place.cell - 1;
      } else if (on_face_[a]) {
        node_[a] = place.cell + 1;
        if (place.cell + 1 < axes_[a].cells()) last_[a] = place.cell + 1;
      }
    }
  }

  /// Of those that find_cells has found.
  template <class Visit>
  void for_each_cell(const Visit& visit) const noexcept {
    for (std::uint32_t k = first_[2]; k <= last_[2]; ++k) {
      for (std::uint32_t j = first_[1]; j <= last_[1]; ++j) {
        for (std::uint32_t i = first_[0]; i <= last_[0]; ++i) visit(CellIndex{{i, j, k}});
      }
    }
  }

  /// The normal where x is.
  void look() noexcept {
    find_cells();
    Vec3 sum = Vec3::Zero();
    for_each_cell([&](const CellIndex& index) {
      const CellPolynomial* cell = load(index);
      if (cell == nullptr) return;
      ++moves_;
      const Vec3 gradient = sign_ * cell->gradient(x_).gradient;
      const double length = gradient.norm();
      if (!(length > 0.0)) return;
      if (sum.isZero()) normal_ = gradient / length;
      sum += gradient / length;
    });
    away_ = sum.squaredNorm() > 1e-12 ? Vec3(sum.normalized()) : normal_;
  }

  /// Normal and pull along the surface from the gradient of phi. False where there is no direction.
  bool aim(const CellPolynomial& cell, Vec3 gradient, int face, Pull& pull, Vec3& s, double& depth,
           double& length) const noexcept {
    length = gradient.norm();
    if (face >= 0) {
      const double whole = length;
      gradient[face] = 0.0;
      length = gradient.norm();
      if (!(length > 1e-6 * whole)) return false;
    }
    if (!(length > 0.0)) return false;
    pull.known = true;
    pull.normal = (1.0 / length) * gradient;
    pull.slope = length;
    pull.outside = (goal_.point - x_).dot(pull.normal) > 0.0;
    const Vec3 goal = goal_.friction > 0.0 ? friction_goal(x_, pull.normal, goal_.point, goal_.friction) : goal_.point;
    Vec3 v = goal - x_;
    if (face >= 0) v[face] = 0.0;
    depth = v.dot(pull.normal);
    s = v - depth * pull.normal;
    pull.rate = s.norm();
    pull.at_rest = pull.rate <= rest_of_cell * cell.width.minCoeff();
    return true;
  }

  /// Pull of the goal in one cell; within the face across `face`, where that is an axis.
  Pull pull_in(const CellIndex& index, int face) noexcept {
    Pull pull;
    pull.cell = index;
    const CellPolynomial* cell = over_ != nullptr ? over_ : load(index);
    if (cell == nullptr) return pull;
    // The projection that led here knows the gradient; within a cell the second derivatives mostly change so little
    // that those of the last move serve once more.
    const bool arrived = face < 0 && arrived_ && arrived_cell_ == index;
    const auto ask = [&] {
      ++moves_;
      cell->jet(x_, jet_);
      bend_cell_ = index;
    };
    if (!arrived) ask();
    Vec3 s;
    double depth = 0.0;
    double length = 0.0;
    const Vec3& gradient = arrived ? arrived_gradient_ : jet_.gradient;
    if (!aim(*cell, sign_ * gradient, face, pull, s, depth, length) || pull.at_rest) return pull;
    // On a face the last step may only have ended too soon.
    const bool within = !on_face_[0] && !on_face_[1] && !on_face_[2];
    if (arrived && within && pull.rate > slow * last_rate_) ask();
    // Newton's step of the distance along the surface; where it is no minimum that it leads to, down the slope.
    const double scale = sign_ / length;
    if (face >= 0) {
      const Vec3 along = s / pull.rate;
      const double bend = scale * along.dot(jet_.hessian * along);
      const double a = 1.0 + depth * bend;
      const double go = a > 0.05 ? pull.rate / a : pull.rate;
      pull.step = go * along;
      pull.drop = 0.5 * go * go * bend;
    } else {
      const TangentStep to = tangent_step(pull.normal, s, pull.rate, depth, jet_.hessian, scale, goal_.friction);
      pull.step = to.step;
      pull.drop = to.drop;
    }
    return pull;
  }

  /// Whether a step from x leads into the cell, over the faces that x lies on other than `face`.
  bool leads_into(const CellIndex& cell, const Vec3& step, int face) const noexcept {
    const double noise = along_face * step.norm();
    for (std::size_t a = 0; a < 3; ++a) {
      if (!on_face_[a] || static_cast<int>(a) == face) continue;
      const double d = step[static_cast<int>(a)];
      if (cell.at[a] < node_[a] ? d > noise : d < -noise) return false;
    }
    return true;
  }

  Step move() noexcept {
    find_cells();
    if (!on_face_[0] && !on_face_[1] && !on_face_[2]) {
      const Pull pull = pull_in({{first_[0], first_[1], first_[2]}}, -1);
      if (!pull.known) return Step::rim;
      normal_ = away_ = pull.normal;
      if (goal_.may_leave && pull.outside) return Step::left;
      return !pull.at_rest && follow(pull, -1) ? Step::moved : Step::rest;
    }
    FixedVector<Pull, 8> leads;
    bool all_outside = true;
    bool any = false;
    bool rests = false;
    Vec3 sum = Vec3::Zero();
    for_each_cell([&](const CellIndex& index) {
      const Pull pull = pull_in(index, -1);
      if (!pull.known) return;
      if (!any) normal_ = pull.normal;
      any = true;
      sum += pull.normal;
      all_outside = all_outside && pull.outside;
      if (pull.at_rest) {
        if (!rests) normal_ = pull.normal;
        rests = true;
      } else if (leads_into(pull.cell, pull.step, -1)) {
        leads.push_back(pull);
      }
    });
    if (!any) return Step::rim;
    away_ = sum.squaredNorm() > 1e-12 ? Vec3(sum.normalized()) : normal_;
    if (goal_.may_leave && all_outside) return Step::left;
    while (!leads.empty()) {
      std::size_t best = 0;
      for (std::size_t i = 1; i < leads.size(); ++i) best = leads[i].rate > leads[best].rate ? i : best;
      normal_ = leads[best].normal;
      if (follow(leads[best], -1)) return Step::moved;
      leads.swap_remove(best);
      rests = rests || leads.empty();
    }
    if (rests) return Step::rest;
    // No cell leads anywhere but out of itself: a crease, along which it may go, or the rim.
    if (goal_.may_leave && at_rim()) return Step::rim;
    for (int face = 0; face < 3; ++face) {
      if (!on_face_[face]) continue;
      for (const Pull& pull : {pull_in(cell_towards(face, 1.0), face), pull_in(cell_towards(face, -1.0), face)}) {
        if (!pull.known || pull.at_rest || !leads_into(pull.cell, pull.step, face)) continue;
        if (follow(pull, face)) return Step::moved;
      }
    }
    return Step::rest;
  }

  /// The cell on the face across `face` that the goal pulls towards, or away from (direction -1).
  CellIndex cell_towards(int face, double direction) const noexcept {
    CellIndex cell;
    for (int a = 0; a < 3; ++a) {
      const bool up = direction * (goal_.point[a] - x_[a]) > 0.0;
      cell.at[a] = a != face && up ? last_[static_cast<std::size_t>(a)] : first_[static_cast<std::size_t>(a)];
    }
    return cell;
  }

  /// On the volume's border, or that of what is known, with the goal beyond.
  bool at_rim() noexcept {
    const double noise = along_face * (goal_.point - x_).norm();
    for (std::size_t a = 0; a < 3; ++a) {
      if (!on_face_[a]) continue;
      const double d = goal_.point[static_cast<int>(a)] - x_[static_cast<int>(a)];
      if (std::abs(d) <= noise) continue;
      if (node_[a] == (d > 0.0 ? axes_[a].cells() : 0U)) return true;
      if (first_[a] == last_[a]) continue;
      CellIndex beyond{{first_[0], first_[1], first_[2]}};
      beyond.at[a] = d > 0.0 ? last_[a] : first_[a];
      if (load(beyond) == nullptr) return true;
    }
    return false;
  }

  /// Follows the pull to its end, or to the border of its cell. False when no part of it comes nearer.
  bool follow(const Pull& pull, int face) noexcept {
    constexpr int most_halvings = 12;
    constexpr int most_hardly = 3;
    const CellPolynomial* cell = over_ != nullptr ? over_ : load(pull.cell);
    const double before = (goal_.point - x_).squaredNorm();
    double share = pull.rate > slow * last_rate_ ? further(pull) : 1.0;
    // Where the last step had to be cut short, this one will have to be too.
    if (room_ < infinity) share = std::min(share, room_ / pull.step.norm());
    for (int attempt = 0; attempt < most_halvings; ++attempt, share = std::min(1.0, 0.5 * share)) {
      Vec3 y = x_ + share * pull.step - (share * share * pull.drop) * pull.normal;
      if (!arrive(*cell, face, y)) continue;
      if (!((goal_.point - y).squaredNorm() < before)) continue;
      // Onto a border that it is all but on, it may; to and fro between borders, it comes nearer by rounding alone.
      const bool hardly = (y - x_).squaredNorm() <= least_way_;
      if (hardly && hardly_ == most_hardly) continue;
      if (!goal_.any_sheet && !same_sheet(*cell, pull, y)) {
        cell = load(pull.cell);
        continue;
      }
      hardly_ = hardly ? hardly_ + 1 : 0;
      last_rate_ = pull.rate;
      last_step_ = pull.step;
      last_share_ = share;
      last_x_ = x_;
      room_ = share < 1.0 ? wider * share * pull.step.norm() : infinity;
      x_ = y;
      return true;
    }
    arrived_ = false;
    room_ = last_rate_ = infinity;
    return false;
  }

  /// How many steps of a pull to go at once: where each leaves a like share of the pull, as many as all of them are;
  /// where each leaves more, more and more.
  [[nodiscard, gnu::noinline]] double further(const Pull& pull) const noexcept {
    constexpr double most = 50.0;
    constexpr double faster = 4.0;
    // Only where that was a whole step, not cut short nor ended by a border.
    const Vec3 way = x_ - last_x_;
    const double last = last_step_.squaredNorm();
    if (last_share_ < 1.0 || way.dot(last_step_) < same_way * last_share_ * last) return 1.0;
    if (pull.step.dot(last_step_) < same_way * std::sqrt(pull.step.squaredNorm() * last)) return 1.0;
    const double left = pull.rate / last_rate_;
    return std::min(most, left < 1.0 ? 1.0 / (1.0 - left) : faster * last_share_);
  }

  /// Cuts the way from x to y at the cell's border and brings its end onto the surface there.
  bool arrive(const CellPolynomial& cell, int face, Vec3& y) noexcept {
    bool fixed[3] = {face == 0, face == 1, face == 2};
    if (face < 0 && cell.has_well_inside(y)) {
      // Mostly it stays within.
      const Vec3 start = y;
      const int moves = moves_;
      if (!project(cell, fixed, y)) return false;
      if (cell.has_well_inside(y)) return true;
      y = start;
      moves_ = moves;
    }
    const Vec3 upper = upper_of(cell);
    for (int a = 0; a < 3; ++a) {
      if (fixed[a]) y[a] = x_[a];
    }
    for (int cut = 0; cut < 3; ++cut) {
      double t = 1.0;
      int axis = -1;
      for (int a = 0; a < 3; ++a) {
        if (fixed[a]) continue;
        if (y[a] >= cell.lower[a] && y[a] <= upper[a]) continue;
        const double limit = y[a] < cell.lower[a] ? cell.lower[a] : upper[a];
        if (std::abs(y[a] - limit) <= 2.0 * on_face * cell.width[a]) {
          // On the face already, and led along it: that is no border to stop at.
          y[a] = limit;
          continue;
        }
        const double way = y[a] - x_[a];
        const double at = way != 0.0 ? std::clamp((limit - x_[a]) / way, 0.0, 1.0) : 0.0;
        if (axis < 0 || at < t) {
          t = at;
          axis = a;
        }
      }
      if (axis >= 0) {
        const double limit = y[axis] < cell.lower[axis] ? cell.lower[axis] : upper[axis];
        y = x_ + t * (y - x_);
        y[axis] = limit;
        fixed[axis] = true;
      }
      if (!project(cell, fixed, y)) return false;
      bool inside = true;
      for (int a = 0; a < 3; ++a) {
        const double slack = 2.0 * on_face * cell.width[a];
        inside = inside && y[a] >= cell.lower[a] - slack && y[a] <= upper[a] + slack;
      }
      if (!inside) continue;
      y = y.cwiseMax(cell.lower).cwiseMin(upper);
      return true;
    }
    return false;
  }

  /// The nodes themselves, so that a point on a face has the node's own coordinate.
  Vec3 upper_of(const CellPolynomial& cell) const noexcept {
    return {axes_[0].node(cell.cell.at[0] + 1), axes_[1].node(cell.cell.at[1] + 1), axes_[2].node(cell.cell.at[2] + 1)};
  }

  bool project(const CellPolynomial& cell, const bool fixed[3], Vec3& y) noexcept {
    constexpr int most_rounds = 8;
    const double close = nearly_on_surface * cell.width.minCoeff();
    arrived_ = false;
    for (int round = 0; round < most_rounds; ++round) {
      ++moves_;
      const FieldJet jet = cell.gradient(y);
      Vec3 gradient = jet.gradient;
      for (int a = 0; a < 3; ++a) {
        if (fixed[a]) gradient[a] = 0.0;
      }
      const double squared = gradient.squaredNorm();
      if (!(squared > 1e-12 * jet.gradient.squaredNorm())) return false;
      const double off = jet.value - surface_.threshold;
      const Vec3 step = (off / squared) * gradient;
      const double length = step.squaredNorm();
      if (length > cell.width.squaredNorm()) return false;
      y -= step;
      // Newton's next error is about the square of this one.
      if (length > close * close) continue;
      arrived_ = bend_cell_ == cell.cell;
      arrived_cell_ = cell.cell;
      arrived_gradient_ = jet.gradient;
      return true;
    }
    return false;
  }

  /// Whether y is reached from x without passing the surface. In a cell all of whose gradients look the same way as the
  /// normal the surface is one sheet over the tangent plane; elsewhere a way through free space is searched.
  bool same_sheet(const CellPolynomial& cell, const Pull& pull, const Vec3& y) noexcept {
    double least = 0.0;
    double greatest = 0.0;
    cell.slope_range(sign_ * pull.normal, least, greatest);
    if (least > 0.0) return true;
    // Or in the ball that they lie in.
    if (pull.slope > cell.most_bend() * (y - x_).norm()) return true;
    const Vec3 gradient = sign_ * cell.gradient(y).gradient;
    const double length = gradient.norm();
    if (!(length > 0.0)) return false;
    const double skin = surface_.skin();
    const Vec3 from = x_ + skin * pull.normal;
    const Vec3 to = y + skin * (gradient / length);
    CellCache scratch;
    IsoView view = surface_;
    view.cells = &scratch;
    const auto outside = [&](const Vec3& p) {
      FieldJet jet;
      return view.sample(p, jet) && sign_ * (jet.value - surface_.threshold) > 0.0;
    };
    if (!outside(from) || !outside(to)) return false;
    if (!view.first_crossing({from, to}).found) return true;
    const double way = (y - x_).norm();
    for (const double lift : {0.1, 0.5, 1.0}) {
      const Vec3 apex = 0.5 * (from + to) + lift * way * pull.normal;
      if (!view.first_crossing({from, apex}).found && !view.first_crossing({apex, to}).found) return true;
    }
    return false;
  }

  const IsoView& surface_;
  const GridAxes& axes_;
  const Goal& goal_;
  double sign_;
  Vec3& x_;
  Vec3& away_;
  Vec3 normal_ = Vec3::Zero();
  int moves_ = 0;
  const CellPolynomial* over_ = nullptr;  ///< the cell that x lies well inside; none: that is not known
  std::uint32_t first_[3] = {};
  std::uint32_t last_[3] = {};
  std::uint32_t node_[3] = {};  ///< along the axes on whose faces x lies
  bool on_face_[3] = {};
  FieldJet jet_;  ///< the last one, in bend_cell_
  CellIndex bend_cell_;
  double last_rate_ = infinity;    ///< of the pull that was followed last
  Vec3 last_step_ = Vec3::Zero();  ///< of that pull
  double last_share_ = 1.0;        ///< of it, that was gone
  Vec3 last_x_ = Vec3::Zero();     ///< from where
  double least_way_ = 0.0;         ///< squared: a move that is hardly one
  int hardly_ = 0;                 ///< of those, one after the other
  double room_ = infinity;         ///< how far the next step may go (m)
  bool arrived_ = false;           ///< x was found by `project`, in arrived_cell_ = bend_cell_
  CellIndex arrived_cell_;
  Vec3 arrived_gradient_ = Vec3::Zero();
};

}  // namespace

DescentEnd IsoView::descend(Place& place, IsoSpot& spot, const Goal& goal) const noexcept {
  Leader leader(*this, goal, place.side(), spot);
  const DescentEnd end = leader.run();
  tell(work, {leader.moves(), 0, 0});
  if (!leader.normal().isZero()) spot.front = place.side() * leader.normal();
  place.at = spot.point;
  return end;
}

}  // namespace asperity
