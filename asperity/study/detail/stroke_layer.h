#pragma once
// The stroke over a picture. Private to study.

#include <span>
#include <vector>

#include "asperity/core/trace_record.h"
#include "asperity/study/detail/shading.h"

namespace asperity {

/// Forces (N) of the first and the last colour.
struct ForceRange {
  double low = 0.0;
  double high = 0.0;
};

/// Draws where the surface was felt, coloured by the commanded force, over `colours` (as large as `shaded`). Parts
/// behind the surface stay hidden. [main]
ForceRange draw_stroke(const Camera& camera, std::span<const TraceRecord> records, const Shaded& shaded,
                       std::vector<Colour>& colours);

}  // namespace asperity
