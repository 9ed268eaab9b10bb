#include "asperity/surface/relief_descent.h"

#include <algorithm>
#include <cmath>

namespace asperity {

namespace {

// A step below these shares of the relief's grain and of the mean edge is not worth making, once one has been made.
constexpr double relief_rest_of_grain = 5e-4;
constexpr double rest_of_edge = 5e-6;
// The first one always is, unless the probe has not moved at all.
constexpr double first_rest_of_grain = 1e-10;
// Distance (in grains) between places where the way is checked.
constexpr double stride_of_grain = 0.75;

// A barycentric coordinate this small is 0: moving along an edge leaves rounding in it.
constexpr double on_border = 1e-13;

struct ReliefStep {
  double u = 0.0;
  double v = 0.0;
  double length = 0.0;  ///< m
};

double coordinate(const ReliefPlace& place, int k) noexcept {
  return k == 0 ? 1.0 - place.u - place.v : (k == 1 ? place.u : place.v);
}

double change(const ReliefStep& step, int k) noexcept {
  return k == 0 ? -step.u - step.v : (k == 1 ? step.u : step.v);
}

double length_of(const ReliefPoint& point, double u, double v) noexcept {
  return (u * point.along_u + v * point.along_v).norm();
}

/// Newton's step where the squared distance is convex, Gauss and Newton's where it is not.
ReliefStep step_at(const ReliefFrame& frame, const ReliefPlace& place, const ReliefPoint& point,
                   const Vec3& goal) noexcept {
  const Vec3 rest = point.position - goal;
  const double g_u = point.along_u.dot(rest);
  const double g_v = point.along_v.dot(rest);
  const double uu = point.along_u.squaredNorm();
  const double uv = point.along_u.dot(point.along_v);
  const double vv = point.along_v.squaredNorm();
  const Vec3 direction = frame.prism.direction_at(place.u, place.v);
  const double n = direction.dot(rest);
  const double turn_u = frame.prism.turn_u.dot(rest);
  const double turn_v = frame.prism.turn_v.dot(rest);
  const double h_uu = uu + point.jet.uu * n + 2.0 * point.jet.u * turn_u;
  const double h_uv = uv + point.jet.uv * n + point.jet.u * turn_v + point.jet.v * turn_u;
  const double h_vv = vv + point.jet.vv * n + 2.0 * point.jet.v * turn_v;
  const double det = uu * vv - uv * uv;
  const double newton_det = h_uu * h_vv - h_uv * h_uv;
  ReliefStep step;
  // Not convex, or nearly flat: its step would be no guide.
  constexpr double least_share = 0.02;
  if (h_uu > 0.0 && newton_det > least_share * det) {
    step.u = -(h_vv * g_u - h_uv * g_v) / newton_det;
    step.v = -(h_uu * g_v - h_uv * g_u) / newton_det;
  } else if (det > 0.0) {
    step.u = -(vv * g_u - uv * g_v) / det;
    step.v = -(uu * g_v - uv * g_u) / det;
  }
  step.length = length_of(point, step.u, step.v);
  return step;
}

/// The best step along the edge opposite corner k.
ReliefStep step_along_edge(const ReliefFrame& frame, const ReliefPlace& place, const ReliefPoint& point,
                           const Vec3& goal, int k) noexcept {
  // Along it the coordinates of the other two corners change by equal amounts.
  ReliefStep along{k == 0 ? -1.0 : (k == 1 ? 0.0 : 1.0), k == 0 ? 1.0 : (k == 1 ? 1.0 : 0.0), 0.0};
  const Vec3 tangent = along.u * point.along_u + along.v * point.along_v;
  const Vec3 rest = point.position - goal;
  const double square = tangent.squaredNorm();
  if (!(square > 0.0)) return {};
  const double bend =
      along.u * along.u * point.jet.uu + 2.0 * along.u * along.v * point.jet.uv + along.v * along.v * point.jet.vv;
  const double slope = along.u * point.jet.u + along.v * point.jet.v;
  const Vec3 turn = along.u * frame.prism.turn_u + along.v * frame.prism.turn_v;
  double curvature =
      square + bend * frame.prism.direction_at(place.u, place.v).dot(rest) + 2.0 * slope * turn.dot(rest);
  if (!(curvature > 0.02 * square)) curvature = square;
  const double size = -tangent.dot(rest) / curvature;
  along.u *= size;
  along.v *= size;
  along.length = std::abs(size) * std::sqrt(square);
  return along;
}

bool admissible(const ReliefPlace& place, const ReliefStep& step) noexcept {
  for (int k = 0; k < 3; ++k) {
    if (coordinate(place, k) <= on_border && change(step, k) < 0.0) return false;
  }
  return true;
}

class ReliefWalker {
 public:
  ReliefWalker(const ReliefSurface& surface, Descent& descent) noexcept
      : surface_(surface),
        descent_(descent),
        place_(*descent.place),
        rest_(std::min(relief_rest_of_grain * surface.grain(), rest_of_edge * surface.base().mesh().mean_edge())) {}

