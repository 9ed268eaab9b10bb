// asperity score: laws on a measured trajectory.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>

#include "apps/asperity/rival.h"
#include "apps/asperity/run.h"
#include "apps/asperity/scene_argument.h"
#include "asperity/io/atomic_file.h"
#include "asperity/io/trace_file.h"
#include "asperity/study/path_report.h"

namespace asperity::program {
namespace {

namespace fs = std::filesystem;

constexpr double degrees = 57.29577951308232;

struct ScoreOptions {
  std::string file;
  SceneArgument scene;
  std::vector<std::string> laws;
  std::string positions;
  std::string out;
  bool synthesise = false;
  bool no_report = false;
};

bool is_trace(const std::string& file) {
  std::error_code ignored;
  return fs::is_regular_file(file, ignored) && is_trace_file(file);
}

/// The scene that is named, or that a trace holds.
Result<Experiment> scene_of(const ScoreOptions& options, const Progress& progress) {
  if (!options.scene.scene.empty()) return load_scene(options.scene, progress);
  if (is_trace(options.file)) {
    ASPERITY_TRY(const Trace trace, read_trace(options.file));
    if (!trace.metadata.scene.empty())
      return parse_experiment(trace.metadata.scene, ".", options.file + " (scene)", progress);
  }
  return Error{ErrorCode::bad_value, "says not on which surface it was measured", options.file, "--scene",
               "a scene, a mesh or a built-in scene (asperity scenes)"};
}

/// What a law is felt through.
Result<Experiment> represented(const ScoreOptions& options, const Experiment& plain, const Rival& rival,
                               const Progress& progress) {
  if (rival.kind.empty()) return plain;
  if (options.scene.scene.empty()) {
    return Error{ErrorCode::bad_value, fmt::format("\"{}/\" needs the scene itself", rival.kind), options.file,
                 "--laws", "laws without a kind, or --scene"};
  }
  SceneArgument argument = options.scene;
  argument.felt_as = rival.kind;
  return load_scene(argument, progress);
}

/// The scene felt exactly: by the constraint on the true surface, without friction, damping or texture.
Result<Experiment> exact_of(const Experiment& experiment) {
  std::vector<Instance> instances(experiment.scene.instances().begin(), experiment.scene.instances().end());
  for (Instance& instance : instances) {
    instance.law = ProxyLaw{};
    instance.fine = nullptr;
    instance.dense = nullptr;
    instance.material.damping = 0.0;
    instance.material.static_friction = instance.material.dynamic_friction = 0.0;
    instance.material.friction = {};
    instance.material.friction_named = false;
  }
  Experiment exact = experiment;
  exact.probe = ProbeKind::ideal;
  ASPERITY_TRY(exact.scene, Scene::build(std::move(instances), experiment.scene.probe_radius()));
  return exact;
}

/// Writes what the exact geometry answers on the scene's stroke. A file that is there is somebody's measurement.
Status synthesise(const ScoreOptions& options, const Experiment& experiment, const Progress& progress) {
  std::error_code ignored;
  if (fs::exists(options.file, ignored)) {
    return Error{ErrorCode::file_unwritable,
                 "is there already, and --synthesise overwrites nothing",
                 options.file,
                 {},
                 "a new name"};
  }
  ASPERITY_TRY(const Experiment exact, exact_of(experiment));
  ASPERITY_TRY(const double stiffness, common_stiffness(exact.scene));
  ASPERITY_TRY(const RunResult run, run_experiment(exact, {}, progress));
  ASPERITY_TRY(const MeasuredPath path, measured_path_from(run.records, PathPlace::surface, stiffness));
  return write_file_atomically(options.file, measured_path_csv(path));
}

Result<MeasuredPath> read_path(const ScoreOptions& options) {
  ASPERITY_TRY(MeasuredPath path, read_measured_path(options.file));
  path.place = value_named<PathPlace>(options.positions).value_or(path.place);
  return path;
}

Json score_json(const PathScore& score, const MeasuredPath& path) {
  const ForceErrors& e = score.force;
  return {
      {"law", score.law},
      {"verdict", verdict(score)},
      {"stiffness_n_m", score.stiffness},
      {"samples", e.samples},
      {"compared", e.compared},
      {"rms_measured_n", e.rms_measured},
      {"rms_error_n", e.rms_error},
      {"relative_error", finite_or_null(e.relative)},
      {"mean_error_n", e.mean_error},
      {"largest_error_n", e.largest_error},
      {"largest_error_at_s", path.samples[e.largest_at].time.count()},
      {"peak_measured_n", e.peak_measured},
      {"peak_rendered_n", e.peak_rendered},
      {"peak_error_n", e.peak_rendered - e.peak_measured},
      {"mean_angle_rad", finite_or_null(e.mean_angle)},
      {"largest_angle_rad", finite_or_null(e.largest_angle)},
      {"normal_error",
       {{"samples", score.normal.samples},
        {"mean_rad", score.normal.mean},
        {"p99_rad", score.normal.p99},
        {"max_rad", score.normal.max}}},
      {"missed", e.missed},
      {"added", e.added},
      {"penetration",
       {{"mean_m", score.mean_penetration}, {"p99_m", score.p99_penetration}, {"max_m", score.largest_penetration}}}};
}

std::string cell(double value, const char* format) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : std::string("-");
}

void print_scores(const std::string& file, const MeasuredPath& path, const std::vector<PathScore>& scores) {
  std::cout << fmt::format("{}: {} samples over {} and {:.3g} s; laws are driven {}\n", file, path.samples.size(),
                           format_length(distance_along(path).back()), path.samples.back().time.count(),
                           path.place == PathPlace::surface
                               ? fmt::format("F / {:g} N/mm beneath it", scores.front().stiffness * 1e-3)
                               : std::string("where the probe was"));
  std::size_t widest = 16;
  for (const PathScore& score : scores) widest = std::max(widest, score.law.size() + 2);
  std::cout << fmt::format("{:<{}}{:>11}{:>10}{:>11}{:>12}{:>12}{:>12}{:>14}{:>9}{:>9}{:>13}\n", "law", widest,
                           "RMS |dF|", "of force", "largest", "peak error", "angle", "largest", "normal", "missed",
                           "added", "penetration");
  for (const PathScore& score : scores) {
    const ForceErrors& e = score.force;
    const auto angle = [](double value) { return cell(value * degrees, "{:.3g} deg"); };
    std::cout << fmt::format(
        "{:<{}}{:>11}{:>10}{:>11}{:>12}{:>12}{:>12}{:>14}{:>9}{:>9}{:>13}\n", score.law, widest,
        cell(e.rms_error, "{:.3g} N"), cell(100.0 * e.relative, "{:.3g} %"), cell(e.largest_error, "{:.3g} N"),
        cell(e.peak_rendered - e.peak_measured, "{:+.2g} N"), angle(e.mean_angle), angle(e.largest_angle),
        score.normal.samples > 0 ? angle(score.normal.mean) : "-", cell(100.0 * e.missed, "{:.2g} %"),
        cell(100.0 * e.added, "{:.2g} %"), format_length(score.largest_penetration));
  }
}

Result<std::vector<PathScore>> score_all(const ScoreOptions& options, const Experiment& experiment,
                                         const MeasuredPath& path, const Progress& progress) {
  std::vector<std::pair<Rival, Experiment>> felt;
  // Every law is checked before any is driven.
  for (const std::string& name : options.laws.empty() ? suitable_rivals(experiment) : options.laws) {
    ASPERITY_TRY(Rival rival, parse_rival(name));
    ASPERITY_TRY(const Experiment shown, represented(options, experiment, rival, progress));
    ASPERITY_TRY(Experiment changed, felt_by(shown, rival));
    felt.emplace_back(std::move(rival), std::move(changed));
  }
  std::vector<PathScore> scores;
  for (const auto& [rival, changed] : felt) {
    ScoreSettings settings;
    settings.rate = changed.rate;
    Result<PathScore> score = score_path(changed.scene, path, settings, progress);
    if (!score) return std::move(score).error().in_file(options.file);
    score->law = rival.name;
    scores.push_back(std::move(*score));
  }
  return scores;
}

Result<int> score(const ScoreOptions& options, const Console& console) {
  const Progress progress = console.progress();
  PathReport report;
  // What is wrong with the file is said before a scene is built.
  if (!options.synthesise) {
    ASPERITY_TRY(report.path, read_path(options));
  }
  ASPERITY_TRY(const Experiment experiment, scene_of(options, progress));
  if (options.synthesise) {
    ASPERITY_CHECK(synthesise(options, experiment, progress));
    ASPERITY_TRY(report.path, read_path(options));
  }
  ASPERITY_TRY(report.scores, score_all(options, experiment, report.path, progress));
  const fs::path folder = options.out.empty()
                              ? fs::path("out") / (folder_name(fs::path(options.file).stem().string()) + "-score")
                              : fs::path(options.out);
  ASPERITY_CHECK(make_output_folder(folder.string()));
  Json document{{"program", program_name()}, {"command", console.command_line},           {"file", options.file},
                {"scene", experiment.name},  {"positions", to_string(report.path.place)}, {"notes", experiment.notes}};
  for (const PathScore& one : report.scores) document["laws"].push_back(score_json(one, report.path));
  if (!options.no_report) {
    report.origin = report_origin(experiment, console);
    report.origin.title = fmt::format("{} on {}", fs::path(options.file).filename().string(), experiment.name);
    ASPERITY_CHECK(write_path_report(folder / "report.html", report));
    document["files"]["report"] = (folder / "report.html").string();
  }
  for (PathScore& one : report.scores) std::replace(one.law.begin(), one.law.end(), '"', '\'');
  ASPERITY_CHECK(write_file_atomically(folder / "score.csv", scores_csv(report.path, report.scores)));
  document["files"]["columns"] = (folder / "score.csv").string();
  document["files"]["numbers"] = (folder / "score.json").string();
  ASPERITY_CHECK(write_file_atomically(folder / "score.json",
                                       document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"));
  for (const std::string& note : experiment.notes) console.note(note);
  if (console.json) {
    console.print(document);
    return exit_success;
  }
  print_scores(options.file, report.path, report.scores);
  if (!options.no_report) std::cout << "report  " << (folder / "report.html").string() << '\n';
  std::cout << "numbers " << (folder / "score.json").string() << '\n';
  return exit_success;
}

void add_surface_options(Arguments& command, SceneArgument& a) {
  command.option("--scene", a.scene,
                 "The surface it was measured on: a scene file, a mesh, a volume or a built-in scene; default: the "
                 "trace's own");
  command.option("--relief", a.relief, "Height map (PNG, JPEG, EXR) to lay on every surface").group("Relief");
  command.option("--height", a.height, "Relief from black to white: 2mm").group("Relief");
  command.option("--tile", a.tile, "Width of one repeat of the map: 20mm").group("Relief");
  command.option("--mapping", a.mapping, "auto, uv, per_face, triplanar").group("Relief");
  command.option("--units", a.units, "Unit of the mesh file: m, cm, mm, um, in").group("Mesh");
  command.option("--fit", a.fit, "workspace, none, or the largest side: 80mm").group("Mesh");
  command.option("--up", a.up, "The mesh's axis that points up: x, y, z, -x, -y, -z").group("Mesh");
  command.option("--stiffness", a.stiffness, "Of every surface, and of the path's correction: 1000, 0.5N/mm")
      .group("Touch");
  command.option("--rate", a.rate, "Ticks a second at least: 1kHz").group("Touch");
  command.option("--probe-radius", a.probe_radius, "Radius of the tip whose middle was measured: 0.5mm").group("Touch");
}

}  // namespace

void add_score(Arguments& program, Console& console, Action& action) {
  Arguments command = program.command("score", "Score laws on a measured trajectory: a probe's path with its forces");
  auto options = std::make_shared<ScoreOptions>();
  options->scene.scene.clear();
  // Of what was measured, the place of a tip's middle is known where its radius is said.
  options->scene.unstated_radius = "0";
  command
      .option("FILE", options->file,
              "CSV with the columns time, x, y, z, fx, fy, fz in the scene's frame, units as suffix or in brackets "
              "(x_mm, \"x [mm]\"), SI without; or a trace")
      .required();
  add_surface_options(command, options->scene);
  command
      .option("--laws", options->laws,
              "Laws, separated by commas, as in asperity compare; default: those that suit the scene")
      .delimiter(',');
  command
      .option("--positions", options->positions,
              "surface: on the true surface, so that laws are driven at x - F / k (default of CSV files); probe: "
              "of a device's probe, where laws are driven as it is (default of traces)")
      .one_of(all_names<PathPlace>());
  command.flag("--synthesise", options->synthesise,
               "First write FILE: what the exact geometry answers on the scene's stroke");
  command.option("--out", options->out, "Folder of the outputs; default out/FILE-score");
  command.flag("--no-report", options->no_report, "Numbers only: no page");
  add_console_options(command, console);
  command.closing_words(
      "dF: the law's force less the measured one, over samples where either is above 1 mN. angle: between the two. "
      "normal: mean angle of the law's force to the true surface's normal.\n"
      "missed: share of the measured contact where the law answers nothing; added: the other way round. penetration: "
      "the largest.\n"
      "Examples:\n"
      "  asperity score reference.csv --scene M_a-H_3 --synthesise\n"
      "  asperity score scan.csv --scene bunny.obj --units mm --fit none --laws proxy,god-object\n"
      "  asperity score out/M_a-H_3/trace.asptrace --laws proxy,mesostructure,force-shading");
  command.when_called(
      [options, &console, &action] { action = [options, &console] { return score(*options, console); }; });
}

}  // namespace asperity::program
