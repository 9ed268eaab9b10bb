// asperity replay: renders a recorded run again and checks that every force is bit-equal.

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/asperity/command.h"
#include "apps/asperity/replay_live.h"
#include "apps/asperity/timeline.h"

namespace asperity::program {
namespace {

bool same_bits(const Vec3& a, const Vec3& b) {
  return std::memcmp(a.data(), b.data(), 3 * sizeof(double)) == 0;
}

std::string text_of(const Vec3& v) {
  return fmt::format("({:.17g}, {:.17g}, {:.17g})", v.x(), v.y(), v.z());
}

struct Comparison {
  std::uint64_t different = 0;
  std::string first;  ///< which tick, and what differs
  // Of the rendered forces that differ:
  std::uint64_t rest_over = 0;            ///< by more than `rest_bound` while the probe stood still
  std::uint64_t sliding_over = 0;         ///< by more than `sliding_bound`
  double largest = 0.0;                   ///< N
  std::vector<std::uint64_t> ticks_over;  ///< the ticks beyond the bounds: the first hundred
};

// What another order of the same arithmetic may change (N), and what counts as standing still between two ticks (m).
constexpr double rest_bound = 1e-9;
constexpr double sliding_bound = 1e-6;
constexpr double still = 1e-9;

void measure(const TraceRecord& recorded, const Vec3& rendered, double moved, Comparison& comparison) {
  const double difference = (recorded.rendered.wrench.force - rendered).norm();
  comparison.largest = std::max(comparison.largest, difference);
  const bool resting = moved < still;
  if (!(difference > (resting ? rest_bound : sliding_bound))) return;
  ++(resting ? comparison.rest_over : comparison.sliding_over);
  constexpr std::size_t most_told = 100;
  if (comparison.ticks_over.size() < most_told) comparison.ticks_over.push_back(recorded.tick);
}

void compare_tick(const TraceRecord& recorded, const ForceSample& rendered, const Vec3& commanded,
                  Comparison& comparison) {
  const auto check = [&](const char* what, const Vec3& before, const Vec3& now) {
    if (same_bits(before, now)) return true;
    ++comparison.different;
    if (comparison.first.empty()) {
      comparison.first =
          fmt::format("tick {}: {} was {} N, is {} N", recorded.tick, what, text_of(before), text_of(now));
    }
    return false;
  };
  if (!check("rendered force", recorded.rendered.wrench.force, rendered.wrench.force)) return;
  if (!check("rendered torque", recorded.rendered.wrench.torque, rendered.wrench.torque)) return;
  check("commanded force", recorded.commanded, commanded);
}

/// What was compared with the trace.
struct Replayed {
  Comparison from_start;
  std::uint64_t judged = 0;         ///< ticks, from the start or, with --from, from a key frame
  std::uint64_t not_judged = 0;     ///< ticks that are there, after a gap and before the next key frame
  std::uint64_t key_frames = 0;     ///< that were gone on from
  std::uint64_t key_different = 0;  ///< of those, as many as do not go on as the trace does
  std::string first_key;            ///< the first of them: which tick, and what differs
};

/// Renders a trace from its start, and from each key frame to the next one; or from one key frame to the end.
class Replay {
 public:
  Replay(const Trace& trace, const Timeline& timeline, std::optional<std::size_t> from, TracePlayer main,
         TracePlayer branch)
      : trace_(trace), timeline_(timeline), from_(from), main_(std::move(main)), branch_(std::move(branch)) {}

  Result<Replayed> run(const Progress& progress) {
    if (timeline_.begins && !from_) main_.begin();
    for (std::size_t i = 0; i < trace_.records.size(); ++i) {
      for (; next_ < timeline_.happenings.size() && timeline_.happenings[next_].record <= i; ++next_)
        happen(timeline_.happenings[next_]);
      ASPERITY_CHECK(tick(i));
      if (progress && i % 1000 == 0)
        progress("replaying", static_cast<double>(i) / static_cast<double>(trace_.records.size()));
    }
    end_branch();
    return std::move(done_);
  }

