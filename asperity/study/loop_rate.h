#pragma once
// How fast laws answer on ever larger data: large-data-2008, Fig. 12 (row M-4).

#include <cstdint>
#include <span>
#include <vector>

#include "asperity/device/stroke.h"
#include "asperity/render/scene.h"

namespace asperity {

/// One size of the data.
struct LoopRateRow {
  std::uint64_t samples = 0;
  double bytes = 0.0;       ///< of field and octree
  std::vector<double> p50;  ///< s a tick, one a law; a measurement of the machine that ran it
};

/// Feels the scene's volumes on every eighth, fourth, second and every sample along each axis, at the same threshold
/// and along the same stroke, with each of `laws`: medians over up to `ticks` ticks at `rate` (Hz). Sizes at which a
/// threshold is no longer passed are left out; nothing for a scene without an isosurface in memory. Errors: those of
/// Scene::build. [main]
Result<std::vector<LoopRateRow>> loop_rates(const Scene& scene, const StrokePath& path, std::span<const Law> laws,
                                            double rate, std::uint64_t ticks = 3000);

}  // namespace asperity
