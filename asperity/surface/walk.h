#pragma once
// Walking along a surface to the point of it nearest to a goal: Newton's method on the squared distance.

#include <algorithm>
#include <cmath>

#include "asperity/surface/view.h"

namespace asperity {

/// A step along a surface, in the two coordinates of its chart.
struct WalkStep {
  double u = 0.0;
  double v = 0.0;
  double length = 0.0;  ///< m
};

/// The squared distance to a goal around a place, by the coordinates of a chart: half its slope, the metric, half its
/// second derivatives.
struct WalkForms {
  double g_u = 0.0;
  double g_v = 0.0;
  double uu = 0.0;
  double uv = 0.0;
  double vv = 0.0;
  double h_uu = 0.0;
  double h_uv = 0.0;
  double h_vv = 0.0;
};

/// Newton's step where the squared distance is convex, Gauss and Newton's where it is not. [servo]
inline WalkStep newton_step(const WalkForms& f) noexcept {
  const auto solved = [&](double uu, double uv, double vv, double det) {
    const double u = -(vv * f.g_u - uv * f.g_v) / det;
    const double v = -(uu * f.g_v - uv * f.g_u) / det;
    return WalkStep{u, v, std::sqrt(std::max(0.0, u * (u * f.uu + 2.0 * v * f.uv) + v * v * f.vv))};
  };
  const double det = f.uu * f.vv - f.uv * f.uv;
  const double newton_det = f.h_uu * f.h_vv - f.h_uv * f.h_uv;
  // Not convex, or nearly flat: its step would be no guide.
  constexpr double least_share = 0.02;
  if (f.h_uu > 0.0 && newton_det > least_share * det) return solved(f.h_uu, f.h_uv, f.h_vv, newton_det);
  if (det > 0.0) return solved(f.uu, f.uv, f.vv, det);
  return {};
}

/// The same in the tangent plane of a surface that a field gives: from a place where the goal lies `pull` (m) along it
/// and `depth` (m) above it, `bend` the field's second derivatives over its slope. The pull itself where the distance
/// is not convex. [servo]
inline Vec3 tangent_step(const Vec3& normal, const Vec3& pull, double depth, const Mat3& bend) noexcept {
  const double rate = pull.norm();
  const Vec3 along = pull / rate;
  const Vec3 across = normal.cross(along);
  const double a = 1.0 + depth * along.dot(bend * along);
  const double b = depth * along.dot(bend * across);
  const double c = 1.0 + depth * across.dot(bend * across);
  const double determinant = a * c - b * b;
  if (a > 0.05 && determinant > 0.05 * c && c > 0.0) return (rate / determinant) * (c * along - b * across);
  return pull;
}

/// Evaluations that one walk may use.
inline constexpr int walk_budget = 96;

/// What a walk does at a border of its chart.
enum class Turn { go, rest, rim };

/// Leads a place along a surface, from chart to chart: the face of a relief, the parameters of a formula, the tangent
/// plane of a field. Between samples no farther apart than the surface's stride the distance always falls, so that no
/// ridge is crossed that the distance would have to rise over. With friction the goal is moved back by what the cone
/// holds, anew at every step.
///
/// A `Chart` is at one place and answers: spot(), the surface there; forms(goal) around it;
/// slope(goal, forms), where that is cheap, which brings their slope alone up to date; rest_length(first), below
/// which a step is not made; blocked(step), whether it leads over a border that the place is on, and turn(step, goal,
/// may_leave, moves), which then finds another one; reach(step, border), how much of a step lies within the chart, and
/// what it ends at (-1: nothing); start(), the place; moved(start, step, share, border), the place there;
/// evaluate(place, spot); take(place, spot), which goes there; stride(). Where flanks may meet (has_flanks):
/// direction(step) in space, and towards(way), the step that leads along it. [servo]
template <class Chart>
class Walk {
 public:
  Walk(Chart& chart, const Goal& goal, double side) noexcept : chart_(chart), asked_(goal), side_(side) {}

  DescentEnd run() noexcept {
    while (moves_ < walk_budget) {
      if (asked_.may_leave && leaves()) return DescentEnd::left;
      aim();
      if (settled()) return DescentEnd::rest;
      forms_ = chart_.forms(goal_);
      formed_ = true;
      WalkStep step = newton_step(forms_);
      if (step.length <= chart_.rest_length(moves_ == 0)) return DescentEnd::rest;
      if (chart_.blocked(step)) {
        formed_ = false;
        const Turn turn = chart_.turn(step, goal_, asked_.may_leave, moves_);
        if (turn == Turn::rim) return DescentEnd::rim;
        if (turn == Turn::rest) return DescentEnd::rest;
        if (asked_.may_leave && leaves()) return DescentEnd::left;
      }
      if (!advance(step) && !along_fold()) return DescentEnd::rest;
    }
    return DescentEnd::limited;
  }

 private:
  using Spot = typename Chart::Spot;