 private:
  void happen(const Happening& happening) {
    if (happening.what == Happening::What::gap) {
      main_.lose();
      end_branch();
    } else if (happening.what == Happening::What::key_frame) {
      go_on_from(happening);
    } else {
      main_.happen(happening);
      branch_.happen(happening);
    }
  }

  void go_on_from(const Happening& happening) {
    if (from_ && happening.key != *from_ && !(main_was_known_ && !main_.knows())) return;
    if (!main_.knows()) main_.go_on_from(*happening.state);
    main_was_known_ = true;
    if (from_) return;
    end_branch();
    branch_.go_on_from(*happening.state);
    ++done_.key_frames;
  }

  void end_branch() {
    if (branch_.knows() && on_branch_.different > 0) {
      ++done_.key_different;
      if (done_.first_key.empty()) done_.first_key = on_branch_.first;
    }
    on_branch_ = {};
    branch_.lose();
  }

  Status tick(std::size_t i) {
    const TraceRecord& record = trace_.records[i];
    if (main_.knows()) {
      ASPERITY_CHECK(main_.fetch(record));
      const TracePlayer::Answer answer = main_.render(record);
      compare_tick(record, answer.rendered, answer.commanded, done_.from_start);
      const Vec3& before = trace_.records[i == 0 ? 0 : i - 1].probe.pose.position;
      measure(record, answer.rendered.wrench.force, (record.probe.pose.position - before).norm(), done_.from_start);
      ++done_.judged;
    } else if (!from_ || main_was_known_) {
      ++done_.not_judged;
    }
    if (branch_.knows()) {
      ASPERITY_CHECK(branch_.fetch(record));
      const TracePlayer::Answer answer = branch_.render(record);
      compare_tick(record, answer.rendered, answer.commanded, on_branch_);
    }
    return success();
  }

