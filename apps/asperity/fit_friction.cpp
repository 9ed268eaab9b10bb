// asperity fit-friction: friction laws against measured stick-slip.

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <memory>
#include <set>

#include "apps/asperity/minimiser.h"
#include "apps/asperity/run.h"
#include "asperity/io/atomic_file.h"
#include "asperity/study/friction_report.h"

namespace asperity::program {

Minimiser& own_minimiser() {
  static Minimiser minimiser;
  return minimiser;
}

namespace {

namespace fs = std::filesystem;

struct FitFrictionOptions {
  std::vector<std::string> files;
  std::vector<std::string> laws;
  std::vector<std::string> fitted;
  std::vector<std::string> predicted;
  std::string stiffness;
  std::string speed;
  std::string mass;
  std::string load;
  bool free_load = false;
  std::uint32_t seed = 1;
  std::size_t evaluations = 80;
  std::string out = "out/fit-friction";
  bool no_report = false;
};

Result<Minimiser> minimiser() {
  if (own_minimiser()) return own_minimiser();
  return Error{ErrorCode::file_unsupported,
               "friction is fitted with NLopt, which this program was built without",
               {},
               "fit-friction",
               "NLopt 2 (Debian: scripts/install-packages fitting) and a new build"};
}

/// An option's quantity, above 0; nothing where it was not given.
Result<std::optional<double>> quantity(const std::string& text, Dimension dimension, const char* option) {
  if (text.empty()) return std::optional<double>();
  Result<double> value = parse_quantity(text, dimension);
  if (!value) return std::move(value).error().at(option);
  if (!(*value > 0.0)) return Error{ErrorCode::bad_value, "is not above 0", {}, option, "a quantity above 0"};
  return std::optional<double>(*value);
}

/// The files, and the CSV files of folders.
Result<std::vector<fs::path>> files_of(const std::vector<std::string>& names) {
  std::vector<fs::path> files;
  for (const std::string& name : names) {
    std::error_code problem;
    if (!fs::is_directory(name, problem)) {
      files.emplace_back(name);
      continue;
    }
    std::vector<fs::path> found;
    for (fs::directory_iterator entry(name, problem), end; !problem && entry != end; entry.increment(problem)) {
      if (entry->path().extension() == ".csv") found.push_back(entry->path());
    }
    if (found.empty()) return Error{ErrorCode::file_missing, "has no CSV files in it", name, {}, "traces (.csv)"};
    std::sort(found.begin(), found.end());
    files.insert(files.end(), found.begin(), found.end());
  }
  // A trace that counts twice is fitted and predicted at once.
  std::set<fs::path> seen;
  for (const fs::path& file : files) {
    std::error_code problem;
    const fs::path real = fs::weakly_canonical(file, problem);
    if (!seen.insert(problem ? file : real).second)
      return Error{
          ErrorCode::bad_value, "is named twice", file.string(), {}, "each trace once, by itself or its folder"};
  }
  return files;
}

/// Takes off what the names of all traces begin with, up to an underscore ("stickslip_").
void shorten_names(std::vector<FitTrace>& traces) {
  if (traces.size() < 2) return;
  std::string prefix = traces.front().trace.name;
  for (const FitTrace& trace : traces) {
    const auto end =
        std::mismatch(prefix.begin(), prefix.end(), trace.trace.name.begin(), trace.trace.name.end()).first;
    prefix.erase(end, prefix.end());
  }
  const std::size_t underscore = prefix.rfind('_');
  if (underscore == std::string::npos) return;
  for (FitTrace& trace : traces) trace.trace.name.erase(0, underscore + 1);
}

/// Which of the traces a name of --fit or --predict means: a file as it was given, its name, or the part of its name
/// that no other has.
Result<std::size_t> trace_named(const std::string& name, const std::vector<fs::path>& files, const char* option) {
  std::vector<std::size_t> matches;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (files[i] == name || files[i].filename() == name || files[i].stem() == name) return i;
    if (files[i].stem().string().find(name) != std::string::npos) matches.push_back(i);
  }
  if (matches.size() == 1) return matches.front();
  return Error{ErrorCode::bad_value,
               matches.empty() ? fmt::format("\"{}\" is none of the files", name)
                               : fmt::format("\"{}\" is part of the names of {} files", name, matches.size()),
               {},
               option,
               "names of files that are given as well, separated by commas"};
}

/// Which traces are fitted and which predicted.
Status split(const FitFrictionOptions& options, const std::vector<fs::path>& files, std::vector<FitTrace>& traces) {
  if (options.fitted.empty() && options.predicted.empty()) {
    choose_fitted(traces);
    return success();
  }
  // Those that neither option names are what the option that is given leaves.
  for (FitTrace& trace : traces) trace.fitted = options.fitted.empty();
  for (const std::string& name : options.fitted) {
    ASPERITY_TRY(const std::size_t i, trace_named(name, files, "--fit"));
    traces[i].fitted = true;
  }
  for (const std::string& name : options.predicted) {
    ASPERITY_TRY(const std::size_t i, trace_named(name, files, "--predict"));
    if (!options.fitted.empty() && traces[i].fitted) {
      return Error{ErrorCode::bad_value,
                   fmt::format("\"{}\" is named by --fit as well", name),
                   {},
                   "--predict",
                   "traces that are not fitted"};
    }
    traces[i].fitted = false;
  }
  if (std::none_of(traces.begin(), traces.end(), [](const FitTrace& t) { return t.fitted; }))
    return Error{ErrorCode::bad_value, "leaves no trace to fit on", {}, "--predict", "all traces but one or more"};
  return success();
}

Result<FitSettings> settings_of(const FitFrictionOptions& options) {
  FitSettings settings;
  for (const std::string& name : options.laws.empty() ? friction_names() : options.laws) {
    Result<FrictionKind> kind = friction_by_name(name);
    if (!kind) return std::move(kind).error().at("--laws");
    settings.laws.push_back(*kind);
  }
  ASPERITY_TRY(settings.mass, quantity(options.mass, Dimension::mass, "--mass"));
  ASPERITY_TRY(settings.load, quantity(options.load, Dimension::force, "--load"));
  settings.tied = !options.free_load;
  settings.seed = options.seed;
  settings.global_evaluations = options.evaluations - options.evaluations * 3 / 8;
  settings.local_evaluations = options.evaluations * 3 / 8;
  return settings;
}

/// What can be put into a scene: surfaces[].material, with the friction law by name.
Json material_json(const LawFit& fit) {
  Json material = Json::object();
  for (const char* key : {"static_friction", "dynamic_friction"}) {
    const double value = friction_parameter(fit, key);
    if (std::isfinite(value)) material[key] = value;
  }
  material["friction"] = {{"law", friction_name(fit.law.kind)}};
  for (const std::string& key : friction_parameters(fit.law.kind)) {
    const double value = friction_parameter(fit, key);
    if (std::isfinite(value)) material["friction"][key] = value;
  }
  return material;
}

Json stick_slip_json(const StickSlip& s) {
  return {{"events", s.events},
          {"period_s", s.period},
          {"period_spread_s", s.period_spread},
          {"amplitude", s.amplitude},
          {"amplitude_spread", s.amplitude_spread},
          {"static_over_dynamic", s.ratio()},
          {"level", s.level},
          {"swing", s.swing},
          {"threshold", s.threshold}};
}

Json law_json(const LawFit& fit, const std::vector<FitTrace>& traces) {
  Json law{{"law", friction_name(fit.law.kind)},
           {"verdict", verdict(fit, traces)},
           {"fitted_misfit", fit.fitted_misfit},
           {"predicted_misfit", fit.predicted_misfit},
           {"step_error", fit.step_error},
           {"evaluations", fit.evaluations},
           {"mass_kg", fit.mass},
           {"load_n", fit.load},
           {"at_bounds", fit.at_bounds},
           {"material", material_json(fit)}};
  for (std::size_t i = 0; i < traces.size(); ++i) {
    const TraceComparison& c = fit.traces[i];
    law["traces"].push_back({{"trace", traces[i].trace.name},
                             {"use", traces[i].fitted ? "fitted" : "predicted"},
                             {"measured", stick_slip_json(c.measured)},
                             {"predicted", stick_slip_json(c.predicted)},
                             {"errors",
                              {{"level", c.errors.level},
                               {"period", c.errors.period},
                               {"amplitude", c.errors.amplitude},
                               {"static_over_dynamic", c.errors.ratio},
                               {"shape", c.errors.shape}}},
                             {"slides_if_begun_in_motion", c.also_slides},
                             {"misfit", c.errors.misfit()}});
  }
  return law;
}

/// "0.141>0.136 -4 %": measured, predicted, error.
std::string pair_of(double measured, double predicted, const char* format) {
  const auto one = [&](double value) {
    return value > 0.0 ? fmt::format(fmt::runtime(format), value) : std::string("steady");
  };
  return fmt::format("{:>7}{:>8}{:>8}", one(measured), one(predicted), error_words(measured, predicted));
}

void print_table(const std::vector<FitTrace>& traces, const std::vector<LawFit>& fits) {
  std::size_t widest = 8;
  for (const FitTrace& trace : traces) widest = std::max(widest, trace.trace.name.size() + 2);
  std::cout << fmt::format("{:<{}}{:<11}{:^23}  {:^23}  {:^23}  {:^23}  {:>7}\n", "", widest, "", "period (s)",
                           "amplitude", "static/dynamic", "level", "misfit");
  std::cout << fmt::format("{:<{}}{:<11}", "trace", widest, "");
  for (int i = 0; i < 4; ++i) std::cout << fmt::format("{:>7}{:>8}{:>8}  ", "measured", "law", "error");
  std::cout << '\n';
  for (const LawFit& fit : fits) {
    std::cout << fmt::format("{}: {}\n", friction_name(fit.law.kind), verdict(fit, traces));
    for (std::size_t i = 0; i < traces.size(); ++i) {
      const StickSlip& m = fit.traces[i].measured;
      const StickSlip& p = fit.traces[i].predicted;
      std::cout << fmt::format("{:<{}}{:<11}{}  {}  {}  {}  {:>7.2f}\n", traces[i].trace.name, widest,
                               traces[i].fitted ? "fitted" : "predicted", pair_of(m.period, p.period, "{:.3g}"),
                               pair_of(m.amplitude, p.amplitude, "{:.4f}"), pair_of(m.ratio(), p.ratio(), "{:.3f}"),
                               pair_of(m.level, p.level, "{:.3f}"), fit.traces[i].errors.misfit());
    }
    std::string parameters = fmt::format("  mass {:.3g} g, load {:.3g} N", 1e3 * fit.mass, fit.load);
    for (const char* name : {"static_friction", "dynamic_friction", "stiffness", "damping", "viscosity", "stick_speed",
                             "stribeck_speed", "exponent", "adhesion"}) {
      const double value = friction_parameter(fit, name);
      if (std::isfinite(value)) parameters += fmt::format(", {} {:.4g}", name, value);
    }
    if (!fit.at_bounds.empty())
      parameters += fmt::format("; at an end of what was searched: {}", fmt::join(fit.at_bounds, ", "));
    std::cout << parameters << '\n';
  }
}

Result<int> fit(const FitFrictionOptions& options, const Console& console) {
  ASPERITY_TRY(const FitSettings settings, settings_of(options));
  FrictionTraceSettings drive;
  ASPERITY_TRY(drive.stiffness, quantity(options.stiffness, Dimension::stiffness, "--stiffness"));
  ASPERITY_TRY(drive.speed, quantity(options.speed, Dimension::speed, "--speed"));
  ASPERITY_TRY(const std::vector<fs::path> files, files_of(options.files));
  FrictionReport report;
  for (const fs::path& file : files) {
    ASPERITY_TRY(FrictionTrace trace, read_friction_trace(file, drive));
    report.traces.push_back({std::move(trace), true});
  }
  ASPERITY_CHECK(split(options, files, report.traces));
  shorten_names(report.traces);
  ASPERITY_TRY(const Minimiser search, minimiser());
  const fs::path folder(options.out);
  ASPERITY_CHECK(make_output_folder(folder.string()));
  ASPERITY_TRY(report.laws, fit_friction(report.traces, settings, search, console.progress()));
  report.stick_slip = settings.stick_slip;
  report.origin.title = "Friction laws against measured stick-slip";
  report.origin.command = console.command_line;
  report.origin.date = fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::time(nullptr)));
  report.origin.program = program_name();
  report.origin.notes = {
      settings.mass || settings.load || !settings.tied
          ? "The slider's mass and load are as given, or fitted apart."
          : "The files say neither mass nor load: the mass is fitted, and the load taken as the slider's weight.",
      fmt::format(
          "Measured and predicted traces pass the same running median of {:g} ms, and the same threshold for an "
          "event.",
          1e3 * settings.stick_slip.filter.count()),
      "No law here lets the static coefficient grow with the time of sticking (aging), nor the surface differ from "
      "place "
      "to place: the scatter from event to event is beyond all of them."};
  Json document{{"program", program_name()}, {"command", console.command_line}, {"seed", settings.seed}};
  for (const LawFit& one : report.laws) document["laws"].push_back(law_json(one, report.traces));
  if (!options.no_report) {
    ASPERITY_CHECK(write_friction_report(folder / "report.html", report));
    document["files"]["report"] = (folder / "report.html").string();
  }
  document["files"]["numbers"] = (folder / "fit-friction.json").string();
  ASPERITY_CHECK(write_file_atomically(folder / "fit-friction.json",
                                       document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"));
  if (console.json) {
    console.print(document);
    return exit_success;
  }
  print_table(report.traces, report.laws);
  if (!options.no_report) std::cout << "report  " << (folder / "report.html").string() << '\n';
  std::cout << "numbers " << (folder / "fit-friction.json").string() << '\n';
  return exit_success;
}

}  // namespace

