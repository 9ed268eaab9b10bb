#include "asperity/surface/mesh/view.h"

#include <algorithm>
#include <array>

namespace asperity {

namespace {

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
  return frame;
}

/// Whether all three corners lie beyond a plane by `margin` (m).
bool beyond(const std::array<Vec3, 3>& corners, const Vec3& point, const Vec3& outward, double margin) noexcept {
  double least = infinity;
  for (const Vec3& corner : corners) least = std::min(least, outward.dot(corner - point));
  return least > margin;
}

/// Whether no triangle but those around comes near a face: each lies wholly beyond its plane, beyond one of its edges,
/// or has the face wholly beyond its own plane.
bool lonely(const MeshSurface& surface, const FlatFrame& frame) noexcept {
  const TriangleMesh& mesh = surface.mesh();
  const auto triangles = mesh.triangles();
  const std::array<Vec3, 3> own = mesh.corners(frame.face);
  const double margin = 4.0 * surface.skin();
  Box box;
  for (const Vec3& corner : own) box.include(corner);
  bool alone = true;
  surface.index().for_each_in_box(box.grown(margin), [&](std::uint32_t face) {
    if (!alone || share_vertex(triangles[face], triangles[frame.face])) return;
    const std::array<Vec3, 3> other = mesh.corners(face);
    bool apart = beyond(other, own[0], frame.front, margin) || beyond(other, own[0], -frame.front, margin);
    for (std::size_t k = 0; k < 3 && !apart; ++k)
      apart = beyond(other, own[k], (own[(k + 1) % 3] - own[k]).cross(frame.front).normalized(), margin);
    if (!apart) {
      const Vec3 front = mesh.face_normal(face);
      apart = beyond(own, other[0], front, margin) || beyond(own, other[0], -front, margin);
    }
    alone = apart;
  });
  return alone;
}

/// The faces of a mesh.
struct FlatFaces {
  using Frame = FlatFrame;
  using Spot = FlatSpot;

  const TriangleView& view;
  double side;
  Sides sides;
  bool& blocked;

  [[nodiscard]] const TriangleMesh& mesh() const noexcept { return view.surface().mesh(); }
  [[nodiscard]] FlatFrame frame(std::uint32_t face) const noexcept { return frame_of(view.surface(), face); }
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
    if (!frame.asked) {
      frame.asked = true;
      frame.lonely = lonely(view.surface(), frame);
    }
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

const FlatFrame& TriangleView::frame(std::uint32_t face) const noexcept {
  FlatFrame& last = cache_->flat.frame;
  if (last.face != face || last.owner != surface_->index().identity()) last = frame_of(*surface_, face);
  return last;
}

DescentEnd TriangleView::descend(Place& place, FlatSpot& spot, const Goal& goal) const noexcept {
  bool blocked = false;
  const FlatFaces faces{*this, place.side(), goal.sides, blocked};
  frame(place.element);
  FacePlace<FlatFrame>& at = cache_->flat;
  at.u = place.at[1];
  at.v = place.at[2];
  FaceChart<FlatFaces> chart(faces, at, spot);
  Walk<FaceChart<FlatFaces>> walk(chart, goal, place.side());
  const DescentEnd end = walk.run();
  tell(cache_->work, {walk.moves(), 0, chart.frames()});
  place.element = at.frame.face;
  place.at = {1.0 - at.u - at.v, at.u, at.v};
  return blocked ? DescentEnd::blocked : end;
}

}  // namespace asperity
