#include "asperity/render/god_object.h"

#include <algorithm>

namespace asperity {

namespace {

// Near the corner of a valley single moves can be a fraction of the skin long and still lead out of it.
constexpr double tolerance_of_skin = 1e-3;

const MeshSurface& constraint_mesh(const Surface& surface) noexcept {
  if (const auto* relief = std::get_if<std::shared_ptr<const ReliefSurface>>(&surface)) return (*relief)->base();
  return **std::get_if<std::shared_ptr<const MeshSurface>>(&surface);
}

/// Normal of the map, or of the smoothed mesh, on the side that is touched.
Vec3 shading_normal(const Surface& surface, const Foot& contact) noexcept {
  const MeshSurface& mesh = constraint_mesh(surface);
  Vec3 normal = Vec3::Zero();
  if (const auto* relief = std::get_if<std::shared_ptr<const ReliefSurface>>(&surface)) {
    normal = (*relief)->coat().sample(mesh.mesh(), contact.element, contact.barycentric).normal;
  } else {
    normal = interpolated_normal(mesh.mesh(), contact.element, contact.barycentric);
  }
  return contact.normal.dot(mesh.mesh().face_normal(contact.element)) < 0.0 ? Vec3(-normal) : normal;
}

}  // namespace

void MeshConstraints::add(const Instance& instance, ContactState& state) noexcept {
  const MeshSurface& mesh = constraint_mesh(instance.surface);
  if (!entries_.push_back({&instance, &mesh, &state, instance.world_from_object.is_identity()})) return;
  tolerance_ = std::min(tolerance_, tolerance_of_skin * mesh.skin());
}

void MeshConstraints::contacts(const Vec3& position, PlaneSet& out) noexcept {
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    Entry& entry = entries_[i];
    const Pose& pose = entry.instance->world_from_object;
    ContactSet touched;
    entry.mesh->contacts(entry.at_origin ? position : pose.apply_inverse(position), radius_, entry.instance->sides,
                         entry.state->hint, touched);
    for (const Foot& contact : touched) {
      const Vec3 normal = entry.at_origin ? contact.normal : pose.rotate(contact.normal);
      const Vec3 point = entry.at_origin ? contact.point : pose.apply(contact.point);
      out.push_back({normal, normal.dot(point) + radius_, entry.mesh->skin(), static_cast<std::uint32_t>(i), contact});
    }
  }
}

double MeshConstraints::sweep(const Segment& motion) noexcept {
  double first = 1.0;
  for (Entry& entry : entries_) {
    const Pose& pose = entry.instance->world_from_object;
    const Segment local =
        entry.at_origin ? motion : Segment{pose.apply_inverse(motion.from), pose.apply_inverse(motion.to)};
    first = std::min(first, entry.mesh->segment(local, radius_, entry.instance->sides, entry.state->hint).t);
  }
  return first;
}

LawForce MeshConstraints::force(std::size_t index, const ConstraintSolution& solution, const Vec3& probe,
                                const Vec3& velocity) const noexcept {
  const Entry& entry = entries_[index];
  const Material& material = entry.instance->material;
  LawForce answer;
  Vec3 spring = Vec3::Zero();
  double strongest = 0.0;
  const ConstraintPlane* plane = nullptr;
  for (const PlaneProjection::Active& active : solution.projection.active) {
    if (solution.planes[active.plane].owner != index) continue;
    spring += active.multiplier * solution.planes[active.plane].normal;
    if (active.multiplier <= strongest) continue;
    strongest = active.multiplier;
    plane = &solution.planes[active.plane];
  }
  if (plane == nullptr) return answer;
  const Pose& pose = entry.instance->world_from_object;
  answer.contact = true;
  answer.penetration = spring.norm();
  Vec3 world_normal = spring / answer.penetration;
  Vec3 world_force = material.stiffness * spring;
  if (!solution.converged || !solution.projection.feasible) {
    // Not at rest yet: the spring runs to where the proxy really is.
    world_force = material.stiffness * (solution.proxy - probe);
  }
  if (std::holds_alternative<ForceShadingLaw>(entry.instance->law)) {
    const Vec3 shading = shading_normal(entry.instance->surface, plane->contact);
    world_normal = entry.at_origin ? shading : pose.rotate(shading);
    world_force = world_force.norm() * world_normal;
  }
  world_force = with_damping(world_force, world_normal, velocity, material.damping);
  answer.force = world_force;
  answer.normal = world_normal;
  answer.point = entry.at_origin ? plane->contact.point : pose.apply(plane->contact.point);
  answer.element = plane->contact.element;
  return answer;
}

}  // namespace asperity
