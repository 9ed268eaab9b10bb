#include "apps/asperity/inspect_trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "apps/asperity/run.h"
#include "apps/asperity/timeline.h"
#include "asperity/io/live_trace.h"
#include "asperity/io/trace_file.h"
#include "asperity/render/law_registry.h"
#include "asperity/study/series.h"

namespace asperity::program {
namespace {

constexpr std::size_t most_events_told = 40;
constexpr std::size_t most_ticks_told = 12;
constexpr double last_seconds = 2.0;

/// A text in one line, cut where it is long.
std::string in_brief(const std::string& text) {
  constexpr std::size_t longest = 70;
  std::string line = text.substr(0, longest);
  std::replace_if(
      line.begin(), line.end(), [](unsigned char c) { return c < ' '; }, ' ');
  return text.size() > longest ? line + " ..." : line;
}

std::string event_line(const TraceEvent& event) {
  std::string what = in_brief(event.text);
  if (event.kind == "scene") {
    const Json scene = Json::parse(event.text, nullptr, false);
    what = scene.is_object() && scene.contains("name") && scene["name"].is_string()
               ? fmt::format("\"{}\"", scene["name"].get<std::string>())
               : fmt::format("{} bytes", event.text.size());
  }
  return fmt::format("before tick {}: {}{}{}", event.tick, event.kind, what.empty() ? "" : " ", what);
}

void add_events(const Trace& trace, TraceFindings& found) {
  std::map<std::string, std::size_t> kinds;
  Json events = Json::array();
  for (const TraceEvent& event : trace.events) {
    ++kinds[event.kind];
    if (events.size() >= most_events_told) continue;
    events.push_back(Json{{"tick", event.tick}, {"kind", event.kind}, {"text", in_brief(event.text)}});
    found.happened.push_back(event_line(event));
  }
  if (trace.events.size() > most_events_told)
    found.happened.push_back(fmt::format("and {} more", trace.events.size() - most_events_told));
  std::string counted;
  for (const auto& [kind, count] : kinds) counted += fmt::format("{}{} {}", counted.empty() ? "" : ", ", count, kind);
  if (!trace.events.empty()) found.facts.push_back({"events", counted});
  Json keys = Json::array();
  for (const TraceKeyFrame& key : trace.key_frames)
    if (keys.size() < most_events_told) keys.push_back(key.tick);
  if (!trace.key_frames.empty()) {
    found.facts.push_back({"key frames", fmt::format("{}, before ticks {} to {}", trace.key_frames.size(),
                                                     trace.key_frames.front().tick, trace.key_frames.back().tick)});
  }
  found.json["events"] = std::move(events);
  found.json["event_counts"] = kinds;
  found.json["key_frames"] = trace.key_frames.size();
  found.json["key_frame_ticks"] = std::move(keys);
}

/// The records of the last two seconds, by their own lengths.
std::span<const TraceRecord> last_records(const Trace& trace) {
  double seconds = 0.0;
  std::size_t first = trace.records.size();
  while (first > 0 && seconds < last_seconds) seconds += std::max(0.0, trace.records[--first].dt.count());
  return std::span(trace.records).subspan(first);
}

/// What the ticks before a fault were like: at their most, and the very last ones one by one.
void add_last(const Trace& trace, TraceFindings& found) {
  const std::span<const TraceRecord> last = last_records(trace);
  double force = 0.0;
  double rendered = 0.0;
  double speed = 0.0;
  double longest = 0.0;
  double seconds = 0.0;
  for (const TraceRecord& record : last) {
    force = std::max(force, record.commanded.norm());
    rendered = std::max(rendered, record.rendered.wrench.force.norm());
    speed = std::max(speed, record.probe.twist.linear.norm());
    longest = std::max(longest, record.dt.count());
    seconds += record.dt.count();
  }
  found.last.push_back(
      fmt::format("{} ticks in {}: at most {:.3g} N commanded, {:.3g} N rendered, {:.3g} mm/s, {} from "
                  "one tick to the next",
                  last.size(), format_seconds(seconds), force, rendered, 1e3 * speed, format_seconds(longest)));
  Json ticks = Json::array();
  for (const TraceRecord& record : last.last(std::min(last.size(), most_ticks_told))) {
    std::string flags;
    for (const Named<TickFlag>& flag : Names<TickFlag>::table)
      if (record.rendered.flags.has(flag.value)) flags += fmt::format("{}{}", flags.empty() ? " " : ", ", flag.name);
    found.last.push_back(fmt::format("tick {}: {:.3g} N, {:.3g} mm/s, after {}{}", record.tick, record.commanded.norm(),
                                     1e3 * record.probe.twist.linear.norm(), format_seconds(record.dt.count()), flags));
    ticks.push_back(Json{{"tick", record.tick},
                         {"commanded_n", finite_or_null(record.commanded.norm())},
                         {"rendered_n", finite_or_null(record.rendered.wrench.force.norm())},
                         {"speed_m_s", finite_or_null(record.probe.twist.linear.norm())},
                         {"dt_s", finite_or_null(record.dt.count())},
                         {"flags", record.rendered.flags.bits()}});
  }
  found.json["last"] = Json{{"ticks", last.size()},
                            {"max_commanded_n", finite_or_null(force)},
                            {"max_rendered_n", finite_or_null(rendered)},
                            {"max_speed_m_s", finite_or_null(speed)},
                            {"longest_dt_s", finite_or_null(longest)},
                            {"last_ticks", std::move(ticks)}};
}

std::string fault_of(const Trace& trace) {
  const auto it = trace.metadata.extra.find(trace_fault_key);
  return it == trace.metadata.extra.end() ? std::string() : it->second;
}

}  // namespace

Result<TraceFindings> inspect_trace_file(const std::string& file) {
  ASPERITY_TRY(const Trace trace, read_trace(file));
  TraceFindings found;
  const auto fact = [&](std::string name, std::string value) {
    found.facts.push_back({std::move(name), std::move(value)});
  };
  const std::string fault = fault_of(trace);
  if (!fault.empty()) {
    fact("fault", fault);
    found.json["fault"] = fault;
  }
  fact("ticks", fmt::format("{} at {:g} Hz", trace.records.size(), trace.metadata.rate));
  fact("written by", trace.metadata.program);
  fact("command", trace.metadata.command);
  fact("device", trace.metadata.device);
  fact("force hash", format_hash(force_hash(trace.records)));
  double largest = 0.0;
  std::size_t contact = 0;
  for (const TraceRecord& record : trace.records) {
    largest = std::max(largest, record.commanded.norm());
    contact += record.rendered.flags.has(TickFlag::contact) ? 1U : 0U;
  }
  fact("in contact", fmt::format("{} ticks, at most {:.3g} N", contact, largest));
  add_events(trace, found);
  if (!fault.empty() && !trace.records.empty()) add_last(trace, found);
  if (!trace.complete) found.problems.push_back("not whole: " + trace.damage);
  if (const auto gaps = trace_gaps(trace); !gaps) {
    found.problems.push_back(gaps.error().what);
  } else if (!gaps->empty()) {
    std::uint64_t lost = 0;
    for (const TraceGap& gap : *gaps) lost += gap.lost;
    found.problems.push_back(
        fmt::format("{} ticks are missing, in {} gap(s): the recorder could not keep them", lost, gaps->size()));
  }
  return found;
}

Status write_trace_report(const std::string& trace_file, const std::string& page, const Console& console) {
  const Progress progress = console.progress();
  ASPERITY_TRY(const Trace trace, read_trace(trace_file));
  ASPERITY_TRY(const Timeline timeline, build_timeline(trace, trace_file, progress));
  std::shared_ptr<const Scene> scene = timeline.anew.front();
  for (const Happening& happening : timeline.happenings)
    if (happening.scene != nullptr) scene = happening.scene;
  const std::span<const TraceRecord> last = last_records(trace);
  RunReport report;
  report.origin = report_origin(timeline.experiment, console);
  report.origin.command = trace.metadata.command;
  if (const std::string fault = fault_of(trace); !fault.empty()) report.origin.warnings.push_back("fault: " + fault);
  report.origin.notes = {fmt::format("the last {} of the trace's {} ticks, in the scene that was felt at its end",
                                     last.size(), trace.records.size())};
  for (const TraceEvent& event : trace.events)
    if (event.tick >= last.front().tick && report.origin.notes.size() < most_events_told)
      report.origin.notes.push_back(event_line(event));
  report.law = law_names_of(*scene);
  report.setup = setup_facts(timeline.experiment);
  report.series = derive_series(last, *scene, timeline.experiment.path);
  report.metrics = measure_run(last, report.series, timeline.experiment.path);
  return write_run_report(page, report);
}

}  // namespace asperity::program
