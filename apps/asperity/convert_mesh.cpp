#include "apps/asperity/convert_mesh.h"

#include <fmt/format.h>

#include <charconv>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iostream>

#include "asperity/core/units.h"
#include "asperity/field/conversion/mesh_conversion.h"
#include "asperity/io/mesh_io.h"
#include "asperity/io/sparse_io.h"

namespace asperity::program {
namespace {

Error refused(const char* option, const std::string& given, const char* accepted) {
  return {ErrorCode::bad_value, fmt::format("\"{}\" is not that", given), "", option, accepted};
}

/// A length in the file's unit; 0 where nothing is given.
Result<double> length(const char* option, const std::string& text) {
  if (text.empty()) return 0.0;
  double value = 0.0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (problem != std::errc() || end != text.data() + text.size() || !(value > 0.0) || !std::isfinite(value))
    return refused(option, text, "a plain number above 0: it is in the mesh file's own unit");
  return value;
}

Result<std::size_t> bytes(const std::string& text) {
  if (text.empty()) return std::size_t{0};
  const std::size_t end = text.find_first_not_of("0123456789.");
  const Result<double> number = parse_quantity(text.substr(0, end), Dimension::ratio);
  const std::size_t letters = end == std::string::npos ? end : text.find_first_not_of(' ', end);
  const std::string unit = letters == std::string::npos ? "" : text.substr(letters);
  const double factor = unit.empty() || unit == "B" ? 1.0
                        : unit == "kB"              ? 1e3
                        : unit == "MB"              ? 1e6
                        : unit == "GB"              ? 1e9
                                                    : 0.0;
  if (!number || !(*number * factor >= 1e4 && *number * factor <= 1e12))
    return refused("--budget", text, "a size from 10 kB on: 64MB");
  return static_cast<std::size_t>(*number * factor);
}

Result<ConversionSettings> settings_of(const MeshConversion& how) {
  ConversionSettings settings;
  ASPERITY_TRY(settings.voxel, length("--voxel", how.voxel));
  ASPERITY_TRY(settings.budget_bytes, bytes(how.budget));
  if (!how.resolution.empty()) {
    const char* last = how.resolution.data() + how.resolution.size();
    const auto [end, problem] = std::from_chars(how.resolution.data(), last, settings.resolution);
    if (problem != std::errc() || end != last) return refused("--resolution", how.resolution, "8 to 4096");
  }
  ASPERITY_TRY(settings.band_outside, length("--band-outside", how.band_outside));
  if (how.band_inside == "all") {
    settings.band_inside = infinity;
  } else {
    ASPERITY_TRY(settings.band_inside, length("--band-inside", how.band_inside));
  }
  if (!how.inside.empty()) {
    Result<InsideRule> rule = parse_inside_rule(how.inside);
    if (!rule) return std::move(rule).error().at("--inside");
    settings.rule = *rule;
  }
  ASPERITY_TRY(settings.shell_thickness, length("--shell-thickness", how.shell_thickness));
  return settings;
}

}  // namespace

Result<int> convert_mesh_file(const std::string& mesh_file, const std::string& vdb, const MeshConversion& how,
                              const Console& console) {
  ASPERITY_TRY(ConversionSettings settings, settings_of(how));
  const std::filesystem::path folder = std::filesystem::path(vdb).parent_path();
  std::error_code ignored;
  if (!folder.empty() && !std::filesystem::is_directory(folder, ignored))
    return Error{
        ErrorCode::file_unwritable, "cannot be created: its folder is not there", vdb, {}, "a folder that exists"};
  const auto begin = std::chrono::steady_clock::now();
  const Progress progress = console.progress();
  if (progress) progress("reading mesh", 0.0);
  Result<MeshSource> source = read_mesh(mesh_file);
  if (!source) return std::move(source).error().in_file(mesh_file);
  Result<TriangleMesh> mesh = TriangleMesh::build(std::move(source).value());
  if (!mesh) return std::move(mesh).error().in_file(mesh_file);
  for (const std::string& note : mesh->notes()) console.note(note);
  // Deep enough for laws that read the potential at the probe.
  constexpr double usual_depth = 0.1;
  if (how.band_inside.empty()) settings.band_inside = usual_depth * mesh->bounds().extent().maxCoeff();
  const TriangleIndex index = TriangleIndex::build(std::move(mesh).value());
  Result<ConvertedMesh> made = convert_mesh(index, settings, progress);
  if (!made) return std::move(made).error().in_file(mesh_file);
  for (const std::string& note : made->report.notes) console.note(note);
  ASPERITY_CHECK(write_sparse(vdb, made->grid, index.mesh().triangles().size(), progress));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const auto size = static_cast<double>(std::filesystem::file_size(vdb, ignored));
  const SparseGrid& grid = made->grid;
  if (console.json) {
    console.print(Json{{"file", vdb},
                       {"bytes", size},
                       {"voxel", grid.voxel()},
                       {"points", made->report.points},
                       {"bricks", grid.bricks()},
                       {"memory_bytes", grid.memory_bytes()},
                       {"inside", to_string(made->report.rule)},
                       {"largest_correction", made->report.largest_correction},
                       {"seconds", seconds}});
    return exit_success;
  }
  std::cout << fmt::format(
      "{}: {:.1f} MB, voxel {:.4g} of the mesh's unit, {} points in {} bricks ({:.1f} MB in memory), inside by {}, "
      "written in {:.1f} s\n",
      vdb, size * 1e-6, grid.voxel(), made->report.points, grid.bricks(),
      static_cast<double>(grid.memory_bytes()) * 1e-6, to_string(made->report.rule), seconds);
  return exit_success;
}

}  // namespace asperity::program
