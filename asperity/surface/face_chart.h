#pragma once
// Walking along a surface that lies over the faces of a triangle mesh, across edges and round vertices.

#include <algorithm>
#include <cmath>
#include <new>

#include "asperity/geometry/mesh.h"
#include "asperity/surface/face_place.h"
#include "asperity/surface/walk.h"

namespace asperity {

// A barycentric coordinate this small is 0: moving along an edge leaves rounding in it.
inline constexpr double on_border = 1e-13;
/// Faces reach so far beyond a rim (barycentric): a step that leads no farther out is one along it.
inline constexpr double rim_hair = 1e-9;

/// By how much a step changes the coordinate of corner k. [servo]
inline double change(const WalkStep& step, int k) noexcept {
  return k == 0 ? -step.u - step.v : (k == 1 ? step.u : step.v);
}

/// A surface over the faces of a mesh as it is walked along. `Faces` tells of it: Frame and Spot; mesh(); frame(face);
/// evaluate(frame, u, v), the surface there, with its tangents; forms(place, spot, goal) for a walk; curvature(place,
/// spot, du, dv, rest), what bending adds to the squared tangent along (du, dv); rest_length(first); stride(); jumps(),
/// whether the surfaces over two faces may differ at their common edge; free(from, to), whether nothing but the faces
/// around is in the way between two places of one face. [servo]
template <class Faces>
class FaceChart {
 public:
  using Spot = typename Faces::Spot;
  using Place = FacePlace<typename Faces::Frame>;

  FaceChart(const Faces& faces, Place& place, Spot& spot) noexcept : faces_(faces), place_(place), spot_(spot) {}

  [[nodiscard]] const Spot& spot() const noexcept { return spot_; }
  /// Evaluations so far.
  [[nodiscard]] std::uint32_t work() const noexcept requires requires(const Faces& faces) { faces.work(); }
  { return faces_.work(); }
  /// Faces that it has looked at beside the first.
  [[nodiscard]] std::uint32_t frames() const noexcept { return frames_; }
  [[nodiscard]] WalkForms forms(const Vec3& goal) const noexcept { return faces_.forms(place_, spot_, goal); }
  void slope(const Vec3& goal, WalkForms& forms) const noexcept {
    const Vec3 rest = spot_.point - goal;
    forms.g_u = spot_.along_u.dot(rest);
    forms.g_v = spot_.along_v.dot(rest);
  }
  [[nodiscard]] double rest_length(bool first) const noexcept { return faces_.rest_length(first); }
  [[nodiscard]] double stride() const noexcept { return faces_.stride(); }
  [[nodiscard]] bool blocked(const WalkStep& step) const noexcept { return !admissible(place_, step); }
  [[nodiscard]] static constexpr bool has_flanks() noexcept { return false; }
  [[nodiscard]] static Vec3 direction(const WalkStep&) noexcept { return Vec3::Zero(); }
  [[nodiscard]] static WalkStep towards(const Vec3&) noexcept { return {}; }

  /// At an edge or a vertex: looks for the face, or edge, that the point can go on in.
  Turn turn(WalkStep& step, const Vec3& goal, bool may_leave, int& moves) noexcept {
    int zeros = 0;
    int zero = 0;
    int whole = 0;
    for (int k = 0; k < 3; ++k) {
      if (place_.coordinate(k) <= on_border) {
        ++zeros;
        zero = k;
      } else {
        whole = k;
      }
    }
    return zeros == 1 ? at_edge(step, goal, may_leave, zero, moves) : at_vertex(step, goal, may_leave, whole, moves);
  }

