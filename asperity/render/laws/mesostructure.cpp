// Mesostructure-blended rendering: Algorithm 2 of hrm-2010.

#include "asperity/render/laws/mesostructure.h"

#include <algorithm>
#include <cmath>

#include "asperity/render/contact/edge_band.h"
#include "asperity/render/contact/normal_map.h"
#include "asperity/render/contact/shell_contact.h"
#include "asperity/render/touched_surface.h"
#include "asperity/surface/blend_option.h"

namespace asperity {

namespace {

/// Lines 4 to 34 as printed, or with the band and the inclusion test of section 4.2, with three liberties that the text
/// leaves no way around: the weight function (undefined there), the normals turned from each face's tangent frame into
/// the object's, and of several prisms the one whose plane is nearest.
LawForce literal_force(const MesostructureLaw& law, const ReliefSurface& surface, double stiffness, const Vec3& probe,
                       const CoatMoment& moment) noexcept {
  const TriangleMesh& mesh = surface.base().mesh();
  const Prisms prisms = surface.prisms();
  LawForce answer;
  const std::uint32_t owner = prism_owner(surface, prisms, probe);
  if (owner == no_index) return answer;
  const BarycentricFrame own_frame = barycentric_frame(mesh, owner);
  const double owner_distance = std::abs(own_frame.height(probe));
  const Vec3 barycentric = own_frame.coordinates(probe);
  const CoatSample own = surface.coat_sample(owner, barycentric, moment);
  double height = own.height;
  Vec3 normal = own.normal;
  const bool in_band = law.test_neighbours ? barycentric.minCoeff() < law.rho : barycentric.maxCoeff() >= 1.0 - law.rho;
  if (in_band) {
    double total = 0.0;
    double height_sum = 0.0;
    Vec3 normal_sum = Vec3::Zero();
    for_each_adjoining_face(mesh, owner, [&](std::uint32_t face) {
      if (law.test_neighbours && face != owner && !prisms.contains(face, probe)) return;
      const BarycentricFrame frame = barycentric_frame(mesh, face);
      const Vec3 coordinates = frame.coordinates(probe);
      const double weight = band_weight(law, coordinates);
      if (weight <= 0.0) return;
      const CoatSample sample = surface.coat_sample(face, coordinates, moment);
      height_sum += weight * sample.height;
      normal_sum += weight * sample.normal;
      total += weight;
    });
    if (total > 0.0) {
      height = height_sum / total;
      normal = normal_sum / total;
    }
  }
  answer.height = height;
  answer.element = owner;
  const double penetration = height - owner_distance;
  if (penetration <= 0.0) return answer;
  answer.contact = true;
  answer.penetration = penetration;
  answer.force = stiffness * penetration * normal;
  answer.normal = normal.normalized();
  answer.point = probe + penetration * answer.normal;
  return answer;
}

/// Phi of the relief in shell coordinates (formulation D2, D3).
LawForce consistent_force(const MesostructureLaw& law, const Touched& touch, double stiffness,
                          const Vec3& probe) noexcept {
  const ReliefView& view = touch.relief();
  const ShellContact at = shell_contact(view, probe);
  if (!at.found) return {};
  const FieldSample sample = at.frame != nullptr ? view.surface().field(*at.frame, at.place) : view.eval(probe);
  LawForce answer = potential_contact(sample.value, sample.gradient, sample.height, sample.element, at.beyond_rim,
                                      stiffness, probe, *touch.contact);
  if (at.frame != nullptr)
    turn_by_normal_map(law.normal_map, touch, sample.element, at.place.barycentric(), false, answer);
  return answer;
}

}  // namespace

void MesostructureLaw::options(std::vector<Option>& rows) {
  using L = MesostructureLaw;
  const char* why = "the coat's \"stitching\" says how it blends";
  rows.push_back(option("rho", &L::rho, OptionType::number({0.0, 1.0 / 3.0, true}),
                        "width of the blended band around edges in barycentric coordinates.")
                     .of_printed_form(why));
  rows.push_back(blend_option(&L::blend, &L::blend_map).of_printed_form(why));
  rows.push_back(option("test_neighbours", &L::test_neighbours, OptionType::boolean(),
                        "every neighbouring prism that holds the probe has a say (hrm-2010, 4.2), not those in the "
                        "band alone.")
                     .of_printed_form(why));
  rows.push_back(normal_map_option(&L::normal_map));
}

Status MesostructureLaw::validate() const {
  ASPERITY_CHECK(check_normal_map(normal_map, formulation));
  return asperity::validate(Stitching{FoldMode::keep, blend, rho, blend_map});
}

LawForce MesostructureLaw::force(const TouchedSurface& surface, const Material& material, const Vec3& probe,
                                 const Vec3&, Seconds) const noexcept {
  const ReliefView& view = surface.touch().relief();
  return formulation == Formulation::literal
             ? literal_force(*this, view.surface(), material.stiffness, probe, view.moment())
             : consistent_force(*this, surface.touch(), material.stiffness, probe);
}

}  // namespace asperity
