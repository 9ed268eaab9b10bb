#pragma once
// From a mesh to a signed potential near its surface (hybrid-surface-2004, Fig. 2).

#include <string>
#include <vector>

#include "asperity/core/names.h"
#include "asperity/core/progress.h"
#include "asperity/field/volume/sparse_grid.h"
#include "asperity/geometry/triangle_index.h"

namespace asperity {

/// What tells inside from outside.
enum class InsideRule : std::uint8_t {
  automatic,  ///< flood for closed, oriented meshes; winding where faces still tell their two sides apart; else shell
  flood,      ///< outside is what can be reached from far away
  winding,    ///< inside is where the generalised winding number exceeds 1/2 (Jacobson et al. 2013): bridges holes
  shell,      ///< no inside: the potential is the distance less half the shell's thickness
};
/// As in scene files and options.
template <>
struct Names<InsideRule> {
  static constexpr auto table = std::to_array<Named<InsideRule>>({{InsideRule::automatic, "automatic"},
                                                                  {InsideRule::flood, "flood"},
                                                                  {InsideRule::winding, "winding"},
                                                                  {InsideRule::shell, "shell"}});
};
/// Errors: bad_value listing the names. [any]
Result<InsideRule> parse_inside_rule(std::string_view name);

/// How a mesh becomes a potential. Of voxel, resolution and budget at most one is given; none: resolution 256.
struct ConversionSettings {
  double voxel = 0.0;            ///< distance of stored points (m)
  std::uint32_t resolution = 0;  ///< voxels along the mesh's longest side; 8 to 4096
  std::size_t budget_bytes = 0;  ///< the finest voxel whose grid takes at most this
  double band_outside = 0.0;     ///< how far out distances are stored (m); 0: three voxels, which is the least
  double band_inside = 0.0;      ///< how far in (m); 0: three voxels, which is the least; infinity: throughout
  InsideRule rule = InsideRule::automatic;
  double shell_thickness = 0.0;                   ///< of rule shell (m); 0: two voxels
  std::size_t most_bytes = std::size_t{8} << 30;  ///< of the grid; more is refused before it is made
};

/// What came of it.
struct ConversionReport {
  InsideRule rule = InsideRule::flood;  ///< the one that was used
  double voxel = 0.0;                   ///< m
  double shell_thickness = 0.0;         ///< m; 0 without a shell
  std::size_t points = 0;               ///< stored
  /// How far the converter's distances were from the exact ones before they were made exact (m).
  double largest_correction = 0.0;
  std::vector<std::string> notes;  ///< what was chosen and why, for people
};

/// A potential made from a mesh, and how.
struct ConvertedMesh {
  SparseGrid grid;
  ConversionReport report;
};

/// Converts a mesh: signed distance to its nearest face and that face's index at every stored point; both exact, by the
/// mesh's own search. Errors: bad_value (settings, with their names), too_large, file_unsupported (no voxeliser was
/// registered: what to install), bad_mesh (rule flood on a mesh that encloses nothing). [build]
Result<ConvertedMesh> convert_mesh(const TriangleIndex& mesh, const ConversionSettings& settings = {},
                                   const Progress& progress = {});

/// One 8 x 8 x 8 block of a voxeliser's answer: distances in voxels, negative inside; points beyond the band hold it.
struct VoxelBlock {
  std::array<std::int32_t, 3> at{};  ///< in blocks
  std::array<float, SparseBlock::points> distance{};
  std::array<std::uint32_t, SparseBlock::points> face{};  ///< no_index beyond the band
};
/// Positions in voxels (node (0, 0, 0) at the origin), bands in voxels. `signed_by_flood`: negative where the flood
/// from outside does not come; otherwise all distances are positive. [build]
struct VoxelRequest {
  std::vector<Vec3f> positions;
  std::span<const TriangleMesh::Triangle> triangles;
  float band_outside = 3.0F;
  float band_inside = 3.0F;
  bool signed_by_flood = true;
};
using MeshVoxelizer = Result<std::vector<VoxelBlock>> (*)(const VoxelRequest&, const Progress&);
/// Hands over the converter that a library of its own provides (asperity/io/vdb). nullptr takes it away. [main]
void register_mesh_voxelizer(MeshVoxelizer voxelizer);
/// Whether one was handed over. [any]
bool has_mesh_voxelizer();

}  // namespace asperity
