#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "asperity/core/progress.h"
#include "asperity/core/result.h"
#include "asperity/field/volume/scalar_grid.h"

namespace asperity {

/// Where the values of an array sit.
enum class Association : std::uint8_t {
  any,   ///< asking: whichever there is, nodes first
  node,  ///< on the grid's nodes
  cell,  ///< in the cells' middles
};
/// As in scene files and options.
template <>
struct Names<Association> {
  static constexpr auto table = std::to_array<Named<Association>>(
      {{Association::any, "any"}, {Association::node, "node"}, {Association::cell, "cell"}});
};

/// What is wanted of a volume file.
struct VolumeRequest {
  std::string array;  ///< empty: chosen, and said in the notes
  Association association = Association::any;
  bool vectors = false;  ///< choosing, or keeping all components: what is wanted are vectors
  int component = -1;    ///< of an array that has several, from 0; -1: all of them, which must be one or three
  std::string time;      ///< OpenFOAM: the step's name ("0.5"); empty: the last
  std::array<std::uint32_t, 3> resample{};        ///< nodes along x, y, z where there is no rectilinear grid; 0: chosen
  std::size_t most_bytes = std::size_t{8} << 30;  ///< of what is read; more is refused before it is allocated
};

/// One array of a volume file.
struct VolumeArray {
  std::string name;
  std::string type;  ///< "float32", "int16", ...: as in the file
  int components = 1;
  Association association = Association::node;
  std::size_t values = 0;  ///< tuples
  double lowest = 0.0;     ///< of all components; of those that are numbers
  double highest = 0.0;
  std::size_t unknown = 0;  ///< values that are not numbers
};

/// A volume as it was read: in the file's unit of length and the array's own unit.
struct VolumeSource {
  std::variant<ScalarGrid, VectorGrid> data;
  std::string array;
  std::string unit;        ///< of the samples, where the file states it
  bool cell_data = false;  ///< samples were given for cells and sit in their middles
  /// How far a resampled field is from the original one at the original's points (or cell centres): root of the mean
  /// square and largest difference, in the array's unit. 0: not resampled.
  double resample_rms = 0.0;
  double resample_max = 0.0;
  std::vector<VolumeArray> arrays;  ///< everything that the file holds
  std::vector<std::string> notes;   ///< what was chosen, repaired or left out

  [[nodiscard]] const GridAxes& axes() const {
    const auto* scalar = std::get_if<ScalarGrid>(&data);
    return scalar != nullptr ? scalar->axes() : std::get_if<VectorGrid>(&data)->axes;
  }
};

/// Reads one of the files that `needs_volume_reader` names.
using VolumeReader = Result<VolumeSource> (*)(const std::filesystem::path&, const VolumeRequest&, const Progress&);

/// Hands over the reader of formats that need a library of their own (asperity/io/vtk). nullptr takes it away. [main]
void register_volume_reader(VolumeReader reader);

/// Reads a volume. By its name:
///   .json           a sidecar: a JSON object that tells what a file of raw samples holds (see read_sidecar_volume)
///   .raw            the same; its sidecar is FILE.json, or FILE with .json for its suffix
///   .vtk .vti .vtr .vts .pvti .pvtr .vtu .nrrd .nhdr .foam, and the folder of an OpenFOAM case
///                   with the registered reader
/// Samples that are not numbers are kept, with a note. Axes that descend are turned round, with a note; those that are
/// even but for the rounding of float32 are made even. Errors, each
/// naming file and place: file_missing, file_empty, file_truncated, file_malformed, file_unsupported (also where a
/// reader is needed that is not there: what to install), bad_key, bad_type, bad_value (array or association that the
/// file does not hold, with what it holds), too_large. [build]
Result<VolumeSource> read_volume(const std::filesystem::path& path, const VolumeRequest& request = {},
                                 const Progress& progress = {});

/// Reads raw samples by their sidecar,
///   {"asperity_volume": 1, "file": "a.raw", "size": [64, 64, 32], "type": "float32" | "int16" | "uint8",
///    "byte_order": "little" | "big", "spacing": [1, 1, 2], "origin": [0, 0, 0]}
/// with "axes": {"x": [...], "y": [...], "z": [...]} in place of spacing and origin where nodes are not evenly spaced;
/// also "components": 1 | 3, "association": "node" | "cell", "array" and "unit" (names, for messages). `size` counts
/// samples; x runs fastest. The file holds exactly these samples. Errors as read_volume. [build]
Result<VolumeSource> read_sidecar_volume(const std::filesystem::path& path, const VolumeRequest& request = {},
                                         const Progress& progress = {});
/// The same from memory: the sidecar's text and the raw bytes, `name` standing for the file in messages. [build]
Result<VolumeSource> read_sidecar_volume(std::string_view sidecar, std::string_view samples, const std::string& name,
                                         const VolumeRequest& request = {});

/// Whether a path is, by its name, a volume: one that read_volume reads, or a bricked file (.aspvol). A .json file is
/// one if it is a sidecar. [any]
bool is_volume_path(const std::filesystem::path& path);
/// Whether a path is, by its name, a bricked file (.aspvol): BrickStore::open, not read_volume. [any]
bool is_bricked_path(const std::filesystem::path& path);
/// Whether read_volume needs the registered reader for a path. [any]
bool needs_volume_reader(const std::filesystem::path& path);
/// Suffixes that need it: ".vtk", ... [any]
std::span<const std::string> volume_reader_suffixes();

}  // namespace asperity