  DescentEnd run() noexcept {
    while (descent_.moves < descent_.budget) {
      if (descent_.may_leave && leaves()) return DescentEnd::left;
      aim();
      ReliefStep step = step_at(place_.frame, place_, descent_.point, goal_);
      const double enough = descent_.moves == 0 ? first_rest_of_grain * surface_.grain() : rest_;
      if (step.length <= std::min(enough, rest_)) return DescentEnd::rest;
      if (!admissible(place_, step)) {
        const Choice choice = at_border(step);
        if (choice == Choice::rim) return DescentEnd::rim;
        if (choice == Choice::rest) return DescentEnd::rest;
        if (descent_.may_leave && leaves()) return DescentEnd::left;
      }
      if (!advance(step)) return DescentEnd::rest;
    }
    return DescentEnd::limited;
  }

 private:
  enum class Choice { go, rest, rim };

  /// Where the point is led to from here. With friction the goal depends on the point: after two steps what is left
  /// of that is far below a thousandth of the force, and a goal that holds still is reached at Newton's pace.
  void aim() noexcept {
    constexpr int most_aims = 2;
    if (descent_.friction <= 0.0) {
      goal_ = descent_.goal;
    } else if (aims_++ < most_aims)
      goal_ = friction_goal(descent_.point.position, descent_.side * descent_.point.normal(), descent_.goal,
                            descent_.friction);
  }

  [[nodiscard]] bool leaves() const noexcept {
    return descent_.side * descent_.point.normal().dot(descent_.goal - descent_.point.position) > 0.0;
  }

  ReliefPoint evaluate(const ReliefPlace& place) noexcept {
    ++descent_.moves;
    return surface_.point(place.frame, place.u, place.v);
  }

  /// The step points out of the triangle at an edge or vertex: looks for the face, or edge, that it can go on in.
  Choice at_border(ReliefStep& step) noexcept {
    int zeros = 0;
    int zero = 0;
    int whole = 0;
    for (int k = 0; k < 3; ++k) {
      if (coordinate(place_, k) <= on_border) {
        ++zeros;
        zero = k;
      } else {
        whole = k;
      }
    }
    return zeros == 1 ? at_edge(step, zero) : at_vertex(step, whole);
  }

  Choice at_edge(ReliefStep& step, int k) noexcept {
    ReliefPlace across = place_;
    const ReliefPoint before = descent_.point;
    const double distance = (before.position - goal_).squaredNorm();
    if (!cross_edge(surface_, across, k)) {
      // Beyond the rim there is nothing that could hold the point.
      return descent_.may_leave ? Choice::rim : along_edge(step, k);
    }
    const ReliefPoint there = evaluate(across);
    // Without stitching the other face may stand higher: a wall.
    const bool wall = surface_.has_jumps() && (there.position - goal_).squaredNorm() > distance;
    if (!wall) {
      const ReliefStep onward = step_at(across.frame, across, there, goal_);
      if (admissible(across, onward)) {
        place_ = across;
        descent_.point = there;
        step = onward;
        return onward.length <= rest_ ? Choice::rest : Choice::go;
      }
    }
    return along_edge(step, k);
  }

  Choice along_edge(ReliefStep& step, int k) noexcept {
    step = step_along_edge(place_.frame, place_, descent_.point, goal_, k);
    return step.length <= rest_ || !admissible(place_, step) ? Choice::rest : Choice::go;
  }

  /// At a vertex every face around it is tried, then every edge.
  Choice at_vertex(ReliefStep& step, int corner) noexcept {
    const TriangleMesh& mesh = surface_.base().mesh();
    const std::uint32_t vertex = mesh.triangles()[place_.frame.face][static_cast<std::size_t>(corner)];
    ReliefPlace best;
    ReliefPoint best_point;
    ReliefStep best_step;
    bool rim = false;
    for (const std::uint32_t face : mesh.faces_of_vertex(vertex)) {
      if (descent_.moves >= descent_.budget) break;
      ReliefPlace here;
      here.frame = face == place_.frame.face ? place_.frame : surface_.frame(face, place_.frame.coat.moment);
      const TriangleMesh::Triangle& t = mesh.triangles()[face];
      here.u = t[1] == vertex ? 1.0 : 0.0;
      here.v = t[2] == vertex ? 1.0 : 0.0;
      const ReliefPoint point = evaluate(here);
      const int own = t[0] == vertex ? 0 : (t[1] == vertex ? 1 : 2);
      ReliefStep options[3] = {step_at(here.frame, here, point, goal_),
                               step_along_edge(here.frame, here, point, goal_, (own + 1) % 3),
                               step_along_edge(here.frame, here, point, goal_, (own + 2) % 3)};
      for (const ReliefStep& option : options) {
        if (option.length <= best_step.length || !admissible(here, option)) continue;
        best = here;
        best_point = point;
        best_step = option;
      }
      for (int k = 1; k <= 2; ++k) rim = rim || mesh.neighbour(face, ((own + k) % 3 + 1) % 3) == no_index;
    }
    if (best_step.length <= rest_) return rim && descent_.may_leave ? Choice::rim : Choice::rest;
    place_ = best;
    descent_.point = best_point;
    step = best_step;
    return Choice::go;
  }

