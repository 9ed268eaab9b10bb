#include "asperity/render/contact/shell_contact.h"

namespace asperity {

ShellContact shell_contact(const ReliefView& view, const Vec3& probe) noexcept {
  const MeshSurface& base = view.surface().base();
  ShellContact contact;
  contact.frame = view.locate(probe, contact.place);
  // A rim needs a foot on it, and there is a foot wherever there is a triangle.
  if (base.mesh().report().closed()) {
    contact.found = true;
    return contact;
  }
  const Foot nearest = view.nearest_base(probe);  // from the patch that locating just used
  contact.found = nearest.found();
  if (contact.found) contact.beyond_rim = beyond_rim(base.mesh(), nearest, probe, view.skin());
  return contact;
}

LawForce potential_contact(double value, const Vec3& gradient, double height, std::uint32_t element, bool beyond_rim,
                           double stiffness, const Vec3& probe, Contact& contact) noexcept {
  LawForce answer;
  answer.height = height;
  answer.element = element;
  if (beyond_rim) {
    contact.seen_outside = false;
    return answer;
  }
  if (value >= 0.0) {
    contact.seen_outside = true;
    return answer;
  }
  const double steepness = gradient.norm();
  if (!contact.seen_outside || steepness == 0.0) return answer;
  answer.contact = true;
  answer.force = answer.spring = -stiffness * value * gradient;
  answer.stiffness = stiffness * steepness * steepness;
  answer.stored = 0.5 * stiffness * value * value;
  answer.normal = gradient / steepness;
  answer.penetration = -value;
  answer.point = probe - value / steepness * answer.normal;
  return answer;
}

}  // namespace asperity
