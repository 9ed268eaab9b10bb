// asperity convert: a volume into a bricked file, which is touched without being held in memory; a mesh into a level
// set; a mesh or a scene into glTF.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <vector>

#include "apps/asperity/command.h"
#include "apps/asperity/convert_gltf.h"
#include "apps/asperity/convert_mesh.h"
#include "asperity/core/units.h"
#include "asperity/field/brick/file.h"
#include "asperity/field/volume/derived_fields.h"
#include "asperity/field/volume/generators.h"
#include "asperity/io/gltf_material.h"
#include "asperity/io/sparse_io.h"
#include "asperity/io/volume_io.h"

namespace asperity::program {
namespace {

struct ConvertOptions {
  std::vector<std::string> files;
  std::string array;
  std::string component;
  std::string derive;
  std::string time;
  std::string units;
  std::string fit;
  std::string generator;
  std::string size;
  MeshConversion mesh;
  /// What is said of volumes alone.
  [[nodiscard]] bool of_volumes() const {
    return !(array + component + derive + time + units + fit + generator + size).empty();
  }
};

using Samples = std::variant<ScalarGrid, VectorGrid>;

Error refused(const char* option, std::string why, std::string accepted) {
  return {ErrorCode::bad_value, std::move(why), "", option, std::move(accepted)};
}

/// Metres that a length of 1 in the file is.
Result<double> unit_of(const std::string& units) {
  if (units.empty()) return 1.0;
  Result<double> metres = parse_quantity("1 " + units, Dimension::length);
  if (metres && *metres > 0.0) return *metres;
  return refused("--units", fmt::format("\"{}\" is no unit of length", units), accepted_units(Dimension::length));
}

/// How the axes are scaled and moved: to metres, then, if asked, so that the largest side is `fit`, around the origin.
struct Placing {
  double scale = 1.0;
  Vec3 offset = Vec3::Zero();
  bool moved = false;