  [[nodiscard]] double reach(const WalkStep& step, int& border) const noexcept {
    double far = 1.0;
    for (int k = 0; k < 3; ++k) {
      const double rate = change(step, k);
      if (rate >= 0.0) continue;
      const double end = -place_.coordinate(k) / rate;
      if (end < far) {
        far = std::max(0.0, end);
        border = k;
      }
    }
    return far;
  }
  [[nodiscard]] Vec2 start() const noexcept { return {place_.u, place_.v}; }
  [[nodiscard]] static Vec2 moved(const Vec2& from, const WalkStep& step, double share, int border) noexcept {
    Vec2 to(from.x() + share * step.u, from.y() + share * step.v);
    if (border < 0) return to;
    if (border == 1) to.x() = 0.0;
    if (border == 2) to.y() = 0.0;
    to = to.cwiseMax(0.0).cwiseMin(1.0);
    // So that 1 - u - v is exactly 0.
    if (border == 0) to.y() = 1.0 - to.x();
    return to;
  }
  bool evaluate(const Vec2& to, Spot& spot) noexcept {
    // Made where it is to be: spots are large.
    new (&spot) Spot(faces_.evaluate(place_.frame, to.x(), to.y()));
    return faces_.free(place_.frame, spot_, spot);
  }
  /// Of several places at once. What is made use of is counted by `look`.
  void squared_distances(const Lanes& u, const Lanes& v, const Vec3& goal, Lanes& squares) const noexcept requires
      requires(const Faces& faces, const Place& place) {
    faces.squared_distances(place.frame, u, v, goal, squares);
  }
  { faces_.squared_distances(place_.frame, u, v, goal, squares); }
  [[nodiscard]] double squared_distance(const Vec2& at, const Vec3& goal) const noexcept requires
      requires(const Faces& faces, const Place& place) {
    faces.squared_distance(place.frame, 0.0, 0.0, Vec3());
  }
  { return faces_.squared_distance(place_.frame, at.x(), at.y(), goal); }
  void look(double u, double v) const noexcept requires requires(const Faces& faces, const Place& place) {
    faces.look(place.frame, u, v);
  }
  { faces_.look(place_.frame, u, v); }
  /// Something is in the way that no shorter step avoids.
  [[nodiscard]] bool stopped() const noexcept requires requires(const Faces& faces) { faces.blocked; }
  { return faces_.blocked; }
  void take(const Vec2& to, const Spot& spot) noexcept {
    place_.u = to.x();
    place_.v = to.y();
    spot_ = spot;
  }

 private:
  [[nodiscard]] WalkStep step_at(const Place& place, const Spot& spot, const Vec3& goal) const noexcept {
    return newton_step(faces_.forms(place, spot, goal));
  }
  [[nodiscard]] static bool admissible(const Place& place, const WalkStep& step) noexcept {
    for (int k = 0; k < 3; ++k) {
      if (place.coordinate(k) <= on_border && change(step, k) < 0.0) return false;
    }
    return true;
  }

  /// The best step along the edge opposite corner k.
  [[nodiscard]] WalkStep step_along_edge(const Place& place, const Spot& spot, const Vec3& goal, int k) const noexcept {
    // Along it the coordinates of the other two corners change by equal amounts.
    WalkStep along{k == 0 ? -1.0 : (k == 1 ? 0.0 : 1.0), k == 0 ? 1.0 : (k == 1 ? 1.0 : 0.0), 0.0};
    const Vec3 tangent = along.u * spot.along_u + along.v * spot.along_v;
    const Vec3 rest = spot.point - goal;
    const double square = tangent.squaredNorm();
    if (!(square > 0.0)) return {};
    double curvature = square + faces_.curvature(place, spot, along.u, along.v, rest);
    if (!(curvature > 0.02 * square)) curvature = square;
    const double size = -tangent.dot(rest) / curvature;
    along.u *= size;
    along.v *= size;
    along.length = std::abs(size) * std::sqrt(square);
    return along;
  }

