#pragma once
// The bands beside edges of Algorithm 2 (hrm-2010, section 4.1), as its printed form and its intended one have them.
// Private to render.

#include <algorithm>
#include <cmath>

#include "asperity/surface/relief/surface.h"
#include "asperity/surface/stitching.h"

namespace asperity {

/// Weight of a face at the projection of the probe, by a law's `rho`, `blend` and `blend_map`: the product over its
/// three coordinates of the blend at t = (b + rho) / (2 rho) (erratum 3). [servo]
template <class L>
double band_weight(const L& law, const Vec3& barycentric) noexcept {
  double weight = 1.0;
  for (int k = 0; k < 3; ++k) {
    const double t = std::clamp((barycentric[k] + law.rho) / (2.0 * law.rho), 0.0, 1.0);
    switch (law.blend) {
      case Blend::none: weight *= t >= 0.5 ? 1.0 : 0.0; break;
      case Blend::linear: weight *= t; break;
      case Blend::s_shape: weight *= t * t * (3.0 - 2.0 * t); break;
      case Blend::quintic: weight *= t * t * t * (10.0 + t * (6.0 * t - 15.0)); break;
      case Blend::image: {
        const double position = t * static_cast<double>(law.blend_map.size() - 1);
        const auto cell = std::min(static_cast<std::size_t>(position), law.blend_map.size() - 2);
        weight *= law.blend_map[cell] +
                  (law.blend_map[cell + 1] - law.blend_map[cell]) * (position - static_cast<double>(cell));
        break;
      }
    }
  }
  return weight;
}

/// Of the prisms that hold the probe the one whose plane is nearest; no_index: none does. [servo]
inline std::uint32_t prism_owner(const ReliefSurface& surface, const Prisms& prisms, const Vec3& probe) noexcept {
  const TriangleMesh& mesh = surface.base().mesh();
  std::uint32_t owner = no_index;
  double nearest = infinity;
  const double rounding = 1e-12 * (mesh.bounds().diagonal() + probe.norm());
  Box around;
  around.include(probe);
  surface.base().index().for_each_in_box(around.grown(prisms.half_height()), [&](std::uint32_t face) {
    // Most of them are farther than the nearest so far, or than any prism reaches.
    constexpr double room = 1.0 + 1e-9;
    const auto [a, b, c] = mesh.corners(face);
    const Vec3 across = (b - a).cross(c - a);
    const double above = across.dot(probe - a);
    const double most = room * std::min(nearest, prisms.half_height()) + rounding;
    if (above * above > most * most * across.squaredNorm() || !prisms.contains(face, probe)) return;
    const double distance = std::abs(barycentric_frame(mesh, face).height(probe));
    if (distance < nearest || (distance == nearest && face < owner)) {
      owner = face;
      nearest = distance;
    }
  });
  return owner;
}

}  // namespace asperity
