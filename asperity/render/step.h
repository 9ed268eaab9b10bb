#pragma once

#include "asperity/core/fixed_vector.h"
#include "asperity/core/samples.h"
#include "asperity/render/scene.h"
#include "asperity/surface/surface.h"

namespace asperity {

/// What one probe remembers of one instance between ticks.
struct ContactState {
  std::uint32_t instance = no_index;
  Hint hint;
  /// Force laws without a proxy: the probe has been seen outside, so that being inside now means having come in from
  /// the front. False at the start and after leaving over a rim.
  bool seen_outside = false;
  bool touching = false;  ///< force laws without a proxy: pushed at the last tick
};

/// All that a probe carries from tick to tick. Copying it never allocates; assigning `ProxyState{}` resets it. One per
/// probe.
struct ProxyState {
  Vec3 proxy = Vec3::Zero();  ///< m, world; rests one skin above what it touches
  std::uint64_t epoch = 0;    ///< of the scene it belongs to; 0: no tick yet
  FixedVector<ContactState, 4> contacts;
  Vec3 previous_probe = Vec3::Zero();  ///< m, world, of the last tick
};

/// One tick: the force that the hand should feel with the probe there (N, world).
///
/// Pure apart from `state`. Never allocates, locks, throws, logs or touches a file. `dt` is the time since the last
/// call; no law assumes a rate. A probe sample that is not finite answers no force and the flag input_not_finite, and
/// leaves the state as it was. [servo]
ForceSample step(const Scene& scene, ProxyState& state, const ProbeSample& probe, Seconds dt) noexcept;

}  // namespace asperity
