#include "asperity/surface/parametric_descent.h"

#include <algorithm>
#include <cmath>

namespace asperity {

namespace {

// A step below this share of the surface's grain is not worth making.
constexpr double rest_of_grain = 1e-6;
// Latitude beyond which steps on a sphere are made in space, where the poles are no special places.
constexpr double polar = 1.0;

// Flanks that turn by less are one.
constexpr double least_fold = 1e-3;  // rad

struct Step {
  double u = 0.0;
  double v = 0.0;
  double length = 0.0;  ///< m
};

class Walker {
 public:
  Walker(const ParametricSurface& surface, ParametricDescent& descent) noexcept
      : surface_(surface), descent_(descent), rest_(rest_of_grain * surface.grain()) {}

  DescentEnd run() noexcept {
    descent_.normal = surface_.normal(descent_.jet);
    while (descent_.moves < descent_.budget) {
      if (descent_.may_leave && leaves()) return DescentEnd::left;
      aim();
      Step step = newton();
      if (step.length <= rest_) return DescentEnd::rest;
      if (outward(step)) {
        if (descent_.may_leave) return DescentEnd::rim;
        step = along_rim(step);
        if (step.length <= rest_) return DescentEnd::rest;
      }
      if (!advance(step) && !along_fold()) return DescentEnd::rest;
    }
    return DescentEnd::limited;
  }

 private:
  [[nodiscard]] bool leaves() const noexcept {
    return descent_.side * descent_.normal.dot(descent_.goal - descent_.jet.point) > 0.0;
  }

  /// With friction the goal depends on the point: after two steps what is left of that is far below a thousandth of the
  /// force, and a goal that holds still is reached at Newton's pace.
  void aim() noexcept {
    constexpr int most_aims = 2;
    if (descent_.friction <= 0.0) {
      goal_ = descent_.goal;
    } else if (aims_++ < most_aims) {
      goal_ = friction_goal(descent_.jet.point, descent_.side * descent_.normal, descent_.goal, descent_.friction);
    }
  }

  /// Newton's step where the squared distance is convex, Gauss and Newton's where it is not. Of the second derivatives
  /// the parts along the surface belong to the parameters, not to the distance.
  [[nodiscard]] Step newton() const noexcept {
    const ParametricJet& jet = descent_.jet;
    const Vec3 rest = jet.point - goal_;
    const double g_u = jet.u.dot(rest);
    const double g_v = jet.v.dot(rest);
    const double uu = jet.u.squaredNorm();
    const double uv = jet.u.dot(jet.v);
    const double vv = jet.v.squaredNorm();
    const double off = descent_.normal.dot(rest);
    const double h_uu = uu + off * descent_.normal.dot(jet.uu);
    const double h_uv = uv + off * descent_.normal.dot(jet.uv);
    const double h_vv = vv + off * descent_.normal.dot(jet.vv);
    const double det = uu * vv - uv * uv;
    const double newton_det = h_uu * h_vv - h_uv * h_uv;
    // Not convex, or nearly flat: its step would be no guide.
    constexpr double least_share = 0.02;
    if (h_uu > 0.0 && newton_det > least_share * det)
      return sized(-(h_vv * g_u - h_uv * g_v) / newton_det, -(h_uu * g_v - h_uv * g_u) / newton_det);
    if (det > 0.0) return sized(-(vv * g_u - uv * g_v) / det, -(uu * g_v - uv * g_u) / det);
    return {};
  }

  [[nodiscard]] Step sized(double u, double v) const noexcept {
    return {u, v, (u * descent_.jet.u + v * descent_.jet.v).norm()};
  }

  /// Whether the step leads out over a rim that the point is on.
  [[nodiscard]] bool outward(const Step& step) const noexcept { return over(0, step.u) || over(1, step.v); }
  [[nodiscard]] bool over(int k, double rate) const noexcept {
    if (endless(k)) return false;
    return (rate > 0.0 && descent_.uv[k] >= surface_.upper()[k]) ||
           (rate < 0.0 && descent_.uv[k] <= surface_.lower()[k]);
  }
  [[nodiscard]] bool endless(int k) const noexcept {
    return k == 0 ? surface_.closed_u() : surface_.closed_v() || round();
  }
  [[nodiscard]] bool round() const noexcept { return surface_.settings().shape == ParametricShape::sphere; }

  [[nodiscard]] Step along_rim(const Step& step) const noexcept {
    const bool u_over = over(0, step.u);
    const bool v_over = over(1, step.v);
    if (u_over && v_over) return {};
    const Vec3& tangent = u_over ? descent_.jet.v : descent_.jet.u;
    const Vec3& bend = u_over ? descent_.jet.vv : descent_.jet.uu;
    const Vec3 rest = descent_.jet.point - goal_;
    const double square = tangent.squaredNorm();
    double curvature = square + bend.dot(rest);
    if (!(curvature > 0.02 * square)) curvature = square;
    const double size = -tangent.dot(rest) / curvature;
    const Step along = u_over ? sized(0.0, size) : sized(size, 0.0);
    return outward(along) ? Step{} : along;
  }