  static Result<Placing> of(const GridAxes& axes, const ConvertOptions& options) {
    Placing placing;
    ASPERITY_TRY(placing.scale, unit_of(options.units));
    Vec3 lower;
    Vec3 upper;
    for (int a = 0; a < 3; ++a) {
      lower[a] = axes[static_cast<std::size_t>(a)].front();
      upper[a] = axes[static_cast<std::size_t>(a)].back();
    }
    if (!options.fit.empty()) {
      Result<double> side = parse_quantity(options.fit, Dimension::length);
      if (!side || !(*side > 0.0))
        return refused("--fit", fmt::format("\"{}\" is no length", options.fit), "a length above 0: 20cm");
      placing.scale = *side / (upper - lower).maxCoeff();
    }
    // As in scenes: built-in volumes and fitted ones lie around the origin.
    if (!options.fit.empty() || !options.generator.empty()) placing.offset = -0.5 * placing.scale * (lower + upper);
    placing.moved = placing.scale != 1.0 || placing.offset != Vec3::Zero();
    return placing;
  }
};

/// One number at each sample.
Result<ScalarGrid> scalars_of(Samples samples, const ConvertOptions& options, const Progress& progress) {
  std::optional<DerivedField> field;
  if (!options.derive.empty()) {
    ASPERITY_TRY(field, parse_derived_field(options.derive));
  }
  if (auto* grid = std::get_if<ScalarGrid>(&samples)) {
    if (!options.component.empty())
      return refused("--component", fmt::format("\"{}\" holds scalars", grid->name()), "no component");
    return field ? derive(*grid, *field, progress) : std::move(*grid);
  }
  const VectorGrid& vectors = *std::get_if<VectorGrid>(&samples);
  if (field) return derive(vectors, *field, progress);
  if (options.component.empty()) {
    return refused("--derive", fmt::format("\"{}\" holds vectors, and a bricked file one number each", vectors.name),
                   "--derive vorticity_magnitude (or q_criterion, helicity, gradient_magnitude), or --component "
                   "magnitude (or x, y, z)");
  }
  ASPERITY_TRY(const VectorPart part, parse_vector_part(options.component));
  return part_of(vectors, part);
}

Result<BrickFileSummary> write_samples(Samples samples, const ConvertOptions& options, const Progress& progress) {
  const GridAxes& axes = samples.index() == 0 ? std::get_if<0>(&samples)->axes() : std::get_if<1>(&samples)->axes;
  ASPERITY_TRY(const Placing placing, Placing::of(axes, options));
  // Scaled before slopes are taken, so that those are by the metre.
  if (placing.moved) {
    if (auto* grid = std::get_if<ScalarGrid>(&samples)) {
      samples = std::move(*grid).placed(placing.scale, placing.offset);
    } else {
      auto& vectors = *std::get_if<VectorGrid>(&samples);
      for (std::size_t a = 0; a < 3; ++a)
        vectors.axes[a] = vectors.axes[a].placed(placing.scale, placing.offset[static_cast<Eigen::Index>(a)]);
    }
  }
  ASPERITY_TRY(const ScalarGrid grid, scalars_of(std::move(samples), options, progress));
  return write_brick_file(options.files.back(), grid, progress);
}

Result<BrickFileSummary> convert_file(const ConvertOptions& options, const Console& console) {
  VolumeRequest request;
  request.array = options.array;
  request.time = options.time;
  request.vectors = !options.component.empty() || (!options.derive.empty() && options.derive != "gradient_magnitude");
  ASPERITY_TRY(VolumeSource source, read_volume(options.files.front(), request, console.progress()));
  for (const std::string& note : source.notes) console.note(note);
  Result<BrickFileSummary> written = write_samples(std::move(source.data), options, console.progress());
  if (!written && written.error().code != ErrorCode::file_unwritable)
    return std::move(written).error().in_file(options.files.front());
  return written;
}

/// "1024", or "259x127x128".
Result<std::array<std::uint32_t, 3>> read_size(const std::string& text) {
  std::array<std::uint32_t, 3> size{};
  std::size_t counts = 0;
  std::size_t at = 0;
  while (counts < 3 && at <= text.size()) {
    const std::size_t end = std::min(text.find('x', at), text.size());
    const char* last = text.data() + end;
    const auto [stop, problem] = std::from_chars(text.data() + at, last, size[counts]);
    if (problem != std::errc() || stop != last) break;
    ++counts;
    at = end + 1;
  }
  if (at == text.size() + 1 && counts == 1) return std::array{size[0], size[0], size[0]};
  if (at == text.size() + 1 && counts == 3) return size;
  return refused("--size", fmt::format("\"{}\" is no size", text), "1024, or three counts: 259x127x128");
}

Result<VolumeGenerator> generator_of(const ConvertOptions& options) {
  VolumeGenerator generator;
  ASPERITY_TRY(generator.kind, parse_volume_kind(options.generator));
  if (!options.size.empty()) {
    ASPERITY_TRY(generator.size, read_size(options.size));
  }
  return generator;
}

/// Made slab by slab where the kind allows it: a volume of any size.
Result<BrickFileSummary> convert_generator(const ConvertOptions& options, const Console& console) {
  ASPERITY_TRY(const VolumeGenerator generator, generator_of(options));
  if (generator.kind == VolumeKind::cavity || !options.derive.empty()) {
    ASPERITY_TRY(Samples samples, generate_volume(generator, console.progress()));
    return write_samples(std::move(samples), options, console.progress());
  }
  if (!options.component.empty())
    return refused("--component", fmt::format("\"{}\" is of scalars", options.generator), "no component");
  ASPERITY_TRY(const VolumeFunction function, VolumeFunction::build(generator));
  ASPERITY_TRY(const GridAxes axes, volume_axes(generator));
  ASPERITY_TRY(const Placing placing, Placing::of(axes, options));
  GridAxes placed;
  for (std::size_t a = 0; a < 3; ++a)
    placed[a] = axes[a].placed(placing.scale, placing.offset[static_cast<Eigen::Index>(a)]);
  const auto slab = [&](std::uint32_t first, std::uint32_t last, SampleArray& out) {
    function.slab(axes, first, last, std::get<std::vector<float>>(out));
    return success();
  };
  return write_brick_file(options.files.back(), placed, SampleType::float32, options.generator, slab,
                          console.progress());
}

Status check(const ConvertOptions& options) {
  if (options.files.size() != (options.generator.empty() ? 2U : 1U)) {
    return refused(
        "FILES", fmt::format("{} named", options.files.size()),
        options.generator.empty() ? "the volume, then the file to write" : "with --generator only the file to write");
  }
  if (!is_bricked_path(options.files.back()))
    return refused("FILES", fmt::format("\"{}\" is no bricked file", options.files.back()), "a name with .aspvol");
  if (options.generator.empty())
    return options.size.empty() ? success() : refused("--size", "has nothing to say here", "--generator");
  if (!options.array.empty() || !options.time.empty())
    return refused("--generator", "makes one array at one time", "neither --array nor --time");
  return success();
}

Result<int> convert(const ConvertOptions& options, const Console& console) {
  if (options.files.size() == 2 && is_sparse_path(options.files.back())) {
    if (options.of_volumes())
      return refused("FILES", "a mesh is made into a level set", "the options of meshes: --resolution, --voxel, ...");
    return convert_mesh_file(options.files.front(), options.files.back(), options.mesh, console);
  }
  if (options.files.size() == 2 && is_gltf_path(options.files.back())) {
    if (options.of_volumes() || options.mesh.any())
      return refused("FILES", "a mesh or a scene is written as glTF as it is", "no further options");
    return convert_to_gltf(options.files.front(), options.files.back(), console);
  }
  if (options.mesh.any())
    return refused("FILES", fmt::format("\"{}\" is no level set", options.files.back()),
                   "a name with .vdb for a mesh, without --resolution and the like for a volume");
  ASPERITY_CHECK(check(options));
  const auto begin = std::chrono::steady_clock::now();
  ASPERITY_TRY(const BrickFileSummary summary,
               options.generator.empty() ? convert_file(options, console) : convert_generator(options, console));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const std::string& file = options.files.back();
  if (console.json) {
    console.print(Json{{"file", file},
                       {"bytes", summary.file_bytes},
                       {"levels", summary.levels},
                       {"bricks", summary.bricks},
                       {"lowest", summary.lowest},
                       {"highest", summary.highest},
                       {"unknown", summary.unknown},
                       {"seconds", seconds}});
    return exit_success;
  }
  std::cout << fmt::format("{}: {:.1f} MB, {} levels, {} bricks, values {:.6g} to {:.6g}, written in {:.1f} s\n", file,
                           static_cast<double>(summary.file_bytes) * 1e-6, summary.levels, summary.bricks,
                           summary.lowest, summary.highest, seconds);
  return exit_success;
}

}  // namespace

void add_convert(Arguments& program, Console& console, Action& action) {
  Arguments command =
      program.command("convert",
                      "Write a volume as a bricked file (.aspvol), which is touched without being held in "
                      "memory; a mesh as a level set (.vdb); or a mesh or a scene as glTF (.glb, .gltf)");
  auto options = std::make_shared<ConvertOptions>();
  command
      .option(
          "FILES", options->files,
          "The volume (.vtk, .vti, .vtr, .nrrd, .json sidecar, ...) and the .aspvol file to write; with "
          "--generator only the latter. Or a mesh and the .vdb file to write; or a mesh or scene and the .glb or .gltf")
      .required()
      .expected(1, 2);
  command.option("--array", options->array, "Which array of the volume");
  command.option("--component", options->component, "Of vectors: magnitude, x, y or z");
  command.option("--derive", options->derive,
                 "Of a velocity: vorticity_magnitude, q_criterion, helicity; of any array: gradient_magnitude");
  command.option("--time", options->time, "Of an OpenFOAM case: which step");
  command.option("--units", options->units, "The file's unit of length: mm, cm, ... (m)");
  command.option("--fit", options->fit, "Scale so that the largest side is this long: 20cm");
  command.option("--generator", options->generator, "A built-in volume: sphere, shells, ramp, waves, gyroid, cavity");
  command.option("--size", options->size,
                 "Of a built-in volume: nodes along all axes, or along each: 1024, 259x127x128");
  MeshConversion& mesh = options->mesh;
  command.option("--resolution", mesh.resolution, "Of a mesh: voxels along its longest side (256)").group("Mesh");
  command.option("--voxel", mesh.voxel, "Of a mesh: the voxel, in its file's unit").group("Mesh");
  command.option("--budget", mesh.budget, "Of a mesh: the finest voxel that takes at most this: 64MB").group("Mesh");
  command.option("--band-outside", mesh.band_outside, "How far out distances are stored (3 voxels)").group("Mesh");
  command.option("--band-inside", mesh.band_inside, "How far in, or all (a tenth of the longest side)").group("Mesh");
  command.option("--inside", mesh.inside, "What is inside: automatic, flood, winding, shell").group("Mesh");
  command.option("--shell-thickness", mesh.shell_thickness, "Of the shell around open sheets (2 voxels)").group("Mesh");
  add_console_options(command, console);
  command.closing_words(
      "Volumes are read whole into memory; built-in ones are written slab by slab, whatever their size.\n"
      "Examples:\n"
      "  asperity convert flow.vtr vortices.aspvol --array velocity --derive q_criterion --units mm\n"
      "  asperity convert scan.json scan.aspvol --fit 15cm\n"
      "  asperity convert bunny.obj bunny.vdb --resolution 512\n"
      "  asperity convert scene.json relief.glb\n"
      "  asperity convert --generator sphere --size 1024 sphere.aspvol");
  command.when_called(
      [options, &console, &action] { action = [options, &console] { return convert(*options, console); }; });
}

}  // namespace asperity::program
