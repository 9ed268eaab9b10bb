// A relief whose base moves: the same coat on the same triangles in other places.

#include <algorithm>

#include "asperity/core/parallel_for.h"
#include "asperity/surface/relief/detail/carried.h"

namespace asperity {

void ReliefSurface::carry() const {
  // Heights that may be anything within the coat's are enclosed without asking the coat.
  if (any_height()) return;
  std::call_once(carried_->once, [&] {
    const FacePart whole = FacePart::triangle(whole_triangle[0], whole_triangle[1], whole_triangle[2]);
    const auto levels = static_cast<std::size_t>(coat_.levels()) + 1;
    std::vector<CarriedHeight> heights(rest_.mesh().triangles().size() * levels);
    parallel_for(heights.size(), {.grain = 256}, [&](std::size_t i) {
      const CoatMoment moment{static_cast<double>(i % levels), 0.0};
      const CoatFrame frame = coat_.frame(rest_.mesh(), static_cast<std::uint32_t>(i / levels), moment);
      heights[i] = {coat_.range(frame, whole_triangle), coat_.form(frame, whole)};
    });
    carried_->heights = std::move(heights);
    carried_->bytes = carried_->heights.capacity() * sizeof(CarriedHeight);
  });
}

Result<ReliefSurface> ReliefSurface::moved(MeshSurface base) const {
  if (base.index().lineage() != base_.index().lineage()) {
    return refused(ErrorCode::mismatch, "is not the base of this relief with its vertices moved", "base",
                   "a mesh that DeformableMesh made of the relief's own base");
  }
  carry();
  ReliefSurface relief(std::move(base), coat_, rest_, carried_);
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
