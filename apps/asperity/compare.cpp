// asperity compare: several laws on the same scene and stroke.

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <span>

#include "apps/asperity/rival.h"
#include "apps/asperity/run.h"
#include "apps/asperity/scene_argument.h"
#include "asperity/io/atomic_file.h"
#include "asperity/io/trace_file.h"
#include "asperity/render/law_registry.h"

namespace asperity::program {
namespace {

namespace fs = std::filesystem;

struct CompareOptions {
  SceneArgument scene;
  std::vector<std::string> laws;
  std::string out;
  bool no_report = false;
  bool no_picture = false;
  bool one_way = false;
};

/// A law run on the scene, with what a table shows of it.
struct Column {
  CompareEntry entry;
  std::uint64_t hash = 0;
  std::vector<TraceRecord> records;
};

/// The scene in every representation that is asked for, each made once, all on one stroke.
class Representations {
 public:
  Representations(const CompareOptions& options, const Experiment& plain, const Progress& progress)
      : options_(options), plain_(plain), progress_(progress) {}

  Result<const Experiment*> find(const std::string& kind) {
    if (kind.empty()) return &plain_;
    for (const auto& [name, experiment] : made_) {
      if (name == kind) return experiment.get();
    }
    for (const Instance& instance : plain_.scene.instances()) {
      if (base_of(instance.surface) != nullptr) continue;
      return Error{ErrorCode::bad_value, fmt::format("\"{}\" has no mesh to be felt as {}", instance.name, kind),
                   plain_.name, "--laws", "laws without a kind, or a scene of meshes"};
    }
    SceneArgument argument = options_.scene;
    argument.felt_as = kind;
    Result<Experiment> made = load_scene(argument, progress_, !options_.one_way);
    if (!made) return std::move(made).error();
    // What differs is how it is felt; the hand does the same.
    made->path = plain_.path;
    made_.emplace_back(kind, std::make_unique<Experiment>(std::move(made).value()));
    return made_.back().second.get();
  }

  /// The exact geometry that potentials are judged by: the relief where there are coats, else the mesh. nullptr where
  /// nothing implicit has a mesh.
  Result<const Scene*> exact(const std::vector<Rival>& rivals) {
    bool implicit = false;
    bool textured = false;
    for (const Rival& rival : rivals) {
      ASPERITY_TRY(const Experiment* experiment, find(rival.kind));
      for (const Instance& instance : experiment->scene.instances()) {
        const ImplicitSurface* surface = implicit_of(instance.surface);
        if (surface == nullptr) continue;
        // Noise, offsets and shells are no other representation's: each potential is its own measure.
        if (surface->mesh() == nullptr || surface->offset() > 0.0 || surface->parts().shell_thickness > 0.0)
          return nullptr;
        textured = textured || surface->textured();
        implicit = true;
        reach_ = std::min(reach_, edge_reach_of(experiment->scene));
      }
    }
    if (!implicit) return nullptr;
    ASPERITY_TRY(const Experiment* relief, find("relief"));
    for (const Instance& instance : relief->scene.instances()) {
      if (textured && instance.surface.index() == 0) return nullptr;
    }
    return &relief->scene;
  }
  /// From the edge: a law without a proxy feels where the probe is, as deep as it is pressed in.
  [[nodiscard]] double edge_reach() const {
    double depth = 0.0;
    for (const Instance& instance : plain_.scene.instances()) {
      const StrokeSettings& stroke = plain_.stroke;
      depth = std::max(
          depth, stroke.press == PressMode::force ? stroke.normal_force / instance.material.stiffness : stroke.depth);
    }
    return reach_ + depth;
  }

