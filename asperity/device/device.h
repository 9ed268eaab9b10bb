#pragma once

#include <concepts>

#include "asperity/core/samples.h"

namespace asperity {

/// What a session needs of a device, simulated or real. All calls are noexcept and do not allocate. [servo]
///
/// One tick: `read()` gives the probe now, `apply(force, dt)` holds `force` (N, world) for `dt` and advances to the
/// next tick. `aim()` is where the hand wants the probe to be now (m, world); `finished()` is true when there is
/// nothing more to read.
template <class D>
concept Device = requires(D& device, const D& constant, const Vec3& force, Seconds dt) {
  { device.read() }
  noexcept->std::same_as<ProbeSample>;
  { device.apply(force, dt) }
  noexcept;
  { constant.aim() }
  noexcept->std::same_as<Vec3>;
  { constant.finished() }
  noexcept->std::same_as<bool>;
};

}  // namespace asperity
