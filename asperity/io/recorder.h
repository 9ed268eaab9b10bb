#pragma once
// A live session on the disk: what the loop's telemetry tells, as a trace that grows while the session runs.

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "asperity/io/trace_file.h"
#include "asperity/render/scene.h"
#include "asperity/render/scene_edit.h"
#include "asperity/render/state.h"
#include "asperity/render/step.h"
#include "asperity/servo/telemetry.h"

namespace asperity {

/// What a live loop touches.
struct LiveScene {
  Scene scene;
  std::shared_ptr<ProxyCache> cache;  ///< the servo thread's; an edit goes on with the one before
  std::uint64_t number = 0;           ///< of its SceneLog, above 0
};

/// Renders what a live loop touches: the Step of its ServoThread.
struct SceneStep {
  ProxyState state = {};
  /// [servo]
  ForceSample operator()(const LiveScene& felt, const ProbeSample& probe, Seconds dt) noexcept {
    return step(felt.scene, state, *felt.cache, probe, dt);
  }
};

/// Tells the hub of each tick: its Record.
struct SceneFeed {
  std::shared_ptr<Telemetry<ProxyState>> telemetry;
  /// [servo]
  void operator()(const LiveTick<LiveScene, SceneStep>& tick) const noexcept {
    telemetry->put(tick, tick.felt.number, tick.step.state);
  }
};

/// Every scene that is handed to a live loop, by number, with how it came about: so that a recorder that hears of a
/// number later can tell. The first is the one that the trace's metadata hold. Steps are kept until somebody asks for
/// later ones. For any threads.
class SceneLog {
 public:
  /// [build]
  std::shared_ptr<const LiveScene> begin(const Scene& scene);
  /// Another scene, of which the canonical JSON is told. [build]
  std::shared_ptr<const LiveScene> replace(const Scene& scene, const std::string& json);
  /// The last one, edited. Errors: of edited(). [build]
  Result<std::shared_ptr<const LiveScene>> edit(const SceneEdit& edit);

  /// How a scene came about: an event's kind and text; of the first one none.
  struct Step {
    std::uint64_t number = 0;
    std::string kind;
    std::string text;
    Scene scene;
  };
  /// The steps after `from`, up to and with `to`; forgets those before `from`. [main]
  std::vector<Step> steps(std::uint64_t from, std::uint64_t to);
  /// That one, nothing when it is forgotten. [main]
  std::optional<Scene> scene(std::uint64_t number);

 private:
  std::shared_ptr<const LiveScene> add(const Scene& scene, std::string kind, std::string text,
                                       std::shared_ptr<ProxyCache> cache);

  std::mutex mutex_;
  std::map<std::uint64_t, Step> steps_;
  std::shared_ptr<const LiveScene> last_;
};

/// Where and how a session is kept.
struct RecorderSettings {
  std::string path;  ///< of the trace
  std::string
      fault_prefix;  ///< of traces that faults leave, at most 32: "out/fault" makes out/fault-1.asptrace; empty: none
  TraceMetadata metadata;
  std::chrono::milliseconds flush{40};  ///< so long at most a tick stays in the program alone; 2 or more
  Seconds before{2.0};                  ///< of ticks that a fault's trace begins before it, at least
  Seconds after{0.1};                   ///< and goes on behind it
};

/// How recording goes.
struct RecorderStatus {
  std::uint64_t ticks = 0;          ///< written
  std::uint64_t lost = 0;           ///< ticks that were not: no room for them, for the disk was slow, or gave up
  std::string problem;              ///< why nothing more is written; empty: all is well
  std::vector<std::string> faults;  ///< traces that faults have left
  std::string fault_problem;        ///< why one could not
};

/// Writes what a reader of the telemetry gets, on a thread of its own. A disk that is slow, full or gone costs ticks in
/// the trace, which are counted, and nothing else.
class Recorder {
 public:
  /// Begins the file. Errors: file_unwritable, bad_value (flush). [build]
  static Result<std::unique_ptr<Recorder>> start(std::shared_ptr<TelemetryReader<ProxyState>> reader,
                                                 std::shared_ptr<SceneLog> scenes, const RecorderSettings& settings);
  /// As finish().
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// [any]
  [[nodiscard]] RecorderStatus status() const;
  /// Once the telemetry has ended: writes what is left and ends the file. Errors: what has kept it from doing so.
  /// [main]
  Status finish();

 private:
  class Work;
  explicit Recorder(std::unique_ptr<Work> work);
  std::unique_ptr<Work> work_;
};

}  // namespace asperity
