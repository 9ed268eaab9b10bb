#pragma once
// Sparse potentials in files (.vdb).

#include <filesystem>
#include <string>
#include <vector>

#include "asperity/core/progress.h"
#include "asperity/field/volume/sparse_grid.h"

namespace asperity {

/// One grid of a .vdb file.
struct SparseGridEntry {
  std::string name;
  std::string type;        ///< "float", "int32", ...
  std::string grid_class;  ///< "level set", "fog volume", ...
  double voxel = 0.0;      ///< in the file's unit
  std::size_t points = 0;  ///< active
};

/// What is wanted of a .vdb file.
struct SparseRequest {
  std::string grid;  ///< name of the distance grid; empty: the only level set, or the first, with a note
  std::size_t most_bytes = std::size_t{8} << 30;
};

/// A potential as it was read: in the file's unit of length.
struct SparseFile {
  SparseSource source;
  std::string grid;                      ///< the distance grid's name
  bool has_faces = false;                ///< a grid "face" came with it
  std::vector<std::string> channels;     ///< material grids that came with it
  std::size_t mesh_faces = 0;            ///< triangles of the mesh that the face indices are of; 0: not stated
  std::vector<SparseGridEntry> entries;  ///< everything that the file holds
  std::vector<std::string> notes;        ///< what was chosen, repaired or left out
};

using SparseReader = Result<SparseFile> (*)(const std::filesystem::path&, const SparseRequest&, const Progress&);
using SparseWriter = Status (*)(const std::filesystem::path&, const SparseGrid&, std::size_t mesh_faces,
                                const Progress&);
/// Hands over what reads and writes .vdb files (asperity/io/vdb). nullptr takes it away. [main]
void register_sparse_files(SparseReader reader, SparseWriter writer);
/// Whether a path is, by its name, a .vdb file. [any]
bool is_sparse_path(const std::filesystem::path& path);

/// Reads a .vdb file: the signed distance, and where they came along the closest faces ("face") and materials
/// ("stiffness", "damping", "static_friction", "dynamic_friction", "roughness"); level sets of other tools have the
/// distance alone. Fog volumes, grids whose voxels are no cubes along the axes, unsigned or empty grids are refused.
/// Errors, each naming file and place: file_missing, file_empty, file_truncated, file_malformed, file_unsupported (also
/// where the library is missing: what to install), bad_value (grid that the file does not hold, with what it holds),
/// too_large. [build]
Result<SparseFile> read_sparse(const std::filesystem::path& path, const SparseRequest& request = {},
                               const Progress& progress = {});
/// Writes a .vdb file whole or not at all. `mesh_faces`: triangles of the mesh that face indices are of, 0 without.
/// Errors: file_unwritable, file_unsupported. [build]
Status write_sparse(const std::filesystem::path& path, const SparseGrid& grid, std::size_t mesh_faces = 0,
                    const Progress& progress = {});

}  // namespace asperity
