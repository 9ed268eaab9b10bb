#pragma once
// Which faces have a say at a place of a relief. Private to surface.

#include <array>

#include "asperity/surface/relief/detail/weights.h"
#include "asperity/surface/relief/surface.h"

namespace asperity {

/// A face that has a say in another one's heights.
struct ReliefPartner {
  std::uint32_t face = no_index;
  ShellPrism prism;
  CoatFrame coat;
};

/// Those that have been asked for lately, of one relief and moment. [servo]
class ReliefPartners {
 public:
  /// Its own, or the one that makes room for it.
  ReliefPartner& of(std::uint32_t face) noexcept { return partners_[face % partners_.size()]; }

 private:
  std::array<ReliefPartner, 16> partners_;
};

template <class Visit>
void ReliefSurface::for_each_partner(const ReliefFrame& frame, double u, double v, Visit&& visit) const noexcept {
  const TriangleMesh& mesh = base_.mesh();
  for (int k = 0; k < 3; ++k) {
    if (coordinate(k, u, v) <= 1.0 - static_cast<double>(frame.band.reach[k])) continue;
    const std::uint32_t vertex = mesh.triangles()[frame.face][static_cast<std::size_t>(k)];
    for (const std::uint32_t other : mesh.faces_of_vertex(vertex)) {
      if (other != frame.face) visit(other);
    }
    return;
  }
  for (int k = 0; k < 3; ++k) {
    if (coordinate(k, u, v) >= static_cast<double>(frame.band.look[k])) continue;
    const std::uint32_t other = mesh.neighbour(frame.face, (k + 1) % 3);
    if (other != no_index) visit(other);
  }
}

}  // namespace asperity
