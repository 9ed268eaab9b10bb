#pragma once

#include "asperity/core/samples.h"
#include "asperity/render/scene.h"
#include "asperity/render/state.h"

namespace asperity {

/// Reads what the next tick may need of volumes larger than memory, at their finest level or at `state.wanted_level`,
/// and waits for it: for runs that are not in real time, and for replays. Errors: file_truncated. [main]
Status fetch_volumes(const Scene& scene, const ProxyState& state, const ProbeSample& probe);

/// One tick: the force that the hand should feel with the probe there (N, world).
///
/// Pure apart from `state`; `cache` makes it quick and changes no answer. Never allocates, locks, throws, logs or
/// touches a file. `dt` is the time since the last call; no law assumes a rate. A probe sample that is not finite
/// answers no force and the flag input_not_finite, and leaves the state as it was. [servo]
ForceSample step(const Scene& scene, ProxyState& state, ProxyCache& cache, const ProbeSample& probe,
                 Seconds dt) noexcept;
/// The same without a cache: the same answer, and a slower one. [servo]
ForceSample step(const Scene& scene, ProxyState& state, const ProbeSample& probe, Seconds dt) noexcept;

}  // namespace asperity