void add_fit_friction(Arguments& program, Console& console, Action& action) {
  Arguments command =
      program.command("fit-friction", "Fit friction laws to measured stick-slip, and predict what was not fitted");
  auto options = std::make_shared<FitFrictionOptions>();
  command
      .option("files", options->files,
              "Traces: CSV files with the columns t_s and friction_over_load (spring force over load), or folders "
              "of them. \"k168Nm\" and \"v42\" in a name are the spring's stiffness (N/m) and the drive's speed "
              "(um/s)")
      .required();
  command.option("--laws", options->laws, "Friction laws, separated by commas; default: all").delimiter(',');
  command
      .option("--fit", options->fitted,
              "Traces to fit on, by name or a part of it, separated by commas; default: from the slowest and "
              "softest on every other one but the last")
      .delimiter(',');
  command.option("--predict", options->predicted, "Traces to predict; default: those that are not fitted")
      .delimiter(',');
  command.option("--stiffness", options->stiffness, "Of the spring (168N/m), where a file's name does not say");
  command.option("--speed", options->speed, "Of the drive (0.042mm/s), where a file's name does not say");
  command.option("--mass", options->mass, "Of the slider (20g); default: fitted");
  command.option("--load", options->load, "Normal force on the slider (0.2N); default: its weight");
  command.flag("--free-load", options->free_load, "Fit the load apart from the mass");
  command.option("--seed", options->seed, "Of the search; the same seed finds the same").shows_default();
  command.option("--evaluations", options->evaluations, "Of the search, for each parameter of a law")
      .between(1, 100000)
      .shows_default();
  command.option("--out", options->out, "Folder of the outputs").shows_default();
  command.flag("--no-report", options->no_report, "Numbers only: no page");
  add_console_options(command, console);
  command.closing_words(
      "period: from peak to peak. amplitude: drop of an event, as friction over load. static/dynamic: mean peak over "
      "the mean middle of the drops. level: mean.\n"
      "misfit: root of the mean square of the five errors (those four, and the shape of a cycle); 0.1 is about 10 %.\n"
      "Examples:\n"
      "  asperity fit-friction friction/*.csv\n"
      "  asperity fit-friction friction --laws karnopp,lugre --fit k168Nm_v42,k168Nm_v1100\n"
      "  asperity fit-friction trace.csv --stiffness 168N/m --speed 0.042mm/s --mass 20g");
  command.when_called(
      [options, &console, &action] { action = [options, &console] { return fit(*options, console); }; });
}

}  // namespace asperity::program
