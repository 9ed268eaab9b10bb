// Isosurfaces from the field's value at the probe alone: Avila and Sobierajski 1996 as large-data-2008 has it (M1).

#include <algorithm>
#include <cmath>

#include "asperity/core/option.h"
#include "asperity/render/laws/avila.h"
#include "asperity/render/touched_surface.h"

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
  answer.stored = 0.5 * law.largest_force * share * answer.penetration;
  answer.point = probe + answer.penetration * answer.normal;
  return answer;
}

}  // namespace

double AvilaLaw::layer(const IsoSurface& surface, const Material& material) const noexcept {
  return band > 0.0 ? band : largest_force * surface.typical_slope() / material.stiffness;
}

void AvilaLaw::options(std::vector<Option>& rows) {
  using L = AvilaLaw;
  rows.push_back(option("band", &L::band, OptionType::number(Range::not_negative()),
                        "width of the layer that pushes, in the field's unit, from the threshold inwards; 0 chooses it "
                        "by the stiffness."));
  rows.push_back(option("largest_force", &L::largest_force, OptionType::quantity(Dimension::force, Range::positive()),
                        "force at the layer's end."));
  rows.push_back(option("retarding", &L::retarding, OptionType::quantity(Dimension::damping, Range::not_negative()),
                        "resistance against motion within."));
}

LawForce AvilaLaw::force(const TouchedSurface& surface, const Material& material, const Vec3& probe,
                         const Vec3& velocity, Seconds) const noexcept {
  const IsoView& view = surface.touch().iso();
  Contact& contact = *surface.touch().contact;
  contact.asked = true;
  FieldJet jet;
  if (!view.sample(probe, jet) || !std::isfinite(jet.value)) {
    contact.seen_outside = false;
    return {};
  }
  const bool outside = view.sigma * (jet.value - view.threshold) >= 0.0;
  contact.seen_outside = contact.seen_outside || outside;
  const double width = layer(*iso_of(surface.instance().surface), material);
  // The printed method has no memory: whoever starts within the layer is pushed at once.
  if (formulation == Formulation::literal) return literal_force(*this, view, width, jet, probe, velocity);
  if (!contact.seen_outside) return {};
  return consistent_force(*this, view, width, jet, probe, velocity);
}

}  // namespace asperity
