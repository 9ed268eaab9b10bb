#include "asperity/io/recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <filesystem>
#include <thread>
#include <utility>

#include "asperity/io/live_trace.h"
#include "asperity/io/scene_edit_json.h"

namespace asperity {

// ---------------------------------------------------------------------------------------------------------- scene log

std::shared_ptr<const LiveScene> SceneLog::add(const Scene& scene, std::string kind, std::string text,
                                               std::shared_ptr<ProxyCache> cache) {
  auto next = std::make_shared<LiveScene>(LiveScene{scene, std::move(cache), last_ ? last_->number + 1 : 1});
  steps_.emplace(next->number, Step{next->number, std::move(kind), std::move(text), scene});
  last_ = next;
  return next;
}

std::shared_ptr<const LiveScene> SceneLog::begin(const Scene& scene) {
  const std::lock_guard lock(mutex_);
  return add(scene, {}, {}, std::make_shared<ProxyCache>(scene));
}

std::shared_ptr<const LiveScene> SceneLog::replace(const Scene& scene, const std::string& json) {
  const std::lock_guard lock(mutex_);
  return add(scene, "scene", json, std::make_shared<ProxyCache>(scene));
}

Result<std::shared_ptr<const LiveScene>> SceneLog::edit(const SceneEdit& edit) {
  const std::lock_guard lock(mutex_);
  if (!last_) return bad_value("there is no scene yet", "edit", "a session that has begun");
  ASPERITY_TRY(Scene next, edited(last_->scene, edit));
  // The surfaces are the same, so what is remembered of them holds.
  return add(next, "edit", to_json(edit), last_->cache);
}

std::vector<SceneLog::Step> SceneLog::steps(std::uint64_t from, std::uint64_t to) {
  const std::lock_guard lock(mutex_);
  steps_.erase(steps_.begin(), steps_.lower_bound(from));
  std::vector<Step> found;
  for (auto it = steps_.upper_bound(from); it != steps_.end() && it->first <= to; ++it) found.push_back(it->second);
  return found;
}

std::optional<Scene> SceneLog::scene(std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  const auto it = steps_.find(number);
  if (it == steps_.end()) return std::nullopt;
  return it->second.scene;
}

// ----------------------------------------------------------------------------------------------------------- recorder

namespace {

using LiveKeyFrame = TelemetryKeyFrame<ProxyState>;
using LiveReader = TelemetryReader<ProxyState>;

/// What stands in a trace, in its order.
struct LiveEntry {
  TelemetryTick tick;
  std::vector<TraceEvent> unseen;          ///< of ticks that were lost, before the key frame
  std::optional<TraceKeyFrame> key_frame;  ///< before the events
  std::vector<TraceEvent> events;          ///< before the tick
};

Status write_entry(TraceWriter& writer, const LiveEntry& entry) {
  for (const TraceEvent& event : entry.unseen) ASPERITY_CHECK(writer.event(event));
  if (entry.key_frame) ASPERITY_CHECK(writer.key_frame(*entry.key_frame));
  for (const TraceEvent& event : entry.events) ASPERITY_CHECK(writer.event(event));
  return writer.append(entry.tick.record);
}

}  // namespace

class Recorder::Work {
 public:
  Work(TraceWriter writer, std::shared_ptr<LiveReader> reader, std::shared_ptr<SceneLog> scenes,
       const RecorderSettings& settings)
      : writer_(std::move(writer)), reader_(std::move(reader)), scenes_(std::move(scenes)), settings_(settings) {
    thread_ = std::thread([this] { run(); });
  }
  void wait() {
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] RecorderStatus status() const {
    const std::lock_guard lock(mutex_);
    RecorderStatus status = status_;
    // Now, not when the disk last let this one's thread go.
    status.lost += reader_->lost();
    return status;
  }
  [[nodiscard]] Status ended() const {
    const std::lock_guard lock(mutex_);
    return ended_;
  }

 private:
  void run() {
    LiveReader::Batch batch;
    auto flushed = std::chrono::steady_clock::now();
    while (reader_->take(batch, settings_.flush / 2)) {
      for (LiveKeyFrame& frame : batch.key_frames) coming_.push_back(std::move(frame));
      for (const TelemetryTick& tick : batch.ticks) keep(tick);
      const auto now = std::chrono::steady_clock::now();
      if (now - flushed >= settings_.flush / 2) {
        flushed = now;
        written(writer_.flush());
      }
      tell();
    }
    if (fault_at_) leave_fault();
    const Status end = failed_ ? success() : writer_.finish();
    written(end);
    tell();
    const std::lock_guard lock(mutex_);
    if (failed_) ended_ = *failed_;
  }

