// asperity run: a live session. A simulated device in a process of its own, the servo loop, a recording of all of it.

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <thread>

#include "apps/asperity/command.h"
#include "apps/asperity/run.h"
#include "apps/asperity/scene_argument.h"
#include "asperity/core/units.h"
#include "asperity/io/live_trace.h"
#include "asperity/io/recorder.h"
#include "asperity/servo/device_process.h"
#include "asperity/servo/servo_thread.h"

namespace asperity::program {
namespace {

namespace fs = std::filesystem;

struct LiveOptions {
  SceneArgument scene;
  double seconds = 0.0;  // 0: the stroke's own length
  std::string out;
  std::vector<std::string> edits;
  RealtimeSettings realtime;
};

/// A change that is due so long after the start.
struct DueEdit {
  double seconds = 0.0;
  SceneEdit edit;
  std::string text;
};

using LivePort = PortDevice<SharedPort>;
using LiveLoop = ServoThread<LiveScene, SceneStep, LivePort, SceneFeed>;

// How long the device may be silent, and a step may take, before it counts as a fault.
constexpr Seconds longest_silence{0.05};
constexpr Seconds longest_step{0.03};

volatile std::sig_atomic_t interrupted = 0;

/// The first Ctrl-C ends the session in good order; a second one ends the program, whatever hangs.
void watch_for_interrupts() {
  struct sigaction action {};
  action.sa_handler = [](int) { interrupted = 1; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) ::sigaction(number, &action, nullptr);
}

/// What has been felt so far.
struct Felt {
  std::uint64_t ticks = 0;
  std::uint64_t contact = 0;
  std::uint64_t released = 0;
  std::uint64_t scenes = 0;
  double force = 0.0;  ///< N, now
  double largest = 0.0;
  bool touches = false;
  Fault fault = Fault::none;
  std::vector<std::pair<Fault, std::uint64_t>> faults;  ///< with their ticks
  std::array<std::uint64_t, 32> flags{};

  void add(const TelemetryTick& tick) {
    const Flags& now = tick.record.rendered.flags;
    ++ticks;
    touches = now.has(TickFlag::contact);
    contact += touches ? 1 : 0;
    released += tick.notes.released ? 1 : 0;
    scenes += tick.notes.taken ? 1 : 0;
    force = tick.record.commanded.norm();
    largest = std::max(largest, force);
    if (tick.fault != fault && tick.fault != Fault::none) faults.emplace_back(tick.fault, tick.record.tick);
    fault = tick.fault;
    for (std::size_t bit = 0; bit < flags.size(); ++bit) flags[bit] += now.bits() >> bit & 1U;
  }
};

Result<DueEdit> parse_due_edit(const std::string& text) {
  const std::size_t colon = text.find(':');
  const auto refuse = [&](const std::string& what) {
    return bad_value(what, "--edit", "a time, a colon and a change: 2s:stiffness=800, 500ms:zoom=2");
  };
  if (colon == std::string::npos) return refuse(fmt::format("is \"{}\"", text));
  const Result<double> seconds = parse_quantity(text.substr(0, colon), Dimension::time);
  if (!seconds || !(*seconds >= 0.0)) return refuse(fmt::format("has \"{}\" for a time", text.substr(0, colon)));
  DueEdit due{*seconds, {}, text.substr(colon + 1)};
  ASPERITY_TRY(due.edit, parse_scene_edit_text(due.text));
  return due;
}

/// Tries each on the scene before anything begins: what is wrong is told now.
Result<std::vector<DueEdit>> due_edits(const LiveOptions& options, const Scene& scene) {
  std::vector<DueEdit> all;
  for (const std::string& text : options.edits) {
    ASPERITY_TRY(DueEdit due, parse_due_edit(text));
    all.push_back(std::move(due));
  }
  std::stable_sort(all.begin(), all.end(), [](const DueEdit& a, const DueEdit& b) { return a.seconds < b.seconds; });
  Scene changed = scene;
  for (const DueEdit& due : all) {
    ASPERITY_TRY(changed, edited(changed, due.edit));
  }
  return all;
}

/// What a person types while it runs.
class TypedLines {
 public:
  /// Waits for at most `longest`; the lines that are whole by then.
  std::vector<std::string> wait(std::chrono::milliseconds longest) {
    if (closed_) {
      std::this_thread::sleep_for(longest);
      return {};
    }
    pollfd in{STDIN_FILENO, POLLIN, 0};
    if (::poll(&in, 1, static_cast<int>(longest.count())) <= 0) return {};
    std::array<char, 4096> bytes{};
    const ssize_t count = ::read(STDIN_FILENO, bytes.data(), bytes.size());
    if (count <= 0) {
      closed_ = true;
      return {};
    }
    text_.append(bytes.data(), static_cast<std::size_t>(count));
    std::vector<std::string> lines;
    for (std::size_t end = 0; (end = text_.find('\n')) != std::string::npos; text_.erase(0, end + 1))
      lines.push_back(text_.substr(0, end));
    return lines;
  }
  [[nodiscard]] bool from_a_person() const { return !closed_ && ::isatty(STDIN_FILENO) == 1; }

