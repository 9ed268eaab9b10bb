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
  double bytes = 0.0;             ///< of field and octree, which every law feels
  std::vector<double> law_bytes;  ///< what each law needs beside them
  std::vector<double> p50;        ///< s a tick, one a law; a measurement of the machine that ran it
};

/// Feels the scene's volumes on every eighth, fourth, second and every sample along each axis, at the same threshold
/// and along the same stroke, with each of `laws`, at `rate` (Hz): of up to `ticks` ticks the median, and of several
/// rounds, in which sizes and laws take turns, the least, so that what else the machine does is not taken for theirs.
/// Sizes at which a threshold is no longer passed are left out; nothing for a scene without an isosurface in memory.
/// Errors: those of Scene::build. [main]
Result<std::vector<LoopRateRow>> loop_rates(const Scene& scene, const StrokePath& path, std::span<const Law> laws,
                                            double rate, std::uint64_t ticks = 3000);

}  // namespace asperity
