#pragma once
// One tick as it is recorded. It lives in core so that servo (which fills it) and io (which stores it) share it.

#include <cstdint>
#include <type_traits>

#include "asperity/core/samples.h"

namespace asperity {

/// Everything needed to replay a tick and to check that the replay is equal. World frame, SI.
struct TraceRecord {
  std::uint64_t tick = 0;
  Seconds dt{0.0};                ///< step given to `step` at this tick
  ProbeSample probe;              ///< input
  ForceSample rendered;           ///< output of `step`, before the safety stage
  Vec3 commanded = Vec3::Zero();  ///< force sent to the device, after the safety stage (N)
  Vec3 hand = Vec3::Zero();       ///< position the hand aimed at (m); the probe's own when an ideal probe is used
  double update_seconds = 0.0;    ///< time `step` took; a measurement, not part of a replay's equality
};

}  // namespace asperity