 private:
  std::string text_;
  bool closed_ = false;
};

/// One line that is overwritten on a terminal.
class StatusLine {
 public:
  explicit StatusLine(const Console& console)
      : terminal_(::isatty(STDERR_FILENO) == 1), shown_(terminal_ || console.show_progress) {}
  void show(const std::string& text) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point now = Clock::now();
    if (!shown_ || now - last_ < (terminal_ ? std::chrono::milliseconds(100) : std::chrono::milliseconds(1000))) return;
    last_ = now;
    if (terminal_) {
      std::cerr << "\r\x1b[K" << text << std::flush;
    } else {
      std::cerr << text << '\n';
    }
  }
  /// Something that stays.
  void tell(const std::string& text) { std::cerr << (terminal_ ? "\r\x1b[K" : "") << text << '\n'; }
  void end() {
    if (terminal_) std::cerr << "\r\x1b[K" << std::flush;
  }

 private:
  bool terminal_;
  bool shown_;
  std::chrono::steady_clock::time_point last_{};
};

/// A session while it runs, and what it leaves.
class LiveSession {
 public:
  LiveSession(const LiveOptions& options, const Experiment& experiment, std::vector<DueEdit> edits,
              const Console& console)
      : options_(options), experiment_(experiment), edits_(std::move(edits)), line_(console) {}

  /// Errors: of the device, the loop, the file. [main]
  Status begin(const Console& console) {
    ASPERITY_CHECK(begin_device());
    SceneLog& scenes = *scenes_;
    RecorderSettings recording;
    recording.path = (folder() / "live.asptrace").string();
    recording.fault_prefix = (folder() / "fault").string();
    recording.metadata = trace_metadata(experiment_, options_.scene.scene, console);
    const ServoSettings servo = servo_settings();
    recording.metadata.extra[trace_safety_key] = to_json(servo.safety);
    trace_path_ = recording.path;
    // A third of a second between the loop and the hub, four seconds in front of a disk that is slow.
    const auto room = [&](double seconds) { return static_cast<std::size_t>(seconds * servo.rate); };
    telemetry_ =
        std::make_shared<Telemetry<ProxyState>>(TelemetrySettings{.ticks = room(0.33), .key_frame_every = room(1.0)});
    ASPERITY_TRY(recorder_, Recorder::start(telemetry_->read(room(4.0)), scenes_, recording));
    reader_ = telemetry_->read(room(4.0));
    ASPERITY_TRY(loop_, LiveLoop::start(scenes.begin(experiment_.scene), {},
                                        LivePort(SharedPort(board_), longest_silence), {telemetry_}, servo));
    for (const RealtimeGrant& grant : loop_->grants()) {
      if (!grant.got) line_.tell(fmt::format("note: {} was refused ({}): {}", grant.asked, grant.why, grant.advice));
    }
    return success();
  }

  /// Until it is over.
  void go_on() {
    watch_for_interrupts();
    const auto begun = std::chrono::steady_clock::now();
    std::size_t next = 0;
    while (!loop_->ended() && interrupted == 0 && !quit_) {
      for (const std::string& typed : lines_.wait(std::chrono::milliseconds(20))) answer(typed);
      const double seconds = Seconds(std::chrono::steady_clock::now() - begun).count();
      for (; next < edits_.size() && edits_[next].seconds <= seconds; ++next) change(edits_[next].edit);
      look();
      line_.show(status_text());
      // By the clock on the wall: ticks that were missed take their time as well.
      if (options_.seconds > 0.0 && seconds >= options_.seconds) quit_ = true;
      if (felt_.fault != Fault::none && !lines_.from_a_person()) quit_ = true;
    }
  }

