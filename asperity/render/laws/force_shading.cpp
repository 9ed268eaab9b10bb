#include "asperity/render/laws/force_shading.h"

#include <algorithm>

#include "asperity/render/felt.h"

namespace asperity {

namespace {

/// Normal of the relief as it is rendered: blended over edges where faces disagree, in the base face's plane.
Vec3 blended_normal(const ReliefSurface& relief, const Foot& contact) noexcept {
  const BarycentricFrame frame = barycentric_frame(relief.base().mesh(), contact.element);
  const HeightJet jet = relief.height(relief.frame(contact.element), contact.at[1], contact.at[2]);
  return (frame.normal - jet.u * frame.gradient[1] - jet.v * frame.gradient[2]).normalized();
}

/// Direction that force shading turns a contact's force into: the coat's normal map, or the smoothed mesh, on the side
/// touched. Object frame.
Vec3 shading_normal(const Instance& instance, Formulation formulation, const Foot& contact) noexcept {
  const TriangleMesh& mesh = constraint_mesh(instance)->mesh();
  Vec3 normal = Vec3::Zero();
  if (const ReliefSurface* relief = relief_of(instance)) {
    const bool given = relief->coat().maps_on(contact.element).has_normal_map();
    normal = formulation == Formulation::consistent && !given ? blended_normal(*relief, contact)
                                                              : relief->coat_sample(contact.element, contact.at).normal;
  } else {
    normal = interpolated_normal(mesh, contact.element, contact.at);
  }
  return contact.normal.dot(mesh.face_normal(contact.element)) < 0.0 ? Vec3(-normal) : normal;
}

}  // namespace

void ForceShadingLaw::finish(const Touched& touch, const Foot& contact, LawForce& answer) const noexcept {
  const Vec3 shading = touch.turned(shading_normal(*touch.instance, formulation, contact));
  if (formulation == Formulation::literal) {
    answer.normal = shading;
    answer.force = answer.force.norm() * shading;
    return;
  }
  // The slope that the normal stands for, times the push.
  constexpr double least_rise = 0.1;
  const double rise = std::max(least_rise, shading.dot(answer.normal));
  answer.turns = true;
  answer.turn = answer.force.norm() / rise * (shading - shading.dot(answer.normal) * answer.normal);
}

}  // namespace asperity
