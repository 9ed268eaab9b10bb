#include "asperity/render/detail/god_object.h"

#include <algorithm>

namespace asperity {

namespace {

// Near the corner of a valley single moves can be a fraction of the skin long and still lead out of it.
constexpr double tolerance_of_skin = 1e-3;

}  // namespace

namespace {

/// Normal of the relief as it is rendered: blended over edges where faces disagree, in the base face's plane.
Vec3 blended_normal(const ReliefSurface& relief, const Foot& contact) noexcept {
  const BarycentricFrame frame = barycentric_frame(relief.base().mesh(), contact.element);
  const HeightJet jet = relief.height(relief.frame(contact.element), contact.barycentric[1], contact.barycentric[2]);
  return (frame.normal - jet.u * frame.gradient[1] - jet.v * frame.gradient[2]).normalized();
}

}  // namespace

Vec3 shading_normal(const Instance& instance, const Foot& contact) noexcept {
  const Surface& surface = instance.surface;
  const auto* law = std::get_if<ForceShadingLaw>(&instance.law);
  const bool blended = law != nullptr && law->formulation == Formulation::consistent;
  const MeshSurface& mesh = *constraint_mesh(instance);
  Vec3 normal = Vec3::Zero();
  if (const auto* relief = std::get_if<std::shared_ptr<const ReliefSurface>>(&surface)) {
    const bool given = (*relief)->coat().maps_on(contact.element).has_normal_map();
    normal = blended && !given ? blended_normal(**relief, contact)
                               : (*relief)->coat_sample(contact.element, contact.barycentric).normal;
  } else {
    normal = interpolated_normal(mesh.mesh(), contact.element, contact.barycentric);
  }
  return contact.normal.dot(mesh.mesh().face_normal(contact.element)) < 0.0 ? Vec3(-normal) : normal;
}

void MeshConstraints::add(const Instance& instance, ContactState& state) noexcept {
  if (entries_.size() == capacity) return;
  const ConstraintGeometry mesh = patches_.of(instance);
  entries_.push_back({&instance, mesh, &state, state.pose.is_identity()});
  tolerance_ = std::min(tolerance_, tolerance_of_skin * mesh.skin());
}

void MeshConstraints::contacts(const Vec3& position, PlaneSet& out) noexcept {
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    Entry& entry = entries_[i];
    const Pose& pose = entry.state->pose;
    ContactSet touched;
    entry.mesh.contacts(entry.at_origin ? position : pose.apply_inverse(position), radius_, entry.instance->sides,
                        entry.state->hint, touched);
    for (const Foot& contact : touched) {
      const Vec3 normal = entry.at_origin ? contact.normal : pose.rotate(contact.normal);
      const Vec3 point = entry.at_origin ? contact.point : pose.apply(contact.point);
      out.push_back({normal, normal.dot(point) + radius_, entry.mesh.skin(), static_cast<std::uint32_t>(i), contact});
    }
  }
}

double MeshConstraints::sweep(const Segment& motion) noexcept {
  double first = 1.0;
  for (Entry& entry : entries_) {
    const Pose& pose = entry.state->pose;
    const Segment local =
        entry.at_origin ? motion : Segment{pose.apply_inverse(motion.from), pose.apply_inverse(motion.to)};
    first = std::min(first, entry.mesh.segment(local, radius_, entry.instance->sides, entry.state->hint).t);
  }
  return first;
}

LawForce owner_force(const Instance& instance, const Material& material, const Pose& pose, std::size_t owner,
                     const ConstraintSolution& solution, const Vec3& goal, const ProbeSample& probe) noexcept {
  LawForce answer;
  Vec3 spring = Vec3::Zero();
  double strongest = 0.0;
  double strongest_of_all = 0.0;
  const ConstraintPlane* plane = nullptr;
  for (const PlaneProjection::Active& active : solution.projection.active) {
    strongest_of_all = std::max(strongest_of_all, active.multiplier);
    if (solution.planes[active.plane].owner != owner) continue;
    spring += active.multiplier * solution.planes[active.plane].normal;
    if (active.multiplier <= strongest) continue;
    strongest = active.multiplier;
    plane = &solution.planes[active.plane];
  }
  if (plane == nullptr) return answer;
  answer.contact = true;
  answer.penetration = spring.norm();
  answer.normal = spring / answer.penetration;
  answer.force = material.stiffness * spring;
  // Not at rest yet: the spring runs to where the proxy really is.
  const bool settled = solution.converged && solution.projection.feasible;
  // Once: by the owner that pushes most.
  if (!settled && strongest != strongest_of_all) return {};
  if (!settled) answer.force = material.stiffness * (solution.proxy - goal);
  if (const auto* law = std::get_if<ForceShadingLaw>(&instance.law)) {
    const Vec3 shading = pose.rotate(shading_normal(instance, plane->contact));
    if (law->formulation == Formulation::literal) {
      answer.normal = shading;
      answer.force = answer.force.norm() * shading;
    } else {
      // The slope that the normal stands for, times the push.
      constexpr double least_rise = 0.1;
      const double rise = std::max(least_rise, shading.dot(answer.normal));
      answer.turn = answer.force.norm() / rise * (shading - shading.dot(answer.normal) * answer.normal);
    }
  }
  if (strongest == strongest_of_all) answer.force += material.stiffness * (goal - probe.pose.position);
  answer.force = with_damping(answer.force, answer.normal, probe.twist.linear, material.damping);
  answer.point = pose.apply(plane->contact.point);
  answer.element = plane->contact.element;
  return answer;
}

}  // namespace asperity
