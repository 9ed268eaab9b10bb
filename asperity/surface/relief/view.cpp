#include "asperity/surface/relief/view.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "asperity/surface/face_chart.h"
#include "asperity/surface/tangents.h"

namespace asperity {

namespace {

// A step below these shares of the relief's grain and of the mean edge is not worth making, once one has been made.
constexpr double relief_rest_of_grain = 5e-4;
constexpr double rest_of_edge = 5e-6;
// Where the nearest point itself is asked for: Newton's next step would be as small against this one as this one is.
constexpr double exact_rest = 1e-3;
// The first one always is, unless the probe has not moved at all.
constexpr double first_rest_of_grain = 1e-10;
// Distance (in grains) between places where the way is checked.
constexpr double stride_of_grain = 0.75;

/// A relief over its faces, at the moment of the frame that the walk starts with.
struct ReliefFaces {
  using Frame = ReliefFrame;
  using Spot = ReliefPoint;

  const ReliefSurface& surface;
  CoatMoment moment;
  WorkCount& count;
  std::uint32_t before = count.evaluations;
  bool exactly = false;
  double rest =
      (exactly ? exact_rest : 1.0) * std::min(relief_rest_of_grain * surface.grain(), rest_of_edge* mesh().mean_edge());
  double first_rest = std::min(first_rest_of_grain * surface.grain(), rest);

