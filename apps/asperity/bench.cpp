// asperity bench: how long one tick takes on a scene, warm and with cold caches.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <memory>
#include <numeric>

#include "apps/asperity/run.h"
#include "apps/asperity/scene_argument.h"
#include "asperity/render/step.h"

namespace asperity::program {
namespace {

struct BenchOptions {
  SceneArgument scene;
  int ticks = 100000;
  int cold_ticks = 300;
};

struct Latency {
  double p50 = 0.0, p99 = 0.0, p999 = 0.0, max = 0.0;  // s
  std::size_t ticks = 0;
};

Latency latency_of(std::vector<double> seconds) {
  Latency latency;
  latency.ticks = seconds.size();
  latency.p50 = percentile(seconds, 0.5);
  latency.p99 = percentile(seconds, 0.99);
  latency.p999 = percentile(seconds, 0.999);
  latency.max = *std::max_element(seconds.begin(), seconds.end());
  return latency;
}

/// Drives everything that a tick reads out of the caches.
class CacheSweep {
 public:
  CacheSweep() : bytes_(std::size_t{64} << 20U, 1) {}
  void run() {
    for (std::size_t i = 0; i < bytes_.size(); i += 64) bytes_[i] = static_cast<unsigned char>(bytes_[i] + 1U);
  }
  [[nodiscard]] unsigned sum() const { return std::accumulate(bytes_.begin(), bytes_.end(), 0U); }

 private:
  std::vector<unsigned char> bytes_;
};

double timed_step(const Experiment& experiment, ProxyState& state, ProxyCache& cache, const TraceRecord& tick) {
  const auto begin = std::chrono::steady_clock::now();
  const ForceSample sample = step(experiment.scene, state, cache, tick.probe, tick.dt);
  const double seconds = Seconds(std::chrono::steady_clock::now() - begin).count();
  // Reading the answer keeps the call alive.
  return sample.wrench.force.x() < infinity ? seconds : 0.0;
}

Latency measure_warm(const Experiment& experiment, const std::vector<TraceRecord>& records, int ticks) {
  std::vector<double> seconds;
  seconds.reserve(static_cast<std::size_t>(ticks));
  ProxyState state;
  ProxyCache cache(experiment.scene);
  for (std::size_t i = 0; seconds.size() < static_cast<std::size_t>(ticks); i = (i + 1) % records.size()) {
    if (i == 0) state = ProxyState{};
    seconds.push_back(timed_step(experiment, state, cache, records[i]));
  }
  return latency_of(std::move(seconds));
}

/// Ticks spread over the stroke's contact; each is preceded by the tick before it, unmeasured, and a sweep.
Latency measure_cold(const Experiment& experiment, const std::vector<TraceRecord>& records, int ticks,
                     const Progress& progress) {
  std::vector<double> seconds;
  CacheSweep sweep;
  ProxyState state;
  ProxyCache cache(experiment.scene);
  const std::size_t stride = std::max<std::size_t>(1, records.size() / static_cast<std::size_t>(ticks));
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (i % stride == stride - 1) {
      sweep.run();
      seconds.push_back(timed_step(experiment, state, cache, records[i]));
      if (progress) progress("cold ticks", static_cast<double>(i) / static_cast<double>(records.size()));
    } else {
      timed_step(experiment, state, cache, records[i]);
    }
  }
  if (sweep.sum() == 0U) seconds.push_back(0.0);
  return latency_of(std::move(seconds));
}

Json json_of(const Latency& latency) {
  return Json{{"ticks", latency.ticks},
              {"p50_s", latency.p50},
              {"p99_s", latency.p99},
              {"p999_s", latency.p999},
              {"max_s", latency.max}};
}

void print_row(const char* name, const Latency& latency) {
  std::cout << fmt::format("{:<6}{:>10}{:>12}{:>12}{:>12}{:>12}\n", name, latency.ticks, format_seconds(latency.p50),
                           format_seconds(latency.p99), format_seconds(latency.p999), format_seconds(latency.max));
}

Result<int> bench(const BenchOptions& options, const Console& console) {
  const Progress progress = console.progress();
  ASPERITY_TRY(const Experiment experiment, load_scene(options.scene, progress));
  ASPERITY_TRY(const RunResult run, run_experiment(experiment, {}, progress));
  if (run.records.empty())
    return Error{ErrorCode::bad_value, "has no ticks", experiment.name, "stroke", "a stroke that takes time"};
  const Latency warm = measure_warm(experiment, run.records, options.ticks);
  const Latency cold = measure_cold(experiment, run.records, options.cold_ticks, progress);
  const ReportOrigin origin = report_origin(experiment, console);
  if (console.json) {
    console.print(Json{{"scene", experiment.name},
                       {"law", law_names_of(experiment.scene)},
                       {"machine", origin.machine},
                       {"date", origin.date},
                       {"command", origin.command},
                       {"memory_bytes", experiment.scene.memory_bytes()},
                       {"warm", json_of(warm)},
                       {"cold", json_of(cold)}});
    return exit_success;
  }
  std::cout << fmt::format("scene {}, law {}, {:.2f} MB\n", experiment.name, law_names_of(experiment.scene),
                           static_cast<double>(experiment.scene.memory_bytes()) * 1e-6);
  std::cout << fmt::format("{:<6}{:>10}{:>12}{:>12}{:>12}{:>12}\n", "", "ticks", "p50", "p99", "p99.9", "max");
  print_row("warm", warm);
  print_row("cold", cold);
  std::cout << fmt::format("{}, {}\n", origin.machine, origin.date);
  return exit_success;
}

}  // namespace

void add_bench(Arguments& program, Console& console, Action& action) {
  Arguments command = program.command("bench", "Measure how long one tick takes on a scene, warm and cold");
  auto options = std::make_shared<BenchOptions>();
  add_scene_options(command, options->scene);
  command.option("--law", options->scene.law, "Of every surface").group("Touch");
  command.option("--ticks", options->ticks, "Warm ticks to measure").between(1, 100000000).shows_default();
  command.option("--cold-ticks", options->cold_ticks, "Ticks measured after 64 MB have been swept through the caches")
      .between(1, 1000000)
      .shows_default();
  add_console_options(command, console);
  command.closing_words(
      "The ticks are those of the scene's own stroke. Times include one reading of the clock (some 20 ns).\n"
      "Examples:\n"
      "  asperity bench icosphere\n"
      "  asperity bench bunny.obj --law god-object --ticks 1000000 --json");
  command.when_called(
      [options, &console, &action] { action = [options, &console] { return bench(*options, console); }; });
}

}  // namespace asperity::program
