#include "apps/asperity/timeline.h"

#include <fmt/format.h>

#include <utility>

#include "apps/asperity/command.h"
#include "asperity/io/scene_edit_json.h"

namespace asperity::program {
namespace {

/// Goes through a trace once, from its beginning to its end.
class TimelineBuilder {
 public:
  TimelineBuilder(const Trace& trace, const std::string& path, const Progress& progress, Timeline& timeline)
      : trace_(trace), path_(path), progress_(progress), timeline_(timeline) {
    scene_ = std::make_shared<const Scene>(timeline.experiment.scene);
    timeline.anew.push_back(scene_);
  }

  Status build() {
    ASPERITY_TRY(const std::vector<TraceGap> gaps, in_trace(trace_gaps(trace_), {}));
    std::size_t gap = 0;
    for (std::size_t i = 0; i < trace_.records.size(); ++i) {
      record_ = i;
      const std::uint64_t tick = trace_.records[i].tick;
      if (gap < gaps.size() && gaps[gap].tick == tick) {
        add(Happening::What::gap).lost = gaps[gap].lost;
        timeline_.lost += gaps[gap++].lost;
      }
      ASPERITY_CHECK(build_until(tick));
    }
    timeline_.begins = trace_.records.front().tick == 0 || trace_.key_frames.empty();
    return success();
  }

 private:
  Happening& add(Happening::What what) {
    Happening& happening = timeline_.happenings.emplace_back();
    happening.what = what;
    happening.record = record_;
    return happening;
  }

  /// An error with the trace and where in it.
  template <class T>
  Result<T> in_trace(Result<T> result, const std::string& place) const {
    if (result) return result;
    Error error = std::move(result).error();
    if (!place.empty()) error.place = error.place.empty() ? place : place + ": " + error.place;
    return std::move(error).in_file(path_);
  }

  /// What comes before a tick, in the file's order.
  Status build_until(std::uint64_t tick) {
    for (;;) {
      const bool has_event = event_ < trace_.events.size() && trace_.events[event_].tick <= tick;
      const bool has_key = key_ < trace_.key_frames.size() && trace_.key_frames[key_].tick <= tick;
      if (has_key && (!has_event || trace_.key_frames[key_].events_before <= event_)) {
        ASPERITY_CHECK(key_frame(key_, tick));
        ++key_;
      } else if (has_event) {
        const TraceEvent& event = trace_.events[event_++];
        ASPERITY_CHECK(in_trace(happened(event), fmt::format("event \"{}\" before tick {}", event.kind, event.tick)));
      } else {
        return success();
      }
    }
  }

  Status key_frame(std::size_t key, std::uint64_t tick) {
    const TraceKeyFrame& frame = trace_.key_frames[key];
    // Of a tick that is missing nobody goes on.
    if (frame.tick != tick) return success();
    ASPERITY_TRY(LoopState state, in_trace(restore_loop_state(frame.state, *scene_),
                                           fmt::format("key frame {} before tick {}", key + 1, frame.tick)));
    Happening& happening = add(Happening::What::key_frame);
    happening.key = key;
    happening.state = std::make_shared<const LoopState>(std::move(state));
    ++timeline_.key_frames;
    return success();
  }

  Status happened(const TraceEvent& event) {
    if (event.kind == "scene") {
      ASPERITY_TRY(Experiment built, parse_experiment(scene_to_build(event.text), ".", {}, progress_));
      scene_ = std::make_shared<const Scene>(std::move(built.scene));
      timeline_.anew.push_back(scene_);
      add_scene();
    } else if (event.kind == "edit") {
      ASPERITY_TRY(const SceneEdit edit, parse_scene_edit(event.text));
      ASPERITY_TRY(Scene next, edited(*scene_, edit));
      scene_ = std::make_shared<const Scene>(std::move(next));
      add_scene();
    } else if (event.kind == "raise") {
      const std::optional<Fault> fault = value_named<Fault>(event.text);
      if (!fault) return bad_value(fmt::format("is \"{}\"", event.text), {}, name_list<Fault>());
      add(Happening::What::raise).fault = *fault;
    } else if (event.kind == "acknowledge") {
      add(Happening::What::acknowledge);
    } else if (event.kind == "released") {
      add(Happening::What::released);
    } else if (event.kind == "stopping") {
      add(Happening::What::stopping);
    } else if (event.kind != "lost" && event.kind != "note") {
      return refused(ErrorCode::mismatch, "is a kind of event that this program does not know", {},
                     "the program that wrote the trace, or a newer one");
    }
    return success();
  }

