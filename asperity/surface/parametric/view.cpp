#include "asperity/surface/parametric/view.h"

#include <algorithm>
#include <cmath>

#include "asperity/surface/tangents.h"
#include "asperity/surface/walk.h"

namespace asperity {

namespace {

// A step below this share of the surface's grain is not worth making.
constexpr double rest_of_grain = 1e-6;
// Latitude beyond which steps on a sphere are made in space, where the poles are no special places.
constexpr double polar = 1.0;

/// A parametric surface as it is walked along.
class ParameterChart {
 public:
  using Spot = ParametricSpot;

  ParameterChart(const ParametricView& view, Vec2& uv, ParametricSpot& spot) noexcept
      : view_(view), surface_(view.surface()), uv_(uv), spot_(spot), rest_(rest_of_grain * surface_.grain()) {}

  [[nodiscard]] const ParametricSpot& spot() const noexcept { return spot_; }

  /// Of the second derivatives the parts along the surface belong to the parameters, not to the distance.
  [[nodiscard]] WalkForms forms(const Vec3& goal) const noexcept {
    const Vec3 rest = spot_.point - goal;
    const double off = spot_.front.dot(rest);
    WalkForms f;
    f.g_u = spot_.u.dot(rest);
    f.g_v = spot_.v.dot(rest);
    f.uu = spot_.u.squaredNorm();
    f.uv = spot_.u.dot(spot_.v);
    f.vv = spot_.v.squaredNorm();
    f.h_uu = f.uu + off * spot_.front.dot(spot_.uu);
    f.h_uv = f.uv + off * spot_.front.dot(spot_.uv);
    f.h_vv = f.vv + off * spot_.front.dot(spot_.vv);
    return f;
  }
  [[nodiscard]] double rest_length(bool) const noexcept { return rest_; }
  [[nodiscard]] double stride() const noexcept { return surface_.stride(); }
  [[nodiscard]] bool blocked(const WalkStep& step) const noexcept { return over(0, step.u) || over(1, step.v); }
  [[nodiscard]] bool has_flanks() const noexcept { return surface_.has_folds(); }
  [[nodiscard]] Vec3 direction(const WalkStep& step) const noexcept { return step.u * spot_.u + step.v * spot_.v; }
  [[nodiscard]] WalkStep towards(const Vec3& way) const noexcept {
    Vec3 du;
    Vec3 dv;
    parameter_gradients(spot_.u, spot_.v, du, dv);
    return {du.dot(way), dv.dot(way)};
  }

  /// On the rim, with the goal beyond it.
  Turn turn(WalkStep& step, const Vec3& goal, bool may_leave, int&) const noexcept {
    if (may_leave) return Turn::rim;
    step = along_rim(step, goal);
    return step.length <= rest_ ? Turn::rest : Turn::go;
  }

  [[nodiscard]] double reach(const WalkStep& step, int& border) const noexcept {
    double far = 1.0;
    const double rates[2] = {step.u, step.v};
    for (int k = 0; k < 2; ++k) {
      if (endless(k) || rates[k] == 0.0) continue;
      const double end = ((rates[k] > 0.0 ? surface_.upper()[k] : surface_.lower()[k]) - uv_[k]) / rates[k];
      if (end >= far) continue;
      far = std::max(0.0, end);
      border = k;
    }
    return far;
  }

  struct Start {
    Vec2 uv;
    Vec3 u;
    Vec3 v;
  };
  [[nodiscard]] Start start() const noexcept { return {uv_, spot_.u, spot_.v}; }
  [[nodiscard]] Vec2 moved(const Start& from, const WalkStep& step, double share, int border) const noexcept {
    Vec2 to = within(from, step, share);
    if (border >= 0)
      to[border] = (border == 0 ? step.u : step.v) > 0.0 ? surface_.upper()[border] : surface_.lower()[border];
    return to;
  }
  bool evaluate(const Vec2& to, ParametricSpot& spot) const noexcept {
    spot = view_.spot(to);
    return true;
  }
  void take(const Vec2& to, const ParametricSpot& spot) noexcept {
    uv_ = to;
    spot_ = spot;
  }

 private:
  [[nodiscard]] bool over(int k, double rate) const noexcept {
    if (endless(k)) return false;
    return (rate > 0.0 && uv_[k] >= surface_.upper()[k]) || (rate < 0.0 && uv_[k] <= surface_.lower()[k]);
  }
  [[nodiscard]] bool endless(int k) const noexcept {
    return k == 0 ? surface_.closed_u() : surface_.closed_v() || round();
  }
  [[nodiscard]] bool round() const noexcept { return surface_.settings().shape == ParametricShape::sphere; }

  [[nodiscard]] WalkStep along_rim(const WalkStep& step, const Vec3& goal) const noexcept {
    const bool u_over = over(0, step.u);
    const bool v_over = over(1, step.v);
    if (u_over && v_over) return {};
    const Vec3& tangent = u_over ? spot_.v : spot_.u;
    const Vec3& bend = u_over ? spot_.vv : spot_.uu;
    const Vec3 rest = spot_.point - goal;
    const double square = tangent.squaredNorm();
    double curvature = square + bend.dot(rest);
    if (!(curvature > 0.02 * square)) curvature = square;
    const double size = -tangent.dot(rest) / curvature;
    const WalkStep along{u_over ? 0.0 : size, u_over ? size : 0.0, std::abs(size) * std::sqrt(square)};
    return blocked(along) ? WalkStep{} : along;
  }

  /// Where a step leads to, as far as `share` of it.
  [[nodiscard]] Vec2 within(const Start& from, const WalkStep& step, double share) const noexcept {
    const Vec2& uv = from.uv;
    const Vec2 straight(uv.x() + share * step.u, uv.y() + share * step.v);
    if (!round() || (std::abs(uv.y()) < polar && std::abs(straight.y()) < polar))
      return surface_.within_range(straight);
    const Vec3 outward(std::cos(uv.y()) * std::cos(uv.x()), std::cos(uv.y()) * std::sin(uv.x()), std::sin(uv.y()));
    Vec3 tangent = step.u * from.u + step.v * from.v;
    tangent -= outward.dot(tangent) * outward;
    const Vec3 to = outward + share / surface_.settings().radius * tangent;
    return surface_.within_range(Vec2(std::atan2(to.y(), to.x()), std::atan2(to.z(), std::hypot(to.x(), to.y()))));
  }

  const ParametricView& view_;
  const ParametricSurface& surface_;
  Vec2& uv_;
  ParametricSpot& spot_;
  double rest_;
};

}  // namespace

DescentEnd ParametricView::descend(Place& place, ParametricSpot& spot, const Goal& goal) const noexcept {
  Vec2 uv = place.at.head<2>();
  ParameterChart chart(*this, uv, spot);
  Walk<ParameterChart> walk(chart, goal, place.side());
  const DescentEnd end = walk.run();
  tell(work_, {walk.moves(), 0, 0});
  place.at = {uv.x(), uv.y(), 0.0};
  return end;
}

}  // namespace asperity
