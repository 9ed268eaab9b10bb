#pragma once
// Walking along a surface to the point of it nearest to a goal: Newton's method on the squared distance.

#include <algorithm>
#include <cmath>

#include "asperity/core/lanes.h"
#include "asperity/surface/view.h"
#include "asperity/surface/walk_step.h"

namespace asperity {

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
/// evaluate(place, spot); take(place, spot), which goes there; stride(); work(), evaluations so far, where a place may
/// take several. Where flanks may meet (has_flanks): direction(step) in space, and towards(way), the step that leads
/// along it. [servo]
template <class Chart>
class Walk {
 public:
  Walk(Chart& chart, const Goal& goal, double side) noexcept : chart_(chart), asked_(goal), side_(side) {}

  DescentEnd run() noexcept {
    while (true) {
      const DescentEnd end = lead();
      if (end != DescentEnd::rest || moves_ < long_way || !aims_anew()) return end;
    }
  }
  /// Evaluations that it took. [servo]
  [[nodiscard]] std::uint32_t moves() const noexcept { return static_cast<std::uint32_t>(moves_); }

 private:
  [[gnu::always_inline]] inline DescentEnd lead() noexcept {
    while (!out_of_moves()) {
      if (asked_.may_leave && leaves()) return DescentEnd::left;
      aim();
      if (settled()) return DescentEnd::rest;
      forms_ = chart_.forms(goal_);
      formed_ = true;
      WalkStep step = shortened_ ? ravine_step(forms_) : newton_step(forms_, asked_.flattest);
      if (step.length <= chart_.rest_length(moves_ == 0)) return DescentEnd::rest;
      if (chart_.blocked(step)) {
        formed_ = false;
        const Turn turn = chart_.turn(step, goal_, asked_.may_leave, moves_);
        if (turn == Turn::rim) return DescentEnd::rim;
        if (turn == Turn::rest) return DescentEnd::rest;
        if (asked_.may_leave && leaves()) return DescentEnd::left;
      }
      if (!advance(step) && !along_fold()) return out_of_moves() ? DescentEnd::limited : DescentEnd::rest;
      if (moves_ >= next_look_ && creeps()) return DescentEnd::rest;
    }
    return DescentEnd::limited;
  }

  /// Where the surface has turned so much on the way that friction does not hold the point where it came to rest, there
  /// is more to go. A few times: each is aimed at from nearer.
  [[nodiscard, gnu::noinline]] bool aims_anew() noexcept {
    constexpr int most_rounds = 4;
    constexpr double on_cone = 0.02;
    if (asked_.friction <= 0.0 || aimed_anew_ == most_rounds) return false;
    const Vec3 normal = side_ * chart_.spot().front;
    if ((chart_.spot().point - asked_.point).dot(normal) <= 0.0 ||
        within_cone(chart_.spot().point, normal, asked_.point, asked_.friction * (1.0 + on_cone)))
      return false;
    ++aimed_anew_;
    aims_ = 0;
    shortened_ = false;
    return true;
  }

  [[nodiscard]] bool out_of_moves() const noexcept {
    if (moves_ >= asked_.moves) return true;
    if constexpr (requires { chart_.work(); }) {
      return chart_.work() >= asked_.work;
    } else {
      return moves() >= asked_.work;
    }
  }
  /// Far behind a surface that is bent much there is no end to small moves that change no force.
  [[gnu::noinline]] bool creeps() noexcept {
    const double now = (chart_.spot().point - asked_.point).norm();
    const bool creeping = !asked_.exactly && now >= looked_at_ * (1.0 - least_gain);
    looked_at_ = now;
    next_look_ = moves_ + look_after;
    return creeping;
  }
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
      return newton_step(forms_, asked_.flattest).length <= far_below * chart_.rest_length(false);
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
    shortened_ = false;
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
    const int count = strides > 1.0 ? static_cast<int>(std::min(std::ceil(strides), 1.0 * asked_.moves)) : 1;
    bool any = false;
    bool ahead = false;
    if constexpr (looks_ahead) {
      ahead = count > 1;
      if (ahead) any = advance_ahead(start, step, far, count, border, distance, attempt);
    }
    for (int i = 1; !ahead && i <= count; ++i) {
      if (!attempt(far * i / count, i == count ? border : -1)) break;
      any = true;
      if (out_of_moves()) return true;
    }
    if (any) return true;
    shortened_ = true;
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
    for (int i = 0; i < 16 && !out_of_moves(); ++i) {
      share *= 0.4;
      if (share * step.length <= chart_.rest_length(false)) break;
      if (attempt(share, -1)) return true;
    }
    return false;
  }

