#include "asperity/surface/mesh/view.h"

#include <algorithm>
#include <array>

namespace asperity {

namespace {

// Nearer to an edge the faces across it may hold a point as well, and a skin off one may be behind another.
constexpr double beside_in_skins = 8.0;

FlatFrame frame_of(const MeshSurface& surface, std::uint32_t face) noexcept {
  const TriangleMesh& mesh = surface.mesh();
  const auto [a, b, c] = mesh.corners(face);
  FlatFrame frame;
  frame.owner = surface.index().identity();
  frame.face = face;
  frame.corner = a;
  frame.along_u = b - a;
  frame.along_v = c - a;
  frame.front = mesh.face_normal(face);
  const double area = frame.along_u.cross(frame.along_v).norm();
  const double near = beside_in_skins * surface.skin() / area;
  frame.beside = near * Vec3((c - b).norm(), frame.along_v.norm(), frame.along_u.norm());
  return frame;
}

/// Whether all three corners lie beyond a plane by `margin` (m).
bool beyond(const std::array<Vec3, 3>& corners, const Vec3& point, const Vec3& outward, double margin) noexcept {
  double least = infinity;
  for (const Vec3& corner : corners) least = std::min(least, outward.dot(corner - point));
  return least > margin;
}

/// Whether the boxes of two triangles keep off each other by more than `margin` (m).
bool boxes_apart(const std::array<Vec3, 3>& one, const std::array<Vec3, 3>& other, double margin) noexcept {
  Box around_one;
  Box around_other;
  for (const Vec3& corner : one) around_one.include(corner);
  for (const Vec3& corner : other) around_other.include(corner);
  return !around_one.grown(margin).overlaps(around_other);
}

/// Whether a triangle lies wholly beyond a face's plane, beyond one of its edges, or has the face wholly beyond its own
/// plane, or keeps off its box: which of those farther off are asked is up to the tree.
bool apart(const TriangleMesh& mesh, const FlatFrame& frame, const std::array<Vec3, 3>& own, std::uint32_t face,
           double margin) noexcept {
  const std::array<Vec3, 3> other = mesh.corners(face);
  if (boxes_apart(own, other, margin)) return true;
  if (beyond(other, own[0], frame.front, margin) || beyond(other, own[0], -frame.front, margin)) return true;
  for (std::size_t k = 0; k < 3; ++k) {
    if (beyond(other, own[k], (own[(k + 1) % 3] - own[k]).cross(frame.front).normalized(), margin)) return true;
  }
  const Vec3 front = mesh.face_normal(face);
  return beyond(own, other[0], front, margin) || beyond(own, other[0], -front, margin);
}

/// Whether at least `count` triangles are known to have a vertex in common with a face, itself included.
bool at_least_around(const TriangleMesh& mesh, std::uint32_t face, std::size_t count) noexcept {
  // The face stands at three corners, and what is across its edges at two of them: one triangle an edge at most.
  if (mesh.report().nonmanifold_edges != 0) return false;
  std::size_t standing = 0;
  for (const std::uint32_t vertex : mesh.triangles()[face]) standing += mesh.faces_of_vertex(vertex).size();
  return count + 5 <= standing;
}

/// Whether no triangle but those around comes near a face.
bool lonely(const MeshSurface& surface, const FlatFrame& frame) noexcept {
  const TriangleMesh& mesh = surface.mesh();
  const auto triangles = mesh.triangles();
  const std::array<Vec3, 3> own = mesh.corners(frame.face);
  const double margin = 4.0 * surface.skin();
  FixedVector<std::uint32_t, 32> beside;
  bool all = true;
  surface.index().for_each_beside(frame.face, margin, [&](std::uint32_t face) { all = beside.push_back(face) && all; });
  // All of those around are among them.
  if (all && at_least_around(mesh, frame.face, beside.size())) return true;
  bool alone = true;
  const auto look_at = [&](std::uint32_t face) {
    if (!alone || share_vertex(triangles[face], triangles[frame.face])) return;
    alone = apart(mesh, frame, own, face, margin);
  };
  if (all) {
    for (const std::uint32_t face : beside) look_at(face);
  } else {
    surface.index().for_each_beside(frame.face, margin, look_at);
  }
  return alone;
}

void ask_whether_lonely(const MeshSurface& surface, FlatFrame& frame) noexcept {
  if (frame.asked) return;
  frame.asked = true;
  frame.lonely = lonely(surface, frame);
}

/// Makes ready what is across the edge that as much of a way again, and a half, would reach: the tick that gets there
/// has enough to do. (du, dv): the way along the face in this tick.
void look_ahead(const MeshSurface& surface, const FacePlace<FlatFrame>& at, double du, double dv,
                FlatAhead& ahead) noexcept {
  constexpr double ways = 1.5;
  const double change[3] = {-du - dv, du, dv};
  for (int k = 0; k < 3; ++k) {
    if (!(change[k] < 0.0) || at.coordinate(k) + ways * change[k] > 0.0) continue;
    const int edge = (k + 1) % 3;
    if (ahead.from == at.frame.face && ahead.edge == edge && ahead.frame.owner == at.frame.owner) return;
    const std::uint32_t face = surface.mesh().neighbour(at.frame.face, edge);
    ahead = {at.frame.face, edge, {}};
    ahead.frame.owner = at.frame.owner;
    if (face == no_index) return;
    ahead.frame = frame_of(surface, face);
    ask_whether_lonely(surface, ahead.frame);
    return;
  }
}

/// The faces of a mesh.
struct FlatFaces {
  using Frame = FlatFrame;
  using Spot = FlatSpot;

