#include "apps/asperity/run.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/utsname.h>

#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>

#include "asperity/render/law_registry.h"
#include "asperity/render/step.h"
#include "asperity/servo/warm_memory.h"

namespace asperity::program {
namespace {

// A tick takes about 0.4 kB: what is kept stays under 1 GB.
constexpr std::uint64_t most_ticks = 2'000'000;

template <class Probe>
Result<RunResult> run_with(const Experiment& experiment, Probe& probe,
                           const std::function<Status(const TraceRecord&)>& record, const Progress& progress) {
  ASPERITY_TRY(SafetyStage safety, SafetyStage::build(SafetySettings::from_profile(experiment.device)));
  SessionSettings settings;
  settings.dt = Seconds(1.0 / experiment.rate);
  settings.expected_ticks = session_ticks(experiment.path.duration(), settings.dt);
  RunResult result;
  result.records.reserve(settings.expected_ticks);
  ProxyState state;
  ProxyCache cache(experiment.scene);
  Status written = success();
  // Not in real time: what a tick needs of a volume larger than memory is waited for.
  Status fetched = success();
  const auto keep = [&](const TraceRecord& tick) {
    result.records.push_back(tick);
    if (record) written = record(tick);
    return written.ok() && fetched.ok();
  };
  const auto render = [&](const ProbeSample& sample, Seconds dt) {
    if (fetched.ok()) fetched = fetch_volumes(experiment.scene, state, sample);
    return step(experiment.scene, state, cache, sample, dt);
  };
  warm_memory(progress);
  result.summary = run_session(render, probe, safety, settings, keep, progress);
  ASPERITY_CHECK(std::move(written));
  ASPERITY_CHECK(std::move(fetched));
  result.hash = force_hash(result.records);
  result.account = state.account;
  return result;
}

std::string processor_name() {
  std::ifstream stream("/proc/cpuinfo");
  std::string line;
  while (std::getline(stream, line)) {
    if (line.starts_with("model name")) {
      const std::size_t colon = line.find(": ");
      if (colon != std::string::npos) return line.substr(colon + 2);
    }
  }
  return {};
}

std::string machine_line() {
  utsname system{};
  if (::uname(&system) != 0) return processor_name();
  const std::string processor = processor_name();
  return fmt::format("{}{}{} {} {}", processor, processor.empty() ? "" : ", ", system.sysname, system.release,
                     system.machine);
}

/// "isosurface at 0.5 of 259 x 127 x 128 samples (smooth), 200 mm x 100 mm x 100 mm".
std::string volume_fact(const IsoSurface& iso) {
  const ScalarField& field = iso.field();
  const GridAxes& axes = field.axes();
  const Vec3 extent = field.bounds().extent();
  std::string text =
      fmt::format("isosurface at {:.5g} ({} inside) of {} x {} x {} samples ({}), {} x {} x {}", iso.threshold(),
                  iso.inside() == Inside::low ? "low" : "high", axes[0].size(), axes[1].size(), axes[2].size(),
                  field.reconstruction() == CellReconstruction::smooth ? "smooth" : "trilinear",
                  format_length(extent.x()), format_length(extent.y()), format_length(extent.z()));
  if (field.bricks() != nullptr) text += fmt::format(", in bricks of {} levels", field.levels());
  return text;
}

/// "potential of 28,576 triangles on voxels of 0.39 mm, 4,210 bricks (29 MB, dense 134 MB), stored 1.2 mm outside to
/// 5 mm inside".
std::string implicit_fact(const ImplicitSurface& surface) {
  const SparseGrid& grid = surface.grid();
  std::string text = surface.mesh() != nullptr
                         ? fmt::format("potential of {} triangles", surface.mesh()->mesh().triangles().size())
                         : std::string("level set");
  const double mega = 1e-6;
  text += fmt::format(
      " on voxels of {} ({}), {} bricks of 8 x 8 x 8 ({:.1f} MB; as a dense grid {:.1f} MB), stored {} "
      "outside to {} inside",
      format_length(grid.voxel()),
      surface.parts().reconstruction == CellReconstruction::smooth ? "smooth" : "trilinear", grid.bricks(),
      mega * static_cast<double>(grid.memory_bytes()), mega * static_cast<double>(grid.dense_bytes()),
      format_length(grid.outside()), format_length(-grid.inside()));
  if (surface.offset() > 0.0) text += fmt::format(", felt {} outside", format_length(surface.offset()));
  if (surface.textured()) text += ", textured";
  if (grid.has_materials()) text += ", with local materials";
  return text;
}

std::string parametric_fact(const ParametricSurface& surface) {
  const Vec3 extent = surface.bounds().extent();
  std::string text =
      fmt::format("{} by formula, {} x {} x {}, {:.0f} kB of bounds", parametric_name(surface.settings().shape),
                  format_length(extent.x()), format_length(extent.y()), format_length(extent.z()),
                  1e-3 * static_cast<double>(surface.memory_bytes()));
  if (!surface.settings().features.empty()) {
    text += fmt::format(", features {} to {}", format_length(surface.limits().lowest),
                        format_length(surface.limits().highest));
  }
  return text;
}

std::string custom_fact(const CustomSurface& surface) {
  const Vec3 extent = surface.bounds().extent();
  return fmt::format("custom surface \"{}\", {} x {} x {}, {}", surface.type(), format_length(extent.x()),
                     format_length(extent.y()), format_length(extent.z()),
                     surface.has_folds() ? "may have edges" : "without edges");
}

std::string surface_fact(const Instance& instance) {
  if (const CustomSurface* custom = custom_of(instance.surface)) return custom_fact(*custom);
  if (const ParametricSurface* parametric = parametric_of(instance.surface)) return parametric_fact(*parametric);
  if (const ImplicitSurface* implicit = implicit_of(instance.surface)) return implicit_fact(*implicit);
  if (const IsoSurface* iso = iso_of(instance.surface)) return volume_fact(*iso);
  const TriangleMesh& mesh = base_mesh(instance.surface);
  const Vec3 extent = mesh.bounds().extent();
  std::string text = fmt::format("{} triangles, {} x {} x {}", mesh.report().triangles, format_length(extent.x()),
                                 format_length(extent.y()), format_length(extent.z()));
  if (const auto* relief = std::get_if<std::shared_ptr<const ReliefSurface>>(&instance.surface)) {
    const Coat& coat = (*relief)->coat();
    text += fmt::format(", relief {} to {}, texel {}", format_length(coat.lowest()), format_length(coat.highest()),
                        format_length(coat.texel_size()));
  }
  return text;
}

}  // namespace

Status check_length(const Experiment& experiment) {
  const std::uint64_t ticks = session_ticks(experiment.path.duration(), Seconds(1.0 / experiment.rate));
  if (ticks <= most_ticks) return success();
  return Error{ErrorCode::too_large, fmt::format("takes {} ticks", ticks), experiment.name, "stroke",
               fmt::format("at most {} ticks: a shorter or faster stroke, or a lower rate", most_ticks)};
}

Result<RunResult> run_experiment(const Experiment& experiment, const std::function<Status(const TraceRecord&)>& record,
                                 const Progress& progress) {
  ASPERITY_CHECK(check_length(experiment));
  if (experiment.probe == ProbeKind::ideal) {
    Result<IdealProbe> probe = IdealProbe::build(experiment.path, experiment.ideal);
    if (!probe) return std::move(probe).error().at("probe.ideal");
    return run_with(experiment, *probe, record, progress);
  }
  Result<SimulatedDevice> device =
      SimulatedDevice::build(experiment.path, experiment.device, experiment.hand, experiment.simulated);
  if (!device) return std::move(device).error().at("probe.dynamic");
  return run_with(experiment, *device, record, progress);
}

std::string law_names_of(const Scene& scene) {
  std::string names;
  for (const Instance& instance : scene.instances()) {
    const std::string name = law_name(instance.law);
    if (names.find(name) == std::string::npos) names += (names.empty() ? "" : ", ") + name;
  }
  for (const FieldEffect& effect : scene.effects()) {
    names += (names.empty() ? "" : ", ") + std::string(field_effect_names()[static_cast<std::size_t>(effect.kind)]);
  }
  return names;
}

std::string law_fact(const LawKind& kind) {
  return fmt::format("{}: {} ({})", kind.facts->name, kind.facts->title, kind.facts->source);
}

std::string words_of_laws() {
  std::string words = "Laws; -literal behind those marked with *: as printed, its errata included\n";
  for (const LawKind* kind : law_kinds())
    words += fmt::format("{} {}\n", kind->form != nullptr ? " *" : "  ", law_fact(*kind));
  return words;
}

std::vector<ReportFact> setup_facts(const Experiment& experiment) {
  std::vector<ReportFact> facts;
  for (const Instance& instance : experiment.scene.instances()) {
    facts.push_back({fmt::format("surface \"{}\"", instance.name), surface_fact(instance)});
    facts.push_back({fmt::format("law, stiffness of \"{}\"", instance.name),
                     fmt::format("{}, {:.3g} N/mm", law_name(instance.law), instance.material.stiffness * 1e-3)});
    facts.push_back({fmt::format("by law \"{}\"", instance.law.facts().name), law_fact(instance.law.kind())});
  }
  for (const FieldEffect& effect : experiment.scene.effects()) {
    facts.push_back({fmt::format("effect \"{}\"", effect.name),
                     std::string(field_effect_names()[static_cast<std::size_t>(effect.kind)])});
  }
  facts.push_back({"device", fmt::format("{}: {:g} N, {:g} N/mm, {} steps", experiment.device.name,
                                         experiment.device.max_force, experiment.device.max_stiffness * 1e-3,
                                         format_length(experiment.device.position_resolution))});
  const double radius = experiment.scene.probe_radius();
  facts.push_back({"probe", fmt::format("{}, {}, {:g} Hz", to_string(experiment.probe),
                                        radius > 0.0 ? "radius " + format_length(radius) : std::string("a point"),
                                        experiment.rate)});
  if (experiment.probe == ProbeKind::dynamic) facts.push_back({"hand", experiment.hand.name});
  const StrokeSettings& stroke = experiment.stroke;
  std::string text = fmt::format("{}, {}", to_string(stroke.type), format_length(experiment.path.length()));
  if (stroke.type != StrokeType::recorded) {
    text += fmt::format(" at {:.3g} mm/s, {}", stroke.speed * 1e3,
                        stroke.press == PressMode::force ? fmt::format("pressed with {:.3g} N", stroke.normal_force)
                                                         : "depth " + format_length(stroke.depth));
  }
  facts.push_back({"stroke", text});
  return facts;
}

ReportOrigin report_origin(const Experiment& experiment, const Console& console) {
  ReportOrigin origin;
  origin.title = experiment.name;
  origin.command = console.command_line;
  origin.machine = machine_line();
  origin.date = fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::time(nullptr)));
  origin.program = program_name();
  origin.notes = experiment.notes;
  return origin;
}