  /// Along the way to the last sample of a step, as far as the distance falls: how many samples that are. Only where
  /// the surface is there is asked for; `distance` (squared) becomes that of the last one.
  template <class Start>
  int look_ahead(const Start& start, const WalkStep& step, double far, int count, double& distance) noexcept {
    int seen = 0;
    const double per = far / count;
    if (count == 2) {
      const Vec2 to = chart_.moved(start, step, per, -1);
      chart_.look(to.x(), to.y());
      const double now = chart_.squared_distance(to, goal_);
      if (!(now < distance)) return 0;
      ++moves_;
      distance = now;
      return 1;
    }
    while (true) {
      Lanes u;
      Lanes v;
      for (std::size_t i = 0; i < lanes; ++i) {
        const int sample = std::min(seen + 1 + static_cast<int>(i), count - 1);
        const Vec2 to = chart_.moved(start, step, per * sample, -1);
        u[i] = to.x();
        v[i] = to.y();
      }
      Lanes now;
      chart_.squared_distances(u, v, goal_, now);
      for (std::size_t i = 0; i < lanes; ++i) {
        if (seen + 1 >= count || out_of_moves()) return seen;
        ++moves_;
        chart_.look(u[i], v[i]);
        if (!(now[i] < distance)) return seen;
        distance = now[i];
        ++seen;
      }
    }
  }

  /// The same to the end of the step where the distance falls all along, or to the last sample before it. False where
  /// the first one is no nearer.
  template <class Start, class Attempt>
  [[gnu::noinline]] bool advance_ahead(const Start& start, const WalkStep& step, double far, int count, int border,
                                       double& distance, const Attempt& attempt) noexcept {
    const int seen = look_ahead(start, step, far, count, distance);
    if (seen == count - 1 && attempt(far, border)) return true;
    // Of a short step that fails at once the flank is wanted.
    if (seen == 0) return count == 2 && attempt(far / count, -1);
    const auto to = chart_.moved(start, step, far / count * seen, -1);
    // The middle of two was counted as it was looked at.
    if (count > 2) ++moves_;
    Spot there;
    chart_.evaluate(to, there);
    chart_.take(to, there);
    return true;
  }

  static constexpr bool looks_ahead = requires(const Chart& chart, const Lanes& at, const Vec3& goal, Lanes& squares) {
    chart.squared_distances(at, at, goal, squares);
  };
  static constexpr int most_aims = 2;
  // Evaluations: on a shorter way the normal turns little.
  static constexpr int long_way = 8;
  // A walk is at rest where so many moves bring it nearer by less than this share of the distance.
  static constexpr int look_after = 24;
  static constexpr double least_gain = 1e-6;
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
  int next_look_ = look_after;    ///< at how much the last moves have gained
  double looked_at_ = infinity;   ///< distance from the goal then
  bool shortened_ = false;        ///< a step was no nearer as a whole
  Vec3 own_ = Vec3::Zero();       ///< front at the start of a step
  Vec3 rejected_ = Vec3::Zero();  ///< of a place that was no nearer
  Vec3 rejected_point_ = Vec3::Zero();
  int aims_ = 0;
  int aimed_anew_ = 0;
  int moves_ = 0;
};

}  // namespace asperity
