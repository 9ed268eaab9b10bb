#include "asperity/surface/relief/prisms.h"

#include <algorithm>

namespace asperity {

namespace {

bool tetrahedron_contains(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) noexcept {
  const auto volume = [](const Vec3& u, const Vec3& v, const Vec3& w) { return u.dot(v.cross(w)); };
  const double whole = volume(b - a, c - a, d - a);
  if (whole == 0.0) return false;
  const double sign = whole > 0.0 ? 1.0 : -1.0;
  return sign * volume(b - p, c - p, d - p) >= 0.0 && sign * volume(p - a, c - a, d - a) >= 0.0 &&
         sign * volume(b - a, p - a, d - a) >= 0.0 && sign * volume(b - a, c - a, p - a) >= 0.0;
}

}  // namespace

bool Prisms::contains(std::uint32_t face, const Vec3& p) const noexcept {
  TriangleMesh::Triangle order = mesh_->triangles()[face];
  // Walking the vertices in ascending order gives every side the diagonal from its smaller vertex (below) to its larger
  // one (above), whichever of the two prisms is asked.
  std::sort(order.begin(), order.end());
  Vec3 low[3];
  Vec3 high[3];
  Box around;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 offset = half_height_ * mesh_->vertex_normal(order[i]);
    low[i] = mesh_->positions()[order[i]] - offset;
    high[i] = mesh_->positions()[order[i]] + offset;
    around.include(low[i]);
    around.include(high[i]);
  }
  if (around.distance(p) > 0.0) return false;
  return tetrahedron_contains(p, low[0], low[1], low[2], high[2]) ||
         tetrahedron_contains(p, low[0], low[1], high[1], high[2]) ||
         tetrahedron_contains(p, low[0], high[0], high[1], high[2]);
}

}  // namespace asperity
