// Isosurfaces from the field's value at the probe alone: Avila and Sobierajski 1996 as large-data-2008 has it (M1).

#include <algorithm>
#include <cmath>

#include "asperity/render/laws/forces.h"

namespace asperity {

namespace {

/// As printed: d_i < d < d_j are the layer's lower and upper value, N the gradient, R along the motion.
LawForce literal_force(const AvilaLaw& law, const IsoView& view, double band, const FieldJet& jet, const Vec3& probe,
                       const Vec3& velocity) noexcept {
  LawForce answer;
  const double low = view.sigma > 0.0 ? view.threshold - band : view.threshold;
  const double high = view.sigma > 0.0 ? view.threshold : view.threshold + band;
  const double slope = jet.gradient.norm();
  if (!(low < jet.value && jet.value < high) || !(slope > 0.0)) return answer;
  const double share = (jet.value - low) / (high - low);
  const double stiff = law.largest_force * share;                              // eq. 8, f_s
  const double retarding = law.retarding * (jet.value - low) + law.retarding;  // eq. 8, f_r
  answer.contact = true;
  answer.force = stiff * jet.gradient / slope + retarding * velocity;  // eq. 5 to 7
  answer.normal = view.sigma * jet.gradient / slope;
  answer.penetration = view.sigma * (view.threshold - jet.value) / slope;
  answer.point = probe + answer.penetration * answer.normal;
  return answer;
}

/// f_s rises from the threshold inwards, along the outward normal; R opposes the motion.
LawForce consistent_force(const AvilaLaw& law, const IsoView& view, double band, const FieldJet& jet, const Vec3& probe,
                          const Vec3& velocity) noexcept {
  LawForce answer;
  const double depth = view.sigma * (view.threshold - jet.value);
  const double slope = jet.gradient.norm();
  if (!(depth > 0.0 && depth < band) || !(slope > 0.0)) return answer;
  const double share = depth / band;
  answer.contact = true;
  answer.normal = view.sigma * jet.gradient / slope;
  answer.spring = law.largest_force * share * answer.normal;
  answer.stiffness = law.largest_force * slope / band;
  answer.force = answer.spring - law.retarding * (1.0 + share) * velocity;
  answer.penetration = depth / slope;
  answer.point = probe + answer.penetration * answer.normal;
  return answer;
}

}  // namespace

double avila_band(const AvilaLaw& law, const IsoSurface& surface, const Material& material) noexcept {
  return law.band > 0.0 ? law.band : law.largest_force * surface.typical_slope() / material.stiffness;
}

LawForce avila_force(const AvilaLaw& law, const IsoSurface& surface, const IsoView& view, const Material& material,
                     const Vec3& probe, const Vec3& velocity, Contact& contact) noexcept {
  contact.asked = true;
  FieldJet jet;
  if (!probe.allFinite() || !view.field->contains(probe) || !view.sample(probe, jet) || !std::isfinite(jet.value)) {
    contact.seen_outside = false;
    return {};
  }
  const bool outside = view.sigma * (jet.value - view.threshold) >= 0.0;
  contact.seen_outside = contact.seen_outside || outside;
  const double band = avila_band(law, surface, material);
  // The printed method has no memory: whoever starts within the layer is pushed at once.
  if (law.formulation == Formulation::literal) return literal_force(law, view, band, jet, probe, velocity);
  if (!contact.seen_outside) return {};
  return consistent_force(law, view, band, jet, probe, velocity);
}

}  // namespace asperity
