// asperity touch: the main job. A probe slides over a scene; trace, numbers and report are left behind.

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>

#include "apps/asperity/run.h"
#include "apps/asperity/scene_argument.h"
#include "asperity/io/atomic_file.h"
#include "asperity/io/trace_export.h"
#include "asperity/io/trace_file.h"

namespace asperity::program {
namespace {

namespace fs = std::filesystem;

struct TouchOptions {
  SceneArgument scene;
  std::string out;
  bool no_report = false;
  bool no_picture = false;
  bool csv = false;
};

/// A trace that grows beside its place and moves there when it is whole.
class TraceOutput {
 public:
  static Result<TraceOutput> open(const std::string& path, const TraceMetadata& metadata) {
    ASPERITY_TRY(TraceWriter writer, TraceWriter::open(path + ".part", metadata));
    return TraceOutput(path, std::move(writer));
  }
  Status append(const TraceRecord& tick) { return writer_.append(tick); }
  Status finish() {
    ASPERITY_CHECK(writer_.finish());
    std::error_code problem;
    fs::rename(path_ + ".part", path_, problem);
    if (problem)
      return Error{ErrorCode::file_unwritable,
                   "cannot be renamed: " + problem.message(),
                   path_,
                   {},
                   "a file that can be replaced"};
    return success();
  }
  void discard() const {
    std::error_code ignored;
    fs::remove(path_ + ".part", ignored);
  }

