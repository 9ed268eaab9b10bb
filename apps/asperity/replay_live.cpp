#include "apps/asperity/replay_live.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <iostream>
#include <optional>
#include <thread>
#include <utility>

#include "apps/asperity/run.h"
#include "asperity/device/replay_device.h"
#include "asperity/servo/servo_thread.h"

namespace asperity::program {
namespace {

/// What the servo thread has found; read once that has ended.
struct LiveFindings {
  std::uint64_t judged = 0;
  std::uint64_t different = 0;
  std::uint64_t first = 0;  ///< tick
};

bool equal_bits(const Vec3& a, const Vec3& b) noexcept {
  return std::memcmp(a.data(), b.data(), 3 * sizeof(double)) == 0;
}

/// Renders one record after the other, whatever the loop says that the probe and the length of the tick are.
struct ReplayStep {
  const Trace* trace;
  const Timeline* timeline;
  TracePlayer player;
  std::shared_ptr<LiveFindings> findings;
  std::size_t record = 0;
  std::size_t next = 0;

  ForceSample operator()(const Timeline&, const ProbeSample&, Seconds) noexcept {
    if (record >= trace->records.size()) return {};
    if (record == 0 && timeline->begins) player.begin();
    for (; next < timeline->happenings.size() && timeline->happenings[next].record <= record; ++next) {
      const Happening& happening = timeline->happenings[next];
      if (happening.what == Happening::What::gap) player.lose();
      if (happening.what == Happening::What::key_frame && !player.knows()) player.go_on_from(*happening.state);
      player.happen(happening);
    }
    const TraceRecord& tick = trace->records[record++];
    if (!player.knows()) return {};
    const TracePlayer::Answer answer = player.render(tick);
    const bool equal = equal_bits(tick.rendered.wrench.force, answer.rendered.wrench.force) &&
                       equal_bits(tick.rendered.wrench.torque, answer.rendered.wrench.torque) &&
                       equal_bits(tick.commanded, answer.commanded);
    ++findings->judged;
    if (!equal && findings->different++ == 0) findings->first = tick.tick;
    return answer.rendered;
  }
};

struct DropRecord {
  void operator()(const TraceRecord&) const noexcept {}
};

std::string times_line(const char* name, const TimeCounts& times) {
  return fmt::format("{} p50 {}, p99.9 {}, at most {}\n", name, format_seconds(times.quantile(0.5)),
                     format_seconds(times.quantile(0.999)), format_seconds(times.longest));
}

Json times_json(const TimeCounts& times) {
  return Json{{"p50_s", times.quantile(0.5)}, {"p999_s", times.quantile(0.999)}, {"max_s", times.longest}};
}

}  // namespace

Result<int> replay_live(const std::string& path, const Trace& trace, const Timeline& timeline, const Console& console) {
  using Loop = ServoThread<Timeline, ReplayStep, ReplayDevice, DropRecord>;
  std::vector<ProbeSample> probes;
  for (const TraceRecord& record : trace.records) probes.push_back(record.probe);
  ASPERITY_TRY(ReplayDevice device, ReplayDevice::build(std::move(probes)));
  ASPERITY_TRY(TracePlayer player, TracePlayer::build(timeline));
  const auto findings = std::make_shared<LiveFindings>();
  ServoSettings settings;
  settings.rate = trace.metadata.rate;
  settings.safety = timeline.safety;
  settings.max_ticks = trace.records.size();
  const Progress progress = console.progress();
  Result<std::unique_ptr<Loop>> started =
      Loop::start(std::shared_ptr<const Timeline>(std::shared_ptr<void>(), &timeline),
                  ReplayStep{&trace, &timeline, std::move(player), findings}, std::move(device), {}, settings);
  if (!started) return std::move(started).error().in_file(path);
  Loop& loop = **started;
  while (!loop.ended()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const auto ticks = static_cast<double>(loop.meters().lateness.counts().total);
    if (progress) progress("replaying", std::min(1.0, ticks / static_cast<double>(settings.max_ticks)));
  }
  const SessionSummary summary = loop.stop();
  const TimeCounts lateness = loop.meters().lateness.counts();
  const TimeCounts step = loop.meters().step.counts();
  if (console.json) {
    console.print(Json{{"trace", path},
                       {"scene", timeline.experiment.name},
                       {"rate_hz", settings.rate},
                       {"ticks", trace.records.size()},
                       {"judged", findings->judged},
                       {"different", findings->different},
                       {"missed", summary.missed},
                       {"lateness", times_json(lateness)},
                       {"step", times_json(step)},
                       {"complete", trace.complete},
                       {"damage", trace.damage}});
  } else {
    std::cout << fmt::format("{}: {} ticks replayed at {:g} Hz, {}\n", path, findings->judged, settings.rate,
                             findings->different == 0 ? "every force bit-equal" : "not all of them bit-equal");
    std::cout << times_line("late by", lateness) << times_line("a tick takes", step)
              << fmt::format("missed {} of {} ticks\n", summary.missed, summary.ticks + summary.missed);
  }
  if (findings->different > 0) {
    std::cerr << fmt::format("asperity: {}: {} of {} ticks differ, the first is {}; replay without --live says how\n",
                             path, findings->different, findings->judged, findings->first);
  }
  for (const RealtimeGrant& grant : loop.grants())
    if (!grant.got) console.note(fmt::format("{} was refused ({})", grant.asked, grant.why));
  const bool equal = findings->different == 0 && findings->judged > 0;
  return equal && trace.complete ? exit_success : exit_check_failed;
}

}  // namespace asperity::program