  const TriangleView& view;
  double side;
  Sides sides;
  const FlatFrame& ahead;
  bool& blocked;

  [[nodiscard]] const TriangleMesh& mesh() const noexcept { return view.surface().mesh(); }
  [[nodiscard]] FlatFrame frame(std::uint32_t face) const noexcept {
    if (ahead.face == face && ahead.owner == view.surface().index().identity()) return ahead;
    return frame_of(view.surface(), face);
  }
  [[nodiscard]] static FlatSpot evaluate(const FlatFrame& frame, double u, double v) noexcept { return frame.at(u, v); }
  [[nodiscard]] static WalkForms forms(const FacePlace<FlatFrame>&, const FlatSpot& spot, const Vec3& goal) noexcept {
    const Vec3 rest = spot.point - goal;
    WalkForms f;
    f.g_u = spot.along_u.dot(rest);
    f.g_v = spot.along_v.dot(rest);
    f.uu = f.h_uu = spot.along_u.squaredNorm();
    f.uv = f.h_uv = spot.along_u.dot(spot.along_v);
    f.vv = f.h_vv = spot.along_v.squaredNorm();
    return f;
  }
  [[nodiscard]] static double curvature(const FacePlace<FlatFrame>&, const FlatSpot&, double, double,
                                        const Vec3&) noexcept {
    return 0.0;
  }
  [[nodiscard]] double rest_length(bool) const noexcept { return 1e-3 * view.skin(); }
  [[nodiscard]] static double stride() noexcept { return infinity; }
  [[nodiscard]] static bool jumps() noexcept { return false; }

