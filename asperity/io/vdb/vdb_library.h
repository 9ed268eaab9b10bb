#pragma once
// Private to asperity/io/vdb: what its parts owe each other.

#include <filesystem>

#include "asperity/field/conversion/mesh_conversion.h"
#include "asperity/io/sparse_io.h"

namespace asperity::vdb_io {

/// Registers OpenVDB's types, once. [any]
void initialize();

/// OpenVDB's mesh conversion. Errors: too_large, bad_mesh. [build]
Result<std::vector<VoxelBlock>> voxelize(const VoxelRequest& request, const Progress& progress);

Result<SparseFile> read_file(const std::filesystem::path& path, const SparseRequest& request, const Progress& progress);
Status write_file(const std::filesystem::path& path, const SparseGrid& grid, std::size_t mesh_faces,
                  const Progress& progress);

}  // namespace asperity::vdb_io
