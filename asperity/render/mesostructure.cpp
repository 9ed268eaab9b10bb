// Mesostructure-blended rendering: Algorithm 2 of hrm-2010.

#include <algorithm>
#include <cmath>

#include "asperity/render/law_forces.h"

namespace asperity {

namespace {

/// Weight of a face at the projection of the probe: product of the blend over its three coordinates (erratum 3).
struct FaceWeight {
  double weight = 1.0;
  Vec3 gradient = Vec3::Zero();  ///< 1/m
};

FaceWeight face_weight(const MesostructureLaw& law, const BarycentricFrame& frame, const Vec3& barycentric) noexcept {
  BlendValue value[3];
  for (int k = 0; k < 3; ++k) value[k] = blend_value(law, barycentric[k]);
  FaceWeight answer;
  answer.weight = value[0].weight * value[1].weight * value[2].weight;
  for (int k = 0; k < 3; ++k) {
    answer.gradient += value[k].slope * value[(k + 1) % 3].weight * value[(k + 2) % 3].weight * frame.gradient[k];
  }
  return answer;
}

/// Fades a face out where its plane runs away from the base, over twice the band: the projection of a probe under one
/// side of a sharp fold can fall into the face on the other, whose plane says nothing about the depth there. On flat
/// parts, and where two faces are equally near, it is 1 with a gradient of 0, so that Phi stays as smooth as it is.
FaceWeight nearness(const MesostructureLaw& law, const BarycentricFrame& frame, double height,
                    const BaseFoot& foot) noexcept {
  double steepest = 0.0;
  for (const Vec3& gradient : frame.gradient) steepest = std::max(steepest, gradient.norm());
  const double per_width = steepest / (2.0 * law.rho);
  const double excess = height - foot.signed_distance;
  const double t = 1.0 - std::abs(excess) * per_width;
  if (t <= 0.0) return {0.0, Vec3::Zero()};
  const double slope = -6.0 * t * (1.0 - t) * per_width * (excess < 0.0 ? -1.0 : 1.0);
  return {t * t * (3.0 - 2.0 * t), slope * (frame.normal - foot.up)};
}

/// Lines 4 to 34 as printed, with three liberties that the text leaves no way around: the weight function (undefined
/// there), the normals turned from each face's tangent frame into the object's, and of several prisms the one whose
/// plane is nearest.
LawForce literal_force(const MesostructureLaw& law, const ReliefSurface& surface, double stiffness,
                       const Vec3& probe) noexcept {
  const TriangleMesh& mesh = surface.base().mesh();
  const Prisms prisms = surface.prisms();
  std::uint32_t owner = no_index;
  double owner_distance = infinity;
  Box around;
  around.include(probe);
  surface.base().index().for_each_in_box(around.grown(prisms.half_height()), [&](std::uint32_t face) {
    if (!prisms.contains(face, probe)) return;
    const double distance = std::abs(barycentric_frame(mesh, face).height(probe));
    if (distance < owner_distance || (distance == owner_distance && face < owner)) {
      owner = face;
      owner_distance = distance;
    }
  });
  LawForce answer;
  if (owner == no_index) return answer;
  const Vec3 barycentric = barycentric_frame(mesh, owner).coordinates(probe);
  const CoatSample own = surface.coat().sample(mesh, owner, barycentric);
  double height = own.height;
  Vec3 normal = own.normal;
  if (barycentric.maxCoeff() >= 1.0 - law.rho) {
    double total = 0.0;
    double height_sum = 0.0;
    Vec3 normal_sum = Vec3::Zero();
    for_each_adjoining_face(mesh, owner, [&](std::uint32_t face) {
      const BarycentricFrame frame = barycentric_frame(mesh, face);
      const Vec3 coordinates = frame.coordinates(probe);
      const double weight = face_weight(law, frame, coordinates).weight;
      if (weight <= 0.0) return;
      const CoatSample sample = surface.coat().sample(mesh, face, coordinates);
      height_sum += weight * sample.height;
      normal_sum += weight * sample.normal;
      total += weight;
    });
    if (total > 0.0) {
      height = height_sum / total;
      normal = normal_sum / total;
    }
  }
  answer.height = height;
  answer.element = owner;
  const double penetration = height - owner_distance;
  if (penetration <= 0.0) return answer;
  answer.contact = true;
  answer.penetration = penetration;
  answer.force = stiffness * penetration * normal;
  answer.normal = normal.normalized();
  answer.point = probe + penetration * answer.normal;
  return answer;
}

LawForce consistent_force(const MesostructureLaw& law, const ReliefSurface& surface, double stiffness,
                          const Vec3& probe, ContactState& state) noexcept {
  const BaseFoot foot = base_foot(surface, probe, state.hint);
  if (!foot.nearest.found()) return {};
  const TriangleMesh& mesh = surface.base().mesh();
  // Sums of w, w phi, w H and of the gradients of w and w phi, phi = h - H over each face's own plane.
  double weights = 0.0;
  double values = 0.0;
  double heights = 0.0;
  Vec3 weight_gradient = Vec3::Zero();
  Vec3 value_gradient = Vec3::Zero();
  for_each_adjoining_face(mesh, foot.nearest.element, [&](std::uint32_t face) {
    const BarycentricFrame frame = barycentric_frame(mesh, face);
    const Vec3 coordinates = frame.coordinates(probe);
    const FaceWeight across = face_weight(law, frame, coordinates);
    if (across.weight <= 0.0) return;
    const double height = frame.height(probe);
    const FaceWeight near = nearness(law, frame, height, foot);
    const FaceWeight weight{across.weight * near.weight, near.weight * across.gradient + across.weight * near.gradient};
    if (weight.weight <= 0.0) return;
    const CoatSample sample = surface.coat().sample(mesh, face, coordinates);
    const double phi = height - sample.height;
    weights += weight.weight;
    values += weight.weight * phi;
    heights += weight.weight * sample.height;
    weight_gradient += weight.gradient;
    value_gradient += phi * weight.gradient + weight.weight * (frame.normal - sample.gradient);
  });
  if (weights <= 0.0) {
    // High over a convex edge the probe projects into no face: the nearest base point stands in.
    const CoatSample sample = surface.coat().sample(mesh, foot.nearest.element, foot.nearest.barycentric);
    return potential_contact(foot.signed_distance - sample.height, foot.up - sample.gradient, sample.height,
                             foot.nearest.element, foot.beyond_rim, stiffness, probe, state);
  }
  const double value = values / weights;
  const Vec3 gradient = (value_gradient - value * weight_gradient) / weights;
  return potential_contact(value, gradient, heights / weights, foot.nearest.element, foot.beyond_rim, stiffness, probe,
                           state);
}

}  // namespace

LawForce mesostructure_force(const MesostructureLaw& law, const ReliefSurface& surface, const Material& material,
                             const Vec3& probe, ContactState& state) noexcept {
  return law.formulation == Formulation::literal ? literal_force(law, surface, material.stiffness, probe)
                                                 : consistent_force(law, surface, material.stiffness, probe, state);
}

}  // namespace asperity