  /// Ramps down, closes the recording.
  void end() {
    summary_ = loop_->stop();
    telemetry_->end();
    recorded_ = recorder_->finish();
    look();
    line_.end();
    device_.reset();
  }

  [[nodiscard]] bool whole() const {
    const RecorderStatus status = recorder_->status();
    return felt_.faults.empty() && recorded_.ok() && status.lost == 0;
  }
  void print() const;
  [[nodiscard]] Json document() const;

 private:
  [[nodiscard]] fs::path folder() const {
    return options_.out.empty() ? fs::path("out") / (folder_name(experiment_.name) + "-live") : fs::path(options_.out);
  }

  Status begin_device() {
    ASPERITY_CHECK(make_output_folder(folder().string()));
    SimulatedDeviceSettings settings = experiment_.simulated;
    settings.back_and_forth = options_.seconds > 0.0;
    Result<SimulatedDevice> device =
        SimulatedDevice::build(experiment_.path, experiment_.device, experiment_.hand, settings);
    if (!device) return std::move(device).error().at("probe.dynamic");
    ASPERITY_TRY(board_, SharedBoard::create());
    DeviceProcessSettings process;
    process.rate = std::clamp(experiment_.device.rate, 500.0, 40'000.0);
    process.loop_rate = experiment_.rate;
    process.realtime.priority = std::max(0, options_.realtime.priority - 10);
    ASPERITY_TRY(device_, DeviceProcess::start(board_, std::move(*device), process));
    return success();
  }

  [[nodiscard]] ServoSettings servo_settings() const {
    ServoSettings servo;
    servo.rate = experiment_.rate;
    servo.realtime = options_.realtime;
    // The stroke is laid into the middle of what the device can reach.
    Box reach;
    for (const Vec3& point : experiment_.path.points()) reach.include(point);
    servo.safety = SafetySettings::for_hands(experiment_.device, reach.centre());
    servo.longest_step = longest_step;
    if (options_.seconds > 0.0) servo.max_ticks = static_cast<std::uint64_t>(options_.seconds * servo.rate);
    return servo;
  }

  void change(const SceneEdit& edit) {
    Result<std::shared_ptr<const LiveScene>> next = scenes_->edit(edit);
    if (next) {
      loop_->put(*next);
    } else {
      line_.tell("asperity: " + next.error().message());
    }
  }

  void answer(const std::string& typed) {
    if (typed.empty()) return;
    if (typed == "quit") {
      quit_ = true;
    } else if (typed == "ok") {
      loop_->acknowledge();
    } else if (const Result<SceneEdit> edit = parse_scene_edit_text(typed)) {
      change(*edit);
    } else {
      line_.tell("asperity: " + edit.error().message() + "; or ok (after a fault), quit");
    }
  }

  void look() {
    const std::size_t faults = felt_.faults.size();
    while (reader_->take(batch_, std::chrono::milliseconds(0)) && !batch_.ticks.empty()) {
      for (const TelemetryTick& tick : batch_.ticks) felt_.add(tick);
    }
    for (std::size_t i = faults; i < felt_.faults.size(); ++i) {
      line_.tell(fmt::format("fault: {} (tick {}); no force until it is acknowledged{}",
                             fault_sentence(felt_.faults[i].first), felt_.faults[i].second,
                             lines_.from_a_person() ? ": type ok" : ""));
    }
    const RecorderStatus status = recorder_->status();
    if (!status.problem.empty() && !std::exchange(told_problem_, true))
      line_.tell("asperity: the recording ends here, the session goes on: " + status.problem);
    if (!status.fault_problem.empty() && !std::exchange(told_fault_problem_, true))
      line_.tell("asperity: what came before the fault could not be kept: " + status.fault_problem);
  }

  [[nodiscard]] std::string status_text() const {
    const TimeCounts lateness = loop_->meters().lateness.counts();
    const TimeCounts period = loop_->meters().period.counts();
    const double median = period.quantile(0.5);
    return fmt::format("{:.0f} Hz, late by {} (p99.9), {:.2f} N{}, {} lost", median > 0.0 ? 1.0 / median : 0.0,
                       format_seconds(lateness.quantile(0.999)), felt_.force, felt_.touches ? " in contact" : "",
                       recorder_->status().lost);
  }

  const LiveOptions& options_;
  const Experiment& experiment_;
  std::vector<DueEdit> edits_;
  std::shared_ptr<SharedBoard> board_;
  std::unique_ptr<DeviceProcess> device_;
  std::shared_ptr<SceneLog> scenes_ = std::make_shared<SceneLog>();
  std::shared_ptr<Telemetry<ProxyState>> telemetry_;
  std::shared_ptr<TelemetryReader<ProxyState>> reader_;
  TelemetryReader<ProxyState>::Batch batch_;
  std::unique_ptr<Recorder> recorder_;
  std::unique_ptr<LiveLoop> loop_;
  std::string trace_path_;
  TypedLines lines_;
  StatusLine line_;
  Felt felt_;
  SessionSummary summary_;
  Status recorded_ = success();
  bool quit_ = false;
  bool told_problem_ = false;
  bool told_fault_problem_ = false;
};

std::string flags_of(const std::array<std::uint64_t, 32>& flags) {
  std::string list;
  for (std::size_t bit = 1; bit < flags.size(); ++bit) {
    if (flags[bit] > 0) list += fmt::format("{}{} ({} ticks)", list.empty() ? "" : ", ", flag_name(bit), flags[bit]);
  }
  return list.empty() ? "none" : list;
}

void LiveSession::print() const {
  const TimeCounts lateness = loop_->meters().lateness.counts();
  const TimeCounts took = loop_->meters().step.counts();
  const RecorderStatus status = recorder_->status();
  const MailboxCount handed = loop_->handed_over();
  const auto times = [](const TimeCounts& t) {
    return fmt::format("p50 {}, p99 {}, p99.9 {}, max {}", format_seconds(t.quantile(0.5)),
                       format_seconds(t.quantile(0.99)), format_seconds(t.quantile(0.999)), format_seconds(t.longest));
  };
  std::cout << fmt::format("scene    {}\n", experiment_.name);
  std::cout << fmt::format("device   {}, simulated, in a process of its own\n", experiment_.device.name);
  std::cout << fmt::format("ticks    {} at {:g} Hz, {} missed, {} in contact\n", summary_.ticks, experiment_.rate,
                           summary_.missed, felt_.contact);
  std::cout << fmt::format("late     {}\n", times(lateness));
  std::cout << fmt::format("step     {}\n", times(took));
  std::cout << fmt::format("force    max {:.3g} N\n", felt_.largest);
  std::cout << fmt::format("scenes   {} handed over, {} felt, {} replaced before that\n", handed.put, handed.taken,
                           handed.replaced);
  std::cout << fmt::format("let go   {} times by the device, when the loop was late\n", felt_.released);
  std::cout << fmt::format("flags    {}\n", flags_of(felt_.flags));
  std::cout << fmt::format("faults   {}\n", felt_.faults.empty() ? "none" : "");
  for (const auto& [fault, tick] : felt_.faults)
    std::cout << fmt::format("  tick {}: {}\n", tick, fault_sentence(fault));
  for (const std::string& file : status.faults) std::cout << fmt::format("  {}\n", file);
  std::cout << fmt::format("trace    {}, {} ticks, {} lost{}\n", trace_path_, status.ticks, status.lost,
                           recorded_.ok() ? "" : ": " + recorded_.error().message());
}

Json LiveSession::document() const {
  const auto times = [](const TimeCounts& t) {
    return Json{
        {"p50_s", t.quantile(0.5)}, {"p99_s", t.quantile(0.99)}, {"p999_s", t.quantile(0.999)}, {"max_s", t.longest}};
  };
  const RecorderStatus status = recorder_->status();
  const MailboxCount handed = loop_->handed_over();
  Json flags = Json::object();
  for (std::size_t bit = 0; bit < felt_.flags.size(); ++bit) {
    if (felt_.flags[bit] > 0) flags[std::string(flag_name(bit))] = felt_.flags[bit];
  }
  Json faults = Json::array();
  for (const auto& [fault, tick] : felt_.faults)
    faults.push_back({{"fault", to_string(fault)}, {"tick", tick}, {"sentence", fault_sentence(fault)}});
  Json asked = Json::array();
  for (const RealtimeGrant& grant : loop_->grants())
    asked.push_back({{"what", grant.asked}, {"got", grant.got}, {"why", grant.why}, {"advice", grant.advice}});
  return Json{{"scene", experiment_.name},
              {"device", experiment_.device.name},
              {"rate_hz", experiment_.rate},
              {"ticks", summary_.ticks},
              {"missed", summary_.missed},
              {"contact", felt_.contact},
              {"lateness", times(loop_->meters().lateness.counts())},
              {"step", times(loop_->meters().step.counts())},
              {"max_force_n", felt_.largest},
              {"scenes", {{"put", handed.put}, {"taken", handed.taken}, {"replaced", handed.replaced}}},
              {"released", felt_.released},
              {"flags", flags},
              {"faults", faults},
              {"asked", asked},
              {"recording",
               {{"trace", trace_path_},
                {"ticks", status.ticks},
                {"lost", status.lost},
                {"problem", status.problem},
                {"faults", status.faults}}}};
}

Result<int> run_live(LiveOptions options, const Console& console) {
  const Progress progress = console.progress();
  constexpr std::string_view simulated = "simulated:";
  std::string& device = options.scene.device;
  if (device.starts_with(simulated)) {
    device.erase(0, simulated.size());
  } else if (device.find(':') != std::string::npos) {
    return bad_value(fmt::format("is \"{}\"", device), "--device", "simulated:PROFILE, as simulated:omega.7");
  }
  ASPERITY_TRY(const Experiment experiment, load_scene(options.scene, progress));
  ASPERITY_CHECK(check_loop_rate(experiment.rate));
  ASPERITY_TRY(std::vector<DueEdit> edits, due_edits(options, experiment.scene));
  LiveSession session(options, experiment, std::move(edits), console);
  ASPERITY_CHECK(session.begin(console));
  session.go_on();
  session.end();
  for (const std::string& note : experiment.notes) console.note(note);
  if (console.json) {
    console.print(session.document());
  } else {
    session.print();
  }
  return session.whole() ? exit_success : exit_check_failed;
}

}  // namespace

void add_run(Arguments& program, Console& console, Action& action) {
  Arguments command = program.command("run", "Touch a scene live: servo loop, device, faults, recording");
  auto options = std::make_shared<LiveOptions>();
  add_scene_options(command, options->scene);
  command
      .option("--law", options->scene.law,
              "Of every surface: see asperity touch --help, or asperity schema law for what each can be told")
      .group("Touch");
  command.option("--seconds", options->seconds, "How long, the hand going back and forth; default: its stroke once")
      .between(0.01, 1e6);
  command.option("--edit", options->edits,
                 "A change while it runs, as 2s:stiffness=800 (stiffness, friction, threshold, zoom, law; "
                 "NAME.stiffness=800 of one surface)");
  command.option("--out", options->out, "Folder of the recording; default out/SCENE-live");
  add_realtime_options(command, options->realtime);
  add_console_options(command, console);
  command.closing_words(
      "The device is simulated (--device simulated:PROFILE), with a hand that goes the scene's stroke, in a process "
      "and "
      "by a clock of its own: it lets go of the force when it hears nothing of the loop for three periods. Ctrl-C "
      "ramps "
      "the force down, closes the recording and prints the summary. Changes may be typed while it runs: stiffness=800, "
      "zoom=2; ok after a fault; quit.\n"
      "Exit code 1: a fault, or ticks that could not be recorded.\n"
      "Examples:\n"
      "  asperity run\n"
      "  asperity run bunny.obj --seconds 10 --device simulated:omega.7 --edit 2s:stiffness=300\n"
      "  asperity replay out/icosphere-relief-live/live.asptrace");
  command.when_called(
      [options, &console, &action] { action = [options, &console] { return run_live(*options, console); }; });
}

}  // namespace asperity::program