  /// The place on the face across the edge opposite corner `k`, where its coordinate is 0. False at a rim.
  bool cross_edge(Place& place, int k) const noexcept {
    const TriangleMesh& mesh = faces_.mesh();
    const std::uint32_t face = place.frame.face;
    const std::uint32_t other = mesh.neighbour(face, (k + 1) % 3);
    if (other == no_index) return false;
    const TriangleMesh::Triangle& here = mesh.triangles()[face];
    const TriangleMesh::Triangle& there = mesh.triangles()[other];
    double barycentric[3] = {0.0, 0.0, 0.0};
    for (int end = 1; end <= 2; ++end) {
      const int corner = (k + end) % 3;
      for (std::size_t j = 0; j < 3; ++j) {
        if (there[j] == here[static_cast<std::size_t>(corner)]) barycentric[j] = place.coordinate(corner);
      }
    }
    place.frame = faces_.frame(other);
    place.u = barycentric[1];
    place.v = barycentric[2];
    // The coordinate of the corner that is not on the edge stays exactly 0.
    if (there[0] != here[static_cast<std::size_t>((k + 1) % 3)] &&
        there[0] != here[static_cast<std::size_t>((k + 2) % 3)]) {
      place.v = 1.0 - place.u;
    }
    return true;
  }

  Turn at_edge(WalkStep& step, const Vec3& goal, bool may_leave, int k, int& moves) noexcept {
    Place across = place_;
    const double rest = rest_length(moves == 0);
    // Beyond the rim there is nothing that could hold the point.
    if (!cross_edge(across, k)) {
      return may_leave && change(step, k) < -rim_hair ? Turn::rim : along_edge(step, goal, k, rest);
    }
    ++moves;
    ++frames_;
    const Spot there = faces_.evaluate(across.frame, across.u, across.v);
    // Without stitching the other face may stand higher: a wall.
    const bool wall = faces_.jumps() && (there.point - goal).squaredNorm() > (spot_.point - goal).squaredNorm();
    if (!wall) {
      const WalkStep onward = step_at(across, there, goal);
      if (admissible(across, onward)) {
        place_ = across;
        spot_ = there;
        step = onward;
        return onward.length <= rest ? Turn::rest : Turn::go;
      }
    }
    return along_edge(step, goal, k, rest);
  }

  Turn along_edge(WalkStep& step, const Vec3& goal, int k, double rest) const noexcept {
    step = step_along_edge(place_, spot_, goal, k);
    return step.length <= rest || !admissible(place_, step) ? Turn::rest : Turn::go;
  }

  /// At a vertex every face around it is tried, then every edge.
  Turn at_vertex(WalkStep& step, const Vec3& goal, bool may_leave, int corner, int& moves) noexcept {
    const TriangleMesh& mesh = faces_.mesh();
    const std::uint32_t vertex = mesh.triangles()[place_.frame.face][static_cast<std::size_t>(corner)];
    Place best = place_;
    Spot best_spot = spot_;
    WalkStep best_step;
    const double rest = rest_length(moves == 0);
    bool rim = false;
    for (const std::uint32_t face : mesh.faces_of_vertex(vertex)) {
      Place here;
      here.frame = face == place_.frame.face ? place_.frame : faces_.frame(face);
      const TriangleMesh::Triangle& t = mesh.triangles()[face];
      here.u = t[1] == vertex ? 1.0 : 0.0;
      here.v = t[2] == vertex ? 1.0 : 0.0;
      ++moves;
      ++frames_;
      const Spot spot = faces_.evaluate(here.frame, here.u, here.v);
      const int own = t[0] == vertex ? 0 : (t[1] == vertex ? 1 : 2);
      const WalkStep options[3] = {step_at(here, spot, goal), step_along_edge(here, spot, goal, (own + 1) % 3),
                                   step_along_edge(here, spot, goal, (own + 2) % 3)};
      for (const WalkStep& option : options) {
        if (option.length <= best_step.length || !admissible(here, option)) continue;
        best = here;
        best_spot = spot;
        best_step = option;
      }
      for (int k = 1; k <= 2; ++k) rim = rim || mesh.neighbour(face, ((own + k) % 3 + 1) % 3) == no_index;
    }
    if (best_step.length <= rest) return rim && may_leave ? Turn::rim : Turn::rest;
    place_ = best;
    spot_ = best_spot;
    step = best_step;
    return Turn::go;
  }

  const Faces& faces_;
  Place& place_;
  Spot& spot_;
  std::uint32_t frames_ = 0;
};

}  // namespace asperity
