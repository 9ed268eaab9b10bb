// asperity doctor: whether this machine keeps a loop's rate, idle and under a scene's load, and what would help.

#include <fmt/format.h>
#include <sys/utsname.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iostream>
#include <memory>
#include <thread>

#include "apps/asperity/command.h"
#include "apps/asperity/run.h"
#include "apps/asperity/scene_argument.h"
#include "asperity/render/step.h"
#include "asperity/servo/servo_thread.h"

namespace asperity::program {
namespace {

struct DoctorOptions {
  SceneArgument scene;
  double seconds = 10.0;  // of each part
  RealtimeSettings realtime;
};

/// What the system is.
struct System {
  std::string kernel;
  bool preempt_rt = false;
  std::string governor;  ///< empty: not told
  bool virtual_machine = false;
  unsigned processors = 0;
};

std::string first_line(const char* file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

System look_at_system() {
  System system;
  utsname name{};
  if (uname(&name) == 0) {
    system.kernel = fmt::format("{} {}", name.sysname, name.release);
    system.preempt_rt = std::string(name.version).find("PREEMPT_RT") != std::string::npos;
  }
  system.preempt_rt = system.preempt_rt || first_line("/sys/kernel/realtime") == "1";
  system.governor = first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
  system.processors = std::thread::hardware_concurrency();
  std::ifstream processors("/proc/cpuinfo");
  for (std::string line; std::getline(processors, line);) {
    if (line.starts_with("flags") && line.find(" hypervisor") != std::string::npos) system.virtual_machine = true;
  }
  return system;
}

/// What the loop has to do.
struct Load {
  const Experiment* experiment = nullptr;  ///< nullptr: nothing
};

/// Reads the probes of a run again and again; without any it stands still.
struct PlayedProbe {
  const std::vector<TraceRecord>* records;
  std::size_t next = 0;

  ProbeSample read() noexcept {
    if (records->empty()) return {};
    const ProbeSample probe = (*records)[next].probe;
    next = (next + 1) % records->size();
    return probe;
  }
  void apply(const Vec3&, Seconds) noexcept {}
  [[nodiscard]] Vec3 aim() const noexcept { return Vec3::Zero(); }
  [[nodiscard]] bool finished() const noexcept { return false; }
};

/// One part of the examination.
struct Part {
  std::string name;
  std::uint64_t ticks = 0;
  std::uint64_t missed = 0;
  TimeCounts lateness;
  TimeCounts step;
};

/// Steps through a scene; without one there is nothing to touch.
struct Touching {
  ProxyState state = {};
  ProxyCache cache = {};
  double last = -infinity;  ///< s

  ForceSample operator()(const Load& load, const ProbeSample& probe, Seconds dt) noexcept {
    if (load.experiment == nullptr) return {};
    // The stroke begins anew.
    if (probe.time.count() < last) state = {};
    last = probe.time.count();
    return step(load.experiment->scene, state, cache, probe, dt);
  }
};

struct NoRecord {
  void operator()(const TraceRecord&) const noexcept {}
};

/// Runs a loop while this thread tells how far it is.
Result<Part> examine(const std::string& name, const DoctorOptions& options, double rate, const Experiment* experiment,
                     const std::vector<TraceRecord>& records, const Progress& progress,
                     std::vector<RealtimeGrant>& grants) {
  ServoSettings settings;
  settings.rate = rate;
  settings.realtime = options.realtime;
  settings.max_ticks = static_cast<std::uint64_t>(rate * options.seconds);
  Touching touching;
  if (experiment != nullptr) touching.cache = ProxyCache(experiment->scene);
  using Loop = ServoThread<Load, Touching, PlayedProbe, NoRecord>;
  ASPERITY_TRY(const std::unique_ptr<Loop> loop, Loop::start(std::make_shared<const Load>(Load{experiment}),
                                                             std::move(touching), PlayedProbe{&records}, {}, settings));
  while (!loop->ended()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    const auto ticks = static_cast<double>(loop->meters().lateness.counts().total);
    if (progress) progress(name, std::min(1.0, ticks / static_cast<double>(settings.max_ticks)));
  }
  const SessionSummary summary = loop->stop();
  grants = loop->grants();
  return Part{name, summary.ticks, summary.missed, loop->meters().lateness.counts(), loop->meters().step.counts()};
}

enum class Verdict { fit, late, unfit };

/// Which holds for both parts: ticks on time to a tenth of a period, or all but a thousandth of them in their period.
Verdict judge(const std::vector<Part>& parts, double period) {
  constexpr double on_time = 0.1;
  constexpr double most_missed = 1e-3;
  Verdict verdict = Verdict::fit;
  for (const Part& part : parts) {
    const bool keeps = part.missed == 0 && part.lateness.quantile(0.999) <= on_time * period;
    const double share = static_cast<double>(part.missed) / static_cast<double>(part.ticks + part.missed);
    if (!keeps) verdict = std::max(verdict, share <= most_missed ? Verdict::late : Verdict::unfit);
  }
  return verdict;
}

const char* words_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::fit: return "fit: ticks are on time";
    case Verdict::late: return "usable: some ticks are late, few or none are missed";
    case Verdict::unfit: break;
  }
  return "unfit: ticks are missed, and a hand feels that";
}

std::vector<std::string> advice_on(const System& system, const std::vector<RealtimeGrant>& grants,
                                   const std::vector<Part>& parts, double rate) {
  std::vector<std::string> advice;
  const double period = 1.0 / rate;
  const double dearest = parts.back().step.quantile(0.999);
  if (dearest > 0.5 * period)
    advice.push_back(
        fmt::format("the scene's own ticks take up to {} (p99.9) of {}: a lower --rate, a smaller relief "
                    "or a point for a probe",
                    format_seconds(dearest), format_seconds(period)));
  for (const RealtimeGrant& grant : grants) {
    if (!grant.got) advice.push_back(fmt::format("{} was refused ({}): {}", grant.asked, grant.why, grant.advice));
  }
  if (!system.governor.empty() && system.governor != "performance")
    advice.push_back(
        fmt::format("the processor's governor is \"{}\": cpupower frequency-set -g performance", system.governor));
  if (!system.preempt_rt)
    advice.push_back("the kernel is not PREEMPT_RT: Debian's package linux-image-rt-amd64 has one that is");
  if (system.virtual_machine)
    advice.push_back(
        "this is a virtual machine: its host may stop it at any time; devices want a machine of their own");
  return advice;
}

Json json_of(const TimeCounts& times) {
  return Json{{"p50_s", times.quantile(0.5)},
              {"p99_s", times.quantile(0.99)},
              {"p999_s", times.quantile(0.999)},
              {"max_s", times.longest}};
}

void print_row(const std::string& name, const TimeCounts& times) {
  std::cout << fmt::format("{:<32}{:>12}{:>12}{:>12}{:>12}\n", name, format_seconds(times.quantile(0.5)),
                           format_seconds(times.quantile(0.99)), format_seconds(times.quantile(0.999)),
                           format_seconds(times.longest));
}

Json document_of(double rate, const System& system, const std::vector<RealtimeGrant>& grants,
                 const std::vector<Part>& parts, Verdict verdict, const std::vector<std::string>& advice) {
  Json document{{"rate_hz", rate},
                {"kernel", system.kernel},
                {"preempt_rt", system.preempt_rt},
                {"processors", system.processors},
                {"virtual_machine", system.virtual_machine}};
  document["governor"] = system.governor.empty() ? Json() : Json(system.governor);
  for (const RealtimeGrant& grant : grants)
    document["asked"].push_back(
        Json{{"what", grant.asked}, {"got", grant.got}, {"why", grant.why}, {"advice", grant.advice}});
  for (const Part& part : parts)
    document["parts"].push_back(Json{{"name", part.name},
                                     {"ticks", part.ticks},
                                     {"missed", part.missed},
                                     {"lateness", json_of(part.lateness)},
                                     {"step", json_of(part.step)}});
  document["verdict"] = verdict == Verdict::fit ? "fit" : (verdict == Verdict::late ? "late" : "unfit");
  document["advice"] = advice;
  return document;
}

Result<int> doctor(const DoctorOptions& options, const Console& console) {
  const Progress progress = console.progress();
  ASPERITY_TRY(const Experiment experiment, load_scene(options.scene, progress));
  ASPERITY_TRY(const RunResult run, run_experiment(experiment, {}, progress));
  const System system = look_at_system();
  const double rate = experiment.rate;
  std::vector<RealtimeGrant> grants;
  std::vector<Part> parts;
  const std::vector<TraceRecord> none;
  ASPERITY_TRY(Part idle, examine("idle", options, rate, nullptr, none, progress, grants));
  parts.push_back(std::move(idle));
  ASPERITY_TRY(Part loaded,
               examine("touching " + experiment.name, options, rate, &experiment, run.records, progress, grants));
  parts.push_back(std::move(loaded));
  const Verdict verdict = judge(parts, 1.0 / rate);
  const std::vector<std::string> advice = advice_on(system, grants, parts, rate);
  const int code = verdict == Verdict::unfit ? exit_check_failed : exit_success;
  if (console.json) {
    console.print(document_of(rate, system, grants, parts, verdict, advice));
    return code;
  }
  std::cout << fmt::format("{}{}, {} processors{}, governor {}\n", system.kernel,
                           system.preempt_rt ? " (PREEMPT_RT)" : "", system.processors,
                           system.virtual_machine ? " of a virtual machine" : "",
                           system.governor.empty() ? "not told" : system.governor);
  for (const RealtimeGrant& grant : grants)
    std::cout << fmt::format("{:<4}{}{}\n", grant.got ? "got" : "no", grant.asked,
                             grant.got ? "" : fmt::format(": {}", grant.why));
  std::cout << fmt::format("\n{:g} Hz, {:g} s each\n{:<32}{:>12}{:>12}{:>12}{:>12}\n", rate, options.seconds, "", "p50",
                           "p99", "p99.9", "max");
  for (const Part& part : parts) {
    print_row(part.name + ", late by", part.lateness);
    if (&part == &parts.back()) print_row("  its ticks take", part.step);
    std::cout << fmt::format("  missed {} of {} ticks\n", part.missed, part.ticks + part.missed);
  }
  std::cout << fmt::format("\n{}\n", words_of(verdict));
  if (verdict != Verdict::fit) {
    for (const std::string& one : advice) std::cout << fmt::format("- {}\n", one);
  }
  return code;
}

}  // namespace

void add_doctor(Arguments& program, Console& console, Action& action) {
  Arguments command = program.command("doctor", "Find out whether this machine keeps a haptic loop's rate");
  auto options = std::make_shared<DoctorOptions>();
  add_scene_options(command, options->scene);
  command.option("--seconds", options->seconds, "How long each part takes").between(0.1, 3600.0).shows_default();
  add_realtime_options(command, options->realtime);
  add_console_options(command, console);
  command.closing_words(
      "A loop runs for a while without anything to do, then through the scene's own stroke. Told is how late its ticks "
      "begin, how many are missed, and what may be changed.\n"
      "Exit code 1: ticks are missed (more than one in a thousand).\n"
      "Examples:\n"
      "  asperity doctor\n"
      "  asperity doctor bunny.obj --rate 4000 --seconds 60");
  command.when_called(
      [options, &console, &action] { action = [options, &console] { return doctor(*options, console); }; });
}

}  // namespace asperity::program