  void written(const Status& status) {
    if (!status && !failed_) failed_ = status.error();
  }

  void tell() {
    const std::lock_guard lock(mutex_);
    status_.ticks = writer_.records();
    status_.lost = unwritten_;
    if (failed_) status_.problem = failed_->message();
  }

  void keep(const TelemetryTick& tick) {
    LiveEntry entry{tick, {}, {}, {}};
    take_key_frame(entry);
    take_events(entry);
    if (failed_) {
      ++unwritten_;
    } else {
      written(write_entry(writer_, entry));
    }
    hold(std::move(entry));
  }

  /// The key frame that belongs before this tick; those of ticks that were lost are of no use.
  void take_key_frame(LiveEntry& entry) {
    const std::uint64_t tick = entry.tick.record.tick;
    while (!coming_.empty() && coming_.front().tick <= tick) {
      const LiveKeyFrame& frame = coming_.front();
      const std::optional<Scene> scene = scenes_->scene(frame.scene);
      if (frame.tick == tick && scene) {
        scenes_until(frame.scene, entry.unseen, tick);
        entry.key_frame = TraceKeyFrame{tick, save_loop_state(frame.state, frame.safety, *scene)};
      }
      coming_.pop_front();
    }
  }

  void take_events(LiveEntry& entry) {
    const TelemetryTick& tick = entry.tick;
    const std::uint64_t number = tick.record.tick;
    std::vector<TraceEvent>& events = entry.events;
    const auto add = [&](const char* kind, std::string text) { events.push_back({number, kind, std::move(text)}); };
    if (tick.lost > 0) add("lost", fmt::format("{}", tick.lost));
    if (tick.notes.acknowledged) add("acknowledge", {});
    if (tick.notes.raised != Fault::none) add("raise", std::string(to_string(tick.notes.raised)));
    if (tick.notes.released) add("released", {});
    scenes_until(tick.scene, events, number);
    if (tick.notes.withheld) add("stopping", {});
  }

  void scenes_until(std::uint64_t scene, std::vector<TraceEvent>& events, std::uint64_t tick) {
    if (scene <= scene_) return;
    for (SceneLog::Step& step : scenes_->steps(scene_, scene)) {
      if (step.kind.empty()) continue;
      events.push_back({tick, step.kind, step.text});
    }
    scene_ = scene;
  }

  // --- what a fault leaves ---

  /// Keeps the last ticks, from a key frame on, and sees whether something has gone wrong.
  void hold(LiveEntry entry) {
    const bool is_fault = entry.tick.fault != Fault::none && last_fault_ == Fault::none;
    last_fault_ = entry.tick.fault;
    held_seconds_ += entry.tick.record.dt.count();
    held_.push_back(std::move(entry));
    if (is_fault && !fault_at_) {
      fault_at_ = held_.back().tick.record.tick;
      // That tick's own length, which may be what is wrong with it, lies before it.
      behind_ = -held_.back().tick.record.dt.count();
    }
    if (fault_at_) {
      behind_ += held_.back().tick.record.dt.count();
      if (behind_ > settings_.after.count()) leave_fault();
    }
    let_go();
  }

  /// Forgets what is before the last key frame that is old enough; where none comes, what is much older.
  void let_go() {
    constexpr double longest = 4.0;  // times as long as is asked for
    if (fault_at_ || held_seconds_ < settings_.before.count()) return;
    double seconds = held_seconds_;
    std::size_t from = 0;
    for (std::size_t i = 0; i < held_.size(); ++i) {
      if (seconds < settings_.before.count()) break;
      if (held_[i].key_frame) from = i;
      seconds -= held_[i].tick.record.dt.count();
    }
    for (std::size_t i = 0; i < from || (!held_.empty() && held_seconds_ > longest * settings_.before.count()); ++i) {
      held_seconds_ -= held_.front().tick.record.dt.count();
      for (const auto* events : {&held_.front().unseen, &held_.front().events}) {
        for (const TraceEvent& event : *events) remember(event);
      }
      held_.pop_front();
    }
  }

  /// Keeps how the scene has come about that the ticks which are held begin with. Of a number that is turned again and
  /// again only the last value counts.
  void remember(const TraceEvent& event) {
    if (event.kind == "scene") past_.clear();
    if (event.kind != "scene" && event.kind != "edit") return;
    if (!past_.empty() && past_.back().kind == "edit" && event.kind == "edit") {
      const Result<SceneEdit> last = parse_scene_edit(past_.back().text);
      const Result<SceneEdit> next = parse_scene_edit(event.text);
      if (last && next && last->kind == next->kind && last->instance == next->instance) past_.pop_back();
    }
    past_.push_back(event);
  }

