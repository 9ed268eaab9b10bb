#include "asperity/render/laws/mesostructure_intended.h"

#include <algorithm>

#include "asperity/render/contact/edge_band.h"
#include "asperity/render/touched_surface.h"
#include "asperity/surface/blend_option.h"

namespace asperity {

void MesostructureIntendedLaw::options(std::vector<Option>& rows) {
  using L = MesostructureIntendedLaw;
  rows.push_back(option("rho", &L::rho, OptionType::number({0.0, 1.0 / 3.0, true}),
                        "width of the blended band around edges in barycentric coordinates."));
  rows.push_back(blend_option(&L::blend, &L::blend_map));
  rows.push_back(option("prism_height", &L::prism_height,
                        OptionType::quantity(Dimension::length, Range::not_negative()),
                        "half height of the prisms, where it is more than that of the coat: how deep a probe may be "
                        "pressed; a flat coat is not felt without."));
}

Status MesostructureIntendedLaw::validate() const {
  return asperity::validate(Stitching{FoldMode::keep, blend, rho, blend_map});
}

LawForce MesostructureIntendedLaw::force(const TouchedSurface& touched, const Material& material, const Vec3& probe,
                                         const Vec3&, Seconds) const noexcept {
  const ReliefView& view = touched.touch().relief();
  const ReliefSurface& surface = view.surface();
  const TriangleMesh& mesh = surface.base().mesh();
  LawForce answer;
  const Prisms prisms(mesh, std::max(prism_height, surface.prisms().half_height()));
  const std::uint32_t owner = prism_owner(surface, prisms, probe);
  if (owner == no_index) return answer;
  const BarycentricFrame frame = barycentric_frame(mesh, owner);
  const Vec3 barycentric = frame.coordinates(probe);
  const CoatSample own = surface.coat_sample(owner, barycentric, view.moment());
  double height = own.height;
  Vec3 normal = own.normal;
  if (barycentric.minCoeff() < rho) {
    double total = 0.0;
    double heights = 0.0;
    Vec3 normals = Vec3::Zero();
    for_each_adjoining_face(mesh, owner, [&](std::uint32_t face) {
      const Vec3 coordinates = barycentric_frame(mesh, face).coordinates(probe);
      const double weight = band_weight(*this, coordinates);
      if (weight <= 0.0) return;
      const CoatSample sample = surface.coat_sample(face, coordinates, view.moment());
      heights += weight * sample.height;
      normals += weight * sample.normal;
      total += weight;
    });
    if (total > 0.0) {
      height = heights / total;
      normal = normals.normalized();
    }
  }
  answer.height = height;
  answer.element = owner;
  const double penetration = height - frame.height(probe);
  if (penetration <= 0.0) return answer;
  answer.contact = true;
  answer.penetration = penetration;
  answer.force = material.stiffness * penetration * normal;
  answer.normal = normal;
  answer.point = probe + penetration * normal;
  return answer;
}

}  // namespace asperity
