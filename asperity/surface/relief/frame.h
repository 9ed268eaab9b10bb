#pragma once
// One triangle of a relief, ready to be evaluated, and what evaluating it gives.

#include <cstdint>

#include "asperity/surface/coat.h"
#include "asperity/surface/face_place.h"
#include "asperity/surface/shell.h"

namespace asperity {

/// Everything that evaluating a relief over one triangle needs: copied once when a probe comes onto the triangle, so
/// that staying on it touches no mesh data.
struct ReliefFrame {
  std::uint64_t owner = 0;  ///< identity of the surface's index; 0: nothing
  std::uint32_t face = no_index;
  bool stitched = false;  ///< whether `band` means anything
  bool partly = false;    ///< whether `seam` is not 1 throughout
  bool lowered = false;   ///< whether `share` is not 1 throughout
  ShellPrism prism;
  CoatFrame coat;
  StitchBand band;
  double seam = 1.0;  ///< how much the faces around have a say at the first corner (0 or 1), and its change
  double seam_u = 0.0;
  double seam_v = 0.0;
  double share = 1.0;  ///< of the coat's height that is rendered at the first corner, and its change along u and v
  double share_u = 0.0;
  double share_v = 0.0;
};

/// A point of the displaced surface x(u, v) = V + H N over one triangle, with its tangents (m). Nothing is known before
/// it is evaluated: walks hold several, and would otherwise fill them twice.
struct ReliefPoint {
  Vec3 point;
  Vec3 along_u;
  Vec3 along_v;
  Vec3 front;      ///< unit normal, outward
  Vec3 direction;  ///< N
  HeightJet jet;   ///< of the height as rendered: stitched and lowered
};

/// A triangle and a place on it.
using ReliefPlace = FacePlace<ReliefFrame>;

/// The triangle that was asked about last, and the surface there.
struct ReliefCache {
  ReliefPlace place;
  ReliefPoint spot;
  bool evaluated = false;  ///< `spot` is that of `place`
};

}  // namespace asperity
