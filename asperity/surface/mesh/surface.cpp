#include "asperity/surface/mesh/surface.h"

namespace asperity {

Result<std::shared_ptr<const MeshSurface>> make_mesh_surface(MeshSource source, const MeshBuildSettings& settings) {
  ASPERITY_TRY(TriangleMesh mesh, TriangleMesh::build(std::move(source), settings));
  return std::make_shared<const MeshSurface>(TriangleIndex::build(std::move(mesh)));
}

Vec3 pseudonormal(const TriangleMesh& mesh, std::uint32_t face, const Vec3& barycentric) noexcept {
  const Vec3 own = mesh.face_normal(face);
  int zeros = 0;
  for (int i = 0; i < 3; ++i) zeros += barycentric[i] <= 0.0 ? 1 : 0;
  if (zeros == 0) return own;
  const TriangleMesh::Triangle& corners = mesh.triangles()[face];
  if (zeros == 2) {
    for (std::size_t i = 0; i < 3; ++i) {
      if (barycentric[static_cast<int>(i)] > 0.0) return mesh.vertex_normal(corners[i]);
    }
  }
  for (int i = 0; i < 3; ++i) {
    if (barycentric[i] > 0.0) continue;
    const std::uint32_t other = mesh.neighbour(face, (i + 1) % 3);
    return other == no_index ? own : Vec3(own + mesh.face_normal(other));
  }
  return own;
}

namespace {

bool boundary_vertex(const TriangleMesh& mesh, std::uint32_t vertex) noexcept {
  for (const std::uint32_t face : mesh.faces_of_vertex(vertex)) {
    for (int edge = 0; edge < 3; ++edge) {
      const TriangleMesh::Triangle& corners = mesh.triangles()[face];
      const bool touches = corners[static_cast<std::size_t>(edge)] == vertex ||
                           corners[static_cast<std::size_t>((edge + 1) % 3)] == vertex;
      if (touches && mesh.neighbour(face, edge) == no_index) return true;
    }
  }
  return false;
}

bool on_boundary(const TriangleMesh& mesh, const Foot& foot) noexcept {
  for (int k = 0; k < 3; ++k) {
    if (foot.at[k] >= 1.0) return boundary_vertex(mesh, mesh.triangles()[foot.element][static_cast<std::size_t>(k)]);
  }
  for (int k = 0; k < 3; ++k) {
    if (foot.at[k] <= 0.0 && mesh.neighbour(foot.element, (k + 1) % 3) == no_index) return true;
  }
  return false;
}

}  // namespace

bool beyond_rim(const TriangleMesh& mesh, const Foot& foot, const Vec3& probe, double skin) noexcept {
  if (foot.at.minCoeff() > 0.0 || !on_boundary(mesh, foot)) return false;
  const Vec3 normal = mesh.face_normal(foot.element);
  const Vec3 offset = probe - foot.point;
  return (offset - offset.dot(normal) * normal).norm() > skin;
}

Vec3 interpolated_normal(const TriangleMesh& mesh, std::uint32_t face, const Vec3& barycentric) noexcept {
  const TriangleMesh::Triangle& corners = mesh.triangles()[face];
  const Vec3 sum = barycentric[0] * mesh.vertex_normal(corners[0]) + barycentric[1] * mesh.vertex_normal(corners[1]) +
                   barycentric[2] * mesh.vertex_normal(corners[2]);
  const double length = sum.norm();
  return length > 0.0 ? Vec3(sum / length) : mesh.face_normal(face);
}

FieldSample MeshSurface::eval(const Vec3& p, SurfaceCache& cache) const noexcept {
  const Foot nearest = index_.closest(p, infinity, cache.patch);
  FieldSample sample;
  if (!nearest.found()) return sample;
  const bool outside = (p - nearest.point).dot(pseudonormal(mesh(), nearest.element, nearest.at)) >= 0.0;
  sample.value = outside ? nearest.distance : -nearest.distance;
  sample.gradient = outside ? nearest.normal : Vec3(-nearest.normal);
  // On the face itself the normal is the face's own, whichever side it was taken from.
  if (nearest.distance == 0.0) sample.gradient = mesh().face_normal(nearest.element);
  sample.element = nearest.element;
  return sample;
}

}  // namespace asperity
