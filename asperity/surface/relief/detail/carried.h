#pragma once
// What a relief's heights are by the coat and the mesh that it was laid on alone: the same wherever the base moves.
// Private to surface.

#include <atomic>
#include <mutex>
#include <vector>

#include "asperity/surface/height_form.h"
#include "asperity/surface/relief/surface.h"

namespace asperity {

inline const Vec2 whole_triangle[3] = {Vec2(0.0, 0.0), Vec2(1.0, 0.0), Vec2(0.0, 1.0)};

/// Of one face at one level, over all of it, before stitching and lowering.
struct CarriedHeight {
  HeightRange range;
  HeightForm form;
};

/// Of all faces, found when a relief is moved for the first time and shared with all that come of it.
struct ReliefSurface::CarriedHeights {
  std::once_flag once;
  std::vector<CarriedHeight> heights;  ///< by face, then by level; empty: not found yet
  std::atomic<std::size_t> bytes{0};   ///< that they take, for who asks while they are being found
};

}  // namespace asperity
