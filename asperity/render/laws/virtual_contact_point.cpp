#include "asperity/render/laws/virtual_contact_point.h"

#include "asperity/core/option.h"
#include "asperity/render/contact/contact_point.h"
#include "asperity/render/touched_surface.h"

namespace asperity {

void VirtualContactPointLaw::options(std::vector<Option>& rows) {
  using L = VirtualContactPointLaw;
  rows.push_back(option("magnitude", &L::magnitude, OptionType::named<ContactMagnitude>(),
                        "how far the contact is taken to be: the distance to the virtual contact point, or what the "
                        "potential says (Avila and Sobierajski 1996).")
                     .of_printed_form("which has one magnitude, the slope of one energy"));
  rows.push_back(option("depth_gain", &L::depth_gain, OptionType::number(Range::not_negative()),
                        "d of eq. 2, by which friction grows with penetration (1/m).")
                     .zooming(1));
  rows.push_back(option("offset", &L::offset, OptionType::quantity(Dimension::length, Range::not_negative()),
                        "the force pushes out to where the potential is this, so that thin objects have volume.")
                     .by_contents("more than is stored of the potential"));
}

LawForce VirtualContactPointLaw::force(const TouchedSurface& touched, const Material& material, const Vec3& probe,
                                       const Vec3& velocity, Seconds dt, State& memory) const noexcept {
  const ImplicitSurface& surface = touched.touch().implicit();
  return ask_contact_point(touched.touch(), memory, probe, [&](HeldPoint& state) -> LawForce {
    if (formulation == Formulation::consistent)
      return potential_push({offset + touched.probe_radius(), 0.0, depth_gain}, surface, material, probe, velocity, dt,
                            state);
    const Potential here = surface.grid().node_gradients(probe, state.cache.sparse);
    if (here.value - surface.offset() >= offset) {
      state.seen_outside = true;
      leave_contact_point(state);
      return {};
    }
    return printed_push(surface, magnitude, offset, depth_gain, here, material, probe, velocity, state);
  });
}

}  // namespace asperity