  /// Goes along the step as far as the distance falls, at most to the triangle's border. False when it cannot.
  bool advance(const ReliefStep& step) noexcept {
    double far = 1.0;
    int border = -1;
    for (int k = 0; k < 3; ++k) {
      const double rate = change(step, k);
      if (rate >= 0.0) continue;
      const double reach = -coordinate(place_, k) / rate;
      if (reach < far) {
        far = std::max(0.0, reach);
        border = k;
      }
    }
    const ReliefPlace from = place_;
    double distance = (descent_.point.position - goal_).squaredNorm();
    const double samples = std::ceil(far * step.length / (stride_of_grain * surface_.grain()));
    const int count = std::clamp(static_cast<int>(samples), 1, descent_.budget);
    bool moved = false;
    for (int i = 1; i <= count; ++i) {
      const bool last = i == count;
      if (!attempt(from, step, far * i / count, last ? border : -1, distance)) break;
      moved = true;
      if (descent_.moves >= descent_.budget) return true;
    }
    if (moved) return true;
    // The first sample is no nearer: shorter steps.
    double share = far / count;
    for (int i = 0; i < 12; ++i) {
      share *= 0.4;
      if (share * step.length <= rest_) break;
      if (attempt(from, step, share, -1, distance)) return true;
    }
    return false;
  }

  bool attempt(const ReliefPlace& from, const ReliefStep& step, double share, int border, double& distance) noexcept {
    ReliefPlace& to = place_;
    const double u = to.u;
    const double v = to.v;
    to.u = from.u + share * step.u;
    to.v = from.v + share * step.v;
    if (border >= 0) put_on_border(to, border);
    const ReliefPoint there = evaluate(to);
    const double now = (there.position - goal_).squaredNorm();
    if (!(now < distance)) {
      to.u = u;
      to.v = v;
      return false;
    }
    distance = now;
    descent_.point = there;
    return true;
  }

  static void put_on_border(ReliefPlace& place, int k) noexcept {
    if (k == 1) place.u = 0.0;
    if (k == 2) place.v = 0.0;
    place.u = std::clamp(place.u, 0.0, 1.0);
    place.v = std::clamp(place.v, 0.0, 1.0);
    // So that 1 - u - v is exactly 0.
    if (k == 0) place.v = 1.0 - place.u;
  }

  const ReliefSurface& surface_;
  Descent& descent_;
  ReliefPlace& place_;
  double rest_;
  Vec3 goal_ = Vec3::Zero();
  int aims_ = 0;
};

}  // namespace

Vec3 friction_goal(const Vec3& point, const Vec3& normal, const Vec3& goal, double coefficient) noexcept {
  const Vec3 spring = point - goal;
  const double push = spring.dot(normal);
  if (!(push > 0.0) || coefficient <= 0.0) return goal;
  const Vec3 along = spring - push * normal;
  const double length = along.norm();
  const double held = coefficient * push;
  if (length <= held) return point;
  return goal + (held / length) * along;
}

bool cross_edge(const ReliefSurface& surface, ReliefPlace& place, int k) noexcept {
  const TriangleMesh& mesh = surface.base().mesh();
  const std::uint32_t face = place.frame.face;
  const std::uint32_t other = mesh.neighbour(face, (k + 1) % 3);
  if (other == no_index) return false;
  const TriangleMesh::Triangle& here = mesh.triangles()[face];
  const TriangleMesh::Triangle& there = mesh.triangles()[other];
  double barycentric[3] = {0.0, 0.0, 0.0};
  for (int end = 1; end <= 2; ++end) {
    const int corner = (k + end) % 3;
    for (std::size_t j = 0; j < 3; ++j) {
      if (there[j] == here[static_cast<std::size_t>(corner)]) barycentric[j] = coordinate(place, corner);
    }
  }
  place.frame = surface.frame(other, place.frame.coat.moment);
  place.u = barycentric[1];
  place.v = barycentric[2];
  // The coordinate of the corner that is not on the edge stays exactly 0.
  if (there[0] != here[static_cast<std::size_t>((k + 1) % 3)] &&
      there[0] != here[static_cast<std::size_t>((k + 2) % 3)]) {
    place.v = 1.0 - place.u;
  }
  return true;
}

DescentEnd descend(const ReliefSurface& surface, Descent& descent) noexcept {
  return ReliefWalker(surface, descent).run();
}

}  // namespace asperity
