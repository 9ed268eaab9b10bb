// asperity inspect: what a file is, what is wrong with it, and what can be felt of it on which device.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>

#include "apps/asperity/feature_facts.h"
#include "apps/asperity/feel.h"
#include "apps/asperity/inspect_trace.h"
#include "apps/asperity/relief_advice.h"
#include "apps/asperity/run.h"
#include "apps/asperity/scene_argument.h"
#include "asperity/field/brick/store.h"
#include "asperity/field/height/image.h"
#include "asperity/io/image_io.h"
#include "asperity/io/mesh_io.h"
#include "asperity/io/sparse_io.h"
#include "asperity/io/trace_file.h"
#include "asperity/io/volume_io.h"
#include "asperity/render/law_registry.h"

namespace asperity::program {
namespace {

namespace fs = std::filesystem;

struct InspectOptions {
  std::string file;
  SceneArgument scene;
  std::string report;     ///< page of a trace's last ticks; empty: none is written
  double friction = 0.2;  ///< of the smooth material of a map or of a scene's features
};

/// What inspecting found, in the order it is shown.
struct Findings {
  std::string kind;
  std::vector<ReportFact> facts;
  std::vector<std::string> problems;       ///< what is wrong with it
  std::vector<std::string> felt;           ///< what can be felt of it
  Json features = Json::array();           ///< of a scene: its fine features in numbers
  std::vector<ReliefAdvice> reliefs;       ///< whether they can be felt as they are
  std::vector<std::string> happened = {};  ///< of a trace, between its ticks
  std::vector<std::string> last = {};      ///< of a trace that a fault has left: its last ticks
  Json trace = Json::object();             ///< of a trace
  void fact(std::string name, std::string value) { facts.push_back({std::move(name), std::move(value)}); }
};

void mesh_facts(const TriangleMesh& mesh, Findings& found) {
  const MeshReport& r = mesh.report();
  found.fact("triangles", fmt::format("{}", r.triangles));
  found.fact("vertices", fmt::format("{} ({} merged at equal positions)", r.vertices, r.welded_vertices));
  found.fact("texture coordinates", mesh.has_uvs() ? "yes" : "no");
  found.fact("closed, oriented", fmt::format("{}, {}", r.closed() ? "yes" : "no", r.oriented() ? "yes" : "no"));
  found.fact("parts", fmt::format("{}", r.components));
  const auto problem = [&](std::size_t count, const char* what) {
    if (count > 0) found.problems.push_back(fmt::format("{} {}", count, what));
  };
  problem(r.dropped_degenerate, "triangles without area were left out");
  problem(r.dropped_duplicate, "triangles given twice were left out");
  problem(r.boundary_edges, "edges have one triangle only: the mesh is open and is touched from both sides");
  problem(r.nonmanifold_edges, "edges have three or more triangles");
  problem(r.misoriented_edges, "edges lie between triangles that face opposite ways");
  problem(r.nonmanifold_vertices, "vertices join more than one fan of triangles");
  constexpr double sliver = 100.0;
  if (r.worst_aspect > sliver)
    found.problems.push_back(fmt::format("the thinnest triangle is {:.0f} times as long as high", r.worst_aspect));
  for (const std::string& note : mesh.notes()) found.problems.push_back(note);
}

Result<Findings> inspect_trace(const std::string& file) {
  ASPERITY_TRY(TraceFindings trace, inspect_trace_file(file));
  Findings found{"trace", std::move(trace.facts), std::move(trace.problems), {}, Json::array(), {}};
  found.happened = std::move(trace.happened);
  found.last = std::move(trace.last);
  found.trace = std::move(trace.json);
  return found;
}

Json roughness_json(const Roughness& roughness) {
  return {{"r_a_m", roughness.average}, {"r_q_m", roughness.rms}, {"mean_slope", roughness.mean_slope}};
}

Json feature_json(const FeatureFact& fact) {
  Json json{{"surface", fact.surface},
            {"type", feature_name(fact.feature.spec().kind)},
            {"felt_as", scale_name(fact.felt_as)},
            {"wavelength_m", fact.feature.wavelength()},
            {"across", roughness_json(fact.across)},
            {"along", roughness_json(fact.along)},
            {"friction_proposed", {{"across", fact.friction_across}, {"along", fact.friction_along}}}};
  if (fact.felt) {
    const FeltWaves& felt = *fact.felt;
    json["under_the_stroke"] = {{"shortest_wave_m", felt.waves.shortest},
                                {"longest_wave_m", felt.waves.longest},
                                {"roughest_wave_m", felt.roughest_wave},
                                {"felt_roughness_of_shortest", felt.shortest},
                                {"felt_roughness_of_longest", felt.longest},
                                {"felt_roughness_of_roughest", felt.roughest},
                                {"tip_radius_m", felt_tip_radius}};
  }
  return json;
}

Findings scene_findings(const Experiment& experiment, double smooth) {
  Findings found{"scene", {}, {}, {}, Json::array(), {}};
  found.fact("name", experiment.name);
  for (const ReportFact& fact : setup_facts(experiment)) found.facts.push_back(fact);
  found.fact("duration", fmt::format("{:.3g} s, {} ticks", experiment.path.duration().count(),
                                     session_ticks(experiment.path.duration(), Seconds(1.0 / experiment.rate))));
  found.fact("memory", fmt::format("{:.2f} MB", static_cast<double>(experiment.scene.memory_bytes()) * 1e-6));
  for (const Instance& instance : experiment.scene.instances()) {
    found.fact(fmt::format("of it for law \"{}\" on \"{}\"", law_name(instance.law), instance.name),
               fmt::format("{} bytes", law_bytes(instance)));
  }
  for (const std::string& note : experiment.notes) found.problems.push_back(note);
  for (const Instance& instance : experiment.scene.instances()) {
    for (std::string& line : feel_of(experiment, instance))
      found.felt.push_back(fmt::format("{}: {}", instance.name, line));
  }
  const std::vector<FeatureFact> features = feature_facts(experiment, smooth);
  for (const FeatureFact& fact : features) found.features.push_back(feature_json(fact));
  for (std::string& line : feature_lines(features, smooth)) found.felt.push_back(std::move(line));
  found.reliefs = advise_on(experiment);
  return found;
}

Result<Findings> inspect_scene(const InspectOptions& options, const Progress& progress) {
  ASPERITY_TRY(const Experiment experiment, load_scene(options.scene, progress));
  return scene_findings(experiment, options.friction);
}

/// What the file is as a scene of its own.
void add_scene_facts(const Findings& scene, Findings& found) {
  for (const ReportFact& fact : scene.facts) {
    if (fact.name.starts_with("surface") || fact.name == "device")
      found.facts.push_back({"as a scene: " + fact.name, fact.value});
  }
}

/// A mesh alone: the file as it is, then what can be felt of it with the defaults.
Result<Findings> inspect_mesh(const InspectOptions& options, const Progress& progress) {
  ASPERITY_TRY(MeshSource source, read_mesh(options.file));
  Findings found{"mesh", {}, {}, {}, Json::array(), {}};
  Result<TriangleMesh> mesh = TriangleMesh::build(std::move(source));
  if (!mesh) return std::move(mesh).error().in_file(options.file);
  const Vec3 extent = mesh->bounds().extent();
  found.fact("size", fmt::format("{:.4g} x {:.4g} x {:.4g} of the file's unit", extent.x(), extent.y(), extent.z()));
  mesh_facts(*mesh, found);
  ASPERITY_TRY(const Findings scene, inspect_scene(options, progress));
  add_scene_facts(scene, found);
  for (const std::string& note : scene.problems) {
    if (note.starts_with("implicit")) found.problems.push_back(note);
  }
  found.felt = scene.felt;
  found.reliefs = scene.reliefs;
  return found;
}

/// Roughness of a relief one repeat of which has the size `tile` (m), and the friction it would make if it were felt as
/// nothing else. `texel`: its finest detail (m).
void topography_facts(const HeightMap& heights, const Vec2& tile, double texel, const DeviceProfile& device,
                      double smooth, Findings& found) {
  const SurfaceRoughness roughness = surface_roughness(heights, tile);
  found.fact("roughness along the width", roughness_text(roughness.along_s));
  found.fact("roughness along the height", roughness_text(roughness.along_t));
  const FrictionProposal proposal = propose_friction(roughness, smooth);
  const double along_s = proposal.rough_along_s ? proposal.across : proposal.along;
  const double along_t = proposal.rough_along_s ? proposal.along : proposal.across;
  found.fact("friction proposed", fmt::format("{:.3g} along the width, {:.3g} along the height", along_s, along_t));
  std::string reason = proposal_reason(smooth);
  const double shortest = 4.0 * texel;
  const FeatureScale scale = scale_of(shortest, feature_scales(device.position_resolution));
  if (scale != FeatureScale::friction) {
    reason += fmt::format("; waves of {} and more are felt as {} themselves, so it holds where the relief is left out",
                          format_length(shortest), scale_name(scale));
  }
  found.felt.push_back(std::move(reason));
}

void laid_facts(const Experiment& laid, double smooth, Findings& found) {
  const auto* relief = std::get_if<std::shared_ptr<const ReliefSurface>>(&laid.scene.instances().front().surface);
  if (relief == nullptr) return;
  const Coat& coat = (*relief)->coat();
  topography_facts(coat.maps().heights(), coat.maps().tile(), coat.texel_size(), laid.device, smooth, found);
}

/// A measured map at its own size.
struct OwnSize {
  HeightMap heights;
  Vec2 tile;          ///< m
  double low = 0.0;   ///< m, of black
  double high = 0.0;  ///< m, of white
};
/// By what the JSON file beside it says, which reading a scene has checked; nothing where that says no size.
std::optional<OwnSize> own_size(const std::string& file, const Image& image, Channel channel) {
  std::ifstream stream(fs::path(file).replace_extension(".json"), std::ios::binary);
  const Json sidecar = Json::parse(stream, nullptr, false);
  const auto number = [](const Json& json) { return json.is_number() ? json.get<double>() : std::nan(""); };
  const auto member = [&](const char* key) { return sidecar.contains(key) ? number(sidecar[key]) : std::nan(""); };
  if (!sidecar.is_object() || !sidecar.contains("pixel_size_m") || !sidecar["pixel_size_m"].is_array()) return {};
  const Json& pixel = sidecar["pixel_size_m"];
  const double low = member("height_min_m");
  const double high = member("height_max_m");
  if (pixel.size() != 2 || !std::isfinite(high - low) || high < low) return {};
  const Vec2 tile(number(pixel[0]) * image.width, number(pixel[1]) * image.height);
  Result<HeightMap> heights =
      HeightMap::build(image, channel, {high - low, low, false, Wrap::repeat, Reconstruction::quadratic_bspline});
  if (!heights || !tile.allFinite() || !(tile.minCoeff() > 0.0)) return {};
  return OwnSize{std::move(*heights), tile, low, high};
}

/// A map as large as it says it is: what cannot be laid on the trial sheet. `refusal`: why it cannot.
Status own_size_facts(const InspectOptions& options, const Image& image, Channel channel, Error refusal,
                      Findings& found) {
  // Heights and size of the command line are asked for: what they do not fit is an error.
  if (!options.scene.height.empty() || !options.scene.tile.empty()) return refusal;
  const std::optional<OwnSize> own = own_size(options.file, image, channel);
  SceneArgument bare = options.scene;
  bare.scene = "M_a-H_0";
  const Result<Experiment> sheet = load_scene(bare, {});
  if (!own || !sheet) return refusal;
  const HeightMap& heights = own->heights;
  found.fact("size as it is",
             fmt::format("{} x {}, {} to {} high", format_length(own->tile.x()), format_length(own->tile.y()),
                         format_length(own->low), format_length(own->high)));
  topography_facts(heights, own->tile, own->tile.x() / heights.width(), sheet->device, options.friction, found);
  const Box bounds = surface_bounds(sheet->scene.instances().front().surface);
  const double highest = std::max(std::abs(heights.lowest()), std::abs(heights.highest()));
  // Rounded down, so that what is printed is accepted.
  const double most = 0.5 * bounds.diagonal() / highest;
  const double digits = std::pow(10.0, std::floor(std::log10(most)) - 1.0);
  found.problems.push_back(fmt::format(
      "it is too large for the trial sheet, so what can be felt of it there is not told: it {}; accepted: {}. A coat "
      "with \"magnify\": {:.2g} or less, which scales heights and size alike, can be laid on it",
      refusal.what, refusal.accepted, std::floor(most / digits) * digits));
  const double magnify = std::floor(most / digits) * digits;
  const double stiffness = sheet->scene.instances().front().material.stiffness;
  found.reliefs.push_back(
      advise_on(fmt::format("{}, magnified {:.2g} times", fs::path(options.file).stem().string(), magnify),
                scaled(measure_shape(heights, own->tile), magnify, magnify), touch_conditions(*sheet, stiffness)));
  return success();
}

/// Whether a map was refused for its heights.
bool too_high(const Error& error) {
  return error.code == ErrorCode::bad_value &&
         (error.place.ends_with("coat.height_map") || error.place.ends_with("coat.height"));
}

bool is_exr_file(const std::string& file) {
  std::string extension = fs::path(file).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == ".exr";
}

/// What an OpenEXR image says of itself.
Status float_facts(const InspectOptions& options, Findings& found) {
  ASPERITY_TRY(const FloatImage image, read_float_image(options.file));
  found.fact("pixels", fmt::format("{} x {}, floats", image.width, image.height));
  found.fact("heights", fmt::format("{} channel: {}", image.channel, image.reason));
  found.fact("values used", fmt::format("{:.6g} to {:.6g}: metres, unless --height says what they span",
                                        static_cast<double>(image.lowest), static_cast<double>(image.highest)));
  if (image.lowest == image.highest) found.problems.push_back("every pixel is equal: there is no relief in it");
  return success();
}

Result<Findings> inspect_laid(const InspectOptions& options, Findings found, const Image* image, ChannelChoice choice,
                              const Progress& progress);

/// A map alone, laid on a sheet so that what can be felt of it has a size.
Result<Findings> inspect_image(const InspectOptions& options, const Progress& progress) {
  if (is_exr_file(options.file)) {
    Findings found{"map", {}, {}, {}, Json::array(), {}};
    ASPERITY_CHECK(float_facts(options, found));
    return inspect_laid(options, std::move(found), nullptr, {}, progress);
  }
  ASPERITY_TRY(const Image image, read_image(options.file));
  Findings found{"map", {}, {}, {}, Json::array(), {}};
  found.fact("pixels", fmt::format("{} x {}", image.width, image.height));
  found.fact("channels", fmt::format("{} of {} bits", image.channels, image.bits));
  Result<ChannelChoice> choice = choose_channel(image, Channel::automatic);
  if (!choice) return std::move(choice).error().in_file(options.file);
  found.fact("heights", fmt::format("{} channel: {}", to_string(choice->channel), choice->reason));
  if (image.bits == 8)
    found.problems.push_back("8 bits: heights come in 255 steps, which can be felt as such on a tall relief");
  const std::vector<float> values = extract_channel(image, choice->channel);
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  found.fact("values used",
             fmt::format("{:.3f} to {:.3f} of white", static_cast<double>(*low), static_cast<double>(*high)));
  if (*low == *high) found.problems.push_back("every pixel is equal: there is no relief in it");
  return inspect_laid(options, std::move(found), &image, *choice, progress);
}

/// The map on a sheet, if it is not too high for one.
Result<Findings> inspect_laid(const InspectOptions& options, Findings found, const Image* image, ChannelChoice choice,
                              const Progress& progress) {
  InspectOptions laid = options;
  laid.scene.scene = "M_a-H_0";
  laid.scene.relief = options.file;
  laid.scene.mapping = "triplanar";
  Result<Experiment> loaded = load_scene(laid.scene, progress);
  if (!loaded) {
    if (!too_high(loaded.error())) return std::move(loaded).error();
    if (image == nullptr) {
      found.problems.push_back("in metres it is higher than a sheet to try it on is wide: --height says what it spans");
      return found;
    }
    ASPERITY_CHECK(own_size_facts(options, *image, choice.channel, std::move(loaded).error(), found));
    return found;
  }
  const Experiment& experiment = *loaded;
  const Findings scene = scene_findings(experiment, options.friction);
  for (const std::string& note : scene.problems) {
    if (note.starts_with("coat:")) found.problems.push_back(note);
  }
  for (const ReportFact& fact : scene.facts) {
    if (fact.name.starts_with("surface")) found.fact("laid on a sheet", fact.value);
  }
  found.felt = scene.felt;
  found.reliefs = scene.reliefs;
  for (ReliefAdvice& advice : found.reliefs) {
    advice.surface = fs::path(options.file).filename().string();
    advice.base.reset();  // the sheet is for trial
  }
  laid_facts(experiment, options.friction, found);
  return found;
}

void axis_facts(const GridAxes& axes, const char* unit, Findings& found) {
  found.fact("size", fmt::format("{} x {} x {} samples", axes[0].size(), axes[1].size(), axes[2].size()));
  for (std::size_t a = 0; a < 3; ++a) {
    const GridAxis& axis = axes[a];
    double widest = 0.0;
    for (std::uint32_t i = 0; i < axis.cells(); ++i) widest = std::max(widest, axis.width(i));
    const std::string cells = axis.is_uniform()
                                  ? fmt::format("even, cells of {:.4g}", widest)
                                  : fmt::format("stretched, cells of {:.4g} to {:.4g}", axis.narrowest(), widest);
    found.fact(fmt::format("axis {}", "xyz"[a]),
               fmt::format("{:.6g} to {:.6g} {}, {}", axis.front(), axis.back(), unit, cells));
  }
}

void array_facts(const VolumeSource& source, Findings& found) {
  for (const VolumeArray& array : source.arrays) {
    found.fact(fmt::format("array \"{}\"", array.name),
               fmt::format("{}{} on {}s, {:.6g} to {:.6g}{}",
                           array.components > 1 ? fmt::format("{} times ", array.components) : "", array.type,
                           to_string(array.association), array.lowest, array.highest,
                           array.unknown > 0 ? fmt::format(", {} values are not numbers", array.unknown) : ""));
  }
}

/// A volume whose samples are read, then what can be felt of it with the defaults.
Result<Findings> inspect_volume(const InspectOptions& options, const Progress& progress) {
  ASPERITY_TRY(const VolumeSource source, read_volume(options.file, {}, progress));
  Findings found{"volume", {}, {}, {}, Json::array(), {}};
  axis_facts(source.axes(), "of the file's unit", found);
  array_facts(source, found);
  found.fact("looked at", fmt::format("\"{}\"{}", source.array, source.cell_data ? ", in the cells' middles" : ""));
  for (const std::string& note : source.notes) found.problems.push_back(note);
  const auto* grid = std::get_if<ScalarGrid>(&source.data);
  if (grid == nullptr) {
    found.problems.push_back("it holds vectors: a scene chooses a component, or what to derive from them");
    return found;
  }
  found.fact("range", fmt::format("{:.6g} to {:.6g}", grid->lowest(), grid->highest()));
  if (!(grid->highest() > grid->lowest())) {
    found.problems.push_back("every sample is equal: there is no surface in it");
    return found;
  }
  found.fact("suggested threshold", fmt::format("{:.6g}", otsu_threshold(*grid)));
  ASPERITY_TRY(const Findings scene, inspect_scene(options, progress));
  add_scene_facts(scene, found);
  found.felt = scene.felt;
  found.reliefs = scene.reliefs;
  return found;
}

/// A .vdb file as it is, then what can be felt of it with the defaults.
Result<Findings> inspect_sparse(const InspectOptions& options, const Progress& progress) {
  ASPERITY_TRY(SparseFile file, read_sparse(options.file, {}, progress));
  Findings found{"level set", {}, {}, {}, Json::array(), {}};
  for (const SparseGridEntry& entry : file.entries) {
    found.fact(fmt::format("grid \"{}\"", entry.name),
               fmt::format("{}, {}, {} points, voxel {:.6g}", entry.type, entry.grid_class, entry.points, entry.voxel));
  }
  found.fact("looked at", fmt::format("\"{}\"", file.grid));
  found.fact("voxel", fmt::format("{:.6g} of the file's unit", file.source.voxel));
  found.fact("band", fmt::format("{:.6g} outside to {:.6g} inside", file.source.outside, -file.source.inside));
  found.fact("closest faces", file.has_faces ? fmt::format("yes, of {} triangles", file.mesh_faces) : "no");
  found.fact("materials",
             file.channels.empty() ? std::string("none") : fmt::format("{}", fmt::join(file.channels, ", ")));
  for (const std::string& note : file.notes) found.problems.push_back(note);
  ASPERITY_TRY(const Findings scene, inspect_scene(options, progress));
  add_scene_facts(scene, found);
  found.felt = scene.felt;
  found.reliefs = scene.reliefs;
  return found;
}

Result<Findings> inspect_bricks(const std::string& file) {
  BrickSettings settings;
  settings.stream = false;
  ASPERITY_TRY(const std::unique_ptr<BrickStore> store, BrickStore::open(file, settings));
  Findings found{"bricked volume", {}, {}, {}, Json::array(), {}};
  axis_facts(store->axes(0), "m", found);
  found.fact("array", fmt::format("\"{}\", {}, {:.6g} to {:.6g}", store->name(), to_string(store->type()),
                                  store->lowest(), store->highest()));
  found.fact("levels", fmt::format("{}", store->levels()));
  found.fact("file", fmt::format("{:.3f} MB", static_cast<double>(store->file_bytes()) * 1e-6));
  return found;
}

bool looks_like_image(const std::string& file) {
  std::string extension = fs::path(file).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == ".png" || extension == ".jpg" || extension == ".jpeg" || extension == ".exr";
}

Result<Findings> inspect_any(InspectOptions options, const Progress& progress) {
  options.scene.scene = options.file;
  std::error_code ignored;
  if (fs::exists(options.file, ignored) && is_bricked_path(options.file)) return inspect_bricks(options.file);
  if (fs::exists(options.file, ignored) && is_sparse_path(options.file)) return inspect_sparse(options, progress);
  if (fs::exists(options.file, ignored) && is_volume_path(options.file)) return inspect_volume(options, progress);
  if (fs::is_regular_file(options.file, ignored)) {
    if (is_trace_file(options.file)) return inspect_trace(options.file);
    if (looks_like_image(options.file)) return inspect_image(options, progress);
    ASPERITY_TRY(const SceneText scene, find_scene(options.file));
    // A mesh becomes a scene made on the spot; a scene file stands as it is.
    const bool mesh = fs::path(options.file).extension() != ".json" && scene.folder == ".";
    if (mesh) return inspect_mesh(options, progress);
  }
  return inspect_scene(options, progress);
}

void print_findings(const std::string& file, const Findings& found) {
  std::cout << fmt::format("{}: a {}\n", file, found.kind);
  for (const ReportFact& fact : found.facts) std::cout << fmt::format("  {}: {}\n", fact.name, fact.value);
  if (!found.last.empty()) std::cout << "The last ticks:\n";
  for (const std::string& line : found.last) std::cout << "  " << line << '\n';
  if (!found.happened.empty()) std::cout << "What happened:\n";
  for (const std::string& line : found.happened) std::cout << "  " << line << '\n';
  if (!found.problems.empty()) std::cout << "To know:\n";
  for (const std::string& problem : found.problems) std::cout << "  - " << problem << '\n';
  if (!found.felt.empty()) std::cout << "What can be felt:\n";
  for (const std::string& line : found.felt) std::cout << "  - " << line << '\n';
  for (const ReliefAdvice& advice : found.reliefs) {
    const TouchConditions& t = advice.conditions;
    std::cout << fmt::format("The relief of {} on {}, pressed with {:.3g} N at {:.3g} mm/s:\n", advice.surface,
                             t.device.name, t.force, t.speed * 1e3);
    for (const std::string& line : advice_lines(advice)) std::cout << "  - " << line << '\n';
    std::cout << "On every device, at this stiffness or its own where that is less:\n" << device_table(advice);
  }
}

Result<int> inspect(const InspectOptions& options, const Console& console) {
  ASPERITY_TRY(const Findings found, inspect_any(options, console.progress()));
  if (!options.report.empty()) {
    if (found.kind != "trace")
      return bad_value("writes a page of a trace, and this is a " + found.kind, "--report", "a trace")
          .in_file(options.file);
    ASPERITY_CHECK(write_trace_report(options.file, options.report, console));
  }
  if (console.json) {
    Json facts = Json::object();
    for (const ReportFact& fact : found.facts) facts[fact.name] = fact.value;
    Json document{{"file", options.file},
                  {"kind", found.kind},
                  {"facts", facts},
                  {"to_know", found.problems},
                  {"felt", found.felt}};
    for (const auto& [key, value] : found.trace.items()) document[key] = value;
    if (!found.features.empty()) document["features"] = found.features;
    for (const ReliefAdvice& advice : found.reliefs) document["reliefs"].push_back(advice_json(advice));
    console.print(document);
  } else {
    print_findings(options.file, found);
  }
  return exit_success;
}

}  // namespace

void add_inspect(Arguments& program, Console& console, Action& action) {
  Arguments command = program.command(
      "inspect", "Say what a mesh, map, volume, scene or trace is, what is wrong with it, and what can be felt of it");
  auto options = std::make_shared<InspectOptions>();
  command
      .option("FILE", options->file,
              "A mesh, a map (PNG, JPEG, EXR), a volume, a level set (.vdb), a scene, a built-in scene or a trace")
      .required();
  command.flag("--implicit{256}", options->scene.implicit,
               "Of a mesh: judge the potential made from it (--implicit=128, --implicit=0.4mm)");
  command.option("--device", options->scene.device, "Device to judge by: phantom-desktop, omega.7, touch, ...");
  command.option("--hand", options->scene.hand, "Hand to judge by: default, light, firm, paper");
  command.option("--rate", options->scene.rate, "Force updates a second: 1kHz");
  command.option("--height", options->scene.height, "Of a map: relief from black to white, 2mm");
  command.option("--tile", options->scene.tile, "Of a map: width of one repeat, 20mm");
  command
      .option("--friction", options->friction,
              "Of a map, or of a scene's features: coefficient of friction of the material where it is smooth")
      .between(0.0, 2.0)
      .shows_default();
  command.option("--stiffness", options->scene.stiffness, "To judge by: 1000, 0.5N/mm");
  command.option("--speed", options->scene.speed, "Of the hand: 20mm/s");
  command.option("--force", options->scene.force, "Of the hand: 1N");
  command.option("--report", options->report, "Of a trace: write a page with plots of its last two seconds here");
  add_console_options(command, console);
  command.closing_words(
      "Of a relief: whether it can be felt as it is, criterion by criterion (docs/methods/renderability.md), the "
      "nearest "
      "changes with which it can, and which devices render it.\n"
      "Examples:\n"
      "  asperity inspect bunny.obj\n"
      "  asperity inspect M_b-H_1 --device phantom-desktop --force 0.5N --speed 10mm/s\n"
      "  asperity inspect rock.png --height 1mm --tile 30mm --device touch\n"
      "  asperity inspect kitchen.vtk\n"
      "  asperity inspect out/icosphere-relief/trace.asptrace --json\n"
      "  asperity inspect fault.asptrace --report fault.html");
  command.when_called(
      [options, &console, &action] { action = [options, &console] { return inspect(*options, console); }; });
}

}  // namespace asperity::program