  const Trace& trace_;
  const Timeline& timeline_;
  std::optional<std::size_t> from_;
  TracePlayer main_;
  TracePlayer branch_;
  bool main_was_known_ = false;
  std::size_t next_ = 0;
  Replayed done_;
  Comparison on_branch_;
};

Result<Replayed> play(const Trace& trace, const Timeline& timeline, std::optional<std::size_t> from,
                      const Progress& progress) {
  ASPERITY_TRY(TracePlayer main, TracePlayer::build(timeline));
  ASPERITY_TRY(TracePlayer branch, TracePlayer::build(timeline));
  return Replay(trace, timeline, from, std::move(main), std::move(branch)).run(progress);
}

struct ReplayOptions {
  std::string path;
  std::size_t from = 0;  ///< number of a key frame, from 1; 0: the start
  bool live = false;
};

/// "3 of 12 ticks ..." where there is something to tell.
std::string words_of_gaps(const Trace& trace, const Timeline& timeline, const Replayed& done) {
  if (timeline.lost == 0 && done.not_judged == 0) return {};
  return fmt::format(
             "{} ticks could not be judged: {} were lost when it was recorded, and {} come between a loss, or "
             "a beginning that is not there, and the next key frame",
             timeline.lost + done.not_judged, timeline.lost, done.not_judged) +
         (trace.key_frames.empty() ? " (it has none)" : "");
}

Json replay_json(const std::string& path, const Trace& trace, const Timeline& timeline, const Replayed& done) {
  const Comparison& comparison = done.from_start;
  std::map<std::string, std::uint64_t> kinds;
  for (const TraceEvent& event : trace.events) ++kinds[event.kind];
  return Json{{"trace", path},
              {"scene", timeline.experiment.name},
              {"ticks", trace.records.size()},
              {"judged", done.judged},
              {"not_judged", done.not_judged},
              {"lost", timeline.lost},
              {"different", comparison.different},
              {"first_difference", comparison.first},
              {"largest_difference_n", comparison.largest},
              {"at_rest_over_1e-9_n", comparison.rest_over},
              {"sliding_over_1e-6_n", comparison.sliding_over},
              {"ticks_over", comparison.ticks_over},
              {"events", kinds},
              {"key_frames", done.key_frames},
              {"key_frames_different", done.key_different},
              {"first_key_frame_difference", done.first_key},
              {"force_hash", format_hash(force_hash(trace.records))},
              {"complete", trace.complete},
              {"damage", trace.damage}};
}

void print_replayed(const ReplayOptions& options, const Trace& trace, const Timeline& timeline, const Replayed& done) {
  const Comparison& comparison = done.from_start;
  if (comparison.different == 0 && done.judged > 0) {
    std::cout << fmt::format("{}: {} ticks replayed{}, every force bit-equal (hash {})\n", options.path, done.judged,
                             options.from > 0 ? fmt::format(" from key frame {}", options.from) : std::string(),
                             format_hash(force_hash(trace.records)));
  }
  if (done.key_frames > 0 && done.key_different == 0)
    std::cout << fmt::format("{}: {} key frames, each goes on bit-equal\n", options.path, done.key_frames);
  if (std::string words = words_of_gaps(trace, timeline, done); !words.empty())
    std::cout << fmt::format("{}: {}\n", options.path, words);
}

Result<int> replay_offline(const ReplayOptions& options, const Trace& trace, const Timeline& timeline,
                           const Console& console, const Progress& progress) {
  std::optional<std::size_t> from;
  if (options.from > 0) from = options.from - 1;
  ASPERITY_TRY(const Replayed done, play(trace, timeline, from, progress));
  const Comparison& comparison = done.from_start;
  if (from && done.judged == 0) {
    return bad_value(fmt::format("is {}, and no tick follows such a key frame", options.from), "--from",
                     fmt::format("1 to {}", trace.key_frames.size()))
        .in_file(options.path);
  }
  if (console.json) {
    console.print(replay_json(options.path, trace, timeline, done));
  } else {
    print_replayed(options, trace, timeline, done);
  }
  if (comparison.different > 0) {
    std::cerr << fmt::format("asperity: {}: {} of {} ticks differ; {}\n", options.path, comparison.different,
                             done.judged, comparison.first);
  }
  if (done.key_different > 0) {
    std::cerr << fmt::format("asperity: {}: {} of {} key frames do not go on as the trace does; {}\n", options.path,
                             done.key_different, done.key_frames, done.first_key);
  }
  if (!trace.complete)
    std::cerr << fmt::format("asperity: {}: the trace is not whole: {}\n", options.path, trace.damage);
  const bool equal = comparison.different == 0 && done.key_different == 0 && done.judged > 0;
  return equal && trace.complete ? exit_success : exit_check_failed;
}

Result<int> replay(const ReplayOptions& options, const Console& console) {
  const Progress progress = console.progress();
  ASPERITY_TRY(const Trace trace, read_trace(options.path));
  ASPERITY_TRY(const Timeline timeline, build_timeline(trace, options.path, progress));
  if (options.live) return replay_live(options.path, trace, timeline, console);
  return replay_offline(options, trace, timeline, console, progress);
}

}  // namespace

void add_replay(Arguments& program, Console& console, Action& action) {
  Arguments command = program.command("replay", "Render a recorded run again; every force must be bit-equal");
  auto options = std::make_shared<ReplayOptions>();
  command.option("TRACE", options->path, "A trace written by asperity touch or run").required();
  const Argument from = command.option("--from", options->from, "From this key frame to the end; 1 is the first");
  command.flag("--live", options->live, "On the servo thread, at the trace's own rate; told is how late its ticks are")
      .excludes(from);
  add_console_options(command, console);
  command.closing_words(
      "The scene is rebuilt from the trace; meshes and maps are read from where they were. Of a live session every "
      "scene, change and fault comes again at its tick, from the start and from each key frame to the next one. Exit "
      "code 1: a force differs, or the trace is cut.\n"
      "Examples:\n"
      "  asperity replay out/icosphere-relief/trace.asptrace\n"
      "  asperity replay out/bunny/trace.asptrace --json\n"
      "  asperity replay live.asptrace --from 3\n"
      "  asperity replay live.asptrace --live");
  command.when_called(
      [options, &console, &action] { action = [options, &console] { return replay(*options, console); }; });
}

}  // namespace asperity::program
