// Texture felt as a turned normal: the rival of Fig. 10a (hybrid-surface-2004; Ho, Basdogan and Srinivasan 1999).

#include "asperity/render/laws/normal_perturbation.h"

#include <algorithm>
#include <cmath>

#include "asperity/render/touched_surface.h"

namespace asperity {

std::string NormalPerturbationLaw::lacks(const Instance& instance) const {
  const ImplicitSurface& surface = *implicit_of(instance.surface);
  if (surface.mesh() == nullptr || !surface.textured()) return "a mesh with a texture (implicit.texture)";
  return surface.offset() > 0.0 ? "one without implicit.offset" : "";
}

LawForce NormalPerturbationLaw::force(const TouchedSurface& touched, const Material& material, const Vec3& probe,
                                      const Vec3&, Seconds) const noexcept {
  const ImplicitSurface& surface = touched.touch().implicit();
  Contact& contact = *touched.touch().contact;
  SurfaceCache& cache = *touched.touch().cache;
  contact.asked = true;
  const MeshSurface* base = surface.mesh();
  if (base == nullptr || !probe.allFinite()) return {};
  const SparseGrid& smooth = surface.untextured();
  const double f = smooth.trilinear(probe, cache.sparse).value;
  if (!(f < smooth.outside())) {
    // Farther than any texture is high.
    contact.seen_outside = true;
    return {};
  }
  const TriangleMesh& mesh = base->mesh();
  const Foot foot = base->index().closest(probe, infinity, cache.patch);
  if (!foot.found() || beyond_rim(mesh, foot, probe, base->skin())) {
    contact.seen_outside = false;
    return {};
  }
  // The mesh's own sign is exact near it; the potential's holds where the mesh is open or broken.
  const bool behind = std::abs(f) > smooth.voxel()
                          ? f < 0.0
                          : (probe - foot.point).dot(pseudonormal(mesh, foot.element, foot.at)) < 0.0;
  const Potential plain = smooth.trilinear(foot.point, cache.sparse);
  const Potential rough = surface.grid().trilinear(foot.point, cache.sparse);
  const double height = plain.value - rough.value;
  const double depth = (behind ? foot.distance : -foot.distance) + height;
  LawForce answer;
  answer.height = height;
  answer.element = foot.element;
  if (!(depth > 0.0)) {
    contact.seen_outside = true;
    return answer;
  }
  if (!contact.seen_outside) return answer;
  const Vec3 face = mesh.face_normal(foot.element);
  Vec3 slope = plain.gradient - rough.gradient;
  slope -= slope.dot(face) * face;
  answer.contact = true;
  answer.normal = (face - slope).normalized();
  answer.force = material.stiffness * depth * answer.normal;
  answer.point = foot.point + height * face;
  answer.penetration = depth;
  answer.stored = 0.5 * material.stiffness * depth * depth;
  return answer;
}

}  // namespace asperity