  void leave_fault() {
    const std::uint64_t at = std::exchange(fault_at_, std::nullopt).value_or(0);
    if (settings_.fault_prefix.empty() || held_.empty()) return;
    if (faults_ == most_faults) {
      const std::lock_guard lock(mutex_);
      status_.fault_problem = fmt::format("there were more than {} faults", most_faults);
      return;
    }
    const auto is_it = [&](const LiveEntry& entry) { return entry.tick.record.tick == at; };
    const auto found = std::find_if(held_.begin(), held_.end(), is_it);
    const Fault fault = found != held_.end() ? found->tick.fault : last_fault_;
    std::string path = fmt::format("{}-{}.asptrace", settings_.fault_prefix, ++faults_);
    const Status status = write_fault(path, fault, at);
    const std::lock_guard lock(mutex_);
    if (status) {
      status_.faults.push_back(std::move(path));
    } else {
      status_.fault_problem = status.error().message();
    }
  }

  /// Written aside and renamed: whoever finds it finds it whole.
  [[nodiscard]] Status write_fault(const std::string& path, Fault fault, std::uint64_t at) const {
    const std::string part = path + ".part";
    Status status = write_fault_aside(part, fault, at);
    std::error_code problem;
    if (status) std::filesystem::rename(part, path, problem);
    if (problem) status = Error{ErrorCode::file_unwritable, "cannot be renamed: " + problem.message(), path, {}, {}};
    if (!status) std::filesystem::remove(part, problem);
    return status;
  }
  [[nodiscard]] Status write_fault_aside(const std::string& part, Fault fault, std::uint64_t at) const {
    TraceMetadata metadata = settings_.metadata;
    metadata.extra[trace_fault_key] = fmt::format("{} (tick {})", fault_sentence(fault), at);
    ASPERITY_TRY(TraceWriter writer, TraceWriter::open(part, metadata));
    const std::uint64_t first = held_.front().tick.record.tick;
    for (const TraceEvent& event : past_) ASPERITY_CHECK(writer.event({first, event.kind, event.text}));
    for (const LiveEntry& entry : held_) ASPERITY_CHECK(write_entry(writer, entry));
    return writer.finish();
  }

  TraceWriter writer_;
  std::shared_ptr<LiveReader> reader_;
  std::shared_ptr<SceneLog> scenes_;
  RecorderSettings settings_;
  std::deque<LiveKeyFrame> coming_;
  std::uint64_t scene_ = 0;       ///< that the file has come to
  std::vector<TraceEvent> past_;  ///< "scene" and "edit" before what is held
  std::deque<LiveEntry> held_;    ///< the last ticks
  double held_seconds_ = 0.0;
  std::optional<std::uint64_t> fault_at_;  ///< a fault whose trace is still to be written
  double behind_ = 0.0;                    ///< s since then
  Fault last_fault_ = Fault::none;
  static constexpr int most_faults = 32;
  int faults_ = 0;
  std::uint64_t unwritten_ = 0;
  std::optional<Error> failed_;
  mutable std::mutex mutex_;
  RecorderStatus status_;
  Status ended_ = success();
  std::thread thread_;
};

Result<std::unique_ptr<Recorder>> Recorder::start(std::shared_ptr<TelemetryReader<ProxyState>> reader,
                                                  std::shared_ptr<SceneLog> scenes, const RecorderSettings& settings) {
  using std::chrono::milliseconds;
  if (settings.flush < milliseconds(2))
    return bad_value(fmt::format("is {} ms", settings.flush.count()), "flush", "a time of 2 ms or more");
  // Frames are closed by time, not by count.
  ASPERITY_TRY(TraceWriter writer, TraceWriter::open(settings.path, settings.metadata, {.records_per_frame = 4096}));
  return std::unique_ptr<Recorder>(
      new Recorder(std::make_unique<Work>(std::move(writer), std::move(reader), std::move(scenes), settings)));
}

Recorder::Recorder(std::unique_ptr<Work> work) : work_(std::move(work)) {}
Recorder::~Recorder() {
  static_cast<void>(finish().ok());
}
RecorderStatus Recorder::status() const {
  return work_->status();
}
Status Recorder::finish() {
  work_->wait();
  return work_->ended();
}

}  // namespace asperity
