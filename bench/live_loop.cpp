// What a live loop costs beside its ticks, and whether it keeps its rate while scenes are handed over all the time.
// No test: it takes minutes, and its numbers are a quiet machine's.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <exception>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "asperity/io/experiment.h"
#include "asperity/io/recorder.h"
#include "asperity/servo/device_process.h"
#include "asperity/servo/servo_thread.h"

namespace {

using namespace asperity;

struct Options {
  std::string scene = "icosphere-relief";
  double seconds = 60.0;
  double rate = 1000.0;
  double swap_milliseconds = 10.0;
  std::string trace;
};

/// Tells the hub, and sees that the safety stage has looked at what is sent.
struct Feed {
  SceneFeed hub;
  std::uint64_t* unchecked;
  void operator()(const LiveTick<LiveScene, SceneStep>& tick) const noexcept {
    hub(tick);
    if (tick.record.commanded != tick.safety.last_force()) ++*unchecked;
  }
};

double quantile(std::vector<double>& values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

/// A stroke that was played before, through a port or without one.
struct Played {
  const ProbeSample* next;
  SharedPort* port;
  ProbeSample read() noexcept {
    if (port != nullptr) static_cast<void>(port->read());
    return *next++;
  }
  void apply(const Vec3& force, Seconds) noexcept {
    if (port != nullptr) port->write(force);
  }
  [[nodiscard]] Vec3 aim() const noexcept { return next[-1].pose.position; }
  [[nodiscard]] static bool finished() noexcept { return false; }
};

/// The same ticks in turns of a few: alone, in the loop, with a port, and with telemetry that a hub takes. What a turn
/// takes longer than the one before is what that costs.
Status measure_overhead(const Experiment& experiment) {
  constexpr std::size_t turn = 50;
  constexpr std::size_t rounds = 20;
  SceneLog scenes;
  const auto felt = scenes.begin(experiment.scene);
  ASPERITY_TRY(const auto board, SharedBoard::create());
  ASPERITY_TRY(SafetyStage safety, SafetyStage::build(SafetySettings::for_hands(experiment.device)));
  ASPERITY_TRY(IdealProbe path, IdealProbe::build(experiment.path, experiment.ideal));
  const auto telemetry = std::make_shared<Telemetry<ProxyState>>();
  const auto reader = telemetry->read(1'000'000'000);
  std::uint64_t unchecked = 0;
  const Feed feed{{telemetry}, &unchecked};
  SharedPort port(board);
  const Seconds dt(1.0 / experiment.rate);
  std::vector<ProbeSample> probes;
  while (!path.finished()) {
    probes.push_back(path.read());
    path.apply(Vec3::Zero(), dt);
  }
  LoopMeters meters;
  std::array<SceneStep, 4> steps;
  std::array<std::vector<double>, 3> extra;
  TelemetryReader<ProxyState>::Batch batch;
  for (std::size_t begin = 0, round = 0; round < rounds; begin += turn) {
    if (begin + turn > probes.size()) {
      begin = 0;
      ++round;
    }
    std::array<double, 4> took{};
    // Whoever is first finds nothing in the processor's caches: each in its turn.
    for (std::size_t i = 0; i < took.size(); ++i) {
      const std::size_t with = (i + begin / turn) % took.size();
      SceneStep& in_turn = steps[with];
      OfflineClock clock(dt);
      Played played{&probes[begin], with >= 2 ? &port : nullptr};
      const auto render = [&](const ProbeSample& probe, Seconds length) noexcept {
        return in_turn(*felt, probe, length);
      };
      const TickNotes notes;
      const auto record = [&](const TraceRecord& tick) noexcept {
        if (with == 3) feed(LiveTick<LiveScene, SceneStep>{tick, notes, *felt, in_turn, safety});
      };
      const std::int64_t first = SteadyTime::now();
      if (with == 0) {
        for (std::size_t k = 0; k < turn; ++k) render(probes[begin + k], dt);
      } else {
        run_loop(clock, render, played, safety, LoopSettings{.max_ticks = turn}, record, {}, &meters);
      }
      took[with] = static_cast<double>(SteadyTime::now() - first) / static_cast<double>(turn);
    }
    for (std::size_t i = 0; i < extra.size(); ++i) extra[i].push_back(took[i + 1] - took[0]);
    reader->take(batch, std::chrono::milliseconds(0));
  }
  fmt::print("on top of a step, a tick, medians of {} turns of {} ticks:\n", extra[0].size(), turn);
  const char* const names[] = {"loop, meters and safety stage", "and the port", "and telemetry"};
  for (std::size_t i = 0; i < extra.size(); ++i)
    fmt::print("  {:<30} {:5.0f} ns   (p99 {:.0f} ns)\n", names[i], quantile(extra[i], 0.5), quantile(extra[i], 0.99));
  return success();
}

/// At its rate, with scenes handed over all the while, readers and a recorder.
Status measure_live(const Options& options, const Experiment& experiment) {
  const auto scenes = std::make_shared<SceneLog>();
  SimulatedDeviceSettings hand = experiment.simulated;
  hand.back_and_forth = true;
  ASPERITY_TRY(SimulatedDevice device,
               SimulatedDevice::build(experiment.path, experiment.device, experiment.hand, hand));
  ASPERITY_TRY(const auto board, SharedBoard::create());
  DeviceProcessSettings process;
  process.loop_rate = options.rate;
  ASPERITY_TRY(const auto far, DeviceProcess::start(board, std::move(device), process));
  const auto telemetry = std::make_shared<Telemetry<ProxyState>>(
      TelemetrySettings{.ticks = 4096, .key_frame_every = static_cast<std::uint64_t>(options.rate)});
  const auto reader = telemetry->read(100'000);
  std::unique_ptr<Recorder> recorder;
  if (!options.trace.empty()) {
    RecorderSettings settings;
    settings.path = options.trace;
    settings.metadata.scene = experiment.canonical_json;
    settings.metadata.rate = options.rate;
    ASPERITY_TRY(recorder, Recorder::start(telemetry->read(100'000), scenes, settings));
  }
  ServoSettings servo;
  servo.rate = options.rate;
  servo.safety = SafetySettings::from_profile(experiment.device);
  servo.longest_step = Seconds(0.05);
  std::uint64_t unchecked = 0;
  using Loop = ServoThread<LiveScene, SceneStep, PortDevice<SharedPort>, Feed>;
  ASPERITY_TRY(const auto loop,
               Loop::start(scenes->begin(experiment.scene), {},
                           PortDevice<SharedPort>(SharedPort(board), Seconds(0.05)), {{telemetry}, &unchecked}, servo));
  for (const RealtimeGrant& grant : loop->grants())
    fmt::print("{} {}{}\n", grant.got ? "got" : "no ", grant.asked, grant.got ? "" : ": " + grant.why);
  const auto begin = std::chrono::steady_clock::now();
  std::uint64_t released = 0;
  std::uint64_t faults = 0;
  TelemetryReader<ProxyState>::Batch batch;
  for (std::uint64_t i = 0; Seconds(std::chrono::steady_clock::now() - begin).count() < options.seconds; ++i) {
    ASPERITY_TRY(const auto next,
                 scenes->edit({SceneEditKind::stiffness, "", 400.0 + static_cast<double>(i % 200), ""}));
    loop->put(next);
    std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(options.swap_milliseconds));
    reader->take(batch, std::chrono::milliseconds(0));
    for (const TelemetryTick& tick : batch.ticks) {
      released += tick.notes.released ? 1U : 0U;
      faults += tick.fault != Fault::none ? 1U : 0U;
    }
    // Where nobody records, nobody asks for how the scenes came about.
    if (!recorder && !batch.ticks.empty()) scenes->steps(batch.ticks.back().scene, batch.ticks.back().scene);
  }
  const SessionSummary summary = loop->stop();
  telemetry->end();
  if (recorder) ASPERITY_CHECK(recorder->finish());
  const auto times = [](const char* what, const TimeCounts& t) {
    fmt::print("{:<10} p50 {:.1f} us, p99 {:.1f} us, p99.9 {:.1f} us, max {:.1f} us\n", what, 1e6 * t.quantile(0.5),
               1e6 * t.quantile(0.99), 1e6 * t.quantile(0.999), 1e6 * t.longest);
  };
  const MailboxCount handed = loop->handed_over();
  fmt::print("{} ticks at {:g} Hz in {:g} s, {} missed\n", summary.ticks, options.rate, options.seconds,
             summary.missed);
  times("late by", loop->meters().lateness.counts());
  times("step", loop->meters().step.counts());
  fmt::print("scenes     {} handed over, {} felt, {} replaced before that, {} freed\n", handed.put, handed.taken,
             handed.replaced, handed.freed);
  fmt::print("safety     {} ticks not looked at; {} ticks with a fault; the device let go {} times\n", unchecked,
             faults, released);
  fmt::print("telemetry  {} ticks lost{}\n", reader->lost(),
             recorder ? fmt::format("; {} recorded, {} lost", recorder->status().ticks, recorder->status().lost) : "");
  return success();
}

Status run(const Options& options) {
  ASPERITY_TRY(const std::string json, builtin_scene_json(options.scene));
  ASPERITY_TRY(const Experiment experiment, parse_experiment(json, ".", options.scene));
  ASPERITY_CHECK(measure_overhead(experiment));
  return measure_live(options, experiment);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Options options;
    CLI::App app("A live loop under scenes that change all the time");
    app.add_option("--scene", options.scene, "A built-in scene")->capture_default_str();
    app.add_option("--seconds", options.seconds, "How long")->check(CLI::Range(0.1, 1e5))->capture_default_str();
    app.add_option("--rate", options.rate, "Hz")->check(CLI::Range(500.0, 40000.0))->capture_default_str();
    app.add_option("--swap", options.swap_milliseconds, "ms from one scene to the next")
        ->check(CLI::Range(0.1, 1e6))
        ->capture_default_str();
    app.add_option("--trace", options.trace, "Record it there as well");
    CLI11_PARSE(app, argc, argv);
    if (const Status status = run(options); !status) {
      fmt::print(stderr, "live_loop: {}\n", status.error().message());
      return 2;
    }
    return 0;
  } catch (const std::exception& problem) {
    fmt::print(stderr, "live_loop: {}\n", problem.what());
    return 2;
  }
}