 private:
  const CompareOptions& options_;
  const Experiment& plain_;
  const Progress& progress_;
  std::vector<std::pair<std::string, std::unique_ptr<Experiment>>> made_;
  double reach_ = SeriesSettings{}.edge_reach;
};

Result<Column> run_law(const Experiment& experiment, const Rival& rival, const SeriesSettings& judged,
                       const Progress& progress) {
  ASPERITY_TRY(const Experiment changed, felt_by(experiment, rival));
  ASPERITY_TRY(RunResult run, run_experiment(changed, {}, progress));
  Column column;
  column.entry.law = rival.name;
  column.entry.series = derive_series(run.records, changed.scene, changed.path, judged);
  column.entry.metrics = measure_run(run.records, column.entry.series, changed.path);
  column.entry.metrics.energy.account = account_rows(run.account);
  column.hash = run.hash;
  column.records = std::move(run.records);
  return column;
}

Json law_json_of(const Column& column) {
  return Json{{"law", column.entry.law},
              {"force_hash", format_hash(column.hash)},
              {"metrics", Json::parse(metrics_json(column.entry.metrics))}};
}

std::string number(double value, const char* format) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : std::string("-");
}

void print_table(const Experiment& experiment, const std::vector<Column>& columns) {
  std::cout << fmt::format("scene {}: {}\n", experiment.name, setup_facts(experiment).back().value);
  const bool follows = followed_instance(experiment.scene) != nullptr;
  bool edges = false;
  std::size_t widest = 24;
  for (const Column& column : columns) {
    edges = edges || column.entry.metrics.direction_near.samples > 0;
    widest = std::max(widest, column.entry.law.size() + 2);
  }
  std::cout << fmt::format("{:<{}}{:>12}{}{:>12}{:>12}{:>14}{:>12}{}\n", "law", widest, "direction",
                           edges ? fmt::format("{:>12}{:>12}", "near edges", "elsewhere") : "", "height", "jump",
                           "energy/loop", "update p50", follows ? fmt::format("{:>12}{:>12}", "follow", "max") : "");
  for (const Column& column : columns) {
    const RunMetrics& m = column.entry.metrics;
    constexpr double degrees = 57.29577951308232;
    const auto share = [](double value) { return number(value * 100.0, "{:.3g} %"); };
    const auto angle = [](const DirectionMetrics& d) {
      return d.samples > 0 ? number(d.mean * degrees, "{:.2f} deg") : std::string("-");
    };
    std::cout << fmt::format("{:<{}}{:>12}{}{:>12}{:>12}{:>14}{:>12}{}\n", column.entry.law, widest, angle(m.direction),
                             edges ? fmt::format("{:>12}{:>12}", angle(m.direction_near), angle(m.direction_far)) : "",
                             number(m.height.relative_error * 100.0, "{:.2f} %"),
                             number(m.force.largest_jump, "{:.3g} N"), number(m.energy.mean_loop * 1e3, "{:+.3g} mJ"),
                             format_seconds(m.update.p50),
                             follows ? fmt::format("{:>12}{:>12}", share(m.follow.global), share(m.follow.max)) : "");
  }
}

/// Who notices the scene's isosurface, at speeds up to those that miss it.
Result<std::vector<DetectionRow>> detect(const Experiment& experiment, std::span<const Scene> felt) {
  DetectionSettings settings;
  settings.speeds = {0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0};
  settings.rate = experiment.rate;
  settings.passages = 300;
  return detection_table(felt, experiment.path, settings);
}

void print_detection(const std::vector<DetectionRow>& rows, const std::vector<Column>& columns) {
  if (rows.empty()) return;
  std::cout << fmt::format("{:>12}{:>12}{:>12}", "speed", "layer", "expected");
  for (const Column& column : columns) std::cout << fmt::format("{:>24}", column.entry.law);
  std::cout << '\n';
  const auto share = [](double value) { return number(value * 100.0, "{:.0f} %"); };
  for (const DetectionRow& row : rows) {
    std::cout << fmt::format("{:>12}{:>12}{:>12}", fmt::format("{:g} m/s", row.speed),
                             std::isfinite(row.layer) ? format_length(row.layer) : "-", share(row.expected));
    for (const double one : row.share) std::cout << fmt::format("{:>24}", share(one));
    std::cout << '\n';
  }
}

void print_loop_rates(const std::vector<LoopRateRow>& rows, const std::vector<Column>& columns) {
  if (rows.empty()) return;
  std::cout << fmt::format("{:>12}{:>12}", "samples", "memory");
  for (const Column& column : columns) std::cout << fmt::format("{:>24}", column.entry.law);
  std::cout << '\n';
  for (const LoopRateRow& row : rows) {
    std::cout << fmt::format("{:>12}{:>12}", row.samples, fmt::format("{:.3g} MB", row.bytes * 1e-6));
    for (const double p50 : row.p50)
      std::cout << fmt::format("{:>24}", fmt::format("{}, {:.0f} kHz", format_seconds(p50), 1e-3 / p50));
    std::cout << '\n';
  }
  std::cout << fmt::format("{:>12}{:>12}", "beside it", "");
  for (const double bytes : rows.back().law_bytes)
    std::cout << fmt::format("{:>24}", fmt::format("{:.0f} bytes", bytes));
  std::cout << '\n';
}

/// The scene as each of the laws feels it; none where nothing is followed.
Result<std::vector<Scene>> felt_scenes(const Experiment& experiment, const std::vector<Rival>& rivals) {
  std::vector<Scene> felt;
  if (followed_instance(experiment.scene) == nullptr) return felt;
  for (const Rival& rival : rivals) {
    ASPERITY_TRY(Experiment changed, felt_by(experiment, rival));
    felt.push_back(std::move(changed.scene));
  }
  return felt;
}

/// How long a tick takes over the size of the scene's volumes.
Result<std::vector<LoopRateRow>> rates_of(const Experiment& experiment, std::span<const Scene> felt,
                                          const Progress& progress) {
  if (felt.empty()) return std::vector<LoopRateRow>{};
  if (progress) progress("measuring the loop rate", 0.0);
  std::vector<Law> laws;
  for (const Scene& scene : felt) laws.push_back(scene.instances().front().law);
  return loop_rates(experiment.scene, experiment.path, laws, experiment.rate);
}

Json loop_rate_json(const std::vector<LoopRateRow>& rows) {
  Json list = Json::array();
  for (const LoopRateRow& row : rows)
    list.push_back(
        {{"samples", row.samples}, {"bytes", row.bytes}, {"law_bytes", row.law_bytes}, {"update_p50_s", row.p50}});
  return list;
}

Json detection_json(const std::vector<DetectionRow>& rows, const std::vector<Column>& columns) {
  Json list = Json::array();
  for (const DetectionRow& row : rows) {
    Json shares = Json::object();
    for (std::size_t i = 0; i < columns.size(); ++i) shares[columns[i].entry.law] = row.share[i];
    list.push_back({{"speed", row.speed}, {"layer", row.layer}, {"expected", row.expected}, {"share", shares}});
  }
  return list;
}

/// What each law says of itself, once a kind, beside what the scene's own say there already.
void add_law_facts(const std::vector<Rival>& rivals, std::vector<ReportFact>& facts) {
  for (const Rival& rival : rivals) {
    const Result<Law> law = law_by_name(rival.law);
    if (!law) continue;
    const std::string text = law_fact(law->kind());
    const bool told = std::any_of(facts.begin(), facts.end(), [&](const ReportFact& one) { return one.value == text; });
    if (!told) facts.push_back({fmt::format("law \"{}\"", law->facts().name), text});
  }
}

Result<std::vector<Rival>> parse_rivals(const std::vector<std::string>& names) {
  std::vector<Rival> rivals;
  for (const std::string& name : names) {
    ASPERITY_TRY(Rival rival, parse_rival(name));
    rivals.push_back(std::move(rival));
  }
  return rivals;
}

/// The first that touches with a point; empty: none does.
std::string of_a_point(const std::vector<Rival>& rivals) {
  for (const Rival& rival : rivals) {
    const Result<Law> law = law_by_name(rival.law);
    if (law && !law->takes_ball()) return rival.law;
  }
  return {};
}

/// The scene, and what is compared on it: all with one radius, which is 0 where any of them touches with a point,
/// unless the scene says it.
struct Compared {
  Experiment experiment;
  std::vector<Rival> rivals;
};
Result<Compared> load_compared(CompareOptions& options, const Progress& progress) {
  ASPERITY_TRY(std::vector<Rival> rivals, parse_rivals(options.laws));
  std::string point = of_a_point(rivals);
  if (!point.empty()) options.scene.unstated_radius = "0";
  ASPERITY_TRY(Experiment experiment, load_scene(options.scene, progress, !options.one_way));
  if (rivals.empty()) {
    ASPERITY_TRY(rivals, parse_rivals(default_rivals(experiment.scene)));
    point = of_a_point(rivals);
    if (!point.empty() && experiment.scene.probe_radius() > 0.0) {
      options.scene.unstated_radius = "0";
      ASPERITY_TRY(experiment, load_scene(options.scene, progress, !options.one_way));
    }
    ASPERITY_TRY(rivals, parse_rivals(suitable_rivals(experiment)));
  }
  if (!point.empty() && experiment.scene.probe_radius() == 0.0)
    experiment.notes.push_back(fmt::format("all are compared with a point: \"{}\" touches with one", point));
  return Compared{std::move(experiment), std::move(rivals)};
}

Result<int> compare(CompareOptions options, const Console& console) {
  const Progress progress = console.progress();
  ASPERITY_TRY(const Compared compared, load_compared(options, progress));
  const Experiment& experiment = compared.experiment;
  const std::vector<Rival>& rivals = compared.rivals;
  const fs::path folder =
      options.out.empty() ? fs::path("out") / (folder_name(experiment.name) + "-compare") : fs::path(options.out);
  // Every pair is checked before anything is run or written.
  Representations representations(options, experiment, progress);
  for (const Rival& rival : rivals) {
    ASPERITY_TRY(const Experiment* felt, representations.find(rival.kind));
    if (auto changed = felt_by(*felt, rival); !changed) return std::move(changed).error();
  }
  ASPERITY_TRY(const Scene* exact, representations.exact(rivals));
  ASPERITY_CHECK(check_length(experiment));
  ASPERITY_CHECK(make_output_folder(folder.string()));
  std::vector<Column> columns;
  for (const Rival& rival : rivals) {
    ASPERITY_TRY(const Experiment* felt, representations.find(rival.kind));
    ASPERITY_TRY(Column column, run_law(*felt, rival, {exact, representations.edge_reach()}, progress));
    columns.push_back(std::move(column));
  }
  ASPERITY_TRY(const std::vector<Scene> felt, felt_scenes(experiment, rivals));
  ASPERITY_TRY(const std::vector<LoopRateRow> rates, rates_of(experiment, felt, progress));
  ASPERITY_TRY(const std::vector<DetectionRow> detection, detect(experiment, felt));
  Json document{{"program", program_name()},
                {"command", console.command_line},
                {"scene", experiment.name},
                {"notes", experiment.notes}};
  for (const Column& column : columns) document["laws"].push_back(law_json_of(column));
  if (!rates.empty()) document["loop_rate"] = loop_rate_json(rates);
  if (!detection.empty()) document["detection"] = detection_json(detection, columns);
  if (!options.no_report) {
    CompareReport report;
    report.origin = report_origin(experiment, console);
    report.setup = setup_facts(experiment);
    add_law_facts(rivals, report.setup);
    for (const Column& column : columns) report.entries.push_back(column.entry);
    report.loop_rates = rates;
    report.detection = detection;
    if (!options.no_picture) {
      ASPERITY_TRY(report.picture,
                   render_picture(experiment.scene, experiment.path, columns.back().records, {}, progress));
    }
    ASPERITY_CHECK(write_compare_report(folder / "report.html", report));
    document["files"]["report"] = (folder / "report.html").string();
  }
  document["files"]["numbers"] = (folder / "compare.json").string();
  ASPERITY_CHECK(write_file_atomically(folder / "compare.json",
                                       document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"));
  for (const std::string& note : experiment.notes) console.note(note);
  if (console.json) {
    console.print(document);
  } else {
    print_table(experiment, columns);
    print_loop_rates(rates, columns);
    print_detection(detection, columns);
    std::cout << (options.no_report ? "numbers " + (folder / "compare.json").string()
                                    : "report  " + (folder / "report.html").string())
              << '\n';
  }
  return exit_success;
}

std::string words_of_friction() {
  std::string list;
  for (const std::string& name : friction_names()) list += (list.empty() ? "" : ", ") + name;
  return list;
}

}  // namespace

void add_compare(Arguments& program, Console& console, Action& action) {
  Arguments command = program.command("compare", "Put several laws side by side on one scene and stroke");
  auto options = std::make_shared<CompareOptions>();
  add_scene_options(command, options->scene);
  command
      .option("--laws", options->laws,
              "Laws, separated by commas; default: those that suit the scene. mesh/LAW, relief/LAW, implicit/LAW: "
              "meshes felt through that representation. LAW+FRICTION, LAW+texture-literal, ...: see below")
      .delimiter(',');
  command.flag("--one-way", options->one_way,
               "Follow the stroke as the scene says; without it an open stroke goes there and back, so that "
               "energy a loop can be told");
  command.option("--out", options->out, "Folder of the outputs; default out/SCENE-compare");
  const Argument no_report = command.flag("--no-report", options->no_report, "Numbers only: no picture, no page");
  command.flag("--no-picture", options->no_picture, "The page with all its plots, and no picture drawn")
      .excludes(no_report);
  add_console_options(command, console);
  command.closing_words(
      words_of_laws() +
      "direction: mean angle between the force and the relief's normal. height: RMS of followed height against the "
      "true relief, of what was\n"
      "met. jump: largest change of force within a tick. energy/loop: positive is energy fed into the hand. update: "
      "time of one tick. follow, max: on an isosurface, the error of eq. 20 over the path and the largest of a tick.\n"
      "A mesh felt through a potential is judged by its exact geometry; near edges: within 1.5 voxels and the "
      "depth pressed of edges that fold by 20 degrees or more.\n"
      "On an isosurface a second table says which share of straight passages through a layer each law notices at the "
      "scene's rate.\n"
      "Behind a law, after \"+\": a friction law (" +
      words_of_friction() +
      "), also with -literal; no-friction, texture, texture-literal, no-texture, lay, lay-literal.\n"
      "Examples:\n"
      "  asperity compare M_a-H_3 --laws proxy,mesostructure,force-shading\n"
      "  asperity compare bunny.obj --implicit --laws mesh/proxy,proxy,virtual-contact-point\n"
      "  asperity compare groove --laws mesostructure-literal,mesostructure\n"
      "  asperity compare bunny.obj --relief rock.png --height 1mm --json");
  command.when_called(
      [options, &console, &action] { action = [options, &console] { return compare(*options, console); }; });
}

}  // namespace asperity::program