  [[nodiscard]] const TriangleMesh& mesh() const noexcept { return surface.base().mesh(); }
  [[nodiscard]] ReliefFrame frame(std::uint32_t face) const noexcept { return surface.frame(face, moment); }
  [[nodiscard]] ReliefPoint evaluate(const ReliefFrame& frame, double u, double v) const noexcept {
    return surface.point(frame, u, v, count.evaluations);
  }
  void squared_distances(const ReliefFrame& frame, const Lanes& u, const Lanes& v, const Vec3& goal,
                         Lanes& squares) const noexcept {
    surface.squared_distances(frame, u, v, goal, squares);
  }
  [[nodiscard]] double squared_distance(const ReliefFrame& frame, double u, double v, const Vec3& goal) const noexcept {
    return surface.squared_distance(frame, u, v, goal);
  }
  void look(const ReliefFrame& frame, double u, double v) const noexcept {
    count.evaluations += surface.heights_at(frame, u, v);
  }
  [[nodiscard]] std::uint32_t work() const noexcept { return count.evaluations - before; }
  [[nodiscard]] static WalkForms forms(const ReliefPlace& place, const ReliefPoint& spot, const Vec3& goal) noexcept {
    const ShellPrism& prism = place.frame.prism;
    const Vec3 rest = spot.point - goal;
    const double n = spot.direction.dot(rest);
    const double turn_u = prism.turn_u.dot(rest);
    const double turn_v = prism.turn_v.dot(rest);
    WalkForms f;
    f.g_u = spot.along_u.dot(rest);
    f.g_v = spot.along_v.dot(rest);
    f.uu = spot.along_u.squaredNorm();
    f.uv = spot.along_u.dot(spot.along_v);
    f.vv = spot.along_v.squaredNorm();
    f.h_uu = f.uu + spot.jet.uu * n + 2.0 * spot.jet.u * turn_u;
    f.h_uv = f.uv + spot.jet.uv * n + spot.jet.u * turn_v + spot.jet.v * turn_u;
    f.h_vv = f.vv + spot.jet.vv * n + 2.0 * spot.jet.v * turn_v;
    return f;
  }
  [[nodiscard]] static double curvature(const ReliefPlace& place, const ReliefPoint& spot, double du, double dv,
                                        const Vec3& rest) noexcept {
    const ShellPrism& prism = place.frame.prism;
    const double bend = du * du * spot.jet.uu + 2.0 * du * dv * spot.jet.uv + dv * dv * spot.jet.vv;
    const double slope = du * spot.jet.u + dv * spot.jet.v;
    const Vec3 turn = du * prism.turn_u + dv * prism.turn_v;
    return bend * spot.direction.dot(rest) + 2.0 * slope * turn.dot(rest);
  }
  [[nodiscard]] double rest_length(bool first) const noexcept { return first ? first_rest : rest; }
  [[nodiscard]] double stride() const noexcept { return stride_of_grain * surface.grain(); }
  [[nodiscard]] bool jumps() const noexcept { return surface.has_jumps(); }
  [[nodiscard]] static bool free(const ReliefFrame&, const ReliefPoint&, const ReliefPoint&) noexcept { return true; }
};

/// The edge, or the corner, of its triangle that a place lies at; -1: none.
struct Border {
  int edge = -1;
  int corner = -1;
};

Border border_within(double room, const TriangleMesh& mesh, const Place& place) noexcept {
  const BarycentricFrame base = barycentric_frame(mesh, place.element);
  Border border;
  int near = 0;
  int far = 0;
  for (int k = 0; k < 3; ++k) {
    if (place.at[k] > room * base.gradient[k].norm()) {
      far = k;
    } else {
      ++near;
      border.edge = (k + 1) % 3;
    }
  }
  if (near > 1) border = {-1, far};
  return border;
}

/// The same place of an edge or a corner on another face around it.
Vec3 shared_place(const TriangleMesh& mesh, const Place& place, const Border& border, std::uint32_t face) noexcept {
  const TriangleMesh::Triangle& corners = mesh.triangles()[place.element];
  Vec3 there = Vec3::Zero();
  const auto put = [&](int corner, double share) {
    there[static_cast<int>(mesh.corner_of(face, corners[static_cast<std::size_t>(corner)]))] = share;
  };
  if (border.corner >= 0) {
    put(border.corner, 1.0);
  } else {
    for (const int end : {border.edge, (border.edge + 1) % 3}) put(end, place.at[end]);
  }
  return there;
}

}  // namespace

DescentEnd descend(const ReliefSurface& surface, ReliefPlace& place, ReliefPoint& spot, double side, const Goal& goal,
                   WorkCount& count) noexcept {
  const ReliefFaces faces{surface, place.frame.coat.moment, count, count.evaluations, goal.exactly};
  FaceChart<ReliefFaces> chart(faces, place, spot);
  Walk<FaceChart<ReliefFaces>> walk(chart, goal, side);
  const DescentEnd end = walk.run();
  count.frames += chart.frames();
  return end;
}

DescentEnd ReliefView::descend(Place& place, ReliefPoint& spot, const Goal& goal) const noexcept {
  ReliefCache& cache = hold(place.element);
  cache.place.u = place.at[1];
  cache.place.v = place.at[2];
  WorkCount count;
  const DescentEnd end = asperity::descend(*surface_, cache.place, spot, place.side(), goal, count);
  tell(cache_->work, count);
  cache.spot = spot;
  cache.evaluated = true;
  if (cache_->blocks != nullptr) keep(cache.place, spot);
  place.element = cache.place.frame.face;
  place.at = {1.0 - cache.place.u - cache.place.v, cache.place.u, cache.place.v};
  return end;
}

Vec3 ReliefView::way_off(const Place& place, const ReliefPoint& spot) const noexcept {
  // In a valley sharper than a right angle the normal of one flank leads into the other.
  constexpr double near_skins = 4.0;
  constexpr double least_product = 0.01;
  constexpr int most_rounds = 16;
  const TriangleMesh& mesh = surface_->base().mesh();
  Vec3 away = place.side() * spot.front;
  const Border border = border_within(near_skins * skin(), mesh, place);
  std::uint32_t across[2] = {place.element, place.element};
  std::span<const std::uint32_t> around;
  if (border.corner >= 0) {
    around = mesh.faces_of_vertex(mesh.triangles()[place.element][static_cast<std::size_t>(border.corner)]);
  } else if (border.edge >= 0 && mesh.neighbour(place.element, border.edge) != no_index) {
    across[1] = mesh.neighbour(place.element, border.edge);
    around = across;
  }
  bool turned = !around.empty();
  for (int round = 0; turned && round < most_rounds; ++round) {
    turned = false;
    for (const std::uint32_t face : around) {
      const Vec3 there = shared_place(mesh, place, border, face);
      const Vec3 front = place.side() * surface_->point(surface_->frame(face, moment_), there[1], there[2]).front;
      if (front.dot(away) >= least_product) continue;
      away = (away + front).normalized();
      turned = true;
    }
  }
  return away;
}

Mat3 ReliefView::bend(const Place& place, const ReliefPoint& spot) const noexcept {
  const ShellPrism& prism = frame(place.element).prism;
  const Vec3& direction = spot.direction;
  const HeightJet& h = spot.jet;
  const double uu = spot.front.dot(h.uu * direction + 2.0 * h.u * prism.turn_u);
  const double uv = spot.front.dot(h.uv * direction + h.u * prism.turn_v + h.v * prism.turn_u);
  const double vv = spot.front.dot(h.vv * direction + 2.0 * h.v * prism.turn_v);
  return shape_operator(spot.along_u, spot.along_v, uu, uv, vv);
}

}  // namespace asperity