TraceMetadata trace_metadata(const Experiment& experiment, const std::string& source, const Console& console) {
  TraceMetadata metadata;
  metadata.scene = experiment.canonical_json;
  metadata.source = source;
  metadata.command = console.command_line;
  metadata.device = experiment.device.name;
  metadata.program = program_name();
  metadata.rate = experiment.rate;
  metadata.seed = experiment.simulated.seed;
  return metadata;
}

void add_realtime_options(Arguments& command, RealtimeSettings& settings) {
  command.option("--priority", settings.priority, "Of real-time scheduling; 0: none is asked for")
      .between(0, 99)
      .shows_default();
  command.option("--cpu", settings.cpu, "Processor that the loop stays on; -1: any").between(-1, 4095);
}

Status make_output_folder(const std::string& folder) {
  std::error_code problem;
  std::filesystem::create_directories(folder, problem);
  if (problem || !std::filesystem::is_directory(folder, problem)) {
    return Error{
        ErrorCode::file_unwritable,
        fmt::format("cannot be made a folder: {}", problem ? problem.message() : "something else has that name"),
        folder,
        {},
        "a folder that can be written to (--out DIR)"};
  }
  return success();
}

std::string format_seconds(double seconds) {
  if (!std::isfinite(seconds)) return "-";
  if (seconds >= 1.0) return fmt::format("{:.3g} s", seconds);
  if (seconds >= 1e-3) return fmt::format("{:.3g} ms", seconds * 1e3);
  if (seconds >= 1e-6) return fmt::format("{:.3g} us", seconds * 1e6);
  return fmt::format("{:.0f} ns", seconds * 1e9);
}

std::string flag_list(const TickMetrics& ticks) {
  std::string list;
  for (std::size_t bit = 1; bit < ticks.flags.size(); ++bit) {
    if (ticks.flags[bit] > 0)
      list += fmt::format("{}{} ({} ticks)", list.empty() ? "" : ", ", flag_name(bit), ticks.flags[bit]);
  }
  return list.empty() ? "none" : list;
}

}  // namespace asperity::program
