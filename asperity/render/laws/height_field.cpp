// Height-field rendering over base triangles: haptic-textures-2005, 3.3, and Algorithm 1 of hrm-2010.

#include "asperity/render/laws/height_field.h"

#include <cmath>

#include "asperity/core/option.h"
#include "asperity/render/contact/normal_map.h"
#include "asperity/render/contact/shell_contact.h"
#include "asperity/render/touched_surface.h"

namespace asperity {

namespace {

struct Taper {
  double factor = 1.0;
  double by_u = 0.0;  ///< its change with the barycentric coordinates of the second and third corner
  double by_v = 0.0;
};

/// Falls from 1 to 0 over the outer `width` of each barycentric coordinate, smoothly.
Taper edge_taper(double width, const Vec3& barycentric) noexcept {
  Taper taper;
  if (width <= 0.0) return taper;
  double value[3];
  double slope[3];
  for (int k = 0; k < 3; ++k) {
    const double t = std::clamp(barycentric[k] / width, 0.0, 1.0);
    value[k] = t * t * (3.0 - 2.0 * t);
    slope[k] = 6.0 * t * (1.0 - t) / width;
  }
  taper.factor = value[0] * value[1] * value[2];
  const double by[3] = {slope[0] * value[1] * value[2], value[0] * slope[1] * value[2], value[0] * value[1] * slope[2]};
  taper.by_u = by[1] - by[0];
  taper.by_v = by[2] - by[0];
  return taper;
}

/// As printed: among the prisms that hold the probe, the one whose height field it is deepest under (2005: "the
/// algorithm compares the heights in the textures of both triangles").
LawForce literal_force(const HeightFieldLaw& law, const ReliefSurface& surface, double stiffness, const Vec3& probe,
                       const CoatMoment& moment) noexcept {
  const TriangleMesh& mesh = surface.base().mesh();
  const Prisms prisms = surface.prisms();
  LawForce answer;
  Box around;
  around.include(probe);
  surface.base().index().for_each_in_box(around.grown(prisms.half_height()), [&](std::uint32_t face) {
    if (!prisms.contains(face, probe)) return;
    const BarycentricFrame frame = barycentric_frame(mesh, face);
    const Vec3 barycentric = frame.coordinates(probe);
    const double height =
        edge_taper(law.edge_taper, barycentric).factor * surface.coat_sample(face, barycentric, moment).height;
    const double above = frame.height(probe);
    const double penetration = height - (law.negative_heights ? above : std::abs(above));
    const bool deeper =
        penetration > answer.penetration || (penetration == answer.penetration && face < answer.element);
    if (penetration <= 0.0 || !deeper) return;
    answer.contact = true;
    answer.force = stiffness * penetration * frame.normal;
    answer.point = probe + penetration * frame.normal;
    answer.normal = frame.normal;
    answer.penetration = penetration;
    answer.height = height;
    answer.element = face;
  });
  return answer;
}

/// h - H in shell coordinates, with the owner's own heights.
LawForce consistent_force(const HeightFieldLaw& law, const Touched& touch, double stiffness,
                          const Vec3& probe) noexcept {
  const ReliefView& view = touch.relief();
  const ShellContact at = shell_contact(view, probe);
  if (!at.found) return {};
  FieldSample sample = at.frame != nullptr ? view.surface().own_field(*at.frame, at.place) : view.eval(probe);
  if (at.frame != nullptr && law.edge_taper > 0.0) {
    // Phi = h - taper H: what own_field gave is h - H.
    const Taper taper = edge_taper(law.edge_taper, at.place.barycentric());
    const double height = sample.height;
    const ShellGradients gradients = shell_gradients(at.frame->prism, at.place);
    const Vec3 height_gradient = gradients.height - sample.gradient;
    const Vec3 taper_gradient = taper.by_u * gradients.u + taper.by_v * gradients.v;
    sample.value = at.place.height - taper.factor * height;
    sample.gradient = gradients.height - taper.factor * height_gradient - height * taper_gradient;
    sample.height = taper.factor * height;
  }
  LawForce answer = potential_contact(sample.value, sample.gradient, sample.height, sample.element, at.beyond_rim,
                                      stiffness, probe, *touch.contact);
  if (at.frame != nullptr)
    turn_by_normal_map(law.normal_map, touch, sample.element, at.place.barycentric(), false, answer);
  return answer;
}

}  // namespace

void HeightFieldLaw::options(std::vector<Option>& rows) {
  rows.push_back(option("negative_heights", &HeightFieldLaw::negative_heights, OptionType::boolean(),
                        "heights below 0 are met, as the 2005 paper's scratches are.")
                     .of_printed_form("which meets them in any case"));
  rows.push_back(normal_map_option(&HeightFieldLaw::normal_map));
  rows.push_back(option("edge_taper", &HeightFieldLaw::edge_taper, OptionType::number({0.0, 1.0 / 3.0}),
                        "share of each triangle over which heights fall to 0 towards its edges; 0 turns it off.")
                     .or_else("0; 0.05 for height-field-literal"));
}

LawForce HeightFieldLaw::force(const TouchedSurface& surface, const Material& material, const Vec3& probe, const Vec3&,
                               Seconds) const noexcept {
  const ReliefView& view = surface.touch().relief();
  return formulation == Formulation::literal
             ? literal_force(*this, view.surface(), material.stiffness, probe, view.moment())
             : consistent_force(*this, surface.touch(), material.stiffness, probe);
}

}  // namespace asperity