  /// Where a step leads to, as far as `share` of it.
  [[nodiscard]] Vec2 moved(const Vec2& from, const ParametricJet& jet, const Step& step, double share) const noexcept {
    const Vec2 straight(from.x() + share * step.u, from.y() + share * step.v);
    if (!round() || (std::abs(from.y()) < polar && std::abs(straight.y()) < polar))
      return surface_.within_range(straight);
    const Vec3 outward_normal(std::cos(from.y()) * std::cos(from.x()), std::cos(from.y()) * std::sin(from.x()),
                              std::sin(from.y()));
    Vec3 tangent = step.u * jet.u + step.v * jet.v;
    tangent -= outward_normal.dot(tangent) * outward_normal;
    const Vec3 to = outward_normal + share / surface_.settings().radius * tangent;
    return surface_.within_range(Vec2(std::atan2(to.y(), to.x()), std::atan2(to.z(), std::hypot(to.x(), to.y()))));
  }

  /// Goes along the step as far as the distance falls, at most to a rim. False when it cannot.
  bool advance(const Step& step) noexcept {
    double far = 1.0;
    int rim = -1;
    const double rates[2] = {step.u, step.v};
    for (int k = 0; k < 2; ++k) {
      if (endless(k) || rates[k] == 0.0) continue;
      const double border = rates[k] > 0.0 ? surface_.upper()[k] : surface_.lower()[k];
      const double reach = (border - descent_.uv[k]) / rates[k];
      if (reach >= far) continue;
      far = std::max(0.0, reach);
      rim = k;
    }
    const Vec2 from = descent_.uv;
    const ParametricJet start = descent_.jet;
    double distance = (start.point - goal_).squaredNorm();
    const double samples = std::ceil(far * step.length / surface_.stride());
    const int count = static_cast<int>(std::clamp(samples, 1.0, static_cast<double>(descent_.budget)));
    const auto attempt = [&](double share, int border) {
      Vec2 to = moved(from, start, step, share);
      if (border >= 0) to[border] = rates[border] > 0.0 ? surface_.upper()[border] : surface_.lower()[border];
      ++descent_.moves;
      const ParametricJet there = surface_.jet(to);
      const double now = (there.point - goal_).squaredNorm();
      if (!(now < distance)) {
        if (surface_.has_folds()) remember(there);
        return false;
      }
      distance = now;
      descent_.uv = to;
      descent_.jet = there;
      return true;
    };
    rejected_ = descent_.normal;
    bool any = false;
    for (int i = 1; i <= count; ++i) {
      if (!attempt(far * i / count, i == count ? rim : -1)) break;
      any = true;
      if (descent_.moves >= descent_.budget) break;
    }
    // The first sample is no nearer. Across a valley the step ends where the flanks meet.
    double share = far / count;
    const bool valley = !any && valley_before_rejected();
    if (valley) {
      const double rate = rejected_.dot(step.u * start.u + step.v * start.v);
      const double meeting = rejected_.dot(rejected_point_ - start.point) / rate;
      if (meeting > 0.0 && meeting < share) any = attempt(meeting, -1);
    }
    // Elsewhere shorter steps.
    for (int i = 0; i < 16 && !any && !valley; ++i) {
      share *= 0.4;
      if (share * step.length <= rest_) break;
      any = attempt(share, -1);
    }
    if (any) descent_.normal = surface_.normal(descent_.jet);
    return any;
  }

  /// Of the flanks that were no nearer, the one that stands against the point's own the most.
  void remember(const ParametricJet& there) noexcept {
    const Vec3 flank = surface_.normal(there);
    if (!(flank.dot(descent_.normal) < rejected_.dot(descent_.normal))) return;
    rejected_ = flank;
    rejected_point_ = there.point;
  }

  /// Whether the flank that was no nearer rises from this one behind an edge.
  [[nodiscard]] bool valley_before_rejected() const noexcept {
    if (!surface_.has_folds() || descent_.normal.cross(rejected_).norm() <= least_fold) return false;
    return descent_.side * descent_.normal.dot(rejected_point_ - descent_.jet.point) > 0.0;
  }

  /// In the valley where two flanks meet no step across comes nearer; one along it may.
  bool along_fold() noexcept {
    if (!surface_.has_folds()) return false;
    const Vec3 fold = descent_.normal.cross(rejected_);
    const double sine = fold.norm();
    if (!(sine > least_fold)) return false;
    const Vec3 direction = fold / sine;
    const double size = -direction.dot(descent_.jet.point - goal_);
    Vec3 du;
    Vec3 dv;
    ParametricSurface::parameter_gradients(descent_.jet, du, dv);
    const Step step = sized(size * du.dot(direction), size * dv.dot(direction));
    return step.length > rest_ && !outward(step) && advance(step);
  }

  const ParametricSurface& surface_;
  ParametricDescent& descent_;
  double rest_;
  Vec3 goal_ = Vec3::Zero();
  Vec3 rejected_ = Vec3::Zero();  ///< normal of a place that was no nearer
  Vec3 rejected_point_ = Vec3::Zero();
  int aims_ = 0;
};

}  // namespace

DescentEnd descend(const ParametricSurface& surface, ParametricDescent& descent) noexcept {
  return Walker(surface, descent).run();
}

}  // namespace asperity