  void add_scene() {
    Happening& happening = add(Happening::What::scene);
    happening.scene = scene_;
    happening.cache = timeline_.anew.size() - 1;
  }

  const Trace& trace_;
  const std::string& path_;
  const Progress& progress_;
  Timeline& timeline_;
  std::shared_ptr<const Scene> scene_;
  std::size_t record_ = 0;
  std::size_t event_ = 0;
  std::size_t key_ = 0;
};

}  // namespace

std::string scene_to_build(const std::string& json) {
  Json scene = Json::parse(json, nullptr, false);
  if (!scene.is_object() || scene.contains("budget")) return json;
  scene["budget"] = 0;
  return scene.dump();
}

Result<Timeline> build_timeline(const Trace& trace, const std::string& path, const Progress& progress) {
  if (trace.metadata.scene.empty()) {
    return refused(ErrorCode::mismatch, "holds no scene, so that it cannot be replayed", {},
                   "a trace written by asperity touch or run")
        .in_file(path);
  }
  if (trace.records.empty()) {
    const std::string reason = trace.damage.empty() ? std::string() : ": " + trace.damage;
    return refused(ErrorCode::mismatch, "holds no whole tick" + reason, {}, "a trace with at least one tick")
        .in_file(path);
  }
  ASPERITY_TRY(Experiment experiment,
               parse_experiment(scene_to_build(trace.metadata.scene), ".", path + " (scene)", progress));
  Result<SafetySettings> safety = safety_of(trace.metadata, experiment.device);
  if (!safety) return std::move(safety).error().in_file(path);
  Timeline timeline{std::move(experiment), *safety, {}, {}, false, 0, 0};
  ASPERITY_CHECK(TimelineBuilder(trace, path, progress, timeline).build());
  return timeline;
}

Result<TracePlayer> TracePlayer::build(const Timeline& timeline) {
  ASPERITY_TRY(SafetyStage safety, SafetyStage::build(timeline.safety));
  return TracePlayer(timeline, std::move(safety));
}

TracePlayer::TracePlayer(const Timeline& timeline, SafetyStage safety)
    : scene_(timeline.anew.front().get()), safety_(std::move(safety)) {
  caches_.reserve(timeline.anew.size());
  for (const std::shared_ptr<const Scene>& scene : timeline.anew) caches_.emplace_back(*scene);
}

void TracePlayer::begin() noexcept {
  state_ = {};
  safety_.reset();
  knows_ = true;
}

void TracePlayer::go_on_from(const LoopState& state) noexcept {
  state_ = state.proxy;
  safety_.restore(state.safety);
  knows_ = true;
}

void TracePlayer::happen(const Happening& happening) noexcept {
  switch (happening.what) {
    case Happening::What::scene:
      scene_ = happening.scene.get();
      cache_ = happening.cache;
      break;
    case Happening::What::raise: safety_.raise(happening.fault); break;
    case Happening::What::acknowledge: safety_.acknowledge(); break;
    case Happening::What::released: safety_.released(); break;
    case Happening::What::stopping: safety_.withhold(); break;
    case Happening::What::gap:
    case Happening::What::key_frame: break;
  }
}

Status TracePlayer::fetch(const TraceRecord& record) {
  // What was in memory then is what is felt now.
  state_.wanted_level = record.rendered.level;
  return fetch_volumes(*scene_, state_, record.probe);
}

TracePlayer::Answer TracePlayer::render(const TraceRecord& record) noexcept {
  Answer answer;
  if (!knows_) return answer;
  state_.wanted_level = record.rendered.level;
  answer.rendered = step(*scene_, state_, caches_[cache_], record.probe, record.dt);
  answer.commanded = safety_.apply(answer.rendered, record.probe, record.dt).force;
  return answer;
}

}  // namespace asperity::program