  [[nodiscard]] bool leaves() const noexcept {
    return side_ * chart_.spot().front.dot(asked_.point - chart_.spot().point) > 0.0;
  }

  /// Whether the slope here is so small that a step by the last place's forms would be far below one worth making: what
  /// a walk mostly ends with.
  [[nodiscard]] bool settled() noexcept {
    if constexpr (requires { chart_.slope(goal_, forms_); }) {
      constexpr double far_below = 0.25;
      // While the goal still moves there is a step to make.
      if (!formed_ || moves_ == 0 || (asked_.friction > 0.0 && aims_ <= most_aims)) return false;
      chart_.slope(goal_, forms_);
      return newton_step(forms_).length <= far_below * chart_.rest_length(false);
    } else {
      return false;
    }
  }

  /// With friction the goal depends on the point: after two steps what is left of that is far below a thousandth of the
  /// force, and a goal that holds still is reached at Newton's pace.
  void aim() noexcept {
    if (asked_.friction <= 0.0) {
      goal_ = asked_.point;
    } else if (aims_++ < most_aims) {
      goal_ = friction_goal(chart_.spot().point, side_ * chart_.spot().front, asked_.point, asked_.friction);
    }
  }

  /// Goes along the step as far as the distance falls, at most to the border. False when it cannot.
  bool advance(const WalkStep& step) noexcept {
    int border = -1;
    const double far = chart_.reach(step, border);
    const auto start = chart_.start();
    double distance = (chart_.spot().point - goal_).squaredNorm();
    if (chart_.has_flanks()) rejected_ = own_ = chart_.spot().front;
    const auto attempt = [&](double share, int end) {
      const auto to = chart_.moved(start, step, share, end);
      ++moves_;
      Spot there;
      if (!chart_.evaluate(to, there)) return false;
      const double now = (there.point - goal_).squaredNorm();
      if (!(now < distance)) {
        remember(there);
        return false;
      }
      distance = now;
      chart_.take(to, there);
      return true;
    };
    const double strides = far * step.length / chart_.stride();
    // Mostly one; rounding up costs something.
    const int count = strides > 1.0 ? static_cast<int>(std::min(std::ceil(strides), 1.0 * walk_budget)) : 1;
    bool any = false;
    for (int i = 1; i <= count; ++i) {
      if (!attempt(far * i / count, i == count ? border : -1)) break;
      any = true;
      if (moves_ >= walk_budget) return true;
    }
    if (any) return true;
    double share = far / count;
    if (valley()) {
      // Across a valley the step ends where the flanks meet.
      const double rate = rejected_.dot(chart_.direction(step));
      const double meeting = rejected_.dot(rejected_point_ - chart_.spot().point) / rate;
      return meeting > 0.0 && meeting < share && attempt(meeting, -1);
    }
    if constexpr (requires { chart_.stopped(); }) {
      if (chart_.stopped()) return false;
    }
    // The first sample is no nearer: shorter steps.
    for (int i = 0; i < 16; ++i) {
      share *= 0.4;
      if (share * step.length <= chart_.rest_length(false)) break;
      if (attempt(share, -1)) return true;
    }
    return false;
  }

  static constexpr int most_aims = 2;
  // Flanks that turn by less are one (rad).
  static constexpr double least_fold = 1e-3;

  /// Of the flanks that were no nearer, the one that stands against the place's own the most.
  void remember(const Spot& there) noexcept {
    if (!chart_.has_flanks() || !(there.front.dot(own_) < rejected_.dot(own_))) return;
    rejected_ = there.front;
    rejected_point_ = there.point;
  }

  /// Whether the flank that was no nearer rises from this one behind an edge.
  [[nodiscard]] bool valley() const noexcept {
    if (!chart_.has_flanks() || own_.cross(rejected_).norm() <= least_fold) return false;
    return side_ * own_.dot(rejected_point_ - chart_.spot().point) > 0.0;
  }

  /// In the valley where two flanks meet no step across comes nearer; one along it may.
  bool along_fold() noexcept {
    if (!chart_.has_flanks()) return false;
    const Vec3 fold = own_.cross(rejected_);
    const double sine = fold.norm();
    if (!(sine > least_fold)) return false;
    const Vec3 direction = fold / sine;
    const double size = -direction.dot(chart_.spot().point - goal_);
    WalkStep step = chart_.towards(size * direction);
    step.length = chart_.direction(step).norm();
    return step.length > chart_.rest_length(false) && !chart_.blocked(step) && advance(step);
  }

  Chart& chart_;
  const Goal& asked_;
  double side_;
  Vec3 goal_ = Vec3::Zero();
  WalkForms forms_;               ///< of the last place
  bool formed_ = false;           ///< they are known, and of this chart
  Vec3 own_ = Vec3::Zero();       ///< front at the start of a step
  Vec3 rejected_ = Vec3::Zero();  ///< of a place that was no nearer
  Vec3 rejected_point_ = Vec3::Zero();
  int aims_ = 0;
  int moves_ = 0;
};

}  // namespace asperity
