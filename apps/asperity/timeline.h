#pragma once
// What happens between the ticks of a trace, made ready before any of them is rendered again; and who renders them.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "asperity/core/progress.h"
#include "asperity/io/experiment.h"
#include "asperity/io/live_trace.h"
#include "asperity/io/trace_file.h"
#include "asperity/render/step.h"
#include "asperity/servo/safety_stage.h"

namespace asperity::program {

/// Something that happens before a record of a trace is rendered.
struct Happening {
  enum class What {
    scene,        ///< `scene` is touched from here on
    raise,        ///< `fault` was seen
    acknowledge,  ///< of that
    released,     ///< the device let go by itself
    stopping,     ///< from here on the force is withheld
    gap,          ///< `lost` ticks are missing: what the probe carried is not known
    key_frame,    ///< number `key`, and `state` is what the probe carried
  };
  What what = What::scene;
  std::size_t record = 0;
  std::shared_ptr<const Scene> scene;
  std::size_t cache = 0;  ///< of which of the scenes that were built anew `scene` is, or is an edit
  Fault fault = Fault::none;
  std::uint64_t lost = 0;
  std::size_t key = 0;
  std::shared_ptr<const LoopState> state;
};

/// A trace with all that its replay needs.
struct Timeline {
  Experiment experiment;  ///< as it was at the beginning
  SafetySettings safety;
  std::vector<std::shared_ptr<const Scene>> anew;  ///< the first scene, and those that were not edits
  std::vector<Happening> happenings;               ///< in their order
  bool begins = false;                             ///< with the first tick of a session, or is taken to
  std::size_t key_frames = 0;                      ///< that a tick follows
  std::uint64_t lost = 0;                          ///< ticks in gaps
};

/// Builds every scene and restores every key frame. Errors: mismatch (no scene, no whole tick, an event that nobody
/// knows), file_malformed (a gap that nothing tells), and those of its scenes, edits, states and settings, with where
/// in the trace. [main]
Result<Timeline> build_timeline(const Trace& trace, const std::string& path, const Progress& progress);

/// The scene of a trace that is to be built: one that says nothing of a budget is of a time when ticks had none. [any]
std::string scene_to_build(const std::string& json);

/// Renders the ticks of a trace again, one after the other.
class TracePlayer {
 public:
  /// What it needs of memory it takes here. `timeline` outlives it. Errors: of SafetyStage. [build]
  static Result<TracePlayer> build(const Timeline& timeline);

  /// Whether it knows what the probe carries: else what it answers is nothing. [servo]
  [[nodiscard]] bool knows() const noexcept { return knows_; }
  /// From here on it is as a session begins, or goes on from a key frame. [servo]
  void begin() noexcept;
  void go_on_from(const LoopState& state) noexcept;
  void lose() noexcept { knows_ = false; }
  /// All but key frames, which are gone on from by whoever wants to, and gaps. [servo]
  void happen(const Happening& happening) noexcept;
  /// Waits for what the next tick reads of volumes larger than memory. Errors: file_truncated. [main]
  Status fetch(const TraceRecord& record);
  struct Answer {
    ForceSample rendered;
    Vec3 commanded = Vec3::Zero();  ///< N
  };
  /// The tick with its own probe and length. [servo]
  Answer render(const TraceRecord& record) noexcept;

 private:
  TracePlayer(const Timeline& timeline, SafetyStage safety);

  std::vector<ProxyCache> caches_;  ///< one for each scene that was built anew
  const Scene* scene_;
  std::size_t cache_ = 0;
  ProxyState state_;
  SafetyStage safety_;
  bool knows_ = false;
};

}  // namespace asperity::program