  /// What is next to the face is met at the ends of the way, and walked onto there.
  [[nodiscard]] bool free(FlatFrame& frame, const FlatSpot& from, const FlatSpot& to) const noexcept {
    ask_whether_lonely(view.surface(), frame);
    if (frame.lonely) return true;
    const double skin = view.skin();
    const Vec3 off = skin * (side * frame.front);
    const Segment motion{from.point + off, to.point + off};
    const SweptHit hit = view.sweep(motion, 0.0, sides);
    if (!hit.hit) return true;
    const double length = (motion.to - motion.from).norm();
    const double near = 8.0 * skin;
    if (hit.t * length <= near || (1.0 - hit.t) * length <= near) return true;
    blocked = true;
    return false;
  }
};

}  // namespace

SweptHit TriangleView::first_touch(const Segment& motion, Sides sides) const noexcept {
  SweptHit hit = sweep(motion, 0.0, sides);
  if (hit.hit) hit.side = hit.contact.normal.dot(surface_->mesh().face_normal(hit.contact.element)) < 0.0 ? -1.0 : 1.0;
  return hit;
}

void TriangleView::make_frame(std::uint32_t face) const noexcept {
  cache_->flat.frame = frame_of(*surface_, face);
}

bool TriangleView::meet(std::uint32_t face, std::uint32_t other) const noexcept {
  const auto triangles = surface_->mesh().triangles();
  return share_vertex(triangles[face], triangles[other]);
}

void TriangleView::around(const Place& place, ContactSet& out) const noexcept {
  const TriangleMesh& mesh = surface_->mesh();
  const TriangleMesh::Triangle& own = mesh.triangles()[place.element];
  const FlatFrame& here = frame(place.element);
  for (int k = 0; k < 3; ++k) {
    if (place.at[k] > on_border && place.at[k] <= here.beside[k]) return;
  }
  const Vec3 point = here.at(place.at[1], place.at[2]).point;
  int nearest = 0;
  place.at.maxCoeff(&nearest);
  for (const std::uint32_t face : mesh.faces_of_vertex(own[static_cast<std::size_t>(nearest)])) {
    const TriangleMesh::Triangle& theirs = mesh.triangles()[face];
    Vec3 at = Vec3::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      const auto same = std::find(theirs.begin(), theirs.end(), own[k]);
      if (same != theirs.end()) at[same - theirs.begin()] = place.at[static_cast<int>(k)];
    }
    // The others have but one end of the edge.
    if (at.sum() < 1.0 - 2.0 * on_border) continue;
    if (out.push_back({point, place.side() * mesh.face_normal(face), 0.0, face, at})) continue;
    out.clear();
    return;
  }
}

void TriangleView::beside_border(const Place& place, ContactSet& out) const noexcept {
  frame(place.element);
  FlatFrame& here = cache_->flat.frame;
  ask_whether_lonely(*surface_, here);
  if (here.lonely) around(place, out);
}

bool TriangleView::may_launch(const Place& place, const FlatSpot& spot) const noexcept {
  constexpr double least_above = 0.5;
  if (within_face(place)) return true;
  ContactSet feet;
  around(place, feet);
  const Vec3 off = place.side() * spot.front;
  const auto behind = [&](const Foot& foot) {
    if (foot.normal.dot(off) >= least_above) return false;
    // Beyond a ridge it is not in the way.
    const auto corners = surface_->mesh().corners(foot.element);
    return std::any_of(corners.begin(), corners.end(),
                       [&](const Vec3& corner) { return off.dot(corner - spot.point) > skin(); });
  };
  return !feet.empty() && std::none_of(feet.begin(), feet.end(), behind);
}

DescentEnd TriangleView::descend(Place& place, FlatSpot& spot, const Goal& goal) const noexcept {
  bool blocked = false;
  const FlatFaces faces{*this, place.side(), goal.sides, cache_->ahead.frame, blocked};
  frame(place.element);
  FacePlace<FlatFrame>& at = cache_->flat;
  at.u = place.at[1];
  at.v = place.at[2];
  FaceChart<FlatFaces> chart(faces, at, spot);
  Walk<FaceChart<FlatFaces>> walk(chart, goal, place.side());
  const DescentEnd end = walk.run();
  tell(cache_->work, {walk.moves(), 0, chart.frames()});
  if (walk.moves() > 0 && at.frame.face == place.element)
    look_ahead(*surface_, at, at.u - place.at[1], at.v - place.at[2], cache_->ahead);
  place.element = at.frame.face;
  place.at = {1.0 - at.u - at.v, at.u, at.v};
  return blocked ? DescentEnd::blocked : end;
}

}  // namespace asperity
