#include "asperity/render/custom_law.h"

#include <algorithm>
#include <cmath>

#include "asperity/core/identity.h"
#include "asperity/render/laws/forces.h"

namespace asperity {

FieldSample TouchedSurface::eval(const Vec3& p) const noexcept {
  return on_view(*view_, [&](const auto& view) { return view.eval(p); });
}

Foot TouchedSurface::nearest(const Vec3& p, double bound) const noexcept {
  return on_view(*view_, [&](const auto& view) { return view.nearest(p, bound, {}); });
}

CustomLaw::CustomLaw(std::string name) : name_(std::move(name)), identity_(next_identity()) {}

LawForce CustomLaw::force(const Instance& instance, const FeltView& view, const Material& material, const Vec3& probe,
                          const Vec3& velocity, Seconds dt, Contact& contact) const noexcept {
  CustomMemory& state = contact.memory<CustomMemory>();
  if (state.law != identity_) {
    reset_(state.bytes.data());
    state.law = identity_;
  }
  // It has been asked now: what was before the first tick in reach is known.
  contact.seen_outside = true;
  contact.asked = true;
  const TouchedSurface surface(instance, view);
  const CustomForce answer = force_(law_.get(), surface, material, probe, velocity, dt, state.bytes.data());
  LawForce force;
  force.height = answer.height;
  const bool finite = answer.force.allFinite() && answer.point.allFinite() && answer.normal.allFinite() &&
                      std::isfinite(answer.penetration) && std::isfinite(answer.height);
  if (!answer.contact || !finite) return force;
  force.contact = true;
  force.force = answer.force;
  force.point = answer.point;
  force.normal = answer.normal;
  force.penetration = answer.penetration;
  force.element = answer.element;
  force.damped = answer.damped;
  force.spring = answer.force - (answer.damping.allFinite() ? answer.damping : Vec3(Vec3::Zero()));
  if (answer.stored && std::isfinite(*answer.stored)) force.stored = answer.stored;
  force.keeps = !force.stored;
  if (std::isfinite(answer.stiffness)) force.stiffness = std::max(0.0, answer.stiffness);
  if (answer.damped) force.push = std::max(0.0, answer.force.dot(answer.normal));
  return force;
}

}  // namespace asperity
