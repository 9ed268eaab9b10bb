// asperity replay: renders a recorded run again and checks that every force is bit-equal.

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "apps/asperity/command.h"
#include "asperity/io/experiment.h"
#include "asperity/io/trace_file.h"
#include "asperity/render/step.h"
#include "asperity/servo/safety_stage.h"

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

Result<Comparison> play(const Trace& trace, const Experiment& experiment, const Progress& progress) {
  ASPERITY_TRY(SafetyStage safety, SafetyStage::build(SafetySettings::from_profile(experiment.device)));
  ProxyState state;
  ProxyCache cache(experiment.scene);
  Comparison comparison;
  for (std::size_t i = 0; i < trace.records.size(); ++i) {
    const TraceRecord& record = trace.records[i];
    // What was in memory then is what is felt now.
    state.wanted_level = record.rendered.level;
    ASPERITY_CHECK(fetch_volumes(experiment.scene, state, record.probe));
    const ForceSample rendered = step(experiment.scene, state, cache, record.probe, record.dt);
    compare_tick(record, rendered, safety.apply(rendered, record.probe, record.dt).force, comparison);
    const Vec3& before = trace.records[i == 0 ? 0 : i - 1].probe.pose.position;
    measure(record, rendered.wrench.force, (record.probe.pose.position - before).norm(), comparison);
    if (progress && i % 1000 == 0)
      progress("replaying", static_cast<double>(i) / static_cast<double>(trace.records.size()));
  }
  return comparison;
}

/// The scene of a trace: one that says nothing of a budget is of a time when ticks had none.
std::string scene_of(const Trace& trace) {
  Json scene = Json::parse(trace.metadata.scene, nullptr, false);
  if (!scene.is_object() || scene.contains("budget")) return trace.metadata.scene;
  scene["budget"] = 0;
  return scene.dump();
}

Result<int> replay(const std::string& path, const Console& console) {
  const Progress progress = console.progress();
  ASPERITY_TRY(const Trace trace, read_trace(path));
  if (trace.metadata.scene.empty()) {
    return Error{ErrorCode::mismatch,
                 "holds no scene, so that it cannot be replayed",
                 path,
                 {},
                 "a trace written by asperity touch"};
  }
  if (trace.records.empty()) {
    const std::string reason = trace.damage.empty() ? std::string() : ": " + trace.damage;
    return Error{ErrorCode::mismatch, "holds no whole tick" + reason, path, {}, "a trace with at least one tick"};
  }
  ASPERITY_TRY(const Experiment experiment, parse_experiment(scene_of(trace), ".", path + " (scene)", progress));
  ASPERITY_TRY(const Comparison comparison, play(trace, experiment, progress));
  const bool equal = comparison.different == 0;
  if (console.json) {
    console.print(Json{{"trace", path},
                       {"scene", experiment.name},
                       {"ticks", trace.records.size()},
                       {"different", comparison.different},
                       {"first_difference", comparison.first},
                       {"largest_difference_n", comparison.largest},
                       {"at_rest_over_1e-9_n", comparison.rest_over},
                       {"sliding_over_1e-6_n", comparison.sliding_over},
                       {"ticks_over", comparison.ticks_over},
                       {"force_hash", format_hash(force_hash(trace.records))},
                       {"complete", trace.complete},
                       {"damage", trace.damage}});
  } else if (equal) {
    std::cout << fmt::format("{}: {} ticks replayed, every force bit-equal (hash {})\n", path, trace.records.size(),
                             format_hash(force_hash(trace.records)));
  }
  if (!equal) {
    std::cerr << fmt::format("asperity: {}: {} of {} ticks differ; {}\n", path, comparison.different,
                             trace.records.size(), comparison.first);
  }
  if (!trace.complete) std::cerr << fmt::format("asperity: {}: the trace is not whole: {}\n", path, trace.damage);
  return equal && trace.complete ? exit_success : exit_check_failed;
}

}  // namespace

void add_replay(Arguments& program, Console& console, Action& action) {
  Arguments command = program.command("replay", "Render a recorded run again; every force must be bit-equal");
  auto path = std::make_shared<std::string>();
  command.option("TRACE", *path, "A trace written by asperity touch").required();
  add_console_options(command, console);
  command.closing_words(
      "The scene is rebuilt from the trace; meshes and maps are read from where they were. Exit code 1: a force "
      "differs, or the trace is cut.\n"
      "Examples:\n"
      "  asperity replay out/icosphere-relief/trace.asptrace\n"
      "  asperity replay out/bunny/trace.asptrace --json");
  command.when_called([path, &console, &action] { action = [path, &console] { return replay(*path, console); }; });
}

}  // namespace asperity::program
