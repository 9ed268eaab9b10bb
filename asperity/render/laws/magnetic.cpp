#include "asperity/render/laws/magnetic.h"

#include "asperity/core/option.h"
#include "asperity/render/contact/contact_point.h"
#include "asperity/render/local_material.h"
#include "asperity/render/touched_surface.h"

namespace asperity {

namespace {

LawForce printed_pull(const ImplicitSurface& surface, const Potential& here, const Material& own, const Vec3& probe,
                      const Vec3& velocity, HeldPoint& state) noexcept {
  leave_contact_point(state);
  const double slope = here.gradient.norm();
  if (!(slope > 0.0)) return {};
  const double f = here.value - surface.offset();
  LawForce answer;
  answer.contact = true;
  answer.damped = true;
  answer.normal = here.gradient / slope;
  answer.point = probe - f * answer.normal;
  answer.penetration = -f;
  const Material material = material_at(surface, own, answer.point, state.cache.sparse);
  answer.force = -material.stiffness * f * answer.normal - material.damping * velocity;
  return answer;
}

}  // namespace

void MagneticLaw::options(std::vector<Option>& rows) {
  rows.push_back(option("band", &MagneticLaw::band, OptionType::quantity(Dimension::length, Range::positive()),
                        "width of the band outside the surface that attracts."));
}

LawForce MagneticLaw::force(const TouchedSurface& touched, const Material& material, const Vec3& probe,
                            const Vec3& velocity, Seconds dt, State& memory) const noexcept {
  const ImplicitSurface& surface = touched.touch().implicit();
  return ask_contact_point(touched.touch(), memory, probe, [&](HeldPoint& state) -> LawForce {
    if (formulation == Formulation::consistent)
      return potential_push({touched.probe_radius(), band, 0.0}, surface, material, probe, velocity, dt, state);
    const Potential here = surface.grid().node_gradients(probe, state.cache.sparse);
    const double f = here.value - surface.offset();
    if (f >= 0.0) {
      state.seen_outside = true;
      if (f < band) return printed_pull(surface, here, material, probe, velocity, state);
      leave_contact_point(state);
      return {};
    }
    return printed_push(surface, ContactMagnitude::distance, 0.0, 0.0, here, material, probe, velocity, state);
  });
}

}  // namespace asperity
