#pragma once
// The part of `asperity convert` that makes potentials from meshes.

#include <string>

#include "apps/asperity/command.h"

namespace asperity::program {

/// What a mesh is converted with; lengths in the mesh file's own unit, empty: not given.
struct MeshConversion {
  std::string voxel, resolution, budget;
  std::string band_outside, band_inside;
  std::string inside, shell_thickness;
  [[nodiscard]] bool any() const {
    return !(voxel + resolution + budget + band_outside + band_inside + inside + shell_thickness).empty();
  }
};

/// Reads a mesh, converts it and writes a .vdb file in the mesh's own coordinates. Prints what came of it. [main]
Result<int> convert_mesh_file(const std::string& mesh, const std::string& vdb, const MeshConversion& how,
                              const Console& console);

}  // namespace asperity::program
