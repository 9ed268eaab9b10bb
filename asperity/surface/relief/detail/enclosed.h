#pragma once
// What the relief over each face of a base is enclosed in. Private to surface.

#include "asperity/surface/relief/detail/slabs.h"
#include "asperity/surface/relief/surface.h"

namespace asperity {

/// The boxes (m) that relief.boxes() was made of.
struct ReliefSurface::Enclosed {
  UnsetVector<Box> boxes;  ///< one a face, or empty: found again for the few that are asked for
};

}  // namespace asperity
