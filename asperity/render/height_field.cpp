// Height-field rendering over base triangles: haptic-textures-2005, 3.3, and Algorithm 1 of hrm-2010.

#include <cmath>

#include "asperity/render/law_forces.h"

namespace asperity {

namespace {

struct Taper {
  double factor = 1.0;
  Vec3 gradient = Vec3::Zero();  ///< 1/m
};

/// Falls from 1 to 0 over the outer `width` of each barycentric coordinate, smoothly.
Taper edge_taper(double width, const BarycentricFrame& frame, const Vec3& barycentric) noexcept {
  Taper taper;
  if (width <= 0.0) return taper;
  double value[3];
  double slope[3];
  for (int k = 0; k < 3; ++k) {
    const double t = std::clamp(barycentric[k] / width, 0.0, 1.0);
    value[k] = t * t * (3.0 - 2.0 * t);
    slope[k] = 6.0 * t * (1.0 - t) / width;
  }
  taper.factor = value[0] * value[1] * value[2];
  for (int k = 0; k < 3; ++k) {
    taper.gradient += slope[k] * value[(k + 1) % 3] * value[(k + 2) % 3] * frame.gradient[k];
  }
  return taper;
}

/// As printed: among the prisms that hold the probe, the one whose height field it is deepest under (2005: "the
/// algorithm compares the heights in the textures of both triangles").
LawForce literal_force(const HeightFieldLaw& law, const ReliefSurface& surface, double stiffness,
                       const Vec3& probe) noexcept {
  const TriangleMesh& mesh = surface.base().mesh();
  const Prisms prisms = surface.prisms();
  LawForce answer;
  Box around;
  around.include(probe);
  surface.base().index().for_each_in_box(around.grown(prisms.half_height()), [&](std::uint32_t face) {
    if (!prisms.contains(face, probe)) return;
    const BarycentricFrame frame = barycentric_frame(mesh, face);
    const Vec3 barycentric = frame.coordinates(probe);
    const double height =
        edge_taper(law.edge_taper, frame, barycentric).factor * surface.coat().sample(mesh, face, barycentric).height;
    const double penetration = height - std::abs(frame.height(probe));
    const bool deeper =
        penetration > answer.penetration || (penetration == answer.penetration && face < answer.element);
    if (penetration <= 0.0 || !deeper) return;
    answer = {true,
              stiffness * penetration * frame.normal,
              probe + penetration * frame.normal,
              frame.normal,
              penetration,
              height,
              face};
  });
  return answer;
}

LawForce consistent_force(const HeightFieldLaw& law, const ReliefSurface& surface, double stiffness, const Vec3& probe,
                          ContactState& state) noexcept {
  const BaseFoot foot = base_foot(surface, probe, state.hint);
  if (!foot.nearest.found()) return {};
  const TriangleMesh& mesh = surface.base().mesh();
  const std::uint32_t face = foot.nearest.element;
  const CoatSample coat = surface.coat().sample(mesh, face, foot.nearest.barycentric);
  const Taper taper = edge_taper(law.edge_taper, barycentric_frame(mesh, face), foot.nearest.barycentric);
  const double height = taper.factor * coat.height;
  const Vec3 gradient = foot.up - taper.factor * coat.gradient - coat.height * taper.gradient;
  return potential_contact(foot.signed_distance - height, gradient, height, face, foot.beyond_rim, stiffness, probe,
                           state);
}

}  // namespace

LawForce height_field_force(const HeightFieldLaw& law, const ReliefSurface& surface, const Material& material,
                            const Vec3& probe, ContactState& state) noexcept {
  return law.formulation == Formulation::literal ? literal_force(law, surface, material.stiffness, probe)
                                                 : consistent_force(law, surface, material.stiffness, probe, state);
}

BaseFoot base_foot(const ReliefSurface& surface, const Vec3& probe, Hint& hint) noexcept {
  BaseFoot foot;
  foot.nearest = surface.base().closest(probe, infinity, hint);
  if (!foot.nearest.found()) return foot;
  const TriangleMesh& mesh = surface.base().mesh();
  const Vec3& barycentric = foot.nearest.barycentric;
  const Vec3 offset = probe - foot.nearest.point;
  const bool outside = offset.dot(pseudonormal(mesh, foot.nearest.element, barycentric)) >= 0.0;
  foot.signed_distance = outside ? foot.nearest.distance : -foot.nearest.distance;
  foot.up = outside ? foot.nearest.normal : Vec3(-foot.nearest.normal);
  if (foot.nearest.distance == 0.0) foot.up = mesh.face_normal(foot.nearest.element);
  foot.beyond_rim = beyond_rim(mesh, foot.nearest, probe, surface.skin());
  return foot;
}

LawForce potential_contact(double value, const Vec3& gradient, double height, std::uint32_t element, bool beyond_rim,
                           double stiffness, const Vec3& probe, ContactState& state) noexcept {
  LawForce answer;
  answer.height = height;
  answer.element = element;
  if (beyond_rim) {
    state.seen_outside = false;
    return answer;
  }
  if (value >= 0.0) {
    state.seen_outside = true;
    return answer;
  }
  const double steepness = gradient.norm();
  if (!state.seen_outside || steepness == 0.0) return answer;
  answer.contact = true;
  answer.force = -stiffness * value * gradient;
  answer.normal = gradient / steepness;
  answer.penetration = -value;
  answer.point = probe - value / steepness * answer.normal;
  return answer;
}

Vec3 with_damping(const Vec3& force, const Vec3& normal, const Vec3& velocity, double damping) noexcept {
  if (damping == 0.0) return force;
  const double push = force.dot(normal);
  const double damped = std::max(0.0, push - damping * velocity.dot(normal));
  return force + (damped - push) * normal;
}

}  // namespace asperity