 private:
  TraceOutput(std::string path, TraceWriter writer) : path_(std::move(path)), writer_(std::move(writer)) {}
  std::string path_;
  TraceWriter writer_;
};

/// What to change where the device's force was not enough; empty: it was.
std::string force_advice(const Experiment& experiment, const RunResult& run) {
  const View& view = experiment.scene.settings().view;
  std::size_t limited = 0;
  double farthest = 0.0;
  double when = 0.0;
  for (const TraceRecord& tick : run.records) {
    if (!tick.rendered.flags.has(TickFlag::force_limited)) continue;
    ++limited;
    const double behind = (view.to_workspace(tick.rendered.proxy) - tick.probe.pose.position).norm();
    if (!(behind > farthest)) continue;
    farthest = behind;
    when = tick.probe.time.count();
  }
  if (limited == 0) return {};
  std::string text = fmt::format("the device's {:g} N are reached in {} ticks", experiment.device.max_force, limited);
  std::string change = "--depth, --force or --stiffness lower";
  if (farthest > 0.0) {
    text += fmt::format(": the probe is led up to {} past what holds it (at {:.3g} s)", format_length(farthest), when);
    SceneSettings larger = experiment.scene.settings();
    larger.probe_radius = larger.probe_radius > 0.0 ? 2.0 * larger.probe_radius : 0.5e-3;
    const auto instances = experiment.scene.instances();
    if (std::all_of(instances.begin(), instances.end(), [&](const Instance& i) { return takes_ball(i, larger).ok(); }))
      change = fmt::format("a larger tip (--probe-radius {:g}mm) does not get behind what this one does; ",
                           1e3 * larger.probe_radius) +
               change;
  }
  return text + ". To change: " + change;
}

Result<RunReport> build_report(const Experiment& experiment, const RunResult& run, const Console& console,
                               const Progress& progress, bool with_picture) {
  RunReport report;
  report.origin = report_origin(experiment, console);
  report.law = law_names_of(experiment.scene);
  report.setup = setup_facts(experiment);
  if (progress) progress("measuring", 0.0);
  report.series = derive_series(run.records, experiment.scene, experiment.path);
  report.metrics = measure_run(run.records, report.series, experiment.path);
  report.metrics.energy.account = account_rows(run.account);
  if (report.metrics.ticks.contact == 0) report.origin.warnings.push_back("the probe never touched anything");
  if (std::string advice = force_advice(experiment, run); !advice.empty())
    report.origin.warnings.push_back(std::move(advice));
  if (with_picture) {
    ASPERITY_TRY(report.picture, render_picture(experiment.scene, experiment.path, run.records, {}, progress));
  }
  return report;
}

Json run_json(const Experiment& experiment, const RunResult& run, const RunReport& report, const Json& files) {
  Json setup = Json::object();
  for (const ReportFact& fact : report.setup) setup[fact.name] = fact.value;
  return Json{{"program", report.origin.program},
              {"command", report.origin.command},
              {"date", report.origin.date},
              {"machine", report.origin.machine},
              {"scene", experiment.name},
              {"law", report.law},
              {"setup", setup},
              {"ticks", run.summary.ticks},
              {"force_hash", format_hash(run.hash)},
              {"metrics", Json::parse(metrics_json(report.metrics))},
              {"notes", report.origin.notes},
              {"warnings", report.origin.warnings},
              {"files", files}};
}

std::string height_line(const HeightMetrics& height) {
  if (height.samples == 0) return "nothing to compare";
  if (!std::isfinite(height.relative_error))
    return fmt::format("no relief on the way; RMS {}", format_length(height.rms_error));
  return fmt::format("RMS error {:.2f} % of {} met ({})", 100.0 * height.relative_error,
                     format_length(height.amplitude), format_length(height.rms_error));
}

void print_summary(const Experiment& experiment, const RunResult& run, const RunReport& report,
                   const std::string& where) {
  const RunMetrics& m = report.metrics;
  std::cout << fmt::format("scene    {}\n", experiment.name);
  std::cout << fmt::format("law      {}\n", report.law);
  std::cout << fmt::format("device   {}, {} probe\n", experiment.device.name, to_string(experiment.probe));
  std::cout << fmt::format("stroke   {}\n", report.setup.back().value);
  std::cout << fmt::format("ticks    {} at {:g} Hz, {} in contact\n", run.summary.ticks, experiment.rate,
                           m.ticks.contact);
  std::cout << fmt::format("force    mean {:.3g} N, max {:.3g} N\n", m.force.mean, m.force.max);
  if (experiment.scene.settings().tool_length > 0.0)
    std::cout << fmt::format("torque   mean {:.3g} mN m, max {:.3g} mN m\n", 1e3 * m.torque.mean, 1e3 * m.torque.max);
  std::cout << fmt::format("height   {}\n", height_line(m.height));
  std::cout << fmt::format("update   p50 {}, p99.9 {}\n", format_seconds(m.update.p50), format_seconds(m.update.p999));
  std::cout << fmt::format("flags    {}\n", flag_list(m.ticks));
  std::cout << fmt::format("hash     {}\n", format_hash(run.hash));
  std::cout << fmt::format("{}\n", where);
}

Status write_outputs(const Experiment& experiment, const RunResult& run, const RunReport& report,
                     const TouchOptions& options, const TraceMetadata& metadata, const fs::path& folder, Json& files) {
  if (options.csv) {
    const Trace trace{metadata, run.records, true, 0, {}, {}, {}};
    ASPERITY_CHECK(export_trace(trace, (folder / "trace.csv").string()));
    files["csv"] = (folder / "trace.csv").string();
  }
  if (!options.no_report) {
    ASPERITY_CHECK(write_run_report(folder / "report.html", report));
    files["report"] = (folder / "report.html").string();
    if (report.picture) {
      ASPERITY_CHECK(write_file_atomically(folder / "picture.png", report.picture->png));
      files["picture"] = (folder / "picture.png").string();
    }
  }
  const std::string numbers =
      run_json(experiment, run, report, files).dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  return write_file_atomically(folder / "run.json", numbers);
}

Result<int> touch(const TouchOptions& options, const Console& console) {
  const Progress progress = console.progress();
  ASPERITY_TRY(const Experiment experiment, load_scene(options.scene, progress));
  const fs::path folder = options.out.empty() ? fs::path("out") / folder_name(experiment.name) : fs::path(options.out);
  ASPERITY_CHECK(check_length(experiment));
  ASPERITY_CHECK(make_output_folder(folder.string()));
  const TraceMetadata metadata = trace_metadata(experiment, options.scene.scene, console);
  const std::string trace_path = (folder / "trace.asptrace").string();
  ASPERITY_TRY(TraceOutput trace, TraceOutput::open(trace_path, metadata));
  Result<RunResult> run = run_experiment(
      experiment, [&](const TraceRecord& tick) { return trace.append(tick); }, progress);
  if (!run) {
    trace.discard();
    return std::move(run).error();
  }
  ASPERITY_CHECK(trace.finish());
  ASPERITY_TRY(const RunReport report,
               build_report(experiment, *run, console, progress, !options.no_report && !options.no_picture));
  Json files{{"trace", trace_path}, {"numbers", (folder / "run.json").string()}};
  ASPERITY_CHECK(write_outputs(experiment, *run, report, options, metadata, folder, files));
  for (const std::string& note : experiment.notes) console.note(note);
  for (const std::string& warning : report.origin.warnings) console.note(warning);
  const std::string where =
      options.no_report ? "trace    " + trace_path : "report   " + (folder / "report.html").string();
  if (console.json) {
    console.print(run_json(experiment, *run, report, files));
  } else {
    print_summary(experiment, *run, report, where);
  }
  const bool broken =
      run->summary.flags.has(TickFlag::output_not_finite) || run->summary.flags.has(TickFlag::input_not_finite);
  if (broken) console.note("a probe position or a force was not finite");
  return broken ? exit_check_failed : exit_success;
}

}  // namespace

void add_touch(Arguments& program, Console& console, Action& action) {
  Arguments command = program.command("touch", "Slide a probe over a scene; write trace, numbers and report");
  auto options = std::make_shared<TouchOptions>();
  add_scene_options(command, options->scene);
  command
      .option("--law", options->scene.law,
              "Of every surface: see below, or asperity schema law for what each can be told")
      .group("Touch");
  command.option("--out", options->out, "Folder of the outputs; default out/SCENE");
  const Argument no_report =
      command.flag("--no-report", options->no_report, "Trace and numbers only: no picture, no page");
  command.flag("--no-picture", options->no_picture, "The page with all its plots, and no picture drawn")
      .excludes(no_report);
  command.flag("--csv", options->csv, "The trace as a table as well (trace.csv, trace.json)");
  add_console_options(command, console);
  command.closing_words(
      words_of_laws() +
      "A mesh alone, or a mesh and a map, is a scene: the mesh is fitted to the device's workspace, the map is laid on "
      "it.\n"
      "Examples:\n"
      "  asperity touch                                           the built-in scene\n"
      "  asperity touch bunny.obj --relief rock.png --height 2mm --tile 30mm\n"
      "  asperity touch bunny.obj --implicit --law virtual-contact-point\n"
      "  asperity touch M_a-H_3 --law height-field-literal --force 1N\n"
      "  asperity touch my.json --probe dynamic --device omega.7 --json --no-report");
  command.when_called(
      [options, &console, &action] { action = [options, &console] { return touch(*options, console); }; });
}

}  // namespace asperity::program
