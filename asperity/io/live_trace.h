#pragma once
// What a trace of a live session holds beside its ticks: the loop's whole state in its key frames, the safety stage's
// settings in its metadata, and no gap that it does not tell.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/device/profile.h"
#include "asperity/io/trace_file.h"
#include "asperity/render/scene.h"
#include "asperity/render/state.h"
#include "asperity/servo/safety_stage.h"

namespace asperity {

/// All that a loop carries from tick to tick.
struct LoopState {
  ProxyState proxy;
  SafetyMemory safety;
};

/// An image of a loop's state, for TraceKeyFrame::state. `scene`: what it touches, or is to touch next. [any]
std::vector<std::byte> save_loop_state(const ProxyState& state, const SafetyMemory& safety, const Scene& scene);
/// The state of such an image. Errors: those of restore_state. [build]
Result<LoopState> restore_loop_state(std::span<const std::byte> image, const Scene& scene);

/// Key of the safety stage's settings in TraceMetadata::extra.
inline constexpr const char* trace_safety_key = "safety";
/// Key of the sentence on what has gone wrong, in the trace that a fault leaves.
inline constexpr const char* trace_fault_key = "fault";
/// One JSON object, SI, with every setting; "infinity" where there is no limit. [any]
std::string to_json(const SafetySettings& settings);
/// Settings that are not there are at their defaults. Errors: file_malformed (no JSON object), bad_key, bad_type, and
/// those of SafetyStage::build. [any]
Result<SafetySettings> parse_safety_settings(std::string_view json);
/// Those of a trace: its metadata's, or the device's where they say nothing. Errors: of parse_safety_settings. [any]
Result<SafetySettings> safety_of(const TraceMetadata& metadata, const DeviceProfile& device);

/// Ticks that are missing in a trace, in a row.
struct TraceGap {
  std::uint64_t tick = 0;  ///< the first one behind it
  std::uint64_t lost = 0;  ///< how many are missing
};
/// Every gap between two ticks of a trace. Errors: file_malformed (a gap that no event "lost" tells, ticks that go
/// back). [any]
Result<std::vector<TraceGap>> trace_gaps(const Trace& trace);

}  // namespace asperity
