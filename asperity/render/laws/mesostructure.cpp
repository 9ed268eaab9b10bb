// Mesostructure-blended rendering: Algorithm 2 of hrm-2010.

#include "asperity/render/laws/mesostructure.h"

#include <algorithm>
#include <cmath>

#include "asperity/render/contact/shell_contact.h"
#include "asperity/render/touched_surface.h"
#include "asperity/surface/blend_option.h"

namespace asperity {

namespace {

/// Weight of one barycentric coordinate at t = (b + rho) / (2 rho).
double literal_blend(const MesostructureLaw& law, double barycentric) noexcept {
  const double t = std::clamp((barycentric + law.rho) / (2.0 * law.rho), 0.0, 1.0);
  switch (law.blend) {
    case Blend::none: return t >= 0.5 ? 1.0 : 0.0;
    case Blend::linear: return t;
    case Blend::s_shape: return t * t * (3.0 - 2.0 * t);
    case Blend::quintic: return t * t * t * (10.0 + t * (6.0 * t - 15.0));
    case Blend::image: break;
  }
  const double position = t * static_cast<double>(law.blend_map.size() - 1);
  const auto cell = std::min(static_cast<std::size_t>(position), law.blend_map.size() - 2);
  return law.blend_map[cell] + (law.blend_map[cell + 1] - law.blend_map[cell]) * (position - static_cast<double>(cell));
}

/// Weight of a face at the projection of the probe: product over its three coordinates (erratum 3).
double face_weight(const MesostructureLaw& law, const Vec3& barycentric) noexcept {
  double weight = 1.0;
  for (int k = 0; k < 3; ++k) weight *= literal_blend(law, barycentric[k]);
  return weight;
}

/// Lines 4 to 34 as printed, or with the band and the inclusion test of section 4.2, with three liberties that the text
/// leaves no way around: the weight function (undefined there), the normals turned from each face's tangent frame into
/// the object's, and of several prisms the one whose plane is nearest.
LawForce literal_force(const MesostructureLaw& law, const ReliefSurface& surface, double stiffness, const Vec3& probe,
                       const CoatMoment& moment) noexcept {
  const TriangleMesh& mesh = surface.base().mesh();
  const Prisms prisms = surface.prisms();
  std::uint32_t owner = no_index;
  double owner_distance = infinity;
  Box around;
  around.include(probe);
  surface.base().index().for_each_in_box(around.grown(prisms.half_height()), [&](std::uint32_t face) {
    if (!prisms.contains(face, probe)) return;
    const double distance = std::abs(barycentric_frame(mesh, face).height(probe));
    if (distance < owner_distance || (distance == owner_distance && face < owner)) {
      owner = face;
      owner_distance = distance;
    }
  });
  LawForce answer;
  if (owner == no_index) return answer;
  const Vec3 barycentric = barycentric_frame(mesh, owner).coordinates(probe);
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
      const double weight = face_weight(law, coordinates);
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
LawForce consistent_force(const ReliefView& view, double stiffness, const Vec3& probe, Contact& contact) noexcept {
  const ShellContact at = shell_contact(view, probe);
  if (!at.found) return {};
  const FieldSample sample = at.frame != nullptr ? view.surface().field(*at.frame, at.place) : view.eval(probe);
  return potential_contact(sample.value, sample.gradient, sample.height, sample.element, at.beyond_rim, stiffness,
                           probe, contact);
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
}

Status MesostructureLaw::validate() const {
  return asperity::validate(Stitching{FoldMode::keep, blend, rho, blend_map});
}

LawForce MesostructureLaw::force(const TouchedSurface& surface, const Material& material, const Vec3& probe,
                                 const Vec3&, Seconds) const noexcept {
  const ReliefView& view = surface.touch().relief();
  return formulation == Formulation::literal
             ? literal_force(*this, view.surface(), material.stiffness, probe, view.moment())
             : consistent_force(view, material.stiffness, probe, *surface.touch().contact);
}

}  // namespace asperity
