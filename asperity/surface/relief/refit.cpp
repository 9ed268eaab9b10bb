// A relief whose base moves: the same coat on the same triangles in other places.

#include <algorithm>

#include "asperity/surface/relief/surface.h"

namespace asperity {

Result<ReliefSurface> ReliefSurface::moved(MeshSurface base) const {
  if (base.index().lineage() != base_.index().lineage()) {
    return refused(ErrorCode::mismatch, "is not the base of this relief with its vertices moved", "base",
                   "a mesh that DeformableMesh made of the relief's own base");
  }
  ReliefSurface relief(std::move(base), coat_, rest_);
  ASPERITY_CHECK(relief.settle(settings_));
  return relief;
}

CoatSample ReliefSurface::coat_sample(std::uint32_t face, const Vec3& barycentric,
                                      const CoatMoment& moment) const noexcept {
  const auto& layers = coat_.layers();
  const bool placed =
      coat_.settings().mapping == Mapping::triplanar ||
      std::any_of(layers.begin(), layers.end(), [](const auto& layer) { return layer.solid != nullptr; });
  // Texture coordinates go with the triangles; places do not.
  if (!placed || rest_.index().identity() == base_.index().identity())
    return coat_.sample(base_.mesh(), face, barycentric, moment);
  const CoatSample there = coat_.sample(rest_.mesh(), face, barycentric, moment);
  // What a height changes by along the two edges is the triangle's own, wherever its corners lie.
  const auto corners = rest_.mesh().corners(face);
  const Vec3 edge_u = corners[1] - corners[0];
  const Vec3 edge_v = corners[2] - corners[0];
  const Vec3 up = rest_.mesh().face_normal(face);
  const BarycentricFrame here = barycentric_frame(base_.mesh(), face);
  const auto carried = [&](const Vec3& gradient) {
    return Vec3(gradient.dot(edge_u) * here.gradient[1] + gradient.dot(edge_v) * here.gradient[2]);
  };
  CoatSample sample = there;
  sample.gradient = carried(there.gradient);
  const double rise = there.normal.dot(up);
  if (rise > 0.0) sample.normal = (here.normal - carried(up - there.normal / rise)).normalized();
  return sample;
}

}  // namespace asperity
